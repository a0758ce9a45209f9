"""What a law file of a surface f(q, v) holds: its table, and dry friction beside it."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from carrierflex.files.problems import refuse
from carrierflex.files.toml_values import Expected, NotNegative, Text, TomlTable, key
from carrierflex.simulation.element.law_tables import LawName, LawPoints, unordered
from carrierflex.simulation.element.memory_law_tables import StopTable

#: Numbers and stops that a surface may have.
_MOST_VALUES = 100_000
_MOST_STOPS = 100
Levels = Annotated[list[NotNegative], Expected("a list of numbers >= 0, one for each value of x")]


class SurfaceTable(TomlTable):
    """Force over deflection and speed; the ends are those of the visited range."""

    x: LawPoints = key("Deflection [deflection_unit], increasing")
    v: LawPoints = key("Speed [deflection_unit/s], increasing")
    y: list[LawPoints] = key(
        "Force without dry friction [force_unit]: a row over v for each value of x"
    )
    friction: Levels = key(
        "Dry friction at x beside y [force_unit]; empty where there is none", default_factory=list
    )


class SurfaceLawDocument(TomlTable):
    """The measured force_surface of one element; time is in seconds."""

    format: Literal["carrierflex-surface-law"] = key("Kind of the file")
    version: Literal[1] = key("Version of the format")
    name: LawName = key("Id of the effect in diagnoses")
    force_unit: Text = key("Unit of force of the records")
    deflection_unit: Text = key("Unit of deflection of the records")
    measured_on: Text | None = key("Campaign whose records gave it", default=None)
    table: SurfaceTable = key("The measured surface")
    stop: list[StopTable] = Field(
        default_factory=list, description="Stops of the dry friction beside the table; they add up."
    )

    @model_validator(mode="after")
    def _is_a_surface(self) -> Self:
        table = self.table
        found = unordered("[table]", table.x) + unordered("[table]", table.v, "v")
        if len(table.y) != len(table.x):
            found.append(
                f"[table]: y has {len(table.y)} rows; expected one for each of the "
                f"{len(table.x)} values of x"
            )
        if len(table.friction) not in (0, len(table.x)):
            found.append(
                f"[table]: friction has {len(table.friction)} values; expected one for each of the "
                f"{len(table.x)} values of x"
            )
        wrong = next((k for k, row in enumerate(table.y) if len(row) != len(table.v)), None)
        if wrong is not None:
            found.append(
                f"[table]: row {wrong} of y has {len(table.y[wrong])} values; expected one for "
                f"each of the {len(table.v)} values of v"
            )
        if len(table.x) * len(table.v) > _MOST_VALUES:
            found.append(
                f"[table]: {len(table.x)} by {len(table.v)} points; expected at most {_MOST_VALUES}"
            )
        if len(self.stop) > _MOST_STOPS:
            found.append(f"{len(self.stop)} tables [[stop]]; expected at most {_MOST_STOPS}")
        refuse(found)
        return self
