"""Small holes of a CAD solid, found and filled: bolt holes and oil bores that statics need not."""

import gmsh
import numpy as np
from numpy.typing import NDArray

from carrierflex.geometry.cad_faces import CadFace

#: Largest angle [rad] about its axis that a hole's face leaves out.
_WIDEST_GAP = np.pi / 3.0
#: Axes closer than this [m] and parallel to this [rad] are one.
_SAME_AXIS, _PARALLEL = 1e-6, 1e-6


def small_holes(
    solid: int, faces: tuple[CadFace, ...], diameter: float
) -> tuple[tuple[CadFace, ...], int]:
    """Faces of the round holes that are no wider than `diameter` [m], and the number of holes.

    A hole is a cylinder all around an axis that is not in the solid's material; the bottom of a
    blind one goes with it.

    Parameters
    ----------
    solid : int
        gmsh's number of the solid.
    faces : tuple of CadFace
        All its faces.
    diameter : float
        Largest diameter of a hole that counts as small [m].
    """
    chosen: list[CadFace] = []
    n_holes = 0
    for group in _coaxial([f for f in faces if f.kind == "cylinder" and 2 * f.radius <= diameter]):
        if _goes_round(group) and not _is_material(solid, group):
            chosen += group
            n_holes += 1
    edges = {edge for face in chosen for edge in face.edges}
    widest = np.pi * diameter**2
    bottoms = [
        face for face in faces if face not in chosen and face.edges <= edges and face.area < widest
    ]
    return (*chosen, *bottoms), n_holes


def without_faces(solid: int, faces: tuple[CadFace, ...]) -> int:
    """Solid without these faces: their neighbours are continued; its number in gmsh.

    Raises
    ------
    ValueError
        Where OpenCASCADE cannot close the solid without them.
    """
    try:
        solids = gmsh.model.occ.defeature([solid], [face.tag for face in faces])
        gmsh.model.occ.synchronize()
    except Exception as error:
        raise ValueError(f"OpenCASCADE cannot fill {len(faces)} faces ({error})") from error
    left = [tag for dimension, tag in solids if dimension == 3]
    if len(left) != 1:
        raise ValueError(f"filling {len(faces)} faces leaves {len(left)} solids; expected one")
    return int(left[0])


def _coaxial(faces: list[CadFace]) -> list[list[CadFace]]:
    """Faces of one axis and one radius together."""
    groups: list[list[CadFace]] = []
    for face in faces:
        for group in groups:
            first = group[0]
            parallel = np.linalg.norm(np.cross(first.direction, face.direction)) < _PARALLEL
            offset = np.cross(face.point - first.point, first.direction)
            same_radius = abs(face.radius - first.radius) < _SAME_AXIS
            meets = any(face.edges & other.edges for other in group)
            if parallel and same_radius and meets and np.linalg.norm(offset) < _SAME_AXIS:
                group.append(face)
                break
        else:
            groups.append([face])
    return groups


def _goes_round(group: list[CadFace]) -> bool:
    """Whether the outlines of the faces have points on all sides of their axis."""
    axis = group[0].direction
    across = np.concatenate([face.outline for face in group]) - group[0].point
    first = _perpendicular(axis)
    angle = np.sort(np.arctan2(across @ np.cross(axis, first), across @ first))
    gaps = np.diff(np.append(angle, angle[0] + 2.0 * np.pi))
    return bool(gaps.max() < _WIDEST_GAP)


def _is_material(solid: int, group: list[CadFace]) -> bool:
    """Whether the axis, half-way along the faces, is inside the solid."""
    face = group[0]
    along = np.concatenate([f.outline for f in group]) @ face.direction
    foot = face.point - (face.point @ face.direction) * face.direction
    middle = foot + 0.5 * (along.min() + along.max()) * face.direction
    return bool(gmsh.model.isInside(3, solid, [float(x) for x in middle]))


def _perpendicular(axis: NDArray[np.float64]) -> NDArray[np.float64]:
    other = np.eye(3)[np.abs(axis).argmin()]
    across = np.cross(axis, other)
    return np.asarray(across / np.linalg.norm(across))
