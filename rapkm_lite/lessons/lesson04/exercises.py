"""Exercises of lesson 04: antagonism, its filter and the energy."""

from __future__ import annotations

import numpy as np

from ...machine.arguments import matvec
from ...machine.manipulator import Manipulator, load
from ...mechanics import actuation, antagonism
from ...mechanics.kinematics import inverse_kinematics
from ...simulation import energy
from ..checker import Exercise


def _control_matrices(rng, count: int) -> np.ndarray:
    """Control matrices (count, 3, 2) of the testbed at random end-effector points within 0.12 m of the centroid."""
    robot = load()
    angle, radius = rng.uniform(0, 2 * np.pi, count), 0.12 * np.sqrt(rng.uniform(0, 1, count))
    x = radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    return actuation.control_matrix(robot, inverse_kinematics(robot, x))


def _null(A: np.ndarray) -> np.ndarray:
    """Unit null vector of A^T for three drives: the cross product of the columns of A."""
    n = np.cross(A[..., 0], A[..., 1])
    return n / np.linalg.norm(n, axis=-1, keepdims=True)


def filtered_torques(A, c) -> np.ndarray:
    """c_eff = (A^T)^+ A^T c (3,) in N m of (16), the part of the torques c (3,) that moves the machine; A is (3, 2)."""
    return antagonism.antagonism_filter(A) @ c


def filtered_command(A, K_P, q_measured, q_desired) -> np.ndarray:
    """The command (18) for PD drives, (3,) in rad: measured angles minus the filtered error; K_P (3,) in N m/rad."""
    return q_measured - antagonism.command_filter(A, K_P) @ (q_measured - q_desired)


def saved_energy(robot: Manipulator, A, c, dt) -> np.ndarray:
    """Copper loss (3,) in J that the filter saves on a log of torques c (k, 3) in N m, with A (k, 3, 2), dt in s."""
    kept = matvec(antagonism.antagonism_filter(A), c)
    return energy.copper_loss(robot, c, dt) - energy.copper_loss(robot, kept, dt)


def _torque_cases(rng):
    return [(A, rng.normal(0, 0.05, 3)) for A in _control_matrices(rng, 20)]


def _torque_law(got, A, c):
    number = max(np.max(np.abs(A.T @ (got - c))), abs(_null(A) @ got))
    return number, "the end-effector force changed (N), or torque is left along the null vector of A^T (N m)"


def _command_cases(rng):
    q = rng.uniform(-1, 1, (20, 3))
    return [
        (A, rng.uniform(3, 15, 3), q[k] + rng.normal(0, 5e-3, 3), q[k])
        for k, A in enumerate(_control_matrices(rng, 20))
    ]


def _command_law(got, A, K_P, q_measured, q_desired):
    force = A.T @ (K_P * (q_measured - got))
    wanted = A.T @ (K_P * (q_measured - q_desired))
    return np.max(np.abs(force - wanted)), "the force at the end-effector is not the one of the plain PD drives (N)"


def _log_cases(rng):
    robot = load()
    return [
        (robot.replace(resistance=R), _control_matrices(rng, 200), rng.normal(0, 0.04, (200, 3)), dt)
        for R, dt in ((0.611, 1e-3), ([0.5, 0.5, 0.5], 2e-3))
    ]


def _pythagoras(got, robot, A, c, dt):
    along = np.sum(_null(A) * c, axis=-1)
    total = float((robot.resistance[0] / robot.torque_constant[0] ** 2) * dt * np.sum(along**2))
    return abs(got.sum() - total), "the total differs from R_el/k_t^2 times the integral of the squared antagonism (J)"


EXERCISES = {
    "04.filtered_torques": Exercise(
        filtered_torques,
        "c_eff = A f must give the same force, A^T A f = A^T c: solve for f, then multiply by A.",
        "N m",
        _torque_cases,
        _torque_law,
        1e-10,
    ),
    "04.filtered_command": Exercise(
        filtered_command,
        "project the error e with the filter of the matrix K_P A (rk.antagonism_filter takes any matrix), "
        "and subtract the result from the measured angles.",
        "rad",
        _command_cases,
        _command_law,
        1e-10,
    ),
    "04.saved_energy": Exercise(
        saved_energy,
        "filter the torques sample by sample, with R = rk.antagonism_filter(A) of shape (k, 3, 3), and subtract two "
        "copper losses.",
        "J",
        _log_cases,
        _pythagoras,
        1e-10,
    ),
}
