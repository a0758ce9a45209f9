"""What a law file of a carrier holds: frame and pattern, and the tables of its amplitudes."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from carrierflex.files.problems import refuse
from carrierflex.files.toml_values import (
    Expected,
    Number,
    Planets,
    Positive,
    Text,
    TomlTable,
    key,
)
from carrierflex.simulation.carrier.measured_laws.carrier_laws import (
    ALONG_LOAD,
    NONE,
    TIME,
)
from carrierflex.simulation.carrier.measured_laws.rim_patterns import RIM_PATTERNS, has_wave
from carrierflex.simulation.element.law_tables import LawName, LawPoints, unordered

#: Dependences, the radial load's five directions among them, and waves of 12 orders at most.
_MOST_PARTS, _MOST_WAVES = 16, 100
_MOST_POINTS = 10_000
_MOST_ORDER = 64
_Amplitudes = Annotated[
    list[Number],
    Field(min_length=1, max_length=_MOST_POINTS),
    Expected(f"a list of 1 to {_MOST_POINTS} finite numbers"),
]
_Frame = Annotated[Literal["housing", "carrier"], Expected("one of housing, carrier")]
_Pattern = Annotated[
    Literal["offset", "tilt", "saddle", "planet_pass", "load_sharing", "waves"],
    Expected("one of offset, tilt, saddle, planet_pass, load_sharing, waves"),
]
_Follows = Annotated[
    Literal["none", "torque", "radial_load", "load_sharing", "time"],
    Expected("one of none, torque, radial_load, load_sharing, time"),
]
_Along = Annotated[Literal["y", "z", "yy", "yz", "zz"], Expected("one of y, z, yy, yz, zz")]
_Quantity = Annotated[
    Literal["axial_displacement", "radial_displacement"],
    Expected("one of axial_displacement, radial_displacement"),
]
_Order = Annotated[
    int, Field(ge=0, le=_MOST_ORDER), Expected(f"a whole number, 0 to {_MOST_ORDER}")
]
_Lobes = Annotated[
    int,
    Field(ge=-_MOST_ORDER, le=_MOST_ORDER),
    Expected(f"a whole number, -{_MOST_ORDER} to {_MOST_ORDER}"),
]
_Range = Annotated[
    list[Number], Field(min_length=2, max_length=2), Expected("two finite numbers, the least first")
]


class LawWaveTable(TomlTable):
    """Amplitudes of one wave, ``cos(m v - n theta)`` and ``sin(m v - n theta)``."""

    quantity: _Quantity = key("Sensors that show it")
    order: _Order = key("Order n of the carrier angle theta")
    lobes: _Lobes = key("Lobes m around the housing, v the angle of a sensor")
    cosine: _Amplitudes = key(
        "Amplitudes of the cosine [m] at the points of x; [m/(N m)] where load_sharing is followed"
    )
    sine: _Amplitudes = key("Amplitudes of the sine, in the same unit")


class LawPartTable(TomlTable):
    """Waves that follow the loads in one way."""

    follows: _Follows = key("What the amplitudes follow; load_sharing is torque times radial load")
    along: _Along | None = key(
        "Factor of the amplitudes: component or product of components of the radial load's "
        "direction; for radial_load and load_sharing",
        default=None,
    )
    x: LawPoints | None = key(
        "Torque [N m], size of the radial load [N] from zero, or time as a share of the run, "
        "increasing; none where nothing is followed",
        default=None,
    )
    wave: list[LawWaveTable] = key("Waves of the pattern, up to 100")


class VisitedTable(TomlTable):
    """Loads of the records that gave the law, least and largest."""

    torque: _Range = key("Torque", "N m")
    ntl_y: _Range = key("Radial load along y", "N")
    ntl_z: _Range = key("Radial load along z", "N")


class CarrierLawDocument(TomlTable):
    """The measured shape of a class of a carrier: frame, pattern and what it follows."""

    format: Literal["carrierflex-carrier-law"] = key("Kind of the file")
    version: Literal[1] = key("Version of the format")
    name: LawName = key("Id of the effect in diagnoses")
    frame: _Frame = key("What stands still: the pattern in the housing, or on the carrier")
    pattern: _Pattern = key("Pattern over the sensors")
    n_planets: Planets = key("Number of planets, 3 to 8")
    sensor_radius: Positive = key("Radius of the sensors at which the amplitudes are those", "m")
    measured_on: Text | None = key("Campaign whose records gave it", default=None)
    visited: VisitedTable = key("Loads of these records")
    part: list[LawPartTable] = key("Parts that add up, up to 16")

    @model_validator(mode="after")
    def _is_a_law(self) -> Self:
        refuse(_contradictions(self))
        return self


def _contradictions(law: CarrierLawDocument) -> list[str]:
    """What several keys contradict each other in."""
    pattern = f"{law.frame}/{law.pattern}"
    if pattern not in RIM_PATTERNS:
        return [f"no pattern '{law.pattern}' of the {law.frame}; expected {_listed_patterns()}"]
    found = _wrong_number("tables [[part]]", len(law.part), _MOST_PARTS)
    for name, (low, high) in law.visited:
        if low > high:
            found.append(f"[visited]: {name} is {low:g} to {high:g}; expected the least first")
    for k, part in enumerate(law.part, start=1):
        place = f"[[part]] {k}"
        found += _wrong_number(f"{place}: tables [[part.wave]]", len(part.wave), _MOST_WAVES)
        found += _wrong_abscissa(place, part)
        for number, wave in enumerate(part.wave, start=1):
            own = f"{place}, wave {number}"
            found += _wrong_wave(own, part, wave)
            if not has_wave(pattern, wave.order, wave.lobes, law.n_planets):
                found.append(
                    f"{own}: order {wave.order} with {wave.lobes} lobes is no wave of {pattern} "
                    f"with {law.n_planets} planets"
                )
    return found


def _listed_patterns() -> str:
    return f"one of {', '.join(RIM_PATTERNS)}"


def _wrong_number(what: str, number: int, most: int) -> list[str]:
    """Message where tables are too few or too many."""
    return [] if 1 <= number <= most else [f"{what}: {number}; expected 1 to {most}"]


def _wrong_abscissa(place: str, part: LawPartTable) -> list[str]:
    """What is wrong with the abscissa and the direction of a part."""
    found = []
    if (part.along is not None) != (part.follows in ALONG_LOAD):
        expected = "expected a direction" if part.along is None else "expected no key along"
        found.append(f"{place}: along is {part.along} and follows {part.follows}; {expected}")
    if part.follows == NONE:
        if part.x is not None:
            found.append(f"{place}: x of a part that follows nothing; expected none")
        return found
    if part.x is None:
        found.append(f"{place}: no x; expected that of follows {part.follows}")
        return found
    found += unordered(place, part.x)
    if part.follows in ALONG_LOAD and part.x[0] != 0.0:
        found.append(f"{place}: x begins at {part.x[0]:g}; expected 0, the size of a load")
    elif part.follows == TIME and (part.x[0], part.x[-1]) != (0.0, 1.0):
        found.append(f"{place}: x is {part.x[0]:g} to {part.x[-1]:g}; expected 0 to 1, the run")
    return found


def _wrong_wave(place: str, part: LawPartTable, wave: LawWaveTable) -> list[str]:
    """What keeps the amplitudes of a wave from being functions of the abscissa."""
    found = []
    n_points = 1 if part.x is None else len(part.x)
    for name, amplitudes in (("cosine", wave.cosine), ("sine", wave.sine)):
        if len(amplitudes) != n_points:
            found.append(
                f"{place}: {name} has {len(amplitudes)} points; expected {n_points}, those of x"
            )
        if part.follows in ALONG_LOAD and amplitudes[0] != 0.0:
            found.append(
                f"{place}: {name} begins at {amplitudes[0]:g}; expected 0 without radial load"
            )
    return found
