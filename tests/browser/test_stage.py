"""The explorers in a real JupyterLab: every control by key and mouse, handles, themes, kernels that go."""

import inspect
import json

import nbformat
import numpy as np
import pytest
from lab import Notebook

from rapkm_lite import explore
from rapkm_lite.figures.marks import encode

NAMES = sorted(
    name
    for name, made in vars(explore).items()
    if inspect.isfunction(made) and list(inspect.signature(made).parameters) == ["robot"]
)
HANDLED = (
    "machine", "steady_state", "actuation", "landscape", "animation", "three_opinions", "allocation", "calibration",
)  # fmt: skip
WIDE = {"width": 1400, "height": 1000}
KERNEL = {"kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"}}
FAILING = """import time
from rapkm_lite import explore
def shy(picture, slope):
    picture.handle("a", 0.5, slope, slope=(0, 1))
    if slope > 3.5:
        time.sleep(6)
    elif slope > 2:
        raise RuntimeError("nobody expected this")
    picture.line("a", [0, 1], [0, slope])
slopes = {"slope": explore.slider("slope in m", 0.0, 4.0, 0.1, 1.0)}
explore.explorer(shy, slopes, {"a": {"ylim": (0, 4), "ylabel": "y in m"}})"""
# Long words in a corner.
SMALL = """import rapkm_lite as rk
from rapkm_lite import explore
explore.animation(rk.Manipulator(base=rk.load().base / 8, lengths=0.025, masses=0.002))"""
CELLS = {name: f"from rapkm_lite import explore\nexplore.{name}()" for name in NAMES} | {"shy": FAILING, "small": SMALL}
# Most tests share one notebook and its kernel; what ends a kernel or a page has a notebook of its own.
NOTEBOOKS = {"all": list(CELLS.values())} | {name: [source] for name, source in CELLS.items()}
NOTEBOOKS["twice"] = ["from rapkm_lite import explore\ne = explore.machine()\ndisplay(e)", "display(e)"]

SCRIPT = """
window.stage = {
  // What is seen of words: no space, nor one without width.
  said: words => (words ?? '').replace(/[\\s\\p{Cf}]+/gu, ' ').trim(),
  box: (k = 0) => document.querySelectorAll('.rapkm-explorer')[k],
  root: (k = 0) => document.querySelectorAll('.rapkm')[k],
  drawn: (k = 0) => Number(stage.root(k)?.dataset.drawn ?? 0),
  places: (k = 0) => JSON.parse(stage.root(k).dataset.places),
  controls: () => [...stage.box().querySelectorAll('.rapkm-control')].map(c => ({
    label: stage.said(c.querySelector('.widget-label')?.textContent) || stage.said(c.textContent),
    kind: c.querySelector('.noUi-handle') ? 'slider' : c.querySelector('select') ? 'choice' : 'switch',
    track: c.querySelector('.noUi-target')?.getBoundingClientRect().width ?? null,
    names: [...c.querySelectorAll('.noUi-handle, .widget-readout, select, input')].map(e => e.ariaLabel) })),
  named: () => stage.controls().every(c => c.names.length && c.names.every(stage.said)),
  note: () => stage.root().querySelector('.rapkm-note').textContent,
  part: (i, what) => stage.box().querySelectorAll('.rapkm-control')[i].querySelector(what),
  middle: e => { e.scrollIntoView({block: 'center'}); const b = e.getBoundingClientRect();
                 return [b.left + b.width / 2, b.top + b.height / 2, b.width]; },
  knob: (k = 0, n = 0) => stage.middle([...stage.root(k).querySelectorAll('.rapkm-knob:not([hidden])')][n]),
  // Resolves once the kernel is idle and no picture has come for a moment.
  still: async () => {
    let last = -1, since = 0;
    const drawn = () => [...document.querySelectorAll('.rapkm')].reduce((n, r) => n + Number(r.dataset.drawn ?? 0), 0);
    while (!lab.idle() || drawn() !== last || performance.now() - since < 120) {
      if (!lab.idle() || drawn() !== last) [last, since] = [drawn(), performance.now()];
      await new Promise(resolve => setTimeout(resolve, 20));
    }
    return stage.places();
  },
  // How many different colours the canvases show: a blank one has a single one.
  colours: () => [...stage.root().querySelectorAll('canvas')].map(c => c.width ? new Set(
    new Uint32Array(c.getContext('2d').getImageData(0, 0, c.width, c.height).data.buffer)).size : 0),
  // Numbers that lie over a bar, as left, top, right, bottom in px.
  covered: () => [...stage.root().querySelectorAll('canvas')].flatMap(c => painted.get(c)).flatMap(({ words, bars }) =>
    words.filter(w => bars.some(b => w[1] < b[2] - 1 && b[0] < w[3] - 1 && w[2] < b[3] - 1 && b[1] < w[4] - 1))),
};
// What has been written and which four corners have been filled on each canvas since it was wiped.
window.painted = new Map();
for (const [name, note] of Object.entries({
  clearRect: ({ canvas }) => painted.set(canvas, { words: [], bars: [] }),
  beginPath: context => (context.path = []),
  moveTo: ({ path }, x, y) => path?.push([x, y]),
  lineTo: ({ path }, x, y) => path?.push([x, y]),
  fill: ({ canvas, path }) => path?.length === 4 && painted.get(canvas)?.bars.push(
    [Math.min, Math.max].flatMap(end => [0, 1].map(k => end(...path.map(point => point[k]))))),
  fillText: (context, words, x, y) => painted.get(context.canvas)?.words.push(
    [words, x, y - 0.7 * parseFloat(context.font.match(/([\\d.]+)px/)[1]), x + context.measureText(words).width, y]),
})) {
  const kind = CanvasRenderingContext2D.prototype, once = kind[name];
  kind[name] = function (...given) { note(this, ...given); return once.apply(this, given); };
}
"""


