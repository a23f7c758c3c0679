"""Motion equations: identities, three formulations against each other, energy, symmetry, reactions."""

import itertools

import numpy as np
import pytest
from numpy.testing import assert_allclose
from samples import FRICTIONLESS, MACHINES, TESTBED, along, machines, modes, norm, random_motion, random_points
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import rapkm_lite as rk

T = lambda M: np.swapaxes(M, -1, -2)  # noqa: E731
PAIRS = list(itertools.combinations(range(6), 2))


def regular(robot, q, pair, limit=0.05):
    """Where J1 of the pair is well away from singular: smallest over largest singular value of J."""
    J = rk.constraint_jacobian(robot, q)
    J1 = np.delete(J, pair, axis=-1)
    return np.linalg.svd(J1, compute_uv=False)[:, -1] > limit * np.linalg.svd(J, compute_uv=False)[:, 0]


# Identities on 1000 poses in each of the eight working modes.
@modes
def test_complement_and_projector_identities(mode):
    q, qd, _, _ = random_motion(TESTBED, 1000, mode)
    J, N = rk.constraint_jacobian(TESTBED, q), rk.nullspace_projector(TESTBED, q)
    assert norm(J @ N).max() < 1e-15
    assert norm(N @ N - N).max() < 5e-15
    assert norm(N - T(N)).max() < 1e-16
    assert_allclose(np.trace(N, axis1=-2, axis2=-1), 2, atol=1e-13)
    assert_allclose(np.einsum("kij,kj->ki", N, qd), qd, atol=1e-13 * np.abs(qd).max())
    for pair in PAIRS:
        k = regular(TESTBED, q, pair)
        F = rk.orthogonal_complement(TESTBED, q[k], pair)
        assert k.sum() > 100
        assert (norm(J[k] @ F) / norm(F)).max() < 1e-15
        assert_allclose(np.einsum("kij,kj->ki", F, qd[k][:, pair]), qd[k], atol=1e-11 * np.abs(qd).max())
        # The same tangent space, whatever the coordinates: the projector built from F is N_J.
        assert norm(F @ np.linalg.solve(T(F) @ F, T(F)) - N[k]).max() < 1e-11


@modes
def test_rates_of_complement_and_projector_against_finite_differences(mode):
    q, qd, _, (x, xd, _) = random_motion(TESTBED, 1000, mode, bend=0.2)
    pose = lambda p: rk.inverse_kinematics(TESTBED, p, mode)  # noqa: E731
    fd = along(lambda p: rk.nullspace_projector(TESTBED, pose(p)), x, xd, 5e-5)
    N_dot = rk.nullspace_projector_dot(TESTBED, q, qd)
    assert (norm(N_dot - fd) / np.maximum(norm(N_dot), 1)).max() < 1e-7
    for pair in [(0, 1), (0, 2), (1, 2), (2, 4), (4, 3)]:
        k = regular(TESTBED, q, pair, 0.1)
        fd = along(lambda p, pair=pair: rk.orthogonal_complement(TESTBED, pose(p), pair), x[k], xd[k], 5e-5)
        F_dot = rk.orthogonal_complement_dot(TESTBED, q[k], qd[k], pair)
        assert (norm(F_dot - fd) / np.maximum(norm(F_dot), 1)).max() < 1e-7


# (2), (5) and (23): the same accelerations and the same control forces.
def accelerations(robot, q, qd, c, independent=None):
    """qdd from the minimal equations (5)."""
    F, F_dot = rk.orthogonal_complement(robot, q, independent), rk.orthogonal_complement_dot(robot, q, qd, independent)
    G, C, Q = rk.minimal_dynamics(robot, q, qd, independent)
    rate = qd[..., independent] if independent else np.einsum("kij,kj->ki", np.linalg.pinv(F), qd)
    force = np.einsum("kji,kj->ki", rk.control_matrix(robot, q, independent), c) - Q
    acceleration = np.linalg.solve(G, (force - np.einsum("kij,kj->ki", C, rate))[..., None])[..., 0]
    return np.einsum("kij,kj->ki", F, acceleration) + np.einsum("kij,kj->ki", F_dot, rate)


