"""Exercises of lesson 03: rest pose, springs in series, offsets that nobody sees, and the logs."""

from __future__ import annotations

import numpy as np

from ...mechanics.antagonism import steady_state_error
from ..checker import Exercise
from . import tasks
from .readings import READINGS


def _mu(weight):
    """Torques along eta with one part of mu done otherwise; weight(eta, gains) stands for the sum of compliances."""
    return lambda eta, gains, offset: -eta * (eta @ offset) / weight(eta, gains)


EXERCISES = {
    "03.rest_error": Exercise(
        steady_state_error,
        hints=(
            "Which errors can the joints take at all while the loops stay closed? And what must the torques not do?",
            "Write e = A xi and put it into (13): A^T K_P (A xi + offset) = 0 are two equations for two numbers.",
            "xi = -np.linalg.solve(A.T @ K_P @ A, A.T @ K_P @ offset), then A @ xi.",
        ),
        unit="rad",
        cases=tasks.rest_cases,
        invariant=tasks.unbalanced,
        tolerance=1e-9,
        close=0.09,
        improve="the two equations are linear: solve them instead of minimizing or simulating",
        mistakes={
            "this is the printed (14) with A^T put in: right for equal gains only, it tears the loops": (
                lambda A, K, o: -np.linalg.solve(K, A @ np.linalg.pinv(A) @ K @ o)
            ),
            "this is minus the offset: two drives could follow their encoders, three have to agree": lambda A, K, o: -o,
            "the gains are forgotten (a factor K_P is missing): all drives count the same": (
                lambda A, K, o: -A @ np.linalg.pinv(A) @ o
            ),
            "these are the two numbers xi in m; the factor A is missing, e = A xi": (
                lambda A, K, o: -np.linalg.solve(A.T @ K @ A, A.T @ K @ o)
            ),
            "this is the measured error e + offset; the true one is wanted": (
                lambda A, K, o: steady_state_error(A, K, o) + o
            ),
            "these are the torques at rest, not the errors": lambda A, K, o: -K @ (steady_state_error(A, K, o) + o),
            "the gains are inverted: the softest drive counts most": (
                lambda A, K, o: steady_state_error(A, np.linalg.inv(K), o)
            ),
            "the stiffness A^T K_P A is missing: the force is not yet divided by it": (
                lambda A, K, o: -A @ (A.T @ K @ o)
            ),
            "K_P is missing in the stiffness: A^T A instead of A^T K_P A": (
                lambda A, K, o: -A @ np.linalg.solve(A.T @ A, A.T @ K @ o)
            ),
            "K_P is missing on the right-hand side: A^T offset instead of A^T K_P offset": (
                lambda A, K, o: -A @ np.linalg.solve(A.T @ K @ A, A.T @ o)
            ),
            "the gains are squared": lambda A, K, o: steady_state_error(A, K @ K, o),
            "only the diagonal of K_P is used": lambda A, K, o: steady_state_error(A, np.diag(np.diag(K)), o),
            "this is the force -A^T K_P offset at the end-effector, not the error": lambda A, K, o: -A.T @ K @ o,
        },
    ),
    "03.fight": Exercise(
        tasks.fight,
        hints=(
            "All three torques hang on one number mu. Which condition is still unused?",
            "The error that the law needs, -c / K - offset, must leave the loops closed: eta times it is zero. Put in "
            "c = mu eta.",
            "mu = -(eta @ offset) / np.sum(eta**2 / gains), then mu * eta.",
        ),
        unit="N m",
        cases=tasks.fight_cases,
        invariant=tasks.open_chain,
        tolerance=1e-9,
        close=0.05,
        improve="the condition is linear in mu: solve it by hand",
        mistakes={
            "each drive multiplies its own part of the offset by its own gain: these torques are not along eta": (
                lambda eta, gains, offset: -gains * eta * (eta @ offset)
            ),
            "this is right for equal gains only: the mean of the gains stands for the springs in series": (
                lambda eta, gains, offset: -gains.mean() * eta * (eta @ offset)
            ),
            "the stiffnesses are added, as for springs in parallel; in series the compliances add": (
                lambda eta, gains, offset: -eta * (eta @ offset) * np.sum(eta**2 * gains)
            ),
            "eta is missing in the sum of compliances: each one counts with eta_i^2": _mu(lambda n, k: np.sum(1 / k)),
            "the mean compliance is used; each one counts with eta_i^2": _mu(lambda n, k: np.mean(1 / k)),
            "eta is not squared in the sum of compliances": _mu(lambda n, k: np.sum(n / k)),
            "eta is not squared in the sum of compliances, only its size": _mu(lambda n, k: np.sum(np.abs(n) / k)),
            "only the softest drive is counted; the others give way too": (_mu(lambda n, k: 1 / k.min())),
            "only the drive with the largest compliance is counted; the others give way too": (
                _mu(lambda n, k: np.max(n**2 / k))
            ),
            "only the first gain is used: right for equal gains only": _mu(lambda n, k: 1 / k[0]),
            "this is the number mu alone; the factor eta is missing, c = mu eta": (
                lambda eta, gains, offset: -(eta @ offset) / np.sum(eta**2 / gains)
            ),
            "the whole torque K (offset) is given: only its part along eta is held at rest": (
                lambda eta, gains, offset: -gains * offset
            ),
            "the torques K (offset) are projected onto eta: the filter's complement, not the equilibrium": (
                lambda eta, gains, offset: -eta * (eta @ (gains * offset))
            ),
            "this is the error at rest in rad, not the torques": (
                lambda eta, gains, offset: -tasks.fight(eta, gains, offset) / gains - offset
            ),
            "the gains are inverted: compliances where gains belong": (
                lambda eta, gains, offset: -eta * (eta @ offset) / np.sum(eta**2 * gains)
            ),
            "the gains are forgotten (a factor is missing): this is the part of the offset along eta": (
                lambda eta, gains, offset: -eta * (eta @ offset)
            ),
            "the tangent part of the offset is used (the complement): it is the normal part that fights": (
                lambda eta, gains, offset: -gains * (offset - eta * (eta @ offset))
            ),
        },
    ),
    "03.unseen_offsets": Exercise(
        tasks.unseen_offsets,
        hints=(
            "What would all three encoders show if the machine simply stood 2 mm beside the place?",
            "Offsets that agree with each other have the form A xi, with A from rk.control_matrix at the pose, and "
            "-xi is the shift in m. Mind that the real shift is not exactly the one of the first-order theory.",
            "A = rk.control_matrix(robot, rk.inverse_kinematics(robot, x)); return A @ np.array([0.0, 2.2e-3]).",
        ),
        unit="rad",
        judge=tasks.betrayal,
        close=0.05,
        improve="leave some room: the first-order theory is about half a per cent off at this size",
        points=10.0,
        mistakes={
            "no offsets at all: nothing is seen, and nothing is shifted": lambda f: not np.any(tasks.asked(f)[0]),
            "these offsets point along eta: this is the part that fights, not the one that shifts": tasks.along_eta,
            "the offsets are 1000 times too large: units, mrad given for rad or mm for m": tasks.unseen_times(1e-3),
            "the offsets are 1000 times too small (units)": tasks.unseen_times(1e3),
            "the offsets are the same at every place: A turns with the pose, take that at x": tasks.alike_everywhere,
        },
    ),
} | READINGS
