"""Runs of any mechanism under sampled laws, side by side: torques are held for one period, Runge-Kutta in between."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...machine.arguments import matvec
from ...mechanics import cores
from ...simulation.energy import joule_heat, work_of_holds
from ...simulation.patience import progress
from .mechanism import Mechanism, accelerations


@dataclass(frozen=True)
class Reading:
    """What a law knows at a sample.

    q_a, qd_a : (m,) angles and rates of the drives, as measured.
    q, qd : (n,) all joints as measured: the passive ones have encoders of their own, without offset.
    fit : (n,) the closed pose that fits q_a best, for machines that have encoders at the drives only.
    q_d, qd_d, qdd_d : (n,) what is wanted.
    """

    q_a: np.ndarray
    qd_a: np.ndarray
    q: np.ndarray
    qd: np.ndarray
    fit: np.ndarray
    q_d: np.ndarray
    qd_d: np.ndarray
    qdd_d: np.ndarray


def run(mechanism: Mechanism, laws: list, motion, offset) -> tuple[np.ndarray, np.ndarray]:
    """q (laws, k, n) and held torques c (laws, k, m) in N m: one run for each law, from rest at the start of a motion.

    laws : functions Reading -> c (m,).  motion : t (k,), q, qd, qdd (k, n).  offset : (m,) in rad, what the encoders of
    the drives add.
    """
    m, dt = mechanism.m, motion.t[1] - motion.t[0]
    q = np.tile(motion.q[0], (len(laws), 1))
    qd, fit = np.zeros_like(q), q
    all_q, all_c = [], []
    for k in progress(range(len(motion.t))):
        wanted = motion.q[k], motion.qd[k], motion.qdd[k]
        measured = q.copy()
        measured[:, :m] += offset
        fit = _fit(mechanism, measured[:, :m], fit)
        rows = zip(measured[:, :m], qd[:, :m], measured, qd, fit, strict=True)
        c = np.stack([law(Reading(*row, *wanted)) for law, row in zip(laws, rows, strict=True)])
        all_q.append(q)
        all_c.append(c)
        q, qd = _hold(mechanism, q, qd, c, dt)
    return np.stack(all_q, axis=1), np.stack(all_c, axis=1)


def electric_energy(q, c, dt: float, resistance: float, torque_constant: float) -> np.ndarray:
    """Energy (...,) in J of all drives, regenerative: R (c / k_t)^2 dt plus the work c dq_a, over the holds of a run.

    >>> float(electric_energy(np.zeros((3, 1)), np.ones((3, 1)), 0.5, 2.0, 1.0))
    2.0
    """
    heat = joule_heat(c[..., :-1, :], dt, resistance, torque_constant)
    return np.sum(heat + work_of_holds(c, q[..., : c.shape[-1]]), axis=(-2, -1))


def _fit(mechanism: Mechanism, q_a, guess) -> np.ndarray:
    """Closed poses (..., n) near the last ones that fit q_a (..., m) best: one step of Gauss-Newton."""
    J = mechanism.J(guess)
    N = cores.projector(*cores.row_space(J, 1.0))
    q = guess + matvec(np.linalg.pinv(N[..., : mechanism.m, :], rcond=1e-9), q_a - guess[..., : mechanism.m])
    return q - matvec(J.mT, np.linalg.solve(J @ J.mT, mechanism.h(q)[..., None])[..., 0])


def _hold(mechanism: Mechanism, q, qd, c, dt: float) -> tuple[np.ndarray, np.ndarray]:
    """State after the time dt under held torques, by one step of Runge and Kutta."""

    def slope(q, qd):
        return qd, accelerations(mechanism, q, qd, c)

    v1, a1 = slope(q, qd)
    v2, a2 = slope(q + dt / 2 * v1, qd + dt / 2 * a1)
    v3, a3 = slope(q + dt / 2 * v2, qd + dt / 2 * a2)
    v4, a4 = slope(q + dt * v3, qd + dt * a3)
    return q + dt / 6 * (v1 + 2 * v2 + 2 * v3 + v4), qd + dt / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
