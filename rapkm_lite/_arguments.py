"""Checks on arguments: one sentence per mistake, naming the argument, its value and what is allowed."""

from __future__ import annotations

import numpy as np


class ConvergenceError(RuntimeError, ValueError):
    """An iteration found no solution; the message carries the residual and the pose it stopped at."""


def real_array(name: str, value, *last: int) -> np.ndarray:
    """Return `value` as a float array of finite numbers whose trailing axes have the lengths `last`.

    Raises ValueError when `value` is not numeric, holds NaN or infinity, or has other trailing axes.
    """
    try:
        array = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise ValueError(f"{name} = {value!r} is not numeric; allowed: real numbers") from None
    if last and array.shape[-len(last):] != last:
        want = "(" + ", ".join(["...", *map(str, last)]) + ")"
        raise ValueError(f"{name} has shape {array.shape}; allowed: {want}")
    if not np.all(np.isfinite(array)):
        bad = np.argwhere(~np.isfinite(array))[0]
        where = f"[{', '.join(map(str, bad))}]" if array.ndim else ""
        raise ValueError(f"{name}{where} = {array[tuple(bad)]}; allowed: finite numbers")
    return array


def bounded(name: str, array: np.ndarray, low: float, *, strict: bool) -> np.ndarray:
    """Return `array` when every entry is above `low` (not below it when `strict` is false)."""
    bad = array <= low if strict else array < low
    if np.any(bad):
        where = np.argwhere(bad)[0]
        index = f"[{', '.join(map(str, where))}]" if array.ndim else ""
        sign = ">" if strict else ">="
        raise ValueError(f"{name}{index} = {array[tuple(where)]:g}; allowed: {sign} {low:g}")
    return array


def positive_number(name: str, value) -> float:
    """Return `value` as a positive, finite float."""
    array = real_array(name, value)
    if array.ndim:
        raise ValueError(f"{name} has shape {array.shape}; allowed: one number")
    return float(bounded(name, array, 0.0, strict=True))


def positive_definite(name: str, value, size: int) -> np.ndarray:
    """Return a scalar, a diagonal (size,) or a matrix (..., size, size) as a symmetric positive definite matrix.

    Raises ValueError, with the smallest eigenvalue, when it is not.
    """
    array = real_array(name, value)
    if array.ndim == 0:
        array = np.full(size, float(array))
    if array.ndim == 1:
        if array.shape != (size,):
            raise ValueError(f"{name} has shape {array.shape}; allowed: one number, ({size},) or ({size}, {size})")
        return np.diag(bounded(name, array, 0.0, strict=True))
    if array.shape[-2:] != (size, size):
        raise ValueError(f"{name} has shape {array.shape}; allowed: one number, ({size},) or ({size}, {size})")
    skew = np.max(np.abs(array - np.swapaxes(array, -1, -2)))
    if skew > 1e-12 * np.max(np.abs(array)):
        raise ValueError(f"{name} is not symmetric (largest difference {skew:.3g}); allowed: symmetric positive definite")
    smallest = np.min(np.linalg.eigvalsh(array))
    if smallest <= 0.0:
        raise ValueError(f"{name} has the eigenvalue {smallest:.3g}; allowed: symmetric positive definite")
    return array


def joint_indices(name: str, value, n: int, count: int = 2) -> tuple[int, ...]:
    """Return `value` as `count` different 0-based joint indices below `n`."""
    try:
        indices = tuple(int(i) for i in value)
        exact = indices == tuple(value)
    except (TypeError, ValueError):
        indices, exact = (), False
    if not exact or len(indices) != count or len(set(indices)) != count or not all(0 <= i < n for i in indices):
        raise ValueError(f"{name} = {value!r}; allowed: {count} different joint indices from 0 to {n - 1}")
    return indices


def matvec(matrix: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """Product of (..., i, j) and (..., j)."""
    return np.einsum("...ij,...j->...i", matrix, vector)


def transpose(matrix: np.ndarray) -> np.ndarray:
    """Transpose of the last two axes."""
    return np.swapaxes(matrix, -1, -2)
