"""Control laws: what (12), (16)-(20), (28)-(35) promise, by algebra, linearization, independent integration."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from samples import FRICTIONLESS, MACHINES, TESTBED, machines, norm, random_motion, random_points
from scipy.integrate import solve_ivp

import rapkm_lite as rk
from rapkm_lite.control.grammar import joint_gain
from rapkm_lite.simulation.experiments import Table1

T = lambda M: np.swapaxes(M, -1, -2)  # noqa: E731
mv = lambda M, v: np.einsum("...ij,...j->...i", M, v)  # noqa: E731
ROBOT = MACHINES["asymmetric"].replace(friction=0.0)


def state_and_target(robot, count=60, seed=0):
    """A motion, and a desired one near it, both on V."""
    q, qd, _, (x, xd, _) = random_motion(robot, count, seed=seed, bend=0.3)
    rng = np.random.default_rng(seed + 50)
    x, xd, xdd = x + rng.normal(0, 1e-3, x.shape), xd + rng.normal(0, 1e-2, x.shape), rng.normal(0, 1, x.shape)
    q_d = rk.inverse_kinematics(robot, x)
    F = rk.orthogonal_complement(robot, q_d)
    qd_d = mv(F, xd)
    qdd_d = mv(F, xdd) + mv(rk.orthogonal_complement_dot(robot, q_d, qd_d), xd)
    return q, qd, rk.Desired(robot.n_arms, x, xd, xdd, q_d, qd_d, qdd_d)


def torque(law, robot, q, qd, desired, offset=0.0):
    N = robot.n_arms
    return law.torque(robot, q, qd, q[..., :N] + offset, qd[..., :N], desired)


def part(desired, k):
    return rk.Desired(3, *(v[k] for v in (desired.x, desired.xd, desired.xdd, desired.q, desired.qd, desired.qdd)))


# (12), (16)-(18)
def test_pd_is_decentralized():
    q, qd, desired = state_and_target(TESTBED)
    K_P, K_D = np.array([5.0, 6.0, 7.0]), np.array([0.1, 0.2, 0.3])
    c = torque(rk.PD(K_P, K_D), TESTBED, q, qd, desired)
    assert_allclose(c, -K_P * (q - desired.q)[:, :3] - K_D * (qd - desired.qd)[:, :3], atol=1e-15)
    full = rk.PD(np.diag(K_P), np.diag(K_D))
    assert_allclose(torque(full, TESTBED, q, qd, desired), c, atol=1e-15)


def test_force_filter_removes_antagonism_and_nothing_else():
    q, qd, desired = state_and_target(TESTBED)
    pd, A = rk.PD([5, 6, 7], 0.2), rk.control_matrix(TESTBED, q)
    offset = np.array([0.004, -0.002, 0.005])
    raw = torque(pd, TESTBED, q, qd, desired, offset)
    filtered = torque(rk.AntagonismFilter(pd), TESTBED, q, qd, desired, offset)
    assert_allclose(mv(T(A), filtered), mv(T(A), raw), atol=1e-13)
    assert np.abs(mv(rk.prestress_projector(A), filtered)).max() < 1e-14
    assert np.all((filtered**2).sum(-1) <= (raw**2).sum(-1) + 1e-15)


@pytest.mark.parametrize("W", [[1.0, 4.0, 0.3], np.diag([1.0, 2.0, 3.0]) + 0.5])
def test_a_weighted_filter_leaves_the_torques_of_least_weight_with_the_same_force(W):
    """Lagrange: W c lies in the range of A where c^T W c is least among the torques with one A^T c."""
    q, c = state_and_target(ROBOT)[0], np.array([0.3, -0.2, 0.5])
    A, least = rk.control_matrix(ROBOT, q), rk.AntagonismFilter(rk.PD(7.0, 0.2), W=W).matrix(ROBOT, q) @ c
    assert_allclose(mv(T(A), least - c), 0.0, atol=1e-12 * np.abs(A).max())
    weighted = least @ (np.diag(W) if np.ndim(W) == 1 else W)
    assert_allclose(np.vecdot(weighted, rk.null_basis(A)[..., 0]), 0.0, atol=1e-12)


def test_command_filter_equals_the_force_filter_only_for_equal_gains():
    q, qd, desired = state_and_target(TESTBED)
    A, offset = rk.control_matrix(TESTBED, q), np.array([0.004, -0.002, 0.005])

    def pair(pd):
        return [torque(f(pd), TESTBED, q, qd, desired, offset) for f in (rk.AntagonismFilter, rk.CommandFilter)]

    force, command = pair(rk.PD(7.05, 0.225))
    assert_allclose(force, command, atol=1e-14)
    force, command = pair(rk.PD([4.0, 7.0, 10.0], [0.2, 0.2, 0.3]))
    assert_allclose(mv(T(A), force), mv(T(A), command), atol=1e-13)
    assert np.abs(force - command).max() > 1e-3
    assert np.abs(mv(rk.prestress_projector(A), command)).max() > 1e-3
    # (18): PD drives that get the filtered commands give the torques of (17).
    law = rk.CommandFilter(rk.PD([4.0, 7.0, 10.0], [0.2, 0.2, 0.3]))
    q_a, qd_a = q[:, :3] + offset, qd[:, :3]
    q_c, qd_c = law.commands(TESTBED, q, q_a, qd_a, desired)
    K_P, K_D = law.law.gains(3)
    assert_allclose(-mv(K_P, q_a - q_c) - mv(K_D, qd_a - qd_c), command, atol=1e-15)


def test_energy_saved_by_the_filter_is_that_of_the_null_torque():
    # Fact 6: Pythagoras in the torques, total over identical drives.
    q, qd, desired = state_and_target(TESTBED)
    pd, offset = rk.PD(7.05, 0.225), np.array([0.004, -0.002, 0.005])
    raw, filtered = (torque(law, TESTBED, q, qd, desired, offset) for law in (pd, rk.AntagonismFilter(pd)))
    null = mv(rk.prestress_projector(rk.control_matrix(TESTBED, q)), raw)
    saved = rk.copper_loss(TESTBED, raw, 1e-3).sum() - rk.copper_loss(TESTBED, filtered, 1e-3).sum()
    assert_allclose(saved, 0.611 / 0.0259**2 * (null**2).sum() * 1e-3, rtol=1e-12)
    assert_allclose(saved, rk.copper_loss(TESTBED, null, 1e-3).sum(), rtol=1e-12)


# (19)-(20), (28), (32): perfect tracking without errors.
LAWS = {
    "APD": rk.APD(50.0, 5.0),
    "APD in x": rk.APD(50.0, 5.0, None),
    "CTC": rk.CTC(400.0, 40.0, (0, 2)),
    "CTC in x": rk.CTC(400.0, 40.0, None, W=[1.0, 2.0, 3.0]),
    "CTC, elbows": rk.CTC(400.0, 40.0, (3, 5)),
    "switched": rk.SwitchedCTC(400.0, 40.0),
    "redundant APD": rk.RedundantAPD(50.0, 5.0),
    "redundant CTC": rk.RedundantCTC(400.0, 40.0),
    "line 2": rk.RedundantCTC(400.0, 40.0, projected=False),
    "line 2 of APD": rk.RedundantAPD(50.0, 5.0, projected=False),
    "printed rule": rk.RedundantCTC(400.0, 40.0, rule="printed"),
}


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_model_based_laws_follow_exactly_without_error(law):
    for robot in (ROBOT, MACHINES["four_arms"].replace(gravity=[0.5, -1.0], load=0.1)):
        if getattr(law, "W", None) is None or robot is ROBOT:
            follows_exactly(law, robot)


def follows_exactly(law, robot):
    q, qd, qdd, (x, xd, xdd) = random_motion(robot, 60, bend=0.3)
    elbows = np.linalg.svd(np.delete(rk.constraint_jacobian(robot, q), [3, 5], axis=-1), compute_uv=False)[:, -1]
    ok = (np.abs(rk.distal_cross_products(robot, q)).min(axis=-1) > 0.05) & (elbows > 0.02)
    assert ok.sum() > 20
    q, qd, qdd, x, xd, xdd = (v[ok] for v in (q, qd, qdd, x, xd, xdd))
    desired = rk.Desired(robot.n_arms, x, xd, xdd, q, qd, qdd)
    again, _ = rk.forward_dynamics(robot, q, qd, torque(law, robot, q, qd, desired))
    assert (norm(again - qdd) / norm(qdd)).max() < 1e-9


@pytest.mark.parametrize("name", LAWS)
def test_measured_rates_make_the_feedback_alone(name):
    """(19), (20), (28), (32): velocity terms take rates on V; what other rates of the drives add goes with K_D."""
    (q, qd, desired), law, wrong = state_and_target(ROBOT, 20), LAWS[name], np.array([3.0, -2.0, 4.0])
    added = []
    for times in (1.0, 2.0):
        one = dataclasses.replace(law, K_D=times * law.K_D)
        off, right = (one.torque(ROBOT, q, qd, q[:, :3], qd[:, :3] + rates, desired) for rates in (wrong, 0.0))
        added.append(off - right)
    assert_allclose(added[1], 2.0 * added[0], rtol=0, atol=1e-10 * np.abs(right).max())
    assert np.any(added[0]) == (name not in ("APD in x", "CTC in x", "CTC, elbows"))


@pytest.mark.parametrize("pair", [(0, 1), (1, 2), None])
def test_ctc_makes_the_error_of_its_coordinates_linear(pair):
    q, qd, desired = state_and_target(ROBOT)
    if pair is not None:
        k = np.abs(rk.distal_cross_products(ROBOT, q))[:, [(0, 1), (0, 2), (1, 2)].index(pair)] > 0.05
        q, qd, desired = q[k], qd[k], part(desired, k)
    qdd, _ = rk.forward_dynamics(ROBOT, q, qd, torque(rk.CTC([300.0, 500.0], 30.0, pair), ROBOT, q, qd, desired))
    if pair is None:
        F_dot = rk.orthogonal_complement_dot(ROBOT, q, qd)
        back = np.linalg.pinv(rk.orthogonal_complement(ROBOT, q))
        xd = mv(back, qd)
        e, ed = rk.forward_kinematics(ROBOT, q) - desired.x, xd - desired.xd
        edd = mv(back, qdd - mv(F_dot, xd)) - desired.xdd
    else:
        j = list(pair)
        e, ed, edd = (q - desired.q)[:, j], (qd - desired.qd)[:, j], (qdd - desired.qdd)[:, j]
    assert_allclose(edd + 30 * ed + np.array([300.0, 500.0]) * e, 0, atol=1e-8 * np.abs(qdd).max())


@pytest.mark.parametrize("pair", [(0, 1), None])
def test_closed_loop_of_the_apd(pair):
    # Gbar e2dd + (Cbar + K_D) e2d + K_P e2 = 0 follows from (5) and (19).
    q, qd, desired = state_and_target(ROBOT)
    k = np.abs(rk.distal_cross_products(ROBOT, q))[:, 0] > 0.05
    q, qd, desired = q[k], qd[k], part(desired, k)
    K_P, K_D = np.array([30.0, 50.0]), np.array([3.0, 4.0])
    qdd, _ = rk.forward_dynamics(ROBOT, q, qd, torque(rk.APD(K_P, K_D, pair), ROBOT, q, qd, desired))
    G, C, _ = rk.minimal_dynamics(ROBOT, q, qd, pair)
    if pair is None:
        back = np.linalg.pinv(rk.orthogonal_complement(ROBOT, q))
        xd = mv(back, qd)
        e, ed = rk.forward_kinematics(ROBOT, q) - desired.x, xd - desired.xd
        edd = mv(back, qdd - mv(rk.orthogonal_complement_dot(ROBOT, q, qd), xd)) - desired.xdd
    else:
        e, ed, edd = ((a - b)[:, list(pair)] for a, b in ((q, desired.q), (qd, desired.qd), (qdd, desired.qdd)))
    terms = [mv(G, edd), mv(C, ed), K_D * ed, K_P * e]
    assert (norm(sum(terms)) / sum(map(norm, terms))).max() < 1e-10


@pytest.mark.parametrize(
    "law",
    [
        rk.APD([7.0, 8.0], [0.2, 0.3], [0, 1], [1.0, 2.0, 3.0]),
        rk.CTC([400.0, 300.0], [40.0, 30.0], np.array([0, 1]), [1.0, 2.0, 3.0]),
        rk.SwitchedCTC([400.0, 300.0], [40.0, 30.0], np.array(1.5)),
        rk.RedundantCTC([400.0] * 3, [40.0] * 3, projected=np.False_),
    ],
    ids=lambda law: type(law).__name__,
)
def test_what_a_law_is_given_as_a_list_it_keeps_as_an_array_that_nobody_writes_into(law):
    kept = [getattr(law, name) for name in ("K_P", "K_D", "W") if getattr(law, name, None) is not None]
    assert all(isinstance(K, np.ndarray) and not K.flags.writeable for K in kept) and len(kept) >= 2
    assert getattr(law, "independent", (0, 1)) == (0, 1)
    assert type(getattr(law, "hysteresis", 1.5)) is float and type(getattr(law, "projected", False)) is bool


# Switching.
def test_switching_takes_the_best_pair_and_hysteresis_saves_switches():
    path = rk.triangle(FRICTIONLESS)
    free = rk.SwitchedCTC(400, 40, hysteresis=1.0).pairs(FRICTIONLESS, path.q)
    best = np.abs(rk.distal_cross_products(FRICTIONLESS, path.q)).argmax(axis=-1)
    assert np.mean(np.array(rk.drive_pairs(FRICTIONLESS))[best] == free) > 0.999  # ties aside
    count = lambda p: np.count_nonzero(np.any(np.diff(p, axis=0) != 0, axis=-1))  # noqa: E731
    counts = [count(rk.SwitchedCTC(400, 40, hysteresis=h).pairs(FRICTIONLESS, path.q)) for h in (1.0, 1.2, 1.5, 3.0)]
    assert counts == sorted(counts, reverse=True) and counts[-1] >= 2
    # The map says the same as the law, off the borders.
    x, y, chosen = rk.switching_map(FRICTIONLESS, n=200)
    i, j = np.rint((path.x[:, 1] - y[0]) / (y[1] - y[0])).astype(int), np.rint((path.x[:, 0] - x[0]) / (x[1] - x[0]))
    assert np.mean(chosen[i, j.astype(int)] == best) > 0.98


def test_pairs_along_a_path_are_those_chosen_one_by_one_given_the_last_in_either_order():
    law, q, now, kept = rk.SwitchedCTC(400, 40, hysteresis=1.5), rk.triangle(FRICTIONLESS, dt=2e-2).q, None, 0
    for pose, pair in zip(q, law.pairs(FRICTIONLESS, q), strict=True):
        now = law.choose(FRICTIONLESS, pose, None if now is None else now[::-1])
        assert now == tuple(pair)
        kept += now != law.choose(FRICTIONLESS, pose)
    assert kept > 10


def test_rounding_takes_no_pair_from_an_equal_one():
    """In the centre of a machine of threefold symmetry all pairs are equal; how it is turned decides the rounding."""
    law, pairs = rk.SwitchedCTC(400, 40, hysteresis=1.0), [(0, 1), (0, 2), (1, 2)]
    for angle in np.linspace(0.1, 3.0, 30):
        turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        robot = FRICTIONLESS.replace(base=FRICTIONLESS.base @ turn)
        q = rk.inverse_kinematics(robot, [0.0, 0.0])
        assert [law.choose(robot, q, pair) for pair in pairs] == pairs
        assert law.choose(robot, q) == (0, 1)


@pytest.mark.parametrize("hysteresis", [1.0, 1.3, 2.0])
def test_switching_waits_for_the_factor_of_its_hysteresis(hysteresis):
    path = rk.triangle(FRICTIONLESS)
    chosen = rk.SwitchedCTC(400, 40, hysteresis).pairs(FRICTIONLESS, path.q)
    measure = np.abs(rk.distal_cross_products(FRICTIONLESS, path.q))
    index = np.array([rk.drive_pairs(FRICTIONLESS).index(tuple(p)) for p in chosen.tolist()])
    k = np.arange(1, len(path))
    held = measure[k, index[:-1]]  # what the pair in use before this sample is worth now
    switched = index[1:] != index[:-1]
    assert switched.sum() >= 2
    assert np.all(measure[k].max(axis=-1)[switched] > hysteresis * held[switched])
    assert np.all(measure[k].max(axis=-1)[~switched] <= hysteresis * held[~switched])


def test_switched_torques_along_a_path_are_those_of_the_pair_in_use():
    path, law, offset = rk.triangle(FRICTIONLESS, dt=5e-3), rk.SwitchedCTC(400, 40), np.array([4e-3, -2e-3, 5e-3])
    q = path.q + 1e-4
    c = torque(law, FRICTIONLESS, q, path.qd, path, offset)
    for k in range(0, len(path), 50):
        pair = law.pairs(FRICTIONLESS, q[: k + 1])[-1]
        assert_allclose(c[k], torque(law.fixed(pair), FRICTIONLESS, q[k], path.qd[k], path[k], offset), atol=1e-14)
    assert_allclose(torque(law, FRICTIONLESS, q[0], path.qd[0], path[0], offset), c[0], atol=1e-14)
    for pose in ("measured", "true"):
        assert rk.SwitchedCTC(400, 40, pose=pose).fixed((0, 2)) == rk.CTC(400, 40, (0, 2), pose=pose)


def test_a_switched_torque_at_one_pose_is_that_of_its_best_pair():
    path, law, used = rk.triangle(FRICTIONLESS, dt=5e-3), rk.SwitchedCTC(400, 40), set()
    for k in range(0, len(path), 50):
        q, measure = path.q[k] + 1e-4, np.abs(rk.distal_cross_products(FRICTIONLESS, path.q[k] + 1e-4))
        used.add(pair := rk.drive_pairs(FRICTIONLESS)[measure.argmax()])
        own = torque(rk.CTC(400, 40, pair), FRICTIONLESS, q, path.qd[k], path[k])
        assert_allclose(torque(law, FRICTIONLESS, q, path.qd[k], path[k]), own, rtol=0, atol=1e-14)
    assert len(used) == 3


def test_fixed_pair_feedback_grows_at_its_singularity_and_the_redundant_one_does_not():
    # Fact 7: A (A^T A)^-1 Gbar grows like 1 / |d_2 x d_3| for the pair (2, 3); feed-forward torques agree to rounding.
    angle = np.linspace(0, 2 * np.pi, 4000)
    q = rk.inverse_kinematics(FRICTIONLESS, 0.11 * np.stack([np.cos(angle), np.sin(angle)], axis=-1))
    cross = np.abs(rk.distal_cross_products(FRICTIONLESS, q))[:, 2]
    k = np.argsort(cross)[:40]
    A, G = rk.control_matrix(FRICTIONLESS, q[k], (1, 2)), rk.minimal_dynamics(FRICTIONLESS, q[k], 0 * q[k], (1, 2))[0]
    fixed = np.linalg.norm(rk.weighted_pseudoinverse(A) @ G, axis=(-2, -1))
    slope = np.polyfit(np.log(cross[k]), np.log(fixed), 1)[0]
    assert_allclose(slope, -1, atol=0.05)
    A_tilde, Gt = rk.redundant_control_matrix(FRICTIONLESS, q), rk.redundant_dynamics(FRICTIONLESS, q, 0 * q)[0]
    pinv = rk.explicit_pseudoinverse(A_tilde, rk.select_independent(A_tilde))
    redundant = np.linalg.norm(pinv @ Gt, axis=(-2, -1))
    assert redundant.max() < 2 * np.median(redundant) < 0.1 * fixed.max()
    away = q[np.argsort(cross)[-50:]]
    none, ones = np.zeros((50, 2)), np.ones((50, 2))
    still = rk.Desired(
        3,
        rk.forward_kinematics(FRICTIONLESS, away),
        none,
        ones,
        away,
        0 * away,
        mv(rk.orthogonal_complement(FRICTIONLESS, away), ones),
    )
    one = torque(rk.CTC(400, 40, (1, 2)), FRICTIONLESS, away, 0 * away, still)
    two = torque(rk.RedundantCTC(400, 40), FRICTIONLESS, away, 0 * away, still)
    assert_allclose(one, two, atol=1e-12 * np.abs(one).max())


# (29)-(31): the redundant APD law.
def test_closed_loop_of_the_redundant_apd():
    q, qd, desired = state_and_target(ROBOT)
    law = rk.RedundantAPD(60.0, 6.0)
    qdd, _ = rk.forward_dynamics(ROBOT, q, qd, torque(law, ROBOT, q, qd, desired))
    G, C, _ = rk.redundant_dynamics(ROBOT, q, qd)
    D = rk.closed_loop_projector(rk.redundant_control_matrix(ROBOT, q))
    e, ed, edd = q - desired.q, qd - desired.qd, qdd - desired.qdd
    terms = [mv(G, edd), mv(C, ed), 6 * mv(D, ed), 60 * mv(D, e)]
    assert (norm(sum(terms)) / sum(map(norm, terms))).max() < 1e-11


@pytest.mark.parametrize("name", MACHINES)
def test_d_equals_the_projector_wherever_the_degree_of_actuation_is_two(name):
    robot = MACHINES[name]
    q = rk.inverse_kinematics(robot, random_points(robot, 300))
    q = q[np.linalg.svd(rk.redundant_control_matrix(robot, q), compute_uv=False)[:, 1] > 0.01]
    D = rk.closed_loop_projector(rk.redundant_control_matrix(robot, q))
    assert norm(D - rk.nullspace_projector(robot, q)).max() < 1e-11


@pytest.mark.parametrize("distance", [1e-4, 1e-6, 1e-8, 1e-10])
def test_d_equals_the_projector_close_to_an_input_singularity_too(distance):
    """J is regular there, and so N_J exact; rounding turns the span of A~ by its condition, not by its square."""
    robot = rk.load().replace(mode=[1, -1, 1])
    place = robot.base[::2].mean(axis=0) + distance * np.array([[0.6, 0.8], [-0.6, -0.8]])
    q = rk.inverse_kinematics(robot, place)
    A_tilde, N_J = rk.redundant_control_matrix(robot, q), rk.nullspace_projector(robot, q)
    sigma = np.linalg.svd(A_tilde, compute_uv=False)
    assert np.all(sigma[:, 1] < 20 * distance) and np.linalg.cond(rk.constraint_jacobian(robot, q)).max() < 10
    assert_allclose(rk.closed_loop_projector(A_tilde), N_J, rtol=0, atol=1e-15 * (sigma[:, 0] / sigma[:, 1]).max())
    assert_allclose(rk.closed_loop_projector(A_tilde[0]), N_J[0], rtol=0, atol=1e-15 * sigma[0, 0] / sigma[0, 1])


@pytest.mark.parametrize(("m", "n", "delta"), [(2, 4, 1), (4, 9, 3), (6, 7, 2), (5, 5, 4), (3, 8, 3)])
def test_d_of_any_mechanism_is_the_projector_of_numpys_pseudoinverse(m, n, delta):
    rng = np.random.default_rng(m * n + delta)
    A_tilde = rng.normal(size=(3, 7, m, delta)) @ rng.normal(size=(3, 7, delta, n))
    D = rk.closed_loop_projector(A_tilde, delta)
    expected = np.linalg.pinv(A_tilde, rcond=1e-10) @ A_tilde  # of rank delta, and the projector is symmetric
    # Backward stable but for the conditions of the two factors.
    bound = 1e-14 * np.linalg.cond(A_tilde @ np.swapaxes(A_tilde, -1, -2)[..., :delta]).max() if m == delta else 1e-9
    assert_allclose(D, expected, rtol=0, atol=max(bound, 1e-11))
    assert_allclose(D[1, 2], rk.closed_loop_projector(A_tilde[1, 2], delta), rtol=0, atol=1e-12)
    assert_allclose(np.trace(D, axis1=-2, axis2=-1), delta, rtol=1e-9)


def test_lyapunov_function_falls_at_the_rate_of_the_damping():
    target = rk.inverse_kinematics(ROBOT, [0.02, 0.0])
    desired = rk.Desired(3, np.array([0.02, 0.0]), np.zeros(2), np.zeros(2), target, np.zeros(6), np.zeros(6))
    law, K_D = rk.RedundantAPD(40.0, 1.5), 1.5

    def rate(t, s):
        q = rk.inverse_kinematics(ROBOT, s[:2])
        F = rk.orthogonal_complement(ROBOT, q)
        qd = F @ s[2:4]
        qdd, _ = rk.forward_dynamics(ROBOT, q, qd, torque(law, ROBOT, q, qd, desired))
        xdd = np.linalg.pinv(F) @ (qdd - rk.orthogonal_complement_dot(ROBOT, q, qd) @ s[2:4])
        return np.concatenate([s[2:4], xdd, [K_D * qd @ qd]])

    run = solve_ivp(rate, (0, 0.5), [0.05, 0.03, 0, 0, 0], method="DOP853", rtol=1e-10, atol=1e-12)
    q = rk.inverse_kinematics(ROBOT, run.y[:2].T)
    qd = mv(rk.orthogonal_complement(ROBOT, q), run.y[2:4].T)
    V = rk.lyapunov_function(ROBOT, q, q - target, qd, 40.0)
    assert np.all(np.diff(V) <= 1e-12)
    assert_allclose(V[0] - V, run.y[4], atol=1e-7 * V[0])
    # Without elbow gains too: the damping of the drives alone.
    assert_allclose(
        rk.lyapunov_function(ROBOT, q, q - target, qd, [40.0] * 3),
        rk.kinetic_energy(ROBOT, q, qd) + 20 * ((q - target)[:, :3] ** 2).sum(-1),
        rtol=1e-9,
    )


@pytest.mark.parametrize("gains", [(40.0, 1.5), (np.full(3, 40.0), np.full(3, 1.5))], ids=["all joints", "(29)"])
def test_third_term_of_the_lyapunov_function(gains):
    """dV/dt = ed^T G~ edd + ed^T dG~/dt ed / 2 + e^T K_P ed + eps (ed^T G~ ed + e^T G~ edd) / 2 at ed = 0."""
    x = np.array([[0.05, 0.03], [-0.04, 0.02], [0.0, -0.05]])
    q, still = rk.inverse_kinematics(ROBOT, x), np.zeros((3, 6))
    target = rk.inverse_kinematics(ROBOT, x + [2e-3, -1e-3])
    desired = rk.Desired(3, x + [2e-3, -1e-3], 0 * x, 0 * x, target, still, still)
    law, eps, e = rk.RedundantAPD(*gains), 3.0, q - target
    qdd, _ = rk.forward_dynamics(ROBOT, q, still, torque(law, ROBOT, q, still, desired))
    D = rk.closed_loop_projector(rk.redundant_control_matrix(ROBOT, q))
    G, _, _ = rk.redundant_dynamics(ROBOT, q, still)
    K = np.diag([40.0] * 3 + [40.0 if np.ndim(gains[0]) == 0 else 0.0] * 3)
    rate = eps / 2 * np.einsum("ki,kij,kj->k", e, G, qdd)
    assert_allclose(rate, -eps / 2 * np.einsum("ki,kij,kj->k", e, D @ K, e), rtol=1e-9)
    assert np.all(rate < 0)
    ed = mv(rk.orthogonal_complement(ROBOT, q), np.ones((3, 2)))
    V = [rk.lyapunov_function(ROBOT, q, e, ed, gains[0], eps=eps) for eps in (0.0, 3.0)]
    assert_allclose(V[1] - V[0], 1.5 * np.einsum("ki,kij,kj->k", e, G, ed), rtol=1e-12)
    with pytest.raises(ValueError, match="eps = -1; allowed: >= 0"):
        rk.lyapunov_function(ROBOT, q, e, ed, 40.0, eps=-1.0)


@machines
def test_lyapunov_function_of_any_number_of_arms_is_an_energy(robot):
    """For tangent rates the kinetic one, and that of a spring at every drive, or at every joint."""
    q, qd, _, _ = random_motion(robot, 5, bend=0.2)
    N, e = robot.n_arms, 0.01 * np.cos(np.arange(10 * robot.n_arms)).reshape(5, -1)
    kinetic, springs = rk.kinetic_energy(robot, q, qd), np.linspace(20.0, 50.0, N)
    driven = (springs * e[:, :N] ** 2).sum(axis=-1) / 2
    assert_allclose(rk.lyapunov_function(robot, q, e, qd, springs), kinetic + driven, rtol=1e-9)
    assert_allclose(rk.lyapunov_function(robot, q, e, qd, 40.0), kinetic + 20.0 * (e**2).sum(axis=-1), rtol=1e-9)


def test_gains_29_on_the_driven_joints():
    """The formulas (28) and (32), line 1, with K = diag(K_1, ..., K_m, 0, ..., 0) in our order of the joints."""
    q, qd, desired = state_and_target(ROBOT)
    K_P, K_D = np.array([50.0, 60.0, 70.0, 0, 0, 0]), np.array([5.0, 6.0, 7.0, 0, 0, 0])
    feedback = K_P * (q - desired.q) + K_D * (qd - desired.qd)
    G, C, Q = rk.redundant_dynamics(ROBOT, q, qd)
    pinv = np.linalg.pinv(T(rk.redundant_control_matrix(ROBOT, q)), rcond=1e-9)
    for law, expected in (
        (rk.RedundantAPD, mv(G, desired.qdd) + mv(C, desired.qd) + Q - feedback),
        (rk.RedundantCTC, mv(G, desired.qdd - feedback) + mv(C, qd) + Q),
    ):
        found = torque(law(K_P[:3], K_D[:3]), ROBOT, q, qd, desired)
        assert_allclose(found, mv(pinv, expected), rtol=0, atol=1e-9 * np.abs(found).max())


def test_the_two_lines_of_28_are_two_laws():
    """They agree without error only: line 2 has N_J (G qdd^d + C qd^d + Q) in place of G~ qdd^d + C~ qd^d + Q~."""
    q, qd, desired = state_and_target(ROBOT)
    pinv = np.linalg.pinv(T(rk.redundant_control_matrix(ROBOT, q)), rcond=1e-9)
    G, C, Q = rk.mass_matrix(ROBOT, q), rk.coriolis_matrix(ROBOT, q, qd), rk.generalized_forces(ROBOT, q, qd)

    def line_2(desired):
        feedback = 50.0 * (q - desired.q) + 5.0 * (qd - desired.qd)
        return mv(pinv, mv(G, desired.qdd) + mv(C, desired.qd) + Q - feedback)

    law = rk.RedundantAPD(50.0, 5.0)
    apart = norm(torque(law, ROBOT, q, qd, desired) - line_2(desired)) / norm(line_2(desired))
    assert np.median(apart) > 1e-4
    _, _, qdd, (x, xd, xdd) = random_motion(ROBOT, len(q), bend=0.3)
    exact = rk.Desired(3, x, xd, xdd, q, qd, qdd)
    assert_allclose(torque(law, ROBOT, q, qd, exact), line_2(exact), rtol=0, atol=1e-9)


# (32)-(35): the redundant CTC law.
def test_closed_loop_of_the_redundant_ctc():
    # (33): N_J G N_J (edd + K_D ed + K_P e) = 0 for line 1, and N_J G (...) = 0 for line 2.
    q, qd, desired = state_and_target(ROBOT)
    K_P, K_D = np.linspace(200, 500, 6), np.linspace(20, 50, 6)
    v = desired.qdd - K_D * (qd - desired.qd) - K_P * (q - desired.q)
    N, G = rk.nullspace_projector(ROBOT, q), rk.mass_matrix(ROBOT, q)
    qdd, _ = rk.forward_dynamics(ROBOT, q, qd, torque(rk.RedundantCTC(K_P, K_D), ROBOT, q, qd, desired))
    terms = [mv(N @ G @ N, qdd), -mv(N @ G @ N, v)]
    assert (norm(sum(terms)) / sum(map(norm, terms))).max() < 1e-10
    line_2 = rk.RedundantCTC(K_P, K_D, projected=False)
    qdd, _ = rk.forward_dynamics(ROBOT, q, qd, torque(line_2, ROBOT, q, qd, desired))
    terms = [mv(N @ G, qdd), -mv(N @ G, v)]
    assert (norm(sum(terms)) / sum(map(norm, terms))).max() < 1e-10


@pytest.mark.parametrize("law", [rk.RedundantCTC(400.0, 40.0), rk.RedundantAPD(50.0, 5.0)], ids=["CTC", "APD"])
def test_line_2_depends_on_the_arm_that_carries_the_load(law):
    """Symmetry: arms in another order give the same torques in line 1.  Under line 2 of (32) the load moves to an arm
    whose tip accelerates by hdd = J v + Jdot qd more, h = tip_1 - tip_2: in torques (A^T)^+ load hdd."""
    order = np.array([1, 0, 2])
    joints = np.concatenate([order, 3 + order])
    robot = ROBOT.replace(load=0.4)
    names = ("base", "lengths", "masses", "centers", "inertias", "rotor_inertia", "mode")
    other = robot.replace(**{name: getattr(robot, name)[order] for name in names})
    q, qd, desired = state_and_target(robot)
    moved = (desired.q, desired.qd, desired.qdd)
    renamed = rk.Desired(3, desired.x, desired.xd, desired.xdd, *(part[:, joints] for part in moved))

    def difference(law):
        c = torque(law, robot, q, qd, desired)
        return torque(law, other, q[:, joints], qd[:, joints], renamed)[:, order] - c, norm(c).max()

    found, size = difference(law)
    assert norm(found).max() < 1e-10 * size
    if isinstance(law, rk.RedundantCTC):
        v = desired.qdd - 40.0 * (qd - desired.qd) - 400.0 * (q - desired.q)
        hdd = mv(rk.constraint_jacobian(robot, q), v) + mv(rk.constraint_jacobian_dot(robot, q, qd), qd)
        expected = mv(rk.weighted_pseudoinverse(rk.control_matrix(robot, q)), robot.load * hdd[:, :2])
        found, size = difference(dataclasses.replace(law, projected=False))
        assert norm(expected).max() > 1e-3 * size
        assert_allclose(found, expected, rtol=0, atol=1e-10 * size)


def stiffness(law, robot, x):
    """-d(q2dd)/d(x) at rest in the desired pose x, in end-effector coordinates, by central differences."""
    target = rk.inverse_kinematics(robot, x)
    desired = rk.Desired(robot.n_arms, x, np.zeros(2), np.zeros(2), target, 0 * target, 0 * target)

    def acceleration(p):
        q = rk.inverse_kinematics(robot, p)
        qdd, _ = rk.forward_dynamics(robot, q, 0 * q, torque(law, robot, q, 0 * q, desired))
        return np.linalg.pinv(rk.orthogonal_complement(robot, q)) @ qdd

    h = 1e-4
    weights = {1: 2 / 3, 2: -1 / 12}

    def slope(e):
        return sum(w * (acceleration(x + k * h * e) - acceleration(x - k * h * e)) for k, w in weights.items()) / h

    return -np.stack([slope(e) for e in np.eye(2)], axis=-1)


@pytest.mark.parametrize("gain", [400.0, [400.0, 400.0, 400.0]], ids=["all joints", "drives only"])
def test_effective_gain_is_what_the_error_feels(gain):
    x = np.array([0.04, -0.03])
    F = rk.orthogonal_complement(ROBOT, rk.inverse_kinematics(ROBOT, x))
    K = 400.0 * np.diag([1, 1, 1, *([1, 1, 1] if np.ndim(gain) == 0 else [0, 0, 0])])
    found = stiffness(rk.RedundantCTC(gain, 40.0), ROBOT, x)
    assert_allclose(found, rk.effective_gain(F, K), rtol=1e-6, atol=1e-4)
    if np.ndim(gain) == 0:
        assert_allclose(rk.effective_gain(F, gain), 400 * np.eye(2), atol=1e-9)


def test_pose_dependent_gain_at_the_centroid_and_along_the_path():
    S = np.diag([1.0, 1, 1, 0, 0, 0])
    gain = lambda q: np.linalg.eigvals(rk.effective_gain(rk.orthogonal_complement(TESTBED, q), S)).real  # noqa: E731
    assert_allclose(gain(rk.inverse_kinematics(TESTBED, [0.0, 0.0])), 3 / 7, atol=1e-12)
    along_path = gain(rk.triangle(TESTBED).q)
    assert_allclose([along_path.min(), along_path.max()], [0.19, 0.73], atol=0.005)
    # Eigenvalues do not depend on the coordinates.
    q = rk.inverse_kinematics(TESTBED, [0.03, 0.02])
    other = np.linalg.eigvals(rk.effective_gain(rk.orthogonal_complement(TESTBED, q, (0, 1)), S))
    assert_allclose(np.sort(other), np.sort(gain(q)), atol=1e-12)


def test_torques_do_not_depend_on_the_partition_rule():
    q, qd, desired = state_and_target(ROBOT)
    for law in (rk.RedundantAPD, rk.RedundantCTC):
        rules = ("sigma_min", "condition", "printed")
        c = [torque(law(400.0, 40.0, rule=rule), ROBOT, q, qd, desired) for rule in rules]
        assert (norm(c[1] - c[0]) / norm(c[0])).max() < 1e-11
        assert (norm(c[2] - c[0]) / norm(c[0])).max() < 1e-6  # the printed rule picks nearly singular partitions
        assert np.any(c[2] != c[0])  # other rows round otherwise


# The controller in a sampled loop.
def test_controller_uses_the_least_squares_pose_of_the_measurement():
    path, offset = rk.triangle(FRICTIONLESS, dt=0.01), np.array([0.004, -0.002, 0.005])
    law = rk.AntagonismFilter(rk.PD(7.05, 0.225))
    controller = rk.Controller(law, FRICTIONLESS)
    for k in (0, 1, 2):
        q_a, qd_a = path.q_a[k] + offset, path.qd_a[k]
        q = rk.estimate_pose(FRICTIONLESS, q_a, path.x[k])
        A = rk.control_matrix(FRICTIONLESS, q)
        c = controller(path.t[k], q_a, qd_a, path[k])
        assert_allclose(controller.x, rk.forward_kinematics(FRICTIONLESS, q), atol=1e-12)  # the next guess
        assert_allclose(c, rk.antagonism_filter(A) @ (-7.05 * offset), atol=1e-12)
    true = rk.Controller(rk.AntagonismFilter(rk.PD(7.05, 0.225), pose="true"), FRICTIONLESS)
    A = rk.control_matrix(FRICTIONLESS, path.q[5])
    c = true(0.05, path.q_a[5] + offset, path.qd_a[5], path[5], truth=(path.x[5], path.xd[5]))
    assert_allclose(c, rk.antagonism_filter(A) @ (-7.05 * offset), atol=1e-12)
    switched = rk.Controller(rk.SwitchedCTC(400, 40), FRICTIONLESS)
    switched(0.0, path.q_a[0], path.qd_a[0], path[0])
    assert switched.pair == rk.SwitchedCTC(400, 40).choose(FRICTIONLESS, path.q[0])
    plain = rk.Controller(rk.PD(7.05, 0.225), FRICTIONLESS)(0.05, path.q_a[5] + offset, path.qd_a[5], path[5])
    assert_allclose(plain, -7.05 * offset, atol=1e-13)
    with pytest.raises(NotImplementedError):
        rk.Law().torque(FRICTIONLESS, None, None, None, None, None)


def test_a_controller_that_found_no_pose_begins_again_like_a_new_one():
    """It forgets where it was, and starts at the desired place; what it tells of a place belongs to who asks."""
    path, law = rk.hold(FRICTIONLESS, [0.0, 0.0], 0.01), rk.AntagonismFilter(rk.PD(7.05, 0.225))
    controller, turned = rk.Controller(law, FRICTIONLESS), 2.5 * np.array([1.0, -1.0, 1.0])
    near = 0.0, path.q_a[0] + [0.004, -0.002, 0.005], path.qd_a[0], path[0]
    far = 0.0, path.q_a[0] + turned, path.qd_a[0], path[0]
    assert controller.x is None
    first = controller(*near)
    controller.x[:] = 9.0
    assert np.abs(controller.x).max() < 0.01
    with pytest.raises(rk.ConvergenceError):
        controller(*far)
    assert controller.x is None
    assert_allclose(controller(*near), first, rtol=0, atol=0)


PLAIN = rk.PD(7.0, 0.2)
MEMORYLESS = [PLAIN, rk.AntagonismFilter(PLAIN), rk.CommandFilter(PLAIN), *[LAWS[k] for k in LAWS if k != "switched"]]


@pytest.mark.parametrize("law", MEMORYLESS, ids=lambda law: type(law).__name__)
def test_one_sample_and_many_are_the_same_call(law):
    q, qd, desired = state_and_target(ROBOT, 8)
    whole = torque(law, ROBOT, q, qd, desired, offset=1e-3)
    for k in range(8):
        single = torque(law, ROBOT, q[k], qd[k], part(desired, k), offset=1e-3)
        assert_allclose(single, whole[k], atol=1e-12 * np.abs(whole).max())


# Runs: what energy and antagonism say about them.
def test_energies_of_a_run_by_their_definitions():
    path = rk.triangle(FRICTIONLESS, duration=1.0, dt=1e-3, side=0.1)
    offset = np.array([0.004, -0.002, 0.005])
    run = rk.simulate(FRICTIONLESS, rk.PD(7.05, 0.225), path, offset)
    n = rk.null_vector(FRICTIONLESS, run.q)
    null = n * np.einsum("ki,ki->k", n, run.c)[:, None]
    assert_allclose(rk.antagonistic_torque(run), null, atol=1e-13)
    assert_allclose(rk.antagonistic_energy(run), 0.611 / 0.0259**2 * (null[:-1] ** 2).sum() * 1e-3, rtol=1e-12)
    assert_allclose(run.energy, rk.copper_loss(FRICTIONLESS, run.c[:-1], 1e-3) + rk.mechanical_work(run), rtol=1e-12)
    gained = rk.kinetic_energy(FRICTIONLESS, run.q[-1], run.qd[-1])
    assert_allclose(rk.mechanical_work(run).sum(), gained, atol=1e-9)


@pytest.mark.parametrize(
    ("ask", "reads"),
    [
        (rk.mechanical_work, ["robot", "q_a", "c", "dt"]),
        (rk.antagonistic_torque, ["robot", "q", "q_a", "c", "dt"]),
        (rk.antagonistic_energy, ["robot", "q", "q_a", "c", "dt"]),
    ],
)
def test_what_is_no_run_is_refused_by_the_functions_of_runs(ask, reads):
    run = rk.simulate(FRICTIONLESS, rk.PD(7.05, 0.225), rk.hold(FRICTIONLESS, [0.0, 0.0], 0.01), [1e-3, 0.0, 0.0])
    known = {name: getattr(run, name) for name in reads}
    assert_allclose(ask(SimpleNamespace(**known)), ask(run), rtol=1e-12)
    for name in reads:
        with pytest.raises(ValueError, match=r"run = .*; allowed: a Run, such as simulate returns"):
            ask(SimpleNamespace(**{key: value for key, value in known.items() if key != name}))


def test_antagonism_form_belongs_to_the_path_wherever_the_set_points_are():
    path = rk.circle(FRICTIONLESS, 0.05, 1.0, 5e-3)
    moved = path.with_set_points(path.q_a + 4e-3 * np.array([1.0, -1.0, 1.0]))
    form = rk.antagonism_form(FRICTIONLESS, path, 7.05)
    assert_allclose(rk.antagonism_form(FRICTIONLESS, moved, 7.05), form, rtol=1e-12)


def test_antagonism_form_is_that_of_the_machine_not_of_the_one_that_the_path_was_made_for():
    """In another working mode the same path has other matrices; a run tells."""
    path, offset = rk.circle(FRICTIONLESS, 0.05, 5.0, centre=(0.0, 0.02)), np.array([0.004, -0.002, 0.005])
    for mode in ([1, 1, -1], [-1, 1, 1], [-1, -1, -1]):
        other = FRICTIONLESS.replace(mode=mode)
        run = rk.simulate(other, rk.PD(7.05, 0.225), path, offset)
        assert_allclose(offset @ rk.antagonism_form(other, path, 7.05) @ offset, rk.antagonistic_energy(run), rtol=0.05)


def test_antagonistic_energy_is_quadratic_in_the_offsets():
    path, offset = rk.triangle(FRICTIONLESS, dt=5e-3), np.array([0.004, -0.002, 0.005])
    S = rk.antagonism_form(FRICTIONLESS, path, 7.05)
    assert_allclose(S, S.T, rtol=1e-12)
    # Its definition, torque by torque, on a path that ends elsewhere, too; and a run that is slow against the PD loop.
    for one in (path, rk.circle(FRICTIONLESS, 0.08, 1.0, 5e-3, turns=0.5)):
        c = rk.steady_state_torque(rk.control_matrix(FRICTIONLESS, one.q), 7.05, offset)
        cost = offset @ rk.antagonism_form(FRICTIONLESS, one, 7.05) @ offset
        assert_allclose(cost, rk.copper_loss(FRICTIONLESS, c[:-1], 5e-3).sum(), rtol=1e-12)
    run = rk.simulate(FRICTIONLESS, rk.PD(7.05, 0.225), rk.triangle(FRICTIONLESS), offset)
    assert_allclose(rk.antagonistic_energy(run), offset @ S @ offset, rtol=0.05)
    # An offset that is itself a motion of the loops costs nothing.
    still = rk.hold(FRICTIONLESS, [0.03, 0.02], 0.1)
    tangent = rk.control_matrix(FRICTIONLESS, still.q[0]) @ np.array([1e-3, 2e-3])
    form = rk.antagonism_form(FRICTIONLESS, still, [5.0, 6.0, 7.0])
    assert tangent @ form @ tangent < 1e-12 * np.linalg.norm(form) * (tangent @ tangent)


def test_antagonism_of_unlike_motors_costs_the_heat_of_each_by_its_own_resistance():
    """Their definitions at 200 Hz: R (c / k_t)^2 dt of the torques at rest, and of n n^T c in a run, motor by motor."""
    robot = FRICTIONLESS.replace(resistance=[0.05, 0.6, 3.0], torque_constant=[0.02, 0.03, 0.04])
    path, offset = rk.circle(robot, 0.06, 1.0, 5e-3), np.array([0.004, -0.002, 0.005])
    motors = (0.05, 0.02), (0.6, 0.03), (3.0, 0.04)
    heat = lambda c: sum(R * np.sum((c[:-1, i] / k_t) ** 2) * 5e-3 for i, (R, k_t) in enumerate(motors))  # noqa: E731
    S = rk.antagonism_form(robot, path, [5.0, 6.0, 7.0])
    at_rest = rk.steady_state_torque(rk.control_matrix(robot, path.q), [5.0, 6.0, 7.0], offset)
    assert_allclose(offset @ S @ offset, heat(at_rest), rtol=1e-12)
    assert_allclose(S, S.T, rtol=1e-12)
    run = rk.simulate(robot, rk.PD(7.05, 0.225), path, offset)
    n = rk.null_vector(robot, run.q)
    assert_allclose(rk.antagonistic_energy(run), heat(n * np.vecdot(n, run.c)[:, None]), rtol=1e-12)


def test_table_1_measured_and_simulated():
    table = rk.table1()
    assert_allclose(table.measured, [[1.3347, 1.5414, 1.6844], [0.4574, 0.7010, 1.0801]])
    assert np.abs(table.deviation).max() < 0.04  # the chapter's six energies, by one reading of many


def test_filter_of_table_1_leaves_no_antagonism():
    """It works at the true pose, where R of (15) leaves no torque that moves nothing."""
    reading = rk.experiment("table1_reading")
    run = reading.run(rk.AntagonismFilter(reading.law, pose="true"))
    assert rk.antagonistic_energy(run) < 1e-20
    assert_allclose(rk.table1().simulated, [reading.run().energy, run.energy], rtol=1e-12)


def test_deviations_of_table_1_are_shares_of_what_was_measured():
    table = Table1(measured=np.full((2, 3), 2.0), simulated=np.full((2, 3), 3.0))
    assert_allclose(table.deviation, 0.5)


@pytest.mark.parametrize("gains", [[400.0, 0.0, 400.0], [400.0, -1.0, 400.0]])
def test_gains_of_driven_joints_are_positive_each(gains):
    with pytest.raises(ValueError, match=r"K_P\[1\] = (0|-1); allowed: > 0"):
        joint_gain("K_P", gains, 3)
    assert np.array_equal(joint_gain("K_P", [1.0, 2.0, 3.0], 3), np.diag([1.0, 2.0, 3.0, 0.0, 0.0, 0.0]))


def test_a_gain_of_no_known_shape_is_told_all_of_them():
    law, path = rk.RedundantCTC([400.0, 400.0], 40.0), rk.hold(FRICTIONLESS, [0.0, 0.0], 0.01)
    with pytest.raises(ValueError, match=r"K_P has shape \(2,\); allowed: one number, \(3,\) on the drives, \(6,\)"):
        rk.simulate(FRICTIONLESS, law, path)


class Slowly(rk.AntagonismFilter):
    """The same filter, which the engine does not know."""


@pytest.mark.parametrize(
    ("law", "options"),
    [
        (rk.RedundantAPD(7.0, 0.2), {"pose": "true"}),
        (rk.APD(7.0, 0.2, pose="true"), {}),
        (rk.APD(7.0, 0.2, W=[1.0, 2.0, 4.0]), {}),
        (rk.APD(7.0, 0.2, W=[1.0, 2.0, 4.0]), {"W": [4.0, 1.0, 1.0]}),
    ],
    ids=["own pose", "true pose inside", "own weights", "both weights"],
)
def test_a_filter_has_its_own_pose_and_weights_and_so_has_the_law_inside(law, options):
    """c = R c' with R at the pose and in the weights of the filter, c' in those of the law: as the classes say it."""
    path = rk.circle(FRICTIONLESS, 0.05, 0.05)
    fast, slow = (
        rk.simulate(FRICTIONLESS, kind(law, **options), path, [4e-3, -2e-3, 5e-3])
        for kind in (rk.AntagonismFilter, Slowly)
    )
    assert_allclose(fast.c, slow.c, rtol=0, atol=1e-9 * np.abs(slow.c).max())


@pytest.mark.parametrize("law", [rk.AntagonismFilter(rk.PD(7.05, 0.225)), rk.APD(7.0, 0.2)], ids=["filter", "APD"])
def test_weights_as_a_matrix_are_those_on_its_diagonal(law):
    """In runs, too, where the engine knows only one number per drive."""
    path, W = rk.circle(FRICTIONLESS, 0.05, 0.05), [1.0, 2.0, 4.0]
    laws = (dataclasses.replace(law, W=each) for each in (W, np.diag(W)))
    one, other = (rk.simulate(FRICTIONLESS, each, path, [4e-3, -2e-3, 5e-3]).c for each in laws)
    assert_allclose(one, other, rtol=0, atol=1e-9 * np.abs(one).max())


def test_weights_inside_a_filter_have_to_fit_although_no_torque_depends_on_them():
    """A^T (A^T)_W^+ = I: whatever its weights, the law inside asks for the same force, which is all that (16) keeps."""
    path = rk.circle(FRICTIONLESS, 0.05, 0.05)
    run = lambda W: rk.simulate(FRICTIONLESS, rk.AntagonismFilter(rk.APD(7.0, 0.2, W=W)), path).c  # noqa: E731
    assert_allclose(run([1.0, 2.0, 4.0]), run(None), rtol=0, atol=1e-9)
    with pytest.raises(ValueError, match=r"W has shape \(4,\); allowed: one number, \(3,\)"):
        run([1.0, 2.0, 4.0, 8.0])


def test_one_measurement_or_many_and_one_desired_state_or_many():
    law, path = rk.PD([7.0, 5.0, 3.0], 0.2), rk.circle(TESTBED, 0.05, 1.0, dt=0.1)
    d, rng = path[0], np.random.default_rng(1)
    q_a, qd_a = rng.normal(size=(2, 5, 3))
    rows = [law.torque(TESTBED, d.q, d.qd, a, b, d) for a, b in zip(q_a, qd_a, strict=True)]
    assert_allclose(law.torque(TESTBED, d.q, d.qd, q_a, qd_a, d), rows, rtol=1e-14)
    rows = [law.torque(TESTBED, d.q, d.qd, q_a[0], qd_a[0], one) for one in path]
    assert_allclose(law.torque(TESTBED, d.q, d.qd, q_a[0], qd_a[0], path[:]), rows, rtol=1e-14)


def test_effective_gain_of_a_matrix_that_couples_joints_solves_its_normal_equations():
    """Of (35) corrected: F^T F times it is F^T K F, with what stands beside the diagonal of K."""
    rng = np.random.default_rng(11)
    F, K = rng.normal(size=(4, 6, 2)), rng.normal(size=(6, 6))
    assert_allclose(F.mT @ F @ rk.effective_gain(F, K), F.mT @ K @ F, atol=1e-12)
    with pytest.raises(ValueError, match=r"leading axes do not fit together: F \(4,\), K \(3,\)"):
        rk.effective_gain(F, np.stack([K] * 3))


def test_a_gain_of_dependent_columns_is_refused_however_they_round():
    """(F^T F) of a product of two vectors is singular but for rounding."""
    rng = np.random.default_rng(10)
    for _ in range(50):
        with pytest.raises(ValueError, match="F has lost rank"):
            rk.effective_gain(np.outer(rng.normal(size=6), rng.normal(size=2)), 1.0)


@pytest.mark.parametrize("law", [rk.APD(7.0, 0.2, None), rk.CTC(400.0, 40.0, None)])
def test_one_pose_beside_many_measurements_has_as_many_torques(law):
    """Also where measured base angles do not enter: with the end-effector as coordinates."""
    d, many = rk.triangle(ROBOT)[3], rk.triangle(ROBOT)[2:6]
    alone = law.torque(ROBOT, d.q, d.qd, d.q_a, d.qd_a, d)
    assert_allclose(law.torque(ROBOT, d.q, d.qd, many.q_a, many.qd_a, d), np.tile(alone, (4, 1)), rtol=1e-12)


def test_the_estimate_of_a_controller_is_not_changed_from_outside():
    path = rk.hold(ROBOT, [0.02, 0.03], 0.1)
    one, other = (rk.Controller(rk.CTC(400.0, 40.0, None), ROBOT) for _ in range(2))
    assert one.x is None, "nothing was measured yet"
    for t in (0.0, 1e-3):
        same = [c(t, path.q_a[0], path.qd_a[0], path[0]) for c in (one, other)]
        assert_allclose(*same, rtol=0, atol=0)
        one.x[:] = 0.0
    assert_allclose(one.x, other.x, rtol=0, atol=0)


def test_a_controller_that_lost_its_pose_begins_anew():
    """`Controller.x` is None where there is no estimate; the next search begins at the desired place, as the first."""
    path = rk.hold(ROBOT, [0.02, 0.03], 0.1)
    used, new = (rk.Controller(rk.CTC(400.0, 40.0, None), ROBOT) for _ in range(2))
    used(0.0, path.q_a[0] + 0.05, path.qd_a[0], path[0])
    with pytest.raises(rk.ConvergenceError, match="found no pose"):
        used(1e-3, path.q_a[0] + 2.5 * np.array([1.0, -1.0, 1.0]), path.qd_a[0], path[0])
    assert used.x is None
    same = [c(2e-3, path.q_a[0] + 1e-3, path.qd_a[0], path[0]) for c in (used, new)]
    assert_allclose(*same, rtol=0, atol=0)


def test_a_pose_of_a_law_is_measured_or_true():
    plain = rk.PD(7.0, 0.2)
    for kind, given in (
        (rk.APD, (7.0, 0.2)), (rk.CTC, (400.0, 40.0)), (rk.SwitchedCTC, (400.0, 40.0)), (rk.RedundantAPD, (5.0, 0.2)),
        (rk.RedundantCTC, (400.0, 40.0)), (rk.AntagonismFilter, (plain,)), (rk.CommandFilter, (plain,)),
    ):  # fmt: skip
        assert kind(*given, pose="true").pose == "true"
        with pytest.raises(ValueError, match="pose = 'desired'; allowed: 'measured', 'true'"):
            kind(*given, pose="desired")


@pytest.mark.parametrize("wrong", [0, 1])
def test_a_controller_is_told_one_instant_at_a_time(wrong):
    """Also where a torque could be computed for many: its memory is that of one instant."""
    path = rk.hold(ROBOT, [0.02, 0.03], 0.1)
    given = [path.q_a[0], path.qd_a[0]]
    given[wrong] = np.tile(given[wrong], (2, 1))
    with pytest.raises(ValueError, match=f"{('q_a', 'qd_a')[wrong]} has shape \\(2, 3\\); allowed: \\(3,\\)"):
        rk.Controller(rk.PD(7.0, 0.2), ROBOT)(0.0, *given, path[0])
