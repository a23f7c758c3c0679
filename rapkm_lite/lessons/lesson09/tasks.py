"""What the exercises of lesson 09 are tried on: room for a prestress, torques of one sign, a load on geared drives."""

from __future__ import annotations

import functools

import numpy as np
from scipy.optimize import linprog

from ...control.computed_torque import CTC
from ...control.grammar import Law
from ...machine.manipulator import load
from ...mechanics.actuation import control_matrix, required_wrench, weighted_pseudoinverse
from ...mechanics.antagonism import common_sign, null_basis
from ...mechanics.kinematics import inverse_kinematics
from ...mechanics.trajectory import polygon
from ...simulation.energy import copper_loss
from ...simulation.runs import simulate
from ..answers import Ended, fitting, given, numbers
from ..checker import Case, Measured

# Of the carriage: torques in N m that a drive may and must give, heat in J, error in m.
LIMIT, LEAST, HEAT, ERROR = 85e-3, 4e-3, 14.0, 1e-4


def room(c, n, limit) -> np.ndarray:
    """Smallest and largest mu (2,) in N m with |c_i + mu n_i| <= limit_i; where none fits, the first is larger."""
    both = ends(c, n, limit)
    return np.array([both.min(axis=0).max(), both.max(axis=0).min()])


def ends(c, n, limit) -> np.ndarray:
    """The mu (2, m) at which each drive stands at its lower and at its upper limit."""
    return np.stack([(-limit - c) / n, (limit - c) / n])


def room_cases(rng) -> list[tuple]:
    cases, limit = [], np.array([0.08, 0.1, 0.05])
    for label, name, x, size in (
        ("the centre", "testbed", [0.0, 0.0], 0.04),
        ("a pose where n has both signs", "testbed", [0.05, 0.17], 0.04),
        ("a load that no prestress fits", "testbed", [0.02, -0.01], 0.3),
        ("three different arms", "asymmetric", [0.01, 0.02], 0.04),
    ):
        A = control_matrix(load(name), inverse_kinematics(load(name), x))
        for _ in range(3):
            f = A.T @ rng.uniform(-size, size, 3)
            cases.append(Case(label, weighted_pseudoinverse(A) @ f, null_basis(A)[:, 0], rng.permutation(limit)))
    return cases


def off_the_limits(got, c, n, limit) -> tuple[float, str]:
    """At either end of the room some drive stands exactly at its limit."""
    off = np.abs(np.abs(c + np.reshape(got, (2, 1)) * n) - limit)
    return float(off.min(axis=1).max()), "distance of the nearest limit of a drive at the ends of the room (N m)"


def one_sign(A, f, least) -> np.ndarray:
    """Torques (m,) in N m of smallest sum with A^T c = f and c_i >= least, by linear programming."""
    A, f = np.asarray(A, dtype=float), np.asarray(f, dtype=float)
    found = linprog(np.ones(len(A)), A_eq=A.T, b_eq=f, bounds=(least, None))
    if found.status != 0:
        raise ValueError(f"f = {f.tolist()} has no torques of one sign here; where common_sign holds, every force has")
    return found.x


def one_sign_cases(rng) -> list[tuple]:
    cases = []
    for name, label in (("testbed", "the testbed"), ("asymmetric", "three different arms"), ("four_arms", "four arms")):
        robot, found = load(name), []
        while len(found) < 4:
            A = control_matrix(robot, inverse_kinematics(robot, rng.uniform(-0.06, 0.06, 2)))
            if common_sign(A):
                found.append(A)
        for k, A in enumerate(found):
            least = rng.uniform(2e-3, 9e-3)
            f = A.T @ rng.uniform(-0.05, 0.05, len(A))
            # With four arms least squares has another answer, and so has, with three, who lifts the weakest drive
            # only; but not for every force.
            tells, size = (_beyond_squares, 0.3) if len(A) > 3 else (_not_the_weakest, 0.05)
            for _ in range(200 if len(A) > 3 or k % 2 else 0):
                if tells(A, f, least):
                    break
                f = A.T @ rng.uniform(-size, size, len(A))
            cases.append(Case(label, A, f, least, beyond=name == "four_arms"))
    return cases


def _beyond_squares(A, f, least) -> bool:
    """Are the torques of smallest sum not those of smallest sum of squares?

    Then a multiplier of the bounds that hold is below 0: beyond its bound the squares would fall.
    """
    c = one_sign(A, f, least)
    bound = c < least + 1e-9
    force = np.linalg.lstsq(A[~bound], c[~bound], rcond=None)[0]
    return bool((c[bound] - A[bound] @ force).min(initial=0.0) < -1e-3)


