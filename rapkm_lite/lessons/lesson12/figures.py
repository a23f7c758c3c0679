"""Figures of lesson 12: the 4RRR machine, where it lets go, the choice of a length, and a circle with a swing."""

from __future__ import annotations

from typing import Any

import matplotlib.pyplot as plt
import numpy as np

from ...figures._shared import with_looks
from ...figures.marks.stored import mathtext
from ...figures.style import AFTER, ALARM, BEFORE, NEUTRAL, arm_colour, arm_text_colour, axes_or_new
from . import four_rrr

_LAWS: tuple[dict[str, Any], ...] = (
    {"color": BEFORE, "lw": 4},
    {"color": AFTER},
    {"color": ALARM},
    {"color": NEUTRAL, "ls": "--"},
)


def plot_four_legs(pose, ax=None, *, lines=False):
    """The 4RRR machine at one pose (3,) in m and rad; `lines` prolongs the distal links, along which the legs push.

    Filled circles are driven joints, open ones passive.

    >>> from rapkm_lite import plotting; ax = plotting.plot_four_legs([0.05, 0.0, 0.2])
    """
    ax = axes_or_new(ax, figsize=(4.2, 4.2))
    chains = four_rrr.legs(four_rrr.angles(pose))
    for i, points in enumerate(chains):
        ax.plot(*points.T, color=arm_colour(i), lw=4, solid_capstyle="round", zorder=3)
        ax.plot(*points[0], "o", color=arm_colour(i), ms=11, zorder=4)
        ax.plot(*points[1:].T, "o", mfc="white", mec=arm_colour(i), mew=2, ms=7, zorder=6)
        look = {"color": arm_text_colour(i), "fontweight": "bold", "fontsize": 9, "ha": "center", "va": "center"}
        place = {"xytext": (0, 13 if points[0, 1] > 0 else -13), "textcoords": "offset points"}
        ax.annotate(f"drive {i + 1}", points[0], **place, **look)
        if lines:
            along = points[2] - points[1]
            ends = np.stack([points[2], points[2] + 0.7 * along])
            ax.plot(*ends.T, ":", color=arm_colour(i), lw=1.8, zorder=5.5)
    ax.fill(*chains[:, 2].T, facecolor="#E3E6EA", edgecolor=NEUTRAL, lw=1.8, zorder=5)
    ax.set(xlabel="x in m", ylabel="y in m", aspect="equal", xlim=(-0.68, 0.68), ylim=(-0.68, 0.68))
    return ax


def plot_apex(angle, sigma, pose, axes=None):
    """Left: smallest singular value of A~ (k,) over the platform angle (k,) in rad.  Right: the machine at a pose.

    >>> import numpy as np; from rapkm_lite import plotting
    >>> ax = plotting.plot_apex(np.linspace(0, 0.7, 8), np.linspace(0.35, 0.0, 8), [0.0, 0.0, 0.59])
    """
    axes = plt.subplots(1, 2, figsize=(9.4, 4.2), layout="constrained")[1] if axes is None else axes
    axes[0].plot(angle, sigma, color=AFTER)
    axes[0].axvline(pose[2], color=ALARM, ls=":", label=f"{pose[2]:.5f} rad")
    axes[0].set(xlabel="platform angle in rad", ylim=(0, None), title="in the centre")
    axes[0].set_ylabel(mathtext("σ_min(Ã), all drives"))
    axes[0].legend()
    plot_four_legs(pose, axes[1], lines=True).set_title("all distal lines through one point")
    return axes


def plot_length_choice(lengths, conditions: dict, special, ax=None):
    """Condition number of A over the length (k,) in m that makes radians comparable with metres.

    conditions : up to three, of label -> (k,).  special : a length in m to point at, as (words, number).

    >>> from rapkm_lite import plotting
    >>> ax = plotting.plot_length_choice([0.1, 1.0], {"centre": [1.0, 7.0]}, ("platform", 0.14))
    """
    ax = axes_or_new(ax, figsize=(6.4, 3.4))
    for (label, condition), look in with_looks("conditions", conditions, ("-", "--", ":")):
        ax.loglog(lengths, condition, look, color=AFTER, label=label)
    words, length = special
    ax.axvline(length, color=ALARM, ls=":", label=words)
    ax.set(xlabel="characteristic length in m", ylabel="condition number of A")
    ax.legend(loc="lower left")
    return ax


def plot_swing(motion, pose, labels, ax=None):
    """Distance of the platform's centre from its desired position over time, in mm: poses (runs, k, 3) of the `labels`.

    >>> import numpy as np; from rapkm_lite.lessons.lesson12 import four_rrr; from rapkm_lite import plotting
    >>> motion = four_rrr.Motion(np.arange(3.0), np.zeros((3, 3)), *3 * [np.zeros((3, 9))])
    >>> ax = plotting.plot_swing(motion, np.ones((1, 3, 3)), ["PD"])
    """
    ax = axes_or_new(ax, figsize=(8.0, 3.4))
    off = 1e3 * np.linalg.norm((pose - motion.pose)[..., :2], axis=-1)
    for label, row, look in zip(labels, off, _LAWS, strict=False):
        ax.plot(motion.t, row, label=label, **look)
    ax.set(xlabel="time in s", ylabel="position error in mm", ylim=(0, 1.35 * off.max()))
    ax.legend(ncols=2, loc="upper center")
    return ax
