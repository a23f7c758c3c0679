"""Figures of lesson 04: torques, antagonism and energies of runs without and with filter, two five-bars in one."""

from __future__ import annotations

from typing import Any

import matplotlib.pyplot as plt
import numpy as np

from ...figures._shared import LEAST, least_torque, no_finer, step_of, with_looks
from ...figures.film import film
from ...figures.machine import arm_points, plane_axes
from ...figures.maps import pair_line
from ...figures.runs import lines_per_drive
from ...figures.style import AFTER, ALARM, ARM_LINES, BEFORE, NEUTRAL, arm_colour, arm_line, axes_or_new
from ...machine.arguments import short
from ...mechanics.actuation import drive_pairs
from ...mechanics.antagonism import null_vector
from ...mechanics.closure import estimate_pose
from ...mechanics.kinematics import forward_kinematics, inverse_kinematics
from ...simulation.energy import antagonistic_torque


def _pair_poses(robot, q_a, guess, pairs) -> dict:
    """Each pair's five-bar (fig. 3), as its configuration (4,) in rad, at base angles q_a (N,); found from `guess`."""
    poses = {}
    for pair in pairs:
        try:
            poses[pair] = estimate_pose(robot.with_arms(pair), np.asarray(q_a)[list(pair)], guess)
        except ValueError as error:
            raise type(error)(f"drives {pair[0] + 1} and {pair[1] + 1} alone: {error}") from None
    return poses


def plot_synchronization(robot, x, offset, axes=None, magnify: float = 20.0):
    """The machine at x (2,) in m as two five-bars that share a drive, with offsets (N,) in rad.

    Left: both five-bars as their measured angles say, offsets times `magnify`.  Right: in mm about x, the end-effector
    as each pair of drives sees it, and the least-squares pose of all of them.  Returns both axes.
    Raises ValueError where the five-bar of a pair is singular, ConvergenceError for larger offsets than fit any pose.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting
    >>> ax = plotting.plot_synchronization(rk.load(), [0.0, 0.0], [4e-3, -2e-3, 5e-3])
    """
    axes = plt.subplots(1, 2, figsize=(9.4, 4.6), width_ratios=(1, 1.1))[1] if axes is None else axes
    x, offset = np.asarray(x, dtype=float), np.asarray(offset, dtype=float)
    true = inverse_kinematics(robot, x)[: robot.n_arms]
    shown = _pair_poses(robot, true + magnify * offset, x, ((0, 1), (1, 2))[: robot.n_arms - 1])
    for pair, face in zip(shown, ("white", ALARM), strict=False):
        for i, points in zip(pair, arm_points(robot.with_arms(pair), shown[pair]), strict=True):
            axes[0].plot(*points.T, "-" if face == "white" else "--", color=arm_colour(i), lw=3.2, zorder=3)
            axes[0].plot(*points[0], "o", color=arm_colour(i), ms=11, zorder=4)
            axes[0].plot(*points[1], "o", mfc="white", mec=arm_colour(i), mew=2, ms=7, zorder=4)
        label = f"seen by drives {pair[0] + 1} and {pair[1] + 1}"
        axes[0].plot(*points[2], "s", mfc=face, mec=NEUTRAL, mew=1.8, ms=9, zorder=5, label=label)
    axes[0].plot(*x, "+", color=AFTER, ms=14, mew=1.6, zorder=6, label="true end-effector")
    plane_axes(robot, axes[0])
    long, drawn = robot.lengths.max(), [line.get_xydata() for line in axes[0].lines]
    low = np.vstack([robot.base - 0.55 * long, *(points - 0.1 * long for points in drawn)]).min(axis=0)
    high = np.vstack([robot.base + np.array([0.4, 1.05]) * long, *(p + [0, 0.6 * long] for p in drawn)]).max(axis=0)
    axes[0].set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), title=f"offsets magnified {magnify:g} times")
    axes[0].legend(loc="upper left")

    seen = _pair_poses(robot, true + offset, x, drive_pairs(robot))
    points = {pair: forward_kinematics(robot.with_arms(pair), q) for pair, q in seen.items()}
    _plot_beliefs(robot, x, points, forward_kinematics(robot, estimate_pose(robot, true + offset, x)), axes[1])
    return axes


