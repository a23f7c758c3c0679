"""What an exercise is: the package's answer, the cases it is tried on, its hints and the mistakes that have a name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..machine.arguments import short
from ..machine.manipulator import Manipulator
from .answers import copied


class Case(tuple):
    """Arguments of one case with words for it that a verdict can say: Case("a nearly singular pose", A, c).

    beyond : True for a case that goes further than it takes to have the idea, like a fourth drive; an answer that is
    wrong there only is "close".

    >>> from rapkm_lite import checks; checks.Case("a nearly singular pose", 1.0, 2.0).label
    'a nearly singular pose'
    """

    label: str
    beyond: bool

    def __new__(cls, label: str, *arguments, beyond: bool = False):
        case = super().__new__(cls, arguments)
        case.label, case.beyond = label, beyond
        return case


def arms(cases: list[tuple]) -> set[str]:
    """The arms of all machines of these cases; who takes them from another machine stops, or finds no pose."""
    return {repr((v.base, v.lengths)) for case in cases for v in case if isinstance(v, Manipulator)}


@dataclass(frozen=True)
class Measured:
    """One measured number of a design beside its limit, at most (or at least) so much.

    >>> from rapkm_lite import checks; print(checks.Measured("largest error", 2.4, "mm", 2.0))
    largest error 2.4 mm (at most 2 mm: missed)
    >>> print(checks.Measured("largest error", 120.0004, "mm", 120.0))
    largest error 120.0004 mm (at most 120 mm: missed)
    """

    what: str
    value: float
    unit: str
    limit: float
    at_most: bool = True

    @property
    def holds(self) -> bool:
        # A limit that is met exactly is met, whatever rounding says.
        over = (self.value - self.limit) * (1 if self.at_most else -1)
        return over <= 1e-9 * abs(self.limit)

    @property
    def miss(self) -> float:
        """How far beyond the limit, relative to it; zero where it holds."""
        return 0.0 if self.holds else abs(self.value - self.limit) / max(abs(self.limit), 1e-300)

    def __str__(self) -> str:
        word = "most" if self.at_most else "least"
        missed = "" if self.holds else ": missed"
        # A number that misses by less than four digits show says so by more of them.
        digits = next((n for n in range(4, 17) if self.holds or f"{self.value:.{n}g}" != f"{self.limit:.{n}g}"), 17)
        return f"{self.what} {self.value:.{digits}g} {self.unit} (at {word} {self.limit:.4g} {self.unit}{missed})"


@dataclass(frozen=True)
class Exercise:
    """One exercise.

    reference : the package's answer, a function of the case; for a value, a function of nothing.  A design exercise
        has an example that meets all limits: a function, or the value itself.
    hints : three steps, what to think of, which quantity, the line.
    unit : of the answer.
    cases : rng -> list of argument tuples (or `Case`, whose words the verdict says); left out for a value.
    invariant : (answer, *case) -> (measured number, sentence), a law of nature; the number stays below `tolerance`.
    tolerance : largest deviation from the reference (never less than 1e-9 of its largest entry), and of the invariant.
    close : deviations up to this share of the largest entry are "close": the method is right, accuracy is short.  Of a
        design: the share of its limit by which a measured number may miss it.
    improve : the sentence that says what would improve a close answer.
    near : the sentence that says why an answer which is off by a share of at most `close` is wrong all the same.
    partly : the sentence for an answer that is right in some cases of a kind and wrong in others, with no other name.
    mistakes : sentence that names a mistake -> function of the case that makes it (of a design: function of the answer
        that is true when the mistake was made).
    judge : of a design: answer -> list of `Measured`, from runs in closed loop; cases, invariant and tolerance are
        not used.
    raw : True where `judge` reads the answer as it stands, words and NaN too, and returns a `Result`.
    secret : True where `check` must not hand out the package's answer, nor say how far another one is off.
    points : what a right or close answer is worth.
    called : the name of the answer in the lesson, where it is not the last part of the exercise's name.

    >>> from rapkm_lite import checks; checks.Exercise(reference=9.81, unit="m/s^2").is_value([()])
    True
    """

    reference: Any
    hints: tuple[str, ...] = ()
    unit: str = ""
    cases: Callable = lambda rng: [()]
    invariant: Callable | None = None
    tolerance: float = 1e-9
    close: float = 0.0
    improve: str = "ask more of your method: a smaller tolerance, more steps, more samples"
    near: str = ""
    partly: str = ""
    mistakes: dict[str, Callable] = field(default_factory=dict)
    judge: Callable | None = None
    raw: bool = False
    secret: bool = False
    points: float = 5.0
    called: str = ""

    def is_value(self, cases: list[tuple]) -> bool:
        """True when the answer is a value, not a function.

        Raises ValueError for no list of cases, which is gone through twice, and for an empty one: any answer passes it.
        """
        if not isinstance(cases, list) or not cases:
            raise ValueError(f"cases(rng) = {short(cases)}; allowed: a list of one case at least")
        return not callable(self.reference) if self.judge else cases == [()]

    def answers_to(self, cases: list[tuple]) -> list[np.ndarray]:
        """The package's answer to each case.

        Raises ValueError, naming the case, for one that is NaN or infinite: no answer would then be told from it.
        """
        answers = [np.asarray(self.reference(*map(copied, case)), dtype=float) for case in cases]
        for case, answer in zip(cases, answers, strict=True):
            if not np.all(np.isfinite(answer)):
                raise ValueError(f"the reference answers {short(case)} with {short(answer)}; allowed: finite numbers")
        return answers
