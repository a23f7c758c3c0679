"""Answers to lesson 11: natural frequencies of PD, the error that a wrong model costs, the gain for a
bandwidth, one law for three duties."""

import numpy as np
from scipy.linalg import eigh, eigvals
from scipy.optimize import bisect

import rapkm_lite as rk
from rapkm_lite.lessons.lesson11 import tasks

right = tasks.pd_frequencies


def terms(robot, q, K_P):
    A = rk.control_matrix(robot, q)
    return rk.minimal_dynamics(robot, q, 0 * q, None)[0], A.T @ np.diag(K_P) @ A


def singular_values(robot, q, K_P):
    return np.sort(np.sqrt(np.linalg.svd(np.linalg.solve(*terms(robot, q, K_P)))[1])) / (2 * np.pi)


def uncoupled(robot, q, K_P):
    inertia, stiffness = terms(robot, q, K_P)
    return np.sort(np.sqrt(np.diag(stiffness) / np.diag(inertia))) / (2 * np.pi)


def symmetric(robot, q, K_P):
    inertia, stiffness = terms(robot, q, K_P)
    return np.sqrt(eigh(stiffness, inertia, eigvals_only=True)) / (2 * np.pi)


def taken_for_symmetric(robot, q, K_P):
    G, A = rk.minimal_dynamics(robot, q, 0 * q, None)[0], rk.control_matrix(robot, q)
    return np.sqrt(np.abs(np.linalg.eigvalsh(np.linalg.inv(G) @ A.T @ np.diag(K_P) @ A))) / (2 * np.pi)


def in_angles(robot, q, K_P):
    """In the angles of drives 1 and 2 instead of the place of the end-effector."""
    F = rk.orthogonal_complement(robot, q, (0, 1))
    inertia = F.T @ rk.mass_matrix(robot, q) @ F
    B = F[: robot.n_arms]
    return sorted((np.sqrt(eigvals(B.T @ (K_P[:, None] * B), inertia).real) / (2 * np.pi)).tolist())


def polynomial(robot, q, K_P):
    inertia, stiffness = terms(robot, q, K_P)
    M = np.linalg.inv(inertia) @ stiffness
    half, det = np.trace(M) / 2, np.linalg.det(M)
    root = np.sqrt(half**2 - det)
    return np.sqrt([half - root, half + root]) / (2 * np.pi)


def loop(robot, model, q, qd, xd, xdd, K_P):
    e = []
    for i in range(len(q)):
        G, C, Q = rk.minimal_dynamics(robot, q[i], qd[i], None)
        Gh, Ch, Qh = rk.minimal_dynamics(model, q[i], qd[i], None)
        e.append(np.linalg.solve(Gh, (Gh - G) @ xdd[i] + (Ch - C) @ xd[i] + Qh - Q) / K_P)
    return e


def by_torques(robot, model, q, qd, xd, xdd, K_P):
    """From the inverse dynamics of both machines."""
    qdd = np.einsum("kij,kj->ki", rk.orthogonal_complement(robot, q, None), xdd)
    qdd = qdd + np.einsum("kij,kj->ki", rk.orthogonal_complement_dot(robot, q, qd, None), xd)
    A = rk.control_matrix(robot, q)
    short = rk.inverse_dynamics(model, q, qd, qdd) - rk.inverse_dynamics(robot, q, qd, qdd)
    G = rk.minimal_dynamics(model, q, qd, None)[0]
    return np.linalg.solve(G, np.einsum("kij,ki->kj", A, short)[..., None])[..., 0] / K_P


def velocity_first(robot, model, q, qd, xd, xdd, K_P):
    """As `loop`, with xd @ C for C @ xd."""
    e = []
    for i in range(len(q)):
        G, C, Q = rk.minimal_dynamics(robot, q[i], qd[i], None)
        Gh, Ch, Qh = rk.minimal_dynamics(model, q[i], qd[i], None)
        e.append(np.linalg.solve(Gh, (Gh - G) @ xdd[i] + xd[i] @ (Ch - C) + Qh - Q) / K_P)
    return e


