"""Values that look like numbers and are none, or are so large or small that an answer would be nonsense: refused."""

import functools
import re
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from samples import TESTBED

import rapkm_lite as rk
from rapkm_lite import explore, plotting
from rapkm_lite.machine.arguments import real_array

Q = rk.inverse_kinematics(TESTBED, [0.02, 0.05])
A = rk.control_matrix(TESTBED, Q)
HOLD = rk.hold(TESTBED, [0.01, 0.02], 0.05)
PD = rk.PD(7.05, 0.225)


@pytest.mark.parametrize(
    "value",
    [
        np.array([1.0, "2", 3.0], object),
        np.array([1.0, True, 3.0], object),
        np.array([1.0, b"2", 3.0], object),
        memoryview(b"123"),
        [1.0, True, 3.0],
        (1, np.True_, 3.0),
        [np.array([1.0, 2.0]), np.array([3.0, 4.0]), [True, 5.0]],
    ],
    ids=["text", "truth", "bytes", "memory", "list", "tuple", "nested"],
)
def test_what_numpy_would_turn_into_numbers(value):
    with pytest.raises(ValueError, match=r"c = .* is not numeric; allowed: real numbers"):
        rk.endeffector_stiffness(TESTBED, Q, 7.0, value)


def test_other_kinds_of_numbers_count_as_what_they_are():
    whole = rk.circle(TESTBED, radius=0.05, duration=0.5, turns=1)
    other = rk.circle(TESTBED, radius=Fraction(1, 20), duration=Decimal("0.5"), turns=np.int8(1))
    assert_array_equal(other.x, whole.x)
    corners = [[-0.05, 0.01], [0.05, 0.01], [0.0, 0.05]]
    assert_array_equal(
        rk.polygon(TESTBED, corners, duration=Fraction(1, 2)).x, rk.polygon(TESTBED, corners, duration=0.5).x
    )
    c = np.full((10, 3), 0.02)
    assert_array_equal(rk.copper_loss(TESTBED, c, Decimal("0.5")), rk.copper_loss(TESTBED, c, 0.5))


class Column:
    """What a column of a pandas table is: iterable and an array on request, but no `Sequence`."""

    def __init__(self, *values):
        self.values = np.array(values)

    def __array__(self, dtype=None, copy=None):
        return self.values.astype(dtype) if dtype else self.values

    def __iter__(self):
        return iter(self.values)

    def __len__(self):
        return len(self.values)

    def __contains__(self, label):
        """Not what it holds is asked for, but how its rows are called."""
        return label in range(7, 7 + len(self))


@pytest.mark.parametrize(
    "pair",
    [Column(0, 2), [np.array(0), np.array(2)], (np.int8(0), np.uint64(2)), (0.0, 2.0), np.array([-0.0, 2]), [0, 2.0]],
)
def test_indices_from_any_kind_of_array_count_as_what_they_are(pair):
    assert_array_equal(rk.control_matrix(TESTBED, Q, pair), rk.control_matrix(TESTBED, Q, (0, 2)))
    assert rk.feedback_norm(TESTBED, Q, pair) == rk.feedback_norm(TESTBED, Q, (0, 2))
    assert rk.CTC(400.0, 40.0, pair) == rk.CTC(400.0, 40.0, (0, 2))
    assert TESTBED.with_arms(pair) == TESTBED.with_arms((0, 2))
    at = rk.at(TESTBED, Q, rk.at(TESTBED, Q).F @ [0.3, -0.2])
    assert_array_equal(rk.complement_dot(at.J, at.J_dot, pair), rk.complement_dot(at.J, at.J_dot, (0, 2)))
    A_tilde = rk.redundant_control_matrix(TESTBED, Q)
    assert_array_equal(rk.explicit_pseudoinverse(A_tilde, pair), rk.explicit_pseudoinverse(A_tilde, (0, 2)))
    both, rows = np.stack([A_tilde, A_tilde]), np.stack([np.asarray(pair), [0, 1]])
    assert_array_equal(
        rk.explicit_pseudoinverse(both, rows), rk.explicit_pseudoinverse(both, np.array([(0, 2), (0, 1)]))
    )
    drives = tuple(rk.DeadDrive(drive, 0.5) for drive in pair)
    assert drives == (rk.DeadDrive(0, 0.5), rk.DeadDrive(2, 0.5))


