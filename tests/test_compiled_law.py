"""Laws that a user compiled: the same torques as in Python, against the textbook layer; memory, filters, studies."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import rapkm_lite as rk
from rapkm_lite.engine import COMPILED

ROBOT = rk.load().replace(friction=0.0)
PATH = rk.circle(ROBOT, radius=0.05, duration=0.3)
OFFSET = np.array([4e-3, -2e-3, 5e-3])


class InPython(rk.Law):
    """The function of a compiled law with the textbook matrices, sample by sample."""

    def __init__(self, law):
        self.law, self.pose = law, law.pose

    def start(self, model, dt):
        return self.law.start(model, dt)

    def step(self, memory, sample):
        return self.law.step(memory, sample)


@rk.compiled(memory=3)
def pid(t, q_a, qd_a, d, memory):
    e = q_a - d.q_a
    memory += 1e-3 * 20.0 * e
    return -(7.05 * e + 0.225 * (qd_a - d.qd_a) + memory)


def ctc(t, q_a, qd_a, d, at):
    G, C, Q = at.redundant
    return at.A_tilde_T_pinv @ (G @ d.qdd + C @ d.qd + Q) - 7.0 * (q_a - d.q_a) - 0.2 * (qd_a - d.qd_a)


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
    """Each entry with a weight of its own: what the law adds to PD is the same from the engine and from `at`."""
    robot = rk.load(name).replace(gravity=(0.3, -9.0), load=0.1)
    path = rk.circle(robot, radius=0.02, duration=0.02)

    @rk.compiled(at="desired")
    def weigh(t, q_a, qd_a, d, at):
        total, k = 0.0, 0
        for M in (
            at.F,
            at.F_dot,
            at.A,
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
        for v in (at.Q, at.minimal[2], at.redundant[2]):
            for i in range(v.shape[0]):
                k += 1
                total += v[i] * np.cos(0.37 * k)
        return -7.05 * (q_a - d.q_a) - 0.225 * (qd_a - d.qd_a) + 1e-4 * total

    fast, slow = rk.simulate(robot, weigh, path), rk.simulate(robot, InPython(weigh), path)
    assert np.abs(fast.c).max() > 1e-4
    assert_allclose(fast.c, slow.c, rtol=0, atol=1e-13)


def test_inside_a_filter_and_in_a_study():
    filtered = rk.AntagonismFilter(pid)
    run = rk.simulate(ROBOT, filtered, PATH, OFFSET)
    expected = rk.simulate(ROBOT, rk.AntagonismFilter(rk.PID(7.05, 20.0, 0.225)), PATH, OFFSET)
    assert_allclose(run.c, expected.c, rtol=0, atol=1e-11)
    study = rk.sweep(ROBOT, pid, PATH, np.stack([OFFSET, -OFFSET, OFFSET]))
    assert_array_equal(study.energies[0], study.energies[2])
    assert_allclose(study.energies[0], rk.simulate(ROBOT, pid, PATH, OFFSET).energy, rtol=0, atol=1e-11)


def test_values():
    assert pid == rk.compiled(pid.function, memory=3) and pid != rk.compiled(pid.function, memory=4)
    assert repr(pid) == "compiled(pid, at=None, memory=3)"
    with pytest.raises(ValueError, match="at = 'pose'; allowed: "):
        rk.compiled(ctc, at="pose")
    with pytest.raises(ValueError, match="memory = -1; allowed: >= 0"):
        rk.compiled(ctc, memory=-1)


@pytest.mark.skipif(not COMPILED, reason="without Numba nothing is compiled")
def test_what_does_not_compile_says_so():
    @rk.compiled
    def words(t, q_a, qd_a, d):
        return "no torque"

    with pytest.raises(ValueError, match=r"the law words cannot be compiled .* without @compiled"):
        rk.simulate(ROBOT, words, PATH)

    @rk.compiled
    def short(t, q_a, qd_a, d):
        return -q_a[:2]

    with pytest.raises(rk.SimulationError, match="not 3 finite numbers"):
        rk.simulate(ROBOT, short, PATH)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("how", ["raises", "writes beyond the end"])
def test_a_law_that_raises_is_not_taken_for_one_that_answers(how):
    """The plain function raises at the same sample, and a run that goes on would hold the last torques."""
    if how == "raises":

        @rk.compiled
        def law(t, q_a, qd_a, d):
            if t > 0.15:
                raise ValueError("mine")
            return -7.05 * (q_a - d.q_a) - 0.225 * (qd_a - d.qd_a)

    else:

        @rk.compiled
        def law(t, q_a, qd_a, d):
            c = -7.05 * (q_a - d.q_a) - 0.225 * (qd_a - d.qd_a)
            if t > 0.15:
                c[7] = t
            return c

    with pytest.raises(rk.SimulationError, match="law") as plain:
        rk.simulate(ROBOT, law.function, PATH)
    with pytest.raises(
        rk.SimulationError, match="the law law returned torques that are not 3 finite numbers"
    ) as caught:
        rk.simulate(ROBOT, law, PATH)
    assert caught.value.time == plain.value.time
    assert len(caught.value.partial.t) == len(plain.value.partial.t)
    study = rk.sweep(ROBOT, law, PATH, np.zeros((2, 3)), failed="mask")
    assert study.failed.all()
