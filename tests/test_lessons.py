"""The lessons as files: built from their sources, with clean outputs; solved ones right, wrong answers caught."""

import ast
import importlib.util
import os
import re
from pathlib import Path

import nbformat
import numpy as np
import pytest
import shape
import stored

from rapkm_lite.checks import Exercise, check, examine, exercises
from rapkm_lite.lessons import checker
from rapkm_lite.lessons.grading.submission import called

NOTEBOOKS = Path(__file__).parents[1] / "notebooks"
LESSONS = sorted(NOTEBOOKS.glob("*.ipynb"))
NUMBERED = [path for path in LESSONS if path.stem[:2].isdigit()]
SOLVED = sorted((NOTEBOOKS / "solutions").glob("*.ipynb"))
NAMES = {"ids": lambda path: path.stem}

_spec = importlib.util.spec_from_file_location("build", NOTEBOOKS / "build.py")
build = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(build)


def lesson(path):
    """A lesson with those that a reader has read before it."""
    number = path.stem[:2] if path.stem[:2].isdigit() else path.stem
    earlier = tuple(shape.Lesson(p.stem[:2], nbformat.read(p, as_version=4)) for p in NUMBERED if p.stem < path.stem)
    return shape.Lesson(number, nbformat.read(path, as_version=4), earlier)


def no_complaint(complaints):
    assert not complaints, "\n".join(["", *complaints])


def code_cells(path):
    return [cell for cell in nbformat.read(path, as_version=4).cells if cell.cell_type == "code"]


@pytest.mark.parametrize("path", SOLVED, **NAMES)
def test_student_lesson_is_generated_from_its_solution(path):
    made = build.student(nbformat.read(path, as_version=4))
    kept = nbformat.read(NOTEBOOKS / path.name, as_version=4)
    same = [c.source for c in made.cells] == [c.source for c in kept.cells]
    assert same, f"run: python notebooks/build.py {path.stem}"
    text = "\n".join(c.source for c in kept.cells)
    assert "SOLUTION" not in text and ("NotImplementedError" in text or "= ..." in text)


@pytest.mark.parametrize("path", SOLVED, **NAMES)
def test_solved_lesson_passes_every_check_in_strict_mode(path, monkeypatch):
    from nbclient import NotebookClient

    monkeypatch.setenv("RAPKM_LITE_STRICT", "1")
    monkeypatch.setenv("MPLBACKEND", "agg")  # pictures are drawn when the lessons' own cells are tested
    notebook = nbformat.read(path, as_version=4)
    folder = {"metadata": {"path": str(NOTEBOOKS)}}
    NotebookClient(notebook, timeout=300, kernel_name="python3", resources=folder).execute()
    said = "".join(o.get("text", "") for c in notebook.cells if c.cell_type == "code" for o in c.outputs)
    checks = sum(c.source.count('check("') for c in notebook.cells if c.cell_type == "code")
    assert checks >= 3, f"lesson {path.stem[:2]} has {checks} checks; allowed: 3 or more"
    assert said.count("OK ") >= checks, said


@pytest.mark.parametrize("path", LESSONS + SOLVED, ids=lambda p: f"{p.parent.name}/{p.stem}")
def test_stored_outputs_are_clean(path):
    cells = code_cells(path)
    for number, cell in enumerate(cells):
        assert cell.source.count("\n") < 25, f"cell {number} has more than 25 lines"
        assert cell.execution_count is not None, f"cell {number} was never run"
        for output in cell.outputs:
            assert output.output_type != "error", f"cell {number} stores an error"
            assert output.get("name") != "stderr", f"cell {number} stores a warning"
    text = path.read_text(encoding="utf-8")
    assert not re.search(r"/(home|root|tmp|Users)/|[A-Z]:\\\\Users", text), "a path of a machine is stored"


@pytest.mark.parametrize("path", NUMBERED, **NAMES)
def test_compared_cells_have_outputs(path):
    compared = [c for c in code_cells(path) if "nbval-check-output" in c.metadata.get("tags", [])]
    assert all(c.outputs for c in compared), "nbval passes a cell without stored outputs"
    assert len(compared) >= (5 if path.stem[:2] != "00" else 1)


