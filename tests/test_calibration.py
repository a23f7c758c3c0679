"""Self-calibration: made-up truths found again, logs with hidden offsets, ranks by counting, refusals, bad logs."""

import copy
import pickle
import re
from itertools import permutations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from samples import FRICTIONLESS, MACHINES, TESTBED, random_points
from scipy.optimize import curve_fit

import rapkm_lite as rk
from rapkm_lite.lessons.mystery import hidden
from rapkm_lite.mechanics.encoders import (
    _crossings,
    _fit,
    cautions,
    certain,
    changed,
    closure,
    gauge,
    poses,
    rounding,
    unknown_names,
)
from rapkm_lite.mechanics.rests import Gain, Rests, angles_of_torques, fitted_gain, one_sided, rests

OFFSET = np.array([4e-3, -2e-3, 5e-3, 1e-3])
NAMES = ("testbed", "four_arms")


def readings(robot, count=40, seed=3, bend=0.3):
    """Base angles (count, N) of a machine with offsets, at random places."""
    x = random_points(robot, count, seed, bend)
    return rk.inverse_kinematics(robot, x)[:, : robot.n_arms] + OFFSET[: robot.n_arms]


def disturbed(robot, seed=0):
    rng = np.random.default_rng(seed)
    lengths = robot.lengths + rng.normal(0, 2e-4, robot.lengths.shape)
    return robot.replace(lengths=lengths), lengths


@pytest.mark.parametrize("name", NAMES)
def test_offsets_are_found_exactly(name):
    robot = MACHINES[name]
    found = rk.calibrate(robot, readings(robot))
    assert_allclose(found.offset, OFFSET[: robot.n_arms], rtol=0, atol=1e-14)
    assert found.rank == robot.n_arms and found.residual < 1e-14 and found.corrected == robot


@pytest.mark.parametrize("name", NAMES)
def test_lengths_are_found_exactly(name):
    robot = MACHINES[name]
    true, lengths = disturbed(robot)
    found = rk.calibrate(robot, readings(true), "offsets+lengths")
    assert_allclose(found.offset, OFFSET[: robot.n_arms], rtol=0, atol=1e-12)
    assert_allclose(found.corrected.lengths, lengths, rtol=0, atol=1e-12)
    assert found.rank == 3 * robot.n_arms and found.unseen == ()


@pytest.mark.parametrize("unknowns", ["offsets+lengths", "all"])
def test_angles_know_no_masses(unknowns):
    """Closure is kinematics: a machine with its masses at the outer joints of links, some too long, is found alike."""
    true, _ = disturbed(TESTBED)
    heavy = TESTBED.replace(centers=TESTBED.lengths, inertias=1e-4)
    found, again = (rk.calibrate(robot, readings(true), unknowns) for robot in (TESTBED, heavy))
    assert np.any(found.lengths < heavy.centers)
    np.testing.assert_array_equal(again.estimate, found.estimate)
    assert np.all(again.corrected.centers == np.minimum(heavy.centers, found.lengths))


@pytest.mark.parametrize("name", NAMES)
def test_base_points_are_found_but_for_a_similarity_of_the_plane(name):
    robot = MACHINES[name]
    true, _ = disturbed(robot)
    true = true.replace(base=true.base + np.random.default_rng(5).normal(0, 2e-4, true.base.shape))
    found = rk.calibrate(robot, readings(true), "all")
    N = robot.n_arms
    assert "translation y of the whole machine are held: no reading shows them" in found.note
    assert found.rank == 5 * N - 4 and found.unseen == ("scale", "rotation", "translation x", "translation y")
    # Ratios of lengths, and differences of offsets, do not change with scale, rotation and translation.
    sides = lambda base: np.linalg.norm(base[:, None] - base, axis=-1)  # noqa: E731
    scale = sides(found.base).max() / sides(true.base).max()
    assert_allclose(sides(found.base), scale * sides(true.base), rtol=0, atol=1e-11)
    assert_allclose(found.lengths, scale * true.lengths, rtol=0, atol=1e-11)
    assert_allclose(np.diff(found.offset), np.diff(OFFSET[:N]), rtol=0, atol=1e-10)


# Two assemblies fit the readings at the place DOUBTFUL about equally well, until the lengths are known.
UNEVEN = rk.Manipulator(
    base=[[0.17163012, 0.04518794], [-0.03682789, 0.2946983], [-0.20337257, -0.23649425]],
    lengths=[[0.23279629, 0.24753959], [0.225235, 0.27220869], [0.25790243, 0.16032862]],
    masses=0.1,
)
BUILT = UNEVEN.replace(lengths=[[0.2326495, 0.24755329], [0.22532782, 0.27213689], [0.25778293, 0.16052578]])
DOUBTFUL, UNEVEN_OFFSET = [0.08396742, -0.15468512], np.array([-0.00108325, 0.0025305, -0.00060771])


def uneven_readings(count):
    """Noise-free base angles (count + 1, 3) at places where the arms bend, and at the doubtful one."""
    x = np.vstack([random_points(UNEVEN, count, seed=1, bend=0.3), DOUBTFUL])
    return rk.inverse_kinematics(BUILT, x)[:, :3] + UNEVEN_OFFSET


@pytest.mark.parametrize("count", [12, 24, 95])
def test_one_place_on_the_other_assembly_does_not_bend_the_offsets(count):
    """Noise-free recovery; the place starts 0.16 m off, where the nominal machine fits its readings better."""
    angles = uneven_readings(count)
    sure, x = certain(UNEVEN, angles)
    assert np.linalg.norm(x[-1] - DOUBTFUL) > 0.1
    assert not sure[-1] and sure.sum() > 0.7 * count
    found = rk.calibrate(UNEVEN, angles, "offsets+lengths")
    assert_allclose(found.offset, UNEVEN_OFFSET, rtol=0, atol=1e-9)
    assert_allclose(found.lengths, BUILT.lengths, rtol=0, atol=1e-9)
    assert found.residual < 1e-12


@pytest.mark.parametrize("name", NAMES)
def test_a_reading_is_certain_where_a_second_assembly_fits_worse_than_2N_minus_3_times_the_worst(name):
    """Exact readings at places near a second crossing of their circles, and others e n apart, n^T A = 0, |n| = 1, of
    which the misfit e^2 is known to first order."""
    robot = MACHINES[name]
    N = robot.n_arms
    x = random_points(robot, 200, seed=2, bend=0.1)
    q = rk.inverse_kinematics(robot, np.vstack([x, [0.0, 0.0]]))
    crossed = _crossings(robot, q[:-1, :N])
    fit = _fit(robot, q[:-1, :N], crossed)
    second = np.where(np.linalg.norm(crossed - x, axis=-1) > 1e-3, fit, np.inf).min(axis=0)
    n = np.linalg.svd(rk.at(robot, q[-1]).A)[0][:, -1]
    for k in np.argsort(second)[:8]:
        for times in (1.5, 1.0 / 1.5):
            wrong = np.sqrt(second[k] / (2 * N - 3) / times)
            assert certain(robot, np.array([q[k, :N], q[-1, :N] + wrong * n]))[0][0] == (times > 1.0)


@pytest.mark.parametrize("off", [0.7, 1.5, -1.5, 1.6, -1.6])
def test_a_place_fits_readings_that_are_off_by_up_to_a_quarter_of_a_turn(off):
    x = np.array([[0.02, 0.03]])
    angles = rk.inverse_kinematics(TESTBED, x)[:, :3] + [0.0, off, 0.0]
    assert_allclose(_fit(TESTBED, angles, x), off**2 if abs(off) < np.pi / 2 else np.inf, rtol=1e-12)


def test_centres_in_the_middle_of_links_stay_there():
    lengths = 1.01 * TESTBED.lengths
    other = changed(TESTBED, np.concatenate([np.zeros(3), lengths.ravel()]))
    assert_allclose(other.centers, lengths / 2, rtol=1e-15)


def test_names_of_the_unknowns_follow_their_vector():
    """Offsets (N,), lengths (2N,) arm by arm and base points (2N,); in words, drives count from one."""
    names = unknown_names(3)
    assert names[:4] == ("offset 1", "offset 2", "offset 3", "length proximal 1") and len(names) == 15
    assert names[8:11] == ("length distal 3", "base x 1", "base y 1") and names[-1] == "base y 3"


def test_an_assembly_is_chosen_again_with_the_guess_that_it_belongs_to():
    """On the machine as built, the true assembly fits without residuals, whatever place was held before."""
    angles = uneven_readings(12) - UNEVEN_OFFSET
    wrong = rk.at(UNEVEN, poses(UNEVEN, angles + UNEVEN_OFFSET)).x
    assert_allclose(rk.at(BUILT, poses(BUILT, angles, wrong)).x[-1], DOUBTFUL, rtol=0, atol=1e-12)


