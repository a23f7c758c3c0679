"""What a picture is given: numbers with gaps, limits, entries of a legend, keywords of a panel."""

from __future__ import annotations

import numpy as np

from ...machine.arguments import exact_array, masked, of_kind, one_of, positive_number, real_array, short


def numbers(name: str, value, *shape: int, most: int = 0) -> np.ndarray:
    """Numbers of a shape, -1 for any length, or of up to `most` axes; what is missing or masked is not finite."""
    try:
        array = np.asarray(value)
        fine = array.dtype.kind in "biuf" and not isinstance(value, bytes | bytearray | memoryview)
    except Exception:  # whatever an object answers that is asked for an array
        fine = False
    if not fine:
        array = real_array(name, value)
    if masked(value):
        array = np.ma.filled(np.ma.asarray(value, float), np.nan)
    if most:
        fits, want = array.ndim <= most, f"up to {most} axes"
    else:
        fits = len(array.shape) == len(shape) and all(n in (-1, k) for n, k in zip(shape, array.shape, strict=True))
        want = str(shape).replace("-1", "k") if shape else "one number"
    if not fits:
        raise ValueError(f"{name} has shape {array.shape}; allowed: {want}")
    return array


def two_limits(name: str, value) -> list[float]:
    low, high = exact_array(name, value, 2).tolist()
    if low == high:
        raise ValueError(f"{name} = {short(value)}; allowed: two different numbers")
    return [low, high]


def vertical_limits(name: str, value, settings: dict) -> list[float]:
    """Limits of a panel with such keywords: on a logarithmic scale zero has no place."""
    low, high = two_limits(name, value)
    if settings.get("yscale") == "log" and not min(low, high) > 0.0:
        raise ValueError(f"{name} = {low, high} of a panel with yscale = 'log'; allowed: two positive numbers")
    return [low, high]


def legend_entries(name: str, entries) -> list:
    """The entries of a legend."""
    listed = list(entries) if isinstance(entries, list | tuple) else [None]
    if not all(isinstance(e, list | tuple) and [*map(type, e)] == [str, dict] for e in listed):
        raise ValueError(f"{name} = {short(entries)}; allowed: a list of (words, keywords of a line)")
    return listed


def check_panel(settings: dict) -> None:
    """Refuse values that the axes of Matplotlib, or the canvas, cannot have."""
    for name, value in settings.items():
        if name in ("title", "xlabel", "ylabel"):
            of_kind(name, value, str, "text")
        elif name in ("xlim", "ylim"):
            two_limits(name, value)
        elif name in ("xticks", "yticks"):
            numbers(name, real_array(name, value), -1)
        elif name == "legend":
            legend_entries(name, value)
        elif name == "yscale":
            one_of(name, value, ("linear", "log"))
            vertical_limits("ylim", settings.get("ylim", (0, 1)), settings)
        elif name == "aspect" and not (isinstance(value, str) and value in ("equal", "auto")):
            positive_number(name, value)
