"""Exercises of lesson 03: steady state under PD control, series springs, encoder counts, hidden offsets and gains."""

from __future__ import annotations

import numpy as np

from ...machine.logs import mystery_run
from ...machine.manipulator import load
from ...mechanics.actuation import control_matrix
from ...mechanics.antagonism import null_vector, steady_state_error, steady_state_torque
from ...mechanics.closure import estimate_pose
from ...mechanics.kinematics import inverse_kinematics
from ..checker import Exercise
from ..mystery import hidden


def _poses(rng, count: int = 5):
    """Control matrices in end-effector coordinates, null vectors, unequal gains and offsets at random poses."""
    robot = load()
    for _ in range(count):
        q = inverse_kinematics(robot, rng.uniform(-0.08, 0.08, 2))
        yield control_matrix(robot, q), null_vector(robot, q), rng.uniform(2.0, 20.0, 3), rng.uniform(-8e-3, 8e-3, 3)


def _rest_cases(rng):
    return [(A, np.diag(gains), offset) for A, _, gains, offset in _poses(rng)]


def _unbalanced(e, A, K_P, offset):
    """Force A^T c of the PD torques and the part of the error that breaks the loops, both as angles."""
    force = A.T @ K_P @ (e + offset) / np.max(K_P) / np.max(np.abs(A))
    torn = e - A @ np.linalg.lstsq(A, e, rcond=None)[0]
    return max(np.max(np.abs(force)), np.max(np.abs(torn))), "force A^T K_P (e + offset) or loop gap, rad"


def _fight_cases(rng):
    return [(n, gains, offset) for _, n, gains, offset in _poses(rng)]


def _fight(n, gains, offset):
    """The rest torques by way of (14): any A whose columns span the plane normal to n gives the same."""
    A = np.linalg.svd(n[:, None])[0][:, 1:]
    return steady_state_torque(A, gains, offset)


def _open_chain(c, n, gains, offset):
    """Stretches c / k and offsets of the springs in series must close: n.(c / k + offset) = 0."""
    return abs(n @ (c / gains + offset)), "gap eta.(c / K + offset) of the springs in series, rad"


def _rests(name: str):
    """Null vector, mean error and mean torque in the second half of each rest of a log."""
    robot, log = load(), mystery_run(name)
    for start in (0.7, 3.7, 6.7):
        now = (log.t > start) & (log.t < start + 0.8)
        n = null_vector(robot, estimate_pose(robot, log.q_a_desired[now][0], [0.0, 0.0]))
        yield n, log.error[now].mean(axis=0), log.c[now].mean(axis=0)


def _unexplained_torque(offset):
    """Largest difference between the rest torques of the log and those the offsets cause, as an angle."""
    worst = max(np.max(np.abs(c / 7.05 + n * (n @ offset))) for n, _, c in _rests("offset_a"))
    return worst, "rest torques of the log that the offsets leave unexplained, over K_P, in rad"


def _unexplained_gain(gains):
    """Largest torque of a rest that the gains leave unexplained, as a gain at the mean error of that drive."""
    errors, torques = (np.array(v) for v in zip(*[(e, c) for _, e, c in _rests("gain")], strict=True))
    left = torques + errors * gains
    worst = np.max(np.abs(left).max(axis=0) / np.abs(errors).max(axis=0))
    return worst, "rest torques of the log that the gains leave unexplained, over the error, in N m/rad"


EXERCISES = {
    "03.rest_error": Exercise(
        steady_state_error,
        "solve the two equations A^T K_P (A xi + offset) = 0 for the shift xi, then e = A xi",
        "rad",
        _rest_cases,
        _unbalanced,
        1e-9,
    ),
    "03.fight": Exercise(
        _fight,
        "c = mu eta; the errors -c / K - offset must lie in the tangent plane, so eta times them is zero",
        "N m",
        _fight_cases,
        _open_chain,
        1e-9,
    ),
    "03.counts": Exercise(
        lambda K_P, friction: np.pi * K_P / friction,
        "one step of the torque is K_P 2 pi / counts, and it must fit into the friction band from -f_c to f_c",
        "counts",
        lambda rng: [
            (float(k), float(f)) for k, f in zip(rng.uniform(1, 20, 4), rng.uniform(1e-3, 1e-2, 4), strict=True)
        ],
        lambda counts, K_P, friction: (
            abs(K_P * 2 * np.pi / counts - 2 * friction),
            "difference of the torque step from 2 f_c, in N m",
        ),
        1e-8,
    ),
    "03.offsets": Exercise(
        lambda: hidden("offset_a")[0],
        "each rest gives one equation eta.offset = -eta.c / k_P; three rests, three unknowns",
        "rad",
        invariant=_unexplained_torque,
        tolerance=3e-4,
        secret=True,
    ),
    "03.gains": Exercise(
        lambda: hidden("gain")[1],
        "at rest c_i = -K_i times (measured minus desired): a straight line through the origin for each drive",
        "N m/rad",
        invariant=_unexplained_gain,
        tolerance=0.2,
        secret=True,
    ),
}
