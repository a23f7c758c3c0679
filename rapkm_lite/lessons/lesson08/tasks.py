"""What the exercises of lesson 08 are tried on: readings of a machine with offsets, places, and calibration drives."""

from __future__ import annotations

import functools

import numpy as np

from ...control.laws import PD
from ...machine.manipulator import load
from ...mechanics import cores
from ...mechanics.actuation import control_matrix
from ...mechanics.antagonism import null_basis
from ...mechanics.calibration import CalibrationError, calibrate
from ...mechanics.closure import estimate_pose
from ...mechanics.kinematics import forward_kinematics, inverse_kinematics, reachable
from ...mechanics.trajectory import Trajectory, circle
from ...simulation.runs import simulate
from ..answers import Ended, fitting, given, numbers
from ..checker import Case, Measured

DISC, COUNTS = 0.12, 2000
MOST_CONDITION, APART = 1.6, 0.02
LONGEST, STRONGEST, USUAL = 4.0, 0.2, 0.15e-3
OFFSETS = 1e-3 * np.array([[4, -2, 5], [-6, 3, 2], [1, 7, -4], [-3, -5, 6], [5, 4, -1]])


def ring(angle, radius) -> np.ndarray:
    """Places (k, 2) in m about the middle of the testbed, angle (k,) in degrees from the x axis."""
    angle = np.radians(angle)
    return np.asarray(radius)[..., None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def scattered(rng, count: int, radius: float) -> np.ndarray:
    """Places (count, 2) in m, evenly spread over a disc about the origin."""
    return ring(rng.uniform(0, 360, count), radius * np.sqrt(rng.uniform(0, 1, count)))


def counted(angles, counts: int = COUNTS) -> np.ndarray:
    """Angles in rad as an encoder of `counts` a turn gives them."""
    count = 2 * np.pi / counts
    return np.rint(angles / count) * count


def equations(robot, q_a, offset, guess) -> tuple[np.ndarray, np.ndarray]:
    """n^T (k, N - 2, N) and n^T (q_a - q_a(x)) (k, N - 2) at the poses x that fit the readings less the offset."""
    q = estimate_pose(robot, q_a - offset, guess)
    rows = null_basis(control_matrix(robot, q)).mT
    return rows, np.einsum("kij,kj->ki", rows, cores.wrap(q_a - q[:, : robot.n_arms]))


def self_calibrate(robot, q_a, guess) -> np.ndarray:
    """Offsets (N,) in rad from readings q_a (k, N) in rad; guess (k, 2) in m lies near the places."""
    return _repeated(robot, q_a, guess, 1.0)


def _repeated(robot, q_a, guess, sign) -> np.ndarray:
    offset = np.zeros(robot.n_arms)
    for _ in range(10):
        rows, gap = equations(robot, q_a, sign * offset, guess)
        offset = np.linalg.lstsq(rows.reshape(-1, robot.n_arms), gap.ravel(), rcond=None)[0]
    return offset


def corrected_the_wrong_way(robot, q_a, guess) -> np.ndarray:
    return _repeated(robot, q_a, guess, -1.0)


def left_over(robot, q_a, guess) -> np.ndarray:
    """What the best pose does not explain of each reading, (k, N) in rad."""
    return q_a - estimate_pose(robot, q_a, guess)[:, : robot.n_arms]


def of_one_place(robot, q_a, guess) -> np.ndarray:
    rows, gap = equations(robot, q_a[:1], 0.0, guess[:1])
    return np.linalg.pinv(rows[0]) @ gap[0]


def of_the_guess(robot, q_a, guess) -> np.ndarray:
    q = inverse_kinematics(robot, guess)
    rows, gap = null_basis(control_matrix(robot, q)).mT, q_a - q[:, : robot.n_arms]
    return np.linalg.lstsq(rows.reshape(-1, robot.n_arms), np.einsum("kij,kj->ki", rows, gap).ravel(), rcond=None)[0]


def reading_cases(rng) -> list[tuple]:
    cases = []
    machines = (("testbed", "the testbed"), ("asymmetric", "three different arms"), ("four_arms", "four drives"))
    for name, label in machines:
        robot = load(name)
        x = scattered(rng, 12, 0.08)
        q_a = inverse_kinematics(robot, x)[:, : robot.n_arms] + rng.normal(0, 5e-3, robot.n_arms)
        cases.append(Case(label, robot, q_a, x + rng.normal(0, 2e-3, x.shape), beyond=name == "four_arms"))
    return cases


def still_contradicts(got, robot, q_a, guess) -> tuple[float, str]:
    words = "less these offsets the readings still contradict each other, by rad"
    try:
        before, after = (float(np.abs(left_over(robot, q_a - offset, guess)).max()) for offset in (0.0, got))
        last = "this is the last correction only, to be added to the offsets before it (offset += step): "
        return after, last * bool(np.abs(got).max() < 0.1 * before) + words
    except ValueError:  # no pose is near
        return np.inf, "less these offsets the readings fit no pose"


def null_vectors(places) -> np.ndarray:
    """Unit null vectors of A^T of the testbed, (k, 3)."""
    return null_basis(control_matrix(load(), inverse_kinematics(load(), places)))[..., 0]


def best_places(robot) -> np.ndarray:
    """Six places (6, 2) in m: three pairs on the edge of the disc, where the null vectors differ most."""
    return ring([55, 65, 175, 185, 295, 305], DISC)


def chosen(answer) -> np.ndarray:
    """The six places that a student's function chooses."""
    return fitting(numbers(given(answer, (load(),))), (6, 2))


def known(answer) -> list[Measured]:
    """Six places against what is asked of them."""
    places = chosen(answer)
    far = np.linalg.norm(places, axis=-1).max()
    if far > 1.0:
        raise Ended("wrong", f"a place lies {far:.3g} m from the middle; places are given in m", "units")
    if not np.all(reachable(load(), places)):
        raise Ended("wrong", f"a place lies outside the workspace; the disc has a radius of {DISC:g} m", "outside")
    apart = np.linalg.norm(places[:, None] - places, axis=-1)[~np.eye(len(places), dtype=bool)].min()
    sigma = np.linalg.svd(null_vectors(places), compute_uv=False)
    return [
        Measured("farthest from the middle", 1e3 * far, "mm", 1e3 * DISC * (1 + 1e-9)),
        Measured("nearest two places", 1e3 * apart, "mm apart", 1e3 * APART, at_most=False),
        Measured("condition", sigma[0] / max(sigma[-1], 1e-12), "to 1", MOST_CONDITION),
    ]


def is_hexagon(answer) -> bool:
    """True for six places evenly on a circle about the middle."""
    places = chosen(answer)
    angle = np.sort(np.arctan2(places[:, 1], places[:, 0]))
    return bool(np.ptp(np.linalg.norm(places, axis=-1)) < 2e-3 and np.abs(np.diff(angle) - np.pi / 3).max() < 0.03)


def calibration_drive(robot) -> Trajectory:
    """A drive in the disc that shows the offsets: once around its edge."""
    return circle(robot, DISC, LONGEST)


def driven(answer) -> Trajectory:
    """The path that a student's function chooses."""
    path = given(answer, (load(),))
    if not isinstance(path, Trajectory):
        words = f"the answer is of type {type(path).__name__}; a path is wanted, like rk.triangle(robot)"
        raise Ended("wrong", words, "type")
    return path


@functools.lru_cache(maxsize=4)
def _found(path: Trajectory) -> tuple[float, float]:
    """Mean of the largest errors of the offsets in rad, largest torque in N m, of five runs with coarse encoders."""
    robot, errors, torque = load(), [], 0.0
    for offset in OFFSETS:
        run = simulate(robot, PD(7.05, 0.225), path, offset, encoder=COUNTS)
        seen = counted(run.q_a + offset)[:: max(len(path) // 1000, 1)]
        errors.append(np.abs(calibrate(robot, seen).offset - offset).max())
        torque = max(torque, float(np.abs(run.c).max()))
    return float(np.mean(errors)), torque


def shown(answer) -> list[Measured]:
    path, robot = driven(answer), load()
    # Set-points may lead elsewhere than the path that they come with.
    far = np.linalg.norm(forward_kinematics(robot, estimate_pose(robot, path.q_a, path.x)), axis=-1).max()
    limits = [
        Measured("duration", path.t[-1], "s", LONGEST * (1 + 1e-9)),
        Measured("farthest from the middle", 1e3 * far, "mm", 1e3 * DISC * (1 + 1e-9)),
    ]
    try:
        error, torque = _found(path)
    except CalibrationError as refused:
        return [*limits, Measured("combinations of the offsets that it shows", refused.rank, "of 3", 3, at_most=False)]
    return [
        *limits,
        Measured("largest torque", 1e3 * torque, "mN m", 1e3 * STRONGEST),
        Measured("error of the worst offset, mean of five machines", 1e3 * error, "mrad", 1e3 * USUAL),
    ]
