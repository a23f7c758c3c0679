"""Answers to lesson 04: the filter, the filtered command, the energy it saves."""

import numpy as np
from scipy.optimize import minimize

import rapkm_lite as rk


def keep(A, c):
    return A @ np.linalg.pinv(A) @ c


def searched(A, c):
    """The smallest torques with the same force, by an optimizer at its default tolerance."""
    force = A.T @ c
    return A @ minimize(lambda f: np.sum((A.T @ (A @ f) - force) ** 2), np.zeros(2), method="Nelder-Mead").x


def in_place(A, c):
    c -= c - keep(A, c)
    A *= 0.0
    return c


def in_turn(A, c):
    """The columns of A made orthogonal one after the other."""
    first = A[:, 0] / np.linalg.norm(A[:, 0])
    second = A[:, 1] - first * (first @ A[:, 1])
    second /= np.linalg.norm(second)
    return first * (first @ c) + second * (second @ c)


def null(A):
    n = np.cross(A[:, 0], A[:, 1])
    return n / np.linalg.norm(n)


TORQUES = [
    ("right", "pseudoinverse", keep),
    ("right", "least squares", lambda A, c: A @ np.linalg.lstsq(A, c, rcond=None)[0]),
    ("right", "inverse", lambda A, c: A @ np.linalg.inv(A.T @ A) @ A.T @ c),
    ("right", "null vector by a cross product", lambda A, c: c - null(A) * (null(A) @ c)),
    ("right", "in place", in_place),
    ("right", "a list", lambda A, c: list(keep(A, c))),
    ("right", "QR", lambda A, c: np.linalg.qr(A)[0] @ (np.linalg.qr(A)[0].T @ c)),
    ("right", "columns made orthogonal", in_turn),
    ("close", "an optimizer at its default tolerance", searched),
    ("close", "a damped inverse", lambda A, c: A @ np.linalg.solve(A.T @ A + 1e-4 * np.eye(2), A.T @ c)),
    ("wrong", "unchanged", lambda A, c: c, "unchanged"),
    ("wrong", "opposite sign", lambda A, c: -keep(A, c), "sign"),
    ("wrong", "what is removed", lambda A, c: c - keep(A, c), "complement"),
    ("wrong", "what is removed, by the null vector", lambda A, c: null(A) * (null(A) @ c), "complement"),
    ("wrong", "without the inverse", lambda A, c: A @ A.T @ c, "inverse"),
    ("wrong", "the force", lambda A, c: A.T @ c, "force"),
    ("wrong", "the two numbers", lambda A, c: np.linalg.pinv(A) @ c, "factor A"),
    ("wrong", "in mN m", lambda A, c: 1e3 * keep(A, c), "1000"),
    ("wrong", "mean removed", lambda A, c: c - np.mean(c), "null vector"),
    ("wrong", "columns one by one", lambda A, c: sum(a * (a @ c) / (a @ a) for a in A.T), "one by one"),
    ("wrong", "not divided by the norm", lambda A, c: c - np.cross(*A.T) * (np.cross(*A.T) @ c), "unit"),
    ("wrong", "added instead of removed", lambda A, c: c + null(A) * (null(A) @ c), "added"),
    ("wrong", "reversed", lambda A, c: keep(A, c)[::-1], "order"),
    ("wrong", "absolute value", lambda A, c: np.abs(keep(A, c)), "sign"),
    ("wrong", "the matrix", lambda A, c: rk.antagonism_filter(A), "shape"),
    ("wrong", "a column", lambda A, c: keep(A, c)[:, None], "shape"),
    ("wrong", "sizes of the null vector", lambda A, c: c - np.abs(null(A)) * (np.abs(null(A)) @ c), ""),
    ("wrong", "third drive off", lambda A, c: np.append(np.linalg.solve(A[:2].T, A.T @ c), 0.0), "drive 3 is off"),
    ("wrong", "half of it", lambda A, c: 0.5 * keep(A, c), "half"),
    ("wrong", "limited", lambda A, c: np.clip(c, -0.03, 0.03), ""),
    ("wrong", "complex", lambda A, c: keep(A, c) + 0j, "complex"),
    ("wrong", "one argument", lambda A: A, "TypeError"),
]


