"""Logs of runs as a laboratory would hand them over: sampled angles and torques, read from CSV files."""

from __future__ import annotations

import csv
import itertools
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .arguments import of_kind, one_of, real_array, shaped, short
from .datafiles import data_path
from .values import Array, Value, frozen

OTHERWISE = " (of a file in another form, make a Log)"


@dataclass(frozen=True, eq=False, repr=False)
class Log(Value):
    """A log of a run, one row per record; read-only.

    name : text.  t : (k,) s, increasing.  q_a : (k, N) base angles as the encoders gave them, offsets included, rad.
    q_a_desired : (k, N) rad.  c : (k, N) drive torques, N m, in a laboratory with the noise of a current sensor.
    Raises ValueError for shapes that do not fit, numbers that are not finite, or times that do not increase.

    >>> import rapkm_lite as rk
    >>> rk.mystery_run("offset_a").error.shape
    (901, 3)
    """

    name: str
    t: Array
    q_a: Array
    q_a_desired: Array
    c: Array

    def __post_init__(self):
        t, q_a = real_array("t", self.t), real_array("q_a", self.q_a)
        if t.ndim != 1 or q_a.ndim != 2 or len(q_a) != len(t) or q_a.size == 0:
            raise ValueError(f"t has shape {t.shape} and q_a {q_a.shape}; allowed: (k,) and (k, N) with k, N >= 1")
        late = np.flatnonzero(np.diff(t) <= 0.0)
        if len(late):
            raise ValueError(f"t[{late[0] + 1}] = {t[late[0] + 1]:g} s follows {t[late[0]]:g} s; allowed: increasing")
        given = {"t": t, "q_a": q_a}
        for name in ("q_a_desired", "c"):
            given[name] = column = real_array(name, getattr(self, name))
            shaped(name, column, column.shape == q_a.shape, f"{q_a.shape}, as q_a")
        super().__post_init__(**given)

    @property
    def error(self) -> np.ndarray:
        """Measured minus desired base angles (k, N), rad: what the controller works on."""
        return frozen(self.q_a - self.q_a_desired)

    def __repr__(self):
        return f"Log({self.name!r}, {len(self.t)} records, {self.t[-1] - self.t[0]:g} s, {self.c.shape[1]} drives)"


def columns(n_arms: int) -> list[str]:
    """The header of a log file: time, measured and desired angles, torques, with their units."""
    arms = range(1, n_arms + 1)
    angles = [f"q{i} {what} in rad" for what in ("measured", "desired") for i in arms]
    return ["t in s", *angles, *(f"c{i} in N m" for i in arms)]


def read_log(source: str | Path) -> Log:
    """A log from a CSV file with the columns and units of ``data/mystery_runs``, for any number of drives.

    The header is ``t in s, q1 measured in rad, ..., q1 desired in rad, ..., c1 in N m, ...``; a line is a record.
    Raises ValueError with file, line and column for a file of another form, also where a number is missing or not
    finite, where time does not increase, or where a step in time is over 1.5 times the usual one.
    What a file of another form holds, read with NumPy and turned into rad, s and N m, makes a `Log`; it may have gaps.

    >>> import rapkm_lite as rk
    >>> rk.read_log(rk.data_path("mystery_runs/gain.csv"))
    Log('gain', 901 records, 9 s, 3 drives)
    """
    path = Path(of_kind("source", source, str | Path, "the path of a CSV file"))
    try:
        # Spreadsheets write a byte order mark before the header, editors an empty line at the end.
        with path.open(newline="", encoding="utf-8-sig") as file:
            # A pipe may bring it; of a device that never ends a line not more than a line's worth is read.
            header, *lines = list(csv.reader(iter(lambda: file.readline(10**6), ""))) or [[]]
    except (OSError, csv.Error, ValueError) as error:
        reason = getattr(error, "strerror", None) or ("not UTF-8 text" if isinstance(error, UnicodeError) else error)
        raise ValueError(f"the log {short(str(source))} cannot be read ({reason}); allowed: a CSV file") from None
    while lines and not lines[-1]:
        lines.pop()
    header = _names(path, header)
    table = np.array([_numbers(path, header, number, line) for number, line in enumerate(lines, 2)])
    if len(table) == 0:
        raise ValueError(f"the log {path.name!r} has no record; allowed: one line or more below the header")
    _check_times(path, table[:, 0])
    return Log(path.stem, table[:, 0], *np.split(table[:, 1:], 3, axis=1))


