"""Tilt and shift of the carrier under the radial load.

A clearance holds the carrier where its two bearings are pressed to: by the radial load and, where
that is small, by weight. In the planetary stage (``docs/stage_model.md``) the two bearings may be
pressed to opposite sides at rest, the housing hanging between them; a radial load then takes both
to one side and the tilt *away*, for either sign of the load. One saturating term cannot show that.
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
    """Tilt of axial sensors, then shift of radial ones, by the two bearings.

    Weight presses one of them upwards, the other downwards, as much as a radial load `F_s` [N].
    """
    loads = [
        patterns.saturated_load(inputs.ntl_y, inputs.ntl_z, F_s, weight) for weight in (F_s, -F_s)
    ]
    tilts = [patterns.load_tilt_pattern(sensor.angle, sensor.radius, *load) for load in loads]
    shifts = [patterns.load_shift_pattern(sensor.angle, *load) for load in loads]
    axial = float(sensor.is_axial)
    return np.array([*(axial * row for row in tilts), *((1.0 - axial) * row for row in shifts)])


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
    equation=(
        "R e(v).(phi_A u_+ + phi_B u_-) axial, e(v).(r_A u_+ + r_B u_-) radial; "
        "u_+- = (F +- F_s e_z) / sqrt(|F +- F_s e_z|^2 + F_s^2) less its value at F = 0"
    ),
    parameters=(
        *angles("phi_A", "phi_B"),
        *lengths("r_A", "r_B", scale=1e-4),
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
