"""The compiled kernels under `simulation`: one sampled closed loop for all laws, one run or many side by side.

`rows` is the work table that everything stands in, `tables` describes machine, motion and sensors to the kernels,
`leaves` are the formulas of one arm.  From them, `plant` (many runs) and `single` (one run) sense and hold, `pose`
finds the pose, `laws` command, `user` and `pointer` ask a law that a user compiled, and `loop` is the loop.  Numba is
imported, and code compiled, at the first run.
"""

from __future__ import annotations

import contextlib
import functools
import importlib.util
import os
import signal
import threading
import warnings

_WANTED = os.environ.get("RAPKM_LITE_NUMBA", "1").strip().lower() not in ("0", "false", "no", "off")
# Numba's own switch, for debuggers and coverage: its functions are then plain ones, and no kernels.
_FREE = os.environ.get("NUMBA_DISABLE_JIT", "").strip() in ("", "0")


def _installed() -> bool:
    """Can Numba be found?  An import hook that forbids it, or an empty module in its place, means no."""
    try:
        return importlib.util.find_spec("numba") is not None
    except (ImportError, ValueError):
        return False


COMPILED = _WANTED and _FREE and _installed()
"""Is Numba wanted and installed?  Whether it works, `compiled` says."""


@contextlib.contextmanager
def _uninterrupted():
    """A Ctrl-C waits for the end: of a Numba that was imported by half the rest cannot be imported any more."""
    usual = signal.getsignal(signal.SIGINT)
    if usual is None or threading.current_thread() is not threading.main_thread():
        yield
        return
    waiting = []
    signal.signal(signal.SIGINT, lambda *call: waiting.append(call))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, usual)
        if waiting:
            signal.raise_signal(signal.SIGINT)


@functools.cache
def compiled() -> bool:
    """Do kernels run compiled?  The first call imports Numba, and warns once where that fails."""
    if COMPILED:
        try:
            with _uninterrupted():
                from numba import njit  # the folder that an uninstalled Numba left behind would import, empty
        except Exception as error:
            warnings.warn(
                f"Numba is installed but does not import ({type(error).__name__}: {error}): runs go through plain "
                "Python, slower, with the same numbers; RAPKM_LITE_NUMBA=0 does without it",
                RuntimeWarning,
                stacklevel=2,
            )
            return False
    return COMPILED


def without_compiler() -> None:
    """Plain Python from now on, for a process whose few runs end sooner so; to be called before the first run."""
    global COMPILED
    COMPILED = False
    compiled.cache_clear()
