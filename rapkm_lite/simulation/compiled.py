"""The only door to the engine: laws and machines in its terms, single runs, many runs, and the plant alone."""

from __future__ import annotations

import weakref
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np

from ..control.computed_torque import APD, CTC, RedundantAPD, RedundantCTC, SwitchedCTC
from ..control.laws import PD, AntagonismFilter, CommandFilter
from ..engine import COMPILED, lanes, tables
from ..engine.tables import DONE, LEFT_WORKSPACE, NO_POSE, SINGULAR
from ..mechanics.kinematics import inverse_kinematics
from .energy import antagonistic_energy, electric_energy, root_mean_square_torque
from .patience import patience
from .setup import Outcome, Setup, blank

__all__ = ["DONE", "FAULTS", "LEFT_WORKSPACE", "NO_POSE", "SINGULAR", "Code", "Plant", "encode", "many", "single"]

FAULTS = False
"""Whether the engine applies fault tables."""

LANES = 16
_motions = weakref.WeakKeyDictionary()
_machines = weakref.WeakKeyDictionary()


@dataclass(frozen=True, eq=False)
class Code:
    """A law as the engine knows it; `law` and `form` are codes of `engine.tables`, gains one per coordinate."""

    law: int
    form: int
    true_pose: bool
    K_P: np.ndarray
    K_D: np.ndarray
    pair: tuple[int, int] = (-1, -1)
    hysteresis: float = 1.0


_LAWS = {PD: tables.PD, APD: tables.APD, CTC: tables.CTC, SwitchedCTC: tables.SWITCHED,
         RedundantAPD: tables.REDUNDANT_APD, RedundantCTC: tables.REDUNDANT_CTC}
_FILTERS = {AntagonismFilter: tables.FORCE_FILTER, CommandFilter: tables.COMMAND_FILTER}


def encode(law, model) -> Code | None:
    """The engine's form of a law, or None where it has none: then the law runs through the textbook layer.

    The engine knows diagonal gains and W = I.
    """
    N, form, true_pose = model.n_arms, tables.NO_FILTER, getattr(law, "pose", None) == "true"
    if getattr(law, "W", None) is not None:
        return None
    if type(law) in _FILTERS and type(law.law) is PD:
        form, law = _FILTERS[type(law)], law.law
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
    return Code(code, form, true_pose, *gains, pair, float(getattr(law, "hysteresis", 1.0)))


def _diagonal(name: str, K: np.ndarray, size: int, N: int) -> np.ndarray:
    """One gain per coordinate; in redundant coordinates (N,) acts on the driven joints only."""
    if K.ndim == 0:
        return np.full(size, float(K))
    if K.shape == (size,):
        return K.astype(float)
    if size == 2 * N and K.shape == (N,):
        return np.concatenate([K, np.zeros(N)])
    raise ValueError(f"{name} has shape {K.shape}; allowed: one number or ({size},)")


def single(setup: Setup, code: Code) -> Outcome:
    """One run with its history."""
    history = blank(len(setup.trajectory), setup.robot.n_arms)
    run = _lockstep_run if code.law == tables.PD else _model_based_run
    status, sample = run(setup, code, *history)
    return Outcome(status, sample, *history)


def many(setup: Setup, codes: list[Code], offsets: np.ndarray) -> tuple[np.ndarray, ...]:
    """One run per code and row of offsets (k, N): energies (k, N), torque norm, antagonistic energy, final position
    (k, 2), failure time and status; zeros where a run failed, and failure time zero where it did not."""
    k, N = offsets.shape
    columns = np.zeros((k, N)), np.zeros(k), np.zeros(k), np.zeros((k, 2)), np.zeros(k), np.zeros(k, int)
    kinds: dict = {}
    for i, code in enumerate(codes):
        key = (code.form, code.true_pose) if code.law == tables.PD else i
        kinds.setdefault(key, []).append(i)
    for rows in kinds.values():
        if codes[rows[0]].law == tables.PD:
            parts = _lanes(setup, [codes[i] for i in rows], offsets[rows])
        else:
            parts = _sums(setup, codes[rows[0]], offsets[rows[0]])
        for column, part in zip(columns, parts, strict=True):
            column[rows] = part
    return columns


def _sums(setup: Setup, code: Code, offset) -> tuple:
    """The columns of `many` for one run with its history."""
    robot, trajectory = setup.robot, setup.trajectory
    setup = setup._replace(sensors=setup.sensors.with_offset(offset))
    status, sample, states, q_a, _, c, _ = single(setup, code)
    if status != DONE:
        return 0.0, 0.0, 0.0, 0.0, trajectory.t[sample], status
    q = np.concatenate([q_a, inverse_kinematics(robot, states[:, :2])[:, robot.n_arms :]], axis=-1)
    run = SimpleNamespace(robot=robot, q=q, q_a=q_a, c=c, dt=trajectory.dt)
    return (electric_energy(run), root_mean_square_torque(run), antagonistic_energy(run), states[-1, :2], 0.0, DONE)


