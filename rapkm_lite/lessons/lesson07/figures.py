"""Figures of lesson 07: two five-bars on one edge, contradiction over the distance of via points, where they belong."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np

from ...figures._shared import with_looks
from ...figures.maps import pair_line, pair_name
from ...figures.style import AFTER, ALARM, BEFORE, NEUTRAL, axes_or_new
from ...mechanics.closure import estimate_pose
from ...mechanics.kinematics import forward_kinematics, inverse_kinematics


def plot_five_bar_curves(robot, start, end, axes=None):
    """Fig. 3: drives that move along one straight line in joint space from `start` to `end`, (2,) in m.

    Left: the end-effector of the pairs (1,2) and (2,3), and the straight line.  Right: the two joint subspaces, the
    moves as they are commanded and as the straight line in the plane would need them (dotted).  Returns both axes.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting
    >>> ax = plotting.plot_five_bar_curves(rk.load(), [-0.05, 0.0], [0.05, 0.0])
    """
    axes = plt.subplots(1, 2, figsize=(9.6, 3.7), width_ratios=(1.25, 1))[1] if axes is None else axes
    part = np.linspace(0, 1, 81)[:, None]
    line = start + part * np.subtract(end, start)
    needed = np.unwrap(inverse_kinematics(robot, line), axis=0)
    straight = needed[0] + part * (needed[-1] - needed[0])
    axes[0].plot(*(1e3 * line.T), color="#BBBBBB", lw=5, label="desired", zorder=1)
    axes[1].plot([], [], ":", color=NEUTRAL, label="what the edge needs")
    for pair in ((0, 1), (1, 2))[: robot.n_arms - 1]:
        five_bar, (j, k), style = robot.with_arms(pair), pair, pair_line(robot, pair)
        x = [line[0]]
        for angles in straight[1:, list(pair)]:
            x.append(forward_kinematics(five_bar, estimate_pose(five_bar, angles, x[-1])))
        axes[0].plot(*(1e3 * np.array(x).T), label=f"drives {pair_name(pair)}", **style)
        ends = np.degrees(straight - straight[0])
        axes[1].plot(ends[:, j], ends[:, k], label=f"drives {pair_name(pair)}", **style)
        way = np.degrees(needed - needed[0])
        axes[1].plot(way[:, j], way[:, k], ":", color=style["color"])
    for point in (line[0], line[-1]):
        axes[0].plot(*(1e3 * point), "o", color=AFTER, ms=6, zorder=4)
    low, high = axes[0].get_ylim()
    axes[0].set(xlabel="x in mm", ylabel="y in mm", aspect="equal", title="in the plane")
    axes[0].set_ylim(low, high + 110 * robot.lengths.max())  # room for the words above
    axes[0].legend(loc="upper center", ncols=3)
    axes[1].set(xlabel="turn of the first drive of the pair in °", ylabel="turn of the second in °")
    axes[1].set_title("in the joint subspaces")
    axes[1].legend(loc="best")
    return axes


def plot_spacing(spacing, gap, marked=None, ax=None):
    """Largest contradiction `gap` (k,) in rad over the distance of via points (k,) in m, with a line of slope two.

    marked : a level in rad to compare with, as (words, number).

    >>> from rapkm_lite import plotting; ax = plotting.plot_spacing([0.015, 0.03], [1.7e-3, 7e-3], ("offsets", 5e-3))
    """
    ax, spacing, gap = axes_or_new(ax, figsize=(6.4, 3.4)), np.asarray(spacing), np.asarray(gap)
    ax.loglog(1e3 * spacing, 1e3 * gap[-1] * (spacing / spacing[-1]) ** 2, "--", color=NEUTRAL, label="slope two")
    ax.loglog(1e3 * spacing, 1e3 * gap, "o", color=AFTER, label="this edge")
    if marked is not None:
        words, level = marked
        ax.axhline(1e3 * level, color=ALARM, ls=":", label=words)
    ax.set(xlabel="distance of the via points in mm", ylabel="largest contradiction in mrad")
    ax.legend(loc="upper left")
    return ax


def plot_demand(part, demand, points: dict, ax=None):
    """|eta^T q_a''| (k,) in rad along an edge, at the shares `part` (k,) of the way, and via points as ticks on it.

    points : one or two, of label -> shares of the way between 0 and 1.

    >>> from rapkm_lite import plotting
    >>> ax = plotting.plot_demand([0.0, 0.5, 1.0], [0.1, 0.05, 0.1], {"equal distances": [0.25, 0.5, 0.75]})
    """
    ax = axes_or_new(ax, figsize=(8.0, 3.2))
    ax.plot(part, demand, color=AFTER)
    top = max(np.max(demand), 1e-9)  # less is rounding
    for row, ((label, shares), colour) in enumerate(with_looks("points", points, (BEFORE, ALARM))):
        level = -(row + 1) * 0.13 * top
        ax.plot(shares, np.full(len(shares), level), "o", ms=6, color=colour, label=label)
    ax.axhline(0, color="#BBBBBB", lw=0.8)
    ax.set(xlabel="share of the edge", ylabel="$|\\eta^T q_a''|$ in rad", xlim=(0, 1), ylim=(-0.45 * top, 1.1 * top))
    # Below zero stand the via points, which have no value.
    ax.set_yticks([tick for tick in ax.get_yticks() if 0 <= tick <= 1.1 * top])
    ax.legend(loc="upper right")
    return ax
