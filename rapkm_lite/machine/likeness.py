"""Equality by value of what a value may hold: arrays, containers, and functions and objects that a user wrote."""

from __future__ import annotations

import math
import types
from typing import Any

import numpy as np

from .arguments import masked

_LOOKED_AT = 64
"""Items of an array or tuple that count in a hash; of more, three stand for all."""


def equal(a: Any, b: Any, begun: frozenset = frozenset()) -> bool:
    """Are two things of the same kind equal, whatever they hold?  NaN equals NaN.

    A class with an ``__eq__`` of its own decides itself.  Other objects are equal when their types and states are, and
    functions when their code and all that they enclose is; what has no state to look at equals only itself.

    >>> equal({"gain": np.ones(3)}, {"gain": np.ones(3)}), equal([1.0, None], [1.0, 2.0])
    (True, False)
    """
    if a is b or (id(a), id(b)) in begun:  # a cycle that leads back here adds nothing
        return True
    begun |= {(id(a), id(b))}
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        return _equal_arrays(a, b)
    if isinstance(a, list | tuple | dict) and isinstance(b, list | tuple | dict):
        return _equal_items(a, b, begun)
    if _decides(a):
        try:
            return bool(a == b) or bool(isinstance(a, float) and a != a and b != b)
        except Exception:
            pass  # such as the truth of an array
    parts = _parts(a) if type(a) is type(b) else None
    return parts is not None and equal(parts, _parts(b), begun)


def key(value: Any) -> Any:
    """Something hashable that is equal for equal values: 1 and 1.0, 0.0 and -0.0 are equal.

    >>> key(np.array([-0.0])) == key(np.array([0])), key(len) == key(len)
    (True, True)
    """
    if isinstance(value, np.ndarray):
        value = np.ma.filled(value, 0) if masked(value) else value
        value = value if value.ndim else value[()]
    if isinstance(value, tuple | np.ndarray):
        some = value if len(value) <= _LOOKED_AT else (len(value), *(value[k] for k in (0, len(value) // 2, -1)))
        return tuple(map(key, some))
    if isinstance(value, set | frozenset):
        return frozenset
    if _decides(value):
        try:
            hash(value)
            value = float(value) if isinstance(value, int | np.integer) else value  # 2**53 + 1 in an array of floats
            return math.nan if isinstance(value, float | np.inexact) and value != value else value
        except Exception:
            pass
    return type(value)  # an object may change, its hash may not


def _equal_arrays(a, b) -> bool:
    if masked(a) or masked(b):
        masks = np.array_equal(np.ma.getmaskarray(a), np.ma.getmaskarray(b))
        return masks and _equal_arrays(np.ma.filled(a, 0), np.ma.filled(b, 0))
    try:
        a, b = np.asarray(a), np.asarray(b)
        return np.array_equal(a, b, equal_nan=a.dtype.kind in "fc" and b.dtype.kind in "fc")
    except Exception:  # an array of objects
        return False


def _equal_items(a, b, begun) -> bool:
    """Tuples of whatever kind; lists and dictionaries of the same kind."""
    if not (isinstance(a, tuple) and isinstance(b, tuple)) and type(a) is not type(b):
        return False
    if isinstance(a, dict) and isinstance(b, dict):
        return a.keys() == b.keys() and all(equal(a[name], b[name], begun) for name in a)
    return len(a) == len(b) and all(equal(x, y, begun) for x, y in zip(a, b, strict=True))


def _decides(value) -> bool:
    """Does its class have an ``__eq__`` beyond the identity and that of a dataclass, which arrays break?"""
    if isinstance(value, type | types.ModuleType):
        return True
    if isinstance(value, types.FunctionType | types.MethodType) or type(value).__eq__ is object.__eq__:
        return False
    made = getattr(type(value), "__dataclass_params__", None)
    return made is None or not made.eq


def _parts(value) -> tuple | None:
    """What an object is made of; None where nobody can tell."""
    if isinstance(value, types.FunctionType):
        # What a variable of an enclosing function holds, which may be nothing yet.
        cells = tuple(() if cell == types.CellType() else (cell.cell_contents,) for cell in value.__closure__ or ())
        return value.__code__, value.__defaults__, value.__kwdefaults__, cells, vars(value), id(value.__globals__)
    if isinstance(value, types.MethodType):
        return value.__func__, value.__self__
    try:
        made = value.__reduce_ex__(4)
        # A str names a global, equal only to itself; items of lists and dictionaries come as iterators.
        return None if isinstance(made, str) else tuple(tuple(p) if hasattr(p, "__next__") else p for p in made)
    except Exception:
        return getattr(value, "__dict__", None)
