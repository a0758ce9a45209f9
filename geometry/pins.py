"""Pins of a carrier: where they stand, and how many a body has by the names of its surfaces."""

import re
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from carrierflex.geometry.parameters import FEWEST_PLANETS, MOST_PLANETS

#: Paper, section 3.1: bending and torsional stiffness of each pin interface [N m/rad].
PAPER_STIFFNESS = 1e6
_PIN = re.compile(r"pin_(\d{1,3})_(?:upwind|midspan|downwind)(?:_|$)")


def pin_angles(n_planets: int) -> NDArray[np.float64]:
    """Carrier-frame angles of pins 1, 2, 3 ... [rad], shape (n_planets,): equal, from 0."""
    return 2.0 * np.pi * np.arange(n_planets) / n_planets


def planets_of(names: Iterable[str]) -> int:
    """Number of planets of a carrier whose pins' surfaces or pilots have these names.

    The highest number of a pin, as in ``pin_4_upwind``; three where fewer are named.

    Raises
    ------
    ValueError
        Where a pin has a higher number than a carrier has planets.
    """
    numbers = [int(match.group(1)) for name in names if (match := _PIN.match(name))]
    highest = max(numbers, default=0)
    if highest > MOST_PLANETS:
        raise ValueError(
            f"a pin has the number {highest}; expected pins 1 to at most {MOST_PLANETS}"
        )
    return max(highest, FEWEST_PLANETS)
