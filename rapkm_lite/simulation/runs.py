"""Sensors, the sampled control loop with zero-order hold, results and experiments (chapter, sections 3 and 4.5)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..control.laws import PD, Law
from ..engine import tables
from ..machine.arguments import bounded, matvec, positive_number, real_array
from ..machine.datafiles import read_toml
from ..machine.manipulator import Manipulator, load
from ..mechanics.actuation import distal_cross_products, drive_pairs
from ..mechanics.kinematics import ee_complement, inverse_kinematics
from ..mechanics.trajectory import Trajectory, triangle
from .compiled import Loop, encode, growth, run_lockstep, run_model_based


class SimulationError(RuntimeError):
    """A run that could not be finished.

    `time` in s says when, `reason` what went wrong, `run` which row of a sweep; `status` is the engine's code.
    """

    def __init__(self, time: float, reason: str, run: int | None = None, status: int = tables.LEFT_WORKSPACE):
        super().__init__(f"{'' if run is None else f'run {run}: '}at t = {time:.4f} s {reason}")
        self.time, self.reason, self.run, self.status = float(time), reason, run, status

    def __reduce__(self):
        return SimulationError, (self.time, self.reason, self.run, self.status)


@dataclass(frozen=True, eq=False)
class Run:
    """Result of a sampled closed loop, one row per sample.

    t : (k,) s.  x, xd : (k, 2) true end-effector motion, m and m/s.  q_a, qd_a : (k, N) true base angles and rates.
    c : (k, N) drive torques in N m; c[k] is held from t[k] to t[k+1] (the last row is not applied any more).
    pairs : (k, 2) independent joints in use at each sample, -1 where the law has none.
    """

    robot: Manipulator
    law: object
    trajectory: Trajectory
    offset: np.ndarray
    t: np.ndarray
    x: np.ndarray
    xd: np.ndarray
    q_a: np.ndarray
    qd_a: np.ndarray
    c: np.ndarray
    pairs: np.ndarray

    @cached_property
    def q(self) -> np.ndarray:
        """All joint angles (k, 2N), rad, closed by construction."""
        elbows = inverse_kinematics(self.robot, self.x)[:, self.robot.n_arms :]
        return np.concatenate([self.q_a, elbows], axis=-1)

    @cached_property
    def qd(self) -> np.ndarray:
        """All joint rates (k, 2N), rad/s."""
        return matvec(ee_complement(self.robot, self.q), self.xd)

    @property
    def dt(self) -> float:
        """Sampling time in s."""
        return self.trajectory.dt

    @property
    def energy(self) -> np.ndarray:
        """Electric energy per drive (N,) in J, regenerative: sum over the holds of R (c/k_t)^2 dt + c (q_k+1 - q_k)."""
        held = self.c[:-1]
        copper = self.robot.resistance * np.sum((held / self.robot.torque_constant) ** 2, axis=0) * self.dt
        return copper + np.sum(held * np.diff(self.q_a, axis=0), axis=0)

    @property
    def error(self) -> np.ndarray:
        """Joint errors q_a - q_a^d (k, N) of the true base angles, rad."""
        return self.q_a - self.trajectory.q_a

    @property
    def switches(self) -> int:
        """How often the pair of independent joints was changed."""
        return int(np.count_nonzero(np.any(np.diff(self.pairs, axis=0) != 0, axis=-1)))

    def __repr__(self):
        joules = ", ".join(f"{e:.3f}" for e in self.energy)
        return f"Run({self.t[-1]:g} s, {type(self.law).__name__}, energy ({joules}) J)"


def simulate(robot: Manipulator, law, trajectory: Trajectory, offset=0.0, encoder=None,
             model: Manipulator | None = None, velocity_filter: float | None = None) -> Run:
    """Run a control law on the machine along a trajectory, sampled at the trajectory's rate with zero-order hold.

    The run starts at rest at the first point of the path.  The controller measures q_a + offset and the true rates.

    law : a law of `rapkm_lite.control`, or any callable ``(t, q_a, qd_a, desired) -> c`` with c (N,) in N m.
    offset : calibration offsets (N,) in rad, measured minus true angle.
    encoder : counts per turn (quantization to the nearest count), or None for ideal angles.
    model : the controller's own manipulator, when it differs from the machine; it also sets the desired angles.
    velocity_filter : time constant in s of the rate from backward differences of the measured angles, through a
        first-order low-pass; None for the true rates.
    Raises ValueError for bad arguments, SimulationError with the time when the run leaves the workspace, loses its
    pose or meets a singularity of its coordinates.
    """
    model, quantum, tau = check_setup(robot, encoder, model, velocity_filter)
    offset = _per_drive("offset", offset, robot.n_arms)
    trajectory = trajectory.for_robot(model)
    inverse_kinematics(robot, trajectory.x[0])
    arrays = states, q_a, qd_a, c, pairs = _allocate(len(trajectory), robot.n_arms)
    code = encode(law, model, robot) if isinstance(law, Law) else None
    note = ""
    if code is None:
        status, k, note = Loop(robot, law, model, trajectory, offset, quantum, tau).run(*arrays)
    else:
        run = run_lockstep if code.lockstep else run_model_based
        status, k = run(robot, model, trajectory, code, offset, quantum, tau, *arrays)
    if status != tables.DONE:
        reason = note or explain(status, k, robot, law, model, trajectory, offset)
        raise SimulationError(trajectory.t[k], reason, status=status)
    return Run(robot, law, trajectory, offset, trajectory.t, states[:, :2], states[:, 2:], q_a, qd_a, c, pairs)


def check_setup(robot, encoder, model, velocity_filter) -> tuple[Manipulator, float, float]:
    """The controller's model, the angle of one encoder count in rad (0: ideal) and the filter time in s (-1: none)."""
    model = robot if model is None else model
    if model.n_arms != robot.n_arms:
        raise ValueError(f"model has {model.n_arms} arms, the machine {robot.n_arms}; allowed: the same number")
    quantum = 0.0 if encoder is None else 2 * np.pi / positive_number("encoder", encoder)
    if velocity_filter is None:
        return model, quantum, -1.0
    tau = real_array("velocity_filter", velocity_filter)
    if tau.ndim:
        raise ValueError(f"velocity_filter has shape {tau.shape}; allowed: one number")
    return model, quantum, float(bounded("velocity_filter", tau, 0.0, strict=False))


