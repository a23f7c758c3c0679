"""Answers to lesson 05: the feedback map, the explicit pseudoinverse, a dead encoder."""

import numpy as np
from scipy.optimize import minimize

import rapkm_lite as rk


def parts(robot, q, pair):
    return rk.control_matrix(robot, q, pair), rk.minimal_dynamics(robot, q, np.zeros(robot.n_joints), pair)[0]


def phi(robot, q, pair):
    A, Gbar = parts(robot, q, pair)
    return np.linalg.pinv(A.T) @ Gbar


def phi_of(change):
    return lambda robot, q, pair: change(*parts(robot, q, pair))


def by_law(robot, q, pair):
    """Differences of the torques of (20) when v_2 changes, from inverse dynamics."""
    F = rk.orthogonal_complement(robot, q, pair)
    zero = np.zeros(robot.n_joints)
    torque = [rk.inverse_dynamics(robot, q, zero, F @ v) for v in (np.zeros(2), *np.eye(2))]
    return np.stack([torque[1] - torque[0], torque[2] - torque[0]], axis=1)


def by_tree(robot, q, pair):
    F = rk.orthogonal_complement(robot, q, pair)
    A = F[: robot.n_arms]
    return A @ np.linalg.inv(A.T @ A) @ F.T @ rk.mass_matrix(robot, q) @ F


def column_by_column(robot, q, pair):
    A, Gbar = parts(robot, q, pair)
    return np.array([np.linalg.lstsq(A.T, column, rcond=None)[0] for column in Gbar.T]).T.tolist()


def phi_in_place(robot, q, pair):
    A, Gbar = parts(robot, q, pair)
    right = phi(robot, q, pair)
    q *= 0.0
    return right


def searched_map(robot, q, pair):
    A, Gbar = parts(robot, q, pair)

    def shortest(force):
        cost = lambda f: np.sum((A.T @ (A @ f) - force) ** 2)  # noqa: E731
        return A @ minimize(cost, np.zeros(2), method="BFGS", options={"gtol": 1e-7}).x

    return np.stack([shortest(column) for column in Gbar.T], axis=1)


def by_rows(chosen):
    """From A and Gbar of the end-effector, by way of the rows of A that belong to the pair."""

    def answer(robot, q, pair):
        A_x, G_x = parts(robot, q, None)
        back = np.linalg.inv(A_x[chosen(pair)])
        A = A_x @ back
        return tuple(map(tuple, np.einsum("ij,jk,kl,lm,mn->in", A, np.linalg.inv(A.T @ A), back.T, G_x, back)))

    return answer


def two_drives(robot, q, pair):
    A, Gbar = parts(robot, q, pair)
    Phi = np.zeros((robot.n_arms, 2))
    Phi[list(pair)] = Gbar
    return Phi


