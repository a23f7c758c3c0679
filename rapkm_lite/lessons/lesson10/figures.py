"""Figures of lesson 10: fights of a wrong geometry, what a filter lets pass, hunting, faults."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import BoundaryNorm

from ...figures._shared import with_looks
from ...figures.machine import plane_axes
from ...figures.maps import grid_points, on_grid, plot_map
from ...figures.style import AFTER, ALARM, BEFORE, NEUTRAL, axes_or_new
from ...machine.arguments import positive_number
from ...mechanics.closure import estimate_pose
from ...mechanics.kinematics import inverse_kinematics, wrap


def plot_geometry_maps(robot, models: dict, K_P, axes=None, n: int = 101):
    """Norm of the rest torques of PD drives over the workspace, without weight, one map for each wrong model.

    models : dict of title -> Manipulator, which demands the angles.  K_P : one gain of all drives in N m/rad.
    Returns the axes.  Raises ValueError where a wrong model leads to an input singularity, as with two arms.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting; robot = rk.load()
    >>> ax = plotting.plot_geometry_maps(robot, {"longer": robot.replace(lengths=0.2002)}, 7.05, n=21)
    """
    K_P = positive_number("K_P", K_P)
    axes = plt.subplots(1, len(models), figsize=(4.8 * len(models), 3.9))[1] if axes is None else axes
    for ax, (title, model) in zip(np.atleast_1d(axes), models.items(), strict=True):
        x, y, inside, points = grid_points(robot, n)
        # A little inside, where model and machine both reach.
        q = inverse_kinematics(robot, points)
        keep = np.abs(np.sin(q[:, robot.n_arms :])).min(axis=-1) > 0.25
        inside[inside] = keep
        wanted = inverse_kinematics(model, points[keep])[:, : robot.n_arms]
        rest = estimate_pose(robot, wanted, points[keep])[:, : robot.n_arms]
        fight = 1e3 * K_P * np.linalg.norm(wrap(wanted - rest), axis=-1)
        plot_map(x, y, on_grid(inside, fight), ax, vmin=0.0, label="norm of the rest torques in mN m")
        plane_axes(robot, ax)
        ax.set(xlim=x[[0, -1]], ylim=y[[0, -1]], title=title)
    return axes


def plot_model_share(eps, share, t, leak, axes=None):
    """Left, the share (k,) of torques that fights in spite of the filter over the model's relative error eps (k,).

    Right, the force leak (j,) in N per N m at the end-effector of a prestress along a path, over time t (j,) in s.
    Returns both axes.

    >>> from rapkm_lite import plotting
    >>> ax = plotting.plot_model_share([1e-3, 1e-2], [2e-4, 2e-3], [0.0, 1.0], [0.01, 0.02])
    """
    axes = plt.subplots(1, 2, figsize=(9.6, 3.4))[1] if axes is None else axes
    eps, share, leak = np.asarray(eps), np.asarray(share), np.asarray(leak)
    axes[0].loglog(eps, share[0] * eps / eps[0], "--", color=NEUTRAL, label="slope one")
    axes[0].loglog(eps, share, "o", color=AFTER, label="filter with the wrong model")
    axes[0].set(xlabel="all links too long by the share ε", ylabel="share that still fights")
    axes[0].set_title("in motion, at the worst place")
    axes[0].legend(loc="upper left")
    axes[1].plot(t, 1e3 * leak, color=ALARM)
    axes[1].set(xlabel="time in s", ylabel="leaking force in mN per N m", xlim=(t[0], t[-1]), ylim=(0, None))
    axes[1].set_title("a prestress on the way, ε = 0.001")
    return axes


def plot_hunting_maps(gains, counts, jumps: dict, friction, axes=None):
    """Jumps of the torques at rest over gain (k,) in N m/rad and counts per turn (j,), and where a step fills the band.

    jumps : dict of title -> (j, k) jumps per second.  friction : f_c in N m; the line is K_P 2 pi / counts = 2 f_c.
    Returns the axes.

    >>> from rapkm_lite import plotting
    >>> ax = plotting.plot_hunting_maps([1.0, 7.0], [500.0, 2000.0], {"sharp": [[0.0, 9.0], [0.0, 5.0]]}, 4.2e-3)
    """
    axes = plt.subplots(1, len(jumps), figsize=(3.6 * len(jumps), 3.4), sharey=True)[1] if axes is None else axes
    axes, steps = np.atleast_1d(axes), [-0.5, 0.5, 10.0, 100.0, 1e4]
    shades, norm = plt.get_cmap("cividis_r", len(steps) - 1), BoundaryNorm(steps, len(steps) - 1)
    for ax, (title, values) in zip(axes, jumps.items(), strict=True):
        image = ax.pcolormesh(gains, counts, values, cmap=shades, norm=norm, shading="nearest")
        ax.plot(gains, np.pi * np.asarray(gains) / friction, color=ALARM, lw=2.2, label="$K_P\\Delta_c = 2f_c$")
        ax.set(xscale="log", yscale="log", xlabel="gain in N m/rad", title=title)
        ax.set(xlim=(gains[0] / 1.2, gains[-1] * 1.2), ylim=(counts[0] / 1.4, counts[-1] * 1.4))
        ax.set_yticks(counts, [f"{n:g}" for n in counts])
        ax.set_xticks([1, 10], ["1", "10"])
        ax.minorticks_off()
        ax.grid(False)
    axes[0].set_ylabel("encoder in counts per turn")
    axes[-1].legend(loc="lower right", frameon=True, facecolor="white", framealpha=1.0)
    bar = axes[0].figure.colorbar(image, ax=list(axes), ticks=[0, 5, 55, 5000])
    bar.ax.set_yticklabels(["0", "1–9", "10–99", "100 …"])
    bar.set_label("torque jumps per second")
    return axes


def plot_saturation(limit, shifts, ax=None):
    """Largest shift (k,) in m that a torque limit (k,) in N m causes; shifts: up to three, of label -> (k,).

    >>> from rapkm_lite import plotting; ax = plotting.plot_saturation([0.1, 0.2], {"PD": [1e-3, 1e-4]})
    """
    ax = axes_or_new(ax, figsize=(6.6, 3.4))
    for (label, shift), (colour, mark) in with_looks("shifts", shifts, ((ALARM, "o"), (AFTER, "s"), (BEFORE, "^"))):
        ax.semilogy(1e3 * np.asarray(limit), 1e3 * np.asarray(shift), color=colour, marker=mark, ms=4.5, label=label)
    ax.set(xlabel="torque limit of each drive in mN m", ylabel="largest shift by the limit in mm")
    ax.legend(loc="upper right")
    return ax


def plot_faulty_runs(runs, ax=None, least: float = 1e-2):
    """Distance of the end-effector from its desired position over time, in mm, for up to five runs (label -> Run).

    The first run is the broad one; distances below `least` in mm are drawn there.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting; path = rk.circle(rk.load(), 0.05, 0.5)
    >>> ax = plotting.plot_faulty_runs({"healthy": rk.simulate(path.robot, rk.PD(7.05, 0.225), path)})
    """
    ax = axes_or_new(ax, figsize=(8.0, 3.4))
    looks = (("#CCCCCC", "-"), (ALARM, "-"), (AFTER, (0, (5, 1.2))), (ALARM, (0, (1.5, 1.2))), (NEUTRAL, "-."))
    for k, ((label, run), (colour, dash)) in enumerate(with_looks("runs", runs, looks)):
        off = 1e3 * np.linalg.norm(run.x - run.trajectory.x[: len(run)], axis=-1)
        ax.semilogy(run.t, np.maximum(off, least), color=colour, ls=dash, lw=1.5 if k else 5.0, label=label)
    ax.set(xlabel="time in s", ylabel="path error in mm", xlim=(0, None))
    ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return ax
