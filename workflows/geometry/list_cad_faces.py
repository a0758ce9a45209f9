"""Which faces a CAD model has, by axis, radius and station.

Lists what surfaces.toml may name.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from carrierflex.geometry.cad_surface_files import CadFrame, read_cad_statements

if TYPE_CHECKING:
    from carrierflex.geometry.cad_faces import CadFace


def main(step: Path, *, surfaces: Path | None = None) -> tuple[CadFace, ...]:
    """List the faces of a STEP file: type, axis, radius, station and area, in metres.

    Parameters
    ----------
    step
        STEP file with one solid, in any length unit.
    surfaces
        Surfaces file (.toml) whose [frame] says where the carrier's axis lies; without it the
        file's own frame counts.

    Returns
    -------
    tuple of CadFace
        All faces, the largest first.
    """
    frame = CadFrame.of_the_file() if surfaces is None else read_cad_statements(surfaces).frame

    from carrierflex.geometry.cad_mesh import step_faces

    return tuple(sorted(step_faces(step, frame), key=lambda face: -face.area))
