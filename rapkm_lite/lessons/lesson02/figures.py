"""Figures of lesson 02: mode maps, parameterization singularities, prestress, weighted torques."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import Circle

from ...figures.machine import plot_machine, plot_path, plot_workspace
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
from ...figures.style import ALARM, NEUTRAL, arm_line, axes_or_new
from ...mechanics.actuation import (
    control_matrix,
    drive_pairs,
    force_polygon,
    singular_values,
)
from ...mechanics.kinematics import arm_vectors, inverse_kinematics, working_modes


def plot_mode_maps(robot, sigma, x, y, axes=None, marks=None):
    """Maps sigma (2^N, n, n) of an actuation measure for all working modes, with the curves of all pairs on top.

    x, y : samples (n,) in m.  marks : a point (2,) in m to mark, or None, for each mode.
    """
    modes = working_modes(robot)
    if axes is None:
        axes = plt.subplots(len(modes) // 4, 4, figsize=(10.4, 5.4), sharex=True, sharey=True)[1]
    for k, (ax, mode) in enumerate(zip(np.ravel(axes), modes, strict=True)):
        plot_map(x, y, sigma[k], ax, vmin=0.0, vmax=sigma.max(), bar=False)
        plot_pair_curves(robot, ax, mode=mode, on_map=True, linewidth=1.0)
        if marks is not None and marks[k] is not None:
            ax.plot(*marks[k], "o", mfc="none", mec=ALARM, mew=2.2, ms=14, zorder=5)
        ax.set_title(mode_name(mode))
        ax.label_outer()
    mesh = np.ravel(axes)[0].collections[0]
    np.ravel(axes)[0].figure.colorbar(mesh, ax=axes, label="σ_min(Ã), all drives", shrink=0.8)
    return axes


def plot_parameterization_singularities(trajectory, x, pair=(1, 2), axes=None):
    """A pose as in fig. 8: the five-bar of one pair, distal links parallel at x (2,) in m; the curves of all pairs."""
    robot = trajectory.robot
    if axes is None:
        axes = plt.subplots(1, 2, figsize=(10.8, 4.2))[1]
    q = inverse_kinematics(robot, x)
    plot_workspace(robot, axes[0])
    plot_pair_curves(robot, axes[0], pairs=[pair])
    plot_machine(robot, q, axes[0], arms=pair, labels=False)
    for i in pair:
        axes[0].annotate(
            f"drive {i + 1}",
            robot.base[i],
            xytext=(10, 10 * np.sign(robot.base[i, 1])),
            va="center",
            textcoords="offset points",
            color=arm_line(i)["color"],
            fontweight="bold",
            fontsize=9,
        )
    _, d = arm_vectors(robot, q)
    axes[0].axline(x, np.add(x, d[pair[0]]), color=ALARM, lw=1.0, ls=":", zorder=2)
    plot_workspace(robot, axes[1])
    plot_path(trajectory, axes[1])
    plot_pair_curves(robot, axes[1])
    for k, left_out in ((k, pair_line(robot, p)) for k, p in enumerate(drive_pairs(robot))):
        at = curve_crossings(trajectory)[k]
        axes[1].plot(*trajectory.x[at].T, "o", mfc="white", mec=left_out["color"], mew=1.8, ms=7, ls="", zorder=5)
    axes[0].set(xlim=(-0.32, 0.32), ylim=(-0.25, 0.36))
    axes[0].set_title(f"five-bar of the pair {pair_name(pair)}")
    axes[1].set_title("all three pairs and the path")
    axes[1].set(xlim=(-0.24, 0.24), ylim=(-0.2, 0.26))
    axes[1].legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return axes


def plot_prestress_maps(robot, axes=None, n: int = 161):
    """Share |eta_i| of each drive in the null vector of A^T, from singular vectors, under the curves of the pairs."""
    if axes is None:
        axes = plt.subplots(1, 3, figsize=(10.4, 3.5), sharey=True)[1]
    x, y, inside, points = grid_points(robot, n)
    A = control_matrix(robot, inverse_kinematics(robot, points))
    share = on_grid(inside, np.abs(np.linalg.svd(np.swapaxes(A, -1, -2))[2][:, 2]))
    for i, ax in enumerate(axes):
        plot_map(x, y, share[..., i], ax, vmin=0.0, vmax=1.0, bar=False)
        pair = drive_pairs(robot)[2 - i]
        plot_pair_curves(robot, ax, pairs=[pair], on_map=True)
        ax.set_title(f"drive {i + 1};  line: pair {pair_name(pair)}")
        ax.label_outer()
    axes[0].figure.colorbar(axes[0].collections[0], ax=axes, label="share |η_i| of the prestress", shrink=0.85)
    return axes


def plot_available_forces(robot, q, ax=None, *, torque: float = 0.1, guaranteed=None, drives=True):
    """Forces at the end-effector that torques up to `torque` N m can produce at one pose q, and each drive's own share.

    guaranteed : radius in N of a disc to draw, the force that is available in every direction.
    """
    ax = axes_or_new(ax, figsize=(3.6, 3.6))
    A = control_matrix(robot, q)
    corners = force_polygon(A, torque)
    ax.fill(*corners.T, color="#DCE3EA", zorder=1)
    ax.plot(*np.vstack([corners, corners[:1]]).T, color=NEUTRAL, lw=1.4, zorder=2)
    for i in range(robot.n_arms) if drives else ():
        ax.plot(*np.outer([-torque, torque], A[i]).T, **arm_line(i), zorder=3, label=f"drive {i + 1}")
    if guaranteed is not None:
        ax.add_patch(Circle((0, 0), guaranteed, fill=False, color=ALARM, lw=1.6, ls="--", zorder=4))
    room = 1.12 * np.abs(corners).max()
    ax.set(aspect="equal", xlabel="force in x in N", ylabel="force in y in N", xlim=(-room, room), ylim=(-room, room))
    return ax


def plot_pair_measures(trajectory, ax=None):
    """sigma_min in rad/m of the rows of A of every pair (lines of `pair_line`), and of all drives, along the path."""
    ax = axes_or_new(ax, figsize=(8.4, 3.4))
    robot, A = trajectory.robot, control_matrix(trajectory.robot, trajectory.q)
    for pair, sigma in zip(drive_pairs(robot), pair_measures(robot, trajectory.q).T, strict=True):
        ax.semilogy(trajectory.t, sigma, label=f"pair {pair_name(pair)}", **pair_line(robot, pair))
    ax.semilogy(trajectory.t, singular_values(A)[:, 1], color="black", lw=2.2, label="all drives")
    ax.set(xlabel="time in s", ylabel="σ_min(A), σ_min(A_jk) in rad/m", xlim=(0, trajectory.t[-1]), ylim=(1e-2, 10))
    ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=len(ax.lines))
    return ax


def plot_torque_choices(trajectory, choices: dict, axes=None):
    """Drive torques in mN m along a path, one panel per choice; `choices` maps a title to (k, m) torques in N m.

    >>> import rapkm_lite as rk
    >>> path = rk.triangle(rk.load(), dt=5e-3)
    >>> ax = plot_torque_choices(path, {"least torque": rk.inverse_dynamics(path.robot, path.q, path.qd, path.qdd)})
    """
    if axes is None:
        axes = plt.subplots(1, len(choices), figsize=(12.0, 3.1), sharey=True, squeeze=False)[1][0]
    for ax, (title, torques) in zip(axes, choices.items(), strict=True):
        for i, torque in enumerate(1e3 * np.asarray(torques).T):
            ax.plot(trajectory.t, torque, label=f"drive {i + 1}", **arm_line(i))
        ax.set(title=title, xlabel="time in s", ylabel="torque in mN m", xlim=(trajectory.t[0], trajectory.t[-1]))
        ax.label_outer()
    axes[0].legend(loc="upper right")
    return axes
