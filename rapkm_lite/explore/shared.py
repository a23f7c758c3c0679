"""What several explorers share: the machine they start from, its end-effector by hand, curves over time."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache, wraps
from inspect import signature

import numpy as np

from ..figures import marks
from ..figures.maps import grid_points
from ..figures.style import AFTER, ALARM
from ..machine.manipulator import Manipulator, load
from ..mechanics.actuation import control_matrix, force_polygon, inverse_dynamics
from ..mechanics.dynamics import minimal_dynamics
from ..mechanics.kinematics import inverse_kinematics
from ..mechanics.maps import sampling_box
from ..mechanics.trajectory import Trajectory, triangle
from .controls import log_slider, slider
from .explorer import Explorer


def ready_made(make: Callable, friction: bool = False) -> Callable[..., Explorer]:
    """An explorer of the package, of the testbed, with its friction or without, where no machine is given.

    Its line of code has its name; a machine that was given is called robot there.
    """

    def made(robot: Manipulator | None = None) -> Explorer:
        testbed = load() if friction else load().replace(friction=0.0)
        shown = make(testbed if robot is None else robot)
        shown.made = f"explore.{make.__name__}({'' if robot is None else 'robot'})"
        return shown

    made.__dict__["__signature__"] = signature(made)  # `wraps` would take that of `make`
    return wraps(make)(made)


def size(robot: Manipulator) -> float:
    """Width of the workspace relative to the testbed's, rounded to 1, 2 or 5 times a power of ten."""
    left, right, low, high = sampling_box(robot)
    return rounded(max(min(right - left, high - low), 1e-6) / 0.4)


def rounded(ratio: float) -> float:
    """1, 2 or 5 times a power of ten, that is at most 1.25 times the ratio."""
    power = 10 ** math.floor(math.log10(1.25 * ratio))
    return next(n for n in (5, 2, 1) if n * power <= 1.25 * ratio) * power


def decimals(times: float) -> int:
    """Decimals of a singular value in rad/m, two on the testbed, on a machine so many times as large.

    >>> [decimals(times) for times in (0.01, 0.5, 1, 2, 100)]
    [0, 2, 2, 2, 4]
    """
    return max(0, 2 + round(math.log10(times)))


def carried(robot: Manipulator) -> float:
    """What a gain of PD in N m/rad has to carry for one in 1/s^2, N m s^2: the mean of both modes in the middle.

    Where that is out of reach, the median over the workspace.
    """

    def mean(x) -> np.ndarray:
        q = inverse_kinematics(robot, x)
        A, inertia = control_matrix(robot, q), minimal_dynamics(robot, q, 0 * q, None)[0]
        return 2 / np.trace(np.linalg.solve(inertia, A.mT @ A), axis1=-2, axis2=-1)

    try:
        return float(mean(marks.middle(robot)))
    except ValueError:
        return float(np.median(mean(grid_points(robot, 41)[3])))


@lru_cache(maxsize=8)
def usual_gains(robot: Manipulator) -> tuple[float, float]:
    """K_P in N m/rad and K_D in N m s/rad that make a machine about as fast as the testbed's make the testbed."""
    heavier = rounded(carried(robot) / carried(load()))
    return heavier * 7.05, heavier * 0.225


def heavier(robot: Manipulator) -> float:
    """How many times the testbed's torques those of PD are."""
    return usual_gains(robot)[0] / 7.05


def hotter(robot: Manipulator, times: float) -> float:
    """How many times the testbed's heat that of torques is that are `times` the testbed's, with the robot's motors.

    >>> import rapkm_lite as rk; geared = rk.load().replace(torque_constant=10 * 0.0259)
    >>> hotter(rk.load(), 3.0), round(hotter(geared, 3.0), 12)
    (9.0, 0.09)
    """
    watts, testbed = (np.mean(r.resistance / r.torque_constant**2) for r in (robot, load()))  # of 1 N m
    return float(times**2 * watts / testbed)


def with_antagonism(robot: Manipulator, energy: str, antagonism: str) -> str:
    """Both in J; of motors that are not equal the heat of all torques is not that of their two parts together.

    >>> import rapkm_lite as rk
    >>> with_antagonism(rk.load(), "5", "3"), with_antagonism(rk.load().replace(resistance=[1, 1, 2]), "5", "3")
    ('5 J, of which antagonism 3 J', '5 J, antagonism 3 J')
    """
    part = "of which " if np.ptp(robot.resistance / robot.torque_constant**2) == 0.0 else ""
    return f"{energy} J, {part}antagonism {antagonism} J"


def least_torque(robot: Manipulator, torque: float) -> float:
    """How far a panel of torques goes at least: the testbed's number, less where the usual gains are lower."""
    return torque * min(1.0, heavier(robot))


def gain_slider(robot: Manipulator, label: str = "K_P in N m/rad", low: float = 1.0, high: float = 50.0):
    """A slider of K_P; the numbers are the testbed's."""
    return log_slider(label, heavier(robot) * low, heavier(robot) * high, heavier(robot) * 7.05)


def length_slider(robot, label: str, low: float, high: float, step: float, value: float, middle: float = 0.0):
    """A slider of a length in mm; the numbers are the testbed's, scaled to the robot and shifted by `middle` in m."""
    low, high, step, value = (size(robot) * v for v in (low, high, step, value))
    first = step * round(1e3 * middle / step)
    return slider(label, first + low, first + high, step, first + value)