@pytest.mark.parametrize(("robot", "given"), [(UNEVEN, uneven_readings(24)), (MACHINES["four_arms"], None)])
def test_the_numbers_of_the_arms_do_not_matter(robot, given):
    """Symmetry: permuted arms have permuted offsets, and the same residual, without noise and with it."""
    N = robot.n_arms
    given = (
        readings(robot, 24, bend=0.15) + np.random.default_rng(2).normal(0, 1e-5, (24, N)) if given is None else given
    )
    found = rk.calibrate(robot, given)
    for order in map(list, permutations(range(N))):
        changes = {"base": robot.base[order], "lengths": robot.lengths[order], "mode": robot.mode[order]}
        again = rk.calibrate(robot.replace(**changes), given[:, order])
        assert_allclose(again.offset, found.offset[order], rtol=0, atol=1e-12)
        assert_allclose(again.residual, found.residual, rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", ["testbed", "asymmetric", "four_arms"])
def test_a_place_where_one_pair_crosses_badly_is_found_by_another(name):
    """Noise-free recovery from places in the whole workspace, of which some lie near a pair's singularity."""
    robot = MACHINES[name]
    N, rng = robot.n_arms, np.random.default_rng(0)
    for seed in range(12):
        offset = rng.uniform(-5e-3, 5e-3, N)
        x = random_points(robot, 30, seed, bend=0.15)
        found = rk.calibrate(robot, rk.inverse_kinematics(robot, x)[:, :N] + offset)
        assert_allclose(found.offset, offset, rtol=0, atol=1e-12)


def test_five_places_of_four_arms_of_which_arms_1_and_2_hardly_reach_one():
    robot, offset = MACHINES["four_arms"], np.array([5e-3, 5e-3, -5e-3, -5e-3])
    x, y, inside = rk.workspace_grid(robot, 60)
    grid = np.stack(np.meshgrid(x, y), axis=-1)[inside]
    # Of all places the one nearest to where this was seen: the circles of arms 1 and 2 touch there, almost.
    last = grid[np.argmin(np.linalg.norm(grid - [0.0807, -0.1756], axis=-1))]
    places = [[0.0, 0.0], [0.1, 0.05], [-0.1, 0.02], [0.03, -0.12], last]
    found = rk.calibrate(robot, rk.inverse_kinematics(robot, places)[:, :4] + offset)
    assert_allclose(found.offset, offset, rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", NAMES)
def test_crossings_are_a_distal_link_away_from_both_elbows(name):
    """Their definition, and d_i x d_j of the first half above zero, of the second below."""
    robot = MACHINES[name]
    angles = readings(robot)
    elbow = robot.base + robot.lengths[:, :1] * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    i, j = np.triu_indices(robot.n_arms, 1)
    x = _crossings(robot, angles).reshape(2, len(i), len(angles), 2)
    meet = np.linalg.norm(elbow[:, i] - elbow[:, j], axis=-1).T < robot.lengths[i, 1, None] + robot.lengths[j, 1, None]
    d_i, d_j = (x - elbow[:, arm].swapaxes(0, 1) for arm in (i, j))
    for arm, d in ((i, d_i), (j, d_j)):
        far = np.linalg.norm(d, axis=-1) - robot.lengths[arm, 1, None]
        assert np.abs(far[:, meet]).max() < 1e-14
    turn = d_i[..., 0] * d_j[..., 1] - d_i[..., 1] * d_j[..., 0]
    assert np.all(turn[0][meet] > 0) and np.all(turn[1][meet] < 0)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("unknowns", ["offsets", "offsets+lengths"])
def test_a_log_is_refused_where_one_reading_of_many_fits_no_pose(name, unknowns):
    """All proximal links point outwards: no two distal links meet."""
    robot = MACHINES[name]
    outward = np.arctan2(robot.base[:, 1], robot.base[:, 0])
    with pytest.raises(ValueError, match="log holds angles that fit no pose of"):
        rk.calibrate(robot, np.vstack([readings(robot), outward]), unknowns)


def test_intervals_are_those_of_a_normal_distribution():
    rough = readings(TESTBED) + np.random.default_rng(1).normal(0.0, 1e-3, readings(TESTBED).shape)
    found = rk.calibrate(TESTBED, rough, noise=1e-4)  # what is given counts, also where the residual is larger
    assert found.freedom == np.inf and found.residual > 2e-4
    sigma = np.sqrt(np.diagonal(found.covariance))
    for given, width in (((), 1.959964), ((0.5,), 0.674490), ((0.6826895,), 1.0)):  # tables of the normal distribution
        assert_allclose(found.interval(*given), found.estimate + width * np.array([-sigma, sigma]), rtol=0, atol=1e-9)


@pytest.mark.parametrize(("name", "ranks"), [("testbed", (3, 9, 11)), ("four_arms", (4, 12, 16))])
def test_ranks(name, ranks):
    """N offsets and 2N lengths are seen, of all 5N unknowns all but a similarity of the plane (reference values)."""
    robot = MACHINES[name]
    q = rk.inverse_kinematics(robot, random_points(robot, 60, bend=0.3))
    for unknowns, rank in zip((1, 3, 5), ranks, strict=True):
        _, rows = closure(rk.at(robot, q), q[:, : robot.n_arms], unknowns * robot.n_arms)
        assert np.linalg.matrix_rank(rows, tol=1e-9) == rank


def test_equations_are_the_derivative_of_the_closure():
    robot = MACHINES["asymmetric"]
    N, angles = robot.n_arms, readings(robot, 5)
    angles = angles - OFFSET[:N]
    _, rows = closure(rk.at(robot, poses(robot, angles)), angles, 5 * N)
    for k in range(5 * N):
        values = []
        for step in (1e-6, -1e-6):
            p = np.concatenate([np.zeros(N), robot.lengths.ravel(), robot.base.ravel()])
            p[k] += step
            changed = robot.replace(lengths=p[N : 3 * N].reshape(N, 2), base=p[3 * N :].reshape(N, 2))
            moved = angles - p[:N]
            values.append(closure(rk.at(changed, poses(changed, moved)), moved, 0)[0])
        assert_allclose((values[0] - values[1]) / 2e-6, rows[:, k], rtol=0, atol=1e-7)


@pytest.mark.parametrize(
    ("name", "by_angles", "by_torques"),
    [("offset_a", 0.01, 0.1), ("offset_b", 0.01, 0.1), ("gain", 0.01, 0.1)],
)
def test_mystery_logs(name, by_angles, by_torques):
    """Bounds in mrad: the roundings and the noise of the files, of which reference tables quote 0.007 and 0.08."""
    log, (offset, gains) = rk.mystery_run(name), hidden(name)
    assert np.abs(rk.calibrate(TESTBED, log).offset - offset).max() < 1e-3 * by_angles
    found = rk.calibrate(TESTBED, log, use="torques")
    assert np.abs(found.offset - offset).max() < 1e-3 * by_torques
    assert_allclose(found.K_P, gains, rtol=0.02)


def test_places_close_together_are_said_and_cost_accuracy():
    near, far = (rk.calibrate(TESTBED, rk.mystery_run(name)) for name in ("offset_b", "offset_a"))
    assert "close together" in near.note and "close together" not in far.note
    assert near.condition > 5 * far.condition
    assert np.abs(near.offset - hidden("offset_b")[0]).max() < 1e-5


def test_one_place_is_refused_with_what_it_does_say():
    with pytest.raises(rk.CalibrationError, match="determines 1 of 3 unknowns") as caught:
        rk.calibrate(TESTBED, rk.mystery_run("offset_c"))
    error = caught.value
    assert error.rank == 1 and error.needed == 3
    # The sentence tells the same numbers, but for what prints as nothing.
    said = re.findall(r"([+-]\d\.\d{3}) offset (\d)", str(error))
    assert said == [(f"{c:+.3f}", str(i + 1)) for i, c in enumerate(error.known[0]) if round(abs(c), 3) > 0.0]
    assert error.known[0, np.abs(error.known[0]).argmax()] > 0.0
    # One number is known, to second order in offsets of some milliradians.
    assert_allclose(error.known @ hidden("offset_c")[0], error.value, rtol=0, atol=2e-4)


@pytest.mark.parametrize("unknowns", ["offsets", "offsets+lengths", "all"])
def test_what_is_known_of_lengths_is_said_to_be_of_their_changes(unknowns):
    change = np.array([[3e-4, 0.0], [0.0, -2e-4], [1e-4, 2e-4]]) * (unknowns != "offsets")
    machine = TESTBED.replace(lengths=TESTBED.lengths + change)
    q_a = rk.inverse_kinematics(machine, [[0.03, -0.04], [0.05, 0.02]][: 1 if unknowns == "offsets" else 2])[:, :3]
    with pytest.raises(rk.CalibrationError) as caught:
        rk.calibrate(TESTBED, q_a + OFFSET[:3] / 10, unknowns)
    truth = np.concatenate([OFFSET[:3] / 10, change.ravel(), np.zeros(6)])[: caught.value.known.shape[1]]
    assert_allclose(caught.value.value, caught.value.known @ truth, rtol=0, atol=1e-6)
    assert (", geometry as changes from nominal: " in str(caught.value)) == (unknowns != "offsets")


def test_a_calibration_prints_its_offsets_in_mrad():
    found = rk.calibrate(TESTBED, rk.mystery_run("offset_a"))
    said = re.search(r"offset \[(.*)\] mrad, rank 3", repr(found)).group(1)
    assert_allclose([float(number) for number in said.split(",")], 1e3 * found.offset, rtol=1e-3)


def test_what_is_known_of_one_place_is_exact_to_second_order():
    q_a = rk.inverse_kinematics(TESTBED, [0.03, -0.04])[:3]
    gaps = []
    for offset in (OFFSET[:3], OFFSET[:3] / 2):
        with pytest.raises(rk.CalibrationError) as caught:
            rk.calibrate(TESTBED, [q_a + offset])
        gaps.append(abs((caught.value.known @ offset - caught.value.value)[0]))
    assert gaps[0] / gaps[1] > 3.5


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("unknowns", ["offsets+lengths", "all"])
def test_places_a_hair_apart_are_refused_with_what_a_plane_through_them_says(name, unknowns):
    """Of rows that are smooth in the place, 10 um tell the value and the two slopes, (N - 2) of each: curvature is
    some 1e-10 of them, which is rounding."""
    robot = MACHINES[name]
    x = np.array([0.03, 0.02]) + np.random.default_rng(0).uniform(-1e-5, 1e-5, (40, 2))
    q_a = rk.inverse_kinematics(robot, x)[:, : robot.n_arms] + OFFSET[: robot.n_arms]
    with pytest.raises(rk.CalibrationError) as refused:
        rk.calibrate(robot, q_a, unknowns)
    assert refused.value.rank == 3 * (robot.n_arms - 2)


def test_noise_at_one_place_is_no_information():
    rng = np.random.default_rng(2)
    q_a = rk.inverse_kinematics(TESTBED, [0.03, -0.04])[:3] + OFFSET[:3]
    with pytest.raises(rk.CalibrationError, match="determines 1 of 3"):
        rk.calibrate(TESTBED, q_a + rng.normal(0, 1e-4, (500, 3)))


def test_a_wrong_gain_is_named_and_biases_the_torque_way():
    log = rk.mystery_run("gain")
    found = rk.calibrate(TESTBED, log, use="torques", K_P=7.05)
    assert "K_P = 4.01 N m/rad for drive 1, not 7.05" in found.note
    assert 1e-3 < np.abs(found.offset - hidden("gain")[0]).max() < 2e-3


def test_covariance_is_that_of_a_hundred_repetitions():
    rng, exact = np.random.default_rng(8), readings(TESTBED, 30)
    noise = 1e-5
    found = [rk.calibrate(TESTBED, exact + rng.normal(0, noise, exact.shape), noise=noise) for _ in range(100)]
    estimates = np.array([c.offset for c in found])
    # A variance from 100 draws has a relative standard deviation of sqrt(2 / 99) = 0.14.
    ratio = np.var(estimates, axis=0, ddof=1) / np.diagonal(found[0].covariance)
    assert np.all(np.abs(ratio - 1) < 4 * 0.142)
    low, high = np.array([c.interval(0.9) for c in found]).swapaxes(0, 1)
    inside = np.mean((low < OFFSET[:3]) & (OFFSET[:3] < high))
    assert abs(inside - 0.9) < 4 * np.sqrt(0.09 / 300)


@pytest.mark.parametrize("count", [4, 5])
def test_intervals_from_few_poses_cover_what_they_say(count):
    """The noise is estimated from one or two spare readings: Student's t; three offsets of one draw count as one."""
    x = np.array([[0.06, 0.03], [-0.05, 0.05], [0.01, -0.08], [0.0, 0.02], [0.07, -0.04]])[:count]
    exact, rng, draws = rk.inverse_kinematics(TESTBED, x)[:, :3] + OFFSET[:3], np.random.default_rng(9), 300
    found = [rk.calibrate(TESTBED, exact + rng.normal(0, 1e-5, exact.shape)) for _ in range(draws)]
    assert {c.freedom for c in found} == {count - 3}
    for level in (0.5, 0.9, 0.95):
        low, high = np.array([c.interval(level) for c in found]).swapaxes(0, 1)
        inside = np.mean((low < OFFSET[:3]) & (OFFSET[:3] < high), axis=0)
        assert np.all(np.abs(inside - level) < 4 * np.sqrt(level * (1 - level) / draws))


@pytest.mark.parametrize("count", [4000, 20000])
def test_intervals_from_torques_know_that_encoders_count(count):
    covered, step = [], 2 * np.pi / count
    for seed in range(12):
        rng = np.random.default_rng(seed)
        offset, logs = rng.uniform(-6e-3, 6e-3, 3), []
        for place in rng.uniform(-0.09, 0.09, (4, 2)):
            path = rk.hold(TESTBED, place, 1.0, 5e-3)
            run = rk.simulate(TESTBED, rk.PD(7.05, 0.1), path, offset, encoder=count)
            seen, c = step * np.rint((run.q_a + offset) / step), run.c + rng.normal(0, 1e-5, run.c.shape)
            logs.append(rk.Log("rest", path.t, seen, path.q_a, c))
        try:
            low, high = rk.calibrate(TESTBED, logs, use="torques", K_P=7.05).interval()
        except (rk.CalibrationError, rk.ConvergenceError):
            continue
        covered.extend((low <= offset) & (offset <= high))
    assert len(covered) >= 30 and np.mean(covered) > 0.85  # of 95 %; without the counts 17 % of few rests


@pytest.mark.parametrize("size, least", [(0.2, 20), (0.3, 15), (0.6, 0)])
def test_offsets_far_from_zero_are_found_or_refused(size, least):
    found = 0
    for seed in range(20):
        rng = np.random.default_rng(seed)
        q_a = rk.inverse_kinematics(TESTBED, rng.uniform(-0.09, 0.09, (40, 2)))[:, :3]
        offset = rng.uniform(-size, size, 3)
        try:
            assert_allclose(rk.calibrate(TESTBED, q_a + offset).offset, offset, rtol=0, atol=1e-11)
            found += 1
        except ValueError as error:
            assert re.search("determines|contradict each other by|fit no pose", str(error))
    assert found >= least


@pytest.mark.parametrize("seed", [2, 8, 16])
def test_lengths_beside_offsets_far_from_zero_are_found_in_short_steps(seed):
    """The nominal lengths and the offsets that were put in; steps of full length end in a refusal."""
    rng = np.random.default_rng(seed)
    q_a = rk.inverse_kinematics(TESTBED, rng.uniform(-0.09, 0.09, (40, 2)))[:, :3]
    offset = rng.uniform(-0.8, 0.8, 3)
    found = rk.calibrate(TESTBED, q_a + offset, "offsets+lengths")
    assert_allclose(found.offset, offset, rtol=0, atol=1e-9)
    assert_allclose(found.lengths, TESTBED.lengths, rtol=0, atol=1e-9)


@pytest.mark.parametrize("seed", [70, 85, 217])
def test_a_search_that_leads_to_no_machine_does_not_speak_of_an_argument(seed):
    """Nobody gave the lengths that a step made negative."""
    rng = np.random.default_rng(seed)
    q_a = rk.inverse_kinematics(TESTBED, rng.uniform(-0.09, 0.09, (10, 2)))[:, :3] + rng.uniform(-0.8, 0.8, 3)
    with pytest.raises(ValueError, match=r"calibrate did not converge: a step led to|log "):
        rk.calibrate(TESTBED, q_a, "offsets+lengths")
    with pytest.raises(rk.ConvergenceError, match=r"a machine that is none \(lengths\[0, 0\] = -0.1"):
        changed(TESTBED, np.concatenate([np.zeros(3), [-0.1], TESTBED.lengths.ravel()[1:]]))


@pytest.mark.parametrize("level", [-0.5, 0.0, 1.0, 1.5])
def test_a_level_of_confidence_is_a_share(level):
    """Nothing holds the offsets for certain: the interval of level 1 is endless, beyond there is none."""
    found = rk.calibrate(TESTBED, rk.mystery_run("offset_a"))
    with pytest.raises(ValueError, match=r"level = .*; allowed: "):
        found.interval(level)


@pytest.mark.parametrize("seed", [4, 7, 10, 13, 16])
def test_a_machine_seen_in_a_mirror_has_the_opposite_offsets(seed):
    """Also where they are far from zero, so that the first steps towards them are large, in either direction."""
    rng = np.random.default_rng(seed)
    offset, x = rng.uniform(-0.45, 0.45, 3), rng.uniform(-0.06, 0.06, (60, 2))
    q_a = rk.inverse_kinematics(TESTBED, x)[:, :3] + offset
    mirrored = TESTBED.replace(base=TESTBED.base * [1.0, -1.0], mode=-TESTBED.mode)
    assert_allclose(rk.calibrate(TESTBED, q_a).offset, offset, rtol=0, atol=1e-11)
    assert_allclose(rk.calibrate(mirrored, -q_a).offset, -offset, rtol=0, atol=1e-11)


@pytest.mark.parametrize(("unknowns", "count"), [("offsets+lengths", 9), ("all", 15)])
def test_what_a_refusal_knows_it_knows_as_well_as_least_squares(unknowns, count):
    """Gauss and Markov: a combination k of the unknowns has the variance noise^2 k^T (J^T J)^+ k; the gauge is held."""
    q = rk.inverse_kinematics(TESTBED, [[0.05, 0.02], [-0.04, 0.06], [0.01, -0.07], [-0.06, -0.03]])
    with pytest.raises(rk.CalibrationError) as refused:
        rk.calibrate(TESTBED, q[:, :3], unknowns, noise=1e-6)
    held = np.pad(gauge(TESTBED), ((9, 0), (0, 0)))[:count]
    J = closure(rk.at(TESTBED, q), q[:, :3], count)[1] @ (np.eye(count) - held @ held.T)
    known = refused.value.known
    error = 1e-6 * np.sqrt(np.diagonal(known @ np.linalg.pinv(J.T @ J, rcond=1e-9) @ known.T))
    said = [float(number) for number in re.findall(r"± (\S+?)(?:;|$)", str(refused.value))]
    # Of each combination the coefficient largest in size is positive; all that print as something are told.
    assert np.all(known.max(axis=1) == np.abs(known).max(axis=1)) and known.min() < -0.1
    told = [term for row in known[:3] for term in map("{:+.3f}".format, row) if abs(float(term)) > 0.0]
    assert re.findall(r"([+-]\d\.\d{3}) (?:offset|length|base)", str(refused.value)) == told
    assert "pass noise" not in str(refused.value)
    assert refused.value.rank == 4 and len(said) == 3 and np.ptp(error) > 0.5 * error.max()
    assert_allclose(said, error[:3], rtol=0.06)  # two digits


@pytest.mark.parametrize("unknowns", ["offsets+lengths", "all"])
def test_a_noisy_log_of_few_places_is_refused_with_what_it_says(unknowns):
    for seed in range(6):
        rng = np.random.default_rng(seed)
        q_a = rk.inverse_kinematics(TESTBED, rng.uniform(-0.07, 0.07, (8, 2)))[:, :3] + rng.normal(0.0, 2e-3, (8, 3))
        with pytest.raises(rk.CalibrationError, match=r"determines \d+ of \d+ unknowns"):
            rk.calibrate(TESTBED, q_a, unknowns)
    step = 2 * np.pi / 20
    coarse = np.rint(readings(TESTBED, 200) / step) * step
    with pytest.raises(rk.CalibrationError, match=r"determines 0 of 3 .*: nothing, as .* by 0\.1 rad or more$"):
        rk.calibrate(TESTBED, coarse)


@pytest.mark.parametrize("seed", range(24))
def test_offsets_of_a_sixth_of_a_radian_and_more_are_found_from_spread_places(seed):
    """Readings without noise at sixty places, which determine all: what is not explained far away is no noise."""
    rng = np.random.default_rng(seed)
    offset, x = rng.uniform(-0.3, 0.3, 3), rng.uniform(-0.06, 0.06, (60, 2))
    q_a = rk.inverse_kinematics(TESTBED, x)[:, :3] + offset
    assert_allclose(rk.calibrate(TESTBED, q_a).offset, offset, rtol=0, atol=1e-11)


def test_a_refusal_comes_whole_from_another_process():
    with pytest.raises(rk.CalibrationError) as caught:
        rk.calibrate(TESTBED, rk.mystery_run("offset_c"))
    for refusal in (pickle.loads(pickle.dumps(caught.value)), copy.deepcopy(caught.value)):
        assert str(refusal) == str(caught.value) and (refusal.rank, refusal.needed) == (1, 3)
        assert_allclose(refusal.known, caught.value.known, rtol=0, atol=0)
        assert_allclose(refusal.value, caught.value.value, rtol=0, atol=0)


def test_interval_of_one_spare_reading_is_that_of_cauchy():
    """Student's t with one degree of freedom has the quantile tan(pi level / 2); the spread is that of one reading."""
    found = rk.calibrate(TESTBED, readings(TESTBED, 4) + 1e-5 * np.random.default_rng(1).normal(size=(4, 3)))
    assert found.freedom == 1 and found.noise == pytest.approx(2 * found.residual)
    sigma = np.sqrt(np.diagonal(found.covariance))
    for level in (0.5, 0.95):
        half = np.tan(np.pi * level / 2) * sigma
        assert_allclose(found.interval(level), found.estimate + np.array([-half, half]), rtol=0, atol=1e-12)


def test_interval_of_two_spare_readings_is_that_of_student():
    """Student's t with two degrees of freedom has the quantile level sqrt(2 / (1 - level^2))."""
    found = rk.calibrate(TESTBED, readings(TESTBED, 5) + 1e-5 * np.random.default_rng(1).normal(size=(5, 3)))
    assert found.freedom == 2 and found.noise == pytest.approx(np.sqrt(5 / 2) * found.residual)
    sigma = np.sqrt(np.diagonal(found.covariance))
    for level in (0.5, 0.95):
        half = level * np.sqrt(2 / (1 - level**2)) * sigma
        assert_allclose(found.interval(level), found.estimate + np.array([-half, half]), rtol=0, atol=1e-12)


def test_interval_of_counts_without_a_spare_reading_is_that_of_their_rounding():
    """Three poses of three drives leave nothing over; what is known of the noise is the size of a count."""
    count = 2 * np.pi / 4096
    x = np.random.default_rng(0).uniform(-0.1, 0.1, (3, 2))
    found = rk.calibrate(TESTBED, count * np.rint(rk.inverse_kinematics(TESTBED, x)[:, :3] / count))
    assert found.freedom == 0 and found.noise == pytest.approx(count / np.sqrt(12), rel=1e-9)
    half = 1.959964 * np.sqrt(np.diagonal(found.covariance))
    assert_allclose(found.interval(0.95), found.estimate + np.array([-half, half]), rtol=0, atol=1e-8)


def test_a_moving_triangle_beats_coarse_counts():
    path = rk.triangle(TESTBED)
    run = rk.simulate(TESTBED, rk.PD(7.05, 0.225), path, OFFSET[:3], encoder=2000)
    count = 2 * np.pi / 2000
    seen = np.rint((run.q_a + OFFSET[:3]) / count) * count
    assert np.abs(rk.calibrate(TESTBED, seen).offset - OFFSET[:3]).max() < 0.25e-3


def log_of(run, path, offset):
    return rk.Log("run", run.t, run.q_a + offset, path.q_a, run.c)


def test_under_the_filter_torques_are_mute_and_angles_are_not():
    corners = 0.12 * np.array([[-0.9, -0.5], [-0.9, -0.5], [0.9, -0.5], [0.9, -0.5], [0.0, 1.0], [0.0, 1.0]])
    path = rk.polygon(FRICTIONLESS, corners, duration=9.0)
    law = rk.AntagonismFilter(rk.PD(7.05, 0.225))
    log = log_of(rk.simulate(FRICTIONLESS, law, path, OFFSET[:3]), path, OFFSET[:3])
    assert_allclose(rk.calibrate(FRICTIONLESS, log).offset, OFFSET[:3], rtol=0, atol=1e-7)
    assert "mute" in rk.calibrate(FRICTIONLESS, log, use="torques", K_P=7.05).note
    # Whatever the unit of torque.
    tiny = rk.Log("run", log.t, log.q_a, log.q_a_desired, 1e-12 * log.c)
    assert "mute" in rk.calibrate(FRICTIONLESS, tiny, use="torques", K_P=7.05e-12).note


def test_a_filter_is_seen_behind_the_weight_of_a_hanging_machine():
    """The torques carry the weight, and so follow the sag, but nothing in them presses."""
    robot, logs = FRICTIONLESS.replace(gravity=[0.0, -9.81]), []
    for x in random_points(robot, 8, seed=3, bend=0.4):
        path = rk.hold(robot, x, 2.0)
        run = rk.simulate(robot, rk.AntagonismFilter(rk.PD(30.0, 0.8)), path, OFFSET[:3])
        logs.append(log_of(run, path, OFFSET[:3]))
    with pytest.raises(ValueError, match="as under an antagonism filter"):
        rk.calibrate(robot, logs, use="torques")
    assert "the torques are mute" in rk.calibrate(robot, logs, use="torques", K_P=30.0).note


def log_behind_friction(sides, f_c=4.2e-3, K_P=7.05, records=20):
    """A log of PD drives at 12 places, each approached from the given sides; the sensor reads c + side f_c."""
    x = np.repeat(random_points(FRICTIONLESS, 12, seed=6, bend=0.5), len(sides), axis=0)
    side = np.tile(sides, 12)[:, None] * np.array([1.0, -1.0, 1.0])
    rest = rk.inverse_kinematics(FRICTIONLESS, x)[:, :3] + OFFSET[:3]
    # Desired angles that differ from rest to rest, as the errors of PD drives do.
    desired = rest - np.random.default_rng(7).normal(0, 3e-3, rest.shape)
    c = -K_P * (rest - desired) + side * f_c
    rows = [np.repeat(column, records, axis=0) for column in (rest, desired, c)]
    noise = np.random.default_rng(8).normal(0, 1e-5, rows[2].shape)
    return rk.Log("friction", 1e-2 * np.arange(len(rows[0])), rows[0], rows[1], rows[2] + noise)


def test_friction_before_a_torque_sensor_biases_one_sided_rests_by_fc_over_KP():
    """Each reading q_desired - c / K_P is off by the same side f_c / K_P, and so is the offset; 0.6 mrad (reference).

    Tolerance: 1e-5 N m of noise in the mean of 10 records and 12 rests, times a condition below ten.
    """
    bias = -np.array([1.0, -1.0, 1.0]) * 4.2e-3 / 7.05
    noise = 10 * 1e-5 / 7.05 / np.sqrt(10)
    found = rk.calibrate(FRICTIONLESS, log_behind_friction([1.0]), use="torques", K_P=7.05)
    assert_allclose(found.offset - OFFSET[:3], bias, rtol=0, atol=noise)
    assert found.note.count("both sides") == 3 and "-0.6 mrad" in found.note and "+0.6 mrad" in found.note
    both = rk.calibrate(FRICTIONLESS, log_behind_friction([1.0, -1.0]), use="torques", K_P=7.05)
    # To first order the sides cancel; the second order is a product of 5 mrad and 0.6 mrad.
    assert_allclose(both.offset, OFFSET[:3], rtol=0, atol=noise + 10 * 5e-3 * 0.6e-3)
    assert "both sides" not in both.note
    # The angles feel no friction.
    assert_allclose(rk.calibrate(FRICTIONLESS, log_behind_friction([1.0])).offset, OFFSET[:3], rtol=0, atol=1e-13)


@pytest.mark.parametrize(("felt", "sigma", "mute"), [(0.08, 7.0, 1), (0.08, 4.0, 0), (0.12, 7.0, 0)])
def test_torques_are_mute_that_contradict_a_tenth_as_much_as_angles_far_above_their_noise(felt, sigma, mute):
    """Angles that are off by e n, n^T A = 0, and torques of drives that are off by a part of that; of equal standard
    errors of the torques, K_P times e / sigma, the readings have e / sigma.  Far above is five times."""
    off, K_P, notes = 1e-4, np.full(3, 7.05), []
    q = rk.inverse_kinematics(FRICTIONLESS, [[0.03, 0.02], [-0.04, 0.05]])
    n = np.linalg.svd(rk.at(FRICTIONLESS, q).A)[0][:, :, -1]
    # What the angles contradict each other by is off, and that is sigma times their noise.
    error = np.full((2, 3), 7.05 * off / sigma)
    stand = Rests(q[:, :3], q[:, :3] + off * n, -K_P * felt * off * n, noise_of(error, 10), np.full(2, 10))
    angles, spread = angles_of_torques(FRICTIONLESS, stand, None, K_P, notes)
    assert_allclose(angles, q[:, :3] + felt * off * n, rtol=0, atol=1e-15)
    assert spread == pytest.approx(off / sigma, rel=1e-12)
    assert sum("mute" in note for note in notes) == mute


def test_torques_are_mute_also_where_at_one_of_the_rests_nothing_should_press():
    """There the errors are those of a moved end-effector, e = A x, and n^T A = 0; at the other rest they are n."""
    q, K_P, notes = rk.inverse_kinematics(FRICTIONLESS, [[0.03, 0.02], [-0.04, 0.05]]), np.full(3, 7.05), []
    A = rk.at(FRICTIONLESS, q).A
    n = np.linalg.svd(A)[0][:, :, -1]
    e = np.array([1e-3 * n[0], A[1] @ [1e-5, 2e-5]])
    c = -K_P * e * [[0.0], [1.0]]  # what a filter leaves of them
    noise = noise_of(np.full((2, 3), 1e-6), 10)
    angles_of_torques(FRICTIONLESS, Rests(q[:, :3], q[:, :3] + e, c, noise, np.full(2, 10)), None, K_P, notes)
    assert sum("mute" in note for note in notes) == 1


def test_a_dead_drive_shows_no_gain_with_which_its_torques_could_be_read():
    log = log_behind_friction([0.0])
    dead = rk.Log("dead", log.t, log.q_a, log.q_a_desired, log.c * [1.0, 0.0, 1.0])
    with pytest.raises(ValueError, match=r"K_P\[1\] = -?0 ± 0; allowed: > 0"):
        rk.calibrate(FRICTIONLESS, dead, use="torques")

    note = rk.calibrate(FRICTIONLESS, dead, use="torques", K_P=7.05).note
    assert re.findall(r"for drive (\d), not 7.05, as with torques or angles that are noise, stuck", note) == ["2"]


@pytest.mark.parametrize("stuck", [0.0, 1e-5])
def test_a_drive_whose_torques_are_noise_shows_no_gain_whatever_their_slope_is(stuck):
    """The slope of noise over the errors is positive every other time: an offset would be divided by it."""
    log, shown = log_behind_friction([0.0]), 0
    for seed in range(20):
        noise = np.random.default_rng(seed).normal(stuck, 1e-2 * (stuck == 0.0), len(log.t))
        c = np.column_stack([log.c[:, 0], noise, log.c[:, 2]])
        with pytest.raises(ValueError, match=r"K_P\[1\] = \S+ ± \S+; allowed: > 0 by five standard errors") as refused:
            rk.calibrate(FRICTIONLESS, rk.Log("noise", log.t, log.q_a, log.q_a_desired, c), use="torques")
        shown += "K_P[1] = -" not in str(refused.value)
    assert stuck or 5 <= shown <= 15  # by chance: 10 +- 2.2


def test_friction_before_a_sensor_is_no_part_of_the_gain():
    """All torques aside by the same: the line has the gain as its slope, and the note says what the offsets show."""
    off, on = (rk.calibrate(FRICTIONLESS, log_behind_friction([side]), use="torques") for side in (0.0, 1.0))
    assert_allclose(on.K_P, off.K_P, rtol=1e-4)
    said = [float(number) for number in re.findall(r"its offset by ([+-][\d.]+) mrad", on.note)]
    assert_allclose(said, 1e3 * (on.offset - off.offset), rtol=0.02)


def test_a_machine_without_offsets_shows_no_gain():
    """Its drives stand where they should, but for rounding, or for what is left of the motion."""
    holds = [rk.hold(FRICTIONLESS, x, 1.0) for x in ([0.1, 0.0], [-0.05, 0.08], [-0.08, -0.06], [0.03, 0.02])]
    path = rk.polygon(FRICTIONLESS, 0.1 * np.array([[1, 0], [1, 0], [-0.5, 0.8], [-0.5, 0.8]]), duration=6.0)
    for paths in (holds, [path]):
        logs = [rk.simulate(FRICTIONLESS, rk.PD(7.05, 0.225), one).log() for one in paths]
        found = rk.calibrate(FRICTIONLESS, logs)
        assert found.K_P is None and np.abs(found.offset).max() < 1e-6
        with pytest.raises(ValueError, match="K_P = None, and no rest shows it"):
            rk.calibrate(FRICTIONLESS, logs, use="torques")


def test_torques_of_the_opposite_sign_are_said_to_be_so():
    log = log_behind_friction([0.0])
    turned = rk.Log("turned", log.t, log.q_a, log.q_a_desired, -log.c)
    with pytest.raises(ValueError, match=r"the rests show K_P\[0\] = -7\.05 ± 0\.\d+; allowed: > 0 by five"):
        rk.calibrate(FRICTIONLESS, turned, use="torques")


def test_torques_in_another_unit_are_not_said_to_be_angles_that_fit_no_pose():
    """The angles of this log fit: a thousand times the gain, which the rests show, is the cause."""
    log = log_behind_friction([0.0])
    milli = rk.Log("milli", log.t, log.q_a, log.q_a_desired, 1e3 * log.c)
    with pytest.raises(
        ValueError, match=r"use = 'torques' with K_P = .* no pose fits .*rests show K_P = 7\.05e\+03"
    ) as said:
        rk.calibrate(FRICTIONLESS, milli, use="torques", K_P=7.05)
    assert "torques in N m" in str(said.value) and "log holds angles" not in str(said.value)


def test_angles_in_degrees_are_refused_with_the_unit_that_is_wanted():
    with pytest.raises(ValueError, match=r"fit no pose of .*; allowed: base angles in rad") as said:
        rk.calibrate(TESTBED, np.degrees(readings(TESTBED)))
    assert "guess" not in str(said.value)  # calibrate takes none


def test_rests_without_noise_have_no_steps():
    found = rk.calibrate(FRICTIONLESS, log_behind_friction([0.0]), use="torques")
    assert "the steps of the readings" not in found.note


def test_small_torques_say_what_large_ones_say():
    """Offsets and errors of angles have no unit of torque, whose errors weigh the rests against each other."""
    log = log_behind_friction([1.0])
    tiny = rk.Log("tiny", log.t, log.q_a, log.q_a_desired, 1e-12 * log.c)
    found, same = (
        rk.calibrate(FRICTIONLESS, given, use="torques", K_P=K_P) for given, K_P in ((log, 7.05), (tiny, 7.05e-12))
    )
    assert_allclose(same.offset, found.offset, rtol=0, atol=1e-12)
    assert_allclose(same.K_P, 1e-12 * found.K_P, rtol=1e-12)
    assert same.note.count("both sides") == 3
    fitted = rk.calibrate(FRICTIONLESS, tiny, use="torques")  # by the gain that the rests show
    assert_allclose(fitted.offset, rk.calibrate(FRICTIONLESS, log, use="torques").offset, rtol=0, atol=1e-12)


def test_healthy_torques_are_not_accused_of_friction():
    for name in ("offset_a", "offset_b", "gain"):
        assert "both sides" not in rk.calibrate(TESTBED, rk.mystery_run(name), use="torques").note


@pytest.mark.parametrize(("radius", "reference"), [(0.03, 27.0), (0.08, 8.4), (0.12, 4.5)])
def test_small_discs_are_ill_conditioned_and_a_small_residual_certifies_nothing(radius, reference):
    """24 places in a disc: the median condition of 20 draws; lengths wrong by 1e-3 hide in the offsets."""
    rng, condition, bias, residual = np.random.default_rng(0), [], [], []
    for _ in range(20):
        angle, r = rng.uniform(0, 2 * np.pi, 24), radius * np.sqrt(rng.uniform(0, 1, 24))
        x = r[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        true = TESTBED.replace(lengths=TESTBED.lengths * (1 + 1e-3 * rng.normal(size=(3, 2))))
        found = rk.calibrate(TESTBED, rk.inverse_kinematics(true, x)[:, :3] + OFFSET[:3], noise=1e-6)
        condition.append(found.condition)
        bias.append(np.abs(found.offset - OFFSET[:3]).max())
        residual.append(found.residual)
        assert "exceeds the noise" in found.note
    assert_allclose(np.median(condition), reference, rtol=0.1)
    assert np.median(bias) > 0.7e-3 and np.median(bias) > 5 * np.median(residual)


def test_calibrated_offsets_save_what_the_filter_saves():
    """Zero residual offset: within 0.2 % of the filtered energy; (1, 1, 1) mrad left: a fifth more (reference)."""
    law, path = rk.PD(7.05, 0.225), rk.triangle(TESTBED)
    rest = rk.calibrate(TESTBED, rk.mystery_run("offset_a")).offset - hidden("offset_a")[0]
    after = rk.simulate(TESTBED, law, path, rest).energy.sum()
    assert_allclose(after, rk.simulate(TESTBED, law, path).energy.sum(), rtol=1e-4)


def test_equal_readings_count_once():
    """A rest repeats one rounding however long it lasts: nothing is learnt from it a second time."""
    q_a = np.round(readings(TESTBED, 12), 3)
    once, often = rk.calibrate(TESTBED, q_a), rk.calibrate(TESTBED, np.repeat(q_a, np.arange(1, 13), axis=0))
    assert often.freedom == once.freedom == 12 - 3
    for name in ("offset", "covariance", "noise", "residual"):
        assert_allclose(getattr(often, name), getattr(once, name), rtol=1e-9)


def test_the_residual_is_that_of_each_closure_also_where_a_pose_has_two():
    """Least squares leaves what no pose can show, the part along the null space of A^T: N - 2 numbers a pose."""
    robot = MACHINES["four_arms"]
    q_a = readings(robot, 30) + np.random.default_rng(2).normal(0, 1e-4, (30, 4))
    found = rk.calibrate(robot, q_a)
    x = random_points(robot, 30, seed=3, bend=0.3)
    left = q_a - found.offset - rk.estimate_pose(robot, q_a - found.offset, x)[:, :4]
    assert_allclose(found.residual, np.sqrt(np.sum(left**2) / (30 * 2)), rtol=1e-6)
    assert found.freedom == 30 * 2 - 4


@pytest.mark.parametrize("sigma", [1e-3, 2e-2])
def test_noise_of_torques_adds_to_that_of_counts_by_squares(sigma):
    """Three places for three offsets leave nothing over to show it: what is known of a reading then is the rounding
    of its count and the standard error of the torques over K_P, independent of each other."""
    count, K_P, records = 2e-3, 7.05, 20
    x = 0.09 * np.array([[-0.9, -0.5], [0.9, -0.5], [0.0, 1.0]])
    q_a = count * np.rint((rk.inverse_kinematics(FRICTIONLESS, x)[:, :3] + OFFSET[:3]) / count)
    error = 2e-3 * np.random.default_rng(5).normal(size=(3, 3))
    rows = [np.repeat(column, records, axis=0) for column in (q_a, q_a - error, -K_P * error)]
    rows[2] += sigma * np.random.default_rng(6).normal(size=rows[2].shape)
    log = rk.Log("three", 1e-2 * np.arange(3 * records), *rows)
    parts = [rows[2][k * records + records // 4 : (k + 1) * records] for k in range(3)]
    spread = np.sqrt(np.mean([part.var(axis=0, ddof=1) / len(part) for part in parts])) / K_P
    found = rk.calibrate(FRICTIONLESS, log, use="torques", K_P=K_P)
    assert_allclose(found.noise, np.hypot(count / np.sqrt(12), spread), rtol=1e-6)


def test_several_logs_and_paths():
    log, path = rk.mystery_run("offset_a"), rk.data_path("mystery_runs/offset_a.csv")
    assert_allclose(rk.calibrate(TESTBED, path).offset, rk.calibrate(TESTBED, [log, log]).offset, rtol=0, atol=1e-12)


HEADER = ",".join(
    ["t in s", *(f"q{i} {w} in rad" for w in ("measured", "desired") for i in (1, 2, 3))]
    + [f"c{i} in N m" for i in (1, 2, 3)]
)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "line 1, column 1 holds ''|line 1, column 1 holds nothing"),
        ("a,b\n1,2\n", "line 1, column 1 holds 'a'"),
        (
            HEADER.replace(",", ";") + "\n",
            "line 1 has no commas; allowed: values with commas .* decimal points .* a Log",
        ),
        (HEADER.replace("c1 in N m", "c1 in mN m") + "\n", "line 1, column 8 holds 'c1 in mN m'"),
        (HEADER + "\n", "has no record"),
        (HEADER + "\n0,1,2,3\n", "line 2 has 4 columns; allowed: 10"),
        (
            HEADER + "\n0,1,2,3,1,2,3,0,0,0\n0.1,1,x,3,1,2,3,0,0,0\n",
            r"line 3, column 3 \(q2 measured in rad\) holds 'x'",
        ),
        (HEADER + "\n0,1,2,,1,2,3,0,0,0\n", "line 2, column 4"),
        (HEADER + "\n0,1,2,nan,1,2,3,0,0,0\n", "line 2, column 4"),
        (HEADER + "\n" + 2 * "0,1,2,3,1,2,3,0,0,0\n", "line 3, column 1: after 0 s comes 0 s"),
        (
            HEADER + "".join(f"\n{t},1,2,3,1,2,3,0,0,0" for t in (0.0, 0.1, 0.2, 0.5, 0.6)) + "\n",
            r"line 5, column 1: after 0.2 s comes 0.5 s, though records come every 0.1 s; allowed: a log without gaps",
        ),
    ],
)
def test_bad_files_are_refused_by_line_and_column(tmp_path, text, sentence):
    file = tmp_path / "log.csv"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match=sentence):
        rk.calibrate(TESTBED, file)


def test_a_log_with_masked_readings_is_refused_by_their_number():
    log = rk.mystery_run("offset_a")
    holes = np.ma.array(log.q_a, mask=np.zeros(log.q_a.shape, bool))
    holes[5:8, 1] = np.ma.masked
    with pytest.raises(ValueError, match=r"q_a is masked in 3 of \d+ entries; allowed: numbers"):
        rk.Log("run", log.t, holes, log.q_a_desired, log.c)


def test_what_cannot_be_read_is_refused(tmp_path):
    (tmp_path / "image.csv").write_bytes(b"\xff\xfe\x00")
    for path in (tmp_path / "image.csv", tmp_path / "none.csv", tmp_path):
        with pytest.raises(ValueError, match="cannot be read"):
            rk.calibrate(TESTBED, path)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"robot": rk.load("five_bar"), "log": [[0.0, 1.0]]}, "2 drives"),
        ({"robot": 3}, "robot = 3"),
        ({"log": 3}, "log"),
        ({"log": []}, "log"),
        ({"log": [[0.0, 0.0]]}, "log has shape"),
        ({"log": [[2.0, 2.0, 2.0]]}, "fit no pose"),
        ({"log": rk.Log("run", [0.0], [4 * [0.0]], [4 * [0.0]], [4 * [0.0]])}, "4 drives; allowed: 3"),
        ({"unknowns": "lengths"}, "unknowns = 'lengths'"),
        ({"use": "both"}, "use = 'both'"),
        ({"noise": -1.0}, "noise"),
        ({"use": "torques", "log": [[0.0, 0.0, 0.0]]}, "no log holds still for 13 records"),
        ({"log": [0.0, 0.0, 0.0]}, r"log has shape \(3,\); allowed: angles \(k, 3\)"),
        ({"log": np.empty((0, 3))}, r"log has shape \(0, 3\); allowed: angles \(k, 3\)"),
        ({"use": "torques", "K_P": 0.0}, r"K_P\[0\] = 0; allowed: > 0"),
        ({"use": "torques", "K_P": -1.0}, "K_P"),
        ({"use": "torques", "K_P": [1.0, 2.0]}, "K_P"),
    ],
)
def test_bad_arguments(change, sentence):
    given = {"robot": TESTBED, "log": rk.mystery_run("offset_a")} | change
    with pytest.raises(ValueError, match=sentence):
        rk.calibrate(**given)


