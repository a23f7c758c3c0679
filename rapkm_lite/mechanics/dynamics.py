"""Motion equations: tree with multipliers (2), minimal coordinates (4)-(7), redundant coordinates (22)-(24).

Sign convention, as in (2):  G qdd + C qd + Q + J^T lambda = u,  u = (c, 0),  c (..., N) the drive torques in N m.
"""

from __future__ import annotations

import numpy as np

from ..machine.arguments import check_leading, matvec, real_array, small_number
from ..machine.manipulator import Manipulator, manipulator
from . import cores
from .at import asked


def mass_matrix(robot: Manipulator, q) -> np.ndarray:
    """Generalized mass matrix G(q) of (2), (..., 2N, 2N) in kg m^2; the cut tree couples only the joints of one arm.

    >>> import numpy as np, rapkm_lite as rk; robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> bool(np.all(np.linalg.eigvalsh(rk.mass_matrix(robot, q)) > 0.0))
    True
    """
    return asked(robot, q).G.copy()


def coriolis_matrix(robot: Manipulator, q, qd) -> np.ndarray:
    """C(q, qd) of (2) from the Christoffel symbols, (..., 2N, 2N) in N m s; dG/dt - 2 C is skew-symmetric.

    >>> import numpy as np, rapkm_lite as rk; robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> C = rk.coriolis_matrix(robot, q, 0.1 * q)
    >>> np.allclose(C, 0.1 * rk.coriolis_matrix(robot, q, q))
    True
    """
    return asked(robot, q, qd).C.copy()


def generalized_forces(robot: Manipulator, q, qd) -> np.ndarray:
    """Q(q, qd) of (2), (..., 2N) in N m, on the left-hand side: dV/dq of gravity plus drive friction f_c tanh(qd / v0).

    Zero for the horizontal plane without friction.

    >>> import rapkm_lite as rk; robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> rk.generalized_forces(robot, q, 10 + 0 * q).round(4)
    array([0.0042, 0.0042, 0.0042, 0.    , 0.    , 0.    ])
    """
    return asked(robot, q, qd).Q.copy()


def orthogonal_complement(robot: Manipulator, q, independent=None) -> np.ndarray:
    """F of (5), qd = F q2d with J F = 0, (..., 2N, 2); its dependent rows -J1^-1 J2 solve (4), J1 q1d + J2 q2d = 0.

    Rows follow the joint order, columns follow `independent`, two 0-based joint indices; None takes the end-effector
    position as q2 (then in rad/m).
    Raises ValueError where the choice is singular, naming the pair and its measure (smallest singular value of J1 over
    the largest of J), or the arm that is stretched or folded, and where q leaves the loops open.

    >>> import rapkm_lite as rk; robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> rk.orthogonal_complement(robot, q, independent=(0, 1))[:2]
    array([[1., 0.],
           [0., 1.]])
    """
    return asked(robot, q).using(independent).F.copy()


def orthogonal_complement_dot(robot: Manipulator, q, qd, independent=None) -> np.ndarray:
    """dF/dt along qd, (..., 2N, 2), for qdd = F q2dd + Fdot q2d, the text after (5).

    From J F = 0 the dependent rows are -J1^-1 Jdot F.  Arguments and errors: see `orthogonal_complement`.

    >>> import rapkm_lite as rk; robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> rk.orthogonal_complement_dot(robot, q, q, independent=(0, 1))[:2]
    array([[0., 0.],
           [0., 0.]])
    """
    return asked(robot, q, qd).using(independent).F_dot.copy()


