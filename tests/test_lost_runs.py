"""Nothing is lost: a run that stops keeps its samples and the reason, a sweep its finished rows."""

import copyreg
import json
import os
import pickle
import signal
import subprocess
import sys
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import rapkm_lite as rk
from rapkm_lite import engine
from rapkm_lite.engine import loop
from rapkm_lite.simulation import chunks, compiled, explain, pools, runs, sweeps
from rapkm_lite.simulation import loop as loop_in_python
from rapkm_lite.simulation.chunks import Columns
from rapkm_lite.simulation.setup import Outcome, prepare

ROBOT = rk.load().replace(friction=0.0)
PATH = rk.circle(ROBOT, radius=0.03, duration=0.3)
OFFSET = np.array([4e-3, -2e-3, 5e-3])
PD = rk.PD(7.05, 0.225)


def pd(t, q_a, qd_a, desired):
    return -7.05 * (q_a - desired.q_a) - 0.225 * (qd_a - desired.qd_a)


class FailsAt:
    """PD that does something else from `time` on."""

    def __init__(self, time, act):
        self.time, self.act = time, act

    def __call__(self, t, q_a, qd_a, desired):
        return pd(t, q_a, qd_a, desired) if t < self.time - 1e-9 else self.act()


def stop():
    raise StopIteration


def boom():
    raise KeyError("gain table")


def interrupt():
    raise KeyboardInterrupt


def die():
    os._exit(1)


def lost(robot, law, path, offset=0.0, **options):
    with pytest.raises(rk.SimulationError) as caught:
        rk.simulate(robot, law, path, offset, **options)
    return caught.value


def consistent(error, rows):
    """The part of the run that an error carries is a `Run` of so many rows, ready to be looked at."""
    run = error.partial
    assert isinstance(run, rk.Run) and len(run) == rows
    N = run.robot.n_arms
    shapes = {
        "t": (rows,),
        "x": (rows, 2),
        "xd": (rows, 2),
        "q_a": (rows, N),
        "qd_a": (rows, N),
        "c": (rows, N),
        "q": (rows, 2 * N),
        "qd": (rows, 2 * N),
        "error": (rows, N),
        "pairs": (rows, 2),
        "energy": (N,),
    }
    for name, shape in shapes.items():
        assert getattr(run, name).shape == shape and np.all(np.isfinite(getattr(run, name)))
    assert np.all(run.energy == rk.copper_loss(run.robot, run.c[:-1], run.dt) + rk.mechanical_work(run))
    assert repr(run).startswith("Run(")


def test_a_run_has_a_row_for_a_sample_of_its_path_and_fewer_when_it_was_lost():
    run = rk.simulate(ROBOT, rk.PD(7.05, 0.225), rk.hold(ROBOT, [0.0, 0.0], 0.1))
    names = ("t", "x", "xd", "q_a", "qd_a", "c", "pairs")
    for rows in (0, 1, 50, 101):
        part = rk.Run(**(run._fields() | {name: getattr(run, name)[:rows] for name in names}))
        assert part.path_error.shape == (rows,) and part.error.shape == (rows, 3)
    with pytest.raises(ValueError, match=r"t has shape \(101,\); allowed: \(k,\), up to the 51 samples"):
        rk.Run(**(run._fields() | {"trajectory": rk.hold(ROBOT, [0.0, 0.0], 0.05)}))
    with pytest.raises(ValueError, match=r"t has shape \(101, 1\); allowed: \(k,\)"):
        rk.Run(**(run._fields() | {"t": run.t[:, None]}))


# Single runs.
def test_an_exception_of_the_law_keeps_the_samples_before_it():
    error = lost(ROBOT, FailsAt(0.1, boom), PATH, OFFSET)
    assert error.time == PATH.t[100] and error.reason.startswith("the law raised KeyError: 'gain table' (line ")
    assert str(error) == f"at t = 0.1000 s {error.reason}"
    assert error.reason.endswith(' of test_lost_runs.py: raise KeyError("gain table"))')
    assert isinstance(error.__cause__, KeyError) and error.run is None and error.sweep is None
    consistent(error, 100)
    whole = rk.simulate(ROBOT, pd, PATH, OFFSET)
    for name in ("t", "x", "xd", "q_a", "qd_a", "c"):
        assert_array_equal(getattr(error.partial, name), getattr(whole, name)[:100])


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    ("answer", "reason"),
    [
        (lambda: None, "law returned None"),
        (lambda: np.array([0.0, np.nan, 0.0]), r"[1] = nan; allowed: finite numbers"),
        (lambda: np.array([0.0, -1e200, 0.0]), r"[1] = -1e+200; allowed: finite numbers"),
        (lambda: [1.0], "law returned the shape (1,); allowed: (3,)"),
        (lambda: "c", "is not numeric"),
        (lambda: np.zeros((1, 3)), "law returned the shape (1, 3)"),
        (lambda: np.zeros(3) + 0j, "is not numeric"),
        (lambda: (np.zeros(3), None), "is not numeric"),
        (lambda: (c for c in "123"), "is not numeric"),
    ],
)
def test_a_bad_answer_later_on(answer, reason):
    error = lost(ROBOT, FailsAt(0.1, answer), PATH)
    assert reason in error.reason and isinstance(error.__cause__, ValueError)
    consistent(error, 100)


def test_an_exception_without_words():
    assert lost(ROBOT, FailsAt(0.3, stop), PATH).reason.startswith("the law raised StopIteration (line ")


class Mute(Exception):
    """An exception whose words fail themselves: `str` wants text."""

    def __str__(self):
        return self.args[0]


