"""A class with everything that goes wrong in one: each student gets the points of what is right, and a sentence."""

import csv
import errno
import itertools
import json
import os
import re
import subprocess
import sys
import time
import tracemalloc
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import rapkm_lite
from rapkm_lite.__main__ import main
from rapkm_lite.checks import exercises
from rapkm_lite.lessons.grading import grader
from rapkm_lite.lessons.grading.cells import sources
from rapkm_lite.lessons.grading.grader import Grade, grade, grade_one
from rapkm_lite.lessons.grading.submission import (
    Submission,
    called,
    found,
    hides_check,
    needed,
    statements,
    unnamed,
)
from rapkm_lite.lessons.grading.tables import by_exercise, by_student, check_place, write_csv
from rapkm_lite.lessons.grading.worker import Bench, nowhere

SETUP = "import numpy as np\nimport rapkm_lite as rk\nfrom rapkm_lite.checks import check, hint\n%matplotlib inline"
TORQUES = "def filtered_torques(A, c):\n    return A @ np.linalg.solve(A.T @ A, A.T @ c)\n"
COMMAND = "def filtered_command(A, K_P, q, q_d):\n    return q - rk.antagonism_filter(gains(K_P) * A) @ (q - q_d)\n"
HELPER = "def gains(K_P):\n    return K_P[:, None]\n"
ENERGY = """def saved_energy(robot, A, c, dt):
    kept = np.einsum("kij,kj->ki", rk.antagonism_filter(A), c)
    return rk.copper_loss(robot, c, dt) - rk.copper_loss(robot, kept, dt)
"""
CHECKS = ['filtered_torques = check("04.filtered_torques", filtered_torques)']
CHECKS += [f'{name} = check("04.{name}", {name})' for name in ("filtered_command", "saved_energy")]
RIGHT = [TORQUES, HELPER + COMMAND, ENERGY]
NAMES = ["04.filtered_torques", "04.filtered_command", "04.saved_energy"]
LESSONS = sorted((Path(__file__).parents[1] / "notebooks").glob("[0-9]*.ipynb"))[1:]  # lesson 00 has no exercises
ENDLESS = """def filtered_torques(A, c):
    while True:
        try:
            len(c)
        except:
            pass
"""


def checked(bodies):
    return [SETUP, *(f"{body}\n\n{check}" for body, check in zip(bodies, CHECKS, strict=True))]


SUBMISSIONS = {
    "ada": checked(RIGHT),
    "ben": checked([TORQUES.replace("return A", "return -A"), *RIGHT[1:]]),
    "cyd": checked([ENDLESS, *RIGHT[1:]]),
    "dan": checked([TORQUES, "def filtered_command(*case):\n    raise SystemExit(0)\n", ENERGY]),
    "eve": checked([TORQUES, "import os\ndef filtered_command(*case):\n    os._exit(0)\n", ENERGY]),
    "fay": [SETUP, *RIGHT],
    "gus": [
        SETUP,
        "def check(name, answer):\n    print('OK', name)\n",
        *checked(["filtered_torques = 3\n", *RIGHT[1:]])[1:],
    ],
    "hal": checked([TORQUES + "return (", *RIGHT[1:]]),
    "ivy": checked(["def filtered_torques(A, c):\n    raise NotImplementedError\n", *RIGHT[1:]]),
    "jon": checked(["from rapkm_lite.lessons.lesson04.exercises import filtered_torques\n", *RIGHT[1:]]),
    "moe": checked([f"def filtered_torques(A, c):\n    return check({NAMES[0]!r}, ...)(A, c)\n", *RIGHT[1:]]),
    "kim": [SETUP, "while True: pass", *checked(RIGHT)[1:]],
    "ned": [SETUP, TORQUES + "return (", *RIGHT[1:]],
    "lou": [SETUP, *RIGHT, *(f'hint("04.{name}")' for name in ("filtered_torques", "filtered_command"))],
}
# Student -> verdicts of the three exercises.
VERDICTS = {
    "ada": ["ok", "ok", "ok"],
    "ben": ["wrong", "ok", "ok"],
    "cyd": ["wrong", "ok", "ok"],
    "dan": ["ok", "wrong", "ok"],
    "eve": ["ok", "wrong", "ok"],
    "fay": ["ok", "ok", "ok"],
    "gus": ["wrong", "ok", "ok"],
    "hal": ["wrong", "ok", "ok"],
    "ivy": ["todo", "ok", "ok"],
    "jon": ["todo", "ok", "ok"],
    "moe": ["todo", "ok", "ok"],
    "kim": ["ok", "ok", "ok"],
    "ned": ["wrong", "ok", "ok"],
    "lou": ["ok", "ok", "ok"],
}


def write(path, sources):
    cells = [{"cell_type": "code", "source": source.splitlines(keepends=True)} for source in sources]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps({"cells": cells, "metadata": {}, "nbformat": 4, "nbformat_minor": 5}))


@pytest.fixture(scope="module")
def graded(tmp_path_factory):
    folder = tmp_path_factory.mktemp("class")
    for student, cells in SUBMISSIONS.items():
        write(folder / student / "04_antagonism_filter_energy.ipynb", cells)
    (folder / "leo").mkdir()
    (folder / "leo" / "04_antagonism_filter_energy.ipynb").write_text("no notebook")
    return grade(folder, seconds=15.0)


@pytest.mark.parametrize("student", SUBMISSIONS)
def test_each_exercise_is_graded_on_its_own(student, graded):
    own = {g.exercise: g for g in graded if g.student == student}
    verdicts = [own[name].verdict for name in NAMES]
    assert verdicts == VERDICTS[student], [own[name].sentence for name in NAMES]
    assert [own[name].points for name in NAMES] == [
        own[name].of * (word == "ok") for name, word in zip(NAMES, verdicts, strict=True)
    ]
    assert all(grade.sentence for grade in own.values())


def test_sentences_say_what_happened(graded):
    said = {(g.student, g.exercise): g.sentence for g in graded}
    assert "opposite sign" in said["ben", NAMES[0]]
    assert "does not come to an end" in said["cyd", NAMES[0]]
    assert "SystemExit" in said["dan", NAMES[1]]
    assert "SyntaxError" in said["hal", NAMES[0]]
    assert "no notebook" in said["leo", NAMES[0]] or "cannot be" in said["leo", NAMES[0]]