@pytest.mark.parametrize("path", NUMBERED, **NAMES)
def test_prose_and_code_are_balanced(path):
    found = shape.minutes.read(path)
    words, lines = (sum(getattr(part, what) for part in found) for what in ("words", "lines"))
    assert 7 <= words / lines <= 20, f"{words} words for {lines} lines of code: {words / lines:.1f} per line"


@pytest.mark.parametrize("path", NUMBERED, **NAMES)
@pytest.mark.parametrize("rule", shape.RULES, ids=lambda rule: rule.__name__)
def test_lesson_has_its_shape(rule, path):
    no_complaint(rule(lesson(path)))


@pytest.mark.parametrize("path", LESSONS + SOLVED, ids=lambda p: f"{p.parent.name}/{p.stem}")
def test_lesson_stores_what_it_must(path):
    one = lesson(path)
    hints = {name: exercise.hints for name, exercise in exercises().items()}
    said = stored.alternative_text(one) + stored.in_order(one)
    no_complaint(said + stored.hidden_outputs(one, build.COVER) + stored.no_hints(one, hints))


def test_in_the_picture_opens_a_handful_of_paragraphs():
    counts = {path.stem: shape.picture_phrases(lesson(path)) for path in NUMBERED}
    assert sum(counts.values()) <= 5, f"vary the openings: {counts}"


@pytest.mark.parametrize("path", [p for p in NUMBERED if p.stem >= "03"], **NAMES)
def test_lesson_has_an_exercise_of_design(path):
    designs = [name for name, exercise in exercises().items() if name.startswith(path.stem[:2]) and exercise.judge]
    assert designs, f"lesson {path.stem[:2]}: no exercise is judged by what it does (Exercise.judge)"


def wrong_answers(exercise: Exercise):
    """Sign flipped, off by a factor, transposed where that differs, not finite."""

    def changed(change):
        return lambda *case: change(np.asarray(exercise.reference(*case), dtype=float))

    yield "sign flipped", changed(lambda v: -v)
    yield "off by a factor", changed(lambda v: 1.1 * v)
    yield "not finite", changed(lambda v: v * np.nan)
    sample = np.asarray(exercise.reference(*exercise.cases(np.random.default_rng(1))[0]), dtype=float)
    if sample.ndim >= 2 and not (sample.shape[-1] == sample.shape[-2] and np.allclose(sample, sample.swapaxes(-1, -2))):
        yield "transposed", changed(lambda v: v.swapaxes(-1, -2))


@pytest.mark.parametrize("name", sorted(name for name, exercise in exercises().items() if not exercise.judge))
def test_wrong_answers_fail_without_a_hint(name):
    exercise = exercises()[name]
    assert examine(name, exercise.reference)[0] == "ok"
    for what, wrong in wrong_answers(exercise):
        verdict, sentence = examine(name, wrong)
        assert verdict == "wrong", f"{what} passes {name}"
        assert not any(step in sentence for step in exercise.hints), "a hint that nobody asked for"


@pytest.mark.parametrize("name", sorted(exercises()))
def test_blank_answers_are_not_yet(name, capsys):
    def stub(*case):
        raise NotImplementedError

    assert examine(name, stub)[0] == "todo" and examine(name, ...)[0] == "todo"
    os.environ.pop("RAPKM_LITE_STRICT", None)
    exercise = exercises()[name]
    for blank in (..., None, stub):
        got = check(name, blank)
        assert capsys.readouterr().out == f"TODO {name}: not yet\n"
        if exercise.secret:
            assert np.all(np.isnan(got))
        elif not exercise.judge:
            cases = exercise.cases(np.random.default_rng(1))
            got = got if exercise.is_value(cases) else got(*cases[0])
            np.testing.assert_array_equal(got, exercise.reference(*cases[0]))


def test_list_of_all_figures_is_generated_from_the_rooms():
    kept = (build.PACKAGE / "plotting.py").read_text(encoding="utf-8")
    assert kept == build.figure_list(), "run: python notebooks/build.py figures"


