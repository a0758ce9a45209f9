"""A whole run of the stage: states, sensor signals, part loads and energy over time."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.simulation.carrier.run_cases import Sensor
from carrierflex.simulation.stage.part_loads import PartLoads, part_loads
from carrierflex.simulation.stage.quasi_static import rest_readings
from carrierflex.simulation.stage.readings import ReadingEffects, rim_reader, sensor_signals
from carrierflex.simulation.stage.response import (
    StageRecord,
    quasi_static_start,
    run_stage,
    steady_drive,
)
from carrierflex.simulation.stage.stage_model import StageModel
from carrierflex.simulation.stage.statics import SteadyLoad


@dataclass(frozen=True, eq=False)
class StageResponse:
    """The stage over N instants of a run, or of a piece of one.

    Parameters
    ----------
    record : StageRecord
        Time, coordinates, loads, energy.
    signals : mapping of str to ndarray, shape (N,)
        Displacement [m] by sensor name.
    loads : PartLoads
        Forces of teeth and pins.
    """

    record: StageRecord
    signals: Mapping[str, NDArray[np.float64]]
    loads: PartLoads


def simulate_stage(
    model: StageModel,
    load: SteadyLoad,
    sensors: Sequence[Sensor],
    *,
    duration: float,
    sample_rate: float,
    step: float,
    effects: ReadingEffects | None = None,
    rng: np.random.Generator | None = None,
    rest_angle: float | None = None,
) -> Iterator[StageResponse]:
    """Run under a steady load from its quasi-static answer, chunk by chunk.

    Parameters
    ----------
    model : StageModel
        The stage.
    load : SteadyLoad
        Torque and radial load.
    sensors : sequence of Sensor
        Sensors to read.
    duration, sample_rate, step : float
        Length [s], kept instants a second [1/s], longest step [s].
    effects : ReadingEffects, optional
        What lies between motion and record.
    rng : numpy.random.Generator, optional
        Source of the noise.
    rest_angle : float, optional
        Count every signal from its reading at rest at this carrier angle [rad]; from nothing where
        it is missing.

    Yields
    ------
    StageResponse
        Consecutive pieces; memory does not grow with the length of the run.

    Raises
    ------
    ValueError, StageDivergedError
        As :func:`carrierflex.simulation.stage.response.run_stage`.
    """
    reader, start = rim_reader(model), quasi_static_start(model, load)
    zero = dict.fromkeys((sensor.name for sensor in sensors), 0.0)
    if rest_angle is not None:
        zero |= rest_readings(model, sensors, rest_angle, effects=effects, gravity=load.gravity)
    records = run_stage(
        model,
        steady_drive(model, load),
        start,
        duration=duration,
        sample_rate=sample_rate,
        step=step,
        gravity=load.gravity,
    )
    before = None
    for record in records:
        signals = sensor_signals(
            model, record, sensors, effects=effects, reader=reader, rng=rng, before=before
        )
        before = record
        signals = {name: signal - zero[name] for name, signal in signals.items()}
        yield StageResponse(record, signals, part_loads(model, record.c))
