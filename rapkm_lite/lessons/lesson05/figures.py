"""Computed torque near parameterization singularities and in redundant coordinates (figs. 8 to 10)."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np

from ...control.stability import feedback_norm
from ...figures._shared import scaled_frame, with_looks
from ...figures.film import film
from ...figures.machine import plot_machine, plot_path, plot_workspace
from ...figures.maps import curve_crossings, grid_points, on_grid, pair_line, pair_name, plot_map, plot_pair_curves
from ...figures.runs import plot_errors, plot_torques
from ...figures.style import AFTER, ALARM, BEFORE, NEUTRAL, axes_or_new
from ...mechanics.actuation import drive_pairs, redundant_control_matrix, singular_values
from ...mechanics.kinematics import arm_vectors, inverse_kinematics
from ...mechanics.partition import select_independent

# Wrong, makeshift, right: the same look in every figure of the lesson.
_LAW_LINES = {
    "fixed pair": {"color": ALARM, "linestyle": "--"},
    "switched": {"color": BEFORE, "linestyle": "-"},
    "redundant": {"color": AFTER, "linestyle": "-"},
}


def _law_line(label: str) -> dict:
    return next((line for name, line in _LAW_LINES.items() if name in label), {})


def _frame(robot, ax):
    """Fill the axes with the workspace, but for its tip."""
    ax.set(**scaled_frame(robot, -0.21, 0.21, -0.19, 0.25))
    return ax


def _box(runs, zoom, *testbed: float) -> dict:
    """Limits of a box (left, right, low, high) in m; of the testbed's corner on this machine, or about the runs."""
    if zoom is not None:
        return {"xlim": tuple(zoom[:2]), "ylim": tuple(zoom[2:])}
    box, seen = scaled_frame(runs[0].robot, *testbed), np.concatenate([run.x for run in runs])
    (left, right), (low, high) = box.values()
    if np.any(np.all((seen > [left, low]) & (seen < [right, high]), axis=-1)):
        return box
    room = 0.2 * np.ptp(seen, axis=0).max() + 0.05 * runs[0].robot.lengths.max()
    return dict(zip(box, zip(seen.min(axis=0) - room, seen.max(axis=0) + room, strict=True), strict=True))


def plot_singular_poses(trajectory, pairs=((0, 1), (0, 2)), axes=None):
    """Fig. 8 with the poses of a path: the five-bar of a pair, in colour, where the path crosses the pair's curve.

    Raises ValueError where it crosses none of theirs.
    The arrow is the direction in which the end-effector moves while both base joints of the pair stand still.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting
    >>> ax = plotting.plot_singular_poses(rk.triangle(rk.load()))
    """
    robot = trajectory.robot
    crossings = dict(zip(drive_pairs(robot), curve_crossings(trajectory), strict=True))
    poses = [(pair, k) for pair in pairs if pair in crossings for k in crossings[pair]]
    if not poses:
        raise ValueError(f"pairs = {pairs}: the path crosses no curve of theirs; allowed: a path that does")
    axes = plt.subplots(1, len(poses), figsize=(2.75 * len(poses), 3.3), sharey=True)[1] if axes is None else axes
    for ax, (pair, k) in zip(np.ravel(axes), poses, strict=True):
        q, x = trajectory.q[k], trajectory.x[k]
        plot_workspace(robot, ax, n=120)
        plot_path(trajectory, ax, color="#AAAAAA", lw=1.0)
        plot_machine(robot, q, ax, arms=[i for i in range(robot.n_arms) if i not in pair], alpha=0.18, labels=False)
        plot_machine(robot, q, ax, arms=pair, labels=False)
        d = arm_vectors(robot, q)[1][pair[0]]
        blind = 0.65 * robot.lengths.max() * np.array([-d[1], d[0]]) / np.hypot(*d)
        for tip in (x + blind, x - blind):
            ax.annotate("", tip, x, arrowprops={"arrowstyle": "->", "color": ALARM, "lw": 1.8}, zorder=7)
        ax.set(**scaled_frame(robot, -0.33, 0.33, -0.29, 0.36, drives=True))
        ax.set_title(f"pair {pair_name(pair)}, {trajectory.t[k]:.2f} s")
        ax.label_outer()
    return axes


