"""Answers to the exercises of lesson 10, as students would give them."""

import numpy as np
from scipy.optimize import least_squares

import rapkm_lite as rk
from rapkm_lite.lessons.lesson10 import tasks


def by_projection(robot, model, x, K_P):
    n = robot.n_arms
    wanted, here = (rk.inverse_kinematics(one, x)[:n] for one in (model, robot))
    A = rk.control_matrix(robot, rk.inverse_kinematics(robot, x))
    return K_P * rk.prestress_projector(A) @ (wanted - here)


def by_gauss_newton(robot, model, x, K_P):
    wanted, x = rk.inverse_kinematics(model, x)[: model.n_arms], np.array(x)
    for _ in range(8):
        q = rk.inverse_kinematics(robot, x)
        x = x + np.linalg.pinv(rk.control_matrix(robot, q)) @ (wanted - q[: robot.n_arms])
    return list(K_P * (wanted - rk.inverse_kinematics(robot, x)[: robot.n_arms]))


def three_only(robot, model, x, K_P):
    wanted = rk.inverse_kinematics(model, x)[:3]
    n = rk.null_vector(robot, rk.inverse_kinematics(robot, x))
    return K_P * n * (n @ (wanted - rk.inverse_kinematics(robot, x)[:3]))


def by_a_solver(robot, model, x, K_P):
    """The place where the drives agree best, to 1e-9 rad."""
    wanted = rk.inverse_kinematics(model, x)[: model.n_arms]
    gap = least_squares(lambda y: rk.inverse_kinematics(robot, y)[: robot.n_arms] - wanted, x)
    return K_P * (wanted - rk.inverse_kinematics(robot, gap.x)[: robot.n_arms])


def by_simulation(robot, model, x, K_P, duration=6.0):
    """What PD drives hold some seconds after they were told to go there, in steps of 1 ms."""
    wanted = rk.inverse_kinematics(model, x)[: model.n_arms]
    path = rk.hold(robot, x, duration)
    told = path.with_set_points(np.tile(wanted, (len(path), 1)))
    damping = 0.225 * np.sqrt(K_P / 7.05)
    return rk.simulate(robot.replace(friction=0.0), rk.PD(K_P, damping), told).c[-1]


def scaled(factor):
    return lambda robot, model, x, K_P: factor * tasks.geometry_fight(robot, model, x, K_P)


def shares(A):
    return np.sqrt(np.diag(A @ np.linalg.inv(A.T @ A) @ np.linalg.inv(A.T @ A) @ A.T))


def row_by_row(A, fight, limit):
    G = np.linalg.pinv(A).T
    return min((limit - abs(c)) / np.hypot(*g) for c, g in zip(fight, G, strict=True))


def of_one_drive(i, A, fight, limit):
    return (limit - abs(fight[i])) / shares(A)[i]


def around(steps):
    def force(A, fight, limit):
        turn = np.linspace(0, 2 * np.pi, steps)
        share = np.linalg.pinv(A).T @ np.stack([np.cos(turn), np.sin(turn)])
        return np.min((limit - np.abs(fight))[:, None] / np.abs(share))

    return force


def law(make):
    return lambda drawing: make


def with_feed_forward(drawing):
    def command(t, q_a, qd_a, desired):
        R = rk.antagonism_filter(rk.control_matrix(drawing, desired.q))
        ahead = rk.inverse_dynamics(drawing, desired.q, desired.qd, desired.qdd)
        return ahead - R @ (19.0 * (q_a - desired.q_a) + 0.55 * (qd_a - desired.qd_a))

    return command


