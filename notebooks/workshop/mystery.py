"""Make the logs data/mystery_runs/*.csv: python notebooks/build.py mystery

offset_a : rests in the three corners of the testbed's triangle.
offset_b : the same with a triangle of a quarter of the side, where the three rests are nearly alike.
offset_c : rest at one place.
gain     : like offset_a, and one drive has another gain.
Records at 100 Hz; the torques carry the noise of a current sensor, 1 mN m.  A log begins when the machine has settled:
a run starts at the desired point, where measured minus desired angles would be the offsets themselves.
"""

from pathlib import Path

import numpy as np

import rapkm_lite as rk
from rapkm_lite.lessons.mystery import K_D, hidden, random_numbers
from rapkm_lite.machine.logs import columns

LOGS = Path(__file__).resolve().parents[2] / "data" / "mystery_runs"
SIDES = {"offset_a": 0.24, "offset_b": 0.06, "offset_c": 0.0, "gain": 0.24}
SETTLING = 1.5


def record(name: str) -> np.ndarray:
    """The table (records, 10) of one log, columns as in `rk.read_log`."""
    robot = rk.load()
    if SIDES[name]:
        # A corner named twice is an edge of no length: 1.5 s of rest in each corner, 1.5 s on each edge.
        turned = np.deg2rad([210.0, 210.0, 210.0, 330.0, 330.0, 90.0, 90.0])
        corners = SIDES[name] / np.sqrt(3) * np.stack([np.cos(turned), np.sin(turned)], axis=-1)
        path = rk.polygon(robot, corners, duration=10.5)
    else:
        path = rk.hold(robot, [0.04, -0.05], duration=4.5)
    rng = random_numbers(name)
    offset, gains = hidden(name, rng)
    run = rk.simulate(robot, rk.PD(gains, K_D), path, offset)
    torque = run.c + rng.normal(0.0, 1e-3, run.c.shape)
    return np.column_stack([run.t - SETTLING, run.q_a + offset, path.q_a, torque])[round(SETTLING / run.dt) :: 10]


def write(folder: Path = LOGS) -> None:
    """Write the four logs."""
    folder.mkdir(exist_ok=True)
    for name in SIDES:
        np.savetxt(
            folder / f"{name}.csv",
            record(name),
            delimiter=",",
            header=",".join(columns(3)),
            comments="",
            fmt=["%.2f"] + 6 * ["%.5f"] + 3 * ["%.4f"],
        )
