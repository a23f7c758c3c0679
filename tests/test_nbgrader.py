"""The export for nbgrader, and nbgrader itself on a lesson where it is installed (the extra `nbgrader`)."""

import importlib.util
import re
import shutil
import sqlite3
import subprocess
import sys
from pathlib import Path

import nbformat
import numpy as np
import pytest

import rapkm_lite as rk
from rapkm_lite.checks import exercises

NOTEBOOKS = Path(__file__).parents[1] / "notebooks"
sys.path.insert(0, str(NOTEBOOKS))
SOLVED = sorted((NOTEBOOKS / "solutions").glob("*.ipynb"))
LESSON = "04_antagonism_filter_energy"
INSTALLED = importlib.util.find_spec("nbgrader") is not None


@pytest.fixture(scope="module")
def course(tmp_path_factory):
    folder = tmp_path_factory.mktemp("course")
    subprocess.run([sys.executable, str(NOTEBOOKS / "build.py"), "nbgrader", str(folder)], check=True)
    return folder


@pytest.mark.parametrize("path", SOLVED, ids=lambda path: path.stem)
def test_every_exercise_has_a_locked_cell_with_its_points(path, course):
    cells = nbformat.read(course / "source" / path.stem / path.name, as_version=4).cells
    marks = [cell.metadata.nbgrader for cell in cells if "nbgrader" in cell.metadata]
    graded = {mark.grade_id: mark.points for mark in marks if mark.grade}
    known = {name.replace(".", "-"): e.points for name, e in exercises().items() if name[:2] == path.stem[:2]}
    assert graded == known
    assert len({mark.grade_id for mark in marks}) == len(marks)
    for cell in cells:
        if "### BEGIN SOLUTION" in cell.source:
            assert cell.metadata.nbgrader.solution and "check(" not in cell.source
        elif "nbgrader" in cell.metadata and cell.metadata.nbgrader.grade:
            assert cell.metadata.nbgrader.locked and 'check("' in cell.source


def links(folder):
    """(page, target) of the links in the notebooks and pages of an assignment."""
    for path in folder.iterdir():
        text = path.read_text(encoding="utf-8")
        if path.suffix == ".ipynb":
            text = "\n".join(c.source for c in nbformat.reads(text, as_version=4).cells if c.cell_type == "markdown")
        yield from ((path, target) for target in re.findall(r"\]\(([^)\s]+)\)", text))


def assert_links_hold(folder):
    found = [(path, target) for path, target in links(folder) if not re.match("[a-z]+:", target)]
    assert found
    for path, target in found:
        name, _, anchor = target.partition("#")
        page = folder / name if name else path  # a link may stay on its page
        assert "/" not in name and page.is_file(), f"{path}: {target}"
        assert not anchor or f'<a id="{anchor}"></a>' in page.read_text(encoding="utf-8"), target


@pytest.mark.parametrize("path", SOLVED, ids=lambda path: path.stem)
def test_links_hold_inside_the_folder_of_an_assignment(path, course):
    assert_links_hold(course / "source" / path.stem)


def test_a_link_that_leads_out_of_an_assignment_becomes_its_words():
    from workshop.nbgrader import linked

    assert linked("in [lesson 07](07_x.ipynb), the [overview](../00_x.ipynb)") == "in lesson 07, the overview"
    assert linked("[errata](../errata.md#eq-14), [a](https://b.c), ![d](e.png)") == (
        "[errata](errata.md#eq-14), [a](https://b.c), ![d](e.png)"
    )


def test_a_wrong_answer_does_not_cost_the_exercise_that_builds_on_it(course):
    """As in the lesson and under the package's own grader: the lesson goes on with the package's answer."""
    answers = {
        "09-one_sign-answer": "def one_sign(A, f, least):\n    return 0.0 * A[:, 0]",
        "09-quiet_gears-answer": "def quiet_gears(A, f):\n    return one_sign(A, f, 5e-3)",
    }
    lesson = nbformat.read(course / "source" / "09_using_redundancy" / "09_using_redundancy.ipynb", as_version=4)
    space, failed = {"np": np, "rk": rk}, []
    for cell in (cell for cell in lesson.cells if "nbgrader" in cell.metadata):
        name = cell.metadata.nbgrader.grade_id
        try:
            exec(answers.get(name, cell.source), space)
        except AssertionError:
            failed.append(name)
    assert failed == ["09-one_sign"]


def nbgrader(course, *words):
    done = subprocess.run([sys.executable, "-m", "nbgrader", *words], cwd=course, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-2000:]


@pytest.mark.skipif(not INSTALLED, reason="nbgrader, an extra, is not installed")
def test_nbgrader_makes_the_assignment_and_grades_it(course):
    nbgrader(course, "generate_assignment", LESSON)
    released = (course / "release" / LESSON / f"{LESSON}.ipynb").read_text(encoding="utf-8")
    assert "SOLUTION" not in released and "own_answer" not in released
    assert_links_hold(course / "release" / LESSON)
    solved = nbformat.read(course / "source" / LESSON / f"{LESSON}.ipynb", as_version=4)
    for student in ("blank", "mixed"):
        place = course / "submitted" / student / LESSON
        place.mkdir(parents=True)
        shutil.copy(course / "release" / LESSON / f"{LESSON}.ipynb", place)
    # Right answers but for the first, and its check taken out by the student.
    given = nbformat.read(place / f"{LESSON}.ipynb", as_version=4)
    answers = {c.metadata.nbgrader.grade_id: c.source for c in solved.cells if "nbgrader" in c.metadata}
    for cell in given.cells:
        mark = cell.metadata.get("nbgrader", {})
        if mark.get("solution"):
            cell.source = answers[mark["grade_id"]]
        if mark.get("grade_id") == "04-filtered_torques-answer":
            cell.source = "def filtered_torques(A, c):\n    return c"
        elif mark.get("grade_id") == "04-filtered_torques":
            cell.source = "pass"
    nbformat.write(given, place / f"{LESSON}.ipynb")
    nbgrader(course, "autograde", LESSON)
    rows = sqlite3.connect(course / "gradebook.db").execute(
        "select submitted_assignment.student_id, grade_cell_name.name, grade.auto_score from grade"
        " join submitted_notebook on grade.notebook_id = submitted_notebook.id"
        " join submitted_assignment on submitted_notebook.assignment_id = submitted_assignment.id"
        " join base_cell as grade_cell_name on grade.cell_id = grade_cell_name.id"
    )
    scores = {(student, name): score for student, name, score in rows}
    points = {name.replace(".", "-"): e.points for name, e in exercises().items() if name.startswith("04.")}
    for name, full in points.items():
        assert scores["blank", name] == 0.0
        assert scores["mixed", name] == (0.0 if name == "04-filtered_torques" else full)


def test_a_lesson_that_there_is_not_is_refused_and_nothing_is_written(tmp_path):
    from workshop import nbgrader

    with pytest.raises(ValueError, match="lesson = '99'; allowed: 0"):
        nbgrader.export(tmp_path / "course", ["04", "99"])
    assert not (tmp_path / "course").exists()
    assert [path.stem for path in nbgrader.export(tmp_path / "course", ["04"])] == [LESSON]