@pytest.mark.parametrize("pair", [Column(0, 0), Column(0, 1.5), Column(False, True), Column(0, -1), Column("0", "2")])
def test_indices_from_any_kind_of_array_are_checked_all_the_same(pair):
    for call in (lambda: rk.control_matrix(TESTBED, Q, pair), lambda: TESTBED.with_arms(pair)):
        with pytest.raises(ValueError, match=r"(independent|arms) = .*; allowed: .* different (joint|arm) indices"):
            call()


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: rk.steady_state_error(A, 5e-324, [1e-3, 0.0, 0.0]), r"K_P.* = .*e-324; allowed: > 0, from 1e-100 on"),
        (lambda: rk.steady_state_torque(A, 1e-320 * np.eye(3), [1e-3, 0, 0]), r"K_P has the eigenvalue 1e-320; "),
        (lambda: rk.rest_exists(TESTBED, Q, 7.0, np.zeros(3), 5e-324, 0.02), r"quantum = .*e-324; allowed: > 0, from"),
        (lambda: rk.minimax_torques(A, [0.1, 0.0], 5e-324), r"limit = .*e-324; allowed: > 0, from 1e-100 on"),
        (lambda: TESTBED.replace(lengths=1e99), r"lengths = .*1e\+99.* m; allowed: up to 1e6 m"),
        (lambda: TESTBED.replace(inertias=1e-3, load=1e15), r"load = 1e\+15 let an arm move freely; allowed: "),
        (lambda: rk.Sensors(encoder=1e30), r"encoder = 1e\+30; allowed: whole numbers >= 1, to 1000000000000"),
        (lambda: rk.circle(TESTBED, 0.05, 0.3, turns=100), r"turns = 100 in 0.3 s are up to 3.93 rad per sample; allo"),
        (lambda: rk.allocate_torques(A, [0.1, 0.0], 0.3, None, [1e60] * 3), r"prestress = .* so far beyond limit = "),
        (lambda: rk.triangle(TESTBED, angle=1e99), r"angle = 1e\+99 rad; allowed: up to 1e6 rad"),
        (
            lambda: rk.Desired(1e99, *[[0.0, 0.0]] * 3, *[Q] * 3),
            r"n_arms = 1e\+99; allowed: whole numbers >= 2, to 1000",
        ),
        (lambda: rk.SimulationError("now", "it stopped"), r"time = 'now' is not numeric; allowed: real numbers"),
        (lambda: rk.PD([7.0, [7.0]], 0.2), r"K_P = \[7.0, \[7.0\]\] is not numeric; allowed: real numbers, in rows"),
        (lambda: rk.close_loops(TESTBED, Q + 0.1, 1e-30), r"tolerance = 1e-30 of the longest link; allowed: "),
        (lambda: plotting.plot_prestress_maps(rk.load("four_arms"), n=9), r"robot has 4 arms; allowed: 3, "),
        (lambda: plotting.plane_limits(TESTBED, -1.0), r"margin = -1; allowed: >= 0"),
        (lambda: explore.bars(explore.Picture({"a": {}}), "a", [], -1.0), r"width = -1; allowed: > 0"),
        (lambda: explore.Picture({}), r"panels = \{\}; allowed: one panel at least"),
        (lambda: explore.Picture({"a": {}}, setup=lambda: None), r"setup = .* cannot be called .* \(picture\)"),
    ],
)
@pytest.mark.filterwarnings("error")
def test_numbers_out_of_reason(call, words):
    with pytest.raises(ValueError, match=words):
        call()


@pytest.mark.parametrize("times", [1e51, 1e-51])
def test_a_matrix_just_out_of_the_range_that_is_told_is_refused(times):
    for A in (times * np.eye(3, 2), times * np.ones((4, 3, 2))):
        with pytest.raises(ValueError, match=r"A has 1e[+-]51 as largest entry; allowed: 1e-50 to 1e50 in magnitude"):
            rk.weighted_pseudoinverse(A)


def test_links_are_a_thousand_kilometres_long_at_most():
    base = [[-1e6, 0.0], [1e6, 0.0]]
    assert rk.Manipulator(base=base, lengths=1e6, masses=1.0).n_arms == 2
    with pytest.raises(ValueError, match="allowed: up to 1e6 m"):
        rk.Manipulator(base=base, lengths=1.01e6, masses=1.0)


