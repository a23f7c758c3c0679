"""Figures of lesson 09: clipped torques, room along the null vector, what drives can reach, where gears stay shut."""

from __future__ import annotations

import math

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import ListedColormap

from ...figures._shared import LEAST, no_finer
from ...figures.machine import plot_path
from ...figures.maps import grid_points, on_grid, pair_line, pair_name, plot_pair_curves
from ...figures.style import AFTER, ALARM, BEFORE, NEUTRAL, arm_line, axes_or_new
from ...machine.arguments import positive_number
from ...mechanics.actuation import control_matrix, drive_pairs, force_polygon, weighted_pseudoinverse
from ...mechanics.antagonism import common_sign
from ...mechanics.dynamics import minimal_dynamics
from ...mechanics.kinematics import inverse_kinematics


def plot_clipping(free, clipped, limit, axes=None):
    """Torques of a run without limits beside its `limit` in N m, and the errors of this run and of the clipped one.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting
    >>> path = rk.circle(rk.load(), 0.05, 1.0)
    >>> run = rk.simulate(rk.load(), rk.PD(7.05, 0.225), path)
    >>> ax = plotting.plot_clipping(run, rk.simulate(rk.load(), run.law, path, faults=[rk.TorqueLimit(0.1)]), 0.1)
    """
    axes = plt.subplots(1, 2, figsize=(10.0, 3.3))[1] if axes is None else axes
    for i, torque in enumerate(1e3 * free.c.T):
        axes[0].plot(free.t, torque, label=f"drive {i + 1}", **arm_line(i))
    for side in (-1e3 * limit, 1e3 * limit):
        axes[0].axhline(side, color=ALARM, ls=":")
    axes[0].set(xlabel="time in s", ylabel="torque in mN m", title="what the drives are asked for")
    columns = min(free.robot.n_arms, 4)
    axes[0].margins(y=0.2 * math.ceil(free.robot.n_arms / columns))  # room for each row of the legend
    axes[0].legend(ncols=columns, loc="upper center")
    for run, label, colour in ((clipped, "clipped", BEFORE), (free, "without limits", AFTER)):
        error = np.linalg.norm(run.x - run.trajectory.x[: len(run)], axis=-1)
        axes[1].plot(run.t, 1e3 * error, color=colour, label=label)
    axes[1].set(xlabel="time in s", ylabel="error in mm", title="what becomes of the path")
    no_finer(axes[1], LEAST * free.robot.lengths.max())
    axes[1].margins(y=0.25)  # room for the legend, above only
    axes[1].set_ylim(-0.04 * axes[1].get_ylim()[1])
    axes[1].legend(loc="upper right")
    return axes


def plot_room(c, n, limit, room, marks: dict, ax=None):
    """Torques c + mu n (m,) in mN m over the share mu of the null vector n, the limit, and the room between its ends.

    c : the torques of least size, N m.  limit : N m.  room : (2,) N m.  marks : dict of label -> mu in N m.

    >>> import numpy as np; from rapkm_lite import plotting
    >>> c, n = np.array([0.11, -0.06, -0.05]), np.full(3, 0.577)
    >>> ax = plotting.plot_room(c, n, 0.085, (-0.04, -0.045), {"least size": 0.0})
    """
    ax = axes_or_new(ax, figsize=(7.2, 3.7))
    c, n = np.asarray(c, dtype=float), np.asarray(n, dtype=float)
    reach = 1.5 * max(np.abs(room).max(), np.abs(list(marks.values())).max(), 1e-6)
    mu = np.array([-reach, reach])
    for i in range(len(c)):
        ax.plot(1e3 * mu, 1e3 * (c[i] + mu * n[i]), label=f"drive {i + 1}", **arm_line(i))
    ax.axhspan(-1e3 * limit, 1e3 * limit, color="#EEF1F4", zorder=0)
    if room[0] <= room[1]:
        ax.axvspan(1e3 * room[0], 1e3 * room[1], color="#C9D6E2", zorder=0.5, label="room")
    top = 1e3 * np.abs(c[:, None] + n[:, None] * mu).max()
    for k, (label, where) in enumerate(marks.items()):
        ax.axvline(1e3 * where, color=NEUTRAL, ls=":", lw=1.2)
        paper = {"facecolor": "white", "edgecolor": "none", "alpha": 0.9, "pad": 1.5}
        place = 1e3 * where, (1.08 + 0.18 * (k % 3)) * top
        ax.annotate(label, place, ha="center", va="bottom", fontsize=9, bbox=paper)
    ax.set(xlabel="share μ of the null vector in mN m", ylabel="torque in mN m", ylim=(-1.05 * top, 1.65 * top))
    ax.set_xlim(-1e3 * reach, 1e3 * reach)
    ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return ax