def worst(actual, wanted):
    return (norm(actual - wanted) / norm(wanted)).max()


@modes
def test_minimal_redundant_and_multiplier_form_agree(mode):
    for robot in (TESTBED, MACHINES["asymmetric"]):
        q, qd, _, _ = random_motion(robot, 1000, mode)
        c = np.random.default_rng(5).normal(0, 0.1, (1000, 3))
        qdd, reaction = rk.forward_dynamics(robot, q, qd, c)
        assert worst(accelerations(robot, q, qd, c), qdd) < 1e-10
        for pair in ([0, 1], [0, 2], [1, 2], [3, 5]):
            k = regular(robot, q, pair)
            assert worst(accelerations(robot, q[k], qd[k], c[k], pair), qdd[k]) < 1e-10
        # (23): G~ is singular by construction; its residual on the scale of its terms.
        G, C, Q = rk.redundant_dynamics(robot, q, qd)
        terms = [
            np.einsum("kij,kj->ki", G, qdd),
            np.einsum("kij,kj->ki", C, qd),
            Q,
            -np.einsum("kji,kj->ki", rk.redundant_control_matrix(robot, q), c),
        ]
        assert (norm(sum(terms)) / sum(map(norm, terms))).max() < 1e-10
        # (2) itself, and the constraints on acceleration level.
        J, J_dot = rk.constraint_jacobian(robot, q), rk.constraint_jacobian_dot(robot, q, qd)
        u = np.concatenate([c, 0 * c], axis=-1)
        left = [
            np.einsum("kij,kj->ki", rk.mass_matrix(robot, q), qdd),
            np.einsum("kij,kj->ki", rk.coriolis_matrix(robot, q, qd), qd),
            rk.generalized_forces(robot, q, qd),
            np.einsum("kji,kj->ki", J, reaction),
            -u,
        ]
        assert (norm(sum(left)) / sum(map(norm, left))).max() < 1e-12
        closed = [np.einsum("kij,kj->ki", J, qdd), np.einsum("kij,kj->ki", J_dot, qd)]
        assert (norm(sum(closed)) / sum(map(norm, closed))).max() < 1e-11


# Lagrange structure.
@machines
def test_coriolis_matrix_has_the_skew_property_and_the_right_quadratic_terms(robot):
    rng = np.random.default_rng(6)
    q, qd = rng.uniform(-3, 3, (2, 100, robot.n_joints))
    C = rk.coriolis_matrix(robot, q, qd)
    G_dot = along(lambda p: rk.mass_matrix(robot, p), q, qd, 1e-3)
    S = G_dot - 2 * C
    # A difference quotient is right to the rounding of what it takes differences of, over the step: its weights add to
    # two, and S + S^T has it twice.
    rounding = np.finfo(float).eps / 1e-3
    assert norm(S + T(S)).max() < 4 * rounding * norm(rk.mass_matrix(robot, q)).max()
    # d/dt dT/dqd - dT/dq = G qdd + C qd: the quadratic terms are Gdot qd - dT/dq.
    axes = np.eye(robot.n_joints)
    gradient = np.stack([along(lambda p: rk.kinetic_energy(robot, p, qd), q, e, 1e-3) for e in axes], axis=-1)
    atol = 2 * rounding * rk.kinetic_energy(robot, q, qd).max()
    assert_allclose(np.einsum("kij,kj->ki", C, qd), np.einsum("kij,kj->ki", G_dot, qd) - gradient, atol=atol)
    assert np.linalg.eigvalsh(rk.mass_matrix(robot, q)).min() > 0


@machines
def test_skew_property_survives_the_projection(robot):
    q, qd, _, (x, xd, _) = random_motion(robot, 100, bend=0.2)
    xd = xd / 10
    qd = qd / 10
    _, C, _ = rk.redundant_dynamics(robot, q, qd)
    pose = lambda p: rk.inverse_kinematics(robot, p)  # noqa: E731
    G_dot = along(lambda p: rk.redundant_dynamics(robot, pose(p), qd)[0], x, xd, 1e-4)
    S = np.einsum("ki,kij,kj->k", qd, G_dot - 2 * C, qd)
    assert np.abs(S / np.einsum("ki,kij,kj->k", qd, np.abs(G_dot), qd).clip(1e-6)).max() < 1e-6


