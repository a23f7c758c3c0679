"""The teachers' pages against the lessons: what is generated is up to date, numbers are right, nothing is left out."""

import itertools
import os
import re
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import nbformat
import numpy as np
import pytest

import rapkm_lite as rk
from rapkm_lite.checks import exercises
from rapkm_lite.lessons.lesson03 import tasks as lesson03
from rapkm_lite.lessons.lesson07 import tasks as lesson07
from rapkm_lite.lessons.lesson08 import tasks as lesson08
from rapkm_lite.lessons.lesson09 import tasks as lesson09
from rapkm_lite.lessons.lesson10 import tasks as lesson10
from rapkm_lite.lessons.lesson11 import tasks as lesson11
from rapkm_lite.lessons.lesson12 import tasks as lesson12

ROOT = Path(__file__).parents[1]
TEACHING = ROOT / "docs" / "teaching"
sys.path.insert(0, str(ROOT / "notebooks"))

from workshop import teaching  # noqa: E402

EXAM = (TEACHING / "exam.md").read_text(encoding="utf-8")
ITEMS = {int(number): body for number, body in re.findall(r"^### (\d+) ·(.*?)(?=^### |\Z)", EXAM, re.M | re.S)}


@pytest.mark.parametrize("name", teaching.PAGES)
def test_generated_pages_are_up_to_date(name):
    kept = (TEACHING / f"{name}.md").read_text(encoding="utf-8")
    assert kept == teaching.PAGES[name]().rstrip() + "\n", "run: python notebooks/build.py teaching"


def test_the_answer_to_a_question_inside_a_lesson_stands_behind_it():
    """No question takes the answer of the one before it: in the lesson it comes later than the question."""
    page = teaching.predictions_page()
    for notebook in teaching.lessons().values():
        told = page.split(f"## {teaching.title(notebook)}\n")[1].split("\n## ")[0]
        lesson = "\n".join(cell.source for cell in notebook.cells if cell.cell_type == "markdown")
        for question, answer in re.findall(r"^(\*\*(?:Predict|Before).*?)\n\n((?:>.*\n?)+)", told, re.M | re.S):
            first = answer.lstrip("> ").split("\n")[0]
            if "](" not in first and not first.startswith("The cell that follows"):
                assert lesson.index(question.split("\n")[0]) < lesson.index(first), question


def test_exam_has_39_items_with_answers_and_marks():
    assert list(ITEMS) == list(range(1, 40))
    marks = [int(re.search(r"\((\d+) marks\)", body)[1]) for body in ITEMS.values()]
    assert f"39 items, {sum(marks)} marks" in EXAM
    assert all("**Answer.**" in body for body in ITEMS.values())


def test_exam_says_which_lessons_its_items_go_with():
    """Each item is asked for by a lesson of its half of the collection, but for those that the first lines name."""
    lessons = {item: set() for item in ITEMS}
    for row in teaching.course()["objective"]:
        for item in row["exam"]:
            lessons[item].add(row["lesson"])
    strangers = {i: {n for n in where if (n <= "06") != (i <= 24)} for i, where in lessons.items()}
    words = r"except (\d+) and the second half of (\d+), which belong to folded\s+parts of lessons (\d+) and (\d+)"
    named = re.search(words, EXAM)
    expected = {int(named[1]): {named[3]}, int(named[2]): {named[4]}}
    assert {item: where for item, where in strangers.items() if where} == expected


def test_map_names_every_item_exercise_and_lesson():
    course = teaching.course()
    rows = course["objective"]
    assert {item for row in rows for item in row["exam"]} == set(ITEMS)
    named = [name for row in rows for name in row.get("exercises", [])]
    read = teaching.lessons()
    known = {name for name in exercises() if name[:2] in {row["lesson"] for row in rows}}
    assert set(named) == known and len(named) == len(known)
    for row in rows:
        places = teaching.sections_of_exercises(read[row["lesson"]])
        assert all(name in places for name in row.get("exercises", [])), row["what"]
        if "section" in row:
            assert any(row["section"] in heading.lower() for _, heading, _ in teaching.headings(read[row["lesson"]]))


def test_at_most_a_third_of_the_exercises_ask_for_a_formula():
    kinds, known = teaching.course()["kinds"], exercises()
    assert set(kinds.values()) <= {"formula", "derive", "data", "design"}
    listed = {name[:2] for name in kinds}
    assert {name for name in known if name[:2] in listed} == set(kinds)
    assert sum(kind == "formula" for kind in kinds.values()) <= len(kinds) / 3
    assert {name for name, kind in kinds.items() if kind == "design"} == {n for n in kinds if known[n].judge}


def said(item: int, *numbers: str):
    """The item has each of them, in a formula or outside, on one line or on two."""
    text = " ".join(ITEMS[item].replace("$", "").replace("-", "−").split())
    for number in numbers:
        assert number in text, f"item {item} lacks {number}"