@pytest.mark.parametrize("time", [0.0, 0.1])
def test_an_exception_that_cannot_be_printed_loses_nothing(time):
    def mute():
        raise Mute(3)

    law = FailsAt(time, mute)
    study = rk.sweep(ROBOT, [pd, law], PATH, OFFSET, failed="mask")
    assert study.failed.tolist() == [False, True] and study.reasons[1].startswith("the law raised Mute (line ")
    if time:
        error = lost(ROBOT, law, PATH)
        assert error.reason.startswith("the law raised Mute (line ") and isinstance(error.__cause__, Mute)
        consistent(error, 100)


def test_the_first_sample_belongs_to_the_caller():
    with pytest.raises(KeyError, match="gain table"):
        rk.simulate(ROBOT, FailsAt(0.0, boom), PATH)
    for answer, message in ((lambda: None, "law returned None"), (lambda: np.full(3, np.nan), r"\[0\] = nan")):
        with pytest.raises(ValueError, match=message):
            rk.simulate(ROBOT, FailsAt(0.0, answer), PATH)


def test_an_interrupt_comes_through():
    with pytest.raises(KeyboardInterrupt) as caught:
        rk.simulate(ROBOT, FailsAt(0.1, interrupt), PATH)
    consistent(caught.value, 100)
    assert "up to t = 0.1000 s" in caught.value.__notes__[-1]


@pytest.mark.parametrize("law", [PD, rk.SwitchedCTC(900.0, 60.0), rk.CTC(900.0, 60.0, (0, 4))], ids=repr)
@pytest.mark.parametrize(("before", "rows"), [(True, 49), (False, 60)], ids=["before a part", "after a part"])
def test_an_interrupt_in_the_engine_keeps_what_it_has_done(law, before, rows, monkeypatch):
    """A Ctrl-C is raised when a kernel returns; it did all or nothing of its part of the samples."""
    path = rk.triangle(ROBOT, duration=0.6, dt=0.01)
    whole, real, parts = rk.simulate(ROBOT, law, path, OFFSET), loop.closed_loops, []

    def interrupted(*arguments):
        parts.append(None)
        if not (before and len(parts) == 2):
            real(*arguments)
        if len(parts) == 2:
            raise KeyboardInterrupt

    monkeypatch.setattr(loop, "closed_loops", interrupted)
    monkeypatch.setattr(compiled, "PART", 50)
    with pytest.raises(KeyboardInterrupt) as caught:
        rk.simulate(ROBOT, law, path, OFFSET)
    consistent(caught.value, rows)
    for name in ("t", "x", "xd", "q_a", "qd_a", "c", "pairs"):
        assert_array_equal(getattr(caught.value.partial, name), getattr(whole, name)[:rows])


def test_an_interrupt_before_the_first_sample_comes_through_as_it_is(monkeypatch):
    """Nothing is lost, as nothing was done."""
    stop = KeyboardInterrupt()
    monkeypatch.setattr(loop, "closed_loops", lambda *arguments: (_ for _ in ()).throw(stop))
    with pytest.raises(KeyboardInterrupt) as caught:
        rk.simulate(ROBOT, PD, PATH, OFFSET)
    assert caught.value is stop and vars(stop) == {}


def test_an_interrupt_while_the_cause_is_looked_for_loses_no_run(monkeypatch):
    monkeypatch.setattr(runs, "explain", lambda *arguments: interrupt())
    with pytest.raises(KeyboardInterrupt) as caught:
        rk.simulate(ROBOT, rk.PD(1e4, 0.225), PATH, OFFSET)
    consistent(caught.value, len(caught.value.partial))
    assert 0 < len(caught.value.partial) < len(PATH)


def test_an_interrupt_while_a_run_is_repeated_is_no_run_that_was_lost_again(monkeypatch):
    """The engine hands a Ctrl-C over beside what it has done; here in the first repetition, without the offsets."""
    single, repeated = explain.single, []

    def interrupted(setup, code):
        repeated.append(setup.sensors.offset)
        return single(setup, code)[0], KeyboardInterrupt()

    monkeypatch.setattr(explain, "single", interrupted)
    with pytest.raises(KeyboardInterrupt) as caught:
        rk.simulate(ROBOT, rk.AntagonismFilter(PD), PATH, [1.5, -1.5, 1.5])
    assert isinstance(caught.value.partial, rk.Run) and [offset.any() for offset in repeated] == [False]


@pytest.mark.parametrize(
    "law",
    [rk.PD(1e4, 0.225), rk.PD(1e4 * np.eye(3), 0.225), rk.AntagonismFilter(rk.PD(1e4, 0.225))],
    ids=["engine", "Python", "filter"],
)
def test_a_machine_that_leaves_the_workspace(law):
    error = lost(ROBOT, law, PATH, OFFSET)
    k = round(error.time / PATH.dt)
    consistent(error, k + ("no pose" not in error.reason))  # the torques of the last sample acted, but for a lost pose
    assert "unstable gain" in error.reason and 0 < k < 300


def test_faults_that_are_not_to_blame_are_not_named():
    """Gains far beyond what 1 kHz can hold: without any fault the run is lost as well."""
    faults = [rk.OffsetJump(0, 0.0, 1e-4), rk.EncoderDropout(1, 0.0, 0.002)]
    for broken in (faults, faults[:1], []):
        error = lost(ROBOT, rk.PD(1e4, 0.225), PATH, OFFSET, faults=broken)
        assert "unstable gain" in error.reason and "acts" not in error.reason


def pushes(t, q_a, qd_a, desired):
    return pd(t, q_a, qd_a, desired) if t < 0.3 else np.array([5.0, 0.0, 0.0])


