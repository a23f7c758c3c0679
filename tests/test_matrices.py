"""The theory on matrices of any mechanism: the machine's own functions, and identities for delta = 3, m = 4."""

import itertools

import numpy as np
import pytest
from numpy.testing import assert_allclose
from samples import FRICTIONLESS, MACHINES, machines, random_motion

import rapkm_lite as rk
from rapkm_lite.mechanics.antagonism import _references
from rapkm_lite.mechanics.cores import prestress_shares
from rapkm_lite.mechanics.linalg import least_singular_value, many_inverses

TREE = rk.mass_matrix, rk.coriolis_matrix, rk.generalized_forces


@machines
def test_they_are_the_formulas_of_the_machine(robot):
    q, qd, _, _ = random_motion(robot, 20, bend=0.2)
    J, J_dot = rk.constraint_jacobian(robot, q), rk.constraint_jacobian_dot(robot, q, qd)
    pair = (0, robot.n_arms)
    F, F_dot = rk.complement(J, pair), rk.complement_dot(J, J_dot, pair)
    N, N_dot = rk.projector(J), rk.projector_dot(J, J_dot)
    tree = rk.mass_matrix(robot, q), rk.coriolis_matrix(robot, q, qd), rk.generalized_forces(robot, q, qd)
    same = [
        (F, rk.orthogonal_complement(robot, q, pair)),
        (F_dot, rk.orthogonal_complement_dot(robot, q, qd, pair)),
        (N, rk.nullspace_projector(robot, q)),
        (N_dot, rk.nullspace_projector_dot(robot, q, qd)),
        *zip(rk.minimal_terms(F, F_dot, *tree), rk.minimal_dynamics(robot, q, qd, pair), strict=True),
        *zip(rk.redundant_terms(N, N_dot, *tree), rk.redundant_dynamics(robot, q, qd), strict=True),
    ]
    for ours, theirs in same:
        assert_allclose(ours, theirs, rtol=1e-12, atol=1e-12 * np.abs(theirs).max())


@pytest.mark.parametrize("which", range(3))
def test_matrices_of_other_poses_are_refused(which):
    q, qd, _, _ = random_motion(FRICTIONLESS, 4, bend=0.2)
    J, J_dot = rk.constraint_jacobian(FRICTIONLESS, q), rk.constraint_jacobian_dot(FRICTIONLESS, q, qd)
    tree = [f(FRICTIONLESS, q) if f is rk.mass_matrix else f(FRICTIONLESS, q, qd) for f in TREE]
    tree[which] = tree[which][:3]
    with pytest.raises(ValueError, match=rf"{'GCQ'[which]}.*\(3,\)|\(3,\).*{'GCQ'[which]}"):
        rk.redundant_terms(rk.projector(J), rk.projector_dot(J, J_dot), *tree)


# A made-up mechanism with delta = 3, m = 4, as a planar 4RRR machine has: n = 9, r = 6, J(t) = J0 + t J1.
RNG = np.random.default_rng(4)
J0, J1 = RNG.normal(size=(2, 6, 9))
PAIRWISE = (0, 1, 8)


def test_complement_and_projector_for_three_degrees_of_freedom():
    F, N = rk.complement(J0, PAIRWISE), rk.projector(J0)
    assert_allclose(J0 @ F, 0, atol=1e-13)
    assert_allclose(F[list(PAIRWISE)], np.eye(3), atol=0)
    assert_allclose(N @ N, N, atol=1e-14)
    assert_allclose(N, np.eye(9) - np.linalg.pinv(J0) @ J0, atol=1e-13)
    assert_allclose(rk.projector(np.stack([J0, J1]))[0], N, atol=1e-14)


@pytest.mark.parametrize(
    ("matrix", "rate"),
    [
        (lambda J: rk.complement(J, PAIRWISE), rk.complement_dot(J0, J1, PAIRWISE)),
        (rk.projector, rk.projector_dot(J0, J1)),
    ],
)
def test_rates_are_derivatives(matrix, rate):
    step = 1e-6
    difference = (matrix(J0 + step * J1) - matrix(J0 - step * J1)) / (2 * step)
    assert_allclose(rate, difference, rtol=0, atol=1e-8 * np.abs(rate).max())


