"""The theory for any mechanism: what (4)-(7) and (21)-(24) need of it are matrices.

J (..., r, n) constraint Jacobian of full rank, G and C (..., n, n), Q (..., n) of the tree (2).  So take any mechanism:
`weighted_pseudoinverse`, `prestress_projector`, `antagonism_filter`, `command_filter`, `null_basis`, `common_sign`,
`singular_values`, `steady_state_error` and `steady_state_torque` for A (..., m, delta), `allocate_torques` and
`minimax_torques` for one A; `explicit_pseudoinverse`, `select_independent` and `closed_loop_projector` for A~
(..., m, n); `effective_gain` for F (..., n, delta).  The functions of a `Manipulator` evaluate the same formulas.
"""

from __future__ import annotations

import numpy as np

from ..machine.arguments import check_leading, joint_indices, real_array, shaped, sized
from . import cores


def complement(J, independent) -> np.ndarray:
    """F of (5), qd = F q2d with J F = 0, (..., n, n - r), for any mechanism.

    independent : the n - r indices of q2, 0-based; the columns of F follow them, the rows the order of q.
    Raises ValueError where J1, the other columns of J, is singular.

    >>> import rapkm_lite as rk
    >>> rk.complement([[1.0, 1.0, 0.0]], independent=(1, 2))
    array([[-1., -0.],
           [ 1.,  0.],
           [ 0.,  1.]])
    """
    J = _jacobian(J)
    r, n = J.shape[-2:]
    return cores.joint_complement(J, joint_indices("independent", independent, n, n - r), of_pose=False)


def complement_dot(J, J_dot, independent) -> np.ndarray:
    """dF/dt of `complement`, (..., n, n - r); from J F = 0 the dependent rows are -J1^-1 Jdot F.

    J_dot : (..., r, n), dJ/dt.  Raises ValueError where J1 is singular.

    >>> import rapkm_lite as rk
    >>> rk.complement_dot([[1.0, 1.0, 0.0]], [[0.0, 2.0, 0.0]], independent=(1, 2))
    array([[-2., -0.],
           [ 0.,  0.],
           [ 0.,  0.]])
    """
    J, J_dot = _jacobians(J, J_dot)
    independent = joint_indices("independent", independent, J.shape[-1], J.shape[-1] - J.shape[-2])
    return cores.joint_complement_dot(J, J_dot, complement(J, independent), independent)


def projector(J) -> np.ndarray:
    """N_J = I - J^+ J of section 4.3, (..., n, n): orthogonal onto the null space of J, for any mechanism.

    Where the joints have different units, so have its entries, and feedback through it depends on their choice.
    Raises ValueError where J lacks full rank.

    >>> import rapkm_lite as rk
    >>> rk.projector([[1.0, 0.0, 0.0]]) @ [1.0, 2.0, 3.0]
    array([0., 2., 3.])
    """
    return cores.projector(*_row_space(_jacobian(J)))


def projector_dot(J, J_dot) -> np.ndarray:
    """dN_J/dt = -(J^+ Jdot N_J) - (J^+ Jdot N_J)^T, (..., n, n), of the text after (24), which prints B for J.

    J_dot : (..., r, n), dJ/dt.  Raises ValueError where J lacks full rank.

    >>> import rapkm_lite as rk
    >>> float(rk.projector_dot([[1.0, 0.0]], [[0.0, 2.0]])[0, 1])
    -2.0
    """
    J, J_dot = _jacobians(J, J_dot)
    Q, R = _row_space(J)
    return cores.projector_dot(Q, R, J_dot, cores.projector(Q, R))


def minimal_terms(F, F_dot, G, C, Q) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Gbar, Cbar, Qbar of (7) from F, F_dot (..., n, delta) and G, C, Q: (..., delta, delta) twice, (..., delta).

    Raises ValueError where F and F_dot differ in shape, or G, C (..., n, n), Q (..., n) are of another n.

    >>> import numpy as np, rapkm_lite as rk
    >>> Gbar, Cbar, Qbar = rk.minimal_terms([[1.0], [2.0]], [[0.0], [0.0]], np.eye(2), np.zeros((2, 2)), [0.0, 1.0])
    >>> Gbar, Qbar
    (array([[5.]]), array([2.]))
    """
    F, F_dot = real_array("F", F), real_array("F_dot", F_dot)
    if F.ndim < 2 or F_dot.shape != F.shape:
        raise ValueError(f"F has shape {F.shape} and F_dot {F_dot.shape}; allowed: (..., n, delta), both the same")
    return cores.minimal(F, F_dot, *_tree(F, G, C, Q))


def redundant_terms(N, N_dot, G, C, Q) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """G~, C~, Q~ of (24) from N_J, N_dot (..., n, n) and G, C, Q of the tree: (..., n, n) twice, (..., n).

    Raises ValueError unless N and N_dot are square and of one shape, or where G, C, Q are of another n.

    >>> import numpy as np, rapkm_lite as rk
    >>> N = rk.projector([[1.0, 0.0]])
    >>> rk.redundant_terms(N, 0 * N, np.eye(2), np.zeros((2, 2)), [1.0, 1.0])[2]
    array([0., 1.])
    """
    N, N_dot = real_array("N", N), real_array("N_dot", N_dot)
    if N.ndim < 2 or N.shape[-1] != N.shape[-2] or N_dot.shape != N.shape:
        raise ValueError(f"N has shape {N.shape} and N_dot {N_dot.shape}; allowed: (..., n, n), both the same")
    return cores.redundant(N, N_dot, *_tree(N, G, C, Q))


def _jacobian(J) -> np.ndarray:
    J = real_array("J", J)
    fits = J.ndim >= 2 and 1 <= J.shape[-2] < J.shape[-1]
    return sized("J", shaped("J", J, fits, "(..., r, n) with 1 <= r < n"))


def _jacobians(J, J_dot) -> tuple[np.ndarray, np.ndarray]:
    J, J_dot = _jacobian(J), real_array("J_dot", J_dot)
    return J, shaped("J_dot", J_dot, J_dot.shape == J.shape, f"{J.shape}, as J")


def _row_space(J: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    size = np.maximum(np.abs(J).max(axis=(-2, -1), keepdims=True), 1e-300)
    Q, R = cores.row_space(J / size, 1.0, of_pose=False)
    return Q, size * R


def _tree(motion: np.ndarray, G, C, Q) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    n = motion.shape[-2]
    G, C, Q = real_array("G", G, n, n), real_array("C", C, n, n), real_array("Q", Q, n)
    check_leading(motion=motion.shape[:-2], G=G.shape[:-2], C=C.shape[:-2], Q=Q.shape[:-1])
    return G, C, Q
