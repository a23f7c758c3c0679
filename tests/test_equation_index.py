"""The pages notebooks/equations.md and errata.md against package, lessons and tests: a row counts if it is lived up to.

For an equation that means: the docstrings of its functions name the number; the lesson says the number and runs one of
the functions; the test carries the printed formula, letter by letter, names the number and calls one of the functions.
"""

import ast
import json
import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from samples import TESTBED, random_motion

import rapkm_lite as rk

HERE = Path(__file__).resolve().parent
NOTEBOOKS = HERE.parent / "notebooks"
LESSONS = {path.stem for path in NOTEBOOKS.glob("[0-9][0-9]_*.ipynb")}


def rows(page, heading):
    """Cells of the table under a heading; a pipe with a backslash belongs to its cell."""
    text = (NOTEBOOKS / page).read_text(encoding="utf-8")
    part = re.split(rf"\n#+ {heading}\n", "\n" + text)[1].split("\n#")[0]
    lines = [line for line in part.splitlines() if line.startswith("|")][2:]
    return [[cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]] for line in lines]


EQUATIONS, NOTATION = rows("equations.md", "Equations"), rows("equations.md", "Notation")
ERRATA = rows("errata.md", "Errata of the chapter")
NUMBERED = [row for row in EQUATIONS if "Table" not in row[0]]


def number_of(row):
    return re.sub(r"<a id=.*?></a>", "", row[0])


by_row = pytest.mark.parametrize("row", EQUATIONS, ids=[number_of(row) for row in EQUATIONS])


def numbers(text):
    """All equation numbers a text names: (n), ranges (a)-(b), and tags of formulas; f(2) and m(3) are none."""
    found = {int(n) for n in re.findall(r"(?<!\w)\((\d+)\)", text)}
    for a, b in re.findall(r"\((\d+)\)\s*(?:-|–|to)\s*\((\d+)\)", text):
        found |= set(range(int(a), int(b) + 1))
    for tag in re.findall(r"\\tag\{([\d, ]+)\}", text):
        found |= {int(n) for n in re.findall(r"\d+", tag)}
    return found


def names(tree):
    """What a piece of code uses: names and attributes."""
    return {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)} | {
        node.attr for node in ast.walk(tree) if isinstance(node, ast.Attribute)
    }


@cache
def lesson(name):
    """Text and names used in the code of a lesson, of its solved copy where there is one."""
    solved = NOTEBOOKS / "solutions" / f"{name}.ipynb"
    path = solved if solved.exists() else NOTEBOOKS / f"{name}.ipynb"
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    text = {
        kind: "\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == kind)
        for kind in ("markdown", "code")
    }
    code = "\n".join(line for line in text["code"].splitlines() if not line.lstrip().startswith(("%", "!")))
    return text["markdown"], names(ast.parse(code))


@cache
def test_functions(file):
    tree = ast.parse((HERE / file).read_text(encoding="utf-8"))
    return {node.name: node for node in tree.body if isinstance(node, ast.FunctionDef)}


test_functions.__test__ = False


def squeeze(text):
    return re.sub(r"\s+", "", text)


def functions_of(row):
    return re.findall(r"`([\w.]+)`", row[3])


def test_every_equation_has_one_row_with_an_anchor():
    assert [int(number_of(row).strip("()")) for row in NUMBERED] == list(range(1, 36))
    for row in EQUATIONS:
        assert len(row) == 6
        anchor = re.match(r'<a id="([\w-]+)"></a>', row[0])[1]
        assert anchor == ("table-1" if "Table" in row[0] else f"eq-{number_of(row).strip('()')}")
    assert all(re.search(r"\$.+\$", row[1]) for row in NUMBERED)


@by_row
def test_docstrings_of_the_functions_name_the_number(row):
    missing = []
    for name in functions_of(row):
        found = rk
        for part in name.split("."):
            found = getattr(found, part)
        assert found.__doc__, f"{name} has no docstring"
        if row in NUMBERED and int(number_of(row).strip("()")) not in numbers(found.__doc__):
            missing.append(name)
    assert not missing, f"the docstrings of {missing} do not name {number_of(row)}"


# Numbers that a docstring may name beside those of its rows: looked up in the print, with what they are there for.
ALSO = {
    "AntagonismFilter": {15},  # the matrix it takes
    "CommandFilter": {16},  # the force form it is compared with
    "PID": {12},  # the law it extends
    "actuation_map": {10},  # what its first measure decides
    "RedundantAPD": {27, 30},  # the pseudoinverse it takes; its closed loop
    "RedundantCTC": {35},  # its error dynamics
    "antagonism_form": {14},  # the torques at rest
    "constraint_rank": {1},  # whose matrix
    "degree_of_actuation": {8},  # whose fields it counts
    "degree_of_freedom": {7},  # the text after it
    "lyapunov_function": {29},  # the gains with which it is definite on tangent errors only
    "orthogonal_complement_dot": {5},  # the text after it
    "select_independent": {27},  # what the rows are for
    "steady_state_torque": {12},  # the sign
    "required_wrench": {6, 11},  # the left-hand side; the bracket
}


