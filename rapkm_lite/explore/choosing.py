"""Explorer of laws made equally fast, under the same disturbances."""

from __future__ import annotations

import numpy as np

from ..control.computed_torque import CTC, RedundantCTC, SwitchedCTC
from ..control.laws import PD, AntagonismFilter
from ..figures.marks import drive_legend, offset_values
from ..figures.style import ALARM, arm_line
from ..machine.manipulator import Manipulator
from ..mechanics.actuation import control_matrix
from ..mechanics.dynamics import minimal_dynamics
from ..mechanics.trajectory import triangle
from ..simulation.energy import antagonistic_energy
from ..simulation.runs import simulate
from .controls import choice, offset_sliders, slider, switch
from .explorer import Explorer, explorer
from .geometry import TIME, frictionless


def controller_choice(robot: Manipulator | None = None) -> Explorer:
    """A law, its speed, offsets, a payload that it does not know and its encoders: error and torques of a run."""
    robot = frictionless(robot)
    path = triangle(robot, 0.3 * np.ptp(robot.base[:, 0]), 2.5, centre=robot.base.mean(axis=0))
    q = path.q[0]
    A, inertia = control_matrix(robot, q), minimal_dynamics(robot, q, 0 * q, None)[0]
    # N m s^2: what a gain of PD in N m/rad has to carry for one in 1/s^2, on the mean of both modes.
    carried = 2 / np.trace(np.linalg.solve(inertia, A.T @ A))
    laws = {
        "PD": lambda k, d: PD(carried * k, carried * d),
        "PD and filter": lambda k, d: AntagonismFilter(PD(carried * k, carried * d)),
        "computed torque, fixed pair": CTC,
        "computed torque, switched pair": SwitchedCTC,
        "computed torque, end-effector": lambda k, d: CTC(k, d, None),
        "computed torque, redundant": RedundantCTC,
    }

    def draw(picture, law, frequency, load, coarse, **offsets):
        w = 2 * np.pi * frequency
        sensors = {"encoder": 2000, "velocity_filter": 5e-3} if coarse else {}
        plant, offset = robot.replace(load=1e-3 * load), offset_values(offsets, robot.n_arms)
        run = simulate(plant, laws[law](w**2, 2 * w), path, offset, model=robot, **sensors)
        error, torque = 1e3 * np.linalg.norm(run.x - path.x, axis=-1), 1e3 * run.c
        picture.trace("error", run.t, error, color=ALARM)
        picture.fit("error", error, symmetric=False, least=2.0)
        for i in range(robot.n_arms):
            picture.trace("torque", run.t, torque[:, i], **arm_line(i))
        picture.fit("torque", torque, least=60.0)
        return {
            "largest error": f"{error.max():.2f} mm",
            "largest jump of a torque": f"{np.abs(np.diff(torque, axis=0)).max():.1f} mN m",
            "energy": f"{run.energy.sum():.2f} J, of which antagonism {antagonistic_energy(run):.2f} J",
        }

    panels = {
        "error": {"xlabel": TIME, "ylabel": "distance from the path in mm", "xlim": (0, 2.5)},
        "torque": {"xlabel": TIME, "ylabel": "torque in mN m", "xlim": (0, 2.5)},
    }
    controls = {
        "law": choice("law", laws.keys(), "PD"),
        "frequency": slider("speed of the loop in Hz", 1, 8, 0.5, 5),
        "load": slider("unknown payload in g", 0, 200, 20, 0),
        "coarse": switch("2000 counts per turn"),
    } | offset_sliders(robot, (4.0, -2.0, 5.0), 10)
    about = "Distance from the path and torques of a run, under a law and with disturbances of one's choice."
    return explorer(
        draw, controls, panels, size=(9.2, 3.8), setup=lambda p: drive_legend(p, "torque", robot), about=about
    )
