"""Times of jobs that take turns, so that a change of the machine's speed meets all of them alike."""

from __future__ import annotations

import statistics
import time
from typing import NamedTuple


class Times(NamedTuple):
    """Median and shortest time of a job, s."""

    median: float
    least: float

    def over(self, other: Times) -> str:
        """Ratio of the medians, and in brackets of the shortest times."""
        return f"{self.median / other.median:.2f} ({self.least / other.least:.2f})"


def in_turns(repeats: int, **jobs) -> dict[str, Times]:
    """Run all jobs once unmeasured, then A B C A B C ..."""
    times = {name: [] for name in jobs}
    for job in jobs.values():
        job()
    for _ in range(repeats):
        for name, job in jobs.items():
            start = time.perf_counter()
            job()
            times[name].append(time.perf_counter() - start)
    return {name: Times(statistics.median(values), min(values)) for name, values in times.items()}
