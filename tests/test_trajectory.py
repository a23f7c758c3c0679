"""Paths: geometry, boundary values, derivatives against finite differences."""

import warnings

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from samples import MACHINES, TESTBED

import rapkm_lite as rk
from rapkm_lite.mechanics import sampling


def paths():
    square = [[-0.05, -0.05], [0.05, -0.05], [0.05, 0.05], [-0.05, 0.05]]
    rested = rk.triangle(TESTBED, rest=0.25, angle=0.3, centre=(0.01, 0.02))
    return {
        "triangle": rk.triangle(TESTBED),
        "with rest": rested,
        "circle": rk.circle(TESTBED, 0.09, turns=2),
        "square": rk.polygon(TESTBED, square, 4.0),
        "asymmetric": rk.triangle(MACHINES["asymmetric"], side=0.18),
    }


every_path = pytest.mark.parametrize("path", paths().values(), ids=paths().keys())


def test_angles_that_somebody_computed_are_no_set_points_apart():
    """q, F xd and F xdd + Fdot xd by public functions differ from the path's own by rounding."""
    path = rk.circle(TESTBED, 0.08, 1.0)
    q = rk.inverse_kinematics(TESTBED, path.x)
    F = rk.orthogonal_complement(TESTBED, q)
    qd = np.einsum("kij,kj->ki", F, path.xd)
    F_dot = rk.orthogonal_complement_dot(TESTBED, q, qd)
    qdd = np.einsum("kij,kj->ki", F, path.xdd) + np.einsum("kij,kj->ki", F_dot, path.xd)
    mine = rk.Trajectory(3, path.x, path.xd, path.xdd, q, qd, qdd, t=path.t, robot=TESTBED)
    five_bar = TESTBED.with_arms((0, 1))
    assert_allclose(mine.for_robot(five_bar).q, path.for_robot(five_bar).q, atol=1e-14)
    late = path.with_set_points(path.q_a + [1e-6, 0.0, 0.0])
    with pytest.raises(ValueError, match="as many as the set-points"):
        late.for_robot(five_bar)


def test_samples_belong_to_who_asks():
    """NumPy lets everybody give a read-only array another shape in place: nobody else may meet it."""
    path = rk.hold(TESTBED, [0.0, 0.0], 1.0)
    mine = path[7]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # of newer versions of NumPy
        mine.q_a.shape = (3, 1)
    assert path[7].q_a.shape == (3,) and path[7] == path[7] is not path[7]


def test_half_a_turn_ends_on_the_other_side():
    assert_allclose(rk.circle(TESTBED, 0.05, turns=0.5).x[-1], [-0.05, 0.0], atol=1e-15)


@every_path
def test_rates_are_the_derivatives_of_what_they_belong_to(path):
    # Central differences of order eight; away from the corners, where the third derivative jumps.
    weights = {1: 4 / 5, 2: -1 / 5, 3: 4 / 105, 4: -1 / 280}
    k = np.arange(4, len(path) - 4)
    difference = lambda v: sum(w * (v[k + j] - v[k - j]) for j, w in weights.items()) / path.dt  # noqa: E731
    for value, rate in ((path.x, path.xd), (path.xd, path.xdd), (path.q, path.qd), (path.qd, path.qdd)):
        error = np.abs(difference(value) - rate[k]).max(axis=-1)
        smooth = np.ones(len(k), dtype=bool)
        jumps = np.flatnonzero(np.abs(np.diff(path.xdd, 2, axis=0)).max(axis=-1) > 1e-3 * np.abs(path.xdd).max())
        for j in jumps:
            smooth[max(j - 12, 0) : j + 8] = False
        assert smooth.mean() > 0.9
        assert error[smooth].max() < 1e-7 * np.abs(rate).max()
        assert error.max() < 1e-2 * np.abs(rate).max()


