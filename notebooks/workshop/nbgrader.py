"""The lessons as nbgrader's source: exercises as solution cells, each check in a locked cell of its own with points.

An assignment is a folder of its own, and nbgrader hands out all of it: the pages that a lesson links to lie beside it.
``nbgrader generate_assignment`` and ``nbgrader autograde`` run on what ``export`` writes.
"""

from __future__ import annotations

import ast
import re
from pathlib import Path

import nbformat

from rapkm_lite.checks import exercises

from .layout import NOTEBOOKS, SOLUTIONS
from .storing import HIDDEN, unchecked

# Come back when nbgrader grades: the check is the package's own, and a wrong answer raises, but only after the check
# has bound what the lesson goes on with, for an exercise that builds on this one.
_BEFORE = """### BEGIN HIDDEN TESTS
from rapkm_lite.checks import check
### END HIDDEN TESTS
"""
_BEHIND = """
### BEGIN HIDDEN TESTS
from rapkm_lite.lessons.checker import own_answer
assert own_answer("{name}")[0] in ("ok", "close"), "{name} is not right yet; the line above says why"
### END HIDDEN TESTS
"""
_REGION = re.compile(r"^### BEGIN SOLUTION *\n(.*?)^### END SOLUTION", re.M | re.S)
_LINK = re.compile(r"(?<!!)\[([^\]\n]+)\]\(([^)\s]+)\)")
PAGES = ("equations.md", "errata.md")
CONFIG = """c = get_config()
c.CourseDirectory.course_id = "rapkm_lite"
c.ExecutePreprocessor.timeout = 120
c.ClearSolutions.code_stub = {"python": "# YOUR CODE HERE\\n..."}
"""


def marked(cell: nbformat.NotebookNode, grade_id: str, points: float | None = None) -> nbformat.NotebookNode:
    """The cell with nbgrader's metadata: graded and locked when it has points, else the place for a solution."""
    graded = points is not None
    cell.metadata["nbgrader"] = {
        "schema_version": 3,
        "grade_id": grade_id.replace(".", "-"),
        "grade": graded,
        "solution": not graded,
        "locked": graded,
        "task": False,
        **({"points": points} if graded else {}),
    }
    return cell


def split(source: str) -> tuple[str, list[tuple[str, str]], str]:
    """What stands before the checks of a cell, each check with the name of its exercise, and what stands behind."""
    lines = source.splitlines(keepends=True)
    checks = []
    for node in ast.parse(source).body:
        call = getattr(node, "value", None)
        if isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id == "check":
            name = ast.literal_eval(call.args[0])
            checks.append((name, node.lineno - 1, node.end_lineno or node.lineno))
    if not checks:
        return source, [], ""
    first, last = checks[0][1], checks[-1][2]
    texts = [(name, "".join(lines[start:end])) for name, start, end in checks]
    return "".join(lines[:first]).rstrip(), texts, "".join(lines[last:]).strip()


def blanks(source: str) -> str:
    """Names that a solution outside a function assigns are `...` before it, so that the lesson runs without it."""

    def with_blanks(match: re.Match) -> str:
        names = dict.fromkeys(re.findall(r"^(\w+) *=[^=]", match[1], re.M))
        return "".join(f"{name} = ...\n" for name in names) + match[0]

    return _REGION.sub(with_blanks, source)


def linked(source: str) -> str:
    """Links to the pages beside the lesson hold; those to other lessons, which may not be handed out, become words."""

    def keep(link: re.Match) -> str:
        target = link[2].removeprefix("../")
        if target.partition("#")[0] in PAGES:
            return f"[{link[1]}]({target})"
        return link[0] if re.match("[a-z]+:|#", target) else link[1]

    return _LINK.sub(keep, source)


def assignment(lesson: nbformat.NotebookNode) -> nbformat.NotebookNode:
    """The solved lesson as nbgrader's instructor version, without outputs."""
    copy = nbformat.reads(nbformat.writes(lesson), as_version=4)
    points = {name: exercise.points for name, exercise in exercises().items()}
    cells = []
    for cell in copy.cells:
        if cell.cell_type != "code":
            cell.source = linked(cell.source)
            cells.append(cell)
            continue
        cell.outputs, cell.execution_count = [], None
        if HIDDEN in cell.metadata.get("tags", []):
            cell.source = unchecked(cell.source)
        body, checks, rest = split(cell.source)
        if not checks and "### BEGIN SOLUTION" not in cell.source:
            cells.append(cell)
            continue
        cell.source = blanks(body)
        if body:
            cells.append(marked(cell, f"{checks[0][0]}.answer" if checks else f"solution.{len(cells)}"))
        for name, text in checks:
            tested = _BEFORE + text.rstrip() + _BEHIND.format(name=name)
            cells.append(marked(nbformat.v4.new_code_cell(tested), name, points[name]))
        if rest:
            cells.append(nbformat.v4.new_code_cell(rest))
    for number, cell in enumerate(cells):
        cell.id = f"cell-{number:02d}"
    copy.cells = cells
    return copy


def export(folder: Path, wanted: list[str]) -> list[Path]:
    """Write FOLDER/source/04_title/04_title.ipynb for the lessons whose names begin so, and nbgrader's settings.

    Returns the notebooks.  Raises ValueError for a word with which no name begins.
    """
    names = [path.name for path in sorted(SOLUTIONS.glob("*.ipynb"))]
    for word in wanted:
        if not any(name.startswith(word) for name in names):
            raise ValueError(f"lesson = {word!r}; allowed: {', '.join(name[:2] for name in names)}")
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "nbgrader_config.py").write_text(CONFIG, encoding="utf-8")
    made = []
    for path in sorted(SOLUTIONS.glob("*.ipynb")):
        if not wanted or any(path.name.startswith(word) for word in wanted):
            place = folder / "source" / path.stem
            place.mkdir(parents=True, exist_ok=True)
            nbformat.write(assignment(nbformat.read(path, as_version=4)), place / path.name)
            for page in PAGES:
                text = (NOTEBOOKS / page).read_text(encoding="utf-8")
                (place / page).write_text(linked(text), encoding="utf-8")
            made.append(place / path.name)
    return made