def test_the_tables_count_mistakes_and_points(graded, tmp_path):
    write_csv(tmp_path / "grades.csv", graded)
    rows = list(csv.DictReader((tmp_path / "grades.csv").read_text(encoding="utf-8").splitlines()))
    assert len(rows) == len(graded) and {row["verdict"] for row in rows} <= {"ok", "close", "wrong", "todo"}
    assert {row["points"] for row in rows} <= {"0.0", "5.0", "10.0"} >= {row["of"] for row in rows}
    assert "1 x the answer has the opposite sign" in by_exercise(graded)
    line = next(line for line in by_student(graded).splitlines() if line.startswith("ben"))
    assert line.split()[2] == "10"


def test_cells_that_a_spreadsheet_would_calculate_are_text(tmp_path):
    words = ["=1+1", "+1", "-1", "@x", "\t=1", "ada = 1"]
    write_csv(tmp_path / "grades.csv", [Grade(word, NAMES[0], "ok", -1.0, 1.0, word, word) for word in words])
    with (tmp_path / "grades.csv").open(newline="", encoding="utf-8") as lines:
        rows = list(csv.DictReader(lines))
    shown = [*(f"'{word}" for word in words[:-1]), words[-1]]
    assert [row["student"] for row in rows] == shown and [row["sentence"] for row in rows] == shown
    assert {row["points"] for row in rows} == {"-1.0"}


def test_two_names_that_are_no_text_stay_two_names_in_the_table(tmp_path):
    """Bytes of a file's name that are not UTF-8 are written as Python escapes them, and nothing is lost."""
    names = [os.fsdecode(name) for name in (b"ren\xe9", b"ren\xe8")]
    write_csv(tmp_path / "grades.csv", [Grade(name, NAMES[0], "ok", 1.0, 1.0, "", "") for name in names])
    with (tmp_path / "grades.csv").open(newline="", encoding="utf-8") as lines:
        assert [row["student"] for row in csv.DictReader(lines)] == [r"ren\udce9", r"ren\udce8"]


def test_a_close_answer_is_no_mistake_in_the_table():
    wrong, close = Grade("ada", "04.x", "wrong", 0, 1, "", "sign"), Grade("ben", "04.x", "close", 1, 1, "", "rounded")
    said = by_exercise([wrong, close])
    assert "1 x sign" in said and "rounded" not in said


def test_a_lesson_that_was_not_handed_in_has_no_points_and_a_wrong_one_has_zero():
    grades = [Grade("ada", "04.x", "wrong", 0.0, 5.0, "", ""), Grade("ben", "05.y", "ok", 3.0, 3.0, "", "")]
    lines = [line.split() for line in by_student(grades).splitlines()]
    assert lines[1:3] == [["ada", "0", "-", "0", "8"], ["ben", "-", "3", "3", "8"]]
    # An exercise that two handed in counts once in what can be had.
    grades.append(Grade("ben", "04.x", "ok", 5.0, 5.0, "", ""))
    lines = [line.split() for line in by_student(grades).splitlines()]
    assert lines[1:3] == [["ada", "0", "-", "0", "8"], ["ben", "5", "3", "8", "8"]]


@pytest.mark.parametrize("names", [("04_a.ipynb", "04_b.ipynb"), ("04_b.ipynb", "04_a.ipynb")])
def test_of_two_notebooks_with_as_many_points_the_newer_one_counts(names, tmp_path, monkeypatch):
    for name, age in zip(names, (2e9, 1e9), strict=True):
        write(tmp_path / "ada" / name, [SETUP])
        os.utime(tmp_path / "ada" / name, (age, age))
    monkeypatch.setattr(
        grader, "grade_one", lambda one, *_: [Grade(one.student, NAMES[0], "ok", 1.0, 1.0, "", "", str(one.path))]
    )
    assert [Path(one.file).name for one in grade(tmp_path)] == [names[0]]


def test_of_two_notebooks_the_one_with_more_points_counts_though_it_is_older(tmp_path, monkeypatch):
    for name, age in (("04_a.ipynb", 1e9), ("04_b.ipynb", 2e9)):
        write(tmp_path / "ada" / name, [SETUP])
        os.utime(tmp_path / "ada" / name, (age, age))
    points = {"04_a.ipynb": 2.0, "04_b.ipynb": 1.0}
    monkeypatch.setattr(
        grader, "grade_one", lambda one, *_: [Grade("ada", NAMES[0], "ok", points[one.path.name], 2.0, "", "")]
    )
    assert [one.points for one in grade(tmp_path)] == [2.0]


@pytest.mark.parametrize(("word", "share"), [("ok", 1), ("close", 1), ("wrong", 0), ("todo", 0)])
def test_right_and_close_answers_have_all_points_and_others_none(word, share, monkeypatch):
    monkeypatch.setattr(grader, "_results", lambda *_, **__: ({NAMES[0]: (word, "", "")}, False))
    own = {one.exercise: one for one in grade_one(Submission("ada", Path("04_x.ipynb"), "04"), 1.0)}[NAMES[0]]
    assert own.verdict == word and own.points == share * own.of and own.of > 0


def test_an_empty_name_of_the_file_is_refused(tmp_path, capsys):
    """As of a variable of the shell that is not set: else the grades would only be shown."""
    write(tmp_path / "ada" / "04_x.ipynb", [SETUP])
    assert main(["grade", str(tmp_path), "--csv", ""]) == 2
    out, said = capsys.readouterr()
    assert re.fullmatch(r"csv = .* cannot be written \(.*\); allowed: a file in a folder\n", said) and not out


