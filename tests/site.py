"""All pages of a built site in headless Chromium, from disk and from a web server: python -m tests.site docs/_site

Fails on an outside request, a console error, a raw formula, a broken link or anchor, a picture without words,
horizontal scrolling and broken words of tables at 360 px, a box that the keyboard does not move or that the bar covers,
keys that do too much or too little, an open answer, and a search that finds nothing.  --shots FOLDER takes screenshots.
"""

from __future__ import annotations

import argparse
import functools
import http.server
import shutil
import sys
import threading
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlparse

from .lite import OFFLINE, Quiet

# Maths is set when MathJax has made a container for each formula.
READY = "() => document.querySelectorAll('mjx-container').length >= document.querySelectorAll('.math').length"
LOOK = r"""() => {
  const wrong = [], all = (what) => [...document.querySelectorAll(what)], words = document.body.cloneNode(true);
  if (document.documentElement.scrollWidth > innerWidth) wrong.push(`${document.documentElement.scrollWidth} px wide`);
  // The theme lets what lies in a page scroll on a narrow screen, all of it.
  const content = document.querySelector('.content');
  if (content?.scrollWidth > content?.clientWidth + 1) wrong.push(`${content.scrollWidth} px of content`);
  if (all('img').some((i) => !i.alt.trim())) wrong.push('picture without words');
  if (all('img').some((i) => i.complete && !i.naturalWidth)) wrong.push('broken picture');
  if (all('mjx-merror, [data-mjx-error]').length) wrong.push('formula with an error');
  words.querySelectorAll('pre, code, script, style, mjx-container').forEach((e) => e.remove());
  const raw = words.textContent.match(/\$[^$\n]{1,60}\$|\\[a-zA-Z]{3,}|\\\(/);
  if (raw) wrong.push(`raw formula ${raw[0]}`);
  for (const cell of all('article table :is(th, td)')) {
    const texts = document.createTreeWalker(cell, NodeFilter.SHOW_TEXT), range = document.createRange();
    for (let text; (text = texts.nextNode()); ) for (const word of text.data.matchAll(/[\p{L}\p{N}]+/gu)) {
      range.setStart(text, word.index);
      range.setEnd(text, word.index + word[0].length);
      if (new Set([...range.getClientRects()].map((box) => box.top)).size > 1) wrong.push(`broken word ${word[0]}`);
    }
  }
  if (all('[role="heading"]:not([aria-level])').length) wrong.push('heading without a level');
  if (all('h1').length !== 1) wrong.push(`${all('h1').length} titles`);
  for (const box of all('article :is(div, pre, table, mjx-container)')) {
    const moves = /auto|scroll/.test(getComputedStyle(box).overflowX) && box.scrollWidth > box.clientWidth + 1;
    // The keyboard comes to the box, or to something in it.
    const reached = box.closest('[tabindex="0"]') || box.querySelector('a, button, summary, [tabindex="0"]');
    if (moves && !reached) wrong.push(`${box.tagName} that only a mouse moves`);
  }
  if (all('details.hide[open], details.dig-deeper[open], article details[open]').length) wrong.push('an open answer');
  return wrong;
}"""
# Width, and whether dark.
VIEWS = [(width, dark) for width in (360, 1024, 1920) for dark in (False, True)]
SHOWN = (
    "contents",
    "lessons/00_start_here",
    "lessons/04_antagonism_filter_energy",
    "lessons/08_self_calibration",
    "lessons/11_choosing_a_controller",
    "lessons/12_your_machine",
    "lessons/solutions/07_synchronization",
    "lessons/equations",
    "reference/mechanics",
    "run",
)


class Page(HTMLParser):
    """Links and anchors of a page."""

    def __init__(self, text: str):
        super().__init__()
        self.links, self.names = [], []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        found = dict(attrs)
        self.names += [found["id"]] if found.get("id") else []
        self.links += [found[key] for key in ("href", "src") if found.get(key)]


