"""The mesh that crosses from geometry to finite elements.

Quadratic tetrahedra with named surfaces and bodies.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

#: Corner pairs whose edges carry nodes 4..9 of a quadratic tetrahedron (VTK, Abaqus C3D10 and
#: scikit-fem order).
TET_EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))
#: Local nodes of the four faces: three corners seen from outside, then their mid-side nodes.
TET_FACES = np.array(
    [[0, 2, 1, 6, 5, 4], [0, 1, 3, 4, 8, 7], [1, 2, 3, 5, 9, 8], [0, 3, 2, 7, 9, 6]]
)


@dataclass(frozen=True, eq=False)
class TetMesh:
    """Quadratic tetrahedra with named surfaces and bodies.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Node coordinates [m], corner and mid-side nodes alike.
    tets : ndarray of int, shape (m, 10)
        Node numbers of each element: four corners, then the mid-side nodes in the order of
        `TET_EDGES`.
    surfaces : mapping of str to ndarray of int, shape (k, 6)
        Quadratic triangles of each named surface, normals pointing out of the body they bound.
    bodies : mapping of str to ndarray of int
        Element numbers of each body.
    symmetry_order : int
        N for a mesh with the dihedral symmetry D_N of a carrier of N pins, 1 for one without
        rotational symmetry.

    Raises
    ------
    ValueError
        Where an index points outside the nodes or a coordinate is not finite.
    """

    points: NDArray[np.float64]
    tets: NDArray[np.int64]
    surfaces: Mapping[str, NDArray[np.int64]]
    bodies: Mapping[str, NDArray[np.int64]]
    symmetry_order: int = 1

    def __post_init__(self) -> None:
        if self.points.ndim != 2 or self.points.shape[1] != 3 or not np.isfinite(self.points).all():
            raise ValueError(
                f"mesh points have shape {self.points.shape}; expected (n, 3), every coordinate "
                "finite"
            )
        if self.tets.ndim != 2 or self.tets.shape[1] != 10:
            raise ValueError(
                f"tetrahedra have shape {self.tets.shape}; expected (m, 10): quadratic elements"
            )
        for name, nodes in {"tetrahedra": self.tets, **self.surfaces}.items():
            if nodes.size and not (0 <= nodes.min() and nodes.max() < len(self.points)):
                raise ValueError(
                    f"{name} refer to node {nodes.max()}; expected numbers below {len(self.points)}"
                )

    def surface(self, name: str) -> NDArray[np.int64]:
        """Quadratic triangles of the surface `name`, shape (k, 6).

        KeyError names the surfaces there are.
        """
        if name not in self.surfaces:
            raise KeyError(
                f"the mesh has no surface {name!r}; it has {', '.join(sorted(self.surfaces))}"
            )
        return self.surfaces[name]


def boundary_facets(tets: NDArray[np.int64]) -> NDArray[np.int64]:
    """Faces that belong to one of `tets` only, shape (k, 6).

    Normals point out of the element.
    """
    faces = tets[:, TET_FACES].reshape(-1, 6)
    _, first, count = np.unique(
        np.sort(faces[:, :3], axis=1), axis=0, return_index=True, return_counts=True
    )
    return faces[first[count == 1]]


def surface_of_facets(
    facets: NDArray[np.int64], surfaces: Mapping[str, NDArray[np.int64]]
) -> NDArray[np.int64]:
    """Number of the named surface that holds each facet, shape (k,); -1 where none does.

    Parameters
    ----------
    facets : ndarray of int, shape (k, 6) or (k, 3)
        Triangles, corners first.
    surfaces : mapping of str to ndarray of int, shape (m, 6)
        Named surfaces; the last one counts where several hold a facet.
    """
    number_of = {
        tuple(corners): number
        for number, surface in enumerate(surfaces.values())
        for corners in np.sort(surface[:, :3], axis=1).tolist()
    }
    corners = np.sort(facets[:, :3], axis=1).tolist()
    return np.array([number_of.get(tuple(own), -1) for own in corners], dtype=np.int64)
