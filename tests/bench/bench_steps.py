"""By hand: CPU time that a step of each explorer costs the kernel, from a slider's new value to the message.

    python tests/bench/bench_steps.py [names]

Each control goes through settings that it has not had, as under a dragging hand, the others at their first ones; then
again under every other law.  Prints the median over all steps, and that of each control.
"""

from __future__ import annotations

import inspect
import json
import statistics
import sys
import time

from rapkm_lite import explore
from rapkm_lite.explore.controls import moved


def settings(widget, count: int = 12) -> list:
    """Values as a hand goes through them, or all others of a list."""
    if hasattr(widget, "options"):
        return [value for _, value in widget._options_full if value != widget.value]
    if not hasattr(widget, "min"):
        return [not widget.value]
    first, found = widget.value, []
    for way in [1] * count + [-1] * 2 * count:
        widget.value = moved(widget, way)
        found += [widget.value] * (widget.value not in (first, *found))
    widget.value = first
    return found


def steps(name: str, **base) -> dict[str, list[float]]:
    """Milliseconds of CPU time for each control of an explorer, from the setting `base` on."""
    explorer = getattr(explore, name)().set(**base)
    others = getattr(explore, name)().controls
    orders = {control: settings(widget) for control, widget in others.items() if control not in base}
    explorer.canvas.send = lambda content, buffers=None: json.dumps(content)
    explorer._message({"kind": "hello"})
    times: dict[str, list[float]] = {}
    for control, order in orders.items():
        first = explorer.controls[control].value
        for value in order:
            start = time.process_time()
            explorer.controls[control].value = value
            times.setdefault(control, []).append(1e3 * (time.process_time() - start))
        explorer.set(**{control: first})
    return times


def explorers() -> list[str]:
    """The functions that make an explorer of a machine."""
    made = {name: make for name, make in vars(explore).items() if inspect.isfunction(make)}
    return [name for name, make in made.items() if list(inspect.signature(make).parameters) == ["robot"]]


def bases(name: str) -> list[dict]:
    """An explorer as it opens, and under every other law, filter and rule."""
    controls = getattr(explore, name)().controls
    laws = {word: settings(control) for word, control in controls.items() if word in ("law", "filter", "rule")}
    return [{}, *({word: value} for word, values in laws.items() for value in values)]


def main(names: list[str]) -> None:
    for name in names or explorers():
        for base in bases(name):
            times = steps(name, **base)
            medians = {control: statistics.median(values) for control, values in times.items()}
            whole = statistics.median(v for values in times.values() for v in values)
            each = ", ".join(f"{control} {value:.1f}" for control, value in medians.items())
            print(f"{name:18s} {''.join(map(str, base.values())):30s} {whole:5.1f} ms ({each})", flush=True)


if __name__ == "__main__":
    print(__doc__) if {"-h", "--help"} & {*sys.argv} else main(sys.argv[1:])
