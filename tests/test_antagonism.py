"""Rest under PD control with offsets and stepped angles, and the logs made for the exercises."""

import itertools
import sys
from pathlib import Path

import numpy as np
import pytest

import rapkm_lite as rk
from rapkm_lite.lessons.mystery import K_P, hidden

ROOT = Path(__file__).parents[1]
QUANTUM = 2 * np.pi / 2000
sys.path.insert(0, str(ROOT / "notebooks"))

from workshop import mystery  # noqa: E402


def random_rests(seed, count):
    rng = np.random.default_rng(seed)
    for _ in range(count):
        yield rng.uniform(-0.06, 0.06, 2), rng.uniform(-5e-3, 5e-3, 3)


def test_rest_always_exists_below_the_threshold():
    """K_P quantum <= 2 f_c: the friction of each drive alone covers the rounding of its own angle."""
    robot = rk.load()
    for x, offset in random_rests(1, 40):
        q = rk.inverse_kinematics(robot, x)
        for times in (1.0, 30.0):  # offsets of many counts move the place of rest by as many
            assert rk.rest_exists(robot, q, 2 * 4.2e-3 / QUANTUM, times * offset, QUANTUM, 4.2e-3)
        for friction in (0.0, 1e-6):
            assert not rk.rest_exists(robot, q, K_P, offset, QUANTUM, friction)


def rest_by_trying_counts(robot, q, K, offset, quantum, friction):
    """Counts that a displacement x reads, |counts - zero - A x| <= 1/2, and whose torques carry the weight, one by one.

    Strips of the plane share a point if every three of them do, and slabs |c_i - n_i| <= friction about torques n that
    carry the weight do if all but any one of them do (Helly): without a programme.
    """
    N, cross = robot.n_arms, lambda a, b: a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    A, weight, K = rk.control_matrix(robot, q), rk.required_wrench(robot, q, 0 * q, 0 * q), np.diag(np.resize(K, N))
    zero = (q[:N] + offset) / quantum
    # At a rest the angles read are off by a rounding r, |r_i| <= 1/2, and torques by a prestress p, |p_i| <= friction:
    # A^T K (A x + offset + r) + A^T p = 0 makes counts - ideal = (1 - S K) r - S p with S = A (A^T K A)^-1 A^T.
    S = A @ np.linalg.solve(A.T @ K @ A, A.T)
    reach = np.abs(np.eye(N) - S @ K).sum(axis=-1) / 2 + friction / quantum * np.abs(S).sum(axis=-1)
    order = np.argsort(reach)  # from the second on of the smallest ones, two counts leave an interval for the third
    near = (zero + rk.steady_state_error(A, K, offset, weight) / quantum)[order]
    a, start, reach, counts = A[order], zero[order], reach[order] + 1e-3, np.zeros((1, 0))
    for k in range(N):
        low, high = (np.full(len(counts), near[k] + side * reach[k]) for side in (-1, 1))
        for i, j in itertools.combinations(range(k), 2):
            n = np.array([cross(a[j], a[k]), cross(a[k], a[i]), cross(a[i], a[j])])
            off, half = (counts[:, [i, j]] - start[[i, j]]) @ n[:2], np.abs(n).sum() / 2
            ends = start[k] + np.sort([(-half - off) / n[2], (half - off) / n[2]], axis=0)
            low, high = np.maximum(low, ends[0]), np.minimum(high, ends[1])
        tried = [
            [*row, c] for row, a_, b in zip(counts, low, high, strict=True) for c in np.arange(np.ceil(a_), b + 1e-9)
        ]
        counts = np.array(tried).reshape(-1, k + 1)
    c = -(quantum * counts[:, np.argsort(order)] - q[:N]) @ K
    still, work = cross(A[:, None], A), cross(A, weight)
    return bool(np.any(np.all(np.abs(c @ still.T - work) <= friction * np.abs(still).sum(axis=-1), axis=-1)))


@pytest.mark.parametrize("load", [0.0, 0.3], ids=["lying", "hanging"])
@pytest.mark.parametrize("name", ["testbed", "four_arms"])
def test_places_of_rest_against_all_counts(name, load):
    """Below the threshold, near it, far above."""
    robot, rng = rk.load(name).replace(load=load, gravity=[0.0, -9.81 * (load > 0)]), np.random.default_rng(6)
    seen = set()
    for _ in range(4):
        q = rk.inverse_kinematics(robot, rng.uniform(-0.05, 0.05, 2))
        offset = rng.uniform(-5e-3, 5e-3, robot.n_arms)
        for factor in (1.0, 1.8, 5.0):
            gain = factor * 2 * 4.2e-3 / QUANTUM
            ours = rk.rest_exists(robot, q, gain, offset, QUANTUM, 4.2e-3)
            assert ours == rest_by_trying_counts(robot, q, gain, offset, QUANTUM, 4.2e-3)
            seen.add(ours)
    assert seen == {True, False}


