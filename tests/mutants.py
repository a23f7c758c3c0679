"""Does a test notice when the code is wrong?  ``python -m tests.mutants [--count 200] [--seed 1] [--modules ...]``

Draws places in the rooms mechanics, control and simulation, changes one thing at each (an operator, a comparison, a
number, a sign, a truth value) in a copy of the package, and runs the fast and long tests that come by that line: which
ones those are is found once, by tracing them.  A change that no test notices survives, and is listed with its line.
Words of errors and docstrings are left alone; changes that change nothing stand with their reason in
``equivalents.txt``.

Exit status 1 when less than nine tenths of the changes that change something are noticed (``--least`` another share),
or when there were none.
"""

from __future__ import annotations

import argparse
import ast
import copy
import functools
import importlib
import json
import os
import random
import resource
import shutil
import signal
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
ROOMS = ("mechanics", "control", "simulation")
LEAST = 0.9
KNOWN = Path(__file__).with_name("equivalents.txt")
SWAPS = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Lt: ast.GtE, ast.LtE: ast.Gt,
    ast.Gt: ast.LtE, ast.GtE: ast.Lt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq, ast.And: ast.Or, ast.Or: ast.And,
    ast.Is: ast.IsNot, ast.IsNot: ast.Is,
}  # fmt: skip
GROUPS = "fast or long"
# What a test that checks the whole house needs besides: it does not read the rooms' code, or not quickly.
LEFT_OUT = ("test_lessons", "test_storing", "test_nbgrader", "test_grader", "test_rooms", "test_docs", "test_package")


class Mutant(NamedTuple):
    """A module with one change: `lines` are those of the innermost statement that was changed."""

    module: Path
    lines: range
    line: int
    source: str
    what: str
    text: str

    @property
    def name(self) -> str:
        return f"{self.module.relative_to(ROOT / 'rapkm_lite')} | {self.source} | {' '.join(self.what.split())}"


# Changes.
def places(tree: ast.Module) -> list[tuple[ast.AST, ast.stmt]]:
    """Nodes that can be changed, with their statements: none in annotations, docstrings, raised errors, f-strings."""
    found: list[tuple[ast.AST, ast.stmt]] = []

    def walk(node: ast.AST, statement):
        if isinstance(node, ast.Raise | ast.JoinedStr | ast.AnnAssign | ast.Import | ast.ImportFrom):
            return
        statement = node if isinstance(node, ast.stmt) else statement
        if isinstance(node, ast.BinOp | ast.BoolOp) and type(node.op) in SWAPS:
            found.append((node, statement))
        elif isinstance(node, ast.Compare) and type(node.ops[0]) in SWAPS:
            found.append((node, statement))
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.Not):
            found.append((node, statement))
        elif isinstance(node, ast.Constant) and isinstance(node.value, bool | int | float):
            found.append((node, statement))
        for name, value in ast.iter_fields(node):
            if name not in ("annotation", "returns", "decorator_list", "type_params"):
                for child in value if isinstance(value, list) else [value]:
                    if isinstance(child, ast.AST):
                        walk(child, statement)

    walk(tree, None)
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


def draw(count: int, seed: int, modules) -> list[Mutant]:
    """Mutants at random, the same for the same seed; of all modules of the rooms, or of some."""
    every = []
    for room in ROOMS:
        for module in sorted((ROOT / "rapkm_lite" / room).glob("[!_]*.py")):
            if modules and module.stem not in modules:
                continue
            tree = ast.parse(module.read_text(encoding="utf-8"))
            every += [(module, tree, k) for k in range(len(places(tree)))]
    mutants = []
    for module, tree, k in random.Random(seed).sample(every, min(count, len(every))):
        other = copy.deepcopy(tree)
        node, statement = places(other)[k]
        line: int = getattr(node, "lineno", 0)
        source = module.read_text(encoding="utf-8").splitlines()[line - 1].strip()
        lines = extent(statement, line)
        what = changed(node)
        text = ast.unparse(ast.fix_missing_locations(other))
        mutants.append(Mutant(module, lines, line, source, what, text))
    return mutants