def place_sliders(robot, x: int, y: int, low: int = -200, high: int = 230, step: int = 2, which: str = "") -> dict:
    """Sliders x and y in mm around `marks.middle` and `place`, (x, y) from which they begin; numbers of the testbed."""
    right, up = middle = marks.middle(robot)
    x0, y0 = (step * round(v / (1e-3 * step * size(robot))) for v in place(robot)[0] - middle)
    return {
        "x": length_slider(robot, f"{which}x in mm", low + min(x0, 0), max(x0, 0) - low, step, x0 + x, right),
        "y": length_slider(robot, f"{which}y in mm", low + min(y0, 0), max(y0, 0) + high, step, y0 + y, up),
    }


@lru_cache(maxsize=8)
def place(robot: Manipulator) -> tuple[np.ndarray, float]:
    """Where paths lie, (2,) in m, and the radius in m of a circle about it that all arms reach.

    The middle of the drives, or, where that has less room than 30 mm on the testbed, the place with the most.
    """
    point = marks.middle(robot)
    if marks.room(robot, point) < 0.03 * size(robot):
        point = max(point, marks.roomiest(robot), key=lambda x: marks.room(robot, x))
    return point, float(marks.room(robot, point))


def path_slider(robot, label: str, low: int, high: int, step: int, value: int, times: float = 1.6):
    """A `length_slider` of a path that begins with `value`, or, if less, with `times` the radius of `place`."""
    value = min(value, max(step, step * math.floor(1e3 * times * place(robot)[1] / size(robot) / step)))
    return length_slider(robot, label, min(low, value), high, step, value)


def central_triangle(robot: Manipulator, side: float, **times) -> Trajectory:
    """The triangle of `side` in mm about the `place` of paths."""
    return triangle(robot, side / 1e3, centre=place(robot)[0], **times)  # 0.35, where 1e-3 * 350 is not


def fitting_triangle(robot: Manipulator, side: float = 240, **times) -> Trajectory:
    """The triangle where no slider changes it; `side` in mm of the testbed, up to 160 on two arms, or what fits."""
    side = min(side, 240 if robot.n_arms > 2 else 160) * size(robot)
    return central_triangle(robot, min(side, 1.6e3 * place(robot)[1]), **times)


def torque_scale(robot: Manipulator) -> float:
    """How many times the testbed's torques a triangle takes, 1, 2 or 5 times a power of ten."""
    path = fitting_triangle(robot, 120, duration=2.5, dt=2e-3)
    needed = np.abs(inverse_dynamics(robot, path.q, path.qd, path.qdd)).max(axis=1)
    # Beside a place that two arms cannot cross no limit is wide enough.
    return rounded(min(needed.max(), 10 * np.median(needed)) / 0.055)


def held_machine(picture, panel: str, robot: Manipulator, x: float, y: float, mode=None):
    """The machine with a handle on its end-effector, on the way to (x, y) in mm.

    Its place (2,) in m, its pose (2N,), and where it stops, in words, when the arms do not reach (x, y).
    """
    point, words = marks.reached(robot, 1e-3 * np.array([x, y]), 2e-3 * size(robot))
    q = inverse_kinematics(robot, point, mode)
    marks.draw_machine(picture, panel, robot, q)
    picture.handle(panel, *point, x=(1e3, 0), y=(0, 1e3))
    return point, q, {"end-effector": words} if words else {}


def force_panel(limit: float) -> dict:
    """Keywords of a panel of forces at the end-effector, up to `limit` in N."""
    square = {"aspect": "equal", "xlim": (-limit, limit), "ylim": (-limit, limit)}
    return {"xlabel": "f_x in N", "ylabel": "f_y in N"} | square


def draw_forces(picture, A, torque: float) -> np.ndarray:
    """All forces of torques up to `torque` in mN m, in the panel "force"; the corners (2m, 2) in N."""
    corners = force_polygon(A, 1e-3 * torque)
    picture.polygon("force", corners, facecolor="#DCE6F0", edgecolor=AFTER, linewidth=1.5, zorder=0.5)
    return corners


def over_time(ylabel: str, end: float = 5.0, robot: Manipulator | None = None, **more) -> dict:
    """Keywords of a panel of curves over time up to `end` in s, with a legend of the drives of `robot`."""
    legend = {} if robot is None else {"legend": marks.drive_lines(robot)}
    return {"xlabel": "time in s", "ylabel": ylabel, "xlim": (0, end)} | legend | more


def curves(picture, panel: str, t, values, least: float, most: float = np.inf, beside=()) -> None:
    """A curve for each drive, values (k, N), and limits that hold them and what is `beside`, up to `most`.

    Where the curves go on beyond the limits, a word says how far.
    """
    marks.traces(picture, panel, t, values)
    picture.fit(panel, values, beside, least=least, most=most)
    farthest = np.ravel(values)[np.argmax(np.abs(values))]
    if abs(farthest) > picture.ylim(panel)[1]:
        words = f"goes on to {farthest:.0f}".replace("-", "−")
        picture.text(panel, 0.02, 0.97, words, inside=True, va="top", fontsize=9, color=ALARM)


def distance_panels(robot: Manipulator, end: float, torque: str = "torque in mN m") -> dict:
    """The panels of `draw_distance`."""
    return {"error": over_time("path error in mm", end), "torque": over_time(torque, end, robot)}


def draw_distance(picture, run, least: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
    """Path error of a run (k,) in mm, torques (k, N) in mN m; least: limits, mm on the testbed."""
    off, torque = 1e3 * run.path_error, 1e3 * run.c
    picture.trace("error", run.t, off, color=ALARM)
    picture.fit("error", off, symmetric=False, least=least[0] * size(run.robot))
    curves(picture, "torque", run.t, torque, least[1])
    return off, torque
