"""Slides of a lesson: one HTML file from its headings, formulas, pictures, questions and exercises; nothing is loaded.

Formulas become MathML, which browsers show by themselves.  Folded parts are left out.  Each question keeps its answers,
closed: on its own slide, or on one behind it where the picture of an explorer comes first.
"""

from __future__ import annotations

import html
import re
from dataclasses import dataclass, field
from pathlib import Path

import mistune
import nbformat
from latex2mathml.converter import convert

from .pictures import PNG, pictures, spoken
from .storing import COVER, HIDDEN

_MATH = re.compile(r"\$\$(.+?)\$\$|(?<![\\$])\$([^$\n]+(?:\n[^$\n]+)?)\$", re.S)
_HEADING = re.compile(r"^(#+) +(.*?)(?: *\(\d+ min\))? *$")
_QUESTION = re.compile(r"\*\*(?:Predict|Before you)\b")
_EXERCISE = re.compile(r"(?:### |\*\*)Exercise\b")
_DETAILS = re.compile(r"(<details>.*?</details>)", re.S)
_PAGE = Path(__file__).with_name("deck.html")
_markdown = mistune.create_markdown(escape=False, plugins=["table", "strikethrough"])


def mathml(formula: str, block: bool) -> str:
    """A LaTeX formula as MathML."""
    plain = re.sub(r"\\tag\{(.*?)\}", r"\\qquad\\text{(\1)}", formula.strip())
    plain = plain.replace("{gather}", "{matrix}")  # latex2mathml knows no lines of formulas
    plain = plain.replace("''", r"^{\prime\prime}")  # else the second prime stands beyond the index, raised once more
    return convert(plain, display="block" if block else "inline")


def rendered(source: str) -> str:
    """Markdown with formulas as HTML without links, which a projector does not follow."""
    formulas: list[str] = []

    def hold(match: re.Match) -> str:
        formulas.append(mathml(match[1] or match[2], block=bool(match[1])))
        return f"\x02{len(formulas) - 1}\x03"

    page = str(_markdown(_MATH.sub(hold, source)))
    # No line begins with the comma after a formula.
    page = re.sub("(\x02\\d+\x03[.,;:!?)]+)", r'<span class="whole">\1</span>', page)
    page = re.sub("\x02(\\d+)\x03", lambda match: formulas[int(match[1])], page)
    return re.sub(r"</?a\b[^>]*>", "", page)


@dataclass
class Slide:
    """One slide: its kind (title, section, question, answer, picture, exercise), heading and parts as HTML."""

    kind: str
    heading: str
    parts: list[str] = field(default_factory=list)

    def page(self) -> str:
        head = "h1" if self.kind == "title" else "h2"
        inner = "\n".join(self.parts)
        return f'<section class="{self.kind}">\n<{head}>{rendered(self.heading)[3:-5]}</{head}>\n{inner}\n</section>'


def shown(output: nbformat.NotebookNode) -> str:
    """A stored picture as HTML with its words below."""
    words, page = spoken(output), output.data.get("text/html", "")
    if not words:
        page = f'<img alt="" src="data:image/png;base64,{output.data[PNG]}">'
    caption = f"<figcaption>{html.escape(words)}</figcaption>" if words else ""
    return f"<figure>{page}{caption}</figure>"


def closed(cell: nbformat.NotebookNode) -> str:
    """The outputs of a hidden cell, to be opened."""
    parts = []
    for output in cell.outputs:
        if output in pictures(cell):
            parts.append(shown(output))
        elif "text/html" in output.get("data", {}):
            parts.append(output.data["text/html"])
        else:
            text = output.get("text", "") or output.get("data", {}).get("text/plain", "")
            text = text.removeprefix(COVER).strip()
            parts += [f"<pre>{html.escape(text)}</pre>"] if text else []
    return f"<details><summary>Answer</summary>\n{''.join(parts)}\n</details>" if parts else ""


def core(cells: list[nbformat.NotebookNode]) -> list[nbformat.NotebookNode]:
    """The cells outside folded parts."""
    kept, level = [], 0
    for cell in cells:
        head = _HEADING.match(cell.source.lstrip().partition("\n")[0]) if cell.cell_type == "markdown" else None
        if head and level and len(head[1]) <= level:
            level = 0
        if head and head[2].startswith("Dig deeper"):
            level = len(head[1])
        if not level:
            kept.append(cell)
    return kept