def test_nothing_left_over_shows_no_noise():
    """Three poses of three drives: three equations for three offsets."""
    robot = MACHINES["testbed"]
    q = rk.inverse_kinematics(robot, 0.1 * np.array([[1.0, 0.0], [-0.5, 0.8], [-0.5, -0.8]]))[:, :3] + OFFSET[:3]
    found = rk.calibrate(robot, q)
    assert_allclose(found.offset, OFFSET[:3], rtol=0, atol=1e-12)
    assert "pass noise" in found.note
    with pytest.raises(ValueError, match="no reading was left over"):
        found.interval()
    assert np.all(np.diff(rk.calibrate(robot, q, noise=1e-4).interval(), axis=0) > 0)


def noise_of(error, records):
    """Covariance of torque and angle of a record, for torques whose means have these standard errors."""
    noise = np.zeros((*error.shape, 2, 2))
    noise[..., 0, 0] = error**2 * records
    return noise


@pytest.mark.parametrize("apart", [0.0, 1e-3])
def test_a_gain_of_rests_is_the_slope_of_the_line_through_them(apart):
    """By SciPy's fit: with the noise of the records where the rests lie on a line, else with what is left of them."""
    records, e = np.array([10, 40, 20]), np.array([[4e-3, -2e-3], [2e-3, 5e-3], [-1e-3, 3e-3]])
    sigma = np.array([[1e-4, 3e-4], [2e-4, 1e-4], [4e-4, 2e-4]])
    c, still = -7.0 * e + apart * np.array([[1.0, -0.5], [-0.5, 1.0], [0.2, 0.3]]), np.zeros((3, 2))
    noise = np.zeros((3, 2, 2, 2))
    noise[..., 0, 0] = sigma**2
    gain = fitted_gain(Rests(still, e, c, noise, records))
    assert gain is not None
    for i in range(2):
        known = np.sqrt(np.mean(sigma[:, i] ** 2) / records)
        fit = curve_fit(lambda e, K: -K * e, e[:, i], c[:, i], sigma=known, absolute_sigma=apart == 0.0)
        assert_allclose(gain.K_P[i], fit[0][0], rtol=1e-7)
        # Of two rests to spare Student's t has its thousandth beyond 31.6 standard deviations, not beyond five.
        assert_allclose(gain.error[i], np.sqrt(fit[1][0, 0]) * (31.599 / 5 if apart else 1.0), rtol=1e-4)
    one = fitted_gain(Rests(still[:1], e[:1], c[:1], noise[:1], records[:1]))
    assert one is not None
    assert_allclose(one.K_P, -c[0] / e[0], rtol=1e-12)
    assert_allclose(one.error, sigma[0] / np.sqrt(10) / np.abs(e[0]), rtol=1e-12)