@pytest.mark.parametrize("place", ["nowhere/grades.csv", ".", "x" * 300])
def test_a_place_for_the_file_is_looked_at_before_grading(place, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("rapkm_lite.lessons.grading.grader.grade", lambda *_: pytest.fail("it graded"))
    assert main(["grade", str(tmp_path), "--csv", str(tmp_path / place)]) == 2
    out, said = capsys.readouterr()
    assert re.fullmatch(r"csv = '.* cannot be written \(.*\); allowed: a file in a folder\n", said) and not out


@pytest.mark.parametrize("before", [None, "mine"])
def test_looking_at_a_place_leaves_it_as_it_was(before, tmp_path):
    place = tmp_path / "grades.csv"
    if before is not None:
        place.write_text(before)
    check_place(place)
    assert (place.read_text() if place.exists() else None) == before


def test_grades_are_shown_though_their_file_is_lost(tmp_path, capsys, monkeypatch):
    """A disk may fill while an hour of grading runs: here its folder goes."""
    own, folder = Grade("ada", NAMES[0], "ok", 10.0, 10.0, "right", ""), tmp_path / "folder"
    folder.mkdir()
    monkeypatch.setattr("rapkm_lite.lessons.grading.grader.grade", lambda *_: [folder.rmdir(), own][1:])
    assert main(["grade", str(tmp_path), "--csv", str(folder / "grades.csv")]) == 2
    out, said = capsys.readouterr()
    assert "ada" in out and "csv = " in said and said.count("\n") == 1


def test_only_what_the_answers_need_is_run():
    texts = [
        SETUP.replace("%", "# %"),
        "x = 3\ny = x + 1\nprint(y)\n",
        HELPER,
        "gains.factor = x\n",
        *checked(RIGHT)[1:],
    ]
    chosen = {s.key for s in needed(statements(texts)[0], {"filtered_torques", "filtered_command", "saved_energy"})}
    assert {"1.0", "2.0", "3.0"} <= chosen and not {"1.1", "1.2"} & chosen


def test_pictures_are_not_drawn():
    texts = ["robot = rk.load()\n", "plotting.plot_machine(robot, q)\nexplore.machine(robot)\ndisplay(robot)\n", *RIGHT]
    texts.append("np.copyto(robot.x, 1.0)\nanswer = robot\n")
    chosen = [s.key for s in needed(statements(texts)[0], {"answer"})]
    assert not {"1.0", "1.1", "1.2"} & {*chosen} and {"0.0", "5.0", "5.1"} <= {*chosen}


def test_names_of_a_function_are_its_own():
    texts = [
        "scale = 2\nrows = 1 / 0\nprint(rows)\nx = 3\n",
        "def answer(q):\n    rows = [x * q for x in range(3)]\n    return (lambda x: x)(scale), x, rows\n"
        "print(answer(1))\n",
    ]
    assert [s.key for s in needed(statements(texts)[0], {"answer"})] == ["0.0", "0.3", "1.0"]


ANSWER = "def answer(q):\n    return x * q\n"


def keys(text):
    return [s.key for s in needed(statements([text])[0], {"answer"})]


def test_a_value_that_is_replaced_is_not_needed():
    assert keys("x = 1 / 0\nx = 3\n" + ANSWER) == ["0.1", "0.2"]


def test_variables_of_a_comprehension_are_its_own():
    assert keys("x = 3\nrows = [x / 0 for x in range(3)]\n" + ANSWER) == ["0.0", "0.2"]


def test_what_sets_the_seed_is_needed_and_what_sets_the_printing_is_not():
    text = "import numpy as np\nnp.random.seed(1)\nnp.set_printoptions()\nx = np.random.rand()\n"
    assert keys(text + ANSWER) == ["0.0", "0.1", "0.3", "0.4"]


def test_what_sets_an_attribute_is_needed():
    text = "class Box:\n    pass\nbox = Box()\nsetattr(box, 'one', 1.0)\nprint(box)\n"
    assert keys(text + ANSWER.replace("x", "box.one")) == ["0.0", "0.1", "0.2", "0.4"]


def test_what_a_function_uses_is_needed_though_the_function_is_replaced_later():
    text = "def g(q):\n    return a * q\na = 1\nx = g(2)\ndef g(q):\n    return q\n"
    assert keys(text + ANSWER) == ["0.0", "0.1", "0.2", "0.4"]


def test_answers_without_a_check_are_looked_for_by_the_names_that_the_lessons_use():
    known = exercises()
    for path in sorted((Path(__file__).parents[1] / "notebooks").glob("[0-9]*.ipynb")):
        for name, given in re.findall(r'check\(\\"(\d\d\.\w+)\\", (\w+)\)', path.read_text(encoding="utf-8")):
            assert called(name, known[name]) == given or name[:2] != path.name[:2], name


def test_notebooks_without_the_number_of_a_lesson_are_named(tmp_path, capsys):
    write(tmp_path / "ada" / "04_antagonism_filter_energy.ipynb", [SETUP])
    write(tmp_path / "gus" / "homework.ipynb", [SETUP])
    write(tmp_path / "gus" / "00_start_here.ipynb", [SETUP])
    assert main(["grade", str(tmp_path)]) == 0
    said = capsys.readouterr().out
    assert f"like 04_title.ipynb: {Path('gus', 'homework.ipynb')}\n" in said


def test_students_without_a_notebook_that_is_graded_are_named(tmp_path, capsys):
    write(tmp_path / "ada" / "04_antagonism_filter_energy.ipynb", [SETUP])
    write(tmp_path / "gus" / "00_start_here.ipynb", [SETUP])
    write(tmp_path / "homework.ipynb", [SETUP])
    (tmp_path / "ivy").mkdir()
    (tmp_path / "jon").mkdir()
    (tmp_path / "jon" / "04_title.zip").write_bytes(b"")
    (tmp_path / ".hidden").mkdir()
    (tmp_path / "grades.csv").touch()
    assert main(["grade", str(tmp_path)]) == 0
    said = capsys.readouterr().out
    assert "like 04_title.ipynb: homework.ipynb\n" in said
    assert said.endswith("no notebook that could be graded: gus, ivy, jon\n")


def test_every_notebook_is_graded_or_named(tmp_path, capsys):
    """Several of one student, numbers besides that of the lesson, another lesson's, capital letters."""
    blank = checked(["...", "...", "..."])
    write(tmp_path / "ivy" / "04_antagonism_filter_energy-Copy1.ipynb", blank)
    write(tmp_path / "ivy" / "04_final.ipynb", checked(RIGHT))
    write(tmp_path / "joe" / "04_antagonism_filter_energy_v10_final.ipynb", checked(RIGHT))
    write(tmp_path / "kay" / "2026_11_26_lesson_04_.IPYNB", checked(RIGHT))
    write(tmp_path / "cleo" / "14_antagonism.ipynb", checked(RIGHT))
    file = tmp_path / "grades.csv"
    assert main(["grade", str(tmp_path), "--csv", str(file)]) == 0
    said = capsys.readouterr().out
    with file.open(newline="", encoding="utf-8") as lines:
        rows = [row for row in csv.DictReader(lines) if row["exercise"] in NAMES]
    assert [row["student"] for row in rows] == [*3 * ["ivy"], *3 * ["joe"], *3 * ["kay"]]
    assert {row["verdict"] for row in rows} == {"ok"} and rows[0]["file"].endswith("04_final.ipynb")
    assert re.search(r"not counted, .*04_antagonism_filter_energy-Copy1\.ipynb\n", said)
    assert re.search(r"not graded, .*14_antagonism\.ipynb\n", said) and said.count(".ipynb") == 3


@pytest.mark.parametrize(
    "words",
    [
        "assert (len(np.ones(3))\n        != 3) is False\n",
        "assert (7\n        % 2) == 1\n",
        "np.linalg.lstsq?\n",
        "?np.linalg.lstsq\n",
        "files = !ls\n",
        "%%time\n",
        "%time 1 + 1\n!ls\n",
    ],
)
def test_what_a_notebook_runs_is_read(tmp_path, words):
    body = words + TORQUES if words.startswith("%%") else TORQUES + words
    write(tmp_path / "ada" / "04_antagonism_filter_energy.ipynb", checked([body, *RIGHT[1:]]))
    assert [one.verdict for one in grade(tmp_path) if one.exercise in NAMES] == ["ok", "ok", "ok"]


@pytest.mark.parametrize("words", ["script false --no-raise-error", "bash", "python3", "HTML", "!", "javascript"])
def test_what_a_notebook_gives_to_others_is_not_run(tmp_path, words):
    """A cell that begins with %%script false is skipped by a notebook, and none of these binds a name in it."""
    other = f"%%{words}\nfiltered_torques = lambda A, c: c\n{CHECKS[0]}"
    write(tmp_path / "ada" / "04_antagonism_filter_energy.ipynb", [*checked(RIGHT), other])
    assert [one.verdict for one in grade(tmp_path) if one.exercise in NAMES] == ["ok", "ok", "ok"]


HELPERS = {
    "a module": ["%%writefile helper.py\none = 1.0\n", "from helper import one\n"],
    "a module in two parts": [
        "%%file helper.py\nhalf = 0.5\n",
        "%%writefile -a 'helper.py'\none = 2 * half\n",
        "from helper import *\n",
    ],
    "a table": ["%%writefile gains.csv\n1.0, 2.0\n", "one = np.loadtxt('gains.csv', delimiter=',')[0]\n"],
}


@pytest.mark.parametrize("cells", HELPERS.values(), ids=HELPERS)
def test_a_cell_that_is_written_to_a_file_is_found_there(tmp_path, cells):
    assert graded_alone(tmp_path, *cells) == "ok"


def test_what_goes_to_a_file_is_not_run(tmp_path):
    """As in a notebook, where such a cell binds no name."""
    assert graded_alone(tmp_path, "%%writefile helper.py\none = 1.0\n") == "wrong"


@pytest.mark.parametrize(
    "words",
    ["%run helper.py", "%run 'helper.py' 1", "%run helper", "two = 2.0\n%run -i other.py", "from helper import one"],
)
def test_a_file_beside_the_notebook_is_run_as_in_a_notebook(tmp_path, words):
    """IPython's %run: what the file binds is there afterwards, and with -i the file sees what the notebook has."""
    (tmp_path / "helper.py").write_text(
        "half = 0.5\n\n\ndef one_of(half):\n    return 2 * half\n\n\none = one_of(half)\n"
    )
    (tmp_path / "other.py").write_text("one = two / 2\n")
    assert graded_alone(tmp_path, words) == "ok"
    assert {path.name for path in tmp_path.iterdir()} == {"helper.py", "other.py", "04_x.ipynb"}


def test_a_file_that_a_cell_has_written_is_run(tmp_path):
    assert graded_alone(tmp_path, "%%writefile helper.py\none = 1.0\n", "%run helper.py") == "ok"


def test_an_answer_from_a_file_that_is_run_replaces_the_blank_one(tmp_path):
    (tmp_path / "helper.py").write_text(f"import numpy as np\n\n{TORQUES}")
    blank = "def filtered_torques(A, c):\n    raise NotImplementedError\n"
    write(tmp_path / "04_x.ipynb", [SETUP, blank, "%run helper.py", CHECKS[0]])
    write(tmp_path / "04_y.ipynb", [SETUP, blank, f"%%writefile own.py\n{TORQUES}", "%run -i own.py", CHECKS[0]])
    for name in ("04_x.ipynb", "04_y.ipynb"):
        grades = {one.exercise: one for one in grade_one(Submission("ada", tmp_path / name, "04"), 15.0)}
        assert grades[NAMES[0]].verdict == "ok"


@pytest.mark.parametrize("words", ["%run helper.py", "%run -m helper", "%run 00_x.ipynb", "%run"])
def test_a_file_that_cannot_be_run_is_named(tmp_path, words):
    (tmp_path / "00_x.ipynb").write_text("{}")
    body = TORQUES.replace("return A", "return one * A")
    write(tmp_path / "ada" / "04_x.ipynb", [SETUP, words, body + CHECKS[0]])
    said = {one.exercise: one for one in grade(tmp_path)}[NAMES[0]]
    assert f"{words} is not carried out" in said.sentence and said.mistake == "an earlier cell stops"


@pytest.mark.parametrize("text", ["x = (1,\n  2", "x = 1\nreturn 1"])
def test_a_cell_that_is_not_read_is_named_by_the_number_that_a_reader_counts(text):
    assert re.search(r"\(cell 2, line [12]\)", statements(["", text])[1][1])


@pytest.mark.parametrize("first", ["import no_such_package\n" + SETUP, "import no_such_package\nimport numpy as np"])
def test_a_missing_package_is_named_where_its_cell_binds_what_an_answer_needs(tmp_path, first):
    second = "import rapkm_lite as rk\nfrom rapkm_lite.checks import check"
    write(tmp_path / "ada" / "04_x.ipynb", [first, second, TORQUES + CHECKS[0]])
    said = {one.exercise: one for one in grade(tmp_path)}[NAMES[0]]
    assert "name 'np' is not defined; earlier, cell 1:" in said.sentence
    assert "No module named 'no_such_package'" in said.sentence and said.mistake == "an earlier cell stops"


def test_an_earlier_cell_that_does_not_bind_the_missing_name_is_not_blamed(tmp_path):
    write(tmp_path / "ada" / "04_x.ipynb", [SETUP, "1 / 0", TORQUES.replace("A.T @ c", "A.T @ d") + CHECKS[0]])
    said = {one.exercise: one for one in grade(tmp_path)}[NAMES[0]]
    assert "'d' is not defined" in said.sentence and "earlier" not in said.sentence


def test_notebooks_of_format_3_are_read(tmp_path):
    """nbformat 3: sheets of cells, and the code of a cell is its input."""
    cells = [{"cell_type": "code", "input": text, "language": "python", "outputs": []} for text in checked(RIGHT)]
    cells.insert(1, {"cell_type": "heading", "level": 1, "source": ["Filter"]})
    sheets = {"metadata": {}, "nbformat": 3, "nbformat_minor": 0, "worksheets": [{"cells": cells}]}
    (tmp_path / "ada").mkdir()
    (tmp_path / "ada" / "04_x.ipynb").write_text(json.dumps(sheets))
    assert [one.verdict for one in grade(tmp_path) if one.exercise in NAMES] == ["ok", "ok", "ok"]


@pytest.mark.parametrize(
    "before",
    [
        "one = np.zeros(1)\nnp.copyto(one, 1.0)\n",
        "one = np.zeros(1)\n\ndef put(where, what):\n    where[0] = what\n\nput(one, 1.0)\n",
        "other = np.zeros(1)\none = other\nother[0] = 1.0\n",
        "def begin():\n    global one\n    one = [1.0]\n\nbegin()\n",
        "class Box:\n    pass\n\nbox = Box()\nsetattr(box, 'one', 1.0)\none = [box.one]\n",
        "def make():\n    return [1.0]\n\n%time one = make()\n",
    ],
)
def test_all_that_an_answer_needs_is_run(tmp_path, before):
    """Changed by a function, under another name, as a global: where an answer fails, everything is run."""
    body = TORQUES.replace("return A", "return one[0] * A")
    write(tmp_path / "ada" / "04_antagonism_filter_energy.ipynb", [SETUP, before, *checked([body, *RIGHT[1:]])[1:]])
    assert [one.verdict for one in grade(tmp_path) if one.exercise in NAMES] == ["ok", "ok", "ok"]


UNCOMPILED = [
    "def g(a, a):\n    return a\n",
    "def g():\n    k = 1\n    global k\n",
    "def g():\n    from math import *\n",
]


@pytest.mark.parametrize("before", UNCOMPILED)
def test_a_cell_that_cannot_be_compiled_costs_only_itself(tmp_path, before):
    """What Python parses and does not compile: in a notebook such a cell does not run, and the others do."""
    write(tmp_path / "ada" / "04_antagonism_filter_energy.ipynb", [SETUP, before, *checked(RIGHT)[1:]])
    assert [one.verdict for one in grade(tmp_path) if one.exercise in NAMES] == ["ok", "ok", "ok"]


@pytest.mark.parametrize(
    "text",
    ["one = " + " + ".join(["two"] * 900), "one = f\"{two}\\n\\'\\'\\' {two['c']} \\\"\\\"\\\" \""],
    ids=["a long sum", "quotes within quotes"],
)
def test_what_a_statement_uses_is_read_where_python_cannot_write_it_anew(text):
    read, broken = statements(["two = 1", text, "check('04.x', one)"])
    assert not broken and needed(read, set()) == read


def test_a_return_outside_its_function_is_said_to_be_there(tmp_path):
    body = "def filtered_torques(A, c):\n    z = A.T @ c\nreturn A @ z\n"
    write(tmp_path / "ada" / "04_antagonism_filter_energy.ipynb", checked([body, *RIGHT[1:]]))
    said = {one.exercise: one for one in grade(tmp_path)}[NAMES[0]]
    assert said.verdict == "wrong" and "'return' outside function" in said.sentence


def test_an_answer_below_the_check_that_stops_counts(tmp_path):
    """Cells were run in another order than they stand; where nothing stands below, the cell stops."""
    for name, cells in (("ada", [CHECKS[0], TORQUES]), ("ben", [CHECKS[0]])):
        write(tmp_path / name / "04_antagonism_filter_energy.ipynb", [SETUP, *cells])
    said = {one.student: (one.verdict, one.mistake) for one in grade(tmp_path) if one.exercise == NAMES[0]}
    assert said == {"ada": ("ok", ""), "ben": ("wrong", "its cell stops")}


def test_a_mark_of_byte_order_costs_nothing(tmp_path):
    """Some editors put one in front of a notebook."""
    path = tmp_path / "ada" / "04_antagonism_filter_energy.ipynb"
    write(path, checked(RIGHT))
    path.write_text(path.read_text(encoding="utf-8"), encoding="utf-8-sig")
    assert [one.verdict for one in grade(tmp_path) if one.exercise in NAMES] == ["ok", "ok", "ok"]


def test_what_is_awaited_is_waited_for(tmp_path):
    """A notebook may await outside a function."""
    before = "import asyncio\nasync def give():\n    await asyncio.sleep(0)\n    return 1.0\none = await give()\n"
    assert graded_alone(tmp_path, before) == "ok"


def test_a_number_in_a_name_that_is_no_lesson_is_corrected_by_the_exercises(tmp_path):
    """A team, or the month of a date, has a number like a lesson."""
    for name in (
        "team_07_lesson_04.ipynb",
        "filter_2026_03_12.ipynb",
        "Abgabe 12.03.ipynb",
        "04-filter-2026-03-12.ipynb",
    ):
        write(tmp_path / "ada" / name, checked(RIGHT))
        assert [(one.lesson, one.path.name) for one in found(tmp_path, {"03", "04", "07"})] == [("04", name)]
        (tmp_path / "ada" / name).unlink()


def test_a_notebook_whose_lesson_cannot_be_told_is_not_graded_but_named(tmp_path):
    """A date is not a lesson, unless the exercises say so; a name as the lessons have them is one."""
    names = ["12.03_report.ipynb", "2026-12-03.ipynb", "Bericht 04 2026.ipynb", "00_start_2026-12-03.ipynb"]
    for name in (*names, "04_title_2026-12-03.ipynb"):
        write(tmp_path / "ada" / name, [SETUP])
    assert [one.path.name for one in found(tmp_path, {"03", "04", "12"})] == ["04_title_2026-12-03.ipynb"]
    assert unnamed(tmp_path, {"03", "04", "12"}) == sorted(f"ada/{name}" for name in names[:3])


@pytest.mark.parametrize("name", ["04 Übung – Lösung", "Übung 04", "lesson04", "04", "04-filter (1)", "x_04 (gültig)"])
def test_a_lesson_is_told_by_its_number_whatever_stands_around_it(tmp_path, name):
    write(tmp_path / "Jörg Müßig" / f"{name}.ipynb", [SETUP])
    write(tmp_path / "Jörg Müßig" / "04a 2026 1004 homework.ipynb", [SETUP])
    assert [(one.student, one.lesson) for one in found(tmp_path, {"04", "10"})] == [("Jörg Müßig", "04")]


INDIRECT = [
    "def test():\n    check(NAME, mine)\n\ntest()\n",
    "def test(f):\n    return check(NAME, f)\n\nresult = test(mine)\n",
    "class Exercise:\n    def run(self):\n        check(NAME, mine)\n\nExercise().run()\n",
    "from functools import partial\ntry_it = partial(check, NAME)\ntry_it(mine)\n",
    "def checked(f):\n    check(NAME, f)\n    return f\n\n@checked\ndef again(A, c):\n    return mine(A, c)\n",
    "def main():\n    global filtered_torques\n    filtered_torques = mine\n    check(NAME, mine)\n\nmain()\n",
    "from rapkm_lite.checks import check as judge\nask = lambda f: judge(NAME, f)\nask(mine)\n",
    "exec('check(NAME, mine)')\n",
]


def test_a_check_counts_whatever_calls_it(tmp_path):
    """An answer of another name, checked in a function, a class, a decorator: where nothing is found, all is run."""
    mine = TORQUES.replace("filtered_torques", "mine") + f'NAME = "{NAMES[0]}"\n'
    for number, words in enumerate(INDIRECT):
        write(tmp_path / f"{number}" / "04_antagonism_filter_energy.ipynb", [SETUP, mine + words])
    verdicts = {(one.student, one.exercise): one.verdict for one in grade(tmp_path)}
    for number, words in enumerate(INDIRECT):
        assert [verdicts[f"{number}", name] for name in NAMES] == ["ok", "todo", "todo"], words


def test_what_a_student_prints_is_not_kept():
    stream = nowhere()
    tracemalloc.start()
    for _ in range(1000):
        print("x" * 10_000, file=stream)
    kept = tracemalloc.get_traced_memory()[0]
    tracemalloc.stop()
    assert kept < 1e6, "of 1e7 characters"


def test_a_student_may_treat_the_output_as_a_stream(tmp_path):
    """Written to in all ways, asked what it is, closed: the next statement finds a new one."""
    before = """import sys
factor = 0.0
for stream in (sys.stdout, sys.stderr):
    stream.writelines(["one\\n", "\\udcff"])
    factor += stream.write("four") / 8
    assert not stream.isatty() and stream.encoding.lower() == "utf-8"
    stream.buffer.write(b"bytes")
    print("now", file=stream, flush=True)
closed = [sys.stdout.close(), 1.0][1]
written = [print("here"), 1.0][1]
"""
    body = before + TORQUES.replace("return A", "return factor * closed * written * A")
    write(tmp_path / "ada" / "04_antagonism_filter_energy.ipynb", checked([body, *RIGHT[1:]]))
    assert [one.verdict for one in grade(tmp_path) if one.exercise in NAMES] == ["ok", "ok", "ok"]


@pytest.mark.parametrize("path", LESSONS, ids=lambda path: path.stem)
def test_no_lesson_hides_its_checks(path):
    """So a lesson that is handed in as it was handed out is not run twice."""
    assert not hides_check(statements(sources(path))[0])


@pytest.mark.skipif(os.name == "nt", reason="links and such names need another file system")
def test_one_odd_submission_does_not_cost_the_others(tmp_path, capsys):
    """A link to nothing, a folder that is a link or holds itself, a name and a message that are no text."""
    write(tmp_path / "ada" / "04_antagonism_filter_energy.ipynb", checked(RIGHT))
    crash = "def filtered_torques(A, c):\n    raise ValueError('bad \\udcff')\n"
    write(tmp_path / os.fsdecode(b"M\xfcller") / "04_antagonism_filter_energy.ipynb", checked([crash, *RIGHT[1:]]))
    (tmp_path / "ben").mkdir()
    (tmp_path / "ben" / "04_x.ipynb").symlink_to("/nowhere/04_x.ipynb")
    write(tmp_path.parent / f"{tmp_path.name}_real" / "04_y.ipynb", checked(RIGHT))
    (tmp_path / "cleo").symlink_to(tmp_path.parent / f"{tmp_path.name}_real")
    (tmp_path / "ada" / "again").symlink_to(tmp_path)
    file = tmp_path / "grades.csv"
    assert main(["grade", str(tmp_path), "--csv", str(file)]) == 0
    with file.open(newline="", encoding="utf-8") as lines:
        points = [float(row["points"]) for row in csv.DictReader(lines) if row["exercise"] in NAMES]
    assert len(points) == 12 and sum(p > 0 for p in points) == 3 + 2 + 0 + 3
    assert "cleo" in capsys.readouterr().out


def test_what_a_check_says_of_no_answer_stays(tmp_path):
    half = TORQUES.replace("return ", "")
    own = "from rapkm_lite.lessons.lesson04.exercises import filtered_torques\n"
    for student, body in (("ada", half), ("ben", own)):
        write(tmp_path / student / "04_antagonism_filter_energy.ipynb", checked([body, *RIGHT[1:]]))
    said = {one.student: one.sentence for one in grade(tmp_path) if one.exercise == NAMES[0]}
    assert "return" in said["ada"] and "the package's own answer" in said["ben"]


def test_folders_without_submissions_are_refused(tmp_path, capsys):
    with pytest.raises(ValueError, match="allowed: a folder that exists"):
        found(tmp_path / "nowhere", {"04"})
    with pytest.raises(ValueError, match="allowed: a folder with notebooks"):
        found(tmp_path, {"04"})
    assert main(["grade", str(tmp_path)]) == 2
    assert "allowed: a folder with notebooks" in capsys.readouterr().err


def test_a_package_that_is_missing_where_one_grades_is_named(tmp_path, monkeypatch):
    """The answers of the solution are right: only what the cases are made with is not there. A stub is none yet."""
    (tmp_path / "without").mkdir()
    (tmp_path / "without" / "sympy.py").write_text("raise ImportError('no SymPy here')\n")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path / "without"))
    solution = LESSONS[0].parent / "solutions" / "12_your_machine.ipynb"
    grades = {one.exercise: one for one in grade_one(Submission("ada", solution, "12"), 30.0)}
    for name in ("12.fight", "12.other_units"):
        assert "cannot be judged here" in grades[name].sentence and "pip install sympy" in grades[name].sentence
    assert grades["12.own_machine"].verdict == "ok"
    blank = grade_one(Submission("ben", LESSONS[0].parent / "12_your_machine.ipynb", "12"), 30.0)
    assert [(one.verdict, one.mistake) for one in blank] == [("todo", "")] * 3


