"""What people answer: right, close and wrong, with the name of the mistake; and what nobody should answer."""

import importlib
import itertools
import warnings
from pathlib import Path

import numpy as np
import pytest

from rapkm_lite.checks import check, examine, exercises

TABLES = sorted(path.stem for path in (Path(__file__).parent / "answers").glob("answers*.py"))
ROWS = [
    pytest.param(name, *row, id=f"{name} {row[0]}: {row[1]}")
    for table in TABLES
    for name, rows in importlib.import_module(f"tests.answers.{table}").ANSWERS.items()
    for row in rows
]
VERDICT = {"right": "ok", "close": "close", "wrong": "wrong"}


def picture(case):
    """Everything in a case that could be changed in place, as text."""
    return [v.tobytes() if isinstance(v, np.ndarray) else repr(v) for v in case]


@pytest.mark.parametrize("row", ROWS_OF := [p.values for p in ROWS], ids=[p.id for p in ROWS])
def test_answers_get_their_verdict_and_their_mistake_its_name(row):
    name, expected, _, answer, *word = row
    verdict, sentence = examine(name, answer)
    assert verdict == VERDICT[expected], sentence
    if expected == "wrong":
        assert word, "a wrong answer needs the word that its verdict must hold, or an empty text"
    assert not word or word[0].lower() in sentence.lower(), sentence


def test_four_of_five_wrong_answers_are_called_by_their_name():
    wrong = [row[4] for row in ROWS_OF if row[1] == "wrong"]
    assert sum(map(bool, wrong)) >= 0.8 * len(wrong)


@pytest.mark.parametrize("name", sorted(exercises()))
def test_every_exercise_has_answers_of_its_own(name):
    kinds = [row[1] for row in ROWS_OF if row[0] == name]
    words = f"tests/answers/answers{name[:2]}.py needs one right and four wrong answers to {name}"
    assert kinds.count("right") >= 1 and kinds.count("wrong") >= 4, words


@pytest.mark.parametrize("name", [name for name, exercise in exercises().items() if exercise.invariant])
def test_a_law_of_nature_is_broken_by_an_answer_that_is_off(name):
    """One number of the right answer moved, by a hundredth or by twenty times what is allowed; a bound sees one way."""
    exercise = exercises()[name]
    cases = exercise.cases(np.random.default_rng(20_111_130))
    for place in (0, -1):
        broken = []
        for case, way in itertools.product((cases[0], cases[-1]), (1, -1)):
            answer = np.array(exercise.reference(*case), dtype=float)
            answer.reshape(-1)[place] += way * max(0.01 * np.abs(answer).max(), 20 * exercise.tolerance)
            broken.append(exercise.invariant(answer[()], *case)[0])
        assert max(broken) > exercise.tolerance


def test_the_law_of_filtered_torques_has_two_halves():
    """All torques keep the force and leave the antagonism; half of the filtered ones do the opposite."""
    exercise = exercises()["04.filtered_torques"]
    for A, c in exercise.cases(np.random.default_rng(1)):
        n = np.cross(*A.T) / np.linalg.norm(np.cross(*A.T))
        assert exercise.invariant(c, A, c)[0] == pytest.approx(abs(n @ c))
        half = A @ np.linalg.lstsq(A, c)[0] / 2
        assert exercise.invariant(half, A, c)[0] == pytest.approx(np.abs(A.T @ c).max() / 2)


class Odd:
    """An answer that is a class, and whose instances stop at everything."""

    def __init__(self, *case):
        pass

    def __array__(self, *_, **__):
        raise SystemExit(3)

    def __float__(self):
        raise SystemExit(3)


def leave(*case):
    raise SystemExit(0)


def forever(*case):
    return forever(*case)


async def later(*case):
    return 1.0


def destroy(*case):
    for value in case:
        if isinstance(value, np.ndarray) and value.flags.writeable:
            value *= 0
        elif isinstance(value, list):
            value.clear()
    return np.zeros(3)


def generate(*case):
    yield 1.0


def silent(*case):
    raise Exception


ODD = {
    "text": lambda *c: "0.1",
    "text as value": "0.1",
    "NaN": lambda *c: float("nan"),
    "huge": lambda *c: 10**400,
    "huge list": lambda *c: [10**400, 1, 2],
    "huge floats": lambda *c: np.full(3, 1e308),
    "SystemExit": leave,
    "recursion": forever,
    "coroutine": later,
    "generator": generate,
    "empty": lambda *c: [],
    "empty array": lambda *c: np.zeros((0, 3)),
    "a class": Odd,
    "int": int,
    "ragged": lambda *c: [[1.0], [1.0, 2.0]],
    "a dictionary": lambda *c: {"c": 1.0},
    "a set": {1.0, 2.0},
    "a module": np,
    "complex": lambda *c: 1j * np.ones(3),
    "objects": lambda *c: np.array([None, 1.0, "x"], dtype=object),
    "true": lambda *c: True,
    "an array of dates": np.array(["2013-01-01"], dtype="datetime64[D]"),
    "in place": destroy,
    "an error without words": silent,
    "too few arguments": lambda: 0.0,
    "a function of functions": lambda *c: leave,
    "a masked array": lambda *c: np.ma.masked_all(3),
    "minus infinity": lambda *c: -np.inf,
    "many dimensions": lambda *c: np.zeros((1,) * 20),
    "a value for a function": np.eye(3),
    "a wild type": type("Wild", (), {"__call__": leave})(),
}


@pytest.mark.parametrize("name", sorted(exercises()))
def test_odd_answers_crash_nothing(name, capsys, monkeypatch):
    monkeypatch.delenv("RAPKM_LITE_STRICT", raising=False)
    for what, answer in ODD.items():
        if name == "03.offset_c" and what in ("NaN", "a masked array"):
            continue  # there no number is the honest answer: the log does not tell
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            check(name, answer)
        said = capsys.readouterr().out
        assert said.startswith(f"NOT YET RIGHT {name}: "), f"{what}: {said}"
        assert len(said) < 700


@pytest.mark.parametrize("answer", [np.ma.array([1.0, 2.0, 3.0], mask=[0, 1, 0]), [1.0, np.ma.masked, 2.0]])
def test_what_is_masked_is_called_so(answer, capsys, monkeypatch):
    """A masked entry is no number, and neither NaN nor infinity."""
    monkeypatch.delenv("RAPKM_LITE_STRICT", raising=False)
    check("04.filtered_torques", lambda A, c: answer)
    assert "the answer is masked in some entries" in capsys.readouterr().out


@pytest.mark.parametrize("name", sorted(n for n, e in exercises().items() if not e.judge))
def test_arithmetic_in_place_changes_nothing_outside(name, monkeypatch):
    monkeypatch.delenv("RAPKM_LITE_STRICT", raising=False)
    exercise = exercises()[name]
    cases = exercise.cases(np.random.default_rng(3))
    if exercise.is_value(cases):
        return

    def changing(*case):
        right = exercise.reference(*case)
        destroy(*case)
        return right

    assert examine(name, changing)[0] == "ok"
    going_on = check(name, changing)
    before = picture(cases[0])
    going_on(*cases[0])
    assert picture(cases[0]) == before
