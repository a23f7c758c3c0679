"""The explicit pseudoinverse (27) from a partition of the redundant control matrix, and the rules that choose it."""

from __future__ import annotations

import itertools

import numpy as np

from ..machine.arguments import (
    joint_indices,
    one_of,
    transpose,
    wide_matrix,
)
from .actuation import full_rank_qr, singular_values


def explicit_pseudoinverse(A_tilde, rows) -> np.ndarray:
    """(A~^T)^+ of (27), (..., m, n), from the partition (26) of A~ into the rows A~_1 and the others, A~_2 = B A~_1:

    (A~^T)^+ = [I; B] (I + B^T B)^-1 (A~_1^T)^+, the same for every partition with regular A~_1.
    A_tilde : (..., m, n).  rows : the delta = 2 row indices of A~_1, a pair or (..., 2).
    Raises ValueError where A~_1 has lost rank.
    """
    A_tilde = wide_matrix("A_tilde", A_tilde)
    rows = _row_choice(rows, A_tilde)
    A1 = np.take_along_axis(A_tilde, rows[..., None], axis=-2)
    Q, R = full_rank_qr("A~_1 of this partition", transpose(A1))
    A1T_pinv = np.linalg.solve(R, transpose(Q))
    B_all = A_tilde @ transpose(A1T_pinv)  # the identity in `rows`, B in the others
    return B_all @ np.linalg.solve(transpose(B_all) @ B_all, A1T_pinv)


def _row_choice(rows, A_tilde: np.ndarray) -> np.ndarray:
    m, lead = A_tilde.shape[-2], A_tilde.shape[:-2]
    if np.ndim(rows) < 2:
        return np.broadcast_to(joint_indices("rows", rows, m), (*lead, 2))
    rows = np.asarray(rows)
    if rows.dtype.kind not in "iu" or rows.shape != (*lead, 2):
        raise ValueError(f"rows is an array {rows.shape} of {rows.dtype}; allowed: a pair of indices or {(*lead, 2)}")
    bad = np.any((rows < 0) | (rows >= m), axis=-1) | (rows[..., 0] == rows[..., 1])
    if np.any(bad):
        raise ValueError(f"rows holds the pair {rows[bad][0].tolist()}; allowed: two different ones from 0 to {m - 1}")
    return rows


def _inverse_condition(A: np.ndarray) -> np.ndarray:
    sigma = singular_values(A)
    return sigma[..., 1] / np.maximum(sigma[..., 0], 1e-300)


PARTITION_RULES = {
    "sigma_min": lambda A1: singular_values(transpose(A1))[..., 1],
    "condition": lambda A1: _inverse_condition(transpose(A1)),
    "printed": lambda A1: -np.abs(A1).sum(axis=-1).max(axis=-1),
}


def select_independent(A_tilde, rule: str = "sigma_min") -> np.ndarray:
    """Rows (..., 2) of A~ (..., m, n) that make the best A~_1 for (27).

    rule : "sigma_min" takes the largest smallest singular value, "condition" the smallest condition number; "printed"
    is the chapter's smallest row-sum norm, for study only: it is the wrong way round.
    """
    A_tilde = wide_matrix("A_tilde", A_tilde)
    one_of("rule", rule, PARTITION_RULES)
    pairs = np.array(list(itertools.combinations(range(A_tilde.shape[-2]), 2)))
    merit = np.stack([PARTITION_RULES[rule](A_tilde[..., pair, :]) for pair in pairs], axis=-1)
    return pairs[np.argmax(merit, axis=-1)]
