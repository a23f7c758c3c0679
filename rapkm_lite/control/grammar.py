"""The grammar of laws: what a law is asked, and what it may remember.

A law maps what a controller knows to drive torques.  Two ways to ask it: `Law.torque` is the formula, for one instant
or many; `Law.start` and `Law.step` are the law at work, sampled every dt: what it remembers is in `memory` and nowhere
else.  A law without memory inherits both.  `model` is the controller's own manipulator; errors are measured minus
desired.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from reprlib import recursive_repr
from typing import Any

import numpy as np

from ..machine.arguments import (
    bounded,
    callable_with,
    check_leading,
    having,
    joint_indices,
    joint_vectors,
    numeric,
    of_kind,
    one_of,
    positive_definite,
    real_array,
    shaped,
    short,
)
from ..machine.manipulator import Manipulator, manipulator
from ..machine.values import Value
from ..mechanics.trajectory import Desired


class Law:
    """Base of all laws, also of those that users write.

    pose : which configuration `torque` gets: "measured", the least-squares pose of the measured base angles
        (`estimate_pose`), "true", for study, or None; a `step` of your own asks for it, ``sample.pose(self.pose)``.
        The laws of this package compare driven joints as measured, whatever the pose, elbows and end-effector of it.

    A law of your own gives `torque`, or `start` and `step` when it remembers something (neither: NotImplementedError):

    >>> import numpy as np, rapkm_lite as rk
    >>> class Push(rk.Law):
    ...     def step(self, memory, sample):
    ...         return np.array([0.01, 0.0, 0.0]), memory
    >>> robot = rk.load()
    >>> bool(rk.simulate(robot, Push(), rk.hold(robot, [0.0, 0.0], 0.1)).x[-1, 0] != 0.0)
    True
    """

    pose: str | None = "measured"

    def start(self, model: Manipulator, dt: float):
        """The memory at the beginning of a run with this model, sampled every dt in s."""
        return None

    def step(self, memory, sample) -> tuple[np.ndarray, object]:
        """Drive torques c (N,) in N m at a `Sample`, and the memory for the next one."""
        q, qd = seen(sample).pose(self.pose)
        return self.torque(sample.model, q, qd, sample.q_a, sample.qd_a, sample.desired), memory

    def torque(self, model: Manipulator, q, qd, q_a, qd_a, desired: Desired) -> np.ndarray:
        """Drive torques c (..., N) in N m at a pose of the model, q, qd (..., 2N), measured q_a, qd_a (..., N), and a
        desired motion.

        Raises NotImplementedError for laws that have none without a memory, such as `PID`, functions, and a filter
        around either; ValueError for open loops and at singularities of the law, where it uses the pose.
        """
        needed = "a class that gives torque, or one that gives step, and a run to ask it"
        raise NotImplementedError(f"{short(getattr(self, 'function', self))} has no torque; needed: {needed}")

    def coordinates(self, memory) -> tuple[int, int] | None:
        """The two independent joints that the law works in, given its memory; None where it has none."""
        return None

    def _check_pose(self) -> None:
        one_of("pose", self.pose, ("measured", "true"))


LawLike = Law | Callable[..., Any]


class Function(Law):
    """A function ``(t, q_a, qd_a, desired) -> c`` in the grammar of a law; it may keep what it is given."""

    pose = None

    def __init__(self, function):
        self.function = function

    def start(self, model, dt):
        """A function that cannot be called so is refused before the run."""
        callable_with("law", self.function, "t", "q_a", "qd_a", "desired")
        if getattr(self.function, "targetoptions", {}).get("nopython"):
            raise ValueError(
                f"law = {short(self.function)} is compiled by Numba, which does not know what `desired` is; "
                "allowed: rapkm_lite.compiled of it, or the function itself"
            )

    def step(self, memory, sample):
        return self.function(sample.t, sample.q_a.copy(), sample.qd_a.copy(), sample.desired), memory


def as_law(law) -> Law:
    """The law itself, or a callable in the grammar of a law; raises ValueError for anything else."""
    if not isinstance(law, type):
        if callable(getattr(law, "start", None)) and callable(getattr(law, "step", None)):
            return law
        if callable(law):
            return Function(law)
    words = f"law = {short(law)}" + ", which is a class" * isinstance(law, type)
    raise ValueError(f"{words}; allowed: a law, such as PD(7.0, 0.2), or a function (t, q_a, qd_a, desired) -> c")


def begin(law, model: Manipulator, dt: float):
    """`start` of a law or callable, after a check that a run can call it.

    Raises ValueError where a method of a user's law takes other arguments, or is one that no run would ask.
    """
    law = as_law(law)
    nearest = next((c for c in type(law).__mro__ if {"step", "torque", "__call__"} & vars(c).keys()), Law)
    if not {"step", "torque"} & vars(nearest).keys():
        raise ValueError(f"{nearest.__name__}.__call__ is of your own, but a run asks for step; allowed: a step")
    if type(law).step is Law.step and law.pose is not None:
        one_of("pose", law.pose, ("measured", "true", None))
    for name in ("start", "step", "coordinates", "torque"):
        # A law that has a step of its own is not asked for its torque.
        if hasattr(law, name) and not (name == "torque" and getattr(type(law), "step", None) is not Law.step):
            _, *given = inspect.signature(getattr(Law, name)).parameters
            callable_with(f"law.{name}", getattr(law, name), *given)
    return law.start(model, dt)


def check_asked(kind: type, base: type, **unasked: str) -> None:
    """Raise ValueError where a user's class has a formula of its own that the step of `base` does not use.

    unasked : such formulas besides `torque`, and what is asked instead.
    A step of the user's may ask that of a law of the package: a class that has both a formula and a step knows of it.
    """
    for name, instead in {"torque": "step", **unasked}.items():
        if getattr(kind, name) is getattr(base, name):
            continue
        owner = next(c for c in kind.__mro__ if name in vars(c))
        if getattr(kind, instead) is getattr(base, instead) or (instead == "step" and instead not in vars(owner)):
            raise ValueError(
                f"{owner.__name__}.{name} is of your own, but {base.__name__}.step does not use it; "
                f"allowed: also a {instead} of your own in that class, which is what a run asks for"
            )


def coordinates(law, memory) -> tuple[int, int] | None:
    """`Law.coordinates` of any law or callable.

    Raises ValueError where a user's law answers what are no two joints.
    """
    found = law.coordinates(memory) if hasattr(law, "coordinates") else None
    if found is not None and not isinstance(law, LawValue):
        joint_indices("law.coordinates(memory)", found, None)
    return found


def seen(sample):
    """Return what a law is asked at, when it is a `Sample` or tells the same."""
    return having("sample", sample, "a Sample, such as a Controller makes", "errors", "pose")


class BadAnswer(ValueError):
    """What a law answered is not what a law should answer."""


class NotFinite(BadAnswer):
    """One torque per drive, but not all of them finite."""


def ask(law, memory, sample) -> tuple[np.ndarray, object]:
    """`step` of a law or callable, with an answer that fits: N finite torques, and the memory.

    Raises BadAnswer, a ValueError that says what to change.
    """
    answer = as_law(law).step(memory, sample)
    if type(answer) is not tuple or len(answer) != 2:
        raise BadAnswer(f"{type(law).__name__}.step returned {short(answer)}; allowed: the pair (c, memory)")
    c, memory = answer
    # The cheap test first: it lets pass what is surely fine, and warns of no overflow.
    if type(c) is np.ndarray and c.dtype == float and c.shape == sample.q_a.shape and sum(map(abs, c.tolist())) < 1e100:
        return c, memory
    if c is None:
        raise BadAnswer("law returned None; allowed: the drive torques c, an array (N,) in N m (is a return missing?)")
    name = f"law(t = {sample.t:.4f} s, ...)"
    try:
        c = numeric(name, c)
    except ValueError as error:
        raise BadAnswer(str(error)) from None
    if c.shape != sample.q_a.shape:
        raise BadAnswer(f"law returned the shape {c.shape}; allowed: {sample.q_a.shape}, one torque in N m per drive")
    try:
        return real_array(name, c), memory
    except ValueError as error:
        raise NotFinite(str(error)) from None


class LawValue(Law, Value):
    """Base of the laws of this package: frozen dataclasses, compared by value, printed as typed."""

    @recursive_repr()
    def __repr__(self):
        parts = []
        for name, value in (self._fields() | self._own()).items():
            if name == "law":
                parts.append(repr(value))
            elif not (name == "W" if value is None else np.ndim(value) == 0 and value == math.inf):
                parts.append(f"{name}={value.tolist() if isinstance(value, np.ndarray) else value!r}")
        return f"{type(self).__name__}({', '.join(parts)})"


def gain(name: str, value, zero: bool = False) -> np.ndarray:
    """A positive number, diagonal or matrix of whatever size; the size is checked where the machine is known.

    zero : also numbers and diagonals that are zero.
    """
    K = real_array(name, value)
    shaped(name, K, K.size > 0 and K.ndim <= 2, "one number, one per coordinate, or a matrix")
    return bounded(name, K, 0.0, strict=not zero) if K.ndim < 2 else positive_definite(name, K, K.shape[-1])


def joint_gain(name: str, K, N: int) -> np.ndarray:
    """A gain in redundant coordinates as (2N, 2N); (N,) acts on the driven joints only, as in (29)."""
    K, n = real_array(name, K), 2 * N
    if K.shape == (N,):
        return np.diag(np.concatenate([bounded(name, K, 0.0, strict=True), np.zeros(N)]))
    fits = K.shape in ((), (n,)) or K.shape[-2:] == (n, n)
    shaped(name, K, fits, f"one number, ({N},) on the drives, ({n},) or ({n}, {n})")
    return positive_definite(name, K, n)


def measured(model, q_a, qd_a, desired) -> tuple[np.ndarray, np.ndarray]:
    """The measured base angles and rates, after a check that they fit the model and the desired motion."""
    q_a, qd_a = joint_vectors(manipulator(model, "model").n_arms, q_a=q_a, qd_a=qd_a)
    of_kind("desired", desired, Desired, "a Desired, such as trajectory[k]")
    if desired.n_arms != model.n_arms:
        raise ValueError(f"desired has {desired.n_arms} arms, the model {model.n_arms}; allowed: the same number")
    check_leading(q_a=q_a.shape[:-1], desired=desired.q.shape[:-1])
    return q_a, qd_a
