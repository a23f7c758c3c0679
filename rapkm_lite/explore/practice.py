"""Explorers of practice: a machine that is not its drawing, laws under disturbances, a machine still to be built."""

from __future__ import annotations

from functools import lru_cache, partial

import numpy as np

from ..control.computed_torque import CTC, RedundantCTC, SwitchedCTC
from ..control.laws import PD, AntagonismFilter
from ..figures import marks
from ..figures.maps import mode_name
from ..figures.style import ALARM, NEUTRAL
from ..machine.arguments import matvec
from ..machine.manipulator import Manipulator, load
from ..mechanics import actuation as act
from ..mechanics.kinematics import inverse_kinematics, reachable, working_modes
from ..mechanics.trajectory import triangle
from ..simulation.energy import antagonistic_energy, antagonistic_torque, copper_loss
from ..simulation.faults import DeadDrive, EncoderDropout, TorqueLimit
from ..simulation.runs import SimulationError, simulate
from . import shared
from .controls import choice, offset_sliders, slider, switch
from .explorer import Explorer, explorer

FAULTS = {
    "nothing": [],
    "drive 1 dead": [DeadDrive(0, 0.5)],
    "encoder 1 silent for 20 ms": [EncoderDropout(0, 0.6, 0.62)],
    "encoder 1 silent for 100 ms": [EncoderDropout(0, 0.6, 0.7)],
}
OFFSET, GAIN, ROD = np.array([4e-3, -2e-3, 5e-3]), 7.05, 0.67  # rad, N m/rad, kg/m


@partial(shared.ready_made, friction=True)
def imperfections(robot: Manipulator) -> Explorer:
    """Distance from the desired position and torques that act (dotted: limits), with links too long and one fault.

    >>> from rapkm_lite import explore; explore.imperfections().set(longer=0).numbers["largest torque"]
    '59 of 150 mN m'
    """
    path = shared.fitting_triangle(robot, 120, duration=2.5, dt=2e-3)
    usual, strong = shared.usual_gains(robot), shared.torque_scale(robot)
    heat = shared.hotter(robot, strong)
    dotted = {"color": ALARM, "linestyle": ":", "linewidth": 1.5}

    def draw(picture, longer, K_P, limit, fault, filter):
        built = robot.replace(**{name: (1 + 1e-3 * longer) * getattr(robot, name) for name in ("lengths", "centers")})
        law = PD(K_P, usual[1] * np.sqrt(K_P / usual[0]))
        law, lost = AntagonismFilter(law) if filter else law, ""
        try:
            run = simulate(built, law, path, model=robot, faults=[TorqueLimit(1e-3 * limit), *FAULTS[fault]])
        except SimulationError as error:
            if error.partial is None:
                raise
            run, lost = error.partial, f", lost at {error.time:.2f} s"
        off, torque = shared.draw_distance(picture, run, (1.0, shared.least_torque(robot, 20.0)))
        press = 1e3 * antagonistic_torque(run)[-1]
        picture.fit("torque", torque, limit)
        for side in (-limit, limit):
            picture.line("torque", picture.xlim("torque"), [side, side], **dotted)
        if lost:
            picture.text("error", 0.98, 0.97, lost[2:], inside=True, ha="right", va="top", fontsize=9, color=ALARM)
        return {
            "farthest from the desired position": f"{off.max():.2f} mm{lost}",
            "largest torque": " of ".join(marks.told(v, 0, strong) for v in (np.abs(torque).max(), limit)) + " mN m",
            "torque that only presses, at the end": marks.per_drive(press, 1, strong) + " mN m",
            "electric energy": marks.told(run.energy.sum(), 2, heat) + " J",
        }

    controls = {
        "longer": slider("links too long in ‰", -10.0, 10.0, 0.5, 5.0),
        "K_P": shared.gain_slider(robot, low=2.0),
        "limit": slider("torque limit in mN m", 40 * strong, 200 * strong, 5 * strong, 150 * strong),
        "fault": choice("what breaks", FAULTS.keys()),
        "filter": switch("antagonism filter"),
    }
    panels = shared.distance_panels(robot, 2.5, "torque that acts in mN m")
    panels["torque"]["legend"].append(("limit", dotted))
    return explorer(draw, controls, panels, size=(9.2, 3.8))


@shared.ready_made
def controller_choice(robot: Manipulator) -> Explorer:
    """Distance from the desired position and torques under a law of choice, with offsets, payload and coarse encoders.

    >>> from rapkm_lite import explore
    >>> explore.controller_choice().set(offset_1=0, offset_2=0, offset_3=0).numbers["largest error"]
    '1.19 mm'
    """
    path = shared.fitting_triangle(robot, 120, duration=2.5)
    # 0.27 kg weighs an arm of the testbed: up to 200 g on three of them, and on two.
    mass, strong, heavier = shared.carried(robot), shared.heavier(robot), shared.rounded(robot.masses.sum() / 0.67)
    heat = shared.hotter(robot, strong)
    laws = {
        "PD": lambda k, d: PD(mass * k, mass * d),
        "PD and filter": lambda k, d: AntagonismFilter(PD(mass * k, mass * d)),
        "computed torque, fixed pair": CTC,
        "computed torque, switched pair": SwitchedCTC,
        "computed torque, end-effector": lambda k, d: CTC(k, d, None),
        "computed torque, redundant": RedundantCTC,
    }
    # What the laws do not know comes on top of the load that the machine is given with.
    loaded = lru_cache(maxsize=16)(lambda grams: robot.replace(load=robot.load + 1e-3 * grams))

    def draw(picture, law, frequency, load, coarse, **offsets):
        w, offset = 2 * np.pi * frequency, marks.offset_values(offsets, robot.n_arms)
        sensors = {"encoder": 2000, "velocity_filter": 5e-3} if coarse else {}
        run = simulate(loaded(load), laws[law](w**2, 2 * w), path, offset, model=robot, **sensors)
        off, torque = shared.draw_distance(picture, run, (2.0, shared.least_torque(robot, 60.0)))
        both = run.energy.sum(), antagonistic_energy(run)
        return {
            "largest error": f"{off.max():.2f} mm",
            "largest jump of a torque": marks.told(np.abs(np.diff(torque, axis=0)).max(), 1, strong) + " mN m",
            "energy": shared.with_antagonism(robot, *(marks.told(v, 2, heat) for v in both)),
        }

    controls = {
        "law": choice("law", laws.keys(), "PD"),
        "frequency": slider("speed of the loop in Hz", 1, 8, 0.5, 5),
        "load": slider("unknown payload in g", 0, 200 * heavier, 20 * heavier, 0),
        "coarse": switch("2000 counts per turn"),
    } | offset_sliders(robot, (4.0, -2.0, 5.0), 10)
    return explorer(draw, controls, shared.distance_panels(robot, 2.5), size=(9.2, 3.8))


