"""Short films for the lessons: a picture that moves a few seconds, stops, and says in words what it shows."""

from __future__ import annotations

import base64
import html
import io
import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib.style
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image, ImageColor

from ..machine.arguments import of_kind, short, whole_number
from .style import ARM_COLOURS, STYLE

LARGEST = 120_000  # bytes; a notebook holds several films
_WEBP = "a file name that ends in .webp, the form of a film"
_FEWEST = 8  # frames, of a film that would be larger with all
# Where the kernel itself runs in a browser (Pyodide), drawing a frame takes most of a second.
_MOST_FRAMES = 8 if sys.platform == "emscripten" else None


@dataclass(frozen=True)
class Film:
    """A film as bytes: an animated WebP, its poster (WebP, and PNG for what shows no HTML), and its words.

    In a notebook it shows itself; who asks the system for less motion sees the poster.  `note`: what stands below it.
    """

    moving: bytes
    poster: bytes
    png: bytes
    size: tuple[int, int]
    alt: str
    note: str = ""

    def save(self, path: str | Path) -> None:
        """Write the animated WebP to a file; raises ValueError unless its name ends in ".webp"."""
        if Path(of_kind("path", path, str | Path, _WEBP)).suffix.lower() != ".webp":
            raise ValueError(f"path = {short(str(path))}; allowed: {_WEBP}")
        Path(path).write_bytes(self.moving)

    def _repr_mimebundle_(self, include=None, exclude=None) -> dict[str, str]:
        words, (width, height) = html.escape(self.alt), self.size
        page = (
            f'<picture><source media="(prefers-reduced-motion: reduce)" srcset="{_address(self.poster)}">'
            f'<img alt="{words}" width="{width}" height="{height}" style="max-width: 100%; height: auto"'
            f' src="{_address(self.moving)}"></picture>'
        )
        page += f"<br><small>{html.escape(self.note)}</small>" if self.note else ""
        return {"text/html": page, "image/png": base64.b64encode(self.png).decode("ascii"), "text/plain": self.alt}

    def __repr__(self) -> str:
        return f"Film({self.alt!r}, {len(self.moving) / 1000:.0f} kB)"


def _address(webp: bytes) -> str:
    return "data:image/webp;base64," + base64.b64encode(webp).decode("ascii")


def _file(image: Image.Image, form: str, **options) -> bytes:
    out = io.BytesIO()
    image.save(out, form, **options)
    return out.getvalue()