@pytest.mark.parametrize("errors", [4.0, 7.0])
def test_torques_aside_by_five_errors_are_no_part_of_the_gain(errors):
    """The intercept of a line through rests of equal noise s has the error s sqrt(((X^T X)^-1)_22); a smaller one is
    put into the gain, by least squares through the origin."""
    e, s = np.array([1e-3, 2e-3, 3e-3, 4e-3]), 1e-5
    X = np.stack([-e, np.ones(4)], axis=-1)
    aside = errors * s * np.sqrt(np.linalg.inv(X.T @ X)[1, 1])
    c = (-10.0 * e + aside)[:, None]
    gain = fitted_gain(Rests(np.zeros((4, 1)), e[:, None], c, noise_of(np.full((4, 1), s), 10), np.full(4, 10)))
    assert gain is not None
    assert_allclose(gain.K_P[0], 10.0 if errors > 5 else -e @ c[:, 0] / (e @ e), rtol=1e-9)


def test_noise_of_angles_blurs_a_gain_unless_the_torques_follow_it():
    """Of one rest at error e: with readings of noise s beside torques that do not know of it, K_P is known to
    K_P s / (e sqrt(records)); torques -K_P e of the same readings lie on the line, whatever the noise."""
    K_P, e, s, records = 7.0, 2e-3, 3e-4, 25
    stand = np.array([[0.0]]), np.array([[e]]), np.array([[-K_P * e]])
    for noise, error in (
        ([[0.0, 0.0], [0.0, s**2]], K_P * s / e / 5),
        (s**2 * np.array([[K_P**2, -K_P], [-K_P, 1]]), 0),
    ):
        gain = fitted_gain(Rests(*stand, np.array([[noise]]), np.array([records])))
        assert gain is not None
        assert_allclose(gain.error, error, rtol=1e-9, atol=1e-6)


