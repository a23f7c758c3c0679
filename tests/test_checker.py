"""What `check`, `hint` and `draw_own` promise, on exercises made up for it and on those of the lessons."""

import json
import re
import warnings
from decimal import Decimal
from fractions import Fraction
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest
import sympy

import rapkm_lite as rk
from rapkm_lite.checks import Case, Exercise, Measured, check, draw_own, examine, exercises, hint
from rapkm_lite.figures import style
from rapkm_lite.lessons import checker
from rapkm_lite.lessons.answers import NOTHING, Answer, numbers
from rapkm_lite.lessons.judging import judged
from rapkm_lite.lessons.lesson04 import lean_law
from rapkm_lite.lessons.lesson09.tasks import quiet_gears

SHAPES = "make it hold there too; shapes of the arguments tell the numbers"


def scaled(K_P, v, limit):
    return K_P * v / limit


def cases(rng):
    return [(rng.uniform(2, 9, 3), rng.normal(size=3), float(rng.uniform(1, 5))) for _ in range(5)]


def plane(v):
    return np.array([[2.0, 1.0], [0.5, 3.0]]) * v


def damped(power):
    """The filtered command by a projection that is damped, so right to the less digits the larger the damping."""

    def command(A, K_P, q, q_d):
        B = K_P[:, None] * A
        return q - B @ np.linalg.solve(B.T @ B + 10.0**power * np.eye(2), B.T @ (q - q_d))

    return command


def test_a_more_accurate_answer_has_no_worse_a_verdict():
    """Where the deviation passes and the law, which has other units, does not yet, an answer is close."""
    order = ["ok", "close", "wrong"]
    words = [order.index(judged(exercises()["04.filtered_command"], damped(power)).word) for power in range(-12, 2)]
    assert words[0] == 0 and words == sorted(words) and set(words[:8]) == {0, 1}


@pytest.mark.parametrize("name", ["05.dead_encoder", "11.one_law"])
def test_a_law_that_knows_the_true_pose_is_no_answer(name):
    found = judged(exercises()[name], lambda robot: rk.AntagonismFilter(rk.CTC(400.0, 40.0, None, pose="true")))
    assert found.word == "wrong" and "the true pose" in found.sentence


@pytest.mark.parametrize("name", ["02.guaranteed_force", "06.expected_cost", "10.force_left", "11.gain_for_bandwidth"])
def test_a_number_with_the_wrong_sign_in_some_cases_is_told_so(name):
    right, asked = exercises()[name].reference, []

    def answer(*case):
        asked.append(case)
        return right(*case) * (-1) ** len(asked)

    assert "in some cases the sign is opposite" in judged(exercises()[name], answer).sentence


@pytest.mark.parametrize(
    ("name", "answer"),
    [
        ("02.input_singularity", lambda mode: np.array([1e99, 0.0])),
        ("02.input_singularity", lambda mode: np.array([1e199, 0.0])),
        ("05.feedback_map", lambda *case: 1e200 * np.ones((3, 2))),
        ("03.offsets", np.broadcast_to(0.0, (10**7, 10**7))),
    ],
)
def test_answers_of_no_machine_are_wrong_and_stop_nothing(name, answer):
    assert judged(exercises()[name], answer).word == "wrong"


def test_an_object_is_judged_as_it_is_now():
    class Solver:
        chosen = np.zeros(2)

        def __call__(self, robot, offset):
            return self.chosen if self.chosen is not None else exercises()["06.placement"].reference(robot, offset)

    solver = Solver()
    assert judged(exercises()["06.placement"], solver).word == "wrong"
    solver.chosen = None
    assert judged(exercises()["06.placement"], solver).word == "ok"


@pytest.mark.parametrize("name", ["04.lean_law", "09.quiet_gears", "11.one_law"])
def test_a_class_is_no_design(name):
    assert "the answer is the class PD" in judged(exercises()[name], rk.PD).sentence


def turned(angle):
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


VECTOR = Exercise(scaled, ("a", "b", "c"), "N m", cases, close=0.02, improve="more steps")
MATRIX = Exercise(plane, ("a", "b", "c"), "m", lambda rng: [(v,) for v in rng.uniform(1, 2, 4)])
FRAME = Exercise(lambda v: 2.0 * v[::-1], ("a", "b", "c"), "m", lambda rng: [(v,) for v in rng.normal(size=(5, 2))])
NAMED = [
    (VECTOR, lambda K, v, m: -K * v / m, "opposite sign"),
    (VECTOR, lambda K, v, m: np.abs(K * v / m), "lost its signs"),
    (VECTOR, lambda K, v, m: 1e3 * K * v / m, "1000"),
    (VECTOR, lambda K, v, m: np.degrees(K * v / m), "180/pi"),
    (VECTOR, lambda K, v, m: np.radians(-K * v / m), "the sign is opposite"),
    (VECTOR, lambda K, v, m: 2 * K * v / m, "twice"),
    (VECTOR, lambda K, v, m: 1.1 * K * v / m, "1.1 times"),
    (VECTOR, lambda K, v, m: K * v, "the factor limit is one too many"),
    (VECTOR, lambda K, v, m: K * v / m**2, "the factor limit is missing"),
    (VECTOR, lambda K, v, m: v / m, "K_P missing"),
    (VECTOR, lambda K, v, m: (K * v / m)[::-1], "another order"),
    (VECTOR, lambda K, v, m: K, "itself, unchanged"),
    (VECTOR, lambda K, v, m: v - K * v / m, "complement"),
    (VECTOR, lambda K, v, m: 2 * v - K * v / m, "2 times v"),
    (VECTOR, lambda K, v, m: K * v / m + 0.25, "off by a constant, 0.25"),
    (VECTOR, lambda K, v, m: (K * v / m) * [1, 1, 3], "entry 2"),
    (VECTOR, lambda K, v, m: (K * v / m) * [1, -1, 1], "sign of entry 1"),
    (VECTOR, lambda K, v, m: (K * v / m) ** 2, "square"),
    (VECTOR, lambda K, v, m: 0 * v, "zero"),
    (VECTOR, lambda K, v, m: np.ones(3), "same for every case"),
    (VECTOR, lambda K, v, m: K * v / m / np.linalg.norm(v), "norm of v is missing"),
    (MATRIX, lambda v: plane(v).T, "transposed"),
    (MATRIX, lambda v: plane(v)[::-1], "rows stand in another order"),
    (MATRIX, lambda v: plane(v)[:, ::-1], "columns stand in another order"),
    (MATRIX, lambda v: np.linalg.inv(plane(v)), "inverse"),
    (FRAME, lambda v: 2.0 * np.array([v[0], -v[1]]), "turned by"),
    (FRAME, lambda v: np.array([-2.0, 2.0]) * v[::-1], "sign"),
    (VECTOR, lambda K, v, m: K * v / m - v, "by v: it is subtracted once more"),
    (VECTOR, lambda K, v, m: K * v / m + v, "by v: it is added once more"),
    (VECTOR, lambda K, v, m: K * v / m + 0.5 * v, "0.5 times v"),
    (VECTOR, lambda K, v, m: m / (K * v), "the reciprocal of the right one"),
    (VECTOR, lambda K, v, m: np.sqrt(np.abs(K * v / m)), "the root of the right one"),
    (VECTOR, lambda K, v, m: K * v / m * K.sum(), "the factor sum of K_P is one too many"),
    (VECTOR, lambda K, v, m: K * v / m * (2.0 + np.sin(40.0 * v[0])), "the direction is right and the size is not"),
    (MATRIX, lambda v: -plane(v).T, "transposed: rows and columns are exchanged, and the sign is opposite"),
    (MATRIX, lambda v: plane(v)[::-1, ::-1], "the numbers are right, but they stand in another order"),
    (MATRIX, lambda v: np.eye(2) - plane(v), "the identity minus the right answer"),
    (MATRIX, lambda v: np.linalg.inv(plane(v)).T, "the transposed inverse"),
    (FRAME, lambda v: 2.0 * turned(0.3) @ v, "mirrored"),
]


