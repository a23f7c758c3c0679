"""Times and rates of a sampled motion, checked before a path is made of them; the joint motion of its samples."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from ..machine.arguments import positive_number, real_array, shaped, short
from ..machine.manipulator import Manipulator
from ..machine.values import frozen
from .cores import EDGE
from .kinematics import inverse_kinematics

Motion: TypeAlias = Callable[[slice], tuple[np.ndarray, np.ndarray, np.ndarray]]
"""x, xd, xdd (k, 2) of some samples."""
MOST = 10_000_000
"""Samples of a path: nearly three hours at 1 kHz."""
PART = 16384
"""Samples of a path that are looked at together: their matrices fit into a cache, those of minutes not into memory."""


def sample_times(duration: float, dt: float) -> np.ndarray:
    """Times from 0 to `duration` in steps of dt, s."""
    duration, dt = positive_number("duration", duration), positive_number("dt", dt)
    if dt < 1e-12:
        raise ValueError(f"dt = {dt:g} s; allowed: 1e-12 s or more")
    steps = round(duration / dt)
    if steps > MOST:
        raise ValueError(f"duration = {duration:g} s has {steps:.9g} samples of dt = {dt:g} s; allowed: up to {MOST}")
    if steps < 1 or abs(steps * dt - duration) > 1e-9 * duration:
        raise ValueError(f"dt = {dt:.12g} s; allowed: a whole fraction of duration = {duration:.12g} s")
    return np.arange(steps + 1) * (duration / steps)


def equidistant(t) -> np.ndarray:
    """Times (k,) in s, the multiples of their mean step, after a check that they rise equidistantly from zero."""
    t = real_array("t", t)
    shaped("t", t, t.ndim == 1 and len(t) >= 2, "(k,) with at least two samples")
    if t[0] != 0.0 or t[-1] <= 0.0:
        raise ValueError(f"t = {t[0]:g}, {t[1]:g}, ..., {t[-1]:g}; allowed: rising, equidistant times that start at 0")
    step = t[-1] / (len(t) - 1)
    off = np.abs(np.diff(t) - step)
    if off.max() > 1e-6 * step:
        k = int(np.argmax(off))
        raise ValueError(
            f"t[{k + 1}] - t[{k}] = {t[k + 1] - t[k]:.9g} s, on average {step:.9g} s; allowed: equidistant times, to "
            "1e-6 of a step (rounded ones: np.arange(k) * dt)"
        )
    return np.arange(len(t)) * step


def check_rates(t: np.ndarray, x: np.ndarray, xd: np.ndarray, xdd: np.ndarray) -> None:
    """Refuse rates that are no derivative of the positions; a few jumps, as of set-points, are allowed."""
    # Accelerations may jump, are rough where they are differences of a recorded path, and PD does without them.
    for name, v, rate, units, share in (("x", x, xd, ("m", "m/s"), 0.1), ("xd", xd, xdd, ("m/s", "m/s^2"), 0.5)):
        if (fastest := np.abs(rate).max()) > 1e30:
            raise ValueError(f"{name}d has entries of {fastest:.3g} {units[1]}; allowed: up to 1e30 {units[1]}")
        moved, (before, after) = np.diff(v, axis=0), (t[1] * rate[:-1], t[1] * rate[1:])
        meant = (before + after) / 2
        if name == "xd":
            meant = np.clip(moved, np.minimum(before, after), np.maximum(before, after)) if xdd.any() else moved
        off, made, told = (np.linalg.norm(step, axis=-1) for step in (moved - meant, moved, meant))
        wrong = off > share * max(made.max(), told.max()) + 1e-12
        if np.count_nonzero(wrong) > 2 + 0.05 * len(t):
            k = int(np.argmax(off))
            raise ValueError(
                f"{name}d[{k}] = {rate[k].round(6).tolist()} {units[1]} does not fit {name}: from t = {t[k]:g} s to "
                f"{t[k + 1]:g} s {name} changes by {moved[k].round(9).tolist()} {units[0]}, {name}d means "
                f"{meant[k].round(9).tolist()} {units[0]}; allowed: the time derivative of {name}, such as "
                f"np.gradient({name}, t[1], axis=0)"
            )


def quintic(s) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The way from 0 to 1 at the shares s (...,) of the time, from rest to rest, and its derivatives in s."""
    return s**3 * (10 - 15 * s + 6 * s * s), 30 * (s * (1 - s)) ** 2, 60 * s * (1 - s) * (1 - 2 * s)


def slow_edges(t: np.ndarray, edges: int, rest: float) -> float:
    """The time of an edge of a polygon in s, unless samples would miss a corner or the motion.

    With two samples in that time one lies inside every edge, and one within a quarter of it of every corner, where a
    tenth of the edge is covered.
    """
    duration, dt = t[-1], t[-1] / (len(t) - 1)
    if not 0.0 <= 2 * rest < duration:
        raise ValueError(f"rest = {rest:g} s; allowed: 0 <= rest < duration / 2 = {duration / 2:g} s")
    edge_time = (duration - 2 * rest) / edges
    if edge_time < 2 * dt * (1 - 1e-9):
        raise ValueError(
            f"dt = {dt:g} s; allowed: up to half the time of an edge, which is {edge_time:g} s ({edges} edges in "
            f"duration - 2 rest = {duration - 2 * rest:g} s), so a shorter dt, a longer duration, less rest or fewer "
            "corners"
        )
    return edge_time