# What the worker does with one notebook.
def right(A, c):
    return A @ np.linalg.solve(A.T @ A, A.T @ c)


def wrong(A, c):
    return -right(A, c)


@pytest.fixture
def bench(tmp_path):
    return Bench("04", tmp_path / "log", set(), tmp_path)


def test_without_a_check_the_last_answer_counts(bench):
    bench.bound[NAMES[0]] = [(0, wrong), (0, right)]
    assert bench.without_check(NAMES[0], [f'"{NAMES[0]}"']).word == "ok"
    bench.bound[NAMES[0]].reverse()
    assert bench.without_check(NAMES[0], [f'"{NAMES[0]}"']).word == "wrong"


def test_the_rest_of_a_cell_that_failed_is_left_out(bench):
    texts = ["filtered_torques = 1.0\n1 / 0\nfiltered_torques = 2.0\n", "filtered_torques = 3.0\n"]
    bench.run(statements(texts)[0], texts)
    assert bench.bound[NAMES[0]] == [(0, 1.0), (1, 3.0)]
    assert "ZeroDivisionError" in bench.failed[0]


def test_a_later_answer_replaces_a_verdict_and_a_blank_one_does_not(bench):
    for answer, word in ((right, "ok"), (..., "ok"), (wrong, "wrong")):
        bench.check(NAMES[0], answer)
        assert bench.results[NAMES[0]].word == word