@pytest.mark.parametrize("name", [name for name in vars(rk) if callable(getattr(rk, name)) and name[0] != "_"])
def test_docstrings_name_no_other_number(name):
    """A number in a docstring without its row is how a wrong number comes in: add the row, or say above what for."""
    listed = {
        int(number_of(row).strip("()"))
        for row in NUMBERED
        if name in {function.split(".")[0] for function in functions_of(row)}
    }
    docstring = (getattr(rk, name).__doc__ or "").split(">>>")[0]  # an example may print (8, 20)
    assert numbers(docstring) <= listed | ALSO.get(name, set())


@by_row
def test_lesson_says_the_number_and_runs_a_function(row):
    assert row[4] in LESSONS
    text, used = lesson(row[4])
    if row in NUMBERED:
        assert int(number_of(row).strip("()")) in numbers(text), f"{row[4]} does not say {number_of(row)}"
    else:
        assert "Table 1" in text
    assert any(name.split(".")[-1] in used for name in functions_of(row)), f"{row[4]} runs none of {functions_of(row)}"


ACCENT = r"\\(?:bar|overline|tilde|widetilde|dot|ddot|mathcal)\s*\{?\s*"
LETTER = rf"((?:{ACCENT})*)(\\(?:alpha|Delta|delta|lambda|varepsilon)|[A-Za-z])(?![A-Za-z])"


def letters(formula):
    """The letters of a formula with their accents, without words, fonts and layout."""
    formula = re.sub(r"\\(?:begin|end)\{\w+\}|\\(?:mathbf|mathrm|text|quad|cr|left|right)\b", " ", formula)
    formula = formula.replace(r"\overline", r"\bar").replace(r"\widetilde", r"\tilde")
    return {
        "".join(sorted(re.findall("bar|tilde|ddot|dot|mathcal", accent))) + letter
        for accent, letter in re.findall(LETTER, formula)
    }


PRINTED = {int(number_of(row).strip("()")): letters(row[1]) for row in NUMBERED}


@pytest.mark.parametrize("name", sorted(LESSONS))
def test_displayed_formulas_carry_the_number_that_is_theirs(name):
    """A formula that shares fewer than two in five of the printed letters is another one, whatever it is called."""
    for formula in re.findall(r"\$\$(.*?)\$\$", lesson(name)[0], re.S):
        for number in numbers(formula) & set(PRINTED):
            share = len(letters(formula) & PRINTED[number]) / len(PRINTED[number])
            assert share > 0.4, f"{name} gives the number ({number}) to {formula.strip()}"


@by_row
def test_named_test_evaluates_the_printed_formula(row):
    file, name = re.fullmatch(r"`(test_\w+\.py)::(test_\w+)`", row[5]).groups()
    assert name in test_functions(file), f"{file} has no {name}"
    test = test_functions(file)[name]
    # Helpers of the same file that the test calls belong to it.
    used = names(test) | {
        used for helper in names(test) & set(test_functions(file)) for used in names(test_functions(file)[helper])
    }
    assert any(part.split(".")[-1] in used for part in functions_of(row)), f"{name} calls none of {functions_of(row)}"
    if row in NUMBERED:
        docstring = ast.get_docstring(test) or ""
        assert int(number_of(row).strip("()")) in numbers(docstring)
        for formula in re.findall(r"\$.+?\$", row[1]):
            assert squeeze(formula) in squeeze(docstring), f"{name} does not carry {formula}"
    else:
        source = ast.unparse(test)
        for value in re.findall(r"\d\.\d{4}", row[1]):
            assert str(float(value)) in source


# Errata.
def test_every_erratum_has_its_test_and_every_audit_its_row():
    assert all(len(row) == 6 and row[1] in "✗±" for row in ERRATA)
    listed = [row[5].strip("`") for row in ERRATA]
    audits = {name for name in test_functions("test_audit.py") if name.startswith("test_")}
    assert len(set(listed)) == len(listed)
    assert set(listed) == audits