def _plot_beliefs(robot, x, points: dict, estimate, ax) -> None:
    """Points (2,) in m by pair of drives, the least-squares point and the true one, in mm about x."""
    corners = 1e3 * (np.array([*points.values()]) - x)
    words: dict[str, Any] = {"textcoords": "offset points", "fontsize": 9.5}
    centred = words | {"ha": "center", "va": "center"}
    apart = len(corners) == 1 or np.ptp(corners, axis=0).max() > LEAST
    if len(corners) == 3:
        ax.fill(*corners.T, color="#EEF2F6", ec=BEFORE, lw=1, zorder=1)
    names = [*(f"drives {j + 1}, {k + 1}" for j, k in points), "least squares", "true"]
    for (j, k), corner, name in zip(points, corners, names, strict=False):
        ax.plot(*corner, "s", ms=10, color=arm_colour(j), markerfacecoloralt=arm_colour(k), fillstyle="left", mec="k")
        if apart and len(corners) <= 3:
            side = 1 if corner[1] >= corners[:, 1].mean() else -1  # the name stands outside the triangle
            ax.annotate(name, corner, xytext=(0, 14 * side), **centred)
    ax.plot(*(1e3 * (estimate - x)), "D", color=NEUTRAL, ms=7)
    ax.plot(0, 0, "+", color=AFTER, ms=14, mew=1.6)
    if apart and 3 < len(corners) <= 6:  # some nearly agree, and their names would lie on one another
        ax.legend(ax.lines[-len(names) :], names, loc="center left", bbox_to_anchor=(1.01, 0.5))
    else:
        ax.annotate("least squares" if apart else "all drives agree", 1e3 * (estimate - x), xytext=(0, -13), **centred)
        ax.annotate("true", (0, 0), xytext=(10, -4), **words)
    shown = np.vstack([corners, 1e3 * (estimate - x), [0.0, 0.0]])
    ends = np.array([[-0.85], [0.85]]) * max(np.ptp(shown, axis=0).max(), 2 * LEAST)  # room for the names
    left_right, low_high = ((shown.min(axis=0) + shown.max(axis=0)) / 2 + ends).T
    ax.set(aspect="equal", xlim=left_right, ylim=low_high)
    ax.set(xlabel="x − true x in mm", ylabel="y − true y in mm", title="the same, true size, close up")


