"""Torques, errors and energies of closed-loop runs (figs. 4 to 7, Table 1)."""

from __future__ import annotations

import numpy as np

from .style import arm_colour, arm_line, axes_or_new


def plot_torques(run, ax=None, title: str = ""):
    """Drive torques over time."""
    ax = axes_or_new(ax)
    for i, torque in enumerate(run.c.T):
        ax.plot(run.t, torque, label=f"drive {i + 1}", **arm_line(i))
    ax.set(xlabel="time in s", ylabel="torque in N m", title=title, xlim=(0, run.t[-1]))
    ax.legend(ncols=run.robot.n_arms, loc="upper right")
    return ax


def plot_errors(run, ax=None, title: str = ""):
    """Errors of the true base angles over time."""
    ax = axes_or_new(ax)
    for i, error in enumerate(run.error.T):
        ax.plot(run.t, 1e3 * error, label=f"drive {i + 1}", **arm_line(i))
    ax.set(xlabel="time in s", ylabel="angle error in mrad", title=title, xlim=(0, run.t[-1]))
    ax.legend(ncols=run.robot.n_arms, loc="upper right")
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
            ax.text(at, energy, f"{energy:.2f}", ha="center", va="bottom", fontsize=9 if count < 3 else 7)
        ax.bar(np.nan, 0, color="#777777", edgecolor="white", label=label, **fills[k % len(fills)])
    ax.set_xticks(range(len(energies)), [f"drive {i + 1}" for i in range(len(energies))])
    ax.set(ylabel="electric energy in J", title=title)
    ax.set_ylim(0, 1.25 * max(np.max(e) for e in rows.values()))
    ax.grid(axis="x", visible=False)
    ax.legend(ncols=2, loc="upper left")
    return ax


