"""Answers to lesson 03: rest pose, springs in series, offsets that nobody sees, encoder counts, and the logs."""

import numpy as np
from scipy.optimize import least_squares, minimize

import rapkm_lite as rk

ROBOT = rk.load()


def rest(A, K, offset):
    return -A @ np.linalg.solve(A.T @ K @ A, A.T @ K @ offset)


def by_least_squares(A, K, offset):
    """The shift with the smallest spring energy, through a root of the gains."""
    L = np.linalg.cholesky(K).T
    return A @ np.linalg.lstsq(L @ A, -L @ offset, rcond=None)[0]


def by_block_matrix(A, K, offset):
    """Error and contact force together: K e + n mu = -K offset, n^T e = 0."""
    n = np.linalg.svd(A)[0][:, 2:]
    m, k = n.shape
    M = np.block([[K, n], [n.T, np.zeros((k, k))]])
    return np.linalg.solve(M, np.r_[-K @ offset, np.zeros(k)])[:m]


def by_compliance(A, K, offset):
    n = np.linalg.svd(A)[0][:, 2:]
    C = np.linalg.inv(K)
    return -offset + C @ n @ np.linalg.solve(n.T @ C @ n, n.T @ offset)


def relaxed(A, K, offset):
    """Let the end-effector creep downhill until it hardly moves."""
    S, g = A.T @ K @ A, A.T @ K @ offset
    xi, step = np.zeros(2), 1.0 / np.linalg.norm(S, 2)
    while np.linalg.norm(S @ xi + g) > 1e-5 * np.linalg.norm(g):
        xi = xi - step * (S @ xi + g)
    return A @ xi


def searched(A, K, offset):
    """Nelder-Mead in millimetres at its default tolerance."""
    energy = lambda mm: (A @ mm / 1e3 + offset) @ K @ (A @ mm / 1e3 + offset)  # noqa: E731
    return A @ minimize(energy, np.zeros(2), method="Nelder-Mead", options={"fatol": 1e-12}).x / 1e3


def spoiling(A, K, offset):
    e = rest(A, K, offset)
    for given in (A, K, offset):
        given *= 0.0
    return e


def plain(A):
    return A @ np.linalg.pinv(A)


REST = [
    ("right", "normal equations", rest),
    ("right", "least squares with a root of K", by_least_squares),
    ("right", "block matrix", by_block_matrix),
    ("right", "by compliances", by_compliance),
    ("right", "package", lambda A, K, o: rk.steady_state_error(A, K, o)),
    ("right", "spoils its arguments", spoiling),
    ("right", "inverse and a list", lambda A, K, o: (-A @ np.linalg.inv(A.T @ K @ A) @ A.T @ K @ o).tolist()),
    ("close", "relaxation", relaxed),
    ("close", "Nelder-Mead", searched),
    ("wrong", "printed with A^T inserted", lambda A, K, o: -np.linalg.solve(K, plain(A) @ K @ o), "printed"),
    ("wrong", "minus the offset", lambda A, K, o: -o, "offset"),
    ("wrong", "gains forgotten", lambda A, K, o: -plain(A) @ o, "gains"),
    ("wrong", "shift only", lambda A, K, o: -np.linalg.solve(A.T @ K @ A, A.T @ K @ o), "factor A"),
    ("wrong", "measured error", lambda A, K, o: rest(A, K, o) + o, "measured"),
    ("wrong", "torques", lambda A, K, o: -K @ (rest(A, K, o) + o), "torques"),
    ("wrong", "opposite sign", lambda A, K, o: -rest(A, K, o), "sign"),
    ("wrong", "gains inverted", lambda A, K, o: rest(A, np.linalg.inv(K), o), "inverted"),
    ("wrong", "no stiffness", lambda A, K, o: -A @ A.T @ K @ o, "stiffness"),
    ("wrong", "A^T A for the stiffness", lambda A, K, o: -A @ np.linalg.solve(A.T @ A, A.T @ K @ o), "K_P is missing"),
    ("wrong", "no gain on the right", lambda A, K, o: -A @ np.linalg.solve(A.T @ K @ A, A.T @ o), "K_P is missing"),
    ("wrong", "gains squared", lambda A, K, o: rest(A, K @ K, o), "squared"),
    ("close", "diagonal only", lambda A, K, o: rest(A, np.diag(np.diag(K)), o)),
    ("wrong", "force", lambda A, K, o: -A.T @ K @ o, "force"),
    ("wrong", "mrad", lambda A, K, o: 1e3 * rest(A, K, o), "1000"),
    ("wrong", "degrees", lambda A, K, o: np.rad2deg(rest(A, K, o)), "degrees"),
    ("wrong", "offset itself", lambda A, K, o: o, "offset"),
    ("wrong", "zeros", lambda A, K, o: 0 * o, "zero"),
    ("wrong", "other order", lambda A, K, o: rest(A, K, o)[::-1], "order"),
    ("wrong", "half", lambda A, K, o: rest(A, K, o) / 2, "half"),
    ("wrong", "normal part", lambda A, K, o: -(o - plain(A) @ o), ""),
    ("wrong", "first gain for all", lambda A, K, o: rest(A, K[0, 0] * np.eye(len(o)), o), "gains"),
    ("wrong", "elementwise K", lambda A, K, o: -A @ np.linalg.solve(A.T @ (K * A[:, :1]), A.T @ o), "stops"),
    ("close", "right for three drives", lambda A, K, o: rest(A, K, o) + 1e-3 * (len(o) > 3)),
]


