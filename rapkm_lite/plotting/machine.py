"""The mechanism, its workspace and its path (figs. 1 to 3)."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np

from ..mechanics.actuation import drive_pairs
from ..mechanics.closure import estimate_pose
from ..mechanics.kinematics import arm_vectors, forward_kinematics, inverse_kinematics, reachable, working_modes
from .style import AFTER, ALARM, BEFORE, NEUTRAL, arm_colour, axes_or_new


def plot_machine(robot, q, ax=None, *, arms=None, alpha=1.0, labels=True):
    """Draw the arms at one pose q (2N,); `arms` picks some of them (0-based), each from its own base to its own tip.

    Filled circles are driven joints, open circles passive ones, the square is the end-effector.
    """
    ax = axes_or_new(ax, figsize=(4.2, 4.2))
    a, d = arm_vectors(robot, q)
    for i in range(robot.n_arms) if arms is None else arms:
        points = np.stack([robot.base[i], robot.base[i] + a[i], robot.base[i] + a[i] + d[i]])
        ax.plot(*points.T, "-", color=arm_colour(i), lw=4, alpha=alpha, solid_capstyle="round", zorder=3)
        ax.plot(*points[0], "o", color=arm_colour(i), ms=11, alpha=alpha, zorder=4)
        ax.plot(*points[1], "o", mfc="white", mec=arm_colour(i), mew=2, ms=7, alpha=alpha, zorder=4)
        ax.plot(*points[2], "s", mfc="white", mec=NEUTRAL, mew=1.8, ms=8, alpha=alpha, zorder=5)
        if labels:
            # Opposite to the proximal link, where the arm itself seldom lies.
            away = -a[i] / np.hypot(*a[i])
            ax.annotate(f"drive {i + 1}", robot.base[i], xytext=away * (36, 17), textcoords="offset points",
                        ha="center", va="center", color=arm_colour(i), fontweight="bold", fontsize=9, zorder=6)
    return plane_axes(robot, ax)


def plot_workspace(robot, ax=None, n: int = 240, colour: str = "#EEF2F6"):
    """Shade the points that all arms reach."""
    ax = axes_or_new(ax, figsize=(4.2, 4.2))
    # A little more than the workspace, so that its outline closes.
    x, y = (v.mean() + 1.02 * (v - v.mean()) for v in plane_grid(robot, n))
    inside = reachable(robot, np.stack([x, y], axis=-1))
    ax.contourf(x, y, inside.astype(float), levels=[0.5, 1.5], colors=[colour], zorder=0)
    ax.contour(x, y, inside.astype(float), levels=[0.5], colors=[NEUTRAL], linewidths=0.8, zorder=1)
    return plane_axes(robot, ax)


def plot_path(trajectory, ax=None, **line):
    """Draw the end-effector path."""
    ax = axes_or_new(ax, figsize=(4.2, 4.2))
    ax.plot(*trajectory.x.T, **({"color": NEUTRAL, "lw": 1.2, "zorder": 2} | line))
    return plane_axes(trajectory.robot, ax)


def plot_working_modes(robot, x, axes=None):
    """The machine at the point x (2,) in m, once per working mode; returns the axes."""
    modes = working_modes(robot)
    if axes is None:
        axes = plt.subplots(2, len(modes) // 2, figsize=(2.5 * len(modes) // 2, 5.2), sharex=True, sharey=True)[1]
    for ax, mode in zip(np.ravel(axes), modes, strict=True):
        plot_machine(robot, inverse_kinematics(robot, x, mode), ax, labels=False)
        ax.set_title("(" + ", ".join("+" if s > 0 else "−" for s in mode) + ")", loc="center")
        ax.label_outer()
    return axes


def _pair_poses(robot, q_a, guess) -> dict:
    """What each equivalent five-bar (fig. 3) makes of measured base angles q_a (N,) in rad, by pair of drives.

    Each value is the configuration (4,) in rad of ``robot.with_arms(pair)``, found from the point `guess` (2,) in m.
    """
    pairs = drive_pairs(robot)
    return {pair: estimate_pose(robot.with_arms(pair), np.asarray(q_a)[list(pair)], guess) for pair in pairs}


def plot_synchronization(robot, x, offset, axes=None, magnify: float = 20.0):
    """The machine at x (2,) in m as two five-bars that share a drive (fig. 3), with offsets (N,) in rad.

    Left: both five-bars as their measured angles say, the offsets magnified.  Right: in mm about x, the end-effector
    as each pair of drives sees it, and the least-squares pose of all of them.  Returns both axes.
    """
    axes = plt.subplots(1, 2, figsize=(9.4, 4.6), width_ratios=(1, 1.1))[1] if axes is None else axes
    x, offset = np.asarray(x, dtype=float), np.asarray(offset, dtype=float)
    true = inverse_kinematics(robot, x)[: robot.n_arms]
    pairs = drive_pairs(robot)
    shown = _pair_poses(robot, true + magnify * offset, x)
    for pair, face in zip((pairs[0], pairs[-1]), ("white", ALARM), strict=True):
        five_bar = robot.with_arms(pair)
        a, d = arm_vectors(five_bar, shown[pair])
        for k, i in enumerate(pair):
            points = np.stack([robot.base[i], robot.base[i] + a[k], robot.base[i] + a[k] + d[k]])
            axes[0].plot(*points.T, "-" if face == "white" else "--", color=arm_colour(i), lw=3.2, zorder=3)
            axes[0].plot(*points[0], "o", color=arm_colour(i), ms=11, zorder=4)
            axes[0].plot(*points[1], "o", mfc="white", mec=arm_colour(i), mew=2, ms=7, zorder=4)
        axes[0].plot(*points[2], "s", mfc=face, mec=NEUTRAL, mew=1.8, ms=9, zorder=5,
                     label=f"seen by drives {pair[0] + 1} and {pair[1] + 1}")
    axes[0].plot(*x, "+", color=AFTER, ms=14, mew=1.6, zorder=6, label="true end-effector")
    plane_axes(robot, axes[0])
    low, high = robot.base.min(axis=0) - 0.11, robot.base.max(axis=0) + 0.08
    axes[0].set(xlim=(low[0], high[0]), ylim=(low[1], high[1] + 0.13), title=f"offsets magnified {magnify:g} times")
    axes[0].legend(loc="upper left")

    seen = _pair_poses(robot, true + offset, x)
    points = {pair: forward_kinematics(robot.with_arms(pair), q) for pair, q in seen.items()}
    _plot_beliefs(robot, x, points, forward_kinematics(robot, estimate_pose(robot, true + offset, x)), axes[1])
    return axes


def _plot_beliefs(robot, x, points: dict, estimate, ax) -> None:
    """Points (2,) in m by pair of drives, the least-squares point and the true one, in mm about x."""
    corners = 1e3 * (np.array([*points.values()]) - x)
    ax.fill(*corners.T, color="#EEF2F6", ec=BEFORE, lw=1, zorder=1)
    for (j, k), corner in zip(points, corners, strict=True):
        ax.plot(*corner, "s", ms=10, color=arm_colour(j), markerfacecoloralt=arm_colour(k), fillstyle="left", mec="k")
        side = np.sign(corner[1] - corners[:, 1].mean())  # the name stands outside the triangle
        ax.annotate(f"drives {j + 1}, {k + 1}", corner, xytext=(0, 14 * side), textcoords="offset points",
                    ha="center", va="center", fontsize=9.5)
    ax.plot(*(1e3 * (estimate - x)), "D", color=NEUTRAL, ms=7)
    ax.annotate("least squares", 1e3 * (estimate - x), xytext=(0, -13), textcoords="offset points",
                ha="center", va="center", fontsize=9.5)
    ax.plot(0, 0, "+", color=AFTER, ms=14, mew=1.6)
    ax.annotate("true", (0, 0), xytext=(10, -4), textcoords="offset points", fontsize=9.5)
    ax.set_aspect("equal", adjustable="datalim")
    ax.margins(0.35)
    ax.set(xlabel="x − true x in mm", ylabel="y − true y in mm", title="the same, true size, close up")


def plane_grid(robot, n: int) -> tuple[np.ndarray, np.ndarray]:
    """n x n grids x, y in m over the box that all arms reach into: centres of n x n cells, none on the edge."""
    reach = robot.lengths.sum(axis=1)[:, None]
    low, high = (robot.base - reach).max(axis=0), (robot.base + reach).min(axis=0)
    place = (np.arange(n) + 0.5) / n
    return tuple(np.meshgrid(*(low[:, None] + place * (high - low)[:, None])))


def plane_axes(robot, ax):
    """Equal scales, units, and a frame that holds the machine in any pose."""
    ax.set_aspect("equal")
    ax.set_xlabel("x in m")
    ax.set_ylabel("y in m")
    room = robot.lengths[:, 0].max() + 0.1 * robot.lengths.max()
    low, high = robot.base.min(axis=0) - room, robot.base.max(axis=0) + room
    ax.set_xlim(low[0], high[0])
    ax.set_ylim(low[1], high[1])
    return ax
