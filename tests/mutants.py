"""Does a test notice when the code is wrong?  ``python -m tests.mutants [--count 200] [--seed 1] [--rooms ...]``

Draws places in the rooms mechanics, control and simulation, changes one thing at each (an operator, a comparison, a
number, a sign, a truth value), and runs the fast tests nearest to the module on a copy of the package.  A change that
no test notices survives, and is listed with its line.  Words of errors and docstrings are left alone.
"""

from __future__ import annotations

import argparse
import ast
import copy
import os
import random
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
ROOMS = ("mechanics", "control", "simulation")
# The tests nearest to a module first; then those of its room.
NEAREST = {
    "closure": ["test_kinematics", "test_properties"],
    "calibration": ["test_calibration"],
    "encoders": ["test_calibration"],
    "rests": ["test_calibration"],
    "maps": ["test_actuation", "test_bad_input"],
    "trajectory": ["test_trajectory", "test_bad_input"],
    "stability": ["test_properties", "test_control", "test_audit"],
    "explain": ["test_lost_runs"],
    "faults": ["test_faults"],
    "sensors": ["test_faults"],
    "sweeps": ["test_lost_runs", "test_faults"],
    "chunks": ["test_lost_runs"],
    "patience": ["test_patience"],
    "energy": ["test_simulation", "test_audit"],
}
NEXT = {
    "mechanics": [
        "test_properties",
        "test_dynamics",
        "test_kinematics",
        "test_at",
        "test_actuation",
        "test_antagonism",
    ],
    "control": ["test_control", "test_laws_with_memory", "test_bad_input"],
    "simulation": ["test_simulation", "test_faults", "test_lost_runs", "test_laws_with_memory"],
}
SWAPS = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Lt: ast.GtE, ast.LtE: ast.Gt,
    ast.Gt: ast.LtE, ast.GtE: ast.Lt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq, ast.And: ast.Or, ast.Or: ast.And,
    ast.Is: ast.IsNot, ast.IsNot: ast.Is,
}  # fmt: skip


class Mutant(NamedTuple):
    module: Path
    line: int
    what: str
    text: str


def places(tree: ast.Module) -> list[ast.AST]:
    """Nodes that can be changed: none in annotations, decorators, docstrings, raised errors and f-strings."""
    found: list[ast.AST] = []

    def walk(node: ast.AST):
        if isinstance(node, ast.Raise | ast.JoinedStr | ast.AnnAssign | ast.Import | ast.ImportFrom):
            return
        if isinstance(node, ast.BinOp | ast.BoolOp) and type(node.op) in SWAPS:
            found.append(node)
        elif isinstance(node, ast.Compare) and type(node.ops[0]) in SWAPS:
            found.append(node)
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.Not):
            found.append(node)
        elif isinstance(node, ast.Constant) and isinstance(node.value, bool | int | float):
            found.append(node)
        for name, value in ast.iter_fields(node):
            if name not in ("annotation", "returns", "decorator_list", "type_params"):
                for child in value if isinstance(value, list) else [value]:
                    if isinstance(child, ast.AST):
                        walk(child)

    walk(tree)
    return found


def changed(node: ast.AST) -> str:
    """Change a node in place; returns what was done."""
    before = ast.unparse(node)
    if isinstance(node, ast.BinOp | ast.BoolOp):
        node.op = SWAPS[type(node.op)]()
    elif isinstance(node, ast.Compare):
        node.ops[0] = SWAPS[type(node.ops[0])]()
    elif isinstance(node, ast.UnaryOp):
        node.op = ast.UAdd() if isinstance(node.op, ast.USub) else ast.Not()
        if isinstance(node.op, ast.Not):
            node.operand = ast.UnaryOp(ast.Not(), node.operand)
    elif isinstance(node, ast.Constant):
        node.value = not node.value if isinstance(node.value, bool) else node.value * 2 + 1
    return f"{before}  ->  {ast.unparse(node)}"


def draw(count: int, seed: int, rooms) -> list[Mutant]:
    """Mutants at random, the same for the same seed."""
    every = []
    for room in rooms:
        for module in sorted((ROOT / "rapkm_lite" / room).glob("[!_]*.py")):
            tree = ast.parse(module.read_text(encoding="utf-8"))
            every += [(module, tree, k) for k in range(len(places(tree)))]
    mutants = []
    for module, tree, k in random.Random(seed).sample(every, min(count, len(every))):
        other = copy.deepcopy(tree)
        node = places(other)[k]
        what = changed(node)
        mutants.append(Mutant(module, node.lineno, what, ast.unparse(ast.fix_missing_locations(other))))
    return mutants


def killed(mutant: Mutant, folder: Path, seconds: int) -> bool:
    """Does a test notice?  A run that takes too long counts as noticed."""
    place = folder / mutant.module.relative_to(ROOT)
    original = place.read_text(encoding="utf-8")
    place.write_text(mutant.text, encoding="utf-8")
    stem, room = mutant.module.stem, mutant.module.parent.name
    names = list(dict.fromkeys([*NEAREST.get(stem, []), *NEXT[room]]))
    tests = [str(folder / "tests" / f"{name}.py") for name in names]
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", "-m", "fast", *tests]
    variables = os.environ | {"PYTHONPATH": str(folder), "PYTHONDONTWRITEBYTECODE": "1"}
    try:
        done = subprocess.run(command, cwd=folder, env=variables, capture_output=True, timeout=seconds)
        if done.returncode != 0 and mutant.what == "nothing":
            print(done.stdout.decode(errors="replace")[-3000:])
        return done.returncode != 0
    except subprocess.TimeoutExpired:
        return True
    finally:
        place.write_text(original, encoding="utf-8")


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--seconds", type=int, default=600, help="patience with one mutant")
    parser.add_argument("--rooms", nargs="*", default=ROOMS, choices=ROOMS)
    given = parser.parse_args()
    survivors, judged = [], 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for part in ("rapkm_lite", "tests", "data"):
            shutil.copytree(ROOT / part, folder / part)
        for part in ("pyproject.toml", "README.md"):
            shutil.copy2(ROOT / part, folder / part)
        for room in given.rooms:
            module = next((ROOT / "rapkm_lite" / room).glob("[!_]*.py"))
            if killed(Mutant(module, 0, "nothing", module.read_text(encoding="utf-8")), folder, given.seconds):
                sys.exit(f"the tests of {room} fail without any change; allowed: a tree whose fast tests pass")
        for mutant in draw(given.count, given.seed, given.rooms):
            judged += 1
            dead = killed(mutant, folder, given.seconds)
            line = f"{mutant.module.relative_to(ROOT)}:{mutant.line}  {' '.join(mutant.what.split())[:150]}"
            print(f"{judged:4} {'killed  ' if dead else 'SURVIVES'} {line}", flush=True)
            survivors += [] if dead else [line]
    print(f"{judged - len(survivors)} of {judged} killed; {len(survivors)} survive:")
    print("\n".join(survivors))


if __name__ == "__main__":
    main()