def fight(eta, gains, offset):
    return -eta * (eta @ offset) / np.sum(eta**2 / gains)


def through_rest(eta, gains, offset):
    A = np.linalg.svd(eta[:, None])[0][:, 1:]
    return -gains * (rest(A, np.diag(gains), offset) + offset)


def by_fit(eta, gains, offset):
    return eta * least_squares(lambda mu: eta @ (mu[0] * eta / gains + offset), [0.0]).x[0]


def by_bisection(eta, gains, offset):
    low, high = -10.0, 10.0
    for _ in range(16):
        mid = (low + high) / 2
        low, high = (mid, high) if eta @ (mid * eta / gains + offset) < 0 else (low, mid)
    return low * eta


def in_place(eta, gains, offset):
    offset *= eta
    gains /= eta**2 + 1e-300
    return -eta * offset.sum() / np.sum(1 / gains)


def rho(eta, offset):
    return eta @ offset


FIGHT = [
    ("wrong", "eta without its signs", lambda n, k, o: -np.abs(n) * (np.abs(n) @ o) / np.sum(n**2 / k), "working mode"),
    ("right", "formula", fight),
    ("right", "through the rest pose", through_rest),
    ("right", "root of the closing condition", by_fit),
    ("right", "arithmetic in place", in_place),
    ("right", "lists", lambda eta, gains, offset: [float(v) for v in fight(eta, gains, offset)]),
    ("right", "diagonal matrices", lambda n, k, o: -n * (n @ o) / (n @ np.linalg.inv(np.diag(k)) @ n)),
    ("close", "bisection, 16 steps", by_bisection),
    ("close", "a thousandth added", lambda n, k, o: 1.001 * fight(n, k, o)),
    ("wrong", "own gain each", lambda n, k, o: -k * n * rho(n, o), "own gain"),
    ("wrong", "mean gain", lambda n, k, o: -k.mean() * n * rho(n, o), "equal gains"),
    ("wrong", "parallel springs", lambda n, k, o: -n * rho(n, o) * np.sum(n**2 * k), "parallel"),
    ("wrong", "no eta squared", lambda n, k, o: -n * rho(n, o) / np.sum(1 / k), "eta"),
    ("wrong", "mean compliance", lambda n, k, o: -n * rho(n, o) / np.mean(1 / k), "compliance"),
    ("wrong", "eta not squared", lambda n, k, o: -n * rho(n, o) / np.sum(n / k), "squared"),
    ("wrong", "softest only", lambda n, k, o: -n * rho(n, o) * k.min(), "softest"),
    ("wrong", "first gain", lambda n, k, o: -n * rho(n, o) * k[0], "gain"),
    ("wrong", "mu alone", lambda n, k, o: -rho(n, o) / np.sum(n**2 / k), "eta is missing"),
    ("wrong", "whole torque", lambda n, k, o: -k * o, "whole"),
    ("wrong", "torque projected", lambda n, k, o: -n * (n @ (k * o)), "project"),
    ("wrong", "error", lambda n, k, o: -fight(n, k, o) / k - o, "error"),
    ("wrong", "gains inverted", lambda n, k, o: -n * rho(n, o) / np.sum(n**2 * k), "inverted"),
    ("wrong", "gains forgotten", lambda n, k, o: -n * rho(n, o), "gains"),
    ("wrong", "tangent part", lambda n, k, o: -k * (o - n * rho(n, o)), "tangent"),
    ("wrong", "opposite sign", lambda n, k, o: -fight(n, k, o), "sign"),
    ("wrong", "mN m", lambda n, k, o: 1e3 * fight(n, k, o), "1000"),
    ("wrong", "zeros", lambda n, k, o: 0 * o, "zero"),
    ("wrong", "reversed", lambda n, k, o: fight(n, k, o)[::-1], "order"),
    ("wrong", "no signs", lambda n, k, o: np.abs(fight(n, k, o)), "sign"),
    ("wrong", "twice", lambda n, k, o: 2 * fight(n, k, o), "twice"),
    ("close", "right for three drives", lambda n, k, o: fight(n, k, o) + 0.1 * (len(o) > 3)),
    ("wrong", "divides by eta", lambda n, k, o: -rho(n, o) / np.sum(n / k) / (n + 1e-3), ""),
    ("wrong", "offset itself", lambda n, k, o: o, "offset"),
]


