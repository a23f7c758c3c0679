"""Actuation: degree, singularities, inverse dynamics, filters, explicit pseudoinverse, steady state, maps."""

import itertools
import math
from fractions import Fraction

import numpy as np
import pytest
from numpy.testing import assert_allclose
from samples import FRICTIONLESS, MACHINES, MODES, TESTBED, machines, modes, norm, random_motion, random_points
from scipy.optimize import brentq, linprog, minimize, root

import rapkm_lite as rk
from rapkm_lite.mechanics.partition import PARTITION_RULES

T = lambda M: np.swapaxes(M, -1, -2)  # noqa: E731
PAIRS = [(0, 1), (0, 2), (1, 2)]
MIDPOINTS = [(TESTBED.base[i] + TESTBED.base[(i + 1) % 3]) / 2 for i in range(3)]
EQUAL_SIGNS = MODES[np.abs(MODES.sum(axis=1)) == 3]
MIXED = MODES[np.abs(MODES.sum(axis=1)) < 3]


def singular_points(mode):
    """Minima of sigma_min over the workspace that reach zero, found from a map and polished."""
    x, y, sigma = rk.actuation_map(TESTBED, mode=mode, n=50)

    def value(p):
        if not rk.reachable(TESTBED, p):
            return 1.0
        A_tilde = rk.redundant_control_matrix(TESTBED, rk.inverse_kinematics(TESTBED, p, mode))
        return np.linalg.svd(A_tilde, compute_uv=False)[1]

    inner = sigma.filled(9.0)
    dips = [
        (i, j)
        for i in range(1, 49)
        for j in range(1, 49)
        if inner[i, j] < 0.2 and inner[i, j] <= inner[i - 1 : i + 2, j - 1 : j + 2].min()
    ]
    found = [
        minimize(value, [x[j], y[i]], method="Nelder-Mead", options={"xatol": 1e-10, "fatol": 1e-12}) for i, j in dips
    ]
    return [f.x for f in found if f.fun < 1e-6]


# (8)-(10)
@machines
def test_control_vector_fields_are_the_accelerations_per_torque(robot):
    robot = robot.replace(friction=0.0, gravity=[0, 0])
    q = rk.inverse_kinematics(robot, random_points(robot, 30))
    fields = rk.control_vector_fields(robot, q)
    F = rk.orthogonal_complement(robot, q)
    for i, c in enumerate(np.eye(robot.n_arms)):
        qdd, _ = rk.forward_dynamics(robot, q, 0 * q, c)
        assert_allclose(np.einsum("kij,kj->ki", F, fields[..., i]), qdd, rtol=1e-8, atol=1e-7 * np.abs(qdd).max())


@machines
def test_degree_of_actuation_is_the_rank_of_the_control_vector_fields(robot):
    q = rk.inverse_kinematics(robot, random_points(robot, 100))
    rank = np.linalg.matrix_rank(rk.control_vector_fields(robot, q))
    assert np.array_equal(rk.degree_of_actuation(robot, q), rank)
    kind = "fully actuated" if robot.n_arms == 2 else "redundantly actuated"
    assert rk.actuation_type(robot, q[0]) == kind
    assert np.all(rk.actuation_type(robot, q) == kind)


def test_equal_signs_have_no_input_singularity():
    for mode in EQUAL_SIGNS:
        assert singular_points(mode) == []
        sigma = rk.actuation_map(TESTBED, mode=mode, n=300)[2]
        assert sigma.min() > 0.3


@pytest.mark.parametrize("mode", MIXED, ids=str)
def test_mixed_modes_have_one_input_singularity_at_the_midpoint_of_a_side(mode):
    points = singular_points(mode)
    assert points
    for p in points:
        assert_allclose(p, points[0], atol=1e-5)
    side = np.linalg.norm(MIDPOINTS - points[0], axis=-1)
    assert side.min() < 1e-5
    q = rk.inverse_kinematics(TESTBED, MIDPOINTS[side.argmin()], mode)
    assert_allclose(rk.distal_cross_products(TESTBED, q), 0, atol=1e-14)
    assert rk.degree_of_actuation(TESTBED, q) == 1
    assert rk.actuation_type(TESTBED, q) == "underactuated"
    for f in (rk.weighted_pseudoinverse, rk.antagonism_filter, rk.prestress_projector):
        with pytest.raises(ValueError, match="input singularity"):
            f(rk.control_matrix(TESTBED, q))
    with pytest.raises(ValueError, match="input singularity"):
        rk.null_vector(TESTBED, q)


def turned(robot, angle):
    c, s = np.cos(angle), np.sin(angle)
    return robot.replace(base=robot.base @ [[c, s], [-s, c]])


ANGLES = np.concatenate([[0.0], 10.0 ** np.arange(-12.0, 0.0)])


@pytest.mark.parametrize("angle", ANGLES, ids=str)
def test_singularities_are_refused_in_any_frame(angle):
    """Input: one line for all distal links, nearly along y.  c-space: two arms stretched, the third folded (corner)."""
    mixed = TESTBED.replace(mode=[1, 1, -1])
    place = TESTBED.base[:2].mean(axis=0)
    q = rk.inverse_kinematics(mixed, place)
    turn = np.pi / 2 - (q[0] + q[3]) + angle
    robot, q = turned(mixed, turn), q + np.repeat([turn, 0.0], 3)
    assert rk.degree_of_actuation(robot, q) == 1
    A = rk.control_matrix(robot, q)
    for refused in (
        lambda: rk.antagonism_filter(A),
        lambda: rk.weighted_pseudoinverse(A),
        lambda: rk.null_basis(A),
        lambda: rk.null_vector(robot, q),
        lambda: rk.inverse_dynamics(robot, q, 0 * q, 0 * q),
        lambda: rk.at(robot, q).A_tilde_T_pinv,
        lambda: rk.estimate_pose(robot, q[:3], rk.forward_kinematics(robot, q)),
        lambda: rk.steady_state_error(A, 7.0, [1e-3, 0.0, 0.0]),
    ):
        with pytest.raises(ValueError, match="input singularity"):
            refused()
    corner = np.array([0.7, np.pi, -2 * np.pi / 3, np.pi, 0.0, 0.0])
    for k in range(6):
        turn = k * np.pi / 6 + angle
        robot, q = turned(TESTBED, turn), corner + np.repeat([turn, 0.0], 3)
        assert rk.degree_of_freedom(robot, q) == 3
        with pytest.raises(ValueError, match="c-space singularity"):
            rk.nullspace_projector(robot, q)
        with pytest.raises(ValueError, match="c-space singularity"):
            rk.forward_dynamics(robot, q, 0 * q, np.zeros(3))
        with pytest.raises(rk.ConvergenceError, match="near a regular configuration"):
            rk.close_loops(robot, q)


