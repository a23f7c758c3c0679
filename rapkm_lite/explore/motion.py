"""Explorer that plays a run: the mechanism with the forces of its drives, and a time that all panels share."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ..control.laws import PD
from ..figures.machine import plane_limits
from ..figures.marks import draw_machine, draw_workspace, drive_legend
from ..figures.style import AFTER, NEUTRAL, arm_colour, arm_line
from ..machine.manipulator import Manipulator
from ..mechanics import actuation as act
from ..mechanics.trajectory import triangle
from ..simulation.runs import simulate
from .controls import choice, slider, switch
from .explorer import Explorer, explorer
from .geometry import TIME, frictionless
from .runs import LAWS

# Metres of arrow for 1 N, and the newtons of the arrow that shows it.
SCALE, UNIT = 0.4, 0.25


def animation(robot: Manipulator | None = None) -> Explorer:
    """The machine moves along the triangle; arrows are the forces of the drives at the end-effector."""
    robot = frictionless(robot)
    N = robot.n_arms
    path = triangle(robot)
    calibration = {False: np.zeros(N), True: 1e-3 * np.resize([4.0, -2.0, 5.0], N)}

    @lru_cache(maxsize=8)
    def recorded(filter: str, offsets: bool):
        run = simulate(robot, LAWS[filter](PD(7.05, 0.225)), path, calibration[offsets])
        A = act.control_matrix(robot, run.q)
        return run, A * run.c[..., None], np.linalg.norm(1e3 * (run.x - path.x), axis=-1)

    def draw(picture, time, filter, offsets):
        run, force, error = recorded(filter, offsets)
        k = min(round(1e-3 * time / run.dt), len(run.t) - 1)
        draw_machine(picture, "plane", robot, run.q[k])
        total = force[k].sum(axis=0)
        for vector, colour in [*zip(force[k], map(arm_colour, range(N)), strict=True), (total, AFTER)]:
            picture.arrow("plane", run.x[k], SCALE * vector, 0.009, facecolor=colour, edgecolor="white", zorder=6)
        picture.handle("plane", *run.x[k], along=path.x[::25], time=1e3 * path.t[::25])
        for panel, values in (("torque", 1e3 * run.c), ("error", error[:, None])):
            for i, column in enumerate(values.T):
                style = arm_line(i) if panel == "torque" else {"color": AFTER}
                picture.trace(panel, run.t, column, **style)
                picture.line(panel, run.t[k], column[k], marker="o", markersize=6, color=style["color"], zorder=5)
            picture.fit(panel, values, symmetric=panel == "torque", least=0.5)
            picture.line(panel, run.t[[k, k]], picture.ylim(panel), color=NEUTRAL, linewidth=0.9, zorder=1)
            picture.handle(panel, run.t[k], None, time=(1e3, 0))
        antagonism = act.prestress_projector(act.control_matrix(robot, run.q[k])) @ run.c[k]
        return {
            "time": f"{run.t[k]:.2f} s",
            "force on the end-effector": f"{np.hypot(*total):.2f} N",
            "sum of the drives' forces": f"{np.linalg.norm(force[k], axis=-1).sum():.2f} N",
            "torque that moves nothing": f"{1e3 * np.linalg.norm(antagonism):.1f} mN m",
            "path error": f"{error[k]:.2f} mm",
        }

    def setup(picture):
        draw_workspace(picture, "plane", robot)
        picture.line("plane", *path.x.T, color=NEUTRAL, linewidth=1.2, zorder=2)
        corner = np.array([plane["xlim"][1] - 1.15 * SCALE * UNIT, plane["ylim"][1] - 0.06])  # type: ignore
        picture.arrow("plane", corner, [SCALE * UNIT, 0], 0.009, facecolor=AFTER)
        words = {"ha": "center", "va": "bottom", "fontsize": 10}
        picture.text("plane", corner[0] + SCALE * UNIT / 2, corner[1] + 0.015, f"{UNIT:g} N", **words)
        drive_legend(picture, "torque", robot)

    plane = plane_limits(robot, 0.05) | {"title": "Forces of the drives; black: their sum"}
    time = {"xlabel": TIME, "xlim": (0, 5)}
    panels = {
        "plane": plane,
        "torque": {"title": "Torque", "ylabel": "torque in mN m", **time},
        "error": {"title": "Distance from the path", "ylabel": "path error in mm", **time},
    }
    controls = {
        "time": slider("time in ms", 0, 5000, 40, 400),
        "filter": choice("antagonism filter", LAWS.keys()),
        "offsets": switch("calibration offsets 4, −2, 5 mrad", True),
    }
    layout = [["plane", "torque"], ["plane", "error"]]
    about = "The machine on its way along the triangle; arrows are the forces of the drives on the end-effector."
    return explorer(draw, controls, panels, layout=layout, size=(9.2, 4.8), setup=setup, play="time", about=about)
