"""Pieces that several explorers draw: the machine, a legend of the arms, the triangle of sliders for offsets."""

from __future__ import annotations

import numpy as np
from matplotlib.lines import Line2D

from ..figures.machine import arm_points
from ..figures.style import NEUTRAL, arm_colour, arm_line
from ..machine.manipulator import Manipulator, load
from .builder import slider

TIME = "time in s"


def frictionless(robot: Manipulator | None) -> Manipulator:
    """The given machine, or the testbed without friction."""
    return load().replace(friction=0.0) if robot is None else robot


def draw_machine(picture, panel: str, robot: Manipulator, q, arms=None, faint=()) -> None:
    """The arms at one pose q (2N,): filled circles are drives, open ones passive joints; `faint` arms are pale."""
    chains = arm_points(robot, q)
    for i in range(robot.n_arms) if arms is None else arms:
        points = chains[i]
        colour, alpha = arm_colour(i), 0.2 if i in faint else 1.0
        picture.line(panel, *points.T, color=colour, linewidth=4, alpha=alpha, solid_capstyle="round", zorder=3)
        picture.line(panel, *points[0], color=colour, marker="o", markersize=10, alpha=alpha, zorder=4)
        picture.line(
            panel,
            *points[1],
            color=colour,
            marker="o",
            markersize=6.5,
            alpha=alpha,
            markerfacecolor="white",
            markeredgewidth=2,
            zorder=4,
        )
    picture.line(
        panel,
        *chains[0, 2],
        color=NEUTRAL,
        marker="s",
        markersize=7,
        markerfacecolor="white",
        markeredgewidth=1.8,
        zorder=5,
    )


def legend(ax, entries) -> None:
    """A one-line legend above the panel, on the right; entries are (words, keywords of a line)."""
    handles = [Line2D([], [], **{"linewidth": 2, **style}) for _, style in entries]
    ax.legend(
        handles,
        [words for words, _ in entries],
        ncols=len(entries),
        loc="lower right",
        bbox_to_anchor=(1, 1),
        handlelength=1.7,
        columnspacing=0.9,
        handletextpad=0.6,
        borderaxespad=0.1,
        fontsize=9,
    )


def drive_legend(ax, robot: Manipulator, words: str = "drive") -> None:
    """A legend of the arms' colours."""
    legend(ax, [(f"{words} {i + 1}" if i == 0 else str(i + 1), arm_line(i)) for i in range(robot.n_arms)])


def offset_sliders(robot: Manipulator, values, limit: int = 20) -> dict:
    """One slider per drive, offset_1, offset_2, ..., in mrad."""
    values = np.resize(values, robot.n_arms)
    return {
        f"offset_{i + 1}": slider(f"offset {i + 1} in mrad", -float(limit), float(limit), 0.5, float(values[i]))
        for i in range(robot.n_arms)
    }


def per_drive(values, digits: int) -> str:
    """Numbers of all drives in one text, without a negative zero."""
    return " / ".join(f"{np.round(v, digits) + 0.0:.{digits}f}" for v in values)
