"""Studies: thousands of runs of one machine on one path, with other offsets or gains in every run."""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from ..control.grammar import LawLike, as_law
from ..machine.arguments import having, one_of, real_array, short, switch, whole_number
from ..machine.manipulator import Manipulator, manipulator
from ..machine.values import Value, default
from ..mechanics.trajectory import Trajectory
from .chunks import NOT_RUN, Columns, run_chunk
from .compiled import DONE, compiled, encode
from .explain import REASONS
from .faults import Fault, FaultsLike, check_faults
from .loop import own_copy
from .patience import progress_bar
from .pools import pool_of
from .runs import SimulationError, complete, hand_over
from .sensors import Sensors
from .setup import Setup, prepare


@dataclass(frozen=True, eq=False, repr=False)
class Sweep(Value):
    """Result of `sweep`, one row per run; rows of failed runs are masked.

    energies : (k, N) electric energy per drive in J, as `Run.energy`.
    torque_norm : (k,) root mean square over time of the Euclidean norm of the drive torques, N m.
    antagonistic_energy : (k,) J, (R_el / k_t^2) times the integral of ||c_null||^2 at the true pose.
    x_final : (k, 2) end-effector position at the end, m.
    rms_path_error, largest_path_error : (k,) of `Run.path_error` over the samples, root mean square and maximum, m.
    failed : (k,) True where a run could not be finished.  failure_time : (k,) s, masked where it could.
    model, sensors, faults : the controller's own manipulator, how all runs measured but for their offsets, and what was
        broken.
    stopped : (k,) in few words what stopped each run, None where nothing did; `reasons` says why.

    >>> import rapkm_lite as rk
    >>> study = rk.sweep(rk.load(), rk.PD(7.05, 0.225), rk.hold(rk.load(), [0.0, 0.0]), 1e-3 * np.eye(3))
    >>> len(study), study.energies.shape, int(study.failed.sum())
    (3, (3, 3), 0)
    """

    robot: Manipulator
    law: object
    trajectory: Trajectory
    offsets: np.ndarray
    energies: np.ndarray
    torque_norm: np.ndarray
    antagonistic_energy: np.ndarray
    x_final: np.ndarray
    rms_path_error: np.ndarray
    largest_path_error: np.ndarray
    failed: np.ndarray
    failure_time: np.ndarray
    model: Manipulator = default(None)
    sensors: Sensors = default(Sensors())
    faults: tuple[Fault, ...] = ()
    stopped: tuple[str | None, ...] = ()

    def __post_init__(self):
        for law in self.law if isinstance(self.law, list | tuple) else [self.law]:
            as_law(law)
        self._set(faults=check_faults(self.faults), model=self.robot if self.model is None else self.model)
        if type(self.stopped) not in (list, tuple) or any(not isinstance(w, str | None) for w in self.stopped):
            raise ValueError(f"stopped = {short(self.stopped)}; allowed: a tuple, a string or None for each run")
        super().__post_init__()
        if self.failed.ndim != 1:
            raise ValueError(f"failed has shape {self.failed.shape}; allowed: (k,), one truth value per run")
        blank = Columns.blank(len(self), self.robot.n_arms)
        for name in ("offsets", *Columns._fields[:-2]):
            given, shape = getattr(self, name).shape, getattr(blank, name, blank.energies).shape
            if given != shape:
                raise ValueError(f"{name} has shape {given}; allowed: {shape}, a row per run")
        words = self.stopped or tuple("it failed" if failed else None for failed in self.failed)
        if len(words) != len(self):
            raise ValueError(f"stopped = {short(words)}; allowed: a string or None for each of {len(self)} runs")
        self._set(stopped=words)

    @cached_property
    def reasons(self) -> tuple[str | None, ...]:
        """Why each row is masked, (k,): the `SimulationError.reason` of its run; None where nothing failed.

        Found when asked for, and kept: runs of compiled laws are run once more, some milliseconds each.

        >>> import rapkm_lite as rk; robot = rk.load().replace(friction=0.0)
        >>> laws = [rk.PD(7.05, 0.225), rk.PD(7.05, 30.0)]
        >>> study = rk.sweep(robot, laws, rk.hold(robot, [0.0, 0.0], 0.1), [1e-3, 0.0, 0.0], failed="mask")
        >>> [reason and reason[:46] for reason in study.reasons]
        [None, 'the machine left the workspace (unstable gain:']
        """
        words = list(self.stopped)
        for i in np.flatnonzero([word in REASONS.values() for word in words]):  # what ran in Python knows why
            law = self.law[i] if isinstance(self.law, tuple) else self.law
            sensors = self.sensors.with_offset(self.offsets[i])
            try:
                complete(prepare(self.robot, self.trajectory, sensors, self.model, self.faults), law)
            except SimulationError as error:
                words[i] = error.reason
        return tuple(words)

    @property
    def energy(self) -> np.ndarray:
        """The same as `energies`."""
        return self.energies

    def __len__(self) -> int:
        return len(self.failed)

    def __array__(self, dtype=None, copy=None):
        if self.failed.any():
            raise ValueError(f"{int(self.failed.sum())} runs failed; take the masked array `energies` instead")
        return np.array(self.energies, dtype=dtype)

    def __repr__(self):
        total = self.energies.sum(axis=-1)
        ends = "" if self.failed.all() else f", total energy {total.min():.3g} to {total.max():.3g} J"
        return f"Sweep({len(self)} runs, {int(self.failed.sum())} failed{ends})"


