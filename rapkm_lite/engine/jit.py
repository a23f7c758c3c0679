"""Numba where it is installed; without it the same source runs as plain Python, slower, with the same numbers."""

from __future__ import annotations

import functools
import hashlib
import platform
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from . import compiled

COMPILED = compiled()
if COMPILED:
    from llvmlite import ir
    from numba import njit, types
    from numba.core.runtime.nrt import rtsys
    from numba.extending import intrinsic

    from .compiler import Wide


# Multiply-adds may be fused where LLVM fuses all copies of a loop alike: on ARM it does not, and a run would feel by
# rounding which way through a hold its neighbours need.  Sums are never reordered, so that a number does not depend on
# how loops are vectorised.
_FUSED = {"contract"} if platform.machine().lower() in ("x86_64", "amd64") else set()
# Kernels write into arrays that they are given: without reference counting a sample takes up to a third less.
_OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": _FUSED, "_nrt": False}
if COMPILED:
    _OPTIONS["pipeline_class"] = Wide
_INNER: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True, **_OPTIONS}
_VIEW: dict[str, Any] = {**_INNER, "_nrt": True}


@functools.cache
def _sources() -> str:
    """Fingerprint of the sources in this folder."""
    files = sorted(Path(__file__).parent.glob("*.py"))
    return hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()[:12]


SHIFT = 1.5 * 2.0**52
"""Added to a small number it leaves the nearest whole number in the last bits of the sum."""


def _power_by_bits(_, shifted):
    """The last bits go to where the exponent of a number stands."""

    def generate(context, builder, signature, arguments):
        (number,), whole = arguments, ir.IntType(64)
        bits = builder.shl(builder.bitcast(number, whole), whole(52))
        return builder.bitcast(builder.add(bits, whole(1023 << 52)), number.type)

    return types.float64(types.float64), generate


power: Callable[..., Any] = intrinsic(_power_by_bits) if COMPILED else lambda shifted: 2.0 ** (shifted - SHIFT)
"""2^k of k + SHIFT."""


def kernel(function) -> Callable[..., Any]:
    """Compile a function that Python calls: cached on disk, and running without the interpreter lock."""
    if not COMPILED:
        return np.errstate(all="ignore")(function)  # the judgement of a run finds what is not finite, as in the kernel
    # Numba's cache looks at the file of the kernel only, but its parts live in all files of this folder.
    function.__qualname__ += "_" + _sources()
    try:
        return _forgiving(njit(cache=True, nogil=True, **_OPTIONS)(function))
    except RuntimeError:  # no folder for a cache that this user may write to
        return njit(nogil=True, **_OPTIONS)(function)


def _forgiving(dispatcher):
    """A cache that cannot be read or written (cut short, a full disk, lost permissions) costs time, but no run."""

    def quiet(access):
        def tried(*arguments):
            try:
                return access(*arguments)
            except Exception:
                return None

        return tried

    def swept(*arguments):
        """Save a kernel, and delete those of earlier sources, megabytes that nobody would ever read again."""
        for old in Path(cache.cache_path).glob(f"*_{'[0-9a-f]' * 12}-*.nb[ci]"):
            if _sources() not in old.name:
                old.unlink(missing_ok=True)
        save(*arguments)

    def loaded(signature, context):
        """A kernel from the cache, with Numba's runtime; of all that Numba can compile, and would import first for half
        of a second, it needs nothing."""
        rtsys.initialize(context)
        return cache._load_overload(signature, context)

    cache = dispatcher._cache
    save = cache.save_overload
    cache.load_overload, cache.save_overload = quiet(loaded), quiet(swept)
    return dispatcher


def leaf(function):
    """Compile a function that only kernels call, inlined into each of them."""
    return njit(forceinline=True, **_INNER)(function) if COMPILED else function


def view(function):
    """A `leaf`, or what calls one, that returns a part of an array."""
    return njit(**_VIEW)(function) if COMPILED else function


def index(function):
    """A `leaf` compiled once: Numba would compile it anew for every constant integer among its arguments."""
    if not COMPILED:
        return function
    dispatcher = njit(forceinline=True, **_INNER)(function)
    ask = dispatcher.get_call_template
    known = functools.cache(lambda *args: ask(args, {}))
    dispatcher.get_call_template = lambda args, kws: known(*map(types.unliteral, args))
    return dispatcher


def outlined(function):
    """Compile a function that only kernels call, on its own: large loops over runs are vectorised more surely so."""
    return njit(**_INNER)(function) if COMPILED else function