def test_motion_equations_in_both_coordinates_agree():
    """(23) is (6) lifted: F^T times it, for a tangent motion, gives (6) of the same motion."""
    G = RNG.normal(size=(9, 9))
    G, C, Q = G @ G.T, RNG.normal(size=(9, 9)), RNG.normal(size=9)
    F, F_dot = rk.complement(J0, PAIRWISE), rk.complement_dot(J0, J1, PAIRWISE)
    q2d, q2dd = RNG.normal(size=(2, 3))
    qd, qdd = F @ q2d, F @ q2dd + F_dot @ q2d
    Gbar, Cbar, Qbar = rk.minimal_terms(F, F_dot, G, C, Q)
    Gt, Ct, Qt = rk.redundant_terms(rk.projector(J0), rk.projector_dot(J0, J1), G, C, Q)
    assert_allclose(F.T @ (Gt @ qdd + Ct @ qd + Qt), Gbar @ q2dd + Cbar @ q2d + Qbar, rtol=1e-11)


def test_explicit_pseudoinverse_for_three_degrees_of_freedom():
    A_tilde = rk.projector(J0)[[0, 1, 2, 3]]
    best = rk.select_independent(A_tilde, delta=3)
    truth = np.linalg.pinv(A_tilde.T, rcond=1e-9)
    for rows in ([0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3], best):
        assert_allclose(rk.explicit_pseudoinverse(A_tilde, rows), truth, atol=1e-10)
    sigma = [np.linalg.svd(A_tilde[list(rows)])[1][2] for rows in ([0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3])]
    assert_allclose(np.linalg.svd(A_tilde[best])[1][2], max(sigma))
    many = np.stack([A_tilde, A_tilde[::-1]])
    rows = np.stack([best, [0, 1, 2]])
    for kind in (int, np.uint8):
        assert_allclose(rk.explicit_pseudoinverse(many, rows.astype(kind))[0], truth, atol=1e-10)
    with pytest.raises(ValueError, match=r"rows holds \[0, 1, 0\]; allowed: different indices"):
        rk.explicit_pseudoinverse(many, np.array([[0, 1, 2], [0, 1, 0]]))


def test_the_filter_of_three_degrees_of_freedom_leaves_nothing():
    A = rk.complement(J0, PAIRWISE)[:4]
    R, n, c = rk.antagonism_filter(A), rk.null_basis(A), RNG.normal(size=4)
    assert_allclose(A.T @ R @ c, A.T @ c, atol=1e-12)
    assert np.abs(n.T @ R @ c).max() < 5e-15 * np.linalg.norm(c)
    e = rk.steady_state_error(A, np.full(4, 7.0), 1e-3 * c)
    assert_allclose(A.T @ (7.0 * (e + 1e-3 * c)), 0, atol=1e-14)


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: rk.complement(J0, (0, 1)), "independent = .*allowed: 3 different"),
        (lambda: rk.complement(np.eye(3), (0,)), r"J has shape \(3, 3\)"),
        (lambda: rk.complement([[1.0, 0.0, 0.0]], (0, 1)), "singular"),
        (lambda: rk.projector(np.zeros((2, 4))), "lost rank"),
        (lambda: rk.projector_dot(J0, J1[:2]), "J_dot has shape"),
        (lambda: rk.minimal_terms(np.ones((9, 3)), np.ones((9, 2)), *3 * [np.eye(9)]), "F_dot"),
        (lambda: rk.minimal_terms(np.ones(9), np.ones(9), *2 * [np.eye(9)], np.ones(9)), r"F has shape \(9,\)"),
        (lambda: rk.complement([1.0, 0.0, 0.0], (0, 1)), r"J has shape \(3,\)"),
        (lambda: rk.redundant_terms(np.ones(9), np.ones(9), *2 * [np.eye(9)], np.ones(9)), r"N has shape \(9,\)"),
        (lambda: rk.redundant_terms(np.eye(9), np.ones(9), *2 * [np.eye(9)], np.ones(9)), r"N_dot \(9,\)"),
        (lambda: rk.redundant_terms(np.eye(9), np.eye(9), np.eye(9), np.eye(9), np.ones(8)), "Q has shape"),
        (
            lambda: rk.redundant_terms(*2 * [np.ones((5, 2, 3))], *2 * [np.eye(3)], np.ones(3)),
            r"N has shape \(5, 2, 3\)",
        ),
        (lambda: rk.select_independent(np.eye(4), delta=5), "delta = 5"),
        (lambda: rk.explicit_pseudoinverse(np.eye(4), (0, 0)), "rows"),
    ],
)
def test_bad_matrices(call, sentence):
    with pytest.raises(ValueError, match=sentence):
        call()