MAPS = [
    ("right", "pseudoinverse", phi),
    ("right", "from the law", by_law),
    ("right", "from the tree", by_tree),
    ("right", "least squares, a list", column_by_column),
    ("right", "in place", phi_in_place),
    ("right", "inverse", phi_of(lambda A, G: A @ np.linalg.inv(A.T @ A) @ G)),
    ("right", "transposed pseudoinverse", phi_of(lambda A, G: np.linalg.pinv(A).T @ G)),
    ("right", "weights of one", phi_of(lambda A, G: rk.weighted_pseudoinverse(A, np.eye(len(A))) @ G)),
    ("right", "rows of the pair", by_rows(list)),
    ("close", "rows of the pair by a mask", by_rows(sorted)),
    ("close", "pair sorted", lambda r, q, p: phi(r, q, sorted(p))),
    ("close", "slightly damped", phi_of(lambda A, G: A @ np.linalg.solve(A.T @ A + 1e-6 * np.eye(2), G))),
    ("wrong", "inverse forgotten", phi_of(lambda A, G: A @ G), "inverse"),
    ("wrong", "Gbar forgotten", phi_of(lambda A, G: np.linalg.pinv(A.T)), "Gbar is missing"),
    ("wrong", "Gbar only", phi_of(lambda A, G: G), "factor (A^T)^+"),
    ("wrong", "Gbar inverted", phi_of(lambda A, G: np.linalg.pinv(A.T) @ np.linalg.inv(G)), "inverted"),
    ("wrong", "opposite", lambda r, q, p: -phi(r, q, p), "sign"),
    ("wrong", "transposed", lambda r, q, p: phi(r, q, p).T, "transposed"),
    ("wrong", "in mN m", lambda r, q, p: 1e3 * phi(r, q, p), "1000"),
    ("wrong", "per degree", lambda r, q, p: phi(r, q, p) * np.pi / 180, "180/pi"),
    ("wrong", "end-effector", lambda r, q, p: phi(r, q, None), "pass the pair to both"),
    (
        "wrong",
        "Gbar of the first pair",
        lambda r, q, p: np.linalg.pinv(parts(r, q, p)[0].T) @ parts(r, q, (0, 1))[1],
        "Gbar is always that of drives 1 and 2",
    ),
    (
        "wrong",
        "A of the first pair",
        lambda r, q, p: np.linalg.pinv(parts(r, q, (0, 1))[0].T) @ parts(r, q, p)[1],
        "A is always that of drives 1 and 2",
    ),
    (
        "wrong",
        "mixed A",
        lambda r, q, p: np.linalg.pinv(parts(r, q, None)[0].T) @ parts(r, q, p)[1],
        "A is that of the end-effector, Gbar",
    ),
    (
        "wrong",
        "mixed Gbar",
        lambda r, q, p: np.linalg.pinv(parts(r, q, p)[0].T) @ parts(r, q, None)[1],
        "Gbar is that of the end-effector, A",
    ),
    ("wrong", "two drives only", two_drives, "only the two drives"),
    ("wrong", "pair reversed", lambda r, q, p: phi(r, q, p[::-1]), "order"),
    ("wrong", "drives reversed", lambda r, q, p: phi(r, q, p)[::-1], "order"),
    ("wrong", "torques to accelerations", lambda r, q, p: np.linalg.pinv(phi(r, q, p)), "inverse of the wanted"),
    ("wrong", "twice", lambda r, q, p: 2 * phi(r, q, p), "twice"),
    ("wrong", "half", lambda r, q, p: phi(r, q, p) / 2, "half"),
    ("wrong", "always the first pair", lambda r, q, p: phi(r, q, (0, 1)), "ignored"),
    ("wrong", "norm", lambda r, q, p: np.linalg.norm(phi(r, q, p), 2), "shape"),
    ("wrong", "absolute", lambda r, q, p: np.abs(phi(r, q, p)), "sign"),
    ("wrong", "zeros", lambda r, q, p: np.zeros((r.n_arms, 2)), "zero"),
    (
        "wrong",
        "complement",
        lambda r, q, p: np.eye(r.n_arms) - np.linalg.pinv(parts(r, q, p)[0].T) @ phi(r, q, p).T,
        "",
    ),
    ("wrong", "three drives only", lambda r, q, p: phi(r, q, p)[:3], "shape"),
    ("wrong", "one argument", lambda robot: 0.0, "TypeError"),
]


def blocks(A, rows):
    first, rest = list(rows), [i for i in range(len(A)) if i not in rows]
    L = np.linalg.inv(A[first] @ A[first].T) @ A[first]
    B = L @ A[rest].T
    bottom = np.linalg.inv(np.eye(len(rest)) + B.T @ B) @ B.T @ L
    return first, rest, L, B, bottom


def assembled(change):
    def answer(A, rows):
        first, rest, L, B, bottom = blocks(A, rows)
        result = np.zeros_like(A)
        result[first], result[rest] = change(L, B, bottom)
        return result

    return answer


explicit = assembled(lambda L, B, bottom: (L - B @ bottom, bottom))


