"""Torques, errors and energies of closed-loop runs (figs. 4 to 7, Table 1)."""

from __future__ import annotations

import numpy as np

from ..mechanics.antagonism import null_vector
from ..simulation.energy import antagonistic_torque
from .style import AFTER, ALARM, BEFORE, arm_colour, arm_line, axes_or_new

# Colour and dashes of runs that are compared on one axis: they belong to no arm.
_RUN_LINES = (
    {"color": BEFORE, "linestyle": "-"},
    {"color": ALARM, "linestyle": (0, (5, 1.2))},
    {"color": "#66AACC", "linestyle": (0, (4, 1.2, 1, 1.2))},
    {"color": AFTER, "linestyle": "-"},
    {"color": "#997700", "linestyle": (0, (1.5, 1.2))},
)


def plot_torques(run, ax=None, title: str = "", milli: bool = True):
    """Drive torques over time, in mN m or, for large ones, in N m."""
    scale, unit = (1e3, "mN m") if milli else (1.0, "N m")
    return _per_drive(run, scale * run.c, ax, f"torque in {unit}", title)


def plot_errors(run, ax=None, title: str = ""):
    """Errors of the true base angles over time."""
    return _per_drive(run, 1e3 * run.error, ax, "angle error in mrad", title)


def plot_antagonism(run, ax=None, title: str = ""):
    """The part N_{A^T} c of the drive torques that moves nothing, over time."""
    return _per_drive(run, 1e3 * antagonistic_torque(run), ax, "antagonism in mN m", title)


def plot_difference(run, other, ax=None, title: str = ""):
    """How much the true base angles of two runs along the same path differ, over time."""
    return _per_drive(run, 1e6 * (run.q_a - other.q_a), ax, "difference in µrad", title)


def _per_drive(run, values, ax, ylabel: str, title: str):
    """One line per drive; the margin keeps the legend off the curves, also on shared axes."""
    ax = axes_or_new(ax)
    for i, line in enumerate(values.T):
        ax.plot(run.t, line, label=f"drive {i + 1}", **arm_line(i))
    ax.margins(y=0.18)
    ax.set(xlabel="time in s", ylabel=ylabel, title=title, xlim=(0, run.t[-1]))
    ax.legend(ncols=run.robot.n_arms, loc="upper right")
    return ax


def plot_torque_norms(runs: dict, ax=None, title: str = "", *, antagonism: bool = False, log: bool = False):
    """Norm of the drive torques over time, one line per run; `runs` maps a label to a run.

    antagonism : show only the part that moves nothing.  log : logarithmic axis, cut off at 1e-9 N m.
    """
    ax = axes_or_new(ax, figsize=(9.8, 3.3))
    for (label, run), line in zip(runs.items(), _RUN_LINES, strict=False):
        size = np.linalg.norm(antagonistic_torque(run) if antagonism else run.c, axis=-1)
        ax.plot(run.t, np.maximum(size, 1e-9) if log else 1e3 * size, label=label, **line)
    ax.set(xlabel="time in s", title=title, xlim=(0, run.t[-1]), yscale="log" if log else "linear",
           ylabel=f"norm of the {'antagonism' if antagonism else 'torques'} in {'N m' if log else 'mN m'}")
    ax.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
    return ax


def plot_torque_plane(runs: dict, ax=None, title: str = ""):
    """Every sample of a run as a point: torque that moves over torque along the null vector of A^T.

    The squared distance from the origin times R / k_t^2 is the copper loss in W.  For three arms with equal drives.
    """
    ax = axes_or_new(ax, figsize=(5.4, 3.4))
    for (label, run), colour, marker in zip(runs.items(), (BEFORE, AFTER), "o.", strict=False):
        along = np.sum(null_vector(run.robot, run.q) * run.c, axis=-1)
        moving = np.linalg.norm(run.c - antagonistic_torque(run), axis=-1)
        ax.plot(1e3 * along[::20], 1e3 * moving[::20], marker, color=colour, ms=4, label=label)
    ax.set(xlabel="antagonism, nᵀc, in mN m", ylabel="torque that moves, ‖c_eff‖, in mN m", title=title)
    ax.set_aspect("equal")
    ax.set_ylim(0, 1.25 * ax.get_ylim()[1])
    ax.axvline(0, color="#BBBBBB", lw=0.8, zorder=0)
    ax.legend(loc="upper left", ncols=2)
    return ax


def plot_energies(rows: dict, ax=None, title: str = ""):
    """Grouped bars of energies per drive; `rows` maps a label to (N,) energies in J, plain bars before hatched ones."""
    ax = axes_or_new(ax)
    count = len(rows)
    width = 0.8 / count
    fills = [{"alpha": 1.0}, {"alpha": 0.45}, {"alpha": 1.0, "hatch": "///"}, {"alpha": 0.45, "hatch": "///"}]
    for k, (label, energies) in enumerate(rows.items()):
        for i, energy in enumerate(energies):
            at = i + (k - (count - 1) / 2) * width
            ax.bar(at, energy, 0.92 * width, color=arm_colour(i), edgecolor="white", **fills[k % len(fills)])
            ax.text(at, max(energy, 0.0), f"{energy:.2f}", ha="center", va="bottom", fontsize=9 if count < 3 else 8)
        ax.bar(np.nan, 0, color="#777777", edgecolor="white", label=label, **fills[k % len(fills)])
    ax.set_xticks(range(len(energies)), [f"drive {i + 1}" for i in range(len(energies))])
    ax.set(ylabel="electric energy in J", title=title)
    ax.set_ylim(min(0.0, 1.25 * min(np.min(e) for e in rows.values())), 1.3 * max(np.max(e) for e in rows.values()))
    ax.grid(axis="x", visible=False)
    ax.legend(ncols=2, loc="upper left")
    return ax


def plot_table1(table, ax=None, title: str = "Table 1"):
    """Measured and simulated energies of Table 1 side by side, without and with filter."""
    rows = {}
    for k, when in enumerate(("without filter", "with filter")):
        rows |= {f"measured, {when}": table.measured[k], f"simulated, {when}": table.simulated[k]}
    return plot_energies(rows, axes_or_new(ax, figsize=(9.0, 3.6)), title)
