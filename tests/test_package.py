"""What an installed copy offers without a notebook: the summary, and the students' lessons."""

import json
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import rapkm_lite as rk
from rapkm_lite.__main__ import main
from rapkm_lite.lessons.copies import bare, copy_lessons, lesson_folder
from rapkm_lite.simulation.summary import OFFSET, ROWS, as_text

ROOT = Path(__file__).parents[1]


def command(*arguments, code="import runpy; runpy.run_module('rapkm_lite', run_name='__main__', alter_sys=True)"):
    """`python -m rapkm_lite` in a process that cannot import what belongs to notebooks."""
    absent = "import sys; sys.modules.update(dict.fromkeys(['matplotlib', 'ipywidgets', 'IPython', 'numba']))\n"
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    return subprocess.run(
        [sys.executable, "-c", absent + code, *arguments],
        capture_output=True,
        text=True,
        encoding="utf-8",
        env=environment | {"PYTHONIOENCODING": "utf-8"},
        cwd=ROOT / "tests",
    )


def test_summary_prints_the_energies_of_simulate_beside_table_1():
    done = command("--json")
    assert done.returncode == 0, done.stderr
    tables = json.loads(done.stdout)["energy_J"]
    setting = rk.experiment("testbed")
    laws = setting.law, rk.AntagonismFilter(setting.law, pose="true")
    for row, law in zip(ROWS, laws, strict=True):
        run = rk.simulate(setting.robot, law, setting.trajectory, OFFSET)
        assert np.allclose(tables["default experiment"][row], run.energy, atol=1e-9)
    assert np.allclose([tables["Table 1, measured"][row] for row in ROWS], rk.measured_energies(), atol=0.0)


def test_summary_for_people_names_the_machine_and_both_tables():
    done = command()
    assert done.returncode == 0, done.stderr
    for word in ("testbed", "default experiment, without filter", "Table 1, measured, with filter", "4.56", "2.24"):
        assert word in done.stdout
    version, machine, drives, filtered = done.stdout.splitlines()[:4]
    setting = rk.experiment("testbed")
    assert rk.__version__ in version and repr(setting.robot) in machine and f" {setting.law!r}," in drives
    assert filtered.split(maxsplit=1) == ["filter", repr(rk.AntagonismFilter(setting.law, pose="true"))]


def test_summary_for_people_says_what_the_filter_saves_and_at_which_offsets():
    """Table 1: 4.56 J become 2.24 J; the lessons' offsets are (4, -2, 5) mrad."""
    tables = {
        "by hand": dict(zip(ROWS, [[4.0, 2.0, 2.0], [1.0, 0.5, 0.5]], strict=True)),
        "Table 1, measured": dict(zip(ROWS, rk.measured_energies(), strict=True)),
    }
    words = dict.fromkeys(("version", "machine", "law", "filter"), "")
    text = as_text({**words, "offset_rad": list(OFFSET), "energy_J": tables})
    assert re.findall(r"the filter saves (.*) %", text) == ["75", "51"]
    assert "encoder offsets (4, -2, 5) mrad" in text


@pytest.mark.parametrize("words", [["lessons", "mine"], ["grade", "."]])
def test_a_command_has_no_output_for_scripts(words, tmp_path, monkeypatch, capsys):
    """The help says of --json: print the summary for scripts."""
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as stopped:
        main(["--json", *words])
    assert stopped.value.code == 2 and "--json goes with no command; allowed: " in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_the_version_is_told():
    assert command("--version").stdout.split() == ["rapkm_lite", rk.__version__]


