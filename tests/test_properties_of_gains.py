"""Identities of the laws and filters for machines, gains and weights at random; see tests/drawn.py."""

import hypothesis
import numpy as np
from drawn import as_matrix, gain, kinds, machines, motion, reordered, scaled, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.optimize import linprog

import rapkm_lite as rk


@settings
@hypothesis.given(machines(), kinds)
def test_the_filter_projects_for_every_weight(drawn, kind):
    """(15), (16): R R = R, A^T R = A^T, of rank two, and symmetric where W is the ruler."""
    robot, _, q, rng = drawn
    N = robot.n_arms
    W, A = gain(kind, N, rng), rk.control_matrix(robot, q)
    R = rk.AntagonismFilter(rk.PD(1.0, 1.0), W=W).matrix(robot, q)
    size = np.abs(R).max()
    assert_allclose(R @ R, R, atol=1e-11 * size**2)
    assert_allclose(A.T @ R, A.T, atol=1e-11 * size * np.abs(A).max())
    WR = as_matrix(W, N) @ R
    assert_allclose(WR, WR.T, atol=1e-11 * np.abs(WR).max())
    assert round(np.trace(R)) == np.linalg.matrix_rank(R, tol=1e-6) == 2
    same = rk.AntagonismFilter(rk.PD(1.0, 1.0), W=7.0 * np.asarray(W)).matrix(robot, q)
    assert_allclose(same, R, atol=1e-12 * size)


@settings
@hypothesis.given(machines(), kinds)
def test_filtered_commands_make_the_filtered_force(drawn, kind):
    """(17), (18): K R_{A^T K} e has the force of K e, and R_{A^T K} projects."""
    robot, _, q, rng = drawn
    N = robot.n_arms
    K, A = gain(kind, N, rng, 7.0), rk.control_matrix(robot, q)
    R, matrix = rk.command_filter(A, K), as_matrix(K, N)
    assert_allclose(R @ R, R, atol=1e-11)
    assert_allclose(A.T @ matrix @ R, A.T @ matrix, atol=1e-10 * np.abs(A.T @ matrix).max())


@settings
@hypothesis.given(machines(friction=True), kinds)
def test_torques_of_least_weighted_size(drawn, kind):
    """(11): the force is the motion's, and c - c0 is W-orthogonal to whatever moves nothing."""
    robot, _, q, rng = drawn
    _, _, qd, qdd = motion(robot, q, rng)
    N = robot.n_arms
    W, c0 = gain(kind, N, rng), rng.normal(0.0, 0.5, N)
    A = rk.control_matrix(robot, q)
    c = rk.inverse_dynamics(robot, q, qd, qdd, W=W, prestress=c0)
    force, size = rk.required_wrench(robot, q, qd, qdd), 1 + np.abs(c).max()
    assert_allclose(A.T @ c, force, atol=1e-10 * size * np.abs(A).max())
    ruler = as_matrix(W, N)
    assert_allclose(rk.null_basis(A).T @ ruler @ (c - c0), 0.0, atol=1e-10 * size * np.abs(ruler).max())
    # What has no limit in reach is allocated alike.
    assert_allclose(rk.allocate_torques(A, force, 10 * size, W, c0), c, atol=1e-9 * size)


@settings
@hypothesis.given(machines(least=3), kinds, st.floats(1.02, 3.0))
def test_allocation_within_limits_is_optimal(drawn, kind, room):
    """Convexity: c is best if and only if no torques within the limits lie downhill of it."""
    robot, _, q, rng = drawn
    N = robot.n_arms
    W, limit = gain(kind, N, rng), rng.uniform(0.05, 0.15, N)
    A = rk.control_matrix(robot, q)
    f = A.T @ rng.uniform(-1.0, 1.0, N)
    peak = np.max(np.abs(rk.minimax_torques(A, f, limit)) / limit)
    f = f / peak / room
    c0 = rng.normal(0.0, 0.1, N)
    c = rk.allocate_torques(A, f, limit, W, c0)
    assert_allclose(A.T @ c, f, atol=1e-8 * np.abs(A * limit[:, None]).max())
    assert np.all(np.abs(c) <= limit * (1 + 1e-12))
    slope = as_matrix(W, N) @ (c - c0)
    downhill = linprog(slope, A_eq=A.T, b_eq=f, bounds=np.stack([-limit, limit], axis=-1))
    assert downhill.status == 0 and downhill.fun > slope @ c - 1e-7 * np.abs(slope) @ limit


