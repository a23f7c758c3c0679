"""Answers to the exercises of lesson 07, as students would give them."""

import numpy as np

import rapkm_lite as rk
from rapkm_lite.lessons.lesson07 import tasks


def best(robot, q_a, guess):
    return rk.estimate_pose(robot, q_a, guess)[:, : robot.n_arms]


def along_the_null_basis(robot, q_a, guess):
    q = rk.estimate_pose(robot, q_a, guess)
    n = rk.null_basis(rk.control_matrix(robot, q))
    nu = np.einsum("kij,ki->kj", n, q_a - q[:, : robot.n_arms])
    return np.sqrt((nu**2).sum(axis=1))


def row_by_row(robot, q_a, guess):
    return [float(np.linalg.norm(a - best(robot, a[None], g[None])[0])) for a, g in zip(q_a, guess, strict=True)]


def in_place(robot, q_a, guess):
    q_a -= best(robot, q_a, guess)
    q_a **= 2
    return q_a.sum(axis=1) ** 0.5


def with_the_guess(robot, q_a, guess):
    q = rk.inverse_kinematics(robot, guess)
    n = rk.null_basis(rk.control_matrix(robot, q))
    return np.linalg.norm(np.einsum("kij,ki->kj", n, q_a - q[:, : robot.n_arms]), axis=1)


def null_vector_of_three(robot, q_a, guess):
    q = rk.estimate_pose(robot, q_a, guess)
    return np.abs(np.sum(rk.null_vector(robot, q) * (q_a - q[:, :3]), axis=1))


def pinv_projector(A, xd, delay, K_P):
    return -K_P * (np.eye(len(A)) - A @ np.linalg.pinv(A)) @ np.diag(delay) @ A @ xd


def at_rest(A, xd, delay, K_P):
    return rk.steady_state_torque(A, K_P, (A @ xd) * delay)


def spare(A, xd, delay, K_P):
    c = -K_P * (A @ xd) * delay
    return c - A @ np.linalg.lstsq(A, c, rcond=None)[0]


def by_the_cross_product(A, xd, delay, K_P):
    eta = np.cross(A[:, 0], A[:, 1])
    return -K_P * eta * (eta @ (delay * (A @ xd))) / (eta @ eta)


def scaled(factor):
    return lambda A, xd, delay, K_P: factor * tasks.delay_torque(A, xd, delay, K_P)


def fixed(shares):
    return lambda part, demand: shares


def by_the_integral(part, demand):
    reach = np.concatenate([[0], np.cumsum((demand[1:] ** 0.5 + demand[:-1] ** 0.5) / 2)])
    return [float(np.interp(k * reach[-1] / 10, reach, part)) for k in range(1, 10)]


def as_the_demand(part, demand):
    reach = np.cumsum(demand)
    return np.interp(np.linspace(reach[0], reach[-1], 11)[1:-1], reach, part)


EXAMPLE = tasks.via_points(*tasks.edge_demand())

