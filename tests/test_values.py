"""Values do not change: read-only to the last array, also unpickled and copied; equal by value; printed as typed."""

import copy
import functools
import pickle
from dataclasses import FrozenInstanceError, dataclass, field

import numpy as np
import pytest

import rapkm_lite as rk
from rapkm_lite.machine.likeness import equal, key
from rapkm_lite.machine.values import Value, frozen


@dataclass(frozen=True, eq=False, repr=False)
class Sample(Value):
    numbers: np.ndarray
    parts: tuple = ()
    scale: float = 1.0
    extra: np.ndarray | None = None


def copies(value):
    return copy.copy(value), copy.deepcopy(value), pickle.loads(pickle.dumps(value))


def test_no_array_of_a_value_can_be_written():
    given = np.arange(6.0).reshape(2, 3)
    masked = np.ma.masked_less([1.0, 2.0, 3.0], 1.5)
    value = Sample(given, [np.ones(2), 3], extra=masked)
    given[0, 0] = 9.0  # the caller's own array stays the caller's
    assert value.numbers[0, 0] == 0.0
    for v in (value, *copies(value)):
        assert v == value and hash(v) == hash(value)
        for array in (v.numbers, v.numbers[0], v.parts[0], v.extra, v.extra.data, v.extra.mask):
            with pytest.raises(ValueError, match="read-only"):
                array[...] = 0
            with pytest.raises(ValueError, match="WRITEABLE"):
                np.asarray(array).setflags(write=True)
        with pytest.raises(AttributeError):
            v.scale = 2.0


def test_values_are_equal_by_value():
    value = Sample(np.array([1.0, 0.0, np.nan]), (np.ones(2),))
    same = Sample(np.array([1.0, -0.0, np.nan]), [np.ones(2, dtype=int)])
    assert value == same and hash(value) == hash(same) and len({value, same}) == 1
    for other in (
        Sample(np.array([1.0, 0.0, 2.0]), (np.ones(2),)),
        Sample(np.array([1.0, 0.0, np.nan])),
        1.0,
        None,
        Sample(np.array([[1.0, 0.0, np.nan]]), (np.ones(2),)),
        Sample(value.numbers, value.parts, 2.0),
        Sample(value.numbers, value.parts, extra=np.zeros(1)),
    ):
        assert value != other
    assert Sample(np.ma.masked_less([1.0, 2.0], 1.5)) != Sample(np.ma.masked_less([1.0, 2.0], 0.5))
    assert Sample(np.array(7)) == Sample(7.0) and hash(Sample(np.array(7))) == hash(Sample(7.0))
    assert Sample(np.nan) == Sample(-np.float64("nan")) and hash(Sample(np.nan)) == hash(Sample(-np.float64("nan")))
    assert Sample(float("nan")) == Sample(float("nan")) and hash(Sample(float("nan"))) == hash(Sample(float("nan")))


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ([1.0, -0.0], np.array([1, 0])),
        (((1, 2), (3, 4)), np.array([[1.0, 2.0], [3.0, 4.0]])),
        ([np.ones(2), np.ones(2)], np.ones((2, 2))),
        ([1.0, np.nan], np.array([1.0, np.nan], dtype=np.float32)),
        (["a", "b"], np.array(["a", "b"], dtype="U5")),
        ([None, 1], np.array([None, 1], dtype=object)),
        (np.array([1.0, 2.0]), np.array([1, 2], dtype=complex)),
        (np.array(2**53 + 1), 2**53 + 1),
        (np.array(2**53 + 1), 2.0**53),
        ({1}, frozenset({1})),
        (list(range(500)), np.arange(500.0)),
    ],
)
def test_values_that_hold_lists_and_arrays_of_the_same_have_one_hash(one, other):
    """What Python asks of any hash: a == b means hash(a) == hash(b)."""
    assert Sample(extra=one, numbers=1.0) == Sample(extra=other, numbers=1.0)
    assert hash(Sample(extra=one, numbers=1.0)) == hash(Sample(extra=other, numbers=1.0))


