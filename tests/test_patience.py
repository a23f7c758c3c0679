"""The word to the waiting user: seen in a terminal or a notebook, silent elsewhere, gone at the end."""

import io
import sys
import threading
import time
import types

import pytest

import rapkm_lite as rk
from rapkm_lite.simulation import patience as _patience


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.fixture
def terminal(monkeypatch):
    stream = Terminal()
    monkeypatch.setattr(_patience, "sys", types.SimpleNamespace(stderr=stream, modules=sys.modules))
    monkeypatch.setattr(_patience, "_notebook", lambda: False)
    return stream


@pytest.fixture
def notebook(monkeypatch):
    shown = []
    monkeypatch.setattr(_patience, "_notebook", lambda: True)

    def display(bundle, raw, display_id):
        shown.append((bundle, raw))
        return types.SimpleNamespace(update=display_again) if display_id else None

    def display_again(bundle, raw):
        shown.append((bundle, raw))

    monkeypatch.setattr("IPython.display.display", display)
    return shown


def slow(*kind, after=0.01):
    with _patience.patience(*kind, after=after):
        time.sleep(0.1)


def test_a_terminal_sees_one_line_that_is_wiped_out(terminal):
    slow("terminal")
    text = terminal.getvalue()
    assert "compiles its engine" in text and text.endswith(" \r") and "\n" not in text


def test_said_once_per_kind_and_only_when_it_takes_long(terminal):
    slow("once")
    slow("quick", after=60.0)
    said = terminal.getvalue()
    slow("once")
    assert terminal.getvalue() == said and said.count("compiles") == 1


def test_a_failed_call_is_not_remembered(terminal):
    with pytest.raises(ZeroDivisionError), _patience.patience("failed", after=60.0):
        raise ZeroDivisionError
    slow("failed")
    assert terminal.getvalue().count("compiles") == 1


def test_nothing_is_shown_where_nobody_looks(monkeypatch):
    stream = io.StringIO()
    monkeypatch.setattr(_patience, "sys", types.SimpleNamespace(stderr=stream, modules=sys.modules))
    monkeypatch.setattr(_patience, "_notebook", lambda: False)
    slow("file")
    with _patience.progress_bar(2) as advance:
        advance()
    assert stream.getvalue() == ""


def test_a_word_that_is_being_said_as_the_work_ends_is_taken_away(terminal, monkeypatch):
    begun, left = threading.Event(), []

    def show(text):
        begun.set()
        time.sleep(0.1)
        return lambda: left.append(text)

    monkeypatch.setattr(_patience, "_show", show)
    with _patience.patience("late", after=0.01):
        assert begun.wait(60.0)
    assert len(left) == 1


def test_a_notebook_sees_a_widget_without_text(notebook, monkeypatch):
    closed = []
    monkeypatch.setattr("ipywidgets.Widget.close", lambda widget: closed.append(widget.model_id))
    slow("notebook")
    (bundle, raw), last = notebook
    assert raw and list(bundle) == ["application/vnd.jupyter.widget-view+json"]
    # Version 2.0 is that of the view's form, not of ipywidgets.
    (view,) = bundle.values()
    assert view == {"version_major": 2, "version_minor": 0, "model_id": view["model_id"]}
    # Nothing is left for a page that is opened later, and no widget in the kernel.
    assert last == ({}, True) and closed == [view["model_id"]]


def test_a_bar_in_a_notebook_is_as_long_as_what_is_done(notebook, monkeypatch):
    bars, seen = [], []

    def bar(**options):
        bars.append(types.SimpleNamespace(value=0, model_id="bar", close=lambda: None, **options))
        return bars[-1]

    monkeypatch.setattr("ipywidgets.IntProgress", bar)
    for item in rk.progress(list("abcd")):
        seen.append((item, bars[0].value))
    assert seen == [("a", 0), ("b", 1), ("c", 2), ("d", 3)] and bars[0].value == bars[0].max == 4


def test_progress_counts_the_chunks(terminal, notebook, monkeypatch):
    with _patience.progress_bar(4) as advance:
        for _ in range(4):
            advance()
    assert len(notebook) == 2 and notebook[-1][0] == {}
    monkeypatch.setattr(_patience, "_notebook", lambda: False)
    with _patience.progress_bar(4) as advance:
        advance()
    assert "25 %" in terminal.getvalue() and terminal.getvalue().endswith(" \r")


def test_progress_is_written_a_hundred_times_at_most(terminal):
    with _patience.progress_bar(1000) as advance:
        for _ in range(1000):
            advance()
    shown = terminal.getvalue().split("\r")
    assert [text.split("] ")[1] for text in shown if text.startswith("runs")] == [f"{k} %" for k in range(1, 101)]


def test_what_cannot_be_counted_or_gone_through_is_refused():
    class Box:
        def __len__(self):
            return 3

    for items in (Box(), iter([1, 2]), 3):
        with pytest.raises(ValueError, match=r"items = .*; allowed: a list, tuple, array, dict or range"):
            rk.progress(items)


def test_without_a_thread_or_an_error_stream_nothing_is_said_and_nothing_lost(terminal, monkeypatch):
    """No thread is to be had at a limit of processes; a program without a console has no stream."""

    def refused(timer):
        raise RuntimeError("can't start new thread")

    done = []
    with monkeypatch.context() as poor:
        poor.setattr("threading.Timer.start", refused)
        with _patience.patience("poor", after=0.01):
            done.append(time.sleep(0.05))
    assert terminal.getvalue() == ""
    monkeypatch.setattr(_patience, "sys", types.SimpleNamespace(stderr=None, modules=sys.modules))
    with _patience.patience("console", after=0.01):
        done.append(None)
    assert len(done) == 2 and list(rk.progress([1, 2])) == [1, 2]


@pytest.mark.parametrize(
    "shell, found",
    [(None, False), (types.SimpleNamespace(kernel=None), False), (types.SimpleNamespace(kernel=1), True)],
)
def test_a_kernel_is_told_from_a_shell(monkeypatch, shell, found):
    monkeypatch.setitem(sys.modules, "IPython", types.SimpleNamespace(get_ipython=lambda: shell))
    assert _patience._notebook() is found
