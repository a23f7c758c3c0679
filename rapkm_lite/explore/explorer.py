"""An explorer: a draw function, its controls, a picture that can be taken in hand, and the numbers that matter."""

from __future__ import annotations

import inspect
import sys
import threading
import time
from collections.abc import Callable
from contextlib import contextmanager
from pathlib import Path

import anywidget
import ipywidgets as widgets
import traitlets
from IPython import display

from ..figures.marks import Picture, bundle, encode, png, scene
from ..machine.arguments import ConvergenceError, having, of_kind
from ..simulation.compiled import COMPILED
from ..simulation.runs import SimulationError
from .controls import Player, Shown, alone, follow, moved, parts, put, ranges, snap, tidied, written

HERE = Path(__file__).parent
# A slider that is dragged redraws at once as long as a step takes no more seconds than this.
PATIENCE = 0.3
# Older front ends, like Colab's, queue what a dragged slider sends.
_CONTINUOUS = int(widgets.__version__.split(".")[0]) >= 8


class Canvas(anywidget.AnyWidget):
    """The picture in the page."""

    _esm = (HERE / "stage.js").read_text(encoding="utf-8")
    _css = (HERE / "stage.css").read_text(encoding="utf-8")
    scene = traitlets.Dict().tag(sync=True)


def explorer(
    draw: Callable,
    controls: dict,
    panels: dict,
    *,
    layout=None,
    widths=None,
    size=(9.4, 3.3),
    setup=None,
    play: str | None = None,
    live: bool | None = None,
    about: str = "",
) -> Explorer:
    """Build an explorer from ``draw(picture, **controls)`` and draw it once; `problem` shows ValueErrors of `draw`.

    draw : puts marks into the `Picture`, and returns the numbers that matter, a dict of name -> text (or None).
    controls : name -> widget, from `slider`, `log_slider`, `choice`, `switch`, or any widget with a value; the names
        are the arguments of `draw` (a ``**rest`` takes what it does not name).
    panels, layout, widths, size, setup : see `Picture`.
    play : name of a whole-number slider that gets a play button.
    live : redraw while a slider is dragged, with ipywidgets 8 or later; by default where the engine is compiled.
    about : a sentence of what is to be seen, for those who do not see it; default the first line of the docstring of
        `draw`, or else of the function that it is local to.
    Raises ValueError, naming both, where controls and arguments of `draw` differ, and for a `play` of no whole numbers.

    >>> from rapkm_lite import explore
    >>> def draw(picture, gain):
    ...     picture.line("a", [0, 1], [0, gain])
    ...     return {"gain": f"{gain:g} N m/rad"}
    >>> explore.explorer(draw, {"gain": explore.slider("gain in N m/rad", 1, 9, 1, 5)}, {"a": {"xlabel": "time in s"}})
    Explorer(draw: gain = 5)
    """
    live = COMPILED if live is None else live
    return Explorer(draw, controls, Picture(panels, layout, widths, size, setup), play, live, about)


