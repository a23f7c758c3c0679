"""Torques within limits against a general solver and by symmetry; stiffness against the energy it comes from."""

import contextlib
import itertools
from xml.etree import ElementTree

import numpy as np
import pytest
from numpy.testing import assert_allclose
from samples import FRICTIONLESS, MACHINES, random_points
from scipy.optimize import linprog, minimize

import rapkm_lite as rk

CENTRE = rk.control_matrix(FRICTIONLESS, rk.inverse_kinematics(FRICTIONLESS, [0.0, 0.0]))
# Two null directions more than the testbed has: six drives on two forces.
SIX = np.random.default_rng(9).normal(size=(6, 2))


def demands(A, rng):
    """Limits, weights, prestress, and a wrench that some torques within the limits make."""
    m = len(A)
    limit = rng.uniform(0.5, 1.0, m)
    return A.T @ (rng.uniform(-1, 1, m) * limit), limit, rng.uniform(0.5, 3.0, m), rng.normal(0, 0.5, m)


@pytest.mark.parametrize("name", ["testbed", "four_arms", "six"])
def test_allocation_is_the_minimum_that_a_general_solver_finds(name):
    rng = np.random.default_rng(1)
    places = [None] * 20 if name == "six" else random_points(MACHINES[name], 20, bend=0.3)
    for x in places:
        A = SIX if x is None else rk.control_matrix(MACHINES[name], rk.inverse_kinematics(MACHINES[name], x))
        wrench, limit, W, c0 = demands(A, rng)
        c = rk.allocate_torques(A, wrench, limit, W, c0)

        def cost(c, W=W, c0=c0):
            return (c - c0) @ (W * (c - c0))

        peer = minimize(
            cost,
            c,
            constraints={"type": "eq", "fun": lambda c, A=A, wrench=wrench: A.T @ c - wrench},
            bounds=list(zip(-limit, limit, strict=True)),
            method="SLSQP",
            options={"ftol": 1e-12},
        )
        assert_allclose(A.T @ c, wrench, rtol=0, atol=1e-12 * np.abs(A).max())
        assert np.all(np.abs(c) <= limit) and cost(c) <= peer.fun + 1e-9


def test_without_limits_in_reach_it_is_the_weighted_pseudoinverse():
    W, c0, wrench = [1.0, 2.0, 3.0], [0.1, 0.0, 0.0], np.array([0.3, -0.2])
    robot, q = FRICTIONLESS, rk.inverse_kinematics(FRICTIONLESS, [0.0, 0.0])
    want = rk.weighted_pseudoinverse(CENTRE, W) @ wrench + rk.prestress_projector(CENTRE, W) @ c0
    assert_allclose(rk.allocate_torques(CENTRE, wrench, 1.0, W, c0), want, atol=1e-15)
    assert_allclose(rk.inverse_dynamics(robot, q, 0 * q, 0 * q, W, c0), rk.prestress_projector(CENTRE, W) @ c0)


def test_a_wrench_on_the_edge_has_one_answer_and_one_beyond_is_refused_with_the_factor():
    corner = rk.force_polygon(CENTRE, 0.1)[0]
    c = rk.allocate_torques(CENTRE, corner, 0.1)
    assert_allclose(np.abs(c), 0.1, atol=1e-12)
    assert_allclose(CENTRE.T @ c, corner, atol=1e-12)
    with pytest.raises(ValueError, match=r"needs 1\.25 times limit"):
        rk.allocate_torques(CENTRE, 1.25 * corner, 0.1)


@pytest.mark.parametrize(
    ("A", "wrench", "W", "want"),
    [
        ([[1.0, 1.0], [0.0, 0.0], [1.0, 0.0]], [0.4, 0.2], [0.7, 0.7, 2.8], [0.2, 0.0, 0.2]),  # drive 2 moves nothing
        ([[1.0, -1.0], [1.0, 0.0], [0.0, 0.0]], [0.4, -0.2], [2.6, 1.6, 1.3], [0.2, 0.2, 0.0]),
        ([[1.0, 0.0], [1.0, 1.0], [-1.0, 0.0]], [0.3, 0.2], [1.5, 1.0, 1.0], [0.04, 0.2, -0.06]),  # 1 and 3 pull alike
    ],
)
def test_on_an_edge_drives_that_do_not_hold_it_still_choose(A, wrench, W, want):
    """Lagrange, by hand: what the drives at their limits leave, the others share inversely to their weights."""
    assert_allclose(rk.allocate_torques(A, wrench, 0.2, W), want, rtol=0, atol=1e-12)