def blocks(source: str) -> list[str]:
    """Paragraphs, lists and formulas of a Markdown cell, each folded remark in one piece."""
    pieces = _DETAILS.split(source)
    cut = [[piece] if k % 2 else re.split(r"\n\s*\n", piece) for k, piece in enumerate(pieces)]
    return [block.strip() for piece in cut for block in piece if block.strip()]


class _Deck:
    """Slides as they grow from cell to cell."""

    def __init__(self) -> None:
        self.slides: list[Slide] = []
        self.section = ""
        self.fresh = False  # nothing but the heading stands on the slide of the section so far
        self.task = False  # the rest of the cell belongs to an exercise
        self.asked: Slide | None = None  # the question that an answer belongs to
        self.left_out = ""  # the paragraph just before, if it is on no slide

    def add(self, kind: str, heading: str, *parts: str) -> None:
        # The next slide has the heading, too.
        if self.slides and self.slides[-1].kind == "section" and not self.slides[-1].parts:
            self.slides.pop()
        self.slides.append(Slide(kind, heading, [part for part in parts if part]))
        self.fresh, self.task, self.left_out = False, kind == "exercise", ""
        if kind not in ("picture", "answer"):
            self.asked = self.slides[-1] if kind == "question" else None

    def answer(self, part: str, behind: bool = False) -> None:
        """Something closed for the question asked last in this section, or `behind` a picture for that picture."""
        last = self.slides[-1] if self.slides else None
        if last is None or not (self.asked or (behind and last.kind == "picture")):
            return
        if self.asked and last.kind == "picture":
            self.add("answer", self.section, f'<div class="asked">{self.asked.parts[0]}</div>', part)
        else:
            last.parts.append(part)

    def prose(self, source: str) -> None:
        for number, block in enumerate(blocks(source)):
            if block.startswith("<details"):
                self.answer(rendered(block), behind=number == 0)
            else:
                self.block(block)
        self.task = False

    def block(self, block: str) -> None:
        head = _HEADING.match(block.partition("\n")[0])
        if head and len(head[1]) <= 2:
            self.section = head[2]
            self.add("title" if len(head[1]) == 1 else "section", head[2])
            self.fresh = True
        elif _EXERCISE.match(block):
            self.add("exercise", self.section, rendered(re.sub(r"^#+ (.*)\n?", r"**\1**\n\n", block)))
        elif _QUESTION.match(block):
            # What is asked about may have been said just before.
            self.add("question", self.section, rendered(f"{self.left_out}\n\n{block}"))
        elif self.slides and (self.fresh or self.task or self._belongs(block)):
            self.slides[-1].parts.append(rendered(block))
            self.fresh, self.left_out = False, ""
        else:
            self.left_out = "" if block.startswith(">") else block

    def _belongs(self, block: str) -> bool:
        """Formulas, lists and tables stay on the slides of title and sections."""
        kind = self.slides[-1].kind
        return kind in ("title", "section") and bool(re.match(r"\$\$|[-*\d|]|.*\n\$\$", block)) and len(block) < 900

    def code(self, cell: nbformat.NotebookNode) -> None:
        self.left_out = ""
        if HIDDEN in cell.metadata.get("tags", []):
            if self.asked and (part := closed(cell)):
                self.answer(part)
            return
        for output in pictures(cell):
            self.add("picture", self.section, shown(output))


def slides(notebook: nbformat.NotebookNode) -> list[Slide]:
    """The slides of a lesson."""
    deck = _Deck()
    for cell in core(notebook.cells):
        if cell.cell_type == "code":
            deck.code(cell)
        else:
            deck.prose(cell.source)
    return deck.slides


def page(notebook: nbformat.NotebookNode) -> str:
    """The HTML page with all slides of a lesson."""
    made = slides(notebook)
    title = html.escape(made[0].heading)
    body = "\n".join(slide.page() for slide in made)
    return _PAGE.read_text(encoding="utf-8").replace("{title}", title).replace("{slides}", body)
