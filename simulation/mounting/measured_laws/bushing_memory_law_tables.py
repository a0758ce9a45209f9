"""What a law file of bushings with a memory holds: class, and the parts whose forces add up."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from carrierflex.files.problems import refuse
from carrierflex.files.toml_values import Expected, NotNegative, Positive, Text, TomlTable, key
from carrierflex.simulation.element.law_tables import LawName
from carrierflex.simulation.element.memory_law_tables import MemoryClass, part_problems
from carrierflex.simulation.mounting.measured_laws.bushing_law_tables import Bushing

#: Ways of a stop.
StopActs = Annotated[Literal["apart", "radial", "smooth"], Expected("one of apart, radial, smooth")]


class BushingStopTable(TomlTable):
    """A spring in series with dry friction."""

    acts: StopActs = key(
        "In y and in z apart, in the plane along its own deflection, or smoothly along its path"
    )
    bushing: Bushing = key("Which bushing has it")
    yield_deflection: Positive = key("Deflection at which it slips [m]")
    force: NotNegative = key("Force at slip [N]")


class BushingBranchTable(TomlTable):
    """A spring in series with a damper, the same in y and in z."""

    bushing: Bushing = key("Which bushing has it")
    tau: Positive = key("Relaxation time [s]")
    stiffness: NotNegative = key("Stiffness of the spring [N/m]")


class BushingMemoryLawDocument(TomlTable):
    """The measured law of a class of force of the bushings with a memory."""

    format: Literal["carrierflex-bushing-memory-law"] = key("Kind of the file")
    version: Literal[1] = key("Version of the format")
    name: LawName = key("Id of the effect in diagnoses")
    effect_class: MemoryClass = key("Class of the effect: stops, or branches")
    visited: Positive = key("Largest deflection in the plane at which it was measured [m]")
    measured_on: Text | None = key("Campaign whose records gave it", default=None)
    stop: list[BushingStopTable] = Field(
        default_factory=list, description="Stops of a hysteresis, relaxed where a record begins."
    )
    branch: list[BushingBranchTable] = Field(
        default_factory=list, description="Branches of a memory, relaxed where a record begins."
    )

    @model_validator(mode="after")
    def _has_its_parts(self) -> Self:
        refuse(part_problems(self.effect_class, {"stop": len(self.stop)}, len(self.branch)))
        return self