def test_on_an_edge_a_drive_that_moves_nothing_keeps_its_prestress():
    """Drives 1 and 2 pull alike and together just reach the wrench; the least change of drive 4 is none."""
    A = [[1.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.0, 0.0]]
    c = rk.allocate_torques(A, [2.0, 0.0], 1.0, W=[1.0, 3.0, 1.0, 1.0], prestress=[0.0, 0.0, 0.0, 0.3])
    assert_allclose(c, [1.0, 1.0, 0.0, 0.3], rtol=0, atol=1e-11)


@pytest.mark.parametrize("factor", [1e-8, 1e8, 1e16])
def test_torques_within_limits_do_not_depend_on_the_units_of_weights_or_drives(factor):
    """The place of a minimum does not hang on a factor of the cost, nor on the unit in which a drive is told."""
    rng = np.random.default_rng(4)
    unit = np.array([1.0, 1e3, 1.0, 1e-3, 1.0, 30.0])
    for _ in range(30):
        wrench, limit, W, c0 = demands(SIX, rng)
        c = rk.allocate_torques(SIX, wrench, limit, W, c0)
        assert_allclose(rk.allocate_torques(SIX, wrench, limit, factor * W, c0), c, rtol=0, atol=1e-9)
        told = rk.allocate_torques(SIX / unit[:, None], wrench, unit * limit, W / unit**2, unit * c0)
        assert_allclose(told / unit, c, rtol=0, atol=1e-9)


@pytest.mark.parametrize("power", range(13))
@pytest.mark.parametrize("small", [1.0, 1e-4])
def test_a_prestress_beyond_all_measure_is_refused_or_makes_no_other_force(power, small):
    """To 1e-9 of what the limits make, of small machines, too; ten times the limits are no such prestress."""
    wrench, limit = small * np.array([0.5, 0.3]), 0.2 * small
    try:
        c = rk.allocate_torques(CENTRE, wrench, limit, prestress=small * 10.0**power * rk.null_basis(CENTRE)[:, 0])
    except ValueError as error:
        assert "rounding hides the nearest torques" in str(error) and power > 1
    else:
        assert np.abs(c).max() <= limit
        assert_allclose(CENTRE.T @ c, wrench, rtol=0, atol=1e-9 * limit * np.abs(CENTRE).max())


@pytest.mark.parametrize("scale", [1e-12, 1e-6, 1e6])
def test_torques_of_least_peak_grow_with_the_wrench(scale):
    wrench = np.array([0.5, 0.3])
    assert_allclose(rk.minimax_torques(CENTRE, scale * wrench), scale * rk.minimax_torques(CENTRE, wrench), rtol=1e-9)


def test_corners_of_the_force_polygon_go_round_once_from_the_lowest_one_on():
    """Every corner is a sum of the rows with signs, of all of which none lies lower; the edges turn by 2 pi in all."""
    many = np.random.default_rng(2).normal(size=(6, 4, 2))
    many[4, 1], many[5, 2] = [1.5, 0.0], [-1.5, 0.0]  # edges along x lie at the bottom and on top
    for A in many:
        corners = rk.force_polygon(A, 0.5)
        sums = 0.5 * np.array(list(itertools.product((-1, 1), repeat=4))) @ A
        assert np.linalg.norm(corners[:, None] - sums, axis=-1).min(axis=1).max() < 1e-12
        assert_allclose(corners[0, 1], sums[:, 1].min(), atol=1e-12)
        way = np.roll(corners, -1, axis=0) - corners
        angle = np.arctan2(way[:, 1], way[:, 0])
        turns = np.mod(np.roll(angle, -1) - angle, 2 * np.pi)
        assert turns.max() < np.pi
        assert_allclose(turns.sum(), 2 * np.pi, rtol=1e-12)


def test_minimax_reaches_the_edge_of_the_force_polygon():
    """The largest share is the factor at which the wrench leaves the polygon of the limits."""
    rng = np.random.default_rng(3)
    limit = np.array([0.05, 0.1, 0.2])
    corners = rk.force_polygon(limit[:, None] * CENTRE, 1.0)
    for _ in range(20):
        wrench = rng.normal(size=2)
        c = rk.minimax_torques(CENTRE, wrench, limit)
        edges = np.roll(corners, -1, axis=0) - corners
        normal = np.stack([edges[:, 1], -edges[:, 0]], axis=-1)
        factor = np.max(normal @ wrench / np.sum(normal * corners, axis=-1))
        assert_allclose(np.max(np.abs(c) / limit), factor, rtol=1e-9)
        assert_allclose(CENTRE.T @ c, wrench, atol=1e-12)


