"""A recorded picture painted by Matplotlib: the one that is stored in a notebook, and exports."""

from __future__ import annotations

import base64
import html
import io
import math
import re
import textwrap

import matplotlib as mpl
import numpy as np
from matplotlib import patheffects
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import PathPatch
from matplotlib.path import Path
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import ScaledTranslation
from PIL import Image, features

from ..style import ALARM, STYLE
from .palette import INK
from .picture import Mark, Picture

# Where no kernel runs the stored picture stands alone, without the line that says that a widget is missing.
_ALONE = (
    "<style>.jp-OutputArea-child:has(.rapkm-stored) + .jp-OutputArea-child:has(.jupyter-widgets)"
    ":not(:has(.rapkm, .noUi-target, button, input, select)){display:none}</style>"
)
_RIM = patheffects.withStroke(linewidth=2.5, foreground="white")
_RC = mpl.rc_params_from_file(STYLE, use_default_template=False)


def mathtext(words: str) -> str:
    r"""Words with K_P as Matplotlib's true subscript.

    >>> print(mathtext("K_P 1 in N m/rad"))
    $\mathrm{K}_{\mathrm{P}}$ 1 in N m/rad
    """
    return re.sub(r"([^\W_]+)_(\w+)", r"$\\mathrm{\1}_{\\mathrm{\2}}$", words)


def figure(picture: Picture, problem: str = "") -> Figure:
    """A Matplotlib figure of the picture; `problem` is a sentence at its foot."""
    with mpl.rc_context(_RC):
        made = Figure(figsize=picture.size, dpi=96, layout="constrained")
        FigureCanvasAgg(made)
        axes = made.subplot_mosaic(picture.layout, width_ratios=picture.widths)
        for name, ax in axes.items():
            settings = {k: v for k, v in picture.panels[name].items() if k != "small"}
            settings |= {k: mathtext(settings[k]) for k in ("title", "xlabel", "ylabel") if k in settings}
            frame = picture.frames[name]
            ax.set(**settings | {"xlim": frame[:2], "ylim": frame[2:]})
            ax.set_autoscale_on(False)
            _thin_out(ax)
            # As on the canvas, without ticks there are no axes.
            if len(ax.get_xticks()) == 0:
                ax.spines[:].set_visible(False)
        for mark in [*picture.fixed, *picture.marks]:
            _PAINT[mark.kind](axes[mark.panel], mark)
        if any(mark.kind == "scale" for mark in picture.fixed) and (engine := made.get_layout_engine()):
            # A colour bar takes room from axes of equal scales, whose title is then above the place it had.
            engine.execute(made)
            for ax in axes.values():  # which are larger now, some of them
                _thin_out(ax)
        if problem:
            box = {"boxstyle": "round,pad=0.8", "facecolor": "white", "edgecolor": ALARM, "linewidth": 1.5}
            words = textwrap.fill(problem, int(10 * picture.size[0]))
            made.text(0.5, 0.04, words, ha="center", va="bottom", color=ALARM, fontsize=11.5, zorder=100, bbox=box)
    return made


def _thin_out(ax) -> None:
    """Fewer ticks along x where their numbers are long: Matplotlib has room for three digits in mind."""
    digits = max(map(len, ax.xaxis.get_major_formatter().format_ticks(list(ax.get_xticks()))), default=0)
    if digits > 5 and isinstance(ax.xaxis.get_major_locator(), MaxNLocator):
        ax.locator_params(axis="x", nbins=4)


