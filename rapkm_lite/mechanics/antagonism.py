"""Torques that move nothing: null space of A^T, antagonism filter (15), (17), and the state of rest (13)-(14)."""

from __future__ import annotations

import numpy as np

from ..machine.arguments import (
    bounded,
    check_leading,
    exact_array,
    matvec,
    positive_definite,
    positive_number,
    real_array,
    shaped,
    short,
    tall_matrix,
)
from ..machine.manipulator import Manipulator, manipulator
from . import cores
from .actuation import control_matrix, required_wrench, weighted_pseudoinverse
from .at import at
from .kinematics import cross
from .linalg import product
from .redundancy import most_even


def antagonism_filter(A) -> np.ndarray:
    """R = (A^T)^+ A^T of (15), (..., m, m): removes the part of the torques that only prestresses; A^T R = A^T.

    The orthogonal projector onto the range of A, in the space of drive torques.
    Raises ValueError at input singularities.

    >>> import rapkm_lite as rk
    >>> rk.antagonism_filter([[1.0, 0.0], [0.0, 1.0], [1.0, 0.0]]) @ [1.0, 2.0, 0.0]
    array([0.5, 2. , 0.5])
    """
    Q, _ = cores.full_rank("A", tall_matrix("A", A))
    return product(Q, Q.mT)


def command_filter(A, K) -> np.ndarray:
    """R_{A^T K} = (A^T K)^+ A^T K of (17), (..., m, m), for a gain K (number, (m,) or (m, m)), applied to errors.

    -K R_{A^T K} e has the end-effector force of the filtered -R K e; the same torques in general only for K = k_P I.
    Raises ValueError at input singularities, and for gains that are not positive definite or too far apart.

    >>> import numpy as np, rapkm_lite as rk; robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> A = rk.control_matrix(robot, q)
    >>> np.allclose(rk.command_filter(A, 7.05), rk.antagonism_filter(A))
    True
    """
    A = tall_matrix("A", A)
    K = positive_definite("K", K, A.shape[-2])
    check_leading(A=A.shape[:-2], K=K.shape[:-2])
    Q, _, _ = cores.uneven_rank("K A", K @ A)
    return product(Q, Q.mT)


def null_basis(A) -> np.ndarray:
    """Orthonormal basis of the torques that move nothing, A^T n = 0, (..., m, m - delta), for any A (..., m, delta).

    A smooth function of A where it exists, so along paths, and the same for one pose as in a path.  With m - delta
    = 1 it is the unit vector with det[A | n] > 0; for three arms `null_vector`.  With more, all but the last vector
    face fixed references as nearly as the null space allows (the projections of (1, ..., 1) and of the cosines and
    sines of twice, three times ... the drive's share of a turn, made orthonormal in this order), and the last one
    completes them to det[A | basis] > 0.  No basis can be smooth everywhere: this one turns fast near the isolated
    poses where a reference drops out of the null space.
    Raises ValueError at input singularities, and where a reference drops out exactly.

    >>> import rapkm_lite as rk
    >>> rk.null_basis([[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]])[:, 0]
    array([0., 0., 1.])
    """
    A = tall_matrix("A", A)
    m, delta = A.shape[-2:]
    cores.full_rank("A", A)
    anywhere = cores.null_space(A)
    if m > delta:
        # Any orthonormal basis, turned by U: the columns of U but the last from its components along the references.
        # With @ one pose takes the steps of many; `product` would round differently.
        U, R = np.linalg.qr(anywhere.mT @ _references(m)[:, : m - delta - 1], mode="complete")
        size = np.diagonal(R, axis1=-2, axis2=-1)
        if np.any(np.abs(size) < 1e-12):
            raise ValueError("A has no reference left in its null space; allowed: any other pose, also one close by")
        U[..., :-1] *= np.sign(size)[..., None, :]
        anywhere = anywhere @ U
        unit = A / np.linalg.norm(A, axis=-2, keepdims=True)
        anywhere[..., -1] *= np.sign(np.linalg.det(np.concatenate([unit, anywhere], axis=-1)))[..., None]
    return anywhere