@pytest.mark.parametrize("limit", [(1, 1e9, 1), (1e9, 1, 1), (1, 1e-9, 1e-10), (1, 1e12, 1), (1e6, 1, 1e-6)])
def test_a_drive_without_practical_limit(limit):
    """Force right to rounding, peak from the dual: motions under which one drive stands still."""
    A = rk.control_matrix(FRICTIONLESS, rk.inverse_kinematics(FRICTIONLESS, [0.02, 0.05]))
    wrench, still = A.T @ [0.1, 0.1, 0.1], np.stack([-A[:, 1], A[:, 0]])
    c = rk.minimax_torques(A, wrench, limit)
    assert_allclose(A.T @ c, wrench, rtol=1e-10)
    peak = np.max(np.abs(wrench @ still) / (limit @ np.abs(A @ still)))
    assert_allclose(np.max(np.abs(c) / limit), peak, rtol=max(1e-9, 1e-16 * max(limit) / min(limit)) * 10)
    inside = rk.allocate_torques(A, A.T @ [5.0, 0.99, -0.99], [1e9, 1.0, 1.0])
    assert_allclose(inside[2], -1.0, rtol=1e-9)
    with pytest.raises(ValueError, match="at most 1e12 times"):
        rk.minimax_torques(A, wrench, [1.0, 1e13, 1.0])


def test_the_force_of_far_limits_is_right_to_rounding():
    """A^T c = f, with limits up to twelve decades apart: the triangle of such shares alone is right to 1e-4."""
    rng = np.random.default_rng(0)
    for x in rng.uniform(-0.05, 0.05, (300, 2)):
        A = rk.control_matrix(FRICTIONLESS, rk.inverse_kinematics(FRICTIONLESS, x))
        wrench = A.T @ rng.normal(size=3)
        c = rk.minimax_torques(A, wrench, 10.0 ** rng.choice([-6.0, -3.0, 0.0, 3.0, 6.0], 3))
        assert_allclose(A.T @ c, wrench, rtol=0, atol=1e-14 * np.abs(wrench).max())


@pytest.mark.parametrize(("x", "gain"), [((0.0, 0.0), 4 / 3), ((-0.05, 0.0), 1.3013), ((-0.1, 0.0), 1.1437)])
def test_the_force_polygon_is_larger_than_what_the_pseudoinverse_reaches(x, gain):
    """Areas: zonotope of the box against {w : |(A^T)^+ w| <= 1}; reference values, exactly 4/3 at the centroid."""
    A = rk.control_matrix(FRICTIONLESS, rk.inverse_kinematics(FRICTIONLESS, x))
    rows = rk.weighted_pseudoinverse(A)
    # Corners of the strips |row . w| <= 1: crossings of two edges inside all others.
    corners = []
    for i in range(3):
        for j in range(i):
            for signs in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
                w = np.linalg.solve(rows[[i, j]], signs)
                if np.all(np.abs(rows @ w) <= 1 + 1e-12):
                    corners.append(w)
    corners = np.array(sorted(corners, key=lambda w: np.arctan2(w[1], w[0])))
    assert_allclose(area(rk.force_polygon(A, 1.0)) / area(corners), gain, rtol=5e-5)


def area(corners):
    x, y = corners.T
    return np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) / 2


def test_prestress_stiffens_in_one_sign():
    """-17.2 N/m per N m along +n at the centroid, isotropic by symmetry (reference value)."""
    q = rk.inverse_kinematics(FRICTIONLESS, [0.0, 0.0])
    n = rk.null_basis(CENTRE)[:, 0]
    change = rk.endeffector_stiffness(FRICTIONLESS, q, 7.05, n) - rk.endeffector_stiffness(FRICTIONLESS, q, 7.05)
    assert_allclose(change, -17.223 * np.eye(2), atol=1e-3)


