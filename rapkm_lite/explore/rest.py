"""Explorers of offsets: the steady state of PD control, the drives' opinions, the antagonistic energy."""

from __future__ import annotations

from functools import lru_cache, partial

import numpy as np

from ..control.laws import PD
from ..figures import marks
from ..figures.machine import plane_limits
from ..figures.style import ALARM, NEUTRAL, arm_colour, arm_line, arm_text_colour
from ..machine.manipulator import Manipulator
from ..mechanics import actuation as act
from ..mechanics.antagonism import steady_state_error, steady_state_torque
from ..mechanics.kinematics import cross, inverse_kinematics
from ..mechanics.partition import first_best
from ..mechanics.trajectory import hold, triangle
from ..simulation.energy import antagonism_form, copper_loss
from ..simulation.runs import simulate
from . import shared
from .controls import offset_sliders
from .explorer import Explorer, explorer


@shared.ready_made
def steady_state(robot: Manipulator) -> Explorer:
    """Offsets and gains of each drive: the error at rest of theory (14) beside a simulation that settles there.

    >>> from rapkm_lite import explore; explore.steady_state().numbers["rest torque"]
    '-23.6 / -23.4 / -23.6 mN m'
    """
    N, usual, heavier = robot.n_arms, shared.usual_gains(robot), shared.heavier(robot)
    heat = shared.hotter(robot, heavier)
    still = lru_cache(maxsize=64)(lambda x, y: hold(robot, [x, y], 1.5, 2e-3))

    def draw(picture, x, y, **values):
        offset = marks.offset_values(values, N)
        K_P = np.array([values[f"K_P_{i + 1}"] for i in range(N)])
        # Critical damping for the load that the gains are designed for: K_D^2 = 4 J K_P.
        K_D = usual[1] * np.sqrt(K_P / usual[0])
        point, q, stop = shared.held_machine(picture, "plane", robot, x, y)
        A = act.control_matrix(robot, q)
        weight = act.required_wrench(robot, q, 0 * q, 0 * q)
        theory = 1e3 * steady_state_error(A, K_P, offset, weight)
        torque = 1e3 * steady_state_torque(A, K_P, offset, weight)
        run = simulate(robot, PD(K_P, K_D), still(*point), offset)
        error, held = 1e3 * run.error, 1e3 * run.c[-1]
        moves = bool(np.abs(error[-1] - error[-100]).max() > 0.02 * np.abs(error).max())
        shared.curves(picture, "error", run.t, error, 1.0, beside=theory)
        for i in range(N):
            picture.line("error", run.t[[0, -1]], theory[[i, i]], color=arm_colour(i), linewidth=0.9, linestyle=":")
        marks.bars(picture, "rest", [(theory, {"alpha": 0.45}), (error[-1], {})], form=".1f")
        picture.fit("rest", 1.25 * theory, 1.25 * error[-1], least=1.0)
        marks.bars(picture, "torque", [(torque, {"alpha": 0.45}), (held, {})], form=".0f", times=heavier)
        picture.fit("torque", 1.25 * torque, 1.25 * held, least=shared.least_torque(robot, 10.0))
        return {
            "error at rest, theory": marks.per_drive(theory, 2) + " mrad",
            "simulated": marks.per_drive(error[-1], 2) + " mrad" + ", not at rest yet" * moves,
            "largest difference": f"{1e3 * np.abs(theory - error[-1]).max():.1f} µrad",
            "rest torque": marks.per_drive(held, 1, heavier) + " mN m",
            "heat at rest": marks.told(copper_loss(robot, 1e-3 * held[None], 1.0).sum(), 3, heat) + " W",
        } | stop

    space = partial(marks.draw_workspace, panel="plane", robot=robot)
    wide = {"color": NEUTRAL, "linewidth": 7}
    both = [("theory", wide | {"alpha": 0.45}), ("simulated", wide)]
    panels = {
        "plane": plane_limits(robot, 0.05),
        "error": shared.over_time("angle error in mrad", 1.5, robot),
        "rest": {"ylabel": "error at rest in mrad", "legend": both, **marks.drive_axis(N)},
        "torque": {"ylabel": "torque at rest in mN m", **marks.drive_axis(N)},
    }
    controls = offset_sliders(robot, (5.0, -3.0, 8.0))
    controls |= {f"K_P_{i + 1}": shared.gain_slider(robot, f"K_P {i + 1} in N m/rad") for i in range(N)}
    controls |= shared.place_sliders(robot, 0, 0)
    layout = [["plane", "error"], ["rest", "torque"]]
    return explorer(draw, controls, panels, layout=layout, size=(9.2, 6.2), setup=space)


