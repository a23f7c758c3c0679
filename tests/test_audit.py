r"""The audit of the chapter: for each misprint, the printed form failing and the corrected form holding.

Printed forms that cannot hold live here and nowhere else.  notebooks/errata.md lists them all, each with its test.
Where a numbered equation is concerned, the docstring carries its printed formula, as in the equation index.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from samples import FRICTIONLESS, MACHINES, TESTBED, along, norm, random_motion, random_points
from scipy.optimize import least_squares

import rapkm_lite as rk

T = lambda M: np.swapaxes(M, -1, -2)  # noqa: E731
mv = lambda M, v: np.einsum("...ij,...j->...i", M, v)  # noqa: E731
PAIRS = [(0, 1), (0, 2), (1, 2)]
OFFSET = np.array([0.004, -0.002, 0.005])
X = np.array([0.04, -0.03])
Q = rk.inverse_kinematics(TESTBED, X)
A = rk.control_matrix(TESTBED, Q)
A_TILDE = rk.redundant_control_matrix(TESTBED, Q)
UNEQUAL = np.array([4.0, 7.0, 11.0])


def test_introduction_counts_control_vector_fields_against_the_state_space():
    # Printed: more control vector fields than the dimension of the state space.  The state is (q2, q2d), of dimension
    # 2 delta; what m exceeds is delta.
    delta = rk.control_vector_fields(TESTBED, Q).shape[0]
    m, state = TESTBED.n_arms, 2 * delta
    assert rk.control_vector_fields(TESTBED, Q).shape[1] == m and not m > state
    assert m > delta


def test_introduction_redundant_formulation_does_not_use_minimal_coordinates():
    # Printed: "does use".  On the curve of the pair (1, 2) the form in its angles is lost, the redundant one is not.
    point = TESTBED.base[:2].mean(axis=0)
    q = rk.inverse_kinematics(TESTBED, point)
    assert abs(rk.distal_cross_products(TESTBED, q)[0]) < 1e-14
    with pytest.raises(ValueError, match="singular here"):
        rk.minimal_dynamics(TESTBED, q, 0 * q, (0, 1))
    G, _, _ = rk.redundant_dynamics(TESTBED, q, 0 * q)
    assert np.linalg.matrix_rank(G, rtol=1e-9) == 2 and np.abs(G).max() < 0.1


def test_introduction_parameterization_singularities_are_input_singularities_of_the_pair_only():
    # Printed: they "are also input singularities", which 2.2 defines by a degree of actuation that changes.  Along a
    # side of the base the curve of its pair is crossed; only the five-bar of that pair loses a degree there.
    for i, k in PAIRS:
        (start, end), pair = TESTBED.base[[i, k]], TESTBED.with_arms((i, k))
        middle, ahead = (start + end) / 2, (end - start) / 8
        x = middle + np.outer([-1.0, -1e-3, 0.0, 1e-3, 1.0], ahead)
        q, two = rk.inverse_kinematics(TESTBED, x), rk.inverse_kinematics(pair, x)
        assert abs(rk.distal_cross_products(TESTBED, q[2])[PAIRS.index((i, k))]) < 1e-14
        assert rk.degree_of_actuation(pair, two).tolist() == [2, 2, 1, 2, 2]
        assert rk.degree_of_actuation(TESTBED, q).tolist() == [2, 2, 2, 2, 2]
        assert rk.singular_values(rk.control_matrix(TESTBED, q))[..., 1].min() > 1.0  # rad/m


def test_text_after_7_degree_of_freedom():
    for robot in MACHINES.values():
        n, m, r = robot.n_joints, robot.n_arms, robot.n_constraints
        q = rk.inverse_kinematics(robot, random_points(robot, 1)[0])
        assert rk.degree_of_freedom(robot, q) == n - r == 2
        assert (n - m == 2) == (m == 2)  # the printed n - m is right for the five-bar alone


def test_eq_10_rank_of_the_control_vector_fields():
    r"""(10): $\alpha(q) := \mathrm{rank}\overline{M}(q)$; M is defined nowhere; the mass matrix it cannot be."""
    # At the midpoint of a base side a mixed mode loses a direction; the rank of the mass matrix does not notice.
    modes = [m for m in rk.working_modes(TESTBED) if abs(m.sum()) == 1]
    poses = [
        (TESTBED.replace(mode=m), rk.inverse_kinematics(TESTBED, (TESTBED.base[i] + TESTBED.base[i - 1]) / 2, m))
        for m in modes
        for i in range(3)
    ]
    robot, q = next((robot, q) for robot, q in poses if np.abs(rk.distal_cross_products(robot, q)).max() < 1e-12)
    mass, _, _ = rk.minimal_dynamics(robot, q, 0 * q)
    assert np.linalg.matrix_rank(mass) == 2
    assert np.linalg.matrix_rank(rk.control_vector_fields(robot, q), rtol=1e-9) == 1
    assert np.linalg.matrix_rank(rk.control_matrix(robot, q), rtol=1e-9) == rk.degree_of_actuation(robot, q) == 1


def test_section_4_5_calls_the_redundant_control_matrix_m():
    # Printed: the projected 6 x 3 control matrix M~ has rank 2.  That is A~^T; the M of (10) is the same letter, A^T.
    assert A_TILDE.T.shape == (6, 3) and np.linalg.matrix_rank(A_TILDE.T, rtol=1e-9) == 2
    assert A.T.shape == (2, 3)


def test_section_3_2_projects_onto_the_range_of_a_not_of_its_transpose():
    # A^T maps torques to forces: its range is all of R^delta.  R acts in the space of drive torques, on the range of A.
    R = rk.antagonism_filter(A)
    assert np.linalg.matrix_rank(A.T) == len(A.T) == 2  # every force; nothing to project
    assert R.shape == (3, 3)
    with pytest.raises(ValueError, match="matmul"):
        R @ A.T
    assert_allclose(R @ A, A, atol=1e-13)
    # (17) likewise: R_{A^T K} projects onto the range of K A.
    K = np.diag(UNEQUAL)
    assert_allclose(rk.command_filter(A, UNEQUAL) @ K @ A, K @ A, atol=1e-12)


def test_section_3_1_antagonism_is_of_the_pd_scheme_12_and_does_not_exist_under_model_based_laws():
    # Printed: the scheme (13), and a problem that "does exist" for model-based schemes.  (13) is a condition at rest;
    # torques of (11) lie in the range of A.
    q, qd, qdd, _ = random_motion(FRICTIONLESS, 100, bend=0.3)
    prestress = rk.prestress_projector(rk.control_matrix(FRICTIONLESS, q))
    model_based = rk.inverse_dynamics(FRICTIONLESS, q, qd, qdd)
    assert (norm(mv(prestress, model_based)) / norm(model_based)).max() < 1e-12
    target = rk.Desired(3, X, np.zeros(2), np.zeros(2), Q, 0 * Q, 0 * Q)
    pd, ctc = rk.PD(7.05, 0.225), rk.CTC(400.0, 40.0, None)
    left = [
        np.abs(rk.prestress_projector(A) @ law.torque(TESTBED, Q, 0 * Q, Q[:3] + OFFSET, np.zeros(3), target)).max()
        for law in (pd, ctc)
    ]
    assert left[0] > 1e-2 and left[1] < 1e-15


def test_text_before_13_the_measured_angles_are_no_pose_that_is_attained():
    # Printed: the pose q~_a that is attained.  At rest the machine stands at q_a, and q~_a = q_a + offset fits no pose.
    run = rk.simulate(FRICTIONLESS, rk.PD(7.05, 0.225), rk.hold(FRICTIONLESS, [0.0, 0.0], 3.0), offset=OFFSET)
    assert np.abs(run.qd_a[-1]).max() < 1e-9
    q_a, read = run.q_a[-1], run.q_a[-1] + OFFSET
    apart = [np.linalg.norm(angles - rk.estimate_pose(FRICTIONLESS, angles, [0.0, 0.0])[:3]) for angles in (q_a, read)]
    assert apart[0] < 1e-12
    assert_allclose(1e3 * apart[1], 4.05, atol=0.005)  # what errata print
    # To first order it is the part of the offsets along the null vector, (4 - 2 + 5) / sqrt(3) mrad.
    assert_allclose(apart[1], OFFSET.sum() / np.sqrt(3), rtol=np.linalg.norm(OFFSET))


def test_eq_14_steady_state_error():
    r"""(14): $e_a = -K_P^{-1}(A^{T})^{+}K_P\Delta q_a$."""
    K = np.diag(UNEQUAL)
    with pytest.raises(ValueError, match="matmul"):  # (m x delta) times (m x m): the shapes do not fit
        -np.linalg.inv(K) @ np.linalg.pinv(A.T) @ K @ OFFSET
    completed = lambda K: -np.linalg.inv(K) @ np.linalg.pinv(A.T) @ A.T @ K @ OFFSET  # noqa: E731
    assert_allclose(completed(7 * np.eye(3)), rk.steady_state_error(A, 7.0, OFFSET), atol=1e-15)
    leaves = rk.prestress_projector(A)  # tangent to V means in the range of A
    assert np.abs(leaves @ completed(K)).max() > 1e-4
    e_a = rk.steady_state_error(A, UNEQUAL, OFFSET)
    assert np.abs(leaves @ e_a).max() < 1e-15
    assert np.abs(A.T @ (K @ (e_a + OFFSET))).max() < 1e-13  # (13)


def test_after_eq_14_sign_of_the_prestress():
    # By (12) the drives answer the measured error e_a + offset with a torque against it.
    e_a = rk.steady_state_error(A, UNEQUAL, OFFSET)
    pd = rk.PD(UNEQUAL, 0.1)
    desired = rk.Desired(3, X, np.zeros(2), np.zeros(2), Q, 0 * Q, 0 * Q)
    c0 = pd.torque(TESTBED, Q, 0 * Q, Q[:3] + e_a + OFFSET, np.zeros(3), desired)
    assert_allclose(c0, rk.steady_state_torque(A, UNEQUAL, OFFSET), atol=1e-14)
    assert np.abs(c0 - UNEQUAL * (e_a + OFFSET)).max() > 1e-2


def test_eq_17_filters_of_commands_and_of_torques():
    r"""(17): $e_\mathrm{eff} = R_{A^{T}K_P}\tilde{e}_a,\quad \dot{e}_\mathrm{eff} = R_{A^{T}K_D}\dot{\tilde{e}}_a$.

    The definition stands; that it carries (16) over to commands holds for equal gains only.
    """
    e = np.array([0.01, -0.02, 0.015])
    for K, same in ((7 * np.eye(3), True), (np.diag(UNEQUAL), False)):
        by_16, by_17 = rk.antagonism_filter(A) @ K @ e, K @ rk.command_filter(A, K) @ e
        assert_allclose(A.T @ by_16, A.T @ by_17, atol=1e-13)
        assert np.allclose(by_16, by_17, atol=1e-12) == same
        left = np.abs(rk.prestress_projector(A) @ by_17).max()
        assert (left < 1e-14) == same


def test_eq_18_commands_are_formed_with_the_measured_angles():
    r"""(18): $q_\mathrm{eff}^{d} = q_a - e_\mathrm{eff},\quad \dot{q}_\mathrm{eff}^{d} = \dot{q}_a
    - \dot{e}_\mathrm{eff}$."""
    K, e = 7.05 * np.eye(3), np.array([0.01, -0.02, 0.015])
    q_a = Q[:3] + e
    measured = q_a + OFFSET
    R = rk.command_filter(A, K)
    drive = lambda command: -K @ (measured - command)  # noqa: E731  what a drive does with its command
    printed, correct = drive(q_a - R @ (e + OFFSET)), drive(measured - R @ (e + OFFSET))
    desired = rk.Desired(3, X, np.zeros(2), np.zeros(2), Q, 0 * Q, 0 * Q)
    command, _ = rk.CommandFilter(rk.PD(7.05, 0.2)).commands(TESTBED, Q, measured, np.zeros(3), desired)
    assert_allclose(drive(command), correct, atol=1e-14)
    prestress = rk.prestress_projector(A)
    assert np.abs(prestress @ correct).max() < 1e-14
    assert_allclose(prestress @ printed, -prestress @ K @ OFFSET, atol=1e-14)  # the offset slips past the filter
    assert np.abs(prestress @ printed).max() > 1e-3


def test_text_before_21_numbers_of_passive_and_actuated_joints():
    # (21) itself carries the right sizes, (n - m) x n and m x n; the sentence before it says m passive, delta actuated.
    for robot in MACHINES.values():
        n, m = robot.n_joints, robot.n_arms
        q = rk.inverse_kinematics(robot, random_points(robot, 1)[0])
        N, actuated = rk.nullspace_projector(robot, q), rk.redundant_control_matrix(robot, q)
        assert actuated.shape == (m, n) and np.array_equal(N[: len(actuated)], actuated)
        assert len(N) - len(actuated) == n - m  # passive rows
        assert (m + 2 == n) == (m == 2)  # "m passive, delta actuated" is the whole of n for the five-bar alone


def test_text_before_23_projection_of_the_acceleration_takes_the_rate_of_the_projector():
    # Printed: qdd_proj = N_J qdd.
    x, xd, xdd = X, np.array([0.3, -0.2]), np.array([1.0, 2.0])
    F = rk.orthogonal_complement(FRICTIONLESS, Q)
    qd = F @ xd
    qdd = F @ xdd + rk.orthogonal_complement_dot(FRICTIONLESS, Q, qd) @ xd
    N, N_dot = rk.nullspace_projector(FRICTIONLESS, Q), rk.nullspace_projector_dot(FRICTIONLESS, Q, qd)
    J, J_dot = rk.constraint_jacobian(FRICTIONLESS, Q), rk.constraint_jacobian_dot(FRICTIONLESS, Q, qd)
    printed, correct = N @ qdd, N @ qdd + N_dot @ qd
    assert_allclose(rk.forward_kinematics(FRICTIONLESS, Q), x, atol=1e-15)
    assert np.abs(J @ printed + J_dot @ qd).max() > 0.1  # m/s^2, torn loops
    assert_allclose(J @ correct + J_dot @ qd, 0, atol=1e-14)
    assert_allclose(correct, qdd, atol=1e-13)  # what satisfies the constraints is not changed by the projection
    G, C = rk.mass_matrix(FRICTIONLESS, Q), rk.coriolis_matrix(FRICTIONLESS, Q, qd)
    left = lambda a: N @ (G @ a + C @ qd)  # noqa: E731  left-hand side of (22)
    change = np.linalg.norm(left(printed) - left(qdd), np.inf) / np.linalg.norm(left(qdd), np.inf)
    assert 0.10 < change < 0.12
    # Only the right one yields (24).
    Gt, Ct, _ = rk.redundant_dynamics(FRICTIONLESS, Q, qd)
    off = np.random.default_rng(0).normal(size=6)  # a measured acceleration off the constraints
    assert_allclose(Gt @ off + Ct @ qd, left(N @ off + N_dot @ qd), atol=1e-14)
    assert np.abs(Gt @ off + Ct @ qd - left(N @ off)).max() > 1e-3


def test_eq_23_the_forces_depend_on_the_velocity():
    r"""(23): $\tilde{G}(q)\ddot{q} + \tilde{C}(q,\dot{q})\dot{q} + \tilde{Q}(q) = \tilde{A}^{T}c$."""
    qd = rk.orthogonal_complement(TESTBED, Q) @ [0.3, -0.2]
    there, back, rest = (rk.redundant_dynamics(TESTBED, Q, s * qd)[2] for s in (1.0, -1.0, 0.0))
    friction = TESTBED.friction * np.sign(qd[:3])
    assert np.abs(TESTBED.friction - 4.2e-3).max() < 1e-15 and np.abs(qd[:3]).min() > 10 * TESTBED.friction_velocity
    assert_allclose(there, A_TILDE.T @ friction, atol=1e-8)  # what (24) makes of it
    assert_allclose(back, -there, rtol=1e-12)
    assert np.abs(rest).max() == 0.0 and np.abs(there).max() > 1e-3
    # Gravity alone is a function of the pose.
    heavy = FRICTIONLESS.replace(gravity=(0.0, -9.81))
    weight = [rk.redundant_dynamics(heavy, Q, s * qd)[2] for s in (1.0, -1.0)]
    assert np.abs(weight[0]).max() > 0.1 and np.array_equal(*weight)


def test_text_after_24_rate_of_the_projector_takes_j_where_b_is_printed():
    q, qd, _, (x, xd, _) = random_motion(TESTBED, 50, bend=0.2)
    N, J = rk.nullspace_projector(TESTBED, q), rk.constraint_jacobian(TESTBED, q)
    J_dot = rk.constraint_jacobian_dot(TESTBED, q, qd)
    B = A_TILDE[2:] @ np.linalg.pinv(A_TILDE[:2])  # the B of (27)
    with pytest.raises(ValueError, match="matmul"):
        np.linalg.pinv(B) @ J_dot @ N
    half = np.linalg.pinv(J) @ J_dot @ N
    rate = along(lambda p: rk.nullspace_projector(TESTBED, rk.inverse_kinematics(TESTBED, p)), x, xd, 5e-5)
    assert (norm(-half - T(half) - rate) / norm(rate)).max() < 1e-7
    assert (norm(-half - rate) / norm(rate)).max() > 0.1  # both terms are needed


def test_section_4_1_minimal_mass_matrix_diverges_at_parameterization_singularities():
    # Printed: Gbar is not regular there.  It is; F grows without bound, and one eigenvalue of Gbar with its square.
    path = rk.triangle(FRICTIONLESS)
    k = np.array([1000, 1250, 1285, 1290])
    cross = np.abs(rk.distal_cross_products(FRICTIONLESS, path.q[k])[:, 0])
    assert np.all(np.diff(cross) < 0) and cross[-1] < 1e-3
    smallest, largest = np.linalg.eigvalsh(rk.minimal_dynamics(FRICTIONLESS, path.q[k], 0 * path.q[k], (0, 1))[0]).T
    assert_allclose(largest[:3], [0.33, 47.0, 2300.0], rtol=0.05)
    assert_allclose(np.polyfit(np.log(cross[1:]), np.log(largest[1:]), 1)[0], -2, atol=0.02)
    assert smallest.min() > 5e-3  # regular all the way


def test_section_4_4_1_the_submatrix_to_select_is_a_1():
    # Printed: only the submatrix A~ must be selected.  A~ has all m rows and is not selected; A~_1 has delta of them.
    rows = rk.select_independent(A_TILDE)
    assert A_TILDE[rows].shape == (2, 6) and A_TILDE.shape == (3, 6)


def test_eq_25_projector_is_idle_and_the_result_is_that_of_11():
    q, qd, qdd, _ = random_motion(FRICTIONLESS, 200)
    A_tilde = rk.redundant_control_matrix(FRICTIONLESS, q)
    pinv = rk.explicit_pseudoinverse(A_tilde, rk.select_independent(A_tilde))
    assert (norm(pinv @ rk.nullspace_projector(FRICTIONLESS, q) - pinv) / norm(pinv)).max() < 1e-12
    force = mv(rk.mass_matrix(FRICTIONLESS, q), qdd) + mv(rk.coriolis_matrix(FRICTIONLESS, q, qd), qd)
    c = rk.inverse_dynamics(FRICTIONLESS, q, qd, qdd)
    assert (norm(mv(pinv, force) - c) / norm(c)).max() < 1e-10


def test_eq_27_switching_the_partition_makes_no_jump():
    path = rk.triangle(TESTBED, dt=5e-3)
    A_tilde = rk.redundant_control_matrix(TESTBED, path.q)
    peer = np.linalg.pinv(T(A_tilde), rcond=1e-10)
    for pair in PAIRS:
        usable = np.linalg.svd(A_tilde[:, pair, :], compute_uv=False)[:, 1] > 1e-3
        ours = rk.explicit_pseudoinverse(A_tilde[usable], pair)
        assert (norm(ours - peer[usable]) / norm(peer[usable])).max() < 1e-10
    rows = rk.select_independent(A_tilde)
    assert len(np.unique(rows, axis=0)) == 3  # it does switch along this path
    assert (norm(rk.explicit_pseudoinverse(A_tilde, rows) - peer) / norm(peer)).max() < 1e-12


def test_rule_of_section_4_5_is_the_wrong_way_round():
    _, _, printed = rk.switching_map(TESTBED, "printed", n=300)
    sigma = np.stack([rk.actuation_map(TESTBED, "sigma_min", n=300, pair=p)[2].compressed() for p in PAIRS])
    chosen = np.take_along_axis(sigma, printed.compressed()[None], axis=0)[0]
    best, worst = sigma.max(axis=0), sigma.min(axis=0)
    assert 0.2 < np.mean(chosen == best) < 0.3
    assert np.mean(chosen == worst) > 0.25
    assert chosen.min() < 1e-4
    assert best.min() > 0.2  # the best pair is well away from singular everywhere
    default = rk.switching_map(TESTBED, "sigma_min", n=300)[2].compressed()
    assert_allclose(np.take_along_axis(sigma, default[None], axis=0)[0], best, rtol=1e-6)


def redundant_apd_lines(e_x):
    """Both lines of (28) without gains, at the pose Q, for a desired pose e_x m beside it and equal x rates."""
    xd, xdd = np.array([0.3, -0.2]), np.array([1.0, 2.0])
    qd = rk.orthogonal_complement(FRICTIONLESS, Q) @ xd
    q_d = rk.inverse_kinematics(FRICTIONLESS, X - e_x)
    F = rk.orthogonal_complement(FRICTIONLESS, q_d)
    qd_d = F @ xd
    qdd_d = F @ xdd + rk.orthogonal_complement_dot(FRICTIONLESS, q_d, qd_d) @ xd
    N, G, C = (
        f(FRICTIONLESS, Q)
        for f in (rk.nullspace_projector, rk.mass_matrix, lambda robot, q: rk.coriolis_matrix(robot, q, qd))
    )
    Gt, Ct, _ = rk.redundant_dynamics(FRICTIONLESS, Q, qd)
    pinv = rk.explicit_pseudoinverse(A_TILDE, (0, 1))
    desired = rk.Desired(3, X - e_x, xd, xdd, q_d, qd_d, qdd_d)
    K = 1e-9  # gains so small that the feedback is nothing; it is the same in both lines
    lines = [rk.RedundantAPD(K, K, projected=line == 1) for line in (1, 2)]
    laws = [law.torque(FRICTIONLESS, Q, qd, Q[:3], qd[:3], desired) for law in lines]
    return pinv @ (Gt @ qdd_d + Ct @ qd_d), pinv @ N @ (G @ qdd_d + C @ qd_d), laws


def test_eq_28_the_two_lines_differ_off_the_path():
    r"""(28): $c = (\tilde{A}^{T})^{+}(\tilde{G}(q)\ddot{q}^{d} + \tilde{C}(\dot{q},q)\dot{q}^{d}
    + \tilde{Q}(q,\dot{q},t) - K_Pe - K_D\dot{e})$ and
    $= (\tilde{A}^{T})^{+}N_J(G(q)\ddot{q}^{d} + C(q,\dot{q})\dot{q}^{d} + Q(q,\dot{q},t) - K_Pe - K_D\dot{e})$."""
    differ = []
    for size in (0.0, 3e-3, 6e-3):
        ways = [redundant_apd_lines(size * np.array([np.cos(a), np.sin(a)])) for a in np.linspace(0, 2 * np.pi, 8)]
        for first, second, laws in ways:
            assert_allclose(laws, [first, second], atol=1e-9)  # the package takes either line
        differ.append(np.mean([np.linalg.norm(one - two) / np.linalg.norm(one) for one, two, _ in ways]))
    assert differ[0] < 1e-14  # equal on the path
    assert_allclose(1e2 * differ[2], 0.9, atol=0.05)  # percent at 6 mm
    assert_allclose(differ[2] / differ[1], 2, rtol=0.05)  # of first order in the error


def test_eq_29_with_31_the_potential_is_definite_on_tangent_errors_only():
    # Printed: with the gains (29), V is positive definite.  K_P has rank m of n; on the tangent space it is definite
    # wherever rank A = delta.
    K = np.diag([2.0, 2.0, 2.0, 0, 0, 0])
    assert np.linalg.matrix_rank(K) == 3
    elbows_only = np.array([0, 0, 0, 0.1, 0.1, 0.1])
    assert rk.lyapunov_function(FRICTIONLESS, Q, elbows_only, 0 * Q, [2.0] * 3) == 0  # an error, and no potential
    q = rk.inverse_kinematics(FRICTIONLESS, random_points(FRICTIONLESS, 200, bend=0.2))
    tangent = np.linalg.qr(rk.orthogonal_complement(FRICTIONLESS, q))[0]
    assert np.linalg.eigvalsh(T(tangent) @ K @ tangent).min() > 0.1
    # At an input singularity it is not.
    mode = (1, 1, -1)
    q = rk.inverse_kinematics(FRICTIONLESS, FRICTIONLESS.base[:2].mean(axis=0), mode)
    tangent = np.linalg.qr(rk.orthogonal_complement(FRICTIONLESS, q))[0]
    assert np.linalg.matrix_rank(rk.control_matrix(FRICTIONLESS, q), rtol=1e-9) == 1
    assert np.linalg.eigvalsh(tangent.T @ K @ tangent).min() < 1e-12


def test_after_eq_31_epsilon_must_be_small():
    # Printed: epsilon > 0.  The cross term e^T G~ ed outweighs the squares once epsilon is large.
    Gt, _, _ = rk.redundant_dynamics(FRICTIONLESS, Q, 0 * Q)
    F = np.linalg.qr(rk.orthogonal_complement(FRICTIONLESS, Q))[0]
    M, K = F.T @ Gt @ F, F.T @ np.diag([2.0, 2, 2, 0, 0, 0]) @ F
    smallest = lambda eps: np.linalg.eigvalsh(np.block([[M, eps / 2 * M], [eps / 2 * M, K]])).min()  # noqa: E731
    assert smallest(1.0) > 0 > smallest(50.0)
    # The bound: epsilon^2 / 4 M < K on tangent errors.
    bound = 2 * np.sqrt(np.linalg.eigvals(np.linalg.solve(M, K)).real.min())
    assert smallest(0.999 * bound) > 0 > smallest(1.001 * bound)


def test_eq_30_d_is_the_projector():
    for robot in MACHINES.values():
        q = rk.inverse_kinematics(robot, random_points(robot, 100, bend=0.3))
        A_tilde = rk.redundant_control_matrix(robot, q)
        ok = np.linalg.svd(A_tilde, compute_uv=False)[:, 1] > 0.05
        D = rk.closed_loop_projector(A_tilde[ok])
        assert norm(D - np.eye(robot.n_joints)).min() > 0.1  # D is not I
        assert norm(D - rk.nullspace_projector(robot, q[ok])).max() < 1e-12  # and it is N_J


def closed_loop(line, K, x=X):
    """-d(q2dd)/d(q2) at rest in the desired pose, q2 = x, under line 1 or 2 of (32), by central differences."""
    target = rk.inverse_kinematics(FRICTIONLESS, x)
    desired = rk.Desired(3, x, np.zeros(2), np.zeros(2), target, 0 * target, 0 * target)
    law = rk.RedundantCTC(K, 40.0, projected=line == 1)

    def acceleration(p):
        q = rk.inverse_kinematics(FRICTIONLESS, p)
        c = law.torque(FRICTIONLESS, q, 0 * q, q[:3], np.zeros(3), desired)
        qdd, _ = rk.forward_dynamics(FRICTIONLESS, q, 0 * q, c)
        return np.linalg.pinv(rk.orthogonal_complement(FRICTIONLESS, q)) @ qdd

    return -np.stack([along(lambda p: acceleration(p), x, e, 1e-4) for e in np.eye(2)], axis=-1)


def test_eq_32_sign_of_the_desired_acceleration_and_the_two_lines():
    r"""(32): $c = (\tilde{A}^{T})^{+}(\tilde{G}(q)v + \tilde{C}(\dot{q},q)\dot{q} + \tilde{Q}(q,\dot{q},t))$ and
    $= (\tilde{A}^{T})^{+}N_J(G(q)v + C(q,\dot{q})\dot{q} + Q(q,\dot{q},t))$, v = qdd - K_P e - K_D ed after it."""
    q, qd, qdd, (x, xd, xdd) = random_motion(FRICTIONLESS, 50)
    desired = rk.Desired(3, x, xd, xdd, q, qd, qdd)
    law = rk.RedundantCTC(400.0, 40.0)
    c = law.torque(FRICTIONLESS, q, qd, q[:, :3], qd[:, :3], desired)
    assert_allclose(rk.forward_dynamics(FRICTIONLESS, q, qd, c)[0], qdd, atol=1e-9 * np.abs(qdd).max())
    # Printed v = qdd - ... with the actual acceleration is no law: qdd follows from c, and c from qdd.
    # The lines differ by N_J G ((I - N_J) v - Ndot_J qd): not at all for a possible acceleration, J v + Jdot qd = 0.
    N, N_dot = rk.nullspace_projector(FRICTIONLESS, q), rk.nullspace_projector_dot(FRICTIONLESS, q, qd)
    G, C = rk.mass_matrix(FRICTIONLESS, q), rk.coriolis_matrix(FRICTIONLESS, q, qd)
    Gt, Ct, _ = rk.redundant_dynamics(FRICTIONLESS, q, qd)
    lines = lambda v: (mv(Gt, v) + mv(Ct, qd), mv(N, mv(G, v) + mv(C, qd)))  # noqa: E731
    v = np.random.default_rng(0).normal(size=q.shape)
    for tried, differ in ((v, True), (mv(N, v), True), (mv(N, v) + mv(N_dot, qd), False), (qdd, False)):
        first, second = lines(tried)
        assert_allclose(second - first, mv(N @ G, tried - mv(N, tried) - mv(N_dot, qd)), atol=1e-12)
        assert (norm(second - first).max() > 1e-3) == differ
    # Line 1 has the symmetric stiffness F^T K F, line 2 has F^T G K F.
    K = np.array([300.0, 500.0, 900.0, 200.0, 400.0, 100.0])
    q = rk.inverse_kinematics(FRICTIONLESS, X)
    F, G = rk.orthogonal_complement(FRICTIONLESS, q), rk.mass_matrix(FRICTIONLESS, q)
    skew = lambda S: abs(S[0, 1] - S[1, 0]) / np.abs(S).max()  # noqa: E731
    first, second = F.T @ F @ closed_loop(1, K), F.T @ G @ F @ closed_loop(2, K)
    assert_allclose(first, F.T @ np.diag(K) @ F, rtol=1e-6)
    assert_allclose(second, F.T @ G @ np.diag(K) @ F, rtol=1e-6)
    assert skew(first) < 1e-7 < 1e-2 < skew(second)


def test_eq_33_holds_for_a_projector_along_the_tangent_space_only():
    r"""(33): $P_1(\tilde{G}\ddot{q} + \tilde{C}\dot{q} + \tilde{Q}) = 0$, P_1 onto the dependent velocities.

    The bracket is A~^T c, by (23), and A~ has columns for the dependent joints too: taking the rows of the dependent
    coordinates is not enough.  A projector along the tangent space makes it vanish, for any torques: then it is 0 = 0.
    """
    q, qd, desired = off_path()
    law = rk.RedundantCTC([400.0] * 3, [40.0] * 3)
    c = law.torque(FRICTIONLESS, q, qd, q[:, :3], qd[:, :3], desired)
    qdd, _ = rk.forward_dynamics(FRICTIONLESS, q, qd, c)
    Gt, Ct, Qt = rk.redundant_dynamics(FRICTIONLESS, q, qd)
    bracket = mv(Gt, qdd) + mv(Ct, qd) + Qt
    forces = mv(T(rk.redundant_control_matrix(FRICTIONLESS, q)), c)
    assert (norm(bracket - forces) / norm(forces)).max() < 1e-9
    for pair in PAIRS:
        dependent = [j for j in range(6) if j not in pair]
        share = np.linalg.norm(bracket[:, dependent], axis=-1) / np.linalg.norm(bracket, axis=-1)
        assert_allclose(np.median(share), 0.87, atol=0.02)
        F = rk.orthogonal_complement(FRICTIONLESS, q, pair)
        oblique = np.eye(6) - F @ np.eye(6)[list(pair)]  # onto the dependent velocities, along the tangent space
        assert np.abs(oblique[:, pair, :]).max() == 0
        size = norm(oblique)
        assert (norm(mv(oblique, bracket)) / norm(bracket) / size).max() < 1e-9
        assert (norm(mv(oblique @ rk.nullspace_projector(FRICTIONLESS, q), 0 * q + 1)) / size).max() < 1e-12  # 0 = 0
    # What the dependent rows do obey is what the independent ones obey (34): G~ (edd + K_D ed + K_P e) = 0.
    gain = np.array([1.0, 1, 1, 0, 0, 0])
    terms = [mv(Gt, v) for v in (qdd - desired.qdd, 40 * gain * (qd - desired.qd), 400 * gain * (q - desired.q))]
    assert (norm(sum(terms)) / sum(map(norm, terms))).max() < 1e-9


def off_path():
    """A motion and a desired one a few millimetres beside it, both on V."""
    q, qd, _, (x, xd, xdd) = random_motion(FRICTIONLESS, 50, bend=0.3)
    q_d = rk.inverse_kinematics(FRICTIONLESS, x + 2e-3)
    F = rk.orthogonal_complement(FRICTIONLESS, q_d)
    qd_d = mv(F, xd)
    qdd_d = mv(F, xdd) + mv(rk.orthogonal_complement_dot(FRICTIONLESS, q_d, qd_d), xd)
    return q, qd, rk.Desired(3, x + 2e-3, xd, xdd, q_d, qd_d, qdd_d)


def test_eq_35_effective_gain():
    r"""(35): $\overline{G}(\ddot{e}_2 + F^{T}K_DF\dot{e}_2 + F^{T}K_PFe_2) = 0$."""
    # Gains on the driven joints, as on the testbed, where only these are measured.
    K = np.diag([400.0, 400, 400, 0, 0, 0])
    F = rk.orthogonal_complement(FRICTIONLESS, rk.inverse_kinematics(FRICTIONLESS, X))
    found = closed_loop(1, [400.0, 400.0, 400.0])
    assert_allclose(found, rk.effective_gain(F, K), rtol=1e-6)
    printed = F.T @ K @ F
    assert np.abs(printed - found).max() > 10 * np.abs(found).max()


def test_fig_7_text_filter_leaves_no_antagonism_at_rest_even_with_a_wrong_model():
    wrong = FRICTIONLESS.replace(lengths=0.21, base=FRICTIONLESS.base + [[0.01, 0], [0, 0.01], [-0.01, 0]])
    law = rk.PD(7.05, 0.225)
    path = rk.hold(FRICTIONLESS, X, duration=2.0)
    rest = lambda law: rk.simulate(FRICTIONLESS, law, path, OFFSET, model=wrong)  # noqa: E731
    plain, filtered = rest(law), rest(rk.AntagonismFilter(law))
    assert np.abs(plain.c[-1]).max() > 1e-2
    assert np.abs(filtered.c[-1]).max() < 1e-9
    assert np.abs(filtered.xd[-1]).max() < 1e-9
    # Why: c is in the range of A of the model, of dimension delta, and at rest A_true^T c = 0.
    A_model = rk.control_matrix(wrong, rk.inverse_kinematics(wrong, X))
    assert np.linalg.matrix_rank(A.T @ A_model) == 2


def test_fig_7_text_stiction_under_the_filter_holds_four_thirds_of_a_drive():
    # Left at rest are torques c = R tau for friction torques |tau_i| <= f_c: at most f_c sum_j |R_ij|, not f_c.
    q, f_c = rk.inverse_kinematics(TESTBED, [0.0, 0.0]), TESTBED.friction[0]
    R = rk.antagonism_filter(rk.control_matrix(TESTBED, q))
    bound = f_c * np.abs(R).sum(axis=1)
    assert_allclose(bound, 4 / 3 * f_c, rtol=1e-12)
    assert_allclose(bound, 5.6e-3, rtol=1e-12)
    friction = f_c * np.sign(R[0])  # the friction torques that reach it, each within its drive's limit
    c = R @ friction
    assert_allclose(c[0], bound[0], rtol=1e-12)
    qdd, _ = rk.forward_dynamics(FRICTIONLESS, q, 0 * q, c - friction)  # friction holds the machine at rest
    assert np.abs(qdd).max() < 1e-12


def test_fig_9_text_model_based_laws_leave_no_torque_at_rest_either():
    # Printed: rest torques under CTC come from measurement errors in conjunction with actuation redundancy.  They lie
    # in the range of A of the model, of dimension delta, and at rest A_true^T c = 0: without counts, stiction or load
    # nothing is left, with any offsets and any model.
    wrong = FRICTIONLESS.replace(lengths=0.202, base=FRICTIONLESS.base + [[1e-3, 0], [0, 1e-3], [-1e-3, 0]])
    path = rk.hold(FRICTIONLESS, X, duration=3.0)
    laws = [
        rk.RedundantCTC(400.0, 40.0),
        rk.RedundantCTC([400.0] * 3, [40.0] * 3),
        rk.RedundantAPD(5.0, 0.2),
        rk.CTC(400.0, 40.0, None),
    ]
    for law in laws:
        for model in (None, wrong):
            run = rk.simulate(FRICTIONLESS, law, path, OFFSET, model=model)
            assert np.abs(run.xd[-1]).max() < 1e-6
            assert np.abs(run.c[-1]).max() < 1e-6
    counted = rk.simulate(FRICTIONLESS, laws[0], path, OFFSET, encoder=2000)
    assert np.abs(counted.c[-1000:]).max() > 1e-3  # this is what can leave torques


def test_fig_3_straight_lines_in_joint_space_disagree_without_any_offset():
    # Section 3.1: two five-bars whose drives move along a straight line in joint space follow different curves.  On the
    # first edge the three base angles, each linear between via points, contradict the loops by n . dq.
    start, end = rk.triangle(FRICTIONLESS).x[[0, 1667]]
    s = np.linspace(0, 1, 33)

    def base_angles(x):  # by the law of cosines, elbows positive
        to_x = x[..., None, :] - FRICTIONLESS.base
        return np.arctan2(to_x[..., 1], to_x[..., 0]) - np.arccos(np.linalg.norm(to_x, axis=-1) / 0.4)

    worst = []
    for pieces in (1, 2, 4, 8, 16, 32, 64):
        share = np.linspace(0, 1, pieces + 1)[:, None]
        via = rk.inverse_kinematics(FRICTIONLESS, start + share * (end - start))[:, :3]
        angles = ((1 - s[:, None, None]) * via[:-1] + s[:, None, None] * via[1:]).reshape(-1, 3)
        guess = start + (s[:, None] + np.arange(pieces)).reshape(-1, 1) / pieces * (end - start)
        closed = rk.estimate_pose(FRICTIONLESS, angles, guess)
        n = rk.null_vector(FRICTIONLESS, closed)
        worst.append(np.abs(np.sum(n * (angles - closed[:, :3]), axis=1)).max())
    # One piece: the distance from the nearest angles of a closed machine, found by a minimization.
    far = [
        least_squares(lambda x, q_a=q_a: base_angles(x) - q_a, point, xtol=1e-12).cost
        for q_a, point in zip(
            (1 - s[:, None]) * base_angles(start) + s[:, None] * base_angles(end),
            start + s[:, None] * (end - start),
            strict=True,
        )
    ]
    assert_allclose(worst[0], np.sqrt(2 * max(far)), rtol=1e-6)
    assert_allclose(1e3 * worst[0], 128.6, atol=0.1)  # what errata and lesson 04 print
    # Short pieces: a chord misses its curve by h^2 / 8 times the second derivative, here along n.
    line, h = start + s[:, None] * (end - start), 1e-4 * (end - start)
    bend = (base_angles(line + h) - 2 * base_angles(line) + base_angles(line - h)) / 1e-8
    n = rk.null_vector(FRICTIONLESS, rk.inverse_kinematics(FRICTIONLESS, line))
    assert_allclose(worst[-1], np.abs(np.sum(n * bend, axis=1)).max() / 64**2 / 8, rtol=0.02)
    assert_allclose(np.divide(worst[4:-1], worst[5:]), 4, rtol=0.06)  # a quarter per halving


def test_section_3_1_inherent_antagonism_of_synchronous_set_points_is_small():
    # Printed: decentralized control causes antagonism inevitably.  With set-points from the inverse kinematics at 1 kHz
    # and no other error it is a thousandth of the energy.
    run = rk.simulate(FRICTIONLESS, rk.PD(7.05, 0.225), rk.triangle(FRICTIONLESS))
    share = rk.antagonistic_energy(run) / run.energy.sum()
    assert 1e-5 < share < 2e-3


def test_after_table_1_mechanical_work_is_unaltered_in_sum_only():
    path = rk.triangle(TESTBED)
    law = rk.PD(7.05, 0.225)
    plain, filtered = (
        rk.mechanical_work(rk.simulate(TESTBED, one, path, OFFSET)) for one in (law, rk.AntagonismFilter(law))
    )
    assert abs(plain.sum() - filtered.sum()) < 0.01 * filtered.sum()
    assert np.abs(plain - filtered).max() > 0.1 * filtered.sum()  # per drive it is another work


def test_numerics_of_the_pseudoinverse():
    # A~^T has rank 2 by construction: its third singular value is rounding, and the default cut-off may invert it.
    x, modes = random_points(TESTBED, 4000), rk.working_modes(TESTBED)[:, None, :]
    A_tilde = rk.redundant_control_matrix(TESTBED, rk.inverse_kinematics(TESTBED, x, modes)).reshape(-1, 3, 6)
    left, sigma, right = np.linalg.svd(A_tilde, full_matrices=False)
    regular = sigma[:, 1] > 0.05
    A_tilde = A_tilde[regular]
    assert sigma[regular, 2].max() < 1e-12
    # An error of 1e-11 along the third singular vectors, above any rounding, so that every LAPACK inverts it.
    nudged = A_tilde + 1e-11 * (left[..., 2:] * right[:, 2:])[regular]
    assert norm(np.linalg.pinv(T(nudged))).min() > 1e10
    assert norm(np.linalg.pinv(T(nudged), rcond=1e-10)).max() < 1 / 0.05
    with_cut_off = np.linalg.pinv(T(A_tilde), rcond=1e-10)
    by_27 = rk.explicit_pseudoinverse(A_tilde, rk.select_independent(A_tilde))
    assert norm(with_cut_off).max() < 1 / 0.05
    assert (norm(by_27 - with_cut_off) / norm(with_cut_off)).max() < 1e-10
