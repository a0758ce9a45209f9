"""Tilt and shift of the carrier under the radial load.

A clearance holds the carrier where its two bearings are pressed to: by the radial load and, where
that is small, by weight. In the planetary stage (``docs/stage_model.md``) the two bearings may be
pressed to opposite sides at rest, the housing hanging between them; a radial load then takes both
to one side and the tilt *away*, for either sign of the load. So there are two effects: bearings
that turn round with the load, and bearings that rest on opposite sides until the load exceeds what
weight presses each of them with.
"""

from dataclasses import replace
from functools import partial

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
#: The same of weights. A bearing turns to the other side where the load is as large as they are:
#: finer, for a larger weight stays where it is and one below every load of a record is a jump.
_WEIGHT_NODES = np.geomspace(0.04, 3.2, 13)
#: Load F_s that a bearing yields to beside its weight, over that weight: bearings of the stage are
#: far stiffer; 0.02 to 0.3 predict a load case from the others alike (docs/stage_model.md).
_YIELDING = 0.2


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
    sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig, W_1: float, W_2: float
) -> FloatArray:
    """Tilt of axial, then shift of radial sensors by two bearings that weight presses apart."""
    first, second = _PRESSED_APART
    return first(sensor, inputs, rig, W_1) + second(sensor, inputs, rig, W_2)


def _pressed_bearing(
    sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig, W: float, *, side: float
) -> FloatArray:
    """Half the signal of the bearing that weight presses to a side as a radial load `W` [N]."""
    load = patterns.saturated_load(inputs.ntl_y, inputs.ntl_z, _YIELDING * W, side * W)
    return _tilt_and_shift(sensor, *(0.5 * side * np.array(load)))


_PRESSED_APART = (partial(_pressed_bearing, side=1.0), partial(_pressed_bearing, side=-1.0))


def _tilt_and_shift(sensor: RimSensor, along_y: FloatArray, along_z: FloatArray) -> FloatArray:
    tilt = patterns.load_tilt_pattern(sensor.angle, sensor.radius, along_y, along_z)
    shift = patterns.load_shift_pattern(sensor.angle, along_y, along_z)
    return np.array([sensor.is_axial * tilt, (not sensor.is_axial) * shift])


def _weight_nodes(rig: CarrierRig, largest_load: float) -> FloatArray:
    return _WEIGHT_NODES * largest_load


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
        "radial loads of five sizes and both signs: a tilt that both signs take away alike"
    ),
)

RADIAL_LOAD = (NTL_TILT, BEARING_CLEARANCE, CLEARANCE_ROCKING)