FAR_RESTS = [
    (
        [1, 1, 1],
        [0.06154574, -0.09502867],
        [2.90013065, 49.3899056, 0.25709937],
        [9.38408833e-05, -4.67328777e-03, -1.77959597e-02],
        0.006503879507520728,
    ),
    (
        [1, -1, 1],
        [-0.05223648, -0.08965521],
        [0.16004569, 12.31600793, 9.32792317],
        [0.02749419, 0.01189974, -0.01351195],
        0.0053973233164045726,
    ),
]


@pytest.mark.parametrize("case", FAR_RESTS, ids=range(2))
def test_a_soft_drive_rests_many_counts_from_the_ideal_place(case):
    mode, x, K, offset, friction = case
    robot = rk.load().replace(mode=mode)
    q = rk.inverse_kinematics(robot, x)
    assert rk.rest_exists(robot, q, K, offset, 3e-3, friction)
    assert rest_by_trying_counts(robot, q, np.array(K), np.array(offset), 3e-3, friction)


@pytest.mark.parametrize("name", ["five_bar", "testbed", "four_arms"])
@pytest.mark.parametrize("ratio", [1.0, 30.0, 1000.0])
def test_places_of_rest_of_drives_with_unequal_gains(name, ratio):
    rng = np.random.default_rng(int(ratio))
    seen = []
    for _ in range(12):
        robot = rk.load(name)
        robot = robot.replace(mode=rng.choice([-1, 1], robot.n_arms))
        q = rk.inverse_kinematics(robot, rng.uniform(-0.06, 0.06, 2))
        K = 0.1 * ratio ** rng.permutation(np.linspace(0.0, 1.0, robot.n_arms))
        offset = rng.uniform(-0.03, 0.03, robot.n_arms)
        # The stiffest drive rounds by more than its friction holds.
        friction = QUANTUM * K.max() * 10 ** rng.uniform(-1.5, -0.5)
        seen.append(rk.rest_exists(robot, q, K, offset, QUANTUM, friction))
        assert seen[-1] == rest_by_trying_counts(robot, q, K, offset, QUANTUM, friction)
    assert {*seen} == {True, False}


def test_gains_too_unequal_to_try_all_counts_are_refused():
    robot = rk.load()
    q = rk.inverse_kinematics(robot, [0.02, 0.05])
    with pytest.raises(
        ValueError, match=r"K_P = \[1e-08, 1.0, 1e-08\] is too unequal .*; allowed: gains of up to 1e4 times"
    ):
        rk.rest_exists(robot, q, [1e-8, 1.0, 1e-8], np.zeros(3), QUANTUM, 0.4 * QUANTUM)


@pytest.mark.parametrize("name", ["five_bar", "four_arms"])
def test_rest_exists_below_the_threshold_for_other_numbers_of_arms(name):
    robot = rk.load(name)
    for x, offset in random_rests(7, 10):
        q = rk.inverse_kinematics(robot, x)
        offset = np.resize(offset, robot.n_arms)
        assert rk.rest_exists(robot, q, 2 * 4.2e-3 / QUANTUM, offset, QUANTUM, 4.2e-3)
        for friction in (0.0, 1e-6):
            assert not rk.rest_exists(robot, q, K_P, offset, QUANTUM, friction)


def test_runs_without_a_place_of_rest_keep_moving():
    """Independent route: the simulated machine with sharp Coulomb friction, at three times the threshold."""
    robot = rk.load().replace(friction_velocity=3e-5)
    gain = 3 * 2 * 4.2e-3 / QUANTUM
    lively = 0
    for x, offset in random_rests(2, 12):
        path = rk.hold(robot, x, 1.2, 1e-4)
        run = rk.simulate(robot, rk.PD(gain, 0.24), path, offset, encoder=2000)
        if not rk.rest_exists(robot, path.q[0], gain, offset, QUANTUM, 4.2e-3):
            lively += 1
            assert run.c[-4000:].std(axis=0).max() > 0.5 * gain * QUANTUM / 2
    assert lively >= 4


