"""What a lesson must look like: each rule takes a lesson and returns complaints that name cell and what is missing."""

from __future__ import annotations

import ast
import builtins
import re
from dataclasses import dataclass

import minutes
import nbformat
from minutes import DEEPER, HEADING

HIDDEN = "hide-output"
_QUESTION = re.compile(r"^(?:> *)?\*\*(?:Predict|Before you)\b")
_ASKED = re.compile(r"\bbefore you (?:run|look|move|read|open|drag)\b", re.I)
_LIBRARY = re.compile(r"\brk\.([a-zA-Z]\w*)")
_SHOWS = re.compile(r"\bprint\(|\bplot|\bdisplay\(|\bexplore\.|\bfilm\w*\(|\btable\(")
_EXPLORER = re.compile(r"\bdisplay\(|\bexplore\.")


@dataclass
class Lesson:
    """A lesson as its notebook and its number; `earlier` are the lessons that a reader has read before."""

    number: str
    notebook: nbformat.NotebookNode
    earlier: tuple = ()

    @property
    def cells(self) -> list:
        return self.notebook.cells

    def complain(self, cell: int, what: str) -> str:
        return f"lesson {self.number}, cell {cell}: {what}"


def tags(cell) -> list[str]:
    return cell.metadata.get("tags", [])


def paragraphs(cell) -> list[str]:
    return [p for p in re.split(r"\n\s*\n", cell.source) if p.strip()]


def questions(lesson: Lesson) -> list[str]:
    """Whatever answers a question stands out of sight: in ``<details>`` or behind a cell tagged hide-output."""
    found = []
    for k, cell in enumerate(lesson.cells):
        if cell.cell_type != "markdown":
            continue
        blocks = paragraphs(cell)
        asked = [j for j, block in enumerate(blocks) if _QUESTION.match(block)]
        found += [
            lesson.complain(
                k, f"a question in plain prose, begin it with **Predict.** or **Before you run.**: {b[:50]!r}"
            )
            for b in blocks
            if _ASKED.search(b) and "?" in b and not _QUESTION.match(b) and not b.startswith("<details")
        ]
        if not asked:
            continue
        after = "\n\n".join(blocks[asked[-1] + 1 :])
        if after.startswith("<details"):
            continue
        if after:
            found.append(lesson.complain(k, f"text in plain sight under the question: {after[:60]!r}"))
        found += _answered(lesson, k)
    return found


def _answered(lesson: Lesson, k: int) -> list[str]:
    """Complaints about the cells that follow a question in cell k."""
    hidden = False
    for j, cell in enumerate(lesson.cells[k + 1 :], k + 1):
        if cell.cell_type == "markdown":
            first = cell.source.lstrip()
            if first.startswith("<details") or (hidden and (HEADING.match(first.partition("\n")[0]) or _asks(first))):
                return []
            what = "explains in plain sight" if hidden else "nothing to open"
            return [lesson.complain(j, f"{what} after the question of cell {k}; begin with <details>: {first[:50]!r}")]
        if HIDDEN in tags(cell):
            hidden = True
        elif _SHOWS.search(cell.source) and not _EXPLORER.search(cell.source):
            return [lesson.complain(j, f"shows the answer to the question of cell {k}; tag it {HIDDEN}")]
    return [] if hidden else [lesson.complain(k, "a question without an answer")]


def _asks(text: str) -> bool:
    return bool(_QUESTION.match(text))


def folded_parts(lesson: Lesson) -> list[str]:
    """A heading "Dig deeper" stands alone in its cell, is stored folded, and the next heading begins a cell."""
    found, level = [], 0
    for k, cell in enumerate(lesson.cells):
        if cell.cell_type != "markdown":
            continue
        lines = re.sub(r"^```.*?^```", "", cell.source, flags=re.M | re.S).strip().splitlines()
        heads = [(j, HEADING.match(line)) for j, line in enumerate(lines) if HEADING.match(line)]
        for j, head in heads:
            deeper = bool(DEEPER.match(head[0]))
            if deeper and len(lines) > 1:
                found.append(lesson.complain(k, f"{head[2]!r} does not stand alone: its text stays in sight"))
            if deeper and not cell.metadata.get("jp-MarkdownHeadingCollapsed"):
                found.append(lesson.complain(k, f"{head[2]!r} is stored unfolded (run build.py)"))
            if level and len(head[1]) <= level:
                if j:
                    found.append(lesson.complain(k, f"{head[2]!r} ends a folded part, so it must begin a cell"))
                level = 0
            level = len(head[1]) if deeper else level
    return found


