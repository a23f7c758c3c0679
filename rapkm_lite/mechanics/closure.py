"""Configurations from rough or over-determined angles: closing the loops, the pose of measured base angles."""

from __future__ import annotations

import numpy as np

from ..machine.arguments import ConvergenceError, check_leading, matvec, real_array, small_number, whole_number
from ..machine.manipulator import Manipulator, manipulator
from . import cores
from .at import At, at
from .kinematics import loop_constraints
from .linalg import by_minors, least_singular_value
from .redundancy import base_angle_hessians


def close_loops(robot: Manipulator, q, tolerance: float = 1e-13, iterations: int = 100) -> np.ndarray:
    """The configuration in the c-space V of (3), h(q) = 0, nearest to a rough q, (..., 2N) in rad.

    Minimizes ||q' - q||^2 / 2 subject to h(q') = 0 by sequential quadratic programming with the exact Hessian of the
    Lagrangian, I + sum_k lambda_k Hess h_k, where that is positive definite on the tangent space of V.  The minimum is
    a local one: from a q more than half a radian off, another configuration may be nearer.

    tolerance : largest closure error relative to the longest link, and largest tangential remainder in rad; where the
        base is so far from the origin that its coordinates are rounded more coarsely, that rounding.
    iterations : the most steps.
    Raises ConvergenceError with the residual and the pose where it takes more steps or meets a c-space singularity.

    >>> import rapkm_lite as rk; robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> bool(abs(rk.loop_constraints(robot, rk.close_loops(robot, q + 0.01))).max() < 1e-13)
    True
    """
    q0 = real_array("q", q, manipulator(robot).n_joints)
    q, n, r = q0.copy(), robot.n_joints, robot.n_constraints
    scale, tolerance = robot.lengths.max(), small_number("tolerance", tolerance)
    gap = max(tolerance * scale, 4.0 * np.spacing(np.abs(robot.base).max()))
    for _ in range(whole_number("iterations", iterations, 1, 10_000)):
        pose, h = at(robot, q), loop_constraints(robot, q)
        Q, R = np.linalg.qr(pose.J.mT, mode="complete")
        if least_singular_value(R[..., :r, :])[0] < 1e-10 * scale:
            break
        range_, tangent = Q[..., :r], Q[..., r:]
        back = -matvec(range_, np.linalg.solve(R[..., :r, :].mT, h[..., None])[..., 0])
        gradient = q - q0
        multiplier = -np.linalg.solve(R[..., :r, :], matvec(range_.mT, gradient)[..., None])[..., 0]
        hessian = np.eye(n) + _constraint_curvature(pose, multiplier)
        convex = np.linalg.eigvalsh(tangent.mT @ hessian @ tangent)[..., 0] > 0.1
        hessian = np.where(convex[..., None, None], hessian, np.eye(n))
        remainder = matvec(tangent.mT, gradient)
        rhs = remainder + matvec(tangent.mT, matvec(hessian, back))
        if np.abs(h).max(initial=0.0) < gap and np.abs(remainder).max(initial=0.0) < tolerance:
            return q
        step = back - matvec(tangent, np.linalg.solve(tangent.mT @ hessian @ tangent, rhs[..., None])[..., 0])
        size = np.linalg.norm(step, axis=-1, keepdims=True)
        q = q + step * np.minimum(1.0, 0.5 / np.maximum(size, 1e-300))
    gaps = np.abs(loop_constraints(robot, q)).max(axis=-1)
    worst = np.unravel_index(np.argmax(gaps), gaps.shape)
    raise ConvergenceError(
        f"close_loops found no configuration near q = {q0[worst].round(6).tolist()}: the closure error is "
        f"{gaps[worst]:.3g} m at {q[worst].round(6).tolist()}, tolerance = {tolerance:g} of the longest link; allowed: "
        "a q near a regular configuration of this machine"
    )


def _constraint_curvature(pose: At, multiplier: np.ndarray) -> np.ndarray:
    """sum_k lambda_k d2 h_k / dq2, (..., 2N, 2N)."""
    N = pose.robot.n_arms
    force = multiplier.reshape(*multiplier.shape[:-1], N - 1, 2)
    force = np.insert(force, 1, -force.sum(axis=-2), axis=-2)
    base, link = -(force * (pose.a + pose.d)).sum(axis=-1), -(force * pose.d).sum(axis=-1)
    H = np.zeros((*pose.q.shape[:-1], 2 * N, 2 * N))
    i = np.arange(N)
    H[..., i, i] = base
    H[..., i, N + i] = H[..., N + i, i] = H[..., N + i, N + i] = link
    return H