def extent(statement: ast.stmt, line: int) -> range:
    """The lines by which a test comes by a change in a statement: a compound one ends where its body begins, and
    what stands in the head of a function is used where its body runs."""
    body = getattr(statement, "body", None)
    if not isinstance(body, list) or not body:
        return range(statement.lineno, (statement.end_lineno or statement.lineno) + 1)
    if isinstance(statement, ast.FunctionDef):
        return range(body[0].lineno, (statement.end_lineno or line) + 1)
    return range(statement.lineno, max(body[0].lineno - 1, line) + 1)


# Tests.
class Tracer:
    """A plugin for pytest that notes which lines of the rooms each test runs, and for how long it runs."""

    def __init__(self, folder: Path):
        import coverage

        rooms = [str(folder / "rapkm_lite" / room) for room in ROOMS]
        self.coverage = coverage.Coverage(data_file=None, source=rooms, config_file=False, messages=False)
        self.coverage.start()
        self.seconds: dict[str, float] = {}
        self.failed: list[str] = []

    # What a file of tests makes while it is imported belongs to all of them; the package itself to no file.
    def pytest_collectstart(self, collector):
        self.coverage.switch_context(collector.nodeid if collector.nodeid.endswith(".py") else "")

    def pytest_collectreport(self, report):
        self.coverage.switch_context("")

    def pytest_runtest_logstart(self, nodeid, location):
        self.coverage.switch_context(nodeid)
        self.start = time.perf_counter()

    def pytest_runtest_logreport(self, report):
        if report.failed:
            self.failed.append(report.nodeid)

    def pytest_runtest_logfinish(self, nodeid, location):
        self.seconds[nodeid] = time.perf_counter() - self.start
        self.coverage.switch_context("")

    def seen(self, folder: Path) -> dict[str, dict[int, list[str]]]:
        """Tests by line, by module; without those that fail in an unchanged tree."""
        self.coverage.stop()
        data, seen = self.coverage.get_data(), {}
        of_file: dict[str, set[str]] = {}
        for test in self.seconds:
            of_file.setdefault(test.split("::")[0], set()).add(test)
        for file in data.measured_files():
            lines = data.contexts_by_lineno(file)
            tests = {line: set().union(*(of_file.get(c, {c}) for c in found)) for line, found in lines.items()}
            good = {line: sorted(names & set(self.seconds) - set(self.failed)) for line, names in tests.items()}
            seen[Path(file).relative_to(folder).as_posix()] = good
        return seen


def inside(folder: Path, seconds: float, work) -> int:
    """What a piece of work returns in a process of its own, silently; not 0 when it takes too long.

    Its processor time is limited, so that other work on the cores kills nothing, and ten times that by the clock.
    """
    child = os.fork()
    if child == 0:
        code = 1
        try:
            resource.setrlimit(resource.RLIMIT_CPU, (int(seconds) + 1, int(seconds) + 1))
            signal.setitimer(signal.ITIMER_REAL, 10.0 * seconds)
            os.chdir(folder)
            sys.path.insert(0, str(folder))
            quiet = os.open(os.devnull, os.O_WRONLY)
            os.dup2(quiet, 1)
            os.dup2(quiet, 2)
            code = int(work())
        finally:
            os._exit(code)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def tests_by_line(folder: Path, names) -> dict:
    """Trace the tests once: their seconds and lines, without those that fail in an unchanged tree."""
    place = folder / "seen.json"
    files = [str(p) for p in sorted((folder / "tests").glob("test_*.py")) if p.stem not in LEFT_OUT]
    files += [str(folder / "rapkm_lite" / room) for room in ROOMS]
    files = [str(folder / "tests" / f"{name}.py") for name in names] or files

    def work():
        import pytest

        tracer = Tracer(folder)
        importlib.import_module("rapkm_lite")
        pytest.main(["-n0", "-q", "-p", "no:cacheprovider", "-m", GROUPS, *files], plugins=[tracer])
        found = {"seen": tracer.seen(folder), "seconds": tracer.seconds, "failed": tracer.failed}
        place.write_text(json.dumps(found))
        return 0

    if inside(folder, 3600.0, work) != 0:
        sys.exit("the fast and long tests could not be traced; allowed: a tree in which they run")
    return json.loads(place.read_text())


