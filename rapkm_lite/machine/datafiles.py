"""Data files that come with the package, and the tables of a TOML file with units and sources."""

from __future__ import annotations

import difflib
import tomllib
from pathlib import Path

UNITS = {
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
}


def known(what: str, key: str, allowed) -> None:
    if key not in allowed:
        close = difflib.get_close_matches(key, allowed, n=1)
        hint = f" (did you mean {close[0]!r}?)" if close else ""
        raise ValueError(f"unknown {what} {key!r}{hint}; allowed: {', '.join(sorted(allowed))}")


def data_path(name: str) -> Path:
    """Path of a data file shipped with the package, in an installed copy as well as in a checkout.

    Raises ValueError when there is none of this name.

    >>> import rapkm_lite as rk
    >>> rk.data_path("testbed.toml").name
    'testbed.toml'
    """
    here = Path(__file__).resolve().parents[1]
    for folder in (here / "data", here.parent / "data"):
        if (folder / name).exists():
            return folder / name
    raise ValueError(f"there is no data file {name!r}; allowed: a file name from the folder data")


def read_toml(source: str | Path) -> dict:
    """Tables of a data file by name (``"testbed"``) or path, each {value, unit, source} reduced to its number.

    Raises ValueError for an unreadable file or a unit other than SI.
    """
    if not isinstance(source, str | Path):
        raise ValueError(f"source = {source!r}; allowed: a name such as 'testbed', or a path that ends in .toml")
    path = Path(source)
    if path.suffix != ".toml":
        path = data_path(f"{source}.toml")
    try:
        tables = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ValueError(f"the file {str(path)!r} cannot be read ({error.strerror}); allowed: a TOML file") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"the file {str(path)!r} is not valid TOML: {error}") from None
    return {key: _plain(key, value) for key, value in tables.items()}


def _plain(key: str, value):
    if isinstance(value, dict) and "value" in value:
        for part in value:
            known(f"entry of {key!r}", part, ["value", "unit", "source"])
        if key in UNITS and value.get("unit", UNITS[key]) != UNITS[key]:
            raise ValueError(f"{key} has the unit {value['unit']!r}; allowed: {UNITS[key]!r}")
        return value["value"]
    if isinstance(value, dict):
        return {k: _plain(k, v) for k, v in value.items()}
    return value
