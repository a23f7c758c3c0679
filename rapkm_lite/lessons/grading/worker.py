"""The process in which one submission runs: its statements, the real checks, one line of JSON per event.

    python -m rapkm_lite.lessons.grading.worker NOTEBOOK LESSON LOG [--whole] [--skip KEY ...]

Written to LOG: {"hidden": whether `check` is called in ways that `needed` cannot follow}, {"begin": key} before a
statement or a check, {"end": key} after a check, {"result": [name, word, sentence, mistake]}, and {"done": true}.
What hangs or dies is the last thing begun; the caller starts again and lets it be skipped.
"""

from __future__ import annotations

import argparse
import ast
import asyncio
import importlib
import inspect
import io
import json
import linecache
import os
import re
import shlex
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout, suppress
from functools import partial
from itertools import takewhile
from pathlib import Path
from threading import Thread
from types import CodeType
from typing import Any

from rapkm_lite.lessons import checker
from rapkm_lite.lessons.answers import Answer, Ended, Result, given, guarded
from rapkm_lite.lessons.exercise import Exercise
from rapkm_lite.lessons.grading.cells import sources
from rapkm_lite.lessons.grading.submission import RULES, Statement, called, hides_check, needed, statements


class Bench:
    """Runs the statements of one notebook and judges what they answer."""

    def __init__(self, lesson: str, log: Path, skip: set[str], folder: Path):
        self.folder = folder
        self.exercises = {n: e for n, e in checker.exercises().items() if n.startswith(f"{lesson}.")}
        self.log, self.skip = log.open("a", encoding="utf-8"), skip
        self.judge, self.going_on = checker.judge, checker.going_on
        self.results: dict[str, Result] = {}
        # Answers found without a check: by exercise, with the cell they stand in.
        self.bound: dict[str, list[tuple[int, Any]]] = {name: [] for name in self.exercises}
        self.failed: dict[int, str] = {}

    def tell(self, **event) -> None:
        self.log.write(json.dumps(event) + "\n")
        self.log.flush()

    def check(self, name: str, answer: Any) -> Any:
        """Stands in for `check`: judges, remembers the last answer that is one, prints nothing."""
        if name not in self.exercises:
            raise ValueError(f"name = {name!r}; allowed: {', '.join(sorted(self.exercises))}")
        result = self.judged(name, answer)
        if result.word != "todo" or name not in self.results:
            self.results[name] = result
        own = answer.own if isinstance(answer, Answer) else answer
        lost = result.word == "todo" or f"check {name}" in self.skip
        with suppress(ImportError):  # see `judged`: the lesson goes on with what there is
            return self.going_on(self.exercises[name], result.word, None if lost else own)
        return answer

    def judged(self, name: str, answer: Any) -> Result:
        if f"check {name}" in self.skip:
            return Result("wrong", "your code does not come to an end, or ends the process", "no end")
        if str(getattr(answer, "__module__", "")).startswith("rapkm_lite.lessons") and not isinstance(answer, Answer):
            return Result("todo", "not yet: this is the package's own answer")
        self.tell(begin=f"check {name}")
        try:
            with quiet():
                result = self.judge(name, answer)
        except ImportError as error:  # what the cases are made with, SymPy in lesson 12; an answer's own is caught
            result = Result("wrong", f"it cannot be judged here: {error}", "a package is missing")
            with quiet():
                result = untouched(self.exercises[name], answer) or result
        self.tell(end=f"check {name}")
        return result

    def run(self, chosen: list[Statement], texts: list[str]) -> None:
        """Run statements in a fresh module; after an error the rest of its cell is left out, as in a notebook."""
        space: dict[str, Any] = {"__name__": "__main__", "display": lambda *shown, **named: None}
        space["get_ipython"] = partial(NoNotebook, space, self.folder)
        for cell, text in enumerate(texts):
            linecache.cache[f"<cell {cell}>"] = (len(text), None, text.splitlines(keepends=True), f"<cell {cell}>")
        names = {called(name, exercise): name for name, exercise in self.exercises.items()}
        before: dict[str, Any] = {}
        for statement in chosen:
            if statement.key in self.skip or statement.cell in self.failed:
                continue
            self.tell(begin=statement.key)
            code = compile(ast.Module([statement.node], []), f"<cell {statement.cell}>", "exec", **RULES)
            try:
                with quiet():
                    guarded(awaited, code, space)
            except Ended as end:
                if end.result.word != "todo":
                    self.failed[statement.cell] = end.result.sentence
            for short, name in names.items():
                value = space.get(short)
                if value is not before.get(short) and value is not None and value is not Ellipsis:
                    self.bound[name].append((statement.cell, value))
                before[short] = value

    def conclude(self, texts: list[str]) -> None:
        """Judge the answers whose check was deleted or replaced, and tell all results."""
        for name in self.exercises:
            if name not in self.results or self.results[name].word == "todo":
                found = self.without_check(name, texts)
                # What a check said of an answer that is none says more than "not yet".
                if found.word != "todo" or name not in self.results:
                    self.results[name] = found
            self.tell(result=[name, *self.caused(self.results[name], texts)])
        self.tell(done=True)

    def caused(self, result: Result, texts: list[str]) -> Result:
        """A name that is not defined, with what stopped the cell that was to define it."""
        if missing := re.search(r"NameError: name '(\w+)'", result.sentence):
            for cell, sentence in sorted(self.failed.items()):
                # What a file binds that is run, its cell does not tell.
                binds = "run_line_magic('run'" in texts[cell] or re.search(rf"\b{missing[1]}\b", texts[cell])
                if sentence not in result.sentence and binds:
                    words = f"{result.sentence}; earlier, cell {cell + 1}: {sentence}"
                    return result._replace(sentence=words, mistake="an earlier cell stops")
        return result

    def without_check(self, name: str, texts: list[str]) -> Result:
        """The verdict on what bears the answer's name: the last where the exercise is named, else the best anywhere.

        Cells may have been run in another order than they stand: an answer may be defined below the check that stops.
        """
        cells = {i for i, text in enumerate(texts) if f'"{name}"' in text or f"'{name}'" in text}
        near = [value for cell, value in self.bound[name] if cell in cells]
        for value in reversed(near):
            result = self.judged(name, value)
            if result.word != "todo":
                return result
        words = [f"its cell: {self.failed[cell]}" for cell in sorted(cells) if cell in self.failed]
        stopped = [Result("wrong", text, "its cell stops") for text in words[:1]]
        # Hints and pictures name an exercise, too; its answer may stand in a cell of its own.
        tried = [self.judged(name, value) for cell, value in self.bound[name] if cell not in cells][:5]
        best = partial(min, key=lambda result: ["ok", "close", "wrong", "todo"].index(result.word))
        return best([*stopped, *tried], default=self.never_bound(name, texts))

    def never_bound(self, name: str, texts: list[str]) -> Result:
        """The verdict where nothing bears the answer's name: has the cell that was to make it stopped?"""
        makes = re.compile(rf"^(def )?{called(name, self.exercises[name])} ?[(=]", re.MULTILINE)
        stopped = [words for cell, words in sorted(self.failed.items()) if makes.search(texts[cell])]
        return Result("wrong", f"its cell: {stopped[0]}", "its cell stops") if stopped else Result("todo", "not yet")


