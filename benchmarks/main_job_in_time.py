"""What stage and mounting in time add to the main job: processor time with them over that without.

    python -m benchmarks.main_job_in_time [PAIRS] [SIZE]

Every run is ``carrierflex run`` in a process of its own, with and without in turn. The job without
has records of stage and mounting that stand still in place of the simulated ones: everything else,
the summary included, is the same.
"""

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.ratio import PROCESSOR_TIME, Absent, Ratio, Row, at_most
from benchmarks.run import run_alone
from carrierflex.geometry.parameters import DEFAULT_SIZE, CarrierParameters
from carrierflex.simulation.carrier.case_files import shipped_case
from carrierflex.simulation.stage.stage_cases import read_stage_case
from carrierflex.workflows.main_job import run as main_job
from carrierflex.workflows.main_job import run_reduced_bodies

#: Two whole main jobs take more than half of a quick run's five minutes on any mesh: none of them.
QUICK = {"pairs": 0}
#: Samples of the records that stand still: more than the summary looks at.
_SAMPLES = 1000
_WITHOUT = "without"


@dataclass(frozen=True)
class _Pair:
    """Processor time [s] of a job with stage and mounting in time, and of one without."""

    with_them: float
    without: float


def ratios(pairs: int = 3, size: float = DEFAULT_SIZE) -> Iterator[Row]:
    """Processor seconds of both jobs, pair by pair, and the ratio of their sums.

    Parameters
    ----------
    pairs
        How often both are run; 0 leaves them out.
    size
        Element edge length [m].
    """
    if not pairs:
        yield Absent("the job without", "whole jobs take minutes: left out of a quick run")
        return
    measured = []
    for number in range(1, pairs + 1):
        pair = _Pair(_processor_seconds("with", size), _processor_seconds(_WITHOUT, size))
        measured.append(pair)
        yield Ratio(f"pair {number}, with", PROCESSOR_TIME, pair.with_them)
        yield Ratio(f"pair {number}, without", PROCESSOR_TIME, pair.without)
    ratio = sum(pair.with_them for pair in measured) / sum(pair.without for pair in measured)
    case = f"main job, elements of {size} m: with stage and mounting in time over without"
    yield Ratio(case, replace(PROCESSOR_TIME, unit=""), ratio, wanted=at_most(1.5))


def _processor_seconds(kind: str, size: float) -> float:
    """Processor time [s] of one main job, its own processes included."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "benchmarks.main_job_in_time", "--job", kind, str(size)]
        process = subprocess.Popen([*command, folder])
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise RuntimeError(f"the main job {kind} ended with exit code {process.returncode}")
    return used.ru_utime + used.ru_stime


def _still(
    carrier: object, pin: object, gear: object, **_: object
) -> run_reduced_bodies.BodiesAtWork:
    """Columns of stage and mounting that nothing moves, made without simulating."""
    case = read_stage_case(shipped_case(run_reduced_bodies.STAGE_CASE))
    names = [
        "time",
        "carrier_angle",
        *(sensor.name for sensor in case.sensors),
        *(f"share_{pin_number + 1}" for pin_number in range(CarrierParameters.n_planets)),
        "housing_theta_x",
    ]
    zero = np.zeros(_SAMPLES)
    stage = dict.fromkeys(names, zero)
    return run_reduced_bodies.BodiesAtWork(case, stage, 0.0, {"time": zero, "theta_x": zero})


def _job(kind: str, size: float, folder: Path) -> None:
    if kind == _WITHOUT:
        replaced: Any = run_reduced_bodies
        replaced.main = _still
    main_job.main(out=folder, size=size, quiet=True)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--job"]:
        _job(sys.argv[2], float(sys.argv[3]), Path(sys.argv[4]))
    else:
        run_alone(ratios)
