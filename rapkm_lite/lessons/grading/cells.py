"""The cells of a submitted notebook, in plain Python."""

from __future__ import annotations

import ast
import json
import re
from contextlib import suppress
from pathlib import Path

_FOREIGN = re.compile(r"\s*%%(!|bash|cmd|html|java|js|latex|markdown|perl|pypy|python|ruby|script|sh|svg|sx|sys)", re.I)
_WRITTEN = re.compile(r"\s*%%(?:writefile|file)\b(.*)\n?")


def sources(path: Path) -> list[str]:
    """Source of every cell, empty for those without code; what is for the notebook itself (%, !, ?) as plain calls.

    Raises ValueError when the file is no notebook.
    """
    try:
        notebook = json.loads(path.read_text(encoding="utf-8-sig"))
        # Format 3 of notebooks has sheets of cells, whose code is their "input".
        sheets = [notebook] if "cells" in notebook else notebook["worksheets"]
        texts = [_code(cell) for sheet in sheets for cell in sheet["cells"]]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ValueError(f"{path.name} is no notebook that can be read ({type(error).__name__})") from None
    return [_plain(text) for text in texts]


def _code(cell: dict) -> str:
    if cell["cell_type"] != "code":
        return ""
    return "".join(cell["input"] if "source" not in cell and "input" in cell else cell["source"])


def _plain(text: str) -> str:
    """The source of a cell in plain Python; nothing of what a notebook gives to a shell, a page or a new Python."""
    if file := _WRITTEN.match(text):
        return f"get_ipython().run_cell_magic('writefile', {file[1]!r}, {text[file.end() :]!r})"
    text = "pass" if _FOREIGN.match(text) else re.sub(r"\A(\s*)%%.*$", r"\1pass", text, flags=re.M)
    try:
        ast.parse(text)
    except (SyntaxError, ValueError):
        text = re.sub(r"^(\s*)%time\s+(?=\S)", r"\1", text, flags=re.M)
        with suppress(ImportError, SyntaxError):
            from IPython.core.inputtransformer2 import TransformerManager

            return TransformerManager().transform_cell(text)
    return text
