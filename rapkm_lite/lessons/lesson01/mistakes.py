"""Wrong answers to the exercises of lesson 01, each with the sentence that names the mistake."""

from __future__ import annotations

import numpy as np

from ...mechanics.actuation import control_matrix
from ...mechanics.dynamics import (
    coriolis_matrix,
    forward_dynamics,
    generalized_forces,
    mass_matrix,
    minimal_dynamics,
    orthogonal_complement,
    orthogonal_complement_dot,
)
from ...mechanics.kinematics import constraint_jacobian, loop_constraints, tips
from ...mechanics.kinematics import unit_vector as _way


def _gaps_of(wrong):
    """A wrong h from wrong tips: base points, lengths of the two links, base and elbow angles -> tips (N, 2)."""

    def gaps(robot, q):
        l1, l2 = robot.lengths.T[..., None]
        p = wrong(robot.base, l1, l2, q[: robot.n_arms], q[robot.n_arms :])
        return (np.delete(p, 1, axis=0) - p[1]).ravel()

    return gaps


def _gaps_with(change):
    """A wrong h from the right tips (N, 2)."""
    return lambda robot, q: np.ravel(change(tips(robot, q)))


def _parts(robot, q, independent):
    """Dependent joints, J_1 and J_2."""
    dependent = [j for j in range(robot.n_joints) if j not in independent]
    J = constraint_jacobian(robot, q)
    return dependent, J[:, dependent], J[:, independent]


def _placed(block):
    """A wrong F: the rows of the dependent joints from J_1 and J_2, those of the independent ones right."""

    def complement(robot, q, independent):
        dependent, J1, J2 = _parts(robot, q, independent)
        F = np.zeros((robot.n_joints, 2))
        F[independent], F[dependent] = np.eye(2), block(J1, J2)
        return F

    return complement


def _stacked(robot, q, independent, top=True):
    _, J1, J2 = _parts(robot, q, independent)
    block = -np.linalg.solve(J1, J2)
    return np.vstack([block, np.eye(2)] if top else [np.eye(2), block])


def _projector(robot, q):
    J = constraint_jacobian(robot, q)
    return np.eye(robot.n_joints) - np.linalg.pinv(J) @ J


def _projected(**kept):
    """Wrong accelerations: the way of (5)-(7) with some of its terms multiplied by another factor than 1."""

    def accelerations(robot, q, qd, c, independent):
        term = {"GFdot": 1.0, "C": 1.0, "Q": 1.0, "back": 1.0, "joints": 1.0} | kept
        F, F_dot = orthogonal_complement(robot, q, independent), orthogonal_complement_dot(robot, q, qd, independent)
        G, C, Q = mass_matrix(robot, q), coriolis_matrix(robot, q, qd), generalized_forces(robot, q, qd)
        q2d = qd[independent]
        rest = F.T @ (term["C"] * C @ F + term["GFdot"] * G @ F_dot) @ q2d + term["Q"] * F.T @ Q
        q2dd = np.linalg.solve(F.T @ G @ F, F[: robot.n_arms].T @ c - rest)
        return F @ q2dd + term["back"] * F_dot @ q2d if term["joints"] else q2dd

    return accelerations


def _of_the_end_effector(dynamics):
    """Wrong accelerations: A, and with `dynamics` all of (6), in coordinates of the end-effector."""

    def accelerations(robot, q, qd, c, independent):
        A, q2d = control_matrix(robot, q), qd[independent]
        G, C, Q = minimal_dynamics(robot, q, qd, None if dynamics else independent)
        q2dd, F = np.linalg.solve(G, A.T @ c - C @ q2d - Q), orthogonal_complement(robot, q, independent)
        return F @ q2dd + orthogonal_complement_dot(robot, q, qd, independent) @ q2d

    return accelerations


def _free_tree(robot, q, qd, c, independent):
    rest = coriolis_matrix(robot, q, qd) @ qd + generalized_forces(robot, q, qd)
    return np.linalg.solve(mass_matrix(robot, q), np.concatenate([c, 0 * c]) - rest)


def _multipliers(robot, q, qd, c) -> np.ndarray:
    """The multipliers of (2), one row per gap."""
    return forward_dynamics(robot, q, qd, c)[1].reshape(-1, 2)


def _pins_with(change):
    """Wrong forces from the multipliers, one row per gap."""
    return lambda robot, q, qd, c: change(_multipliers(robot, q, qd, c))


