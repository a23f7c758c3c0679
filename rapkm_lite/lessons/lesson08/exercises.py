"""Exercises of lesson 08: offsets from readings alone, places, a drive that calibrates, and counts that let it rest."""

from __future__ import annotations

import numpy as np

from ...mechanics.kinematics import inverse_kinematics
from ..checker import Exercise
from . import tasks


def counts_needed(K_P, friction):
    """Smallest counts per turn, not rounded, with K_P 2 pi / counts <= 2 f_c."""
    return np.pi * K_P / friction


EXERCISES = {
    "08.self_calibrate": Exercise(
        tasks.self_calibrate,
        hints=(
            "Each reading gives one equation for the offsets. What is its left side, and what its right side?",
            "rk.estimate_pose(robot, q_a - offset, guess) gives poses, rk.null_basis(A) their null vectors η; solve "
            "η^T offset = η^T (q_a - q) for all readings together with np.linalg.lstsq, and begin again with the new "
            "offset.",
            "rows = rk.null_basis(A).mT; gap = rows @ (q_a - q[:, :N])[..., None]; "
            "offset = np.linalg.lstsq(rows.reshape(-1, N), gap.ravel(), rcond=None)[0]",
        ),
        unit="rad",
        cases=tasks.reading_cases,
        invariant=tasks.still_contradicts,
        tolerance=1e-9,
        close=0.03,
        improve="take the poses anew from the readings less the offsets found, and repeat until nothing changes; what "
        "corrected readings still show adds to the offsets",
        mistakes={
            "what is left at each place is averaged, but it holds only the part along its own null vector; "
            "solve the equations of all places together": lambda robot, q_a, guess: tasks.left_over(
                robot, q_a, guess
            ).mean(axis=0),
            "what is left is added up over the places; solve their equations together": lambda robot, q_a, guess: (
                tasks.left_over(robot, q_a, guess).sum(axis=0)
            ),
            "the guess is taken for the true place; the best poses come from the readings": lambda robot, q_a, guess: (
                q_a - inverse_kinematics(robot, guess)[:, : robot.n_arms]
            ).mean(axis=0),
            "only the first place is used, and the smallest offsets that explain it: one place knows one combination": (
                tasks.of_one_place
            ),
            "the null vectors are those of the guess, and one step is taken from there; the best poses come from the "
            "readings": tasks.of_the_guess,
            "the readings are corrected the wrong way: the poses are those of q_a - offset": (
                tasks.corrected_the_wrong_way
            ),
            "these are the gaps of the places, not the offsets behind them": lambda robot, q_a, guess: tasks.equations(
                robot, q_a, 0.0, guess
            )[1].ravel(),
        },
    ),
    "08.places": Exercise(
        tasks.best_places,
        hints=(
            "When is one combination of the offsets badly known? When all null vectors nearly lie in one plane.",
            "The explorer above shows the null vectors: on a circle of 0.12 m, turn three places until they lie as far "
            "apart as they can.",
            "Three pairs of places on the edge of the disc, 10 degrees apart, about 60, 180 and 300 degrees.",
        ),
        unit="m",
        judge=tasks.known,
        close=0.1,
        improve="bring what is marked as missed inside its limit; the places that tell most lie where a component of η "
        "vanishes, as far out as the disc allows",
        points=10.0,
        mistakes={
            "these are six places evenly on a circle, which in the disc miss the condition however they are turned: "
            "compare the null vectors of three places while you turn them": tasks.is_hexagon,
            "the places are given in mm; the unit is m": lambda answer: bool(
                20.0 <= np.abs(tasks.chosen(answer)).max() <= 120.0
            ),
        },
    ),
    "08.calibration_drive": Exercise(
        tasks.calibration_drive,
        hints=(
            "Which places told most in the last exercise, and how many counts does the machine pass on its way?",
            "Far out and through many counts, but not so fast that the drives need more than 200 mN m.",
            "rk.circle(robot, 0.12, 4.0)",
        ),
        unit="",
        judge=tasks.shown,
        close=0.1,
        improve="bring what is marked as missed inside its limit; far out in the disc the null vectors differ most",
        points=10.0,
    ),
    "08.counts": Exercise(
        counts_needed,
        called="counts_needed",
        hints=(
            "By how much does the torque of one drive jump from count to count, and what can friction take up?",
            "One step of the torque is K_P 2 pi / counts; the friction band reaches from -f_c to f_c.",
            "K_P 2 pi / counts <= 2 f_c, so counts >= np.pi * K_P / friction.",
        ),
        unit="counts",
        cases=lambda rng: list(zip(rng.uniform(1, 20, 5), rng.uniform(1e-3, 1e-2, 5), strict=True)),
        invariant=lambda counts, K_P, friction: (
            abs(K_P * 2 * np.pi / counts - 2 * friction),
            "difference of the torque step from 2 f_c, in N m",
        ),
        tolerance=1e-8,
        close=5e-3,
        improve="take np.pi for pi, and leave the number of counts as it comes, without rounding",
        mistakes={
            "the friction band is 2 f_c wide, from -f_c to f_c: a factor of 2 is missing": (
                lambda K_P, friction: 2 * np.pi * K_P / friction
            ),
            "a turn has 2 pi radians, not 360 (units, degrees)": lambda K_P, friction: 180 * K_P / friction,
            "the reciprocal: this is the size of something per count, not the counts per turn": (
                lambda K_P, friction: friction / (np.pi * K_P)
            ),
            "gain and friction have changed places: the stiffer the drive, the more counts it needs": (
                lambda K_P, friction: np.pi * friction / K_P
            ),
            "this is the largest step of the angle in rad, not the counts per turn": (
                lambda K_P, friction: 2 * friction / K_P
            ),
            "counts per radian; a turn has 2 pi of them (a factor of 2 pi is missing)": (
                lambda K_P, friction: K_P / (2 * friction)
            ),
            "these are the lines; each one is counted four times, the answer is in counts (a factor of 4)": (
                lambda K_P, friction: np.pi * K_P / friction / 4
            ),
        },
    ),
}
