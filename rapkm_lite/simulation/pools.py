"""Where the chunks of a study run: the executor of the caller, threads of our own, or one after the other."""

from __future__ import annotations

import pickle
import sys
import threading
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor
from contextlib import contextmanager
from functools import partial

from ..machine.arguments import short


@contextmanager
def pool_of(executor: Executor | None, threads: int):
    """The executor of the caller, or threads of our own, which end with the sweep; none where one is enough."""
    pool = executor or (ThreadPoolExecutor(threads) if threads > 1 and _threads() else Serial())
    try:
        yield pool
    finally:
        if executor is None:
            pool.shutdown(cancel_futures=True)


def answer(job: Future, first: int, setup, laws, offsets):
    """What `run_chunk` answers for the runs from `first` on.

    Raises ValueError where an executor could not send it to another process, for a law or fault that does not travel.
    """
    try:
        return job.result()
    except BrokenExecutor as error:
        if not hasattr(sys.modules["__main__"], "__file__"):
            error.add_note(
                "What was written in a notebook only a process that is forked finds; allowed: laws and faults of a "
                "module, or threads (executor = None or a ThreadPoolExecutor)"
            )
        raise
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        sent = {f"law of run {i}": law for i, law in enumerate(laws, first)}
        sent |= {f"fault {i}": fault for i, fault in enumerate(setup.broken)}
        for name, value in sent.items():
            if words := kept_here(value):
                raise ValueError(
                    f"{name} = {short(value)} cannot be sent to another process ({words}); allowed: what pickle sends, "
                    "such as a def or a class of a module, or threads (executor = None or a ThreadPoolExecutor)"
                ) from error
        raise


def kept_here(value) -> str:
    """Why a value cannot be sent to another process; nothing where it can."""
    try:
        pickle.loads(pickle.dumps(value))
        return ""
    except Exception as error:
        return " ".join(str(error).split()) or type(error).__name__


class Stop:
    """What stopped a run, `begun` or at its first sample; an exception that cannot be sent to another process becomes
    its words there."""

    def __init__(self, error: Exception, words: str, begun: bool):
        self.error, self.words, self.begun = error, words, begun

    def __reduce__(self):
        return Stop, (RuntimeError(self.words) if kept_here(self.error) else self.error, self.words, self.begun)


def _threads() -> bool:
    """Can a thread be started here?"""
    try:
        threading.Thread(target=int).start()
        return True
    except RuntimeError:
        return False


class Serial(Executor):
    """Does a job when its result is asked for, in the thread that asks."""

    def submit(self, function, *arguments, **named):
        return Job(partial(function, *arguments, **named))


class Job(Future):
    """A job of `Serial`."""

    def __init__(self, work):
        super().__init__()
        self._work = work

    def result(self, timeout=None):
        if not self.done():
            self.set_result(self._work())
        return super().result(timeout)