NOT_NAMED = [
    (VECTOR, lambda K, v, m: (K * v / m)[[0, 0, 1]], "another order"),
    (FRAME, lambda v: 2.0 * turned(np.deg2rad(0.5)) @ v[::-1], "turned by"),
    (Exercise(lambda v: np.array([1.0, 2.0, 4.0]), ("a", "b", "c"), "m", MATRIX.cases),
     lambda v: np.array([1.0, 2.0, 5.0]), "does not depend on the arguments"),
]  # fmt: skip


@pytest.mark.parametrize(("exercise", "answer", "words"), NOT_NAMED, ids=[row[2] for row in NOT_NAMED])
def test_no_mistake_is_named_that_was_not_made(exercise, answer, words):
    """A repeated row is no order, half a degree no frame, and who is asked for a constant may answer with one."""
    result = judged(exercise, answer)
    assert result.word == "wrong" and words not in result.sentence


def test_mistakes_in_small_numbers_are_told_apart():
    """Two answers count as the same relative to their own size, in whatever unit."""
    small = Exercise(lambda *case: 1e-9 * scaled(*case), ("a", "b", "c"), "kg m^2", cases, tolerance=1e-15)
    for factor, words in ((3.7, "3.7 times the right one"), (2.0, "twice"), (-1.0, "opposite sign")):
        said = judged(small, lambda *case, factor=factor: factor * 1e-9 * scaled(*case))
        assert said.word == "wrong" and words in said.sentence


def test_an_answer_may_return_one_array_again_and_again():
    place = np.zeros(3)

    def answer(K_P, v, limit):
        place[:] = scaled(K_P, v, limit)
        return place

    assert judged(VECTOR, answer).word == "ok"


def test_what_a_mask_hides_is_no_number():
    assert np.isnan(numbers(np.ma.array([1.0, 2.0], mask=[False, True]))).tolist() == [False, True]


@pytest.mark.parametrize(("exercise", "answer", "words"), NAMED, ids=[row[2] for row in NAMED])
def test_generic_mistakes_are_named(exercise, answer, words):
    result = judged(exercise, answer)
    assert result.word == "wrong" and words in result.sentence, result.sentence
    assert result.mistake


def test_close_answers_say_how_far_and_what_would_improve_them():
    result = judged(VECTOR, lambda K, v, m: 1.005 * K * v / m)
    assert result.word == "close" and "more steps" in result.sentence and "0.5 %" in result.sentence
    assert judged(VECTOR, lambda K, v, m: K * v / m + 0.01 * np.sin(1e3 * v)).word == "close"
    assert judged(VECTOR, lambda K, v, m: 1.03 * K * v / m).word == "wrong"


def test_a_constant_factor_is_a_mistake_though_it_is_near():
    result = judged(VECTOR, lambda K, v, m: 1.015 * K * v / m)
    assert result.word == "wrong" and "1.015 times the right one" in result.sentence


def test_a_matrix_that_is_singular_in_one_case_divides_nothing():
    matrices = [np.array([[2.0, 1.0], [0.5, 3.0]]), np.array([[1.0, 2.0], [2.0, 4.0]])]
    exercise = Exercise(lambda M, v: M @ v, cases=lambda rng: [(M, rng.normal(size=2)) for M in matrices])
    assert judged(exercise, lambda M, v: M @ v + np.sin(5 * v)).word == "wrong"


def test_an_answer_that_is_scattered_about_the_right_one_is_close_though_its_mean_is_off():
    """`close` counts deviations; only what is the right answer times a constant in every case is another mistake."""
    said = judged(VECTOR, lambda K, v, m: (1.013 + 0.004 * np.sin(1e3 * v)) * K * v / m)
    assert said.word == "close", said.sentence


def test_what_is_right_within_the_tolerance_is_no_reason_against_close():
    """A number of 1 that is right within 0.1, beside a number of 100 that is off by 1 %."""
    rough = Exercise(lambda v: v, cases=lambda rng: [(1.0,), (1.0,), (100.0,), (1.0,)], tolerance=0.5, close=0.015)
    assert judged(rough, lambda v: v + 0.49 if v < 2 else 101.0).word == "close"


def test_a_mistake_with_a_name_is_not_close():
    known = Exercise(
        scaled, ("a", "b", "c"), "N m", cases, close=0.02, mistakes={"too long": lambda *c: 1.001 * scaled(*c)}
    )
    assert judged(known, lambda *c: 1.001 * scaled(*c)).sentence.startswith("too long")
    assert judged(known, lambda *c: -1.001 * scaled(*c)).sentence.startswith("too long, and the sign is opposite")
    assert judged(known, lambda *c: 1.002 * scaled(*c)).word == "close"


def test_what_fails_beyond_the_idea_is_close_and_the_label_is_said():
    def more(rng):
        return [*cases(rng), Case("four entries", np.ones(4), np.arange(4.0), 2.0, beyond=True)]

    result = judged(Exercise(scaled, ("a", "b", "c"), "N m", more), lambda K, v, m: (K * v)[:3] / m)
    assert result.word == "close" and "four entries" in result.sentence
    assert judged(Exercise(scaled, ("a", "b", "c"), "N m", more), scaled).word == "ok"


def test_what_is_only_close_beyond_the_idea_is_right_where_it_is():
    def more(rng):
        return [*cases(rng), Case("four entries", np.ones(4), np.arange(4.0), 2.0, beyond=True)]

    said = judged(
        Exercise(scaled, ("a", "b", "c"), "N m", more, close=0.05),
        lambda K, v, m: scaled(K, v, m) * (1.02 if len(K) == 4 else 1),
    )
    assert said.word == "close" and said.sentence.startswith(
        "it is right, but not for four entries, where it is off by"
    )
    assert "the method is right" not in said.sentence and said.sentence.count("To improve") == 1


@pytest.mark.parametrize("made", [lambda found: [], lambda found: tuple(found), lambda found: (c for c in found)])
def test_an_answer_passes_no_exercise_without_cases(made):
    """Two wrong answers: one everywhere, one in the case that lies beyond."""
    found = [Case("a plain one", 1.0), Case("a far one", 5.0, beyond=True)]
    for wrong in (lambda x: x + 1.0, lambda x: 2.0 * min(x, 2.0)):
        assert judged(Exercise(lambda x: 2.0 * x, cases=lambda rng: found), wrong).word != "ok"
        with pytest.raises(ValueError, match=r"cases\(rng\) = .*; allowed: a list of one case at least"):
            judged(Exercise(lambda x: 2.0 * x, cases=lambda rng: made(found)), wrong)


def test_only_the_kinds_beyond_the_idea_that_fail_are_said():
    def more(rng):
        long = Case("four entries", np.ones(4), np.arange(4.0), 2.0, beyond=True)
        return [*cases(rng), long, Case("a light one", np.ones(3), np.arange(3.0), 1e-3, beyond=True)]

    result = judged(Exercise(scaled, ("a", "b", "c"), "N m", more), lambda K, v, m: (K * v)[:3] / m)
    assert result.word == "close" and "not for four entries, where" in result.sentence