def plot_joint_moves(robot, start, stop, spacing, gap, marked, axes=None):
    """Fig. 3: drives that move along straight lines in joint space, and by how much they contradict each other.

    Left: what the pairs (1,2) and (2,3) make of such a move from `start` to `stop` (2,) in m, and the straight line.
    Right: largest contradiction `gap` (k,) in rad over the distance of the via points, `spacing` (k,) in m, a line of
    slope two, and the level `marked` in rad to compare with.  Returns both axes.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting; robot, far = rk.load(), [0.015, 0.03]
    >>> ax = plotting.plot_joint_moves(robot, [-0.05, 0.0], [0.05, 0.0], far, [2e-3, 7e-3], 5e-3)
    """
    axes = plt.subplots(1, 2, figsize=(10.0, 3.3), width_ratios=(1.35, 1))[1] if axes is None else axes
    spacing, gap = np.asarray(spacing), np.asarray(gap)
    ends = np.unwrap(inverse_kinematics(robot, np.stack([start, stop])), axis=0)
    part = np.linspace(0, 1, 61)[:, None]
    q = ends[0] + part * (ends[1] - ends[0])
    line = np.add(start, part * np.subtract(stop, start))
    axes[0].plot(*(1e3 * line.T), color="#BBBBBB", lw=5, label="straight line")
    for pair in ((0, 1), (1, 2))[: robot.n_arms - 1]:
        five_bar, x = robot.with_arms(pair), [line[0]]
        for angles in q[1:, list(pair)]:
            x.append(forward_kinematics(five_bar, estimate_pose(five_bar, angles, x[-1])))
        axes[0].plot(*(1e3 * np.array(x).T), label=f"drives {pair[0] + 1} and {pair[1] + 1}", **pair_line(robot, pair))
    axes[0].set(xlabel="x in mm", ylabel="y in mm", title="one straight move in joint space", aspect="equal")
    axes[0].set(ylim=1e3 * (line[:, 1].mean() + np.array([-1 / 6, 1 / 4]) * np.hypot(*(line[-1] - line[0]))))
    axes[0].legend(loc="upper center", ncols=3)
    axes[1].loglog(1e3 * spacing, 1e3 * gap, "o", color=AFTER, label="straight lines in joint space")
    axes[1].loglog(1e3 * spacing, 1e3 * gap[-1] * (spacing / spacing[-1]) ** 2, "--", color=NEUTRAL, label="slope two")
    axes[1].axhline(1e3 * marked, color=ALARM, ls=":", label="offsets of this lesson")
    axes[1].set(xlabel="distance of via points in mm", ylabel="contradiction in mrad", title="more via points")
    axes[1].legend(loc="upper left")
    return axes


# Colour and dashes of runs that are compared on one axis: they belong to none of three arms.
_RUN_LINES: list[dict[str, Any]] = [
    {"color": colour, "linestyle": ARM_LINES[k]}
    for colour, k in ((BEFORE, 0), (ALARM, 1), ("#3997BF", 2), (AFTER, 0), ("#8A3FC0", 3))
]


def plot_antagonism(run, ax=None, title: str = ""):
    """The part N_{A^T} c of the drive torques that moves nothing, over time.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting; path = rk.circle(rk.load(), 0.05, 0.5)
    >>> ax = plotting.plot_antagonism(rk.simulate(path.robot, rk.PD(7.05, 0.225), path))
    """
    least = 1e3 * max(least_torque(run.robot), 1e-6 * np.abs(run.c).max())  # beside the torques themselves
    return lines_per_drive(run, 1e3 * antagonistic_torque(run), ax, "antagonism in mN m", title, least)


def plot_torque_norms(runs: dict, ax=None, title: str = "", *, antagonism: bool = False, log: bool = False):
    """Norm of the drive torques over time, one line per run; `runs` maps a label to one of up to five runs.

    antagonism : show only the part that moves nothing.  log : logarithmic axis; what is less stands at its end.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting; path = rk.circle(rk.load(), 0.05, 0.5)
    >>> ax = plotting.plot_torque_norms({"PD": rk.simulate(path.robot, rk.PD(7.05, 0.225), path)})
    """
    ax = axes_or_new(ax, figsize=(9.8, 3.3))
    low, high = min(1e-9, *(least_torque(run.robot) for run in runs.values())), 0.0
    for (label, run), line in with_looks("runs", runs, _RUN_LINES):
        size = np.linalg.norm(antagonistic_torque(run) if antagonism else run.c, axis=-1)
        ax.plot(run.t, np.maximum(size, low) if log else 1e3 * size, label=label, **line)
        high = max(high, size.max())
    words = f"norm of the {'antagonism' if antagonism else 'torques'} in {'N m' if log else 'mN m'}"
    end = max(max(run.t[-1], run.dt) for run in runs.values())
    ax.set(xlabel="time in s", ylabel=words, title=title, xlim=(0, end), yscale="log" if log else "linear")
    if log:
        ax.set_ylim(low, max(10 * low, 2 * high))
    else:
        no_finer(ax, 1e3 * max(max(least_torque(run.robot), 1e-6 * np.abs(run.c).max()) for run in runs.values()))
    ax.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
    return ax


