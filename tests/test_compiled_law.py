"""Laws that a user compiled: the same torques as in Python, against the textbook layer; memory, filters, studies."""

import copy
import importlib
import linecache
import math
import pickle
import re
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from samples import InPython

import rapkm_lite as rk
from rapkm_lite.control.compiled_law import CompiledLaw
from rapkm_lite.engine import COMPILED, user
from rapkm_lite.engine.pointer import MATRICES, places
from rapkm_lite.engine.refusal import refusal

ROBOT = rk.load().replace(friction=0.0)
PATH = rk.circle(ROBOT, radius=0.05, duration=0.3)
OFFSET = np.array([4e-3, -2e-3, 5e-3])
PD = rk.PD(7.05, 0.225)


@rk.compiled(memory=3)
def pid(t, q_a, qd_a, d, memory):
    e = q_a - d.q_a
    memory += 1e-3 * 20.0 * e
    return -(7.05 * e + 0.225 * (qd_a - d.qd_a) + memory)


def ctc(t, q_a, qd_a, d, at):
    G, C, Q = at.redundant
    return at.A_tilde_T_pinv @ (G @ d.qdd + C @ d.qd + Q) - 7.0 * (q_a - d.q_a) - 0.2 * (qd_a - d.qd_a)


@pytest.mark.parametrize("model", [None, ROBOT.replace(lengths=1.001 * ROBOT.lengths)])
def test_set_points_that_open_the_loops_are_refused_as_in_python(model):
    law = rk.compiled(ctc, at="desired")
    # The loops open by 7 mm, and by 0.02 mm, which a model slightly wrong brings as well.
    wide, narrow = (PATH.with_set_points(PATH.q_a + [apart, 0.0, 0.0]) for apart in (0.03, 1e-4))
    for run in (rk.simulate, lambda *arguments, **named: rk.sweep(*arguments, OFFSET, **named)):
        for one in (law, InPython(law)):
            with pytest.raises(ValueError, match=r"q leaves the loops open by 0.007\d+ m; allowed"):
                run(ROBOT, one, wide, model=model)
    pair = [rk.simulate(ROBOT, one, narrow, OFFSET, model=model).c for one in (law, InPython(law))]
    assert_allclose(*pair, rtol=0, atol=1e-10)
    # Of arms whose tips lie apart it is one and the same that says where the end-effector is.
    there = rk.compiled(lambda t, q_a, qd_a, d, at: np.array([at.x[0], at.x[1], at.xd[0]]), at="desired")
    pair = [rk.simulate(ROBOT, one, narrow, model=model).c[0] for one in (there, InPython(there))]
    assert_allclose(*pair, rtol=0, atol=1e-14)
    # A law that asks for nothing follows any set-points.
    assert_array_equal(rk.simulate(ROBOT, pid, wide).t, wide.t)


def test_memory_against_the_law_of_the_package():
    runs = [rk.simulate(ROBOT, pid, PATH, OFFSET) for _ in range(2)]
    assert_array_equal(runs[0].c, runs[1].c)  # it starts with zeros every time
    assert_allclose(runs[0].c, rk.simulate(ROBOT, rk.PID(7.05, 20.0, 0.225), PATH, OFFSET).c, rtol=0, atol=1e-12)


@pytest.mark.parametrize("source", ["desired", "measured", "true"])
def test_model_at_every_pose_against_the_textbook_layer(source):
    law = rk.compiled(ctc, at=source)
    run = rk.simulate(ROBOT, law, PATH, OFFSET)
    assert_allclose(run.c, rk.simulate(ROBOT, InPython(law), PATH, OFFSET).c, rtol=0, atol=1e-10)
    # (25) of the desired motion is what the law adds to PD.
    q, qd, qdd = PATH.q[0], PATH.qd[0], PATH.qdd[0]
    if source == "desired":
        pd = -7.0 * (run.q_a[0] + OFFSET - PATH.q_a[0]) - 0.2 * (run.qd_a[0] - PATH.qd_a[0])
        assert_allclose(run.c[0] - pd, rk.inverse_dynamics(ROBOT, q, qd, qdd), atol=1e-12)


@pytest.mark.parametrize("name", ["asymmetric", "four_arms", "five_bar"])
def test_every_matrix_of_at(name):
    """Each entry, and each of `d`, with a weight of its own: engine and `at` make the same torque of them."""
    robot = rk.load(name)
    # The matrices are those of the model, which differs from the machine in all that they depend on.
    model = robot.replace(gravity=(0.3, -9.0), load=0.1, lengths=1.001 * robot.lengths, inertias=1.2 * robot.inertias)
    model = model.replace(friction=robot.friction + 2e-3, friction_velocity=2.0 * robot.friction_velocity)
    path = rk.circle(robot, radius=0.02, duration=0.02)

    @rk.compiled(at="desired")
    def weigh(t, q_a, qd_a, d, at):
        total, k = 0.0, 0
        for M in (
            at.F,
            at.F_dot,
            at.A,
            at.A_T_pinv,
            at.J,
            at.J_dot,
            at.N,
            at.N_dot,
            at.G,
            at.C,
            at.A_tilde,
            at.A_tilde_T_pinv,
            at.minimal[0],
            at.minimal[1],
            at.redundant[0],
            at.redundant[1],
        ):
            for i in range(M.shape[0]):
                for j in range(M.shape[1]):
                    k += 1
                    total += M[i, j] * np.cos(0.37 * k)
        poses = (at.x, at.xd, at.q, at.qd, at.Q, at.minimal[2], at.redundant[2])
        for v in (*poses, d.x, d.xd, d.xdd, d.q, d.qd, d.qdd, d.q_a, d.qd_a, d.qdd_a):
            for i in range(v.shape[0]):
                k += 1
                total += v[i] * np.cos(0.37 * k)
        return -7.05 * (q_a - d.q_a) - 0.225 * (qd_a - d.qd_a) + 1e-4 * total

    fast, slow = (rk.simulate(robot, law, path, model=model) for law in (weigh, InPython(weigh)))
    assert np.abs(fast.c).max() > 1e-4
    assert_allclose(fast.c, slow.c, rtol=0, atol=1e-13)


