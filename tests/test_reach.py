"""What people get without a clone: the wheel, the front page, the start page and the pages of the site.

The built site is looked at by `python -m tests.site`, the lessons in a browser by `python -m tests.lite`.
"""

import functools
import importlib.util
import json
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

import rapkm_lite as rk
from rapkm_lite.lessons.copies import bare, shipped

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "docs"))
README = (ROOT / "README.md").read_text(encoding="utf-8")
NOTEBOOKS = sorted((ROOT / "notebooks").glob("[0-9][0-9]_*.ipynb"))


@functools.cache
def module(name):
    """A module of docs/, which belongs to no package."""
    spec = importlib.util.spec_from_file_location(f"docs_{Path(name).stem}", ROOT / "docs" / name)
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    return made


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """The wheel, built twice."""
    builders = pytest.importorskip("hatchling.builders.wheel", reason="the wheel is built with hatchling (extra dev)")
    made = []
    for k in range(2):
        folder = tmp_path_factory.mktemp(f"wheel{k}")
        made += builders.WheelBuilder(str(ROOT)).build(directory=str(folder), versions=["standard"])
    first, second = map(Path, made)
    assert first.read_bytes() == second.read_bytes(), "two builds differ"
    return zipfile.ZipFile(first)


def test_wheel_holds_package_data_and_licences_and_nothing_else(wheel):
    names = wheel.namelist()
    info = next(name.split("/")[0] for name in names if name.endswith(".dist-info/METADATA"))
    assert {name.split("/")[0] for name in names} == {"rapkm_lite", info}
    assert {f"{info}/licenses/LICENSE", f"{info}/licenses/LICENSE-lessons", "rapkm_lite/py.typed"} <= set(names)
    code = {p for kind in ("*.py", "*.js", "*.css", "*.mplstyle") for p in (ROOT / "rapkm_lite").rglob(kind)}
    data = {p for kind in ("*.toml", "*.csv") for p in (ROOT / "data").rglob(kind)}
    wanted = {p.relative_to(ROOT).as_posix() for p in code}
    wanted |= {f"rapkm_lite/{p.relative_to(ROOT).as_posix()}" for p in data}
    assert wanted <= set(names)


def test_wheel_holds_the_lessons_without_solutions_and_outputs(wheel):
    names = wheel.namelist()
    lessons = {name for name in names if name.startswith("rapkm_lite/notebooks/")}
    assert lessons == {f"rapkm_lite/notebooks/{path.name}" for path in shipped(ROOT / "notebooks")}
    for name in lessons:
        text = wheel.read(name).decode("utf-8")
        assert "BEGIN SOLUTION" not in text
        assert not name.endswith(".ipynb") or text == bare(text)


def test_description_on_an_index_page_has_no_relative_link_and_asks_for_no_notebook_tools(wheel):
    text = wheel.read(next(n for n in wheel.namelist() if n.endswith("METADATA"))).decode("utf-8")
    head, description = text.split("\n\n", 1)
    assert all(link.startswith("https://") for link in re.findall(r"\]\(([^)]*)\)", description))
    needed = re.findall(r"^Requires-Dist: ([\w.-]+)(?![^\n]*extra ==)", head, re.MULTILINE)
    assert sorted(needed) == ["anywidget", "ipywidgets", "matplotlib", "numpy", "scipy"]
    # Colab comes with ipywidgets 7.7.1 and must not have to replace it.
    assert re.search(r"^Requires-Dist: ipywidgets<9,>=7.7.1$", head, re.MULTILINE)


def test_a_browser_that_imports_the_package_gets_what_it_needs(wheel):
    row = module("lite.py").entry(Path(wheel.filename))
    assert row["name"] == "rapkm-lite" and row["imports"] == ["rapkm_lite"] and row["version"] == rk.__version__
    assert row["depends"] == ["anywidget", "ipywidgets", "matplotlib", "numpy", "scipy"]


def test_front_page_shows_the_machine_first_then_how_to_open_a_lesson():
    lines = [line for line in README.splitlines() if line]
    picture = re.fullmatch(r"!\[([^\]]{40,})\]\(([\w/.]+)\)", lines[1])
    assert picture, "the front page begins with a picture and its words"
    moving = (ROOT / picture[2]).read_bytes()
    assert moving[:4] == b"RIFF" and b"ANIM" in moving[:64], f"{picture[2]} does not move"
    command = "python -m jupyter lab notebooks/00_start_here.ipynb"
    assert README.index("git clone") < README.index("pip install -r requirements.txt") < README.index(command)
    for said in "is not trusted", "websocket_ping_timeout", "pip install . jupyterlab", "python docs/build.py":
        assert said in README


