"""Checks on arguments: one sentence per mistake, naming the argument, its value and what is allowed."""

from __future__ import annotations

import inspect
import itertools
import math
import sys
from collections.abc import Sequence
from typing import Any

import numpy as np

_FLOAT = np.dtype(float)
_LEAST = 1e-100


class ConvergenceError(RuntimeError, ValueError):
    """An iteration found no solution; the message says where it stopped, and the residuals or the last step there.

    >>> import rapkm_lite as rk
    >>> try:
    ...     rk.estimate_pose(rk.load(), [0.0, 0.0, 0.0], guess=[0.0, 0.0])
    ... except rk.ConvergenceError as error:
    ...     print(str(error)[:35])
    estimate_pose found no pose for q_a
    """


def real_array(name: str, value, *last: int) -> np.ndarray:
    """Return `value` as a float array of finite numbers whose trailing axes have the lengths `last`.

    Raises ValueError when `value` is not numeric (text, Boolean and complex values are not), holds NaN, infinity or
    numbers from 1e100 on, or has other trailing axes.
    """
    plain = type(value) is np.ndarray and value.dtype == _FLOAT and value.shape[value.ndim - len(last) :] == last
    array = value if plain else numeric(name, value, *last)
    # Beyond 1e100 products would overflow and leave a function as infinity or NaN.  One product clears a small array;
    # for a large one it would wake the threads of the linear algebra library.
    if not (np.vdot(array, array) < 1e200 if array.size <= 1000 else -1e100 < array.min() and array.max() < 1e100):
        for bad in np.argwhere(~(np.abs(array) < 1e100)):
            raise ValueError(f"{name}{entry(bad)} = {array[*bad]}; allowed: finite numbers, below 1e100 in magnitude")
    return array


def masked(value) -> bool:
    """Is it a masked array?  NumPy loads their module, which takes a while, only when somebody makes one."""
    return "numpy.ma" in sys.modules and isinstance(value, np.ma.MaskedArray)


def numeric(name: str, value, *last: int) -> np.ndarray:
    """`real_array` before the check that its numbers are finite."""
    if masked(value) and np.ma.is_masked(value):
        holes = np.ma.count_masked(value)
        raise ValueError(f"{name} is masked in {holes} of {value.size} entries; allowed: numbers (fill or drop them)")
    try:
        array = np.asarray(value)
        # NumPy would read "1.0", True and bytes as numbers, and drop the imaginary part of a complex array.
        wrong = value is None or isinstance(value, bytearray | memoryview) or array.dtype.kind not in "iufO"
        items = np.asarray(value, dtype=object) if isinstance(value, list | tuple) else array  # True beside numbers
        if wrong or (items.dtype.hasobject and any(isinstance(v, str | bytes | bool | np.bool_) for v in items.flat)):
            raise TypeError
        array = array.astype(float, copy=False)
    except OverflowError:
        raise ValueError(f"{name} = {short(value)} is too large; allowed: finite numbers, below 1e100") from None
    except Exception as error:
        rows = ", in rows of one length" if "inhomogeneous" in str(error) else ""
        raise ValueError(f"{name} = {short(value)} is not numeric; allowed: real numbers{rows}") from None
    if last and array.shape[-len(last) :] != last:
        raise ValueError(f"{name} has shape {array.shape}; allowed: ({', '.join(['...', *map(str, last)])})")
    return array


def shaped(name: str, array: np.ndarray, fits: bool, allowed: Any) -> np.ndarray:
    """Return `array` when its shape `fits`; the sentence says what is `allowed` otherwise."""
    if not fits:
        raise ValueError(f"{name} has shape {array.shape}; allowed: {allowed}")
    return array


def exact_array(name: str, value, *shape: int) -> np.ndarray:
    """`real_array` of exactly this shape, without leading axes."""
    array = real_array(name, value)
    return shaped(name, array, array.shape == shape, shape or "one number")


def drive_values(name: str, value, N: int) -> np.ndarray:
    """Return one number, or one for each drive, as a finite (N,) array."""
    array = real_array(name, value)
    return np.broadcast_to(shaped(name, array, array.shape in ((), (N,)), f"one number or ({N},)"), (N,))


def joint_vectors(size: int, **vectors) -> list[np.ndarray]:
    """Each vector as a finite (..., size) array, after a check that their leading axes fit together."""
    arrays = [real_array(name, value, size) for name, value in vectors.items()]
    check_leading(**{name: array.shape[:-1] for name, array in zip(vectors, arrays, strict=True)})
    return arrays