def sweep(
    robot: Manipulator,
    law: LawLike | Sequence[LawLike],
    trajectory: Trajectory,
    offsets: ArrayLike,
    encoder: float | None = None,
    model: Manipulator | None = None,
    velocity_filter: float | None = None,
    executor: Executor | None = None,
    failed: str = "raise",
    chunk: int = 64,
    progress: bool = False,
    faults: FaultsLike = (),
) -> Sweep:
    """Run a law on the machine along a trajectory once per row of `offsets`, many runs at a time.

    law : one law for all runs, or a sequence of k laws, such as PD with other gains.
    offsets : calibration offsets (k, N) in rad, or (N,) for all runs; the other arguments are those of `simulate`.
    executor : any `concurrent.futures` executor to spread the chunks of `chunk` runs; default: one thread per core, or
        one thread and run by run for laws in Python.
    failed : "raise" raises the error of the first run that fails; "mask" masks the rows of such runs, whose `reasons`
        the result knows.
    progress : show a bar.
    The numbers do not depend on executor, chunk or the order of the rows, to the last bit.
    Raises ValueError for bad arguments; SimulationError naming the run and the time, with the run up to there as
    `partial` and all rows as `sweep`.  When the executor dies or you press Ctrl-C, what waits is cancelled, and the
    exception carries what is finished: its `partial` is a `Sweep` in which the other rows are masked.

    >>> import rapkm_lite as rk
    >>> path = rk.hold(rk.load(), [0.0, 0.0])
    >>> rk.sweep(rk.load(), [rk.PD(k, 0.2) for k in (3.0, 7.0)], path, [4e-3, 0.0, 0.0]).energies.shape
    (2, 3)
    """
    manipulator(robot)
    chunk = _check_options(failed, chunk, executor, progress)
    laws, offsets = _rows(law, offsets, robot.n_arms)
    setup = prepare(robot, trajectory, Sensors(0.0, encoder, velocity_filter), model, faults)
    in_python = [own_copy(one) for one in {id(one): one for one in laws}.values() if encode(one, setup.model) is None]
    width = 1 if executor is None and in_python else chunk
    chunks = {i: (setup, laws[i : i + width], offsets[i : i + width]) for i in range(0, len(laws), width)}
    table = Columns.blank(len(laws), robot.n_arms)
    with pool_of(executor, 1 if in_python or not compiled() else os.cpu_count() or 1) as pool:
        try:
            errors = _collect(pool, chunks, table, progress)
        except BaseException as error:
            _hand_over_rows(error, table, setup, law, offsets)
            raise
    broken = bool(table.failed.any())
    result = _result(table, setup, law, offsets, mask=failed == "mask" or broken)
    if failed == "raise" and broken:
        i = int(np.argmax(result.failed))
        own = setup._replace(sensors=setup.sensors.with_offset(offsets[i]))
        _raise(i, errors.get(i), own, laws[i], result)
    return result


