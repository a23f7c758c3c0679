"""A student's own wrong or close answer in the picture that it feeds: thick dots, which no curve of a lesson has."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from .checker import own_answer


def draw_own(name: str, curve: Callable[..., Any], ax, per_arm: bool = False) -> None:
    """Draw what the student's own answer gives, dotted, when it is wrong or close, and print which line is which.

    name : of the exercise.
    curve : answer -> (x, y), as for ``ax.plot``; the answer is the student's value, or function, called with copies.
    per_arm : one column of y for each arm, in its colour.

    Nothing happens when the answer is right or not there yet; one that cannot be drawn ends in a sentence.
    Raises ValueError for an unknown exercise.

    >>> from rapkm_lite import checks; shift = checks.check("03.rest_error", ...)
    TODO 03.rest_error: not yet
    >>> checks.draw_own("03.rest_error", lambda own: ([0.0, 1.0], own), ax=None)
    """
    from ..figures.style import ALARM, arm_colour  # matplotlib is not needed for a check

    verdict, own = own_answer(name)
    if own is None:
        return
    try:
        x, y = (np.asarray(v, dtype=float) for v in curve(own))
        if not np.any(np.isfinite(y)):
            raise ValueError("nothing to be seen")
        limits = ax.get_xlim(), ax.get_ylim()
        lines = ax.plot(x, y, linestyle=(0, (0.01, 1.6)), dash_capstyle="round", color=ALARM, linewidth=3.0, zorder=8)
    except Exception as error:
        print(f"Your own {name} cannot be drawn here ({type(error).__name__}); the lesson goes on with the package's.")
        return
    if not np.all(np.isfinite(y)) or np.max(np.abs(y), initial=0.0) > 20 * max(map(abs, limits[1])):
        ax.set(xlim=limits[0], ylim=limits[1])
    if per_arm:
        for i, line in enumerate(lines):
            line.set_color(arm_colour(i))
    word = {"close": "close", "wrong": "not yet right"}[verdict]
    print(f"Thick dots: your own {name} ({word}). All other curves: the package's, with which the lesson goes on.")
