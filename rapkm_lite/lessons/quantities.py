"""Numbers that the arguments of an exercise hold, for naming a factor that is missing or one too many."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from ..machine.manipulator import Manipulator
from ..mechanics.trajectory import Trajectory
from .seen import Seen


def _of(name: str, value: Any) -> dict[str, float]:
    """The numbers of one argument, each with words for it."""
    if isinstance(value, Manipulator):
        k_t, R_el = float(value.torque_constant[0]), float(value.resistance[0])
        return {"k_t": k_t, "R_el": R_el, "R_el/k_t^2": R_el / k_t**2, "number of drives": float(value.n_arms)}
    if isinstance(value, Trajectory):
        return {"dt": float(value.dt), "duration": float(value.t[-1])}
    try:
        array = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        return {}
    if array.ndim == 0:
        return {name: float(array)}
    if array.ndim == 1 and array.size > 1 and np.ptp(array) == 0.0:
        return {name: float(array[0]), "number of entries of " + name: float(array.size)}
    # The length of a vector is its norm in all lessons; how many there are goes first, as it is the norm of signs.
    found = {f"number of {'entries' if array.ndim == 1 else 'rows'} of {name}": float(len(array))}
    found["norm of " + name] = float(np.linalg.norm(array))
    if array.ndim == 1:
        found["sum of " + name] = float(array.sum())
    elif array.ndim == 2 and array.shape[0] == array.shape[1]:
        found["trace of " + name] = float(np.trace(array))
    return found


def quantities(seen: Seen) -> Iterator[tuple[str, np.ndarray]]:
    """Words and one number per case: numbers of single arguments that are positive in every case."""
    for k, name in enumerate(seen.names):
        found = [_of(name, case[k]) if k < len(case) else {} for case in seen.cases]
        for words in found[0]:
            if all(words in f for f in found):
                values = np.array([f[words] for f in found])
                if np.all(np.isfinite(values)) and np.all(values > 0.0):
                    yield words, values


def _vectors(name: str, value: Any) -> dict[str, np.ndarray]:
    """Vectors of one argument, each with words for it: itself, a diagonal, the motors of a machine."""
    if isinstance(value, Manipulator):
        return {"R_el": value.resistance, "k_t": value.torque_constant, "l_1": value.lengths[:, 0]}
    if not isinstance(value, np.ndarray):
        return {}
    if value.ndim == 1:
        return {name: value}
    diagonal = value.ndim == 2 and value.shape[0] == value.shape[1] and not np.any(value - np.diag(np.diag(value)))
    return {name: np.diag(value)} if diagonal else {}


def entrywise(seen: Seen) -> Iterator[tuple[str, list[np.ndarray]]]:
    """Words and, per case, an array that scales the entries or rows of the right answer by those of an argument."""
    for k, name in enumerate(seen.names):
        vectors = [_vectors(name, case[k]) if k < len(case) else {} for case in seen.cases]
        for words in vectors[0]:
            scales = [
                v[words].reshape(-1, *[1] * (w.ndim - 1))
                for v, w in zip(vectors, seen.want, strict=True)
                if words in v and w.ndim and len(v[words]) == len(w) and np.all(v[words])
            ]
            if len(scales) == len(seen.cases):
                yield words, scales


def matrices(seen: Seen) -> Iterator[tuple[str, list[np.ndarray]]]:
    """Words and, per case, the right answer with a square argument multiplied on, or divided off."""
    for k, name in enumerate(seen.names):
        pairs = list(zip(seen.argument(k), seen.want, strict=False))
        if not pairs or not all(w.ndim and M.shape == (len(w), len(w)) for M, w in pairs):
            continue
        yield f"the factor {name} is one too many", [M @ w for M, w in pairs]
        if all(abs(np.linalg.det(M)) > 1e-12 for M, _ in pairs):
            yield f"the factor {name} is missing", [np.linalg.solve(M, w) for M, w in pairs]
