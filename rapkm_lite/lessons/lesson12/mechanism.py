"""Any mechanism from its symbols: SymPy differentiates, NumPy evaluates, for one state or many (leading axes)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...machine.arguments import matvec


@dataclass(frozen=True)
class Mechanism:
    """What the theory needs of a mechanism, as functions of q (..., n) and qd (..., n); the drives are the first m.

    h : loop constraints (1), (..., r).  J : their Jacobian, (..., r, n).
    terms : (q, qd) -> J, dJ/dt, and G, C, Q of the cut tree (2), with C from Christoffel symbols.
    """

    n: int
    m: int
    r: int
    h: Callable
    J: Callable
    terms: Callable


def symbolic():
    """SymPy, which the package needs nowhere else."""
    try:
        import sympy
    except ImportError as error:
        raise ImportError("a mechanism is derived with SymPy, which is missing: python -m pip install sympy") from error
    return sympy


def derive(q, qd, h, T, m: int, U=0) -> Mechanism:
    """The mechanism with angles q and rates qd (SymPy symbols), constraints h, kinetic energy T and potential U.

    m : number of drives; they sit on the first m of q.

    >>> import sympy as sp; q, qd = sp.symbols("a b"), sp.symbols("ad bd")
    >>> lever = derive(q, qd, [q[0] - sp.sin(q[1])], qd[0] ** 2 + qd[1] ** 2 / 2, m=1)
    >>> lever.J(np.array([0.0, 0.0]))
    array([[ 1., -1.]])
    """
    sp = symbolic()
    q, qd, n = list(q), list(qd), len(q)
    h = sp.Matrix(list(h))
    J = h.jacobian(q)
    J_dot = sum((J.diff(a) * ad for a, ad in zip(q, qd, strict=True)), sp.zeros(len(h), n))
    G = sp.hessian(sp.sympify(T), qd)
    slopes = [G.diff(a) for a in q]
    C = sp.zeros(n, n)
    for i in range(n):
        for j in range(n):
            C[i, j] = sum((slopes[k][i, j] + slopes[j][i, k] - slopes[i][j, k]) * qd[k] for k in range(n)) / 2
    Q = sp.Matrix([sp.sympify(U)]).jacobian(q).T
    return Mechanism(n, m, len(h), _numbers(q, [], h), _numbers(q, [], J), _numbers(q, qd, J, J_dot, G, C, Q))


def _numbers(q, qd, *matrices) -> Callable:
    """One function of q, or of (q, qd), that evaluates all the matrices; columns (k, 1) become vectors (..., k)."""
    sp = symbolic()
    shapes = [m.shape if m.shape[1] > 1 else m.shape[:1] for m in matrices]
    flat = [e for m in matrices for e in m]
    busy = [k for k, e in enumerate(flat) if e != 0]
    entries = sp.lambdify([*q, *qd], [flat[k] for k in busy], "numpy", cse=True)
    ends = np.cumsum([len(m) for m in matrices])[:-1]

    def evaluate(*state):
        state = np.broadcast_arrays(*(np.asarray(s, dtype=float) for s in state))
        values = np.zeros((len(flat), *state[0].shape[:-1]))
        for k, value in zip(busy, entries(*(c for s in state for c in np.moveaxis(s, -1, 0))), strict=True):
            values[k] = value
        parts = np.split(np.moveaxis(values, 0, -1), ends, axis=-1)
        parts = [p.reshape(*p.shape[:-1], *shape) for p, shape in zip(parts, shapes, strict=True)]
        return parts if len(parts) > 1 else parts[0]

    return evaluate


def accelerations(mechanism: Mechanism, q, qd, c) -> np.ndarray:
    """qdd (..., n) of the motion equations (2) with J qdd + dJ/dt qd = 0, for drive torques c (..., m)."""
    J, J_dot, G, C, Q = mechanism.terms(q, qd)
    n = mechanism.n
    saddle = np.zeros((*np.shape(q)[:-1], n + mechanism.r, n + mechanism.r))
    saddle[..., :n, :n], saddle[..., :n, n:], saddle[..., n:, :n] = G, J.mT, J
    right = np.concatenate([-matvec(C, qd) - Q, -matvec(J_dot, qd)], axis=-1)
    right[..., : mechanism.m] += c
    return np.linalg.solve(saddle, right[..., None])[..., :n, 0]
