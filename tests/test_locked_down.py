"""Machines that allow little: no cache, no home, no threads, a Numba that does not import, or is not wanted."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
RUN = """
import sys
import rapkm_lite as rk
robot = rk.load()
path = rk.triangle(robot, duration=0.3, dt=5e-3)
run = rk.simulate(robot, rk.PD(7.05, 0.225), path, [4e-3, -2e-3, 5e-3])
study = rk.sweep(robot, rk.PD(7.05, 0.225), path, [[1e-3, 0.0, 0.0]] * 3)
print(run.energy.sum(), study.energies.sum(), "numba" in sys.modules)
"""
# The kernels of the plant alone are small: seconds to compile.
PLANT = """
import rapkm_lite as rk
robot = rk.load()
path = rk.triangle(robot, duration=0.3, dt=5e-3)
def law(t, q_a, qd_a, desired):
    return 7.05 * (desired.q_a - q_a) + 0.225 * (desired.qd_a - qd_a)
run = rk.simulate(robot, law, path)
print(run.energy.sum(), run.x[-1].sum())
"""
NO_THREADS = """
import threading
def refuse(*args, **kwargs):
    raise AssertionError("a thread was started")
threading._start_new_thread = refuse
threading._start_joinable_thread = refuse
"""
NO_PROCESSES = """
import socket, subprocess
import numpy.testing  # in NumPy 2.0.0 it asks the processor's name by a process, and SciPy imports it
def refuse(*args, **kwargs):
    raise AssertionError("a process or a connection was started")
socket.socket.connect = subprocess.Popen.__init__ = refuse
"""
BROKEN_NUMBA = """
import sys
class Finder:
    def find_spec(self, name, path=None, target=None):
        if name == "numba.core":
            raise ImportError("its compiler is broken")
sys.meta_path.insert(0, Finder())
"""


FORBIDDEN_NUMBA = BROKEN_NUMBA.replace("numba.core", "numba")
EMPTY_NUMBA = "import sys, types; sys.modules['numba'] = types.ModuleType('numba')\n"


def result(code=RUN, before="", cwd="/", **environment):
    """What a new process prints, and what it says on stderr; an environment variable that is None is taken away."""
    variables = {**os.environ, "PYTHONPATH": str(ROOT), "MPLBACKEND": "agg", **environment}
    variables = {name: value for name, value in variables.items() if value is not None}
    done = subprocess.run([sys.executable, "-c", before + code], env=variables, capture_output=True, text=True, cwd=cwd)
    assert done.returncode == 0, done.stderr
    return done.stdout.split(), done.stderr


@pytest.fixture(scope="module")
def plain():
    return result(RAPKM_LITE_NUMBA="0")[0]


@pytest.mark.parametrize("off", ["false", "no", "off", "FALSE", " Off "])
def test_all_words_for_off_mean_off(plain, off):
    assert result(RAPKM_LITE_NUMBA=off)[0] == plain and plain[-1] == "False"


def test_the_switch_of_numba_itself_is_heard(plain):
    assert result(NUMBA_DISABLE_JIT="1")[0] == plain


def close(one, other):
    return all(abs(float(a) / float(b) - 1) < 1e-10 for a, b in zip(one[:2], other[:2], strict=True))


def test_a_numba_that_does_not_import_costs_a_warning(plain):
    pytest.importorskip("numba")
    numbers, words = result(before=BROKEN_NUMBA)
    assert numbers[:2] == plain[:2] and words.count("Numba is installed but does not import") == 1


def test_a_folder_left_behind_by_numba_costs_a_warning(plain, tmp_path):
    (tmp_path / "numba" / "__pycache__").mkdir(parents=True)
    (tmp_path / "numba" / "__init__.py").touch()
    numbers, words = result(before=f"import sys; sys.path.insert(0, {str(tmp_path)!r})\n")
    assert numbers[:2] == plain[:2] and words.count("Numba is installed but does not import") == 1


@pytest.mark.parametrize("before", [FORBIDDEN_NUMBA, EMPTY_NUMBA])
def test_a_numba_that_cannot_be_looked_for_is_not_there(plain, before):
    numbers, words = result(before=before)
    assert numbers[:2] == plain[:2] and not words


def test_no_folder_for_a_cache(plain, tmp_path):
    file = tmp_path / "no_folder"
    file.write_text("", encoding="utf-8")
    assert close(result(NUMBA_CACHE_DIR=str(file / "cache"))[0], plain)


def test_a_damaged_cache(tmp_path):
    pytest.importorskip("numba")
    first = result(PLANT, NUMBA_CACHE_DIR=str(tmp_path))
    files = [path for path in tmp_path.rglob("*.nb?")]
    assert {path.suffix for path in files} == {".nbi", ".nbc"}
    for path in files:
        path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    assert result(PLANT, NUMBA_CACHE_DIR=str(tmp_path)) == first


def test_kernels_of_earlier_sources_go_when_a_new_one_is_saved(tmp_path):
    pytest.importorskip("numba")
    first = result(PLANT, NUMBA_CACHE_DIR=str(tmp_path))
    [folder] = {path.parent for path in tmp_path.rglob("*.nb?")}
    own, others = sorted(folder.iterdir()), []
    for path in own:
        name = re.sub(r"_[0-9a-f]{12}-", "_0123456789ab-", path.name)
        others.append(path.rename(folder / name))
    strange = folder / "nothing_of_ours.txt"
    strange.touch()
    assert all("_0123456789ab-" in path.name for path in others)
    assert result(PLANT, NUMBA_CACHE_DIR=str(tmp_path)) == first
    assert sorted(folder.iterdir()) == sorted([*own, strange])


def test_without_home(plain):
    assert result(HOME=None, XDG_CACHE_HOME=None, RAPKM_LITE_NUMBA="0")[0] == plain


@pytest.mark.parametrize("numba", ["0", "1"])
def test_without_threads_processes_and_connections(plain, numba):
    assert close(result(before=NO_THREADS + NO_PROCESSES, RAPKM_LITE_NUMBA=numba)[0], plain)


def test_explorers_without_threads():
    """All of them, made and with the first slider moved to its end."""
    code = """
import inspect
import ipywidgets as widgets
from rapkm_lite import explore
for name, make in vars(explore).items():
    if inspect.isfunction(make) and list(inspect.signature(make).parameters) == ["robot"]:
        made = make()
        sliders = [n for n, w in made.controls.items() if isinstance(w, widgets.FloatSlider | widgets.IntSlider)]
        assert made.set(**{sliders[0]: made.controls[sliders[0]].max}).numbers is not None
        print(name)
"""
    names = result(code, NO_THREADS + NO_PROCESSES, RAPKM_LITE_NUMBA="0")[0]
    assert len(names) == 15 and {"machine", "decentralized_run", "controller_choice"} < set(names)


@pytest.mark.parametrize(
    "lesson", sorted((ROOT / "notebooks").glob("[0-9][0-9]_*.ipynb")), ids=lambda path: path.stem[:2]
)
def test_first_cells_of_lessons_without_threads(lesson):
    code = f"""
import json
cells = json.load(open({str(lesson)!r}, encoding="utf-8"))["cells"]
for cell in [c for c in cells if c["cell_type"] == "code"][:2]:
    text = "".join(cell["source"])
    if "%" not in text and "explore." not in text:
        exec(compile(text, "cell", "exec"), globals())
print("done")
"""
    before = NO_THREADS + NO_PROCESSES + "display = print\n"
    assert "done" in result(code, before, cwd=str(lesson.parent), RAPKM_LITE_NUMBA="0")[0]