ANSWERS = {
    "07.contradiction": [
        ("right", "reference", tasks.contradiction),
        ("right", "along the null basis", along_the_null_basis),
        ("right", "row by row, a list", row_by_row),
        ("right", "in place", in_place),
        ("wrong", "null space at the guess, first order", with_the_guess, "at the guess"),
        ("close", "only three drives", null_vector_of_three),
        ("wrong", "squares", lambda r, q, g: ((q - best(r, q, g)) ** 2).sum(axis=1), "root"),
        ("wrong", "largest entry", lambda r, q, g: np.abs(q - best(r, q, g)).max(axis=1), "largest"),
        ("wrong", "mean size", lambda r, q, g: np.abs(q - best(r, q, g)).mean(axis=1), "averaged"),
        ("wrong", "sum", lambda r, q, g: np.abs(q - best(r, q, g)).sum(axis=1), "added"),
        ("wrong", "entries added", lambda r, q, g: np.abs((q - best(r, q, g)).sum(axis=1)), "the entries or"),
        ("wrong", "root mean square", lambda r, q, g: np.sqrt(((q - best(r, q, g)) ** 2).mean(axis=1)), "mean"),
        ("wrong", "always (1, 1, 1)", lambda r, q, g: 3**0.5 * np.abs((q - best(r, q, g)).mean(axis=1)), "centroid"),
        ("wrong", "all entries", lambda r, q, g: q - best(r, q, g), "size"),
        ("wrong", "no axis", lambda r, q, g: np.full(len(q), np.linalg.norm(q - best(r, q, g))), "rows"),
        ("wrong", "minus", lambda r, q, g: -tasks.contradiction(r, q, g), "sign"),
        ("wrong", "mrad", lambda r, q, g: 1e3 * tasks.contradiction(r, q, g), "1000"),
        ("wrong", "degrees", lambda r, q, g: np.degrees(tasks.contradiction(r, q, g)), "180"),
        (
            "wrong",
            "guess",
            lambda r, q, g: np.linalg.norm(q - rk.inverse_kinematics(r, g)[:, : r.n_arms], axis=1),
            "guess",
        ),
        ("wrong", "nothing", lambda r, q, g: np.zeros(len(q)), "zero"),
        ("wrong", "always the testbed", lambda r, q, g: tasks.contradiction(rk.load(), q, g), "three different arms"),
    ],
    "07.delay_torque": [
        ("right", "reference", tasks.delay_torque),
        ("right", "I - A pinv(A)", pinv_projector),
        ("right", "steady state with an offset", at_rest),
        ("right", "what least squares leaves", spare),
        ("right", "a list", lambda A, xd, d, K: list(tasks.delay_torque(A, xd, d, K))),
        ("close", "three drives only", by_the_cross_product),
        ("wrong", "sign", scaled(-1), "sign"),
        ("wrong", "half", scaled(0.5), "factor"),
        ("wrong", "mN m", scaled(1e3), "1000"),
        ("wrong", "ms", lambda A, xd, d, K: tasks.delay_torque(A, xd, 1e-3 * d, K), "1000"),
        ("wrong", "unprojected", lambda A, xd, d, K: -K * (A @ xd) * d, "projected"),
        ("wrong", "filtered", lambda A, xd, d, K: rk.antagonism_filter(A) @ (-K * (A @ xd) * d), "complement"),
        ("wrong", "no gain", lambda A, xd, d, K: -rk.prestress_projector(A) @ ((A @ xd) * d), "K_P"),
        ("wrong", "no rates", lambda A, xd, d, K: -K * rk.prestress_projector(A) @ d, "rates"),
        (
            "wrong",
            "mean delay",
            lambda A, xd, d, K: -K * rk.prestress_projector(A) @ (A @ xd) * d.mean(),
            "its own delay",
        ),
        (
            "wrong",
            "projected first",
            lambda A, xd, d, K: -K * (rk.prestress_projector(A) @ A @ xd) * d,
            "its own delay",
        ),
        ("wrong", "no delays", lambda A, xd, d, K: -K * rk.prestress_projector(A) @ A @ xd, "its own delay"),
        ("wrong", "at the end-effector", lambda A, xd, d, K: -K * A.T @ ((A @ xd) * d), ""),
        ("wrong", "zero", lambda A, xd, d, K: np.zeros(len(A)), "zero"),
        ("wrong", "transposed", lambda A, xd, d, K: -K * (A.T @ A @ xd), ""),
    ],
    "07.via_points": [
        ("right", "equal steps of the root of the demand", tasks.via_points),
        ("right", "trapezoids, a list", by_the_integral),
        ("right", "by hand", fixed([0.05, 0.105, 0.165, 0.23, 0.3, 0.39, 0.49, 0.62, 0.85])),
        ("right", "in another order", fixed(EXAMPLE[::-1])),
        ("right", "each twice", fixed(np.repeat(EXAMPLE, 2))),
        ("wrong", "equal distances", fixed(np.linspace(0, 1, 11)[1:-1]), "equal"),
        ("wrong", "as the demand itself", as_the_demand, "square root"),
        ("wrong", "the wrong end", fixed(1 - EXAMPLE), "torque"),
        ("wrong", "too many", fixed(np.linspace(0, 1, 33)[1:-1]), "equal"),
        ("wrong", "too many, well placed", fixed(np.sort([*EXAMPLE, *(EXAMPLE + 0.02)])), "via points"),
        ("wrong", "equal distances along part", lambda part, d: np.linspace(part[0], part[-1], 11)[1:-1], "equal"),
        ("wrong", "equal distances, back to front", fixed(np.linspace(1, 0, 11)[1:-1]), "equal"),
        ("wrong", "ends included", fixed(np.linspace(0, 1, 9)), "ends of the way"),
        ("wrong", "start included", fixed([0, *EXAMPLE]), "ends of the way"),
        ("wrong", "end included", fixed([*EXAMPLE, 1]), "ends of the way"),
        ("wrong", "one before the start", fixed([-0.1, *EXAMPLE[1:]]), "between 0 and 1"),
        ("wrong", "a matrix of one row", fixed(EXAMPLE[None]), "a flat array is wanted"),
        ("wrong", "a column", fixed(EXAMPLE[:, None]), "a flat array is wanted"),
        ("wrong", "one", fixed([0.3]), "via points 1 in all"),
        ("wrong", "in millimetres", fixed(240 * EXAMPLE), "between 0 and 1"),
        ("wrong", "too few", fixed(EXAMPLE[::2]), "torque"),
        ("wrong", "none", fixed([]), "via points 0 in all"),
    ],
}
