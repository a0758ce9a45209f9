"""The mesh of a carrier that comes as a STEP file.

Free quadratic tetrahedra, surfaces found as stated.
"""

import logging
import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import gmsh
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from carrierflex.files.child_process import in_child
from carrierflex.geometry.cad_faces import CadFace, cad_faces
from carrierflex.geometry.cad_recognition.inner_edges import REACH
from carrierflex.geometry.cad_recognition.step_solid import READER, step_solid
from carrierflex.geometry.cad_refinement import (
    DELAUNAY,
    HXT,
    CoarseMeshError,
    EdgeGrading,
    GmshFailureError,
    mesh_until_sound,
)
from carrierflex.geometry.cad_surface_files import CadFrame, CadStatements
from carrierflex.geometry.cad_surfaces import Circle, SurfaceStatement
from carrierflex.geometry.half_sector import (
    MeshingError,
    extracted,
    refuse_useless_size,
)
from carrierflex.geometry.mesh_checks import check_mesh
from carrierflex.geometry.pins import planets_of
from carrierflex.geometry.tet_mesh import TetMesh, boundary_facets

log = logging.getLogger(__name__)

_TRIANGLE6 = 9
#: Size of the elements over the solid's mean wall, and most over that of its webs: with half of it,
#: and half the size at re-entrant edges, the curves change by less than 2 % (docs/cad.md).
_SIZE_OVER_WALL, _SIZE_OVER_WEB = 0.66, 0.48
#: Radius of a disc that reaches past every carrier [m].
_FAR = 10.0
#: Distance [m] within which a node of gmsh's and one of the mesh are the same.
_SAME_NODE = 1e-8


#: Largest angle [rad] about its axis that a hole's face leaves out.
_WIDEST_GAP = np.pi / 3.0
#: Axes closer than this [m] and parallel to this [rad] are one.
_SAME_AXIS, _PARALLEL = 1e-6, 1e-6


@dataclass(frozen=True, eq=False)
class CadPins:
    """Pins to bond into the bores.

    Parameters
    ----------
    solids : tuple
        Start (3,), vector to the end (3,) [m] and radius [m] of each pin.
    seats : tuple of SurfaceStatement
        The planet bearings' seats ``pin_i_midspan``.
    """

    solids: tuple[tuple[NDArray[np.float64], NDArray[np.float64], float], ...]
    seats: tuple[SurfaceStatement, ...]


def step_faces(path: Path, frame: CadFrame) -> tuple[CadFace, ...]:
    """Measure the faces of the solid in a STEP file, in the carrier's frame.

    Errors as in :func:`step_carrier_mesh`.
    """
    return in_child(_step_faces, path, frame, about=path, what=READER)


def _step_faces(path: Path, frame: CadFrame) -> tuple[CadFace, ...]:
    with step_solid(path, frame) as (_, faces):
        return faces


def step_volume_and_area(
    path: Path, statements: CadStatements, *, pins: bool
) -> tuple[float, float]:
    """Volume [m^3] and surface [m^2] of the solid in a STEP file, with its pins.

    Errors as in :func:`step_carrier_mesh`.
    """
    return in_child(_step_volume_and_area, path, statements, pins, about=path, what=READER)


def _step_volume_and_area(path: Path, statements: CadStatements, pins: bool) -> tuple[float, float]:
    with step_solid(path, statements.frame) as (solid, faces):
        volume, area = _volume_and_area(solid, faces)
        for _, along, radius in (_pins(statements, faces) if pins else CadPins((), ())).solids:
            length = float(np.linalg.norm(along))
            volume, area = volume + np.pi * radius**2 * length, area + 2.0 * np.pi * radius * length
    return volume, area


def step_element_size(path: Path, statements: CadStatements) -> float:
    """Element size [m] that a solid's curves are computed with where the user gives none.

    The webs of many planets are thin beside the plates, and the curves follow how they bend: of
    five planets it is they that say the size.

    Errors as in :func:`step_carrier_mesh`.
    """
    wall, web = in_child(_step_walls, path, statements, about=path, what=READER)
    return min(_SIZE_OVER_WALL * wall, _SIZE_OVER_WEB * web)


