"""Exercises of lesson 01: loop constraints, orthogonal complement, projected motion equations, forces in the pin."""

from __future__ import annotations

import numpy as np

from ...machine.manipulator import Manipulator, load
from ...mechanics.antagonism import null_vector
from ...mechanics.dynamics import (
    coriolis_matrix,
    forward_dynamics,
    generalized_forces,
    mass_matrix,
    orthogonal_complement,
)
from ...mechanics.kinematics import (
    constraint_jacobian,
    constraint_jacobian_dot,
    forward_kinematics,
    inverse_kinematics,
    loop_constraints,
    tip_jacobians,
    working_modes,
)
from ..checker import Case, Exercise
from . import mistakes


def _machines() -> list[tuple[str, Manipulator]]:
    """The testbed, one with unequal arms, and one with four arms, each with words for it."""
    square = 0.25 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    lengths, masses = [[0.2, 0.22], [0.23, 0.2], [0.21, 0.24]], [[0.1, 0.2], [0.15, 0.1], [0.2, 0.12]]
    return [
        ("the testbed", load()),
        ("unequal arms", load().replace(lengths=lengths, masses=masses)),
        ("four arms", Manipulator(base=square, lengths=[0.25, 0.3], masses=[0.1, 0.2], name="four arms")),
    ]


def _pose(robot: Manipulator, rng) -> np.ndarray:
    """A closed pose in a random working mode, at most 0.1 m from the origin."""
    radius, angle = 0.1 * np.sqrt(rng.random()), 2 * np.pi * rng.random()
    x = radius * np.array([np.cos(angle), np.sin(angle)])
    return inverse_kinematics(robot, x, rng.choice(working_modes(robot)))


def _open_poses(rng) -> list[tuple]:
    """Closed poses, and poses with open loops."""
    return [
        Case(f"open loops of {words}" if size else f"closed loops of {words}", robot, q)
        for words, robot in _machines()
        for size in (0.0, 0.1, 1.0, 3.0)
        for q in [_pose(robot, rng) + size * rng.standard_normal(robot.n_joints)]
    ]


def _cosine_law(h, robot, q) -> tuple[float, str]:
    """Distances of the tips that h implies from their own base points, against the law of cosines."""
    p = np.insert(forward_kinematics(robot, q) + np.reshape(h, (-1, 2)), 1, forward_kinematics(robot, q), axis=0)
    l1, l2 = robot.lengths.T
    reach = np.sqrt(l1**2 + l2**2 + 2 * l1 * l2 * np.cos(q[robot.n_arms :]))
    return np.abs(np.linalg.norm(p - robot.base, axis=-1) - reach).max(), "the arms obey the law of cosines to (m)"


def _regular_pairs(rng) -> list[Case]:
    """Poses with a pair of joints that is well away from its singularities, and two pairs that are not."""
    cases = []
    machines = _machines()
    while len(cases) < 14:
        words, robot = machines[len(cases) % 3]
        q, pair = _pose(robot, rng), [int(i) for i in rng.choice(robot.n_joints, 2, replace=False)]
        rest = [j for j in range(robot.n_joints) if j not in pair]
        size = np.linalg.svd(constraint_jacobian(robot, q)[:, rest], compute_uv=False)[-1]
        if len(cases) < 12 and size > 0.02:
            cases.append(Case(words, robot, q, pair))
        elif len(cases) >= 12 and 3e-4 < size < 3e-3:
            cases.append(Case("a pair near its singularity", robot, q, pair))
    return cases


def _tangent(F, robot, q, pair) -> tuple[float, str]:
    size = max(1.0, np.abs(F).max())
    return np.abs(constraint_jacobian(robot, q) @ F).max() / size, "largest entry of J F (m/rad)"


def _moving_poses(rng) -> list[tuple]:
    """Poses in motion with drive torques, some of them antagonistic."""
    cases = []
    for k in range(9):
        words, robot = _machines()[k % 3]
        q = _pose(robot, rng)
        qd = orthogonal_complement(robot, q) @ rng.uniform(-0.5, 0.5, 2)
        c = rng.uniform(-0.2, 0.2, robot.n_arms) if robot.n_arms > 3 else 0.2 * null_vector(robot, q)
        cases.append(Case(words, robot, q, qd, c))
    return cases


def _pairs_in_motion(rng) -> list[tuple]:
    """Poses in motion with drive torques, each with a pair of joints that is well away from its singularities."""
    cases = []
    for case in _regular_pairs(rng)[:12]:
        robot, q, pair = case
        qd = orthogonal_complement(robot, q, pair) @ rng.uniform(-1.0, 1.0, 2)
        cases.append(Case(case.label, robot, q, qd, rng.uniform(-0.2, 0.2, robot.n_arms), pair))
    return cases


def projected_accelerations(robot: Manipulator, q, qd, c, independent) -> np.ndarray:
    """Accelerations (2N,) in rad/s^2, by way of (2) with its multipliers: the same for every `independent`."""
    return forward_dynamics(robot, q, qd, c)[0]


