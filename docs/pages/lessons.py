"""Lessons as pages: anchors of the equations, words for pictures, links that hold on the site."""

from __future__ import annotations

import html
import json
import re
from pathlib import Path

WIDGET = "application/vnd.jupyter.widget-view+json"
WORDS = {"equations.md": "the equation index", "errata.md": "the errata", "dashboard.ipynb": "the dashboard"}
# A row of the index: its anchor and number, and further on the lesson that explains it.
ROW = re.compile(r'<a id="(eq-\d+|table-1)"></a>.*?\| (\d\d_\w+) \|')


def lesson_of_equation(index: str) -> dict[str, str]:
    """The lesson that the equation index names for each anchor."""
    return {row[1]: row[2] for row in map(ROW.search, index.splitlines()) if row}


def linked(text: str) -> str:
    """Links to an anchor inside another page, as HTML: the anchors are no headings, which MyST would look for.

    A link whose words are the name of a file in the repository says on the site what the page is.
    """
    text = re.sub(r"\[(?:\w+/)*(\w+\.\w+)\](?=\([\w./]*\1\))", lambda name: f"[{WORDS.get(name[1], name[1])}]", text)
    # In the repository the lessons are in notebooks, one or two folders up; on the site in lessons, one up.
    text = re.sub(r"\]\((?:\.\./)+notebooks/(?=\w+\.(?:md|ipynb))", "](../lessons/", text)
    pattern = re.compile(r"\[([^\]\n]+)\]\(([\w./-]+)\.(?:md|ipynb)#([\w-]+)\)")
    return pattern.sub(r'<a href="\2.html#\3">\1</a>', text)


def index_page(text: str, functions: dict[str, str]) -> str:
    """The equation index, a block per equation instead of a wide table, with links to lessons and reference.

    functions : page of the reference by public name.
    """
    lines = []
    for line in linked(text).splitlines():
        if line.startswith("| eq. |"):
            continue
        if ROW.search(line):
            lines += _block(*(part.strip() for part in line.strip("| ").split(" | ")), functions)
        elif lines and lines[-1] == "" and re.match(r"\|---\|---\|---\|---\|---\|---\|", line):
            continue
        else:
            # The lesson of a figure or a section.
            lines.append(re.sub(r"\| ((\d\d)_\w+) \|$", r"| [lesson \2](\1.ipynb) |", line))
    return "\n".join(lines) + "\n"


def _block(number, printed, meaning, names, lesson, test, functions) -> list[str]:
    """One equation: its number and words, its formula, and where it is explained, evaluated and tested."""
    anchor = re.search(r'id="([\w-]+)"', number)[1]
    formulas = [f"{formula.strip()}\n" for formula in printed.split("<br>")]
    links = re.sub(r"`([\w.]+)`", lambda name: _to_reference(name[1], functions), names)
    place = f'<a href="{lesson}.html#{anchor}">lesson {lesson[:2]}</a>'
    return [
        "",
        f"{number} **{meaning}**",
        "",
        ":::{container} formula",
        *formulas,
        ":::",
        "",
        f"{place} · {links} · {test}",
        "",
    ]


def errata_page(text: str) -> str:
    """The errata, a block per row instead of a table of six columns, which no screen is wide enough for."""
    lines = []
    for line in linked(text).splitlines():
        if re.match(r"\| where \||\|(---\|)+$", line):
            continue
        lines += _erratum(*line.strip("| ").split(" | ")) if line.startswith("|") else [line]
    return "\n".join(lines) + "\n"


def _erratum(where, mark, printed, why, correct, test) -> list[str]:
    """One place of the print: what stands there, why not or what is sharper, what is right, and the test."""
    # As targets of MyST the anchors take precedence over those that Sphinx makes of the headings.
    targets = [f"({anchor})=" for anchor in re.findall(r'<a id="([\w-]+)"></a>', where)]
    title = f"## Section {re.sub('<.*>', '', where)} {mark}"
    said = {"Printed": printed, "Why" if mark == "✗" else "Sharper": why, "Correct": correct, "Test": test}
    return ["", *targets, title, "", *(f"- *{k}:* {v}" for k, v in said.items() if v != "–"), ""]


def _to_reference(name: str, functions: dict[str, str]) -> str:
    page = functions.get(name.split(".")[0])
    return f'<a href="../reference/{page}.html#rapkm_lite.{name}"><code>{name}</code></a>' if page else f"`{name}`"


def places(cells: list[dict], anchors: list[str]) -> dict[int, list[str]]:
    """Anchors of equations by the Markdown cell where each is written out, or else first named."""
    found: dict[int, list[str]] = {}
    for anchor in anchors:
        hits = (_first(cells, pattern) for pattern in _patterns(anchor))
        found.setdefault(next(k for k in hits if k is not None), []).append(anchor)
    return found


