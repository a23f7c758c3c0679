"""Faults of drives and encoders, against their definitions in a few NumPy lines on what a run recorded."""

import copy
import dataclasses
import pickle
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from samples import InPython

import rapkm_lite as rk
from rapkm_lite.simulation.faults import Fault, begins, fault_table
from rapkm_lite.simulation.sensors import Sensors
from rapkm_lite.simulation.setup import prepare

ROBOT = rk.load().replace(friction=0.0)
PATH = rk.circle(ROBOT, radius=0.02, duration=0.3)
OFFSET = np.array([4e-3, -2e-3, 5e-3])
PD = rk.PD(7.05, 0.225)
QUANTUM = 2 * np.pi / 2000


class Reader(rk.Law):
    """PD that keeps its readings."""

    pose = None

    def start(self, model, dt):
        self.readings = []
        return self.readings

    def step(self, memory, sample):
        memory.append(np.concatenate([sample.q_a, sample.qd_a]))
        e, ed = sample.errors()
        return -7.05 * e - 0.225 * ed, memory


def observed(faults, **options):
    """A run, and the angles and rates (k, 3) that its controller read."""
    run = rk.simulate(ROBOT, Reader(), PATH, OFFSET, faults=faults, **options)
    readings = np.array(run.law.readings)
    return run, readings[:, :3], readings[:, 3:]


def test_a_log_holds_what_the_controller_read():
    broken = [rk.EncoderDropout(0, 0.05, 0.1), rk.OffsetJump(1, 0.12, 2e-3), rk.TorqueLimit(0.02)]
    for faults, options in ((), {}), (broken, {"encoder": 2000, "velocity_filter": 5e-3}):
        run, q, _ = observed(faults, **options)
        log = run.log("mine")
        assert_array_equal(log.q_a, q)
        assert_array_equal(log.c, run.c)
        assert_array_equal(log.error, q - PATH.q_a)
        assert log.name == "mine" and np.array_equal(log.t, PATH.t)


def test_errors_of_a_run_and_of_its_log_are_those_that_the_law_saw_with_another_model():
    """At rest PD commands -K_P times them."""
    run = rk.simulate(ROBOT, PD, PATH, OFFSET, model=ROBOT.replace(lengths=0.201))
    assert_allclose(run.c[0], -7.05 * run.log().error[0], rtol=1e-12)
    assert_allclose(run.c[0], -7.05 * (run.error[0] + OFFSET), rtol=1e-12)


def test_a_log_of_a_lost_run_ends_where_it_was_lost():
    with pytest.raises(rk.SimulationError) as caught:
        rk.simulate(ROBOT, rk.PD(7.05, 30.0), PATH, OFFSET)
    part = caught.value.partial
    assert_allclose(part.log().q_a, part.q_a + OFFSET, rtol=0, atol=1e-15)


def commanded(q, qd):
    return -7.05 * (q - PATH.q_a) - 0.225 * (qd - PATH.qd_a)


def rates(q, tau):
    """Backward differences of the readings through the low-pass of `velocity_filter`."""
    rate = np.zeros_like(q)
    for k in range(1, len(q)):
        rate[k] = rate[k - 1] + PATH.dt / (tau + PATH.dt) * ((q[k] - q[k - 1]) / PATH.dt - rate[k - 1])
    return rate


def test_no_faults_change_nothing():
    for none in ((), None, [rk.TorqueLimit(np.inf)], [rk.DeadDrive(0, 9.0)], [rk.OffsetJump(1, 9.0, 1.0)]):
        run, q, qd = observed(none)
        assert_array_equal(run.c, observed(())[0].c)
        assert_allclose(run.c, rk.simulate(ROBOT, PD, PATH, OFFSET).c, rtol=0, atol=1e-10)


@pytest.mark.parametrize("limit", [0.15, [0.1, np.inf, 0.2]], ids=["one", "each"])
def test_torque_limit(limit):
    run, q, qd = observed(rk.TorqueLimit(limit))
    wanted = commanded(q, qd)
    assert_allclose(run.c, np.clip(wanted, -np.array(limit), np.array(limit)), rtol=0, atol=1e-14)
    assert (np.abs(wanted) > limit).any() and not (np.abs(wanted) > limit).all()
    # Two limits: the lower one counts.
    assert_array_equal(
        observed([rk.TorqueLimit(limit), rk.TorqueLimit(1.0), rk.TorqueLimit(limit)])[0].c,
        observed([rk.TorqueLimit(np.minimum(limit, 1.0))])[0].c,
    )