def scaled(task, factor):
    return lambda *case: factor * task(*case)


def at(hertz, kind):
    """A law of one kind with a loop of so many Hz."""
    w = 2 * np.pi * hertz
    return lambda robot: kind(w**2, 2 * w)


def pd(k, d):
    return rk.PD(k / 119.9, d / 119.9)


def fed_forward(k, d):
    """Filtered PD around the torques of the desired motion, as a function."""
    robot = rk.load().replace(friction=0.0)

    def law(t, q_a, qd_a, desired):
        wanted = rk.inverse_dynamics(robot, desired.q, desired.qd, desired.qdd)
        feedback = (k * (q_a - desired.q_a) + d * (qd_a - desired.qd_a)) / 119.9
        return wanted - rk.antagonism_filter(rk.control_matrix(robot, desired.q)) @ feedback

    return law


def driven(robot):
    return np.diag([1.0] * robot.n_arms + [0.0] * robot.n_arms)


def shares(robot, q, independent=None):
    F = rk.orthogonal_complement(robot, q, independent)
    return np.linalg.eigvals(rk.effective_gain(F, driven(robot))).real


def gain(robot, q, omega):
    return omega**2 / shares(robot, q).min()


def one_by_one(robot, q, omega):
    return max(omega**2 / shares(robot, one).min() for one in q)


def by_projector(robot, q, omega):
    N = rk.nullspace_projector(robot, q)
    return omega**2 / np.sort(np.linalg.eigvalsh(N @ driven(robot) @ N))[:, -2].min()


def by_hand(robot, q, omega):
    slow = []
    for one in q:
        F = rk.orthogonal_complement(robot, one, (0, 1))
        slow.append(np.linalg.eigvals(np.linalg.inv(F.T @ F) @ F.T @ driven(robot) @ F).real.min())
    return [omega**2 / min(slow)]


def bisected(robot, q, omega):
    return bisect(lambda K: K * shares(robot, q).min() - omega**2, 1.0, 1e6, xtol=1e-2)


def random_directions(robot, q, omega):
    """The slowest of many random directions: a share, searched."""
    rng = np.random.default_rng(0)
    F = rk.orthogonal_complement(robot, q)
    v = np.einsum("kij,aj->kai", F, rng.normal(size=(20000, 2)))
    return omega**2 / (np.sum(v[..., : robot.n_arms] ** 2, axis=-1) / np.sum(v**2, axis=-1)).min()


def without_inertia(independent):
    def answer(robot, q, omega):
        F = rk.orthogonal_complement(robot, q, independent)
        return omega**2 / np.linalg.eigvals(np.swapaxes(F, 1, 2) @ driven(robot) @ F).real.min()

    return answer


def second_line(robot, q, omega):
    F, G = rk.orthogonal_complement(robot, q), rk.mass_matrix(robot, q)
    left = np.swapaxes(F, 1, 2) @ G
    return omega**2 / np.linalg.eigvals(np.linalg.solve(left @ F, left @ driven(robot) @ F)).real.min()


