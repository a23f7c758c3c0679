"""Answers to the exercises of lesson NN, as students would give them: verdict, what it is, answer, word it is told."""

import numpy as np


def worst(A):
    return np.sqrt((A**2).sum(axis=1))


ANSWERS = {
    "NN.driven_rates": [
        ("right", "matrix times velocity", lambda A, xd: np.einsum("ij,j->i", A, xd)),
        ("wrong", "transposed", lambda A, xd: A.T[:, :2] @ xd, "transposed"),
        ("wrong", "sign", lambda A, xd: -A @ xd, "sign"),
        ("wrong", "factor two", lambda A, xd: 2 * A @ xd, "2"),
        ("wrong", "one rate", lambda A, xd: (A @ xd)[:1], "shape"),
    ],
    "NN.turning": [
        ("right", "roots of squares", worst),
        ("wrong", "sum of sizes", lambda A: np.abs(A).sum(axis=1), "sum of the sizes"),
        ("wrong", "x and y only", lambda A: np.abs(A).max(axis=1), "along x and y"),
        ("wrong", "squared", lambda A: (A**2).sum(axis=1), ""),
        ("wrong", "negative", lambda A: -worst(A), "sign"),
    ],
    "NN.safe_speed": [
        ("right", "worst drive", lambda A, limit: limit / worst(A).max()),
        ("wrong", "mean drive", lambda A, limit: limit / worst(A).mean(), "fastest drive"),
        ("wrong", "best drive", lambda A, limit: limit / worst(A).min(), "fastest drive"),
        ("wrong", "too slow", lambda A, limit: 0.5 * limit / worst(A).max(), "slowest"),
        ("wrong", "no limit", lambda A, limit: 1.0, "drive"),
    ],
}
