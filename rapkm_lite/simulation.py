"""Sensors, the sampled control loop with zero-order hold, results and experiments (chapter, sections 3 and 4.5)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from . import engine
from ._arguments import ConvergenceError, bounded, matvec, positive_number, real_array
from .control import (
    APD,
    CTC,
    PD,
    AntagonismFilter,
    CommandFilter,
    Controller,
    Law,
    RedundantAPD,
    RedundantCTC,
    SwitchedCTC,
)
from .kinematics import ee_complement, inverse_kinematics
from .manipulator import Manipulator, load, read_toml
from .trajectory import Trajectory, triangle


class SimulationError(RuntimeError):
    """A run that could not be finished; `time` in s says when, `reason` what went wrong, `run` which row of a sweep."""

    def __init__(self, time: float, reason: str, run: int | None = None):
        super().__init__(f"{'' if run is None else f'run {run}: '}at t = {time:.4f} s {reason}")
        self.time, self.reason, self.run = float(time), reason, run

    def __reduce__(self):
        return SimulationError, (self.time, self.reason, self.run)


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


def simulate(robot: Manipulator, law, trajectory: Trajectory, offset=0.0, encoder=None, model: Manipulator | None = None,
             velocity_filter: float | None = None) -> Run:
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
    model = robot if model is None else model
    if model.n_arms != robot.n_arms:
        raise ValueError(f"model has {model.n_arms} arms, the machine {robot.n_arms}; allowed: the same number")
    N = robot.n_arms
    offset = _per_drive("offset", offset, N)
    quantum = 0.0 if encoder is None else 2 * np.pi / positive_number("encoder", encoder)
    tau = -1.0 if velocity_filter is None else float(bounded("velocity_filter", real_array(
        "velocity_filter", velocity_filter), 0.0, strict=False))
    trajectory = trajectory.for_robot(model)
    inverse_kinematics(robot, trajectory.x[0])
    coded = encode(law, model) if isinstance(law, Law) else None
    arrays = _allocate(len(trajectory), N)
    if coded is not None:
        status, k = engine.closed_loop(
            engine.arm_table(robot), engine.environment(robot), engine.arm_table(model), engine.environment(model),
            engine.motion_table(trajectory), trajectory.dt, *coded, offset, quantum, tau, *arrays)
        if status != engine.DONE:
            raise SimulationError(trajectory.t[k], _REASONS[status])
    else:
        _python_loop(robot, law, model, trajectory, offset, quantum, tau, *arrays)
    states, q_a, qd_a, c, pairs = arrays
    return Run(robot, law, trajectory, offset, trajectory.t, states[:, :2], states[:, 2:], q_a, qd_a, c, pairs)


_REASONS = {
    engine.LEFT_WORKSPACE: "the machine left the workspace: an unstable gain, a too large offset, or a path too near the "
                           "boundary",
    engine.NO_POSE: "the measured base angles fit no pose of the controller's model",
    engine.SINGULAR: "the independent coordinates of the law became singular",
}


def _per_drive(name: str, value, N: int) -> np.ndarray:
    array = real_array(name, value)
    if array.shape not in ((), (N,)):
        raise ValueError(f"{name} has shape {array.shape}; allowed: one number or ({N},), one value per drive")
    return np.array(np.broadcast_to(array, (N,)))


def _allocate(samples: int, N: int):
    states, q_a, qd_a, c = np.empty((samples, 4)), *(np.empty((samples, N)) for _ in range(3))
    return states, q_a, qd_a, c, np.full((samples, 2), -1)


def encode(law: Law, model: Manipulator):
    """The engine's arguments (law, form, pose, K_P, K_D, pair, hysteresis) for a law, or None where it has no code.

    The engine knows diagonal gains and W = I; everything else runs through the textbook layer.
    """
    N, form, pose = model.n_arms, engine.NO_FILTER, engine.TRUE if law.pose == "true" else engine.MEASURED
    if isinstance(law, (AntagonismFilter, CommandFilter)) and isinstance(law.law, PD):
        form = engine.FORCE_FILTER if isinstance(law, AntagonismFilter) else engine.COMMAND_FILTER
        law = law.law
    codes = {PD: engine.PD, APD: engine.APD, CTC: engine.CTC, SwitchedCTC: engine.SWITCHED,
             RedundantAPD: engine.REDUNDANT_APD, RedundantCTC: engine.REDUNDANT_CTC}
    code = codes.get(type(law))
    if code is None or getattr(law, "W", None) is not None:
        return None
    if code == engine.REDUNDANT_CTC and not law.projected:
        code = engine.REDUNDANT_CTC_LINE2
    size = N if code == engine.PD else 2 * N if isinstance(law, RedundantAPD) else 2
    gains = []
    for name in ("K_P", "K_D"):
        K = getattr(law, name)
        if K.ndim == 2:
            return None
        if K.ndim == 1 and K.shape != (size,) and not (size == 2 * N and K.shape == (N,)):
            raise ValueError(f"{name} has shape {K.shape}; allowed: one number or ({size},)")
        gains.append(np.resize(np.concatenate([K, np.zeros(size - len(K))]), size) if K.ndim else np.full(size, float(K)))
    pair = np.array([-1, -1])
    if isinstance(law, APD) and law.independent is not None:
        if max(law.independent) >= 2 * N:
            raise ValueError(f"independent = {law.independent}; allowed: joint indices from 0 to {2 * N - 1}")
        pair = np.array(law.independent)
    return code, form, pose, *gains, pair, float(getattr(law, "hysteresis", 1.0))


def _python_loop(robot, law, model, trajectory, offset, quantum, tau, states, q_a, qd_a, c, pairs) -> None:
    """The sampled loop with a law in Python and the compiled plant."""
    N, dt = robot.n_arms, trajectory.dt
    arms, env, table = engine.arm_table(robot), engine.environment(robot), engine.motion_table(trajectory)
    controller = Controller(law, model) if isinstance(law, Law) else None
    x = np.concatenate([trajectory.x[0], trajectory.xd[0]])
    last, slow = None, np.zeros(N)
    for k, t in enumerate(trajectory.t):
        engine.sense(arms, table[k], *x, q_a[k], qd_a[k])
        states[k] = x
        angle, rate = q_a[k] + offset, qd_a[k].copy()
        if quantum > 0.0:
            angle = quantum * np.floor(angle / quantum + 0.5)
        if tau >= 0.0:
            slow = slow if last is None else slow + dt / (tau + dt) * ((angle - last) / dt - slow)
            last, rate = angle, slow
        try:
            if controller is not None:
                c[k] = controller(t, angle, rate, trajectory[k], truth=(x[:2], x[2:]))
                pairs[k] = pairs[k] if controller.pair is None else controller.pair
            else:
                c[k] = _student_torque(law, t, angle, rate, trajectory[k])
        except ConvergenceError as error:
            raise SimulationError(t, str(error)) from error
        if k + 1 < len(trajectory):
            x = np.array(engine.advance(arms, env, *x, c[k], dt))
            if not np.all(np.isfinite(x)) or not all(np.isfinite(engine.arm_geometry(arm, x[0], x[1])[5]) for arm in arms):
                raise SimulationError(t, _REASONS[engine.LEFT_WORKSPACE])


def _student_torque(law, t, q_a, qd_a, desired) -> np.ndarray:
    """Call a law written by a user and say what to change when the answer does not fit."""
    if not callable(law):
        raise ValueError(f"law = {law!r}; allowed: a law of this package or a function (t, q_a, qd_a, desired) -> c")
    c = law(t, q_a, qd_a, desired)
    if c is None:
        raise ValueError("law returned None; allowed: the drive torques c, an array (N,) in N m (is a return missing?)")
    c = real_array(f"law(t = {t:.4f} s, ...)", c)
    if c.shape != q_a.shape:
        raise ValueError(f"law returned the shape {c.shape}; allowed: {q_a.shape}, one torque in N m per drive")
    return c


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
    return Experiment(robot, law, path, _per_drive("offset", sensor.get("offset", 0.0), robot.n_arms), sensor.get("encoder"))
