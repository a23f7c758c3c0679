"""Pages for teachers that follow from the lessons: minutes, objectives, questions with answers, named mistakes."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import nbformat

from .layout import NOTEBOOKS
from .storing import COVER, HIDDEN

TEACHING = NOTEBOOKS.parent / "docs" / "teaching"
_HEADING = re.compile(r"^(##+) +(.*?)(?: *\((\d+) min\))? *$", re.M)
_CHECK = re.compile(r"\bcheck\(\s*[\"']([\w.]+)[\"']")
_QUESTION = re.compile(r"^\*\*(?:Predict|Before you)[^*]*\*\*")
_DETAILS = re.compile(r"<details>\s*<summary>.*?</summary>(.*?)</details>", re.S)
WRITTEN = "<!-- Written by python notebooks/build.py teaching. -->\n"


def lessons() -> dict[str, nbformat.NotebookNode]:
    """The students' notebooks by their number."""
    found = sorted(NOTEBOOKS.glob("[0-9][0-9]_*.ipynb"))
    return {path.stem[:2]: nbformat.read(path, as_version=4) for path in found}


def course() -> dict:
    """What `course.toml` says."""
    return tomllib.loads((TEACHING / "course.toml").read_text(encoding="utf-8"))


def title(notebook) -> str:
    return notebook.cells[0].source.splitlines()[0].removeprefix("# ")


def headings(notebook) -> list[tuple[str, str, str]]:
    """(marks, heading, minutes) of the sections and of the folded parts."""
    text = "\n".join(c.source for c in notebook.cells if c.cell_type == "markdown")
    text = re.sub(r"^```.*?^```", "", text, flags=re.M | re.S)
    return [m.groups("–") for m in _HEADING.finditer(text) if m[1] == "##" or m[2].startswith("Dig deeper")]


def sections_of_exercises(notebook) -> dict[str, str]:
    """Exercise -> the heading it stands under, of a section or a folded part."""
    here, section, found = "", "", {}
    for cell in notebook.cells:
        if cell.cell_type == "code":
            for name in _CHECK.findall(cell.source):
                found.setdefault(name, here)
            continue
        for level, heading, _ in _HEADING.findall(cell.source):
            section = heading if level == "##" else section
            # A folded part ends where an exercise has a heading of the same level.
            if heading.startswith("Dig deeper"):
                here = heading
            elif level == "##" or (level == "###" and heading.startswith("Exercise")):
                here = section
    return found


def minutes_page() -> str:
    """Minutes per section as the headings state them."""
    text = [
        WRITTEN,
        "# Minutes per section\n",
        "The minutes are an estimate, not timed in a class: `python -m tests.minutes` counts 130 words of prose or 8",
        "lines of code a minute, 0.7 minutes for a displayed formula, 1.5 for a figure and 10 for an exercise; a",
        "heading may differ from its count by a minute or by 15 %. The core is what everybody reads. It is not the sum",
        "of its sections, because the opening, which has no heading, takes two to six minutes more, and every number",
        "is rounded by itself. Folded parts, in italics, and folded answers are not in the core.\n",
    ]
    for notebook in lessons().values():
        core = re.search(r"\*\*Minutes:?\*\*:? *(\d+)", notebook.cells[0].source)
        text += [
            f"## {title(notebook)}\n",
            f"Core: {core[1] if core else '–'} minutes.\n",
            "| section | minutes |",
            "|---|--:|",
        ]
        text += [f"| {'*' * (m != '##')}{heading}{'*' * (m != '##')} | {n} |" for m, heading, n in headings(notebook)]
        text.append("")
    return "\n".join(text)


def map_page() -> str:
    """Objective, section, exercise and exam item, side by side."""
    text = [
        WRITTEN,
        "# Objectives, sections, exercises, exam items\n",
        "| lesson | objective | section | exercise | exam |",
        "|---|---|---|---|---|",
    ]
    read = lessons()
    for row in course()["objective"]:
        notebook, names = read[row["lesson"]], row.get("exercises", [])
        places = [sections_of_exercises(notebook).get(name, "–") for name in names]
        wanted = row.get("section", "").lower()
        places += [heading for _, heading, _ in headings(notebook) if wanted and wanted in heading.lower()][:1]
        exam = ", ".join(map(str, row["exam"]))
        shown = "; ".join(dict.fromkeys(places))
        text.append(f"| {row['lesson']} | {row['what']} | {shown} | {', '.join(f'`{n}`' for n in names)} | {exam} |")
    return "\n".join([*text, ""])


