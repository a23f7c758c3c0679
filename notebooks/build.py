"""Make the lessons: student copies from the solutions, all executed from a clean kernel, outputs stored.

    python notebooks/build.py                # everything
    python notebooks/build.py 03 04          # the notebooks whose names begin so
    python notebooks/build.py overview       # the picture of the README
    python notebooks/build.py figures        # nothing but the list of all figures
    python notebooks/build.py new 13_title   # a new lesson from the skeleton: notebook, figures, exercises

``solutions/NN_name.ipynb`` is the source of a lesson with exercises; lines between ``### BEGIN SOLUTION`` and
``### END SOLUTION`` become one line ``raise NotImplementedError`` (in a function) or ``...`` (after an assignment) in
``NN_name.ipynb``, and links ``(../page)`` become ``(page)``.  Notebooks without a solution are executed as they are.
``rapkm_lite/plotting.py``, the list of all figures, is written anew each time.
"""

from __future__ import annotations

import ast
import os
import re
import sys
from pathlib import Path

import nbformat

HERE = Path(__file__).resolve().parent
SOLUTIONS = HERE / "solutions"
PACKAGE = HERE.parent / "rapkm_lite"
WIDGET = "application/vnd.jupyter.widget-view+json"
_SOLUTION = re.compile(r"^([ \t]*)### BEGIN SOLUTION *\n(.*?)^[ \t]*### END SOLUTION *\n?", re.M | re.S)


def blank(source: str) -> str:
    """A code cell with its solutions taken out."""

    def stub(match: re.Match) -> str:
        indent, body = match.groups()
        if indent:
            return f"{indent}raise NotImplementedError\n"
        names = dict.fromkeys(re.findall(r"^(\w+) *=[^=]", body, re.M))
        return "".join(f"{name} = ...\n" for name in names)

    return _SOLUTION.sub(stub, source if source.endswith("\n") else source + "\n").rstrip("\n")


def student(notebook: nbformat.NotebookNode) -> nbformat.NotebookNode:
    """The student's copy of a solved lesson, without outputs; links are meant from its folder, one level up."""
    copy = nbformat.from_dict(notebook)
    copy = nbformat.reads(nbformat.writes(copy), as_version=4)
    for cell in copy.cells:
        if cell.cell_type == "code":
            cell.source, cell.outputs, cell.execution_count = blank(cell.source), [], None
        else:
            cell.source = cell.source.replace("](../", "](")
    return copy


def bare_widget(output: nbformat.NotebookNode) -> bool:
    """True for a widget with nothing but its repr beside it, of which nothing is left without a kernel."""
    data = output.get("data", {})
    return WIDGET in data and set(data) <= {WIDGET, "text/plain"}


def tidy(notebook: nbformat.NotebookNode) -> None:
    """Keep what a reader sees: no widget state, no time stamps, no versions of this machine."""
    notebook.metadata = nbformat.from_dict(
        {
            "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
            "language_info": {"name": "python"},
        }
    )
    for number, cell in enumerate(notebook.cells):
        cell.id = f"cell-{number:02d}"
        cell.metadata = nbformat.from_dict({"tags": cell.metadata["tags"]} if cell.metadata.get("tags") else {})
        if cell.cell_type == "code":
            cell.outputs = [o for o in cell.outputs if not bare_widget(o)]
            for output in cell.outputs:
                output.get("data", {}).pop(WIDGET, None)


def execute(path: Path, strict: bool) -> None:
    """Run a notebook from a clean kernel in its folder and store the outputs."""
    from nbclient import NotebookClient

    os.environ["RAPKM_LITE_STRICT"] = "1" if strict else "0"
    notebook = nbformat.read(path, as_version=4)
    for cell in notebook.cells:
        if cell.cell_type == "code":
            cell.outputs, cell.execution_count = [], None
    NotebookClient(notebook, timeout=300, kernel_name="python3", resources={"metadata": {"path": str(HERE)}}).execute()
    tidy(notebook)
    nbformat.write(notebook, path)


