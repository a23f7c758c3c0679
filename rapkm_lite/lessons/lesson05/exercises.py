"""Exercises of lesson 05: feedback map of CTC, explicit pseudoinverse (27), a dead encoder."""

from __future__ import annotations

import numpy as np

from ...machine.manipulator import load
from ...mechanics.actuation import control_matrix, drive_pairs, redundant_control_matrix, weighted_pseudoinverse
from ...mechanics.dynamics import forward_dynamics, minimal_dynamics
from ...mechanics.kinematics import inverse_kinematics
from ...mechanics.partition import explicit_pseudoinverse, select_independent
from ..checker import Case, Exercise
from .survivor import DEAD_ENCODER


def machines() -> dict:
    """Machines without friction by the words that a verdict has for them."""
    files = {"three equal arms": "testbed", "unequal arms": "asymmetric", "four arms": "four_arms"}
    return {words: load(name).replace(friction=0.0) for words, name in files.items()}


def poses(robot, rng, count: int) -> np.ndarray:
    return inverse_kinematics(robot, rng.uniform(-0.06, 0.06, (count, 2)))


def _minimal(robot, q, pair) -> tuple[np.ndarray, np.ndarray]:
    """Control matrix and mass matrix in the angles of a pair, or for None of the end-effector."""
    Gbar, _, _ = minimal_dynamics(robot, q, np.zeros(robot.n_joints), pair)
    return control_matrix(robot, q, pair), Gbar


def feedback_map(robot, q, pair) -> np.ndarray:
    """A (A^T A)^-1 Gbar (m, 2): torques per acceleration of the angles of `pair`, as ordered, N m per rad/s^2."""
    A, Gbar = _minimal(robot, q, pair)
    return weighted_pseudoinverse(A) @ Gbar


def _pairs_at_poses(rng) -> list[tuple]:
    cases = []
    for words, robot in machines().items():
        pairs = drive_pairs(robot)
        some = [pairs[k] for k in (0, 1, -1)]
        cases += [Case(words, robot, q, pair) for q, pair in zip(poses(robot, rng, 3), some, strict=True)]
    robot = load().replace(friction=0.0)
    near = inverse_kinematics(robot, [0.1, -0.069])  # the links of drives 1 and 2 are parallel at x = 0.1013 m
    turned = Case("a pair in the other order", robot, poses(robot, rng, 1)[0], (2, 0), beyond=True)
    return [*cases, turned, Case("a pose near the curve of the pair", robot, near, (0, 1))]


def _acceleration(Phi, robot, q, pair) -> tuple[float, str]:
    """Equation (2) with multipliers, from rest: the torques Phi v must change the acceleration of the pair by v."""
    still = np.zeros(robot.n_joints)
    falling = forward_dynamics(robot, q, still, np.zeros(robot.n_arms))[0]
    gained = [forward_dynamics(robot, q, still, Phi @ v)[0] - falling for v in np.eye(2)]
    worst = max(np.abs(a[list(pair)] - v).max() for a, v in zip(gained, np.eye(2), strict=True))
    return worst, "the multiplier form (2) answers 1 rad/s^2 of desired acceleration with an error in rad/s^2 of"


def _mapped(change):
    """A wrong map from (A^T)^+ and Gbar in the angles of the pair and (A^T)^+ and Gbar of the end-effector."""

    def wrong(robot, q, pair):
        (A, Gbar), (A_x, G_x) = _minimal(robot, q, pair), _minimal(robot, q, None)
        return change(weighted_pseudoinverse(A), Gbar, weighted_pseudoinverse(A_x), G_x)

    return wrong


def _two_drives(robot, q, pair):
    Phi = np.zeros((robot.n_arms, 2))
    Phi[list(pair)] = _minimal(robot, q, pair)[1]
    return Phi


def _without_inverse(robot, q, pair):
    A, Gbar = _minimal(robot, q, pair)
    return A @ Gbar


