"""Linear-elastic isotropic materials, with the source of their values."""

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Material:
    """Isotropic material.

    Raises
    ------
    ValueError
        Where a value is outside its physical range.
    """

    name: str
    E: float
    """Young's modulus [Pa]."""
    nu: float
    """Poisson's ratio."""
    rho: float
    """Density [kg/m^3]."""

    def __post_init__(self) -> None:
        if not self.E > 0.0:
            raise ValueError(
                f"material {self.name}: E is {self.E} Pa; expected a positive Young's modulus"
            )
        if not -1.0 < self.nu < 0.5:
            raise ValueError(f"material {self.name}: nu is {self.nu}; expected between -1 and 0.5")
        if not self.rho > 0.0:
            raise ValueError(
                f"material {self.name}: rho is {self.rho} kg/m^3; expected a positive density"
            )
        if self.E < 1e9 or self.rho < 100.0:
            raise ValueError(
                f"material {self.name}: E = {self.E} Pa and rho = {self.rho} kg/m^3; expected SI "
                "units (steel: 2.1e11 Pa, 7850 kg/m^3)"
            )

    @property
    def lame(self) -> tuple[float, float]:
        """Lamé's parameters (lambda, mu) [Pa]."""
        return (
            self.E * self.nu / ((1.0 + self.nu) * (1.0 - 2.0 * self.nu)),
            self.E / (2.0 * (1.0 + self.nu)),
        )

    def lame_derivative(self, constant: str) -> tuple[float, float]:
        """Derivatives of Lamé's parameters by ``E`` or ``nu``.

        Raises
        ------
        ValueError
            Where the constant is another.
        """
        lame_lambda, mu = self.lame
        if constant == "E":
            return lame_lambda / self.E, mu / self.E
        if constant == "nu":
            nu = self.nu
            square = ((1.0 + nu) * (1.0 - 2.0 * nu)) ** 2
            return self.E * (1.0 + 2.0 * nu**2) / square, -self.E / (2.0 * (1.0 + nu) ** 2)
        raise ValueError(f"no elastic constant is named {constant!r}; expected E or nu")


#: Chosen: no grade of the carrier's cast iron is published; the usual one, data of EN 1563.
#: Deflections go as 1/E only.
CAST_IRON = Material("EN-GJS-700-2", E=176e9, nu=0.275, rho=7200.0)
#: Pins and shafts.
STEEL = Material("steel", E=210e9, nu=0.3, rho=7850.0)
#: Material of each body of :mod:`carrierflex.geometry.carrier_mesh` and
#: :mod:`carrierflex.geometry.main_shaft_mesh`.
BODY_MATERIALS = {"carrier": CAST_IRON, "pins": STEEL, "main_shaft": STEEL}


def material_of(materials: Mapping[str, Material], body: str) -> Material:
    """Material of a body of a mesh.

    Raises
    ------
    ValueError
        Where the body has none.
    """
    if body not in materials:
        raise ValueError(
            f"body {body!r} has no material; materials are given for {', '.join(sorted(materials))}"
        )
    return materials[body]