def _not_the_weakest(A, f, least) -> bool:
    """Is it another drive than that of the smallest torque that asks for the most prestress to reach `least`?"""
    c, n = smallest(A, f), null_basis(A)[:, 0]
    return int(np.argmin(c)) != int(np.argmax((least - c) / n))


def off_the_force(got, A, f, least) -> tuple[float, str]:
    return float(np.abs(A.T @ got - f).max()), "difference from the force f (N)"


def smallest(A, f) -> np.ndarray:
    return weighted_pseudoinverse(A) @ f


class Choosing(Law):
    """Computed torque in end-effector coordinates whose torques are chosen anew by a function of A and the force."""

    law = CTC(400.0, 40.0, independent=None)

    def __init__(self, choose):
        self.choose = choose

    def step(self, memory, sample):
        q, qd = sample.pose()
        c = self.law.torque(sample.model, q, qd, sample.q_a, sample.qd_a, sample.desired)
        A = control_matrix(sample.model, q)
        return self.choose(A, A.T @ c), memory


@functools.cache
def carriage():
    """The testbed with 0.7 kg at the end-effector, and its way up and down in 3.5 s."""
    robot = load().replace(friction=0.0, load=0.7)
    return robot, polygon(robot, [[0.0, -0.06], [0.0, 0.06]], duration=3.5, dt=5e-3)


@functools.cache
def probes() -> list[tuple]:
    """Control matrices and forces of the desired motion, every quarter of a second."""
    robot, path = carriage()
    A, f = control_matrix(robot, path.q), required_wrench(robot, path.q, path.qd, path.qdd)
    return [(A[k], f[k]) for k in range(25, len(path), 50)]


def chosen(answer, A, f) -> np.ndarray:
    """The torques (3,) that a student's function chooses."""
    return fitting(numbers(given(answer, (A, f))), (3,))


def carried(answer) -> list[Measured]:
    """A run of the carriage: what its drives give at most and at least, their heat, and the error of the path."""
    robot, path = carriage()
    for A, f in probes()[:2]:
        if np.abs(A.T @ chosen(answer, A, f) - f).max() > 0.5 * np.abs(f).max():
            raise Ended("wrong", "A^T c misses f by more than half of its largest component", "another force")
    run = simulate(robot, Choosing(lambda A, f: chosen(answer, A, f)), path)
    one_way = np.maximum(run.c.min(axis=0), (-run.c).min(axis=0)).min()
    error = np.linalg.norm(run.x - path.x, axis=-1).max()
    # A torque of zero comes as -0.0, which would read as a change of sign.
    most, least = (round(1e3 * float(torque), 6) + 0.0 for torque in (np.abs(run.c).max(), one_way))
    changes = "smallest torque (negative: a drive changes its sign)"
    return [
        Measured("largest torque", most, "mN m", 1e3 * LIMIT),
        Measured(changes, least, "mN m", 1e3 * LEAST, at_most=False),
        Measured("heat", float(copper_loss(robot, run.c[:-1], run.dt).sum()), "J", HEAT),
        Measured("largest error", 1e3 * float(error), "mm", 1e3 * ERROR),
    ]


def quiet_gears(A, f) -> np.ndarray:
    """The least prestress on top of the smallest torques that leaves each drive a margin above LEAST."""
    c, n = smallest(A, f), null_basis(A)[:, 0]
    return c + np.max((1.2 * LEAST - c) / n) * n


def without_prestress(answer) -> bool:
    return all(np.allclose(chosen(answer, A, f), smallest(A, f), atol=1e-6) for A, f in probes())


def with_a_constant_one(answer) -> bool:
    """The share along n is the same all the way, and pulls to the dear side, where the worst moment is too much."""
    share = [null_basis(A)[:, 0] @ chosen(answer, A, f) for A, f in probes()]
    return not without_prestress(answer) and float(np.ptp(share)) < 1e-5 and float(share[0]) > 0.0


def changes_its_side(answer) -> bool:
    """The prestress is along n at some poses and against it at others."""
    share = [null_basis(A)[:, 0] @ chosen(answer, A, f) for A, f in probes()]
    return not another_force(answer) and bool(min(share) < -1e-4 and max(share) > 1e-4)


def another_force(answer) -> bool:
    return any(np.abs(A.T @ chosen(answer, A, f) - f).max() > 1e-3 * np.abs(f).max() for A, f in probes())