def test_torques_that_follow_their_readings_exactly_leave_a_gain_without_error():
    """The variance of c + K_P q is zero, which rounding may put below: a wrong gain is still named."""
    rng = np.random.default_rng(0)
    for _ in range(50):
        K_P, e = 7.0 * rng.uniform(0.5, 0.9, 3), 2e-3 + 1e-4 * rng.normal(size=(40, 3))
        gain = fitted_gain(rests([rk.Log("still", 1e-3 * np.arange(40), e, 0 * e, -K_P * e)]))
        assert gain is not None
        assert_allclose(gain.error, 0.0, rtol=0, atol=1e-6)
        assert len(gain.objections(np.full(3, 7.0))) == 3


@pytest.mark.parametrize("count", [2, 3, 4, 6])
def test_few_rests_that_scatter_show_no_other_gain(count):
    """Friction of up to a millinewton metre at each rest is seldom called another gain, which is never far off."""
    wrong, rng = 0, np.random.default_rng(count)
    for _ in range(200):
        e = rng.uniform(-4e-3, 4e-3, (count, 1))
        c = -7.05 * e + rng.uniform(-1e-3, 1e-3, (count, 1))
        gain = fitted_gain(Rests(0 * e, e, c, noise_of(np.full((count, 1), 1e-6), 100), np.full(count, 100)))
        assert gain is not None
        wrong += len(gain.objections(np.array([7.05])))
        assert abs(gain.K_P[0] - 7.05) < 1.5e-3 / np.abs(e).max() * count
    assert wrong <= 4


