"""Answers to lesson 02: control matrix, guaranteed force, weighted torques, input singularities."""

import numpy as np
from scipy.optimize import linprog, minimize, root

import rapkm_lite as rk

ROBOT = rk.load()


def cross(a, d):
    return a[..., 0] * d[..., 1] - a[..., 1] * d[..., 0]


def turned(v):
    return np.stack([-v[:, 1], v[:, 0]], axis=1)


def unit(v):
    return v / np.linalg.norm(v, axis=1, keepdims=True)


def by_loops(a, d):
    rows = []
    for (ax, ay), (dx, dy) in zip(a.tolist(), d.tolist(), strict=True):
        lever = ax * dy - ay * dx
        rows.append([dx / lever, dy / lever])
    return rows


def by_equations(a, d):
    """Rates of the drives for unit velocities, from the rigid links, one solve per drive."""
    return np.array([np.linalg.solve([[di @ [-ai[1], ai[0]]]], di[None]) for ai, di in zip(a, d, strict=True)])[:, 0]


def in_place(a, d):
    lever = cross(a, d)[:, None]
    d /= lever
    a *= 0.0
    return d


def by_difference(a, d):
    """Turn the proximal link by a small angle and see how far the tip gets along the distal link."""
    step = 1e-6
    ahead = a * np.cos(step) + turned(a) * np.sin(step)
    return d / (np.sum(d * (ahead - a), axis=1) / step)[:, None]


def by_angles(a, d):
    """The lever from the elbow angle, with its sign from atan2."""
    elbow = np.arctan2(d[:, 1], d[:, 0]) - np.arctan2(a[:, 1], a[:, 0])
    return d / (np.linalg.norm(a, axis=1) * np.linalg.norm(d, axis=1) * np.sin(elbow))[:, None]


ROWS = [
    ("right", "vectorised", lambda a, d: d / cross(a, d)[:, None]),
    ("right", "loops and lists", by_loops),
    ("right", "one solve per drive", by_equations),
    ("right", "arithmetic in place", in_place),
    ("right", "elbow angle", by_angles),
    ("right", "scalar product with the turned link", lambda a, d: d / np.sum(d * turned(a), axis=1)[:, None]),
    ("right", "diagonal matrix", lambda a, d: np.diag(1 / cross(a, d)) @ d),
    ("right", "einsum", lambda a, d: np.einsum("i,ij->ij", 1 / cross(a, d), d)),
    ("close", "difference quotient", by_difference),
    ("close", "a small number added against zero", lambda a, d: d / (cross(a, d) + 1e-9)[:, None]),
    ("wrong", "no lever", lambda a, d: d, "lever"),
    ("wrong", "unit rows", lambda a, d: unit(d), "lever"),
    ("wrong", "opposite sign", lambda a, d: -d / cross(a, d)[:, None], "sign"),
    ("wrong", "cross product the other way round", lambda a, d: d / cross(d, a)[:, None], "sign"),
    ("wrong", "proximal links", lambda a, d: a / cross(a, d)[:, None], "proximal"),
    ("wrong", "transposed", lambda a, d: (d / cross(a, d)[:, None]).T, "transposed"),
    ("wrong", "turned by a quarter", lambda a, d: turned(d) / cross(a, d)[:, None], "frame"),
    ("wrong", "scalar product", lambda a, d: d / np.sum(a * d, axis=1)[:, None], "cross product"),
    ("wrong", "multiplied", lambda a, d: d * cross(a, d)[:, None], "divide"),
    ("wrong", "absolute lever", lambda a, d: d / np.abs(cross(a, d))[:, None], "sign"),
    ("wrong", "sine only", lambda a, d: unit(d) / cross(unit(a), unit(d))[:, None], "length"),
    ("wrong", "unit distal in the row", lambda a, d: unit(d) / cross(a, d)[:, None], "length"),
    ("wrong", "unit distal in the lever", lambda a, d: d / cross(a, unit(d))[:, None], "length"),
    ("wrong", "levers of other arms", lambda a, d: d / np.roll(cross(a, d), 1)[:, None], "order"),
    ("wrong", "rows in reverse", lambda a, d: (d / cross(a, d)[:, None])[::-1], "order"),
    ("wrong", "columns exchanged", lambda a, d: (d / cross(a, d)[:, None])[:, ::-1], "columns"),
    ("wrong", "per millimetre", lambda a, d: d / cross(a, d)[:, None] / 1000, "1000"),
    ("wrong", "degrees", lambda a, d: np.rad2deg(d / cross(a, d)[:, None]), "degrees"),
    ("wrong", "twice", lambda a, d: 2 * d / cross(a, d)[:, None], "twice"),
    ("wrong", "pseudoinverse", lambda a, d: np.linalg.pinv(d / cross(a, d)[:, None]).T, "inverse"),
    ("wrong", "whole arm", lambda a, d: (a + d) / cross(a, d)[:, None], "distal"),
    ("wrong", "zeros", lambda a, d: np.zeros_like(d), "zero"),
    ("wrong", "the levers only", lambda a, d: cross(a, d), "shape"),
    ("close", "three arms only", lambda a, d: (d / cross(a, d)[:, None])[:3]),
    (
        "wrong",
        "x and y swapped in the cross product",
        lambda a, d: d / (a[:, 0] * d[:, 0] - a[:, 1] * d[:, 1])[:, None],
        "",
    ),
]