def test_only_what_has_other_shapes_is_advised_to_look_at_shapes():
    """An open path and gains that couple the drives have arguments of the usual shapes."""

    def trapezoids(robot, path, K_P):
        n = rk.null_basis(rk.control_matrix(robot, path.q))
        weight = robot.resistance[0] / robot.torque_constant[0] ** 2
        return weight * K_P**2 * np.trapezoid(n @ n.mT, dx=path.dt, axis=0)

    def uncoupled(A, K_P, offset):
        return rk.steady_state_error(A, np.diag(np.diag(K_P)), offset)

    for name, answer, advice in (
        ("06.form", trapezoids, exercises()["06.form"].improve),
        ("03.rest_error", uncoupled, "make it hold there too"),
        ("02.control_matrix", lambda a, d: exercises()["02.control_matrix"].reference(a, d)[:3], SHAPES),
    ):
        verdict, sentence = examine(name, answer)
        assert verdict == "close" and sentence.endswith(f". To improve: {advice}")


def test_the_page_on_grading_says_by_how_much_a_design_may_miss():
    shares = [100 * exercise.close for exercise in exercises().values() if exercise.judge and exercise.close]
    words = (Path(__file__).parents[1] / "docs" / "teaching" / "grading.md").read_text(encoding="utf-8")
    assert f"({min(shares):g} to {max(shares):g} % at most)" in words


def test_torques_that_make_another_force_are_told_so_once():
    sentence = examine("09.quiet_gears", lambda A, f: np.full(3, 5e-3))[1]
    assert sentence.count("do not make the force f") == 1 and "A^T c misses f" in sentence


def test_a_prestress_that_changes_its_side_along_the_way_is_named():
    """The cheaper of both signs, anew at each pose: between two of them every drive changes its sign."""

    def cheaper(A, f):
        c, n = np.linalg.pinv(A).T @ f, rk.null_basis(A)[:, 0]
        shifted = c + np.max((5e-3 - c) / n) * n, c + np.min((-5e-3 - c) / n) * n
        return min(shifted, key=np.linalg.norm)

    said = judged(exercises()["09.quiet_gears"], cheaper)
    assert said.word == "wrong" and "changes its side" in said.mistake


def test_what_stops_for_one_kind_of_case_only_says_for_which():
    def kinds(rng):
        return [Case("three entries", *case) for case in cases(rng)] + [Case("four", np.ones(4), np.arange(4.0), 2.0)]

    known = Exercise(scaled, ("a", "b", "c"), "N m", kinds)
    for answer in (lambda K, v, m: (K * v)[:3] / m, lambda K, v, m: np.cross(K, v) * m):
        said = judged(known, answer)
        assert said.word == "wrong" and said.sentence.endswith("; for four, while it goes through for three entries")
    single = Exercise(scaled, ("a", "b", "c"), "N m", lambda rng: kinds(rng)[-2:])
    said = judged(single, lambda K, v, m: (K * v)[:3] / m).sentence
    assert said.endswith("; for four, while it goes through for three entries")
    nothing = judged(single, lambda K, v, m: None if len(K) == 4 else K * v / m)
    assert nothing.word == "wrong"
    assert nothing.sentence == f"{NOTHING}; for four, while it goes through for three entries"
    unnamed = Exercise(scaled, ("a", "b", "c"), "N m", cases)
    nothing = judged(unnamed, lambda K, v, m: None if m < 1.15 else K * v / m)
    assert nothing.word == "wrong" and nothing.sentence == f"{NOTHING}; some other case has one"
    # What stops everywhere stops for no kind in particular.
    assert "while it goes through" not in judged(known, lambda K, v, m: K[:2]).sentence


def test_a_kind_of_cases_is_called_wrong_only_where_none_of_it_is_right():
    some = cases(np.random.default_rng(1))
    kinds = [Case("strong", *case) for case in some[:2]] + [Case("weak", *case) for case in some[2:]]
    known = Exercise(scaled, ("a", "b", "c"), "N m", lambda rng: kinds)

    def off_in(places):
        def answer(K, v, m):
            place = next(k for k, case in enumerate(kinds) if np.array_equal(v, case[1]))
            return scaled(K, v, m) + np.sin(1e3 * v) * (place in places)

        return judged(known, answer).sentence

    assert off_in({2, 3, 4}).startswith("it is right in 2 of 5 cases, and wrong for weak; ")
    assert off_in({2, 4}).startswith("it is right in 3 of 5 cases; ")


@pytest.mark.parametrize("name", ["04.lean_law", "05.dead_encoder", "10.spare_law", "11.one_law"])
def test_an_error_inside_a_law_is_told_as_that_of_the_students_code(name):
    """It is no run that the machine lost."""

    def broken(robot):
        def law(t, q_a, qd_a, desired):
            if t > 0.6:
                raise KeyError("a word of mine")
            return -7.05 * (q_a - desired.q_a) - 0.225 * (qd_a - desired.qd_a)

        return law

    said = judged(exercises()[name], broken)
    assert said.word == "wrong" and said.sentence.startswith("your code stops with ") and "a word of" in said.sentence


@pytest.mark.parametrize(
    ("name", "answer", "said"),
    [
        ("06.placement", lambda robot, offset: 0.1, "it cannot be tried: the place is "),
        ("06.placement", lambda robot, offset: rk.triangle(robot, side=0.08), "the answer is not numeric"),
        ("12.own_machine", lambda: rk.load("four_arms"), "it cannot be tried: the machine has 4 arms; allowed: 3"),
        ("12.own_machine", lambda: rk.load("no such file"), "your code stops with ValueError: "),
        ("10.spare_law", lambda drawing: (19.0, 0.55), "it cannot be tried: law = array([19. , 0.55])"),
    ],
)
def test_a_design_that_does_not_stop_is_not_told_that_it_stops(name, answer, said):
    """The check stops when it tries it; whose code raised the error, the traceback says."""
    assert judged(exercises()[name], answer).sentence.startswith(said)


@pytest.mark.parametrize("offsets", [[1j, 1j, 1j], [4e-3 + 1j, -2e-3, 5e-3]])
def test_complex_offsets_are_called_nothing_but_complex(offsets):
    """An imaginary part is no number of rad, and what is left without it is not what the student answered."""
    said = "the answer is complex; a real one is wanted"
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        assert examine("03.unseen_offsets", lambda robot, x: np.array(offsets)) == ("wrong", said)
    assert not warned


@pytest.mark.parametrize(("factor", "named"), [(1e3, True), (np.rad2deg(1.0), False)])
def test_offsets_in_degrees_are_not_called_a_thousand_times_too_large(factor, named):
    """180/pi is no factor of 1000."""

    def offsets(robot, x):
        A = rk.control_matrix(robot, rk.inverse_kinematics(robot, x))
        return factor * A @ np.array([2.6e-3, 1.5e-3])

    said = judged(exercises()["03.unseen_offsets"], offsets)
    assert said.word == "wrong" and ("1000 times" in said.sentence) is named


def test_torques_that_are_missing_late_in_a_run_are_told_in_words():
    """A branch without a return, or a solver that finds nothing there: the carriage goes up before it goes down."""

    def upward_only(A, f):
        return quiet_gears(A, f) if f[1] > -1e-9 else None  # at rest f is a rounding error

    said = judged(exercises()["09.quiet_gears"], upward_only)
    assert said.word == "wrong" and said.sentence.startswith("at t = ")
    assert said.sentence.endswith(f" s of a run {NOTHING}")


@pytest.mark.parametrize("known", lean_law.OFFSETS)
def test_a_lean_law_for_known_offsets_is_none_for_others(known):
    """Who subtracts one set of offsets has no quarrel left with it, and more of it with another one."""

    def make(robot):
        W = robot.resistance / robot.torque_constant**2

        def law(t, q_a, qd_a, desired):
            feedback = 10.0 * (q_a - known - desired.q_a) + 0.27 * (qd_a - desired.qd_a)
            return rk.inverse_dynamics(robot, desired.q, desired.qd, desired.qdd, W=W) - feedback

        return law

    assert judged(exercises()["04.lean_law"], make).word == "wrong"