@pytest.mark.parametrize("unit", [1e-20, 1.0, 1e12])
def test_complement_does_not_feel_the_units_of_the_constraints(unit):
    """J qd = 0 says the same in any unit; J1 is singular where its columns are parallel, to rounding."""
    J = np.random.default_rng(6).normal(size=(2, 4))
    assert_allclose(rk.complement(unit * J, [2, 3]), rk.complement(J, [2, 3]), rtol=1e-14)
    J[:, 1] = J[:, 0] / 3
    with pytest.raises(ValueError, match="is singular here"):
        rk.complement(unit * J, [2, 3])


def test_machines_are_unchanged_by_it():
    q = rk.inverse_kinematics(FRICTIONLESS, [0.03, 0.02])
    A = rk.redundant_control_matrix(MACHINES["four_arms"], rk.inverse_kinematics(MACHINES["four_arms"], [0.03, 0.02]))
    assert_allclose(rk.explicit_pseudoinverse(A, rk.select_independent(A)), np.linalg.pinv(A.T, rcond=1e-9), atol=1e-12)
    assert rk.nullspace_projector(FRICTIONLESS, q).shape == (6, 6)


@pytest.mark.parametrize("k", [1, 2, 3, 5])
def test_the_least_singular_value_is_that_of_lapack_near_zero_and_a_lower_bound_elsewhere(k):
    R = np.triu(np.random.default_rng(3).normal(size=(40, k, k)))
    R[20:, 0, 0] *= 10.0 ** -np.arange(20)
    found = np.array([least_singular_value(1e-6 * matrix) for matrix in R])
    sigma, norm = np.linalg.svd(R, compute_uv=False)[:, -1], np.linalg.norm(R, axis=(1, 2))
    truth = np.stack([1e-6 * sigma, sigma / norm], axis=-1)
    near = (sigma < 1e-9 * norm) & (k > 1)
    assert near.any() == (k > 1)
    least = truth * {1: 1.0, 2: np.sqrt(0.5)}.get(
        k, 0.0
    )  # of two singular values the norm is at most 2^(1/2) the larger
    assert np.all(found <= truth * (1 + 1e-6)) and np.all(found >= least * (1 - 1e-6))
    assert_allclose(found[near], truth[near], rtol=1e-5 if k > 2 else 0.3)
    assert np.all(found[~near, 1] >= 1e-9 * np.sqrt(0.5))
    assert_allclose(least_singular_value(1e-6 * R), found.min(axis=0), rtol=1e-6)


@pytest.mark.parametrize("unit", [1e-8, 1e-3, 1.0, 1e3, 1e5, 1e8])
@pytest.mark.parametrize("delta", [2, 3])
def test_lost_rank_is_seen_in_any_units_and_order_of_the_coordinates(unit, delta):
    """Of two parallel columns either one may be the longer, and the first; where the others stand does not matter."""
    u, v = np.array([1.0, 2.0, 3.0, 5.0]), np.array([1.0, -1.0, 0.3, 0.1])
    parallel = np.stack([u, unit * u, v][:delta], axis=-1)
    functions = [
        rk.weighted_pseudoinverse,
        rk.antagonism_filter,
        rk.prestress_projector,
        rk.null_basis,
        rk.common_sign,
        lambda A: rk.command_filter(A, [1.0, 2.0, 3.0, 4.0]),
        lambda A: rk.weighted_pseudoinverse(A, [1.0, 2.0, 3.0, 4.0]),
        lambda A: rk.steady_state_error(A, 7.0, [1e-3, 0.0, 0.0, 0.0]),
        lambda A: rk.effective_gain(A, 7.0),
    ]
    for order in itertools.permutations(range(delta)):
        A = parallel[:, order]
        for function in functions:
            for stack in (A, np.stack([np.eye(4, delta), A])):
                with pytest.raises(ValueError, match="has lost rank"):
                    function(stack)
        with pytest.raises(ValueError, match="J has lost rank"):
            rk.projector(A.T)


def test_minors_are_for_stacks_of_two_columns_alone():
    A = np.random.default_rng(4).normal(size=(5, 4, 3))
    assert many_inverses(A) is None and many_inverses(A[0, :, :2]) is None
    A = A[..., :2]
    assert_allclose(many_inverses(A), np.linalg.pinv(A.mT), rtol=0, atol=1e-12)


