"""Runs of minutes: made in parts, in little memory, and with the energy that physics asks for."""

import subprocess
import sys

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from samples import FRICTIONLESS, TESTBED

import rapkm_lite as rk
from rapkm_lite.mechanics import sampling
from rapkm_lite.simulation import compiled

OFFSET = [4e-3, -2e-3, 5e-3]
PD = rk.PD(7.05, 0.225)
FAULTS = [rk.EncoderDropout(1, 0.03, 0.06), rk.OffsetJump(2, 0.3, 1e-3)]


@rk.compiled(memory=1)
def told(t, q_a, qd_a, d, memory):
    """PD with a torque that goes by the time, and another one by the number of samples."""
    memory[0] += 1.0
    return -7.05 * (q_a - d.q_a) - 0.225 * (qd_a - d.qd_a) + 1e-2 * t + 1e-5 * memory[0]


LAWS = [rk.AntagonismFilter(rk.PID(7.05, 0.225, 3.0, 0.5)), rk.SwitchedCTC(900.0, 60.0), told]
TEN_MINUTES = r"""
import re
from pathlib import Path
import numpy as np
import rapkm_lite as rk

def megabytes(name):
    # Not getrusage, whose peak begins with that of the process from which this one was forked.
    return int(re.search(name + r":\s*(\d+) kB", Path("/proc/self/status").read_text())[1]) / 1024

robot, law = rk.load().replace(friction=0.0), rk.AntagonismFilter(rk.PD(7.05, 0.225))
rk.simulate(robot, law, rk.circle(robot, 0.05, 0.5), [4e-3, -2e-3, 5e-3])
before = megabytes("VmRSS")
path = rk.circle(robot, 0.05, 600.0, turns=100)
run = rk.simulate(robot, law, path, [4e-3, -2e-3, 5e-3])
energy = run.energy.sum() - rk.copper_loss(robot, run.c[:-1], run.dt).sum()
last = rk.inverse_kinematics(robot, run.x[-1])
kinetic = rk.kinetic_energy(robot, last, rk.at(robot, last).F @ run.xd[-1])
print(len(run), energy - kinetic, megabytes("VmHWM") - before)
"""


@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
def test_a_run_in_parts_is_the_same_run(law, monkeypatch):
    """To the last bit: all that a run remembers goes from part to part."""
    path = rk.triangle(TESTBED, duration=0.9).for_robot(TESTBED)
    options = {"offset": OFFSET, "encoder": 4000, "velocity_filter": 2e-3, "faults": FAULTS}
    whole = rk.simulate(TESTBED, law, path, **options)
    rows = rk.sweep(TESTBED, law, path, [OFFSET, [0.0, 1e-3, 0.0]], faults=FAULTS)
    monkeypatch.setattr(compiled, "PART", 250)
    parts = rk.simulate(TESTBED, law, path, **options)
    for name in ("x", "xd", "q_a", "qd_a", "c", "pairs"):
        assert_array_equal(getattr(parts, name), getattr(whole, name))
    again = rk.sweep(TESTBED, law, path, [OFFSET, [0.0, 1e-3, 0.0]], faults=FAULTS)
    assert_array_equal(again.energies, rows.energies)


def test_a_run_that_ends_in_a_later_part_ends_where_it_does(monkeypatch):
    times = []
    for part in (10**6, 7):
        monkeypatch.setattr(compiled, "PART", part)
        with pytest.raises(rk.SimulationError, match="unstable gain") as caught:
            rk.simulate(FRICTIONLESS, rk.PD(7.05, 30.0), rk.circle(FRICTIONLESS, 0.05, 0.5), OFFSET)
        times.append((caught.value.time, len(caught.value.partial)))
    assert times[0] == times[1] and times[0][0] > 0.01


def test_a_neighbour_that_ends_in_an_early_part_stops_no_run(monkeypatch):
    """Beside it the others are worth what they are alone and in one part."""
    path = rk.circle(FRICTIONLESS, 0.05, 0.3)
    laws = [PD, rk.PD(7.05, 30.0), rk.PD(5.0, 0.2)]
    alone = rk.sweep(FRICTIONLESS, [laws[0], laws[2]], path, OFFSET)
    monkeypatch.setattr(compiled, "PART", 70)
    beside = rk.sweep(FRICTIONLESS, laws, path, OFFSET, failed="mask")
    assert beside.failed.tolist() == [False, True, False] and beside.failure_time[1] < path.t[140]
    assert_array_equal(beside.energies[[0, 2]], alone.energies)


def test_a_path_in_parts_is_the_same_path(monkeypatch):
    """Base angles go on where the part before ended, also over many turns of a base joint."""
    x = np.array([-0.1, 0.0]) + 0.15 * np.stack([np.cos(t := np.linspace(0.0, 60.0, 3001)), np.sin(t)], axis=-1)
    robot = rk.Manipulator(base=[[-0.1, 0.0], [0.12, 0.0]], lengths=[[0.2, 0.25], [0.3, 0.3]], masses=0.1)
    xd = 0.15 * np.stack([-np.sin(t), np.cos(t)], axis=-1)
    whole = rk.follow(robot, t, x, xd, np.zeros_like(x))
    monkeypatch.setattr(sampling, "PART", 170)
    parts = rk.follow(robot, t, x, xd, np.zeros_like(x))
    assert np.ptp(whole.q[:, 0]) > 50.0
    for name in ("x", "xd", "q", "qd", "qdd"):
        assert_allclose(getattr(parts, name), getattr(whole, name), rtol=0, atol=1e-12)
    with pytest.raises(ValueError, match=r"x\[2900\] = .*outside the workspace.*\(a path with samples = 3001\)"):
        rk.follow(robot, t, np.where(np.arange(3001)[:, None] == 2900, 1.0, x), xd, 0 * x)


@pytest.mark.skipif(not compiled.compiled(), reason="takes minutes without a compiler")
@pytest.mark.skipif(sys.platform != "linux", reason="reads the peak of the memory in KiB, as Linux counts it")
def test_ten_minutes_of_closed_loop():
    done = subprocess.run([sys.executable, "-c", TEN_MINUTES], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    samples, balance, memory = map(float, done.stdout.split())
    assert samples == 600001
    # Without friction the drives' work is the kinetic energy: that of the end, as the machine started at rest.
    assert abs(balance) < 1e-9
    # Above Python and the compiled engine (170 MB with Python 3.11): time; x, xd, xdd, q, qd, qdd of the path; x, xd,
    # q_a, qd_a, c and pairs of the run; and a fifth of that on its way.
    assert memory <= 1.2 * 8e-6 / 1.048576 * samples * (1 + 3 * 2 + 3 * 6 + 2 * 2 + 3 * 3 + 1)