@settings
@hypothesis.given(machines(least=3))
def test_least_peak_has_a_witness(drawn):
    """Duality: f^T v <= peak sum_i limit_i |A v|_i for each direction v, with equality for one that a drive resists."""
    robot, _, q, rng = drawn
    limit = rng.uniform(0.05, 0.15, robot.n_arms)
    A, f = rk.control_matrix(robot, q), rng.normal(0.0, 1.0, 2)
    c = rk.minimax_torques(A, f, limit)
    peak = np.max(np.abs(c) / limit)
    assert_allclose(A.T @ c, f, atol=1e-8 * np.abs(f).max())
    still = np.stack([-A[:, 1], A[:, 0]])  # motions under which one drive stands still, the edges of the polygon
    power = np.abs(f @ still) / (limit @ np.abs(A @ still))
    assert_allclose(power.max(), peak, rtol=1e-7)


@settings
@hypothesis.given(machines(), kinds)
def test_torques_at_rest_for_every_gain(drawn, kind):
    """(13), (14): A^T c is the load, and gains and offsets may be scaled against each other."""
    robot, _, q, rng = drawn
    N = robot.n_arms
    K, offset, wrench = gain(kind, N, rng, 7.0), rng.normal(0.0, 5e-3, N), rng.normal(0.0, 1.0, 2)
    A = rk.control_matrix(robot, q)
    c = rk.steady_state_torque(A, K, offset, wrench)
    e = rk.steady_state_error(A, K, offset, wrench)
    size = np.abs(as_matrix(K, N)).max() * (np.abs(offset).max() + np.abs(e).max())
    assert_allclose(A.T @ c, wrench, atol=1e-9 * size * np.abs(A).max())
    assert_allclose(c, -as_matrix(K, N) @ (e + offset), atol=1e-12 * size)
    assert_allclose(rk.null_basis(A).T @ e, 0.0, atol=1e-10 * np.abs(e).max())
    pressed = rk.steady_state_torque(A, K, offset)
    assert_allclose(rk.steady_state_torque(A, 3.0 * np.asarray(K), 2.0 * offset), 6.0 * pressed, atol=1e-11 * size)
    # What only presses does no work on the errors e = -(K^-1 c + offset), which are a motion.
    assert_allclose(pressed @ np.linalg.solve(as_matrix(K, N), pressed), -pressed @ offset, atol=1e-10 * size)


@settings
@hypothesis.given(machines(), kinds)
def test_effective_gain_lies_between_the_gains(drawn, kind):
    """(35): Rayleigh's quotient of K over tangent errors, in any independent coordinates."""
    robot, _, q, rng = drawn
    n = 2 * robot.n_arms
    K = as_matrix(gain(kind, n, rng, 400.0), n)
    low, high = np.linalg.eigvalsh(K)[[0, -1]]
    found = np.linalg.eigvals(rk.effective_gain(rk.orthogonal_complement(robot, q), K))
    assert_allclose(found.imag, 0.0, atol=1e-6 * high)
    assert np.all((found.real > low * (1 - 1e-9)) & (found.real < high * (1 + 1e-9)))
    j = int(rng.integers(robot.n_arms))
    pair = (j, (j + 1) % robot.n_arms)
    hypothesis.assume(abs(np.linalg.det(rk.control_matrix(robot, q)[list(pair)])) > 0.5)
    other = np.linalg.eigvals(rk.effective_gain(rk.orthogonal_complement(robot, q, pair), K))
    assert_allclose(np.sort(other.real), np.sort(found.real), rtol=1e-7)


