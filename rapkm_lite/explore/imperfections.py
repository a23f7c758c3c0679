"""Explorer of a machine that is not its drawing: links that are too long, weak drives, broken drives and encoders."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ..control.laws import PD, AntagonismFilter
from ..figures.marks import drive_legend, per_drive
from ..figures.style import ALARM, arm_line
from ..machine.manipulator import Manipulator, load
from ..mechanics.trajectory import triangle
from ..simulation.energy import antagonistic_torque
from ..simulation.faults import DeadDrive, EncoderDropout, TorqueLimit
from ..simulation.runs import SimulationError, simulate
from .controls import choice, log_slider, slider, switch
from .explorer import Explorer, explorer
from .geometry import TIME

FAULTS = {
    "nothing": [],
    "drive 1 dead": [DeadDrive(0, 0.5)],
    "encoder 1 silent for 20 ms": [EncoderDropout(0, 0.6, 0.62)],
    "encoder 1 silent for 100 ms": [EncoderDropout(0, 0.6, 0.7)],
}


def imperfections(robot: Manipulator | None = None) -> Explorer:
    """A small triangle with links too long, weak drives and one fault: distance from the path, and torques."""
    robot = load() if robot is None else robot
    path = triangle(robot, 0.3 * np.ptp(robot.base[:, 0]), duration=2.5, dt=2e-3)

    @lru_cache(maxsize=64)
    def run(longer: float, K_P: float, limit: int, fault: str, filter: bool):
        built = robot.replace(lengths=(1 + 1e-3 * longer) * robot.lengths)
        law = PD(K_P, 0.225 * np.sqrt(K_P / 7.05))
        law = AntagonismFilter(law) if filter else law
        faults = [TorqueLimit(1e-3 * limit), *FAULTS[fault]]
        try:
            return simulate(built, law, path, model=robot, faults=faults), ""
        except SimulationError as error:
            if error.partial is None:
                raise
            return error.partial, f", lost at {error.time:.2f} s"

    def draw(picture, longer, K_P, limit, fault, filter):
        done, lost = run(longer, K_P, limit, fault, filter)
        off = 1e3 * np.linalg.norm(done.x - path.x[: len(done)], axis=-1)
        c, null = 1e3 * done.c, 1e3 * antagonistic_torque(done)
        picture.trace("error", done.t, off, color=ALARM)
        picture.fit("error", off, symmetric=False, least=1.0)
        for i in range(robot.n_arms):
            picture.trace("torque", done.t, c[:, i], **arm_line(i))
        picture.fit("torque", c, least=20.0)
        return {
            "farthest from the path": f"{off.max():.2f} mm{lost}",
            "largest torque": f"{np.abs(c).max():.0f} mN m",
            "torque that only presses, at the end": per_drive(null[-1], 1) + " mN m",
            "electric energy": f"{done.energy.sum():.2f} J",
        }

    panels = {
        "error": {"xlabel": TIME, "ylabel": "distance from the path in mm", "xlim": (0, 2.5)},
        "torque": {"xlabel": TIME, "ylabel": "torque that acts in mN m", "xlim": (0, 2.5)},
    }
    controls = {
        "longer": slider("links too long in ‰", -10.0, 10.0, 0.5, 5.0),
        "K_P": log_slider("K_P in N m/rad", 2.0, 50.0, 7.05),
        "limit": slider("torque limit in mN m", 40, 400, 10, 150),
        "fault": choice("what breaks", FAULTS.keys()),
        "filter": switch("antagonism filter"),
    }
    about = "Distance of the end-effector from its path and the torques that act, when the machine is not its drawing."

    def setup(picture):
        drive_legend(picture, "torque", robot)

    return explorer(draw, controls, panels, size=(9.2, 3.8), setup=setup, about=about)
