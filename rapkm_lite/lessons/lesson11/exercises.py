"""Exercises of lesson 11: how fast springs make the machine, what a wrong model costs, what a gain of
driven joints is worth, one law for three duties."""

from __future__ import annotations

import numpy as np

from ...control.computed_torque import CTC
from ...mechanics.actuation import control_matrix
from ...mechanics.dynamics import mass_matrix, minimal_dynamics
from ..checker import Exercise
from . import tasks
from .bandwidth import GAIN_FOR_BANDWIDTH


def _frequencies(matrix) -> np.ndarray:
    """Frequencies in Hz from the eigenvalues of a matrix (2, 2)."""
    return np.sqrt(np.abs(np.sort(np.real(np.linalg.eigvals(matrix))))) / (2 * np.pi)


def _taken_for_symmetric(robot, q, K_P) -> np.ndarray:
    G, A = _terms(robot, q)
    values = np.linalg.eigvalsh(np.linalg.solve(G, A.T @ (K_P[:, None] * A)))
    return np.sqrt(np.abs(values)) / (2 * np.pi)


def _singular(robot, q, K_P) -> np.ndarray:
    G, A = _terms(robot, q)
    return np.sqrt(np.linalg.svd(np.linalg.solve(G, A.T @ (K_P[:, None] * A)))[1][::-1]) / (2 * np.pi)


def _uncoupled(robot, q, K_P) -> np.ndarray:
    G, A = _terms(robot, q)
    return np.sqrt(np.sort(np.diag(A.T @ (K_P[:, None] * A)) / np.diag(G))) / (2 * np.pi)


def _terms(robot, q):
    return minimal_dynamics(robot, q, 0 * q, None)[0], control_matrix(robot, q)


def _own_inertia(robot, model, q, qd, xd, xdd, K_P):
    """The error where the force that the model misses is divided by the machine's own inertia."""
    G = minimal_dynamics(robot, q, qd, None)[0]
    return np.linalg.solve(G, _force(robot, model, q, qd, xd, xdd, K_P)[..., None])[..., 0] / K_P


def _with(G=1.0, C=1.0, Q=1.0):
    """The error where the acceleration, the velocity or the other forces that the model misses have these factors."""

    def made(robot, model, q, qd, xd, xdd, K_P):
        still = tasks.model_error(robot, model, q, qd, 0 * xd, 0 * xdd, K_P)
        return tasks.model_error(robot, model, q, qd, C * xd, G * xdd, K_P) + (Q - 1) * still

    return made


def _transposed(robot, model, q, qd, xd, xdd, K_P):
    """The error where C is multiplied from the left, xd^T C."""
    G, C_model, _ = minimal_dynamics(model, q, qd, None)
    turned = np.einsum("kji,kj->ki", C_model - minimal_dynamics(robot, q, qd, None)[1], xd)
    rest = tasks.model_error(robot, model, q, qd, 0 * xd, xdd, K_P)
    return rest + np.linalg.solve(G, turned[..., None])[..., 0] / K_P


def _force(robot, model, q, qd, xd, xdd, K_P):
    """The force that the model misses."""
    G = minimal_dynamics(model, q, qd, None)[0]
    return np.einsum("kij,kj->ki", G, tasks.model_error(robot, model, q, qd, xd, xdd, K_P)) * K_P


