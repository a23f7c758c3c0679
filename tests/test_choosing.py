"""Predictions of lesson 11: poles by linearisation, feed-forward, feedback maps, errors by a wrong model."""

import numpy as np
import pytest

import rapkm_lite as rk
from rapkm_lite.lessons.lesson11 import tasks

ROBOT = rk.load().replace(friction=0.0)
PATH = rk.triangle(ROBOT)
SOME = range(100, 5000, 700)
K_P, K_D = 400.0, 40.0
ON_DRIVES = np.diag([1.0, 1, 1, 0, 0, 0])


def acceleration(law, home, x):
    """Acceleration (2,) of the end-effector, released at rest at x under a law that holds `home`."""
    goal, q = (rk.inverse_kinematics(ROBOT, place) for place in (home, x))
    rest = np.zeros(6)
    point = rk.hold(ROBOT, home, 0.1)[0]
    np.testing.assert_allclose(point.q, goal, atol=1e-12)
    c = law.torque(ROBOT, q, rest, q[:3], rest[:3], point)
    qdd = rk.forward_dynamics(ROBOT, q, rest, c)[0]
    F = rk.orthogonal_complement(ROBOT, q, None)
    return np.linalg.lstsq(F, qdd, rcond=None)[0]


def stiffness(law, home, step=1e-5):
    """Minus the derivative of the acceleration with the place, by central differences, (2, 2) in 1/s^2."""
    columns = [
        (acceleration(law, home, home - step * u) - acceleration(law, home, home + step * u)) / (2 * step)
        for u in np.eye(2)
    ]
    return np.stack(columns, axis=-1)


@pytest.mark.parametrize("law", [rk.CTC(K_P, K_D, None), rk.RedundantCTC(K_P, K_D)], ids=["end-effector", "all joints"])
def test_poles_at_the_end_effector_do_not_depend_on_the_pose(law):
    for k in SOME:
        np.testing.assert_allclose(stiffness(law, PATH.x[k]), K_P * np.eye(2), atol=1e-3 * K_P)


def test_poles_with_gains_on_the_drives_are_those_of_the_effective_gain():
    law = rk.RedundantCTC(np.full(3, K_P), np.full(3, K_D))
    for k in SOME:
        F = rk.orthogonal_complement(ROBOT, PATH.q[k], None)
        np.testing.assert_allclose(stiffness(law, PATH.x[k]), K_P * rk.effective_gain(F, ON_DRIVES), atol=1e-3 * K_P)


def test_share_of_the_gain_along_the_path():
    share = np.linalg.eigvals(rk.effective_gain(rk.orthogonal_complement(ROBOT, PATH.q), ON_DRIVES)).real
    assert share.min() == pytest.approx(0.19, abs=0.005) and share.max() == pytest.approx(0.73, abs=0.005)


def test_frequencies_of_pd_are_those_of_the_released_machine():
    K = np.array([5.0, 7.05, 9.0])
    for k in SOME:
        squares = np.sort(np.linalg.eigvals(stiffness(rk.PD(K, 0.2), PATH.x[k])).real)
        found = 2 * np.pi * tasks.pd_frequencies(ROBOT, PATH.q[k], K)
        np.testing.assert_allclose(found**2, squares, rtol=1e-4)


def test_feed_forward_of_all_laws_agrees_to_rounding():
    laws = [
        rk.APD(7.0, 0.2, None), rk.CTC(K_P, K_D, (0, 1)), rk.SwitchedCTC(K_P, K_D), rk.CTC(K_P, K_D, None),
        rk.RedundantCTC(K_P, K_D), rk.RedundantAPD(7.0, 0.2), rk.RedundantCTC(K_P, K_D, projected=False),
    ]  # fmt: skip
    small = rk.triangle(ROBOT, 0.12, 2.5)
    wanted = rk.inverse_dynamics(ROBOT, small.q, small.qd, small.qdd)
    for law in laws:
        sent = law.torque(ROBOT, small.q, small.qd, small.q_a, small.qd_a, small)
        np.testing.assert_allclose(sent, wanted, atol=1e-12)


def test_feedback_of_a_fixed_pair_grows_as_one_over_the_sine():
    """Towards a singular curve the product of map and |d_j x d_k| tends to a limit, while the map grows without one."""
    cross = np.abs(rk.distal_cross_products(ROBOT, PATH.q))
    pairs = rk.drive_pairs(ROBOT)
    for number, pair in enumerate(pairs):
        sine = cross[:, number]
        near = np.argmin(sine)
        here = [near + step for step in (12, 24, 48)]
        product = [rk.feedback_norm(ROBOT, PATH.q[k], pair) * sine[k] for k in here]
        assert sine[here[2]] / sine[here[0]] > 2.5
        assert max(product) / min(product) < 1.15


def test_slow_error_of_a_wrong_model():
    """Twice the duration: a quarter of the error; what the theory misses is a delay of K_D / K_P = 2 / w.

    The loop e'' + K_D e' + K_P e = K_P theory answers with the mean of the theory over the past, of weights with the
    mean age K_D / K_P, so |e - theory| <= K_D / K_P max |theory'|, an eighth for twice the duration.  On top: a loop
    that the payload makes underdamped (weights of the other sign, below 2 %), half a sample of hold (w dt / 2 = 1.6 %),
    and e over the length of a link (0.1 %); 5 % is room for the three.
    """
    heavy, law = ROBOT.replace(load=0.1), rk.CTC((10 * np.pi) ** 2, 20 * np.pi, None)
    size = []
    for duration in (5.0, 10.0):
        slow = rk.triangle(ROBOT, 0.12, duration)
        error = rk.simulate(heavy, law, slow, model=ROBOT).x - slow.x
        theory = tasks.model_error(heavy, ROBOT, slow.q, slow.qd, slow.xd, slow.xdd, law.K_P)
        size.append(np.abs(theory).max())
        rate = np.abs(np.diff(theory, axis=0)).max(axis=0) / slow.dt
        assert np.all(np.abs(error - theory).max(axis=0) < 1.05 * law.K_D / law.K_P * rate)
    assert size[0] / size[1] == pytest.approx(4, rel=1e-6)


def test_offsets_shift_all_laws_with_a_model_alike():
    """To first order the place is off by A^+ offset, whatever the law; the second order is a few per cent."""
    offset, place = 1e-3 * np.array([4, -2, 5]), np.array([0.01, -0.02])
    hold = rk.hold(ROBOT, place, 2.0)
    shift = -np.linalg.pinv(rk.control_matrix(ROBOT, hold.q[0])) @ offset
    for law in (rk.PD(8.2, 0.5), rk.APD(300.0, 20.0, None), rk.CTC(K_P, K_D, None), rk.RedundantCTC(K_P, K_D)):
        run = rk.simulate(ROBOT, law, hold, offset)
        np.testing.assert_allclose(run.x[-1] - place, shift, atol=0.03 * np.linalg.norm(shift))
