"""Values that look like numbers and are none, or are so large or small that an answer would be nonsense: refused."""

from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from samples import TESTBED

import rapkm_lite as rk
from rapkm_lite import explore, plotting

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
    ],
    ids=["text", "truth", "bytes", "memory"],
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
        (lambda: rk.close_loops(TESTBED, Q, 1e-30), r"tolerance = 1e-30 of the longest link; allowed: "),
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
    for wrong in (0.5, None, [1, 2, 3], {"a": 1}):
        with pytest.raises(ValueError, match=r"stopped = .*; allowed: a tuple, a string or None for each run"):
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
