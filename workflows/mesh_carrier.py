"""Which mesh does the carrier have? Writes it for other programs and tells its quality."""

from pathlib import Path
from typing import Literal

from geometry.carrier_mesh import DEFAULT_SIZE, flexible_carrier_mesh, stiff_carrier_mesh
from geometry.mesh_files import check_mesh_path, write_mesh
from geometry.parameter_files import read_parameters
from geometry.quality import MeshQuality, mesh_quality
from workflows.outputs import prepared_folder
from workflows.progress import Stages


def main(
    *,
    variant: Literal["stiff", "flexible"],
    out: Path,
    size: float = DEFAULT_SIZE,
    parameters: Path | None = None,
    quiet: bool = False,
) -> MeshQuality:
    """Mesh the planet carrier with quadratic tetrahedra and write it with its named surfaces as sets.

    Parameters
    ----------
    variant
        stiff: pins bonded into the bores; flexible: no pins.
    out
        Mesh file: .msh (gmsh), .vtu (ParaView) or .inp (Abaqus, C3D10); coordinates in metres.
    size
        Element edge length [m].
    parameters
        TOML file with the tables [carrier], [pin], [gear], dimensions in metres; what it leaves out keeps its default.
    quiet
        Show no progress.

    Returns
    -------
    MeshQuality
        A good mesh has a worst scaled Jacobian and a worst shape above 0.2.
    """
    stage = read_parameters(parameters)
    check_mesh_path(out)
    prepared_folder(out.parent)
    stages = Stages(2, quiet)
    with stages.stage(f"mesh of the {variant} carrier, {size} m"):
        if variant == "flexible":
            mesh = flexible_carrier_mesh(stage.carrier, size)
        else:
            mesh = stiff_carrier_mesh(stage.carrier, stage.pin, size)
    with stages.stage(f"writing {out}"):
        write_mesh(mesh, out)
    return mesh_quality(mesh)
