"""What a controller knows at one instant, and a law at work from sample to sample."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..machine.arguments import ConvergenceError, exact_array, matvec, of_kind, one_of, positive_number
from ..machine.manipulator import Manipulator, manipulator
from ..mechanics.at import at
from ..mechanics.closure import estimate_pose, misfit, on_the_turn_of
from ..mechanics.kinematics import forward_kinematics, inverse_kinematics
from ..mechanics.trajectory import Desired
from .grammar import ask, begin, coordinates, measured


class NoPose(ConvergenceError):
    """The measured base angles fit no pose of the controller's model."""


def one_instant(model, t, q_a, qd_a, desired, truth) -> tuple:
    """What a controller is called with, after the checks of `measured`, and without leading axes."""
    q_a, qd_a = measured(model, q_a, qd_a, desired)
    exact_array("desired.q", desired.q, model.n_joints)
    q_a, qd_a = exact_array("q_a", q_a, model.n_arms), exact_array("qd_a", qd_a, model.n_arms)
    truth = None if truth is None else exact_array("truth", truth, 2, 2)
    return float(exact_array("t", t)), q_a, qd_a, desired, truth


class Sample:
    """What a controller knows at one instant, as a law's `step` gets it.

    t, dt : time and sampling time, s.  model : the controller's own manipulator.
    q_a, qd_a : measured base angles and rates (N,), rad and rad/s, in a run read-only.  desired : the desired motion.

    >>> import rapkm_lite as rk
    >>> class Push(rk.Law):
    ...     def step(self, memory, sample):
    ...         return -7.0 * sample.errors()[0], memory
    >>> rk.simulate(rk.load(), Push(), rk.hold(rk.load(), [0.0, 0.0], 0.1), offset=1e-3).c[0].round(4)
    array([-0.007, -0.007, -0.007])
    """

    t: float
    dt: float
    model: Manipulator
    q_a: np.ndarray
    qd_a: np.ndarray
    desired: Desired
    _keeper: Controller
    _truth: Any
    _found: dict

    def __init__(self, keeper: Controller, t: float, q_a, qd_a, desired: Desired, truth=None):
        of_kind("keeper", keeper, Controller, "the Controller that makes the samples")
        self._fill(keeper, *one_instant(keeper.model, t, q_a, qd_a, desired, truth))

    def _fill(self, keeper: Controller, t, q_a, qd_a, desired, truth) -> None:
        """Take what was checked before."""
        self.__dict__.update(
            t=t, dt=keeper.dt, model=keeper.model, q_a=q_a, qd_a=qd_a, desired=desired,
            _keeper=keeper, _truth=truth, _found={},
        )  # fmt: skip

    def __setattr__(self, name, value):
        raise AttributeError(f"{name} of a Sample cannot be set, others read it, too; allowed: a name of your own")

    def errors(self) -> tuple[np.ndarray, np.ndarray]:
        """Measured minus desired base angles and rates, (N,) each, rad and rad/s."""
        desired, N = self.desired, self.model.n_arms
        return self.q_a - desired.q[:N], self.qd_a - desired.qd[:N]

    def pose(self, source: str | None = "measured") -> tuple[np.ndarray | None, np.ndarray | None]:
        """Configuration q and rate qd on V, (2N,) each, read-only; found when asked for, and kept.

        The base angles of q are on the turn of the measured ones, of the true pose on that of the desired ones.
        source : "measured", by least squares from the measured base angles, the default whatever the law's own `pose`;
        "true", for study; None for (None, None).
        Raises ConvergenceError when the measured angles fit no pose, ValueError where the true motion was not told or
        lies out of reach, and where the measured pose is an input singularity.
        """
        if source is None:
            return None, None
        if not isinstance(source, str) or source not in self._found:
            one_of("source", source, ("measured", "true"))
            here, xd = self._true() if source == "true" else self._measured()
            turn = self.desired.q[: self.model.n_arms] if source == "true" else self.q_a
            q, qd = on_the_turn_of(turn, here.q), matvec(here.F, xd)
            q.setflags(write=False)
            qd.setflags(write=False)
            self._found[source] = q, qd
        return self._found[source]

    def _true(self):
        if self._truth is None:
            raise ValueError("truth = None for a law with pose = 'true'; allowed: the true motion (x, xd)")
        x, xd = self._truth
        return at(self.model, inverse_kinematics(self.model, x)), np.asarray(xd, dtype=float)

    def _measured(self):
        model, keeper, found = self.model, self._keeper, None
        x, x1, x2 = keeper.places or (self.desired.x,) * 3
        guess = 3.0 * (x - x1) + x2 if keeper.smooth else x
        if keeper.nearest is not None:
            found = keeper.nearest(self.q_a, guess)
        keeper.places = ()
        if found is None:
            start = min(guess, x, key=lambda place: misfit(model, self.q_a, place)[-1])
            try:
                found = forward_kinematics(model, estimate_pose(model, self.q_a, start))
            except ConvergenceError as error:
                raise NoPose(str(error)) from error
        keeper.places = np.asarray(found), x, x1
        here = at(model, inverse_kinematics(model, found))
        (m11, m12), (_, m22) = (here.A.T @ here.A).tolist()
        # As in the engine: closer to an input singularity a pose that fits no angles is rounding, and its rates are.
        if not m11 * m22 - m12 * m12 > 1e-15 * (m11 + m22) ** 2:
            raise ValueError("A has lost rank (an input singularity) at the measured pose; allowed: another pose")
        return here, matvec(here.A_T_pinv.T, self.qd_a)


