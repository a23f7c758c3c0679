"""Figures of lesson 00: two machines at work, and the machine in all its working modes."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np

from ...control.laws import PD
from ...figures.film import film
from ...figures.machine import plot_machine, plot_path
from ...figures.maps import mode_name
from ...figures.style import NEUTRAL
from ...mechanics.kinematics import inverse_kinematics, working_modes
from ...mechanics.trajectory import follow, triangle
from ...simulation.energy import joule_heat, work_of_holds
from ...simulation.runs import simulate


def plot_working_modes(robot, x, axes=None):
    """The machine at the point x (2,) in m, once per working mode; returns the axes.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting
    >>> ax = plotting.plot_working_modes(rk.load(), [0.0, 0.0])
    """
    modes = working_modes(robot)
    if axes is None:
        rows = max(2, len(modes) // 8)
        columns = len(modes) // rows
        axes = plt.subplots(rows, columns, figsize=(2.5 * columns, 2.6 * rows), sharex=True, sharey=True)[1]
    for ax, mode in zip(np.ravel(axes), modes, strict=True):
        plot_machine(robot, inverse_kinematics(robot, x, mode), ax, labels=False)
        ax.set_title(mode_name(mode), loc="center")
        ax.label_outer()
    return axes


def _draw_at_work(robot, q, path, spent: float, most: float, ax, title: str) -> None:
    """The machine at q (2N,) on its path, and a meter beside it: `spent` of `most` energy, both in J."""
    plot_path(path, ax, lw=0.9)
    plot_machine(robot, q, ax, labels=False)
    low, high = -0.28, 0.28
    ax.plot([0.5, 0.5], [low, high], color="#DDDDDD", lw=9, solid_capstyle="butt")
    ax.plot([0.5, 0.5], [low, low + (high - low) * spent / most], color=NEUTRAL, lw=9, solid_capstyle="butt")
    ax.text(0.5, high + 0.02, f"{spent:.1f} J", ha="center", va="bottom", fontsize=11)
    ax.text(-0.4, 0.34, title, fontweight="bold")
    ax.set(xlim=(-0.42, 0.62), ylim=(-0.34, 0.38))
    ax.set_axis_off()


def film_workshop(robot, offset, frames: int = 36):
    """Two machines with a lap of the triangle and five seconds of rest: encoders right, and wrong by offset (N,), rad.

    The meters count the electric energy since the start.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting
    >>> plotting.film_workshop(rk.load(), [4e-3, -2e-3, 5e-3], frames=3).size
    (729, 307)
    """
    lap = triangle(robot)
    still = np.zeros((len(lap.t) - 1, 2))
    x, xd, xdd = (np.concatenate([part, still + end]) for part, end in ((lap.x, lap.x[-1]), (lap.xd, 0), (lap.xdd, 0)))
    path = follow(robot, lap.dt * np.arange(len(x)), x, xd, xdd)
    runs = [simulate(robot, PD(7.05, 0.225), path, error) for error in (np.zeros(robot.n_arms), offset)]
    meters = []
    for run in runs:
        heat = joule_heat(run.c[:-1], run.dt, robot.resistance, robot.torque_constant)
        energy = np.sum(heat + work_of_holds(run.c, run.q_a), axis=1)
        meters.append(np.concatenate([[0.0], np.cumsum(energy)]))
    most = max(meter.max() for meter in meters)

    def draw(axes, k):
        for ax, run, meter, name in zip(axes, runs, meters, ("machine A", "machine B"), strict=True):
            _draw_at_work(robot, run.q[k], lap, meter[k], most, ax, f"{name}, {run.t[k]:.1f} s")

    alt = (
        "Two equal machines with three arms take their tool around the same triangle in five seconds and then stand "
        f"still for five more. The meter of machine A stops at {meters[0][-1]:.1f} J. That of machine B rises faster, "
        f"and goes on rising while nothing moves, to {meters[1][-1]:.1f} J."
    )
    steps = np.linspace(0, len(path.t) - 1, frames).astype(int)
    return film(draw, steps, alt, panels=2, figsize=(7.6, 3.2), seconds=10)