@pytest.mark.parametrize("apart", [1e-3, 1e-6, 1e-8, 1e-9, 1e-10], ids=str)
def test_functions_answer_alike_close_to_an_input_singularity_in_any_frame(apart):
    """`apart` m from where rank A drops; A = U S V^T has the range of U, and sigma_2 near 25 `apart` per m^2."""
    mixed = TESTBED.replace(mode=[1, 1, -1])
    place, offset = TESTBED.base[:2].mean(axis=0) + apart * np.array([-0.8, 0.6]), np.array([4e-3, -2e-3, 5e-3])
    for angle in np.arange(24) * np.pi / 12:
        robot = turned(mixed, angle)
        x = place @ np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        q = rk.inverse_kinematics(robot, x)
        A, A_tilde = rk.control_matrix(robot, q), rk.redundant_control_matrix(robot, q)
        sharp = 1e-14 / apart  # what rounding leaves of the range of A
        e = rk.steady_state_error(A, 7.0, offset)
        assert_allclose(e, -rk.antagonism_filter(A) @ offset, rtol=0, atol=sharp * np.linalg.norm(offset))
        found = rk.estimate_pose(robot, q[:3], x)
        assert_allclose(found, q, rtol=0, atol=1e-14)
        explicit = rk.explicit_pseudoinverse(A_tilde, rk.select_independent(A_tilde))
        assert_allclose(explicit * apart, rk.at(robot, q).A_tilde_T_pinv * apart, rtol=0, atol=10 * sharp)
        xd = np.array([0.3, -0.2])
        sample = rk.Sample(rk.Controller(rk.PD(7.0, 0.2), robot), 0.0, q[:3], A @ xd, rk.hold(robot, x, 0.1)[0])
        # A controller goes as far as the engine, to a ratio of 3e-8.
        first, second = rk.singular_values(A)
        if second > 1e-7 * first:
            rates = A @ xd  # of A at an x that is rounded, too
            assert_allclose(sample.pose()[1][:3], rates, rtol=0, atol=sharp * np.linalg.norm(rates))
        elif second < 1e-8 * first:
            with pytest.raises(ValueError, match="A has lost rank"):
                sample.pose()


@modes
def test_null_vector_in_closed_form_spans_the_kernel(mode):
    for robot in (TESTBED, MACHINES["asymmetric"]):
        q = random_motion(robot, 1000, mode)[0]
        n, A = rk.null_vector(robot, q), rk.control_matrix(robot, q)
        assert_allclose(np.linalg.norm(n, axis=-1), 1, atol=1e-14)
        assert (norm(np.einsum("kij,ki->kj", A, n)) / norm(A)).max() < 1e-13
        assert norm(np.einsum("kij,ki->kj", rk.redundant_control_matrix(robot, q), n)).max() < 1e-13
        projector = rk.prestress_projector(A)
        good = np.linalg.svd(rk.redundant_control_matrix(robot, q), compute_uv=False)[:, 1] > 1e-2
        assert norm(projector - n[:, :, None] * n[:, None, :])[good].max() < 1e-11


@modes
def test_null_basis_is_the_null_vector_for_three_arms(mode):
    for robot in (TESTBED, MACHINES["asymmetric"]):
        q = random_motion(robot, 500, mode)[0]
        A = rk.control_matrix(robot, q)
        good = np.linalg.svd(rk.redundant_control_matrix(robot, q), compute_uv=False)[:, 1] > 1e-2
        n = rk.null_basis(A)[good]
        assert n.shape[1:] == (3, 1)
        assert_allclose(n[..., 0], rk.null_vector(robot, q)[good], atol=1e-12)
        # Its sign: that of the cross product of the columns of A.
        assert np.all(np.sum(np.cross(A[good, :, 0], A[good, :, 1]) * n[..., 0], axis=-1) > 0)


@pytest.mark.parametrize(("m", "delta"), [(2, 1), (2, 2), (3, 1), (4, 2), (4, 3), (5, 2), (6, 2), (7, 3), (8, 2)])
def test_null_basis_of_any_matrix(m, delta):
    A = np.random.default_rng(m).normal(size=(2, 50, m, delta)) * [1e4, 1.0, 1e-3][:delta]
    n = rk.null_basis(A)
    assert n.shape == (2, 50, m, m - delta)
    assert_allclose(T(n) @ n, np.broadcast_to(np.eye(m - delta), (2, 50, m - delta, m - delta)), atol=1e-14)
    size = np.linalg.norm(A, axis=-2)[..., None]
    assert np.abs((T(A) @ n) / size).max(initial=0.0) < 1e-14
    assert_allclose(n[1, 7], rk.null_basis(A[1, 7]), atol=1e-14)  # a function of A alone, to rounding
    if m > delta:
        assert np.all(np.linalg.det(np.concatenate([A / size.swapaxes(-1, -2), n], axis=-1)) > 0)
        # Another choice of the independent coordinates spans the same space and keeps the basis: A M for det M > 0.
        M = np.eye(delta) + 0.3 * np.triu(np.ones((delta, delta)), 1)
        assert_allclose(rk.null_basis(A @ M), n, atol=1e-8)


def test_null_basis_is_continuous_along_paths_and_around_loops():
    # Twice as many samples, half the step; and a closed path ends with the basis it began with.
    robot = MACHINES["four_arms"]
    for path in (lambda k: rk.circle(robot, 0.08, dt=5.0 / k), lambda k: rk.triangle(robot, side=0.12, dt=5.0 / k)):
        steps = []
        for k in (500, 1000, 2000):
            n = rk.null_basis(rk.control_matrix(robot, path(k).q))
            steps.append(np.linalg.norm(np.diff(n, axis=0), axis=(-2, -1)).max())
        assert_allclose(np.array(steps[:-1]) / steps[1:], 2.0, rtol=0.05)
        assert_allclose(n[-1], n[0], atol=1e-12)


def test_null_basis_refuses_what_has_no_basis_to_face():
    with pytest.raises(ValueError, match="A has lost rank"):
        rk.null_basis(np.ones((4, 2)))
    # The drives (1, 1, 1, 1) move nothing but the end-effector: the reference lies in the range of A.
    with pytest.raises(ValueError, match="no reference left in its null space; allowed: any other pose"):
        rk.null_basis([[1.0, 0.0], [1.0, 1.0], [1.0, 2.0], [1.0, 3.0]])


def positive_prestress(A):
    """The largest t with A^T n = 0, n_i >= t, n_i <= 1, by linear programming."""
    m, delta = A.shape
    rows = np.concatenate([A.T / np.abs(A).max(), np.zeros((delta, 1))], axis=1)
    below = np.concatenate([-np.eye(m), np.ones((m, 1))], axis=1)
    found = linprog(np.append(np.zeros(m), -1.0), below, np.zeros(m), rows, np.zeros(delta), [(-1, 1)] * (m + 1))
    return -found.fun


