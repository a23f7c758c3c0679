"""Hostile calls of every public name, made from the signatures: refused by a sentence, or answered with numbers."""

from collections import Counter

import hostile
import numpy as np
import pytest

import rapkm_lite as rk
from rapkm_lite import explore, plotting

# Calls per argument: what is not refused in a picture draws.
MODULES = {"rapkm_lite": (rk, 8), "plotting": (plotting, 2), "explore": (explore, 4)}


@pytest.fixture(scope="module", params=MODULES)
def judged(request):
    """All calls of a module with their verdicts, and the module's name."""
    module, each = MODULES[request.param]
    return [(case, *hostile.judge(case)) for case in hostile.cases(module, each)], module.__name__


def shown(judged, *verdicts):
    return [
        f"{case.name}({case.parameter}={str(case.value)[:40]!r}): {words[:150]}"
        for case, verdict, words in judged[0]
        if verdict in verdicts
    ][:40]


def test_no_call_hangs_or_answers_with_nan(judged):
    assert not shown(judged, "hang", "nan")


def test_refusals_are_sentences(judged):
    cases, module = judged
    count = Counter(verdict for _, verdict, _ in cases)
    print(dict(count))
    assert not hostile.shortfall(module, count), "\n".join(shown(judged, "half", "unclear"))


def test_there_are_thousands_of_cases(judged):
    assert len(judged[0]) >= (3000 if judged[1] == "rapkm_lite" else 60)


@pytest.mark.parametrize(
    ("verdicts", "words"),
    [
        ({"clear": 98, "half": 2, "accepted": 5}, ""),
        ({"clear": 97, "half": 2, "unclear": 1}, "97 of 100 refusals clear; needed: 98%"),
        ({"clear": 100, "nan": 1, "hang": 2}, "1 nan, 2 hang"),
        ({"accepted": 3}, "0 of 0 refusals clear; needed: 98%"),
    ],
)
def test_a_share_that_is_too_small_fails_the_run_of_all_calls(verdicts, words):
    assert hostile.shortfall("rapkm_lite", Counter(verdicts)) == words


def test_too_many_survivors_fail_the_run_of_mutants():
    pytest.importorskip("resource", reason="Windows has no such module")
    import mutants

    assert mutants.enough(180, 200) and not mutants.enough(179, 200) and not mutants.enough(0, 0)


def test_the_changes_that_change_nothing_are_of_lines_that_stand():
    """A line that was written anew needs a new look."""
    pytest.importorskip("resource", reason="Windows has no such module")
    import mutants

    for name in mutants.equivalents():
        module, source = name.rsplit(" | ", 1)[0].split(" | ", 1)
        lines = (mutants.ROOT / "rapkm_lite" / module).read_text(encoding="utf-8").splitlines()
        assert source in map(str.strip, lines), name


@pytest.mark.parametrize("module", [rk, plotting, explore], ids=MODULES)
def test_the_good_arguments_are_good(module):
    """The hostile calls differ in one argument from calls that work; a function without such a call is not covered."""
    for function, thing in hostile.functions(module):
        arguments = hostile.good_arguments(function, thing)
        if arguments is not None:
            thing(**arguments)
            hostile.plt.close("all")
        elif function != "Calibration":
            new = hostile.new_words(function, thing)
            pytest.fail(f"{function}({new}): needs a good value of each of these in GOOD or OTHER of tests/hostile.py")


@pytest.mark.parametrize(
    "function",
    [
        rk.control_matrix,
        rk.redundant_control_matrix,
        rk.nullspace_projector,
        lambda robot, q: rk.inverse_dynamics(robot, q, 0 * q, 0 * q),
        lambda robot, q: rk.forward_dynamics(robot, q, 0 * q, np.zeros(3)),
        lambda robot, q: rk.orthogonal_complement_dot(robot, q, 0 * q, (0, 1)),
        lambda robot, q: rk.redundant_dynamics(robot, q, 0 * q),
    ],
)
def test_rates_and_torques_need_a_closed_pose(function):
    q = hostile.Q + np.array([0.01, 0, 0, 0, 0, 0])
    with pytest.raises(
        ValueError, match=r"q leaves the loops open by .* m; allowed: 0.0002 m .*close_loops\(robot, q\)"
    ):
        function(hostile.ROBOT, q)
    function(hostile.ROBOT, rk.close_loops(hostile.ROBOT, q))
    function(hostile.ROBOT, hostile.Q.round(5))  # as one types it from a print


@pytest.mark.parametrize("factor", [0.0, 2.0, 57.3])
def test_rates_fit_the_positions(factor):
    path = hostile.PATH
    with pytest.raises(ValueError, match=r"xd\[\d+\] = .* m/s does not fit x: .* allowed: the time derivative of x"):
        rk.follow(path.robot, path.t, path.x, factor * path.xd, path.xdd)
    slopes = np.gradient(path.x, path.t, axis=0)
    assert len(rk.follow(path.robot, path.t, path.x, slopes, path.xdd)) == len(path)


def test_a_jump_of_the_set_point_and_standing_still_are_no_mistakes():
    t = np.linspace(0.0, 1.0, 101)
    for x in (np.where(t[:, None] < 0.5, [0.0, 0.0], [0.02, 0.0]), np.tile([0.01, 0.02], (101, 1))):
        assert np.all(rk.follow(hostile.ROBOT, t, x, 0 * x, 0 * x).x == x)
