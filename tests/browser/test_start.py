"""The start page from disk: taken by mouse and keys, its address, its numbers, nothing asked from elsewhere."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest

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

    def __init__(self, browser, address, width=1280, **settings):
        self.page = browser.new_context(viewport={"width": width, "height": 900}, **settings).new_page()
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
    assert seen.requests == [] and seen.errors == []


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


def test_far_outside_it_stops_where_an_arm_is_nearly_stretched(browser, address):
    seen = Page(browser, address)
    for name, value in (("x", 150), ("y", 180)):
        seen.page.evaluate(f"(e => (e.value = {value}, e.oninput()))(document.getElementById('{name}'))")
    seen.page.wait_for_timeout(300)
    places = seen.places()
    assert rk.reachable(rk.load(), [1e-3 * places["x"], 1e-3 * places["y"]])
    assert seen.errors == []


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
    assert "no less" in seen.page.inner_text("#said")


def test_reduced_motion_steps_instead_of_playing(browser, address):
    seen = Page(browser, address, reduced_motion="reduce")
    seen.page.click("#play")
    seen.wait("time", 0.25)
    seen.page.wait_for_timeout(300)
    assert seen.places()["time"] == 0.25 and seen.places()["moving"]