def matrix(robot, x):
    return rk.control_matrix(robot, rk.inverse_kinematics(robot, x))


def beside(robot, x, step):
    q, there = rk.inverse_kinematics(robot, x), rk.inverse_kinematics(robot, np.add(x, step))
    return (q - there)[: robot.n_arms]


def first_null(robot, x, size=5e-3):
    return size * np.linalg.svd(matrix(robot, x))[0][:, -1]


def tried(robot, x):
    """Random offsets made tangent, scaled until a run has moved far enough."""
    A = matrix(robot, x)
    offset = A @ np.linalg.pinv(A) @ np.random.default_rng(1).normal(0, 4e-3, robot.n_arms)
    offset *= 2.3e-3 / np.linalg.norm(np.linalg.pinv(A) @ offset)
    return offset


UNSEEN = [
    ("right", "tangent in y", lambda robot, x: matrix(robot, x) @ [0.0, 2.2e-3]),
    ("right", "tangent in x", lambda robot, x: matrix(robot, x) @ [2.3e-3, 0.0]),
    ("right", "another pose's angles", lambda robot, x: beside(robot, x, [0.0, 2.1e-3])),
    ("right", "the other way", lambda robot, x: beside(robot, x, [-2.1e-3, 0.0])),
    ("right", "random, made tangent", tried),
    ("right", "a list", lambda robot, x: list(beside(robot, x, [1.6e-3, 1.6e-3]))),
    ("close", "exactly 2 mm in first order", lambda robot, x: matrix(robot, x) @ [0.0, 2.0e-3]),
    ("close", "1.95 mm", lambda robot, x: beside(robot, x, [1.95e-3, 0.0])),
    ("wrong", "no offsets", lambda robot, x: np.zeros(robot.n_arms), "no offsets"),
    ("wrong", "along eta", first_null, "eta"),
    ("wrong", "along eta, large", lambda robot, x: first_null(robot, x, 15e-3), "eta"),
    ("wrong", "millimetres", lambda robot, x: matrix(robot, x) @ [0.0, 2.2], "1000"),
    ("wrong", "milliradian of too little", lambda robot, x: matrix(robot, x) @ [0.0, 2.2e-6], "1000"),
    # A thousand times as large these would fight, and a thousand times smaller shift next to nothing.
    ("wrong", "small and all equal", lambda robot, x: np.full(robot.n_arms, 1e-5), "every place"),
    ("wrong", "degrees of a shift in cm", lambda robot, x: np.rad2deg(matrix(robot, x) @ [0.0, 0.22]), "a run is lost"),
    ("wrong", "1 mm", lambda robot, x: matrix(robot, x) @ [0.0, 1e-3], "shift at rest"),
    ("wrong", "5 mm", lambda robot, x: matrix(robot, x) @ [0.0, 5e-3], "missed"),
    ("wrong", "all equal", lambda robot, x: np.full(robot.n_arms, 5e-3), "every place"),
    ("wrong", "the lesson's offsets", lambda robot, x: np.resize([4e-3, -2e-3, 5e-3], robot.n_arms), "every place"),
    ("wrong", "one drive only", lambda robot, x: 10e-3 * np.eye(robot.n_arms)[0], "every place"),
    ("wrong", "A of the centre", lambda robot, x: matrix(robot, [0, 0]) @ [0.0, 2.2e-3], "every place"),
    ("wrong", "the lesson's A", lambda robot, x: matrix(ROBOT, [0.04, -0.05]) @ [0.0, 2.2e-3], "every place"),
    ("wrong", "right for three drives", lambda robot, x: (matrix(robot, x) @ [0.0, 2.2e-3])[:3], "shape"),
    ("wrong", "five numbers", lambda robot, x: np.full(5, 1e-3), "shape"),
    ("wrong", "transposed pseudoinverse", lambda robot, x: np.linalg.pinv(matrix(robot, x)).T @ [0, 0.4], "missed"),
    ("wrong", "a value", np.array([4e-3, -2e-3, 5e-3]), "function"),
    ("wrong", "NaN", lambda robot, x: np.full(robot.n_arms, np.nan), "cannot be tried: offset[0] = nan"),
    (
        "wrong",
        "elbow angles",
        lambda robot, x: (rk.inverse_kinematics(robot, x) - rk.inverse_kinematics(robot, np.add(x, [0, 2.2e-3])))[
            robot.n_arms :
        ],
        "torque at rest",
    ),
    ("wrong", "crash", lambda robot, x: robot.offset, "stops"),
]

