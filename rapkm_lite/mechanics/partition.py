"""The explicit pseudoinverse (27) from a partition (26) of the redundant control matrix, and rules that choose it."""

from __future__ import annotations

import functools
import itertools

import numpy as np

from ..machine.arguments import joint_indices, listed, one_of, real_array, whole_number, wide_matrix
from ..machine.values import frozen
from . import cores
from .linalg import product, singular_values, squares


def explicit_pseudoinverse(A_tilde, rows) -> np.ndarray:
    """(A~^T)^+ of (27), (..., m, n), from the partition (26) of A~ into the delta rows A~_1 and the others, A~_2:

    top    = (A~_1^T)^+ (I_n - A~_2^T (I_{m-delta} + B^T B)^-1 B^T (A~_1^T)^+)
    bottom = (I_{m-delta} + B^T B)^-1 B^T (A~_1^T)^+,   B = (A~_1^T)^+ A~_2^T, (delta, m - delta), so A~_2 = B^T A~_1.
    Its point: the only new inverse is (m - delta) x (m - delta), a number for three drives.  Every partition with
    regular A~_1 gives the same result.
    A_tilde : (..., m, n).  rows : the delta row indices of A~_1, (delta,) or (..., delta), with delta the rank of A~,
    which is 2 for every `Manipulator`.  Raises ValueError where A~_1 has lost rank, or fewer rows than the rank of A~.

    >>> import numpy as np, rapkm_lite as rk; robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> A = rk.redundant_control_matrix(robot, q)
    >>> np.allclose(rk.explicit_pseudoinverse(A, (0, 1)), np.linalg.pinv(A.T))
    True
    """
    A_tilde = wide_matrix("A_tilde", A_tilde)
    first, others, back = _partition(rows, A_tilde)
    A1, A2 = _rows(A_tilde, first), _rows(A_tilde, others)
    where = "an input singularity, or dependent rows; allowed: the full degree of actuation, rows by select_independent"
    A1T_pinv = cores.right_inverse("A~_1, the chosen rows of A_tilde,", A1.mT, where).mT
    B = product(A1T_pinv, A2.mT)
    # Do they make the others, to 1e-6?  Each matrix by itself; near an input singularity to the rounding of B.
    left, size = squares(product(B.mT, A1) - A2), squares(A_tilde)
    short = left > 1e-12 * size
    if short is not False and np.any(short & (left > 1e-28 * size**2 * squares(A1T_pinv))):
        raise ValueError(f"rows holds {first.shape[-1]} of the rows, below the rank of A_tilde; allowed: delta of them")
    small, right = product(B.mT, B), product(B.mT, A1T_pinv)
    bottom = right / (1.0 + small) if small.shape[-1] == 1 else np.linalg.solve(np.eye(small.shape[-1]) + small, right)
    top = A1T_pinv - product(B, bottom)  # the first factor multiplied out
    return _rows(np.concatenate([top, bottom], axis=-2), back)


def _rows(matrix: np.ndarray, index: np.ndarray) -> np.ndarray:
    if index.ndim == 1:
        return matrix.take(index, axis=-2)
    return np.take_along_axis(matrix, index[..., None], axis=-2)


def _partition(rows, A_tilde: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Row indices of A~_1, (delta,) or (..., delta), of A~_2, and where each row of A~ stands in these."""
    m, lead = A_tilde.shape[-2], A_tilde.shape[:-2]
    if not isinstance(rows, np.ndarray) or rows.ndim < 2:
        rows = listed(rows)
        count = len(rows) if isinstance(rows, list | tuple) and 1 <= len(rows) <= m else 2
        return _fixed_partition(joint_indices("rows", rows, m, count, "row"), m)
    numbers = real_array("rows", rows)
    batch = f" or ({', '.join(map(str, lead))}, delta)" if lead else ""
    if np.any(numbers % 1.0) or rows.shape[:-1] != lead or not 1 <= rows.shape[-1] <= m:
        raise ValueError(f"rows is an array {rows.shape} of {rows.dtype}; allowed: indices (delta,){batch}")
    bad = np.any((numbers < 0) | (numbers >= m) | (np.diff(np.sort(numbers), prepend=-1) == 0), axis=-1)
    if np.any(bad):
        raise ValueError(f"rows holds {rows[bad][0].tolist()}; allowed: different indices from 0 to {m - 1}")
    rows = numbers.astype(int)
    taken = (np.arange(m) == rows[..., None]).any(axis=-2)
    others = np.argsort(taken, axis=-1, kind="stable")[..., : m - rows.shape[-1]]
    return rows, others, np.argsort(np.concatenate([rows, others], axis=-1), axis=-1)


@functools.cache
def _fixed_partition(first: tuple[int, ...], m: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    others = [i for i in range(m) if i not in first]
    return frozen(first), frozen(np.array(others, dtype=int)), frozen(np.argsort([*first, *others]))


def _inverse_condition(A1: np.ndarray) -> np.ndarray:
    sigma = singular_values(A1.mT)
    return sigma[..., -1] / np.maximum(sigma[..., 0], 1e-300)


PARTITION_RULES = {
    "sigma_min": lambda A1: singular_values(A1.mT)[..., -1],
    "condition": _inverse_condition,
    "printed": lambda A1: -np.abs(A1).sum(axis=-1).max(axis=-1),
}


def first_best(merit: np.ndarray) -> np.ndarray:
    """Index (...,) of the largest merit (..., choices), of equal ones the first: rounding must not choose at symmetric
    poses, so 1e-9 of it counts as equal, as for `SwitchedCTC`."""
    if merit.ndim == 1:  # of one matrix: NumPy's calls would cost more than the comparison
        values = merit.tolist()
        most = max(values)
        return np.array(next(i for i, value in enumerate(values) if value >= most - 1e-9 * abs(most)))
    most = merit.max(axis=-1, keepdims=True)
    return np.argmax(merit >= most - 1e-9 * np.abs(most), axis=-1)


@functools.cache
def _choices(m: int, delta: int) -> np.ndarray:
    return frozen(list(itertools.combinations(range(m), delta)))


def select_independent(A_tilde, rule: str = "sigma_min", delta: int = 2) -> np.ndarray:
    """Rows (..., delta) of A~ (..., m, n) that make the best A~_1 in the partition (26), for (27).

    rule : "sigma_min" takes the largest smallest singular value, "condition" the smallest condition number; "printed"
    is the smallest row-sum norm of section 4.5, for study only: it is the wrong way round.
    Of choices that are equal to 1e-9, as at symmetric poses, the first one.
    delta : how many, the rank of A~; 2 for the machines of `Manipulator`.
    Raises ValueError for another rule, and for more rows than there are.

    >>> import rapkm_lite as rk; robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> rk.select_independent(rk.redundant_control_matrix(robot, q))
    array([0, 2])
    """
    A_tilde = wide_matrix("A_tilde", A_tilde)
    one_of("rule", rule, PARTITION_RULES)
    m, delta = A_tilde.shape[-2], whole_number("delta", delta, 1)
    if delta > m:
        raise ValueError(f"delta = {delta}; allowed: at most the {m} rows of A_tilde")
    choices = _choices(m, delta)
    best = first_best(PARTITION_RULES[rule](A_tilde.take(choices, axis=-2)))
    return choices.take(best, axis=0)  # a copy, also for one matrix
