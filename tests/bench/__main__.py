"""Run times of single runs and studies, cold and cached start, and their ratios to C, MuJoCo and plain Python.

    python -m tests.bench

Everything is measured in turns (A B A B ...) and given as a median.  Close other programs.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import rapkm_lite as rk
from rapkm_lite.simulation import compiled as engine_calls
from rapkm_lite.simulation.energy import antagonistic_energy

from . import yardsticks

OFFSET = np.array([4e-3, -2e-3, 5e-3])
PD = rk.PD(7.05, 0.225)
LAWS = {"PD": (PD, 0, 0), "PD + filter, true pose": (rk.AntagonismFilter(PD, pose="true"), 0, 1),
        "PD + filter, measured pose": (rk.AntagonismFilter(PD), 1, 1)}
START = """
import time; start = time.perf_counter()
import rapkm_lite as rk
robot = rk.load().replace(friction=0.0)
rk.simulate(robot, rk.AntagonismFilter(rk.PD(7.05, 0.225)), rk.triangle(robot), [4e-3, -2e-3, 5e-3])
print(time.perf_counter() - start)
"""


def in_turns(repeats: int, **jobs) -> dict[str, float]:
    """Median time in s of each job."""
    times = {name: [] for name in jobs}
    for job in jobs.values():
        job()
    for _ in range(repeats):
        for name, job in jobs.items():
            start = time.perf_counter()
            job()
            times[name].append(time.perf_counter() - start)
    return {name: statistics.median(values) for name, values in times.items()}


def kernel(robot, path, law):
    """The engine alone, without making tables and results."""
    code = engine_calls.encode(law, robot, robot)
    arrays = [np.zeros((len(path), n)) for n in (4, 3, 3, 3)]
    return lambda: engine_calls.run_lockstep(robot, robot, path, code, OFFSET, 0.0, -1.0, *arrays, None)


def single_runs(robot, path, folder) -> None:
    scalar = yardsticks.compile_c(folder, 1)
    print(f"{'one 5 s run, ms':30}{'simulate':>10}{'kernel':>10}{'C':>10}{'kernel / C':>12}")
    for name, (law, measured, filtered) in LAWS.items():
        jobs = {"simulate": lambda law=law: rk.simulate(robot, law, path, OFFSET), "kernel": kernel(robot, path, law)}
        if scalar:
            jobs["c"] = yardsticks.c_run(scalar, 1, robot, path, OFFSET, measured, filtered)
            gap = np.abs(jobs["c"]()[0][:, 10:] - rk.simulate(robot, law, path, OFFSET).c).max()
            assert gap < 1e-12, gap
        t = in_turns(60, **jobs)
        c = f"{1e3 * t['c']:10.3f}{t['kernel'] / t['c']:12.2f}" if scalar else "no compiler"
        print(f"{name:30}{1e3 * t['simulate']:10.3f}{1e3 * t['kernel']:10.3f}{c}")


def studies(robot, path, folder) -> None:
    vector = yardsticks.compile_c(folder, 8)
    offsets = np.random.default_rng(0).normal(0.0, 5e-3, (1024, 3))
    block = offsets[:16]
    print(f"\n{'studies, runs/s':30}{'sweep':>10}{'one core':>10}{'C SIMD':>10}{'core / C':>12}")
    for name, (law, measured, filtered) in LAWS.items():
        code = engine_calls.encode(law, robot, robot)
        K_P, K_D = np.tile(code.K_P, (16, 1)), np.tile(code.K_D, (16, 1))
        jobs = {"lanes": lambda a=(code, K_P, K_D): engine_calls.lockstep(robot, robot, path, *a, block, 0.0, -1.0)}
        if vector:
            jobs["c"] = yardsticks.c_run(vector, 8, robot, path, block[:8], measured, filtered)
            expected = antagonistic_energy(rk.simulate(robot, law, path, block[0]))
            assert abs(jobs["c"]()[1][7, 0] * path.dt - expected) < 1e-12
        t = in_turns(15, **jobs)
        whole = in_turns(5, sweep=lambda law=law: rk.sweep(robot, law, path, offsets))["sweep"]
        c = f"{8 / t['c']:10.0f}{16 / t['lanes'] * t['c'] / 8:12.2f}" if vector else "no compiler"
        print(f"{name:30}{len(offsets) / whole:10.0f}{16 / t['lanes']:10.0f}{c}")


def start_up() -> None:
    with tempfile.TemporaryDirectory() as cache:
        times = [float(subprocess.run([sys.executable, "-c", START], env={**os.environ, "NUMBA_CACHE_DIR": cache},
                                      capture_output=True, text=True, check=True).stdout) for _ in range(4)]
    cached = statistics.median(times[1:])
    print(f"\nfirst result, import included: {times[0]:.2f} s with an empty cache, {cached:.2f} s from it")


def peers(robot, path) -> None:
    run = kernel(robot, path, PD)
    try:
        jobs = {name: yardsticks.mujoco_rollout(robot, path, OFFSET, name) for name in ("implicitfast", "RK4")}
    except ImportError:
        print("MuJoCo is not installed")
        jobs = {}
    if jobs:
        truth = rk.simulate(robot, PD, path, OFFSET).q_a[1:]
        t = in_turns(7, engine=run, **jobs)
        for name, job in jobs.items():
            print(f"MuJoCo rollout, {name}: {1e3 * t[name]:.1f} ms, {t[name] / t['engine']:.0f} times the engine, "
                  f"angles {np.abs(job() - truth).max():.1g} rad apart")
    code = "import time" + START.split("import rapkm_lite as rk")[1].replace("rk.simulate", "run = lambda: rk.simulate")
    code = "import time, rapkm_lite as rk\n" + "\n".join(code.splitlines()[1:-1])
    code += "\nstart = time.perf_counter(); run(); print(time.perf_counter() - start)"
    plain = float(subprocess.run([sys.executable, "-c", code], env={**os.environ, "RAPKM_LITE_NUMBA": "0"},
                                 capture_output=True, text=True, check=True).stdout)
    t = in_turns(30, engine=kernel(robot, path, LAWS["PD + filter, measured pose"][0]))["engine"]
    print(f"without Numba: {1e3 * plain:.0f} ms, {plain / t:.0f} times the engine")


def main() -> None:
    robot = rk.load().replace(friction=0.0)
    path = rk.triangle(robot)
    with tempfile.TemporaryDirectory() as folder:
        single_runs(robot, path, Path(folder))
        studies(robot, path, Path(folder))
    start_up()
    peers(robot, path)


if __name__ == "__main__":
    main()
