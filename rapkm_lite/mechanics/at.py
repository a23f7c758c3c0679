"""`at`: everything the chapter writes with one letter, at one pose or many."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..machine.arguments import check_leading, joint_indices, real_array
from ..machine.manipulator import Manipulator, manipulator
from ..machine.values import Value
from . import cores
from .linalg import linear
from .quantity import geometry, quantity, rate, shelf


@dataclass(frozen=True, eq=False, repr=False)
class At(Value):
    """The machine at the pose q, moving at the rate qd; made by `at`.  The last axes are those of the symbol.

    A quantity is computed when it is asked for the first time, and kept; all arrays are read-only (copy one to change
    it: ``at.G.copy()``).  Those that need qd raise ValueError when it was not given, those that do not exist at a
    singular pose raise there, and F, N and what follows from them where q leaves the loops open, by more than 1e-3 of
    the longest link.  F, A and what follows from them belong to the end-effector position as independent coordinates,
    or to the two joints chosen by `using`.

    >>> import rapkm_lite as rk; robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> rk.at(robot, q)
    At('testbed', 1 pose)
    >>> rk.at(robot, q).using((0, 1)).A.round(3)
    array([[ 1.   ,  0.   ],
           [ 0.   ,  1.   ],
           [-0.651, -1.205]])
    """

    robot: Manipulator
    q: np.ndarray
    qd: np.ndarray | Any = None  # None where it was not given
    independent: tuple[int, ...] | None = None

    def __post_init__(self):
        self.__dict__.update(at(self.robot, self.q, self.qd).using(self.independent).__dict__)

    def using(self, independent) -> At:
        """The same pose with two 0-based joint indices (or None: the end-effector) as independent coordinates q2."""
        if independent is not None:
            independent = joint_indices("independent", independent, self.robot.n_joints)
        if independent == self.independent:
            return self
        shared = {name: value for name, value in self.__dict__.items() if name not in _OF_COORDINATES}
        other = object.__new__(At)
        other.__dict__.update(shared, independent=independent)
        return other

    def __repr__(self):
        lead = self.q.shape[:-1]
        count = f"{int(np.prod(lead))} poses" if lead else "1 pose"
        coordinates = "" if self.independent is None else f", independent joints {self.independent}"
        return f"At({self.robot.name!r}, {count}{', with rates' if self.qd is not None else ''}{coordinates})"

    # Geometry.
    @geometry
    def _v(self):
        return cores.link_vectors(self.robot.tree, self.q)

    @rate
    def _rates(self):
        """Rate of turn of every link against the x axis, once for each entry of _v, (..., 4N)."""
        return linear(self.qd, self.robot.tree.turning)

    @quantity
    def tip_columns(self) -> np.ndarray:
        """d tip_i / d joint, (..., 2, 2N), m/rad: E (a_i + d_i) for the base joints, E d_i for the elbows."""
        tree = self.robot.tree
        return linear(self._v, tree.tips, 2, tree.n)

    @quantity
    def a(self) -> np.ndarray:
        """Proximal vectors (..., N, 2), m."""
        return self._v.reshape(*self.q.shape[:-1], 2, 2, self.robot.n_arms)[..., 0, :].mT

    @quantity
    def d(self) -> np.ndarray:
        """Distal vectors (..., N, 2), m."""
        return self._v.reshape(*self.q.shape[:-1], 2, 2, self.robot.n_arms)[..., 1, :].mT

    @quantity
    def x(self) -> np.ndarray:
        """End-effector position (..., 2), m: the tip of arm 2, from which the others are cut."""
        return self.robot.base[1] + self.a[..., 1, :] + self.d[..., 1, :]

    @rate
    def xd(self) -> np.ndarray:
        """End-effector velocity (..., 2), m/s: that of the tip of arm 2."""
        elbow, columns, qd = self.robot.n_arms + 1, self.tip_columns, self.qd[..., None, :]
        return columns[..., 1] * qd[..., 1] + columns[..., elbow] * qd[..., elbow]

    @quantity
    def J(self) -> np.ndarray:
        """Constraint Jacobian (..., r, 2N) of (1), m/rad: the columns of the cut arms minus those of arm 2."""
        tree = self.robot.tree
        return linear(self._v, tree.jacobian, tree.r, tree.n)

    @rate
    def J_dot(self) -> np.ndarray:
        """dJ/dt (..., r, 2N), m/(rad s): a link vector that turns at the rate w changes by w E v, and E E = -1."""
        tree = self.robot.tree
        return linear(self._v * self._rates, tree.jacobian_dot, tree.r, tree.n)

    @geometry
    def _closed(self):
        """The vectors of the links, where they close the loops; rates and torques have no meaning elsewhere."""
        return cores.closed(self.robot.tree, self._v)

    # Minimal coordinates.
    @geometry
    def _levers(self):
        levers = cores.inner_levers(self.robot.tree, self.q)
        _ = self._closed
        return levers

    @geometry
    def _over(self):
        """The base joint of an arm turns at d . xd / (a x d), its distal link at -a . xd / (a x d)."""
        return self._v / self._levers

    @quantity
    def F(self) -> np.ndarray:
        """Orthogonal complement (5), qd = F q2d, J F = 0, (..., 2N, 2)."""
        if self.independent is not None:
            _ = self._closed
            return cores.joint_complement(self.J, self.independent)
        return linear(self._over, self.robot.tree.complement, self.robot.n_joints, 2)

    @rate
    def F_dot(self) -> np.ndarray:
        """dF/dt, (..., 2N, 2)."""
        if self.independent is not None:
            return cores.joint_complement_dot(self.J, self.J_dot, self.F, self.independent)
        tree = self.robot.tree
        # d(a x d)/dt = (a . d) times the elbow rate, and v turns at the rate of its link.
        lever_dot = linear(np.vecdot(self.a, self.d) * self.qd[..., tree.N :], tree.spread_arms)
        over_dot = (linear(self._v, tree.turn) * self._rates - self._over * lever_dot) / self._levers
        return linear(over_dot, tree.complement, tree.n, 2)

    @quantity
    def A(self) -> np.ndarray:
        """Control matrix of (6), qd_a = A q2d, (..., m, 2)."""
        return self.F[..., : self.robot.n_arms, :]

    @quantity
    def A_T_pinv(self) -> np.ndarray:
        """(A^T)^+ = A (A^T A)^-1 of (11) and (14), (..., m, 2)."""
        return cores.right_inverse("A", self.A)

    @rate
    def minimal(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Gbar, Cbar, Qbar of (7): (..., 2, 2), (..., 2, 2), (..., 2)."""
        return cores.minimal(self.F, self.F_dot, self.G, self.C, self.Q)

    # The cut tree (2).
    @quantity
    def G(self) -> np.ndarray:
        """Mass matrix of (2), (..., 2N, 2N), kg m^2; the cosine of an elbow angle couples the joints of its arm."""
        tree = self.robot.tree
        return linear(np.cos(self.q), tree.coupling, tree.n, tree.n) + tree.inertia

    @rate
    def C(self) -> np.ndarray:
        """Coriolis matrix of (2) from the Christoffel symbols, (..., 2N, 2N), N m s."""
        tree = self.robot.tree
        return linear(np.sin(self.q).take(tree.elbow, axis=-1) * self.qd, tree.christoffel, tree.n, tree.n)

    @rate
    def Q(self) -> np.ndarray:
        """Remaining forces of (2), (..., 2N), N m, on the left-hand side: gravity, and friction f_c tanh(qd / v0)."""
        tree = self.robot.tree
        return linear(self._v, tree.weight) + tree.friction * np.tanh(self.qd / self.robot.friction_velocity)

    # Redundant coordinates.
    @geometry
    def _row_space(self):
        _ = self._closed
        return cores.row_space(self.J, self.robot.tree.longest)

    @quantity
    def N(self) -> np.ndarray:
        """N_J = I - J^+ J of section 4.3, the orthogonal projector onto the tangent space of V, (..., 2N, 2N)."""
        return cores.projector(*self._row_space)

    @rate
    def N_dot(self) -> np.ndarray:
        """dN_J/dt of the text after (24), (..., 2N, 2N), 1/s."""
        Q, R = self._row_space
        return cores.projector_dot(Q, R, self.J_dot, self.N)

    @quantity
    def A_tilde(self) -> np.ndarray:
        """A~ of (21), qd_a = A~ qd, the rows of N_J of the driven joints, (..., m, 2N)."""
        return self.N[..., : self.robot.n_arms, :]

    @quantity
    def A_tilde_T_pinv(self) -> np.ndarray:
        """(A~^T)^+ of (25), (..., m, 2N); by (27) it comes from A~ alone, here from the tangent space of V."""
        Q, R = self._row_space
        return cores.redundant_right_inverse(Q[..., R.shape[-1] :], self.robot.n_arms)

    @rate
    def redundant(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """G~, C~, Q~ of (24): (..., 2N, 2N), (..., 2N, 2N), (..., 2N)."""
        return cores.redundant(self.N, self.N_dot, self.G, self.C, self.Q)


_OF_COORDINATES = ("independent", "F", "F_dot", "A", "A_T_pinv", "minimal", "_hash")


def at(robot: Manipulator, q, qd=None) -> At:
    """Everything at one pose q (2N,), or many (..., 2N), rad, moving at qd (..., 2N), rad/s: an `At`.

    Checked once, each quantity computed when asked for and kept.  Its attributes are the symbols of the notation table:
    J, J_dot, F, F_dot, A, A_T_pinv, minimal (Gbar, Cbar, Qbar), G, C, Q, N, N_dot, A_tilde, A_tilde_T_pinv, redundant
    (G~, C~, Q~), and x, xd, a, d.  ``.using((0, 1))`` takes the joints 0 and 1 as independent coordinates instead of
    the end-effector position.  A qd that opens the loops is taken as it is, as a law may measure it; it is refused by
    `forward_dynamics`, `inverse_dynamics` and `required_wrench`, which are about motions.
    Raises ValueError when q or qd is not finite, has another last axis, or leading axes do not fit together.

    >>> import rapkm_lite as rk
    >>> robot = rk.load()
    >>> pose = rk.at(robot, rk.inverse_kinematics(robot, [0.02, 0.05]))
    >>> bool(abs(pose.J @ pose.F).max() < 1e-15), pose.A_tilde.shape
    (True, (3, 6))
    """
    n = manipulator(robot).n_joints
    q = real_array("q", q, n).copy()
    q.setflags(write=False)
    if qd is not None:
        qd = real_array("qd", qd, n).copy()
        qd.setflags(write=False)
        if qd.shape != q.shape:
            check_leading(q=q.shape[:-1], qd=qd.shape[:-1])
    pose = object.__new__(At)
    pose.__dict__.update(robot=robot, q=q, qd=qd, independent=None)
    return pose


def asked(robot: Manipulator, q, qd=None) -> At:
    """`at` for the functions of the chapter: a law asks several of them at one pose, and each makes an `At` of its own.

    Those at the last few single poses share their geometry.
    """
    pose = at(robot, q, qd)
    if pose.q.ndim == 1:
        pose.__dict__["_geometry"] = shelf(robot.tree, pose.q.tobytes())
    return pose