GAPS = {
    "the elbow angle is relative, counted from the proximal link: the base angle is missing in the direction "
    "of the distal link": _gaps_of(lambda b, l1, l2, q1, q2: b + l1 * _way(q1) + l2 * _way(q2)),
    "the elbow angle is counted with the opposite sign": _gaps_of(
        lambda b, l1, l2, q1, q2: b + l1 * _way(q1) + l2 * _way(q1 - q2)
    ),
    "these are the gaps between the elbows: the distal links are missing": _gaps_of(
        lambda b, l1, l2, q1, q2: b + l1 * _way(q1)
    ),
    "the proximal links are missing: the distal ones do not begin at the base points": _gaps_of(
        lambda b, l1, l2, q1, q2: b + l2 * _way(q1 + q2)
    ),
    "the base points are missing: the tips are given in frames of their own arms": _gaps_of(
        lambda b, l1, l2, q1, q2: l1 * _way(q1) + l2 * _way(q1 + q2)
    ),
    "the lengths of the two links are exchanged": _gaps_of(
        lambda b, l1, l2, q1, q2: b + l2 * _way(q1) + l1 * _way(q1 + q2)
    ),
    "both links are given the length of the proximal one: robot.lengths has two columns": _gaps_of(
        lambda b, l1, l2, q1, q2: b + l1 * (_way(q1) + _way(q1 + q2))
    ),
    "sine and cosine are exchanged: x goes with the cosine (another frame)": _gaps_of(
        lambda b, l1, l2, q1, q2: b + l1 * _way(q1)[:, ::-1] + l2 * _way(q1 + q2)[:, ::-1]
    ),
    "the angles are taken for degrees: units, q is in radians": _gaps_of(
        lambda b, l1, l2, q1, q2: b + l1 * _way(np.deg2rad(q1)) + l2 * _way(np.deg2rad(q1 + q2))
    ),
    "the angles are turned into degrees first: units, np.cos takes radians": _gaps_of(
        lambda b, l1, l2, q1, q2: b + l1 * _way(np.rad2deg(q1)) + l2 * _way(np.rad2deg(q1 + q2))
    ),
    "all arms are given the lengths of the first one": (
        lambda robot, q: loop_constraints(robot.replace(lengths=robot.lengths[0]), q)
    ),
    "the joints are taken in the order base, elbow, base, elbow, ...: all base joints come first": (
        lambda robot, q: loop_constraints(robot, np.concatenate([q[0::2], q[1::2]]))
    ),
    "the gaps are measured from the tip of arm 1, not of arm 2": _gaps_with(lambda p: p[1:] - p[0]),
    "the gaps are measured from the tip of arm 3, not of arm 2": _gaps_with(lambda p: np.delete(p, 2, axis=0) - p[2]),
    "the gap between arm 2 and itself is not left out": _gaps_with(lambda p: p - p[1]),
    "each gap leads from one arm to the next; all of them begin at arm 2": _gaps_with(lambda p: np.diff(p, axis=0)),
    "the order is all x before all y; x and y of each gap come in turn": _gaps_with(
        lambda p: (np.delete(p, 1, axis=0) - p[1]).T
    ),
    "the answer holds the gaps of arms 1 and 3 only: with N arms there are N - 1 gaps": _gaps_with(
        lambda p: [p[0] - p[1], p[2] - p[1]]
    ),
    "the tips are added instead of subtracted: one sign is opposite": _gaps_with(
        lambda p: np.delete(p, 1, axis=0) + p[1]
    ),
    "these are the tips themselves; the gaps are their differences from tip 2": _gaps_with(lambda p: p),
    "these are the lengths of the gaps; x and y of each gap are wanted": _gaps_with(
        lambda p: np.linalg.norm(np.delete(p, 1, axis=0) - p[1], axis=1)
    ),
}

COMPLEMENTS = {
    "the rows stand in another order: dependent joints on top, as in the chapter; here in joint order": (_stacked),
    "the rows stand in another order: the independent joints on top; here rows stay in joint order": (
        lambda robot, q, independent: _stacked(robot, q, independent, top=False)
    ),
    "the sign of the dependent rows is opposite: J_2 has to change sides": _placed(np.linalg.solve),
    "the identity in the rows of the independent joints has the opposite sign": (
        lambda robot, q, independent: (
            _placed(lambda J1, J2: -np.linalg.solve(J1, J2))(robot, q, independent)
            * np.where(np.isin(np.arange(robot.n_joints), independent), -1.0, 1.0)[:, None]
        )
    ),
    "the inverse of J_1 is missing: J_1 is multiplied instead of divided off": _placed(lambda J1, J2: -J1 @ J2),
    "J_1 is transposed where it should be inverted": _placed(lambda J1, J2: -J1.T @ J2),
    "J_1 is transposed": _placed(lambda J1, J2: -np.linalg.solve(J1.T, J2)),
    "J_1 is missing: the dependent rows are -J_2": _placed(lambda J1, J2: -J2),
    "only the independent rows are filled: the dependent ones are missing": _placed(lambda J1, J2: np.zeros_like(J2)),
    "only the dependent rows are given: the identity in the rows of the independent joints is missing": (
        lambda robot, q, independent: _stacked(robot, q, independent)[: robot.n_constraints]
    ),
    "the identity in the rows of the independent joints is missing: they are zero": (
        lambda robot, q, independent: (
            _placed(lambda J1, J2: -np.linalg.solve(J1, J2))(robot, q, independent)
            * ~np.isin(np.arange(robot.n_joints), independent)[:, None]
        )
    ),
    "the columns stand in another order: they follow `independent`, also where it is not sorted": (
        lambda robot, q, independent: orthogonal_complement(robot, q, sorted(independent))
    ),
    "`independent` is not used: these are the velocities from the joints 0 and 1 (another order of joints)": (
        lambda robot, q, independent: orthogonal_complement(robot, q, [0, 1])
    ),
    "this is another basis of the same plane, without the identity in the independent rows (another frame)": (
        lambda robot, q, independent: np.linalg.svd(constraint_jacobian(robot, q))[2][robot.n_constraints :].T
    ),
    "these are two columns of the projector N_J: same plane, but no identity in the independent rows": (
        lambda robot, q, independent: _projector(robot, q)[:, independent]
    ),
    "the columns are scaled to unit length: the rows of the independent joints are no longer the identity": (
        lambda robot, q, independent: (F := orthogonal_complement(robot, q, independent)) / np.linalg.norm(F, axis=0)
    ),
    "this is the projector N_J; F has two columns": lambda robot, q, independent: _projector(robot, q),
    "the independent joints are counted from 1; the indices begin at 0": (
        lambda robot, q, independent: orthogonal_complement(robot, q, [(j - 1) % robot.n_joints for j in independent])
    ),
}

