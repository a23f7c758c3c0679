"""Where the chunks of a study run: the executor of the caller, threads of our own, or one after the other."""

from __future__ import annotations

import pickle
import threading
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor
from contextlib import contextmanager
from functools import partial


@contextmanager
def pool_of(executor: Executor | None, threads: int):
    """The executor of the caller, or threads of our own, which end with the sweep; none where one is enough."""
    pool = executor or (ThreadPoolExecutor(threads) if threads > 1 and _threads() else Serial())
    try:
        yield pool
    finally:
        if executor is None:
            pool.shutdown(cancel_futures=True)


def answer(job: Future):
    """What `run_chunk` answers; an error of the way to another process and back gets a note on what can go it."""
    try:
        return job.result()
    except (BrokenExecutor, pickle.PicklingError, AttributeError, TypeError) as error:
        error.add_note(
            "Other processes find laws and faults only in modules, and in a notebook only where they are forked; "
            "allowed, too: threads (executor = None or a ThreadPoolExecutor)."
        )
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
