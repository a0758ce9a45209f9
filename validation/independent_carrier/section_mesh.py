"""Cross-section of the carrier's half sector, meshed by gmsh with the outlines of every layer.

The carrier is a stack of extrusions. Their outlines are circles; one plane mesh that follows all of
them serves every layer. Coordinates (a, b) point from the axis to pin 1 and towards increasing
angle: z = a, y = -b.
"""

import math
from dataclasses import dataclass

import gmsh
import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Dimensions = dict[str, float]

#: Dimensions [m] of the default carrier, as its drawing states them.
DRAWN: Dimensions = {
    "outer_radius": 0.435,
    "upwind_plate_thickness": 0.065,
    "downwind_plate_thickness": 0.045,
    "plate_gap": 0.240,
    "centre_distance": 0.308,
    "pin_hole_diameter": 0.160,
    "web_inner_radius": 0.235,
    "planet_clearance_radius": 0.219,
    "hub_outer_diameter": 0.460,
    "hub_inner_diameter": 0.320,
    "hub_length": 0.120,
    "seat_outer_diameter": 0.400,
    "seat_inner_diameter": 0.280,
    "seat_length": 0.060,
    "sensor_radius": 0.412,
    "bearing_width": 0.160,
}
N_PLANETS = 3
HALF_SECTOR = math.pi / N_PLANETS
#: Layers of the stack, and what fills the bores in three of them.
LAYERS = ("hub", "plate_a", "webs", "plate_b", "seat")
PIN = "pin"
#: Distance [m] at which a point lies on a circle.
_ON = 1e-7


@dataclass(frozen=True, eq=False)
class Section:
    """Plane mesh of six-node triangles.

    Parameters
    ----------
    points : ndarray, shape (n, 2)
        Nodes (a, b) [m], corners and mid-sides.
    triangles : ndarray of int, shape (m, 6)
        Corners against the clock, then the mid-sides of edges 01, 12, 20.
    regions : dict of str to ndarray of bool, shape (m,)
        Triangles of each layer without pins, and of the pin.
    """

    points: FloatArray
    triangles: IntArray
    regions: dict[str, NDArray[np.bool_]]


def section_mesh(d: Dimensions, size: float) -> Section:
    """Mesh the half sector from a pin's plane to a web's.

    Parameters
    ----------
    d : dict
        Dimensions [m].
    size : float
        Edge length [m] away from the re-entrant outlines; half of it along them.
    """
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("General.NumThreads", 1)
        pieces = _fragments(d)
        _size_field(d, pieces, size)
        gmsh.model.mesh.generate(2)
        gmsh.model.mesh.setOrder(2)
        return _read(pieces)
    finally:
        gmsh.finalize()


def _fragments(d: Dimensions) -> dict[str, set[int]]:
    """Faces of the section cut by every outline: by layer and the pin, numbers of its faces."""
    occ = gmsh.model.occ
    sector = occ.addPoint(0.0, 0.0, 0.0)
    reach = d["outer_radius"]
    first = occ.addPoint(reach, 0.0, 0.0)
    last = occ.addPoint(reach * math.cos(HALF_SECTOR), reach * math.sin(HALF_SECTOR), 0.0)
    wire = occ.addCurveLoop(
        [
            occ.addLine(sector, first),
            occ.addCircleArc(first, sector, last),
            occ.addLine(last, sector),
        ]
    )
    outside = (2, occ.addPlaneSurface([wire]))
    a = d["centre_distance"]
    discs = {
        "hub_outer": (0.0, d["hub_outer_diameter"] / 2.0),
        "hub_inner": (0.0, d["hub_inner_diameter"] / 2.0),
        "seat_outer": (0.0, d["seat_outer_diameter"] / 2.0),
        "seat_inner": (0.0, d["seat_inner_diameter"] / 2.0),
        "web_inner": (0.0, d["web_inner_radius"]),
        "sensor": (0.0, d["sensor_radius"]),
        "hole": (a, d["pin_hole_diameter"] / 2.0),
        "pocket": (a, d["planet_clearance_radius"]),
    }
    tags = {name: (2, occ.addDisk(x, 0.0, 0.0, r, r)) for name, (x, r) in discs.items()}
    _, results = occ.fragment([outside], list(tags.values()))
    occ.synchronize()
    within = {
        name: {tag for _, tag in result}
        for name, result in zip(("sector", *tags), results, strict=True)
    }
    sector_faces = within.pop("sector")
    occ.remove([(2, tag) for tag in set().union(*within.values()) - sector_faces], recursive=True)
    occ.synchronize()
    w = {name: faces & sector_faces for name, faces in within.items()}
    return {
        "hub": w["hub_outer"] - w["hub_inner"] - w["hole"],
        "plate_a": sector_faces - w["hub_inner"] - w["hole"],
        "webs": sector_faces - w["web_inner"] - w["pocket"],
        "plate_b": sector_faces - w["seat_inner"] - w["hole"],
        "seat": w["seat_outer"] - w["seat_inner"] - w["hole"],
        PIN: w["hole"],
    }