def test_rounding_of_a_large_weight_is_no_lack_of_symmetry():
    """By some 1e-13 of its largest entry, whatever that is."""
    W = np.array([[4.0, 1.0 + 4e-13, 0.0], [1.0, 3.0, 0.5], [0.0, 0.5, 2.0]])
    A = np.eye(3, 2) + 0.1
    one, large = rk.weighted_pseudoinverse(A, W), rk.weighted_pseudoinverse(A, 1e8 * W)
    np.testing.assert_allclose(large, one, rtol=1e-12)


def test_a_single_row_is_no_control_matrix_to_take_two_from():
    with pytest.raises(ValueError, match=r"A_tilde has shape \(1, 3\); allowed: \(..., m, n\) with n >= m >= 2"):
        rk.explicit_pseudoinverse(np.ones((1, 3)), (0, 1))


@pytest.mark.parametrize("bad", [-1e200, 1e200, -1e100, 1e100, -np.inf, np.nan])
def test_one_number_out_of_reason_among_thousands_is_named(bad):
    values = np.zeros(2000)
    values[7] = bad
    with pytest.raises(ValueError, match=r"values\[7\] = "):
        real_array("values", values)


@pytest.mark.parametrize(("turns", "fits"), [(0.99, True), (1.01, False)])
def test_a_circle_turns_by_a_right_angle_per_sample_at_most(turns, fits):
    """The quintic is fastest half way, where its rate 30 / 16 makes pi / 2 of 2 pi turns / samples."""
    samples = 30
    turns = turns * samples / 7.5
    if fits:
        path = rk.circle(TESTBED, 0.01, 1e-3 * samples, turns=turns)
        chord = np.linalg.norm(np.diff(path.x, axis=0), axis=-1).max()
        assert 2 * np.arcsin(chord / 0.02) == pytest.approx(0.99 * np.pi / 2, rel=0.01)
    else:
        with pytest.raises(ValueError, match=r"are up to 1\.59 rad per sample; allowed: up to pi / 2"):
            rk.circle(TESTBED, 0.01, 1e-3 * samples, turns=turns)


@pytest.mark.parametrize("times", [1.0, 1e2, 1e4])
def test_a_large_prestress_is_cut_along_the_null_vector(times):
    """With one null vector n the nearest torques are best + t n, t between the limits of all drives."""
    wanted, n = times * np.array([1.0, 1.2, 0.9]), rk.null_basis(A)[:, 0]
    best = rk.weighted_pseudoinverse(A) @ [0.1, 0.0]
    ends = np.sort([(-0.3 - best) / n, (0.3 - best) / n], axis=0)
    t = np.clip(n @ wanted, ends[0].max(), ends[1].min())
    assert_allclose(rk.allocate_torques(A, [0.1, 0.0], 0.3, prestress=wanted), best + t * n, atol=1e-9)


def test_results_that_do_not_fit_together():
    study, run = rk.sweep(TESTBED, PD, HOLD, 1e-3 * np.eye(3)), rk.simulate(TESTBED, PD, HOLD)

    def changed(value, **fields):
        return type(value)(**(value._fields() | fields))

    for name in ("offsets", "energies", "torque_norm", "x_final", "failure_time"):
        with pytest.raises(ValueError, match=rf"{name} has shape .*; allowed: \(3.*, a row per run"):
            changed(study, **{name: np.zeros((2, 5))})
    for wrong in (0.5, None, [1, 2, 3], {"a": 1}, np.zeros(2)):
        with pytest.raises(ValueError, match=r"stopped = .*; allowed: a string or None for each of 3 runs"):
            changed(study, stopped=wrong)
    with pytest.raises(ValueError, match=r"failed has shape \(3, 3\); allowed: \(k,\)"):
        changed(study, failed=np.eye(3))
    hidden = np.ma.array(run.c, mask=run.c > -1.0)
    for wrong in (hidden, np.ma.masked):
        with pytest.raises(ValueError, match=r"c .*; allowed: "):
            changed(run, c=wrong)


class Short(rk.Law):
    def step(self, memory):
        return np.zeros(3), memory


class Long:
    def start(self, model, dt, more):
        return None

    def step(self, memory, sample):
        return np.zeros(3), memory


class Formula(rk.Law):
    def torque(self, model, q):
        return np.zeros(3)