def test_the_worker_imports_the_package_that_grades_and_is_not_strict(monkeypatch):
    monkeypatch.setenv("RAPKM_LITE_STRICT", "1")
    monkeypatch.setenv("PYTHONPATH", "elsewhere")
    own = grader._environment()
    assert own["RAPKM_LITE_STRICT"] == "0"
    assert own["PYTHONPATH"].split(os.pathsep) == [str(Path(rapkm_lite.__file__).parents[1]), "elsewhere"]


def graded_alone(folder, *before):
    """The verdict on a right answer that needs `one`, which the statements before it make."""
    body = TORQUES.replace("return A", "return one * A")
    write(folder / "04_x.ipynb", [SETUP, *before, body + CHECKS[0]])
    return {g.exercise: g.verdict for g in grade_one(Submission("ada", folder / "04_x.ipynb", "04"), 15.0)}[NAMES[0]]


def test_files_of_a_student_are_written_elsewhere(tmp_path, monkeypatch):
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    assert graded_alone(tmp_path, "one = [open('mine.txt', 'w').close(), 1.0][1]") == "ok"
    assert not list(Path().iterdir())


READS = """one = np.loadtxt("data.csv")
with open("logs/one.txt") as file:
    one = one * float(file.read())
with open("data.csv", "w") as file, open("logs/mine.txt", "w") as mine:
    one = one * bool(file.write("2.0"))
"""


