"""Deflection of the carrier: flexible and stiff pins, clearance, uneven pin loads."""

from collections.abc import Collection
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from carrierflex.geometry.parameters import CarrierParameters
from carrierflex.simulation.carrier import kinematics, patterns
from carrierflex.simulation.carrier.effect import Effect, others, per_newton
from carrierflex.simulation.carrier.effects.alike import (
    AT_PLANET_ORDERS,
    ONCE_PER_TURN,
    STEPS_OF_TORQUE,
    WITH_RADIAL_LOAD,
)
from carrierflex.simulation.carrier.rim import CarrierInputs, CarrierRig, RimSensor
from carrierflex.simulation.effect_parameters import EffectParameter

FloatArray = NDArray[np.float64]
#: Threshold torques over the nominal torque between which signals are linear, as the law of a
#: closing clearance is wherever the torque stays off the node's cell.
_TORQUE_NODES = np.linspace(0.0, 1.0, 11)


def _flexible_pins(sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig) -> FloatArray:
    return _under_torque("delta_f", sensor, inputs, rig, inputs.torque)[None]


def _stiff_pins(sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig) -> FloatArray:
    return _under_torque("delta_s", sensor, inputs, rig, inputs.torque)[None]


def _pin_clearance(
    sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig, T_c: float
) -> FloatArray:
    """Stiff less flexible pins under the part of the torque beyond `T_c` [N m]."""
    return (_closed_pins(sensor, inputs, rig) * patterns.closing_torque(inputs.torque, T_c))[None]


# Pins bend in their bores under all that they carry. Torque loads all alike; weight and radial
# load turn through them. A closed pin answers to a small turned load as to the torque's excess, in
# the curves of a single pin, which leave orders 1, 2, 4 and 5 of a carrier of three: a static tilt,
# order 3 of one phase or a saddle, order 6 as a tilt. Stiff and flexible curve have amplitudes of
# their own: order 1 in them is that of a carrier clamped at its hub, not between two bearings.
def _pin_clearance_with_weight(
    sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig, T_c: float
) -> FloatArray:
    """The same, then what closed pins carry beside the torque."""
    turned = (np.abs(inputs.torque) > T_c) * _turned_loads(sensor, inputs, rig)
    return np.concatenate([_pin_clearance(sensor, inputs, rig, T_c), turned])


# The curves' splines are the same at every value of the threshold: the last inputs' are kept.
@lru_cache(maxsize=1)
def _closed_pins(sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig) -> FloatArray:
    """Stiff less flexible pins per torque [m/N m], shape (n,)."""
    one = np.ones_like(inputs.torque)
    stiff = _under_torque("delta_s", sensor, inputs, rig, one)
    return stiff - _under_torque("delta_f", sensor, inputs, rig, one)


@lru_cache(maxsize=1)
def _turned_loads(sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig) -> FloatArray:
    """Weight on stiff and on flexible pins, then the radial load, shape (4, n).

    Loads that stand still turn through the pins once a revolution.
    """
    pins = rig.pins_at(inputs.carrier_angle)
    along_y = np.stack([np.zeros_like(inputs.ntl_y), inputs.ntl_y])[:, None]
    along_z = np.stack([np.ones_like(inputs.ntl_z), inputs.ntl_z])[:, None]
    _, across = patterns.load_turned_shares(pins, along_y, along_z, rig.n_planets)
    shares = np.swapaxes(across, 0, 1)
    signals = [_tangential_loads(g, sensor, pins, rig, shares) for g in ("g_s", "g_f")]
    return np.stack(signals, axis=1).reshape(4, -1)


def _tangential_loads(
    curve: str, sensor: RimSensor, pins: FloatArray, rig: CarrierRig, across: FloatArray
) -> FloatArray:
    """Signals of pins that carry the tangential part ``F . t(beta_i)`` of m loads, shape (m, n)."""
    # As excess of a torque that loads every pin with one newton.
    one_newton = np.full_like(pins, rig.n_planets * rig.pin_radius)
    return patterns.uneven_pins_pattern(
        pins,
        sensor.angle,
        one_newton,
        across,
        g=rig.curves[curve],
        pin_radius=rig.pin_radius,
        radial=not sensor.is_axial,
    )


def _unequal_load_sharing(sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig) -> FloatArray:
    """Excess on every pin but the last, each taken from the last one."""
    shares = np.eye(rig.n_planets)[:-1]
    shares[:, -1] -= 1.0
    return np.array([_uneven_pins(sensor, inputs, rig, share) for share in shares])


def _load_sharing_ntl(sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig) -> FloatArray:
    """Excess along the radial load, then across it."""
    shares = patterns.load_turned_shares(
        rig.pins_at(inputs.carrier_angle), inputs.ntl_y, inputs.ntl_z, rig.n_planets
    )
    return np.array([_uneven_pins(sensor, inputs, rig, share) for share in shares])


def _under_torque(
    curve: str, sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig, torque: FloatArray
) -> FloatArray:
    """Deflection under a torque, as the sensor reads it, shape (n,)."""
    pattern = (
        kinematics.axial_deflection_pattern
        if sensor.is_axial
        else kinematics.radial_deflection_pattern
    )
    return pattern(
        inputs.carrier_angle, sensor.angle, torque, rig.curves[curve], pin_angle=rig.pin_angle
    )


