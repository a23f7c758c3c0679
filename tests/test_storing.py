"""How lessons are stored, and that every guard of their shape fails where something is planted against it."""

import base64
import importlib.util
import io
import sys
from pathlib import Path

import nbformat
import numpy as np
import pytest
import shape
import stored
from PIL import Image

NOTEBOOKS = Path(__file__).parents[1] / "notebooks"
sys.path.insert(0, str(NOTEBOOKS))

from workshop import layout, pictures, storing  # noqa: E402


def png(colour=(200, 30, 30), size=(60, 40)):
    file = io.BytesIO()
    Image.new("RGB", size, colour).save(file, "PNG")
    return base64.b64encode(file.getvalue()).decode()


def picture(**more):
    return nbformat.v4.new_output("display_data", {"image/png": png(), "text/plain": "<Figure>", **more})


def text(words):
    return nbformat.v4.new_output("stream", name="stdout", text=words)


def code(source, *outputs, count=None, **metadata):
    return nbformat.v4.new_code_cell(source, outputs=list(outputs), execution_count=count, metadata=metadata)


def said(source):
    return nbformat.v4.new_markdown_cell(source)


def lesson(*cells, earlier=()):
    return shape.Lesson("42", nbformat.v4.new_notebook(cells=list(cells)), earlier)


def built(*cells):
    one = lesson(*cells)
    storing.tidy(one.notebook)
    return one


def test_what_is_printed_after_a_picture_is_stored_after_it():
    one = built(code("plot()", text("before"), text(", too\n"), picture(), text("after\n"), alt="a disc"))
    assert [o.get("text") for o in one.cells[0].outputs] == ["before, too\n", None, "after\n"]


def test_answers_are_stored_closed_behind_a_neutral_line():
    one = built(code("print(42)", text("42\n"), tags=["hide-output"]), code("plot()", picture(), tags=["hide-output"]))
    for cell in one.cells:
        assert cell.metadata.jupyter.outputs_hidden and cell.outputs[0].text.startswith(storing.COVER)
    assert "42" not in storing.COVER and one.cells[0].outputs[0].text == storing.COVER + "42\n"
    assert not stored.hidden_outputs(one, storing.COVER)


def test_only_what_is_meant_stays_in_the_metadata():
    one = built(
        code("1", tags=["nbval-check-output"], execution={"iopub": "now"}, collapsed=True),
        said("### Dig deeper: why (3 min)"),
        said("### Something else (3 min)"),
    )
    assert one.cells[0].metadata == {"tags": ["nbval-check-output"]}
    assert one.cells[1].metadata == {"jp-MarkdownHeadingCollapsed": True, "tags": ["dig-deeper"]}
    assert one.cells[2].metadata == {}
    before = nbformat.writes(one.notebook)
    storing.tidy(one.notebook)
    assert nbformat.writes(one.notebook) == before, "storing twice changes nothing"


def test_students_copy_keeps_words_and_tags():
    solved = lesson(
        code("x = 1", alt="A red square, all red.", tags=["hide-output"]), said("see [a](../b.md)")
    ).notebook
    copy = storing.student(solved)
    assert copy.cells[0].metadata == solved.cells[0].metadata and copy.cells[1].source == "see [a](b.md)"


def test_pictures_are_stored_with_words_for_html_and_for_the_rest():
    one = built(code("plot()", picture(), picture(), alt=['A "red" square <all> red.', "The same square, once more."]))
    first, second = (output.data for output in one.cells[0].outputs)
    assert pictures.spoken(one.cells[0].outputs[0]) == 'A "red" square <all> red.' == first["text/plain"]
    assert "The same square, once more." in second["text/html"]
    webp = Image.open(io.BytesIO(base64.b64decode(first["text/html"].partition("base64,")[2].partition('"')[0])))
    kept = Image.open(io.BytesIO(base64.b64decode(first["image/png"])))
    assert webp.format == "WEBP" and kept.format == "PNG" and webp.size == kept.size == (60, 40)
    np.testing.assert_array_equal(np.asarray(kept.convert("RGB")), np.asarray(webp.convert("RGB")))
    assert one.cells[0].outputs[0].metadata["image/png"]["alt"] == first["text/plain"]


def test_a_picture_that_brings_its_words_keeps_them():
    html = '<img alt="A film of a red square." src="data:,">'
    one = built(code("film()", picture(**{"text/html": html}), picture(), alt="A red square, all red."))
    assert one.cells[0].outputs[0].data["text/html"] == html
    assert pictures.spoken(one.cells[0].outputs[1]) == "A red square, all red."


