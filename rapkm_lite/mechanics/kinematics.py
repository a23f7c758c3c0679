"""Loop constraints, Jacobians, inverse and forward kinematics, working modes: eqs. (1) and (3).

Joint vector q = (base angles of arms 1..N, elbow angles of arms 1..N), rad; elbow angles are relative.
Every function takes one pose or any leading axes; the last axis is the component.
"""

from __future__ import annotations

import itertools

import numpy as np

from ..machine.arguments import (
    check_leading,
    joint_vectors,
    real_array,
)
from ..machine.manipulator import Manipulator


def turn(v: np.ndarray) -> np.ndarray:
    """Quarter turn E v, counter-clockwise, of planar vectors (..., 2)."""
    return np.stack([-v[..., 1], v[..., 0]], axis=-1)


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Planar cross product a x b of vectors (..., 2)."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def unit_vector(angle: np.ndarray) -> np.ndarray:
    """(cos, sin) of an angle in rad, on a new last axis."""
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def arm_vectors(robot: Manipulator, q) -> tuple[np.ndarray, np.ndarray]:
    """Proximal vectors a_i and distal vectors d_i of all arms, each (..., N, 2) in m."""
    q = real_array("q", q, robot.n_joints)
    base, elbow = q[..., : robot.n_arms], q[..., robot.n_arms :]
    l1, l2 = robot.lengths.T
    return l1[:, None] * unit_vector(base), l2[:, None] * unit_vector(base + elbow)


def tips(robot: Manipulator, q) -> np.ndarray:
    """Tips of the N arms of the cut tree, (..., N, 2) in m."""
    a, d = arm_vectors(robot, q)
    return robot.base + a + d


def forward_kinematics(robot: Manipulator, q) -> np.ndarray:
    """End-effector position (..., 2) in m: the tip of arm 2, from which all others are cut.

    On the configuration space V all tips agree; `close_loops` brings a rough q there.
    """
    return tips(robot, q)[..., 1, :]


def loop_constraints(robot: Manipulator, q) -> np.ndarray:
    """h(q) of (1), (..., 2(N-1)) in m: (tip_1 - tip_2, tip_3 - tip_2, ..., tip_N - tip_2).

    >>> from rapkm_lite import load, inverse_kinematics
    >>> robot = load()
    >>> bool(np.abs(loop_constraints(robot, inverse_kinematics(robot, [0.02, 0.05]))).max() < 1e-15)
    True
    """
    p = tips(robot, q)
    h = np.delete(p, 1, axis=-2) - p[..., 1:2, :]
    return h.reshape(*h.shape[:-2], robot.n_constraints)


def tip_jacobians(robot: Manipulator, q) -> np.ndarray:
    """d tip_i / d (base angle i, elbow angle i), (..., N, 2, 2) in m/rad."""
    a, d = arm_vectors(robot, q)
    return np.stack([turn(a + d), turn(d)], axis=-1)


def _cut(robot: Manipulator, blocks: np.ndarray) -> np.ndarray:
    """Rows tip_i - tip_2 of the constraint Jacobian from the blocks of the single arms."""
    N = robot.n_arms
    J = np.zeros((*blocks.shape[:-3], N - 1, 2, 2 * N))
    for row, arm in enumerate(i for i in range(N) if i != 1):
        J[..., row, :, [arm, N + arm]] += np.moveaxis(blocks[..., arm, :, :], -1, 0)
        J[..., row, :, [1, N + 1]] -= np.moveaxis(blocks[..., 1, :, :], -1, 0)
    return J.reshape(*J.shape[:-3], 2 * (N - 1), 2 * N)


def constraint_jacobian(robot: Manipulator, q) -> np.ndarray:
    """J(q) of (3), dh/dt = J qd, (..., 2(N-1), 2N) in m/rad."""
    return _cut(robot, tip_jacobians(robot, q))


def constraint_jacobian_dot(robot: Manipulator, q, qd) -> np.ndarray:
    """dJ/dt along qd, (..., 2(N-1), 2N) in m/(rad s), so that d2h/dt2 = J qdd + Jdot qd."""
    q, qd = joint_vectors(robot.n_joints, q=q, qd=qd)
    a, d = arm_vectors(robot, q)
    base_rate = qd[..., : robot.n_arms, None]
    link_rate = base_rate + qd[..., robot.n_arms :, None]
    return _cut(robot, -np.stack([base_rate * a + link_rate * d, link_rate * d], axis=-1))


def reachable(robot: Manipulator, x) -> np.ndarray:
    """True where all N arms reach the point x, (...,); x is (..., 2) in m."""
    x = real_array("x", x, 2)
    reach = np.linalg.norm(x[..., None, :] - robot.base, axis=-1)
    l1, l2 = robot.lengths.T
    return np.all((reach <= l1 + l2) & (reach >= np.abs(l1 - l2)), axis=-1)