UNEQUAL = np.array([7.05, 9.0, 5.0])
FRICTION_ASIDE = 4.2e-3 * np.array([1.0, -1.0, 1.0])


def short_rests(seconds: float, law, friction: float, **sensors) -> list[rk.Log]:
    """Logs of rests at six places, too short for the machine to settle after its start at the desired pose."""
    robot = TESTBED.replace(friction=friction)
    places = [[0.0, 0.0], [0.06, 0.02], [-0.05, 0.05], [0.02, -0.06], [-0.04, -0.04], [0.05, -0.03]]
    return [rk.simulate(robot, law, rk.hold(robot, x, seconds), OFFSET[:3], **sensors).log() for x in places]


@pytest.mark.parametrize(("seconds", "friction"), [(0.2, 0.0), (0.3, 0.05), (0.5, 0.005), (1.0, 0.05)])
def test_the_rates_of_short_rests_are_neither_gain_nor_friction(seconds, friction):
    """The law's own gains, of each drive another: K_P e + K_D de/dt at every instant, and of its means, too."""
    K_P = np.array([6.0, 7.0, 9.0])
    logs = short_rests(seconds, rk.PD(K_P, [0.3, 0.4, 0.2]), friction)
    # They do creep: torques and errors are not proportional.
    off = np.concatenate([log.c[-1:] + K_P * log.error[-1:] for log in logs])
    assert np.abs(off).max() > 5e-5
    found = rk.calibrate(TESTBED, logs, use="torques")
    assert_allclose(found.K_P, K_P, rtol=3e-3)
    assert_allclose(found.offset, OFFSET[:3], rtol=0, atol=2e-5)
    given = rk.calibrate(TESTBED, logs, use="torques", K_P=K_P)
    assert_allclose(given.offset, OFFSET[:3], rtol=0, atol=2e-5)
    assert not any(word in given.note for word in ("the rests show", "lie", "creep")), given.note


def test_drives_that_creep_are_named_where_counts_hide_their_rates_and_silent_where_they_rest():
    law = rk.PD(4.0, 0.5)
    hidden = rk.calibrate(TESTBED, short_rests(0.5, law, 0.05, encoder=4096), use="torques", K_P=4.0)
    assert "drives still creep in the rests (" in hidden.note and "rest longer" in hidden.note
    at_rest = rk.calibrate(TESTBED, short_rests(4.0, law, 0.0, encoder=4096), use="torques", K_P=4.0)
    assert "creep" not in at_rest.note


@pytest.mark.parametrize("seconds", [4.0, 8.0])
def test_an_integral_in_the_law_is_told_from_gains_and_rates(seconds):
    """K_I of each drive is that of the law; encoders with offsets never agree, so that the torques go on growing."""
    K_I = np.array([5.0, 8.0, 12.0])
    logs = short_rests(seconds, rk.PID(UNEQUAL, K_I, 0.3), 0.0)
    stand = rests(logs)
    assert stand is not None and list(stand.integral) == [0, 1, 2]
    assert_allclose(list(stand.integral.values()), K_I, rtol=0.03)
    told = "grow in the rests as under a law with an integral, K_I = "
    with pytest.raises(ValueError, match=f"no rest shows it \\(the torques {told}"):
        rk.calibrate(FRICTIONLESS, logs, use="torques")
    note = rk.calibrate(FRICTIONLESS, logs, use="torques", K_P=UNEQUAL).note
    assert told in note and "creep" not in note and "friction before a sensor" not in note
    # The angles know of no law.
    found = rk.calibrate(FRICTIONLESS, logs)
    assert found.K_P is None
    assert_allclose(found.offset, OFFSET[:3], rtol=0, atol=1e-9)


@pytest.mark.parametrize(("seconds", "friction", "counts"), [(0.3, 0.05, None), (2.0, 0.0, 4096), (4.0, 4.2e-3, None)])
def test_drives_without_an_integral_are_not_said_to_have_one(seconds, friction, counts):
    for K_D in (0.1, 0.225, 1.0):
        stand = rests(short_rests(seconds, rk.PD(UNEQUAL, K_D), friction, encoder=counts))
        assert stand is not None and not stand.integral


def test_three_short_rests_show_gain_and_rates():
    """Two unknowns of each drive; with one more, for torques that lie aside, there would be too few."""
    logs = short_rests(0.3, rk.PD([6.0, 7.0, 9.0], [0.3, 0.4, 0.2]), 0.05)[1:4]
    assert_allclose(rk.calibrate(TESTBED, logs, use="torques").K_P, [6.0, 7.0, 9.0], rtol=0.02)


def test_how_far_a_drive_creeps_is_told_between_the_halves_of_a_rest():
    """A line over time: its means over both halves lie half of the rest apart; the first quarter is left out."""
    t = np.arange(80) / 100
    angles = np.stack([0.01 + 0.1 * t, np.full(80, 0.02)], axis=-1)
    log = rk.Log("a line", t, angles, 0 * angles, -7.0 * angles)
    creeps = rests([log]).creeps
    assert list(creeps) == [0]
    assert_allclose(creeps[0], [[-7.0 * 0.1 * 0.3, 0.1 * 0.3]], rtol=1e-12)