@pytest.mark.skipif(os.name == "nt", reason="a closed pipe is another error there")
def test_a_reader_that_has_enough_is_no_error_to_tell():
    """As `| head -1`, but sure to have closed the pipe before the first line."""
    read, write = os.pipe()
    os.close(read)
    own = [sys.executable, "-m", "rapkm_lite"]
    done = subprocess.run(own, stdout=write, stderr=subprocess.PIPE, env=os.environ | {"PYTHONPATH": str(ROOT)})
    os.close(write)
    assert done.returncode == 1 and done.stderr == b""


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="a device that is always full, as Linux has")
def test_a_full_device_is_told_in_a_sentence():
    own = [sys.executable, "-m", "rapkm_lite"]
    with open("/dev/full", "wb") as full:
        done = subprocess.run(own, stdout=full, stderr=subprocess.PIPE, env=os.environ | {"PYTHONPATH": str(ROOT)})
    assert done.returncode == 1
    assert done.stderr.startswith(b"the output cannot be written (No space left") and done.stderr.count(b"\n") == 1


def test_lessons_are_copied_without_outputs_and_solutions(tmp_path):
    target = tmp_path / "my lessons"
    assert command("lessons", str(target)).returncode == 0
    names = {path.name for path in target.iterdir()}
    sources = {path.name for path in lesson_folder().glob("[0-9][0-9]_*.ipynb")}
    assert sources <= names and {"dashboard.ipynb", "equations.md", "errata.md"} <= names
    for path in target.glob("*.ipynb"):
        text = path.read_text(encoding="utf-8")
        assert text == bare(text)
        for cell in json.loads(text)["cells"]:
            assert "BEGIN SOLUTION" not in "".join(cell["source"])
            assert cell["cell_type"] != "code" or (cell["outputs"], cell["execution_count"]) == ([], None)


def test_a_lesson_is_never_overwritten(tmp_path):
    copy_lessons(tmp_path)
    (tmp_path / "00_start_here.ipynb").write_text("mine", encoding="utf-8")
    done = command("lessons", str(tmp_path))
    assert done.returncode == 2 and "00_start_here.ipynb" in done.stderr and "Traceback" not in done.stderr
    assert (tmp_path / "00_start_here.ipynb").read_text(encoding="utf-8") == "mine"


def test_a_folder_without_a_name_is_refused_and_one_with_a_space_is_quoted(tmp_path):
    done = command("lessons", "")
    assert done.returncode == 2 and "folder = ''; allowed: the name of a folder" in done.stderr
    target = tmp_path / "my lessons"
    assert shlex.quote(str(target / "00_start_here.ipynb")) in command("lessons", str(target)).stdout


def test_a_folder_is_named_on_a_screen_that_lacks_its_letters(tmp_path):
    """As in a pipe in Windows, whose letters are those of one language; the others are shown by their numbers."""
    own = [sys.executable, "-m", "rapkm_lite", "lessons", str(tmp_path / "übung α")]
    environment = os.environ | {"PYTHONPATH": str(ROOT), "PYTHONIOENCODING": "ascii"}
    done = subprocess.run(own, capture_output=True, text=True, env=environment)
    assert (done.returncode, done.stderr) == (0, "") and r"\xfcbung \u03b1" in done.stdout
    assert (tmp_path / "übung α" / "00_start_here.ipynb").exists()


def test_a_folder_that_cannot_be_made_is_named(tmp_path):
    (tmp_path / "file").write_text("", encoding="utf-8")
    with pytest.raises(ValueError, match="cannot be written"):
        copy_lessons(tmp_path / "file" / "lessons")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["lessons", "~nosuchuser/x"], "folder = '~nosuchuser/x' names no user of this computer; allowed: a folder"),
        (["lessons", "x" * 300], "cannot be written ("),
        (["grade", "x" * 300], "allowed: a folder that exists"),
    ],
)
def test_names_that_no_folder_can_have_are_refused_in_a_line(arguments, words, capsys):
    assert main(arguments) == 2
    out, said = capsys.readouterr()
    assert words in said and said.count("\n") == 1 and not out


def test_importing_the_package_imports_nothing_heavy():
    heavy = "matplotlib", "ipywidgets", "IPython", "numba", "sympy", "anywidget", "PIL"
    code = f"import sys, rapkm_lite; print([m for m in {heavy!r} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT)
    assert done.stdout.strip() == "[]", done.stderr
