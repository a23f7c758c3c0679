"""Exercises of lesson 02: control matrix, guaranteed force, weighted torques, input singularities of mixed modes."""

from __future__ import annotations

import itertools

import numpy as np

from ...machine.manipulator import load
from ...mechanics.actuation import control_matrix, distal_cross_products, prestress_projector, weighted_pseudoinverse
from ...mechanics.kinematics import arm_vectors, cross, inverse_kinematics, reachable, turn, working_modes
from ..checker import Exercise


def _arms(rng) -> list[tuple[np.ndarray, np.ndarray]]:
    """Arm vectors of seeded poses of the testbed in all working modes."""
    robot = load()
    x = rng.uniform(-0.1, 0.1, (8, 2))
    return [arm_vectors(robot, inverse_kinematics(robot, p, s)) for p, s in zip(x, working_modes(robot), strict=True)]


def _control_matrix(a, d) -> np.ndarray:
    return d / cross(a, d)[:, None]


def _stretching(A, a, d) -> tuple[float, str]:
    """A rigid distal link: elbow (qd_i times a, a quarter turn on) and tip (xd) have the same velocity along d."""
    x_rate = np.array([0.6, -0.8])
    stretch = np.abs((d * (x_rate - turn(a) * (A @ x_rate)[:, None])).sum(axis=1)) / np.linalg.norm(d, axis=1)
    return stretch.max(), "moving the end-effector at 1 m/s stretches a distal link, in m/s, by"


def _control_matrices(rng) -> list[tuple[np.ndarray, float]]:
    robot = load()
    q = inverse_kinematics(robot, rng.uniform(-0.1, 0.1, (6, 2)))
    return [(A, c) for A, c in zip(control_matrix(robot, q), rng.uniform(0.05, 0.2, 6), strict=True)]


def guaranteed_force(A, torque: float) -> float:
    """Largest force (N) that torques |c_i| <= torque (N m) produce in every direction: the zonotope's inner radius.

    A : (m, 2) in rad/m.  The edge of the zonotope along row A_i has the distance sum_j |A_j x A_i| / |A_i| from zero.
    """
    A = np.asarray(A, dtype=float)
    return torque * min(np.abs(cross(A, row)).sum() / np.linalg.norm(row) for row in A)


def _overpromise(force, A, torque: float) -> tuple[float, str]:
    angle = np.linspace(0.0, np.pi, 4001)
    reach = torque * np.abs(A @ np.stack([np.cos(angle), np.sin(angle)])).sum(axis=0)
    return max(0.0, float(force) - reach.min()), "in one direction the drives fall short of this force, in N, by"


def best_torques(A, f, W, c0) -> np.ndarray:
    """Torques (m,) in N m of (11): A^T c = f, and of all those the nearest to c0 in the weights W (m, m)."""
    return weighted_pseudoinverse(A, W) @ f + prestress_projector(A, W) @ c0


def _choices(rng) -> list[tuple]:
    """Control matrices of three and four arms with a force, weights (diagonal, then full) and a wish for prestress."""
    cases = []
    for k in range(8):
        robot = load(("testbed", "four_arms")[k % 2])
        A = control_matrix(robot, inverse_kinematics(robot, rng.uniform(-0.06, 0.06, 2)))
        m = len(A)
        L = np.diag(rng.uniform(0.5, 3.0, m)) + (k > 3) * 0.3 * rng.standard_normal((m, m))
        cases.append((A, rng.uniform(-1.0, 1.0, 2), L @ L.T, rng.uniform(-0.1, 0.1, m)))
    return cases


def _not_the_best(c, A, f, W, c0) -> tuple[float, str]:
    """The force missed, and the slope of the price along the torques that move nothing."""
    free = np.linalg.svd(A.T)[2][2:]
    slope = np.linalg.norm(free @ W @ (c - c0)) / np.linalg.norm(W)
    return max(float(slope), float(np.linalg.norm(A.T @ c - f) / np.linalg.norm(A))), (
        "force missed, or slope of the price along a torque that moves nothing, as a torque in N m"
    )


def input_singularity(mode) -> np.ndarray:
    """Input singularity (2,) in m of the testbed in a mixed mode (3,): midway between the bases of the equal arms."""
    equal = next(pair for pair in itertools.combinations(range(3), 2) if mode[pair[0]] == mode[pair[1]])
    return load().base[list(equal)].mean(axis=0)


def _mixed_modes(rng) -> list[tuple[np.ndarray]]:
    return [(mode,) for mode in working_modes(load()) if abs(mode.sum()) == 1]


def _spread(x, mode) -> tuple[float, str]:
    robot = load()
    if not reachable(robot, x):
        return np.inf, "the point lies outside the workspace"
    crossed = distal_cross_products(robot, inverse_kinematics(robot, x, mode))
    return 0.2 * np.abs(crossed).max(), "over their length of 0.2 m the distal links miss being parallel, in m, by"


EXERCISES = {
    "02.control_matrix": Exercise(
        reference=_control_matrix,
        cases=_arms,
        invariant=_stretching,
        unit="rad/m",
        tolerance=1e-10,
        hint="the tip velocity xd and the elbow velocity, qd_i times a_i turned by a quarter turn, have the same "
        "component along d_i; for the elbow it is qd_i times the cross product a_i x d_i; solve for qd_i",
    ),
    "02.guaranteed_force": Exercise(
        reference=guaranteed_force,
        cases=_control_matrices,
        invariant=_overpromise,
        unit="N",
        tolerance=1e-9,
        hint="the closest point of a polygon lies on an edge, the edges are parallel to the rows of A, and across row "
        "A_i every drive j adds at most torque times |A_j x A_i| / |A_i|",
    ),
    "02.best_torques": Exercise(
        reference=best_torques,
        cases=_choices,
        invariant=_not_the_best,
        unit="N m",
        tolerance=1e-9,
        hint="write c = c0 + s: the step s must make up for the force f - A^T c0 and be as small as possible in the "
        "weights W, and (A^T)_W^+ of (11) gives the smallest step for a force",
    ),
    "02.input_singularity": Exercise(
        reference=input_singularity,
        cases=_mixed_modes,
        invariant=_spread,
        unit="m",
        tolerance=1e-6,
        hint="two cross products d_1 x d_2 and d_1 x d_3 must vanish together: start a root finder at the darkest "
        "point of the map, or ask where two of the three curves cross",
    ),
}
