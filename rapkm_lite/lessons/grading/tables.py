"""Grades as a file and as tables: one row per student and exercise, what the class stumbles over, the totals."""

from __future__ import annotations

import csv
import os
import sys
import textwrap
from collections import Counter
from pathlib import Path

from ...machine.arguments import short
from .grader import Grade
from .submission import Submission

COLUMNS = ("student", "exercise", "verdict", "points", "of", "sentence", "mistake", "file")


def check_place(path: Path) -> None:
    """Raise ValueError where a file cannot be written: to be asked before an hour of grading, not after it."""
    try:
        there = os.path.lexists(path)
        with path.open("a"):
            pass
        if not there:
            path.unlink()
    except OSError as error:
        raise _unwritten(path, error) from None


def write_csv(path: Path, grades: list[Grade]) -> None:
    """One row per student and exercise; text that a spreadsheet would run as a formula is quoted.

    Raises ValueError where the file cannot be written.
    """
    try:
        with path.open("w", newline="", encoding="utf-8", errors="backslashreplace") as file:
            rows = csv.writer(file)
            rows.writerow(COLUMNS)
            for grade in grades:
                rows.writerow([_harmless(getattr(grade, column)) for column in COLUMNS])
    except OSError as error:
        raise _unwritten(path, error) from None


def _unwritten(path: Path, error: OSError) -> ValueError:
    return ValueError(f"csv = {short(str(path))} cannot be written ({error.strerror}); allowed: a file in a folder")


def _harmless(value: object) -> object:
    return f"'{value}" if isinstance(value, str) and value[:1] in ("=", "+", "-", "@", "\t") else value


def by_exercise(grades: list[Grade]) -> str:
    """How the class did on each exercise, and the mistakes with a name that were made most often."""
    lines = [f"{'exercise':<28}{'right':>7}{'close':>7}{'wrong':>7}{'not yet':>9}   most common mistakes"]
    for name in sorted({grade.exercise for grade in grades}):
        own = [grade for grade in grades if grade.exercise == name]
        words = Counter(grade.verdict for grade in own)
        mistakes = Counter(grade.mistake for grade in own if grade.verdict == "wrong" and grade.mistake)
        often = ((textwrap.shorten(mistake, 70, placeholder=" …"), count) for mistake, count in mistakes.most_common(3))
        common = "; ".join(f"{count} x {mistake}" for mistake, count in often)
        counts = f"{words['ok']:>7}{words['close']:>7}{words['wrong']:>7}{words['todo']:>9}"
        lines.append(f"{name:<28}{counts}   {common}".rstrip())
    return "\n".join(lines)


def by_student(grades: list[Grade]) -> str:
    """Points of each student, per lesson and in all, of those of all lessons that anybody handed in."""
    lessons = sorted({grade.exercise[:2] for grade in grades})
    most = sum({grade.exercise: grade.of for grade in grades}.values())
    lines = [f"{'student':<28}" + "".join(f"{lesson:>8}" for lesson in lessons) + f"{'all':>8}{'of':>8}"]
    for student in sorted({grade.student for grade in grades}):
        own = [grade for grade in grades if grade.student == student]
        sums = [sum(grade.points for grade in own if grade.exercise[:2] == lesson) for lesson in lessons]
        handed = {grade.exercise[:2] for grade in own}
        cells = [f"{s:>8g}" if lesson in handed else f"{'-':>8}" for s, lesson in zip(sums, lessons, strict=True)]
        lines.append(f"{student[:27]:<28}{''.join(cells)}{sum(sums):>8g}{most:>8g}")
    return "\n".join(lines)


def bar(done: int, total: int, submission: Submission) -> None:
    """A progress bar on the error stream; one line that is written over on a terminal."""
    full = round(30 * done / total)
    text = f"[{'#' * full}{'.' * (30 - full)}] {done}/{total} {submission.student} {submission.path.name}"
    last = "\n" if done == total or not sys.stderr.isatty() else ""
    print(f"\r{text[:100]:<100}", end=last, file=sys.stderr, flush=True)
