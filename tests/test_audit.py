"""The audit of the chapter: for each misprint, the printed form failing and the corrected form holding.

Printed forms live here and nowhere else.  The rows follow the table "equation audit" of the project's reference page.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from samples import FRICTIONLESS, MACHINES, TESTBED, along, norm, random_motion, random_points

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


def test_text_after_7_degree_of_freedom():
    for robot in MACHINES.values():
        n, m, r = robot.n_joints, robot.n_arms, robot.n_constraints
        q = rk.inverse_kinematics(robot, random_points(robot, 1)[0])
        assert rk.degree_of_freedom(robot, q) == n - r == 2
        assert (n - m == 2) == (m == 2)  # the printed n - m is right for the five-bar alone


def test_eq_10_rank_of_the_control_vector_fields():
    # At the midpoint of a base side a mixed mode loses a direction; the rank of the mass matrix does not notice.
    modes = [m for m in rk.working_modes(TESTBED) if abs(m.sum()) == 1]
    poses = [(TESTBED.replace(mode=m), rk.inverse_kinematics(TESTBED, (TESTBED.base[i] + TESTBED.base[i - 1]) / 2, m))
             for m in modes for i in range(3)]
    robot, q = next((robot, q) for robot, q in poses if np.abs(rk.distal_cross_products(robot, q)).max() < 1e-12)
    mass, _, _ = rk.minimal_dynamics(robot, q, 0 * q)
    assert np.linalg.matrix_rank(mass) == 2
    assert np.linalg.matrix_rank(rk.control_vector_fields(robot, q), rtol=1e-9) == 1
    assert np.linalg.matrix_rank(rk.control_matrix(robot, q), rtol=1e-9) == rk.degree_of_actuation(robot, q) == 1


def test_eq_14_steady_state_error():
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
    e = np.array([0.01, -0.02, 0.015])
    for K, same in ((7 * np.eye(3), True), (np.diag(UNEQUAL), False)):
        by_16, by_17 = rk.antagonism_filter(A) @ K @ e, K @ rk.command_filter(A, K) @ e
        assert_allclose(A.T @ by_16, A.T @ by_17, atol=1e-13)
        assert np.allclose(by_16, by_17, atol=1e-12) == same
        left = np.abs(rk.prestress_projector(A) @ by_17).max()
        assert (left < 1e-14) == same


def test_eq_18_commands_are_formed_with_the_measured_angles():
    K, e = 7.05 * np.eye(3), np.array([0.01, -0.02, 0.015])
    q_a = Q[:3] + e
    measured = q_a + OFFSET
    R = rk.command_filter(A, K)
    drive = lambda command: -K @ (measured - command)  # noqa: E731  what a drive does with its command
    printed, correct = drive(q_a - R @ (e + OFFSET)), drive(measured - R @ (e + OFFSET))
    prestress = rk.prestress_projector(A)
    assert np.abs(prestress @ correct).max() < 1e-14
    assert_allclose(prestress @ printed, -prestress @ K @ OFFSET, atol=1e-14)  # the offset slips past the filter
    assert np.abs(prestress @ printed).max() > 1e-3


def test_eq_21_numbers_of_passive_and_actuated_joints():
    for robot in MACHINES.values():
        n, m = robot.n_joints, robot.n_arms
        q = rk.inverse_kinematics(robot, random_points(robot, 1)[0])
        N, actuated = rk.nullspace_projector(robot, q), rk.redundant_control_matrix(robot, q)
        assert actuated.shape == (m, n) and np.array_equal(N[: len(actuated)], actuated)
        assert len(N) - len(actuated) == n - m  # passive rows
        assert (m + 2 == n) == (m == 2)  # "m passive, delta actuated" is the whole of n for the five-bar alone


def test_rate_of_the_projector_takes_j_where_b_is_printed():
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
    q, qd, qdd, (x, xd, xdd) = random_motion(FRICTIONLESS, 50)
    desired = rk.Desired(3, x, xd, xdd, q, qd, qdd)
    law = rk.RedundantCTC(400.0, 40.0)
    c = law.torque(FRICTIONLESS, q, qd, q[:, :3], qd[:, :3], desired)
    assert_allclose(rk.forward_dynamics(FRICTIONLESS, q, qd, c)[0], qdd, atol=1e-9 * np.abs(qdd).max())
    # Printed v = qdd - ... with the actual acceleration is no law: qdd follows from c, and c from qdd.
    # The lines differ: N_J G N_J v against N_J G v, unless v is tangent.
    N, G = rk.nullspace_projector(FRICTIONLESS, q), rk.mass_matrix(FRICTIONLESS, q)
    v = np.random.default_rng(0).normal(size=q.shape)
    assert np.abs(mv(N @ G @ N, v) - mv(N @ G, v)).max() > 1e-3
    tangent = mv(N, v)
    assert_allclose(mv(N @ G @ N, tangent), mv(N @ G, tangent), atol=1e-15)
    # Line 1 has the symmetric stiffness F^T K F, line 2 has F^T G K F.
    K = np.array([300.0, 500.0, 900.0, 200.0, 400.0, 100.0])
    q = rk.inverse_kinematics(FRICTIONLESS, X)
    F, G = rk.orthogonal_complement(FRICTIONLESS, q), rk.mass_matrix(FRICTIONLESS, q)
    skew = lambda S: abs(S[0, 1] - S[1, 0]) / np.abs(S).max()  # noqa: E731
    first, second = F.T @ F @ closed_loop(1, K), F.T @ G @ F @ closed_loop(2, K)
    assert_allclose(first, F.T @ np.diag(K) @ F, rtol=1e-6)
    assert_allclose(second, F.T @ G @ np.diag(K) @ F, rtol=1e-6)
    assert skew(first) < 1e-7 < 1e-2 < skew(second)


def test_eq_35_effective_gain():
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
