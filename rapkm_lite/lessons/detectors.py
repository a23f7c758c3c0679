"""Names for mistakes: what turns the right answers of all cases into the given ones."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np

from .algebra import argument_factor, combination, constant_factor, from_argument, function_of, mixture, shifted
from .seen import Seen, alike, largest, ratio_of, rounding

# Factor -> what it tells.
FACTORS = {
    1000.0: "the answer is 1000 times too large: a factor of 1000, units (milli)",
    1e-3: "the answer is 1000 times too small: a factor of 1000, units (milli)",
    1e6: "the answer is 10^6 times too large: units (micro, or milli twice)",
    1e-6: "the answer is 10^6 times too small: units (micro, or milli twice)",
    100.0: "the answer is 100 times too large: units (centi, percent)",
    0.01: "the answer is 100 times too small: units (centi, percent)",
    180 / np.pi: "the answer is 180/pi times too large: units, degrees instead of radians",
    np.pi / 180: "the answer is 180/pi times too small: units, radians taken for degrees",
    (180 / np.pi) ** 2: "the answer is (180/pi)^2 times too large: units, degrees instead of radians, squared",
    (np.pi / 180) ** 2: "the answer is (180/pi)^2 times too small: units, radians taken for degrees, squared",
    2.0: "the answer is twice the right one: a factor of 2 too many",
    0.5: "the answer is half the right one: a factor of 2 is missing",
    2 * np.pi: "the answer is 2 pi times too large: a factor of 2 pi, turns against radians",
    0.5 / np.pi: "the answer is 2 pi times too small: a factor of 2 pi is missing, turns against radians",
    np.pi: "the answer is pi times too large: a factor of pi too many",
    1 / np.pi: "the answer is pi times too small: a factor of pi is missing",
    4.0: "the answer is 4 times too large: a factor of 4, perhaps a 2 that was squared",
    0.25: "the answer is 4 times too small: a factor of 4 is missing, perhaps a 2 that was squared",
    4 * np.pi**2: "the answer is 4 pi^2 times too large: a factor of (2 pi)^2, turns against radians, Hz against rad/s",
    0.25 / np.pi**2: "the answer is 4 pi^2 times too small: a factor of (2 pi)^2, turns against radians, Hz or rad/s",
    60.0: "the answer is 60 times too large: units, minutes against seconds",
    1 / 60: "the answer is 60 times too small: units, minutes against seconds",
}


def coarse(seen: Seen) -> str:
    """Numbers that are right but for rounding to some decimals, or to single precision."""
    flat = [np.concatenate([np.ravel(array) for array in arrays]) for arrays in (seen.got, seen.want)]
    least = rounding(seen.want)
    if flat[0].shape != flat[1].shape or any(largest(g - w) > max(0.1 * largest(w), least) for g, w, _ in seen):
        return ""
    got, off = flat[0], largest(flat[0] - flat[1])
    for decimals in range(2, 9):
        if off <= 0.51 * 10**-decimals and np.array_equal(got, np.round(got, decimals)):
            return f"the numbers are rounded to {decimals} decimals"
    single = off <= 1e-5 * largest(flat[1]) and np.array_equal(got, got.astype(np.float32))
    return "the numbers are in single precision (float32)" * bool(single)


def nothing(seen: Seen) -> str:
    """Zero everywhere, if only but for rounding, or the same for different cases."""
    if any(np.any(w) for w in seen.want) and not any(np.any(g) for g in seen.got):
        return "the answer is zero"
    if all(largest(g) <= 1e-9 * largest(w) for g, w, _ in seen):
        return "the answer is zero but for rounding"
    first = seen.got[0]
    varies = len(seen.got) > 1 and not all(alike(seen.want[0], w, 1e-3) for w in seen.want[1:])
    if varies and all(g.shape == first.shape and np.array_equal(g, first) for g in seen.got):
        return "the answer is the same for every case: it does not depend on the arguments"
    return ""


def sign(seen: Seen) -> str:
    """Opposite, lost, or opposite in some entries."""
    if seen.same([-w for w in seen.want]):
        return "the answer has the opposite sign"
    if seen.same([np.abs(w) for w in seen.want]):
        return "the answer has lost its signs: it is the absolute value"
    least = rounding(seen.want)
    if all(alike(w, g, seen.slack, least) or alike(-w, g, seen.slack, least) for g, w, _ in seen):
        return "the size is right, but in some cases the sign is opposite"
    sizes = ([np.abs(v) for v in side] for side in (seen.want, seen.got))
    return _some_signs(seen) if seen.agree(*sizes) else ""


def _some_signs(seen: Seen) -> str:
    """Words for the rows, columns or entries that have the opposite sign throughout."""
    limit = seen.slack * max(map(largest, seen.want))
    flipped = [(np.abs(g - w) > limit, np.abs(2.0 * w) > limit) for g, w, _ in seen]
    for axis, word in ((0, "row"), (1, "column")) if seen.want[0].ndim == 2 else ((0, "entry"),):
        lines = [(off.swapaxes(0, axis), can.swapaxes(0, axis)) for off, can in flipped]
        hit = sorted({int(place[0]) for off, _ in lines for place in np.argwhere(off)})
        whole = all(np.array_equal(off[i : i + 1], can[i : i + 1]) for off, can in lines for i in hit)
        if whole and len(hit) < seen.want[0].shape[axis] and len(hit) <= 2:
            return f"the sign of {word} {' and '.join(str(i) for i in hit)} (counted from 0) is opposite"
    return "the size of every entry is right, but some have the opposite sign"


def known_factor(seen: Seen) -> str:
    """A constant factor that has a meaning of its own."""
    k = ratio_of(seen.got, seen.want)
    # However rough an answer is, 3 is not pi, nor 60 a turn from radians to degrees.
    near = min(1e-4 + seen.slack, 0.02)
    for factor, words in FACTORS.items():
        if abs(abs(k) / factor - 1.0) < near and seen.same([np.sign(k) * factor * w for w in seen.want]):
            return words + ", and the sign is opposite" * (k < 0)
    return ""


def transposed(seen: Seen) -> str:
    """A square matrix with rows and columns exchanged."""
    if all(w.ndim >= 2 and w.shape[-1] == w.shape[-2] for w in seen.want):
        for s, words in ((1, ""), (-1, ", and the sign is opposite")):
            if seen.same([s * np.swapaxes(w, -1, -2) for w in seen.want]):
                return "the answer is transposed: rows and columns are exchanged" + words
    return ""


def _reordered(got: np.ndarray, want: np.ndarray, slack: float, least: float) -> bool:
    """True when the rows of one are the rows of the other in some order."""
    left, limit = list(range(len(want))), max(slack * max(largest(want), 1e-300), least)
    for row in got:
        match = next((i for i in left if largest(want[i] - row) <= limit), None)
        if match is None:
            return False
        left.remove(match)
    return True


def order(seen: Seen) -> str:
    """Rows, columns or entries exchanged."""
    if not all(w.ndim in (1, 2) and w.size > 1 for w in seen.want):
        return ""
    close = seen.slack, rounding(seen.want)
    for s, words in ((1, ""), (-1, ", and the sign is opposite")):
        if all(_reordered(s * g, w, *close) for g, w, _ in seen):
            return ("the rows stand" if seen.want[0].ndim == 2 else "the entries stand") + " in another order" + words
        if seen.want[0].ndim == 2 and all(_reordered(s * g.T, w.T, *close) for g, w, _ in seen):
            return "the columns stand in another order" + words
    if all(_reordered(g.ravel(), w.ravel(), *close) for g, w, _ in seen):
        return "the numbers are right, but they stand in another order (rows and columns)"
    return ""


def another_frame(seen: Seen) -> str:
    """Vectors of the plane, all turned by the same angle or mirrored."""
    if not all(w.ndim in (1, 2) and w.shape[-1] == 2 for w in seen.want) or sum(w.size for w in seen.want) < 6:
        return ""
    got, want = (np.concatenate([v.reshape(-1, 2) for v in side]) for side in (seen.got, seen.want))
    U, _, Vt = np.linalg.svd(want.T @ got)
    turn = U @ Vt
    if not alike(want @ turn, got, seen.slack):
        return ""
    if np.linalg.det(turn) < 0:
        return "the vectors are mirrored: x and y are exchanged, or one axis points the other way (another frame)"
    angle = np.degrees(np.arctan2(turn[0, 1], turn[0, 0]))
    if abs(angle) < 1.0 + np.degrees(2 * seen.slack):
        return ""
    return f"the vectors are all turned by {angle:.0f} degrees: they are given in another frame"


PLAIN: tuple[Callable[[Seen], str], ...] = nothing, sign, known_factor, transposed, from_argument, order, another_frame
# These find a number, from which a right answer can be told.
FITTED: tuple[Callable[[Seen], str], ...] = argument_factor, constant_factor, shifted, function_of, combination, mixture


def named(seen: Seen, secret: bool = False) -> str:
    """The first detector that explains all cases; an empty string when none does, or when they show no mistake.

    secret : the words must not tell the right answer.
    """
    if seen.same(seen.want):
        return ""
    with np.errstate(all="ignore"):
        return next(filter(None, (detect(seen) for detect in PLAIN + (() if secret else FITTED))), "")


def where(seen: Seen, right: list[bool], partly: str = "") -> str:
    """Words for where an answer is right and where it is not: kinds of cases, single entries; or `partly`."""
    if not any(right):
        return _wrong_lines(seen)
    labels = [(getattr(case, "label", ""), fine) for case, fine in zip(seen.cases, right, strict=True)]
    good, bad = ({label for label, fine in labels if fine == wanted} for wanted in (True, False))
    if partly and good & bad:
        return partly
    kinds = f", and wrong for {', '.join(sorted(bad))}" if all(bad) and not good & bad else ""
    return f"it is right in {sum(right)} of {len(right)} cases{kinds}"


def _wrong_lines(seen: Seen) -> str:
    """The rows, columns or entries that hold all that is wrong, where there are others."""
    shapes = {w.shape for w in seen.want}
    if len(shapes) > 1 or len(shape := shapes.pop()) not in (1, 2):
        return ""
    scale = max(map(largest, seen.want))
    wrong = np.any([np.abs(g - w) > seen.slack * scale for g, w, _ in seen], axis=0)
    for axis in range(len(shape)):
        lines = wrong if wrong.ndim == 1 else wrong.any(axis=1 - axis)
        hit = [str(i) for i in itertools.compress(range(len(lines)), lines)]
        if 0 < len(hit) < len(lines):
            word = "entry" if wrong.ndim == 1 else ("row", "column")[axis]
            return f"only {word} {', '.join(hit)} (counted from 0) is wrong"
    return ""
