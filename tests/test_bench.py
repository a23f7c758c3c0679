"""The benchmarks run: each job once, without a word about times."""

import sys

import pytest

import rapkm_lite as rk
from rapkm_lite.simulation.compiled import COMPILED
from tests.bench import kernels, user_laws, yardsticks
from tests.bench.turns import Times, in_turns

ROBOT = rk.load()


def once(repeats, clock=None, warm=False, **jobs):
    for job in jobs.values():
        job()
    return {name: Times(1.0, 1.0) for name in jobs}


def test_a_warm_job_runs_twice_in_its_turn():
    ran = []
    times = in_turns(3, warm=True, a=lambda: ran.append("a"), b=lambda: ran.append("b"))
    assert ran == ["a", "b", *3 * ["a", "a", "b", "b"]] and list(times) == ["a", "b"]


@pytest.fixture
def quick(monkeypatch):
    for module in (kernels, user_laws):
        monkeypatch.setattr(module, "in_turns", once)


@pytest.mark.skipif(not COMPILED, reason="benchmarks are of the compiled engine")
def test_benchmarks_of_the_kernels_do_the_job_of_the_c_code(quick, tmp_path, capsys):
    if yardsticks.compile_c(tmp_path, 1):
        kernels.check_c(tmp_path, ROBOT)
    assert sys.float_info.min / 4 > 0.0  # the yardstick changes nothing for others
    kernels.single_runs(ROBOT, tmp_path)
    kernels.studies(ROBOT, tmp_path)
    said = capsys.readouterr().out
    assert all(said.count(f"\n{name}") == 4 for name in kernels.LAWS if "," not in name and name != "PD")


@pytest.mark.skipif(not COMPILED, reason="benchmarks are of the compiled engine")
def test_benchmarks_of_laws_that_a_user_writes_compare_equal_torques(quick, capsys):
    user_laws.laws(ROBOT, rk.triangle(ROBOT, duration=0.5))
    assert capsys.readouterr().out.count("1.0000 (1.0000)") == 4
