"""Exercises of lesson 03 on the logs of ``data/mystery_runs``: offsets, a gain, and a log that cannot tell."""

from __future__ import annotations

import numpy as np

from ..checker import Exercise
from ..mystery import K_P, hidden
from . import tasks


def _log_mistakes(name: str) -> dict:
    """Wrong readings of a log with three rests, as functions of nothing."""
    read = {
        "these are the measured errors of a rest, or the smallest offsets that explain them, which is nearly the same: "
        "one place tells one number, and by the rest of the offsets the machine has moved": lambda n, e, c: e[0],
        "these are the measured errors of a rest, or the smallest offsets that explain them, which is nearly the same, "
        "averaged over the places: not the offsets": lambda n, e, c: e.mean(axis=0),
        "these are the measured errors of the second rest: one place tells one number": lambda n, e, c: e[1],
        "these are the measured errors of the last rest: one place tells one number": lambda n, e, c: e[-1],
        "these are rest torques over the gain: only their part along eta comes from the offsets, and one place is not "
        "enough": lambda n, e, c: -c[0] / K_P,
        "this is the minimum norm of the first rest: one place tells one number": lambda n, e, c: n[0] * (n[0] @ e[0]),
        "the gain is missing: these numbers are torques in N m": lambda n, e, c: np.linalg.solve(
            n, -np.sum(n * c, axis=1)
        ),
        "torque times gain: divide by it (units)": lambda n, e, c: np.linalg.solve(n, -np.sum(n * c, axis=1) * K_P),
        "the norm of the torques is used: it has lost the sign of the fight": (
            lambda n, e, c: np.linalg.solve(n, np.linalg.norm(c, axis=1) / K_P)
        ),
        "the matrix of null vectors is transposed: one row for each rest": (
            lambda n, e, c: np.linalg.solve(n.T, np.sum(n * e, axis=1))
        ),
        "the null vector of the first place is used for all rests": (
            lambda n, e, c: np.linalg.lstsq(n[[0, 0, 0]] + 0.0, np.sum(n[[0, 0, 0]] * e, axis=1), rcond=None)[0]
        ),
    }
    return {words: tasks.from_rests(name, change) for words, change in read.items()}


def _solved(n, e) -> np.ndarray:
    return np.linalg.solve(n, np.sum(n * e, axis=1))


def _log_exercise(name: str, hints: tuple[str, ...], tolerance: float, close: float, **more) -> Exercise:
    return Exercise(
        lambda: hidden(name)[0],
        hints=hints,
        unit="rad",
        invariant=tasks.unexplained_error(name),
        tolerance=tolerance,
        close=close,
        secret=True,
        improve="average over a whole rest, and use the angles: they are cleaner than the torques",
        mistakes=_log_mistakes(name) | more.pop("mistakes", {}),
        **more,
    )


READINGS = {
    "03.offsets": _log_exercise(
        "offset_a",
        (
            "Each rest tells one number: what the encoders contradict each other by. How many rests are there?",
            "At rest eta . offset = -eta . c / k_P, and also eta . (measured - desired). The eta of each corner is a "
            "row: rk.null_vector(robot, corners).",
            "With the means c_k of log.c during the rests: np.linalg.solve(n, [-n_k @ c_k / k_P for each rest k]).",
        ),
        3e-4,
        0.08,
    ),
    "03.offset_b": _log_exercise(
        "offset_b",
        (
            "Same equations as for offset_a. What is different about the three places?",
            "The null vectors of a triangle of 0.06 m are nearly alike, so every error grows sixfold: average, use the "
            "angles, and take eta at these corners, not at those of the big triangle.",
            "n = rk.null_vector(robot, rk.triangle(robot, 0.06, 3.0).q[[0, 1000, 2000]]), then "
            "np.linalg.solve(n, [n_k @ e_k for each rest k]) with the means e_k of log_b.error.",
        ),
        3e-4,
        0.08,
        called="offsets_b",
        mistakes={
            "eta is taken at the corners of the big triangle, where this log has not been": tasks.from_rests(
                "offset_b", lambda n, e, c: _solved(tasks.rests("offset_a")[0], e)
            ),
        },
    ),
    "03.offset_c": Exercise(
        np.full(3, np.nan),
        hints=(
            "How many places did the machine visit, and how many numbers does one place tell?",
            "The null vector is one row for three unknowns: rank 1. Any A xi can be added without a trace.",
            "None of the three can be told: np.full(3, np.nan).",
        ),
        unit="rad",
        judge=tasks.refusal,
        raw=True,
        secret=True,
        called="offsets_c",
    ),
    "03.gains": Exercise(
        lambda: hidden("gain")[1],
        hints=(
            "Each drive knows only its own error. What does its torque at rest depend on?",
            "At rest c_i = -K_i (measured - desired): a straight line through the origin for each drive, one point per "
            "rest.",
            "With the means e and c of the three rests, (3, 3): -np.sum(e * c, axis=0) / np.sum(e**2, axis=0).",
        ),
        unit="N m/rad",
        invariant=tasks.unexplained_gain,
        tolerance=0.2,
        close=0.06,
        improve="average over a whole rest, and give the rests with large errors more weight (least squares)",
        secret=True,
        mistakes={
            "these are the nominal gains; one of the drives has another one": lambda: np.full(3, K_P),
            "the reciprocal: error over torque": lambda: 1 / hidden("gain")[1],
            "this is the mean of the ratios of the rests: the ratio of a drive with hardly any error is mostly noise": (
                tasks.from_rests("gain", lambda n, e, c: -(c / e).mean(axis=0))
            ),
        },
    ),
    "03.gain": _log_exercise(
        "gain",
        (
            "One of the two sources, angles or torques, holds the unknown gain. Which one does not?",
            "The contradictions eta . (measured - desired) of the angles need no gain at all; the corners are those of "
            "offset_a.",
            "np.linalg.solve(n, [n_k @ e_k for each rest k]) with n = rk.null_vector(robot, corners) and the means e_k "
            "of log_g.error.",
        ),
        3e-4,
        0.07,
        called="offsets_g",
        mistakes={
            "the nominal gain is used with the torques: fit the gain first, or use the angles": (
                tasks.from_rests("gain", lambda n, e, c: np.linalg.solve(n, -np.sum(n * c, axis=1) / K_P))
            ),
            "these are the gains in N m/rad (03.gains); the offsets in rad are wanted": lambda: hidden("gain")[1],
        },
    ),
}
