"""One run on the dynamometer: the carrier turning under torque, read by the sensors at its rim."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.simulation.carrier.kinematics import (
    axial_deflection_pattern,
    carrier_tilt_pattern,
    housing_tilt_pattern,
    offset_pattern,
    radial_deflection_pattern,
    saddle_pattern,
)
from carrierflex.simulation.carrier.run_cases import AXIAL, RADIAL, CarrierMotion, RunCase, Sensor

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

    The sum of the patterns of :mod:`carrierflex.simulation.carrier.kinematics`.

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
    v, radius = sensor.angle, sensor.radius
    deflection = axial_deflection_pattern if sensor.quantity == AXIAL else radial_deflection_pattern
    signal = motion.rho_s * deflection(carrier_angle, v, torque, delta_s)
    signal += motion.rho_f * deflection(carrier_angle, v, torque, delta_f)
    if sensor.quantity == RADIAL:
        return signal
    signal += motion.d_x * offset_pattern(carrier_angle)
    signal += motion.phi_H * housing_tilt_pattern(carrier_angle, v, radius, motion.theta_H)
    signal += motion.phi_PLC * carrier_tilt_pattern(carrier_angle, v, radius, motion.theta_PLC)
    signal += motion.saddle * saddle_pattern(carrier_angle, v)
    return signal


def simulate_run(
    case: RunCase,
    sensors: Sequence[Sensor],
    delta_s: DeflectionCurve,
    delta_f: DeflectionCurve,
    *,
    noise_std: float,
    rng: np.random.Generator,
) -> Response:
    """Signals of one run: the carrier turns with slow ripple, the deflection follows the torque, sensors add noise.

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
    signals = {}
    for sensor in sensors:
        clean = clean_signal(
            sensor, case.motion, carrier_angle, torque, delta_s=delta_s, delta_f=delta_f
        )
        signals[sensor.name] = clean + noise_std * rng.standard_normal(time.size)
    return Response(
        time=time,
        carrier_angle=carrier_angle,
        torque=torque,
        ntl_y=np.full_like(time, case.ntl_y),
        ntl_z=np.full_like(time, case.ntl_z),
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
