"""Answers to the exercises of lesson 09, as students would give them."""

import numpy as np
from scipy.optimize import linprog, minimize

import rapkm_lite as rk
from rapkm_lite.lessons.lesson09 import tasks


def drive_by_drive(c, n, limit):
    low, high = -np.inf, np.inf
    for c_i, n_i, top in zip(c, n, limit, strict=True):
        a, b = sorted([(-top - c_i) / n_i, (top - c_i) / n_i])
        low, high = max(low, a), min(high, b)
    return low, high


def with_absolute_values(c, n, limit):
    middle, half = -c / n, limit / np.abs(n)
    return [(middle - half).max(), (middle + half).min()]


def by_samples(c, n, limit):
    low, high = drive_by_drive(c, n, limit)
    step = 1e-4
    return np.array([np.ceil(low / step) * step, np.floor(high / step) * step])


def clipped(A, f, least=0.0):
    return np.maximum(tasks.smallest(A, f), least)


def least_squares(A, f, least):
    made = {"type": "eq", "fun": lambda c: A.T @ c - f}
    start, bounds = clipped(A, f, least), [(least, None)] * len(A)
    return minimize(
        lambda c: c @ c, start, bounds=bounds, constraints=[made], method="SLSQP", options={"ftol": 1e-15}
    ).x


def along_n(A, f, least):
    c, n = tasks.smallest(A, f), rk.null_basis(A)[:, 0]
    return c + max((least - c) / n) * n


def lifting_the_weakest(A, f, least):
    c, n = tasks.smallest(A, f), rk.null_basis(A)[:, 0]
    return c + (least - c.min()) / n[c.argmin()] * n


def general_solver(A, f, least):
    start = np.abs(tasks.smallest(A, f)) + least
    demand = {"type": "eq", "fun": lambda c: A.T @ c - f}
    return minimize(np.sum, start, constraints=demand, bounds=[(least, None)] * len(A), options={"ftol": 1e-12}).x


def box(A, f, least):
    return rk.allocate_torques(A, f, 1.0, prestress=np.full(len(A), 0.2))


def constant(mu):
    return lambda A, f: tasks.smallest(A, f) + mu * rk.null_basis(A)[:, 0]


def both_ends(A, f):
    return linprog([1, 1, 1], A_eq=A.T, b_eq=f, bounds=[(4.5e-3, 85e-3)] * 3).x


def all_negative(A, f):
    return -tasks.one_sign(A, -f, 5e-3)


def in_the_middle(A, f):
    c, n = tasks.smallest(A, f), rk.null_basis(A)[:, 0]
    return c + np.mean([np.max((5e-3 - c) / n), np.min((85e-3 - c) / n)]) * n


def little(least):
    return lambda A, f: tasks.one_sign(A, f, least)


