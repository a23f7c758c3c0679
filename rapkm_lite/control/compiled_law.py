"""`compiled`: a law that a user wrote, run inside the compiled loop."""

from __future__ import annotations

import ast
import functools
import importlib
import inspect
import operator
import sys
import textwrap
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..machine.arguments import callable_with, one_of, short, whole_number
from ..mechanics.at import at as at_pose
from .grammar import LawValue, check_asked


@dataclass(frozen=True, eq=False, repr=False)
class CompiledLaw(LawValue):
    """A function ``(t, q_a, qd_a, d[, at][, memory]) -> c`` as a law; made by `compiled`, which lists the errors, too.

    Where Numba is installed the loop calls it compiled, elsewhere as it is.

    >>> import rapkm_lite as rk
    >>> rk.CompiledLaw(lambda t, q_a, qd_a, d: -7.0 * (q_a - d.q_a)).memory
    0
    """

    function: Callable
    at: str | None = None
    memory: int = 0

    def __post_init__(self):
        if not callable(self.function) or isinstance(self.function, type | LawValue):
            raise ValueError(f"function = {short(self.function)}; allowed: (t, q_a, qd_a, d[, at][, memory]) -> c")
        super().__post_init__(memory=_asked(self.at, self.memory))

    @property
    def pose(self):
        """The pose that the run has to find for it: "measured", "true" or None."""
        return None if self.at in (None, "desired") else self.at

    @property
    def _plain(self) -> Callable:
        """The function for Python, which one that Numba compiled holds: itself it cannot be told what `d` is."""
        return getattr(self.function, "py_func", self.function)

    def __call__(self, *arguments):
        return self._plain(*arguments)

    def start(self, model, dt):
        self.check()
        return np.zeros(self.memory)

    def __reduce__(self):
        if type(self) is not CompiledLaw:  # a class of a user's
            return object.__new__, (type(self),), self.__getstate__()
        # The name of a decorated function stands for the law, which plain pickle would not take for the function.
        place = getattr(self.function, "__module__", ""), getattr(self.function, "__qualname__", "")
        # But cloudpickle, which executors of clusters use, sends what a notebook defines itself and not by name.
        sender = sys._getframe(1).f_globals.get("__name__", "")
        by_value = place[0] == "__main__" and sender.endswith("cloudpickle")
        try:
            if not by_value and _function(*place) is self.function:
                return _law, (*place, self.at, self.memory)
        except Exception:  # such as a function within another one, which plain pickle refuses
            pass
        return CompiledLaw, (self.function, self.at, self.memory)

    def check(self) -> None:
        """Raise ValueError when the function does not take what a run gives it, or forgets its memory."""
        given = ["t", "q_a", "qd_a", "d", *["at"] * (self.at is not None), *["memory"] * (self.memory > 0)]
        callable_with(repr(self), self.function, *given)
        code = getattr(self.function, "__code__", None)  # none of an object with a __call__
        if self.memory and code is not None and code.co_argcount >= len(given):
            name = code.co_varnames[len(given) - 1]
            if words := _forgotten(code, name):
                raise ValueError(
                    f"{self!r} {words}; allowed: to write into it, {name} += ... or {name}[:] = ..., and another name "
                    "for what is made of it"
                )

    def step(self, memory, sample):
        check_asked(type(self), CompiledLaw)
        desired, given = sample.desired, []
        if self.at is not None:
            q, qd = (desired.q, desired.qd) if self.at == "desired" else sample.pose(self.at)
            given.append(at_pose(sample.model, q, qd))
        if self.memory:
            given.append(memory)
        # It may write into what was measured, as it may compiled.
        return self._plain(sample.t, sample.q_a.copy(), sample.qd_a.copy(), desired, *given), memory

    def __repr__(self):
        name = getattr(self.function, "__name__", type(self.function).__name__)
        return f"compiled({name}, at={self.at!r}, memory={self.memory})"


def _function(module: str, name: str):
    """The function of a module, also where its name stands for the law that a decorator made of it."""
    found = operator.attrgetter(name)(importlib.import_module(module))
    return found.function if isinstance(found, CompiledLaw) else found


