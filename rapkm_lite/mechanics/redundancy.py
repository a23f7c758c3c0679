"""Using the redundancy: torques within limits, of least size or least peak, and what a prestress does to stiffness.

Of all torques c with A^T c = w, (11) takes those of least weighted size.  Drives have limits, and then the choice is a
small convex problem: a quadratic programme, or a linear one for the least peak.
"""

from __future__ import annotations

import numpy as np

from ..machine.arguments import (
    bounded,
    check_leading,
    drive_values,
    exact_array,
    positive_definite,
    real_array,
    shaped,
    tall_matrix,
)
from ..machine.manipulator import Manipulator
from . import cores
from .actuation import weighted_pseudoinverse
from .at import At, at


def allocate_torques(A, wrench, limit, W=None, prestress=None) -> np.ndarray:
    """Torques c (m,) in N m of least (c - c0)^T W (c - c0) with A^T c = wrench and |c_i| <= limit_i.

    The least-distance programme of Lawson and Hanson in the coordinates of the null space, solved by SciPy's
    non-negative least squares, which ends after finitely many steps; where no limit is active it is (11).
    A : (m, delta), of any mechanism.  wrench : (delta,), N or N m.  limit : number or (m,), N m, positive.
    W : symmetric positive definite, one number, (m,) or (m, m); default the identity.  prestress : c0 (m,), N m,
    default none.
    Raises ValueError at input singularities, for a wrench beyond the limits, with the factor by which they fall
    short, for limits more than a factor of 1e12 apart, and where rounding hides the nearest torques: for a
    prestress far beyond the limits, or a force that takes most of limits far apart.

    >>> import rapkm_lite as rk; A = [[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]
    >>> rk.allocate_torques(A, [1.0, 1.0], limit=1.0).round(3), rk.allocate_torques(A, [1.0, 1.0], limit=0.6).round(3)
    (array([0.333, 0.333, 0.667]), array([0.4, 0.4, 0.6]))
    """
    from scipy.optimize import nnls

    A, wrench, limit = _demand(A, wrench, limit)
    m = len(A)
    c0 = np.zeros(m) if prestress is None else exact_array("prestress", prestress, m)
    W = np.eye(m) if W is None else positive_definite("W", W, m)
    shaped("W", W, W.ndim == 2, f"one number, ({m},) or ({m}, {m}), one pose")
    inverse, best = weighted_pseudoinverse(A, W), c0
    for _ in range(4):  # (11), and near an input singularity what its inverse is inexact by, up to 1e-4
        best = best + inverse @ (wrench - A.T @ best)
    if np.all(np.abs(best) <= limit):
        return best
    edge, peak = _least_peak(A, wrench, limit)
    if peak > 1.0 + 1e-12:
        raise _beyond(wrench, peak, limit)
    if len(A) == A.shape[1]:  # on the edge, to rounding, and no other torques make this force
        return np.clip(best, -limit, limit)
    # c = best + n z with |z|^2 the cost above the best one, as a share of the largest weight, and the limits as
    # G z >= h, with rows of length 1 and so h the distances to them.  On the edge of the force polygon rounding would
    # leave nothing between them, though drives that hold no part of the edge are free there.
    n = cores.null_space(A)
    n = n @ np.linalg.inv(np.linalg.cholesky(n.T @ (W / np.abs(W).max()) @ n)).T
    wide = limit * (1.0 + (1e-12 if peak > 1.0 - 1e-9 else 0.0))
    G, h = np.concatenate([-n, n]), np.concatenate([best - wide, -best - wide])
    length = np.linalg.norm(G, axis=1)
    length = np.maximum(length, 1e-15 * length.max())
    G, h = G / length[:, None], h / length
    size = h.max() if h.max() > 0.0 else 1.0
    try:
        u, _ = nnls(np.vstack([G.T, h / size]), np.append(np.zeros(n.shape[1]), 1.0))
        r, slack = G.T @ u, 1.0 - h @ u / size
    except (RuntimeError, np.linalg.LinAlgError):  # SciPy 1.14 may go round in circles
        slack = 0.0
    # Where rounding leaves nothing to divide by, torques of least peak.
    c = np.clip(best + n @ r / slack * size if slack > 1e-12 else edge, -limit, limit)
    # Near the edge rounding is magnified, and what was clipped may make another force.
    missed = np.abs(A.T @ c - wrench).max() > 1e-9 * np.abs(A * c[:, None]).max()
    if (missed or slack <= 1e-12) and peak < 1.0 - 1e-6:
        raise ValueError(
            f"prestress = {c0.tolist()} N m is so far beyond limit = {limit.tolist()} N m, or these are so far apart, "
            "that rounding hides the nearest torques; allowed: a prestress of their size, and limits that differ less"
        )
    return np.clip(edge, -limit, limit) if missed else c


def minimax_torques(A, wrench, limit=1.0) -> np.ndarray:
    """Torques c (m,) in N m with A^T c = wrench whose largest share |c_i| / limit_i is least, by linear programming.

    A : (m, delta).  wrench : (delta,).  limit : number or (m,), N m, positive: which drive counts for how much.
    The force is right to rounding; the peak is least to rounding times the ratio of the limits.
    Raises ValueError at input singularities and for limits more than a factor of 1e12 apart.

    >>> import rapkm_lite as rk
    >>> rk.minimax_torques([[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]], [1.0, 1.0]).round(3)
    array([0.5, 0.5, 0.5])
    """
    return _least_peak(*_demand(A, wrench, limit))[0]


def _demand(A, wrench, limit) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    A = tall_matrix("A", A)
    shaped("A", A, A.ndim == 2, "(m, delta), one pose")
    cores.full_rank("A", A)
    limit = drive_values("limit", bounded("limit", real_array("limit", limit), 0.0, strict=True), len(A))
    return A, exact_array("wrench", wrench, A.shape[1]), limit