def _references(m: int) -> np.ndarray:
    """Harmonics of the drive number without the first one, which spans the range of A of a symmetric machine."""
    turn = 2 * np.pi * np.arange(m) / m
    waves = [wave(k * turn) for k in range(2, m // 2 + 1) for wave in (np.cos, np.sin)]
    return np.stack([np.ones(m), *waves], axis=-1)


def null_vector(robot: Manipulator, q) -> np.ndarray:
    """Unit null vector of A^T for three arms in closed form, (..., 3): n_i ~ (a_i x d_i) (d_j x d_k), i, j, k cyclic.

    Its sign is that of the cross product of the two columns of A, as in `null_basis`, which takes any number of drives.
    Raises ValueError for another number of arms, open loops, and at input (null plane) and c-space singularities.

    >>> import rapkm_lite as rk; robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> rk.null_vector(robot, q).round(3)
    array([0.384, 0.711, 0.59 ])
    """
    if manipulator(robot).n_arms != 3:
        raise ValueError(f"robot has {robot.n_arms} arms; allowed: 3 (null_basis takes any number)")
    pose = at(robot, q)
    _ = pose._closed
    d = pose.d / robot.lengths[:, 1:]
    levers = cross(pose.a, d)
    n = levers * cross(np.roll(d, -1, axis=-2), np.roll(d, -2, axis=-2))
    size = np.linalg.norm(n, axis=-1, keepdims=True)
    if np.any(size < 1e-12 * robot.lengths[:, 0].max()):
        _ = pose.N  # says so at a c-space singularity, where no arm has a lever
        raise ValueError(
            "q is an input singularity (all distal links parallel), where the null space of A^T is a plane; allowed: "
            "poses with degree of actuation 2"
        )
    return n / (size * np.where(levers < 0.0, -1.0, 1.0).prod(axis=-1, keepdims=True))


def common_sign(A) -> np.ndarray:
    """Can a prestress load all drives with one sign, the surest way past the backlash of gears?  Boolean (...,).

    A : (..., m, delta), of any mechanism.
    A^T n = 0 with all n_i > 0 exists exactly where the rows of A do not fit into a half space (Stiemke): in the plane,
    delta = 2, where the largest gap between their directions is below a half turn; with one null direction where all
    its n_i have the same sign; otherwise a linear programme for each A, some milliseconds, finds the most even n.
    Raises ValueError at input singularities.

    >>> import rapkm_lite as rk; robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> bool(rk.common_sign(rk.control_matrix(robot, q)))
    True
    """
    A = tall_matrix("A", A)
    cores.full_rank("A", A)
    size = np.linalg.norm(A, axis=-1, keepdims=True)
    if A.shape[-1] == 2 and np.all(size > 0.0):  # a drive without any direction fits into every half plane
        angle = np.sort(np.arctan2(A[..., 1], A[..., 0]), axis=-1)
        gaps = np.diff(np.concatenate([angle, angle[..., :1] + 2 * np.pi], axis=-1), axis=-1)
        return gaps.max(axis=-1) < np.pi - 1e-12  # opposite rows leave a half turn, rounded
    # Rows of equal length: no sign changes, and none of the n_i is small merely because of its units.
    basis = cores.null_space(A / np.where(size > 0.0, size, 1.0))
    least = np.array([most_even(basis[index]) for index in np.ndindex(A.shape[:-2])])
    return (least > 1e-12).reshape(A.shape[:-2])[()]


def steady_state_error(A, K_P, offset, wrench=None) -> np.ndarray:
    """Error e_a = q_a - q_a^d (..., m) in rad at rest under PD with offsets, (14) corrected:

    e_a = -A (A^T K_P A)^-1 (A^T K_P offset + wrench).  The printed formula has shapes that do not fit.  It solves the
    equilibrium (13), A^T K_P (e_a + offset) + wrench = 0, for small errors e_a = A e_x.

    offset : (..., m) in rad, measured minus true angle.  K_P : positive definite, N m/rad.
    wrench : static control force A^T c (..., delta) that gravity and load demand (Qbar at rest); default none.
    Raises ValueError at input singularities, and for gains that are not positive definite or too far apart.

    >>> import rapkm_lite as rk; robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> rk.steady_state_error(rk.control_matrix(robot, q), 7.05, [4e-3, 0.0, 0.0]).round(5)
    array([-0.00341,  0.00109,  0.00091])
    """
    L, Q, _, sprung, carried = _springs(A, K_P, offset, wrench)
    return -np.linalg.solve(L.mT, matvec(Q, matvec(Q.mT, sprung) + carried)[..., None])[..., 0]


def steady_state_torque(A, K_P, offset, wrench=None) -> np.ndarray:
    """Torques c = -K_P (e_a + offset) (..., m) in N m at rest, from (12)-(14); all antagonism without wrench.

    Arguments and errors: see `steady_state_error`.  The text after (14) prints the opposite sign.

    >>> import rapkm_lite as rk; robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> rk.steady_state_torque(rk.control_matrix(robot, q), 7.05, [4e-3, 0.0, 0.0]).round(4)
    array([-0.0042, -0.0077, -0.0064])
    """
    L, Q, n, sprung, carried = _springs(A, K_P, offset, wrench)
    # K_P (e_a + offset) itself would cancel where one drive is much stiffer than the others.
    return matvec(L, matvec(Q, carried) - matvec(n, matvec(n.mT, sprung)))


def _springs(A, K_P, offset, wrench) -> tuple[np.ndarray, ...]:
    """L of K_P = L L^T, orthonormal Q and n of the range of L^T A and of its complement, L^T offset, wrench along Q."""
    A = tall_matrix("A", A)
    cores.full_rank("A", A)
    offset = real_array("offset", offset, A.shape[-2])
    K = positive_definite("K_P", K_P, A.shape[-2])
    wrench = real_array("wrench", np.zeros(A.shape[-1]) if wrench is None else wrench, A.shape[-1])
    check_leading(A=A.shape[:-2], offset=offset.shape[:-1], K_P=K.shape[:-2], wrench=wrench.shape[:-1])
    L = np.linalg.cholesky(K)  # A^T K_P A itself would square the condition number of A
    Q, R, n = cores.uneven_rank("A weighted with K_P", L.mT @ A)
    return L, Q, n, matvec(L.mT, offset), np.linalg.solve(R.mT, wrench[..., None])[..., 0]


def rest_exists(robot: Manipulator, q, K_P, offset, quantum: float, friction: float) -> bool:
    """Is there a place of rest near the desired pose q (2N,) for PD drives with stepped angles and Coulomb friction?

    True when counts exist that a pose of the closed loops reads, and whose torques differ by no more than the friction
    of each drive from torques that carry the weight, prestress included: a place of rest exists, to first order about q
    and with exact rates.  It does for K_P quantum <= 2 friction, whatever the offsets; a run may still not find it.
    K_P : number, (N,) or (N, N), N m/rad.  offset : (N,) rad.  quantum : angle of one count, rad.
    friction : number, N m of each drive.
    Decided by mixed-integer programming, to its tolerance, a millionth of a count.
    Raises ValueError at input singularities, for open loops, stretched or folded arms and values out of range, and for
    gains more than a factor of 1e4 apart: soft drives would have too many counts to try.

    >>> import rapkm_lite as rk; robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> rk.rest_exists(robot, q, 7.05, [4e-3, -2e-3, 5e-3], quantum=3e-3, friction=0.02)
    True
    """
    from scipy.optimize import Bounds, milp

    N = manipulator(robot).n_arms
    desired = exact_array("q", q, robot.n_joints)[:N]
    offset, quantum = exact_array("offset", offset, N), positive_number("quantum", quantum)
    friction = float(bounded("friction", exact_array("friction", friction), 0.0, strict=False))
    K = positive_definite("K_P", K_P, N)
    shaped("K_P", K, K.ndim == 2, f"one number, ({N},) or ({N}, {N}), one pose")
    A, weight = control_matrix(robot, q), required_wrench(robot, q, np.zeros(2 * N), np.zeros(2 * N))
    carrying, free = matvec(weighted_pseudoinverse(A), weight), cores.null_space(A)
    step = quantum * np.abs(K).sum(axis=-1)  # of a torque, where all angles are a count off
    if np.all(step <= 2 * friction):
        return True
    if step.max() > 1e4 * step.min():
        raise ValueError(
            f"K_P = {short(K_P)} is too unequal to try all counts; allowed: gains of up to 1e4 times another"
        )
    # Unknown are whole counts k from `near`, a displacement x that reads them, near + k = zero + A x to half a count,
    # and a prestress y with -K (quantum (near + k) - desired) = carrying + free y to the friction of each drive.
    zero = (desired + offset) / quantum
    near = np.rint(zero)
    torque = -matvec(K, quantum * near - desired) - carrying
    read = np.hstack([np.eye(N), -A / np.abs(A).max(), 0 * free])
    carried = np.hstack([quantum * K, 0 * A, step.max() * free]) / step[:, None]
    middle, half = np.concatenate([zero - near, torque / step]), np.concatenate([np.full(N, 0.5), friction / step])
    found = milp(
        np.zeros(2 * N),
        constraints=(np.vstack([read, carried]), middle - half, middle + half),
        integrality=np.repeat([1, 0], N),
        bounds=Bounds(-np.inf, np.inf),
    )
    return found.status == 0
