"""The slides of the lessons on the screens of lecture rooms: every slide is seen whole while its answers are closed.
Where a page is narrow or enlarged, only wide boxes move sideways, and everything is reached by keys."""

import sys
from pathlib import Path

import pytest

NOTEBOOKS = Path(__file__).parents[2] / "notebooks"
sys.path.insert(0, str(NOTEBOOKS))
LESSONS = sorted(NOTEBOOKS.glob("[0-9][0-9]_*.ipynb"))
TALL = """pages.map((page, k) => (show(k), [k + 1, page.getBoundingClientRect().height - innerHeight,
    document.documentElement.scrollWidth - innerWidth])).filter(([k, tall, wide]) => tall > 1 || wide > 1)"""
# As what is wider than the screen has been found by the browser.
SEEN = "() => new Promise(done => requestAnimationFrame(() => setTimeout(done)))"


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


@pytest.mark.parametrize("lesson", LESSONS, ids=lambda path: path.stem[:2])
def test_only_wide_boxes_move_sideways_on_a_telephone(browser, tmp_path, lesson):
    page = browser.new_page()
    page.goto(made(lesson, tmp_path))
    page.evaluate("document.querySelectorAll('details').forEach(one => { one.open = true; })")
    for width, height in ((390, 844), (320, 640)):
        page.set_viewport_size({"width": width, "height": height})
        for number in range(page.evaluate("pages.length")):
            page.evaluate(f"show({number})")
            page.evaluate(SEEN)
            wide = page.evaluate("document.documentElement.scrollWidth - innerWidth")
            assert wide <= 0, f"slide {number + 1} at {width} px"
            unreached = """[...pages[at].querySelectorAll('*')].filter(e => e.scrollWidth > e.clientWidth + 1
                && /auto|scroll/.test(getComputedStyle(e).overflowX) && e.tabIndex < 0).map(e => e.outerHTML)"""
            assert page.evaluate(unreached) == [], "a box that only a finger moves"
    page.close()


def slides_of_a_table(browser, folder: Path):
    """A telephone that shows the slide of lesson 11 whose answer is a table of seven columns, opened."""
    page = browser.new_page(viewport={"width": 390, "height": 844})
    page.goto(made(next(path for path in LESSONS if path.stem.startswith("11")), folder))
    place = "pages.findIndex(page => page.querySelector('details th:nth-child(7)'))"
    page.evaluate(f"(show({place}), pages[at].querySelector('details').open = true)")
    page.evaluate(SEEN)
    return page


def test_arrows_move_a_wide_table_and_then_turn_the_pages_again(browser, tmp_path):
    page = slides_of_a_table(browser, tmp_path)
    place = page.evaluate("at")
    page.keyboard.press("Tab")  # the fold
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.tagName") == "TABLE"
    page.keyboard.press("ArrowRight")
    page.wait_for_function("document.activeElement.scrollLeft > 0")
    assert page.evaluate("at") == place
    page.keyboard.press("Tab")  # out of the table
    page.keyboard.press("ArrowRight")
    assert page.evaluate("at") == place + 1
    page.close()


def test_letters_on_an_enlarged_page_are_twice_as_large_on_the_screen(browser, tmp_path):
    # WCAG 2.2, 1.4.4; a window enlarged to 400 % has a quarter of its pixels, each four times as wide.
    page = browser.new_page(viewport={"width": 1280, "height": 720})
    page.goto(made(LESSONS[0], tmp_path))
    size = "parseFloat(getComputedStyle(document.documentElement).fontSize)"
    usual = page.evaluate(size)
    page.set_viewport_size({"width": 320, "height": 180})
    assert 4 * page.evaluate(size) >= 2 * usual
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


@pytest.mark.parametrize("stores", [True, False])
def test_the_switch_of_the_key_a_stays_where_it_is_at_a_reload(browser, tmp_path, stores):
    page, errors = browser.new_page(), []
    page.on("pageerror", lambda error: errors.append(str(error)))
    blocked = (
        "Object.defineProperty(window, 'sessionStorage', { get() { throw new DOMException('', 'SecurityError'); } })"
    )
    page.add_init_script("" if stores else blocked)
    page.goto(made(LESSONS[0], tmp_path))
    key = page.get_by_role("button", name="Key A")
    assert key.get_attribute("aria-pressed") == "true"
    for on in (False, True):
        key.click()
        assert key.get_attribute("aria-pressed") == str(on).lower()
        page.reload()
        assert key.get_attribute("aria-pressed") == str(on or not stores).lower()
        if not stores:
            break
    assert errors == []
    page.close()