def _step_walls(path: Path, statements: CadStatements) -> tuple[float, float]:
    """Mean wall of the solid and of its webs [m]."""
    with step_solid(path, statements.frame) as (solid, faces):
        return _mean_wall(*_volume_and_area(solid, faces)), _web_wall(solid, statements, faces)


def _web_wall(solid: int, statements: CadStatements, faces: tuple[CadFace, ...]) -> float:
    """Twice the area over the outline of the section between the plates [m]; inf without webs."""
    bores = [s for s in statements.surfaces if s.name in ("pin_1_upwind", "pin_1_downwind")]
    if len(bores) < 2:
        return math.inf
    bores.sort(key=lambda bore: bore.window)
    reach = [_reach(bore, bore.touched(faces, statements.tolerance)) for bore in bores]
    axis = bores[0].direction
    middle = (reach[0][1] + reach[1][0]) / 2.0
    foot = bores[0].point + (middle - bores[0].point @ axis) * axis
    occ: Any = gmsh.model.occ
    disc = occ.addDisk(*foot, *2 * (_FAR,), zAxis=list(axis))
    sections, _ = occ.intersect([(2, disc)], [(3, solid)], removeTool=False)
    occ.synchronize()
    edges = [edge for each in sections for edge in gmsh.model.getBoundary([each], oriented=False)]
    outline = sum(occ.getMass(*edge) for edge in edges)
    return 2.0 * sum(occ.getMass(*each) for each in sections) / outline if edges else math.inf


def step_carrier_mesh(path: Path, statements: CadStatements, size: float, *, pins: bool) -> TetMesh:
    """Mesh the carrier in a STEP file.

    Parameters
    ----------
    path : Path
        STEP file with one solid, in any length unit: OpenCASCADE reads the unit that the file
        declares and converts.
    statements : CadStatements
        Surfaces to find.
    size : float
        Edge length of the elements [m].
    pins : bool
        Bond pins into the bores (the stiff variant); a second body ``pins`` and the surfaces
        ``pin_i_midspan``.

    Returns
    -------
    TetMesh
        In the carrier's frame; ``symmetry_order`` 1, whatever symmetry the carrier has.

    Raises
    ------
    FileNotFoundError, ValueError
        Where the file is no STEP file with one solid, its size is no carrier's, or a surface has no
        or several matches.
    KeyError
        Where pins are asked for and a bore is not stated.
    MeshingError, InvertedElementError
        From meshing and from the quality check.
    """
    refuse_useless_size(size)
    mesh = in_child(_step_carrier_mesh, path, statements, size, pins, about=path, what=READER)
    check_mesh(mesh, str(path))
    return mesh


def _step_carrier_mesh(path: Path, statements: CadStatements, size: float, pins: bool) -> TetMesh:
    try:
        return _quickly_meshed_solid(path, statements, size, pins)
    except GmshFailureError:
        return _meshed_solid(path, statements, size, pins, first_pass=2, algorithm=DELAUNAY)


def _quickly_meshed_solid(
    path: Path, statements: CadStatements, size: float, pins: bool
) -> TetMesh:
    """Mesh by gmsh's fast algorithm, anew where the first one of a single size fails."""
    try:
        return _meshed_solid(path, statements, size, pins, first_pass=1)
    except CoarseMeshError:
        log.info("%s: once more, sizes after the curvature from the start", path)
    return _meshed_solid(path, statements, size, pins, first_pass=2)


