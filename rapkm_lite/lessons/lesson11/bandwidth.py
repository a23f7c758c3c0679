"""Exercise of lesson 11 on what a gain of the driven joints is worth."""

from __future__ import annotations

import numpy as np

from ...control.stability import effective_gain
from ...machine.manipulator import load
from ...mechanics.dynamics import mass_matrix, nullspace_projector, orthogonal_complement
from ...mechanics.kinematics import inverse_kinematics
from ..checker import Case, Exercise

_MACHINES = {"three equal arms": "testbed", "unequal arms": "asymmetric", "four arms": "four_arms"}


def _driven(robot) -> np.ndarray:
    return np.diag(np.repeat([1.0, 0.0], robot.n_arms))


def _shares(robot, q) -> np.ndarray:
    return np.real(np.linalg.eigvals(effective_gain(orthogonal_complement(robot, q), _driven(robot))))


def gain_for_bandwidth(robot, q, omega: float) -> float:
    """Gain K_P (1/s^2) of the driven joints alone whose slowest direction at the poses q (k, 2N) reaches omega^2."""
    return omega**2 / _shares(robot, q).min()


def _somewhere(robot, rng) -> np.ndarray:
    return inverse_kinematics(robot, rng.uniform(-0.06, 0.06, (6, 2)))


def _bandwidths(rng) -> list[tuple]:
    return [
        Case(words, robot, _somewhere(robot, rng), float(omega), beyond=robot.n_arms > 3)
        for words, robot in ((words, load(file)) for words, file in _MACHINES.items())
        for omega in rng.uniform(5.0, 40.0, 2)
    ]


def _slowest(K, robot, q, omega) -> tuple[float, str]:
    """N_J I_a N_J has the eigenvalues of the effective gain and zeros, without any choice of q2."""
    N_J = nullspace_projector(robot, q)
    slow = float(K) * np.linalg.eigvalsh(N_J[..., : robot.n_arms] @ N_J[..., : robot.n_arms, :])[..., -2].min()
    return abs(slow - omega**2), "the slowest direction along these poses misses omega^2, in 1/s^2, by"


def _printed_gain(independent):
    """(35) as printed, without (F^T F)^-1, in one choice of q2."""

    def wrong(robot, q, omega):
        F = orthogonal_complement(robot, q, independent)
        return omega**2 / np.linalg.eigvalsh(F.mT @ _driven(robot) @ F).min()

    return wrong


def _line_2(robot, q, omega):
    F, G = orthogonal_complement(robot, q), mass_matrix(robot, q)
    gain = np.linalg.solve(F.mT @ G @ F, F.mT @ G @ _driven(robot) @ F)
    return omega**2 / np.min(np.real(np.linalg.eigvals(gain)))


def _singular_value(robot, q, omega):
    gain = effective_gain(orthogonal_complement(robot, q), _driven(robot))
    return omega**2 / np.linalg.svd(gain, compute_uv=False).min()


GAIN_FOR_BANDWIDTH = Exercise(
    gain_for_bandwidth,
    hints=(
        "The corrected (35) says which share of a gain acts. Which pose and which direction decide?",
        "rk.effective_gain of the matrix that selects the driven joints, at every pose; its smallest eigenvalue "
        "over all of them is the share that is left of K_P.",
        "K_P times the smallest eigenvalue is omega^2: omega**2 / np.min(np.real(np.linalg.eigvals(gain))).",
    ),
    unit="1/s^2",
    cases=_bandwidths,
    invariant=_slowest,
    tolerance=1e-6,
    close=1e-3,
    improve="take the eigenvalue itself instead of searching for the gain",
    mistakes={
        "the largest share is taken: this makes the fastest direction right; the smallest one is wanted": (
            lambda robot, q, omega: omega**2 / _shares(robot, q).max()
        ),
        "the natural frequency goes with the square root of the gain: omega must be squared (a factor omega)": (
            lambda robot, q, omega: omega / _shares(robot, q).min()
        ),
        "the share multiplies the gain, so omega^2 must be divided by it": (
            lambda robot, q, omega: omega**2 * _shares(robot, q).min()
        ),
        "only the first pose counts here; the slowest of all poses is wanted": (
            lambda robot, q, omega: omega**2 / _shares(robot, q[0]).min()
        ),
        "the mean over the poses is taken; the slowest of all is wanted": (
            lambda robot, q, omega: omega**2 / _shares(robot, q).min(axis=1).mean()
        ),
        "the mean of both directions is taken; the slow one is wanted": (
            lambda robot, q, omega: omega**2 / _shares(robot, q).mean(axis=1).min()
        ),
        "the fast direction of the worst pose is taken; the slow one is wanted": (
            lambda robot, q, omega: omega**2 / _shares(robot, q).max(axis=1).min()
        ),
        "this is omega^2, as for a gain on all joints, of which only a share acts on the driven ones; (35) as printed, "
        "without (F^T F)^-1, says the same for three arms in the angles of a pair": (lambda robot, q, omega: omega**2),
        "the factor (F^T F)^-1 is missing, as in the printed (35): the result depends on the coordinates": (
            _printed_gain(None)
        ),
        "the factor (F^T F)^-1 is missing, as in the printed (35), here in the angles of drives 1 and 2": (
            _printed_gain((0, 1))
        ),
        "this is the gain of line 2 of (32), with the mass matrix between": _line_2,
        "singular values are taken for eigenvalues: those of the effective gain depend on the coordinates": (
            _singular_value
        ),
        "the passive joints are selected, the complement of the driven ones": (
            lambda robot, q, omega: omega**2 / (1 - _shares(robot, q)).min()
        ),
        "3/7 is the share at the centroid of the testbed; it changes with the pose and the machine": (
            lambda robot, q, omega: omega**2 * 7 / 3
        ),
        "this is the natural frequency that omega^2 would leave, not the gain": (
            lambda robot, q, omega: omega * np.sqrt(_shares(robot, q).min())
        ),
    },
)
