"""Answers to lesson 01: loop gaps, all velocities from two, accelerations without multipliers, forces in the pin."""

import numpy as np
from scipy.linalg import null_space
from scipy.optimize import least_squares

import rapkm_lite as rk


def way(angle):
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def parts(robot, q):
    """Base points, lengths as columns, base and elbow angles."""
    l1, l2 = robot.lengths[:, :1], robot.lengths[:, 1:]
    return robot.base, l1, l2, q[: robot.n_arms], q[robot.n_arms :]


def tips(robot, q):
    b, l1, l2, base, elbow = parts(robot, q)
    return b + l1 * way(base) + l2 * way(base + elbow)


def gaps(robot, q):
    p = tips(robot, q)
    return (np.delete(p, 1, axis=0) - p[1]).ravel()


def from_tips(change):
    """Gaps from tips that `change` computes from base points, lengths and angles."""

    def answer(robot, q):
        p = change(*parts(robot, q))
        return (np.delete(p, 1, axis=0) - p[1]).ravel()

    return answer


def loop(robot, q):
    """With loops and lists, as a beginner writes it."""
    N, p = robot.n_arms, []
    for i in range(N):
        l1, l2 = robot.lengths[i]
        x = robot.base[i][0] + l1 * np.cos(q[i]) + l2 * np.cos(q[i] + q[i + N])
        y = robot.base[i][1] + l1 * np.sin(q[i]) + l2 * np.sin(q[i] + q[i + N])
        p.append((x, y))
    h = []
    for i in range(N):
        if i != 1:
            h += [p[i][0] - p[1][0], p[i][1] - p[1][1]]
    return h


def in_complex_numbers(robot, q):
    b = robot.base @ [1, 1j]
    N = robot.n_arms
    z = b + robot.lengths[:, 0] * np.exp(1j * q[:N]) + robot.lengths[:, 1] * np.exp(1j * (q[:N] + q[N:]))
    d = np.delete(z, 1) - z[1]
    return np.column_stack([d.real, d.imag]).ravel()


def in_place(robot, q):
    q[robot.n_arms :] += q[: robot.n_arms]
    p = robot.base + robot.lengths[:, :1] * way(q[: robot.n_arms])
    p += robot.lengths[:, 1:] * way(q[robot.n_arms :])
    p -= p[1].copy()
    return np.delete(p, 1, axis=0).ravel()


def three_arms(robot, q):
    p = tips(robot, q)
    return np.concatenate([p[0] - p[1], p[2] - p[1]])


