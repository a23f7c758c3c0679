"""Exercises of lesson 06: the energy landscape."""

from __future__ import annotations

from functools import cache

import numpy as np

from ...machine.manipulator import Manipulator, load
from ...mechanics.trajectory import Trajectory, circle, follow, polygon, triangle
from ...simulation.energy import antagonism_form
from ..checker import Case, Exercise
from . import mistakes, places


def _four_arms() -> Manipulator:
    square = 0.25 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    return Manipulator(base=square, lengths=[0.25, 0.3], masses=[0.1, 0.2], resistance=1.2, torque_constant=0.04)


def _line(robot, start, end) -> Trajectory:
    """Straight on at one speed: first and last sample differ."""
    t, velocity = np.linspace(0.0, 1.0, 101), end - start
    return follow(robot, t, start + t[:, None] * velocity, np.tile(velocity, (101, 1)), np.zeros((101, 2)))


def _paths(rng) -> list[tuple]:
    """A few machines, paths and gains: other motors, unequal arms, four arms, samples of another length."""
    robot = load().replace(friction=0.0)
    corners = rng.uniform(-0.06, 0.06, (3, 2))
    unequal = robot.replace(lengths=[[0.2, 0.22], [0.23, 0.2], [0.21, 0.24]], resistance=0.9)
    return [
        Case("the testbed", robot, circle(robot, 0.05, dt=5e-3), 7.05),
        Case("the testbed", robot, polygon(robot, corners, dt=1e-2), rng.uniform(2, 9)),
        Case("unequal arms", unequal, triangle(unequal, side=0.1, duration=4.0, dt=5e-3), rng.uniform(2, 9)),
        Case("an open path", robot, _line(robot, *corners[:2]), rng.uniform(2, 9), beyond=True),
        Case("four arms", _four_arms(), circle(_four_arms(), 0.08, dt=5e-3), rng.uniform(2, 9)),
    ]


def uniform_form(robot, trajectory, K_P: float) -> np.ndarray:
    """The form for one gain for all drives, (N, N) in J/rad^2."""
    return antagonism_form(robot, trajectory, K_P)


def _trace(S, robot, trajectory, K_P):
    # The projector N_{A^T} has the trace m - delta at every instant.
    spare = robot.n_arms - 2
    expected = (K_P / robot.torque_constant[0]) ** 2 * robot.resistance[0] * spare * trajectory.t[-1]
    return abs(np.trace(S) / expected - 1), "relative difference of the trace of S from (R_el/k_t²) k_P² (m - δ) T"


def expected_cost(S, sigma_dq) -> float:
    """Mean antagonistic energy in J for independent normal offsets of standard deviation sigma_dq in rad."""
    return sigma_dq**2 * np.trace(S)


def _forms(rng) -> list[tuple]:
    """Forms of paths of three and of four drives, and a number in rad."""
    out = []
    for k in range(8):
        size = 3 + k // 4
        M = rng.normal(size=(size, size))
        S = 1e4 * (M @ M.T + np.eye(size))
        out.append(Case(f"{size} drives", S, rng.uniform(1e-3, 6e-3), beyond=size > 3))
    return out


@cache
def _draws(size: int) -> np.ndarray:
    """Normal draws (2000, size), whitened: their covariance is exactly the identity, and more draws tell no more."""
    draws = np.random.default_rng(7).normal(size=(2000, size))
    draws -= draws.mean(axis=0)
    return draws @ np.linalg.inv(np.linalg.cholesky(np.cov(draws.T, bias=True))).T


def _sampled(mean, S, sigma_dq):
    offsets = sigma_dq * _draws(len(S))
    sample = np.sum((offsets @ S) * offsets, axis=-1).mean()
    return abs(mean / sample - 1), "relative difference from the mean over 2000 draws"


def cheapest_offsets(S, size: float) -> float:
    """Smallest antagonistic energy in J of any offsets with the Euclidean norm `size` in rad."""
    return size**2 * np.linalg.eigvalsh(S)[0]


def _no_cheaper(cost, S, size):
    draws = np.random.default_rng(8).normal(size=(4000, len(S)))
    draws *= size / np.linalg.norm(draws, axis=1, keepdims=True)
    best = np.einsum("ki,ij,kj->k", draws, S, draws).min()
    return max(0.0, (cost - best) / best), "random offsets of that norm are cheaper, relatively by"


EXERCISES = {
    "06.form": Exercise(
        uniform_form,
        cases=_paths,
        invariant=_trace,
        tolerance=1e-6,
        unit="J/rad²",
        hints=(
            "An offset acts like a set-point that moves, -k_P dq in torques. The machine gives way until nothing is "
            "left that could move it. Which part of a torque vector does the filter of lesson 04 take away?",
            "K_0 = k_P N with the projector N = I - A (A^T A)^-1 A^T at every sample, and N^T N = N. The weight is "
            "R_el/k_t².",
            "sum over the samples but the last of (R_el/k_t²) k_P² N, times trajectory.dt; "
            "np.linalg.inv works on a stack of matrices.",
        ),
        close=2e-2,
        improve="sum the exact projector over the holds, all samples but the last, each times dt",
        mistakes=mistakes.FORMS,
    ),
    "06.expected_cost": Exercise(
        expected_cost,
        cases=_forms,
        invariant=_sampled,
        tolerance=1e-9,
        unit="J",
        hints=(
            "The mean of a sum is the sum of the means. Which products of two offsets does dq^T S dq hold?",
            "The mean of dq_i dq_j is sigma² for i = j and zero for independent offsets.",
            "sigma_dq**2 * np.trace(S)",
        ),
        close=0.05,
        near="this is as near as a mean over random draws; without them the mean of dq_i dq_j is known exactly",
        mistakes=mistakes.MEANS,
    ),
    "06.cheapest_offsets": Exercise(
        cheapest_offsets,
        cases=_forms,
        invariant=_no_cheaper,
        tolerance=1e-9,
        unit="J",
        hints=(
            "On a sphere of offsets, where is a quadratic form stationary? Remember the ellipses of the first picture.",
            "Along the eigenvectors of S, where the energy is the eigenvalue times the norm squared.",
            "size**2 * np.linalg.eigvalsh(S)[0]; eigvalsh sorts, np.linalg.eig does not.",
        ),
        close=0.03,
        improve="a search ends where it was told to; the smallest eigenvalue of S is exact",
        mistakes=mistakes.MINIMA,
    ),
    "06.placement": Exercise(
        places.placement,
        hints=(
            "The energy at one place follows from a form S, without a run. How many places do you have to try?",
            "Take the points of a grid where all three corners are reachable; for each of them the form of its "
            "triangle, and the energy offset @ S @ offset.",
            "spots[np.argmin([offset @ rk.antagonism_form(robot, rk.triangle(robot, side=0.08, centre=p, dt=0.05), "
            "7.05) @ offset for p in spots])]",
        ),
        judge=places.judge,
        close=0.02,
        improve="search more finely around the place that you found",
        mistakes=places.MISTAKES,
        points=10.0,
    ),
}
