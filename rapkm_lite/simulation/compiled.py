"""The only door to the engine: laws and machines in its terms, single runs, many runs, and the plant alone."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from ..control.compiled_law import CompiledLaw
from ..engine import COMPILED, compiled, tables, without_compiler
from ..engine.tables import DONE, LEFT_WORKSPACE, NO_POSE, SINGULAR, TOO_STIFF
from ..machine.values import Value, room
from ..mechanics.sampling import PART
from .codes import Code, code_of
from .patience import patience
from .setup import Outcome, Setup

LAW_FAILED = -2
"""Status beside those of the engine: the law raised, or the user pressed Ctrl-C."""
LANES = 32
"""Runs side by side: few enough that a core keeps the rows of a law at hand, and enough that no register waits for
another."""

__all__ = [
    "COMPILED", "DONE", "LAW_FAILED", "LEFT_WORKSPACE", "NO_POSE", "SINGULAR", "TOO_STIFF", "Plant", "compiled",
    "encode", "many", "single", "without_compiler",
]  # fmt: skip


def encode(law: Any, setup: Setup) -> Code | None:
    """The engine's form of a law, or None where it has none for this run: then it runs through the textbook layer.

    It is kept beside the fields of a law of the package, which do not change.
    """
    known, model = law.__dict__.setdefault("_codes", {}) if isinstance(law, Value) else {}, setup.model
    if model.n_arms not in known:
        known[model.n_arms] = code_of(law, model)
    code = known[model.n_arms]
    return None if code is None or (code.user is not None and not (compiled() and setup.suits(code.user))) else code


def single(setup: Setup, code: Code) -> tuple[Outcome, KeyboardInterrupt | None]:
    """One run with its history, and the Ctrl-C that stopped it; one before the first sample is raised."""
    samples, N, interrupt = len(setup.trajectory), setup.robot.n_arms, None
    spare = tables.width(N, True) - N
    flat, kept = room(2 * samples, 2 * samples, *3 * [N * samples + spare], samples)
    # Kernels do not hear a Ctrl-C: the NaN that are left tell how far they came.
    flat[0][:] = np.nan
    history = tables.History._make([*flat[:-1], flat[-1].view(np.int32), N])
    try:
        w = _run(setup, [code], setup.sensors.offset[None], history)
        status, sample = int(w("STATUS")[0]), int(w("SAMPLE")[0])
    except KeyboardInterrupt as stop:
        begun = int(np.append(np.isfinite(flat[0][::2]), False).argmin())
        if begun == 0:
            raise
        status, sample, interrupt = LAW_FAILED, begun - 1, stop
    if "JOINT_J" in code.run:
        # Elbows were counted after all arms of a row.
        history.joints[history.joints >= N + spare] -= spare
    kept[-1] = kept[-1].view(np.int32)
    columns = [column[: n * samples].reshape(samples, n) for column, n in zip(kept, (2, 2, N, N, N, 2), strict=True)]
    return Outcome._make([status, sample, *columns]), interrupt


def many(setup: Setup, codes: dict[int, Code], offsets: np.ndarray, columns) -> None:
    """Run the codes, by row of the offsets (k, N), and write into the columns of a study: energies (k, N), torque norm,
    antagonistic energy, final position (k, 2), path error, rms and largest, (k,) each, failure time and status; zeros
    where a run failed, and failure time zero where it did not."""
    kinds: dict = {}
    for i, code in codes.items():
        kinds.setdefault(code.kind, []).append(i)
    for rows in kinds.values():
        width = (LANES if compiled() else 1) if codes[rows[0]].user is None else 1
        for first in range(0, len(rows), width):
            # The last runs fill up with copies of themselves: a lane does not feel its neighbours.
            lanes = [rows[min(i, len(rows) - 1)] for i in range(first, first + width)]
            part = lanes[: len(rows) - first]
            sums = _sums(setup, _run(setup, [codes[i] for i in lanes], offsets[lanes], None))
            for column, values in zip(columns, sums, strict=True):
                column[part] = values[: len(part)]


def _sums(setup: Setup, w) -> tuple:
    """The columns of `many` from the work table."""
    robot, t = setup.robot, setup.trajectory.t
    status, sample = w("STATUS").astype(int), w("SAMPLE").astype(int)
    done, dt, holds = status == DONE, setup.trajectory.dt, len(t) - 1
    copper, work = (np.where(done[:, None], w(name).T, 0.0) for name in ("COPPER", "WORK"))
    final = np.stack([w("X"), w("Y")], axis=-1)
    return (
        copper * (robot.resistance / robot.torque_constant**2) * dt + work,
        np.sqrt(np.where(done, w("TORQUE2"), 0.0) / holds),
        np.where(done, w("ANTAGONISM") * dt, 0.0),
        np.where(done[:, None], final, 0.0),
        np.sqrt(np.where(done, w("MISS2"), 0.0) / len(t)),
        np.sqrt(np.where(done, w("FARTHEST"), 0.0)),
        np.where(done, 0.0, t[sample]),
        status,
    )


@functools.lru_cache(maxsize=16)
def _blank(robot, model, width: int, L: int, start: tuple = (), codes: tuple = ()) -> np.ndarray:
    """The work table (flat) of L runs of a machine with this model, without offsets.

    start : end-effector position and velocity, if given; with it the codes of the runs, one each.
    """
    from ..engine import rows

    N, work = robot.n_arms, np.zeros((rows.BLOCKS * width + rows.SINGLES) * L)
    blocks, runs = _parts(work, width, L)
    for i, arms in enumerate((robot, model)):
        blocks[i * rows.MODEL : (i + 1) * rows.MODEL] = tables.arm_table(arms, width)[..., None]
        first = rows.GRAVITY_X + i * rows.ENVIRONMENT
        runs[first : first + rows.ENVIRONMENT] = tables.environment(arms)[:, None]
    blocks[rows.WEIGHT, :N] = (robot.resistance / robot.torque_constant**2)[:, None]
    runs[rows.JOINT_J : rows.JOINT_K + 1] = -1.0
    if codes:
        for name in codes[0].drives:
            blocks[getattr(rows, name), :N] = np.array([code.drives[name] for code in codes]).T
        for name in codes[0].run:
            runs[getattr(rows, name)] = [code.run[name] for code in codes]
        runs[rows.X : rows.VY + 1] = np.array(start)[:, None]
        runs[rows.PX : rows.PY2 + 1] = np.array(3 * start[:2])[:, None]
    # Elbows are counted after all arms of a row.
    joints = runs[rows.JOINT_J : rows.JOINT_K + 1]
    joints[joints >= N] += width - N
    return work


def _parts(work: np.ndarray, width: int, L: int) -> tuple[np.ndarray, np.ndarray]:
    """The pair rows (blocks, width, L) and the run rows (rows, L) of a work table."""
    from ..engine.rows import BLOCKS

    pairs = BLOCKS * width * L
    return work[:pairs].reshape(-1, width, L), work[pairs:].reshape(-1, L)


@functools.lru_cache(maxsize=64)
def _shape(robot, model, code: Code, L: int, study: bool, faulty: bool, counted: bool):
    """What the kernel has to know of runs besides numbers: `Kind`, has the model other forces, `Law`, columns."""
    form, filtered = getattr(tables, code.form), getattr(tables, code.filter)
    at = None if code.user is None else code.user.at
    asks = tables.NOTHING if at is None else tables.DESIRED if at == "desired" else tables.POSED
    pose = tables.TRUE if code.true_pose else tables.COUNTED if counted else tables.MEASURED
    law = tables.Law(form, filtered, pose, model.same_kinematics(robot), code.task, code.switched, asks)
    has_model = tables.PID < form < tables.USER
    posed = () if has_model or filtered != tables.NO_FILTER or asks == tables.POSED else None
    modelled = tables.sizes(int(tables.extra(model) is not None)) if has_model else None
    width = tables.width(robot.n_arms, not study)
    # Arms that fill up a row drive with zeros, so that machines of three and four arms share a kernel.
    drives = width if code.user is None else robot.n_arms
    sizes, columns = tables.sizes, tables.FEW if modelled is None and code.user is None else tables.ALL
    kind = tables.Kind(sizes(L), sizes(drives), sizes(width), sizes(int(faulty)), posed, tables.extra(robot))
    return kind, modelled, law, columns


def _run(setup: Setup, codes: list[Code], offsets, history):
    """Run as many runs as there are codes side by side; returns a function that gives the rows of the work table.

    history : None for a study; the `History` of a single run.
    """
    from ..engine import loop, rows  # not before the first run: they import Numba

    robot, model, trajectory, sensors, code = setup.robot, setup.model, setup.trajectory, setup.sensors, codes[0]
    L, N, study = len(codes), robot.n_arms, () if history is None else None
    faulty, counted = setup.faults is not None, sensors.encoder is not None
    kind, modelled, law, count = _shape(robot, model, code, L, history is None, faulty, counted)
    W, start = len(kind.arms), (*trajectory.x[0].tolist(), *trajectory.xd[0].tolist())
    work = tables.aligned(_blank(robot, model, W, L, start, tuple(codes)))
    blocks, runs = _parts(work, W, L)
    blocks[rows.OFFSET, :N] = offsets.T
    user, buffer = _user(code.user, N)
    sensor, faults = tables.sensor(sensors, trajectory.dt), tables.faults(setup.faults, W)
    samples, w = len(trajectory), tables.plain(work)
    log = history if history is None or compiled() else tables.History._make([*map(tables.plain, history[:-1]), N])
    with patience(kind, study, modelled, user is None):
        for first in range(0, samples, PART):
            part = slice(first, min(first + PART, samples))
            table = _motion(trajectory, W, count, part)
            clock = tables.Clock(first, samples, trajectory.dt)
            try:
                loop.closed_loops(kind, study, modelled, user, sensor, law, clock, table, faults, w, log, buffer)
            except (ArithmeticError, ValueError) as error:  # only without a compiler, where runs are alone
                w[rows.BLOCKS * W + rows.STATUS], w[rows.BLOCKS * W + rows.SAMPLE] = loop.stopped(error)
            finally:
                if history is not None and log is not None and log is not history:
                    for column, values in zip(history[:-1], log, strict=False):
                        column[:] = values
            if w is not work:
                work[:] = w
            if part.stop < samples and not np.any(runs[rows.STATUS] == DONE):
                break

    def row(name: str) -> np.ndarray:
        index = getattr(rows, name)
        return blocks[index, :N] if name in ("COPPER", "WORK") else runs[index]

    return row


def _user(law: CompiledLaw | None, N: int):
    """The pointer of a user's compiled law, and its buffer."""
    if law is None:
        return None, tables.plain(np.empty(0))
    from ..engine.pointer import places, pointer

    law.check()
    matrices = law.at is not None
    return pointer(law.function, N, matrices, law.memory), np.zeros(places(N, matrices, law.memory)[-1])


