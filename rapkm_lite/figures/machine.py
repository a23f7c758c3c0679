"""The machine, its workspace and its path in the plane."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from ..machine.arguments import bounded, exact_array
from ..mechanics.kinematics import arm_vectors
from ..mechanics.maps import sampling_box, workspace_grid
from .style import NEUTRAL, arm_colour, arm_text_colour, axes_or_new


def arm_points(robot, q) -> np.ndarray:
    """Base, elbow and tip of every arm, (..., N, 3, 2) in m, at q (..., 2N).

    >>> import rapkm_lite as rk; from rapkm_lite import plotting
    >>> plotting.arm_points(rk.load(), rk.inverse_kinematics(rk.load(), [0.02, -0.03]))[:, 2].round(12).tolist()
    [[0.02, -0.03], [0.02, -0.03], [0.02, -0.03]]
    """
    a, d = arm_vectors(robot, q)
    return np.stack([robot.base + 0 * a, robot.base + a, robot.base + a + d], axis=-2)


def plot_machine(robot, q, ax=None, *, arms=None, alpha=1.0, labels=True):
    """Draw the arms at one pose q (2N,); `arms` picks some of them (0-based), each from its own base to its own tip.

    Filled circles are driven joints, open circles passive ones, the square is the end-effector.
    alpha : opacity, 0 to 1.  labels : number the drives.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting
    >>> ax = plotting.plot_machine(rk.load(), rk.inverse_kinematics(rk.load(), [0.02, -0.03]))
    """
    ax = axes_or_new(ax, figsize=(4.2, 4.2))
    chains = arm_points(robot, q)
    for i in range(robot.n_arms) if arms is None else arms:
        points = chains[i]
        ax.plot(*points.T, "-", color=arm_colour(i), lw=4, alpha=alpha, solid_capstyle="round", zorder=3)
        ax.plot(*points[0], "o", color=arm_colour(i), ms=11, alpha=alpha, zorder=4)
        ax.plot(*points[1], "o", mfc="white", mec=arm_colour(i), mew=2, ms=7, alpha=alpha, zorder=4)
        ax.plot(*points[2], "s", mfc="white", mec=NEUTRAL, mew=1.8, ms=8, alpha=alpha, zorder=5)
        if labels:
            # Opposite to the proximal link, where the arm itself seldom lies.
            away = (points[0] - points[1]) / robot.lengths[i, 0]
            look = {"color": arm_text_colour(i), "fontweight": "bold", "fontsize": 9, "ha": "center", "va": "center"}
            place = {"xytext": away * (36, 17), "textcoords": "offset points", "zorder": 6}
            ax.annotate(f"drive {i + 1}", robot.base[i], **place, **look)
    return plane_axes(robot, ax)


def plot_workspace(robot, ax=None, n: int = 240, colour: str = "#EEF2F6"):
    """Shade the points that all arms reach.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting
    >>> ax = plotting.plot_workspace(rk.load())
    """
    ax = axes_or_new(ax, figsize=(4.2, 4.2))
    # A little more than the workspace, so that its outline closes.
    left, right, low, high = sampling_box(robot)
    wide, tall = 0.01 * (right - left), 0.01 * (high - low)
    x, y, inside = workspace_grid(robot, n, (left - wide, right + wide, low - tall, high + tall))
    ax.contourf(x, y, inside.astype(float), levels=[0.5, 1.5], colors=[colour], zorder=0)
    ax.contour(x, y, inside.astype(float), levels=[0.5], colors=[NEUTRAL], linewidths=0.8, zorder=1)
    return plane_axes(robot, ax)


def plot_path(trajectory, ax=None, **line):
    """Draw the end-effector path.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting
    >>> ax = plotting.plot_path(rk.triangle(rk.load()))
    """
    ax = axes_or_new(ax, figsize=(4.2, 4.2))
    ax.plot(*trajectory.x.T, **({"color": NEUTRAL, "lw": 1.2, "zorder": 2} | line))
    return plane_axes(trajectory.robot, ax)


def plane_limits(robot, margin: float = 0.1) -> dict:
    """Keywords of ``Axes.set``: equal scales, units, and a frame that holds the machine in any pose.

    margin : room around the elbows, as a share of the longest link.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting
    >>> plotting.plane_limits(rk.load())["aspect"]
    'equal'
    """
    margin = float(bounded("margin", exact_array("margin", margin), 0.0, strict=False))
    room = robot.lengths[:, 0].max() + margin * robot.lengths.max()
    left, right, bottom, top = sampling_box(robot)
    low = np.minimum(robot.base.min(axis=0) - room, [left, bottom])
    high = np.maximum(robot.base.max(axis=0) + room, [right, top])
    frame = {"xlim": (low[0], high[0]), "ylim": (low[1], high[1])}
    return {"xlabel": "x in m", "ylabel": "y in m", "aspect": "equal"} | frame


def plane_axes(robot, ax: Axes | None):
    """The axes with the frame of `plane_limits`.

    >>> import rapkm_lite as rk; from matplotlib.figure import Figure; from rapkm_lite import plotting
    >>> plotting.plane_axes(rk.load(), Figure().add_subplot()).get_xlabel()
    'x in m'
    """
    ax = axes_or_new(ax)
    ax.set(**plane_limits(robot))
    return ax