def _partitions(rng) -> list[tuple]:
    cases, nudged = [], []
    for words, robot in machines().items():
        A = redundant_control_matrix(robot, poses(robot, rng, 3))
        left, _, right = np.linalg.svd(A, full_matrices=False)
        rounded = A + 1e-12 * left[..., 2:3] * right[..., 2:3, :]
        for k, rows in enumerate(select_independent(A)):
            cases.append(Case(words, A[k], rows))
            nudged.append(Case(f"{words} with rounding errors of 1e-12", rounded[k], rows))
    robot = load()
    A = redundant_control_matrix(robot, inverse_kinematics(robot, [0.01, 0.02]))
    other = [Case("another order of rows", A, np.array(rows)) for rows in ((0, 2), (2, 0), (2, 1))]
    # Half-way between base points 1 and 2 a half-turn takes arm 1 to arm 2: their distal links, and rows, are parallel.
    A = redundant_control_matrix(robot, inverse_kinematics(robot, robot.base[:2].mean(axis=0)))
    return [*cases, *nudged, *other, Case("a pose where rows 0 and 1 depend on each other", A, select_independent(A))]


def _penrose(X, A_tilde, rows) -> tuple[float, str]:
    """The four conditions of Penrose, which hold for one matrix only."""
    M = A_tilde.T
    defects = (M @ X @ M - M, X @ M @ X - X, (M @ X).T - M @ X, (X @ M).T - X @ M)
    return max(np.abs(d).max() for d in defects), "the four Penrose conditions are violated by"


def _blocks(change, sort=True):
    """A wrong matrix from (A~_1^T)^+, B and the right bottom block; change -> (top, bottom)."""

    def wrong(A_tilde, rows):
        first, rest = list(rows), [i for i in range(len(A_tilde)) if i not in rows]
        left = np.linalg.solve(A_tilde[first] @ A_tilde[first].T, A_tilde[first])
        B = left @ A_tilde[rest].T
        right = np.linalg.solve(np.eye(len(rest)) + B.T @ B, B.T @ left)
        top, bottom = change(left, B, right, A_tilde[first])
        if not sort:
            return np.vstack([top, bottom])
        result = np.empty_like(A_tilde)
        result[first], result[rest] = top, bottom
        return result

    return wrong


def _rows_for_inverse(A_tilde, rows):
    """(27) with A~_1 where (A~_1^T)^+ belongs."""
    first, rest = list(rows), [i for i in range(len(A_tilde)) if i not in rows]
    B = A_tilde[first] @ A_tilde[rest].T
    result = np.empty_like(A_tilde)
    result[rest] = np.linalg.solve(np.eye(len(rest)) + B.T @ B, B.T @ A_tilde[first])
    result[first] = A_tilde[first] - B @ result[rest]
    return result