def _patterns(anchor: str) -> list[str]:
    """What to look for, best first; the last one is the title of every lesson."""
    if anchor == "table-1":
        return ["Table 1", "^# "]
    n = int(anchor.removeprefix("eq-"))
    pairs = [(a, b) for a in range(max(1, n - 6), n + 1) for b in range(n, n + 7) if a < b]
    ranges = "|".join(rf"\({a}\)–\({b}\)" for a, b in pairs)
    displayed = [rf"\\tag\{{[^}}]*\b{n}\b", rf"\$\$[^$]*\({n}\)[^$]*\$\$"]
    in_the_line = rf"\$[^$\n]+=[^$\n]+\$,? \({n}\)"
    return [*displayed, in_the_line, rf"\({n}\)", ranges, "^# "]


def _first(cells, pattern: str) -> int | None:
    markdown = ((k, "".join(cell["source"])) for k, cell in enumerate(cells) if cell["cell_type"] == "markdown")
    return next((k for k, text in markdown if re.search(pattern, text)), None)


# Below the title of a lesson; a link to the lesson in the browser takes its place, if the site gets them.
STILL = (
    '<p>On this page pictures are still: <a href="../run.html">run the lessons</a> to move them, or drag the machine '
    'on the <a href="../index.html">start page</a>.</p>'
)


def lesson_page(path: Path, anchors: list[str], depth: str = "") -> str:
    """A notebook for the site.

    anchors : of the equations that are explained here.  depth : the way from its page to the folder of the index; the
    pages of solutions have one, and say in their titles what they are.
    """
    notebook = json.loads(path.read_text(encoding="utf-8"))
    cells = notebook["cells"]
    found = places(cells, anchors)
    for k, cell in enumerate(cells):
        text = "".join(cell["source"])
        if cell["cell_type"] == "markdown":
            marks = "".join(
                f'<a id="{a}" href="{depth}equations.html#{a}">{_label(a)} in the index</a>\n' for a in found.get(k, [])
            )
            text = linked(text).replace("](solutions)", "](solutions/index.md)")
            if depth:
                text = re.sub(r"\A# ", "# Solution ", text)
            # A heading stays the first line of its cell.
            head, rest = re.match(r"(#[^\n]*\n?)?(.*)", text, re.DOTALL).groups()
            below = f'<div class="to-index">\n{marks}</div>\n\n' if marks else ""
            below = f"{STILL}\n\n{below}" if k == 0 and not depth else below
            cell["source"] = f"{head or ''}\n{below}{rest}" if below else text
        else:
            _outputs(cell, _next_words(cells, k))
    return json.dumps(notebook, ensure_ascii=False)


def _wide(film: str) -> bool:
    """Has a film several panels side by side?"""
    size = re.search(r' width="(\d+)" height="(\d+)"', film)
    return size is not None and int(size[1]) > 1.8 * int(size[2])


def _label(anchor: str) -> str:
    return "Table 1" if anchor == "table-1" else f"({anchor.removeprefix('eq-')})"


def _next_words(cells, k: int) -> str:
    """The paragraph after a cell, in plain words."""
    text = next(("".join(c["source"]) for c in cells[k + 1 :] if c["cell_type"] == "markdown"), "")
    first = re.sub(r"[*_`#>$\\{}|]|<[^>]*>|\]\([^)]*\)|\[", "", text.split("\n\n")[0])
    return re.sub(r"\s+", " ", first).strip()[:300] or "Picture of this cell"


def _outputs(cell: dict, words: str) -> None:
    """One form of each output, with words for every picture, and nothing that waits for a kernel."""
    kept = []
    for output in cell.get("outputs", []):
        data = output.get("data", {})
        if WIDGET in data and "image/png" not in data:
            continue
        data.pop(WIDGET, None)
        if "image/png" in data:
            page = "".join(data.pop("text/html", ""))
            data.pop("text/plain", None)
            alt = re.search(r'<img[^>]* alt="([^"]*)"', page)
            if "<picture>" in page:
                # A film moves, and stands still where motion is to be reduced.
                output["data"] = {"text/html": f'<div class="wide-picture">{page}</div>' if _wide(page) else page}
            cell["metadata"]["mystnb"] = {"image": {"alt": html.unescape(alt[1]) if alt else words}}
        kept.append(output)
    cell["outputs"] = kept


def without_dead_links(text: str, folder: Path, copied: Path) -> str:
    """Links to pages of the same folder or of the lessons stay; those to other files become their words.

    folder : of the page in the repository.  copied : the folder it goes to, beside that of the lessons.
    """

    def keep(link: re.Match) -> str:
        target = link[2]
        near = target.endswith(".md") and "/" not in target and (folder / target).exists()
        lesson = target.startswith("../lessons/") and (copied / target).resolve().exists()
        return link[0] if near or lesson or target.startswith(("http", "#")) else link[1]

    return re.sub(r"(?<!!)\[([^\]\n]+)\]\(([^)\s]+)\)", keep, text)
