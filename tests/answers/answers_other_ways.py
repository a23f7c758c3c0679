"""Right answers by ways that no lesson shows, and wrong ones by the habits of other books, for all lessons."""

import itertools

import numpy as np
import sympy
from scipy.linalg import cho_solve, null_space
from scipy.optimize import least_squares
from scipy.spatial import ConvexHull

import rapkm_lite as rk


def tips(robot, q):
    """In complex numbers; the last digits are others than those of the package."""
    base, elbow = q[: robot.n_arms], q[robot.n_arms :]
    z = robot.lengths[:, 0] * np.exp(1j * base) + robot.lengths[:, 1] * np.exp(1j * (base + elbow))
    return np.stack([z.real, z.imag], axis=1) + robot.base + 0.3 - 0.3


def gaps(change):
    """A function of the tips that takes the place of the gaps."""
    return lambda robot, q: change(tips(robot, q)).ravel()


def from_tip_2(p):
    return np.delete(p, 1, axis=0) - p[1]


def by_transformations(robot, q):
    def moved(angle, x, y):
        return np.array([[np.cos(angle), -np.sin(angle), x], [np.sin(angle), np.cos(angle), y], [0, 0, 1]])

    n, p = robot.n_arms, []
    for i, (l1, l2) in enumerate(robot.lengths):
        p.append((moved(q[i], *robot.base[i]) @ moved(q[n + i], l1, 0) @ [l2, 0, 1])[:2])
    return [v for i in range(n) if i != 1 for v in p[i] - p[1]]


def bordered(robot, q, independent):
    """J F = 0 and the identity in the rows of the pair, in one solve."""
    M = np.vstack([rk.constraint_jacobian(robot, q), np.eye(robot.n_joints)[list(independent)]])
    return np.linalg.solve(M, np.vstack([np.zeros((len(M) - 2, 2)), np.eye(2)]))


def accelerations(robot, q, qd, c):
    """Udwadia and Kalaba: the free ones, corrected by a pseudoinverse weighted with the masses."""
    G = rk.mass_matrix(robot, q)
    rest = rk.coriolis_matrix(robot, q, qd) @ qd + rk.generalized_forces(robot, q, qd)
    free = np.linalg.solve(G, np.concatenate([c, 0 * c]) - rest)
    values, vectors = np.linalg.eigh(G)
    root = vectors / np.sqrt(values) @ vectors.T
    jump = -rk.constraint_jacobian_dot(robot, q, qd) @ qd - rk.constraint_jacobian(robot, q) @ free
    return free + root @ np.linalg.pinv(rk.constraint_jacobian(robot, q) @ root) @ jump


def newton(robot, q, qd, c):
    """Force by force, from the two torques of each arm."""
    qdd = accelerations(robot, q, qd, c)
    rest = rk.coriolis_matrix(robot, q, qd) @ qd + rk.generalized_forces(robot, q, qd)
    torques = (rk.mass_matrix(robot, q) @ qdd + rest - np.concatenate([c, 0 * c])).reshape(2, -1).T
    a, d = robot.lengths.T * np.exp(1j * np.array([q[: robot.n_arms], q.reshape(2, -1).sum(axis=0)]))
    levers = [np.array([[-(u + v).imag, (u + v).real], [-v.imag, v.real]]) for u, v in zip(a, d, strict=True)]
    return tuple(np.linalg.solve(M, t) for M, t in zip(levers, torques, strict=True))


def hull(A, torque):
    corners = np.array([torque * A.T @ signs for signs in itertools.product([-1.0, 1.0], repeat=len(A))])
    return -ConvexHull(corners).equations[:, -1].max()


def by_factor(A, f, W, c0):
    """In torques in which W is the identity."""
    L = np.linalg.cholesky(W)
    return c0 + cho_solve((L, True), A @ np.linalg.solve(A.T @ cho_solve((L, True), A), f - A.T @ c0))


def midway(mode):
    odd = int(np.argmax(mode != np.sign(mode.sum())))
    return tuple(-rk.load().base[odd] / 2)


def springs(A, K_P, offset):
    """Equilibrium with the loops held closed by multipliers."""
    Z = null_space(A.T)
    none = np.zeros((Z.shape[1], Z.shape[1]))
    return np.linalg.solve(np.block([[K_P, Z], [Z.T, none]]), np.append(-K_P @ offset, none[0]))[: len(A)]


def twice_across(A, c):
    n = np.cross(*A.T)
    return np.ma.array(np.cross(n, np.cross(c, n)) / (n @ n), mask=False)


def saved_in_a_loop(robot, A, c, dt):
    weight, joule = robot.resistance / robot.torque_constant**2, np.zeros(3)
    for rows, torques in zip(A, c, strict=True):
        z = np.linalg.lstsq(rows, torques, rcond=None)[0]
        joule += weight * dt * (torques**2 - (rows @ z) ** 2)
    return joule.tolist()


