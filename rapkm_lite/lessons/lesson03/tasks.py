"""What the exercises of lesson 03 are tried on: the package's answers, seeded cases, logs, and laws of nature."""

from __future__ import annotations

import functools

import numpy as np

from ...control.laws import PD
from ...machine.logs import mystery_run
from ...machine.manipulator import load
from ...mechanics.actuation import control_matrix
from ...mechanics.antagonism import null_vector, steady_state_torque
from ...mechanics.closure import estimate_pose
from ...mechanics.kinematics import inverse_kinematics
from ...mechanics.trajectory import hold
from ...simulation.runs import simulate
from ..answers import Ended, Result, given, numbers
from ..checker import Case, Measured
from ..mystery import K_D, K_P

SHIFT, HELD, LARGEST = 2.0, 1.0, 20.0  # mm, mN m, mrad


def _matrix(robot, x, mode=None):
    return control_matrix(robot, inverse_kinematics(robot, x, mode))


def rest_cases(rng) -> list[tuple]:
    """A, K_P and offsets: unequal gains, gains that couple the drives, four drives, another mode."""
    robot, four = load(), load("four_arms")

    def gains(m):
        return np.diag(rng.uniform(2.0, 20.0, m))

    cases = []
    for x in rng.uniform(-0.08, 0.08, (5, 2)):
        cases.append(Case("the testbed", _matrix(robot, x), gains(3), rng.uniform(-8e-3, 8e-3, 3)))
    for x in rng.uniform(-0.08, 0.08, (2, 2)):
        cases.append(Case("four drives", _matrix(four, x), gains(4), rng.uniform(-8e-3, 8e-3, 4), beyond=True))
    mixed = 0.8 * rng.standard_normal((3, 3))
    coupled = gains(3) + mixed @ mixed.T
    offset, label = np.array([4e-3, -2e-3, 5e-3]), "gains that couple the drives"
    cases.append(Case(label, _matrix(robot, [0.03, 0.05]), coupled, offset, beyond=True))
    beside = robot.base[:2].mean(axis=0) + [0.05, 0.06]
    A = _matrix(robot, beside, (1, 1, -1))
    return [*cases, Case("another working mode", A, gains(3), np.array([1e-3, -2e-3, 1e-3]))]


def unbalanced(e, A, K_P, offset):
    """Force A^T c of the PD torques and the part of the error that breaks the loops, both as angles."""
    force = A.T @ K_P @ (e + offset) / np.max(K_P) / np.max(np.abs(A))
    torn = e - A @ np.linalg.lstsq(A, e, rcond=None)[0]
    return max(np.max(np.abs(force)), np.max(np.abs(torn))), "force A^T K_P (e + offset) or loop gap, rad"


def fight_cases(rng) -> list[tuple]:
    """Null vectors, gains and offsets at random poses, at one where drive 1 has no share, and of four drives."""
    robot = load()
    cases = []
    for x in rng.uniform(-0.08, 0.08, (6, 2)):
        n = null_vector(robot, inverse_kinematics(robot, x))
        cases.append(Case("the testbed", n, rng.uniform(2.0, 20.0, 3), rng.uniform(-8e-3, 8e-3, 3)))
    idle = np.array([0.0, 0.6, 0.8])
    mixed = null_vector(robot, inverse_kinematics(robot, robot.base[:2].mean(axis=0) + [0.05, 0.06], (1, 1, -1)))
    four = rng.standard_normal(4)
    four /= np.linalg.norm(four)
    return [
        *cases,
        Case("a pose where drive 1 has no share", idle, rng.uniform(2.0, 20.0, 3), rng.uniform(-8e-3, 8e-3, 3)),
        Case("another working mode", mixed, rng.uniform(2.0, 20.0, 3), rng.uniform(-8e-3, 8e-3, 3)),
        Case("four drives", four, rng.uniform(2.0, 20.0, 4), rng.uniform(-8e-3, 8e-3, 4), beyond=True),
    ]


def fight(eta, gains, offset):
    """The rest torques by way of (14): any A whose columns span the plane normal to eta gives the same."""
    A = np.linalg.svd(eta[:, None])[0][:, 1:]
    return steady_state_torque(A, gains, offset)


def open_chain(c, eta, gains, offset):
    """Stretches c / k and offsets of the springs in series must close: eta.(c / k + offset) = 0."""
    return abs(eta @ (c / gains + offset)), "gap eta.(c / K + offset) of the springs in series, rad"


def unseen_offsets(robot, x):
    """Offsets (m,) in rad of a machine that stands 2.2 mm beside x (2,) in m and believes to stand there."""
    there = inverse_kinematics(robot, np.add(x, [0.0, 2.2e-3]))
    return (inverse_kinematics(robot, x) - there)[: robot.n_arms]


