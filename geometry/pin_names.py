"""How many planets a body has, told by the names of its surfaces or pilots."""

import re
from collections.abc import Iterable

from carrierflex.geometry.parameters import FEWEST_PLANETS, MOST_PLANETS

_PIN = re.compile(r"pin_(\d{1,3})_(?:upwind|midspan|downwind)(?:_|$)")


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
