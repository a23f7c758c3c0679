"""By hand: latency of the decentralized-run explorer in a real JupyterLab, next to `interact` with inline figures.

    python tests/bench/bench_explorer.py [names]

Prints for each: median time from the key press to the next painted picture, pictures per second while a slider is
dragged, and, where a picture has a handle, the same two for a hand that moves it.
"""

from __future__ import annotations

import statistics
import sys
import tempfile
from pathlib import Path

import nbformat
from playwright.sync_api import sync_playwright

sys.path.insert(0, str(Path(__file__).parents[1] / "browser"))
from lab import ARGUMENTS, Notebook, find_browser, server

KERNEL = {"kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"}}
EXPLORER = "from rapkm_lite import explore\nexplore.{name}()"
INTERACT = """import matplotlib.pyplot as plt, numpy as np, ipywidgets
import rapkm_lite as rk
from rapkm_lite import plotting
plotting.use_style()
robot = rk.load(); path = rk.triangle(robot); table = rk.measured_energies()
def show(offset_1=-5.0, offset_2=-6.0, offset_3=12.0, K_P=7.05):
    run = rk.simulate(robot, rk.PD(K_P, 0.225), path, 1e-3 * np.array([offset_1, offset_2, offset_3]))
    fig, axes = plt.subplots(1, 3, figsize=(9.4, 3.3))
    plotting.plot_torques(run, axes[0]); plotting.plot_errors(run, axes[1])
    plotting.plot_energies({"this run": run.energy, "Table 1": table[0]}, axes[2])
    plt.show()
slider = lambda v: ipywidgets.FloatSlider(v, min=-20, max=20, step=0.5)
ipywidgets.interact(show, offset_1=slider(-5.0), offset_2=slider(-6.0), offset_3=slider(12.0), K_P=(1.0, 50.0));"""

# Times at which a new picture beside the slider has been painted.
WATCH = """i => {
  window.painted = []; window.pressed = [];
  const area = lab.handles()[i].closest('.jp-Cell');
  const seen = e => requestAnimationFrame(() => setTimeout(() => painted.push(performance.now())));
  area.addEventListener('load', e => { if (e.target.tagName === 'IMG') seen(e); }, true);
  const root = area.querySelector('.rapkm');
  if (root) new MutationObserver(seen).observe(root, {attributeFilter: ['data-drawn']});
  document.addEventListener('keydown', () => pressed.push(performance.now()), true);
}"""


def measure(page, url: str, token: str, path: str) -> tuple[list[float], float, list | None]:
    """Latencies in ms of 25 key presses, pictures per second over a drag of 4 s, and both for a handle that is held."""
    notebook = Notebook(page, url, token, path)
    notebook.run_all()
    notebook.ask(WATCH, 0)
    notebook.ask("i => lab.focus(i)", 0)
    latencies = []
    for k in range(28):
        notebook.ask("() => { painted.length = pressed.length = 0; }")
        page.keyboard.press("ArrowRight" if k % 14 < 7 else "ArrowLeft")
        page.wait_for_function("() => painted.length > 0", timeout=20_000, polling=10)
        latencies.append(notebook.ask("() => painted[0] - pressed[0]"))
        notebook.settle()
        page.wait_for_timeout(150)
    box = page.locator(".jp-OutputArea .noUi-handle").first.bounding_box()
    track = page.locator(".jp-OutputArea .noUi-target").first.bounding_box()
    y = box["y"] + box["height"] / 2
    page.mouse.move(box["x"] + box["width"] / 2, y)
    page.mouse.down()
    notebook.ask("() => { painted.length = 0; window.began = performance.now(); }")
    steps = 0
    while notebook.ask("() => performance.now() - began") < 4000:
        steps += 1
        phase = abs((steps / 60) % 2 - 1)
        page.mouse.move(track["x"] + track["width"] * (0.05 + 0.9 * phase), y)
        page.wait_for_timeout(12)
    rate = notebook.ask("() => 1000 * painted.length / (performance.now() - began)")
    page.mouse.up()
    notebook.settle()
    grabbed = notebook.ask(GRAB)
    notebook.check()
    return latencies[3:], rate, grabbed


# A hand that moves the handle 25 times and waits for the picture, then circles for 4 s at the rate of the display.
GRAB = """async () => {
  const knob = document.querySelector('.rapkm-knob');
  if (!knob) return null;
  const box = knob.getBoundingClientRect(), panel = knob.parentElement;
  const [x, y] = [box.left + box.width / 2, box.top + box.height / 2];
  const send = (type, px, py) => panel.dispatchEvent(new PointerEvent(type,
    {clientX: px, clientY: py, button: 0, pointerId: 1, pointerType: 'mouse', bubbles: true}));
  panel.setPointerCapture = () => {};
  send('pointerdown', x, y);
  const latencies = [];
  for (let k = 0; k < 28; k++) {
    await new Promise(resolve => setTimeout(resolve, 150));
    painted.length = 0;
    const moved = performance.now();
    send('pointermove', x - 4 * (1 + k % 7), y);
    while (!painted.length && performance.now() - moved < 2000) await new Promise(resolve => setTimeout(resolve, 2));
    latencies.push(painted[0] - moved);
  }
  painted.length = 0;
  const began = performance.now();
  while (performance.now() - began < 4000) {
    await new Promise(requestAnimationFrame);
    const phase = (performance.now() - began) / 300;
    send('pointermove', x - 40 + 40 * Math.cos(phase), y + 40 * Math.sin(phase));
  }
  const rate = 1000 * painted.length / (performance.now() - began);
  panel.dispatchEvent(new PointerEvent('lostpointercapture', {pointerId: 1}));
  return [latencies.slice(3), rate];
}"""


def main(names: list[str]) -> None:
    cells = {name: EXPLORER.format(name=name) for name in names or ["machine", "decentralized_run"]}
    cells |= {} if names else {"interact": INTERACT}
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder) / "root"
        root.mkdir()
        for name, source in cells.items():
            notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(source)], metadata=KERNEL)
            nbformat.write(notebook, root / f"{name}.ipynb")
        with server(root, Path(folder)) as (url, token), sync_playwright() as p:
            browser = p.chromium.launch(executable_path=find_browser(), args=ARGUMENTS)
            for name in cells:
                page = browser.new_page(viewport={"width": 1280, "height": 1000})
                latencies, rate, grabbed = measure(page, url, token, f"{name}.ipynb")
                spread = f"{min(latencies):.0f} to {max(latencies):.0f}"
                median = statistics.median(latencies)
                print(f"{name:20s} key to picture {median:5.0f} ms ({spread}), dragged {rate:4.1f}/s", end="")
                if grabbed:
                    print(f", held {statistics.median(grabbed[0]):.0f} ms, {grabbed[1]:.1f}/s", end="")
                print(flush=True)
                page.close()
            browser.close()


if __name__ == "__main__":
    print(__doc__) if {"-h", "--help"} & {*sys.argv} else main(sys.argv[1:])
