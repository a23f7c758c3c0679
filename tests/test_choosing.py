"""Predictions of lesson 11: poles by linearisation, feed-forward, feedback maps, errors by a wrong model."""

import numpy as np
import pytest
from drawn import scaled
from scipy.optimize import brentq

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


def test_feedback_of_a_pair_on_its_singular_curve_is_huge_and_finite_in_any_unit_of_length():
    """Per feedback in redundant coordinates it has no unit; a grid point on the curve is one of many."""
    ray = np.array([np.cos(5.0), np.sin(5.0)])
    far = brentq(lambda s: rk.distal_cross_products(ROBOT, rk.inverse_kinematics(ROBOT, s * ray))[0], 0.08, 0.14)
    q, ratios = rk.inverse_kinematics(ROBOT, [far * ray, 0.5 * far * ray]), []
    for unit in (1e-2, 1.0, 1e3):
        robot = scaled(ROBOT, unit)
        there, inside = rk.feedback_norm(robot, q, (0, 1)) / rk.feedback_norm(robot, q)
        ratios.append([there, inside])
        alone = rk.feedback_norm(robot, q[0], (0, 1)) / rk.feedback_norm(robot, q[0])
        np.testing.assert_allclose(there, alone, rtol=1e-9)
    assert there > 1e9 and inside < 10.0
    np.testing.assert_allclose(ratios, [ratios[1]] * 3, rtol=1e-9)


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


def test_a_pair_that_is_kept_is_that_of_a_fixed_law_at_the_same_pose():
    law = rk.SwitchedCTC(K_P, K_D, hysteresis=1e6, pose="true")
    path = rk.circle(ROBOT, 0.05, 0.3)
    fixed = law.fixed(law.choose(ROBOT, path.q[0]))
    kept, same = (rk.simulate(ROBOT, one, path, 1e-3 * np.array([4, -2, 5])) for one in (law, fixed))
    np.testing.assert_allclose(kept.c, same.c, atol=1e-12)
    assert kept.switches == 0


def deviating():
    """A pose, rates and measured angles beside a point of the path: (q, qd, q_a, qd_a, desired)."""
    desired = PATH[900]
    rng = np.random.default_rng(28)
    q = rk.inverse_kinematics(ROBOT, desired.x + [4e-3, -3e-3])
    qd = rk.orthogonal_complement(ROBOT, q, None) @ (desired.xd + [0.02, 0.01])
    return q, qd, q[:3] + 1e-3 * rng.normal(size=3), qd[:3] + 1e-2 * rng.normal(size=3), desired


def test_redundant_apd_with_gains_on_the_drives_is_filtered_pd_and_feed_forward():
    """(28) with (29) feeds back what PD sends through the filter (16), for all errors: (A~^T)^+ K e = R K_a e_a."""
    q, qd, _, _, desired = case = deviating()
    pd = rk.PD([7.0, 5, 9], [0.2, 0.3, 0.1]).torque(ROBOT, *case)
    R = rk.antagonism_filter(rk.control_matrix(ROBOT, q))
    assert np.linalg.norm(pd - R @ pd) > 1e-3  # N m; there is something to filter
    G, C, Q = rk.redundant_dynamics(ROBOT, q, qd)
    A_tilde = rk.redundant_control_matrix(ROBOT, q)
    model = rk.explicit_pseudoinverse(A_tilde, (0, 1)) @ (G @ desired.qdd + C @ desired.qd + Q)
    law = rk.RedundantAPD([7.0, 5, 9], [0.2, 0.3, 0.1])
    np.testing.assert_allclose(law.torque(ROBOT, *case), model + R @ pd, atol=1e-12)


@pytest.mark.parametrize("line", [1, 2])
@pytest.mark.parametrize("law", [rk.RedundantAPD, rk.RedundantCTC])
def test_closed_loop_of_each_line_of_28_and_32(law, line):
    """The plant is (22), N_J (G qdd + C qd + Q) = A~^T c, and A~^T (A~^T)^+ = N_J: each line makes an error equation,
    with G and C of the tree in line 2 and with those between projectors in line 1."""
    K_P, K_D = np.array([7.0, 5, 9, 1, 2, 3]), np.array([0.2, 0.3, 0.1, 0.4, 0.2, 0.1])
    q, qd, q_a, qd_a, desired = case = deviating()
    qdd = rk.forward_dynamics(ROBOT, q, qd, law(K_P, K_D, projected=line == 1).torque(ROBOT, *case))[0]
    N = rk.nullspace_projector(ROBOT, q)
    if line == 1:
        G, C, _ = rk.redundant_dynamics(ROBOT, q, qd)
    else:
        G, C = rk.mass_matrix(ROBOT, q), rk.coriolis_matrix(ROBOT, q, qd)
    e, ed = np.r_[q_a, q[3:]] - desired.q, np.r_[qd_a, qd[3:]] - desired.qd
    if law is rk.RedundantAPD:
        left = G @ (qdd - desired.qdd) + C @ (qd - desired.qd) + K_P * e + K_D * ed
    else:
        left = G @ (qdd - desired.qdd + K_P * e + K_D * ed)
    np.testing.assert_allclose(N @ left, 0, atol=1e-11)