def _uneven_pins(
    sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig, shares: FloatArray
) -> FloatArray:
    return patterns.uneven_pins_pattern(
        rig.pins_at(inputs.carrier_angle),
        sensor.angle,
        inputs.torque,
        shares,
        g=rig.curves["g_f"],
        pin_radius=rig.pin_radius,
        radial=not sensor.is_axial,
    )


def _torque_nodes(rig: CarrierRig, largest_load: float) -> FloatArray:
    return _TORQUE_NODES * rig.nominal_torque


FLEXIBLE_PINS = Effect(
    "flexible_pins",
    equation="rho_f delta_f(v - theta) T/T_unit",
    parameters=(EffectParameter("rho_f", "1", 0.0, 20.0, 0.5),),
    signature="order 3, m = -1, little of order 6, growing as the torque",
    pattern=_flexible_pins,
    follows_sensor=True,
    follows_delay=True,
    aliases=others("flexible_pins", AT_PLANET_ORDERS),
    discriminating_experiment=STEPS_OF_TORQUE,
)
STIFF_PINS = Effect(
    "stiff_pins",
    equation="rho_s delta_s(v - theta) T/T_unit",
    parameters=(EffectParameter("rho_s", "1", 0.0, 20.0, 0.5),),
    signature="order 6, m = 2, and order 3, m = -1, growing as the torque",
    pattern=_stiff_pins,
    follows_sensor=True,
    follows_delay=True,
    aliases=others("stiff_pins", AT_PLANET_ORDERS),
    discriminating_experiment=STEPS_OF_TORQUE,
)
PIN_CLEARANCE = Effect(
    "pin_clearance",
    equation="c (delta_s - delta_f)(v - theta) sign(T) max(|T| - T_c, 0)/T_unit",
    parameters=(
        EffectParameter("c", "1", 0.0, 20.0, 0.5),
        EffectParameter("T_c", "N m", 1.0, 1e8, 1e5, shape=True),
    ),
    signature="order 3 falls behind the torque and order 6 grows above a threshold torque",
    pattern=_pin_clearance,
    shape_nodes=_torque_nodes,
    aliases=others("pin_clearance", AT_PLANET_ORDERS),
    discriminating_experiment=(
        "torque in steps of a tenth up to the nominal: order 3 changes slope where the clearance "
        "closes"
    ),
)


def _pin_shares(n_planets: int) -> tuple[EffectParameter, ...]:
    """Excess loads of all pins but the last, whose own follows from their sum of zero."""
    names = (f"e_{pin}" for pin in range(1, n_planets))
    return tuple(EffectParameter(name, "1", -1.0, 1.0, 0.1) for name in names)


UNEQUAL_LOAD_SHARING = Effect(
    "unequal_load_sharing",
    equation="sum_i T/(n a) e_i g_f(v - theta - alpha_i), sum e_i = 0",
    parameters=_pin_shares(CarrierParameters.n_planets),
    signature="orders 1, 2, 4 and 5 fixed to the carrier, growing as the torque",
    pattern=_unequal_load_sharing,
    curves=("g_f",),
    aliases=others("unequal_load_sharing", ONCE_PER_TURN),
    discriminating_experiment=STEPS_OF_TORQUE,
)
LOAD_SHARING_NTL = Effect(
    "load_sharing_ntl",
    equation=(
        "sum_i T/(n a) e_i(t) g_f(v - theta - alpha_i), "
        "e_i = kappa_r F.e(beta_i) + kappa_t F.t(beta_i)"
    ),
    parameters=per_newton("1/N", 5e-7, "kappa_r", "kappa_t"),
    signature="order 0 tilt and orders 3 and 6, growing as torque times radial load",
    pattern=_load_sharing_ntl,
    curves=("g_f",),
    aliases=WITH_RADIAL_LOAD,
    discriminating_experiment="the same radial load at a quarter and at full torque",
)


def load_sharing_of(n_planets: int) -> Effect:
    """Unequal load sharing among some number of pins."""
    return replace(UNEQUAL_LOAD_SHARING, parameters=_pin_shares(n_planets))


def with_weight(clearance: Effect, curves: Collection[str]) -> Effect:
    """Closing pins, with what weight and radial load do to them where curves of a pin are known."""
    if not {"g_s", "g_f"} <= set(curves):
        return clearance
    c, T_c = clearance.parameters
    turned = (
        *(EffectParameter(name, "N", -1e6, 1e6, 1e4) for name in ("w_s", "w_f")),
        *(EffectParameter(name, "1", -10.0, 10.0, 0.1) for name in ("k_s", "k_f")),
    )
    return replace(
        clearance,
        equation=(
            f"{clearance.equation} + [|T| > T_c] "
            "sum_i ((w_s e_z + k_s F).t(beta_i) g_s + (w_f e_z + k_f F).t(beta_i) g_f)"
            "(v - theta - alpha_i)"
        ),
        parameters=(c, *turned, T_c),
        pattern=_pin_clearance_with_weight,
    )


DEFLECTION = (FLEXIBLE_PINS, STIFF_PINS, PIN_CLEARANCE, UNEQUAL_LOAD_SHARING, LOAD_SHARING_NTL)
