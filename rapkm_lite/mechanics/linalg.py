"""Linear algebra for one small matrix or many: NumPy's wrappers cost more than the arithmetic of a single one."""

from __future__ import annotations

import functools
import math

import numpy as np

_QUARTER = np.array([[0.0, -1.0], [1.0, 0.0]])


def product(first: np.ndarray, *others: np.ndarray) -> np.ndarray:
    """Matrix product first @ ..., with ``ndarray.dot`` where it means the same, at a third of the cost."""
    for matrix in others:
        first = first.dot(matrix) if first.ndim <= 2 and matrix.ndim <= 2 else first @ matrix
    return first


def squares(M: np.ndarray) -> np.ndarray | float:
    """Sum of the squared entries (...,) of matrices (..., m, n)."""
    return float(np.vdot(M, M)) if M.ndim == 2 else np.einsum("...ij,...ij->...", M, M)


def linear(vector: np.ndarray, table: np.ndarray, *shape: int) -> np.ndarray:
    """vector (..., i) times a constant table (i, j), as matrices (..., *shape) where a shape of j entries is given.

    Many vectors go in blocks, each too small for OpenBLAS to wake its threads, which would cost more than they save.
    """
    if vector.ndim == 1:
        return vector.dot(table).reshape(shape) if shape else vector.dot(table)
    rows = vector.reshape(-1, len(table))
    result, block = np.empty((len(rows), table.shape[1])), 512
    for k in range(0, len(rows), block):
        np.dot(rows[k : k + block], table, out=result[k : k + block])
    return result.reshape(*vector.shape[:-1], *(shape or table.shape[1:]))


@functools.cache
def _lapack():
    from scipy.linalg import get_lapack_funcs  # only when needed: importing the package stays light

    return get_lapack_funcs(("geqrf", "orgqr", "gesv"), dtype=float)


@functools.cache
def _upper(k: int) -> np.ndarray:
    return np.asfortranarray(np.triu(np.ones((k, k))))