@pytest.fixture(scope="module")
def site(laboratory):
    """JupyterLab with one notebook for each explorer."""
    folder, *address = laboratory
    (folder / "stage").mkdir()
    for name, sources in NOTEBOOKS.items():
        cells = [nbformat.v4.new_code_cell(source) for source in sources]
        nbformat.write(nbformat.v4.new_notebook(cells=cells, metadata=KERNEL), folder / "stage" / f"{name}.ipynb")
    return address


@pytest.fixture(scope="module")
def shown(browser, site):
    """A function that runs the cell of an explorer and waits for its picture, in a notebook of its own when `alone`."""
    pages = []

    def opened(name: str, scale: float = 1) -> Notebook:
        while pages:
            pages.pop().page.close()
        page = browser.new_page(viewport=WIDE, device_scale_factor=scale)
        page.add_init_script(SCRIPT)
        pages.append(Notebook(page, *site, f"stage/{name}.ipynb"))
        pages[0].ask("() => jupyterapp.shell.collapseLeft()")
        pages[0].name, pages[0].scale = name, scale
        return pages[0]

    def shown(name: str, scale: float = 1, alone: bool = False) -> Notebook:
        file = name if alone else "all"
        same = not alone and pages and (pages[0].name, pages[0].scale) == (file, scale)
        notebook = pages[0] if same else opened(file, scale)
        notebook.page.set_viewport_size(WIDE)
        if alone:
            notebook.run_all()
        else:
            notebook.ask("i => lab.runOnly(i)", list(CELLS).index(name))
        # Names for readers of the screen come when the picture rests.
        notebook.wait("() => stage.drawn() > 0 && stage.named()", 60)
        return notebook

    yield shown
    while pages:
        pages.pop().page.close()


def changed(notebook, act, seconds=20):
    """The setting after an act that must bring a new picture."""
    drawn, before = notebook.ask("() => stage.drawn()"), notebook.ask("() => stage.places()")
    act()
    notebook.wait(f"() => stage.drawn() > {drawn} && JSON.stringify(stage.places()) !== '{dumped(before)}'", seconds)
    return notebook.ask("() => stage.places()")


def dumped(value):
    return json.dumps(value, ensure_ascii=False, separators=(",", ":"))


def still(notebook):
    """The setting once nothing is on its way."""
    return notebook.ask("() => stage.still()")


def drag(notebook, start, way, steps=8):
    """Press at a pixel, move along (dx, dy) and let go."""
    mouse = notebook.page.mouse
    mouse.move(*start[:2])
    mouse.down()
    for k in range(1, steps + 1):
        mouse.move(start[0] + way[0] * k / steps, start[1] + way[1] * k / steps)
    mouse.up()