GAPS = [
    ("right", "tips, then differences", gaps),
    ("right", "loops and lists", loop),
    ("right", "complex numbers", in_complex_numbers),
    ("right", "in place", in_place),
    ("right", "the package", rk.loop_constraints),
    (
        "right",
        "a selection matrix",
        lambda robot, q: np.ravel(
            (np.eye(robot.n_arms) - np.eye(robot.n_arms)[1])[[i for i in range(robot.n_arms) if i != 1]]
            @ tips(robot, q)
        ),
    ),
    ("close", "rounded to a hundredth of a millimetre", lambda robot, q: np.round(gaps(robot, q), 5)),
    ("close", "single precision", lambda robot, q: gaps(robot, q).astype(np.float32)),
    ("close", "single precision on the way", lambda robot, q: gaps(robot, np.float32(q))),
    (
        "wrong",
        "elbow angle absolute",
        from_tips(lambda b, l1, l2, u, v: b + l1 * way(u) + l2 * way(v)),
        "base angle is missing",
    ),
    ("wrong", "elbow angle backwards", from_tips(lambda b, l1, l2, u, v: b + l1 * way(u) + l2 * way(u - v)), "sign"),
    ("wrong", "elbow minus base", from_tips(lambda b, l1, l2, u, v: b + l1 * way(u) + l2 * way(v - u)), ""),
    ("wrong", "elbows only", from_tips(lambda b, l1, l2, u, v: b + l1 * way(u)), "distal links are missing"),
    (
        "wrong",
        "distal links only",
        from_tips(lambda b, l1, l2, u, v: b + l2 * way(u + v)),
        "proximal links are missing",
    ),
    ("wrong", "no base points", from_tips(lambda b, l1, l2, u, v: l1 * way(u) + l2 * way(u + v)), "base points"),
    ("wrong", "links exchanged", from_tips(lambda b, l1, l2, u, v: b + l2 * way(u) + l1 * way(u + v)), "exchanged"),
    (
        "wrong",
        "one length",
        from_tips(lambda b, l1, l2, u, v: b + l1 * (way(u) + way(u + v))),
        "length of the proximal one",
    ),
    ("wrong", "0.2 m written in", from_tips(lambda b, l1, l2, u, v: b + 0.2 * (way(u) + way(u + v))), "right in"),
    (
        "wrong",
        "first arm's lengths",
        from_tips(lambda b, l1, l2, u, v: b + l1[0] * way(u) + l2[0] * way(u + v)),
        "first",
    ),
    (
        "wrong",
        "sine first",
        from_tips(lambda b, l1, l2, u, v: b + l1 * way(u)[:, ::-1] + l2 * way(u + v)[:, ::-1]),
        "sine and cosine",
    ),
    (
        "wrong",
        "degrees",
        from_tips(lambda b, l1, l2, u, v: b + l1 * way(np.rad2deg(u)) + l2 * way(np.rad2deg(u + v))),
        "turned into degrees first",
    ),
    (
        "wrong",
        "degrees the other way",
        from_tips(lambda b, l1, l2, u, v: b + l1 * way(np.deg2rad(u)) + l2 * way(np.deg2rad(u + v))),
        "taken for degrees",
    ),
    ("wrong", "opposite", lambda robot, q: -gaps(robot, q), "sign"),
    ("wrong", "in mm", lambda robot, q: 1e3 * gaps(robot, q), "1000"),
    ("wrong", "from arm 1", lambda robot, q: (tips(robot, q)[1:] - tips(robot, q)[0]).ravel(), "arm 1"),
    ("wrong", "from arm 3", lambda robot, q: (np.delete(p := tips(robot, q), 2, axis=0) - p[2]).ravel(), "arm 3"),
    ("wrong", "zero row kept", lambda robot, q: (tips(robot, q) - tips(robot, q)[1]).ravel(), "itself"),
    ("wrong", "neighbours", lambda robot, q: np.diff(tips(robot, q), axis=0).ravel(), "next"),
    ("wrong", "neighbours backwards", lambda robot, q: -np.diff(tips(robot, q), axis=0).ravel(), "next"),
    ("wrong", "all x first", lambda robot, q: gaps(robot, q).reshape(-1, 2).T.ravel(), "all x before all y"),
    ("wrong", "an array of gaps", lambda robot, q: gaps(robot, q).reshape(-1, 2), "shape"),
    ("wrong", "lengths of the gaps", lambda robot, q: np.linalg.norm(gaps(robot, q).reshape(-1, 2), axis=1), "lengths"),
    ("wrong", "three arms only", three_arms, "arms 1 and 3"),
    ("wrong", "added", lambda robot, q: np.ravel(np.delete(tips(robot, q), 1, axis=0) + tips(robot, q)[1]), "added"),
    ("wrong", "tips", lambda robot, q: tips(robot, q).ravel(), "tips"),
    (
        "wrong",
        "joints in turn",
        lambda robot, q: gaps(robot, np.concatenate([q[::2], q[1::2]])),
        "all base joints come first",
    ),
    ("wrong", "the Jacobian", lambda robot, q: rk.constraint_jacobian(robot, q), "shape"),
    ("wrong", "closed first", lambda robot, q: gaps(robot, rk.close_loops(robot, q)), "open loops"),
    ("wrong", "absolute", lambda robot, q: np.abs(gaps(robot, q)), "absolute"),
    ("wrong", "nothing", lambda robot, q: np.zeros(2 * robot.n_arms - 2), "zero"),
]


def split(robot, q, independent):
    J = rk.constraint_jacobian(robot, q)
    dependent = [j for j in range(robot.n_joints) if j not in independent]
    return dependent, J[:, dependent], J[:, independent]


