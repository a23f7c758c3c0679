"""Where the chunks of a study run: the executor of the caller, threads of our own, or one after the other."""

from __future__ import annotations

import pickle
import threading
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor
from contextlib import nullcontext, suppress


def pool_of(executor: Executor | None, threads: int):
    """A context with the executor of the caller, or with threads that end with it; with None where one is enough."""
    if executor is None and threads > 1:
        with suppress(Exception):  # of whatever kind, where no thread can be started: runs without them lose nothing
            threading.Thread(target=int).start()
            return ThreadPoolExecutor(threads)
    return nullcontext(executor)


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


def kept_here(value) -> bool:
    """Can a value not be sent to another process?"""
    try:
        pickle.loads(pickle.dumps(value))
    except Exception:
        return True
    return False


class Stop:
    """What stopped a run, `begun` or at its first sample; an exception that cannot be sent to another process becomes
    its words there."""

    def __init__(self, error: Exception, words: str, begun: bool):
        self.error, self.words, self.begun = error, words, begun

    def __reduce__(self):
        return Stop, (RuntimeError(self.words) if kept_here(self.error) else self.error, self.words, self.begun)
