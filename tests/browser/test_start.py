"""The start page from disk: taken by mouse and keys, its address, its numbers, nothing asked from elsewhere."""

import json
import re
import sys
from pathlib import Path

import numpy as np
import pytest
from lab import ARGUMENTS, find_browser

import rapkm_lite as rk

sys.path.insert(0, str(Path(__file__).parents[2] / "docs"))
OFFSET = [4e-3, -2e-3, 5e-3]


@pytest.fixture(scope="module")
def address(tmp_path_factory):
    """The page as one file on disk."""
    from pages import start

    path = tmp_path_factory.mktemp("start") / "index.html"
    path.write_text(start.page("contents.html", "lite/lab/index.html"), encoding="utf-8")
    assert path.stat().st_size <= 150_000
    return path.as_uri()


class Page:
    """The start page in a context of its own; `requests` and `errors` must stay empty."""

    def __init__(self, browser, address, width=1280, script="", **settings):
        self.page = browser.new_context(viewport={"width": width, "height": 900}, **settings).new_page()
        self.page.add_init_script(script)
        self.requests, self.errors = [], []
        self.page.on("request", lambda r: None if r.url.startswith("file:") else self.requests.append(r.url))
        self.page.on("console", lambda m: self.errors.append(m.text) if m.type == "error" else None)
        self.page.on("pageerror", lambda e: self.errors.append(str(e)))
        self.open(address)

    def open(self, address):
        self.page.goto("about:blank")
        self.page.goto(address)
        self.page.wait_for_function("+document.querySelector('.rapkm')?.dataset.drawn > 0")

    def places(self):
        return json.loads(self.page.evaluate("document.querySelector('.rapkm').dataset.places"))

    def wait(self, name, value):
        """Until a control has a value."""
        script = "([n, v]) => JSON.parse(document.querySelector('.rapkm').dataset.places)[n] === v"
        self.page.wait_for_function(script, arg=[name, value])


# How far the middle of a ring is from the place it was given, in px.
ASTRAY = """[...document.querySelectorAll('.rapkm-knob:not([hidden])')].map(e => {
    const ring = e.getBoundingClientRect(), plot = e.parentElement.getBoundingClientRect();
    const [x, y] = e.style.translate.split(' ').map(parseFloat);
    return Math.hypot(ring.left + ring.width / 2 - plot.left - x, ring.top + ring.height / 2 - plot.top - y); })"""


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [360, 1024, 3840])
def test_it_opens_from_disk_and_asks_for_nothing(browser, address, width, scheme):
    seen = Page(browser, address, width, color_scheme=scheme)
    assert seen.page.evaluate("document.documentElement.scrollWidth") <= width
    assert max(seen.page.evaluate(ASTRAY)) < 0.5
    unnamed = "[...document.querySelectorAll('input, select, button, .rapkm-knob, canvas')].filter(e => !"
    unnamed += (
        "(e.getAttribute('aria-label') || e.closest('label')?.textContent.trim() || e.textContent.trim())).length"
    )
    assert seen.page.evaluate(unnamed + "") == 0
    # A picture is called as its heading says, which changes.
    heads = "[...document.querySelectorAll('.rapkm-panel')].map(e => [e.querySelector('canvas').ariaLabel, "
    named = seen.page.evaluate(heads + "e.querySelector('.rapkm-head b').textContent])")
    assert all(title in ("", name) for name, title in named) and "Torques at rest, mN m" in dict(named)
    assert seen.requests == [] and seen.errors == []


def test_without_javascript_nothing_offers_what_it_cannot_do(browser, address):
    page = browser.new_context(java_script_enabled=False).new_page()
    page.goto(address)
    assert page.locator("noscript p").is_visible() and page.get_by_text("Read the lessons").is_visible()
    assert not any(control.is_visible() for control in page.locator("input, select, button").all())