def _shots(draw: Callable, steps: list, panels: int, figsize: tuple[float, float], dpi: float) -> list[Image.Image]:
    """One picture per step; the axes stay where the first picture has them, so that nothing jumps."""
    fig = Figure(figsize=figsize, dpi=dpi, layout="constrained")
    canvas = FigureCanvasAgg(fig)
    places: list = []
    shots = []
    for step in steps:
        fig.clear()
        axes = fig.subplots(1, panels)
        draw(axes, step)
        if places:
            fig.set_layout_engine("none")
            for ax, place in zip(fig.axes, places, strict=False):
                ax.set_position(place)
        canvas.draw()
        places = places or [ax.get_position(original=True) for ax in fig.axes]
        shots.append(Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB"))
    return shots


def _moving(shots: list[Image.Image], seconds: float, rest: float, loops: int) -> bytes:
    """The animated WebP in equal steps, whose last picture rests.

    Lines and flat colours are smallest without loss in few colours, one set for all frames.
    """
    each = round(1000 * seconds / len(shots))
    durations = [each] * (len(shots) - 1) + [each + round(1000 * rest)]
    some = [np.asarray(shot) for shot in shots[:: max(1, len(shots) // 6)] + shots[-1:]]
    # Thin lines have few pixels: without a stripe of its own an arm's colour, full or half as strong, would be merged
    # with another one.
    full = np.array([ImageColor.getrgb(colour) for colour in ARM_COLOURS])
    stripes = np.concatenate([full, np.round(255 - 0.55 * (255 - full))]).astype(np.uint8)
    stripes = np.resize(np.repeat(stripes, 20, axis=0), (len(some[0]) // 4, some[0].shape[1], 3))
    sheet = Image.fromarray(np.concatenate([*some, stripes]))
    for colours in (48, 24):
        palette = sheet.quantize(colours, dither=Image.Dither.NONE)
        flat = [shot.quantize(palette=palette, dither=Image.Dither.NONE) for shot in shots]
        tones = np.reshape(palette.getpalette() or [], (-1, 3))
        tones[np.asarray(flat[0])[0, 0]] = np.asarray(shots[0])[0, 0]  # the paper stays white
        for shot in flat:
            shot.putpalette(tones.ravel().tolist())
        flat = [shot.convert("RGB") for shot in flat]
        timing = {"duration": durations, "loop": loops}
        film = _file(flat[0], "WEBP", save_all=True, append_images=flat[1:], lossless=True, method=4, **timing)
        if len(film) <= LARGEST:
            break
    return film


def _kept(count: int, most: int, poster: int) -> list[int]:
    """About `most` of `count` indices, evenly; first, last and poster are among them."""
    return sorted({*np.linspace(0, count - 1, most).round().astype(int).tolist(), poster % count})


def film(
    draw: Callable[[Any, Any], Any],
    frames: Iterable,
    alt: str,
    *,
    panels: int = 1,
    figsize: tuple[float, float] = (4.8, 3.6),
    seconds: float = 5.0,
    rest: float = 1.5,
    loops: int = 2,
    poster: int = -1,
    dpi: float = 96,
    most: int | None = _MOST_FRAMES,
) -> Film:
    """A film of ``draw(ax, step)``, called for every step of `frames` on empty axes; for the last line of a cell.

    alt : what is seen and what it shows, one or two sentences.
    panels : axes side by side; `draw` gets them as an array when there are several.
    figsize : width and height in inches, at `dpi`.
    seconds : of motion, in equal steps.  rest : seconds that the last frame stays.
    loops : how often it plays; it always stops, on its last frame.
    poster : index of the frame that stands for the film where motion is not wanted; -1 is the last one.
    most : the most frames; of more, some are left out, and the film says so.  In a browser's own kernel 8, else all.
        Some are left out, too, where all would make more than 120 kB.

    Set the limits of the axes in `draw`.  Raises ValueError without words or time, with fewer than two frames,
    with loops < 1, or when eight frames would make more than 120 kB.

    >>> import numpy as np; from rapkm_lite import plotting
    >>> plotting.film(lambda ax, s: ax.plot([0, np.cos(s)], [0, np.sin(s)]), np.linspace(0, 1, 3), "A hand turns.").alt
    'A hand turns.'
    """
    steps = list(frames)
    if not alt.strip():
        raise ValueError(f"alt = {alt!r}; allowed: a sentence that says what is seen and what it shows")
    if len(steps) < 2:
        raise ValueError(f"frames has {len(steps)} steps; allowed: two or more")
    poster = whole_number("poster", poster, -1, len(steps) - 1)
    if not seconds > 0 or not rest >= 0:
        raise ValueError(f"seconds = {seconds}, rest = {rest}; allowed: a positive time, and a time of rest or 0")
    if loops < 1:
        raise ValueError(f"loops = {loops}; allowed: 1 or more, a film comes to its end")
    if most is not None and most < 2:
        raise ValueError(f"most = {most}; allowed: two or more, or None for all")
    count, note = len(steps), ""
    if most is not None and len(steps) > most:
        kept = _kept(len(steps), most, poster)
        note = f"{len(kept)} of {count} pictures, because drawing them takes long here."
        steps, poster = [steps[k] for k in kept], kept.index(poster % len(steps))
    with matplotlib.style.context(STYLE):
        shots = _shots(draw, steps, panels, figsize, dpi)
    still = shots[poster]
    while len(moving := _moving(shots, seconds, rest, loops)) > LARGEST:
        if len(shots) <= _FEWEST:
            raise ValueError(
                f"frames: {len(shots)} pictures of {still.width} x {still.height} make {len(moving) / 1000:.0f} kB; "
                f"allowed: {LARGEST / 1000:.0f} kB, so take a smaller figsize"
            )
        shots = [shots[k] for k in _kept(len(shots), 3 * len(shots) // 4, -1)]
        note = f"{len(shots)} of {count} pictures, because all of them make more than {LARGEST / 1000:.0f} kB."
    small = _file(still.quantize(256, dither=Image.Dither.NONE), "PNG", optimize=True)
    return Film(moving, _file(still, "WEBP", quality=85, method=6), small, still.size, alt, note)