def killed(mutant: Mutant, folder: Path, found: dict) -> bool:
    """Does a test notice?  The quick tests of the line first, then all of them; too long a run counts as noticed."""
    lines = found["seen"].get(mutant.module.relative_to(ROOT).as_posix(), {})
    near = {test for line in mutant.lines for test in lines.get(str(line), ())}
    # What runs on import belongs to every test that comes by the module.
    near = sorted(near or {test for tests in lines.values() for test in tests}, key=found["seconds"].get)
    if not near:
        return False

    def work(names):
        import pytest

        return int(pytest.main(["-n0", "-q", "-x", "-p", "no:cacheprovider", "-m", GROUPS, *names]) != 0)

    place = folder / mutant.module.relative_to(ROOT)
    original = place.read_text(encoding="utf-8")
    place.write_text(mutant.text, encoding="utf-8")
    try:
        # A change that hangs the quick ones is noticed as soon as they take too long.
        for names in filter(None, (near[:40], near[40:])):
            seconds = 60.0 + 3.0 * sum(found["seconds"][name] for name in names)
            if inside(folder, seconds, functools.partial(work, names)) != 0:
                return True
        return False
    finally:
        place.write_text(original, encoding="utf-8")


def equivalents() -> dict[str, str]:
    """Reasons of changes that change nothing, by the name of the mutant."""
    if not KNOWN.exists():
        return {}
    lines = [line for line in KNOWN.read_text(encoding="utf-8").splitlines() if line and not line.startswith("#")]
    return {name.strip(): reason.strip() for name, reason in (line.rsplit(" | ", 1) for line in lines)}


def copied(folder: Path) -> None:
    """Copy what the tests need, and read once what every child needs: nothing of the package, which changes."""
    for part in ("rapkm_lite", "tests", "data", "docs", "notebooks"):
        shutil.copytree(ROOT / part, folder / part, ignore=shutil.ignore_patterns("*.pyc"))
    for part in filter(Path.is_file, ROOT.iterdir()):
        shutil.copy2(part, folder / part.name)
    os.environ["PYTHONPATH"] = str(folder)
    import coverage  # noqa: F401
    import hypothesis
    import pytest
    import scipy.integrate
    import scipy.optimize  # noqa: F401

    try:
        import numba  # noqa: F401
    except ImportError:
        print(f"without Numba; pytest {pytest.__version__}, hypothesis {hypothesis.__version__}")


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--minutes", type=float, default=1e6, help="draw no more mutants after that time")
    parser.add_argument("--modules", nargs="*", default=[], help="change these only, such as calibration")
    parser.add_argument("--tests", nargs="*", default=[], help="run these files only, such as test_calibration")
    parser.add_argument("--least", type=float, default=LEAST, help="share that has to be noticed, or exit status 1")
    given = parser.parse_args()
    end = time.monotonic() + 60.0 * given.minutes
    survivors, equal, judged, reasons = [], [], 0, equivalents()
    os.environ["PYTHONDONTWRITEBYTECODE"] = "1"
    sys.path[:] = [part for part in sys.path if Path(part or ".").resolve() != ROOT]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        copied(folder)
        mutants = draw(given.count, given.seed, given.modules)
        found = tests_by_line(folder, given.tests)
        print(f"{len(found['seconds'])} tests, {sum(found['seconds'].values()):.0f} s traced; failed and left out:")
        print("\n".join(found["failed"]) or "none", flush=True)
        for mutant in mutants:
            if time.monotonic() > end:
                break
            judged += 1
            line = f"{mutant.module.relative_to(ROOT)}:{mutant.line}  {' '.join(mutant.what.split())[:150]}"
            if mutant.name in reasons:
                equal.append(f"{line}  ({reasons[mutant.name]})")
                print(f"{judged:4} nothing  {line}", flush=True)
                continue
            dead = killed(mutant, folder, found)
            print(f"{judged:4} {'killed  ' if dead else 'SURVIVES'} {line}", flush=True)
            survivors += [] if dead else [f"{line}\n    {mutant.name}"]
    real = judged - len(equal)
    print(f"{real - len(survivors)} of {real} killed; {len(survivors)} survive:", *survivors, sep="\n")
    print(f"{len(equal)} more change nothing:", *equal, sep="\n")
    return 0 if enough(real - len(survivors), real, given.least) else 1


def enough(noticed: int, real: int, least: float = LEAST) -> bool:
    """Were so many of the changes noticed as have to be?"""
    return real > 0 and noticed >= least * real


if __name__ == "__main__":
    sys.exit(main())
