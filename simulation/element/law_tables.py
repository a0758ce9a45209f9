"""What a law file of one element holds: class, units and the table of its measured shape."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from carrierflex.files.problems import refuse
from carrierflex.files.toml_values import Expected, NotNegative, Number, Text, TomlTable, key

#: Points that a table may have.
_MOST_POINTS = 10_000
LawPoints = Annotated[
    list[Number],
    Field(min_length=2, max_length=_MOST_POINTS),
    Expected(f"a list of 2 to {_MOST_POINTS} finite numbers"),
]
LawName = Annotated[
    str,
    Field(pattern=r"^[a-z][a-z0-9_]*$", max_length=80),
    Expected("an id of small letters, digits and underscores"),
]
LawClass = Annotated[
    Literal["restoring_force", "dissipation", "coupled_damping"],
    Expected("one of restoring_force, dissipation, coupled_damping"),
]


class LawTable(TomlTable):
    """Points of the measured shape; the ends are those of the visited range."""

    x: LawPoints = key(
        "Deflection [deflection_unit], increasing; of the class dissipation speed "
        "[deflection_unit/s]"
    )
    y: LawPoints = key(
        "Force [force_unit]; of the class coupled_damping damping [force_unit s/deflection_unit]"
    )
    friction_plus: NotNegative = key(
        "Dry friction at positive speed beside y [force_unit], class dissipation", default=0.0
    )
    friction_minus: NotNegative = key(
        "Dry friction at negative speed beside y [force_unit], class dissipation", default=0.0
    )


class LawDocument(TomlTable):
    """The measured shape of a class of effect of one element; time is in seconds."""

    format: Literal["carrierflex-law"] = key("Kind of the file")
    version: Literal[1] = key("Version of the format")
    name: LawName = key("Id of the effect in diagnoses")
    effect_class: LawClass = key("Class of the effect: f(x), g(v) or h(x) v")
    force_unit: Text = key("Unit of force of the records")
    deflection_unit: Text = key("Unit of deflection of the records")
    measured_on: Text | None = key("Campaign whose records gave it", default=None)
    table: LawTable = key("The measured shape")

    @model_validator(mode="after")
    def _is_a_function(self) -> Self:
        refuse(_contradictions(self))
        return self


def _contradictions(law: LawDocument) -> list[str]:
    """What several keys contradict each other in."""
    found = misplaced("[table]", law.table.x, law.table.y)
    if law.effect_class != "dissipation" and law.table.friction_plus + law.table.friction_minus:
        found.append(
            f"[table]: dry friction in the class {law.effect_class}; expected it in the class "
            "dissipation only"
        )
    return found


def misplaced(place: str, x: list[float], y: list[float]) -> list[str]:
    """What keeps points from being a function; `place` is named."""
    found = []
    if len(x) != len(y):
        found.append(f"{place}: x has {len(x)} and y {len(y)} points; expected as many")
    return found + unordered(place, x)


def unordered(place: str, x: list[float], name: str = "x") -> list[str]:
    """Message where an abscissa does not increase; `place` and `name` are told."""
    at = next((k for k in range(len(x) - 1) if not x[k] < x[k + 1]), None)
    if at is None:
        return []
    return [
        f"{place}: {name}[{at + 1}] is {x[at + 1]:g} after {x[at]:g}; expected increasing values"
    ]