def test_a_run_that_names_no_model_had_the_machine_itself():
    run = rk.simulate(ROBOT, PD, PATH, OFFSET)
    assert dataclasses.replace(run, model=None) == run and run.model == ROBOT


@pytest.mark.parametrize("wrong", [np.nan, np.inf])
def test_times_of_a_run_are_finite(wrong):
    run = rk.simulate(ROBOT, PD, PATH, OFFSET)
    with pytest.raises(ValueError, match=r"t = .*; allowed: an array of finite numbers"):
        dataclasses.replace(run, t=np.append(run.t[:-1], wrong))


def test_drives_that_may_give_nothing_are_all_dead():
    """A limit of zero is one: the rest of the path is the motion of a machine without torques, which stands still."""
    path = rk.hold(ROBOT, [0.03, -0.02], 0.1)
    runs = [
        rk.simulate(ROBOT, PD, path, OFFSET, faults=faults)
        for faults in (rk.TorqueLimit(0.0), rk.TorqueLimit([0.0, 0.0, 0.0]), [rk.DeadDrive(i, 0.0) for i in range(3)])
    ]
    for run in runs:
        assert not run.c.any() and not run.energy.any()
        assert_allclose(run.x, path.x, rtol=0, atol=1e-12)


def test_a_limit_is_felt_where_a_torque_of_any_drive_reaches_it():
    assert not rk.TorqueLimit(0.3).felt(np.array([0.1, -0.29, 0.0]))
    assert rk.TorqueLimit(0.3).felt(np.array([0.1, -0.3, 0.0]))
    assert not rk.TorqueLimit([0.3, 0.3, 0.5]).felt(np.array([0.1, 0.0, -0.4]))


@pytest.mark.parametrize("sign", [1, -1])
def test_a_jump_is_felt_where_it_is_far_above_the_offsets_of_a_calibrated_machine(sign):
    """Those are some milliradians, as in the chapter; a slipping coupling loses degrees."""
    for size, felt in ((5e-3, False), (np.deg2rad(3.0), True), (np.deg2rad(30.0), True)):
        assert rk.OffsetJump(0, 0.1, sign * size).felt(np.zeros((9, 3))) == felt


def test_dead_drive():
    run, q, qd = observed([rk.DeadDrive(1, 0.1)])
    wanted = commanded(q, qd)
    wanted[100:, 1] = 0.0  # t[100] = 0.1 s
    assert_allclose(run.c, wanted, rtol=0, atol=1e-14)
    assert np.abs(run.c[99, 1]) > 0.0
    late, healthy = (observed(faults)[0] for faults in ([rk.DeadDrive(1, PATH.t[-1] + PATH.dt)], []))
    assert_array_equal(late.c, healthy.c)  # after the end of the path
    assert_array_equal(run.energy, rk.copper_loss(ROBOT, run.c[:-1], PATH.dt) + rk.mechanical_work(run))


@pytest.mark.parametrize("encoder", [None, 2000], ids=["ideal", "counts"])
def test_offset_jump(encoder):
    run, q, qd = observed(
        [rk.OffsetJump(2, 0.1, -3e-3), rk.OffsetJump(2, 0.2, 1e-3), rk.OffsetJump(0, 0.0, 2e-3)], encoder=encoder
    )
    added = np.zeros_like(q)
    added[:, 0] = 2e-3
    added[100:, 2] = -3e-3
    added[200:, 2] = -2e-3
    expected = run.q_a + OFFSET + added
    if encoder:
        expected = QUANTUM * np.floor(expected / QUANTUM + 0.5)  # the jump comes before the rounding
    assert_allclose(q, expected, rtol=0, atol=1e-12)
    assert_array_equal(qd, run.qd_a)


