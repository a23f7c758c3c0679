"""The reference: a page per room with every public name, made from the package as it is."""

from __future__ import annotations

import inspect
from pathlib import Path

import rapkm_lite
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
    """What a door offers: functions and classes of this package."""
    listed = getattr(module, "__all__", None) or [n for n in dir(module) if not n.startswith("_")]
    values = {name: getattr(module, name) for name in listed}
    return [n for n, v in values.items() if callable(v) and getattr(v, "__module__", "").startswith("rapkm_lite")]


def _page(title: str, module: str, source, names: list[str]) -> str:
    lines = [title, "=" * len(title), "", f".. currentmodule:: {module}", ""]
    for name in names:
        kind = "class" if inspect.isclass(getattr(source, name)) else "function"
        lines += [f".. auto{kind}:: {module}.{name}", *(["   :members:", ""] if kind == "class" else [""])]
    return "\n".join(lines)


def write(folder: Path) -> None:
    """All pages, and the page that lists them."""
    folder.mkdir(parents=True)
    for room, names in rooms().items():
        (folder / f"{room}.rst").write_text(_page(ROOMS[room], "rapkm_lite", rapkm_lite, names), encoding="utf-8")
    for door, (title, module) in DOORS.items():
        text = _page(title, f"rapkm_lite.{door}", module, _names(module))
        (folder / f"{door}.rst").write_text(text, encoding="utf-8")
    listed = "\n".join([*ROOMS, *DOORS])
    title = "Reference"
    (folder / "index.md").write_text(
        f"# {title}\n\nEvery public name, by the room of the package where it lives; `rk` stands for `rapkm_lite`.\n\n"
        f"```{{toctree}}\n{listed}\n```\n",
        encoding="utf-8",
    )