@pytest.mark.parametrize("words", [READS, "from helper import one", "%run helper.py"], ids=["cell", "import", "%run"])
def test_a_data_file_beside_the_notebook_is_read_from_a_copy(tmp_path, words):
    """Written to by the student, changed for nobody; a name of the standard library is not taken by a file of his."""
    files = {
        "data.csv": "1.0",
        "logs/one.txt": "1.0",
        "helper.py": f"import numpy as np\n{READS}",
        "random.py": "1 / 0",
    }
    (tmp_path / "logs").mkdir()
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    assert graded_alone(tmp_path, f"import random\n{words}\n") == "ok"
    left = {path.relative_to(tmp_path).as_posix(): path for path in tmp_path.rglob("*") if path.is_file()}
    assert {*left} == {*files, "04_x.ipynb"} and all(left[name].read_text() == text for name, text in files.items())


@pytest.mark.skipif(os.name == "nt", reason="links need a right there")
def test_what_would_be_too_much_to_copy_is_linked(tmp_path):
    """As 2 GB beside the notebook of each of thirty students: only what fits is copied, and all of it is found."""
    for name, size in (("a.bin", 10**8 - 1), ("b.bin", 2), ("c.bin", 1)):
        with (tmp_path / name).open("wb") as file:
            file.truncate(size)
    grader._lend(Submission("ada", tmp_path / "04_x.ipynb", "04"), work := tmp_path / ".work")
    assert [(work / name).is_symlink() for name in ("a.bin", "b.bin", "c.bin")] == [False, True, False]
    assert (work / "b.bin").read_bytes() == bytes(2)


