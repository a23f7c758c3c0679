"""Explorer of a whole run under PD control: torques, errors and energies beside Table 1."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ..control.laws import PD, AntagonismFilter, CommandFilter
from ..figures.marks import bars, drive_legend, offset_values, per_drive
from ..figures.style import NEUTRAL, arm_line
from ..machine.manipulator import Manipulator, load
from ..mechanics.trajectory import triangle
from ..simulation.experiments import experiment, measured_energies
from ..simulation.runs import simulate
from .controls import choice, log_slider, offset_sliders, switch
from .explorer import Explorer, explorer
from .geometry import TIME, frictionless

LAWS = {"off": lambda law: law, "force form (16)": AntagonismFilter, "command form (17)": CommandFilter}


def decentralized_run(robot: Manipulator | None = None) -> Explorer:
    """The 5 s run under PD: offsets, gains, filter, friction, encoder; torques, errors, energies next to Table 1."""
    robot = frictionless(robot)
    N = robot.n_arms
    friction = robot.friction if np.any(robot.friction) else load().friction[0]
    machines = {on: robot.replace(friction=friction if on else 0.0) for on in (False, True)}
    paths = {"centred triangle": triangle(robot)}
    if robot.same_kinematics(load()):
        paths["reading of Table 1"] = experiment("table1_reading").trajectory
    table = measured_energies() if N == 3 else None
    plain = lru_cache(maxsize=4)(
        lambda path, on, encoder, K_P, K_D, *offset: (
            simulate(machines[on], PD(K_P, K_D), paths[path], np.array(offset), encoder or None).energy
        )
    )

    def draw(picture, K_P, K_D, filter, friction, encoder, path, **offsets):
        offset = offset_values(offsets, N)
        run = simulate(machines[friction], LAWS[filter](PD(K_P, K_D)), paths[path], offset, encoder or None)
        torque, error, energy = 1e3 * run.c, 1e3 * run.error, run.energy
        for i in range(N):
            picture.trace("torque", run.t, torque[:, i], **arm_line(i))
            picture.trace("error", run.t, error[:, i], **arm_line(i))
        picture.fit("torque", torque, least=50.0)
        picture.fit("error", error, least=5.0)
        groups = [(energy, {})]
        if table is not None:
            groups.append((table[int(filter != "off")], {"alpha": 0.4}))
        bars(picture, "energy", groups)
        picture.fit("energy", *(1.15 * v for v, _ in groups), symmetric=False, least=0.5)
        numbers = {"energy": per_drive(energy, 2) + f" J, in all {energy.sum():.2f} J"}
        if filter != "off":
            before = plain(path, friction, encoder, K_P, K_D, *offset).sum()
            numbers["saved by the filter"] = f"{100 * (1 - energy.sum() / before):.0f} % of {before:.2f} J"
        return numbers | {
            "torque at the end": per_drive(torque[-1], 1) + " mN m",
            "largest torque": f"{np.abs(torque).max():.0f} mN m",
            "largest error": f"{np.abs(error).max():.1f} mrad",
        }

    def setup(picture):
        drive_legend(picture, "torque", robot)
        drive_legend(picture, "error", robot)
        wide = {"color": NEUTRAL, "linewidth": 7}
        measured = [("Table 1", wide | {"alpha": 0.4})] if table is not None else []
        picture.legend("energy", [("this run", wide), *measured])

    time, drives = {"xlabel": TIME, "xlim": (0, 5)}, {"xlim": (0.4, N + 0.6), "xticks": range(1, N + 1)}
    panels = {
        "torque": {"ylabel": "torque in mN m", **time},
        "error": {"ylabel": "angle error in mrad", **time},
        "energy": {"xlabel": "drive", "ylabel": "electric energy in J", **drives},
    }
    controls = offset_sliders(robot, (-3.0, -4.0, 7.0))
    counts = [("ideal", 0), *((str(n), n) for n in (500, 2000, 8000))]
    controls |= {
        "K_P": log_slider("K_P in N m/rad", 1.0, 50.0, 7.05),
        "K_D": log_slider("K_D in N m s/rad", 0.02, 1.0, 0.225),
        "filter": choice("antagonism filter", LAWS.keys()),
        "friction": switch("friction", True),
        "encoder": choice("encoder counts per turn", counts),
        "path": choice("path", paths.keys()),
    }
    about = "Torques, angle errors and electric energies of a run of five seconds along the path, with offsets."
    return explorer(draw, controls, panels, widths=[1.15, 1.15, 1], size=(9.4, 3.6), setup=setup, about=about)
