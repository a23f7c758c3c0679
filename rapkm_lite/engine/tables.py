"""Codes, tables and sizes that the kernels read."""

from __future__ import annotations

import functools
from collections import namedtuple

import numpy as np

from . import compiled

# What a run ended with; laws; filters; pose sources: base angles that move smoothly, or by counts, or the truth.
DONE, LEFT_WORKSPACE, NO_POSE, SINGULAR, TOO_STIFF = range(5)
PD, PID, APD, CTC, REDUNDANT_APD, REDUNDANT_APD_LINE2, REDUNDANT_CTC, REDUNDANT_CTC_LINE2, USER = range(9)
NO_FILTER, FORCE_FILTER, COMMAND_FILTER = range(3)
MEASURED, COUNTED, TRUE = range(3)
# At which pose a law of a user wants the matrices.
NOTHING, DESIRED, POSED = range(3)

# Rows per sample of the fault table.
JUMP, HELD, ALIVE, LIMITED = range(4)

# Sizes as `sizes` makes them: runs, drives, arms of a row; an entry for faults; () for a law or filter that asks for a
# pose, else None; `extra`.
Kind = namedtuple("Kind", "lanes drives arms faulty posed extra")
Sensor = namedtuple("Sensor", "quantized quantum filtered blend")
# The sample with which a table begins, the samples of the whole run, and the sampling time.
Clock = namedtuple("Clock", "first samples dt")
# Flat columns of a single run, those of the drives with room for the rest of a row behind them; the number of drives.
History = namedtuple("History", "x xd q qd c joints drives")
Law = namedtuple("Law", "form filter pose same task switched asks")

# Blocks of the motion table, one number per arm, after x, xd and xdd.
# What decentralized laws need comes first.
ANGLE, RATE, COS, SIN, ACCELERATION, ELBOW_RATE, ELBOW_ACCELERATION, ELBOW_COS, ELBOW_SIN, ELBOW = range(10)


def arm_table(robot, width: int) -> np.ndarray:
    """The constants of each arm that the kernels need, (14, width), in the order of `rows`.

    Arms beyond the machine's are copies of its first one that reach as far, but have no mass, no friction, and elbows
    of no sign: their rows of A and all that they add to a sum are zero.
    """
    l1, l2 = robot.lengths.T
    proximal, distal, coupling = robot.arm_inertias.T
    w1, w2 = robot.arm_moments.T
    # J_a w1^2 + 2 P w1 w2 cos + J_d w2^2 = (J_a - p l1^2) w1^2 + (J_d - p l2^2) w2^2 + p |v|^2 with p = P / (l1 l2).
    mass, none = coupling / (l1 * l2), np.arange(width) >= robot.n_arms
    geometry = [*robot.base.T, l1**2, l2**2, (l1**2 - l2**2) / 2]
    masses = [proximal - mass * l1**2, distal - mass * l2**2, mass, w1 / l1, w2 / l2, robot.friction]
    table = np.stack([*geometry, robot.mode, *masses, 1 / l1, 1 / (l1 * l2)])[:, np.where(none, 0, np.arange(width))]
    table[len(geometry) : -2, none] = 0.0
    return table


def environment(robot) -> np.ndarray:
    """Gravity vector in m/s^2 and inverse friction velocity in s/rad, (3,)."""
    return np.array([*robot.gravity, 1 / robot.friction_velocity])


# Blocks for laws without a model, which then read half as much, and for all others.
FEW, ALL = 4, 10


def motion_table(trajectory, width: int, count: int = ALL, rows: slice = slice(None)) -> np.ndarray:
    """Desired motion per sample, (k, 6 + count width); zeros for arms beyond the machine's."""
    N = trajectory.n_arms
    x, xd, xdd, q, qd, qdd = (getattr(trajectory, name)[rows] for name in ("x", "xd", "xdd", "q", "qd", "qdd"))
    blocks = [q[:, :N], qd[:, :N], np.cos(q[:, :N]), np.sin(q[:, :N])]
    if count > FEW:
        elbow = q[:, N:]
        blocks += [qdd[:, :N], qd[:, N:], qdd[:, N:], np.cos(elbow), np.sin(elbow), elbow]
    table = np.zeros((len(x), 6 + count * width))
    table[:, 0:2], table[:, 2:4], table[:, 4:6] = x, xd, xdd
    rooms = table[:, 6:].reshape(len(x), count, width)[..., :N]
    for k, block in enumerate(blocks):
        rooms[:, k] = block
    return table


def sizes(count: int) -> tuple:
    """A tuple of `count` nothings: the compiler knows the length of a tuple, but not that of an array."""
    return ((),) * count


@functools.lru_cache(maxsize=64)
def extra(robot) -> tuple | None:
    """None for a machine without friction and gravity; an entry where there is gravity."""
    return sizes(1) if robot.gravity.any() else () if robot.friction.any() else None


def width(N: int, alone: bool) -> int:
    """Arms in a row of the work table: in a single compiled run padded to vector registers of four."""
    return -(-N // 4) * 4 if alone and compiled() else N


def aligned(numbers: np.ndarray) -> np.ndarray:
    """A copy that starts at a multiple of 64 bytes, as vector registers like it."""
    room = np.empty(len(numbers) + 8)
    start = -room.__array_interface__["data"][0] // 8 % 8
    copy = room[start : start + len(numbers)]
    copy[:] = numbers
    return copy


def plain(array: np.ndarray):
    """The array for compiled code; nested lists of Python numbers without a compiler, which are faster then."""
    return array if compiled() else array.tolist()


def sensor(sensors, dt: float) -> Sensor:
    """Counts and velocity filter of the encoders."""
    count, tau = sensors.count, sensors.velocity_filter
    return Sensor(count is not None, count or 1.0, tau is not None, dt / ((tau or 0.0) + dt))


def faults(table, width: int):
    """A fault table with a column for every arm of the work table, flat."""
    if table is None:
        return plain(np.empty(0))
    arms = np.minimum(np.arange(width), len(table.limit) - 1)
    limit = np.broadcast_to(table.limit, table.jump.shape)
    return plain(np.stack([v[:, arms] for v in (table.jump, table.held, table.alive, limit)], axis=1).ravel())
