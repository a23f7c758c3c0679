"""Studies: thousands of runs of one machine on one path, with other offsets or gains in every run."""

from __future__ import annotations

import os
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from ._arguments import real_array
from .control import Law
from .energy import antagonistic_energy
from .manipulator import Manipulator
from .simulation import SimulationError, simulate
from .trajectory import Trajectory


@dataclass(frozen=True, eq=False)
class Sweep:
    """Result of `sweep`, one row per run; rows of failed runs are masked.

    energies : (k, N) electric energy per drive in J, as `Run.energy`.
    torque_norm : (k,) root mean square over time of the Euclidean norm of the drive torques, N m.
    antagonistic_energy : (k,) J, (R / k_t^2) times the integral of ||c_null||^2 at the true pose.
    x_final : (k, 2) end-effector position at the end, m.
    failed : (k,) True where a run could not be finished.  failure_time : (k,) s, masked where it could.
    """

    robot: Manipulator
    law: object
    trajectory: Trajectory
    offsets: np.ndarray
    energies: np.ndarray
    torque_norm: np.ndarray
    antagonistic_energy: np.ndarray
    x_final: np.ndarray
    failed: np.ndarray
    failure_time: np.ndarray

    @property
    def energy(self) -> np.ndarray:
        """The same as `energies`."""
        return self.energies

    def __len__(self) -> int:
        return len(self.failed)

    def __array__(self, dtype=None, copy=None):
        return np.array(self.energies, dtype=dtype)

    def __repr__(self):
        total = self.energies.sum(axis=-1)
        ends = "" if self.failed.all() else f", total energy {total.min():.3g} to {total.max():.3g} J"
        return f"Sweep({len(self)} runs, {int(self.failed.sum())} failed{ends})"


def sweep(robot: Manipulator, law, trajectory: Trajectory, offsets, encoder=None, model: Manipulator | None = None,
          velocity_filter: float | None = None, executor: Executor | None = None, failed: str = "raise",
          chunk: int = 256) -> Sweep:
    """Run a law on the machine along a trajectory once per row of `offsets`, many runs at a time.

    law : one law for all runs, or a sequence of k laws, such as PD with other gains.
    offsets : calibration offsets (k, N) in rad, or (N,) for all runs; the other arguments are those of `simulate`.
    executor : any `concurrent.futures` executor to spread the chunks of `chunk` runs; default: one thread per core.
    failed : "raise" stops at the first run that fails; "mask" masks the rows of such runs.
    The numbers do not depend on executor, chunk or the order of the rows, to the last bit.
    Raises ValueError for bad arguments, SimulationError naming the run and the time.
    """
    if failed not in ("raise", "mask"):
        raise ValueError(f"failed = {failed!r}; allowed: 'raise' or 'mask'")
    if int(chunk) != chunk or chunk < 1:
        raise ValueError(f"chunk = {chunk!r}; allowed: a whole number >= 1")
    laws, offsets = _rows(law, offsets, robot.n_arms)
    own = executor or ThreadPoolExecutor(os.cpu_count())
    try:
        jobs = [own.submit(run_chunk, robot, laws[i:i + chunk], trajectory, offsets[i:i + chunk], encoder, model,
                           velocity_filter) for i in range(0, len(offsets), chunk)]
        parts = [job.result() for job in jobs]
    finally:
        if executor is None:
            own.shutdown(cancel_futures=True)
    results = [np.concatenate(column) for column in zip(*(part[:-1] for part in parts), strict=True)]
    *numbers, times = results
    reasons = [reason for part in parts for reason in part[-1]]
    broken = np.array([reason is not None for reason in reasons])
    if failed == "raise" and broken.any():
        i = int(np.argmax(broken))
        raise SimulationError(times[i], reasons[i], run=i)
    if failed == "mask":
        numbers = [np.ma.array(v, mask=np.broadcast_to(broken.reshape(-1, *[1] * (v.ndim - 1)), v.shape))
                   for v in numbers]
    return Sweep(robot, law, trajectory, offsets, *numbers, broken, np.ma.array(times, mask=~broken))


def _rows(law, offsets, N: int) -> tuple[list, np.ndarray]:
    """One law and one row of offsets per run."""
    offsets = real_array("offsets", offsets)
    if offsets.ndim > 2 or (offsets.ndim and offsets.shape[-1] != N):
        raise ValueError(f"offsets has shape {offsets.shape}; allowed: (k, {N}), one row per run, or ({N},)")
    several = not isinstance(law, Law) and not callable(law)
    laws = list(law) if several else [law]
    k = len(offsets) if offsets.ndim == 2 else len(laws)
    if k == 0:
        raise ValueError("offsets or law is empty; allowed: at least one run")
    if several and len(laws) != k:
        raise ValueError(f"law holds {len(laws)} laws for {k} rows of offsets; allowed: one law, or one per row")
    return laws if several else laws * k, np.array(np.broadcast_to(offsets, (k, N)))


def run_chunk(robot, laws, trajectory, offsets, encoder, model, velocity_filter) -> tuple:
    """Energies, torque norm, antagonistic energy, final position, failure time and reason of some runs, one by one."""
    k, N = offsets.shape
    energies, norm, antagonism, x_final, times = (np.zeros(s) for s in ((k, N), k, k, (k, 2), k))
    reasons = [None] * k
    for i, (law, offset) in enumerate(zip(laws, offsets, strict=True)):
        try:
            run = simulate(robot, law, trajectory, offset, encoder, model, velocity_filter)
        except SimulationError as error:
            times[i], reasons[i] = error.time, error.reason
            continue
        energies[i], x_final[i] = run.energy, run.x[-1]
        norm[i] = np.sqrt(np.mean(np.sum(run.c[:-1] ** 2, axis=-1)))
        antagonism[i] = antagonistic_energy(run)
    return energies, norm, antagonism, x_final, times, reasons
