"""Answers from outside: called with copies, whatever they do, and read as numbers."""

from __future__ import annotations

import copy
import functools
import inspect
import os
import traceback
from collections.abc import Callable
from contextlib import suppress
from contextvars import ContextVar
from pathlib import Path
from types import FrameType
from typing import Any, NamedTuple

import numpy as np

from ..simulation.runs import SimulationError

NOTHING = "no value is returned (is a return missing, or has a solver found nothing?)"
# Where the code of the package, of libraries and of Python itself lies.
_HOMES = Path(__file__).parents[1], Path(np.__file__).parents[1], Path(os.__file__).parent


class Result(NamedTuple):
    """What an examination finds: "ok", "close", "todo" or "wrong", one sentence, and the name of the mistake if any."""

    word: str
    sentence: str
    mistake: str = ""


class Ended(Exception):
    """What ends an examination before its last case; carries the `Result`."""

    def __init__(self, word: str, sentence: str, mistake: str = ""):
        super().__init__(Result(word, sentence, mistake))
        self.result = Result(word, sentence, mistake)


class NotYet(np.ndarray):
    """NaN in place of numbers that are secret and that the student does not have yet."""


class Masked(np.ndarray):
    """NaN in place of entries that are masked."""


def copied(value: Any) -> Any:
    """A copy of what could be changed in place; machines, paths and laws cannot, and stay."""
    if isinstance(value, np.ndarray):
        return np.array(value)
    if isinstance(value, tuple) and type(value) is tuple:
        return tuple(copied(v) for v in value)
    return copy.deepcopy(value) if isinstance(value, list | dict | set | bytearray) else value


REFERENCE: ContextVar[Callable | None] = ContextVar("reference", default=None)
"""The package's answer to the exercise that is judged right now."""


class Answer:
    """A function that gets copies, so that arithmetic in place changes nothing outside.  What `check` returns.

    own : the function as the student wrote it, None when there is none.
    student : the same, guarded, where it is wrong or close and the lesson goes on with the package's; else None.
    """

    def __init__(self, function: Callable, own: Callable | None = None, student: Callable | None = None):
        functools.update_wrapper(self, function)
        self._function, self.own, self.student = function, own, student

    def __call__(self, *arguments, **named):
        got = self._function(*map(copied, arguments), **{name: copied(value) for name, value in named.items()})
        return tidied(got)

    def __repr__(self) -> str:
        return f"<checked answer {getattr(self, '__name__', 'without a name')}>"


class Handed(Answer):
    """The package's answer, with which a lesson goes on; no part of an answer to the same exercise."""

    def __call__(self, *arguments, **named):
        if self._function is REFERENCE.get():
            words = "the answer calls what check handed on, the package's; run the cell that defines yours again"
            raise Ended("todo", words, "the package's")
        return super().__call__(*arguments, **named)


def tidied(got: Any) -> Any:
    """What a check reads as numbers, as a floating-point array, one number as a number; anything else as it is."""
    # Every number has __float__, one of SymPy too; arrays of other packages, and matrices of SymPy, have __array__.
    if isinstance(got, list | tuple) or hasattr(got, "__array__") or hasattr(got, "__float__"):
        with suppress(Exception):  # objects that others made stop in many ways
            numbers = np.asarray(got)
            if numbers.dtype.kind == "O":  # such as those of SymPy
                numbers = numbers.astype(float)
            if numbers.dtype.kind in "iuf":
                return numbers.astype(float).reshape(() if numbers.size == 1 else numbers.shape)[()]
    return got


def _words(error: BaseException) -> str:
    try:
        text = " ".join(str(error).split())
    except Exception:
        text = "a message that cannot be shown"
    if len(text) > 200:
        text = (text[:200].rpartition(" ")[0] or text[:200]) + " …"
    return f"{type(error).__name__}: {text.rstrip('.')}" if text else type(error).__name__


