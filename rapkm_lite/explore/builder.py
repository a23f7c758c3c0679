"""An explorer: a draw function, its controls, a live picture and the numbers that matter."""

from __future__ import annotations

import base64
import html
import inspect
import math
from collections.abc import Callable

import ipywidgets as widgets

from ..machine.arguments import ConvergenceError
from ..simulation.compiled import COMPILED
from ..simulation.runs import SimulationError
from .live import LivePicture

# As wide as the row allows: a long label leaves a short slider.
_LAYOUT = {"flex": "1 1 320px", "max_width": "420px", "min_width": "280px", "margin": "1px 12px 1px 0"}


def slider(label: str, low: float, high: float, step: float, value: float) -> widgets.Widget:
    """A slider; whole numbers when all four are.  The label names the unit."""
    whole = all(isinstance(v, int) for v in (low, high, step, value))
    kind = widgets.IntSlider if whole else widgets.FloatSlider
    digits = max(0, math.ceil(-math.log10(step) - 1e-9))
    form = {} if whole else {"readout_format": f".{digits}f"}
    return kind(value, min=low, max=high, step=step, description=label, **form, **_common())


def log_slider(label: str, low: float, high: float, value: float, steps: int = 40) -> widgets.Widget:
    """A slider with equal ratios, for gains: `steps` steps from about `low` to about `high`, one of them at `value`."""
    step = math.log10(high / low) / steps
    # A browser moves a value between two steps to the nearer one, so the steps are laid through the value.
    first = math.log10(value) - step * round(math.log10(value / low) / step)
    return widgets.FloatLogSlider(
        value,
        base=10,
        min=first,
        max=first + steps * step,
        step=step,
        description=label,
        readout_format=".3g",
        **_common(),
    )


def choice(label: str, options, value=None) -> widgets.Widget:
    """A drop-down list of words, or of (word, value) pairs."""
    options = list(options)
    first = options[0][1] if isinstance(options[0], tuple) else options[0]
    return widgets.Dropdown(options=options, value=first if value is None else value, description=label, **_common())


def switch(label: str, value: bool = False) -> widgets.Widget:
    """A box to tick."""
    return widgets.Checkbox(value, description=label, indent=False, **_common())


def _common() -> dict:
    return {"style": {"description_width": "initial"}, "layout": dict(_LAYOUT)}


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
) -> Explorer:
    """Build an explorer from ``draw(picture, **controls)`` and draw it once.

    draw : puts curves into the `LivePicture`, and returns the numbers that matter, a dict of name -> text (or None).
    controls : name -> widget, from `slider`, `log_slider`, `choice`, `switch`, or any widget with a value; the names
        are the arguments of `draw` (a ``**rest`` takes what it does not name).
    panels, layout, widths, size, setup : see `LivePicture`.
    play : name of a whole-number slider that gets a play button.
    live : redraw while a slider is dragged; default only with the compiled engine.
    Raises ValueError, naming both sides, when the controls and the arguments of `draw` differ.

    >>> from rapkm_lite import explore
    >>> def draw(picture, gain):
    ...     picture.line("a", [0, 1], [0, gain])
    ...     return {"gain": f"{gain:g} N m/rad"}
    >>> explore.explorer(draw, {"gain": explore.slider("gain in N m/rad", 1, 9, 1, 5)}, {"a": {"xlabel": "time in s"}})
    Explorer(draw: gain = 5)
    """
    parameters = list(inspect.signature(draw).parameters.values())[1:]
    names = [p.name for p in parameters if p.kind is not p.VAR_KEYWORD]
    rest = len(names) < len(parameters)
    if not set(names) <= set(controls) or (not rest and set(controls) - set(names)):
        raise ValueError(
            f"controls are named {', '.join(controls) or '(none)'}, but {draw.__name__} takes "
            f"{', '.join(names) or '(none)'} after the picture; allowed: the same names"
        )
    if play is not None and play not in controls:
        raise ValueError(f"play = {play!r}; allowed: one of {', '.join(controls)}")
    picture = LivePicture(panels, layout, widths, size, setup)
    return Explorer(draw, controls, picture, play, COMPILED if live is None else live)


