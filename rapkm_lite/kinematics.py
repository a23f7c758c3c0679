"""Loop constraints, Jacobians, inverse and forward kinematics, working modes: eqs. (1) and (3).

Joint vector q = (base angles of arms 1..N, elbow angles of arms 1..N), rad; elbow angles are relative.
Every function takes one pose or any leading axes; the last axis is the component.
"""

from __future__ import annotations

import itertools

import numpy as np

from ._arguments import (
    ConvergenceError,
    check_leading,
    joint_vectors,
    matvec,
    positive_number,
    real_array,
    solve,
    transpose,
    whole_number,
)
from .manipulator import Manipulator


def turn(v: np.ndarray) -> np.ndarray:
    """Quarter turn E v, counter-clockwise, of planar vectors (..., 2)."""
    return np.stack([-v[..., 1], v[..., 0]], axis=-1)


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Planar cross product a x b of vectors (..., 2)."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def unit_vector(angle: np.ndarray) -> np.ndarray:
    """(cos, sin) of an angle in rad, on a new last axis."""
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def arm_vectors(robot: Manipulator, q) -> tuple[np.ndarray, np.ndarray]:
    """Proximal vectors a_i and distal vectors d_i of all arms, each (..., N, 2) in m."""
    q = real_array("q", q, robot.n_joints)
    base, elbow = q[..., : robot.n_arms], q[..., robot.n_arms :]
    l1, l2 = robot.lengths.T
    return l1[:, None] * unit_vector(base), l2[:, None] * unit_vector(base + elbow)


def tips(robot: Manipulator, q) -> np.ndarray:
    """Tips of the N arms of the cut tree, (..., N, 2) in m."""
    a, d = arm_vectors(robot, q)
    return robot.base + a + d


def forward_kinematics(robot: Manipulator, q) -> np.ndarray:
    """End-effector position (..., 2) in m: the tip of arm 2, from which all others are cut.

    On the configuration space V all tips agree; `close_loops` brings a rough q there.
    """
    return tips(robot, q)[..., 1, :]


def loop_constraints(robot: Manipulator, q) -> np.ndarray:
    """h(q) of (1), (..., 2(N-1)) in m: (tip_1 - tip_2, tip_3 - tip_2, ..., tip_N - tip_2).

    >>> from rapkm_lite import load, inverse_kinematics
    >>> robot = load()
    >>> bool(np.abs(loop_constraints(robot, inverse_kinematics(robot, [0.02, 0.05]))).max() < 1e-15)
    True
    """
    p = tips(robot, q)
    h = np.delete(p, 1, axis=-2) - p[..., 1:2, :]
    return h.reshape(*h.shape[:-2], robot.n_constraints)


def tip_jacobians(robot: Manipulator, q) -> np.ndarray:
    """d tip_i / d (base angle i, elbow angle i), (..., N, 2, 2) in m/rad."""
    a, d = arm_vectors(robot, q)
    return np.stack([turn(a + d), turn(d)], axis=-1)


def _cut(robot: Manipulator, blocks: np.ndarray) -> np.ndarray:
    """Rows tip_i - tip_2 of the constraint Jacobian from the blocks of the single arms."""
    N = robot.n_arms
    J = np.zeros((*blocks.shape[:-3], N - 1, 2, 2 * N))
    for row, arm in enumerate(i for i in range(N) if i != 1):
        J[..., row, :, [arm, N + arm]] += np.moveaxis(blocks[..., arm, :, :], -1, 0)
        J[..., row, :, [1, N + 1]] -= np.moveaxis(blocks[..., 1, :, :], -1, 0)
    return J.reshape(*J.shape[:-3], 2 * (N - 1), 2 * N)


def constraint_jacobian(robot: Manipulator, q) -> np.ndarray:
    """J(q) of (3), dh/dt = J qd, (..., 2(N-1), 2N) in m/rad."""
    return _cut(robot, tip_jacobians(robot, q))