EXERCISES = {
    "11.pd_frequencies": Exercise(
        tasks.pd_frequencies,
        hints=(
            "Springs at the drives, a mass: how stiff is that at the end-effector, and how heavy is the machine there?",
            "The drives turn by A dx, so the stiffness is A^T diag(K_P) A; the inertia in these coordinates is Gbar, "
            "from rk.minimal_dynamics(robot, q, 0 * q, None).",
            "w2 = np.real(np.linalg.eigvals(np.linalg.solve(G, A.T @ np.diag(K_P) @ A))); "
            "np.sqrt(np.sort(w2)) / (2 * np.pi)",
        ),
        unit="Hz",
        cases=tasks.frequency_cases,
        invariant=tasks.no_determinant,
        tolerance=1e-6,
        close=0.02,
        improve="solve the eigenvalue problem instead of timing a simulation",
        mistakes={
            "these are squares of frequencies: the root is missing": (
                lambda robot, q, K_P: (2 * np.pi * tasks.pd_frequencies(robot, q, K_P)) ** 2
            ),
            "these are the squares in Hz^2: the root is missing": (
                lambda robot, q, K_P: tasks.pd_frequencies(robot, q, K_P) ** 2
            ),
            "this is in rad/s; the factor 2 pi is missing (units)": (
                lambda robot, q, K_P: 2 * np.pi * tasks.pd_frequencies(robot, q, K_P)
            ),
            "/ 2 * np.pi multiplies by pi: brackets are missing around 2 * np.pi": (
                lambda robot, q, K_P: np.pi**2 * tasks.pd_frequencies(robot, q, K_P)
            ),
            "the higher one comes first: wrong order": lambda robot, q, K_P: tasks.pd_frequencies(robot, q, K_P)[::-1],
            "the inertia is missing: these are roots of stiffnesses": (
                lambda robot, q, K_P: _frequencies(_terms(robot, q)[1].T @ (K_P[:, None] * _terms(robot, q)[1]))
            ),
            "K_P is missing: A^T A is the stiffness of drives of 1 N m/rad": (
                lambda robot, q, K_P: tasks.pd_frequencies(robot, q, np.ones(robot.n_arms))
            ),
            "the gains are averaged: unequal gains turn and split the two modes": (
                lambda robot, q, K_P: tasks.pd_frequencies(robot, q, np.full(robot.n_arms, np.mean(K_P)))
            ),
            "eigvalsh takes the matrix for symmetric, which G^-1 A^T K_P A is not: np.linalg.eigvals": (
                _taken_for_symmetric
            ),
            "singular values are taken for eigenvalues: G^-1 A^T K_P A is not symmetric": _singular,
            "only the diagonals are kept: stiffness and inertia couple x and y": _uncoupled,
            "A is missing: each drive moves only its own proximal link then": (
                lambda robot, q, K_P: (
                    np.sqrt(np.sort(K_P / np.diag(mass_matrix(robot, q))[: robot.n_arms])[:2]) / (2 * np.pi)
                )
            ),
            "A is missing: these are the drives' own frequencies, each with the inertia of its arm": (
                lambda robot, q, K_P: np.sqrt(K_P / np.diag(mass_matrix(robot, q))[: robot.n_arms]) / (2 * np.pi)
            ),
            "stiffness and inertia are exchanged: the squares of frequencies are eigenvalues of G^-1 A^T K_P A": (
                lambda robot, q, K_P: 1 / (4 * np.pi**2 * tasks.pd_frequencies(robot, q, K_P)[::-1])
            ),
            "the inertia is multiplied instead of divided: it should be inverted": (
                lambda robot, q, K_P: _frequencies(
                    _terms(robot, q)[0] @ _terms(robot, q)[1].T @ (K_P[:, None] * _terms(robot, q)[1])
                )
            ),
        },
    ),
    "11.model_error": Exercise(
        tasks.model_error,
        hints=(
            "Write the force that the law gives, with its model, and the force that the motion takes. In a slow motion "
            "both are equal, and the only unknown is the error.",
            "The law asks its model for the acceleration xdd - K_P e; the machine takes G xdd + C xd + Q. What differs "
            "between the two has to be paid by K_P e, in accelerations of the model.",
            "G, C, Q and hats from rk.minimal_dynamics(..., None); e = solve(G_hat, (G_hat - G) xdd + (C_hat - C) xd + "
            "Q_hat - Q) / K_P, pose by pose.",
        ),
        unit="m",
        cases=tasks.error_cases,
        invariant=tasks.balance,
        tolerance=1e-9,
        close=1e-3,  # of what the velocity terms make
        improve="take the terms of both machines from rk.minimal_dynamics at the desired motion, without differences",
        mistakes={
            "robot and model are exchanged (the order of the arguments)": (
                lambda robot, model, *rest: tasks.model_error(model, robot, *rest)
            ),
            "the sign: with too little force the machine stays behind, true minus desired is asked for": (
                lambda *case: -tasks.model_error(*case)
            ),
            "the gain K_P is missing: these are accelerations": lambda *case: case[-1] * tasks.model_error(*case),
            "the machine's own inertia is inverted; the law multiplies with that of its model": _own_inertia,
            "the velocity terms C xd are missing": _with(C=0.0),
            "C is transposed: it is C xd, not xd^T C": _transposed,
            "friction and gravity (Q) are missing": _with(Q=0.0),
            "the acceleration is missing: an unknown mass matters where the motion accelerates": _with(G=0.0),
            "the sign of the velocity terms is opposite: (C_hat - C) xd": _with(C=-1.0),
            "the sign of friction and gravity is opposite: Q_hat - Q": _with(Q=-1.0),
            "the sign of the acceleration terms is opposite: (G_hat - G) xdd": _with(G=-1.0),
            "the signs of velocity terms, friction and gravity are opposite: (C_hat - C) xd + Q_hat - Q": (
                _with(C=-1.0, Q=-1.0)
            ),
            "these are forces in N, before the inertia is divided out": _force,
            "the inertia is not divided out: these are forces over K_P": lambda *case: _force(*case) / case[-1],
        },
    ),
    "11.gain_for_bandwidth": GAIN_FOR_BANDWIDTH,
    "11.one_law": Exercise(
        lambda robot: CTC((4.4 * np.pi) ** 2, 8.8 * np.pi, None),
        hints=(
            "Which of the four numbers falls when the loop gets faster, and which rises? Which kind of law misses one "
            "of them at every speed?",
            "The payload asks for speed, the coarse encoders for a slow loop: look between 1.5 and 3 Hz. Jumps rule "
            "out one kind of law, the missing feed-forward another.",
            "w = 2 * np.pi * 2.2; return rk.CTC(w**2, 2 * w, None)",
        ),
        judge=tasks.three_duties,
        close=0.04,
        improve="change the frequency of the loop by a tenth: up if the error with the payload is too large, else down",
        points=10.0,
        mistakes={
            "a law that switches its pair: wherever it does, its torques jump, whatever the gains": (
                lambda answer: tasks.is_kind(answer, "SwitchedCTC")
            ),
            "PD alone knows nothing of the inertia: what is fast enough for the error is too fast for these encoders; "
            "a feed-forward of the torques is missing": lambda answer: tasks.is_kind(answer, "PD"),
        },
    ),
}