def untouched(exercise: Exercise, answer: Any) -> Result | None:
    """The verdict "todo" on an answer that is not there yet, whatever it is asked; None for any other answer."""
    try:
        given(answer, (None,) * len(inspect.signature(exercise.reference).parameters))
    except Ended as end:
        return end.result if end.result.word == "todo" else None
    return None


def awaited(code: CodeType, space: dict[str, Any]) -> None:
    """Run a statement, to its end where it awaits something."""
    if inspect.iscoroutine(waits := eval(code, space)):
        asyncio.run(waits)


class NoNotebook:
    """Stands in for the notebook itself: commands for it (%, !, ?) do nothing.

    But a cell is written to a file, and a file in Python is run: one that a cell has written, or beside the notebook.
    """

    def __init__(self, space: dict[str, Any], folder: Path):
        self.space, self.folder = space, folder

    def run_cell_magic(self, magic: str, line: str, cell: str) -> None:
        if magic == "writefile":
            *options, name = shlex.split(line)
            with open(name, "a" if "-a" in options or "--append" in options else "w", encoding="utf-8") as file:
                file.write(cell)
            importlib.invalidate_caches()

    def run_line_magic(self, magic: str, line: str) -> None:
        """%run FILE: in names of its own, or with -i in those of the notebook, which then has what the file binds."""
        if magic != "run":
            return
        words = shlex.split(line)
        options = {*takewhile(lambda word: word[0] == "-", words)}
        name = next((word for word in words if word not in options), "")
        places = [Path(folder, name + end) for folder in (Path(), self.folder) for end in ("", ".py")]
        path = next((place for place in places if place.is_file()), None)
        if path is None or path.suffix != ".py" or "-m" in options:
            raise ValueError(f"%run {line} is not carried out; only a Python file beside the notebook is")
        sys.argv = [str(path), *words[words.index(name) + 1 :]]
        own = {"__name__": "__main__", "__file__": str(path)}
        names = self.space if "-i" in options else own
        try:
            exec(compile(path.read_text(encoding="utf-8"), str(path), "exec", dont_inherit=True), names)
        finally:
            self.space.update({key: value for key, value in names.items() if key[:2] != "__"})

    def __getattr__(self, name):
        return lambda *arguments, **named: None