def _unfinished(error: BaseException | None) -> bool:
    """True when NotImplementedError stands behind an error, also one raised on the way up."""
    while error is not None:
        if isinstance(error, NotImplementedError):
            return True
        error = error.__cause__ or error.__context__
    return False


def _outside(error: BaseException) -> bool:
    """True when code that is neither the package's nor a library's was at work when the error was raised."""
    files = {_file(frame) for frame, _ in traceback.walk_tb(error.__traceback__)}
    return any(not file.startswith(tuple(f"{home}{os.sep}" for home in _HOMES)) for file in files)


def _file(frame: FrameType) -> str:
    """Where the code of a frame stands; what a dataclass writes for itself stands in the module of the class."""
    file = frame.f_code.co_filename
    return frame.f_globals.get("__file__", file) if file == "<string>" else file


def guarded(action: Callable, *arguments) -> Any:
    """The result of code from outside; every way to stop but Ctrl-C ends in `Ended`."""
    try:
        return action(*arguments)
    except (KeyboardInterrupt, Ended):
        raise
    except BaseException as error:
        if _unfinished(error):
            raise Ended("todo", "not yet") from None
        if isinstance(error, SimulationError) and isinstance(error.__cause__, Ended):
            result = error.__cause__.result  # earlier samples of this run had an answer
            raise Ended("wrong", f"at t = {error.time:.4f} s of a run {result.sentence}", result.mistake) from None
        if isinstance(error, SimulationError) and error.__cause__ is None:
            raise Ended("wrong", f"a run is lost: {_words(error).partition(': ')[2]}", "a lost run") from None
        if isinstance(error, ValueError) and not _outside(error):  # what the package says of a design that it tries
            words = _words(error).removeprefix(f"{type(error).__name__}: ")
            raise Ended("wrong", f"it cannot be tried: {words}", "cannot be tried") from None
        kind = f"stops with {type(error).__name__}"
        raise Ended("wrong", f"your code stops with {_words(error)}", kind) from None


def given(answer: Any, case: tuple) -> Any:
    """What a function answers for one case, or the value itself; ends the examination where there is none yet."""
    if isinstance(answer, type):
        sentence = f"the answer is the class {answer.__name__}; a value or a function is wanted"
        raise Ended("wrong", sentence, "not numeric")
    got = returned(guarded(answer, *map(copied, case))) if callable(answer) else returned(answer)
    if inspect.iscoroutine(got):
        got.close()
        raise Ended("wrong", "the answer is a coroutine: write def, not async def", "not numeric")
    return got


def given_law(make: Any, robot: Any) -> Any:
    """The law that an answer makes for a machine; ends the examination where it uses a pose that nobody measures."""
    law = part = given(make, (robot,))
    while part is not None:
        if getattr(part, "pose", None) == "true":
            words = "the law believes the true pose, which no controller knows; take the measured one"
            raise Ended("wrong", words, "true pose")
        part = getattr(part, "law", None)
    return law


def blind(law: Any, desired: Any) -> bool:
    """True for a function that gives the same torques, early and late, whatever the encoders read, dead ones too."""
    if not inspect.isfunction(law):
        return False
    q_a, qd_a = desired.q_a, desired.qd_a
    readings = [(q_a + error, qd_a + 10 * error) for error in (0.0, 0.01, -0.02)]
    readings += [(q_a + 0.01, qd_a * (np.arange(len(q_a)) != dead)) for dead in range(len(q_a))]
    given = [[law(t, *reading, desired) for reading in readings] for t in (0.6, 1.4, 2.4)]
    return np.shape(given)[2:] == q_a.shape and bool(np.ptp(given, axis=1).max() < 1e-12)


