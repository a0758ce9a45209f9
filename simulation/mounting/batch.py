"""The same run with many parameter sets, on any executor."""

from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from typing import Any

import numpy as np
from numpy.typing import NDArray

from carrierflex.simulation.mounting.inputs import MountingInputs
from carrierflex.simulation.mounting.parameter_arrays import check_parameters
from carrierflex.simulation.mounting.rig import MountingRig
from carrierflex.simulation.mounting.simulate import DivergedError, MountingResponse, simulate

#: Parameter sets sent in one piece of work: the inputs (2 MB for 520 s) travel once for all of
#: them.
_SETS_A_PIECE = 25


def simulate_batch(
    rig: MountingRig,
    parameter_sets: NDArray[np.float64],
    inputs: MountingInputs,
    *,
    summary: Callable[[MountingResponse], Any],
    executor: Executor,
    step: float | None = None,
) -> Iterator[Any]:
    """Simulate one run with many parameter sets and summarise each response where it was made.

    Parameters
    ----------
    rig : MountingRig
        Geometry and masses.
    parameter_sets : ndarray, shape (n_sets, n_parameters)
        Flat parameter sets.
    inputs : MountingInputs
        Loads of the run.
    summary : callable
        What is kept of a response (an objective, RMS values); importable by name where the executor
        has other processes. A thousand whole responses of 520 s would need 2.5 GB.
    executor : concurrent.futures.Executor
        Threads serve well (the march holds no interpreter lock), processes and a cluster too.
    step : float, optional
        Largest step [s] of nonlinear bushings; chosen from their stiffness where not given.

    Yields
    ------
    object
        Summaries, in the order of the parameter sets. A set whose run diverges gives its
        ``DivergedError`` in the place of the summary: a search goes on without it.

    Raises
    ------
    ValueError
        Where a parameter set is out of bounds; before anything runs.
    """
    for number, parameters in enumerate(parameter_sets):
        try:
            check_parameters(parameters)
        except ValueError as error:
            raise ValueError(f"parameter set {number}: {error}") from error
    pieces = [
        parameter_sets[i : i + _SETS_A_PIECE] for i in range(0, len(parameter_sets), _SETS_A_PIECE)
    ]
    futures = [executor.submit(_summaries, rig, piece, inputs, summary, step) for piece in pieces]
    for future in futures:
        yield from future.result()


def rms_of_sensors(response: MountingResponse) -> NDArray[np.float64]:
    """RMS of every sensor [m], shape (6,)."""
    return np.sqrt(np.mean(response.signals**2, axis=0))


def _summaries(
    rig: MountingRig,
    parameter_sets: NDArray[np.float64],
    inputs: MountingInputs,
    summary: Callable[[MountingResponse], Any],
    step: float | None,
) -> list[Any]:
    results: list[Any] = []
    for parameters in parameter_sets:
        try:
            results.append(summary(simulate(rig, parameters, inputs, step=step)))
        except DivergedError as error:
            results.append(error)
    return results
