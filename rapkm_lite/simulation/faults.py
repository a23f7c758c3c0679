"""Faults of drives and encoders as values; each writes into one table per run, which the loops only apply.

Drives count from 0, times are in s from the start of the run.  To add a fault, write one more such class with `mark`.
"""

from __future__ import annotations

import copy
import inspect
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..control.laws import torque_limit
from ..machine.arguments import bounded, exact_array, shaped, short, whole_number
from ..machine.datafiles import known
from ..machine.values import Array, Value


class FaultTable(NamedTuple):
    """What is broken at each sample k.

    limit : (N,) largest torque, N m, infinite where there is no limit.
    alive : (k, N) what a torque is multiplied by before the limit: 1, 0 in a dead drive, -1 in one wired in reverse.
    held : (k, N) bool, True where an encoder repeats its last reading.
    jump : (k, N) what has been added to the offset so far, rad.
    """

    limit: np.ndarray
    alive: np.ndarray
    held: np.ndarray
    jump: np.ndarray

    def act(self, k: int, c: np.ndarray) -> np.ndarray:
        """The torques that act at sample k when the controller commands c (N,)."""
        return np.clip(self.alive[k] * c, -self.limit, self.limit)


class Fault(Value):
    """Base of the faults."""

    def mark(self, table: FaultTable, t: np.ndarray) -> None:
        """Write this fault into the table of a run with the times t (k,); ``*=`` and ``+=`` keep earlier faults."""
        raise NotImplementedError(f"{type(self).__name__} has no mark; needed: mark(table, t), see the other faults")

    def felt(self, c: np.ndarray) -> bool:
        """Can it be why a run was lost in which the torques c (k, N) acted?"""
        return True

    def _check(self) -> None:
        """Drive and times of a fault, each a plain number."""
        given = self._fields()
        if "drive" in given:
            self._set(drive=whole_number("drive", given["drive"], 0))
        for name in ("time", "start", "stop", "jump"):
            if name in given:
                value = exact_array(name, given[name])
                self._set(**{name: float(value if name == "jump" else bounded(name, value, 0.0, strict=False))})


FaultsLike = Iterable[Fault] | Fault | None


@dataclass(frozen=True, eq=False, repr=False)
class TorqueLimit(Fault):
    """The drives give no more than +-limit in N m: one number, or one per drive (infinity: no limit).

    Raises ValueError for a negative limit, and in a run for another number of drives.

    >>> import rapkm_lite as rk
    >>> rk.TorqueLimit(0.3)
    TorqueLimit(0.3)
    """

    limit: Array

    def __post_init__(self):
        super().__post_init__(limit=torque_limit(self.limit))

    def mark(self, table, t):
        fits = self.limit.shape in ((), table.limit.shape)
        shaped("limit", self.limit, fits, f"one number or {table.limit.shape}")
        np.minimum(table.limit, self.limit, out=table.limit)

    def felt(self, c):
        return bool(np.any(np.abs(c) >= self.limit))


@dataclass(frozen=True, eq=False, repr=False)
class DeadDrive(Fault):
    """A drive (0-based) gives no torque from `time` in s on; it goes on measuring.

    Raises ValueError for a time or drive below 0, and in a run for a drive that the machine does not have.

    >>> import rapkm_lite as rk
    >>> rk.DeadDrive(drive=1, time=0.5)
    DeadDrive(1, 0.5)
    """

    drive: int
    time: float

    def __post_init__(self):
        self._check()
        super().__post_init__()

    def mark(self, table, t):
        table.alive[_from(t, self.time), self.drive] = 0.0


@dataclass(frozen=True, eq=False, repr=False)
class EncoderDropout(Fault):
    """The encoder of a drive (0-based) repeats its last reading before `start` for start <= t < stop, in s.

    At the first sample of a run it reads once.  Its rate is that of the repeated reading: zero where rates are ideal
    and at the first sample, else what the velocity filter makes of it.
    Raises ValueError unless 0 <= start < stop; for the drive see `DeadDrive`.

    >>> import rapkm_lite as rk
    >>> rk.EncoderDropout(drive=0, start=0.5, stop=0.7)
    EncoderDropout(0, 0.5, 0.7)
    """

    drive: int
    start: float
    stop: float

    def __post_init__(self):
        self._check()
        if self.stop <= self.start:
            raise ValueError(f"stop = {self.stop:g} s; allowed: later than start = {self.start:g} s")
        super().__post_init__()

    def mark(self, table, t):
        table.held[_from(t, self.start) & ~_from(t, self.stop), self.drive] = True