def test_numbers_of_the_exam():
    robot = rk.load()
    A = rk.control_matrix(robot, rk.inverse_kinematics(robot, [0.0, 0.0]))
    offset = np.array([4e-3, -2e-3, 5e-3])
    np.testing.assert_allclose(rk.steady_state_torque(A, 7.05, offset), -16.45e-3, atol=1e-8)
    np.testing.assert_allclose(1e3 * rk.steady_state_error(A, 7.05, offset), [-1.67, 4.33, -2.67], atol=0.005)
    said(12, "−16.45 mN m", "(−1.67, 4.33, −2.67)")
    assert abs(2e3 * np.pi / 2000 - 3.14) < 0.005
    said(14, "3.14 mrad")
    one, W = np.ones((3, 1)), np.diag([1.0, 1.0, 4.0])
    c = rk.weighted_pseudoinverse(one, W) @ [6.0]
    np.testing.assert_allclose(c, [8 / 3, 8 / 3, 2 / 3])
    assert c @ W @ c == pytest.approx(16) and 2 * one[:, 0] @ W @ (2 * one[:, 0]) == pytest.approx(24)
    said(9, "(2.67, 2.67, 0.67)", "16", "24")
    c = np.array([6.0, -3.0, 3.0])
    kept = rk.antagonism_filter(one) @ c
    np.testing.assert_allclose(kept, 2.0)
    assert 1 - kept @ kept / (c @ c) == pytest.approx(0.78, abs=0.005)
    said(17, "(2, 2, 2)", "78 %")
    without, with_filter = rk.table1().measured.sum(axis=1)
    assert without == pytest.approx(4.5605) and with_filter == pytest.approx(2.2385)
    assert 1 - with_filter / without == pytest.approx(0.51, abs=0.005)
    said(20, "4.5605", "2.2385", "51 %")
    S = np.diag([30e3, 20e3, 4e3])
    assert (2e-3) ** 2 * np.trace(S) == pytest.approx(0.22, abs=0.005) and np.linalg.cond(S) == pytest.approx(7.5)
    said(24, "0.22 J", "7.5")


def test_numbers_of_items_on_counting_forces_and_offsets_that_hide():
    """Items 1, 8, 13, 28 and 33."""
    for name, numbers in (("testbed", [6, 4, 2, 3]), ("four_arms", [8, 6, 2, 4])):
        machine = rk.load(name)
        q = rk.inverse_kinematics(machine, [0.01, 0.02])
        r, n = rk.constraint_jacobian(machine, q).shape
        assert [n, r, rk.degree_of_freedom(machine, q), machine.n_arms] == numbers
        said(1, f"N = {machine.n_arms}: {', '.join(map(str, numbers))}")
    assert len(rk.working_modes(machine)) == 16
    A = np.array([[5.0, 0.0], [0.0, 5.0], [5.0, 0.0]])
    for rows, box in ((A, [0.4, 0.2]), (A[:2], [0.2, 0.2])):
        np.testing.assert_allclose(np.abs(rk.force_polygon(rows, 0.04)).max(axis=0), box)
    said(8, "0.4 N", "0.2 N", "±0.2 N")
    centre = rk.control_matrix(rk.load(), rk.inverse_kinematics(rk.load(), [0.0, 0.0]))
    np.testing.assert_allclose(rk.steady_state_torque(centre, 7.05, [5e-3, -5e-3, 0.0]), 0.0, atol=1e-15)
    assert np.abs(rk.steady_state_error(centre, 7.05, [5e-3, -5e-3, 0.0])).max() == pytest.approx(5e-3)
    said(13, "(5, −5, 0) mrad")
    robot, turn = rk.load(), 2.4 * np.arange(24)
    places = 0.03 * np.sqrt((np.arange(24) + 0.5) / 24)[:, None] * np.column_stack([np.cos(turn), np.sin(turn)])
    built = robot.replace(lengths=[[0.2002, 0.2], [0.2, 0.2], [0.2, 0.2]])
    offset = np.array([4e-3, -2e-3, 5e-3])
    found = rk.calibrate(robot, rk.inverse_kinematics(built, places)[:, :3] + offset)
    assert 0.3e-3 < np.abs(found.offset - offset).min() < np.abs(found.offset - offset).max() < 1.5e-3
    assert found.residual < 0.02e-3
    said(28, "0.02 mrad", "about a milliradian")
    limit, taken, held = 120.0, np.array([0.12, 0.15, 0.10]), np.array([60.0, -30.0, 80.0])
    for room, force, drive in ((limit - np.abs(held), 400, 3), (np.full(3, limit), 800, 2)):
        assert (room / taken).min() == pytest.approx(force) and np.argmin(room / taken) + 1 == drive
        said(33, f"{force / 1000:g} N, by drive {drive}")


