"""Data files that come with the package, and the tables of a TOML file with units and sources."""

from __future__ import annotations

import difflib
import tomllib
from pathlib import Path

from .arguments import of_kind, short

UNITS_OF = {
    "manipulator": {
        "base": "m",
        "lengths": "m",
        "masses": "kg",
        "centers": "m",
        "inertias": "kg m^2",
        "rotor_inertia": "kg m^2",
        "resistance": "ohm",
        "torque_constant": "N m/A",
        "friction": "N m",
        "friction_velocity": "rad/s",
        "gravity": "m/s^2",
        "load": "kg",
        "mode": "1",
    },
    "control": {"K_P": "N m/rad", "K_D": "N m s/rad", "dt": "s"},
    "path": {"side": "m", "duration": "s", "centre": "m", "angle": "rad", "rest": "s"},
    "sensor": {"offset": "rad", "encoder": "1", "velocity_filter": "s"},
    "fault": {"kind": None, "drive": "1", "time": "s", "start": "s", "stop": "s", "jump": "rad", "limit": "N m"},
}
"""Keys of every table of a data file, and their units."""


def known(what: str, keys, allowed) -> None:
    """Refuse words that are none of those allowed, with the nearest one."""
    for key in keys:
        if not isinstance(key, str) or key not in allowed:
            words = f"unknown {what} {short(key)}{_nearest(key, allowed)}"
            raise ValueError(f"{words}; allowed: {', '.join(sorted(allowed))}")


def _nearest(key, allowed) -> str:
    close = difflib.get_close_matches(str(key), allowed, n=1)
    return f" (did you mean {close[0]!r}?)" if close else ""


def data_path(name: str) -> Path:
    """Path of a data file shipped with the package, in an installed copy as well as in a checkout.

    Raises ValueError when there is none of this name.

    >>> import rapkm_lite as rk
    >>> rk.data_path("testbed.toml").name
    'testbed.toml'
    """
    return _data_file("name", name, name)


def _data_file(argument: str, value, name) -> Path:
    """A file of the folder data; the sentence names the argument that asks for it."""
    here = Path(__file__).resolve().parents[1]
    folders = here.parent / "data", here / "data"
    files = {p.relative_to(f).as_posix(): p for f in folders for p in f.rglob("*.*") if p.is_file()}
    if isinstance(name, str) and name in files:
        return files[name]
    ours = sorted(k for k in files if k.endswith((".toml", ".csv")) and "/" not in k)
    allowed = f"a file name from the folder data: {', '.join(ours)}"
    if argument == "source":
        tables = ", ".join(k.removesuffix(".toml") for k in ours if k.endswith(".toml"))
        allowed = f"a name from the folder data: {tables}; or a path that ends in .toml"
    raise ValueError(f"{argument} = {short(value)}: there is no data file {short(name)}; allowed: {allowed}")


def read_toml(source: str | Path) -> dict:
    """Tables of a data file by name (``"testbed"``) or path, each {value, unit, source} reduced to its number.

    Raises ValueError for an unreadable file or a unit other than SI.
    """
    of_kind("source", source, (str, Path), "a name such as 'testbed', or a path that ends in .toml")
    path = Path(source) if str(source).endswith(".toml") else _data_file("source", source, f"{source}.toml")
    try:
        # Editors may write a byte order mark before the first line.
        tables = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except (OSError, RecursionError, ValueError) as error:
        unread = isinstance(error, OSError) or "\0" in str(path)  # the one thing that no system has words for
        reason = getattr(error, "strerror", None) or error
        words = f"cannot be read ({reason})" if unread else f"is not valid TOML: {error}"
        raise ValueError(f"source: the file {short(str(path))} {words}; allowed: a TOML file") from None
    known("TOML table", tables, ["name", "about", *UNITS_OF])
    return {key: _table(key, value) for key, value in tables.items()}


def _table(name: str, values):
    """A table reduced to its numbers; [[fault]] is a list of tables."""
    if name not in UNITS_OF:
        return of_kind(name, values, str, "text")
    if name == "fault":
        return [_entries(name, table) for table in of_kind(name, values, list, "tables [[fault]]")]
    return _entries(name, values)


def _entries(name: str, values) -> dict:
    of_kind(name, values, dict, f"a table [{name}]")
    for key, value in values.items():
        if name == "fault" and UNITS_OF[name].get(key) is None and isinstance(value, dict) and "unit" in value:
            words = f"not known here{_nearest(key, UNITS_OF[name])}; allowed: a number in the unit of its class"
            words = "but is a word; allowed: a word alone" if key == "kind" else f"which is {words}"
            raise ValueError(f"{key} in [[fault]] has the unit {short(value['unit'])}, {words}")
    return {key: _plain(f"{key} in [{name}]", value, UNITS_OF[name].get(key)) for key, value in values.items()}


def _plain(key: str, value, unit: str | None):
    """The number of {value, unit, source}; keys without a unit of ours are left to who reads the table."""
    if not isinstance(value, dict):
        return value
    known(f"entry of {key}", value, ["value", "unit", "source"])
    if "value" not in value:
        raise ValueError(f"{key} = {short(value)} lacks its value; needed: value, allowed beside it: unit, source")
    if unit is not None and value.get("unit", unit) != unit:
        raise ValueError(f"{key} has the unit {short(value['unit'])}; allowed: {unit!r}")
    return value["value"]