@shared.ready_made
def three_opinions(robot: Manipulator) -> Explorer:
    """Where each drive wants the end-effector: drag a line; where all of them meet, the torques vanish.

    >>> from rapkm_lite import explore; explore.three_opinions().set(offset_2=0).numbers["distances from the lines"]
    '0.65 / 0.88 / 0.72 mm'
    """
    N, heavier = robot.n_arms, shared.heavier(robot)
    heat = shared.hotter(robot, heavier)

    def draw(picture, x, y, K_P, **offsets):
        offset = marks.offset_values(offsets, N)
        point, words = marks.reached(robot, 1e-3 * np.array([x, y]), 2e-3 * shared.size(robot))
        q = inverse_kinematics(robot, point)
        A, weight = act.control_matrix(robot, q), act.required_wrench(robot, q, 0 * q, 0 * q)
        torque = 1e3 * steady_state_torque(A, K_P, offset, weight)
        # Drive i is content on the line A_i p = -offset_i of points p about the desired one; all lengths in mm.
        rest = 1e3 * np.linalg.lstsq(A, steady_state_error(A, K_P, offset, weight), rcond=None)[0]
        size, half = np.linalg.norm(A, axis=1), picture.ylim("opinions")[1]
        normal, level = A / size[:, None], -1e3 * offset / size
        along, seen = np.stack([-normal[:, 1], normal[:, 0]], axis=-1), [rest]
        for i in range(N):
            ends = level[i] * normal[i] + np.outer([-3 * half, 3 * half], along[i])
            target = rest + (level[i] - normal[i] @ rest) * normal[i]
            picture.line("opinions", *ends.T, **arm_line(i) | {"linewidth": 2.4})
            picture.line("opinions", *np.stack([rest, target]).T, color=arm_colour(i), linewidth=6, alpha=0.55)
            # The knob slides along its line until it is in the panel.
            places = level[i] * normal[i] + half * np.outer(np.linspace(0.72, -0.72, 145), along[i])
            seen.append(places[np.argmin(np.maximum(np.abs(places).max(axis=1), 0.88 * half))])
            picture.handle("opinions", *seen[-1], grip=ends, **{f"offset_{i + 1}": (-A[i, 0], -A[i, 1])})
        for i, knob in enumerate(seen[1:]):
            # Its number is beside it, where there is room for it between the lines and all else that is seen.
            way, side = half * np.outer(np.linspace(-1, 1, 41), along[i]), 0.14 * half * normal[i]
            spots = np.concatenate([knob + way + side, knob + way - side])
            far = 0.7 * np.linalg.norm(spots[:, None] - seen, axis=-1)
            room = np.hstack([far, np.abs(spots @ normal.T - level), 2 * half - 2 * np.abs(spots)]).min(axis=1)
            seen.append(spots[first_best(20 * room - far[:, i + 1])])
            look = {"color": arm_text_colour(i), "fontweight": "bold", "ha": "center", "va": "center"}
            picture.text("opinions", *seen[-1], f"{i + 1}", **look)
        if N == 3 and np.abs(cross(normal, np.roll(normal, 1, axis=0))).min() > 1e-9:
            corners = [np.linalg.solve(normal[[j, k]], level[[j, k]]) for j in range(N) for k in range(j)]
            if max(np.ptp(corners, axis=0)) < 1000 * half:  # else two lines are all but parallel
                picture.polygon("opinions", corners, facecolor="#DCE6F0", zorder=0.5)
        picture.line("opinions", 0, 0, color=NEUTRAL, marker="+", markersize=13, markeredgewidth=2, zorder=5)
        tip = {"marker": "s", "markersize": 8, "markerfacecolor": "white", "markeredgewidth": 1.8}
        picture.line("opinions", *rest, color=NEUTRAL, zorder=6, **tip)
        if np.abs(rest).max() > half:
            far_off = f"at rest outside, {np.hypot(*rest):.1f} mm away"
            picture.text("opinions", 0.02, 0.97, far_off, inside=True, va="top", fontsize=9, color=ALARM)
        marks.bars(picture, "torque", [(torque, {})], width=0.6, form=".1f", times=heavier)
        picture.fit("torque", 1.25 * torque, least=shared.least_torque(robot, 10.0))
        return {
            "rest": f"({rest[0]:z.2f}, {rest[1]:z.2f}) mm beside the desired point",
            "distances from the lines": marks.per_drive(np.abs(normal @ rest - level), 2) + " mm",
            "torque at rest": marks.per_drive(torque, 1, heavier) + " mN m",
            "heat at rest": marks.told(copper_loss(robot, 1e-3 * torque[None], 1.0).sum(), 3, heat) + " W",
        } | ({"desired point": words} if words else {})

    seen = (-3 * shared.size(robot), 3 * shared.size(robot))
    away = {"xlabel": "x − desired x in mm", "ylabel": "y − desired y in mm", "xlim": seen, "ylim": seen}
    panels = {
        "opinions": away | {"aspect": "equal", "title": "Where each drive is content"},
        "torque": {"ylabel": "torque at rest in mN m", **marks.drive_axis(N)},
    }
    controls = offset_sliders(robot, (5.0, -3.0, 8.0), 12) | {"K_P": shared.gain_slider(robot)}
    controls |= shared.place_sliders(robot, 20, 30, -100, 100, 5, "desired ")
    return explorer(draw, controls, panels, widths=[1.4, 1], size=(9.2, 5.0), live=True)


