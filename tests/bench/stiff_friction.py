"""Runs with stiff friction next to SciPy's LSODA at its tightest: largest distance of the end-effector."""

from __future__ import annotations

import numpy as np

import rapkm_lite as rk

from ..reference import reference
from .kernels import OFFSET, PD

FRICTION = (0.0, 4.2e-3, 0.03, 0.1, 0.3, 1.0)
VELOCITY = (1e-4, 3e-4, 1e-3, 3e-3, 0.01, 0.03, 0.1)


def distance(robot, path, samples: int | None = None) -> tuple[float, float]:
    """Largest distance to LSODA in m of a single run and of a row of a sweep, which is known at its end only."""
    states = reference(robot, PD, path, OFFSET, samples=samples, method="LSODA", rtol=1e-12, atol=1e-15)[0]
    run = rk.simulate(robot, PD, path, OFFSET)
    row = rk.sweep(robot, PD, path, OFFSET[None])
    return (
        float(np.linalg.norm(run.x[: len(states)] - states[:, :2], axis=-1).max()),
        float(np.linalg.norm(row.x_final[0] - states[-1, :2])),
    )


def table() -> None:
    """Print the distances over friction and its velocity, on a fast circle and at rest."""
    print("\nFriction against LSODA, largest distance in m over 0.3 s (in brackets: a sweep at the end)")
    for name, make in (
        ("fast circle", lambda robot: rk.circle(robot, 0.1, 0.3)),
        ("at rest", lambda robot: rk.hold(robot, (0.02, 0.03), 0.3)),
    ):
        print(f"{name:12}" + "".join(f"{f'v0 = {1e3 * v:g} mrad/s':>21}" for v in VELOCITY))
        for f in FRICTION:
            robots = [rk.load().replace(friction=f, friction_velocity=v) for v in VELOCITY]
            worst = [distance(robot, make(robot)) for robot in robots]
            print(f"{f:5g} N m   " + "".join(f"{f'{a:.1e} ({b:.1e})':>21}" for a, b in worst), flush=True)