def constraint_jacobian_dot(robot: Manipulator, q, qd) -> np.ndarray:
    """dJ/dt along qd, (..., 2(N-1), 2N) in m/(rad s), so that d2h/dt2 = J qdd + Jdot qd."""
    q, qd = joint_vectors(robot.n_joints, q=q, qd=qd)
    a, d = arm_vectors(robot, q)
    base_rate = qd[..., : robot.n_arms, None]
    link_rate = base_rate + qd[..., robot.n_arms :, None]
    return _cut(robot, -np.stack([base_rate * a + link_rate * d, link_rate * d], axis=-1))


def reachable(robot: Manipulator, x) -> np.ndarray:
    """True where all N arms reach the point x, (...,); x is (..., 2) in m."""
    x = real_array("x", x, 2)
    reach = np.linalg.norm(x[..., None, :] - robot.base, axis=-1)
    l1, l2 = robot.lengths.T
    return np.all((reach <= l1 + l2) & (reach >= np.abs(l1 - l2)), axis=-1)


def working_modes(robot: Manipulator) -> np.ndarray:
    """All 2^N working modes, (2^N, N), entries +1 or -1, the all-positive one first."""
    return np.array(list(itertools.product([1, -1], repeat=robot.n_arms)))


def working_mode(robot: Manipulator, q) -> np.ndarray:
    """s_i = sign(sin(elbow angle i)), (..., N); 0 where an arm is stretched or folded."""
    q = real_array("q", q, robot.n_joints)
    sine = np.sin(q[..., robot.n_arms :])
    return np.where(np.abs(sine) < 1e-12, 0, np.sign(sine)).astype(int)


def inverse_kinematics(robot: Manipulator, x, mode=None) -> np.ndarray:
    """Joint angles (..., 2N) in rad, in (-pi, pi], of the end-effector position x (..., 2) in m.

    mode : (..., N) signs of the elbow angles; default ``robot.mode``.
    Raises ValueError naming the point, the arm and its reach when the point lies outside the workspace.

    >>> from rapkm_lite import load
    >>> inverse_kinematics(load(), [0.0, 0.0]).round(4)
    array([-0.4317,  1.6627, -2.5261,  1.9106,  1.9106,  1.9106])
    """
    x = real_array("x", x, 2)
    mode = robot.mode if mode is None else real_array("mode", mode, robot.n_arms)
    if not np.all(np.abs(mode) == 1.0):
        raise ValueError(f"mode = {mode}; allowed: +1 or -1 for each of the {robot.n_arms} arms")
    check_leading(x=x.shape[:-1], mode=mode.shape[:-1])
    l1, l2 = robot.lengths.T
    D = x[..., None, :] - robot.base
    reach = np.linalg.norm(D, axis=-1)
    cosine = (reach**2 - l1**2 - l2**2) / (2 * l1 * l2)
    outside = np.abs(cosine) > 1.0 + 1e-12
    if np.any(outside):
        *where, arm = np.argwhere(outside)[0]
        at = f"x[{', '.join(map(str, where))}]" if where else "x"
        point, low, high = x[tuple(where)], abs(l1[arm] - l2[arm]), l1[arm] + l2[arm]
        raise ValueError(
            f"{at} = ({point[0]:.6g}, {point[1]:.6g}) m lies outside the workspace: it is {reach[(*where, arm)]:.6g} m "
            f"from base point {arm + 1}; allowed: {low:g} to {high:g} m"
        )
    elbow = mode * np.arccos(np.clip(cosine, -1.0, 1.0))
    base = np.arctan2(D[..., 1], D[..., 0]) - np.arctan2(l2 * np.sin(elbow), l1 + l2 * np.cos(elbow))
    return np.concatenate([wrap(base), elbow], axis=-1)


def wrap(angle: np.ndarray) -> np.ndarray:
    """The same angle in (-pi, pi], rad."""
    return np.pi - np.mod(np.pi - angle, 2 * np.pi)


