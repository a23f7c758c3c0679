"""Actuation: control matrix, degree of actuation, inverse dynamics, prestress, antagonism filter, steady state.

Equations (8)-(11), (13)-(15), (17), (25)-(27).  m = N drives act on delta = 2 degrees of freedom.
"""

from __future__ import annotations

import itertools

import numpy as np

from ..machine.arguments import (
    check_leading,
    joint_vectors,
    matvec,
    positive_definite,
    positive_number,
    real_array,
    tall_matrix,
    transpose,
)
from ..machine.manipulator import Manipulator
from .dynamics import minimal_dynamics, nullspace_projector, orthogonal_complement
from .kinematics import arm_vectors, cross, ee_complement_dot


def control_matrix(robot: Manipulator, q, independent=None) -> np.ndarray:
    """A(q) of (6), qd_a = A q2d, so that A^T c are the generalized control forces, (..., m, 2).

    independent : two 0-based joint indices, or None for the end-effector position (then A is in rad/m).
    Raises ValueError where the choice is singular.
    """
    return orthogonal_complement(robot, q, independent)[..., : robot.n_arms, :]


def redundant_control_matrix(robot: Manipulator, q) -> np.ndarray:
    """A~(q) of (23), the rows of N_J of the driven joints, (..., m, 2N): the control forces are A~^T c."""
    return nullspace_projector(robot, q)[..., : robot.n_arms, :]


def degree_of_actuation(robot: Manipulator, q, tolerance: float = 1e-7) -> np.ndarray:
    """alpha(q) of (10), (...,): the rank of the control vector fields, which is rank A for regular Gbar.

    Counted as the rank of A~, whose entries need no scaling; alpha < 2 marks input singularities.
    """
    tolerance = positive_number("tolerance", tolerance)
    sigma = np.linalg.svd(redundant_control_matrix(robot, q), compute_uv=False)
    return np.sum(sigma > tolerance, axis=-1)


def actuation_type(robot: Manipulator, q):
    """'underactuated' (alpha < delta = 2), 'fully actuated' or 'redundantly actuated' (m > alpha = delta), from (10).

    A str for one pose q (2N,), an array (...,) of str for many.
    """
    full = "redundantly actuated" if robot.n_arms > 2 else "fully actuated"
    kind = np.where(degree_of_actuation(robot, q) < 2, "underactuated", full)
    return kind if kind.ndim else str(kind)


def control_vector_fields(robot: Manipulator, q, independent=None) -> np.ndarray:
    """Columns Gbar^-1 A^T of (8)-(9), (..., 2, m): the acceleration of q2 per unit torque of each drive.

    The state (q2, q2d) moves along the drift field and the sum of these vector fields times the torques.
    Raises ValueError where the choice of independent coordinates is singular.
    """
    Gbar, _, _ = minimal_dynamics(robot, q, np.zeros(robot.n_joints), independent)
    return np.linalg.solve(Gbar, transpose(control_matrix(robot, q, independent)))


def drive_pairs(robot: Manipulator) -> list[tuple[int, int]]:
    """All pairs of drives, 0-based: for three arms (0, 1), (0, 2), (1, 2)."""
    return list(itertools.combinations(range(robot.n_arms), 2))


def distal_cross_products(robot: Manipulator, q) -> np.ndarray:
    """d_j x d_k of the unit distal directions for all `drive_pairs`, (..., pairs).

    Zero where the angles of the pair (j, k) are no coordinates (parameterization singularity).
    """
    _, d = arm_vectors(robot, q)
    d = d / robot.lengths[:, 1:]
    return np.stack([cross(d[..., j, :], d[..., k, :]) for j, k in drive_pairs(robot)], axis=-1)


def singular_values(A) -> np.ndarray:
    """Both singular values of (..., m, 2), largest first, in closed form with full relative accuracy of the product."""
    A = tall_matrix("A", A)
    if A.shape[-1] != 2:
        raise ValueError(f"A has shape {A.shape}; allowed: (..., m, 2)")
    u, v = A[..., 0], A[..., 1]
    uu, vv, uv = (u * u).sum(-1), (v * v).sum(-1), (u * v).sum(-1)
    largest = np.sqrt((uu + vv + np.hypot(uu - vv, 2 * uv)) / 2)
    # Lagrange's identity: the product of the singular values without cancellation.
    minors = [u[..., i] * v[..., j] - u[..., j] * v[..., i] for i, j in itertools.combinations(range(u.shape[-1]), 2)]
    area = np.sqrt(sum(x * x for x in minors))
    smallest = np.divide(area, largest, out=np.zeros_like(area), where=largest > 0)
    return np.stack([largest, smallest], axis=-1)


