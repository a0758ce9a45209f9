"""Where the main job's processor time and memory go, stage by stage.

    python -m benchmarks.main_job_stages [SIZE]

One run of ``carrierflex run`` in this process, on one thread.
"""

import re
import resource
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

from benchmarks.ratio import MEMORY, PROCESSOR_TIME, Absent, Ratio, Row, at_most
from benchmarks.run import run_alone
from carrierflex.geometry.parameters import DEFAULT_SIZE
from carrierflex.workflows.main_job import run as main_job
from carrierflex.workflows.progress import Stages

#: A whole main job takes more than half of a quick run's five minutes on any mesh.
QUICK = {"size": 0.0}

_STATUS = Path("/proc/self/status")
_RESET_PEAK = Path("/proc/self/clear_refs")


class _CountedStages(Stages):
    """Stages that count what each takes of processor time [s] and memory [GB]."""

    counted: list[tuple[str, float, float]]

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Count a stage."""
        _RESET_PEAK.write_text("5", encoding="ascii")
        before = _processor_seconds()
        with super().stage(name):
            yield
        self.counted.append((name, _processor_seconds() - before, _peak_gb()))


def ratios(size: float = DEFAULT_SIZE) -> Iterator[Row]:
    """Processor seconds and peak memory of every stage, and of the job.

    Parameters
    ----------
    size
        Element edge length [m]; 0 leaves the job out.
    """
    if not size:
        yield Absent("main job", "a whole job takes minutes: left out of a quick run")
        return
    if not _RESET_PEAK.exists():
        yield Absent("main job", "the memory of a stage is known on Linux only")
        return
    counted: list[tuple[str, float, float]] = []
    _CountedStages.counted = counted
    replaced: Any = main_job
    replaced.Stages = _CountedStages
    with tempfile.TemporaryDirectory() as folder, threadpool_limits(1):
        main_job.main(out=Path(folder), size=size, quiet=True)
    for name, seconds, peak in counted:
        yield Ratio(name, PROCESSOR_TIME, seconds)
        yield Ratio(name, MEMORY, peak)
    yield Ratio("whole job, imports included", PROCESSOR_TIME, _processor_seconds())
    peak = max(peak for _, _, peak in counted)
    yield Ratio("whole job", MEMORY, peak, wanted=at_most(2.5))


def _processor_seconds() -> float:
    """Processor time of this process and of those it waited for."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in used)


def _peak_gb() -> float:
    """Largest memory of this process since it was last reset."""
    match = re.search(r"VmHWM:\s+(\d+) kB", _STATUS.read_text(encoding="ascii"))
    return int(match[1]) * 1024 / 1e9 if match else float("nan")


if __name__ == "__main__":
    run_alone(ratios)
