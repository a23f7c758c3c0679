"""Laws with memory: what a run may remember, and that nothing else does; against loops of a few NumPy lines."""

import copy
import itertools
import pickle
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from samples import InPython

import rapkm_lite as rk

ROBOT = rk.load().replace(friction=0.0)
PATH = rk.circle(ROBOT, radius=0.05, duration=0.3)
OFFSET = np.array([4e-3, -2e-3, 5e-3])
PD = rk.PD(7.05, 0.225)
COLUMNS = ("energies", "torque_norm", "antagonistic_energy", "x_final", "rms_path_error", "largest_path_error")


class PI:
    """A law as a student writes it: an object that adds up its error."""

    def __init__(self):
        self.sum, self.times = np.zeros(3), []

    def __call__(self, t, q_a, qd_a, desired):
        self.times.append(t)
        e = q_a - desired.q_a
        self.sum += 1e-3 * e
        return -7.05 * e - 0.225 * (qd_a - desired.qd_a) - 40.0 * self.sum


class Recorder(rk.Law):
    """PD that keeps what it is given, and asks for no pose."""

    pose = None

    def start(self, model, dt):
        self.dt, self.seen = dt, []
        return self.seen

    def step(self, memory, sample):
        memory.append((sample.t, sample.dt, sample.q_a, sample.qd_a))
        e, ed = sample.q_a - sample.desired.q_a, sample.qd_a - sample.desired.qd_a
        return -7.05 * e - 0.225 * ed, memory


def pid_by_hand(q, qd, path, K_P, K_I, K_D, limit):
    """Torques of PID with conditional integration for the readings q, qd of a run."""
    integral, torques = np.zeros(3), []
    for k in range(len(path)):
        e, ed = q[k] - path.q_a[k], qd[k] - path.qd_a[k]
        grown = integral + K_I * path.dt * e
        c = -(K_P * e + K_D * ed + grown)
        integral = np.where(np.abs(c) <= limit, grown, integral)
        torques.append(np.clip(c, -limit, limit))
    return np.array(torques)


# Equal calls, equal numbers.
def test_an_object_runs_twice_with_equal_numbers_and_stays_as_it_was():
    law = PI()
    one, two = (rk.simulate(ROBOT, law, PATH, OFFSET) for _ in range(2))
    assert_array_equal(one.c, two.c)
    assert not law.times and not law.sum.any()
    assert_array_equal(one.law.times, PATH.t)  # what it recorded can be read from the copy that ran
    assert one.law.sum.any() and one.law is not two.law
    inside = rk.simulate(ROBOT, rk.AntagonismFilter(law), PATH, OFFSET).law.law
    assert_array_equal(inside.times, PATH.t)
    assert_array_equal(rk.simulate(ROBOT, law.__call__, PATH, OFFSET).c, one.c)  # a bound method has an object too


def test_equal_rows_of_a_sweep_are_equal_and_are_single_runs():
    law, run = PI(), rk.simulate(ROBOT, PI(), PATH, OFFSET)
    study = rk.sweep(ROBOT, law, PATH, [OFFSET] * 3)
    for i in range(3):
        assert_array_equal(study.energies[i], run.energy)
    assert not law.times


@pytest.mark.parametrize(
    "law",
    [PI(), rk.PID(7.05, 40.0, 0.225), rk.AntagonismFilter(rk.SwitchedCTC(900.0, 60.0))],
    ids=["object", "PID", "filtered switching"],
)
def test_bits_do_not_depend_on_executor_chunk_or_order(law):
    path = rk.circle(ROBOT, radius=0.05, duration=0.05)
    offsets = np.random.default_rng(1).normal(0.0, 3e-3, (5, 3))
    study = rk.sweep(ROBOT, law, path, offsets)
    others = [rk.sweep(ROBOT, [law] * 5, path, offsets, chunk=3)]
    with ThreadPoolExecutor(3) as threads, ProcessPoolExecutor(2) as processes:
        others += [rk.sweep(ROBOT, law, path, offsets, executor=pool, chunk=2) for pool in (threads, processes)]
    turned = rk.sweep(ROBOT, law, path, offsets[::-1])
    for name in COLUMNS:
        for other in others:
            assert_array_equal(getattr(other, name), getattr(study, name))
        assert_array_equal(getattr(turned, name)[::-1], getattr(study, name))


def test_a_law_that_cannot_be_copied_is_refused():
    class Stream:
        def __init__(self):
            self.lines = (line for line in "abc")

        def __call__(self, t, q_a, qd_a, desired):
            return np.zeros(3)

    for call in (lambda: rk.simulate(ROBOT, Stream(), PATH), lambda: rk.sweep(ROBOT, Stream(), PATH, OFFSET)):
        with pytest.raises(ValueError, match=r"cannot be copied .* allowed: an object that copy\.deepcopy copies"):
            call()
    with pytest.raises(ValueError, match="allowed: a law, such as PD"):
        rk.simulate(ROBOT, rk.PD, PATH)