@pytest.mark.parametrize("scale", [1, 1.25, 2])
def test_a_canvas_has_the_pixels_of_its_place_and_is_not_stretched(browser, address, scale):
    """Else the browser would resample it, and its words would be blurred."""
    sizes = """[...document.querySelectorAll('canvas')].map(c => {
        const { width, height } = c.getBoundingClientRect();
        return [c.width, c.height, width * devicePixelRatio, height * devicePixelRatio]; })"""
    for width in (390, 900, 1280, 1333):
        seen = Page(browser, address, width, device_scale_factor=scale)
        made = np.array(seen.page.evaluate(sizes))
        # A browser keeps lengths in 1/64 px.
        assert len(made) == 6 and np.allclose(made[:, :2], made[:, 2:], rtol=0, atol=scale / 64)


def test_the_end_effector_follows_the_mouse_and_the_keys_and_the_address_brings_it_back(browser, address):
    seen = Page(browser, address)
    knob = seen.page.locator(".rapkm-knob").first
    box = knob.bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    seen.page.mouse.move(x, y)
    seen.page.mouse.down()
    seen.page.mouse.move(x + 50, y + 40, steps=4)
    seen.page.mouse.up()
    seen.page.wait_for_function("location.hash.length > 1")
    moved = seen.places()
    assert moved["x"] > 30 and moved["y"] < 40
    knob.focus()
    seen.page.keyboard.press("ArrowLeft")
    seen.wait("x", moved["x"] - 2)
    seen.page.wait_for_function(f"location.hash.startsWith('#{moved['x'] - 2},')")
    seen.open(seen.page.url)
    assert seen.places() == moved | {"x": moved["x"] - 2}
    assert seen.errors == []


def test_a_key_on_a_slider_goes_by_a_millimetre_both_ways(browser, address):
    seen = Page(browser, address)
    for name in ("x", "y"):
        seen.page.locator(f"#{name}").focus()
        first = seen.places()[name]
        for key, value in (("ArrowLeft", first - 1), ("ArrowDown", first - 2), ("ArrowRight", first - 1)):
            seen.page.keyboard.press(key)
            seen.wait(name, value)


class Fingers:
    """Touches of a page, each at the place (x, y) in px that it has last been moved to."""

    def __init__(self, page):
        self.session, self.at = page.context.new_cdp_session(page), {}

    def send(self, kind):
        points = [{"x": x, "y": y, "id": name} for name, (x, y) in self.at.items()]
        self.session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    def down(self, name, x, y):
        self.at[name] = x, y
        self.send("touchStart")

    def move(self, name, dx, dy, steps=10):
        for _ in range(steps):
            x, y = self.at[name]
            self.at[name] = x + dx / steps, y + dy / steps
            self.send("touchMove")

    def up(self):
        self.at.clear()
        self.send("touchEnd")


def at_rest(page):
    """Wait until neither the picture nor the page has moved for a while."""
    seen, last = "[scrollY, document.querySelector('.rapkm').dataset.drawn]", None
    while (now := page.evaluate(seen)) != last:
        last = now
        page.wait_for_timeout(300)


def middle(page, selector):
    box = page.locator(selector).first.bounding_box()
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def test_a_finger_along_the_time_sets_it_and_one_across_scrolls(browser, address):
    seen = Page(browser, address, 390, has_touch=True)
    plot = ".rapkm-plot:has(.rapkm-knob.bare)"
    seen.page.locator(plot).scroll_into_view_if_needed()
    at_rest(seen.page)
    fingers, before, top = Fingers(seen.page), seen.places(), seen.page.evaluate("scrollY")
    fingers.down(1, *middle(seen.page, plot))
    fingers.move(1, 0, -150)
    fingers.up()
    seen.page.wait_for_function(f"scrollY > {top}")
    at_rest(seen.page)
    assert seen.places() == before
    fingers.down(1, *middle(seen.page, plot))
    fingers.move(1, 40, 0)
    fingers.up()
    seen.page.wait_for_function("JSON.parse(document.querySelector('.rapkm').dataset.places).time > 2.5")


