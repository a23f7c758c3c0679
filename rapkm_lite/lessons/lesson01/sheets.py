"""The sheets of the configuration space V of (3), one per working mode, over the base angles."""

from __future__ import annotations

import numpy as np

from ...figures.maps import grid_points
from ...figures.marks.plane import roomiest
from ...mechanics.kinematics import inverse_kinematics, reachable, unit_vector, wrap


def configuration_sheet(robot, mode, n: int = 32) -> np.ndarray:
    """Base angles (n, rays, N) in rad over a polar grid of the workspace in one working mode, without jumps of 2 pi."""
    centre = _sheet_centre(robot)
    # At a corner on a base point one point of the plane is a whole edge of the sheet: rays crowd there.
    corners = np.arctan2(*(robot.base - centre).T[::-1])
    crowd = np.concatenate([[0], np.logspace(-7, -1.5, 8), -np.logspace(-7, -1.5, 8)])
    rays = np.concatenate([np.linspace(0, 2 * np.pi, 4 * n + 1), np.ravel(corners[:, None] + crowd) % (2 * np.pi)])
    way = unit_vector(np.sort(rays))
    low, high = np.zeros(len(way)), np.full(len(way), 2 * robot.lengths.sum(axis=1).max())
    for _ in range(50):
        middle = (low + high) / 2
        inside = reachable(robot, centre + middle[:, None] * way)
        low, high = np.where(inside, middle, low), np.where(inside, high, middle)
    # Rings close together at the rim, where the angles change like a square root; the last one stays just inside.
    ring = np.sin(np.linspace(0, np.pi / 2, n)) * (1 - 1e-10)
    q = inverse_kinematics(robot, centre + ring[:, None, None] * low[:, None] * way, mode)
    return on_sheet(robot, q[..., : robot.n_arms])


def _sheet_centre(robot) -> np.ndarray:
    """The mean of the base points (2,) in m, or, where that is out of reach, the place with the most room.

    ValueError where a circle that an arm cannot fold into hides a part of the workspace from there.
    """
    centre = robot.base.mean(axis=0) if reachable(robot, robot.base.mean(axis=0)) else roomiest(robot)
    way = grid_points(robot, 101)[3] - centre
    for base, inner in zip(robot.base - centre, np.abs(robot.lengths[:, 0] - robot.lengths[:, 1]), strict=True):
        part = np.clip(way @ base / np.maximum(np.sum(way**2, axis=-1), 1e-300), 0.0, 1.0)
        if np.any(np.linalg.norm(part[:, None] * way - base, axis=-1) < (1 - 1e-9) * inner):
            parts = "allowed: one seen as a whole from one place, as with two equal links in each arm"
            raise ValueError(f"robot has a workspace with holes, bays or several parts, which no sheet shows; {parts}")
    return centre


def on_sheet(robot, q_a) -> np.ndarray:
    """Base angles (..., N) in rad on the turn that `configuration_sheet` shows."""
    start = np.arctan2(*(_sheet_centre(robot) - robot.base).T[::-1])
    return start + wrap(q_a - start)
