"""Given and right answers of all cases, side by side."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Seen:
    """Given and right answers of all cases, their arguments and the names of these.

    slack : relative deviation up to which two answers count as the same.  What is zero but for rounding beside the
    other cases, as a gap of closed loops, has none of its own.
    """

    got: list[np.ndarray]
    want: list[np.ndarray]
    cases: list[tuple]
    names: tuple[str, ...]
    slack: float = 1e-6

    def same(self, model: list[np.ndarray]) -> bool:
        """True when the model gives the same as the answer in every case."""
        return self.agree(model, self.got)

    def agree(self, model: list[np.ndarray], got: list[np.ndarray], *, least: float = 0.0) -> bool:
        """True when two lists of arrays, one for each case, hold the same, or but for `least`."""
        least = max(least, rounding(map(np.asarray, model)))
        return all(alike(m, g, self.slack, least) for m, g in zip(model, got, strict=True))

    def argument(self, k: int) -> list[np.ndarray]:
        """Argument k of all cases where it always is an array, else an empty list."""
        values = [case[k] for case in self.cases if k < len(case) and isinstance(case[k], np.ndarray)]
        return values if len(values) == len(self.cases) else []

    def __iter__(self) -> Iterator[tuple]:
        return zip(self.got, self.want, self.cases, strict=True)


def rounding(arrays: Iterable[np.ndarray]) -> float:
    """What counts as zero beside the largest entry of all arrays."""
    return 1e-12 * max(map(largest, arrays), default=0.0)


def alike(model, got: np.ndarray, slack: float, least: float = 0.0) -> bool:
    """True when two arrays have the same shape and numbers, relative to the largest entry, or but for `least`."""
    model = np.asarray(model, dtype=float)
    if model.shape != got.shape or not np.all(np.isfinite(model)):
        return False
    return largest(model - got) <= max(slack * max(largest(model), 1e-300), least)


def largest(array: np.ndarray) -> float:
    """The largest magnitude among the entries; 0.0 where there are none."""
    return float(np.max(np.abs(array), initial=0.0))


def ratio_of(got: list[np.ndarray], want: list[np.ndarray]) -> float:
    """The factor k for which k want is nearest to the answer."""
    above = sum(float(np.sum(g * w)) for g, w in zip(got, want, strict=True))
    below = sum(float(np.sum(w * w)) for w in want)
    return above / below if below > 0.0 else 0.0
