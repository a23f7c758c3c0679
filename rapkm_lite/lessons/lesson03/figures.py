"""Steady state under PD control with offsets: disagreeing drives, rest torques, gains, logs."""

from __future__ import annotations

from typing import Any

import matplotlib.pyplot as plt
import numpy as np

from ...figures._shared import LEAST, no_finer, with_looks
from ...figures.film import film
from ...figures.machine import plane_axes, plot_path
from ...figures.maps import grid_points, on_grid, plot_map
from ...figures.runs import plot_torques
from ...figures.style import AFTER, ALARM, NEUTRAL, arm_colour, arm_line, axes_or_new
from ...mechanics.actuation import control_matrix, required_wrench
from ...mechanics.antagonism import null_vector, steady_state_error, steady_state_torque
from ...mechanics.kinematics import cross, inverse_kinematics


def plot_disagreement(robot, q, offset, K_P, ax=None, title: str = ""):
    """Where each drive wants the end-effector, and where it comes to rest, in mm about the desired point.

    A line per drive: the points where its measured angle would be right.  Thick bars: how far the rest point misses
    each line, with the torque that this costs.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting
    >>> robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> ax = plotting.plot_disagreement(robot, q, [4e-3, -2e-3, 5e-3], 7.05)
    """
    ax = axes_or_new(ax, figsize=(4.6, 4.4))
    still = np.zeros(robot.n_joints)
    A, weight, offset = control_matrix(robot, q), required_wrench(robot, q, still, still), np.asarray(offset, float)
    rest = 1e3 * np.linalg.lstsq(A, steady_state_error(A, K_P, offset, weight), rcond=None)[0]
    torque = 1e3 * steady_state_torque(A, K_P, offset, weight)
    size = np.linalg.norm(A, axis=1)
    normal, level = A / size[:, None], -1e3 * offset / size
    # Lines that are nearly parallel meet far away, or nowhere.
    pairs = [(j, k) for j in range(len(A)) for k in range(j) if abs(cross(normal[j], normal[k])) > 0.3]
    corners = [np.linalg.solve(normal[[j, k]], level[[j, k]]) for j, k in pairs]
    corners = np.array([*corners, [0.0, 0.0], rest])
    digits = "z.1f" if 0.1 < np.abs(torque).max() < 1e5 else ".3g"
    centre, half = (corners.min(axis=0) + corners.max(axis=0)) / 2, 0.72 * np.ptp(corners, axis=0).max() + 1e-3
    for i in range(len(A)):
        along = np.array([-normal[i, 1], normal[i, 0]])
        foot = centre + (level[i] - normal[i] @ centre) * normal[i]
        label = f"drive {i + 1}: {torque[i]:{digits}} mN m".replace("-", "−")
        ax.plot(*(foot + np.outer([-4 * half, 4 * half], along)).T, label=label, **arm_line(i))
        target = rest + (level[i] - normal[i] @ rest) * normal[i]
        ax.plot(*np.stack([rest, target]).T, color=arm_colour(i), lw=5, alpha=0.55, solid_capstyle="butt", zorder=3)
    ax.plot(0, 0, "+", color=NEUTRAL, ms=13, mew=2, zorder=5)
    ax.plot(*rest, "s", mfc="white", mec=NEUTRAL, mew=1.8, ms=8, zorder=6)
    ax.set(xlabel="x − desired x in mm", ylabel="y − desired y in mm", title=title, aspect="equal")
    ax.set(xlim=centre[0] + half * np.array([-1, 1]), ylim=centre[1] + half * np.array([-1, 1]))
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=1 if len(A) < 4 else 2)
    return ax