def test_a_fault_that_ended_long_ago_is_not_named():
    """The law throws the machine out, with or without it; named it is as long as it may have."""
    path = rk.hold(ROBOT, [0.0, 0.0], 0.5)
    for broken in ([], [rk.EncoderDropout(0, 0.02, 0.021)]):
        error = lost(ROBOT, pushes, path, faults=broken)
        assert error.time > 0.35 and "look at gains" in error.reason and "acts" not in error.reason
    error = lost(ROBOT, pushes, path, faults=[rk.EncoderDropout(0, 0.02, 0.3)])
    assert "EncoderDropout(0, 0.02, 0.3) acts from t = 0.02 s to 0.3 s" in error.reason


@pytest.mark.parametrize("inner", [pd, PD], ids=["a function", "of the package"])
def test_a_lost_pose_is_laid_to_the_fault_that_changes_readings(inner):
    """A dead drive alone costs no run, the jump alone does."""
    path, law = rk.hold(ROBOT, [0.0, 0.0], 0.3), rk.AntagonismFilter(inner)
    dead, jump = rk.DeadDrive(0, 0.05), rk.OffsetJump(2, 0.1, 2.0)
    assert len(rk.simulate(ROBOT, law, path, faults=[dead])) == len(path)
    for broken in ([jump], [dead, jump]):
        assert f"({jump!r} acts from" in lost(ROBOT, law, path, faults=broken).reason


def test_angles_that_fit_no_pose():
    far = 2.5 * np.array([1.0, -1.0, 1.0])
    still = rk.hold(ROBOT, [0.0, 0.0], 0.01)
    for law in (rk.AntagonismFilter(PD), rk.AntagonismFilter(pd), rk.CTC(900.0, 60.0)):
        error = lost(ROBOT, law, still, far)
        assert "fit no pose" in error.reason and error.time == 0.0
        consistent(error, 0)
    jump = lost(ROBOT, rk.AntagonismFilter(pd), still, faults=[rk.OffsetJump(i, 0.005, far[i]) for i in range(3)])
    assert jump.time == still.t[5] and isinstance(jump.__cause__, rk.ConvergenceError)
    consistent(jump, 5)


class AsksForItsPose(rk.Law):
    def step(self, memory, sample):
        sample.pose("measured")
        return np.zeros(3), memory


def test_a_law_that_asks_for_a_pose_is_told_why_there_is_none():
    still = rk.hold(ROBOT, [0.02, 0.05], 0.01)
    error = lost(ROBOT, AsksForItsPose(), still, faults=[rk.OffsetJump(i, 0.005, (3, -2, 1)[i]) for i in range(3)])
    assert "fit no pose" in error.reason and isinstance(error.__cause__, rk.ConvergenceError)
    assert type(error.__cause__.__cause__) is rk.ConvergenceError  # of the search itself


def test_a_singularity_of_the_coordinates():
    path = rk.triangle(ROBOT, duration=1.5)
    error = lost(ROBOT, rk.CTC(900.0, 60.0, (1, 2)), path, OFFSET)
    assert "singularity of its independent drives 2 and 3" in error.reason
    consistent(error, len(error.partial))
    assert abs(len(error.partial) - error.time / path.dt) <= 1 and np.all(error.partial.pairs == (1, 2))


def test_a_law_of_the_user_is_asked_at_samples_only():
    """A constant push drives the machine out; nobody calls the law to explain that."""
    asked = []

    def push(t, q_a, qd_a, desired):
        asked.append(t)
        return np.array([0.3, 0.0, 0.0])

    for law in (push, rk.AntagonismFilter(push, pose="true")):
        asked.clear()
        error = lost(ROBOT, law, rk.hold(ROBOT, (0.0, 0.0), 1.0))
        consistent(error, len(asked))
        assert_array_equal(asked, error.partial.t)


class Custom(Exception):
    """An exception that plain pickle cannot make again."""

    def __init__(self, one, two):
        super().__init__(one)
        self.two = two


class Rooted(Exception):
    """One that cannot travel."""

    def __reduce__(self):
        raise LookupError


@pytest.fixture
def plain_pickle(monkeypatch):
    """Without the ways of pickling exceptions that a cluster's client installs."""
    for kind in (rk.SimulationError, Rooted, Unreadable):
        monkeypatch.delitem(copyreg.dispatch_table, kind, raising=False)


def test_an_error_travels_without_a_cause_that_cannot(plain_pickle):
    error = lost(ROBOT, FailsAt(0.1, boom), PATH, OFFSET)
    error.__cause__ = Rooted()
    again = pickle.loads(pickle.dumps(error))
    assert (str(again), again.time, again.reason) == (str(error), error.time, error.reason)
    assert again.__cause__ is None


def test_errors_travel():
    error = lost(ROBOT, FailsAt(0.1, boom), PATH, OFFSET)
    error.add_note("seen")
    again = pickle.loads(pickle.dumps(error))
    assert (str(again), again.time, again.reason) == (str(error), error.time, error.reason)
    assert again.__notes__ == ["seen"] and repr(again.__cause__) == repr(error.__cause__)
    assert_array_equal(again.partial.c, error.partial.c)

    def custom():
        raise Custom(1, 2)

    law = FailsAt(0.1, custom)
    with pytest.raises(rk.SimulationError, match="the law raised Custom: 1") as caught:
        rk.simulate(ROBOT, lambda *sample: law(*sample), PATH)
    assert isinstance(caught.value.__cause__, Custom)
    caught.value.partial = None  # a lambda cannot travel
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)


# Sweeps.
LAWS = [pd, FailsAt(0.1, boom), PD, rk.PD(1e4, 0.225), FailsAt(0.0, boom)]