def plot_feedback_map(robot, pair, ax=None, n: int = 220):
    """Norm of the feedback map of CTC in the angles of one pair of drives over the workspace, logarithmic.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting
    >>> ax = plotting.plot_feedback_map(rk.load(), (0, 1), n=21)
    """
    x, y, inside, points = grid_points(robot, n, driven=True)
    level = np.log10(feedback_norm(robot, inverse_kinematics(robot, points), pair))
    top = np.round(np.median(level) + 1.8)  # 0 for machines like the testbed, other decades for much heavier or lighter
    look = {"label": "log10 of the norm in N m per rad/s²", "vmin": top - 2.2, "vmax": top}
    ax = plot_map(x, y, on_grid(inside, level), ax, **look)
    plot_pair_curves(robot, ax, pairs=[pair], on_map=True)
    return _frame(robot, ax)


def plot_feedback_along(trajectory, ax=None):
    """Norm of the feedback map along a path, for each fixed pair and for redundant coordinates.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting; path = rk.triangle(rk.load(), dt=5e-3)
    >>> ax = plotting.plot_feedback_along(path)
    """
    ax = axes_or_new(ax)
    robot = trajectory.robot
    for pair in drive_pairs(robot):
        norm = feedback_norm(robot, trajectory.q, pair)
        ax.semilogy(trajectory.t, norm, label=f"pair {pair_name(pair)}", **pair_line(robot, pair))
    ax.semilogy(trajectory.t, feedback_norm(robot, trajectory.q), label="redundant", color=AFTER, lw=2.4)
    ax.set(xlabel="time in s", ylabel="norm in N m per rad/s²", xlim=(0, trajectory.t[-1]))
    ax.legend(ncols=4, loc="lower left", bbox_to_anchor=(-0.06, 1.0), columnspacing=1.2, handlelength=1.8)
    return ax


def plot_torques_and_errors(run, axes=None, pair=None, title: str = ""):
    """Torques and angle errors of one run, as in figs. 9 and 10; thin lines where the path crosses the pair's curve.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting; path = rk.circle(rk.load(), 0.05, 0.5)
    >>> ax = plotting.plot_torques_and_errors(rk.simulate(path.robot, rk.PD(7.05, 0.225), path))
    """
    axes = plt.subplots(1, 2, figsize=(9.6, 3.0))[1] if axes is None else axes
    plot_torques(run, axes[0], title, milli=False)
    plot_errors(run, axes[1])
    at = [] if pair is None else curve_crossings(run.trajectory)[drive_pairs(run.robot).index(pair)]
    for ax in axes:
        for t in run.trajectory.t[at][run.trajectory.t[at] <= run.t[-1]]:
            ax.axvline(t, color=NEUTRAL, lw=1.0, ls=":")
    # One legend for both panels, above the data.
    axes[0].get_legend().remove()
    axes[1].legend(ncols=min(run.robot.n_arms, 4), loc="lower right", bbox_to_anchor=(1.0, 1.0))
    return axes


def plot_ee_paths(runs: dict, axes=None, pair=None, zoom=None):
    """True end-effector paths of several runs and the curve of a pair: the workspace, and the box `zoom` (4,) in m.

    Default of `zoom`: the testbed's corner, as large as the machine, or, where no run gets there, about the runs.

    runs : label -> run; a cross marks where a run shorter than the longest one ends.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting; path = rk.circle(rk.load(), 0.05, 0.5)
    >>> ax = plotting.plot_ee_paths({"PD": rk.simulate(path.robot, rk.PD(7.05, 0.225), path)}, pair=(0, 1))
    """
    axes = plt.subplots(1, 2, figsize=(10.2, 3.9), width_ratios=[1, 1.55])[1] if axes is None else axes
    longest = max(runs.values(), key=lambda run: run.t[-1])
    for ax in axes:
        plot_workspace(longest.robot, ax)
        plot_path(longest.trajectory, ax, color="#BBBBBB", lw=5)
        plot_pair_curves(longest.robot, ax, pairs=None if pair is None else [pair])
        for label, run in runs.items():
            ax.plot(*run.x.T, label=label, zorder=4, **_law_line(label))
            if run.t[-1] < longest.t[-1]:
                ax.plot(*run.x[-1], "x", color=_law_line(label).get("color"), ms=9, mew=2.5, zorder=5)
        _frame(longest.robot, ax)
    box = _box([longest, *runs.values()], zoom, -0.13, 0.14, -0.105, -0.045)
    axes[1].set(**box, aspect="auto", title="enlarged, axes unequal")
    beside = len(axes[1].get_legend_handles_labels()[1]) > 9  # of four arms or more it would hide the paths
    axes[1].legend(loc="upper left", bbox_to_anchor=(1.01, 1.02) if beside else (0.12, 0.98))
    return axes


