"""Every file of the repository: links lead somewhere and back, no path of a machine, stored outputs in their order."""

import json
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
MADE = {
    "__pycache__",
    "_site",
    "_work",
    "jupyter_execute",
    "_lite",
    "build",
    "dist",
    "node_modules",
    "htmlcov",
    "test-results",
}
NAMES = {"ids": lambda path: path.relative_to(ROOT).as_posix()}


def listed():
    """The files that belong to the repository; what tools leave behind does not."""
    for path in sorted(ROOT.rglob("*")):
        parts = path.relative_to(ROOT).parts
        hidden = any(part.startswith(".") and part not in (".ci", ".github") for part in parts)
        if path.is_file() and not hidden and not MADE.intersection(parts):
            yield path


FILES = list(listed())
BOOKS = [path for path in FILES if path.suffix == ".ipynb"]
PAGES = [path for path in FILES if path.suffix == ".md" and "pages" not in path.parts]
LESSONS = sorted((ROOT / "notebooks").glob("[0-9][0-9]_*.ipynb"))
# A folder of a person or of a machine, in any system's way to write it.
PLACES = re.compile(r"(?<![\w.~/])/(?:home|root|Users|work|private/var)/\w|\b[A-Z]:\\+Users\b")


def text(path):
    return path.read_text(encoding="utf-8")


def cells(path):
    return json.loads(text(path))["cells"]


def markdown(path):
    """What a page or a notebook says, without its code."""
    if path.suffix == ".md":
        return re.sub(r"```.*?```", "", text(path), flags=re.S)
    return "\n".join("".join(cell["source"]) for cell in cells(path) if cell["cell_type"] == "markdown")


def links(path):
    found = re.findall(r"\]\(\s*<?([^)#\s>]+)(?:#[^)]*)?>?\s*\)", markdown(path))
    return [target for target in found if "://" not in target and not target.startswith(("mailto:", "attachment:"))]


@pytest.mark.parametrize("path", PAGES + BOOKS, **NAMES)
def test_links_lead_somewhere(path):
    for target in links(path):
        assert (path.parent / target).exists(), target


def test_tables_of_lessons_and_their_folder_agree():
    """A row for every lesson, a lesson for every row; each lesson with exercises has its solution, and only those."""
    linked = {Path(t).name for t in links(ROOT / "README.md") if re.fullmatch(r"notebooks/\d\d_\w+\.ipynb", t)}
    assert linked == {path.name for path in LESSONS}
    solved = {path.name for path in (ROOT / "notebooks" / "solutions").glob("*.ipynb")}
    # An exercise hands its answer on, ``name = check(...)``; lesson 00 only shows what a verdict looks like.
    asks = re.compile(r"^\w+ = check\(", re.M)
    asked = {path.name for path in LESSONS if any(asks.search("".join(cell["source"])) for cell in cells(path))}
    assert solved == asked


def test_lessons_form_a_chain():
    """Each lesson is linked from another notebook, or from the front page."""
    linked = {(path.parent / target).resolve() for path in [*BOOKS, *PAGES] for target in links(path)}
    assert {path.resolve() for path in LESSONS} <= linked


def test_no_file_is_large():
    assert not {path.name: path.stat().st_size for path in FILES if path.stat().st_size > 1_500_000}


def test_no_path_of_a_machine():
    found = []
    for path in FILES:
        if path.suffix in {
            ".ipynb",
            ".md",
            ".py",
            ".toml",
            ".txt",
            ".json",
            ".csv",
            ".cff",
            ".yml",
            ".js",
            ".html",
            ".cfg",
        }:
            found += [
                f"{path.relative_to(ROOT)}: {hit[0]}"
                for hit in PLACES.finditer(text(path))
                if path.name != Path(__file__).name
            ]
    assert not found


@pytest.mark.parametrize("path", BOOKS, **NAMES)
def test_stored_outputs_come_from_one_run_without_complaints(path):
    code = [cell for cell in cells(path) if cell["cell_type"] == "code"]
    counts = [cell["execution_count"] for cell in code if cell["execution_count"] is not None]
    assert counts == sorted(set(counts))
    for cell in code:
        assert not any(output.get("name") == "stderr" or output["output_type"] == "error" for output in cell["outputs"])
        if cell["execution_count"] is None:
            assert not cell["outputs"]