def _motion(trajectory, width: int, count: int, part: slice):
    """The desired motion of a part of the run; only that of short runs is kept, because values do not change."""
    made = trajectory.__dict__.setdefault("_tables", {}) if len(trajectory) <= PART else {}
    if (width, count) not in made:
        made[width, count] = tables.plain(tables.motion_table(trajectory, width, count, part).ravel())
    return made[width, count]


class Plant:
    """The machine alone, for a controller in Python, and its pose in the model; a state is (x, y, vx, vy)."""

    def __init__(self, robot, trajectory, model=None):
        from ..engine.pose import nearest
        from ..engine.single import advance, observe

        self._observe, self._advance, self._dt, self._N = observe, advance, trajectory.dt, robot.n_arms
        self._nearest, self._drives = nearest, tables.sizes(robot.n_arms)
        W = tables.width(robot.n_arms, True)
        self._w, self._arms = tables.plain(tables.aligned(_blank(robot, model or robot, W, 1))), tables.sizes(W)
        self._extra, self.status, self._next = tables.extra(robot), DONE, -1
        table = _motion(trajectory, W, tables.FEW, slice(0, len(trajectory)))
        columns = len(table) // len(trajectory)
        self._table = [table[k : k + columns] for k in range(0, len(table), columns)]
        start = (*trajectory.x[0].tolist(), *trajectory.xd[0].tolist())
        with patience("plant", W, self._extra):
            self.observe(0, start)
            self.hold(start, np.zeros(robot.n_arms), self._dt)

    def observe(self, k: int, state) -> tuple[np.ndarray, np.ndarray]:
        """True base angles and rates (N,) at sample k; where k follows the last call's, on the same turn."""
        q, qd, follows, self._next = np.empty(self._N), np.empty(self._N), k == self._next, k + 1
        self._observe(self._arms, self._extra, self._table[k], *state, self._w, q, qd, follows)
        return q, qd

    def nearest(self, q_a: np.ndarray, guess) -> tuple[float, float] | None:
        """End-effector position whose base angles in the model are nearest to q_a (N,), as `estimate_pose` finds it.

        None where Newton's steps from the guess lead nowhere, or where the angles fit badly.
        """
        try:
            with patience("pose", self._drives, self._arms):
                x, y, found = self._nearest(self._drives, self._arms, self._w, q_a, *guess)
        except (ArithmeticError, ValueError):
            return None
        return (x, y) if found else None

    def hold(self, state, c: np.ndarray, dt: float):
        """The state after the torques c (N,) were held for dt; None when the machine was lost: `status` says how."""
        try:
            *state, status = self._advance(self._arms, self._extra, self._table[0], *state, self._w, c, dt)
        except (ArithmeticError, ValueError):
            status = LEFT_WORKSPACE
        self.status = int(status)
        return state if status == DONE else None