# The grammar.
def test_pid_with_anti_windup():
    seen = rk.simulate(ROBOT, Recorder(), PATH, OFFSET)
    gains = {"K_P": np.array([7.0, 6.0, 5.0]), "K_I": 90.0, "K_D": 0.2}
    # Memory is worth something here: the limit is met, and left again.
    for limit in (np.inf, 0.3, np.array([0.2, np.inf, 0.4])):
        run = rk.simulate(ROBOT, rk.PID(**gains, limit=limit), PATH, OFFSET)
        c = pid_by_hand(run.q_a + OFFSET, run.qd_a, PATH, **gains, limit=limit)
        assert_allclose(run.c, c, rtol=0, atol=1e-12)
        held = np.abs(run.c) == limit
        assert not np.isfinite(limit).all() or (held.any() and not held.all())
    assert_allclose(rk.simulate(ROBOT, rk.PID(7.05, 0.0, 0.225), PATH, OFFSET).c, seen.c, rtol=0, atol=1e-10)
    full = rk.PID(np.diag(gains["K_P"]), 90.0 * np.eye(3), 0.2 * np.eye(3))
    assert_allclose(
        rk.simulate(ROBOT, InPython(full), PATH, OFFSET).c,
        rk.simulate(ROBOT, rk.PID(**gains), PATH, OFFSET).c,
        rtol=0,
        atol=1e-10,
    )


@pytest.mark.parametrize("free", list(itertools.product([False, True], repeat=3)))
def test_the_integral_of_a_drive_at_its_limit_stands_still_and_those_of_others_go_on(free):
    """K_I e dt = 5e-3 N m a sample; a limit of zero is always met."""
    law, d = rk.PID(7.0, 50.0, 0.2, limit=np.where(free, np.inf, 0.0)), PATH[0]
    controller = rk.Controller(law, ROBOT, dt=1e-2)
    for k in (1, 2, 3):
        c = controller(0.0, d.q_a + 0.01, d.qd_a, d)
        assert_allclose(controller.memory, np.where(free, 5e-3 * k, 0.0), rtol=0, atol=1e-13)
        assert_allclose(c, np.where(free, -(0.07 + 5e-3 * k), 0.0), rtol=0, atol=1e-13)


@pytest.mark.parametrize("times", [1.0, np.eye(3)], ids=["compiled", "in Python"])
def test_an_integral_grows_with_the_sampling_time_of_its_path(times):
    gains, path = {"K_P": 7.05, "K_I": 90.0, "K_D": 0.2}, rk.circle(ROBOT, radius=0.05, duration=0.3, dt=2e-3)
    run = rk.simulate(ROBOT, rk.PID(**{name: K * times for name, K in gains.items()}), path, OFFSET)
    c = pid_by_hand(run.q_a + OFFSET, run.qd_a, path, **gains, limit=np.inf)
    assert_allclose(run.c, c, rtol=0, atol=1e-10)


@pytest.mark.parametrize("which", [(0, 1, 2), (1,)], ids=["all", "integral"])
def test_gains_of_pid_as_matrices_are_the_same_gains(which):
    """At its limit a drive keeps its own integral, and its own only."""
    gains, limit, offset = [7.0, 20.0, 0.2], [0.02, 1.0, 1.0], [8e-3, -2e-3, 5e-3]
    path = rk.hold(ROBOT, [0.02, 0.05], 0.2)
    plain = rk.simulate(ROBOT, rk.PID(*gains, limit=limit), path, offset)
    assert np.any(np.abs(plain.c[:, 0]) >= 0.02)
    matrices = [gain * np.eye(3) if k in which else gain for k, gain in enumerate(gains)]
    assert_allclose(rk.simulate(ROBOT, rk.PID(*matrices, limit=limit), path, offset).c, plain.c, rtol=0, atol=1e-9)


def test_pid_leaves_no_error_at_rest_where_pd_does():
    heavy = ROBOT.replace(gravity=(0.0, -1.0))
    stay = rk.hold(heavy, [0.02, 0.01], 4.0)
    pd, pid = (rk.simulate(heavy, law, stay) for law in (PD, rk.PID(7.05, 20.0, 0.225)))
    q = stay.q[0]
    wrench = rk.minimal_dynamics(heavy, q, 0 * q)[2]
    expected = rk.steady_state_error(rk.control_matrix(heavy, q), 7.05, np.zeros(3), wrench)  # (14), to first order
    assert_allclose(pd.error[-1], expected, atol=0.05 * np.abs(expected).max())
    assert np.abs(pid.error[-1]).max() < 1e-4 * np.abs(expected).max()


def test_the_sampling_time_and_the_measurement_reach_the_law():
    path = rk.circle(ROBOT, radius=0.05, duration=0.3, dt=2e-3)
    run = rk.simulate(ROBOT, Recorder(), path, OFFSET)
    t, dt, q_a, qd_a = (np.array(column) for column in zip(*run.law.seen, strict=True))
    assert_array_equal(t, path.t)
    assert run.law.dt == path.dt and np.all(dt == path.dt)
    assert_array_equal(q_a, run.q_a + OFFSET)  # kept between the calls, and still what they were
    assert_array_equal(qd_a, run.qd_a)
    slow = rk.PID(7.05, 40.0, 0.225)
    run = rk.simulate(ROBOT, slow, path, OFFSET)
    assert_allclose(run.c, pid_by_hand(run.q_a + OFFSET, run.qd_a, path, 7.05, 40.0, 0.225, np.inf), atol=1e-12)