def use(notebook, i, kind):
    """Move control i by key and by mouse; each brings another picture."""
    page, control = notebook.page, notebook.page.locator(".rapkm-control").nth(i)
    if kind == "slider":
        notebook.ask("i => stage.part(i, '.noUi-handle').focus()", i)
        changed(notebook, lambda: page.keyboard.press("ArrowRight"))
        still(notebook)
        at = notebook.ask("i => stage.middle(stage.part(i, '.noUi-handle'))", i)
        left, _, wide = notebook.ask("i => stage.middle(stage.part(i, '.noUi-target'))", i)
        changed(notebook, lambda: drag(notebook, at, (-0.3 * wide if at[0] > left else 0.3 * wide, 0)))
    elif kind == "choice":
        first = notebook.ask("i => stage.part(i, 'select').selectedIndex", i)
        notebook.ask("i => stage.part(i, 'select').focus()", i)
        changed(notebook, lambda: page.keyboard.press("ArrowUp" if first else "ArrowDown"))
        changed(notebook, lambda: control.locator("select").select_option(index=first))
    else:
        changed(notebook, lambda: control.locator("input").press("Space"))
        changed(notebook, lambda: control.locator("input").click())
    still(notebook)


def named(notebook, name):
    """Labels, and names for readers of the screen, are the words that Python gave, to the letter."""
    controls = notebook.ask("() => stage.controls()")
    words = [widget.description for widget in getattr(explore, name)().controls.values()]
    # A label has an index where its words have a line below.
    assert [c["label"].replace("_", "") for c in controls] == [w.replace("_", "") for w in words]
    for control, word in zip(controls, words, strict=True):
        assert set(control["names"]) == {word}, control
    # Of a logarithmic slider the browser would tell the exponent.
    parts = "c => ['.noUi-handle', '.widget-readout'].map(part => c.querySelector(part))"
    told = f"() => [...stage.box().querySelectorAll('.rapkm-control')].map({parts})"
    assert notebook.ask(f"() => ({told})().every(([a, b]) => a?.ariaValueText === b?.textContent)")
    # A name belongs to a role: the number beside a slider, which can be typed, is a field.
    assert notebook.ask(f"() => ({told})().every(([, b]) => !b || b.role === 'textbox')")


def obeys_everywhere(notebook):
    """Every control by key and mouse, at three widths."""
    for width in (1400, 1024, 390):
        notebook.page.set_viewport_size({"width": width, "height": 1000})
        notebook.wait(f"() => innerWidth === {width}", 5)
        still(notebook)
        for i, control in enumerate(notebook.ask("() => stage.controls()")):
            assert control["kind"] != "slider" or control["track"] >= (160 if width == 1400 else 120), control
            use(notebook, i, control["kind"])
        wide, room = notebook.ask("() => [stage.root().scrollWidth, stage.root().clientWidth]")
        assert wide <= room


@pytest.mark.parametrize("name", NAMES)
def test_every_control_and_handle_obeys_key_and_mouse(name, shown):
    notebook = shown(name)
    named(notebook, name)
    obeys_everywhere(notebook)
    notebook.check()
    if name in HANDLED:
        agree(shown(name))


def agree(notebook):
    """Handle, sliders and kernel, after the handle was dragged and moved by keys."""
    before = notebook.ask("() => stage.places()")
    drag(notebook, notebook.ask("() => stage.knob()"), (70, -25))
    places = still(notebook)
    moved = {k for k in places if places[k] != before[k]}
    assert moved
    # Sliders read the same numbers, on a slow machine a moment later, and a knob tells the setting it stands for.
    names = json.dumps(sorted(moved))
    notebook.wait(
        f"""() => {{ const places = stage.places(), read = [...stage.box().querySelectorAll('.widget-readout')]
            .map(e => Number(e.textContent.replace('−', '-')));
            return {names}.every(name => read.some(v => Math.abs(v - places[name]) < 1e-6)); }}""",
        10,
    )
    places = still(notebook)
    text = notebook.ask("() => stage.root().querySelector('.rapkm-knob').ariaValueText")
    for control in moved:
        assert f": {places[control]}" in text
    # Keys on the knob, while the notebook is in command mode.
    again = changed(notebook, lambda: notebook.page.keyboard.press("ArrowLeft"))
    assert {k for k in again if again[k] != places[k]} <= set(moved)
    ends = [changed(notebook, lambda key=key: notebook.page.keyboard.press(key)) for key in ("Home", "End")]
    assert {k for k in moved if ends[0][k] < ends[1][k]}
    notebook.check()