@pytest.mark.parametrize("line", [1, 2])
def test_both_lines_of_28_make_the_same_springs(line):
    """What differs is the feed-forward: springs F^T K F at the end-effector in both, with (29) those of PD, A^T K A."""
    K, D = np.array([5.0, 7.05, 9.0]), np.full(3, 0.2)
    for k in SOME:
        inertia = rk.minimal_dynamics(ROBOT, PATH.q[k], np.zeros(6), None)[0]
        F = rk.orthogonal_complement(ROBOT, PATH.q[k], None)
        for gains, rates in ((K, D), (np.r_[K, 1.0, 2.0, 3.0], np.full(6, 0.2))):
            springs = np.linalg.solve(inertia, F.T @ np.diag(np.resize(np.r_[gains, np.zeros(3)], 6)) @ F)
            found = stiffness(rk.RedundantAPD(gains, rates, projected=line == 1), PATH.x[k])
            np.testing.assert_allclose(found, springs, atol=1e-3 * np.abs(springs).max())


def test_second_line_of_32_with_gains_on_the_drives_has_complex_springs():
    """Gbar^-1 F^T G K F, not the effective gain (F^T F)^-1 F^T K F; with one gain on all joints both are that gain."""
    for k in SOME:
        F, G = rk.orthogonal_complement(ROBOT, PATH.q[k], None), rk.mass_matrix(ROBOT, PATH.q[k])
        for gains, chosen in ((np.full(3, K_P), ON_DRIVES), (K_P, np.eye(6))):
            rates = gains * K_D / K_P
            theory = K_P * np.linalg.solve(F.T @ G @ F, F.T @ G @ chosen @ F)
            found = stiffness(rk.RedundantCTC(gains, rates, projected=False), PATH.x[k])
            np.testing.assert_allclose(found, theory, atol=2e-3 * K_P)
    np.testing.assert_allclose(theory, K_P * np.eye(2), atol=1e-9 * K_P)


def test_equal_speed_of_all_laws_at_the_centroid():
    """One number carries a gain in 1/s^2 into the unit of each law; all modes are then equal, as symmetry demands."""
    q = rk.inverse_kinematics(ROBOT, np.zeros(2))
    A, F, G = rk.control_matrix(ROBOT, q), rk.orthogonal_complement(ROBOT, q, None), rk.mass_matrix(ROBOT, q)
    Gbar = F.T @ G @ F

    def carried(springs, drives=()):
        return 2 / np.trace(np.linalg.solve(Gbar, springs)) * K_P * np.ones(drives)

    share = Gbar @ rk.effective_gain(F, ON_DRIVES)
    laws = [
        rk.PD(carried(A.T @ A), 0.2), rk.APD(carried(np.eye(2)), 20.0, None), rk.CTC(K_P, K_D, None),
        rk.RedundantAPD(carried(A.T @ A, 3), np.full(3, 0.2)), rk.RedundantAPD(carried(F.T @ F), 0.2),
        rk.RedundantAPD(carried(A.T @ A, 3), np.full(3, 0.2), projected=False), rk.RedundantCTC(K_P, K_D),
        rk.RedundantCTC(carried(share, 3), np.full(3, K_D)),
    ]  # fmt: skip
    for law in laws:
        np.testing.assert_allclose(stiffness(law, np.zeros(2)), K_P * np.eye(2), atol=1e-3 * K_P)
    second = rk.RedundantCTC(carried(F.T @ G @ ON_DRIVES @ F, 3), np.full(3, K_D), projected=False)
    values = np.linalg.eigvals(stiffness(second, np.zeros(2)))
    np.testing.assert_allclose(values.real, K_P, rtol=1e-3)  # and a turning part that no gain of one number takes away
    assert np.abs(values.imag).min() > 0.1 * K_P
