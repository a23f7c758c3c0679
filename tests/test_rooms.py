"""The order of the rooms: imports point downward, in functions too, and the engine has one door."""

import ast
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "rapkm_lite"
# From the ground up; a room may import from its own floor and those below.
ROOMS = ["machine", "mechanics", "control", "simulation", "figures", "lessons", "explore"]
# What users import; no room does.
DOORS = ["__init__", "__main__", "checks", "plotting"]
# A room that stands apart, and the only modules that open it.
KEYS = {"engine": {"simulation.compiled"}}
MODULES = {
    ".".join(p.relative_to(PACKAGE).with_suffix("").parts).removesuffix(".__init__"): p
    for p in sorted(PACKAGE.rglob("*.py"))
}


def imported(name):
    """Modules of the package that a module imports, wherever in its text."""
    package = ["rapkm_lite", *name.split(".")[: None if MODULES[name].name == "__init__.py" else -1]]
    if name == "__init__":
        package = ["rapkm_lite"]
    found = set()
    for node in ast.walk(ast.parse(MODULES[name].read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            start = package[: len(package) - node.level + 1] if node.level else []
            source = ".".join([*start, *([node.module] if node.module else [])])
            found |= {inner if is_module(inner := f"{source}.{alias.name}") else source for alias in node.names}
    return {f.removeprefix("rapkm_lite").lstrip(".") or "__init__" for f in found if f.split(".")[0] == "rapkm_lite"}


def is_module(dotted):
    return dotted.removeprefix("rapkm_lite.") in MODULES


def room(name):
    return name.split(".")[0]


ARROWS = {name: imported(name) - {name} for name in MODULES}


@pytest.mark.parametrize("name", MODULES)
def test_imports_point_downward(name):
    for other in ARROWS[name]:
        own, target = room(name), room(other)
        if own in DOORS:
            continue
        assert target not in DOORS, f"{name} imports {other}, a door for users"
        if target in KEYS:
            assert own == target or name in KEYS[target], f"{name} imports {other}; only {KEYS[target]} may"
        else:
            assert own in ROOMS, f"{name} imports {other}, but the engine imports no other room"
            assert ROOMS.index(target) <= ROOMS.index(own), f"{name} imports {other}, a room above its own"


def test_no_module_imports_itself_through_others():
    list(TopologicalSorter(ARROWS).static_order())


def test_the_drawing_fits_on_a_page():
    rooms = {room(name): set() for name in MODULES}
    for name, others in ARROWS.items():
        rooms[room(name)] |= {room(o) for o in others} - {room(name)}
    floors = {}
    for name in TopologicalSorter(rooms).static_order():
        floors[name] = 1 + max((floors[r] for r in rooms[name]), default=0)
    assert len(rooms) <= 13 and max(floors.values()) <= 8 and sum(map(len, rooms.values())) <= 45


@pytest.mark.parametrize("name", MODULES)
def test_no_module_is_longer_than_280_lines(name):
    assert len(MODULES[name].read_text(encoding="utf-8").splitlines()) <= 280


@pytest.mark.parametrize("name", MODULES)
def test_no_function_has_more_than_12_parameters(name):
    for node in ast.walk(ast.parse(MODULES[name].read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef | ast.Lambda):
            given = node.args
            assert len([*given.posonlyargs, *given.args, *given.kwonlyargs]) <= 12, ast.unparse(node)[:80]