def test_a_law_of_the_package_in_a_loop_of_your_own():
    law = rk.AntagonismFilter(rk.PID(7.05, 40.0, 0.225))
    run = rk.simulate(ROBOT, law, PATH, OFFSET)
    controller = rk.Controller(law, ROBOT, PATH.dt)
    c = [controller(t, run.q_a[k] + OFFSET, run.qd_a[k], PATH[k]) for k, t in enumerate(PATH.t.tolist())]
    assert_allclose(run.c, c, rtol=0, atol=1e-12)
    memory = law.start(ROBOT, PATH.dt)
    assert_array_equal(memory, np.zeros(3))


# Filters hand the memory on.
@pytest.mark.parametrize("offset", [0.0, OFFSET], ids=["no offset", "offset"])
def test_a_filter_around_switching_keeps_its_switching(offset):
    """Torques of a CTC law are free of antagonism at its own pose: the filter there changes nothing but rounding."""
    law, path = rk.SwitchedCTC(900.0, 60.0), rk.triangle(ROBOT, duration=1.2, dt=2e-3)
    plain, filtered = (rk.simulate(ROBOT, one, path, offset) for one in (law, rk.AntagonismFilter(law)))
    changes = sum(one != other for one, other in itertools.pairwise(plain.pairs.tolist()))
    assert plain.switches == filtered.switches == changes >= 3
    assert_array_equal(plain.pairs, filtered.pairs)
    assert_allclose(filtered.c, plain.c, rtol=0, atol=1e-9)


def test_a_filter_multiplies_the_torques_of_switching_by_r_at_its_own_pose():
    law = rk.SwitchedCTC(900.0, 60.0, pose="true")
    path = rk.triangle(ROBOT, duration=1.2, dt=2e-3)
    run = rk.simulate(ROBOT, rk.AntagonismFilter(law), path, OFFSET)  # the filter at the measured pose
    pair, x, different = None, path.x[0], 0.0
    for k in range(len(path)):
        q, qd, q_a = run.q[k], run.qd[k], run.q_a[k] + OFFSET
        pair = law.choose(ROBOT, q, pair)
        inner = law.fixed(pair).torque(ROBOT, q, qd, q_a, run.qd_a[k], path[k])
        q_m = rk.estimate_pose(ROBOT, q_a, x)
        x = rk.forward_kinematics(ROBOT, q_m)
        assert tuple(run.pairs[k]) == pair
        assert_allclose(run.c[k], rk.antagonism_filter(rk.control_matrix(ROBOT, q_m)) @ inner, rtol=0, atol=1e-9)
        different = max(different, np.abs(run.c[k] - inner).max())
    assert different > 1e-6 and run.switches >= 3


def test_filters_around_an_integral_a_callable_and_another_filter():
    gains = (7.05, 40.0, 0.225)
    run = rk.simulate(ROBOT, rk.AntagonismFilter(rk.PID(*gains), pose="true"), PATH, OFFSET)
    R = rk.antagonism_filter(rk.control_matrix(ROBOT, run.q))
    c = pid_by_hand(run.q_a + OFFSET, run.qd_a, PATH, *gains, np.inf)
    assert_allclose(run.c, np.einsum("kij,kj->ki", R, c), rtol=0, atol=1e-11)
    twice = rk.AntagonismFilter(rk.AntagonismFilter(rk.PID(*gains), pose="true"), pose="true")  # R R = R
    assert_allclose(rk.simulate(ROBOT, twice, PATH, OFFSET).c, run.c, rtol=0, atol=1e-9)
    student = rk.simulate(ROBOT, rk.AntagonismFilter(PI(), pose="true"), PATH, OFFSET)
    assert_allclose(student.c, run.c, rtol=0, atol=1e-9)


class Coordinates(rk.Law):
    """It sends nothing, and says which coordinates it uses."""

    pose = None

    def step(self, memory, sample):
        return np.zeros(3), memory

    def coordinates(self, memory):
        return 0, 2


def test_a_filter_tells_the_coordinates_of_its_law():
    path = rk.hold(ROBOT, [0.0, 0.0], 0.005)
    run = rk.simulate(ROBOT, rk.AntagonismFilter(Coordinates()), path)
    assert run.pairs.tolist() == [[0, 2]] * len(path)


def test_weighted_filter_makes_the_least_heat_at_the_same_force():
    robot = ROBOT.replace(resistance=[0.05, 0.05, 3.0])
    heat = robot.resistance / robot.torque_constant**2
    raw, plain, weighted = (
        rk.simulate(robot, law, PATH, OFFSET)
        for law in (PD, rk.AntagonismFilter(PD, pose="true"), rk.AntagonismFilter(PD, pose="true", W=heat))
    )
    n, A = rk.null_vector(robot, weighted.q), rk.control_matrix(robot, weighted.q)
    # Stationary along the one direction that does not change the force: n^T W c = 0.
    assert_allclose(np.einsum("ki,i,ki->k", n, heat, weighted.c), 0.0, atol=1e-9)
    e, ed = weighted.q_a + OFFSET - PATH.q_a, weighted.qd_a - PATH.qd_a
    force = lambda c: np.einsum("kij,ki->kj", A, c)  # noqa: E731
    assert_allclose(force(weighted.c), force(-7.05 * e - 0.225 * ed), atol=1e-10)
    for W in (2.0, np.full(3, 2.0), 2.0 * np.eye(3)):
        same = rk.simulate(robot, rk.AntagonismFilter(PD, pose="true", W=W), PATH, OFFSET)
        assert_allclose(same.c, plain.c, rtol=0, atol=1e-9)
    copper = [rk.copper_loss(robot, run.c[:-1], run.dt).sum() for run in (raw, plain, weighted)]
    assert copper[2] < copper[1] and copper[2] < copper[0]
    with pytest.raises(ValueError, match="W"):
        rk.AntagonismFilter(PD, W=-1.0)


