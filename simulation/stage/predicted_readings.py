"""What rim sensors read in a stage under measured loads, in static equilibrium.

Loads of a run change slowly beside the stage's vibrations, so that each sample is an equilibrium:

    ``s(theta, p) = Re sum_k a_k(p) exp(j k theta)``,

p torque and radial load over their scales. The series a_k are computed at load points of the
records and lie between them on the surface ``sum_i w_i |p - p_i| + const``: exact at the points,
straight between two of them.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RBFInterpolator
from scipy.signal import resample

from carrierflex.simulation.carrier.rim import CarrierInputs, RimSensor
from carrierflex.simulation.carrier.run_cases import AXIAL, Sensor
from carrierflex.simulation.stage.effects import StageEffects
from carrierflex.simulation.stage.quasi_static import quasi_static_turn, rest_readings
from carrierflex.simulation.stage.readings import ReadingEffects, rim_reader, sensor_signals
from carrierflex.simulation.stage.response import StageRecord
from carrierflex.simulation.stage.stage_body import StageBody
from carrierflex.simulation.stage.stage_data import GRAVITY, StageData
from carrierflex.simulation.stage.stage_model import stage_model
from carrierflex.simulation.stage.statics import SteadyLoad

Array = NDArray[np.float64]

#: Carrier angles of a turn that are solved, angles between which they are read, and orders of the
#: series. In the carrier's frame the stage moves with the first few orders, while the rim's curve
#: has those of the planets: read at 24 solved angles alone, order 15 would pass for order 9.
N_ANGLES, _READ_ANGLES, HIGHEST_ORDER = 16, 96, 24
#: Distance of a load from the nearest point, over the loads' scales, and points at most.
_NEAR, _MOST_POINTS = 0.02, 40


@dataclass(frozen=True, eq=False)
class PredictedStage:
    """A stage and how it is read.

    Parameters
    ----------
    body : StageBody
        Carrier with pins on its main shaft.
    data : StageData
        Bearings, gears, mounting.
    effects : StageEffects
        What departs from the nominal stage.
    reading : ReadingEffects
        Between motion and record.
    speed : float
        Carrier speed [rad/s].
    rest_angle : float, optional
        Carrier angle of the reading at rest that signals count from [rad]; none by default.
    gravity : float
        [m/s^2].
    """

    body: StageBody
    data: StageData
    effects: StageEffects
    reading: ReadingEffects
    speed: float = 0.0
    rest_angle: float | None = None
    gravity: float = GRAVITY


@dataclass(frozen=True, eq=False)
class LoadPoints:
    """Loads at which a stage is solved.

    Parameters
    ----------
    loads : ndarray, shape (n_points, 3)
        Torque [N m], radial load along y and z [N].
    scale : ndarray, shape (3,)
        Nominal torque, and the largest radial load twice.
    """

    loads: Array
    scale: Array

    def weights(self, inputs: CarrierInputs) -> Array:
        """Share of each point in every sample, shape (n, n_points)."""
        loads = np.column_stack([inputs.torque, inputs.ntl_y, inputs.ntl_z])
        unit = np.eye(len(self.loads))
        surface = RBFInterpolator(self.loads / self.scale, unit, kernel="linear", degree=0)
        # A run under a steady load has a single one.
        different, where = np.unique(loads, axis=0, return_inverse=True)
        return np.asarray(surface(different / self.scale)[where.reshape(-1)])


def load_points(loads: Array, scale: Array) -> LoadPoints:
    """Points so that every load is close to one: the farthest from those before it, one by one.

    Parameters
    ----------
    loads : ndarray, shape (n, 3)
        Loads of the records [N m, N, N].
    scale : ndarray, shape (3,)
        As of :class:`LoadPoints`.
    """
    scaled = loads / scale
    chosen = [0]
    distance = np.linalg.norm(scaled - scaled[0], axis=1)
    while distance.max() > _NEAR and len(chosen) < _MOST_POINTS:
        chosen.append(int(distance.argmax()))
        distance = np.minimum(distance, np.linalg.norm(scaled - scaled[chosen[-1]], axis=1))
    return LoadPoints(loads[chosen], scale)


@dataclass(frozen=True, eq=False)
class StageReadings:
    """Series of what sensors read at load points.

    Parameters
    ----------
    sensors : tuple of Sensor
        Sensors.
    points : LoadPoints
        Loads.
    series : ndarray of complex, shape (n_points, n_sensors, n_orders)
        Amplitudes a_k [m], order 0 first.
    """

    sensors: tuple[Sensor, ...]
    points: LoadPoints
    series: NDArray[np.complex128]

    def __sub__(self, other: "StageReadings") -> "StageReadings":
        """Readings less those of the same sensors under the same loads."""
        return replace(self, series=self.series - other.series)

    def __mul__(self, factor: float) -> "StageReadings":
        """Readings times a number."""
        return replace(self, series=factor * self.series)

    def signal(self, sensor: RimSensor, inputs: CarrierInputs) -> Array:
        """Reading of the sensor that stands next to a rim sensor [m], shape (n,)."""
        others = np.array(
            [(candidate.quantity == AXIAL) != sensor.is_axial for candidate in self.sensors]
        )
        turned = 1.0 - np.cos([candidate.angle - sensor.angle for candidate in self.sensors])
        nearest = int(np.argmin(np.where(others, np.inf, turned)))
        weights, waves = _basis(self.points, inputs, self.series.shape[2])
        return np.asarray(((weights @ self.series[:, nearest]) * waves).sum(axis=1).real)


@lru_cache(maxsize=2)
def _basis(
    points: LoadPoints, inputs: CarrierInputs, n_orders: int
) -> tuple[Array, NDArray[np.complex128]]:
    """Shares of the points and waves of the orders in every sample, for causes in a row."""
    waves = np.exp(1j * np.outer(inputs.carrier_angle, np.arange(n_orders)))
    return points.weights(inputs), waves


def _finer(turn: StageRecord) -> StageRecord:
    """A turn at more angles, by the Fourier series of its motions."""
    time = 2.0 * np.pi * np.arange(_READ_ANGLES) / _READ_ANGLES
    c = np.column_stack([time, resample(turn.c[:, 1:], _READ_ANGLES)])
    drive = np.repeat(turn.drive[:1], _READ_ANGLES, axis=0)
    return StageRecord(time, c, np.zeros_like(c), drive, np.zeros((_READ_ANGLES, 6)))


def stage_readings(
    stage: PredictedStage,
    sensors: Sequence[Sensor],
    points: LoadPoints,
    start: Array | None = None,
) -> tuple[StageReadings, Array]:
    """Readings of a stage at load points, and its coordinates there.

    Parameters
    ----------
    stage : PredictedStage
        Stage.
    sensors : sequence of Sensor
        Sensors.
    points : LoadPoints
        Loads.
    start : ndarray, shape (n_points, N_ANGLES, n), optional
        Coordinates of a stage that differs a little, where the contact iteration begins.

    Returns
    -------
    readings : StageReadings
        Series by point and sensor.
    coordinates : ndarray, shape (n_points, N_ANGLES, n)
        Equilibria.

    Raises
    ------
    NotConvergedError
        Where the contact iteration does not settle.
    """
    model = stage_model(stage.body, stage.data, effects=stage.effects, speed=stage.speed)
    quiet = replace(stage.reading, noise_std=0.0, delay=0.0)
    reader = rim_reader(model)
    zero = dict.fromkeys((sensor.name for sensor in sensors), 0.0)
    if stage.rest_angle is not None:
        zero |= rest_readings(
            model, sensors, stage.rest_angle, effects=quiet, gravity=stage.gravity
        )
    series, coordinates = [], []
    for number, (torque, y, z) in enumerate(points.loads.tolist()):
        load = SteadyLoad(torque, y, z, stage.gravity)
        near = None if start is None else start[number]
        turn = quasi_static_turn(model, load, N_ANGLES, start=near)
        signals = sensor_signals(model, _finer(turn), sensors, effects=quiet, reader=reader)
        values = np.array([signals[sensor.name] - zero[sensor.name] for sensor in sensors])
        amplitudes = 2.0 * np.fft.rfft(values, axis=1)[:, : HIGHEST_ORDER + 1] / _READ_ANGLES
        amplitudes[:, 0] /= 2.0
        series.append(amplitudes)
        coordinates.append(turn.c)
    return StageReadings(tuple(sensors), points, np.array(series)), np.array(coordinates)
