"""Exercises of lesson NN: TITLE."""

from __future__ import annotations

import numpy as np

from ...machine.manipulator import load
from ...mechanics.actuation import control_matrix
from ...mechanics.kinematics import inverse_kinematics
from ..checker import Exercise, Measured


def _control_matrices(rng, count: int) -> np.ndarray:
    """Control matrices (count, 3, 2) in rad/m of the testbed at random points."""
    robot = load()
    return control_matrix(robot, inverse_kinematics(robot, rng.uniform(-0.08, 0.08, (count, 2))))


def driven_rates(A, xd) -> np.ndarray:
    """Rates (m,) in rad/s of the driven joints at the velocity xd (2,) in m/s; A is (m, 2)."""
    return A @ xd


def turning(A) -> np.ndarray:
    """Largest rate of each drive (m,) in rad/s when the end-effector moves at 1 m/s in any direction."""
    return np.linalg.norm(A, axis=1)


def safe_speed(A, limit: float) -> float:
    """A speed in m/s that is safe in every direction when no drive may turn faster than `limit` in rad/s."""
    return limit / np.linalg.norm(A, axis=1).max()


def _velocities(rng) -> list[tuple]:
    return list(zip(_control_matrices(rng, 8), rng.uniform(-0.5, 0.5, (8, 2)), strict=True))


def _moves_so(rates, A, xd) -> tuple[float, str]:
    """The velocity that the rates belong to, found the other way round."""
    return np.abs(np.linalg.lstsq(A, rates, rcond=None)[0] - xd).max(), "the rates belong to another velocity, by m/s"


def _matrices(rng) -> list[tuple]:
    return [(A,) for A in _control_matrices(rng, 8)]


def _exceeded(most, A) -> tuple[float, str]:
    angle = np.linspace(0.0, 2 * np.pi, 721)
    rates = np.abs(A @ np.stack([np.cos(angle), np.sin(angle)]))
    return max(0.0, (rates.max(axis=1) - most).max()), "one of 720 directions turns a drive faster, by rad/s"


def _judged(speed) -> list[Measured]:
    """What the machine does at the speeds that the answer gives, in 720 directions at 8 places."""
    angle, limit = np.linspace(0.0, 2 * np.pi, 721), 5.0
    ways = np.stack([np.cos(angle), np.sin(angle)])
    rates = [np.abs(float(speed(A, limit)) * A @ ways).max() for A in _control_matrices(np.random.default_rng(7), 8)]
    return [
        Measured("fastest drive", max(rates), "rad/s", limit * (1 + 1e-9)),
        Measured("fastest drive where it is slowest", min(rates), "rad/s", 0.98 * limit, at_most=False),
    ]


# Name -> the package's answer, three hints, cases, and an invariant: a law of nature that a right answer obeys.
# Mistakes have names; a design is judged by what it does, each number beside its limit.
EXERCISES = {
    "NN.driven_rates": Exercise(
        driven_rates,
        hints=(
            "Which matrix takes a velocity of the end-effector to the rates of the drives?",
            "Row i of A times the velocity is the rate of drive i.",
            "return A @ xd",
        ),
        unit="rad/s",
        cases=_velocities,
        invariant=_moves_so,
        mistakes={"A is transposed: (2, m) times a rate is a velocity": lambda A, xd: A.T[:, :2] @ xd},
    ),
    "NN.turning": Exercise(
        turning,
        hints=(
            "The rate of drive i is a scalar product. Which direction makes it largest?",
            "A scalar product with a unit vector is largest along the vector itself, and then it is its length.",
            "return np.linalg.norm(A, axis=1)",
        ),
        unit="rad/m",
        cases=_matrices,
        invariant=_exceeded,
        close=1e-2,
        improve="take more directions, or the length of the row",
        mistakes={
            "this is the sum of the sizes, not the length of the row": lambda A: np.abs(A).sum(axis=1),
            "only motions along x and y are tried": lambda A: np.abs(A).max(axis=1),
        },
    ),
    "NN.safe_speed": Exercise(
        safe_speed,
        hints=(
            "Which drive reaches its limit first, and in which direction?",
            "The drive that turns farthest per metre decides.",
            "return limit / turning(A).max()",
        ),
        unit="m/s",
        judge=_judged,
        close=0.05,
        points=10.0,
    ),
}
