"""Pictures of parameter studies: landscapes over offsets, gains and path placement, Monte-Carlo bands (lesson 06)."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np

from ...figures._shared import scaled_frame, with_looks
from ...figures.machine import plot_machine, plot_workspace
from ...figures.style import AFTER, ALARM, BEFORE, NEUTRAL, arm_colour, arm_text_colour, axes_or_new


def plot_landscape(values, cube, theory, axes=None):
    """Slices of an energy over three offsets: `cube` and `theory` (k, k, k) in J over `values` (k,) in mrad.

    One panel per slice of constant third offset (lowest, middle, highest): colours simulation, dashed lines theory.

    >>> import numpy as np; from rapkm_lite import plotting; cube = np.ones((3, 3, 3))
    >>> ax = plotting.plot_landscape([-1.0, 0.0, 1.0], cube, cube)
    """
    axes = plt.subplots(1, 3, figsize=(11, 3.7), sharey=True)[1] if axes is None else axes
    levels = np.max(cube) * np.linspace(0, 1, 9) ** 2  # evenly spaced ellipses of a quadratic form
    for ax, k in zip(axes, (0, len(values) // 2, len(values) - 1), strict=True):
        filled = ax.contourf(values, values, cube[:, :, k].T, levels=levels)
        ax.contour(values, values, theory[:, :, k].T, levels=levels[1:], colors="white", linestyles="--", linewidths=1)
        ax.set(title=f"offset 3 = {values[k]:.1f} mrad".replace("-", "−"), xlabel="offset 1 in mrad", aspect="equal")
        ax.grid(False)
    axes[0].set_ylabel("offset 2 in mrad")
    axes[0].figure.colorbar(filled, ax=axes, label="antagonistic energy in J", format="%.1f")
    return axes


def plot_gain_curve(gains, without, with_filter, antagonistic, ax=None):
    """Total energies (k,) in J over the gain K_P (k,) in N m/rad, and the antagonistic part.

    >>> from rapkm_lite import plotting; ax = plotting.plot_gain_curve([1.0, 7.0], [2.2, 5.5], [2.0, 2.1], [0.2, 3.5])
    """
    ax = axes_or_new(ax, figsize=(6.2, 3.6))
    ax.loglog(gains, without, "o-", color=BEFORE, label="without filter")
    ax.loglog(gains, with_filter, "s-", color=AFTER, label="with filter")
    ax.loglog(gains, antagonistic, "--", color=ALARM, label="antagonistic part")
    ax.set(xlabel=r"gain $K_P$ in N m/rad", ylabel="total electric energy in J")
    ticks = [t for t in (1, 2, 5, 10, 20, 50, 100) if min(gains) <= t <= max(gains)]
    ax.set_xticks(ticks, [f"{t}" for t in ticks])
    ax.set_xticks([], minor=True)
    ax.legend()
    return ax


def plot_placement(robot, centres, values, ax=None, label="antagonistic energy in J", path=None):
    """A value (k,) for each path centre (k, 2) in m as coloured squares on the workspace, and a Trajectory `path`.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting
    >>> centres = [[0.0, 0.0], [0.02, 0.0], [0.0, 0.02], [0.02, 0.02]]
    >>> ax = plotting.plot_placement(rk.load(), centres, [1.0, 2.0, 3.0, 4.0])
    """
    ax = axes_or_new(ax, figsize=(5.6, 4.4))
    plot_workspace(robot, ax, colour="#F7F7F7")
    plot_machine(robot, np.zeros(robot.n_joints), ax, arms=[])
    for i, point in enumerate(robot.base):
        ax.plot(*point, "o", color=arm_colour(i), ms=10)
        place = {"xytext": (0, 12 if point[1] > 0 else -16), "textcoords": "offset points", "ha": "center"}
        ax.annotate(f"drive {i + 1}", point, color=arm_text_colour(i), fontweight="bold", fontsize=9, **place)
    marks = ax.scatter(*np.asarray(centres).T, c=values, marker="s", s=60, zorder=3)
    ax.figure.colorbar(marks, ax=ax, label=label)
    if path is not None:
        ax.plot(*path.x.T, color=ALARM, lw=2.0, zorder=4)
    ax.grid(False)
    ax.set(**scaled_frame(robot, -0.27, 0.27, -0.2, 0.29, drives=True))
    return ax


def plot_bands(samples: dict, ax=None):
    """Distribution functions of energies in J with their means; `samples` maps one or two labels to (k,).

    Of runs that were lost, masked or NaN, no energy is below any other; ValueError where all were.

    >>> from rapkm_lite import plotting
    >>> ax = plotting.plot_bands({"without filter": [3.0, 5.0, 4.0], "with filter": [2.0, 2.1, 2.0]})
    """
    ax = axes_or_new(ax, figsize=(6.6, 3.5))
    for (label, values), colour in with_looks("samples", samples, (BEFORE, AFTER)):
        done = np.sort(np.ma.masked_invalid(values).compressed())
        if not done.size:
            raise ValueError(f"samples[{label!r}] has {len(values)} lost runs; allowed: one energy at least")
        ax.step(done, 100 * np.arange(1, len(done) + 1) / len(values), color=colour, lw=2.2, label=label)
        ax.plot(done.mean(), 100 * np.sum(done <= done.mean()) / len(values), "D", color=ALARM, ms=7)
    ax.plot([], [], "D", color=ALARM, label="mean")
    ax.set(xlabel="total electric energy in J", ylabel="share of runs below, %", xlim=(0, None), ylim=(0, 101))
    ax.legend(loc="lower right")
    return ax


def plot_readings(names, low, high, readings, reference=None, ax=None):
    """Parameter sets (k, p), and a marked one `reference`, as dots in their ranges low, high (p,), a row per parameter.

    What lies beyond a range is shown beyond 0 … 1.

    >>> from rapkm_lite import plotting
    >>> ax = plotting.plot_readings(["K_P", "K_D"], [0.0, 0.0], [10.0, 1.0], [[7.05, 0.225], [6.0, 0.3]])
    """
    ax = axes_or_new(ax, figsize=(8.0, 3.8))
    share = (np.asarray(readings) - low) / (np.asarray(high) - low)
    rows = np.arange(len(names))
    for line in share:
        ax.plot(line, rows, "o-", color=NEUTRAL, ms=5, lw=0.6, alpha=0.6)
    if reference is not None:
        at = (np.asarray(reference) - low) / (np.asarray(high) - low)
        ax.plot(at, rows, "D", color=ALARM, ms=7, label="the reading of the data file")
        ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0))
    ax.set_yticks(rows, [f"{n}  [{a:g} … {b:g}]".replace("-", "−") for n, a, b in zip(names, low, high, strict=True)])
    places = np.concatenate([np.ravel(line.get_xdata()) for line in ax.get_lines()])
    low_end, high_end = min(0.0, places.min()), max(1.0, places.max())
    room = 0.02 * (high_end - low_end)  # for the outermost mark
    ax.set(xlim=(low_end - room, high_end + room), xlabel="position in the search range, 0 … 1")
    ax.invert_yaxis()
    return ax
