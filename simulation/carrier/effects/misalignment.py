"""Rigid motion of the carrier: offsets and tilts that no radial load makes."""

from collections.abc import Callable
from math import inf

import numpy as np
from numpy.typing import NDArray

from carrierflex.simulation.carrier import kinematics
from carrierflex.simulation.carrier.effect import (
    Effect,
    lengths,
    others,
    tilt_pair,
)
from carrierflex.simulation.carrier.effects.alike import (
    ONCE_PER_TURN,
    STATIC,
    STEPS_OF_LOAD,
    STEPS_OF_TORQUE,
)
from carrierflex.simulation.carrier.rim import CarrierInputs, CarrierRig, RimSensor
from carrierflex.simulation.effect_parameters import vector_parameters

FloatArray = NDArray[np.float64]
_QUARTER_TURN = np.pi / 2.0


def offset_signal(sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig) -> FloatArray:
    """One on axial sensors, shape (1, n)."""
    return sensor.is_axial * kinematics.offset_pattern(inputs.carrier_angle)[None]


def housing_tilt_signals(sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig) -> FloatArray:
    """Tilt about the housing angles 0 and 90 deg, shape (2, n) [m/rad]."""
    return _about_both_axes(kinematics.housing_tilt_pattern, sensor, inputs)


def _torque_tilt(sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig) -> FloatArray:
    return housing_tilt_signals(sensor, inputs, rig) * inputs.torque / rig.nominal_torque


def _carrier_tilt(sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig) -> FloatArray:
    return _about_both_axes(kinematics.carrier_tilt_pattern, sensor, inputs)


def _radial_offset(sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig) -> FloatArray:
    """Displacement along y, then along z of the housing."""
    return _along(kinematics.housing_offset_pattern, (-_QUARTER_TURN, 0.0), sensor, inputs)


def _eccentricity(sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig) -> FloatArray:
    """Displacement along the carrier-frame angles 0 and 90 deg."""
    return _along(kinematics.carrier_offset_pattern, (0.0, _QUARTER_TURN), sensor, inputs)


def _about_both_axes(
    pattern: Callable[[FloatArray, float, float, float], FloatArray],
    sensor: RimSensor,
    inputs: CarrierInputs,
) -> FloatArray:
    """Axial signals of tilts about the axes at 0 and at a quarter turn."""
    axes = (0.0, _QUARTER_TURN)
    rows = [pattern(inputs.carrier_angle, sensor.angle, sensor.radius, axis) for axis in axes]
    return sensor.is_axial * np.array(rows)


def _along(
    pattern: Callable[[FloatArray, float, float], FloatArray],
    directions: tuple[float, ...],
    sensor: RimSensor,
    inputs: CarrierInputs,
) -> FloatArray:
    """Radial signals of displacements along some directions."""
    rows = [pattern(inputs.carrier_angle, sensor.angle, direction) for direction in directions]
    return (not sensor.is_axial) * np.array(rows)


AXIAL_OFFSET = Effect(
    "axial_offset",
    equation="d_x, one value per run",
    parameters=lengths("d_x", scale=1e-3, bound=inf),
    signature="order 0, m = 0, different in every run",
    pattern=offset_signal,
    per_run=True,
    aliases=("sensor_zero", "thermal_drift"),
    discriminating_experiment="a zero reading at rest before every run",
)
HOUSING_TILT = Effect(
    "housing_tilt",
    equation="R phi_H sin(theta_H - v)",
    parameters=tilt_pair("phi_H", "theta_H"),
    signature="order 0, m = +1 and -1 in equal parts, independent of the load",
    pattern=housing_tilt_signals,
    follows_sensor=True,
    aliases=others("housing_tilt", STATIC),
    discriminating_experiment=STEPS_OF_LOAD,
)
TORQUE_TILT = Effect(
    "torque_tilt",
    equation="R phi_T T/T_nom sin(theta_T - v)",
    parameters=tilt_pair("phi_T", "theta_T"),
    signature="order 0, m = +1 and -1 in equal parts, growing as the torque",
    pattern=_torque_tilt,
    follows_sensor=True,
    aliases=others("torque_tilt", STATIC),
    discriminating_experiment=STEPS_OF_LOAD,
)
CARRIER_TILT = Effect(
    "carrier_tilt",
    equation="R phi_PLC sin(theta_PLC + theta - v)",
    parameters=tilt_pair("phi_PLC", "theta_PLC"),
    signature="order 1, m = +1, whatever the load",
    pattern=_carrier_tilt,
    follows_sensor=True,
    follows_delay=True,
    aliases=others("carrier_tilt", ONCE_PER_TURN),
    discriminating_experiment=STEPS_OF_TORQUE,
)

MISALIGNMENT = (AXIAL_OFFSET, HOUSING_TILT, TORQUE_TILT, CARRIER_TILT)

#: Radial motion that radial sensors need beside the contract's effects.
RADIAL_OFFSET = Effect(
    "radial_offset",
    equation="d_y cos(-pi/2 - v) + d_z cos(v), radial, one value per run",
    parameters=lengths("d_y", "d_z", scale=1e-3, bound=inf),
    signature="order 0 of the radial sensors, different in every run",
    pattern=_radial_offset,
    per_run=True,
)
ECCENTRICITY = Effect(
    "eccentricity",
    equation="e_PLC cos(theta_e + theta - v), radial",
    parameters=vector_parameters("e_PLC", "theta_e", "m", bound=inf, scale=1e-4),
    signature="order 1 of the radial sensors, forward, whatever the load",
    pattern=_eccentricity,
)
