"""Answers to the exercises of lesson 08, as students would give them."""

import numpy as np
from scipy.optimize import least_squares

import rapkm_lite as rk
from rapkm_lite.lessons.lesson08 import tasks


def by_the_package(robot, q_a, guess):
    return rk.calibrate(robot, q_a).offset


def by_a_search(robot, q_a, guess):
    def left(offset):
        return (q_a - offset - rk.estimate_pose(robot, q_a - offset, guess)[:, : robot.n_arms]).ravel()

    return least_squares(left, np.zeros(robot.n_arms), xtol=1e-15, ftol=1e-15, gtol=1e-15).x


def by_projectors(robot, q_a, guess):
    N, offset = robot.n_arms, np.zeros(robot.n_arms)
    for _ in range(6):
        q = rk.estimate_pose(robot, q_a - offset, guess)
        P = rk.prestress_projector(rk.control_matrix(robot, q))
        offset = np.linalg.pinv(P.reshape(-1, N)) @ np.einsum("kij,kj->ki", P, q_a - q[:, :N]).ravel()
    return list(offset)


def three_drives(robot, q_a, guess, steps=8):
    offset = np.zeros(3)
    for _ in range(steps):
        q = rk.estimate_pose(robot, q_a - offset, guess)
        n = rk.null_vector(robot, q)
        offset = np.linalg.lstsq(n, np.sum(n * (q_a - q[:, :3]), axis=1), rcond=None)[0]
    return offset


def one_step(robot, q_a, guess):
    rows, gap = tasks.equations(robot, q_a, 0.0, guess)
    return np.linalg.pinv(rows.reshape(-1, robot.n_arms)) @ gap.ravel()


def overwritten(robot, q_a, guess, steps=6):
    """Each step from the corrected readings takes the place of the one before."""
    offset = np.zeros(robot.n_arms)
    for _ in range(steps):
        offset = one_step(robot, q_a - offset, guess)
    return offset


def scaled(factor):
    return lambda robot, q_a, guess: factor * tasks.self_calibrate(robot, q_a, guess)


def corners(angle, radius=0.12, duration=4.0):
    return lambda robot: rk.polygon(robot, tasks.ring(np.asarray(angle), radius), duration)


def wider_than_its_path(robot):
    """Set-points that swing out to 150 mm, on a path of 115 mm."""
    path = rk.circle(robot, 0.115, 4.0)
    wide = path.x * (1 + 35 / 115 * np.sin(np.pi * path.t / 4)[:, None] ** 4)
    return path.with_set_points(np.unwrap(rk.inverse_kinematics(robot, wide)[:, :3], axis=0))


def fixed(places):
    return lambda robot: places


PAIRS = np.array([55, 65, 175, 185, 295, 305])

COUNTS = [
    ("right", "formula", lambda K_P, friction: np.pi * K_P / friction),
    ("right", "through the quantum", lambda K_P, friction: 2 * np.pi / (2 * friction / K_P)),
    ("close", "rounded up", lambda K_P, friction: np.ceil(np.pi * K_P / friction)),
    (
        "close",
        "searched one by one",
        lambda K_P, friction: next(n for n in range(1, 10**6) if K_P * 2 * np.pi / n <= 2 * friction),
    ),
    ("close", "pi of 3.14", lambda K_P, friction: 3.14 * K_P / friction),
    ("wrong", "half the band", lambda K_P, friction: 2 * np.pi * K_P / friction, "factor of 2"),
    ("wrong", "band twice", lambda K_P, friction: np.pi * K_P / friction / 2, "half"),
    ("wrong", "degrees", lambda K_P, friction: 180 * K_P / friction, "degrees"),
    ("wrong", "reciprocal", lambda K_P, friction: friction / (np.pi * K_P), "reciprocal"),
    ("wrong", "largest step", lambda K_P, friction: 2 * friction / K_P, "step"),
    ("wrong", "per radian", lambda K_P, friction: K_P / (2 * friction), "2 pi"),
    ("wrong", "lines", lambda K_P, friction: np.pi * K_P / friction / 4, "factor of 4"),
    ("wrong", "exchanged", lambda K_P, friction: np.pi * friction / K_P, "changed places"),
    ("wrong", "fixed", lambda K_P, friction: 2000.0, "depend"),
    ("wrong", "of the testbed", lambda K_P, friction: np.pi * K_P / 4.2e-3, "friction"),
    ("wrong", "nominal gain", lambda K_P, friction: np.pi * 7.05 / friction, "K_P"),
    ("wrong", "gain forgotten", lambda K_P, friction: np.pi / friction, "K_P"),
    ("wrong", "opposite sign", lambda K_P, friction: -np.pi * K_P / friction, "sign"),
    ("wrong", "zero", lambda K_P, friction: 0, "zero"),
    ("wrong", "multiplied", lambda K_P, friction: np.pi * K_P * friction, "friction"),
    ("wrong", "squared", lambda K_P, friction: np.pi * K_P**2 / friction, "K_P"),
    ("wrong", "text", lambda K_P, friction: "5273", "numeric"),
]