def test_a_second_finger_takes_nothing_from_the_first(browser, address):
    seen = Page(browser, address, has_touch=True)
    fingers, before = Fingers(seen.page), seen.places()
    fingers.down(1, *middle(seen.page, ".rapkm-knob >> nth=0"))
    fingers.down(2, *middle(seen.page, ".rapkm-knob >> nth=2"))
    fingers.move(1, 40, 0)
    seen.page.wait_for_function(f"JSON.parse(document.querySelector('.rapkm').dataset.places).x > {before['x'] + 10}")
    fingers.up()
    at_rest(seen.page)
    assert {name: v for name, v in seen.places().items() if "offset" in name} == {
        name: v for name, v in before.items() if "offset" in name
    }
    # And the next touch takes hold again.
    fingers.down(1, *middle(seen.page, ".rapkm-knob >> nth=0"))
    fingers.move(1, -60, 0)
    fingers.up()
    seen.page.wait_for_function(f"JSON.parse(document.querySelector('.rapkm').dataset.places).x < {before['x'] + 5}")
    assert seen.errors == []


def test_far_outside_it_stops_where_an_arm_is_nearly_stretched(browser, address):
    seen = Page(browser, address)
    for name, value in (("x", 150), ("y", 180)):
        seen.page.evaluate(f"(e => (e.value = {value}, e.oninput()))(document.getElementById('{name}'))")
    seen.page.wait_for_timeout(300)
    places = seen.places()
    assert rk.reachable(rk.load(), [1e-3 * places["x"], 1e-3 * places["y"]])
    assert seen.errors == []


# x and y in mm, and the offsets in half mrad that push hardest.
RIM = [(-150, 80, 8, -4, 10), (-149, 80, 16, -16, 16), (-145, 87, 16, -16, 16), (122, 122, -16, 16, -16)]
RIM += [(142, 92, 16, 16, 16), (149, 80, -16, -16, -16), (-148, -140, 16, -16, 16), (0, -170, -16, 16, -16)]


@pytest.mark.parametrize("place", RIM, ids=lambda place: f"{place[0]},{place[1]}")
def test_a_link_to_the_rim_draws_and_the_next_link_brings_the_same(browser, address, place):
    link = ",".join(map(str, [*place, 0, 0, 0]))
    seen = Page(browser, f"{address}#{link}")
    places = seen.places()
    assert np.hypot(places["x"] - place[0], places["y"] - place[1]) < 30
    assert [places[f"offset_{i}"] for i in (1, 2, 3)] == [0.5 * offset for offset in place[2:]]
    # The page writes its own address when it is asked to move; that of the place where it stands is kept.
    here = ",".join(map(str, [places["x"], places["y"], *place[2:], 0, 0, 0]))
    seen.open(f"{address}#{here}")
    assert seen.places() == places and seen.errors == []


def test_a_link_is_followed_though_the_page_writes_its_own_address_first(browser, address):
    seen = Page(browser, f"{address}#20,50,8,-4,10,0,0,0")
    # The page writes 150 ms after a change; a slow machine may do so between the link and its event.
    script = "() => { location.hash = '30,40,6,0,4,1,0,0'; history.replaceState(null, '', '#20,50,8,-4,10,0,0,0'); }"
    seen.page.evaluate(script)
    seen.wait("x", 30)
    seen.page.wait_for_function("location.hash === '#30,40,6,0,4,1,0,0'")
    assert seen.errors == []


# All around, far outside, in steps of `step` degrees, for offsets that push either way; what was not drawn.
AROUND = """async (step) => { const root = document.querySelector('.rapkm'), lost = [], at = new Set();
  for (let a = 0; a < 360; a += step) for (const signs of [[1, -1, 1], [-1, 1, -1], [1, 1, 1]]) {
    const to = [Math.cos, Math.sin].map(f => Math.round(230 * f(a * Math.PI / 180)));
    const now = () => JSON.parse(root.dataset.places);
    const there = () => now().offset_1 === 8 * signs[0] && now().offset_2 === 8 * signs[1];
    location.hash = [...to, ...signs.map(s => 16 * s), 0, 0, 0].join();
    for (let k = 0; k < 200 && !there(); k++) await new Promise(requestAnimationFrame);
    if (!there()) lost.push([...to, ...signs].join());
    at.add([now().x, now().y].join());
  }
  return [lost, at.size]; }"""


def test_all_of_the_rim_can_be_walked(browser, address):
    seen = Page(browser, address)
    lost, count = seen.page.evaluate(AROUND, 2)
    assert lost == [] and count > 100 and seen.errors == []