@pytest.mark.parametrize("name", ["04.lean_law", "05.dead_encoder"])
def test_limits_of_a_design_are_those_that_its_lesson_states(name):
    """A number in bold type with its unit is a limit."""
    (path,) = (Path(__file__).parents[1] / "notebooks").glob(f"{name[:2]}_*.ipynb")
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    sources = ["".join(cell["source"]) for cell in cells]
    (code,) = (k for k, text in enumerate(sources) if f'check("{name}"' in text)
    stated = {(float(value), unit) for value, unit in re.findall(r"\*\*([\d.]+) (mm|J)\*\*", sources[code - 1])}
    exercise = exercises()[name]
    assert stated == {(found.limit, found.unit) for found in exercise.judge(exercise.reference)}


@pytest.mark.parametrize("overlooked", range(3))
def test_a_survivor_notices_each_encoder_that_dies(overlooked):
    def make(robot):
        def law(t, q_a, qd_a, desired):
            alive = (qd_a != 0.0) | ~np.any(qd_a) | (np.arange(3) == overlooked)
            feedback = 7.05 * (q_a - desired.q_a) + 0.225 * (qd_a - desired.qd_a)
            return rk.inverse_dynamics(robot, desired.q, desired.qd, desired.qdd) - alive * feedback

        return law

    said = judged(exercises()["05.dead_encoder"], make)
    assert said.word == "wrong" and f"encoder {overlooked + 1} dead" in said.sentence


def test_a_law_that_listens_to_dead_encoders_only_does_listen():
    """A mask that is upside down: no feedback of healthy drives, all of the frozen one's."""

    def make(robot):
        def law(t, q_a, qd_a, desired):
            dead = (qd_a == 0.0) & np.any(qd_a)
            feedback = 7.05 * (q_a - desired.q_a) + 0.225 * (qd_a - desired.qd_a)
            return rk.inverse_dynamics(robot, desired.q, desired.qd, desired.qdd) - dead * feedback

        return law

    said = judged(exercises()["05.dead_encoder"], make)
    assert said.word == "wrong" and said.mistake.startswith("the frozen reading still moves its drive")


def test_a_law_that_goes_by_the_clock_is_not_said_to_follow_the_frozen_reading():
    """Without any feedback after 0.75 s it follows none."""

    def make(robot):
        def law(t, q_a, qd_a, desired):
            feedback = 7.05 * (q_a - desired.q_a) + 0.225 * (qd_a - desired.qd_a)
            return rk.inverse_dynamics(robot, desired.q, desired.qd, desired.qdd) - (t < 0.75) * feedback

        return law

    said = judged(exercises()["05.dead_encoder"], make)
    assert said.word == "wrong" and said.sentence.startswith("encoder 1 dead: largest error")


def test_a_bill_that_is_too_high_is_not_to_be_mended_by_a_gain():
    """Square roots of the right weights: with the least heat's own, the bill is lower at the same gains."""
    exercise = exercises()["04.lean_law"]

    def weighted(power, K_P, K_D):
        return lambda robot: rk.AntagonismFilter(
            rk.PD(K_P, K_D), W=(robot.resistance / robot.torque_constant**2) ** power
        )

    for gains in ((7.05, 0.225), (10.0, 0.27), (20.0, 0.4)):
        said = judged(exercise, weighted(0.5, *gains))
        assert said.word == "close" and "J (at most 3 J: missed)" in said.sentence and "weights" in said.sentence
        assert judged(exercise, weighted(1.0, *gains)).word == "ok"


@pytest.mark.parametrize("name", ["04.lean_law", "05.dead_encoder", "06.placement", "10.spare_law", "11.one_law"])
def test_a_design_that_returns_nothing_is_not_tried_yet(name):
    assert judged(exercises()[name], lambda *arguments: None).word == "todo"


def test_several_arrays_are_no_answer():
    said = judged(VECTOR, lambda K, v, m: (K, np.outer(K, v))).sentence
    assert said.endswith("of type tuple: 2 arrays, of shapes (3,), (3, 3), where one is wanted")
    # The whole of what lstsq gives.
    said = judged(VECTOR, lambda K, v, m: np.linalg.lstsq(np.outer(K, v), v, rcond=None)).sentence
    assert said.endswith("of type tuple: 4 arrays, of shapes (3,), (0,), (), (3,), where one is wanted")
    said = judged(VECTOR, lambda K, v, m: ((0.1, 0.2), m)).sentence
    assert said.endswith("of type tuple: 2 arrays, of shapes (2,), (), where one is wanted")


def test_where_one_number_is_wanted_no_empty_pair_of_brackets_is_asked_for():
    assert examine("06.cheapest_offsets", lambda S, size: np.diag(S))[1].endswith("shape (3,), expected one number")


def test_a_design_is_judged_by_its_numbers_beside_their_limits():
    def judge(gain):
        return [Measured("error", 2.0 / gain, "mm", 1.0), Measured("margin", 10.0 - gain, "dB", 5.0, at_most=False)]

    design = Exercise(3.0, ("a", "b", "c"), judge=judge, close=0.05, mistakes={"a gain below one": lambda g: g < 1})
    assert judged(design, 3.0).word == "ok"
    assert "error 2 mm (at most 1 mm: missed)" in judged(design, 1.0).sentence
    assert judged(design, 1.95).word == "close"
    assert judged(design, 0.5).sentence.startswith("a gain below one; error 4 mm")
    assert judged(design, 0.5).mistake == "a gain below one"
    # A kind of design is a reason, not a verdict.
    kind = Exercise(3.0, ("a", "b", "c"), judge=judge, close=0.05, mistakes={"any": lambda g: True})
    assert judged(kind, 3.0).word == "ok" and judged(kind, 1.95).word == "close"
    assert judged(design, [1.0, 2.0]).word == "wrong" and judged(design, ...).word == "todo"


@pytest.mark.parametrize("name", [name for name, exercise in exercises().items() if exercise.secret])
def test_what_stands_in_for_a_secret_is_no_answer(name, capsys):
    """Checked again, also under the name of an exercise whose answer is NaN."""
    check("03.offset_c", check(name, check(name, ...)))
    assert capsys.readouterr().out.count("TODO") == 3


def test_hints_come_in_three_steps(capsys):
    name = "04.filtered_torques"
    checker._steps.clear()
    for step in (1, 2, 3, 3):
        hint(name)
        assert capsys.readouterr().out == f"Hint {step} of 3 for {name}: {exercises()[name].hints[step - 1]}\n"
    hint(name, 1)
    assert "Hint 1" in capsys.readouterr().out
    for step in (0, 4, 1.5, True, "1", np.array([1, 2])):
        with pytest.raises(ValueError, match=r"step .*allowed: "):
            hint(name, step)
    with pytest.raises(ValueError, match=r"did you mean '04.saved_energy'\?\); allowed: 01\."):
        hint("04.saved_enery")


@pytest.mark.parametrize("name", sorted(exercises()))
def test_every_exercise_has_three_different_hints_and_known_mistakes(name):
    exercise = exercises()[name]
    assert len(set(exercise.hints)) == 3 and all(exercise.hints)
    assert exercise.mistakes or exercise.judge


def test_a_wrong_answer_that_is_checked_again_stays_wrong(capsys):
    name = "04.filtered_torques"
    going_on = check(name, lambda A, c: -c)
    assert capsys.readouterr().out.startswith("NOT YET RIGHT")
    assert examine(name, going_on)[0] == "wrong", "the package's answer is not the student's"
    assert examine(name, check(name, ...))[0] == "todo"


