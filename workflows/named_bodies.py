"""The bodies that workflows know by name: mesh and finite elements of each."""

from fe.structural_model import (
    FLEXIBLE_CARRIER_PILOTS,
    PIN_PILOTS,
    STIFF_CARRIER_PILOTS,
    StructuralModel,
    structural_model,
)
from geometry.carrier_mesh import flexible_carrier_mesh, pin_mesh, stiff_carrier_mesh
from geometry.parameter_files import StageParameters
from geometry.tet_mesh import TetMesh


def body_structure(name: str, stage: StageParameters, size: float) -> tuple[TetMesh, StructuralModel]:
    """Mesh and finite elements of ``pin``, ``flexible_carrier`` or ``stiff_carrier``, distributing couplings.

    Raises
    ------
    ValueError
        Where there is no body of that name.
    """
    pilots: tuple[str, ...]
    if name == "pin":
        mesh, pilots = pin_mesh(stage.carrier, stage.pin, size), PIN_PILOTS
    elif name == "flexible_carrier":
        mesh, pilots = flexible_carrier_mesh(stage.carrier, size), FLEXIBLE_CARRIER_PILOTS
    elif name == "stiff_carrier":
        mesh, pilots = stiff_carrier_mesh(stage.carrier, stage.pin, size), STIFF_CARRIER_PILOTS
    else:
        raise ValueError(
            f"no finite elements are known for a body named {name!r}; expected pin, flexible_carrier or stiff_carrier"
        )
    return mesh, structural_model(name, mesh, stage.carrier, pilots)