def test_a_hand_goes_around_beyond_the_rim_and_its_address_brings_the_place_back(browser, address):
    seen = Page(browser, f"{address}#20,50,16,-16,16,0,0,0")
    box = seen.page.locator(".rapkm-knob").first.bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    seen.page.mouse.move(x, y)
    seen.page.mouse.down()
    places = set()
    for a in np.linspace(0, 2 * np.pi, 90):
        seen.page.mouse.move(x + 190 * np.cos(a), y + 190 * np.sin(a))
        seen.page.wait_for_timeout(20)
        places.add((seen.places()["x"], seen.places()["y"]))
    seen.page.mouse.up()
    assert len(places) > 45 and seen.errors == []
    # The hand that comes back finds the end-effector there.
    seen.page.wait_for_timeout(400)
    last = seen.places()
    seen.open(seen.page.url)
    assert seen.places() == last and seen.errors == []


def test_no_elbow_is_cut():
    page = (Path(__file__).parents[2] / "docs" / "start" / "page.js").read_text(encoding="utf-8")
    left, right, low, high = map(int, re.search(r"machine: \[(-?\d+), (-?\d+), (-?\d+), (-?\d+)\]", page).groups())
    robot = rk.load()
    grid = 1e-3 * np.stack(np.meshgrid(np.arange(-150, 151, 2), np.arange(-150, 181, 2)), axis=-1).reshape(-1, 2)
    q = rk.inverse_kinematics(robot, grid[rk.reachable(robot, grid)])
    angle = q[:, : robot.n_arms]
    elbow = 1e3 * (robot.base + robot.lengths[:, :1] * np.stack([np.cos(angle), np.sin(angle)], axis=-1))
    assert len(elbow) > 20_000
    # A ring of an elbow has a radius of some 10 mm.
    assert left + 10 < elbow[..., 0].min() and elbow[..., 0].max() < right - 10
    assert low + 10 < elbow[..., 1].min() and elbow[..., 1].max() < high - 10


# Boxes of the words on each canvas since it was last wiped.
WRITTEN = """window.wrote = new Map(); const kind = CanvasRenderingContext2D.prototype, { fillText, clearRect } = kind;
kind.fillText = function (words, x, y) {
  const size = parseFloat(this.font.match(/([\\d.]+)px/)[1]);
  wrote.get(this.canvas)?.push([words, x, y - 0.75 * size, x + this.measureText(words).width, y]);
  return fillText.call(this, words, x, y); };
kind.clearRect = function (...box) { wrote.set(this.canvas, []); return clearRect.apply(this, box); };
window.covered = (which) => [...document.querySelectorAll(which + ':not([hidden])')].flatMap(knob => {
  const plot = knob.parentElement, { left, top } = plot.getBoundingClientRect(), box = knob.getBoundingClientRect();
  return wrote.get(plot.querySelector('canvas')).filter(([, a, b, c, d]) => a < box.right - left && c > box.left - left
    && b < box.bottom - top && d > box.top - top).map(([words]) => words); });"""


@pytest.mark.parametrize("width", [390, 1400])
def test_the_handle_of_time_covers_no_number_of_an_axis(browser, address, width):
    seen = Page(browser, address, width, script=WRITTEN)
    for time in (0, 1, 100):
        seen.open(f"{address}#20,50,8,-4,10,{time},0,1")
        assert seen.page.evaluate("wrote.size") == 6
        assert seen.page.evaluate("covered('.rapkm-knob.bare')") == []


@pytest.mark.parametrize("width", [390, 700, 1024, 1400])
def test_no_ring_of_an_encoder_covers_a_number(browser, address, width):
    seen = Page(browser, address, width, script=WRITTEN)
    for offsets in ("0,0,0", "16,16,16", "-16,-16,-16", "16,-16,16", "8,-4,10"):
        seen.open(f"{address}#20,50,{offsets},0,0,0")
        ring = ".rapkm-knob[aria-label^=encoder]"
        assert seen.page.locator(ring).count() == 3
        assert seen.page.evaluate("which => covered(which)", ring) == []
        # All three are written, inside their canvas, and none over another.
        boxes, wide, high = seen.page.evaluate(
            """which => { const canvas = document.querySelector(which).parentElement.querySelector('canvas');
            return [wrote.get(canvas).filter(([words]) => words.includes('.')), canvas.clientWidth,
                    canvas.clientHeight]; }""",
            ring,
        )
        assert len(boxes) == 3
        assert all(0 <= a and c <= wide and 0 <= b and d <= high for _, a, b, c, d in boxes)
        assert boxes[0][3] < boxes[1][1] and boxes[1][3] < boxes[2][1]