def printed(A, rows):
    """(27) letter by letter."""
    first, rest, L, B, bottom = blocks(A, rows)
    top = L @ (np.eye(A.shape[1]) - A[rest].T @ np.linalg.inv(np.eye(len(rest)) + B.T @ B) @ B.T @ L)
    result = np.empty(A.shape)
    for i, row in zip(first + rest, np.vstack([top, bottom]), strict=True):
        result[i] = row
    return result


def cut(A, rows):
    U, s, Vt = np.linalg.svd(A.T, full_matrices=False)
    return (Vt.T[:, :2] / s[:2]) @ U.T[:2]


def by_ranks(A, rows):
    """Through a full-rank factorization A~^T = A~_1^T (I B)."""
    first, rest, L, B, _ = blocks(A, rows)
    M = np.zeros((2, len(A)))
    M[:, first], M[:, rest] = np.eye(2), B
    return M.T @ np.linalg.inv(M @ M.T) @ L


def explicit_in_place(A, rows):
    right = explicit(A, rows)
    A[:] = 0.0
    return right


def mask(A, rows):
    in_first = np.isin(np.arange(len(A)), rows)
    return explicit(A, np.flatnonzero(in_first)).tolist()


def stacked(A, rows):
    _, _, L, B, bottom = blocks(A, rows)
    return np.vstack([L - B @ bottom, bottom])


def sorted_rows(A, rows):
    """The blocks in the order of `rows`, put into place as if it were sorted."""
    first, rest, L, B, bottom = blocks(A, rows)
    result = np.empty_like(A)
    result[sorted(first)], result[rest] = L - B @ bottom, bottom
    return result


def three_arms_only(A, rows):
    first, rest, L, B, bottom = blocks(A, rows)
    b = B[:, :1]
    result = np.zeros_like(A)
    result[rest[:1]] = b.T @ L / (1 + b.T @ b)
    result[first] = L - b @ result[rest[:1]]
    return result


INVERSES = [
    ("right", "blocks", explicit),
    ("right", "as printed", printed),
    ("right", "singular values, cut", cut),
    ("right", "pinv with a cut-off", lambda A, rows: np.linalg.pinv(A.T, rcond=1e-8)),
    ("right", "factorization", by_ranks),
    ("right", "in place", explicit_in_place),
    ("right", "a mask, a list", mask),
    ("right", "the package", lambda A, rows: rk.explicit_pseudoinverse(A, rows)),
    ("right", "least squares with a cut-off", lambda A, rows: np.linalg.lstsq(A.T, np.eye(A.shape[1]), rcond=1e-8)[0]),
    ("close", "damped", lambda A, rows: np.linalg.solve(A @ A.T + 1e-5 * np.eye(len(A)), A)),
    ("wrong", "numpy's pinv", lambda A, rows: np.linalg.pinv(A.T), "cut-off"),
    ("wrong", "numpy's pinv of A~", lambda A, rows: np.linalg.pinv(A).T, "cut-off"),
    ("wrong", "a cut-off that is too small", lambda A, rows: np.linalg.pinv(A.T, rcond=1e-13), "or one as small"),
    ("wrong", "stacked", stacked, "order"),
    ("wrong", "taken as sorted", sorted_rows, "order"),
    ("wrong", "always the first two rows", lambda A, rows: explicit(A, (0, 1)), "rows 0 and 1 depend"),
    ("wrong", "transposed", lambda A, rows: explicit(A, rows).T, "transposed"),
    ("wrong", "opposite", lambda A, rows: -explicit(A, rows), "sign"),
    ("wrong", "others off", assembled(lambda L, B, b: (L, 0 * b)), "switched off"),
    ("wrong", "top not reduced", assembled(lambda L, B, b: (L, b)), "not reduced"),
    ("wrong", "B forgotten on top", assembled(lambda L, B, b: (L - b, b)), "factor B is missing in the top block"),
    ("wrong", "plus", assembled(lambda L, B, b: (L + B @ b, b)), "sign"),
    (
        "wrong",
        "identity forgotten",
        assembled(lambda L, B, b: (L - B @ np.linalg.pinv(B) @ L, np.linalg.pinv(B) @ L)),
        "identity",
    ),
    ("wrong", "inverse forgotten", assembled(lambda L, B, b: (L - B @ B.T @ L, B.T @ L)), "inverse"),
    ("wrong", "A~ itself", lambda A, rows: A, "itself"),
    ("wrong", "twice", lambda A, rows: 2 * explicit(A, rows), "twice"),
    ("wrong", "half", lambda A, rows: 0.5 * explicit(A, rows), "half"),
    ("wrong", "three arms only", three_arms_only, "four arms"),
    ("wrong", "A~_1 only", lambda A, rows: blocks(A, rows)[2], "shape"),
    ("wrong", "bottom only", lambda A, rows: blocks(A, rows)[4], "shape"),
    ("wrong", "inverse of A A^T", lambda A, rows: np.linalg.solve(A @ A.T, A), "singular"),
    ("wrong", "reversed", lambda A, rows: explicit(A, rows)[::-1], "order"),
    ("wrong", "the projector", lambda A, rows: explicit(A, rows) @ A.T, "shape"),
    ("wrong", "bottom negative", assembled(lambda L, B, b: (L - B @ b, -b)), "sign"),
    ("wrong", "L without inverse", lambda A, rows: without_inverse(A, rows), "inverse of A~_1"),
    ("wrong", "zeros", lambda A, rows: 0 * A, "zero"),
    ("wrong", "swapped rows", lambda A, rows: explicit(A, rows)[[1, 0, *range(2, len(A))]], "order"),
]


