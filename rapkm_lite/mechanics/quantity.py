"""Properties of an `At`: computed when asked for, then kept."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, Generic, TypeVar, overload

from ..machine.tree import Tree

Kept = TypeVar("Kept")


class quantity(Generic[Kept]):
    """A property that is computed when asked for, then kept, with its arrays read-only."""

    needs_rates = False

    def __init__(self, function: Callable[[Any], Kept]):
        self.function, self.name, self.__doc__ = function, function.__name__, function.__doc__

    @overload
    def __get__(self, pose: None, cls: type) -> quantity[Kept]: ...
    @overload
    def __get__(self, pose: Any, cls: type) -> Kept: ...

    def __get__(self, pose, cls):
        if pose is None:
            return self
        if self.needs_rates and pose.qd is None:
            raise ValueError(f"{self.name} needs the rates, qd = None; allowed: at(robot, q, qd) with qd (..., 2N)")
        value: Any = self.function(pose)
        pose.__dict__[self.name] = value
        for array in value if type(value) is tuple else (value,):
            array.setflags(False)
        return value


class rate(quantity[Kept]):
    """A `quantity` that needs qd."""

    needs_rates = True


class geometry(quantity[Kept]):
    """A `quantity` of q alone that is not handed out: what is `asked` next at the same single pose takes it over."""

    def __get__(self, pose, cls) -> Any:
        kept = None if pose is None else pose.__dict__.get("_geometry")
        if kept is None:
            return super().__get__(pose, cls)
        if self.name not in kept:
            kept[self.name] = super().__get__(pose, cls)
        pose.__dict__[self.name] = kept[self.name]
        return kept[self.name]


@functools.lru_cache(maxsize=4)
def shelf(tree: Tree, q: bytes) -> dict[str, Any]:
    """Where the `geometry` of a pose is kept while it is among the last few."""
    return {}