# Triangles filled on the canvas of the machine, as their corners in px: the heads of arrows.
HEADS = """window.heads = []; { const kind = CanvasRenderingContext2D.prototype;
for (const [name, note] of Object.entries({
  clearRect: ({ canvas }) => canvas.ariaLabel === 'Drag the end-effector' && (heads = []),
  beginPath: context => (context.path = []),
  moveTo: ({ path }, x, y) => path?.push([x, y]),
  lineTo: ({ path }, x, y) => path?.push([x, y]),
  fill: ({ canvas, path }) => canvas.ariaLabel === 'Drag the end-effector' && path?.length === 3 && heads.push(path),
})) {
  const once = kind[name];
  kind[name] = function (...given) { note(this, ...given); return once.apply(this, given); };
} }"""


def test_no_arrow_of_a_force_leaves_the_picture(browser, address):
    seen, count = Page(browser, address, script=HEADS), 0
    for place in RIM:
        seen.open(f"{address}#{','.join(map(str, place))},0,0,0")
        heads = np.array(seen.page.evaluate("heads")).reshape(-1, 2)
        box = seen.page.evaluate("(e => [e.clientWidth, e.clientHeight])(document.querySelector('canvas'))")
        assert np.all((heads > 0) & (heads < box)), place
        count += len(heads) // 3
    assert count >= 2 * len(RIM)


def test_on_a_phone_a_slider_stands_below_what_it_moves(browser, address):
    seen = Page(browser, address, 390)
    places = seen.page.evaluate("""() => Object.fromEntries(
        [...document.querySelectorAll('.rapkm-panel, input')].map(e => {
            const { top, bottom } = e.getBoundingClientRect();
            return [e.id || e.style.gridArea.split(' ')[0], [top, bottom]]; }))""")
    for panel, names in {"machine": "xy", "offset": ["offset_1", "offset_2", "offset_3"], "run": ["time"]}.items():
        for name in names:
            assert 0 <= places[name][0] - places[panel][1] < 250
    # What has no handle in the picture stays in sight.
    seen.page.locator("#time").scroll_into_view_if_needed()
    assert seen.page.locator("#filter").bounding_box()["y"] >= 0 and seen.page.locator("#play").bounding_box()["y"] >= 0
    # A window that grows gets its sliders together again.
    seen.page.set_viewport_size({"width": 1000, "height": 900})
    seen.page.wait_for_function("document.querySelectorAll('#controls input').length === 6")
    assert seen.errors == []


@pytest.mark.parametrize("width", [360, 390, 1024])
def test_each_choice_of_the_filter_is_read_to_its_end(browser, address, width):
    """A list that may be as wide as it likes is as wide as its longest choice."""
    rooms = """() => {
        const list = document.getElementById("filter"), now = list.getBoundingClientRect().width;
        Object.assign(list.style, { width: "max-content", position: "absolute" });
        return [now, list.getBoundingClientRect().width]; }"""
    now, wanted = Page(browser, address, width).page.evaluate(rooms)
    assert now >= wanted - 0.5


@pytest.mark.parametrize("size", [(390, 844), (320, 256)])
def test_the_filter_at_the_top_covers_nothing_that_the_keyboard_comes_to(browser, address, size):
    seen = Page(browser, address, size[0])
    seen.page.set_viewport_size({"width": size[0], "height": size[1]})
    seen.page.wait_for_timeout(300)
    seen.page.evaluate("document.querySelector('footer pre').setAttribute('tabindex', 0)")
    seen.page.focus("footer pre")
    covered = """() => {
        const held = document.activeElement, deck = document.getElementById('deck');
        if (deck.contains(held) || held === document.body) return null;
        return held.getBoundingClientRect().top < deck.getBoundingClientRect().bottom; }"""
    for _ in range(11):
        seen.page.keyboard.press("Shift+Tab")
        seen.page.wait_for_timeout(100)
        assert seen.page.evaluate(covered) is False, seen.page.evaluate("document.activeElement.outerHTML")
    seen.page.keyboard.press("Shift+Tab")
    assert seen.page.evaluate("document.activeElement.id") == "play"


