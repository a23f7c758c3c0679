"""Exercises of lesson NN: TITLE."""

from __future__ import annotations

import numpy as np

from ...machine.manipulator import load
from ...mechanics.actuation import control_matrix
from ...mechanics.kinematics import inverse_kinematics
from ..checker import Exercise


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
    """Largest speed in m/s that is safe in every direction when no drive may turn faster than `limit` in rad/s."""
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


def _limits(rng) -> list[tuple]:
    return list(zip(_control_matrices(rng, 8), rng.uniform(2.0, 10.0, 8), strict=True))


def _too_fast(speed, A, limit) -> tuple[float, str]:
    angle = np.linspace(0.0, 2 * np.pi, 721)
    rates = speed * np.abs(A @ np.stack([np.cos(angle), np.sin(angle)]))
    return max(0.0, rates.max() - limit), "in one of 720 directions a drive exceeds its limit, by rad/s"


# Name -> the package's answer, a hint, cases and an invariant: a law of nature that a right answer obeys.
EXERCISES = {
    "NN.driven_rates": Exercise(
        reference=driven_rates,
        cases=_velocities,
        invariant=_moves_so,
        unit="rad/s",
        tolerance=1e-9,
        hint="row i of A times the velocity is the rate of drive i",
    ),
    "NN.turning": Exercise(
        reference=turning,
        cases=_matrices,
        invariant=_exceeded,
        unit="rad/m",
        tolerance=1e-9,
        hint="a scalar product with a unit vector is largest along the vector itself",
    ),
    "NN.safe_speed": Exercise(
        reference=safe_speed,
        cases=_limits,
        invariant=_too_fast,
        unit="m/s",
        tolerance=1e-9,
        hint="the drive that turns farthest per metre decides",
    ),
}