# What people read from the logs.
ENDS = (1.5, 4.5, 7.5)


def corners(side):
    return rk.triangle(ROBOT, side, 3.0).q[[0, 1000, 2000]]


def means(name, what, width=0.8):
    log = rk.mystery_run(name)
    values = {"c": log.c, "e": log.error, "q": log.q_a}[what]
    return np.array([values[(log.t > end - width) & (log.t < end)].mean(axis=0) for end in ENDS])


def torques(name, side, gain=7.05, width=0.8):
    n = rk.null_vector(ROBOT, corners(side))
    return np.linalg.solve(n, -np.sum(n * means(name, "c", width), axis=1) / gain)


def angles(name, side):
    n = rk.null_vector(ROBOT, corners(side))
    return np.linalg.solve(n, np.sum(n * means(name, "e"), axis=1))


def closed(name, side):
    """Offsets and places for which the loops close exactly."""

    def gaps(z):
        places = z[3:].reshape(3, 2)
        return (rk.inverse_kinematics(ROBOT, places)[:, :3] + z[:3] - means(name, "q")).ravel()

    start = np.r_[np.zeros(3), rk.forward_kinematics(ROBOT, corners(side)).ravel()]
    return least_squares(gaps, start, xtol=1e-14, ftol=1e-14, gtol=1e-14).x[:3]


def one_sample(name, side):
    log, n = rk.mystery_run(name), rk.null_vector(ROBOT, corners(side))
    c = np.array([log.c[np.argmin(np.abs(log.t - end + 0.1))] for end in ENDS])
    return np.linalg.solve(n, -np.sum(n * c, axis=1) / 7.05)


def offsets_of(name, side):
    best = closed(name, side)
    n, e, c = rk.null_vector(ROBOT, corners(side)), means(name, "e"), means(name, "c")
    return [
        ("right", "angles", angles(name, side)),
        ("right", "exact closure", closed(name, side)),
        ("right", "as a list", angles(name, side).tolist()),
        ("close", "half a milliradian beside", best + [4e-4, -3e-4, 4e-4]),
        ("wrong", "opposite sign", -best, "sign"),
        ("wrong", "mrad", 1e3 * best, "1000"),
        ("wrong", "degrees", np.rad2deg(best), "degrees"),
        ("wrong", "zeros", np.zeros(3), "zero"),
        ("wrong", "reversed", best[::-1], "order"),
        ("wrong", "drives 1 and 2 exchanged", best[[1, 0, 2]], "order"),
        ("wrong", "drives 2 and 3 exchanged", best[[0, 2, 1]], "order"),
        ("wrong", "one sign", best * [1, -1, 1], "sign"),
        ("wrong", "errors of the first rest", e[0], "errors"),
        ("wrong", "mean error", e.mean(axis=0), "errors"),
        (
            "wrong",
            "mean of the minimum norms",
            np.mean(n * np.sum(n * e, axis=1)[:, None], axis=0),
            "" if name == "gain" else "smallest offsets",
        ),
        ("wrong", "gain forgotten", np.linalg.solve(n, -np.sum(n * c, axis=1)), ""),
        ("wrong", "minimum norm of one rest", n[0] * (n[0] @ e[0]), "one place" if name == "gain" else ""),
        ("wrong", "two numbers", best[:2], "shape"),
        ("wrong", "NaN", np.full(3, np.nan), "NaN"),
        ("wrong", "text", "unknown", "numeric"),
        ("wrong", "twice", 2 * best, "twice"),
        ("wrong", "transposed matrix", np.linalg.solve(n.T, np.sum(n * e, axis=1)), "transposed"),
    ]


