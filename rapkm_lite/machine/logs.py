"""Logs of runs as a laboratory would hand them over: sampled angles and torques, read from CSV files."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .datafiles import data_path
from .values import Value


@dataclass(frozen=True, eq=False, repr=False)
class Log(Value):
    """A log of a run, one row per record; read-only.

    t : (k,) s.  q_a : (k, N) base angles as the encoders gave them, offsets included, rad.
    q_a_desired : (k, N) rad.  c : (k, N) drive torques, N m, with the noise of a current sensor.

    >>> import rapkm_lite as rk
    >>> rk.mystery_run("offset_a").error.shape
    (901, 3)
    """

    name: str
    t: np.ndarray
    q_a: np.ndarray
    q_a_desired: np.ndarray
    c: np.ndarray

    @property
    def error(self) -> np.ndarray:
        """Measured minus desired base angles (k, N), rad: what the controller works on."""
        return self.q_a - self.q_a_desired

    def __repr__(self):
        return f"Log({self.name!r}, {len(self.t)} records, {self.t[-1]:g} s, {self.c.shape[1]} drives)"


def mystery_run(name: str) -> Log:
    """A log of ``data/mystery_runs``: "offset_a", "offset_b", "offset_c" or "gain".

    The testbed under PD control, K_P = 7.05 N m/rad and K_D = 0.225 N m s/rad, each with hidden offsets; in "gain" one
    drive has another K_P.  Made by ``data/make_mystery_runs.py``.
    Raises ValueError for another name.

    >>> mystery_run("offset_a")
    Log('offset_a', 901 records, 9 s, 3 drives)
    """
    known = ("offset_a", "offset_b", "offset_c", "gain")
    if name not in known:
        raise ValueError(f"name = {name!r}; allowed: {', '.join(known)}")
    table = np.loadtxt(data_path(f"mystery_runs/{name}.csv"), delimiter=",", skiprows=1)
    t, q_a, q_a_desired, c = np.split(table, [1, 4, 7], axis=1)
    return Log(name, t[:, 0], q_a, q_a_desired, c)
