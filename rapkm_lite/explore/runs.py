"""Explorers of whole runs under PD control: energies beside Table 1, a player, via points and late drives."""

from __future__ import annotations

from contextlib import suppress
from functools import lru_cache

import numpy as np

from ..control.laws import PD, AntagonismFilter, CommandFilter
from ..figures import marks
from ..figures.machine import plane_limits
from ..figures.style import AFTER, ALARM, NEUTRAL, arm_colour, arm_line
from ..lessons.lesson07.tasks import set_points
from ..machine.manipulator import Manipulator, load
from ..mechanics import actuation as act
from ..mechanics.trajectory import polygon
from ..simulation.energy import antagonistic_torque, copper_loss
from ..simulation.experiments import experiment, measured_energies
from ..simulation.runs import SimulationError, simulate
from . import shared
from .controls import choice, log_slider, offset_sliders, slider, switch
from .explorer import Explorer, explorer

LAWS = {"off": lambda law: law, "force form (16)": AntagonismFilter, "command form (17)": CommandFilter}


@shared.ready_made
def decentralized_run(robot: Manipulator) -> Explorer:
    """The 5 s run under PD: offsets, gains, filter, friction, encoder; torques, errors, energies (Table 1: testbed).

    >>> from rapkm_lite import explore
    >>> explore.decentralized_run().set(filter="force form (16)").numbers["largest torque"]
    '37 mN m'
    """
    N, damping, heavier = robot.n_arms, shared.usual_gains(robot)[1], shared.heavier(robot)
    heat = shared.hotter(robot, heavier)
    friction = robot.friction if np.any(robot.friction) else damping / 0.225 * load().friction[0]
    machines = {on: robot.replace(friction=friction if on else 0.0) for on in (False, True)}
    paths, table = {"centred triangle": shared.fitting_triangle(robot)}, None
    if robot.replace(friction=0.0) == load().replace(friction=0.0):
        paths["reading of Table 1"], table = experiment("table1_reading").trajectory, measured_energies()

    def draw(picture, K_P, K_D, filter, friction, encoder, path, **offsets):
        offset = marks.offset_values(offsets, N)
        run = simulate(machines[friction], LAWS[filter](PD(K_P, K_D)), paths[path], offset, encoder or None)
        torque, error, energy = 1e3 * run.c, 1e3 * run.error, run.energy
        shared.curves(picture, "torque", run.t, torque, shared.least_torque(robot, 50.0))
        shared.curves(picture, "error", run.t, error, 5.0)
        groups = [(energy, {})]
        if table is not None:
            groups.append((table[int(filter != "off")], {"alpha": 0.4}))
        marks.bars(picture, "energy", groups, times=heat)
        picture.fit("energy", *(1.15 * v for v, _ in groups), symmetric=False, least=min(0.5, heat))
        numbers = {"energy": f"{marks.per_drive(energy, 2, heat)} J, in all {marks.told(energy.sum(), 2, heat)} J"}
        if filter != "off":
            before = simulate(machines[friction], PD(K_P, K_D), paths[path], offset, encoder or None).energy.sum()
            saved = 100 * (1 - energy.sum() / before)
            numbers["saved by the filter"] = f"{saved:.0f} % of {marks.told(before, 2, heat)} J"
        return numbers | {
            "torque at the end": marks.per_drive(torque[-1], 1, heavier) + " mN m",
            "largest torque": marks.told(np.abs(torque).max(), 0, heavier) + " mN m",
            "largest error": f"{np.abs(error).max():.1f} mrad",
        }

    wide = {"color": NEUTRAL, "linewidth": 7}
    both = [("this run", wide), ("Table 1", wide | {"alpha": 0.4})][: 1 if table is None else 2]
    panels = {
        "torque": shared.over_time("torque in mN m", robot=robot),
        "error": shared.over_time("angle error in mrad", robot=robot),
        "energy": {"ylabel": "electric energy in J", "legend": both, **marks.drive_axis(N)},
    }
    counts = [("ideal", 0), *((str(n), n) for n in (500, 2000, 8000))]
    controls = offset_sliders(robot, (-3.0, -4.0, 7.0)) | {
        "K_P": shared.gain_slider(robot),
        "K_D": log_slider("K_D in N m s/rad", damping / 0.225 * 0.02, damping / 0.225, damping),
        "filter": choice("antagonism filter", LAWS.keys()),
        "friction": switch("friction", True),
        "encoder": choice("encoder counts per turn", counts),
        "path": choice("path", paths.keys()),
    }
    return explorer(draw, controls, panels, layout=[["torque", "energy"], ["error", "energy"]], size=(9.4, 4.6))