def _meshed_solid(
    path: Path,
    statements: CadStatements,
    size: float,
    pins: bool,
    *,
    first_pass: int,
    algorithm: int = HXT,
) -> TetMesh:
    with step_solid(path, statements.frame) as (full_solid, all_faces):
        solid, faces = _without_small_holes(path, statements, full_solid, all_faces)
        finer, wall = statements.finer_at_inner_edges, _mean_wall(*_volume_and_area(solid, faces))
        bonded = _pins(statements, faces) if pins else CadPins((), ())
        carrier_volume, overlaps = _cut(solid, _circles(statements, faces, bonded), bonded)
        if overlaps:
            raise ValueError(
                f"{path}: pins of the bores' radius overlap the carrier in {overlaps} places; "
                "expected bores that are free from the first plate to the last"
            )
        cut = cad_faces()
        wanted = statements.surfaces + bonded.seats
        chosen = {
            s.name: [face.tag for face in s.chosen(cut, statements.tolerance)] for s in wanted
        }
        mesh_until_sound(
            str(path),
            size,
            cut,
            first_pass=first_pass,
            algorithm=algorithm,
            at_inner_edges=EdgeGrading(finer, REACH * wall) if finer > 1.0 else None,
        )
        mesh = extracted(lambda volume: "carrier" if volume in carrier_volume else "pins")
        return replace(
            mesh, surfaces={name: _facets(mesh, name, tags) for name, tags in chosen.items()}
        )


def _volume_and_area(solid: int, faces: tuple[CadFace, ...]) -> tuple[float, float]:
    """Volume [m^3] and surface [m^2] of a solid of gmsh's model."""
    return float(gmsh.model.occ.getMass(3, solid)), sum(face.area for face in faces)


def _mean_wall(volume: float, area: float) -> float:
    """Twice the volume over the surface [m]: the thickness, of a plate."""
    return 2.0 * volume / area


def _without_small_holes(
    path: Path, statements: CadStatements, solid: int, faces: tuple[CadFace, ...]
) -> tuple[int, tuple[CadFace, ...]]:
    """The solid and its faces, the holes filled that the surfaces file asks to leave out."""
    if statements.leave_out_holes_below is None:
        return solid, faces
    holes, n_holes = _small_holes(solid, faces, statements.leave_out_holes_below)
    if not n_holes:
        return solid, faces
    try:
        without_holes = _without_faces(solid, holes)
    except ValueError as error:
        raise ValueError(
            f"{path}: {n_holes} holes of at most {statements.leave_out_holes_below} m cannot be "
            f"left out: {error}; expected another [mesh] leave_out_holes_below"
        ) from error
    log.info("%s: %d holes left out", path, n_holes)
    return without_holes, cad_faces()


def _pins(statements: CadStatements, faces: tuple[CadFace, ...]) -> CadPins:
    """Pins as thick as the bores found in the solid.

    From the first bore's start to the last one's end.
    """
    if statements.bearing_width is None:
        raise ValueError(
            "the surfaces file has no [pin] bearing_width; expected one for the carrier with "
            "bonded pins"
        )
    solids, seats = [], []
    n_planets = planets_of(surface.name for surface in statements.surfaces)
    for number in range(1, n_planets + 1):
        bores = [statements.named(f"pin_{number}_{side}") for side in ("upwind", "downwind")]
        bore_faces = [bore.touched(faces, statements.tolerance) for bore in bores]
        reach = [_reach(bore, touched) for bore, touched in zip(bores, bore_faces, strict=True)]
        face = bore_faces[0][0]
        if abs(bore_faces[1][0].radius - face.radius) > statements.tolerance:
            raise ValueError(
                f"the bores of pin {number} have radii of {face.radius:.6g} and "
                f"{bore_faces[1][0].radius:.6g} m; expected equal ones: a bonded pin is one "
                "cylinder as thick as both"
            )
        axis = face.direction * np.sign(face.direction @ bores[0].direction)
        foot = face.point - (face.point @ axis) * axis
        solids.append((foot + reach[0][0] * axis, (reach[1][1] - reach[0][0]) * axis, face.radius))
        middle, half = (reach[0][1] + reach[1][0]) / 2.0, statements.bearing_width / 2.0
        if not 2.0 * half < reach[1][0] - reach[0][1]:
            raise ValueError(
                f"[pin] bearing_width is {2.0 * half} m; expected less than the "
                f"{reach[1][0] - reach[0][1]:.4g} m between the bores of pin {number}"
            )
        seats.append(
            SurfaceStatement(
                f"pin_{number}_midspan",
                "cylinder",
                foot,
                axis,
                face.radius,
                (middle - half, middle + half),
            )
        )
    return CadPins(tuple(solids), tuple(seats))