GAINS = [
    ("right", "smallest eigenvalue", gain),
    ("right", "one pose at a time", one_by_one),
    ("right", "projector", by_projector),
    ("right", "by hand, in a list", by_hand),
    ("right", "angles of two drives", lambda r, q, w: w**2 / shares(r, q, (0, 1)).min()),
    ("right", "as an array", lambda r, q, w: np.array([gain(r, q, w)])),
    ("close", "bisected", bisected),
    ("close", "random directions", random_directions),
    ("wrong", "fastest", lambda r, q, w: w**2 / shares(r, q).max(), "largest"),
    ("wrong", "omega", lambda r, q, w: w / shares(r, q).min(), "squared"),
    ("wrong", "multiplied", lambda r, q, w: w**2 * shares(r, q).min(), "divided"),
    ("wrong", "first pose", lambda r, q, w: w**2 / shares(r, q[0]).min(), "first pose"),
    ("wrong", "mean of poses", lambda r, q, w: w**2 / shares(r, q).min(axis=1).mean(), "mean"),
    ("wrong", "mean of directions", lambda r, q, w: w**2 / shares(r, q).mean(axis=1).min(), "mean"),
    ("wrong", "fast direction", lambda r, q, w: w**2 / shares(r, q).max(axis=1).min(), "fast"),
    ("wrong", "printed, end-effector", without_inertia(None), "printed"),
    ("wrong", "printed, drives 1 and 2", without_inertia((0, 1)), "printed"),
    ("wrong", "line 2", second_line, "line 2"),
    ("wrong", "all joints", lambda r, q, w: w**2, "all joints"),
    ("wrong", "passive joints", lambda r, q, w: w**2 / (1 - shares(r, q)).min(), "passive"),
    ("wrong", "negative", lambda r, q, w: -gain(r, q, w), "sign"),
    ("wrong", "in Hz", lambda r, q, w: gain(r, q, 2 * np.pi * w), "factor"),
    ("wrong", "omega taken for rad/s, divided by 2 pi", lambda r, q, w: gain(r, q, w / (2 * np.pi)), "(2 pi)^2"),
    ("wrong", "twice", lambda r, q, w: 2 * gain(r, q, w), "twice"),
    ("wrong", "root", lambda r, q, w: np.sqrt(gain(r, q, w)), "root"),
    ("wrong", "square", lambda r, q, w: gain(r, q, w) ** 2, "square"),
    ("wrong", "what omega^2 leaves", lambda r, q, w: w * np.sqrt(shares(r, q).min()), "natural frequency"),
    ("wrong", "each pose", lambda r, q, w: w**2 / shares(r, q).min(axis=1), "shape"),
    ("wrong", "K_D", lambda r, q, w: 2 * gain(r, q, w) / w, "factor omega"),
    ("close", "three drives", lambda r, q, w: w**2 / (shares(r, q).min() * 3 / r.n_arms)),
    ("wrong", "always the testbed", lambda r, q, w: gain(rk.load(), q, w), "unequal arms"),
    ("wrong", "3/7 everywhere", lambda r, q, w: w**2 * 7 / 3, "centroid"),
    ("wrong", "matrix", lambda r, q, w: rk.effective_gain(rk.orthogonal_complement(r, q), driven(r)), "shape"),
]