@pytest.mark.parametrize(
    ("law", "name"), [(Short(), "step"), (Long(), "start"), (Formula(), "torque")], ids=["step", "start", "torque"]
)
def test_methods_of_a_law_with_other_parameters(law, name):
    for whole in (law, rk.AntagonismFilter(law)):
        with pytest.raises(ValueError, match=rf"law.{name} = .* cannot be called .*; allowed: a function \("):
            rk.simulate(TESTBED, whole, HOLD)


class Turned(rk.Law):
    def start(self, dt, model):
        return None


class Exchanged(rk.Law):
    def step(self, sample, memory):
        return np.zeros(3), memory


@pytest.mark.parametrize(
    ("law", "told"),
    [
        (Turned(), "start takes (dt, model)"),
        (Exchanged(), "step takes (sample, memory)"),
        (lambda t, qd_a, q_a, desired: 0.0 * q_a, "law takes (t, qd_a, q_a, desired)"),
        (lambda q_a, rates, wanted, t: 0.0 * rates, "law takes (q_a, rates, wanted, t)"),
        (lambda q_a, rates, wanted, time: 0.0 * rates, "law takes (q_a, rates, wanted, time)"),
        (rk.compiled(lambda t, q_a, qd_a, d, memory, at: 0.0 * q_a, at="true", memory=1), "d, memory, at)"),
    ],
)
def test_arguments_in_another_order_are_refused(law, told):
    for whole in (law, rk.AntagonismFilter(law)):
        with pytest.raises(ValueError, match=re.escape(f"{told}, in another order; allowed: (")):
            rk.simulate(TESTBED, whole, HOLD)


def test_what_is_given_by_name_alone_has_no_place_in_an_order():
    """A run calls (t, q_a, qd_a, desired) by place; after a * follows what it does not give."""

    def law(t, *readings, desired="nothing"):
        assert desired == "nothing"
        return -7.0 * (readings[0] - readings[2].q_a)

    run = rk.simulate(TESTBED, law, HOLD, 1e-3)
    np.testing.assert_allclose(run.c[0], -7e-3, rtol=0, atol=1e-12)


def test_a_wrapper_counts_not_what_it_wraps():
    def inner(q_a, qd_a, desired, t):
        return 0.0 * q_a

    @functools.wraps(inner)
    def outer(t, q_a, qd_a, desired):
        return inner(q_a, qd_a, desired, t)

    assert not rk.simulate(TESTBED, outer, HOLD).c.any()


class Joints(rk.Law):
    """A law that answers what `found` is where it is asked for its independent joints."""

    def __init__(self, found):
        self.found = found

    def step(self, memory, sample):
        return np.zeros(3), memory

    def coordinates(self, memory):
        return self.found