@rk.compiled(at="measured")
def redundant(t, q_a, qd_a, d, at):
    """(32), as it is printed."""
    G, C, Q = at.redundant
    return at.A_tilde_T_pinv @ (G @ (d.qdd - 400.0 * (at.q - d.q) - 40.0 * (at.qd - d.qd)) + C @ at.qd + Q)


@pytest.mark.parametrize("name", ["testbed", "asymmetric", "four_arms"])
def test_a_compiled_law_in_redundant_coordinates_is_that_of_the_package(name):
    robot = rk.load(name)
    path, offset = rk.circle(robot, 0.06, 0.5), np.linspace(2e-3, -3e-3, robot.n_arms)
    own, ours = (rk.simulate(robot, law, path, offset) for law in (redundant, rk.RedundantCTC(400.0, 40.0)))
    assert_allclose(own.c, ours.c, rtol=0, atol=1e-12)


def all_at_once(t, q_a, qd_a, d, at, memory):
    """Matrices that depend on angles and rates, the pose, what was measured, time and memory."""
    total = 0.0
    for M in (at.F, at.F_dot, at.A_T_pinv, at.J_dot, at.N_dot, at.C, at.minimal[1], at.redundant[1], at.A_tilde_T_pinv):
        for i in range(M.shape[0]):
            for j in range(M.shape[1]):
                total += 0.1 * M[i, j] * np.cos(0.37 * (5 * i + j))
    for v in (at.x, at.xd, at.q, at.qd, at.Q, at.minimal[2], at.redundant[2]):
        for i in range(v.shape[0]):
            total += v[i] * np.cos(0.37 * i)
    memory[0] += total
    memory[1] = t + q_a[1]
    c = -7.05 * np.sin(at.q[:3] - d.q_a) - 0.225 * (at.qd[:3] - d.qd_a) + 1e-3 * total
    c[1] += 1e-4 * memory[0]
    c[2] += 1e-2 * memory[1] + 1e-3 * qd_a[1]
    return c


@pytest.mark.parametrize("around", [lambda law: law, rk.AntagonismFilter], ids=["bare", "filter"])
@pytest.mark.parametrize("source", ["measured", "true"])
def test_pose_and_memory_of_a_law_with_both_are_those_of_its_run_in_python(source, around):
    """Of a wrong model, by real encoders, one of which is a turn off, on a path that goes round the turn of a drive."""
    model = ROBOT.replace(lengths=[[0.2, 0.201], [0.199, 0.2], [0.2, 0.2]], friction=3e-3, gravity=(0.3, -0.5))
    circle = rk.circle(ROBOT, 0.12, 0.8)
    crosses = int(np.abs(circle.q_a + np.pi).min(axis=1).argmin())
    part = slice(crosses - 15, crosses + 16)
    path = rk.follow(ROBOT, circle.t[:31], circle.x[part], circle.xd[part], circle.xdd[part])
    own, offset = rk.compiled(all_at_once, at=source, memory=2), OFFSET + [0.0, 2 * np.pi, 0.0]
    law, slow = around(own), around(InPython(own))
    given = {"encoder": 4000, "model": model, "velocity_filter": 2e-3, "faults": rk.OffsetJump(2, 0.01, 3e-3)}
    run, expected = (rk.simulate(ROBOT, one, path, offset, **given) for one in (law, slow))
    assert_allclose(run.c, expected.c, rtol=0, atol=1e-10)
    assert_allclose(run.x, expected.x, rtol=0, atol=1e-10)
    study = rk.sweep(ROBOT, law, path, [-OFFSET, offset], **given)
    assert_allclose(study.energies[1], expected.energy, rtol=0, atol=1e-10)


@pytest.mark.parametrize("name", ["five_bar", "asymmetric", "four_arms"])
def test_the_buffer_has_room_for_the_matrices_of_at_and_no_more(name):
    """Those that `at` finds, less the first rows of others, five matrices (2N, 2) between, and the desired motion; then
    memory and answer."""
    robot = rk.load(name)
    q = rk.inverse_kinematics(robot, [0.02, 0.03])
    at, N = rk.at(robot, q, 0.0 * q), robot.n_arms
    assert np.all(at.A == at.F[:N]) and np.all(at.A_tilde == at.N[:N])
    found = [getattr(at, field) for field in MATRICES if field not in ("A", "A_tilde")]
    numbers = sum(np.size(part) for M in found for part in (M if isinstance(M, tuple) else (M,)))
    desired = 1 + 2 * N + 6 + 3 * 2 * N
    for matrices, start in ((False, desired), (True, desired + numbers + 5 * 2 * N * 2)):
        assert places(N, matrices, 4) == (start, start + 4, start + 4 + N)


