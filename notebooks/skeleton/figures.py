"""Figures of lesson NN: TITLE."""

from __future__ import annotations

import numpy as np

from ...figures.maps import grid_points, on_grid, plot_map
from ...mechanics.actuation import control_matrix
from ...mechanics.kinematics import inverse_kinematics


def plot_turning_NN(robot, drive: int, ax=None, n: int = 121):
    """How far one drive (0-based) turns per metre of the end-effector at most, over the workspace.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting
    >>> ax = plotting.plot_turning_NN(rk.load(), 0, n=21)
    """
    x, y, inside, points = grid_points(robot, n)
    A = control_matrix(robot, inverse_kinematics(robot, points))
    turning = on_grid(inside, np.linalg.norm(A[:, drive], axis=-1))
    ax = plot_map(x, y, turning, ax, label="turning in rad per m", vmin=0.0, vmax=20.0)
    ax.set_title(f"drive {drive + 1}")
    return ax
