"""A turn of the stage without inertia: static equilibria at equal carrier angles.

What the sensors read in them, by order. At the speeds of the rig the sensors' first orders are
those of the run in time (``docs/papers.md``), at a hundredth of its cost. Likewise what they
read at rest, which records of zeroed sensors count from.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.simulation.carrier.run_cases import Sensor
from carrierflex.simulation.stage.readings import ReadingEffects, rim_reader, sensor_signals
from carrierflex.simulation.stage.response import StageRecord
from carrierflex.simulation.stage.stage_data import GRAVITY
from carrierflex.simulation.stage.stage_model import StageModel, stage_model
from carrierflex.simulation.stage.statics import SteadyLoad, static_coordinates, static_turn


def quasi_static_turn(
    model: StageModel,
    load: SteadyLoad,
    n_angles: int = 12,
    *,
    start: NDArray[np.float64] | None = None,
) -> StageRecord:
    """States of one turn at equal carrier angles from 0, meshes with their mean stiffness.

    Parameters
    ----------
    model : StageModel
        The stage; at speed 0 it has no centrifugal forces.
    load : SteadyLoad
        Torque, radial load and gravity.
    n_angles : int
        Angles; orders below half of it are told apart.
    start : ndarray, shape (n_angles, n), optional
        Coordinates of a turn of a stage that differs a little, where the contact iteration begins.

    Returns
    -------
    StageRecord
        Time is the carrier angle over a speed of 1 rad/s; rates and energies are zero.

    Raises
    ------
    NotConvergedError
        Where the contact iteration does not settle.
    """
    angles = 2.0 * np.pi * np.arange(n_angles) / n_angles
    c = static_turn(model, load, angles, mean_stiffness=True, starts=start)
    drive = np.tile([load.torque, 0.0, load.ntl_y, load.ntl_z], (n_angles, 1))
    return StageRecord(angles, c, np.zeros_like(c), drive, np.zeros((n_angles, 6)))


@dataclass(frozen=True, eq=False)
class SensorOrders:
    """Orders of the sensors' signals over one turn.

    Parameters
    ----------
    names : tuple of str
        Sensors.
    amplitudes : ndarray of complex, shape (n_sensors, n_orders)
        ``s(theta) = Re Σ_k a_k exp(j k theta)`` [m], order 0 first.
    """

    names: tuple[str, ...]
    amplitudes: NDArray[np.complex128]

    def mean_amplitude(self, order: int) -> float:
        """Mean over the sensors of an order's amplitude [m]."""
        return float(np.abs(self.amplitudes[:, order]).mean())


def sensor_orders(
    model: StageModel,
    record: StageRecord,
    sensors: Sequence[Sensor],
    effects: ReadingEffects | None = None,
) -> SensorOrders:
    """Orders of what sensors read over one turn of equal carrier angles.

    Parameters
    ----------
    model : StageModel
        The stage.
    record : StageRecord
        From :func:`quasi_static_turn`.
    sensors : sequence of Sensor
        Sensors.
    effects : ReadingEffects, optional
        What lies between motion and record.
    """
    signals = sensor_signals(model, record, sensors, effects=effects, reader=rim_reader(model))
    values = np.array([signals[sensor.name] for sensor in sensors])
    amplitudes = 2.0 * np.fft.rfft(values, axis=1) / len(record.time)
    amplitudes[:, 0] /= 2.0
    return SensorOrders(tuple(sensor.name for sensor in sensors), amplitudes)


def static_tilt(orders: SensorOrders, sensors: Sequence[Sensor]) -> NDArray[np.float64]:
    """Rotation of the rim against the sensors about y and z that stands still [rad], shape (2,).

    Least squares of ``u_x = d + ry z - rz y`` over the axial sensors' means.

    Parameters
    ----------
    orders : SensorOrders
        Orders of three or more axial sensors.
    sensors : sequence of Sensor
        The same sensors.
    """
    rows = [
        [1.0, sensor.radius * np.cos(sensor.angle), sensor.radius * np.sin(sensor.angle)]
        for sensor in sensors
    ]
    fit, *_ = np.linalg.lstsq(np.array(rows), orders.amplitudes[:, 0].real, rcond=None)
    return np.asarray(fit[1:])


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
