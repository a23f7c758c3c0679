"""Maps over the workspace: actuation measures, and which pair of drives is best where (sections 2.2 and 4.2).

Every map samples the end-effector position on a rectangular grid; points that not all arms reach are masked.
"""

from __future__ import annotations

import numpy as np

from ..machine.arguments import exact_array, joint_indices, one_of, real_array, short, whole_number
from ..machine.manipulator import Manipulator, manipulator
from ..machine.reach import within
from .actuation import distal_cross_products, drive_pairs
from .at import at
from .cores import prestress_shares
from .kinematics import inverse_kinematics
from .linalg import singular_values
from .partition import PARTITION_RULES, first_best


def sampling_box(robot: Manipulator) -> tuple[float, float, float, float]:
    """The rectangle (x_min, x_max, y_min, y_max) in m inside which all points lie that every arm can reach.

    >>> import numpy as np, rapkm_lite as rk
    >>> np.round(rk.sampling_box(rk.load()), 3)
    array([-0.2  ,  0.2  , -0.169,  0.285])
    """
    outer = manipulator(robot).lengths.sum(axis=1)[:, None]
    low, high = (robot.base - outer).max(axis=0), (robot.base + outer).min(axis=0)
    return float(low[0]), float(high[0]), float(low[1]), float(high[1])