def test_nan_of_either_sign_is_one_key():
    minus, plus = np.array([np.copysign(np.nan, -1.0), 1.0]), np.array([np.nan, 1.0])
    assert minus.tobytes() != plus.tobytes()
    assert equal(minus, plus) and key(minus) == key(plus)


def test_nan_equals_nan_and_no_number_and_a_tuple_no_list():
    nan = float("nan")
    assert not equal([1.0], (1.0,)) and not equal((1.0,), [1.0]) and not equal({0: 1.0}, (1.0,))
    assert equal(nan, float("nan")) and not equal(nan, 1.0) and not equal(1.0, nan) and not equal(nan, None)


def test_an_array_equals_the_list_of_its_numbers_whichever_comes_first():
    """Equality is symmetric; a field that keeps an array may have a tuple as default, which is then not printed."""
    for other in ([1.0, 2.0], (1.0, 2.0)):
        assert equal(np.array([1.0, 2.0]), other) and equal(other, np.array([1.0, 2.0]))
        assert not equal(np.array([1.0, 3.0]), other) and not equal(other, np.array([1.0, 3.0]))


def test_what_a_mask_hides_does_not_count_and_the_mask_does():
    hidden, shown = np.ma.array([1.0, 0.0], mask=[0, 1]), np.ma.array([1.0, 0.0], mask=[0, 0])
    assert equal(hidden, np.ma.array([1.0, 5.0], mask=[0, 1]))
    assert not equal(hidden, shown) and not equal(shown, hidden)
    assert not equal(hidden, np.array([1.0, 0.0]))


def test_a_value_prints_as_it_was_typed():
    assert repr(Sample(np.array(7.05))) == "Sample(7.05)"
    value = Sample(np.array([1.0, 2.0]), scale=3.0, extra=np.array([0.5]))
    assert repr(value) == "Sample([1.0, 2.0], scale=3.0, extra=[0.5])"
    assert repr(Sample(np.zeros((40, 2)))) == "Sample(<array (40, 2)>)"


@pytest.mark.parametrize(
    "array",
    [
        np.zeros((0, 2)),
        np.float64(2.0),
        np.arange(4)[::2],
        np.ones((2, 2), order="F"),
        frozen(np.arange(6.0).reshape(2, 3)).T,
        np.array([True, False]),
        np.array(["a", "b"]),
    ],
    ids=str,
)
def test_frozen_keeps_shape_type_and_numbers(array):
    kept = frozen(array)
    assert kept.shape == np.shape(array) and kept.dtype == np.asarray(array).dtype and np.array_equal(kept, array)
    assert kept.flags.c_contiguous and not kept.flags.writeable
    assert frozen(kept) is kept or kept.size == 0


def test_what_is_under_a_mask_is_filled_with_the_callers_number():
    kept = frozen(np.ma.array([1.0, 2.0], mask=[False, True], fill_value=-7.0))
    assert kept.filled().tolist() == [1.0, -7.0]


# The values of machine and mechanics.
def arrays(value):
    return {name: v for name, v in vars(value).items() if isinstance(v, np.ndarray)}


PATH = rk.triangle(rk.load(), dt=0.05)
VALUES = {
    "machine": rk.load("asymmetric"),
    "path": PATH,
    "sample": PATH[17],
    "part": PATH[3:7],
    "log": rk.mystery_run("offset_a"),
    "long path": rk.triangle(rk.load("four_arms")),
}


@pytest.mark.parametrize("value", VALUES.values(), ids=VALUES.keys())
def test_values_of_the_package_stay_as_they_are(value):
    assert len(arrays(value)) >= 4
    for v in (value, *copies(value)):
        assert v == value and hash(v) == hash(value) and repr(v) == repr(value)
        for name, array in arrays(v).items():
            assert not array.flags.writeable and array.flags.c_contiguous, name
            with pytest.raises(ValueError, match="read-only"):
                array[(0,) * array.ndim] = 9.0
            with pytest.raises(ValueError, match="WRITEABLE"):
                array.setflags(write=True)


