"""Motion equations: tree with multipliers (2), minimal coordinates (4)-(7), redundant coordinates (21)-(24).

Sign convention, as in (2):  G qdd + C qd + Q + J^T lambda = u,  u = (c, 0),  c (..., N) the drive torques in N m.
"""

from __future__ import annotations

import numpy as np

from ..machine.arguments import (
    check_leading,
    joint_indices,
    joint_vectors,
    matvec,
    positive_number,
    real_array,
    transpose,
)
from ..machine.manipulator import Manipulator
from .kinematics import arm_vectors, constraint_jacobian, constraint_jacobian_dot, ee_complement, ee_complement_dot


def mass_matrix(robot: Manipulator, q) -> np.ndarray:
    """Generalized mass matrix G(q) of (2), (..., 2N, 2N) in kg m^2; the cut tree couples only the joints of one arm."""
    q = real_array("q", q, robot.n_joints)
    Ja, Jd, P = robot.arm_inertias.T
    cosine = P * np.cos(q[..., robot.n_arms :])
    return _arm_blocks(Ja + Jd + 2 * cosine, Jd + cosine, Jd + cosine, np.broadcast_to(Jd, cosine.shape))


def coriolis_matrix(robot: Manipulator, q, qd) -> np.ndarray:
    """C(q, qd) of (2) from the Christoffel symbols, (..., 2N, 2N) in N m s; dG/dt - 2 C is skew-symmetric."""
    q, qd = joint_vectors(robot.n_joints, q=q, qd=qd)
    N = robot.n_arms
    sine = robot.arm_inertias[:, 2] * np.sin(q[..., N:])
    base, elbow = qd[..., :N], qd[..., N:]
    return _arm_blocks(-sine * elbow, -sine * (base + elbow), sine * base, 0 * sine * base)


def _arm_blocks(b11, b12, b21, b22) -> np.ndarray:
    """(..., 2N, 2N) with one 2 x 2 block per arm at the rows and columns (i, N + i)."""
    N = b11.shape[-1]
    M = np.zeros((*b11.shape[:-1], 2 * N, 2 * N))
    i = np.arange(N)
    M[..., i, i], M[..., i, N + i], M[..., N + i, i], M[..., N + i, N + i] = b11, b12, b21, b22
    return M


def generalized_forces(robot: Manipulator, q, qd) -> np.ndarray:
    """Q(q, qd) of (2), (..., 2N) in N m, on the left-hand side: dV/dq of gravity plus drive friction f_c tanh(qd / v0).

    Zero for the horizontal plane without friction.
    """
    q, qd = joint_vectors(robot.n_joints, q=q, qd=qd)
    a, d = arm_vectors(robot, q)
    N = robot.n_arms
    moments = robot.arm_moments / robot.lengths
    gx, gy = robot.gravity
    # -g . E v for the proximal and the distal part
    proximal = moments[:, 0] * (gx * a[..., 1] - gy * a[..., 0])
    distal = moments[:, 1] * (gx * d[..., 1] - gy * d[..., 0])
    friction = robot.friction * np.tanh(qd[..., :N] / robot.friction_velocity)
    return np.concatenate([proximal + distal + friction, distal + 0 * friction], axis=-1)


def orthogonal_complement(robot: Manipulator, q, independent=None) -> np.ndarray:
    """F of (4), qd = F q2d with J F = 0, (..., 2N, 2).

    Rows follow the joint order, columns follow `independent`, two 0-based joint indices; None takes the end-effector
    position as q2 (then in rad/m).
    Raises ValueError naming the pair and its measure (smallest singular value of J1 over the largest of J) where the
    choice is singular.
    """
    if independent is None:
        return ee_complement(robot, q)
    independent, dependent = _partition(robot, independent)
    J = constraint_jacobian(robot, q)
    J1, J2 = J[..., dependent], J[..., independent]
    _regular(J, J1, independent)
    F = np.zeros((*J.shape[:-2], robot.n_joints, 2))
    F[..., independent, [0, 1]] = 1.0
    F[..., dependent, :] = -np.linalg.solve(J1, J2)
    return F