def test_a_sweep_masks_what_failed():
    study = rk.sweep(ROBOT, LAWS, PATH, OFFSET, failed="mask")
    assert study.failed.tolist() == [False, True, False, True, True]
    assert study.failure_time[1] == PATH.t[100] and study.failure_time[4] == 0.0
    assert study.failure_time.mask.tolist() == [True, False, True, False, False]
    assert study.energies.mask[:, 0].tolist() == study.failed.tolist()
    assert_array_equal(study.energies[0], rk.simulate(ROBOT, pd, PATH, OFFSET).energy)
    assert "5 runs, 3 failed" in repr(study)


def test_a_masked_row_tells_of_its_own_offsets():
    law, offsets = rk.AntagonismFilter(PD), np.array([[0.0, 0.0, 0.0], [1.5, -1.5, 1.5], [1.2, -1.2, 1.2]])
    study = rk.sweep(ROBOT, law, PATH, offsets, failed="mask")
    assert study.failed.tolist() == [False, True, True] and study.reasons[0] is None
    for i in (1, 2):
        assert study.reasons[i] == lost(ROBOT, law, PATH, offsets[i]).reason
        assert f"offset = {offsets[i].tolist()} rad" in study.reasons[i]


def test_a_masked_row_tells_of_the_model_of_its_sweep():
    law, model, path = rk.AntagonismFilter(PD), ROBOT.replace(lengths=0.28), rk.triangle(ROBOT, duration=1.5)
    study = rk.sweep(ROBOT, law, path, [OFFSET], failed="mask", model=model)
    assert "the controller's model has lengths that are off by 40 %" in study.reasons[0]
    assert study.reasons[0] == lost(ROBOT, law, path, OFFSET, model=model).reason


def test_a_sweep_knows_why_each_row_is_masked():
    """The reason of a row is the one that its run alone gives, whoever ran it and in whatever parts."""
    laws, faults = [*LAWS, rk.AntagonismFilter(PD)], [rk.OffsetJump(i, 0.1, 2.5 * (-1) ** i) for i in range(3)]
    model = ROBOT.replace(masses=0.3)
    with ProcessPoolExecutor(2) as pool:
        for options in ({}, {"model": model, "velocity_filter": 1e-3}, {"faults": faults, "encoder": 4000}):
            study = rk.sweep(ROBOT, laws, PATH, OFFSET, failed="mask", **options)
            other = rk.sweep(ROBOT, laws, PATH, OFFSET, failed="mask", executor=pool, chunk=2, **options)
            assert study.failed[[1, 3, 4]].all() and study.reasons == other.reasons
            for i in (0, 1, 2, 3, 5):
                assert study.failed[i] == (study.reasons[i] is not None)
                if study.failed[i]:
                    assert study.reasons[i] == lost(ROBOT, laws[i], PATH, OFFSET, **options).reason
            assert study.reasons[4].startswith("the law raised KeyError: 'gain table' (line ")
    again = pickle.loads(pickle.dumps(study))
    assert again == study and hash(again) == hash(study) and again.reasons == study.reasons
    assert study != rk.sweep(ROBOT, laws, PATH, OFFSET, failed="mask", faults=faults, encoder=3000)
    with pytest.raises(AttributeError):
        study.reasons = ()
    assert rk.sweep(ROBOT, PD, PATH, [OFFSET] * 2).reasons == (None, None)


@pytest.mark.parametrize("in_process", [False, True])
def test_a_sweep_raises_the_first_failure_and_keeps_the_rest(in_process):
    pool = ProcessPoolExecutor(2) if in_process else None
    try:
        with pytest.raises(rk.SimulationError, match=r"run 1: at t = 0\.1000 s the law raised KeyError") as caught:
            rk.sweep(ROBOT, LAWS[:4], PATH, OFFSET, executor=pool, chunk=2)
    finally:
        if pool:
            pool.shutdown()
    error = caught.value
    assert error.run == 1 and isinstance(error.__cause__, KeyError)
    consistent(error, 100)
    assert error.sweep.failed.tolist() == [False, True, False, True]
    assert error.sweep.reasons[1] == error.reason and "unstable gain" in error.sweep.reasons[3]
    assert_array_equal(error.sweep.energies[0], rk.simulate(ROBOT, pd, PATH, OFFSET).energy)
    with pytest.raises(rk.SimulationError, match=r"run 0: .*unstable gain") as caught:
        rk.sweep(ROBOT, LAWS[3], PATH, [OFFSET, OFFSET])
    consistent(caught.value, round(caught.value.time / PATH.dt) + 1)
    with pytest.raises(KeyError, match="gain table") as first:
        rk.sweep(ROBOT, [pd, LAWS[4]], PATH, OFFSET)
    assert "first sample of run 1" in first.value.__notes__[-1]
    assert first.value.partial.failed.tolist() == [False, True]


def test_a_bad_first_answer_is_no_failed_row():
    """Rows that ended otherwise are there, and the run is named."""
    laws = [FailsAt(0.0, boom), pd, lambda *sample: None]
    for chunk, executor in ((1, None), (64, None), (64, Pool(9, KeyError()))):  # the last one in one chunk
        with pytest.raises(ValueError, match="law returned None") as caught:
            rk.sweep(ROBOT, laws, PATH, OFFSET, failed="mask", chunk=chunk, executor=executor)
        assert "first sample of run 2" in caught.value.__notes__[-1]
        assert caught.value.partial.failed.tolist() == [True, False, True]


def test_truth_values_are_no_torques_that_mask_a_row():
    with pytest.raises(ValueError, match="is not numeric; allowed: real numbers"):
        rk.sweep(ROBOT, lambda t, q_a, qd_a, d: q_a > 0.0, PATH, OFFSET, failed="mask")


def no_number_at_zero(t, q_a, qd_a, desired):
    e = q_a - desired.q_a
    return (-7.05 * e - 0.225 * (qd_a - desired.qd_a)) * (np.nan if abs(e[0]) < 1e-9 else 1.0)