def _lanes(setup: Setup, codes: list[Code], offsets) -> tuple:
    """The columns of `many` for PD laws of one form, 16 runs side by side."""
    K_P, K_D = np.array([code.K_P for code in codes]), np.array([code.K_D for code in codes])
    width = LANES if COMPILED else 1
    # The last runs fill up with copies of themselves: a lane does not feel its neighbours.
    index = np.minimum(np.arange(-(-len(codes) // width) * width), len(codes) - 1).reshape(-1, width)
    parts = [_lane(setup, codes[0], K_P[i], K_D[i], offsets[i]) for i in index]
    return tuple(np.concatenate(column)[: len(codes)] for column in zip(*parts, strict=True))


def _lane(setup: Setup, code, K_P, K_D, offsets) -> tuple:
    """`_lanes` for as many runs as the engine takes side by side."""
    robot, trajectory = setup.robot, setup.trajectory
    w, blocks = _lockstep(setup, code, K_P, K_D, offsets)
    status, sample = w[lanes.STATUS].astype(int), w[lanes.SAMPLE].astype(int)
    done, dt = status == DONE, trajectory.dt
    energies = blocks[lanes.COPPER].T * (robot.resistance / robot.torque_constant**2) * dt + blocks[lanes.WORK].T
    norm = np.sqrt(np.where(done, w[lanes.TORQUE2], 0.0) / (len(trajectory) - 1))
    sample = np.where(done, 0, np.minimum(sample, len(trajectory) - 1))
    return (np.where(done[:, None], energies, 0.0), norm, np.where(done, w[lanes.ANTAGONISM] * dt, 0.0),
            np.where(done[:, None], w[[lanes.X, lanes.Y]].T, 0.0), trajectory.t[sample], status)


def _lockstep(setup: Setup, code, K_P, K_D, offsets, history=None):
    """Run L = len(offsets) PD runs side by side; returns the work table (rows, L) and its blocks (blocks, N, L).

    history : for L = 1 the arrays that take the run, states, q_a, qd_a and c; None sums it up instead.
    """
    from ..engine.lockstep import closed_loops

    robot, model, trajectory = setup.robot, setup.model, setup.trajectory
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
                         _motion(trajectory), trajectory.dt, code.form, _pose(setup, code), *_sensors(setup), work,
                         *history)
        except (ArithmeticError, ValueError):
            # Without a compiler a division by zero or an infinite angle ends the run here.
            work[lanes.STATUS] = SINGULAR
    w[:] = np.reshape(work, w.shape)
    return w, blocks


def _lockstep_run(setup: Setup, code, states, q_a, qd_a, c, pairs) -> tuple[int, int]:
    offset = setup.sensors.offset[None]
    w, _ = _lockstep(setup, code, code.K_P[None], code.K_D[None], offset, (states, q_a, qd_a, c))
    status, k = int(w[lanes.STATUS, 0]), min(int(w[lanes.SAMPLE, 0]), len(c) - 1)
    if status != NO_POSE and not np.all(np.isfinite(c[k])):
        status = SINGULAR
    return status, k


def _model_based_run(setup: Setup, code, *arrays) -> tuple[int, int]:
    from ..engine.model_based import closed_loop

    robot, model, trajectory = setup.robot, setup.model, setup.trajectory
    extra, N = tables.extra(robot), robot.n_arms
    with patience("model", N, extra), np.errstate(all="ignore"):
        try:
            return closed_loop(
                tables.sizes(N), extra, *_machine(robot), *_machine(model), _motion(trajectory), trajectory.dt,
                code.law, _pose(setup, code), code.K_P, code.K_D, np.array(code.pair), code.hysteresis,
                setup.sensors.offset, *_sensors(setup), *arrays)
        except (ArithmeticError, ValueError):
            return SINGULAR, int(np.count_nonzero(np.any(arrays[0], axis=-1))) - 1


def _pose(setup: Setup, code: Code) -> int:
    if not code.true_pose:
        return tables.MEASURED
    return tables.TRUE_SAME if setup.model.same_kinematics(setup.robot) else tables.TRUE


def _sensors(setup: Setup) -> tuple[float, float]:
    """Angle of one count and time constant as the kernels want them: 0 and -1 for none."""
    count, tau = setup.sensors.count, setup.sensors.velocity_filter
    return 0.0 if count is None else count, -1.0 if tau is None else tau


class Plant:
    """The machine alone, for a controller in Python; a state is (x, y, vx, vy)."""

    def __init__(self, robot, trajectory):
        from ..engine.plant import advance, observe

        self._observe, self._advance, self._dt = observe, advance, trajectory.dt
        self._drives, self._extra = tables.sizes(robot.n_arms), tables.extra(robot)
        self._arms, self._env = _machine(robot)
        self._motion, self._N = _motion(trajectory), robot.n_arms
        start = (*trajectory.x[0].tolist(), *trajectory.xd[0].tolist())
        with patience("plant", self._drives, self._extra):
            self.observe(0, start)
            self.hold(start, np.zeros(robot.n_arms), self._dt)

    def observe(self, k: int, state) -> tuple[np.ndarray, np.ndarray]:
        """True base angles and rates (N,) at sample k."""
        q, qd = np.empty(self._N), np.empty(self._N)
        self._observe(self._drives, self._arms, self._motion[k], *state, q, qd)
        return q, qd

    def hold(self, state, c: np.ndarray, dt: float):
        """The state after the torques c (N,) were held for dt; None when the machine has left the workspace."""
        try:
            *state, low = self._advance(self._drives, self._extra, self._arms, self._env, *state, _plain(c), dt)
        except (ArithmeticError, ValueError):
            return None
        x, y, vx, vy = state
        return state if low > 0.0 and abs(x) + abs(y) + abs(vx) + abs(vy) < 1e300 else None


def _plain(array: np.ndarray):
    """The array for compiled code; nested lists of Python numbers without a compiler, which are faster then."""
    return array if COMPILED else array.tolist()


def _motion(trajectory):
    """The motion table of a trajectory, made once."""
    if trajectory not in _motions:
        _motions[trajectory] = _plain(np.ascontiguousarray(tables.motion_table(trajectory)))
    return _motions[trajectory]


def _machine(robot):
    """Arm table and environment of a machine, made once."""
    if robot not in _machines:
        _machines[robot] = _plain(tables.arm_table(robot)), _plain(tables.environment(robot))
    return _machines[robot]
