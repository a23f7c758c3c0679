"""Symmetries of whole runs and of the load, for machines at random; see tests/drawn.py."""

import hypothesis
import numpy as np
import pytest
from drawn import machines, motion, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

import rapkm_lite as rk

RUNS = hypothesis.settings(settings, max_examples=15)
COUNTS = 4000


class Played:
    """Torques (k, N), one row per sample, whatever is measured."""

    def __init__(self, c):
        self.c, self.k = c, -1

    def __call__(self, t, q_a, qd_a, desired):
        self.k += 1
        return self.c[self.k]


@RUNS
@hypothesis.given(machines())
def test_a_run_without_friction_goes_back_the_way_it_came(drawn):
    """Time reversal: from the end with the opposite velocity, under the same torques in the opposite order."""
    robot, x, _, rng = drawn
    c = rng.normal(0.0, 0.05, (31, robot.n_arms))
    run = rk.simulate(robot, Played(c), rk.hold(robot, x, 0.03))
    speed, t = -run.xd[-1], run.t[:, None]
    line = rk.follow(robot, run.t, run.x[-1] + t * speed, 0 * t + speed, np.zeros((31, 2)))
    back = rk.simulate(robot, Played(np.concatenate([c[29::-1], c[:1]])), line)
    assert_allclose(back.x[::-1], run.x, rtol=0, atol=1e-9)
    assert_allclose(back.qd_a[::-1], -run.qd_a, rtol=0, atol=1e-6 * (1 + np.abs(run.qd_a).max()))
    assert_allclose(rk.mechanical_work(back), -rk.mechanical_work(run), rtol=0, atol=1e-9)


LAWS = {
    "PID": rk.PID(5.0, 20.0, 0.05, limit=0.3),
    "filter": rk.AntagonismFilter(rk.PD(5.0, 0.05)),
    "commands": rk.CommandFilter(rk.PD(5.0, 0.05), pose="true"),
    "end-effector": rk.CTC(400.0, 40.0, None),
    "redundant": rk.RedundantCTC(400.0, 40.0),
    "redundant PD": rk.RedundantAPD(5.0, 0.05, projected=False),
}


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
@RUNS
@hypothesis.given(machines(friction=True), st.sampled_from([-1, 1]))
def test_a_run_is_the_same_in_any_frame_and_order_of_arms(law, drawn, side):
    """Turned by whole counts, shifted, mirrored (side = -1) and renumbered: with model, sensors and all faults."""
    robot, x, _, rng = drawn
    N, angle, shift = robot.n_arms, 2 * np.pi / COUNTS * rng.integers(COUNTS), rng.normal(0.0, 0.3, 2)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]) @ np.diag([1, side])
    order = rng.permutation(N)
    j, k = rng.integers(N, size=2)

    def moved(robot):
        other = robot.with_arms(order.tolist())
        return other.replace(base=other.base @ turn.T + shift, mode=side * other.mode, gravity=turn @ other.gravity)

    def outcome(robot, model, x, order, sign):
        there = np.argsort(order)
        faults = [
            rk.TorqueLimit(limit[order]),
            rk.OffsetJump(there[j], 0.008, sign * 2e-3),
            rk.EncoderDropout(there[k], 0.01, 0.014),
            rk.DeadDrive(there[j], 0.02),
        ]
        sensors = rk.Sensors(sign * offset[order], COUNTS, 2e-3)
        try:
            return rk.simulate(robot, law, rk.hold(robot, x, 0.03), model=model, faults=faults, sensors=sensors)
        except rk.SimulationError as lost:
            return lost.partial

    robot = robot.replace(load=0.0)
    model = robot.replace(lengths=robot.lengths * (1 + rng.normal(0.0, 1e-3, (N, 2))))
    limit, offset = rng.uniform(0.2, 0.5, N), rng.normal(0.0, 3e-3, N)
    run = outcome(robot, model, x, np.arange(N), 1)
    other = outcome(moved(robot), moved(model), turn @ x + shift, order, side)
    assert len(other) == len(run) > 1
    assert_allclose(other.x, run.x @ turn.T + shift, rtol=0, atol=1e-8)
    assert_allclose(other.c, side * run.c[:, order], rtol=0, atol=1e-6 * (1e-3 + np.abs(run.c).max()))
    assert_allclose(other.energy, run.energy[order], rtol=0, atol=1e-6 * (1e-3 + np.abs(run.energy).max()))


@settings
@hypothesis.given(machines(friction=True))
def test_a_load_is_a_mass_at_the_tip_of_any_arm(drawn):
    """The cut tree hangs it on arm 2; in the distal link of another (Steiner) it makes the same closed machine."""
    robot, _, q, rng = drawn
    k, load = rng.integers(robot.n_arms), robot.load
    masses, centers, inertias = robot.masses.copy(), robot.centers.copy(), robot.inertias.copy()
    m, c, tip = masses[k, 1], centers[k, 1], robot.lengths[k, 1]
    masses[k, 1], centers[k, 1] = m + load, (m * c + load * tip) / (m + load)
    inertias[k, 1] += m * (c - centers[k, 1]) ** 2 + load * (tip - centers[k, 1]) ** 2
    other = robot.replace(masses=masses, centers=centers, inertias=inertias, load=0.0)
    _, _, qd, qdd = motion(robot, q, rng)
    for own, there in zip(rk.redundant_dynamics(robot, q, qd), rk.redundant_dynamics(other, q, qd), strict=True):
        own, there = (v if v.ndim == 1 else v @ qd for v in (own, there))
        assert_allclose(there, own, rtol=0, atol=1e-9 * (1 + np.abs(own).max()))
    c = rk.inverse_dynamics(robot, q, qd, qdd)
    assert_allclose(rk.inverse_dynamics(other, q, qd, qdd), c, rtol=0, atol=1e-9 * (1 + np.abs(c).max()))
    assert_allclose(rk.kinetic_energy(other, q, qd), rk.kinetic_energy(robot, q, qd), rtol=1e-12)