def placed(block):
    def answer(robot, q, independent):
        dependent, J1, J2 = split(robot, q, independent)
        F = np.zeros((robot.n_joints, 2))
        for column, joint in enumerate(independent):
            F[joint, column] = 1.0
        F[dependent] = block(J1, J2)
        return F

    return answer


complement = placed(lambda J1, J2: -np.linalg.inv(J1) @ J2)


def from_null_space(robot, q, independent):
    B = null_space(rk.constraint_jacobian(robot, q))
    return B @ np.linalg.inv(B[independent])


def from_projector(robot, q, independent):
    N = rk.nullspace_projector(robot, q)[:, [0, 1]]
    return N @ np.linalg.pinv(N[independent])


def column_by_column(robot, q, independent):
    J, F = rk.constraint_jacobian(robot, q), []
    rest = [j for j in range(robot.n_joints) if j not in independent]
    for joint in independent:
        column = [0.0] * robot.n_joints
        column[joint] = 1.0
        for j, value in zip(rest, np.linalg.lstsq(J[:, rest], -J[:, joint], rcond=None)[0], strict=True):
            column[j] = value
        F.append(column)
    return np.transpose(F).tolist()


def by_differences(robot, q, independent, step=1e-6):
    """Turn one independent joint a little, hold the other, and close the loops with the rest."""
    rest, J1, _ = split(robot, q, independent)
    F = np.zeros((robot.n_joints, 2))
    for k, joint in enumerate(independent):
        moved = q.copy()
        moved[joint] += step
        for _ in range(5):
            J = rk.constraint_jacobian(robot, moved)[:, rest]
            moved[rest] -= np.linalg.solve(J, rk.loop_constraints(robot, moved))
        F[:, k] = (moved - q) / step
    return F


def stacked(robot, q, independent):
    _, J1, J2 = split(robot, q, independent)
    return np.vstack([-np.linalg.solve(J1, J2), np.eye(2)])