def minimal_dynamics(robot: Manipulator, q, qd, independent=None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Gbar, Cbar, Qbar of (7), the terms of (6):  Gbar q2dd + Cbar q2d + Qbar = A^T c.

    Gbar = F^T G F, Cbar = F^T (C F + G Fdot), both (..., 2, 2); Qbar = F^T Q, (..., 2).
    `independent` and errors: see `orthogonal_complement`.

    >>> import rapkm_lite as rk; robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> Gbar, Cbar, Qbar = rk.minimal_dynamics(robot, q, 0 * q)
    >>> Gbar.round(2)
    array([[ 0.42, -0.04],
           [-0.04,  0.3 ]])
    """
    Gbar, Cbar, Qbar = asked(robot, q, qd).using(independent).minimal
    return Gbar.copy(), Cbar.copy(), Qbar.copy()


def constraint_rank(robot: Manipulator, q, tolerance: float = 1e-9) -> np.ndarray:
    """Rank of J(q) of (1), (...,): how many singular values are above `tolerance`, 0 to 1, times the longest link.

    >>> import rapkm_lite as rk; robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> int(rk.constraint_rank(robot, q))
    4
    """
    limit = small_number("tolerance", tolerance) * manipulator(robot).lengths.max()
    return np.sum(np.linalg.svd(asked(robot, q).J, compute_uv=False) > limit, axis=-1)


def degree_of_freedom(robot: Manipulator, q, tolerance: float = 1e-9) -> np.ndarray:
    """Differential degree of freedom n - rank J(q), (...,); delta = n - r = 2 where q is regular.

    The text after (7) prints delta = n - m.  Larger values than 2 mark c-space singularities, where J loses rank: on
    the testbed the three corners of the workspace, where one arm is folded and turns freely while two are stretched.
    tolerance : as in `constraint_rank`.

    >>> import rapkm_lite as rk; robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> int(rk.degree_of_freedom(robot, q))
    2
    """
    return manipulator(robot).n_joints - constraint_rank(robot, q, tolerance)


def nullspace_projector(robot: Manipulator, q) -> np.ndarray:
    """N_J = I - J^+ J of section 4.3, (..., 2N, 2N): the orthogonal projector onto the tangent space of V.

    (21) partitions it into the rows of passive and driven joints; the latter are `redundant_control_matrix`.
    Raises ValueError at c-space singularities and for open loops.

    >>> import numpy as np, rapkm_lite as rk; robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> N = rk.nullspace_projector(robot, q)
    >>> np.allclose(N @ N, N), int(N.trace().round())
    (True, 2)
    """
    return asked(robot, q).N.copy()


def nullspace_projector_dot(robot: Manipulator, q, qd) -> np.ndarray:
    """dN_J/dt = -(J^+ Jdot N_J) - (J^+ Jdot N_J)^T, (..., 2N, 2N) in 1/s, of the text after (24), which prints B for J.

    Raises ValueError at c-space singularities and for open loops.

    >>> import numpy as np, rapkm_lite as rk; robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> N, N_dot = rk.nullspace_projector(robot, q), rk.nullspace_projector_dot(robot, q, q)
    >>> np.allclose(N @ N_dot + N_dot @ N, N_dot)
    True
    """
    return asked(robot, q, qd).N_dot.copy()


def redundant_dynamics(robot: Manipulator, q, qd) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """G~, C~, Q~ of (24), the terms of (23):  G~ qdd + C~ qd + Q~ = A~^T c, valid wherever J has full rank.

    It is (22), N_J (G qdd + C qd + Q) = A~^T c, with the motion projected to V, N_J qd and N_J qdd + Ndot_J qd:
    G~ = N_J G N_J, C~ = N_J (C N_J + G Ndot_J), both (..., 2N, 2N); Q~ = N_J Q, (..., 2N).
    Raises ValueError at c-space singularities and for open loops.

    >>> import numpy as np, rapkm_lite as rk; robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> G, C, Q = rk.redundant_dynamics(robot, q, q)
    >>> np.allclose(rk.nullspace_projector(robot, q) @ G, G)
    True
    """
    G, C, Q = asked(robot, q, qd).redundant
    return G.copy(), C.copy(), Q.copy()


def forward_dynamics(robot: Manipulator, q, qd, c) -> tuple[np.ndarray, np.ndarray]:
    """Accelerations qdd (..., 2N) in rad/s^2 and multipliers lambda (..., 2(N-1)) in N: (2) with J qdd + Jdot qd = 0.

    The multipliers are the cut-joint reactions: -lambda_i is the force in N that the end-effector exerts on the tip of
    the cut arm i (1, 3, ..., N; arm 2 is not cut and carries the load).
    Raises ValueError at c-space singularities, for a q that leaves the loops open, and for rates that open them.

    >>> import rapkm_lite as rk; robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> qdd, reactions = rk.forward_dynamics(robot, q, 0 * q, [0.1, 0.0, 0.0])
    >>> qdd.round(1)
    array([ 8.5, -2.9, -2. , -8.6, -5.9,  9.2])
    """
    pose, c = asked(robot, q, real_array("qd", qd)), real_array("c", c, robot.n_arms)
    lead = check_leading(q=pose.q.shape[:-1], qd=pose.qd.shape[:-1], c=c.shape[:-1])
    _ = pose.N  # raises where J has lost rank
    cores.check_tangent(robot.tree, pose.J, pose.qd)
    rhs = np.concatenate([c, np.zeros_like(c)], axis=-1) - matvec(pose.C, pose.qd) - pose.Q
    n, r = robot.n_joints, robot.n_constraints
    saddle = np.zeros((*lead, n + r, n + r))
    saddle[..., :n, :n], saddle[..., :n, n:], saddle[..., n:, :n] = pose.G, pose.J.mT, pose.J
    right = np.zeros((*lead, n + r))
    right[..., :n], right[..., n:] = rhs, -matvec(pose.J_dot, pose.qd)
    solution = np.linalg.solve(saddle, right[..., None])[..., 0]
    return solution[..., :n], solution[..., n:]


def kinetic_energy(robot: Manipulator, q, qd) -> np.ndarray:
    """qd^T G qd / 2, (...,) in J.

    >>> import numpy as np, rapkm_lite as rk; robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> np.allclose(rk.kinetic_energy(robot, q, q), q @ rk.mass_matrix(robot, q) @ q / 2)
    True
    """
    pose = asked(robot, q, real_array("qd", qd))
    return np.einsum("...i,...ij,...j->...", pose.qd, pose.G, pose.qd) / 2


def potential_energy(robot: Manipulator, q) -> np.ndarray:
    """Potential energy of gravity relative to the base points, (...,) in J; dV/dq is the gravity part of Q.

    >>> import rapkm_lite as rk; robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> float(rk.potential_energy(robot.replace(gravity=[0.0, -9.81]), q).round(3))
    0.172
    """
    pose = asked(robot, q)
    moments = robot.arm_moments / robot.lengths
    return -((moments[:, :1] * pose.a + moments[:, 1:] * pose.d) @ robot.gravity).sum(axis=-1)