def test_the_projector_is_one_where_its_two_columns_are_nearly_parallel(monkeypatch):
    """P = P P, P F = F, and the derivatives of both; columns at an angle of 1e-7 lose seven digits in one pass."""
    rng, n = np.random.default_rng(5), 6
    F, F_dot = rng.normal(size=(2, n, 2))
    F[:, 1] = F[:, 0] + 1e-7 * F[:, 1]
    U, V, P, P_dot = np.empty((n, 2)), np.empty((n, 2)), np.empty((n, n)), np.empty((n, n))
    # Only kernels call compiled parts: here both run in Python.
    spread, project = (getattr(part, "py_func", part) for part in (user.spread, user.project))
    monkeypatch.setattr(user, "spread", spread)
    project(F, F_dot, U, V, P, P_dot, n)
    assert_allclose(P @ P, P, rtol=0, atol=1e-15)
    assert_allclose(P @ F, F, rtol=0, atol=1e-14)
    size = np.abs(P_dot).max()
    assert_allclose(P @ P_dot + P_dot @ P, P_dot, rtol=0, atol=1e-14 * size)
    assert_allclose(P_dot @ F + P @ F_dot, F_dot, rtol=0, atol=1e-14 * size)


def test_what_a_compiled_pose_has_not_is_told_with_what_it_has():
    law = rk.compiled(lambda t, q_a, qd_a, d, at: at.tip_columns[0], at="desired")
    if COMPILED:
        with pytest.raises(
            ValueError, match=r"at has no tip_columns here, but x, xd, q, qd, F, .*a rk\.Law whose step calls it, which"
        ):
            rk.simulate(ROBOT, law, PATH)


def test_a_law_is_told_the_time_of_its_path():
    path = rk.hold(ROBOT, [0.0, 0.0], 0.02, dt=2e-3)
    law = rk.compiled(lambda t, q_a, qd_a, d: 1e-3 * t * np.ones(3))
    assert_allclose(rk.simulate(ROBOT, law, path).c, np.outer(1e-3 * path.t, np.ones(3)), rtol=1e-14)


def test_inside_a_filter_and_in_a_study():
    filtered = rk.AntagonismFilter(pid)
    run = rk.simulate(ROBOT, filtered, PATH, OFFSET)
    expected = rk.simulate(ROBOT, rk.AntagonismFilter(rk.PID(7.05, 20.0, 0.225)), PATH, OFFSET)
    assert_allclose(run.c, expected.c, rtol=0, atol=1e-11)
    study = rk.sweep(ROBOT, pid, PATH, np.stack([OFFSET, -OFFSET, OFFSET]))
    assert_array_equal(study.energies[0], study.energies[2])
    assert_allclose(study.energies[0], rk.simulate(ROBOT, pid, PATH, OFFSET).energy, rtol=0, atol=1e-11)


def in_place(t, q_a, qd_a, d):
    q_a -= d.q_a
    qd_a -= d.qd_a
    c = -7.05 * q_a - 0.225 * qd_a
    q_a[:] = 7.0
    qd_a[:] = -9.0
    return c


def test_what_was_measured_is_the_laws_own_to_write():
    """It is PD, compiled or not, also inside filters, of which that with a W runs in Python."""
    law = rk.compiled(in_place)
    for around in (lambda law: law, rk.AntagonismFilter, lambda law: rk.AntagonismFilter(law, W=np.eye(3))):
        for one in (law, in_place):
            run, expected = (rk.simulate(ROBOT, around(each), PATH, OFFSET) for each in (one, PD))
            assert_allclose(run.c, expected.c, rtol=0, atol=1e-11)
            assert_allclose(run.q_a, expected.q_a, rtol=0, atol=1e-11)


@pytest.mark.skipif(not COMPILED, reason="Python refuses to write into them")
def test_what_a_law_writes_into_its_motion_and_matrices_lasts_for_one_sample():
    """It is PD: trees of two arms share no entry of G and C in (2), and no loop is cut from arms 1 and 3 at once."""

    @rk.compiled(at="desired")
    def law(t, q_a, qd_a, d, at):
        c = -7.05 * (q_a - d.q_a) - 0.225 * (qd_a - d.qd_a)
        c[0] += at.G[0, 1] + at.C[0, 1] + at.J[0, 2] + at.J_dot[0, 2]
        at.G[0, 1] = at.C[0, 1] = at.J[0, 2] = at.J_dot[0, 2] = d.q_a[0] = 9.0
        return c

    assert_allclose(rk.simulate(ROBOT, law, PATH, OFFSET).c, rk.simulate(ROBOT, PD, PATH, OFFSET).c, rtol=0, atol=1e-11)


def test_a_law_that_writes_into_what_was_measured_is_lost_as_any_other():
    """The run is repeated in Python to say what the law answered: with its time, words and samples."""

    @rk.compiled
    def law(t, q_a, qd_a, d):
        q_a -= d.q_a
        qd_a -= d.qd_a
        c = -7.05 * q_a - 0.225 * qd_a
        return c * np.nan if t > 0.15 else c

    for one, around in ((law, lambda law: law), (law.function, lambda law: law), (law, rk.AntagonismFilter)):
        with pytest.raises(rk.SimulationError, match=r"law\(t = 0.1510 s, ...\)\[0\] = nan; allowed: finite") as caught:
            rk.simulate(ROBOT, around(one), PATH, OFFSET)
        whole = rk.simulate(ROBOT, around(PD), PATH, OFFSET)
        assert len(caught.value.partial) == 151
        assert_allclose(caught.value.partial.c, whole.c[:151], rtol=0, atol=1e-11)


