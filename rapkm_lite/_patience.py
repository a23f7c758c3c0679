"""A word to the user while the engine compiles for the first time: seen, but in no stored output."""

from __future__ import annotations

import contextlib
import sys
import threading

_known = set()
_TEXT = "rapkm_lite compiles its engine for this kind of run; once, some seconds ..."


@contextlib.contextmanager
def patience(*kind, after: float = 0.7):
    """Show one line if the first call of this kind takes longer than `after` seconds, and take it away at its end.

    In a terminal the line is overwritten; in a notebook it is a widget that is closed, which leaves no text behind;
    anywhere else nothing is shown.
    """
    if kind in _known:
        yield
        return
    clear = []
    timer = threading.Timer(after, lambda: clear.append(_show()))
    timer.daemon = True
    timer.start()
    try:
        yield
        _known.add(kind)
    finally:
        timer.cancel()
        timer.join()
        for action in clear:
            action()


def _show():
    """Show the line and return the function that takes it away."""
    shell = sys.modules["IPython"].get_ipython() if "IPython" in sys.modules else None
    if getattr(shell, "kernel", None) is not None:
        from IPython.display import display
        from ipywidgets import Label

        label = Label(_TEXT)
        view = {"version_major": 2, "version_minor": 0, "model_id": label.model_id}
        display({"application/vnd.jupyter.widget-view+json": view}, raw=True)
        return label.close
    if sys.stderr is not None and sys.stderr.isatty():
        sys.stderr.write(_TEXT)
        sys.stderr.flush()
        return lambda: (sys.stderr.write("\r" + " " * len(_TEXT) + "\r"), sys.stderr.flush())
    return lambda: None
