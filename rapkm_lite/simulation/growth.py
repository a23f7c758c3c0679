"""How a sampled loop lets small errors grow or shrink, near the desired state."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..control.grammar import as_law
from ..control.laws import PID
from ..control.sample import Controller
from .compiled import Plant
from .setup import Setup


def growth(setup: Setup, law, k: int) -> float | None:
    """Factor per sample by which the sampled loop magnifies a small error near the desired state of sample k.

    The spectral radius of the linearized map of the state, and of the integral of a law that has one, from one sample
    to the next, with ideal sensors, a healthy machine and a law that remembers nothing yet; None where there is none.
    """
    robot, model, trajectory = setup[:3]
    plant, dt, desired = Plant(robot, trajectory), trajectory.dt, trajectory[k]
    start: Any = as_law(law).start(model, dt)
    integral: np.ndarray = start if isinstance(inner_law(law), PID) else np.zeros(0)
    centre = np.concatenate([trajectory.x[k], trajectory.xd[k], integral])

    def following(state):
        controller, (x, xd, memory) = Controller(law, model, dt), np.split(state, (2, 4))
        controller.memory = memory if len(memory) else start
        q, qd = plant.observe(k, state[:4])
        c = controller.command(trajectory.t[k], q, qd, desired, (x, xd))
        held, kept = plant.hold(state[:4], c, dt), controller.memory if len(memory) else memory
        return np.concatenate([np.asarray(held, dtype=float), np.asarray(kept)])

    for step in (1e-6, 1e-9, 1e-12):  # huge gains throw the machine out of the workspace by the larger ones
        try:
            columns = [(following(centre + d) - following(centre - d)) / (2 * step) for d in step * np.eye(len(centre))]
            return float(np.max(np.abs(np.linalg.eigvals(np.array(columns)))))
        except (ValueError, RuntimeError, TypeError, ArithmeticError):
            pass
    return None


def magnified(factor: float, dt: float) -> str:
    """What a loop does to an error that grows by a factor > 1 per sample of dt in s, in words that are not "1-fold".

    >>> magnified(2.5, 1e-3), magnified(2.0 ** (1 / 300), 1e-3)
    ('magnifies an error 2.5-fold per sample of 0.001 s', 'doubles an error in 300 samples of 0.001 s')
    """
    if factor > 1.05:
        return f"magnifies an error {factor:.3g}-fold per sample of {dt:g} s"
    return f"doubles an error in {math.log(2.0) / math.log(factor):.3g} samples of {dt:g} s"


def swung(c: np.ndarray, dt: float) -> str:
    """The sentence on torques (k, N) that swung to and fro within the last dozen samples of a run and grew there.

    By more than half, the largest ones of the second half over those of the first; empty where they did not, or where
    less than a quarter of the signs changed.

    >>> swung((-2.0) ** np.arange(12)[:, None], 1e-3), swung(2.0 ** np.arange(12)[:, None], 1e-3)
    ('unstable gain: in the end the torques swung to and fro within 12 samples of 0.001 s and grew 64-fold', '')
    """
    last = c[-12:]
    half = len(last) // 2
    if half == 0:
        return ""
    drive = last[:, np.abs(last).max(axis=0).argmax()]
    changes, first = np.count_nonzero(np.sign(drive[1:]) * np.sign(drive[:-1]) < 0.0), np.abs(drive[:half]).max()
    grown = np.abs(drive[half:]).max() / first if changes >= max(1, len(last) // 4) and first > 0.0 else 0.0
    end = f"the torques swung to and fro within {len(last)} samples of {dt:g} s and grew {grown:.3g}-fold"
    return f"unstable gain: in the end {end}" if grown > 1.5 else ""


def inner_law(law):
    """The law within all filters, or the law itself."""
    return inner_law(law.law) if hasattr(law, "law") else law