ANSWERS = {
    "08.self_calibrate": [
        ("wrong", "corrected the wrong way", tasks.corrected_the_wrong_way, "the wrong way"),
        ("right", "reference", tasks.self_calibrate),
        ("right", "the package", by_the_package),
        ("right", "a search", by_a_search),
        ("right", "projectors, a list", by_projectors),
        ("close", "three drives only", three_drives),
        ("close", "one step", one_step),
        ("close", "two steps", lambda r, q, g: three_drives(r, q, g, 2)),
        ("wrong", "the last correction", overwritten, "offset += step"),
        ("wrong", "sign", scaled(-1), "sign"),
        ("wrong", "half", scaled(0.5), "factor"),
        ("wrong", "mrad", scaled(1e3), "1000"),
        ("wrong", "degrees", scaled(180 / np.pi), "180"),
        ("wrong", "mean of what is left", lambda r, q, g: tasks.left_over(r, q, g).mean(axis=0), "averaged"),
        ("wrong", "sum of what is left", lambda r, q, g: tasks.left_over(r, q, g).sum(axis=0), "added"),
        (
            "wrong",
            "the guess is the place",
            lambda r, q, g: np.mean(q - rk.inverse_kinematics(r, g)[:, : r.n_arms], axis=0),
            "guess",
        ),
        ("wrong", "first place, smallest offsets", tasks.of_one_place, "first place"),
        ("wrong", "gaps", lambda r, q, g: tasks.equations(r, q, 0.0, g)[1].ravel(), "gaps"),
        ("wrong", "what is left", tasks.left_over, ""),
        ("wrong", "nothing", lambda r, q, g: np.zeros(r.n_arms), "zero"),
    ],
    "08.places": [
        ("right", "reference", tasks.best_places),
        ("right", "a list", fixed((np.round(tasks.ring(PAIRS + 1.5, 0.119), 4)).tolist())),
        ("wrong", "hexagon", fixed(tasks.ring(60 * np.arange(6), 0.12)), "evenly"),
        # Its two triangles tell the offsets equally well, conditions 1.85 and 2.15; together they miss the limit.
        ("wrong", "turned hexagon", fixed(tasks.ring(60 * np.arange(6) + 30, 0.12)), "however they are turned"),
        ("wrong", "evenly on a part of a circle", fixed(tasks.ring(20 * np.arange(6), 0.12)), "condition"),
        ("wrong", "the other triangle", fixed(tasks.ring(PAIRS - 60, 0.12)), "condition"),
        ("wrong", "near the middle", fixed(tasks.ring(PAIRS, 0.07)), "condition"),
        ("wrong", "three places twice", fixed(tasks.ring([60, 60, 180, 180, 300, 300], 0.12)), "nearest two places"),
        ("wrong", "too far out", fixed(tasks.ring(PAIRS, 0.14)), "farthest"),
        ("wrong", "in mm", fixed(1e3 * tasks.ring(PAIRS, 0.12)), "mm"),
        ("wrong", "in cm", fixed(1e2 * tasks.ring(PAIRS, 0.12)), "given in m"),
        ("wrong", "out of reach", fixed(tasks.ring(PAIRS, 0.3)), "outside the workspace"),
        ("wrong", "three places", fixed(tasks.ring([60, 180, 300], 0.12)), "shape"),
        ("wrong", "on a line", fixed(np.column_stack([np.linspace(-0.1, 0.1, 6), np.zeros(6)])), "condition"),
        ("wrong", "transposed", fixed(tasks.ring(PAIRS, 0.12).T), "transposed"),
    ],
    "08.calibration_drive": [
        ("right", "reference", tasks.calibration_drive),
        (
            "right",
            "a star",
            lambda r: rk.polygon(r, np.insert(tasks.ring([60, 180, 300], 0.12), [0, 1, 2], 0, axis=0), 4.0),
        ),
        ("right", "between pairs of places", corners(PAIRS)),
        ("wrong", "stays where it is", lambda robot: rk.hold(robot, [0.1, 0.0], 4.0), "1 of 3"),
        ("wrong", "small circle", lambda robot: rk.circle(robot, 0.04, 4.0), "error"),
        ("wrong", "ten turns of a small circle", lambda robot: rk.circle(robot, 0.04, 4.0, turns=10), "torque"),
        ("wrong", "the course's triangle", lambda robot: rk.triangle(robot), "duration"),
        ("wrong", "too far out", lambda robot: rk.triangle(robot, duration=4.0), "farthest"),
        ("wrong", "set-points of a wider circle", wider_than_its_path, "farthest"),
        ("wrong", "too fast", lambda robot: rk.circle(robot, 0.12, 4.0, turns=4), "torque"),
        ("wrong", "corners instead of a path", lambda robot: tasks.ring([60, 180, 300], 0.12), "of type ndarray"),
        ("wrong", "in mm", lambda robot: rk.circle(robot, 120.0, 4.0), ""),
        ("wrong", "the path itself", rk.circle(rk.load(), 0.12, 4.0), "function"),
    ],
    "08.counts": COUNTS,
}