@pytest.mark.parametrize(
    ("start", "stop", "first", "last"), [(0.1, 0.2, 100, 199), (0.0, 0.05, 0, 49), (0.25, 1.0, 250, 300)]
)
@pytest.mark.parametrize("encoder", [None, 2000], ids=["ideal", "counts"])
def test_encoder_dropout_with_ideal_rates(start, stop, first, last, encoder):
    run, q, qd = observed([rk.EncoderDropout(1, start, stop)], encoder=encoder)
    true = run.q_a + OFFSET
    if encoder:
        true = QUANTUM * np.floor(true / QUANTUM + 0.5)
    expected, rate = true.copy(), run.qd_a.copy()
    expected[first : last + 1, 1] = true[max(first - 1, 0), 1]
    rate[first : last + 1, 1] = 0.0
    assert_allclose(q, expected, rtol=0, atol=1e-12)
    assert_array_equal(qd, rate)


def test_encoder_dropout_with_filtered_rates():
    """Rates belong to readings: those of a repeated reading decay, and its end is one large difference."""
    run, q, qd = observed([rk.EncoderDropout(1, 0.1, 0.2)], encoder=2000, velocity_filter=3e-3)
    expected = QUANTUM * np.floor((run.q_a + OFFSET) / QUANTUM + 0.5)
    expected[100:200, 1] = expected[99, 1]
    assert_allclose(q, expected, rtol=0, atol=1e-12)
    assert_allclose(qd, rates(q, 3e-3), rtol=0, atol=1e-9)
    assert np.abs(qd[190:200, 1]).max() < 1e-9 < np.abs(qd[200, 1])


def test_a_jump_under_a_dropout_is_read_when_the_encoder_comes_back():
    run, q, _ = observed([rk.EncoderDropout(0, 0.1, 0.2), rk.OffsetJump(0, 0.15, 5e-3)])
    expected = run.q_a + OFFSET
    expected[150:, 0] += 5e-3
    expected[100:200, 0] = expected[99, 0]
    assert_allclose(q, expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    "law",
    [
        PD,
        rk.AntagonismFilter(PD),
        rk.CommandFilter(PD),
        rk.CTC(900.0, 60.0, None),
        rk.RedundantCTC(900.0, 60.0),
        rk.SwitchedCTC(900.0, 60.0),
    ],
    ids=lambda law: type(law).__name__,
)
def test_laws_of_the_package_meet_the_same_faults(law):
    """The torques of a healthy controller on the readings, then the faults of the drives."""
    path = rk.circle(ROBOT, radius=0.05, duration=0.15)
    faults = [
        rk.TorqueLimit(0.35),
        rk.DeadDrive(0, 0.12),
        rk.OffsetJump(1, 0.05, 2e-3),
        rk.EncoderDropout(2, 0.03, 0.06),
    ]
    run = rk.simulate(ROBOT, law, path, OFFSET, faults=faults)
    read, rate = run.q_a + OFFSET, run.qd_a.copy()
    read[50:, 1] += 2e-3
    read[30:60, 2], rate[30:60, 2] = read[29, 2], 0.0
    controller = rk.Controller(law, ROBOT, path.dt)
    c = np.array([controller(t, read[k], rate[k], path[k]) for k, t in enumerate(path.t)])
    limited = np.clip(c, -0.35, 0.35)
    limited[120:, 0] = 0.0
    assert_allclose(run.c, limited, rtol=0, atol=1e-9)
    assert (limited != c).any()


def test_sweeps_meet_the_same_faults():
    faults, offsets = [rk.DeadDrive(0, 0.1), rk.TorqueLimit(0.3)], np.array([OFFSET, 0 * OFFSET, -OFFSET])
    for law in (PD, rk.RedundantCTC(900.0, 60.0)):
        path = rk.circle(ROBOT, radius=0.02, duration=0.15)
        study = rk.sweep(ROBOT, law, path, offsets, faults=faults)
        for i in range(3):
            run = rk.simulate(ROBOT, law, path, offsets[i], faults=faults)
            assert_allclose(study.energies[i], run.energy, rtol=0, atol=1e-11)
            assert_allclose(study.x_final[i], run.x[-1], rtol=0, atol=1e-12)


