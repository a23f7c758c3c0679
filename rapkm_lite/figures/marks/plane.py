"""The workspace as lines and points: its outline, its singular curves, the way back into it."""

from __future__ import annotations

import math

import numpy as np
from contourpy import contour_generator

from ...machine.manipulator import Manipulator
from ...mechanics.actuation import distal_cross_products, drive_pairs
from ...mechanics.kinematics import inverse_kinematics, reachable
from ...mechanics.maps import sampling_box
from ...mechanics.partition import first_best
from ..maps import grid_points, on_grid, touching_arcs


def workspace_outline(robot) -> np.ndarray:
    """Rings (k, 2) in m around the points that all arms reach, separated by rows of NaN."""
    left, right, low, high = sampling_box(robot)
    wide, tall = 0.01 * (right - left), 0.01 * (high - low)
    x, y = np.linspace(left - wide, right + wide, 161), np.linspace(low - tall, high + tall, 161)
    rings = contour_generator(x, y, room(robot, np.stack(np.meshgrid(x, y), axis=-1))).lines(0.0)
    parts = [part for ring in rings for part in (np.asarray(ring), np.full((1, 2), np.nan))]
    return np.concatenate([*parts, np.empty((0, 2))])[:-1]


def room(robot: Manipulator, points) -> np.ndarray:
    """How far points (..., 2) are from where an arm is stretched or folded, (...,) in m; negative outside."""
    reach = np.linalg.norm(points[..., None, :] - robot.base, axis=-1)
    l1, l2 = robot.lengths.T
    inner = np.abs(l1 - l2)
    # Arms of equal links reach their own base, a single point that would only dent the outline.
    return np.minimum(l1 + l2 - reach, np.where(inner > 1e-9, reach - inner, np.inf)).min(axis=-1)


def middle(robot: Manipulator) -> np.ndarray:
    """The place (2,) in m about which pictures are made: the middle of the drives.

    Just between two drives a machine of two arms is singular: for it, the middle that a third drive would make at the
    same distances.
    """
    centre = robot.base.mean(axis=0)
    if robot.n_arms > 2:
        return centre
    along = robot.base[1] - robot.base[0]
    return centre + np.array([-along[1], along[0]]) / np.sqrt(12)


def roomiest(robot: Manipulator) -> np.ndarray:
    """The place (2,) in m of a grid from which all arms can go on farthest; ValueError where there is none."""
    points = grid_points(robot, 41)[3]
    if not len(points):
        raise ValueError("all arms reach a single point, or hardly more")
    return points[first_best(room(robot, points))]


def clamped(robot: Manipulator, point) -> np.ndarray:
    """The point (2,) in m, or the last one that all arms reach on the way to it.

    The way begins in the middle of the drives, or, where that is out of reach, in `roomiest`.
    """
    if room(robot, point) > 1e-9 * robot.lengths.max():  # where an arm is stretched or folded it is no pose
        return np.asarray(point)
    start = robot.base.mean(axis=0)
    start = start if reachable(robot, start) else roomiest(robot)
    low, high = 0.0, 1.0
    for _ in range(40):
        half = (low + high) / 2
        inside = reachable(robot, start + half * (point - start))
        low, high = (half, high) if inside else (low, half)
    # A little inside (a millimetre of the testbed), where no arm is quite stretched.
    back = 5e-3 * robot.lengths.max() / max(np.linalg.norm(point - start), 1e-300)
    return start + max(low - back, 0.0) * (point - start)


def reached(robot: Manipulator, point, step: float) -> tuple[np.ndarray, str]:
    """Where `clamped` ends, (2,) in m, and words that say so where it is more than a quarter of a step (m) away."""
    there = clamped(robot, point)
    short = bool(np.abs(there - point).max() > 0.25 * step)
    return there, (in_mm(there, step) + ": an arm reaches no further") * short


def in_mm(point, step: float) -> str:
    """A point (2,) in m as words, in mm, with the decimals of a step (m).

    >>> in_mm([0.0123, -0.004], 1e-4), in_mm([0.0123, -0.004], 1e-3)
    ('(12.3, -4.0) mm', '(12, -4) mm')
    """
    digits = max(0, -math.floor(math.log10(1e3 * step) + 1e-9))
    return "({:z.{n}f}, {:z.{n}f}) mm".format(1e3 * point[0], 1e3 * point[1], n=digits)


def singular_curves(robot: Manipulator) -> dict:
    """For each pair the lines, each (j, 2) in m, on which its distal links are parallel."""
    x, y, inside, points = grid_points(robot, 161)
    values = distal_cross_products(robot, inverse_kinematics(robot, points))
    return {
        pair: zero_lines(x, y, inside, values[:, i]) + touching_arcs(robot, pair)
        for i, pair in enumerate(drive_pairs(robot))
    }


def zero_lines(x, y, inside, values) -> list:
    """The lines, each (j, 2), where values (k,) at the points of `grid_points` change their sign."""
    return list(contour_generator(x, y, on_grid(inside, values)).lines(0.0))