SAMPLE = rk.Sample(rk.Controller(PD, TESTBED), 0.0, HOLD.q_a[0], HOLD.qd_a[0], HOLD[0])


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: rk.singular_values(1e80 * A), r"A has .*e\+80 as largest entry; allowed: 1e-50 to 1e50 in magnitude"),
        (lambda: rk.null_basis(1e-160 * A), r"A has .*e-160 as largest entry; allowed: 1e-50 to 1e50 in magnitude"),
        (lambda: rk.singular_values([A, 1e-60 * A]), r"A has .*e-60 as largest entry; allowed: 1e-50 to 1e50 in magn"),
        (lambda: rk.singular_values([1e60 * A, A]), r"A has .*e\+60 as largest entry; allowed: 1e-50 to 1e50 in magn"),
        (lambda: rk.Sensors(encoder=np.nextafter(4096, 0)), r"encoder = 4095\.9999999999995; allowed: whole numbers"),
        (lambda: rk.effective_gain(1e-160 * A, 7.0), r"F has .*e-160 as largest entry; allowed: 1e-50 to 1e50"),
        (lambda: rk.select_independent(np.full((3, 6), 1e80)), r"A_tilde has 1e\+80 as largest entry; allowed: "),
        (lambda: rk.steady_state_torque(1e-160 * A, 7.0, [1e-3, 0, 0]), r"A has .*e-160 as largest entry; allowed: "),
        (
            lambda: rk.complement([[1e-200, 0.0, 1e-200]], (0, 1)),
            r"J has 1e-200 as largest entry; allowed: 1e-50 to 1e50",
        ),
        (
            lambda: rk.close_loops(TESTBED, Q, 1e-13, 10**9),
            r"iterations = 1e\+09; allowed: whole numbers >= 1, to 10000",
        ),
        (lambda: rk.CTC(400.0, 40.0, range(10**12)), r"independent = range.*; allowed: 2 different joint indices"),
        (lambda: rk.simulate(TESTBED, PD, HOLD, faults=range(10**12)), r"faults holds 0; allowed: values of Torque"),
        (lambda: PD.gains(10**7), r"m = 1e\+07; allowed: whole numbers >= 1, to 1000"),
        (lambda: PD.start(3, 1e-3), r"model = 3; allowed: a Manipulator"),
        (lambda: PD.step(None, 3), r"sample = 3; allowed: a Sample"),
        (lambda: rk.CTC(400.0, 40.0).step(None, HOLD[0]), r"sample = .*; allowed: a Sample"),
        (lambda: rk.PID(7.0, 1.0, 0.2).step([np.nan] * 3, SAMPLE), r"memory\[0\] = nan; allowed: finite numbers"),
        (lambda: SAMPLE.pose(["true"]), r"source = \['true'\]; allowed: 'measured', 'true'"),
        (lambda: rk.CommandFilter(PD).torque(3, Q, Q, Q[:3], Q[:3], HOLD[0]), r"model = 3; allowed: a Manipulator"),
        (lambda: rk.Controller(PD, TESTBED)(0, HOLD.q_a, HOLD.qd_a, HOLD), r"desired.q has shape .*; allowed: \(6,\)"),
        (lambda: rk.Controller(PD, TESTBED)(0, [Q[:3]], Q[:3], HOLD[0]), r"q_a has shape \(1, 3\); allowed: \(3,\)"),
        (lambda: HOLD["x"], r"k = 'x'; allowed: a sample from 0 to 50, a slice, or an array"),
        (lambda: HOLD[51], r"k = 51; allowed: a sample from 0 to 50"),
        (
            lambda: rk.hold(TESTBED, TESTBED.base[0]),
            r"x\[0\] = .* m puts arm [12] on the boundary .*; allowed: points inside",
        ),
        (lambda: rk.triangle(TESTBED, duration=1e-90, dt=1e-91), r"dt = 1e-91 s; allowed: 1e-12 s or more"),
        (
            lambda: rk.follow(TESTBED, HOLD.t, HOLD.x, HOLD.xd, HOLD.xdd + 1e99),
            r"xdd has .* 1e\+99 m/s\^2; allowed: up",
        ),
        (lambda: rk.antagonism_form(rk.load("four_arms"), HOLD, 7.0), r"trajectory has 3 arms, robot has 4; allowed"),
        (lambda: rk.simulate(TESTBED, Joints("abc"), HOLD), r"law.coordinates\(memory\) = 'abc'; allowed: 2 different"),
        (lambda: rk.simulate(TESTBED, Joints((0.5, 1)), HOLD), r"law.coordinates\(memory\) = \(0.5, 1\); allowed: 2"),
        (
            lambda: TESTBED.replace(base=1e-160 * TESTBED.base),
            r"base = .* holds one point twice, to 1e-50 m; allowed: ",
        ),
    ],
)
@pytest.mark.filterwarnings("error")
def test_what_was_answered_with_nan_or_with_words_of_the_machinery(call, words):
    with pytest.raises((ValueError, IndexError), match=words):
        call()


@pytest.mark.parametrize("kind", [np.float16, np.float32, np.longdouble, ">f8"])
def test_results_are_kept_in_full_precision(kind):
    run = rk.simulate(TESTBED, PD, HOLD, [4e-3, 0.0, 0.0])
    other = rk.Run(**(run._fields() | {"c": run.c.astype(kind)}))
    assert other.c.dtype == other.energy.dtype == float
    assert_array_equal(other.energy, rk.Run(**(run._fields() | {"c": run.c.astype(kind).astype(float)})).energy)


@pytest.mark.parametrize("count", [3.0, np.int8(3), Decimal(3), np.array(3)])
def test_the_number_of_arms_is_a_plain_number(count):
    desired = rk.Desired(**(HOLD[3]._fields() | {"n_arms": count}))
    assert type(desired.n_arms) is int and desired == HOLD[3]
    assert_array_equal(desired.q_a, HOLD[3].q_a)