@machines
def test_generalized_forces_are_the_gradient_of_the_potential(robot):
    robot = robot.replace(gravity=[1.3, -9.81], load=0.3, friction=0.0)
    q = np.random.default_rng(7).uniform(-3, 3, (100, robot.n_joints))
    axes = np.eye(robot.n_joints)
    gradient = np.stack([along(lambda p: rk.potential_energy(robot, p), q, e, 1e-2) for e in axes], axis=-1)
    assert_allclose(rk.generalized_forces(robot, q, 0 * q), gradient, atol=1e-12)


def test_forces_vanish_in_the_plane_without_friction_and_friction_opposes_motion():
    q, qd, _, _ = random_motion(TESTBED, 50)
    assert np.all(rk.generalized_forces(FRICTIONLESS, q, qd) == 0)
    Q = rk.generalized_forces(TESTBED, q, qd)
    assert_allclose(Q[:, :3], 4.2e-3 * np.tanh(qd[:, :3] / 0.01), rtol=1e-14)
    assert np.all(Q[:, 3:] == 0)


def test_a_load_is_a_point_mass_wherever_the_tree_carries_it():
    # Kinetic and potential energy of the load do not depend on the arm of the cut tree that carries it.
    load, g = 0.3, np.array([0.7, -9.81])
    bare = FRICTIONLESS.replace(gravity=g)
    q, qd, _, (x, xd, _) = random_motion(bare, 50)
    loaded = bare.replace(load=load)
    extra = rk.kinetic_energy(loaded, q, qd) - rk.kinetic_energy(bare, q, qd)
    assert_allclose(extra, load * (xd**2).sum(-1) / 2, rtol=1e-11)
    height = rk.potential_energy(loaded, q) - rk.potential_energy(bare, q)
    assert_allclose(height, -load * (x - bare.base[1]) @ g, atol=1e-13)


def test_masses_of_a_single_moving_arm_by_hand():
    # Base joint 1 turns alone with the elbow straight: a rod of length 0.4 about its end, and the rotor.
    m, length, rotor = 0.134, 0.2, 3.35e-6
    qd = np.array([2.0, 0, 0, 0, 0, 0])
    by_hand = ((2 * m) * (2 * length) ** 2 / 3 + rotor) * 2.0**2 / 2
    assert_allclose(rk.kinetic_energy(TESTBED, np.zeros(6), qd), by_hand, rtol=1e-14)


# Energy.
def swing(robot, duration, torque):
    """x, xd and the work done, integrated by DOP853 from a moving start near the centroid."""

    def rate(t, state):
        x, xd = state[:2], state[2:4]
        q = rk.inverse_kinematics(robot, x)
        F = rk.orthogonal_complement(robot, q)
        qd = F @ xd
        qdd, _ = rk.forward_dynamics(robot, q, qd, torque(t))
        xdd = np.linalg.pinv(F) @ (qdd - rk.orthogonal_complement_dot(robot, q, qd) @ xd)
        loss = rk.generalized_forces(robot, q, qd)[: robot.n_arms] @ qd[: robot.n_arms] if robot.friction.any() else 0.0
        return np.concatenate([xd, xdd, [torque(t) @ qd[: robot.n_arms] - loss]])

    start = np.array([0.02, -0.03, 0.15, 0.1, 0.0])
    return solve_ivp(rate, (0, duration), start, method="DOP853", rtol=1e-11, atol=1e-13).y


def energy(robot, state):
    q = rk.inverse_kinematics(robot, state[:2])
    return rk.kinetic_energy(robot, q, rk.orthogonal_complement(robot, q) @ state[2:4]) + rk.potential_energy(robot, q)


@pytest.mark.parametrize("name", ["testbed", "asymmetric"])
def test_energy_is_conserved_without_drives(name):
    robot = MACHINES[name].replace(friction=0.0, gravity=[0.3, -0.5])
    states = swing(robot, 0.4, lambda t: np.zeros(3))
    levels = [energy(robot, state) for state in states.T]
    scale = max(abs(rk.kinetic_energy(robot, *still(robot, s))) for s in states.T)
    assert np.ptp(levels) < 1e-9 * scale