def test_values():
    assert pid == rk.compiled(pid.function, memory=3) and pid != rk.compiled(pid.function, memory=4)
    assert repr(pid) == "compiled(pid, at=None, memory=3)"
    with pytest.raises(ValueError, match="at = 'pose'; allowed: "):
        rk.compiled(ctc, at="pose")
    with pytest.raises(ValueError, match="memory = -1; allowed: >= 0"):
        rk.compiled(ctc, memory=-1)
    with pytest.raises(ValueError, match=r"function = compiled\(pid, .*\); allowed: \(t, q_a, qd_a, d"):
        rk.compiled(pid, memory=3)
    for wrong in (3, "pid", rk.PD):  # a class makes laws and is none
        with pytest.raises(ValueError, match=r"function = .*; allowed: \(t, q_a, qd_a, d"):
            rk.compiled(wrong)
    assert rk.compiled(ctc, memory=10**6).memory == 10**6
    for wrong in ({"at": "nowhere"}, {"memory": 10**6 + 1}):  # at once, before there is a function
        with pytest.raises(ValueError, match=f"{next(iter(wrong))} = .*; allowed"):
            rk.compiled(**wrong)
    rk.compiled(max).check()  # a built-in function, which has no signature
    poses = {source: rk.compiled(ctc, at=source).pose for source in ("desired", "measured", "true", None)}
    assert poses == {"desired": None, "measured": "measured", "true": "true", None: None}  # what a run has to find


table = {"gain": 7.0}


def helper(e):
    return -7.0 * e


def words(t, q_a, qd_a, d):
    return "no torque"


def silent(t, q_a, qd_a, d):
    e = q_a - d.q_a
    e *= 2.0


def outside(t, q_a, qd_a, d):
    e = q_a - d.q_a
    return -table["gain"] * e


def helped(t, q_a, qd_a, d):
    return helper(q_a - d.q_a)


def undefined(t, q_a, qd_a, d):
    e = q_a - d.q_a
    return -unknown_gain * e  # noqa: F821


def misspelt(t, q_a, qd_a, d):
    return -7.0 * (q_a - d.qa)


def twofold(t, q_a, qd_a, d):
    c = 0.0
    if t > 0.1:
        c = -7.0 * (q_a - d.q_a)
    return c


def managed(t, q_a, qd_a, d):
    with np.errstate(all="ignore"):
        return -7.0 * (q_a - d.q_a)


def compared(t, q_a, qd_a, d):
    return q_a > d.q_a


def by_name(t, q_a, qd_a, d, *, gain=7.0):
    return -gain * (q_a - d.q_a)


def square(t, q_a, qd_a, d):
    return np.zeros((3, 3))


def summed(t, q_a, qd_a, d):
    e = q_a - d.q_a
    return -7.0 * np.einsum("i->i", e)


def labelled(t, q_a, qd_a, d):
    c = "7" + q_a
    return c


def imports(t, q_a, qd_a, d):
    import math

    return -7.0 * math.cos(t) * q_a


def keyed(t, q_a, qd_a, d):
    return {"drive 1": q_a[0]}


def counted(t, q_a, qd_a, d):
    return {0: q_a[0], 1: q_a[1], 2: q_a[2]}


def collected(t, q_a, qd_a, d):
    return {q_a[0], q_a[1], q_a[2]}


def as_bytes(t, q_a, qd_a, d):
    return b"abc"


gains = [7.0, 7.0, 7.0]


def listed(t, q_a, qd_a, d):
    e = q_a - d.q_a
    return -gains[0] * e


def _enclosing():
    own = [7.0, 7.0, 7.0]

    def enclosed(t, q_a, qd_a, d):
        e = q_a - d.q_a
        return -own[0] * e

    return enclosed


enclosed = _enclosing()


def nested(t, q_a, qd_a, d):
    return [q_a, q_a, q_a]


REFUSED = {
    summed: 'numpy.einsum is not known here, line # of test_compiled_law.py: return -7.0 * np.einsum("i->i", e)',
    labelled: 'add(a string, an array) is not known here, line # of test_compiled_law.py: c = "7" + q_a',
    imports: "unsupported opcode (IMPORT_NAME), line # of test_compiled_law.py: import math",
    words: "it returns a string",
    silent: "it returns nothing: is a return missing?",
    outside: 'table is of type dict, line # of test_compiled_law.py: return -table["gain"] * e',
    helped: "helper is a function without @numba.njit, line # of test_compiled_law.py: return helper(q_a - d.q_a)",
    undefined: "name 'unknown_gain' is not defined, line # of test_compiled_law.py: return -unknown_gain * e",
    misspelt: "d has no qa, line # of test_compiled_law.py: return -7.0 * (q_a - d.qa)",
    twofold: "c is once a number and once an array, line # of test_compiled_law.py:",
    managed: 'such a with statement is not known here, line # of test_compiled_law.py: with np.errstate(all="ignore"):',
    by_name: "arguments after * are not known here",
    square: "it returns an array with 2 dimensions",
    compared: "it returns truth values",
    keyed: "it returns a dictionary)",
    counted: "it returns a dictionary)",
    collected: "it returns a set)",
    as_bytes: "it returns bytes)",
    nested: "it returns a list)",
    listed: "gains is a list; an array would be known, line # of test_compiled_law.py: return -gains[0] * e",
    enclosed: "own is a list; an array would be known, line # of test_compiled_law.py: return -own[0] * e",
}


class Table(dict):
    def __call__(self, t, q_a, qd_a, d):
        return -7.0 * (q_a - d.q_a)


def test_an_object_goes_by_the_name_of_its_class():
    assert repr(rk.compiled(Table())) == "compiled(Table, at=None, memory=0)"


@pytest.mark.skipif(not COMPILED, reason="without Numba nothing is compiled")
def test_an_object_is_no_function_that_can_be_compiled():
    with pytest.raises(ValueError, match=r"the law Table cannot be compiled \(it is no function but an object\)"):
        rk.simulate(ROBOT, rk.compiled(Table()), PATH)


def test_what_numba_compiled_is_sent_to_the_decorator():
    """Numba types all arguments, used or not, and there is no type of its own for a desired motion."""
    law = pytest.importorskip("numba").njit(lambda t, q_a, qd_a, d: -7.0 * q_a)
    for one in (law, rk.AntagonismFilter(law)):
        with pytest.raises(
            ValueError, match=r"what `desired` is; allowed: rapkm_lite\.compiled of it, or the function"
        ):
            rk.simulate(ROBOT, one, PATH)