@pytest.mark.parametrize("law", [no_number_at_zero, rk.compiled(no_number_at_zero)], ids=["Python", "compiled"])
def test_torques_that_are_not_finite_mask_their_row_from_the_first_sample_on(law):
    offsets = np.array([[1e-3, 0.0, 0.0], [0.0, 1e-3, 0.0], [2e-3, 0.0, 0.0]])
    study = rk.sweep(ROBOT, law, PATH, offsets, failed="mask")
    assert study.failed.tolist() == [False, True, False] and "[0] = nan" in study.reasons[1]
    with pytest.raises(ValueError, match="nan; allowed: finite") as caught:
        rk.sweep(ROBOT, law, PATH, offsets)
    assert caught.value.partial.failed.tolist() == [False, True, False]
    assert_array_equal(caught.value.partial.energies[[0, 2]], study.energies[[0, 2]])


@pytest.mark.skipif(not engine.COMPILED, reason="without Numba every law runs in Python")
def test_a_compiled_law_runs_in_python_only_where_its_first_answer_has_to_be_told(monkeypatch):
    """Of four rows one is singular at its first sample and one later on, and two are done."""
    asked = []

    def once_more(setup, law):
        asked.append(setup.sensors.offset[0])
        return runs.attempt(setup, law)

    @rk.compiled
    def fails(t, q_a, qd_a, d):
        late = np.nan if t > 0.1 and q_a[0] - d.q_a[0] > 1.0 else 0.0
        first = np.nan if q_a[1] - d.q_a[1] > 1.0 else 0.0
        return 0.0 * q_a + late + first

    monkeypatch.setattr(chunks, "attempt", once_more)
    offsets = np.array([[0.0, 0.0, 0.0], [0.1, 2.0, 0.0], [2.0, 0.0, 0.0], [0.4, 0.0, 0.0]])
    columns, _ = chunks.run_chunk(prepare(ROBOT, PATH, rk.Sensors()), [fails] * 4, offsets)
    assert columns.failed.tolist() == [False, True, True, False] and 0.1 < columns.failure_time[2] < 0.11
    assert asked == [0.1]


class Unreadable(Exception):
    """It can be pickled, but not read again."""

    def __init__(self, first, second):
        super().__init__(first)


def unreadable():
    raise Unreadable("gain table", 2)


@pytest.mark.parametrize("failed", ["mask", "raise"])
def test_an_exception_that_cannot_travel_costs_no_rows(failed, plain_pickle):
    laws = [pd, FailsAt(0.0, unreadable), pd]
    with ProcessPoolExecutor(1) as pool:
        if failed == "mask":
            study = rk.sweep(ROBOT, laws, PATH, OFFSET, executor=pool, chunk=1, failed=failed)
        else:
            with pytest.raises(RuntimeError, match="the law raised Unreadable: gain table") as caught:
                rk.sweep(ROBOT, laws, PATH, OFFSET, executor=pool, chunk=1, failed=failed)
            study = caught.value.partial
        assert study.failed.tolist() == [False, True, False]
    with pytest.raises(Unreadable):
        rk.sweep(ROBOT, laws, PATH, OFFSET)


class Late(Exception):
    """One whose words have a time of their own."""

    def __init__(self, time):
        super().__init__("late")
        self.time = time


class Foresees:
    """A law that simulates ahead at its first sample, where its model is lost."""

    def __call__(self, t, q_a, qd_a, desired):
        rk.simulate(ROBOT, rk.PD(1e4, 0.225), PATH, OFFSET)


@pytest.mark.parametrize("time", [3.5, "noon"])
def test_what_a_law_raises_at_its_first_sample_has_no_time_of_its_own(time):
    def late():
        raise Late(time)

    study = rk.sweep(ROBOT, [pd, FailsAt(0.0, late)], PATH, OFFSET, failed="mask")
    assert study.failed.tolist() == [False, True] and study.failure_time[1] == 0.0
    assert study.reasons[1].startswith("the law raised Late: late")


def test_a_run_that_a_law_lost_ahead_is_not_the_run_of_the_machine():
    study = rk.sweep(ROBOT, [pd, Foresees()], PATH, OFFSET, failed="mask")
    assert study.failure_time[1] == 0.0 and study.reasons[1].startswith("the law raised SimulationError: at t = ")
    with pytest.raises(rk.SimulationError) as caught:
        rk.sweep(ROBOT, [pd, Foresees()], PATH, OFFSET)
    assert isinstance(caught.value.partial, rk.Sweep) and caught.value.partial.failed.tolist() == [False, True]
    assert "first sample of run 1" in caught.value.__notes__[-1]


class Grows:
    """A law that holds what no process sends, and then fails."""

    def __call__(self, t, q_a, qd_a, d):
        self.held = lambda: 0
        if t > 0.05:
            raise RuntimeError("boom")
        return -7.05 * (q_a - d.q_a) - 0.225 * (qd_a - d.qd_a)


def test_a_run_that_cannot_travel_leaves_its_time_and_reason():
    with ProcessPoolExecutor(1) as pool:
        with pytest.raises(rk.SimulationError, match="the law raised RuntimeError: boom") as caught:
            rk.sweep(ROBOT, [pd, Grows()], PATH, OFFSET, executor=pool)
    assert caught.value.run == 1 and 0.05 < caught.value.time < 0.052
    assert caught.value.sweep.failed.tolist() == [False, True]


class Own(Exception):
    """Its `partial` is its own."""

    partial = property(lambda self: "mine")


def test_an_exception_with_a_partial_of_its_own_is_raised_as_it_is():
    def own():
        raise Own("words")

    with pytest.raises(Own, match="words") as caught:
        rk.sweep(ROBOT, [pd, FailsAt(0.0, own)], PATH, OFFSET)
    assert caught.value.partial == "mine" and not hasattr(caught.value, "__notes__")


