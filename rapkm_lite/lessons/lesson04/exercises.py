"""Exercises of lesson 04: antagonism, its filter and the energy."""

from __future__ import annotations

import numpy as np

from ...machine.arguments import matvec
from ...machine.manipulator import Manipulator, load
from ...mechanics import actuation, antagonism
from ...mechanics.kinematics import inverse_kinematics
from ...simulation import energy
from ..checker import Case, Exercise
from .lean_law import LEAN_LAW


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


def _torque_law(got, A, c):
    number = max(np.max(np.abs(A.T @ (got - c))), abs(_null(A) @ got))
    return number, "change of the end-effector force (N), or torque left along the null vector of A^T (N m)"


def _one_by_one(A, c):
    """The parts along the two columns of A, added as if these were at right angles."""
    return sum(column * (column @ c) / (column @ column) for column in A.T)


def _command_cases(rng):
    q = rng.uniform(-1, 1, (20, 3))
    return [
        (A, rng.uniform(3, 15, 3), q[k] + rng.normal(0, 5e-3, 3), q[k])
        for k, A in enumerate(_control_matrices(rng, 20))
    ]


def _command_law(got, A, K_P, q_measured, q_desired):
    force = A.T @ (K_P * (q_measured - got))
    wanted = A.T @ (K_P * (q_measured - q_desired))
    return np.max(np.abs(force - wanted)), "force at the end-effector less that of the plain PD drives (N)"


def _command_with(change):
    """A wrong command from the four parts: filter without gains R, filter with them R_K, K_P, measured and desired."""

    def command(A, K_P, q_measured, q_desired):
        R, R_K = antagonism.antagonism_filter(A), antagonism.command_filter(A, K_P)
        return change(R, R_K, K_P, q_measured, q_desired)

    return command


def _log_cases(rng):
    robot = load()
    cases: list[tuple] = [
        Case(words, robot.replace(resistance=R), _control_matrices(rng, 200), rng.normal(0, 0.04, (200, 3)), dt)
        for words, R, dt in (("a log", 0.611, 1e-3), ("other motors", [0.5, 0.7, 1.1], 2e-3), ("a log", 0.611, 1e-2))
    ]
    # Antagonism that takes most of the load off drive 1: with the filter this drive pays more.
    A = _control_matrices(rng, 200)
    moving, null = _kept(A, rng.normal(0, 0.04, (200, 3))), _null(A)
    against = np.where(np.abs(null[:, :1]) > 0.3, moving[:, :1] / null[:, :1], 0.0)
    c = moving - 0.8 * null * against
    return [*cases, Case("a log in which a drive loses by the filter", robot, A, c, 1e-3)]


def _pythagoras(got, robot, A, c, dt):
    """For equal motors the total is that of the antagonism; for unequal ones only drive by drive."""
    removed = c - _null(A) * np.sum(_null(A) * c, axis=-1, keepdims=True)
    each = robot.resistance / robot.torque_constant**2 * dt * np.sum(c**2 - removed**2, axis=0)
    return np.max(np.abs(got - each)), "difference from the sums of R_el/k_t^2 (c^2 - c_eff^2) dt (J)"


def _kept(A, c):
    return matvec(antagonism.antagonism_filter(A), c)


def _energy_with(change):
    """A wrong saving from the copper loss of the log, of what the filter keeps, and of what it removes."""

    def saving(robot, A, c, dt):
        kept = _kept(A, c)
        return change(*(energy.copper_loss(robot, torques, dt) for torques in (c, kept, c - kept)))

    return saving


def _first_filter(robot, A, c, dt):
    kept = c @ antagonism.antagonism_filter(A[0])
    return energy.copper_loss(robot, c, dt) - energy.copper_loss(robot, kept, dt)


def _first_motor(robot, A, c, dt):
    same = robot.replace(resistance=float(robot.resistance[0]), torque_constant=float(robot.torque_constant[0]))
    return saved_energy(same, A, c, dt)


def _trapezoids(robot, A, c, dt):
    saved = robot.resistance / robot.torque_constant**2 * (c**2 - _kept(A, c) ** 2)
    return np.trapezoid(saved, dx=dt, axis=0)


