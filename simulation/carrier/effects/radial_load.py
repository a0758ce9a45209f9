"""Tilt and shift of the carrier under the radial load.

A clearance holds the carrier where its two bearings are pressed to: by the radial load and, where
that is small, by weight. In the planetary stage (``docs/stage_model.md``) the two bearings may be
pressed to opposite sides at rest, the housing hanging between them; a radial load then takes both
to one side and the tilt *away*, for either sign of the load. So there are two effects by parity:
what turns round with the load, and what does not.
"""

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
    load = patterns.saturated_load(inputs.ntl_y, inputs.ntl_z, F_s, 0.0)
    return _tilt_and_shift(sensor, *load)


def _clearance_rocking(
    sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig, F_s: float
) -> FloatArray:
    """Tilt of axial, then shift of radial sensors by bearings that weight presses apart.

    One upwards, the other downwards, as much as a radial load `F_s` [N]: half their difference.
    """
    up, down = (
        np.array(patterns.saturated_load(inputs.ntl_y, inputs.ntl_z, F_s, weight))
        for weight in (F_s, -F_s)
    )
    return _tilt_and_shift(sensor, *(0.5 * (up - down)))


def _tilt_and_shift(sensor: RimSensor, along_y: FloatArray, along_z: FloatArray) -> FloatArray:
    tilt = patterns.load_tilt_pattern(sensor.angle, sensor.radius, along_y, along_z)
    shift = patterns.load_shift_pattern(sensor.angle, along_y, along_z)
    return np.array([sensor.is_axial * tilt, (not sensor.is_axial) * shift])


def _load_nodes(rig: CarrierRig, largest_load: float) -> FloatArray:
    return _LOAD_NODES * largest_load


#: Load at which what a clearance leaves free is mostly used up; one far below every load of the
#: records is a jump, whose place they do not show.
_LIMITING_LOAD = EffectParameter("F_s", "N", 1.0, 1e8, 5e4, shape=True, is_unseen_below=True)
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
        "phi_R R e(v).u axial, r_R e(v).u radial; u = (u_+ - u_-) / 2, "
        "u_+- = (F +- F_s e_z) / sqrt(|F +- F_s e_z|^2 + F_s^2) less its value at F = 0"
    ),
    parameters=(
        *angles("phi_R"),
        *lengths("r_R", scale=1e-4),
        _LIMITING_LOAD,
    ),
    signature="order 0, m = +1 and -1, the same for both signs of the radial load, with a limit",
    pattern=_clearance_rocking,
    shape_nodes=_load_nodes,
    aliases=others("clearance_rocking", STATIC),
    discriminating_experiment=(
        "radial loads of five sizes and both signs: a tilt that both signs take away alike"
    ),
)

RADIAL_LOAD = (NTL_TILT, BEARING_CLEARANCE, CLEARANCE_ROCKING)