def test_a_run_knows_its_sensors_and_faults():
    faults, sensors = [rk.DeadDrive(0, 0.1)], rk.Sensors(OFFSET, 2000, 2e-3)
    run = rk.simulate(ROBOT, PD, PATH, OFFSET, 2000, velocity_filter=2e-3, faults=faults)
    assert run.faults == (rk.DeadDrive(0, 0.1),) and run.sensors == sensors
    assert run == rk.simulate(ROBOT, PD, PATH, sensors=sensors, faults=faults) == pickle.loads(pickle.dumps(run))
    assert run != rk.simulate(ROBOT, PD, PATH, sensors=sensors)
    with pytest.raises(ValueError, match="allowed: one of the two"):
        rk.simulate(ROBOT, PD, PATH, OFFSET, sensors=sensors)


def test_times_between_samples_and_on_them():
    """A fault acts from the first sample at or after its time, of which a millionth of a sample is rounding."""
    t = np.arange(301) * (0.3 / 300)
    for k in range(301):
        assert np.argmin(fault_table([rk.DeadDrive(0, k * 1e-3)], t, 3).alive[:, 0]) == k
    assert np.argmin(fault_table([rk.DeadDrive(0, 0.1004)], t, 3).alive[:, 0]) == 101
    for late, first in ((0.7e-9, 100), (1.4e-9, 101)):
        assert np.argmin(fault_table([rk.DeadDrive(0, 0.1 + late)], t, 3).alive[:, 0]) == first
    assert fault_table([], t, 3) is None


def test_a_new_fault_is_one_class():
    class Weak(Fault):
        """All drives give half from the start on."""

        def mark(self, table, t):
            np.minimum(table.limit, 0.05, out=table.limit)

    assert np.abs(rk.simulate(ROBOT, PD, PATH, OFFSET, faults=[Weak()]).c).max() == 0.05


@dataclass(frozen=True, eq=False, repr=False)
class Pair(Fault):
    """Two drives die."""

    first: int
    second: int
    time: float

    def __post_init__(self):
        self._check()
        super().__post_init__()

    def mark(self, table, t):
        table.alive[t >= self.time, self.first] = table.alive[t >= self.time, self.second] = False


def test_a_new_fault_of_two_drives_has_its_times_checked():
    both, each = Pair(0, 2, 0.1), [rk.DeadDrive(0, 0.1), rk.DeadDrive(2, 0.1)]
    assert np.array_equal(rk.simulate(ROBOT, PD, PATH, faults=[both]).c, rk.simulate(ROBOT, PD, PATH, faults=each).c)
    with pytest.raises(ValueError, match="time"):
        Pair(0, 2, -1.0)


@dataclass(frozen=True, eq=False, repr=False)
class Share(Fault):
    """A drive gives a share of its torque, with its sign."""

    drive: int
    share: float

    def mark(self, table, t):
        table.alive[:, self.drive] *= self.share


@pytest.mark.parametrize("law", [PD, InPython(PD)], ids=["engine", "python"])
def test_a_drive_that_gives_a_share_of_its_torque_is_one_with_other_gains(law):
    faults, share = [Share(0, -0.2), Share(2, 0.5)], np.array([-0.2, 1.0, 0.5])

    def other(t, q_a, qd_a, desired):
        return -share * (7.05 * (q_a - desired.q_a) + 0.225 * (qd_a - desired.qd_a))

    for more in ([], [rk.TorqueLimit(0.03)]):
        run = rk.simulate(ROBOT, law, PATH, OFFSET, faults=[*faults, *more])
        expected = rk.simulate(ROBOT, other, PATH, OFFSET, faults=more)
        assert_allclose(run.c, expected.c, rtol=0, atol=1e-10)
        assert_allclose(run.x, expected.x, rtol=0, atol=1e-10)


def test_the_first_samples_of_a_run_have_the_first_rows_of_every_entry_of_the_table():
    setup = prepare(ROBOT, PATH, Sensors(0.0), None, [rk.EncoderDropout(0, 0.0, 0.1)]).begin(50)
    assert {len(rows) for name, rows in setup.faults._asdict().items() if name != "limit"} == {50}