def plot_rest_torques(run, theory, ax=None, title: str = ""):
    """Drive torques over time in mN m; in black the static theory in N m, (N,) as thin lines or (k, N) as dots.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting; path = rk.circle(rk.load(), 0.05, 0.5)
    >>> ax = plotting.plot_rest_torques(rk.simulate(path.robot, rk.PD(7.05, 0.225), path), [0.0, 0.01, 0.0])
    """
    ax = plot_torques(run, ax, title)
    dots: dict[str, Any] = {"ls": "", "marker": ".", "ms": 5, "markevery": max(len(run.t) // 40, 1)}
    look: dict[str, Any] = dots if np.ndim(theory) == 2 else {"lw": 0.9}
    for values in 1e3 * np.broadcast_to(theory, run.c.shape).T:
        ax.plot(run.t, values, color=AFTER, zorder=4, **look)
    return ax


def plot_gain_ratio(ratio, simulated, theories: dict, ax=None, title: str = ""):
    """Rest torque in mN m against a ratio of gains: dots for runs, a line for each theory (label -> values in N m).

    Raises ValueError for more than two theories.

    >>> from rapkm_lite import plotting
    >>> ax = plotting.plot_gain_ratio([0.5, 1.0], [0.03, 0.05], {"printed": [0.04, 0.04], "corrected": [0.03, 0.05]})
    """
    ax = axes_or_new(ax)
    looks: list[dict[str, Any]] = [{"color": ALARM, "linestyle": "--"}, {"color": AFTER}]
    for (label, values), look in with_looks("theories", theories, looks):
        ax.plot(ratio, 1e3 * np.asarray(values), label=label, **look)
    ax.plot(ratio, 1e3 * np.asarray(simulated), "o", mfc="white", mec=AFTER, mew=1.5, label="simulated")
    ax.set(xscale="log", xlabel="gain of drive 3 / gain of drives 1 and 2", ylabel="largest rest torque in mN m")
    ax.set_xticks([0.1, 0.3, 1, 3, 10], ["0.1", "0.3", "1", "3", "10"])
    ax.set_xticks([], minor=True)
    ax.set_title(title)
    ax.legend()
    return ax


def plot_fight_map(robot, offset, K_P, ax=None, trajectory=None, n: int = 241, title: str = ""):
    """Norm of the rest torques over the workspace, with the lines on which these offsets cause no fight at all.

    trajectory : a path to draw; default none.  For three arms.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting
    >>> ax = plotting.plot_fight_map(rk.load(), [4e-3, -2e-3, 5e-3], 7.05, n=21)
    """
    ax = axes_or_new(ax, figsize=(5.2, 4.4))
    x, y, inside, points = grid_points(robot, n, driven=True)
    q = inverse_kinematics(robot, points)
    weight = required_wrench(robot, q, 0 * q, 0 * q)
    torque = 1e3 * np.linalg.norm(steady_state_torque(control_matrix(robot, q), K_P, offset, weight), axis=-1)
    plot_map(x, y, on_grid(inside, torque), ax, vmin=0.0, label="norm of the rest torques in mN m")
    signed = on_grid(inside, null_vector(robot, q) @ np.asarray(offset, dtype=float))
    ax.contour(x, y, signed, levels=[0.0], colors="white", linewidths=1.6)
    if trajectory is not None:
        plot_path(trajectory, ax, color="white", ls="--")
    plane_axes(robot, ax)
    ax.set(xlim=x[[0, -1]], ylim=y[[0, -1]], title=title)
    return ax


def plot_log(log, axes=None):
    """A log: measured minus desired angles above, drive torques in mN m below, over time; returns both axes.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting
    >>> ax = plotting.plot_log(rk.mystery_run("gain"))
    """
    axes = plt.figure(figsize=(8.0, 4.4), layout="constrained").subplots(2, sharex=True) if axes is None else axes
    for i in range(log.c.shape[1]):
        axes[0].plot(log.t, 1e3 * log.error[:, i], label=f"drive {i + 1}", **arm_line(i))
        axes[1].plot(log.t, 1e3 * log.c[:, i], **arm_line(i))
    axes[0].set(ylabel="measured − desired\nangle in mrad", xlim=log.t[[0, -1]])
    axes[1].set(xlabel="time in s", ylabel="torque in mN m")
    no_finer(axes[0], LEAST)
    no_finer(axes[1], 1e-9)  # in mN m, of any machine: a log does not know its own
    N = log.c.shape[1]
    axes[0].legend(ncols=-(-N // -(-N // 6)), loc="lower right", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.0)
    return axes


def film_three_lines(robot, q, offset, K_P, frames: int = 32):
    """The opinions of the drives while the normal part of the offsets fades: the lines close on the rest point.

    For three arms.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting
    >>> robot = rk.load(); q = rk.inverse_kinematics(robot, [0.04, -0.05])
    >>> plotting.film_three_lines(robot, q, [4e-3, -2e-3, 5e-3], 7.05, frames=3).size
    (403, 480)
    """
    n = null_vector(robot, q)
    normal = n * (n @ np.asarray(offset, dtype=float))
    frame: list = []

    def draw(ax, share):
        plot_disagreement(robot, q, offset - (1.0 - share) * normal, K_P, ax)
        if not frame:
            frame.extend([ax.get_xlim(), ax.get_ylim()])
        ax.set(xlim=frame[0], ylim=frame[1], title=f"{100 * share:3.0f} % of the normal part")

    alt = (
        "Film: the lines of the three drives about the desired point. While the normal part of the offsets fades, the "
        "triangle between the lines closes on the rest point, which stays, and the three torques go to zero."
    )
    return film(draw, np.linspace(1.0, 0.0, frames), alt, figsize=(4.2, 5.0), seconds=5.0)
