"""Lessons in a real JupyterLab: all cells run, every slider obeys the keyboard and changes its picture, no traceback.

Skipped where playwright or a Chromium is missing, unless the environment variable RAPKM_LITE_BROWSER is 1.
"""

from itertools import pairwise

import pytest
from lab import NOTEBOOKS, Notebook

# The size in pixels of everything that is written on a canvas, in its order.
WRITTEN = """window.written = []; const write = CanvasRenderingContext2D.prototype.fillText;
CanvasRenderingContext2D.prototype.fillText = function (...words) {
  written.push(parseFloat(this.font.match(/([\\d.]+)px/)[1])); return write.apply(this, words); };"""
# The words of the page on the screens, without indices, which are smaller than what they belong to.
SMALL = """() => [...document.querySelectorAll('.rapkm-screen *')].filter(e => e.tagName !== 'SUB'
    && e.getClientRects().length && [...e.childNodes].some(n => n.nodeType === 3 && n.textContent.trim())
    && !e.closest('.rapkm-sentence') && parseFloat(getComputedStyle(e).fontSize) < 16)
    .map(e => e.className + ': ' + e.textContent)"""

# Of each screen: the lower end of its lowest panel, the upper end of what is written below, the width of the picture.
PLACES = """() => [...document.querySelectorAll('.rapkm-screen .rapkm')].map(root => {
    const ends = [...root.querySelectorAll('.rapkm-panel')].map(panel => panel.getBoundingClientRect().bottom);
    const below = root.querySelector('.rapkm-numbers').getBoundingClientRect().top;
    return [Math.max(...ends), below, root.clientWidth]; })"""


@pytest.fixture
def open_notebook(browser, laboratory):
    """A function that opens a notebook by the beginning of its name."""
    pages = []

    def opened(start: str, height: int = 1000, script: str = "") -> Notebook:
        path = next(NOTEBOOKS.glob(f"{start}*.ipynb"), None)
        if path is None:
            pytest.fail(f"there is no notebook {start}*.ipynb")
        pages.append(browser.new_page(viewport={"width": 1280, "height": height}))
        pages[-1].add_init_script(script)
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


def test_dashboard_is_a_sequence_of_screens_for_a_projector(open_notebook):
    notebook = open_notebook("dashboard", height=720, script=WRITTEN)
    notebook.run_all()
    notebook.wait("() => document.querySelectorAll('.rapkm.live').length === 7", 60)
    # Nothing is smaller than 16 px; indices are 0.72 of the words that they follow.
    assert notebook.ask(SMALL) == []
    written = notebook.ask("() => window.written")
    assert len(written) > 100
    assert all(b >= 16 or (a >= 16 and b == pytest.approx(0.72 * a, rel=1e-3)) for a, b in pairwise(written))
    # Keys turn the screens, from a slider, too, and stop at both ends.
    tops = "() => [...document.querySelectorAll('.rapkm-screen')].map(e => Math.abs(e.getBoundingClientRect().top))"
    notebook.ask("() => lab.focus(0)")
    value = notebook.ask("() => lab.at(0)")
    turns = [("PageDown", k) for k in (1, 2, 3, 4, 5, 6, 6)] + [("PageUp", k) for k in (5, 4, 3, 2, 1, 0, 0)]
    for key, screen in turns:
        notebook.page.keyboard.press(key)
        notebook.wait(f"() => {{ const t = ({tops})(); return t.indexOf(Math.min(...t)) === {screen}; }}", 5)
    assert notebook.ask("() => lab.at(0)") == value
    # The answer comes on demand, and goes.
    first = notebook.page.locator(".rapkm-screen").first
    answer = first.get_by_text("On the outlined curve")
    for seen, word in ((False, "Show"), (True, "Hide"), (False, "Show")):
        answer.wait_for(state="visible" if seen else "hidden", timeout=5000)
        first.get_by_role("button", name=f"{word} the answer").click()
    notebook.check()


@pytest.mark.parametrize("width, height", [(1024, 768), (700, 500)])
def test_screens_of_a_small_window_leave_the_numbers_below_the_picture(width, height, open_notebook):
    notebook = open_notebook("dashboard")
    notebook.page.set_viewport_size({"width": width, "height": height})
    notebook.run_all()
    notebook.wait("() => document.querySelectorAll('.rapkm.live').length === 7", 60)
    places = notebook.ask(PLACES)
    assert len(places) == 7
    for inside, below, wide in places:
        assert inside <= below and wide > 240
    notebook.check()
