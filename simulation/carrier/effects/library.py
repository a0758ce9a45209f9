"""All effects of the campaign contract of kind "carrier", in the order of the contract."""

from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from carrierflex.simulation.carrier import patterns
from carrierflex.simulation.carrier.effect import Effect, angles, lengths, others, per_newton
from carrierflex.simulation.carrier.effects.alike import STATIC, STEPS_OF_LOAD
from carrierflex.simulation.carrier.effects.deflection import DEFLECTION
from carrierflex.simulation.carrier.effects.housing_and_face import HOUSING_AND_FACE
from carrierflex.simulation.carrier.effects.misalignment import (
    ECCENTRICITY,
    MISALIGNMENT,
    RADIAL_OFFSET,
    housing_tilt_signals,
)
from carrierflex.simulation.carrier.rim import CarrierInputs, CarrierRig, RimSensor
from carrierflex.simulation.effect_parameters import EffectParameter
from carrierflex.simulation.measurement import Measurement

_SENSOR_GAIN = Effect(
    "sensor_gain",
    equation="(1 + g) times the signal of one channel",
    parameters=(EffectParameter("g", "1", -0.9, 5.0, 0.05),),
    signature="all orders of one channel in proportion: leaks into m = 2 in one constant ratio",
    measurement=Measurement.GAIN,
    aliases=("sensor_angle", "sensor_zero"),
    discriminating_experiment="the sensor's calibration on a micrometer",
)
_SENSOR_ANGLE = Effect(
    "sensor_angle",
    equation="the signal of one channel at v + dv",
    parameters=(EffectParameter("dv", "rad", -0.15, 0.15, 0.02),),
    signature="phase of one channel in proportion to the order",
    measurement=Measurement.ANGLE,
    aliases=("sensor_gain", "sensor_delay"),
    discriminating_experiment="the sensor's angle measured on the housing",
)
_SENSOR_ZERO = Effect(
    "sensor_zero",
    equation="z added to one channel, in all runs",
    parameters=lengths("z"),
    signature="order 0 of one channel in every run: a quarter in each pattern m",
    measurement=Measurement.ZERO,
    aliases=others("sensor_zero", STATIC),
    discriminating_experiment="a zero reading at rest",
)
_SENSOR_DELAY = Effect(
    "sensor_delay",
    equation="the signals of all channels at theta(t - tau)",
    parameters=(EffectParameter("tau", "s", -0.5, 0.5, 0.01),),
    signature="phase of all channels in proportion to the order and to the speed",
    measurement=Measurement.DELAY,
    aliases=("carrier_tilt", "sensor_angle"),
    discriminating_experiment="the same torque at two speeds",
)
_SENSORS = (_SENSOR_GAIN, _SENSOR_ANGLE, _SENSOR_ZERO, _SENSOR_DELAY)


_FloatArray = NDArray[np.float64]
#: Loads that take up most of a clearance, over the largest load, between which signals are linear.
_LOAD_NODES = np.geomspace(0.02, 4.0, 9)
#: The same of weights. A bearing turns to the other side where the load is as large as they are:
#: finer, for a larger weight stays where it is and one below every load of a record is a jump.
_WEIGHT_NODES = np.geomspace(0.04, 3.2, 13)
#: Load F_s that a bearing yields to beside its weight, over that weight: bearings of the stage are
#: far stiffer; 0.02 to 0.3 predict a load case from the others alike (docs/stage_model.md).
_YIELDING = 0.2


def _ntl_tilt(sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig) -> _FloatArray:
    """Tilt about two axes of the housing with the load along y, then with the load along z."""
    tilts = housing_tilt_signals(sensor, inputs, rig)
    return np.concatenate([tilts * inputs.ntl_y, tilts * inputs.ntl_z])


def _bearing_clearance(
    sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig, F_s: float
) -> _FloatArray:
    """Tilt of axial, then shift of radial sensors by a radial load that saturates at `F_s` [N]."""
    load = patterns.saturated_load(inputs.ntl_y, inputs.ntl_z, F_s, 0.0)
    return _tilt_and_shift(sensor, *load)


def _clearance_rocking(
    sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig, W_1: float, W_2: float
) -> _FloatArray:
    """Tilt of axial, then shift of radial sensors by two bearings that weight presses apart."""
    first, second = _PRESSED_APART
    return first(sensor, inputs, rig, W_1) + second(sensor, inputs, rig, W_2)