def workspace_grid(robot: Manipulator, n: int = 200, box=None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Sample positions x (n,), y (n,) in m, and inside (n, n): True where every arm reaches (x[j], y[i]) with a bend.

    box : (x_min, x_max, y_min, y_max) in m; default `sampling_box`.
    Raises ValueError for an empty box, fewer than two samples or more than 5000.

    >>> import rapkm_lite as rk
    >>> x, y, inside = rk.workspace_grid(rk.load(), n=20)
    >>> x.shape, y.shape, inside.shape
    ((20,), (20,), (20, 20))
    """
    manipulator(robot)
    n = whole_number("n", n, 2, 5000)
    left, right, low, high = sampling_box(robot) if box is None else exact_array("box", box, 4)
    if not (left < right and low < high):
        raise ValueError(
            f"box = {tuple(map(float, (left, right, low, high)))}; allowed: (x_min, x_max, y_min, y_max) with min < max"
        )
    x, y = np.linspace(left, right, n), np.linspace(low, high, n)
    dx, dy = x[:, None] - robot.base[:, 0], y[:, None] - robot.base[:, 1]
    reach = np.hypot(dx, dy[:, None])
    # A hair inside the boundary, where an arm is stretched or folded and the end-effector is no coordinate.
    return x, y, within(reach, robot.lengths, -1e-9 * robot.lengths.sum(axis=1))


def actuation_map(robot: Manipulator, measure: str = "sigma_min", mode=None, n: int = 200, box=None, pair=None):
    """An actuation measure over the workspace: x (n,), y (n,) in m and a masked array (..., n, n), rows along y.

    measure : "sigma_min", the smallest singular value of A~, 0 to 1, zero at input singularities, where (10) drops;
        "condition", the condition number of A in end-effector coordinates, 1 where the drives act alike in all
        directions, masked where it exceeds 1e12; "cross", the largest |d_j x d_k| of all pairs; "prestress", the
        largest share |n_i| of each drive in a unit prestress, A^T n = 0, on a leading axis of length N >= 3: for three
        arms the components of `null_vector`, else the lengths of the rows of `null_basis`.
    mode : working mode (..., N), e.g. ``working_modes(robot)`` for all at once; default ``robot.mode``.
    n, box : see `workspace_grid`.
    pair : two 0-based drives that alone are to act, for the first three measures; default all drives.  The zeros are
        then the parameterization singularities of the pair.
    Raises ValueError for an unknown measure, pair, mode or box, and for a prestress of two arms or of a pair.

    >>> import rapkm_lite as rk
    >>> x, y, sigma = rk.actuation_map(rk.load(), mode=rk.working_modes(rk.load()), n=20)
    >>> sigma.shape
    (8, 20, 20)
    """
    one_of("measure", measure, _MEASURES)
    N = manipulator(robot).n_arms
    if measure == "prestress" and pair is not None:
        raise ValueError(f"pair = {short(pair)} of measure = 'prestress'; allowed: None, all drives share a prestress")
    if measure == "prestress" and N < 3:
        raise ValueError(f"robot has {N} arms, which cannot prestress each other; allowed: 3 or more")
    drives = list(range(N) if pair is None else joint_indices("pair", pair, N, 2, "drive"))
    x, y, inside = workspace_grid(robot, n, box)
    values = _MEASURES[measure](robot, poses_inside(robot, x, y, inside, mode), drives)
    return x, y, _on_grid(np.ma.masked_greater_equal(np.minimum(values, 1e12), 1e12), inside)


def switching_map(robot: Manipulator, rule: str = "cross", mode=None, n: int = 200, box=None):
    """The best pair of drives as independent coordinates: x (n,), y (n,) in m and a masked integer array (..., n, n).

    Its entries index `drive_pairs`; `SwitchedCTC` switches on the lines between the regions (without hysteresis).

    rule : "cross" takes the largest |d_j x d_k|, as `SwitchedCTC` does; "sigma_min", "condition" and "printed" are the
        partition rules of `select_independent`.
    mode, n, box : see `actuation_map`.  Raises ValueError for another rule, mode or box; no error for points out of
        reach, which are masked, nor for two arms, whose one pair is always the best.

    >>> import numpy as np, rapkm_lite as rk
    >>> x, y, pair = rk.switching_map(rk.load(), n=20)
    >>> np.unique(pair.compressed())
    array([0, 1, 2])
    """
    one_of("rule", rule, ("cross", *PARTITION_RULES))
    x, y, inside = workspace_grid(robot, n, box)
    q = poses_inside(robot, x, y, inside, mode)
    if rule == "cross":
        merit = np.abs(distal_cross_products(robot, q))
    else:
        # A~ = Q_a Q^T with the columns of F made orthonormal in Q, without a decomposition of J.
        Q = np.linalg.qr(at(robot, q).F).Q
        A_tilde = Q[..., : robot.n_arms, :] @ Q.mT
        merit = np.stack([PARTITION_RULES[rule](A_tilde[..., list(pair), :]) for pair in drive_pairs(robot)], axis=-1)
    return x, y, _on_grid(first_best(merit), inside)


def poses_inside(robot: Manipulator, x: np.ndarray, y: np.ndarray, inside: np.ndarray, mode=None) -> np.ndarray:
    """Joint angles (..., points inside, 2N) on a `workspace_grid`."""
    mode = robot.mode if mode is None else real_array("mode", mode, robot.n_arms)
    return inverse_kinematics(robot, points_inside(x, y, inside), mode[..., None, :])


def points_inside(x: np.ndarray, y: np.ndarray, inside: np.ndarray) -> np.ndarray:
    """The points (k, 2) in m of a `workspace_grid` that lie inside."""
    return np.stack(np.meshgrid(x, y), axis=-1)[inside]


def _on_grid(values: np.ndarray, inside: np.ndarray) -> np.ma.MaskedArray:
    """Values (..., points inside) scattered to the grid; what lies outside is masked."""
    grid = np.ma.array(np.zeros(values.shape[:-1] + inside.shape, values.dtype), mask=True)
    grid[..., inside] = values
    return grid


def _condition(robot: Manipulator, q: np.ndarray, drives: list[int]) -> np.ndarray:
    sigma = singular_values(at(robot, q).F[..., drives, :])
    return sigma[..., 0] / np.maximum(sigma[..., 1], 1e-13 * sigma[..., 0])


def _cross(robot: Manipulator, q: np.ndarray, drives: list[int]) -> np.ndarray:
    chosen = [k for k, pair in enumerate(drive_pairs(robot)) if set(pair) <= set(drives)]
    return np.abs(distal_cross_products(robot, q)[..., chosen]).max(axis=-1)


_MEASURES = {
    # Of the rows of A~ = Q_a Q^T, with the columns of F made orthonormal in Q.
    "sigma_min": lambda robot, q, drives: singular_values(np.linalg.qr(at(robot, q).F).Q[..., drives, :])[..., 1],
    "condition": _condition,
    "cross": _cross,
    # At an input singularity every prestress is free: no direction, so the point is masked.
    "prestress": lambda robot, q, _: np.moveaxis(prestress_shares(at(robot, q).A), -1, 0),
}