ACCELERATIONS = {
    "the term G Fdot is missing: the acceleration in (2) has two terms, and both are multiplied by G": (
        _projected(GFdot=0.0)
    ),
    "the term Fdot q2d is missing on the way back to all joints": _projected(back=0.0),
    "Fdot is missing, both in the equations and on the way back: F changes along the motion": _projected(
        GFdot=0.0, back=0.0
    ),
    "the factor C is missing: Coriolis and centrifugal torques of the tree": _projected(C=0.0),
    "Q is missing: the friction of the drives": _projected(Q=0.0),
    "C and Q are missing": _projected(C=0.0, Q=0.0),
    "the drive torques c are missing": (lambda robot, q, qd, c, independent: forward_dynamics(robot, q, qd, 0 * c)[0]),
    "the sign of the drive torques c is opposite: they stand on the right of (2)": (
        lambda robot, q, qd, c, independent: forward_dynamics(robot, q, qd, -c)[0]
    ),
    "everything that depends on the velocity is missing": _projected(C=0.0, Q=0.0, GFdot=0.0, back=0.0),
    "A is that of the end-effector: `independent` was not passed to it": _of_the_end_effector(False),
    "all matrices are those of the end-effector: `independent` was not passed to them": _of_the_end_effector(True),
    "the sign of Q is opposite: it stands on the left of (2)": _projected(Q=-1.0),
    "the sign of the velocity terms is opposite: they stand on the left of (2)": _projected(C=-1.0, Q=-1.0, GFdot=-1.0),
    "the sign of C is opposite": _projected(C=-1.0),
    "the sign of G Fdot is opposite": _projected(GFdot=-1.0),
    "the sign of the term Fdot q2d is opposite on the way back": _projected(back=-1.0),
    "these are the accelerations of the two independent joints; the step back to all joints is missing": (
        _projected(joints=0.0)
    ),
    "these are the accelerations of the free arms: the loops are not held closed, the factor F is missing": _free_tree,
}

FORCES = {
    "arm 2 stands in another order: its force belongs in row 1, between arm 1 and arm 3": _pins_with(
        lambda L: np.vstack([-L, L.sum(axis=0)])
    ),
    "the order of the rows: arm 2 stands first": _pins_with(lambda L: np.vstack([L.sum(axis=0), -L])),
    "the force on arm 2 has the sign of the others: the forces of the pin do not add to zero": _pins_with(
        lambda L: np.insert(-L, 1, -L.sum(axis=0), axis=0)
    ),
    "the sign of the forces on all arms but arm 2 is opposite: J^T lambda stands on the left of (2)": _pins_with(
        lambda L: np.insert(L, 1, L.sum(axis=0), axis=0)
    ),
    "the force on arm 2 is missing: it is in all rows of J": _pins_with(lambda L: np.insert(-L, 1, 0.0, axis=0)),
    "these are the multipliers, one row for each gap; the force on arm 2 is missing, and mind the sign": (
        _pins_with(lambda L: L)
    ),
    "these are the forces on the other arms, one row for each gap; that on arm 2 is missing": _pins_with(lambda L: -L),
    "arm 2 is given the mean of the others, not their sum": _pins_with(
        lambda L: np.insert(-L, 1, L.mean(axis=0), axis=0)
    ),
    "the multipliers are sorted as all x before all y; x and y of each gap come in turn (order)": _pins_with(
        lambda L: np.insert(-L.reshape(2, -1).T, 1, L.reshape(2, -1).T.sum(axis=0), axis=0)
    ),
    "these are the joint torques J^T lambda, not the forces at the tips": (
        lambda robot, q, qd, c: (
            (constraint_jacobian(robot, q).T @ forward_dynamics(robot, q, qd, c)[1]).reshape(2, -1).T
        )
    ),
    "the drive torques c are missing": (
        lambda robot, q, qd, c: (lambda L: np.insert(-L, 1, L.sum(axis=0), axis=0))(_multipliers(robot, q, qd, 0 * c))
    ),
    "these are the lengths of the forces; their two components are wanted": _pins_with(
        lambda L: np.linalg.norm(np.insert(-L, 1, L.sum(axis=0), axis=0), axis=1)
    ),
}