class Nowhere(io.RawIOBase):
    """Takes bytes and keeps none."""

    def writable(self):
        return True

    def write(self, given):
        return memoryview(given).nbytes


def nowhere() -> io.TextIOWrapper:
    """A stream for text, with all that one has, that keeps nothing; any text can be written, as into a notebook."""
    return io.TextIOWrapper(io.BufferedWriter(Nowhere()), encoding="utf-8", errors="backslashreplace")


@contextmanager
def quiet() -> Iterator[None]:
    """Nothing that the student's code prints is kept; both streams are new each time, since code may close them."""
    with redirect_stdout(nowhere()), redirect_stderr(nowhere()):
        yield


def end_with(grader: int) -> None:
    """End this process when the one that started it is gone: nobody is left to end what hangs."""
    while os.getppid() == grader:
        time.sleep(0.5)
    os._exit(1)


def main(arguments: list[str]) -> None:
    """Run one submission as the module's text says."""
    parser = argparse.ArgumentParser()
    parser.add_argument("notebook", type=Path)
    parser.add_argument("lesson")
    parser.add_argument("log", type=Path)
    parser.add_argument("--whole", action="store_true")
    parser.add_argument("--skip", action="append", default=[])
    given = parser.parse_args(arguments)
    Thread(target=end_with, args=(os.getppid(),), daemon=True).start()
    # A module beside the notebook is found, as in a notebook, after those that are installed; nothing is written there.
    sys.path.append(str(given.notebook.parent))
    sys.dont_write_bytecode = True
    bench = Bench(given.lesson, given.log, set(given.skip), given.notebook.parent)
    texts = sources(given.notebook)
    read, broken = statements(texts)
    bench.failed |= {cell: f"cannot be read, {sentence}" for cell, sentence in broken.items()}
    wanted = {called(name, exercise) for name, exercise in bench.exercises.items()}
    # The door that the lessons import, rapkm_lite.checks, has not been opened yet: it will show this one.
    door: Any = checker
    door.check = bench.check
    bench.tell(hidden=hides_check(read))
    bench.run(read if given.whole else needed(read, wanted), texts)
    bench.conclude(texts)


if __name__ == "__main__":
    main(sys.argv[1:])
