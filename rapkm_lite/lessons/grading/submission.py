"""A submitted notebook as statements, and the few of them that the exercises need."""

from __future__ import annotations

import ast
import builtins
import os
import re
import symtable
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from ...machine.arguments import short
from ..exercise import Exercise

_EXERCISE = re.compile(r"\d\d\.\w+")
_NUMBER = re.compile(r"(?<!\d)\d\d(?![^\W_])")  # whatever stands behind it, but for letters and digits
_BUILT_IN = {*dir(builtins), "display"}
# A notebook may await outside a function; nothing of this module's own way to be compiled is passed on.
RULES = {"flags": ast.PyCF_ALLOW_TOP_LEVEL_AWAIT, "dont_inherit": True}


@dataclass(frozen=True)
class Statement:
    """One statement at the top level of a code cell; `cell` counts from 0 over all cells of the notebook."""

    cell: int
    number: int
    node: ast.stmt

    @property
    def key(self) -> str:
        return f"{self.cell}.{self.number}"


@dataclass(frozen=True)
class Submission:
    """One notebook of one student; `lesson` is its number as text, "04"; a `loose` one lies in no student's folder."""

    student: str
    path: Path
    lesson: str
    loose: bool = False


def found(folder: Path, known: set[str]) -> list[Submission]:
    """All submissions under a folder: STUDENT/.../04_title.ipynb, or loose notebooks, whose names are the student's.

    known : numbers of the lessons that have exercises; for notebooks whose lesson cannot be told see `unnamed`.
    Of several such numbers in a name, as in 04_title_v10_final.ipynb, that counts whose exercises the notebook names,
    and where it names exercises of another lesson only, that lesson.
    Raises ValueError when the folder does not exist or holds none.
    """
    if not os.path.isdir(folder):  # also where the name is longer than a name can be
        raise ValueError(f"submissions = {short(str(folder))}; allowed: a folder that exists")
    submissions = [*_handed_in(folder, known)]
    if not submissions:
        raise ValueError(f"submissions = {str(folder)!r}; allowed: a folder with notebooks named like 04_title.ipynb")
    return submissions


def _handed_in(folder: Path, known: set[str]) -> Iterator[Submission]:
    for path, parts in _notebooks(folder):
        if (lesson := _told(path, known)) in known:
            loose = len(parts) == 1
            yield Submission(path.stem if loose else parts[0], path, lesson, loose)


def surpassed(folder: Path, known: set[str], counted: set[str]) -> list[str]:
    """The submissions under a folder that are not among those that counted, by their paths."""
    return [str(one.path) for one in _handed_in(folder, known) if str(one.path) not in counted]


def _told(path: Path, known: set[str]) -> str:
    """The number in a name whose exercises the notebook names most often; another lesson's where it names only those.

    A name may hold the number of a team or a date, as in team_07_lesson_04.ipynb.  "" where there is none, and where
    there are several, as in 2026-12-03.ipynb, and no exercise is named.
    """
    numbers = [n for n in dict.fromkeys(_NUMBER.findall(path.name)) if n in {*known, "00"}]
    try:
        named = Counter(re.findall(r"\b(\d\d)\.[a-z]\w+", path.read_text(encoding="utf-8")))
    except (OSError, ValueError):
        named = Counter()
    several = len(re.findall(r"\d\d+", path.name)) > 1 and not re.match(r"\d\d_", path.name)
    if not numbers or (several and not any(named[n] for n in known)):
        return ""
    return max(numbers if any(named[n] for n in numbers) else [*numbers, *sorted(known)], key=lambda n: named[n])


def unnamed(folder: Path, known: set[str]) -> list[str]:
    """The notebooks under a folder that nobody grades, since no lesson can be told; 00 can be, and has no exercises."""
    return [str(Path(*parts)) for path, parts in _notebooks(folder) if not _told(path, known)]