@pytest.mark.parametrize("name", ["testbed", "four_arms", "asymmetric"])
def test_stiffness_is_the_second_derivative_of_the_energy_of_servos_and_weight(name):
    """V(x) = sum K_i (q_i(x) - q_i0)^2 / 2 with torques c = -K (q - q0) at x0."""
    robot = MACHINES[name]
    N, x0 = robot.n_arms, random_points(robot, 1, seed=2, bend=0.4)[0]
    K, c = np.linspace(5, 9, N), np.linspace(-0.3, 0.4, N)
    start = rk.inverse_kinematics(robot, x0)
    spring = start[:N] + c / K

    def energy(dx, dy):
        q = rk.inverse_kinematics(robot, x0 + [dx, dy])
        return np.sum(K * (q[:N] - spring) ** 2) / 2 + rk.potential_energy(robot, q)

    h = 1e-4
    V = np.array([[energy(i * h, j * h) for j in (-1, 0, 1)] for i in (-1, 0, 1)])
    xx, yy = V[2, 1] - 2 * V[1, 1] + V[0, 1], V[1, 2] - 2 * V[1, 1] + V[1, 0]
    xy = (V[2, 2] - V[2, 0] - V[0, 2] + V[0, 0]) / 4
    stiffness = rk.endeffector_stiffness(robot, start, K, c)
    assert_allclose(stiffness, np.array([[xx, xy], [xy, yy]]) / h**2, rtol=1e-4, atol=1e-3)


@pytest.mark.parametrize("name", MACHINES)
def test_stiffness_with_weight_is_how_the_force_of_a_hanging_machine_changes(name):
    """Held by springs just so that it rests where it is; forces at the end-effector by (6) and (7)."""
    robot = MACHINES[name].replace(gravity=[3.0, -9.0], load=0.8)
    N, x0 = robot.n_arms, random_points(robot, 1, seed=2, bend=0.4)[0]
    K, start = np.linspace(5, 9, N), rk.inverse_kinematics(robot, x0)

    def weight(q):
        return rk.minimal_dynamics(robot, q, np.zeros_like(q))[2]

    c = rk.weighted_pseudoinverse(rk.control_matrix(robot, start)) @ weight(start)

    def force(x):
        q = rk.inverse_kinematics(robot, x)
        return rk.control_matrix(robot, q).T @ (c - K * (q - start)[:N]) - weight(q)

    h = 1e-5
    falls = np.stack([(force(x0 - step) - force(x0 + step)) / (2 * h) for step in h * np.eye(2)], axis=-1)
    assert_allclose(rk.endeffector_stiffness(robot, start, K, c), falls, rtol=1e-6, atol=1e-5)


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: rk.allocate_torques(CENTRE, [1.0, 0.0], -1.0), "limit = -1"),
        (
            lambda: rk.allocate_torques(CENTRE, [1.0, 0.0], 0.1, W=[np.eye(3)] * 2),
            r"W has shape \(2, 3, 3\); allowed: ",
        ),
        (lambda: rk.allocate_torques(CENTRE, [1.0, 0.0], 9.0, W=[np.eye(3)]), r"W has shape \(1, 3, 3\); allowed: "),
        (lambda: rk.allocate_torques([[1.0]], [1.00002], 1.0), r"needs 1 \+ 2e-05 times limit"),
        (lambda: rk.allocate_torques(np.eye(4, 2), [2.0, 0.0], 1.0), "inside the force polygon of the limits"),
        (lambda: rk.allocate_torques(np.eye(4, 3), [2.0, 0.0, 0.0], 1.0), "inside the polytope of forces"),
        (lambda: rk.allocate_torques(CENTRE, [1.0, 0.0], [1.0, 1.0]), "limit has shape"),
        (lambda: rk.allocate_torques(CENTRE, [1.0], 1.0), "wrench has shape"),
        (lambda: rk.allocate_torques([CENTRE], [1.0, 0.0], 1.0), "A has shape"),
        (lambda: rk.force_polygon(np.eye(3), 1.0), r"A has shape \(3, 3\); allowed: \(m, 2\), one pose"),
        (lambda: rk.force_polygon([CENTRE], 1.0), r"A has shape \(1, 3, 2\); allowed: \(m, 2\), one pose"),
        (lambda: rk.allocate_torques(np.ones((3, 2)), [1.0, 0.0], 1.0), "lost rank"),
        (lambda: rk.minimax_torques(CENTRE, [np.nan, 0.0]), "wrench"),
        (lambda: rk.endeffector_stiffness(FRICTIONLESS, np.zeros(6), 7.05), "boundary of the workspace"),
    ],
)
def test_bad_arguments(call, sentence):
    with pytest.raises(ValueError, match=sentence):
        call()


def test_two_motors_on_each_axis_share_a_force_within_their_limits():
    """A gantry: what one motor cannot, the other one of its axis does."""
    c = rk.allocate_torques([[1.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.0, 1.0]], [1.0, 1.0], [0.2, 1.0, 1.0, 1.0])
    assert_allclose(c, [0.2, 0.8, 0.5, 0.5], atol=1e-12)