ANSWERS = {
    "11.pd_frequencies": [
        ("wrong", "taken for symmetric", taken_for_symmetric, "eigvalsh"),
        ("right", "reference", right),
        ("right", "symmetric eigenproblem", symmetric),
        ("right", "in two angles, a list", in_angles),
        ("right", "characteristic polynomial", polynomial),
        ("close", "rounded to a hundredth", lambda *case: np.round(right(*case), 2)),
        ("wrong", "rad/s", scaled(right, 2 * np.pi), "2 pi"),
        ("wrong", "/ 2 * np.pi", scaled(right, np.pi**2), "brackets"),
        ("wrong", "squares", lambda *case: (2 * np.pi * right(*case)) ** 2, "root"),
        ("wrong", "squares in Hz", lambda *case: right(*case) ** 2, "root"),
        ("wrong", "x and y apart", uncoupled, "diagonals"),
        ("wrong", "singular values", singular_values, "eigenvalues"),
        ("wrong", "descending", lambda *case: right(*case)[::-1], "order"),
        ("wrong", "mean gain", lambda r, q, K: right(r, q, np.full(len(K), K.mean())), "averaged"),
        ("wrong", "first gain", lambda r, q, K: right(r, q, np.full(len(K), K[0])), ""),
        ("wrong", "stiffness only", lambda *c: np.sqrt(np.linalg.eigvalsh(terms(*c)[1])) / 2 / np.pi, "inertia"),
        (
            "wrong",
            "inertia not inverted",
            lambda *c: np.sort(np.sqrt(np.linalg.eigvals(terms(*c)[0] @ terms(*c)[1]).real)) / 2 / np.pi,
            "inverted",
        ),
        ("wrong", "exchanged", lambda *c: np.sqrt(eigh(*terms(*c), eigvals_only=True)) / 2 / np.pi, "are exchanged"),
        ("wrong", "always the testbed", lambda r, q, K: right(rk.load(), q, K), "unequal arms"),
        ("wrong", "both the same", lambda *case: np.full(2, right(*case).mean()), ""),
        ("wrong", "kHz", scaled(right, 1e-3), "1000"),
        ("wrong", "zero", lambda *case: np.zeros(2), "zero"),
        ("wrong", "the matrix", lambda *case: terms(*case)[1], "shape"),
    ],
    "11.model_error": [
        ("right", "reference", tasks.model_error),
        ("right", "pose by pose, a list", loop),
        ("right", "from inverse dynamics", by_torques),
        ("wrong", "sign", scaled(tasks.model_error, -1), "sign"),
        ("wrong", "no gain", lambda *case: case[-1] * tasks.model_error(*case), "K_P"),
        ("wrong", "in mm", scaled(tasks.model_error, 1e3), "1000"),
        ("wrong", "exchanged", lambda r, m, *rest: tasks.model_error(m, r, *rest), "exchanged"),
        ("wrong", "no velocity", lambda r, m, q, qd, v, a, K: tasks.model_error(r, m, q, qd, 0 * v, a, K), "velocity"),
        (
            "wrong",
            "C - C_hat",
            lambda r, m, q, qd, v, a, K: tasks.model_error(r, m, q, qd, -v, a, K),
            "sign of the velocity",
        ),
        ("wrong", "C xd / 2", lambda r, m, q, qd, v, a, K: tasks.model_error(r, m, q, qd, v / 2, a, K), "masses"),
        ("wrong", "no acceleration", lambda r, m, q, qd, v, a, K: tasks.model_error(r, m, q, qd, v, 0 * a, K), "accel"),
        ("wrong", "xd @ C", velocity_first, "C is transposed"),
        ("wrong", "at rest", lambda r, m, q, qd, v, a, K: tasks.model_error(r, m, q, 0 * qd, v, a, K), ""),
        ("wrong", "zero", lambda r, m, q, *rest: np.zeros((len(q), 2)), "zero"),
        ("wrong", "transposed", lambda *case: tasks.model_error(*case).T, "transposed"),
    ],
    "11.gain_for_bandwidth": GAINS,
    "11.one_law": [
        ("right", "end-effector, 2.2 Hz", at(2.2, lambda k, d: rk.CTC(k, d, None))),
        ("right", "redundant, 2.2 Hz", at(2.2, rk.RedundantCTC)),
        ("right", "second line, 2.2 Hz", at(2.2, lambda k, d: rk.RedundantCTC(k, d, projected=False))),
        ("right", "APD, 2 Hz", at(2.0, lambda k, d: rk.APD(k / 2.842, d / 2.842, None))),
        (
            "close",
            "gains on the drives, 2.4 Hz",
            at(2.4, lambda k, d: rk.RedundantCTC([k * 7 / 3] * 3, [d * 7 / 3] * 3)),
        ),
        ("right", "a pair that never switches", at(2.6, lambda k, d: rk.SwitchedCTC(k, d / 2, 5.0))),
        ("close", "PD and filter, a shade too costly", lambda robot: rk.AntagonismFilter(rk.PD(14.0, 0.16))),
        ("wrong", "5 Hz", at(5.0, lambda k, d: rk.CTC(k, d, None)), "counts"),
        ("wrong", "1 Hz", at(1.0, lambda k, d: rk.CTC(k, d, None)), "100 g"),
        ("wrong", "switched", at(2.2, rk.SwitchedCTC), "switch"),
        ("wrong", "PD, 5 Hz", at(5.0, pd), "feed-forward"),
        ("wrong", "PD and filter, 2.2 Hz", at(2.2, lambda k, d: rk.AntagonismFilter(pd(k, d))), "feed-forward"),
        ("wrong", "fed forward, too fast", lambda robot: fed_forward((2 * np.pi * 8) ** 2, 32 * np.pi), "counts"),
        ("wrong", "a number", lambda robot: 7.05, "a law is wanted"),
    ],
}
