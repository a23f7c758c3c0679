"""Explorer of drives that interpolate for themselves between via points, or are late."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ..control.laws import PD, AntagonismFilter
from ..figures.marks import drive_legend, per_drive
from ..figures.style import ALARM, arm_line
from ..machine.manipulator import Manipulator
from ..mechanics.kinematics import inverse_kinematics
from ..mechanics.trajectory import polygon
from ..simulation.energy import antagonistic_torque, copper_loss
from ..simulation.runs import simulate
from .controls import choice, slider, switch
from .explorer import Explorer, explorer
from .geometry import TIME, frictionless


def via_points(robot: Manipulator | None = None) -> Explorer:
    """Via points on an edge, a late drive 1, the filter: the place of the end-effector, and torques that only press."""
    robot = frictionless(robot)
    N, middle = robot.n_arms, robot.base.mean(axis=0)
    ends = middle + np.array([[-0.12, -0.07], [0.12, -0.07]]) * np.ptp(robot.base[:, 0]) / 0.4
    path = polygon(robot, ends, duration=3.0, dt=2e-3)
    share = np.linalg.norm(path.x - ends[0], axis=-1) / np.linalg.norm(ends[1] - ends[0])

    @lru_cache(maxsize=128)
    def run(legs: int, late: int, filter: bool):
        at = np.linspace(0, 1, legs + 1)
        via = np.unwrap(inverse_kinematics(robot, ends[0] + at[:, None] * (ends[1] - ends[0]))[:, :N], axis=0)
        q_a = np.stack([np.interp(share, at, via[:, i]) for i in range(N)], axis=-1)
        samples = late // 2
        q_a[:, 0] = np.concatenate([np.repeat(q_a[:1, 0], samples), q_a[: len(q_a) - samples, 0]])
        law = PD(7.05, 0.225)
        return simulate(robot, AntagonismFilter(law) if filter else law, path.with_set_points(q_a))

    def draw(picture, legs, late, filter):
        done = run(legs, late, filter)
        there = len(path) // 2 + 1
        off = 1e3 * (done.x - path.x)[:there]
        null = antagonistic_torque(done)
        pressing = 1e3 * null
        for axis in (0, 1):
            dash = "-" if axis == 0 else (0, (5, 1.2))
            picture.trace("way", 240 * share[:there], off[:, axis], color=ALARM, linestyle=dash)
        picture.fit("way", off, least=1.0)
        for i in range(N):
            picture.trace("torque", done.t, pressing[:, i], **arm_line(i))
        picture.fit("torque", pressing, least=5.0)
        energy, lost = done.energy.sum(), copper_loss(robot, null[:-1], done.dt).sum()
        return {
            "largest torque that only presses": f"{np.abs(pressing).max():.1f} mN m",
            "farthest from the edge": f"{np.linalg.norm(off, axis=-1).max():.2f} mm",
            "electric energy": f"{energy:.2f} J, of which antagonism {lost:.3f} J",
            "at the end": per_drive(pressing[-1], 1) + " mN m",
        }

    def setup(picture):
        drive_legend(picture, "torque", robot)
        picture.legend(
            "way", [("along x", {"color": ALARM}), ("along y", {"color": ALARM, "linestyle": (0, (5, 1.2))})]
        )

    panels = {
        "way": {"xlabel": "way along the edge in mm", "ylabel": "true − wanted place in mm", "xlim": (0, 240)},
        "torque": {"xlabel": TIME, "ylabel": "torque that only presses in mN m", "xlim": (0, 3)},
    }
    counts = [(f"{240 / legs:g} mm", legs) for legs in (1, 2, 4, 8, 16, 32, 64)]
    controls = {
        "legs": choice("distance of the via points", counts, 8),
        "late": slider("drive 1 late in ms", 0, 10, 2, 0),
        "filter": switch("antagonism filter"),
    }
    about = "The end-effector leaves the straight edge, and the drives press against each other, between via points."
    return explorer(draw, controls, panels, size=(9.2, 3.8), setup=setup, about=about)
