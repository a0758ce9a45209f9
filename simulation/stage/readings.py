"""What the proximity sensors read.

The rim's material point under them against the housing, and the sensors' own errors.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numba
import numpy as np
from numpy.typing import NDArray

from carrierflex.simulation.carrier.effect import Effect
from carrierflex.simulation.carrier.effects.housing_and_face import (
    FLANGE_WARP,
    RING_PASS,
    THERMAL_DRIFT,
)
from carrierflex.simulation.carrier.effects.misalignment import (
    AXIAL_OFFSET,
    CARRIER_TILT,
    HOUSING_TILT,
)
from carrierflex.simulation.carrier.patterns import face_waves_pattern
from carrierflex.simulation.carrier.rim import (
    CarrierInputs,
    CarrierRig,
    RimSensor,
    inputs_of_columns,
)
from carrierflex.simulation.carrier.run_cases import AXIAL, Sensor
from carrierflex.simulation.sensing import SensorError, delayed
from carrierflex.simulation.stage.response import StageRecord
from carrierflex.simulation.stage.stage_body import RIM_AXIAL, RIM_RADIAL
from carrierflex.simulation.stage.stage_model import StageModel

#: Orders below this share of the largest are rounding and are left out.
_NEGLIGIBLE = 1e-12


@dataclass(frozen=True, eq=False)
class ReadingEffects:
    """Effects between the stage's motion and the record, each with its id.

    The default is none of them.

    Raises
    ------
    ValueError
        Where the noise is negative, an order of the run-out is below 2 or the reference is unknown.
    """

    axial_offset: float = 0.0
    """``axial_offset`` [m]."""
    phi_H: float = 0.0
    """``housing_tilt``: assembly misalignment of the housing [rad]; the bearings keep theirs."""
    theta_H: float = 0.0
    """``housing_tilt``: housing angle of its axis [rad]."""
    phi_face: float = 0.0
    """``carrier_tilt``: tilt of the measured face against the carrier [rad], phi_PLC of eq. 1."""
    theta_face: float = 0.0
    """``carrier_tilt``: carrier-frame angle of its axis [rad]."""
    saddle: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """``flange_warp``: at no load [m], per torque [m/N m], per vertical radial load [m/N]."""
    runout: Mapping[int, tuple[float, float]] | None = None
    """``face_runout``: amplitude [m] and phase [rad] of the measured face by order, 2 and above."""
    drift_rate: float = 0.0
    """``thermal_drift`` [m/s], axial sensors."""
    sensors: Mapping[str, SensorError] | None = None
    """``sensor_gain``, ``sensor_angle``, ``sensor_zero`` by sensor name."""
    reference: str = "housing"
    """What the sensors are mounted on: ``housing`` or ``ground``."""
    delay: float = 0.0
    """``sensor_delay``: displacement behind the carrier angle [s]."""
    noise_std: float = 0.0
    """White noise of every sensor [m]."""

    def __post_init__(self) -> None:
        if self.noise_std < 0.0:
            raise ValueError(f"noise_std is {self.noise_std} m; expected a value >= 0")
        if self.reference not in ("housing", "ground"):
            raise ValueError(f"reference is {self.reference!r}; expected housing or ground")
        for order in self.runout or {}:
            if order < 2:
                raise ValueError(
                    f"face_runout has order {order}; expected 2 or more, order 1 is a tilt of "
                    "the face"
                )


@dataclass(frozen=True, eq=False)
class RimReader:
    """Fourier series of the rim's rows over the carrier-frame angle.

    Parameters
    ----------
    orders : ndarray of int, shape (k,)
        Orders kept.
    axial, radial : ndarray of complex, shape (k, n)
        Displacement of the rim at the angle phi: ``Re Σ rows[k] c exp(j orders[k] phi)`` [m].
    misaligned_axial, misaligned_radial : ndarray of complex, shape (k,)
        What the imposed misalignment adds.
    """

    orders: NDArray[np.int64]
    axial: NDArray[np.complex128]
    radial: NDArray[np.complex128]
    misaligned_axial: NDArray[np.complex128]
    misaligned_radial: NDArray[np.complex128]


@lru_cache(maxsize=1)
def rim_reader(model: StageModel) -> RimReader:
    """Series of the body's rim rows, which stand at equal angles from 0.

    That of the last model is returned again.
    """
    body = model.layout.body
    tilt = body.misalignment_reading @ model.effects.misalignment
    # But for its first column L selects: all coordinates of the body but one, which come first.
    retained = model.L[: body.model.n_coordinates, 1:].any(axis=1)
    series_of = []
    for prefix in (RIM_AXIAL, RIM_RADIAL):
        rows = _rows_named(body.model.sensor_names, prefix)
        series = _series(body.model.sensor_rows[rows])[:, retained]
        # A turn about the axis moves no rim point axially or radially; rounding of it would grow
        # with the angle.
        columns = ((0, 0), (1, len(model.L) - 1 - series.shape[1]))
        series_of.append((np.pad(series, columns), _series(tilt[rows][:, None])[:, 0]))
    (axial, axial_tilt), (radial, radial_tilt) = series_of
    size = np.abs(
        np.concatenate([axial, radial, axial_tilt[:, None], radial_tilt[:, None]], axis=1)
    ).max(axis=1)
    orders = np.flatnonzero(size > _NEGLIGIBLE * size.max())
    return RimReader(orders, axial[orders], radial[orders], axial_tilt[orders], radial_tilt[orders])


@lru_cache(maxsize=4)
def _rows_named(names: tuple[str, ...], prefix: str) -> list[int]:
    return [i for i, name in enumerate(names) if name.startswith(prefix)]


def _series(rows: NDArray[np.float64]) -> NDArray[np.complex128]:
    """Amplitudes of ``Re(a exp(j k phi))`` for samples at equal angles along axis 0."""
    amplitude = 2.0 * np.fft.rfft(rows, axis=0) / len(rows)
    amplitude[0] /= 2.0
    if len(rows) % 2 == 0:
        amplitude[-1] /= 2.0
    return np.asarray(amplitude)


def sensor_signals(
    model: StageModel,
    record: StageRecord,
    sensors: Sequence[Sensor],
    *,
    effects: ReadingEffects | None = None,
    reader: RimReader | None = None,
    rng: np.random.Generator | None = None,
    before: StageRecord | None = None,
) -> dict[str, NDArray[np.float64]]:
    """Signals of sensors on the housing, shape (N,) each [m].

    A sensor at v reads the rim's material point at ``phi = v - theta`` less the housing's own
    motion there, axial or along e(v).

    Parameters
    ----------
    model : StageModel
        The stage.
    record : StageRecord
        States.
    sensors : sequence of Sensor
        Sensors.
    effects : ReadingEffects, optional
        Errors and static patterns; none by default.
    reader : RimReader, optional
        From :func:`rim_reader`; made here where it is missing.
    rng : numpy.random.Generator, optional
        Source of the noise; needed where there is some.
    before : StageRecord, optional
        The segment of the run before this one, in which delayed signals begin; segments read as
        the whole where the delay is three samples or more.

    Raises
    ------
    ValueError
        Where noise is asked for without a generator, or an error names a sensor that is not there.
    """
    effects, reader = effects or ReadingEffects(), reader or rim_reader(model)
    if effects.noise_std > 0.0 and rng is None:
        raise ValueError("noise_std is positive; expected a random generator rng with it")
    errors = dict(effects.sensors or {})
    unknown = errors.keys() - {sensor.name for sensor in sensors}
    if unknown:
        raise ValueError(
            f"an error is given for sensor {min(unknown)!r}; expected one of the sensors"
        )
    signals = {}
    rim = _rim_motion(record, reader, sensors, errors)
    if before is not None and effects.delay != 0.0:
        rim_before = _rim_motion(before, reader, sensors, errors)
    for sensor in sensors:
        error = errors.get(sensor.name, SensorError())
        signal = _read(model, record, rim, sensor, effects, error)
        if effects.delay != 0.0:
            time = record.time
            if before is not None:
                time = np.concatenate([before.time, time])
                signal = np.concatenate(
                    [_read(model, before, rim_before, sensor, effects, error), signal]
                )
            signal = delayed(time, signal, effects.delay)[-len(record.time) :]
        if rng is not None:
            signal = signal + effects.noise_std * rng.standard_normal(len(signal))
        signals[sensor.name] = signal
    return signals


def _read(
    model: StageModel,
    record: StageRecord,
    rim: Mapping[str, NDArray[np.float64]],
    sensor: Sensor,
    effects: ReadingEffects,
    error: SensorError,
) -> NDArray[np.float64]:
    """Signal of one sensor with its errors, neither delayed nor noisy."""
    angle = sensor.angle + error.angle
    clean = rim[sensor.name]
    if effects.reference == "housing":
        clean = clean - _housing_motion(model, record, sensor, angle)
    clean = clean + _patterns(model, record, sensor, angle, effects)
    return error.reading(clean)


def _rim_motion(
    record: StageRecord,
    reader: RimReader,
    sensors: Sequence[Sensor],
    errors: Mapping[str, SensorError],
) -> dict[str, NDArray[np.float64]]:
    """Motion of the rim under every sensor by its name, shape (N,) each [m]."""
    motion: dict[str, NDArray[np.float64]] = {}
    for quantity in dict.fromkeys(sensor.quantity for sensor in sensors):
        group = [sensor for sensor in sensors if sensor.quantity == quantity]
        rows, tilt = (
            (reader.axial, reader.misaligned_axial)
            if quantity == AXIAL
            else (reader.radial, reader.misaligned_radial)
        )
        angles = [sensor.angle + errors.get(sensor.name, SensorError()).angle for sensor in group]
        under = np.exp(1j * np.outer(angles, reader.orders))
        # Real and imaginary columns: numpy would make complex numbers of the coordinates, of which
        # half, those of other bodies, move no rim.
        moving = rows.any(axis=0)
        columns = np.ascontiguousarray(rows[:, moving].T).view(np.float64)
        amplitude = (record.c[:, moving] @ columns).view(np.complex128)
        read = np.empty((len(group), len(record.c)))
        _add_orders(amplitude, tilt, reader.orders, record.c[:, 0], under, read)
        motion |= {sensor.name: row for sensor, row in zip(group, read, strict=True)}
    return motion


@numba.njit(cache=True, fastmath={"contract", "reassoc", "nsz"})
def _add_orders(
    amplitude: NDArray[np.complex128],
    tilt: NDArray[np.complex128],
    orders: NDArray[np.int64],
    theta: NDArray[np.float64],
    under: NDArray[np.complex128],
    read: NDArray[np.float64],
) -> None:
    """Sums over orders of ``Re (amplitude + tilt) exp(-j orders theta) under`` for `read`."""
    n_orders = len(orders)
    real, imag = np.empty(n_orders), np.empty(n_orders)
    under_real, under_imag = under.real.copy(), under.imag.copy()
    for instant in range(len(theta)):
        turn = np.exp(-1j * theta[instant])
        power, reached = 1.0 + 0.0j, 0
        for k in range(n_orders):
            while reached < orders[k]:
                power *= turn
                reached += 1
            turned = (amplitude[instant, k] + tilt[k]) * power
            real[k], imag[k] = turned.real, turned.imag
        for sensor in range(len(under)):
            total = 0.0
            for k in range(n_orders):
                total += real[k] * under_real[sensor, k] - imag[k] * under_imag[sensor, k]
            read[sensor, instant] = total


def _housing_motion(
    model: StageModel, record: StageRecord, sensor: Sensor, angle: float
) -> NDArray[np.float64]:
    """Motion of the housing where a sensor stands, along the sensor."""
    phi = angle - record.c[:, 0]
    tx, ty, tz, _, wy, wz = (record.c @ model.channels.B[:, model.channels.housing]).T
    y, z = -sensor.radius * np.sin(phi), sensor.radius * np.cos(phi)
    # The rim face is the plane x = 0.
    x = -model.data.housing.x
    if sensor.quantity == AXIAL:
        return np.asarray(tx + wy * z - wz * y)
    return np.asarray(-np.sin(phi) * (ty + wz * x) + np.cos(phi) * (tz - wy * x))


def _patterns(
    model: StageModel,
    record: StageRecord,
    sensor: Sensor,
    angle: float,
    effects: ReadingEffects,
) -> NDArray[np.float64]:
    """Signals of the effects between the stage's motion and the record, shape (n,) [m]."""
    theta = record.c[:, 0]
    rim_sensor = RimSensor(angle, sensor.radius, sensor.quantity == AXIAL)
    inputs = inputs_of_columns(
        {
            "time": record.time,
            "carrier_angle": theta,
            "torque": record.drive[:, 0],
            "ntl_z": record.drive[:, 3],
        }
    )
    # Coefficients of the torque are per newton metre; no curve is used.
    rig = CarrierRig(1.0, model.layout.n_planets, np.nan, {})
    signal = np.zeros(len(theta))
    for effect, coefficients in _coefficients(model, effects, inputs).items():
        if any(coefficients):
            signal += effect.signal(coefficients, rim_sensor, inputs, rig)
    if rim_sensor.is_axial:
        # The stage takes any order and phase, the effect face_runout orders 2 to 8.
        for order, (amplitude, phase) in (effects.runout or {}).items():
            cosine, sine = face_waves_pattern(theta, angle, order)
            signal += amplitude * (np.cos(phase) * cosine + np.sin(phase) * sine)
    return signal


def _coefficients(
    model: StageModel, effects: ReadingEffects, inputs: CarrierInputs
) -> dict[Effect, tuple[float, ...]]:
    """Coefficients of the rim's effects, torque counted in newton metres."""
    at_rest, per_torque, per_load = effects.saddle
    # A steady drift from time zero: its mean over the record, and its slope.
    mean_drift = effects.drift_rate * 0.5 * float(inputs.start + inputs.end)
    half_drift = effects.drift_rate * 0.5 * float(inputs.end - inputs.start)
    return {
        AXIAL_OFFSET: (effects.axial_offset + mean_drift,),
        THERMAL_DRIFT: (half_drift, 0.0, 0.0),
        HOUSING_TILT: _components(effects.phi_H, effects.theta_H),
        CARRIER_TILT: _components(effects.phi_face, effects.theta_face),
        FLANGE_WARP: (at_rest, per_torque, 0.0, per_load),
        RING_PASS: (*model.effects.ring_pass_offset, *model.effects.ring_pass_tilt),
    }


def _components(size: float, angle: float) -> tuple[float, float]:
    """Components of a tilt along the axes at angle 0 and at a quarter turn [rad]."""
    return size * float(np.cos(angle)), size * float(np.sin(angle))
