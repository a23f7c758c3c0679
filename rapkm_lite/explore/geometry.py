"""Explorers without a simulation: the machine, the degree of actuation along a path, prestress."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm, ListedColormap

from ..figures.machine import plane_limits, plot_workspace
from ..figures.maps import grid_points, mode_name, on_grid, pair_line, pair_measures, pair_name
from ..figures.style import AFTER, ALARM, NEUTRAL, arm_colour, arm_line
from ..machine.arguments import matvec
from ..machine.manipulator import Manipulator
from ..mechanics import actuation as act
from ..mechanics.antagonism import null_vector
from ..mechanics.kinematics import inverse_kinematics, working_modes
from ..mechanics.trajectory import circle, triangle
from .builder import Explorer, choice, explorer, slider
from .parts import TIME, draw_machine, drive_legend, frictionless, legend, per_drive

# Smallest singular value, in rad/m, below which a map and a number are marked; the testbed's centroid has 6.
WEAK = 1.5
# Pale steps of the map, so that the arms stand out on them; dark is weak.
MAP = ListedColormap(["#8C8C8C", "#ADADAD", "#C6C6C4", "#DADAD2", "#E8E8DC", "#F4F3E4", "#FCFBEE"])
LEVELS = BoundaryNorm([0.0, 0.5, 1.5, 2.5, 3.5, 4.5, 5.5, 6.5], MAP.N)


def pair_legend(ax, robot: Manipulator) -> None:
    """A legend of the first pairs' lines."""
    pairs = act.drive_pairs(robot)[:4]
    legend(ax, [("pair " * (i == 0) + pair_name(p), pair_line(robot, p)) for i, p in enumerate(pairs)])


def machine(robot: Manipulator | None = None) -> Explorer:
    """The end-effector by two sliders in every working mode, a map of sigma_min, and the five-bar of each pair."""
    robot = frictionless(robot)
    pairs = act.drive_pairs(robot)[:3]
    modes = {mode_name(m): m for m in working_modes(robot)}
    which = ["all drives", *(f"pair {pair_name(p)}" for p in pairs)]
    gx, gy, inside, points = grid_points(robot, 121)
    # An image ends where its last pixels end, half a step beyond their centres.
    wide, tall = (gx[1] - gx[0]) / 2, (gy[1] - gy[0]) / 2
    extent = gx[0] - wide, gx[-1] + wide, gy[0] - tall, gy[-1] + tall

    @lru_cache(maxsize=64)
    def sigma_map(mode: str, drives: str) -> np.ma.MaskedArray:
        A = act.control_matrix(robot, inverse_kinematics(robot, points, modes[mode]))
        rows = slice(None) if drives == which[0] else list(pairs[which.index(drives) - 1])
        return on_grid(inside, act.singular_values(A[:, rows])[:, 1])

    def draw(picture, x, y, mode, drives):
        sigma = sigma_map(mode, drives)
        picture.image("machine", sigma, extent, cmap=MAP, norm=LEVELS)
        point = 1e-3 * np.array([x, y])
        picture.line("machine", *point, color=ALARM, marker="x", markersize=9, zorder=6)
        q = inverse_kinematics(robot, point, modes[mode])
        all_drives = act.singular_values(act.control_matrix(robot, q))[1]
        draw_machine(picture, "machine", robot, q)
        numbers = {
            "degree of actuation": f"{act.degree_of_actuation(robot, q)} of 2 ({act.actuation_type(robot, q)})",
            "σ_min of all drives": f"{all_drives:.2f} rad/m",
        }
        for pair, name, value in zip(pairs, "abc", pair_measures(robot, q), strict=False):
            weak = value < WEAK
            draw_machine(picture, name, robot, q, arms=pair)
            picture.text(
                name,
                0.5,
                1.02,
                f"{pair_name(pair)}: {value:.2f} rad/m",
                inside=True,
                ha="center",
                fontsize=10,
                fontweight="bold" if weak else "normal",
                color=ALARM if weak else AFTER,
            )
            numbers[f"σ_min of {pair_name(pair)}"] = f"{value:.2f} rad/m"
        return numbers

    plane = plane_limits(robot, 0.05)
    small = {k: plane[k] for k in ("aspect", "xlim", "ylim")} | {"xticks": [], "yticks": [], "title": " "}
    panels = {"machine": plane | {"title": "Machine and map of σ_min"}} | dict.fromkeys("abc"[: len(pairs)], small)

    def setup(axes):
        bar = axes["machine"].figure.colorbar(ScalarMappable(LEVELS, MAP), ax=axes["machine"], shrink=0.85, pad=0.02)
        bar.set_label("σ_min in rad/m")

    controls = {
        "x": slider("x in mm", -200, 200, 2, 20),
        "y": slider("y in mm", -200, 230, 2, 30),
        "mode": choice("working mode", modes),
        "drives": choice("map for", which),
    }
    rows = [["machine", name] for name in "abc"[: len(pairs)]]
    return explorer(draw, controls, panels, layout=rows, widths=[2.7, 1], size=(8.2, 5.4), setup=setup, live=True)