def accelerated(robot, q, pair):
    """Inverse dynamics from rest, for one unit acceleration after the other."""
    F, still = rk.orthogonal_complement(robot, q, pair), 0 * q
    hold = rk.inverse_dynamics(robot, q, still, still)
    return np.stack([rk.inverse_dynamics(robot, q, still, v) - hold for v in F.T], axis=1)


def all_signs(S, sigma):
    signs = [np.array(one) for one in itertools.product([-1, 1], repeat=len(S))]
    return sum(sigma * one @ S @ one * sigma for one in signs) / len(signs)


def even_draws(width):
    def mean(S, sigma):
        draws = width * sigma * np.random.default_rng(1).uniform(-1, 1, (100_000, len(S)))
        return np.einsum("ki,ij,kj->k", draws, S, draws).mean()

    return mean


def unexplained(robot, q_a, guess):
    """A solver's rest for each row."""

    def left(angles, x):
        def gap(place):
            return rk.inverse_kinematics(robot, place)[: robot.n_arms] - angles

        return least_squares(gap, x, xtol=1e-15, ftol=1e-15, gtol=1e-15).fun

    return [np.linalg.norm(left(*row)) for row in zip(q_a, guess, strict=True)]


def late(A, xd, delay, K_P):
    pull = K_P * (A @ xd) * delay
    return A @ np.linalg.lstsq(A, pull, rcond=None)[0] - pull


def drive_by_drive(c, n, limit):
    ends = [
        sorted([(-top - torque) / part, (top - torque) / part]) for torque, part, top in zip(c, n, limit, strict=True)
    ]
    return max(low for low, _ in ends), min(high for _, high in ends)


def corners(A, f, least):
    """All but two drives at `least`: the cheapest of the corners that are allowed."""
    found = []
    for free in map(list, itertools.combinations(range(len(A)), 2)):
        c = np.full(len(A), least)
        c[free] += np.linalg.solve(A[free].T, f - A.T @ c)
        found += [c] if c.min() > least - 1e-9 else []
    return min(found, key=np.sum)


def state_space(robot, q, K_P):
    A, G = rk.control_matrix(robot, q), rk.minimal_dynamics(robot, q, 0 * q, None)[0]
    M = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.linalg.solve(G, A.T * K_P @ A), np.zeros((2, 2))]])
    return np.sort(np.abs(np.linalg.eigvals(M).imag))[[0, 2]] / (2 * np.pi)


def error_with(G=1, C=1, Q=1):
    """The error by a wrong model, each kind of term with a sign of its own."""

    def error(robot, model, q, qd, xd, xdd, K_P):
        mine, its = (rk.minimal_dynamics(one, q, qd, None) for one in (robot, model))
        force = G * ((its[0] - mine[0]) @ xdd[..., None]) + C * ((its[1] - mine[1]) @ xd[..., None])
        return np.linalg.solve(its[0], force + Q * (its[2] - mine[2])[..., None])[..., 0] / K_P

    return error


def principal_angles(robot, q, omega):
    """The share of a direction of motion is the square of a cosine between it and the driven joints."""
    cosines = [np.linalg.svd(null_space(rk.constraint_jacobian(robot, one))[: robot.n_arms])[1] for one in q]
    return omega**2 / np.min(cosines) ** 2


def weighted(J, scale):
    """The projector that is orthogonal in the other units, without going there."""
    W = J / scale**2
    return np.eye(len(scale)) - W.T @ np.linalg.solve(J @ W.T, J)


def in_millimetres():
    angle = np.radians([210.0, 330.0, 90.0])
    base = 290.0 * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    return rk.Manipulator(base=base, lengths=[180.0, 260.0], masses=0.1, mode=[1, 1, -1])


def filtered(*gains):
    return lambda drawing: rk.AntagonismFilter(rk.PD(*gains))