@pytest.mark.parametrize("name", ["testbed", "four_arms", "asymmetric"])
def test_common_sign_against_linear_programming(name):
    robot = MACHINES[name]
    A = rk.control_matrix(robot, rk.inverse_kinematics(robot, random_points(robot, 60, seed=8)))
    margin = np.array([positive_prestress(M) for M in A])
    clear = np.abs(margin) > 1e-6
    possible = rk.common_sign(A)
    assert clear.mean() > 0.3 and 0 < possible.sum() < len(A)
    assert np.array_equal(possible[clear], margin[clear] > 0) and not possible[margin < 1e-9].any()
    assert rk.common_sign(A[0]).shape == ()
    if robot.n_arms == 3:
        n = rk.null_vector(robot, rk.inverse_kinematics(robot, random_points(robot, 60, seed=8)))
        assert np.array_equal(possible, np.abs(np.sign(n).sum(axis=-1)) == 3)


SHAPES = [(3, 1), (4, 1), (3, 2), (5, 2), (3, 3), (4, 3), (5, 3), (7, 3), (8, 5)]


@pytest.mark.parametrize(("m", "delta"), SHAPES)
def test_common_sign_of_any_mechanism(m, delta):
    """A linear programme in the torques themselves; rows of any length, columns of any unit."""
    rng = np.random.default_rng(10 * m + delta)
    A = rng.normal(size=(4, 10, m, delta))
    possible = rk.common_sign(A)
    margin = np.array([positive_prestress(M) for M in A.reshape(-1, m, delta)]).reshape(4, 10)
    assert np.array_equal(possible, margin > 1e-6) and (possible.any() or m == delta)
    assert possible.dtype == bool and rk.common_sign(A[0, 0]) == possible[0, 0] and rk.common_sign(A[0, 0]).shape == ()
    scaled = np.logspace(-4, 4, m)[:, None] * A @ (np.eye(delta) + np.triu(rng.normal(size=(delta, delta)), 1))
    assert np.array_equal(rk.common_sign(scaled), possible)
    assert rk.common_sign(A[:0]).shape == (0, 10) and rk.common_sign(A[:0]).dtype == bool


@pytest.mark.parametrize(("m", "delta"), SHAPES)
def test_share_of_random_machines_with_a_common_sign(m, delta):
    """Wendel's theorem: m directions drawn evenly lie in a half space with 2^(1-m) sum_(k<delta) C(m-1, k)."""
    draws = 400
    share = rk.common_sign(np.random.default_rng(m + 10 * delta).normal(size=(draws, m, delta))).mean()
    expected = 1 - sum(math.comb(m - 1, k) for k in range(delta)) / 2 ** (m - 1)
    assert abs(share - expected) <= 4 * np.sqrt(expected * (1 - expected) / draws)


@pytest.mark.parametrize(("m", "delta"), [(m, delta) for m, delta in SHAPES if m > delta])
def test_common_sign_of_made_up_prestress_and_of_rows_in_a_half_space(m, delta):
    rng = np.random.default_rng(m * delta)
    n = rng.uniform(0.01, 1.0, m)
    A = rng.normal(size=(m, delta))
    assert rk.common_sign(A - np.outer(n, n @ A) / (n @ n))
    n[0] = 1e-4  # a small share is one, too
    assert rk.common_sign(A - np.outer(n, n @ A) / (n @ n))
    A[:, 0] = np.abs(A[:, 0])
    assert not rk.common_sign(A)
    # On the edge of it: no drive but those that see none of the first column could press.
    A[0, 0] = 0.0
    assert not rk.common_sign(A)


def test_opposite_rows_leave_the_third_drive_without_a_share_in_any_frame():
    """Symmetry: A^T n = 0 has n_3 = 0 where rows 1 and 2 are opposite, however the plane is turned and A is scaled."""
    rng = np.random.default_rng(4)
    A, angle = rng.normal(size=(200, 3, 2)), rng.uniform(0.0, 2 * np.pi, 200)
    A[:, 1] = -A[:, 0]
    turn = np.moveaxis([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]], -1, 0)
    assert not rk.common_sign(rng.uniform(0.1, 9.0, (200, 3, 1)) * A @ turn).any()


@pytest.mark.parametrize("delta", [1, 2, 3])
def test_a_drive_that_moves_nothing_has_any_sign(delta):
    A = np.random.default_rng(3).normal(size=(6, delta + 2, delta))
    A[:, -1] = 0.0
    assert np.array_equal(rk.common_sign(A), rk.common_sign(A[:, :-1]))


def test_share_of_the_workspace_without_backlash():
    # The reference page: 56.5 % of the workspace, 65 % of the testbed triangle (samples in time).
    x, y, inside = rk.workspace_grid(TESTBED, 500)
    points = np.stack(np.meshgrid(x, y), axis=-1)[inside]
    share = rk.common_sign(rk.control_matrix(TESTBED, rk.inverse_kinematics(TESTBED, points))).mean()
    assert_allclose(share, 0.565, atol=0.005)
    assert_allclose(rk.common_sign(rk.control_matrix(TESTBED, rk.triangle(TESTBED).q)).mean(), 0.65, atol=0.005)
    # Two drives cannot prestress each other.
    A = rk.control_matrix(MACHINES["five_bar"], rk.inverse_kinematics(MACHINES["five_bar"], [0.0, 0.0]))
    assert not rk.common_sign(A)


def test_drive_opposite_to_a_singular_pair_carries_no_prestress():
    # On the zero of d_2 x d_3 the null vector has no component 1: switching map and prestress map are one map.
    pose = lambda t: rk.inverse_kinematics(TESTBED, 0.11 * np.array([np.cos(t), np.sin(t)]))  # noqa: E731
    angle = np.linspace(0, 2 * np.pi, 400)
    for k, drive in enumerate([2, 1, 0]):
        cross = lambda t, k=k: rk.distal_cross_products(TESTBED, pose(t))[k]  # noqa: E731
        signs = np.sign([cross(t) for t in angle])
        i = np.flatnonzero(np.diff(signs))
        assert len(i) > 0
        n = rk.null_vector(TESTBED, pose(brentq(cross, angle[i[0]], angle[i[0] + 1], xtol=1e-15)))
        assert abs(n[drive]) < 1e-13
        assert np.abs(np.delete(n, drive)).min() > 0.1


def test_isotropy_at_the_centroid():
    q = rk.inverse_kinematics(TESTBED, [0.0, 0.0])
    A = rk.control_matrix(TESTBED, q)
    assert_allclose(A.T @ A, (A.T @ A)[0, 0] * np.eye(2), atol=1e-12)
    assert_allclose(np.abs(rk.null_vector(TESTBED, q)), np.sqrt(1 / 3), atol=1e-14)
    assert_allclose(rk.singular_values(A)[0], rk.singular_values(A)[1], rtol=1e-12)


