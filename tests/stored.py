"""What a lesson must store: each rule takes a lesson and returns complaints that name cell and what is missing."""

from __future__ import annotations

import re

import nbformat
from shape import HIDDEN, Lesson, tags

LARGEST = 1_200_000  # bytes of a notebook
COMPARED = "nbval-check-output"


def pictures(cell) -> list[dict]:
    """Data of the stored outputs of a cell that show a picture."""
    shown = [o.get("data", {}) for o in cell.get("outputs", [])]
    return [data for data in shown if "image/png" in data or "<img" in data.get("text/html", "")]


def printed(cell) -> str:
    """The stored text of a code cell."""
    return "".join(o.get("text", "") or o.get("data", {}).get("text/plain", "") for o in cell.get("outputs", []))


def hidden_outputs(lesson: Lesson, cover: str) -> list[str]:
    """Hidden outputs are stored closed and begin with a line that is not the answer; checks are never hidden."""
    found = []
    for k, cell in enumerate(lesson.cells):
        if cell.cell_type != "code" or HIDDEN not in tags(cell):
            continue
        if "check(" in cell.source:
            found.append(lesson.complain(k, "the verdict of a check is hidden"))
        if not cell.metadata.get("jupyter", {}).get("outputs_hidden"):
            found.append(lesson.complain(k, "the hidden output is stored open (run build.py)"))
        elif cell.outputs and not cell.outputs[0].get("text", "").startswith(cover):
            found.append(lesson.complain(k, "its first line, which JupyterLab shows of a hidden output, is the answer"))
    return found


def alternative_text(lesson: Lesson) -> list[str]:
    """Every stored picture has words of its own; no words without a picture."""
    found, said = [], {}
    for k, cell in enumerate(lesson.cells):
        if cell.cell_type != "code" or cell.execution_count is None:
            continue
        shown = pictures(cell)
        alt = cell.metadata.get("alt", [])
        alt = [alt] if isinstance(alt, str) else alt
        if len(alt) > len(shown):
            found.append(lesson.complain(k, f"{len(alt)} texts in metadata.alt for {len(shown)} pictures"))
        if shown and COMPARED in tags(cell):
            found.append(lesson.complain(k, f"a picture in a cell tagged {COMPARED}; print in a cell of its own"))
        for data in shown:
            words = re.findall(r"<img\b[^>]*?\balt=\"([^\"]*)\"", data.get("text/html", ""), re.S)
            text = words[0].strip() if words else ""
            if len(text.split()) < 4:
                found.append(lesson.complain(k, f"a picture without alternative text (metadata.alt), found {text!r}"))
            elif text in said:
                found.append(lesson.complain(k, f"the picture says the same as that of cell {said[text]}"))
            said.setdefault(text, k)
    return found


def in_order(lesson: Lesson) -> list[str]:
    """Outputs come from one run in order, without warnings, and the notebook is not too large."""
    found, ran = [], [(k, c) for k, c in enumerate(lesson.cells) if c.cell_type == "code"]
    if all(cell.execution_count is None for _, cell in ran):
        return [f"lesson {lesson.number} was never run (run build.py)"]
    for want, (k, cell) in enumerate(ran, 1):
        if cell.execution_count != want:
            found.append(lesson.complain(k, f"execution count {cell.execution_count} instead of {want} (run build.py)"))
        if any(o.get("name") == "stderr" for o in cell.outputs):
            found.append(lesson.complain(k, "stores a warning"))
    size = len(nbformat.writes(lesson.notebook).encode())
    if size > LARGEST:
        found.append(f"lesson {lesson.number}: {size / 1e6:.2f} MB; allowed: {LARGEST / 1e6:.1f} MB")
    return found


def no_hints(lesson: Lesson, hints: dict[str, tuple[str, ...]]) -> list[str]:
    """No hint is stored that nobody asked for, and an untried exercise says so in one line, once."""
    found, todo = [], {}
    for k, cell in enumerate(lesson.cells):
        if cell.cell_type != "code":
            continue
        text = printed(cell)
        for name, steps in hints.items():
            if any(step and step in text for step in steps):
                found.append(lesson.complain(k, f"a hint for {name} is stored"))
        for line in text.splitlines():
            if line.startswith("TODO "):
                name, _, rest = line.removeprefix("TODO ").partition(": ")
                todo.setdefault(name, []).append(k)
                if rest != "not yet":
                    found.append(lesson.complain(k, f"an untried exercise says more than 'not yet': {line!r}"))
    found += [lesson.complain(k[1], f"TODO {name} for the second time") for name, k in todo.items() if len(k) > 1]
    return found
