"""Explorer of torques for one force: within limits, of least peak, of one sign."""

from __future__ import annotations

import numpy as np

from ..figures.marks import bars, draw_machine, draw_workspace, per_drive
from ..figures.marks.plane import clamped
from ..figures.style import AFTER, ALARM
from ..lessons.lesson09.figures import shortest_reach
from ..lessons.lesson09.tasks import one_sign, smallest
from ..machine.manipulator import Manipulator
from ..mechanics.actuation import control_matrix, force_polygon
from ..mechanics.kinematics import inverse_kinematics
from ..mechanics.redundancy import allocate_torques, minimax_torques
from .controls import choice, slider
from .explorer import Explorer, explorer
from .geometry import frictionless, plane_limits

RULES = {
    "least size": lambda A, f, limit: smallest(A, f),
    "within the limits": allocate_torques,
    "least peak": lambda A, f, limit: minimax_torques(A, f),
    "one sign, 4 mN m at least": lambda A, f, limit: one_sign(A, f, 4e-3),
}


def allocation(robot: Manipulator | None = None) -> Explorer:
    """A force at a place, the limits of the drives, and torques by four rules: what each drive gives."""
    robot = frictionless(robot)

    def draw(picture, x, y, f_x, f_y, limit, rule):
        point = clamped(robot, 1e-3 * np.array([x, y]))
        q = inverse_kinematics(robot, point)
        draw_machine(picture, "machine", robot, q)
        picture.handle("machine", *point, x=(1e3, 0), y=(0, 1e3))
        A, f = control_matrix(robot, q), np.array([f_x, f_y])
        corners = force_polygon(A, 1e-3 * limit)
        picture.polygon("force", corners, facecolor="#DCE6F0", edgecolor=AFTER, linewidth=1.5, zorder=0.5)
        inner = shortest_reach(A, 1e-3 * limit, 181)
        picture.line("force", *np.vstack([inner, inner[:1]]).T, color=AFTER, linewidth=1.2, linestyle="--")
        picture.line("force", f_x, f_y, marker="o", markersize=7, color=ALARM, zorder=4)
        picture.handle("force", f_x, f_y, f_x=(1, 0), f_y=(0, 1))
        plain, torques = smallest(A, f), RULES[rule](A, f, 1e-3 * limit)
        bars(picture, "torque", [(1e3 * plain, {"alpha": 0.3}), (1e3 * torques, {})], form=".0f")
        for side in (-limit, limit):
            picture.line("torque", [0.4, robot.n_arms + 0.6], [side, side], color=ALARM, linestyle=":", linewidth=1.5)
        picture.fit("torque", 1.15e3 * np.append(np.concatenate([plain, torques]), 1e-3 * limit))
        return {
            "torques": per_drive(1e3 * torques, 1) + " mN m",
            "of least size": per_drive(1e3 * plain, 1) + " mN m",
            "largest": f"{np.abs(torques).max() / limit * 1e5:.0f} % of the limit",
        }

    def setup(picture):
        draw_workspace(picture, "machine", robot)
        dash = {"color": AFTER, "linestyle": "--"}
        picture.legend("force", [("within limits", {"color": AFTER}), ("by least size", dash)])

    ticks = range(1, robot.n_arms + 1)
    force = {"xlabel": "f_x in N", "ylabel": "f_y in N", "aspect": "equal", "xlim": (-1.8, 1.8), "ylim": (-1.8, 1.8)}
    panels = {
        "machine": plane_limits(robot, 0.05) | {"title": "Machine"},
        "force": force,
        "torque": {"title": "Pale: least size", "xlabel": "drive", "ylabel": "torque in mN m", "xticks": [*ticks]},
    }
    panels["torque"]["xlim"] = (0.4, robot.n_arms + 0.6)
    controls = {
        "x": slider("x in mm", -150, 150, 5, 0),
        "y": slider("y in mm", -150, 150, 5, 0),
        "f_x": slider("force f_x in N", -1.5, 1.5, 0.05, 0.0),
        "f_y": slider("force f_y in N", -1.5, 1.5, 0.05, 0.75),
        "limit": slider("limit in mN m", 20, 200, 5, 85),
        "rule": choice("rule", RULES.keys(), "within the limits"),
    }
    about = "The torques that make one force: of least size (pale bars) and by the chosen rule; dots: the limits."
    return explorer(draw, controls, panels, size=(10.4, 3.8), setup=setup, about=about)