@every_path
def test_joint_rates_are_those_of_the_complement(path):
    """qd = F xd and qdd = F xdd + Fdot xd, (5): a path finds them arm by arm, without F."""
    pose = rk.at(path.robot, path.q, path.qd)
    qd = np.einsum("kij,kj->ki", pose.F, path.xd)
    qdd = np.einsum("kij,kj->ki", pose.F, path.xdd) + np.einsum("kij,kj->ki", pose.F_dot, path.xd)
    assert_allclose(path.qd, qd, rtol=0, atol=1e-14 * np.abs(qd).max())
    assert_allclose(path.qdd, qdd, rtol=0, atol=1e-13 * np.abs(qdd).max())


@every_path
def test_paths_are_closed_and_run_from_rest_to_rest(path):
    assert_allclose(path.x[0], path.x[-1], atol=1e-15)
    for rate in (path.xd, path.xdd, path.qd, path.qdd):
        assert_allclose(rate[[0, -1]], 0, atol=1e-12)
    assert np.abs(rk.loop_constraints(path.robot, path.q)).max() < 1e-15
    assert_allclose(rk.forward_kinematics(path.robot, path.q), path.x, atol=1e-15)
    assert np.abs(np.diff(path.q, axis=0)).max() < 0.02  # continuous, no wrap


def test_triangle_is_the_one_of_the_reference():
    path = rk.triangle(TESTBED)
    assert path.t.shape == (5001,) and path.dt == 1e-3
    corners = 0.24 / np.sqrt(3) * np.array([[-np.sqrt(3) / 2, -0.5], [np.sqrt(3) / 2, -0.5], [0, 1]])
    for corner, time in zip(corners, (0, 5 / 3, 10 / 3), strict=True):
        nearest = np.abs(path.t - time).argmin()
        assert_allclose(path.x[nearest], corner, atol=1e-7)
    length = np.linalg.norm(np.diff(path.x, axis=0), axis=-1).sum()
    assert_allclose(length, 3 * 0.24, rtol=1e-6)
    # Quintic rest to rest: a_max = 10/sqrt(3) s / T^2 = 0.4988 m/s^2.
    assert_allclose(np.linalg.norm(path.xdd, axis=-1).max(), 10 / np.sqrt(3) * 0.24 / (5 / 3) ** 2, rtol=1e-5)
    quarter = rk.triangle(TESTBED, angle=2 * np.pi / 3)
    assert_allclose(quarter.x[0], corners[1], atol=1e-15)


def test_circle_holds_its_radius_and_turns():
    path = rk.circle(TESTBED, 0.1, turns=2, centre=(0.01, 0))
    assert_allclose(np.linalg.norm(path.x - [0.01, 0], axis=-1), 0.1, atol=1e-15)
    angle = np.unwrap(np.arctan2(path.x[:, 1], path.x[:, 0] - 0.01))
    assert_allclose(angle[-1] - angle[0], 4 * np.pi, rtol=1e-12)
    # In five seconds; a quintic is at most 15/8 times as fast as on average.
    assert path.t[-1] == 5.0
    assert_allclose(np.linalg.norm(path.xd, axis=-1).max(), 15 / 8 * 4 * np.pi * 0.1 / 5.0, rtol=1e-12)


def test_rest_is_spent_at_the_first_corner():
    path = rk.triangle(TESTBED, rest=0.25)
    still = (path.t <= 0.25) | (path.t >= 4.75)
    assert_allclose(path.x[still], np.broadcast_to(path.x[0], (still.sum(), 2)), atol=1e-15)
    assert np.abs(path.xd[~still]).max(axis=-1).min() >= 0
    assert_allclose(np.linalg.norm(path.xdd, axis=-1).max(), 10 / np.sqrt(3) * 0.24 / 1.5**2, rtol=1e-5)


def test_hold_stays():
    path = rk.hold(TESTBED, [0.02, 0.01], duration=0.1)
    assert np.all(path.x == [0.02, 0.01]) and not path.qd.any() and not path.qdd.any()


