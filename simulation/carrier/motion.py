"""One run on the dynamometer: the carrier turning under torque, read by the sensors at its rim."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.geometry.parameters import CarrierParameters
from carrierflex.simulation.carrier.effect import Effect
from carrierflex.simulation.carrier.effects.deflection import FLEXIBLE_PINS, STIFF_PINS
from carrierflex.simulation.carrier.effects.housing_and_face import FLANGE_WARP
from carrierflex.simulation.carrier.effects.misalignment import (
    AXIAL_OFFSET,
    CARRIER_TILT,
    HOUSING_TILT,
)
from carrierflex.simulation.carrier.measured_laws.carrier_laws import law_signal
from carrierflex.simulation.carrier.rim import (
    CarrierInputs,
    CarrierRig,
    RimSensor,
    inputs_of_columns,
)
from carrierflex.simulation.carrier.run_cases import AXIAL, CarrierMotion, RunCase, Sensor
from carrierflex.simulation.laws import Law

#: Periods of the slow speed and torque ripple [s]: longer than a revolution at 22.1 rpm (2.7 s) and
#: not in a simple ratio to it, so that the ripple is not mistaken for a shaft order.
RIPPLE_PERIODS = (17.3, 10.9, 6.1)


@dataclass(frozen=True, eq=False)
class Response:
    """Sensor signals and inputs of one run, over time.

    Parameters
    ----------
    time, carrier_angle, torque, ntl_y, ntl_z : ndarray, shape (n,)
        Time [s], carrier angle [rad], torque [N m] and radial load [N].
    signals : mapping of str to ndarray, shape (n,)
        Displacement [m] by sensor name.
    """

    time: NDArray[np.float64]
    carrier_angle: NDArray[np.float64]
    torque: NDArray[np.float64]
    ntl_y: NDArray[np.float64]
    ntl_z: NDArray[np.float64]
    signals: Mapping[str, NDArray[np.float64]]


def clean_signal(
    sensor: Sensor,
    motion: CarrierMotion,
    carrier_angle: NDArray[np.float64],
    torque: NDArray[np.float64],
    *,
    delta_s: DeflectionCurve,
    delta_f: DeflectionCurve,
) -> NDArray[np.float64]:
    """Signal of one sensor without noise.

    The sum of effects of :mod:`carrierflex.simulation.carrier.effects`.

    Axial: ``d_x + R phi_H sin(theta_H - v) + R phi_PLC sin(theta_PLC + theta - v)
    + (T / T_unit) (rho_s delta_s + rho_f delta_f)(v - theta) + saddle cos(2 (v - 47 deg))``.
    Radial: the deflection terms alone, with the radial curves.

    Parameters
    ----------
    sensor : Sensor
        Where and what is read.
    motion : CarrierMotion
        Parameters.
    carrier_angle, torque : ndarray, shape (n,)
        Carrier angle [rad] and torque [N m].
    delta_s, delta_f : DeflectionCurve
        Stiff and flexible curve.

    Returns
    -------
    ndarray, shape (n,)
        Displacement [m].

    References
    ----------
    .. [1] 2012 paper, equations (1)-(3), (7), (8).
    """
    rig = CarrierRig(
        nominal_torque=np.nan,
        # None of these effects asks for it.
        n_planets=CarrierParameters.n_planets,
        pin_radius=np.nan,
        curves={"delta_s": delta_s, "delta_f": delta_f},
    )
    rim_sensor = _rim_sensor(sensor)
    inputs = inputs_of_columns({"carrier_angle": carrier_angle, "torque": torque})
    signal = np.zeros_like(carrier_angle)
    for effect, coefficients in _coefficients(motion).items():
        signal += effect.signal(coefficients, rim_sensor, inputs, rig)
    return signal


def _rim_sensor(sensor: Sensor) -> RimSensor:
    return RimSensor(sensor.angle, sensor.radius, sensor.quantity == AXIAL)


def _coefficients(motion: CarrierMotion) -> dict[Effect, tuple[float, ...]]:
    """Coefficients of the effects that a motion is made of."""
    return {
        STIFF_PINS: (motion.rho_s,),
        FLEXIBLE_PINS: (motion.rho_f,),
        AXIAL_OFFSET: (motion.d_x,),
        HOUSING_TILT: _components(motion.phi_H, motion.theta_H),
        CARRIER_TILT: _components(motion.phi_PLC, motion.theta_PLC),
        # The part that follows no load.
        FLANGE_WARP: (motion.saddle, 0.0, 0.0, 0.0),
    }


def _components(size: float, angle: float) -> tuple[float, float]:
    """Components of a tilt along the axes at angle 0 and at a quarter turn [rad]."""
    return size * np.cos(angle), size * np.sin(angle)


def simulate_run(
    case: RunCase,
    sensors: Sequence[Sensor],
    delta_s: DeflectionCurve,
    delta_f: DeflectionCurve,
    *,
    noise_std: float,
    rng: np.random.Generator,
    laws: Sequence[Law] = (),
) -> Response:
    """Signals of one run.

    The carrier turns with slow ripple, the deflection follows the torque, sensors add noise.

    Parameters
    ----------
    case : RunCase
        The run and its truth.
    sensors : sequence of Sensor
        Sensors to read.
    delta_s, delta_f : DeflectionCurve
        Stiff and flexible curve.
    noise_std : float
        Standard deviation of the white noise of every sensor [m].
    rng : numpy.random.Generator
        Source of the ripple's phases and of the noise.
    laws : sequence of Law
        Measured shapes that the signals have beside the truth.

    Returns
    -------
    Response
        Time ``k / sample_rate``, inputs and signals.

    Raises
    ------
    ValueError
        Where `noise_std` is negative.
    """
    if noise_std < 0.0:
        raise ValueError(f"noise_std is {noise_std} m; expected a value >= 0")
    time = np.arange(round(case.duration * case.sample_rate)) / case.sample_rate
    _, turned = _ripple(time, case.speed_ripple, rng)
    torque_ratio, _ = _ripple(time, case.torque_ripple, rng)
    carrier_angle = case.speed * (time + turned)
    torque = case.torque * (1.0 + torque_ratio)
    load = np.ones_like(time)
    inputs = CarrierInputs(
        time, carrier_angle, torque, case.ntl_y * load, case.ntl_z * load, 0.0, float(time[-1])
    )
    signals = {}
    for sensor in sensors:
        clean = clean_signal(
            sensor, case.motion, carrier_angle, torque, delta_s=delta_s, delta_f=delta_f
        )
        for law in laws:
            clean += law_signal(law, _rim_sensor(sensor), inputs)
        signals[sensor.name] = clean + noise_std * rng.standard_normal(time.size)
    return Response(
        time=time,
        carrier_angle=carrier_angle,
        torque=torque,
        ntl_y=inputs.ntl_y,
        ntl_z=inputs.ntl_z,
        signals=signals,
    )


def _ripple(
    time: NDArray[np.float64], standard_deviation: float, rng: np.random.Generator
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Smooth ripple, a sum of slow sines with random phases, and its integral from time zero."""
    amplitude = standard_deviation * np.sqrt(2.0 / len(RIPPLE_PERIODS))
    ripple = np.zeros_like(time)
    integral = np.zeros_like(time)
    for period, phase in zip(
        RIPPLE_PERIODS, rng.uniform(0.0, 2.0 * np.pi, len(RIPPLE_PERIODS)), strict=True
    ):
        omega = 2.0 * np.pi / period
        ripple += amplitude * np.sin(omega * time + phase)
        integral += amplitude / omega * (np.cos(phase) - np.cos(omega * time + phase))
    return ripple, integral