def ee_complement(robot: Manipulator, q) -> np.ndarray:
    """F for the end-effector position as independent coordinates: qd = F xd, (..., 2N, 2) in rad/m.

    Regular everywhere inside the workspace, in every working mode.
    Raises ValueError where an arm is stretched or folded (boundary of the workspace).
    """
    a, d = arm_vectors(robot, q)
    den = _driving_lever(robot, a, d)
    base = d / den
    link = -a / den
    return np.concatenate([base, link - base], axis=-2)


def ee_complement_dot(robot: Manipulator, q, qd) -> np.ndarray:
    """dF/dt of `ee_complement` along qd, (..., 2N, 2) in rad/(m s)."""
    q, qd = joint_vectors(robot.n_joints, q=q, qd=qd)
    a, d = arm_vectors(robot, q)
    den = _driving_lever(robot, a, d)
    base_rate = qd[..., : robot.n_arms, None]
    link_rate = base_rate + qd[..., robot.n_arms :, None]
    a_dot, d_dot = base_rate * turn(a), link_rate * turn(d)
    den_dot = (cross(a_dot, d) + cross(a, d_dot))[..., None]
    base = d_dot / den - d * den_dot / den**2
    link = -a_dot / den + a * den_dot / den**2
    return np.concatenate([base, link - base], axis=-2)


def _driving_lever(robot: Manipulator, a: np.ndarray, d: np.ndarray) -> np.ndarray:
    """a_i x d_i = l1 l2 sin(elbow angle), (..., N, 1); zero at the boundary of the workspace."""
    den = cross(a, d)[..., None]
    small = np.abs(den[..., 0]) < 1e-12 * robot.lengths.prod(axis=1)
    if np.any(small):
        arm = np.argwhere(small)[0][-1]
        raise ValueError(
            f"q puts arm {arm + 1} on the boundary of the workspace (sin(elbow angle) < 1e-12), where the end-effector "
            "position is no coordinate; allowed: poses inside, or independent joints instead of the end-effector"
        )
    return den


def close_loops(robot: Manipulator, q, tolerance: float = 1e-13, iterations: int = 100) -> np.ndarray:
    """The configuration in V nearest to a rough q, (..., 2N) in rad.

    Minimizes ||q' - q||^2 / 2 subject to h(q') = 0 by sequential quadratic programming with the exact Hessian of the
    Lagrangian, I + sum_k lambda_k Hess h_k, where that is positive definite on the tangent space of V.  The minimum is
    a local one: from a q more than half a radian off, another configuration may be nearer.

    tolerance : largest closure error relative to the link length, and largest tangential remainder in rad.
    Raises ConvergenceError with the residual and the pose.
    """
    q0 = real_array("q", q, robot.n_joints)
    q, n, r = q0.copy(), robot.n_joints, robot.n_constraints
    scale, tolerance = robot.lengths.max(), positive_number("tolerance", tolerance)
    for _ in range(whole_number("iterations", iterations, 1)):
        h, J = loop_constraints(robot, q), constraint_jacobian(robot, q)
        Q, R = np.linalg.qr(transpose(J), mode="complete")
        if np.any(np.abs(np.diagonal(R, axis1=-2, axis2=-1)).min(axis=-1) < 1e-10 * scale):
            break
        range_, tangent = Q[..., :r], Q[..., r:]
        back = -matvec(range_, np.linalg.solve(transpose(R[..., :r, :]), h[..., None])[..., 0])
        gradient = q - q0
        multiplier = -np.linalg.solve(R[..., :r, :], matvec(transpose(range_), gradient)[..., None])[..., 0]
        hessian = np.eye(n) + _constraint_curvature(robot, q, multiplier)
        reduced = transpose(tangent) @ hessian @ tangent
        convex = np.linalg.eigvalsh(reduced)[..., 0] > 0.1
        reduced = np.where(convex[..., None, None], reduced, np.eye(2))
        remainder = matvec(transpose(tangent), gradient)
        rhs = remainder + np.where(convex[..., None], matvec(transpose(tangent), matvec(hessian, back)), 0.0)
        if max(np.abs(h).max(initial=0.0) / scale, np.abs(remainder).max(initial=0.0)) < tolerance:
            return q
        step = back - matvec(tangent, np.linalg.solve(reduced, rhs[..., None])[..., 0])
        size = np.linalg.norm(step, axis=-1, keepdims=True)
        q = q + step * np.minimum(1.0, 0.5 / np.maximum(size, 1e-300))
    worst = np.unravel_index(np.argmax(np.abs(loop_constraints(robot, q)).max(axis=-1)), q.shape[:-1])
    h = np.abs(loop_constraints(robot, q[worst])).max()
    raise ConvergenceError(
        f"close_loops found no configuration near q = {q0[worst].round(6).tolist()}: the closure error is {h:.3g} m at "
        f"{q[worst].round(6).tolist()}; allowed: a q near a regular configuration of this machine"
    )


