"""Arguments of pictures: one word means one thing, so that a name says what may stand there.

`guarded` puts the check before every function of a door such as `plotting`; the functions themselves draw.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from typing import Any

import numpy as np

from ..machine.arguments import (
    exact_array,
    function,
    having,
    joint_indices,
    of_kind,
    positive_number,
    real_array,
    short,
    switch,
    whole_number,
)
from ..machine.manipulator import Manipulator, manipulator
from ..mechanics.trajectory import Trajectory

Known = dict[str, Any]
_FIRST = ("robot", "trajectory", "ax", "axes")


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
        given = signature.bind(*args, **named).arguments
        known: Known = dict(given)
        parameters = [signature.parameters[name] for name in given]
        plain = [p for p in parameters if p.kind not in (p.VAR_KEYWORD, p.VAR_POSITIONAL)]
        asked = [p for p in plain if not (given[p.name] is None and p.default is None)]
        for parameter in asked:
            if parameter.name in _FIRST or str(parameter.annotation) in ("bool", "str", "int", "float"):
                _check(parameter, given[parameter.name], known)
        try:
            return picture(*args, **named)
        except (ArithmeticError, AttributeError, TypeError, LookupError, ValueError, RuntimeError) as error:
            if isinstance(error, RuntimeError) and type(error) is not RuntimeError:
                raise  # a run that was lost, say
            # Curves may be whatever can be drawn; what could not is held to the names.
            for parameter in asked:
                _check(parameter, given[parameter.name], known)
            if isinstance(error, KeyError) and "allowed" in str(error):
                raise ValueError(error.args[0]) from error  # a KeyError shows its words in quotes
            if "allowed" in str(error) or "needed" in str(error):
                raise
            words = ", ".join(f"{p.name} = {_size(given[p.name])}" for p in plain)
            raise ValueError(
                f"{picture.__name__} cannot draw {words} ({error}); allowed: values and shapes as its docstring says"
            ) from error

    return checked


def _size(value) -> str:
    return f"an array {value.shape}" if isinstance(value, np.ndarray) else short(value)


def _check(parameter: inspect.Parameter, value, known: Known) -> None:
    name, kind, default = parameter.name, str(parameter.annotation), parameter.default
    if kind == "bool" or isinstance(default, bool):
        switch(name, value)
    elif kind == "str" or isinstance(default, str):
        of_kind(name, value, str, "text")
    elif kind == "dict":
        _dictionary(name, value)
    elif kind == "int":
        whole_number(name, value, -1 if default == -1 else 0)
    elif kind == "float" or isinstance(default, float):
        exact_array(name, value)
    elif kind.startswith("Callable"):
        function(name, value)
    elif name in _RULES:
        _RULES[name](name, value, known)


def _dictionary(name: str, value) -> None:
    if not isinstance(value, dict) or not value:
        raise ValueError(f"{name} = {short(value)}; allowed: a dict that is not empty, what is drawn by its label")


def _robot(name: str, value, known: Known) -> None:
    manipulator(value, name)


def _trajectory(name: str, value, known: Known) -> None:
    of_kind(name, value, Trajectory, "a Trajectory, such as triangle(robot) returns")


def _run(name: str, value, known: Known) -> None:
    having(name, value, "a Run, such as simulate returns", "robot", "q", "q_a", "c", "dt")


def _log(name: str, value, known: Known) -> None:
    having(name, value, "a Log, such as mystery_run returns", "t", "q_a", "q_a_desired", "c")


def _table(name: str, value, known: Known) -> None:
    having(name, value, "what table1() returns", "measured", "simulated")


def _axes(name: str, value, known: Known) -> None:
    for ax in np.ravel(np.asarray(value, dtype=object)):
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


def _pairs(name: str, value, known: Known) -> None:
    for pair in of_kind(name, value, (list, tuple, np.ndarray), "pairs of drives, such as [(0, 1), (0, 2)]"):
        _pair(name, pair, known)


def _arms(name: str, value, known: Known) -> None:
    if isinstance(value, list | tuple | range | np.ndarray) and len(value) == 1:
        whole_number(name, value[0], 0)
    else:
        joint_indices(name, list(value) if isinstance(value, range) else value, _drives(known), None, "arm")


def _signs(name: str, value, known: Known) -> None:
    if not np.all(np.abs(real_array(name, value)) == 1.0):
        raise ValueError(f"{name} = {short(value)}; allowed: +1 or -1 for each arm")


def _numbers(name: str, value, known: Known) -> None:
    """An array of numbers; of a masked one, what is not masked."""
    array = np.ma.filled(value, 0) if isinstance(value, np.ma.MaskedArray) else value
    if real_array(name, np.asarray(array, dtype=float) if _logical(array) else array).size == 0:
        raise ValueError(f"{name} is empty, {short(value)}; allowed: at least one number")


def _logical(value) -> bool:
    return isinstance(value, np.ndarray) and value.dtype == bool


def _gain(name: str, value, known: Known) -> None:
    array = real_array(name, value)
    if array.ndim == 0:
        positive_number(name, value)


_RULES: dict[str, Callable[[str, Any, Known], None]] = {
    "robot": _robot,
    "trajectory": _trajectory,
    "path": _trajectory,
    "run": _run,
    "log": _log,
    "table": _table,
    "ax": _axes,
    "axes": _axes,
    "q": _pose,
    "offset": _offset,
    "pair": _pair,
    "pairs": _pairs,
    "arms": _arms,
    "mode": _signs,
    "modes": _signs,
    "K": _gain,
    "K_P": _gain,
    **dict.fromkeys(
        (
            "F x y t values sigma forces theory ratio simulated target jumps can_rest spacing gap "
            "marked rate zoom gains without with_filter antagonistic centres reference low high readings demand points "
            "start stop vmin vmax quantum friction box inside cube xd share part"
        ).split(),
        _numbers,
    ),
}