def test_runs_below_the_threshold_come_to_rest():
    """The other direction, for friction sharp enough not to creep: from rest to rest without a jump of the torque."""
    rng = np.random.default_rng(4)
    robot = rk.load().replace(friction_velocity=5e-6)
    for (x, offset), ratio in zip(random_rests(4, 30), rng.uniform(0.5, 1.0, 30), strict=True):
        gain = ratio * 2 * 4.2e-3 / QUANTUM
        law, path = rk.PD(gain, 0.225 * np.sqrt(gain / K_P)), rk.hold(robot, x, 0.5, 2e-5)
        c = rk.simulate(robot, law, path, offset, encoder=2000).c[-10_000:]
        assert np.count_nonzero(np.abs(np.diff(c, axis=0)) > 0.5 * gain * QUANTUM) <= 1  # one last count at most


@pytest.mark.parametrize("name", mystery.SIDES)
def test_log_in_the_repository_is_the_one_build_makes(name):
    log = rk.mystery_run(name)
    stored = np.column_stack([log.t, log.q_a, log.q_a_desired, log.c])
    np.testing.assert_allclose(stored, mystery.record(name), rtol=0.0, atol=6e-5)  # rounding of the last printed digit
    assert (ROOT / "data" / "mystery_runs" / f"{name}.csv").stat().st_size < 150_000


def test_rest_at_one_place_tells_the_offset_along_the_null_vector_only():
    log, robot = rk.mystery_run("offset_c"), rk.load()
    n = rk.null_vector(robot, rk.inverse_kinematics(robot, [0.04, -0.05]))
    offset, _ = hidden("offset_c")
    found = -n @ log.c[log.t > 1.0].mean(axis=0) / K_P
    assert abs(found - n @ offset) < 1e-4 and np.linalg.norm(offset - n * found) > 3e-3


@pytest.mark.parametrize("name", mystery.SIDES)
def test_no_log_begins_with_its_offsets(name):
    """A run starts at the desired point: there the measured error is the offset.  The logs begin later."""
    assert np.abs(rk.mystery_run(name).error[0] - hidden(name)[0]).max() > 5e-4


def test_unknown_log_names_what_is_allowed():
    with pytest.raises(ValueError, match=r"name = 'offset_x'; allowed: 'offset_a', 'offset_b', 'offset_c', 'gain'"):
        rk.mystery_run("offset_x")


def test_jitter_costs_the_mean_square_of_the_delay():
    """(14) with dq = qd_a times the delay: a quadratic form; 0 to 4 ms at random have the mean square 6 ms^2."""
    robot = rk.load().replace(friction=0.0)
    path = rk.polygon(robot, [[-0.12, -0.0693], [0.12, -0.0693]], duration=3.0)
    late = np.random.default_rng(0).integers(0, 5, len(path))

    def cost(delay, rates):
        k = np.arange(len(path))[:, None] - np.stack([delay, 0 * delay, 0 * delay], axis=-1)
        given = [np.take_along_axis(a, np.maximum(k, 0), axis=0) for a in (path.q_a, path.qd_a)]
        return rk.antagonistic_energy(rk.simulate(robot, rk.PD(7.05, 0.225), path.with_set_points(*given[: 1 + rates])))

    none, steady = cost(0 * late, True), cost(0 * late + 2, True)
    random, jumping = cost(late, True), cost(late, False)
    np.testing.assert_allclose((random - none) / (steady - none), 6 / 4, rtol=0.05)
    # Rates by central differences of late positions err by qd times (t1 - t2)/(2 ms), mean square 4/4: K_D qd against
    # the steady delay's K_P qd 2 ms.
    np.testing.assert_allclose((jumping - none) / (steady - none), 6 / 4 + (0.225 / (7.05 * 2e-3)) ** 2, rtol=0.1)


def test_null_vector_of_distal_links_of_different_lengths():
    """n_i ~ (a_i x d_i)(d_j x d_k), |d| = 1, and A^T n = 0."""
    robot = rk.load().replace(lengths=[[0.2, 0.22], [0.2, 0.18], [0.2, 0.25]])
    q = rk.inverse_kinematics(robot, [0.02, 0.03])
    pose, n = rk.at(robot, q), rk.null_vector(robot, q)
    d = pose.d / np.linalg.norm(pose.d, axis=1)[:, None]

    def crossed(u, v):
        return u[0] * v[1] - u[1] * v[0]

    wanted = [crossed(pose.a[i], d[i]) * crossed(d[i - 2], d[i - 1]) for i in range(3)]
    np.testing.assert_allclose(n, wanted / np.linalg.norm(wanted), rtol=0, atol=1e-15)
    assert np.abs(pose.A.T @ n).max() < 1e-12