@dataclass(frozen=True, eq=False, repr=False)
class OffsetJump(Fault):
    """From `time` in s on the offset of a drive (0-based) is larger by `jump` in rad (a slip); then the encoder rounds.

    Errors: see `DeadDrive`.

    >>> import rapkm_lite as rk
    >>> rk.OffsetJump(drive=2, time=0.5, jump=5e-3)
    OffsetJump(2, 0.5, 0.005)
    """

    drive: int
    time: float
    jump: float

    def __post_init__(self):
        self._check()
        super().__post_init__()

    def mark(self, table, t):
        table.jump[_from(t, self.time), self.drive] += self.jump

    def felt(self, c):
        return abs(self.jump) > 0.02  # less is an offset as machines have them


def kinds() -> dict[str, type[Fault]]:
    """All faults by name, also those that you wrote, whichever fault they derive from."""
    found, new = {}, Fault.__subclasses__()
    while new:
        found |= {kind.__name__: kind for kind in new}
        new = [kind for parent in new for kind in parent.__subclasses__()]
    return found


def _from(t: np.ndarray, time: float) -> np.ndarray:
    """True from `time` on; a sample that misses it only by rounding counts, too."""
    return t >= time - 1e-6 * t[1]


def begins(fault: Fault) -> float:
    """When a fault begins, in s; of several times the first, and the start of the run where it tells no number."""
    try:
        return float(np.min(getattr(fault, "time", getattr(fault, "start", 0.0))))
    except (TypeError, ValueError):
        return 0.0


def described(fault: Fault) -> str:
    """What a fault does, for a sentence.

    >>> described(EncoderDropout(0, 0.5, 0.7)), described(TorqueLimit(0.3))
    ('EncoderDropout(0, 0.5, 0.7) acts from t = 0.5 s to 0.7 s', 'TorqueLimit(0.3) acts')
    """
    until = f"to {fault.stop:g} s" if isinstance(fault, EncoderDropout) else "on"
    since = "" if isinstance(fault, TorqueLimit) else f" from t = {begins(fault):g} s {until}"
    return f"{fault!r} acts{since}"


def blank_table(t: np.ndarray, N: int) -> FaultTable:
    """The table of a healthy machine."""
    shape = len(t), N
    return FaultTable(np.full(N, np.inf), np.ones(shape), np.zeros(shape, bool), np.zeros(shape))


def fault_table(faults, t: np.ndarray, N: int) -> FaultTable | None:
    """The table of a run with the times t (k,) and N drives, from `check_faults`; None without faults.

    Raises ValueError for a drive that there is not, and for a fault that writes what is no number; what the `mark` of
    a user's raises comes through.
    """
    if not faults:
        return None
    table = blank_table(t, N)
    for fault in faults:
        drive = getattr(fault, "drive", 0)
        if not isinstance(drive, int | np.integer) or not 0 <= drive < N:
            raise ValueError(f"drive = {drive!r} in {fault!r}; allowed: 0 to {N - 1}, drives count from 0")
        # A copy: what a fault remembers begins anew in every run.
        if copy.deepcopy(fault).mark(table, t) is not None:
            raise ValueError(f"{fault!r}.mark returns something; allowed: to write into the table, and to return None")
        if not (np.all(table.limit >= 0.0) and np.all(np.isfinite(table.jump)) and np.all(np.isfinite(table.alive))):
            allowed = "limits >= 0, finite jumps and entries of alive"
            raise ValueError(f"{fault!r} writes a table that no run can have; allowed: {allowed}")
    return table


def check_faults(faults) -> tuple[Fault, ...]:
    """The faults as a tuple; raises ValueError for what is no fault."""
    if isinstance(faults, str | bytes | dict | set):
        raise ValueError(f"faults = {short(faults)}; allowed: a list of {', '.join(kinds())}")
    checked = []
    for fault in () if faults is None else faults if np.iterable(faults) else (faults,):
        if not isinstance(fault, Fault):
            own = "or of a class of your own that derives from rapkm_lite.simulation.faults.Fault"
            raise ValueError(f"faults holds {short(fault)}; allowed: values of {', '.join(kinds())}, {own}")
        checked.append(fault)
    return tuple(checked)


def read_fault(table) -> Fault:
    """A fault from a table of a TOML file: its `kind` and its arguments."""
    if not isinstance(table, dict) or "kind" not in table:
        raise ValueError(f"fault = {short(table)}; allowed: a table with kind = one of {', '.join(kinds())}")
    values = {key: value for key, value in table.items() if key != "kind"}
    known("kind of fault", [table["kind"]], kinds())
    kind = kinds()[table["kind"]]
    signature = inspect.signature(kind)
    known(f"entry of {table['kind']}", values, signature.parameters)
    try:
        signature.bind(**values)
    except TypeError as error:
        words = f"the fault {table['kind']}: {error}"
        raise ValueError(f"{words}; allowed: {', '.join(signature.parameters)}") from None
    return kind(**values)