def edges(A):
    return [np.abs(cross(A, np.broadcast_to(row, A.shape))).sum() / np.linalg.norm(row) for row in A]


def by_directions(count):
    def force(A, torque):
        angle = np.linspace(0, np.pi, count)
        return torque * np.abs(A @ [np.cos(angle), np.sin(angle)]).sum(axis=0).min()

    return force


def by_programs(A, torque):
    """For each direction across a row the largest force, as a linear program."""
    best = []
    for row in A:
        u = np.array([-row[1], row[0]]) / np.linalg.norm(row)
        best.append(-linprog(-(A @ u), bounds=[(-torque, torque)] * len(A)).fun)
    return min(best)


def by_corners(A, torque):
    """The distance of every edge of the package's polygon from zero."""
    corners = rk.force_polygon(A, torque)
    along = np.roll(corners, -1, axis=0) - corners
    return np.min(np.abs(cross(corners, along)) / np.linalg.norm(along, axis=1))


def by_optimizer(A, torque):
    """The worst of all directions by an optimizer at its default tolerance, from a coarse start."""
    reach = lambda t: torque * np.abs(A @ [np.cos(t), np.sin(t)]).sum()  # noqa: E731
    start = min(np.linspace(0, np.pi, 60), key=reach)
    return minimize(lambda t: reach(t[0]), [start], method="Nelder-Mead", tol=1e-4).fun


def by_chance(A, torque):
    angle = np.random.default_rng(0).uniform(0, np.pi, 3000)
    return torque * np.abs(A @ [np.cos(angle), np.sin(angle)]).sum(axis=0).min()


def nearest_corner(A, torque):
    return np.linalg.norm(rk.force_polygon(A, torque), axis=1).min()


def sizes(A):
    return np.linalg.norm(A, axis=1)


def crossed(A):
    return np.array([cross(A, np.broadcast_to(row, A.shape)) for row in A])


