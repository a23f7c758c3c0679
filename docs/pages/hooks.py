"""Sphinx's hooks: docstrings as they are written here, and folded parts."""

from __future__ import annotations

import re
from html import escape
from pathlib import Path

# "name : what it is" begins an item about an argument or several; a line may hold more of them, a full stop between.
NAMES = r"[A-Za-z_]\w*(?:, [A-Za-z_]\w*)*"
ARGUMENT = re.compile(rf"{NAMES} : .*")
NEXT = re.compile(rf"(?:(?<=\.)\s+|\s{{2,}})(?={NAMES} : )")


def readable(lines: list[str]) -> list[str]:
    """A docstring of this package as reStructuredText: lists of arguments, examples, no accidental markup."""
    made: list[str] = []
    item = ""
    example = False
    for line in [*lines, ""]:
        begins = line.startswith(">>>") and not example
        argument = not example and ARGUMENT.fullmatch(line) is not None
        # A sentence that has come to its end is gone on with by an indent only.
        goes_on = bool(item and line.strip()) and not (begins or argument)
        if goes_on and (line.startswith(" ") or not item.endswith(".")):
            item += " " + line.strip()
            continue
        made += items(item)
        made += [""] if goes_on else []
        item = ""
        if begins:
            made += [""] * bool(made) + ["::", ""]
            example = True
        example = example and bool(line.strip())
        if argument:
            item = line
        else:
            made.append("    " + line if example else escaped(line))
    return made[:-1]


def items(text: str) -> list[str]:
    """The arguments of one line or paragraph, each as an item of a list."""
    pairs = [part.split(" : ", 1) for part in NEXT.split(text) if part]
    return [line for names, words in pairs for line in ("", f"* **{names}**: {escaped(words.strip())}")]


def escaped(text: str) -> str:
    """What is no literal and no stressed word, without characters that reStructuredText would take as markup."""
    parts = re.split(r"(``.*?``|`[^`]+`|(?<![\w*])\*\w+\*(?![\w*]))", text)
    return "".join(part if k % 2 else re.sub(r"[*|\\]|_(?!\w)", r"\\\g<0>", part) for k, part in enumerate(parts))


def _docstring(app, what, name, obj, options, lines):
    lines[:] = readable(lines)


def _fold(app, doctree, docname):
    """Sections called "Dig deeper" become folded; their title is what one clicks."""
    from docutils import nodes

    for section in list(doctree.findall(nodes.section)):
        title = section.next_node(nodes.title)
        if title is None or not title.astext().startswith("Dig deeper"):
            continue
        section.remove(title)
        heading = nodes.raw(
            "", f'<details class="dig-deeper"><summary><h3>{escape(title.astext())}</h3></summary>', format="html"
        )
        section.insert(0, heading)
        section.append(nodes.raw("", "</details>", format="html"))


def _widen(app, doctree, docname):
    """Wide pictures, of several panels mostly, in a box of their own, which a narrow screen moves sideways."""
    from docutils import nodes
    from PIL import Image

    for image in list(doctree.findall(nodes.image)):
        path = Path(app.srcdir, image["uri"])
        if path.suffix not in (".png", ".webp") or not path.is_file():
            continue
        with Image.open(path) as picture:
            width, height = picture.size
        if width > 1.8 * height or width > 1100:
            box = nodes.container(classes=["wide-picture"])
            image.replace_self(box)
            box.append(image)


def _hold_together(app, doctree, docname):
    """A formula in a line and the stop behind it, which would else begin the next line alone."""
    from docutils import nodes

    for formula in list(doctree.findall(nodes.math)):
        behind = formula.next_node(descend=False, siblings=True)
        stop = re.match(r"[.,;:!?)]+", behind.astext()) if isinstance(behind, nodes.Text) else None
        if stop:
            behind.parent.replace(behind, nodes.Text(behind.astext()[stop.end() :]))
            together = nodes.inline(classes=["together"])
            formula.replace_self(together)
            together += [formula, nodes.Text(stop[0])]


def setup(app):
    app.connect("autodoc-process-docstring", _docstring)
    app.connect("doctree-resolved", _fold)
    app.connect("doctree-resolved", _widen)
    app.connect("doctree-resolved", _hold_together)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
