"""Mid-side nodes drawn towards the re-entrant edges of a solid: strains that grow as at a corner.

At a right-angled re-entrant edge the displacement goes with r^0.545 of the distance r (Williams
1952), which no polynomial follows. A quadratic element whose mid-side nodes stand at a quarter of
the sides that leave the edge holds r^0.5 instead (Henshell and Shaw 1975; Barsoum 1976): the
elements at the edge then have the strain there, for no unknown more.

The Jacobian determinant vanishes at the edge where the nodes stand at the quarter; each is drawn
only so far that the elements about it keep the quality that is asked for.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import gmsh
import numpy as np
from numpy.typing import NDArray

_TET10 = 11
#: Corners of the sides whose mid-side nodes are gmsh's nodes 4 to 9 of a quadratic tetrahedron.
_SIDES = ((0, 1), (1, 2), (2, 0), (3, 0), (2, 3), (1, 3))
#: Place of a mid-side node over the side's length: of the quarter-point element, and of a straight
#: quadratic one.
_QUARTER, _MIDDLE = 0.25, 0.5
#: Share of its way from the middle that a node keeps where an element about it is too distorted.
_RETAINED_SHARE = 0.85
#: Such steps back before a node stands in the middle again.
_MOST_STEPS = 30


@dataclass(frozen=True, eq=False)
class _Sides:
    """Sides of elements that leave an edge.

    Parameters
    ----------
    middle : ndarray of int, shape (k,)
        gmsh's number of the mid-side node.
    near, far, between : ndarray, shape (k, 3)
        End on the edge, other end and mid-side node as meshed [m].
    lies_on : mapping of tuple to ndarray of int
        Rows of the sides that lie on a face or curve, by its dimension and number in gmsh.
    """

    middle: NDArray[np.int64]
    near: NDArray[np.float64]
    far: NDArray[np.float64]
    between: NDArray[np.float64]
    lies_on: Mapping[tuple[int, int], NDArray[np.int64]]

    def drawn(self, position: NDArray[np.float64]) -> NDArray[np.float64]:
        """Points (k, 3) at these places of the sides, parabolas through three nodes; on the solid.

        Where a side lies on a face or a curve its point does, too.
        """
        s = position[:, None]
        points = np.asarray(
            (1.0 - s) * (1.0 - 2.0 * s) * self.near
            + 4.0 * s * (1.0 - s) * self.between
            + s * (2.0 * s - 1.0) * self.far
        )
        for (dimension, tag), rows in self.lies_on.items():
            closest, _ = gmsh.model.getClosestPoint(dimension, tag, points[rows].ravel().tolist())
            points[rows] = np.reshape(closest, (-1, 3))
        return points


def draw_towards(edges: list[int], least_quality: float) -> int:
    """Move the mid-side nodes of gmsh's quadratic tetrahedra that touch these edges; their number.

    Parameters
    ----------
    edges : list of int
        gmsh's numbers of the edges.
    least_quality : float
        An element's minSJ stays above it where it was before.
    """
    if not edges:
        return 0
    tags, nodes = gmsh.model.mesh.getElementsByType(_TET10)
    tets = np.asarray(nodes, dtype=np.int64).reshape(-1, 10)
    sides = _sides_that_leave(edges, tets)
    position = np.full(len(sides.middle), _QUARTER)
    row = np.full(int(tets.max()) + 1, -1)
    row[sides.middle] = np.arange(len(sides.middle))
    drawn = row[tets[:, 4:]]
    touched = np.flatnonzero((drawn >= 0).any(axis=1))
    for _ in range(_MOST_STEPS):
        _move_nodes(sides.middle, sides.drawn(position))
        quality = np.asarray(gmsh.model.mesh.getElementQualities(tags[touched], "minSJ"))
        bad = drawn[touched[quality <= least_quality]]
        back = np.unique(bad[bad >= 0])
        if not len(back):
            break
        position[back] = _MIDDLE - _RETAINED_SHARE * (_MIDDLE - position[back])
    else:
        position[back] = _MIDDLE
        _move_nodes(sides.middle, sides.drawn(position))
    return int((position < _MIDDLE).sum())


def _sides_that_leave(edges: list[int], tets: NDArray[np.int64]) -> _Sides:
    """Sides with one end on the edges, each once."""
    all_tags, coordinates, _ = gmsh.model.mesh.getNodes()
    points = np.zeros((int(all_tags.max()) + 1, 3))
    points[all_tags] = coordinates.reshape(-1, 3)
    on_edge = np.zeros(len(points), dtype=bool)
    for edge in edges:
        on_edge[gmsh.model.mesh.getNodes(1, edge, includeBoundary=True)[0]] = True
    rows = []
    for k, (i, j) in enumerate(_SIDES):
        for near, far in ((i, j), (j, i)):
            leaves = on_edge[tets[:, near]] & ~on_edge[tets[:, far]]
            rows.append(tets[leaves][:, [4 + k, near, far]])
    middle, first = np.unique(np.concatenate(rows)[:, 0], return_index=True)
    near, far = np.concatenate(rows)[first, 1:].T
    return _Sides(middle, points[near], points[far], points[middle], _lies_on(middle))


def _lies_on(nodes: NDArray[np.int64]) -> dict[tuple[int, int], NDArray[np.int64]]:
    """Rows of these nodes by the face or curve that they lie on; those within solids left out."""
    row = {int(node): number for number, node in enumerate(nodes)}
    lies_on = {}
    for dimension in (1, 2):
        for _, tag in gmsh.model.getEntities(dimension):
            entity_nodes = gmsh.model.mesh.getNodes(dimension, tag)[0]
            rows = [row[node] for node in entity_nodes.tolist() if node in row]
            if rows:
                lies_on[dimension, tag] = np.array(rows, dtype=np.int64)
    return lies_on


def _move_nodes(nodes: NDArray[np.int64], points: NDArray[np.float64]) -> None:
    for node, point in zip(nodes.tolist(), points.tolist(), strict=True):
        gmsh.model.mesh.setNode(node, point, [])
