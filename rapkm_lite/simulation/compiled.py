"""From laws and machines to the compiled engine and back: one run, or lanes of runs."""

from __future__ import annotations

import weakref
from dataclasses import dataclass

import numpy as np

from ..control.computed_torque import APD, CTC, RedundantAPD, RedundantCTC, SwitchedCTC
from ..control.controller import Controller
from ..control.laws import PD, AntagonismFilter, CommandFilter, Law
from ..engine import COMPILED, lanes, tables
from ..machine.arguments import ConvergenceError, real_array
from .patience import patience

LANES = 16
_motions = weakref.WeakKeyDictionary()
_machines = weakref.WeakKeyDictionary()


@dataclass(frozen=True, eq=False)
class Code:
    """A law as the engine knows it; `law` and `form` are codes of `engine.tables`, gains one per coordinate."""

    law: int
    form: int
    pose: int
    K_P: np.ndarray
    K_D: np.ndarray
    pair: tuple[int, int] = (-1, -1)
    hysteresis: float = 1.0

    @property
    def lockstep(self) -> bool:
        """True for the decentralized laws, which `engine.lockstep` runs."""
        return self.law == tables.PD


_LAWS = {PD: tables.PD, APD: tables.APD, CTC: tables.CTC, SwitchedCTC: tables.SWITCHED,
         RedundantAPD: tables.REDUNDANT_APD, RedundantCTC: tables.REDUNDANT_CTC}


def encode(law, model, robot) -> Code | None:
    """The engine's form of a law, or None where it has none: then the law runs through the textbook layer.

    The engine knows diagonal gains and W = I.
    """
    N, form, pose = model.n_arms, tables.NO_FILTER, tables.MEASURED
    if getattr(law, "pose", None) == "true":
        pose = tables.TRUE_SAME if model.same_kinematics(robot) else tables.TRUE
    if isinstance(law, (AntagonismFilter, CommandFilter)) and isinstance(law.law, PD):
        form = tables.FORCE_FILTER if isinstance(law, AntagonismFilter) else tables.COMMAND_FILTER
        law = law.law
    code = _LAWS.get(type(law))
    if code is None or getattr(law, "W", None) is not None:
        return None
    if code == tables.REDUNDANT_CTC and not law.projected:
        code = tables.REDUNDANT_CTC_LINE2
    if law.K_P.ndim == 2 or law.K_D.ndim == 2:
        return None
    size = N if code == tables.PD else 2 * N if isinstance(law, RedundantAPD) else 2
    gains = [_diagonal(name, getattr(law, name), size, N) for name in ("K_P", "K_D")]
    pair = (-1, -1)
    if isinstance(law, APD) and law.independent is not None:
        if max(law.independent) >= 2 * N:
            raise ValueError(f"independent = {law.independent}; allowed: joint indices from 0 to {2 * N - 1}")
        pair = law.independent
    return Code(code, form, pose, *gains, pair, float(getattr(law, "hysteresis", 1.0)))


def _diagonal(name: str, K: np.ndarray, size: int, N: int) -> np.ndarray:
    """One gain per coordinate; in redundant coordinates (N,) acts on the driven joints only."""
    if K.ndim == 0:
        return np.full(size, float(K))
    if K.shape == (size,):
        return K.astype(float)
    if size == 2 * N and K.shape == (N,):
        return np.concatenate([K, np.zeros(N)])
    raise ValueError(f"{name} has shape {K.shape}; allowed: one number or ({size},)")


def _plain(array: np.ndarray):
    """The array for compiled code; nested lists of Python numbers without a compiler, which are faster then."""
    return array if COMPILED else array.tolist()


def motion(trajectory):
    """The motion table of a trajectory, made once."""
    if trajectory not in _motions:
        _motions[trajectory] = _plain(np.ascontiguousarray(tables.motion_table(trajectory)))
    return _motions[trajectory]


def lockstep(robot, model, trajectory, code: Code, K_P, K_D, offsets, quantum, tau, history=None):
    """Run L = len(offsets) runs side by side; returns the work table (rows, L) and its blocks (blocks, N, L).

    history : for L = 1 the arrays that take the run, states, q_a, qd_a and c; None sums it up instead.
    """
    from ..engine.lockstep import closed_loops

    L, N = offsets.shape
    w = np.zeros((lanes.SINGLES + lanes.BLOCKS * N, L))
    start = np.concatenate([trajectory.x[0], trajectory.xd[0]])
    w[lanes.X : lanes.X + 4] = start[:, None]
    for row in (lanes.PX, lanes.PX1, lanes.PX2):
        w[row : row + 2] = start[:2, None]
    blocks = w[lanes.SINGLES :].reshape(lanes.BLOCKS, N, L)
    blocks[lanes.OFFSET], blocks[lanes.GAIN_P], blocks[lanes.GAIN_D] = offsets.T, K_P.T, K_D.T
    blocks[lanes.WEIGHT] = (robot.resistance / robot.torque_constant**2)[:, None]
    extra, work = tables.extra(robot), _plain(w.ravel())
    keep = tables.sizes(int(history is not None))
    history = history or [np.empty((0, 0))] * 4
    with patience("lockstep", L, N, extra), np.errstate(all="ignore"):
        try:
            closed_loops(tables.sizes(L), tables.sizes(N), extra, keep, *_machine(robot), _machine(model)[0],
                         motion(trajectory), trajectory.dt, code.form, code.pose, quantum, tau, work, *history)
        except (ArithmeticError, ValueError):
            # Without a compiler a division by zero or an infinite angle ends the run here.
            work[lanes.STATUS] = tables.SINGULAR
    w[:] = np.reshape(work, w.shape)
    return w, blocks


