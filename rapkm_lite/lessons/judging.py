"""The verdict on an answer: against the package and a law of nature, or by the behaviour of a design."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any, TypeGuard

import numpy as np

from .answers import NOTHING, REFERENCE, Answer, Ended, NotYet, Result, copied, fitting, given, guarded, numbers
from .detectors import coarse, named, where
from .exercise import Case, Exercise, Measured, arms
from .seen import Seen, largest, ratio_of, rounding

_OWN = " (is it the robot of the arguments, and does robot.n_arms or robot.n_joints stand where it counts?)"


def judged(exercise: Exercise, answer: Any) -> Result:
    """The verdict on one answer, whatever it is and does."""
    before = REFERENCE.set(exercise.reference if callable(exercise.reference) else None)
    try:
        answer = _unwrapped(answer)
        if exercise.judge and exercise.raw:
            return guarded(exercise.judge, answer)
        cases = exercise.cases(np.random.default_rng(20_111_130))
        if not exercise.is_value(cases) and not callable(answer):
            words = "the answer is a value; give the function itself, without calling it"
            raise Ended("wrong", words, "not a function")
        return _behaviour(exercise, answer) if exercise.judge else _near_and_far(exercise, answer, cases)
    except Ended as end:
        return end.result._replace(sentence=end.result.sentence + "".join(getattr(end, "__notes__", ())))
    finally:
        REFERENCE.reset(before)


def _unwrapped(answer: Any) -> Any:
    """What the student wrote, also when it is what `check` returned before; ends where there is nothing."""
    if isinstance(answer, Answer):
        answer = answer.own
    if answer is None or answer is Ellipsis or answer is NotImplemented or isinstance(answer, NotYet):
        raise Ended("todo", "not yet")
    if inspect.iscoroutinefunction(answer):  # a run would call it and leave what it gets unawaited
        raise Ended("wrong", "the answer is a coroutine: write def, not async def", "not numeric")
    return answer


def _is_far(case: tuple) -> TypeGuard[Case]:
    return isinstance(case, Case) and case.beyond


def _near_and_far(exercise: Exercise, answer: Any, cases: list[tuple]) -> Result:
    """The verdict on the plain cases; what is right there may fall short in those that lie beyond."""
    near, far = [case for case in cases if not _is_far(case)], [case for case in cases if _is_far(case)]
    result = _numbers(exercise, answer, near)
    if not far:
        return result
    try:
        whole = _numbers(exercise, answer, cases)
    except Ended as end:
        whole = end.result
    if whole.word == "ok" or whole.word == result.word:
        return whole if result.word == "ok" else result
    said = _failures(exercise, answer, far, whole.sentence)
    right = "it is right" if result.word == "ok" else result.sentence.partition(". To improve: ")[0]
    words, _, advice = next(iter(said.values())).partition(". To improve: ")
    words = words.replace("the method is right, off", "it is off")
    if _sizes([case for case in far if case.label in said]) - _sizes(near):
        advice = "make it hold there too; shapes of the arguments tell the numbers"
    short = f"{right}, but not for {', '.join(said)}, where {words}"
    return Result("close", f"{short}. To improve: {advice or 'make it hold there too'}")


def _sizes(cases: Sequence[tuple]) -> set[tuple]:
    """Shapes of the arrays of the cases, numbers of arms of their machines."""
    return {tuple(v.shape if isinstance(v, np.ndarray) else getattr(v, "n_arms", None) for v in case) for case in cases}


def _failures(exercise: Exercise, answer: Any, cases: list[Case], sentence: str) -> dict[str, str]:
    """What is wrong with the answer for each kind of cases that it fails; where none fails alone, for all of them."""
    kinds = sorted({case.label for case in cases})
    said = {kind: _failure(exercise, answer, [case for case in cases if case.label == kind]) for kind in kinds}
    return {kind: words for kind, words in said.items() if words} or dict.fromkeys(kinds, sentence)


def _failure(exercise: Exercise, answer: Any, cases: list[tuple]) -> str:
    """What is wrong with the answer for these cases, taken alone; "" where nothing is."""
    try:
        result = _numbers(exercise, answer, cases)
    except Ended as end:
        result = end.result
    return "" if result.word == "ok" else result.sentence


def _seen(exercise: Exercise, answer: Any, cases: list[tuple]) -> Seen:
    """Given and right answers of all cases, in one shape; ends where they show a mistake that has a name."""
    read = _each(cases, lambda k: numbers(given(answer, cases[k])))
    want = exercise.answers_to(cases)
    names = tuple(inspect.signature(exercise.reference).parameters)
    _known_mistake(exercise, Seen(read, want, cases, names))
    return Seen(_each(cases, lambda k: fitting(read[k], want[k].shape)), want, cases, names)


def _each(cases: list[tuple], ask: Callable) -> list[np.ndarray]:
    """What `ask` gives for each case; where it ends, a note says for which kind, if another kind went through."""
    labels, got = [getattr(case, "label", "") for case in cases], []
    for k, label in enumerate(labels):
        try:
            got.append(ask(k))
        except Ended as end:
            only = all(labels[: k + 1]) and label not in labels[:k] and k > 0
            if end.result.sentence == NOTHING and got:
                end = Ended("wrong", NOTHING + "; some other case has one" * (not only), "none")
            if only:
                own = _OWN * bool(arms(cases[k : k + 1]) - arms(cases[:k]))
                end.add_note(f"; for {label}, while it goes through for {labels[0]}{own}")
            raise end from None
    return got


def _numbers(exercise: Exercise, answer: Any, cases: list[tuple]) -> Result:
    seen = _seen(exercise, answer, cases)
    worst, want = [_deviation(g, w) for g, w, _ in seen], seen.want
    allowed = [max(exercise.tolerance, 1e-9 * largest(w)) for w in want]
    right = [d <= a for d, a in zip(worst, allowed, strict=True)]
    lawful, sentence = _law(exercise, seen)
    if all(right) and lawful <= exercise.tolerance:
        law = f"; {sentence}: below {exercise.tolerance:.0e}" if exercise.invariant else ""
        met = exercise.tolerance if max(worst) <= exercise.tolerance else max(allowed)
        near = f"within {met:.0e} {exercise.unit} of the package at "
        return Result("ok", f"{near}{len(cases)} case{'s'[: len(cases) > 1]}{law}")
    if all(right):
        said = f"{sentence}: {lawful:.3g} (allowed {exercise.tolerance:.0e})"
        if exercise.close:
            return Result("close", f"the method is right, {said}. To improve: {exercise.improve}")
        raise Ended("wrong", said, sentence)
    off = _off(exercise, seen)
    if words := _close(exercise, seen, off, _share(worst, want, right)):
        return Result("close", f"the method is right{words}")
    _explained(exercise, seen, right)
    law = f"; {sentence}" + (": too much" if exercise.secret else f": {lawful:.3g}") * (lawful < np.inf)
    off = off or "off; how far is not told, since a few tries would then tell the answer"
    raise Ended("wrong", f"it is {off}" + law * (lawful > exercise.tolerance), "no name found")


def _close(exercise: Exercise, seen: Seen, off: str, share: float) -> str:
    """What a right method lacks, and how to improve; "" where the answer is not close. `share` : how far it is off."""
    if exercise.close and not exercise.secret and (rounded := coarse(seen)):
        return f", {off}, but {rounded}. To improve: return them as computed"
    if share > exercise.close or _by_a_factor(seen):
        return ""
    if exercise.near:
        raise Ended("wrong", f"{exercise.near}; {off}, that is {100 * share:.2g} %", exercise.near)
    return (f", {off}, that is {100 * share:.2g} %" if off else "") + f". To improve: {exercise.improve}"


def _off(exercise: Exercise, seen: Seen) -> str:
    """How far the answer is off; nothing where shapes differ, or where a few tries would then tell a secret answer."""
    if exercise.secret or any(g.shape != w.shape for g, w, _ in seen):
        return ""
    worst = max(_deviation(g, w) for g, w, _ in seen)
    return f"off by up to {worst:.3g} {exercise.unit} (allowed {exercise.tolerance:.0e})"


def _by_a_factor(seen: Seen) -> bool:
    """Is the answer the right one times a constant, and not of a number that was rounded, such as 3.14?"""
    k = ratio_of(seen.got, seen.want)
    tight = replace(seen, slack=1e-9)
    return abs(k - 1.0) > 0.01 and len(seen.want) > 1 and tight.same([k * w for w in seen.want])


def _share(worst: list[float], want: list[np.ndarray], right: list[bool]) -> float:
    """The largest deviation, relative: small cases against the mean size, for a search errs as much everywhere."""
    usual = float(np.mean([largest(w) for w in want])) or 1.0
    return max(d / max(largest(w), usual) if not good else 0.0 for d, w, good in zip(worst, want, right, strict=True))


def _deviation(got: np.ndarray, want: np.ndarray) -> float:
    with np.errstate(over="ignore"):
        return largest(got - want)


def _law(exercise: Exercise, seen: Seen) -> tuple[float, str]:
    """The largest number of the invariant over all cases, with its sentence."""
    lawful, sentence = 0.0, ""
    if exercise.invariant:
        with np.errstate(all="ignore"):
            for got, _, case in seen:
                try:
                    number, text = exercise.invariant(np.array(got)[()], *map(copied, case))
                except (ValueError, ArithmeticError):  # an answer of no machine
                    number, text = np.inf, "nothing can be computed with it"
                if number != number:
                    number, text = np.inf, "nothing can be computed with it"
                if not number < lawful:
                    lawful, sentence = float(number), text
    return lawful, sentence


def _sign(mistake: Callable, seen: Seen) -> int:
    """The sign with which a mistake explains the answer in every case; 0 where it does not."""
    try:
        with np.errstate(all="ignore"):
            made = [np.asarray(mistake(*map(copied, case)), dtype=float) for case in seen.cases]
    except Exception:
        return 0
    signs = () if seen.agree(made, seen.want) else (1, -1)
    least = rounding(seen.want)  # where a mistake leaves nothing else, no two ways to make it agree in a digit
    return next((sign for sign in signs if seen.agree([sign * m for m in made], seen.got, least=least)), 0)


def _known_mistake(exercise: Exercise, seen: Seen) -> None:
    """End the examination where the answer is that of a mistake the exercise knows by name."""
    if seen.same(seen.want):
        return
    signs = {words: sign for words, mistake in exercise.mistakes.items() if (sign := _sign(mistake, seen))}
    if signs:
        # What explains the answer as it is goes before what explains its opposite.
        sentence = max(signs, key=lambda words: signs[words])
        turned = ", and the sign is opposite" * (signs[sentence] < 0)
        raise Ended("wrong", "; ".join(filter(None, [sentence + turned, _off(exercise, seen)])), sentence)


def _explained(exercise: Exercise, seen: Seen, right: list[bool]) -> None:
    """End the examination with the name of the mistake, or with the place where it was made, if either is found."""
    scale = max(map(largest, seen.want), default=0.0) or 1.0
    loose = min(0.2, max(1e-6, exercise.close, 1.5 * exercise.tolerance / scale))
    rough = replace(seen, slack=loose)
    words = named(seen, exercise.secret)
    if not words and loose > 1e-6:
        _known_mistake(exercise, rough)
    # What fits much better goes first: two numbers may be nearly opposite, and their order the mistake.
    words = words or named(replace(seen, slack=loose / 5), exercise.secret) or named(rough, exercise.secret)
    words = words or ("" if exercise.secret else where(seen, right, exercise.partly))
    if words:
        raise Ended("wrong", "; ".join(filter(None, [words, _off(exercise, seen)])), words)


def _behaviour(exercise: Exercise, answer: Any) -> Result:
    """The verdict on a design: its measured numbers beside their limits."""
    assert exercise.judge
    answer = _design(exercise, answer)
    try:
        measured: list[Measured] = guarded(exercise.judge, answer)
        text = ", ".join(map(str, measured))
        miss = max((m.miss if m.value == m.value else np.inf) for m in measured)
        if miss == 0.0:
            return Result("ok", text)
        if miss <= exercise.close:
            return Result("close", f"{text}. To improve: {exercise.improve}")
        raise Ended("wrong", text, "; ".join(f"{m.what} misses its limit" for m in measured if m.miss > 0.0))
    except Ended as end:
        # Which kind of design it is explains why it misses a limit; one that misses none is right, whatever its kind.
        if end.result.word == "wrong" and not end.result.mistake.startswith("stops with"):
            for sentence, made in exercise.mistakes.items():
                if _true(made, answer):
                    raise Ended("wrong", f"{sentence}; {end.result.sentence}", sentence) from None
        raise


def _design(exercise: Exercise, answer: Any) -> Any:
    """A design as its judge wants it: a function where one is asked for, else numbers of the right shape."""
    if callable(answer) and not callable(exercise.reference):
        raise Ended("wrong", "the answer is a function; a value is wanted", "not a value")
    if callable(answer):
        # A judge may ask a design again for the same place; another check asks anew, whatever has become of it.
        # A class of the student's may make a law; one of the package is what was forgotten to be made.
        ours = isinstance(answer, type) and answer.__module__.startswith("rapkm_lite.")
        return answer if ours else Answer(answer)
    return fitting(numbers(answer), np.asarray(exercise.reference).shape)[()]


def _true(made: Callable, answer: Any) -> bool:
    """Whether a design shows a known mistake; what cannot be asked does not show it."""
    with suppress(Ended), np.errstate(all="ignore"):
        return bool(guarded(made, answer))
    return False
