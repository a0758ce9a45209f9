"""Laws of the linear carrier effects.

Signal at a sensor per unit of each parameter, from the simulator's own patterns.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.simulation.carrier import effects, kinematics

FloatArray = NDArray[np.float64]
WAVE_ORDERS = tuple(range(2, 9))
#: No machine element of the stage turns at these orders.
PLACEBO_ORDERS = (2.618, 4.382)


@dataclass(frozen=True, eq=False)
class RimSensor:
    """Housing angle [rad], radius [m] and direction of a rim sensor."""

    angle: float
    radius: float
    is_axial: bool


@dataclass(frozen=True, eq=False)
class CarrierInputs:
    """Inputs of one run, or of part of it.

    Parameters
    ----------
    time, carrier_angle, torque, ntl_y, ntl_z : ndarray, shape (n,)
        [s], [rad], [N m], [N], [N].
    start, end : float
        First and last time of the whole run [s].
    """

    time: FloatArray
    carrier_angle: FloatArray
    torque: FloatArray
    ntl_y: FloatArray
    ntl_z: FloatArray
    start: float
    end: float


@dataclass(frozen=True, eq=False)
class CarrierRig:
    """Nominal torque [N m], number of planets, radius of the pin circle [m], deflection curves by name."""

    nominal_torque: float
    n_planets: int
    pin_radius: float
    curves: Mapping[str, DeflectionCurve]


#: Signal per unit of each parameter, shape (n_parameters, n).
Law = Callable[[RimSensor, CarrierInputs, CarrierRig], FloatArray]


def axial_offset(sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig) -> FloatArray:
    """One on axial sensors."""
    return sensor.is_axial * kinematics.offset_pattern(inputs.carrier_angle)[None]


def housing_tilt(sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig) -> FloatArray:
    """Tilt about two axes of the housing."""
    return _tilts(kinematics.housing_tilt_pattern, sensor, inputs)


def torque_tilt(sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig) -> FloatArray:
    """The same in proportion to the torque."""
    return housing_tilt(sensor, inputs, rig) * inputs.torque / rig.nominal_torque


def carrier_tilt(sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig) -> FloatArray:
    """Tilt about two axes of the carrier."""
    return _tilts(kinematics.carrier_tilt_pattern, sensor, inputs)


def ntl_tilt(sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig) -> FloatArray:
    """Tilt about two axes of the housing in proportion to the radial load along y, then along z."""
    tilts = housing_tilt(sensor, inputs, rig)
    return np.concatenate([tilts * inputs.ntl_y, tilts * inputs.ntl_z])


def flexible_pins(sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig) -> FloatArray:
    """Deflection with flexible pins."""
    return deflection("delta_f", sensor, inputs, rig, inputs.torque)[None]


def stiff_pins(sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig) -> FloatArray:
    """Deflection with stiff pins."""
    return deflection("delta_s", sensor, inputs, rig, inputs.torque)[None]


def deflection(
    curve: str, sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig, torque: FloatArray
) -> FloatArray:
    """Deflection under a torque, as the sensor reads it."""
    pattern = (
        kinematics.axial_deflection_pattern
        if sensor.is_axial
        else kinematics.radial_deflection_pattern
    )
    return pattern(inputs.carrier_angle, sensor.angle, torque, rig.curves[curve])


def unequal_load_sharing(sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig) -> FloatArray:
    """Excess on pin 1, then on pin 2, each taken from the last pin."""
    shares = np.eye(rig.n_planets)[:2]
    shares[:, -1] -= 1.0
    return np.array([_uneven(sensor, inputs, rig, own) for own in shares])


def load_sharing_ntl(sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig) -> FloatArray:
    """Excess that turns through the radial load."""
    shares = effects.load_turned_shares(
        inputs.carrier_angle, inputs.ntl_y, inputs.ntl_z, rig.n_planets
    )
    return np.array([_uneven(sensor, inputs, rig, own) for own in shares])


def flange_warp(sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig) -> FloatArray:
    """Saddle: constant, with the torque, with the load along y and z."""
    saddle = sensor.is_axial * kinematics.saddle_pattern(inputs.carrier_angle, sensor.angle)
    loads = (np.ones_like(saddle), inputs.torque / rig.nominal_torque, inputs.ntl_y, inputs.ntl_z)
    return np.array([saddle * load for load in loads])


def face_runout(sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig) -> FloatArray:
    """Waves on the face."""
    waves = [
        effects.face_waves_pattern(inputs.carrier_angle, sensor.angle, order)
        for order in WAVE_ORDERS
    ]
    return sensor.is_axial * np.array([own for pair in waves for own in pair])


def ring_pass(sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig) -> FloatArray:
    """Offset, then tilt about two axes of the housing, three times a revolution."""
    passes = effects.planet_pass_pattern(
        inputs.carrier_angle, inputs.torque / rig.nominal_torque, rig.n_planets
    )
    shapes = [axial_offset(sensor, inputs, rig)[0], *housing_tilt(sensor, inputs, rig)]
    return np.array([shape * wave for shape in shapes for wave in passes])


def thermal_drift(sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig) -> FloatArray:
    """Slow polynomials in time."""
    return sensor.is_axial * np.array(effects.drift_patterns(inputs.time, inputs.start, inputs.end))


def first_placebo(sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig) -> FloatArray:
    """Order without meaning."""
    return _order(PLACEBO_ORDERS[0], sensor, inputs)


def second_placebo(sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig) -> FloatArray:
    """Another order without meaning."""
    return _order(PLACEBO_ORDERS[1], sensor, inputs)


def _order(order: float, sensor: RimSensor, inputs: CarrierInputs) -> FloatArray:
    phase = order * inputs.carrier_angle
    return sensor.is_axial * np.array([np.cos(phase), np.sin(phase)])


def _tilts(
    pattern: Callable[[FloatArray, float, float, float], FloatArray],
    sensor: RimSensor,
    inputs: CarrierInputs,
) -> FloatArray:
    axes = (0.0, np.pi / 2.0)
    rows = [pattern(inputs.carrier_angle, sensor.angle, sensor.radius, axis) for axis in axes]
    return sensor.is_axial * np.array(rows)


def _uneven(
    sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig, shares: FloatArray
) -> FloatArray:
    return effects.uneven_pins_pattern(
        inputs.carrier_angle,
        sensor.angle,
        inputs.torque,
        shares,
        g=rig.curves["g_f"],
        pin_radius=rig.pin_radius,
        radial=not sensor.is_axial,
    )