def _pose_step(pose: At, residual: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Newton's step in x, (..., 2) in m, to the least squares; that of A^+ where the Hessian is not well positive.
    And how far, (...,) in m/rad, the rounding of the angles moves it.

    Where the residuals are large, A^+ alone makes steps that shrink slowly, or not at all.  A^T A and the Hessian
    square the singular values of A: whether they are regular is asked of A, and nothing is solved with their rounding.
    Raises ValueError at input singularities.
    """
    A = pose.A
    square = A.mT @ A
    hessian = square - np.einsum("...i,...ikl->...kl", residual, base_angle_hessians(pose))
    over, whole = by_minors(A)
    det, size = np.linalg.det(hessian), np.trace(square, axis1=-2, axis2=-1) ** 2
    if not np.all((whole := np.reshape(whole, size.shape)) > 1e-24 * size):
        raise ValueError("A has lost rank (an input singularity); allowed: another pose")
    regular = (hessian[..., 0, 0] > 0.0) & (det > 1e-3 * whole) & (det > 1e-14 * size)
    hessian = np.where(regular[..., None, None], hessian, np.eye(2))
    newton, gauss = np.linalg.solve(hessian, A.mT), over.mT / whole[..., None, None]
    back = np.where(regular[..., None, None], newton, gauss)
    return matvec(back, residual), np.abs(back).sum(axis=-1).max(axis=-1)


def misfit(robot: Manipulator, q_a: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """q at x, the residuals of the base angles q_a there, and the sum of their squares, infinite out of reach."""
    q, _ = cores.joint_angles(robot, x, robot.mode)
    residual = cores.wrap(q_a - q[..., : robot.n_arms])
    # Where an arm is as good as stretched or folded, A has no bounds; a cosine would say so 1e-6 rad away.
    out = (np.abs(np.sin(q[..., robot.n_arms :])) < 2e-12).any(axis=-1)
    return q, residual, np.where(out, np.inf, np.vecdot(residual, residual))


def on_the_turn_of(q_a: np.ndarray, q: np.ndarray) -> np.ndarray:
    """q (..., 2N) with whole turns added to its base angles, so that they lie within half a turn of q_a (..., N)."""
    N = q_a.shape[-1]
    return q + 2 * np.pi * np.rint(np.concatenate([q_a - q[..., :N], 0.0 * q[..., N:]], axis=-1) / (2 * np.pi))


def estimate_pose(robot: Manipulator, q_a, guess, tolerance: float = 1e-13, iterations: int = 100) -> np.ndarray:
    """The configuration whose base angles are nearest to the measured ones, (..., 2N) in rad.

    N measured angles over-determine the two coordinates of the pose, and calibration offsets make them contradict each
    other.  The pose taken is the least-squares one, min_x sum_i (q_i(x) - q_a,i)^2, found by Newton steps from the
    end-effector position `guess` (..., 2) in m, by Gauss-Newton steps with the control matrix A = d q_a / d x where the
    exact Hessian is not positive definite; its working mode is ``robot.mode``.  For N = 2 this is the forward
    kinematics of the five-bar.  The minimum is that near the guess; near an input singularity another one may be close.
    Its base angles are on the turn of the measured ones, the elbow angles in (-pi, pi].
    tolerance : largest last step relative to the longest link.  iterations : the most steps.
    Raises ConvergenceError with the residuals and the pose, also where the search ends at the rim of the workspace, and
    ValueError where it meets an input singularity.

    >>> import rapkm_lite as rk; robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> rk.forward_kinematics(robot, rk.estimate_pose(robot, q[:3], guess=[0.0, 0.0])).round(12)
    array([0.02, 0.05])
    """
    q_a, guess = real_array("q_a", q_a, manipulator(robot).n_arms), real_array("guess", guess, 2)
    lead = check_leading(q_a=q_a.shape[:-1], guess=guess.shape[:-1])
    q_a, x = np.broadcast_to(q_a, (*lead, robot.n_arms)), np.broadcast_to(guess, (*lead, 2))
    size, limit = np.full((*lead, 1), np.inf), small_number("tolerance", tolerance) * robot.lengths.max()
    # The rounding of x far from the origin.
    limit += 8.0 * np.spacing(np.abs(robot.base).max() + robot.lengths.max())
    q, residual, square = misfit(robot, q_a, x)
    for _ in range(whole_number("iterations", iterations, 1, 10_000)):
        if np.isinf(square).any():
            break
        step, lever = _pose_step(at(robot, q), residual)
        size = np.abs(step).max(axis=-1, keepdims=True)
        # Near an input singularity the rounding of angles moves x further, also of those that fit.
        rounding = 1e-15 * (1.0 + np.abs(q_a).max(axis=-1))
        uncertain = np.where(np.abs(residual).max(axis=-1) < 4.0 * rounding, np.inf, rounding * lever)
        if np.all(size[..., 0] < limit + np.minimum(uncertain, 1e3 * limit)):
            return on_the_turn_of(q_a, q)
        # A tenth of the longest proximal link at most, and halved where it leaves the workspace or the residuals grow.
        step = step * np.minimum(1.0, 0.1 * robot.lengths[:, 0].max() / np.maximum(size, 1e-300))
        for k in range(40):
            trial = misfit(robot, q_a, x + step)
            worse = trial[2] > square + 1e-14
            if not worse.any():
                break
            step = np.where(worse[..., None], step / 2 if k < 38 else 0.0, step)
        x, (q, residual, square) = x + step, trial
    # Before the first step all sizes are infinite.
    worst = np.unravel_index(np.argmax(np.where(np.isinf(square), np.inf, np.minimum(size[..., 0], 1e300))), lead)
    rim = np.abs(np.sin(q[worst][robot.n_arms :])).min() < 1e-3
    where = "outside" if np.isinf(square[worst]) else "at the rim of" if rim else "inside"
    raise ConvergenceError(
        f"estimate_pose found no pose for q_a = {q_a[worst].round(6).tolist()} in working mode {robot.mode.tolist()}: "
        f"at x = {x[worst].round(6).tolist()}, {where} the workspace, the residuals are "
        f"{residual[worst].round(6).tolist()} rad; allowed: angles near a closed pose, and a guess near it"
    )