COMPLEMENTS = [
    ("right", "inverse", complement),
    ("right", "solve", placed(lambda J1, J2: np.linalg.solve(J1, -J2))),
    ("right", "pseudoinverse", placed(lambda J1, J2: -np.linalg.pinv(J1) @ J2)),
    ("right", "basis of the null space, normalized", from_null_space),
    ("right", "two columns of the projector, normalized", from_projector),
    ("right", "column by column, lists", column_by_column),
    ("right", "the package", rk.orthogonal_complement),
    ("close", "differences of closed poses", by_differences),
    ("close", "single precision", lambda robot, q, independent: np.float32(complement(robot, q, independent))),
    ("wrong", "rows as in the chapter", stacked, "as in the chapter"),
    ("wrong", "independent on top", lambda *case: np.roll(stacked(*case), 2, axis=0), "the independent joints on top"),
    ("wrong", "sign of the dependent rows", placed(lambda J1, J2: np.linalg.solve(J1, J2)), "sign"),
    ("wrong", "all signs", lambda *case: -complement(*case), "sign"),
    (
        "wrong",
        "minus the identity",
        lambda robot, q, pair: (
            np.where(np.isin(np.arange(robot.n_joints), pair)[:, None], -1, 1) * complement(robot, q, pair)
        ),
        "the identity in the rows of the independent joints has the opposite sign",
    ),
    ("wrong", "not inverted", placed(lambda J1, J2: -J1 @ J2), "inverse"),
    ("wrong", "transposed for inverted", placed(lambda J1, J2: -J1.T @ J2), "where it should be inverted"),
    ("wrong", "transposed and inverted", placed(lambda J1, J2: -np.linalg.inv(J1.T) @ J2), "J_1 is transposed;"),
    ("wrong", "J_1 forgotten", placed(lambda J1, J2: -J2), "dependent rows are -J_2"),
    ("wrong", "dependent rows zero", placed(lambda J1, J2: 0 * J2), "the dependent ones are missing"),
    (
        "wrong",
        "dependent block only",
        lambda robot, q, pair: stacked(robot, q, pair)[:-2],
        "only the dependent rows are given",
    ),
    (
        "wrong",
        "independent rows zero",
        lambda robot, q, pair: np.where(
            np.isin(np.arange(robot.n_joints), pair)[:, None], 0.0, complement(robot, q, pair)
        ),
        "they are zero",
    ),
    ("wrong", "transposed", lambda *case: complement(*case).T, "transposed"),
    ("wrong", "pair sorted", lambda robot, q, pair: complement(robot, q, sorted(pair)), "where it is not sorted"),
    ("wrong", "columns exchanged", lambda *case: complement(*case)[:, ::-1], "columns stand in another order"),
    ("wrong", "always drives 1 and 2", lambda robot, q, pair: complement(robot, q, [0, 1]), "not used"),
    ("wrong", "basis of the null space", lambda robot, q, pair: null_space(rk.constraint_jacobian(robot, q)), "basis"),
    (
        "wrong",
        "columns of the projector",
        lambda robot, q, pair: rk.nullspace_projector(robot, q)[:, pair],
        "two columns of the projector",
    ),
    ("wrong", "the projector", lambda robot, q, pair: rk.nullspace_projector(robot, q), "this is the projector"),
    (
        "wrong",
        "counted from one",
        lambda robot, q, pair: complement(robot, q, [(j - 1) % robot.n_joints for j in pair]),
        "from 1",
    ),
    (
        "wrong",
        "normalized columns",
        lambda *case: complement(*case) / np.linalg.norm(complement(*case), axis=0),
        "unit length",
    ),
    ("wrong", "six rows", lambda robot, q, pair: complement(robot, q, pair)[:6], "shape"),
    ("wrong", "the rows of the drives", lambda robot, q, pair: complement(robot, q, pair)[: robot.n_arms], "shape"),
    ("wrong", "in degrees", lambda *case: np.rad2deg(complement(*case)), "degrees"),
    ("wrong", "the Jacobian", lambda robot, q, pair: rk.constraint_jacobian(robot, q)[:, pair], "shape"),
    ("wrong", "damped", placed(lambda J1, J2: -np.linalg.solve(J1.T @ J1 + 1e-3 * np.eye(len(J1)), J1.T @ J2)), ""),
    (
        "wrong",
        "a cut-off that is too large",
        placed(lambda J1, J2: -np.linalg.pinv(J1, rcond=1e-2) @ J2),
        "singularity",
    ),
]


def tree(robot, q, qd):
    return rk.mass_matrix(robot, q), rk.coriolis_matrix(robot, q, qd), rk.generalized_forces(robot, q, qd)


def projected(gf=1.0, cor=1.0, q_bar=1.0, back=1.0, joints=True, sign=1.0):
    def answer(robot, q, qd, c, independent):
        F, Fd = complement(robot, q, independent), rk.orthogonal_complement_dot(robot, q, qd, independent)
        G, C, Q = tree(robot, q, qd)
        v = qd[independent]
        Cbar = F.T @ (cor * C @ F + gf * G @ Fd)
        a = np.linalg.solve(F.T @ G @ F, F[: robot.n_arms].T @ c - sign * (Cbar @ v + q_bar * F.T @ Q))
        return F @ a + back * Fd @ v if joints else a

    return answer


def with_multipliers(robot, q, qd, c, independent):
    """(2) and J qdd + Jdot qd = 0 in one system."""
    (G, C, Q), J = tree(robot, q, qd), rk.constraint_jacobian(robot, q)
    u = np.r_[c, np.zeros(robot.n_arms)]
    KKT = np.block([[G, J.T], [J, np.zeros((len(J), len(J)))]])
    right = np.r_[u - C @ qd - Q, -rk.constraint_jacobian_dot(robot, q, qd) @ qd]
    return np.linalg.solve(KKT, right)[: robot.n_joints]


def not_curved(robot, q, qd, c, independent):
    (G, C, Q), J = tree(robot, q, qd), rk.constraint_jacobian(robot, q)
    u = np.r_[c, np.zeros(robot.n_arms)]
    KKT = np.block([[G, J.T], [J, np.zeros((len(J), len(J)))]])
    return np.linalg.solve(KKT, np.r_[u - C @ qd - Q, np.zeros(len(J))])[: robot.n_joints]


