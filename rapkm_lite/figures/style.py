"""Colours and the style file.  One colour per arm everywhere, at least 3:1 on white and apart for colour-blind eyes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import matplotlib.style

STYLE = Path(__file__).with_name("rapkm.mplstyle")
# Blue, red, olive; then teal, purple, brown.  Text in an arm's colour takes the darker tone, at least 4.5:1 on white.
ARM_COLOURS = ("#004488", "#BB5566", "#948A00", "#3997BF", "#8A3FC0", "#4D2020")
ARM_TEXT_COLOURS = ("#004488", "#BB5566", "#7D7400", "#237C9E", "#8A3FC0", "#4D2020")
# Pairs of drives, unless each leaves out one of three arms: colours that no arm has.
PAIR_COLOURS = ("#C77A00", "#00805A", "#C2188B", "#0B3F4C", "#A47CBF", "#731700")
# One more than there are colours, all different: 42 lines can be told apart, more than the 36 pairs of nine drives.
_DASHES = ((5, 1.2), (4, 1.2, 1, 1.2), (1.5, 1.2), (6, 1.2, 1, 1.2, 1, 1.2), (4, 3), (10, 3))
ARM_LINES = ("-", *((0, dashes) for dashes in _DASHES))
# Without / with filter, wrong / right, and what belongs to no arm.
BEFORE, AFTER, NEUTRAL, ALARM = "#999999", "#222222", "#555555", "#CC3311"


def use_style() -> None:
    """Make the collection's look the default from now on; called by the first cell of a lesson.

    >>> import matplotlib.pyplot as plt; from rapkm_lite import plotting
    >>> with plt.rc_context(): plotting.use_style()
    """
    plt.style.use(STYLE)


def arm_colour(i: int) -> str:
    """Colour of arm i (0-based).

    >>> from rapkm_lite import plotting; plotting.arm_colour(0)
    '#004488'
    """
    return ARM_COLOURS[i % len(ARM_COLOURS)]


def arm_text_colour(i: int) -> str:
    """Colour of text that belongs to arm i (0-based), readable on white.

    >>> from rapkm_lite import plotting; plotting.arm_text_colour(0)
    '#004488'
    """
    return ARM_TEXT_COLOURS[i % len(ARM_TEXT_COLOURS)]


def arm_line(i: int) -> dict:
    """Colour and dashes of arm i (0-based), as keywords for ``ax.plot``.

    >>> from rapkm_lite import plotting; plotting.arm_line(0)
    {'color': '#004488', 'linestyle': '-'}
    """
    return {"color": arm_colour(i), "linestyle": ARM_LINES[i % len(ARM_LINES)]}


def axes_or_new(ax=None, **figure):
    """The given axes, or the axes of a new figure in the collection's style.

    >>> from rapkm_lite import plotting; ax = plotting.axes_or_new(figsize=(4.0, 3.0))
    """
    if ax is not None:
        return ax
    # The figure comes first: a backend that is loaded inside a style context is not interactive when the context ends,
    # and a notebook would show no figure any more.
    settings: dict[str, Any] = {"figsize": (8.0, 3.2)} | figure
    fig = plt.figure(layout="constrained", **settings)
    with matplotlib.style.context(STYLE):
        return fig.add_subplot()