class Weaker(Fault):
    """No dataclass: it is told apart by what it has set."""

    def __init__(self, limit):
        self.limit = limit

    def mark(self, table, t):
        np.minimum(table.limit, self.limit, out=table.limit)


def test_a_new_fault_needs_to_be_no_dataclass():
    fault = Weaker(0.05)
    assert repr(fault) == "Weaker(limit=0.05)" and fault == Weaker(0.05) != Weaker(0.04)
    assert hash(fault) == hash(Weaker(0.05)) and pickle.loads(pickle.dumps(fault)) == fault == copy.deepcopy(fault)
    run = rk.simulate(ROBOT, PD, PATH, OFFSET, faults=[fault])
    assert np.abs(run.c).max() == 0.05 and pickle.loads(pickle.dumps(run)) == run
    assert np.abs(rk.simulate(ROBOT, PD, PATH, OFFSET, faults=[Weaker(0.04)]).c).max() == 0.04


class Orphan:
    """It can do what a fault can, and derives from none."""

    def mark(self, table, t):
        table.limit[:] = 0.1


class Noise(Fault):
    """It remembers what it has drawn."""

    def __init__(self, seed):
        self.random = np.random.default_rng(seed)

    def mark(self, table, t):
        table.jump[:] += 1e-3 * self.random.normal(size=table.jump.shape)


def test_a_new_fault_with_memory_begins_anew_in_every_run():
    fault = Noise(1)
    first, second = (rk.simulate(ROBOT, PD, PATH, OFFSET, faults=[fault]) for _ in range(2))
    assert first == second and fault == Noise(1) and np.ptp(np.diff(first.c, axis=0)) > 1e-3
    rows = rk.sweep(ROBOT, PD, PATH, OFFSET, faults=[fault]).energies
    np.testing.assert_allclose(rows[0], first.energy, rtol=1e-9)


@pytest.mark.parametrize(
    ("drive", "write", "words"),
    [
        (-1, lambda table: None, r"drive = -1 in .*; allowed: 0 to 2"),
        ("0", lambda table: None, r"drive = '0' in .*; allowed: 0 to 2"),
        (0, lambda table: table, r"mark returns something; allowed: to write into the table"),
        (0, lambda table: table.jump.fill(np.nan), r"writes a table that no run can have; allowed"),
        (0, lambda table: table.jump.fill(np.inf), r"writes a table that no run can have; allowed"),
        (0, lambda table: table.alive.fill(np.nan), r"writes a table that no run can have; allowed"),
        (0, lambda table: table.jump.__setitem__((3, 1), np.inf), r"writes a table that no run can have; allowed"),
        (0, lambda table: table.limit.__setitem__(1, np.nan), r"writes a table that no run can have; allowed"),
        (0, lambda table: table.limit.fill(np.nan), r"writes a table that no run can have; allowed"),
        (0, lambda table: table.limit.__setitem__(1, -0.1), r"allowed: limits >= 0, finite jumps"),
        (0, lambda table: table.limit.fill(-0.1), r"allowed: limits >= 0, finite jumps"),
    ],
)
def test_a_new_fault_that_marks_wrongly_is_named(drive, write, words):
    class Wrong(Fault):
        def mark(self, table, t):
            return write(table)

    Wrong.drive = drive
    for call in (rk.simulate, rk.sweep):
        with pytest.raises(ValueError, match=words):
            call(ROBOT, PD, PATH, OFFSET, faults=[Wrong()])


def test_a_fault_of_the_package_says_itself_what_does_not_fit():
    with pytest.raises(ValueError, match=r"^limit has shape \(2,\); allowed: one number or \(3,\)$"):
        rk.simulate(ROBOT, PD, PATH, faults=rk.TorqueLimit([0.1, 0.2]))


def test_what_a_new_fault_raises_comes_through():
    class Odd(Fault):
        def mark(self, table, t):
            raise KeyError("here")

    with pytest.raises(KeyError, match="here"):
        rk.simulate(ROBOT, PD, PATH, faults=[Odd()])