def test_numbers_of_items_on_contradictions():
    """Items 25 to 30: via points, delays, ranks, room and one sign."""
    robot, line = rk.load(), lesson07.START + np.linspace(0, 1, 2001)[:, None] * (lesson07.END - lesson07.START)
    gaps = []
    for legs in (16, 32, 64):
        shares = np.linspace(0, 1, legs + 1)
        told = lesson07.set_points(robot, SimpleNamespace(x=line), lesson07.START, lesson07.END, shares)
        gaps.append(1e3 * lesson07.contradiction(robot, told, line).max())
    np.testing.assert_allclose(gaps, [1.7, 0.43, 0.11], atol=0.015)
    leg = 1e3 * np.linalg.norm(lesson07.END - lesson07.START) / 16
    assert leg == pytest.approx(15, abs=0.5) and leg * np.sqrt(0.05 / gaps[0]) == pytest.approx(2.6, abs=0.05)
    said(25, "1.7", "0.43", "0.11", "2.6 mm")
    A = rk.control_matrix(robot, rk.inverse_kinematics(robot, [0.0, 0.0]))
    np.testing.assert_allclose(-7.05 * rk.prestress_projector(A) @ [2e-3, 0, 0], -4.7e-3)
    said(26, "−4.7 mN m")
    for name, ranks in (("testbed", [1, 2, 3]), ("four_arms", [2, 4])):
        machine = rk.load(name)
        places = rk.inverse_kinematics(machine, [[0.05, 0.0], [-0.02, 0.06], [-0.03, -0.05]])
        rows = rk.null_basis(rk.control_matrix(machine, places)).mT
        found = [np.linalg.matrix_rank(rows[: k + 1].reshape(-1, machine.n_arms), tol=1e-6) for k in range(len(ranks))]
        assert found == ranks
    c, n = 1e-3 * np.array([90.0, -40, -50]), np.full(3, 3**-0.5)
    np.testing.assert_allclose(1e3 * lesson09.room(c, n, 0.08), [-52.0, -17.3], atol=0.05)
    np.testing.assert_allclose(rk.allocate_torques(A, A.T @ c, 0.08), [0.08, -0.05, -0.06], atol=1e-9)
    assert np.abs(rk.minimax_torques(A, A.T @ c)).max() == pytest.approx(0.07)
    said(29, "(80, −50, −60) mN m", "70 mN m", r"−52 \le \mu \le −17 mN m")
    c = 1e-3 * np.array([-12.0, 5, 7])
    tight = lesson09.one_sign(A, A.T @ c, 4e-3)
    np.testing.assert_allclose(1e3 * tight, [4, 21, 23])
    assert n @ tight == pytest.approx(28e-3, abs=5e-4) and tight @ tight / (c @ c) == pytest.approx(4.5, abs=0.05)
    said(30, "(4, 21, 23)", "28 mN m", "4.5 times")


def test_numbers_of_items_on_imperfect_machines():
    """Items 31 to 36: wrong lengths, counts, the speed of a loop, an unknown load."""
    robot = rk.load()
    drawing = robot.replace(friction=0.0)
    fights = [
        1e3 * np.linalg.norm(lesson10.geometry_fight(drawing.replace(lengths=long), drawing, [0.03, 0.02], k))
        for long, k in ((0.2002, 7.05), (0.202, 7.05), (0.2002, 14.1))
    ]
    np.testing.assert_allclose(fights, [8.64, 85.4, 17.3], rtol=2e-3)
    said(31, "8.64", "85.4", "17.3")
    step, band = 7.05 * 2 * np.pi / 2000, 2 * robot.friction[0]
    assert 1e3 * step == pytest.approx(22.1, abs=0.06) and 7.05 * band / step == pytest.approx(2.67, abs=0.005)
    said(32, "22.1 mN m", "8.4 mN m", "2.67 N m/rad")
    speed = lesson11.pd_frequencies(robot, rk.inverse_kinematics(robot, [0.0, 0.0]), np.full(3, 7.05))
    np.testing.assert_allclose(speed, 4.63, atol=0.005)
    np.testing.assert_allclose([7.05 * (5 / 4.63) ** 2, 20 / (2 * np.pi)], [8.22, 3.18], atol=0.005)
    said(34, "3.18 Hz", "8.22", "987")
    assert -0.1 / 0.25 * 0.5 / (10 * np.pi) ** 2 == pytest.approx(-2.0e-4, rel=0.02)
    said(35, "−0.20 mm")
    laws = [rk.CTC((2 * np.pi * f) ** 2, 4 * np.pi * f, None) for f in (1.5, 3, 5, 8)]
    path, offset = rk.triangle(robot, 0.12, 2.5), 1e-3 * np.array([4, -2, 5])
    study = rk.sweep(drawing.replace(load=0.1), laws, path, offset, encoder=2000, model=drawing, velocity_filter=5e-3)
    np.testing.assert_allclose(study.energies.sum(axis=1), [9.2, 18.7, 46.2, 126.0], atol=0.06)
    np.testing.assert_allclose(1e3 * study.largest_path_error, [2.6, 1.2, 1.2, 1.2], atol=0.06)
    said(36, "9.2, 18.7, 46.2 and 126.0 J", "2.6, 1.2, 1.2 and 1.2 mm")


