"""A submitted notebook as statements, and the few of them that the exercises need."""

from __future__ import annotations

import ast
import json
import re
from dataclasses import dataclass
from pathlib import Path

from ..exercise import Exercise

_EXERCISE = re.compile(r"\d\d\.\w+")
_NUMBER = re.compile(r"(?<!\d)(\d\d)_")


@dataclass(frozen=True)
class Statement:
    """One statement at the top level of a code cell; `cell` counts from 0 over all cells of the notebook."""

    cell: int
    number: int
    node: ast.stmt

    @property
    def key(self) -> str:
        return f"{self.cell}.{self.number}"


@dataclass(frozen=True)
class Submission:
    """One notebook of one student; `lesson` is its number as text, "04"."""

    student: str
    path: Path
    lesson: str


def found(folder: Path, known: set[str]) -> list[Submission]:
    """All submissions under a folder: STUDENT/.../04_title.ipynb, or loose notebooks, whose names are the student's.

    known : numbers of the lessons that have exercises.  Notebooks without such a number in their name are left out.
    Raises ValueError when the folder does not exist or holds none.
    """
    if not folder.is_dir():
        raise ValueError(f"submissions = {str(folder)!r}; allowed: a folder that exists")
    submissions = []
    for path in sorted(folder.rglob("*.ipynb")):
        parts = path.relative_to(folder).parts
        numbers = [n for n in _NUMBER.findall(path.name) if n in known]
        if numbers and not any(part.startswith(".") for part in parts):
            student = parts[0] if len(parts) > 1 else path.stem
            submissions.append(Submission(student, path, numbers[-1]))
    if not submissions:
        raise ValueError(f"submissions = {str(folder)!r}; allowed: a folder with notebooks named like 04_title.ipynb")
    return submissions


def sources(path: Path) -> list[str]:
    """Source of every cell, empty for those without code; lines for the notebook itself (%, !) are taken out.

    Raises ValueError when the file is no notebook.
    """
    try:
        cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
        texts = ["".join(cell["source"]) if cell["cell_type"] == "code" else "" for cell in cells]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ValueError(f"{path.name} is no notebook that can be read ({type(error).__name__})") from None
    return [re.sub(r"^(\s*)[%!].*$", r"\1pass", text, flags=re.M) for text in texts]


def statements(texts: list[str]) -> tuple[list[Statement], dict[int, str]]:
    """The statements of all cells, and what keeps a cell from being read, by its number."""
    read, broken = [], {}
    for cell, text in enumerate(texts):
        try:
            body = ast.parse(text).body
        except (SyntaxError, ValueError) as error:
            broken[cell] = f"{type(error).__name__}: {error}"
            continue
        read += [Statement(cell, number, node) for number, node in enumerate(body)]
    return read, broken


def _base(node: ast.AST) -> str:
    """The name in front of dots, brackets and calls."""
    while isinstance(node, ast.Attribute | ast.Subscript | ast.Call):
        node = node.func if isinstance(node, ast.Call) else node.value
    return node.id if isinstance(node, ast.Name) else ""


def _changes(node: ast.stmt) -> set[str]:
    """Names that a statement binds or may change."""
    if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
        return {node.name}
    names = set()
    for part in ast.walk(node):
        if isinstance(part, ast.Name) and isinstance(part.ctx, ast.Store | ast.Del):
            names.add(part.id)
        elif isinstance(part, ast.Attribute | ast.Subscript) and isinstance(part.ctx, ast.Store):
            names.add(_base(part))
        elif isinstance(part, ast.Expr) and isinstance(part.value, ast.Call):
            names.add(_base(part.value))
        elif isinstance(part, ast.FunctionDef | ast.ClassDef):
            names.add(part.name)
    return names


def _uses(node: ast.stmt) -> set[str]:
    return {part.id for part in ast.walk(node) if isinstance(part, ast.Name) and isinstance(part.ctx, ast.Load)}


def _asks(node: ast.stmt) -> bool:
    """True when a statement checks an answer, whatever the name of the function that does."""
    return any(
        (isinstance(part, ast.Name) and part.id == "check")
        or (isinstance(part, ast.Constant) and isinstance(part.value, str) and _EXERCISE.fullmatch(part.value))
        for part in ast.walk(node)
    )


def needed(all_of_them: list[Statement], wanted: set[str]) -> list[Statement]:
    """The statements on which the wanted names and all calls of `check` depend, in their order; imports always."""
    keep: set[int] = set()
    names = set(wanted)
    grown = True
    while grown:
        grown = False
        for i, statement in enumerate(all_of_them):
            node = statement.node
            imports = isinstance(node, ast.Import | ast.ImportFrom)
            if i not in keep and (imports or _asks(node) or _changes(node) & names):
                keep.add(i)
                names |= _uses(node)
                grown = True
    return [all_of_them[i] for i in sorted(keep)]


def called(name: str, exercise: Exercise) -> str:
    """The name that the answer to an exercise has in its lesson."""
    return exercise.called or name.partition(".")[2]