FORCES = [
    ("right", "across each row", lambda A, torque: torque * min(edges(A))),
    ("right", "linear programs", by_programs),
    ("right", "edges of the package's polygon", by_corners),
    ("right", "an array of one", lambda A, torque: np.array([torque * min(edges(A))])),
    (
        "right",
        "the support function at the rows' normals",
        lambda A, torque: torque * np.min(np.abs(A @ unit(turned(A)).T).sum(axis=0)),
    ),
    ("close", "360 directions", by_directions(721)),
    ("close", "3000 random directions", by_chance),
    ("close", "optimizer", by_optimizer),
    ("wrong", "largest instead of smallest", lambda A, torque: torque * max(edges(A)), "max"),
    ("wrong", "nearest corner", nearest_corner, "corner"),
    ("wrong", "farthest corner", lambda A, torque: np.linalg.norm(rk.force_polygon(A, torque), axis=1).max(), "corner"),
    ("wrong", "singular value", lambda A, torque: torque * np.linalg.svd(A)[1][-1], "singular value"),
    (
        "wrong",
        "shortest torques",
        lambda A, torque: torque / max(np.linalg.norm(row) for row in np.linalg.pinv(A.T)),
        "other torques",
    ),
    (
        "wrong",
        "singular value and root of m",
        lambda A, torque: torque * np.linalg.svd(A)[1][-1] * np.sqrt(len(A)),
        "singular value",
    ),
    ("wrong", "largest singular value", lambda A, torque: torque * np.linalg.norm(A, 2), "singular value"),
    ("wrong", "weakest drive", lambda A, torque: torque * sizes(A).min(), "weakest"),
    ("wrong", "sum of drives", lambda A, torque: torque * sizes(A).sum(), "added"),
    (
        "wrong",
        "no absolute value",
        lambda A, torque: torque * np.abs(crossed(A).sum(axis=1) / sizes(A)).min(),
        "absolute",
    ),
    (
        "wrong",
        "normal not of unit length",
        lambda A, torque: torque * np.abs(crossed(A)).sum(axis=1).min(),
        "unit length",
    ),
    (
        "wrong",
        "length divided out twice",
        lambda A, torque: torque * np.min(np.abs(crossed(A)).sum(axis=1) / sizes(A) ** 2),
        "twice",
    ),
    (
        "wrong",
        "best drive only",
        lambda A, torque: torque * np.min((np.abs(crossed(A)) / sizes(A)[:, None]).max(axis=1)),
        "add up",
    ),
    ("wrong", "along the rows", lambda A, torque: torque * np.min(np.abs(A @ A.T).sum(axis=1) / sizes(A)), "along"),
    ("wrong", "mean of the edges", lambda A, torque: torque * np.mean(edges(A)), "mean"),
    ("wrong", "torque forgotten", lambda A, torque: min(edges(A)), "torque"),
    ("wrong", "torque squared", lambda A, torque: torque**2 * min(edges(A)), "torque"),
    ("wrong", "from -c to c counted twice", lambda A, torque: 2 * torque * min(edges(A)), "twice"),
    ("wrong", "millinewtons", lambda A, torque: 1000 * torque * min(edges(A)), "1000"),
    ("wrong", "zero", lambda A, torque: 0.0, "zero"),
    ("wrong", "constant", lambda A, torque: 0.4, "depend"),
    ("wrong", "opposite sign", lambda A, torque: -torque * min(edges(A)), "sign"),
    ("wrong", "every edge returned", lambda A, torque: torque * np.array(edges(A)), "shape"),
    ("wrong", "x and y only", lambda A, torque: torque * np.abs(A).sum(axis=0).min(), "directions x and y"),
    ("close", "three drives only", lambda A, torque: torque * min(edges(A[:3]))),
    ("wrong", "no own limit in place of torque", lambda A, torque: torque + min(edges(A)), ""),
]


def kkt(A, f, W, c0):
    m, d = A.shape
    K = np.block([[W, A], [A.T, np.zeros((d, d))]])
    return np.linalg.solve(K, np.concatenate([W @ c0, f]))[:m]


def along_the_line(A, f, W, c0):
    """One solution, and the best step in the null space."""
    c = A @ np.linalg.solve(A.T @ A, f)
    null = np.linalg.svd(A.T)[2][2:].T
    return c + null @ np.linalg.solve(null.T @ W @ null, null.T @ W @ (c0 - c))


def by_root_of_weights(A, f, W, c0):
    L = np.linalg.cholesky(W).T
    step = np.linalg.lstsq(A.T @ np.linalg.inv(L), f - A.T @ c0, rcond=None)[0]
    return c0 + np.linalg.solve(L, step)


def minimized(A, f, W, c0):
    start = A @ np.linalg.solve(A.T @ A, f)
    null = np.linalg.svd(A.T)[2][2:].T
    price = lambda z: (start + null @ z - c0) @ W @ (start + null @ z - c0)  # noqa: E731
    return start + null @ minimize(price, np.zeros(null.shape[1]), method="Nelder-Mead").x


def with_penalty(A, f, W, c0):
    heavy = 1e7
    return np.linalg.solve(W + heavy * A @ A.T, W @ c0 + heavy * A @ f)


def pinv_w(A, W):
    return np.linalg.solve(W, A) @ np.linalg.inv(A.T @ np.linalg.solve(W, A))


