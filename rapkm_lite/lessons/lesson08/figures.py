"""Figures of lesson 08: places and their null vectors, readings that count, and what a residual does not tell."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np

from ...figures.machine import plane_axes, plot_workspace
from ...figures.style import AFTER, ALARM, BEFORE, NEUTRAL, axes_or_new
from ...mechanics.antagonism import null_vector
from ...mechanics.kinematics import inverse_kinematics

_LOOKS = ({"color": BEFORE, "marker": "o"}, {"color": ALARM, "marker": "^"}, {"color": AFTER, "marker": "s"})


def plot_places(robot, groups, axes=None):
    """Groups of places, name -> (k, 2) in m, in the plane, and beside it their null vectors of A^T.

    Three drives.  A null vector is shown by its components of drives 1 and 2: of unit length, it has no others.
    Returns both axes.

    >>> import rapkm_lite as rk
    >>> ax = plot_places(rk.load(), {"three": [[0.1, 0.0], [0.0, 0.1], [-0.1, 0.0]]})
    """
    axes = plt.subplots(1, 2, figsize=(9.2, 4.0))[1] if axes is None else axes
    plot_workspace(robot, axes[0])
    plane_axes(robot, axes[0])
    for (name, places), look in zip(groups.items(), _LOOKS, strict=False):
        q = inverse_kinematics(robot, places)
        n = null_vector(robot, q)
        points = {"linestyle": "none", "ms": 6, "mfc": "none", "mew": 1.6} | look
        axes[0].plot(*np.transpose(places), zorder=4, **points)
        axes[1].plot(n[:, 0], n[:, 1], label=name, **points)
    turn = np.linspace(0, 2 * np.pi, 200)
    axes[1].plot(np.cos(turn), np.sin(turn), color="#BBBBBB", lw=1, zorder=1)
    axes[1].set(
        xlabel="component of drive 1", ylabel="component of drive 2", aspect="equal", xlim=(-0.2, 1.1), ylim=(-0.2, 1.1)
    )
    axes[1].set_title("null vectors")
    axes[0].set_title("places")
    axes[1].legend(loc="lower left", fontsize=9)
    return axes


def plot_counted(t, gap, exact, axes=None):
    """What readings contradict each other by, gap (k,) in rad over t (k,) in s, beside the exact one (k,), and zoomed.

    Returns both axes.

    >>> import numpy as np
    >>> t = np.linspace(0, 1, 50)
    >>> ax = plot_counted(t, 1e-3 * np.rint(5 * t), 5e-3 * t)
    """
    axes = plt.subplots(1, 2, figsize=(9.2, 3.3), width_ratios=(1.7, 1))[1] if axes is None else axes
    for ax in axes:
        ax.plot(t, 1e3 * gap, ".", color=BEFORE, ms=2.5, label="from counts")
        ax.plot(t, 1e3 * exact, color=AFTER, lw=1.8, label="without rounding")
        ax.set(xlabel="time in s", ylabel="contradiction in mrad")
    middle, width = t[len(t) // 5], 0.007 * (t[-1] - t[0])
    axes[1].set(xlim=(middle - width, middle + width), title="a moment of it")
    top = 1e3 * np.max(gap)
    axes[0].set_ylim(top=1.25 * top)
    axes[0].legend(loc="upper center", ncols=2, markerscale=4)
    return axes


def plot_bias(residual, bias, names, ax=None):
    """Errors of offsets (m, k) in rad over the residuals (m, k) in rad that they leave, m groups called `names`.

    >>> import numpy as np
    >>> ax = plot_bias(np.array([[1e-5, 2e-5]]), np.array([[1e-3, 2e-3]]), ["a"])
    """
    ax = axes_or_new(ax, figsize=(6.4, 3.6))
    residual, bias = np.asarray(residual), np.asarray(bias)
    for left, off, name, look in zip(residual, bias, names, _LOOKS, strict=False):
        ax.loglog(1e3 * left, 1e3 * off, linestyle="none", ms=5, mfc="none", label=name, **look)
    low, high = 1e3 * np.min(residual) / 2, 1e3 * np.max(bias) * 2
    ax.plot([low, high], [low, high], ":", color=NEUTRAL, label="as large as the residual")
    ax.set(xlabel="residual in mrad", ylabel="error of the worst offset in mrad")
    ax.set_ylim(bottom=1e3 * np.min(bias) / 4)
    ax.legend(loc="lower right", fontsize=9)
    return ax
