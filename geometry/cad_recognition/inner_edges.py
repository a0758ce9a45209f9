"""Re-entrant edges of a CAD solid, and elements that become smaller towards them.

Where webs and hub meet the plates without a fillet the stress is singular: the error of a mesh of
one size falls with little more than its first power (Szabo and Babuska 1991, section 10.1), all of
it from the elements at these edges. Sizes that go with a power of the distance restore the rate of
the elements (ibid., graded meshes).
"""

from itertools import combinations

import gmsh
import numpy as np
from numpy.typing import NDArray

#: Sine of the angle between two faces' normals below which they meet smoothly.
_SMOOTH = 0.2
#: Place along an edge, in its parameter, where its angle is measured: no place of symmetry.
_EDGE_PARAMETER = 0.37
#: Distance from the edge [m] at which it is asked whether there is material: below any fillet.
_PROBE_DISTANCE = 2e-4
#: Points of an edge that distances are measured from.
_SAMPLES = 400
#: Mean walls (twice the volume over the surface) over which elements grow to their full size.
REACH = 2.5
#: Power of the distance that the size grows with there. For elements whose mid-side nodes are drawn
#: towards the edge; 0.3, 0.5, 0.7 and 1 were tried at equal unknowns (docs/cad.md).
_POWER = 0.5


def reentrant_edges() -> list[int]:
    """Gmsh's numbers of the edges about which the solids of its model fill more than half."""
    volumes = [tag for _, tag in gmsh.model.getEntities(3)]
    return [tag for _, tag in gmsh.model.getEntities(1) if _is_reentrant(tag, volumes)]


def _is_reentrant(edge: int, volumes: list[int]) -> bool:
    faces = gmsh.model.getAdjacencies(1, edge)[0]
    low, high = gmsh.model.getParametrizationBounds(1, edge)
    at = low[0] + _EDGE_PARAMETER * (high[0] - low[0])
    point = np.array(gmsh.model.getValue(1, edge, [at]))
    normals = [_normal(int(face), point) for face in faces]
    for first, second in combinations(normals, 2):
        if np.linalg.norm(np.cross(first, second)) > _SMOOTH:
            # The four quadrants between the faces: one is filled at an outer edge, three at an
            # inner one.
            quadrants = [a * first + b * second for a in (-1.0, 1.0) for b in (-1.0, 1.0)]
            filled = sum(_is_material(point + _PROBE_DISTANCE * q, volumes) for q in quadrants)
            return filled == 3
    return False


def _normal(face: int, point: NDArray[np.float64]) -> NDArray[np.float64]:
    parameters = gmsh.model.getParametrization(2, face, point.tolist())
    return np.array(gmsh.model.getNormal(face, parameters))


def _is_material(point: NDArray[np.float64], volumes: list[int]) -> bool:
    at = [float(x) for x in point]
    return any(gmsh.model.isInside(3, volume, at) for volume in volumes)


def grade_towards(edges: list[int], size: float, least: float, reach: float) -> None:
    """Let gmsh's next meshes grow from `least` at these edges to `size` at `reach` and beyond [m].

    Between them the size goes with the root of the distance. Sizes that other rules ask for stay
    where they are smaller.
    """
    if not edges:
        return
    field = gmsh.model.mesh.field
    distance, graded = field.add("Distance"), field.add("MathEval")
    field.setNumbers(distance, "CurvesList", edges)
    field.setNumber(distance, "Sampling", _SAMPLES)
    grown = f"{size!r} * (F{distance} / {reach!r})^{_POWER}"
    field.setString(graded, "F", f"Min({size!r}, Max({least!r}, {grown}))")
    field.setAsBackgroundMesh(graded)
    gmsh.option.setNumber("Mesh.MeshSizeMin", least)
    # Sizes of the faces' elements are not carried on into the volume: the field says what they are.
    gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)