class Explorer:
    """Controls, picture and numbers; shown by ``display(explorer)``, as a plain picture where no kernel runs.

    controls : name -> widget.  picture : the `Picture`.  numbers : name -> text of the last step.
    problem : the sentence shown instead of a result, or "".  made : the call that makes it, in `code`.

    >>> from rapkm_lite import explore; explore.machine().set(x=0).code
    'explore.machine().set(x=0)'
    """

    def __init__(self, draw, controls: dict, picture: Picture, play: str | None, live: bool, about: str = ""):
        parts(draw, controls, play, live, about)
        of_kind("picture", picture, Picture, "a Picture")
        self.draw, self.controls, self.picture = draw, dict(controls), picture
        self._alone, self._left = threading.RLock(), {}
        # The draw function of a ready-made explorer is local to the function that bears its name.
        told = written(draw)
        self.name = told.__qualname__.split(".")[0]
        maker = getattr(sys.modules.get(told.__module__), self.name, told)
        self.about = about or (inspect.getdoc(told) or inspect.getdoc(maker) or "").split("\n")[0]
        self._defaults = self._first = self.values
        self.made, self._told, self._held, self._watched, self._slow = "explorer", {}, False, False, 0
        named = {"labels": {name: widget.description for name, widget in controls.items()}, "ranges": ranges(controls)}
        self.canvas = Canvas(scene=scene(picture) | {"name": self.name, "about": self.about, **named})
        self.canvas.on_msg(lambda _, content, buffers: self._message(content))
        cells, self._player = [], Player(controls[play]) if play else None
        for name, widget in self.controls.items():
            if hasattr(widget, "continuous_update"):
                widget.continuous_update = live and _CONTINUOUS
            widget.observe(self._changed, "value")
            widget.add_class("rapkm-control")
            cells += [self._player, widget] if name == play else [widget]
        button = widgets.Button(description="Reset", tooltip="back to the first setting", layout={"width": "90px"})
        button.on_click(lambda _: self.reset())
        grid = {"display": "grid", "grid_template_columns": "repeat(auto-fill, minmax(250px, 1fr))"}
        bar = widgets.Box([*cells, button], layout=grid | {"grid_gap": "2px 18px", "align_items": "flex-end"})
        self.widget = Shown([bar, self.canvas], layout={"max_width": "100%"})
        self.widget.add_class("rapkm-explorer")
        self.update()

    @property
    def values(self) -> dict:
        """The setting of every control."""
        return {name: tidied(widget.value) for name, widget in self.controls.items()}

    @property
    def code(self) -> str:
        """The line of Python that makes this explorer with this setting."""
        changed = [f"{k}={v!r}" for k, v in self.values.items() if v != self._defaults[k]]
        return f"{self.made}.set({', '.join(changed)})"

    @property
    def sentence(self) -> str:
        """What is to be seen, in words."""
        said = [self.about, self.problem, *(f"{name}: {text}." for name, text in self.numbers.items())]
        return " ".join(filter(None, said))

    @property
    def png(self) -> bytes:
        """The picture as it is stored."""
        return png(self.picture, self.problem)

    @alone
    def set(self, **values) -> Explorer:
        """Move controls from code and redraw once.

        Raises ValueError for an unknown control or a value outside its range.
        """
        with self._quiet():
            put(self.controls, values)
        self.update()
        self._send()
        return self

    def screen(self, question: str, answer: str) -> Explorer:
        """Show it as one screen of a projector: a question, the controls beside the picture, the answer on demand."""
        bar, canvas = self.widget.children
        bar.layout.grid_template_columns = "minmax(0, 1fr)"
        show, said = widgets.ToggleButton(layout={"width": "auto"}), widgets.HTML(f"<p>{answer}</p>")
        traitlets.dlink((show, "value"), (said.layout, "display"), lambda on: "block" if on else "none")
        traitlets.dlink((show, "value"), (show, "description"), lambda on: f"{'Hide' if on else 'Show'} the answer")
        beside = widgets.VBox([bar, show, said], layout={"flex": "0 0 300px"})
        self.widget.children = [widgets.HTML(f"<h2>{question}</h2>"), widgets.HBox([beside, canvas])]
        self.widget.add_class("rapkm-screen")
        return self

    def reset(self) -> None:
        """Back to the first setting, as it was shown first; what plays stops."""
        if self._player:
            self._player.back()
        self.set(**self._first)

    @alone
    def update(self) -> None:
        """Draw the present setting; a setting that cannot be computed is explained in the picture."""
        self.picture.begin()
        self.problem, start = "", time.perf_counter()
        try:
            told = self.draw(self.picture, **self.values) or {}
            self.numbers: dict[str, str] = having("what draw returns", told, "a dict of name -> text, or None", "items")
        except (ValueError, SimulationError, ConvergenceError) as error:
            self.problem, self.numbers = f"No result for this setting: {error}", {}
        for name in {name for handle in self.picture.handles for name in handle["set"]} - set(self.controls):
            raise KeyError(f"a handle moves {name!r}, which is no control; allowed: {', '.join(self.controls)}")
        # One slow step may be a cache that fills; from the second in a row on sliders wait for their release.
        self._slow = self._slow + 1 if time.perf_counter() - start > PATIENCE else 0
        if self._slow == 2:
            for widget in self.controls.values():
                if hasattr(widget, "continuous_update"):
                    widget.continuous_update = False

    def close(self) -> None:
        """Take box, picture and callbacks away; the controls may serve another explorer."""
        for widget in self.controls.values():
            widget.unobserve(self._changed, "value")
        self.canvas.close()
        self.widget.close()

    @contextmanager
    def _quiet(self):
        self._held = True
        try:
            yield
        finally:
            self._held = False

    @alone
    def _changed(self, change) -> None:
        owner, said, value, before = change["owner"], "", tidied(change["new"]), tidied(change["old"])
        # A browser rounds to steps of its own and sends back a value that differs in the last digit, at times too late.
        if self._held or value == before:
            self._left[owner, repr(before)] = self._held * time.monotonic()
            return
        if self._player and self._player.late(owner):
            return self.reset()
        late = value != change["new"] and time.monotonic() < self._left.get((owner, repr(value)), -1.0) + 1.0
        near = before if late else snap(owner, value)
        if near != value:
            said = "" if late or abs(near - value) < 1e-9 * owner.step else f"{value:g} was rounded to {near:g}"
            with self._quiet():
                owner.value = near
        self._step()
        self._send(note=said)

    def _step(self) -> None:
        """Update for the browser, where nobody sees a mistake of the draw function, nor that a slow one is at work."""
        if self._slow:
            self.widget.add_class("rapkm-busy")
        try:
            self.update()
        except Exception as error:
            self.problem, self.numbers = f"The picture cannot be drawn: {type(error).__name__}: {error}", {}
        self.widget.remove_class("rapkm-busy")

    @alone
    def _message(self, content: dict) -> None:
        """A page asks: "hello" from a new view, "still" from one that goes, "grab" with a hand's values or steps."""
        if content.get("kind") == "hello":
            self._told.clear()
            self._watched = True
            self._post({"kind": "fixed"}, self.picture.fixed)
            self._send()
        elif content.get("kind") == "still" and self._player:
            self._player.play.playing = False
        elif content.get("kind") == "grab":
            question = {"from": content.get("from"), "seq": content.get("seq")}
            try:
                wishes = {k: snap(self.controls[k], v) for k, v in (content.get("to") or {}).items()}
                wishes |= {k: moved(self.controls[k], n) for k, n in (content.get("by") or {}).items()}
                with self._quiet():
                    for name, value in wishes.items():
                        self.controls[name].value = value
                    self._step()
                    taken = [handle for handle in self.picture.handles if wishes.keys() & handle["set"].keys()]
                    if follow(taken, self.controls):
                        self._step()
                self._send(**question)
            except Exception:
                self.canvas.send({"kind": "lost", **question})
                raise

    def _send(self, **more) -> None:
        if self._watched:
            places = {k: v if isinstance(v, (int, float, str)) else str(v) for k, v in self.values.items()}
            said = {"numbers": list(self.numbers.items()), "problem": self.problem, "sentence": self.sentence}
            self._post({"kind": "picture", "places": places, "code": self.code, **said, **more}, self.picture.marks)

    def _post(self, message: dict, marks) -> None:
        header, buffers = encode(self.picture, marks, self._told)
        self.canvas.send(message | header, buffers)

    @alone
    def stored(self) -> dict:
        """The picture and its words as a MIME bundle, for readers without a kernel."""
        said = [repr(self), self.problem, *(f"{name}: {text}" for name, text in self.numbers.items())]
        return {**bundle(self.png, self.sentence), "text/plain": "\n".join(filter(None, said))}

    def _ipython_display_(self, **kwargs) -> None:
        """Two outputs: the stored picture, and the widget, which hides it as soon as a kernel has answered."""
        self._first = self._first if self._watched else self.values
        display.display(self.stored(), raw=True)
        display.display(self.widget)

    def __repr__(self):
        setting = ", ".join(f"{k} = {v:g}" if isinstance(v, float) else f"{k} = {v}" for k, v in self.values.items())
        return f"Explorer({self.name}: {setting})"