@pytest.mark.parametrize("far", [1e2, 1e4, 1e6, 1e8, 1e11])
def test_the_small_one_of_two_motors_gives_all_it_has_or_the_distance_of_the_limits_is_named(far):
    """Two motors on one axis, nine tenths of both: least squares would halve it, so the small one is at its limit."""
    assert_allclose(rk.allocate_torques([[1.0], [1.0]], [1.8], [1.0, far]), [0.9, 0.9], atol=1e-14)
    try:
        c = rk.allocate_torques([[1.0], [1.0]], [0.9 * (1.0 + far)], [1.0, far])
    except ValueError as error:
        assert "limits that differ less" in str(error) and far > 1e7
    else:
        assert_allclose(c, [1.0, 0.9 * (1.0 + far) - 1.0], rtol=1e-6)


@pytest.mark.parametrize("far", [1e2, 1e4, 1e6, 1e8, 1e10, 1e12])
def test_a_limit_far_above_the_others_is_as_good_as_none(far):
    """By hand: of two drives that act alike together with a third, the torques along (1, 1, -1), whatever is far."""
    A = np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])
    for limit, wrench, c0, want in (
        ([1.0 / far, 1.0, 1.0], [0.5, 0.5], [0.0, 0.0, 0.0], [1.0 / far, 1.0 / far, 0.5 - 1.0 / far]),
        ([1.0, 1.0, far], [2.0, 1.0], [2.0, 2.0, -2.0], [1.0, 0.0, 1.0]),
        ([1.0, 1.0, far], [0.5, 0.5], [2.0, 2.0, -2.0], [1.0, 1.0, -0.5]),
        ([far, 1.0, far], [0.0, 1.2], [2.0, 2.0, -2.0], [-0.2, 1.0, 0.2]),
    ):
        c = rk.allocate_torques(A, wrench, limit, prestress=c0)
        assert_allclose(c, want, rtol=0, atol=2e-12)
        assert_allclose(A.T @ c, wrench, rtol=0, atol=2e-12)


def test_forces_near_the_corners_of_far_limits_are_right_or_refused():
    """A corner is the force of all limits with the signs of A u, and what lies inside needs no more: A^T c = f."""
    rng, reached = np.random.default_rng(0), 0
    for _ in range(200):
        m = rng.integers(2, 7)
        A, limit = rng.normal(size=(m, rng.integers(1, m))), 10.0 ** rng.uniform(-5.0, 5.0, m)
        wrench = (1.0 - 10.0 ** -rng.uniform(6.0, 9.0)) * A.T @ (limit * np.sign(A @ rng.normal(size=A.shape[1])))
        with contextlib.suppress(ValueError):
            c, reached = rk.allocate_torques(A, wrench, limit), reached + 1
            assert np.all(np.abs(c) <= limit)
            assert_allclose(A.T @ c, wrench, rtol=0, atol=1e-9 * np.abs(A * limit[:, None]).max())
    assert reached > 150


def test_no_torques_within_limits_are_nearer_to_the_prestress():
    """Of a convex set c is nearest to c0 where no other y has (c - c0)^T y less; a linear programme seeks that y.

    With SciPy 1.15, whose non-negative least squares stop too soon, many were refused and a few wrong.
    """
    rng = np.random.default_rng(1)
    for _ in range(50):
        m = rng.integers(2, 9)
        A, limit = rng.normal(size=(m, rng.integers(1, m))), 10.0 ** rng.uniform(-1.0, 1.0, m)
        wrench = (1.0 - 10.0 ** -rng.uniform(0.3, 3.0)) * A.T @ (limit * np.sign(A @ rng.normal(size=A.shape[1])))
        c0 = 3.0 * limit * rng.normal(size=m)
        c = rk.allocate_torques(A, wrench, limit, prestress=c0)
        assert np.all(np.abs(c) <= limit)
        assert_allclose(A.T @ c, wrench, rtol=0, atol=1e-11 * limit.max())
        best = linprog(c - c0, A_eq=A.T, b_eq=wrench, bounds=np.stack([-limit, limit], axis=-1))
        assert (c - c0) @ c - best.fun <= 1e-6 * np.abs(c - c0) @ limit