def test_what_numba_compiled_runs_in_python_as_it_was_written():
    """Also where the run is repeated to find out what went wrong."""

    def plain(t, q_a, qd_a, d):
        return -7.0 * (q_a - d.q_a) if t < 0.0205 else np.nan * q_a

    law = rk.compiled(pytest.importorskip("numba").njit(plain))
    for one in (law, rk.AntagonismFilter(law), InPython(law)):
        with pytest.raises(rk.SimulationError, match=r"^at t = 0\.0210 s .+\[0\] = nan; allowed") as lost:
            rk.simulate(ROBOT, one, rk.hold(ROBOT, [0.0, 0.0]), OFFSET)
        assert len(lost.value.partial) == 21


@pytest.mark.skipif(not COMPILED, reason="without Numba it divides by zero in Python")
def test_what_runs_only_compiled_is_lost_like_any_other_law():
    """Python raises for 1.0 / 0.0 at the first sample, which compiled code passes: it is not why the run was lost."""
    law = rk.compiled(lambda t, q_a, qd_a, d: q_a * (-min(1.0 / t, 0.1) if t < 0.0205 else np.nan))
    path = rk.hold(ROBOT, [0.0, 0.0])
    for run in (rk.simulate, lambda *arguments: rk.sweep(*arguments[:3], [OFFSET, OFFSET])):
        with pytest.raises(
            rk.SimulationError, match=r"at t = 0\.0210 s the law <lambda> returned torques that"
        ) as lost:
            run(ROBOT, law, path, OFFSET)
        assert len(lost.value.partial) == 21


@pytest.mark.skipif(not COMPILED, reason="without Numba the function and what it calls run in Python")
@pytest.mark.parametrize("first", [0.0, 0.0205])
@pytest.mark.parametrize("ends", ["raises", "answers nothing finite"])
def test_a_law_that_cannot_run_in_python_is_told_by_what_it_did_compiled(first, ends):
    """Numba takes `d` from compiled code and not from Python: that it does not is not why the run was lost."""
    kind = ends == "raises"
    pull = pytest.importorskip("numba").njit(lambda q_a, d: -7.0 * (q_a - d.q_a))

    @rk.compiled
    def law(t, q_a, qd_a, d):
        c = -7.0 * (q_a - d.q_a)
        if t >= first:
            c = pull(q_a, d) * np.nan
            if kind:
                raise ValueError("mine")
        return c

    path = rk.hold(ROBOT, [0.0, 0.0])
    samples = int(np.count_nonzero(path.t < first))
    reason = "the law law returned torques that are not 3 finite numbers, or raised an exception there"
    with pytest.raises(rk.SimulationError) as lost:
        rk.simulate(ROBOT, law, path, OFFSET)
    assert (lost.value.time, lost.value.reason, lost.value.__cause__) == (path.t[samples], reason, None)
    assert len(lost.value.partial) == samples
    study = rk.sweep(ROBOT, law, path, [OFFSET, OFFSET], failed="mask")
    assert study.reasons == (reason,) * 2


def test_a_compiled_law_that_was_copied_remembers_as_much():
    law = rk.compiled(lambda t, q_a, qd_a, d, memory: -7.0 * (q_a - d.q_a), memory=3)
    make, arguments = law.__reduce__()
    for again in (make(*arguments), copy.copy(law), copy.deepcopy(law)):
        assert again == law and again.memory == 3


def test_a_decorated_law_travels():
    """The name of a decorated function is that of the law; runs go to other processes and come back as they were."""
    for law in (pid, rk.compiled(pid.function, memory=4), rk.AntagonismFilter(pid), rk.compiled(ctc, at="true")):
        again = pickle.loads(pickle.dumps(law))
        assert again == law == copy.deepcopy(law) and hash(again) == hash(law)
    assert pickle.loads(pickle.dumps(pid)).function is pid.function
    run = rk.simulate(ROBOT, pid, PATH, OFFSET)
    assert pickle.loads(pickle.dumps(run)) == run
    with ProcessPoolExecutor(1) as pool:
        study = rk.sweep(ROBOT, [pid, rk.PD(7.05, 0.225)], PATH, OFFSET, executor=pool, chunk=1)
    assert study == rk.sweep(ROBOT, [pid, rk.PD(7.05, 0.225)], PATH, OFFSET)
    with pytest.raises((AttributeError, pickle.PicklingError)):
        pickle.dumps(rk.compiled(lambda t, q_a, qd_a, d: -q_a))


@pytest.mark.parametrize("inverse", ["A_T_pinv", "A_tilde_T_pinv"])
def test_an_input_singularity_is_refused_as_in_python(inverse):
    """In mode (+, +, -) all distal links point along one line half-way between the first two drives."""
    robot = ROBOT.replace(mode=[1, 1, -1])
    path = rk.hold(robot, robot.base[:2].mean(axis=0), 0.1)
    assert rk.degree_of_actuation(robot, path.q[0]) == 1
    if inverse == "A_T_pinv":
        law = rk.compiled(lambda t, q_a, qd_a, d, at: 0.01 * at.A_T_pinv[:, 1], at="desired")
    else:
        law = rk.compiled(lambda t, q_a, qd_a, d, at: 0.01 * at.A_tilde_T_pinv[:, 1], at="desired")
    for faults in ([], [rk.TorqueLimit(0.1)]):
        for one in (law, InPython(law)):
            with pytest.raises(ValueError, match="has lost rank"):
                rk.simulate(robot, one, path, faults=faults)