def command(A, K_P, measured, desired, gains=None):
    gains = K_P if gains is None else gains
    R = rk.antagonism_filter(gains[:, None] * A)
    return measured - R @ (measured - desired)


def with_matrices(A, K_P, measured, desired):
    AK = A.T @ np.diag(K_P)
    return measured - np.linalg.pinv(AK) @ AK @ (measured - desired)


COMMANDS = [
    ("right", "as in the lesson", command),
    ("right", "two pseudoinverses", with_matrices),
    ("right", "desired plus what is removed", lambda A, K, q, d: d + (np.eye(3) - rk.command_filter(A, K)) @ (q - d)),
    ("right", "null vector", lambda A, K, q, d: d + null(A * K[:, None]) * (null(A * K[:, None]) @ (q - d))),
    ("wrong", "gains forgotten", lambda A, K, q, d: command(A, np.ones(3), q, d), "gains are forgotten"),
    ("wrong", "from the desired", lambda A, K, q, d: d - rk.command_filter(A, K) @ (q - d), "desired"),
    ("wrong", "desired minus the error", lambda A, K, q, d: q + rk.command_filter(A, K) @ (q - d), "sign"),
    ("wrong", "error only", lambda A, K, q, d: rk.command_filter(A, K) @ (q - d), "error only"),
    ("wrong", "measured", lambda A, K, q, d: q, "itself"),
    ("wrong", "desired", lambda A, K, q, d: d, "itself"),
    ("wrong", "angles filtered", lambda A, K, q, d: rk.command_filter(A, K) @ d, "the angles themselves"),
    (
        "wrong",
        "measured angles filtered",
        lambda A, K, q, d: rk.command_filter(A, K) @ q,
        "the measured angles themselves",
    ),
    ("wrong", "divided by gains", lambda A, K, q, d: command(A, 1 / K, q, d), "divided by the gains"),
    ("wrong", "torques filtered", lambda A, K, q, d: q - rk.antagonism_filter(A) @ (K * (q - d)) / K, "torques"),
    ("wrong", "a torque", lambda A, K, q, d: q - rk.antagonism_filter(A) @ (K * (q - d)), "units"),
    ("wrong", "degrees", lambda A, K, q, d: np.degrees(command(A, K, q, d)), "180/pi"),
    ("wrong", "complement", lambda A, K, q, d: d + rk.command_filter(A, K) @ (q - d), "complement"),
    ("wrong", "columns scaled", lambda A, K, q, d: q - rk.antagonism_filter(A * K.mean()) @ (q - d), "gains"),
    ("wrong", "exchanged", lambda A, K, q, d: command(A, K, d, q), "exchanged"),
    ("wrong", "root of the gains", lambda A, K, q, d: command(A, np.sqrt(K), q, d), "root"),
    ("wrong", "a wrong direction", lambda A, K, q, d: q - rk.command_filter(A, K) @ (d - q), "sign"),
    ("wrong", "in mrad", lambda A, K, q, d: 1e3 * command(A, K, q, d), "1000"),
    ("wrong", "gains squared", lambda A, K, q, d: command(A, K**2, q, d), "twice"),
    (
        "wrong",
        "gains on both sides",
        lambda A, K, q, d: q - K * (rk.command_filter(A, K) @ (q - d)),
        "multiplied by the gains",
    ),
    ("wrong", "the matrix", lambda A, K, q, d: rk.command_filter(A, K), "shape"),
    ("wrong", "zeros", lambda A, K, q, d: 0 * q, "zero"),
    ("wrong", "reversed", lambda A, K, q, d: command(A, K, q, d)[::-1], "order"),
    ("wrong", "opposite", lambda A, K, q, d: -command(A, K, q, d), "sign"),
]


def kept(A, c):
    return np.array([keep(Ak, ck) for Ak, ck in zip(A, c, strict=True)])


def loss(robot, c, dt):
    return robot.resistance * np.sum((c / robot.torque_constant) ** 2, axis=0) * dt


def saved(robot, A, c, dt):
    return loss(robot, c, dt) - loss(robot, kept(A, c), dt)


def whole_matrix(robot, A, c, dt):
    c[:] = c - kept(A, c)
    return loss(robot, c, dt)