@pytest.mark.parametrize(
    "law", [rk.APD(7.0, 0.2), rk.CTC(400.0, 40.0), rk.SwitchedCTC(400.0, 40.0), rk.RedundantCTC(400, 40)]
)
@pytest.mark.parametrize(
    "form", [np.ndarray.tolist, lambda v: v.astype(object), np.ma.array], ids=["list", "object", "ma"]
)
def test_formulas_of_laws_take_lists(law, form):
    d, q_a = HOLD[3], HOLD[3].q_a + 1e-3
    c = law.torque(TESTBED, *map(form, (d.q, 0.01 * (d.q - d.q), q_a, d.qd_a)), d)
    assert type(c) is np.ndarray and c.dtype == float
    assert_array_equal(c, law.torque(TESTBED, d.q, 0 * d.q, q_a, d.qd_a, d))


def test_the_formula_of_a_switched_law_repeats_what_is_given_once():
    law, many = rk.SwitchedCTC(400.0, 40.0), HOLD[:4]
    once = law.torque(TESTBED, HOLD.q[0], HOLD.qd[0], many.q_a + 1e-3, many.qd_a, many)
    assert_allclose(once, law.torque(TESTBED, many.q, many.qd, many.q_a + 1e-3, many.qd_a, many), atol=1e-12)


PALETTE = explore.Palette((0.0, 1.0), ("#888888",), ("#777777",))


@pytest.mark.parametrize(
    ("draw", "words"),
    [
        (lambda p: p.line("a", "x", [0, 1]), r"x = 'x' is not numeric; allowed: real numbers"),
        (lambda p: p.line("a", [0, 1], [0, 1, 2]), r"y has shape \(3,\), x has \(2,\); allowed: a number for each x"),
        (lambda p: p.line("a", [0, 1], [0, 1], alpha="x"), r"alpha = 'x' is not numeric; allowed: "),
        (lambda p: p.line("a", [0, 1], [0, 1], linestyle=["-"]), r"linestyle = \['-'\]; allowed: '-'"),
        (lambda p: p.trace("a", [0, 1], [0]), r"y has shape \(1,\), t has \(2,\); allowed: a number for each time"),
        (lambda p: p.trace("a", [0, 1], [0, 1], points=0), r"points = 0; allowed: >= 1"),
        (lambda p: p.text("a", [0, 1], 0, "b"), r"x has shape \(2,\); allowed: one number"),
        (lambda p: p.text("a", 0, 0, 3), r"words = 3; allowed: text"),
        (lambda p: p.bar("a", 1, None), r"height = None is not numeric; allowed: "),
        (lambda p: p.polygon("a", [0, 1]), r"points has shape \(2,\); allowed: \(k, 2\)"),
        (lambda p: p.arrow("a", [0, 0], [1, 0, 0]), r"vector has shape \(3,\); allowed: \(2,\)"),
        (lambda p: p.image("a", [0, 1], (0, 1, 0, 1), PALETTE), r"values has shape \(2,\); allowed: \(k, k\)"),
        (lambda p: p.image("a", np.ones((2, 2)), (0, 1, 0), PALETTE), r"extent has shape \(3,\); allowed: \(4,\)"),
        (lambda p: p.image("a", np.ones((2, 2)), (0, 1, 0, 1), "hot"), r"palette = 'hot'; allowed: a Palette"),
        (lambda p: p.legend("a", ["b"]), r"entries = \['b'\]; allowed: a list of \(words, keywords of a line\)"),
        (lambda p: p.limits("a", y=(1, 1)), r"y = \(1, 1\); allowed: two different numbers"),
        (lambda p: p.fit("a", [1.0], least=0), r"least = 0; allowed: > 0"),
        (lambda p: p.handle("a", 0, 0, gain=3), r"gain = 3; allowed: \(a, b\) or \(a, b, c\)"),
        (lambda p: p.handle("a", 0, 0), r"a handle moves no control; allowed: name of a control = \(a, b\)"),
        (lambda p: p.xlim(["a"]), r"there is no panel \['a'\]; allowed: a"),
        (lambda p: explore.Picture({"a": {"xlim": 3}}), r"xlim has shape \(\); allowed: \(2,\)"),
        (lambda p: explore.Picture({"a": {"title": 3}}), r"title = 3; allowed: text"),
    ],
)
def test_marks_of_a_picture(draw, words):
    with pytest.raises((ValueError, KeyError), match=words):
        draw(explore.Picture({"a": {}}))


