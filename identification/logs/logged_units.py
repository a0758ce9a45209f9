"""Units as loggers write them, by pint, and the factors to what the contract asks for."""

import re
from functools import cache
from typing import Any

#: Other spellings, mostly of loggers, and words that pint takes for something else: its Nm is a
#: measure of yarn, its mil an angle, its g a mass.
_SPELLINGS = {
    "nm": "N*m",
    "knm": "kN*m",
    "mnm": "MN*m",
    "n-m": "N*m",
    "kn-m": "kN*m",
    "°": "deg",
    "grad": "deg",
    "degrees": "deg",
    "u/min": "rpm",
    "1/min": "rpm",
    "min-1": "rpm",
    "min^-1": "rpm",
    "r/min": "rpm",
    "rev/min": "rpm",
    "rev": "turn",
    "revs": "turn",
    "umdr": "turn",
    "turns": "turn",
    "mil": "thou",
    "mils": "thou",
    "micron": "um",
    "microns": "um",
    "g": "standard_gravity",
    "sec": "s",
    "msec": "ms",
    "usec": "us",
    "kp": "kgf",
    "lbs": "lbf",
    "lb": "lbf",
    "ft-lb": "ft*lbf",
    "ft-lbs": "ft*lbf",
}
#: Capital letters that make another unit.
_EXACT = {"MNm": "MN*m", "mNm": "mN*m", "Nm": "N*m", "kNm": "kN*m"}
_LONGEST = 40
#: Unit behind a column's name: "Weg [um]", "Torque (kN m)", "Zeit in ms", "Force/kN", "disp_um".
_BEHIND = (
    re.compile(r"[\[(<]\s*([^\])>]{1,40}?)\s*[\])>]\s*$"),
    re.compile(r"\s+in\s+(\S{1,20})\s*$"),
    re.compile(r"/\s*([^/\s]{1,20})\s*$"),
    re.compile(r"[_ .]([A-Za-zµμ°][A-Za-zµμ°²]{0,6})\s*$"),
)
#: Quantities whose unit a bare word at the end of a name may be; `t` or `x` are no units there.
_BARE = frozenset(
    "m mm um µm μm mil mils in n kn mn nm knm s ms us min deg rad rpm v mv turn pulses g".split()
)
#: Units that pint counts as pure numbers, and which a slip would make wrong by 2 pi.
_PER_SECOND = ("hz", "1/s", "s-1", "s^-1", "khz")
PULSES = "pulses"


@cache
def _registry() -> Any:
    import pint

    return pint.UnitRegistry(cache_folder=None)


def _spelling(unit: str) -> str:
    bare = unit.strip().strip("[]()").strip().replace("·", "*").replace("⋅", "*")
    return _EXACT.get(bare) or _SPELLINGS.get(bare.lower(), bare)


def is_unit(text: str) -> bool:
    """Whether a text is a unit that can be converted, or pulses."""
    return text.lower() == PULSES or _unit(text) is not None


def _unit(text: str) -> Any:
    import tokenize

    import pint

    if not text.strip() or len(text) > _LONGEST or not text.isprintable():
        return None
    try:
        return _registry().Unit(_spelling(text))
    except (
        pint.PintError,
        tokenize.TokenError,
        SyntaxError,
        ValueError,
        TypeError,
        AttributeError,
        ArithmeticError,
        RecursionError,
        AssertionError,
        KeyError,
    ):
        return None


def dimension_of(text: str) -> str:
    """Dimension of a unit, ``angle`` for angles; empty where it is no unit.

    >>> dimension_of("mm"), dimension_of("°")
    ('[length]^1', 'angle')
    """
    unit = _unit(text)
    if unit is None:
        return ""
    if unit.dimensionless:
        angles = ("degree", "radian", "turn", "gradian", "revolution")
        return "angle" if any(word in str(unit) for word in angles) else "number"
    # pint's own text depends on the order of the factors.
    return " ".join(f"{name}^{power:g}" for name, power in sorted(unit.dimensionality.items()))


def factor_to(unit: str, expected: str) -> float:
    """What values in `unit` are to be multiplied with to be in `expected`.

    Parameters
    ----------
    unit : str
        As the logger writes it.
    expected : str
        Unit of the contract: ``m``, ``N m``, ``rad``, ``rad/s`` ...

    Returns
    -------
    float
        Factor.

    Raises
    ------
    ValueError
        Where it is no unit, or one of something else.

    Examples
    --------
    >>> factor_to("µm", "m"), factor_to("kNm", "N m")
    (1e-06, 1000.0)
    """
    if unit.strip() == expected:
        return 1.0
    if expected in ("rad", "rad/s") and unit.strip().lower() in _PER_SECOND:
        raise ValueError(f"unit '{unit}' may be turns or radians; expected rpm or rad/s")
    parsed = _unit(unit)
    if parsed is None:
        raise ValueError(f"unit '{unit}' is not known; expected one of the kind of {expected}")
    wanted = dimension_of(expected)
    if dimension_of(unit) != wanted:
        raise ValueError(
            f"unit '{unit}' measures {dimension_of(unit)}; expected one of the kind of {expected}"
        )
    import pint

    try:
        quantity = _registry().Quantity(1.0, parsed).to(_spelling(expected))
    except pint.PintError as error:
        raise ValueError(f"unit '{unit}': {error}; expected one of {expected}") from error
    # Prefixes are products of rounded numbers: 1e-6 is to be 1e-6.
    return float(f"{quantity.magnitude:.15g}")


def unit_behind(name: str) -> str:
    """Unit that the name of a column ends with; empty where there is none."""
    for number, pattern in enumerate(_BEHIND):
        match = pattern.search(name)
        if match is None:
            continue
        text = match[1].strip()
        if number == len(_BEHIND) - 1 and text.lower() not in _BARE:
            continue
        if text.isdigit():
            # "load (1)": the number of a channel.
            continue
        if is_unit(text):
            return text
    return ""
