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
MemoryClass = Annotated[Literal["hysteresis", "memory"], Expected("one of hysteresis, memory")]


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
    slip_outside: NotNegative = key("The same times min(4 |s|, 1)", default=0.0)
    inner: NotNegative = key("Force per z within -1/2 and 1/2 [force_unit]", default=0.0)
    outer_upper: NotNegative = key("Force per z above 1/2 [force_unit]", default=0.0)
    outer_lower: NotNegative = key("Force per z below -1/2 [force_unit]", default=0.0)


class BranchTable(TomlTable):
    """A spring in series with a damper."""

    tau: Positive = key("Relaxation time [s]")
    stiffness: NotNegative = key("Stiffness of the spring [force_unit/deflection_unit]")


def part_problems(effect_class: str, n_stops: int, n_branches: int) -> list[str]:
    """What is wrong with the numbers of parts of a law: one text, or none.

    Parameters
    ----------
    effect_class : str
        ``hysteresis``, which has stops, or ``memory``, which has branches.
    n_stops, n_branches : int
        Tables of the file.
    """
    is_hysteresis = effect_class == HYSTERESIS
    n_own = n_stops if is_hysteresis else n_branches
    if 1 <= n_own <= _MOST_PARTS and n_own == n_stops + n_branches:
        return []
    own = "[[stop]]" if is_hysteresis else "[[branch]]"
    return [
        f"{n_stops} tables [[stop]] and {n_branches} [[branch]]; expected 1 to {_MOST_PARTS} "
        f"tables {own} of a {effect_class}, and no other"
    ]


class MemoryLawDocument(TomlTable):
    """The measured law of a class of effect with a memory; parts add up, time is in seconds."""

    format: Literal["carrierflex-memory-law"] = key("Kind of the file")
    version: Literal[1] = key("Version of the format")
    name: LawName = key("Id of the effect in diagnoses")
    effect_class: MemoryClass = key("Class of the effect: stops, or branches")
    force_unit: Text = key("Unit of force of the records")
    deflection_unit: Text = key("Unit of deflection of the records")
    visited: TwoNumbers = key("Deflections between which it was measured [deflection_unit]")
    measured_on: Text | None = key("Campaign whose records gave it", default=None)
    stop: list[StopTable] = Field(default_factory=list, description="Stops of a hysteresis.")
    branch: list[BranchTable] = Field(default_factory=list, description="Branches of a memory.")

    @model_validator(mode="after")
    def _has_its_parts(self) -> Self:
        found = part_problems(self.effect_class, len(self.stop), len(self.branch))
        if not self.visited[0] < self.visited[1]:
            found.append(f"visited is {list(self.visited)}; expected two increasing deflections")
        refuse(found)
        return self
