"""Which mesh does the carrier have? Writes it for other programs and tells its quality."""

from pathlib import Path
from typing import Literal

from carrierflex.files.whole_files import refuse_foreign
from carrierflex.geometry.parameter_files import read_parameters
from carrierflex.geometry.quality import MeshQuality, mesh_quality
from carrierflex.geometry.tet_mesh import TetMesh
from carrierflex.workflows.outputs import prepared_folder
from carrierflex.workflows.progress import Stages


def main(
    *,
    out: Path,
    variant: Literal["stiff", "flexible"] = "flexible",
    size: float | None = None,
    step: Path | None = None,
    surfaces: Path | None = None,
    parameters: Path | None = None,
    quiet: bool = False,
) -> MeshQuality:
    """Mesh the planet carrier with quadratic tetrahedra, its surfaces as named sets.

    Parameters
    ----------
    out
        File to write: .msh (gmsh), .vtu (ParaView) or .inp (Abaqus, C3D10); coordinates in metres.
    variant
        stiff: pins bonded into the bores; flexible: no pins.
    size
        Element edge length [m]; default: 0.03; of a STEP file 0.66 of the solid's mean wall (twice
        its volume over its surface), less where webs are thin.
    step
        STEP file with the carrier without pins, instead of the parametric carrier; any length unit.
    surfaces
        TOML file that states the STEP file's surfaces; carrierflex cad writes one to start from.
    parameters
        TOML file with the tables [carrier], [pin], [gear], dimensions in metres; a missing key has
        its default. four_planets: a bundled set.
    quiet
        Show no progress.

    Returns
    -------
    MeshQuality
        A good mesh has a worst scaled Jacobian and a worst shape above 0.2.
    """
    stage = read_parameters(parameters)

    from carrierflex.geometry.carrier_mesh import flexible_carrier_mesh, stiff_carrier_mesh
    from carrierflex.geometry.mesh_files import check_mesh_path, write_mesh
    from carrierflex.workflows.geometry.carrier_files import CarrierFiles

    files = CarrierFiles(step, surfaces)
    check_mesh_path(out)
    refuse_foreign(out, "shaft_face", "rim_face")
    prepared_folder(out.parent)
    stages = Stages(2, quiet)
    edge = files.element_size(size)
    with stages.stage(f"mesh of the {variant} carrier, {edge:.4g} m"):
        if files.given:
            mesh = files.mesh(variant, edge)
            assert isinstance(mesh, TetMesh), "a STEP file is meshed with tetrahedra"
        elif variant == "flexible":
            mesh = flexible_carrier_mesh(stage.carrier, edge)
        else:
            mesh = stiff_carrier_mesh(stage.carrier, stage.pin, edge)
    with stages.stage(f"writing {out}"):
        write_mesh(mesh, out)
    return mesh_quality(mesh)