class Watch(rk.Law):
    """Holds the path by its angles, and keeps what it measures and where it believes to be."""

    def __init__(self):
        self.rows = []

    def step(self, memory, sample):
        self.rows.append((sample.q_a, *sample.pose()))
        e, ed = sample.errors()
        return -7.05 * e - 0.225 * ed, memory


@pytest.mark.parametrize("name", ["five_bar", "testbed", "four_arms", "asymmetric"])
@pytest.mark.parametrize(("offset", "encoder"), [(4e-3, None), (0.3, None), (4e-3, 500)])
def test_the_measured_pose_is_the_least_squares_pose_of_the_model(name, offset, encoder):
    """A^T (q_a - q_a(x)) = 0 at the minimum; where Newton's steps do not serve, `estimate_pose` does (0.3 rad)."""
    robot = rk.load(name)
    model = robot.replace(lengths=1.01 * robot.lengths)
    signs = np.where(np.arange(robot.n_arms) % 2, -offset, offset)
    path = rk.hold(robot, [0.01, 0.02], 0.02)
    law = rk.simulate(robot, Watch(), path, signs, encoder, model).law
    assert len(law.rows) == len(path)
    for q_a, q, qd in law.rows:
        assert not q.flags.writeable and not qd.flags.writeable
        x = rk.forward_kinematics(model, q)
        A, N = rk.control_matrix(model, q), robot.n_arms
        assert np.abs(rk.loop_constraints(model, q)).max() < 1e-14
        assert_allclose(A.T @ (q_a - q[:N]), 0.0, atol=1e-12)
        assert_allclose(q, rk.estimate_pose(model, q_a, x), rtol=0, atol=1e-13)
        assert_allclose(qd[:N], A @ np.linalg.lstsq(A, qd[:N], rcond=None)[0], atol=1e-12)


class PDOfThePose(rk.Law):
    """PD with the base angles of the pose, whichever is asked for."""

    def __init__(self, pose):
        self.pose = pose

    def torque(self, model, q, qd, q_a, qd_a, desired):
        return (7.05 * (desired.q - q) + 0.225 * (desired.qd - qd))[: model.n_arms]


@pytest.mark.parametrize("pose", ["measured", "true"])
@pytest.mark.parametrize("name", ["testbed", "four_arms"])
def test_base_angles_of_a_pose_go_on_where_a_path_turns_on(name, pose):
    robot = rk.load(name)
    path = rk.circle(robot, 0.12, duration=1.0) if name == "testbed" else rk.triangle(robot, duration=2.0)
    assert path.q_a.min() < -np.pi
    run = rk.simulate(robot, PDOfThePose(pose), path)
    assert_allclose(run.c, rk.simulate(robot, PD, path).c, rtol=0, atol=1e-9)


def test_a_true_pose_knows_no_offsets():
    run = rk.simulate(ROBOT, PDOfThePose("true"), rk.hold(ROBOT, [0.0, 0.0], 0.1), offset=[3.2, 0.0, 2 * np.pi])
    assert_allclose(run.c, 0.0, atol=1e-12)


def test_a_bare_law_finds_no_pose():
    """A law that does not ask for a pose does not care that the angles fit none."""
    far = 2.5 * np.array([1.0, -1.0, 1.0])
    still = rk.hold(ROBOT, [0.0, 0.0], 0.01)
    rk.simulate(ROBOT, Recorder(), still, far)
    with pytest.raises(rk.SimulationError, match="fit no pose"):
        rk.simulate(ROBOT, rk.AntagonismFilter(Recorder()), still, far)


