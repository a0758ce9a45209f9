"""Many load cases of the planetary stage in two processes, and one after another.

    python -m benchmarks.stage_load_cases [CASES] [DURATION] [SIZE]

The efficiency is the time of the runs one after another over twice that of two processes for the
same runs, their start and the way of model and summaries included. Of wall time it needs two free
cores; of processor time it is the runs' alone over that of both processes, on any machine. Memory
is the largest of one process, with a tenth of the cases and with all.
"""

import resource
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from benchmarks.measured import Measured, measured
from benchmarks.ratio import MEMORY, Quantity, Ratio, at_least
from benchmarks.run import run_alone
from benchmarks.stage_speed import RATE, SENSORS, SPEED_RAD
from carrierflex.simulation.stage.batch import rms_of_signals, simulate_load_cases
from carrierflex.simulation.stage.stage_model import StageModel, stage_model
from carrierflex.simulation.stage.statics import SteadyLoad
from carrierflex.workflows.executors import SerialExecutor, other_processes

QUICK = {"cases": 40, "duration": 1.0, "size": 0.08}

EFFICIENCY = Quantity("efficiency on two cores", larger_is_better=True)
DIFFERENCE = Quantity("largest difference over the largest RMS")
_STEP = 1e-3


def ratios(cases: int = 1000, duration: float = 2.0, size: float = 0.06) -> Iterator[Ratio]:
    """Efficiency of two processes by both clocks, their memory, and whether the results agree.

    Parameters
    ----------
    cases
        Load cases.
    duration
        Length of every run [s].
    size
        Element edge length of carrier and pins [m].
    """
    # Its processes import this file, and need no meshes.
    from carrierflex.workflows.simulation.stage_bodies import default_stage_body

    model = stage_model(default_stage_body(1e6, size), speed=SPEED_RAD)
    rng = np.random.default_rng(0)
    loads = [
        SteadyLoad(torque, *radial)
        for torque, radial in zip(
            rng.uniform(100e3, 400e3, cases), rng.uniform(-2e5, 2e5, (cases, 2)), strict=True
        )
    ]
    with threadpool_limits(1):
        _summaries(model, loads[:1], duration, SerialExecutor())  # compiles
        alone = measured(lambda: _summaries(model, loads, duration, SerialExecutor()))
        few, _, few_gb = _in_two_processes(model, loads[: max(cases // 10, 2)], duration)
        every, processor, every_gb = _in_two_processes(model, loads, duration)
    case = f"{cases} load cases of {duration:g} s"
    note = f"{alone.wall:.0f} s one after another, {every.wall:.0f} s in two processes"
    wall = alone.wall / (2.0 * every.wall)
    yield Ratio(case, EFFICIENCY, wall, note=f"wall time: {note}", wanted=at_least(0.9))
    note = f"processor time: {alone.processor:.0f} s and {processor:.0f} s"
    yield Ratio(case, EFFICIENCY, alone.processor / processor, note=note, wanted=at_least(0.9))
    yield Ratio(case, MEMORY, every_gb, f"{len(few.result)} cases", few_gb, at_least(0.9))
    difference = np.abs(every.result - alone.result).max() / alone.result.max()
    yield Ratio(case, DIFFERENCE, float(difference))


def _summaries(
    model: StageModel, loads: Sequence[SteadyLoad], duration: float, executor: Executor
) -> NDArray[np.float64]:
    """RMS of the sensors by load case."""
    return np.array(
        list(
            simulate_load_cases(
                model,
                loads,
                SENSORS,
                summary=rms_of_signals,
                executor=executor,
                duration=duration,
                sample_rate=RATE,
                step=_STEP,
            )
        )
    )


def _in_two_processes(
    model: StageModel, loads: Sequence[SteadyLoad], duration: float
) -> tuple[Measured[NDArray[np.float64]], float, float]:
    """The runs with their wall time, the processor time [s] of both, and their peak memory [GB]."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)

    def work() -> NDArray[np.float64]:
        with other_processes(2) as executor:
            return _summaries(model, loads, duration, executor)

    run = measured(work)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return run, used, after.ru_maxrss * 1024 / 1e9


if __name__ == "__main__":
    run_alone(ratios)