@pytest.mark.parametrize("word", ["ok", "close", "wrong", "todo"])
def test_a_lesson_goes_on_with_a_right_function_and_else_with_the_packages(word):
    """`check` says so; a wrong or close one is kept beside it, guarded, for the picture that it feeds."""

    def own(K_P, v, limit):
        v *= 0.0
        return v

    case, right = (np.full(3, 7.0), np.array([1.0, 2.0, 3.0]), 2.0), [3.5, 7.0, 10.5]
    got = checker.going_on(VECTOR, word, None if word == "todo" else own)
    assert got(*case).tolist() == ([0.0, 0.0, 0.0] if word == "ok" else right)
    assert got.own is (None if word == "todo" else own)
    if word in ("close", "wrong"):
        assert got.student(*case).tolist() == [0.0, 0.0, 0.0]
    else:
        assert got.student is None
    assert case[1].tolist() == [1.0, 2.0, 3.0]
    # What is no function cannot be called.
    assert checker.going_on(VECTOR, "wrong", 3.0).student is None


@pytest.mark.parametrize("own", [[1, 2], lambda: [1, 2]])
def test_a_lesson_goes_on_with_a_right_value_and_else_with_the_packages(own):
    value = Exercise(lambda: np.array([3.0, 4.0]), ("a", "b", "c"), "m")
    for word in ("ok", "close", "wrong"):
        got = checker.going_on(value, word, own)
        assert got.dtype == float and got.tolist() == ([1.0, 2.0] if word == "ok" else [3.0, 4.0])
    assert checker.going_on(value, "todo", None).tolist() == [3.0, 4.0]


def test_secrets_are_not_handed_out(capsys):
    secrets = [name for name, exercise in exercises().items() if exercise.secret]
    assert secrets
    for name in secrets:
        assert np.all(np.isnan(check(name, ...)))
        own = np.full(np.shape(check(name, ...)), 0.123)
        np.testing.assert_array_equal(check(name, own), own)


@pytest.mark.parametrize("name", [n for n, e in exercises().items() if e.secret and not e.raw])
def test_how_far_a_guess_is_off_does_not_tell_a_secret(name):
    """Guesses at different distances, in one entry or in all, are told the same."""
    guesses = [np.full(3, 50.0) + spread for spread in (0.0, 0.123, [0.0, 0.0, 1.7], [-3.1, 0.0, 0.0])]
    assert len({examine(name, guess) for guess in guesses}) == 1
    assert not set("123456789") & set(examine(name, guesses[1])[1])


def test_strict_mode_raises_unless_solved(monkeypatch, capsys):
    monkeypatch.setenv("RAPKM_LITE_STRICT", "1")
    with pytest.raises(AssertionError, match="opposite sign"):
        check("08.counts", lambda K_P, friction: -np.pi * K_P / friction)
    with pytest.raises(AssertionError, match=r"TODO 08\.counts: not yet"):
        check("08.counts", ...)
    assert check("08.counts", lambda K_P, friction: np.pi * K_P / friction)(7.05, 4.2e-3) > 5000


@pytest.mark.parametrize("word", ["true", "ON", " 1 ", "0", "false", "Off", ""])
def test_strict_mode_is_switched_by_the_words_that_switch_numba(word, monkeypatch, capsys):
    """RAPKM_LITE_NUMBA is off at 0, false, no and off, and on at any other word."""
    monkeypatch.setenv("RAPKM_LITE_STRICT", word)
    if word in ("0", "false", "Off", ""):
        check("08.counts", ...)
        return
    with pytest.raises(AssertionError, match=r"TODO 08\.counts: not yet"):
        check("08.counts", ...)


def test_a_wrong_answer_is_drawn_dotted_and_a_right_one_is_not(capsys):
    name = "04.filtered_torques"
    A, c = np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]), np.array([1.0, 2.0, 0.0])
    for answer, lines in (
        (lambda A, c: c, 3),
        (exercises()[name].reference, 0),
        (..., 0),
        (lambda A, c: c[:, None], 3),
    ):
        check(name, answer)
        capsys.readouterr()
        _, ax = plt.subplots()
        draw_own(name, lambda f: ([0, 1], [np.ravel(f(A, c)), np.ravel(f(A, 2 * c))]), ax, per_arm=True)
        assert len(ax.lines) == lines
        said = capsys.readouterr().out
        assert ("Thick dots: your own" in said and "lesson goes on" in said) == bool(lines)
    check(name, lambda A, c: 1 / 0)
    capsys.readouterr()
    draw_own(name, lambda f: ([0], f(A, c)), plt.subplots()[1])
    assert "cannot be drawn here (ZeroDivisionError)" in capsys.readouterr().out
    draw_own(name, lambda f: ([0, 1], [np.nan, np.nan]), plt.subplots()[1])
    assert "cannot be drawn here" in capsys.readouterr().out
    plt.close("all")


def test_two_cases_are_enough_to_see_that_an_answer_is_constant():
    two = Exercise(lambda v: 2.0 * v, ("a", "b", "c"), "N m", lambda rng: [(v,) for v in rng.normal(size=(2, 3))])
    assert "same for every case" in judged(two, lambda v: np.ones(3)).sentence


def test_what_check_hands_on_is_no_answer_however_it_is_called(capsys):
    name = "04.filtered_torques"
    handed = check(name, ...)

    def wrapped(A, c):
        return handed(A, c)

    A, c = np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]), np.array([0.1, 0.2, 0.3])
    verdict = judged(exercises()[name], wrapped)
    assert verdict.word == "todo" and "what check handed on" in verdict.sentence
    assert handed(A, c).shape == (3,), "once the verdict is there the lesson goes on with it"
    assert judged(exercises()["04.filtered_command"], wrapped).word != "todo"
    assert handed(A, c).shape == (3,)


def test_a_limit_that_is_met_exactly_is_met_whatever_rounding_says():
    assert Measured("way", 0.3 - 0.1, "m", 0.2, at_most=False).holds
    assert Measured("way", 0.1 + 0.2, "m", 0.3).holds and not Measured("way", 0.3001, "m", 0.3).holds


def machines(rng):
    testbed = rk.load()
    k_t, R_el = rng.uniform(0.02, 0.1, 4), rng.uniform(0.2, 3.0, 4)
    return [
        (testbed.replace(resistance=R, torque_constant=k), rng.normal(size=3)) for k, R in zip(k_t, R_el, strict=True)
    ]


def heat(robot, c):
    return robot.resistance[0] / robot.torque_constant[0] ** 2 * np.sum(c**2)


def tables(rng):
    return [(rng.normal(size=(k, 2)),) for k in (3, 5, 8)]


def systems(rng):
    return [(rng.normal(size=(3, 3)) + 3 * np.eye(3), rng.normal(size=3)) for _ in range(4)]


def solved(M, v):
    return np.linalg.solve(M, np.cos(v))


@pytest.mark.parametrize(
    ("reference", "cases", "answer", "words"),
    [
        (heat, machines, lambda robot, c: np.sum(c**2), "the factor R_el/k_t^2 is missing"),
        (heat, machines, lambda robot, c: np.sum(c**2) / robot.torque_constant[0] ** 2, "the factor R_el is missing"),
        (lambda X: X.mean(axis=0), tables, lambda X: X.sum(axis=0), "the factor number of rows of X is one too many"),
        (lambda X: X.sum(axis=0), tables, lambda X: X.mean(axis=0), "the factor number of rows of X is missing"),
        (solved, systems, lambda M, v: np.cos(v), "the factor M is one too many"),
        (solved, systems, lambda M, v: np.linalg.solve(M, solved(M, v)), "the factor M is missing"),
        (solved, systems, lambda M, v: np.trace(M) * solved(M, v), "the factor trace of M is one too many"),
    ],
)
def test_a_factor_is_told_by_its_name_and_whether_it_is_there(reference, cases, answer, words):
    said = judged(Exercise(reference, ("a", "b", "c"), "J", cases), answer).sentence
    assert words in said and "beside" not in said