def silent(folder: Path, known: set[str]) -> list[str]:
    """The students' folders without a notebook that is graded, and other things that lie among them."""
    heard = {parts[0] for path, parts in _notebooks(folder) if _told(path, known) in known}
    names = (entry.name for entry in os.scandir(folder) if entry.name[0] != "." and not entry.name.endswith(".csv"))
    return sorted({*names} - heard - {*unnamed(folder, known)})


def _notebooks(folder: Path) -> list[tuple[Path, tuple[str, ...]]]:
    """All notebooks with the parts of their place, but those of hidden folders, as checkpoints are."""
    places = []
    for place, folders, files in os.walk(folder, followlinks=True):
        # A link to a folder that it lies in has no end.
        around = {os.path.realpath(one) for one in (place, *Path(os.path.abspath(place)).parents)}
        folders[:] = [one for one in folders if one[0] != "." and os.path.realpath(Path(place, one)) not in around]
        places += [Path(place, one) for one in files if one[0] != "." and one.lower().endswith(".ipynb")]
    return [(path, path.relative_to(folder).parts) for path in sorted(places)]


def statements(texts: list[str]) -> tuple[list[Statement], dict[int, str]]:
    """The statements of all cells, and what keeps a cell from being read, by its number."""
    read, broken = [], {}
    for cell, text in enumerate(texts):
        try:
            name = f"cell {cell + 1}"  # as the sentence counts
            body = ast.parse(text, name).body
            compile(text, name, "exec", **RULES)  # finds what parsing does not: a return outside a function
        except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
            broken[cell] = f"{type(error).__name__}: {error}"
            continue
        read += [Statement(cell, number, node) for number, node in enumerate(body)]
    return read, broken


def _base(node: ast.AST) -> str:
    """The name in front of dots, brackets and calls."""
    while isinstance(node, ast.Attribute | ast.Subscript | ast.Call):
        node = node.func if isinstance(node, ast.Call) else node.value
    return node.id if isinstance(node, ast.Name) else ""


def _imported(all_of_them: list[Statement]) -> set[str]:
    """Names that come from outside; calling what they hold, as in plotting.film(...), changes nothing here."""
    aliases = [a for s in all_of_them if isinstance(s.node, ast.Import | ast.ImportFrom) for a in s.node.names]
    return {alias.asname or alias.name.partition(".")[0] for alias in aliases}


def _touched(call: ast.Call) -> set[str]:
    """Names that a call for its effect may change: np.copyto(a, b) changes a, and print(a) does not."""
    given = call.args if _base(call) not in _BUILT_IN - {"setattr", "delattr"} else []
    return {_base(one) for one in (call, *given)}


def _changes(node: ast.stmt) -> set[str]:
    """Names that a statement binds or may change."""
    if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
        return {node.name}
    names = set()
    # The variable of a comprehension lives in it alone.
    loops = (inner for part in ast.walk(node) if isinstance(part, ast.comprehension) for inner in ast.walk(part.target))
    inside = {id(part) for part in loops}
    for part in ast.walk(node):
        if isinstance(part, ast.Name) and isinstance(part.ctx, ast.Store | ast.Del) and id(part) not in inside:
            names.add(part.id)
        elif isinstance(part, ast.Attribute | ast.Subscript) and isinstance(part.ctx, ast.Store):
            names.add(_base(part))
        elif isinstance(part, ast.Expr) and isinstance(part.value, ast.Call):
            names |= _touched(part.value)
        elif isinstance(part, ast.FunctionDef | ast.ClassDef):
            names.add(part.name)
    return names - _BUILT_IN  # print(...) does not change print


def _uses(node: ast.stmt) -> set[str]:
    """Names that a statement takes from outside itself; the arguments and variables of a function are its own."""
    names: set[str] = set()
    try:
        tables = [symtable.symtable(ast.unparse(node), "cell", "exec")]
    except (SyntaxError, ValueError, RecursionError):  # quotes within quotes, or a sum too long to be written anew
        return {part.id for part in ast.walk(node) if isinstance(part, ast.Name)}
    while tables:
        table = tables.pop()
        top = table.get_type() == "module"
        names |= {s.get_name() for s in table.get_symbols() if s.is_referenced() and (top or s.is_global())}
        tables += table.get_children()
    return names