def links(root: Path) -> list[str]:
    """Links and anchors that lead nowhere, and anchors that stand twice."""
    made = (path for path in root.rglob("*.html") if path.relative_to(root).parts[0] != "lite")
    pages, wrong = {path: Page(path.read_text(encoding="utf-8")) for path in made}, []
    for path, page in pages.items():
        here = path.relative_to(root)
        wrong += [f"{here}: two anchors {name}" for name in set(page.names) if page.names.count(name) > 1]
        for link in page.links:
            url = urlparse(link)
            if url.scheme or link.startswith("//"):
                continue
            target = (path.parent / unquote(url.path)).resolve() if url.path else path
            known = pages.get(target)
            if not target.exists() or (known and url.fragment and unquote(url.fragment) not in known.names):
                wrong.append(f"{here}: {link}")
    return wrong


def opened(context, base: str) -> tuple:
    """A new page, and a list of what its browser complains of and of what it asks from elsewhere."""
    page, wrong = context.new_page(), []
    page.on("request", lambda r: None if r.url.startswith((base, "data:", "blob:")) else wrong.append(r.url))
    page.on("console", lambda m: wrong.append(m.text) if m.type == "error" else None)
    page.on("pageerror", lambda e: wrong.append(str(e)))
    return page, wrong


def look(context, base: str, name: str, shots: Path | None) -> list[str]:
    """What is wrong with a page as a visitor sees it."""
    page, wrong = opened(context, base)
    page.goto(f"{base}/{name}")
    page.wait_for_function(READY)
    wrong += page.evaluate(LOOK)
    if shots:
        page.screenshot(path=shots / f"{name.replace('/', '_')}-{page.viewport_size['width']}.png")
    page.close()
    return [f"{base.split(':')[0]} {name}: {what}" for what in wrong]


def search(context, base: str) -> list[str]:
    """Type into the search box of a page; what is found is looked at on a telephone, the first of it opens.
    The number of an equation leads to it."""
    page, wrong = opened(context, base)
    page.goto(f"{base}/lessons/03_steady_state_antagonism.html")
    page.fill("input[name=q] >> nth=0", "antagonism")
    page.press("input[name=q] >> nth=0", "Enter")
    try:
        page.wait_for_selector("ul.search li a", timeout=60_000)
        page.wait_for_load_state("networkidle")
        page.set_viewport_size({"width": 360, "height": 740})
        wrong += page.evaluate(LOOK)
        page.click("ul.search li a >> nth=0")
        page.wait_for_selector("article h1")
        page.goto(f"{base}/search.html?q=(27)")
        page.wait_for_function("document.getElementById('search-results').textContent.includes('did not match')")
        if "did not match" in page.inner_text("article"):
            wrong.append("(27) is found and not found")
        page.click("h1 + p a")
        page.wait_for_selector("#eq-27:target", state="attached")
    except Exception as error:
        wrong.append(str(error).splitlines()[0])
    page.close()
    return [f"{base.split(':')[0]} search: {what}" for what in wrong]


def drawers(context, base: str) -> list[str]:
    """The lists at the sides of a narrow screen, by keys alone: open, the first link, closed and out of the way, also
    when the keyboard or a link goes on to the page."""
    page, wrong = opened(context, base)
    both = [(390, ".nav-overlay-icon", ".sidebar-drawer"), (390, ".toc-header-icon", ".toc-drawer")]
    for width, icon, drawer in [*both, (1100, ".toc-content-icon", ".toc-drawer")]:
        page.set_viewport_size({"width": width, "height": 800})
        page.goto(f"{base}/lessons/03_steady_state_antagonism.html")
        inside = f"document.querySelector('{drawer}').contains(document.activeElement)"
        hidden = f"getComputedStyle(document.querySelector('{drawer}')).visibility === 'hidden'"
        try:
            page.wait_for_function(hidden, timeout=5000)
            for key in ("Enter", "Space"):
                page.focus(f"button{icon}")
                page.keyboard.press(key)
                page.wait_for_function(inside, timeout=5000)
                page.keyboard.press("Escape")
                page.wait_for_function(hidden, timeout=5000)
                page.wait_for_function(f"document.activeElement.matches('{icon}')", timeout=5000)
            if drawer == ".toc-drawer":
                page.keyboard.press("Enter")
                page.wait_for_function(inside, timeout=5000)
                page.keyboard.press("Enter")  # the link to the first section
                page.wait_for_function(hidden, timeout=5000)
                page.focus(f"button{icon}")
            # What the keyboard comes to next is not covered.
            page.keyboard.press("Enter")
            page.wait_for_function(inside, timeout=5000)
            page.focus("article a:visible >> nth=0")
            page.wait_for_function(hidden, timeout=5000)
        except Exception:
            wrong.append(f"{drawer} is not opened and closed by keys")
    page.close()
    return [f"{base.split(':')[0]} drawers: {what}" for what in wrong]