@pytest.mark.parametrize(
    ("factor", "words"),
    [
        (1e3, "1000 times too large"), (1e-3, "1000 times too small"), (1e6, "10^6 times too large"),
        (1e-6, "10^6 times too small"), (1e2, "100 times too large"), (1e-2, "100 times too small"),
        (2, "is twice the right one"), (1 / 2, "is half the right one"), (4, "4 times too large"),
        (1 / 4, "4 times too small"), (60, "60 times too large"), (1 / 60, "60 times too small"),
        (np.degrees(1), "180/pi times too large"), (np.radians(1), "180/pi times too small"),
        (np.pi, "is pi times too large"), (1 / np.pi, "is pi times too small"), (2 * np.pi, "2 pi times too large"),
        (1 / (2 * np.pi), "2 pi times too small"), ((2 * np.pi) ** 2, "4 pi^2 times too large"),
    ],
)  # fmt: skip
def test_a_factor_with_a_meaning_is_told_in_its_direction(factor, words):
    exercise = Exercise(scaled, ("a", "b", "c"), "N m", cases)
    assert words in judged(exercise, lambda *case: factor * scaled(*case)).sentence


@pytest.mark.parametrize("degrees", [30, -30, 90, 180])
def test_an_angle_of_turned_vectors_counts_against_the_clock(degrees):
    exercise = Exercise(lambda X: np.sin(X), ("a", "b", "c"), "m", tables)
    turn = np.radians(degrees)
    matrix = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    said = judged(exercise, lambda X: np.sin(X) @ matrix.T).sentence
    assert f"turned by {degrees} degrees" in said or (degrees == 180 and "opposite sign" in said)


def failing(got, *case):
    raise ValueError("no machine")


def fails_first(got, K_P, v, limit):
    return (np.nan, "gap") if limit == cases(np.random.default_rng(20_111_130))[0][2] else (0.0, "gap")


@pytest.mark.parametrize(
    "law", [failing, lambda got, *case: (np.nan, "gap"), fails_first], ids=["raises", "is NaN", "is NaN at first"]
)
def test_an_answer_is_not_right_where_its_law_cannot_be_computed(law):
    assert judged(Exercise(scaled, ("a", "b", "c"), "N m", cases, law), scaled).word == "wrong"


def test_a_law_that_holds_exactly_is_said():
    lawful = Exercise(scaled, ("a", "b", "c"), "N m", cases, lambda got, *case: (0.0, "power of the torques, W"))
    assert judged(lawful, scaled).sentence.endswith("; power of the torques, W: below 1e-09")


def test_a_right_number_that_breaks_the_law_is_close_only_where_an_exercise_knows_close_answers():
    for close, word in ((0.02, "close"), (0.0, "wrong")):
        broken = Exercise(scaled, ("a", "b", "c"), "N m", cases, lambda got, *case: (1.0, "gap"), close=close)
        assert judged(broken, scaled).word == word


def test_no_answer_needs_more_than_nine_digits():
    """`tolerance` says so: never less than 1e-9 of the largest entry."""
    large = Exercise(lambda v: 1e6 + v, ("a", "b", "c"), "N", lambda rng: [(v,) for v in rng.uniform(0, 1, (4, 3))])
    assert judged(large, lambda v: 1e6 + v + 5e-3).word == "wrong"
    for error, met in ((0.0, "1e-09"), (5e-4, "1e-03")):
        word, said, _ = judged(large, lambda v, error=error: 1e6 + v + error)
        assert word == "ok" and said == f"within {met} N of the package at 4 cases"


@pytest.mark.parametrize("lost", [np.nan, -np.inf])
def test_a_reference_that_is_no_number_passes_no_answer(lost):
    """No deviation from NaN is larger than what is allowed; whoever wrote the exercise is told the case."""
    holed = Exercise(lambda v: v if v < 2.0 else lost, ("a", "b", "c"), "m", lambda rng: [(1.0,), (3.0,)], close=0.1)
    with pytest.raises(ValueError, match=r"the reference answers \(3\.0,\) with array\(.*\); allowed: finite numbers"):
        judged(holed, lambda v: v)


def test_a_single_number_that_is_near_is_close():
    """Any number is a factor times another one: only several cases show a constant factor."""
    assert judged(Exercise(lambda: 3.0, ("a", "b", "c"), "m", close=0.05), 3.06).word == "close"


@pytest.mark.parametrize("first", [True, False])
def test_a_measured_number_that_is_none_misses_its_limit(first):
    def judge(gain):
        found = [Measured("error", 0.5, "mm", 1.0), Measured("energy", np.nan, "J", 1.0)]
        return found[::-1] if first else found

    assert judged(Exercise(3.0, ("a", "b", "c"), judge=judge, close=0.05), 3.0).word == "wrong"


def test_a_size_that_is_wrong_in_every_case_does_not_hide_the_sign():
    """A factor below zero turns a vector round."""
    known = Exercise(scaled, ("a", "b", "c"), "N m", cases)
    for factor, said in (
        (lambda v: 2.0 + np.sin(40.0 * v[0]), "the direction is right and the size is not"),
        (lambda v: -2.0 - np.sin(40.0 * v[0]), "the direction is right, but for its sign, and the size is not"),
        (lambda v: 3.0 * np.cos(40.0 * v[0]), "the direction is right, but for its sign in some cases, and the size"),
    ):
        assert judged(known, lambda K, v, m, factor=factor: factor(v) * scaled(K, v, m)).sentence.startswith(said)


def test_one_case_shows_no_constant_factor():
    """Another case may have another one."""

    def more(rng):
        return [*cases(rng), Case("four entries", np.ones(4), np.arange(4.0), 2.0, beyond=True)]

    said = judged(
        Exercise(scaled, ("a", "b", "c"), "N m", more), lambda K, v, m: scaled(K, v, m) * (1.3 if len(K) > 3 else 1)
    )
    assert said.word == "close" and "in every case" not in said.sentence and "the size is not" in said.sentence


def test_a_close_answer_that_fails_beyond_the_idea_is_told_so():
    def more(rng):
        return [*cases(rng), Case("four entries", np.ones(4), np.arange(4.0), 2.0, beyond=True)]

    known = Exercise(scaled, ("a", "b", "c"), "N m", more, close=0.02)
    said = judged(known, lambda K, v, m: 1.005 * (K * v)[:3] / m)
    assert said.word == "close" and said.sentence.startswith("the method is right, off by up to ")
    assert "(allowed 1e-09), that is 0.5 %, but not for four entries, where the answer has shape" in said.sentence


def test_the_mistake_itself_goes_before_the_opposite_of_another_one():
    mistakes = {"one way": lambda *case: -2.0 * scaled(*case), "the other way": lambda *case: 2.0 * scaled(*case)}
    known = Exercise(scaled, ("a", "b", "c"), "N m", cases, mistakes=mistakes)
    assert judged(known, lambda *case: 2.0 * scaled(*case)).mistake == "the other way"
    assert judged(known, lambda *case: -2.0 * scaled(*case)).mistake == "one way"


def test_a_mistake_that_changes_nothing_in_these_cases_explains_nothing():
    known = Exercise(scaled, ("a", "b", "c"), "N m", cases, mistakes={"no mistake here": scaled})
    assert judged(known, lambda *case: -scaled(*case)).sentence.startswith("the answer has the opposite sign")


def test_arithmetic_in_place_reaches_nothing_that_a_function_is_given():
    """In containers and under names, too."""

    def destroy(a, rest, *, named):
        for array in (a, named, *(rest.values() if isinstance(rest, dict) else rest)):
            array *= 0.0
        return [1, 2]

    for kind in (tuple, list, lambda arrays: dict(enumerate(arrays))):
        a, rest, named = np.ones(2), kind([np.ones(2), np.ones(3)]), np.ones(2)
        got = Answer(destroy)(a, rest, named=named)
        assert got.dtype == float and got.tolist() == [1.0, 2.0]
        for array in (a, named, *(rest.values() if isinstance(rest, dict) else rest)):
            assert array.all()