def stiffness(law: Any, desired: Any, frozen: bool = False, t: float = 0.6) -> np.ndarray:
    """Change of a function's torques with each measured angle, (N, N) in N m/rad: row i holds drive i.

    frozen : the encoder of that angle gives no rate, as a dead one.  NaN for a law that is no function.
    """
    drives, columns = np.eye(len(desired.q_a)), []
    for drive in drives if inspect.isfunction(law) else ():
        rates = desired.qd_a * (1.0 - drive) if frozen else desired.qd_a
        more, less = (np.array(law(t, desired.q_a + s * drive, rates, desired), float) for s in (1e-3, -1e-3))
        columns.append((more - less) / 2e-3)
    return np.array(columns).T if columns else np.full(drives.shape, np.nan)


def returned(got: Any) -> Any:
    """What a function of the student gave back; ends the examination where that is nothing."""
    if got is None or got is Ellipsis or got is NotImplemented:
        raise Ended("todo", NOTHING)
    return got


def _array(got: Any) -> np.ndarray:
    parts = got if isinstance(got, list | tuple) else [got]
    if any(np.ma.is_masked(part) for part in parts):
        filled = [np.ma.filled(np.ma.asarray(part).astype(float), np.nan) for part in parts]
        return np.asarray(filled if parts is got else filled[0]).view(Masked)
    array = np.asarray(got)
    if array.dtype.kind == "O":
        array = array.astype(complex if any(isinstance(v, complex) for v in array.flat) else float)
    return array


def _shape(part: Any) -> tuple[int, ...]:
    return getattr(part, "shape", (len(part),) if isinstance(part, list | tuple) else ())


def numbers(got: Any) -> np.ndarray:
    """An answer as an array of floating-point numbers, a copy; ends the examination where it is none."""
    try:
        array = guarded(_array, got)
    except Ended:
        kind, parts = type(got).__name__, ""
        shapes = [str(_shape(part)) for part in got] if isinstance(got, tuple | list) else []
        if len(set(shapes)) > 1:
            parts = f": {len(got)} arrays, of shapes {', '.join(shapes)}, where one is wanted"
        large = ", or too large" * isinstance(got, int | list | tuple | np.ndarray)
        sentence = f"the answer is not numeric but of type {kind}{parts or large}"
        raise Ended("wrong", sentence, "not numeric") from None
    if array.size > 10**7:
        raise Ended("wrong", f"the answer holds {array.size} numbers; a few are wanted", "another shape")
    if array.dtype.kind == "c":
        real = " (.real of it, since all imaginary parts are zero, as after np.linalg.eig)" * (not array.imag.any())
        raise Ended("wrong", f"the answer is complex; a real one is wanted{real}", "complex")
    if array.dtype.kind not in "iuf":
        of = f" of {array.dtype.name}" * isinstance(got, np.ndarray)
        raise Ended("wrong", f"the answer is not numeric but of type {type(got).__name__}{of}", "not numeric")
    return np.array(array, dtype=float, subok=isinstance(array, Masked))


def fitting(got: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """The numbers in the expected shape, and finite; a single number may come as an array of one."""
    if shape == () and got.size == 1:
        got = got.reshape(())
    if got.shape != shape:
        if got.ndim == 2 and got.shape == shape[::-1]:
            words = f"the answer has the shape of the transposed one: {got.shape}, expected {shape}"
            raise Ended("wrong", words, "transposed")
        flat, other = "; a flat array is wanted", "; their number is right, the rows and columns are not"
        extra = (flat if len(shape) == 1 else other) * (got.size == int(np.prod(shape)) and got.size > 1)
        wanted = shape or "one number"
        raise Ended("wrong", f"the answer has shape {got.shape}, expected {wanted}{extra}", "another shape")
    if isinstance(got, Masked):
        raise Ended("wrong", "the answer is masked in some entries; numbers are wanted", "masked")
    if not np.all(np.isfinite(got)):
        raise Ended("wrong", "the answer holds NaN or infinity", "NaN or infinity")
    if np.abs(got).max(initial=0.0) > 1e100:
        raise Ended("wrong", f"the answer holds numbers as large as {np.abs(got).max():.3g}", "too large")
    return got