def plot_torque_plane(runs: dict, ax=None, title: str = ""):
    """Every sample of a run as a point: torque that moves over torque along the null vector of A^T.

    The squared distance from the origin times R_el / k_t^2 is the copper loss in W.  One or two runs of equal drives.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting; path = rk.circle(rk.load(), 0.05, 0.5)
    >>> ax = plotting.plot_torque_plane({"PD": rk.simulate(path.robot, rk.PD(7.05, 0.225), path)})
    """
    ax = axes_or_new(ax, figsize=(5.4, 3.4))
    for (label, run), (colour, marker) in with_looks("runs", runs, ((BEFORE, "o"), (AFTER, "."))):
        price = run.robot.resistance / run.robot.torque_constant**2
        if not np.allclose(price, price[0]):
            raise ValueError(f"runs[{label!r}] has drives of {short(price.tolist())} W/(N m)²; allowed: equal drives")
        along = np.sum(null_vector(run.robot, run.q) * run.c, axis=-1)
        moving = np.linalg.norm(run.c - antagonistic_torque(run), axis=-1)
        points = np.stack([along, moving])[:, :: step_of(run, 20)]
        ax.plot(*(1e3 * points), marker, color=colour, ms=4, label=label)
    ax.set(xlabel="antagonism, ηᵀc, in mN m", ylabel="torque that moves, ‖c_eff‖, in mN m", title=title)
    no_finer(ax, 1e3 * max(least_torque(run.robot) for run in runs.values()))
    (left, right), top = ax.get_xlim(), 1.25 * ax.get_ylim()[1]
    wide = max(right - left, 0.8 * top)  # equal scales would leave a run without antagonism a strip
    ax.set(xlim=((left + right - wide) / 2, (left + right + wide) / 2), ylim=(0, top), aspect="equal")
    ax.axvline(0, color="#BBBBBB", lw=0.8, zorder=0)
    ax.legend(loc="upper left", ncols=2)
    return ax


def plot_filter_share(run, share: float, axes=None):
    """A log while the filter is turned on: torques c - share N_{A^T} c over time, and their points in the torque plane.

    share : 0 without, 1 with the filter.  Left the torques of every drive, right each sample as in `plot_torque_plane`;
    pale the samples without filter.  For three arms.  Returns both axes.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting; path = rk.circle(rk.load(), 0.05, 0.5)
    >>> ax = plotting.plot_filter_share(rk.simulate(path.robot, rk.PD(7.05, 0.225), path), 0.5)
    """
    axes = plt.subplots(1, 2, figsize=(8.0, 3.2))[1] if axes is None else axes
    fight = antagonistic_torque(run)
    c = 1e3 * (run.c - share * fight)
    few, fewer = step_of(run, 10), step_of(run, 25)
    for i in range(run.robot.n_arms):
        axes[0].plot(run.t[::few], c[::few, i], label=f"drive {i + 1}", **arm_line(i))
    reach = 1.45e3 * max(np.abs(run.c).max(), least_torque(run.robot))
    axes[0].set(xlabel="time in s", ylabel="torque in mN m", title=f"filter {100 * share:.0f} %")
    axes[0].set(xlim=(0, max(run.t[-1], run.dt)), ylim=(-reach, reach))
    axes[0].legend(ncols=run.robot.n_arms, loc="upper right")
    along = 1e3 * np.sum(null_vector(run.robot, run.q) * run.c, axis=-1)[::fewer]
    moving = 1e3 * np.linalg.norm(run.c - fight, axis=-1)[::fewer]
    axes[1].plot(along, moving, "o", color="#DDDDDD", ms=4)
    axes[1].plot((1 - share) * along, moving, ".", color=AFTER, ms=5)
    axes[1].axvline(0, color="#BBBBBB", lw=0.8, zorder=0)
    least = min(10.0, 0.2 * reach)
    wide, high, low = 1.1 * max(np.abs(along).max(), least), 1.15 * moving.max(), min(-least, 1.1 * along.min())
    axes[1].set(xlim=(low, max(least, 1.1 * along.max())), ylim=(0, max(high, 0.5 * wide)))
    axes[1].set(xlabel="antagonism, ηᵀc, in mN m", ylabel="torque that moves, in mN m")
    return axes


