"""The pages say what is so: their code runs, their links lead somewhere, the drawing is that of the imports."""

import builtins
import doctest
import json
import re
import symtable
import sys
from pathlib import Path
from xml.etree import ElementTree

import matplotlib
import numpy as np
import pytest
from test_rooms import ARROWS, DOORS, ROOMS, room

import rapkm_lite as rk
from rapkm_lite import checks, explore, plotting

matplotlib.use("agg")

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "docs"))

from pages import drawing  # noqa: E402

PAGES = [*sorted(ROOT.glob("*.md")), *sorted((ROOT / "docs").glob("*.md")), *sorted((ROOT / "notebooks").glob("*.md"))]
NAMES = {"ids": lambda path: path.name}


def text(path):
    return path.read_text(encoding="utf-8")


@pytest.mark.parametrize("path", [p for p in PAGES if "```python" in text(p)], **NAMES)
def test_code_of_a_page_runs_from_top_to_bottom(path):
    # Classes that a page defines belong to the module that runs it.
    names = {"__name__": "__main__"}
    for block in re.findall(r"```python\n(.*?)```", text(path), re.S):
        exec(compile(block, path.name, "exec"), names)


@pytest.mark.parametrize("path", PAGES, **NAMES)
def test_links_lead_somewhere(path):
    for target in re.findall(r"\]\(([^)#\s]+)(?:#[^)]*)?\)", text(path)):
        if "://" not in target:
            assert (path.parent / target).exists(), target


def test_the_drawing_of_the_rooms_is_that_of_the_imports():
    drawing = re.search(r"```mermaid\n(.*?)```", text(ROOT / "docs" / "architecture.md"), re.S)[1]
    drawn = set(re.findall(r"^ *(\w+) --> (\w+)$", drawing, re.M))
    real = {(room(a), room(b)) for a, others in ARROWS.items() for b in others if room(a) != room(b)}
    real = {("rapkm_lite" if a == "__init__" else a, b) for a, b in real if a != "__main__"}
    assert drawn <= real, f"drawn, but there is no such import: {drawn - real}"
    reach, follows = set(drawn), set()
    for _ in ROOMS + DOORS:
        follows |= {(a, d) for a, b in reach for c, d in drawn if b == c}
        reach |= follows
    assert real <= reach, f"imported, but not to be seen in the drawing: {real - reach}"
    assert not drawn & follows, f"drawn, though it follows from two arrows: {drawn & follows}"


def test_the_picture_of_the_rooms_has_them_all_and_no_arrow_runs_through_one():
    diagram = re.search(r"```mermaid\n(.*?)```", text(ROOT / "docs" / "architecture.md"), re.S)[1]
    picture = ElementTree.fromstring(drawing.svg(diagram))
    boxes = [[float(box.get(side)) for side in ("x", "y", "width", "height")] for box in picture.iter("rect")]
    arrows = [path.get("d") for path in picture.iter("path") if path.get("marker-end")]
    assert {word.text for word in picture.iter("text")} >= {*re.findall(r"^ *(\w+)[\[(]", diagram, re.M)}
    assert len(arrows) == diagram.count("-->")
    touched = []
    for arrow in arrows:
        points = np.array([[float(v) for v in point.split(",")] for point in arrow[1:].split("L")])
        along = points[:-1, None] + np.linspace(0, 1, 200)[:, None] * np.diff(points, axis=0)[:, None]
        for x, y, width, height in boxes:
            inside = np.all(np.abs(along - [x + width / 2, y + height / 2]) < [width / 2 - 1, height / 2 - 1], axis=-1)
            touched += [arrow] if inside.any() else []
    assert touched == []


def test_how_to_add_pages_are_linked_from_the_front_door():
    front = text(ROOT / "CONTRIBUTING.md")
    for page in (ROOT / "docs").glob("*.md"):
        assert f"docs/{page.name}" in front


PUBLIC = {
    f"{short}.{name}": thing
    for short, module in {"rk": rk, "plotting": plotting, "explore": explore, "checks": checks}.items()
    for name, thing in vars(module).items()
    if not name.startswith("_") and callable(thing) and thing.__module__.startswith("rapkm_lite.") and name != "guarded"
}


@pytest.mark.parametrize("name", PUBLIC)
def test_help_shows_an_example(name):
    assert ">>> " in (PUBLIC[name].__doc__ or "")


def scopes(table):
    """A table of names and those of the functions and classes in it."""
    yield table
    for inner in table.get_children():
        yield from scopes(inner)


@pytest.mark.parametrize("name", PUBLIC)
def test_an_example_imports_all_that_it_names(name):
    """So that it runs where a reader types it: pytest lends it all names of its module."""
    code = "".join(example.source for example in doctest.DocTestParser().get_examples(PUBLIC[name].__doc__))
    top = symtable.symtable(code, name, "exec")
    made = {s.get_name() for s in top.get_symbols() if s.is_assigned() or s.is_imported()}
    used = {
        s.get_name() for t in scopes(top) for s in t.get_symbols() if s.is_referenced() and (t is top or s.is_global())
    }
    assert used - made - set(dir(builtins)) == set()