def test_a_folder_that_cannot_be_copied_costs_nobody_a_grade(tmp_path, monkeypatch):
    """The disk is full, or the name would be too long below the working folder."""
    (tmp_path / "logs").mkdir()
    (tmp_path / "logs" / "one.txt").write_text("1.0")
    made = Path.mkdir

    def full(folder, *words, **named):
        if folder.name == "logs":
            raise OSError(errno.ENOSPC, "No space left on device", str(folder))
        made(folder, *words, **named)

    monkeypatch.setattr(Path, "mkdir", full)
    assert graded_alone(tmp_path, "one = 1.0") == "ok"


def test_a_student_finds_only_files_of_his_own(tmp_path):
    """In a folder what lies there, beside loose notebooks what lies beside them, and no folder: it is another's."""
    sees = "from pathlib import Path\none = 1.0 * ({} == sorted(path.name for path in Path().rglob('*')))\n"
    answer = TORQUES.replace("return A", "return one * A") + CHECKS[0]
    seen = {"ada/04_x": ["data.csv"], "ben/deep/04_x": [], "04_cyd": ["handed_out.csv"], "04_dan": ["handed_out.csv"]}
    for name, files in seen.items():
        write(tmp_path / f"{name}.ipynb", [SETUP, sees.format(files) + answer])
    for name in ("handed_out.csv", "ada/data.csv", "ada/.hidden", "ben/above.csv"):
        (tmp_path / name).write_text("1.0")
    assert [one.verdict for one in grade(tmp_path) if one.exercise == NAMES[0]] == ["ok"] * 4


COUNTER = "import sys, time\nfor _ in range(200):\n    open(sys.argv[1], 'a').write('x')\n    time.sleep(0.05)\n"
STARTS = """import subprocess, sys, time
from pathlib import Path
mark = {mark!r}
one = [subprocess.Popen([sys.executable, "-c", {code!r}, mark]), 1.0][1]
while not Path(mark).exists() or not Path(mark).stat().st_size:
    one = [time.sleep(0.01), 1.0][1]
"""


@pytest.mark.skipif(os.name == "nt", reason="groups of processes are another thing there")
def test_what_a_notebook_started_ends_with_it(tmp_path):
    """A process that would write for ten seconds."""
    mark = tmp_path / "alive"
    assert graded_alone(tmp_path, STARTS.format(mark=str(mark), code=COUNTER)) == "ok"
    written = mark.stat().st_size
    time.sleep(1.0)
    assert mark.stat().st_size == written