def test_least_squares_that_find_no_end_cost_a_sentence_or_a_rounding(monkeypatch):
    """SciPy 1.14 has an error of its own near corners of the force polygon, where no torques are left to choose."""

    def endless(*_):
        raise RuntimeError("Maximum number of iterations reached.")

    monkeypatch.setattr("scipy.optimize.nnls", endless)
    A = np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])
    assert_allclose(rk.allocate_torques(A, (1.0 - 1e-8) * A.T @ np.ones(3), 1.0), np.ones(3), atol=1e-7)
    with pytest.raises(ValueError, match=r"rounding hides the nearest torques; allowed: .*limits that differ less"):
        rk.allocate_torques(A, [1.0, 1.0], 0.6)


def test_numbers_of_poses_that_do_not_fit_are_named():
    robot = rk.load()
    q = rk.inverse_kinematics(robot, [[0.0, 0.0], [0.01, 0.0], [0.02, 0.0]])
    with pytest.raises(ValueError, match=r"leading axes do not fit together: q \(3,\), .*c \(2,\)"):
        rk.endeffector_stiffness(robot, q, 7.0, np.ones((2, 3)))
    with pytest.raises(ValueError, match=r"leading axes do not fit together: q \(3,\), .*K_P \(2,\)"):
        rk.lyapunov_function(robot, q, np.ones((3, 6)), np.ones((3, 6)), np.stack([np.eye(6)] * 2))


def test_a_machine_without_moments_of_inertia_is_refused_for_mujoco():
    with pytest.raises(ValueError, match=r"inertias of arm 1 are 0 and .*; allowed: 1e-14"):
        rk.to_mjcf(rk.load().replace(inertias=0.0, load=0.0))


@pytest.mark.parametrize("letter", ["\x01", "\x00", "\n", "\x7f", "\ud800", "\ufffe"])
def test_a_name_with_letters_that_xml_has_not_is_written_without(letter):
    """XML 1.0 allows no control characters, halves of pairs or non-characters, not even escaped (its section 2.2)."""
    text = rk.to_mjcf(rk.load().replace(name=f"my{letter}rig"))
    assert ElementTree.fromstring(text.encode("utf-8")).get("model") == "my rig"


def test_stiffness_of_a_path_is_that_of_its_poses():
    path = rk.circle(FRICTIONLESS, 0.05, 1.0, dt=0.1)
    c = np.random.default_rng(2).normal(size=(len(path), 3))
    rows = [rk.endeffector_stiffness(FRICTIONLESS, *pose, 7.05, c_k) for *pose, c_k in zip(path.q, c, strict=True)]
    assert_allclose(rk.endeffector_stiffness(FRICTIONLESS, path.q, 7.05, c), rows, rtol=1e-12, atol=1e-9)


@pytest.mark.parametrize("power", [7, 8, 9, 10, 11])
def test_torques_within_limits_make_their_force_close_to_an_input_singularity(power):
    """In any coordinates of the force, A = U S V^T: c = U U^T c0 + t n, and |c_i| <= limit leaves an interval of t."""
    rng, used = np.random.default_rng(power), 0
    while used < 20:
        U, V = (np.linalg.qr(rng.normal(size=(k, 2)))[0] for k in (3, 2))
        inside = rng.uniform(-1, 1, 3)
        A = U * [1.0, 10.0**-power] @ V.T
        limit = np.abs(inside).max() * 1.05
        if np.abs(U @ (U.T @ inside)).max() < 1.02 * limit:
            continue
        c = rk.allocate_torques(A, A.T @ inside, limit)
        assert np.abs(c).max() <= limit
        assert_allclose(A.T @ c, A.T @ inside, rtol=0, atol=1e-12)
        assert_allclose(c @ U[:, 0], inside @ U[:, 0], rtol=0, atol=1e-12)
        used += 1


def test_torques_on_the_limit_are_the_only_ones_that_as_many_drives_as_forces_have():
    """A square A leaves no choice, c = A^-T f; limits that rounding puts below it are those torques."""
    two = rk.control_matrix(MACHINES["five_bar"], rk.inverse_kinematics(MACHINES["five_bar"], [0.02, 0.05]))
    for A, force in ((two, [1.0, 2.0]), (np.eye(2), [0.0, 1.0]), (np.eye(3), [0.3, -1.0, 0.2])):
        c = np.linalg.solve(A.T, force)
        for limit in (np.abs(c) + 1e-3, np.maximum((1.0 - 1e-13) * np.abs(c), 1e-3)):
            assert_allclose(rk.allocate_torques(A, force, limit), c, rtol=1e-12, atol=1e-15)
            assert np.all(np.abs(rk.allocate_torques(A, force, limit, prestress=np.ones(len(A)))) <= limit)