def textbook(A, f, W, c0):
    P = pinv_w(A, W)
    return P @ f + (np.eye(len(A)) - P @ A.T) @ c0


def spoiling(A, f, W, c0):
    c = textbook(A, f, W, c0)
    for given in (A, f, W, c0):
        given *= 0.0
    return c


EYE = lambda A: np.eye(len(A))  # noqa: E731
CHOICES = [
    ("right", "(11) typed", textbook),
    ("right", "multipliers", kkt),
    ("right", "along the null space", along_the_line),
    ("right", "root of the weights", by_root_of_weights),
    ("right", "package", lambda A, f, W, c0: rk.weighted_pseudoinverse(A, W) @ f + rk.prestress_projector(A, W) @ c0),
    ("right", "spoils its arguments", spoiling),
    ("right", "a list", lambda A, f, W, c0: textbook(A, f, W, c0).tolist()),
    ("close", "Nelder-Mead on the line", minimized),
    ("close", "penalty", with_penalty),
    ("wrong", "weights forgotten", lambda A, f, W, c0: textbook(A, f, EYE(A), c0), "weights"),
    ("wrong", "weights inverted", lambda A, f, W, c0: textbook(A, f, np.linalg.inv(W), c0), "inverted"),
    ("wrong", "weights squared", lambda A, f, W, c0: textbook(A, f, W @ W, c0), "squared"),
    ("wrong", "diagonal only", lambda A, f, W, c0: textbook(A, f, np.diag(np.diag(W)), c0), "diagonal"),
    ("wrong", "wish forgotten", lambda A, f, W, c0: pinv_w(A, W) @ f, "wish"),
    ("wrong", "pinv", lambda A, f, W, c0: np.linalg.pinv(A.T) @ f, "pinv"),
    ("wrong", "lstsq", lambda A, f, W, c0: np.linalg.lstsq(A.T, f, rcond=None)[0], "pinv"),
    (
        "wrong",
        "the wish alone beside the force",
        lambda A, f, W, c0: np.linalg.solve(np.block([[W, A], [A.T, np.zeros((2, 2))]]), np.r_[c0, f])[: len(c0)],
        "not multiplied by the weights",
    ),
    ("wrong", "wish added whole", lambda A, f, W, c0: pinv_w(A, W) @ f + c0, "projector"),
    ("wrong", "wish added whole, no weights", lambda A, f, W, c0: np.linalg.pinv(A.T) @ f + c0, "and without weights"),
    ("wrong", "sign of the wish", lambda A, f, W, c0: textbook(A, f, W, -c0), "sign"),
    ("wrong", "sign of the force", lambda A, f, W, c0: textbook(A, -f, W, c0), "sign"),
    (
        "wrong",
        "projector without weights",
        lambda A, f, W, c0: pinv_w(A, W) @ f + c0 - A @ np.linalg.pinv(A) @ c0,
        "without the weights",
    ),
    (
        "wrong",
        "force without weights",
        lambda A, f, W, c0: textbook(A, f, W, c0) - pinv_w(A, W) @ f + np.linalg.pinv(A.T) @ f,
        "without the weights",
    ),
    ("wrong", "step only", lambda A, f, W, c0: textbook(A, f, W, c0) - c0, "wish"),
    ("wrong", "prestress only", lambda A, f, W, c0: textbook(A, 0 * f, W, c0), "prestress"),
    ("wrong", "wish itself", lambda A, f, W, c0: c0, "c0"),
    ("wrong", "opposite sign", lambda A, f, W, c0: -textbook(A, f, W, c0), "sign"),
    ("wrong", "mN m", lambda A, f, W, c0: 1e3 * textbook(A, f, W, c0), "1000"),
    ("wrong", "reverse order", lambda A, f, W, c0: textbook(A, f, W, c0)[::-1], "order"),
    ("wrong", "zeros", lambda A, f, W, c0: 0 * c0, "zero"),
    (
        "wrong",
        "the multipliers",
        lambda A, f, W, c0: np.linalg.solve(A.T @ np.linalg.solve(W, A), f - A.T @ c0),
        "shape",
    ),
    ("wrong", "W^-1 c0 projected", lambda A, f, W, c0: textbook(A, f, W, 0 * c0) + np.linalg.solve(W, c0), "wish"),
    ("wrong", "only two drives used", lambda A, f, W, c0: np.r_[np.linalg.solve(A[:2].T, f), np.zeros(len(A) - 2)], ""),
    ("wrong", "right for three drives", lambda A, f, W, c0: textbook(A, f, W, c0) + 0.1 * (len(A) > 3), "four drives"),
]