def film_filter(run, frames: int = 18):
    """A film of `plot_filter_share`, for three arms: points of a log land on the axis while the filter is turned on.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting; path = rk.circle(rk.load(), 0.05, 0.5)
    >>> plotting.film_filter(rk.simulate(path.robot, rk.PD(7.05, 0.225), path), frames=3).size
    (768, 307)
    """
    alt = (
        "Left the torques of the three drives over time, lopsided at first, right every sample as a point, antagonism "
        "to the side and torque that moves upwards. While the filter is turned on the curves draw together, and all "
        "points travel sideways onto the vertical axis and keep their height."
    )
    draw, shares = lambda axes, share: plot_filter_share(run, share, axes), [0.0, 0.0, 0.0, *np.linspace(0, 1, frames)]
    return film(draw, shares, alt, panels=2, figsize=(8.0, 3.2), seconds=4)


def plot_energies(rows: dict, ax=None, title: str = ""):
    """Grouped bars of energies per drive; `rows` maps a label to (N,) energies in J, plain bars before hatched ones.

    >>> from rapkm_lite import plotting; ax = plotting.plot_energies({"off": [1.3, 1.5, 1.7], "on": [0.5, 0.7, 1.0]})
    """
    ax = axes_or_new(ax)
    low, high = min(np.min(e) for e in rows.values()), max(np.max(e) for e in rows.values())
    count, N, size = len(rows), max(map(len, rows.values())), max(high, -low, 1e-18)  # below is rounding, with mg, too
    width, digits = 0.8 / count, "z.2f" if 0.1 <= size < 1e4 else "z.2g"
    upright = count * N * max(len(f"{energy:{digits}}") for energies in rows.values() for energy in energies) > 60
    words: dict[str, Any] = {"ha": "center", "va": "bottom", "fontsize": 9 - (count > 2), "rotation": 90 * upright}
    fills = [{"alpha": 1.0}, {"alpha": 0.45}, {"alpha": 1.0, "hatch": "///"}, {"alpha": 0.45, "hatch": "///"}]
    for k, (label, energies) in enumerate(rows.items()):
        for i, energy in enumerate(energies):
            at = i + (k - (count - 1) / 2) * width
            ax.bar(at, energy, 0.92 * width, color=arm_colour(i), edgecolor="white", **fills[k % len(fills)])
            ax.text(at, max(energy, 0.0), f"{energy:{digits}}".replace("-", "−"), **words)
        ax.bar(np.nan, 0, color="#777777", edgecolor="white", label=label, **fills[k % len(fills)])
    ax.set_xticks(range(N), [f"drive {i + 1}" for i in range(N)])
    top = max((1.3 + 0.4 * upright) * high, 0.1 * size)
    ax.set(ylabel="electric energy in J", title=title, ylim=(min(0.0, 1.25 * low), top))
    ax.grid(axis="x", visible=False)
    ax.legend(ncols=2, loc="upper left")
    return ax


def plot_table1(table, ax=None, title: str = "Table 1"):
    """Measured and simulated energies of Table 1 side by side, without and with filter.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting; ax = plotting.plot_table1(rk.table1())
    """
    times = enumerate(("without filter", "with filter"))
    rows = {f"{what}, {when}": getattr(table, what)[k] for k, when in times for what in ("measured", "simulated")}
    return plot_energies(rows, axes_or_new(ax, figsize=(9.0, 3.6)), title)
