"""The effects as they show on a carrier of any number of planets.

Pins bend the rim in the orders N and 2 N of N planets, and of four axial sensors an order n that is
fixed to the carrier shows in the single pattern ``m = n mod 4``.
"""

from dataclasses import replace

from carrierflex.simulation.carrier.effect import Effect
from carrierflex.simulation.carrier.effects.deflection import (
    FLEXIBLE_PINS,
    LOAD_SHARING_NTL,
    PIN_CLEARANCE,
    STIFF_PINS,
    load_sharing_of,
)
from carrierflex.simulation.carrier.effects.housing_and_face import RING_PASS, face_runout_of
from carrierflex.simulation.carrier.effects.library import CARRIER_EFFECTS

#: Sensor pattern of an order fixed to the carrier, by the order's remainder on division by four.
_PATTERN_OF_REMAINDER = ("m = 0", "m = +1", "m = 2", "m = -1")


def effects_of(n_planets: int) -> dict[str, Effect]:
    """All effects of a carrier of `n_planets` by id, in the order of the contract.

    Parameters, equations and texts are those of its own orders.
    """
    of_planets = (
        _flexible_pins(n_planets),
        _stiff_pins(n_planets),
        _pin_clearance(n_planets),
        replace(
            load_sharing_of(n_planets),
            signature=f"orders {_uneven(n_planets)} fixed to the carrier, growing as the torque",
        ),
        replace(
            LOAD_SHARING_NTL,
            signature=(
                f"order 0 tilt and orders {n_planets} and {2 * n_planets}, growing as torque times "
                "radial load"
            ),
        ),
        face_runout_of(n_planets),
        _ring_pass(n_planets),
    )
    return {**CARRIER_EFFECTS, **{effect.id: effect for effect in of_planets}}


def pattern_of(order: int) -> str:
    """Sensor pattern in which an order that is fixed to the carrier shows: ``m = -1`` of order 3.

    >>> [pattern_of(order) for order in (1, 3, 4, 6)]
    ['m = +1', 'm = -1', 'm = 0', 'm = 2']
    """
    return _PATTERN_OF_REMAINDER[order % 4]


def _flexible_pins(n: int) -> Effect:
    orders = f"order {n}, {pattern_of(n)}, little of order {2 * n}"
    return replace(FLEXIBLE_PINS, signature=f"{orders}, growing as the torque")


def _stiff_pins(n: int) -> Effect:
    orders = f"order {2 * n}, {pattern_of(2 * n)}, and order {n}, {pattern_of(n)}"
    return replace(STIFF_PINS, signature=f"{orders}, growing as the torque")


def _pin_clearance(n: int) -> Effect:
    return replace(
        PIN_CLEARANCE,
        signature=(
            f"order {n} falls behind the torque and order {2 * n} grows above a threshold torque"
        ),
        discriminating_experiment=(
            f"torque in steps of a tenth up to the nominal: order {n} changes slope where the "
            "clearance closes"
        ),
    )


def _uneven(n: int) -> str:
    """``1, 2, 4 and 5``: orders below the second of the planets but for the first."""
    *first, last = (str(order) for order in range(1, 2 * n) if order != n)
    return f"{', '.join(first)} and {last}"


def _ring_pass(n: int) -> Effect:
    of_pins = pattern_of(n)
    of_ring = [name for name in ("m = 0", "m = +1", "m = -1") if name != of_pins]
    where = " or ".join(of_ring) + (f" together with {of_pins}" if len(of_ring) == 2 else "")
    return replace(
        RING_PASS,
        equation=RING_PASS.equation.replace("3 theta", f"{n} theta"),
        signature=f"order {n} of one phase at all sensors, {where}, growing as the torque",
    )
