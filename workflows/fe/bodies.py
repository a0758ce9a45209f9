"""The bodies that workflows know: mesh and finite elements of each, by name or from files."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial

from carrierflex.fe.assembly import Assembly, assemble_stiffness_and_mass
from carrierflex.fe.carrier_curves import (
    CarrierDeflection,
    UnitCases,
    carrier_deflection,
    flexible_cases,
    stiff_cases,
)
from carrierflex.fe.main_shaft import main_shaft_structure
from carrierflex.fe.materials import Material
from carrierflex.fe.solids.solid_matrices import solid_matrices
from carrierflex.fe.static import HeldSolver, held_displacement
from carrierflex.fe.structural_model import (
    PIN_PILOTS,
    StructuralModel,
    coupled_model,
    flexible_carrier_pilots,
    stiff_carrier_pilots,
    structural_model,
)
from carrierflex.geometry.bonded_pin import bonded_pin
from carrierflex.geometry.carrier_interface import CarrierInterface, carrier_interface
from carrierflex.geometry.carrier_mesh import flexible_carrier_mesh, pin_mesh, stiff_carrier_mesh
from carrierflex.geometry.given_meshes.named_solids import GivenMesh, NamedSolids
from carrierflex.geometry.main_shaft_mesh import main_shaft_mesh
from carrierflex.geometry.parameter_files import StageParameters
from carrierflex.geometry.parameters import CarrierParameters, GearData
from carrierflex.geometry.tet_mesh import TetMesh
from carrierflex.workflows.geometry.carrier_files import CarrierFiles


def body_name(body: str, variant: str) -> str:
    """Name of the body that the command line calls carrier (of a variant), pin or main_shaft."""
    return f"{variant}_carrier" if body == "carrier" else body


def body_mesh(name: str, stage: StageParameters, size: float) -> TetMesh:
    """Mesh of ``pin``, ``main_shaft``, ``flexible_carrier`` or ``stiff_carrier``.

    Raises
    ------
    ValueError
        Where there is no body of that name.
    """
    if name == "main_shaft":
        return main_shaft_mesh(stage.carrier, stage.main_shaft, size)
    if name == "pin":
        return pin_mesh(stage.carrier, stage.pin, size)
    if name == "flexible_carrier":
        return flexible_carrier_mesh(stage.carrier, size)
    if name == "stiff_carrier":
        return stiff_carrier_mesh(stage.carrier, stage.pin, size)
    raise ValueError(
        f"no finite elements are known for a body named {name!r}; expected pin, flexible_carrier, "
        "stiff_carrier or main_shaft"
    )


def body_structure(
    name: str,
    stage: StageParameters,
    size: float,
    assembly: Assembly = assemble_stiffness_and_mass,
) -> tuple[TetMesh, StructuralModel]:
    """Finite elements of a body of :func:`body_mesh`, its errors; RBE3."""
    mesh = body_mesh(name, stage, size)
    if name == "main_shaft":
        return mesh, main_shaft_structure(mesh, stage.carrier, stage.main_shaft, assembly=assembly)
    pilots = PIN_PILOTS if name == "pin" else _carrier_pilots(name, stage.carrier.n_planets)
    return mesh, structural_model(name, mesh, stage.carrier, pilots, assembly=assembly)


def given_structure(
    variant: str,
    mesh: GivenMesh,
    materials: Mapping[str, Material],
    assembly: Assembly = assemble_stiffness_and_mass,
) -> tuple[StructuralModel, CarrierInterface]:
    """Finite elements of a carrier whose dimensions are read off its mesh, and these dimensions.

    Raises
    ------
    KeyError, ValueError
        Where a surface is missing or does not fit, or a body of the mesh has no material; where
        another `assembly` is asked for of solids that are not tetrahedra alone.
    """
    interface = carrier_interface(mesh)
    name = f"{variant}_carrier"
    pilots = _carrier_pilots(name, interface.n_planets)
    if isinstance(mesh, NamedSolids):
        if assembly is not assemble_stiffness_and_mass:
            raise ValueError(
                "--assembly scikit-fem is given with a mesh of hexahedra or wedges; expected "
                "compiled, which takes scikit-fem's shape functions for them, or tetrahedra alone"
            )
        matrices = partial(solid_matrices, mesh, materials)
        return coupled_model(name, mesh, interface, pilots, matrices), interface
    structure = structural_model(
        name, mesh, interface, pilots, materials=materials, assembly=assembly
    )
    return structure, interface


@dataclass(frozen=True, eq=False)
class BuiltCarrier:
    """A variant of the carrier, of parameters or files: mesh, matrices, interface, and its gear."""

    mesh: GivenMesh
    structure: StructuralModel
    interface: CarrierParameters | CarrierInterface
    gear: GearData

    @property
    def n_planets(self) -> int:
        """Number of its pins."""
        return self.interface.n_planets

    @property
    def cases(self) -> UnitCases:
        """Its unit load cases."""
        if self.structure.name == "flexible_carrier":
            return flexible_cases(self.interface, self.gear)
        return stiff_cases(self.gear, self.n_planets)

    def solved(self, solver: HeldSolver = held_displacement) -> CarrierDeflection:
        """Deflection under the unit load cases, the shaft face held."""
        face = self.mesh.surface("shaft_face")
        return carrier_deflection(self.structure, face, self.cases, solver=solver)


def built_carrier(
    variant: str,
    stage: StageParameters,
    size: float,
    files: CarrierFiles,
    assembly: Assembly = assemble_stiffness_and_mass,
) -> BuiltCarrier:
    """Finite elements of a variant of the carrier; errors as of :func:`given_structure`.

    The gear's centre distance is that of the bores of a given carrier.
    """
    if not files.given:
        mesh, structure = body_structure(f"{variant}_carrier", stage, size, assembly)
        return BuiltCarrier(mesh, structure, stage.carrier, stage.gear)
    given = files.mesh(variant, size)
    structure, interface = given_structure(variant, given, files.materials(), assembly)
    gear = replace(stage.gear, centre_distance=interface.centre_distance)
    return BuiltCarrier(given, structure, interface, gear)


def built_pin(
    stage: StageParameters, size: float, files: CarrierFiles, stiff: GivenMesh | None = None
) -> StructuralModel:
    """Finite elements of pin 1: of parameters, or out of a given carrier with bonded pins.

    Parameters
    ----------
    stage : StageParameters
        Dimensions.
    size : float
        Element edge length [m].
    files : CarrierFiles
        Files of a given carrier.
    stiff : GivenMesh, optional
        Its mesh with bonded pins, where it is there already.

    Raises
    ------
    ValueError
        Where that mesh is not of tetrahedra alone.
    """
    if not files.given:
        return body_structure("pin", stage, size)[1]
    mesh = files.mesh("stiff", size) if stiff is None else stiff
    if not isinstance(mesh, TetMesh):
        raise ValueError("a carrier of hexahedra or wedges is given; expected tetrahedra alone")
    return structural_model(
        "pin", bonded_pin(mesh), carrier_interface(mesh), PIN_PILOTS, materials=files.materials()
    )


def _carrier_pilots(name: str, n_planets: int) -> tuple[str, ...]:
    if name == "flexible_carrier":
        return flexible_carrier_pilots(n_planets)
    return stiff_carrier_pilots(n_planets)
