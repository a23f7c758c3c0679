"""Explorer of the antagonistic energy as a quadratic form of the offsets."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ..figures.style import ALARM, NEUTRAL, arm_colour
from ..machine.manipulator import Manipulator
from ..mechanics.trajectory import triangle
from ..simulation.energy import antagonism_form
from .controls import log_slider, offset_sliders, slider
from .explorer import Explorer, explorer
from .geometry import frictionless

# Energies in J of the level lines.
LEVELS = (0.5, 1.0, 2.0, 4.0, 8.0, 16.0)


def landscape(robot: Manipulator | None = None) -> Explorer:
    """Level lines of the antagonistic energy over two offsets, and the share of each principal direction."""
    robot = frictionless(robot)

    @lru_cache(maxsize=64)
    def form(side: int, shift: int) -> np.ndarray:
        path = triangle(robot, 1e-3 * side, dt=0.01, centre=robot.base.mean(axis=0) + [1e-3 * shift, 0.0])
        return 1e-6 * antagonism_form(robot, path, 1.0)

    circle = np.linspace(0, 2 * np.pi, 181)
    wheel = np.stack([np.cos(circle), np.sin(circle)])

    def draw(picture, K_P, side, shift, **offsets):
        if robot.n_arms < 3:
            raise ValueError(f"this machine has {robot.n_arms} arms and no antagonism; allowed: at least 3 arms")
        S = K_P**2 * form(side, shift)
        dq = np.array(list(offsets.values()))
        # E = (u - u0)^T S11 (u - u0) + rest, with u the first two offsets.
        S11, S12 = S[:2, :2], S[:2, 2:]
        centre = -np.linalg.solve(S11, S12 @ dq[2:])
        rest = dq[2:] @ S[2:, 2:] @ dq[2:] - centre @ S11 @ centre
        root = np.linalg.inv(np.linalg.cholesky(S11)).T
        for k, level in enumerate(LEVELS):
            if level > rest:
                ring = centre[:, None] + np.sqrt(level - rest) * root @ wheel
                shade = str(0.62 - 0.55 * k / (len(LEVELS) - 1))
                picture.line("map", *ring, color=shade, linewidth=1.6)
                if np.abs(ring[:, 45]).max() < 11:
                    picture.text("map", *ring[:, 45], f"{level:g} J", fontsize=9, color=shade, va="bottom")
        picture.line("map", *dq[:2], color=ALARM, marker="D", markersize=8, linestyle="none", zorder=4)
        picture.handle("map", *dq[:2], offset_1=(1, 0), offset_2=(0, 1))
        costs, directions = np.linalg.eigh(S)
        shares = costs * (directions.T @ dq) ** 2
        for k, share in enumerate(shares):
            picture.bar("shares", k + 1, share, 0.6, facecolor=NEUTRAL)
            picture.text("shares", k + 1, share, f"{share:.2f}", ha="center", va="bottom", fontsize=9)
        picture.fit("shares", 1.2 * shares, symmetric=False, least=0.5)
        for i in range(robot.n_arms):
            for k in range(robot.n_arms):
                at = k + 1 + 0.22 * (i - (robot.n_arms - 1) / 2)
                component = directions[i, k] * np.sign(directions[:, k].sum() or 1)
                picture.bar("directions", at, component, 0.2, facecolor=arm_colour(i))
        picture.line("directions", [0.5, robot.n_arms + 0.5], [0, 0], color=NEUTRAL, linewidth=0.8)
        return {
            "antagonistic energy": f"{dq @ S @ dq:.2f} J",
            "trace of S": f"{np.trace(S):.3f} J/mrad²",
            "principal costs": " / ".join(f"{c:.3f}" for c in np.maximum(costs, 0)) + " J/mrad²",
        }

    def setup(picture):
        arms = [(str(i + 1) if i else "drive 1", {"color": arm_colour(i), "linewidth": 7}) for i in range(robot.n_arms)]
        picture.legend("directions", arms)

    ticks = {"xlim": (0.5, robot.n_arms + 0.5), "xticks": range(1, robot.n_arms + 1)}
    ticks |= {"xlabel": "principal direction, cheapest first"}
    frame = {"xlim": (-12, 12), "ylim": (-12, 12), "aspect": "equal"}
    panels = {
        "map": {"xlabel": "offset 1 in mrad", "ylabel": "offset 2 in mrad"} | frame,
        "shares": {"ylabel": "energy in J", "ylim": (0, 5), **ticks},
        "directions": {"ylabel": "share of each drive's offset", "ylim": (-1.05, 1.05), **ticks},
    }
    controls = offset_sliders(robot, (4.0, -2.0, 5.0), 10)
    controls |= {
        "K_P": log_slider("K_P in N m/rad", 1.0, 30.0, 7.05),
        "side": slider("side of the triangle in mm", 20, 240, 10, 120),
        "shift": slider("triangle moved to the right in mm", -60, 60, 5, 40),
    }
    about = (
        "Level lines of the antagonistic energy over two offsets, the share of each principal direction in it, and "
        "what these directions are."
    )
    return explorer(draw, controls, panels, size=(9.4, 3.8), setup=setup, about=about)
