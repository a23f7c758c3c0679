"""The wheel beside the ipywidgets that Colab ships: every explorer is shown, every slider redraws when it is let go.

This builds a virtual environment of 700 MB, so it runs only where the environment variable RAPKM_LITE_COLAB is 1.
"""

import json
import os
import subprocess
import sys
import time
import venv
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(os.environ.get("RAPKM_LITE_COLAB") != "1", reason="RAPKM_LITE_COLAB is not 1")
ROOT = Path(__file__).parents[1]
COLAB = "7.7.1"
SHOW = """
import inspect, json, ipywidgets
from rapkm_lite import explore
made = {name: getattr(explore, name)() for name, maker in vars(explore).items()
        if inspect.isfunction(maker) and list(inspect.signature(maker).parameters) == ["robot"]}
sliders = {name: {word: [w.model_id, w.min if w.value > w.min else w.max, w.continuous_update]
                  for word, w in shown.controls.items() if hasattr(w, "step")} for name, shown in made.items()}
canvases = {name: shown.canvas.model_id for name, shown in made.items()}
print(json.dumps([ipywidgets.__version__, explore.__file__, sliders, canvases]))
"""


@pytest.fixture(scope="module")
def python(tmp_path_factory):
    """The interpreter of a new environment with the wheel, where ipywidgets was there first."""
    folder = tmp_path_factory.mktemp("colab")
    venv.create(folder / "venv", with_pip=True)
    python = folder / "venv" / ("Scripts" if os.name == "nt" else "bin") / "python"
    wheel = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--wheel-dir", str(folder), str(ROOT)]
    subprocess.run(wheel, check=True)
    install = [str(python), "-m", "pip", "install", "--quiet"]
    subprocess.run([*install, f"ipywidgets=={COLAB}"], check=True)
    subprocess.run([*install, f"{next(folder.glob('*.whl'))}[speed]"], check=True)
    return python


@pytest.fixture(scope="module")
def kernel(python, tmp_path_factory):
    """A client of a kernel in that environment, which takes the part of the page."""
    from jupyter_client.kernelspec import KernelSpec
    from jupyter_client.manager import KernelManager

    manager = KernelManager()
    manager._kernel_spec = KernelSpec(argv=[str(python), "-m", "ipykernel_launcher", "-f", "{connection_file}"])
    own = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "MPLBACKEND")}
    manager.start_kernel(env=own, cwd=str(tmp_path_factory.mktemp("cwd")))
    client = manager.client()
    client.start_channels()
    client.wait_for_ready(timeout=60)
    yield client
    client.stop_channels()
    manager.shutdown_kernel(now=True)


def answers(client, message_id, seconds=120):
    """All messages that a request brings until the kernel is idle again."""
    found, end = [], time.monotonic() + seconds
    while time.monotonic() < end:
        message = client.get_iopub_msg(timeout=seconds)
        if message["parent_header"].get("msg_id") != message_id:
            continue
        if message["msg_type"] == "status" and message["content"]["execution_state"] == "idle":
            return found
        assert message["msg_type"] != "error", "\n".join(message["content"]["traceback"])
        found.append(message)
    raise TimeoutError(f"the kernel was busy for {seconds} s")


def tell(client, model, data):
    """What the page says to a widget; gives the pictures that come back, by canvas."""
    message = client.session.msg("comm_msg", {"comm_id": model, "data": data})
    client.shell_channel.send(message)
    back = [m["content"] for m in answers(client, message["header"]["msg_id"]) if m["msg_type"] == "comm_msg"]
    return [c["comm_id"] for c in back if c["data"].get("content", {}).get("kind") == "picture"]


def test_explorers_live_on_the_ipywidgets_of_colab(kernel):
    said = "".join(
        m["content"]["text"] for m in answers(kernel, kernel.execute(SHOW)) if m["content"].get("name") == "stdout"
    )
    version, file, sliders, canvases = json.loads(said)
    # The wheel did not replace what was there, and it is the wheel that runs.
    assert version == COLAB and "site-packages" in file
    assert len(canvases) > 10
    for name, canvas in canvases.items():
        shown = [
            m["content"]["data"]
            for m in answers(kernel, kernel.execute(f"made[{name!r}]"))
            if m["msg_type"] == "display_data"
        ]
        # The stored picture stands first, for a page without widgets; then the widget.
        assert "image/png" in shown[0] and "application/vnd.jupyter.widget-view+json" in shown[1]
        assert canvas in tell(kernel, canvas, {"method": "custom", "content": {"kind": "hello"}})
        for word, (model, value, continuous) in sliders[name].items():
            assert continuous is False, (name, word)
            state = {"method": "update", "state": {"value": value}, "buffer_paths": []}
            assert tell(kernel, model, state) == [canvas], (name, word)