def png(picture: Picture, problem: str = "") -> bytes:
    """The picture as a PNG of 256 colours."""
    drawn = figure(picture, problem)
    file = io.BytesIO()
    with mpl.rc_context(_RC):
        drawn.savefig(file, dpi=144)
    image = Image.open(file).convert("RGB").quantize(256, method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    file = io.BytesIO()
    image.save(file, "PNG", optimize=True)
    return file.getvalue()


def bundle(picture: bytes, sentence: str) -> dict:
    """A PNG as a MIME bundle: the picture for exports, and a smaller copy with `sentence` as its alternative text."""
    file, kind = io.BytesIO(picture), "png"
    if features.check("webp"):
        image, file, kind = Image.open(file).convert("RGB"), io.BytesIO(), "webp"
        image.save(file, "WEBP", quality=80)
    source = f"data:image/{kind};base64,{base64.b64encode(file.getvalue()).decode()}"
    shown = f'<img class="rapkm-stored" alt="{html.escape(sentence, quote=True)}" src="{source}">{_ALONE}'
    return {"image/png": base64.b64encode(picture).decode(), "text/html": shown}


def _line(ax, mark: Mark) -> None:
    ax.add_line(Line2D(*mark.data.T, **{"color": INK, **mark.style}))


def _path(points: np.ndarray) -> Path:
    """Closed rings, separated by rows that are not finite."""
    breaks = np.flatnonzero(~np.isfinite(points).all(axis=1))
    rings = [r[np.isfinite(r).all(axis=1)] for r in np.split(points, breaks)]
    return Path.make_compound_path(*(Path(np.vstack([r, r[:1]]), closed=True) for r in rings if len(r)))


def _patch(ax, mark: Mark) -> None:
    ax.add_patch(PathPatch(_path(mark.data), **{"facecolor": INK, "edgecolor": "none", **mark.style}))


def _words(ax, mark: Mark) -> None:
    where = {"clip_on": mark.kind != "words"}
    # Words on a line have a rim of paper, as on the canvas.
    where |= {} if mark.style.get("color") == "white" else {"path_effects": [_RIM]}
    # The rim would bite into the bar that carries the words.
    up = {"bottom": 2, "top": -2}.get(str(mark.style.get("va")), 0)
    place = ax.transAxes if mark.kind == "words" else ax.transData
    place += ScaledTranslation(0, up / 72, ax.figure.dpi_scale_trans)
    ax.text(*mark.data[0], mathtext(mark.words), transform=place, **where, **mark.style)


def _title(ax, mark: Mark) -> None:
    ax.set_title(mathtext(mark.words), **mark.style)


def _image(ax, mark: Mark) -> None:
    values, extent, palette = mark.words
    drawn = ax.imshow(values, origin="lower", extent=extent, **palette.matplotlib(), **{"zorder": 0, **mark.style})
    ax.set(aspect="equal")
    if len(mark.data):
        drawn.set_clip_path(_path(mark.data), ax.transData)


def _legend(ax, mark: Mark) -> None:
    entries = [(Line2D([], [], **{"color": INK, **style}), mathtext(words)) for words, style in mark.words]
    look = {"handlelength": 2.4, "columnspacing": 0.9, "handletextpad": 0.6, "borderaxespad": 0.1, "fontsize": 9}
    look |= {"loc": "lower right", "bbox_to_anchor": (1, 1)}
    count = len(entries)
    wide = ax.legend(*zip(*entries, strict=True), ncols=count, **look).get_window_extent().width
    # Beside the title; the panel is not laid out yet and becomes a little wider.
    room = ax.bbox.width - ax.set_title(ax.get_title("left")).get_window_extent().width
    if wide > room:
        rows = math.ceil(count / max(int(count * room / wide), 1))
        columns = math.ceil(count / rows)
        # Matplotlib fills columns, but it is rows that are read, here as on the canvas.
        entries = [entries[k] for first in range(columns) for k in range(first, count, columns)]
        ax.legend(*zip(*entries, strict=True), ncols=columns, **look)


def _scale(ax, mark: Mark) -> None:
    palette, label = mark.words
    ax.figure.colorbar(ScalarMappable(**palette.matplotlib()), ax=ax, shrink=0.85, pad=0.02, label=mathtext(label))
    # The label belongs to these colours and not to the panel beside it.
    ax.figure.get_layout_engine().set(wspace=0.06)


_PAINT = {"line": _line, "bar": _patch, "polygon": _patch, "label": _words, "words": _words}
_PAINT |= {"title": _title, "image": _image, "legend": _legend, "scale": _scale}