def _size_field(d: Dimensions, pieces: dict[str, set[int]], size: float) -> None:
    """Half the size along the outlines of webs, hub, seat and pin, where edges re-enter."""
    a = d["centre_distance"]
    circles = (
        ("hub", 0.0, d["hub_outer_diameter"] / 2.0),
        ("seat", 0.0, d["seat_outer_diameter"] / 2.0),
        ("webs", 0.0, d["web_inner_radius"]),
        ("webs", a, d["planet_clearance_radius"]),
        (PIN, a, d["pin_hole_diameter"] / 2.0),
    )
    curves = {tag for name, x, radius in circles for tag in _arcs_on(pieces[name], x, radius)}
    field = gmsh.model.mesh.field
    at_hub = a - d["pin_hole_diameter"] / 2.0
    box = (at_hub - _ON, -_ON, -_ON, at_hub + _ON, _ON, _ON)
    points = [tag for _, tag in gmsh.model.getEntitiesInBoundingBox(*box, 0)]
    fields = []
    # Between pin hole and hub some millimetres are left, or none.
    for what, entities, smallest, reach in (
        ("CurvesList", sorted(curves), size / 2.0, size / 4.0),
        ("PointsList", points, size / 8.0, 0.015),
    ):
        distance, threshold = field.add("Distance"), field.add("Threshold")
        field.setNumbers(distance, what, entities)
        field.setNumber(distance, "Sampling", 200)
        field.setNumber(threshold, "InField", distance)
        field.setNumber(threshold, "SizeMin", smallest)
        field.setNumber(threshold, "SizeMax", size)
        field.setNumber(threshold, "DistMin", reach)
        field.setNumber(threshold, "DistMax", 2.0 * size)
        fields.append(threshold)
    finest = field.add("Min")
    field.setNumbers(finest, "FieldsList", fields)
    field.setAsBackgroundMesh(finest)
    for option in ("MeshSizeExtendFromBoundary", "MeshSizeFromPoints", "MeshSizeFromCurvature"):
        gmsh.option.setNumber(f"Mesh.{option}", 0)


def _arcs_on(faces: set[int], x: float, radius: float) -> list[int]:
    """Curves around the faces that lie on the circle of the radius about (x, 0)."""
    arcs = []
    for _, tag in gmsh.model.getBoundary([(2, face) for face in faces], oriented=False):
        low, high = gmsh.model.getParametrizationBounds(1, tag)
        middle = gmsh.model.getValue(1, tag, [(low[0] + high[0]) / 2.0])
        if abs(math.hypot(middle[0] - x, middle[1]) - radius) < _ON:
            arcs.append(tag)
    return arcs


def _read(pieces: dict[str, set[int]]) -> Section:
    used = set().union(*pieces.values())
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    index_of = {tag: k for k, tag in enumerate(tags.tolist())}
    triangles, faces = [], []
    for face in sorted(used):
        _, _, nodes = gmsh.model.mesh.getElements(2, face)
        elements = np.array([index_of[tag] for tag in nodes[0].tolist()]).reshape(-1, 6)
        triangles.append(elements)
        faces.append(np.full(len(elements), face))
    points = coordinates.reshape(-1, 3)[:, :2]
    every, face_of = np.concatenate(triangles), np.concatenate(faces)
    first, second, third = (points[every[:, k]] for k in range(3))
    (u, v), (s, t) = (second - first).T, (third - first).T
    turned = u * t - v * s < 0.0
    every[turned] = every[turned][:, [0, 2, 1, 5, 4, 3]]
    numbers, compact = np.unique(every, return_inverse=True)
    return Section(
        points[numbers],
        compact.reshape(every.shape),
        {name: np.isin(face_of, sorted(faces_of)) for name, faces_of in pieces.items()},
    )