def orthogonal(M: np.ndarray, complete: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Q (..., m, k), or (..., m, m) when `complete`, and the upper triangle R (..., k, k) of M = Q[..., :k] R."""
    m, k = M.shape[-2:]
    if M.ndim > 2:
        Q, R = np.linalg.qr(M, mode="complete" if complete else "reduced")
        return Q, R[..., :k, :]
    factor, generate, _ = _lapack()
    packed, scales, _, _ = factor(M)
    R = packed[:k] * _upper(k)
    if complete:
        columns, packed = packed, np.empty((m, m), order="F")
        packed[:, :k] = columns
    return generate(packed, scales, overwrite_a=1)[0], R


def uneven(A: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
    """Q (..., m, m), R (..., k, k) and V of A = Q[..., :k] R V^T for a tall A whose rows differ by powers of ten.

    Householder's reflections keep the digits of the small rows where the large ones come first, and where the first
    column holds what is largest (Powell and Reid, Cox and Higham): rows by size, columns turned to the first of them.
    Rows that differ by less than 30 lose nothing as they are; then V is None, for the identity.
    """
    size = np.abs(A).max(axis=-1)
    if np.all(30.0 * size.min(axis=-1) > size.max(axis=-1)):
        return *orthogonal(A, complete=True), None
    order = np.argsort(-size, axis=-1)[..., None]
    ordered = np.take_along_axis(A, order, axis=-2)
    V, _ = orthogonal(ordered[..., : A.shape[-1], :].mT)
    Q, R = orthogonal(product(ordered, V), complete=True)
    return np.take_along_axis(Q, np.argsort(order, axis=-2), axis=-2), R, V


def solve(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solution of matrix @ X = right for a regular matrix, such as R or R^T of `orthogonal`.

    For one matrix by LAPACK's general solver: its triangular one wakes the threads of OpenBLAS for any size.
    """
    if matrix.ndim == 2 and right.ndim == 2:
        return _lapack()[2](matrix, right)[2]
    return np.linalg.solve(matrix, right)


def many_inverses(A: np.ndarray) -> np.ndarray | None:
    """A (A^T A)^-1 of many matrices (..., m, 2) by their minors; None for others, and where one is nearly singular."""
    if A.ndim < 3 or A.shape[-1] != 2:
        return None
    over, square = by_minors(A)
    if not np.all(square > 1e-12 * (A * A).sum((-2, -1), keepdims=True) ** 2):
        return None
    return over / square


def by_minors(A: np.ndarray) -> tuple[np.ndarray, np.ndarray | float]:
    """X A E and d of A (A^T A)^-1 = X A E / d for A (..., m, 2), with the minors X_ij = a_i x a_j of its rows.

    Their squares over i < j add up to d = det(A^T A), without cancellation: a fifth of the cost of factorizations.
    """
    if A.ndim == 2:
        turned = A.dot(_QUARTER)
        X = A.dot(turned.T)
        return X.dot(turned), float(np.vdot(X, X)) / 2
    turned = np.stack([A[..., 1], -A[..., 0]], axis=-1)
    X = A @ turned.mT
    return X @ turned, (X * X).sum((-2, -1), keepdims=True) / 2


def least_singular_value(R: np.ndarray) -> tuple[float, float]:
    """Smallest singular value of triangles R (..., k, k), and its smallest share of their norms, over all leading axes.

    The pivots |R_ii| alone do not tell: of the columns t u and u, with 1e-16 of rounding, they are t and 1e-16 / t,
    which looks regular for t = 1e-6, and in the other order does not.  Their product is that of the singular values,
    so it bounds the smallest one from below: closely for k <= 2, and well enough for more where it is far from zero.
    """
    k = R.shape[-1]
    others = (k - 1) ** ((k - 1) / 2) if k > 2 else 1  # the product of the others is at most norm^(k - 1) over this
    if R.ndim == 2:
        norm = math.hypot(*R.ravel(order="K").tolist()) or 1e-300
        least = others * math.prod([abs(pivot) / norm for pivot in R.diagonal().tolist()])
        if k < 3 or least > 1e-9:
            return least * norm, least
    norms = np.maximum(np.linalg.norm(R, axis=(-2, -1)), 1e-300)
    share = others * np.abs(np.diagonal(R, axis1=-2, axis2=-1) / norms[..., None]).prod(axis=-1)
    if k > 2 and share.min(initial=np.inf) < 1e-9:
        share = np.linalg.svd(R / np.expand_dims(norms, (-2, -1)), compute_uv=False)[..., -1]
    return float((share * norms).min(initial=np.inf)), float(share.min(initial=np.inf))


def minors(A: np.ndarray) -> np.ndarray:
    """A_j x A_k of the rows of (..., m, 2), for all pairs j < k, (..., m(m - 1)/2)."""
    j, k = pairs(A.shape[-2])
    u, v = A[..., 0], A[..., 1]
    return u.take(j, axis=-1) * v.take(k, axis=-1) - u.take(k, axis=-1) * v.take(j, axis=-1)


@functools.cache
def pairs(m: int) -> tuple[np.ndarray, np.ndarray]:
    """Indices j < k of all pairs of m rows."""
    return np.triu_indices(m, 1)


def singular_values(A: np.ndarray) -> np.ndarray:
    """Singular values (..., k) of (..., m, k), largest first; for k = 2 by Lagrange the minors give their product."""
    if A.shape[-1] != 2:
        return np.linalg.svd(A, compute_uv=False)
    u, v = A[..., 0], A[..., 1]
    X = minors(A)
    uu, vv, uv, area = np.vecdot(u, u), np.vecdot(v, v), np.vecdot(u, v), np.sqrt(np.vecdot(X, X))
    sigma = np.empty((*area.shape, 2))
    sigma[..., 0] = np.sqrt((uu + vv + np.hypot(uu - vv, 2 * uv)) / 2)
    sigma[..., 1] = area / np.maximum(sigma[..., 0], 1e-300)
    return sigma
