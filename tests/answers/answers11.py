"""Answers to lesson 11: natural frequencies of PD, the error that a wrong model costs, one law for three duties."""

import numpy as np
from scipy.linalg import eigh, eigvals

import rapkm_lite as rk
from rapkm_lite.lessons.lesson11 import tasks

right = tasks.pd_frequencies


def terms(robot, q, K_P):
    A = rk.control_matrix(robot, q)
    return rk.minimal_dynamics(robot, q, 0 * q, None)[0], A.T @ np.diag(K_P) @ A


def symmetric(robot, q, K_P):
    inertia, stiffness = terms(robot, q, K_P)
    return np.sqrt(eigh(stiffness, inertia, eigvals_only=True)) / (2 * np.pi)


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


def scaled(task, factor):
    return lambda *case: factor * task(*case)


def at(hertz, kind):
    """A law of one kind with a loop of so many Hz."""
    w = 2 * np.pi * hertz
    return lambda robot: kind(w**2, 2 * w)


def pd(k, d):
    return rk.PD(k / 119.9, d / 119.9)


def fed_forward(k, d):
    """Filtered PD around the torques of the wanted motion, as a function."""
    robot = rk.load()

    def law(t, q_a, qd_a, desired):
        wanted = rk.inverse_dynamics(robot, desired.q, desired.qd, desired.qdd)
        feedback = (k * (q_a - desired.q_a) + d * (qd_a - desired.qd_a)) / 119.9
        return wanted - rk.antagonism_filter(rk.control_matrix(robot, desired.q)) @ feedback

    return law


ANSWERS = {
    "11.pd_frequencies": [
        ("right", "reference", right),
        ("right", "symmetric eigenproblem", symmetric),
        ("right", "in two angles, a list", in_angles),
        ("right", "characteristic polynomial", polynomial),
        ("close", "rounded to a hundredth", lambda *case: np.round(right(*case), 2)),
        ("wrong", "rad/s", scaled(right, 2 * np.pi), "2 pi"),
        ("wrong", "squares", lambda *case: (2 * np.pi * right(*case)) ** 2, "root"),
        ("wrong", "squares in Hz", lambda *case: right(*case) ** 2, "root"),
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
        ("wrong", "no acceleration", lambda r, m, q, qd, v, a, K: tasks.model_error(r, m, q, qd, v, 0 * a, K), "accel"),
        ("wrong", "at rest", lambda r, m, q, qd, v, a, K: tasks.model_error(r, m, q, 0 * qd, v, a, K), ""),
        ("wrong", "zero", lambda r, m, q, *rest: np.zeros((len(q), 2)), "zero"),
        ("wrong", "transposed", lambda *case: tasks.model_error(*case).T, "transposed"),
    ],
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
        ("wrong", "5 Hz", at(5.0, lambda k, d: rk.CTC(k, d, None)), "counts"),
        ("wrong", "1 Hz", at(1.0, lambda k, d: rk.CTC(k, d, None)), "100 g"),
        ("wrong", "switched", at(2.2, rk.SwitchedCTC), "switch"),
        ("wrong", "PD, 5 Hz", at(5.0, pd), "feed-forward"),
        ("wrong", "PD and filter, 2.2 Hz", at(2.2, lambda k, d: rk.AntagonismFilter(pd(k, d))), "feed-forward"),
        ("wrong", "fed forward, too fast", lambda robot: fed_forward((2 * np.pi * 8) ** 2, 32 * np.pi), "counts"),
        ("wrong", "a number", lambda robot: 7.05, "a law is wanted"),
    ],
}