def _loops_stay_closed(qdd, robot, q, qd, c, independent) -> tuple[float, str]:
    gap = constraint_jacobian(robot, q) @ qdd + constraint_jacobian_dot(robot, q, qd) @ qd
    return np.abs(gap).max(), "acceleration of the gaps, J qdd + Jdot qd (m/s^2)"


def pin_forces(robot: Manipulator, q, qd, c) -> np.ndarray:
    """Forces (N, 2) in N that the end-effector pin exerts on the arm tips, from the multipliers of (2).

    J^T lambda stands on the left-hand side of (2), so arm i != 2 feels -lambda_i and arm 2 feels their sum.
    """
    reaction = forward_dynamics(robot, q, qd, c)[1].reshape(-1, 2)
    return np.insert(-reaction, 1, reaction.sum(axis=0), axis=0)


def _power(forces, robot, q, qd, c) -> tuple[float, str]:
    """Power into each arm (pin, drive, friction) minus the rate of its kinetic energy."""
    qdd = forward_dynamics(robot, q, qd, c)[0]
    u = np.concatenate([c, 0 * c])
    own = qd * (mass_matrix(robot, q) @ qdd + coriolis_matrix(robot, q, qd) @ qd + generalized_forces(robot, q, qd) - u)
    rates = qd.reshape(2, -1).T
    pin = np.einsum("ni,nij,nj->n", forces, tip_jacobians(robot, q), rates)
    return np.abs(own.reshape(2, -1).sum(axis=0) - pin).max(), "power balance of each arm holds to (W)"


EXERCISES = {
    "01.loop_constraints": Exercise(
        reference=loop_constraints,
        hints=(
            "Walk along one arm, from its base point to its elbow and on to its tip. Which direction does each of the "
            "two links have, counted from the x axis?",
            "The distal link points along base angle + elbow angle. Collect all tips in an array p of shape (N, 2), "
            "then take what leads from the tip of arm 2, p[1], to each of the others.",
            "base, elbow = q[:N], q[N:]; p = robot.base + l1 (cos, sin)(base) + l2 (cos, sin)(base + elbow), with one "
            "l1 and l2 per arm; return (np.delete(p, 1, axis=0) - p[1]).ravel().",
        ),
        unit="m",
        cases=_open_poses,
        invariant=_cosine_law,
        tolerance=1e-12,
        close=1e-4,
        improve="work in double precision and do not round on the way",
        mistakes=mistakes.GAPS,
    ),
    "01.orthogonal_complement": Exercise(
        called="complement",
        reference=orthogonal_complement,
        hints=(
            "Two of the velocities are given and the others are unknown. How many equations does (4) have, and how "
            "many unknowns?",
            "(4) is linear in the dependent velocities: solve it for them. The columns of the result belong to the two "
            "independent velocities, and these follow from themselves by the identity.",
            "F = np.zeros((2N, 2)); F[independent] = np.eye(2); F[dependent] = -np.linalg.solve(J[:, dependent], "
            "J[:, independent]).",
        ),
        unit="rad/rad",
        cases=_regular_pairs,
        invariant=_tangent,
        tolerance=1e-10,
        close=1e-3,
        improve="solve the linear equations (4) instead of taking differences or damping them",
        mistakes=mistakes.COMPLEMENTS,
    ),
    "01.projected_accelerations": Exercise(
        reference=projected_accelerations,
        hints=(
            "qd = F q2d holds at every moment, so it may be differentiated. How many terms does that give?",
            "Put qdd = F q2dd + Fdot q2d into (2) and multiply by F^T: J F = 0, so the multipliers go. Two equations "
            "for q2dd are left; u has no entries at the elbows.",
            "q2d = qd[independent]; q2dd = solve(F.T @ G @ F, F[:N].T @ c - F.T @ (C @ qd + G @ F_dot @ q2d + Q)); "
            "then F @ q2dd + F_dot @ q2d.",
        ),
        unit="rad/s^2",
        cases=_pairs_in_motion,
        invariant=_loops_stay_closed,
        tolerance=1e-8,
        close=1e-3,
        improve="take Fdot from rk.orthogonal_complement_dot instead of a difference, and solve without damping",
        mistakes=mistakes.ACCELERATIONS,
    ),
    "01.pin_forces": Exercise(
        reference=pin_forces,
        hints=(
            "J^T lambda stands beside the inertia in (2), on the left. On which side do forces stand in Newton's law, "
            "and what does that make of its sign?",
            "h is built from p_1 - p_2, p_3 - p_2, ...: arm i feels only the two multipliers of its own gap, and arm 2 "
            "those of all gaps, with the other sign. The pin has no mass.",
            "rows = lambda.reshape(-1, 2): the force on an arm i other than 2 is minus its row, on arm 2 the sum of "
            "all rows; put it in place 1.",
        ),
        unit="N",
        cases=_moving_poses,
        invariant=_power,
        tolerance=1e-9,
        close=1e-3,
        improve="take the accelerations from rk.forward_dynamics instead of differences",
        mistakes=mistakes.FORCES,
    ),
}
