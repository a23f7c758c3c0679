"""Values that do not change: what machines, paths, laws, gains, runs and sweeps have in common.

A value is a frozen dataclass on the base `Value`:

    @dataclass(frozen=True, eq=False, repr=False)
    class Gains(Value):
        K_P: Array
        K_D: Array = default(0.0)

        def __post_init__(self):
            super().__post_init__(K_P=real_array("K_P", self.K_P))

``eq=False, repr=False`` because `Value` brings both (a plain ``@dataclass(frozen=True)`` makes them for nothing).  A
class with its own ``__post_init__`` ends it with the one of `Value`, which takes fields that were checked and freezes
every array among all fields, in tuples and lists too.  What is computed on demand and kept
(``functools.cached_property``) is no field: it is neither compared, nor pickled, nor copied.

`Array` and its like tell editors that a field is given as a number or list, and kept as an array.
"""

from __future__ import annotations

import copy
import dataclasses
import itertools
from functools import cache, cached_property
from reprlib import recursive_repr
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, ClassVar, Generic, TypeVar

import numpy as np

from .arguments import masked, short
from .likeness import equal, key

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike

    Kept = TypeVar("Kept")
    Given = TypeVar("Given")

    class Field(Generic[Kept, Given]):
        def __get__(self, value: Any, kind: type | None = None) -> Kept: ...

        def __set__(self, value: Any, given: Given) -> None: ...

    Array = Field[np.ndarray, ArrayLike]
    FilledArray = Field[np.ndarray, ArrayLike | None]
    OptionalArray = Field[np.ndarray | None, ArrayLike | None]
    OptionalCount = Field[int | None, float | None]
    OptionalPair = Field[tuple[int, int] | None, Sequence[int] | np.ndarray | None]
else:
    Array = FilledArray = OptionalArray = OptionalCount = OptionalPair = Any


def default(value: Any) -> Any:
    """The default of a field that keeps an array, as a user would give it."""
    return value


def frozen(array) -> np.ndarray:
    """A copy of an array that nobody can write into, and that no ``setflags`` makes writable again.

    The numbers lie in an object of type bytes.  An array that came from here, or that holds objects, is returned as it
    is.

    >>> frozen([1.0, 2.0])[0] = 3.0
    Traceback (most recent call last):
    ValueError: assignment destination is read-only
    """
    if masked(array) and array is not np.ma.masked:
        if _is_frozen(array.data) and _is_frozen(np.ma.getmaskarray(array)):
            return array
        return np.ma.MaskedArray(frozen(array.data), frozen(np.ma.getmaskarray(array)), fill_value=array.fill_value)
    array = np.asarray(array)
    if array.dtype.hasobject or _is_frozen(array):
        return array
    return np.frombuffer(array.tobytes(), dtype=array.dtype).reshape(array.shape)