def working_modes(robot: Manipulator) -> np.ndarray:
    """All 2^N working modes, (2^N, N), entries +1 or -1, the all-positive one first."""
    return np.array(list(itertools.product([1, -1], repeat=robot.n_arms)))


def working_mode(robot: Manipulator, q) -> np.ndarray:
    """s_i = sign(sin(elbow angle i)), (..., N); 0 where an arm is stretched or folded."""
    q = real_array("q", q, robot.n_joints)
    sine = np.sin(q[..., robot.n_arms :])
    return np.where(np.abs(sine) < 1e-12, 0, np.sign(sine)).astype(int)


def inverse_kinematics(robot: Manipulator, x, mode=None) -> np.ndarray:
    """Joint angles (..., 2N) in rad, in (-pi, pi], of the end-effector position x (..., 2) in m.

    mode : (..., N) signs of the elbow angles; default ``robot.mode``.
    Raises ValueError naming the point, the arm and its reach when the point lies outside the workspace.

    >>> from rapkm_lite import load
    >>> inverse_kinematics(load(), [0.0, 0.0]).round(4)
    array([-0.4317,  1.6627, -2.5261,  1.9106,  1.9106,  1.9106])
    """
    x = real_array("x", x, 2)
    mode = robot.mode if mode is None else real_array("mode", mode, robot.n_arms)
    if not np.all(np.abs(mode) == 1.0):
        raise ValueError(f"mode = {mode}; allowed: +1 or -1 for each of the {robot.n_arms} arms")
    check_leading(x=x.shape[:-1], mode=mode.shape[:-1])
    l1, l2 = robot.lengths.T
    D = x[..., None, :] - robot.base
    reach = np.linalg.norm(D, axis=-1)
    cosine = (reach**2 - l1**2 - l2**2) / (2 * l1 * l2)
    outside = np.abs(cosine) > 1.0 + 1e-12
    if np.any(outside):
        *where, arm = np.argwhere(outside)[0]
        at = f"x[{', '.join(map(str, where))}]" if where else "x"
        point, low, high = x[tuple(where)], abs(l1[arm] - l2[arm]), l1[arm] + l2[arm]
        raise ValueError(
            f"{at} = ({point[0]:.6g}, {point[1]:.6g}) m lies outside the workspace: it is {reach[(*where, arm)]:.6g} m "
            f"from base point {arm + 1}; allowed: {low:g} to {high:g} m"
        )
    elbow = mode * np.arccos(np.clip(cosine, -1.0, 1.0))
    base = np.arctan2(D[..., 1], D[..., 0]) - np.arctan2(l2 * np.sin(elbow), l1 + l2 * np.cos(elbow))
    return np.concatenate([wrap(base), elbow], axis=-1)


def wrap(angle: np.ndarray) -> np.ndarray:
    """The same angle in (-pi, pi], rad."""
    return np.pi - np.mod(np.pi - angle, 2 * np.pi)


def ee_complement(robot: Manipulator, q) -> np.ndarray:
    """F for the end-effector position as independent coordinates: qd = F xd, (..., 2N, 2) in rad/m.

    Regular everywhere inside the workspace, in every working mode.
    Raises ValueError where an arm is stretched or folded (boundary of the workspace).
    """
    a, d = arm_vectors(robot, q)
    den = _driving_lever(robot, a, d)
    base = d / den
    link = -a / den
    return np.concatenate([base, link - base], axis=-2)


def ee_complement_dot(robot: Manipulator, q, qd) -> np.ndarray:
    """dF/dt of `ee_complement` along qd, (..., 2N, 2) in rad/(m s)."""
    q, qd = joint_vectors(robot.n_joints, q=q, qd=qd)
    a, d = arm_vectors(robot, q)
    den = _driving_lever(robot, a, d)
    base_rate = qd[..., : robot.n_arms, None]
    link_rate = base_rate + qd[..., robot.n_arms :, None]
    a_dot, d_dot = base_rate * turn(a), link_rate * turn(d)
    den_dot = (cross(a_dot, d) + cross(a, d_dot))[..., None]
    base = d_dot / den - d * den_dot / den**2
    link = -a_dot / den + a * den_dot / den**2
    return np.concatenate([base, link - base], axis=-2)


def _driving_lever(robot: Manipulator, a: np.ndarray, d: np.ndarray) -> np.ndarray:
    """a_i x d_i = l1 l2 sin(elbow angle), (..., N, 1); zero at the boundary of the workspace."""
    den = cross(a, d)[..., None]
    small = np.abs(den[..., 0]) < 1e-12 * robot.lengths.prod(axis=1)
    if np.any(small):
        arm = np.argwhere(small)[0][-1]
        raise ValueError(
            f"q puts arm {arm + 1} on the boundary of the workspace (sin(elbow angle) < 1e-12), where the end-effector "
            "position is no coordinate; allowed: poses inside, or independent joints instead of the end-effector"
        )
    return den
