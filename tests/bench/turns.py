"""Times of jobs that take turns, so that a change of the machine's speed meets all of them alike."""

from __future__ import annotations

import statistics
import sys
import time
from typing import NamedTuple

# The time of the calling thread does not see other programs that wait; on Windows it is too coarse.
OWN_TIME = time.perf_counter if sys.platform == "win32" else time.thread_time


class Times(NamedTuple):
    """Median and shortest time of a job, s."""

    median: float
    least: float

    def over(self, other: Times) -> str:
        """Ratio of the medians, and in brackets of the shortest times."""
        return f"{self.median / other.median:.2f} ({self.least / other.least:.2f})"


def in_turns(repeats: int, clock=time.perf_counter, warm: bool = False, **jobs) -> dict[str, Times]:
    """Run all jobs once unmeasured, then A B C A B C ...

    warm : run each twice in its turn, and measure the second time: jobs of half a millisecond would else be told apart
    by what the job before them has left in the caches.
    """
    times = {name: [] for name in jobs}
    for job in jobs.values():
        job()
    for _ in range(repeats):
        for name, job in jobs.items():
            if warm:
                job()
            start = clock()
            job()
            times[name].append(clock() - start)
    return {name: Times(statistics.median(values), min(values)) for name, values in times.items()}