def plot_mirror(run, k: int, pair, axes=None, zoom=None):
    """Sample k of a run that a law in the angles of `pair` drives, beside the desired point and its mirror line.

    Left the machine, the other arms pale; right the box `zoom` (4,) in m: the desired point and the run up to here, the
    pair's curve, and the line through both elbows in which the tips of two base angles are mirror images.  Returns both
    axes.
    Default of `zoom`: the testbed's corner, as large as the machine, or, where the run never gets there, about the run.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting; robot = rk.load()
    >>> ax = plotting.plot_mirror(rk.simulate(robot, rk.PD(7.05, 0.225), rk.triangle(robot)), 1400, (0, 1))
    """
    axes = plt.subplots(1, 2, figsize=(8.0, 3.6), width_ratios=[1, 1.2])[1] if axes is None else axes
    robot, desired = run.robot, run.trajectory.x
    others = [i for i in range(robot.n_arms) if i not in pair]
    plot_machine(robot, run.q[k], axes[0], arms=others, alpha=0.18, labels=False)
    plot_machine(robot, run.q[k], axes[0], arms=pair, labels=False)
    elbows = (robot.base + arm_vectors(robot, run.q[k])[0])[list(pair)]
    for ax in axes:
        plot_path(run.trajectory, ax, color="#BBBBBB", lw=1.5 if ax is axes[0] else 5)
        plot_pair_curves(robot, ax, pairs=[pair], n=160)
        ax.axline(*elbows, color=NEUTRAL, ls=":", lw=1.2, zorder=2)
    axes[1].plot(*run.x[: k + 1].T, zorder=4, **_LAW_LINES["fixed pair"])
    axes[1].plot(*np.stack([run.x[k], desired[k]]).T, color=NEUTRAL, lw=1.0, zorder=4)
    axes[1].plot(*run.x[k], "s", color=ALARM, ms=8, zorder=6, label="end-effector")
    axes[1].plot(*desired[k], "o", mfc="none", mec=AFTER, mew=1.8, ms=10, zorder=6, label="desired")
    axes[1].plot([], [], ":", color=NEUTRAL, label="line through the elbows")
    axes[0].set(**scaled_frame(robot, -0.31, 0.31, -0.31, 0.31, drives=True), title=f"{run.t[k]:.2f} s")
    axes[1].set(**_box([run], zoom, 0.088, 0.13, -0.09, -0.054), title="enlarged")
    axes[1].legend(loc="lower right", framealpha=1.0, frameon=True, edgecolor="white")
    return axes


