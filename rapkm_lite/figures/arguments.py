"""Arguments of pictures: one word means one thing, so that a name says what may stand there.

`guarded` puts the check before every function of a door such as `plotting`; the functions themselves draw.
"""

from __future__ import annotations

import functools
import inspect
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from ..machine.arguments import (
    bounded,
    exact_array,
    function,
    having,
    joint_indices,
    of_kind,
    positive_number,
    real_array,
    shaped,
    short,
    switch,
    whole_number,
)
from ..machine.manipulator import Manipulator, manipulator
from ..mechanics.trajectory import Trajectory
from .marks.given import numbers

Known = dict[str, Any]
# More samples or frames than this are a slip of the hand: they would take all the memory.
_MOST = 5000


def guarded(names: dict[str, Any]) -> dict[str, Any]:
    """The public functions of a module, by name, each behind a check of its arguments."""
    return {
        name: _guard(thing) if inspect.isfunction(thing) and not name.startswith("_") else thing
        for name, thing in names.items()
        if getattr(thing, "__module__", "").startswith(__name__.split(".")[0])
    }


def _guard(picture: Callable) -> Callable:
    signature = inspect.signature(picture)

    @functools.wraps(picture)
    def checked(*args, **named):
        try:
            bound = signature.bind(*args, **named)
        except TypeError as error:  # as Python says it, with the name of the function
            raise TypeError(f"{picture.__name__}() {error}") from None
        bound.apply_defaults()  # a pair that the machine of the call does not have
        given = bound.arguments
        parameters = [signature.parameters[name] for name in given]
        plain = [p for p in parameters if p.kind not in (p.VAR_KEYWORD, p.VAR_POSITIONAL)]
        for parameter in plain:
            _check(parameter, given)
        if given.get("pair") is not None:
            given["pair"] = _ordered(given["pair"])
        if given.get("pairs") is not None:
            given["pairs"] = [_ordered(pair) for pair in given["pairs"]]
        try:
            return picture(*bound.args, **bound.kwargs)
        except Exception as error:
            if isinstance(error, RuntimeError) and type(error).__module__.startswith("rapkm_lite."):
                raise  # a run that was lost, say
            # Curves may have gaps; where drawing failed, arguments are checked strictly, to name the wrong one.
            for parameter in plain:
                _check(parameter, given, strict=True)
            if isinstance(error, KeyError) and "allowed" in str(error):
                raise ValueError(error.args[0]) from error  # a KeyError shows its words in quotes
            if "allowed" in str(error) or "needed" in str(error):
                raise
            words = ", ".join(f"{p.name} = {_size(given[p.name])}" for p in plain)
            allowed = "values and shapes as its docstring says"
            if given.get("axes") is not None:
                allowed += ", and axes as it makes and returns them itself without any given"
            raise ValueError(f"{picture.__name__} cannot draw {words} ({error}); allowed: {allowed}") from error

    return checked


def _size(value) -> str:
    return f"an array {value.shape}" if isinstance(value, np.ndarray) else short(value)


def _check(parameter: inspect.Parameter, known: Known, strict: bool = False) -> None:
    name, kind, default = parameter.name, str(parameter.annotation), parameter.default
    value = known[name]
    if value is None and (default is None or kind.endswith("| None")):
        return
    if isinstance(default, bool | str | float):
        kind = type(default).__name__
    check = _KINDS.get(kind)
    if check is not None:
        check(name, value)
    elif kind.startswith("int"):
        run = known.get("run") if name == "k" else None
        known[name] = whole_number(name, value, -1 if default == -1 else 0, _MOST if run is None else len(run.c) - 1)
    elif kind.startswith("Callable"):
        function(name, value)
    elif name in _RULES:
        _RULES[name](name, value, known)
    elif name in _CURVES and strict:
        _numbers(name, value, known)
    elif name in _CURVES:
        numbers(name, value, most=9)


def _dictionary(name: str, value) -> None:
    words = "energies in J, one per drive, such as run.energy," if name == "rows" else "what is drawn"
    if not isinstance(value, dict) or not value:
        raise ValueError(f"{name} = {short(value)}; allowed: a dict that is not empty, {words} by its label")
    for label, energies in value.items() if name == "rows" else ():
        where = f"{name}[{label!r}]"
        if hasattr(energies, "energy") or not hasattr(energies, "__len__"):
            raise ValueError(f"{where} = {short(energies)}; allowed: {words[:-1]}")
        array = real_array(where, energies)
        shaped(where, array, array.ndim == 1 and array.size > 0, words[:-1])


def _trajectory(name: str, value, known: Known) -> None:
    of_kind(name, value, Trajectory, "a Trajectory, such as triangle(robot) returns")


def _having(words: str, attributes: str) -> Callable[[str, Any, Known], None]:
    """The rule for a value that is known by its attributes."""
    return lambda name, value, known: having(name, value, words, *attributes.split())


def _axes(name: str, value, known: Known) -> None:
    for ax in np.ravel(np.asarray(value, dtype=object)) if isinstance(value, np.ndarray | list | tuple) else [value]:
        having(name, ax, "axes of matplotlib, or None for new ones", "plot", "get_xlim", "figure")


