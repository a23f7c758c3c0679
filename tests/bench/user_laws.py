"""What a run costs whose law a student wrote, the first result of a session, a run without Numba, and MuJoCo."""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile

import numpy as np

import rapkm_lite as rk

from . import yardsticks
from .kernels import FILTER, OFFSET, PD, single
from .turns import in_turns

START = """
import time; start = time.perf_counter()
import rapkm_lite as rk
robot = rk.load()
rk.simulate(robot, rk.AntagonismFilter(rk.PD(7.05, 0.225)), rk.triangle(robot), [4e-3, -2e-3, 5e-3])
print(time.perf_counter() - start)
"""
AGAIN = """
import time
import rapkm_lite as rk
robot = rk.load()
path = rk.triangle(robot)
start = time.perf_counter()
rk.simulate(robot, rk.AntagonismFilter(rk.PD(7.05, 0.225)), path, [4e-3, -2e-3, 5e-3])
print(time.perf_counter() - start)
"""


def textbook(robot):
    """Feed-forward (25) and feedback of the drives from the functions of the chapter."""

    def law(t, q_a, qd_a, d):
        G, C, Q = rk.redundant_dynamics(robot, d.q, d.qd)
        A_tilde = rk.redundant_control_matrix(robot, d.q)
        pinv = rk.explicit_pseudoinverse(A_tilde, rk.select_independent(A_tilde))
        return pinv @ (G @ d.qdd + C @ d.qd + Q) - 7.0 * (q_a - d.q_a) - 0.2 * (qd_a - d.qd_a)

    return law


def with_at(robot):
    """The same with `at`."""

    def law(t, q_a, qd_a, d):
        at = rk.at(robot, d.q, d.qd)
        G, C, Q = at.redundant
        return at.A_tilde_T_pinv @ (G @ d.qdd + C @ d.qd + Q) - 7.0 * (q_a - d.q_a) - 0.2 * (qd_a - d.qd_a)

    return law


def compiled():
    """The same inside the compiled loop."""

    @rk.compiled(at="desired")
    def law(t, q_a, qd_a, d, at):
        G, C, Q = at.redundant
        return at.A_tilde_T_pinv @ (G @ d.qdd + C @ d.qd + Q) - 7.0 * (q_a - d.q_a) - 0.2 * (qd_a - d.qd_a)

    return law


def laws(robot, path) -> None:
    """Print the times of a student's law."""
    written = {"textbook functions": textbook(robot), "rk.at": with_at(robot)}
    if hasattr(rk, "compiled"):
        written["rk.compiled"] = compiled()
    jobs = {name: lambda law=law: rk.simulate(robot, law, path, OFFSET) for name, law in written.items()}
    jobs["RedundantCTC of the package"] = lambda: rk.simulate(robot, rk.RedundantCTC(900.0, 60.0), path, OFFSET)
    torques = [jobs[name]().c for name in written]
    assert all(np.abs(c - torques[0]).max() < 1e-9 for c in torques)
    t = in_turns(5, **jobs)
    print("\nA student's computed-torque law, 5 s of motion, whole call of simulate, s (shortest in brackets)")
    for name, time in t.items():
        print(f"{name:34}{time.median:8.4f} ({time.least:.4f})")


def python(code: str, **environment) -> float:
    """The number that a script prints in a process of its own."""
    done = subprocess.run(
        [sys.executable, "-c", code], env={**os.environ, **environment}, capture_output=True, text=True, check=True
    )
    return float(done.stdout)


def start_up(robot, path) -> None:
    """Print the first result with an empty cache and from it, and a run without Numba."""
    with tempfile.TemporaryDirectory() as cache:
        times = [python(START, NUMBA_CACHE_DIR=cache) for _ in range(6)]
    print(
        f"\nFirst result, import included: {times[0]:.2f} s with an empty cache, "
        f"{statistics.median(times[1:]):.2f} s from it (shortest {min(times[1:]):.2f} s)"
    )
    plain, kernel = python(AGAIN, RAPKM_LITE_NUMBA="0"), in_turns(15, run=single(robot, FILTER, path))["run"].median
    print(f"Without Numba: {plain:.2f} s for the same run, {plain / kernel:.0f} times the kernel")


def mujoco(robot, path) -> None:
    """Print PD runs of MuJoCo next to the engine, without friction."""
    robot = robot.replace(friction=0.0)
    try:
        jobs = {name: yardsticks.mujoco_rollout(robot, path, OFFSET, name) for name in ("implicitfast", "RK4")}
    except ImportError:
        print("\nMuJoCo is not installed.")
        return
    truth = rk.simulate(robot, PD, path, OFFSET).q_a[1:]
    t = in_turns(7, engine=single(robot, PD, path), **jobs)
    print()
    for name, job in jobs.items():
        print(
            f"MuJoCo rollout, {name}: {1e3 * t[name].median:.1f} ms, {t[name].median / t['engine'].median:.0f} times "
            f"the engine, angles {np.abs(job() - truth).max():.1g} rad apart"
        )