def keys(context, base: str) -> list[str]:
    """Arrows move a box that is wider than its place, and turn the pages elsewhere; a letter or sign does nothing."""
    page, wrong = opened(context, base)
    page.set_viewport_size({"width": 1100, "height": 700})
    page.goto(f"{base}/lessons/03_steady_state_antagonism.html")
    page.wait_for_function(READY)
    page.keyboard.press("/")
    if page.evaluate("document.activeElement !== document.body"):
        wrong.append("the key / takes the focus")
    page.focus("article pre[tabindex='0'] >> nth=0")
    page.keyboard.press("ArrowRight")
    try:
        page.wait_for_function("document.activeElement.scrollLeft > 0", timeout=5000)
        page.evaluate("document.activeElement.blur()")
        page.keyboard.press("ArrowRight")
        page.wait_for_url("**/04_*.html", timeout=5000)
    except Exception:
        wrong.append(f"after arrows in a wide box, and outside of it: {page.url}")
    page.close()
    return [f"{base.split(':')[0]} keys: {what}" for what in wrong]


def covered(context, base: str) -> list[str]:
    """What lies under the bar at the top of a telephone when the keyboard comes to it, from the foot of a page on."""
    page, wrong = opened(context, base)
    page.set_viewport_size({"width": 390, "height": 700})
    page.goto(f"{base}/lessons/04_antagonism_filter_energy.html")
    page.wait_for_function(READY)
    page.focus("article > :last-child a >> nth=-1")
    under = "(b => b.top < document.querySelector('.mobile-header').getBoundingClientRect().bottom)"
    for _ in range(16):
        page.keyboard.press("Shift+Tab")
        page.wait_for_timeout(400)  # the page glides
        if page.evaluate(f"{under}(document.activeElement.getBoundingClientRect())"):
            wrong.append(f"the bar covers {page.evaluate('document.activeElement.outerHTML')[:80]}")
    page.close()
    return [f"{base.split(':')[0]} bar: {what}" for what in wrong]


def pictures(browser, base: str, shots: Path) -> list[str]:
    """What is wrong with the pages that are shown most, at three widths, light and dark, while they are drawn."""
    wrong = []
    for width, dark in VIEWS:
        size = {"width": width, "height": width * 3 // 4 + 300}
        context = browser.new_context(viewport=size, color_scheme="dark" if dark else "light")
        folder = shots / ("dark" if dark else "light")
        folder.mkdir(parents=True, exist_ok=True)
        wrong += [what for name in ("index", *SHOWN) for what in look(context, base, f"{name}.html", folder)]
        context.close()
    return wrong


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("site", type=Path)
    parser.add_argument("--shots", type=Path, help="folder for screenshots at three widths, light and dark")
    options = parser.parse_args()
    from playwright.sync_api import sync_playwright

    root = options.site.resolve()
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=str(root)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    bases = root.as_uri(), f"http://127.0.0.1:{server.server_address[1]}"
    names = sorted(str(path.relative_to(root).as_posix()) for path in root.rglob("*.html"))
    names = [name for name in names if not name.startswith("lite/")]
    wrong = links(root)
    with sync_playwright() as p:
        path = shutil.which("chromium") or shutil.which("chromium-browser")
        browser = p.chromium.launch(executable_path=path, args=["--no-sandbox", OFFLINE])
        for base in bases:
            context = browser.new_context(viewport={"width": 360, "height": 740})
            context.set_default_timeout(90_000)
            wrong += [what for name in names for what in look(context, base, name, None)]
            wrong += search(browser.new_context(viewport={"width": 1280, "height": 800}), base)
            wrong += drawers(context, base)
            wrong += keys(context, base)
            wrong += covered(context, base)
            context.close()
        wrong += pictures(browser, bases[0], options.shots) if options.shots else []
        browser.close()
    print("\n".join(wrong) or f"{len(names)} pages, from disk and from a web server: well")
    return 1 if wrong or not names else 0


if __name__ == "__main__":
    sys.exit(main())
