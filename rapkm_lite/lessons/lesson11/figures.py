"""Figures of lesson 11: how fast each loop is, what a gain is worth, and what laws cost over many machines."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np

from ...control.stability import effective_gain
from ...figures._shared import LEAST, no_finer, with_looks
from ...figures.style import AFTER, ALARM, BEFORE, NEUTRAL, axes_or_new
from ...machine.arguments import short
from ...mechanics.dynamics import minimal_dynamics, orthogonal_complement

_LOOKS = (
    {"color": NEUTRAL, "ls": "-", "marker": "o"},
    {"color": BEFORE, "ls": "--", "marker": "s"},
    {"color": ALARM, "ls": (0, (1, 1)), "marker": "^"},
    {"color": AFTER, "ls": (0, (5, 1.2, 1, 1.2)), "marker": "D"},
)


def loop_frequencies(path, stiffness) -> np.ndarray:
    """Natural frequencies (k, 2) in Hz along a path (`Trajectory`) of k samples, the lower one first.

    stiffness : (2, 2) or (k, 2, 2) in N/m, what a loop makes of an error of the end-effector, whose inertia they move.
    Raises ValueError for one that pushes away from the place: it has no frequency.

    >>> import numpy as np; import rapkm_lite as rk; from rapkm_lite import plotting
    >>> plotting.loop_frequencies(rk.hold(rk.load(), [0.0, 0.0], 0.01), 2e3 * np.eye(2))[0].round(2)
    array([12., 12.])
    """
    M, _, _ = minimal_dynamics(path.robot, path.q, 0 * path.q)
    springs = np.broadcast_to(np.asarray(stiffness, dtype=float), M.shape)
    squares = np.real(np.linalg.eigvals(np.linalg.solve(M, springs)))
    if squares.min() < -1e-12 * np.abs(squares).max():
        words = f"stiffness = {short(stiffness)} pushes away from the place, by {squares.min():.3g} 1/s^2 at worst"
        raise ValueError(f"{words}; allowed: springs that pull back")
    return np.sort(np.sqrt(np.maximum(squares, 0.0)), axis=-1) / (2 * np.pi)


def plot_loop_frequencies(path, springs: dict, nominal, ax=None):
    """`loop_frequencies` of each loop over time: a band between its two modes.

    springs : dict of label -> stiffness, as `loop_frequencies` takes it; at most four.  nominal : frequency in Hz that
    all were designed for.

    >>> import numpy as np; import rapkm_lite as rk; from rapkm_lite import plotting
    >>> ax = plotting.plot_loop_frequencies(rk.circle(rk.load(), 0.05), {"APD": 2e3 * np.eye(2)}, 5.0)
    """
    ax = axes_or_new(ax, figsize=(8.4, 3.6))
    for (label, given), look in with_looks("springs", springs, _LOOKS):
        low, high = loop_frequencies(path, given).T
        ax.fill_between(path.t, low, high, color=look["color"], alpha=0.1, lw=0)
        ax.plot(path.t, low, color=look["color"], ls=look["ls"], label=label)
        ax.plot(path.t, high, color=look["color"], ls=look["ls"])
    ax.axhline(nominal, color="#222222", lw=0.8, zorder=0)
    ax.set(xlabel="time in s", ylabel="natural frequency in Hz", xlim=(path.t[0], path.t[-1]), ylim=(0, None))
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.2), ncols=2)
    return ax


def plot_law_bands(names, columns: dict, axes=None):
    """Medians and the middle 80 % of many runs, one row for each law.

    names : of the laws.  columns : dict of axis label -> list of samples, one array for each law; the axes are
    logarithmic where the samples are positive and spread over more than a factor of ten.  Returns the axes.

    >>> from rapkm_lite import plotting
    >>> ax = plotting.plot_law_bands(["PD"], {"energy in J": [[4.0, 5.0]], "error in mm": [[0.5, 1.0]]})
    """
    if axes is None:
        axes = plt.subplots(1, len(columns), figsize=(9.6, 0.42 * len(names) + 1.1), sharey=True)[1]
    rows = -np.arange(len(names))
    for ax, (label, samples) in zip(np.atleast_1d(axes), columns.items(), strict=True):
        low, middle, high = (np.array([np.percentile(s, share) for s in samples]) for share in (10, 50, 90))
        ax.hlines(rows, low, high, color=AFTER, lw=5, alpha=0.4)
        ax.plot(middle, rows, "o", color=AFTER, ms=6)
        ax.set(xlabel=label, yticks=rows, yticklabels=names, ylim=(rows[-1] - 0.6, 0.6))
        if high.max() > 10 * low.min() > 0:
            ax.set_xscale("log")
        elif low.min() >= 0:
            ax.set_xlim(0, 1.08 * high.max())
    return axes


def plot_slow_error(t, error, predicted, ax=None):
    """Errors (k, 2) in m of a run over time t (k,) in s, and what the slow theory predicts (dashed).

    >>> import numpy as np; from rapkm_lite import plotting
    >>> ax = plotting.plot_slow_error(np.linspace(0, 1, 5), np.zeros((5, 2)), np.full((5, 2), 1e-4))
    """
    ax = axes_or_new(ax, figsize=(8.4, 3.2))
    for axis, (word, colour) in enumerate((("x", AFTER), ("y", ALARM))):
        ax.plot(t, 1e3 * error[:, axis], color=colour, label=f"run, {word}")
        ax.plot(t, 1e3 * predicted[:, axis], color=colour, ls="--", lw=1.2, label=f"theory, {word}")
    ax.axhline(0, color="#BBBBBB", lw=0.8)
    ax.set(xlabel="time in s", ylabel="true − desired position in mm", xlim=(t[0], t[-1]))
    no_finer(ax, LEAST)
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.22), ncols=4)
    return ax


def plot_effective_gain(trajectory, K, ax=None):
    """Both eigenvalues of the effective gain (F^T F)^-1 F^T K F of (35) along a path; K (2N, 2N) without unit.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting
    >>> path = rk.triangle(rk.load(), dt=5e-3); import numpy as np
    >>> ax = plotting.plot_effective_gain(path, np.diag([1, 1, 1, 0, 0, 0]))
    """
    ax = axes_or_new(ax)
    values = np.real(np.linalg.eigvals(effective_gain(orthogonal_complement(trajectory.robot, trajectory.q), K)))
    low, high = np.sort(values, axis=-1).T
    ax.plot(trajectory.t, high, color=NEUTRAL, ls="--", label="fast direction")
    ax.plot(trajectory.t, low, color=AFTER, label="slow direction")
    ax.fill_between(trajectory.t, low, high, color="#DDDDDD", alpha=0.6, lw=0)
    ax.set(xlabel="time in s", ylabel="effective / nominal gain", xlim=(0, trajectory.t[-1]))
    ax.set_ylim(0, 1.05 * max(1.0, high.max()))
    ax.legend(ncols=2, loc="upper right")
    return ax


def plot_step_response(t, measured: dict, predicted: dict, ax=None):
    """Simulated lines and predicted points (every 25th sample) of a deviation (k,) in m, each up to three by label.

    >>> from rapkm_lite import plotting
    >>> ax = plotting.plot_step_response([0.0, 0.1, 0.2], {"run": [1e-3, 4e-4, 1e-4]}, {"theory": [1e-3, 4e-4, 1e-4]})
    """
    ax = axes_or_new(ax)
    marks = (("o", AFTER), ("s", AFTER), ("x", ALARM))
    for (label, y), line in with_looks("measured", measured, ("-", "--", ":")):
        ax.plot(t, 1e3 * np.asarray(y), line, color=AFTER, label=f"simulated, {label}")
    for (label, y), (marker, colour) in with_looks("predicted", predicted, marks):
        look = {"color": colour, "mfc": "white", "ms": 5}
        ax.plot(t[::25], 1e3 * np.asarray(y[::25]), marker, label=f"predicted, {label}", **look)
    ax.axhline(0.0, color=NEUTRAL, lw=0.8)
    ax.set(xlabel="time in s", ylabel="deviation in mm", xlim=(0, t[-1]))
    no_finer(ax, LEAST)
    ax.legend(loc="upper right")
    return ax
