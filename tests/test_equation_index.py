"""The page notebooks/equations.md against the package: numbers, functions, docstrings, lessons, tests, shapes."""

import ast
import re
from pathlib import Path

import numpy as np
import pytest
from samples import TESTBED, random_motion

import rapkm_lite as rk

HERE = Path(__file__).resolve().parent
PAGE = (HERE.parent / "notebooks" / "equations.md").read_text(encoding="utf-8")
LESSONS = {"00_start_here", "01_constraints", "02_actuation_and_singularities", "03_steady_state_antagonism",
           "04_antagonism_filter_energy", "05_singularity_robust_control", "06_energy_landscape"}


def rows(heading):
    part = PAGE.split(f"## {heading}\n")[1].split("\n## ")[0]
    lines = [line for line in part.splitlines() if line.startswith("|")][2:]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


EQUATIONS, NOTATION = rows("Equations"), rows("Notation")
NUMBERED = [row for row in EQUATIONS if row[0].startswith("(")]


def mentions(docstring, number):
    """Does the text name (n), or a range (a)-(b) around it?"""
    ranges = [(int(a), int(b)) for a, b in re.findall(r"\((\d+)\)-\((\d+)\)", docstring)]
    return f"({number})" in docstring or any(a <= number <= b for a, b in ranges)


def find(name):
    """A public object by its dotted name in the package."""
    found = rk
    for part in name.split("."):
        found = getattr(found, part)
    return found


def test_every_equation_has_one_row():
    assert [int(row[0].strip("()")) for row in NUMBERED] == list(range(1, 36))
    assert all(len(row) == 5 for row in EQUATIONS)


@pytest.mark.parametrize("row", EQUATIONS, ids=[row[0] for row in EQUATIONS])
def test_row(row):
    number, _, functions, lesson, test = row
    for name in re.findall(r"`([\w.]+)`", functions):
        docstring = find(name).__doc__
        assert docstring, f"{name} has no docstring"
        if number.startswith("("):
            named = mentions(docstring, int(number.strip("()"))) or name in AIDS.get(number, ())
            assert named, f"the docstring of {name} does not mention {number}"
    assert lesson in LESSONS
    file, name = re.fullmatch(r"`(test_\w+\.py)::(test_\w+)`", test).groups()
    tree = ast.parse((HERE / file).read_text(encoding="utf-8"))
    assert name in {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}, test


# Functions beside the one that evaluates the equation.
AIDS = {"(1)": ("close_loops",), "(5)": ("required_wrench",), "(26)": ("select_independent",)}


def test_misprints_are_marked_and_audited():
    audit = (HERE / "test_audit.py").read_text(encoding="utf-8")
    marked = {int(row[0].strip("()")) for row in NUMBERED if "✗" in row[1]}
    audited = {int(n) for n in re.findall(r"def test_(?:after_)?eq_(\d+)", audit)}
    # Besides the numbered rows: the text after (7), the rate of N_J used in (24), the partition rule for (26).  The row
    # on (27) says that it is right.
    assert marked == (audited - {27}) | {7, 24, 26}


# Notation: the identifiers evaluate to the printed shapes.
def test_notation_table_gives_the_shapes_that_functions_return():
    m, n, r, delta = TESTBED.n_arms, TESTBED.n_joints, TESTBED.n_constraints, 2
    q, qd, qdd = (v[0] for v in random_motion(TESTBED, 1)[:3])
    A, A_tilde = rk.control_matrix(TESTBED, q), rk.redundant_control_matrix(TESTBED, q)
    per_drive = np.ones(m)
    values = vars(rk) | {
        "robot": TESTBED, "q": q, "qd": qd, "qdd": qdd, "q_a": q[:m], "offset": per_drive, "c": per_drive,
        "prestress": per_drive, "x": np.zeros(2), "A": A, "A_tilde": A_tilde, "W": per_drive, "K_P": per_drive,
        "K_D": per_drive, "independent": (0, 1), "rows": (0, 1), "e": q, "ed": qd}
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
