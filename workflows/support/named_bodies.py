"""The bodies that workflows know by name: mesh and finite elements of each."""

from carrierflex.fe.assembly import Assembly, assemble_stiffness_and_mass
from carrierflex.fe.main_shaft import main_shaft_structure
from carrierflex.fe.structural_model import (
    PIN_PILOTS,
    StructuralModel,
    flexible_carrier_pilots,
    stiff_carrier_pilots,
    structural_model,
)
from carrierflex.geometry.carrier_mesh import flexible_carrier_mesh, pin_mesh, stiff_carrier_mesh
from carrierflex.geometry.main_shaft_mesh import main_shaft_mesh
from carrierflex.geometry.parameter_files import StageParameters
from carrierflex.geometry.tet_mesh import TetMesh


def body_name(body: str, variant: str) -> str:
    """Name of the body that the command line calls carrier (of a variant), pin or main_shaft."""
    return f"{variant}_carrier" if body == "carrier" else body


def body_structure(
    name: str,
    stage: StageParameters,
    size: float,
    assembly: Assembly = assemble_stiffness_and_mass,
) -> tuple[TetMesh, StructuralModel]:
    """Finite elements of ``pin``, ``main_shaft``, ``flexible_carrier``, ``stiff_carrier``; RBE3.

    Raises
    ------
    ValueError
        Where there is no body of that name.
    """
    if name == "main_shaft":
        mesh = main_shaft_mesh(stage.carrier, stage.main_shaft, size)
        return mesh, main_shaft_structure(mesh, stage.carrier, stage.main_shaft, assembly=assembly)
    pilots: tuple[str, ...]
    if name == "pin":
        mesh, pilots = pin_mesh(stage.carrier, stage.pin, size), PIN_PILOTS
    elif name == "flexible_carrier":
        mesh = flexible_carrier_mesh(stage.carrier, size)
        pilots = flexible_carrier_pilots(stage.carrier.n_planets)
    elif name == "stiff_carrier":
        mesh = stiff_carrier_mesh(stage.carrier, stage.pin, size)
        pilots = stiff_carrier_pilots(stage.carrier.n_planets)
    else:
        raise ValueError(
            f"no finite elements are known for a body named {name!r}; expected pin, "
            "flexible_carrier, stiff_carrier or "
            "main_shaft"
        )
    return mesh, structural_model(name, mesh, stage.carrier, pilots, assembly=assembly)