def test_what_a_value_computes_when_asked_cannot_be_written_either():
    """A number written into it would be lost without a word: the next look computes it anew."""
    run = rk.simulate(rk.load(), rk.PD(7.05, 0.225), PATH)
    for computed in (run.energy, run.error, run.path_error, run.log().error, rk.table1().deviation):
        with pytest.raises(ValueError, match="read-only"):
            computed[0] = 9.0


def test_the_tree_of_a_machine_is_read_only():
    kept = arrays(rk.load().tree)
    assert len(kept) > 10 and not any(array.flags.writeable for array in kept.values())


@pytest.mark.parametrize("machine", ["testbed", "five_bar", "four_arms"])
def test_a_run_that_was_not_looked_at_is_right(machine):
    """Runs of the engine skip the checks of `Run`: made again with them, field by field, they are the same."""
    robot = rk.load(machine)
    run = rk.simulate(robot, rk.RedundantCTC(400.0, 40.0), rk.triangle(robot, duration=0.2, side=0.02), 1e-3)
    fields = {name: getattr(run, name) for name in run.__dataclass_fields__}
    assert type(run)(**fields) == run
    for name in ("x", "xd", "q_a", "qd_a", "c"):
        assert frozen(fields[name]) is fields[name] and np.all(np.isfinite(fields[name])), name
    assert np.abs(rk.inverse_kinematics(robot, run.x)[:, : robot.n_arms] - run.q_a).max() < 1e-12
    assert np.all(run.pairs == -1)


def test_no_law_can_shift_the_path_through_its_sample():
    sample = PATH[17]
    for name in ("x", "xd", "xdd", "q", "qd", "qdd", "q_a", "qd_a", "qdd_a"):
        array = getattr(sample, name)
        assert array.flags.c_contiguous
        with pytest.raises(ValueError, match="read-only"):
            array += 0.01
        assert np.array_equal(array, getattr(PATH, name)[17])
    assert PATH[17] == sample and PATH[np.int64(17)] == sample and PATH[-1] == PATH[100]
    assert [d.q_a[0] for d in PATH] == PATH.q_a[:, 0].tolist()
    with pytest.raises(IndexError):
        PATH[101]


def test_desired_motions_copy_what_they_are_given():
    q = np.ones((4, 6))
    mine = rk.Desired(3, q[:, :2], q[:, :2], q[:, :2], q, q, q)
    q[...] = 7.0
    assert np.all(mine.q == 1.0) and q.flags.writeable and mine.q_a.shape == (4, 3)
    assert mine == rk.Desired(3, np.ones((4, 2)), np.ones((4, 2)), np.ones((4, 2)), *[np.ones((4, 6))] * 3)
    assert mine != rk.Desired(3, mine.x, mine.xd, mine.xdd, mine.q, mine.qd, 2 * mine.qdd)


def test_equal_machines_and_paths_are_one_key():
    again = rk.load()
    assert again == rk.load() and again != again.replace(friction=0.0) and again != rk.load("five_bar")
    assert len({again, rk.load(), again.replace()}) == 1
    assert rk.triangle(again, dt=0.05) == PATH and {PATH: 1}[rk.triangle(again, dt=0.05)] == 1
    assert rk.triangle(again, dt=0.05, side=0.2) != PATH
    assert repr(PATH[1:3]).startswith("Desired(3, [[")


class Spring:
    """A law as users write them, with whatever state."""

    def __init__(self, gain, **state):
        self.gain, self.last = np.full(3, gain), None
        vars(self).update(state)

    def __call__(self, t, q_a, qd_a, d):
        self.last = q_a
        return -self.gain * (q_a - d.q_a) - 0.2 * (qd_a - d.qd_a)

    pull = __call__


