"""What a run needs but for its law, and how it ended: what the loops take and give."""

from __future__ import annotations

import functools
from typing import NamedTuple

import numpy as np

from ..control.compiled_law import CompiledLaw
from ..machine.arguments import of_kind
from ..machine.manipulator import Manipulator, manipulator
from ..mechanics import cores
from ..mechanics.kinematics import inverse_kinematics
from ..mechanics.trajectory import Desired, Trajectory
from .faults import Fault, FaultTable, check_faults, fault_table
from .sensors import Sensors


class Setup(NamedTuple):
    """A checked run but for its law: `trajectory` is that of `model`, `sensors` have (N,) offsets; made by `prepare`.

    faults : the table of all faults, or None for a healthy machine.  broken : the faults themselves.
    """

    robot: Manipulator
    model: Manipulator
    trajectory: Trajectory
    sensors: Sensors
    faults: FaultTable | None
    broken: tuple[Fault, ...] = ()

    def suits(self, law: CompiledLaw) -> bool:
        """Do the loops close where a compiled law asks for matrices?  Where not, it runs in Python, which says so."""
        if law.at == "desired" and self.trajectory._apart is not None:
            try:
                cores.closed(self.model.tree, cores.link_vectors(self.model.tree, self.trajectory.q))
            except ValueError:
                return False
        return True

    def begin(self, samples: int) -> Setup:
        """The first samples of the run, two at least."""
        path, faults, rows = self.trajectory, self.faults, slice(max(samples, 2))
        motion = {name: getattr(path, name)[rows] for name in ("x", "xd", "xdd", "q", "qd", "qdd", "t")}
        if faults is not None:
            faults = faults._replace(**{k: v[rows] for k, v in faults._asdict().items() if k != "limit"})
        return self._replace(trajectory=path._changed(**motion), faults=faults)


class Outcome(NamedTuple):
    """How a run ended, and its history: the columns of a `Run`, with a row for every sample of the path.

    status : DONE; LEFT_WORKSPACE or TOO_STIFF, in the hold after `sample`; or what kept the law from an answer there.
    Rows from `sample` on hold nothing when the run has failed, but for the row `sample` itself where a hold failed.
    """

    status: int
    sample: int
    x: np.ndarray
    xd: np.ndarray
    q_a: np.ndarray
    qd_a: np.ndarray
    c: np.ndarray
    pairs: np.ndarray


@functools.lru_cache(maxsize=64)
def _reach(robot: Manipulator, x: float, y: float) -> None:
    """Raises ValueError where the machine does not reach a point."""
    inverse_kinematics(robot, [x, y])


def _check_samples(path: Trajectory) -> None:
    """Raise ValueError where the samples of a user's class, which laws in Python follow, are not its columns."""
    if all(getattr(type(path), name) is getattr(Trajectory, name) for name in ("__getitem__", "q_a", "qd_a", "qdd_a")):
        return
    columns = path.x, path.xd, path.xdd, path.q, path.qd, path.qdd
    for k in range(len(path)):
        sample, row = path[k], Desired(path.n_arms, *(column[k] for column in columns))
        names = "x", "xd", "xdd", "q", "qd", "qdd", "q_a", "qd_a", "qdd_a"
        if not all(np.array_equal(getattr(sample, name), getattr(row, name)) for name in names):
            raise ValueError(
                f"trajectory[{k}] of the class {type(path).__name__} is not the row {k} of x, xd, xdd, q, qd and qdd, "
                "which compiled loops follow; allowed: other rows, see follow and Trajectory.with_set_points"
            )


def prepare(robot: Manipulator, trajectory: Trajectory, sensors: Sensors, model=None, faults=()) -> Setup:
    """The one check of the arguments of `simulate` and `sweep`.

    Raises ValueError for what does not fit together, and where the machine does not reach the start of the path.
    """
    manipulator(robot)
    model = robot if model is None else manipulator(model, "model")
    of_kind("trajectory", trajectory, Trajectory, "a Trajectory, such as triangle(robot) returns")
    _check_samples(trajectory)
    of_kind("sensors", sensors, Sensors, "Sensors")
    if model.n_arms != robot.n_arms:
        raise ValueError(f"model has {model.n_arms} arms, the machine {robot.n_arms}; allowed: the same number")
    try:
        # A path that fits is kept: loops in Python find its samples made.
        trajectory = trajectory if model.same_kinematics(trajectory.robot) else trajectory.for_robot(model)
    except ValueError as error:
        raise ValueError(f"{'robot' if model is robot else 'model'} cannot follow the trajectory: {error}") from None
    _reach(robot, *trajectory.x[0].tolist())
    N = robot.n_arms
    faults = check_faults(faults)
    return Setup(robot, model, trajectory, sensors.of_drives(N), fault_table(faults, trajectory.t, N), faults)
