"""Explorer of a machine that finds its own offsets: where it looks, how often, and how finely its encoders count."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ..figures.machine import plane_limits
from ..figures.marks import bars, draw_machine, draw_workspace, drive_legend, per_drive
from ..figures.style import ALARM, NEUTRAL, arm_colour, arm_line
from ..lessons.lesson08.tasks import counted, ring
from ..machine.manipulator import Manipulator
from ..mechanics import actuation as act
from ..mechanics.calibration import CalibrationError, calibrate
from ..mechanics.kinematics import inverse_kinematics
from .controls import choice, slider
from .explorer import Explorer, explorer
from .geometry import frictionless


def calibration(robot: Manipulator | None = None) -> Explorer:
    """Readings on a circle: what each place shows of the offsets, and what calibration makes of all of them."""
    robot = frictionless(robot)
    N, middle = robot.n_arms, robot.base.mean(axis=0)
    offset = 1e-3 * np.resize([4.0, -2.0, 5.0], N)

    @lru_cache(maxsize=128)
    def found(radius: int, turn: int, places: int, counts: int):
        angles = turn + 360 * np.arange(places) / places
        q_a = inverse_kinematics(robot, middle + ring(angles, 1e-3 * radius))[:, :N] + offset
        try:
            return angles, calibrate(robot, counted(q_a, counts), noise=2 * np.pi / counts / np.sqrt(12))
        except CalibrationError as refused:
            return angles, refused

    def draw(picture, radius, turn, places, counts):
        angles, result = found(radius, turn, places, counts)
        degrees, seen = np.arange(361), np.round(angles).astype(int) % 360
        way = middle + ring(degrees, 1e-3 * radius)
        q = inverse_kinematics(robot, way)
        share = np.sqrt(np.diagonal(act.prestress_projector(act.control_matrix(robot, q)), axis1=-2, axis2=-1))
        draw_machine(picture, "plane", robot, q[seen[0]])
        picture.line("plane", *way.T, color=NEUTRAL, linewidth=1, zorder=2)
        dots = {"linestyle": "none", "marker": "o", "markersize": 6, "zorder": 6}
        picture.line("plane", *way[seen].T, color=ALARM, **dots)
        picture.handle("plane", *way[seen[0]], along=way, turn=degrees)
        for i in range(N):
            picture.line("seen", degrees, share[:, i], **arm_line(i))
            picture.line("seen", seen, share[seen, i], color=arm_colour(i), **dots)
        if isinstance(result, CalibrationError):
            return {"combinations that are known": f"{result.rank} of {N}", "calibration": "refused"}
        error, spread = 1e3 * np.array([result.offset - offset, np.sqrt(np.diagonal(result.covariance))])
        bars(picture, "error", [(error, {}), (spread, {"alpha": 0.4})])
        picture.fit("error", 1.25 * error, 1.25 * spread, least=0.05)
        return {
            "condition": f"{result.condition:.2f}",
            "error of the offsets": per_drive(error, 3) + " mrad",
            "standard deviation expected": per_drive(spread, 3) + " mrad",
        }

    def setup(picture):
        draw_workspace(picture, "plane", robot)
        drive_legend(picture, "seen", robot)
        looks = [{"color": NEUTRAL, "linewidth": 7, "alpha": alpha} for alpha in (1.0, 0.4)]
        picture.legend("error", [("found − true", looks[0]), ("expected", looks[1])])

    panels = {
        "plane": plane_limits(robot, 0.05),
        "seen": {"xlabel": "place on the circle in °", "ylabel": "|component of η|", "xlim": (0, 360), "ylim": (0, 1)},
        "error": {"xlabel": "drive", "ylabel": "error in mrad", "xticks": range(1, N + 1), "xlim": (0.4, N + 0.6)},
    }
    controls = {
        "radius": slider("radius in mm", 10, 125, 5, 120),
        "turn": slider("turn of the first place in °", 0, 120, 5, 0),
        "places": choice("places on the circle", [1, 2, 3, 6, 24, 1000], 3),
        "counts": choice("counts a turn", [("2000", 2000), ("20 000", 20_000), ("200 000", 200_000)], 20_000),
    }
    about = "Places on a circle, what each drive contributes to the equation there, and the error of the offsets found."
    return explorer(draw, controls, panels, size=(11.0, 3.8), setup=setup, about=about)