def laws(robot, kind, rng):
    """Laws with gains at random, and the same for the arms in another order."""
    N = robot.n_arms

    def made(joints=None, arms=None):
        of = lambda value, order: value if order is None else reordered(value, order)  # noqa: E731
        return {
            "PD": rk.PD(of(K_P, arms), of(K_D, arms)),
            "filter": rk.AntagonismFilter(rk.PD(of(K_P, arms), of(K_D, arms)), W=of(W, arms)),
            "commands": rk.CommandFilter(rk.PD(of(K_P, arms), of(K_D, arms))),
            "APD": rk.APD(tip_P, tip_D, None, W=of(W, arms)),
            "CTC": rk.CTC(tip_P, tip_D, None, W=of(W, arms)),
            "redundant": rk.RedundantCTC(of(all_P, joints), of(all_D, joints)),
            "redundant PD": rk.RedundantAPD(of(all_P, joints), of(all_D, joints)),
            "(29)": rk.RedundantCTC(of(some_P, arms), of(some_P / 10, arms)),
        }

    K_P, K_D, W = gain(kind, N, rng, 7.0), gain(kind, N, rng, 0.2), gain(kind, N, rng)
    tip_P, tip_D = gain(kind, 2, rng, 400.0), gain(kind, 2, rng, 40.0)
    all_P, all_D = gain(kind, 2 * N, rng, 100.0), gain(kind, 2 * N, rng, 10.0)
    some_P = gain("diagonal", N, rng, 100.0)
    return made


def state(robot, x, q, rng):
    """A wanted motion, and a state close to it."""
    xd, xdd, qd, qdd = motion(robot, q, rng)
    wanted = rk.Desired(robot.n_arms, x, xd, xdd, q, qd, qdd)
    now = rk.inverse_kinematics(robot, x + rng.normal(0.0, 1e-3, 2))
    rates = rk.orthogonal_complement(robot, now) @ (xd + rng.normal(0.0, 1e-2, 2))
    return wanted, now, rates


@settings
@hypothesis.given(machines(), kinds)
def test_gains_move_with_their_arms(drawn, kind):
    robot, x, q, rng = drawn
    robot = robot.replace(load=0.0)
    N = robot.n_arms
    wanted, now, rates = state(robot, x, q, rng)
    order = rng.permutation(N)
    joints = np.concatenate([order, N + order])
    other = robot.with_arms(order.tolist())
    there = rk.Desired(N, x, wanted.xd, wanted.xdd, *(v[joints] for v in (wanted.q, wanted.qd, wanted.qdd)))
    offset, made = rng.normal(0.0, 5e-3, N), laws(robot, kind, rng)
    for (name, law), moved in zip(made().items(), made(joints, order).values(), strict=True):
        c = law.torque(robot, now, rates, now[:N] + offset, rates[:N], wanted)
        q_a = (now[:N] + offset)[order]
        found = moved.torque(other, now[joints], rates[joints], q_a, rates[order], there)
        assert_allclose(found, c[order], atol=1e-8 * (1 + np.abs(c).max()), err_msg=name)


@settings
@hypothesis.given(machines(), kinds)
def test_without_errors_gains_do_not_matter(drawn, kind):
    """Every law with a model sends the exact torques, (11) with its weights."""
    robot, x, q, rng = drawn
    xd, xdd, qd, qdd = motion(robot, q, rng)
    wanted = rk.Desired(robot.n_arms, x, xd, xdd, q, qd, qdd)
    N = robot.n_arms
    for name, law in laws(robot, kind, rng)().items():
        c = law.torque(robot, q, qd, q[:N], qd[:N], wanted)
        exact = rk.inverse_dynamics(robot, q, qd, qdd, W=getattr(law, "W", None))
        none = name in ("PD", "filter", "commands")
        assert_allclose(c, 0.0 if none else exact, atol=1e-8 * (1 + np.abs(c).max()), err_msg=name)


