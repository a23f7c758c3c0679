"""The sampled loop for laws in Python, one page: sense, measure, find the pose, command, record, hold.

The engine has the same loop compiled, for the laws it knows.
"""

from __future__ import annotations

import copy

import numpy as np

from ..control.sample import Controller, NoPose
from ..machine.arguments import short
from .compiled import DONE, LAW_FAILED, LEFT_WORKSPACE, NO_POSE, Plant
from .sensors import Encoders
from .setup import Outcome, Setup


def own_copy(law):
    """A copy that a run may change, so that each starts with the law as it was given; raises ValueError without one."""
    try:
        return copy.deepcopy(law)
    except Exception as error:
        raise ValueError(
            f"law = {short(law)} cannot be copied ({error}), and so its runs would depend on each other; "
            "allowed: an object that copy.deepcopy copies, or a function"
        ) from error


def closed_loop(setup: Setup, law) -> tuple[Outcome, BaseException | None]:
    """One run with a law or callable that nobody else uses; returns it and the exception that stopped it.

    What goes wrong at the first sample is an error of the caller, and raised as it is.  A Ctrl-C is returned, too.
    A law that fails at rates beyond 1e9 rad/s is not to blame: the machine was lost in the hold before.
    """
    robot, model, trajectory, sensors, faults, _ = setup
    plant, encoders = Plant(robot, trajectory, model), Encoders(sensors, faults, trajectory.dt)
    controller = Controller(law, model, trajectory.dt)
    controller.nearest, controller.smooth = plant.nearest, sensors.count is None
    samples, N = len(trajectory), robot.n_arms
    x, xd, q_a, qd_a, c = (np.zeros((samples, size)) for size in (2, 2, N, N, N))
    pairs = np.full((samples, 2), -1)
    history = x, xd, q_a, qd_a, c, pairs
    times, dt = trajectory.t.tolist(), trajectory.dt
    state = (*trajectory.x[0].tolist(), *trajectory.xd[0].tolist())
    last = len(times) - 1
    k = 0
    try:
        for k, t in enumerate(times):
            q, qd = plant.observe(k, state)  # sense
            angles, rates = encoders.read(k, q, qd)  # measure
            truth = state[:2], state[2:]
            torque = controller.command(t, angles, rates, trajectory[k], truth)  # pose (if asked for), command
            if faults is not None:
                torque = faults.act(k, torque)
            (x[k], xd[k]), q_a[k], qd_a[k], c[k] = truth, q, qd, torque  # record
            if controller.pair is not None:
                pairs[k] = controller.pair
            if k < last:
                state = plant.hold(state, torque, dt)  # hold
                if state is None:
                    return Outcome(plant.status, k, *history), None
    except NoPose as error:
        return Outcome(NO_POSE, k, *history), error
    except BaseException as error:
        if k == 0:
            raise
        if isinstance(error, Exception) and np.abs(qd).max() > 1e9:
            return Outcome(LEFT_WORKSPACE, k - 1, *history), error
        return Outcome(LAW_FAILED, k, *history), error
    return Outcome(DONE, last, *history), None


def again_in_python(setup: Setup, law, outcome: Outcome) -> tuple[Outcome, BaseException | None]:
    """How a run ended in which a compiled law gave no finite torques, and what the law raised in Python there.

    The compiled law cannot say it, so the same run is repeated up to there; what it raises at the first sample goes to
    the caller, as in `closed_loop`, unless it passed that one when it was compiled.  What Numba raises is no answer: it
    compiled `d` and `at` in the law, but takes them from Python for no function under ``@numba.njit``.
    """
    with np.errstate(all="ignore"):
        try:
            again, cause = closed_loop(setup.begin(outcome.sample + 1), law)
        except KeyboardInterrupt as stop:  # before the repetition has begun
            return outcome, stop
        except Exception as error:  # at the first sample, where 1.0 / 0.0 raises in Python alone
            if outcome.sample == 0 and not _of_numba(error):
                raise
            return outcome, None
    if again.status == LAW_FAILED and again.sample == outcome.sample and not _of_numba(cause):
        return outcome._replace(status=LAW_FAILED), cause
    if again.status == LEFT_WORKSPACE and cause is not None:
        return again, cause
    return outcome, None if isinstance(cause, Exception) else cause


def _of_numba(error: BaseException | None) -> bool:
    return type(error).__module__.startswith("numba.")