def test_samples_and_other_machines():
    path = rk.triangle(TESTBED, dt=0.01)
    sample = path[17]
    assert_allclose(sample.q_a, path.q_a[17])
    assert_allclose(sample.qd_a, path.qd[17, :3])
    assert_allclose(sample.qdd_a, path.qdd[17, :3])
    rusty = TESTBED.replace(friction=0.1)
    same = path.for_robot(rusty)
    assert path.for_robot(TESTBED) is path and same.robot == rusty and same.q is path.q
    # A run keeps the path that it was given.
    assert rk.simulate(rusty, rk.PD(7.05, 0.225), path).trajectory is path
    other = path.for_robot(MACHINES["asymmetric"])
    assert_allclose(other.x, path.x)
    assert_allclose(rk.forward_kinematics(MACHINES["asymmetric"], other.q), path.x, atol=1e-14)
    assert repr(path) == "Trajectory(501 samples, 5 s, 'testbed')"


def late(path, samples=20):
    """Set-points of a clock that is late."""
    return path.with_set_points(np.concatenate([path.q_a[:1].repeat(samples, 0), path.q_a[:-samples]]))


@pytest.mark.parametrize("dt", [2e-4, 5e-3])
def test_rates_of_set_points_are_their_differences_over_the_sampling_time(dt):
    """Drives that move as fast as in q_a = q_a(0) + w t, at any sampling time."""
    path, w = rk.hold(TESTBED, [0.02, 0.03], 100 * dt, dt), np.array([0.3, -0.2, 0.1])
    moved = path.with_set_points(path.q_a + w * path.t[:, None])
    assert_allclose(moved.qd_a, np.broadcast_to(w, (101, 3)), rtol=0, atol=1e-10)


def test_set_points_stay_as_far_from_the_path_for_another_machine():
    """q - q(x) is kept, q(x) the closed angles: there and back are the set-points, which are those of no x."""
    own, other = MACHINES["asymmetric"], TESTBED
    path, there = rk.circle(own, 0.05, 0.5), rk.circle(other, 0.05, 0.5)
    told = late(path)
    moved = told.for_robot(other)
    assert moved.robot is other and np.array_equal(moved.x, path.x)
    for name in ("q_a", "qd_a"):
        apart = getattr(told, name) - getattr(path, name)
        assert np.abs(apart).max() > 0.1
        assert_allclose(getattr(moved, name) - getattr(there, name), apart, rtol=0, atol=1e-14 * np.abs(told.qd).max())
        assert_allclose(getattr(moved.for_robot(own), name), getattr(told, name), rtol=1e-14, atol=1e-13)
    assert np.array_equal(moved.q[:, 3:], there.q[:, 3:]) and np.array_equal(moved.qdd, there.qdd)
    for side in (0.1, -0.1):  # all angles larger than those of the path, or all smaller
        shifted = path.with_set_points(path.q_a + side, path.qd_a).for_robot(other)
        assert_allclose(shifted.q_a - there.q_a, side, rtol=0, atol=1e-14)
    with pytest.raises(ValueError, match="robot has 4 arms; allowed: 3, as many as the set-points"):
        told.for_robot(MACHINES["four_arms"])


@pytest.mark.parametrize("samples", [2, 7, 300, 501])
def test_angles_of_the_path_are_no_set_points(samples):
    """To the last bit, also of a part of a path and where the path is told its own angles, for any number of arms."""
    path = rk.circle(TESTBED, 0.05, 0.5)
    given = {name: getattr(path, name)[:samples] for name in ("x", "xd", "xdd", "q", "qd", "qdd", "t")}
    part = rk.Trajectory(3, **given, robot=TESTBED)
    for name in ("asymmetric", "four_arms"):
        expected = rk.circle(MACHINES[name], 0.05, 0.5)
        for one in (path, part, part.with_set_points(part.q_a, part.qd_a)):
            found = one.for_robot(MACHINES[name])
            assert all(np.array_equal(getattr(found, k), getattr(expected, k)[: len(one)]) for k in given)


