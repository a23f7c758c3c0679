"""Stored pictures with words: what a reader hears where a picture is not seen.

The words of a cell's pictures stand in its metadata as ``alt``: one text, or a list with one text per picture.
JupyterLab leaves out the words of ``image/png``, so each picture is stored twice: as HTML with a small WebP inside,
which JupyterLab and the exported pages prefer, and as a PNG of 256 colours for whatever shows no HTML.
"""

from __future__ import annotations

import base64
import html
import io
import re

import nbformat
from PIL import Image

PNG, HTML, TEXT = "image/png", "text/html", "text/plain"
_WORDS = re.compile(r"<img\b[^>]*?\balt=\"([^\"]*)\"", re.S)


def words(cell: nbformat.NotebookNode) -> list[str]:
    """The texts that a cell's metadata hold for its pictures."""
    alt = cell.metadata.get("alt", [])
    return [alt] if isinstance(alt, str) else list(alt)


def spoken(output: nbformat.NotebookNode) -> str:
    """The words inside an output's HTML, such as those that a film brings along; empty without any."""
    found = _WORDS.findall(output.get("data", {}).get(HTML, ""))
    return html.unescape(found[0]).strip() if found else ""


def pictures(cell: nbformat.NotebookNode) -> list[nbformat.NotebookNode]:
    """The outputs of a code cell that show a picture."""

    def shows(output) -> bool:
        data = output.get("data", {})
        return PNG in data or "<img" in data.get(HTML, "")

    return [o for o in cell.get("outputs", []) if shows(o)]


def encoded(image: Image.Image, form: str, **options) -> bytes:
    """An image as bytes of a file."""
    file = io.BytesIO()
    image.save(file, form, **options)
    return file.getvalue()


def small_webp(image: Image.Image) -> bytes:
    """The image without loss, or nearly so where that is smaller."""
    return min(encoded(image, "WEBP", lossless=True, method=6), encoded(image, "WEBP", quality=90, method=6), key=len)


def small_png(image: Image.Image) -> bytes:
    """The image in 256 colours."""
    return encoded(image.quantize(256, dither=Image.Dither.NONE), "PNG", optimize=True)


def text64(raw: bytes) -> str:
    """Bytes as base64."""
    return base64.b64encode(raw).decode("ascii")


def tell(output: nbformat.NotebookNode, text: str) -> None:
    """Give one stored picture its words."""
    data, image = output.data, Image.open(io.BytesIO(base64.b64decode(output.data[PNG]))).convert("RGB")
    size = output.metadata.get(PNG, {})
    scale = image.width / size.get("width", image.width)
    data[HTML] = (
        f'<img alt="{html.escape(text)}" width="{image.width / scale:.0f}" height="{image.height / scale:.0f}"'
        f' style="max-width: 100%; height: auto" src="data:image/webp;base64,{text64(small_webp(image))}">'
    )
    data[PNG], data[TEXT] = text64(small_png(image)), text
    output.metadata = nbformat.from_dict({PNG: {**size, "alt": text}})


def describe(cell: nbformat.NotebookNode) -> None:
    """Give a cell's stored pictures the words of its metadata, in their order; those that bring words keep them."""
    silent = [output for output in pictures(cell) if not spoken(output)]
    for output, text in zip(silent, words(cell), strict=False):
        tell(output, text)