@shared.ready_made
def animation(robot: Manipulator) -> Explorer:
    """The machine moves along the triangle; arrows are the forces of the drives at the end-effector.

    >>> from rapkm_lite import explore
    >>> explore.animation().set(filter="force form (16)").numbers["torque that moves nothing"]
    '0.1 mN m'
    """
    N, heavier = robot.n_arms, shared.heavier(robot)
    path, times = shared.fitting_triangle(robot), shared.size(robot)
    some = 1e-3 * np.resize([4.0, -2.0, 5.0], N)
    said = ", ".join(f"{v:.0f}" for v in 1e3 * some).replace("-", "−")

    @lru_cache(maxsize=8)
    def recorded(filter: str, offsets: bool):
        run = simulate(robot, LAWS[filter](PD(*shared.usual_gains(robot))), path, offsets * some)
        A = act.control_matrix(robot, run.q)
        return run, A * run.c[..., None], np.linalg.norm(1e3 * (run.x - path.x), axis=-1)

    # Newtons of the arrow that shows the scale, metres of arrow for 1 N; forces of equal torques go with one over the
    # length, and weight may need more, or light arms less.
    unit, largest = 0.25 / times, 0.0
    with suppress(SimulationError):
        largest = np.linalg.norm(recorded("off", True)[1], axis=-1).max()
    if largest > 4 * unit or 0.0 < largest < 0.4 * unit:
        unit = 2 * shared.rounded(largest / 4)
    scale, wide, light = 0.1 * times / unit, 0.014 * times, heavier / times
    least = {"torque": shared.least_torque(robot, 0.5), "error": 0.5 * times}

    def draw(picture, time, filter, offsets):
        run, force, error = recorded(filter, offsets)
        k = min(round(1e-3 * time / run.dt), len(run.t) - 1)
        marks.draw_machine(picture, "plane", robot, run.q[k])
        total = force[k].sum(axis=0)
        for vector, colour in [*zip(force[k], map(arm_colour, range(N)), strict=True), (total, AFTER)]:
            picture.arrow("plane", run.x[k], scale * vector, wide, facecolor=colour, edgecolor="white", zorder=6)
        picture.handle("plane", *run.x[k], along=path.x[::25], time=1e3 * path.t[::25])
        for panel, values in (("torque", 1e3 * run.c), ("error", error[:, None])):
            for i, column in enumerate(values.T):
                style = arm_line(i) if panel == "torque" else {"color": AFTER}
                picture.trace(panel, run.t, column, **style)
                picture.line(panel, run.t[k], column[k], marker="o", markersize=6, color=style["color"], zorder=5)
            picture.fit(panel, values, symmetric=panel == "torque", least=least[panel])
            picture.line(panel, run.t[[k, k]], picture.ylim(panel), color=NEUTRAL, linewidth=0.9, zorder=1)
            picture.handle(panel, run.t[k], None, time=(1e3, 0))
        antagonism = act.prestress_projector(act.control_matrix(robot, run.q[k])) @ run.c[k]
        return {
            "time": f"{run.t[k]:.2f} s",
            "force on the end-effector": marks.told(np.hypot(*total), 2, light) + " N",
            "sizes of the drives' forces, added": marks.told(np.linalg.norm(force[k], axis=-1).sum(), 2, light) + " N",
            "torque that moves nothing": marks.told(1e3 * float(np.linalg.norm(antagonism)), 1, heavier) + " mN m",
            "path error": f"{error[k]:.2f} mm",
        }

    def setup(picture):
        marks.draw_workspace(picture, "plane", robot)
        picture.line("plane", *path.x.T, color=NEUTRAL, linewidth=1.2, zorder=2)
        low, high = picture.ylim("plane")
        down = max(0.06 * times, 0.065 * (high - low))  # where drives are far from the workspace, words need more room
        corner = np.array([picture.xlim("plane")[1] - 1.15 * scale * unit, high - down])
        picture.arrow("plane", corner, [scale * unit, 0], wide, facecolor=AFTER)
        words = {"ha": "right", "va": "bottom", "fontsize": 10}
        picture.text("plane", corner[0] + scale * unit, corner[1] + 0.015 * times, f"{unit:g} N", **words)

    panels = {
        "plane": plane_limits(robot, 0.05) | {"title": "Forces of the drives, and their sum"},
        "torque": shared.over_time("torque in mN m", robot=robot, title="Torque"),
        "error": shared.over_time("path error in mm", title="Distance from the desired position"),
    }
    controls = {
        "time": slider("time in ms", 0, 5000, 40, 400),
        "filter": choice("antagonism filter", LAWS.keys()),
        "offsets": switch(f"calibration offsets {said} mrad", True),
    }
    layout = [["plane", "torque"], ["plane", "error"]]
    return explorer(draw, controls, panels, layout=layout, size=(9.2, 4.8), setup=setup, play="time")


