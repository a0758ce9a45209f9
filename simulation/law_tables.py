"""Tables of a law file, made of the description of a law (:mod:`carrierflex.simulation.laws`)."""

from dataclasses import MISSING, fields
from functools import reduce
from operator import or_
from typing import Annotated, Any, Literal, Self, get_type_hints

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, create_model, model_validator

from carrierflex.files.problems import refuse
from carrierflex.files.toml_values import (
    Expected,
    NotNegative,
    Number,
    Planets,
    Positive,
    Text,
    TomlTable,
    TwoNumbers,
    key,
)
from carrierflex.simulation.carrier.measured_laws.rim_patterns import LOADS_OF
from carrierflex.simulation.laws import (
    ACTS_ON,
    APART,
    EFFECT_CLASSES,
    N_STIFFNESS,
    RADIAL,
    SMOOTH,
    TERM_TYPES,
    Law,
    LawTerm,
)

_MOST_POINTS = 10_000
_MOST_PARTS = 2_000
_MOST_ORDER = 64


def _one_of(*names: str) -> Any:
    return Annotated[Literal[names], Expected(f"one of {', '.join(names)}")]


def _list_of(value: Any, least: int, most: int, words: str) -> Any:
    return Annotated[list[value], Field(min_length=least, max_length=most), Expected(words)]


def _rows_of(row: Any) -> Any:
    return list[row]


def _whole_number(least: int) -> Any:
    words = f"a whole number, {least} to {_MOST_ORDER}"
    return Annotated[int, Field(ge=least, le=_MOST_ORDER), Expected(words)]


_Points = _list_of(Number, 2, _MOST_POINTS, f"a list of 2 to {_MOST_POINTS} finite numbers")
#: Types of the keys of parts, by the kind of value of their field.
_VALUES: dict[str, Any] = {
    "acts_on": _one_of(*(name for names in ACTS_ON.values() for name in names)),
    "plane": _one_of(APART, RADIAL, SMOOTH),
    "number": Number,
    "positive": Positive,
    "not_negative": NotNegative,
    "points": _Points,
    "rows": _rows_of(_Points),
    "levels": _list_of(NotNegative, 2, _MOST_POINTS, "a list of numbers >= 0, one for each x"),
    "stiffness": _list_of(Positive, N_STIFFNESS, N_STIFFNESS, f"{N_STIFFNESS} numbers > 0"),
    "order": _whole_number(0),
    "lobes": _whole_number(-_MOST_ORDER),
    "follows": _one_of(*LOADS_OF),
    "along": _one_of("y", "z", "yy", "yz", "zz"),
    "amplitudes": _list_of(
        Number, 1, _MOST_POINTS, f"a list of 1 to {_MOST_POINTS} finite numbers"
    ),
}


def _table_of(term: type[LawTerm]) -> type[TomlTable]:
    """Table of a part: its fields, with the words of their annotations."""
    keys: dict[str, Any] = {"type": (Literal[term.__name__.lower()], key("Type of the part"))}
    hints = get_type_hints(term, include_extras=True)
    for field in fields(term):
        value, words = hints[field.name].__metadata__
        if field.default_factory is not MISSING or field.default == "":
            keys[field.name] = (_VALUES[value] | None, key(words, default=None))
        elif field.default is not MISSING:
            keys[field.name] = (_VALUES[value], key(words, default=field.default))
        else:
            keys[field.name] = (_VALUES[value], key(words))
    return create_model(f"{term.__name__}Part", __base__=TomlTable, __doc__=term.__doc__, **keys)


_TABLES = {term.__name__.lower(): (_table_of(term), term) for term in TERM_TYPES}
_PartTable: Any = reduce(or_, [table for table, _ in _TABLES.values()])


class UnitsTable(TomlTable):
    """Units of the records that gave the law; time is in seconds."""

    force: Text = key("Unit of force; N of bushings and of a carrier")
    deflection: Text = key("Unit of deflection; m of bushings and of a carrier")


class RigTable(TomlTable):
    """Carrier that gave the law: orders and amplitudes are those of this rig."""

    n_planets: Planets = key("Number of planets, 3 to 8")
    sensor_radius: Positive = key("Radius of the sensors", "m")


class VisitedTable(TomlTable):
    """Range of the records that gave the law, least and largest, where no table states it."""

    deflection: TwoNumbers | None = key(
        "Deflection; of bushings its size in the plane, from 0", default=None
    )
    torque: TwoNumbers | None = key("Torque of a carrier", "N m", default=None)
    ntl_y: TwoNumbers | None = key("Radial load of a carrier along y", "N", default=None)
    ntl_z: TwoNumbers | None = key("Radial load of a carrier along z", "N", default=None)


class LawDocument(TomlTable):
    """The measured shape of a class of effect: parts that add up."""

    format: Literal["carrierflex-law"] = key("Kind of the file")
    version: Literal[3] = key("Version of the format")
    name: Annotated[
        str,
        Field(pattern=r"^[a-z][a-z0-9_]*$", max_length=80),
        Expected("an id of small letters, digits and underscores"),
    ] = key("Id of the effect in diagnoses")
    kind: _one_of(*ACTS_ON) = key("Kind of the campaigns that it is for")  # type: ignore[valid-type]
    effect_class: _one_of(*EFFECT_CLASSES) = key(  # type: ignore[valid-type]
        "Class of the effect; of a carrier frame and pattern"
    )
    units: UnitsTable = key("Units of forces and deflections")
    measured_on: Text | None = key("Campaign whose records gave it", default=None)
    rig: RigTable | None = key("Carrier that gave it; for kind carrier", default=None)
    visited: VisitedTable | None = key("Range of the records; not for tables", default=None)
    part: Annotated[
        list[Annotated[_PartTable, Field(discriminator="type")]],  # pyright: ignore[reportInvalidTypeForm]
        Field(min_length=1, max_length=_MOST_PARTS),
    ] = key("Parts that add up")

    @model_validator(mode="after")
    def _is_a_law(self) -> Self:
        refuse(self.law().problems())
        return self

    def law(self) -> Law:
        """The law that the file describes."""
        return Law(
            self.name,
            self.kind,
            self.effect_class,
            (self.units.force, self.units.deflection),
            tuple(map(_part_of, self.part)),
            self.visited.given() if self.visited else {},
            self.rig.given() if self.rig else {},
            self.measured_on or "",
        )


def _part_of(table: TomlTable) -> Any:
    """Part of a table."""
    given = table.given()
    term_type: Any = _TABLES[given.pop("type")][1]
    return term_type(**{name: _array(v) if isinstance(v, list) else v for name, v in given.items()})


def _array(values: list[Any]) -> NDArray[Any]:
    """Array of a list; of rows that differ in length an array of lists, which is refused later."""
    is_even = len({len(row) if isinstance(row, list) else 0 for row in values}) <= 1
    return np.array(values, dtype=np.float64 if is_even else object)