def write_log(log: Log, target: str | Path) -> None:
    """Write a log as the CSV file that `read_log` reads: header, then a line for each record, all digits.

    Raises ValueError for what is no log, for a log with gaps in its times, and for a path that cannot be written.

    >>> import rapkm_lite as rk, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     rk.write_log(rk.mystery_run("gain"), f"{folder}/mine.csv")
    ...     rk.read_log(f"{folder}/mine.csv")
    Log('mine', 901 records, 9 s, 3 drives)
    """
    of_kind("log", log, Log, "a Log, such as run.log() returns")
    of_kind("target", target, str | Path, "the path of a CSV file")
    _check_times(Path(target), log.t)
    try:
        with Path(target).open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(columns(log.c.shape[1]))
            writer.writerows(np.column_stack([log.t, log.q_a, log.q_a_desired, log.c]).tolist())
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise ValueError(f"target = {short(str(target))} cannot be written ({reason}); allowed: a CSV file") from None


def _check_times(path: Path, t: np.ndarray) -> None:
    """Time increases, and records come evenly, but for jitter: a rest with a hole in it may be two."""
    steps = np.diff(t)
    usual = np.median(steps) if len(steps) else 0.0
    gap = f", though records come every {usual:g} s; allowed: a log without gaps, or one file for each part"
    for wrong, words in ((steps <= 0.0, "; allowed: times that increase"), (steps > 1.5 * usual, gap)):
        for k in np.flatnonzero(wrong)[:1]:
            raise ValueError(
                f"the log {path.name!r}, line {k + 3}, column 1: after {t[k]:g} s comes {t[k + 1]:g} s{words}"
            )


def _names(path: Path, header: list[str]) -> list[str]:
    """The names of the columns; raises ValueError for others."""
    if len(header) == 1 and set(";\t") & set(header[0]):
        raise ValueError(
            f"the log {path.name!r}, line 1 has no commas; allowed: values with commas between them, with decimal "
            f"points{OTHERWISE}"
        )
    names = [name.strip(" \t") for name in header]
    drives = max(sum(name.endswith(end) for name in names) for end in ("measured in rad", "desired in rad", "in N m"))
    wanted = columns(drives or max((len(header) - 1) // 3, 1))
    for column, (name, want) in enumerate(itertools.zip_longest(names, wanted), 1):
        if name != want:
            got = "nothing" if name is None else short(name)
            raise ValueError(
                f"the log {path.name!r}, line 1, column {column} holds {got}; allowed: the header "
                f"{', '.join(wanted)}{OTHERWISE}"
            )
    return wanted


def _numbers(path: Path, header: list[str], number: int, line: list[str]) -> list[float]:
    """The numbers of a line; raises ValueError with the column of what is none."""
    if len(line) != len(header):
        raise ValueError(f"the log {path.name!r}, line {number} has {len(line)} columns; allowed: {len(header)}")
    row = []
    for column, (name, text) in enumerate(zip(header, line, strict=True), 1):
        try:
            row.append(float(text))
            # Python reads 1_0 as 10, and a number with a quoted line break: in a file these are typos.
            fine = abs(row[-1]) < 1e100 and not set("_\r\n") & set(text)
        except ValueError:
            fine = False
        if not fine:
            raise ValueError(
                f"the log {path.name!r}, line {number}, column {column} ({name}) holds {short(text)}; allowed: numbers"
            )
    return row


def mystery_run(name: str) -> Log:
    """A log of ``data/mystery_runs``: "offset_a", "offset_b", "offset_c" or "gain".

    The testbed under PD control, K_P = 7.05 N m/rad and K_D = 0.225 N m s/rad, each with hidden offsets; in "gain" one
    drive has a different K_P.  Made by ``notebooks/build.py mystery``.
    Raises ValueError for another name.

    >>> import rapkm_lite as rk
    >>> rk.mystery_run("offset_a")
    Log('offset_a', 901 records, 9 s, 3 drives)
    """
    one_of("name", name, ("offset_a", "offset_b", "offset_c", "gain"))
    return read_log(data_path(f"mystery_runs/{name}.csv"))