def without_inverse(A, rows):
    first, rest = list(rows), [i for i in range(len(A)) if i not in rows]
    B = A[first] @ A[rest].T
    bottom = np.linalg.solve(np.eye(len(rest)) + B.T @ B, B.T @ A[first])
    result = np.zeros_like(A)
    result[first], result[rest] = A[first] - B @ bottom, bottom
    return result


def alive_of(qd_a):
    return (qd_a != 0.0) | ~np.any(qd_a)


def feed_forward(K_P, K_D):
    def make(robot):
        def law(t, q_a, qd_a, desired):
            e, ed = q_a - desired.q_a, qd_a - desired.qd_a
            c = rk.inverse_dynamics(robot, desired.q, desired.qd, desired.qdd)
            return c - alive_of(qd_a) * (K_P * e + K_D * ed)

        return law

    return make


def rebuilt(robot):
    """The error of the end-effector from the drives that live, then PD for all."""

    def law(t, q_a, qd_a, desired):
        alive = np.flatnonzero(alive_of(qd_a))
        A = rk.control_matrix(robot, desired.q)
        dx = np.linalg.lstsq(A[alive], (q_a - desired.q_a)[alive], rcond=None)[0]
        dv = np.linalg.lstsq(A[alive], (qd_a - desired.qd_a)[alive], rcond=None)[0]
        return A @ (-7.05 * dx - 0.225 * dv)

    return law


class Remembering:
    """Compares each reading with the one before."""

    def __init__(self, robot):
        self.robot, self.last = robot, None

    def __call__(self, t, q_a, qd_a, desired):
        moved = np.full(3, True) if self.last is None else q_a != self.last
        self.last = q_a.copy()
        moved = moved | ~np.any(moved)
        c = rk.inverse_dynamics(self.robot, desired.q, desired.qd, desired.qdd)
        return c - moved * (7.05 * (q_a - desired.q_a) + 0.225 * (qd_a - desired.qd_a))


def masked(K_P, K_D):
    return lambda robot: lambda t, q, qd, d: -1.0 * alive_of(qd) * (K_P * (q - d.q_a) + K_D * (qd - d.qd_a))


