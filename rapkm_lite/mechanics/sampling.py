"""Times and rates of a sampled motion, checked before a path is made of them."""

from __future__ import annotations

import numpy as np

from ..machine.arguments import positive_number, real_array

MOST = 10_000_000
"""Samples of a path: nearly three hours at 1 kHz."""


def sample_times(duration: float, dt: float) -> np.ndarray:
    """Times from 0 to `duration` in steps of dt, s."""
    duration, dt = positive_number("duration", duration), positive_number("dt", dt)
    steps = round(min(duration / dt, 1e9))
    if steps < 1 or abs(steps * dt - duration) > 1e-9 * duration:
        raise ValueError(f"dt = {dt:g} s; allowed: a whole fraction of duration = {duration:g} s")
    if steps > MOST:
        raise ValueError(f"duration = {duration:g} s has {steps} samples of dt = {dt:g} s; allowed: up to {MOST}")
    return np.arange(steps + 1) * (duration / steps)


def equidistant(t) -> np.ndarray:
    """Times (k,) in s, after a check that they rise equidistantly from zero."""
    t = real_array("t", t)
    if t.ndim != 1 or len(t) < 2:
        raise ValueError(f"t has shape {t.shape}; allowed: (k,) with at least two samples")
    if t[0] != 0.0 or t[-1] <= 0.0 or not np.allclose(np.diff(t), t[-1] / (len(t) - 1), rtol=1e-6, atol=0.0):
        raise ValueError(f"t = {t[0]:g}, {t[1]:g}, ..., {t[-1]:g}; allowed: rising, equidistant times that start at 0")
    return t


def check_rates(t: np.ndarray, x: np.ndarray, xd: np.ndarray) -> None:
    """Refuse rates that are no derivative of the positions; a few jumps are set-points, and allowed."""
    moved, meant = np.diff(x, axis=0), t[1] * (xd[1:] + xd[:-1]) / 2
    off = np.linalg.norm(moved - meant, axis=-1)
    size = max(np.abs(moved).max(), np.abs(meant).max())
    wrong = off > 0.1 * size + 1e-12
    if np.count_nonzero(wrong) > 2 + 0.05 * len(t):
        k = int(np.argmax(off))
        raise ValueError(
            f"xd[{k}] = {xd[k].round(6).tolist()} m/s does not fit x: from t = {t[k]:g} s to {t[k + 1]:g} s "
            f"x moves by {moved[k].round(9).tolist()} m, xd means {meant[k].round(9).tolist()} m; "
            "allowed: the time derivative of x"
        )