@pytest.mark.parametrize(("times", "share", "creeps"), [(11.0, 0.03, 1), (9.0, 0.03, 0), (11.0, 0.015, 0)])
def test_a_drive_creeps_from_ten_errors_of_a_mean_and_a_fiftieth_of_its_error_on(times, share, creeps):
    """Both halves of n records have twice the variance of the whole, and so their difference four times."""
    e = np.full((1, 1), 1e-2)
    moved = share * e[0, 0]
    sigma = moved / times  # of the mean of the rest
    stand = Rests(0 * e, e, -7.0 * e, noise_of(e, 50), np.array([50]))
    assert len(stand.settled(0 * e, np.array([[[0.0, moved]]]), np.array([[2 * sigma]])).creeps) == creeps


def around(duration: float, places=6, K_D=0.225, dt=4e-3, noise=0.0, aside=0.0, every=1, **more) -> rk.Log:
    """One run of drives with unequal gains that rests at places around the middle; torques with noise, or aside."""
    turn = np.arange(places) * 2 * np.pi / places + 0.3
    reach = 0.07 * np.array([0.85, 0.7, 0.61, 0.6, 0.92, 0.96])[:places]
    corners = np.repeat(reach[:, None] * np.stack([np.cos(turn), np.sin(turn)], axis=-1), 2, axis=0)
    robot = more.pop("robot", TESTBED)
    path = rk.polygon(robot, corners, duration=duration, dt=dt)
    log = rk.simulate(robot, rk.PD(UNEQUAL, K_D), path, OFFSET[:3], **more).log()
    c = log.c + aside + np.random.default_rng(0).normal(0, noise, log.c.shape)
    return rk.Log("around", *(column[::every] for column in (log.t, log.q_a, log.q_a_desired, c)))


@pytest.mark.parametrize("every", [1, 10])
def test_noise_of_torques_does_not_hide_the_rates_of_short_rests(every):
    """Everything is as it was told, so nothing is to be said of gains or of friction."""
    log = around(3.984, K_D=1.5, dt=2e-3, noise=3e-3, every=every)
    found = rk.calibrate(TESTBED, log, use="torques", K_P=UNEQUAL)
    assert not any(word in found.note for word in ("the rests show", "lie")), found.note
    assert np.all(np.abs(found.offset - OFFSET[:3]) < np.diff(found.interval(0.99), axis=0)[0])


def test_drives_that_creep_are_named_in_rests_of_few_records_too():
    """From record to record a slow drive hardly moves, however few records there are."""
    log = around(4.0, places=4, aside=FRICTION_ASIDE, every=5)
    assert "creep in the rests (1 and 2 and 3)" in rk.calibrate(TESTBED, log, use="torques", K_P=UNEQUAL).note


def test_friction_before_a_sensor_is_told_from_the_rates_of_short_rests():
    log = around(4.2, K_D=[0.225, 0.1, 0.4], dt=5e-3, aside=FRICTION_ASIDE)
    found = rk.calibrate(TESTBED, log, use="torques", K_P=UNEQUAL)
    assert_allclose(found.K_P, UNEQUAL, rtol=3e-3)
    said = [float(words.split()[6]) for words in found.note.split("; ") if "friction before a sensor" in words]
    assert said == [4.2, -4.2, 4.2] and "the rests show" not in found.note


def test_a_gain_that_friction_before_a_sensor_would_explain_is_not_told_alone():
    """Noise hides which of the two it is: five errors of the torques aside are not reached."""
    log = around(8.0, places=4, noise=3e-3, aside=FRICTION_ASIDE)
    found = rk.calibrate(TESTBED, log, use="torques")
    assert np.abs(found.K_P / UNEQUAL - 1).max() > 0.2
    said = re.search(r"or torques that lie (\S+) mN m off", found.note)
    # An error of a fifth and more, for five of them are not reached.
    assert said and float(said[1]) == pytest.approx(4.2, rel=0.4) and "friction before a sensor" in found.note


@pytest.mark.parametrize(("longer", "said"), [(1.0, False), (1.01, True)])
def test_many_readings_tell_of_another_machine_below_three_steps_of_rounding(longer, said):
    """Links longer by a hundredth leave 1.7 times what rounding does, and offsets that are wrong by 7 mrad."""
    log = around(12.0, encoder=20_000, robot=TESTBED.replace(lengths=longer * TESTBED.lengths))
    assert ("exceeds the steps" in rk.calibrate(TESTBED, log).note) == said


def test_rates_that_are_zero_leave_the_torques_of_rests_as_they_are():
    rng, count = np.random.default_rng(0), np.full(6, 50)
    stand = Rests(*rng.normal(size=(3, 6, 2)), noise_of(np.full((6, 2), 1e-3), 50), count)
    settled = stand.settled(*np.zeros((1, 6, 2)), np.zeros((6, 2, 2)), np.zeros((6, 2)))
    np.testing.assert_array_equal(settled.c, stand.c)
    assert not settled.creeps


@pytest.mark.parametrize(("counts", "friction"), [(2000, True), (8000, True), (2000, False)])
def test_drives_that_creep_between_counts_are_not_said_to_have_another_gain(counts, friction):
    """Torques of a creeping drive hold K_D times a rate that no count shows, steadily; one of 9 N m/rad is found."""
    robot = TESTBED if friction else FRICTIONLESS
    turn = 0.4 * np.pi * np.repeat(np.arange(5), 2)
    path = rk.polygon(robot, 0.09 * np.stack([np.cos(turn), np.sin(turn)], axis=-1), duration=10.0)
    for seed in range(4):
        offset = np.random.default_rng(seed).uniform(-4e-3, 4e-3, 3)
        for second in (7.05, 9.0):
            K_P = np.array([7.05, second, 7.05])
            log = rk.simulate(robot, rk.PD(K_P, 0.225), path, offset, counts).log()
            found = rk.calibrate(robot, log, use="torques", K_P=7.05)
            assert_allclose(found.K_P, K_P, rtol=0.05)
            said = [sentence for sentence in found.note.split("; ") if "the rests show" in sentence]
            assert len(said) == (second == 9.0) and all("drive 2" in sentence for sentence in said)


def test_a_drive_without_an_error_shows_no_gain():
    for rest in (0.0, 1e-7):  # exactly, or but for what is left of a motion
        e, one = np.array([[1e-3, rest], [2e-3, -rest]]), np.ones((2, 2))
        assert fitted_gain(Rests(0 * e, e, one, noise_of(one, 10), np.full(2, 10))) is None
    # Small errors of exact torques show it as well as large ones.
    small = np.array([[1e-3, 2e-6], [2e-3, -3e-6]])
    gain = fitted_gain(Rests(0 * small, small, -7.0 * small, noise_of(1e-12 * np.ones((2, 2)), 10), np.full(2, 10)))
    assert gain is not None
    assert_allclose(gain.K_P, 7.0, rtol=1e-9)


def test_no_line_goes_through_the_torques_of_a_drive_that_stands_exactly_where_it_should():
    """All its errors are zero, beside a column of ones that are not; the other drives keep their lines."""
    q_a = np.round(readings(FRICTIONLESS, 6) * 2**30) / 2**30  # means without rounding
    error = np.random.default_rng(1).normal(0, 2e-3, q_a.shape) * [1.0, 0.0, 1.0]
    rows = (np.repeat(column, 20, axis=0) for column in (q_a, q_a - error, -7.05 * error))
    log = rk.Log("still", 1e-2 * np.arange(120), *rows)
    stand = rests([log])
    assert stand is not None
    assert [stand.fit(i, np.ones(6)) is None for i in range(3)] == [False, True, False]
    # Its torques say that its encoder reads what it should: the angles, a hair of 2^-31 rad apart, tell the same.
    found = rk.calibrate(FRICTIONLESS, log, use="torques", K_P=7.05)
    assert_allclose(found.offset, OFFSET[:3], rtol=0, atol=1e-8)


def test_rests_are_stretches_of_equal_desired_angles_without_their_first_quarter():
    """Of at least ten records, the means of their numbers and the standard error of the mean torque."""
    rng, lengths = np.random.default_rng(4), (14, 12, 41)
    desired = np.repeat([[0.1, 0.2], [0.1, 0.2005], [0.1003, 0.2005]], lengths, axis=0)
    q_a, c = desired + rng.normal(0, 1e-3, desired.shape), rng.normal(0, 1e-2, desired.shape)
    t = 1e-3 * np.arange(len(desired))
    stand = rests([rk.Log("one", t, q_a, desired, c), rk.Log("two", t[:12], q_a[:12], desired[:12], c[:12])])
    assert stand is not None and stand.records.tolist() == [11, 31]
    for k, half in enumerate((slice(3, 14), slice(36, 67))):
        assert_allclose(stand.desired[k], desired[half][0], rtol=0, atol=0)
        assert_allclose(stand.q_a[k], q_a[half].mean(axis=0), rtol=1e-12)
        assert_allclose(stand.c[k], c[half].mean(axis=0), rtol=1e-12)
        spread = np.sqrt(((c[half] - c[half].mean(axis=0)) ** 2).sum(axis=0) / (stand.records[k] - 1))
        assert_allclose(stand.c_error[k], spread / np.sqrt(stand.records[k]), rtol=1e-12)
        for i in range(2):
            assert_allclose(stand.noise[k, i], np.cov(c[half, i], q_a[half, i]), rtol=1e-12)
    assert rests([rk.Log("three", t[:12], q_a[:12], desired[:12], c[:12])]) is None


@pytest.mark.parametrize(("aside", "sigma", "said"), [(7.0, 1.0, 1), (4.0, 1.0, 0), (1.5, 1e-9, 1), (0.7, 1e-9, 0)])
def test_torques_lie_aside_from_five_errors_and_a_ten_thousandth_of_the_gain_on(aside, sigma, said):
    """Errors that add up to zero: slope and intercept of the line are independent, and the intercept has the error
    sigma / sqrt(k), here 1 and K_P / 10^4 the unit of what lies aside; of equal errors no line is known."""
    e = np.array([[-2e-3], [-1e-3], [1e-3], [2e-3]])
    unit, K_P = 1e-3, np.array([10.0])
    still, error = np.zeros((4, 1)), np.full((4, 1), sigma * unit * np.sqrt(4))
    shifted = -K_P * e + aside * unit
    noise = noise_of(error, 10)
    assert len(one_sided(Rests(still, e, shifted, noise, np.full(4, 10)), K_P)) == said
    assert one_sided(Rests(still, 0 * e + 1e-3, shifted, noise, np.full(4, 10)), K_P) == []


