"""Loop constraints and their Jacobian (1) on the c-space V (3), inverse and forward kinematics, working modes.

Joint vector q = (base angles of arms 1..N, elbow angles of arms 1..N), rad; elbow angles are relative.
Every function takes one pose or any leading axes; the last axis is the component.
"""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import ArrayLike

from ..machine.arguments import check_leading, entry, real_array, short
from ..machine.manipulator import Manipulator, manipulator
from ..machine.reach import within
from . import cores
from .at import asked
from .cores import wrap as wrap
from .linalg import linear


def turn(v: np.ndarray) -> np.ndarray:
    """Quarter turn E v, counter-clockwise, of planar vectors (..., 2)."""
    return np.stack([-v[..., 1], v[..., 0]], axis=-1)


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Planar cross product a x b of vectors (..., 2)."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def unit_vector(angle: ArrayLike) -> np.ndarray:
    """(cos, sin) of an angle in rad, on a new last axis."""
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def arm_vectors(robot: Manipulator, q) -> tuple[np.ndarray, np.ndarray]:
    """Proximal vectors a_i and distal vectors d_i of all arms, each (..., N, 2) in m.

    >>> import numpy as np, rapkm_lite as rk; robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> a, d = rk.arm_vectors(robot, q)
    >>> np.allclose(robot.base + a + d, [0.02, 0.05])
    True
    """
    pose = asked(robot, q)
    return pose.a.copy(), pose.d.copy()


def tips(robot: Manipulator, q) -> np.ndarray:
    """Tips of the N arms of the cut tree, (..., N, 2) in m; where the loops are open, they differ.

    >>> import numpy as np, rapkm_lite as rk; robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> np.allclose(rk.tips(robot, q), [0.02, 0.05])
    True
    """
    pose = asked(robot, q)
    return robot.base + pose.a + pose.d


def forward_kinematics(robot: Manipulator, q) -> np.ndarray:
    """End-effector position (..., 2) in m: the tip of arm 2, from which all others are cut.

    On the configuration space V all tips agree; a rough q is taken as it is, and `close_loops` brings it there.

    >>> import rapkm_lite as rk; robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> rk.forward_kinematics(robot, q).round(12)
    array([0.02, 0.05])
    """
    return asked(robot, q).x.copy()


def loop_constraints(robot: Manipulator, q) -> np.ndarray:
    """h(q) of the first line of (1), (..., 2(N-1)) in m: (tip_1 - tip_2, tip_3 - tip_2, ..., tip_N - tip_2).

    >>> import numpy as np, rapkm_lite as rk
    >>> robot = rk.load()
    >>> bool(np.abs(rk.loop_constraints(robot, rk.inverse_kinematics(robot, [0.02, 0.05]))).max() < 1e-15)
    True
    """
    return linear(asked(robot, q)._v, robot.tree.gaps) + robot.tree.gap


def tip_jacobians(robot: Manipulator, q) -> np.ndarray:
    """d tip_i / d (base angle i, elbow angle i), (..., N, 2, 2) in m/rad."""
    columns = asked(robot, q).tip_columns
    return np.stack([columns[..., : robot.n_arms], columns[..., robot.n_arms :]], axis=-1).swapaxes(-3, -2)


def constraint_jacobian(robot: Manipulator, q) -> np.ndarray:
    """J(q) of the second line of (1), dh/dt = J qd = 0, (..., 2(N-1), 2N) in m/rad.

    >>> import rapkm_lite as rk; robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> rk.constraint_jacobian(robot, q).shape
    (4, 6)
    """
    return asked(robot, q).J.copy()


def constraint_jacobian_dot(robot: Manipulator, q, qd) -> np.ndarray:
    """dJ/dt along qd, (..., 2(N-1), 2N) in m/(rad s), so that d2h/dt2 = J qdd + Jdot qd.

    >>> import numpy as np, rapkm_lite as rk; robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> J_dot = rk.constraint_jacobian_dot(robot, q, q)
    >>> np.allclose(rk.constraint_jacobian_dot(robot, q, 2 * q), 2 * J_dot)
    True
    """
    return asked(robot, q, qd).J_dot.copy()


def reachable(robot: Manipulator, x) -> np.ndarray:
    """True where all N arms reach the point x, (...,); x is (..., 2) in m.

    >>> import rapkm_lite as rk
    >>> rk.reachable(rk.load(), [[0.0, 0.0], [0.5, 0.0]])
    array([ True, False])
    """
    manipulator(robot)
    x = real_array("x", x, 2)
    return within(np.linalg.norm(x[..., None, :] - robot.base, axis=-1), robot.lengths)


def working_modes(robot: Manipulator) -> np.ndarray:
    """All 2^N working modes, (2^N, N), entries +1 or -1, the all-positive one first.

    >>> import rapkm_lite as rk
    >>> rk.working_modes(rk.load("five_bar"))
    array([[ 1,  1],
           [ 1, -1],
           [-1,  1],
           [-1, -1]])
    """
    return np.array(list(itertools.product([1, -1], repeat=manipulator(robot).n_arms)))


def working_mode(robot: Manipulator, q) -> np.ndarray:
    """s_i = sign(sin(elbow angle i)), (..., N); 0 where an arm is stretched or folded.

    >>> import rapkm_lite as rk; robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> rk.working_mode(robot, q)
    array([1, 1, 1])
    """
    q = real_array("q", q, manipulator(robot).n_joints)
    sine = np.sin(q[..., robot.n_arms :])
    return np.where(np.abs(sine) < 1e-12, 0, np.sign(sine)).astype(int)


def inverse_kinematics(robot: Manipulator, x, mode=None) -> np.ndarray:
    """Joint angles (..., 2N) in rad, in [-pi, pi], of the end-effector position x (..., 2) in m.

    mode : (..., N) signs of the elbow angles; default ``robot.mode``.
    Raises ValueError naming the point, the arm and its reach when the point lies outside the workspace.

    >>> import rapkm_lite as rk
    >>> rk.inverse_kinematics(rk.load(), [0.0, 0.0]).round(4)
    array([-0.4317,  1.6627, -2.5261,  1.9106,  1.9106,  1.9106])
    """
    manipulator(robot)
    x = real_array("x", x, 2)
    mode = robot.mode if mode is None else real_array("mode", mode, robot.n_arms)
    if not np.all(np.abs(mode) == 1.0):
        raise ValueError(f"mode = {short(mode)}; allowed: +1 or -1 for each of the {robot.n_arms} arms")
    check_leading(x=x.shape[:-1], mode=mode.shape[:-1])
    q, cosine = cores.joint_angles(robot, x, mode)
    outside = np.abs(cosine) > 1.0 + 1e-12
    if np.any(outside):
        *where, arm = np.argwhere(outside)[0]
        (l1, l2), point = robot.lengths[arm], x[tuple(where)]
        raise ValueError(
            f"x{entry(where)} = ({point[0]:.6g}, {point[1]:.6g}) m lies outside the workspace: it is "
            f"{np.hypot(*(point - robot.base[arm])):.6g} m from base point {arm + 1}; "
            f"allowed: {abs(l1 - l2):g} to {l1 + l2:g} m"
        )
    return q
