"""Figures of lesson 02: mode maps, parameterization singularities, prestress, weighted torques."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import Circle

from ...figures._shared import least_torque, no_finer, scaled_frame
from ...figures.film import film
from ...figures.machine import arm_points, plot_machine, plot_path, plot_workspace
from ...figures.maps import (
    curve_crossings,
    grid_points,
    mode_name,
    on_grid,
    pair_line,
    pair_measures,
    pair_name,
    plot_map,
    plot_pair_curves,
)
from ...figures.style import ALARM, NEUTRAL, arm_line, arm_text_colour, axes_or_new
from ...machine.arguments import exact_array
from ...mechanics.actuation import control_matrix, distal_cross_products, drive_pairs, force_polygon, singular_values
from ...mechanics.kinematics import arm_vectors, inverse_kinematics, working_modes
from ..own import draw_own


def plot_mode_maps(robot, sigma, x, y, axes=None, marks=None):
    """Maps sigma (2^N, n, n) of the visible share σ_min(Ã) for all working modes, with the curves of all pairs on top.

    x, y : samples (n,) in m.  marks : a point (2,) in m to mark, or None, for each mode.

    >>> import rapkm_lite as rk; import numpy as np; from rapkm_lite import plotting; x = np.linspace(-0.1, 0.1, 5)
    >>> ax = plotting.plot_mode_maps(rk.load(), np.ones((8, 5, 5)), x, x)
    """
    modes, rows = working_modes(robot), 2**robot.n_arms // 4
    axes = plt.subplots(rows, 4, figsize=(10.4, 2.7 * rows), sharex=True, sharey=True)[1] if axes is None else axes
    for k, (ax, mode) in enumerate(zip(np.ravel(axes), modes, strict=True)):
        plot_map(x, y, sigma[k], ax, vmin=0.0, vmax=sigma.max(), bar=False)
        plot_pair_curves(robot, ax, mode=mode, on_map=True, linewidth=1.0)
        if marks is not None and marks[k] is not None:
            ax.plot(*marks[k], "o", mfc="none", mec=ALARM, mew=2.2, ms=14, zorder=5)
        ax.set_title(mode_name(mode))
        ax.label_outer()
    mesh = np.ravel(axes)[0].collections[0]
    np.ravel(axes)[0].figure.colorbar(mesh, ax=axes, label="visible share β, all drives", shrink=0.8)
    return axes


def plot_parameterization_singularities(trajectory, x, pair=(1, 2), axes=None):
    """A pose as in fig. 8: the five-bar of one pair, distal links parallel at x (2,) in m; the curves of all pairs.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting; path = rk.triangle(rk.load())
    >>> ax = plotting.plot_parameterization_singularities(path, [0.094, 0.064])
    """
    robot = trajectory.robot
    axes = plt.subplots(1, 2, figsize=(10.8, 4.2))[1] if axes is None else axes
    q = inverse_kinematics(robot, x)
    plot_workspace(robot, axes[0])
    plot_pair_curves(robot, axes[0], pairs=[pair])
    plot_machine(robot, q, axes[0], arms=pair, labels=False)
    for i in pair:
        place = {"xytext": (10, 10 * np.sign(robot.base[i, 1])), "textcoords": "offset points", "va": "center"}
        look = {"color": arm_text_colour(i), "fontweight": "bold", "fontsize": 9}
        axes[0].annotate(f"drive {i + 1}", robot.base[i], **place, **look)
    axes[0].axline(x, np.add(x, arm_vectors(robot, q)[1][pair[0]]), color=ALARM, lw=1.0, ls=":", zorder=2)
    plot_workspace(robot, axes[1])
    plot_path(trajectory, axes[1])
    plot_pair_curves(robot, axes[1])
    for other, at in zip(drive_pairs(robot), curve_crossings(trajectory), strict=True):
        look = {"mfc": "white", "mec": pair_line(robot, other)["color"], "mew": 1.8, "ms": 7, "ls": "", "zorder": 5}
        axes[1].plot(*trajectory.x[at].T, "o", **look)
    axes[0].set(**scaled_frame(robot, -0.32, 0.32, -0.25, 0.36, drives=True))
    axes[0].set_title(f"five-bar of the pair {pair_name(pair)}")
    axes[1].set_title("all pairs and the path")
    axes[1].set(**scaled_frame(robot, -0.24, 0.24, -0.2, 0.26))
    axes[1].legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return axes


def plot_prestress_maps(robot, axes=None, n: int = 161):
    """Share |eta_i| of each of three drives in the null vector of A^T, by singular vectors, and the pairs' curves.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting; ax = plotting.plot_prestress_maps(rk.load(), n=21)
    """
    if robot.n_arms != 3:
        raise ValueError(f"robot has {robot.n_arms} arms; allowed: 3, whose torques that move nothing are one vector")
    axes = plt.subplots(1, 3, figsize=(10.4, 3.5), sharey=True)[1] if axes is None else axes
    x, y, inside, points = grid_points(robot, n)
    A = control_matrix(robot, inverse_kinematics(robot, points))
    share = on_grid(inside, np.abs(np.linalg.svd(np.swapaxes(A, -1, -2))[2][:, 2]))
    for i, ax in zip(range(3), axes, strict=True):
        plot_map(x, y, share[..., i], ax, vmin=0.0, vmax=1.0, bar=False)
        pair = drive_pairs(robot)[2 - i]
        plot_pair_curves(robot, ax, pairs=[pair], on_map=True)
        ax.set_title(f"drive {i + 1};  line: pair {pair_name(pair)}")
        ax.label_outer()
    axes[0].figure.colorbar(axes[0].collections[0], ax=axes, label=r"share $|\eta_i|$ of the prestress", shrink=0.85)
    return axes


def plot_available_forces(robot, q, ax=None, *, torque: float = 0.1, guaranteed=None, drives=True):
    """Forces at the end-effector that torques up to `torque` N m can produce at one pose q; `drives`: each one's, too.

    guaranteed : radius in N of a disc to draw, the force that is available in every direction.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting; robot = rk.load()
    >>> ax = plotting.plot_available_forces(robot, rk.inverse_kinematics(robot, [0.02, 0.05]), torque=0.1)
    """
    ax = axes_or_new(ax, figsize=(3.6, 3.6))
    A = control_matrix(robot, exact_array("q", q, robot.n_joints))
    corners = force_polygon(A, torque)
    ax.fill(*corners.T, color="#DCE3EA", zorder=1)
    ax.plot(*np.vstack([corners, corners[:1]]).T, color=NEUTRAL, lw=1.4, zorder=2)
    for i in range(robot.n_arms) if drives else ():
        ax.plot(*np.outer([-torque, torque], A[i]).T, **arm_line(i), zorder=3, label=f"drive {i + 1}")
    if guaranteed is not None:
        ax.add_patch(Circle((0, 0), guaranteed, fill=False, color=ALARM, lw=1.6, zorder=4))
    room = 1.12 * np.abs(corners).max()
    ax.set(aspect="equal", xlabel="force in x in N", ylabel="force in y in N", xlim=(-room, room), ylim=(-room, room))
    return ax


def plot_modes_and_forces(robot, x, modes, axes=None):
    """The machine at one place x (2,) in m in several working modes, each beside its available forces.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting
    >>> ax = plotting.plot_modes_and_forces(rk.load(), [0.0, 0.0], [(1, 1, 1), (1, 1, -1)])
    """
    if axes is None:
        widths = [1.1, 1.0] * len(modes)
        axes = plt.subplots(1, 2 * len(modes), figsize=(6.3 * len(modes), 3.1), width_ratios=widths)[1]
    poses = [inverse_kinematics(robot, x, mode) for mode in modes]
    size = 1.12 * max(np.abs(force_polygon(control_matrix(robot, q), 0.1)).max() for q in poses)
    corners = np.concatenate([arm_points(robot, q).reshape(-1, 2) for q in poses])
    room = 0.25 * robot.lengths.max()
    low_high = np.array([corners.min(axis=0) - room, corners.max(axis=0) + room])
    for q, mode, (left, right) in zip(poses, modes, np.reshape(axes, (-1, 2)), strict=True):
        plot_machine(robot, q, left, labels=False)
        plot_available_forces(robot, q, right)
        left.set(title=f"mode {mode_name(np.asarray(mode))}", xlim=low_high[:, 0], ylim=low_high[:, 1])
        right.set(title="available force", xlim=(-size, size), ylim=(-size, size))
    axes[0].figure.legend(*axes[1].get_legend_handles_labels(), loc="outside right center")
    return axes


def plot_guaranteed_force(robot, poses: dict, radius_of, axes=None, torque: float = 0.1, n: int = 90):
    """Available forces with the disc of the guaranteed force at some poses (title -> q), and a map of its radius.

    radius_of : function of A (m, 2) and the torque limit in N m that gives the radius in N.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting; robot = rk.load()
    >>> ax = plotting.plot_guaranteed_force(robot, {"": rk.inverse_kinematics(robot, [0, 0])}, lambda A, c: 0.5, n=9)
    """
    if axes is None:
        count = len(poses) + 1
        axes = plt.subplots(1, count, figsize=(3.8 * count, 3.3), width_ratios=[1.0] * len(poses) + [1.3])[1]
    for ax, (title, q) in zip(axes[:-1], poses.items(), strict=True):
        radius = float(radius_of(control_matrix(robot, q), torque))
        plot_available_forces(robot, q, ax, torque=torque, guaranteed=radius).set_title(title)
        around, A = np.linspace(0.0, 2 * np.pi, 181), control_matrix(robot, q)
        circle = np.stack([np.cos(around), np.sin(around)])
        draw_own("02.guaranteed_force", lambda f, A=A, circle=circle: f(A, torque) * circle, ax)
    x, y, inside, points = grid_points(robot, n)
    A = control_matrix(robot, inverse_kinematics(robot, points))
    force, most = on_grid(inside, [float(radius_of(A_k, torque)) for A_k in A]), 2.4 * torque / robot.lengths.max()
    plot_map(x, y, force, axes[-1], label="guaranteed force in N", vmin=0, vmax=most).set_title("whole workspace")
    return axes


def plot_crossed_linkage(robot, pair=(1, 2), ax=None):
    """Two parallel distal links as one rod between two cranks, for several tilts, and the curve of the rod's middle.

    For two arms whose four links are equal and half as long as the base between them, as on the testbed.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting; ax = plotting.plot_crossed_linkage(rk.load(), (0, 1))
    """
    base, length = robot.base[list(pair)], robot.lengths[pair[0], 0]
    if not np.allclose([*robot.lengths[list(pair)].flat, np.linalg.norm(base[1] - base[0]) / 2], length):
        raise ValueError(f"pair = {tuple(pair)} of this robot; allowed: four equal links, half as long as their base")
    ax = axes_or_new(ax, figsize=(5.6, 4.6))
    middle, along = base.mean(axis=0), (base[1] - base[0]) / np.linalg.norm(base[1] - base[0])
    frame = np.stack([along, [-along[1], along[0]]])

    def centre(theta):
        w = np.sqrt(np.maximum(length**2 - 4 * length**2 * np.sin(theta) ** 2, 0.0))
        return w[..., None] * np.stack([np.cos(theta), np.sin(theta)], axis=-1) @ frame

    around, tilts = np.deg2rad(np.linspace(-30.0, 30.0, 241)), np.deg2rad([6.0, 15.0, 25.0])
    for half, width in ((around >= 0, 3.0), (around <= 0, 1.2)):
        for sign in (1.0, -1.0):
            x, y = (middle + sign * centre(around[half])).T
            ax.plot(x, y, color=pair_line(robot, pair)["color"], lw=width)
    for i, end in zip(pair, base, strict=True):
        ax.add_patch(Circle(tuple(end), length, fill=False, color=arm_line(i)["color"], lw=0.9, ls=":"))
        ax.plot(*end, "o", color=arm_line(i)["color"], ms=10, zorder=4)
        place = end + 0.5 * length * (frame[0] * np.sign((end - middle) @ frame[0]) - 0.6 * frame[1])
        ax.annotate(f"drive {i + 1}", place, color=arm_text_colour(i), ha="center", va="center", weight="bold")
    for theta in tilts:
        ends = middle + centre(theta) + [[-length], [length]] * np.array([np.cos(2 * theta), np.sin(2 * theta)]) @ frame
        ax.plot(*ends.T, color=NEUTRAL, lw=2.0, zorder=3)
        ax.plot(*ends.mean(axis=0), "o", color=ALARM, ms=6, zorder=5)
        for i, (start, end) in zip(pair, zip(base, ends, strict=True), strict=True):
            ax.plot(*np.stack([start, end]).T, color=arm_line(i)["color"], lw=1.6, alpha=0.6, zorder=2)
    ax.plot(*base.T, color=NEUTRAL, lw=1.0, ls="--", zorder=1)
    ax.set(aspect="equal", xlabel="x in m", ylabel="y in m", title="straight rod between two cranks")
    return ax


def plot_pair_measures(trajectory, ax=None):
    """sigma_min in rad/m of the rows of A of every pair (lines of `pair_line`), and of all drives, along the path.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting
    >>> ax = plotting.plot_pair_measures(rk.triangle(rk.load(), dt=5e-3))
    """
    ax = axes_or_new(ax, figsize=(8.4, 3.4))
    robot, A = trajectory.robot, control_matrix(trajectory.robot, trajectory.q)
    for pair, sigma in zip(drive_pairs(robot), pair_measures(robot, trajectory.q).T, strict=True):
        ax.semilogy(trajectory.t, sigma, label=f"pair {pair_name(pair)}", **pair_line(robot, pair))
    ax.semilogy(trajectory.t, singular_values(A)[:, 1], color="black", lw=2.2, label="all drives")
    ax.set(xlabel="time in s", xlim=(0, trajectory.t[-1]))
    ax.set_ylim(2e-3 / robot.lengths.max(), max(2.0 / robot.lengths.max(), 1.2 * singular_values(A)[:, 1].max()))
    ax.set_ylabel(r"$\sigma_\mathrm{min}(A)$, $\sigma_\mathrm{min}(A_{jk})$ in rad/m")
    ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=min(len(ax.lines), 5))
    return ax


def plot_torque_choices(trajectory, choices: dict, axes=None):
    """Drive torques in mN m along a path, one panel per choice; `choices` maps a title to (k, m) torques in N m.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting; path = rk.triangle(rk.load(), dt=5e-3)
    >>> ax = plotting.plot_torque_choices(path, {"drives off": 0.0 * path.q_a})
    """
    if axes is None:
        axes = plt.subplots(1, len(choices), figsize=(12.0, 3.1), sharey=True, squeeze=False)[1][0]
    for ax, (title, torques) in zip(axes, choices.items(), strict=True):
        for i, torque in enumerate(1e3 * np.asarray(torques).T):
            ax.plot(trajectory.t, torque, label=f"drive {i + 1}", **arm_line(i))
        ax.set(title=title, xlabel="time in s", ylabel="torque in mN m", xlim=(trajectory.t[0], trajectory.t[-1]))
        no_finer(ax, 1e3 * least_torque(trajectory.robot))
        ax.label_outer()
    axes[0].legend(loc="upper right")
    return axes


def film_force_polygon(robot, x, pair=(1, 2), frames: int = 36):
    """The machine crossing the curve of a pair at x (2,) in m, beside the forces of the pair and of all drives.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting
    >>> plotting.film_force_polygon(rk.load(), [0.094, 0.064], frames=3).size
    (691, 336)
    """
    x, k, step = np.asarray(x, dtype=float), drive_pairs(robot).index(pair), 1e-5
    beside = distal_cross_products(robot, inverse_kinematics(robot, x + step * np.eye(2)))[:, k]
    across = beside / np.linalg.norm(beside)
    # There and back, to end where nothing is left of the pair's polygon.
    way = np.concatenate([np.linspace(-1, 1, 2 * frames // 3), np.linspace(1, 0, frames // 3)])
    places = x + 0.04 * way[:, None] * across
    place = control_matrix(robot, inverse_kinematics(robot, np.array([places[0], x])))
    size = 1.15 * max(np.abs(force_polygon(A, 0.1)).max() for A in place)

    def draw(axes, place):
        q = inverse_kinematics(robot, place)
        plot_pair_curves(robot, axes[0], pairs=[pair], n=80)
        plot_machine(robot, q, axes[0], labels=False)
        A = control_matrix(robot, q)
        axes[1].fill(*force_polygon(A, 0.1).T, color="#DCE3EA", zorder=1)
        outline = force_polygon(A[list(pair)], 0.1)
        axes[1].plot(*np.vstack([outline, outline[:1]]).T, color=pair_line(robot, pair)["color"], lw=2.2, zorder=3)
        axes[0].set(title="machine and curve", xlabel="x in m", ylabel="y in m")
        axes[1].set(xlim=(-size, size), ylim=(-size, size), aspect="equal", xlabel="force in x in N")
        axes[1].set(ylabel="force in y in N", title=f"forces of {pair_name(pair)}; shaded: all")

    alt = (
        "Film: the end-effector crosses the curve on which the distal links of two drives are parallel. The "
        "parallelogram of their forces thins to a line and opens again beyond it; the polygon of all drives stays wide."
    )
    return film(draw, places, alt, panels=2, figsize=(7.2, 3.5), seconds=6.0)