@shared.ready_made
def via_points(robot: Manipulator) -> Explorer:
    """Via points on an edge, a late drive 1, the filter: the place of the end-effector, and torques that only press.

    >>> from rapkm_lite import explore
    >>> explore.via_points().set(filter=True).numbers["largest torque that only presses"]
    '0.0 mN m'
    """
    # The lower edge of the triangle of `fitting_triangle`, or as much of it as all arms reach.
    wide = shared.size(robot) / (1.0 if robot.n_arms > 2 else 1.5)
    line, (middle, room) = wide * np.array([[-0.12, -0.07], [0.12, -0.07]]), shared.place(robot)
    ends = middle + min(1.0, room / (0.16 * wide)) * line
    path = polygon(robot, ends, duration=3.0, dt=2e-3)
    edge, heavier = 1e3 * np.linalg.norm(ends[1] - ends[0]), shared.heavier(robot)
    heat = shared.hotter(robot, heavier)
    way = 1e3 * np.linalg.norm(path.x - ends[0], axis=-1)[: len(path) // 2 + 1]  # there, not back
    axes = [("along x", {"color": ALARM}), ("along y", {"color": ALARM, "linestyle": (0, (5, 1.2))})]

    def draw(picture, legs, late, filter):
        q_a = set_points(robot, path, ends[0], ends[1], np.linspace(0, 1, legs + 1))
        q_a[:, 0] = q_a[np.maximum(np.arange(len(q_a)) - late // 2, 0), 0]
        law = PD(*shared.usual_gains(robot))
        done = simulate(robot, AntagonismFilter(law) if filter else law, path.with_set_points(q_a))
        null = antagonistic_torque(done)
        off = 1e3 * (done.x - path.x)[: len(way)]
        pressing = 1e3 * null
        for values, (_, look) in zip(off.T, axes, strict=True):
            picture.trace("way", way, values, **look)
        picture.fit("way", off, least=shared.size(robot))
        shared.curves(picture, "torque", done.t, pressing, shared.least_torque(robot, 5.0))
        energy = marks.told(done.energy.sum(), 2, heat)
        lost = marks.told(copper_loss(robot, null[:-1], done.dt).sum(), 3, heat)
        return {
            "largest torque that only presses": marks.told(np.abs(pressing).max(), 1, heavier) + " mN m",
            "farthest from the desired position": f"{np.linalg.norm(off, axis=-1).max():.2f} mm",
            "electric energy": shared.with_antagonism(robot, energy, lost),
            "at the end": marks.per_drive(pressing[-1], 1, heavier) + " mN m",
        }

    along = {"xlabel": "way along the edge in mm", "ylabel": "true − desired position in mm", "xlim": (0, edge)}
    torque = shared.over_time("torque that only presses in mN m", 3.0, robot)
    counts = [(f"{edge / legs:.4g} mm", legs) for legs in (1, 2, 4, 8, 16, 32, 64)]
    controls = {
        "legs": choice("distance of the via points", counts, 8),
        "late": slider("drive 1 late in ms", 0, 10, 2, 0),
        "filter": switch("antagonism filter"),
    }
    return explorer(draw, controls, {"way": along | {"legend": axes}, "torque": torque}, size=(9.2, 3.8))