@settings
@hypothesis.given(machines(), kinds)
def test_computed_torque_makes_the_errors_linear(drawn, kind):
    """(20) in (2): edd + K_D ed + K_P e = 0 at the end-effector, for every gain and weight."""
    robot, x, q, rng = drawn
    N = robot.n_arms
    wanted, now, rates = state(robot, x, q, rng)
    K_P, K_D = gain(kind, 2, rng, 400.0), gain(kind, 2, rng, 40.0)
    law = rk.CTC(K_P, K_D, None, W=gain(kind, N, rng))
    c = law.torque(robot, now, rates, now[:N], rates[:N], wanted)
    qdd = rk.forward_dynamics(robot, now, rates, c)[0]
    F, F_dot = rk.orthogonal_complement(robot, now), rk.orthogonal_complement_dot(robot, now, rates)
    xd = np.linalg.lstsq(F, rates, rcond=None)[0]
    xdd = np.linalg.lstsq(F, qdd - F_dot @ xd, rcond=None)[0]
    e, ed = rk.forward_kinematics(robot, now) - x, xd - wanted.xd
    demanded = wanted.xdd - as_matrix(K_D, 2) @ ed - as_matrix(K_P, 2) @ e
    assert_allclose(xdd, demanded, atol=1e-7 * (1 + np.abs(demanded).max()))


RUNS = hypothesis.settings(settings, max_examples=15)


def released(robot, x, rng, time=1.0):
    """A path that stays at x for 30 ms, and offsets that move the machine."""
    return rk.hold(robot, x, 0.03 * time, dt=1e-3 * time), rng.normal(0.0, 5e-3, robot.n_arms)


@RUNS
@hypothesis.given(machines(), kinds)
def test_a_run_under_pd_balances_its_power(drawn, kind):
    """What the drives do as work is kinetic and potential energy, and their torques are those of (12)."""
    robot, x, q, rng = drawn
    N = robot.n_arms
    stay, offset = released(robot, x, rng)
    K_P, K_D = gain(kind, N, rng, 5.0), gain(kind, N, rng, 0.05)
    run = rk.simulate(robot, rk.PD(K_P, K_D), stay, offset)
    energy = rk.kinetic_energy(robot, run.q, run.qd) + rk.potential_energy(robot, run.q)
    moved = np.abs(run.c[:-1] * np.diff(run.q_a, axis=0)).sum()
    assert_allclose(rk.mechanical_work(run).sum(), energy[-1] - energy[0], atol=1e-7 * moved)
    e = run.q_a + offset - stay.q_a
    c = -e @ as_matrix(K_P, N) - run.qd[:, :N] @ as_matrix(K_D, N)
    assert_allclose(run.c, c, atol=1e-10 * np.abs(c).max())


@RUNS
@hypothesis.given(machines(), kinds)
def test_a_run_has_no_order_of_arms(drawn, kind):
    robot, x, q, rng = drawn
    robot = robot.replace(load=0.0)
    order = rng.permutation(robot.n_arms)
    stay, offset = released(robot, x, rng)
    other = robot.with_arms(order.tolist())
    K_P, K_D = gain(kind, robot.n_arms, rng, 5.0), gain(kind, robot.n_arms, rng, 0.05)
    run = rk.simulate(robot, rk.PD(K_P, K_D), stay, offset)
    law = rk.PD(reordered(K_P, order), reordered(K_D, order))
    moved = rk.simulate(other, law, rk.hold(other, x, 0.03), offset[order])
    assert_allclose(moved.c, run.c[:, order], atol=1e-8 * np.abs(run.c).max())


@RUNS
@hypothesis.given(machines(), kinds, st.sampled_from([0.2, 5.0]), st.sampled_from([0.1, 20.0]))
def test_a_run_scales(drawn, kind, length, mass):
    """Torques scale with m s^2 / t^2, damping with m s^2 / t; angles are the same."""
    robot, x, q, rng = drawn
    time = float(rng.choice([0.5, 1.0, 3.0]))
    big = scaled(robot, length, mass, time)
    unit = mass * length**2 / time**2
    stay, offset = released(robot, x, rng)
    K_P, K_D = gain(kind, robot.n_arms, rng, 5.0), gain(kind, robot.n_arms, rng, 0.05)
    run = rk.simulate(robot, rk.PD(K_P, K_D), stay, offset)
    law = rk.PD(unit * np.asarray(K_P), unit * time * np.asarray(K_D))
    other = rk.simulate(big, law, rk.hold(big, length * x, 0.03 * time, dt=1e-3 * time), offset)
    assert_allclose(other.q, run.q, atol=1e-8)
    assert_allclose(other.c, unit * run.c, atol=1e-7 * unit * np.abs(run.c).max())
