"""Explorers of the machine at rest under offsets: the steady state of PD control, and the drives' opinions."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ..control.laws import PD
from ..figures.machine import plane_limits
from ..figures.marks import bars, clamped, draw_machine, draw_workspace, drive_legend, offset_values, per_drive
from ..figures.style import NEUTRAL, arm_colour, arm_line
from ..machine.manipulator import Manipulator
from ..mechanics import actuation as act
from ..mechanics.antagonism import steady_state_error, steady_state_torque
from ..mechanics.kinematics import inverse_kinematics
from ..mechanics.trajectory import hold
from ..simulation.runs import simulate
from .controls import log_slider, offset_sliders, slider
from .explorer import Explorer, explorer
from .geometry import TIME, frictionless


def steady_state(robot: Manipulator | None = None) -> Explorer:
    """Offsets and gains of each drive: the error at rest of theory (14) beside a simulation that settles there."""
    robot = frictionless(robot)
    N = robot.n_arms
    still = lru_cache(maxsize=64)(lambda x, y: hold(robot, [x, y], 1.5, 2e-3))

    def draw(picture, x, y, **values):
        offset = offset_values(values, N)
        K_P = np.array([values[f"K_P_{i + 1}"] for i in range(N)])
        # Critical damping for the load that the gains are designed for: K_D^2 = 4 J K_P.
        K_D = 0.225 * np.sqrt(K_P / 7.05)
        point = clamped(robot, 1e-3 * np.array([x, y]))
        q = inverse_kinematics(robot, point)
        A = act.control_matrix(robot, q)
        theory = 1e3 * steady_state_error(A, K_P, offset)
        torque = 1e3 * steady_state_torque(A, K_P, offset)
        run = simulate(robot, PD(K_P, K_D), still(*point), offset)
        error = 1e3 * run.error
        draw_machine(picture, "plane", robot, q)
        picture.handle("plane", *point, x=(1e3, 0), y=(0, 1e3))
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

    def setup(picture):
        draw_workspace(picture, "plane", robot)
        drive_legend(picture, "error", robot)
        wide = {"color": NEUTRAL, "linewidth": 7}
        picture.legend("rest", [("theory", wide | {"alpha": 0.45}), ("simulated", wide)])

    drives = {"xticks": range(1, N + 1), "xlabel": "drive", "xlim": (0.4, N + 0.6)}
    panels = {
        "plane": plane_limits(robot, 0.05),
        "error": {"xlabel": TIME, "ylabel": "angle error in mrad", "xlim": (0, 1.5)},
        "rest": {"ylabel": "error at rest in mrad", **drives},
        "torque": {"ylabel": "torque at rest in mN m", **drives},
    }
    controls = offset_sliders(robot, (5.0, -3.0, 8.0))
    controls |= {f"K_P_{i + 1}": log_slider(f"K_P {i + 1} in N m/rad", 1.0, 50.0, 7.05) for i in range(N)}
    middle = np.round(500 * robot.base.mean(axis=0)).astype(int) * 2
    controls |= {
        "x": slider("x in mm", -200, 200, 2, int(middle[0])),
        "y": slider("y in mm", -200, 230, 2, int(middle[1])),
    }
    layout = [["plane", "error"], ["rest", "torque"]]
    about = "The machine at rest with calibration offsets: the angle errors settle where theory says, and torques stay."
    return explorer(draw, controls, panels, layout=layout, size=(9.2, 6.2), setup=setup, about=about)


def three_opinions(robot: Manipulator | None = None) -> Explorer:
    """Where each drive wants the end-effector: drag a line, the triangle of disagreement closes, the torques vanish."""
    robot = frictionless(robot)
    N = robot.n_arms

    def draw(picture, x, y, K_P, **offsets):
        offset = offset_values(offsets, N)
        A = act.control_matrix(robot, inverse_kinematics(robot, clamped(robot, 1e-3 * np.array([x, y]))))
        torque = 1e3 * steady_state_torque(A, K_P, offset)
        # Drive i is content on the line A_i p = -offset_i of points p about the desired one; all lengths in mm.
        rest = 1e3 * np.linalg.lstsq(A, steady_state_error(A, K_P, offset), rcond=None)[0]
        size = np.linalg.norm(A, axis=1)
        normal, level = A / size[:, None], -1e3 * offset / size
        half = picture.ylim("opinions")[1]
        for i in range(N):
            along = np.array([-normal[i, 1], normal[i, 0]])
            ends = level[i] * normal[i] + np.outer([-3 * half, 3 * half], along)
            target = rest + (level[i] - normal[i] @ rest) * normal[i]
            picture.line("opinions", *ends.T, **arm_line(i) | {"linewidth": 2.4})
            picture.line("opinions", *np.stack([rest, target]).T, color=arm_colour(i), linewidth=6, alpha=0.55)
            knob = level[i] * normal[i] + 0.72 * half * along
            words = {"color": arm_colour(i), "fontweight": "bold", "fontsize": 10, "ha": "center", "va": "center"}
            picture.text("opinions", *(knob + 0.11 * half * normal[i]), f"{i + 1}", **words, zorder=6)
            picture.handle("opinions", *knob, grip=ends, **{f"offset_{i + 1}": (-A[i, 0], -A[i, 1])})
        corners = [np.linalg.solve(normal[[j, k]], level[[j, k]]) for j in range(N) for k in range(j)]
        if N == 3 and max(np.ptp(corners, axis=0)) < 3 * half:
            picture.polygon("opinions", corners, facecolor="#DCE6F0", zorder=0.5)
        picture.line("opinions", 0, 0, color=NEUTRAL, marker="+", markersize=13, markeredgewidth=2, zorder=5)
        tip = {"marker": "s", "markersize": 8, "markerfacecolor": "white", "markeredgewidth": 1.8}
        picture.line("opinions", *rest, color=NEUTRAL, zorder=6, **tip)
        bars(picture, "torque", [(torque, {})], width=0.6, form=".1f")
        picture.fit("torque", 1.25 * torque, least=10.0)
        picture.line("torque", [0.4, N + 0.6], [0, 0], color=NEUTRAL, linewidth=0.8, zorder=4)
        apart = np.abs(normal @ rest - level)
        return {
            "rest": f"({rest[0] + 0.0:.2f}, {rest[1] + 0.0:.2f}) mm beside the desired point",
            "distances from the lines": per_drive(apart, 2) + " mm",
            "torque at rest": per_drive(torque, 1) + " mN m",
            "heat at rest": f"{np.sum(robot.resistance * (1e-3 * torque / robot.torque_constant) ** 2):.3f} W",
        }

    away = {"xlabel": "x − desired x in mm", "ylabel": "y − desired y in mm", "xlim": (-3, 3), "ylim": (-3, 3)}
    panels = {
        "opinions": away | {"aspect": "equal", "title": "Where each drive is content"},
        "torque": {
            "xlabel": "drive",
            "ylabel": "torque at rest in mN m",
            "xticks": range(1, N + 1),
            "xlim": (0.4, N + 0.6),
        },
    }
    controls = offset_sliders(robot, (5.0, -3.0, 8.0), 12)
    controls |= {
        "K_P": log_slider("K_P in N m/rad", 1.0, 50.0, 7.05),
        "x": slider("desired x in mm", -100, 100, 5, 20),
        "y": slider("desired y in mm", -100, 100, 5, 30),
    }
    about = (
        "A line for each drive: where its measured angle would be right. The end-effector rests between the lines "
        "(square); the bars from it to the lines are what each drive keeps pulling at."
    )
    return explorer(draw, controls, panels, widths=[1.4, 1], size=(9.2, 5.0), live=True, about=about)
