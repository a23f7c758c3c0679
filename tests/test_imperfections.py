"""Predictions of lesson 10: wrong geometry is of first order, what a filter cannot stop, and what breaks a run."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import null_space

import rapkm_lite as rk
from rapkm_lite.lessons.lesson10 import tasks

REAL = rk.load()
DRAWING = REAL.replace(friction=0.0)
X = np.array([0.03, 0.02])
PD = rk.PD(7.05, 0.225)
FILTER = rk.AntagonismFilter(PD)
OFFSET = [4e-3, -2e-3, 5e-3]


def longer(eps, robot=DRAWING):
    return robot.replace(lengths=(1 + eps) * robot.lengths)


def rate_of_angles(robot, x, tip):
    """Base angles (N,) that change when the tips of the arms move by tip (N, 2) in m while their joints stand still.

    A rigid distal link of direction d: d . (tip + (E a) dq) = 0, E the quarter turn, so dq = -d . tip / (a x d).
    """
    a, d = rk.arm_vectors(robot, rk.inverse_kinematics(robot, x))
    return -np.sum(d * tip, axis=-1) / (a[:, 0] * d[:, 1] - a[:, 1] * d[:, 0])


def test_fight_of_wrong_lengths():
    """||c_null|| = K_P |rho|: the runs, the exact contradiction, and the numbers known beforehand to three digits."""
    for eps, known in ((1e-4, 0.864e-3), (1e-3, 8.64e-3), (1e-2, 85.4e-3)):
        run = rk.simulate(longer(eps), PD, rk.hold(DRAWING, X, 2.0), model=DRAWING)
        theory = tasks.geometry_fight(longer(eps), DRAWING, X, 7.05)
        assert_allclose(run.c[-1], theory, rtol=0, atol=1e-9)
        assert_allclose(np.linalg.norm(theory), known, rtol=1e-3)


@pytest.mark.parametrize("what", ["lengths", "base"])
def test_contradiction_has_slope_one_and_the_direction_of_the_null_vector(what):
    """rho = eps eta (eta . delta) + O(eps^2), delta the change of the demanded angles, from rigid distal links."""
    rng = np.random.default_rng(10)
    change = rng.uniform(-1, 1, (3, 2))
    a, d = rk.arm_vectors(DRAWING, rk.inverse_kinematics(DRAWING, X))
    if what == "lengths":
        tip = change[:, :1] * a + change[:, 1:] * d

        def model(eps):
            return DRAWING.replace(lengths=DRAWING.lengths * (1 + eps * change))
    else:
        tip = 0.2 * change

        def model(eps):
            return DRAWING.replace(base=DRAWING.base + eps * tip)

    n = rk.null_vector(DRAWING, rk.inverse_kinematics(DRAWING, X))
    slope = n * (n @ rate_of_angles(DRAWING, X, tip))
    off = []
    for eps in (1e-4, 1e-3):
        rho = tasks.geometry_fight(DRAWING, model(eps), X, 1.0)
        off.append(np.linalg.norm(rho / eps - slope))
    assert off[0] < 1e-3 * np.linalg.norm(slope)
    assert off[1] / off[0] == pytest.approx(10, rel=0.02)  # what is left is of second order


def test_a_drawing_that_is_wrong_as_a_whole_causes_no_fight_in_the_centre():
    """Lengths and base points scaled alike: at the centre of similarity the angles are those of a similar machine."""
    whole = DRAWING.replace(lengths=1.01 * DRAWING.lengths, base=1.01 * DRAWING.base)
    assert_allclose(tasks.geometry_fight(whole, DRAWING, [0.0, 0.0], 7.05), 0.0, atol=1e-12)
    # At x the similar machine stands at 1.01 x, with the same angles.
    assert_allclose(tasks.geometry_fight(whole, DRAWING, X, 7.05), 0.0, atol=1e-9)


def test_a_gain_buys_nothing_but_the_fight():
    """At rest A^T K_P (q - wanted) = 0 whatever the number K_P: the place stays, the torques are proportional."""
    gains = np.array([3.5, 7.0, 14.0])
    laws = [rk.PD(k, 0.225 * np.sqrt(k / 7.05)) for k in gains]
    study = rk.sweep(longer(1e-2), laws, rk.hold(DRAWING, X, 2.0), np.zeros(3), model=DRAWING)
    assert_allclose(study.x_final, study.x_final[[0, 0, 0]], rtol=0, atol=1e-9)
    for law, k in zip(laws, gains, strict=True):
        run = rk.simulate(longer(1e-2), law, rk.hold(DRAWING, X, 2.0), model=DRAWING)
        assert_allclose(run.c[-1] / k, tasks.geometry_fight(longer(1e-2), DRAWING, X, 1.0), rtol=0, atol=1e-9)


@pytest.mark.parametrize("angle", [0.3, 1.5, np.pi / 2])
def test_a_fight_rests_behind_the_filter_only_where_null_vectors_are_at_right_angles(angle):
    """Lesson 10: torques R f with A^T R f = 0 are zero, unless the model's null vector leaves the true one as it is."""
    A = rk.control_matrix(DRAWING, rk.inverse_kinematics(DRAWING, X))
    true, across = np.linalg.qr(A, mode="complete")[0][:, [2, 0]].T
    model = null_space([np.cos(angle) * true + np.sin(angle) * across])  # (3, 2), in the place of A
    resting = 2 - np.linalg.matrix_rank(A.T @ rk.antagonism_filter(model), tol=1e-9)
    assert resting == (1 if angle == np.pi / 2 else 0)


