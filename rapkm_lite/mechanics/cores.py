"""Formulas that serve poses and others, such as `matrices` of any mechanism, on arrays that were checked before.

Leading axes are free.  Link vectors are flat, v (..., 4N) in m, as `machine.tree` says, where the constant tables are.
"""

from __future__ import annotations

import numpy as np

from ..machine.arguments import matvec
from ..machine.tree import Tree
from .linalg import by_minors, least_singular_value, linear, orthogonal, product, singular_values, solve, uneven

_INPUT_SINGULARITY = (
    "an input singularity, where the drives cannot produce every control force; allowed: poses with the full degree of "
    "actuation"
)
_UNEVEN = (
    "an input singularity, or gains or weights that differ too much; allowed: poses with the full degree of actuation, "
    "and gains or weights that differ less"
)


def wrap(angle: np.ndarray) -> np.ndarray:
    """The same angle in (-pi, pi], rad."""
    return np.pi - np.mod(np.pi - angle, 2 * np.pi)


def joint_angles(robot, x: np.ndarray, mode: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """q (..., 2N) of the end-effector at x, and the cosines of the elbow angles, beyond 1 where x is out of reach."""
    l1, l2 = robot.lengths.T
    # Along the poses in memory: NumPy's loops over the few arms of a pose would cost more than the arithmetic.
    dx, dy = (np.add.outer(-base, point.T).T for base, point in zip(robot.base.T, (x[..., 0], x[..., 1]), strict=True))
    reach = np.sqrt(dx * dx + dy * dy)
    # Factors, exact where an arm is nearly folded or stretched: a cosine has no digits left there.
    straight, bend = (l1 + l2 - reach) * (l1 + l2 + reach), (reach - (l1 - l2)) * (reach + (l1 - l2))
    lever = mode * np.sqrt(np.maximum(straight, 0.0)) * np.sqrt(np.maximum(bend, 0.0))
    along = reach * reach + (l1 - l2) * (l1 + l2)
    q = np.empty((*lever.shape[:-1], 2 * len(l1)))
    angles = np.arctan2(along * dy - lever * dx, along * dx + lever * dy), np.arctan2(2.0 * lever, bend - straight)
    return np.concatenate(angles, axis=-1, out=q), (bend - straight) / (4.0 * l1 * l2)


def link_vectors(tree: Tree, q: np.ndarray) -> np.ndarray:
    """v: a_i = l1 (cos, sin)(base angle), d_i = l2 (cos, sin)(base + elbow angle)."""
    angle = linear(q, tree.absolute)
    v = np.empty((*q.shape[:-1], 2 * tree.n))
    np.cos(angle, out=v[..., : tree.n])
    np.sin(angle, out=v[..., tree.n :])
    v *= tree.lengths
    return v


def closed(tree: Tree, v: np.ndarray) -> np.ndarray:
    """v, after a check that the tips meet, |h| <= 1e-3 times the longest link."""
    h, limit = linear(v, tree.gaps) + tree.gap, 1e-3 * tree.longest
    gap = max(map(abs, h.tolist())) if h.ndim == 1 else np.abs(h).max(initial=0.0)
    if gap > limit:
        words = f"allowed: {limit:.3g} m (1e-3 of the longest link) where rates or torques are asked for"
        raise ValueError(f"q leaves the loops open by {gap:.3g} m; {words}; close_loops(robot, q) closes them")
    return v


def check_tangent(tree: Tree, J: np.ndarray, qd: np.ndarray) -> None:
    """Raises ValueError where rates open the loops: |J qd| above 1e-2 of what the longest link could add to it.

    So wide, because rates that are differences of closed poses, or belong to a slightly wrong model, are useful, too.
    """
    speed = np.abs(matvec(J, qd)).max(axis=-1)
    # One rate may meet many poses.
    limit = np.broadcast_to(1e-2 * tree.longest * np.maximum(np.abs(qd).max(axis=-1), 1.0), speed.shape)
    if np.any(speed > limit):
        k = np.unravel_index(np.argmax(speed / limit), speed.shape)
        raise ValueError(
            f"qd opens the loops at {speed[k]:.3g} m/s; allowed: {limit[k]:.3g} m/s (1e-2 of the longest link times "
            "the largest rate or 1 rad/s) for motions; nullspace_projector(robot, q) @ qd keeps them closed"
        )


EDGE = 1e-12
"""|sin(elbow angle)| below which an arm counts as stretched or folded."""


def inner_levers(tree: Tree, q: np.ndarray) -> np.ndarray:
    """a_i x d_i = l1 l2 sin(elbow angle), once for each entry of v, (..., 4N); no arm may be stretched or folded.

    The difference of two products would lose the digits that the elbow angle has near the edge of the workspace.
    """
    bend = np.sin(q[..., tree.N :])
    small = np.abs(bend) < EDGE
    if small.any():
        arm = np.argwhere(small)[0][-1]
        raise ValueError(
            f"q puts arm {arm + 1} on the boundary of the workspace (sin(elbow angle) < 1e-12), where the end-effector "
            "position is no coordinate; allowed: poses inside, or independent joints instead of the end-effector"
        )
    return linear(bend * tree.most, tree.spread_arms)


def joint_complement(J: np.ndarray, independent, of_pose: bool = True) -> np.ndarray:
    """F of (5) for delta = n - r joints as q2: the identity in their rows, -J1^-1 J2 in the others, (..., n, delta)."""
    dependent, delta = _others(J.shape[-1], independent), len(independent)
    J1 = J[..., dependent]
    largest = np.linalg.svd(J, compute_uv=False)[..., 0]
    measure = np.linalg.svd(J1, compute_uv=False)[..., -1] / np.where(largest > 0.0, largest, 1.0)
    if not np.all(measure >= 1e-12):
        other = "other joints, or None for the end-effector position" if of_pose else "other joints"
        raise ValueError(
            f"independent = {tuple(independent)} is singular here: its measure sigma_min(J1)/sigma_max(J) is "
            f"{np.min(measure):.3g}, needed: >= 1e-12; choose {other}"
        )
    F = np.zeros((*J.shape[:-2], J.shape[-1], delta))
    F[..., independent, np.arange(delta)] = 1.0
    F[..., dependent, :] = -np.linalg.solve(J1, J[..., independent])
    return F


def joint_complement_dot(J, J_dot, F, independent) -> np.ndarray:
    """dF/dt of `joint_complement`: from J F = 0 the dependent rows are -J1^-1 Jdot F."""
    dependent = _others(J.shape[-1], independent)
    rows = -np.linalg.solve(J[..., dependent], J_dot @ F)
    F_dot = np.zeros((*rows.shape[:-2], J.shape[-1], rows.shape[-1]))
    F_dot[..., dependent, :] = rows
    return F_dot


def _others(n: int, indices) -> list[int]:
    return [j for j in range(n) if j not in indices]


def null_space(A: np.ndarray) -> np.ndarray:
    """Some orthonormal basis of the torques that move nothing, (..., m, m - delta) for A (..., m, delta)."""
    return np.linalg.qr(A, mode="complete")[0][..., A.shape[-1] :]


def row_space(J: np.ndarray, size: float, of_pose: bool = True) -> tuple[np.ndarray, np.ndarray]:
    """Q (..., n, n) and R of J^T = Q1 R: Q1 is its first r columns, the others span the tangent space of V.

    of_pose : the caller was given q, and not J.
    Raises ValueError where J, whose entries are of the order of `size`, lacks full rank.
    """
    Q, R = orthogonal(J.mT, complete=True)
    smallest = least_singular_value(R)[0] / size
    if smallest < 1e-12:
        start, place = ("q is a c-space singularity: ", "configurations") if of_pose else ("", "matrices")
        raise ValueError(
            f"{start}J has lost rank (relative sigma_min {smallest:.3g}); allowed: {place} with rank J = r = "
            f"{J.shape[-2]}"
        )
    return Q, R


def projector(Q: np.ndarray, R: np.ndarray) -> np.ndarray:
    """N_J = T T^T = I - Q1 Q1^T, from `row_space`, (..., n, n)."""
    T = Q[..., R.shape[-1] :]
    return product(T, T.mT)


def projector_dot(Q, R, J_dot, N) -> np.ndarray:
    """-(J^+ Jdot N_J) - (J^+ Jdot N_J)^T with J^+ = Q1 R^-T, (..., 2N, 2N)."""
    half = product(Q[..., : R.shape[-1]], solve(R.mT, product(J_dot, N)))
    return -half - half.mT


def minimal(F, F_dot, G, C, Q):
    """(7): Gbar = F^T G F, Cbar = F^T (C F + G Fdot), Qbar = F^T Q."""
    return product(F.mT, G, F), product(F.mT, product(C, F) + product(G, F_dot)), matvec(F.mT, Q)


def redundant(N, N_dot, G, C, Q):
    """(24): G~ = N_J G N_J, C~ = N_J (C N_J + G Ndot_J), Q~ = N_J Q."""
    return product(N, G, N), product(N, product(C, N) + product(G, N_dot)), matvec(N, Q)


def full_rank(name: str, A: np.ndarray, where: str = _INPUT_SINGULARITY) -> tuple[np.ndarray, np.ndarray]:
    """Q and R of A (..., m, k); raises ValueError where A has lost rank."""
    Q, R = orthogonal(A)
    _check_rank(name, R, where)
    return Q, R


def uneven_rank(name: str, A: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Q, R, no triangle, and orthonormal complement of Q, where gains or weights make rows differ by powers of ten."""
    Q, R, V = uneven(A)
    _check_rank(name, R, _UNEVEN)
    return Q[..., : R.shape[-1]], R if V is None else product(R, V.mT), Q[..., R.shape[-1] :]


def _check_rank(name: str, R: np.ndarray, where: str) -> None:
    if (measure := least_singular_value(R)[1]) < 1e-12:
        raise ValueError(f"{name} has lost rank (relative sigma_min {measure:.3g}): {where}")


def right_inverse(name: str, A: np.ndarray, where: str = _INPUT_SINGULARITY) -> np.ndarray:
    """(A^T)^+ = A (A^T A)^-1 = Q R^-T, (..., m, k), of a tall A with full rank."""
    Q, R = full_rank(name, A, where)
    return solve(R, Q.mT).mT


def prestress_shares(A: np.ndarray) -> np.ndarray:
    """Length of the rows of a null basis of A^T, (..., m) for A (..., m, 2); infinite at input singularities."""
    sigma = singular_values(A)
    return np.where(sigma[..., 1:] > 1e-12 * sigma[..., :1], np.linalg.norm(null_space(A), axis=-1), np.inf)


def redundant_right_inverse(T: np.ndarray, m: int) -> np.ndarray:
    """(A~^T)^+ = (T_a^T)^+ T^T, with T_a the m driven rows of T: A~^T = T T_a^T, (..., m, 2N)."""
    over, square = by_minors(T[..., :m, :])
    smallest = square.min(initial=np.inf) if isinstance(square, np.ndarray) else square
    if smallest < 1e-24:
        raise ValueError(f"A~ has lost rank (product of its singular values {smallest**0.5:.3g}): {_INPUT_SINGULARITY}")
    return product(over, T.mT) / square