REASONS = {
    tables.LEFT_WORKSPACE: "the machine left the workspace",
    tables.NO_POSE: "the measured base angles fit no pose of the controller's model",
    tables.SINGULAR: "the independent coordinates of the law became singular: its torques are not finite",
}


def explain(status: int, k: int, robot, law, model, trajectory, offset) -> str:
    """What went wrong at sample k, and whether the sampled loop is unstable there or was led astray."""
    factor = growth((robot, law, model, trajectory, offset), k)
    pair = getattr(law, "independent", None)
    if pair is not None and tuple(sorted(pair)) in drive_pairs(model):
        measure = abs(distal_cross_products(model, trajectory.q[k])[drive_pairs(model).index(tuple(sorted(pair)))])
        if measure < 0.3:
            return (f"{REASONS[status]} (near a parameterization singularity of its independent drives "
                    f"{pair[0] + 1} and {pair[1] + 1}: |d_j x d_k| = {measure:.2g} at the desired pose)")
    if factor is not None and factor > 1.05:
        cause = (f"unstable gain: near the desired state the sampled loop magnifies an error {factor:.3g}-fold per "
                 f"sample of {trajectory.dt:g} s")
    elif factor is not None and factor > 1.001:
        cause = f"the gains do not hold it: near the desired state an error grows by the factor {factor:.4g} per sample"
    elif factor is not None:
        cause = (f"near the desired state an error changes only by the factor {factor:.4g} per sample, so look at "
                 "offsets, a weak gain, or a path too near the boundary")
    else:
        cause = "look at gains, offsets and the path"
    return f"{REASONS[status]} ({cause})"


def _per_drive(name: str, value, N: int) -> np.ndarray:
    array = real_array(name, value)
    if array.shape not in ((), (N,)):
        raise ValueError(f"{name} has shape {array.shape}; allowed: one number or ({N},), one value per drive")
    return np.array(np.broadcast_to(array, (N,)))


def _allocate(samples: int, N: int):
    states, q_a, qd_a, c = np.zeros((samples, 4)), *(np.zeros((samples, N)) for _ in range(3))
    return states, q_a, qd_a, c, np.full((samples, 2), -1)


@dataclass(frozen=True, eq=False)
class Experiment:
    """A machine, a law, a path and sensors that belong together, as read from a data file."""

    robot: Manipulator
    law: PD
    trajectory: Trajectory
    offset: np.ndarray
    encoder: int | None

    def run(self, law=None) -> Run:
        """Simulate it, by default with its own law."""
        return simulate(self.robot, law or self.law, self.trajectory, self.offset, self.encoder)


def experiment(source="testbed") -> Experiment:
    """Machine, gains, path and sensors of a data file with the tables [manipulator], [control], [path] and [sensor].

    Raises ValueError for an unknown key or a value out of range.
    """
    robot, tables = load(source), read_toml(source)
    allowed = {"control": {"K_P", "K_D", "dt"}, "path": {"side", "duration", "centre", "angle", "rest"},
               "sensor": {"offset", "encoder"}}
    for table, keys in allowed.items():
        for key in tables.get(table, {}):
            if key not in keys:
                raise ValueError(f"unknown TOML key {key!r} in [{table}]; allowed: {', '.join(sorted(keys))}")
        if table != "sensor" and table not in tables:
            raise ValueError(f"the file {str(source)!r} lacks the table [{table}], which an experiment needs")
    control, sensor = tables["control"], tables.get("sensor", {})
    path = triangle(robot, dt=control.get("dt", 1e-3), **tables["path"])
    law = PD(control["K_P"], control["K_D"])
    offset = _per_drive("offset", sensor.get("offset", 0.0), robot.n_arms)
    return Experiment(robot, law, path, offset, sensor.get("encoder"))
