"""Closure of redundant encoders: what N measured angles of a two-coordinate pose say about themselves.

The unknowns p stand in one vector: offsets (N,) in rad, then lengths (2N,) arm by arm and base points (2N,) in m, or
only the first N or 3N of them.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from ..machine.arguments import ConvergenceError, matvec, real_array, shaped
from ..machine.logs import Log, read_log
from ..machine.manipulator import Manipulator
from ..machine.reach import crossings
from . import cores
from .at import At, at
from .closure import estimate_pose, misfit
from .kinematics import cross, turn, unit_vector
from .linalg import minors


def unknown_names(N: int) -> tuple[str, ...]:
    """Offsets, lengths, base points, in the order of p."""
    arms = range(1, N + 1)
    return (
        *(f"offset {i}" for i in arms),
        *(f"length {what} {i}" for i in arms for what in ("proximal", "distal")),
        *(f"base {axis} {i}" for i in arms for axis in "xy"),
    )


def measured(robot: Manipulator, log) -> tuple[np.ndarray, list[Log]]:
    """All measured angles (k, N), and the logs they come from, none for bare angles.

    Raises ValueError for what is neither, and for another number of drives than the machine has.
    """
    given = log if isinstance(log, list | tuple) else [log]
    if given and all(isinstance(part, Log | str | Path) for part in given):
        logs = [part if isinstance(part, Log) else read_log(part) for part in given]
        for part in logs:
            if part.q_a.shape[1] != robot.n_arms:
                raise ValueError(f"log = {part!r} has {part.q_a.shape[1]} drives; allowed: {robot.n_arms}")
        return np.concatenate([part.q_a for part in logs]), logs
    try:
        angles = real_array("log", log, robot.n_arms)
    except ValueError as error:
        raise ValueError(f"{error}, a Log, as run.log() makes one, a path, or a list of these") from None
    fits = angles.ndim == 2 and len(angles) > 0
    return shaped("log", angles, fits, f"angles (k, {robot.n_arms}) with k >= 1, or a Log"), []


def rounding(angles: np.ndarray) -> float:
    """Standard deviation of the rounding where the readings are counts of one size, that size over sqrt(12), or 0."""
    steps = np.diff(np.sort(angles, axis=0), axis=0).ravel()
    # Below 1e-12 rad a step is floating-point rounding.
    steps = steps[steps > 1e-12]
    # Of few readings no two need lie one count apart: then the count is a part of the smallest step.
    for parts in range(1, 101 if len(steps) > 5 else 2):
        count = steps.min(initial=np.inf) / parts
        if len(steps) and np.abs(steps / count - np.rint(steps / count)).max() <= (0.01 if parts == 1 else 1e-3):
            return float(count) / math.sqrt(12)
    return 0.0


def changed(robot: Manipulator, p: np.ndarray) -> Manipulator:
    """The machine with the lengths and base points of p; raises ConvergenceError where it is none."""
    N = robot.n_arms
    if len(p) == N:
        return robot
    lengths = p[N : 3 * N].reshape(N, 2)
    changes = {"lengths": lengths}
    if np.any(robot.centers > lengths):  # a centre of mass at its outer joint moves with it
        changes["centers"] = np.minimum(robot.centers, lengths)
    if len(p) > 3 * N:
        changes["base"] = p[3 * N :].reshape(N, 2)
    try:
        return robot.replace(**changes)
    except ValueError as error:
        raise ConvergenceError(
            f"calibrate did not converge: a step led to a machine that is none ({error}); "
            "allowed: a log of this machine, whose angles are near a pose"
        ) from None


def poses(robot: Manipulator, angles: np.ndarray, guess=None) -> np.ndarray:
    """Configurations (k, 2N) nearest to the angles (k, N) rad, from the best of all crossings and the guess (k, 2) m.

    Raises ValueError for angles that fit no pose.
    """
    starts = _crossings(robot, angles)
    if guess is not None:
        starts = np.concatenate([guess[None], starts])
    # The circles of one pair may cross badly, or not at all, where those of another cross well.  A crossing that fits
    # better than the pose of least squares nearby belongs to another assembly, and to a better one.
    best = np.argmin(_fit(robot, angles, starts), axis=0)
    try:
        return estimate_pose(robot, angles, starts[best, np.arange(len(angles))])
    except ValueError as error:
        found = str(error).partition("; allowed: ")[0]
        raise ValueError(
            f"log holds angles that fit no pose of {robot!r}: {found}; allowed: base angles in rad, counter-clockwise "
            "from the x axis, in the order of the arms"
        ) from None


def certain(robot: Manipulator, angles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Which of the angles (k, N) rad leave no doubt about their assembly mode, (k,), and the places (k, 2) m of all.

    The worst misfit of all poses shows how wrong readings may be.  In doubt is what a second assembly may fit as well.
    Raises ValueError for angles that fit no pose.
    """
    pose = at(robot, poses(robot, angles))
    side = minors(pose.d).T
    across = np.concatenate([side < 0.0, side > 0.0])
    second = np.where(across, _fit(robot, angles, _crossings(robot, angles)), np.inf)
    # With residuals r at a pose, those at the crossing of the pair S of largest |det A_S| are r - A A_S^-1 r_S to first
    # order; no entry of A A_S^-1 exceeds 1, and 1 + 2 (N - 2) bounds the growth of the square.
    return second.min(axis=0) > (2 * robot.n_arms - 3) * _fit(robot, angles, pose.x).max(), pose.x


