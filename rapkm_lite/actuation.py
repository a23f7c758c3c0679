"""Actuation: control matrix, degree of actuation, inverse dynamics, prestress, antagonism filter, steady state.

Equations (8)-(11), (13)-(15), (17), (25)-(27).  m = N drives act on delta = 2 degrees of freedom.
"""

from __future__ import annotations

import itertools

import numpy as np

from ._arguments import (
    bounded,
    check_leading,
    exact_array,
    joint_indices,
    joint_vectors,
    matvec,
    one_of,
    positive_definite,
    positive_number,
    real_array,
    tall_matrix,
    transpose,
    wide_matrix,
)
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
    A = tall_matrix("A", A)
    if W is None:
        Q, R = _full_rank_qr("A", A)
        return Q @ np.linalg.inv(transpose(R))
    L = np.linalg.cholesky(positive_definite("W", W, A.shape[-2]))
    check_leading(A=A.shape[:-2], W=L.shape[:-2])
    Q, R = _full_rank_qr("A", np.linalg.solve(L, A))
    return np.linalg.solve(transpose(L), Q) @ np.linalg.inv(transpose(R))


def prestress_projector(A, W=None) -> np.ndarray:
    """N_{A^T,W} = I - (A^T)_W^+ A^T of (11), (..., m, m): its range are the torques that move nothing."""
    A = tall_matrix("A", A)
    return np.eye(A.shape[-2]) - weighted_pseudoinverse(A, W) @ transpose(A)


def antagonism_filter(A) -> np.ndarray:
    """R = (A^T)^+ A^T of (15), (..., m, m): removes the part of the torques that only prestresses; A^T R = A^T.

    Raises ValueError at input singularities.
    """
    Q, _ = _full_rank_qr("A", tall_matrix("A", A))
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


def steady_state_error(A, K_P, offset, wrench=None) -> np.ndarray:
    """Error e_a = q_a - q_a^d (..., m) in rad at rest under PD with offsets, (14) corrected:

    e_a = -A (A^T K_P A)^-1 (A^T K_P offset + wrench).  The chapter's formula has shapes that do not fit.  It solves the
    equilibrium (13), A^T K_P (e_a + offset) + wrench = 0, for small errors e_a = A e_x.

    offset : (..., m) in rad, measured minus true angle.  K_P : positive definite, N m/rad.
    wrench : static control force A^T c (..., 2) that gravity and load demand (Qbar at rest); default none.
    """
    A = tall_matrix("A", A)
    _full_rank_qr("A", A)
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


def explicit_pseudoinverse(A_tilde, rows) -> np.ndarray:
    """(A~^T)^+ of (27), (..., m, n), from the partition (26) of A~ into the rows A~_1 and the others, A~_2 = B A~_1:

    (A~^T)^+ = [I; B] (I + B^T B)^-1 (A~_1^T)^+, the same for every partition with regular A~_1.
    A_tilde : (..., m, n).  rows : the delta = 2 row indices of A~_1, a pair or (..., 2).
    Raises ValueError where A~_1 has lost rank.
    """
    A_tilde = wide_matrix("A_tilde", A_tilde)
    rows = _row_choice(rows, A_tilde)
    A1 = np.take_along_axis(A_tilde, rows[..., None], axis=-2)
    Q, R = _full_rank_qr("A~_1 of this partition", transpose(A1))
    A1T_pinv = np.linalg.solve(R, transpose(Q))
    B_all = A_tilde @ transpose(A1T_pinv)  # the identity in `rows`, B in the others
    return B_all @ np.linalg.solve(transpose(B_all) @ B_all, A1T_pinv)


def _row_choice(rows, A_tilde: np.ndarray) -> np.ndarray:
    m, lead = A_tilde.shape[-2], A_tilde.shape[:-2]
    if np.ndim(rows) < 2:
        return np.broadcast_to(joint_indices("rows", rows, m), (*lead, 2))
    rows = np.asarray(rows)
    if rows.dtype.kind not in "iu" or rows.shape != (*lead, 2):
        raise ValueError(f"rows is an array {rows.shape} of {rows.dtype}; allowed: a pair of indices or {(*lead, 2)}")
    bad = np.any((rows < 0) | (rows >= m), axis=-1) | (rows[..., 0] == rows[..., 1])
    if np.any(bad):
        raise ValueError(f"rows holds the pair {rows[bad][0].tolist()}; allowed: two different ones from 0 to {m - 1}")
    return rows


def _inverse_condition(A: np.ndarray) -> np.ndarray:
    sigma = singular_values(A)
    return sigma[..., 1] / np.maximum(sigma[..., 0], 1e-300)


PARTITION_RULES = {
    "sigma_min": lambda A1: singular_values(transpose(A1))[..., 1],
    "condition": lambda A1: _inverse_condition(transpose(A1)),
    "printed": lambda A1: -np.abs(A1).sum(axis=-1).max(axis=-1),
}


def select_independent(A_tilde, rule: str = "sigma_min") -> np.ndarray:
    """Rows (..., 2) of A~ (..., m, n) that make the best A~_1 for (27).

    rule : "sigma_min" takes the largest smallest singular value, "condition" the smallest condition number; "printed"
    is the chapter's smallest row-sum norm, for study only: it is the wrong way round.
    """
    A_tilde = wide_matrix("A_tilde", A_tilde)
    one_of("rule", rule, PARTITION_RULES)
    pairs = np.array(list(itertools.combinations(range(A_tilde.shape[-2]), 2)))
    merit = np.stack([PARTITION_RULES[rule](A_tilde[..., pair, :]) for pair in pairs], axis=-1)
    return pairs[np.argmax(merit, axis=-1)]