def test_an_interrupt_while_a_pool_ends_keeps_all_rows(monkeypatch):
    """A second Ctrl-C, or one just after the last run."""

    @contextmanager
    def interrupted(executor, threads):
        yield executor
        raise KeyboardInterrupt

    monkeypatch.setattr(sweeps, "pool_of", interrupted)
    with pytest.raises(KeyboardInterrupt) as caught:
        rk.sweep(ROBOT, [pd, pd], PATH, OFFSET)
    assert not caught.value.partial.failed.any() and "2 of 2 runs were finished" in caught.value.__notes__[-1]


@pytest.mark.skipif(not engine.COMPILED, reason="without Numba nothing is compiled, and nothing repeated")
def test_an_interrupt_before_a_compiled_run_is_repeated_keeps_it(monkeypatch):
    @rk.compiled
    def gives_up(t, q_a, qd_a, d):
        return -7.05 * (q_a - d.q_a) - 0.225 * (qd_a - d.qd_a) + (np.nan if t > 0.05 else 0.0)

    def interrupted(*arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr(loop_in_python, "Plant", interrupted)
    with pytest.raises(KeyboardInterrupt) as caught:
        rk.simulate(ROBOT, gives_up, PATH, OFFSET)
    assert caught.value.partial.t[-1] == pytest.approx(0.05, abs=2 * PATH.dt)


def test_a_ctrl_c_waits_until_numba_is_imported():
    """Of a Numba that was imported by half the rest could not be imported any more."""
    usual, ended = signal.signal(signal.SIGINT, signal.default_int_handler), []
    try:
        with pytest.raises(KeyboardInterrupt):
            with engine._uninterrupted():
                signal.raise_signal(signal.SIGINT)
                ended.append(True)
        assert ended and signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, usual)


def test_an_interrupted_sweep_tells_of_one_partial():
    with pytest.raises(KeyboardInterrupt) as caught:
        rk.sweep(ROBOT, [pd, FailsAt(0.1, interrupt)], PATH, OFFSET)
    assert isinstance(caught.value.partial, rk.Sweep) and caught.value.partial.failed.tolist() == [False, True]
    assert len([note for note in caught.value.__notes__ if "partial" in note]) == 1


class Pool(Executor):
    """Does its jobs at once, but for the one that raises and, where they wait, all after it."""

    def __init__(self, broken: int, error: BaseException, wait: bool = True):
        self.broken, self.error, self.wait, self.futures = broken, error, wait, []

    def submit(self, function, *arguments):
        future, n = Future(), len(self.futures)
        self.futures.append(future)
        if n < self.broken or (n > self.broken and not self.wait):
            future.set_result(function(*arguments))
        elif n == self.broken:
            future.set_exception(self.error)
        return future


@pytest.mark.parametrize("law", [PD, pd], ids=["engine", "Python"])
@pytest.mark.parametrize("error", [KeyboardInterrupt(), BrokenProcessPool("a process died")], ids=["Ctrl-C", "died"])
def test_finished_chunks_are_on_the_exception_and_the_rest_is_cancelled(law, error):
    offsets = np.random.default_rng(1).normal(0.0, 3e-3, (8, 3))
    pool = Pool(2, error)
    with pytest.raises(type(error)) as caught:
        rk.sweep(ROBOT, law, PATH, offsets, executor=pool, chunk=2)
    assert [future.cancelled() for future in pool.futures] == [False, False, False, True]
    part = caught.value.partial
    assert isinstance(part, rk.Sweep) and part.failed.tolist() == [False] * 4 + [True] * 4
    assert part.failure_time.mask.all()  # the others did not fail, they never ran
    assert part.reasons == (None,) * 4 + ("it had not run when the sweep was stopped",) * 4
    assert_array_equal(part.energies[:4], rk.sweep(ROBOT, law, PATH, offsets[:4]).energies)
    assert part.energies.mask[4:].all()
    assert "4 of 8 runs were finished" in caught.value.__notes__[-1]
    energies = np.ma.copy(part.energies)  # finished as the docstring of `Sweep` says
    energies[part.failed] = rk.sweep(ROBOT, law, PATH, part.offsets[part.failed]).energies
    assert not np.ma.is_masked(energies)
    assert_array_equal(energies, rk.sweep(ROBOT, law, PATH, offsets).energies)


@pytest.mark.parametrize("error", [KeyboardInterrupt(), BrokenProcessPool("a process died")], ids=["Ctrl-C", "died"])
def test_a_sweep_that_is_stopped_before_any_chunk_is_done_has_a_partial_too(error):
    """As its docstring says of both."""
    with pytest.raises(type(error)) as caught:
        rk.sweep(ROBOT, PD, PATH, np.zeros((4, 3)), executor=Pool(0, error), chunk=2)
    assert caught.value.partial.failed.all() and caught.value.partial.failure_time.mask.all()


def test_chunks_that_finished_after_the_one_that_stopped_a_sweep_are_kept():
    offsets = np.random.default_rng(2).normal(0.0, 3e-3, (6, 3))
    with pytest.raises(KeyboardInterrupt) as caught:
        rk.sweep(ROBOT, PD, PATH, offsets, executor=Pool(0, KeyboardInterrupt(), wait=False), chunk=2)
    assert caught.value.partial.failed.tolist() == [True] * 2 + [False] * 4
    assert_array_equal(caught.value.partial.energies[2:], rk.sweep(ROBOT, PD, PATH, offsets[2:]).energies)


def test_a_failure_of_the_executor_with_nothing_finished_has_no_partial():
    with pytest.raises(OSError, match="no processes left") as caught:
        rk.sweep(ROBOT, PD, PATH, np.zeros((4, 3)), executor=Pool(0, OSError("no processes left")), chunk=2)
    assert not hasattr(caught.value, "partial") and not hasattr(caught.value, "__notes__")


