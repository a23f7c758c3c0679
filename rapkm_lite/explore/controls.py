"""Controls of an explorer: ipywidgets with a label above the track, and how a value of the picture reaches them."""

from __future__ import annotations

import functools
import inspect
import math
import time
from collections.abc import Callable, Collection
from typing import Any

import ipywidgets as widgets
import numpy as np

from ..machine.arguments import exact_array, function, having, of_kind, positive_number, real_array, short, whole_number
from ..machine.arguments import switch as truth
from ..machine.manipulator import Manipulator

# A widget from elsewhere may have ends, too, but no steps of numbers.
SLIDERS: Any = (widgets.IntSlider, widgets.FloatSlider, widgets.FloatLogSlider)
_COMMON: dict = {"style": {"description_width": "initial"}, "layout": {"width": "auto", "margin": "2px 0"}}


def slider(label: str, low: float, high: float, step: float, value: float) -> widgets.Widget:
    """A slider; whole numbers when all four are.  The label names the unit.

    Raises ValueError unless low < high, low <= value <= high and step > 0.

    >>> from rapkm_lite import explore; explore.slider("offset in mrad", -10, 10, 1, 4).value
    4
    """
    _within(low, high, value)
    positive_number("step", step)
    whole = all(isinstance(v, int | np.integer) for v in (low, high, step, value))
    kind = widgets.IntSlider if whole else widgets.FloatSlider
    digits = max(0, math.ceil(-math.log10(step) - 1e-9))
    digits += not math.isclose(round(step, digits), step, rel_tol=1e-9)  # 0.25 has one more than 0.2
    form = {} if whole else {"readout_format": f".{digits}f"}
    return kind(value, min=low, max=high, step=step, description=label, **form, **_COMMON)


def log_slider(label: str, low: float, high: float, value: float, steps: int = 40) -> widgets.Widget:
    """A slider with equal ratios, for gains: `steps` steps from about `low` to about `high`, one of them at `value`.

    Raises ValueError unless 0 < low < high, low <= value <= high and steps >= 1.

    >>> from rapkm_lite import explore; round(explore.log_slider("K_P in N m/rad", 0.1, 100.0, 7.05).value, 2)
    7.05
    """
    positive_number("low", low)
    _within(low, high, value)
    step = math.log10(high / low) / whole_number("steps", steps, 1)
    # A browser moves a value between two steps to the nearer one, so the steps are laid through the value.
    first = math.log10(value) - step * round(math.log10(value / low) / step)
    ends = {"base": 10, "min": first, "max": first + steps * step, "step": step}
    return widgets.FloatLogSlider(value, description=label, readout_format=".3g", **ends, **_COMMON)


def choice(label: str, options, value=None) -> widgets.Widget:
    """A drop-down list of words, or of (word, value) pairs; ValueError for a `value` that is no option.

    >>> from rapkm_lite import explore; explore.choice("drive", ["1", "2", "3"]).value
    '1'
    """
    if isinstance(options, str | bytes) or not isinstance(options, Collection) or len(options) == 0:
        raise ValueError(f"options = {short(options)}; allowed: a list of words, or of (word, value) pairs")
    widget = widgets.Dropdown(options=list(options), description=label, **_COMMON)
    if value is not None:
        check("value", widget, value)
        widget.value = value
    return widget


def switch(label: str, value: bool = False) -> widgets.Widget:
    """A box to tick.

    >>> from rapkm_lite import explore; explore.switch("filter").value
    False
    """
    return widgets.Checkbox(truth("value", value), description=label, indent=False, **_COMMON)


def offset_sliders(robot: Manipulator, values, limit: int = 20) -> dict:
    """One slider per drive, offset_1, offset_2, ..., in mrad; `values` are cut or repeated to as many.

    Raises ValueError for values beyond +-`limit`.

    >>> import rapkm_lite as rk; from rapkm_lite import explore
    >>> sorted(explore.offset_sliders(rk.load(), [4, -2, 5]))
    ['offset_1', 'offset_2', 'offset_3']
    """
    values, most = real_array("values", values), positive_number("limit", limit)
    if values.ndim != 1 or not values.size or np.abs(values).max() > most:
        raise ValueError(f"values = {short(values.tolist())}; allowed: a list of offsets in mrad, within +-{most:g}")
    return {
        f"offset_{i + 1}": slider(f"offset {i + 1} in mrad", -most, most, 0.5, v)
        for i, v in enumerate(np.resize(values, robot.n_arms).tolist())
    }


def _within(low: float, high: float, value: float) -> None:
    """Refuse ends of a slider that are no range, and a value outside."""
    least, most, first = (float(exact_array(k, v)) for k, v in (("low", low), ("high", high), ("value", value)))
    if not least < most:
        raise ValueError(f"low = {low!r} and high = {high!r}; allowed: low < high")
    if not least <= first <= most:
        raise ValueError(f"value = {value!r}; allowed: low to high, {low!r} to {high!r}")


def written(draw):
    """What somebody wrote of a draw function, and named: the function within a partial one, the class of an object."""
    while isinstance(draw, functools.partial):
        draw = draw.func
    return draw if hasattr(draw, "__qualname__") else type(draw)