def test_comparison_of_outputs_ignores_the_neutral_line():
    import configparser
    import re

    rules = configparser.ConfigParser(interpolation=None)
    rules.read(Path(__file__).with_name("nbval-sanitize.cfg"))
    rule = rules["cover of a hidden answer"]
    assert re.sub(rule["regex"], rule["replace"], storing.COVER + "42\n") == "42\n"


HIDDEN_CHECK = """for x in (6, 7):
    n = 6 * x
    np.testing.assert_allclose(n, twice(x + x + x), atol=1e-9)
assert n == 42, (
    "the answer"
)
np.testing.assert_allclose(n / 2, 21)
print(n)"""


def test_the_code_of_a_hidden_answer_does_not_tell_it_to_the_student():
    copy = storing.student(lesson(code(HIDDEN_CHECK, tags=["hide-output"]), code(HIDDEN_CHECK)).notebook)
    assert copy.cells[0].source == "\n".join([*HIDDEN_CHECK.splitlines()[:3], "print(n)"])
    assert storing.unchecked("plotting.plot_n(n)\nassert n == 42") == "plotting.plot_n(n);"
    assert copy.cells[1].source == HIDDEN_CHECK


ANSWER = code("print(42)", tags=["hide-output"])
ASK = "**Predict.** How many?"
GOOD_QUESTIONS = {
    "details in the cell": [said(ASK + "\n\n<details><summary>Answer</summary>\n\n42\n\n</details>")],
    "details after an explorer": [
        said(ASK),
        code("display(explorer)"),
        said("<details><summary>A</summary>42</details>"),
    ],
    "hidden output, then details": [said(ASK), ANSWER, said("<details><summary>Why</summary>42</details>\n\nNow on.")],
    "hidden output, then a section": [said(ASK), code("n = 42"), ANSWER, said("## Next (1 min)")],
}
BAD_QUESTIONS = {
    "in plain sight": [said(ASK + "\n\nIt is 42."), ANSWER],
    "shows the answer": [said(ASK), code("print(42)")],
    "nothing to open": [said(ASK), code("display(explorer)"), said("It is 42.")],
    "explains in plain sight": [said(ASK), ANSWER, said("It is 42.")],
    "without an answer": [said(ASK)],
    "plain prose": [said("Before you run the cell: how many?"), code("print(42)")],
}


@pytest.mark.parametrize("cells", GOOD_QUESTIONS.values(), ids=GOOD_QUESTIONS)
def test_answers_out_of_sight_are_accepted(cells):
    assert shape.questions(lesson(*cells)) == []


@pytest.mark.parametrize("what", BAD_QUESTIONS)
def test_answers_in_sight_are_found(what):
    (complaint,) = shape.questions(lesson(*BAD_QUESTIONS[what]))
    assert what in complaint and "lesson 42, cell" in complaint


FOLD = {"jp-MarkdownHeadingCollapsed": True}


def folded(source="### Dig deeper: why (3 min)"):
    return nbformat.v4.new_markdown_cell(source, metadata=FOLD)


FULL = code("check('42.x', x)", text("OK\n"), count=1, tags=["hide-output"], jupyter={"outputs_hidden": True})
OPEN = code("print(42)", text("42\n"), count=1, tags=["hide-output"])
BARE = code("print(42)", text("42\n"), count=1, tags=["hide-output"], jupyter={"outputs_hidden": True})
ALARM = nbformat.v4.new_output("stream", name="stderr", text="!")
BAD = picture(**{"text/html": "<img alt='x'>"})
NAMED = picture(**{"text/html": '<img alt="A red square, all red." src="data:,">'})


def covers(one):
    return stored.hidden_outputs(one, storing.COVER)


def hints(one):
    return stored.no_hints(one, {"42.x": ("think of seven", "times six")})


