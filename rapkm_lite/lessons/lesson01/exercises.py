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
from ..checker import Exercise


def _four_arms() -> Manipulator:
    square = 0.25 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    return Manipulator(base=square, lengths=[0.25, 0.3], masses=[0.1, 0.2], name="four arms")


def _pose(robot: Manipulator, rng) -> np.ndarray:
    """A closed pose in a random working mode, at most 0.1 m from the origin."""
    radius, angle = 0.1 * np.sqrt(rng.random()), 2 * np.pi * rng.random()
    x = radius * np.array([np.cos(angle), np.sin(angle)])
    return inverse_kinematics(robot, x, rng.choice(working_modes(robot)))


def _open_poses(rng) -> list[tuple]:
    """Closed poses, and poses with open loops."""
    cases = []
    for robot in (load(), _four_arms()):
        for size in (0.0, 0.0, 0.1, 1.0, 3.0):
            cases.append((robot, _pose(robot, rng) + size * rng.standard_normal(robot.n_joints)))
    return cases


def _cosine_law(h, robot, q) -> tuple[float, str]:
    """Distances of the tips that h implies from their own base points, against the law of cosines."""
    p = np.insert(forward_kinematics(robot, q) + np.reshape(h, (-1, 2)), 1, forward_kinematics(robot, q), axis=0)
    l1, l2 = robot.lengths.T
    reach = np.sqrt(l1**2 + l2**2 + 2 * l1 * l2 * np.cos(q[robot.n_arms :]))
    return np.abs(np.linalg.norm(p - robot.base, axis=-1) - reach).max(), "the arms obey the law of cosines to (m)"


def _regular_pairs(rng) -> list[tuple]:
    """Poses with a pair of joints that is well away from its singularities."""
    cases = []
    while len(cases) < 12:
        robot = (load(), _four_arms())[len(cases) % 2]
        q, pair = _pose(robot, rng), [int(i) for i in rng.choice(robot.n_joints, 2, replace=False)]
        rest = [j for j in range(robot.n_joints) if j not in pair]
        if np.linalg.svd(constraint_jacobian(robot, q)[:, rest], compute_uv=False)[-1] > 0.02:
            cases.append((robot, q, pair))
    return cases


def _tangent(F, robot, q, pair) -> tuple[float, str]:
    return np.abs(constraint_jacobian(robot, q) @ F).max(), "largest entry of J F (m/rad)"


def _moving_poses(rng) -> list[tuple]:
    """Poses in motion with drive torques, some of them antagonistic."""
    cases = []
    for k in range(8):
        robot = (load(), _four_arms())[k % 2]
        q = _pose(robot, rng)
        qd = orthogonal_complement(robot, q) @ rng.uniform(-0.5, 0.5, 2)
        c = rng.uniform(-0.2, 0.2, robot.n_arms) if robot.n_arms > 3 else 0.2 * null_vector(robot, q)
        cases.append((robot, q, qd, c))
    return cases


def _pairs_in_motion(rng) -> list[tuple]:
    """Poses in motion with drive torques, each with a pair of joints that is well away from its singularities."""
    cases = []
    for robot, q, pair in _regular_pairs(rng):
        qd = orthogonal_complement(robot, q, pair) @ rng.uniform(-1.0, 1.0, 2)
        cases.append((robot, q, qd, rng.uniform(-0.2, 0.2, robot.n_arms), pair))
    return cases


def projected_accelerations(robot: Manipulator, q, qd, c, independent) -> np.ndarray:
    """Accelerations (2N,) in rad/s^2, by way of (2) with its multipliers: the same for every `independent`."""
    return forward_dynamics(robot, q, qd, c)[0]


def _loops_stay_closed(qdd, robot, q, qd, c, independent) -> tuple[float, str]:
    gap = constraint_jacobian(robot, q) @ qdd + constraint_jacobian_dot(robot, q, qd) @ qd
    return np.abs(gap).max(), "the gaps accelerate, J qdd + Jdot qd (m/s^2)"


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
        cases=_open_poses,
        invariant=_cosine_law,
        hint="a distal link points along base angle + elbow angle; subtract the tip of arm 2 from all the others",
        unit="m",
        tolerance=1e-12,
    ),
    "01.orthogonal_complement": Exercise(
        reference=orthogonal_complement,
        cases=_regular_pairs,
        invariant=_tangent,
        hint="rows `independent` of F are the identity, the others -J1^-1 J2; J1 are the dependent columns",
        unit="rad/rad",
        tolerance=1e-10,
    ),
    "01.projected_accelerations": Exercise(
        reference=projected_accelerations,
        cases=_pairs_in_motion,
        invariant=_loops_stay_closed,
        hint="Gbar, Cbar and Qbar are (7), and A in (6) are the first N rows of F; solve for q2dd, then "
        "go back to all joints with the derivative of qd = F q2d, which has two terms",
        unit="rad/s^2",
        tolerance=1e-8,
    ),
    "01.pin_forces": Exercise(
        reference=pin_forces,
        cases=_moving_poses,
        invariant=_power,
        hint="in (2) J^T lambda stands on the left, so arm i feels -lambda_i; arm 2 is in every row pair of J",
        unit="N",
        tolerance=1e-9,
    ),
}