K, f = sympy.symbols("K f")
ANSWERS = {
    "01.loop_constraints": [
        ("right", "complex numbers", gaps(from_tip_2)),
        ("right", "homogeneous transformations", by_transformations),
        ("wrong", "own arithmetic, opposite", gaps(lambda p: -from_tip_2(p)), "opposite sign"),
        ("wrong", "own arithmetic, mm", gaps(lambda p: 1e3 * from_tip_2(p)), "1000"),
        ("wrong", "own arithmetic, x first", gaps(lambda p: from_tip_2(p).T), "all x before all y"),
        ("wrong", "own arithmetic, y before x", gaps(lambda p: from_tip_2(p)[:, ::-1]), "another order"),
        ("wrong", "own arithmetic, from tip 1", gaps(lambda p: p[1:] - p[0]), "tip of arm 1"),
        ("wrong", "own arithmetic, chain", gaps(lambda p: np.diff(p, axis=0)), "one arm to the next"),
        ("wrong", "own arithmetic, tip 2 too", gaps(lambda p: p - p[1]), "not left out"),
        (
            "wrong",
            "own arithmetic, one gap turned",
            gaps(lambda p: from_tip_2(p) * ([[-1]] + [[1]] * (len(p) - 2))),
            "sign of entry 0 and 1",
        ),
        ("wrong", "clockwise angles", lambda robot, q: gaps(from_tip_2)(robot, -q), ""),
    ],
    "01.orthogonal_complement": [("right", "bordered matrix", bordered)],
    "01.projected_accelerations": [
        ("right", "Udwadia and Kalaba", lambda robot, q, qd, c, pair: accelerations(robot, q, qd, c)),
        (
            "wrong",
            "torques turned",
            lambda robot, q, qd, c, pair: accelerations(robot, q, qd, -c),
            "torques c is opposite",
        ),
    ],
    "01.pin_forces": [
        ("right", "arm by arm, a tuple", newton),
        ("wrong", "on the pin", lambda *case: -np.array(newton(*case)), "opposite sign"),
        ("wrong", "transposed", lambda *case: np.transpose(newton(*case)), "transposed"),
    ],
    "02.guaranteed_force": [("right", "convex hull", hull)],
    "02.best_torques": [("right", "by a factor of W", by_factor)],
    "02.input_singularity": [
        ("right", "opposite the odd arm, a tuple", midway),
        ("wrong", "arms counted on", lambda mode: midway(np.roll(mode, 1)), "counted on"),
        ("wrong", "arms counted back", lambda mode: midway(np.roll(mode, -1)), "counted back"),
    ],
    "03.rest_error": [
        ("right", "multipliers", springs),
        ("wrong", "arms counted on", lambda A, K_P, offset: springs(A, K_P, np.roll(offset, 1)), ""),
    ],
    "04.filtered_torques": [("right", "two cross products, a masked array", twice_across)],
    "04.saved_energy": [
        ("right", "a loop, a list", saved_in_a_loop),
        ("wrong", "in W", lambda r, A, c, dt: np.array(saved_in_a_loop(r, A, c, dt)) / (dt * len(A)), "mean power"),
    ],
    "05.feedback_map": [("right", "from inverse dynamics", accelerated)],
    "05.explicit_pseudoinverse": [
        ("right", "least squares with a cut-off", lambda A, rows: np.linalg.lstsq(A.T, np.eye(A.shape[1]), 1e-8)[0]),
        ("right", "through the normal matrix", lambda A, rows: A @ np.linalg.pinv(A.T @ A, rcond=1e-12)),
    ],
    "06.form": [
        ("wrong", "per degree", lambda *case: rk.antagonism_form(*case) * np.radians(1.0) ** 2, "degrees, squared"),
    ],
    "06.expected_cost": [
        ("right", "all choices of signs", all_signs),
        ("wrong", "even draws of the right width", even_draws(np.sqrt(3)), "random draws"),
        ("wrong", "even draws from -sigma to sigma", even_draws(1.0), "drawn evenly from -sigma to sigma"),
        ("wrong", "degrees", lambda S, sigma: all_signs(S, np.degrees(sigma)), "degrees instead of radians, squared"),
    ],
    "07.contradiction": [("right", "a solver for each row, a list", unexplained)],
    "07.delay_torque": [
        ("right", "rest of least squares", late),
        ("right", "after the mean delay", lambda A, xd, delay, K_P: late(A, xd, delay - delay.mean(), K_P)),
    ],
    "08.counts": [("right", "from sympy", sympy.lambdify((K, f), sympy.pi * K / f))],
    "09.room": [("right", "drive by drive, a tuple", drive_by_drive)],
    "09.one_sign": [("right", "corner by corner", corners)],
    "10.spare_law": [
        ("wrong", "lists of the lessons' gains", filtered([7.05] * 3, [0.225] * 3), "that of the other lessons"),
        ("wrong", "matrices of them", filtered(7.05 * np.eye(3), 0.225 * np.eye(3)), "that of the other lessons"),
        ("wrong", "a list of softer gains", filtered([5.0] * 3, [0.2] * 3), "missed"),
    ],
    "11.pd_frequencies": [("right", "in the state space", state_space)],
    "11.model_error": [
        ("right", "stacks of matrices", error_with()),
        ("wrong", "Q_hat - Q turned", error_with(Q=-1), "sign of friction and gravity"),
        ("wrong", "G_hat - G turned", error_with(G=-1), "sign of the acceleration terms"),
        ("wrong", "C and Q turned", error_with(C=-1, Q=-1), "signs of velocity terms, friction"),
    ],
    "11.gain_for_bandwidth": [("right", "principal angles", principal_angles)],
    "12.other_units": [
        ("right", "weighted at once", weighted),
        ("wrong", "transposed", lambda J, scale: weighted(J, scale).T, "wrong order"),
    ],
    "12.own_machine": [("wrong", "in mm", in_millimetres, "in mm")],
}