EXERCISES = {
    "04.filtered_torques": Exercise(
        filtered_torques,
        hints=(
            "Two torque vectors that give the same force at the end-effector differ only by antagonism. Which one of "
            "them has none?",
            "Torques without antagonism are combinations of the columns of A, c_eff = A z. Two numbers z are unknown, "
            "and the force gives two equations.",
            "A^T A z = A^T c: z = np.linalg.solve(A.T @ A, A.T @ c), then A @ z.",
        ),
        unit="N m",
        cases=lambda rng: [(A, rng.normal(0, 0.05, 3)) for A in _control_matrices(rng, 20)],
        invariant=_torque_law,
        tolerance=1e-10,
        close=3e-2,
        improve="solve the two equations for z directly instead of searching for them",
        mistakes={
            "this is the complement, the antagonistic part of the torques: the filter keeps the rest, c minus this": (
                lambda A, c: c - filtered_torques(A, c)
            ),
            "the inverse of A^T A is missing: A A^T c is no projection, and it has another unit": (
                lambda A, c: A @ (A.T @ c)
            ),
            "this is the force A^T c at the end-effector, not yet the torques": lambda A, c: A.T @ c,
            "these are the two numbers z; the factor A is missing, c_eff = A z": (
                lambda A, c: np.linalg.solve(A.T @ A, A.T @ c)
            ),
            "the columns of A are not at right angles: their parts cannot be added one by one": _one_by_one,
            "the null vector is not divided by its norm: c - n (n c) needs a unit vector n": (
                lambda A, c: c - np.cross(*A.T) * (np.cross(*A.T) @ c)
            ),
            **{
                f"drive {off + 1} is off: the force is the same, but other torques give it with a smaller norm": (
                    lambda A, c, off=off: np.insert(np.linalg.solve(np.delete(A, off, axis=0).T, A.T @ c), off, 0.0)
                )
                for off in range(3)
            },
            "the mean of the torques is removed, as if the null vector were (1, 1, 1): it turns with the pose": (
                lambda A, c: c - c.mean()
            ),
        },
    ),
    "04.filtered_command": Exercise(
        filtered_command,
        hints=(
            "The drive multiplies the error by its gain on its own. Which errors then make no force at the "
            "end-effector? (17) removes these, and keeps what is perpendicular to them.",
            "The force is A^T K_P e = (K_P A)^T e. So it is the error that is projected, and the matrix of the "
            "projection is K_P A, row i times gain i.",
            "R = rk.antagonism_filter(K_P[:, None] * A), and the command is q_measured - R @ (q_measured - q_desired).",
        ),
        unit="rad",
        cases=_command_cases,
        invariant=_command_law,
        tolerance=1e-10,
        close=1e-6,
        improve="solve the two equations for the projection directly instead of searching for them",
        mistakes={
            "the gains are forgotten in the filter: it is that of A, not of K_P A (a factor K_P is missing)": (
                _command_with(lambda R, R_K, K, q, d: q - R @ (q - d))
            ),
            "the filtered error is subtracted from the desired angles: (18) starts from the measured ones": (
                _command_with(lambda R, R_K, K, q, d: d - R_K @ (q - d))
            ),
            "the sign of the filtered error is opposite: the command lies on the other side of the measured angles": (
                _command_with(lambda R, R_K, K, q, d: q + R_K @ (q - d))
            ),
            "this is the filtered error only, not the command: subtract it from the measured angles": (
                _command_with(lambda R, R_K, K, q, d: R_K @ (q - d))
            ),
            "the angles themselves are filtered; only the error may be": _command_with(lambda R, R_K, K, q, d: R_K @ d),
            "the measured angles themselves are filtered; only the error may be": (
                _command_with(lambda R, R_K, K, q, d: R_K @ q)
            ),
            "the gains are under a root in the filter: this is no projection that keeps the force": (
                lambda A, K_P, q, d: q - antagonism.antagonism_filter(np.sqrt(K_P)[:, None] * A) @ (q - d)
            ),
            "the gains come twice: K_P^2 A instead of K_P A (a factor K_P too many)": (
                lambda A, K_P, q, d: q - antagonism.command_filter(A, K_P**2) @ (q - d)
            ),
            "the filtered error is multiplied by the gains; the drive does that on its own (units, N m against rad)": (
                _command_with(lambda R, R_K, K, q, d: q - K * (R_K @ (q - d)))
            ),
            "measured and desired angles are exchanged, or the complement of the filter is used: the error along the "
            "null vector is kept and the rest removed": (
                _command_with(lambda R, R_K, K, q, d: q - (q - d) + R_K @ (q - d))
            ),
            "these are the filtered torques; the command is an angle, (18)": (
                _command_with(lambda R, R_K, K, q, d: -K * (R_K @ (q - d)))
            ),
            "this is the projection of (14), which weighs with the gains; (17) projects at right angles": (
                lambda A, K_P, q, d: q - A @ np.linalg.solve((A.T * K_P) @ A, (A.T * K_P) @ (q - d))
            ),
            "the torques are filtered and divided by the gains: (17) projects the error with K_P A, not the torque": (
                _command_with(lambda R, R_K, K, q, d: q - R @ (K * (q - d)) / K)
            ),
            "the filtered torque is subtracted from an angle: divide out the gains (units, N m against rad)": (
                _command_with(lambda R, R_K, K, q, d: q - R @ (K * (q - d)))
            ),
            "A is divided by the gains instead of multiplied": (
                lambda A, K_P, q, d: q - antagonism.antagonism_filter(A / K_P[:, None]) @ (q - d)
            ),
        },
    ),
    "04.saved_energy": Exercise(
        saved_energy,
        hints=(
            "What would the drives have lost with the filter? The log tells you the torques without it.",
            "Filter the torques sample by sample: rk.antagonism_filter(A) has the shape (k, 3, 3). Two copper losses "
            "follow.",
            "kept = np.einsum('kij,kj->ki', rk.antagonism_filter(A), c), then rk.copper_loss(robot, c, dt) minus "
            "rk.copper_loss(robot, kept, dt).",
        ),
        unit="J",
        cases=_log_cases,
        invariant=_pythagoras,
        tolerance=1e-10,
        close=1e-3,
        improve="project exactly, without a damping or a tolerance in the filter",
        mistakes={
            "this is the copper loss of the antagonistic torques: for equal motors it is the saving in total "
            "(Pythagoras), but not drive by drive": _energy_with(lambda whole, kept, removed: removed),
            "this is the copper loss that remains with the filter, not what it saves": (
                _energy_with(lambda whole, kept, removed: kept)
            ),
            "this is the copper loss without the filter, not the difference": (
                _energy_with(lambda whole, kept, removed: whole)
            ),
            "this is the total over the drives; one number for each drive is wanted": (
                _energy_with(lambda whole, kept, removed: np.sum(whole - kept))
            ),
            "the saving is a share without unit; the difference in J is wanted": (
                _energy_with(lambda whole, kept, removed: 1 - kept / whole)
            ),
            "this is the mean power saved, in W; the energy is that times the duration len(c) dt of the log": (
                lambda robot, A, c, dt: saved_energy(robot, A, c, dt) / (len(c) * dt)
            ),
            "the motors are forgotten: a torque squared is no power, the factor R_el/k_t^2 is missing": (
                lambda robot, A, c, dt: dt * np.sum(c**2 - _kept(A, c) ** 2, axis=0)
            ),
            "the filter of the first sample is used for the whole log: A changes with the pose": _first_filter,
            "all drives are given the motor of the first one: R_el/k_t^2 belongs to each drive": _first_motor,
            "the last sample is left out; every torque is held for dt, the last one too": (
                lambda robot, A, c, dt: saved_energy(robot, A[:-1], c[:-1], dt)
            ),
            "the torques are held between the samples: a sum, no trapezoidal rule": _trapezoids,
        },
    ),
    "04.lean_law": LEAN_LAW,
}
