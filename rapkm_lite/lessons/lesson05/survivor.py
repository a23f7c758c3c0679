"""A design exercise: a law that survives one dead encoder, judged in closed loop."""

from __future__ import annotations

import inspect

import numpy as np

from ...control.computed_torque import CTC, RedundantAPD, RedundantCTC, SwitchedCTC
from ...control.laws import PD, AntagonismFilter
from ...machine.manipulator import load
from ...mechanics.actuation import inverse_dynamics
from ...mechanics.trajectory import triangle
from ...simulation.faults import EncoderDropout
from ...simulation.runs import SimulationError, simulate
from ..answers import blind, given_law, stiffness
from ..checker import Exercise, Measured

OFFSET = (4e-3, -2e-3, 5e-3)
START, LIMIT = 0.75, 6.0  # s, mm


def _model():
    return load().replace(friction=0.0)


def survivor(robot):
    """Feed-forward torques, and PD feedback of those drives whose readings move."""

    def law(t, q_a, qd_a, desired):
        alive = (qd_a != 0.0) | ~np.any(qd_a)
        feedback = 7.05 * (q_a - desired.q_a) + 0.225 * (qd_a - desired.qd_a)
        return inverse_dynamics(robot, desired.q, desired.qd, desired.qdd) - alive * feedback

    return law


def _runs(make) -> list[Measured]:
    """The largest distance from the path for each dead encoder; the machine has friction, the law's model none."""
    path, found = triangle(_model(), side=0.12, duration=2.5, dt=2e-3), []
    for drive in range(3):
        law = given_law(make, _model())  # a new one for each run: it may remember which drive died
        dead = EncoderDropout(drive, START, 10.0)
        try:
            run = simulate(load(), law, path, OFFSET, model=_model(), faults=[dead])
            words, size = "", 1e3 * float(np.linalg.norm(run.x - path.x, axis=1).max())
        except SimulationError as error:
            if error.__cause__ is not None:
                raise
            words, size = f" (lost at {error.time:.2f} s)", np.inf
        found.append(Measured(f"encoder {drive + 1} dead{words}: largest error", size, "mm", LIMIT))
        if size > LIMIT:
            break
    return found


def _kind(*kinds):
    return lambda make: isinstance(make(_model()), kinds)


def _of_a_pair(make) -> bool:
    return isinstance(law := make(_model()), CTC) and law.independent is not None


def _probed(test, frozen=False):
    """True for a function whose torques change with the measured angles of their own drives as the test says."""

    def made(make) -> bool:
        path = triangle(_model(), side=0.12, duration=2.5, dt=2e-3)
        # At 1 s, since a law may go by the clock and let go of its drives when an encoder dies.
        return bool(np.all(test(np.diagonal(stiffness(make(_model()), path[500], frozen, t=1.0)))))

    return made


def _never_starts(make) -> bool:
    """True for a function that gives no torque at rest, wherever the machine stands: there every rate is zero."""
    law, desired = make(_model()), triangle(_model(), side=0.12, duration=2.5, dt=2e-3)[300]
    return inspect.isfunction(law) and not np.any(law(0.6, desired.q_a + 0.01, 0.0 * desired.qd_a, desired))


DEAD_ENCODER = Exercise(
    survivor,
    hints=(
        "A frozen reading is a number like any other. What does it do that a moving drive never does?",
        "Its rate is exactly zero while others move. Without that drive's error the feedback is weaker: which torques "
        "can be known without any encoder?",
        "alive = (qd_a != 0) | ~np.any(qd_a); c = rk.inverse_dynamics(robot, desired.q, desired.qd, desired.qdd) "
        "- alive * (K_P * (q_a - desired.q_a) + K_D * (qd_a - desired.qd_a)).",
    ),
    unit="mm",
    judge=_runs,
    close=0.1,
    improve="feed forward the torques of the motion, so that the feedback has less to do, or choose other gains",
    mistakes={
        "the readings are not used: torques fed forward without feedback let the machine drift (a gain is missing)": (
            lambda make: blind(make(_model()), triangle(_model(), side=0.12, duration=2.5, dt=2e-3)[300])
        ),
        "the feedback pushes away from the path (sign): a drive ahead of its desired angle must be held back": (
            _probed(lambda own: own > 1e-6)
        ),
        "the machine never starts: at rest every rate is zero, and not every encoder is dead": _never_starts,
        "the frozen reading still moves its drive: a dead encoder must be noticed, and its rate is zero": (
            _probed(lambda own: own < -1e-6, frozen=True)
        ),
        "PD follows the frozen reading: its drive pushes against an error that is not there (a dead encoder must be "
        "noticed)": _kind(PD),
        "the filter removes antagonism, but the force of the frozen error stays: a dead encoder must be noticed": (
            lambda make: isinstance(law := make(_model()), AntagonismFilter) and isinstance(law.law, PD)
        ),
        "a fixed pair survives only if the dead encoder is the one outside the pair: which one died must be noticed": (
            _of_a_pair
        ),
        "switching looks at the pose, not at the health of the encoders: a dead one must be noticed": (
            _kind(SwitchedCTC)
        ),
        "the pose is fitted to all encoders, also to the dead one: it must be noticed and left out": (
            _kind(CTC, RedundantCTC, RedundantAPD)
        ),
    },
    points=10,
    called="survivor",
)
