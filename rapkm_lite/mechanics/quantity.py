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
        pose.__dict__[self.name] = value = self.of(pose)
        return value

    def of(self, pose) -> Any:
        """The quantity at a pose that does not have it yet."""
        value: Any = self.function(pose)
        for array in value if type(value) is tuple else (value,):
            array.setflags(False)
        return value


class rate(quantity[Kept]):
    """A `quantity` that needs qd."""

    needs_rates = True


class geometry(quantity[Kept]):
    """A `quantity` of q alone that is not handed out: the next `At` of the same single pose takes it over.

    Every function of the chapter makes an `At` of its own, and a law calls several of them at one pose.
    """

    def of(self, pose) -> Any:
        """The quantity as it is kept for this pose, or else computed."""
        kept = pose.__dict__.get("_geometry")
        if kept is None:
            kept = pose.__dict__["_geometry"] = _lately(pose.robot.tree, pose.q.tobytes()) if pose.q.ndim == 1 else {}
        value = kept.get(self.name)
        if value is None:
            value = kept[self.name] = super().of(pose)
        return value


@functools.lru_cache(maxsize=4)
def _lately(tree: Tree, q: bytes) -> dict[str, Any]:
    """Where the `geometry` of a pose is kept while it is among the last few."""
    return {}