def test_set_points_reach_the_drives_through_a_model_that_is_slightly_wrong():
    """A model that errs by 1e-12 changes a run by as much, not by what a late clock does; in a study, too."""
    robot, law = MACHINES["asymmetric"], rk.PD(30.0, 0.8)
    path = rk.circle(robot, 0.05, 0.5)
    model = robot.replace(lengths=robot.lengths * (1 + 1e-12))
    right, wrong = (rk.simulate(robot, law, late(path), model=each) for each in (None, model))
    assert np.abs(right.x - rk.simulate(robot, law, path).x).max() > 0.02
    assert_allclose(wrong.x, right.x, rtol=0, atol=1e-11)
    assert_allclose(wrong.c, right.c, rtol=0, atol=1e-9)
    study = rk.sweep(robot, law, late(path), np.zeros((2, 3)), model=model)
    assert_allclose(study.energies[0], right.energy, rtol=1e-9)
    with pytest.raises(ValueError, match="robot cannot follow the trajectory: robot has 4 arms; allowed: 3"):
        rk.simulate(MACHINES["four_arms"], law, late(path))


@pytest.mark.parametrize("factor", [0.5, 1.5])
def test_rates_of_another_motion_are_refused(factor):
    path = rk.circle(TESTBED, 0.05, 1.0)
    with pytest.raises(ValueError, match="does not fit x"):
        rk.follow(TESTBED, path.t, path.x, factor * path.xd, path.xdd)


@pytest.mark.parametrize("way", [0.0, 0.3, np.pi / 4, 2.0])
@pytest.mark.parametrize(("factor", "taken"), [(0.895, False), (0.905, True), (1.105, True), (1.115, False)])
def test_rates_may_err_by_a_tenth_of_the_larger_one_of_the_steps_made_and_meant(factor, taken, way):
    """Steps of 1 that are said to be f: |1 - f| <= max(1, f) / 10 is 9/10 <= f <= 10/9, whatever their direction."""
    t, v = np.linspace(0.0, 1.0, 101), 0.06 * np.array([np.cos(way), np.sin(way)])
    given = TESTBED, t, t[:, None] * v, np.tile(factor * v, (101, 1)), np.zeros((101, 2))
    if taken:
        assert_allclose(rk.follow(*given).xd[50], factor * v, rtol=1e-12)
    else:
        with pytest.raises(ValueError, match="does not fit x"):
            rk.follow(*given)


@pytest.mark.parametrize(("factor", "taken"), [(0.49, False), (0.51, True), (1.99, True), (2.01, False)])
def test_accelerations_may_err_by_half_of_the_larger_one_of_the_steps_made_and_meant(factor, taken):
    """Steps of 1 that are said to be f: |1 - f| <= max(1, f) / 2 is 1/2 <= f <= 2."""
    t, a = np.linspace(0.0, 1.0, 101), np.array([0.08, -0.06])
    given = TESTBED, t, np.outer(t**2 / 2, a), np.outer(t, a), np.tile(factor * a, (101, 1))
    if taken:
        assert_allclose(rk.follow(*given).xdd[50], factor * a, rtol=1e-12)
    else:
        with pytest.raises(ValueError, match="does not fit xd"):
            rk.follow(*given)


@pytest.mark.parametrize(("samples", "most"), [(11, 2), (101, 7), (501, 27)])
def test_rates_may_be_wrong_at_two_samples_and_a_twentieth_of_them(samples, most):
    """A run of k samples with thrice the rate makes k + 1 steps wrong: half of it counts at both ends."""
    t = np.linspace(0.0, 1.0, samples)
    for wrong in (most, most + 1):
        xd = np.tile([0.05, 0.0], (samples, 1))
        xd[3 : 3 + wrong - 1] *= 3.0
        given = TESTBED, t, np.outer(t, [0.05, 0.0]), xd, 0.0 * xd
        if wrong == most:
            assert_array_equal(rk.follow(*given).xd, xd)
        else:
            with pytest.raises(ValueError, match=r"xd\[\d+\] = .* does not fit x"):
                rk.follow(*given)


@pytest.mark.parametrize("part", [1, 50, 128])
def test_a_path_is_the_same_in_whatever_parts_it_is_looked_at(part, monkeypatch):
    """Base angles go on from part to part, a part of one sample is one, and an error counts samples from the start."""

    def outside():
        with pytest.raises(ValueError, match=r"^x\[\d+\] = ") as caught:
            rk.circle(TESTBED, 0.1, 0.128, centre=(-0.1, 0.0))
        return str(caught.value)

    whole, words = rk.circle(TESTBED, 0.12, 0.128), outside()
    assert len(whole) == 129 and whole.q_a.min() < -np.pi
    monkeypatch.setattr(sampling, "PART", part)
    path = rk.circle(TESTBED, 0.12, 0.128)
    for name in ("x", "xd", "xdd", "q", "qd", "qdd"):
        assert_allclose(getattr(path, name), getattr(whole, name), rtol=1e-12, atol=1e-12)
    assert outside() == words