def orthogonal_complement_dot(robot: Manipulator, q, qd, independent=None) -> np.ndarray:
    """dF/dt along qd, (..., 2N, 2); from J F = 0 the dependent rows are -J1^-1 Jdot F."""
    if independent is None:
        return ee_complement_dot(robot, q, qd)
    q, qd = joint_vectors(robot.n_joints, q=q, qd=qd)
    F = orthogonal_complement(robot, q, independent)
    _, dependent = _partition(robot, independent)
    J1 = constraint_jacobian(robot, q)[..., dependent]
    F_dot = np.zeros(np.broadcast_shapes(F.shape, (*qd.shape[:-1], 1, 1)))
    F_dot[..., dependent, :] = -np.linalg.solve(J1, constraint_jacobian_dot(robot, q, qd) @ F)
    return F_dot


def _partition(robot: Manipulator, independent) -> tuple[list[int], list[int]]:
    independent = list(joint_indices("independent", independent, robot.n_joints))
    return independent, [j for j in range(robot.n_joints) if j not in independent]


def _regular(J: np.ndarray, J1: np.ndarray, independent) -> None:
    measure = np.linalg.svd(J1, compute_uv=False)[..., -1] / np.linalg.svd(J, compute_uv=False)[..., 0]
    if np.any(measure < 1e-12):
        raise ValueError(
            f"independent = {tuple(independent)} is singular here: its measure sigma_min(J1)/sigma_max(J) is "
            f"{np.min(measure):.3g}, needed: >= 1e-12; choose another pair, or None for the end-effector position"
        )