def test_last_place_of_a_fast_hand_wins_and_is_clamped(shown):
    notebook = shown("machine")
    spot = """() => { const k = stage.root().querySelector('.rapkm-knob').getBoundingClientRect();
        const r = stage.root().getBoundingClientRect(); return [k.left - r.left, k.top - r.top]; }"""
    start = notebook.ask(spot)
    drag(notebook, notebook.ask("() => stage.knob()"), (900, 0), steps=40)
    places = still(notebook)
    out = notebook.ask(spot)
    # Stopped on the way from the middle of the drives, a little lower than the hand.
    assert 100 < places["x"] < 200 and out[0] > start[0] + 50 and abs(out[1] - start[1]) < 40
    assert notebook.ask("() => stage.root().querySelector('.rapkm-problem').hidden")
    drag(notebook, notebook.ask("() => stage.knob()"), (start[0] - out[0], start[1] - out[1]), steps=40)
    places = still(notebook)
    assert abs(places["x"] - 20) <= 4 and abs(places["y"] - 30) <= 4


# Contrast (WCAG 2) of the numbers of the drives, in the colour of the paper, to the discs that they are written on.
DISCS = """() => {
  const share = v => v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4;
  const shine = c => [0.2126, 0.7152, 0.0722].reduce((sum, w, k) => sum + w * share(c[k] / 255), 0.05);
  const canvas = stage.root().querySelector('canvas'), scale = devicePixelRatio;
  const paper = shine(getComputedStyle(stage.root()).backgroundColor.match(/\\d+/g));
  return painted.get(canvas).words.filter(([words]) => /^[123]$/.test(words)).map(([, x, y]) => {
    const disc = shine(canvas.getContext('2d').getImageData(scale * (x - 3), scale * (y + 3), 1, 1).data);
    return Math.max(disc, paper) / Math.min(disc, paper); }); }"""


def test_theme_leaves_no_canvas_blank_and_scale_two_is_sharp(shown):
    notebook = shown("machine", scale=2)
    assert all(
        notebook.ask("() => [...document.querySelectorAll('.rapkm canvas')].map(c => c.width === 2 * c.clientWidth)")
    )
    for theme in ("JupyterLab Dark", "JupyterLab Light"):
        notebook.ask("name => lab.theme(name)", theme)
        ink = "parseInt(getComputedStyle(stage.root().querySelector('.rapkm-numbers')).color.split('(')[1])"
        notebook.wait(f"() => {ink} {'>' if 'Dark' in theme else '<'} 128", 20)
        # The pixels follow: the corner of a canvas is paper, the numbers beside the axes are ink.
        notebook.wait("() => Math.min(...stage.colours()) > 10", 10)
        notebook.wait(f"() => ({DISCS})().length === 3 && Math.min(...({DISCS})()) >= 4.5", 10)


def test_saved_shut_down_and_reopened_shows_the_picture(shown):
    notebook = shown("landscape", alone=True)
    stored = "() => document.querySelector('img.rapkm-stored')?.getBoundingClientRect().height ?? 0"
    assert notebook.ask(stored) == 0
    notebook.ask("() => lab.save()")
    notebook.ask("() => lab.shutDown()")
    notebook.open()
    notebook.wait(f"() => ({stored})() > 150", 20)
    assert "energy" in notebook.ask("() => document.querySelector('img.rapkm-stored').alt")
    assert "Error displaying" not in notebook.ask("() => document.querySelector('.jp-OutputArea').innerText")


def test_failure_in_the_kernel_blocks_nobody(shown):
    notebook = shown("shy")
    drag(notebook, notebook.ask("() => stage.knob()"), (0, -120))
    assert still(notebook)["slope"] > 2
    assert "nobody expected this" in notebook.ask("() => stage.root().querySelector('.rapkm-problem').textContent")
    drag(notebook, notebook.ask("() => stage.knob()"), (0, 130))
    assert still(notebook)["slope"] < 2
    assert notebook.ask("() => stage.root().querySelector('.rapkm-problem').hidden")


def test_slow_answer_is_announced_and_awaited(shown):
    notebook = shown("shy")
    notebook.ask("() => stage.root().querySelector('.rapkm-knob').focus()")
    for _ in range(3):
        notebook.page.keyboard.press("Shift+ArrowUp")
    said = "() => stage.root().querySelector('.rapkm-note').textContent"
    notebook.wait(f"() => ({said})().startsWith('No answer yet')", 15)
    notebook.wait(f"() => stage.places().slope === 4 && ({said})() === ''", 15)
    # The next one is expected to be slow, too.
    notebook.page.keyboard.press("ArrowDown")
    notebook.wait("() => stage.box().classList.contains('rapkm-busy')", 5)
    notebook.wait("() => stage.places().slope < 4 && !stage.box().classList.contains('rapkm-busy')", 15)
    assert notebook.ask("() => stage.root().querySelector('.rapkm-problem').hidden")


