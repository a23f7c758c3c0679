"""How long a lesson takes: an estimate per section from words, code, formulas, figures and exercises.

    python -m tests.minutes          # all lessons
    python -m tests.minutes 03 04    # some

Words of prose 130 a minute, lines of code 8 a minute, 0.7 minutes per displayed formula, 1.5 per figure, 10 per
exercise.
What stands in ``<details>`` is not counted; parts under a heading "Dig deeper" are counted on their own.
"""

from __future__ import annotations

import re
import sys
from dataclasses import dataclass, field
from pathlib import Path

import nbformat

NOTEBOOKS = Path(__file__).parents[1] / "notebooks"
PER_MINUTE = {"words": 130, "lines": 8}
MINUTES = {"formulas": 0.7, "figures": 1.5, "exercises": 10}
HEADING = re.compile(r"^(#+) +(.*?)(?: *\((\d+) min\))? *$")
DEEPER = re.compile(r"#+ Dig deeper\b")
_FENCE = re.compile(r"^```.*?^```", re.M | re.S)
_FORMULA = re.compile(r"\$\$.*?\$\$|\\begin\{(align|equation|gather)(\*?)\}.*?\\end\{\1\2\}", re.S)
_DETAILS = re.compile(r"<details.*?</details>", re.S)
_CHECK = re.compile(r"\bcheck\(\s*[\"']([\w.]+)[\"']")
_FILM = re.compile(r"\bfilm\w*\(")


def lessons() -> list[Path]:
    """The students' notebooks, in the order of their numbers."""
    return sorted(NOTEBOOKS.glob("[0-9][0-9]_*.ipynb"))


@dataclass
class Part:
    """What is counted of one section, or of one folded part."""

    title: str
    stated: int | None = None
    folded: bool = False
    words: int = 0
    lines: int = 0
    formulas: int = 0
    figures: int = 0
    exercises: int = 0
    names: set = field(default_factory=set)

    @property
    def minutes(self) -> float:
        counted = sum(getattr(self, what) / rate for what, rate in PER_MINUTE.items())
        return counted + sum(getattr(self, what) * each for what, each in MINUTES.items())

    def count_words(self, text: str) -> None:
        """Add the words and formulas of a text."""
        prose = _FENCE.sub(" ", _DETAILS.sub(" ", text))
        self.formulas += len(_FORMULA.findall(prose))
        self.words += sum(any(map(str.isalnum, token)) for token in _FORMULA.sub(" ", prose).split())

    def count_code(self, cell, number: str) -> None:
        """Add the lines, figures and exercises of a code cell of the lesson with this number."""
        self.lines += sum(bool(line.strip()) for line in cell.source.splitlines())
        self.figures += figures(cell)
        self.names |= {name for name in _CHECK.findall(cell.source) if name.startswith(number)}


def figures(cell) -> int:
    """Pictures of a code cell: the stored ones, or before it has run those that metadata and source announce."""
    shown = [o.get("data", {}) for o in cell.outputs]
    if cell.execution_count is not None:
        return sum("image/png" in data or "<img" in data.get("text/html", "") for data in shown)
    alt = cell.metadata.get("alt", [])
    return (1 if isinstance(alt, str) else len(alt)) + len(_FILM.findall(cell.source))


def parts(notebook, number: str) -> list[Part]:
    """Sections of a lesson and its folded parts; the first one is what stands before the first section."""
    section = part = Part("opening")
    found = [section]
    level = 0
    for cell in notebook.cells:
        if cell.cell_type == "code":
            part.count_code(cell, number)
            continue
        for block in _blocks(cell.source):
            heading = HEADING.match(block.partition("\n")[0])
            if heading:
                depth, title, stated = len(heading[1]), heading[2], heading[3]
                if part.folded and depth <= level:
                    part = section
                if DEEPER.match(block):
                    part, level = Part(title, stated and int(stated), folded=True), depth
                    found.append(part)
                elif depth == 2:
                    section = part = Part(title, stated and int(stated))
                    found.append(part)
            part.count_words(block)
    seen: set = set()
    for one in found:
        one.exercises = len(one.names - seen)
        seen |= one.names
    return found


def _blocks(source: str) -> list[str]:
    """A Markdown cell cut before each of its headings, those inside fences excepted."""
    bare = _FENCE.sub(lambda match: re.sub("^#", "\0", match[0], flags=re.M), source)
    return [block.replace("\0", "#") for block in re.split(r"^(?=#+ )", bare, flags=re.M) if block.strip()]


def read(path: Path) -> list[Part]:
    """The parts of the lesson in a file."""
    return parts(nbformat.read(path, as_version=4), path.stem[:2])


def stated(notebook) -> int | None:
    """The minutes that the opening cell states for the core."""
    found = re.search(r"\*\*Minutes:?\*\*:? *(\d+)", notebook.cells[0].source)
    return int(found[1]) if found else None


def core(found: list[Part]) -> float:
    """Minutes of what everybody reads."""
    return sum(part.minutes for part in found if not part.folded)


def table(path: Path) -> str:
    """The estimate of one lesson as text."""
    found, notebook = read(path), nbformat.read(path, as_version=4)
    folded = sum(part.minutes for part in found if part.folded)
    head = f"{path.stem}: core {core(found):.1f} min (stated {stated(notebook)}), folded {folded:.1f} min"
    rows = [f"{'words':>6}{'lines':>6}{'form.':>6}{'fig.':>6}{'exer.':>6}{'min':>7}{'stated':>7}"]
    for part in found:
        counts = "".join(f"{getattr(part, what):6d}" for what in (*PER_MINUTE, *MINUTES))
        rows.append(f"{counts}{part.minutes:7.1f}{part.stated or '–':>7}  {'(folded) ' * part.folded}{part.title}")
    return "\n".join([head, *rows])


if __name__ == "__main__":
    if {"-h", "--help"} & {*sys.argv}:
        sys.exit(print(__doc__))
    for lesson in lessons():
        if not sys.argv[1:] or lesson.stem[:2] in sys.argv[1:]:
            print(table(lesson), end="\n\n")
