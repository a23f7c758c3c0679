"""Actuation: control matrix, degree of actuation, inverse dynamics, prestress, antagonism filter, steady state.

Equations (8)-(11), (13)-(15), (17), (25)-(27).  m = N drives act on delta = 2 degrees of freedom.
"""

from __future__ import annotations

import itertools

import numpy as np

from ._arguments import joint_indices, matvec, positive_definite, real_array, transpose
from .dynamics import minimal_dynamics, nullspace_projector, orthogonal_complement
from .kinematics import arm_vectors, cross, ee_complement_dot
from .manipulator import Manipulator


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
    sigma = np.linalg.svd(redundant_control_matrix(robot, q), compute_uv=False)
    return np.sum(sigma > tolerance, axis=-1)


def actuation_type(robot: Manipulator, q) -> str:
    """'underactuated', 'fully actuated' or 'redundantly actuated' at one pose q (2N,), from alpha, delta = 2 and m."""
    alpha = int(degree_of_actuation(robot, real_array("q", q, robot.n_joints)))
    if alpha < 2:
        return "underactuated"
    return "redundantly actuated" if robot.n_arms > alpha else "fully actuated"


def control_vector_fields(robot: Manipulator, q, independent=None) -> np.ndarray:
    """Columns Gbar^-1 A^T of (8)-(9), (..., 2, m): the acceleration of q2 per unit torque of each drive."""
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
    A = real_array("A", A)
    u, v = A[..., 0], A[..., 1]
    uu, vv, uv = (u * u).sum(-1), (v * v).sum(-1), (u * v).sum(-1)
    largest = np.sqrt((uu + vv + np.hypot(uu - vv, 2 * uv)) / 2)
    # Lagrange's identity: the product of the singular values without cancellation.
    minors = [u[..., i] * v[..., j] - u[..., j] * v[..., i] for i, j in itertools.combinations(range(u.shape[-1]), 2)]
    area = np.sqrt(sum(x * x for x in minors))
    smallest = np.divide(area, largest, out=np.zeros_like(area), where=largest > 0)
    return np.stack([largest, smallest], axis=-1)