def _nearest(lengths, low: int, high: int) -> int:
    """The nearest step of 5 mm to the mean of lengths in m."""
    return int(np.clip(5 * round(200 * float(np.mean(lengths))), low, high))


@shared.ready_made
def own_machine(robot: Manipulator) -> Explorer:
    """A machine in the middle of the triangle, the torques that move it, and those of offsets, which only press.

    It begins with the layout of the base joints and the working mode of the given machine, and with the mean of each of
    its lengths, as near as the sliders come; with those of the testbed where these would not reach the triangle.

    >>> from rapkm_lite import explore; explore.own_machine().numbers["cost of the offsets, at rest everywhere"]
    '3.58 J'
    """
    N, centre = robot.n_arms, robot.base.mean(axis=0)
    along = robot.base - centre
    away = np.linalg.norm(along, axis=1)
    out = along / away.mean()
    modes = {mode_name(mode): mode for mode in working_modes(robot)}
    offset, side = np.resize(OFFSET, N), 0.24 if N > 2 else 0.16
    hotter = shared.hotter(robot, 1.0)
    way = triangle(load(), side, dt=0.02).x

    def built(radius, proximal, distal, **more) -> Manipulator:
        lengths = 1e-3 * np.array([proximal, distal])
        rods = {"lengths": lengths, "masses": ROD * lengths, "centers": None, "inertias": None}
        return robot.replace(base=centre + 1e-3 * radius * out, **rods, **more)

    start = _nearest(away, 200, 320), *(_nearest(lengths, 150, 300) for lengths in robot.lengths.T)
    own = built(*start)
    if not reachable(own, marks.middle(own) + way).all():
        start = 230, 200, 200

    def draw(picture, radius, proximal, distal, load, mode):
        own = built(radius, proximal, distal, load=load, mode=modes[mode])
        middle = marks.middle(own)
        picture.line("machine", *(middle + way).T, color=NEUTRAL, linewidth=1.2, zorder=1)
        if reachable(own, middle):
            marks.draw_machine(picture, "machine", own, inverse_kinematics(own, middle))
        try:
            path = triangle(own, side, dt=0.02, centre=middle)  # a sample for each pixel or two
        except ValueError as error:
            marks.draw_workspace(picture, "machine", own)
            words = "allowed: other links, or base joints nearer to the middle or further from it"
            raise ValueError(f"the triangle is not within what all arms reach (shaded); {words}") from error
        A = act.control_matrix(own, path.q)
        moving = act.inverse_dynamics(own, path.q, path.qd, path.qdd)
        pressing = -GAIN * matvec(act.prestress_projector(A), offset)
        most = max(400.0, 3e3 * float(np.median(np.abs(moving).max(axis=1))))
        shared.curves(picture, "moving", path.t, 1e3 * moving, 20.0, most, beside=1e3 * pressing)
        shared.curves(picture, "pressing", path.t, 1e3 * pressing, 20.0, most, beside=1e3 * moving)
        heat = copper_loss(own, pressing[:-1], path.dt).sum()
        return {
            "largest torque that moves": f"{1e3 * np.abs(moving).max():.0f} mN m",
            "cost of the offsets, at rest everywhere": marks.told(heat, 2, hotter) + " J",
            "largest torques that press": marks.per_drive(1e3 * np.abs(pressing).max(axis=0), 0) + " mN m",
            "smallest σ_min on the triangle": f"{act.singular_values(A)[:, 1].min():.2f} rad/m",
        }

    (left, low), (right, high) = centre - 0.48, centre + 0.48
    wide = {"xlabel": "x in m", "ylabel": "y in m", "aspect": "equal", "xlim": (left, right), "ylim": (low, high)}
    panels = {
        "machine": wide | {"legend": marks.drive_lines(robot)},
        "moving": shared.over_time("torque in mN m", title="Moves"),
        "pressing": shared.over_time("torque in mN m", title="Only presses"),
    }
    controls = {
        "radius": slider("base joints from the middle in mm", 200, 320, 5, start[0]),
        "proximal": slider("proximal links in mm", 150, 300, 5, start[1]),
        "distal": slider("distal links in mm", 150, 300, 5, start[2]),
        "load": slider("load in kg", 0.0, 1.0, 0.1, 0.5),
        "mode": choice("working mode", modes, mode_name(robot.mode)),
    }
    return explorer(draw, controls, panels, size=(10.4, 3.6))
