"""Explorer of computed torque control: fixed pair, switched pair, redundant coordinates."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ..control.computed_torque import CTC, RedundantCTC, SwitchedCTC
from ..control.stability import feedback_norm
from ..figures.machine import plot_workspace
from ..figures.maps import grid_points, on_grid, pair_line, pair_name
from ..figures.style import AFTER, NEUTRAL, arm_line
from ..machine.manipulator import Manipulator
from ..mechanics import actuation as act
from ..mechanics.kinematics import inverse_kinematics
from ..mechanics.trajectory import triangle
from ..simulation.runs import simulate
from .builder import Explorer, choice, explorer, slider
from .geometry import pair_legend
from .parts import TIME, drive_legend, frictionless, legend, offset_sliders, per_drive


def feedback_along(robot: Manipulator, law, t) -> np.ndarray:
    """Norm of the feedback map of a law along a path, N m per rad/s^2, (k,)."""
    if isinstance(law, RedundantCTC):
        return feedback_norm(robot, t.q)
    chosen = law.pairs(robot, t.q) if isinstance(law, SwitchedCTC) else np.tile(law.independent, (len(t), 1))
    norm = np.empty(len(t))
    for pair in {tuple(p) for p in chosen.tolist()}:
        k = np.all(chosen == pair, axis=-1)
        norm[k] = feedback_norm(robot, t.q[k], pair)
    return norm


def distance(points, curve) -> float:
    """Smallest distance in m between points (k, 2) and points (j, 2)."""
    return float(np.linalg.norm(points[:, None] - curve[None], axis=-1).min())


def singular_curves(robot: Manipulator) -> dict:
    """For each pair the lines, each (j, 2) in m, on which its distal links are parallel."""
    from contourpy import contour_generator

    x, y, inside, points = grid_points(robot, 161)
    values = on_grid(inside, act.distal_cross_products(robot, inverse_kinematics(robot, points)))
    return {pair: contour_generator(x, y, values[..., i]).lines(0.0) for i, pair in enumerate(act.drive_pairs(robot))}


def computed_torque(robot: Manipulator | None = None) -> Explorer:
    """Computed torque with a fixed pair, a switched pair or redundant coordinates, near the singular curves."""
    robot = frictionless(robot)
    N = robot.n_arms
    pairs = act.drive_pairs(robot)
    curves = singular_curves(robot)
    fixed = {f"fixed pair {pair_name(p)}": p for p in pairs}
    words = [*fixed, "switched pair", "redundant coordinates"]
    path = lru_cache(maxsize=8)(lambda side: triangle(robot, 1e-3 * side))
    coarse = lru_cache(maxsize=8)(lambda side: triangle(robot, 1e-3 * side, dt=0.01))

    def law_of(word, rate):
        # Two equal real poles at -rate.
        gains = rate**2, 2.0 * rate
        if word in fixed:
            return CTC(*gains, fixed[word])
        return SwitchedCTC(*gains) if word == "switched pair" else RedundantCTC(*gains)

    norms = lru_cache(maxsize=64)(lambda word, side: feedback_along(robot, law_of(word, 1.0), coarse(side)))

    def draw(picture, law, side, rate, **offsets):
        t = coarse(side)
        picture.line("plane", *t.x.T, color=AFTER, linewidth=2, zorder=3)
        numbers = {}
        if law in fixed:
            curve = curves[fixed[law]]
            for line in curve:
                picture.line("plane", *line.T, color=pair_line(robot, fixed[law])["color"], linewidth=4, alpha=0.35)
            if curve:
                gap = distance(t.x, np.concatenate(curve))
                numbers["distance from its singular curve"] = "crossed" if gap < 2e-3 else f"{1e3 * gap:.0f} mm"
        norm = norms(law, side)
        picture.line("map", t.t, norms("redundant coordinates", side), color=NEUTRAL, linewidth=1.2, linestyle="--")
        picture.line("map", t.t, np.minimum(norm, 1e6), color=AFTER)
        numbers["largest feedback map"] = f"{norm.max():.3g} N m s²/rad"
        offset = 1e-3 * np.array([offsets[f"offset_{i + 1}"] for i in range(N)])
        run = simulate(robot, law_of(law, rate), path(side), offset)
        torque, error = 1e3 * run.c, 1e3 * run.error
        for i in range(N):
            picture.trace("torque", run.t, torque[:, i], **arm_line(i))
            picture.trace("error", run.t, error[:, i], **arm_line(i))
        picture.fit("torque", torque, least=50.0)
        picture.fit("error", error, least=5.0)
        if run.switches:
            numbers["switches"] = str(run.switches)
        return numbers | {
            "largest torque": f"{np.abs(torque).max():.0f} mN m",
            "largest error": f"{np.abs(error).max():.1f} mrad",
            "energy": per_drive(run.energy, 2) + f" J, in all {run.energy.sum():.2f} J",
        }

    def setup(axes):
        plot_workspace(robot, axes["plane"])
        axes["plane"].set(**plane)
        for pair, lines in curves.items():
            for line in lines:
                axes["plane"].plot(*line.T, linewidth=1.0, **pair_line(robot, pair))
        pair_legend(axes["plane"], robot)
        axes["map"].set_yscale("log")
        axes["map"].set_ylim(1e-3, 1e2)
        legend(axes["map"], [("this law", {"color": AFTER}), ("redundant", {"color": NEUTRAL, "linestyle": "--"})])
        drive_legend(axes["torque"], robot)
        drive_legend(axes["error"], robot)

    reach = robot.base
    plane = {
        "xlabel": "x in m",
        "ylabel": "y in m",
        "aspect": "equal",
        "xlim": (reach[:, 0].min(), reach[:, 0].max()),
        "ylim": (reach[:, 1].min() - 0.06, reach[:, 1].max() + 0.02),
        "title": " ",
    }
    time = {"xlabel": TIME, "xlim": (0, 5)}
    panels = {
        "plane": plane,
        "map": {"title": "Feedback", "ylabel": "norm in N m s²/rad", **time},
        "torque": {"title": "Torque", "ylabel": "torque in mN m", **time},
        "error": {"title": "Error", "ylabel": "angle error in mrad", **time},
    }
    controls = {
        "law": choice("law", words),
        "side": slider("side of the triangle in mm", 100, 300, 5, 170),
        "rate": slider("poles at −1/s times", 10, 80, 2, 40),
    } | offset_sliders(robot, (1.0, -1.0, 0.5), 10)
    return explorer(
        draw, controls, panels, layout=[["plane", "map"], ["torque", "error"]], size=(9.2, 6.2), setup=setup
    )