class Taciturn:
    def __reduce__(self):
        raise LookupError


def test_what_does_not_travel_is_kept_here():
    assert pools.kept_here(Taciturn()) and not pools.kept_here(PD)


@pytest.mark.parametrize(
    ("error", "told"),
    [
        (BrokenProcessPool("a process died"), True),  # as where it could not read what it was sent
        (pickle.PicklingError("not found as m.law"), True),
        (AttributeError("can't get local object"), True),
        (TypeError("cannot pickle 'generator' object"), True),
        (KeyError("gain table"), False),
    ],
    ids=lambda value: type(value).__name__,
)
def test_errors_of_the_way_to_another_process_are_told_what_can_go_it(error, told):
    """Which kind it is depends on the version of Python."""
    job: Future = Future()
    job.set_exception(error)
    with pytest.raises(type(error)) as caught:
        pools.answer(job)
    assert caught.value is error and any("only in modules" in note for note in getattr(error, "__notes__", [])) == told


@pytest.mark.skipif(sys.platform == "win32", reason="a process that exits takes other ways there")
def test_a_process_that_dies_takes_no_finished_rows_along():
    offsets = np.zeros((6, 3))
    laws = [pd, pd, FailsAt(0.1, die), pd, pd, pd]
    with ProcessPoolExecutor(1) as pool, pytest.raises(BrokenProcessPool) as caught:
        rk.sweep(ROBOT, laws, PATH, offsets, executor=pool, chunk=1)
    part = caught.value.partial
    assert part.failed.tolist() == [False, False, True, True, True, True]
    assert_array_equal(part.energies[0], rk.simulate(ROBOT, pd, PATH).energy)


@pytest.mark.parametrize(
    ("fails", "kind"),
    [
        (lambda: np.linalg.solve(np.zeros((3, 3)), np.ones(3)), "LinAlgError"),
        (lambda: os.environ["no gain"], "KeyError"),
        (lambda: json.loads("{"), "JSONDecodeError"),
        (lambda: rk.inverse_kinematics(ROBOT, [9.0, 9.0]), "ValueError"),
    ],
    ids=["installed", "frozen", "standard", "ours"],
)
def test_a_law_that_fails_within_a_library_is_named_by_its_own_line(fails, kind):
    """Of the traceback the last line that is neither of an installed library nor of one that came with Python."""
    with pytest.raises(rk.SimulationError, match=rf"{kind}.*\(line \d+ of test_lost_runs.py: \[?\(lambda") as caught:
        rk.simulate(ROBOT, FailsAt(0.1, fails), PATH, OFFSET)
    assert "frozen" not in caught.value.reason


def test_a_study_is_printed_with_the_totals_of_the_runs_that_were_finished():
    """Of the energies of all drives, the least and the largest of a run; of lost ones there is none."""
    path, laws = rk.hold(ROBOT, [0.02, 0.05], 0.1), [rk.PD(7.05, 0.2), rk.PD(7.05, 30.0), rk.PD(14.0, 0.2)]
    totals = [rk.simulate(ROBOT, law, path, OFFSET).energy.sum() for law in (laws[0], laws[2])]
    study = rk.sweep(ROBOT, laws, path, OFFSET, failed="mask")
    assert repr(study) == f"Sweep(3 runs, 1 failed, total energy {min(totals):.3g} to {max(totals):.3g} J)"
    assert repr(rk.sweep(ROBOT, laws[1], path, OFFSET, failed="mask")) == "Sweep(1 runs, 1 failed)"


@pytest.mark.parametrize("law", [rk.PD, rk.APD, rk.CTC, rk.RedundantAPD, rk.RedundantCTC])
def test_gains_are_positive(law):
    with pytest.raises(ValueError, match="K_P"):
        law(0.0, 1.0)
    with pytest.raises(ValueError, match="K_D"):
        law(1.0, 0.0)


@pytest.mark.parametrize("rate", [0.6e9, 1.6e9])
def test_a_law_is_to_blame_up_to_a_milliard_radians_per_second(rate):
    """The first torques give the drives that rate within a hold: c = (A^T)^+ Gbar xd / dt, from rest, without friction.

    In 1e-12 s they go a thousandth of a radian, so the pose stays.
    """
    path = rk.hold(ROBOT, [0.02, 0.05], 3e-12, 1e-12)
    pose = rk.at(ROBOT, path.q[0], 0 * path.q[0])
    xd = rate / np.abs(pose.F[:3, 0]).max() * np.array([1.0, 0.0])
    kick = np.linalg.pinv(pose.A.T) @ pose.minimal[0] @ xd / path.dt
    rates = []

    def law(t, q_a, qd_a, desired):
        rates.append(np.abs(qd_a).max())
        if t > 0.0:
            raise KeyError("the gain table")
        return kick

    words = "KeyError: 'the gain table'" if rate < 1e9 else "the machine left the workspace"
    with pytest.raises(rk.SimulationError, match=words):
        rk.simulate(ROBOT, law, path)
    np.testing.assert_allclose(rates[1], rate, rtol=0.02)


def test_a_throw_within_one_hold_is_the_last_row():
    """The law that then raises is not to blame, and has no row."""

    def law(t, q_a, qd_a, desired):
        assert np.abs(qd_a).max() < 1e9
        return np.array([1e19, 0.0, 0.0]) * (t > 4.5e-12)

    error = lost(ROBOT, law, rk.hold(ROBOT, [0.02, 0.05], 20e-12, dt=1e-12))
    part = error.partial
    assert "the machine left the workspace" in error.reason and error.time == pytest.approx(part.t[-1])
    assert part.c[-1, 0] == 1e19 and np.abs(part.x - [0.02, 0.05]).max() < 1e-2