def still(robot, state):
    q = rk.inverse_kinematics(robot, state[:2])
    return q, rk.orthogonal_complement(robot, q) @ state[2:4]


def test_power_of_the_drives_and_of_friction_balances_the_energy():
    wave = lambda t: 0.02 * np.array([np.sin(9 * t), np.cos(7 * t), np.sin(5 * t + 1)])  # noqa: E731
    states = swing(TESTBED.replace(friction_velocity=0.5), 0.4, wave)
    gained = energy(TESTBED, states[:, -1]) - energy(TESTBED, states[:, 0])
    assert abs(states[4, -1]) > 1e-4
    assert_allclose(gained, states[4, -1], rtol=1e-8)


# Symmetry.
def test_turning_state_and_drives_by_a_third_turns_the_acceleration():
    q, qd, _, _ = random_motion(FRICTIONLESS, 100)
    c = np.random.default_rng(8).normal(0, 0.1, (100, 3))
    order = [2, 0, 1, 5, 3, 4]  # arm i takes the place of arm i + 1
    turned = q[:, order] + 2 * np.pi / 3 * np.array([1, 1, 1, 0, 0, 0])
    assert np.abs(rk.loop_constraints(FRICTIONLESS, turned)).max() < 1e-14
    qdd, _ = rk.forward_dynamics(FRICTIONLESS, q, qd, c)
    assert worst(rk.forward_dynamics(FRICTIONLESS, turned, qd[:, order], c[:, order[:3]])[0], qdd[:, order]) < 1e-10


# Multipliers.
def test_multipliers_are_the_reactions_in_the_cut_joint():
    # Newton's law for arm 1 alone, cut free at the end-effector: -lambda_1 must produce its motion.
    robot = FRICTIONLESS.replace(load=0.5, gravity=[0, -9.81])
    q, qd, _, _ = random_motion(robot, 50)
    c = np.random.default_rng(9).normal(0, 0.2, (50, 3))
    qdd, reaction = rk.forward_dynamics(robot, q, qd, c)
    l, m, I = 0.2, 0.134, 0.134 * 0.2**2 / 12  # noqa: E741
    base, link = q[:, 0], q[:, 0] + q[:, 3]
    rate, rate_l, acc, acc_l = qd[:, 0], qd[:, 0] + qd[:, 3], qdd[:, 0], qdd[:, 0] + qdd[:, 3]
    u = lambda angle: np.stack([np.cos(angle), np.sin(angle)], axis=-1)  # noqa: E731
    n = lambda angle: np.stack([-np.sin(angle), np.cos(angle)], axis=-1)  # noqa: E731
    elbow = l * (acc[:, None] * n(base) - rate[:, None] ** 2 * u(base))
    centre = elbow + l / 2 * (acc_l[:, None] * n(link) - rate_l[:, None] ** 2 * u(link))
    tip_force = -reaction[:, :2]
    elbow_force = m * centre - tip_force - m * robot.gravity  # on the distal link, by Newton
    cross = lambda a, b: a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]  # noqa: E731
    arm = l / 2 * u(link)
    assert_allclose(cross(arm, tip_force) + cross(-arm, elbow_force), I * acc_l, atol=1e-12)  # by Euler


def test_static_load_is_carried_by_the_reactions():
    # At rest in balance: the tips of arms 1 and 3 pull with -lambda, arm 2 carries the load; torques from (11).
    robot = FRICTIONLESS.replace(load=1.0, gravity=[0, -9.81])
    q = rk.inverse_kinematics(robot, random_points(robot, 20))
    c = rk.inverse_dynamics(robot, q, 0 * q, 0 * q)
    qdd, _ = rk.forward_dynamics(robot, q, 0 * q, c)
    assert norm(qdd).max() < 1e-9