@pytest.mark.parametrize("kind", [list, tuple, np.array, lambda values: [Fraction(v) for v in values]])
def test_an_answer_of_several_numbers_is_an_array_in_the_cells_that_follow(kind):
    """`return low, high` makes a tuple, which has no method round, and SymPy makes objects."""
    assert Answer(lambda: kind([4, 2.25]))().round(1).tolist() == [4.0, 2.2]


@pytest.mark.parametrize("wrap", [Fraction, Decimal, sympy.Float, lambda v: np.full((1, 1), v)])
def test_a_number_is_one_in_the_cells_that_follow_however_it_is_wrapped(wrap):
    """Rows times columns make arrays of one number, which no format takes."""
    assert f"{Answer(lambda: wrap(2.25))():.2f}" == "2.25"


def test_a_matrix_of_sympy_is_an_array_in_the_cells_that_follow():
    """What a check accepts can be used: the norm of such a matrix with an array has no root."""
    got = Answer(lambda: sympy.Matrix([[3, 0], [0, 4]]))() - np.zeros((2, 2))
    assert np.linalg.norm(got @ [1.0, 1.0]) == 5.0


def test_nothing_that_can_be_told_stays_so_when_it_is_checked_again(capsys):
    again = check("03.offset_c", check("03.offset_c", [None, None, None]))
    assert np.isnan(again).all() and capsys.readouterr().out.count("OK 03.offset_c") == 2
    assert "zeros are a claim" in examine("03.offset_c", np.zeros(3))[1]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda value: np.round(value, 5), "rounded to 5 decimals"),
        (lambda value: np.float32(value), "single precision"),
        (lambda value: np.round(value, 5) + 3e-4 * np.abs(value).max(), "instead of searching"),
    ],
)
def test_numbers_that_are_rounded_are_told_so_and_no_other_advice(change, words):
    exercise = exercises()["04.filtered_torques"]
    said = judged(exercise, lambda A, c: change(exercise.reference(A, c)))
    assert said.word == "close" and words in said.sentence


def test_zeros_are_no_rounded_numbers():
    exercise = exercises()["04.filtered_torques"]
    assert judged(exercise, lambda A, c: np.round(1e-3 * c, 2)).word == "wrong"


def test_the_darkest_place_of_a_map_is_near_an_input_singularity():
    """A grid such as that of the lesson's own map, whose nodes are 4 mm apart: what the advice speaks of."""

    def darkest(mode):
        robot = rk.load().replace(mode=mode)
        points = np.stack(np.meshgrid(*2 * [np.linspace(-0.3, 0.3, 140)]), axis=-1)
        points = points[rk.reachable(robot, points)]
        q = rk.inverse_kinematics(robot, points)
        inside = np.abs(np.sin(q[:, 3:])).min(axis=1) > 0.1
        return points[inside][np.argmin(rk.singular_values(rk.control_matrix(robot, q[inside]))[:, 1])]

    said = judged(exercises()["02.input_singularity"], darkest)
    assert said.word == "close" and "let a root finder" in said.sentence


def test_signs_of_offsets_that_are_lost_are_named_on_the_grid_of_the_package():
    place = exercises()["06.placement"].reference
    said = judged(exercises()["06.placement"], lambda robot, offset: place(robot, np.abs(offset)))
    assert "the signs of the offsets are lost" in said.mistake


def test_a_close_answer_is_drawn_dotted_too_with_copies(capsys):
    name = "04.filtered_command"
    assert check(name, damped(-2)) is not None and capsys.readouterr().out.startswith("CLOSE")
    A, K_P, q = np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]), np.full(3, 7.0), np.array([0.1, 0.2, 0.3])
    _, ax = plt.subplots()
    draw_own(name, lambda f: ([0, 1, 2], f(A, K_P, q, 0.0 * q)), ax)
    assert len(ax.lines) == 1 and "Thick dots: your own 04.filtered_command (close)" in capsys.readouterr().out

    def spoiled(A, c):
        c *= 0.0
        return c

    check("04.filtered_torques", spoiled)
    draw_own("04.filtered_torques", lambda f: ([0, 1, 2], f(A, q)), ax)
    assert q.tolist() == [0.1, 0.2, 0.3]


@pytest.mark.parametrize(("axis", "word"), [(0, "row"), (1, "column")])
def test_a_row_is_no_column(axis, word):
    def wrong(change):
        def answer(M, v):
            X = np.moveaxis(np.sin(M), axis, 0)
            X[2] = change(X[2])
            return np.moveaxis(X, 0, axis)

        return answer

    exercise = Exercise(lambda M, v: np.sin(M), ("a", "b", "c"), "m", systems)
    assert f"the sign of {word} 2 (counted from 0) is opposite" in judged(exercise, wrong(np.negative)).sentence
    assert f"only {word} 2 (counted from 0) is wrong" in judged(exercise, wrong(np.cos)).sentence


def test_a_sign_that_is_lost_in_some_places_of_a_row_is_not_that_of_the_row():
    """One entry of a row, or an entry that is opposite in some cases only: "the sign of row 0" is not true."""

    def flipped(M, v):
        X = np.sin(M)
        X[0, 1] *= -1.0
        return X

    def positive(K, v, m):
        w = scaled(K, v, m)
        return np.array([w[0], abs(w[1]), w[2]])

    matrix = Exercise(lambda M, v: np.sin(M), ("a", "b", "c"), "m", systems)
    for exercise, answer in ((matrix, flipped), (VECTOR, positive)):
        said = judged(exercise, answer).sentence
        assert said.startswith("the size of every entry is right, but some have the opposite sign")


@pytest.mark.parametrize("reference", [lambda v: v**2, np.diag, lambda v: np.outer(v, v), lambda v: (v @ v) ** 2])
@pytest.mark.parametrize("draw", ["uniform", "normal"])
def test_a_right_answer_that_was_rounded_shows_no_mistake(reference, draw):
    """Positive numbers have lost no sign, a symmetric matrix is not transposed, and no entry is the only one."""
    exercise = Exercise(reference, ("a", "b", "c"), "m", lambda rng: [(v,) for v in getattr(rng, draw)(size=(4, 3))])
    said = judged(exercise, lambda v: np.round(reference(v), 7))
    assert said.word == "wrong" and said.sentence.startswith("it is off by up to "), said.sentence


def test_a_deviation_counts_against_its_own_case_or_against_the_usual_one_if_that_is_larger():
    def sizes(rng):
        return [(np.array([size, 0.3 * size]),) for size in (1.0, 1.0, 1.0, 100.0)]

    exercise = Exercise(lambda v: v, ("a", "b", "c"), "m", sizes, close=0.02)
    for off, word in ((1.0, "close"), (3.0, "wrong")):
        assert judged(exercise, lambda v, off=off: v + off * (v[0] > 10) * np.array([1.0, 0.0])).word == word
    for off, word in ((0.4, "close"), (0.6, "wrong")):  # of a mean size of 25.75
        assert judged(exercise, lambda v, off=off: v + off * (v[0] < 10) * np.array([0.0, 1.0])).word == word


def test_a_miss_is_a_share_of_the_limit():
    assert Measured("way", 2.2, "m", 2.0).miss == pytest.approx(0.1)
    assert Measured("way", 1.8e-3, "m", 2e-3, at_most=False).miss == pytest.approx(0.1)
    assert Measured("way", 1.0, "m", 0.0).miss > 1e3
    assert Measured("way", 1.8, "m", 2.0).miss == Measured("way", 2.2, "m", 2.0, at_most=False).miss == 0.0