def test_clearance_of_the_pair_singularities_and_crossings_of_the_triangle():
    # Nearest point to the centroid of each curve d_j x d_k = 0: the smallest radius where a sign changes.
    angle = np.linspace(0, 2 * np.pi, 720, endpoint=False)
    ray = np.stack([np.cos(angle), np.sin(angle)], axis=-1)

    at_centroid = np.sign(rk.distal_cross_products(TESTBED, rk.inverse_kinematics(TESTBED, [0.0, 0.0])))

    def smallest(radius):
        return (at_centroid * rk.distal_cross_products(TESTBED, rk.inverse_kinematics(TESTBED, radius * ray))).min()

    assert smallest(0.05) > 0
    assert_allclose(brentq(smallest, 0.09, 0.12, xtol=1e-8), 0.1012, atol=5e-5)
    changes = lambda path: np.sum(  # noqa: E731
        np.diff(np.sign(rk.distal_cross_products(TESTBED, path.q)), axis=0) != 0, axis=0
    )
    assert np.array_equal(changes(rk.triangle(TESTBED)), [2, 2, 2])
    assert np.array_equal(changes(rk.circle(TESTBED, 0.1)), [0, 0, 0])


def test_cross_products_vanish_where_a_pair_is_no_coordinate():
    q = rk.inverse_kinematics(TESTBED, random_points(TESTBED, 200))
    A = rk.control_matrix(TESTBED, q)
    a, d = rk.arm_vectors(TESTBED, q)
    lever = (a[..., 0] * d[..., 1] - a[..., 1] * d[..., 0]) / 0.2
    for k, (i, j) in enumerate(PAIRS):
        minor = A[:, i, 0] * A[:, j, 1] - A[:, i, 1] * A[:, j, 0]
        assert_allclose(rk.distal_cross_products(TESTBED, q)[:, k], minor * lever[:, i] * lever[:, j], atol=1e-14)


def test_singular_values_in_closed_form_match_lapack():
    A = np.random.default_rng(0).normal(size=(500, 4, 2)) * np.logspace(0, -6, 500)[:, None, None] ** [0, 1]
    sigma = np.linalg.svd(A, compute_uv=False)
    assert_allclose(rk.singular_values(A), sigma, rtol=1e-8)
    assert_allclose(rk.singular_values(np.zeros((3, 2))), 0)


@pytest.mark.parametrize("delta", [1, 2, 3, 5])
def test_singular_values_of_any_mechanism(delta):
    """A = U diag(s) V^T with made-up s; and, as for any matrix, their squares are the eigenvalues of A^T A."""
    rng, s = np.random.default_rng(delta), np.geomspace(3.0, 0.2, delta)
    U, V = (np.linalg.qr(rng.normal(size=(2, 4, n, delta)))[0] for n in (6, delta))
    A = (U * s) @ T(V)
    assert_allclose(rk.singular_values(A), np.broadcast_to(s, (2, 4, delta)), rtol=1e-13)
    assert_allclose(rk.singular_values(A[0, 0]) ** 2, np.linalg.eigvalsh(A[0, 0].T @ A[0, 0])[::-1], rtol=1e-12)


# (11)
@machines
def test_inverse_dynamics_inverts_forward_dynamics_for_every_weight_and_prestress(robot):
    q, qd, qdd, _ = random_motion(robot, 200)
    if robot.n_arms == 2:
        keep = np.abs(rk.distal_cross_products(robot, q)[:, 0]) > 0.05
        q, qd, qdd = q[keep], qd[keep], qdd[keep]
    rng = np.random.default_rng(1)
    B = rng.normal(size=(robot.n_arms, robot.n_arms))
    A = rk.control_matrix(robot, q)
    for W in (None, 2.0, rng.uniform(0.5, 2, robot.n_arms), B @ B.T + np.eye(robot.n_arms)):
        for c0 in (None, rng.normal(size=robot.n_arms)):
            c = rk.inverse_dynamics(robot, q, qd, qdd, W, c0)
            again, _ = rk.forward_dynamics(robot, q, qd, c)
            assert (norm(again - qdd) / norm(qdd)).max() < 1e-9
        P = rk.weighted_pseudoinverse(A, W)
        assert_allclose(T(A) @ P, np.broadcast_to(np.eye(2), (len(q), 2, 2)), atol=1e-12)
        N = rk.prestress_projector(A, W)
        assert norm(N @ N - N).max() < 1e-11
        assert (norm(T(A) @ N) / norm(A)).max() < 1e-12


def test_weighted_pseudoinverse_has_the_smallest_weighted_torque():
    rng = np.random.default_rng(2)
    A = rk.control_matrix(TESTBED, rk.inverse_kinematics(TESTBED, random_points(TESTBED, 50)))
    B = rng.normal(size=(3, 3))
    W, force = B @ B.T + 0.5 * np.eye(3), rng.normal(size=2)
    for M in A:
        c = rk.weighted_pseudoinverse(M, W) @ force
        # Lagrange: W c is in the range of A.
        multiplier = np.linalg.lstsq(M, W @ c, rcond=None)[0]
        assert_allclose(M @ multiplier, W @ c, atol=1e-12)
        assert_allclose(rk.weighted_pseudoinverse(M), np.linalg.pinv(M.T), atol=1e-12)


@modes
def test_redundant_inverse_dynamics_equals_the_minimal_one(mode):
    # (25), without the idle N_J, equals (11) with W = I and no prestress.
    q, qd, qdd, _ = random_motion(FRICTIONLESS, 1000, mode)
    A_tilde = rk.redundant_control_matrix(FRICTIONLESS, q)
    k = np.linalg.svd(A_tilde, compute_uv=False)[:, 1] > 0.02
    q, qd, qdd, A_tilde = q[k], qd[k], qdd[k], A_tilde[k]
    pinv = rk.explicit_pseudoinverse(A_tilde, rk.select_independent(A_tilde))
    G, C = rk.mass_matrix(FRICTIONLESS, q), rk.coriolis_matrix(FRICTIONLESS, q, qd)
    terms = np.einsum("kij,kj->ki", G, qdd) + np.einsum("kij,kj->ki", C, qd)
    c = rk.inverse_dynamics(FRICTIONLESS, q, qd, qdd)
    assert (norm(np.einsum("kij,kj->ki", pinv, terms) - c) / norm(c)).max() < 1e-10
    Gt, Ct, Qt = rk.redundant_dynamics(FRICTIONLESS, q, qd)
    terms = np.einsum("kij,kj->ki", Gt, qdd) + np.einsum("kij,kj->ki", Ct, qd) + Qt
    assert (norm(np.einsum("kij,kj->ki", pinv, terms) - c) / norm(c)).max() < 1e-10


# (15), (17)
@machines
def test_filters_keep_the_end_effector_force(robot):
    q = rk.inverse_kinematics(robot, random_points(robot, 200))
    if robot.n_arms == 2:
        q = q[np.abs(rk.distal_cross_products(robot, q)[:, 0]) > 0.05]
    A, K = rk.control_matrix(robot, q), np.linspace(4, 9, robot.n_arms)
    R, R_K = rk.antagonism_filter(A), rk.command_filter(A, K)
    assert (norm(T(A) @ R - T(A)) / norm(A)).max() < 1e-14
    assert norm(R @ R - R).max() < 1e-14
    assert norm(R - np.linalg.pinv(T(A)) @ T(A)).max() < 1e-11
    assert (norm(T(A) @ np.diag(K) @ R_K - T(A) @ np.diag(K)) / norm(A)).max() < 1e-12
    assert_allclose(rk.command_filter(A, 3.0), R, atol=1e-13)
    assert_allclose(R + rk.prestress_projector(A), np.broadcast_to(np.eye(robot.n_arms), R.shape), atol=1e-12)