@pytest.mark.parametrize("factor", [0.001, -1.0, 1000.0])
def test_accelerations_of_another_motion_are_refused(factor):
    path = rk.circle(TESTBED, 0.05, 1.0)
    with pytest.raises(
        ValueError, match=r"xdd\[\d+\] = .* m/s\^2 does not fit xd: .* allowed: the time derivative of xd"
    ):
        rk.follow(TESTBED, path.t, path.x, path.xd, factor * path.xdd)


def test_rates_by_differences_and_jumps_of_the_speed_are_taken():
    path = rk.circle(TESTBED, 0.05, 1.0)
    # A recorded path, to 0.1 um, and its differences.
    x = path.x + np.random.default_rng(3).normal(0.0, 1e-7, path.x.shape)
    xd = np.gradient(x, 1e-3, axis=0)
    rk.follow(TESTBED, path.t, x, xd, np.gradient(xd, 1e-3, axis=0))
    there_and_back = 0.05 - np.abs(np.outer(0.1 * path.t - 0.05, [1.0, 0.0]))
    speed = np.outer(np.where(path.t < 0.5, 0.1, -0.1), [1.0, 0.0])
    rk.follow(TESTBED, path.t, there_and_back, speed, 0.0 * speed)
    # Laws without a model need no accelerations.
    rk.follow(TESTBED, path.t, path.x, path.xd, 0.0 * path.xdd)


def test_accelerations_that_are_held_between_samples_are_taken():
    rng, dt = np.random.default_rng(4), 1e-3
    pulses = np.concatenate([np.ones(5), np.zeros(11), -np.ones(5), -np.ones(5), np.zeros(11), np.ones(5)])
    for acc in (np.tile(pulses, 10), np.repeat(rng.choice([-1.0, 1.0], 200), 2), rng.choice([-1.0, 1.0], 400)):
        a = np.outer(np.append(acc, 0.0), 1.86 * np.array([0.6, 0.8]))
        v = np.vstack([[0.0, 0.0], np.cumsum(a[:-1] * dt, axis=0)])
        x = np.vstack([[0.0, 0.0], np.cumsum(v[:-1] * dt + a[:-1] * dt * dt / 2, axis=0)])
        rk.follow(TESTBED, np.arange(len(a)) * dt, x, v, a)


def test_rounded_times_are_the_multiples_of_their_step():
    """As a log has them; laws in Python and in the engine are told the same time, and a path made of them is equal."""
    robot, zeros = rk.load(), np.zeros((101, 2))
    path = rk.follow(robot, np.round(np.arange(101) * 1e-3, 6), zeros, zeros, zeros)
    assert_array_equal(path.t, np.arange(101) * path.dt)
    assert_array_equal(rk.follow(robot, path.t, zeros, zeros, zeros).t, path.t)

    def late(t, q_a, qd_a, d):
        c = -7.0 * (q_a - d.q_a) - 0.2 * (qd_a - d.qd_a)
        if t > 0.009:
            c[0] += 0.05
        return c

    runs = [rk.simulate(robot, law, path).c for law in (late, rk.compiled(late))]
    assert_allclose(*runs, atol=1e-12)


def test_times_that_are_not_equidistant_say_where():
    path = rk.circle(TESTBED, 0.05, 1.0, dt=1e-2)
    t = path.t.copy()
    t[50] += 1e-4
    with pytest.raises(
        ValueError, match=r"t\[50\] - t\[49\] = 0.0101 s, on average 0.01 s; allowed: equidistant times"
    ):
        rk.follow(TESTBED, t, path.x, path.xd, path.xdd)