def test_letters_follow_the_size_that_the_browser_is_set_to(browser, address):
    size, sizes = "parseFloat(getComputedStyle(document.documentElement).fontSize)", {}
    for points in (16, 24):
        arguments = [*ARGUMENTS, f"--blink-settings=defaultFontSize={points}"]
        other = browser.browser_type.launch(executable_path=find_browser(), args=arguments)
        sizes[points] = Page(other, address).page.evaluate(size)
        other.close()
    assert sizes[24] > 1.2 * sizes[16]


@pytest.mark.parametrize("points", [24, 32])
def test_large_letters_on_a_phone_leave_the_machine_its_room_and_the_button_its_box(browser, address, points):
    arguments = [*ARGUMENTS, f"--blink-settings=defaultFontSize={points}"]
    other = browser.browser_type.launch(executable_path=find_browser(), args=arguments)
    page = Page(other, address, 390).page
    boxes = "['#deck', '#play', '.rapkm-plot'].map(e => document.querySelector(e).getBoundingClientRect())"
    deck, play, plot = page.evaluate(boxes)
    wide = page.evaluate("document.documentElement.scrollWidth")
    other.close()
    assert play["right"] <= deck["right"] and wide <= 390
    assert plot["height"] > 0.6 * plot["width"]


def test_the_numbers_are_those_of_the_package(browser, address):
    seen = Page(browser, address)
    robot, law = rk.load(), rk.PD(7.05, 0.225)
    path = rk.triangle(robot)
    runs = [rk.simulate(robot, each, path, OFFSET) for each in (law, rk.AntagonismFilter(law))]
    plain, filtered = (run.energy.sum() for run in runs)
    said = seen.page.inner_text("#said")
    assert f"{plain:.2f} J without" in said and f"{filtered:.2f} J with it" in said
    assert f"{100 * (1 - filtered / plain):.0f} % less" in said
    q = rk.inverse_kinematics(robot, [0.02, 0.05])
    torque = rk.steady_state_torque(rk.control_matrix(robot, q), 7.05, OFFSET)
    shown = seen.page.locator(".rapkm-numbers b").first.inner_text().replace("−", "-").removesuffix(" mN m")
    # (14) is of first order in the offsets, the page rests exactly.
    assert np.allclose([float(part) for part in shown.split(",")], 1e3 * torque, atol=0.15)
    seen.page.select_option("#filter", "true")
    seen.page.wait_for_timeout(200)
    assert seen.page.locator(".rapkm-numbers b").first.inner_text() == "0.0, 0.0, 0.0 mN m"
    seen.page.select_option("#filter", "off")
    for i in (1, 2, 3):
        seen.page.evaluate(f"(e => (e.value = 0, e.oninput()))(document.getElementById('offset_{i}'))")
    seen.page.wait_for_timeout(500)
    # Friction alone: 2.06 and 2.05 J.
    assert "hardly less" in seen.page.inner_text("#said")


def test_on_its_path_the_machine_is_taken_from_where_it_is(browser, address):
    """A key moves it by one step, also where the setting at rest is far away; sliders say where it is."""
    seen = Page(browser, f"{address}#20,50,8,-4,10,30,0,1")
    robot = rk.load()
    path = rk.triangle(robot)
    x = 1e3 * rk.simulate(robot, rk.PD(7.05, 0.225), path, OFFSET).x[1500]
    before = seen.places()
    assert np.allclose([before["x"], before["y"]], x, atol=0.6) and before["moving"]
    assert seen.page.evaluate("+document.getElementById('x').value") == before["x"]
    seen.page.locator(".rapkm-knob").first.focus()
    seen.page.keyboard.press("ArrowRight")
    seen.page.wait_for_function("!JSON.parse(document.querySelector('.rapkm').dataset.places).moving")
    after = seen.places()
    assert 0 < after["x"] - before["x"] <= 3 and abs(after["y"] - before["y"]) <= 1


