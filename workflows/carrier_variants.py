"""Both variants of the carrier from parameters to deflection curves: the part that several workflows share."""

from dataclasses import dataclass

from fe.carrier_curves import CarrierDeflection, carrier_deflection, flexible_cases, stiff_cases
from fe.structural_model import (
    FLEXIBLE_CARRIER_PILOTS,
    STIFF_CARRIER_PILOTS,
    StructuralModel,
    structural_model,
)
from geometry.carrier_mesh import flexible_carrier_mesh, stiff_carrier_mesh
from geometry.parameter_files import StageParameters
from geometry.tet_mesh import TetMesh


@dataclass(frozen=True, eq=False)
class CarrierVariant:
    """One variant's mesh, matrices and static solution."""

    mesh: TetMesh
    structure: StructuralModel
    deflection: CarrierDeflection


def flexible_variant(stage: StageParameters, size: float) -> CarrierVariant:
    """Carrier without pins, solved under the unit load cases."""
    mesh = flexible_carrier_mesh(stage.carrier, size)
    structure = structural_model("flexible_carrier", mesh, stage.carrier, FLEXIBLE_CARRIER_PILOTS)
    cases = flexible_cases(stage.carrier, stage.gear)
    return CarrierVariant(mesh, structure, carrier_deflection(structure, mesh.surface("shaft_face"), cases))


def stiff_variant(stage: StageParameters, size: float) -> CarrierVariant:
    """Carrier with bonded pins, solved under the unit load cases."""
    mesh = stiff_carrier_mesh(stage.carrier, stage.pin, size)
    structure = structural_model("stiff_carrier", mesh, stage.carrier, STIFF_CARRIER_PILOTS)
    cases = stiff_cases(stage.gear)
    return CarrierVariant(mesh, structure, carrier_deflection(structure, mesh.surface("shaft_face"), cases))