def _pressed_bearing(
    sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig, W: float, *, side: float
) -> _FloatArray:
    """Half the signal of the bearing that weight presses to a side as a radial load `W` [N]."""
    load = patterns.saturated_load(inputs.ntl_y, inputs.ntl_z, _YIELDING * W, side * W)
    return _tilt_and_shift(sensor, *(0.5 * side * np.array(load)))


_PRESSED_APART = (partial(_pressed_bearing, side=1.0), partial(_pressed_bearing, side=-1.0))


def _tilt_and_shift(sensor: RimSensor, along_y: _FloatArray, along_z: _FloatArray) -> _FloatArray:
    tilt = patterns.load_tilt_pattern(sensor.angle, sensor.radius, along_y, along_z)
    shift = patterns.load_shift_pattern(sensor.angle, along_y, along_z)
    return np.array([sensor.is_axial * tilt, (not sensor.is_axial) * shift])


def _weight_nodes(rig: CarrierRig, largest_load: float) -> _FloatArray:
    return _WEIGHT_NODES * largest_load


def _load_nodes(rig: CarrierRig, largest_load: float) -> _FloatArray:
    return _LOAD_NODES * largest_load


#: Load at which what a clearance leaves free is mostly used up; one far below every load of the
#: records is a jump, whose place they do not show.
_LIMITING_LOAD = EffectParameter("F_s", "N", 1.0, 1e8, 5e4, shape=True, may_reach_lower=True)
_NTL_TILT = Effect(
    "ntl_tilt",
    equation="R sin(0 - v) (a_y F_y + a_z F_z) + R sin(pi/2 - v) (b_y F_y + b_z F_z)",
    parameters=per_newton("rad/N", 1e-9, "a_y", "b_y", "a_z", "b_z"),
    signature="order 0, m = +1 and -1 in equal parts, growing as the radial load",
    pattern=_ntl_tilt,
    follows_sensor=True,
    aliases=others("ntl_tilt", STATIC),
    discriminating_experiment=STEPS_OF_LOAD,
)
_BEARING_CLEARANCE = Effect(
    "bearing_clearance",
    equation="(phi_B R e(v).F axial, r_B e(v).F radial) / sqrt(F^2 + F_s^2)",
    parameters=(
        *angles("phi_B"),
        *lengths("r_B", scale=1e-4),
        _LIMITING_LOAD,
    ),
    signature="order 0, m = +1 and -1, and a radial shift along the load, both with a limit",
    pattern=_bearing_clearance,
    shape_nodes=_load_nodes,
    aliases=others("bearing_clearance", STATIC),
    discriminating_experiment=(
        "radial loads of five sizes and both signs: a clearance saturates, a compliance does not"
    ),
)
CLEARANCE_ROCKING = Effect(
    "clearance_rocking",
    equation=(
        "phi_R R e(v).u axial, r_R e(v).u radial; u = (u_1 - u_2) / 2, "
        "u_i = (F +- W_i e_z) / sqrt(|F +- W_i e_z|^2 + (W_i/5)^2) less its value at F = 0"
    ),
    parameters=(
        *angles("phi_R"),
        *lengths("r_R", scale=1e-4),
        replace(_LIMITING_LOAD, name="W_1"),
        replace(_LIMITING_LOAD, name="W_2"),
    ),
    signature="order 0, m = +1 and -1, the same for both signs of the radial load, with a limit",
    pattern=_clearance_rocking,
    shape_nodes=_weight_nodes,
    shape_parts=_PRESSED_APART,
    aliases=others("clearance_rocking", STATIC),
    discriminating_experiment=(
        "radial loads of five sizes and both signs: a tilt that both signs reduce equally"
    ),
)
_RADIAL_LOAD = (_NTL_TILT, _BEARING_CLEARANCE, CLEARANCE_ROCKING)


CARRIER_EFFECTS: dict[str, Effect] = {
    effect.id: effect
    for effect in (*MISALIGNMENT, *DEFLECTION, *_RADIAL_LOAD, *HOUSING_AND_FACE, *_SENSORS)
}
#: Effects that radial sensors alone see; the shift is one for all runs, as the tilt of the housing.
RADIAL_MOTION: dict[str, Effect] = {
    effect.id: effect for effect in (replace(RADIAL_OFFSET, per_run=False), ECCENTRICITY)
}
