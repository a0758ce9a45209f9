"""Both variants of the carrier, from parameters or files to deflection curves."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

from carrierflex.fe.assembly import Assembly, assemble_stiffness_and_mass
from carrierflex.fe.carrier_curves import (
    CarrierDeflection,
)
from carrierflex.fe.scikit_fem_path import (
    displacement_by_scikit_fem,
    stiffness_and_mass_by_scikit_fem,
)
from carrierflex.fe.static import HeldSolver, held_displacement
from carrierflex.geometry.parameter_files import StageParameters
from carrierflex.geometry.parameters import GearData
from carrierflex.geometry.tet_mesh import TetMesh
from carrierflex.workflows.fe.bodies import BuiltCarrier, built_carrier
from carrierflex.workflows.geometry.carrier_files import CarrierFiles


@dataclass(frozen=True)
class FiniteElements:
    """What makes K and M of a mesh, and what solves K u = f."""

    assembly: Assembly
    solver: HeldSolver


COMPILED = FiniteElements(assemble_stiffness_and_mass, held_displacement)

#: By name on the command line.
FINITE_ELEMENTS: dict[str, FiniteElements] = {
    "compiled": COMPILED,
    "scikit-fem": FiniteElements(stiffness_and_mass_by_scikit_fem, displacement_by_scikit_fem),
}


@dataclass(frozen=True, eq=False)
class SolvedCarrier(BuiltCarrier):
    """A variant of whatever elements with its static solution under the unit load cases."""

    deflection: CarrierDeflection


@dataclass(frozen=True, eq=False)
class CarrierVariant(SolvedCarrier):
    """The same of tetrahedra."""

    mesh: TetMesh


def solved_carrier(
    variant: str,
    stage: StageParameters,
    size: float,
    files: CarrierFiles | None = None,
    finite_elements: FiniteElements = COMPILED,
) -> SolvedCarrier:
    """Variant ``flexible`` or ``stiff`` of parameters or files, solved under the unit load cases.

    Errors as of :func:`~carrierflex.workflows.fe.bodies.built_carrier`.
    """
    built = built_carrier(variant, stage, size, files or CarrierFiles(), finite_elements.assembly)
    return SolvedCarrier(**vars(built), deflection=built.solved(finite_elements.solver))


def carrier_variant(
    variant: str, stage: StageParameters, size: float, files: CarrierFiles | None = None
) -> CarrierVariant:
    """The same of tetrahedra alone.

    Raises
    ------
    ValueError
        Where it is given of other elements.
    """
    solved = solved_carrier(variant, stage, size, files)
    if not isinstance(solved.mesh, TetMesh):
        raise ValueError("a carrier of hexahedra or wedges is given; expected tetrahedra alone")
    return CarrierVariant(**vars(solved))


def default_gear_notes(gear: GearData) -> Iterator[str]:
    """Name the gear data of a given carrier where they are those of the default stage."""
    if replace(gear, centre_distance=GearData.centre_distance) == GearData():
        yield (
            "the gear data are those of the default stage, not of this carrier: helix angle "
            f"{math.degrees(gear.helix_angle):.3g} deg, pressure angle "
            f"{math.degrees(gear.pressure_angle):.3g} deg, teeth of sun, planet and ring "
            f"{gear.sun_teeth}, {gear.planet_teeth}, {gear.ring_teeth}; they set the forces on the "
            "pins: give yours as [gear] of --parameters"
        )
