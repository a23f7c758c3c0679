"""Torques that move nothing: null vector, antagonism filter (15), (17), and the state of rest (13)-(14)."""

from __future__ import annotations

import itertools

import numpy as np

from ..machine.arguments import (
    bounded,
    check_leading,
    exact_array,
    matvec,
    positive_definite,
    positive_number,
    real_array,
    tall_matrix,
    transpose,
)
from ..machine.manipulator import Manipulator
from .actuation import control_matrix, full_rank_qr
from .kinematics import arm_vectors, cross


def antagonism_filter(A) -> np.ndarray:
    """R = (A^T)^+ A^T of (15), (..., m, m): removes the part of the torques that only prestresses; A^T R = A^T.

    Raises ValueError at input singularities.
    """
    Q, _ = full_rank_qr("A", tall_matrix("A", A))
    return Q @ transpose(Q)


def command_filter(A, K) -> np.ndarray:
    """R_K = (A^T K)^+ A^T K of (17), (..., m, m), for a gain K (number, (m,) or (m, m)), applied to errors.

    -K R_K e has the same end-effector force as the filtered -R K e, and the same torques only for K = k I.
    """
    A = tall_matrix("A", A)
    K = positive_definite("K", K, A.shape[-2])
    check_leading(A=A.shape[:-2], K=K.shape[:-2])
    return antagonism_filter(K @ A)


def null_vector(robot: Manipulator, q) -> np.ndarray:
    """Unit null vector of A^T for three arms in closed form, (..., 3): n_i ~ (a_i x d_i) (d_j x d_k), i, j, k cyclic.

    Raises ValueError for another number of arms, and at input singularities, where the null space has two dimensions.
    """
    n = null_direction(robot, q)
    size = np.linalg.norm(n, axis=-1, keepdims=True)
    if np.any(size < 1e-12 * robot.lengths[:, 0].max()):
        raise ValueError(
            "q is an input singularity (all distal links parallel), where the null space of A^T is a plane; allowed: "
            "poses with degree of actuation 2"
        )
    return n / size


def null_direction(robot: Manipulator, q) -> np.ndarray:
    """The numerators (a_i x d_i) (d_j x d_k) of `null_vector`, (..., 3) in m, d of unit length; zero where it fails."""
    if robot.n_arms != 3:
        raise ValueError(f"robot has {robot.n_arms} arms; allowed: 3 (prestress_projector takes any number)")
    a, d = arm_vectors(robot, q)
    d = d / robot.lengths[:, 1:]
    return cross(a, d) * cross(np.roll(d, -1, axis=-2), np.roll(d, -2, axis=-2))


def steady_state_error(A, K_P, offset, wrench=None) -> np.ndarray:
    """Error e_a = q_a - q_a^d (..., m) in rad at rest under PD with offsets, (14) corrected:

    e_a = -A (A^T K_P A)^-1 (A^T K_P offset + wrench).  The chapter's formula has shapes that do not fit.  It solves the
    equilibrium (13), A^T K_P (e_a + offset) + wrench = 0, for small errors e_a = A e_x.

    offset : (..., m) in rad, measured minus true angle.  K_P : positive definite, N m/rad.
    wrench : static control force A^T c (..., 2) that gravity and load demand (Qbar at rest); default none.
    """
    A = tall_matrix("A", A)
    full_rank_qr("A", A)
    offset = real_array("offset", offset, A.shape[-2])
    K = positive_definite("K_P", K_P, A.shape[-2])
    wrench = real_array("wrench", np.zeros(A.shape[-1]) if wrench is None else wrench, A.shape[-1])
    check_leading(A=A.shape[:-2], offset=offset.shape[:-1], K_P=K.shape[:-2], wrench=wrench.shape[:-1])
    force = matvec(transpose(A) @ K, offset) + wrench
    return -matvec(A, np.linalg.solve(transpose(A) @ K @ A, force[..., None])[..., 0])


def steady_state_torque(A, K_P, offset, wrench=None) -> np.ndarray:
    """Torques c = -K_P (e_a + offset) (..., m) in N m at rest, from (12)-(14); all antagonism without wrench.

    Arguments and errors: see `steady_state_error`.  The text after (14) prints the opposite sign.
    """
    e_a = steady_state_error(A, K_P, offset, wrench)
    return -matvec(positive_definite("K_P", K_P, e_a.shape[-1]), e_a + np.asarray(offset, dtype=float))


def rest_exists(robot: Manipulator, q, K_P, offset, quantum: float, friction: float) -> bool:
    """Can PD drives with stepped angles rest near the desired pose q (2N,) of three arms, held by Coulomb friction?

    True when counts exist that a pose of the closed loops reads, and whose torques differ from a prestress by no more
    than the friction of each drive; certain for K_P quantum <= 2 friction.  First order about q.
    K_P : number or (3,), N m/rad.  offset : (3,) rad.  quantum : angle of one count, rad.  friction : N m per drive.
    Raises ValueError for another number of arms, at input singularities, and for values out of range.
    """
    n, desired = null_vector(robot, q), exact_array("q", q, robot.n_joints)[:3]
    offset, quantum = exact_array("offset", offset, 3), positive_number("quantum", quantum)
    friction = float(bounded("friction", exact_array("friction", friction), 0.0, strict=False))
    ideal = desired + steady_state_error(control_matrix(robot, q), K_P, offset) + offset
    counts = np.rint(ideal / quantum) + np.array(list(itertools.product(range(-4, 5), repeat=3)))
    read = np.abs((quantum * counts - desired - offset) @ n) <= quantum / 2 * np.abs(n).sum()
    c = -real_array("K_P", K_P) * (quantum * counts[read] - desired)
    with np.errstate(divide="ignore"):
        ends = np.sort([(c - friction) / n, (c + friction) / n], axis=0)  # levels of prestress that each drive can hold
    return bool(np.any(ends[0].max(axis=-1) <= ends[1].min(axis=-1)))
