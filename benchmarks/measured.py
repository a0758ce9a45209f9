"""Wall time, processor time and memory of one call."""

import resource
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

Result = TypeVar("Result")
_CLOCKS = ("wall", "processor")


@dataclass(frozen=True)
class Measured(Generic[Result]):
    """Result of a call, its wall and its processor time [s]."""

    result: Result
    wall: float
    processor: float


def measured(work: Callable[[], Result]) -> Measured[Result]:
    """Call `work` once with the clocks running."""
    wall = time.perf_counter()
    processor = time.process_time()
    result = work()
    return Measured(result, time.perf_counter() - wall, time.process_time() - processor)


def fastest(work: Callable[[], Result], repeats: int) -> Measured[Result]:
    """Measure `work` several times, every result freed before the next.

    Returns
    -------
    Measured
        The last result, and the shortest of the wall and of the processor times [s].
    """
    last = measured(work)
    wall, processor = last.wall, last.processor
    for _ in range(repeats - 1):
        del last
        last = measured(work)
        wall = min(wall, last.wall)
        processor = min(processor, last.processor)
    return Measured(last.result, wall, processor)


def medians(runs: Sequence[Measured[Result]]) -> Measured[Result]:
    """The last result, and the medians of the wall and of the processor times [s]."""
    wall, processor = (float(np.median([getattr(r, k) for r in runs])) for k in _CLOCKS)
    return Measured(runs[-1].result, wall, processor)


def best_of(seconds_of: Callable[[], float], budget: float) -> float:
    """Shortest of the times [s] that `seconds_of` returns.

    It is called for `budget` seconds and at least three times: other work on the machine only slows
    a call down, so that the shortest is the nearest to its own time.
    """
    begin = time.perf_counter()
    times: list[float] = []
    while time.perf_counter() - begin < budget or len(times) < 3:
        times.append(seconds_of())
    return min(times)


def wall_seconds(work: Callable[[], object]) -> float:
    """Wall time [s] of one call, its result dropped."""
    return measured(work).wall


def peak_gb() -> float:
    """Largest memory of this process so far [GB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e9
