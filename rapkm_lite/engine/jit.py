"""Numba where it is installed; without it the same source runs as plain Python, slower, with the same numbers.

Numba's cache looks at the file of a kernel only: after a change in another file of this folder, touch the kernel's.
"""

from __future__ import annotations

from . import COMPILED

if COMPILED:
    from numba import njit

# Multiply-adds may be fused; sums are never reordered, so that a number does not depend on how loops are vectorised.
_OPTIONS = {"error_model": "numpy", "fastmath": {"contract"}}
_INNER = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True, **_OPTIONS}


def kernel(function):
    """Compile a function that Python calls: cached on disk, and running without the interpreter lock."""
    return njit(cache=True, nogil=True, **_OPTIONS)(function) if COMPILED else function


def leaf(function):
    """Compile a function that only kernels call, and put it into each of them."""
    return njit(forceinline=True, **_INNER)(function) if COMPILED else function


def outlined(function):
    """Compile a function that only kernels call, on its own: large loops over runs are vectorised more surely so."""
    return njit(**_INNER)(function) if COMPILED else function
