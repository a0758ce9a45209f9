"""Times of one piece of work, and the table that sets wanted beside reached."""

import resource
import time
from dataclasses import dataclass


@dataclass(frozen=True)
class Measured:
    """Result of a piece of work, wall and processor time [s]."""

    result: object
    wall: float
    processor: float

    def __str__(self):
        return f"{self.wall:8.2f} s wall {self.processor:8.2f} s processor"


def measured(work):
    wall, processor = time.perf_counter(), time.process_time()
    result = work()
    return Measured(result, time.perf_counter() - wall, time.process_time() - processor)


def fastest(work, repeats):
    """Measure `work` several times, every result freed before the next.

    The fastest wall time, the last result.
    """
    best, run = None, None
    for _ in range(repeats):
        run = None
        run = measured(work)
        best = (
            (run.wall, run.processor)
            if best is None
            else (min(best[0], run.wall), min(best[1], run.processor))
        )
    return Measured(run.result, *best)


def peak_gb():
    """Largest memory of this process so far [GB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e9


def print_ratios(rows):
    """Print (what, wanted, reached) rows; 'wanted' holds the comparison, such as ``>= 20``."""
    width = max(len(what) for what, _, _ in rows)
    print(f"{'':{width}}  {'wanted':>10}  reached")
    for what, wanted, reached in rows:
        print(f"{what:{width}}  {wanted:>10}  {reached}")
