"""The stage under many load cases, on any executor."""

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from carrierflex.simulation.carrier.run_cases import Sensor
from carrierflex.simulation.stage.readings import ReadingEffects
from carrierflex.simulation.stage.response import StageDivergedError
from carrierflex.simulation.stage.stage_model import StageModel
from carrierflex.simulation.stage.stage_run import StageResponse, simulate_stage
from carrierflex.simulation.stage.statics import SteadyLoad

#: Load cases sent in one piece of work: the model travels once for all of them.
_LOADS_A_PIECE = 10


def simulate_load_cases(
    model: StageModel,
    loads: Sequence[SteadyLoad],
    sensors: Sequence[Sensor],
    *,
    summary: Callable[[Iterator[StageResponse]], Any],
    executor: Executor,
    duration: float,
    sample_rate: float,
    step: float,
    effects: ReadingEffects | None = None,
) -> Iterator[Any]:
    """Simulate the stage under many steady loads and summarise each run where it was made.

    Parameters
    ----------
    model : StageModel
        The stage.
    loads : sequence of SteadyLoad
        Load cases.
    sensors : sequence of Sensor
        Sensors to read.
    summary : callable
        What is kept of a run, from its consecutive pieces (:func:`rms_of_signals`); importable by
        name where the executor has other processes.
    executor : concurrent.futures.Executor
        Processes, or a cluster: the march holds the interpreter's lock, so that threads wait for
        each other. Of Dask, ``client.get_executor()``.
    duration, sample_rate, step : float
        Length of every run [s], kept instants a second [1/s], longest step [s].
    effects : ReadingEffects, optional
        What lies between motion and record.

    Yields
    ------
    object
        Summaries, in the order of the loads; memory does not grow with their number. A run that
        diverges gives its ``StageDivergedError`` in the place of the summary.

    Raises
    ------
    ValueError
        Where the step does not resolve the mesh frequency, or the duration holds no sample.
    """
    run = partial(
        simulate_stage,
        model,
        sensors=sensors,
        duration=duration,
        sample_rate=sample_rate,
        step=step,
        effects=effects,
    )
    futures = deque(
        executor.submit(_summaries, run, loads[first : first + _LOADS_A_PIECE], summary)
        for first in range(0, len(loads), _LOADS_A_PIECE)
    )
    while futures:
        yield from futures.popleft().result()


def rms_of_signals(pieces: Iterator[StageResponse]) -> NDArray[np.float64]:
    """RMS of every signal over a run [m], shape (n_sensors,), in the order of the sensors."""
    square: float | NDArray[np.float64] = 0.0
    n_samples = 0
    for piece in pieces:
        signals = np.array(list(piece.signals.values()))
        square = square + (signals**2).sum(axis=1)
        n_samples += signals.shape[1]
    return np.asarray(np.sqrt(square / n_samples), dtype=np.float64)


def _summaries(
    run: Callable[[SteadyLoad], Iterator[StageResponse]],
    loads: Sequence[SteadyLoad],
    summary: Callable[[Iterator[StageResponse]], Any],
) -> list[Any]:
    results: list[Any] = []
    for load in loads:
        try:
            results.append(summary(run(load)))
        except StageDivergedError as error:
            results.append(error)
    return results
