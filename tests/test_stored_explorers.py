"""The stored pictures of explorers are those that the code draws today: what readers without a kernel see and hear."""

import ast
import base64
import io
import re
from pathlib import Path

import matplotlib
import nbformat
import numpy as np
import pytest
from PIL import Image

import rapkm_lite as rk
from rapkm_lite import explore

NOTEBOOKS = Path(__file__).parents[1] / "notebooks"
NUMBER = re.compile(r"\d+\.?\d*")


def stored():
    """Notebook, cell and data of every stored picture of an explorer."""
    for path in sorted(NOTEBOOKS.glob("*.ipynb")):
        notebook = nbformat.read(path, as_version=4)
        for k, cell in enumerate(notebook.cells):
            for output in cell.get("outputs", []):
                if output.get("data", {}).get("text/plain", "").startswith("Explorer("):
                    yield pytest.param(notebook, cell, output.data, id=f"{path.stem[:9]}-{k}")


def shown(notebook, cell):
    """The explorer that a cell shows, for the machine of its lesson."""
    names = {"explore": explore, "rk": rk, "display": lambda explorer: explorer}
    exec("\n".join(re.findall(r"^robot = .*", notebook.cells[1].source, re.M)), names)
    *before, last = ast.parse(cell.source).body
    exec(compile(ast.Module(before, []), "cell", "exec"), names)
    return eval(compile(ast.Expression(last.value), "cell", "eval"), names)


def grey(png):
    return np.asarray(Image.open(io.BytesIO(png)).convert("L"), dtype=int)


@pytest.mark.parametrize("notebook, cell, data", list(stored()))
def test_stored_pictures_are_those_of_the_code(notebook, cell, data):
    explorer = shown(notebook, cell)
    now, then = explorer.stored()["text/plain"], data["text/plain"]
    assert NUMBER.sub("0", now) == NUMBER.sub("0", then), "run notebooks/build.py for this notebook"
    numbers = (np.array(NUMBER.findall(words), dtype=float) for words in (now, then))
    np.testing.assert_allclose(*numbers, rtol=0.02, err_msg="run notebooks/build.py for this notebook")
    if tuple(map(int, matplotlib.__version__.split(".")[:2])) < (3, 11):
        pytest.skip("Matplotlib shaped its letters in another way before 3.11")
    now, then = grey(explorer.png), grey(base64.b64decode(data["image/png"]))
    assert now.shape == then.shape and np.mean(np.abs(now - then) > 60) < 1e-4, "run notebooks/build.py"