def test_marks_of_the_index_lead_to_rows_of_the_errata():
    text = (NOTEBOOKS / "errata.md").read_text(encoding="utf-8")
    anchors = set(re.findall(r'<a id="([\w-]+)"></a>', text))
    mark_of = {anchor: row[1] for row in ERRATA for anchor in re.findall(r'<a id="([\w-]+)"></a>', row[0])}
    marks = [mark for row in EQUATIONS for mark in re.findall(r"\[([✗±])\]\(errata\.md#([\w-]+)\)", row[2])]
    assert {anchor for _, anchor in marks} <= anchors
    for mark, anchor in marks:
        assert mark_of[anchor] == mark, anchor
    # Every erratum of a numbered equation is marked in its row.
    assert {a for a in anchors if a.startswith("eq-")} == {a for _, a in marks if a.startswith("eq-")}


PAGES = [*NOTEBOOKS.glob("*.ipynb"), *NOTEBOOKS.glob("solutions/*.ipynb"), *NOTEBOOKS.glob("*.md")]


@pytest.mark.parametrize("path", sorted(PAGES), ids=lambda path: f"{path.parent.name}/{path.name}")
def test_links_resolve_from_the_folder_of_the_page(path):
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".ipynb":
        text = "\n".join("".join(c["source"]) for c in json.loads(text)["cells"] if c["cell_type"] == "markdown")
    for page, anchor in re.findall(r"\]\((?!\w+:)([^)#\s]*)(?:#([\w-]+))?\)", text):
        target = path.parent / page if page else path
        assert target.exists(), f"{path.name} leads to {page}, which is not there"
        assert not anchor or f'<a id="{anchor}"></a>' in target.read_text(encoding="utf-8"), f"{page}#{anchor}"


@pytest.mark.parametrize("name", sorted(LESSONS))
def test_at_most_six_boxes_on_the_print(name):
    boxes = lesson(name)[0].count("**In the print.**")
    assert boxes <= 6, f"{name} has {boxes} boxes on the print; at most six belong into a lesson"


@pytest.mark.parametrize("row", rows("equations.md", "Figures"), ids=lambda row: f"fig. {row[0]}")
def test_lesson_names_its_figure(row):
    text, _ = lesson(row[2])
    text += (NOTEBOOKS / "solutions" / f"{row[2]}.ipynb").read_text(encoding="utf-8")
    said = {int(n) for n in re.findall(r"fig\. ?(\d+)", text, re.I)}
    for a, b in re.findall(r"figs\. ?(\d+) ?(?:and|,|–|-) ?(\d+)", text, re.I):
        said |= set(range(int(a), int(b) + 1))
    assert int(row[0]) in said


def test_figures_and_sections_are_complete():
    assert [int(row[0]) for row in rows("equations.md", "Figures")] == list(range(1, 11))
    sections = rows("equations.md", "Sections")
    assert all(row[2] in LESSONS | {"–"} for row in sections)
    text = "\n".join(row[1] for row in sections)
    assert numbers(text) == set(range(1, 36))


# Notation: the identifiers evaluate to the printed shapes.
def test_notation_table_gives_the_shapes_that_functions_return():
    m, n, r, delta = TESTBED.n_arms, TESTBED.n_joints, TESTBED.n_constraints, 2
    q, qd, qdd = (v[0] for v in random_motion(TESTBED, 1)[:3])
    A, A_tilde = rk.control_matrix(TESTBED, q), rk.redundant_control_matrix(TESTBED, q)
    per_drive = np.ones(m)
    values = vars(rk) | {
        "np": np,
        "robot": TESTBED,
        "q": q,
        "qd": qd,
        "qdd": qdd,
        "q_a": q[:m],
        "offset": per_drive,
        "c": per_drive,
        "prestress": per_drive,
        "x": np.zeros(2),
        "A": A,
        "A_tilde": A_tilde,
        "W": per_drive,
        "K_P": per_drive,
        "K_D": per_drive,
        "independent": (0, 1),
        "rows": (0, 1),
        "e": q,
        "ed": qd,
        "eta": rk.null_vector(TESTBED, q),
        "path": rk.triangle(TESTBED, dt=0.05),
    }
    for printed, identifier, unit, shape, meaning in NOTATION:
        value = eval(identifier.strip("`"), values)
        written = shape.replace("δ", "delta").replace("m(m − 1)/2", "m * (m - 1) // 2").replace(")", ",)")
        written = written.replace("(m - 1,)", "(m - 1)").replace("(,)", "()")
        assert np.shape(value) == eval(written, {"m": m, "n": n, "r": r, "delta": delta}), printed
        assert printed and unit and meaning


def test_docstrings_of_public_functions_say_shape_or_value():
    for name, thing in vars(rk).items():
        if callable(thing) and not name.startswith("_") and getattr(thing, "__module__", "").startswith("rapkm_lite"):
            assert thing.__doc__ and len(thing.__doc__) > 20, name