def test_every_lesson_has_its_room_and_its_exercises_bear_its_number():
    numbers = {path.stem[:2] for path in LESSONS if path.stem[:2].isdigit()}
    assert {f"lesson{n}" for n in numbers} == set(checker.lessons())
    for name, exercise in exercises().items():
        assert name.partition(".")[0] in numbers and all(exercise.hints)


CURVES = "01.pin_forces", "03.rest_error", "04.filtered_torques", "05.feedback_map", "06.placement"
CURVES += "07.contradiction", "09.room", "11.model_error"


@pytest.mark.parametrize("name", CURVES)
def test_an_answer_that_is_a_curve_is_drawn_in_its_picture_when_it_is_not_right(name):
    (path,) = (NOTEBOOKS / "solutions").glob(f"{name[:2]}_*.ipynb")
    pictures = [cell.source for cell in code_cells(path) if "plotting.plot" in cell.source]
    assert any(f'draw_own("{name}"' in source for source in pictures)


@pytest.mark.parametrize("path", NUMBERED, **NAMES)
def test_the_lesson_itself_gives_no_answer_its_name(path):
    """A loop variable of that name would be graded in place of an answer that is not there."""
    names = {called(n, e): n for n, e in exercises().items() if n.startswith(path.stem[:2])}
    for cell in code_cells(path):
        made = {n.id for n in ast.walk(ast.parse(cell.source)) if isinstance(n, ast.Name) and type(n.ctx) is ast.Store}
        assert not [n for n in made & set(names) if f'"{names[n]}"' not in cell.source]


def test_blanking_keeps_the_signature_and_names():
    source = 'def f(x):\n    """Double."""\n    ### BEGIN SOLUTION\n    return 2 * x\n    ### END SOLUTION\n'
    assert build.blank(source) == 'def f(x):\n    """Double."""\n    raise NotImplementedError'
    assert build.blank("### BEGIN SOLUTION\na = 1\nb = a\n### END SOLUTION\nprint(a)") == "a = ...\nb = ...\nprint(a)"


@pytest.mark.parametrize("path", NUMBERED, **NAMES)
def test_readme_asks_the_question_of_the_lesson(path):
    title = nbformat.read(path, as_version=4).cells[0].source.splitlines()[0]
    number, question = title.removeprefix("# ").split(" · ", 1)
    assert number == path.stem[:2]
    readme = (NOTEBOOKS.parent / "README.md").read_text(encoding="utf-8")
    asked = f"[{path.stem}](notebooks/{path.name}) | {question} |" in readme
    assert asked, f"README.md, row of {path.stem}: the question is {question!r}"


def said_by_the_first_lesson():
    start = nbformat.read(NOTEBOOKS / "00_start_here.ipynb", as_version=4)
    text = "\n".join(cell.source for cell in start.cells)
    return dict(re.findall(r"^\| \[.+\]\((\w+\.ipynb)\) \|.+\| (\d+) \|$", text, re.M))


@pytest.mark.parametrize("path", NUMBERED[1:], **NAMES)
def test_the_first_lesson_says_how_long_the_others_take(path):
    minutes = str(shape.minutes.stated(nbformat.read(path, 4)))
    said = said_by_the_first_lesson().get(path.name)
    assert said == minutes, f"00_start_here.ipynb, table of lessons, row of {path.name}: {minutes} minutes"


def test_the_first_lesson_names_no_lesson_that_is_not_there():
    assert set(said_by_the_first_lesson()) == {path.name for path in NUMBERED[1:]}


@pytest.mark.parametrize("path", NUMBERED, **NAMES)
def test_tables_agree_with_the_lesson(path):
    text = "\n".join(cell.source for cell in nbformat.read(path, as_version=4).cells)
    minutes = re.search(r"\*\*(?:Minutes|Time):?\W*(\d+)", text)
    row = next(
        line
        for line in (NOTEBOOKS.parent / "README.md").read_text(encoding="utf-8").splitlines()
        if line.startswith(f"| [{path.stem}]")
    ).split("|")
    assert minutes and row[3].strip() == minutes[1], f"README.md, row of {path.stem}: the lesson has other minutes"
    for name in re.findall(r"`([\w.]+)`", row[5]):
        assert re.search(rf"\b{re.escape(name)}\b", text), f"the README says that the lesson uses {name}"
