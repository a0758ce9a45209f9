"""What a law file of one element with a memory holds: class, units, stops and branches."""

from collections.abc import Mapping
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
from carrierflex.simulation.element.memory_laws import HYSTERESIS, N_STIFFNESS

#: Parts that a law may have.
_MOST_PARTS = 100
LoopStiffness = Annotated[
    list[Positive],
    Field(min_length=N_STIFFNESS, max_length=N_STIFFNESS),
    Expected(f"{N_STIFFNESS} numbers > 0"),
]
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


class LoopTable(TomlTable):
    """A smooth loop: force times z, with dz = c(z) / half_range times the deflection's change."""

    half_range: Positive = key("Deflection over which c = 1 changes z by 1 [deflection_unit]")
    force: NotNegative = key("Force at z = 1 [force_unit]")
    stiffness: LoopStiffness = key(
        "c where z has grown to -1, -0.75, ... 1 in the direction of motion, linear between them"
    )


class BranchTable(TomlTable):
    """A spring in series with a damper."""

    tau: Positive = key("Relaxation time [s]")
    stiffness: NotNegative = key("Stiffness of the spring [force_unit/deflection_unit]")


def part_problems(effect_class: str, slipping: Mapping[str, int], n_branches: int) -> list[str]:
    """What is wrong with the numbers of parts of a law: one text, or none.

    Parameters
    ----------
    effect_class : str
        ``hysteresis``, which has parts that slip, or ``memory``, which has branches.
    slipping : mapping of str to int
        Tables of the file by name: stops, and smooth loops where it may hold them.
    n_branches : int
        Tables ``branch`` of the file.
    """
    is_hysteresis = effect_class == HYSTERESIS
    n_slipping = sum(slipping.values())
    n_own = n_slipping if is_hysteresis else n_branches
    if 1 <= n_own <= _MOST_PARTS and n_own == n_slipping + n_branches:
        return []
    found = ", ".join(f"{number} [[{name}]]" for name, number in slipping.items())
    own = " or ".join(f"[[{name}]]" for name in (slipping if is_hysteresis else ("branch",)))
    return [
        f"tables are {found} and {n_branches} [[branch]]; expected 1 to {_MOST_PARTS} tables "
        f"{own} of a {effect_class}, and no other"
    ]


class MemoryLawDocument(TomlTable):
    """The measured law of a class of effect with a memory; parts add up, time is in seconds."""

    format: Literal["carrierflex-memory-law"] = key("Kind of the file")
    version: Literal[2] = key("Version of the format")
    name: LawName = key("Id of the effect in diagnoses")
    effect_class: MemoryClass = key("Class of the effect: stops, or branches")
    force_unit: Text = key("Unit of force of the records")
    deflection_unit: Text = key("Unit of deflection of the records")
    visited: TwoNumbers = key("Deflections between which it was measured [deflection_unit]")
    measured_on: Text | None = key("Campaign whose records gave it", default=None)
    stop: list[StopTable] = Field(default_factory=list, description="Stops of a hysteresis.")
    loop: list[LoopTable] = Field(default_factory=list, description="Its smooth loops.")
    branch: list[BranchTable] = Field(default_factory=list, description="Branches of a memory.")

    @model_validator(mode="after")
    def _has_its_parts(self) -> Self:
        slipping = {"stop": len(self.stop), "loop": len(self.loop)}
        found = part_problems(self.effect_class, slipping, len(self.branch))
        if not self.visited[0] < self.visited[1]:
            found.append(f"visited is {list(self.visited)}; expected two increasing deflections")
        refuse(found)
        return self