def check_leading(**leads: tuple[int, ...]) -> tuple[int, ...]:
    """Broadcast leading axes, given by argument name; raises ValueError when they do not fit together."""
    if len(set(leads.values())) == 1:
        return next(iter(leads.values()))
    try:
        return np.broadcast_shapes(*leads.values())
    except ValueError:
        given = ", ".join(f"{name} {lead}" for name, lead in leads.items())
        raise ValueError(f"the leading axes do not fit together: {given}; allowed: equal ones, or none") from None


def tall_matrix(name: str, value) -> np.ndarray:
    """Return `value` as a finite (..., m, k) array with m >= k >= 1."""
    array = real_array(name, value)
    fits = array.ndim >= 2 and 1 <= array.shape[-1] <= array.shape[-2]
    return sized(name, shaped(name, array, fits, "(..., m, delta) with m >= delta"))


def wide_matrix(name: str, value) -> np.ndarray:
    """Return `value` as a finite (..., m, n) array of 2 <= m <= n rows."""
    array = real_array(name, value)
    fits = array.ndim >= 2 and 2 <= array.shape[-2] <= array.shape[-1]
    return sized(name, shaped(name, array, fits, "(..., m, n) with n >= m >= 2"))


def sized(name: str, array: np.ndarray) -> np.ndarray:
    """Return matrices whose products neither overflow nor vanish; a matrix of zeros is one of them."""
    if array.ndim == 2 and 1e-100 < np.vdot(array, array) < 1e100:
        return array
    largest = np.abs(array).max(axis=(-2, -1))
    wrong = largest[(largest != 0.0) & ((largest < 1e-50) | (largest > 1e50))]
    if wrong.size:
        raise ValueError(f"{name} has {wrong[0]:.3g} as largest entry; allowed: 1e-50 to 1e50 in magnitude")
    return array


def bounded(name: str, array: np.ndarray, low: float, *, strict: bool) -> np.ndarray:
    """Return `array` when no entry is below `low`, or when `strict`, where `low` is zero, all are above it."""
    # By 1e-100 at least: what is divided by less may leave a function as infinity.
    bad = array < (_LEAST if strict else low)
    if np.any(bad):
        where = np.argwhere(bad)[0]
        number = array[tuple(where)]
        allowed = f">= {low:g}" if not strict else f"> 0, from {_LEAST:g} on" if number > 0.0 else "> 0"
        raise ValueError(f"{name}{entry(where)} = {number:g}; allowed: {allowed}")
    return array


def positive_number(name: str, value) -> float:
    """Return `value` as a positive, finite float."""
    return float(bounded(name, exact_array(name, value), 0.0, strict=True))


def small_number(name: str, value) -> float:
    """Return `value` as a float between 0 and 1, such as a tolerance."""
    number = positive_number(name, value)
    if number >= 1.0:
        raise ValueError(f"{name} = {number:g}; allowed: between 0 and 1")
    return number


def whole_number(name: str, value, low: int, high: float = math.inf) -> int:
    """Return `value` as an int that is not below `low`, nor above `high`."""
    if type(value) is int and low <= value <= min(high, 2**53):
        return value
    number = float(bounded(name, exact_array(name, value), low, strict=False))
    if not number.is_integer() or number > high:
        given = f"{number:g}" if number.is_integer() else number  # to the last digit: 4095.9999999999995 is not 4096
        raise ValueError(f"{name} = {given}; allowed: whole numbers >= {low}" + f", to {high}" * (high < math.inf))
    return int(number)


def positive_definite(name: str, value, size: int) -> np.ndarray:
    """Return a scalar, a diagonal (size,) or a matrix (..., size, size) as a symmetric positive definite matrix.

    Raises ValueError, with the smallest eigenvalue, when it is not.
    """
    array = real_array(name, value)
    array = array if array.ndim else np.full(size, float(bounded(name, array, 0.0, strict=True)))
    fits = array.shape == (size,) or array.shape[-2:] == (size, size)
    shaped(name, array, fits, f"one number, ({size},) or ({size}, {size})")
    if array.ndim == 1:
        return np.diag(bounded(name, array, 0.0, strict=True))
    largest, skew = (np.abs(part).max(axis=(-2, -1), initial=0.0) for part in (array, array - array.mT))
    if skew := np.where(skew > 1e-12 * largest, skew, 0.0).max(initial=0.0):
        raise ValueError(f"{name} is not symmetric (by {skew:.3g}); allowed: symmetric positive definite")
    unit = np.sqrt(np.maximum(np.diagonal(array, axis1=-2, axis2=-1), _LEAST))  # far units are no loss of rank
    if np.linalg.eigvalsh(array / unit[..., None] / unit[..., None, :]).min(initial=np.inf) <= 1e-14:
        least = np.linalg.eigvalsh(array).min()
        raise ValueError(f"{name} has the eigenvalue {least:.3g}; allowed: symmetric positive definite")
    return array