def _only_calls(node: ast.stmt) -> bool:
    """True for a statement that is one call for its effect; np.random.seed(1) has one on what follows."""
    seeds = any(isinstance(part, ast.Attribute) and part.attr == "random" for part in ast.walk(node))
    return isinstance(node, ast.Expr) and not seeds


def _asks(node: ast.stmt) -> bool:
    """True when a statement checks an answer, whatever the name of the function that does, pictures and hints apart."""
    parts = list(ast.walk(node))
    if any(isinstance(part, ast.Name) and part.id == "check" for part in parts):
        return True
    texts = [part.value for part in parts if isinstance(part, ast.Constant) and isinstance(part.value, str)]
    shown = isinstance(node, ast.Expr) and _base(node.value) in ("plotting", "explore", "hint")
    return not shown and any(_EXERCISE.fullmatch(text) for text in texts)


def hides_check(all_of_them: list[Statement]) -> bool:
    """True when `check` stands elsewhere than in a plain call, or in a file that is run: `needed` cannot tell."""
    for statement in (s for s in all_of_them if not _plain_check(s.node)):
        fields = (value for part in ast.walk(statement.node) for _, value in ast.iter_fields(part))
        if any(isinstance(value, str) and re.search(r"\bcheck\b", value) for value in fields):
            return True
        if _commands(statement.node, "run_line_magic"):
            return True
    return False


def _commands(node: ast.stmt, *names: str) -> bool:
    """True where a command for the notebook is carried out: a cell that is written to a file, a file that is run."""
    for part in ast.walk(node):
        if isinstance(part, ast.Call) and isinstance(part.func, ast.Attribute) and part.func.attr in names:
            if part.args and getattr(part.args[0], "value", None) in ("writefile", "run"):
                return True
    return False


def _plain_check(node: ast.stmt) -> bool:
    """True for an import of `check` under its own name, and for check(...) with or without a name for what it gives."""
    if isinstance(node, ast.ImportFrom):
        return all(alias.name != "check" or alias.asname in (None, "check") for alias in node.names)
    call = node.value if isinstance(node, ast.Expr | ast.Assign | ast.AnnAssign) else None
    return isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id == "check"


def needed(all_of_them: list[Statement], wanted: set[str]) -> list[Statement]:
    """The statements on which the wanted names and all calls of `check` depend, in order; imports and files always.

    Read from the end: a statement counts when something after it uses what it binds or changes.  What a function uses
    counts from where the function is called, for it may be bound after the function.
    """
    outside = _imported(all_of_them)
    bodies: dict[str, set[str]] = {}
    for statement in all_of_them:
        if isinstance(statement.node, ast.FunctionDef | ast.ClassDef):
            bodies[statement.node.name] = bodies.get(statement.node.name, set()) | _uses(statement.node)
    names, kept = _with_bodies(wanted, bodies), []
    for statement in reversed(all_of_them):
        node = statement.node
        shown = isinstance(node, ast.Expr) and _base(node.value) in ("plotting", "explore", "display")
        changed = set() if shown else _changes(node) - (outside if _only_calls(node) else set())
        always = isinstance(node, ast.Import | ast.ImportFrom) or _commands(node, "run_line_magic", "run_cell_magic")
        if always or _asks(node) or changed & names:
            kept.append(statement)
            if isinstance(node, ast.Assign):  # what the name held before does not matter
                names -= {target.id for target in node.targets if isinstance(target, ast.Name)}
            names |= _with_bodies(_uses(node), bodies)
    return kept[::-1]


def _with_bodies(names: set[str], bodies: dict[str, set[str]]) -> set[str]:
    """The names, and all that the functions among them use, and the functions among those."""
    found, new = set(names), set(names)
    while new:
        new = set().union(*(bodies.get(name, set()) for name in new)) - found
        found |= new
    return found


def called(name: str, exercise: Exercise) -> str:
    """The name that the answer to an exercise has in its lesson."""
    return exercise.called or name.partition(".")[2]
