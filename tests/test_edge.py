"""Near the edge of the workspace, where inertia in end-effector coordinates grows without limit: what joint angles say.

In joint angles nothing is singular where an arm stretches: there SciPy integrates the textbook layer and finds the
instant.  Energies hold everywhere.
"""

import numpy as np
import pytest
from reference import reference
from scipy.integrate import solve_ivp

import rapkm_lite as rk

HEAVY = rk.load().replace(gravity=[0.0, -9.81], load=0.4, friction=0.0)
FOUR = rk.Manipulator(
    base=[[0.25, 0.02], [0.03, 0.22], [-0.24, -0.03], [0.01, -0.26]],
    lengths=[[0.2, 0.24], [0.22, 0.2], [0.21, 0.21], [0.24, 0.19]],
    masses=[0.12, 0.15],
    mode=[1, -1, 1, 1],
    gravity=[0.0, -9.81],
)
IDLE = rk.PD(1e-12, 1e-12)


def stretched(robot, x, c, end=1.0):
    """When the first arm is straight under constant torques c (N,), from rest at x (2,)."""
    N = robot.n_arms

    def rate(t, state):
        q, qd = state[: 2 * N], state[2 * N :]
        qdd, _ = rk.forward_dynamics(robot, q, qd, c)
        # What rounding opens of the loops is closed again, at a rate of 50/s.
        J = rk.constraint_jacobian(robot, q)
        gap = 50.0 * rk.loop_constraints(robot, q) + J @ qd
        return np.concatenate([qd, qdd - 50.0 * np.linalg.pinv(J) @ gap])

    def elbow(t, state):
        return np.min(robot.mode * np.sin(state[N : 2 * N]))

    elbow.terminal = True
    start = np.concatenate([rk.inverse_kinematics(robot, x), np.zeros(2 * N)])
    return solve_ivp(rate, (0.0, end), start, rtol=1e-9, atol=1e-10, events=elbow).t[-1]


def lost(run, *arguments, **options):
    with pytest.raises(rk.SimulationError, match="left the workspace") as caught:
        run(*arguments, **options)
    return caught.value


@pytest.mark.parametrize("friction", [0.0, 4.2e-3])
@pytest.mark.parametrize("robot", [HEAVY, FOUR], ids=["testbed", "four arms"])
def test_a_machine_that_falls_is_lost_in_the_hold_in_which_an_arm_stretches(robot, friction):
    robot, places = robot.replace(friction=friction), [[-0.04, -0.07], [-0.04, 0.09], [0.08, 0.02], [0.0, 0.0]]
    for x in places:
        instant = stretched(robot, x, np.zeros(robot.n_arms))
        for dt in (4e-3, 1e-3, 2e-4):
            path = rk.hold(robot, x, 0.5, dt)
            error = lost(rk.simulate, robot, IDLE, path)
            assert error.time <= instant < error.time + dt * (1 + 1e-3)
            in_python = lost(rk.simulate, robot, lambda t, q_a, qd_a, desired: np.zeros(robot.n_arms), path)
            study = rk.sweep(robot, IDLE, path, np.zeros((2, robot.n_arms)), failed="mask")
            assert in_python.time == error.time and study.failure_time.tolist() == 2 * [error.time]


@pytest.mark.parametrize("robot", [HEAVY, FOUR], ids=["testbed", "four arms"])
def test_no_hold_makes_or_loses_energy_at_the_edge(robot):
    """Held torques do the work c.dq_a, as far as it goes: whatever is left of it is an error of the integration."""
    rng, low = np.random.default_rng(5), []
    for _ in range(60):
        x, c = rng.uniform(-0.08, 0.08, 2), rng.uniform(-0.6, 0.6, robot.n_arms)
        faults, path = rk.TorqueLimit(np.abs(c)), rk.hold(robot, x, 0.4, 2e-3)
        try:
            run = rk.simulate(robot, rk.PD(7.0, 0.2), path, -100.0 * np.sign(c), faults=faults)
        except rk.SimulationError as error:
            run = error.partial
        kinetic = rk.kinetic_energy(robot, run.q, run.qd)
        gain = np.diff(kinetic + rk.potential_energy(robot, run.q))
        work = np.sum(run.c[:-1] * np.diff(run.q_a, axis=0), axis=-1)
        np.testing.assert_allclose(gain, work, rtol=0, atol=1e-6 * kinetic.max())
        low.append(np.abs(np.sin(run.q[-1, robot.n_arms :])).min())
    assert np.median(low) < 0.1, "most runs end at the edge"


