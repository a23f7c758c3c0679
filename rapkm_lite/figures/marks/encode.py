"""Marks as a message for the canvas: a header for JSON and buffers of 32-bit numbers."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np

from .palette import canvas_style
from .picture import Mark, Picture


def scene(picture: Picture) -> dict:
    """What the canvas must know once: panels, their places and labels."""
    plain = {
        name: {k: v if isinstance(v, str) else np.asarray(v).tolist() for k, v in panel.items()}
        for name, panel in picture.panels.items()
    }
    return {"panels": plain, "layout": picture.layout, "widths": picture.widths, "size": picture.size}


def encode(picture: Picture, marks: list[Mark], known: dict) -> tuple[dict, list[bytes]]:
    """Header and buffers of `marks` with the frames and handles of the picture.

    known : what the other side has been told; styles and maps that are in it are not sent again.  A mark is
    [kind, panel, style, count of points, words?]; the points of all marks follow each other in the first buffer, the
    values of new maps stand in the others.
    """
    styles: dict[int, dict] = {}
    told, known = known, known.copy()
    images, buffers, parts, rows = {}, [], [], []

    def style_of(kind: str, style: dict) -> int:
        key = (kind, tuple(style.items()))
        if key not in known:
            known[key] = len(known)
            styles[known[key]] = canvas_style(*key)
        return known[key]

    for mark in marks:
        row = [mark.kind, mark.panel, None, len(mark.data)]
        if mark.kind == "legend":
            row.append([[words, style_of("line", style)] for words, style in mark.words])
        elif mark.kind == "scale":
            row.append([asdict(mark.words[0]), mark.words[1]])
        else:
            row[2] = style_of(mark.kind, mark.style)
        if mark.kind == "image":
            values, extent, palette = mark.words
            key = ("image", id(values))
            if key not in known:
                # The array is kept with its number, which is its own only as long as it lives.
                known[key] = (len(known), values)
                filled = np.ma.filled(np.ma.asarray(values, dtype=np.float32), np.nan)
                images[known[key][0]] = [*filled.shape, *extent]
                buffers.append(filled.astype("<f4").tobytes())
            row.append([known[key][0], asdict(palette)])
        elif mark.kind in ("label", "words", "title"):
            row.append(mark.words)
        rows.append(row)
        parts.append(mark.data.ravel())
    handles = [_handle(handle) for handle in picture.handles]
    numbers = np.concatenate(parts) if parts else np.empty(0)
    # Only what goes out is known there.
    told.update(known)
    header = {"marks": rows, "styles": styles, "images": images, "frames": picture.frames, "handles": handles}
    return header, [numbers.astype("<f4").tobytes(), *buffers]


def _handle(handle: dict) -> dict:
    """A handle as the canvas reads it."""
    entry = {"panel": handle["panel"], "at": [None if v is None else float(v) for v in handle["at"]]}
    if handle["along"] is None:
        entry["set"] = {k: [float(v) for v in (*values, 0.0)[:3]] for k, values in handle["set"].items()}
    else:
        entry["set"] = {k: np.asarray(values).tolist() for k, values in handle["set"].items()}
        entry["along"] = np.round(handle["along"], 6).ravel().tolist()
    if handle["grip"] is not None:
        entry["grip"] = np.asarray(handle["grip"], dtype=float).tolist()
    return entry