def slopes(name):
    e, c = means(name, "e"), means(name, "c")
    return -np.sum(e * c, axis=0) / np.sum(e**2, axis=0)


GAINS = slopes("gain")
ANSWERS = {
    "03.rest_error": REST,
    "03.fight": FIGHT,
    "03.unseen_offsets": UNSEEN,
    "03.offsets": [
        ("right", "torques", torques("offset_a", 0.24)),
        ("close", "one sample of the torques", one_sample("offset_a", 0.24)),
        *offsets_of("offset_a", 0.24),
    ],
    "03.offset_b": [
        ("right", "torques, averaged", torques("offset_b", 0.06)),
        ("wrong", "one sample of the torques", one_sample("offset_b", 0.06), ""),
        *offsets_of("offset_b", 0.06),
        ("wrong", "null vectors of the big triangle", angles("offset_b", 0.24), ""),
    ],
    "03.offset_c": [
        ("right", "nothing can be told", np.full(3, np.nan)),
        ("right", "a list of NaN", [np.nan] * 3),
        ("right", "one NaN", float("nan")),
        ("right", "the one number", 1.5e-4),
        # A sentence would have to be understood.
        ("wrong", "words", "the three offsets cannot be told from one place", "say it with numbers"),
        ("wrong", "other words", "todo, not finished yet", "say it with numbers"),
        (
            "wrong",
            "minimum norm",
            (lambda n: n * 1.5e-4)(rk.null_vector(ROBOT, rk.inverse_kinematics(ROBOT, [0.04, -0.05]))),
            "minimum norm",
        ),
        ("wrong", "zero", np.zeros(3), "zeros are a claim"),
        ("wrong", "measured errors", rk.mystery_run("offset_c").error[-1], "minimum norm"),
        ("wrong", "something", np.array([4e-3, -2e-3, 5e-3]), "do not even explain"),
        ("wrong", "one of three", [1e-3, np.nan, np.nan], "none of the three"),
        ("wrong", "a wrong number", 5e-3, "another one"),
        ("wrong", "it looks calibrated", 0.0, "another one"),
        ("wrong", "a third of it", 5e-5, "another one"),
        ("wrong", "nearly twice as much", -2.7e-4, "another one"),
        ("wrong", "no number", np.inf, "another one"),
        ("wrong", "two", [np.nan, np.nan], "shape"),
        ("wrong", "complex", 1j * np.ones(3), "complex"),
    ],
    "03.gains": [
        ("right", "straight lines", GAINS),
        ("right", "true to two digits", np.round(GAINS, 1)),
        (
            "right",
            "from the largest error",
            (
                lambda e, c: (
                    -np.array([c[np.abs(e[:, i]).argmax(), i] / e[np.abs(e[:, i]).argmax(), i] for i in range(3)])
                )
            )(means("gain", "e"), means("gain", "c")),
        ),
        ("close", "a quarter beside", GAINS + [0.3, -0.25, 0.2]),
        ("wrong", "mean of ratios", -(means("gain", "c") / means("gain", "e")).mean(axis=0), "mean of the ratios"),
        ("wrong", "nominal", np.full(3, 7.05), "nominal"),
        ("wrong", "opposite sign", -GAINS, "sign"),
        ("wrong", "reciprocal", 1 / GAINS, "reciprocal"),
        ("wrong", "reversed", GAINS[::-1], "order"),
        ("wrong", "in N mm per rad", 1e3 * GAINS, "1000"),
        ("wrong", "per degree", np.deg2rad(GAINS), "units"),
        ("wrong", "zero", np.zeros(3), "zero"),
        ("wrong", "one number", 4.0, "shape"),
        ("wrong", "twice", 2 * GAINS, "twice"),
        ("wrong", "softest for all", np.full(3, GAINS.min()), ""),
        ("wrong", "mean for all", np.full(3, GAINS.mean()), ""),
    ],
    "03.gain": [
        *offsets_of("gain", 0.24),
        (
            "right",
            "torques with the fitted gains",
            (lambda n, c: np.linalg.solve(n, -np.sum(n * c / GAINS, axis=1)))(
                rk.null_vector(ROBOT, corners(0.24)), means("gain", "c")
            ),
        ),
        ("wrong", "nominal gain with the torques", torques("gain", 0.24), "gain"),
        ("wrong", "the gains", GAINS, "gains"),
        ("wrong", "mean gain with the torques", torques("gain", 0.24, GAINS.mean()), ""),
    ],
}