@dataclass
class Table:
    """A dataclass whose own == asks for the truth of an array."""

    gains: np.ndarray

    def __call__(self, t, q_a, qd_a, d):
        return -self.gains * (q_a - d.q_a) - 0.2 * (qd_a - d.qd_a)


class Shared:
    """What can be copied, but neither pickled nor looked into."""

    __slots__ = ()

    def __deepcopy__(self, memo):
        return self

    def __reduce_ex__(self, protocol):
        raise TypeError("cannot be pickled")


def spring_of(gain):
    return lambda t, q_a, qd_a, d: -gain * (q_a - d.q_a) - 0.2 * (qd_a - d.qd_a)


LAWS = {
    "function": lambda K: spring_of(K),
    "object": lambda K: Spring(K),
    "method": lambda K: Spring(K).pull,
    "partial": lambda K: functools.partial(Spring(K)),
    "dataclass": lambda K: Table(np.full(3, K)),
    "filtered": lambda K: rk.AntagonismFilter(Spring(K), pose="true"),
    "random": lambda K: Spring(K, noise=np.random.default_rng(3), log=[{"a": np.nan}, {K}], helper=spring_of(K)),
    "unpicklable": lambda K: Spring(K, hidden=SHARED, more=[SHARED]),
    "cycle": lambda K: circle(Spring(K)),
}
SHARED = Shared()


def circle(law):
    law.own = [law]
    return law


@pytest.mark.parametrize("kind", LAWS)
def test_runs_with_laws_of_a_user_are_equal_by_value(kind):
    """Two runs are equal when all that made them is, whoever built the law and how often; a copy is equal, too."""
    robot = rk.load()
    path = rk.hold(robot, [0.0, 0.0], 0.003)
    law = LAWS[kind](7.0)
    run, again = rk.simulate(robot, law, path), rk.simulate(robot, law, path)
    assert run == again and hash(run) == hash(again)
    other = rk.simulate(robot, LAWS[kind](7.0), path)
    assert run == other and hash(run) == hash(other)
    assert run == copy.deepcopy(run) and len({run, again, other}) == 1
    # At rest on the path all torques are zero: only the laws differ.
    assert run != rk.simulate(robot, LAWS[kind](8.0), path)
    assert rk.sweep(robot, law, path, [0.0, 0.0, 0.0]) == rk.sweep(robot, LAWS[kind](7.0), path, [0.0, 0.0, 0.0])
    if kind not in ("function", "random", "unpicklable"):  # no lambda travels
        assert run == pickle.loads(pickle.dumps(run))


def keyword_spring(gain):
    def law(t, q_a, qd_a, d, *, gain=gain):
        return -gain * (q_a - d.q_a)

    return law


def marked_spring(gain):
    def law(t, q_a, qd_a, d):
        return -law.gain * (q_a - d.q_a)

    law.gain = gain
    return law


def default_spring(gain):
    return lambda t, q_a, qd_a, d, gain=gain: -gain * (q_a - d.q_a)


def elsewhere(gain):
    """The same code in a module of its own, whose gain it reads."""
    space = {"gain": gain}
    exec("def law(t, q_a, qd_a, d):\n    return -gain * (q_a - d.q_a)", space)
    return space["law"]


def test_functions_of_two_modules_differ_though_their_code_is_the_same():
    law, other = elsewhere(7.0), elsewhere(8.0)
    assert law.__code__ == other.__code__ and equal(law, law) and not equal(law, other)


@pytest.mark.parametrize("spring", [spring_of, keyword_spring, default_spring, marked_spring])
def test_functions_differ_by_what_they_hold(spring):
    """In a variable around them, in a default, also of a keyword, in an attribute."""
    assert equal(spring(7.0), spring(7.0)) and not equal(spring(7.0), spring(8.0))
    assert rk.AntagonismFilter(spring(7.0)) != rk.AntagonismFilter(spring(8.0))