@pytest.mark.parametrize("eps", [1e-3, 1e-2])
def test_filter_leaves_nothing_at_rest_with_a_wrong_model(eps):
    """c = A_model f and A_true^T A_model regular: A_true^T c = 0 only for c = 0."""
    run = rk.simulate(longer(eps), FILTER, rk.hold(DRAWING, X, 2.0), model=DRAWING)
    assert np.abs(run.c[-1]).max() < 1e-8


def test_filter_with_a_wrong_model_in_motion_has_slope_one():
    R = rk.antagonism_filter(rk.control_matrix(DRAWING, rk.inverse_kinematics(DRAWING, X)))

    def share(eps):
        true = rk.control_matrix(longer(eps), rk.inverse_kinematics(longer(eps), X))
        return np.linalg.norm(rk.prestress_projector(true) @ R)

    ratios = [share(10 * eps) / share(eps) / 10 - 1 for eps in (1e-5, 1e-4, 1e-3)]
    assert abs(ratios[0]) < 1e-3
    assert_allclose(np.divide(ratios[1:], ratios[:-1]), 10, rtol=0.1)  # relative to eps, the rest is of first order
    path = rk.triangle(DRAWING)
    runs = [rk.simulate(longer(eps), FILTER, path, model=DRAWING) for eps in (1e-5, 1e-4, 1e-3)]
    # Energy of what still fights: eps^2 (1 + a eps + b eps^2), an integral of squares, so b is of the size of a^2.  The
    # ratios over 100 deviate by 0.9 a eps; extrapolated to eps = 0 they are 1 but for some (a eps)^2.
    energy = np.array([rk.antagonistic_energy(run) for run in runs])
    low, high = energy[1:] / energy[:-1] / 100 - 1
    assert abs(high) < 0.1 and abs(low - (high - low) / 9) < 3 * (high / 0.9) ** 2


def leak(eps, x):
    """Force in N per N m of a prestress along the null vector of the drawing, the true machine at the same place."""
    n = rk.null_vector(DRAWING, rk.inverse_kinematics(DRAWING, x))
    true = rk.control_matrix(longer(eps), rk.inverse_kinematics(longer(eps), x))
    return np.linalg.norm(np.einsum("...ij,...i->...j", true, n), axis=-1)


def test_leaking_prestress():
    path = rk.triangle(DRAWING).x
    assert leak(1e-3, X) == pytest.approx(1.17e-3, rel=5e-3)
    assert leak(1e-3, path).max() == pytest.approx(10.1e-3, rel=5e-3)
    for x in (X, path[::200]):
        assert_allclose(leak(1e-4, x) / leak(1e-5, x), 10, rtol=1e-2)


def test_integral_behind_the_filter_takes_up_the_leak():
    """At rest the integral stands still, A_model^T e = 0: the place does not depend on the prestress."""

    class Amended(rk.Law):
        def __init__(self, mu, K_I):
            self.mu, self.K_I = mu, K_I

        def start(self, model, dt):
            return np.zeros(2)

        def step(self, integral, sample):
            q, _ = sample.pose("measured")
            A, (e, ed) = rk.control_matrix(sample.model, q), sample.errors()
            integral = integral + sample.dt * self.K_I * A.T @ e
            force = A.T @ (7.05 * e + 0.225 * ed) + integral
            return self.mu * rk.null_vector(sample.model, q) - A @ np.linalg.solve(A.T @ A, force), integral

    still = rk.hold(DRAWING, X, 2.0, dt=2e-3)
    moved = []
    for K_I in (0.0, 40.0):
        runs = [rk.simulate(longer(1e-2), Amended(mu, K_I), still, model=DRAWING) for mu in (0.0, 0.3)]
        moved.append(np.linalg.norm(runs[1].x[-1] - runs[0].x[-1]))
    q = rk.inverse_kinematics(longer(1e-2), X)
    A = rk.control_matrix(longer(1e-2), q)
    give = np.linalg.norm(np.linalg.solve(7.05 * A.T @ A, np.eye(2)), 2)  # m/N of PD drives
    assert 1e-6 < moved[0] < 1.1 * 0.3 * leak(1e-2, X) * give
    assert moved[1] < 1e-3 * moved[0]


