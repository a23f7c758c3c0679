"""Explorers of what the redundancy is good for: readings that show the offsets, and a choice of torques."""

from __future__ import annotations

from contextlib import suppress
from functools import lru_cache, partial

import numpy as np

from ..figures import marks
from ..figures.machine import plane_limits
from ..figures.style import AFTER, ALARM, NEUTRAL, arm_colour
from ..lessons.lesson08.tasks import counted, ring
from ..lessons.lesson09.figures import shortest_reach
from ..lessons.lesson09.tasks import one_sign, smallest
from ..machine.manipulator import Manipulator
from ..mechanics.actuation import control_matrix, prestress_projector
from ..mechanics.calibration import CalibrationError, calibrate
from ..mechanics.kinematics import inverse_kinematics
from ..mechanics.redundancy import allocate_torques, minimax_torques
from . import shared
from .controls import choice, slider
from .explorer import Explorer, explorer

RULES = {
    "least size": lambda A, f, limit: smallest(A, f),
    "within the limits": allocate_torques,
    "least peak": lambda A, f, limit: minimax_torques(A, f),
    "one sign, 4 mN m at least": lambda A, f, limit: one_sign(A, f, 4e-3),
}


@shared.ready_made
def allocation(robot: Manipulator) -> Explorer:
    """The torques that make one force: of least size (pale bars) and by the chosen rule; dotted: the limits.

    >>> from rapkm_lite import explore; explore.allocation().numbers["largest"]
    '100 % of the limit'
    """

    def draw(picture, x, y, f_x, f_y, limit, rule):
        _, q, stop = shared.held_machine(picture, "machine", robot, x, y)
        A, f = control_matrix(robot, q), np.array([f_x, f_y])
        picture.fit("force", shared.draw_forces(picture, A, limit), f, least=1.7 / times)
        picture.limits("force", x=picture.ylim("force"))
        inner = shortest_reach(A, 1e-3 * limit, 181)
        picture.line("force", *np.vstack([inner, inner[:1]]).T, color=AFTER, linewidth=1.2, linestyle="--")
        picture.line("force", f_x, f_y, marker="o", markersize=7, color=ALARM, zorder=4)
        picture.handle("force", f_x, f_y, f_x=(1, 0), f_y=(0, 1))
        plain, torques = smallest(A, f), RULES[rule](A, f, 1e-3 * limit)
        marks.bars(picture, "torque", [(1e3 * plain, {"alpha": 0.45}), (1e3 * torques, {})], form=".0f")
        for side in (-limit, limit):
            picture.line("torque", picture.xlim("torque"), [side, side], color=ALARM, linestyle=":", linewidth=1.5)
        picture.fit("torque", 1150 * plain, 1150 * torques, 1.15 * limit)
        return {
            "torques": marks.per_drive(1e3 * torques, 1) + " mN m",
            "of least size": marks.per_drive(1e3 * plain, 1) + " mN m",
            "largest": f"{np.abs(torques).max() / limit * 1e5:.0f} % of the limit",
        } | stop

    times = shared.size(robot)
    # It begins with three quarters of a newton on the testbed, elsewhere with less than the drives can do.
    first, place = 0.0, shared.place_sliders(robot, 0, 0, -150, 150, 5)
    with suppress(ValueError):  # where the middle is a drive, or the drives let go
        point = marks.clamped(robot, 1e-3 * np.array([axis.value for axis in place.values()]))
        A = control_matrix(robot, inverse_kinematics(robot, point))
        reach = 0.085 / np.abs(minimax_torques(A, np.array([0.0, 1.0]))).max()
        first = min(0.75, 0.05 * np.floor(18 * reach * times)) / times
    wide = {"color": NEUTRAL, "linewidth": 7}
    kinds = [("least size", wide | {"alpha": 0.45}), ("by rule", wide), ("limit", {"color": ALARM, "linestyle": ":"})]
    reaches = [("within limits", {"color": AFTER}), ("by least size", {"color": AFTER, "linestyle": "--"})]
    panels = {
        "machine": plane_limits(robot, 0.05) | {"title": "Machine"},
        "force": shared.force_panel(1.8 / times) | {"legend": reaches},
        "torque": {"ylabel": "torque in mN m", "legend": kinds, **marks.drive_axis(robot.n_arms)},
    }
    controls = place | {
        "f_x": slider("force f_x in N", -1.5 / times, 1.5 / times, 0.05 / times, 0.0),
        "f_y": slider("force f_y in N", -1.5 / times, 1.5 / times, 0.05 / times, first),
        "limit": slider("limit in mN m", 20, 200, 5, 85),
        "rule": choice("rule", RULES.keys(), "within the limits"),
    }
    space = partial(marks.draw_workspace, panel="machine", robot=robot)
    return explorer(draw, controls, panels, size=(10.4, 3.8), setup=space)


