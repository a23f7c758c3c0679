"""A picture that is redrawn fast enough to follow a slider: a blitted Agg figure, sent as a palette PNG."""

from __future__ import annotations

import io
import textwrap
from collections import OrderedDict

import matplotlib as mpl
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D
from matplotlib.patches import FancyArrow, Polygon, Rectangle
from PIL import Image

from ..figures.style import ALARM, STYLE

_RC = mpl.rc_params_from_file(STYLE, use_default_template=False)


class LivePicture:
    """Named panels whose content is redrawn at every step of a control.

    panels : name -> keywords of ``Axes.set`` (xlabel, ylabel, title, xlim, ylim, aspect, ...).
    layout : rows of panel names as in ``Figure.subplot_mosaic``; default one row.
    widths : relative widths of the columns.  size : inches at 96 dots per inch.
    setup : function of the axes by name that paints once what never changes (workspace, legend).

    A draw function calls `line`, `text`, `bar`, `polygon`, `arrow` and `image`.  The k-th line of a panel in one step
    is the k-th line of that panel in the next one: artists are made once and updated; those not drawn disappear.
    Axes, ticks and what the set-up painted are kept as a bitmap per panel, drawn anew only for limits not met before.
    """

    def __init__(self, panels: dict, layout=None, widths=None, size=(9.4, 3.3), setup=None):
        with mpl.rc_context(_RC):
            self.figure = Figure(figsize=size, dpi=96, layout="constrained")
            self.canvas = FigureCanvasAgg(self.figure)
            self.axes = self.figure.subplot_mosaic(layout or [list(panels)], width_ratios=widths)
            for name, settings in panels.items():
                self.axes[name].set(**settings)
            if setup is not None:
                setup(self.axes)
            for ax in self.axes.values():
                ax.autoscale(False)
        self._pools: dict[tuple, list] = {}
        self._used: dict[tuple, int] = {}
        self._drawn: list = []
        self._blank = None
        # Bitmaps of each panel for the last few limits: a slider dragged to and fro finds them again.
        self._panels: dict[str, OrderedDict] = {name: OrderedDict() for name in self.axes}
        self.panel_draws = 0

    def line(self, panel: str, x, y, **style) -> None:
        """A curve, or markers with ``linestyle="none"``."""
        line = self._artist(panel, "line", style, lambda ax, kw: ax.add_line(Line2D([], [], **kw)))
        line.set_data(np.atleast_1d(x), np.atleast_1d(y))

    def trace(self, panel: str, t, y, points: int = 300, **style) -> None:
        """A curve over time, thinned to the least and largest value in each of `points` spans."""
        t, y = np.asarray(t), np.asarray(y)
        span = len(t) // points
        if span > 2:
            count = len(t) // span * span
            blocks = y[:count].reshape(-1, span)
            low, high = blocks.argmin(axis=1), blocks.argmax(axis=1)
            start = np.arange(0, count, span)
            keep = np.concatenate(
                [np.stack([start + np.minimum(low, high), start + np.maximum(low, high)], -1).ravel(), [len(t) - 1]]
            )
            t, y = t[keep], y[keep]
        self.line(panel, t, y, **style)

    def text(self, panel: str, x: float, y: float, words: str, inside: bool = False, **style) -> None:
        """Words at (x, y) in data coordinates, or in fractions of the panel when `inside`."""
        kind = "words" if inside else "label"
        where = {"transform": self.axes[panel].transAxes} if inside else {}
        text = self._artist(panel, kind, style, lambda ax, kw: ax.text(0, 0, "", **where, **kw))
        text.set_position((x, y))
        text.set_text(words)

    def bar(self, panel: str, at: float, height: float, width: float = 0.8, **style) -> None:
        """A bar from zero, centred at `at`."""
        bar = self._artist(panel, "bar", style, lambda ax, kw: ax.add_patch(Rectangle((0, 0), 1, 1, **kw)))
        bar.set_bounds(at - width / 2, 0.0, width, height)

    def polygon(self, panel: str, points, **style) -> None:
        """A closed polygon through points (k, 2)."""
        patch = self._artist(panel, "polygon", style, lambda ax, kw: ax.add_patch(Polygon(np.zeros((1, 2)), **kw)))
        patch.set_xy(points)

    def arrow(self, panel: str, start, vector, width: float = 0.006, **style) -> None:
        """An arrow from `start` (2,) along `vector` (2,), in data coordinates; invisible when shorter than `width`."""
        arrow = self._artist(
            panel, "arrow", style, lambda ax, kw: ax.add_patch(FancyArrow(0, 0, 1, 0, length_includes_head=True, **kw))
        )
        length = float(np.hypot(*vector))
        head = min(4 * width, 0.6 * length)
        arrow.set_visible(length > width)
        arrow.set_data(
            x=start[0], y=start[1], dx=vector[0], dy=vector[1], width=width, head_width=3.2 * width, head_length=head
        )

    def image(self, panel: str, values, extent, **style) -> None:
        """A map of values (rows, columns) over extent (x0, x1, y0, y1); masked values stay transparent."""
        image = self._artist(
            panel,
            "image",
            {"zorder": 0, **style},
            lambda ax, kw: ax.add_image(AxesImage(ax, origin="lower", extent=extent, **kw)),
        )
        if image.get_array() is not values:
            image.set_data(values)

    def limits(self, panel: str, x=None, y=None) -> None:
        """Set the limits of a panel."""
        ax = self.axes[panel]
        for new, old, change in ((x, ax.get_xlim(), ax.set_xlim), (y, ax.get_ylim(), ax.set_ylim)):
            if new is not None and tuple(new) != tuple(old):
                change(*new)

    def fit(self, panel: str, *values, symmetric: bool = True, least: float = 1e-9) -> None:
        """Vertical limits that hold all `values`, in steps of 1, 1.5, 2, 3, 5, 7 so that they seldom change.

        The limits shrink only when the values fill less than half of them.
        """
        largest = max(least, *(float(np.max(np.abs(v))) for v in values if np.size(v)))
        ax = self.axes[panel]
        now = ax.get_ylim()[1]
        if not 0.45 * now <= 1.05 * largest <= now or (symmetric and ax.get_ylim()[0] != -now):
            decade = 10.0 ** np.floor(np.log10(1.05 * largest))
            now = next(s * decade for s in (1, 1.5, 2, 3, 5, 7, 10) if s * decade >= 1.05 * largest * (1 - 1e-12))
        self.limits(panel, y=(-now if symmetric else 0.0, now))

    def begin(self) -> None:
        """Forget what the last step drew."""
        self._used.clear()
        self._drawn.clear()

    def sentence(self, words: str) -> None:
        """Say in the middle of the picture why there is nothing to see."""
        key = ("", "sentence")
        if key not in self._pools:
            box = {"boxstyle": "round,pad=0.8", "facecolor": "white", "edgecolor": ALARM, "linewidth": 1.5}
            text = self.figure.text(
                0.5,
                0.5,
                "",
                ha="center",
                va="center",
                color=ALARM,
                fontsize=11.5,
                zorder=100,
                bbox=box,
                animated=True,
                in_layout=False,
            )
            self._pools[key] = [(text, {})]
        text = self._pools[key][0][0]
        text.set_text(textwrap.fill(words, int(8.5 * self.figure.get_figwidth())))
        self._drawn.append(text)

    def png(self) -> bytes:
        """Draw the step and return it as a PNG."""
        renderer = self.canvas.get_renderer()
        self._draw_background(renderer)
        for artist in sorted(self._drawn, key=lambda a: a.get_zorder()):
            artist.draw(renderer)
        pixels = np.asarray(self.canvas.buffer_rgba())
        image = Image.frombuffer("RGBA", self.canvas.get_width_height(), pixels, "raw", "RGBA", 0, 1)
        file = io.BytesIO()
        # 64 colours are enough for lines on white, and half the size and time of all colours.
        image.convert("RGB").quantize(64, method=Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE).save(
            file, "PNG", compress_level=1
        )
        return file.getvalue()

    def _draw_background(self, renderer) -> None:
        """Put together what does not change under the present limits."""
        if self._blank is None:
            with mpl.rc_context(_RC):
                for ax in self.axes.values():
                    # Room for numbers one digit longer than the first ones.
                    ax.yaxis.labelpad += 8
                self.canvas.draw()
                # From here on panels and labels stay where they are, whatever the numbers at the ticks.
                self.figure.set_layout_engine("none")
                for ax in self.axes.values():
                    x, _ = ax.yaxis.label.get_position()
                    ax.yaxis.set_label_coords((x - ax.bbox.x0) / ax.bbox.width, 0.5)
                    ax.set_visible(False)
                self.canvas.draw()
                for ax in self.axes.values():
                    ax.set_visible(True)
            self._blank = np.array(self.canvas.buffer_rgba())
        images = [self._panel_image(renderer, name) for name in self.axes]
        pixels = np.asarray(self.canvas.buffer_rgba())
        pixels[:] = self._blank
        for where, image in images:
            # Dark on white: the darker pixel is the drawn one, should labels of two panels touch.
            np.minimum(pixels[where], image, out=pixels[where])

    def _panel_image(self, renderer, name: str):
        """Axes and ticks of one panel: where they are in the picture, and their pixels."""
        ax, known = self.axes[name], self._panels[name]
        key = (*ax.get_xlim(), *ax.get_ylim())
        if key not in known:
            renderer.clear()
            with mpl.rc_context(_RC):
                self.figure.patch.draw(renderer)
                ax.draw(renderer)
                box = ax.get_tightbbox(renderer) or ax.bbox
            width, height = self.canvas.get_width_height()
            rows = slice(max(0, height - int(box.y1) - 3), max(0, height - int(box.y0) + 3))
            where = rows, slice(max(0, int(box.x0) - 3), int(box.x1) + 4)
            known[key] = where, np.asarray(self.canvas.buffer_rgba())[where].copy()
            self.panel_draws += 1
            if len(known) > 12:
                known.popitem(last=False)
        known.move_to_end(key)
        return known[key]

    def _artist(self, panel: str, kind: str, style: dict, make):
        """The next artist of its kind in this step, made when there is none, with the style asked for."""
        if panel not in self.axes:
            raise KeyError(f"there is no panel {panel!r}; allowed: {', '.join(self.axes)}")
        pool = self._pools.setdefault((panel, kind), [])
        k = self._used.get((panel, kind), 0)
        self._used[panel, kind] = k + 1
        if k == len(pool):
            with mpl.rc_context(_RC):
                artist = make(self.axes[panel], style)
            artist.set_animated(True)
            artist.set_in_layout(False)
            pool.append((artist, style))
        artist, last = pool[k]
        if last != style:
            artist.set(**style)
            pool[k] = (artist, style)
        self._drawn.append(artist)
        return artist