def folded_cells(lesson: Lesson) -> set[int]:
    """Numbers of the cells inside folded parts, their headings included."""
    inside, level = set(), 0
    for k, cell in enumerate(lesson.cells):
        head = HEADING.match(cell.source.lstrip().partition("\n")[0]) if cell.cell_type == "markdown" else None
        if head and level and len(head[1]) <= level:
            level = 0
        if head and DEEPER.match(head[0]):
            level = len(head[1])
        if level:
            inside.add(k)
    return inside


def _bound(nodes: list[ast.AST]) -> set[str]:
    """Names that a cell gives a meaning to."""
    names = {n.id for n in nodes if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}
    names |= {n.name for n in nodes if isinstance(n, (ast.FunctionDef, ast.ClassDef))}
    names |= {n.arg for n in nodes if isinstance(n, ast.arg)}
    imports = [n for n in nodes if isinstance(n, (ast.Import, ast.ImportFrom))]
    return names | {(a.asname or a.name).split(".")[0] for n in imports for a in n.names}


def core_stands_alone(lesson: Lesson) -> list[str]:
    """Cells of the core use no name that only a folded part defines."""
    folded, core, aside, found = folded_cells(lesson), set(dir(builtins)), {}, []
    for k, cell in enumerate(lesson.cells):
        if cell.cell_type != "code":
            continue
        nodes = list(ast.walk(ast.parse(re.sub(r"^[%!].*$", "pass", cell.source, flags=re.M))))
        bound = _bound(nodes)
        if k in folded:
            aside |= {name: k for name in bound if name not in aside}
            continue
        used = {n.id for n in nodes if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Load)}
        found += [
            lesson.complain(k, f"uses {name!r}, which only the folded cell {aside[name]} defines")
            for name in sorted(used - bound - core)
            if name in aside
        ]
        core |= bound
    return found


def introduced(lesson: Lesson) -> list[str]:
    """Every ``rk.`` name stands in the prose of this or an earlier lesson before the first cell that uses it."""

    def named(cell) -> set[str]:
        spans = " ".join(re.findall(r"`([^`]+)`", cell.source))
        return set(re.findall(r"\w+", spans))

    known = {n for one in lesson.earlier for c in one.cells if c.cell_type == "markdown" for n in named(c)} | {"load"}
    found = []
    for k, cell in enumerate(lesson.cells):
        if cell.cell_type == "markdown":
            known |= named(cell)
            continue
        for name in sorted(set(_LIBRARY.findall(cell.source)) - known):
            found.append(lesson.complain(k, f"rk.{name} is used before the prose names it (in `code` style)"))
            known.add(name)
    return found


def picture_phrases(lesson: Lesson) -> int:
    """Paragraphs that open with "In the picture"."""
    blocks = [b for c in lesson.cells if c.cell_type == "markdown" for b in paragraphs(c)]
    return sum(bool(re.match(r"[*_]*In the pictures?\b", b)) for b in blocks)


def honest_minutes(lesson: Lesson, core: float = 60.0, share: float = 0.15) -> list[str]:
    """Stated minutes are the estimate within 15 % (or one minute, for short sections); the core fits into an hour."""
    found = minutes.parts(lesson.notebook, lesson.number)
    total, stated = minutes.core(found), minutes.stated(lesson.notebook)
    bad = []
    if total > core:
        bad.append(f"lesson {lesson.number}: the core takes {total:.1f} min; allowed: {core:.0f}, fold or move parts")
    if stated is None or abs(stated - total) > share * total:
        bad.append(f"lesson {lesson.number}, cell 0: states **Minutes:** {stated}, estimated {total:.1f}")
    for part in found[1:]:
        if part.stated is None:
            bad.append(f"lesson {lesson.number}: heading {part.title!r} lacks ({part.minutes:.0f} min)")
        elif abs(part.stated - part.minutes) > max(share * part.minutes, 1.0):
            bad.append(f"lesson {lesson.number}: {part.title!r} states {part.stated} min, estimated {part.minutes:.1f}")
    return bad


RULES = (questions, folded_parts, core_stands_alone, introduced, honest_minutes)