def test_the_beginning_of_a_run_has_the_beginning_of_its_faults():
    begun = prepare(ROBOT, PATH, Sensors(), faults=[rk.OffsetJump(0, 0.005, 1e-3)]).begin(11)
    assert len(begun.trajectory) == 11
    for name in ("alive", "held", "jump"):
        assert len(getattr(begun.faults, name)) == 11


TOML = """
name = "broken"
[manipulator]
base = [[-0.2, -0.1], [0.2, -0.1], [0.0, 0.2]]
lengths = 0.25
masses = 0.1
[control]
K_P = 7.0
K_D = 0.2
[path]
side = 0.05
duration = 0.3
[sensor]
offset = [1e-3, 0.0, 0.0]
encoder = 2000
velocity_filter = 2e-3
"""
FAULTS = """
[[fault]]
kind = "DeadDrive"
drive = 1
time = 0.1
[[fault]]
kind = "TorqueLimit"
limit = [0.3, 0.3, inf]
"""


def test_the_same_in_a_data_file(tmp_path):
    file = tmp_path / "broken.toml"
    file.write_text(TOML + FAULTS)
    given = rk.experiment(file)
    assert given.faults == (rk.DeadDrive(1, 0.1), rk.TorqueLimit([0.3, 0.3, np.inf]))
    assert given.sensors == rk.Sensors([1e-3, 0.0, 0.0], 2000, 2e-3)
    run = rk.simulate(
        given.robot,
        given.law,
        given.trajectory,
        [1e-3, 0, 0],
        2000,
        velocity_filter=2e-3,
        faults=[rk.DeadDrive(1, 0.1), rk.TorqueLimit([0.3, 0.3, np.inf])],
    )
    assert given.run() == run and not run.c[100:, 1].any()
    assert rk.experiment(file) == given == pickle.loads(pickle.dumps(given))
    # At 1 kHz, where nothing else is asked for.
    assert (given.trajectory.dt, len(given.trajectory)) == (1e-3, 301)
    file.write_text(TOML.replace("[path]", "dt = 5e-3\n[path]"))
    assert (rk.experiment(file).trajectory.dt, len(rk.experiment(file).trajectory)) == (5e-3, 61)


@dataclass(frozen=True, eq=False, repr=False)
class Ripple(Fault):
    """A fault of a user's with a field that may be left out."""

    drive: int
    frequency: float = 2.0

    def mark(self, table, t):
        table.jump[:, self.drive] += 1e-3 * np.sin(2 * np.pi * self.frequency * t)


class LateRipple(Ripple):
    """A fault that derives from one that derives from `Fault`."""

    def mark(self, table, t):
        table.jump[t > 0.1, self.drive] += 1e-3


class Named(Fault):
    """A fault of a user's that passes on what else it is told."""

    def __init__(self, time=0.1, *more, **named):
        self._set(time=time)

    def mark(self, table, t):
        table.jump[t > self.time, 0] += 1e-3


@pytest.mark.parametrize(
    ("entries", "fault"),
    [
        ('kind = "Named"\n', Named()),
        ('kind = "Named"\ntime = 0.2\n', Named(0.2)),
        ('kind = "LateRipple"\ndrive = 1\n', LateRipple(1)),
        ('kind = "Ripple"\ndrive = 1\n', Ripple(1)),
        ('kind = "Ripple"\ndrive = 1\nfrequency = 3.0\n', Ripple(1, 3.0)),
        ('kind = "Weaker"\nlimit = 0.05\n', Weaker(0.05)),
    ],
)
def test_what_has_a_default_may_be_left_out_of_a_data_file(tmp_path, entries, fault):
    file = tmp_path / "broken.toml"
    file.write_text(f"{TOML}[[fault]]\n{entries}")
    assert rk.experiment(file).faults == (fault,)


def test_a_unit_that_nobody_knows_is_refused(tmp_path):
    file = tmp_path / "broken.toml"
    file.write_text(f'{TOML}[[fault]]\nkind = "Ripple"\ndrive = 1\nfrequency = {{ value = 3.0, unit = "kHz" }}\n')
    with pytest.raises(ValueError, match=r"frequency in \[\[fault\]\] has the unit 'kHz', which is not known here"):
        rk.experiment(file)
    file.write_text(f'{TOML}[[fault]]\nkind = "Ripple"\ndrive = 1\nfrequency = {{ value = 3.0, source = "ours" }}\n')
    assert rk.experiment(file).faults == (Ripple(1, 3.0),)


