"""Tables of results: what a notebook shows is a table for eyes and screen readers alike, with a head and row names."""

from __future__ import annotations

import html
from collections.abc import Iterable, Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Table:
    """Words in rows under a head; a notebook shows it as a table, a terminal as aligned columns."""

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]

    def __repr__(self) -> str:
        columns = list(zip(self.head, *self.rows, strict=True))
        widths = [max(map(len, column)) for column in columns]
        lines = []
        for row in (self.head, *self.rows):
            first, *others = (f"{word:>{width}}" for word, width in zip(row, widths, strict=True))
            lines.append("  ".join([f"{row[0]:<{len(first)}}", *others]).rstrip())
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        head = "".join(f'<th scope="col">{html.escape(word)}</th>' for word in self.head)
        body = ""
        for name, *values in self.rows:
            cells = "".join(f"<td>{html.escape(value)}</td>" for value in values)
            body += f'<tr><th scope="row" style="text-align: left">{html.escape(name)}</th>{cells}</tr>'
        return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def table(head: Sequence[str], rows: Iterable[Sequence]) -> Table:
    """A table for ``display``: names of the columns, with units, and rows whose first entry is the name of the row.

    Entries are shown as ``str`` gives them; format numbers to the digits that mean something.
    Raises ValueError when a row is longer or shorter than the head.

    >>> from rapkm_lite import plotting; plotting.table(["law", "error in mm"], [["PD", f"{1.654:.2f}"]])
    law  error in mm
    PD          1.65
    """
    made = tuple(tuple(map(str, row)) for row in rows)
    for row in made:
        if len(row) != len(head):
            raise ValueError(f"rows holds {row}, {len(row)} entries; allowed: {len(head)}, as in head")
    return Table(tuple(map(str, head)), made)