def test_thin_matrices_are_left_to_factorizations_whatever_their_size():
    """Rows that are nearly parallel to a part in 1e7 lose their rank in the minors; metres or millimetres."""
    thin = np.array([[1.0, 0.0], [1.0, 1e-7], [1.0, 0.0]])
    for size in (1e-4, 1.0, 1e4):
        assert many_inverses(size * thin[None]) is None
        assert many_inverses(size * np.stack([np.eye(3, 2), thin])) is None  # one of many is enough
        assert many_inverses(size * np.eye(3, 2)[None]) is not None


def test_shares_of_a_prestress_are_the_rows_of_the_null_basis_in_any_unit():
    """Metres or micrometres per radian: the null space does not change; all distal links parallel: no direction."""
    A = np.random.default_rng(5).normal(size=(6, 4, 2))
    rows = np.linalg.norm(rk.null_basis(A), axis=-1)
    parallel = np.outer([1.0, 2.0, -1.0, 0.5], [0.6, 0.8])
    for size in (1e-6, 1.0, 1e6):
        assert_allclose(prestress_shares(size * A), rows, rtol=0, atol=1e-12)
        assert np.all(np.isinf(prestress_shares(size * parallel)))


def test_each_matrix_of_a_stack_has_its_own_rows():
    """In any order, along any axes; a row twice is refused where it stands."""
    rng = np.random.default_rng(8)
    A = rng.normal(size=(1, 2, 4, 2)) @ rng.normal(size=(1, 2, 2, 6))
    rows = np.array([[[0, 1], [1, 0]]])
    for stack, chosen in ((A, rows), (A[0], rows[0])):
        found = rk.explicit_pseudoinverse(stack, chosen)
        assert_allclose(found, np.linalg.pinv(stack.mT, rcond=1e-9), rtol=0, atol=1e-11)
    with pytest.raises(ValueError, match=r"rows holds \[3, 3\]; allowed: different indices"):
        rk.explicit_pseudoinverse(A, np.array([[[0, 3], [3, 3]]]))
    with pytest.raises(ValueError, match=r"rows holds \[0, 4\]; allowed: different indices from 0 to 3"):
        rk.explicit_pseudoinverse(A[0], np.array([[0, 4], [0, 1]]))


@pytest.mark.parametrize("at", [0, 1])
def test_one_singular_choice_among_many_is_refused_with_its_measure(at):
    """J = (1, x): q1' = -x q2' serves for any x, q2' = -q1' / x for x = 1 and not for x = 1e-13."""
    J = np.array([[[1.0, 1e-13]], [[1.0, 1.0]]])[[at, 1 - at]]
    with pytest.raises(ValueError, match=r"independent = \(0,\) is singular here: its .* is 1e-13, needed: >= 1e-12"):
        rk.complement(J, (0,))
    assert_allclose(rk.complement(J, (1,)), [[[-x], [1.0]] for x in J[:, 0, 1]], rtol=0, atol=1e-15)


@pytest.mark.parametrize("m", [3, 4, 5, 6, 7])
def test_directions_of_reference_are_no_forces_of_a_symmetric_machine(m):
    """Drives at equal angles: the columns of A are the first harmonic, to which all other ones are orthogonal."""
    turn = 2 * np.pi * np.arange(m) / m
    for number in range(m):
        A = np.stack([np.cos(turn + number), np.sin(turn + number)], axis=-1)
        assert_allclose(_references(m).T @ A, 0.0, atol=1e-12)
    assert np.linalg.matrix_rank(_references(m)) == m - 2


def test_one_force_serves_many_motions():
    """A Q, C or G of one pose beside many rates is broadcast; a number that fits neither is refused."""
    robot = FRICTIONLESS
    q = rk.inverse_kinematics(robot, [0.02, 0.03])
    qd = np.array([rk.at(robot, q).F @ v for v in np.random.default_rng(3).normal(size=(4, 2))])
    many = rk.at(robot, np.tile(q, (4, 1)), qd)
    alone = many.Q[0]
    G2, C2, Q2 = rk.minimal_terms(many.F, many.F_dot, many.G[0], many.C, alone)
    assert G2.shape == C2.shape == (4, 2, 2) and Q2.shape == (4, 2)
    assert_allclose(Q2, np.tile(many.F[0].T @ alone, (4, 1)), rtol=0, atol=1e-14)
    with pytest.raises(ValueError, match=r"G|C|Q"):
        rk.minimal_terms(many.F, many.F_dot, many.G, many.C, np.zeros((3, robot.n_joints)))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_lost_rank_is_seen_whatever_the_signs_of_the_constraints(sign):
    """h = 0 and -h = 0 are the same constraint; the second row is thrice the first, but for rounding."""
    row = np.array([0.1, 0.7, 1.1])
    with pytest.raises(ValueError, match="J has lost rank"):
        rk.projector(sign * np.stack([row, 3.0 * row]))
    independent = sign * np.stack([row, [0.2, 0.3, 0.9]])
    assert_allclose(rk.projector(independent) @ np.cross(*independent), np.cross(*independent), rtol=0, atol=1e-15)