def test_start_page_is_one_small_file_that_asks_for_nothing(tmp_path):
    page = module("pages/start.py").page("contents.html", "run.html")
    assert len(page.encode()) <= 150_000
    assert "{{" not in page and not re.search(r"(src|href)=\"(https?:)?//|@import|\bfetch\(|XMLHttpRequest", page)
    assert re.search(r"<html lang=", page) and 'name="viewport"' in page and "prefers-reduced-motion" in page
    node = shutil.which("node")
    if node:
        script = re.findall(r"<script>(.*?)</script>", page, re.DOTALL)
        (tmp_path / "page.js").write_text("\n".join(script), encoding="utf-8")
        assert subprocess.run([node, "--check", str(tmp_path / "page.js")]).returncode == 0


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_lesson_as_a_page_has_the_anchors_that_the_index_links_to(path):
    lessons = module("pages/lessons.py")
    index = (ROOT / "notebooks" / "equations.md").read_text(encoding="utf-8")
    anchors = [anchor for anchor, lesson in lessons.lesson_of_equation(index).items() if lesson == path.stem]
    page = lessons.lesson_page(path, anchors)
    made = re.findall(r'id=\\"((?:eq|table)-\d+)\\"', page)
    assert sorted(made) == sorted(anchors)
    assert all(f'href=\\"equations.html#{anchor}\\"' in page for anchor in anchors)
    links = re.findall(r"\]\((?!http|#|attachment)([^)#\s]+)", json.dumps(json.loads(page), ensure_ascii=False))
    assert not [link for link in links if not (path.parent / link).exists() and link != "solutions/index.md"]


def test_every_lesson_of_the_index_is_there():
    named = set(
        module("pages/lessons.py").lesson_of_equation((ROOT / "notebooks/equations.md").read_text("utf-8")).values()
    )
    assert named <= {path.stem for path in NOTEBOOKS}


def test_pages_of_a_site_lead_to_lessons_that_run_in_it_as_wide_as_the_screen(tmp_path):
    lesson = NOTEBOOKS[3].stem
    (tmp_path / "lite/files").mkdir(parents=True)
    (tmp_path / "lite/files" / NOTEBOOKS[3].name).touch()
    page = json.loads(module("pages/lessons.py").lesson_page(NOTEBOOKS[3], []))
    sources = {
        "index.html": module("pages/start.py").page("contents.html", "run.html"),
        "run.html": (ROOT / "docs/build.py").read_text(encoding="utf-8"),
        f"lessons/{lesson}.html": "".join(page["cells"][0]["source"]),
    }
    for name, text in sources.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    module("lite.py").link(tmp_path / "lite")
    for name in sources:
        made = (tmp_path / name).read_text(encoding="utf-8")
        lite, first = ("../lite", lesson) if "/" in name else ("lite", "00_start_here")
        assert f'<a class="on-wide" href="{lite}/lab/index.html?path={first}.ipynb">Run ' in made
        assert f'<a class="on-narrow" href="{lite}/notebooks/index.html?path={first}.ipynb">Run ' in made
        assert "the first start takes a minute" in made and "<!-- here -->" not in made
        assert "pictures are still:" not in made


def test_lessons_in_the_browser_need_a_full_distribution_and_overwrite_nothing(tmp_path, monkeypatch, capsys):
    """Nothing of a folder that was not made by it is lost; a lock file names what its core does not hold."""
    lite, pyodide, mine = module("lite.py"), tmp_path / "pyodide", tmp_path / "mine"
    pyodide.mkdir()
    assert lite.lacking(pyodide) == ["pyodide.js", "pyodide-lock.json"]
    (pyodide / "pyodide.js").touch()
    wheels = {name: {"file_name": f"{name}.whl"} for name in lite.BROUGHT}
    (pyodide / "pyodide-lock.json").write_text(json.dumps({"packages": wheels}), encoding="utf-8")
    assert lite.lacking(pyodide) == list(lite.BROUGHT)
    for row in wheels.values():
        (pyodide / row["file_name"]).touch()
    assert not lite.lacking(pyodide)
    mine.mkdir()
    (mine / "thesis.txt").write_text("years of work", encoding="utf-8")
    monkeypatch.setattr(sys, "argv", ["lite.py", "--pyodide", str(pyodide), "--output", str(mine)])
    monkeypatch.setattr(lite.importlib.util, "find_spec", lambda name: name)
    with pytest.raises(SystemExit):
        lite.main()
    assert "allowed: an empty folder" in capsys.readouterr().err and (mine / "thesis.txt").exists()


def test_every_public_name_has_its_place_in_the_reference(tmp_path):
    module("pages/reference.py").write(tmp_path / "reference")
    pages = "\n".join(path.read_text(encoding="utf-8") for path in (tmp_path / "reference").glob("*.rst"))
    for name in rk.__all__:
        assert len(re.findall(rf":: rapkm_lite\.{name}$", pages, re.MULTILINE)) == 1, name
        assert re.search(rf"^\* :py:obj:`{name} <rapkm_lite\.{name}>`: \S", pages, re.MULTILINE), name
    assert "guarded" not in pages