class Controller:
    """A law at work: it keeps the law's memory and the last estimates of the end-effector position, `x` the last one.

    `simulate` uses one per run in Python.  Use your own in a loop of your own, called once per sample as
    ``controller(t, q_a, qd_a, desired, truth=(x, xd))`` with measured base angles and rates (N,); the true end-effector
    motion is needed for a law with pose="true" only.
    model : the controller's own manipulator.  dt : sampling time in s.
    Raises ValueError for arguments that do not fit, ConvergenceError when the angles fit no pose.

    nearest : a faster way than `estimate_pose` from angles and guess to the end-effector position, or None; it may
        answer None.  smooth : its guess lies on a parabola through the last three estimates, as in the engine; else it
        is the last one.  Where Newton's steps from there lead nowhere, `estimate_pose` begins at the better of both.

    >>> import rapkm_lite as rk
    >>> robot = rk.load()
    >>> path, controller = rk.hold(robot, [0.0, 0.0]), rk.Controller(rk.PD(7.0, 0.2), robot)
    >>> controller(0.0, path.q_a[0] + 0.01, path.qd_a[0], path[0]).round(6)
    array([-0.07, -0.07, -0.07])
    """

    def __init__(self, law, model: Manipulator, dt: float = 1e-3):
        self.law, self.model, self.dt = law, manipulator(model, "model"), positive_number("dt", dt)
        self.places: tuple[np.ndarray, ...] = ()
        self.nearest: Callable[..., tuple[float, float] | None] | None = None
        self.smooth = False
        self.memory = begin(law, model, self.dt)

    @property
    def x(self) -> np.ndarray | None:
        """The last estimate of the end-effector position (2,) in m, None where there is none."""
        return self.places[0].copy() if self.places else None

    @property
    def pair(self) -> tuple[int, int] | None:
        """The independent joints in use, None where the law has none."""
        return coordinates(self.law, self.memory)

    def __call__(self, t, q_a, qd_a, desired: Desired, truth=None) -> np.ndarray:
        return self.command(*one_instant(self.model, t, q_a, qd_a, desired, truth))

    def command(self, t, q_a, qd_a, desired, truth=None) -> np.ndarray:
        """What a call of the controller returns, without its check of the measurement."""
        sample = Sample.__new__(Sample)
        sample._fill(self, t, q_a, qd_a, desired, truth)
        c, self.memory = ask(self.law, self.memory, sample)
        return c