def open_loop(robot):
    return lambda t, q, qd, d: rk.inverse_dynamics(robot, d.q, d.qd, d.qdd)


def not_noticed(robot):
    def law(t, q, qd, d):
        return rk.inverse_dynamics(robot, d.q, d.qd, d.qdd) - 7.05 * (q - d.q_a) - 0.225 * (qd - d.qd_a)

    return law


def without_start(robot):
    """Every drive whose rate is zero counts as dead, so none ever moves."""
    return lambda t, q, qd, d: (qd != 0.0) * (7.05 * (d.q_a - q) + 0.225 * (d.qd_a - qd))


def latching(robot):
    """What never moves is dead for good: the law remembers it, with its last reading, from call to call."""
    seen = {"last": None, "dead": np.zeros(robot.n_arms, dtype=bool)}

    def law(t, q_a, qd_a, d):
        if seen["last"] is not None and t > 0.1:
            seen["dead"] |= q_a == seen["last"]
        seen["last"] = q_a.copy()
        feedback = 7.05 * (q_a - d.q_a) + 0.225 * (qd_a - d.qd_a)
        return rk.inverse_dynamics(robot, d.q, d.qd, d.qdd) - ~seen["dead"] * feedback

    return law


def all_drives(sign):
    """Feed-forward, and the feedback of every drive, dead or alive."""

    def make(robot):
        def law(t, q_a, qd_a, d):
            c = rk.inverse_dynamics(robot, d.q, d.qd, d.qdd)
            return c - sign * (7.05 * (q_a - d.q_a) + 0.225 * (qd_a - d.qd_a))

        return law

    return make


SURVIVORS = [
    ("right", "feed-forward and the living", feed_forward(7.05, 0.225)),
    ("right", "softer", feed_forward(3.0, 0.15)),
    ("right", "rebuilt error", rebuilt),
    ("right", "readings compared", Remembering),
    ("right", "a dead drive stays dead", latching),
    ("wrong", "PD", lambda robot: rk.PD(7.05, 0.225), "frozen"),
    ("wrong", "a function that does not notice", all_drives(1), "must be noticed"),
    ("wrong", "the opposite sign", all_drives(-1), "pushes away"),
    ("wrong", "the filter", lambda robot: rk.AntagonismFilter(rk.PD(7.05, 0.225)), "force"),
    ("wrong", "redundant", lambda robot: rk.RedundantCTC(1000.0, 60.0), "all encoders"),
    ("wrong", "redundant APD", lambda robot: rk.RedundantAPD(2.0, 0.08), "all encoders"),
    ("wrong", "the end-effector", lambda robot: rk.CTC(900.0, 60.0, None), "all encoders"),
    ("wrong", "a pair", lambda robot: rk.CTC(1000.0, 60.0, (0, 1)), "the one outside the pair"),
    ("wrong", "a pair that survives the first", lambda robot: rk.CTC(1000.0, 60.0, (1, 2)), "the one outside the pair"),
    ("wrong", "switching", lambda robot: rk.SwitchedCTC(1000.0, 60.0), "health"),
    ("wrong", "open loop", open_loop, "not used"),
    ("wrong", "nothing", lambda robot: lambda t, q, qd, d: np.zeros(3), "not used"),
    ("wrong", "not noticed", not_noticed, "mm"),
    ("wrong", "no feed-forward", masked(7.05, 0.225), "mm"),
    ("wrong", "no drive at rest", without_start, "never starts"),
    ("wrong", "opposite sign", feed_forward(-7.05, -0.225), "lost"),
    ("wrong", "the law itself", rk.PD(7.05, 0.225), "function itself"),
    ("wrong", "no law", lambda robot: 3.0, "law"),
    ("wrong", "a crash", lambda robot: lambda t, q, qd, d: 1 / 0, "ZeroDivisionError"),
]

ANSWERS = {
    "05.feedback_map": MAPS,
    "05.explicit_pseudoinverse": INVERSES,
    "05.dead_encoder": SURVIVORS,
}