LONG = "word " * 1300
PLANTED = [
    ("verdict of a check is hidden", covers, [FULL]),
    ("stored open", covers, [OPEN]),
    ("first line", covers, [BARE]),
    ("does not stand alone", shape.folded_parts, [folded("### Dig deeper: why (3 min)\n\nIts text.")]),
    ("stored unfolded", shape.folded_parts, [said("### Dig deeper: why (3 min)")]),
    ("must begin a cell", shape.folded_parts, [folded(), said("Text.\n\n## Next (1 min)")]),
    ("uses 'y'", shape.core_stands_alone, [folded(), code("y = 1"), said("## Next (1 min)"), code("print(y)")]),
    ("without alternative text", stored.alternative_text, [code("plot()", picture(), count=1)]),
    (
        "without alternative text",
        stored.alternative_text,
        [code("p()", BAD, count=1)],
    ),
    ("1 texts in metadata.alt for 0", stored.alternative_text, [code("pass", count=1, alt="A red square, all red.")]),
    ("says the same", stored.alternative_text, [code("plot()", NAMED, NAMED, count=1)]),
    ("cell of its own", stored.alternative_text, [code("plot()", NAMED, count=1, tags=["nbval-check-output"])]),
    (
        "rk.simulate is used before",
        shape.introduced,
        [code("rk.simulate(rk.load())"), said("`rk.simulate`")],
    ),
    ("instead of 1", stored.in_order, [code("1", count=2), code("2", count=1)]),
    ("never run", stored.in_order, [code("1")]),
    (
        "stores a warning",
        stored.in_order,
        [code("1", ALARM, count=1)],
    ),
    ("MB", stored.in_order, [code("1", text("x" * 1_300_000), count=1)]),
    ("a hint for 42.x", hints, [code("check('42.x', ...)", text("TODO 42.x: not yet\nthink of seven\n"), count=1)]),
    ("more than 'not yet'", hints, [code("check('42.x', ...)", text("TODO 42.x: not yet, think\n"), count=1)]),
    ("second time", hints, [code("1", text("TODO 42.x: not yet\n")), code("2", text("TODO 42.x: not yet\n"))]),
    ("core takes", shape.honest_minutes, [said("**Minutes:** 77"), said("## A (77 min)\n\n" + "word " * 10_000)]),
    (
        "states **Minutes:** 5",
        shape.honest_minutes,
        [said("**Minutes:** 5"), said("## A (10 min)\n\n" + LONG)],
    ),
    ("lacks (10 min)", shape.honest_minutes, [said("**Minutes:** 10"), said("## A\n\n" + LONG)]),
    ("states 5 min", shape.honest_minutes, [said("**Minutes:** 10"), said("## A (5 min)\n\n" + LONG)]),
]


@pytest.mark.parametrize("what, rule, cells", PLANTED, ids=[f"{k}-{row[0]}" for k, row in enumerate(PLANTED)])
def test_what_is_planted_is_found(what, rule, cells):
    complaints = rule(lesson(*cells))
    assert any(what in complaint for complaint in complaints), complaints
    assert all(complaint.startswith("lesson 42") for complaint in complaints)


def test_rules_accept_what_is_right():
    one = built(
        said("**Minutes:** 3\n\n`rk.simulate` runs. $$1 = 1$$"),
        said("## A (1 min)\n\n" + ASK),
        code("n = rk.simulate(rk.load())\nprint(n)", text("42\n"), count=1, tags=["hide-output"]),
        said("### Dig deeper: why (1 min)"),
        code("m = n", count=2),
        said("## Next (2 min)"),
        code("plot(n)", picture(), count=3, alt="A red square, all red."),
    )
    for rule in (*shape.RULES, covers, stored.alternative_text, stored.in_order, hints):
        assert rule(one) == [], rule.__name__


def test_minutes_count_core_and_folded_parts_apart():
    words = "word " * 130
    cells = [
        said("# 42 · Q\n\n**Minutes:** 23\n\n" + words),
        said(f"## A (19 min)\n\n{words}\n$$a$$\n<details>{words}</details>\n```\n# no heading\n```"),
        code("\n".join(["x = 1"] * 16) + "\ncheck('42.x', x)\ncheck('42.x', x)", picture(), count=1),
        said("### Dig deeper: B (2 min)"),
        said(words + words),
        said("## C (1 min)"),
        code("check('42.x', x)\ncheck('41.y', y)"),
    ]
    opening, a, b, c = shape.minutes.parts(lesson(*cells).notebook, "42")
    assert (a.formulas, a.figures, a.exercises, a.lines) == (1, 1, 1, 18)
    assert a.minutes == pytest.approx((130 + 3) / 130 + 18 / 8 + 0.7 + 1.5 + 10)
    assert b.folded and b.minutes == pytest.approx(262 / 130, abs=0.05) and c.exercises == 0
    assert shape.minutes.core([opening, a, b, c]) == pytest.approx(opening.minutes + a.minutes + c.minutes)


def test_blanking_is_the_builders():
    spec = importlib.util.spec_from_file_location("build", NOTEBOOKS / "build.py")
    build = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(build)
    assert build.blank is storing.blank and build.figure_list is layout.figure_list


def test_a_picture_of_twice_the_pixels_is_shown_at_its_own_size():
    output = picture()
    output.metadata = nbformat.from_dict({"image/png": {"width": 30, "height": 20}})
    pictures.tell(output, "Words.")
    assert 'width="30" height="20"' in output.data["text/html"]
    plain = picture()
    pictures.tell(plain, "Words.")
    assert 'width="60" height="40"' in plain.data["text/html"]
