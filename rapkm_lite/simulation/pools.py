"""Where the chunks of a study run: the executor of the caller, threads of our own, or one after the other."""

from __future__ import annotations

import threading
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import contextmanager


@contextmanager
def pool_of(executor: Executor | None, threads: int):
    """The executor of the caller, or threads of our own, which end with the sweep; none where one is enough."""
    pool = executor or (ThreadPoolExecutor(threads) if threads > 1 and _threads() else Serial())
    try:
        yield pool
    finally:
        if executor is None:
            pool.shutdown(cancel_futures=True)


def _threads() -> bool:
    """Can a thread be started here?"""
    try:
        thread = threading.Thread(target=int)
        thread.start()
        thread.join()
        return True
    except Exception:
        return False


class Serial(Executor):
    """Does a job when its result is asked for, in the thread that asks."""

    def submit(self, function, *arguments, **named):
        return Job(function, arguments, named)


class Job(Future):
    """A job of `Serial`."""

    def __init__(self, *job):
        super().__init__()
        self._job = job

    def result(self, timeout=None):
        if not self.done():
            function, arguments, named = self._job
            self.set_result(function(*arguments, **named))
        return super().result(timeout)
