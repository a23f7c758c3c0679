"""A JupyterLab on a free port and one of its notebooks in a headless browser, driven as a reader would."""

from __future__ import annotations

import contextlib
import json
import os
import secrets
import shutil
import signal
import socket
import subprocess
import sys
import time
import urllib.request
from pathlib import Path

NOTEBOOKS = Path(__file__).parents[2] / "notebooks"
ARGUMENTS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-dev-shm-usage",
]
SETTINGS = {
    "@jupyterlab/docmanager-extension/plugin": {"autosave": False},
    # All outputs stay on the page, in view or not.
    "@jupyterlab/notebook-extension/tracker": {"windowingMode": "none"},
    "@jupyterlab/apputils-extension/notification": {"checkForUpdates": False, "fetchNews": "false"},
}

# What the page is asked; `panel` is the notebook in front.
SCRIPT = """
const panel = () => [...jupyterapp.shell.widgets('main')].find(w => w.content?.model?.cells && w.sessionContext);
window.lab = {
  save: () => panel().context.save(),
  shutDown: async () => { await panel().sessionContext.shutdown(); },
  theme: name => jupyterapp.commands.execute('apputils:change-theme', {theme: name}),
  ready: () => !!window.jupyterapp?.shell && !!panel()?.context.isReady && !!panel().sessionContext.session?.kernel,
  idle: () => panel().sessionContext.session?.kernel?.status === 'idle',
  runAll: () => jupyterapp.commands.execute('notebook:run-all-cells'),
  restartAndRunAll: async () => { await panel().sessionContext.restartKernel(); await window.lab.runAll(); },
  // Run one cell and empty the others.
  runOnly: async i => {
    const all = panel().content;
    all.widgets.forEach(cell => cell.model.type === 'code' && cell.model.clearExecution());
    all.activeCellIndex = i;
    await jupyterapp.commands.execute('notebook:run-cell');
  },
  cells: () => panel().content.widgets.filter(c => c.model.type === 'code').map(c => c.model.toJSON()),
  unrun: () => lab.cells().filter(c => c.source && !c.execution_count).length,
  tracebacks: () => [
    ...lab.cells().filter(c => !(c.metadata.tags || []).includes('raises-exception'))
      .flatMap(c => c.outputs).filter(o => o.output_type === 'error').map(o => o.ename + ': ' + o.evalue),
    ...[...panel().node.querySelectorAll('.jp-OutputArea-output')].map(e => e.innerText)
      .filter(t => /Traceback \\(most|Error displaying widget|Failed to load model|Error creating widget/.test(t))],
  // What a folded part hides nobody can take in hand.
  handles: () => [...panel().node.querySelectorAll('.jp-OutputArea .noUi-handle')]
    .filter(e => e.getClientRects().length),
  sliders: () => lab.handles().map(
    h => h.closest('.jupyter-widgets').querySelector('.widget-label')?.textContent ?? ''),
  focus: i => { const h = lab.handles()[i]; h.scrollIntoView({block: 'center'}); h.focus();
                return document.activeElement === h; },
  at: i => lab.handles()[i].getAttribute('aria-valuetext'),
  full: i => { const h = lab.handles()[i];
               return Number(h.getAttribute('aria-valuenow')) >= Number(h.getAttribute('aria-valuemax')); },
  pictures: i => [...lab.handles()[i].closest('.jp-Cell').querySelectorAll('.jp-OutputArea canvas')],
  // The pictures beside slider i as short fingerprints of their pixels.
  fingerprint: async i => (await Promise.all(lab.pictures(i).map(async e => {
    const bytes = new TextEncoder().encode(e.toDataURL());
    return [...new Uint8Array(await crypto.subtle.digest('SHA-1', bytes))].join('.');
  }))).join(' '),
};
"""


class Problem(AssertionError):
    """The page did not do what it was asked."""


def find_browser() -> str | None:
    """Path of a Chromium, or None."""
    return next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)


