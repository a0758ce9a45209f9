"""The mesh that crosses from geometry to finite elements.

Quadratic tetrahedra with named surfaces and bodies.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

#: Corner pairs whose edges carry nodes 4..9 of a quadratic tetrahedron (VTK, Abaqus C3D10 and
#: scikit-fem order).
TET_EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))
#: Local nodes of the four faces: three corners seen from outside, then their mid-side nodes.
TET_FACES = np.array(
    [[0, 2, 1, 6, 5, 4], [0, 1, 3, 4, 8, 7], [1, 2, 3, 5, 9, 8], [0, 3, 2, 7, 9, 6]]
)


class NamedSurfaces(Protocol):
    """Nodes and named surfaces of a mesh of any elements: what couplings and sensors need of it.

    Facets of a surface have 6 nodes (quadratic triangles), or 4, 8 or 9 (quadrilaterals), corners
    first; a triangle of straight edges has 4, its last corner being its first.
    """

    @property
    def points(self) -> NDArray[np.float64]:
        """Node coordinates [m], shape (n, 3)."""

    @property
    def surfaces(self) -> Mapping[str, NDArray[np.int64]]:
        """Facets of each named surface, shape (k, 4, 6, 8 or 9)."""

    def surface(self, name: str) -> NDArray[np.int64]:
        """Facets of the surface `name`; KeyError names the surfaces there are."""


#: Corners of a facet by the number of its nodes.
FACET_CORNERS = {3: 3, 4: 4, 6: 3, 8: 4, 9: 4}


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
        return surface_of(self, name)


def surface_of(mesh: NamedSurfaces, name: str) -> NDArray[np.int64]:
    """Facets of the surface `name`; KeyError names the surfaces there are."""
    if name not in mesh.surfaces:
        raise KeyError(
            f"the mesh has no surface {name!r}; it has {', '.join(sorted(mesh.surfaces)) or 'none'}"
        )
    return mesh.surfaces[name]


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
    facets : ndarray of int, shape (k, 3, 4, 6, 8 or 9)
        Triangles or quadrilaterals, corners first.
    surfaces : mapping of str to ndarray of int, shape (m, 3, 4, 6, 8 or 9)
        Named surfaces; the last one counts where several hold a facet.
    """
    number_of = {
        corners: number
        for number, surface in enumerate(surfaces.values())
        for corners in _corner_sets(surface)
    }
    return np.array(
        [number_of.get(facet_corners, -1) for facet_corners in _corner_sets(facets)], dtype=np.int64
    )


def _corner_sets(facets: NDArray[np.int64]) -> list[frozenset[int]]:
    return [frozenset(corners) for corners in facets[:, : FACET_CORNERS[facets.shape[1]]].tolist()]


def corner_triangles(
    facets: NDArray[np.int64],
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Triangles of the facets' corners, shape (k, 3), and the facet that each is of, shape (k,).

    Quadrilaterals are cut along their first diagonal; those whose last corner is their first are
    one triangle.
    """
    every = np.arange(len(facets))
    if FACET_CORNERS[facets.shape[1]] == 3:
        return facets[:, :3], every
    second = np.flatnonzero(facets[:, 3] != facets[:, 0])
    triangles = np.concatenate([facets[:, :3], facets[second][:, [0, 2, 3]]])
    return triangles, np.concatenate([every, second])