# Frames whose time stamp is that of the frame before, and all numbers that were ever shown.
EARLY = """const next = requestAnimationFrame; window.all = [];
requestAnimationFrame = window.requestAnimationFrame = f => next(t => f(t - 20));
const see = () => all.push(document.querySelector('.rapkm-numbers')?.textContent ?? '');
addEventListener('DOMContentLoaded', () =>
    new MutationObserver(see).observe(document, { childList: true, subtree: true }));"""


def test_playing_shows_numbers_from_the_first_frame_on_and_a_hand_stops_it(browser, address):
    seen = Page(browser, address, script=EARLY)
    seen.page.click("#play")
    seen.page.wait_for_function("JSON.parse(document.querySelector('.rapkm').dataset.places).time > 0.3")
    assert not [words for words in seen.page.evaluate("all") if "NaN" in words] and seen.page.evaluate("all.length") > 5
    knob = seen.page.locator(".rapkm-knob.bare")
    knob.focus()
    seen.page.keyboard.press("ArrowRight")
    seen.page.wait_for_function("document.getElementById('play').textContent === 'Play the run'")
    assert seen.errors == []


def test_a_press_on_what_moves_stops_it(browser, address):
    seen = Page(browser, address)
    seen.page.click("#play")
    seen.page.wait_for_function("JSON.parse(document.querySelector('.rapkm').dataset.places).time > 0.1")
    seen.page.evaluate("""() => {
      const knob = document.querySelector('.rapkm-knob'), box = knob.getBoundingClientRect();
      const [clientX, clientY] = [box.left + box.width / 2, box.top + box.height / 2], plot = knob.parentElement;
      plot.setPointerCapture = () => {};
      plot.dispatchEvent(new PointerEvent('pointerdown',
        { clientX, clientY, button: 0, pointerId: 1, pointerType: 'mouse', bubbles: true }));
    }""")
    assert seen.page.inner_text("#play") == "Play the run"
    assert seen.places()["moving"] and seen.errors == []


def test_home_and_end_lead_to_the_ends(browser, address):
    seen = Page(browser, address)
    time = seen.page.locator(".rapkm-knob.bare")
    for key, wanted in (("End", 5), ("Home", 0)):
        time.focus()
        seen.page.keyboard.press(key)
        seen.wait("time", wanted)
    offset = seen.page.locator(".rapkm-knob").nth(1)
    offset.focus()
    seen.page.keyboard.press("End")
    seen.wait("offset_1", 8)


def test_page_down_turns_screens_that_are_seen_and_else_scrolls(browser, address):
    """A dashboard in another tab, or a key in a text that somebody writes, is none of its business."""
    seen = Page(browser, address)
    page = seen.page
    page.evaluate("""() => {
        const add = (tag, more) => document.body.appendChild(Object.assign(document.createElement(tag), more));
        for (const id of ["first", "second"]) add("div", { id, className: "rapkm-screen", style: "height: 100vh" });
        add("textarea", { value: "line\\n".repeat(200), rows: 5 });
        for (const screen of document.querySelectorAll(".rapkm-screen")) screen.style.display = "none";
    }""")
    text = page.locator("textarea")
    text.click()
    page.keyboard.press("PageDown")
    page.wait_for_function("document.querySelector('textarea').scrollTop > 0")
    page.evaluate("document.querySelectorAll('.rapkm-screen').forEach(e => e.style.display = 'block')")
    before = text.evaluate("e => e.scrollTop")
    page.keyboard.press("PageDown")
    page.wait_for_function("before => document.querySelector('textarea').scrollTop > before", arg=before)
    page.evaluate("document.activeElement.blur(); scrollTo(0, document.getElementById('first').offsetTop)")
    page.keyboard.press("PageDown")
    page.wait_for_function("Math.abs(document.getElementById('second').getBoundingClientRect().top) < 20")


def test_the_address_after_a_pause_is_what_is_seen(browser, address):
    seen = Page(browser, address)
    seen.page.click("#play")
    seen.page.wait_for_timeout(730)
    seen.page.click("#play")
    # On a busy machine a frame may be so late that an address is written while it still plays.
    steps = "Math.round(JSON.parse(document.querySelector('.rapkm').dataset.places).time / 0.05)"
    seen.page.wait_for_function(f"location.hash.endsWith(`,${{{steps}}},0,1`)")
    said, places = seen.page.inner_text(".rapkm-numbers"), seen.places()
    assert seen.page.locator(".rapkm-knob.bare").get_attribute("aria-valuenow") == f"{places['time']:g}"
    seen.open(seen.page.url)
    assert seen.page.inner_text(".rapkm-numbers") == said and seen.places()["time"] == places["time"]


