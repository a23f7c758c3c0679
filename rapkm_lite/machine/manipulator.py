"""The machine: N planar RR arms, driven at their bases, that meet in one revolute joint (chapter, section 3.3)."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from .arguments import (
    bounded,
    drive_values,
    exact_array,
    joint_indices,
    of_kind,
    positive_number,
    real_array,
    shaped,
    short,
)
from .datafiles import UNITS_OF, known, read_toml
from .reach import shared_rims
from .tree import Tree
from .values import Array, FilledArray, Value, default, frozen


@dataclass(frozen=True, eq=False, repr=False)
class Manipulator(Value):
    """A planar 2-DOF parallel manipulator with N >= 2 driven RR arms; read-only, compared by value, SI units.

    Per-link values are given as one number, as (2,) = (proximal, distal) for all arms, or as (N, 2);
    per-drive values, at the base joint even where a gear is between, as one number or (N,).

    base : (N, 2) base joints, m.
    lengths : link lengths, m.
    masses : link masses, kg.
    centers : distance of a link's centre of mass from its inner joint, m; default: the middle.
    inertias : link inertias about the centre of mass, kg m^2; default: slender rods, m l^2 / 12.
    rotor_inertia : rotor inertia at the base joint, kg m^2.
    resistance : winding resistance R, ohm.
    torque_constant : k_t, N m/A.
    friction : Coulomb friction f_c of each drive, N m; zero switches it off.
    friction_velocity : v0 of f_c tanh(qd / v0), rad/s; runs take time in proportion to f_c / v0 where it is stiff.
    gravity : (2,) gravity vector in the plane, m/s^2; default zero (horizontal plane).
    load : point mass at the end-effector, kg, carried by arm 2 of the cut tree.
    mode : (N,) working mode, s_i = sign(sin(elbow angle i)).  name : what it is called.

    Raises ValueError naming the argument, its value and what is allowed; also when the arms cannot meet.

    >>> import rapkm_lite as rk; robot = rk.Manipulator(base=[[-0.2, 0], [0.2, 0]], lengths=0.25, masses=0.1)
    >>> robot.n_arms, robot.n_joints, robot.n_constraints
    (2, 4, 2)
    """

    base: Array
    lengths: Array
    masses: Array
    centers: FilledArray = default(None)
    inertias: FilledArray = default(None)
    rotor_inertia: Array = default(0.0)
    resistance: Array = default(0.611)
    torque_constant: Array = default(0.0259)
    friction: Array = default(0.0)
    friction_velocity: float = 0.01
    gravity: Array = default((0.0, 0.0))
    load: float = 0.0
    mode: Array = default(1)
    name: str = "manipulator"

    def __post_init__(self):
        base = _base_points(self.base)
        N = len(base)
        lengths = bounded("lengths", _per_link("lengths", self.lengths, N), 0.0, strict=True)
        if lengths.max() > 1e6:
            raise ValueError(f"lengths = {short(lengths.tolist())} m; allowed: up to 1e6 m")
        masses = bounded("masses", _per_link("masses", self.masses, N), 0.0, strict=True)
        given: dict[str, Any] = {"base": base, "lengths": lengths, "masses": masses}
        for key, rod in _slender_rods(lengths, masses).items():
            given[key] = rod if getattr(self, key) is None else _per_link(key, getattr(self, key), N)
        bounded("inertias", given["inertias"], 0.0, strict=False)
        if np.any((given["centers"] < 0.0) | (given["centers"] > lengths)):
            raise ValueError(f"centers = {short(given['centers'].tolist())} m; allowed: on the link, 0 to its length")
        for key in ("rotor_inertia", "friction", "resistance", "torque_constant"):
            strict = key in ("resistance", "torque_constant")
            given[key] = bounded(key, drive_values(key, getattr(self, key), N), 0.0, strict=strict)
        given["gravity"] = exact_array("gravity", self.gravity, 2)
        given["friction_velocity"] = positive_number("friction_velocity", self.friction_velocity)
        given["load"] = float(bounded("load", exact_array("load", self.load), 0.0, strict=False))
        given["mode"] = drive_values("mode", self.mode, N)
        if not np.all(np.abs(given["mode"]) == 1.0):
            raise ValueError(f"mode = {self.mode}; allowed: +1 or -1 for each of the {N} arms")
        super().__post_init__(**given)
        J_a, J_d, P = self.arm_inertias.T
        if np.any(J_a * J_d - P**2 <= 1e-12 * J_a * J_d):
            raise ValueError(
                f"inertias = {short(given['inertias'].tolist())} with masses, centers and load = {given['load']:g} let "
                "an arm move freely; allowed: values with a positive definite mass matrix"
            )
        if not len(shared_rims(base, lengths, 1e-12)):
            raise ValueError(
                f"lengths = {short(lengths.round(6).tolist())} let no point be reached by all {N} arms from base = "
                f"{short(base.round(6).tolist())}; allowed: arms that can meet (longer links or closer base points)"
            )

    @cached_property
    def n_arms(self) -> int:
        """N, the number of arms, which is also m, the number of drives."""
        return len(self.base)

    @cached_property
    def n_joints(self) -> int:
        """n = 2N joint variables."""
        return 2 * self.n_arms

    @cached_property
    def n_constraints(self) -> int:
        """r = 2(N - 1) loop constraints."""
        return 2 * (self.n_arms - 1)

    @cached_property
    def arm_inertias(self) -> np.ndarray:
        """(N, 3) inertia constants of each arm in absolute link angles, kg m^2, the load counted with arm 2.

        Columns: proximal (with rotor and distal mass at the elbow), distal about the elbow, coupling l1 m2 c2.
        """
        (l1, l2), (m1, m2), (c1, c2), (i1, i2) = (v.T for v in (self.lengths, self.masses, self.centers, self.inertias))
        load = self._load_per_arm
        proximal = i1 + m1 * c1**2 + (m2 + load) * l1**2 + self.rotor_inertia
        distal, coupling = i2 + m2 * c2**2 + load * l2**2, l1 * (m2 * c2 + load * l2)
        return frozen(np.stack([proximal, distal, coupling], axis=-1))

    @cached_property
    def arm_moments(self) -> np.ndarray:
        """(N, 2) first mass moments of each arm along proximal and distal link, kg m, the load counted with arm 2."""
        (l1, l2), (m1, m2), (c1, c2) = (v.T for v in (self.lengths, self.masses, self.centers))
        load = self._load_per_arm
        return frozen(np.stack([m1 * c1 + (m2 + load) * l1, m2 * c2 + load * l2], axis=-1))

    @cached_property
    def tree(self) -> Tree:
        """Constants of the cut tree, for the functions of `mechanics`."""
        return Tree(self)

    @property
    def _load_per_arm(self) -> np.ndarray:
        return self.load * (np.arange(self.n_arms) == 1)

    def replace(self, **changes) -> Manipulator:
        """A copy with some values changed, e.g. ``robot.replace(friction=0.0)``.

        Inertias and centres of mass that were not given follow changed masses and lengths.  A machine of your own class
        keeps its class, and what the class has set besides.
        Raises ValueError for an unknown name, and for another number of arms that does not go with what is kept.
        """
        known("argument", changes, [f.name for f in dataclasses.fields(self)])
        rods = _slender_rods(self.lengths, self.masses)
        changes = {k: None for k, rod in rods.items() if np.array_equal(getattr(self, k), rod)} | changes
        points, N = len(_base_points(changes.get("base", self.base))), self.n_arms
        own = [f.name for f in dataclasses.fields(Manipulator) if f.name not in ("gravity", *changes)]
        kept = [name for name in own if np.ndim(getattr(self, name))]
        if points != N and kept:
            raise ValueError(f"base has {points} points; allowed: {N}, or {', '.join(kept)} changed along with it")
        return self._changed(**changes)

    def with_arms(self, arms) -> Manipulator:
        """The machine that keeps only some arms (0-based); with two, an equivalent non-redundant five-bar (fig. 3).

        The load goes to the second arm that is kept.  A machine of your own class keeps its class, see `replace`.
        Raises ValueError for fewer than two arms, a repeated or an unknown one.

        >>> import rapkm_lite as rk
        >>> print(rk.load().with_arms((0, 2)))
        Manipulator('testbed': 2 arms, links 0.2 m, working mode ++)
        """
        arms = list(joint_indices("arms", arms, self.n_arms, None, "arm"))
        own = [f.name for f in dataclasses.fields(Manipulator) if f.name != "gravity"]
        return self._changed(**{k: v[arms] for k in own if isinstance(v := getattr(self, k), np.ndarray)})

    def same_kinematics(self, other: Manipulator) -> bool:
        """True when both machines have the same joint motion for the same end-effector motion."""
        manipulator(other, "other")
        same = (np.array_equal(getattr(self, k), getattr(other, k)) for k in ("base", "lengths", "mode"))
        return self is other or all(same)

    @property
    def signs(self) -> str:
        """The working mode as it is printed, such as "++-"."""
        return "".join("+" if s > 0 else "-" for s in self.mode)

    def _given(self) -> dict[str, Any]:
        rods = _slender_rods(self.lengths, self.masses)
        meant = [name for name, value in rods.items() if np.array_equal(value, getattr(self, name))]
        each = ("lengths", "masses", *rods, "rotor_inertia", "resistance", "torque_constant", "friction", "mode")
        return self._fields() | {k: _shortest(getattr(self, k)) for k in each} | dict.fromkeys(meant)

    def __str__(self):
        lo, hi = self.lengths.min(), self.lengths.max()
        links = f"{lo:g} m" if lo == hi else f"{lo:g} to {hi:g} m"
        return f"Manipulator({self.name!r}: {self.n_arms} arms, links {links}, working mode {self.signs})"


def _base_points(value) -> np.ndarray:
    """Base points (N, 2) of at least two arms, no two the same."""
    base = real_array("base", value, 2)
    shaped("base", base, base.ndim == 2 and len(base) >= 2, "(N, 2) with at least two arms")
    if min(np.hypot(*(base[i] - base[j])) for i in range(len(base)) for j in range(i)) < 1e-50:
        raise ValueError(f"base = {short(base.tolist())} holds one point twice, to 1e-50 m; allowed: different points")
    return base


def _per_link(name: str, value, N: int) -> np.ndarray:
    array = real_array(name, value)
    fits = array.shape in ((), (2,), (N, 2))
    return np.broadcast_to(shaped(name, array, fits, f"one number, (2,) or ({N}, 2)"), (N, 2))


def _slender_rods(lengths: np.ndarray, masses: np.ndarray) -> dict[str, np.ndarray]:
    return {"centers": lengths / 2, "inertias": masses * lengths**2 / 12}


def _shortest(value: np.ndarray) -> Any:
    """One number or one pair where it stands for all arms, as one types it."""
    if np.all(value == value.flat[0]):
        return value.flat[0].item()
    return value[0] if np.all(value == value[0]) else value


def manipulator(value: Any, name: str = "robot") -> Manipulator:
    """Return `value` when it is a machine, and no class of machines."""
    return of_kind(name, value, Manipulator, "a Manipulator, such as load() returns")


def load(source: str | Path = "testbed") -> Manipulator:
    """Read a machine from ``data/<source>.toml`` or from a path that ends in ``.toml``.

    The file has a table ``[manipulator]`` with the arguments of `Manipulator`; a value may be plain or
    ``{value = ..., unit = "...", source = "..."}``.  A `name` stands above the table.  Tables ``[control]``,
    ``[path]``, ``[sensor]`` and ``[[fault]]`` are left to `rapkm_lite.experiment`.

    Raises ValueError for an unknown key, a missing value, a wrong unit or a value out of range.

    >>> import rapkm_lite as rk; print(rk.load())
    Manipulator('testbed': 3 arms, links 0.2 m, working mode +++)
    """
    tables = read_toml(source)
    values = tables.get("manipulator", {})
    known("TOML key", values, UNITS_OF["manipulator"])
    for key in ("base", "lengths", "masses"):
        if key not in values:
            raise ValueError(f"the table [manipulator] of {str(source)!r} lacks {key!r}; needed: base, lengths, masses")
    return Manipulator(name=str(tables.get("name", Path(source).stem)), **values)
