"""Tilt and shift of the carrier under the radial load."""

import numpy as np
from numpy.typing import NDArray

from carrierflex.simulation.carrier import patterns
from carrierflex.simulation.carrier.effect import Effect, angles, lengths, others, per_newton
from carrierflex.simulation.carrier.effects.alike import STATIC, STEPS_OF_LOAD
from carrierflex.simulation.carrier.effects.misalignment import housing_tilt_signals
from carrierflex.simulation.carrier.rim import CarrierInputs, CarrierRig, RimSensor
from carrierflex.simulation.effect_parameters import EffectParameter

FloatArray = NDArray[np.float64]
#: Loads that take up most of a clearance, over the largest load, between which signals are linear.
_LOAD_NODES = np.geomspace(0.02, 4.0, 9)


def _ntl_tilt(sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig) -> FloatArray:
    """Tilt about two axes of the housing with the load along y, then with the load along z."""
    tilts = housing_tilt_signals(sensor, inputs, rig)
    return np.concatenate([tilts * inputs.ntl_y, tilts * inputs.ntl_z])


def _bearing_clearance(
    sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig, F_s: float
) -> FloatArray:
    """Tilt of axial, then shift of radial sensors by a radial load that saturates at `F_s` [N]."""
    load = patterns.saturated_load(inputs.ntl_y, inputs.ntl_z, F_s)
    tilt = patterns.load_tilt_pattern(sensor.angle, sensor.radius, *load)
    shift = patterns.load_shift_pattern(sensor.angle, *load)
    return np.array([sensor.is_axial * tilt, (not sensor.is_axial) * shift])


def _load_nodes(rig: CarrierRig, largest_load: float) -> FloatArray:
    return _LOAD_NODES * largest_load


NTL_TILT = Effect(
    "ntl_tilt",
    equation="R sin(0 - v) (a_y F_y + a_z F_z) + R sin(pi/2 - v) (b_y F_y + b_z F_z)",
    parameters=per_newton("rad/N", 1e-9, "a_y", "b_y", "a_z", "b_z"),
    signature="order 0, m = +1 and -1 in equal parts, growing as the radial load",
    pattern=_ntl_tilt,
    follows_sensor=True,
    aliases=others("ntl_tilt", STATIC),
    discriminating_experiment=STEPS_OF_LOAD,
)
BEARING_CLEARANCE = Effect(
    "bearing_clearance",
    equation="(phi_B R e(v).F axial, r_B e(v).F radial) / sqrt(F^2 + F_s^2)",
    parameters=(
        *angles("phi_B"),
        *lengths("r_B", scale=1e-4),
        EffectParameter("F_s", "N", 1.0, 1e8, 5e4, shape=True),
    ),
    signature="order 0, m = +1 and -1, and a radial shift along the load, both with a limit",
    pattern=_bearing_clearance,
    shape_nodes=_load_nodes,
    aliases=others("bearing_clearance", STATIC),
    discriminating_experiment=(
        "radial loads of five sizes and both signs: a clearance saturates, a compliance does not"
    ),
)

RADIAL_LOAD = (NTL_TILT, BEARING_CLEARANCE)
