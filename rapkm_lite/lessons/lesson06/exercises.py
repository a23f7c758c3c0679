"""Exercises of lesson 06: the energy landscape."""

from __future__ import annotations

from functools import cache

import numpy as np

from ...machine.manipulator import load
from ...mechanics.trajectory import circle, polygon, triangle
from ...simulation.energy import antagonism_form
from ..checker import Exercise


def _paths(rng) -> list[tuple]:
    """A few machines, paths and gains."""
    robot = load().replace(friction=0.0)
    corners = rng.uniform(-0.06, 0.06, (3, 2))
    return [
        (robot, circle(robot, 0.05, dt=5e-3), 7.05),
        (robot, polygon(robot, corners, dt=5e-3), rng.uniform(2, 9)),
        (robot, triangle(robot, dt=5e-3), rng.uniform(2, 9)),
    ]


def uniform_form(robot, trajectory, K_P: float) -> np.ndarray:
    """The form for one gain for all drives, (N, N) in J/rad^2."""
    return antagonism_form(robot, trajectory, K_P)


def _trace(S, robot, trajectory, K_P):
    # The projector N_{A^T} has the trace m - delta at every instant.
    spare = robot.n_arms - 2
    expected = (K_P / robot.torque_constant[0]) ** 2 * robot.resistance[0] * spare * trajectory.t[-1]
    return abs(np.trace(S) / expected - 1), "the trace of S differs from (R_el/k_t²) k_P² (m - δ) T, relatively by"


def expected_cost(S, sigma) -> float:
    """Mean antagonistic energy in J for independent normal offsets of standard deviation sigma in rad."""
    return sigma**2 * np.trace(S)


def _forms(rng) -> list[tuple]:
    out = []
    for _ in range(5):
        M = rng.normal(size=(3, 3))
        out.append((1e4 * (M @ M.T + np.eye(3)), rng.uniform(1e-3, 6e-3)))
    return out


@cache
def _draws() -> np.ndarray:
    """Normal draws (200 000, 3), whitened: their covariance is exactly the identity."""
    draws = np.random.default_rng(7).normal(size=(200_000, 3))
    draws -= draws.mean(axis=0)
    return draws @ np.linalg.inv(np.linalg.cholesky(np.cov(draws.T, bias=True))).T


def _sampled(mean, S, sigma):
    offsets = sigma * _draws()
    sample = np.sum((offsets @ S) * offsets, axis=-1).mean()
    return abs(mean / sample - 1), "relative difference from the mean over 200 000 draws"


def cheapest_offsets(S, size: float) -> float:
    """Smallest antagonistic energy in J of any offsets with the Euclidean norm `size` in rad."""
    return size**2 * np.linalg.eigvalsh(S)[0]


def _no_cheaper(cost, S, size):
    draws = np.random.default_rng(8).normal(size=(4000, 3))
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
        hint="N = I - A (A^T A)^-1 A^T at every sample; sum k_P² (R_el/k_t²) N over the holds, times dt",
    ),
    "06.expected_cost": Exercise(
        expected_cost,
        cases=_forms,
        invariant=_sampled,
        tolerance=1e-9,
        unit="J",
        hint="the mean of dq^T S dq is the sum of S_ij times the covariance of dq_i and dq_j",
    ),
    "06.cheapest_offsets": Exercise(
        cheapest_offsets,
        cases=_forms,
        invariant=_no_cheaper,
        tolerance=1e-9,
        unit="J",
        hint="dq^T S dq at a fixed norm is smallest along an eigenvector of S; which one?",
    ),
}