def test_words_of_a_picture_stay_on_its_canvas(shown):
    notebook = shown("small")
    notebook.page.set_viewport_size({"width": 390, "height": 800})
    still(notebook)
    notebook.ask("""() => { const paint = CanvasRenderingContext2D.prototype; window.ends = {};
        const fill = paint.fillText; paint.fillText = function (words, x, y) {
          ends[words] = [x, x + this.measureText(words).width, this.canvas.clientWidth];
          fill.call(this, words, x, y); }; }""")
    changed(notebook, lambda: notebook.press(0, times=1))
    ends = notebook.ask("() => ends")
    assert any(words.endswith(" N") for words in ends)
    for words, (left, right, wide) in ends.items():
        assert -1 <= left and right <= wide + 1, (words, left, right, wide)


def test_a_finger_on_a_line_takes_it_and_beside_it_scrolls(shown):
    notebook = shown("three_opinions")
    page, touch = notebook.page, notebook.page.context.new_cdp_session(notebook.page)
    page.set_viewport_size({"width": 390, "height": 800})
    notebook.ask("() => stage.middle(stage.root().querySelector('.rapkm-plot'))")
    still(notebook)
    # Where a line can be taken far from its knob, and where there is nothing to take.
    places = """() => { const r = stage.root().querySelector('.rapkm-plot').getBoundingClientRect();
        const grid = [...Array(100).keys()].map(k => [r.left + r.width * (k % 10 + 1) / 11,
            r.top + r.height * (Math.floor(k / 10) + 1) / 11]);
        const knobs = [...stage.root().querySelectorAll('.rapkm-knob')].map(e => e.getBoundingClientRect());
        return grid.filter(([x, y]) => knobs.every(b => Math.hypot(x - b.left - 13, y - b.top - 13) > 50)); }"""
    cursors = {}
    for place in notebook.ask(places):
        page.mouse.move(*place)
        cursors[notebook.ask("() => stage.root().querySelector('.rapkm-plot').style.cursor")] = place
    assert set(cursors) == {"", "grab"}
    notebook.ask("() => { window.cancelled = 0; document.addEventListener('pointercancel', () => cancelled++, true); }")
    for cursor, taken in (("grab", True), ("", False)):
        x, y = cursors[cursor]
        before, cancelled = still(notebook), notebook.ask("() => cancelled")
        touch.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": [{"x": x, "y": y}]})
        for k in range(1, 13):
            touch.send("Input.dispatchTouchEvent", {"type": "touchMove", "touchPoints": [{"x": x, "y": y - 8 * k}]})
            page.wait_for_timeout(30)
        touch.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
        # A browser that begins to scroll takes the pointer away.
        assert (still(notebook) != before) is taken
        assert (notebook.ask("() => cancelled") == cancelled) is taken


def test_nothing_plays_where_less_motion_is_asked_for(shown):
    notebook = shown("animation")
    seen = "() => document.querySelector('.rapkm-explorer .widget-play').getClientRects().length"
    assert notebook.ask(seen) == 1
    notebook.page.emulate_media(reduced_motion="reduce")
    assert notebook.ask(seen) == 0
    notebook.page.emulate_media(reduced_motion="no-preference")


def test_tracks_and_buttons_are_seen_where_the_system_takes_only_its_own_colours(shown):
    notebook = shown("animation")
    # Forced colours leave borders and no backgrounds (CSS Color Adjustment, 3.1).
    bare = """() => [...stage.box().querySelectorAll('.noUi-base, button, select, input[type=text]')].filter(e =>
        e.getClientRects().length && parseFloat(getComputedStyle(e).borderTopWidth) === 0).map(e => e.className)"""
    notebook.page.emulate_media(forced_colors="active")
    assert notebook.ask(bare) == []
    notebook.page.emulate_media(forced_colors="none")


def test_reloaded_page_goes_on_with_the_kernel(shown):
    notebook = shown("machine", alone=True)
    changed(notebook, lambda: drag(notebook, notebook.ask("() => stage.knob()"), (-60, 40)))
    places = still(notebook)
    notebook.ask("() => lab.save()")
    notebook.open()
    notebook.wait("() => stage.drawn() > 0", 30)
    assert notebook.ask("() => stage.places()") == places
    changed(notebook, lambda: drag(notebook, notebook.ask("() => stage.knob()"), (40, -40)))


def test_two_views_stay_in_step(shown):
    notebook = shown("twice", alone=True)
    notebook.wait("() => stage.drawn(1) > 0", 20)
    for k in (0, 1):
        drag(notebook, notebook.ask("k => stage.knob(k)", k), (50, -20 + 60 * k))
        still(notebook)
        assert notebook.ask("() => stage.places(0)") == notebook.ask("() => stage.places(1)")
    assert notebook.ask("() => stage.drawn(0) - stage.drawn(1)") <= 2