ANSWERS = {
    "10.geometry_fight": [
        ("right", "reference", tasks.geometry_fight),
        ("right", "by simulation", by_simulation),
        ("right", "Gauss-Newton by hand, a list", by_gauss_newton),
        (
            "right",
            "angles from the other side",
            lambda r, m, x, K: (
                -K
                * (
                    rk.estimate_pose(r, rk.inverse_kinematics(m, x)[: m.n_arms], x)[: r.n_arms]
                    - rk.inverse_kinematics(m, x)[: m.n_arms]
                )
            ),
        ),
        ("close", "first order, projector at x", by_projection, "instead of a first-order step"),
        ("close", "not yet at rest", lambda *case: by_simulation(*case, 1.0), "more time to come to rest"),
        ("close", "the null vector of three arms", three_only),
        ("right", "a solver that stops early", by_a_solver),
        ("wrong", "sign", scaled(-1), "opposite sign"),
        ("wrong", "half", scaled(0.5), "factor"),
        ("wrong", "mN m", scaled(1e3), "1000"),
        ("wrong", "degrees", scaled(180 / np.pi), "180"),
        ("wrong", "machines exchanged", lambda r, m, x, K: tasks.geometry_fight(m, r, x, K), "changed places"),
        ("wrong", "first order, sign turned", lambda *case: -by_projection(*case), "the sign is turned"),
        ("wrong", "no gain", lambda r, m, x, K: tasks.geometry_fight(r, m, x, 1.0), "K_P"),
        (
            "wrong",
            "unprojected",
            lambda r, m, x, K: K * (rk.inverse_kinematics(m, x)[: m.n_arms] - rk.inverse_kinematics(r, x)[: r.n_arms]),
            "projected",
        ),
        (
            "wrong",
            "the part that shifts",
            lambda r, m, x, K: tasks.first_order(r, m, x, K, rk.antagonism_filter),
            "complement",
        ),
        ("wrong", "size", lambda r, m, x, K: np.linalg.norm(tasks.geometry_fight(r, m, x, K)), "size"),
        ("wrong", "angles times gain", lambda r, m, x, K: K * rk.inverse_kinematics(m, x)[: m.n_arms], "pose"),
        ("wrong", "nothing", lambda r, m, x, K: np.zeros(r.n_arms), "zero"),
    ],
    "10.force_left": [
        ("right", "reference", tasks.force_left),
        ("right", "row by row", row_by_row),
        ("right", "roots of a diagonal", lambda A, c, top: np.min((top - abs(c)) / shares(A))),
        ("close", "a circle of 100 directions", around(100)),
        ("wrong", "four directions", around(5), "along x and y"),
        ("wrong", "no fight", lambda A, c, top: np.min(top / shares(A)), "fight is left out"),
        ("wrong", "max for min", lambda A, c, top: np.max((top - abs(c)) / shares(A)), "max for min"),
        ("wrong", "fight with its sign", lambda A, c, top: np.min((top - c) / shares(A)), "absolute"),
        ("wrong", "fight added", lambda A, c, top: np.min((top + abs(c)) / shares(A)), "sign"),
        ("wrong", "norm of the fight", lambda A, c, top: np.min((top - np.linalg.norm(c)) / shares(A)), "norm"),
        ("wrong", "rows of A", lambda A, c, top: np.min((top - abs(c)) / np.linalg.norm(A, axis=1)), "inverse"),
        ("wrong", "times rows of A", lambda A, c, top: np.min((top - abs(c)) * np.linalg.norm(A, axis=1)), "alone"),
        ("wrong", "worst of both", lambda A, c, top: (top - abs(c).max()) / shares(A).max(), "two drives"),
        ("wrong", "one for each drive", lambda A, c, top: (top - abs(c)) / shares(A), "smallest"),
        ("wrong", "the largest share", lambda *case: of_one_drive(shares(case[0]).argmax(), *case), "right in"),
        ("wrong", "drive of the largest fight", lambda *case: of_one_drive(abs(case[1]).argmax(), *case), "right in"),
        ("wrong", "mN", lambda A, c, top: 1e3 * tasks.force_left(A, c, top), "1000"),
        ("wrong", "minus", lambda A, c, top: -tasks.force_left(A, c, top), "sign"),
        ("wrong", "zero", lambda A, c, top: 0.0, "zero"),
    ],
    "10.spare_law": [
        ("right", "filter, a middle gain, more damping", tasks.spare_law),
        (
            "wrong",
            "true pose",
            lambda drawing: rk.AntagonismFilter(rk.CommandFilter(rk.PD(19.0, 0.55), pose="true")),
            "true pose",
        ),
        ("right", "with critical damping", law(rk.AntagonismFilter(rk.PD(21.0, 0.39)))),
        ("right", "feed-forward and filtered feedback", with_feed_forward),
        ("right", "command form", law(rk.CommandFilter(rk.PD(20.0, 0.6)))),
        ("right", "bare drives, strongly damped", law(rk.PD(4.5, 2.2))),
        ("wrong", "pushes away", law(lambda t, q, qd, d: 50.0 * (q - d.q_a)), "lost"),
        ("wrong", "the gains of the lessons", law(rk.AntagonismFilter(rk.PD(7.05, 0.225))), "gain"),
        ("wrong", "PD of the lessons", law(rk.PD(7.05, 0.225)), "fight"),
        ("wrong", "stiff PD", law(rk.PD(19.0, 0.55)), "fight"),
        ("wrong", "far too stiff", law(rk.AntagonismFilter(rk.PD(60.0, 1.0))), "ripple"),
        ("wrong", "no damping", law(rk.AntagonismFilter(rk.PD(19.0, 0.001))), ""),
        ("wrong", "gains instead of a law", law((19.0, 0.55)), "law"),
        ("wrong", "no torques", law(lambda t, q_a, qd_a, desired: np.zeros(3)), ""),
    ],
}
