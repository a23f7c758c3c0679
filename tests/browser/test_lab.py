"""Lessons in a real JupyterLab: all cells run, every slider obeys the keyboard and changes its picture, no traceback.

Skipped where playwright or a Chromium is missing, unless the environment variable RAPKM_LITE_BROWSER is 1.
"""

import pytest
from lab import NOTEBOOKS, Notebook


@pytest.fixture
def open_notebook(browser, laboratory):
    """A function that opens a notebook by the beginning of its name."""
    pages = []

    def opened(start: str) -> Notebook:
        path = next(NOTEBOOKS.glob(f"{start}*.ipynb"), None)
        if path is None:
            pytest.fail(f"there is no notebook {start}*.ipynb")
        pages.append(browser.new_page(viewport={"width": 1280, "height": 1000}))
        return Notebook(pages[-1], *laboratory[1:], path.name)

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
    stored = """() => [...document.querySelectorAll('.jp-OutputArea img')]
        .filter(e => e.naturalWidth > 600 && e.getBoundingClientRect().height > 100).length"""
    live = "() => document.querySelectorAll('.rapkm.live canvas').length"
    if notebook.ask("() => lab.cells().some(c => c.outputs.length)"):
        notebook.wait(f"() => ({stored})() === 7", 20)
    assert notebook.ask(live) == 0
    for restart in (False, True):
        notebook.run_all(restart=restart)
        notebook.wait("() => document.querySelectorAll('.rapkm.live').length === 7", 30)
        # With a kernel the canvas takes the place of the stored picture.
        assert notebook.ask(stored) == 0
    notebook.press(0)
