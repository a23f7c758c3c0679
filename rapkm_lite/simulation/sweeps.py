"""Studies: thousands of runs of one machine on one path, with other offsets or gains in every run."""

from __future__ import annotations

import os
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from ..control.laws import Law
from ..engine import COMPILED, lanes, tables
from ..machine.arguments import real_array
from ..machine.manipulator import Manipulator
from ..mechanics.kinematics import inverse_kinematics
from ..mechanics.trajectory import Trajectory
from .compiled import LANES, encode, lockstep
from .energy import antagonistic_energy
from .patience import progress_bar
from .runs import REASONS, SimulationError, check_setup, simulate


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
        if self.failed.any():
            raise ValueError(f"{int(self.failed.sum())} runs failed; take the masked array `energies` instead")
        return np.array(self.energies, dtype=dtype)

    def __repr__(self):
        total = self.energies.sum(axis=-1)
        ends = "" if self.failed.all() else f", total energy {total.min():.3g} to {total.max():.3g} J"
        return f"Sweep({len(self)} runs, {int(self.failed.sum())} failed{ends})"


def sweep(robot: Manipulator, law, trajectory: Trajectory, offsets, encoder=None, model: Manipulator | None = None,
          velocity_filter: float | None = None, executor: Executor | None = None, failed: str = "raise",
          chunk: int = 64, progress: bool = False) -> Sweep:
    """Run a law on the machine along a trajectory once per row of `offsets`, many runs at a time.

    law : one law for all runs, or a sequence of k laws, such as PD with other gains.
    offsets : calibration offsets (k, N) in rad, or (N,) for all runs; the other arguments are those of `simulate`.
    executor : any `concurrent.futures` executor to spread the chunks of `chunk` runs; default: one thread per core.
    failed : "raise" stops at the first run that fails; "mask" masks the rows of such runs.
    progress : show a bar.
    Decentralized laws run 16 side by side; other laws one by one.  The numbers do not depend on executor, chunk or the
    order of the rows, to the last bit.
    Raises ValueError for bad arguments, SimulationError naming the run and the time.
    """
    if failed not in ("raise", "mask"):
        raise ValueError(f"failed = {failed!r}; allowed: 'raise' or 'mask'")
    if not isinstance(chunk, (int, np.integer)) or chunk < 1:
        raise ValueError(f"chunk = {chunk!r}; allowed: a whole number >= 1")
    laws, offsets = _rows(law, offsets, robot.n_arms)
    setup = (encoder, model, velocity_filter)
    trajectory = trajectory.for_robot(check_setup(robot, *setup)[0])
    inverse_kinematics(robot, trajectory.x[0])
    own = executor or ThreadPoolExecutor(os.cpu_count())
    parts = []
    try:
        jobs = [own.submit(run_chunk, robot, laws[i : i + chunk], trajectory, offsets[i : i + chunk], setup)
                for i in range(0, len(offsets), chunk)]
        with progress_bar(len(jobs) if progress else 0) as advance:
            for job in jobs:
                parts.append(job.result())
                advance()
    finally:
        if executor is None:
            own.shutdown(cancel_futures=True)
    *numbers, times, status = (np.concatenate(column) for column in zip(*parts, strict=True))
    broken = status != tables.DONE
    if failed == "raise" and broken.any():
        i = int(np.argmax(broken))
        reason = REASONS[status[i]]
        try:
            simulate(robot, laws[i], trajectory, offsets[i], *setup)
        except SimulationError as error:
            reason = error.reason
        raise SimulationError(times[i], reason, run=i)
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


def run_chunk(robot, laws, trajectory, offsets, setup) -> tuple:
    """Energies, torque norm, antagonistic energy, final position, failure time and status of some runs.

    A function of values only, so that any executor can send it to another process.
    """
    model, quantum, tau = check_setup(robot, *setup)
    own = {id(law): encode(law, model, robot) if isinstance(law, Law) else None for law in laws}
    codes = [own[id(law)] for law in laws]
    first = codes[0]
    together = all(code is not None and code.lockstep and (code.form, code.pose) == (first.form, first.pose)
                   for code in codes)
    if not together:
        rows = [_single(robot, law, trajectory, offset, setup) for law, offset in zip(laws, offsets, strict=True)]
        return tuple(np.array(column) for column in zip(*rows, strict=True))
    K_P, K_D = np.array([code.K_P for code in codes]), np.array([code.K_D for code in codes])
    width = LANES if COMPILED else 1
    # The last runs fill up with copies of themselves: a lane does not feel its neighbours.
    index = np.minimum(np.arange(-(-len(laws) // width) * width), len(laws) - 1).reshape(-1, width)
    parts = [_lockstep(robot, model, trajectory, first, K_P[i], K_D[i], offsets[i], quantum, tau) for i in index]
    return tuple(np.concatenate(column)[: len(laws)] for column in zip(*parts, strict=True))


def _lockstep(robot, model, trajectory, code, K_P, K_D, offsets, quantum, tau) -> tuple:
    """`run_chunk` for as many runs as the engine takes side by side."""
    w, blocks = lockstep(robot, model, trajectory, code, K_P, K_D, offsets, quantum, tau)
    dt = trajectory.dt
    status, sample = w[lanes.STATUS].astype(int), w[lanes.SAMPLE].astype(int)
    done = status == tables.DONE
    weight = robot.resistance / robot.torque_constant**2
    energies = blocks[lanes.COPPER].T * weight * dt + blocks[lanes.WORK].T
    norm = np.sqrt(np.where(done, w[lanes.TORQUE2], 0.0) / (len(trajectory) - 1))
    return (np.where(done[:, None], energies, 0.0), norm, np.where(done, w[lanes.ANTAGONISM] * dt, 0.0),
            np.where(done[:, None], w[[lanes.X, lanes.Y]].T, 0.0), trajectory.t[np.where(done, 0, sample)], status)


def _single(robot, law, trajectory, offset, setup) -> tuple:
    """The same for one run of any law."""
    try:
        run = simulate(robot, law, trajectory, offset, *setup)
    except SimulationError as error:
        return np.zeros(robot.n_arms), 0.0, 0.0, np.zeros(2), error.time, error.status
    norm = np.sqrt(np.mean(np.sum(run.c[:-1] ** 2, axis=-1)))
    return run.energy, norm, antagonistic_energy(run), run.x[-1], 0.0, tables.DONE
