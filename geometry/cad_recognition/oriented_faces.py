"""Faces of a CAD solid with the side their material is on, and triangles to draw them by."""

from dataclasses import dataclass, replace
from pathlib import Path

import gmsh
import numpy as np
from numpy.typing import NDArray

from carrierflex.files.child_process import in_child
from carrierflex.geometry.cad_faces import CadFace
from carrierflex.geometry.cad_recognition.step_solid import READER, declared_unit, step_solid
from carrierflex.geometry.cad_surface_files import CadFrame
from carrierflex.geometry.half_sector import MeshingError

_TRIANGLE = 2
#: Distance [m] beside a face at which it is asked whether there is material: far below any wall.
_PROBE_DISTANCE = 1e-5


@dataclass(frozen=True, eq=False)
class OrientedFace:
    """A face and where the solid's material is.

    Parameters
    ----------
    face : CadFace
        The face as measured.
    triangles : ndarray, shape (k, 3, 3)
        OpenCASCADE's triangulation [m].
    anchor : ndarray, shape (3,)
        A point on the face [m].
    outward : ndarray, shape (3,)
        Unit normal out of the material at `anchor`.
    """

    face: CadFace
    triangles: NDArray[np.float64]
    anchor: NDArray[np.float64]
    outward: NDArray[np.float64]

    @property
    def hollow(self) -> bool:
        """Whether a cylinder's material lies outside of it, as at a bore."""
        across = self.anchor - self.face.point
        across = across - (across @ self.face.direction) * self.face.direction
        return bool(across @ self.outward < 0.0)

    def moved(self, frame: CadFrame) -> "OrientedFace":
        """The face of the CAD model, in the carrier's frame."""
        turn = frame.rotation.T
        face = replace(
            self.face,
            direction=self.face.direction @ turn,
            point=(self.face.point - frame.origin) @ turn,
            outline=(self.face.outline - frame.origin) @ turn,
        )
        return OrientedFace(
            face,
            (self.triangles - frame.origin) @ turn,
            (self.anchor - frame.origin) @ turn,
            self.outward @ turn,
        )


@dataclass(frozen=True, eq=False)
class CadSolid:
    """The solid of a STEP file in the file's own frame.

    Parameters
    ----------
    faces : tuple of OrientedFace
        All its faces.
    declared : str
        Length unit that the file declares.
    volume : float
        Volume [m^3].
    """

    faces: tuple[OrientedFace, ...]
    declared: str
    volume: float

    @property
    def extent(self) -> NDArray[np.float64]:
        """Extent along the file's axes, shape (3,) [m]."""
        corners = np.concatenate([face.triangles.reshape(-1, 3) for face in self.faces])
        return np.asarray(np.ptp(corners, axis=0))


def cad_solid(
    path: Path, length_unit: str | None = None, solid: int | str | None = None
) -> CadSolid:
    """Faces of the solid in a STEP file, in metres.

    Parameters
    ----------
    path : Path
        STEP file with one solid.
    length_unit : str, optional
        m, cm, mm or inch, where the file declares a wrong one.
    solid : int or str, optional
        Number of the solid in a file with several, or ``united`` for all of them.

    Raises
    ------
    FileNotFoundError, ValueError
        Where the file is no STEP file with one solid, or its size is no carrier's.
    MeshingError
        Where OpenCASCADE cannot triangulate a face.
    """
    return in_child(_cad_solid, path, length_unit, solid, about=path, what=READER)


def _cad_solid(path: Path, length_unit: str | None, solid: int | str | None = None) -> CadSolid:
    with step_solid(path, CadFrame.of_the_file(length_unit, solid)) as (tag, faces):
        gmsh.model.mesh.importStl()
        oriented = tuple(_oriented(path, tag, face) for face in faces)
        return CadSolid(oriented, declared_unit(path), float(gmsh.model.occ.getMass(3, tag)))


def _oriented(path: Path, solid: int, face: CadFace) -> OrientedFace:
    numbers, coordinates, _ = gmsh.model.mesh.getNodes(2, face.tag, includeBoundary=True)
    corners = np.asarray(gmsh.model.mesh.getElementsByType(_TRIANGLE, face.tag)[1], dtype=np.int64)
    if not len(corners):
        raise MeshingError(
            f"{path}: OpenCASCADE cannot triangulate face {face.tag} ({face}); expected a solid "
            "with complete faces"
        )
    order = np.argsort(numbers)
    rows = order[np.searchsorted(numbers[order], corners)]
    triangles = coordinates.reshape(-1, 3)[rows].reshape(-1, 3, 3)
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    areas = np.linalg.norm(normals, axis=1)
    largest = int(areas.argmax())
    anchor, normal = triangles[largest].mean(axis=0), normals[largest] / areas[largest]
    if face.kind == "plane":
        normal = face.direction
    elif face.kind == "cylinder":
        # The triangle is a chord: back onto the cylinder.
        along = ((anchor - face.point) @ face.direction) * face.direction
        across = anchor - face.point - along
        normal = across / np.linalg.norm(across)
        anchor = face.point + along + face.radius * normal
    probe = anchor + _PROBE_DISTANCE * normal
    if gmsh.model.isInside(3, solid, [float(x) for x in probe]):
        normal = -normal
    return OrientedFace(face, triangles, anchor, normal)
