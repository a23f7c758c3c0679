"""Explorers with a simulated PD loop: the steady state under offsets, and the whole run of Table 1."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ..control.laws import PD, AntagonismFilter, CommandFilter
from ..figures.style import NEUTRAL, arm_colour, arm_line
from ..machine.manipulator import Manipulator, load
from ..mechanics import actuation as act
from ..mechanics.antagonism import steady_state_error, steady_state_torque
from ..mechanics.kinematics import inverse_kinematics
from ..mechanics.trajectory import hold, triangle
from ..simulation.experiments import experiment, measured_energies
from ..simulation.runs import simulate
from .builder import Explorer, choice, explorer, log_slider, switch
from .parts import TIME, drive_legend, frictionless, legend, offset_sliders, per_drive

LAWS = {"off": lambda law: law, "force form (16)": AntagonismFilter, "command form (17)": CommandFilter}


def bars(picture, panel: str, groups, width: float = 0.42, form: str = ".2f") -> None:
    """Two or more bars per drive with their numbers; groups are (values per drive, keywords of the bar)."""
    for k, (values, style) in enumerate(groups):
        for i, value in enumerate(values):
            at = i + 1 + (k - (len(groups) - 1) / 2) * width
            picture.bar(panel, at, value, 0.92 * width, facecolor=arm_colour(i), **style)
            picture.text(
                panel,
                at,
                value,
                format(value + 0.0, form).replace("-", "−"),
                ha="center",
                fontsize=9,
                va="bottom" if value >= 0 else "top",
            )


def steady_state(robot: Manipulator | None = None) -> Explorer:
    """Offsets and gains of each drive: the error at rest of theory (14) beside a simulation that settles there."""
    robot = frictionless(robot)
    N = robot.n_arms
    points = {"centre": robot.base.mean(axis=0)}
    points |= {f"towards drive {i + 1}": (points["centre"] + b) / 2 for i, b in enumerate(robot.base)}
    still = lru_cache(maxsize=None)(lambda place: hold(robot, points[place], 1.5, 1e-3))

    def draw(picture, place, **values):
        offset = 1e-3 * np.array([values[f"offset_{i + 1}"] for i in range(N)])
        K_P = np.array([values[f"K_P_{i + 1}"] for i in range(N)])
        # Critical damping for the load that the gains are designed for: K_D^2 = 4 J K_P.
        K_D = 0.225 * np.sqrt(K_P / 7.05)
        A = act.control_matrix(robot, inverse_kinematics(robot, points[place]))
        theory = 1e3 * steady_state_error(A, K_P, offset)
        torque = 1e3 * steady_state_torque(A, K_P, offset)
        run = simulate(robot, PD(K_P, K_D), still(place), offset)
        error = 1e3 * run.error
        for i in range(N):
            picture.trace("error", run.t, error[:, i], **arm_line(i))
            picture.line("error", run.t[[0, -1]], theory[[i, i]], color=arm_colour(i), linewidth=0.9, linestyle=":")
        picture.fit("error", error, theory, least=1.0)
        bars(picture, "rest", [(theory, {"alpha": 0.45}), (error[-1], {})], form=".1f")
        picture.fit("rest", 1.25 * theory, 1.25 * error[-1], least=1.0)
        bars(picture, "torque", [(torque, {})], width=0.6, form=".1f")
        picture.fit("torque", 1.25 * torque, least=10.0)
        for panel in ("rest", "torque"):
            picture.line(panel, [0.4, N + 0.6], [0, 0], color=NEUTRAL, linewidth=0.8, zorder=4)
        return {
            "error at rest, theory": per_drive(theory, 2) + " mrad",
            "simulated": per_drive(error[-1], 2) + " mrad",
            "largest difference": f"{1e3 * np.abs(theory - error[-1]).max():.1f} µrad",
            "rest torque": per_drive(torque, 1) + " mN m",
            "heat at rest": f"{np.sum(robot.resistance * (1e-3 * torque / robot.torque_constant) ** 2):.3f} W",
        }

    def setup(axes):
        drive_legend(axes["error"], robot)
        legend(
            axes["rest"],
            [
                ("theory", {"color": NEUTRAL, "alpha": 0.45, "linewidth": 7}),
                ("simulated", {"color": NEUTRAL, "linewidth": 7}),
            ],
        )

    drives = {"xticks": range(1, N + 1), "xlabel": "drive", "xlim": (0.4, N + 0.6)}
    panels = {
        "error": {"xlabel": TIME, "ylabel": "angle error in mrad", "xlim": (0, 1.5)},
        "rest": {"ylabel": "error at rest in mrad", **drives},
        "torque": {"ylabel": "torque at rest in mN m", **drives},
    }
    controls = offset_sliders(robot, (5.0, -3.0, 8.0))
    controls |= {f"K_P_{i + 1}": log_slider(f"K_P {i + 1} in N m/rad", 1.0, 50.0, 7.05) for i in range(N)}
    controls["place"] = choice("point", points.keys())
    return explorer(draw, controls, panels, widths=[1, 1.25, 1], setup=setup)


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
        offset = 1e-3 * np.array([offsets[f"offset_{i + 1}"] for i in range(N)])
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

    def setup(axes):
        drive_legend(axes["torque"], robot)
        drive_legend(axes["error"], robot)
        measured = [("Table 1", {"color": NEUTRAL, "alpha": 0.4, "linewidth": 7})] if table is not None else []
        legend(axes["energy"], [("this run", {"color": NEUTRAL, "linewidth": 7}), *measured])

    panels = {
        "torque": {"xlabel": TIME, "ylabel": "torque in mN m", "xlim": (0, 5)},
        "error": {"xlabel": TIME, "ylabel": "angle error in mrad", "xlim": (0, 5)},
        "energy": {
            "xlabel": "drive",
            "ylabel": "electric energy in J",
            "xlim": (0.4, N + 0.6),
            "xticks": range(1, N + 1),
        },
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
    return explorer(draw, controls, panels, widths=[1.15, 1.15, 1], setup=setup)