def film_mirror(run, pair, frames: int = 23):
    """A film of `plot_mirror` from just before the first crossing of the pair's curve to just after the second.

    Raises ValueError for a path that crosses it less than twice.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting; path = rk.triangle(rk.load())
    >>> plotting.film_mirror(rk.simulate(path.robot, rk.PD(7.05, 0.225), path), (0, 1), frames=4).size
    (768, 345)
    """
    crossings = curve_crossings(run.trajectory)[drive_pairs(run.robot).index(pair)]
    if len(crossings) < 2:
        raise ValueError(f"pair = {pair}: the path crosses its curve {len(crossings)} times; allowed: two or more")
    first, second = crossings[:2]
    steps = np.linspace(first - 0.09 / run.dt, second + 0.1 / run.dt, frames).astype(int)
    alt = (
        "Left the machine, right the lower right corner of the triangle, enlarged. At the curve on which the distal "
        "links are parallel the end-effector is thrown back, while the desired point goes on over the curve; until the "
        "path comes back each is the mirror image of the other in the line through the two elbows."
    )

    def draw(axes, k):
        plot_mirror(run, k, pair, axes)

    return film(draw, steps, alt, panels=2, figsize=(8.0, 3.6), seconds=6, poster=frames // 2 - 1)


def plot_pairs(run, ax=None):
    """The pair of independent joints in use over time, one bar per pair; ValueError for a law that uses no pair.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting; path = rk.circle(rk.load(), 0.05, 0.5)
    >>> ax = plotting.plot_pairs(rk.simulate(path.robot, rk.SwitchedCTC(400.0, 40.0), path))
    """
    pairs = drive_pairs(run.robot)
    used = np.all(np.sort(run.pairs)[:, None] == pairs, axis=-1)
    if not used.any():
        raise ValueError("run has no pair of drives as coordinates; allowed: one of SwitchedCTC, or of a law in two")
    ax = axes_or_new(ax, figsize=(8.0, max(1.6, 0.8 + 0.2 * len(pairs))))
    for k, pair in enumerate(pairs):
        bar = np.where(used[:, k], float(k), np.nan)
        ax.plot(run.t, bar, lw=6, solid_capstyle="butt", color=pair_line(run.robot, pair)["color"])
    ax.set_yticks(range(len(pairs)), [f"pair {pair_name(p)}" for p in pairs])
    ax.set(xlabel="time in s", xlim=(0, run.t[-1]), ylim=(-0.6, len(pairs) - 0.4))
    return ax


def plot_partition_rules(robot, rules=("printed", "sigma_min"), axes=None, n: int = 200):
    """Smallest singular value of the block A~_1 that each partition rule of (27) picks, over the workspace.

    Raises ValueError for what is no rule of `select_independent`.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting
    >>> ax = plotting.plot_partition_rules(rk.load(), n=21)
    """
    axes = plt.subplots(1, len(rules), figsize=(9.0, 3.9), sharey=True, squeeze=False)[1][0] if axes is None else axes
    x, y, inside, points = grid_points(robot, n)
    A = redundant_control_matrix(robot, inverse_kinematics(robot, points))
    for ax, rule in zip(axes, rules, strict=True):
        block = np.take_along_axis(A, select_independent(A, rule)[..., None], axis=-2)
        sigma = singular_values(block.mT)[:, 1]
        plot_map(x, y, on_grid(inside, sigma), ax, vmin=0.0, vmax=0.6, bar=False)
        plot_pair_curves(robot, ax, on_map=True, linewidth=1.0)
        _frame(robot, ax).label_outer()
    axes[0].figure.colorbar(axes[0].collections[0], ax=axes, label=r"$\sigma_\mathrm{min}(\tilde{A}_1)$", shrink=0.85)
    return axes


def plot_lyapunov(t, functions: dict, rate, axes=None):
    """Lyapunov functions in J by label on a logarithmic axis, and their rates of decay; a line at `rate` in 1/s.

    functions : one or two, of label -> (k,).

    >>> from rapkm_lite import plotting; ax = plotting.plot_lyapunov([0.0, 0.1, 0.2], {"V": [1.0, 0.5, 0.3]}, 5.0)
    """
    axes = plt.subplots(1, 2, figsize=(10.0, 3.2))[1] if axes is None else axes
    for (label, V), line in with_looks("functions", functions, ({"color": BEFORE}, {"color": AFTER, "ls": "--"})):
        axes[0].semilogy(t, V, label=label, **line)
        axes[1].plot(t[1:], -np.diff(np.log(V)) / np.diff(t), label=label, **line)
    axes[1].axhline(rate, color=ALARM, ls=":", label=f"{rate:g} 1/s")
    axes[0].set(xlabel="time in s", ylabel="value in J", xlim=(0, t[-1]))
    axes[1].set(xlabel="time in s", ylabel="rate of decay in 1/s", xlim=(0, t[-1]), ylim=(0, None))
    axes[1].legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=len(functions) + 1)
    return axes