def test_what_cannot_be_looked_into_equals_only_itself():
    assert Sample(np.ones(1), (Shared(),)) != Sample(np.ones(1), (Shared(),))
    assert Sample(np.ones(1), (np.sin,)) == Sample(np.ones(1), (np.sin,)) != Sample(np.ones(1), (np.cos,))
    assert Sample(np.ones(1), (Spring,)) != Sample(np.ones(1), (Table,))
    assert Sample(np.ones(1), (Spring(1.0),)) != Sample(np.ones(1), (Table(np.ones(3)),))


class Worn(rk.Sensors):
    """Encoders of a user's, with an ``__init__`` of its own."""

    def __init__(self, wear):
        super().__init__()
        self.wear = wear

    @property
    def count(self):
        return self.wear


@pytest.mark.parametrize(
    ("wear", "sentence"),
    [(np.full(3, 1e-3), r"count has shape \(3,\); allowed: one number"), (-1.0, "count = -1; allowed: > 0")],
)
def test_encoders_of_a_user_have_one_count_for_all_drives(wear, sentence):
    robot = rk.load()
    for law in (rk.PD(7.05, 0.225), lambda t, q_a, qd_a, desired: 0 * q_a):
        with pytest.raises(ValueError, match=sentence):
            rk.simulate(robot, law, rk.hold(robot, [0.0, 0.0], 0.01), sensors=Worn(wear))


class Tagged(rk.Manipulator):
    def __init__(self, robot, tag):
        super().__init__(**robot._fields())
        self.tag = tag


class Round(rk.Trajectory):
    def __init__(self, robot, radius):
        path = rk.circle(robot, radius, 0.1)
        super().__init__(**path._fields())
        self.radius = radius


def test_changed_values_of_a_users_class_stay_of_that_class():
    robot, path, pd = rk.load().replace(friction=0.0), rk.circle(rk.load(), 0.05, 0.1), rk.PD(7.0, 0.2)
    worn, full = Worn(1e-2), Worn(1e-2).with_offset(np.zeros(3))
    assert type(full) is Worn and full.wear == 1e-2 and full == full.with_offset([0.0, 0.0, 0.0]) != worn
    run = rk.simulate(robot, pd, path, sensors=worn)
    assert run == rk.simulate(robot, pd, path, sensors=full) and np.ptp(run.c) > 1e-3
    other = Tagged(robot, "new").replace(masses=0.2, load=0.1)
    assert type(other) is Tagged and other.tag == "new"
    assert rk.Manipulator(**other._fields()) == robot.replace(masses=0.2, load=0.1)
    with pytest.raises(ValueError, match="masses"):
        Tagged(robot, "new").replace(masses=-1.0)
    fewer = Tagged(robot, "new").with_arms((0, 2))
    assert type(fewer) is Tagged and fewer.tag == "new"
    assert rk.Manipulator(**fewer._fields()) == robot.with_arms((0, 2))
    own = Round(robot, 0.05)
    late = own.with_set_points(np.concatenate([own.q_a[:1], own.q_a[:-1]]))
    assert type(late) is Round and late.radius == 0.05 and late.x is own.x and late.q_a[1, 0] == own.q_a[0, 0]
    with pytest.raises(rk.SimulationError, match=r"at t = .* finite numbers"):
        rk.simulate(robot, rk.compiled(lambda t, q_a, qd_a, d: np.full(3, np.nan if t > 0.05 else 0.0)), own)
    with pytest.raises(rk.SimulationError, match="unstable gain"):
        rk.simulate(robot, rk.PID(7.0, 9000.0, 0.2), Round(robot, 0.05).for_robot(robot), 4e-3)


class Own(rk.Trajectory):
    """A path of a user's."""


def test_a_run_leaves_no_trace_on_its_path():
    robot = rk.load()
    used, fresh = (Own(**rk.hold(robot, [0.02, 0.05], 0.01)._fields()) for _ in range(2))
    rk.simulate(robot, rk.PD(7.0, 0.2), used)
    assert used == fresh and repr(used) == repr(fresh)
    assert set(used.__getstate__()) == set(fresh.__getstate__())