def test_faults_that_do_not_fit_the_machine_are_refused_when_a_file_is_read(tmp_path):
    file = tmp_path / "broken.toml"
    for entries, words in (
        ('kind = "DeadDrive"\ndrive = 9\ntime = 0.1\n', "drive = 9 in .*; allowed: 0 to 2"),
        ('kind = "TorqueLimit"\nlimit = [0.1, 0.2]\n', r"limit has shape \(2,\); allowed: one number or \(3,\)"),
    ):
        file.write_text(f"{TOML}[[fault]]\n{entries}")
        with pytest.raises(ValueError, match=words):
            rk.experiment(file)
    given = rk.experiment("testbed")
    with pytest.raises(ValueError, match=r"drive = 3 in .*; allowed: 0 to 2"):
        rk.Experiment(given.robot, given.law, given.trajectory, given.sensors, [rk.DeadDrive(3, 0.1)])
    with pytest.raises(ValueError, match=r"K_P has shape \(2,\); allowed: one number, \(3,\)"):
        rk.Experiment(given.robot, rk.PD([7.0, 7.0], [0.2, 0.2]), given.trajectory, given.sensors)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[[fault]]\ndrive = 1\n", r"allowed: a table with kind = one of TorqueLimit, DeadDrive"),
        ('[[fault]]\nkind = "DeadDrives"\n', r"unknown kind of fault 'DeadDrives' \(did you mean 'DeadDrive'\?\)"),
        ('[[fault]]\nkind = "DeadDrive"\ndrive = 1\n', "the fault DeadDrive: missing .* 'time'; allowed: drive, time"),
        (
            '[[fault]]\nkind = "Ripple"\nfrequency = 1\n',
            "the fault Ripple: missing .* 'drive'; allowed: drive, freq",
        ),
        ('[[fault]]\nkind = "DeadDrive"\ndrive = 1\ntimes = 1\n', r"unknown entry of DeadDrive 'times' \(did you mean"),
    ],
)
def test_mistakes_in_a_data_file(tmp_path, text, message):
    file = tmp_path / "broken.toml"
    file.write_text(TOML + text)
    with pytest.raises(ValueError, match=message):
        rk.experiment(file)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: rk.TorqueLimit(-0.1), r"limit = -0\.1; allowed: >= 0"),
        (lambda: rk.TorqueLimit(np.nan), "limit = nan; allowed: finite numbers"),
        (lambda: rk.TorqueLimit(None), "limit = None is not numeric"),
        (lambda: rk.TorqueLimit(np.ones((2, 2))), r"limit has shape \(2, 2\)"),
        (lambda: rk.DeadDrive(-1, 0.1), "drive = -1; allowed: >= 0"),
        (lambda: rk.DeadDrive(1.5, 0.1), r"drive = 1\.5; allowed: whole numbers"),
        (lambda: rk.DeadDrive(1, -0.1), r"time = -0\.1; allowed: >= 0"),
        (lambda: rk.DeadDrive(1, None), "time = None is not numeric"),
        (lambda: rk.OffsetJump(1, 0.1, np.inf), "jump = inf; allowed: finite numbers"),
        (lambda: rk.EncoderDropout(1, 0.2, 0.2), r"stop = 0\.2 s; allowed: later than start = 0\.2 s"),
        (
            lambda: rk.simulate(ROBOT, PD, PATH, faults=[rk.DeadDrive(3, 0.1)]),
            "drive = 3 in .*; allowed: 0 to 2, drives",
        ),
        (lambda: rk.sweep(ROBOT, PD, PATH, OFFSET, faults=[rk.DeadDrive(3, 0.1)]), "drive = 3"),
        (
            lambda: rk.simulate(ROBOT, PD, PATH, faults=[rk.TorqueLimit([1.0, 2.0])]),
            r"limit has shape \(2,\); .* \(3,\)",
        ),
        (
            lambda: rk.simulate(ROBOT, PD, PATH, faults=["dead"]),
            "faults holds 'dead'; allowed: values of TorqueLimit",
        ),
        (lambda: rk.simulate(ROBOT, PD, PATH, faults=rk.DeadDrive), r"faults holds .*DeadDrive'>; allowed: values of "),
        (lambda: rk.simulate(ROBOT, PD, PATH, faults=[Weaker]), r"faults holds .*Weaker'>; allowed: values of "),
        (
            lambda: rk.simulate(ROBOT, PD, PATH, faults=[Orphan()]),
            r"faults holds .*; allowed: values of .* that derives from rapkm_lite\.simulation\.faults\.Fault",
        ),
        (lambda: rk.Sensors(encoder=0), "encoder = 0; allowed: >= 1"),
        (lambda: rk.Sensors(velocity_filter=-1.0), "velocity_filter = -1; allowed: >= 0"),
        (lambda: rk.simulate(ROBOT, PD, PATH, sensors=2000), "sensors = 2000; allowed: Sensors"),
    ],
)
def test_bad_faults_and_sensors(make, message):
    with pytest.raises(ValueError, match=message):
        make()