EXERCISES = {
    "05.feedback_map": Exercise(
        feedback_map,
        hints=(
            "Look at (20) and change nothing but v_2. Which part of the law does it pass through?",
            "A change of v_2 becomes a force by Gbar and torques by (A^T)^+, both in the angles of the same pair.",
            "With A and Gbar of the pair: A @ np.linalg.solve(A.T @ A, Gbar).",
        ),
        unit="N m per rad/s^2",
        cases=_pairs_at_poses,
        invariant=_acceleration,
        close=1e-3,
        improve="solve with A^T A exactly, without a damping or a coarse difference",
        mistakes={
            "the inverse of A^T A is missing: A Gbar is not (A^T)^+ Gbar": _without_inverse,
            "the factor Gbar is missing: (A^T)^+ alone takes forces to torques, not accelerations": _mapped(
                lambda L, G, L_x, G_x: L
            ),
            "Gbar is that of the end-effector, A that of the pair: both must be in the angles of the pair (frame)": (
                _mapped(lambda L, G, L_x, G_x: L @ G_x)
            ),
            "A is that of the end-effector, Gbar that of the pair: both must be in the angles of the pair (frame)": (
                _mapped(lambda L, G, L_x, G_x: L_x @ G)
            ),
            "this is the map for accelerations of the end-effector: pass the pair to both functions (another frame)": (
                _mapped(lambda L, G, L_x, G_x: L_x @ G_x)
            ),
            "Gbar is inverted: it takes accelerations to forces, its inverse does the opposite": _mapped(
                lambda L, G, L_x, G_x: L @ np.linalg.inv(G)
            ),
            "only the two drives of the pair work here: (A^T)^+ shares the force among all drives": _two_drives,
            "this is the map from torques to accelerations, the inverse of the wanted one": (
                lambda robot, q, pair: np.linalg.pinv(feedback_map(robot, q, pair))
            ),
            "the pair is ignored: these are always the angles of drives 1 and 2": (
                lambda robot, q, pair: feedback_map(robot, q, (0, 1))
            ),
            "Gbar is always that of drives 1 and 2, A that of the pair: both must be in its angles (frame)": (
                lambda robot, q, pair: (
                    weighted_pseudoinverse(control_matrix(robot, q, pair)) @ _minimal(robot, q, (0, 1))[1]
                )
            ),
            "A is always that of drives 1 and 2, Gbar that of the pair: both must be in its angles (frame)": (
                lambda robot, q, pair: (
                    weighted_pseudoinverse(control_matrix(robot, q, (0, 1))) @ _minimal(robot, q, pair)[1]
                )
            ),
            "this is Gbar, the force; the torques need the factor (A^T)^+": _mapped(lambda L, G, L_x, G_x: G),
        },
    ),
    "05.explicit_pseudoinverse": Exercise(
        explicit_pseudoinverse,
        hints=(
            "The two drives of rows can make any wrench alone. What do the others take over when the torques are to "
            "be as short as possible?",
            "The gradient of |y - B c_2|^2 + |c_2|^2 vanishes at (I + B^T B) c_2 = B^T y, and c_1 = y - B c_2, with "
            "y = (A~_1^T)^+ w.",
            "With L = np.linalg.solve(A1 @ A1.T, A1) and B = L @ A2.T: bottom = np.linalg.solve(I + B.T @ B, "
            "B.T @ L), top = L - B @ bottom; result[rows] = top, the other rows = bottom.",
        ),
        unit="(without unit)",
        cases=_partitions,
        invariant=_penrose,
        close=1e-3,
        improve="solve the least-squares problem for c_2 exactly",
        mistakes={
            "pinv takes rounding for a third direction and divides by it: its default cut-off, or one as small, does "
            "not give the rank; a larger one does, and so do rows": lambda A_tilde, rows: np.linalg.pinv(A_tilde.T),
            "the blocks are stacked, A~_1 first: the rows stand in another order than the drives": _blocks(
                lambda L, B, right, A1: (L - B @ right, right), sort=False
            ),
            "the drives outside rows are switched off: this is (A~_1^T)^+, with zeros for the rest": _blocks(
                lambda L, B, right, A1: (L, 0 * right)
            ),
            "the identity is missing in (I + B^T B)^-1": _blocks(
                lambda L, B, right, A1: (L - B @ np.linalg.pinv(B) @ L, np.linalg.pinv(B) @ L)
            ),
            "the top block is not reduced: what the other drives take over must be subtracted, c_1 = y - B c_2": (
                _blocks(lambda L, B, right, A1: (L, right))
            ),
            "the top block has the wrong sign: c_1 = y - B c_2, not plus": _blocks(
                lambda L, B, right, A1: (L + B @ right, right)
            ),
            "the factor B is missing in the top block, c_1 = y - B c_2": _blocks(
                lambda L, B, right, A1: (L - right, right)
            ),
            "the inverse (I + B^T B)^-1 is missing in the bottom block": _blocks(
                lambda L, B, right, A1: (L - B @ B.T @ L, B.T @ L)
            ),
            "the inverse of A~_1 A~_1^T is missing in (A~_1^T)^+": _rows_for_inverse,
        },
    ),
    "05.dead_encoder": DEAD_ENCODER,
}
