"""Defaults in the help of options, with their unit as people say it: 24 mm (0.024 m)."""

import inspect
import math
import re
from typing import Annotated, Any

from cyclopts import Parameter

#: Prefixes by power of ten.
_PREFIXES = {-9: "n", -6: "u", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
#: Units that take a prefix; of others the number stays.
_PREFIXED = {"m", "N", "N m", "N/m", "N m/rad", "N s/m", "rad", "Pa"}
_UNIT = re.compile(r"\[([^\]]+)\]")


def units_of(docstring: str) -> dict[str, str]:
    """Unit by parameter of a NumPy docstring: what stands first in square brackets in its text."""
    units: dict[str, str] = {}
    names: list[str] = []
    for line in docstring.partition("Parameters\n----------\n")[2].splitlines():
        if line and not line.startswith(" "):
            names = [name.strip() for name in line.partition(" :")[0].split(",")]
            continue
        unit = _UNIT.search(line)
        if unit:
            units |= {name: unit[1] for name in names if name not in units}
    return units


def with_shown_default(option: inspect.Parameter, unit: str | None) -> inspect.Parameter:
    """The option, its default shown with the unit where it is a number with one."""
    value = option.default
    if unit is None or isinstance(value, bool) or not isinstance(value, int | float):
        return option
    shown = Parameter(show_default=lambda default: said(default, unit))
    annotation: Any = Annotated[option.annotation, shown]
    return option.replace(annotation=annotation)


def said(value: float, unit: str) -> str:
    """A value with its unit, and as people say it.

    Examples
    --------
    >>> said(0.024, "m")
    '24 mm (0.024 m)'
    >>> said(360e3, "N m")
    '360 kN m (360000 N m)'
    >>> said(8.2, "s")
    '8.2 s'
    """
    plainly = f"{_number(value)} {unit}"
    if unit not in _PREFIXED or not math.isfinite(value) or value == 0.0:
        return plainly
    power = 3 * math.floor(math.log10(abs(value) * (1.0 + 1e-12)) / 3.0)
    if power == 0 or power not in _PREFIXES:
        return plainly
    return f"{_number(value / 10.0**power)} {_PREFIXES[power]}{unit} ({plainly})"


def _number(value: float) -> str:
    text = f"{value:.6g}"
    return f"{value:.0f}" if "e+" in text and abs(value) < 1e7 else text
