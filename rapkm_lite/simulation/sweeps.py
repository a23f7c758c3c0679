"""Studies: thousands of runs of one machine on one path, with other offsets or gains in every run."""

from __future__ import annotations

import os
from collections.abc import Iterable
from concurrent.futures import BrokenExecutor, Executor
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..control.grammar import LawLike, as_law
from ..machine.arguments import having, one_of, real_array, shaped, switch, whole_number
from ..machine.manipulator import Manipulator, manipulator
from ..mechanics.trajectory import Trajectory
from .chunks import NOT_RUN, Columns, blunder, run_chunk
from .compiled import DONE, compiled, encode
from .explain import REASONS
from .faults import FaultsLike
from .loop import own_copy
from .patience import progress_bar
from .pools import Stop, answer, pool_of
from .runs import SimulationError, attempt, hand_over
from .sensors import Sensors
from .setup import Setup, prepare
from .studies import Sweep


def sweep(
    robot: Manipulator,
    law: LawLike | Iterable[LawLike],
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

    law : one law for all runs, or k laws in their order, such as PD with other gains.
    offsets : calibration offsets (k, N) in rad, or (N,) for all runs; the other arguments are those of `simulate`.
    executor : any `concurrent.futures` executor to spread the chunks of `chunk` runs; default: one thread per core, or
        one thread and run by run for laws in Python.  Other processes need laws that are written in a module, and know
        them, and what they use, as these were when the process began.
    failed : "raise" raises the error of the first run that fails; "mask" masks the rows of such runs, whose `reasons`
        the result knows.
    progress : show a bar.
    The numbers do not depend on executor, chunk or the order of the rows, to the last bit.
    Raises ValueError for bad arguments and, in the end, for a first answer that is no array of torques;
    SimulationError naming the run and the time, with the run up to there as `partial` and all rows as `sweep`.  When
    the executor dies or you press Ctrl-C, what waits is cancelled, and the exception carries what is finished: its
    `partial` is a `Sweep` in which the other rows are masked.

    >>> import rapkm_lite as rk
    >>> path = rk.hold(rk.load(), [0.0, 0.0])
    >>> rk.sweep(rk.load(), [rk.PD(k, 0.2) for k in (3.0, 7.0)], path, [4e-3, 0.0, 0.0]).energies.shape
    (2, 3)
    """
    manipulator(robot)
    one_of("failed", failed, ("raise", "mask"))
    if executor is not None:
        having("executor", executor, "an executor of concurrent.futures", "submit")
    switch("progress", progress)
    chunk = whole_number("chunk", chunk, 1)
    given, laws, offsets = _rows(law, offsets, robot.n_arms)
    setup = prepare(robot, trajectory, Sensors(0.0, encoder, velocity_filter), model, faults)
    in_python = [own_copy(one) for one in {id(one): one for one in laws}.values() if encode(one, setup) is None]
    width = 1 if executor is None and in_python else chunk
    chunks = {i: (setup, laws[i : i + width], offsets[i : i + width]) for i in range(0, len(laws), width)}
    table = Columns.blank(len(laws), robot.n_arms)
    try:
        with pool_of(executor, 1 if in_python or not compiled() else os.cpu_count() or 1) as pool:
            errors = _collect(pool, chunks, table, progress)
    except BaseException as error:  # also a second Ctrl-C, while the pool ends
        _hand_over_rows(error, table, setup, given, offsets)
        raise
    result = _result(table, setup, given, offsets, mask=failed == "mask" or bool(table.failed.any()))
    i = _blamed(errors, result.failed, failed == "mask")
    if i is not None:
        own = setup._replace(sensors=setup.sensors.with_offset(offsets[i]))
        _raise(i, errors.get(i), own, laws[i], result)
    return result


def _blamed(errors: dict, failed: np.ndarray, mask: bool) -> int | None:
    """The run whose error is raised: the first that is a `blunder`, else the first of all, unless they are masked."""
    wrong = [i for i, stop in errors.items() if blunder(stop.error)]
    if wrong:
        return wrong[0]
    return None if mask or not failed.any() else int(np.argmax(failed))


def _collect(pool: Executor | None, chunks: dict, table: Columns, progress: bool) -> dict:
    """Run the chunks, by their first rows; fills the table and returns what stopped rows in Python.

    Whatever goes wrong, what is finished is in the table, and what waits is cancelled.
    """
    jobs, errors = {}, {}
    try:
        if pool is not None:
            for i, arguments in chunks.items():
                job = pool.submit(run_chunk, *arguments)
                jobs[i] = having("executor.submit(...)", job, "a Future of concurrent.futures", "result", "cancel")
        with progress_bar(len(chunks) if progress else 0) as advance:
            for i, arguments in chunks.items():
                rows, stops = answer(jobs[i]) if jobs else run_chunk(*arguments)
                errors |= table.enter(i, rows, stops)
                advance()
    except BaseException:
        for i, job in jobs.items():
            if not job.cancel() and job.done() and job.exception() is None:
                table.enter(i, *job.result())
        raise
    return errors


def _hand_over_rows(error: BaseException, table: Columns, setup: Setup, law, offsets) -> None:
    """Give an exception the rows that are finished; an interrupt or the end of an executor also when there are none."""
    finished = np.count_nonzero(table.status == DONE)
    if finished or isinstance(error, BrokenExecutor) or not isinstance(error, Exception):
        words = "they are in the `partial` of this exception, a Sweep whose other rows are masked."
        partial = _result(table, setup, law, offsets, mask=True)
        hand_over(error, partial, f"{finished} of {len(table.status)} runs were finished; {words}")


def _raise(i: int, stop: Stop | None, setup: Setup, law, result: Sweep):
    """Raise what stopped run i; what the engine stopped runs once more, for its reason and its samples."""
    if stop is not None and not stop.begun:
        words = f"It was raised at the first sample of run {i} of a sweep; all rows are in its `partial`."
        hand_over(stop.error, result, words)
        raise stop.error
    error: Any = stop.error if stop is not None else attempt(setup, law)[1]
    if not isinstance(error, SimulationError):  # also what could not travel
        error = SimulationError(result.failure_time[i], str(result.stopped[i]))
    raise SimulationError(error.time, error.reason, error.partial, i, result) from error.__cause__


def _several(law) -> bool:
    """Does it hold laws?  Those of a set or dict have no order, and so belong to no rows."""
    single = callable(law) or hasattr(law, "step") or isinstance(law, str | bytes | dict | set | frozenset)
    return np.iterable(law) and not single


def _rows(law, offsets, N: int) -> tuple[object, tuple, np.ndarray]:
    """The law, or all laws as a tuple, as the study keeps it; one law and one row of offsets per run."""
    offsets = real_array("offsets", offsets)
    fits = offsets.ndim <= 2 and offsets.shape[-1:] in ((), (N,))
    shaped("offsets", offsets, fits, f"(k, {N}), one row per run, or ({N},)")
    several = _several(law)
    laws = tuple(law) if several else (law,)
    for one in laws:
        as_law(one)
    k = len(offsets) if offsets.ndim == 2 else len(laws)
    if k == 0:
        raise ValueError("offsets or law is empty; allowed: at least one run")
    if several and len(laws) != k:
        raise ValueError(f"law holds {len(laws)} for {k} rows of offsets; allowed: one law, or one per row")
    rows = np.array(np.broadcast_to(offsets, (k, N)))
    return (laws, laws, rows) if several else (law, laws * k, rows)


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
        *map(column, table[:6]),  # energies to largest_path_error
        failed=failed,
        failure_time=np.ma.array(table.failure_time, mask=~failed | (table.status == NOT_RUN)),
        model=setup.model,
        sensors=setup.sensors,
        faults=setup.broken,
        stopped=tuple(own or words[status] for own, status in zip(table.reason, table.status.tolist(), strict=True)),
    )
