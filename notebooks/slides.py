"""Slides of a lesson: one HTML file that needs nothing else, for a projector without a network.

    python notebooks/slides.py 04                # writes slides_04.html
    python notebooks/slides.py 04 talk.html

Made from the stored headings, formulas, pictures, questions and exercises; folded parts are left out.  Each question
keeps its answers, closed until somebody clicks or presses A, which opens the next one and then closes all.  Arrow keys
turn the pages, the browser prints one page per slide while answers are closed.  Formulas need ``latex2mathml`` (in
``docs/requirements.txt``).
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import nbformat

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))


def main(number: str, target: str = "") -> int:
    """Write the slides of the lesson with this number; 2 when that cannot be done."""
    found = sorted(HERE.glob(f"{number}_*.ipynb"))
    if len(found) != 1:
        allowed = ", ".join(path.stem[:2] for path in sorted(HERE.glob("[0-9][0-9]_*.ipynb")))
        print(f"lesson = {number!r}; allowed: {allowed}", file=sys.stderr)
        return 2
    try:
        from workshop.deck import page, slides
    except ModuleNotFoundError as error:
        print(f"{error.name} is missing; allowed after: python -m pip install {error.name}", file=sys.stderr)
        return 2
    notebook = nbformat.read(found[0], as_version=4)
    path = Path(target or f"slides_{number}.html")
    try:
        path.write_text(page(notebook), encoding="utf-8")
    except OSError as error:
        print(f"target = {target!r} ({error.strerror}); allowed: a file in a folder that exists", file=sys.stderr)
        return 2
    print(f"{path}: {len(slides(notebook))} slides, {path.stat().st_size / 1e6:.1f} MB")
    return 0


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("number", nargs="?", default="", help="of the lesson, such as 04")
    parser.add_argument("target", nargs="?", default="", help="file to write (slides_04.html)")
    sys.exit(main(**vars(parser.parse_args())))