def test_view_that_is_new_waits_for_what_was_told_before(browser):
    """A picture on its way to older views names a map that the new one does not know; "fixed" comes with all."""
    machine, told = explore.machine(), {}
    marks = [machine.picture.fixed, machine.picture.marks, machine.picture.marks]
    messages = []
    for kind, shown in zip(("fixed", "picture", "picture"), marks, strict=True):
        header, buffers = encode(machine.picture, shown, told)
        messages.append([{"kind": kind} | header, [np.frombuffer(b, "<f4").tolist() for b in buffers]])
    assert messages[1][0]["images"] and not messages[2][0]["images"]
    mounted = """async ([source, scene, messages]) => {
        const { mount } = await import(URL.createObjectURL(new Blob([source], { type: "text/javascript" })));
        let receive;
        mount(document.body, scene, { send: () => {}, receive: (callback) => (receive = callback) });
        return messages.map(([message, numbers]) => {
            receive(message, numbers.map((n) => Float32Array.from(n)));
            return Number(document.querySelector(".rapkm").dataset.drawn ?? 0);
        }); }"""
    page = browser.new_page()
    source, scene = machine.canvas._esm, machine.canvas.scene
    assert page.evaluate(mounted, [source, scene, messages[2:] + messages]) == [0, 0, 1, 2]
    page.close()


@pytest.mark.parametrize("end", ["restartKernel", "shutdown"])
def test_kernel_that_goes_leaves_the_picture_and_says_so(end, shown):
    notebook = shown("prestress", alone=True)
    notebook.ask("end => jupyterapp.shell.currentWidget.sessionContext[end]()", end)
    notebook.wait("() => /run the cell again/.test(stage.root().querySelector('.rapkm-note').textContent)", 20)
    assert min(notebook.ask("() => stage.colours()")) > 10


def test_setting_is_copied_as_code_and_a_rounded_number_says_so(shown):
    notebook = shown("machine")
    typed(notebook, "31")
    changed(notebook, lambda: notebook.page.keyboard.press("Enter"))
    notebook.wait("() => /^31 was rounded to /.test(stage.note())", 10)
    x = still(notebook)["x"]
    notebook.page.get_by_role("button", name="copy this setting").click()
    assert f"explore.machine().set(x={x})" in notebook.ask("() => stage.note()")
    notebook.wait(f"() => stage.root().querySelector('[aria-live]').textContent.includes('({x}, 30) mm')", 10)


@pytest.mark.parametrize("name", ["copy this setting", "Reset"])
def test_keys_on_a_button_do_not_edit_the_notebook(name, shown):
    """In JupyterLab's command mode m makes text of a cell, b adds one, dd takes it away, arrows leave it."""
    notebook = shown("machine")
    button = notebook.page.get_by_role("button", name=name)
    button.click()
    cells = "() => document.querySelectorAll('.jp-Cell').length"
    before = notebook.ask(cells)
    for key in ("ArrowDown", "m", "b", "d", "d"):
        notebook.page.keyboard.press(key)
    assert button.evaluate("button => button === document.activeElement")
    assert notebook.ask(cells) == before and notebook.ask("() => document.querySelectorAll('.rapkm.live').length") == 1


@pytest.mark.parametrize("part", [".noUi-handle", ".widget-readout", "select", ".rapkm-knob"])
def test_saving_is_saving_wherever_the_focus_is(part, shown):
    """Arrow keys are the explorer's; Ctrl+S is JupyterLab's."""
    notebook = shown("machine")
    dirty = "document.querySelector('.lm-TabBar-tab.lm-mod-current.jp-mod-dirty')"
    changed(notebook, lambda: notebook.page.locator(".rapkm-control select").first.select_option(index=1))
    notebook.wait(f"() => {dirty}", 10)
    place = notebook.page.locator(part).first
    place.focus()
    notebook.page.keyboard.press("Control+s")
    notebook.wait(f"() => !{dirty}", 20)
    if part in (".noUi-handle", ".rapkm-knob"):
        x = still(notebook)["x"]
        changed(notebook, lambda: notebook.page.keyboard.press("ArrowRight"))
        assert still(notebook)["x"] == x + 2