ANSWERS = {
    "09.room": [
        ("wrong", "n turned round", lambda c, n, limit: tasks.room(c, -n, limit), "the sign of mu"),
        ("right", "reference", tasks.room),
        ("right", "drive by drive, a tuple", drive_by_drive),
        ("right", "middle and half, a list", with_absolute_values),
        ("close", "steps of a tenth of a mN m", by_samples),
        ("wrong", "n taken as positive", lambda c, n, m: np.array([((-m - c) / n).max(), ((m - c) / n).min()]), "sign"),
        (
            "wrong",
            "over the size of n",
            lambda c, n, m: np.array([((-m - c) / abs(n)).max(), ((m - c) / abs(n)).min()]),
            "absolute value",
        ),
        ("wrong", "any drive", lambda c, n, m: np.array([tasks.ends(c, n, m).min(), tasks.ends(c, n, m).max()]), "any"),
        ("wrong", "sorted", lambda c, n, m: np.sort(tasks.room(c, n, m)), "nothing fits"),
        ("wrong", "reversed", lambda c, n, m: tasks.room(c, n, m)[::-1], "order"),
        ("wrong", "symmetric", lambda c, n, m: ((m - abs(c)) / abs(n)).min() * np.array([-1, 1]), "symmetric"),
        ("wrong", "no c", lambda c, n, m: (m / abs(n)).min() * np.array([-1, 1]), "missing"),
        ("wrong", "c - mu n", lambda c, n, m: tasks.room(c, -n, m), "sign"),
        ("wrong", "one limit", lambda c, n, m: tasks.room(c, n, m.min() * np.ones(3)), "drive to drive"),
        ("wrong", "mN m", lambda c, n, m: 1e3 * tasks.room(c, n, m), "1000"),
        ("wrong", "only the upper end", lambda c, n, m: tasks.room(c, n, m)[1], "shape"),
        ("wrong", "the torques at the ends", lambda c, n, m: c + tasks.room(c, n, m)[:, None] * n, ""),
    ],
    "09.one_sign": [
        ("close", "the smallest sum of squares", least_squares),
        ("right", "reference", tasks.one_sign),
        ("right", "another solver", lambda A, f, least: linprog(
            [1] * len(A), A_eq=A.T, b_eq=f, bounds=[(least, 10)] * len(A), method="highs-ipm").x),
        ("right", "a general solver", general_solver),
        ("close", "along one null vector", along_n),
        ("wrong", "least size", lambda A, f, least: tasks.smallest(A, f), "least size"),
        ("wrong", "clipped", clipped, "clipped"),
        ("wrong", "absolute values", lambda A, f, least: abs(tasks.smallest(A, f)), "absolute"),
        ("wrong", "default bounds", lambda A, f, least: linprog(np.ones(len(A)), A_eq=A.T, b_eq=f).x, "least"),
        ("wrong", "all negative", lambda A, f, least: -tasks.one_sign(A, -f, least), "sign"),
        ("wrong", "opposite force", lambda A, f, least: tasks.one_sign(A, -f, least), "sign"),
        ("wrong", "no force", lambda A, f, least: tasks.one_sign(A, 0 * f, least), "force"),
        ("wrong", "only the weakest drive lifted to the least", lifting_the_weakest, ""),
        ("wrong", "least on top", lambda A, f, least: tasks.smallest(A, f) + least, "added to every drive"),
        ("wrong", "far too much", box, ""),
        ("wrong", "all equal", lambda A, f, least: np.full(len(A), least), ""),
        ("wrong", "mN m", lambda A, f, least: 1e3 * tasks.one_sign(A, f, least), "1000"),
        ("wrong", "the sum", lambda A, f, least: tasks.one_sign(A, f, least).sum(), "shape"),
        ("wrong", "least peak", lambda A, f, least: rk.minimax_torques(A, f), ""),
    ],
    "09.quiet_gears": [
        ("right", "the least prestress that does it", tasks.quiet_gears),
        ("right", "a constant negative one", lambda A, f: tasks.smallest(A, f) - 0.05 * rk.null_basis(A)[:, 0]),
        ("right", "linear programme between both limits", both_ends),
        ("right", "all negative, as a list", lambda A, f: list(all_negative(A, f))),
        ("close", "a shade too little", little(3.9e-3)),
        ("wrong", "least size", tasks.smallest, "no prestress"),
        ("wrong", "within limits only", lambda A, f: rk.allocate_torques(A, f, 85e-3), "no prestress"),
        ("wrong", "constant prestress", constant(0.095), "of this sign"),
        ("wrong", "a constant one, too small", constant(0.03), "smallest torque"),
        ("wrong", "too little", little(1e-3), "smallest"),
        ("wrong", "down to zero", little(0.0), "changes its sign) 0 mN m"),
        ("wrong", "too hot", in_the_middle, "heat"),
        ("wrong", "clipped from below", lambda A, f: clipped(A, f, 5e-3), "force"),
        ("wrong", "no force at all", lambda A, f: np.full(3, 5e-3), "force"),
        ("wrong", "two numbers", lambda A, f: f, "shape"),
        ("wrong", "a value", np.full(3, 0.02), ""),
    ],
}  # fmt: skip