@pytest.mark.parametrize(
    ("written", "wanted"),
    [
        ("angles a_ and *case", r"angles a\_ and \*case"),
        ("|x| < 1, C:\\n", r"\|x\| < 1, C:\\n"),
        ("q_a with ``*`` and `a_`_", r"q_a with ``*`` and `a_`\_"),
        ("the *measured* angles, A*B*C", r"the *measured* angles, A\*B\*C"),
    ],
)
def test_reference_pages_print_characters_of_markup_as_they_are_and_stress_a_word(written, wanted):
    from pages.hooks import escaped

    assert escaped(written) == wanted


def test_arguments_in_the_reference_are_items_with_all_of_their_words():
    from pages.hooks import readable

    docstring = """What it does.

    use : "angles", or "torques" of which
    each says where it stood: c / K_P : see there.
    a, b : (k,) m.  c : N m,
        at rest. d : default none.
    Returns 1 : 1.

    >>> f(a : b)
    1
    """
    lines = readable([line.removeprefix("    ") for line in docstring.splitlines()])
    assert [line for line in lines if line.strip()] == [
        "What it does.",
        '* **use**: "angles", or "torques" of which each says where it stood: c / K_P : see there.',
        "* **a, b**: (k,) m.",
        "* **c**: N m, at rest.",
        "* **d**: default none.",
        "Returns 1 : 1.",
        "::",
        "    >>> f(a : b)",
        "    1",
    ]
    # A list ends before what is not one of its items.
    assert lines[lines.index("Returns 1 : 1.") - 1] == ""


@pytest.mark.parametrize("depth", ["", "../"])
def test_links_to_the_index_stand_in_the_order_of_the_equations(depth):
    from pages.lessons import lesson_page

    path = next((ROOT / "notebooks").glob("05_*.ipynb"))
    page = lesson_page(path, [f"eq-{k}" for k in range(19, 33)], depth)
    cells = ["".join(cell["source"]) for cell in json.loads(page)["cells"] if cell["cell_type"] == "markdown"]
    numbers = [list(map(int, re.findall(rf'href="{depth}equations.html#eq-(\d+)"', cell))) for cell in cells]
    assert max(map(len, numbers)) > 2 and all(found == sorted(found) for found in numbers)


def test_errata_and_index_on_the_site_have_a_block_for_every_row():
    from pages.lessons import errata_page, index_page

    for name, page, row, mark in [
        ("errata.md", errata_page, r"^\| (?:<a id|\d)", "\n## Section "),
        ("equations.md", lambda text: index_page(text, {}), r"^\| <a id=\"(?:eq|table)-", ":::{container} formula"),
    ]:
        text = (ROOT / "notebooks" / name).read_text(encoding="utf-8")
        made = page(text)
        assert made.count(mark) == len(re.findall(row, text, re.M)) > 30
        targets = re.findall(r"^\(([\w-]+)\)=$", made, re.M)
        assert set(re.findall(r'id="([\w-]+)"', text)) == {*targets, *re.findall(r'id="([\w-]+)"', made)}
        assert not re.search(r"\| \d\d_\w+ \|", made), "a lesson without a link"


def test_links_on_the_site_have_words_where_the_repository_has_names_of_files():
    from pages.lessons import linked

    assert linked("in [errata.md](errata.md), [a.md](b.md)") == "in [the errata](errata.md), [a.md](b.md)"
    assert (
        linked("[notebooks/equations.md](../notebooks/equations.md)") == "[the equation index](../lessons/equations.md)"
    )
    pages = [path for folder in ("", "teaching", "pages") for path in (ROOT / "docs" / folder).glob("*.md")]
    assert len(pages) > 15
    for path in pages:
        named = re.search(r"\[\w+\.(md|ipynb)\]\(", text(path))
        assert not named, f"{path.name}: {named[0]}"


@pytest.mark.parametrize(("size", "wide"), [((768, 307), True), ((844, 288), True), ((403, 480), False)])
def test_a_film_of_several_panels_is_as_wide_as_the_page(size, wide):
    from pages.lessons import _outputs

    film = f'<picture><img alt="Words" width="{size[0]}" height="{size[1]}"></picture>'
    cell = {"metadata": {}, "outputs": [{"data": {"image/png": "", "text/html": film}}]}
    _outputs(cell, "")
    assert ("wide-picture" in cell["outputs"][0]["data"]["text/html"]) == wide
    assert cell["metadata"]["mystnb"]["image"]["alt"] == "Words"


def test_the_start_page_knows_the_testbed_its_law_and_the_corners_of_its_path():
    from pages import start

    known, robot = start.values(), rk.load()
    assert (known["K_P"], known["K_D"], known["duration"]) == (7.05, 0.225, 5.0)
    for name, value in known["machine"].items():
        np.testing.assert_array_equal(value, getattr(robot, name))
    corners = np.array(known["corners"])
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1)
    path = rk.triangle(robot)
    length = np.linalg.norm(np.diff(path.x, axis=0), axis=1).sum()
    np.testing.assert_allclose(sides, length / 3, rtol=1e-6)
    np.testing.assert_array_equal(known["table1"], rk.measured_energies())
