"""The drawing of the rooms for the site: floors of boxes, from the same lines that GitHub draws as a diagram."""

from __future__ import annotations

import re
import textwrap
from html import escape
from itertools import pairwise

WIDTH, HEIGHT, GAP, FLOOR = 200, 82, 16, 130
ROOM = re.compile(r'^ *(\w+)([\[(][\[(/]?)"(.*?)"', re.M)
ARROW = re.compile(r"^ *(\w+) --> (\w+)$", re.M)


def floors(rooms: list[str], arrows: list[tuple[str, str]]) -> dict[str, int]:
    """How many arrows lead down from each room, on the longest way."""
    below = {room: [b for a, b in arrows if a == room] for room in rooms}

    def floor(room: str) -> int:
        return max((1 + floor(other) for other in below[room]), default=0)

    return {room: floor(room) for room in rooms}


def layout(rooms: list[str], arrows: list[tuple[str, str]]) -> tuple[dict[str, tuple[float, int]], list[list[str]]]:
    """Place (column, floor) of everything, and each arrow as the places it passes, one per floor."""
    level = floors(rooms, arrows)
    ways = []
    for a, b in arrows:
        # A long arrow passes the floors between in places of its own, so that it crosses no box.
        between = [f"{a} {b} {k}" for k in range(level[a] - 1, level[b], -1)]
        level |= {name: int(name.split()[-1]) for name in between}
        ways.append([a, *between, b])
    columns = ordered(level, ways)
    return {name: (columns[name], level[name]) for name in level}, ways


def ordered(level: dict[str, int], ways: list[list[str]]) -> dict[str, float]:
    """The column of everything: on its floor near the mean of what it is tied to."""
    beside: dict[str, list[str]] = {name: [] for name in level}
    for way in ways:
        for a, b in pairwise(way):
            beside[a].append(b)
            beside[b].append(a)
    rows = [[name for name in level if level[name] == k] for k in range(max(level.values()) + 1)]
    column = {name: i - 0.5 * (len(row) - 1) for row in rows for i, name in enumerate(row)}
    # Up and down the floors, again and again.
    for _ in range(12):
        for row in [*rows, *reversed(rows)]:
            row.sort(key=lambda name: sum(column[b] for b in beside[name]) / max(1, len(beside[name])))
            wide = [0.3 if " " in name else 1.0 for name in row]
            for i, name in enumerate(row):
                column[name] = sum(wide[:i]) + 0.5 * wide[i] - 0.5 * sum(wide)
    return column


def svg(text: str) -> str:
    """The picture of a diagram with lines `name["name<br>words"]` and `name --> other`."""
    named = {name: (opened, words) for name, opened, words in ROOM.findall(text)}
    place, ways = layout(list(named), ARROW.findall(text))
    columns = [x for x, _ in place.values()]
    left, top = min(columns) - 0.5, max(y for _, y in place.values())

    def at(name: str) -> tuple[float, float]:
        x, y = place[name]
        return (x - left) * (WIDTH + GAP) + GAP, (top - y) * FLOOR + GAP + 0.5 * HEIGHT

    size = (max(columns) + 0.5 - left) * (WIDTH + GAP) + 2 * GAP, top * FLOOR + HEIGHT + 2 * GAP
    parts = [
        f'<svg class="drawing" viewBox="0 0 {size[0]:.0f} {size[1]:.0f}" role="img" aria-label="The rooms and what '
        'they import, as in the table below"><defs><marker id="tip" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="8"'
        ' markerHeight="8" orient="auto"><path d="M0,0L8,4L0,8Z" fill="currentColor"/></marker></defs>'
    ]
    for way in ways:
        # Straight down beside the boxes of a floor, slanting only between floors.
        points = [(x, y + side * 0.5 * HEIGHT) for x, y in map(at, way) for side in (-1, 1)][1:-1]
        line = "L".join(f"{a:.0f},{b:.0f}" for a, b in points)
        parts.append(f'<path d="M{line}" fill="none" stroke="currentColor" opacity=".6" marker-end="url(#tip)"/>')
    for name, (opened, words) in named.items():
        x, y = at(name)
        title, *rest = words.split("<br>")
        lines = textwrap.wrap(" ".join(rest), 29)
        corner = 22 if opened.startswith("(") else 3
        box = f'x="{x - 0.5 * WIDTH:.0f}" y="{y - 0.5 * HEIGHT:.0f}" width="{WIDTH}" height="{HEIGHT}"'
        parts.append(f'<rect {box} rx="{corner}"/>')
        for i, line in enumerate([title, *lines]):
            weight = "" if i else ' font-weight="bold"'
            parts.append(
                f'<text x="{x:.0f}" y="{y + 17 * (i - 0.5 * len(lines)) + 4:.0f}"{weight}>{escape(line)}</text>'
            )
    return "".join([*parts, "</svg>"])