def betrayal(offsets) -> list[Measured]:
    """What a second of standing still shows of the offsets of a design, the worst over places, gains and machines."""
    shift, torque, size = [], [], []
    for name, x, spread in (
        ("testbed", (0.04, -0.05), 0.0),
        ("testbed", (-0.06, 0.02), 0.5),
        ("testbed", (0.0, 0.08), 0.0),
        ("four_arms", (0.03, -0.04), 0.3),
    ):
        robot = load(name).replace(friction=0.0)
        chosen = numbers(given(offsets, (robot, np.array(x))))
        if chosen.shape != (robot.n_arms,):
            words = f"the offsets have shape {chosen.shape}, expected ({robot.n_arms},): one for each drive"
            raise Ended("wrong", words)
        gains = K_P * np.linspace(1.0 - spread, 1.0 + spread, robot.n_arms)
        run = simulate(robot, PD(gains, K_D * np.sqrt(gains / K_P)), hold(robot, x, 1.0), chosen)
        shift.append(1e3 * np.linalg.norm(run.x[-1] - x))
        torque.append(1e3 * np.abs(run.c[-1]).max())
        size.append(1e3 * np.abs(chosen).max())
    return [
        Measured("smallest shift at rest", min(shift), "mm", SHIFT, at_most=False),
        Measured("largest torque at rest", max(torque), "mN m", HELD),
        Measured("largest offset", max(size), "mrad", LARGEST),
    ]


def asked(offsets, place=(0.04, -0.05)):
    """The offsets of a design at one place of the testbed, with eta there."""
    robot = load().replace(friction=0.0)
    x = np.array(place)
    return numbers(given(offsets, (robot, x))), null_vector(robot, inverse_kinematics(robot, x))


def alike_everywhere(offsets) -> bool:
    """True where the offsets of a design do not follow the place."""
    return bool(np.array_equal(asked(offsets)[0], asked(offsets, (-0.06, 0.02))[0]))


def along_eta(offsets) -> bool:
    """True where the offsets of a design are along eta but for 5 %: they fight, and shift nothing."""
    chosen, n = asked(offsets)
    return bool(np.linalg.norm(chosen - n * (n @ chosen)) < 0.05 * np.linalg.norm(chosen))


def unseen_times(factor: float):
    """True where the offsets of a design, times a factor, would do: of the right size, and but for 5 % without eta."""

    def made(offsets) -> bool:
        chosen, n = asked(offsets)
        fits = 5e-3 < factor * np.abs(chosen).max() < 1e-3 * LARGEST
        return bool(fits and abs(n @ chosen) < 0.05 * np.linalg.norm(chosen))

    return made


@functools.cache
def rests(name: str):
    """Null vectors (k, 3), mean errors and mean torques of the second half of each rest of a log."""
    robot, log = load(), mystery_run(name)
    rows = []
    for start in (0.7, 3.7, 6.7) if name != "offset_c" else (0.7,):
        now = (log.t > start) & (log.t < start + 0.8)
        n = null_vector(robot, estimate_pose(robot, log.q_a_desired[now][0], [0.0, 0.0]))
        rows.append((n, log.error[now].mean(axis=0), log.c[now].mean(axis=0)))
    return tuple(np.array(v) for v in zip(*rows, strict=True))


def from_rests(name: str, change):
    """Offsets from the rests of a log, with `change` of (null vectors, errors, torques) in place of the equations."""
    return lambda: change(*rests(name))


def contradictions(n, errors):
    """What the encoders contradict each other by at each rest, rad."""
    return np.sum(n * errors, axis=1)


def unexplained_error(name: str):
    """Law of a log: the rests' contradictions that offsets leave unexplained, as an angle."""

    def law(offset):
        n, errors, _ = rests(name)
        return np.max(np.abs(contradictions(n, errors) - n @ offset)), "contradictions left unexplained (rad)"

    return law


def unexplained_gain(gains):
    """Largest torque of a rest that the gains leave unexplained, as a gain at the mean error of that drive."""
    _, errors, torques = rests("gain")
    left = torques + errors * gains
    worst = np.max(np.abs(left).max(axis=0) / np.abs(errors).max(axis=0))
    return worst, "rest torques left unexplained, over the error (N m/rad)"


def refusal(answer) -> Result:
    """The verdict on what `offset_c` tells: one number, to first order eta.offset; no single offset."""
    if isinstance(answer, str):
        raise Ended("wrong", "say it with numbers: three offsets, np.nan for each one that the log cannot tell")
    got = numbers(given(answer, ()))
    (n,), (error,), _ = rests("offset_c")
    if got.shape in ((), (1,)) and not np.any(np.isnan(got)):
        off = abs(abs(float(got.reshape(()))) - abs(n @ error))
        if off < 4e-5:
            return Result("ok", f"the encoders contradict each other by this number, within {1e3 * off:.1g} mrad")
        raise Ended("wrong", "one number is right, the encoders' contradiction, but the log tells another one")
    if got.shape not in ((), (3,)):
        raise Ended("wrong", f"the answer has shape {got.shape}, expected (3,)", "another shape")
    if np.all(np.isnan(got)):
        return Result("ok", "the log tells one number only; no single offset can be told from it, and none is claimed")
    if np.any(np.isnan(got)):
        raise Ended("wrong", "no drive is better off than another: none of the three offsets can be told")
    raise Ended("wrong", *_claimed(got, n, n @ error))


def _claimed(offset, n, known) -> tuple[str, str]:
    """Words for offsets that somebody read from `offset_c` all the same."""
    if not np.any(offset):
        words = "zeros are a claim, too: they leave the contradiction of the log unexplained"
    elif np.max(np.abs(offset - n * known)) < 1e-4:
        words = "this is the minimum norm: the smallest offsets that explain the log, and not those of the machine"
    elif abs(n @ offset - known) < 3e-4:
        words = "these offsets explain the log, and so do infinitely many others: add any A xi, no torque shows it"
    else:
        words = "these offsets do not even explain the log; and no others can be told from one place (rank 1)"
    return words, words.partition(":")[0]
