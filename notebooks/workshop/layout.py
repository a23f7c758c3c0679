"""A new lesson from the skeleton, and the list of all figures."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import nbformat

from .storing import tidy

NOTEBOOKS = Path(__file__).resolve().parents[1]
SOLUTIONS = NOTEBOOKS / "solutions"
PACKAGE = NOTEBOOKS.parent / "rapkm_lite"


def defined(path: Path) -> list[str]:
    """Public functions and constants that a module defines, without what it imports."""
    body = ast.parse(path.read_text(encoding="utf-8")).body
    names = [node.name for node in body if isinstance(node, ast.FunctionDef)]
    for node in body:
        if isinstance(node, ast.Assign):
            targets = node.targets[0].elts if isinstance(node.targets[0], ast.Tuple) else node.targets
            names += [target.id for target in targets]
    # Constants before functions, as the import sorter has them.
    return sorted((n for n in names if not n.startswith("_")), key=lambda n: (not n.isupper(), n))


def figure_list() -> str:
    """The text of ``rapkm_lite/plotting.py``: every figure of the shared room and of every lesson, by name."""
    shared = set(PACKAGE.glob("figures/[!_]*.py")) - {PACKAGE / "figures/arguments.py"}
    rooms = sorted(shared) + sorted(PACKAGE.glob("lessons/lesson*/figures.py"))
    owner, text = (
        {},
        [
            '"""Every figure under one name: ``plotting.plot_x(..., ax=None) -> ax``; one colour per arm everywhere.',
            "",
            "ax, axes : where to draw, default a new figure; they are returned.  n : samples along a side of a map.",
            "robot : any `Manipulator`.  q : pose (2N,), rad.  offset : (N,) rad.  K_P : N m/rad.  mode : (N,) signs.",
            "pair, pairs : drives, counted from 0.  frames : how many pictures a ready-made film has.",
            "Wrong arguments raise ValueError, as in `rapkm_lite`, and so do poses that cannot be drawn.",
            '"""',
            "",
            "# Written by python notebooks/build.py, for editors and readers; the figures live in the modules below.",
            "",
            "from .figures.arguments import guarded",
        ],
    )
    for path in rooms:
        module = "." + ".".join(path.relative_to(PACKAGE).with_suffix("").parts)
        names = defined(path)
        for name in names:
            if name in owner:
                raise ValueError(f"{name} stands in {owner[name]} and in {module}; allowed: one figure of that name")
            owner[name] = module
        if names:
            line = f"from {module} import {', '.join(names)}"
            long = [f"from {module} import (", *(f"    {name}," for name in names), ")"]
            text += [line] if len(line) <= 120 else long
    text += ["", "__all__ = ["]
    text += [*(f'    "{name}",' for name in sorted(owner)), "]", "", "globals().update(guarded(globals()))", ""]
    return "\n".join(text)


def cells(text: str) -> list[nbformat.NotebookNode]:
    """Cells of a notebook written as text: ``# %%``, or ``# %% [markdown]`` with lines behind ``# ``, begins each one.

    Metadata follow on that line: ``# %% tags=["hide-output"] alt="What is seen."``.
    """
    made = []
    for block in re.split(r"^# %%", text, flags=re.M)[1:]:
        head, _, body = block.partition("\n")
        if "[markdown]" in head:
            made.append(nbformat.v4.new_markdown_cell(re.sub(r"^# ?", "", body, flags=re.M).strip()))
        else:
            metadata = {key: ast.literal_eval(value) for key, value in re.findall(r'(\w+)=(\[.*?\]|".*?")', head)}
            made.append(nbformat.v4.new_code_cell(body.strip(), metadata=metadata))
    return made


def with_row(text: str, rows: str, row: str) -> str:
    """A text with one more row behind the last one that begins like `rows`; without such rows it stays as it is."""
    lines = text.split("\n")
    last = [k for k, line in enumerate(lines) if re.match(rows, line)][-1:]
    return "\n".join(lines[: last[0] + 1] + [row] + lines[last[0] + 1 :]) if last else text


def new(name: str) -> None:
    """Lay out a lesson: its source in ``solutions/``, its room in ``rapkm_lite/lessons/``, answers to its exercises in
    ``tests/answers/``, its lines in the README and in the first notebook.

    Raises ValueError when the name is not like 13_title or its number is taken.
    """
    number, _, words = name.partition("_")
    room = PACKAGE / "lessons" / f"lesson{number}"
    if not re.fullmatch(r"\d\d_[a-z0-9_]+", name):
        raise ValueError(f"name = {name!r}; allowed: a number of two digits and words in small letters, like 13_title")
    if room.exists():
        raise ValueError(f"name = {name!r}, but there is a lesson {number}; allowed: a number that no lesson has")

    def filled(path: Path) -> str:
        return path.read_text(encoding="utf-8").replace("NN", number).replace("TITLE", words.replace("_", " "))

    skeleton = NOTEBOOKS / "skeleton"
    room.mkdir()
    (room / "__init__.py").write_text(f'"""Lesson {number}: {words.replace("_", " ")}."""\n', encoding="utf-8")
    for part in ("figures.py", "exercises.py"):
        (room / part).write_text(filled(skeleton / part), encoding="utf-8")
    answers = NOTEBOOKS.parent / "tests/answers" / f"answers{number}.py"
    answers.write_text(filled(skeleton / "answers.py"), encoding="utf-8")
    notebook = nbformat.v4.new_notebook(cells=cells(filled(skeleton / "lesson.py")))
    tidy(notebook)
    nbformat.write(notebook, SOLUTIONS / f"{name}.ipynb")
    question = notebook.cells[0].source.splitlines()[0].removeprefix("# ").partition(" · ")[2]
    readme, start = NOTEBOOKS.parent / "README.md", NOTEBOOKS / "00_start_here.ipynb"
    text = readme.read_text(encoding="utf-8")
    row = f"| [{name}](notebooks/{name}.ipynb) | {question} | 46 | – | – |"
    readme.write_text(with_row(text, r"\| \[\d\d_", row), encoding="utf-8")
    first = nbformat.read(start, as_version=4)
    for cell in first.cells:
        row = f"| [{number} {words.replace('_', ' ')}]({name}.ipynb) | {question} | 46 |"
        cell.source = with_row(cell.source, r"\| \[\d\d [^]]+\]\(\d\d_", row)
    nbformat.write(first, start)
    (PACKAGE / "plotting.py").write_text(figure_list(), encoding="utf-8")
    print(f"Edit notebooks/solutions/{name}.ipynb and rapkm_lite/lessons/lesson{number}/,")
    print(f"then run: python notebooks/build.py {number} teaching")