def actuation(robot: Manipulator | None = None) -> Explorer:
    """A walk along the path: sigma_min of each pair, the null vector of A^T, and the forces the drives can produce."""
    robot = frictionless(robot)
    pairs = act.drive_pairs(robot)
    paths = {"triangle": triangle, "circle": circle}

    @lru_cache(maxsize=8)
    def along(path: str, size: int):
        side = 1e-3 * size
        t = triangle(robot, side, dt=0.01) if path == "triangle" else circle(robot, side / 2, dt=0.01)
        A = act.control_matrix(robot, t.q)
        if robot.n_arms == 3:
            null = null_vector(robot, t.q)
        else:
            # Without a single null vector: how much of each drive's torque the projector onto the null space keeps.
            share = np.diagonal(act.prestress_projector(A), axis1=-2, axis2=-1)
            null = np.sqrt(np.maximum(share, 0.0))
        return t, A, pair_measures(robot, t.q), null

    def draw(picture, place, path, size, torque):
        t, A, sigma, null = along(path, size)
        k = round(place / 100 * (len(t) - 1))
        share = np.linspace(0, 100, len(t))
        picture.line("plane", *t.x.T, color=NEUTRAL, linewidth=1.2, zorder=2)
        draw_machine(picture, "plane", robot, t.q[k])
        for i, pair in enumerate(pairs):
            style = pair_line(robot, pair)
            picture.line("sigma", share, sigma[:, i], **style)
            picture.line("sigma", place, sigma[k, i], marker="o", markersize=6, color=style["color"], zorder=4)
        for i in range(robot.n_arms):
            picture.line("null", share, null[:, i], **arm_line(i))
            picture.line("null", place, null[k, i], marker="o", markersize=6, color=arm_colour(i), zorder=4)
        for panel in ("sigma", "null"):
            picture.line(panel, [place, place], picture.axes[panel].get_ylim(), color=NEUTRAL, linewidth=0.8, zorder=1)
        corners = act.force_polygon(A[k], 1e-3 * torque)
        for pair in pairs:
            picture.polygon(
                "force",
                act.force_polygon(A[k][list(pair)], 1e-3 * torque),
                fill=False,
                linewidth=1.5,
                edgecolor=pair_line(robot, pair)["color"],
                linestyle=pair_line(robot, pair)["linestyle"],
            )
        picture.polygon("force", corners, facecolor="#DCE6F0", edgecolor=AFTER, linewidth=1.5, zorder=0.5)
        bound = np.abs(corners).max()
        picture.fit("force", bound)
        picture.limits("force", x=picture.axes["force"].get_ylim())
        worst = np.unravel_index(np.argmin(sigma), sigma.shape)
        return {
            "point": f"({1e3 * t.x[k, 0]:.0f}, {1e3 * t.x[k, 1]:.0f}) mm",
            "σ_min of all drives": f"{act.singular_values(A[k])[1]:.2f} rad/m",
            "σ_min of the pairs": per_drive(sigma[k], 2) + " rad/m",
            "worst on this path": f"{sigma[worst]:.3f} rad/m, pair {pair_name(pairs[worst[1]])}",
            "null vector": per_drive(null[k], 2),
        }

    def setup(axes):
        plot_workspace(robot, axes["plane"])
        pair_legend(axes["sigma"], robot)
        drive_legend(axes["null"], robot)
        legend(axes["force"], [("all drives", {"color": AFTER})])

    way = "place on the path in %"
    panels = {
        "plane": plane_limits(robot, 0.05) | {"title": "Machine"},
        "sigma": {"title": "Pairs", "xlabel": way, "ylabel": "σ_min in rad/m", "xlim": (0, 100), "ylim": (0, 8)},
        "null": {"title": "Null vector", "xlabel": way, "ylabel": "component", "xlim": (0, 100), "ylim": (-1.05, 1.05)},
        "force": {
            "title": "Forces",
            "xlabel": "f_x in N",
            "ylabel": "f_y in N",
            "aspect": "equal",
            "xlim": (-2, 2),
            "ylim": (-2, 2),
        },
    }
    controls = {
        "place": slider("place on the path in %", 0.0, 100.0, 0.5, 12.0),
        "path": choice("path", paths.keys()),
        "size": slider("side or diameter in mm", 40, 320, 5, 240),
        "torque": slider("torque limit in mN m", 20, 200, 5, 85),
    }
    return explorer(
        draw,
        controls,
        panels,
        layout=[["plane", "sigma"], ["force", "null"]],
        widths=[1, 1.35],
        size=(9.2, 6.6),
        setup=setup,
        live=True,
    )


