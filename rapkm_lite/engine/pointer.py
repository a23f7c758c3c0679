"""A law that a user wrote, compiled behind a function pointer, so that the loop itself is compiled only once."""

from __future__ import annotations

import functools
import re
import warnings
from collections import namedtuple
from collections.abc import Hashable
from inspect import isfunction
from typing import Any

import numpy as np

from .refusal import MATRICES, refusal

Wanted = namedtuple("Wanted", "x xd xdd q qd qdd q_a qd_a qdd_a")
Matrices = namedtuple("Matrices", MATRICES)


def places(N: int, matrices: bool, memory: int) -> tuple[int, int, int]:
    """Where the buffer of `engine.user` holds memory and answer, and its length."""
    n, r = 2 * N, 2 * N - 2
    # The matrices, and ten columns of intermediate numbers after them.
    room = 4 + 2 * n + 4 * n + 2 * N + 2 * r * n + 4 * n * n + n + 10 + 2 * n * n + n + N * n + 10 * n
    start = 7 + 8 * N + (room if matrices else 0)
    return start, start + memory, start + memory + N


def pointer(function, N: int, matrices: bool, memory: int):
    """The law ``function(t, q_a, qd_a, d[, at][, memory]) -> c`` as a C function of the buffer.

    Raises ValueError with a sentence on what is not allowed when it does not compile.
    """
    if not isinstance(function, Hashable):
        raise ValueError(_cannot(function, N, matrices or memory > 0, "it is no function but an object"))
    return _pointer(function, N, matrices, memory)


def _cannot(function, N: int, asks: bool, words: str) -> str:
    name = getattr(function, "__name__", type(function).__name__)
    plain = "a rk.Law whose step calls it" if asks else "the same function without @compiled"
    return (
        f"the law {name} cannot be compiled ({words}); allowed: a function of numbers and NumPy arrays that "
        f"returns c ({N},), or {plain}, which runs in Python"
    )


@functools.lru_cache(maxsize=64)
def _pointer(function, N: int, matrices: bool, memory: int):
    from numba import cfunc, njit, types
    from numba.core import errors

    # Python calls none of this: to compile ways for it to do so would take a second.
    within: Any = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    # What the user writes stays inside its arrays.
    law: Any = njit(error_model="numpy", boundscheck=True, **within)(function) if isfunction(function) else function
    ask: Any = law
    # All around the law is inlined: handing on an array costs more than reading a number in it.
    inner = njit(forceinline=True, **within)
    n, r = 2 * N, 2 * N - 2
    kept, answer, _ = places(N, matrices, memory)
    if matrices and not memory:
        ask = inner(lambda t, q_a, qd_a, d, at, own: law(t, q_a, qd_a, d, at))
    elif memory and not matrices:
        ask = inner(lambda t, q_a, qd_a, d, at, own: law(t, q_a, qd_a, d, own))
    elif not matrices:
        ask = inner(lambda t, q_a, qd_a, d, at, own: law(t, q_a, qd_a, d))

    @inner
    def take(buffer, o, rows, columns):
        size = rows * columns
        return buffer[o : o + size].reshape((rows, columns)), o + size

    @inner
    def wanted(buffer):
        o = 7 + 2 * N
        q, qd, qdd = buffer[o : o + n], buffer[o + n : o + 2 * n], buffer[o + 2 * n : o + 3 * n]
        x = buffer[1 + 2 * N : 7 + 2 * N]
        return Wanted(x[0:2], x[2:4], x[4:6], q, qd, qdd, q[0:N], qd[0:N], qdd[0:N])

    @inner
    def matrices_of(buffer):
        o = 7 + 2 * N + 3 * n
        x, xd = buffer[o : o + 2], buffer[o + 2 : o + 4]
        o += 4
        q, qd = buffer[o : o + n], buffer[o + n : o + 2 * n]
        F, o = take(buffer, o + 2 * n, n, 2)
        F_dot, o = take(buffer, o, n, 2)
        A_T_pinv, o = take(buffer, o, N, 2)
        J, o = take(buffer, o, r, n)
        J_dot, o = take(buffer, o, r, n)
        P, o = take(buffer, o, n, n)
        P_dot, o = take(buffer, o, n, n)
        G, o = take(buffer, o, n, n)
        C, o = take(buffer, o, n, n)
        Q = buffer[o : o + n]
        G2, o = take(buffer, o + n, 2, 2)
        C2, o = take(buffer, o, 2, 2)
        Q2 = buffer[o : o + 2]
        Gn, o = take(buffer, o + 2, n, n)
        Cn, o = take(buffer, o, n, n)
        Qn = buffer[o : o + n]
        pinv, o = take(buffer, o + n, N, n)
        minimal, redundant = (G2, C2, Q2), (Gn, Cn, Qn)
        return Matrices(
            x, xd, q, qd, F, F_dot, F[:N], A_T_pinv, J, J_dot, P, P_dot, G, C, Q, minimal, redundant, P[:N], pinv
        )

    at_hand = matrices_of if matrices else inner(lambda buffer: None)

    def call(buffer):
        # A law that raises gives no answer; what it raised is found by running it in Python.
        for i in range(N):
            buffer[answer + i] = np.nan
        try:
            q_a, qd_a, own = buffer[1 : 1 + N], buffer[1 + N : 1 + 2 * N], buffer[kept : kept + memory]
            c = ask(buffer[0], q_a, qd_a, wanted(buffer), at_hand(buffer), own)
            for i in range(N):
                # An answer of another length is none.
                buffer[answer + i] = c[i] if len(c) == N else np.nan
        except Exception:
            pass

    try:
        with warnings.catch_warnings():
            # The keys of a dictionary are no numbers, which is no news of the user's own lines: the sentence is below.
            warnings.filterwarnings("ignore", category=errors.NumbaWarning, module=".*engine.pointer")
            made = cfunc(types.void(types.Array(types.float64, 1, "C")), error_model="numpy")(call)
        if any(re.search("bool|^Dict|bytes", str(found.return_type)) for found in law.nopython_signatures):
            raise errors.TypingError("truth values, dictionaries and bytes are no torques, though C would take them")
        return made
    except Exception as error:
        found = [signature.return_type for signature in getattr(law, "nopython_signatures", ())]
        words = refusal(function, error, found[0] if found else None)
        raise ValueError(_cannot(function, N, matrices or memory > 0, words)) from error
