"""python -m rapkm_lite: the default experiment beside Table 1, and commands for students and teachers."""

from __future__ import annotations

import argparse
import io
import json
import os
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from subprocess import list2cmdline

from . import __version__


def _summary(options) -> None:
    from .simulation.compiled import without_compiler
    from .simulation.summary import as_text, summary

    # Two runs take less time than the compiler.
    without_compiler()
    values = {"version": __version__} | summary()
    print(json.dumps(values, indent=2) if options.json else as_text(values))


def _lessons(options) -> None:
    from .lessons.copies import copy_lessons

    if not options.folder.strip():
        raise ValueError(f"folder = {options.folder!r}; allowed: the name of a folder, . for the present one")
    files = copy_lessons(options.folder)
    print(f"{len(files)} files in {options.folder}; open the first lesson with")
    first = str(files[0])
    print(f"    python -m jupyter lab {list2cmdline([first]) if os.name == 'nt' else shlex.quote(first)}")


def _grade(options) -> None:
    from .lessons.grading.grader import grade
    from .lessons.grading.tables import bar, check_place, write_csv

    if options.csv is not None:
        check_place(Path(options.csv))
    grades = grade(Path(options.submissions), options.seconds, options.jobs, bar)
    try:
        if options.csv is not None:
            write_csv(Path(options.csv), grades)
    finally:
        _tell_grades(Path(options.submissions), grades)


def _tell_grades(folder: Path, grades) -> None:
    from .lessons.checker import exercises
    from .lessons.grading.submission import silent, surpassed, unnamed
    from .lessons.grading.tables import by_exercise, by_student

    print(by_exercise(grades), by_student(grades), sep="\n\n")
    known = {name[:2] for name in exercises()}
    if others := surpassed(folder, known, {grade.file for grade in grades}):
        print(f"\nnot counted, since another notebook of this student has more points or is newer: {', '.join(others)}")
    if left := unnamed(folder, known):
        words = "not graded, since it cannot be told which lesson they are; name them like 04_title.ipynb"
        print(f"\n{words}: {', '.join(left)}")
    if empty := silent(folder, known):
        print(f"\nno notebook that could be graded: {', '.join(empty)}")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command; the exit status."""
    parser = argparse.ArgumentParser(prog="python -m rapkm_lite", description=__doc__)
    parser.add_argument("--version", action="version", version=f"rapkm_lite {__version__}")
    parser.add_argument("--json", action="store_true", help="print the summary for scripts")
    parser.set_defaults(run=_summary)
    commands = parser.add_subparsers(title="commands", metavar="command")
    lessons = commands.add_parser("lessons", help="copy the lessons into a folder")
    lessons.add_argument("folder")
    lessons.set_defaults(run=_lessons)
    grades = commands.add_parser("grade", help="grade a folder of submitted lessons")
    grades.add_argument("submissions", help="a folder with STUDENT/04_title.ipynb, or loose notebooks")
    grades.add_argument("--csv", help="file for one row per student and exercise")
    grades.add_argument("--seconds", type=float, default=30.0, help="limit of a statement or a check (30)")
    grades.add_argument("--jobs", type=int, help="submissions at a time (as many as processors)")
    grades.set_defaults(run=_grade)
    options = parser.parse_args(arguments)
    if options.json and options.run is not _summary:
        parser.error("--json goes with no command; allowed: python -m rapkm_lite --json")
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # whatever letters a name has, a screen shows the others
            stream.reconfigure(errors="backslashreplace")
    try:
        options.run(options)
        print(end="", flush=True)
        return 0
    except BrokenPipeError:
        # Who reads along, such as `head`, has enough; the interpreter flushes once more when it ends.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except OSError as error:
        if error.filename is not None:
            raise
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        print(f"the output cannot be written ({error.strerror}); allowed: a device with room", file=sys.stderr)
        return 1
    except ValueError as error:
        print(error, file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
