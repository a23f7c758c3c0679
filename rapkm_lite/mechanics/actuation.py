"""Actuation: control matrix, degree of actuation (8)-(10), inverse dynamics and prestress (11).

m = N drives act on delta = 2 degrees of freedom.  What needs only a matrix takes any A (..., m, delta) of full rank.
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
    shaped,
    small_number,
    tall_matrix,
)
from ..machine.manipulator import Manipulator, manipulator
from . import cores, linalg
from .at import asked
from .linalg import many_inverses, minors, product


def control_matrix(robot: Manipulator, q, independent=None) -> np.ndarray:
    """A(q) of the text before (6), qd_a = A q2d, so that A^T c are the control forces in (6), (..., m, 2).

    independent : two 0-based joint indices, or None for the end-effector position (then A is in rad/m).
    Raises ValueError where the choice is singular, see `orthogonal_complement`, and for open loops.

    >>> import rapkm_lite as rk; robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> rk.control_matrix(robot, q).round(2)
    array([[ 0.57,  4.97],
           [-5.09, -0.87],
           [ 5.77, -2.19]])
    """
    return asked(robot, q).using(independent).A.copy()


def redundant_control_matrix(robot: Manipulator, q) -> np.ndarray:
    """A~(q) of (21), the rows of N_J of the driven joints, (..., m, 2N): the control forces in (22), (23) are A~^T c.

    Raises ValueError at c-space singularities and for open loops.

    >>> import rapkm_lite as rk; robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> rk.redundant_control_matrix(robot, q).shape
    (3, 6)
    """
    return asked(robot, q).A_tilde.copy()


def degree_of_actuation(robot: Manipulator, q, tolerance: float = 1e-7) -> np.ndarray:
    """alpha(q) of (10), (...,): how many control vector fields of (8) are independent; rank A for regular Gbar.

    Counted as the rank of A~, whose entries need no scaling.  Where alpha changes in every neighbourhood of q, the
    chapter calls q an input singularity; here these are the poses with alpha < delta = 2.
    tolerance : singular values of A~, which are at most 1, count above it.
    Raises ValueError at c-space singularities and for open loops.

    >>> import rapkm_lite as rk; robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> int(rk.degree_of_actuation(robot, q))
    2
    """
    tolerance = small_number("tolerance", tolerance)
    sigma = np.linalg.svd(asked(robot, q).A_tilde, compute_uv=False)
    return np.sum(sigma > tolerance, axis=-1)


def actuation_type(robot: Manipulator, q):
    """'underactuated' (alpha < 2), 'fully actuated' (alpha = m = 2) or 'redundantly actuated' (m > alpha = 2), by (10).

    The text after it compares alpha with delta and with m, separately: since m >= 2, a pose with alpha < 2 is both
    underactuated (alpha < delta) and redundantly actuated (m > alpha), so redundantly underactuated.
    A str for one pose q (2N,), an array (...,) of str for many.
    Raises ValueError at c-space singularities and for open loops.

    >>> import rapkm_lite as rk; robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> rk.actuation_type(robot, q)
    'redundantly actuated'
    """
    full = "redundantly actuated" if manipulator(robot).n_arms > 2 else "fully actuated"
    kind = np.where(degree_of_actuation(robot, q) < 2, "underactuated", full)
    return kind if kind.ndim else str(kind)


def control_vector_fields(robot: Manipulator, q, independent=None) -> np.ndarray:
    """Lower half Gbar^-1 A^T of the control vector fields g in (9), (..., 2, m): q2dd per unit torque of each drive.

    The state (q2, q2d) of (8) moves along the drift field f of (9) and the sum of these fields times the torques.
    `independent` and errors: see `control_matrix`.

    >>> import rapkm_lite as rk; robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> rk.control_vector_fields(robot, q).shape
    (2, 3)
    """
    pose = asked(robot, q).using(independent)
    _ = pose.F  # raises where the choice is singular
    # As joint accelerations T (T^T G T)^-1 T_a^T in an orthonormal basis T of the motions: Gbar = F^T G F squares the
    # condition number of F, which the choice of coordinates makes large, while the fields stay as they are.
    (Q, R), N = pose._row_space, robot.n_arms
    T = Q[..., R.shape[-1] :]
    qdd = product(T, np.linalg.solve(product(T.mT, pose.G, T), T[..., :N, :].mT))
    if pose.independent is not None:
        return qdd[..., list(pose.independent), :]
    arm = [1, N + 1]
    return product(pose.tip_columns[..., arm], qdd[..., arm, :])


def drive_pairs(robot: Manipulator) -> list[tuple[int, int]]:
    """All pairs of drives, 0-based: for three arms (0, 1), (0, 2), (1, 2).

    >>> import rapkm_lite as rk
    >>> rk.drive_pairs(rk.load())
    [(0, 1), (0, 2), (1, 2)]
    """
    return list(itertools.combinations(range(manipulator(robot).n_arms), 2))


def distal_cross_products(robot: Manipulator, q) -> np.ndarray:
    """d_j x d_k of the unit distal directions for all `drive_pairs`, (..., pairs).

    Zero where the angles of the pair (j, k) are no coordinates (parameterization singularity); open loops are taken.

    >>> import rapkm_lite as rk; robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> rk.distal_cross_products(robot, q).round(3)
    array([ 0.96 , -0.969,  0.507])
    """
    return minors(asked(robot, q).d / robot.lengths[:, 1:])


def singular_values(A) -> np.ndarray:
    """Singular values (..., delta) of A (..., m, delta), largest first, for any mechanism.

    For two columns from the minors, which near an input singularity errs by less than a general decomposition.
    A lost rank is a zero, no error.  Raises ValueError for fewer rows than columns.

    >>> import rapkm_lite as rk
    >>> rk.singular_values([[3.0, 0.0], [0.0, 4.0], [0.0, 0.0]])
    array([4., 3.])
    """
    return linalg.singular_values(tall_matrix("A", A))


def weighted_pseudoinverse(A, W=None) -> np.ndarray:
    """(A^T)_W^+ = W^-1 A (A^T W^-1 A)^-1 of (11), (..., m, delta): of all c with A^T c = f the one of least c^T W c.

    W : symmetric positive definite, one number, (m,) or (..., m, m); default the identity.
    Raises ValueError when W is not positive definite, at input singularities, and for weights so far apart that
    rounding hides the rank of A (some 1e24).

    >>> import rapkm_lite as rk
    >>> rk.weighted_pseudoinverse([[2.0, 1.0], [1.0, 2.0], [1.0, 0.5]], W=[1.0, 1.0, 3.0]).round(3)
    array([[ 0.615, -0.308],
           [-0.333,  0.667],
           [ 0.103, -0.051]])
    """
    A = tall_matrix("A", A)
    if W is None:
        inverses = many_inverses(A)
        return cores.right_inverse("A", A) if inverses is None else inverses
    L = np.linalg.cholesky(positive_definite("W", W, A.shape[-2]))
    check_leading(A=A.shape[:-2], W=L.shape[:-2])
    Q, R, _ = cores.uneven_rank("A weighted with W", np.linalg.solve(L, A))
    return np.linalg.solve(L.mT, np.linalg.solve(R, Q.mT).mT)


def prestress_projector(A, W=None) -> np.ndarray:
    """N_{A^T,W} = I - (A^T)_W^+ A^T of (11), (..., m, m): its range is the torques that move nothing.

    W and errors: see `weighted_pseudoinverse`.

    >>> import numpy as np, rapkm_lite as rk; robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> int(np.linalg.matrix_rank(rk.prestress_projector(rk.control_matrix(robot, q))))
    1
    """
    A = tall_matrix("A", A)
    # The pseudoinverse times A^T would err by the condition number of A: torques that move something.
    if W is None:
        Q, _ = cores.full_rank("A", A)
        return np.eye(A.shape[-2]) - product(Q, Q.mT)
    L = np.linalg.cholesky(positive_definite("W", W, A.shape[-2]))
    check_leading(A=A.shape[:-2], W=L.shape[:-2])
    n = cores.uneven_rank("A weighted with W", np.linalg.solve(L, A))[-1]
    return np.linalg.solve(L.mT, product(n, n.mT, L.mT))


def inverse_dynamics(robot: Manipulator, q, qd, qdd, W=None, prestress=None) -> np.ndarray:
    """Drive torques c (..., m) in N m of (11): c = (A^T)_W^+ F^T (G qdd + C qd + Q) + N_{A^T,W} c0.

    Of all torques for the motion, those of least (c - c0)^T W (c - c0).
    q, qd, qdd : a motion on V, (..., 2N); a qd that opens the loops is refused.  W : see `weighted_pseudoinverse`.
    prestress : c0 (..., m) in N m, of which the part in the null space of A^T is added; default none.
    Evaluated in end-effector coordinates, so that no parameterization singularity enters; without W and prestress it is
    also the inverse dynamics (25) in redundant coordinates.
    Raises ValueError at input singularities, for open loops, where an arm is stretched or folded, and for a W that
    `weighted_pseudoinverse` refuses.

    >>> import rapkm_lite as rk; robot = rk.load(); path = rk.circle(robot, 0.05, 0.1)
    >>> rk.inverse_dynamics(robot, path.q, path.qd, path.qdd).shape
    (101, 3)
    """
    pose, wrench = _driven(robot, q, qd, qdd)
    pinv = weighted_pseudoinverse(pose.A, W)
    check_leading(motion=wrench.shape[:-1], W=pinv.shape[:-2])
    c = matvec(pinv, wrench)
    if prestress is not None:
        c0 = real_array("prestress", prestress, robot.n_arms)
        check_leading(motion=c.shape[:-1], prestress=c0.shape[:-1])
        c = c + matvec(prestress_projector(pose.A, W), c0)
    return c


def required_wrench(robot: Manipulator, q, qd, qdd) -> np.ndarray:
    """Force F^T (G qdd + C qd + Q), (..., 2) in N, that the drives must produce at the end-effector for a motion on V.

    As in the first line of (11); on V it is the left-hand side Gbar q2dd + Cbar q2d + Qbar of (6), with the
    end-effector position as q2.
    Raises ValueError for open loops, for a qd that opens them, and where an arm is stretched or folded.

    >>> import rapkm_lite as rk; robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> bool(abs(rk.required_wrench(robot, q, 0 * q, 0 * q)).max() < 1e-12)
    True
    """
    return _driven(robot, q, qd, qdd)[1]


def _driven(robot: Manipulator, q, qd, qdd):
    """The pose, and the wrench of a motion."""
    q, qd, qdd = joint_vectors(manipulator(robot).n_joints, q=q, qd=qd, qdd=qdd)
    pose = asked(robot, q, qd)
    F = pose.F
    cores.check_tangent(robot.tree, pose.J, qd)
    return pose, matvec(F.mT, matvec(pose.G, qdd) + matvec(pose.C, qd) + pose.Q)


def force_polygon(A, torque: float) -> np.ndarray:
    """Corners (2m, 2) in N of the zonotope of all forces A^T c with |c_i| <= torque in N m, A (m, 2) in rad/m.

    From the lowest one on counter-clockwise; a line where A has lost rank.
    Raises ValueError for A of more than one pose, and unless `torque` is above 0.

    >>> import rapkm_lite as rk; robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> rk.force_polygon(rk.control_matrix(robot, q), torque=0.1).shape
    (6, 2)
    """
    A = tall_matrix("A", A)
    shaped("A", A, A.ndim == 2 and A.shape[-1] == 2, "(m, 2), one pose")
    edges = 2 * positive_number("torque", torque) * A
    edges = np.where((edges[:, 1:] < 0) | ((edges[:, 1:] == 0) & (edges[:, :1] < 0)), -edges, edges)
    edges = edges[np.argsort(np.arctan2(edges[:, 1], edges[:, 0]))]
    half = -edges.sum(axis=0) / 2 + np.cumsum(np.vstack([np.zeros(2), edges[:-1]]), axis=0)
    return np.vstack([half, -half])
