"""Some runs of a study at a time, as an executor gets them: their columns, and what stopped them."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..control.grammar import BadAnswer, NotFinite
from .compiled import DONE, LAW_FAILED, SINGULAR, compiled, encode, many
from .energy import antagonistic_energy, root_mean_square_torque
from .explain import explain
from .pools import Stop
from .runs import attempt
from .setup import Setup

NOT_RUN = -1


class Columns(NamedTuple):
    """The columns of a sweep while it is made; `status` is NOT_RUN until a row is known.

    reason : what stopped a law in Python, else None.
    """

    energies: np.ndarray
    torque_norm: np.ndarray
    antagonistic_energy: np.ndarray
    x_final: np.ndarray
    rms_path_error: np.ndarray
    largest_path_error: np.ndarray
    failure_time: np.ndarray
    status: np.ndarray
    reason: np.ndarray

    @classmethod
    def blank(cls, k: int, N: int) -> Columns:
        sizes = (k, N), k, k, (k, 2), k, k, k
        return cls._make([*map(np.zeros, sizes), np.full(k, NOT_RUN), np.full(k, None)])

    @property
    def failed(self) -> np.ndarray:
        return self.status != DONE

    def enter(self, first: int, rows: Columns, errors: dict) -> dict:
        """Take the rows from `first` on; returns their errors by the rows of the sweep."""
        for column, part in zip(self, rows, strict=True):
            column[first : first + len(part)] = part
        return {first + i: error for i, error in errors.items()}


def blunder(error: Exception) -> bool:
    """Is it the caller's: a first answer that is no array of torques at all?"""
    return isinstance(error, BadAnswer) and not isinstance(error, NotFinite)


def run_chunk(setup: Setup, laws: list, offsets: np.ndarray) -> tuple[Columns, dict]:
    """The columns of some runs, and what stopped the first one of those in Python that failed, or a `blunder`, by row.

    A function of values only, so that any executor can send it to another process.
    """
    rows, errors = Columns.blank(len(laws), setup.robot.n_arms), {}
    for i in _alone(setup, laws, offsets, rows):
        run: Any
        error: Any
        try:
            run, error = attempt(setup._replace(sensors=setup.sensors.with_offset(offsets[i])), laws[i])
        except Exception as raised:  # at the first sample, whatever kind it is: a law may run simulations of its own
            run, error = None, raised
        if error is not None:
            rows.status[i], begun = LAW_FAILED, run is not None
            rows.failure_time[i] = error.time if begun else 0.0
            rows.reason[i] = error.reason if begun else explain(setup, laws[i], LAW_FAILED, 0, error)
            if not errors or blunder(error):
                errors[i] = Stop(error, rows.reason[i], begun)
        else:
            off = run.path_error
            torques = run.energy, root_mean_square_torque(run), antagonistic_energy(run)
            values = *torques, run.x[-1], np.sqrt(np.mean(off**2)), off.max(), 0.0, DONE
            for column, value in zip(rows[:-1], values, strict=True):
                column[i] = value
    return rows, errors


def _alone(setup: Setup, laws: list, offsets: np.ndarray, rows: Columns) -> list[int]:
    """Enter the rows of compiled laws, side by side; returns which rows have to run alone, in Python."""
    # Without a compiler nothing runs side by side, and sums are sooner made at the end of a run.
    codes = {id(law): encode(law, setup) if compiled() else None for law in laws}
    fast = {i: code for i, law in enumerate(laws) if (code := codes[id(law)]) is not None}
    many(setup, fast, offsets, rows[:-1])
    # A first answer that does not fit is the caller's, and a compiled law cannot say what is wrong with it.
    mute = {i for i in fast if fast[i].user and rows.status[i] == SINGULAR and rows.failure_time[i] == 0.0}
    return sorted(set(range(len(laws))) - set(fast) | mute)