def slow_turns(t: np.ndarray, turns) -> float:
    """The turns of a circle, unless samples would show another one; a quintic is 15/8 times as fast as on average."""
    turns = positive_number("turns", turns)
    largest = 15 / 8 * 2 * np.pi * turns / (len(t) - 1)
    if largest > np.pi / 2:
        raise ValueError(
            f"turns = {turns:g} in {t[-1]:g} s are up to {largest:.3g} rad per sample; allowed: up to pi / 2, so fewer "
            "turns, a longer duration or a shorter dt"
        )
    return turns


def columns(robot: Manipulator, t: np.ndarray, motion: Motion, given: dict) -> list[np.ndarray]:
    """x, xd, xdd (k, 2) and q, qd, qdd (k, 2N) of a motion at the times t (k,), read-only.

    motion : gives x, xd, xdd of some rows.  given : what the caller was asked for, for the sentence of an error.
    Raises ValueError when the path leaves the workspace.
    """
    made = [np.empty((len(t), size)) for size in [2, 2, 2, *[robot.n_joints] * 3]]
    for first in range(0, len(t), PART):
        rows, before = slice(first, first + PART), made[3][first - 1 : first]
        path = motion(rows)
        try:
            parts = *path, *joint_motion(robot, *path, before)
        except ValueError:
            raise refusal(robot, motion(slice(None))[0], given) from None
        for column, part in zip(made, parts, strict=True):
            column[rows] = part
    del column
    made.reverse()  # and emptied on the way, so that only one column at a time exists twice
    return [frozen(made.pop()) for _ in range(len(made))]


def joint_motion(robot: Manipulator, x, xd, xdd, before) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """q, qd = F xd and qdd = F xdd + Fdot xd, each (k, 2N), for some samples of a path; `before` is the row of q
    from which the base angles go on, if there is one.

    Without F: the tip of an arm moves with xd = w1 E a + w2 E d, w1 and w2 the rates of its links, so that
    w1 = d . xd / (a x d) and w2 = -a . xd / (a x d); their derivatives come likewise from xdd + w1^2 a + w2^2 d.
    """
    q, N = inverse_kinematics(robot, x), robot.n_arms
    base = np.concatenate([before[:, :N], q[:, :N]])
    if np.abs(np.diff(base, axis=0)).max(initial=0.0) >= np.pi:
        q[:, :N] = np.unwrap(base, axis=0)[len(base) - len(q) :]
    # Arms first, as in memory loops run along the samples.
    angle, l1 = np.ascontiguousarray(q[:, :N].T), robot.lengths[:, :1]
    a = l1 * np.cos(angle), l1 * np.sin(angle)
    d = [np.add.outer(-robot.base[:, i], x[:, i]) - a[i] for i in range(2)]
    bend = np.sin(q[:, N:].T)
    if np.any(np.abs(bend) < EDGE):
        raise ValueError("an arm is stretched or folded")
    lever = robot.tree.most[:, None] * bend

    def rates(u0, u1) -> np.ndarray:
        """Base and elbow joints, (2N, k), when the tips move at the rate (u0, u1)."""
        first = (d[0] * u0 + d[1] * u1) / lever
        return np.concatenate([first, -(a[0] * u0 + a[1] * u1) / lever - first])

    qd = rates(*xd.T)
    links = qd[:N] ** 2, (qd[:N] + qd[N:]) ** 2
    qdd = rates(*(xdd[:, i] + a[i] * links[0] + d[i] * links[1] for i in range(2)))
    return q, qd.T, qdd.T


def refusal(robot: Manipulator, x, given: dict) -> ValueError:
    """The error of a path that leaves the workspace or touches its edge, with what the caller was asked for."""
    words = ", ".join(f"{k} = {short(v)}" for k, v in given.items())
    try:
        elbows = inverse_kinematics(robot, x)[:, robot.n_arms :]
    except ValueError as outside:
        return ValueError(f"{outside} (a path with {words})")
    k, arm = np.unravel_index(np.argmin(np.abs(np.sin(elbows))), elbows.shape)
    return ValueError(
        f"x[{k}] = {x[k].round(9).tolist()} m puts arm {arm + 1} on the boundary of the workspace, stretched or folded "
        f"(a path with {words}); allowed: points inside"
    )


def chosen(samples: int, k):
    """The samples that an index stands for: an int, or an array of them."""
    if isinstance(k, int | np.integer) and not isinstance(k, bool) and -samples <= k < samples:
        return int(k)
    if isinstance(k, slice | list | np.ndarray):
        try:
            return np.arange(samples)[k]
        except (IndexError, TypeError, ValueError):
            pass
    raise IndexError(f"k = {short(k)}; allowed: a sample from 0 to {samples - 1}, a slice, or an array of samples")