SAVINGS = [
    ("right", "by hand", saved),
    ("right", "in place", lambda robot, A, c, dt: saved(robot, A, c, dt).tolist()),
    ("right", "as a list", lambda robot, A, c, dt: list(saved(robot, A, c, dt))),
    (
        "right",
        "einsum",
        lambda r, A, c, dt: loss(r, c, dt) - loss(r, (rk.antagonism_filter(A) @ c[..., None])[..., 0], dt),
    ),
    ("wrong", "loss of the antagonism", whole_matrix, "Pythagoras"),
    ("wrong", "what remains", lambda r, A, c, dt: loss(r, kept(A, c), dt), "remains"),
    ("wrong", "without filter", lambda r, A, c, dt: loss(r, c, dt), "without the filter"),
    ("wrong", "opposite", lambda r, A, c, dt: -saved(r, A, c, dt), "sign"),
    ("wrong", "total", lambda r, A, c, dt: saved(r, A, c, dt).sum(), "total"),
    ("wrong", "share", lambda r, A, c, dt: saved(r, A, c, dt) / loss(r, c, dt), "share"),
    ("wrong", "mJ", lambda r, A, c, dt: 1e3 * saved(r, A, c, dt), "1000"),
    ("wrong", "dt forgotten", lambda r, A, c, dt: saved(r, A, c, 1.0), "dt"),
    (
        "wrong",
        "first filter",
        lambda r, A, c, dt: loss(r, c, dt) - loss(r, c @ rk.antagonism_filter(A[0]), dt),
        "first sample",
    ),
    (
        "wrong",
        "first motor",
        lambda r, A, c, dt: saved(r.replace(resistance=r.resistance[0]), A, c, dt),
        "motor of the first one",
    ),
    ("wrong", "the lesson's machine", lambda r, A, c, dt: saved(rk.load(), A, c, dt), "wrong for other motors"),
    (
        "wrong",
        "motors forgotten",
        lambda r, A, c, dt: np.sum(c**2 - kept(A, c) ** 2, axis=0) * dt,
        "a torque squared is no power",
    ),
    ("wrong", "k_t not squared", lambda r, A, c, dt: saved(r, A, c, dt) * r.torque_constant, "k_t"),
    ("wrong", "resistance forgotten", lambda r, A, c, dt: saved(r, A, c, dt) / r.resistance, "R_el"),
    ("wrong", "last sample", lambda r, A, c, dt: saved(r, A[:-1], c[:-1], dt), "last sample"),
    (
        "wrong",
        "half of the first and the last sample",
        lambda r, A, c, dt: saved(r, A, c, dt) - (saved(r, A[:1], c[:1], dt) + saved(r, A[-1:], c[-1:], dt)) / 2,
        "no trapezoidal rule",
    ),
    ("wrong", "first sample left out", lambda r, A, c, dt: saved(r, A[1:], c[1:], dt), ""),
    ("wrong", "half", lambda r, A, c, dt: 0.5 * saved(r, A, c, dt), "half"),
    ("wrong", "mean power", lambda r, A, c, dt: saved(r, A, c, 1 / len(c)), "dt"),
    ("wrong", "shape", lambda r, A, c, dt: c - kept(A, c), "shape"),
    ("wrong", "reversed", lambda r, A, c, dt: saved(r, A, c, dt)[::-1], "order"),
    ("wrong", "absolute", lambda r, A, c, dt: np.abs(saved(r, A, c, dt)), "sign"),
    ("wrong", "root", lambda r, A, c, dt: np.sqrt(np.abs(saved(r, A, c, dt))), ""),
    ("wrong", "twice", lambda r, A, c, dt: 2 * saved(r, A, c, dt), "twice"),
    ("wrong", "square of the difference", lambda r, A, c, dt: whole_matrix(r, A, c, dt), "Pythagoras"),
    ("wrong", "complement filtered", lambda r, A, c, dt: loss(r, kept(A, c), dt), "remains"),
    ("wrong", "zeros", lambda r, A, c, dt: np.zeros(3), "zero"),
]


def weights(robot):
    return robot.resistance / robot.torque_constant**2


def weighted(K_P, K_D):
    return lambda robot: rk.AntagonismFilter(rk.PD(K_P, K_D), W=weights(robot))