def in_redundant_coordinates(robot, q, qd, c, independent):
    (G, C, Q), N = tree(robot, q, qd), rk.nullspace_projector(robot, q)
    u = np.r_[c, np.zeros(robot.n_arms)]
    J = rk.constraint_jacobian(robot, q)
    along = np.vstack([N @ G, J])
    return np.linalg.lstsq(along, np.r_[N @ (u - C @ qd - Q), -rk.constraint_jacobian_dot(robot, q, qd) @ qd])[0]


def difference_of_F(robot, q, qd, c, independent, step=1e-5):
    F = complement(robot, q, independent)
    Fd = (complement(robot, q + step * qd, independent) - F) / step
    G, C, Q = tree(robot, q, qd)
    v = qd[independent]
    a = np.linalg.solve(F.T @ G @ F, F[: robot.n_arms].T @ c - F.T @ (C @ qd + G @ Fd @ v + Q))
    return F @ a + Fd @ v


def in_steps(robot, q, qd, c, independent):
    """In place, with lists."""
    F, Fd = complement(robot, q, independent), rk.orthogonal_complement_dot(robot, q, qd, independent)
    G, C, Q = tree(robot, q, qd)
    qd_2 = qd[independent]
    qd *= 0.0
    qd += F @ qd_2
    Q += C @ qd
    Q += G @ (Fd @ qd_2)
    Q[: robot.n_arms] -= c
    return list(F @ np.linalg.inv(F.T @ G @ F) @ (-F.T @ Q) + Fd @ qd_2)


def in_coordinates(drives, motion):
    """(6) with A and the equations of motion in coordinates of whatever is given, None the end-effector."""

    def answer(robot, q, qd, c, pair):
        A = rk.control_matrix(robot, q, drives and pair)
        G, C, Q = rk.minimal_dynamics(robot, q, qd, motion and pair)
        back = rk.orthogonal_complement_dot(robot, q, qd, pair) @ qd[pair]
        return rk.orthogonal_complement(robot, q, pair) @ np.linalg.solve(G, A.T @ c - C @ qd[pair] - Q) + back

    return answer


ACCELERATIONS = [
    ("right", "as in the lesson", projected()),
    ("right", "with multipliers", with_multipliers),
    ("right", "the package", lambda robot, q, qd, c, pair: rk.forward_dynamics(robot, q, qd, c)[0]),
    ("right", "the projector and the gaps", in_redundant_coordinates),
    ("right", "in place, a list", in_steps),
    ("right", "another pair", lambda robot, q, qd, c, pair: projected()(robot, q, qd, c, [0, robot.n_arms])),
    ("close", "differences of F", difference_of_F),
    ("close", "single precision", lambda *case: np.float32(projected()(*case))),
    ("wrong", "without G Fdot", projected(gf=0.0), "G Fdot"),
    ("wrong", "without Fdot on the way back", projected(back=0.0), "way back"),
    ("wrong", "without Fdot", projected(gf=0.0, back=0.0), "Fdot is missing"),
    ("wrong", "without C", projected(cor=0.0), "C is missing"),
    ("wrong", "without Q", projected(q_bar=0.0), "friction"),
    ("wrong", "without C and Q", projected(cor=0.0, q_bar=0.0), "C and Q are missing"),
    (
        "wrong",
        "without velocities",
        projected(cor=0.0, q_bar=0.0, gf=0.0, back=0.0),
        "everything that depends on the velocity",
    ),
    ("wrong", "sign of Q", projected(q_bar=-1.0), "the sign of Q"),
    ("wrong", "sign of C", projected(cor=-1.0), "the sign of C is"),
    ("wrong", "sign of G Fdot", projected(gf=-1.0), "the sign of G Fdot"),
    ("wrong", "sign of C, Q, G Fdot", projected(sign=-1.0), "the sign of the velocity terms"),
    ("wrong", "sign of Fdot on the way back", projected(back=-1.0), "the sign of the term Fdot q2d"),
    ("wrong", "two accelerations", projected(joints=False), "two independent"),
    ("wrong", "opposite", lambda *case: -projected()(*case), "the opposite sign"),
    (
        "wrong",
        "free arms",
        lambda robot, q, qd, c, pair: np.linalg.solve(
            tree(robot, q, qd)[0], np.r_[c, 0 * c] - tree(robot, q, qd)[1] @ qd - tree(robot, q, qd)[2]
        ),
        "loops",
    ),
    ("wrong", "gaps without Jdot", not_curved, "Fdot is missing"),
    (
        "wrong",
        "torques forgotten",
        lambda robot, q, qd, c, pair: projected()(robot, q, qd, 0 * c, pair),
        "drive torques",
    ),
    (
        "wrong",
        "no friction in the model",
        lambda robot, *case: projected()(robot.replace(friction=0.0), *case),
        "friction",
    ),
    ("wrong", "A of the end-effector", in_coordinates(None, [0, 1]), "passed to it"),
    ("wrong", "all of the end-effector", in_coordinates(None, None), "passed to them"),
    ("wrong", "degrees", lambda *case: np.rad2deg(projected()(*case)), "degrees"),
    ("wrong", "the base joints only", lambda *case: projected()(*case)[: case[0].n_arms], "shape"),
    ("wrong", "velocities", lambda robot, q, qd, c, pair: qd, "qd itself"),
    (
        "wrong",
        "independent joints taken for the driven ones",
        lambda robot, q, qd, c, pair: (lambda F, a: F @ a)(complement(robot, q, pair), c[:2]),
        "",
    ),
    ("wrong", "a column", lambda *case: projected()(*case)[:, None], "shape"),
]