@pytest.mark.parametrize("part", [".noUi-handle", ".rapkm-control select", ".rapkm-knob", ".rapkm-foot button"])
def test_cell_is_run_wherever_the_focus_is(part, shown):
    """As with any slider of ipywidgets: Ctrl+Enter runs the selected cell."""
    notebook = shown("machine")
    notebook.ask("() => (window.ran = lab.cells().map(c => c.execution_count).join())")
    notebook.page.locator(part).first.focus()
    notebook.page.keyboard.press("Control+Enter")
    notebook.wait("() => lab.idle() && lab.cells().map(c => c.execution_count).join() !== ran", 20)


def typed(notebook, text, i=0):
    """Write a number beside a slider in place of the one that stands there."""
    notebook.page.locator(".widget-readout").nth(i).click()
    notebook.page.keyboard.press("Control+A")
    notebook.page.keyboard.press("Delete")
    notebook.page.keyboard.type(text)


def leave(notebook):
    """Click beside everything."""
    notebook.page.locator(".jp-NotebookPanel-toolbar").click(position={"x": 600, "y": 5})


@pytest.mark.parametrize("left", [False, True])
def test_note_says_how_a_number_was_read_that_was_typed_or_left(left, shown):
    notebook = shown("machine")
    enter = (lambda: leave(notebook)) if left else (lambda: notebook.page.keyboard.press("Enter"))
    written = [
        ("31", 32, "31 was rounded to 32"), ("abc", 32, "abc was not read, it stays 32"), ("40", 40, ""),
        ("3,5", 4, "3,5 was read as 4"),
        ("", 4, "an empty field was not read, it stays 4"), ("−31", -30, "−31 was rounded to −30"),
        ("999", 200, "999 was rounded to 200"), ("1e2", 100, ""), ("0", 0, ""),
    ]  # fmt: skip
    for text, x, note in written:
        typed(notebook, text)
        enter()
        # A note comes when the kernel has had its time.
        notebook.page.wait_for_timeout(600)
        seen = notebook.page.locator(".widget-readout").first.inner_text()
        assert (still(notebook)["x"], seen) == (x, str(x).replace("-", "−"))
        assert notebook.ask("() => stage.note()") == note
    # A right number, and then another control, wipe out what was said.
    typed(notebook, "71")
    enter()
    notebook.wait("() => stage.note() === '71 was rounded to 72'", 10)
    changed(notebook, lambda: notebook.page.locator(".rapkm-control select").first.select_option(index=1))
    notebook.wait("() => stage.note() === ''", 10)


def test_number_that_is_left_counts_and_the_focus_goes_where_the_hand_went(shown):
    notebook = shown("machine")
    keyboard, select = notebook.page.keyboard, notebook.page.locator(".rapkm-control select").first
    typed(notebook, "81")
    changed(notebook, select.focus)
    assert notebook.ask("() => document.activeElement === stage.part(2, 'select')")
    changed(notebook, lambda: keyboard.press("ArrowDown"))
    places = still(notebook)
    assert places["x"] == 82 and places["mode"] == "(+, +, −)"
    # Back to the slider with a new number, and on by a key.
    typed(notebook, "51")
    changed(notebook, lambda: keyboard.press("Shift+Tab"))
    assert notebook.ask("() => document.activeElement === stage.part(0, '.noUi-handle')")
    notebook.wait("() => stage.places().x === 52", 10)
    changed(notebook, lambda: keyboard.press("ArrowRight"))
    notebook.page.wait_for_timeout(600)
    assert still(notebook)["x"] == 54 and notebook.ask("() => stage.note()") == ""


def test_number_that_is_typed_while_the_one_before_is_read_counts(shown):
    notebook = shown("machine")
    typed(notebook, "81")
    notebook.page.keyboard.press("Enter")
    typed(notebook, "51")
    # The note on the first number would come now.
    notebook.page.wait_for_timeout(800)
    assert notebook.ask("() => stage.note()") == ""
    changed(notebook, lambda: leave(notebook))
    notebook.wait("() => stage.places().x === 52 && stage.note() === '51 was rounded to 52'", 10)


def test_no_note_where_nothing_was_typed_or_the_hand_has_moved_on(shown):
    notebook = shown("machine")
    for _ in range(3):
        notebook.page.locator(".widget-readout").first.click()
        notebook.page.keyboard.press("Shift+Tab")
        changed(notebook, lambda: notebook.page.keyboard.press("ArrowRight"))
        notebook.page.wait_for_timeout(600)
        assert notebook.ask("() => stage.note()") == ""
    typed(notebook, "81")
    at = notebook.ask("() => stage.middle(stage.part(0, '.noUi-handle'))")
    notebook.page.mouse.move(*at[:2])
    notebook.page.mouse.down()
    for k in range(12):
        notebook.page.mouse.move(at[0] - 3 * k, at[1])
        notebook.page.wait_for_timeout(60)
        assert "81" not in notebook.ask("() => stage.note()") or k < 4
    notebook.page.mouse.up()
    assert still(notebook)["x"] < 20 and notebook.ask("() => stage.note()") == ""