@pytest.mark.parametrize(
    "inside, speed, dt, sag",
    [
        (1e-4, 0.5, 5e-4, 0.0),
        (1e-4, 0.5, 1e-3, 0.0),
        (1e-5, 0.1, 1e-3, 0.0),
        (1e-5, 0.0, 1e-2, -0.05),
        (1e-9, 1e-3, 1e-2, 0.0),  # its first steps are a millionth of the hold
        (2e-2, 6.0, 1e-3, 0.0),  # its elbow is bent by 36 degrees, and fast
    ],
)
def test_an_arm_that_leaves_the_edge_takes_no_energy_along(inside, speed, dt, sag):
    """From a place `inside` the reach of the first arm, away from the edge: as stiff as the way there."""
    robot = rk.load().replace(friction=0.0)
    out = robot.base[0] / np.linalg.norm(robot.base[0])
    t = dt * np.arange(5)
    x = robot.base[0] - out * (robot.lengths[0].sum() - inside) + speed * t[:, None] * out
    path = rk.follow(robot, t, x, np.tile(speed * out, (5, 1)), 0.0 * x)
    law = rk.PD(7.05, 0.225)
    for one in (law, lambda t, q_a, qd_a, want: -7.05 * (q_a - want.q_a) - 0.225 * (qd_a - want.qd_a)):
        try:
            run = rk.simulate(robot, one, path, [sag, 0.0, 0.0])
        except rk.SimulationError as error:
            run = error.partial
        kinetic, work = rk.kinetic_energy(robot, run.q, run.qd), np.sum(run.c[:-1] * np.diff(run.q_a, axis=0), axis=-1)
        assert len(work) > 0
        np.testing.assert_allclose(np.diff(kinetic), work, rtol=0, atol=1e-6 * kinetic.max())


@pytest.mark.parametrize("inside, dt, gain", [(2e-3, 8e-3, 15.0), (2e-3, 8e-3, 60.0), (1e-3, 4e-3, 400.0)])
def test_a_machine_that_goes_to_the_edge_is_stopped_before_it_in_both_loops(inside, dt, gain):
    """Left alone it would be lost in its first hold; with its drives it comes back, and takes their work along."""
    robot = rk.load().replace(friction=0.0)
    out = robot.base[0] / np.linalg.norm(robot.base[0])
    x = np.tile(robot.base[0] - out * (robot.lengths[0].sum() - inside), (3, 1))
    path = rk.follow(robot, dt * np.arange(3), x, -0.5 * out * [[1.0], [0.0], [0.0]], 0.0 * x)
    idle = lost(rk.simulate, robot, lambda t, q_a, qd_a, want: np.zeros(3), path)
    assert idle.time == 0.0
    for one in (
        rk.PD(gain, 0.01 * gain),
        lambda t, q_a, qd_a, want: -gain * (q_a - want.q_a) - 0.01 * gain * (qd_a - want.qd_a),
    ):
        run = rk.simulate(robot, one, path, [0.3, 0.0, 0.0])
        kinetic, work = rk.kinetic_energy(robot, run.q, run.qd), np.sum(run.c[:-1] * np.diff(run.q_a, axis=0), axis=-1)
        np.testing.assert_allclose(np.diff(kinetic), work, rtol=0, atol=2e-6 * kinetic.max())


def test_a_run_beside_one_at_the_edge_does_not_feel_it():
    path, offsets = rk.hold(HEAVY, [-0.04, -0.07], 0.1), np.array([[0.0, 0.0, 0.0], [4e-3, -2e-3, 5e-3]])
    weak, firm = rk.PD(1e-12, 1e-12), rk.PD(20.0, 0.5)
    longer = rk.hold(HEAVY, [-0.04, -0.07], 0.3)
    together = rk.sweep(HEAVY, [weak, firm], longer, offsets, failed="mask")
    assert together.failed.tolist() == [True, False]
    alone = rk.sweep(HEAVY, [firm], longer, offsets[1:])
    np.testing.assert_array_equal(together.energies[1], alone.energies[0])
    assert not rk.sweep(HEAVY, [weak], path, offsets[:1], failed="mask").failed.any()


def test_a_run_at_the_edge_is_lost_as_alone_though_those_before_it_are_calm():
    """Looked at where the others are, it would leap over the instant at which its arm is straight, and go on."""
    path = rk.hold(HEAVY, [0.08, 0.02], 0.22)
    alone = lost(rk.simulate, HEAVY, IDLE, path).time
    study = rk.sweep(HEAVY, 3 * [rk.PD(20.0, 0.5)] + [IDLE], path, np.zeros((4, 3)), failed="mask")
    assert study.failed.tolist() == [False, False, False, True] and study.failure_time[3] == alone


def test_friction_of_an_arm_that_is_nearly_straight_is_that_of_a_stiff_solver():
    """Pulled away from the edge, at 0.2 mm, against friction that needs shorter steps than the edge does."""
    robot = rk.load().replace(friction=0.3, friction_velocity=3e-3)
    x = robot.base[0] * (1.0 - (robot.lengths[0].sum() - 2e-4) / np.linalg.norm(robot.base[0]))
    law, path, sag = rk.PD(7.05, 0.225), rk.hold(robot, x, 2e-2, 1e-2), np.array([-0.1, 0.01, 0.0])
    states = reference(robot, law, path, sag, method="LSODA", rtol=1e-12, atol=1e-15)[0]
    np.testing.assert_allclose(rk.simulate(robot, law, path, sag).x, states[:, :2], rtol=0, atol=1e-9)
