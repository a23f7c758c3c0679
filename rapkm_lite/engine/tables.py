"""Codes, tables and sizes that the kernels read."""

from __future__ import annotations

import numpy as np

# What a run ended with; laws; filters; pose sources.
DONE, LEFT_WORKSPACE, NO_POSE, SINGULAR = range(4)
PD, APD, CTC, SWITCHED, REDUNDANT_APD, REDUNDANT_CTC, REDUNDANT_CTC_LINE2 = range(7)
NO_FILTER, FORCE_FILTER, COMMAND_FILTER = range(3)
MEASURED, TRUE, TRUE_SAME = range(3)

# Columns of the arm table, which is flat: entry i * COLUMNS + BX.
COLUMNS = 14
BX, BY, L1SQ, L2SQ, HALF, MEAN, MODE, S1, S2, TIP, W1, W2, FRICTION, SCALE = range(COLUMNS)


def arm_table(robot) -> np.ndarray:
    """The constants of each arm that the kernels need, (N * COLUMNS,)."""
    l1, l2 = robot.lengths.T
    proximal, distal, _ = robot.arm_inertias.T
    w1, w2 = robot.arm_moments.T
    mass = _tip_masses(robot)
    return np.column_stack([
        robot.base, l1**2, l2**2, (l1**2 - l2**2) / 2, (l1**2 + l2**2) / 2, robot.mode,
        proximal - mass * l1**2, distal - mass * l2**2, mass, w1 / l1, w2 / l2, robot.friction, 1 / l1]).ravel()


def _tip_masses(robot) -> np.ndarray:
    """Point mass at the tip that replaces the coupling of the two links of each arm, (N,) in kg.

    J_a w1^2 + 2 P w1 w2 cos + J_d w2^2 = (J_a - p l1^2) w1^2 + (J_d - p l2^2) w2^2 + p |v|^2 with p = P / (l1 l2).
    """
    return robot.arm_inertias[:, 2] / robot.lengths.prod(axis=1)


def environment(robot) -> np.ndarray:
    """Gravity vector in m/s^2, inverse friction velocity in s/rad and mass at the end-effector in kg, (4,)."""
    return np.array([*robot.gravity, 1 / robot.friction_velocity, _tip_masses(robot).sum()])


def motion_table(trajectory) -> np.ndarray:
    """Desired motion per sample: x, xd, xdd, q, qd, qdd and the unit vectors along the proximal links, (k, 6 + 8N)."""
    N = trajectory.n_arms
    angle = trajectory.q[:, :N]
    return np.column_stack([trajectory.x, trajectory.xd, trajectory.xdd, trajectory.q, trajectory.qd, trajectory.qdd,
                            np.cos(angle), np.sin(angle)])


def sizes(count: int) -> tuple:
    """A tuple of `count` nothings: the compiler knows the length of a tuple, but not that of an array."""
    return ((),) * count


def extra(robot) -> tuple:
    """`sizes(1)` for a machine with gravity or friction, else `sizes(0)`."""
    return sizes(int(bool(robot.friction.any() or robot.gravity.any())))
