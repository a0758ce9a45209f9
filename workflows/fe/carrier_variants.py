"""Both variants of the carrier, from parameters or files to deflection curves."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

from carrierflex.fe.assembly import Assembly, assemble_stiffness_and_mass
from carrierflex.fe.carrier_curves import (
    CarrierDeflection,
    UnitCases,
    carrier_deflection,
    flexible_cases,
    stiff_cases,
)
from carrierflex.fe.scikit_fem_path import (
    displacement_by_scikit_fem,
    stiffness_and_mass_by_scikit_fem,
)
from carrierflex.fe.static import HeldSolver, held_displacement
from carrierflex.fe.structural_model import StructuralModel
from carrierflex.geometry.given_meshes.named_solids import GivenMesh
from carrierflex.geometry.parameter_files import StageParameters
from carrierflex.geometry.parameters import GearData
from carrierflex.geometry.pins import planets_of
from carrierflex.geometry.tet_mesh import TetMesh
from carrierflex.workflows.fe.bodies import body_structure, given_structure
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
class SolvedCarrier:
    """One variant's mesh, of whatever elements, its matrices, static solution and gear."""

    mesh: GivenMesh
    structure: StructuralModel
    deflection: CarrierDeflection
    gear: GearData

    @property
    def n_planets(self) -> int:
        """Number of its pins."""
        return planets_of(self.mesh.surfaces)


@dataclass(frozen=True, eq=False)
class CarrierVariant(SolvedCarrier):
    """The same of tetrahedra, as they are made from parameters."""

    mesh: TetMesh


def flexible_variant(
    stage: StageParameters, size: float, finite_elements: FiniteElements = COMPILED
) -> CarrierVariant:
    """Carrier without pins, solved under the unit load cases."""
    mesh, structure = body_structure("flexible_carrier", stage, size, finite_elements.assembly)
    cases = flexible_cases(stage.carrier, stage.gear)
    deflection = _deflection(mesh, structure, cases, finite_elements)
    return CarrierVariant(mesh, structure, deflection, stage.gear)


def stiff_variant(
    stage: StageParameters, size: float, finite_elements: FiniteElements = COMPILED
) -> CarrierVariant:
    """Carrier with bonded pins, solved under the unit load cases."""
    mesh, structure = body_structure("stiff_carrier", stage, size, finite_elements.assembly)
    cases = stiff_cases(stage.gear, stage.carrier.n_planets)
    deflection = _deflection(mesh, structure, cases, finite_elements)
    return CarrierVariant(mesh, structure, deflection, stage.gear)


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


def given_variant(
    variant: str,
    files: CarrierFiles,
    stage: StageParameters,
    size: float,
    finite_elements: FiniteElements = COMPILED,
) -> SolvedCarrier:
    """Carrier from a CAD model or mesh, solved under the unit load cases.

    The gear's centre distance is that of its bores.
    """
    mesh = files.mesh(variant, size)
    structure, interface = given_structure(
        variant, mesh, files.materials(), finite_elements.assembly
    )
    gear = replace(stage.gear, centre_distance=interface.centre_distance)
    cases = (
        flexible_cases(interface, gear)
        if variant == "flexible"
        else stiff_cases(gear, interface.n_planets)
    )
    deflection = _deflection(mesh, structure, cases, finite_elements)
    return SolvedCarrier(mesh, structure, deflection, gear)


def carrier_variant(
    variant: str, files: CarrierFiles, stage: StageParameters, size: float
) -> CarrierVariant:
    """Carrier of parameters or of a STEP file, solved under the unit load cases.

    Raises
    ------
    ValueError
        Where it is given of other elements than tetrahedra.
    """
    if not files.given:
        return (flexible_variant if variant == "flexible" else stiff_variant)(stage, size)
    given = given_variant(variant, files, stage, size)
    if not isinstance(given.mesh, TetMesh):
        raise ValueError("a carrier of hexahedra or wedges is given; expected tetrahedra alone")
    return CarrierVariant(given.mesh, given.structure, given.deflection, given.gear)


def _deflection(
    mesh: GivenMesh,
    structure: StructuralModel,
    cases: UnitCases,
    finite_elements: FiniteElements,
) -> CarrierDeflection:
    shaft_face = mesh.surface("shaft_face")
    return carrier_deflection(structure, shaft_face, cases, solver=finite_elements.solver)