@pytest.mark.skipif(not COMPILED, reason="without Numba nothing is compiled")
@pytest.mark.filterwarnings("error")  # the sentence comes alone
@pytest.mark.parametrize("function", REFUSED, ids=lambda function: function.__name__)
def test_what_does_not_compile_is_one_sentence_with_its_line(function):
    words = re.escape(REFUSED[function]).replace(r"\#", r"(\d+)")
    with pytest.raises(ValueError, match=rf"^the law {function.__name__} cannot be compiled \({words}") as caught:
        rk.simulate(ROBOT, rk.compiled(function), PATH)
    said = str(caught.value)
    assert said.isprintable() and "nopython" not in said and "1d" not in said and "float64" not in said
    assert said.endswith("or the same function without @compiled, which runs in Python")
    assert type(caught.value.__cause__).__module__.startswith("numba")
    if r"(\d+)" in words:
        number = int(re.search(words, said)[1])
        first = function.__code__.co_firstlineno
        assert first < number <= first + 4
        assert said.split(".py: ")[-1].split(")); ")[0].split("); ")[0] in linecache.getline(__file__, number)


def test_words_of_the_compiler_that_nobody_foresaw_are_told_without_its_steps():
    """The first line that says something, as far as a sentence goes."""
    odd = "Failed in nopython mode (step: frontend)\n\n \x1b[1mThe moon is full of array(float64, 1d, C)\x1b[0m"
    assert refusal(helper, ValueError(f"{odd}\nFile elsewhere")) == "The moon is full of an array"
    assert refusal(helper, ValueError("")) == "no reason given"
    assert refusal(helper, ValueError("moon " * 90)) == ("moon " * 90)[:160]
    # What is no function of Python's has no lines.
    assert refusal(len, ValueError('the moon\nFile "test_compiled_law.py", line 3')) == "the moon"


def test_the_line_that_is_told_is_the_first_in_the_users_file():
    """The compiler tells lines of its own, too, and further ones of what the law calls."""
    here = misspelt.__code__.co_firstlineno
    told = (("/numba/typeinfer.py", 7), (__file__, here + 1), (__file__, here))
    text = "the moon\n" + "".join(f'File "{file}", line {line}\n' for file, line in told)
    line = f"line {here + 1} of test_compiled_law.py: return -7.0 * (q_a - d.qa)"
    assert refusal(misspelt, ValueError(text)) == f"the moon, {line}"
    assert refusal(misspelt, ValueError('the moon\nFile "/numba/typeinfer.py", line 7')) == "the moon"


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        ("array(complex128, 1d, C)", "it returns complex numbers"),
        ("array(float64, 0d, C)", "it returns an array with 0 dimensions"),
        ("complex128", "it returns a complex number"),
        ("Literal[int](7)", "it returns 7"),
        ("reflected list(float64)<iv=None>", "it returns a list"),
        ("generator(func=<function f at 0x7f>, args=(float64,), has_finalizer=True)", "it yields: a return is needed"),
    ],
)
def test_what_it_returns_instead_of_torques_is_told_without_names_of_types(kind, words):
    assert refusal(len, ValueError("not to be read"), kind).startswith(words)


def test_arguments_are_counted_before_the_run():
    message = r"compiled\(<lambda>, at=None, memory=0\) = .* cannot be called .*: a function \(t, q_a, qd_a, d\)"
    with pytest.raises(ValueError, match=message):
        rk.simulate(ROBOT, rk.compiled(lambda t, q_a, qd_a: -q_a), PATH)
    with pytest.raises(ValueError, match=r"at='true', memory=2\) = .* \(t, q_a, qd_a, d, at, memory\)$"):
        rk.simulate(ROBOT, rk.compiled(pid.function, at="true", memory=2), PATH)


def added(t, q_a, qd_a, d, memory):
    memory = memory + 1e-3 * (q_a - d.q_a)
    return -7.0 * (q_a - d.q_a) - 5.0 * memory


def chosen(t, q_a, qd_a, d, kept):
    e = q_a - d.q_a
    if t > 0.5:
        e, kept = 2.0 * e, kept * 0.5
    return -7.0 * e - 5.0 * kept


def written(t, q_a, qd_a, d, memory):
    rows, e = memory.reshape(3, 1), q_a - d.q_a
    e -= 1e-6
    memory *= 0.99
    memory[0] += 1e-3 * e[0]
    rows[1:, 0] = memory[1:] + 1e-3 * e[1:]
    return -7.0 * e - 5.0 * memory


@pytest.mark.parametrize(("law", "name"), [(added, "memory"), (chosen, "kept"), (written, None)])
def test_a_memory_that_would_be_forgotten_is_refused(law, name):
    compiled = rk.compiled(law, memory=3)
    if name is None:  # only written in place: kept from sample to sample, as in Python
        assert_allclose(
            rk.simulate(ROBOT, compiled, PATH).c, rk.simulate(ROBOT, InPython(compiled), PATH).c, atol=1e-12
        )
        return
    for run in (rk.simulate, rk.sweep):
        with pytest.raises(ValueError, match=rf"memory=3\) gives {name} a new value, .* allowed: .*{name} \+= \.\.\."):
            run(ROBOT, compiled, PATH, np.zeros((1, 3)) if run is rk.sweep else 0.0)


def integrated(t, q_a, qd_a, d, memory):
    e = q_a - d.q_a
    integral = memory + 1e-3 * e
    return -7.0 * e - 5.0 * integral


def counted(t, q_a, qd_a, d, steps):
    n = steps[0] + 1.0
    return -7.0 * (q_a - d.q_a) if n > 100.0 else 0.0 * q_a


def handed_on(t, q_a, qd_a, d, memory):
    np.add(memory, 5e-3 * (q_a - d.q_a), memory)
    return -7.0 * (q_a - d.q_a) - 0.2 * (qd_a - d.qd_a) - memory