def room(*sizes: int) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Zeros to write into once, before anybody else sees them; and the same arrays, read-only like those of `frozen`.

    >>> (write, _), (read, _) = room(2, 3)
    >>> write[:] = 1.0, 2.0
    >>> frozen(read) is read, read.tolist()
    (True, [1.0, 2.0])
    """
    read = np.frombuffer(bytes(8 * sum(sizes)))
    place = read.__array_interface__
    write = np.asarray(SimpleNamespace(of=read, __array_interface__=place | {"data": (place["data"][0], False)}))
    parts = [slice(end - size, end) for end, size in zip(itertools.accumulate(sizes), sizes, strict=True)]
    return [write[part] for part in parts], [read[part] for part in parts]


def _is_frozen(array: np.ndarray) -> bool:
    root = array
    while isinstance(root, np.ndarray):
        root = root.base
    # NumPy leaves a large unpickled array writable, in spite of the bytes below it.
    return isinstance(root, bytes) and array.flags.c_contiguous and not array.flags.writeable


def _frozen(value):
    """A field as it is kept: arrays frozen, lists and tuples as tuples of such."""
    if isinstance(value, np.ndarray):
        return frozen(value)
    if type(value) in (list, tuple):
        return tuple(map(_frozen, value))
    if isinstance(value, np.str_):
        return str(value)  # prints as one types it
    return value


class Value:
    """Base of the frozen dataclasses of this package: read-only arrays, compared by value, printed as typed.

    `frozen` copies of the caller's arrays are kept, also by pickling and copying, so neither side can change the
    other's.  (Two things NumPy allows with a read-only array: ``a.shape = ...`` gives it another shape in place, and so
    changes the value, use ``a.reshape``; and ``a.unshare_mask()`` a mask that can be changed, use ``np.ma.copy``.)
    Values of one type are equal when their fields are, as `likeness.equal` says; equal values have equal hashes,
    computed once.  What a user's class sets besides its fields is compared, copied and printed with them, and stays as
    it is.
    """

    __dataclass_fields__: ClassVar[dict[str, Any]]

    def __init_subclass__(cls, **options):
        """Keep a user's ``@dataclass(frozen=True)`` from replacing what stands here: its own fails with arrays."""
        super().__init_subclass__(**options)
        for name in ("__eq__", "__hash__", "__repr__"):
            if name not in vars(cls):
                setattr(cls, name, getattr(cls, name))

    def __post_init__(self, **checked):
        self._set(**checked)
        self._check_class()
        for name, value in self._fields().items():
            kept = _frozen(self._checked(name, value))
            if kept is not value:
                object.__setattr__(self, name, kept)

    def _check_class(self) -> None:
        """Refuse a value in the body of a user's class that is meant for a field, which kept its default."""
        for field in dataclasses.fields(self) if _names(type(self)) else ():
            own = getattr(type(self), field.name, field.default)
            untyped = own is not field.default and not hasattr(type(own), "__set__")  # a property sets what it likes
            value = getattr(self, field.name, own)
            if untyped and _same(value, field.default) and not _same(value, own):
                raise ValueError(
                    f"{type(self).__name__}.{field.name} = {short(own)} in the body of the class does not reach the "
                    f"field; allowed: `{field.name}: type = ...` in a class under @dataclass(frozen=True)"
                )

    def _checked(self, name: str, value):
        """The value of a field in full precision; refuses what is not of the declared kind, for the kinds below."""
        kind = self.__dataclass_fields__[name].type
        if kind == "np.ndarray":
            array = np.ma.filled(value, 0) if masked(value) else value
            fine = isinstance(array, np.ndarray) and array.dtype.kind in "biuf"
            if not fine or not np.all(np.isfinite(array)):
                raise ValueError(f"{name} = {short(value)}; allowed: an array of finite numbers")
            return value.astype(float, copy=False) if array.dtype.kind == "f" else value
        elif kind in _KINDS and kind not in (c.__name__ for c in type(value).__mro__):
            raise ValueError(f"{name} = {short(value)}; allowed: a {kind}")
        return value

    def _set(self, **fields) -> None:
        """Set fields while the value is made, as ``__post_init__`` needs it."""
        for name, value in fields.items():
            object.__setattr__(self, name, value)

    @classmethod
    def trusted(cls, *fields):
        """A value made without any check, from fields that are known to be right, and frozen."""
        made = cls.__new__(cls)
        made.__dict__.update(zip(_names(cls), fields, strict=True))
        return made

    def _changed(self, **fields):
        """A copy with other fields, checked; of the same class, whatever the ``__init__`` of a user's class takes."""
        made = copy.copy(self)
        made._set(**fields)
        made.__post_init__()
        return made

    def _fields(self) -> dict[str, Any]:
        """The fields by name, but for those that a class of a user's sets later."""
        return {name: getattr(self, name) for name in _names(type(self)) if hasattr(self, name)}

    def _given(self) -> dict[str, Any]:
        """The fields as one would type them."""
        return self._fields()

    def _own(self) -> dict[str, Any]:
        """What a class of a user's has set besides its fields, without what is computed on demand and kept."""
        kind, names = type(self), _names(type(self))
        if kind.__module__.startswith("rapkm_lite."):
            return {}
        state: Any = object.__getstate__(self)  # None when empty, a pair with `__slots__` of the class
        return {
            name: value
            for part in (state if isinstance(state, tuple) else (state,))
            for name, value in (part or {}).items()
            if name not in (*names, *_CACHES) and not isinstance(getattr(kind, name, None), cached_property)
        }

    def __getstate__(self) -> dict:
        return self._fields() | self._own()

    def __setstate__(self, state: dict) -> None:
        # Unpickled and copied arrays come back writable.
        names = _names(type(self))
        self._set(**{name: _frozen(value) if name in names else value for name, value in state.items()})

    def __eq__(self, other) -> bool:
        if self is other:
            return True
        if type(self) is not type(other):
            return NotImplemented
        # What is its own may lead back to the value, as a bound method does.
        begun = frozenset({(id(self), id(other))})
        return equal((self._fields(), self._own()), (other._fields(), other._own()), begun)

    def __hash__(self) -> int:
        if "_hash" not in self.__dict__:
            self.__dict__["_hash"] = hash((type(self), *map(key, self._fields().values())))
        return self.__dict__["_hash"]

    @recursive_repr()
    def __repr__(self) -> str:
        """The call that makes the value: required fields by position, others by name where they are not the default."""
        parts, given = [], self._given()
        for field in dataclasses.fields(self) if _names(type(self)) else ():
            value = given.get(field.name)
            if field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING:
                parts.append(_typed(value))
            elif not equal(value, _frozen(field.default)):
                parts.append(f"{field.name}={_typed(value)}")
        parts += [f"{name}={_typed(value)}" for name, value in self._own().items()]
        return f"{type(self).__name__}({', '.join(parts)})"


_KINDS = ("Manipulator", "Trajectory", "Sensors", "PD", "str")
"""Kinds of fields that every value is held to, by the name of the class: some stand in rooms above."""

_CACHES = ("_hash", "_tables", "_codes")
"""What is kept beside the fields and belongs to no value."""


@cache
def _names(cls: type) -> tuple[str, ...]:
    return tuple(field.name for field in dataclasses.fields(cls)) if dataclasses.is_dataclass(cls) else ()


def _same(value, other) -> bool:
    """Are they equal, where one number may stand for many?"""
    try:
        return equal(value, other) or bool(np.all(value == np.asarray(other)))
    except Exception:
        return False


def _typed(value) -> str:
    if not isinstance(value, np.ndarray):
        return repr(value)
    return repr(value.tolist()) if value.size <= 36 else f"<array {value.shape}>"