# Bad choices are named.
def test_singular_choice_names_pair_and_measure():
    # Both distal links of arms 2 and 3 parallel: the pair (2, 3) loses its meaning, here 0-based (1, 2).
    robot = TESTBED
    x, y, cross = rk.actuation_map(robot, "cross", pair=(1, 2), n=50)
    i, j = np.unravel_index(np.argmin(cross), cross.shape)
    near = np.array([x[j], y[i]])
    measure = lambda t: rk.distal_cross_products(robot, rk.inverse_kinematics(robot, near + [t, 0]))[2]  # noqa: E731
    q = rk.inverse_kinematics(robot, near + [brentq(measure, -0.02, 0.02, xtol=1e-16), 0])
    with pytest.raises(ValueError, match=r"independent = \(1, 2\) is singular here: its measure .*1e-12"):
        rk.orthogonal_complement(robot, q, (1, 2))
    assert np.all(np.isfinite(rk.minimal_dynamics(robot, q, 0 * q, (0, 1))[0]))


# Leading axes.
def test_one_pose_and_a_trajectory_are_the_same_call():
    for robot in (TESTBED, MACHINES["asymmetric"], MACHINES["four_arms"]):
        q, qd, _, _ = random_motion(robot, 12)
        c = np.random.default_rng(0).normal(0, 0.1, (12, robot.n_arms))
        pair = lambda f: lambda *v: f(*v, (0, 2))  # noqa: E731
        calls = [
            (rk.mass_matrix, q),
            (rk.coriolis_matrix, q, qd),
            (rk.generalized_forces, q, qd),
            (rk.orthogonal_complement, q),
            (pair(rk.orthogonal_complement), q),
            (rk.nullspace_projector, q),
            (rk.orthogonal_complement_dot, q, qd),
            (pair(rk.orthogonal_complement_dot), q, qd),
            (rk.nullspace_projector_dot, q, qd),
            (rk.kinetic_energy, q, qd),
            (rk.potential_energy, q),
            *[(lambda *a, i=i: rk.minimal_dynamics(*a)[i], q, qd) for i in range(3)],
            *[(lambda *a, i=i: rk.minimal_dynamics(*a, (0, 2))[i], q, qd) for i in range(3)],
            *[(lambda *a, i=i: rk.redundant_dynamics(*a)[i], q, qd) for i in range(3)],
            *[(lambda *a, i=i: rk.forward_dynamics(*a)[i], q, qd, c) for i in range(2)],
        ]
        for f, *args in calls:
            whole = f(robot, *args)
            scale = np.abs(whole).max()
            single = np.stack([f(robot, *(a[k] for a in args)) for k in range(12)])
            block = f(robot, *(a.reshape(3, 4, -1) for a in args))
            assert_allclose(whole, single, atol=1e-13 * scale, rtol=1e-12)
            assert_allclose(block.reshape(whole.shape), single, atol=1e-13 * scale, rtol=1e-12)
            assert f(robot, *(a[:0] for a in args)).shape == (0, *whole.shape[1:])
            if len(args) > 1:  # one pose, many rates, which keep its loops closed
                args[1] = qd @ rk.nullspace_projector(robot, q[0])
                rates = [a[3] for a in args[1:]]
                fourth = f(robot, q[0], *rates)
                mixed = np.broadcast_to(f(robot, q[0], *args[1:]), whole.shape)  # Gbar and G~ depend on the pose alone
                assert_allclose(mixed[3], fourth, atol=1e-13 * scale, rtol=1e-12)


def test_one_pose_serves_many_rates_in_the_motion_equations():
    """J qdd = -Jdot qd holds for each of the rates, and many poses take one vector of torques."""
    q, qd, _, _ = random_motion(TESTBED, 1)
    rates = np.linspace(-2.0, 2.0, 5)[:, None] * qd[0]
    qdd, reactions = rk.forward_dynamics(TESTBED, q[0], rates, [0.1, -0.2, 0.05])
    for k in range(5):
        alone = rk.forward_dynamics(TESTBED, q[0], rates[k], [0.1, -0.2, 0.05])
        assert_allclose(qdd[k], alone[0], rtol=1e-12, atol=1e-12)
        assert_allclose(reactions[k], alone[1], rtol=1e-12, atol=1e-12)