def listed(value):
    """Return what an array, or a pandas Series, which is no `Sequence`, holds as a list; anything else as it is."""
    try:
        return np.asanyarray(value).tolist() if hasattr(value, "__array__") else value
    except Exception:
        return value


def joint_indices(name: str, value, n: int | None, count: int | None = 2, what: str = "joint") -> tuple[int, ...]:
    """Return `value` as `count` different 0-based indices of joints (drives, arms: `what`), below `n` if known."""
    several = isinstance(numbers := listed(value), Sequence) and not isinstance(numbers, bytes | bytearray)
    numbers = list(map(listed, itertools.islice(numbers, 1001))) if several else ()  # a range may be endless
    plain = all(isinstance(i, int | float) and not isinstance(i, bool) for i in numbers)
    exact = plain and all(0 <= i // 1 == i < (n or math.inf) for i in numbers)  # 2.0 is 2, as in `whole_number`
    if not (exact and len(set(numbers)) == len(numbers) and (len(numbers) == count if count else len(numbers) >= 2)):
        some = f"a list of one {what} index" if count == 1 else f"{count or 'two or more'} different {what} indices"
        raise ValueError(f"{name} = {short(value)}; allowed: {some} from 0 {'on' if n is None else f'to {n - 1}'}")
    return tuple(map(int, numbers))


def one_of(name: str, value, allowed) -> str:
    """Return `value` when it is one of the names `allowed`."""
    if not isinstance(value, str) or value not in allowed:
        raise ValueError(f"{name} = {short(value)}; allowed: {', '.join(map(repr, allowed))}")
    return value


def switch(name: str, value) -> bool:
    """Return `value` as a bool when it is True or False."""
    return bool(of_kind(name, value, (bool, np.bool_), "True or False"))


def of_kind(name: str, value: Any, kind, allowed: str) -> Any:
    """Return `value` when it is an instance of `kind`; the sentence says what is `allowed` otherwise."""
    if not isinstance(value, kind):
        raise ValueError(f"{name} = {short(value)}; allowed: {allowed}")
    return value


def function(name: str, value: Any) -> Any:
    """Return `value` when it can be called, and is no class."""
    return having(name, value, "a function", "__call__")


def callable_with(name: str, value: Any, *given: str) -> Any:
    """Return `value` when it can be called with the arguments `given`, by position, and has none of them elsewhere."""
    allowed = f"({', '.join(given)})"
    if inspect.iscoroutinefunction(value) or inspect.iscoroutinefunction(type(value).__call__):
        raise ValueError(f"{name} = {short(value)} is a coroutine; allowed: def, not async def")
    try:
        inspect.signature(value).bind(*given)
        parameters = inspect.signature(value, follow_wrapped=False).parameters.values()
    except TypeError as error:
        raise ValueError(f"{name} = {short(value)} cannot be called ({error}); allowed: a function {allowed}") from None
    except ValueError:
        return value  # built-in functions have no signature
    told = [p.name for p in parameters if p.kind is not p.KEYWORD_ONLY]
    if any(own in given and own != place for own, place in zip(told, given, strict=False)):
        raise ValueError(f"{name} takes ({', '.join(told)}), in another order; allowed: {allowed}")
    return value


def having(name: str, value: Any, allowed: str, *attributes: str) -> Any:
    """Return `value`, no class, when it has the attributes that a value of another room would have."""
    if isinstance(value, type) or not all(hasattr(value, attribute) for attribute in attributes):
        raise ValueError(f"{name} = {short(value)}; allowed: {allowed}")
    return value


def matvec(matrix: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """Product of (..., i, j) and (..., j)."""
    if vector.ndim == 1:
        return matrix.dot(vector) if matrix.ndim == 2 else matrix @ vector
    return np.einsum("...ij,...j->...i", matrix, vector)


def entry(index) -> str:
    """An index as one writes it, such as "[3, 1]"; nothing for a number."""
    return f"[{', '.join(map(str, index))}]" if len(index) else ""


def short(value) -> str:
    """A value in at most 80 characters of one line, whatever it is."""
    try:
        words = " ".join(repr(value).split())
    except Exception:
        words = f"<{type(value).__name__}>"
    return words if len(words) <= 80 else words[:77] + "..."
