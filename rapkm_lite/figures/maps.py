"""Maps over the workspace, pairs of drives and the curves where their distal links are parallel."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib import patheffects

from ..machine.arguments import shaped, short
from ..machine.manipulator import Manipulator
from ..mechanics.actuation import control_matrix, distal_cross_products, drive_pairs, singular_values
from ..mechanics.kinematics import inverse_kinematics, reachable
from ..mechanics.maps import points_inside, workspace_grid
from .style import ARM_LINES, PAIR_COLOURS, arm_line, axes_or_new

_OUTLINED: list[patheffects.AbstractPathEffect] = [patheffects.withStroke(linewidth=2.6, foreground="#222222")]


def pair_name(pair) -> str:
    """The pair with 1-based drive numbers, as in the chapter: (1, 2) becomes '(2,3)'.

    >>> from rapkm_lite import plotting; plotting.pair_name((1, 2))
    '(2,3)'
    """
    return f"({pair[0] + 1},{pair[1] + 1})"


def mode_name(mode) -> str:
    """A working mode as signs, as in the lessons: [1, 1, -1] becomes '(+, +, −)'.

    >>> from rapkm_lite import plotting; plotting.mode_name([1, 1, -1])
    '(+, +, −)'
    """
    return "(" + ", ".join("+" if s > 0 else "−" for s in mode) + ")"


def pair_line(robot: Manipulator, pair) -> dict:
    """Colour and dashes of a pair: for three arms those of the arm left out, the one without prestress on its curve.

    On other machines no arm has its colour.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting; robot = rk.load()
    >>> plotting.pair_line(robot, (1, 2)) == plotting.arm_line(0)
    True
    """
    if robot.n_arms == 3:
        return arm_line(3 - sum(pair))
    k = drive_pairs(robot).index(pair)
    return {"color": PAIR_COLOURS[k % len(PAIR_COLOURS)], "linestyle": ARM_LINES[k % len(ARM_LINES)]}


def pair_measures(robot: Manipulator, q) -> np.ndarray:
    """Smallest singular value of the rows of A of each pair of drives, (..., pairs) in rad/m; q is (..., 2N).

    >>> import rapkm_lite as rk; from rapkm_lite import plotting
    >>> plotting.pair_measures(rk.load(), rk.inverse_kinematics(rk.load(), [0.0, 0.0])).round(3)
    array([3.75, 3.75, 3.75])
    """
    A = control_matrix(robot, q)
    return np.stack([singular_values(A[..., list(pair), :])[..., 1] for pair in drive_pairs(robot)], axis=-1)


def grid_points(robot: Manipulator, n: int, box=None, driven: bool = False):
    """Samples x (n,), y (n,) in m, inside (n, n), and the points (k, 2) in m of this grid that all arms reach bent.

    driven : leave out those at input singularities, where A has lost rank.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting
    >>> x, y, inside, points = plotting.grid_points(rk.load(), 50)
    >>> points.shape == (inside.sum(), 2)
    True
    """
    x, y, inside = workspace_grid(robot, n, box)
    points = points_inside(x, y, inside)
    if driven:
        sigma = singular_values(control_matrix(robot, inverse_kinematics(robot, points)))
        regular = sigma[:, 1] > 1e-9 * sigma[:, 0]
        inside[inside], points = regular, points[regular]
    return x, y, inside, points


def on_grid(inside: np.ndarray, values) -> np.ma.MaskedArray:
    """Values (k, ...) at the points of `grid_points` back on the grid, (n, n, ...); masked outside.

    >>> import numpy as np; from rapkm_lite import plotting
    >>> plotting.on_grid(np.array([[True, False], [True, True]]), [1.0, 2.0, 3.0]).tolist()
    [[1.0, None], [2.0, 3.0]]
    """
    values = np.asarray(values)
    if values.dtype.kind not in "biuf" or not np.all(np.isfinite(values)):
        raise ValueError(f"values = {short(values)}; allowed: finite numbers, one for each point inside")
    count = np.count_nonzero(inside)
    # NumPy would write a single value to all points.
    shaped("values", values, values.shape[:1] == (count,), f"({count}, ...), one row for each point inside")
    grid = np.ma.array(np.zeros((*inside.shape, *values.shape[1:])), mask=True)
    grid[inside] = values
    return grid


def plot_map(x, y, values, ax=None, *, label: str = "", vmin=None, vmax=None, bar: bool = True):
    """A measure over the workspace: x (n,), y (n,) in m, masked values (n, n), rows along y, colours vmin to vmax.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting
    >>> ax = plotting.plot_map(*rk.actuation_map(rk.load(), n=41), label="σ_min(Ã), all drives")
    """
    ax = axes_or_new(ax, figsize=(4.6, 3.9))
    # What lies under the mask may be anything; colour maps look at it.
    values = np.ma.array(np.ma.filled(values, 0.0), mask=np.ma.getmaskarray(values))
    mesh = ax.pcolormesh(x, y, values, cmap="cividis", vmin=vmin, vmax=vmax, shading="nearest", rasterized=True)
    ax.set(aspect="equal", xlabel="x in m", ylabel="y in m")
    ax.grid(False)
    if bar:
        beyond = vmin is not None and bool(values.min() < vmin), vmax is not None and bool(values.max() > vmax)
        extend = {(True, True): "both", (True, False): "min", (False, True): "max"}.get(beyond, "neither")
        ax.figure.colorbar(mesh, ax=ax, label=label, shrink=0.85, extend=extend)
    return ax


def plot_pair_curves(robot, ax=None, *, mode=None, pairs=None, on_map: bool = False, n: int = 300, **line):
    """Curves where the two distal links of a pair are parallel: its parameterization singularities.

    pairs : some of `drive_pairs`; default all.
    on_map : draw outlined white lines, readable on top of a map, instead of those of `pair_line`.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting
    >>> ax = plotting.plot_pair_curves(rk.load(), n=81)
    """
    ax = axes_or_new(ax, figsize=(4.2, 4.2))
    x, y, inside, points = grid_points(robot, n)
    cross = on_grid(inside, distal_cross_products(robot, inverse_kinematics(robot, points, mode)))
    for k, pair in enumerate(drive_pairs(robot)):
        if pairs is not None and pair not in pairs:
            continue
        look: dict[str, Any] = pair_line(robot, pair) | ({"color": "white"} if on_map else {}) | line
        style = {"colors": [look["color"]], "linestyles": [look["linestyle"]], "linewidths": look.get("linewidth", 1.6)}
        drawn = ax.contour(x, y, cross[..., k], levels=[0.0], zorder=3, **style)
        arc_look: dict[str, Any] = {"linewidth": 1.6, "zorder": 3} | look
        arcs = [ax.plot(*arc.T, **arc_look)[0] for arc in touching_arcs(robot, pair, mode)]
        if on_map:
            for curve in (drawn, *arcs):
                curve.set_path_effects(_OUTLINED)
        else:
            ax.plot([], [], **look, label=f"links {pair[0] + 1} and {pair[1] + 1} parallel")
    return ax


def touching_arcs(robot, pair, mode=None) -> list[np.ndarray]:
    """The part of a pair's curve that no change of sign gives away: arcs, each (k, 2) in m.

    Where the proximal links of two arms with equal distal links just reach each other, both elbows can stand in one
    point.  About it the end-effector runs on a circle on which the distal links are parallel, and the cross product of
    `distal_cross_products` keeps its sign on both sides.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting
    >>> [len(arc) for arc in plotting.touching_arcs(rk.load(), (1, 2), (1, 1, -1))]
    [179]
    """
    base, (l1, l2) = robot.base[list(pair)], robot.lengths[list(pair)].T
    between = base[1] - base[0]
    if not np.isclose(np.linalg.norm(between), l1.sum(), rtol=1e-9) or not np.isclose(*l2, rtol=1e-9):
        return []
    turn = np.linspace(0, 2 * np.pi, 361)
    middle, around = base[0] + l1[0] / l1.sum() * between, l2[0] * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    circle, k = middle + around, drive_pairs(robot).index(tuple(pair))
    on = reachable(robot, circle)
    on[on] = np.abs(distal_cross_products(robot, inverse_kinematics(robot, circle[on], mode))[:, k]) < 1e-6
    # In other modes the sign does change there, and the contour has drawn the circle already.
    inner, outer = middle + np.array([0.98, 1.02])[:, None, None] * around
    both = on & reachable(robot, inner) & reachable(robot, outer)
    sides = inverse_kinematics(robot, np.stack([inner, outer])[:, both], mode)
    if np.any(np.prod(distal_cross_products(robot, sides)[..., k], axis=0) < 0.0):
        return []
    return [circle[part] for part in np.ma.clump_unmasked(np.ma.array(turn, mask=~on)) if part.stop - part.start > 1]


def curve_crossings(trajectory) -> list[np.ndarray]:
    """For each pair of drives the samples just before the path crosses the curve of this pair.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting
    >>> [len(at) for at in plotting.curve_crossings(rk.triangle(rk.load()))]
    [2, 2, 2]
    """
    cross = distal_cross_products(trajectory.robot, trajectory.q)
    return [np.flatnonzero(np.diff(np.sign(c)) != 0) for c in cross.T]
