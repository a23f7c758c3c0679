"""Names for mistakes of algebra: a factor, a term or a basis that does not belong there, or is missing."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .quantities import entrywise, matrices, quantities
from .seen import Seen, alike, largest, ratio_of


def _argument(seen: Seen, k: int) -> list[np.ndarray]:
    """Argument k of all cases where it always has the shape of the answer, else an empty list."""
    values = seen.argument(k)
    return values if [a.shape for a in values] == [w.shape for w in seen.want] else []


def from_argument(seen: Seen) -> str:
    """An argument itself, or its difference from or sum with the right answer."""
    for k, name in enumerate(seen.names):
        if not (values := _argument(seen, k)):
            continue
        pairs = list(zip(values, seen.want, strict=True))
        tries = [
            (values, f"the answer is {name} itself, unchanged"),
            ([-a for a in values], f"the answer is minus {name} itself"),
            ([a - w for a, w in pairs], f"the answer is the complement: {name} minus the right answer"),
            ([w - a for a, w in pairs], f"the answer differs from the right one by {name}: it is subtracted once more"),
            ([a + w for a, w in pairs], f"the answer differs from the right one by {name}: it is added once more"),
        ]
        for model, words in tries:
            if seen.same(model):
                return words
    if all(w.ndim == 2 and w.shape[0] == w.shape[1] for w in seen.want):
        if seen.same([np.eye(len(w)) - w for w in seen.want]):
            return "the answer is the complement: the identity minus the right answer"
    return ""


def _power(p: float) -> str:
    return {1.0: "", 2.0: " squared", 0.5: " (its root)"}[abs(p)]


def _whole_factor(seen: Seen) -> str:
    """One factor per case that is a power of a quantity among the arguments."""
    ratios = [ratio_of([g], [w]) for g, w, _ in seen]
    if not all(ratios) or not seen.same([k * w for k, w in zip(ratios, seen.want, strict=True)]):
        return ""
    steady = np.ptp(ratios) <= (1e-6 + 2 * seen.slack) * abs(ratios[0])
    for name, values in quantities(seen):
        if abs(values[0] - 1.0) <= 1e-6:
            continue
        for p in (-1.0, 1.0, -2.0, 2.0, -0.5, 0.5):
            rest = np.array(ratios) / np.asarray(values) ** p
            # What does not vary explains a factor, and is explained, only if nothing else is left.
            if (steady or np.ptp(values) < 1e-9 * abs(values[0])) and abs(abs(rest[0]) - 1.0) > 1e-6:
                continue
            if np.ptp(rest) <= (1e-6 + 2 * seen.slack) * abs(rest[0]):
                more = _beside(rest[0], p, 1e-5 + seen.slack)
                # A constant may stand beside a quantity that explains why the factor is not the same in all cases.
                if not more or np.ptp(rest) * abs(ratios[0]) <= 0.1 * np.ptp(ratios) * abs(rest[0]):
                    return f"the factor {name}{_power(p)} {'is missing' if p < 0 else 'is one too many'}{more}"
    return ""


def _beside(constant: float, p: float, slack: float) -> str:
    """Words for the constant that is left beside a quantity to the power p; none for 1."""
    if abs(constant - 1.0) < slack:
        return ""
    fixed = f": as if a fixed {constant ** (-1 / p):.4g} stood for it" if constant > 0 else ""
    return f", beside a factor of {constant:.4g}{fixed}"


def argument_factor(seen: Seen) -> str:
    """A factor per case, or per entry, that is a power of one of the arguments: missing or one too many."""
    if words := _whole_factor(seen):
        return words
    for name, scales in entrywise(seen):
        for p in (-1.0, 1.0, -2.0, 2.0):
            if seen.same([w * s**p for w, s in zip(seen.want, scales, strict=True)]):
                return f"each entry has the factor {name}{_power(p)} {'missing' if p < 0 else 'once too many'}"
    return next((name for name, models in matrices(seen) if seen.same(models)), "")


def constant_factor(seen: Seen) -> str:
    """Any other constant factor."""
    k, single = ratio_of(seen.got, seen.want), len(seen.want) == 1
    if not single and abs(abs(k) - 1.0) > 2 * seen.slack and k != 0.0 and seen.same([k * w for w in seen.want]):
        sign = ", and the sign is opposite" * (k < 0)
        return f"the answer is {abs(k):.4g} times the right one in every case: a constant factor{sign}"
    ratios = [ratio_of([g], [w]) for g, w, _ in seen]
    somewhere_right = any(abs(r - 1.0) <= seen.slack for r in ratios)
    vectors = any(w.size > 1 for w in seen.want) and not somewhere_right
    if vectors and seen.same([k * w for k, w in zip(ratios, seen.want, strict=True)]):
        turned = "" if min(ratios) >= 0 else f", but for its sign{' in some cases' * (max(ratios) > 0)},"
        size = "the size is not: one factor is missing, or is not the one of this case"
        return f"the direction is right{turned} and {size}"
    return ""


def function_of(seen: Seen) -> str:
    """The square, the root, the reciprocal or the inverse of the right answer."""
    tries: list[tuple[Callable, str]] = [
        (np.square, "the answer is the square of the right one: a root is missing"),
        (lambda w: np.sqrt(np.abs(w)), "the answer is the root of the right one: a square is missing"),
        (lambda w: 1 / w, "the answer is the reciprocal of the right one: numerator and denominator are exchanged"),
    ]
    if all(w.ndim == 2 for w in seen.want):
        tries.append((np.linalg.pinv, "the answer is the inverse (or pseudoinverse) of the right matrix"))
        tries.append((lambda w: np.linalg.pinv(w).T, "the answer is the transposed inverse of the right matrix"))
    for change, words in tries:
        try:
            if seen.same([change(w) for w in seen.want]):
                return words
        except np.linalg.LinAlgError:
            continue
    return ""


def combination(seen: Seen) -> str:
    """A sum of the right answer and arguments of its shape, with whole or half coefficients."""
    columns = {"the right answer": seen.want}
    columns |= {name: values for k, name in enumerate(seen.names) if (values := _argument(seen, k))}
    M = np.array([np.concatenate([np.ravel(v) for v in side]) for side in columns.values()]).T
    if M.shape[1] < 2 or M.shape[0] < 3 * M.shape[1]:
        return ""
    factors = np.linalg.lstsq(M, np.concatenate([g.ravel() for g in seen.got]), rcond=None)[0]
    factors = np.round(2 * factors) / 2
    parts = [sum(f * v[i] for f, v in zip(factors, columns.values(), strict=True)) for i in range(len(seen.want))]
    if not seen.same([np.asarray(part) for part in parts]):
        return ""
    terms = [f"{'-' if f < 0 else '+'} {abs(f):g} times {name}" for f, name in zip(factors, columns, strict=True) if f]
    return f"the answer is {' '.join(terms)}: something is added or subtracted in the wrong place, or left out"


def mixture(seen: Seen) -> str:
    """A constant matrix times the right answer: another basis, or some rows scaled."""
    shapes = {w.shape for w in seen.want}
    if len(shapes) > 1 or len(shape := shapes.pop()) not in (1, 2) or shape[0] < 2:
        return ""
    got, want = (np.concatenate([v.reshape(shape[0], -1) for v in side], axis=1) for side in (seen.got, seen.want))
    if want.shape[1] < 2 * shape[0] or np.linalg.matrix_rank(want, 1e-6 * np.abs(want).max()) < shape[0]:
        return ""
    M = got @ np.linalg.pinv(want)
    if np.abs(M - np.eye(len(M))).max() <= 5 * seen.slack or _harms(M, seen):
        return ""
    return _mixed(M, "row" if len(shape) == 2 else "entry") if alike(M @ want, got, seen.slack) else ""


def _harms(M: np.ndarray, seen: Seen) -> bool:
    """Does the matrix M change the right answer in a case where the given one is right?"""
    fine = [w for g, w, _ in seen if largest(g - w) <= 1e-9 * largest(w)]
    return any(largest(M @ w - w) > 1e-4 * largest(w) for w in fine)


def _mixed(M: np.ndarray, part: str) -> str:
    """Words for what the matrix M does to the rows or entries of the right answer."""
    if not np.any(np.abs(M - np.diag(np.diag(M))) > 1e-4):
        off = {i: f for i, f in enumerate(np.diag(M)) if abs(f - 1.0) > 1e-4}
        if not np.any(np.abs(list(off.values())) > 1e-4):
            return f"{part} {', '.join(map(str, off))} (counted from 0) is zero"
        rows = ", ".join(f"{i} ({f:.4g})" for i, f in off.items())
        return f"a constant factor is wrong in {part} {rows}, counted from 0"
    one, zero = np.abs(np.abs(M) - 1) < 1e-4, np.abs(M) < 1e-4
    if np.all(one.sum(axis=1) == 1) and np.all(zero.sum(axis=1) == len(M) - 1):
        if np.any(one.sum(axis=0) > 1):
            twice = np.flatnonzero(one.sum(axis=0) > 1)[0]
            return f"the right {part} {twice} (counted from 0) stands in more than one place"
        return "the entries stand in another order, some with the opposite sign"
    return "the entries are a fixed mixture of the right ones: they are given in another basis or frame"


def shifted(seen: Seen) -> str:
    """The right answer plus a constant."""
    gaps = np.concatenate([(g - w).ravel() for g, w, _ in seen])
    scale = max(map(largest, seen.want))
    if len(gaps) > 1 and np.ptp(gaps) <= min(seen.slack * max(scale, abs(gaps[0])), 0.02 * abs(gaps[0])):
        return f"the answer is off by a constant, {gaps[0]:.4g}, in every entry and case"
    return ""