def multipliers(robot, q, qd, c):
    return rk.forward_dynamics(robot, q, qd, c)[1].reshape(-1, 2)


def forces(robot, q, qd, c):
    cuts = multipliers(robot, q, qd, c)
    return np.insert(-cuts, 1, cuts.sum(axis=0), axis=0)


def newton(robot, q, qd, c):
    """Newton's law for each arm, with the tip force as the unknown."""
    G, C, Q = tree(robot, q, qd)
    qdd = rk.forward_dynamics(robot, q, qd, c)[0]
    torque = (G @ qdd + C @ qd + Q - np.r_[c, 0 * c]).reshape(2, -1)
    out = []
    for i in range(robot.n_arms):
        l1, l2 = robot.lengths[i]
        u, v = q[i], q[i] + q[robot.n_arms + i]
        distal = l2 * np.array([-np.sin(v), np.cos(v)])
        whole = distal + l1 * np.array([-np.sin(u), np.cos(u)])
        out.append(np.linalg.solve(np.array([whole, distal]), torque[:, i]))
    return out


def from_J(robot, q, qd, c):
    """The blocks of the gaps: the force on a tip is minus the derivative of h by that tip, times lambda."""
    lam = rk.forward_dynamics(robot, q, qd, c)[1]
    out, row = np.zeros((robot.n_arms, 2)), 0
    for i in range(robot.n_arms):
        if i != 1:
            out[i] -= lam[row : row + 2]
            out[1] += lam[row : row + 2]
            row += 2
    return out


def searched(robot, q, qd, c):
    """An optimizer at its default tolerance, on Newton's law of all arms."""
    want = newton(robot, q, qd, c)
    return least_squares(lambda f: f - np.ravel(want), np.zeros(2 * robot.n_arms), ftol=1e-4).x.reshape(-1, 2) + 1e-6


def sorted_otherwise(robot, q, qd, c):
    cuts = rk.forward_dynamics(robot, q, qd, c)[1].reshape(2, -1).T
    return np.insert(-cuts, 1, cuts.sum(axis=0), axis=0)


