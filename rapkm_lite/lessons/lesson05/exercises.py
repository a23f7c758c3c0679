"""Exercises of lesson 05: feedback map of CTC, explicit pseudoinverse (27), gain of the driven joints."""

from __future__ import annotations

import numpy as np

from ...control.stability import effective_gain
from ...machine.manipulator import load
from ...mechanics.actuation import control_matrix, drive_pairs, redundant_control_matrix, weighted_pseudoinverse
from ...mechanics.dynamics import forward_dynamics, minimal_dynamics, nullspace_projector, orthogonal_complement
from ...mechanics.kinematics import inverse_kinematics
from ...mechanics.partition import explicit_pseudoinverse, select_independent
from ..checker import Exercise


def _poses(rng, count: int) -> tuple:
    robot = load().replace(friction=0.0)
    return robot, inverse_kinematics(robot, rng.uniform(-0.08, 0.08, (count, 2)))


def feedback_map(robot, q, pair) -> np.ndarray:
    """A (A^T A)^-1 Gbar (m, 2): torques per feedback acceleration of the angles of `pair`, in N m per rad/s^2."""
    Gbar, _, _ = minimal_dynamics(robot, q, np.zeros(robot.n_joints), pair)
    return weighted_pseudoinverse(control_matrix(robot, q, pair)) @ Gbar


def _pairs_at_poses(rng) -> list[tuple]:
    robot, poses = _poses(rng, 6)
    return [(robot, q, pair) for q, pair in zip(poses, 2 * drive_pairs(robot), strict=True)]


def _acceleration(Phi, robot, q, pair) -> tuple[float, str]:
    """Equation (2) with multipliers, from rest: the torques Phi v must accelerate the pair by v."""
    still = np.zeros(robot.n_joints)
    worst = max(np.abs(forward_dynamics(robot, q, still, Phi @ v)[0][list(pair)] - v).max() for v in np.eye(2))
    return worst, "the multiplier form (2) answers 1 rad/s^2 of wanted acceleration with an error in rad/s^2 of"


def _partitions(rng) -> list[tuple]:
    robot, poses = _poses(rng, 8)
    A = redundant_control_matrix(robot, poses)
    return list(zip(A, select_independent(A), strict=True))


def _penrose(X, A_tilde, rows) -> tuple[float, str]:
    """The four conditions of Penrose, which hold for one matrix only."""
    M = A_tilde.T
    defects = (M @ X @ M - M, X @ M @ X - X, (M @ X).T - M @ X, (X @ M).T - X @ M)
    return max(np.abs(d).max() for d in defects), "the four Penrose conditions are violated by"


def gain_for_bandwidth(robot, q, omega: float) -> float:
    """Gain K_P (1/s^2) of the driven joints alone whose slowest direction at the poses q (k, 2N) reaches omega^2."""
    driven = np.diag(np.repeat([1.0, 0.0], robot.n_arms))
    share = np.linalg.eigvals(effective_gain(orthogonal_complement(robot, q), driven)).real
    return omega**2 / share.min()


def _bandwidths(rng) -> list[tuple]:
    robot, poses = _poses(rng, 24)
    speeds = rng.uniform(5.0, 40.0, 4)
    return [(robot, q, omega) for q, omega in zip(poses.reshape(4, 6, -1), speeds, strict=True)]


def _slowest(K, robot, q, omega) -> tuple[float, str]:
    """N_J I_a N_J has the eigenvalues of the effective gain and four zeros, without any choice of q2."""
    N_J = nullspace_projector(robot, q)
    slow = float(K) * np.linalg.eigvalsh(N_J[..., : robot.n_arms] @ N_J[..., : robot.n_arms, :])[..., -2].min()
    return abs(slow - omega**2), "the slowest direction along these poses misses omega^2, in 1/s^2, by"


EXERCISES = {
    "05.feedback_map": Exercise(
        feedback_map,
        "accelerations need forces by Gbar, forces need torques by (A^T)^+, both in the angles of the pair",
        "N m per rad/s^2",
        _pairs_at_poses,
        _acceleration,
    ),
    "05.explicit_pseudoinverse": Exercise(
        explicit_pseudoinverse,
        "with B = (A~_1^T)^+ A~_2^T first the bottom block, (I + B^T B)^-1 B^T (A~_1^T)^+; the top one is "
        "(A~_1^T)^+ minus B times it; then put the rows into the order of the drives",
        "(without unit)",
        _partitions,
        _penrose,
    ),
    "05.gain_for_bandwidth": Exercise(
        gain_for_bandwidth,
        "take effective_gain of the matrix that selects the driven joints at every pose, and its smallest eigenvalue",
        "1/s^2",
        _bandwidths,
        _slowest,
        tolerance=1e-6,
    ),
}
