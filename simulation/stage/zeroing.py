"""What the sensors read at rest, without torque and radial load.

The zero that a campaign counts from (2011 paper, section 2).
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from carrierflex.simulation.carrier.run_cases import Sensor
from carrierflex.simulation.stage.readings import ReadingEffects, rim_reader, sensor_signals
from carrierflex.simulation.stage.response import StageRecord
from carrierflex.simulation.stage.stage_model import GRAVITY, StageModel, stage_model
from carrierflex.simulation.stage.statics import SteadyLoad, static_coordinates


def rest_readings(
    model: StageModel,
    sensors: Sequence[Sensor],
    carrier_angle: float,
    *,
    effects: ReadingEffects | None = None,
    gravity: float = GRAVITY,
) -> Mapping[str, float]:
    """Reading of every sensor [m] with the stage at rest under its weight alone, free of noise.

    Parameters
    ----------
    model : StageModel
        The stage.
    sensors : sequence of Sensor
        Sensors.
    carrier_angle : float
        Where the carrier stands [rad]: a tilt of the carrier reads differently at each angle.
    effects : ReadingEffects, optional
        Errors and static patterns of the run; they belong to the zero too.
    gravity : float
        [m/s^2].

    Raises
    ------
    NotConvergedError
        Where the contact iteration does not settle.
    """
    still = stage_model(model.layout.body, model.data, effects=model.effects, speed=0.0)
    c = static_coordinates(still, SteadyLoad(0.0, gravity=gravity), carrier_angle)[None]
    record = StageRecord(np.zeros(1), c, np.zeros_like(c), np.zeros((1, 4)), np.zeros((1, 6)))
    quiet = replace(effects or ReadingEffects(), noise_std=0.0, delay=0.0)
    signals = sensor_signals(still, record, sensors, effects=quiet, reader=rim_reader(still))
    return {name: float(signal[0]) for name, signal in signals.items()}
