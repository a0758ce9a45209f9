"""Motion of the housing that carries the sensors, shape of the measured face, slow drift."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.geometry.parameters import CarrierParameters
from carrierflex.simulation.carrier import kinematics, patterns
from carrierflex.simulation.carrier.effect import Effect, angles, lengths, others, per_newton
from carrierflex.simulation.carrier.effects.alike import (
    AT_PLANET_ORDERS,
    STEPS_OF_LOAD,
    STEPS_OF_TORQUE,
)
from carrierflex.simulation.carrier.effects.misalignment import (
    housing_tilt_signals,
    offset_signal,
)
from carrierflex.simulation.carrier.rim import CarrierInputs, CarrierRig, RimSensor
from carrierflex.simulation.effect_parameters import EffectParameter

FloatArray = NDArray[np.float64]


def wave_orders(n_planets: int) -> range:
    """Orders of waves on the measured face: order 1 is a tilt of the carrier.

    Up to two beyond the second order of the pins, which waves have to be told from.
    """
    return range(2, 2 * n_planets + 3)


def face_runout_of(n_planets: int) -> Effect:
    """Waves on the face of a carrier of some number of planets."""
    highest = wave_orders(n_planets)[-1]
    return replace(
        FACE_RUNOUT,
        equation=f"sum_n a_n cos n(v - theta) + b_n sin n(v - theta), n = 2 to {highest}",
        parameters=_waves(n_planets),
    )


def _waves(n_planets: int) -> tuple[EffectParameter, ...]:
    orders = wave_orders(n_planets)
    return lengths(*(f"{name}_{order}" for order in orders for name in ("a", "b")))


def _flange_warp(sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig) -> FloatArray:
    """Saddle: constant, with the torque, with the load along y and z."""
    saddle = sensor.is_axial * kinematics.saddle_pattern(inputs.carrier_angle, sensor.angle)
    loads = (np.ones_like(saddle), inputs.torque / rig.nominal_torque, inputs.ntl_y, inputs.ntl_z)
    return np.array([saddle * load for load in loads])


def _face_runout(sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig) -> FloatArray:
    """Cosine and sine of every order."""
    waves = [
        patterns.face_waves_pattern(inputs.carrier_angle, sensor.angle, order)
        for order in wave_orders(rig.n_planets)
    ]
    return sensor.is_axial * np.array([wave for pair in waves for wave in pair])


def _ring_pass(sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig) -> FloatArray:
    """Offset, then tilt about two axes of the housing, once for each planet a revolution."""
    waves = patterns.planet_pass_pattern(
        inputs.carrier_angle, inputs.torque / rig.nominal_torque, rig.n_planets
    )
    shapes = [offset_signal(sensor, inputs, rig)[0], *housing_tilt_signals(sensor, inputs, rig)]
    return np.array([shape * wave for shape in shapes for wave in waves])


def _thermal_drift(sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig) -> FloatArray:
    """Slow polynomials in time."""
    polynomials = patterns.drift_patterns(inputs.time, inputs.start, inputs.end)
    return sensor.is_axial * np.array(polynomials)


FLANGE_WARP = Effect(
    "flange_warp",
    equation="(s_0 + s_T T/T_nom + s_y F_y + s_z F_z) cos 2(v - 47 deg)",
    parameters=(*lengths("s_0", "s_T"), *per_newton("m/N", 1e-10, "s_y", "s_z")),
    signature="order 0, m = 2, affine in torque and radial load",
    pattern=_flange_warp,
    follows_sensor=True,
    aliases=("sensor_zero",),
    discriminating_experiment=STEPS_OF_LOAD,
)
FACE_RUNOUT = Effect(
    "face_runout",
    equation="sum_n a_n cos n(v - theta) + b_n sin n(v - theta), n = 2 to 8",
    parameters=_waves(CarrierParameters.n_planets),
    signature="orders n >= 2, each in the single pattern m = n mod 4, whatever the load",
    pattern=_face_runout,
    aliases=others("face_runout", AT_PLANET_ORDERS),
    discriminating_experiment=STEPS_OF_TORQUE,
)
RING_PASS = Effect(
    "ring_pass",
    equation="T/T_nom (p + R q sin(0 - v) + R r sin(pi/2 - v)) at cos 3 theta and sin 3 theta",
    parameters=(
        *lengths("p_c", "p_s"),
        *angles("q_c", "q_s", "r_c", "r_s", scale=1e-4),
    ),
    signature=(
        "order 3 of one phase at all sensors, m = 0 or m = +1 together with m = -1, growing as "
        "the torque"
    ),
    pattern=_ring_pass,
    aliases=others("ring_pass", AT_PLANET_ORDERS),
    discriminating_experiment=(
        "two more axial sensors, or accelerometers on the housing: the housing itself moves"
    ),
)
THERMAL_DRIFT = Effect(
    "thermal_drift",
    equation="t_1 P_1(t) + t_2 P_2(t) + t_3 P_3(t) in every run",
    parameters=lengths("t_1", "t_2", "t_3"),
    signature="a slow change of order 0, m = 0, within a run",
    pattern=_thermal_drift,
    per_run=True,
    aliases=("axial_offset",),
    discriminating_experiment=(
        "a record after two hours at constant load, with the temperature of the housing"
    ),
)

HOUSING_AND_FACE = (FLANGE_WARP, FACE_RUNOUT, RING_PASS, THERMAL_DRIFT)
