"""Torques and errors of closed-loop runs over time."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes

from ._shared import LEAST, least_torque, no_finer
from .style import arm_line, axes_or_new


def plot_torques(run, ax=None, title: str = "", milli: bool = True):
    """Drive torques over time, in mN m, or in N m with ``milli=False``.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting
    >>> run = rk.simulate(rk.load(), rk.PD(7.05, 0.225), rk.triangle(rk.load()), [4e-3, -2e-3, 5e-3])
    >>> ax = plotting.plot_torques(run)
    """
    scale, unit = (1e3, "mN m") if milli else (1.0, "N m")
    return lines_per_drive(run, scale * run.c, ax, f"torque in {unit}", title, scale * least_torque(run.robot))


def plot_errors(run, ax=None, title: str = ""):
    """Errors of the true base angles over time.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting
    >>> run = rk.simulate(rk.load(), rk.PD(7.05, 0.225), rk.triangle(rk.load()), [4e-3, -2e-3, 5e-3])
    >>> ax = plotting.plot_errors(run)
    """
    return lines_per_drive(run, 1e3 * run.error, ax, "angle error in mrad", title, LEAST)


def lines_per_drive(run, values, ax: Axes | None, ylabel: str, title: str, least: float = 0.0):
    """One line per drive; the margin keeps the legend off the curves, also on shared axes.

    least : in the unit of `ylabel`; the axis shows no less, so that rounding is a flat line.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting; path = rk.circle(rk.load(), 0.05, 0.5)
    >>> run, ax = rk.simulate(path.robot, rk.PD(7.05, 0.225), path), plotting.axes_or_new()
    >>> plotting.lines_per_drive(run, run.c, ax, "torque in N m", "PD").get_ylabel()
    'torque in N m'
    """
    ax = axes_or_new(ax)
    for i, line in enumerate(np.transpose(values)):
        ax.plot(run.t, line, label=f"drive {i + 1}", marker="o" if len(run) == 1 else None, **arm_line(i))
    N = run.robot.n_arms
    rows = math.ceil(N / max(1, int(ax.get_window_extent().width / ax.figure.dpi / 1.04)))  # inches for one entry
    ax.set(xlabel="time in s", ylabel=ylabel, title=title, xlim=(0, max(run.t[-1], run.dt)))
    legend = ax.legend(ncols=math.ceil(N / rows), loc="upper right")
    # Of the height of low axes a legend takes a larger share; beyond a third the curves would be too flat.
    gap = legend.borderaxespad * legend.prop.get_size_in_points() * ax.figure.dpi / 72
    share = min((legend.get_window_extent().height + gap) / ax.get_window_extent().height, 0.35)
    ax.margins(y=max(0.18 * rows, share / (1.0 - 2.0 * share)))
    no_finer(ax, least)
    return ax
