"""Identities of the chapter for machines at random: 2 to 6 arms, any base polygon, lengths within a factor of three."""

import re

import hypothesis
import numpy as np
import pytest
from drawn import machines, motion, scaled, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

import rapkm_lite as rk


@settings
@hypothesis.given(machines(friction=True))
def test_identities(drawn):
    robot, x, q, rng = drawn
    xd, _, qd, qdd = motion(robot, q, rng)
    at = rk.at(robot, q, qd)
    assert_allclose(at.x, x, atol=1e-12)
    assert_allclose(at.J @ at.F, 0.0, atol=1e-11)
    assert_allclose(at.J @ qdd + at.J_dot @ qd, 0.0, atol=1e-9 * np.abs(qdd).max())
    assert_allclose(at.N @ at.N, at.N, atol=1e-12)
    assert_allclose(at.A_tilde.T @ at.A_tilde_T_pinv @ at.N, at.N, atol=1e-9)
    R = rk.antagonism_filter(at.A)
    assert_allclose(at.A.T @ R, at.A.T, atol=1e-9)
    # (11) and (25) are one; what (2) makes of these torques is the motion again.
    c = rk.inverse_dynamics(robot, q, qd, qdd)
    G, C, Q = at.redundant
    assert_allclose(at.A_tilde_T_pinv @ (G @ qdd + C @ qd + Q), c, atol=1e-8 * (1 + np.abs(c).max()))
    assert_allclose(rk.forward_dynamics(robot, q, qd, c)[0], qdd, atol=1e-7 * (1 + np.abs(qdd).max()))


@settings
@hypothesis.given(machines())
def test_the_drives_give_the_power_that_the_energy_takes(drawn):
    robot, _, q, rng = drawn
    _, _, qd, qdd = motion(robot, q, rng)
    power = rk.inverse_dynamics(robot, q, qd, qdd) @ qd[: robot.n_arms]
    at = rk.at(robot, q, qd)
    # d/dt (qd G qd / 2 + V) = qd (G qdd + C qd + Q), since dG/dt - 2 C is skew.
    energy = qd @ (at.G @ qdd + at.C @ qd + at.Q)
    assert_allclose(power, energy, atol=1e-9 * (1 + abs(energy)))


@settings
@hypothesis.given(machines(), st.floats(-3.0, 3.0))
def test_torques_do_not_depend_on_the_frame(drawn, angle):
    robot, x, q, rng = drawn
    _, _, qd, qdd = motion(robot, q, rng)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    moved = robot.replace(base=robot.base @ turn.T + [0.3, -0.2], gravity=turn @ robot.gravity)
    there = rk.inverse_kinematics(moved, turn @ x + [0.3, -0.2])
    c = rk.inverse_dynamics(robot, q, qd, qdd)
    assert_allclose(rk.inverse_dynamics(moved, there, qd, qdd), c, atol=1e-8 * (1 + np.abs(c).max()))


@settings
@hypothesis.given(machines())
def test_arms_have_no_order(drawn):
    robot, _, q, rng = drawn
    _, _, qd, qdd = motion(robot, q, rng)
    N = robot.n_arms
    order = rng.permutation(N)
    joints = np.concatenate([order, N + order])
    other = robot.replace(load=0.0).with_arms(order.tolist())
    c = rk.inverse_dynamics(robot.replace(load=0.0), q, qd, qdd)
    permuted = rk.inverse_dynamics(other, q[joints], qd[joints], qdd[joints])
    assert_allclose(permuted, c[order], atol=1e-8 * (1 + np.abs(c).max()))


@settings
@hypothesis.given(machines(), st.sampled_from([1e-3, 0.1, 7.0, 1e3]), st.sampled_from([1e-3, 20.0]))
def test_length_mass_and_time_scale(drawn, length, mass):
    """The torques of the same motion, s times as large with m times the mass, are m s^2 times as large; ranks stay."""
    robot, x, q, rng = drawn
    _, _, qd, qdd = motion(robot, q, rng)
    big = scaled(robot, length, mass)
    c = rk.inverse_dynamics(robot, q, qd, qdd)
    assert_allclose(
        rk.inverse_dynamics(big, q, qd, qdd), mass * length**2 * c, atol=1e-8 * mass * length**2 * (1 + np.abs(c).max())
    )
    assert rk.degree_of_freedom(big, q) == rk.degree_of_freedom(robot, q) == 2
    assert rk.degree_of_actuation(big, q) == rk.degree_of_actuation(robot, q) == 2


