"""Explorer of computed torque control: fixed pair, switched pair, redundant coordinates."""

from __future__ import annotations

from functools import lru_cache, partial

import numpy as np
from scipy.spatial.distance import cdist

from ..control.computed_torque import CTC, RedundantCTC, SwitchedCTC
from ..control.stability import feedback_norm
from ..figures.maps import pair_line, pair_name
from ..figures.marks import draw_workspace, offset_values, pair_lines, per_drive, singular_curves, workspace_outline
from ..figures.style import AFTER, NEUTRAL
from ..machine.manipulator import Manipulator
from ..mechanics import actuation as act
from ..simulation.runs import simulate
from . import shared
from .controls import choice, offset_sliders, slider
from .explorer import Explorer, explorer


def feedback_along(robot: Manipulator, law, q) -> np.ndarray:
    """Norm of the feedback map of a law with a pair along a path q (k, 2N), N m per rad/s^2, (k,)."""
    if not isinstance(law, SwitchedCTC):
        return feedback_norm(robot, q, law.independent)
    chosen, norm = law.pairs(robot, q), np.empty(len(q))
    for pair in {tuple(p) for p in chosen.tolist()}:
        k = np.all(chosen == pair, axis=-1)
        norm[k] = feedback_norm(robot, q[k], pair)
    return norm


@shared.ready_made
def computed_torque(robot: Manipulator) -> Explorer:
    """Computed torque with a fixed pair, a switched pair or redundant coordinates, near the singular curves.

    >>> from rapkm_lite import explore; explore.computed_torque().numbers["largest feedback map"]
    '0.0476 N m s²/rad'
    """
    pairs, width, heavier = act.drive_pairs(robot), shared.size(robot), shared.heavier(robot)
    heat = shared.hotter(robot, heavier)
    singular = singular_curves(robot)
    fixed = {f"fixed pair {pair_name(p)}": p for p in pairs}
    laws = {word: partial(CTC, independent=pair) for word, pair in fixed.items()}
    laws |= {"switched pair": SwitchedCTC, "redundant coordinates": RedundantCTC}
    # Only two, whose memory the next one takes: fresh memory costs as much as the numbers.
    path = lru_cache(maxsize=2)(partial(shared.central_triangle, robot))
    coarse = lru_cache(maxsize=64)(lambda side: path(side)[::10])

    @lru_cache(maxsize=64)
    def distance(law: str, side: int) -> str:
        """How near the path comes to the points on which the pair is singular."""
        if np.ptp(np.sign(act.distal_cross_products(robot, coarse(side).q)[:, pairs.index(fixed[law])])):
            return "crossed"
        pieces = np.concatenate([np.stack([line[:-1], line[1:]]) for line in singular[fixed[law]]], axis=1)
        apart = cdist(coarse(side).x, pieces[0])
        # The points of a line are as far apart as those of a grid: twenty on each piece that may be the nearest.
        room = apart.min() + np.linalg.norm(pieces[1] - pieces[0], axis=-1).max()
        start, end = pieces[:, apart.min(axis=0) <= room]
        near = coarse(side).x[apart.min(axis=1) <= room]
        gap = cdist(near, np.linspace(start, end, 20).reshape(-1, 2)).min()
        return f"{float(f'{1e3 * gap:.2g}'):g} mm"

    # The redundant law has no peaks, so that fewer places show it.
    redundant = lru_cache(maxsize=64)(lambda side: feedback_norm(robot, coarse(side).q[::5]))
    norms = lru_cache(maxsize=64)(lambda word, side: feedback_along(robot, laws[word](1.0, 2.0), coarse(side).q))

    def draw(picture, law, side, rate, **offsets):
        t = coarse(side)
        picture.line("plane", *t.x.T, color=AFTER, linewidth=2, zorder=3)
        numbers = {}
        if law in fixed:
            for line in singular[fixed[law]]:
                picture.line("plane", *line.T, color=pair_line(robot, fixed[law])["color"], linewidth=4, alpha=0.35)
            if singular[fixed[law]]:
                numbers["distance from its singular curve"] = distance(law, side)
        times, other = path(side).t[::10], redundant(side)
        at, norm = (times[::5], other) if law == "redundant coordinates" else (times, norms(law, side))
        picture.line("map", times[::5], other, color=NEUTRAL, linewidth=1.2, linestyle="--")
        picture.line("map", at, np.minimum(norm, 1e6 * heavier), color=AFTER)
        numbers["largest feedback map"] = f"{norm.max():.3g} N m s²/rad"
        # Two equal real poles at -rate.
        run = simulate(robot, laws[law](rate**2, 2.0 * rate), path(side), offset_values(offsets, robot.n_arms))
        torque, error, energy = 1e3 * run.c, 1e3 * run.error, run.energy
        largest = np.abs(torque).max()
        # What a failing law does leaves the picture, so that what a working one does stays seen.
        most = 1000.0
        if largest > 0.9 * most:
            some = path(side)[::50]
            most = max(most, 1.5e3 * float(np.abs(act.inverse_dynamics(robot, some.q, some.qd, some.qdd)).max()))
        shared.curves(picture, "torque", run.t, torque, shared.least_torque(robot, 50.0), most=most)
        shared.curves(picture, "error", run.t, error, 5.0, most=100.0)
        if run.switches:
            numbers["switches"] = str(run.switches)
        return numbers | {
            "largest torque": per_drive([largest], 0, heavier) + " mN m",
            "largest error": f"{np.abs(error).max():.1f} mrad",
            "energy": f"{per_drive(energy, 2, heat)} J, in all {per_drive([energy.sum()], 2, heat)} J",
        }

    def setup(picture):
        draw_workspace(picture, "plane", robot)
        for pair, lines in singular.items():
            for line in lines:
                picture.line("plane", *line.T, linewidth=1.0, **pair_line(robot, pair))

    low, high = robot.base.min(axis=0) - [0, 0.06 * width], robot.base.max(axis=0) + [0, 0.02 * width]
    reach = workspace_outline(robot)
    low, high = (f(np.vstack([end, reach]), axis=0) for f, end in ((np.nanmin, low), (np.nanmax, high)))
    plane = {"xlabel": "x in m", "ylabel": "y in m", "aspect": "equal", "legend": pair_lines(robot)}
    both = [("this law", {"color": AFTER}), ("redundant", {"color": NEUTRAL, "linestyle": "--"})]
    feedback = {"title": "Feedback", "yscale": "log", "ylim": (1e-3 * heavier, 1e2 * heavier), "legend": both}
    panels = {
        "plane": plane | {"xlim": (low[0], high[0]), "ylim": (low[1], high[1])},
        "map": shared.over_time("norm in N m s²/rad", **feedback),
        "torque": shared.over_time("torque in mN m", robot=robot, title="Torque"),
        "error": shared.over_time("angle error in mrad", robot=robot, title="Error"),
    }
    controls = {
        "law": choice("law", laws),
        "side": shared.path_slider(robot, "side of the triangle in mm", 100, 300, 5, 170),
        "rate": slider("size of both poles in 1/s", 10, 80, 2, 40),
    } | offset_sliders(robot, (1.0, -1.0, 0.5), 10)
    layout = [["plane", "map"], ["torque", "error"]]
    return explorer(draw, controls, panels, layout=layout, size=(9.2, 6.2), setup=setup)