@contextlib.contextmanager
def server(root: Path, scratch: Path, application: str = "lab"):
    """A Jupyter server on `root` with settings of its own in `scratch`; gives (url, token)."""
    for name, value in SETTINGS.items():
        file = scratch / "settings" / f"{name}.jupyterlab-settings"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(json.dumps(value))
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        port = s.getsockname()[1]
    token, url = secrets.token_hex(16), f"http://127.0.0.1:{port}"
    folders = {
        "JUPYTERLAB_SETTINGS_DIR": "settings",
        "JUPYTERLAB_WORKSPACES_DIR": "workspaces",
        "JUPYTER_CONFIG_DIR": "config",
        "JUPYTER_RUNTIME_DIR": "runtime",
        "IPYTHONDIR": "ipython",
    }
    environment = os.environ | {key: str(scratch / folder) for key, folder in folders.items()}
    command = [
        sys.executable,
        "-m",
        "jupyter",
        application,
        "--no-browser",
        "--allow-root",
        "--ServerApp.ip=127.0.0.1",
        f"--ServerApp.port={port}",
        "--ServerApp.port_retries=0",
        f"--ServerApp.root_dir={root}",
        f"--IdentityProvider.token={token}",
        "--LabApp.expose_app_in_browser=True",
    ]
    log = scratch / "server.log"
    with log.open("wb") as file:
        process = subprocess.Popen(command, cwd=root, env=environment, stdout=file, stderr=file, start_new_session=True)
    try:
        direct = urllib.request.build_opener(urllib.request.ProxyHandler({}))
        for _ in range(300):
            if process.poll() is not None:
                raise Problem(f"jupyter {application} ended: {log.read_text(errors='replace')[-2000:]}")
            with contextlib.suppress(OSError):
                direct.open(f"{url}/api/status?token={token}", timeout=5).close()
                break
            time.sleep(0.2)
        yield url, token
    finally:
        # The kernels belong to the group that was started here.
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGTERM)
        try:
            process.wait(10)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait(10)


class Notebook:
    """One notebook, open on a page."""

    def __init__(self, page, url: str, token: str, path: str):
        self.page, self.address = page, f"{url}/lab/tree/{path}?reset&token={token}"
        page.add_init_script(SCRIPT)
        self.open()

    def open(self) -> None:
        """Load the page, for the first time or anew."""
        self.page.goto(self.address)
        self.wait("() => window.lab.ready()", 60)

    def wait(self, condition: str, seconds: float) -> None:
        """Wait until a function of the page is true."""
        self.page.wait_for_function(condition, timeout=1000 * seconds, polling=50)

    def ask(self, expression: str, argument=None):
        """Value of a function of the page."""
        return self.page.evaluate(expression, argument)

    def settle(self, seconds: float = 30) -> None:
        """Wait until the kernel has been idle for a moment."""
        quiet, end = 0, time.monotonic() + seconds
        while quiet < 4:
            if time.monotonic() > end:
                raise Problem(f"the kernel was busy for {seconds:g} s")
            quiet = quiet + 1 if self.ask("() => lab.idle()") else 0
            self.page.wait_for_timeout(60)

    def run_all(self, seconds: float = 120, restart: bool = False) -> None:
        """Run all cells; raises when one of them shows a traceback or does not run."""
        self.ask("() => lab.restartAndRunAll()" if restart else "() => lab.runAll()")
        self.settle(seconds)
        if self.ask("() => lab.unrun()"):
            self.check()
            raise Problem("not all cells ran")
        self.check()

    def check(self) -> None:
        """Raise when the page shows a traceback."""
        found = self.ask("() => lab.tracebacks()")
        if found:
            raise Problem("; ".join(found)[:2000])

    def sliders(self) -> list[str]:
        """Labels of all sliders on the page."""
        return self.ask("() => lab.sliders()")

    def press(self, i: int, key: str = "ArrowRight", times: int = 3, seconds: float = 20) -> None:
        """Move slider i by keyboard and wait until a picture beside it has other bytes."""
        label = self.sliders()[i]
        if not self.ask("i => lab.focus(i)", i):
            raise Problem(f"slider {label!r} does not take the keyboard focus")
        before, value = self.ask("i => lab.fingerprint(i)", i), self.ask("i => lab.at(i)", i)
        if not before:
            raise Problem(f"there is no picture beside slider {label!r}")
        for _ in range(times):
            self.page.keyboard.press({"ArrowRight": "ArrowLeft"}[key] if self.ask("i => lab.full(i)", i) else key)
        self.settle(seconds)
        if self.ask("i => lab.at(i)", i) == value:
            raise Problem(f"slider {label!r} stayed at {value}")
        end = time.monotonic() + seconds
        while self.ask("i => lab.fingerprint(i)", i) == before:
            if time.monotonic() > end:
                now = self.ask("i => lab.at(i)", i)
                raise Problem(f"slider {label!r} moved from {value} to {now}, the picture did not change")
            self.page.wait_for_timeout(50)
        self.check()