# (26)-(27)
@modes
def test_explicit_pseudoinverse_for_every_valid_partition(mode):
    for robot in (TESTBED, MACHINES["four_arms"], MACHINES["asymmetric"]):
        signs = np.resize(mode, robot.n_arms)
        A_tilde = rk.redundant_control_matrix(robot, random_motion(robot, 1000, signs)[0])
        sigma = np.linalg.svd(A_tilde, compute_uv=False)
        # The rank is 2 by construction: without an explicit cut-off rounding may count as a third singular value.
        peer = np.linalg.pinv(T(A_tilde), rcond=1e-10)
        compared = 0
        for pair in itertools.combinations(range(robot.n_arms), 2):
            part = np.linalg.svd(A_tilde[:, pair, :], compute_uv=False)
            valid = (part[:, 1] > 1e-2 * sigma[:, 0]) & (sigma[:, 1] > 1e-2)
            ours = rk.explicit_pseudoinverse(A_tilde[valid], pair)
            assert (norm(ours - peer[valid]) / norm(peer[valid])).max() < 1e-10
            compared += valid.sum()
        assert compared > 2000
        best = rk.explicit_pseudoinverse(A_tilde, rk.select_independent(A_tilde))
        ok = sigma[:, 1] > 1e-2
        assert (norm(best - peer)[ok] / norm(peer)[ok]).max() < 1e-10


def printed_27(A_tilde, rows):
    """(27) letter by letter, with the inverse of A~_1 A~_1^T of the text after it."""
    rest = [i for i in range(len(A_tilde)) if i not in rows]
    A1, A2 = A_tilde[list(rows)], A_tilde[rest]
    pinv1 = np.linalg.inv(A1 @ A1.T) @ A1
    B = pinv1 @ A2.T
    small = np.linalg.inv(np.eye(len(rest)) + B.T @ B)
    top = pinv1 @ (np.eye(A_tilde.shape[1]) - A2.T @ small @ B.T @ pinv1)
    whole = np.empty_like(A_tilde)
    whole[list(rows)], whole[rest] = top, small @ B.T @ pinv1
    return whole, small


@pytest.mark.parametrize("rule", PARTITION_RULES)
def test_rounding_does_not_choose_rows_at_a_symmetric_pose(rule):
    """At the centroid all three pairs are equal, whichever way the machine is turned: the first one."""
    for angle in np.arange(24) * np.pi / 12:
        robot = turned(TESTBED, angle)
        A_tilde = rk.redundant_control_matrix(robot, rk.inverse_kinematics(robot, [0.0, 0.0]))
        assert rk.select_independent(A_tilde, rule).tolist() == [0, 1]
        assert rk.select_independent(np.stack([A_tilde] * 2), rule).tolist() == [[0, 1]] * 2


@pytest.mark.parametrize("scale", [1e-9, -1.0, 1e9])
def test_explicit_pseudoinverse_knows_the_rank_whatever_the_unit(scale):
    A_tilde = scale * rk.redundant_control_matrix(TESTBED, rk.inverse_kinematics(TESTBED, [0.02, 0.05]))
    found = rk.explicit_pseudoinverse(A_tilde, (0, 1))
    assert_allclose(found, np.linalg.pinv(A_tilde.T), rtol=0, atol=1e-12 / abs(scale))
    with pytest.raises(ValueError, match="rows holds 1 of the rows, below the rank of A_tilde; allowed: delta of them"):
        rk.explicit_pseudoinverse(A_tilde, (0,))
    with pytest.raises(ValueError, match="below the rank"):  # whatever the other matrices of a stack
        rk.explicit_pseudoinverse(np.stack([A_tilde, 1e9 * A_tilde[:1] * np.ones((3, 1))]), (0,))


@pytest.mark.parametrize("name", ["testbed", "four_arms", "five_bar"])
def test_explicit_pseudoinverse_is_27_as_printed(name):
    robot = MACHINES[name]
    A_tilde = rk.redundant_control_matrix(robot, rk.inverse_kinematics(robot, random_points(robot, 20, bend=0.3)))
    rows = rk.select_independent(A_tilde)
    for M, pair, found in zip(A_tilde, rows, rk.explicit_pseudoinverse(A_tilde, rows), strict=True):
        printed, new_inverse = printed_27(M, pair.tolist())
        assert_allclose(found, printed, rtol=0, atol=1e-12 * np.abs(printed).max())
        assert_allclose(rk.explicit_pseudoinverse(M, pair), found, rtol=0, atol=1e-14 * np.abs(printed).max())
        assert new_inverse.shape == (robot.n_arms - 2,) * 2  # a number on the testbed


def test_partition_rules_choose_what_they_say():
    A_tilde = rk.redundant_control_matrix(TESTBED, rk.inverse_kinematics(TESTBED, random_points(TESTBED, 300)))
    parts = np.stack([A_tilde[:, pair, :] for pair in PAIRS], axis=1)
    sigma = np.linalg.svd(parts, compute_uv=False)
    index = lambda rows: [PAIRS.index(tuple(r)) for r in rows.tolist()]  # noqa: E731
    assert np.array_equal(index(rk.select_independent(A_tilde)), sigma[..., 1].argmax(axis=1))
    assert np.array_equal(
        index(rk.select_independent(A_tilde, "condition")), (sigma[..., 0] / sigma[..., 1]).argmin(axis=1)
    )
    assert np.array_equal(
        index(rk.select_independent(A_tilde, "printed")), np.abs(parts).sum(-1).max(-1).argmin(axis=1)
    )


# (13)-(14)
@pytest.mark.parametrize("name", ["testbed", "four_arms", "asymmetric"])
def test_steady_state_is_the_first_order_solution_of_the_nonlinear_equilibrium(name):
    # Equilibrium of PD with offsets, gravity and load: A(q)^T K (e_a + offset) + Qbar(q) = 0, solved for x.
    robot = MACHINES[name].replace(friction=0.0)
    x_d = np.array([0.03, 0.02])
    q_d = rk.inverse_kinematics(robot, x_d)
    K = np.linspace(20.0, 60.0, robot.n_arms)
    deviations = []
    for scale in (1.0, 0.1):
        machine = robot.replace(gravity=scale * robot.gravity)
        offset = scale * np.linspace(-0.004, 0.005, robot.n_arms)

        def static(q, machine=machine):
            return rk.minimal_dynamics(machine, q, 0 * q)[2]

        def balance(p, machine=machine, offset=offset, static=static):
            q = rk.inverse_kinematics(machine, p)
            e = (q - q_d)[: machine.n_arms]
            return rk.control_matrix(machine, q).T @ (K * (e + offset)) + static(q)

        p = root(balance, x_d, tol=1e-14).x
        e = (rk.inverse_kinematics(machine, p) - q_d)[: machine.n_arms]
        A = rk.control_matrix(machine, q_d)
        predicted = rk.steady_state_error(A, K, offset, static(q_d))
        deviations.append(np.abs(predicted - e).max())
        assert deviations[-1] < 0.1 * np.abs(e).max()
        # (13): the predicted state satisfies the linear balance exactly, with c0 = -K (e_a + offset) after (14).
        c = rk.steady_state_torque(A, K, offset, static(q_d))
        assert_allclose(A.T @ c, static(q_d), atol=1e-12)
        assert_allclose(c, -K * (predicted + offset), atol=1e-15)
    # Second-order remainder: ten times smaller causes, a hundred times smaller deviation.
    assert_allclose(np.log10(deviations[0] / deviations[1]), 2, atol=0.15)