# What a law may do with what it is given.
def test_a_law_cannot_shift_the_path():
    before = PATH.q.copy()

    def writes(t, q_a, qd_a, desired):
        desired.q[:3] += 0.1
        return np.zeros(3)

    def own(t, q_a, qd_a, desired):
        q_a -= desired.q_a
        qd_a -= desired.qd_a
        return -7.05 * q_a - 0.225 * qd_a

    with pytest.raises(ValueError, match="read-only"):
        rk.simulate(ROBOT, writes, PATH)
    assert_array_equal(PATH.q, before)
    run = rk.simulate(ROBOT, own, PATH, OFFSET)
    assert_allclose(run.c, rk.simulate(ROBOT, PD, PATH, OFFSET).c, rtol=0, atol=1e-9)
    inside = rk.simulate(ROBOT, rk.AntagonismFilter(own), PATH, OFFSET)
    assert_allclose(inside.c, rk.simulate(ROBOT, rk.AntagonismFilter(PD), PATH, OFFSET).c, rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", ["q_a", "qd_a"])
def test_a_law_of_a_class_cannot_change_what_was_measured(name):
    class Writes(rk.Law):
        pose = None

        def step(self, memory, sample):
            getattr(sample, name)[0] += 0.1
            return np.zeros(3), memory

    with pytest.raises(ValueError, match="read-only"):
        rk.simulate(ROBOT, Writes(), PATH)


VALUES = {
    "PD(K_P=7.05, K_D=0.225)": PD,
    "AntagonismFilter(PD(K_P=7.05, K_D=0.225), pose='measured')": rk.AntagonismFilter(PD),
    "AntagonismFilter(PD(K_P=7.05, K_D=0.225), pose='true', W=[1.0, 2.0, 3.0])": rk.AntagonismFilter(
        PD, "true", [1, 2, 3]
    ),
    "PID(K_P=7.0, K_I=1.0, K_D=0.2)": rk.PID(7.0, 1.0, 0.2),
    "PID(K_P=7.0, K_I=1.0, K_D=0.2, limit=[0.1, inf, 0.2])": rk.PID(7.0, 1.0, 0.2, [0.1, np.inf, 0.2]),
    "CTC(K_P=900.0, K_D=60.0, independent=None, pose='measured')": rk.CTC(900, 60, None),
    "SwitchedCTC(K_P=900.0, K_D=60.0, hysteresis=1.2, pose='measured')": rk.SwitchedCTC(900, 60),
    "Sensors(encoder=2000)": rk.Sensors(encoder=2000),
    "TorqueLimit(0.3)": rk.TorqueLimit(0.3),
    "DeadDrive(1, 0.5)": rk.DeadDrive(1, 0.5),
    "EncoderDropout(0, 0.1, 0.2)": rk.EncoderDropout(0, 0.1, 0.2),
    "OffsetJump(2, 0.1, -0.002)": rk.OffsetJump(2, 0.1, -2e-3),
}


@pytest.mark.parametrize("text", VALUES)
def test_values_compare_print_and_travel(text):
    value = VALUES[text]
    assert repr(value) == text
    again = eval(text, {**vars(rk), "inf": np.inf})
    for other in (again, pickle.loads(pickle.dumps(value)), copy.copy(value), copy.deepcopy(value)):
        assert other == value and hash(other) == hash(value)
        for array in vars(other).values():
            assert not isinstance(array, np.ndarray) or not array.flags.writeable
    assert value not in (None, PD.K_P, 7.05) and len({*map(repr, VALUES.values())}) == len(VALUES)


def test_runs_and_sweeps_are_values():
    run, study = rk.simulate(ROBOT, PD, PATH, OFFSET), rk.sweep(ROBOT, PD, PATH, [OFFSET] * 2)
    for value, other in (
        (run, rk.simulate(ROBOT, rk.PD(7.05, 0.225), PATH, OFFSET)),
        (study, rk.sweep(ROBOT, PD, PATH, [OFFSET] * 2)),
    ):
        assert value == other == pickle.loads(pickle.dumps(value)) == copy.deepcopy(value)
    assert run != rk.simulate(ROBOT, PD, PATH, 1.1 * OFFSET)
    for array in (run.c, run.q_a, run.t, run.q, run.qd, study.energies, pickle.loads(pickle.dumps(run)).c):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0


def integral(memory):
    """A PID that is told an integral of its user's, which is (N,)."""
    controller = rk.Controller(rk.PID(7.0, 1.0, 0.2), ROBOT)
    controller.memory = memory
    return controller(0.0, PATH.q_a[0], PATH.qd_a[0], PATH[0])


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: rk.PID(7.0, -1.0, 0.2), "K_I = -1; allowed: >= 0"),
        (lambda: rk.PID(7.0, 1.0, 0.2, limit=-0.1), r"limit = -0\.1; allowed: >= 0"),
        (lambda: rk.PID(7.0, 1.0, 0.2, limit=[]), r"limit has shape \(0,\); allowed: one number or one per drive"),
        (lambda: rk.PID(7.0, 1.0, 0.2, limit="x"), "limit = .* is not numeric"),
        (lambda: rk.PID(7.0, 1.0, 0.2, limit="inf"), "limit = 'inf' is not numeric"),
        (lambda: rk.TorqueLimit(["inf", "0.3", "inf"]), r"limit = \['inf', .* is not numeric"),
        (lambda: rk.TorqueLimit(np.ma.array([np.inf, 0.3, 0.3], mask=[0, 1, 0])), "limit is masked in 1 of 3 entries"),
        (lambda: rk.simulate(ROBOT, rk.PID([7.0, 7.0], 1.0, 0.2), PATH), r"K_P has shape \(2,\); allowed: .* \(3,\)"),
        (lambda: rk.simulate(ROBOT, rk.PID(7.0, 1.0, np.eye(2)), PATH), r"K_D has shape \(2, 2\); allowed: .* \(3,\)"),
        (lambda: rk.simulate(ROBOT, rk.PID(7.0, [1.0, 2.0], 0.2), PATH), r"K_I has shape \(2,\); allowed: .* \(3,\)"),
        (
            lambda: rk.simulate(ROBOT, rk.PID(7.0, 1.0, 0.2, [1.0, 2.0]), PATH),
            r"limit has shape \(2,\); allowed: one number or \(3,\)$",
        ),
        # Also in a loop of one's own, where no compiled one asks.
        (lambda: rk.PID(7.0, 1.0, [0.2, 0.2]).start(ROBOT, 1e-3), r"K_D has shape \(2,\); allowed: .* \(3,\)"),
        (lambda: rk.PID(7.0, 1.0, 0.2, [1.0, 2.0]).start(ROBOT, 1e-3), r"limit has shape \(2,\); allowed: .* \(3,\)"),
        (lambda: integral(np.zeros(2)), r"memory has shape \(2,\); allowed: \(3,\)"),
        (lambda: integral(0.0), r"memory has shape \(\); allowed: \(3,\)"),
        (lambda: integral([0.0, np.nan, 0.0]), "memory"),
        (lambda: rk.CommandFilter(rk.PID(7.0, 1.0, 0.2)), "allowed: PD, whose commands are filtered"),
        (lambda: rk.Controller(PD, ROBOT, dt=0.0), "dt = 0; allowed: > 0"),
    ],
)
def test_bad_arguments(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_a_step_must_answer_with_the_torques_and_the_memory():
    class Half(rk.Law):
        def step(self, memory, sample):
            return np.zeros(3)

    with pytest.raises(ValueError, match=r"Half.step returned .* allowed: the pair \(c, memory\)"):
        rk.simulate(ROBOT, Half(), PATH)
    with pytest.raises(NotImplementedError, match=r"PID.* has no torque; needed: .* step, and a run to ask it"):
        rk.PID(7.0, 1.0, 0.2).torque(ROBOT, None, None, None, None, None)
    with pytest.raises(NotImplementedError, match="has no torque; needed: a class that gives torque, or one"):
        rk.simulate(ROBOT, rk.Law(), PATH)
    elsewhere = type("Elsewhere", (rk.Law,), {"pose": "desired", "torque": lambda self, *known: np.zeros(3)})
    with pytest.raises(ValueError, match=r"pose = 'desired'; allowed: 'measured', 'true', None"):
        rk.simulate(ROBOT, elsewhere(), PATH)
    here = PATH.q[0], PATH.qd[0], PATH.q_a[0], PATH.qd_a[0], PATH[0]
    with pytest.raises(NotImplementedError, match=r"<function .* has no torque; needed: "):
        rk.AntagonismFilter(lambda t, q_a, qd_a, desired: 0.0 * q_a).torque(ROBOT, *here)


def test_a_formula_that_needs_no_pose_is_the_pd_that_it_writes_out():
    class Spring(rk.Law):
        pose = None

        def torque(self, model, q, qd, q_a, qd_a, desired):
            assert q is None and qd is None, "no pose was asked for"
            return -7.0 * (q_a - desired.q_a) - 0.2 * (qd_a - desired.qd_a)

    written, known = (rk.simulate(ROBOT, law, PATH, offset=[1e-3, 0.0, -1e-3]) for law in (Spring(), rk.PD(7.0, 0.2)))
    np.testing.assert_allclose(written.c, known.c, rtol=0, atol=1e-12)


class Kicking(rk.PD):
    """A law of the package with more to say: a constant torque, and how often it was asked."""

    def __init__(self, K_P, K_D, kick):
        super().__init__(K_P, K_D)
        self.kick, self._asked = kick, np.zeros(1)

    def step(self, memory, sample):
        self._asked += 1
        c, memory = super().step(memory, sample)
        return c + self.kick, memory


def test_what_a_law_on_one_of_the_package_sets_besides_its_fields_belongs_to_it():
    law, other = Kicking(7.0, 0.2, 1e-3), Kicking(7.0, 0.2, 2e-3)
    assert law == Kicking(7.0, 0.2, 1e-3) != other and hash(law) == hash(Kicking(7.0, 0.2, 1e-3))
    assert "kick=0.001" in repr(law) and copy.deepcopy(law) == law == pickle.loads(pickle.dumps(law))
    first, second = (rk.simulate(ROBOT, law, PATH) for _ in range(2))
    assert first == second and first.law._asked == len(PATH) and law._asked == 0
    assert_allclose(first.c[0], 1e-3, rtol=0, atol=1e-12)
    study = rk.sweep(ROBOT, [law, other, law], PATH, np.zeros((3, 3)))
    assert_array_equal(study.energies[0], study.energies[2])
    assert_array_equal(study.energies[0], first.energy)
    assert_array_equal(study.energies[1], rk.simulate(ROBOT, other, PATH).energy)
    around = rk.AntagonismFilter(law), rk.AntagonismFilter(other)
    assert around[0] != around[1] and rk.simulate(ROBOT, around[0], PATH) != rk.simulate(ROBOT, around[1], PATH)


def kicked(base):
    class Kicked(base):
        def torque(self, *given):
            return super().torque(*given) + 1e-3

    return Kicked


def test_a_formula_of_a_users_is_asked_or_refused():
    """A run asks for `step`; a class that overrides `torque` alone must not run as if it had not."""

    plain, law = rk.PD(7.0, 0.2), kicked(rk.PD)(7.0, 0.2)
    expected = rk.simulate(ROBOT, lambda t, q, qd, d: -7.0 * (q - d.q_a) - 0.2 * (qd - d.qd_a) + 1e-3, PATH, OFFSET)
    assert_allclose(rk.simulate(ROBOT, law, PATH, OFFSET).c, expected.c, rtol=0, atol=1e-9)
    assert_allclose(rk.sweep(ROBOT, law, PATH, OFFSET).energies[0], expected.energy, rtol=1e-9)
    filtered = rk.simulate(ROBOT, rk.AntagonismFilter(law), PATH).c[0]
    assert_allclose(filtered, rk.antagonism_filter(rk.control_matrix(ROBOT, PATH.q[0])) @ np.full(3, 1e-3), atol=1e-12)
    assert np.abs(rk.simulate(ROBOT, kicked(rk.CTC)(400.0, 40.0), PATH).c[0] - 1e-3).max() < 1e-3
    for refused in (
        kicked(rk.PID)(7.0, 1.0, 0.2),
        kicked(rk.AntagonismFilter)(plain),
        kicked(rk.SwitchedCTC)(400.0, 40.0),
        kicked(rk.CompiledLaw)(lambda t, q_a, qd_a, d: np.zeros(3)),
        rk.AntagonismFilter(kicked(rk.PID)(7.0, 1.0, 0.2)),
    ):
        for call in (rk.simulate, rk.sweep):
            with pytest.raises(ValueError, match=r"Kicked\.torque is of your own, but \w+\.step does not use it"):
                call(ROBOT, refused, PATH, OFFSET)

    class Doubled(rk.PD):
        def gains(self, m):
            return 2.0 * self.K_P * np.eye(m), self.K_D * np.eye(m)

    doubled, gained = rk.simulate(ROBOT, rk.PD(14.0, 0.2), PATH, OFFSET), Doubled(7.0, 0.2)
    assert_allclose(rk.simulate(ROBOT, gained, PATH, OFFSET).c, doubled.c, rtol=0, atol=1e-9)

    # As within every other law: what a step of the user's asks of its base is the formula of the class.
    for base in (kicked(rk.PD), Doubled, kicked(rk.CTC)):

        class Halved(base):
            def step(self, memory, sample):
                c, memory = super().step(memory, sample)
                return 0.5 * c, memory

        whole, half = (rk.simulate(ROBOT, kind(7.0, 0.2), PATH, OFFSET).c[0] for kind in (base, Halved))
        assert_allclose(half, 0.5 * whole, rtol=0, atol=1e-12)

    class Pairs(rk.SwitchedCTC):
        def pairs(self, model, q):
            return np.tile([0, 1], (len(q), 1))

    with pytest.raises(ValueError, match=r"Pairs\.pairs is of your own"):
        rk.simulate(ROBOT, Pairs(400.0, 40.0), PATH)
    Pairs.choose = lambda self, model, q, current=None: (0, 1)
    assert set(map(tuple, rk.simulate(ROBOT, Pairs(400.0, 40.0), PATH).pairs.tolist())) == {(0, 1)}
    named = type("Named", (rk.PD,), {})(7.0, 0.2)
    assert_allclose(*(rk.simulate(ROBOT, rk.CommandFilter(pd), PATH, OFFSET).c for pd in (named, plain)), atol=1e-9)
    for more in (law, gained, Kicking(7.0, 0.2, 1e-3)):
        with pytest.raises(ValueError, match="allowed: PD, whose commands are filtered, and no more than it"):
            rk.CommandFilter(more)


def test_a_step_of_a_users_does_not_pass_by_a_formula_of_a_users():
    """It asks a step of the package that does not use the formula: refused, unless its class has both."""
    plain = rk.PD(7.0, 0.2)
    for base, given in ((rk.PID, (7.0, 1.0, 0.2)), (rk.AntagonismFilter, (plain,)), (rk.SwitchedCTC, (400.0, 40.0))):

        class Asking(kicked(base)):
            def step(self, memory, sample):
                return super().step(memory, sample)

        class Pushing(base):
            def step(self, memory, sample):
                c, memory = super().step(memory, sample)
                return c + 1e-3, memory

            def torque(self, *told):
                return super().torque(*told) + 1e-3

        pushed, whole = (rk.simulate(ROBOT, kind(*given), PATH).c[0] for kind in (Pushing, base))
        assert_allclose(pushed, whole + 1e-3, rtol=0, atol=1e-12)
        for refused in (Asking(*given), rk.AntagonismFilter(Asking(*given))):
            with pytest.raises(ValueError, match=rf"Kicked\.torque is of your own, but {base.__name__}\.step does not"):
                rk.simulate(ROBOT, refused, PATH, OFFSET)

    class Called(rk.CompiledLaw):
        def __call__(self, *given):
            return 2.0 * super().__call__(*given)

    with pytest.raises(ValueError, match=r"Called\.__call__ is of your own, but a run asks for step"):
        rk.simulate(ROBOT, Called(lambda t, q_a, qd_a, d: np.zeros(3)), PATH)


def test_a_law_that_would_wait_is_refused_before_it_runs():
    async def law(t, q_a, qd_a, desired):
        return np.zeros(3)

    class Call:
        async def __call__(self, t, q_a, qd_a, desired):
            return np.zeros(3)

    class Step(rk.Law):
        async def step(self, memory, sample):
            return np.zeros(3), memory

    class Start(rk.Law):
        async def start(self, model, dt):
            return np.zeros(3)

        def step(self, memory, sample):
            return np.zeros(3), memory

    for wrong in (law, Call(), Step(), Start(), rk.compiled(law), rk.AntagonismFilter(rk.compiled(law))):
        with pytest.raises(ValueError, match=r"is a coroutine; allowed: def, not async def$"):
            rk.simulate(ROBOT, wrong, PATH)


def test_a_call_that_no_run_asks_for_is_refused():
    """A law is asked for its step: a class on one that only says what a call gives would run as the law below it."""
    for base, given in ((rk.Law, ()), (rk.PD, (7.0, 0.2)), (rk.CTC, (400.0, 40.0))):

        class Called(base):
            def __call__(self, t, q_a, qd_a, desired):
                return np.zeros(3)

        class Both(Called):
            def step(self, memory, sample):
                return self(sample.t, sample.q_a, sample.qd_a, sample.desired), memory

        with pytest.raises(ValueError, match=r"Called\.__call__ is of your own, but a run asks for step"):
            rk.simulate(ROBOT, Called(*given), PATH)
        assert not rk.simulate(ROBOT, Both(*given), PATH).c.any()


class Slotted(rk.PD):
    __slots__ = ("kick",)

    def __init__(self, kick):
        super().__init__(7.0, 0.2)
        self.kick = kick

    def step(self, memory, sample):
        return super().step(memory, sample)[0] + self.kick, memory


class Looped(Slotted):
    """What it has set leads back to itself."""

    def __init__(self, kick):
        super().__init__(kick)
        self.double, self.kicked = lambda c: c + 2 * self.kick, self._kicked

    def _kicked(self, c):
        return c + self.kick


class Louder(rk.CompiledLaw):
    def step(self, memory, sample):
        return super().step(memory, sample)[0] + 1e-3, memory


def still(t, q_a, qd_a, d):
    return np.zeros(3)


def test_what_a_class_sets_is_copied_in_slots_and_in_circles():
    assert Slotted(1e-3) == Slotted(1e-3) != Slotted(2e-3) and "kick=0.001" in repr(Slotted(1e-3))
    for law in (Slotted(1e-3), pickle.loads(pickle.dumps(Slotted(1e-3))), Looped(1e-3), Louder(still)):
        run = rk.simulate(ROBOT, law, PATH)
        assert_allclose(run.c[0], 1e-3, rtol=0, atol=1e-12)
        assert type(run.law) is type(law) and run == rk.simulate(ROBOT, law, PATH)
    law = Looped(1e-3)
    twin = copy.deepcopy(law)
    assert law == Looped(1e-3) == twin != Looped(2e-3) and twin.kicked.__self__ is twin
    assert "kick=0.001" in repr(law) and pickle.loads(pickle.dumps(Louder(still))) == Louder(still)


def test_a_controller_without_dt_samples_at_a_millisecond():
    """A constant error e adds -K_I e dt per sample."""
    hold, e = rk.hold(ROBOT, [0.0, 0.0]), 0.01
    controller = rk.Controller(rk.PID(K_P=1.0, K_I=8.0, K_D=0.1), ROBOT)
    first, second = (controller(t, hold.q_a[0] + e, hold.qd_a[0], hold[0]) for t in (0.0, 1e-3))
    assert_allclose(second - first, -8.0 * e * 1e-3, rtol=1e-6)


class Shifts(rk.Law):
    def step(self, memory, sample):
        sample.q_a = sample.q_a + 0.1
        return np.zeros(3), memory


def test_no_law_can_shift_what_was_measured_for_a_filter_around_it():
    with pytest.raises(AttributeError, match="q_a of a Sample cannot be set"):
        rk.simulate(ROBOT, rk.AntagonismFilter(Shifts()), PATH)


@pytest.mark.parametrize("smooth", [True, False])
def test_where_a_controller_looks_for_the_pose_first(smooth):
    """On a parabola through the last three places, whose third difference is zero; else where it was last."""
    path, k = rk.hold(ROBOT, [0.02, 0.03], 0.01), np.arange(7.0)[:, None]
    places, guesses = path.x[0] + k * [1e-4, -2e-4] + k**2 * [3e-5, 1e-5], []
    controller = rk.Controller(rk.AntagonismFilter(PD), ROBOT)
    controller.smooth = smooth
    controller.nearest = lambda q_a, guess: guesses.append(guess) or tuple(places[len(guesses) - 1].tolist())
    for t in path.t[: len(places)]:
        controller(t, path.q_a[0], path.qd_a[0], path[0])
    assert_allclose(guesses[0], path.x[0], rtol=0, atol=0)
    assert_allclose(guesses[3:], places[3:] if smooth else places[2:-1], rtol=0, atol=1e-15)


@pytest.mark.parametrize("beside", [0.0, 3e-10, 1e-8, 1e-7, 1e-5])
def test_a_measured_pose_is_refused_where_the_singular_values_of_a_have_a_ratio_below_3e_8(beside):
    """As in the engine (`solve_regular`): in a mixed mode A has rank one in the middle of a base side."""
    robot = ROBOT.replace(mode=[1, 1, -1])
    x = robot.base[:2].mean(axis=0) + [0.0, beside]
    q, controller = rk.inverse_kinematics(robot, x), rk.Controller(Watch(), robot)
    controller.nearest = lambda q_a, guess: tuple(x.tolist())
    large, small = np.linalg.svd(rk.control_matrix(robot, q), compute_uv=False)
    given = 0.0, q[:3], np.zeros(3), rk.Desired(3, x, np.zeros(2), np.zeros(2), q, np.zeros(6), np.zeros(6))
    if small < 3e-8 * large:
        with pytest.raises(ValueError, match=r"A has lost rank \(an input singularity\) at the measured pose"):
            controller(*given)
    else:
        controller(*given)
    assert (small < 3e-8 * large) == (beside < 1e-9)
