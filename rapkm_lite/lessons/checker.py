"""Self-checks of the exercises: an answer against the package at seeded random poses and against an invariant."""

from __future__ import annotations

import importlib.util
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Exercise:
    """One exercise.

    reference : the package's answer, a function of the case, or of nothing when the answer is a value.
    cases : rng -> list of argument tuples; empty for a value.
    invariant : (answer, *case) -> (measured number, sentence); the number must stay below `tolerance`.
    hint : one sentence that helps without giving the answer away.
    unit : of the answer.  tolerance : largest deviation from the reference, absolute, and of the invariant.
    """

    reference: Callable
    hint: str
    unit: str
    cases: Callable = lambda rng: [()]
    invariant: Callable | None = None
    tolerance: float = 1e-9


def lessons() -> list[str]:
    """Names of the lessons that have a folder here, in their order: "lesson00", "lesson01", ..."""
    return sorted(room.name for room in Path(__file__).parent.glob("lesson[0-9][0-9]"))


def exercises() -> dict[str, Exercise]:
    """All exercises by name, e.g. "01.loop_constraints": the EXERCISES of every lesson that has some."""
    found = {}
    for lesson in lessons():
        if importlib.util.find_spec(f"{__package__}.{lesson}.exercises"):
            found |= importlib.import_module(f"{__package__}.{lesson}.exercises").EXERCISES
    return found


class _Verdict(Exception):
    """What ends an examination before its last case: the verdict and its sentence."""


def _answer(answer, case: tuple, shape: tuple[int, ...]) -> np.ndarray:
    """What an answer gives for one case, as an array of the expected shape; raises `_Verdict` where it gives none."""
    try:
        got = answer(*case) if callable(answer) else answer
    except NotImplementedError:
        raise _Verdict("todo", "not yet") from None
    except Exception as error:
        raise _Verdict("wrong", f"your code stops with {type(error).__name__}: {error}") from error
    if got is Ellipsis or got is None:
        raise _Verdict("todo", "not yet: no value is returned")
    try:
        got = np.asarray(got, dtype=float)
    except (TypeError, ValueError):
        raise _Verdict("wrong", "the answer is not numeric") from None
    if got.shape != shape:
        raise _Verdict("wrong", f"the answer has shape {got.shape}, expected {shape}")
    if not np.all(np.isfinite(got)):
        raise _Verdict("wrong", "the answer holds NaN or infinity")
    return got


def _measure(exercise: Exercise, answer) -> str:
    """The sentence for a right answer; raises `_Verdict` with the measured number for any other."""
    if answer is Ellipsis or answer is None:
        raise _Verdict("todo", "not yet")
    cases, limit = exercise.cases(np.random.default_rng(20_111_130)), exercise.tolerance
    worst = lawful = 0.0
    sentence = ""
    for case in cases:
        want = np.asarray(exercise.reference(*case), dtype=float)
        got = _answer(answer, case, want.shape)
        worst = max(worst, float(np.max(np.abs(got - want), initial=0.0)))
        if exercise.invariant:
            number, text = exercise.invariant(got, *case)
            if number >= lawful:
                lawful, sentence = float(number), text
    if worst > limit:
        raise _Verdict("wrong", f"it is off by up to {worst:.3g} {exercise.unit} (allowed {limit:.0e})")
    if lawful > limit:
        raise _Verdict("wrong", f"{sentence}: {lawful:.3g} (allowed {limit:.0e})")
    law = f"; {sentence}: below {limit:.0e}" if exercise.invariant else ""
    return f"within {limit:.0e} {exercise.unit} of the package at {len(cases)} case{'s'[: len(cases) > 1]}{law}"


def examine(name: str, answer) -> tuple[str, str]:
    """Verdict ("ok", "todo" or "wrong") and a sentence with the measured number for an answer to one exercise.

    Raises ValueError for an unknown exercise.
    """
    known = exercises()
    if name not in known:
        raise ValueError(f"name = {name!r}; allowed: {', '.join(sorted(known))}")
    try:
        return "ok", _measure(known[name], answer)
    except _Verdict as verdict:
        word, sentence = verdict.args
        return word, f"{sentence}. Hint: {known[name].hint}"


def check(name: str, answer: Any) -> Any:
    """Check an answer, print one line, and return what the lesson goes on with: the answer if right, or the package's.

    Prints OK, TODO or NOT YET RIGHT with the measured number and a hint.  Raises AssertionError instead when the
    environment variable RAPKM_LITE_STRICT is 1 and the answer is not right.
    """
    verdict, sentence = examine(name, answer)
    word = {"ok": "OK", "todo": "TODO", "wrong": "NOT YET RIGHT"}[verdict]
    if verdict != "ok" and os.environ.get("RAPKM_LITE_STRICT") == "1":
        raise AssertionError(f"{word} {name}: {sentence}")
    print(f"{word} {name}: {sentence}")
    if verdict == "ok":
        return answer
    reference = exercises()[name].reference
    return reference if callable(answer) else reference()