def test_without_wrench_all_torque_at_rest_is_antagonism():
    A = rk.control_matrix(TESTBED, rk.inverse_kinematics(TESTBED, random_points(TESTBED, 100)))
    offset = np.array([0.004, -0.002, 0.005])
    c = rk.steady_state_torque(A, 7.05, offset)
    assert_allclose(np.einsum("kij,kj->ki", rk.antagonism_filter(A), c), 0, atol=1e-15)
    many = rk.steady_state_error(A[0], 7.05, np.stack([offset, 2 * offset]))
    assert_allclose(many[1], 2 * many[0], rtol=1e-13)


# Maps.
@modes
def test_maps_agree_with_the_pointwise_functions(mode):
    x, y, sigma = rk.actuation_map(TESTBED, "sigma_min", mode, n=40)
    points = np.stack(np.meshgrid(x, y), axis=-1)[~sigma.mask]
    q = rk.inverse_kinematics(TESTBED, points, mode)
    A_tilde, A = rk.redundant_control_matrix(TESTBED, q), rk.control_matrix(TESTBED, q)
    lapack = lambda M: np.linalg.svd(M, compute_uv=False)  # noqa: E731
    assert_allclose(sigma.compressed(), lapack(A_tilde)[:, 1], atol=1e-10)
    assert_allclose(rk.actuation_map(TESTBED, "condition", mode, n=40)[2].compressed(), np.linalg.cond(A), rtol=1e-8)
    cross = np.abs(rk.distal_cross_products(TESTBED, q))
    assert_allclose(rk.actuation_map(TESTBED, "cross", mode, n=40)[2].compressed(), cross.max(axis=-1), atol=1e-15)
    prestress = rk.actuation_map(TESTBED, "prestress", mode, n=40)[2]
    assert_allclose(prestress[2].compressed(), np.abs(rk.null_vector(TESTBED, q))[:, 2], atol=1e-15)
    for k, pair in enumerate(PAIRS):
        alone = lambda measure, pair=pair: rk.actuation_map(TESTBED, measure, mode, 40, pair=pair)[2]  # noqa: E731
        assert_allclose(alone("cross").compressed(), cross[:, k], atol=1e-15)
        assert_allclose(alone("sigma_min").compressed(), lapack(A_tilde[:, pair, :])[:, 1], atol=1e-9)
    for rule in ("sigma_min", "condition", "printed"):
        chosen = rk.switching_map(TESTBED, rule, mode, n=40)[2].compressed()
        assert np.mean(np.array(PAIRS)[chosen] == rk.select_independent(A_tilde, rule)) > 0.999  # ties aside
    assert np.array_equal(rk.switching_map(TESTBED, mode=mode, n=40)[2].compressed(), cross.argmax(axis=-1))


@pytest.mark.parametrize("rule", ["cross", *PARTITION_RULES])
def test_a_switching_map_of_several_modes_is_one_for_each(rule):
    both = rk.switching_map(TESTBED, rule, MODES[:2], n=25)[2]
    for chosen, mode in zip(both, MODES[:2], strict=True):
        alone = rk.switching_map(TESTBED, rule, mode, n=25)[2]
        assert np.array_equal(chosen.mask, alone.mask) and np.array_equal(chosen.compressed(), alone.compressed())


def test_maps_of_all_modes_at_once_hold_no_nan():
    for measure in ("sigma_min", "condition", "cross", "prestress"):
        x, y, value = rk.actuation_map(TESTBED, measure, MODES, n=60)
        assert value.shape == ((3,) if measure == "prestress" else ()) + (8, 60, 60)
        assert np.all(np.isfinite(value.data))
        alone = rk.actuation_map(TESTBED, measure, MODES[3], n=60)[2]
        assert np.array_equal(value[..., 3, :, :].filled(-1), alone.filled(-1))
    box = (-0.01, 0.01, -0.02, 0.02)
    x, y, value = rk.actuation_map(TESTBED, box=box, n=5)
    assert (x[0], x[-1], y[0], y[-1]) == box and not value.mask.any()


def test_maps_mask_the_boundary_where_an_arm_is_stretched():
    # Box corners that lie on the boundary up to rounding, on either side of it.
    for angle in np.linspace(0.35, 0.9, 40):
        px, py = TESTBED.base[0] + 0.4 * np.array([np.cos(angle), np.sin(angle)])
        _, _, sigma = rk.actuation_map(TESTBED, n=2, box=(px - 0.1, px, py - 0.1, py))
        assert sigma.mask[1, 1] and not sigma.mask[0, 0]


def test_a_folded_arm_is_not_inside():
    """With equal links an arm folds onto its base point, here the middle of nine."""
    robot = rk.Manipulator(base=[[-0.1, 0.0], [0.1, 0.0]], lengths=0.2, masses=0.1)
    box = (-0.11, -0.09, -0.01, 0.01)
    inside = rk.workspace_grid(robot, 3, box)[2]
    assert not inside[1, 1] and inside.sum() == 8
    for empty in ((0.1, 0.1, -0.1, 0.1), (-0.1, 0.1, 0.1, 0.1)):
        with pytest.raises(ValueError, match="x_min, x_max, y_min, y_max"):
            rk.workspace_grid(robot, 3, empty)
    assert np.all(np.isfinite(rk.actuation_map(robot, n=3, box=box)[2].compressed()))


def test_map_masks_the_input_singularity_of_a_mixed_mode():
    mode, box = next(
        (m, p)
        for m in MIXED
        for p in MIDPOINTS
        if rk.degree_of_actuation(TESTBED, rk.inverse_kinematics(TESTBED, p, m)) == 1
    )
    px, py = box
    x, y, n = rk.actuation_map(TESTBED, "prestress", mode, n=3, box=(px - 0.01, px + 0.01, py - 0.01, py + 0.01))
    assert n.mask[:, 1, 1].all() and np.all(np.isfinite(n.data))
    _, _, kappa = rk.actuation_map(TESTBED, "condition", mode, n=3, box=(px - 0.01, px + 0.01, py - 0.01, py + 0.01))
    assert kappa.mask[1, 1]