def test_the_limit_of_a_statement_is_the_one_that_the_help_says(tmp_path, monkeypatch, capsys):
    asked = []
    monkeypatch.setattr(grader, "grade", lambda folder, seconds, jobs, bar: asked.append((seconds, jobs)) or [])
    assert main(["grade", str(tmp_path)]) == 0 and main(["grade", str(tmp_path), "--seconds", "5", "--jobs", "2"]) == 0
    with pytest.raises(SystemExit):
        main(["grade", "--help"])
    told = re.search(r"limit of a statement or a\s+check \((\d+)\)", capsys.readouterr().out)
    assert told and asked == [(float(told[1]), None), (5.0, 2)]


class Acted:
    """A clock that moves when the grader waits, and workers that say what is written for their time, s from the start.

    script : from the keys to skip to lines at their times; None for a line is the end of the process.
    """

    def __init__(self, monkeypatch, script):
        self.now, self.script, self.starts, self.ends = 0.0, script, [], []
        monkeypatch.setattr(grader, "time", SimpleNamespace(monotonic=lambda: self.now, sleep=self.sleep))
        monkeypatch.setattr(grader.subprocess, "Popen", self.start)
        monkeypatch.setattr(grader, "_end", lambda worker: self.ends.append(self.now - self.begun))

    def start(self, command, **_):
        self.starts.append([key for word, key in itertools.pairwise(command) if word == "--skip"])
        self.log, self.begun, self.gone = Path(command[5]), self.now, False
        self.lines = iter(self.script(self.starts[-1]))
        self.next = next(self.lines, None)
        return SimpleNamespace(poll=lambda: 0 if self.gone else None)

    def sleep(self, seconds):
        self.now += seconds
        while self.next and self.now - self.begun >= self.next[0]:
            if self.next[1] is None:
                self.gone = True
            else:
                with self.log.open("a") as log:
                    log.write(json.dumps(self.next[1]) + "\n")
            self.next = next(self.lines, None)


def results(seconds=30.0):
    one = Submission("ada", Path("nowhere/04_x.ipynb"), "04")
    return grader._results(one, seconds, grader.Event(), whole=False)[0]


DONE = [{"result": [NAMES[0], "ok", "right", ""]}, {"done": True}]


def test_statements_that_keep_to_their_limit_are_run_to_the_end(monkeypatch):
    """`seconds` is the limit of each statement; what all of them take is another one, and so is the start."""
    lines = [(45.0, {"hidden": False}), *((45.0 + 29.0 * k, {"begin": f"1.{k}"}) for k in range(6))]
    acted = Acted(monkeypatch, lambda skip: [*lines, *((215.0, event) for event in DONE)])
    assert results() == {NAMES[0]: ("ok", "right", "")} and acted.starts == [[]]


def test_a_statement_that_hangs_is_ended_at_its_limit_and_left_out_of_the_next_start(monkeypatch):
    first = [(2.0, {"hidden": False}), (2.0, {"begin": "1.0"}), (10.0, {"begin": "1.1"})]
    acted = Acted(monkeypatch, lambda skip: [(1.0, event) for event in DONE] if skip else first)
    assert results() == {NAMES[0]: ("ok", "right", "")}
    assert acted.starts == [[], ["1.1"]] and acted.ends[0] == pytest.approx(40.0, abs=0.1)


def test_a_notebook_gets_ten_times_the_limit_of_a_statement(monkeypatch):
    """Statements without end, none of which takes too long."""
    acted = Acted(monkeypatch, lambda skip: ((20.0 * k, {"begin": f"1.{k}"}) for k in range(1, 999)))
    assert results() == {} and acted.starts == [[]] and acted.ends == [pytest.approx(300.0, abs=0.1)]


def test_a_notebook_all_of_whose_statements_hang_is_started_as_often_as_its_time_allows(monkeypatch):
    acted = Acted(monkeypatch, lambda skip: [(0.0, {"begin": f"1.{len(skip)}"})])
    assert results(60.0) == {} and acted.starts[-1] == [f"1.{k}" for k in range(len(acted.starts) - 1)]
    assert 3 < len(acted.starts) <= 10 and acted.ends == pytest.approx([60.0] * len(acted.starts), abs=0.1)


def test_a_grader_that_is_interrupted_ends_what_runs_and_begins_nothing_more(tmp_path, monkeypatch):
    """Ctrl-C arrives while others wait: of twenty notebooks those that hang for longer than the test are ended."""
    for number in range(20):
        write(tmp_path / f"student{number:02}" / "04_x.ipynb", [SETUP, TORQUES + CHECKS[0]] if number == 0 else
              [SETUP, f"import time\n{ENDLESS}{CHECKS[0]}"])  # fmt: skip
    begun, start = [], grader.grade_one
    monkeypatch.setattr(grader, "grade_one", lambda one, *others: begun.append(one) or start(one, *others))

    def interrupt(done, total, one):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        grade(tmp_path, jobs=2, progress=interrupt)
    assert len(begun) <= 4


@pytest.mark.parametrize("folder", ["..", "../../class", "../ada/.."])
def test_the_folder_that_one_stands_in_is_graded_too(folder, tmp_path, monkeypatch):
    """However a teacher in a student's folder names the folder of all."""
    for student in ("ada", "ben"):
        write(tmp_path / "class" / student / "04_x.ipynb", [SETUP])
    monkeypatch.chdir(tmp_path / "class" / "ada")
    assert [one.student for one in found(Path(folder), {"04"})] == ["ada", "ben"]


@pytest.mark.skipif(os.name == "nt", reason="a process does not learn there that the one that started it is gone")
def test_nothing_hangs_on_when_the_grader_was_killed(tmp_path):
    """As by a window that is closed: an answer that never comes to an end says so while it runs, and falls silent."""
    beat = tmp_path / "beat"
    loop = f"    while True:\n        open({str(beat)!r}, 'w').close()\n        time.sleep(0.05)\n"
    body = f"import time\ndef told():\n{loop}filtered_torques = told()\n{CHECKS[0]}"
    write(tmp_path / "all" / "ada" / "04_x.ipynb", [SETUP, body])
    own = [sys.executable, "-m", "rapkm_lite", "grade", str(tmp_path / "all"), "--seconds", "60"]
    with subprocess.Popen(own, cwd=Path(__file__).parents[1], stderr=subprocess.DEVNULL) as process:
        ends = time.monotonic() + 30.0
        while not beat.exists() and time.monotonic() < ends:
            time.sleep(0.05)
        process.kill()
    assert beat.exists()
    while time.time() - beat.stat().st_mtime < 2.0 and time.monotonic() < ends:
        time.sleep(0.1)
    assert time.time() - beat.stat().st_mtime >= 2.0
