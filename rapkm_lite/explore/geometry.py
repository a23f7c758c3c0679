"""Explorers without a simulation: the machine, the degree of actuation along a path, prestress."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache, partial

import numpy as np
from scipy.ndimage import distance_transform_edt

from ..figures import marks
from ..figures.machine import arm_points, plane_limits
from ..figures.maps import grid_points, mode_name, on_grid, pair_line, pair_measures, pair_name, touching_arcs
from ..figures.style import AFTER, ALARM, NEUTRAL, arm_colour
from ..machine.arguments import matvec
from ..machine.manipulator import Manipulator
from ..mechanics import actuation as act
from ..mechanics.antagonism import null_vector
from ..mechanics.kinematics import cross, inverse_kinematics, working_modes
from ..mechanics.trajectory import circle
from ..simulation.energy import copper_loss
from . import shared
from .controls import choice, slider
from .explorer import Explorer, explorer

# Smallest singular value, in rad/m on the testbed, below which a number is marked; its centroid has 6.5.
WEAK = 1.5
# Steps of the map on which the arms stand out; weak is far from the colour of the paper.
MAP = marks.Palette(
    (0.0, 0.5, 1.5, 2.5, 3.5, 4.5, 5.5, 6.5),
    ("#8C8C8C", "#ADADAD", "#C6C6C4", "#DADAD2", "#E8E8DC", "#F4F3E4", "#FCFBEE"),
    ("#8A8A94", "#70707C", "#5A5A66", "#474752", "#383842", "#2B2B33", "#202026"),
)


@shared.ready_made
def machine(robot: Manipulator) -> Explorer:
    """The end-effector by hand in every working mode, a map of sigma_min, and the five-bars of up to six pairs.

    >>> from rapkm_lite import explore; explore.machine().numbers["degree of actuation"]
    '2 of 2 (redundantly actuated)'
    """
    # A goes with one over the lengths.
    times = shared.size(robot)
    digits = shared.decimals(times)
    palette = replace(MAP, levels=tuple(v / times for v in MAP.levels))
    pairs = act.drive_pairs(robot)
    small = "abcdef"[: len(pairs)]
    modes = {mode_name(m): m for m in working_modes(robot)}
    which = {"all drives": None} | {f"pair {pair_name(p)}": p for p in pairs}
    gx, gy, inside, points = grid_points(robot, 121)
    # An image ends where its last pixels end, half a step beyond their centres.
    extent = tuple(end + way * (g[1] - g[0]) / 2 for g in (gx, gy) for end, way in ((g[0], -1), (g[-1], 1)))
    outline = marks.workspace_outline(robot)
    # A row of A belongs to one arm, bent this way or that, whatever the others do.
    one, other = (
        act.control_matrix(robot, inverse_kinematics(robot, points, np.full(robot.n_arms, way))) for way in (1, -1)
    )
    # Outside, where the map is cut off, the value of the nearest point inside.
    nearest = tuple(np.asarray(distance_transform_edt(~inside, return_distances=False, return_indices=True)))

    def matrices(mode: str) -> np.ndarray:
        return np.where(np.asarray(modes[mode])[:, None] > 0, one, other)

    @lru_cache(maxsize=64)
    def sigma_map(mode: str, drives: str) -> np.ndarray:
        rows = list(which[drives] or range(robot.n_arms))
        return on_grid(inside, act.singular_values(matrices(mode)[:, rows])[:, 1])[nearest].filled(0.0)

    @lru_cache(maxsize=64)
    def curves(mode: str, pair: tuple) -> list[np.ndarray]:
        one, other = (matrices(mode)[:, i] for i in pair)
        return marks.zero_lines(gx, gy, inside, cross(one, other)) + touching_arcs(robot, pair, modes[mode])

    def draw(picture, x, y, mode, drives):
        picture.image("machine", sigma_map(mode, drives), extent, palette, clip=outline)
        picture.polygon("machine", outline, fill=False, edgecolor=NEUTRAL, linewidth=0.8)
        picture.title("machine", f"Map of σ_min, {drives}", fontweight="bold")
        point, q, stop = shared.held_machine(picture, "machine", robot, x, y, modes[mode])
        for curve in curves(mode, which[drives]) if which[drives] else ():
            picture.line("machine", *curve.T, color="#FFFFFF", linewidth=5, zorder=1.9)
            picture.line("machine", *curve.T, **pair_line(robot, which[drives]) | {"linewidth": 2.2}, zorder=2)
        A = act.control_matrix(robot, q)
        numbers = {
            "end-effector": marks.in_mm(point, 2e-3 * times),
            "degree of actuation": f"{act.degree_of_actuation(robot, q)} of 2 ({act.actuation_type(robot, q)})",
            "σ_min of all drives": f"{act.singular_values(A)[1]:.{digits}f} rad/m",
        }
        chains = arm_points(robot, q)
        from_parallel = np.degrees(np.arcsin(np.minimum(np.abs(act.distal_cross_products(robot, q)), 1.0)))
        for pair, name, value, angle in zip(pairs, small, pair_measures(robot, q), from_parallel, strict=False):
            weak = value < WEAK / times
            # The distal links that lie almost along each other are what makes a pair weak.
            for i in pair if weak else ():
                picture.line(name, *chains[i, 1:].T, color=ALARM, linewidth=11, alpha=0.35, zorder=2.5)
            marks.draw_machine(picture, name, robot, q, arms=pair, names=False)
            words = f"{pair_name(pair)}: {value:.{digits}f} rad/m" + f",\n{angle:.0f}° from parallel" * bool(weak)
            look = {"fontweight": "bold", "color": ALARM} if weak else {"fontweight": "normal", "color": AFTER}
            picture.title(name, words, fontsize=10, **look)
            numbers[f"σ_min of {pair_name(pair)}"] = f"{value:.{digits}f} rad/m"
        return numbers | stop

    plane = plane_limits(robot, 0.05)
    bare = {k: plane[k] for k in ("aspect", "xlim", "ylim")} | {"xticks": [], "yticks": [], "title": " ", "small": True}
    panels = {"machine": plane | {"title": "Machine and map of σ_min"}} | dict.fromkeys(small, bare)
    controls = shared.place_sliders(robot, 20, 30) | {
        "mode": choice("working mode", modes, mode_name(robot.mode)),
        "drives": choice("map for", which.keys(), list(which)[-1]),
    }
    layout = [["machine", *small[k::3]] for k in range(len(small[:3]))]
    widths, size = ([2.7, 1, 1], (9.6, 5.0)) if len(small) > 3 else ([2.7, 1], (8.2, 5.0))
    scale = partial(marks.Picture.scale, panel="machine", palette=palette, label="σ_min in rad/m (top class open)")
    return explorer(draw, controls, panels, layout=layout, widths=widths, size=size, setup=scale, live=True)


@shared.ready_made
def actuation(robot: Manipulator) -> Explorer:
    """A walk along the path: sigma_min of each pair, the null vector of A^T, and the forces the drives can produce.

    >>> from rapkm_lite import explore; explore.actuation().numbers["σ_min of all drives"]
    '4.62 rad/m'
    """
    pairs, digits = act.drive_pairs(robot), shared.decimals(shared.size(robot))
    name, shown, low, about = "Null vector", "component", -1.05, ""
    if robot.n_arms != 3:
        name, shown, low = "Null space", "share of each drive", 0.0
        about = "A walk along the path: sigma_min of each pair, the null space of A^T, and the forces of the drives."

    @lru_cache(maxsize=8)
    def along(path: str, size: int):
        if path == "triangle":
            t = shared.central_triangle(robot, size, dt=0.01)
        else:
            t = circle(robot, 5e-4 * size, dt=0.01, centre=shared.place(robot)[0])
        A = act.control_matrix(robot, t.q)
        # Without a single null vector: how much of each drive's torque the projector onto the null space keeps.
        share = np.diagonal(act.prestress_projector(A), axis1=-2, axis2=-1)
        null = null_vector(robot, t.q) if robot.n_arms == 3 else np.sqrt(np.maximum(share, 0.0))
        return t, A, pair_measures(robot, t.q), null

    def draw(picture, place, path, size, torque):
        t, A, sigma, null = along(path, size)
        k = round(place / 100 * (len(t) - 1))
        share = np.linspace(0, 100, len(t))
        picture.line("plane", *t.x.T, color=NEUTRAL, linewidth=1.2, zorder=2)
        marks.draw_machine(picture, "plane", robot, t.q[k])
        picture.handle("plane", *t.x[k], along=t.x[::2], place=share[::2])
        picture.fit("sigma", sigma, symmetric=False, least=4 / shared.size(robot))
        for i, pair in enumerate(pairs):
            style = pair_line(robot, pair)
            picture.line("sigma", share, sigma[:, i], **style)
            picture.line("sigma", place, sigma[k, i], marker="o", markersize=6, color=style["color"], zorder=4)
            corners = act.force_polygon(A[k][list(pair)], 1e-3 * torque)
            edge = {"edgecolor": style["color"], "linestyle": style["linestyle"]}
            picture.polygon("force", corners, fill=False, linewidth=1.5, **edge)
        marks.traces(picture, "null", share, null)
        for i in range(robot.n_arms):
            picture.line("null", place, null[k, i], marker="o", markersize=6, color=arm_colour(i), zorder=4)
        for panel in ("sigma", "null"):
            picture.line(panel, [place, place], picture.ylim(panel), color=NEUTRAL, linewidth=0.8, zorder=1)
            picture.handle(panel, place, None, place=(1, 0))
        picture.fit("force", shared.draw_forces(picture, A[k], torque))
        picture.limits("force", x=picture.ylim("force"))
        worst = np.unravel_index(np.argmin(sigma), sigma.shape)
        return {
            "point": marks.in_mm(t.x[k], 2e-3 * shared.size(robot)),
            "σ_min of all drives": f"{act.singular_values(A[k])[1]:.{digits}f} rad/m",
            "σ_min of the pairs": marks.per_drive(sigma[k], digits) + " rad/m",
            "worst on this path": f"{sigma[worst]:.{digits + 1}f} rad/m, pair {pair_name(pairs[worst[1]])}",
            name[0].lower() + name[1:]: marks.per_drive(null[k], 2),
        }

    drives, whole = marks.drive_lines(robot), [("all drives", {"color": AFTER})]
    way = {"xlabel": "place on the path in %", "xlim": (0, 100)}
    measures = {"title": "Pairs", "ylabel": "σ_min in rad/m", "legend": marks.pair_lines(robot)}
    panels = {
        "plane": plane_limits(robot, 0.05) | {"title": "Machine"},
        "sigma": way | measures | {"ylim": (0, 8 / shared.size(robot))},
        "null": way | {"title": name, "ylabel": shown, "ylim": (low, 1.05), "legend": drives},
        "force": shared.force_panel(2 / shared.size(robot)) | {"title": "Forces", "legend": whole},
    }
    controls = {
        "place": slider("place on the path in %", 0.0, 100.0, 0.5, 12.0),
        "path": choice("path", ["triangle", "circle"]),
        "size": shared.path_slider(robot, "side or diameter in mm", 40, 320, 5, 240),
        "torque": slider("torque limit in mN m", 20, 200, 5, 85),
    }
    layout = [["plane", "sigma"], ["force", "null"]]
    space = partial(marks.draw_workspace, panel="plane", robot=robot)
    look = {"layout": layout, "widths": [1, 1.35], "size": (9.2, 6.6)}
    return explorer(draw, controls, panels, **look, setup=space, live=True, about=about)


@shared.ready_made
def prestress(robot: Manipulator) -> Explorer:
    """Prestress along the path: torques with and without it, and the changes of sign that let backlash act.

    >>> from rapkm_lite import explore; explore.prestress().set(level=0).numbers["largest prestress"]
    '0 mN m'
    """
    strong = shared.torque_scale(robot)
    heat = shared.hotter(robot, strong)

    @lru_cache(maxsize=8)
    def along(side: int):
        t = shared.central_triangle(robot, side, dt=0.005)
        A = act.control_matrix(robot, t.q)
        return t, act.inverse_dynamics(robot, t.q, t.qd, t.qdd), act.prestress_projector(A)

    def draw(picture, level, side):
        t, least, projector = along(side)
        stress = matvec(projector, np.full(robot.n_arms, 1e-3 * level))
        c = least + stress
        for panel, torque in (("without", least), ("with", c)):
            marks.traces(picture, panel, t.t, 1e3 * torque)
            picture.fit(panel, 1e3 * c, 1e3 * least)
            marks.zero_line(picture, panel)
        energy = [copper_loss(robot, v, t.dt).sum() for v in (least, c)]
        return {
            "changes of sign without": marks.per_drive(sign_changes(least), 0),
            "changes with": marks.per_drive(sign_changes(c), 0),
            "heat without": marks.told(energy[0], 2, heat) + " J",
            "heat with": marks.told(energy[1], 2, heat) + " J",
            "largest prestress": marks.told(1e3 * np.abs(stress).max(), 0, strong) + " mN m",
        }

    without, also = shared.over_time("torque in mN m", robot=robot), shared.over_time("torque in mN m")
    panels = {"without": without | {"title": "No prestress"}, "with": also | {"title": "With prestress"}}
    controls = {
        "level": slider("desired prestress in mN m", -100 * strong, 100 * strong, 2 * strong, 40 * strong),
        "side": shared.path_slider(robot, "side of the triangle in mm", 60, 300, 5, 240 if robot.n_arms > 2 else 160),
    }
    return explorer(draw, controls, panels, live=True)


def sign_changes(c: np.ndarray) -> np.ndarray:
    """How often each column of c (k, m) changes its sign, zeros (to 1e-8 of the largest) not counted, (m,)."""
    least = 1e-8 * np.abs(c).max()
    return np.array([np.count_nonzero(np.diff(np.sign(column[np.abs(column) > least]))) for column in c.T])