@machines
def test_prestress_map_shows_the_rows_of_the_null_basis(robot):
    if robot.n_arms == 2:
        with pytest.raises(ValueError, match="robot has 2 arms, which cannot prestress each other; allowed: 3 or more"):
            rk.actuation_map(robot, "prestress", n=20)
        return
    x, y, share = rk.actuation_map(robot, "prestress", n=25)
    points = np.stack(np.meshgrid(x, y), axis=-1)[~share.mask[0]]
    n = rk.null_basis(rk.control_matrix(robot, rk.inverse_kinematics(robot, points)))
    assert share.shape == (robot.n_arms, 25, 25)
    assert_allclose(share[:, ~share.mask[0]].data.T, np.linalg.norm(n, axis=-1), atol=1e-10)
    assert_allclose((share.data[:, ~share.mask[0]] ** 2).sum(axis=0), robot.n_arms - 2, rtol=1e-12)


def test_zero_prestress_curves_are_the_switching_curves():
    # Fact 3: |n_1| and |d_2 x d_3| vanish together, cell by cell.
    x, y, n = rk.actuation_map(TESTBED, "prestress", n=150)
    for arm, pair in ((0, (1, 2)), (1, (0, 2)), (2, (0, 1))):
        cross = rk.actuation_map(TESTBED, "cross", n=150, pair=pair)[2]
        inside = ~cross.mask
        assert np.corrcoef(n[arm][inside] < 0.02, cross[inside] < 0.02)[0, 1] > 0.7
        assert n[arm][inside][cross[inside] < 1e-3].max() < 0.02


# Leading axes.
@pytest.mark.parametrize("name", ["testbed", "four_arms"])
def test_one_pose_and_a_trajectory_are_the_same_call(name):
    robot = MACHINES[name]
    q, qd, qdd, _ = random_motion(robot, 12)
    A, A_tilde = rk.control_matrix(robot, q), rk.redundant_control_matrix(robot, q)
    rng = np.random.default_rng(3)
    offset, W = rng.normal(0, 0.01, (12, robot.n_arms)), rng.uniform(1, 2, robot.n_arms)
    of = lambda f: lambda *a: f(robot, *a)  # noqa: E731
    calls = [
        (of(rk.control_matrix), q),
        (of(rk.redundant_control_matrix), q),
        (of(rk.degree_of_actuation), q),
        (of(rk.control_vector_fields), q),
        (of(rk.distal_cross_products), q),
        (rk.singular_values, A),
        (lambda M: rk.weighted_pseudoinverse(M, W), A),
        (lambda M: rk.prestress_projector(M, W), A),
        (rk.antagonism_filter, A),
        (lambda M: rk.command_filter(M, W), A),
        (lambda *a: rk.inverse_dynamics(robot, *a, W, offset[0]), q, qd, qdd),
        (of(rk.required_wrench), q, qd, qdd),
        (lambda M, o: rk.steady_state_error(M, W, o), A, offset),
        (lambda M, o: rk.steady_state_torque(M, W, o), A, offset),
        (rk.select_independent, A_tilde),
        (rk.explicit_pseudoinverse, A_tilde, rk.select_independent(A_tilde)),
    ]
    if robot.n_arms == 3:
        calls.append((of(rk.null_vector), q))
    for f, *args in calls:
        whole = f(*args)
        single = np.stack([f(*[a[k] for a in args]) for k in range(12)])
        assert_allclose(whole, single, rtol=1e-12, atol=1e-12 * np.abs(whole).max())
        block = f(*[a.reshape(3, 4, *a.shape[1:]) for a in args])
        assert_allclose(block.reshape(whole.shape), single, rtol=1e-12, atol=1e-12 * np.abs(whole).max())
        assert f(*[a[:0] for a in args]).shape == (0, *whole.shape[1:])
    assert rk.actuation_type(robot, q).shape == (12,)


def test_a_matrix_for_each_pose():
    """Gains and weights may differ from pose to pose; the poses must be the same ones."""
    rng = np.random.default_rng(8)
    q = rk.inverse_kinematics(TESTBED, rng.uniform(-0.05, 0.05, (4, 2)))
    A = rk.control_matrix(TESTBED, q)
    K = np.einsum("kij,klj->kil", *[rng.normal(size=(4, 3, 3))] * 2) + np.eye(3)
    for function in (rk.command_filter, rk.weighted_pseudoinverse):
        assert_allclose(function(A, K), [function(*pair) for pair in zip(A, K, strict=True)], rtol=0, atol=1e-12)
        with pytest.raises(ValueError, match=r"A \(4,\), [KW] \(3,\); allowed: equal ones"):
            function(A, K[:3])
    qd = np.einsum("kij,kj->ki", rk.orthogonal_complement(TESTBED, q), rng.normal(size=(4, 2)))
    qdd = np.zeros_like(qd)
    one_by_one = [rk.inverse_dynamics(TESTBED, *row[:3], W=row[3]) for row in zip(q, qd, qdd, K, strict=True)]
    assert_allclose(rk.inverse_dynamics(TESTBED, q, qd, qdd, W=K), one_by_one, rtol=0, atol=1e-12)
    with pytest.raises(ValueError, match=r"A \(4,\), W \(3,\); allowed: equal ones"):
        rk.inverse_dynamics(TESTBED, q, qd, qdd, W=K[:3])
    with pytest.raises(ValueError, match=r"motion \(4,\), W \(3,\); allowed: equal ones"):
        rk.inverse_dynamics(TESTBED, q[0], qd[0], qdd, W=K[:3])


@pytest.mark.parametrize("third", [[0.0, 1.0], [1.0, 2.0]])
def test_two_opposite_drives_leave_the_third_without_a_load(third):
    """A^T n = (n_1 - n_2 [+ n_3], k n_3) = 0 asks for n_3 = 0."""
    assert not rk.common_sign([[1.0, 0.0], [-1.0, 0.0], third])


def test_chosen_rows_belong_to_the_caller():
    A_tilde = rk.redundant_control_matrix(TESTBED, rk.inverse_kinematics(TESTBED, [0.02, 0.05]))
    rows = rk.select_independent(A_tilde)
    rows += 1
    assert rk.select_independent(A_tilde).tolist() == [0, 2]


def test_a_prestress_of_one_pair_is_refused():
    with pytest.raises(ValueError, match=r"pair = \(0, 1\) of measure = 'prestress'; allowed: None"):
        rk.actuation_map(TESTBED, "prestress", n=5, pair=(0, 1))


@pytest.mark.parametrize("x, words", [([0.02, 0.05], r"\(delta,\)$"), ([[0.02, 0.05]] * 3, r"or \(3, delta\)$")])
def test_shapes_of_rows_are_told_as_shapes(x, words):
    A_tilde = rk.redundant_control_matrix(TESTBED, rk.inverse_kinematics(TESTBED, x))
    with pytest.raises(ValueError, match=words):
        rk.explicit_pseudoinverse(A_tilde, np.array([[0, 1], [0, 2]]))


