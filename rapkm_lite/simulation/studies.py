"""What comes out of a study: a row per run, and why some rows hold nothing."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..control.grammar import as_law
from ..machine.arguments import shaped, short
from ..machine.manipulator import Manipulator
from ..machine.values import Value, default
from ..mechanics.trajectory import Trajectory
from .chunks import Columns
from .explain import REASONS
from .faults import Fault, check_faults
from .runs import SimulationError, complete
from .sensors import Sensors
from .setup import prepare


@dataclass(frozen=True, eq=False, repr=False)
class Sweep(Value):
    """Result of `sweep`, one row per run; rows of failed runs are masked, and zero under the mask: use `compressed`.

    A file keeps no mask, so `np.savez` and `np.savetxt` write the zeros: save ``study.energies[~study.failed]``;
    `pickle` keeps all, a law of yours by the name of its module.  What is left of a study that was stopped is
    ``study.offsets[study.failed]``, with the laws of these rows; write what a sweep of them gives into copies:
    ``energies = np.ma.copy(study.energies)``, ``energies[study.failed] = rest.energies``.
    law : the law, or a tuple of k.  offsets : (k, N) rad; robot and trajectory were the same for all runs.
    energies : (k, N) electric energy per drive in J, as `Run.energy`.
    torque_norm : (k,) root mean square over time of the Euclidean norm of the drive torques, N m.
    antagonistic_energy : (k,) J, (R_el / k_t^2) times the integral of ||c_null||^2 at the true pose.
    x_final : (k, 2) end-effector position at the end, m.
    rms_path_error, largest_path_error : (k,) of `Run.path_error` over the samples, root mean square and maximum, m.
    failed : (k,) True where a run could not be finished.  failure_time : (k,) s, masked where it could.
    model, sensors, faults : the controller's own manipulator, how all runs measured but for their offsets, and what was
        broken.
    stopped : (k,) in a few words what stopped each run, None where nothing did; `reasons` says why.

    >>> import numpy as np, rapkm_lite as rk
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
        if isinstance(self.law, list | tuple) and not callable(self.law) and not hasattr(self.law, "step"):
            self._set(law=tuple(self.law))  # also of a class of a user's
        for law in self.law if type(self.law) is tuple else [self.law]:
            as_law(law)
        self._set(faults=check_faults(self.faults), model=self.robot if self.model is None else self.model)
        super().__post_init__()
        self._check_rows()
        words = self.stopped
        if type(words) is tuple and not words:
            words = tuple("it failed" if failed else None for failed in self.failed)
        if type(words) is not tuple or len(words) != len(self) or any(not isinstance(w, str | None) for w in words):
            raise ValueError(f"stopped = {short(words)}; allowed: a string or None for each of {len(self)} runs")
        self._set(stopped=words)

    def _check_rows(self) -> None:
        """As many rows in all columns, and laws where there are several."""
        shaped("failed", self.failed, self.failed.ndim == 1, "(k,), one truth value per run")
        blank = Columns.blank(len(self), self.robot.n_arms)
        for name in ("offsets", *Columns._fields[:-2]):
            given, shape = getattr(self, name), getattr(blank, name, blank.energies).shape
            shaped(name, given, given.shape == shape, f"{shape}, a row per run")
        if type(self.law) is tuple and len(self.law) != len(self):
            raise ValueError(f"law holds {len(self.law)} for {len(self)} rows; allowed: one law, or one per row")

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
            law = self.law[i] if type(self.law) is tuple else self.law
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
            raise ValueError(f"{self.failed.sum()} of {len(self)} runs failed; take the masked `energies` instead")
        return np.array(self.energies, dtype=dtype)

    def __repr__(self):
        total = self.energies.sum(axis=-1)
        ends = "" if self.failed.all() else f", total energy {total.min():.3g} to {total.max():.3g} J"
        return f"Sweep({len(self)} runs, {int(self.failed.sum())} failed{ends})"