@shared.ready_made
def calibration(robot: Manipulator) -> Explorer:
    """Places on a circle, what each drive contributes to the equation there, and the error of the offsets found.

    For three arms or more.

    >>> from rapkm_lite import explore; explore.calibration().set(turn=60).numbers["condition"]
    '1.36'
    """
    N, centre = robot.n_arms, shared.place(robot)[0]
    offset = 1e-3 * np.resize([4.0, -2.0, 5.0], N)
    degrees = np.arange(361)

    @lru_cache(maxsize=32)
    def around(radius: int):
        """The circle, and the length of each drive's row of the null basis of A^T, a degree apart."""
        way = centre + ring(degrees, 1e-3 * radius)
        A = control_matrix(robot, inverse_kinematics(robot, way))
        return way, np.sqrt(np.maximum(np.diagonal(prestress_projector(A), axis1=-2, axis2=-1), 0.0))

    def draw(picture, radius, turn, places, counts):
        angles = turn + 360 * np.arange(places) / places
        q_a = inverse_kinematics(robot, centre + ring(angles, 1e-3 * radius))[:, :N] + offset
        try:
            result = calibrate(robot, counted(q_a, counts), noise=2 * np.pi / counts / np.sqrt(12))
        except CalibrationError as refused:
            result = refused
        (way, share), seen = around(radius), np.unique(np.round(angles).astype(int) % 360)
        marks.draw_machine(picture, "plane", robot, inverse_kinematics(robot, way[turn]))
        picture.line("plane", *way.T, color=NEUTRAL, linewidth=1, zorder=2)
        dots = {"linestyle": "none", "marker": "o", "markersize": 6 if places < 9 else 2, "zorder": 6}
        picture.line("plane", *way[seen].T, color=ALARM, **dots)
        picture.handle("plane", *way[turn], along=way[:121:3], turn=degrees[:121:3])
        marks.traces(picture, "seen", degrees, share)
        for i in range(N):
            picture.line("seen", seen, share[seen, i], color=arm_colour(i), **dots)
        if isinstance(result, CalibrationError):
            words = f"refused: {result.rank} of {N} known"
            picture.text("error", 0.5, 0.5, words, inside=True, ha="center", va="center", fontsize=9, color=ALARM)
            return {"combinations that are known": f"{result.rank} of {N}", "calibration": "refused"}
        error, spread = 1e3 * np.array([result.offset - offset, np.sqrt(np.diagonal(result.covariance))])
        digits = 3 if spread.max() > 0.02 else 5
        form = f".{digits - (N > 3)}f"
        marks.bars(picture, "error", [(error, {}), (spread, {"alpha": 0.4})], form=form)
        picture.fit("error", 1.25 * error, 1.25 * spread, least=0.002)
        return {
            "condition": f"{result.condition:.2f}",
            "error of the offsets": marks.per_drive(error, digits) + " mrad",
            "standard deviation expected": marks.per_drive(spread, digits) + " mrad",
        }

    wide = {"color": NEUTRAL, "linewidth": 7}
    both = [("found − true", wide), ("expected", wide | {"alpha": 0.4})]
    share = "|component of η|" if N == 3 else "share of each drive"
    seen = {"xlabel": "place on the circle in °", "ylabel": share, "xlim": (0, 360), "ylim": (0, 1)}
    panels = {
        "plane": plane_limits(robot, 0.05),
        "seen": seen | {"legend": marks.drive_lines(robot)},
        "error": {"ylabel": "error in mrad", "legend": both, **marks.drive_axis(N)},
    }
    controls = {
        "radius": shared.path_slider(robot, "radius in mm", 10, 125, 5, 120, 0.95),
        "turn": slider("turn of the first place in °", 0, 120, 5, 0),
        "places": choice("places on the circle", [1, 2, 3, 6, 12, 24], 3),
        "counts": choice("counts a turn", [("2000", 2000), ("20 000", 20_000), ("200 000", 200_000)], 20_000),
    }
    space = partial(marks.draw_workspace, panel="plane", robot=robot)
    return explorer(draw, controls, panels, widths=[1, 1, 1.25], size=(11.0, 3.8), setup=space)