def _reach(bore: SurfaceStatement, faces: list[CadFace]) -> tuple[float, float]:
    """Least and greatest station of the bore, within its window."""
    extents = np.array([bore.extent(face) for face in faces])
    return max(bore.window[0], float(extents[:, 0].min())), min(
        bore.window[1], float(extents[:, 1].max())
    )


def _circles(statements: CadStatements, faces: tuple[CadFace, ...], pins: CadPins) -> list[Circle]:
    circles = []
    for surface in statements.surfaces:
        circles += surface.circles(
            surface.touched(faces, statements.tolerance), statements.tolerance
        )
    for seat in pins.seats:
        foot = seat.point - (seat.point @ seat.direction) * seat.direction
        circles += [(foot + end * seat.direction, seat.direction, seat.size) for end in seat.window]
    return circles


def _cut(solid: int, circles: list[Circle], pins: CadPins) -> tuple[set[int], int]:
    """Cut faces along circles, and carrier and pins along the faces they share.

    The carrier's volumes, and overlaps.
    """
    occ: Any = gmsh.model.occ
    cylinders = [
        (3, occ.addCylinder(*start, *along, radius)) for start, along, radius in pins.solids
    ]
    rings = [
        (1, occ.addCircle(*centre, radius, zAxis=list(axis))) for centre, axis, radius in circles
    ]
    carrier, n_overlaps = {solid}, 0
    if cylinders or rings:
        _, pieces = occ.fragment([(3, solid), *cylinders], rings)
        carrier = {tag for dimension, tag in pieces[0] if dimension == 3}
        n_overlaps = sum(
            bool(carrier & {tag for _, tag in piece}) for piece in pieces[1 : 1 + len(cylinders)]
        )
    occ.synchronize()
    return carrier, n_overlaps


def _facets(mesh: TetMesh, name: str, tags: list[int]) -> NDArray[np.int64]:
    """Facets of the mesh on gmsh's faces `tags`.

    Seen from outside the body that the surface belongs to.
    """
    row_of, rows = cKDTree(mesh.points), []
    for tag in tags:
        numbers, coordinates, _ = gmsh.model.mesh.getNodes(2, tag, includeBoundary=True)
        distance, nearest = row_of.query(coordinates.reshape(-1, 3))
        if distance.max() > _SAME_NODE:
            raise MeshingError(
                f"surface {name!r}: a node of face {tag} is not in the mesh; expected a face of "
                "the solid"
            )
        row = dict(zip(numbers.tolist(), nearest.tolist(), strict=True))
        corners = np.array(gmsh.model.mesh.getElementsByType(_TRIANGLE6, tag)[1]).reshape(-1, 6)[
            :, :3
        ]
        rows.append(np.vectorize(row.__getitem__)(corners))
    wanted = np.sort(np.concatenate(rows), axis=1)
    outside = boundary_facets(
        mesh.tets[mesh.bodies["pins" if name.endswith("_midspan") else "carrier"]]
    )
    sorted_outside = np.sort(outside[:, :3], axis=1)
    key = np.array([len(mesh.points) ** 2, len(mesh.points), 1], dtype=np.int64)
    return outside[np.isin(sorted_outside @ key, wanted @ key)]


def _small_holes(
    solid: int, faces: tuple[CadFace, ...], diameter: float
) -> tuple[tuple[CadFace, ...], int]:
    """Faces of the round holes that are no wider than `diameter` [m], and the number of holes."""
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


def _without_faces(solid: int, faces: tuple[CadFace, ...]) -> int:
    """Solid without these faces: their neighbours are continued; its number in gmsh."""
    try:
        solids = gmsh.model.occ.defeature([solid], [face.tag for face in faces])
        gmsh.model.occ.synchronize()
    except Exception as error:
        raise ValueError(f"OpenCASCADE cannot fill {len(faces)} faces ({error})") from error
    remaining = [tag for dimension, tag in solids if dimension == 3]
    if len(remaining) != 1:
        raise ValueError(f"filling {len(faces)} faces leaves {len(remaining)} solids; expected one")
    return int(remaining[0])


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
