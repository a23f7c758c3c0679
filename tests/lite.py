"""All lessons of a built JupyterLite site, top to bottom in headless Chromium: python -m tests.lite docs/_site/lite

Fails on a traceback, on a request to elsewhere, and on a slider that changes neither picture nor numbers: every slider
of every explorer is moved.  --only 03 takes one lesson; --cells 5 names the five slowest cells of each.
"""

from __future__ import annotations

import argparse
import functools
import http.server
import shutil
import sys
import threading
import time
from itertools import pairwise
from pathlib import Path

TYPES = {".wasm": "application/wasm", ".mjs": "text/javascript", ".whl": "application/octet-stream"}
PROMPTS = "[...document.querySelectorAll('.jp-CodeCell .jp-InputPrompt')].map(e => e.innerText)"
WAITING = f"{PROMPTS}.filter(t => t.includes('*')).length"
ERRORS = """[...document.querySelectorAll('.jp-OutputArea-output')].map(e => e.innerText)
    .filter(t => /Traceback \\(most|Error displaying widget|Failed to load model/.test(t)).map(t => t.slice(-400))"""
# The sliders that a reader can take: their labels, values and ends, by their place among all of the page.
SLIDERS = """() => [...document.querySelectorAll('.rapkm-explorer .noUi-handle')].map((e, place) => ({ place,
    label: e.closest('.rapkm-control')?.querySelector('.widget-label')?.textContent ?? '',
    shown: e.getClientRects().length > 0, ...Object.fromEntries(['now', 'min', 'max'].map(
        name => [name, Number(e.getAttribute('aria-value' + name))])) }))"""
# The canvases and the numbers of the explorer of a slider.
LOOK = """(place) => { const all = document.querySelectorAll('.rapkm-explorer .noUi-handle');
    const root = all[place].closest('.rapkm-explorer');
    return [...root.querySelectorAll('canvas')].map(c => c.toDataURL()).join()
        + root.querySelector('.rapkm-numbers')?.textContent + root.querySelector('.rapkm-problem')?.textContent; }"""
HANDLE = ".rapkm-explorer .noUi-handle"
# Nothing but this machine answers.
OFFLINE = "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1"


class Quiet(http.server.SimpleHTTPRequestHandler):
    extensions_map = http.server.SimpleHTTPRequestHandler.extensions_map | TYPES

    def log_message(self, *args):
        pass


def key(now: float, least: float, most: float, leaps: bool = True) -> str:
    """What moves a slider for certain: a leap to the side that has more room; one press is one picture.  On a dashboard
    a leap turns the screens, so there it is a step."""
    return ("Page" if leaps else "Arrow") + ("Up" if now - least <= most - now else "Down")


def idle_sliders(page, patience: float = 30.0, limit: float = 600.0) -> list[str]:
    """Move every slider of every explorer on a page; says which changed nothing within `patience` s, and what is left
    when `limit` s are over."""
    wrong, end = [], time.monotonic() + limit
    leaps = page.locator(".rapkm-screen").count() == 0
    for slider in page.evaluate(SLIDERS):
        name = f"slider {slider['place'] + 1}, {slider['label'] or 'without a label'},"
        if not slider["shown"]:
            continue
        if time.monotonic() > end:
            wrong.append(f"{name} and all after it had no turn within {limit:.0f} s")
            break
        before, handle = page.evaluate(LOOK, slider["place"]), page.locator(HANDLE).nth(slider["place"])
        handle.scroll_into_view_if_needed()
        # The first focus makes its cell the active one, and JupyterLab takes the focus there.
        handle.focus()
        page.wait_for_timeout(200)
        handle.press(key(slider["now"], slider["min"], slider["max"], leaps))
        try:
            page.wait_for_function(
                f"([place, before]) => ({LOOK})(place) !== before",
                arg=[slider["place"], before],
                timeout=1000 * patience,
                polling=100,
            )
        except Exception as error:
            if "Timeout" not in type(error).__name__:
                raise
            wrong.append(f"{name} changes nothing")
    return wrong


def drive(context, address: str, notebook: str, limit: float, cells: int = 0) -> list[str]:
    """What is wrong with a lesson; empty when all is well.  Prints its time, and its `cells` slowest cells."""
    wrong: list[str] = []
    page = context.new_page()
    page.set_default_timeout(120_000)
    # The kernel's worker asks too, not only the page.
    context.on("request", lambda r: None if r.url.startswith((address, "data:", "blob:")) else wrong.append(r.url))
    page.goto(f"{address}/lab/index.html?path={notebook}")
    page.wait_for_selector(".jp-Notebook .jp-Cell")
    page.wait_for_timeout(1500)
    if page.locator(".jp-Dialog .jp-mod-accept").count():
        page.click(".jp-Dialog .jp-mod-accept")
    page.click(".jp-Notebook .jp-Cell >> nth=0")
    page.click('text="Run" >> nth=0')
    page.click('.lm-Menu-item:has-text("Run All Cells") >> nth=0')
    started = time.monotonic()
    page.wait_for_function(f"{WAITING} > 0")
    count, ends = page.evaluate(WAITING), [started]
    while waiting := page.evaluate(WAITING):
        now = time.monotonic()
        ends += [now] * (count - waiting + 1 - len(ends))
        if now - started > limit:
            wrong.append(f"{waiting} cells still wait after {limit:.0f} s")
            break
        page.wait_for_timeout(200)
    ends += [time.monotonic()] * (count + 1 - len(ends))
    took = ends[-1] - started
    seconds = sorted(((b - a, k) for k, (a, b) in enumerate(pairwise(ends))), reverse=True)[:cells]
    slowest = "".join(f", {s:.0f} s in code cell {k + 1}" for s, k in seconds)
    wrong += idle_sliders(page, limit=limit)
    sliders = page.evaluate(SLIDERS)
    folded = sum(not slider["shown"] for slider in sliders)
    wrong += page.evaluate(ERRORS)
    said = "; ".join(wrong) or "well"
    print(f"{notebook}: run all {took:.0f} s{slowest}, {len(sliders)} sliders, {folded} folded, {said}", flush=True)
    # With its page alone a kernel would stay.
    context.close()
    return wrong


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("site", type=Path)
    parser.add_argument("--only", default="", help="beginning of a lesson's name")
    parser.add_argument("--limit", type=float, default=600.0, help="seconds for a lesson")
    parser.add_argument("--cells", type=int, default=0, help="how many of its slowest cells to name")
    options = parser.parse_args()
    from playwright.sync_api import sync_playwright

    handler = functools.partial(Quiet, directory=str(options.site))
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    address = f"http://127.0.0.1:{server.server_address[1]}"
    names = sorted(p.name for p in (options.site / "files").glob("*.ipynb") if p.name.startswith(options.only))
    with sync_playwright() as p:
        path = shutil.which("chromium") or shutil.which("chromium-browser")
        browser = p.chromium.launch(executable_path=path, args=["--no-sandbox", "--disable-dev-shm-usage", OFFLINE])
        bad = [
            n
            for n in names
            if drive(
                browser.new_context(viewport={"width": 1400, "height": 1000}), address, n, options.limit, options.cells
            )
        ]
        browser.close()
    print(f"{len(names) - len(bad)} of {len(names)} lessons run well")
    return 1 if bad or not names else 0


if __name__ == "__main__":
    sys.exit(main())