@pytest.mark.parametrize(
    "call",
    [
        lambda A, K: rk.weighted_pseudoinverse(A, 1.0 / K),
        lambda A, K: rk.command_filter(A, K),
        lambda A, K: rk.steady_state_error(A, K, [1e-3, 0.0, 0.0]),
    ],
)
def test_weights_that_differ_too_much_are_no_input_singularity_of_the_pose(call):
    """With two stiffnesses of nearly nothing one drive is left for two forces, at a pose where A is regular."""
    A = rk.control_matrix(TESTBED, rk.inverse_kinematics(TESTBED, [0.02, 0.05]))
    assert np.linalg.cond(A) < 3.0
    with pytest.raises(ValueError, match=r"weighted|K A has") as caught:
        call(A, np.array([1e-30, 1e-30, 1.0]))
    assert str(caught.value).endswith("and gains or weights that differ less")


def exactly(A, V):
    """V A (A^T V A)^-1 for A (m, 2) and V = W^-1 (m,), both rational: (11)."""
    AtVA = A.T @ (V[:, None] * A)
    (a, b), (_, d) = AtVA
    return V[:, None] * A @ np.array([[d, -b], [-b, a]]) / (a * d - b * b)


@pytest.mark.parametrize("ratio", [1e4, 1e12, 1e20])
@pytest.mark.parametrize("name", ["testbed", "four_arms"])
def test_weights_and_gains_of_very_different_drives_cost_no_digits(name, ratio):
    """Of every torque and angle as many digits as of A, whichever drives are the heavy or the stiff ones."""
    robot, rng, rational = MACHINES[name], np.random.default_rng(3), np.vectorize(Fraction, otypes=[object])
    A = rk.control_matrix(robot, rk.inverse_kinematics(robot, [0.02, 0.05]))
    offset, force = rng.normal(size=len(A)), rng.normal(size=2)
    A_, o, f, one = map(rational, (A, offset, force, np.eye(len(A))))
    near = lambda c, exact: assert_allclose(c, exact.astype(float), rtol=1e-11, atol=0.0)  # noqa: E731
    for pattern in itertools.product([1.0, ratio], repeat=len(A)):
        W = np.array(pattern)
        K = rational(W)
        pinv, springs = exactly(A_, 1 / K), exactly(A_, K)
        near(rk.weighted_pseudoinverse(A, W), pinv)
        beside = np.stack([A, A * np.sqrt(W)[:, None]])  # a neighbour whose rows are alike once they are weighted
        near(rk.weighted_pseudoinverse(beside, W)[0], pinv)
        near(rk.prestress_projector(A, W), one - pinv @ A_.T)
        near(rk.allocate_torques(A, force, 1e30, W=W), pinv @ f)
        # Springs of the stiffness K share a force as weights 1 / K do.
        c = springs @ (A_.T @ (K * o) + f) - K * o
        near(rk.steady_state_torque(A, W, offset, force), c)
        near(rk.steady_state_error(A, W, offset, force), -c / K - o)
        R = rk.command_filter(A, np.sqrt(W))
        assert_allclose(R, (springs @ A_.T).astype(float) * np.sqrt(W / W[:, None]), rtol=0.0, atol=1e-14)


def test_the_switching_map_keeps_its_digits_at_the_rim_of_the_workspace():
    """A~ from J, which is regular there, against the map along a line between regions, where merits differ by 1e-8."""
    robot = TESTBED.replace(mode=[-1, -1, -1])
    centre = math.atan2(*-robot.base[1][::-1])

    def at_rim(angle):
        x = robot.base[1] + (0.4 - 4.5e-10) * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        return x, rk.redundant_control_matrix(robot, rk.inverse_kinematics(robot, x))

    angles = np.linspace(centre - 0.5, centre + 0.5, 500)
    best = rk.select_independent(at_rim(angles)[1], "printed")
    k = np.flatnonzero(np.diff(best, axis=0).any(axis=-1))[0]

    def ahead(angle):
        """By how much, of itself, the merit of the pair before the line exceeds that of the pair behind it."""
        one, other = (PARTITION_RULES["printed"](at_rim(angle)[1][pair]) for pair in best[k : k + 2])
        return float((one - other) / np.abs(one))

    for angle in brentq(ahead, angles[k], angles[k + 1], xtol=1e-15) + np.linspace(-2e-8, 2e-8, 100):
        if abs(lead := ahead(angle)) > 1.1e-9:  # less counts as equal
            u, v = at_rim(angle)[0]
            index = rk.switching_map(robot, "printed", n=2, box=(u - 1e-3, u, v - 1e-3, v))[2].data[1, 1]
            assert PAIRS[index] == tuple(best[k] if lead > 0.0 else best[k + 1]), lead


def near_the_curve(distance):
    """A pose at this distance in m from where the drives 0 and 1 are no coordinates."""

    def cross(y):
        return rk.distal_cross_products(TESTBED, rk.inverse_kinematics(TESTBED, [0.0, y]))[0]

    low, high = next((y, y + 0.01) for y in np.arange(-0.16, 0.26, 0.01) if cross(y) * cross(y + 0.01) < 0.0)
    return rk.inverse_kinematics(TESTBED, [0.0, brentq(cross, low, high, xtol=1e-16) + distance])


@pytest.mark.parametrize("distance", [1e-2, 1e-4, 1e-6, 1e-8])
def test_control_vector_fields_do_not_lose_digits_where_coordinates_do(distance):
    """What the drives accelerate is there whatever the coordinates: by the multipliers of (2) it is found without."""
    robot, q = TESTBED.replace(friction=0.0, gravity=[0, 0]), near_the_curve(distance)
    fields = rk.control_vector_fields(robot, q, (0, 1))
    for i, c in enumerate(np.eye(3)):
        qdd, _ = rk.forward_dynamics(robot, q, 0 * q, c)
        assert_allclose(fields[:, i], qdd[:2], rtol=0, atol=1e-12 * np.abs(qdd).max())


@pytest.mark.parametrize("W", [None, [1.0, 2.0, 0.25]])
@pytest.mark.parametrize("least", [1.0, 1e-4, 1e-8, 1e-11])
def test_a_prestress_moves_nothing_near_an_input_singularity(W, least):
    """A^T N_{A^T,W} = 0 to the rounding of A, however small one of its singular values."""
    rng = np.random.default_rng(7)
    for _ in range(20):
        U, V = np.linalg.qr(rng.normal(size=(3, 2)))[0], np.linalg.qr(rng.normal(size=(2, 2)))[0]
        A = U @ np.diag([1.0, least]) @ V.T
        for of in (A, np.array([A, A])):
            N = rk.prestress_projector(of, W)
            assert np.abs(np.swapaxes(of, -1, -2) @ N).max() < 1e-14
            weighted = N if W is None else np.array(W)[:, None] * N
            assert_allclose(weighted, np.swapaxes(weighted, -1, -2), rtol=0, atol=1e-14)
