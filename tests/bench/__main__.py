"""Run times as ratios to C, to our PD law and to MuJoCo, the first result of a session, errors of stiff friction.

    python -m tests.bench [kernels] [laws] [start] [mujoco] [friction]

Default: all.  What is compared runs in turns (A B C A B C ...) in one process; close other programs.
"""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path

import rapkm_lite as rk

from . import kernels, stiff_friction, user_laws, yardsticks

SECTIONS = ("kernels", "laws", "start", "mujoco", "friction")


def main(names: list[str]) -> None:
    unknown = set(names) - set(SECTIONS)
    if unknown:
        sys.exit(f"unknown: {' '.join(sorted(unknown))}; allowed: {' '.join(SECTIONS)}")
    wanted = names or SECTIONS
    robot = rk.load()
    path = rk.triangle(robot)
    load = f", load {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else ""
    print(f"{os.cpu_count()} cores{load}")
    if "kernels" in wanted:
        with tempfile.TemporaryDirectory() as folder:
            if yardsticks.compile_c(Path(folder), 1):
                kernels.check_c(Path(folder), robot)
            else:
                print("no C compiler: no ratios to C")
            kernels.single_runs(robot, Path(folder))
            kernels.studies(robot, Path(folder))
    if "laws" in wanted:
        user_laws.laws(robot, path)
    if "start" in wanted:
        user_laws.start_up(robot, path)
    if "mujoco" in wanted:
        user_laws.mujoco(robot, path)
    if "friction" in wanted:
        stiff_friction.table()


if __name__ == "__main__":
    print(__doc__) if {"-h", "--help"} & {*sys.argv} else main(sys.argv[1:])