def test_a_logarithmic_panel_has_no_place_for_zero():
    """log 0 is not finite: the canvas would paint nothing, and Matplotlib would keep other limits."""
    words = r"y(lim)? = \(.*\) of a panel with yscale = 'log'; allowed: two positive numbers"
    for panel in ({"yscale": "log"}, {"yscale": "log", "ylim": (0, 10)}, {"ylim": (-1, 1), "yscale": "log"}):
        with pytest.raises(ValueError, match=words):
            explore.Picture({"a": panel})
    picture = explore.Picture({"a": {"yscale": "log", "ylim": (0.1, 10)}, "b": {}})
    for change in (lambda: picture.limits("a", y=(0, 1)), lambda: picture.fit("a", [1, 100])):
        with pytest.raises(ValueError, match=words):
            change()
    picture.limits("a", x=(-1, 1), y=(1e-3, 1e3))
    picture.limits("b", y=(-1, 1))
    assert (picture.ylim("a"), picture.ylim("b")) == ((1e-3, 1e3), (-1.0, 1.0))


def test_what_is_masked_or_missing_is_a_gap():
    picture = explore.Picture({"a": {}})
    picture.line("a", [0, 1, 2], np.ma.array([0.0, 5.0, 1.0], mask=[0, 1, 0]))
    assert_array_equal(picture.marks[0].data, [[0.0, 0.0], [1.0, np.nan], [2.0, 1.0]])
    picture.fit("a", [0.5, np.nan, -1.0, np.inf])
    assert picture.ylim("a") == (-1.5, 1.5)


def test_a_panel_in_which_no_curve_is_left_has_limits_too():
    hidden, gaps = explore.Picture({"a": {}}), explore.Picture({"a": {}})
    hidden.fit("a", *[])
    gaps.fit("a", [np.nan])
    assert hidden.ylim("a") == gaps.ylim("a")


def test_a_weight_is_positive_definite_in_any_units_of_the_drives():
    """Told as a diagonal or as a matrix it is one weight; torques S c in other units have S^-1 A and S^-1 W S^-1."""
    far = np.array([1e-9, 1e9, 1.0])
    assert np.array_equal(rk.weighted_pseudoinverse(A, np.diag(far)), rk.weighted_pseudoinverse(A, far))
    W, S = np.array([[2.0, 0.5, 0.0], [0.5, 1.0, 0.3], [0.0, 0.3, 1.0]]), np.diag([1e4, 1.0, 1e-4])
    told = rk.weighted_pseudoinverse(np.linalg.inv(S) @ A, np.linalg.inv(S) @ W @ np.linalg.inv(S))
    assert_allclose(np.linalg.inv(S) @ told, rk.weighted_pseudoinverse(A, W), rtol=1e-9)
    for wrong in (np.ones((3, 3)), np.diag([1.0, 0.0, 1.0]), [[1e9, 1.0, 0.0], [1.0, 1e-9, 0.0], [0.0, 0.0, 1.0]]):
        with pytest.raises(ValueError, match=r"W has the eigenvalue .*; allowed: symmetric positive definite"):
            rk.weighted_pseudoinverse(A, wrong)


def test_each_weight_of_a_stack_is_judged_by_its_own_size():
    """With a multiple of the identity, (A^T)_W^+ is the pseudoinverse of A^T, whatever the multiple."""
    weights = np.array([1e-3, 1e12])[:, None, None] * np.eye(3)
    assert_allclose(rk.weighted_pseudoinverse(A, weights), [np.linalg.pinv(A.T)] * 2, rtol=0, atol=1e-15)
    lopsided = np.stack([[[1.0, 0.5, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], 1e12 * np.eye(3)])
    for W in (lopsided, lopsided[0]):
        with pytest.raises(ValueError, match=r"W is not symmetric \(by 0\.5\); allowed: symmetric positive definite"):
            rk.weighted_pseudoinverse(A, W)
    with pytest.raises(ValueError, match=r"W has the eigenvalue -1; allowed: symmetric positive definite"):
        rk.weighted_pseudoinverse(A, weights - np.array([0.0, 1e12 + 1.0])[:, None, None] * np.eye(3))
