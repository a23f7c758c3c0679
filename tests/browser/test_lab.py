"""Lessons in a real JupyterLab: all cells run, every slider obeys the keyboard and changes its picture, no traceback.

Skipped where playwright or a Chromium is missing, unless the environment variable RAPKM_LITE_BROWSER is 1.
"""

import os
import shutil
from pathlib import Path

import pytest
from lab import ARGUMENTS, Notebook, find_browser, server

NOTEBOOKS = Path(__file__).parents[2] / "notebooks"
DEMANDED = os.environ.get("RAPKM_LITE_BROWSER") == "1"


def missing(what: str):
    """Skip with the reason, or fail where the browser tests are demanded."""
    (pytest.fail if DEMANDED else pytest.skip)(f"{what}; the browser tests need playwright and a Chromium")


@pytest.fixture(scope="module")
def browser():
    """A headless Chromium."""
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        missing("playwright is not installed (python -m pip install playwright)")
    path = find_browser()
    if path is None:
        missing("no chromium, chromium-browser or google-chrome on the path (apt-get install chromium)")
    with sync_playwright() as p:
        browser = p.chromium.launch(executable_path=path, args=ARGUMENTS)
        yield browser
        browser.close()


@pytest.fixture(scope="module")
def site(browser, tmp_path_factory):
    """JupyterLab on a copy of the notebooks."""
    folder = tmp_path_factory.mktemp("lab")
    shutil.copytree(NOTEBOOKS, folder / "root", ignore=shutil.ignore_patterns(".ipynb_checkpoints"))
    with server(folder / "root", folder) as address:
        yield address


@pytest.fixture
def open_notebook(browser, site):
    """A function that opens a notebook by the beginning of its name."""
    pages = []

    def opened(start: str) -> Notebook:
        path = next(NOTEBOOKS.glob(f"{start}*.ipynb"), None)
        if path is None:
            pytest.fail(f"there is no notebook {start}*.ipynb")
        pages.append(browser.new_page(viewport={"width": 1280, "height": 1000}))
        return Notebook(pages[-1], *site, path.name)

    yield opened
    for page in pages:
        page.close()


@pytest.mark.parametrize("lesson", ["03", "04", "05", "dashboard"])
def test_every_slider_changes_its_picture(lesson, open_notebook):
    notebook = open_notebook(lesson)
    notebook.run_all()
    sliders = notebook.sliders()
    assert sliders, "there is no slider on the page"
    for i, label in enumerate(sliders):
        assert label.strip(), f"slider {i + 1} has no label"
        notebook.press(i)


def test_pictures_stand_in_for_widgets_before_anything_runs(open_notebook):
    notebook = open_notebook("dashboard")
    pictures = "() => [...document.querySelectorAll('.jp-OutputArea img')].filter(e => e.naturalWidth > 600).length"
    notebook.wait(f"() => ({pictures})() === 6", 20)
    assert notebook.sliders() == []
    notebook.run_all()
    # With a kernel the widget takes the place of the stored picture.
    assert notebook.ask(pictures) == 6 and len(notebook.sliders()) >= 20
    notebook.run_all(restart=True)
    assert notebook.ask(pictures) == 6
    notebook.press(0)


def test_wrong_setting_is_a_sentence_and_reset_goes_back(open_notebook):
    notebook = open_notebook("dashboard")
    notebook.run_all()
    page = notebook.page
    for _ in range(3):
        notebook.ask("i => lab.focus(i)", 0)
        page.keyboard.press("End")
        notebook.ask("i => lab.focus(i)", 1)
        page.keyboard.press("End")
    notebook.settle()
    page.get_by_text("lies outside the workspace").first.wait_for(timeout=10_000)
    notebook.check()
    page.get_by_role("button", name="Reset").first.press("Enter")
    notebook.settle()
    assert page.get_by_text("lies outside the workspace").count() == 0