def equal_pair(mode):
    return [i for i in range(3) if mode[i] * sum(mode) > 0]


def odd(mode):
    return next(i for i in range(3) if mode[i] * sum(mode) < 0)


def middle(mode):
    return ROBOT.base[equal_pair(mode)].mean(axis=0)


def gap(p, mode):
    return rk.distal_cross_products(ROBOT, rk.inverse_kinematics(ROBOT, p, mode))


def darkest(n):
    def point(mode):
        x, y, share = rk.actuation_map(ROBOT, mode=mode, n=n)
        row, column = np.unravel_index(share.argmin(), share.shape)
        return x[column], y[row]

    return point


def by_root(mode):
    return root(lambda p: gap(p, mode)[:2], darkest(60)(mode)).x


def by_minimum(mode):
    return minimize(lambda p: np.sum(gap(p, mode) ** 2), darkest(60)(mode), method="Nelder-Mead", tol=1e-14).x


def by_coarse_minimum(mode):
    return minimize(lambda p: np.sum(gap(p, mode) ** 2), darkest(60)(mode), method="Nelder-Mead").x


POINTS = [
    ("right", "midpoint of the equal arms' bases", middle),
    ("right", "root finder", by_root),
    ("right", "tight minimization", by_minimum),
    ("right", "a list", lambda mode: list(middle(mode))),
    ("close", "darkest node of a fine grid", darkest(400)),
    ("close", "default minimization", by_coarse_minimum),
    ("wrong", "base joint of the odd arm", lambda mode: ROBOT.base[odd(mode)], "folded"),
    ("wrong", "another side", lambda mode: ROBOT.base[[odd(mode), equal_pair(mode)[0]]].mean(axis=0), "another side"),
    ("wrong", "the third side", lambda mode: ROBOT.base[[odd(mode), equal_pair(mode)[1]]].mean(axis=0), "another side"),
    ("wrong", "a base of the equal arms", lambda mode: ROBOT.base[equal_pair(mode)[0]], "base joint"),
    ("wrong", "opposite side", lambda mode: -middle(mode), "sign"),
    ("wrong", "sum of the bases", lambda mode: 2 * middle(mode), ""),
    ("wrong", "half way to the centroid", lambda mode: middle(mode) / 2, "half"),
    ("wrong", "millimetres", lambda mode: 1e3 * middle(mode), "1000"),
    ("wrong", "centroid", lambda mode: np.zeros(2), "zero"),
    ("wrong", "one fixed point", lambda mode: ROBOT.base[:2].mean(axis=0), "depend"),
    ("wrong", "x and y exchanged", lambda mode: middle(mode)[::-1], "order"),
    ("wrong", "no signs", lambda mode: np.abs(middle(mode)), "sign"),
    ("wrong", "joint angles", lambda mode: rk.inverse_kinematics(ROBOT, middle(mode), mode), "shape"),
    ("wrong", "a tuple of three", lambda mode: (*middle(mode), 1.0), "shape"),
    ("wrong", "beside the point", lambda mode: middle(mode) + [0.02, 0.0], "entry 0"),
    ("wrong", "mirrored at y", lambda mode: middle(mode) * [-1, 1], ""),
    ("wrong", "turned by 120 degrees", lambda mode: middle(mode) @ [[-0.5, 0.75**0.5], [-(0.75**0.5), -0.5]], "turned"),
    ("wrong", "NaN", lambda mode: np.full(2, np.nan), "NaN"),
    ("wrong", "a rank", lambda mode: 1, "shape"),
    ("wrong", "where the guaranteed force is largest", lambda mode: 0.7 * ROBOT.base[odd(mode)], ""),
    ("wrong", "crash", lambda mode: mode["+"], "stops"),
]

ANSWERS = {
    "02.control_matrix": ROWS,
    "02.guaranteed_force": FORCES,
    "02.best_torques": CHOICES,
    "02.input_singularity": POINTS,
}