def fed_forward(robot):
    """A function that is weighted by hand: the motion's torques and PD, projected with the weights."""
    roots = np.sqrt(weights(robot))[:, None]

    def law(t, q_a, qd_a, desired):
        A = rk.control_matrix(robot, desired.q)
        force = A.T @ (-7.05 * (q_a - desired.q_a) - 0.225 * (qd_a - desired.qd_a))
        return (np.linalg.pinv((A / roots).T) @ force) / roots[:, 0]

    return law


def inside(robot):
    return rk.AntagonismFilter(rk.RedundantCTC(1000.0, 60.0), W=np.diag(weights(robot)))


def blind(robot):
    return lambda t, q_a, qd_a, d: rk.inverse_dynamics(robot, d.q, d.qd, d.qdd, W=weights(robot))


def by_hand(filtered, sign=1.0):
    """PD as a function, its torques through a filter, or not."""

    def make(robot):
        def law(t, q_a, qd_a, d):
            c = -sign * (7.05 * (q_a - d.q_a) + 0.225 * (qd_a - d.qd_a))
            A = rk.control_matrix(robot, d.q)
            return A @ np.linalg.solve(A.T @ A, A.T @ c) if filtered else c

        return law

    return make


LEAN = [
    ("right", "weights", weighted(7.05, 0.225)),
    ("right", "stiffer", weighted(20.0, 0.4)),
    ("right", "weights up to a factor", lambda robot: rk.AntagonismFilter(rk.PD(7.05, 0.225), W=robot.resistance)),
    ("right", "around computed torque", inside),
    ("right", "by hand", fed_forward),
    ("close", "a little too soft", weighted(4.8, 0.19)),
    ("wrong", "fed forward without sensors", blind, "not used"),
    ("wrong", "PD", lambda robot: rk.PD(7.05, 0.225), "no filter"),
    ("wrong", "PD as a function", by_hand(False), "no filter"),
    ("wrong", "a function that filters without weights", by_hand(True), "missing or alike"),
    ("wrong", "a function with the opposite sign", by_hand(False, -1.0), "pushes away"),
    ("wrong", "soft PD", lambda robot: rk.PD(2.0, 0.12), "no filter"),
    ("wrong", "no weights", lambda robot: rk.AntagonismFilter(rk.PD(7.05, 0.225)), "missing or alike"),
    ("wrong", "equal weights", lambda robot: rk.AntagonismFilter(rk.PD(7.05, 0.225), W=2.0), "missing or alike"),
    ("wrong", "k_t", lambda robot: rk.AntagonismFilter(rk.PD(7.05, 0.225), W=robot.torque_constant), "or alike"),
    ("wrong", "inverse", lambda robot: rk.AntagonismFilter(rk.PD(7.05, 0.225), W=1 / weights(robot)), "inverse"),
    ("wrong", "true pose", lambda robot: rk.AntagonismFilter(rk.PD(7.05, 0.225), "true", weights(robot)), "true pose"),
    ("wrong", "too soft", weighted(2.0, 0.12), "missed"),
    ("wrong", "commands", lambda robot: rk.CommandFilter(rk.PD(7.05, 0.225)), "energy"),
    (
        "wrong",
        "squared weights",
        lambda robot: rk.AntagonismFilter(rk.PD(7.05, 0.225), W=weights(robot) ** 2),
        "energy",
    ),
    ("wrong", "computed torque", lambda robot: rk.RedundantCTC(1000.0, 60.0), "energy"),
    ("wrong", "nothing", lambda robot: lambda t, q, qd, d: np.zeros(3), "mm"),
    ("wrong", "no law", lambda robot: weights(robot), "law"),
    ("wrong", "a law", rk.PD(7.05, 0.225), "function itself"),
    ("wrong", "opposite sign", lambda robot: lambda t, q, qd, d: 7.05 * (q - d.q_a), "lost"),
    ("wrong", "a crash", lambda robot: lambda t, q, qd, d: undefined, "NameError"),  # noqa: F821
]

ANSWERS = {
    "04.filtered_torques": TORQUES,
    "04.filtered_command": COMMANDS,
    "04.saved_energy": SAVINGS,
    "04.lean_law": LEAN,
}
