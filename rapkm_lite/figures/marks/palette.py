"""Colours of a map in classes, and the styles that marks may have."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from matplotlib.colors import BoundaryNorm, ListedColormap, is_color_like, to_hex

from ...machine.arguments import bounded, exact_array, one_of, real_array, short

LINE = {"color", "linewidth", "linestyle", "alpha", "zorder", "solid_capstyle"}
LINE |= {"marker", "markersize", "markerfacecolor", "markeredgewidth"}
PATCH = {"facecolor", "edgecolor", "linewidth", "linestyle", "alpha", "zorder", "fill"}
WORDS = {"color", "fontsize", "fontweight", "ha", "va", "alpha", "zorder"}
STYLES = {"line": LINE, "bar": PATCH, "polygon": PATCH, "label": WORDS, "words": WORDS, "title": WORDS - {"ha", "va"}}
STYLES |= {"image": {"zorder"}}
_SIZES = {"linewidth", "alpha", "zorder", "markersize", "markeredgewidth", "fontsize"}
INK = "#222222"
"""Colour of a mark that is given none, on the canvas and in the stored picture."""
MARKERS = ("o", "s", "D", "x", "+")
_DASHES = {"-": (), "solid": (), "--": (3.7, 1.6), ":": (1.0, 1.65), "-.": (6.4, 1.6, 1.0, 1.6), "none": None, "": None}
_PLACES = {"ha": ("left", "center", "right"), "va": ("baseline", "bottom", "center", "top")}
_ORDER = {"image": 0.0, "bar": 1.0, "polygon": 1.0, "line": 2.0}


@dataclass(frozen=True)
class Palette:
    """Classes of a map: one colour between every two neighbouring `levels`, for white paper and for a dark theme.

    Raises ValueError for levels that do not rise, and unless there is one colour fewer than levels.

    >>> from rapkm_lite import explore
    >>> explore.Palette((0.0, 1.0, 2.0), ("#888888", "#EEEEEE"), ("#777777", "#333333")).classes
    2
    """

    levels: tuple[float, ...]
    light: tuple[str, ...]
    dark: tuple[str, ...]

    def __post_init__(self):
        levels = real_array("levels", self.levels)
        if levels.ndim != 1 or np.any(np.diff(levels) <= 0.0):
            raise ValueError(f"levels = {short(self.levels)}; allowed: numbers (k,) that rise")
        for name, colours in (("light", self.light), ("dark", self.dark)):
            if not isinstance(colours, list | tuple) or not all(map(is_color_like, colours)):
                raise ValueError(f"{name} = {short(colours)}; allowed: a tuple of colours such as '#888888'")
        if not len(self.light) == len(self.dark) == len(self.levels) - 1:
            raise ValueError(
                f"light has {len(self.light)}, dark {len(self.dark)} colours, levels {len(self.levels)} numbers; "
                "allowed: one colour of each kind between neighbouring levels"
            )

    @property
    def classes(self) -> int:
        """Number of colours."""
        return len(self.light)

    def matplotlib(self) -> dict:
        """The keywords ``cmap`` and ``norm`` of the light colours."""
        return {"cmap": ListedColormap(self.light), "norm": BoundaryNorm(self.levels, self.classes)}


def checked(kind: str, style: dict) -> dict:
    """The style as it is; raises ValueError for a keyword or a word that the canvas does not know."""
    items = kind, tuple(style.items()), tuple(map(type, style.values()))  # types, too: True equals 1
    try:
        hash(items)
    except TypeError:
        _check.__wrapped__(*items)
    else:
        _check(*items)
    return style


@lru_cache(maxsize=2048)
def _check(kind: str, items: tuple, types: tuple) -> None:
    """`checked` of (keyword, value) pairs, once for each style: a picture has the same ones at every step."""
    style, allowed = dict(items), STYLES[kind]
    unknown = sorted(set(style) - allowed)
    if unknown:
        raise ValueError(f"{kind} has no style {unknown[0]!r}; allowed: {', '.join(sorted(allowed))}")
    for name in _SIZES & set(style):
        bounded(name, exact_array(name, style[name]), -np.inf if name == "zorder" else 0.0, strict=False)
    one_of("marker", style.get("marker", MARKERS[0]), MARKERS)
    line = style.get("linestyle", "-")
    if not isinstance(line, str | tuple) or (isinstance(line, str) and line not in _DASHES):
        raise ValueError(f"linestyle = {short(line)}; allowed: {', '.join(map(repr, _DASHES))} or (0, (on, off, ...))")
    for name, places in _PLACES.items():
        one_of(name, style.get(name, places[0]), places)
    try:
        canvas_style(kind, items)
    except (IndexError, TypeError, ValueError) as error:
        raise ValueError(f"{kind} cannot be drawn with {short(style)} ({error}); allowed: words and numbers") from None


@lru_cache(maxsize=2048)
def canvas_style(kind: str, items: tuple) -> dict:
    """What the canvas needs of a style given as (keyword, value) pairs; lengths in points."""
    style = dict(items)
    out = {"z": style.get("zorder", _ORDER.get(kind, 3.0)), "alpha": style.get("alpha", 1.0)}
    line = style.get("linestyle", "-")
    dash = line[1] if isinstance(line, tuple) else _DASHES[line]
    if kind == "line":
        colour = to_hex(style.get("color", INK))
        out |= {"color": colour, "width": 0.0 if dash is None else style.get("linewidth", 1.7), "dash": dash or ()}
        out |= {"cap": style.get("solid_capstyle", "butt"), "marker": style.get("marker")}
        face = style.get("markerfacecolor", colour)
        out |= {"face": to_hex(face), "edge": style.get("markeredgewidth", 1.0), "size": style.get("markersize", 6.0)}
    elif kind in ("bar", "polygon"):
        face = style.get("facecolor", INK) if style.get("fill", True) else "none"
        edge = style.get("edgecolor", "none")
        out |= {"face": None if face == "none" else to_hex(face), "color": None if edge == "none" else to_hex(edge)}
        out |= {"width": style.get("linewidth", 1.0), "dash": dash or ()}
    elif kind != "image":
        out |= {"color": to_hex(style.get("color", INK)), "size": style.get("fontsize", 10.5)}
        out |= {"bold": style.get("fontweight") == "bold"}
        out |= {"ha": style.get("ha", "left"), "va": style.get("va", "baseline")}
    return out
