"""What the exercises of lesson 02 are tried on: the package's answers, seeded cases, and the laws a right one obeys."""

from __future__ import annotations

import itertools

import numpy as np

from ...machine.manipulator import load
from ...mechanics.actuation import (
    control_matrix,
    distal_cross_products,
    force_polygon,
    prestress_projector,
    weighted_pseudoinverse,
)
from ...mechanics.kinematics import arm_vectors, cross, inverse_kinematics, reachable, turn, working_modes
from ..checker import Case


def _pose(robot, x, mode=None):
    return arm_vectors(robot, inverse_kinematics(robot, x, mode))


def arms(rng) -> list[tuple]:
    """Arm vectors of seeded poses of the testbed in all working modes, of other machines, and near the rim."""
    robot = load()
    x = rng.uniform(-0.1, 0.1, (8, 2))
    cases = [Case("the testbed", *_pose(robot, p, s)) for p, s in zip(x, working_modes(robot), strict=True)]
    uneven, four = load("asymmetric"), load("four_arms")
    cases += [Case("three different arms", *_pose(uneven, p)) for p in rng.uniform(-0.05, 0.05, (2, 2))]
    cases += [Case("four arms", *_pose(four, p), beyond=True) for p in rng.uniform(-0.08, 0.08, (2, 2))]
    return [*cases, Case("a pose with an almost stretched arm", *_pose(robot, [0.0, -0.166]))]


def control_rows(a, d) -> np.ndarray:
    return d / cross(a, d)[:, None]


def stretching(A, a, d) -> tuple[float, str]:
    """A rigid distal link: elbow (qd_i times a, a quarter turn on) and tip (xd) have the same velocity along d."""
    x_rate = np.array([0.6, -0.8])
    stretch = np.abs((d * (x_rate - turn(a) * (A @ x_rate)[:, None])).sum(axis=1)) / np.linalg.norm(d, axis=1)
    return stretch.max(), "moving the end-effector at 1 m/s stretches a distal link, in m/s, by"


def unit(d) -> np.ndarray:
    return d / np.linalg.norm(d, axis=-1, keepdims=True)


def control_matrices(rng) -> list[tuple]:
    """Control matrices with a torque limit: random poses, four arms, unequal arms, another mode."""
    robot, four, uneven = load(), load("four_arms"), load("asymmetric")
    x = rng.uniform(-0.1, 0.1, (6, 2))
    cases = [Case("the testbed", _matrix(robot, p), c) for p, c in zip(x, rng.uniform(0.05, 0.2, 6), strict=True)]
    middle = robot.base[:2].mean(axis=0)
    return [
        *cases,
        Case("four drives", _matrix(four, [0.03, -0.05]), 0.12, beyond=True),
        Case("four drives", _matrix(four, [-0.06, 0.02]), 0.07, beyond=True),
        Case("three different arms", _matrix(uneven, [0.02, -0.03]), 0.15),
        Case("another working mode", _matrix(robot, middle + [0.06, 0.07], (1, 1, -1)), 0.1),
    ]


def _matrix(robot, x, mode=None) -> np.ndarray:
    return control_matrix(robot, inverse_kinematics(robot, x, mode))


def guaranteed_force(A, torque: float) -> float:
    """Largest force (N) that torques |c_i| <= torque (N m) produce in every direction: the zonotope's inner radius.

    A : (m, 2) in rad/m.  The edge of the zonotope along row A_i has the distance sum_j |A_j x A_i| / |A_i| from zero.
    """
    return torque * min(edges(np.asarray(A, dtype=float)))


def edges(A) -> list[float]:
    """Distances of the edges of the zonotope for unit torques."""
    return [float(np.abs(cross(A, row)).sum() / np.linalg.norm(row)) for row in A]


