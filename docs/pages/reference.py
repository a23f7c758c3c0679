"""The reference: a page per room with every public name, made from the package as it is."""

from __future__ import annotations

import inspect
import re
from pathlib import Path

import rapkm_lite
from pages.hooks import escaped, readable
from rapkm_lite import checks, explore, plotting

ROOMS = {
    "machine": "The machine and its data",
    "mechanics": "Kinematics, dynamics, actuation and antagonism",
    "control": "Control laws",
    "simulation": "Runs, energies and experiments",
}
DOORS = {
    "explore": ("Explorers", explore),
    "plotting": ("Figures", plotting),
    "checks": ("Exercises", checks),
}


def rooms() -> dict[str, list[str]]:
    """Public names of `rapkm_lite` by room."""
    found: dict[str, list[str]] = {room: [] for room in ROOMS}
    for name in sorted(rapkm_lite.__all__, key=str.lower):
        found[getattr(rapkm_lite, name).__module__.split(".")[1]].append(name)
    return found


def page_of() -> dict[str, str]:
    """The page of each public name of `rapkm_lite`."""
    return {name: room for room, names in rooms().items() for name in names}


def _names(module) -> list[str]:
    """What a door offers: functions and classes of this package, without what the door itself is made with."""
    listed = getattr(module, "__all__", None) or [n for n in dir(module) if not n.startswith("_") and n != "guarded"]
    values = {name: getattr(module, name) for name in listed}
    return [n for n, v in values.items() if callable(v) and getattr(v, "__module__", "").startswith("rapkm_lite")]


def _line(module: str, source, name: str) -> str:
    """A name that leads to its entry, and the first sentence of its docstring."""
    paragraph = " ".join(inspect.getdoc(getattr(source, name)).split("\n\n")[0].split())
    first = re.split(r"(?<=[.?])\s+(?=[A-Z])", paragraph)[0]
    return f"* :py:obj:`{name} <{module}.{name}>`: {escaped(first)}"


def _conventions(module) -> list[str]:
    """What the docstring of a module says of all its functions: the paragraphs after the first, without the example."""
    return readable(inspect.getdoc(module).split(">>>")[0].rstrip().splitlines()[2:])


def _page(title: str, module: str, source, names: list[str]) -> str:
    lines = [title, "=" * len(title), "", f".. currentmodule:: {module}", ""]
    if source is not rapkm_lite:
        lines += [*_conventions(source), ""]
    for name in names:
        kind = "class" if inspect.isclass(getattr(source, name)) else "function"
        lines += [f".. auto{kind}:: {module}.{name}", *(["   :members:", ""] if kind == "class" else [""])]
    return "\n".join(lines)


def write(folder: Path) -> None:
    """All pages, and the page that lists them."""
    folder.mkdir(parents=True)
    parts = {room: (ROOMS[room], "rapkm_lite", rapkm_lite, names) for room, names in rooms().items()}
    parts |= {door: (title, f"rapkm_lite.{door}", module, _names(module)) for door, (title, module) in DOORS.items()}
    words = "Every public name, by the room of the package where it lives; ``rk`` stands for ``rapkm_lite``."
    lines = [
        "Reference",
        "=========",
        "",
        words,
        "",
        ".. currentmodule:: rapkm_lite",
        "",
        *_conventions(rapkm_lite),
        "",
        ".. toctree::",
        "   :hidden:",
        "",
        *(f"   {p}" for p in parts),
        "",
    ]
    for part, (title, module, source, names) in parts.items():
        (folder / f"{part}.rst").write_text(_page(title, module, source, names), encoding="utf-8")
        lines += [title, "-" * len(title), "", f".. currentmodule:: {module}", ""]
        lines += [*(_line(module, source, name) for name in names), ""]
    (folder / "index.rst").write_text("\n".join(lines), encoding="utf-8")