def test_numbers_of_items_on_other_machines():
    """Items 37 to 39: a length, units, and signs of the null vector."""
    A = np.array([[0, 2.5, -0.25], [-2.5, 0, -0.25], [0, -2.5, -0.25], [2.5, 0, -0.25]])
    assert np.linalg.cond(A) == pytest.approx(7.1, abs=0.05)
    assert np.linalg.cond(A / [1, 1, 0.141]) == pytest.approx(1, abs=0.005)
    said(37, "7.1", "0.141 m")
    robot = rk.load()
    J = rk.constraint_jacobian(robot, rk.inverse_kinematics(robot, [0.02, 0.03]))
    theirs = lesson12.in_units(J, np.array([1.0, 2.0, 0.5, 3.0, 1.0, 7.0]))
    tangent = rk.projector(J) @ np.arange(6.0)
    np.testing.assert_allclose(theirs @ tangent, tangent, atol=1e-12)
    assert np.abs((theirs - rk.projector(J)) @ np.eye(6)[0]).max() > 0.1
    assert (3 / 7) ** 2 == pytest.approx(0.18, abs=0.005)
    said(39, "18 %", "(4, −2, −5)")


def test_the_arm_of_item_six():
    """An arm with base (0, 0), elbow (0, 0.2) and tip (0.2, 0.2), and its row of A."""
    robot = rk.Manipulator(base=[[0.0, 0.0], [0.4, 0.0], [0.2, 0.4]], lengths=[[0.2, 0.2]] * 3, masses=0.1)
    q = rk.inverse_kinematics(robot, [0.2, 0.2], mode=[-1, 1, 1])
    row = rk.control_matrix(robot, q)[0]
    np.testing.assert_allclose(row, [-5.0, 0.0], atol=1e-9)
    assert row @ [0.1, 0.0] == pytest.approx(-0.5)
    np.testing.assert_allclose(0.04 * row, [-0.2, 0.0], atol=1e-9)
    said(6, "(−5, 0) 1/m", "−0.5 rad/s", "(−0.2, 0) N")


def test_answers_before_the_slider():
    """Questions 03 and 04: what stops a fight at the centroid, and what doubling the gain does."""
    robot = rk.load().replace(friction=0.0)
    A = rk.control_matrix(robot, rk.inverse_kinematics(robot, [0.0, 0.0]))
    for others in ((-2.5e-3, -2.5e-3), (-5e-3, 0.0)):
        np.testing.assert_allclose(rk.steady_state_torque(A, 7.05, [5e-3, *others]), 0.0, atol=1e-12)
    path = rk.triangle(robot)

    def run(offsets, K_P=7.05):
        return rk.simulate(robot, rk.PD(K_P, 0.225), path, offsets)

    def waste(*told):
        return rk.antagonistic_energy(run(*told))

    alike, opposed = [5e-3, 5e-3, 5e-3], [5e-3, -5e-3, 0.0]
    assert 4 < run(alike).energy.sum() / run(opposed).energy.sum() < 5
    assert waste(alike) / waste(opposed) == pytest.approx(8, rel=0.05)
    assert waste(alike, 14.1) / waste(alike) == pytest.approx(4, rel=0.05)


def test_answer_about_one_elbow_the_other_way():
    """Question 12: the three terms of the sum have unequal weights there, not one over the root of three."""
    text = (TEACHING / "questions.md").read_text(encoding="utf-8")
    told = np.array([4.0, -2.0, 5.0])
    for mode, least, said in (((1, 1, 1), None, "4.0 mrad"), ((1, 1, -1), 0, "1.8\n"), ((-1, 1, 1), 1, "6.5 mrad")):
        robot = rk.load().replace(mode=mode)
        eta = rk.null_vector(robot, rk.inverse_kinematics(robot, [0.0, 0.0]))
        assert f"{abs(eta @ told):.1f}" in said and said in text
        assert least is None or np.argmin(np.abs(eta)) == least


def test_concept_test_has_ten_items_with_one_answer_each():
    text = (TEACHING / "concept_test.md").read_text(encoding="utf-8")
    items = re.findall(r"^\d+\. (.*?)(?=^\d+\. |\Z)", text, re.M | re.S)
    assert len(items) == 10
    for item in items:
        assert {"(a)", "(b)", "(c)"} <= set(re.findall(r"\([abc]\)", item.partition("**[")[0]))
        assert re.search(r"\*\*\[[abc]\]\*\*", item)


def test_plans_fit_into_their_time():
    text = (TEACHING / "plans.md").read_text(encoding="utf-8")
    spans = [(int(a), int(b)) for a, b in re.findall(r"^\| (\d+)–(\d+) \|", text, re.M)]
    assert spans[0][0] == 0 and spans[-1][1] == 90
    assert all(before[1] == after[0] for before, after in itertools.pairwise(spans))
    for row in re.findall(r"^\d\. .*$", text, re.M):
        assert sum(map(int, re.findall(r"\((\d+)\)", row))) <= 75, row


def test_every_link_of_the_teachers_pages_leads_somewhere():
    for page in [*TEACHING.glob("*.md"), ROOT / "notebooks" / "README.md"]:
        for target in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
            assert (page.parent / target).exists(), f"{page.name}: {target}"