@settings
@hypothesis.given(machines())
def test_twice_as_fast_is_four_times_the_force(drawn):
    robot, _, q, rng = drawn
    _, _, qd, qdd = motion(robot, q, rng)
    rest = rk.inverse_dynamics(robot, q, 0 * qd, 0 * qd)
    c = rk.inverse_dynamics(robot, q, qd, qdd) - rest
    assert_allclose(rk.inverse_dynamics(robot, q, 2 * qd, 4 * qdd) - rest, 4 * c, atol=1e-8 * (1 + np.abs(c).max()))


@settings
@hypothesis.given(machines())
def test_coriolis_matrix_at_stretched_and_folded_arms(drawn):
    """It is defined there: dG/dt - 2 C is skew, and a stretched arm (sin = 0) has no Coriolis forces."""
    robot, _, q, rng = drawn
    N = robot.n_arms
    q = q.copy()
    q[N:] = rng.choice([0.0, np.pi], N)
    qd = rng.normal(0.0, 2.0, 2 * N)
    assert_allclose(rk.coriolis_matrix(robot, q, qd), 0.0, atol=1e-15)
    q[N] = 0.5
    h = 1e-6
    G_dot = (rk.mass_matrix(robot, q + h * qd) - rk.mass_matrix(robot, q - h * qd)) / (2 * h)
    skew = G_dot - 2 * rk.coriolis_matrix(robot, q, qd)
    assert_allclose(skew, -skew.T, atol=1e-8)
    assert np.abs(rk.coriolis_matrix(robot, q, qd)).max() > 0.0


@settings
@hypothesis.given(machines())
def test_feedback_norm_is_what_the_definition_says(drawn):
    """The largest torque for a unit feedback acceleration, in redundant coordinates and for a pair."""
    robot, _, q, rng = drawn
    at = rk.at(robot, q, 0 * q)
    redundant = np.linalg.pinv(at.A_tilde.mT, rcond=1e-9) @ at.redundant[0]
    size = rk.feedback_norm(robot, q)
    directions = np.linalg.svd(redundant)[2]
    assert size > 0.0
    assert_allclose(size, np.linalg.norm(redundant @ directions[0]), rtol=1e-7)
    assert_allclose(rk.feedback_norm(robot, np.stack([q, q])), [size, size], rtol=1e-12)  # many poses are many answers
    pair = (0, 1)
    hypothesis.assume(abs(np.linalg.det(at.A[list(pair)])) > 1e-3)
    chosen = at.using(pair)
    M = rk.weighted_pseudoinverse(chosen.A) @ chosen.minimal[0]
    size = rk.feedback_norm(robot, q, pair)
    assert_allclose(size, np.linalg.norm(M, 2), rtol=1e-6)
    for count in (2, 3):
        assert_allclose(rk.feedback_norm(robot, np.stack([q] * count), pair), [size] * count, rtol=1e-12)


def test_close_loops_is_limited_in_its_steps():
    """Half a radian per step at most: from far off, one step cannot do."""
    robot = rk.load()
    q = rk.inverse_kinematics(robot, [0.02, 0.05])
    far = q + np.array([0.6, -0.5, 0.4, 0.5, 0.6, -0.4])
    for steps in (1, 2):
        with pytest.raises(rk.ConvergenceError) as caught:
            rk.close_loops(robot, far, iterations=steps)
        stopped = re.search(r"m at \[(.*?)\]", str(caught.value))
        assert stopped is not None
        way = np.linalg.norm(np.fromstring(stopped[1], sep=",") - far)
        assert way <= 0.5 * steps + 1e-5 and (steps > 1 or way > 0.5 - 1e-5)
    near = rk.close_loops(robot, far, iterations=100)
    assert np.abs(rk.loop_constraints(robot, near)).max() < 1e-12
    assert np.linalg.norm(near - far) <= np.linalg.norm(q - far) + 1e-9  # nearest: no farther than one that is known