def test_reduced_motion_steps_instead_of_playing(browser, address):
    seen = Page(browser, address, reduced_motion="reduce")
    seen.page.click("#play")
    seen.wait("time", 0.25)
    seen.page.wait_for_timeout(300)
    assert seen.places()["time"] == 0.25 and seen.places()["moving"]


@pytest.mark.parametrize("width", [500, 1400])
def test_paper_shows_the_picture_in_its_shape_and_no_controls(browser, address, width):
    seen = Page(browser, address, width)
    seen.page.emulate_media(media="print")
    controls = "[...document.querySelectorAll('form, input, select, button')]"
    assert seen.page.evaluate(f"{controls}.every(e => !e.getClientRects().length)")
    # Chromium lays out a page of paper without painting anew; then a canvas must not be stretched.
    fits = "[...document.querySelectorAll('canvas')].map(e => getComputedStyle(e).objectFit)"
    assert set(seen.page.evaluate(fits)) == {"contain"}
    heads = "[...document.querySelectorAll('.rapkm-panel')].map(e => ['.rapkm-head', '.rapkm-plot'].map("
    heads += "part => e.querySelector(part).getBoundingClientRect()).map((box, k) => k ? box.top : box.bottom))"
    assert all(above <= below + 0.1 for above, below in seen.page.evaluate(heads))
    # It then keeps within its place, whatever size that has on paper.
    seen.page.evaluate("document.querySelectorAll('.rapkm-plot').forEach(e => { e.style.width = '50%'; })")
    inside = "[...document.querySelectorAll('canvas')].every(e => e.clientWidth === e.parentElement.clientWidth)"
    assert seen.page.evaluate(inside)


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_words_are_dark_on_white_paper_whatever_the_screen(browser, address, scheme):
    seen = Page(browser, address, color_scheme=scheme)
    seen.page.emulate_media(media="print", color_scheme=scheme)
    for part in ("body", "pre"):
        style = seen.page.evaluate(f"Object.assign({{}}, getComputedStyle(document.querySelector('{part}')))")
        ink, paper = (max(map(int, re.findall(r"\d+", style[k])[:3])) for k in ("color", "backgroundColor"))
        assert ink < 64 and paper > 224


@pytest.mark.parametrize("width", [390, 1280])
def test_the_button_that_plays_is_called_what_it_does(browser, address, width):
    seen = Page(browser, address, width)
    assert seen.page.get_by_role("button", name="Play the run", exact=True).count() == 1


def test_a_finger_that_scrolls_the_page_sets_nothing(browser, address):
    seen = Page(browser, address, 390, has_touch=True, is_mobile=True)
    touch, before = seen.page.context.new_cdp_session(seen.page), seen.places()
    for name in ("x", "offset_1", "time"):
        seen.page.locator(f"#{name}").scroll_into_view_if_needed()
        box, top = seen.page.locator(f"#{name}").bounding_box(), seen.page.evaluate("scrollY")
        x, y = box["x"] + 0.9 * box["width"], box["y"] + box["height"] / 2
        for kind, up in [("Start", 0), *(("Move", 15 * k) for k in range(1, 13))]:
            touch.send("Input.dispatchTouchEvent", {"type": f"touch{kind}", "touchPoints": [{"x": x, "y": y - up}]})
        touch.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
        seen.page.wait_for_function("top => scrollY > top + 50", arg=top)
        seen.page.wait_for_timeout(300)
        assert seen.places() == before


def test_a_phone_that_is_turned_keeps_the_focus(browser, address):
    seen = Page(browser, address, 390)
    seen.page.focus("#offset_2")
    seen.page.set_viewport_size({"width": 844, "height": 390})
    seen.page.wait_for_function("document.querySelectorAll('#controls input').length === 6")
    assert seen.page.evaluate("document.activeElement.id") == "offset_2"