def test_formula_sheet_is_one_page_without_overflow(tmp_path):
    target = tmp_path / "sheet.pdf"
    subprocess.run([sys.executable, TEACHING / "formula_sheet.py", target], check=True, capture_output=True)
    pdf = target.read_bytes()
    assert pdf.startswith(b"%PDF") and len(re.findall(rb"/Type\s*/Page\b", pdf)) == 1
    sys.path.insert(0, str(TEACHING))
    import formula_sheet

    fig = formula_sheet.sheet()
    page = fig.bbox
    boxes = [text.get_window_extent() for text in fig.texts]
    assert all(0 < b.x0 and b.x1 < page.x1 and 0 < b.y0 and b.y1 < page.y1 for b in boxes)
    assert not [(a, b) for k, a in enumerate(boxes) for b in boxes[k + 1 :] if a.overlaps(b)], "text over text"


@pytest.mark.parametrize(
    ("target", "said"), [("--nothing", "unrecognized arguments: --nothing"), ("nowhere/a", "allowed")]
)
def test_pages_for_teachers_are_written_or_refused_by_a_sentence(tmp_path, target, said):
    for script in (TEACHING / "formula_sheet.py", target), (ROOT / "notebooks" / "slides.py", "04", target):
        done = subprocess.run([sys.executable, *map(str, script)], capture_output=True, text=True, cwd=tmp_path)
        assert done.returncode == 2 and "Traceback" not in done.stderr and said in done.stderr
    assert not list(tmp_path.iterdir())


WITH_ARGUMENTS = ["docs/teaching/formula_sheet.py", "notebooks/slides.py", "notebooks/build.py", "docs/build.py"]


@pytest.mark.parametrize(
    "script",
    [*WITH_ARGUMENTS, "docs/lite.py", "docs/pictures/make.py", "tests.bench", "tests.minutes", "tests.published"],
)
def test_a_script_says_how_it_is_called(tmp_path, script):
    start = [ROOT / script] if script.endswith(".py") else ["-m", script]
    here = {"cwd": tmp_path, "env": os.environ | {"PYTHONPATH": str(ROOT)}}
    done = subprocess.run([sys.executable, *start, "--help"], capture_output=True, text=True, **here)
    assert done.returncode == 0 and not done.stderr and Path(script).name in done.stdout
    assert not list(tmp_path.iterdir())


def test_a_sheet_is_a_pdf_whatever_its_name(tmp_path):
    subprocess.run([sys.executable, TEACHING / "formula_sheet.py", "sheet"], check=True, cwd=tmp_path)
    assert (tmp_path / "sheet").read_bytes().startswith(b"%PDF")


TELLING = re.compile(r"(?i)\b(they|it|yes|no|not|none|nothing|all|almost|only|more|less|one|two|both|neither)\b")


def test_the_title_of_a_folded_answer_does_not_tell_it():
    """Titles right behind a question, as in "Why so little?"; the words of a verdict are told by its text alone."""
    told = []
    for notebook in teaching.lessons().values():
        words = "\n\n".join(cell.source for cell in notebook.cells if cell.cell_type == "markdown")
        for block in re.findall(r"^\*\*(?:Predict|Before you).*?</summary>", words, re.M | re.S):
            title = re.sub("<[^>]*>", "", block.partition("<summary>")[2])
            told += [title] if TELLING.search(title) and "yours works" not in title else []
    assert told == []


def test_no_line_of_a_slide_begins_with_the_comma_after_a_formula():
    pytest.importorskip("latex2mathml", reason="formulas of slides need latex2mathml, see notebooks/README.md")
    from workshop import deck

    page = deck.rendered("A step $2f_c$, then $x$ (as $y$).")
    wholes = re.findall(r'<span class="whole"><math.*?</math>(.*?)</span>', page)
    assert wholes == [",", ")."]
    style = (ROOT / "notebooks/workshop/deck.html").read_text(encoding="utf-8")
    assert page.count("<math") == 3 and re.search(r"\.whole {[^}]*nowrap", style)


def test_both_primes_of_a_formula_stand_over_its_index():
    pytest.importorskip("latex2mathml", reason="formulas of slides need latex2mathml, see notebooks/README.md")
    from workshop import deck

    formula = deck.mathml(r"\eta^T q_a''", block=False)
    # One base with one subscript and one superscript: MathML Core, 3.4.1.
    assert formula.count("<msubsup>") == 1 and "<msup><msubsup>" not in formula


def test_what_a_question_is_about_is_said_with_it():
    pytest.importorskip("latex2mathml", reason="formulas of slides need latex2mathml, see notebooks/README.md")
    from workshop import deck

    cell = "## One (3 min)\n\nFirst.\n\nAll links are longer.\n\n**Predict.** Which presses harder, this or that?"
    (slide,) = [s for s in deck.slides(lesson_with(nbformat.v4.new_markdown_cell(cell))) if s.kind == "question"]
    assert "All links are longer" in slide.page() and "First." not in slide.page()
    assert "all links are 1 % longer" in teaching.predictions_page()
    quoted = cell.replace("All links", "> All links")
    (slide,) = [s for s in deck.slides(lesson_with(nbformat.v4.new_markdown_cell(quoted))) if s.kind == "question"]
    assert "longer" not in slide.page()


def lesson_with(*cells):
    return nbformat.v4.new_notebook(cells=list(cells))