def _drives(known: Known) -> int | None:
    owners = [known.get("robot"), *(getattr(known.get(name), "robot", None) for name in ("trajectory", "run", "path"))]
    return next((robot.n_arms for robot in owners if isinstance(robot, Manipulator)), None)


def _pose(name: str, value, known: Known) -> None:
    N = _drives(known)
    real_array(name, value, *([] if N is None else [2 * N]))


def _offset(name: str, value, known: Known) -> None:
    N = _drives(known)
    real_array(name, value, *([] if N is None else [N]))


def _pair(name: str, value, known: Known) -> None:
    joint_indices(name, value, _drives(known), 2, "drive")


def _ordered(pair) -> tuple[int, ...]:
    """A pair as `drive_pairs` writes it, given in either order, as a list or an array."""
    return tuple(sorted(int(drive) for drive in pair))


def _pairs(name: str, value, known: Known) -> None:
    several = "pairs of drives, such as [(0, 1), (0, 2)]"
    of_kind(name, value, (list, tuple, np.ndarray), several)
    if value.shape[1:] != (2,) if isinstance(value, np.ndarray) else not value:
        raise ValueError(f"{name} = {short(value)}; allowed: {several}")
    for pair in value:
        _pair(name, pair, known)


def _arms(name: str, value, known: Known) -> None:
    listed = value.ndim == 1 if isinstance(value, np.ndarray) else isinstance(value, list | tuple | range)
    N = _drives(known)
    if listed and len(value) == 1:
        known[name] = [whole_number(name, value[0], 0, math.inf if N is None else N - 1)]
    else:
        known[name] = joint_indices(name, list(value) if isinstance(value, range) else value, N, None, "arm")


def _signs(name: str, value, known: Known) -> None:
    signs = real_array(name, value)
    if not signs.size or not np.all(np.abs(signs) == 1.0):
        raise ValueError(f"{name} = {short(value)}; allowed: +1 or -1 for each arm")


def _numbers(name: str, value, known: Known) -> None:
    """An array of numbers; of a masked one, what is not masked."""
    array = np.ma.filled(value, 0) if isinstance(value, np.ma.MaskedArray) else value
    if real_array(name, np.asarray(array, dtype=float) if _logical(array) else array).size == 0:
        raise ValueError(f"{name} is empty, {short(value)}; allowed: at least one number")


def _logical(value) -> bool:
    try:
        return isinstance(value, np.ndarray | list) and np.asarray(value).dtype == bool
    except ValueError:
        return False


def _level(name: str, value, known: Known) -> None:
    """One number to compare with, or the words beside it and the number."""
    exact_array(name, value[1] if isinstance(value, tuple) and len(value) == 2 and isinstance(value[0], str) else value)


def _size_of(name: str, value, known: Known) -> None:
    bounded(name, exact_array(name, value), 0.0, strict=False)


def _rows(name: str, value, known: Known) -> None:
    if not isinstance(value, list | tuple) or not value:
        raise ValueError(f"{name} = {short(value)}; allowed: a list of rows")


def _words(name: str, value, known: Known) -> None:
    if not (isinstance(value, list | tuple) and value and all(isinstance(word, str) for word in value)):
        raise ValueError(f"{name} = {short(value)}; allowed: a list of words")


def _text(name: str, value) -> None:
    from matplotlib.colors import is_color_like

    of_kind(name, value, str, "text")
    if name == "colour" and not is_color_like(value):
        raise ValueError(f"{name} = {short(value)}; allowed: a colour of Matplotlib, such as '#112233'")


def _gain(name: str, value, known: Known) -> None:
    if real_array(name, value).ndim == 0:
        positive_number(name, value)


_KINDS: dict[str, Callable[[str, Any], object]] = {
    "bool": switch, "str": _text, "float": exact_array, "dict": _dictionary,
}  # fmt: skip
_RULES: dict[str, Callable[[str, Any, Known], object]] = {
    "robot": lambda name, value, known: manipulator(value, name),
    "log": _having("a Log, such as mystery_run returns", "t q_a q_a_desired c"),
    "table": _having("what table1() returns", "measured simulated"),
    "q": _pose,
    "offset": _offset,
    "pair": _pair,
    "pairs": _pairs,
    "arms": _arms,
    "rows": _rows,
    "stiffness": _numbers,
    **dict.fromkeys("trajectory path".split(), _trajectory),
    **dict.fromkeys("run free clipped".split(), _having("a Run, such as simulate returns", "robot q q_a c dt")),
    **dict.fromkeys("ax axes".split(), _axes),
    **dict.fromkeys("mode modes".split(), _signs),
    **dict.fromkeys("K K_P".split(), _gain),
    **dict.fromkeys("names labels rules head".split(), _words),
    **dict.fromkeys("rate vmin vmax target nominal marked special".split(), _level),
    **dict.fromkeys("quantum friction guaranteed".split(), _size_of),
    **dict.fromkeys("F n limit zoom places start stop end box forces room pose low high centres".split(), _numbers),
}
_CURVES = (
    "x y t values sigma theory ratio simulated jumps can_rest spacing gap gains without with_filter antagonistic "
    "reference readings demand points inside cube share part c eps leak residual bias exact error predicted "
    "lengths counts angle"
).split()
