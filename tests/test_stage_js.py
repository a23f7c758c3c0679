"""The canvas in JavaScript: its ticks, layout and decoding in Node, with a message that Python wrote."""

import base64
import json
import os
import shutil
import subprocess
import weakref
from pathlib import Path

import numpy as np
import pytest

from rapkm_lite import explore
from rapkm_lite.figures.marks import encode

HERE = Path(__file__).parent
STAGE = HERE.parent / "rapkm_lite" / "explore" / "stage.js"
SCREENS = {"machine": explore.machine, "actuation": explore.actuation}


@pytest.mark.parametrize("name", SCREENS)
def test_node_reads_what_python_writes(name, tmp_path):
    node = shutil.which("node")
    if node is None:
        pytest.skip("no node on the path (apt-get install nodejs)")
    picture = SCREENS[name]().picture
    # A map and a curve that a handle cannot leave come from different explorers, so one of each is added.
    if name == "actuation":
        palette = explore.Palette((0, 9), ("#888888",), ("#444444",))
        picture.image("plane", np.arange(6.0).reshape(2, 3), (0, 1, 0, 1), palette)
    marks = picture.fixed + picture.marks
    header, buffers = encode(picture, marks, {})
    wanted = [{"kind": m.kind, "points": m.data.astype(np.float32).ravel().tolist()} for m in marks]
    for w in wanted:
        w["points"] = [v if np.isfinite(v) else None for v in w["points"]]
    message = {"header": header, "buffers": [base64.b64encode(b).decode() for b in buffers], "marks": wanted}
    (tmp_path / "message.json").write_text(json.dumps(message))
    shutil.copy(STAGE, tmp_path / "stage.mjs")
    files = {"RAPKM_STAGE": "stage.mjs", "RAPKM_MESSAGE": "message.json"}
    environment = os.environ | {key: str(tmp_path / name) for key, name in files.items()}
    command = [node, "--test", str(HERE / "js" / "stage.test.mjs")]
    done = subprocess.run(command, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-4000:] + done.stderr[-2000:]


def decode(header: dict, buffers: list[bytes], styles: dict) -> list[tuple]:
    """The marks of a message as (kind, panel, style, numbers (k, 2)); new styles are added to `styles`."""
    styles |= header["styles"]
    numbers, marks, at = np.frombuffer(buffers[0], "<f4"), [], 0
    for kind, panel, style, count, *_ in header["marks"]:
        marks.append((kind, panel, styles.get(style), numbers[at : at + 2 * count].reshape(-1, 2)))
        at += 2 * count
    return marks


@pytest.mark.parametrize("name", SCREENS)
def test_encoding_goes_round(name):
    picture = SCREENS[name]().picture
    told, styles = {}, {}
    first, buffers = encode(picture, picture.marks, told)
    second, again = encode(picture, picture.marks, told)
    # Styles and maps are told once, numbers every time.
    assert first["styles"] and second["styles"] == {} == second["images"]
    assert buffers[0] == again[0]
    for header, sent in ((first, buffers), (second, again)):
        for mark, (kind, panel, style, numbers) in zip(picture.marks, decode(header, sent, styles), strict=True):
            assert (kind, panel) == (mark.kind, mark.panel)
            np.testing.assert_array_equal(numbers, mark.data.astype(np.float32))
            assert style is not None or kind in ("legend", "scale")


def test_a_map_goes_round_with_its_place_and_without_what_is_masked():
    palette = explore.Palette((0, 3, 9), ("#888888", "#777777"), ("#444444", "#333333"))
    values = np.ma.masked_equal(np.arange(6.0).reshape(2, 3), 4.0)
    picture = explore.Picture({"a": {}})
    picture.image("a", values, (-1, 2, 3, 5), palette)
    header, (_, sent) = encode(picture, picture.marks, {})
    number, look = header["marks"][0][4]
    assert header["images"] == {number: [2, 3, -1.0, 2.0, 3.0, 5.0]}
    np.testing.assert_array_equal(np.frombuffer(sent, "<f4").reshape(2, 3), values.filled(np.nan).astype(np.float32))
    assert look == {"levels": (0, 3, 9), "light": palette.light, "dark": palette.dark}


def test_a_map_that_was_told_is_kept_so_that_no_other_has_its_number():
    """An array that is gone leaves its place in memory, by which a map is known, to the next one."""
    palette, told = explore.Palette((0, 9), ("#888888",), ("#444444",)), {}
    picture, values = explore.Picture({"a": {}}), np.zeros((2, 3))
    picture.image("a", values, (0, 1, 0, 1), palette)
    encode(picture, picture.marks, told)
    alive = weakref.ref(values)
    del values
    picture.begin()
    assert alive() is not None
    picture.image("a", np.ones((2, 3)), (0, 1, 0, 1), palette)
    assert len(encode(picture, picture.marks, told)[0]["images"]) == 1


def test_words_and_handles_go_round():
    """A handle sets value = a x + b y + c, c may be missing; one that only goes sideways has no height."""
    picture, along = explore.Picture({"a": {}}), np.linspace([0.1, 0.0], [0.2, 1.0], 4) / 3
    picture.text("a", 0.5, 0.5, "in data")
    picture.text("a", 0.5, 0.5, "in the panel", inside=True)
    picture.title("a", "above")
    picture.handle("a", 0.5, None, gain=(2.0, 3.0), damping=(1.0, 0.0, -4.0))
    picture.handle("a", 0.1, 0.2, along=along, grip=[[0, 0], [1, 2]], time=[0, 1, 2, 3])
    header, _ = encode(picture, picture.marks, {})
    assert [mark[4] for mark in header["marks"]] == ["in data", "in the panel", "above"]
    assert header["handles"][0] == {
        "panel": "a", "at": [0.5, None], "set": {"gain": [2.0, 3.0, 0.0], "damping": [1.0, 0.0, -4.0]}
    }  # fmt: skip
    curve = header["handles"][1]
    assert curve["at"] == [0.1, 0.2] and curve["set"] == {"time": [0, 1, 2, 3]} and curve["grip"] == [[0, 0], [1, 2]]
    np.testing.assert_allclose(np.reshape(curve["along"], (4, 2)), along, rtol=0, atol=5e-7)
