"""The canvas in JavaScript: its ticks, layout and decoding in Node, with a message that Python wrote."""

import base64
import json
import os
import shutil
import subprocess
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
