"""A picture as recorded marks: what a draw function says, without saying who paints it."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...machine.arguments import (
    bounded,
    callable_with,
    exact_array,
    function,
    of_kind,
    positive_number,
    short,
    switch,
    whole_number,
)
from .given import check_panel, legend_entries, numbers, two_limits, vertical_limits
from .palette import Palette, checked

# Keywords of a panel, as of ``Axes.set``; `small` panels stand side by side where the page is narrow.
PANEL = {"title", "xlabel", "ylabel", "xlim", "ylim", "aspect", "xticks", "yticks", "yscale", "small", "legend"}


class Mark(NamedTuple):
    """One recorded mark: its numbers (k, 2), its style by Matplotlib's keywords, its words."""

    kind: str
    panel: str
    data: np.ndarray
    style: dict
    words: Any = ""


class Picture:
    """Named panels and the marks that a draw function puts into them at every step.

    panels : name -> keywords of ``Axes.set``: xlabel, ylabel, title, xlim, ylim, aspect, xticks, yticks, yscale (of
        "log" with a positive ylim); and legend, the entries of `legend`.
    layout : rows of panel names as in ``Figure.subplot_mosaic``; default one row.
    widths : relative widths of the columns.  size : inches, their ratio is that of the picture.
    setup : function of the picture that draws once what never changes (workspace, legend).
    Raises ValueError for an unknown keyword of a panel, KeyError for an unknown panel.

    >>> from rapkm_lite import explore; picture = explore.Picture({"a": {"ylim": (0, 2)}})
    >>> picture.line("a", [0, 1], [0, 2], colour="red")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ValueError: line has no style 'colour'; allowed: alpha, color, linestyle, linewidth, marker, markeredgewidth, ...
    """

    def __init__(self, panels: dict, layout=None, widths=None, size=(9.4, 3.3), setup=None):
        if not of_kind("panels", panels, dict, "a dict of name -> keywords of a panel"):
            raise ValueError("panels = {}; allowed: one panel at least, name -> keywords")
        for name, settings in panels.items():
            of_kind(f"panels[{name!r}]", settings, dict, "a dict of keywords")
            unknown = sorted(set(settings) - PANEL)
            if unknown:
                raise ValueError(f"panel {name!r} has no {unknown[0]!r}; allowed: {', '.join(sorted(PANEL))}")
            check_panel(settings)
        self.panels = {name: {k: v for k, v in panel.items() if k != "legend"} for name, panel in panels.items()}
        self.layout = [list(panels)] if layout is None else _rows(layout, list(panels))
        columns = len(self.layout[0])
        self.widths = [1] * columns if widths is None else exact_array("widths", widths, columns).tolist()
        self.size = tuple(bounded("size", exact_array("size", size, 2), 0.0, strict=True).tolist())
        self.frames = {k: [*p.get("xlim", (0, 1)), *p.get("ylim", (0, 1))] for k, p in panels.items()}
        self.begin()
        if setup is not None:
            callable_with("setup", function("setup", setup), "picture")(self)
        for name, panel in panels.items():
            if "legend" in panel:
                self.legend(name, panel["legend"])
        self.fixed = self.marks
        self.begin()

    def begin(self) -> None:
        """Forget what the last step drew."""
        self.marks: list[Mark] = []
        self.handles: list[dict] = []

    def line(self, panel: str, x, y, **style) -> None:
        """A curve, or markers with ``linestyle="none"``; a gap where a number is not finite."""
        x, y = numbers("x", x, most=1), numbers("y", y, most=1)
        if x.size != y.size and 1 not in (x.size, y.size):
            raise ValueError(f"y has shape {y.shape}, x has {x.shape}; allowed: a number for each x")
        data = np.empty((y.size if x.size == 1 else x.size, 2))
        data[:, 0], data[:, 1] = x, y
        self._add("line", panel, data, checked("line", style))

    def trace(self, panel: str, t, y, points: int = 300, **style) -> None:
        """A curve over time, thinned to the least and largest value in each of `points` spans."""
        t, y = numbers("t", t, -1), numbers("y", y, -1)
        if len(t) != len(y):
            raise ValueError(f"y has shape {y.shape}, t has {t.shape}; allowed: a number for each time")
        span = len(t) // whole_number("points", points, 1)
        if span > 2:
            count = len(t) // span * span
            blocks = y[:count].reshape(-1, span)
            low, high = blocks.argmin(axis=1), blocks.argmax(axis=1)
            start = np.arange(0, count, span)
            ends = np.stack([start + np.minimum(low, high), start + np.maximum(low, high)], -1)
            keep = np.concatenate([ends.ravel(), [len(t) - 1]])
            t, y = t[keep], y[keep]
        self.line(panel, t, y, **style)

    def text(self, panel: str, x: float, y: float, words: str, inside: bool = False, **style) -> None:
        """Words at (x, y) in data coordinates, or in fractions of the panel when `inside`."""
        kind = "words" if switch("inside", inside) else "label"
        data = np.array([[numbers("x", x), numbers("y", y)]], dtype=float)
        self._add(kind, panel, data, checked(kind, style), of_kind("words", words, str, "text"))

    def title(self, panel: str, words: str, **style) -> None:
        """Words above the panel, in place of its title."""
        self._add("title", panel, np.empty((0, 2)), checked("title", style), of_kind("words", words, str, "text"))

    def bar(self, panel: str, at: float, height: float, width: float = 0.8, **style) -> None:
        """A bar from zero, centred at `at`."""
        middle, half, top = numbers("at", at), numbers("width", width) / 2, numbers("height", height)
        left, right = middle - half, middle + half
        corners = np.array([[left, 0.0], [right, 0.0], [right, top], [left, top]])
        self._add("bar", panel, corners, checked("bar", style))

    def polygon(self, panel: str, points, **style) -> None:
        """A closed polygon through points (k, 2); rows that are not finite begin another ring."""
        self._add("polygon", panel, numbers("points", points, -1, 2), checked("polygon", style))

    def arrow(self, panel: str, start, vector, width: float = 0.006, **style) -> None:
        """An arrow from `start` (2,) along `vector` (2,), in data coordinates; nothing when shorter than `width`."""
        self._check(panel)
        start, vector = numbers("start", start, 2), numbers("vector", vector, 2)
        width = positive_number("width", width)
        length = float(np.hypot(*vector))
        checked("polygon", style)
        if width < length < np.inf:
            along = vector / length
            side = np.array([-along[1], along[0]])
            neck = length - min(4 * width, 0.6 * length)
            ways = [(0, 0.5), (neck, 0.5), (neck, 1.6), (length, 0), (neck, -1.6), (neck, -0.5), (0, -0.5)]
            self.polygon(panel, [start + s * along + w * width * side for s, w in ways], **style)

    def image(self, panel: str, values, extent, palette: Palette, clip=None, **style) -> None:
        """A map of values (rows, columns) over extent (x0, x1, y0, y1), in the classes of `palette`.

        clip : a polygon (k, 2) outside of which nothing is painted.  Keep the array: a map is sent once as long as the
        same array is given.
        """
        outline = np.empty((0, 2)) if clip is None else numbers("clip", clip, -1, 2)
        numbers("values", values, -1, -1)
        x0, x1, y0, y1 = edges = tuple(exact_array("extent", extent, 4).tolist())
        if x0 == x1 or y0 == y1:
            raise ValueError(f"extent = {short(extent)}; allowed: (x0, x1, y0, y1) with x0 < x1 and y0 < y1")
        of_kind("palette", palette, Palette, "a Palette")
        self._add("image", panel, outline, checked("image", style), (values, edges, palette))

    def legend(self, panel: str, entries) -> None:
        """A legend above the panel; entries are (words, keywords of a line)."""
        entries = legend_entries("entries", entries)
        words = [(words, checked("line", {"linewidth": 2, **style})) for words, style in entries]
        self._add("legend", panel, np.empty((0, 2)), {}, words)

    def scale(self, panel: str, palette: Palette, label: str) -> None:
        """The colours of a map with their levels, beside the panel."""
        words = of_kind("palette", palette, Palette, "a Palette"), of_kind("label", label, str, "text")
        self._add("scale", panel, np.empty((0, 2)), {}, words)

    def handle(self, panel: str, x, y, /, along=None, grip=None, **controls) -> None:
        """A point of the picture that can be taken by hand and moves controls.

        x, y : where it is; ``y=None``: a line over the whole height that is pushed to the left and right.
        controls : name -> (a, b, c) with value = a x + b y + c, c may be missing; with `along`, points (k, 2) of a
        curve that the handle cannot leave, name -> the value at each point.
        grip : two points (2, 2); the line between them takes hold of the handle too.
        """
        self._check(panel)
        if not controls:
            raise ValueError("a handle moves no control; allowed: name of a control = (a, b) or (a, b, c)")
        for name, value, shape in (("x", x, ()), ("y", y, ()), ("along", along, (-1, 2)), ("grip", grip, (2, 2))):
            if value is not None or name == "x":
                numbers(name, value, *shape)
        for name, values in controls.items():
            shape = numbers(name, values, most=1).shape
            if along is None and shape not in ((2,), (3,)):
                raise ValueError(f"{name} = {values!r}; allowed: (a, b) or (a, b, c), with value = a x + b y + c")
            if along is not None and shape != (len(along),):
                raise ValueError(f"{name} has shape {shape} for {len(along)} points; allowed: one number for each")
        self.handles.append({"panel": panel, "at": (x, y), "set": controls, "along": along, "grip": grip})

    def limits(self, panel: str, x=None, y=None) -> None:
        """Set the limits of a panel; those of y are positive where its yscale is "log"."""
        self._check(panel)
        frame = self.frames[panel]
        frame[:2] = two_limits("x", x) if x is not None else frame[:2]
        frame[2:] = vertical_limits("y", y, self.panels[panel]) if y is not None else frame[2:]

    def xlim(self, panel: str) -> tuple[float, float]:
        """The horizontal limits of a panel."""
        self._check(panel)
        return tuple(self.frames[panel][:2])

    def ylim(self, panel: str) -> tuple[float, float]:
        """The vertical limits of a panel."""
        self._check(panel)
        return tuple(self.frames[panel][2:])

    def fit(self, panel: str, *values, symmetric: bool = True, least: float = 1e-9, most: float = np.inf) -> None:
        """Vertical limits that hold all `values`, in steps of 1, 1.5, 2, 3, 5, 7 so that they seldom change.

        Without `symmetric` they begin at zero; a panel with yscale "log" has `limits` instead.  They shrink only when
        the values fill less than half of them, and end at the first step not below `most`.
        """
        low, now = self.ylim(panel)
        sizes = (np.abs(numbers("values", v, most=9)) for v in values)
        largest = max([positive_number("least", least), *(float(v[np.isfinite(v)].max(initial=0.0)) for v in sizes)])
        endless = isinstance(most, float) and most == np.inf
        largest = min(largest, (most if endless else positive_number("most", most)) / 1.05)
        switch("symmetric", symmetric)
        if not 0.45 * now <= 1.05 * largest <= now or (symmetric and low != -now):
            decade = 10.0 ** np.floor(np.log10(1.05 * largest))
            steps = (1, 1.5, 2, 3, 5, 7, 10)
            now = float(next(s * decade for s in steps if s * decade >= 1.05 * largest * (1 - 1e-12)))
        self.limits(panel, y=(-now if symmetric else 0.0, now))

    def _check(self, panel: str) -> None:
        if not isinstance(panel, str | int) or panel not in self.panels:
            raise KeyError(f"there is no panel {short(panel)}; allowed: {', '.join(self.panels)}")

    def _add(self, kind: str, panel: str, data: np.ndarray, style: dict, words: Any = "") -> None:
        self._check(panel)
        if data.ndim != 2 or data.shape[1] != 2:
            raise ValueError(f"the points of a {kind} have shape {data.shape}; allowed: (k, 2)")
        self.marks.append(Mark(kind, panel, data, style, words))


def _rows(layout, panels: list) -> list[list]:
    """The rows of a layout, equally long, of names of panels; "." leaves a place empty."""
    rows = [list(row) for row in layout if isinstance(row, list | tuple)] if isinstance(layout, list | tuple) else []
    names = {name for row in rows for name in row if isinstance(name, str)} - {"."}
    whole = rows and len(rows) == len(layout) and {len(row) for row in rows} == {len(rows[0])}
    if not whole or names != set(panels):
        raise ValueError(f"layout = {short(layout)}; allowed: rows of the names {', '.join(map(repr, panels))}")
    return rows
