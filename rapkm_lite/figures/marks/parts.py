"""Marks that several pictures share: the machine, its workspace, bars per drive, legends."""

from __future__ import annotations

import re

import numpy as np

from ...machine.arguments import positive_number
from ...mechanics.actuation import drive_pairs
from ..machine import arm_points
from ..maps import pair_line, pair_name
from ..style import NEUTRAL, arm_colour, arm_line, arm_text_colour
from .plane import workspace_outline


def draw_machine(picture, panel: str, robot, q, arms=None, names: bool = True) -> None:
    """The arms at one pose q (2N,): filled circles are drives with their numbers, open ones passive joints.

    >>> import rapkm_lite as rk; from rapkm_lite import explore
    >>> robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> picture = explore.Picture({"a": {"xlim": (-0.3, 0.3), "ylim": (-0.3, 0.3)}})
    >>> explore.draw_machine(picture, "a", robot, q)
    """
    chains = arm_points(robot, q)
    open_joint = {"markersize": 6.5, "markerfacecolor": "white", "markeredgewidth": 2}
    for i in range(robot.n_arms) if arms is None else arms:
        colour, disc, points = arm_colour(i), arm_text_colour(i) if names else arm_colour(i), chains[i]
        picture.line(panel, *points.T, color=colour, linewidth=4, solid_capstyle="round", zorder=3)
        picture.line(panel, *points[0], color=disc, marker="o", markersize=10 + 5 * names, zorder=4)
        picture.line(panel, *points[1], color=colour, marker="o", zorder=4, **open_joint)
        if names:
            look = {"color": "white", "fontsize": 9, "fontweight": "bold", "ha": "center", "va": "center", "zorder": 5}
            picture.text(panel, *points[0], str(i + 1), **look)
    tip = {"marker": "s", "markersize": 7, "markerfacecolor": "white", "markeredgewidth": 1.8}
    picture.line(panel, *chains[0, 2], color=NEUTRAL, zorder=7, **tip)


def draw_workspace(picture, panel: str, robot, colour: str = "#EEF2F6") -> None:
    """Shade the points that all arms reach.

    >>> import rapkm_lite as rk; from rapkm_lite import explore
    >>> picture = explore.Picture({"a": {"xlim": (-0.3, 0.3), "ylim": (-0.3, 0.3)}})
    >>> explore.draw_workspace(picture, "a", rk.load())
    """
    look = {"facecolor": colour, "edgecolor": NEUTRAL, "linewidth": 0.8}
    picture.polygon(panel, workspace_outline(robot), zorder=0.2, **look)


def drive_lines(robot) -> list:
    """Entries of a legend: the arms' lines."""
    return [("drive " * (i == 0) + str(i + 1), arm_line(i)) for i in range(robot.n_arms)]


def pair_lines(robot) -> list:
    """Entries of a legend: the pairs' lines."""
    return [("pair " * (i == 0) + pair_name(p), pair_line(robot, p)) for i, p in enumerate(drive_pairs(robot))]


def drive_legend(picture, panel: str, robot) -> None:
    """A legend of the arms' lines.

    >>> import rapkm_lite as rk; from rapkm_lite import explore
    >>> picture = explore.Picture({"a": {"ylim": (0, 2)}})
    >>> explore.drive_legend(picture, "a", rk.load())
    """
    picture.legend(panel, drive_lines(robot))


def pair_legend(picture, panel: str, robot) -> None:
    """A legend of the pairs' lines.

    >>> import rapkm_lite as rk; from rapkm_lite import explore
    >>> picture = explore.Picture({"a": {"ylim": (0, 2)}})
    >>> explore.pair_legend(picture, "a", rk.load())
    """
    picture.legend(panel, pair_lines(robot))


def traces(picture, panel: str, t, values) -> None:
    """A curve over time for each drive; values (k, N)."""
    for i, column in enumerate(values.T):
        picture.trace(panel, t, column, **arm_line(i))


