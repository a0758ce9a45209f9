"""What a law file of one element with a memory holds: class, units, stops and branches."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from carrierflex.files.problems import refuse
from carrierflex.files.toml_values import (
    Expected,
    NotNegative,
    Number,
    Positive,
    Text,
    TomlTable,
    TwoNumbers,
    key,
)
from carrierflex.simulation.element.law_tables import LawName
from carrierflex.simulation.element.memory_laws import HYSTERESIS

#: Parts that a law may have.
_MOST_PARTS = 100
_Class = Annotated[Literal["hysteresis", "memory"], Expected("one of hysteresis, memory")]


class StopTable(TomlTable):
    """A spring in series with dry friction; z in -1 to 1 is its deflection over where it slips."""

    yield_deflection: Positive = key("Deflection at which it slips [deflection_unit]")
    middle: Number = key("Deflection where the place s is zero [deflection_unit]", default=0.0)
    half_range: Positive = key(
        "Deflection from the middle at which s is 1 [deflection_unit]", default=1.0
    )
    slip: NotNegative = key("Force at slip, anywhere [force_unit]", default=0.0)
    slip_middle: NotNegative = key("Force at slip beside it, times 1 - |s|", default=0.0)
    slip_upper: NotNegative = key("The same times s where s > 0", default=0.0)
    slip_lower: NotNegative = key("The same times -s where s < 0", default=0.0)
    inner: NotNegative = key("Force per z within -1/2 and 1/2 [force_unit]", default=0.0)
    outer_upper: NotNegative = key("Force per z above 1/2 [force_unit]", default=0.0)
    outer_lower: NotNegative = key("Force per z below -1/2 [force_unit]", default=0.0)


class BranchTable(TomlTable):
    """A spring in series with a damper."""

    tau: Positive = key("Relaxation time [s]")
    stiffness: NotNegative = key("Stiffness of the spring [force_unit/deflection_unit]")


class MemoryLawDocument(TomlTable):
    """The measured law of a class of effect with a memory; parts add up, time is in seconds."""

    format: Literal["carrierflex-memory-law"] = key("Kind of the file")
    version: Literal[1] = key("Version of the format")
    name: LawName = key("Id of the effect in diagnoses")
    effect_class: _Class = key("Class of the effect: stops, or branches")
    force_unit: Text = key("Unit of force of the records")
    deflection_unit: Text = key("Unit of deflection of the records")
    visited: TwoNumbers = key("Deflections between which it was measured [deflection_unit]")
    measured_on: Text | None = key("Campaign whose records gave it", default=None)
    stop: list[StopTable] = Field(default_factory=list, description="Stops of a hysteresis.")
    branch: list[BranchTable] = Field(default_factory=list, description="Branches of a memory.")

    @model_validator(mode="after")
    def _has_its_parts(self) -> Self:
        found = []
        is_hysteresis = self.effect_class == HYSTERESIS
        n_own = len(self.stop) if is_hysteresis else len(self.branch)
        own = "[[stop]]" if is_hysteresis else "[[branch]]"
        if not 1 <= n_own <= _MOST_PARTS or n_own < len(self.stop) + len(self.branch):
            found.append(
                f"{len(self.stop)} tables [[stop]] and {len(self.branch)} [[branch]]; expected 1 "
                f"to {_MOST_PARTS} tables {own} of a {self.effect_class}, and no other"
            )
        if not self.visited[0] < self.visited[1]:
            found.append(f"visited is {list(self.visited)}; expected two increasing deflections")
        refuse(found)
        return self
