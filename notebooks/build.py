"""Make the lessons: student copies from the solutions, all executed from a clean kernel, outputs stored.

    python notebooks/build.py                # everything
    python notebooks/build.py 03 04          # the notebooks whose names begin so
    python notebooks/build.py figures        # nothing but the list of all figures
    python notebooks/build.py nbgrader FOLDER 04   # lessons for nbgrader: FOLDER/source/..., from the solutions
    python notebooks/build.py teaching       # nothing but the teachers' pages that follow from the lessons
    python notebooks/build.py new 13_title   # a new lesson from the skeleton: notebook, figures, exercises, answers
    python notebooks/build.py 13 teaching    # that lesson, and the teachers' pages
    python notebooks/build.py mystery        # nothing but the logs of data/mystery_runs

``solutions/NN_name.ipynb`` is the source of a lesson with exercises; lines between ``### BEGIN SOLUTION`` and
``### END SOLUTION`` become one line ``raise NotImplementedError`` (in a function) or ``...`` (after an assignment) in
``NN_name.ipynb``, and links ``(../page)`` become ``(page)``.  Notebooks without a solution are executed as they are.
Stored with every notebook: outputs of cells tagged ``hide-output`` closed and behind a neutral first line, headings
that begin with "Dig deeper" folded, and each picture with the words of its cell's metadata ``alt``.
``rapkm_lite/plotting.py``, the list of all figures, is written anew each time.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

import nbformat

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

from workshop import mystery, nbgrader, teaching  # noqa: E402
from workshop.layout import PACKAGE, SOLUTIONS, figure_list, new  # noqa: E402
from workshop.storing import COVER, blank, student, tidy  # noqa: E402, F401


def execute(path: Path, strict: bool) -> None:
    """Run a notebook from a clean kernel in its folder and store the outputs."""
    from nbclient import NotebookClient

    os.environ["RAPKM_LITE_STRICT"] = "1" if strict else "0"
    os.environ.pop("MPLBACKEND", None)  # with another backend than the notebook's no picture would be stored
    notebook = nbformat.read(path, as_version=4)
    for cell in notebook.cells:
        if cell.cell_type == "code":
            cell.outputs, cell.execution_count = [], None
    folder = {"metadata": {"path": str(HERE)}}
    NotebookClient(notebook, timeout=300, kernel_name="python3", resources=folder).execute()
    tidy(notebook)
    nbformat.write(notebook, path)


def main(wanted: list[str]) -> None:
    """Build the notebooks whose names begin with one of `wanted`, or all."""

    def chosen(path: Path) -> bool:
        return not wanted or any(path.name.startswith(w) for w in wanted)

    for word in wanted:
        if word not in ("figures", "teaching") and not any(
            path.name.startswith(word) for path in HERE.rglob("*.ipynb")
        ):
            sys.exit(
                f"no notebook begins with {word!r}; allowed: the beginning of a notebook's name, figures, teaching, "
                "new TITLE, nbgrader FOLDER, mystery"
            )
    (PACKAGE / "plotting.py").write_text(figure_list(), encoding="utf-8")
    solved = {path.name for path in SOLUTIONS.glob("*.ipynb")}
    for path in sorted(filter(chosen, SOLUTIONS.glob("*.ipynb"))):
        print(f"solutions/{path.name}", flush=True)
        execute(path, strict=True)
        nbformat.write(student(nbformat.read(path, as_version=4)), HERE / path.name)
    for path in sorted(filter(chosen, HERE.glob("*.ipynb"))):
        print(path.name, "" if path.name in solved else "(no exercises)", flush=True)
        execute(path, strict=False)
    if not wanted or "teaching" in wanted:
        teaching.write()


if __name__ == "__main__":
    if {"-h", "--help"} & {*sys.argv}:
        print(__doc__)
    elif sys.argv[1:2] == ["new"]:
        try:
            new(*sys.argv[2:3] or [""])
        except ValueError as error:
            sys.exit(str(error))
    elif sys.argv[1:2] == ["nbgrader"]:
        if len(sys.argv) < 3:
            sys.exit("nbgrader needs a folder: python notebooks/build.py nbgrader FOLDER 04")
        try:
            print(*nbgrader.export(Path(sys.argv[2]), sys.argv[3:]), sep="\n")
        except ValueError as error:
            sys.exit(str(error))
    elif sys.argv[1:] == ["mystery"]:
        mystery.write()
    else:
        main(sys.argv[1:])
