"""What closed loops obey: projector of (30), Lyapunov function (31), effective gain of (35), size of the feedback."""

from __future__ import annotations

import numpy as np

from ..machine.arguments import (
    bounded,
    check_leading,
    exact_array,
    joint_indices,
    joint_vectors,
    real_array,
    shaped,
    tall_matrix,
    wide_matrix,
)
from ..machine.manipulator import Manipulator, manipulator
from ..mechanics.actuation import weighted_pseudoinverse
from ..mechanics.at import at
from ..mechanics.cores import full_rank
from ..mechanics.dynamics import redundant_dynamics
from ..mechanics.linalg import product, singular_values
from ..mechanics.partition import explicit_pseudoinverse, select_independent
from .grammar import joint_gain


def closed_loop_projector(A_tilde, delta: int = 2) -> np.ndarray:
    """D = A~^T (A~^T)^+ of (30), (..., n, n); equal to N_J wherever the degree of actuation is delta.

    A_tilde : (..., m, n), of any mechanism.  delta : its rank; 2 for the machines of `Manipulator`.
    Raises ValueError at input singularities, and where `delta` is not the rank.

    >>> import numpy as np, rapkm_lite as rk; robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> D = rk.closed_loop_projector(rk.redundant_control_matrix(robot, q))
    >>> np.allclose(D, rk.nullspace_projector(robot, q))
    True
    """
    A_tilde = wide_matrix("A_tilde", A_tilde)
    rows = select_independent(A_tilde, delta=delta)
    try:
        explicit_pseudoinverse(A_tilde, rows)  # raises where `rows` do not span all of them
        # The product with it would square the condition number of A~; the chosen rows have the same span.
        Q, _ = full_rank("A_tilde", np.take_along_axis(A_tilde, rows[..., None], axis=-2).mT)
        return product(Q, Q.mT)
    except ValueError:
        rank = np.linalg.matrix_rank(A_tilde, rtol=1e-12)
        other = rank[rank != rows.shape[-1]]
        if other.size == 0:
            raise
        words = " (at an input singularity it is less than elsewhere)" if other[0] < rows.shape[-1] else ""
        raise ValueError(
            f"delta = {rows.shape[-1]}, but A_tilde has rank {other[0]}{words}; allowed: the rank of A_tilde"
        ) from None


def effective_gain(F, K) -> np.ndarray:
    """(F^T F)^-1 F^T K F of (35) corrected, (..., delta, delta): the gain that the error e2 feels under `RedundantCTC`.

    F : (..., n, delta).  K : one number, or a matrix (..., n, n), which may be singular (drives only: diag(k, 0)).
    Raises ValueError where F has lost rank.

    >>> import numpy as np, rapkm_lite as rk; robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> np.allclose(rk.effective_gain(rk.orthogonal_complement(robot, q), 400.0), 400.0 * np.eye(2))
    True
    """
    F = tall_matrix("F", F)
    n = F.shape[-2]
    K = real_array("K", K)
    shaped("K", K, K.shape[-2:] in ((), (n, n)), f"one number or (..., {n}, {n})")
    K = K * np.eye(n) if K.ndim == 0 else K
    check_leading(F=F.shape[:-2], K=K.shape[:-2])
    Q, R = full_rank("F", F, "its columns are not independent; allowed: one column for each degree of freedom")
    return np.linalg.solve(R, Q.mT @ K @ F)


def lyapunov_function(robot: Manipulator, q, e, ed, K_P, eps: float = 0.0) -> np.ndarray:
    """V = (ed^T G~ ed + e^T K_P e + eps e^T G~ ed) / 2 of (31), (...,) in J, for errors e, ed (..., 2N).

    K_P : as in `RedundantAPD`; with the gains (29), (m,), it has rank m of 2N, and V is positive definite on errors
        tangent to V only, where the degree of actuation is delta.  eps : in 1/s, not negative.
    At a fixed desired pose V with eps = 0 falls under `RedundantAPD`, dV/dt = -ed^T K_D ed: not at all where ed = 0.
    With eps > 0 it falls there too, dV/dt = -eps e^T D K_P e / 2; that this makes the tracking exponential is what the
    chapter states.  Raises ValueError at c-space singularities and for open loops.

    >>> import numpy as np, rapkm_lite as rk; robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> float(rk.lyapunov_function(robot, q, 0.01 * np.ones(6), np.zeros(6), K_P=7.0).round(6))
    0.0021
    """
    q, e, ed = joint_vectors(manipulator(robot).n_joints, q=q, e=e, ed=ed)
    eps = float(bounded("eps", exact_array("eps", eps), 0.0, strict=False))
    Gt, _, _ = redundant_dynamics(robot, q, np.zeros(robot.n_joints))
    K = joint_gain("K_P", K_P, robot.n_arms)
    check_leading(q=q.shape[:-1], e=e.shape[:-1], ed=ed.shape[:-1], K_P=K.shape[:-2])
    form = lambda u, M, v: np.einsum("...i,...ij,...j->...", u, M, v)  # noqa: E731
    return (form(ed, Gt, ed) + form(e, K, e) + eps * form(e, Gt, ed)) / 2


def feedback_norm(robot, q, pair=None) -> np.ndarray:
    """Largest singular value (...,) of the map from feedback acceleration to torques, in N m per rad/s^2.

    pair : drives whose angles are the independent coordinates, A (A^T A)^-1 Gbar; None for redundant coordinates,
    (A~^T)^+ G~.  Raises ValueError at input and c-space singularities and for open loops, for a pair where an arm is
    stretched or folded, too; where the pair is singular the norm is large, not infinite.

    >>> import rapkm_lite as rk; robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> float(rk.feedback_norm(robot, q).round(4))
    0.0056
    """
    pose = at(robot, q)
    if pair is None:
        M = product(pose.A_tilde_T_pinv, pose.N, pose.G, pose.N)
    else:
        pair = joint_indices("pair", pair, robot.n_arms, 2, "drive")
        # In end-effector coordinates first, so that a grid point on the curve is no special case.
        a, b, c, d = (pose.A[..., i, k] for i in pair for k in range(2))
        det = a * d - b * c
        least = 1e-12 * np.linalg.norm(pose.A, axis=(-2, -1)) ** 2
        det = np.where(np.abs(det) < least, least, det)
        to_ee = np.stack([np.stack([d, -b], axis=-1), np.stack([-c, a], axis=-1)], axis=-2) / det[..., None, None]
        M = product(weighted_pseudoinverse(pose.A), pose.F.mT, pose.G, pose.F, to_ee)
    return singular_values(M)[..., 0]