def test_fields_of_a_users_dataclass_may_come_later_or_stand_in_slots():
    @dataclass(frozen=True, eq=False, repr=False)
    class Later(rk.PD):
        order: int = field(init=False, default=2)
        size: int = field(init=False)

        def __post_init__(self):
            super().__post_init__()
            self._set(size=self.K_P.size)

    @dataclass(frozen=True, eq=False, repr=False, slots=True)
    class Slots(rk.PD):
        order: int = 2

    for law in (Later([7.0, 7.0, 7.0], 0.2), Slots([7.0, 7.0, 7.0], 0.2)):
        twin = copy.deepcopy(law)
        assert twin == law and hash(twin) == hash(law) and law.order == 2 and "order=2" in repr(law)


def test_a_plain_dataclass_of_a_user_is_a_value_too():
    """What `dataclass` writes by itself compares arrays with `==`, which has no truth value, and hashes them."""

    @dataclass(frozen=True)
    class Law(rk.PD):
        extra: float = 0.0

    @dataclass(frozen=True)
    class Machine(rk.Manipulator):
        place: str = ""

    @dataclass(frozen=True)
    class OwnRule(rk.PD):
        def __eq__(self, other):
            return "mine"

    robot = rk.load()
    for kind, fields, own in (
        (Law, rk.PD([7.0, 7.0, 7.0], 0.2)._fields(), {"extra": 0.5}),
        (Machine, robot._fields(), {"place": "hall"}),
    ):
        value, twin, other = kind(**fields, **own), kind(**fields, **own), kind(**fields)
        assert value == twin != other and len({value, twin, other}) == 2
        assert repr(value) == kind.__base__.__repr__(value)
    assert Machine(**robot._fields(), place="hall").with_arms((0, 2)).place == "hall"
    assert rk.simulate(Machine(**robot._fields()), rk.PD(7.0, 0.2), rk.hold(robot, [0.02, 0.05], 0.01)).energy.sum() > 0
    assert (OwnRule(7.0, 0.2) == 1) == "mine"


def test_no_law_of_the_package_takes_an_attribute():
    for law in (rk.APD(7.0, 0.2), rk.CTC(400.0, 40.0), rk.RedundantCTC(400.0, 40.0)):
        with pytest.raises(FrozenInstanceError):
            law.label = "mine"


def test_a_matrix_of_six_joints_prints_as_it_is_typed():
    value = Sample(np.diag(np.arange(1.0, 7.0)))
    assert eval(repr(value), {"Sample": Sample}) == value


def test_a_value_in_the_body_of_a_class_is_no_silent_default():
    """A dataclass reads defaults of fields with a type only; what it does not read is refused, not passed by."""
    robot = rk.load()
    for kind, made, body in (
        (rk.CTC, (400.0, 40.0), {"independent": None}),
        (rk.AntagonismFilter, (rk.PD(7.0, 0.2),), {"pose": "true"}),
        (rk.PID, (7.0, 1.0, 0.2), {"limit": 0.05}),
        (rk.Manipulator, (robot.base, robot.lengths, robot.masses), {"friction": [0.1, 0.2, 0.1]}),
        (rk.Sensors, (), {"encoder": 2000}),
    ):
        (name,), mine = body, type("Mine", (kind,), dict(body))
        with pytest.raises(ValueError, match=rf"Mine\.{name} = .* in the body of the class does not reach the field"):
            mine(*made)
        # Given, or handed on by an `__init__` of the class, it is the field.
        assert repr(mine(*made, **body)).replace("Mine", kind.__name__) == repr(kind(*made, **body))
    assert type("Same", (rk.CTC,), {"pose": "measured", "K_P": 3.0})(400.0, 40.0).K_P == 400.0

    @dataclass(frozen=True, eq=False, repr=False)
    class Typed(rk.CTC):
        independent: tuple | None = None

    assert Typed(400.0, 40.0).independent is None
