"""Figures of lesson 08: places and their null vectors, readings and rests that count, what a residual does not tell."""

from __future__ import annotations

from typing import Any

import matplotlib.pyplot as plt
import numpy as np

from ...figures._shared import LEAST, no_finer, with_looks
from ...figures.machine import plane_axes, plot_workspace
from ...figures.style import AFTER, ALARM, BEFORE, NEUTRAL, axes_or_new
from ...mechanics.antagonism import null_vector
from ...mechanics.kinematics import inverse_kinematics

_LOOKS = ({"color": BEFORE, "marker": "o"}, {"color": ALARM, "marker": "^"}, {"color": AFTER, "marker": "s"})


def plot_places(robot, groups, axes=None):
    """Groups of places, name -> (k, 2) in m, in the plane, and beside it their null vectors of A^T.

    Up to three groups, three drives.  A null vector is shown by its components of drives 1 and 2: of unit length, it
    has no others.
    Returns both axes.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting
    >>> ax = plotting.plot_places(rk.load(), {"three": [[0.1, 0.0], [0.0, 0.1], [-0.1, 0.0]]})
    """
    axes = plt.subplots(1, 2, figsize=(9.2, 4.0))[1] if axes is None else axes
    plot_workspace(robot, axes[0])
    plane_axes(robot, axes[0])
    least = -0.2
    for (name, places), look in with_looks("groups", groups, _LOOKS):
        q = inverse_kinematics(robot, places)
        n = null_vector(robot, q)
        least = min(least, n[:, :2].min() - 0.1)
        points = {"linestyle": "none", "ms": 6, "mfc": "none", "mew": 1.6} | look
        axes[0].plot(*np.transpose(places), zorder=4, **points)
        axes[1].plot(n[:, 0], n[:, 1], label=name, **points)
    turn = np.linspace(0, 2 * np.pi, 200)
    axes[1].plot(np.cos(turn), np.sin(turn), color="#BBBBBB", lw=1, zorder=1)
    axes[1].set(xlabel="component of drive 1", ylabel="component of drive 2", aspect="equal")
    axes[1].set(xlim=(least, 1.1), ylim=(least, 1.1))
    axes[1].set_title("null vectors")
    axes[0].set_title("places")
    axes[1].legend(loc="lower left", fontsize=9)
    return axes