def parts(draw, controls, play, live, about) -> None:
    """Refuse what is no part of an explorer."""
    function("draw", draw)
    for name, widget in of_kind("controls", controls, dict, "a dict of name -> widget").items():
        having(f"controls[{name!r}]", widget, "a widget with a value, such as slider returns", "value", "observe")
    if play is not None and (not isinstance(play, str) or play not in controls):
        raise ValueError(f"play = {short(play)}; allowed: one of {', '.join(controls)}")
    if play is not None and not isinstance(controls[play], widgets.IntSlider):
        raise ValueError(f"play = {play!r}; allowed: the name of a slider with whole numbers")
    truth("live", live)
    of_kind("about", about, str, "text")
    parameters = list(inspect.signature(draw).parameters.values())[1:]
    names = [p.name for p in parameters if p.kind is not p.VAR_KEYWORD]
    rest = len(names) < len(parameters)
    if not set(names) <= set(controls) or (not rest and set(controls) - set(names)):
        raise ValueError(
            f"controls are named {', '.join(controls) or '(none)'}, but {written(draw).__name__} takes "
            f"{', '.join(names) or '(none)'} after the picture; allowed: the same names"
        )


class Player(widgets.HBox):
    """A play button for a slider, with its speed."""

    def __init__(self, slider):
        ends = {"min": slider.min, "max": slider.max, "step": slider.step, "interval": 80}
        self.play = widgets.Play(slider.value, **ends, layout={"width": "120px"})
        # A step of 80 ms every 80 ms would be real time.
        speed = widgets.HTML(f"plays at {slider.step / 80:g} × real time" if " in ms" in slider.description else "")
        widgets.jslink((self.play, "value"), (slider, "value"))
        super().__init__([self.play, speed])
        self.add_class("rapkm-player")
        self.slider, self._back = slider, -math.inf

    def back(self) -> None:
        """Stop, and take no more steps of what plays, of which some are under way."""
        if self.play.playing:
            self.play.playing, self._back = False, time.monotonic()

    def late(self, slider) -> bool:
        """Is what a slider tells one of those steps?"""
        return slider is self.slider and time.monotonic() < self._back + 1.0


def alone(method: Callable) -> Callable:
    """A method of an explorer that waits for the others.

    A kernel may answer the page in one thread while a cell runs in another; a picture that both draw would be mixed.
    """

    @functools.wraps(method)
    def waiting(self, *arguments, **named):
        with self._alone:
            return method(self, *arguments, **named)

    return waiting


class Shown(widgets.VBox):
    """A box whose text is short where nothing but text can be shown."""

    def __repr__(self):
        return "Explorer"


def check(name: str, widget, value) -> None:
    """Raise ValueError for a value that the control cannot take."""
    if isinstance(widget, widgets.Dropdown):
        allowed = [option[1] if isinstance(option, tuple | list) else option for option in widget.options]
        if isinstance(value, np.ndarray) or value not in allowed:
            raise ValueError(f"{name} = {short(value)}; allowed: {', '.join(map(repr, allowed))}")
    elif isinstance(widget, widgets.Checkbox):
        truth(name, value)
    elif isinstance(widget, SLIDERS):
        number = float(exact_array(name, value))
        if isinstance(widget, widgets.IntSlider) and not number.is_integer():
            raise ValueError(f"{name} = {number:g}; allowed: whole numbers")
        low, high = _ends(widget)
        # `tidied` keeps twelve digits.
        slack = 1e-11 * max(abs(low), abs(high))
        if not low - slack <= number <= high + slack:
            raise ValueError(f"{name} = {number:g}; allowed: {low:g} to {high:g}")


def put(controls: dict, values: dict) -> None:
    """Set controls, all or none; ValueError for an unknown name, or a value that a control cannot take."""
    for name, value in values.items():
        if name not in controls:
            raise ValueError(f"there is no control {name!r}; allowed: {', '.join(controls)}")
        check(name, controls[name], value)
    before = {name: controls[name].value for name in values}
    try:
        for name, value in values.items():
            controls[name].value = bool(value) if isinstance(value, np.bool_) else value  # as `check` takes both
    except Exception as error:  # of a widget from elsewhere, too
        for other, value in before.items():
            controls[other].value = value
        raise ValueError(f"{name} = {short(values[name])}; allowed: what its control takes: {error}") from None


def tidied(value):
    """A number without the noise of its last digits; anything else as it is."""
    return float(f"{value:.12g}") if isinstance(value, float) else value


def snap(widget, value):
    """The nearest value that a slider has a step for; a control without steps takes the value as it is."""
    if not isinstance(widget, SLIDERS):
        return value
    log = isinstance(widget, widgets.FloatLogSlider)
    low, high = _ends(widget)
    value = min(max(value, low), high)
    at = math.log(value, widget.base) if log else value
    at = widget.min + widget.step * round((at - widget.min) / widget.step)
    # The last step may lead beyond the end.
    near = min(max(widget.base**at if log else at, low), high)
    return int(near) if isinstance(widget, widgets.IntSlider) else tidied(near)


def moved(widget, steps: int):
    """The value `steps` steps further on a slider, or at its end."""
    base, way = getattr(widget, "base", None), steps * widget.step
    return snap(widget, widget.value + way if base is None else widget.value * base ** min(max(way, -99), 99))


def follow(handles: list[dict], controls: dict) -> bool:
    """Move the sliders to where their handle was stopped short; did any of them move?"""
    before = [widget.value for widget in controls.values()]
    for handle in handles:
        x, y = handle["at"]
        if handle["along"] is None and y is not None:
            for name, (a, b, *c) in handle["set"].items():
                controls[name].value = snap(controls[name], a * x + b * y + sum(c))
    return before != [widget.value for widget in controls.values()]


def ranges(controls: dict) -> dict:
    """The least and the largest value of each slider."""
    return {name: _ends(widget) for name, widget in controls.items() if isinstance(widget, SLIDERS)}


def _ends(widget) -> tuple[float, float]:
    if isinstance(widget, widgets.FloatLogSlider):
        return widget.base**widget.min, widget.base**widget.max
    return widget.min, widget.max