def zero_line(picture, panel: str) -> None:
    """A thin line where the values are zero."""
    picture.line(panel, picture.xlim(panel), [0, 0], color=NEUTRAL, linewidth=0.8, zorder=1.5)


def drive_axis(n: int) -> dict:
    """Keywords of a panel with one place for each of n drives."""
    return {"xlabel": "drive", "xticks": range(1, n + 1), "xlim": (0.4, n + 0.6)}


def bars(picture, panel: str, groups, width: float = 0.42, form: str = ".2f", times: float = 1.0) -> None:
    """One or more bars per drive with their numbers; groups are (values per drive, keywords of the bar).

    times : how many times the testbed's the numbers are, as for `told`.

    >>> from rapkm_lite import explore
    >>> picture = explore.Picture({"a": {"ylim": (0, 2)}})
    >>> explore.bars(picture, "a", [([1.0, 2.0, 1.5], {})])
    """
    width = positive_number("width", width)
    zero_line(picture, panel)
    said = [[_bar_words(value, form, times) for value in values] for values, _ in groups]
    size = 9 if sum(map(len, said)) < 8 and max(len(words) for row in said for words in row) < 7 else 7
    for k, (values, style) in enumerate(groups):
        for i, value in enumerate(values):
            at, words = i + 1 + (k - (len(groups) - 1) / 2) * width, said[k][i]
            picture.bar(panel, at, value, 0.92 * width, facecolor=arm_colour(i), **style)
            # Equal numbers of a drive are written once, between its bars.
            once = len({row[i] for row in said}) == 1
            if k == 0 or not once:
                va = "top" if words[0] == "−" else "bottom"
                picture.text(panel, i + 1 if once else at, value, words, ha="center", fontsize=size, va=va)


def _bar_words(value: float, form: str, times: float = 1.0) -> str:
    """A number without a negative zero; what rounding left of a tie does not tell equal numbers apart.

    >>> _bar_words(-11750.04, ".1f"), _bar_words(23517667.0, ".1f")
    ('−11750', '2.35e7')
    """
    if _far(times):
        return told(value, 2, times).replace("-", "−")
    if abs(value) >= 1000:
        return _three_digits(value).replace("-", "−")
    return re.sub("^−(?=[0.]+$)", "", format(np.round(value, 9), form).replace("-", "−"))


def _three_digits(value: float) -> str:
    """Three significant digits; whole from 1000 to a million, beyond with a short exponent.

    >>> _three_digits(0.04762), _three_digits(127000.4), _three_digits(2.351e7)
    ('0.0476', '127000', '2.35e7')
    """
    return f"{value:.0f}" if 1000 <= abs(value) < 1e6 else re.sub(r"e\+?(-?)0*", r"e\1", f"{value:.3g}")


def _far(times: float) -> bool:
    return not 0.03 < times < 30


def told(value: float, digits: int, times: float = 1.0) -> str:
    """A number with so many decimals and no negative zero; three significant digits where it is far from the testbed's.

    times : how many times the testbed's such numbers are; what would be zero there is zero here.

    >>> told(-0.001, 2), told(1234.5678, 2), told(1.2345e-7, 2, 4e-8), told(1e-12, 2, 4e-8), told(7654321.0, 1, 1e5)
    ('0.00', '1234.57', '1.23e-7', '0', '7.65e6')
    """
    if _far(times):
        value = value if abs(value / times) > 0.5 * 10**-digits else 0.0
        return _three_digits(value)
    return f"{np.round(np.round(value, digits + 6), digits) + 0.0:.{digits}f}"


def per_drive(values, digits: int, times: float = 1.0) -> str:
    """Numbers of all drives in one text, each as `told`.

    >>> per_drive([0.25, -0.001], 2)
    '0.25 / 0.00'
    """
    return " / ".join(told(v, digits, times) for v in values)


def offset_values(values: dict, n: int) -> np.ndarray:
    """The offsets (n,) in rad from the settings offset_1, offset_2, ... in mrad."""
    return 1e-3 * np.array([values[f"offset_{i + 1}"] for i in range(n)])