def _crossings(robot: Manipulator, angles: np.ndarray) -> np.ndarray:
    """Where distal links meet, (N (N - 1), k, 2) m: of all pairs i < j where d_i x d_j > 0, then the other points."""
    l1, l2 = robot.lengths.T
    i, j = np.triu_indices(robot.n_arms, 1)
    elbow = (robot.base + l1[:, None] * unit_vector(angles)).swapaxes(0, 1)
    return crossings(elbow[i], elbow[j], l2[i], l2[j])


def _fit(robot: Manipulator, angles: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Sums of the squared residuals of the angles (k, N) at places x (..., k, 2), rad^2; infinite where none fits.

    That is out of reach, and where an arm would point the other way, by more than a quarter of a turn.
    """
    _, residual, square = misfit(robot, angles, x)
    return np.where((np.abs(residual) > np.pi / 2).any(axis=-1), np.inf, square)


def closure(pose: At, angles: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """n^T (angles - q_a) at the poses, (k (N - 2),) rad, and its Jacobian in the first unknowns, (k (N - 2), count).

    At a fixed end-effector d . db + (a . d / l1) dl1 + l2 dl2 + (a x d) dq_a = 0 for each arm.
    """
    a, d, (l1, l2) = pose.a, pose.d, pose.robot.lengths.T
    lever, n = cross(a, d), cores.null_space(pose.A)
    left = matvec(n.mT, cores.wrap(angles - pose.q[:, : len(l1)])).ravel()
    # Of each arm: offset, lengths, base point; then by kind, as p has them.
    moved = np.stack([-lever, np.vecdot(a, d) / l1, np.broadcast_to(l2, lever.shape), d[..., 0], d[..., 1]], axis=-1)
    rows = n.mT[..., None] * (moved / lever[..., None])[:, None]
    kinds = [part.reshape(len(left), -1) for part in np.split(rows, [1, 3], axis=-1)]
    return left, np.concatenate(kinds, axis=1)[:, :count]


def gauge(robot: Manipulator) -> np.ndarray:
    """Scale, rotation and translations of the base points alone, orthonormal columns (2N, 4)."""
    arm = robot.base - robot.base.mean(axis=0)
    shifts = np.tile(np.eye(2), (robot.n_arms, 1))
    return np.linalg.qr(np.column_stack([arm.ravel(), turn(arm).ravel(), shifts]))[0]


def cautions(
    x: np.ndarray, robot: Manipulator, condition: float, spread: float, step: float, noise: float | None
) -> list[str]:
    """What to mind: a residual above the noise, or else above the steps of the readings (rad), places (k, 2) close."""
    said = []
    if noise:
        size, what, cause, many = noise, "the noise", "something else", False
    else:
        size, what = step, "the steps of the readings,"
        # Of many readings that agree but for their rounding the residual is known to a few hundredths.
        many = len(x) > 100
        cause = "they have more noise than that (to be given as noise), or something"
    if not size and spread == 0.0:
        said.append("no reading is left over to show the noise, so that the covariance is none: pass noise")
    if not size and spread > 1e-6:
        said.append(
            f"the noise is taken from the residual {1e3 * spread:.3g} mrad, where a wrong geometry may hide: pass noise"
        )
    if size and spread > (1.5 if many else 3.0) * size:
        said.append(
            f"the residual {1e3 * spread:.3g} mrad exceeds {what} {1e3 * size:.2g} mrad: {cause} is wrong, such as a "
            "length, a base point or the order of columns"
        )
    extent = float(np.linalg.norm(x - x.mean(axis=0), axis=-1).max())
    if extent < 0.25 * robot.lengths.max():
        said.append(f"all places lie within {extent:.2g} m of their centre, close together: spread them")
    if condition > 50:
        said.append(f"the equations have the condition number {condition:.3g}, which multiplies the noise")
    return said
