"""Single runs of the sampled control loop: what comes out of one, and what is known when it is lost."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..control.grammar import LawLike, as_law
from ..machine.arguments import exact_array, matvec, real_array, shaped, short
from ..machine.logs import Log
from ..machine.manipulator import Manipulator
from ..machine.values import Value, default, frozen
from ..mechanics.at import at
from ..mechanics.kinematics import inverse_kinematics
from ..mechanics.trajectory import Trajectory
from .compiled import DONE, LEFT_WORKSPACE, SINGULAR, TOO_STIFF, encode, single
from .energy import copper_loss, mechanical_work
from .explain import explain
from .faults import Fault, FaultsLike, check_faults, fault_table
from .loop import again_in_python, closed_loop, own_copy
from .pools import kept_here
from .sensors import Encoders, Sensors
from .setup import Outcome, Setup, prepare


class SimulationError(RuntimeError):
    """A run that could not be finished.

    time : when, s.  reason : what went wrong.  partial : the `Run` up to there; its rows are samples whose torques are
    known.  The exception that a law raised is the ``__cause__``.
    run, sweep : which row of a sweep, and the `Sweep` with such rows masked; None for single runs.

    >>> import rapkm_lite as rk; robot = rk.load().replace(friction=0.0)
    >>> try:
    ...     rk.simulate(robot, rk.PD(K_P=7.05, K_D=30.0), rk.triangle(robot))
    ... except rk.SimulationError as error:
    ...     print(error.reason[:30], len(error.partial) < 50)
    the machine left the workspace True
    """

    def __init__(self, time: float, reason: str, partial: Run | None = None, run: int | None = None, sweep=None):
        time = float(exact_array("time", time))
        super().__init__(f"{'' if run is None else f'run {run}: '}at t = {time:.4f} s {reason}")
        self.time, self.reason, self.partial, self.run, self.sweep = time, reason, partial, run, sweep

    def __reduce__(self):
        cause = None if kept_here(self.__cause__) else self.__cause__  # its words are in `reason`
        arguments = self.time, self.reason, self.partial, self.run, self.sweep
        return SimulationError, arguments, vars(self) | {"__cause__": cause}


@dataclass(frozen=True, eq=False, repr=False)
class Run(Value):
    """Result of a sampled closed loop, one row per sample.

    robot : the machine.  law : the law that ran; a copy, when it was an object in Python.
    model : the controller's own manipulator; `trajectory` is its desired motion.
    sensors, faults : with which it measured, and what was broken.
    t : (k,) s.  x, xd : (k, 2) true end-effector motion, m, m/s.  q_a, qd_a : (k, N) of the base joints, rad, rad/s.
    c : (k, N) drive torques in N m that act; c[k] is held from t[k] to t[k+1] (the last row is never applied).
    pairs : (k, 2) independent joints in use at each sample, -1 where the law has none.

    >>> import rapkm_lite as rk
    >>> run = rk.simulate(rk.load(), rk.PD(7.05, 0.225), rk.hold(rk.load(), [0.0, 0.0]), offset=[4e-3, 0.0, 0.0])
    >>> run.c[-1].round(4)
    array([-0.0094, -0.0094, -0.0094])
    """

    robot: Manipulator
    law: object
    trajectory: Trajectory
    sensors: Sensors
    faults: tuple[Fault, ...]
    t: np.ndarray
    x: np.ndarray
    xd: np.ndarray
    q_a: np.ndarray
    qd_a: np.ndarray
    c: np.ndarray
    pairs: np.ndarray
    model: Manipulator = default(None)

    def __post_init__(self):
        as_law(self.law)
        model = self.robot if self.model is None else self.model
        super().__post_init__(faults=check_faults(self.faults), model=model)
        if self.model.n_arms != self.robot.n_arms:
            raise ValueError(f"model has {self.model.n_arms} arms; allowed: {self.robot.n_arms}, as many as robot")
        most = len(self.trajectory)
        fits = self.t.ndim == 1 and len(self.t) <= most
        shaped("t", self.t, fits, f"(k,), up to the {most} samples of the trajectory")
        for name in ("x", "xd", "q_a", "qd_a", "c", "pairs"):
            column, shape = getattr(self, name), (self.t.size, self.robot.n_arms if name in ("q_a", "qd_a", "c") else 2)
            shaped(name, real_array(name, column), column.shape == shape, f"{shape}, t has {self.t.shape}")

    @cached_property
    def q(self) -> np.ndarray:
        """All joint angles (k, 2N), rad, closed by construction."""
        elbows = inverse_kinematics(self.robot, self.x)[:, self.robot.n_arms :]
        return frozen(np.concatenate([self.q_a, elbows], axis=-1))

    @cached_property
    def qd(self) -> np.ndarray:
        """All joint rates (k, 2N), rad/s."""
        return frozen(matvec(at(self.robot, self.q).F, self.xd))

    @property
    def dt(self) -> float:
        """Sampling time in s."""
        return self.trajectory.dt

    @property
    def offset(self) -> np.ndarray:
        """Calibration offsets (N,), rad."""
        return self.sensors.offset

    @property
    def energy(self) -> np.ndarray:
        """Electric energy per drive (N,) in J, regenerative: sum over holds of R (c/k_t)^2 dt + c (q[k+1] - q[k])."""
        return frozen(copper_loss(self.robot, self.c[:-1], self.dt) + mechanical_work(self))

    @property
    def error(self) -> np.ndarray:
        """Joint errors q_a - q_a^d (k, N) of the true base angles, rad."""
        return frozen(self.q_a - self.trajectory.q_a[: len(self)])

    @property
    def path_error(self) -> np.ndarray:
        """Distance (k,) in m of the end-effector from its desired place at each sample, also where it lags."""
        return frozen(np.linalg.norm(self.x - self.trajectory.x[: len(self)], axis=-1))

    @property
    def switches(self) -> int:
        """How often the pair of independent joints was changed."""
        return int(np.count_nonzero(np.any(np.diff(self.pairs, axis=0) != 0, axis=-1)))

    def log(self, name: str = "run") -> Log:
        """What a laboratory would have of this run: measured and desired base angles (k, N) in rad, and torques in N m.

        The angles are those that the controller read, with offsets, counts and faults; the torques those that acted.

        >>> import rapkm_lite as rk
        >>> run = rk.simulate(rk.load(), rk.PD(7.05, 0.225), rk.hold(rk.load(), [0.0, 0.0]), offset=[4e-3, 0.0, 0.0])
        >>> np.allclose(rk.calibrate(rk.load(), run.log()).offset, run.offset)
        True
        """
        N, t = self.robot.n_arms, self.trajectory.t
        encoders = Encoders(self.sensors.of_drives(N), fault_table(self.faults, t, N), self.dt)
        read = [encoders.read(k, q_a, qd_a)[0] for k, (q_a, qd_a) in enumerate(zip(self.q_a, self.qd_a, strict=True))]
        return Log(name, self.t, np.reshape(read, self.q_a.shape), self.trajectory.q_a[: len(self)], self.c)

    def __len__(self) -> int:
        return len(self.t)

    def __repr__(self):
        joules = ", ".join(f"{e:.3f}" for e in self.energy)
        return f"Run({len(self) and self.t[-1]:g} s, {type(self.law).__name__}, energy ({joules}) J)"


def simulate(
    robot: Manipulator,
    law: LawLike,
    trajectory: Trajectory,
    offset: ArrayLike = 0.0,
    encoder: float | None = None,
    model: Manipulator | None = None,
    velocity_filter: float | None = None,
    faults: FaultsLike = (),
    sensors: Sensors | None = None,
) -> Run:
    """Run a control law on the machine along a trajectory, sampled at the trajectory's rate with zero-order hold.

    The run starts on the path: at its first point, with the velocity of the path there.  The controller measures
    q_a + offset and, without a velocity filter, the true rates.

    law : a law of `rapkm_lite.control`, a `Law` of your own, or any callable ``(t, q_a, qd_a, desired) -> c`` with c
        (N,) in N m.  An object in Python is copied for the run and the copy is `Run.law`: equal calls, equal numbers.
        (What a function notes in variables outside, or an object in a list of its class, goes on from run to run:
        note it in the object itself, made in ``__init__``, or in the memory of a `Law` with `start`.)
    offset : calibration offsets (N,) in rad, measured minus true angle.
    encoder : counts per turn (quantization to the nearest count), or None for ideal angles.
    model : the controller's own manipulator, when it differs from the machine; it also sets the desired angles, from
        which set-points of `Trajectory.with_set_points` stay as far as they are from the path's.
    velocity_filter : time constant in s of the rate from backward differences of the measured angles, through a
        first-order low-pass that begins with the true ones (its step: see `Sensors`); None for the true rates.
    faults : a list of `TorqueLimit`, `DeadDrive`, `EncoderDropout`, `OffsetJump`; drives count from 0.  One that
        begins after the end of the path changes nothing.
    sensors : offset, encoder and velocity_filter as one value, instead of the three.
    A hold is one Runge-Kutta step of order 4: on a circle of 0.1 m in 1 s under PD it errs by less than 1 nm at
    dt = 2 ms, by less than 0.2 micrometres at 10 ms.  Near an input singularity laws with a model hold torques that
    grow without limit, and the error, still of order 4, grows with them: a five-bar under `CTC` that goes to within
    0.2 rad of parallel distal links and back in 0.5 s (0.8 N m) errs by less than 5 nm at 5 ms, 0.1 micrometres at 10.
    Near the edge of the workspace a hold takes more steps: the run ends at the sample after which an arm stretches or
    folds.
    Stiff friction costs time: a hold in which a drive is nearly at rest takes as many Runge-Kutta steps as dt f_c / v0
    over the inertia that a drive moves, added up over all drives, or twice as many, but six more at most: one for the
    testbed's friction, 2400 (0.4 ms) in its middle for 1 N m and v0 = 0.1 mrad/s; beyond 4000 the run is refused.  Then
    a larger ``friction_velocity`` helps.
    Raises ValueError for bad arguments and for a first answer of the law that does not fit; what a law in Python, or a
    `compiled` one, raises at the first sample comes through.  Whatever else stops a run, then or later, raises
    SimulationError with the run up to there: a machine that leaves the workspace, a lost pose, a singularity of the
    law's coordinates, an error in the law.  A Ctrl-C comes through, with the run up to there as its `partial`, once
    it has begun: not while the path is prepared or a `compiled` law compiles.

    >>> import rapkm_lite as rk
    >>> spring = lambda t, q_a, qd_a, desired: -7.0 * (q_a - desired.q_a) - 0.2 * (qd_a - desired.qd_a)
    >>> rk.simulate(rk.load(), spring, rk.hold(rk.load(), [0.0, 0.0], 0.1), offset=1e-3).c[0].round(4)
    array([-0.007, -0.007, -0.007])
    """
    given = Sensors(offset, encoder, velocity_filter)
    if sensors is not None and given != Sensors():
        raise ValueError(f"sensors = {short(sensors)} together with {given!r}; allowed: one of the two")
    return complete(prepare(robot, trajectory, given if sensors is None else sensors, model, faults), law)


def complete(setup: Setup, law) -> Run:
    """The whole run; raises SimulationError with a part of it."""
    run, lost = attempt(setup, law)
    if lost is not None:
        raise lost
    return run


def attempt(setup: Setup, law) -> tuple[Run, SimulationError | None]:
    """A run as far as it came, and what ended it; what a law raises at its first sample comes through as it is."""
    as_law(law)
    code, cause = encode(law, setup), None
    if code is not None:
        outcome, cause = single(setup, code)
        if code.user is not None and outcome.status == SINGULAR:
            outcome, cause = again_in_python(setup, law, outcome)
    else:
        law = own_copy(law)
        outcome, cause = closed_loop(setup, law)
    run, time = _run(setup, law, outcome), setup.trajectory.t[outcome.sample]
    try:
        if cause is not None and not isinstance(cause, Exception):
            raise cause
        if outcome.status == DONE:
            return run, None
        reason = explain(setup, law, outcome.status, outcome.sample, cause, run.c)
    except BaseException as error:  # also a Ctrl-C while the cause is looked for
        hand_over(error, run, f"The run up to t = {time:.4f} s is the `partial` of this exception.")
        raise
    lost = SimulationError(time, reason, run)
    lost.__cause__ = cause
    return run, lost


def _run(setup: Setup, law, outcome: Outcome) -> Run:
    """The rows of an outcome that hold something."""
    status, sample, *columns = outcome
    columns = [setup.trajectory.t, *columns]
    if status != DONE:
        columns = [column[: sample + (status in (LEFT_WORKSPACE, TOO_STIFF))] for column in columns]
        table = np.concatenate(columns[1:], axis=-1)
        rows = int(np.append(np.all(np.abs(table) < 1e100, axis=-1), False).argmin())
        columns = [column[:rows] for column in columns]
    # What a kernel has finished is finite and frozen.
    make = Run if status != DONE or columns[1].flags.writeable else Run.trusted
    fields: list[Any] = [setup.robot, law, setup.trajectory, setup.sensors, setup.broken, *columns, setup.model]
    return make(*fields)


def hand_over(error, partial, note: str) -> None:
    """Give an exception of whatever kind what is finished, and a note that says so instead of one that did."""
    if isinstance(getattr(error, "partial", None), Run):
        error.__notes__ = [text for text in getattr(error, "__notes__", []) if "`partial`" not in text]
    with suppress(AttributeError):  # of an exception class whose `partial` is its own
        error.partial = partial
        error.add_note(note)