def _beyond(wrench: np.ndarray, peak: float, limit: np.ndarray) -> ValueError:
    factor = f"{peak:.4g}" if peak > 1.001 else f"1 + {peak - 1.0:.2g}"
    forces = "force polygon" if wrench.size == 2 else "polytope of forces"
    return ValueError(
        f"wrench = {wrench.tolist()} needs {factor} times limit = {limit.tolist()} N m at least; allowed: a wrench "
        f"inside the {forces} of the limits"
    )


def _least_peak(A: np.ndarray, wrench: np.ndarray, limit: np.ndarray) -> tuple[np.ndarray, float]:
    from scipy.optimize import linprog

    m, delta = A.shape
    if limit.max() > 1e12 * limit.min():
        raise ValueError(f"limit = {limit.tolist()}; allowed: limits of at most 1e12 times one another")
    # In shares c_i / limit_i: those of least squares, and a basis of what makes no force.  So the force is right to
    # rounding whatever the programme's own tolerance, and far limits do not fall below it.
    scale = np.abs(limit[:, None] * A).max()
    Q, R = np.linalg.qr(limit[:, None] * A / scale, mode="complete")
    span, free = Q[:, :delta], Q[:, delta:]

    def shares(force):
        return span @ np.linalg.solve(R[:delta].T, force)

    unit = max(float(np.abs(wrench).max(initial=0.0)), 1e-300)
    least = shares(wrench / unit)
    size, one = max(np.abs(least).max(), 1e-300), np.ones((m, 1))
    below, cost = np.block([[free, -one], [-free, -one]]), np.append(np.zeros(m - delta), 1.0)
    bounds = [(None, None)] * (m - delta) + [(0, None)]
    found = linprog(cost, below, np.concatenate([-least, least]) / size, bounds=bounds)
    if found.status != 0:
        raise ValueError(f"wrench = {wrench.tolist()} has no torques ({found.message}); allowed: a regular A")
    share = least + free @ found.x[:-1] * size
    for _ in range(3):  # what far limits cost in the triangle R: 1e-4 of the force, then 5e-9, 2e-13, rounding
        share += shares(wrench / unit - A.T @ (limit / scale * share))
    return share * limit * unit / scale, float(np.abs(share).max() * unit / scale)


def most_even(basis: np.ndarray) -> float:
    """The largest possible smallest component of a combination n of null vectors, columns of (m, k), with n_i <= 1."""
    m, k = basis.shape
    if k < 2:
        return max((float(n.min()) for n in (*basis.T, *-basis.T)), default=0.0)
    from scipy.optimize import linprog

    # Unknowns: the coefficients of the basis, and a lower bound of all components.
    rows = np.block([[basis, np.zeros((m, 1))], [-basis, np.ones((m, 1))]])
    limits = np.append(np.ones(m), np.zeros(m))
    found = linprog(np.append(np.zeros(k), -1.0), rows, limits, bounds=(None, None))
    return float((basis @ found.x[:k]).min()) if found.status == 0 else 0.0


def endeffector_stiffness(robot: Manipulator, q, K_P, c=None) -> np.ndarray:
    """Stiffness (..., 2, 2) in N/m of PD drives at rest: K_x = A^T K_P A - sum_i c_i d2 q_i / dx2 + d2 V / dx2.

    The force that a displaced end-effector feels is -K_x dx.  The second term comes from the torques c (..., N) in N m
    that are there at rest, such as a prestress along the null vector: it stiffens in one sign and softens in the other.
    The last one is that of gravity, with the potential energy V; a machine in a horizontal plane has none.
    K_P : number, (N,) or (N, N), N m/rad.  c : default none.
    Raises ValueError for open loops, and where an arm is stretched or folded.

    >>> import rapkm_lite as rk; robot = rk.load(); q = rk.inverse_kinematics(robot, [0.0, 0.0])
    >>> rk.endeffector_stiffness(robot, q, 7.05).round(1) + 0.0
    array([[297.4,   0. ],
           [  0. , 297.4]])
    """
    pose = at(robot, q)
    A, N = pose.A, robot.n_arms
    gain, c = positive_definite("K_P", K_P, N), None if c is None else real_array("c", c, N)
    check_leading(q=A.shape[:-2], K_P=gain.shape[:-2], c=() if c is None else c.shape[:-1])
    K = A.mT @ gain @ A
    if c is not None:
        K = K - np.einsum("...i,...ikl->...kl", c, base_angle_hessians(pose))
    return K + _weight_hessian(pose) if robot.gravity.any() else K


def _weight_hessian(pose: At) -> np.ndarray:
    """d2 V / dx2 of the potential energy, (..., 2, 2) in N/m.

    As d = x - base - a, only the proximal links a matter: d2 a_i / dx2 = (E a_i) d2 q_i / dx2 - a_i A_i^T A_i with the
    quarter turn E.
    """
    gx, gy = pose.robot.gravity
    moment = (pose.robot.arm_moments / pose.robot.lengths) @ [1.0, -1.0]
    along, across = moment * (pose.a @ [gx, gy]), moment * (pose.a @ [gy, -gx])
    bent = np.einsum("...i,...ikl->...kl", across, base_angle_hessians(pose))
    return pose.A.mT @ (along[..., None] * pose.A) - bent


def base_angle_hessians(pose: At) -> np.ndarray:
    """d2 q_i / dx2 of the base angles, (..., N, 2, 2) in rad/m^2: how the rows of A change along x and along y."""
    F_dot = at(pose.robot, pose.q[..., None, :], pose.F.mT).F_dot  # moving along x, and along y
    return np.moveaxis(F_dot[..., : pose.robot.n_arms, :], -3, -1)
