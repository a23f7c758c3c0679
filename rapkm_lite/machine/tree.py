"""The cut tree of a machine as constant arrays: what the motion equations (2) need besides the angles.

The link vectors of a pose are kept flat, v = (x of all links, y of all links), (4N,), in joint order: the proximal
links a_1 .. a_N, then the distal ones d_1 .. d_N.  Most of kinematics is linear in v, so one product with a table
does it, ``(v @ table).reshape(shape)``; for a single pose that is several times faster than slices and stacks.
"""

from __future__ import annotations

import numpy as np


class Tree:
    """Constants of the tree that is left when every arm but arm 2 is cut from the end-effector.

    N, n, r : arms, joints, constraints.  lengths : (4N,) m, of the links in v.  longest : the longest link, m.
    most : (N,) m^2, l1 l2, which |a x d| = l1 l2 |sin(elbow angle)| does not exceed.
    absolute : (2N, 2N) angles of the links against the x axis from joint angles.  turning : (2N, 4N) their rates from
    those of the joints, once for each entry of v.  spread_arms : (N, 4N) a number per arm, to its entries of v.
    gaps : (4N, r) and gap : (r,) m, h = v gaps + gap.
    turn : (4N, 4N) the quarter turn of all links.  tips : (4N, 4N) d tip_i / d joint, (2, 2N), the column of every
    joint.  jacobian, jacobian_dot : (4N, 2N r) tables of J and, from v times the rates of the links, of dJ/dt.
    complement : (4N, 4N) table of F from v over the levers.
    inertia : (2N, 2N) and coupling : (2N, 4N^2) kg m^2, G = inertia + cos(q) coupling.
    christoffel : (2N, 4N^2) kg m^2, C = (sin(elbow of the joint's arm) qd) christoffel.
    elbow : (2N,) index of the elbow joint of each joint's arm.  weight : (4N, 2N) kg m/s^2, gravity in Q.
    friction : (2N,) f_c of every joint, N m.
    """

    def __init__(self, robot):
        N, n, r = robot.n_arms, robot.n_joints, robot.n_constraints
        self.N, self.n, self.r = N, n, r
        base, elbow = np.arange(N), np.arange(N, n)
        arm = np.eye(N)[:, np.arange(n) % N]
        self.lengths, self.longest = np.tile(robot.lengths.T.ravel(), 2), robot.lengths.max()
        self.most = robot.lengths.prod(axis=1)
        self.elbow = np.concatenate([elbow, elbow])
        self._linear(arm, base, elbow, robot.base)
        self._dynamic(robot, base, elbow)
        for value in vars(self).values():
            if isinstance(value, np.ndarray):
                value.setflags(write=False)

    def _linear(self, arm, base, elbow, points):
        """The tables of kinematics, each from its formula for the 4N unit vectors in place of v."""
        n = self.n
        self.absolute = np.eye(n)
        self.absolute[base, elbow] = 1.0
        self.turning, self.spread_arms = np.tile(self.absolute, 2), np.tile(arm, 2)
        unit = np.eye(2 * n).reshape(2 * n, 2, n)
        turned = unit[:, ::-1] * np.array([[-1.0], [1.0]])
        tips = self._gathered(turned)
        signs = (np.delete(arm, 1, axis=0) - arm[1])[:, None, :]
        # A tip is the base point and both links of its arm.
        self.gaps = np.einsum("kij,cj->kci", unit, signs[:, 0]).reshape(2 * n, -1)
        self.gap = (np.delete(points, 1, axis=0) - points[1]).ravel()
        over = np.concatenate([unit[..., elbow], -unit[..., base] - unit[..., elbow]], axis=-1)
        flat = lambda table: np.ascontiguousarray(table.reshape(2 * n, -1)) + 0.0  # noqa: E731
        self.turn, self.tips = flat(turned), flat(tips)
        self.jacobian = flat(signs * tips[:, None])
        self.jacobian_dot = flat(-signs * self._gathered(unit)[:, None])
        self.complement = flat(over.swapaxes(-1, -2))

    def _gathered(self, links):
        """What moves with a joint: (a_i + d_i, d_i) from (a_i, d_i)."""
        return np.concatenate([links[..., : self.N] + links[..., self.N :], links[..., self.N :]], axis=-1)

    def _dynamic(self, robot, base, elbow):
        n = self.n
        proximal, distal, P = robot.arm_inertias.T
        inertia, coupling, christoffel = np.zeros((n, n)), np.zeros((n, n, n)), np.zeros((n, n, n))
        inertia[base, base] = proximal + distal
        inertia[base, elbow] = inertia[elbow, base] = inertia[elbow, elbow] = distal
        coupling[elbow, base, base] = 2 * P
        coupling[elbow, base, elbow] = coupling[elbow, elbow, base] = P
        christoffel[elbow, base, base] = christoffel[base, base, elbow] = christoffel[elbow, base, elbow] = -P
        christoffel[base, elbow, base] = P
        self.inertia, self.coupling = inertia, coupling.reshape(n, -1)
        self.christoffel = christoffel.reshape(n, -1)
        moments = np.diag((robot.arm_moments / robot.lengths).T.ravel())
        gx, gy = robot.gravity
        self.weight = self._gathered(np.concatenate([-gy * moments, gx * moments]))  # -g . E (moment of a and d)
        self.friction = np.concatenate([robot.friction, np.zeros(self.N)])
