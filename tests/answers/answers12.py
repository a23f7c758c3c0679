"""Answers to the exercises of lesson 12, as students would give them."""

import numpy as np
from scipy.linalg import null_space

import rapkm_lite as rk
from rapkm_lite.lessons.lesson12 import tasks


def by_null_space(J, m, K_P, offset):
    """All motions, their driven part, and what is normal to it."""
    n = null_space(null_space(J)[:m].T)
    return -K_P * n @ (n.T @ offset)


def by_singular_vectors(J, m, K_P, offset):
    U, sigma, _ = np.linalg.svd(rk.projector(J)[:m])
    n = U[:, J.shape[1] - J.shape[0] :]
    return list(-K_P * (n @ n.T @ offset))


def with_cut_off(J, m, K_P, offset):
    A = rk.projector(J)[:m]
    return -K_P * (offset - np.linalg.pinv(A.T, rcond=1e-9) @ (A.T @ offset))


def least_squares(J, m, K_P, offset):
    T = null_space(J)[:m]
    return -K_P * (offset - T @ np.linalg.lstsq(T, offset, rcond=None)[0])


def pinv_tosses(J, m, K_P, offset):
    """A projector of one's own, and a cut-off of the size of its rounding."""
    A = (np.eye(J.shape[1]) - J.T @ np.linalg.solve(J @ J.T, J))[:m]
    return -K_P * (offset - np.linalg.pinv(A.T) @ (A.T @ offset))


def rounding_decides(J, m, K_P, offset):
    """An error of 1e-12 at every other pose, which the default cut-off takes for a fourth direction."""
    U, sigma, V = np.linalg.svd(rk.projector(J)[:m], full_matrices=False)
    sigma[J.shape[1] - J.shape[0] :] = 1e-12 * (offset[0] > 0)
    A = U * sigma @ V
    return -K_P * (offset - np.linalg.pinv(A.T) @ (A.T @ offset))


def three_rows(J, m, K_P, offset):
    A = rk.projector(J)[:m]
    return -K_P * (np.eye(m) - rk.explicit_pseudoinverse(A, (0, 1, 2)) @ A.T) @ offset


def scaled(factor):
    return lambda J, m, K_P, offset: factor * tasks.fight(J, m, K_P, offset)


def units(J, scale):
    S = np.diag(scale)
    return np.linalg.inv(S) @ rk.projector(J @ np.linalg.inv(S)) @ S


def units_by_basis(J, scale):
    T = null_space(J / scale)
    return (T @ T.T) * scale / scale[:, None]


def weighted(J, scale):
    """The projector that is orthogonal for the weights of the other units."""
    W = 1 / scale**2
    return np.eye(len(scale)) - (W[:, None] * J.T) @ np.linalg.solve(J * W @ J.T, J)


def machine(radius=0.29, lengths=(0.18, 0.26), mode=(1, 1, -1), turn=0.0):
    angle = np.radians(np.array([210.0, 330.0, 90.0]) + turn)
    base = radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    return lambda: rk.Manipulator(base=base, lengths=lengths, masses=0.1, mode=mode)


ANSWERS = {
    "12.fight": [
        ("right", "reference", tasks.fight),
        ("right", "null spaces", by_null_space),
        ("right", "singular vectors, a list", by_singular_vectors),
        ("right", "pinv with a cut-off", with_cut_off),
        ("right", "least squares", least_squares),
        ("wrong", "three rows always", three_rows, ""),
        ("wrong", "numpy's pinv of an own projector", pinv_tosses, ""),
        ("wrong", "rounding decides", rounding_decides, "rounding decides a rank"),
        ("wrong", "sign", scaled(-1), "sign"),
        ("wrong", "mN m", scaled(1e3), "1000"),
        ("wrong", "half", scaled(0.5), "factor"),
        ("wrong", "unprojected", lambda J, m, K, off: -K * off, "projected"),
        ("wrong", "the part that moves", lambda J, m, K, off: -K * off - tasks.fight(J, m, K, off), "part that moves"),
        ("wrong", "no gain", lambda J, m, K, off: tasks.fight(J, m, 1.0, off), "K_P"),
        ("wrong", "I - N_J", lambda J, m, K, off: -K * (np.eye(m) - rk.projector(J)[:m, :m]) @ off, "A~^T"),
        ("wrong", "N_J", lambda J, m, K, off: -K * rk.projector(J)[:m, :m] @ off, "block"),
        ("wrong", "all joints", lambda J, m, K, off: np.zeros(J.shape[1]), ""),
        ("wrong", "zero", lambda J, m, K, off: np.zeros(m), "zero"),
    ],
    "12.other_units": [
        ("right", "reference", tasks.in_units),
        ("right", "with a diagonal matrix", units),
        ("right", "by a basis", units_by_basis),
        ("right", "as weights", weighted),
        ("wrong", "own units", lambda J, scale: rk.projector(J), "scale"),
        ("wrong", "not carried back", lambda J, scale: rk.projector(J / scale), "come back"),
        ("wrong", "inverse scale", lambda J, scale: tasks.in_units(J, 1 / scale), "columns of J shrink"),
        ("wrong", "J S alone", lambda J, scale: rk.projector(J * scale), "not J S, and"),
        ("wrong", "order", lambda J, scale: rk.projector(J / scale) / scale * scale[:, None], "order"),
        ("wrong", "same J", lambda J, scale: rk.projector(J) * scale / scale[:, None], "J was not changed"),
        ("wrong", "right side only", lambda J, scale: rk.projector(J / scale) * scale, "left"),
        ("wrong", "left side only", lambda J, scale: rk.projector(J / scale) / scale[:, None], "right"),
        ("wrong", "transposed", lambda J, scale: tasks.in_units(J, scale).T, ""),
        ("wrong", "identity", lambda J, scale: np.eye(len(scale)), ""),
        ("wrong", "zero", lambda J, scale: np.zeros((len(scale), len(scale))), "zero"),
    ],
    "12.own_machine": [
        ("right", "reference", tasks.own_machine),
        ("right", "as wide as allowed", machine(0.3)),
        ("right", "equal links", machine(0.299, (0.2, 0.2))),
        ("close", "a little too wide", machine(0.31, (0.2, 0.28))),
        ("wrong", "the testbed", rk.load, "bent"),
        ("wrong", "bent alike, wide", machine(0.29, mode=(1, 1, 1)), "bent"),
        ("wrong", "the wrong arm", machine(0.29, mode=(1, -1, 1)), "cost of the offsets"),
        ("wrong", "singular on the way", machine(0.2, (0.2, 0.2)), "torque"),
        ("wrong", "lost on its way", machine(0.2, (0.25, 0.25)), "lost"),
        ("wrong", "does not reach", machine(0.29, (0.1, 0.1)), ""),
        ("wrong", "too wide", machine(0.4, (0.26, 0.34)), "farthest drive"),
        ("wrong", "four arms", lambda: rk.load("four_arms"), "3"),
        ("wrong", "a number", lambda: 3.0, "Manipulator"),
        ("wrong", "a value", rk.load(), "function"),
    ],
}