@shared.ready_made
def landscape(robot: Manipulator) -> Explorer:
    """Level lines of the antagonistic energy over two offsets, and the share of each principal direction.

    For three arms or more.

    >>> from rapkm_lite import explore; explore.landscape().numbers["antagonistic energy"]
    '2.83 J'
    """

    @lru_cache(maxsize=64)
    def form(side: int, shift: int) -> np.ndarray:
        path = triangle(robot, side / 1e3, dt=0.01, centre=shared.place(robot)[0] + [1e-3 * shift, 0.0])
        return 1e-6 * antagonism_form(robot, path, 1.0)

    controls: dict = offset_sliders(robot, (4.0, -2.0, 5.0), 10) | {
        "K_P": shared.gain_slider(robot, high=30.0),
        "side": shared.path_slider(robot, "side of the triangle in mm", 20, 240, 10, 120, 1.0),
        "shift": shared.path_slider(robot, "triangle moved to the right in mm", -60, 60, 5, 40, 0.4),
    }
    wheel = np.array([(np.cos(a), np.sin(a)) for a in np.linspace(0, 2 * np.pi, 181)]).T

    def draw(picture, K_P, side, shift, **offsets):
        if robot.n_arms < 3:
            raise ValueError(f"this machine has {robot.n_arms} arms and no antagonism; allowed: at least 3 arms")
        S = K_P**2 * form(side, shift)
        # J; where controls start on the testbed, 0.5 to 16.
        levels = 2.0 ** (np.arange(-1, 5) + np.round(np.log2(max(np.trace(S), 1e-300) / 0.3)))
        dq = np.array(list(offsets.values()))
        # E = (u - u0)^T S11 (u - u0) + rest, with u the first two offsets.
        S11, S12 = S[:2, :2], S[:2, 2:]
        centre = -np.linalg.solve(S11, S12 @ dq[2:])
        rest = dq[2:] @ S[2:, 2:] @ dq[2:] - centre @ S11 @ centre
        root, taken = np.linalg.inv(np.linalg.cholesky(S11)).T, [dq[:2]]
        for k, level in enumerate(levels):
            if level > rest:
                ring = centre[:, None] + np.sqrt(level - rest) * root @ wheel
                shade = str(0.62 - 0.55 * k / (len(levels) - 1))
                picture.line("map", *ring, color=shade, linewidth=1.6)
                # The number stands where the lines are far apart, and on no other; `half` is of its width.
                words = f"{float(f'{level:.3g}'):g}"
                away, half = np.hypot(*(ring - centre[:, None])) + 1e-3 * ring[1], max(2.0, 0.45 * len(words))
                away[np.abs(ring).max(axis=0) > 12.5 - half] = -1.0
                for other in taken:
                    away[np.all(np.abs(ring.T - other) < [2 * half, 1.8], axis=1)] = -1.0
                k = np.argmax(away)
                if away[k] > 0 and np.ptp(ring[0]) > 3 * half:
                    taken.append(ring[:, k])
                    look = {"color": min(shade, "0.45"), "ha": "center", "va": "center"}
                    picture.text("map", *ring[:, k], words, fontsize=9, **look)
        picture.line("map", *dq[:2], color=ALARM, marker="D", markersize=8, linestyle="none", zorder=4)
        picture.handle("map", *dq[:2], offset_1=(1, 0), offset_2=(0, 1))
        costs, directions = np.linalg.eigh(S)
        shares = costs * (directions.T @ dq) ** 2
        for k, share in enumerate(shares):
            picture.bar("shares", k + 1, share, 0.6, facecolor=NEUTRAL)
            words = marks.told(share, 2, 2 * levels[0])
            picture.text("shares", k + 1, share, words, ha="center", va="bottom", fontsize=9 if len(words) < 7 else 7)
        picture.fit("shares", 1.2 * shares, symmetric=False, least=levels[0])
        step = min(0.22, 0.88 / robot.n_arms)
        directions *= np.where(directions.sum(axis=0) < 0, -1, 1)
        for (i, k), component in np.ndenumerate(directions):
            at = k + 1 + step * (i - (robot.n_arms - 1) / 2)
            picture.bar("directions", at, component, step / 1.1, facecolor=arm_colour(i))
            va = "bottom" if component >= 0 else "top"
            picture.text("directions", at, component, str(i + 1), ha="center", va=va, fontsize=9)
        marks.zero_line(picture, "directions")
        return {
            "antagonistic energy": marks.told(dq @ S @ dq, 2, 2 * levels[0]) + " J",
            "trace of S": marks.told(np.trace(S), 3, 2 * levels[0]) + " J/mrad²",
            "principal costs": marks.per_drive(np.maximum(costs, 0), 3, 2 * levels[0]) + " J/mrad²",
        }

    arms = [(words, {"color": look["color"], "linewidth": 7}) for words, look in marks.drive_lines(robot)]
    ticks = {"xlim": (0.5, robot.n_arms + 0.5), "xticks": range(1, robot.n_arms + 1)}
    ticks |= {"xlabel": "principal direction, cheapest first"}
    frame = {"xlim": (-12, 12), "ylim": (-12, 12), "aspect": "equal"}
    panels = {
        "map": {"title": "Energy in J", "xlabel": "offset 1 in mrad", "ylabel": "offset 2 in mrad"} | frame,
        "shares": {"ylabel": "energy in J", "ylim": (0, 5), **ticks},
        "directions": {"ylabel": "share of each drive's offset", "ylim": (-1.2, 1.2), "legend": arms, **ticks},
    }
    return explorer(draw, controls, panels, size=(9.4, 3.8))
