r"""The chapter's numbered equations as they are printed, one test each, evaluated with the functions of the package.

The docstring of a test carries the printed formula, letter by letter that of notebooks/equations.md; the body evaluates
it term by term, in the print's symbols.  Numbers that cannot hold as printed are in tests/test_audit.py.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from samples import MACHINES, along, norm, random_motion

import rapkm_lite as rk

T = lambda M: np.swapaxes(M, -1, -2)  # noqa: E731
mv = lambda M, v: np.einsum("...ij,...j->...i", M, v)  # noqa: E731
zero = lambda *terms: (norm(sum(terms)) / sum(map(norm, terms))).max()  # noqa: E731  residual on the scale of its terms

# Unequal arms, friction, gravity and a load, so that no term of an equation is idle.
ROBOT = MACHINES["asymmetric"].replace(gravity=[0.4, -0.9], load=0.1)
M_DRIVES, N_JOINTS = ROBOT.n_arms, ROBOT.n_joints
q, qd, qdd, (x, xd, xdd) = random_motion(ROBOT, 60, bend=0.3)
good = np.abs(rk.distal_cross_products(ROBOT, q)[:, 0]) > 0.05  # the angles of drives 1 and 2 are coordinates
q, qd, qdd, x, xd, xdd = (v[good] for v in (q, qd, qdd, x, xd, xdd))
q2, q1 = [0, 1], [2, 3, 4, 5]  # independent and dependent coordinates
c = np.random.default_rng(3).normal(0, 0.1, (len(q), M_DRIVES))
u = np.concatenate([c, 0 * c], axis=-1)
J, J_dot = rk.constraint_jacobian(ROBOT, q), rk.constraint_jacobian_dot(ROBOT, q, qd)
G, C, Q = rk.mass_matrix(ROBOT, q), rk.coriolis_matrix(ROBOT, q, qd), rk.generalized_forces(ROBOT, q, qd)
F, F_dot = rk.orthogonal_complement(ROBOT, q, q2), rk.orthogonal_complement_dot(ROBOT, q, qd, q2)
Gbar, Cbar, Qbar = rk.minimal_dynamics(ROBOT, q, qd, q2)
A = rk.control_matrix(ROBOT, q, q2)
N_J, A_tilde = rk.nullspace_projector(ROBOT, q), rk.redundant_control_matrix(ROBOT, q)
A_tilde_T_pinv = rk.explicit_pseudoinverse(A_tilde, rk.select_independent(A_tilde))
accelerated, multipliers = rk.forward_dynamics(ROBOT, q, qd, c)
OFFSET = np.array([0.004, -0.002, 0.005])
GAINS = np.array([4.0, 7.0, 11.0])


def near():
    """The poses and rates above, and a desired motion near them, a millimetre and a centimetre per second away."""
    rng = np.random.default_rng(6)
    x_d, xd_d = x + rng.normal(0, 1e-3, x.shape), xd + rng.normal(0, 1e-2, x.shape)
    q_d = rk.inverse_kinematics(ROBOT, x_d)
    to_joints = rk.orthogonal_complement(ROBOT, q_d)
    qd_d = mv(to_joints, xd_d)
    qdd_d = mv(to_joints, xdd) + mv(rk.orthogonal_complement_dot(ROBOT, q_d, qd_d), xd_d)
    return q, qd, rk.Desired(M_DRIVES, x_d, xd_d, xdd, q_d, qd_d, qdd_d)


def sample(desired, k):
    d = desired
    return rk.Desired(M_DRIVES, *(v[k] for v in (d.x, d.xd, d.xdd, d.q, d.qd, d.qdd)))


def torque(law, q, qd, desired, offset=0.0):
    return law.torque(ROBOT, q, qd, q[..., :M_DRIVES] + offset, qd[..., :M_DRIVES], desired)


def test_eq_01():
    r"""(1): $0 = h(q),\quad h(q) \in \mathbb{R}^{r}$ and $0 = J(q)\dot{q},\quad J(q) \in \mathbb{R}^{r,n}$."""
    h = rk.loop_constraints(ROBOT, q)
    assert h.shape[-1] == ROBOT.n_constraints and np.abs(h).max() < 1e-14
    assert J.shape[-2:] == (ROBOT.n_constraints, N_JOINTS)
    assert norm(mv(J, qd)).max() < 1e-13 * norm(J).max() * norm(qd).max()
    # Both lines are one: the second is the time derivative of the first.
    h_dot = along(lambda p: rk.loop_constraints(ROBOT, p), q, np.ones_like(q), 1e-3)
    assert_allclose(mv(rk.constraint_jacobian(ROBOT, q), np.ones(N_JOINTS)), h_dot, atol=1e-12)


def test_eq_02():
    r"""(2): $G(q)\ddot{q} + C(q,\dot{q})\dot{q} + Q(q,\dot{q},t) + J^{T}(q)\lambda = u$."""
    qdd, reaction = rk.forward_dynamics(ROBOT, q, qd, c)
    left = [
        mv(rk.mass_matrix(ROBOT, q), qdd),
        mv(rk.coriolis_matrix(ROBOT, q, qd), qd),
        rk.generalized_forces(ROBOT, q, qd),
        mv(T(J), reaction),
    ]
    assert zero(*left, -u) < 1e-11


def test_eq_03():
    r"""(3): $V := \lbrace q \in \mathbb{V}^{n} \mid h(q) = 0 \rbrace$."""
    rough = q + np.random.default_rng(4).normal(0, 0.05, q.shape)
    assert norm(rk.loop_constraints(ROBOT, rough)).min() > 1e-3  # not in V
    closed = rk.close_loops(ROBOT, rough)
    assert norm(rk.loop_constraints(ROBOT, closed)).max() < 1e-12  # in V
    assert_allclose(rk.close_loops(ROBOT, q), q, atol=1e-12)  # members stay where they are


def test_eq_04():
    r"""(4): $J_1\dot{q}_1 + J_2\dot{q}_2 = 0$."""
    J = rk.constraint_jacobian(ROBOT, q)
    J1, J2 = J[..., q1], J[..., q2]
    assert zero(mv(J1, qd[:, q1]), mv(J2, qd[:, q2])) < 1e-13
    F = rk.orthogonal_complement(ROBOT, q, q2)  # its dependent rows solve it for every q2d
    assert norm(J1 @ F[:, q1] + J2).max() < 1e-12


def test_eq_05():
    r"""(5): $\dot{q} = F\dot{q}_2$ where $F := \begin{pmatrix} -J_1^{-1}J_2 \cr I_\delta \end{pmatrix}$."""
    F = rk.orthogonal_complement(ROBOT, q, q2)
    assert_allclose(F[:, q1], -np.linalg.inv(J[..., q1]) @ J[..., q2], rtol=1e-9, atol=1e-9)
    assert np.array_equal(F[:, q2], np.broadcast_to(np.eye(2), (len(q), 2, 2)))
    assert_allclose(mv(F, qd[:, q2]), qd, atol=1e-11 * np.abs(qd).max())
    assert norm(J @ F).max() < 1e-13 * norm(F).max()
    # After it: qdd = F q2dd + Fdot q2d.
    assert zero(mv(F, qdd[:, q2]), mv(F_dot, qd[:, q2]), -qdd) < 1e-11


def test_eq_06():
    r"""(6): $\overline{G}(q)\ddot{q}_2 + \overline{C}(q,\dot{q})\dot{q}_2 + \overline{Q}(q,\dot{q},t) = A^{T}(q)c$."""
    Gbar, Cbar, Qbar = rk.minimal_dynamics(ROBOT, q, qd, q2)
    A = rk.control_matrix(ROBOT, q, q2)
    assert zero(mv(Gbar, accelerated[:, q2]), mv(Cbar, qd[:, q2]), Qbar, -mv(T(A), c)) < 1e-10
    # Before it: F^T u = A^T c and qd_a = A q2d.
    assert_allclose(mv(T(F), u), mv(T(A), c), atol=1e-12 * norm(F).max())
    assert_allclose(mv(A, qd[:, q2]), qd[:, :M_DRIVES], atol=1e-11 * np.abs(qd).max())


def test_eq_07():
    r"""(7): $\overline{G} := F^{T}GF,\quad \overline{C} := F^{T}(CF + G\dot{F}),\quad \overline{Q} := F^{T}Q$."""
    rate = along(lambda p: rk.orthogonal_complement(ROBOT, rk.inverse_kinematics(ROBOT, p), q2), x, xd, 2e-5)
    Gbar, Cbar, Qbar = rk.minimal_dynamics(ROBOT, q, qd, q2)
    assert_allclose(Gbar, T(F) @ G @ F, rtol=1e-12, atol=1e-14)
    assert_allclose(Qbar, mv(T(F), Q), rtol=1e-12, atol=1e-12)
    assert (norm(Cbar - T(F) @ (C @ F + G @ rate)) / norm(Cbar)).max() < 1e-5


def control_system():
    """Drift field f and control fields g^i (the columns of g) at the states (q2, q2d)."""
    f = np.concatenate([qd[:, q2], -mv(np.linalg.inv(Gbar), mv(Cbar, qd[:, q2]) + Qbar)], axis=-1)
    fields = rk.control_vector_fields(ROBOT, q, q2)
    return f, np.concatenate([0 * fields, fields], axis=-2)


def test_eq_08():
    r"""(8): $\dot{x} = f(x) + \sum_{i=1}^{m} g^{i}(x)c_i$, the fields from `control_vector_fields`."""
    f, g = control_system()
    state_rate = np.concatenate([qd[:, q2], accelerated[:, q2]], axis=-1)
    assert zero(f, *(g[..., i] * c[:, i, None] for i in range(M_DRIVES)), -state_rate) < 1e-10
    assert rk.control_vector_fields(ROBOT, q, q2).shape[-1] == M_DRIVES


def test_eq_09():
    r"""(9): $f := \begin{pmatrix} \dot{q}_2 \cr
    -\overline{G}^{-1}(\overline{C}\dot{q}_2 + \overline{Q}) \end{pmatrix}$,
    $g := \begin{pmatrix} 0 \cr \overline{G}^{-1}A^{T} \end{pmatrix}$."""
    # f is what the machine does without drives, the columns of g what each drive adds per N m.
    f, g = control_system()
    alone, _ = rk.forward_dynamics(ROBOT, q, qd, 0 * c)
    assert zero(f[:, 2:], -alone[:, q2]) < 1e-10
    assert_allclose(rk.control_vector_fields(ROBOT, q, q2), np.linalg.inv(Gbar) @ T(A), rtol=1e-9, atol=1e-9)
    for i, one in enumerate(np.eye(M_DRIVES)):
        more, _ = rk.forward_dynamics(ROBOT, q, qd, one)
        assert (norm(more[:, q2] - alone[:, q2] - g[:, 2:, i]) / norm(more[:, q2])).max() < 1e-10


def test_eq_11():
    r"""(11): $c = (A^{T})_W^{+}F^{T}(G(q)\ddot{q} + C(q,\dot{q})\dot{q} + Q(q,\dot{q})) + N_{A^{T},W}c^{0}$ and
    $= (A^{T})_W^{+}(\overline{G}(q)\ddot{q}_2 + \overline{C}(q,\dot{q})\dot{q}_2 + \overline{Q}(q,\dot{q}))
    + N_{A^{T},W}c^{0}$."""
    root = np.random.default_rng(5).normal(size=(M_DRIVES, M_DRIVES))
    W, c0 = root @ root.T + np.eye(M_DRIVES), np.array([0.1, -0.05, 0.2])
    V = np.linalg.inv(W)
    pinv = V @ A @ np.linalg.inv(T(A) @ V @ A)  # after (11)
    N_AW = np.eye(M_DRIVES) - pinv @ T(A)
    first = mv(pinv, mv(T(F), mv(G, qdd) + mv(C, qd) + Q)) + mv(N_AW, c0)
    second = mv(pinv, mv(Gbar, qdd[:, q2]) + mv(Cbar, qd[:, q2]) + Qbar) + mv(N_AW, c0)
    ours = rk.inverse_dynamics(ROBOT, q, qd, qdd, W, c0)
    assert_allclose(rk.weighted_pseudoinverse(A, W), pinv, atol=1e-10)
    assert_allclose(rk.prestress_projector(A, W), N_AW, atol=1e-10)
    assert (norm(first - ours) / norm(ours)).max() < 1e-10 and (norm(second - ours) / norm(ours)).max() < 1e-10
    # It is what (11) says: of all torques for this motion the ones with the smallest (c - c0)^T W (c - c0).
    gradient = mv(W, ours - c0)
    assert_allclose(mv(rk.prestress_projector(A).swapaxes(-1, -2), gradient), 0, atol=1e-10 * np.abs(gradient).max())


def test_eq_12():
    r"""(12): $c = -K_P\tilde{e}_a - K_D\dot{\tilde{e}}_a$."""
    pose, rate, desired = near()
    e_measured = pose[:, :M_DRIVES] + OFFSET - desired.q_a
    ed_measured = rate[:, :M_DRIVES] - desired.qd_a  # a constant offset has no rate
    law = rk.PD(GAINS, 0.1 * GAINS)
    printed = -mv(np.diag(GAINS), e_measured) - mv(np.diag(0.1 * GAINS), ed_measured)
    assert_allclose(torque(law, pose, rate, desired, OFFSET), printed, atol=1e-14)


def test_eq_13():
    r"""(13): $0 = A^{T}(q)c^{0} = -A^{T}(q)K_P\tilde{e}_a = -A^{T}(q)K_P(e_a + \Delta q_a)$."""
    e_a, c0 = rk.steady_state_error(A, GAINS, OFFSET), rk.steady_state_torque(A, GAINS, OFFSET)
    scale = norm(A).max() * np.abs(c0).max()
    assert norm(mv(T(A), c0)).max() < 1e-12 * scale
    assert norm(-mv(T(A), GAINS * (e_a + OFFSET))).max() < 1e-12 * scale
    assert np.median(norm(c0)) > 5e-3  # rest, and torques all the same


def test_eq_15():
    r"""(15): $R_{A^{T}} := I - N_{A^{T}} = (A^{T})^{+}A^{T}$."""
    R = rk.antagonism_filter(A)
    assert_allclose(R, np.eye(M_DRIVES) - rk.prestress_projector(A), atol=1e-11)
    assert_allclose(R, np.linalg.pinv(T(A)) @ T(A), atol=1e-10)


def test_eq_16():
    r"""(16): $c_\mathrm{eff} = R_{A^{T}}c$, for any commands c."""
    pose, rate, desired = near()
    R = rk.antagonism_filter(rk.control_matrix(ROBOT, pose))
    for law in (rk.PD(GAINS, 0.1 * GAINS), rk.CTC(400.0, 40.0, None)):
        plain = torque(law, pose, rate, desired, OFFSET)
        c_eff = torque(rk.AntagonismFilter(law), pose, rate, desired, OFFSET)
        assert_allclose(c_eff, mv(R, plain), atol=1e-13 * np.abs(plain).max())
        force = T(rk.control_matrix(ROBOT, pose))
        assert_allclose(mv(force, c_eff), mv(force, plain), atol=1e-12 * norm(force).max() * np.abs(plain).max())


def test_eq_19():
    r"""(19): $c = (A^{T}(q))^{+}[\overline{G}(q)\ddot{q}_2^{d} + \overline{C}(q,\dot{q})\dot{q}_2^{d}
    + \overline{Q}(q,\dot{q}) - K_D\dot{e}_2 - K_Pe_2]$."""
    pose, rate, d = near()
    G2, C2, Q2 = rk.minimal_dynamics(ROBOT, pose, rate, q2)
    K_P, K_D = np.array([30.0, 50.0]), np.array([3.0, 4.0])
    e2, e2d = (pose - d.q)[:, q2], (rate - d.qd)[:, q2]
    bracket = mv(G2, d.qdd[:, q2]) + mv(C2, d.qd[:, q2]) + Q2 - K_D * e2d - K_P * e2
    printed = mv(np.linalg.pinv(T(rk.control_matrix(ROBOT, pose, q2))), bracket)
    assert (norm(torque(rk.APD(K_P, K_D, q2), pose, rate, d) - printed) / norm(printed)).max() < 1e-10


def test_eq_20():
    r"""(20): $c = (A^{T}(q))^{+}[\overline{G}(q)v_2 + \overline{C}(q,\dot{q})\dot{q}_2 + \overline{Q}(q,\dot{q})]$,
    for `CTC`, and for `SwitchedCTC` while it uses the pair (1, 2)."""
    pose, rate, d = near()
    G2, C2, Q2 = rk.minimal_dynamics(ROBOT, pose, rate, q2)
    K_P, K_D = np.array([300.0, 500.0]), np.array([30.0, 40.0])
    v2 = d.qdd[:, q2] - K_D * (rate - d.qd)[:, q2] - K_P * (pose - d.q)[:, q2]  # after (20)
    pinv = np.linalg.pinv(T(rk.control_matrix(ROBOT, pose, q2)))
    printed = mv(pinv, mv(G2, v2) + mv(C2, rate[:, q2]) + Q2)
    assert (norm(torque(rk.CTC(K_P, K_D, q2), pose, rate, d) - printed) / norm(printed)).max() < 1e-10
    switched = rk.SwitchedCTC(K_P, K_D)
    chosen = [k for k in range(len(pose)) if tuple(switched.choose(ROBOT, pose[k])) == (0, 1)]
    assert len(chosen) > 3
    for k in chosen:
        assert_allclose(
            torque(switched, pose[k], rate[k], sample(d, k)), printed[k], atol=1e-10 * np.abs(printed[k]).max()
        )


def test_eq_21():
    r"""(21): $N_J = \begin{pmatrix} \tilde{P} \cr \tilde{A} \end{pmatrix}
    \begin{matrix} (n-m) \times n \cr m \times n \end{matrix}$, with the joint order $(q_p, q_a)$ of the print."""
    N_J, A_tilde = rk.nullspace_projector(ROBOT, q), rk.redundant_control_matrix(ROBOT, q)
    passive, actuated = np.split(np.arange(N_JOINTS), [M_DRIVES])[::-1]
    P_tilde = N_J[:, passive]
    assert P_tilde.shape[-2:] == (N_JOINTS - M_DRIVES, N_JOINTS) and A_tilde.shape[-2:] == (M_DRIVES, N_JOINTS)
    printed_order = np.concatenate([passive, actuated])
    assert np.array_equal(N_J[:, printed_order], np.concatenate([P_tilde, A_tilde], axis=-2))
    assert_allclose(mv(A_tilde, qd), qd[:, :M_DRIVES], atol=1e-13 * np.abs(qd).max())  # after it: qd_a = A~ qd


def test_eq_22():
    r"""(22): $N_J(G(q)\ddot{q} + C(q,\dot{q})\dot{q} + Q(q,\dot{q},t)) = \tilde{A}^{T}c$."""
    N_J = rk.nullspace_projector(ROBOT, q)
    assert_allclose(N_J, np.eye(N_JOINTS) - np.linalg.pinv(J) @ J, atol=1e-12)  # text before (21)
    left = [mv(N_J, v) for v in (mv(G, accelerated), mv(C, qd), Q)]
    assert zero(*left, -mv(T(rk.redundant_control_matrix(ROBOT, q)), c)) < 1e-11
    # After it, corrected: motions are projected by N_J qd and N_J qdd + Ndot_J qd; that makes (23) of it.
    Gt, Ct, Qt = rk.redundant_dynamics(ROBOT, q, qd)
    projected = mv(N_J, accelerated) + mv(rk.nullspace_projector_dot(ROBOT, q, qd), qd)
    assert zero(*(mv(N_J, v) for v in (mv(G, projected), mv(C, qd), Q)), -mv(Gt, accelerated), -mv(Ct, qd), -Qt) < 1e-11


def test_eq_23():
    r"""(23): $\tilde{G}(q)\ddot{q} + \tilde{C}(q,\dot{q})\dot{q} + \tilde{Q}(q) = \tilde{A}^{T}c$."""
    Gt, Ct, Qt = rk.redundant_dynamics(ROBOT, q, qd)
    A_tilde = rk.redundant_control_matrix(ROBOT, q)
    assert zero(mv(Gt, accelerated), mv(Ct, qd), Qt, -mv(T(A_tilde), c)) < 1e-11


def test_eq_24():
    r"""(24): $\tilde{G} := N_J^{T}GN_J,\quad \tilde{C} := N_J^{T}(CN_J + G\dot{N}_J),\quad \tilde{Q} := N_J^{T}Q$."""
    rate = along(lambda p: rk.nullspace_projector(ROBOT, rk.inverse_kinematics(ROBOT, p)), x, xd, 5e-5)
    assert (norm(rk.nullspace_projector_dot(ROBOT, q, qd) - rate) / norm(rate)).max() < 1e-6
    Gt, Ct, Qt = rk.redundant_dynamics(ROBOT, q, qd)
    assert_allclose(Gt, T(N_J) @ G @ N_J, atol=1e-14)
    assert_allclose(Qt, mv(T(N_J), Q), atol=1e-13)
    assert (norm(Ct - T(N_J) @ (C @ N_J + G @ rate)) / norm(Ct)).max() < 1e-6


def test_eq_25():
    r"""(25): $c = (\tilde{A}^{T})^{+}N_J(G(q)\ddot{q} + C(q,\dot{q})\dot{q} + Q(q,\dot{q},t))$."""
    pinv = rk.explicit_pseudoinverse(A_tilde, rk.select_independent(A_tilde))
    printed = mv(pinv @ N_J, mv(G, qdd) + mv(C, qd) + Q)
    ours = rk.inverse_dynamics(ROBOT, q, qd, qdd)
    assert (norm(printed - ours) / norm(ours)).max() < 1e-10
    again, _ = rk.forward_dynamics(ROBOT, q, qd, printed)
    assert (norm(again - qdd) / norm(qdd)).max() < 1e-9


@pytest.mark.parametrize("rule", ["sigma_min", "condition"])
def test_eq_26(rule):
    r"""(26): $\tilde{A} = \begin{pmatrix} \tilde{A}_1 \cr \tilde{A}_2 \end{pmatrix}$, A~_1 of full rank."""
    rows = rk.select_independent(A_tilde, rule)
    A1 = np.take_along_axis(A_tilde, rows[..., None], axis=-2)
    assert A1.shape[-2:] == (2, N_JOINTS)
    assert np.linalg.svd(A1, compute_uv=False)[:, 1].min() > 0.05
    # The remaining rows are combinations of A~_1, so that rank A~ = delta.
    others = A_tilde - A_tilde @ np.linalg.pinv(A1) @ A1
    assert norm(others).max() < 1e-12


def test_eq_27():
    r"""(27): $(\tilde{A}^{T})^{+} = \begin{pmatrix} (\tilde{A}_1^{T})^{+}(I_n - \tilde{A}_2^{T}(I_{m-\delta}
    + B^{T}B)^{-1}B^{T}(\tilde{A}_1^{T})^{+}) \cr (I_{m-\delta} + B^{T}B)^{-1}B^{T}(\tilde{A}_1^{T})^{+} \end{pmatrix}$.

    Evaluated as printed, for every valid partition of three and of four arms; the result does not depend on it.
    """
    for robot in (ROBOT, MACHINES["testbed"], MACHINES["four_arms"]):
        m, n = robot.n_arms, robot.n_joints
        whole = rk.redundant_control_matrix(robot, random_motion(robot, 60, bend=0.3)[0])
        for rows in rk.drive_pairs(robot):
            rest = [i for i in range(m) if i not in rows]
            part = whole[np.linalg.svd(whole[:, rows], compute_uv=False)[:, 1] > 0.05]
            A1, A2 = part[:, rows], part[:, rest]
            A1T_pinv = np.linalg.inv(A1 @ T(A1)) @ A1  # after (27)
            B = A1T_pinv @ T(A2)  # delta x (m - delta)
            inner = np.linalg.inv(np.eye(m - 2) + T(B) @ B)  # the only new inverse, (m - delta) x (m - delta)
            assert B.shape[-2:] == (2, m - 2) and inner.shape[-2:] == (m - 2, m - 2)
            printed = np.empty_like(part)
            printed[:, rows] = A1T_pinv @ (np.eye(n) - T(A2) @ inner @ T(B) @ A1T_pinv)
            printed[:, rest] = inner @ T(B) @ A1T_pinv
            assert_allclose(rk.explicit_pseudoinverse(part, rows), printed, atol=1e-10)
            assert_allclose(np.linalg.pinv(T(part), rcond=1e-9), printed, atol=1e-10)


def test_eq_29():
    r"""(29): $K = \mathrm{diag}(0, \ldots, 0, K_1, \ldots, K_m)$, with the joint order $(q_p, q_a)$ of the print."""
    pose, rate, desired = near()
    K_P, K_D = np.array([400.0, 500.0, 600.0]), np.array([40.0, 45.0, 50.0])
    for law in (rk.RedundantAPD, rk.RedundantCTC):
        ours = torque(law(K_P, K_D), pose, rate, desired)
        free = torque(law(1e-9, 1e-9), pose, rate, desired)  # the feed-forward alone
        e, ed = pose - desired.q, rate - desired.qd
        printed = lambda K: np.diag([*K, 0, 0, 0])  # noqa: E731  our joint order is (q_a, q_p)
        feedback = mv(printed(K_P), e) + mv(printed(K_D), ed)
        At = rk.redundant_control_matrix(ROBOT, pose)
        pinv = rk.explicit_pseudoinverse(At, rk.select_independent(At))
        if law is rk.RedundantCTC:
            feedback = mv(rk.redundant_dynamics(ROBOT, pose, rate)[0], feedback)
        assert (norm(free - mv(pinv, feedback) - ours) / norm(ours)).max() < 1e-8
        assert np.linalg.matrix_rank(printed(K_P)) == M_DRIVES


def test_eq_30():
    r"""(30): $\tilde{G}\ddot{q} - D\tilde{G}\ddot{q}^{d} + \tilde{C}\dot{q} - D\tilde{C}\dot{q}^{d} + \tilde{Q}
    - D\tilde{Q} + DK_D\dot{e} + DK_Pe = 0$."""
    pose, rate, d = near()
    At = rk.redundant_control_matrix(ROBOT, pose)
    D = T(At) @ np.linalg.pinv(T(At), rcond=1e-9)
    assert_allclose(rk.closed_loop_projector(At), D, atol=1e-10)
    Gt, Ct, Qt = rk.redundant_dynamics(ROBOT, pose, rate)
    on_all, on_drives = rk.RedundantAPD(60.0, 6.0), rk.RedundantAPD([60, 70, 80], [6, 7, 8])
    for law, k in ((on_all, [60] * 6), (on_drives, [60, 70, 80, 0, 0, 0])):
        K_P, K_D = np.diag(k), np.diag(k) / 10
        qdd, _ = rk.forward_dynamics(ROBOT, pose, rate, torque(law, pose, rate, d))
        terms = [
            mv(Gt, qdd),
            -mv(D @ Gt, d.qdd),
            mv(Ct, rate),
            -mv(D @ Ct, d.qd),
            Qt,
            -mv(D, Qt),
            mv(D @ K_D, rate - d.qd),
            mv(D @ K_P, pose - d.q),
        ]
        assert zero(*terms) < 1e-10


def test_eq_31():
    r"""(31): $\mathcal{V}(\dot{e},e,t) = \frac{1}{2}\dot{e}^{T}\tilde{G}(q)\dot{e} + \frac{1}{2}e^{T}K_Pe
    + \frac{1}{2}\varepsilon e^{T}\tilde{G}(q)\dot{e}$."""
    pose, rate, d = near()
    e, ed = pose - d.q, rate - d.qd
    Gt, _, _ = rk.redundant_dynamics(ROBOT, pose, rate)
    form = lambda a, M, b: np.einsum("ki,kij,kj->k", a, np.broadcast_to(M, Gt.shape), b)  # noqa: E731
    for K, diagonal in ((40.0, [40.0] * 6), ([30.0, 40.0, 50.0], [30.0, 40.0, 50.0, 0, 0, 0])):
        for eps in (0.0, 0.7):
            printed = form(ed, Gt, ed) / 2 + form(e, np.diag(diagonal), e) / 2 + eps * form(e, Gt, ed) / 2
            extra = {"eps": eps} if eps else {}
            assert_allclose(rk.lyapunov_function(ROBOT, pose, e, ed, K, **extra), printed, rtol=1e-10)


def closed_loop():
    """Acceleration and error terms of the redundant CTC law, line 1 of (32) with v = qdd^d - K_D ed - K_P e."""
    pose, rate, d = near()
    K_P, K_D = np.array([300.0, 400.0, 500.0]), np.array([30.0, 40.0, 45.0])
    c = torque(rk.RedundantCTC(K_P, K_D), pose, rate, d)
    qdd, _ = rk.forward_dynamics(ROBOT, pose, rate, c)
    gain = lambda K: np.array([*K, 0, 0, 0])  # noqa: E731
    return pose, rate, d, qdd, qdd - d.qdd, gain(K_D) * (rate - d.qd), gain(K_P) * (pose - d.q)


def test_eq_34():
    r"""(34): $P_2\tilde{G}(\ddot{e} + K_D\dot{e} + K_Pe) = 0$, for `RedundantCTC`, P_2 taking the rows of q_2."""
    pose, rate, _, _, *terms = closed_loop()
    Gt, _, _ = rk.redundant_dynamics(ROBOT, pose, rate)
    P2 = np.eye(N_JOINTS)[q2]
    assert zero(*(mv(P2 @ Gt, t) for t in terms)) < 1e-10
    assert zero(*(mv(Gt, t) for t in terms)) < 1e-10  # all n rows hold; only delta of them are independent