def test_constraints_of_a_stack_may_be_written_in_any_units():
    """h = 0 and 1e14 h = 0 are the same constraints, with the same tangent space, also beside each other."""
    rng = np.random.default_rng(2)
    J, J_dot = rng.normal(size=(2, 3, 5))
    units = np.array([1.0, 1e-8, 1e14])[:, None, None]
    assert_allclose(rk.projector(units * J), [rk.projector(J)] * 3, rtol=0, atol=1e-14)
    rates = rk.projector_dot(units * J, units * J_dot)
    assert_allclose(rates, [rk.projector_dot(J, J_dot)] * 3, rtol=1e-12, atol=1e-13)
    with pytest.raises(ValueError, match="J has lost rank"):
        rk.projector(units * np.stack([J, J, J[[0, 1, 1]]]))


def test_a_drive_without_any_direction_changes_no_common_sign():
    """A^T n does not hold its n_i, which may be anything: what counts is whether the others balance."""
    left, right = [[-1.0, 1.0], [-1.0, -1.0]], [[0.0, 1.0], [-1.0, -0.5], [1.0, -0.5]]
    for rows, possible in ((left, False), (right, True)):
        for still in ([], [[0.0, 0.0]], [[0.0, 0.0], [-0.0, 0.0]]):
            assert bool(rk.common_sign([*rows, *still])) == possible


def test_the_closed_form_of_the_null_vector_is_that_of_three_arms():
    """Its cyclic products are a null vector of A^T for no other number of arms; `null_basis` has one for each."""
    for name in ("five_bar", "four_arms"):
        robot = rk.load(name)
        with pytest.raises(ValueError, match=r"robot has [24] arms; allowed: 3 \(null_basis takes any number\)"):
            rk.null_vector(robot, rk.inverse_kinematics(robot, [0.01, 0.02]))


@pytest.mark.parametrize("m", [4, 5, 6, 7])
def test_null_bases_face_their_references_in_any_unit(m):
    """The first vector is the projection of (1, ..., 1), the next ones have a positive share of their own reference."""
    for seed in range(20):
        A = np.random.default_rng(seed).normal(size=(m, 2))
        basis = rk.null_basis(A)
        even = rk.prestress_projector(A) @ np.ones(m)
        assert_allclose(basis[:, 0], even / np.linalg.norm(even), rtol=0, atol=1e-12)
        faced = _references(m)[:, : m - 3].T @ basis[:, : m - 3]
        assert np.all(np.diagonal(faced) > 0.0) and np.abs(np.triu(faced, 1)).max() < 1e-12
        assert np.linalg.det(np.hstack([A, basis])) > 0.0
    many = np.random.default_rng(m).normal(size=(m + 4, m + 3))
    for unit in (1e-49, 1e49):  # of whose powers the determinant would vanish or overflow
        assert_allclose(rk.null_basis(unit * many), rk.null_basis(many), rtol=0, atol=1e-10)


@pytest.mark.parametrize("size", [1e-14, 1e6])
def test_null_vectors_know_no_unit_of_length(size):
    robot = FRICTIONLESS.replace(base=size * FRICTIONLESS.base, lengths=size * FRICTIONLESS.lengths)
    q = rk.inverse_kinematics(FRICTIONLESS, [0.03, -0.02])
    assert_allclose(rk.null_vector(robot, q), rk.null_vector(FRICTIONLESS, q), rtol=0, atol=1e-13)
    # All distal links parallel: the elbows of arms 1 and 2 turned outwards at the middle of their base points.
    mixed = robot.replace(mode=[1, 1, -1])
    with pytest.raises(ValueError, match="input singularity"):
        rk.null_vector(mixed, rk.inverse_kinematics(mixed, mixed.base[:2].mean(axis=0)))
