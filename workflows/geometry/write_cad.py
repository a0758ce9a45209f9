"""What the parametric carrier is as a CAD model, and how its surfaces are stated.

Writes both.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from carrierflex.geometry.cad_surface_files import read_cad_statements, write_cad_statements
from carrierflex.geometry.parameter_files import read_parameters
from carrierflex.workflows.outputs import prepared_folder

if TYPE_CHECKING:
    from carrierflex.geometry.cad_faces import CadFace


def main(*, out: Path, parameters: Path | None = None) -> tuple[CadFace, ...]:
    """Write the parametric carrier as carrier.step (unit mm) and surfaces.toml, a template.

    Parameters
    ----------
    out
        Folder to write: carrier.step and surfaces.toml.
    parameters
        TOML file with the tables [carrier], [pin], [gear], dimensions in metres; a missing key has
        its default. four_planets: a bundled set.

    Returns
    -------
    tuple of CadFace
        Faces of the CAD model as written.
    """
    stage = read_parameters(parameters)
    prepared_folder(out)

    from carrierflex.geometry.cad_export import write_step
    from carrierflex.geometry.cad_mesh import step_faces

    write_step(stage.carrier, out / "carrier.step")
    write_cad_statements(out / "surfaces.toml", stage.carrier, stage.pin)
    return step_faces(out / "carrier.step", read_cad_statements(out / "surfaces.toml").frame)