@pytest.mark.parametrize(("size", "grows"), [(5.0, True), (1e6, False)])
def test_a_wrong_answer_is_in_the_picture_unless_it_is_far_beyond_it(size, grows, capsys):
    check("04.filtered_torques", lambda A, c: c)
    _, ax = plt.subplots()
    ax.set_ylim(0, 1)
    ax.plot([0, 1], [0.2, 0.8])
    ax.autoscale()
    draw_own("04.filtered_torques", lambda f: ([0.0, 1.0], [0.0, size]), ax)
    assert (ax.get_ylim()[1] > size) == grows and len(ax.lines) == 2
    plt.close("all")


def test_columns_of_arms_are_dotted_in_their_colours_and_others_in_that_of_a_warning(capsys):
    check("04.filtered_torques", lambda A, c: c)
    for per_arm in (True, False):
        _, ax = plt.subplots()
        draw_own("04.filtered_torques", lambda f: ([0.0, 1.0], np.ones((2, 3))), ax, per_arm=per_arm)
        assert [line.get_color() for line in ax.lines] == [
            style.arm_colour(i) if per_arm else style.ALARM for i in range(3)
        ]
    plt.close("all")


@pytest.mark.parametrize("factor", [3.0, 1 / 3.0, 60.0, 1 / 60.0])
def test_a_rough_answer_gets_no_factor_that_it_is_not_off_by(factor):
    """A sum over three drives is three times their mean, not pi times, although pi is within the roughness."""
    exercise = exercises()["03.gain"]
    said = judged(exercise, factor * exercise.reference()).sentence
    assert " pi " not in said and "180/pi" not in said, said


def test_the_number_of_entries_or_rows_is_not_called_a_length():
    """The length of a vector is its norm: |eta| is 1, and of a link it is in m; a mode of signs has three of them."""
    for name, words in (
        ("03.fight", "number of entries of eta"),
        ("02.control_matrix", "number of rows of a"),
        ("02.input_singularity", "number of entries of mode"),
    ):
        right = exercises()[name].reference
        said = judged(exercises()[name], lambda *case, right=right: 3 * right(*case)).sentence
        assert said.startswith(f"the factor {words} is one too many;"), said


def test_an_error_in_one_case_is_no_factor_of_an_argument():
    """Two cases that are off by a different share each go along with whatever differs a little between them."""
    exercise = exercises()["08.self_calibrate"]
    first = exercise.cases(np.random.default_rng(20_111_130))[0][1]
    said = judged(exercise, lambda *case: (1.1 - 0.1 * np.array_equal(case[1], first)) * exercise.reference(*case))
    assert said.sentence.startswith("it is right in 1 of 2 cases"), said.sentence


def test_a_rough_answer_whose_size_is_right_somewhere_lacks_no_factor():
    """A tenth of a hertz in one of two frequencies changes the direction as much as the size."""
    exercise = exercises()["11.pd_frequencies"]
    said = judged(exercise, lambda *case: exercise.reference(*case) + np.array([0.1, 0.0])).sentence
    assert "the direction is right" not in said, said


def test_an_answer_that_is_right_in_a_case_is_no_other_basis():
    """With the control matrix of the first case, the first case is right."""
    exercise = exercises()["03.rest_error"]
    A = exercise.cases(np.random.default_rng(20_111_130))[0][0]
    said = judged(exercise, lambda _, *case: exercise.reference(A, *case) if len(case[1]) == 3 else np.zeros(4))
    assert said.sentence.startswith("it is right in 1 of 6 cases"), said.sentence


def test_who_stops_for_the_same_machine_is_not_asked_about_machines():
    """A pose near the curve of the pair is one of the testbed, which went through before."""
    exercise = exercises()["05.feedback_map"]
    near = exercise.cases(np.random.default_rng(20_111_130))[-1]

    def answer(*case):
        return exercise.reference(*case) * (np.nan if np.array_equal(case[1], near[1]) else 1.0)

    said = judged(exercise, answer).sentence
    assert "for a pose near the curve of the pair" in said and "n_arms" not in said
    # Nor is who divides by the masses that a model misses, where it misses nothing but friction.
    exercise = exercises()["11.model_error"]

    def over_the_masses(robot, model, q, qd, *rest):
        missed = rk.mass_matrix(robot, q) - rk.mass_matrix(model, q)
        return exercise.reference(robot, model, q, qd, *rest) * (1.0 if missed.any() else np.nan)

    said = judged(exercise, over_the_masses).sentence
    assert "for friction that the model does not know" in said and "n_arms" not in said


def test_a_law_that_gives_no_number_is_told_without_one():
    """Encoders off by a radian fit no pose, so nothing contradicts anything by a number of radians."""
    off = Exercise(scaled, ("a", "b", "c"), "N m", cases, lambda got, *case: (np.nan, "they contradict by rad"))
    said = judged(off, lambda *case: scaled(*case) ** 2 + np.arange(3.0)).sentence
    assert said.endswith("; nothing can be computed with it"), said


def test_a_shape_alone_does_not_say_that_an_answer_is_transposed():
    """A pseudoinverse has that shape, too."""
    right = exercises()["02.control_matrix"].reference
    said = judged(exercises()["02.control_matrix"], lambda a, d: np.linalg.pinv(right(a, d))).sentence
    assert said == "the answer has the shape of the transposed one: (2, 3), expected (3, 2)"


def test_an_entry_that_is_zero_is_told_so():
    """A factor of 0 is none that somebody got wrong."""
    right = exercises()["04.filtered_torques"].reference
    gone = judged(exercises()["04.filtered_torques"], lambda A, c: right(A, c) * np.array([0.0, 1.0, 1.0])).sentence
    assert gone.startswith("entry 0 (counted from 0) is zero; off by")


def test_a_vector_that_points_the_other_way_in_some_cases_is_told_so():
    """As a null vector does whose sign is left to a decomposition."""
    asked = []

    def answer(*case):
        asked.append(case)
        return scaled(*case) * (-1) ** len(asked)

    assert judged(VECTOR, answer).sentence.startswith("the size is right, but in some cases the sign is opposite")


def test_an_array_that_holds_no_numbers_is_called_by_what_it_holds():
    """An array is wanted, so its type says nothing."""
    for kind, word in ((bool, "bool"), (str, "str")):
        said = judged(VECTOR, lambda *case, kind=kind: scaled(*case).astype(kind)).sentence
        assert said.startswith(f"the answer is not numeric but of type ndarray of {word}")


def test_a_list_of_kinds_of_cases_can_be_read():
    """They are joined by commas, so none has a comma of its own."""
    for name, exercise in exercises().items():
        for case in [] if exercise.raw else exercise.cases(np.random.default_rng(0)):
            assert "," not in getattr(case, "label", ""), (name, case.label)


def test_readings_that_fit_no_pose_are_told_so():
    """Encoders off by two radians: there is no contradiction in rad to tell."""
    right = exercises()["08.self_calibrate"].reference
    said = judged(
        exercises()["08.self_calibrate"], lambda *case: right(*case) + np.resize([2.0, -2.0], case[1].shape[1])
    )
    assert said.sentence.endswith("; less these offsets the readings fit no pose"), said.sentence


def test_two_errors_that_are_a_little_different_are_no_constant():
    """Rounded to three digits, 1433.31 and 3453.19 are off by -3.31 and -3.19."""
    right = exercises()["11.gain_for_bandwidth"].reference
    said = judged(exercises()["11.gain_for_bandwidth"], lambda *case: float(f"{right(*case):.3g}")).sentence
    assert "off by a constant" not in said, said


def test_what_an_answer_of_infinity_makes_of_a_mistake_is_no_warning_to_the_student(recwarn):
    """The verdict says that the offsets are infinite; the difference of two infinities is nobody's business."""
    verdict, said = examine("03.unseen_offsets", lambda robot, x: np.full(robot.n_arms, np.inf))
    assert verdict == "wrong" and "offset[0] = inf" in said
    assert not [str(one.message) for one in recwarn]
