"""Simulation of a run on the mounting rig: loads in, six displacement signals out."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.simulation.force_laws import ForceLaw
from carrierflex.simulation.mounting.inputs import MountingInputs
from carrierflex.simulation.mounting.parameter_arrays import ParameterArray
from carrierflex.simulation.mounting.parameters import INDEX
from carrierflex.simulation.mounting.rig import SENSORS, MountingRig
from carrierflex.simulation.mounting.time_integration import (
    DivergedError,
    first_signals,
    marched,
    mounting_model,
    state_at_rest,
)
from carrierflex.simulation.sensing import delayed, reading

Array = NDArray[np.float64]

#: Samples of a piece: an interruption is heard after each, within a fraction of a second.
_PIECE = 2000

_GAINS = slice(INDEX[f"gain_{SENSORS[0]}"], INDEX[f"gain_{SENSORS[-1]}"] + 1)
_ZEROS = slice(INDEX[f"zero_{SENSORS[0]}"], INDEX[f"zero_{SENSORS[-1]}"] + 1)


@dataclass(frozen=True, eq=False)
class MountingResponse:
    """Signals of one run.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Time [s], that of the inputs.
    signals : ndarray, shape (n, 6)
        Displacements [m] in the order of ``SENSORS``, relative to the mean of the first samples.
    """

    time: Array
    signals: Array

    def by_sensor(self) -> dict[str, Array]:
        """Signals by sensor name."""
        return {sensor: self.signals[:, column] for column, sensor in enumerate(SENSORS)}


def simulate(
    rig: MountingRig,
    parameters: ParameterArray,
    inputs: MountingInputs,
    *,
    step: float | None = None,
    user_law: ForceLaw | None = None,
    tables: Array | None = None,
) -> MountingResponse:
    """Six motion sensors of the housing under measured torque and radial load.

    The run begins in the static equilibrium under its first loads. The linear part of the model is
    solved exactly for loads that are linear between samples; nonlinear bushing forces by an
    exponential Lobatto method of order four.

    Parameters
    ----------
    rig : MountingRig
        Geometry, masses and the number of zeroing samples.
    parameters : ndarray
        Flat parameter set, see
        :func:`carrierflex.simulation.mounting.parameter_arrays.parameter_array`.
    inputs : MountingInputs
        Loads of the run.
    step : float, optional
        Largest step [s]; chosen from the nonlinear stiffness where not given.
    user_law : ForceLaw, optional
        Force that a user adds to the radial force of both bushings, in y and in z; continuous.
    tables : ndarray, optional
        Packed measured laws of the bushings, in y and in z apart or in their plane, see
        :func:`carrierflex.simulation.mounting.measured_laws.bushing_laws.packed_laws`.

    Returns
    -------
    MountingResponse
        Signals at the times of the inputs.

    Raises
    ------
    ValueError
        Where a parameter is out of bounds or the step is too large.
    DivergedError
        Where the run leaves the model; it carries time, coordinate and the signals up to there.

    References
    ----------
    .. [1] 2011 paper, equations (1)-(8), (14)-(16).
    """
    model = mounting_model(
        rig, parameters, inputs.loads, inputs.step, step=step, user_law=user_law, tables=tables
    )
    start = state_at_rest(model, inputs.loads[0], float(inputs.time[0]))
    signals, _ = marched(model, start, inputs.loads)
    return response_of(rig, parameters, inputs, signals)


def signal_pieces(
    rig: MountingRig,
    parameters: ParameterArray,
    inputs: MountingInputs,
    *,
    step: float | None = None,
) -> Iterator[Array]:
    """Signals of a run piece by piece, not zeroed.

    What came before a stop or an interruption is not lost.

    Parameters
    ----------
    rig, parameters, inputs, step
        As for :func:`simulate`.

    Yields
    ------
    ndarray, shape (n, 6)
        Signals [m] on the even grid of the inputs; joined they are those of one march.

    Raises
    ------
    ValueError
        Where a parameter is out of bounds or the step is too large; before the first piece.
    DivergedError
        Where the run leaves the model; the good samples have been yielded.
    """
    model = mounting_model(rig, parameters, inputs.loads, inputs.step, step=step)
    state = state_at_rest(model, inputs.loads[0], float(inputs.time[0]))
    yield first_signals(model, state)[None]
    for first in range(0, len(inputs.loads) - 1, _PIECE):
        try:
            signals, state = marched(model, state, inputs.loads[first : first + _PIECE + 1])
        except DivergedError as error:
            yield error.signals[1:]
            raise
        yield signals[1:]


def response_of(
    rig: MountingRig, parameters: ParameterArray, inputs: MountingInputs, signals: Array
) -> MountingResponse:
    """Response whose signals are zeroed and read by the sensors, as far as a run came.

    Parameters
    ----------
    rig, parameters, inputs
        As for :func:`simulate`.
    signals : ndarray, shape (n, 6)
        Signals [m] on the first n instants of the inputs' even grid; changed in place.

    Returns
    -------
    MountingResponse
        At the times of the inputs that the signals cover.
    """
    time = inputs.time[: len(signals)]
    if not inputs.uniform:
        grid = inputs.grid[: len(signals)]
        time = inputs.time[inputs.time <= grid[-1]]
        signals = np.stack([np.interp(time, grid, column) for column in signals.T], axis=1)
    # In place: a second array of a long record costs as much time.
    signals -= signals[: rig.zeroing_samples].mean(axis=0)
    return MountingResponse(time, sensed(signals, parameters, time))


def sensed(signals: Array, parameters: ParameterArray, time: Array) -> Array:
    """What sensors with a gain, an offset and a delay read; offsets come after the zeroing."""
    gains, zeros = parameters[_GAINS], parameters[_ZEROS]
    signals = delayed(time, signals, float(parameters[INDEX["delay"]]))
    if (gains == 1.0).all() and not zeros.any():
        return signals
    return reading(signals, gains, zeros)


def with_noise(
    response: MountingResponse, noise_std: float, rng: np.random.Generator
) -> MountingResponse:
    """Response with white noise of a standard deviation [m] on every sensor."""
    noise = noise_std * rng.standard_normal(response.signals.shape)
    return MountingResponse(response.time, response.signals + noise)


__all__ = [
    "DivergedError",
    "MountingResponse",
    "response_of",
    "sensed",
    "signal_pieces",
    "simulate",
    "with_noise",
]