def _full_rank_qr(name: str, A: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
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
    A = real_array("A", A)
    if A.ndim < 2:
        raise ValueError(f"A has shape {A.shape}; allowed: (..., m, delta)")
    if W is None:
        Q, R = _full_rank_qr("A", A)
        return Q @ np.linalg.inv(transpose(R))
    L = np.linalg.cholesky(positive_definite("W", W, A.shape[-2]))
    Q, R = _full_rank_qr("A", np.linalg.solve(L, A))
    return np.linalg.solve(transpose(L), Q) @ np.linalg.inv(transpose(R))


def prestress_projector(A, W=None) -> np.ndarray:
    """N_{A^T,W} = I - (A^T)_W^+ A^T of (11), (..., m, m): its range are the torques that move nothing."""
    A = real_array("A", A)
    return np.eye(A.shape[-2]) - weighted_pseudoinverse(A, W) @ transpose(A)


def antagonism_filter(A) -> np.ndarray:
    """R = (A^T)^+ A^T of (15), (..., m, m): removes the part of the torques that only prestresses; A^T R = A^T.

    Raises ValueError at input singularities.
    """
    Q, _ = _full_rank_qr("A", real_array("A", A))
    return Q @ transpose(Q)


def command_filter(A, K) -> np.ndarray:
    """R_K = (A^T K)^+ A^T K of (17), (..., m, m), for a gain K (number, (m,) or (m, m)), applied to errors.

    -K R_K e has the same end-effector force as the filtered -R K e, and the same torques only for K = k I.
    """
    A = real_array("A", A)
    return antagonism_filter(positive_definite("K", K, A.shape[-2]) @ A)


def null_vector(robot: Manipulator, q) -> np.ndarray:
    """Unit null vector of A^T for three arms in closed form, (..., 3): n_i ~ (a_i x d_i) (d_j x d_k), i, j, k cyclic.

    Raises ValueError for another number of arms, and at input singularities, where the null space has two dimensions.
    """
    if robot.n_arms != 3:
        raise ValueError(f"null_vector is for 3 arms, this machine has {robot.n_arms}; use prestress_projector")
    a, d = arm_vectors(robot, q)
    d = d / robot.lengths[:, 1:]
    n = cross(a, d) * cross(np.roll(d, -1, axis=-2), np.roll(d, -2, axis=-2))
    size = np.linalg.norm(n, axis=-1, keepdims=True)
    if np.any(size < 1e-12 * robot.lengths[:, 0].max()):
        raise ValueError("q is an input singularity (all distal links parallel): the null space of A^T is a plane there")
    return n / size


def inverse_dynamics(robot: Manipulator, q, qd, qdd, W=None, prestress=None) -> np.ndarray:
    """Drive torques c (..., m) in N m of (11): c = (A^T)_W^+ (Gbar q2dd + Cbar q2d + Qbar) + N_{A^T,W} c0.

    q, qd, qdd : a motion on V, (..., 2N).  W : see `weighted_pseudoinverse`.
    prestress : c0 (..., m) in N m, of which the part in the null space of A^T is added; default none.
    Evaluated in end-effector coordinates, so that no parameterization singularity enters.
    """
    A = control_matrix(robot, q)
    c = matvec(weighted_pseudoinverse(A, W), required_wrench(robot, q, qd, qdd))
    if prestress is not None:
        c = c + matvec(prestress_projector(A, W), real_array("prestress", prestress, robot.n_arms))
    return c


def required_wrench(robot: Manipulator, q, qd, qdd) -> np.ndarray:
    """Force (..., 2) in N at the end-effector that the drives must produce for the motion q, qd, qdd on V.

    The left-hand side Gbar q2dd + Cbar q2d + Qbar of (5) with the end-effector position as q2.
    """
    qd, qdd = real_array("qd", qd, robot.n_joints), real_array("qdd", qdd, robot.n_joints)
    Gbar, Cbar, Qbar = minimal_dynamics(robot, q, qd)
    F, F_dot = orthogonal_complement(robot, q), ee_complement_dot(robot, q, qd)
    xd = matvec(np.linalg.pinv(F), qd)
    xdd = matvec(np.linalg.pinv(F), qdd - matvec(F_dot, xd))
    return matvec(Gbar, xdd) + matvec(Cbar, xd) + Qbar


def steady_state_error(A, K_P, offset, wrench=None) -> np.ndarray:
    """Error e_a = q_a - q_a^d (..., m) in rad at rest under PD with offsets, (14) corrected:

    e_a = -A (A^T K_P A)^-1 (A^T K_P offset + wrench).  The chapter's formula has shapes that do not fit.

    offset : (..., m) in rad, measured minus true angle.  K_P : positive definite, N m/rad.
    wrench : static control force A^T c (..., 2) that gravity and load demand (Qbar at rest); default none.
    """
    A = real_array("A", A)
    offset = real_array("offset", offset, A.shape[-2])
    K = positive_definite("K_P", K_P, A.shape[-2])
    force = matvec(transpose(A) @ K, offset)
    if wrench is not None:
        force = force + real_array("wrench", wrench, A.shape[-1])
    stiffness = transpose(A) @ K @ A
    return -matvec(A, np.linalg.solve(stiffness, np.broadcast_to(force, stiffness.shape[:-1])[..., None])[..., 0])


def steady_state_torque(A, K_P, offset, wrench=None) -> np.ndarray:
    """Torques c = -K_P (e_a + offset) (..., m) in N m at rest, from (12)-(14); without wrench all of it is antagonism."""
    K = positive_definite("K_P", K_P, np.shape(A)[-2])
    return -matvec(K, steady_state_error(A, K_P, offset, wrench) + np.asarray(offset, dtype=float))


def explicit_pseudoinverse(A_tilde, rows) -> np.ndarray:
    """(A~^T)^+ of (27), (..., m, n), from the partition of A~ (..., m, n) into A~_1 (`rows`) and the rest A~_2 = B A~_1:

    (A~^T)^+ = [I; B] (I + B^T B)^-1 (A~_1^T)^+, the same for every partition with regular A~_1.
    rows : delta = 2 row indices of A~_1, a pair or (..., 2).
    Raises ValueError where A~_1 has lost rank.
    """
    A_tilde = real_array("A_tilde", A_tilde)
    rows = _row_choice(rows, A_tilde)
    A1 = np.take_along_axis(A_tilde, rows[..., None], axis=-2)
    Q, R = _full_rank_qr("A~_1 of this partition", transpose(A1))
    A1T_pinv = np.linalg.solve(R, transpose(Q))
    B_all = A_tilde @ transpose(A1T_pinv)  # the identity in `rows`, B in the others
    return B_all @ np.linalg.solve(transpose(B_all) @ B_all, A1T_pinv)


def _row_choice(rows, A_tilde: np.ndarray) -> np.ndarray:
    rows = np.asarray(rows)
    if rows.ndim == 1:
        rows = np.asarray(joint_indices("rows", rows, A_tilde.shape[-2]))
    return np.broadcast_to(rows, A_tilde.shape[:-2] + (2,))


def _inverse_condition(A: np.ndarray) -> np.ndarray:
    sigma = singular_values(A)
    return sigma[..., 1] / np.maximum(sigma[..., 0], 1e-300)


_RULES = {
    "sigma_min": lambda A1: singular_values(transpose(A1))[..., 1],
    "condition": lambda A1: _inverse_condition(transpose(A1)),
    "printed": lambda A1: -np.abs(A1).sum(axis=-1).max(axis=-1),
}


def select_independent(A_tilde, rule: str = "sigma_min") -> np.ndarray:
    """Rows (..., 2) of A~ (..., m, n) that make the best A~_1 for (27).

    rule : "sigma_min" takes the largest smallest singular value, "condition" the smallest condition number; "printed"
    is the chapter's smallest row-sum norm, for study only: it is the wrong way round.
    """
    A_tilde = real_array("A_tilde", A_tilde)
    if rule not in _RULES:
        raise ValueError(f"rule = {rule!r}; allowed: {', '.join(_RULES)}")
    pairs = np.array(list(itertools.combinations(range(A_tilde.shape[-2]), 2)))
    merit = np.stack([_RULES[rule](A_tilde[..., pair, :]) for pair in pairs], axis=-1)
    return pairs[np.argmax(merit, axis=-1)]
