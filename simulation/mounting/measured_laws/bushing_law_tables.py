"""What a law file of bushings holds: class, and the tables whose forces add up."""

from typing import Annotated, Literal, Self

from pydantic import model_validator

from carrierflex.files.problems import refuse
from carrierflex.files.toml_values import Expected, Text, TomlTable, key
from carrierflex.simulation.element.law_tables import LawClass, LawName, LawPoints, misplaced

#: Ways of two bushings.
_MOST_PARTS = 4
#: Ways of a force, and the bushings that have it.
Acts = Annotated[Literal["apart", "radial"], Expected("one of apart, radial")]
Bushing = Annotated[Literal["both", "starboard", "port"], Expected("one of both, starboard, port")]


class BushingPartTable(TomlTable):
    """One table; its ends are those of the visited range."""

    acts: Acts = key(
        "In y and in z apart, or along the deflection in the plane (of the class dissipation: "
        "along the speed)"
    )
    bushing: Bushing = key("Which bushing follows it")
    x: LawPoints = key(
        "Deflection [m], increasing, of a radial part its size from zero; of the class dissipation "
        "speed [m/s]"
    )
    y: LawPoints = key(
        "Force [N], of a radial part zero at zero; of the class coupled_damping damping [N s/m]"
    )


class BushingLawDocument(TomlTable):
    """The measured shape of a class of force of the bushings."""

    format: Literal["carrierflex-bushing-law"] = key("Kind of the file")
    version: Literal[1] = key("Version of the format")
    name: LawName = key("Id of the effect in diagnoses")
    effect_class: LawClass = key("Class of the effect: f(u), g(v) or h(u) v")
    measured_on: Text | None = key("Campaign whose records gave it", default=None)
    part: list[BushingPartTable] = key("Tables whose forces add up, up to four")

    @model_validator(mode="after")
    def _are_functions(self) -> Self:
        found: list[str] = []
        if not 1 <= len(self.part) <= _MOST_PARTS:
            found.append(f"{len(self.part)} tables [[part]]; expected 1 to {_MOST_PARTS}")
        for k, part in enumerate(self.part):
            place = f"[[part]] {k + 1}"
            found += misplaced(place, part.x, part.y)
            if part.acts != "radial":
                continue
            if part.x[0] != 0.0:
                found.append(f"{place}: x begins at {part.x[0]:g}; expected 0 of a radial part")
            if self.effect_class != "coupled_damping" and part.y[0] != 0.0:
                found.append(f"{place}: y begins at {part.y[0]:g}; expected 0 of a radial force")
        refuse(found)
        return self