def test_slides_hold_questions_pictures_and_formulas_and_ask_for_nothing():
    pytest.importorskip("latex2mathml", reason="formulas of slides need latex2mathml, see notebooks/README.md")
    from workshop import deck

    picture = nbformat.v4.new_output("display_data", {"text/html": '<img alt="A red square." src="data:,">'})
    hidden = nbformat.v4.new_output(
        "stream", name="stdout", text="The answer is here; open it when you have your own.\n42"
    )
    notebook = lesson_with(
        nbformat.v4.new_markdown_cell("# 42 · Why?\n\nA story with [a link](x.ipynb).\n\n1. *say* why"),
        nbformat.v4.new_markdown_cell(
            "## First (3 min)\n\nA formula\n\n$$a = \\bar b_1 \\tag{7}$$\n\n**Predict.** How many?"
        ),
        nbformat.v4.new_code_cell("print(42)", outputs=[hidden], metadata={"tags": ["hide-output"]}),
        nbformat.v4.new_markdown_cell("<details><summary>Why</summary>\n\nBecause $x$.\n\n</details>"),
        nbformat.v4.new_code_cell("plot()", outputs=[picture]),
        nbformat.v4.new_markdown_cell("### Dig deeper: more (2 min)"),
        nbformat.v4.new_markdown_cell("Nobody sees this."),
        nbformat.v4.new_markdown_cell("## Summary (1 min)\n\n- done"),
    )
    kinds = [slide.kind for slide in deck.slides(notebook)]
    assert kinds == ["title", "section", "question", "picture", "section"]
    page = deck.page(notebook)
    assert "<math" in page and "$" not in re.sub(r"<script>.*</script>", "", page, flags=re.S)
    assert "A red square." in page and "Nobody sees this" not in page and "(7)" in page
    question = page[page.index('class="question"') : page.index('class="picture"')]
    assert question.index("<details") < question.index("42") and "How many?" in question and "<details open" not in page
    assert not re.search(r"(?:src|href)=[\"'](?!data:)|url\(|@import|fetch\(", page), "a request to somewhere else"


def test_the_answer_to_a_question_about_an_explorer_stands_closed_behind_it():
    pytest.importorskip("latex2mathml", reason="formulas of slides need latex2mathml, see notebooks/README.md")
    from workshop import deck

    def remark(text):
        return f"<details><summary>Why</summary>\n\n{text}\n\n</details>"

    still = nbformat.v4.new_output("display_data", {"text/html": '<img alt="A panel." src="data:,">'})
    notebook = lesson_with(
        nbformat.v4.new_markdown_cell("# 42 · Why?\n\n" + remark("A table of letters.")),
        nbformat.v4.new_markdown_cell("## Try it (3 min)\n\n**Before you move it.** Which way?"),
        nbformat.v4.new_code_cell("explore.panel()", outputs=[still]),
        nbformat.v4.new_markdown_cell(remark("To the left, $x < 0$,\n\nand <b>down</b>.") + "\n\nSaid beside it."),
        nbformat.v4.new_markdown_cell(
            "### Exercise 1: turn\n\nTurn it so that\n\n- it stands\n\nor falls. " + 3 * "Long. "
        ),
        nbformat.v4.new_code_cell("film()", outputs=[still]),
        nbformat.v4.new_markdown_cell(remark("What the film shows.")),
    )
    made = deck.slides(notebook)
    assert [slide.kind for slide in made] == ["title", "question", "picture", "answer", "exercise", "picture"]
    told = made[3].page()
    assert told.index("Which way?") < told.index("<details") < told.index("To the left") < told.index("down")
    assert "To the left" not in made[1].page() + made[2].page()
    assert "<strong>Exercise 1: turn</strong></p>" in made[4].page() and "or falls." in made[4].page()
    assert "What the film shows." in made[5].page()
    page = deck.page(notebook)
    assert "A table of letters" not in page and "Said beside it" not in page and "<details open" not in page


@pytest.mark.parametrize("number", sorted(teaching.lessons()))
def test_every_question_of_a_lesson_keeps_its_answer_on_the_slides(number):
    """Closed, behind the question and before the next one."""
    pytest.importorskip("latex2mathml", reason="formulas of slides need latex2mathml, see notebooks/README.md")
    from workshop import deck

    notebook = teaching.lessons()[number]
    lesson = "\n\n".join(c.source for c in deck.core(notebook.cells) if c.cell_type == "markdown")
    asked = re.split(r"^(?=\*\*(?:Predict|Before you)\b)", lesson, flags=re.M)[1:]
    made = deck.slides(notebook)
    places = [k for k, slide in enumerate(made) if slide.kind == "question"]
    assert len(places) == len(asked)
    for place, text in zip(places, asked, strict=True):
        behind = itertools.takewhile(lambda slide: slide.kind in ("picture", "answer"), made[place + 1 :])
        page = "".join(slide.page() for slide in [made[place], *behind])
        folded = "".join(re.findall(r"<details>.*?</details>", page, re.S))
        folded = " ".join(re.sub(r"</?span[^>]*>", "", folded).split())
        assert folded, text.splitlines()[0]
        # Up to the next heading or exercise each folded remark answers this question.
        here = re.split(r"^##|^\*\*Exercise", text, flags=re.M)[0]
        for answer in re.findall(r"</summary>(.*?)</details>", here, re.S):
            words = max(re.findall(r"[a-z ,]+", " ".join(answer.split())), key=len).strip()
            assert len(words) > 20 and words in folded, text.splitlines()[0]