def plot_counted(t, gap, exact, axes=None):
    """What readings contradict each other by, gap (k,) in rad over t (k,) in s, beside the exact one (k,), and zoomed.

    Returns both axes.

    >>> import numpy as np; from rapkm_lite import plotting
    >>> t = np.linspace(0, 1, 50)
    >>> ax = plotting.plot_counted(t, 1e-3 * np.rint(5 * t), 5e-3 * t)
    """
    axes = plt.subplots(1, 2, figsize=(9.2, 3.3), width_ratios=(1.7, 1))[1] if axes is None else axes
    for ax in axes:
        ax.plot(t, 1e3 * gap, ".", color=BEFORE, ms=2.5, label="from counts")
        ax.plot(t, 1e3 * exact, color=AFTER, lw=1.8, label="without rounding")
        ax.set(xlabel="time in s", ylabel="contradiction in mrad")
    middle, width = t[len(t) // 5], 0.007 * (t[-1] - t[0])
    axes[1].set(xlim=(middle - width, middle + width), title="a moment of it")
    top = 1e3 * np.max(gap)
    no_finer(axes[0], LEAST)
    low, high = axes[0].get_ylim()
    axes[0].set_ylim(top=max(1.25 * top, high + 0.15 * (high - low)))  # room for the legend, also below zero
    axes[0].legend(loc="upper center", ncols=2, markerscale=4)
    return axes


def plot_torque_steps(K_P, quantum, friction, target=0.5, ax=None, title: str = ""):
    """Torque of one drive with a stepped angle against its true angle, and the band that friction can hold.

    K_P in N m/rad, quantum in rad, friction in N m; `target` is where the desired angle lies between two counts.

    >>> from rapkm_lite import plotting; ax = plotting.plot_torque_steps(7.05, 3.14e-3, 4.2e-3)
    """
    ax = axes_or_new(ax, figsize=(4.4, 3.4))
    angle = np.linspace(-2.0, 3.0, 4001)
    torque = -1e3 * K_P * quantum * (np.floor(angle + 0.5) - target)
    held = np.abs(torque) <= 1e3 * friction
    ax.axhspan(-1e3 * friction, 1e3 * friction, color="#DDE3EA", label="friction holds")
    ax.plot(angle, -1e3 * K_P * quantum * (angle - target), ":", color=BEFORE, label="exact angle")
    flat = np.abs(np.gradient(torque)) == 0.0
    ax.plot(angle, np.where(flat & ~held, torque, np.nan), color=ALARM, label="measured, is driven on")
    ax.plot(angle, np.where(flat & held, torque, np.nan), color=AFTER, lw=3.5, label="measured, can rest here")
    ax.axvline(target, color=NEUTRAL, lw=0.8, label="desired angle")
    ax.set(xlabel="true angle in encoder counts", ylabel="torque in mN m", title=title)
    return ax


def plot_chatter(ratio, jumps, can_rest, ax=None, title: str = ""):
    """Torque jumps per second of many runs (k,) against K_P quantum / (2 f_c) (k,).

    can_rest : (k,); open circles where a place of rest exists, crosses where none does.

    >>> from rapkm_lite import plotting; ax = plotting.plot_chatter([0.5, 2.0], [0.0, 40.0], [True, False])
    """
    ax = axes_or_new(ax)
    ratio, jumps, can_rest = np.asarray(ratio), np.asarray(jumps), np.asarray(can_rest, dtype=bool)
    ax.axvspan(ratio.min() / 1.15, 1.0, color="#DDE3EA", lw=0)
    ax.axvline(1.0, color=NEUTRAL, lw=1.0)
    dots: dict[str, Any] = {"mfc": "none", "mec": AFTER, "mew": 1.4, "ms": 7}
    crosses: dict[str, Any] = {"color": ALARM, "mew": 1.8, "ms": 7}
    ax.plot(ratio[can_rest], jumps[can_rest], "o", label="a place of rest exists", **dots)
    ax.plot(ratio[~can_rest], jumps[~can_rest], "x", label="no place of rest", **crosses)
    ax.set_xlabel("step of the torque over width of the friction band, $k_P\\Delta_c / (2f_c)$")
    ax.set(xscale="log", ylabel="torque jumps per second", title=title)
    marks = [0.3, 0.5, 0.7, 1, 1.5, 2, 3, 5]
    ax.set_xticks(marks, [f"{mark:g}" for mark in marks])
    ax.set_xticks([], minor=True)
    ax.set_xlim(ratio.min() / 1.15, ratio.max() * 1.15)
    ax.legend(loc="center left")
    return ax


def plot_bias(residual, bias, names, ax=None):
    """Errors of offsets (m, k) in rad over the residuals (m, k) in rad that they leave, m <= 3 groups called `names`.

    >>> import numpy as np; from rapkm_lite import plotting
    >>> ax = plotting.plot_bias(np.array([[1e-5, 2e-5]]), np.array([[1e-3, 2e-3]]), ["a"])
    """
    ax = axes_or_new(ax, figsize=(6.4, 3.6))
    residual, bias = np.asarray(residual), np.asarray(bias)
    groups = dict(zip(names, zip(residual, bias, strict=True), strict=True))
    for (name, (left, off)), look in with_looks("names", groups, _LOOKS):
        ax.loglog(1e3 * left, 1e3 * off, linestyle="none", ms=5, mfc="none", label=name, **look)
    low, high = 1e3 * np.min(residual) / 2, 1e3 * np.max(bias) * 2
    ax.plot([low, high], [low, high], ":", color=NEUTRAL, label="as large as the residual")
    ax.set(xlabel="residual in mrad", ylabel="error of the worst offset in mrad")
    ax.set_ylim(bottom=1e3 * np.min(bias) / 4)
    ax.legend(loc="lower right", fontsize=9)
    return ax