def aliased(t, q_a, qd_a, d, memory):
    first, rest = memory[:1], memory
    first[0] += 5e-3 * (q_a[0] - d.q_a[0])
    rest[1:] += 5e-3 * (q_a - d.q_a)[1:]
    return -7.0 * (q_a - d.q_a) - 0.2 * (qd_a - d.qd_a) - memory


@pytest.mark.parametrize(("law", "name"), [(integrated, "memory"), (counted, "steps")])
def test_a_memory_that_is_only_read_is_refused(law, name):
    """As `rk.compiled` says: what the next sample is to see is written in place."""
    with pytest.raises(ValueError, match=rf"memory=3\) reads {name} but never writes into it; allowed: .*{name} \+="):
        rk.simulate(ROBOT, rk.compiled(law, memory=3), PATH)


def viewed(t, q_a, qd_a, d, memory):
    whole, none, last = memory[...], slice(0, 0), np.arange(3) == 2
    memory[last] + 0.0
    memory[none] + 0.0
    whole += 5e-3 * (q_a - d.q_a)
    return -7.0 * (q_a - d.q_a) - 0.2 * (qd_a - d.qd_a) - memory


@pytest.mark.parametrize("law", [handed_on, aliased, viewed])
def test_a_memory_that_is_written_under_another_name_is_none_that_is_only_read(law):
    c = rk.simulate(ROBOT, InPython(rk.compiled(law, memory=3)), PATH, OFFSET).c
    assert_allclose(c, rk.simulate(ROBOT, rk.PID(7.0, 5.0, 0.2), PATH, OFFSET).c, atol=1e-10)


FIRST = {
    "too short": (lambda t, q_a, qd_a, d: -q_a[:2], r"law returned the shape \(2,\); allowed: \(3,\)"),
    "too long": (lambda t, q_a, qd_a, d: np.zeros(4), r"law returned the shape \(4,\); allowed: \(3,\)"),
    "not finite": (lambda t, q_a, qd_a, d: np.full(3, np.nan), r"law\(t = 0.0000 s, ...\)\[0\] = nan; allowed: finite"),
}


@pytest.mark.parametrize("kind", FIRST)
def test_the_first_answer_is_checked_as_that_of_any_law(kind):
    function, message = FIRST[kind]
    for law in (function, rk.compiled(function), rk.AntagonismFilter(rk.compiled(function))):
        with pytest.raises(ValueError, match=message):
            rk.simulate(ROBOT, law, PATH)
        laws = [rk.PD(7.05, 0.225), law]
        with pytest.raises(ValueError, match=message) as caught:
            rk.sweep(ROBOT, laws, PATH, OFFSET, failed="raise" if kind == "not finite" else "mask")
        assert caught.value.partial.failed.tolist() == [False, True]


def test_what_it_raises_at_the_first_sample_belongs_to_the_caller():
    def law(t, q_a, qd_a, d):
        if t < 1.0:
            raise ValueError("mine")
        return -q_a

    for one in (law, rk.compiled(law)):
        with pytest.raises(ValueError, match=r"^mine$"):
            rk.simulate(ROBOT, one, PATH)
        assert "ValueError: mine (line " in rk.sweep(ROBOT, one, PATH, OFFSET, failed="mask").reasons[0]


@pytest.mark.skipif(not COMPILED, reason="Python's integers have no end")
def test_a_law_that_fails_only_as_a_compiled_one_is_named():
    """2^n doubled sample by sample is zero from n = 64 on in 64 bits, and the reciprocal of zero no torque."""

    def doubling(t, q_a, qd_a, d):
        double = 1
        for _ in range(round(1e3 * t)):
            double *= 2
        return -7.05 * (q_a - d.q_a) - 0.225 * (qd_a - d.qd_a) + 1e-3 / double

    assert np.all(np.isfinite(rk.simulate(ROBOT, doubling, PATH, OFFSET).c))
    law = rk.compiled(doubling)
    for around in (law, rk.AntagonismFilter(law)):
        with pytest.raises(rk.SimulationError, match="law doubling returned torques that are not 3") as caught:
            rk.simulate(ROBOT, around, PATH, OFFSET)
        assert caught.value.time == PATH.t[64]


@pytest.mark.filterwarnings("error")  # nothing is written to the error stream
@pytest.mark.parametrize("wrapped", [False, True])
@pytest.mark.parametrize("how", ["raises", "writes beyond the end", "answers nothing finite"])
def test_a_law_that_raises_says_what_the_plain_function_says(how, wrapped):
    """Same sample, same reason, same cause; a run that went on would hold the last torques."""
    if how == "raises":

        @rk.compiled
        def law(t, q_a, qd_a, d):
            if t > 0.15:
                raise ValueError("mine")
            return -7.05 * (q_a - d.q_a) - 0.225 * (qd_a - d.qd_a)

    elif how == "answers nothing finite":

        @rk.compiled
        def law(t, q_a, qd_a, d):
            c = -7.05 * (q_a - d.q_a) - 0.225 * (qd_a - d.qd_a)
            return c + np.inf if t > 0.15 else c

    else:

        @rk.compiled(memory=3)
        def law(t, q_a, qd_a, d, memory):
            c = -7.05 * (q_a - d.q_a) - 0.225 * (qd_a - d.qd_a)
            memory[0] += 1.0
            if memory[0] > 151.5:
                c[int(memory[0])] = t
            return c

    class Plain(rk.Law):
        pose = None

        def start(self, model, dt):
            return np.zeros(3)

        def step(self, memory, sample):
            own = (memory,) if law.memory else ()
            return law.function(sample.t, sample.q_a, sample.qd_a, sample.desired, *own), memory

    around = rk.AntagonismFilter if wrapped else lambda law: law
    with pytest.raises(rk.SimulationError, match="law") as plain:
        rk.simulate(ROBOT, around(Plain()), PATH, OFFSET)
    with pytest.raises(rk.SimulationError, match="law") as caught:
        rk.simulate(ROBOT, around(law), PATH, OFFSET)
    one, other = plain.value, caught.value
    assert one.time == other.time == PATH.t[151] and one.reason == other.reason
    assert type(one.__cause__) is type(other.__cause__) and str(one.__cause__) == str(other.__cause__)
    assert len(one.partial) == len(other.partial) == 151
    assert_allclose(one.partial.c, other.partial.c, rtol=0, atol=1e-11)
    study = rk.sweep(ROBOT, around(law), PATH, np.tile(OFFSET, (2, 1)), failed="mask")
    assert study.failed.all() and study.reasons == (one.reason,) * 2