def test_times_that_fall_are_told_what_times_are():
    path = rk.circle(TESTBED, 0.05, 1.0, dt=1e-2)
    with pytest.raises(ValueError, match="allowed: rising, equidistant times that start at 0"):
        rk.follow(TESTBED, np.r_[0.0, 1e-2, -1e-2], path.x[:3], path.xd[:3], path.xdd[:3])


def test_a_desired_motion_has_equal_leading_axes():
    path = rk.circle(TESTBED, 0.05, 1.0, dt=1e-2)
    with pytest.raises(ValueError, match="the leading axes do not fit together"):
        rk.Desired(3, path.x[:5], path.xd[:5], path.xdd[:5], path.q[:4], path.qd[:4], path.qdd[:4])


def test_set_points_on_another_turn_are_refused():
    path = rk.circle(TESTBED, 0.12, 1.0)
    with pytest.raises(ValueError, match=r"q_a = .* rad lies 6.28 rad away from the path; allowed: up to pi"):
        path.with_set_points((path.q_a + np.pi) % (2 * np.pi) - np.pi)
    with pytest.raises(ValueError, match="in rad"):
        path.with_set_points(np.rad2deg(path.q_a))
    with pytest.raises(ValueError, match=r"lies 3\.2 rad away from the path"):
        path.with_set_points(path.q_a - 3.2)
    # It is the path that counts, not the set-points before.
    again = path.with_set_points(path.q_a + 2.0).with_set_points(path.q_a - 2.0)
    assert_allclose(again.q_a, path.q_a - 2.0)


def square(count, radius=0.05):
    """The corners of a regular polygon."""
    angle = 2 * np.pi * np.arange(count) / count
    return radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)


@pytest.mark.parametrize("edges", [2, 3, 4, 7])
@pytest.mark.parametrize("steps", [2.0, 2.25, 3.6])
def test_two_samples_per_edge_show_every_corner_and_the_motion(edges, steps):
    """A quintic has gone 10/4^3 - 15/4^4 + 6/4^5 = 0.104 of its way after a quarter of its time."""
    corners, k = square(edges), round(edges * steps)
    path = rk.polygon(TESTBED, corners, duration=1.0, dt=1.0 / k)
    length = np.linalg.norm(corners[1] - corners[0])
    near = np.linalg.norm(path.x - corners[:, None], axis=-1).min(axis=1)
    assert near.max() <= (10 / 4**3 - 15 / 4**4 + 6 / 4**5) * length * (1 + 1e-9)
    for i in range(edges):
        inside = (path.t > (i + 1e-6) / edges) & (path.t < (i + 1 - 1e-6) / edges)
        assert np.linalg.norm(path.xd[inside], axis=-1).max() > 0.1 * length


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: rk.triangle(TESTBED, 0.1, duration=1.0, dt=1.0), r"dt = 1 s; .* half the time of an edge, .* 0.333"),
        (lambda: rk.triangle(TESTBED, 0.1, duration=1.0, dt=0.5), r"dt = 0\.5 s; allowed: .*, so a shorter dt"),
        (lambda: rk.triangle(TESTBED, 0.1, duration=1.0, dt=0.2), r"dt = 0\.2 s; allowed: up to half the time"),
        (lambda: rk.polygon(TESTBED, square(10_000), 1.0, 0.01), r"\(10000 edges in .* 1 s\), .* or fewer corners"),
        (lambda: rk.triangle(TESTBED, duration=1.0, rest=0.499), r"dt = 0\.001 s; .* 2 rest = 0\.002 s\), .*less rest"),
    ],
)
def test_samples_that_would_miss_a_corner_or_the_motion_are_refused(call, words):
    with pytest.raises(ValueError, match=words):
        call()


@pytest.mark.parametrize("duration", [0.01, 1.0, 100.0])
def test_a_step_fits_a_duration_to_a_part_in_a_milliard(duration):
    """Decimal fractions do so in numbers of the computer, however long or short the path."""
    assert len(rk.hold(TESTBED, [0.0, 0.0], duration, duration / 10 * (1 + 5e-10))) == 11
    with pytest.raises(ValueError, match="allowed: a whole fraction of duration"):
        rk.hold(TESTBED, [0.0, 0.0], duration, duration / 10 * (1 + 2e-9))
