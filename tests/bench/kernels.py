"""The engine's kernels next to C, and next to its own PD law: single runs, and runs side by side on one core."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import rapkm_lite as rk
from rapkm_lite.simulation import compiled
from rapkm_lite.simulation.chunks import Columns
from rapkm_lite.simulation.energy import antagonistic_energy
from rapkm_lite.simulation.sensors import Sensors
from rapkm_lite.simulation.setup import prepare

from . import yardsticks
from .turns import OWN_TIME, in_turns

OFFSET = np.array([4e-3, -2e-3, 5e-3])
BLOCK = np.random.default_rng(0).normal(0.0, 5e-3, (compiled.LANES, 3))
PD = rk.PD(7.05, 0.225)
FILTER, TRUE_FILTER = rk.AntagonismFilter(PD), rk.AntagonismFilter(PD, pose="true")
# What the C kernel is told to do for the same law: filtered, measured pose.
IN_C = {"PD": (0, 0), "filter, true pose": (1, 0), "filter, measured pose": (1, 1)}
LAWS = {
    "PD": PD,
    "filter, true pose": TRUE_FILTER,
    "filter, measured pose": FILTER,
    "RedundantCTC": rk.RedundantCTC(900.0, 60.0),
    "CTC in x": rk.CTC(900.0, 60.0, None),
    "SwitchedCTC": rk.SwitchedCTC(900.0, 60.0),
    "PD, small triangle": PD,
    "CTC of a pair, small triangle": rk.CTC(900.0, 60.0, (0, 1)),
}


def cases(robot):
    """Name, robot, law, path of every case, without and with friction.

    The small triangle meets no singularity of a pair.
    """
    for text, machine in (("", robot.replace(friction=0.0)), (", friction", robot)):
        paths = {False: rk.triangle(machine), True: rk.triangle(machine, side=0.14)}
        for name, law in LAWS.items():
            yield name + text, machine, law, paths["small" in name]


def own_pd(name: str) -> str:
    """The PD case that a case is compared with."""
    return "PD" + ", small triangle" * ("small" in name) + ", friction" * ("friction" in name)


def single(robot, law, path):
    """One run of the kernel, without making results."""
    setup = prepare(robot, path, Sensors(OFFSET))
    code = compiled.encode(law, setup)
    return lambda: compiled.single(setup, code)


def block(robot, law, path):
    """As many runs as the kernel takes side by side, in one thread."""
    setup = prepare(robot, path, Sensors())
    code = compiled.encode(law, setup)
    columns = Columns.blank(*BLOCK.shape)[:-1]
    return lambda: compiled.many(setup, dict.fromkeys(range(len(BLOCK)), code), BLOCK, columns)


def yards(folder: Path, robot, lanes: int, kinds) -> dict:
    """C kernels by friction and kind of `IN_C`; none without a compiler."""
    jobs = {}
    for friction, machine in ((False, robot.replace(friction=0.0)), (True, robot)):
        function = yardsticks.compile_c(folder, lanes, friction)
        for kind in kinds if function else ():
            jobs[f"C {friction} {kind}"] = yardsticks.c_run(
                function, lanes, machine, rk.triangle(machine), OFFSET if lanes == 1 else BLOCK[:lanes], *IN_C[kind]
            )
    return jobs


def check_c(folder: Path, robot) -> None:
    """The C kernel does the same job: equal torques, and equal energies in lanes.

    With friction on a smooth bend of the friction law, because the C kernel takes no substeps.
    """
    robot = robot.replace(friction_velocity=5.0)
    machines = {False: robot.replace(friction=0.0), True: robot}
    scalar, vector = yards(folder, robot, 1, IN_C), yards(folder, robot, 8, IN_C)
    for name in scalar:
        _, friction, kind = name.split(" ", 2)
        machine = machines[friction == "True"]
        path = rk.triangle(machine)
        assert np.abs(scalar[name]()[0][:, 10:] - rk.simulate(machine, LAWS[kind], path, OFFSET).c).max() < 1e-11
        expected = antagonistic_energy(rk.simulate(machine, LAWS[kind], path, BLOCK[7]))
        assert abs(vector[name]()[1][7, 7] * path.dt - expected) < 1e-11


def single_runs(robot, folder: Path) -> None:
    """Print single runs: times, and ratios to C without and with friction and to our PD."""
    jobs = {name: single(machine, law, path) for name, machine, law, path in cases(robot)}
    against = yards(folder, robot, 1, IN_C)
    t = in_turns(25, OWN_TIME, True, **jobs, **against)
    print("\nOne run of 5 s, kernel alone; medians in turns (in brackets: shortest times)")
    print(f"{'':40}{'ms':>6}{'/ C':>14}{'/ C, friction':>15}{'/ our PD':>14}")
    for name in jobs:
        kind = name.removesuffix(", friction")
        columns = [t[name].over(t[yard]) if yard in against else "" for yard in (f"C False {kind}", f"C True {kind}")]
        print(
            f"{name:40}{1e3 * t[name].median:6.2f}{columns[0]:>14}{columns[1]:>15}{t[name].over(t[own_pd(name)]):>14}"
        )


def studies(robot, folder: Path) -> None:
    """Print runs side by side: per core, and whole sweeps."""
    jobs = {name: block(machine, law, path) for name, machine, law, path in cases(robot)}
    against = yards(folder, robot, 8, ["PD"])
    t = in_turns(15, OWN_TIME, **jobs, **against)
    # Eight runs at a time in C.
    turns = len(BLOCK) // 8
    t |= {name: type(t[name])(turns * t[name].median, turns * t[name].least) for name in against}
    print("\nStudies, speed per core as a multiple of C SIMD over runs (PD), and of our PD in lanes")
    print(f"{'':40}{'runs/s':>8}{'C SIMD':>14}{'C, friction':>15}{'our PD':>14}")
    for name in jobs:
        columns = [t[yard].over(t[name]) for yard in against] or ["", ""]
        print(
            f"{name:40}{len(BLOCK) / t[name].median:8.0f}{columns[0]:>14}{columns[1]:>15}"
            f"{t[own_pd(name)].over(t[name]):>14}"
        )
    offsets = np.tile(BLOCK, (8, 1))
    sweeps = {
        name: lambda law=law, path=path, machine=machine: rk.sweep(machine, law, path, offsets)
        for name, machine, law, path in cases(robot)
        if "friction" in name
    }
    print(
        "rk.sweep on all cores, runs/s: "
        + ", ".join(
            f"{name.removesuffix(', friction')} {len(offsets) / time.median:.0f}"
            for name, time in in_turns(3, **sweeps).items()
        )
    )