@pytest.mark.parametrize("offset", [np.zeros((2, 3)), np.zeros((1, 3)), [], np.zeros((0, 3))])
def test_offsets_of_sensors_are_those_of_one_machine(offset):
    """Those of many runs are given to `sweep`."""
    with pytest.raises(ValueError, match=r"offset has shape .*; allowed: one number or \(N,\), one per drive"):
        Sensors(offset)


@pytest.mark.parametrize("dead_from", [0.13, 0.18])
def test_a_dead_drive_takes_a_five_bar_through_a_singularity_and_no_loop_loses_the_pose(dead_from):
    """Encoders without errors tell the true pose on both sides of it, far from the path, too: the way goes on there."""
    robot = rk.load("five_bar").replace(friction=0.0)
    path, law = rk.circle(robot, 0.04, 0.3), rk.CTC(400.0, 40.0, None)
    faults = [rk.DeadDrive(0, dead_from)]
    truth = rk.simulate(robot, rk.CTC(400.0, 40.0, None, pose="true"), path, faults=faults)
    crossing = np.linalg.det(rk.control_matrix(robot, rk.inverse_kinematics(robot, truth.x)))
    assert crossing.min() < 0.0 < crossing.max() and np.abs(truth.q_a - path.q_a).max() > 0.3
    for here in (law, InPython(law)):
        assert_allclose(rk.simulate(robot, here, path, faults=faults).x, truth.x, atol=1e-7)
    study = rk.sweep(robot, law, path, np.zeros((9, 2)), faults=faults)
    assert_allclose(study.x_final, np.tile(truth.x[-1], (9, 1)), atol=1e-7)


@pytest.mark.parametrize("time", [(0.005, 0.1), "early", None])
def test_a_fault_of_a_users_may_tell_several_times_or_none(time):
    """Its run is lost in words, with all samples before: the cause looks at when faults begin."""

    class Slips(Fault):
        def __init__(self):
            self.time = time

        def mark(self, table, t):
            table.jump[t >= 0.005, 0] += 0.3

    assert begins(Slips()) == (0.005 if isinstance(time, tuple) else 0.0)  # the first, or the start of the run
    with pytest.raises(rk.SimulationError, match="left the workspace") as lost:
        rk.simulate(ROBOT, rk.PD(7.05, 30.0), PATH, faults=[Slips()])
    assert len(lost.value.partial) > 5


def test_a_dropout_ends_at_the_sample_of_its_end_whatever_rounding_made_of_both():
    """k samples for every end 7 k / 10000 s, many of which are more than k times 7e-4 s in the last bit."""
    from rapkm_lite.simulation.faults import blank_table

    t = 7e-4 * np.arange(201)
    for k in range(1, 201):
        table = blank_table(t, 3)
        rk.EncoderDropout(1, 0.0, 7 * k / 10000).mark(table, t)
        assert table.held[:, 1].tolist() == [True] * k + [False] * (201 - k)
    assert any(t[k] < 7 * k / 10000 for k in range(201))