def minimal_dynamics(robot: Manipulator, q, qd, independent=None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Gbar, Cbar, Qbar of (5)-(7):  Gbar q2dd + Cbar q2d + Qbar = A^T c.

    Gbar = F^T G F, Cbar = F^T (C F + G Fdot), both (..., 2, 2); Qbar = F^T Q, (..., 2).
    Raises ValueError where the choice of independent coordinates is singular.
    """
    q, qd = joint_vectors(robot.n_joints, q=q, qd=qd)
    F, F_dot = orthogonal_complement(robot, q, independent), orthogonal_complement_dot(robot, q, qd, independent)
    G, C, Q = mass_matrix(robot, q), coriolis_matrix(robot, q, qd), generalized_forces(robot, q, qd)
    return transpose(F) @ G @ F, transpose(F) @ (C @ F + G @ F_dot), matvec(transpose(F), Q)


def constraint_rank(robot: Manipulator, q, tolerance: float = 1e-9) -> np.ndarray:
    """Rank of J(q) of (3), (...,): how many singular values are above `tolerance` times the longest link."""
    limit = positive_number("tolerance", tolerance) * robot.lengths.max()
    return np.sum(np.linalg.svd(constraint_jacobian(robot, q), compute_uv=False) > limit, axis=-1)


def degree_of_freedom(robot: Manipulator, q, tolerance: float = 1e-9) -> np.ndarray:
    """Differential degree of freedom n - rank J(q), (...,); delta = n - r = 2 where q is regular.

    The text after (7) prints delta = n - m.  Larger values than 2 mark c-space singularities, where J loses rank: on
    the testbed the three corners of the workspace, where one arm is folded and turns freely while two are stretched.
    """
    return robot.n_joints - constraint_rank(robot, q, tolerance)


def _row_space(robot: Manipulator, J: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Q and R of J^T = Q R; raises where J lacks full rank."""
    Q, R = np.linalg.qr(transpose(J))
    size = np.abs(np.diagonal(R, axis1=-2, axis2=-1)).min(axis=-1) / robot.lengths.max()
    if np.any(size < 1e-12):
        raise ValueError(
            f"q is a c-space singularity: J has lost rank (relative pivot {np.min(size):.3g}); allowed: configurations "
            f"with rank J = r = {robot.n_constraints}"
        )
    return Q, R


def nullspace_projector(robot: Manipulator, q) -> np.ndarray:
    """N_J = I - J^+ J of (21)-(22), (..., 2N, 2N): the orthogonal projector onto the tangent space of V.

    Raises ValueError at c-space singularities.
    """
    Q, _ = _row_space(robot, constraint_jacobian(robot, q))
    return np.eye(robot.n_joints) - Q @ transpose(Q)


def nullspace_projector_dot(robot: Manipulator, q, qd) -> np.ndarray:
    """dN_J/dt = -(J^+ Jdot N_J) - (J^+ Jdot N_J)^T, (..., 2N, 2N) in 1/s, for (24).  The chapter prints B for J."""
    q, qd = joint_vectors(robot.n_joints, q=q, qd=qd)
    Q, R = _row_space(robot, constraint_jacobian(robot, q))
    N = np.eye(robot.n_joints) - Q @ transpose(Q)
    half = Q @ np.linalg.solve(transpose(R), constraint_jacobian_dot(robot, q, qd) @ N)
    return -half - transpose(half)


def redundant_dynamics(robot: Manipulator, q, qd) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """G~, C~, Q~ of (23)-(24):  G~ qdd + C~ qd + Q~ = A~^T c, valid wherever J has full rank.

    G~ = N_J G N_J, C~ = N_J (C N_J + G Ndot_J), both (..., 2N, 2N); Q~ = N_J Q, (..., 2N).
    """
    q, qd = joint_vectors(robot.n_joints, q=q, qd=qd)
    N, N_dot = nullspace_projector(robot, q), nullspace_projector_dot(robot, q, qd)
    G, C, Q = mass_matrix(robot, q), coriolis_matrix(robot, q, qd), generalized_forces(robot, q, qd)
    return N @ G @ N, N @ (C @ N + G @ N_dot), matvec(N, Q)


def forward_dynamics(robot: Manipulator, q, qd, c) -> tuple[np.ndarray, np.ndarray]:
    """Accelerations qdd (..., 2N) in rad/s^2 and multipliers lambda (..., 2(N-1)) in N: (2) with J qdd + Jdot qd = 0.

    The multipliers are the cut-joint reactions: -lambda_i is the force in N that the end-effector exerts on the tip of
    the cut arm i (1, 3, ..., N; arm 2 is not cut and carries the load).
    Raises ValueError at c-space singularities.
    """
    q, qd = joint_vectors(robot.n_joints, q=q, qd=qd)
    c = real_array("c", c, robot.n_arms)
    lead = check_leading(q=q.shape[:-1], qd=qd.shape[:-1], c=c.shape[:-1])
    J, J_dot = constraint_jacobian(robot, q), constraint_jacobian_dot(robot, q, qd)
    _row_space(robot, J)
    G, C, Q = mass_matrix(robot, q), coriolis_matrix(robot, q, qd), generalized_forces(robot, q, qd)
    u = np.concatenate([c, np.zeros_like(c)], axis=-1)
    rhs = u - matvec(C, qd) - Q
    n, r = robot.n_joints, robot.n_constraints
    saddle = np.zeros((*lead, n + r, n + r))
    saddle[..., :n, :n], saddle[..., :n, n:], saddle[..., n:, :n] = G, transpose(J), J
    right = np.zeros((*lead, n + r))
    right[..., :n], right[..., n:] = rhs, -matvec(J_dot, qd)
    solution = np.linalg.solve(saddle, right[..., None])[..., 0]
    return solution[..., :n], solution[..., n:]


def kinetic_energy(robot: Manipulator, q, qd) -> np.ndarray:
    """qd^T G qd / 2, (...,) in J."""
    q, qd = joint_vectors(robot.n_joints, q=q, qd=qd)
    return np.einsum("...i,...ij,...j->...", qd, mass_matrix(robot, q), qd) / 2


def potential_energy(robot: Manipulator, q) -> np.ndarray:
    """Potential energy of gravity relative to the base points, (...,) in J; dV/dq is the gravity part of Q."""
    a, d = arm_vectors(robot, q)
    moments = robot.arm_moments / robot.lengths
    return -((moments[:, :1] * a + moments[:, 1:] * d) @ robot.gravity).sum(axis=-1)