def test_every_exercise_of_the_slides_says_what_to_do():
    pytest.importorskip("latex2mathml", reason="formulas of slides need latex2mathml, see notebooks/README.md")
    from workshop import deck

    for notebook in teaching.lessons().values():
        for slide in deck.slides(notebook):
            if slide.kind == "exercise":
                assert len(re.sub("<[^>]*>", "", "".join(slide.parts))) > 80, slide.parts


@pytest.mark.parametrize("number", sorted(teaching.lessons()))
def test_every_lesson_makes_slides(number, tmp_path):
    pytest.importorskip("latex2mathml", reason="formulas of slides need latex2mathml, see notebooks/README.md")
    target = tmp_path / "slides.html"
    script = ROOT / "notebooks" / "slides.py"
    done = subprocess.run([sys.executable, script, number, target], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    page = target.read_text(encoding="utf-8")
    assert page.count("<section") >= 6 and "\\frac" not in page and "\\cr" not in page
    assert not re.search(r"(?:src|href)=[\"'](?!data:)", page)


def test_slides_of_a_lesson_that_is_not_there():
    script = ROOT / "notebooks" / "slides.py"
    done = subprocess.run([sys.executable, script, "77"], capture_output=True, text=True)
    assert done.returncode == 2 and "allowed: 00, 01" in done.stderr


def test_offsets_that_betray_nothing_have_to_do_so_at_every_place():
    """Without offsets nothing shifts; offsets along the null vector fight, and shift nothing."""

    def elsewhere(robot, x):
        return lesson03.unseen_offsets(robot, x)

    def nothing(robot, x):
        return np.zeros(robot.n_arms)

    def fighting(robot, x):
        return 5e-3 * rk.null_vector(robot, rk.inverse_kinematics(robot, x))

    def but_for(wrong):
        return lambda robot, x: (wrong if np.allclose(x, [0.0, 0.08]) else elsewhere)(robot, x)

    shift, torque, size = lesson03.betrayal(elsewhere)
    assert shift.holds and torque.holds and size.holds and shift.value == pytest.approx(2.2, abs=0.05)
    shift, torque, _ = lesson03.betrayal(but_for(nothing))
    assert torque.holds and shift.value < 1e-6 and not shift.holds
    shift, torque, _ = lesson03.betrayal(but_for(fighting))
    assert torque.value > 5.0 and not torque.holds


def test_offsets_that_betray_nothing_must_not_be_large_at_any_place():
    """Offsets of a machine that stands far beside its place do not fight: the limit of their size forbids them."""

    def far(robot, x):
        there = rk.inverse_kinematics(robot, np.add(x, [0.0, 9e-3]))
        return (rk.inverse_kinematics(robot, x) - there)[: robot.n_arms]

    shift, torque, size = lesson03.betrayal(
        lambda robot, x: (far if np.allclose(x, [0.04, -0.05]) else lesson03.unseen_offsets)(robot, x)
    )
    assert shift.holds and torque.holds and size.unit == "mrad" and not size.holds
    assert size.value == pytest.approx(1e3 * np.abs(far(rk.load(), [0.04, -0.05])).max())


def test_the_one_number_of_a_log_of_one_place_has_the_sign_of_eta_which_is_ours_to_choose():
    (eta,), (error,), _ = lesson03.rests("offset_c")
    for answer in (eta @ error, -eta @ error, np.array([eta @ error])):
        assert lesson03.refusal(answer).word == "ok"


@pytest.mark.parametrize(
    ("name", "asked"),
    [
        ("07.via_points", ["at most nine shares", "more than 15 mN m"]),
        ("09.quiet_gears", ["4 and 85 mN m", "below 14 J", "below 0.1 mm"]),
        ("11.one_law", ["at most **4 J**", "more than **3 mN m**", "more than **2.6 mm**", "at most **10.5 J**"]),
    ],
)
def test_a_design_is_judged_by_the_limits_that_its_lesson_asks_for(name, asked):
    cells = teaching.lessons()[name[:2]].cells
    text = "\n".join(cell.source for cell in cells if cell.cell_type == "markdown")
    assert all(words in text for words in asked)
    limits = {(f"{m.limit:.4g}", m.unit) for m in exercises()[name].judge(exercises()[name].reference)}
    told = re.findall(r"([\d.]+)\** (mN m|mm|J)", " ".join(asked).replace("4 and", "4 mN m and"))
    assert limits == {*told, *([("9", "in all")] if name == "07.via_points" else [])}


def test_equal_distances_press_with_almost_30_mN_m():
    """So lesson 07 says before its design, of nine via points on the edge."""
    count, most = lesson07.quarrel(lambda part, demand: np.linspace(0, 1, 11)[1:-1])
    assert count.value == 9 and most.unit == "mN m" and 29 < most.value < 30


def test_a_drive_of_the_carriage_may_not_be_overloaded_for_a_moment():
    """A short push of 90 mN m makes hardly any heat, keeps all signs and the path: the limit of torque forbids it."""

    def pushing(A, f):
        c, n = lesson09.quiet_gears(A, f), rk.null_basis(A)[:, 0]
        i = np.argmax(np.abs(c))
        return c + (np.abs(c[i]) > 76e-3) * (np.copysign(90e-3, c[i]) - c[i]) / n[i] * n

    most, *others = lesson09.carried(pushing)
    assert most.value == pytest.approx(90.0) and most.unit == "mN m" and not most.holds
    assert all(measured.holds for measured in others)


def test_a_carriage_whose_drives_push_too_little_leaves_its_path():
    """Three fifths of the force keep all signs, torques and the heat: the limit of the error forbids them."""
    *others, error = lesson09.carried(lambda A, f: lesson09.quiet_gears(A, 0.6 * f))
    assert error.unit == "mm" and error.value > 0.3 and not error.holds
    assert all(measured.holds for measured in others)


def test_one_law_for_three_duties_may_not_jump():
    """A push of 5 mN m along eta moves nothing and costs little: only the limit of the jumps forbids it."""

    class Pushing(rk.Law):
        law = exercises()["11.one_law"].reference(rk.load())

        def step(self, memory, sample):
            c, memory = self.law.step(memory, sample)
            return c + 5e-3 * (sample.t >= 1.0) * rk.null_vector(sample.model, sample.pose()[0]), memory

    *others, jump = lesson11.three_duties(lambda robot: Pushing())
    assert jump.unit == "mN m" and not jump.holds and all(measured.holds for measured in others)
    # The encoders of the lesson: 2000 counts per turn, with rates smoothed over 5 ms.
    robot, path, _ = lesson11.duties()
    rough = rk.simulate(robot, Pushing(), path, [4e-3, -2e-3, 5e-3], encoder=2000, velocity_filter=5e-3)
    assert others[1].value == pytest.approx(rough.energy.sum(), rel=1e-9)


def test_places_to_calibrate_at_are_apart_as_the_lesson_says():
    """On a circle of radius r two places are 2 r sin(half the angle between them) apart; 20 mm are asked for."""
    for gap, holds in ((15e-3, False), (21e-3, True)):
        places = lesson08.best_places(rk.load())
        places[1] = lesson08.ring(55.0 + 2 * np.degrees(np.arcsin(gap / 2 / 0.12)), 0.12)
        far, apart, condition = lesson08.known(lambda robot, places=places: places)
        assert far.holds and condition.holds and apart.holds == holds
        assert apart.value == pytest.approx(1e3 * min(gap, 0.24 * np.sin(np.radians(5.0))))


def test_a_machine_of_a_student_is_measured_in_the_units_of_its_limits():
    base = np.array([[-0.24, -0.14], [0.24, -0.14], [0.0, 0.25]])
    answer = rk.Manipulator(base=base, lengths=[0.2, 0.24], masses=0.1)
    torque, _, reach = lesson12.behaviour(answer)
    # What all get: rods of 0.67 kg/m, half a kilogram, rotors.
    own = answer.replace(masses=0.67 * answer.lengths, load=0.5, rotor_inertia=3.35e-6, centers=None, inertias=None)
    path = rk.triangle(own)
    most = np.abs(rk.inverse_dynamics(own, path.q, path.qd, path.qdd)).max()
    assert (torque.unit, reach.unit[:2]) == ("mN m", "mm")
    assert torque.value == pytest.approx(1e3 * most, rel=1e-9)
    assert reach.value == pytest.approx(1e3 * np.hypot(0.24, 0.14))


def test_a_ripple_is_what_is_left_at_the_end_of_a_rest():
    """Behind the first jolt, by which the machine that is not its drawing finds its place of rest."""
    found = {measured.what: measured for measured in lesson10.survives(lesson10.spare_law)}
    built, drawing = lesson10.machine()
    path = rk.hold(drawing, [0.03, 0.02], 1.0, 2e-3)
    law, limit = lesson10.spare_law(drawing), [rk.TorqueLimit(0.15)]  # N m, as the lesson says
    run = rk.simulate(built, law, path, encoder=2000, model=drawing, faults=limit)
    late = run.c[run.t > run.t[-1] - 0.5]
    assert found["ripple at rest"].value == pytest.approx(1e3 * late.std(axis=0).max(), rel=1e-6)
    slow = rk.triangle(drawing, 0.12, duration=2.5, dt=2e-3)
    run = rk.simulate(built, law, slow, encoder=2000, model=drawing, faults=limit)
    assert found["energy of the healthy triangle"].value == pytest.approx(run.energy.sum(), rel=1e-9)
    for drive in range(3):
        broken = [*limit, rk.DeadDrive(drive, 0.5)]
        run = rk.simulate(built, law, slow, encoder=2000, model=drawing, faults=broken)
        off = 1e3 * np.linalg.norm(run.x - slow.x, axis=1).max()
        assert found[f"drive {drive + 1} dead: largest error"].value == pytest.approx(off, rel=1e-9)