def prestress(robot: Manipulator | None = None) -> Explorer:
    """Prestress along the path: torques with and without it, and the changes of sign that let backlash act."""
    robot = frictionless(robot)

    @lru_cache(maxsize=8)
    def along(side: int):
        t = triangle(robot, 1e-3 * side, dt=0.005)
        A = act.control_matrix(robot, t.q)
        return t, act.inverse_dynamics(robot, t.q, t.qd, t.qdd), act.prestress_projector(A)

    def draw(picture, level, side):
        t, least, projector = along(side)
        wish = 1e-3 * level * np.ones(robot.n_arms)
        stress = matvec(projector, wish)
        c = least + stress
        for i in range(robot.n_arms):
            picture.line("without", t.t, 1e3 * least[:, i], **arm_line(i))
            picture.line("with", t.t, 1e3 * c[:, i], **arm_line(i))
        top = 1e3 * max(np.abs(c).max(), np.abs(least).max())
        for panel in ("without", "with"):
            picture.fit(panel, top)
            picture.line(panel, t.t[[0, -1]], [0, 0], color=NEUTRAL, linewidth=0.8, zorder=1)
        energy = [t.dt * np.sum(robot.resistance * (v / robot.torque_constant) ** 2) for v in (least, c)]
        changes = [sign_changes(v) for v in (least, c)]
        return {
            "changes of sign without": per_drive(changes[0], 0),
            "with": per_drive(changes[1], 0),
            "heat without": f"{energy[0]:.2f} J",
            "heat with": f"{energy[1]:.2f} J",
            "largest prestress": f"{1e3 * np.abs(stress).max():.0f} mN m",
        }

    def setup(axes):
        drive_legend(axes["without"], robot)
        drive_legend(axes["with"], robot)

    panels = {
        name: {"title": title, "xlabel": TIME, "ylabel": "torque in mN m", "xlim": (0, 5), "ylim": (-100, 100)}
        for name, title in (("without", "No prestress"), ("with", "With prestress"))
    }
    controls = {
        "level": slider("prestress wished for in mN m", -100, 100, 2, 40),
        "side": slider("side of the triangle in mm", 60, 300, 5, 240),
    }
    return explorer(draw, controls, panels, setup=setup, live=True)


def sign_changes(c: np.ndarray) -> np.ndarray:
    """How often each column of c (k, m) changes its sign, zeros not counted, (m,)."""
    count = []
    for column in c.T:
        signs = np.sign(column[np.abs(column) > 1e-9])
        count.append(int(np.count_nonzero(np.diff(signs))))
    return np.array(count)
