"""The machine, its workspace and its path in the plane."""

from __future__ import annotations

import numpy as np

from ..mechanics.kinematics import arm_vectors, reachable
from .style import NEUTRAL, arm_colour, axes_or_new


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