def overview() -> None:
    """The picture of the README."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    import rapkm_lite as rk
    from rapkm_lite import plotting

    plotting.use_style()
    robot = rk.load().replace(friction=0.0)
    path, law = rk.triangle(robot), rk.PD(7.05, 0.225)
    offset = [4e-3, -2e-3, 5e-3]
    fight = rk.simulate(robot, law, path, offset)
    calm = rk.simulate(robot, rk.AntagonismFilter(law), path, offset)
    fig, axes = plt.subplots(1, 3, figsize=(12, 3.7), width_ratios=[1, 1.25, 1.25])
    plotting.plot_workspace(robot, axes[0])
    plotting.plot_path(path, axes[0])
    plotting.plot_machine(robot, path.q[3300], axes[0])
    for ax, run, title in ((axes[1], fight, "three drives, milliradian offsets"), (axes[2], calm, "with the filter")):
        plotting.plot_torques(run, ax, f"{title}: {run.energy.sum():.2f} J")
        ax.set_ylim(-55, 55)
    fig.savefig(HERE / "overview.png")


def defined(path: Path) -> list[str]:
    """Public functions and constants that a module defines, without what it imports."""
    body = ast.parse(path.read_text(encoding="utf-8")).body
    names = [node.name for node in body if isinstance(node, ast.FunctionDef)]
    for node in body:
        if isinstance(node, ast.Assign):
            targets = node.targets[0].elts if isinstance(node.targets[0], ast.Tuple) else node.targets
            names += [target.id for target in targets]
    # Constants before functions, as the import sorter has them.
    return sorted((n for n in names if not n.startswith("_")), key=lambda n: (not n.isupper(), n))


def figure_list() -> str:
    """The text of ``rapkm_lite/plotting.py``: every figure of the shared room and of every lesson, by name."""
    rooms = sorted(PACKAGE.glob("figures/[!_]*.py")) + sorted(PACKAGE.glob("lessons/lesson*/figures.py"))
    owner, text = (
        {},
        [
            '"""Every figure under one name: ``plotting.plot_x(..., ax=None) -> ax``; one colour per arm everywhere.',
            "",
            "Written by ``python notebooks/build.py``, for editors and readers; the figures live in the modules below.",
            '"""',
            "",
        ],
    )
    for path in rooms:
        module = "." + ".".join(path.relative_to(PACKAGE).with_suffix("").parts)
        names = [n for n in defined(path) if module.startswith(".figures") or n.startswith("plot_")]
        for name in names:
            if name in owner:
                raise ValueError(f"{name} stands in {owner[name]} and in {module}; allowed: one figure of that name")
            owner[name] = module
        if names:
            text += [f"from {module} import (", *(f"    {name}," for name in names), ")"]
    return "\n".join([*text, "", "__all__ = [", *(f'    "{name}",' for name in sorted(owner)), "]", ""])


def cells(text: str) -> list[nbformat.NotebookNode]:
    """Cells of a notebook written as text: a line ``# %%``, ``# %% [markdown]`` or ``# %% tags=[...]`` begins each one.

    Lines of Markdown stand behind ``# ``.
    """
    made = []
    for block in re.split(r"^# %%", text, flags=re.M)[1:]:
        head, _, body = block.partition("\n")
        if "[markdown]" in head:
            made.append(nbformat.v4.new_markdown_cell(re.sub(r"^# ?", "", body, flags=re.M).strip()))
        else:
            tags = ast.literal_eval(head.partition("=")[2] or "[]")
            made.append(nbformat.v4.new_code_cell(body.strip(), metadata={"tags": tags} if tags else {}))
    return made


def new(name: str) -> None:
    """Lay out a lesson: its source in ``solutions/``, its room in ``rapkm_lite/lessons/``, its line in the README.

    Raises ValueError when the name is not like 13_title or its number is taken.
    """
    number, _, words = name.partition("_")
    room = PACKAGE / "lessons" / f"lesson{number}"
    if not re.fullmatch(r"\d\d_[a-z0-9_]+", name) or room.exists():
        raise ValueError(f"name = {name!r}; allowed: a number that no lesson has, and words, like 13_title")

    def filled(path: Path) -> str:
        return path.read_text(encoding="utf-8").replace("NN", number).replace("TITLE", words.replace("_", " "))

    skeleton = HERE / "skeleton"
    room.mkdir()
    (room / "__init__.py").write_text(f'"""Lesson {number}: {words.replace("_", " ")}."""\n', encoding="utf-8")
    for part in ("figures.py", "exercises.py"):
        (room / part).write_text(filled(skeleton / part), encoding="utf-8")
    notebook = nbformat.v4.new_notebook(cells=cells(filled(skeleton / "lesson.py")))
    tidy(notebook)
    nbformat.write(notebook, SOLUTIONS / f"{name}.ipynb")
    readme = HERE.parent / "README.md"
    question = notebook.cells[0].source.splitlines()[0].removeprefix("# ").partition(" · ")[2]
    lines = readme.read_text(encoding="utf-8").splitlines(keepends=True)
    last = max(k for k, line in enumerate(lines) if re.match(r"\| \[\d\d_", line))
    lines.insert(last + 1, f"| [{name}](notebooks/{name}.ipynb) | {question} | 20 | – | – |\n")
    readme.write_text("".join(lines), encoding="utf-8")
    (PACKAGE / "plotting.py").write_text(figure_list(), encoding="utf-8")
    print(f"Write solutions/{name}.ipynb and rapkm_lite/lessons/lesson{number}/, then run build.py {number}")


def main(wanted: list[str]) -> None:
    """Build the notebooks whose names begin with one of `wanted`, or all."""

    def chosen(path: Path) -> bool:
        return not wanted or any(path.name.startswith(w) for w in wanted)

    (PACKAGE / "plotting.py").write_text(figure_list(), encoding="utf-8")
    solved = {path.name for path in SOLUTIONS.glob("*.ipynb")}
    for path in sorted(filter(chosen, SOLUTIONS.glob("*.ipynb"))):
        print(f"solutions/{path.name}", flush=True)
        execute(path, strict=True)
        nbformat.write(student(nbformat.read(path, as_version=4)), HERE / path.name)
    for path in sorted(filter(chosen, HERE.glob("*.ipynb"))):
        print(path.name, "" if path.name in solved else "(no exercises)", flush=True)
        execute(path, strict=False)
    if not wanted or "overview" in wanted:
        overview()


if __name__ == "__main__":
    if sys.argv[1:2] == ["new"]:
        new(*sys.argv[2:])
    else:
        main(sys.argv[1:])
