"""Surface mesh of a body and the displacement of every reduced coordinate on it.

A reduced body knows its pilots and sensors alone; with these it can be drawn.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.geometry.given_meshes.named_solids import GivenMesh
from carrierflex.geometry.tet_mesh import (
    TetMesh,
    boundary_facets,
    corner_triangles,
    surface_of_facets,
)

#: Surface of a triangle that no named surface holds.
UNNAMED = -1


@dataclass(frozen=True, eq=False)
class BodyShapes:
    """Corner triangles of a body's boundary and the displacement fields on their nodes.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Corner nodes on the boundary [m].
    triangles : ndarray of int, shape (k, 3)
        Boundary triangles, normals pointing out of the body.
    surface_names : tuple of str
        Named surfaces.
    surface_of : ndarray of int, shape (k,)
        Named surface of each triangle, `UNNAMED` where it has none.
    T : ndarray, shape (n, 3, n_coordinates)
        Displacement [m] of the nodes for one unit of each reduced coordinate.

    Raises
    ------
    ValueError
        Where shapes or numbers contradict each other.
    """

    points: NDArray[np.float64]
    triangles: NDArray[np.int64]
    surface_names: tuple[str, ...]
    surface_of: NDArray[np.int64]
    T: NDArray[np.float64]

    def __post_init__(self) -> None:
        n, k = len(self.points), len(self.triangles)
        if self.T.shape[:2] != (n, 3):
            raise ValueError(f"shapes have {self.T.shape}; expected ({n}, 3, coordinates)")
        if self.surface_of.shape != (k,):
            raise ValueError(f"{self.surface_of.size} triangles have a surface; expected {k}")
        refuse_unknown_numbers(n, self.triangles, self.surface_names, self.surface_of, "triangle")

    def displacement(self, q: NDArray[np.float64]) -> NDArray[np.float64]:
        """Displacement of the nodes [m], shape (n, 3): ``u = T q``."""
        return self.T @ q


def refuse_unknown_numbers(
    n_points: int,
    triangles: NDArray[np.int64],
    surface_names: tuple[str, ...],
    surface_of: NDArray[np.int64],
    member: str,
) -> None:
    """Raise ValueError where a triangle or its surface is none of a body's boundary.

    `member` says what has a surface: triangle or node.
    """
    if triangles.size and not (0 <= triangles.min() and triangles.max() < n_points):
        raise ValueError(f"a triangle refers to point {triangles.max()}; expected below {n_points}")
    if surface_of.size and not (
        surface_of.min() >= UNNAMED and surface_of.max() < len(surface_names)
    ):
        raise ValueError(
            f"a {member} is of surface {surface_of.max()}; expected below {len(surface_names)}"
        )


def body_shapes(mesh: GivenMesh, fields: NDArray[np.float64]) -> BodyShapes:
    """Boundary of a mesh and a basis on it.

    The quadratic elements' corner nodes are kept, their mid-side nodes are not: a fourth of the
    size, and facets as flat as a picture needs. Quadrilaterals are drawn as two triangles.

    Parameters
    ----------
    mesh : TetMesh or NamedSolids
        Mesh of the body.
    fields : ndarray, shape (3 n_nodes, n_coordinates)
        Displacement of all nodes for one unit of every reduced coordinate.
    """
    facets = boundary_facets(mesh.tets) if isinstance(mesh, TetMesh) else mesh.boundary()
    corners, facet_of = corner_triangles(facets)
    nodes, triangles = np.unique(corners, return_inverse=True)
    triangles = triangles.reshape(corners.shape)
    rows = (3 * nodes[:, None] + np.arange(3)).ravel()
    return BodyShapes(
        points=mesh.points[nodes],
        triangles=triangles,
        surface_names=tuple(mesh.surfaces),
        surface_of=surface_of_facets(facets, mesh.surfaces)[facet_of],
        T=fields[rows].reshape(len(nodes), 3, -1),
    )