def test_a_law_that_failed_in_a_later_chunk_is_not_run_again():
    """The error of the run itself is kept, by the row of the study: the law raises once, here in run 3."""
    raised = []

    def boom_once():
        raised.append(KeyError("gain table"))
        raise raised[-1]

    with pytest.raises(rk.SimulationError, match="run 3: ") as caught:
        rk.sweep(ROBOT, [pd, pd, pd, FailsAt(0.01, boom_once)], PATH, OFFSET, executor=Pool(9, KeyError()), chunk=2)
    assert len(raised) == 1 and caught.value.__cause__ is raised[0]


@pytest.mark.parametrize("column", ["x", "qd_a", "c"])
def test_what_is_kept_of_a_lost_run_ends_before_a_number_that_is_none(column):
    setup, N = prepare(ROBOT, PATH, rk.Sensors()), ROBOT.n_arms
    rows = {name: np.ones((len(PATH), size)) for name, size in {"x": 2, "xd": 2, "q_a": N, "qd_a": N, "c": N}.items()}
    rows[column][7, 1] = np.inf
    outcome = Outcome(compiled.LEFT_WORKSPACE, 20, **rows, pairs=np.full((len(PATH), 2), -1))
    assert len(runs._run(setup, PD, outcome)) == 7
    rows[column][7, 1] = 0.0
    assert len(runs._run(setup, PD, outcome)) == 21


SINGULAR_START = """
import rapkm_lite as rk

robot = rk.load().replace(
    friction=0.0, base=[[-0.25, 0.0], [0.25, 0.0], [0.0, 0.5]], lengths=[[0.25, 0.25], [0.25, 0.25], [0.3, 0.2]],
    mode=[1, -1, 1],
)
path = rk.hold(robot, [0.0, 0.25], 0.05)
try:
    rk.simulate(robot, rk.CTC(900.0, 60.0, (0, 1)), path)
except rk.SimulationError as error:
    said = error.reason
"""


def test_a_division_by_zero_ends_a_run_without_a_compiler_too():
    """Two elbows at one point and numbers that are powers of two: the distal links are parallel to the last bit.

    Plain Python raises there; the reason is the one of the same run with infinite numbers.
    """
    code = f"{SINGULAR_START}\nprint(said)"
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", code],
        env=os.environ | {"RAPKM_LITE_NUMBA": "0"},
        capture_output=True,
        text=True,
        check=False,
    )
    found: dict = {}
    exec(SINGULAR_START, found)
    for said in (done.stdout.strip(), found["said"]):
        assert "near a parameterization singularity of its independent drives 1 and 2" in said, done.stderr
    assert "the torques of the law are not finite, as where its coordinates become singular" in done.stdout


def test_sums_of_a_failed_run_are_zeros():
    """All but its time and status; those of the run beside it are its own."""
    setup, laws = prepare(ROBOT, PATH, rk.Sensors(OFFSET)), [PD, rk.PD(1e4, 0.225)]
    *sums, time, status = columns = [column + 1 for column in Columns.blank(2, 3)[:-1]]
    codes = {i: compiled.encode(law, setup) for i, law in enumerate(laws)}
    compiled.many(setup, codes, np.array([OFFSET] * 2), columns)
    assert status[0] == compiled.DONE != status[1] and time[0] == 0.0 < time[1]
    for column in sums:
        assert np.all(column[0] != 0.0) and np.all(column[1] == 0.0)


@pytest.mark.parametrize("law", [rk.APD(7.0, 0.2, (0, 1)), rk.CTC(400.0, 40.0, (0, 1))])
@pytest.mark.parametrize("aside", [0.0, 1e-14])
def test_singular_coordinates_are_refused_like_those_of_the_textbook(law, aside):
    """|d_1 x d_2| = 0 at the desired pose."""
    robot = rk.load()
    still = rk.hold(robot, [-0.00785686747112148 + aside, -0.12], 0.02)
    with pytest.raises(ValueError, match="independent = \\(0, 1\\) is singular"):
        law.torque(robot, still.q[0], still.qd[0], still.q_a[0], still.qd_a[0], still[0])
    with pytest.raises(rk.SimulationError, match="near a parameterization singularity") as caught:
        rk.simulate(robot, law, still)
    assert caught.value.time == 0.0


ENDS = """
import numpy as np
import rapkm_lite as rk
LAW = rk.CTC(400, 40, (0, 1))
class Textbook(rk.Law):
    def step(self, memory, sample):
        return LAW.step(memory, sample)
robot, given = rk.load("five_bar"), {"encoder": 6, "velocity_filter": 0.0}
path = rk.circle(robot, 0.02, 0.2, centre=(0.0, 0.12))
for law in (LAW, Textbook()):
    try:
        rk.simulate(robot, law, path, **given)
    except rk.SimulationError as error:
        print(error.time, len(error.partial), np.abs(error.partial.c).max() < 1e5)
print(*rk.sweep(robot, LAW, path, np.zeros((2, 2)), failed="mask", **given).failure_time)
"""


@pytest.mark.parametrize("numba", ["0", "1"])
def test_a_run_ends_at_the_sample_at_which_its_textbook_law_does(numba):
    """Angles that no pose of a two-arm machine has: the least-squares pose is singular."""
    environment = {**os.environ, "RAPKM_LITE_NUMBA": numba}
    done = subprocess.run([sys.executable, "-c", ENDS], env=environment, capture_output=True, text=True, check=True)
    own, textbook, study = (line.split() for line in done.stdout.splitlines())
    assert own == textbook and float(own[0]) > 0.0 and own[2] == "True"
    assert study == 2 * own[:1]