@functools.lru_cache(maxsize=64)
def _forgotten(code, name: str) -> str:
    """What a function does with its argument `name`, if no later call can see it; an empty text else."""
    tree = _source(code)
    above = {below: node for node in ast.walk(tree) for below in ast.iter_child_nodes(node)}
    uses = [node for node in above if isinstance(node, ast.Name) and node.id == name]
    if any(isinstance(use.ctx, ast.Store) and not isinstance(above[use], ast.AugAssign) for use in uses):
        return f"gives {name} a new value, which the next sample would not see"
    return f"reads {name} but never writes into it" if uses and all(_gives_a_number(above[use]) for use in uses) else ""


def _source(code) -> ast.Module:
    """The source of a function; an empty one where there is none, as for what a string defines, and for lambdas."""
    try:
        tree = ast.parse(textwrap.dedent(inspect.getsource(code)))
    except (OSError, SyntaxError):
        return ast.Module([], [])
    named = isinstance(tree.body[0], ast.FunctionDef) and tree.body[0].name == code.co_name
    return tree if named else ast.Module([], [])


def _gives_a_number(node: ast.AST) -> bool:
    """Does an expression make something new of an array in it: no view, through which it could be written?"""
    if isinstance(node, ast.Subscript):
        place = node.slice.operand if isinstance(node.slice, ast.UnaryOp) else node.slice
        return isinstance(node.ctx, ast.Load) and isinstance(place, ast.Constant) and type(place.value) is int
    return isinstance(node, ast.BinOp | ast.UnaryOp | ast.Compare | ast.Return)


def _law(module: str, name: str, at: str | None, memory: int) -> CompiledLaw:
    return CompiledLaw(_function(module, name), at, memory)


def _asked(at, memory) -> int:
    """The number of floats of a memory, where both arguments of `compiled` are what they may be."""
    if at is not None:
        one_of("at", at, ("desired", "measured", "true"))
    return whole_number("memory", memory, 0, 10**6)


def compiled(function=None, *, at: str | None = None, memory: int = 0):
    """Decorator: a law of yours runs inside the compiled loop, some fifty times as fast as in Python, more with `at`.

    The function takes t in s, the measured base angles q_a and rates qd_a (N,), and d, the desired motion with
    x, xd, xdd (2,), q, qd, qdd (2N,) and q_a, qd_a, qdd_a (N,); it returns the torques c (N,) in N m.

    at : "desired", "measured" or "true" adds an argument: pose, rates and matrices of `rapkm_lite.at` at that pose of
        the model.
    memory : a number of floats adds an argument, an array that is zero at the start of a run and yours to write, in
        place: ``memory += dt * e`` or ``memory[:] = ...``.  A run refuses ``memory = ...``, which the next sample would
        not see, and a memory that is only read.
    q_a and qd_a are the function's own, too: what it writes into them stays with it.  d and the matrices are to be
    read only: Python refuses writes into them, compiled code lets them through, for that sample.
    What Numba can compile is allowed: numbers, NumPy arrays, loops; nothing else from outside but functions under
    ``@numba.njit`` and constants, such as the sampling time of the path, which the function is not told, and which stay
    what they were at the first run.  Hand such functions arrays, such as d.q_a: d and at as a whole they take in the
    compiled loop only.
    Where Python raises for plain numbers, as at 1.0 / 0.0 or math.sqrt(-1.0), compiled code goes on with infinity, NaN
    or, for whole numbers, which have 64 bits there, with 0.
    Random numbers of `numpy.random` would differ from run to run: noise belongs in an array, an entry per sample.
    It is compiled once in every session, in the first run, which takes some seconds: worth it for many runs.
    A function made anew, such as a closure per gain, is compiled anew, and some megabytes stay with the session.
    Without Numba, and inside laws that run in Python, the function is called as it is; where it gave no finite torques,
    the run is repeated that way up to there, to find out what it raised.
    Raises ValueError for other values of `at` and `memory`, and when a run finds that the function does not compile.

    >>> import rapkm_lite as rk
    >>> dt = 1e-3
    >>> @rk.compiled(memory=3)
    ... def pi(t, q_a, qd_a, d, memory):
    ...     e = q_a - d.q_a
    ...     memory += dt * e
    ...     return -7.0 * e - 0.2 * (qd_a - d.qd_a) - 5.0 * memory
    >>> pi
    compiled(pi, at=None, memory=3)
    """
    if function is None:
        _asked(at, memory)
        return lambda f: CompiledLaw(f, at, memory)
    return CompiledLaw(function, at, memory)