@pytest.mark.parametrize("x", [(0.0, 0.0), (0.02, 0.05), (-0.12, -0.0693)])
def test_filter_does_not_stop_a_limit_cycle(x):
    """2000 counts, the gains of the chapter: a step of 22 mN m, a band of 8.4; the filter takes the fight only."""
    assert 7.05 * 2 * np.pi / 2000 > 2 * REAL.friction[0]
    press, ripple = [], []
    for law in (PD, FILTER):
        run = rk.simulate(REAL, law, rk.hold(REAL, x, 2.0), OFFSET, encoder=2000)
        press.append(np.abs(rk.antagonistic_torque(run)[-1000:].mean(axis=0)).max())
        ripple.append(run.c[-1000:].std(axis=0).max())
    assert press[0] > 10e-3 and press[1] < 0.05e-3
    half = 7.05 * np.pi / 2000  # a torque that jumps by one step, half of the time, has this deviation
    assert ripple[0] == pytest.approx(half, rel=0.15) and 0.75 * half < ripple[1] < 1.05 * half


def test_gain_one_rests_only_with_sharp_friction():
    for v0, rests in ((1e-2, False), (1e-3, True), (1e-4, True)):
        robot = REAL.replace(friction_velocity=v0)
        law = rk.PD(1.0, 0.225 * np.sqrt(1 / 7.05))
        run = rk.simulate(robot, law, rk.hold(robot, [0.0, 0.0], 3.0), OFFSET, encoder=2000)
        # Friction of this kind creeps: the torques of a machine that rests change by nothing that a count could show.
        assert (np.ptp(run.c[-1000:], axis=0).max() < 1e-3 * 2 * np.pi / 2000) == rests


def test_force_left_is_where_a_linear_programme_ends():
    """The largest f with |fight + A (A^T A)^-1 f u| <= limit, direction by direction, as a linear programme in f."""
    from scipy.optimize import linprog

    A = rk.control_matrix(DRAWING, rk.inverse_kinematics(DRAWING, X))
    fight = tasks.geometry_fight(longer(1e-2), DRAWING, X, 7.05)
    best = []
    for turn in np.linspace(0, 2 * np.pi, 361):
        share = A @ np.linalg.solve(A.T @ A, [np.cos(turn), np.sin(turn)])
        ends = np.concatenate([0.12 - fight, 0.12 + fight])
        best.append(linprog([-1.0], A_ub=np.concatenate([share, -share])[:, None], b_ub=ends).x[0])
    left = tasks.force_left(A, fight, 0.12)
    # The nearest of 361 directions is off by at most half a degree.
    assert left * (1 - 1e-9) <= min(best) <= left / np.cos(np.radians(0.5))
    assert left < 0.65 * tasks.force_left(A, 0 * fight, 0.12)


def test_a_limit_costs_more_while_drives_fight():
    path, law = rk.triangle(DRAWING, duration=3.5), rk.PD(15.0, 0.33)
    shift = []
    for one in (law, rk.AntagonismFilter(law)):
        free = rk.simulate(longer(1e-2), one, path, model=DRAWING)
        cut = rk.simulate(longer(1e-2), one, path, model=DRAWING, faults=rk.TorqueLimit(0.12))
        shift.append(np.linalg.norm(cut.x - free.x, axis=1).max())
    assert shift[0] > 3 * shift[1] > 0


def test_a_silent_encoder_is_worse_than_a_dead_drive():
    """A dead drive gives nothing; a dead encoder makes a healthy drive push against the others."""
    path = rk.triangle(DRAWING, side=0.12, duration=2.5)

    def worst(*faults):
        run = rk.simulate(REAL, FILTER, path, model=DRAWING, faults=faults)
        return np.linalg.norm(run.x - path.x, axis=1).max()

    short, long = (worst(rk.EncoderDropout(0, 0.6, 0.6 + t)) for t in (0.02, 0.1))
    dead = worst(rk.DeadDrive(0, 0.5))
    assert short < 1.05 * worst()
    assert short < long < dead < 20e-3
    with pytest.raises(rk.SimulationError) as lost:
        worst(rk.EncoderDropout(0, 0.6, 9.0))
    assert np.linalg.norm(lost.value.partial.x - path.x[: len(lost.value.partial)], axis=1).max() > 5 * dead


def test_every_limit_of_the_design_forbids_something():
    """The gain of the example survives; half of it errs, three times it ripples, and without filter it costs."""

    def missed(law):
        return {m.what.split(":")[0].split(" dead")[0] for m in tasks.survives(lambda drawing: law) if not m.holds}

    assert not missed(tasks.spare_law(DRAWING))
    assert {"drive 1", "drive 2", "drive 3"} <= missed(rk.AntagonismFilter(rk.PD(9.5, 0.4)))
    assert "ripple at rest" in missed(rk.AntagonismFilter(rk.PD(57.0, 1.0)))
    assert "energy of the healthy triangle" in missed(rk.PD(19.0, 0.55))