def _check_options(failed, chunk, executor, progress) -> int:
    one_of("failed", failed, ("raise", "mask"))
    if executor is not None:
        having("executor", executor, "an executor of concurrent.futures", "submit")
    switch("progress", progress)
    return whole_number("chunk", chunk, 1)


def _collect(pool: Executor, chunks: dict, table: Columns, progress: bool) -> dict:
    """Run the chunks, by their first rows; fills the table and returns what stopped rows in Python.

    Whatever goes wrong, what is finished is in the table, and what waits is cancelled.
    """
    jobs, errors = {}, {}
    try:
        for i, arguments in chunks.items():
            jobs[i] = pool.submit(run_chunk, *arguments)
        with progress_bar(len(jobs) if progress else 0) as advance:
            for i, job in jobs.items():
                errors |= table.enter(i, *job.result())
                advance()
    except BaseException:
        for i, job in jobs.items():
            if not job.cancel() and job.done() and job.exception() is None:
                table.enter(i, *job.result())
        raise
    return errors


def _hand_over_rows(error: BaseException, table: Columns, setup: Setup, law, offsets) -> None:
    """Give an exception the rows that are finished; an interrupt also when there are none."""
    finished = np.count_nonzero(table.status == DONE)
    if finished or not isinstance(error, Exception):
        words = "they are in the `partial` of this exception, a Sweep whose other rows are masked."
        partial = _result(table, setup, law, offsets, mask=True)
        hand_over(error, partial, f"{finished} of {len(table.status)} runs were finished; {words}")


def _raise(i: int, error, setup: Setup, law, result: Sweep):
    """Raise what stopped run i; what the engine stopped runs once more, for its reason and its samples."""
    if error is None:
        try:
            complete(setup, law)
            error = SimulationError(result.failure_time[i], str(result.stopped[i]))
        except SimulationError as found:
            error = found
    if not isinstance(error, SimulationError):
        hand_over(
            error, result, f"It was raised at the first sample of run {i} of a sweep; all rows are in its `partial`."
        )
        raise error
    raise SimulationError(error.time, error.reason, error.partial, i, result) from error.__cause__


def _rows(law, offsets, N: int) -> tuple[list, np.ndarray]:
    """One law and one row of offsets per run."""
    offsets = real_array("offsets", offsets)
    if offsets.ndim > 2 or (offsets.ndim and offsets.shape[-1] != N):
        raise ValueError(f"offsets has shape {offsets.shape}; allowed: (k, {N}), one row per run, or ({N},)")
    several = np.iterable(law) and not isinstance(law, str) and not callable(law) and not hasattr(law, "step")
    laws = list(law) if several else [law]
    for one in laws:
        as_law(one)
    k = len(offsets) if offsets.ndim == 2 else len(laws)
    if k == 0:
        raise ValueError("offsets or law is empty; allowed: at least one run")
    if several and len(laws) != k:
        raise ValueError(f"law holds {len(laws)} laws for {k} rows of offsets; allowed: one law, or one per row")
    return laws if several else laws * k, np.array(np.broadcast_to(offsets, (k, N)))


def _result(table: Columns, setup: Setup, law, offsets, mask: bool) -> Sweep:
    """The columns as a study, with the rows masked that are not finished."""
    failed = table.failed

    def column(v: np.ndarray) -> np.ndarray:
        return np.ma.array(v, mask=np.broadcast_to(failed.reshape(-1, *[1] * (v.ndim - 1)), v.shape)) if mask else v

    words = REASONS | {DONE: None, NOT_RUN: "it had not run when the sweep was stopped"}
    return Sweep(
        setup.robot,
        law,
        setup.trajectory,
        offsets,
        column(table.energies),
        column(table.torque_norm),
        column(table.antagonistic_energy),
        column(table.x_final),
        column(table.rms_path_error),
        column(table.largest_path_error),
        failed,
        np.ma.array(table.failure_time, mask=~failed | (table.status == NOT_RUN)),
        setup.model,
        setup.sensors,
        setup.broken,
        tuple(own or words[status] for own, status in zip(table.reason, table.status.tolist(), strict=True)),
    )
