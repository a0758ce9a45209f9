"""Sizes as an engineer reads them: three digits and a prefix, ``46.6 µm`` and ``3.39 kN s/m``."""

import math
import re

#: Stands for what is not known.
UNKNOWN = "–"
#: Rounding of a closed form: no signal of any unit in use is that small.
NOTHING = 1e-15
#: Units that take a prefix, and the prefixes with their factors.
_PREFIXED = re.compile(r"(m|N|N m|V|A|Pa|s|W|J|Hz)(/m|/s| s/m)?")
_PREFIXES = ((1e9, "n"), (1e6, "µ"), (1e3, "m"), (1.0, ""), (1e-3, "k"), (1e-6, "M"))


def number(value: float, digits: int = 3) -> str:
    """Number with so many significant digits; a dash for what is not finite."""
    return f"{value:.{digits}g}" if math.isfinite(value) else UNKNOWN


def scaled_unit(largest: float, unit: str) -> tuple[float, str]:
    """Factor and unit that show a size with few digits: ``2e-4 m`` as 200 µm."""
    if not (_PREFIXED.fullmatch(unit) and 0.0 < largest < math.inf):
        return 1.0, unit
    for factor, prefix in _PREFIXES:
        if 1.0 <= largest * factor < 1e3:
            return factor, prefix + unit
    return 1.0, unit


def sized(value: float, unit: str, digits: int = 3) -> str:
    """Size with its unit, prefixed: ``208 µm``; without one where it has none."""
    if not math.isfinite(value):
        return UNKNOWN
    if abs(value) < NOTHING:
        return f"0 {unit}".strip()
    factor, shown = scaled_unit(abs(value), unit)
    return f"{number(factor * value, digits)} {shown}".strip()