def _machine(robot):
    """Arm table and environment of a machine, made once."""
    if robot not in _machines:
        _machines[robot] = _plain(tables.arm_table(robot)), _plain(tables.environment(robot))
    return _machines[robot]


def run_lockstep(robot, model, trajectory, code, offset, quantum, tau, states, q_a, qd_a, c, pairs) -> tuple[int, int]:
    """One run of a decentralized law with its history; returns status and sample."""
    w, _ = lockstep(robot, model, trajectory, code, code.K_P[None], code.K_D[None], offset[None], quantum, tau,
                    (states, q_a, qd_a, c))
    status, k = int(w[lanes.STATUS, 0]), int(w[lanes.SAMPLE, 0])
    if status != tables.NO_POSE and not np.all(np.isfinite(c[k])):
        status = tables.SINGULAR
    return status, k


def run_model_based(robot, model, trajectory, code, offset, quantum, tau, *arrays) -> tuple[int, int]:
    """One run of a law with a model; returns status and sample."""
    from ..engine.model_based import closed_loop

    extra, N = tables.extra(robot), robot.n_arms
    with patience("model", N, extra), np.errstate(all="ignore"):
        try:
            return closed_loop(
                tables.sizes(N), extra, *_machine(robot), *_machine(model), motion(trajectory), trajectory.dt, code.law,
                code.pose, code.K_P, code.K_D, np.array(code.pair), code.hysteresis, offset, quantum, tau, *arrays)
        except (ArithmeticError, ValueError):
            return tables.SINGULAR, int(np.count_nonzero(np.any(arrays[0], axis=-1))) - 1


class Loop:
    """The sampled loop with a law in Python and the compiled plant, sample by sample."""

    def __init__(self, robot, law, model, trajectory, offset, quantum, tau):
        self.robot, self.law, self.trajectory, self.offset = robot, law, trajectory, offset
        self.quantum, self.tau, self.dt = quantum, tau, trajectory.dt
        self.drives, self.extra, self.machine = tables.sizes(robot.n_arms), tables.extra(robot), _machine(robot)
        self.controller = Controller(law, model) if isinstance(law, Law) else None
        self.last, self.slow = None, np.zeros(robot.n_arms)

    def sense(self, k, state):
        """True base angles and rates (N,) at a state (x, y, vx, vy)."""
        from ..engine.plant import observe

        q, qd = np.empty(self.robot.n_arms), np.empty(self.robot.n_arms)
        observe(self.drives, self.machine[0], motion(self.trajectory)[k], *state, q, qd)
        return q, qd

    def torque(self, k, state, q, qd):
        """Drive torques (N,) that the controller answers with."""
        angle, rate = q + self.offset, qd.copy()
        if self.quantum > 0.0:
            angle = self.quantum * np.floor(angle / self.quantum + 0.5)
        if self.tau >= 0.0:
            if self.last is not None:
                self.slow = self.slow + self.dt / (self.tau + self.dt) * ((angle - self.last) / self.dt - self.slow)
            self.last, rate = angle, self.slow
        t, desired = self.trajectory.t[k], self.trajectory[k]
        if self.controller is not None:
            return self.controller(t, angle, rate, desired, truth=(state[:2], state[2:]))
        return _student_torque(self.law, t, angle, rate, desired)

    def move(self, state, c):
        """The state after one hold, or None when the machine has left the workspace."""
        from ..engine.plant import advance

        with patience("plant", self.drives, self.extra), np.errstate(all="ignore"):
            try:
                *state, low = advance(self.drives, self.extra, *self.machine, *state, _plain(c), self.dt)
            except (ArithmeticError, ValueError):
                return None
        return np.array(state) if low > 0.0 and np.all(np.isfinite(state)) else None

    def run(self, states, q_a, qd_a, c, pairs) -> tuple[int, int, str]:
        """The whole run; returns status, sample and what a law complained of."""
        state = np.concatenate([self.trajectory.x[0], self.trajectory.xd[0]])
        for k in range(len(states)):
            states[k] = state
            q_a[k], qd_a[k] = self.sense(k, state)
            try:
                c[k] = self.torque(k, state, q_a[k], qd_a[k])
            except ConvergenceError as error:
                return tables.NO_POSE, k, str(error)
            if self.controller is not None and self.controller.pair is not None:
                pairs[k] = self.controller.pair
            if k + 1 < len(states):
                state = self.move(state, c[k])
                if state is None:
                    return tables.LEFT_WORKSPACE, k, ""
        return tables.DONE, len(states) - 1, ""


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


def growth(loop_arguments, k) -> float | None:
    """Factor per sample by which the sampled loop magnifies a small error near the desired state of sample k.

    The spectral radius of the linearized map from one sample to the next, with ideal sensors; None where there is none.
    """
    robot, law, model, trajectory, offset = loop_arguments
    loop = Loop(robot, law, model, trajectory, 0.0 * offset, 0.0, -1.0)
    centre = np.concatenate([trajectory.x[k], trajectory.xd[k]])
    step, columns = 1e-6, []
    try:
        for i in range(4):
            ends = []
            for sign in (1.0, -1.0):
                state = centre + sign * step * (np.arange(4) == i)
                ends.append(loop.move(state, loop.torque(k, state, *loop.sense(k, state))))
            columns.append((ends[0] - ends[1]) / (2 * step))
        return float(np.max(np.abs(np.linalg.eigvals(np.array(columns)))))
    except (ValueError, RuntimeError, TypeError, ArithmeticError, np.linalg.LinAlgError):
        return None
