"""Closure of redundant encoders: what N measured angles of a two-coordinate pose say about themselves.

The unknowns p stand in one vector: offsets (N,) in rad, then lengths (2N,) arm by arm and base points (2N,) in m, or
only the first N or 3N of them.
"""

from __future__ import annotations

import math

import numpy as np

from ..machine.arguments import ConvergenceError
from ..machine.manipulator import Manipulator
from . import cores
from .at import At
from .closure import estimate_pose
from .kinematics import cross, unit_vector


def unknown_names(N: int) -> tuple[str, ...]:
    """Offsets, lengths, base points, in the order of p."""
    arms = range(1, N + 1)
    return (
        *(f"offset {i}" for i in arms),
        *(f"length {what} {i}" for i in arms for what in ("proximal", "distal")),
        *(f"base {axis} {i}" for i in arms for axis in "xy"),
    )


def rounding(angles: np.ndarray) -> float:
    """Standard deviation of the rounding where the readings are counts of one size, that size over sqrt(12), or 0."""
    steps = np.diff(np.sort(angles, axis=0), axis=0).ravel()
    # Below 1e-12 rad a step is a rounding of the computer.
    steps = steps[steps > 1e-12]
    count = steps.min(initial=np.inf)
    if not len(steps) or np.abs(steps / count - np.rint(steps / count)).max() > 0.01:
        return 0.0
    return float(count) / math.sqrt(12)


def changed(robot: Manipulator, p: np.ndarray) -> Manipulator:
    """The machine with the lengths and base points of p."""
    N = robot.n_arms
    if len(p) == N:
        return robot
    changes = {"lengths": p[N : 3 * N].reshape(N, 2)}
    if len(p) > 3 * N:
        changes["base"] = p[3 * N :].reshape(N, 2)
    return robot.replace(**changes)


def poses(robot: Manipulator, angles: np.ndarray, guess=None) -> np.ndarray:
    """Configurations (k, 2N) nearest to the angles."""
    try:
        return estimate_pose(robot, angles, _crossings(robot, angles) if guess is None else guess)
    except (ConvergenceError, ValueError) as error:
        raise ValueError(f"log holds angles that fit no pose of {robot!r}: {error}") from None


def _crossings(robot: Manipulator, angles: np.ndarray) -> np.ndarray:
    """Where the distal links of the first two arms meet, (k, 2) m; of the two crossings the one that suits all arms."""
    l1, l2 = robot.lengths.T
    a = l1[:, None] * unit_vector(angles)
    elbow = robot.base + a
    gap = elbow[:, 1] - elbow[:, 0]
    distance = np.maximum(np.linalg.norm(gap, axis=-1, keepdims=True), 1e-12)
    unit = gap / distance
    along = (distance**2 + l2[0] ** 2 - l2[1] ** 2) / (2 * distance)
    across = np.sqrt(np.maximum(l2[0] ** 2 - along**2, 0.0)) * np.stack([-unit[:, 1], unit[:, 0]], axis=-1)
    middle = elbow[:, 0] + along * unit
    both = np.stack([middle + across, middle - across])
    d = both[..., None, :] - elbow
    wrong_mode = np.sum(cross(a, d) * robot.mode < 0, axis=-1)
    gaps = np.abs(np.linalg.norm(d, axis=-1) - l2).sum(axis=-1)
    best = np.argmin(wrong_mode + gaps / l2.max(), axis=0)
    return both[best, np.arange(len(best))]


def closure(pose: At, angles: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """n^T (angles - q_a) at the poses, (k (N - 2),) rad, and its derivative by the first unknowns, (k (N - 2), count).

    At a fixed end-effector d . db + (a . d / l1) dl1 + l2 dl2 + (a x d) dq_a = 0 for each arm.
    """
    robot, d = pose.robot, pose.d
    N, l1, l2 = robot.n_arms, *robot.lengths.T
    columns = np.zeros((len(d), N, 5 * N))
    i = np.arange(N)
    lever = cross(pose.a, d)
    columns[:, i, i] = 1.0
    columns[:, i, N + 2 * i] = -np.einsum("kij,kij->ki", pose.a, d) / l1 / lever
    columns[:, i, N + 2 * i + 1] = -l2 / lever
    for axis in (0, 1):
        columns[:, i, 3 * N + 2 * i + axis] = -d[..., axis] / lever
    n = cores.null_space(pose.A)
    left = np.einsum("kij,ki->kj", n, cores.wrap(angles - pose.q[:, :N])).ravel()
    return left, -(n.mT @ columns[..., :count]).reshape(len(left), count)


def gauge(robot: Manipulator) -> np.ndarray:
    """Scale, rotation and translations of the base points alone, orthonormal columns (2N, 4)."""
    arm = robot.base - robot.base.mean(axis=0)
    turned = np.stack([-arm[:, 1], arm[:, 0]], axis=-1)
    ones = np.ones(robot.n_arms)
    shifts = (np.outer(ones, axis).ravel() for axis in np.eye(2))
    return np.linalg.qr(np.stack([arm.ravel(), turned.ravel(), *shifts], axis=-1))[0]


def cautions(x: np.ndarray, robot: Manipulator, condition: float, spread: float, noise: float) -> list[str]:
    """What to mind: a residual (rad) above the noise where that is known, and places x (k, 2) close together."""
    said = []
    if noise and spread > 3 * noise:
        said.append(
            f"the residual {1e3 * spread:.3g} mrad exceeds the noise {1e3 * noise:.2g} mrad: something else is wrong, "
            "such as a length or a base point"
        )
    extent = float(np.linalg.norm(x - x.mean(axis=0), axis=-1).max())
    if extent < 0.25 * robot.lengths.max():
        said.append(f"all places lie within {extent:.2g} m of their centre, close together: spread them")
    if condition > 50:
        said.append(f"the equations have the condition {condition:.3g}, which multiplies what noise there is")
    return said
