"""The students' lessons that come with the package, copied without outputs; needs nothing but Python.

The build of the wheel uses it too, see `docs/package_data.py`.
"""

from __future__ import annotations

import json
import os
from pathlib import Path

# What a student gets beside the lessons: the pages that they link to.
PAGES = "equations.md", "errata.md"


def lesson_folder() -> Path:
    """Where the lessons are: in an installed copy, or in the checkout."""
    here = Path(__file__).resolve().parents[1]
    for folder in (here / "notebooks", here.parent / "notebooks"):
        if (folder / "00_start_here.ipynb").exists():
            return folder
    raise ValueError("this copy of rapkm_lite came without lessons; allowed: a wheel, or a clone of the repository")


def shipped(folder: Path) -> list[Path]:
    """The files of a folder that go to students: lessons, dashboard and pages, but no solutions."""
    notebooks = [*sorted(folder.glob("[0-9][0-9]_*.ipynb")), folder / "dashboard.ipynb"]
    return [path for path in (*notebooks, *(folder / name for name in PAGES)) if path.exists()]


def bare(text: str) -> str:
    """The text of a notebook without outputs and execution counts."""
    notebook = json.loads(text)
    for cell in notebook["cells"]:
        if cell["cell_type"] == "code":
            cell["outputs"], cell["execution_count"] = [], None
    return json.dumps(notebook, indent=1, ensure_ascii=False) + "\n"


def student_text(path: Path) -> str:
    """What a student gets of a file."""
    text = path.read_text(encoding="utf-8")
    return bare(text) if path.suffix == ".ipynb" else text


def copy_lessons(target: str | Path) -> list[Path]:
    """Copy the lessons into the folder `target`, which is made; returns the files written.

    Raises ValueError, and writes nothing, where one of them would be overwritten or the folder cannot be made.
    """
    try:
        target = Path(target).expanduser()
    except RuntimeError:
        raise ValueError(f"folder = {str(target)!r} names no user of this computer; allowed: a folder") from None
    files = shipped(lesson_folder())
    there = [path.name for path in files if os.path.exists(target / path.name)]
    if there:
        raise ValueError(f"{str(target)!r} holds {there[0]!r} already; allowed: a new or empty folder")
    try:
        target.mkdir(parents=True, exist_ok=True)
        for path in files:
            (target / path.name).write_text(student_text(path), encoding="utf-8", newline="\n")
    except OSError as error:
        raise ValueError(f"{str(target)!r} cannot be written ({error.strerror}); allowed: a folder") from None
    return [target / path.name for path in files]