FORCES = [
    ("right", "multipliers", forces),
    ("right", "Newton's law, a list", newton),
    ("right", "loop over the gaps", from_J),
    (
        "right",
        "arm 2 so that the sum is zero",
        lambda *case: (lambda f: np.insert(f, 1, -f.sum(axis=0), axis=0))(-multipliers(*case)),
    ),
    ("close", "an optimizer", searched),
    ("close", "single precision", lambda *case: np.float32(forces(*case))),
    ("close", "rounded to a tenth of a millinewton", lambda *case: np.round(forces(*case), 4)),
    ("wrong", "forces of the tips on the pin", lambda *case: -forces(*case), "sign"),
    (
        "wrong",
        "arm 2 last",
        lambda *case: np.vstack([-multipliers(*case), multipliers(*case).sum(axis=0)]),
        "belongs in row 1",
    ),
    (
        "wrong",
        "arm 2 first",
        lambda *case: np.vstack([multipliers(*case).sum(axis=0), -multipliers(*case)]),
        "arm 2 stands first",
    ),
    (
        "wrong",
        "same sign for all",
        lambda *case: (lambda L: np.insert(L, 1, L.sum(axis=0), axis=0))(multipliers(*case)),
        "on all arms but arm 2 is opposite",
    ),
    (
        "wrong",
        "same sign for all, minus",
        lambda *case: (lambda L: np.insert(L, 1, L.sum(axis=0), axis=0))(-multipliers(*case)),
        "the sign of the others",
    ),
    ("wrong", "arm 2 nothing", lambda *case: np.insert(-multipliers(*case), 1, 0.0, axis=0), "it is in all rows of J"),
    ("wrong", "multipliers", multipliers, "these are the multipliers"),
    ("wrong", "minus multipliers", lambda *case: -multipliers(*case), "on the other arms, one row for each gap; that"),
    ("wrong", "multipliers as they come", lambda *case: rk.forward_dynamics(*case)[1], "shape"),
    (
        "wrong",
        "mean on arm 2",
        lambda *case: np.insert(-multipliers(*case), 1, multipliers(*case).mean(axis=0), axis=0),
        "mean",
    ),
    ("wrong", "all x first", sorted_otherwise, "all x before all y"),
    (
        "wrong",
        "joint torques",
        lambda robot, q, qd, c: (
            (rk.constraint_jacobian(robot, q).T @ rk.forward_dynamics(robot, q, qd, c)[1]).reshape(2, -1).T
        ),
        "joint torques",
    ),
    ("wrong", "sizes", lambda *case: np.linalg.norm(forces(*case), axis=1), "lengths"),
    ("wrong", "transposed", lambda *case: forces(*case).T, "transposed"),
    ("wrong", "x and y exchanged", lambda *case: forces(*case)[:, ::-1], "another order"),
    ("wrong", "in mN", lambda *case: 1e3 * forces(*case), "1000"),
    ("wrong", "flat", lambda *case: forces(*case).ravel(), "shape"),
    (
        "wrong",
        "only arm 2",
        lambda *case: np.insert(0 * multipliers(*case), 1, multipliers(*case).sum(axis=0), axis=0),
        "",
    ),
    ("wrong", "sign of arm 1", lambda *case: forces(*case) * np.r_[-1, np.ones(case[0].n_arms - 1)][:, None], "sign"),
    ("wrong", "half", lambda *case: forces(*case) / 2, "half"),
    ("wrong", "nothing", lambda *case: 0 * forces(*case), "zero"),
    ("wrong", "accelerations", lambda *case: rk.forward_dynamics(*case)[0].reshape(2, -1).T, ""),
    ("wrong", "rows backwards", lambda *case: forces(*case)[::-1], "order"),
    ("wrong", "without the drives", lambda robot, q, qd, c: forces(robot, q, qd, 0 * c), "drive torques"),
    (
        "wrong",
        "three arms only",
        lambda robot, q, qd, c: (lambda L: np.array([-L[0], L[0] + L[1], -L[1]]))(multipliers(robot, q, qd, c)),
        "shape",
    ),
]

ANSWERS = {
    "01.loop_constraints": GAPS,
    "01.orthogonal_complement": COMPLEMENTS,
    "01.projected_accelerations": ACCELERATIONS,
    "01.pin_forces": FORCES,
}
