"""Self-checks of the exercises: `check` an answer, `examine` it without printing, `hint` in three steps."""

from __future__ import annotations

import importlib
import importlib.util
import os
from pathlib import Path
from typing import Any

import numpy as np

from ..machine.arguments import whole_number
from ..machine.datafiles import known
from .answers import Answer, Ended, Handed, NotYet, Result, fitting, given, numbers, tidied
from .exercise import Case, Exercise, Measured
from .judging import judged

__all__ = ["Case", "Exercise", "Measured", "check", "examine", "exercises", "hint", "lessons"]

_WORDS = {"ok": "OK", "close": "CLOSE", "todo": "TODO", "wrong": "NOT YET RIGHT"}
# The next hint of each exercise, and what was checked last, in this session.
_steps: dict[str, int] = {}
_latest: dict[str, tuple[str, Any]] = {}


def lessons() -> list[str]:
    """Names of the lessons that have a folder here, in their order: "lesson00", "lesson01", ..."""
    return sorted(room.name for room in Path(__file__).parent.glob("lesson[0-9][0-9]"))


def exercises() -> dict[str, Exercise]:
    """All exercises by name, e.g. "01.loop_constraints": the EXERCISES of every lesson that has some.

    >>> from rapkm_lite import checks; checks.exercises()["04.filtered_torques"].unit
    'N m'
    """
    found = {}
    for lesson in lessons():
        if importlib.util.find_spec(f"{__package__}.{lesson}.exercises"):
            found |= importlib.import_module(f"{__package__}.{lesson}.exercises").EXERCISES
    return found


def _known(name: str) -> Exercise:
    found = exercises()
    known("name", [name], sorted(found))
    return found[name]


def judge(name: str, answer: Any) -> Result:
    """Verdict, sentence and the name of the mistake for an answer to one exercise.

    Raises ValueError for an unknown exercise.
    """
    return judged(_known(name), answer)


def examine(name: str, answer: Any) -> tuple[str, str]:
    """Verdict ("ok", "close", "todo" or "wrong") and a sentence with the measured number for an answer to one exercise.

    Raises ValueError for an unknown exercise.

    >>> from rapkm_lite import checks; checks.examine("04.filtered_torques", ...)
    ('todo', 'not yet')
    """
    return judge(name, answer)[:2]


def check(name: str, answer: Any) -> Any:
    """Check an answer, print one line, and return what the lesson goes on with: the answer if right, or the package's.

    Prints OK, CLOSE, TODO or NOT YET RIGHT; the last two of these go on with the package's answer, and so does CLOSE.
    A function comes back guarded: it is called with copies, so arithmetic in place changes nothing outside.  Where the
    package's answer is a secret (hidden offsets, gains) the student's own numbers come back, or NaN while there are
    none.  Raises AssertionError instead when the environment variable RAPKM_LITE_STRICT is 1, or true, and the answer
    is neither right nor close; ValueError for an unknown exercise.

    >>> from rapkm_lite import checks; shift = checks.check("04.filtered_torques", ...)
    TODO 04.filtered_torques: not yet
    """
    exercise = _known(name)
    result = judged(exercise, answer)
    word = _WORDS[result.word]
    if result.word in ("todo", "wrong") and _strict():
        raise AssertionError(f"{word} {name}: {result.sentence}")
    print(f"{word} {name}: {result.sentence}" + f'. For a hint: hint("{name}")' * (result.word == "wrong"))
    raw = answer.own if isinstance(answer, Answer) else answer
    own = None if result.word == "todo" else raw
    _latest[name] = result.word, own
    return going_on(exercise, result.word, own)


def _strict() -> bool:
    """Is RAPKM_LITE_STRICT set, in the words of RAPKM_LITE_NUMBA?"""
    return os.environ.get("RAPKM_LITE_STRICT", "0").strip().lower() not in ("", "0", "false", "no", "off")


def going_on(exercise: Exercise, word: str, own: Any) -> Any:
    """What the lesson goes on with after a verdict on the student's `own` answer (None: there is none)."""
    reference = exercise.reference
    value = exercise.is_value(exercise.cases(np.random.default_rng(0)))
    if value:
        package = reference() if callable(reference) else reference
        if word == "ok" and exercise.raw:
            return numbers(given(own, ()))[()]
        if word == "ok" or exercise.secret:
            return _own_value(own, package)
        return package
    assert callable(reference)
    mine = own if callable(own) else None
    if word == "ok" and mine is not None:
        return Answer(mine, own=mine)
    return Handed(reference, own=mine, student=Answer(mine) if mine is not None else None)


def _own_value(own: Any, package: Any) -> Any:
    """The student's own value, as numbers of the right shape, or NaN where it has none."""
    try:
        return fitting(numbers(given(own, ())), np.shape(package))[()]
    except Ended:
        return np.full(np.shape(package), np.nan).view(NotYet)


def own_answer(name: str) -> tuple[str, Any]:
    """The last verdict of this session on an exercise, "todo" before that, and the answer, guarded, if wrong or close.

    Raises ValueError for an unknown exercise.
    """
    _known(name)
    word, own = _latest.get(name, ("todo", None))
    if word not in ("wrong", "close"):
        return word, None
    return word, Answer(own) if callable(own) else tidied(own)


def hint(name: str, step: int | None = None) -> None:
    """Print the next of three hints for an exercise, or the given one: what to think of, which quantity, the line.

    Raises ValueError for an unknown exercise or step.

    >>> from rapkm_lite import checks; checks.hint("04.filtered_torques", 1)  # doctest: +ELLIPSIS
    Hint 1 of 3 for 04.filtered_torques: ...
    """
    hints = _known(name).hints
    if step is None:
        step = min(_steps.get(name, 0) + 1, len(hints))
    step = whole_number("step", step, 1, len(hints))
    print(f"Hint {step} of {len(hints)} for {name}: {hints[step - 1]}")
    _steps[name] = step
