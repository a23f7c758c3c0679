"""The slides of the lessons on the screens of lecture rooms: every slide is seen whole while its answers are closed,
and its answers open without the letter A, too."""

import sys
from pathlib import Path

import pytest

NOTEBOOKS = Path(__file__).parents[2] / "notebooks"
sys.path.insert(0, str(NOTEBOOKS))
LESSONS = sorted(NOTEBOOKS.glob("[0-9][0-9]_*.ipynb"))
TALL = """pages.map((page, k) => (show(k), [k + 1, page.getBoundingClientRect().height - innerHeight,
    document.documentElement.scrollWidth - innerWidth])).filter(([k, tall, wide]) => tall > 1 || wide > 1)"""


def made(lesson: Path, folder: Path) -> str:
    """The address of the slides of a lesson."""
    pytest.importorskip("latex2mathml", reason="formulas of slides need latex2mathml, see notebooks/README.md")
    import slides

    file = folder / "slides.html"
    assert slides.main(lesson.stem[:2], str(file)) == 0
    return file.as_uri()


@pytest.mark.parametrize("lesson", LESSONS, ids=lambda path: path.stem[:2])
def test_every_slide_fits_a_projector(browser, tmp_path, lesson):
    address = made(lesson, tmp_path)
    page = browser.new_page()
    for width, height in ((1024, 768), (1280, 720), (1280, 800), (1920, 1080)):
        page.set_viewport_size({"width": width, "height": height})
        page.goto(address)
        page.evaluate("document.images.length && Promise.all([...document.images].map(image => image.decode()))")
        assert page.evaluate(TALL) == [], f"{width} x {height}: slide, px too tall, px too wide"
    # What a reader of the screen is told: the slide is what the page is about, and where it is among the others.
    page.keyboard.press("Home")
    page.get_by_role("button", name="Next slide").click()
    assert page.get_by_role("main").locator("section:visible").count() == 1
    assert page.get_by_role("status").inner_text() == f"2 / {page.evaluate('pages.length')}"
    page.close()


def test_the_key_a_can_be_switched_off(browser, tmp_path):
    # WCAG 2.2, 2.1.4: a letter alone is a key of the page only as long as its reader wants that.
    page = browser.new_page()
    page.goto(made(LESSONS[0], tmp_path))
    page.evaluate("show(pages.findIndex(page => page.querySelectorAll('details').length === 1))")
    key, answer = page.get_by_role("button", name="Key A"), page.locator("details:visible")
    page.keyboard.press("a")
    assert answer.get_attribute("open") == ""
    page.keyboard.press("a")
    for pressed, on in (("Enter", False), ("Space", True), ("Enter", False)):
        key.press(pressed)
        assert key.get_attribute("aria-pressed") == str(on).lower()
        page.keyboard.press("a")
        assert answer.get_attribute("open") == ("" if on else None)
        answer.evaluate("fold => { fold.open = false; }")
    answer.locator("summary").press("Enter")
    assert answer.get_attribute("open") == "", "without the letter a fold opens by its own keys"
    page.close()