class Explorer:
    """Controls, picture and numbers; shown by ``display(explorer)``, as a plain picture where no kernel runs.

    controls : name -> widget.  picture : the `LivePicture`.  numbers : name -> text of the last step.
    problem : the sentence shown instead of a result, or "".
    """

    def __init__(self, draw, controls: dict, picture: LivePicture, play: str | None, live: bool):
        self.draw, self.controls, self.picture = draw, dict(controls), picture
        self.numbers: dict[str, str] = {}
        self.problem = ""
        self._defaults = {name: widget.value for name, widget in controls.items()}
        self._held = False
        width = f"{self.picture.canvas.get_width_height()[0]}px"
        self._image = widgets.Image(format="png", layout={"max_width": "100%", "width": width, "object_fit": "contain"})
        self._words = widgets.HTML()
        button = widgets.Button(
            description="Reset", tooltip="back to the first setting", icon="undo", layout={"width": "90px"}
        )
        button.on_click(lambda _: self.reset())
        row = []
        for name, widget in self.controls.items():
            if hasattr(widget, "continuous_update"):
                widget.continuous_update = live
            widget.observe(self._changed, "value")
            if name == play:
                row.append(self._player(widget))
            row.append(widget)
        bar = widgets.Box([*row, button], layout={"display": "flex", "flex_flow": "row wrap", "align_items": "center"})
        self.widget = widgets.VBox([bar, self._image, self._words], layout={"max_width": "100%"})
        self.update()

    def _player(self, widget) -> widgets.Play:
        play = widgets.Play(
            widget.value,
            min=widget.min,
            max=widget.max,
            step=widget.step,
            interval=80,
            show_repeat=False,
            layout={"width": "120px"},
        )
        self._link = widgets.jslink((play, "value"), (widget, "value"))
        return play

    @property
    def values(self) -> dict:
        """The setting of every control."""
        return {name: widget.value for name, widget in self.controls.items()}

    def set(self, **values) -> Explorer:
        """Move controls from code and redraw once.

        Raises ValueError for an unknown control or a value outside its range.
        """
        for name, value in values.items():
            if name not in self.controls:
                raise ValueError(f"there is no control {name!r}; allowed: {', '.join(self.controls)}")
            self._check(name, self.controls[name], value)
        self._held = True
        try:
            for name, value in values.items():
                self.controls[name].value = value
        finally:
            self._held = False
        self.update()
        return self

    @staticmethod
    def _check(name: str, widget, value) -> None:
        if isinstance(widget, widgets.Dropdown):
            allowed = [option[1] if isinstance(option, tuple) else option for option in widget.options]
            if value not in allowed:
                raise ValueError(f"{name} = {value!r}; allowed: {', '.join(map(repr, allowed))}")
        elif hasattr(widget, "min"):
            low, high = (widget.base**b if hasattr(widget, "base") else b for b in (widget.min, widget.max))
            slack = 1e-12 * max(abs(low), abs(high))
            if not low - slack <= value <= high + slack:
                raise ValueError(f"{name} = {value!r}; allowed: {low:g} to {high:g}")

    def reset(self) -> None:
        """Back to the first setting."""
        self.set(**self._defaults)

    def update(self) -> None:
        """Draw the present setting; a setting that cannot be computed is explained in the picture."""
        self.picture.begin()
        self.problem = ""
        try:
            self.numbers = self.draw(self.picture, **self.values) or {}
        except (ValueError, SimulationError, ConvergenceError) as error:
            self.problem = f"No result for this setting: {error}"
            self.numbers = {}
            self.picture.sentence(self.problem)
        self._image.value = self.picture.png()
        self._words.value = self._html()

    @property
    def png(self) -> bytes:
        """The picture as it is shown."""
        return bytes(self._image.value)

    def close(self) -> None:
        """Take the widgets and their callbacks away."""
        for widget in self.controls.values():
            widget.unobserve(self._changed, "value")
        self.widget.close()

    def _changed(self, change) -> None:
        if not self._held:
            self.update()

    def _html(self) -> str:
        if self.problem:
            return f'<div role="status">{html.escape(self.problem)}</div>'
        items = "".join(
            f'<span style="margin-right:1.6em;white-space:nowrap">{html.escape(name)}: '
            f"<b>{html.escape(text)}</b></span> "
            for name, text in self.numbers.items()
        )
        return f'<div role="status" style="line-height:1.5">{items}</div>'

    def _repr_mimebundle_(self, include=None, exclude=None) -> dict:
        """One output: the widget where a kernel runs, the picture and its numbers elsewhere."""
        view = self.widget._repr_mimebundle_() or {}
        said = [self.problem] if self.problem else [f"{name}: {text}" for name, text in self.numbers.items()]
        picture = base64.b64encode(self.png).decode()
        return {**view, "image/png": picture, "text/plain": "\n".join([repr(self), *said])}

    def __repr__(self):
        setting = ", ".join(f"{k} = {v:g}" if isinstance(v, float) else f"{k} = {v}" for k, v in self.values.items())
        # The draw function of a ready-made explorer is local to the function that bears its name.
        return f"Explorer({self.draw.__qualname__.split('.')[0]}: {setting})"
