"""Sphinx's hooks: docstrings as they are written here, and folded parts."""

from __future__ import annotations

import re
from pathlib import Path

# "name : what it is" begins a paragraph about an argument; longer ones go on with an indent.
ARGUMENT = re.compile(r"([A-Za-z_]\w*(?:, [A-Za-z_]\w*)*) : (.*)")


def readable(lines: list[str]) -> list[str]:
    """A docstring of this package as reStructuredText: lists of arguments, examples, no accidental markup."""
    made: list[str] = []
    example = listed = False
    for line in lines:
        if line.startswith(">>>") and not example:
            made += ["", "::", ""] if made else ["::", ""]
            example, listed = True, False
        elif not line.strip():
            example = listed = False
        if example:
            made.append("    " + line)
            continue
        argument = ARGUMENT.fullmatch(line)
        if argument:
            made += ["", f"* **{argument[1]}**: {escaped(argument[2])}"]
            listed = True
        elif listed and line.startswith(" "):
            made.append("  " + escaped(line.strip()))
        else:
            made += [""] if listed and line.strip() else []
            listed = False
            made.append(escaped(line))
    return made


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
        heading = nodes.raw("", f'<details class="dig-deeper"><summary>{title.astext()}</summary>', format="html")
        section.insert(0, heading)
        section.append(nodes.raw("", "</details>", format="html"))


def _widen(app, doctree, docname):
    """Pictures of several panels side by side in a box of their own, which a narrow screen moves sideways."""
    from docutils import nodes
    from PIL import Image

    for image in list(doctree.findall(nodes.image)):
        path = Path(app.srcdir, image["uri"])
        if path.suffix not in (".png", ".webp") or not path.is_file():
            continue
        with Image.open(path) as picture:
            width, height = picture.size
        if width > 1.8 * height:
            box = nodes.container(classes=["wide-picture"])
            image.replace_self(box)
            box.append(image)


def setup(app):
    app.connect("autodoc-process-docstring", _docstring)
    app.connect("doctree-resolved", _fold)
    app.connect("doctree-resolved", _widen)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
