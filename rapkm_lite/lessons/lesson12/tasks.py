"""What the exercises of lesson 12 are tried on: matrices of any mechanism, other units of q, machines of students."""

from __future__ import annotations

import functools

import numpy as np

from ...control.laws import PD
from ...machine.manipulator import Manipulator, load, manipulator
from ...mechanics.actuation import inverse_dynamics
from ...mechanics.kinematics import constraint_jacobian, inverse_kinematics
from ...mechanics.matrices import projector
from ...mechanics.partition import explicit_pseudoinverse, select_independent
from ...mechanics.trajectory import triangle
from ...simulation.energy import antagonistic_energy
from ...simulation.runs import simulate
from ..answers import given
from ..checker import Case, Measured
from . import four_rrr

OFFSET, ROD, LOAD = np.array([4e-3, -2e-3, 5e-3]), 0.67, 0.5  # rad, kg/m, kg
MOST_TORQUE, MOST_FIGHT, MOST_REACH = 80e-3, 1.0, 0.3  # N m, J, m


def range_projector(J, m: int) -> np.ndarray:
    """R = (A~^T)^+ A~^T, (m, m), from J (r, n) alone; the first m joints are driven."""
    A_tilde = projector(J)[:m]
    rows = select_independent(A_tilde, delta=J.shape[1] - J.shape[0])
    return explicit_pseudoinverse(A_tilde, rows) @ A_tilde.T


def fight(J, m, K_P, offset) -> np.ndarray:
    """Torques (m,) in N m that drives with the gain K_P hold against each other at rest, for any mechanism."""
    return -K_P * (np.eye(m) - range_projector(J, m)) @ offset


def fight_cases(rng) -> list[Case]:
    cases = []
    # A default cut-off of pinv tosses a coin at each pose, so two poses do not show it.
    some = [("the 4RRR machine", pose) for pose in ([0.05, 0.03, 0.1], *rng.uniform(-0.08, 0.08, (12, 3)))]
    for label, pose in [*some, ("the turned 4RRR machine", [-0.08, 0.02, -0.3])]:
        cases.append(Case(label, four_rrr.four_rrr().J(four_rrr.angles(pose)), 4, 40.0, rng.normal(0, 4e-3, 4)))
    for name, label in (("testbed", "the testbed"), ("four_arms", "four arms with two freedoms")):
        robot = load(name)
        J = constraint_jacobian(robot, inverse_kinematics(robot, rng.uniform(-0.05, 0.05, 2)))
        cases.append(Case(label, J, robot.n_arms, 7.05, rng.normal(0, 4e-3, robot.n_arms)))
    return [*cases, Case("six drives with two too many", rng.normal(size=(5, 9)), 6, 3.0, rng.normal(0, 4e-3, 6))]


def moves(got, J, m, K_P, offset) -> tuple[float, str]:
    return float(np.abs(projector(J)[:m].T @ got).max()), "part of these torques that moves the machine (N m)"


def in_units(J, scale) -> np.ndarray:
    """The projector (n, n) of somebody who measures q' = scale q, carried back to q: S^-1 N_(J S^-1) S."""
    return projector(J / scale) * scale / np.asarray(scale)[:, None]


def unit_cases(rng) -> list[Case]:
    J = four_rrr.four_rrr().J(four_rrr.angles([0.05, 0.03, 0.1]))
    degrees = np.ones(9)
    degrees[8] = np.degrees(1.0)
    robot = load()
    small = constraint_jacobian(robot, inverse_kinematics(robot, [0.02, -0.03]))
    return [
        Case("the platform joint in degrees", J, degrees),
        Case("any units", J, rng.uniform(0.2, 5.0, 9)),
        Case("the testbed", small, rng.uniform(0.2, 5.0, 6)),
    ]


def no_projector(got, J, scale) -> tuple[float, str]:
    """J N = 0 in any units, and N N = N."""
    return float(max(np.abs(J @ got).max(), np.abs(got @ got - got).max())), "largest entry of J N and of N N - N"


def equipped(answer) -> Manipulator:
    """Base points, links and working mode of a student's machine, with the rods, load and motors that all get."""
    robot = manipulator(given(answer, ()), "the answer")
    if robot.n_arms != 3:
        raise ValueError(f"the machine has {robot.n_arms} arms; allowed: 3")
    rods = ROD * robot.lengths
    return Manipulator(robot.base, robot.lengths, rods, load=LOAD, rotor_inertia=3.35e-6, mode=robot.mode)


def behaviour(answer) -> list[Measured]:
    """What a student's machine needs on the triangle, what offsets cost it, and how wide it stands."""
    torque, fight, reach = _numbers(equipped(answer))
    return [
        Measured("largest torque", 1e3 * torque, "mN m", 1e3 * MOST_TORQUE),
        Measured("cost of the offsets", fight, "J", MOST_FIGHT),
        Measured("farthest drive", 1e3 * reach, "mm from the origin", 1e3 * MOST_REACH),
    ]


@functools.lru_cache(maxsize=8)
def _numbers(robot: Manipulator) -> tuple[float, float, float]:
    path = triangle(robot)
    torque = inverse_dynamics(robot, path.q, path.qd, path.qdd)
    run = simulate(robot, PD(7.05, 0.225), path, OFFSET)
    reach = np.linalg.norm(robot.base, axis=1).max()
    return float(np.abs(torque).max()), float(antagonistic_energy(run)), float(reach)


def own_machine() -> Manipulator:
    """A wide base, so that the singular middles of its sides lie outside the triangle, and arm 3 bent the other way."""
    angle = np.radians([210.0, 330.0, 90.0])
    base = 0.29 * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    return Manipulator(base=base, lengths=[0.18, 0.26], masses=0.1, mode=[1, 1, -1])


def costly_and_bent_alike(answer) -> bool:
    robot = equipped(answer)
    return bool(abs(robot.mode.sum()) == 3) and _numbers(robot)[1] > 1.05 * MOST_FIGHT