def _constraint_curvature(robot: Manipulator, q: np.ndarray, multiplier: np.ndarray) -> np.ndarray:
    """sum_k lambda_k d2 h_k / dq2, (..., 2N, 2N)."""
    a, d = arm_vectors(robot, q)
    N = robot.n_arms
    force = multiplier.reshape(*multiplier.shape[:-1], N - 1, 2)
    force = np.insert(force, 1, -force.sum(axis=-2), axis=-2)
    base, link = -(force * (a + d)).sum(axis=-1), -(force * d).sum(axis=-1)
    H = np.zeros((*q.shape[:-1], 2 * N, 2 * N))
    i = np.arange(N)
    H[..., i, i] = base
    H[..., i, N + i] = H[..., N + i, i] = H[..., N + i, N + i] = link
    return H


def estimate_pose(robot: Manipulator, q_a, guess, tolerance: float = 1e-13, iterations: int = 50) -> np.ndarray:
    """The configuration whose base angles are nearest to the measured ones, (..., 2N) in rad.

    N measured angles over-determine the two coordinates of the pose, and calibration offsets make them contradict each
    other.  The pose taken is the least-squares one, min_x sum_i (q_i(x) - q_a,i)^2, found by Gauss-Newton steps with
    the control matrix A = d q_a / d x from the end-effector position `guess` (..., 2) in m; its working mode is
    ``robot.mode``.  For N = 2 this is the forward kinematics of the five-bar.
    Raises ConvergenceError with the residual and the pose, also where the iteration leaves the workspace.
    """
    q_a, guess = real_array("q_a", q_a, robot.n_arms), real_array("guess", guess, 2)
    lead = check_leading(q_a=q_a.shape[:-1], guess=guess.shape[:-1])
    q_a, x = np.broadcast_to(q_a, (*lead, robot.n_arms)), np.broadcast_to(guess, (*lead, 2))
    step, limit = np.full(x.shape, np.inf), positive_number("tolerance", tolerance) * robot.lengths.max()
    for _ in range(whole_number("iterations", iterations, 1)):
        if not np.all(reachable(robot, x)):
            break
        q = inverse_kinematics(robot, x)
        A = ee_complement(robot, q)[..., : robot.n_arms, :]
        residual = wrap(q_a - q[..., : robot.n_arms])
        gradient = matvec(transpose(A), residual)
        step = solve("A^T A (an input singularity)", transpose(A) @ A, gradient[..., None])[..., 0]
        if np.abs(step).max(initial=0.0) < limit:
            return q
        x = x + step
    bad = np.where(reachable(robot, x), np.abs(step).max(axis=-1), np.inf)
    worst = np.unravel_index(np.argmax(bad), lead)
    where = "inside" if reachable(robot, x[worst]) else "outside"
    raise ConvergenceError(
        f"estimate_pose found no pose for q_a = {q_a[worst].round(6).tolist()} in working mode {robot.mode.tolist()}: "
        f"a step of {np.abs(step[worst]).max():.3g} m led to x = {x[worst].round(6).tolist()} {where} the workspace; "
        "allowed: angles near a closed pose, and a guess near it"
    )
