"""A word to the user while something takes time: seen, but in no stored output."""

from __future__ import annotations

import contextlib
import sys
import threading
from collections.abc import Callable, Iterator
from typing import Any

from ..machine.arguments import short

_known = set()
_TEXT = "rapkm_lite compiles its engine for this kind of run; once, some seconds ..."


def patience(*kind, after: float = 0.7) -> contextlib.AbstractContextManager:
    """Show one line if the first call of this kind takes longer than `after` seconds, and take it away at its end.

    In a terminal the line is overwritten; in a notebook it is a widget that is closed, which leaves no text behind;
    anywhere else nothing is shown.
    """
    if kind in _known or not (_notebook() or _in_terminal()):
        return contextlib.nullcontext()
    return _shown_after(kind, after)


@contextlib.contextmanager
def _shown_after(kind: tuple, after: float):
    clear = []
    timer = threading.Timer(after, lambda: clear.append(_show(_TEXT)))
    try:
        timer.start()
    except RuntimeError:  # no thread to be had: then without a word
        yield
        return
    try:
        yield
        _known.add(kind)
    finally:
        timer.cancel()
        timer.join()
        for action in clear:
            action()


def _notebook() -> bool:
    """True under a Jupyter kernel."""
    ipython = sys.modules.get("IPython")
    shell = None if ipython is None else ipython.get_ipython()
    return getattr(shell, "kernel", None) is not None


def _in_terminal() -> bool:
    return sys.stderr is not None and sys.stderr.isatty()


def _display(widget) -> Callable[[], None]:
    """Show a widget without the text that `display` would leave in the notebook; returns what takes it away.

    The output is emptied, too: a page that is shown later, or without a kernel, would look for the widget in vain.
    """
    from IPython.display import display

    view = {"version_major": 2, "version_minor": 0, "model_id": widget.model_id}
    shown: Any = display({"application/vnd.jupyter.widget-view+json": view}, raw=True, display_id=True)

    def leave() -> None:
        widget.close()
        shown.update({}, raw=True)

    return leave


def _terminal(text: str) -> None:
    """Write over the line of a terminal."""
    sys.stderr.write("\r" + text)
    sys.stderr.flush()


def _show(text: str):
    """Show the line and return the function that takes it away."""
    if _notebook():
        from ipywidgets import Label

        return _display(Label(text))
    _terminal(text)
    return lambda: _terminal(" " * len(text) + "\r")


def progress(items) -> Iterator:
    """The items one by one, with the bar of `sweep`, for studies of your own that no sweep can make.

    items : a list, tuple, array, dict or range; ValueError for what has no length, such as a generator.
    The bar is seen in a notebook or a terminal and leaves nothing behind.

    >>> import rapkm_lite as rk
    >>> [k**2 for k in rk.progress([1, 2, 3])]
    [1, 4, 9]
    """
    try:
        total = len(items)
        iter(items)
    except TypeError:
        raise ValueError(f"items = {short(items)}; allowed: a list, tuple, array, dict or range") from None
    return _counted(items, total)


def _counted(items, total: int) -> Iterator:
    with progress_bar(total) as advance:
        for item in items:
            yield item
            advance()


@contextlib.contextmanager
def progress_bar(total: int):
    """A bar over `total` chunks (0: none) that goes away at its end; yields the function that advances it."""
    done = 0
    notebook, terminal = total and _notebook(), total and _in_terminal()
    if notebook:
        from ipywidgets import IntProgress

        bar = IntProgress(max=total, description="runs")
        leave = _display(bar)

    def advance():
        nonlocal done
        done += 1
        if not total or 100 * done // total == 100 * (done - 1) // total:
            return  # nobody sees more than a hundred steps
        if notebook:
            bar.value = done
        elif terminal:
            _terminal(f"runs [{'#' * (40 * done // total):40}] {100 * done // total} %")

    try:
        yield advance
    finally:
        if notebook:
            leave()
        elif terminal:
            _terminal(" " * 60 + "\r")