def test_a_gain_is_another_one_from_five_errors_and_two_hundredths_on():
    nominal = np.array([10.0, 10.0, 10.0, 10.0])
    sure = Gain(nominal + [0.25, -0.25, 0.15, -0.15], np.full(4, 1e-6)).objections(nominal)
    assert len(sure) == 2 and "drive 1" in sure[0] and "drive 2" in sure[1]
    vague = Gain(nominal + [0.7, -0.7, 0.4, -0.4], np.full(4, 0.1)).objections(nominal)
    assert len(vague) == 2 and "drive 1" in vague[0] and "drive 2" in vague[1]


def test_a_log_of_six_digits_with_noise_is_not_said_to_have_wrong_lengths():
    rng = np.random.default_rng(2)
    q_a = rk.inverse_kinematics(TESTBED, rng.uniform(-0.1, 0.1, (500, 2)))[:, :3] + OFFSET[:3]
    noisy = np.round(q_a + rng.normal(0, 2e-4, q_a.shape), 6)
    assert "more noise than that (to be given as noise), or" in rk.calibrate(TESTBED, noisy).note
    assert rk.calibrate(TESTBED, noisy, noise=2e-4).note == ""


def test_cautions_from_their_bounds_on():
    """Three times the noise, a quarter of the longest link, a condition of fifty; half the width of two places."""
    far = 0.3 * TESTBED.lengths.max() * np.array([[1.0, 0.0], [-1.0, 0.0]])
    assert cautions(far + 0.5, TESTBED, 49.0, 9e-7, 0.0, None) == []  # wherever the places are
    assert len(cautions(far / 1.3 + 0.5, TESTBED, 49.0, 9e-7, 0.0, None)) == 1
    assert cautions(far, TESTBED, 49.0, 2.9e-5, 1e-5, None) == cautions(far, TESTBED, 49.0, 2.9e-5, 0.0, 1e-5) == []
    for given, words in (
        # No steps, and no noise that anybody told.
        ((far, TESTBED, 49.0, 3e-5, 0.0, None), "taken from the residual 0.03 mrad, where a wrong geometry may hide"),
        ((far, TESTBED, 49.0, 0.0, 0.0, None), "no reading is left over to show the noise"),
        ((far, TESTBED, 49.0, 3.1e-5, 0.0, 1e-5), "exceeds the noise 0.01 mrad: something else is wrong"),
        (
            (far, TESTBED, 49.0, 3.1e-5, 1e-5, None),
            "exceeds the steps of the readings, 0.01 mrad: they have more noise",
        ),
        ((0.8 * far, TESTBED, 49.0, 2.9e-5, 1e-5, None), "close together"),
        ((far, TESTBED, 51.0, 2.9e-5, 1e-5, None), "condition"),
    ):
        (sentence,) = cautions(*given)
        assert words in sentence


def test_readings_that_are_counts_are_known_by_their_steps():
    """Even steps of one size, whatever that is: its square is twelve times the variance; others show no counts."""
    whole = np.array([[0, 2], [1, 5], [3, 4], [7, -3]])
    for count in (1e-4, 3e-3, 0.1):
        assert_allclose(rounding(count * whole), count / np.sqrt(12), rtol=1e-9)
        # Each encoder may have a zero of its own between two counts.
        assert_allclose(rounding(count * (whole + [0.2, 0.65])), count / np.sqrt(12), rtol=1e-9)
        assert rounding(count * (whole + np.sqrt([[0.0, 0.0], [0.0, 0.0], [2.0, 0.0], [0.0, 0.0]]))) == 0.0
        # No two of few readings need lie one count apart.
        far = np.array([[0, 20], [15, 50], [36, 44], [70, -30]])  # smallest step 6, greatest common divisor 1
        assert_allclose(rounding(count * far), count / np.sqrt(12), rtol=1e-9)
        # One count, computed in two ways, differs by rounding.
        twice = np.concatenate([count * whole, count * whole + 1e-13])
        assert_allclose(rounding(twice), count / np.sqrt(12), rtol=1e-6)
    # A file of six digits moves each end of a step by up to half a millionth: a 150th of a count of 40000 a turn.
    fine = 2 * np.pi / 40000 * np.arange(1, 21)[:, None]
    assert_allclose(rounding(np.round(fine, 6)), 2 * np.pi / 40000 / np.sqrt(12), rtol=1 / 150)


@pytest.mark.parametrize("name", NAMES)
def test_gauge_of_the_base_points_is_scale_turn_and_shift(name):
    """Differences of the base points in these directions are those of a similar, turned or shifted drawing."""
    base = MACHINES[name].replace(base=MACHINES[name].base + [0.03, -0.02]).base
    G = gauge(MACHINES[name].replace(base=base))
    assert_allclose(G.T @ G, np.eye(4), atol=1e-14)
    turn, shift = np.array([[0.0, -1.0], [1.0, 0.0]]), np.ones((len(base), 1))
    for field in (base, base @ turn.T, shift * [1.0, 0.0], shift * [0.0, 1.0]):
        assert_allclose(G @ (G.T @ field.ravel()), field.ravel(), atol=1e-14)


def test_a_small_singular_value_counts_down_to_ten_times_the_noise():
    """Rows taken at wrong angles are wrong by about the noise: below ten times of that a combination is not known."""
    angles = readings(TESTBED, 24)
    smallest = 1.0 / rk.calibrate(TESTBED, angles).condition
    assert rk.calibrate(TESTBED, angles, noise=smallest / 15).rank == 3
    with pytest.raises(rk.CalibrationError, match="of 3 unknowns"):
        rk.calibrate(TESTBED, angles, noise=smallest / 7)
    with pytest.raises(ValueError, match=r"noise = 1 rad .* below 0.1 rad"):
        rk.calibrate(TESTBED, angles, noise=1.0)


@pytest.mark.parametrize("seed", [9, 20, 50])
def test_coarse_readings_far_from_nominal_are_refused_and_no_other_minimum_is_taken(seed):
    """The smallest singular value of the null vectors at the places, relative to the largest, is below ten times
    their noise of 0.03 rad; where the search goes on in short steps it would end 0.07 to 0.7 rad from the truth."""
    rng = np.random.default_rng(seed)
    q = rk.inverse_kinematics(TESTBED, rng.uniform(-0.05, 0.05, (8, 2)))
    n = np.array([rk.null_vector(TESTBED, one) for one in q])
    assert np.linalg.cond(n) > 1 / (10 * 0.03)
    with pytest.raises(rk.CalibrationError, match="of 3 unknowns"):
        rk.calibrate(TESTBED, q[:, :3] + rng.uniform(-0.2, 0.2, 3) + rng.normal(0, 0.03, (8, 3)))


def test_torques_under_a_filter_show_no_gain():
    robot, logs = MACHINES["testbed"].replace(friction=4.2e-3), []
    law = rk.AntagonismFilter(rk.PD(7.05, 0.225))
    for x in ([0.08, 0.0], [-0.05, 0.06], [-0.05, -0.06], [0.0, 0.03]):
        run = rk.simulate(robot, law, rk.hold(robot, x, 2.0), OFFSET[:3])
        logs.append(
            rk.Log("rest", run.t, run.q_a + OFFSET[:3], np.broadcast_to(run.trajectory.q_a, run.c.shape), run.c)
        )
    with pytest.raises(ValueError, match="do not follow the errors of the angles, as under an antagonism filter"):
        rk.calibrate(robot, logs, use="torques")


def test_a_log_from_a_spreadsheet(tmp_path):
    """A mark of the encoding in front, empty lines behind; blanks after the commas."""
    text = rk.data_path("mystery_runs/gain.csv").read_text(encoding="utf-8")
    path = tmp_path / "gain.csv"
    path.write_text(text + "\n\n", encoding="utf-8-sig")
    assert rk.read_log(path) == rk.mystery_run("gain")
    path.write_text(text.replace(",", ", "), encoding="utf-8")
    assert rk.read_log(path) == rk.mystery_run("gain")


@pytest.mark.parametrize("low", [0.0, -np.pi])
def test_encoders_that_count_other_turns_than_the_desired_angles_show_the_same_gains(low):
    """An angle is the same a whole turn later: read from `low` to a turn above it, while those desired stay.

    2 pi is no number of a computer: sums of a turn and an angle are rounded at 1e-15, as parts of 1e-3 rad 1e-12.
    """
    log = rk.mystery_run("offset_a")
    q_a = low + (log.q_a - low) % (2 * np.pi) + [0.0, 4 * np.pi, 0.0]
    turned = rk.Log("turned", log.t, q_a, log.q_a_desired, log.c)
    assert np.abs(turned.error).max() > 6
    same, found = (rk.calibrate(TESTBED, one, use="torques") for one in (log, turned))
    assert_allclose(found.K_P, same.K_P, rtol=1e-9)
    assert_allclose(found.offset, same.offset, rtol=0, atol=1e-11)
    # Of angles rounded before they are turned nobody sees the steps.
    first, second = (rk.calibrate(TESTBED, one, K_P=7.05, noise=3e-6).note for one in (log, turned))
    assert first == second


@pytest.mark.parametrize("place", [0, 5, 39])
def test_of_many_readings_that_which_fits_no_pose_is_named(place):
    """A record of zeros, as of a logger that has lost its encoders; a guess 1 m away is out of reach of all arms."""
    angles, guess = readings(TESTBED), np.zeros((40, 2))
    angles[place], guess[place] = 0.0, [1.0, 0.0]
    with pytest.raises(rk.ConvergenceError, match=r"q_a = \[0\.0, 0\.0, 0\.0\]"):
        rk.estimate_pose(TESTBED, angles, guess)
    with pytest.raises(ValueError, match=r"q_a = \[0\.0, 0\.0, 0\.0\]"):
        rk.calibrate(TESTBED, angles)


@pytest.mark.parametrize("far", [1e3, 1e5, 1e6])
def test_base_points_in_the_coordinates_of_a_map_are_calibrated_as_well(far):
    """A shift moves nothing but the base points; these are rounded to `far` times 2e-16 m then."""
    shift, offset = far * np.array([1.0, -0.3]), np.array([4e-3, -2e-3, 5e-3])
    angles = rk.inverse_kinematics(TESTBED, random_points(TESTBED, 24))[:, :3] + offset
    robot = TESTBED.replace(base=TESTBED.base + shift)
    found = rk.calibrate(robot, angles, unknowns="all")
    assert found.rank == 11
    assert_allclose(found.offset, offset, rtol=0, atol=1e-11 + 1e3 * np.spacing(far))
    assert_allclose(found.lengths, TESTBED.lengths, rtol=0, atol=1e-12 + 1e3 * np.spacing(far))


def test_a_sum_of_offsets_that_is_nothing_has_no_sign():
    """At the desired pose itself every sum of offsets is zero, which is not negative."""
    robot = rk.load().replace(friction=0.0)
    log = rk.simulate(robot, rk.PD(7.05, 0.225), rk.hold(robot, [0.02, 0.05], 0.1)).log()
    with pytest.raises(rk.CalibrationError, match="determines 1 of 3") as caught:
        rk.calibrate(robot, log)
    assert not np.signbit(caught.value.value[caught.value.value == 0.0]).any() and "= -0" not in str(caught.value)