def full_rank_qr(name: str, A: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    Q, R = np.linalg.qr(A)
    pivots = np.abs(np.diagonal(R, axis1=-2, axis2=-1))
    measure = pivots.min(axis=-1) / np.maximum(pivots.max(axis=-1), 1e-300)
    if np.any(measure < 1e-12):
        raise ValueError(
            f"{name} has lost rank (relative pivot {measure.min():.3g}): an input singularity, where the drives cannot "
            "produce every control force; allowed: poses with the full degree of actuation"
        )
    return Q, R


def weighted_pseudoinverse(A, W=None) -> np.ndarray:
    """(A^T)_W^+ = W^-1 A (A^T W^-1 A)^-1 of (11), (..., m, 2): of all c with A^T c = f the one with smallest c^T W c.

    W : symmetric positive definite, one number, (m,) or (..., m, m); default the identity.
    Raises ValueError when W is not, or at input singularities.
    """
    A = tall_matrix("A", A)
    if W is None:
        Q, R = full_rank_qr("A", A)
        return Q @ np.linalg.inv(transpose(R))
    L = np.linalg.cholesky(positive_definite("W", W, A.shape[-2]))
    check_leading(A=A.shape[:-2], W=L.shape[:-2])
    Q, R = full_rank_qr("A", np.linalg.solve(L, A))
    return np.linalg.solve(transpose(L), Q) @ np.linalg.inv(transpose(R))


def prestress_projector(A, W=None) -> np.ndarray:
    """N_{A^T,W} = I - (A^T)_W^+ A^T of (11), (..., m, m): its range are the torques that move nothing."""
    A = tall_matrix("A", A)
    return np.eye(A.shape[-2]) - weighted_pseudoinverse(A, W) @ transpose(A)


def inverse_dynamics(robot: Manipulator, q, qd, qdd, W=None, prestress=None) -> np.ndarray:
    """Drive torques c (..., m) in N m of (11): c = (A^T)_W^+ (Gbar q2dd + Cbar q2d + Qbar) + N_{A^T,W} c0.

    q, qd, qdd : a motion on V, (..., 2N).  W : see `weighted_pseudoinverse`.
    prestress : c0 (..., m) in N m, of which the part in the null space of A^T is added; default none.
    Evaluated in end-effector coordinates, so that no parameterization singularity enters; without W and prestress it is
    also the inverse dynamics (25) in redundant coordinates.
    """
    A, wrench = control_matrix(robot, q), required_wrench(robot, q, qd, qdd)
    pinv = weighted_pseudoinverse(A, W)
    check_leading(motion=wrench.shape[:-1], W=pinv.shape[:-2])
    c = matvec(pinv, wrench)
    if prestress is not None:
        c0 = real_array("prestress", prestress, robot.n_arms)
        check_leading(motion=c.shape[:-1], prestress=c0.shape[:-1])
        c = c + matvec(prestress_projector(A, W), c0)
    return c


def required_wrench(robot: Manipulator, q, qd, qdd) -> np.ndarray:
    """Force (..., 2) in N at the end-effector that the drives must produce for the motion q, qd, qdd on V.

    The left-hand side Gbar q2dd + Cbar q2d + Qbar of (5) with the end-effector position as q2.
    """
    q, qd, qdd = joint_vectors(robot.n_joints, q=q, qd=qd, qdd=qdd)
    Gbar, Cbar, Qbar = minimal_dynamics(robot, q, qd)
    F, F_dot = orthogonal_complement(robot, q), ee_complement_dot(robot, q, qd)
    xd = matvec(np.linalg.pinv(F), qd)
    xdd = matvec(np.linalg.pinv(F), qdd - matvec(F_dot, xd))
    return matvec(Gbar, xdd) + matvec(Cbar, xd) + Qbar


def force_polygon(A, torque: float) -> np.ndarray:
    """Corners (2m, 2) in N of the zonotope of all forces A^T c with |c_i| <= torque, A (m, 2), counter-clockwise."""
    edges = 2 * torque * real_array("A", A)
    edges = np.where((edges[:, 1:] < 0) | ((edges[:, 1:] == 0) & (edges[:, :1] < 0)), -edges, edges)
    edges = edges[np.argsort(np.arctan2(edges[:, 1], edges[:, 0]))]
    half = -edges.sum(axis=0) / 2 + np.cumsum(np.vstack([np.zeros(2), edges[:-1]]), axis=0)
    return np.vstack([half, -half])
