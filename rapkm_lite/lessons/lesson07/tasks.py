"""What the exercises of lesson 07 are tried on: contradictions of angles, late drives, and via points on an edge."""

from __future__ import annotations

import functools

import numpy as np

from ...control.laws import PD
from ...machine.arguments import matvec
from ...machine.manipulator import load
from ...mechanics.actuation import control_matrix, prestress_projector
from ...mechanics.antagonism import null_basis
from ...mechanics.closure import estimate_pose
from ...mechanics.kinematics import inverse_kinematics
from ...mechanics.trajectory import polygon
from ...simulation.energy import antagonistic_torque
from ...simulation.runs import simulate
from ..answers import Ended, fitting, given, numbers
from ..checker import Case, Measured

START, END = np.array([-0.12, -0.12 / np.sqrt(3)]), np.array([0.12, -0.12 / np.sqrt(3)])
LIMIT, MOST = 15e-3, 9


def contradiction(robot, q_a, guess) -> np.ndarray:
    """Size (k,) in rad of what is left of base angles q_a (k, N) when the pose that fits them best is taken away."""
    return np.linalg.norm(left_over(robot, q_a, guess), axis=-1)


def left_over(robot, q_a, guess) -> np.ndarray:
    """q_a minus the base angles of the least-squares pose, (k, N) in rad."""
    return q_a - estimate_pose(robot, q_a, guess)[..., : robot.n_arms]


def seen_from_the_guess(robot, q_a, guess) -> np.ndarray:
    """The contradiction to first order, with the null space at the guess."""
    q = inverse_kinematics(robot, guess)
    n = null_basis(control_matrix(robot, q))
    return np.linalg.norm(matvec(n.mT, q_a - q[:, : robot.n_arms]), axis=-1)


def contradiction_cases(rng) -> list[tuple]:
    cases = []
    for name, label in (("testbed", "the testbed"), ("asymmetric", "three different arms"), ("four_arms", "four arms")):
        robot = load(name)
        x = rng.uniform(-0.06, 0.06, (5, 2))
        q_a = inverse_kinematics(robot, x)[:, : robot.n_arms]
        near = x + rng.normal(0, 2e-3, x.shape)
        q_a = q_a + rng.normal(0, 5e-3, q_a.shape)
        cases.append(Case(label, robot, q_a, near, beyond=name == "four_arms"))
    return cases


def off_the_normal(got, robot, q_a, guess) -> tuple[float, str]:
    """The left-over lies in the null space of A^T at the pose that fits best: its components there have this size."""
    q = estimate_pose(robot, q_a, guess)
    n = null_basis(control_matrix(robot, q))
    along = matvec(n.mT, q_a - q[..., : robot.n_arms])
    return float(np.abs(np.linalg.norm(along, axis=-1) - got).max()), "off the part along the null space, in rad"


def delay_torque(A, xd, delay, K_P) -> np.ndarray:
    """Torques (m,) in N m that press without moving: set-points late by delay (m,) in s, gain K_P in N m/rad."""
    return -K_P * prestress_projector(A) @ ((A @ xd) * delay)


def delay_cases(rng) -> list[tuple]:
    cases = []
    for name, label in (("testbed", "the testbed"), ("four_arms", "four drives"), ("asymmetric", "different arms")):
        robot = load(name)
        for x in rng.uniform(-0.05, 0.05, (3, 2)):
            A = control_matrix(robot, inverse_kinematics(robot, x))
            delay = rng.uniform(0, 3e-3, robot.n_arms)
            xd, K_P = rng.uniform(-0.3, 0.3, 2), rng.uniform(3, 12)
            cases.append(Case(label, A, xd, delay, K_P, beyond=name == "four_arms"))
    A = control_matrix(load(), inverse_kinematics(load(), [0.02, 0.03]))
    return [*cases, Case("one late drive", A, np.array([0.2, 0.1]), np.array([1e-3, 0.0, 0.0]), 7.05)]


def pushes(got, A, xd, delay, K_P) -> tuple[float, str]:
    return float(np.abs(A.T @ got).max()), "push on the end-effector (N)"


@functools.cache
def edge():
    """The testbed without friction, and its first edge there and back in 3 s."""
    robot = load().replace(friction=0.0)
    return robot, polygon(robot, [START, END], duration=3.0)


def set_points(robot, path, start, end, shares) -> np.ndarray:
    """Base angles (k, N) of drives that move straight from via point to via point at `shares` of the edge, 0 and 1."""
    s = np.linalg.norm(path.x - start, axis=-1) / np.linalg.norm(np.subtract(end, start))
    via = np.unwrap(inverse_kinematics(robot, start + np.asarray(shares)[:, None] * np.subtract(end, start)), axis=0)
    return np.stack([np.interp(s, shares, via[:, i]) for i in range(robot.n_arms)], axis=-1)


def peak(shares) -> float:
    """Largest antagonistic torque in N m of the PD run on the edge with via points at these shares of the way."""
    robot, path = edge()
    given = np.concatenate([[0.0], np.sort(shares), [1.0]])
    run = simulate(robot, PD(7.05, 0.225), path.with_set_points(set_points(robot, path, START, END, given)))
    return float(np.abs(antagonistic_torque(run)).max())


@functools.cache
def edge_demand() -> tuple[np.ndarray, np.ndarray]:
    """Shares of the way and the demand there, both (997,)."""
    part = np.linspace(0, 1, 1001)
    return part[2:-2], demand(edge()[0], START, END, part)[2:-2]


def chosen(answer) -> np.ndarray:
    """The via points that a student's function chooses."""
    shares = np.atleast_1d(numbers(given(answer, edge_demand())))
    shares = fitting(shares, (shares.size,))
    if not np.all((shares >= 0) & (shares <= 1)):
        raise Ended("wrong", "the via points are shares of the way, numbers between 0 and 1", "no shares")
    if np.any((shares == 0) | (shares == 1)):
        raise Ended("wrong", "the shares 0 and 1 are the ends of the way, which are given: leave them out", "ends")
    return np.unique(shares)


def quarrel(answer) -> list[Measured]:
    shares = chosen(answer)
    return [
        Measured("via points", len(shares), "in all", MOST),
        Measured("largest antagonistic torque", 1e3 * peak(shares), "mN m", 1e3 * LIMIT),
    ]


def via_points(part, demand) -> np.ndarray:
    """Nine via points whose legs contradict equally: equal steps of the integral of the root of the demand."""
    reach = np.cumsum(np.sqrt(demand))
    return np.interp(np.linspace(reach[0], reach[-1], MOST + 2)[1:-1], reach, part)


def as_dense_as_the_demand(shares: np.ndarray) -> bool:
    part, needed = edge_demand()
    plain = via_points(part, needed**2)
    return len(shares) == MOST and bool(np.abs(shares - plain).max() < 0.01)


def demand(robot, start, end, s) -> np.ndarray:
    """|eta^T q_a''| (k,) in rad, derivatives by the share s (k,) of the way, equidistant, by differences."""
    q = np.unwrap(inverse_kinematics(robot, start + s[:, None] * np.subtract(end, start)), axis=0)
    bend = np.gradient(np.gradient(q[:, : robot.n_arms], s, axis=0, edge_order=2), s, axis=0, edge_order=2)
    n = null_basis(control_matrix(robot, q))
    return np.linalg.norm(matvec(n.mT, bend), axis=-1)