@pytest.mark.parametrize("bad", [np.inf, -np.inf, np.nan, 1e120])
def test_a_limit_of_the_drives_makes_no_torque_of_what_is_none(bad):
    def law(t, q_a, qd_a, d):
        c = -7.0 * (q_a - d.q_a) - 0.2 * (qd_a - d.qd_a)
        if t > 0.1:
            c[1] = bad
        return c

    for one in (law, rk.compiled(law)):
        with pytest.raises(rk.SimulationError, match=r"allowed: finite") as caught:
            rk.simulate(ROBOT, one, PATH, OFFSET, faults=rk.TorqueLimit([np.inf, 0.3, np.inf]))
        assert caught.value.time == pytest.approx(0.101)


def test_a_law_that_fails_at_the_last_sample_fails_in_a_study_too():
    def law(t, q_a, qd_a, d):
        c = -7.0 * (q_a - d.q_a) - 0.2 * (qd_a - d.qd_a)
        if t > 0.29999:
            c[0] = np.nan
        return c

    for one in (law, rk.compiled(law)):
        with pytest.raises(rk.SimulationError) as caught:
            rk.simulate(ROBOT, one, PATH, OFFSET)
        study = rk.sweep(ROBOT, one, PATH, np.tile(OFFSET, (2, 1)), failed="mask")
        assert caught.value.time == pytest.approx(0.3) and study.failed.all()
        assert_allclose(study.failure_time, 0.3)


def test_a_law_that_fails_beside_a_lost_machine_is_not_to_blame_either():
    """As in `test_a_law_is_to_blame_up_to_a_milliard_radians_per_second`: the machine was lost in the hold before."""
    path = rk.hold(ROBOT, [0.02, 0.05], 3e-12, 1e-12)
    pose = rk.at(ROBOT, path.q[0], 0 * path.q[0])
    xd = 1.6e9 / np.abs(pose.F[:3, 0]).max() * np.array([1.0, 0.0])
    kick = np.linalg.pinv(pose.A.T) @ pose.minimal[0] @ xd / path.dt

    def law(t, q_a, qd_a, d):
        return kick * math.sqrt(1.0 - 2e12 * t)

    for one in (law, rk.compiled(law)):
        with pytest.raises(rk.SimulationError, match="the machine left the workspace") as caught:
            rk.simulate(ROBOT, one, path)
        assert caught.value.time == 0.0 and len(caught.value.partial) == 1
        assert isinstance(caught.value.__cause__, ValueError)


def test_a_law_of_a_script_travels_by_its_name():
    """Plain pickle has no other way, and a process that is forked finds it."""
    there = """import pickle, rapkm_lite as rk
@rk.compiled(memory=3)
def soft(t, q_a, qd_a, d, memory):
    return -2.0 * (q_a - d.q_a)
again = pickle.loads(pickle.dumps(soft))
assert again == soft and again.function is soft.function"""
    done = subprocess.run([sys.executable, "-c", there], check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


class Own(CompiledLaw):
    """A class of a user's."""


def test_a_law_of_a_users_class_travels_as_one_of_that_class():
    law = Own(ctc, "true", 2)
    for again in (pickle.loads(pickle.dumps(law)), copy.deepcopy(law)):
        assert type(again) is Own and again == law


def test_a_law_of_a_notebook_travels_with_its_code():
    """As to the executors of clusters; by its name a process that is not forked would not find it."""
    cloudpickle = pytest.importorskip("cloudpickle", reason="needs the optional extra [cluster]")
    there = """import cloudpickle, sys, rapkm_lite as rk
@rk.compiled(memory=3)
def soft(t, q_a, qd_a, d, memory):
    return -2.0 * (q_a - d.q_a)
sys.stdout.buffer.write(cloudpickle.dumps(soft))"""
    data = subprocess.run([sys.executable, "-c", there], check=True, capture_output=True).stdout
    law = cloudpickle.loads(data)
    assert repr(law) == "compiled(soft, at=None, memory=3)"
    assert cloudpickle.loads(cloudpickle.dumps(pid)) == pid  # of a module: by its name
    assert rk.simulate(ROBOT, law, PATH).c.shape == (len(PATH), 3)


@pytest.mark.parametrize("name", ["03_law", "my-law"])
def test_a_law_of_a_file_whose_name_is_no_word_of_python_travels(name, tmp_path, monkeypatch):
    """`importlib` reads such a module, and pickle finds a function there."""
    (tmp_path / f"{name}.py").write_text(
        "import rapkm_lite as rk\n\n@rk.compiled\ndef soft(t, q_a, qd_a, d):\n    return -7.0 * (q_a - d.q_a)\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    law = importlib.import_module(name).soft
    assert pickle.loads(pickle.dumps(law)) == law