def force_without(part: str):
    """The guaranteed force with one step of its computation left out or done otherwise."""

    def force(A, torque):
        size, crossed = np.linalg.norm(A, axis=1), np.array([cross(A, row) for row in A])
        forces = {
            "abs": lambda: np.abs(crossed.sum(axis=1) / size).min(),
            "size": lambda: np.abs(crossed).sum(axis=1).min(),
            "unit": lambda: np.min(np.abs(crossed).sum(axis=1) / size**2),
            "one": lambda: np.min((np.abs(crossed) / size[:, None]).max(axis=1)),
            "along": lambda: np.min(np.abs(A @ A.T).sum(axis=1) / size),
            "mean": lambda: np.mean(edges(A)),
            "corner": lambda: np.linalg.norm(force_polygon(A, 1.0), axis=1).min(),
            "far corner": lambda: np.linalg.norm(force_polygon(A, 1.0), axis=1).max(),
            "axes": lambda: np.abs(A).sum(axis=0).min(),
            "root": lambda: np.linalg.svd(A, compute_uv=False)[-1] * np.sqrt(len(A)),
        }
        return torque * forces[part]()

    return force


def overpromise(force, A, torque: float) -> tuple[float, str]:
    angle = np.linspace(0.0, np.pi, 4001)
    reach = torque * np.abs(A @ np.stack([np.cos(angle), np.sin(angle)])).sum(axis=0)
    return max(0.0, float(force) - reach.min()), "in one direction the drives fall short of this force, in N, by"


def best_torques(A, f, W, c0) -> np.ndarray:
    """Torques (m,) in N m of (11): A^T c = f, and of all those the nearest to c0 in the weights W (m, m)."""
    return weighted_pseudoinverse(A, W) @ f + prestress_projector(A, W) @ c0


def _weights(rng, m: int, full: bool) -> np.ndarray:
    L = np.diag(rng.uniform(0.5, 3.0, m)) + full * 0.3 * rng.standard_normal((m, m))
    return L @ L.T


def choices(rng) -> list[tuple]:
    """Control matrices of three and four arms with a force, weights (diagonal, then full) and a wish for prestress."""
    robot, four = load(), load("four_arms")
    cases = []
    for k in range(10):
        A = _matrix(four if k in (3, 7) else robot, rng.uniform(-0.06, 0.06, 2))
        m = len(A)
        label = "four drives" if m == 4 else f"weights that are {'not ' * (k > 3)}diagonal"
        cases.append(Case(label, A, rng.uniform(-1.0, 1.0, 2), _weights(rng, m, k > 3), rng.uniform(-0.1, 0.1, m)))
    middle = robot.base[:2].mean(axis=0)
    A = _matrix(robot, middle + [0.004, 0.003], (1, 1, -1))
    cases.append(Case("a nearly singular pose", A, np.array([0.1, -0.2]), _weights(rng, 3, False), np.full(3, 0.05)))
    return cases


def not_the_best(c, A, f, W, c0) -> tuple[float, str]:
    """The force missed, and the slope of the price along the torques that move nothing."""
    free = np.linalg.svd(A.T)[2][2:]
    slope = np.linalg.norm(free @ W @ (c - c0)) / np.linalg.norm(W)
    return max(float(slope), float(np.linalg.norm(A.T @ c - f) / np.linalg.norm(A))), (
        "force missed, or slope of the price along a torque that moves nothing, as a torque in N m"
    )


def input_singularity(mode) -> np.ndarray:
    """Input singularity (2,) in m of the testbed in a mixed mode (3,): midway between the bases of the equal arms."""
    return load().base[list(equal(mode))].mean(axis=0)


def equal(mode) -> tuple[int, ...]:
    """The two arms that bend alike."""
    return next(pair for pair in itertools.combinations(range(3), 2) if mode[pair[0]] == mode[pair[1]])


def odd(mode) -> int:
    return ({0, 1, 2} - set(equal(mode))).pop()


def mixed_modes(rng) -> list[tuple[np.ndarray]]:
    return [(mode,) for mode in working_modes(load()) if abs(mode.sum()) == 1]


def spread(x, mode) -> tuple[float, str]:
    robot = load()
    if not reachable(robot, x):
        return np.inf, "the point lies outside the workspace"
    crossed = distal_cross_products(robot, inverse_kinematics(robot, x, mode))
    return 0.2 * np.abs(crossed).max(), "over their length of 0.2 m the distal links miss being parallel, in m, by"