def shortest_reach(A, torque: float, n: int = 720) -> np.ndarray:
    """Outline (n, 2) in N of the forces whose torques of least size stay within `torque` N m, A (m, 2).

    >>> from rapkm_lite import plotting; plotting.shortest_reach([[1.0, 0.0], [0.0, 1.0]], 0.1, 4).round(3) + 0.0
    array([[ 0.1,  0. ],
           [ 0. ,  0.1],
           [-0.1,  0. ],
           [ 0. , -0.1]])
    """
    angle = 2 * np.pi * np.arange(n) / n
    way = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    return torque * way / np.abs(way @ weighted_pseudoinverse(A).T).max(axis=-1, keepdims=True)


def plot_accelerations(robot, places, limit: float, axes=None):
    """Accelerations at rest with torques up to `limit` N m at places (k, 2) in m: all drives, least size, each pair.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting
    >>> ax = plotting.plot_accelerations(rk.load(), [[0.0, 0.0], [-0.05, 0.0]], 0.085)
    """
    places, limit = np.asarray(places, dtype=float), positive_number("limit", limit)
    if axes is None:
        axes = plt.subplots(1, len(places), figsize=(3.5 * len(places) + 1.2, 3.6), squeeze=False)[1][0]
    size = 0.0
    for ax, x in zip(axes, places, strict=True):
        q = inverse_kinematics(robot, x)
        A = control_matrix(robot, q)
        G, _, weight = minimal_dynamics(robot, q, 0 * q, None)

        def accelerations(force, G=G, weight=weight):
            return np.linalg.solve(G, np.vstack([force, force[:1]]).T - weight[:, None])

        whole = accelerations(force_polygon(A, limit))
        ax.fill(*whole, color="#DCE3EA", label="all drives")
        ax.plot(*accelerations(shortest_reach(A, limit)), color=AFTER, lw=1.8, label="all, least size")
        for pair in drive_pairs(robot):
            look = pair_line(robot, pair) | {"lw": 1.2, "label": f"pair {pair_name(pair)}"}
            ax.plot(*accelerations(force_polygon(A[list(pair)], limit)), **look)
        size = max(size, 1.1 * np.abs(whole).max())
        left, up = np.round(1e3 * x, 3)
        ax.set_title(f"at ({left:zg}, {up:zg}) mm".replace("-", "−"))
        ax.set(xlabel="acceleration in x in m/s²", aspect="equal")
    for ax in axes:
        ax.set(xlim=(-size, size), ylim=(-size, size))
    axes[0].set_ylabel("acceleration in y in m/s²")
    handles, words = axes[0].get_legend_handles_labels()
    axes[0].figure.legend(handles, words, loc="outside right center", ncols=math.ceil(len(words) / 14))
    return axes


def plot_one_sign(trajectory, ax=None, n: int = 201):
    """Where in the workspace a prestress can load all drives with one sign, the curves of the pairs, and a path.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting
    >>> ax = plotting.plot_one_sign(rk.triangle(rk.load()), n=41)
    """
    ax = axes_or_new(ax, figsize=(6.4, 4.2))
    robot = trajectory.robot
    x, y, inside, points = grid_points(robot, n, driven=True)
    possible = on_grid(inside, common_sign(control_matrix(robot, inverse_kinematics(robot, points))))
    colours = ListedColormap(["#E8E4DC", "#B9CDE0"])
    ax.pcolormesh(x, y, possible, cmap=colours, vmin=0, vmax=1, shading="nearest", rasterized=True)
    plot_pair_curves(robot, ax, n=max(n, 81))
    plot_path(trajectory, ax)
    ax.fill([], [], color="#B9CDE0", label="one sign possible")
    ax.fill([], [], color="#E8E4DC", label="impossible without a force")
    ax.set(aspect="equal", xlabel="x in m", ylabel="y in m", xlim=x[[0, -1]], ylim=y[[0, -1]])
    ax.grid(False)
    ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return ax
