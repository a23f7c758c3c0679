"""The rests of a log: where the desired angles stand still and the machine has settled; the gain they show."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..machine.logs import Log


class Rests(NamedTuple):
    """Means over each rest: desired and measured angles, torques, each (k, N), and the standard error of the torques.

    records : how many records each mean has, (k,).
    """

    desired: np.ndarray
    q_a: np.ndarray
    c: np.ndarray
    c_error: np.ndarray
    records: np.ndarray


class Gain(NamedTuple):
    """Gains (N,) N m/rad of PD drives as the rests show them, and their standard errors."""

    K_P: np.ndarray
    error: np.ndarray

    def objections(self, nominal: np.ndarray) -> list[str]:
        """A sentence for each drive whose gain is not the nominal one, (N,)."""
        return [
            f"the rests show K_P = {k:.3g} N m/rad for drive {i + 1}, not {given:.3g}"
            for i, (k, error, given) in enumerate(zip(self.K_P, self.error, nominal, strict=True))
            if abs(k - given) > max(5 * error, 0.02 * given)
        ]


def rests(logs: list[Log], shortest: int = 10) -> Rests | None:
    """The rests of all logs, each the later half of a stretch of equal desired angles; None where there is none.

    shortest : records of such a half.
    """
    found = []
    for log in logs:
        moves = np.flatnonzero(np.any(np.diff(log.q_a_desired, axis=0) != 0.0, axis=-1)) + 1
        for start, stop in zip([0, *moves], [*moves, len(log.t)], strict=True):
            half = slice(start + (stop - start) // 2, stop)
            count = stop - half.start
            if count >= shortest:
                c = log.c[half]
                error = c.std(axis=0, ddof=1) / np.sqrt(count)
                found.append((log.q_a_desired[half.start], log.q_a[half].mean(axis=0), c.mean(axis=0), error, count))
    return Rests(*map(np.array, zip(*found, strict=True))) if found else None


def fitted_gain(stand: Rests) -> Gain | None:
    """K_P of c = -K_P (q_a - q_desired) over the rests, drive by drive; None where a drive shows no error."""
    e = stand.q_a - stand.desired
    weight = 1.0 / np.maximum(stand.c_error, 1e-12) ** 2
    information = (weight * e * e).sum(axis=0)
    if np.any(information == 0.0):
        return None
    return Gain(-(weight * e * stand.c).sum(axis=0) / information, 1.0 / np.sqrt(information))