def test_numbers_after_a_drag_beyond_the_workspace_are_those_of_the_sliders(shown):
    notebook = shown("machine")
    drag(notebook, notebook.ask("() => stage.knob()"), (130, 210), steps=20)
    places = still(notebook)
    assert places["x"] > 100 and places["y"] < -100
    numbers = "() => [...stage.root().querySelectorAll('.rapkm-numbers span')].map(e => e.textContent)"
    wanted = [f"{name}: {text}" for name, text in explore.machine().set(**places).numbers.items()]
    assert [n.replace("−", "-") for n in notebook.ask(numbers)] == [w.replace("_", "") for w in wanted]


def test_wrong_setting_is_a_sentence_and_reset_goes_back(shown):
    notebook = shown("computed_torque")
    notebook.ask("() => stage.part(1, '.noUi-handle').focus()")
    changed(notebook, lambda: notebook.page.keyboard.press("End"))
    still(notebook)
    assert "left the workspace" in notebook.ask("() => stage.root().querySelector('.rapkm-problem').textContent")
    notebook.page.get_by_role("button", name="Reset").press("Enter")
    still(notebook)
    assert notebook.ask("() => stage.root().querySelector('.rapkm-problem').hidden")


def test_reset_while_playing_goes_back_and_a_cell_run_again_leaves_nothing_playing(shown):
    """Steps that are under way when it stops are not taken; a player whose view has gone asks for no more pictures."""
    notebook = shown("animation")
    first = notebook.ask("() => stage.places()")
    for _ in range(3):
        notebook.page.locator(".rapkm-explorer .widget-play button").first.click()
        notebook.wait(f"() => stage.places().time > {first['time'] + 300}", 20)
        notebook.page.get_by_role("button", name="Reset").press("Enter")
        notebook.page.wait_for_timeout(1500)
        assert notebook.ask("() => stage.places()") == first
    notebook.page.locator(".rapkm-explorer .widget-play button").first.click()
    notebook.wait(f"() => stage.places().time > {first['time']}", 20)
    notebook.ask("i => lab.runOnly(i)", list(CELLS).index("animation"))
    notebook.wait("() => stage.drawn() > 0 && stage.named()", 60)
    busy = """() => new Promise((done) => {
        const kernel = jupyterapp.shell.currentWidget.sessionContext.session.kernel;
        let count = 0;
        const counted = (_, status) => (count += status === "busy");
        kernel.statusChanged.connect(counted);
        setTimeout(() => (kernel.statusChanged.disconnect(counted), done(count)), 2000);
    })"""
    notebook.page.wait_for_timeout(1000)
    assert notebook.ask(busy) == 0


@pytest.mark.parametrize("name", ["decentralized_run", "calibration", "allocation", "steady_state"])
def test_no_number_lies_over_a_bar(name, shown):
    notebook = shown(name)
    still(notebook)
    bars = "() => [...painted.values()].reduce((n, { bars }) => n + bars.length, 0)"
    assert notebook.ask(bars) >= 6
    assert notebook.ask("() => stage.covered()") == []
    # Nor does the sentence for readers of the screen make room for a bar to scroll.
    boxes = "() => [...document.querySelectorAll('.rapkm-explorer')].map(e => e.scrollHeight - e.clientHeight)"
    assert max(notebook.ask(boxes)) <= 0


def test_the_sentence_of_a_problem_leaves_the_way_back_in_view(shown):
    notebook = shown("allocation")
    force = [control["label"] for control in notebook.ask("() => stage.controls()")].index("force fx in N")
    notebook.ask("i => stage.part(i, '.noUi-handle').focus()", force)
    changed(notebook, lambda: notebook.page.keyboard.press("End"))
    boxes = """() => [...stage.root().querySelectorAll('.rapkm-knob:not([hidden]), .rapkm-problem')].map(e => {
        const { left, top, right, bottom } = e.getBoundingClientRect(); return [left, top, right, bottom]; })"""
    sentence, *knobs = notebook.ask(boxes)
    assert len(knobs) == 2 and sentence[2] > sentence[0]
    for left, top, right, bottom in knobs:
        assert bottom < sentence[1] or top > sentence[3] or right < sentence[0] or left > sentence[2]
