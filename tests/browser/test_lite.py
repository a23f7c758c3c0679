"""What drives the lessons of a JupyterLite site, on the pages of a JupyterLab: every slider has its turn."""

import json
import sys
from pathlib import Path

import nbformat
import pytest
from lab import Notebook

sys.path.insert(0, str(Path(__file__).parents[2]))
from tests import lite

TWO = """from rapkm_lite import explore
def draw(picture, gain, idle):
    picture.line("a", [0, 1], [0, gain])
for start in (1.0, 4.0):
    controls = {"gain": explore.slider("gain in N m", 1.0, 4.0, 0.1, start), "idle": explore.slider("idle", 0, 9, 1, 3)}
    display(explore.explorer(draw, controls, {"a": {"ylim": (0, 5)}}))"""


@pytest.mark.parametrize(("now", "pressed"), [(0, "PageUp"), (5, "PageUp"), (6, "PageDown"), (10, "PageDown")])
def test_a_slider_leaps_to_where_there_is_room(now, pressed):
    assert lite.key(now, 0, 10) == pressed
    assert lite.key(now, 0, 10, leaps=False) == pressed.replace("Page", "Arrow")


def test_every_slider_of_every_explorer_has_its_turn_and_an_idle_one_is_named(browser, laboratory):
    folder, *address = laboratory
    cell = nbformat.v4.new_code_cell(TWO)
    kernel = {"kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"}}
    nbformat.write(nbformat.v4.new_notebook(cells=[cell], metadata=kernel), folder / "lite.ipynb")
    page = browser.new_page(viewport={"width": 1400, "height": 1000})
    notebook = Notebook(page, *address, "lite.ipynb")
    notebook.run_all()
    notebook.wait("() => document.querySelectorAll('.rapkm.live').length === 2", 30)
    wrong = lite.idle_sliders(page, patience=3)
    assert wrong == ["slider 2, idle, changes nothing", "slider 4, idle, changes nothing"]
    places = page.evaluate("() => [...document.querySelectorAll('.rapkm')].map(e => e.dataset.places)")
    gains = [json.loads(place)["gain"] for place in places]
    # One slider stood at its lower end, the other at its upper one.
    assert gains[0] > 1 and gains[1] < 4
    late = lite.idle_sliders(page, limit=-1)
    assert len(late) == 1 and "had no turn" in late[0]
    page.close()
