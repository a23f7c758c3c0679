"""Explorer of a machine that is still to be built: base, links and working mode, and what offsets will cost it."""

from __future__ import annotations

import numpy as np

from ..figures.marks import draw_machine, drive_legend, per_drive
from ..figures.style import NEUTRAL, arm_line
from ..machine.arguments import matvec
from ..machine.manipulator import Manipulator
from ..mechanics.actuation import control_matrix, inverse_dynamics, prestress_projector, singular_values
from ..mechanics.kinematics import inverse_kinematics, working_modes
from ..mechanics.trajectory import triangle
from .controls import choice, slider
from .explorer import Explorer, explorer
from .geometry import TIME, frictionless

OFFSET, GAIN, ROD = np.array([4e-3, -2e-3, 5e-3]), 7.05, 0.67  # rad, N m/rad, kg/m


def own_machine(robot: Manipulator | None = None) -> Explorer:
    """Base, links and working mode by hand: torques for the triangle with a load, and those that offsets only press."""
    robot = frictionless(robot)
    N, middle = robot.n_arms, robot.base.mean(axis=0)
    along = robot.base - middle
    out = along / np.linalg.norm(along, axis=1, keepdims=True)
    modes = {"".join("+" if s > 0 else "−" for s in mode): mode for mode in working_modes(robot)}
    offset = np.resize(OFFSET, N)

    def draw(picture, radius, proximal, distal, load, mode):
        lengths = 1e-3 * np.array([proximal, distal])
        own = robot.replace(
            base=middle + 1e-3 * radius * out, lengths=lengths, masses=ROD * lengths, load=load, mode=modes[mode]
        )
        path = triangle(own, dt=0.01)
        A = control_matrix(own, path.q)
        moving = inverse_dynamics(own, path.q, path.qd, path.qdd)
        pressing = -GAIN * matvec(prestress_projector(A), offset)
        draw_machine(picture, "machine", own, inverse_kinematics(own, middle))
        picture.line("machine", *path.x.T, color=NEUTRAL, linewidth=1.2, zorder=1)
        for i in range(N):
            picture.line("moving", path.t, 1e3 * moving[:, i], **arm_line(i))
            picture.line("pressing", path.t, 1e3 * pressing[:, i], **arm_line(i))
        for panel in ("moving", "pressing"):
            picture.fit(panel, 1e3 * moving, 1e3 * pressing, least=20.0, most=400.0)
        heat = np.sum(own.resistance * (pressing[:-1] / own.torque_constant) ** 2) * path.dt
        return {
            "largest torque that moves": f"{1e3 * np.abs(moving).max():.0f} mN m",
            "cost of the offsets, at rest everywhere": f"{heat:.2f} J",
            "largest torques that press": per_drive(1e3 * np.abs(pressing).max(axis=0), 0) + " mN m",
            "smallest σ_min on the triangle": f"{singular_values(A)[:, 1].min():.2f} rad/m",
        }

    (x, y), half = middle, 0.48
    wide = {"aspect": "equal", "xlim": (x - half, x + half), "ylim": (y - half, y + half)}
    wide |= {"xlabel": "x in m", "ylabel": "y in m"}
    curves = {"xlabel": TIME, "ylabel": "torque in mN m", "xlim": (0, 5)}
    panels = {"machine": wide, "moving": curves | {"title": "moves"}, "pressing": curves | {"title": "only presses"}}
    controls = {
        "radius": slider("base joints from the middle in mm", 200, 320, 5, 230),
        "proximal": slider("proximal links in mm", 150, 300, 5, 200),
        "distal": slider("distal links in mm", 150, 300, 5, 200),
        "load": slider("load in kg", 0.0, 1.0, 0.1, 0.5),
        "mode": choice("working mode", modes),
    }
    about = "A machine in the middle of the triangle, the torques that move it, and those that offsets only press."

    def setup(picture):
        drive_legend(picture, "moving", robot)

    return explorer(draw, controls, panels, size=(10.4, 3.6), setup=setup, about=about)