def mistakes_page() -> str:
    """The mistakes that the checks call by name."""
    from rapkm_lite.checks import exercises

    kinds = course()["kinds"]
    text = [
        WRITTEN,
        "# What students get wrong\n",
        "For each exercise the mistakes that its check calls by name. Besides these every check knows the",
        "opposite sign, transposed answers, wrong units (factors 1000 and $180/\\pi$), rows or entries in another",
        "order, a forgotten factor, another frame, and the complement of the right answer. The table at the end of",
        "`python -m rapkm_lite grade SUBMISSIONS --csv FILE` says which of them a class makes most often. The",
        "sentences stand here as students read them in the notebook, in plain letters: A^T is the transpose, Gbar",
        "is $\\bar G$.\n",
    ]
    for name, exercise in sorted(exercises().items()):
        points = f"{exercise.points:g} points"
        text += [f"## {name}\n", f"Kind: {kinds.get(name, 'design' if exercise.judge else 'derive')}, {points}.\n"]
        sentences = [*exercise.mistakes, exercise.near, exercise.partly]
        text += [f"- {sentence}" for sentence in sentences if sentence] or [
            "Its check compares with limits, or with the log."
        ]
        text.append("")
    return "\n".join(text)


def _said_before(blocks: list[str], question: str) -> list[str]:
    """The paragraph that a question follows in its cell, which may hold what it asks about."""
    before = blocks[blocks.index(question) - 1] if blocks.index(question) else ""
    plain = before and "</details>" not in before and not re.match(r"#|>|[-*|] |\d+\. |<|\$\$|\*\*", before)
    return [before, ""] if plain else []


def _printed(cells) -> str:
    """What the next cell with a hidden output prints."""
    outputs = [o for c in cells if HIDDEN in c.metadata.get("tags", []) for o in c.outputs]
    text = next((o.text for o in outputs if o.output_type == "stream" and o.text != COVER), "")
    return f"```\n{text.removeprefix(COVER).strip()}\n```" if text else "The cell that follows draws the answer."


def _asked(cells) -> list[str]:
    """Lines with the questions in the first one of these cells, and their answers."""
    source, text = cells[0].source, []
    blocks = re.split(r"\n\s*\n", source)
    asked = [block for block in blocks if _QUESTION.match(block)]
    behind = "\n".join(c.source for c in cells if c.cell_type == "markdown")
    # Each question has the next answer behind it; questions in a row share theirs.
    found = [_DETAILS.search(behind, source.find(block)) for block in asked]
    for block, one, other in zip(asked, found, [*found[1:], None], strict=False):
        text += [*_said_before(blocks, block), block]
        if not (one and other and one.start() == other.start()):
            answer = one[1].strip() if one else _printed(cells)
            text += ["", "> " + answer.replace("\n", "\n> "), ""]
    return text


def predictions_page() -> str:
    """Every question of the lessons with the answer that stands folded behind it."""
    text = [WRITTEN, "# Questions inside the lessons, with their answers\n"]
    for notebook in lessons().values():
        text.append(f"## {title(notebook)}\n")
        for k, cell in enumerate(notebook.cells):
            text += _asked(notebook.cells[k : k + 5]) if cell.cell_type == "markdown" else []
    return re.sub(r"\]\((?![a-z]+:|#)", "](../../notebooks/", "\n".join(text))


PAGES = {"minutes": minutes_page, "map": map_page, "mistakes": mistakes_page, "predictions": predictions_page}


def write() -> list[Path]:
    """Write the pages that follow from the lessons."""
    written = []
    for name, page in PAGES.items():
        path = TEACHING / f"{name}.md"
        path.write_text(page().rstrip() + "\n", encoding="utf-8")
        written.append(path)
    return written
