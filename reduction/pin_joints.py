"""The carrier with its pins in the reduced space, the pin fit as one bending stiffness."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from carrierflex.fe.load_cases import bonded_pin_load, together
from carrierflex.geometry.pins import PAPER_STIFFNESS, pin_angles, planets_of
from carrierflex.reduction.assembly import Joint, assembled
from carrierflex.reduction.reduced_model import ReducedModel, turned

#: Derived with beams for pins: gives the rim deflection of the paper's Table 4 (this chain's own
#: figure: docs/reduction.md).
TABLE_4_STIFFNESS = 1.4e7
#: Pin fits by name [N m/rad]: pins that pivot freely, the paper's, the one of Table 4, pins clamped
#: into rigid bores.
PIN_FITS = {"free": 0.0, "paper": PAPER_STIFFNESS, "table_4": TABLE_4_STIFFNESS, "rigid": math.inf}
#: A free pin would spin about its own axis; this holds it at one end, where no load makes it turn
#: [N m/rad].
_SPIN_HOLD = 1.0

_SECTIONS = ("upwind", "midspan", "downwind")


def pin_pilot(pin: int, section: str) -> str:
    """Name of a pilot on pin 1, 2, 3 ... in the assembly.

    Its carrier counterpart's name and ``_of_pin``.
    """
    return f"pin_{pin}_{section}_of_pin"


def carrier_with_pins(
    carrier: ReducedModel,
    pin: ReducedModel,
    stiffness: float = PAPER_STIFFNESS,
    *,
    sliding: bool = False,
) -> ReducedModel:
    """Join the flexible carrier and copies of pin 1, one for every pair of bores.

    Parameters
    ----------
    carrier : ReducedModel
        Carrier without pins, with the pilots ``pin_i_upwind`` and ``pin_i_downwind``.
    pin : ReducedModel
        Pin 1 in the carrier's frame.
    stiffness : float
        Bending and torsional stiffness of every interface [N m/rad], the paper's by default;
        `PIN_FITS` names others. 0 is a simply supported pin: each is kept from spinning by a spring
        at its upwind end alone, which transmits no moment. Infinite ties the rotations.
    sliding : bool
        Whether the pins' downwind ends are free to slide along x. The paper ties all translations;
        then even a pin of stiffness 0 keeps the plates' bores at its own length.

    Returns
    -------
    ReducedModel
        Assembly with the carrier's sensors.

    Raises
    ------
    ValueError
        Where `stiffness` is negative.
    """
    n_planets = planets_of(carrier.pilots)
    return carrier_with_each_pin(carrier, [pin] * n_planets, stiffness, sliding=sliding)


def carrier_with_each_pin(
    carrier: ReducedModel,
    pins: Sequence[ReducedModel],
    stiffness: float = PAPER_STIFFNESS,
    *,
    sliding: bool = False,
) -> ReducedModel:
    """Join the flexible carrier and a pin for every pair of bores, as :func:`carrier_with_pins`.

    Parameters
    ----------
    carrier, stiffness, sliding
        As there.
    pins : sequence of ReducedModel
        Pins for the bores 1, 2, 3 ..., each in the position of pin 1; their sensors turn with them
        and follow the carrier's.
    """
    bodies = [carrier]
    joints = []
    angles = pin_angles(planets_of(carrier.pilots))
    for number, (pin, angle) in enumerate(zip(pins, angles, strict=True), start=1):
        rename = {f"pin_1_{section}": pin_pilot(number, section) for section in _SECTIONS}
        bodies.append(turned(pin, float(angle), rename))
        for side in ("upwind", "downwind"):
            torsional = stiffness if stiffness != 0.0 or side == "downwind" else _SPIN_HOLD
            slides = sliding and side == "downwind"
            joints.append(
                Joint(f"pin_{number}_{side}", pin_pilot(number, side), stiffness, torsional, slides)
            )
    return assembled("carrier_with_pins", bodies, joints)


def drive_torque_load(
    force: float, moment: float, n_planets: int
) -> dict[str, NDArray[np.float64]]:
    """Loads at the pins' mid-spans in the assembly.

    Signs as in :func:`carrierflex.fe.load_cases.bonded_pin_load`.
    """
    pins = range(1, n_planets + 1)
    loads = together(*(bonded_pin_load(pin, force, moment, n_planets) for pin in pins))
    return {f"{name}_of_pin": load for name, load in loads.items()}
