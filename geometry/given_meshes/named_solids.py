"""A carrier of hexahedra, wedges and what stands beside them, with named surfaces and bodies.

What :class:`carrierflex.geometry.tet_mesh.TetMesh` is for quadratic tetrahedra. Elements stay as
the file has them; linear kinds may stand beside one another, quadratic ones not, since their faces
do not match those of another kind.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from carrierflex.geometry.given_meshes.solid_files import (
    REFERENCE_NODES,
    SolidMesh,
    matching_nodes,
)
from carrierflex.geometry.tet_mesh import FACET_CORNERS, TetMesh, surface_of

IntArray = NDArray[np.int64]
#: Faces of the unit elements by their corners, seen from outside.
_TET_FACES = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2))
_HEX_FACES = (
    (0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7),
)  # fmt: skip
_WEDGE_FACES = ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5))
_FACES: Mapping[str, tuple[tuple[int, ...], ...]] = {
    "tetra": _TET_FACES,
    "tetra10": _TET_FACES,
    "hexahedron": _HEX_FACES,
    "hexahedron20": _HEX_FACES,
    "hexahedron27": _HEX_FACES,
    "wedge": _WEDGE_FACES,
}
_LINEAR = {"tetra", "hexahedron", "wedge"}


@dataclass(frozen=True, eq=False)
class NamedSolids(SolidMesh):
    """Solids of any kind with named surfaces; the groups of `blocks` are the bodies.

    Parameters
    ----------
    surfaces : mapping of str to ndarray of int, shape (k, 4, 6, 8 or 9)
        Facets of each named surface as :class:`carrierflex.geometry.tet_mesh.NamedSurfaces` has
        them, normals pointing out of the body they bound.
    """

    surfaces: Mapping[str, IntArray] = field(default_factory=dict)

    @property
    def bodies(self) -> tuple[str, ...]:
        """Names of the bodies, each once."""
        return tuple(dict.fromkeys(group for _, group, _ in self.blocks))

    def surface(self, name: str) -> IntArray:
        """Facets of the surface `name`; KeyError names the surfaces there are."""
        return surface_of(self, name)

    def boundary(self, body: str | None = None) -> IntArray:
        """Facets that belong to one element of a body only, or of the whole mesh."""
        return _boundary([(k, nodes) for k, g, nodes in self.blocks if body in (None, g)])


#: Mesh of a carrier that a user gives.
GivenMesh = TetMesh | NamedSolids


def named_solids(mesh: SolidMesh, body_of_group: Mapping[str, str], where: str) -> NamedSolids:
    """Solids of a file with groups of elements as bodies and groups of nodes as surfaces.

    A surface is made of the boundary facets whose corners are all in its group, of the first body
    that has any.

    Parameters
    ----------
    mesh : SolidMesh
        What the file holds.
    body_of_group : mapping of str to str
        Body of every group of elements.
    where : str
        The file in messages.

    Raises
    ------
    ValueError
        Where quadratic elements stand beside those of another kind.
    """
    kinds = {kind for kind, _, _ in mesh.blocks}
    if len(kinds) > 1 and not kinds <= _LINEAR:
        raise ValueError(
            f"{where}: elements of types {', '.join(sorted(kinds))} in one carrier; expected one "
            "quadratic type throughout, or linear ones: faces of others do not match"
        )
    blocks = [(kind, body_of_group[group], nodes) for kind, group, nodes in mesh.blocks]
    solids = NamedSolids(mesh.points, mesh.numbers, blocks, mesh.node_sets, mesh.left_out)
    outside = [solids.boundary(body) for body in solids.bodies]
    surfaces = {}
    for name, nodes in mesh.node_sets.items():
        candidates = (facets[_corners_in(facets, nodes)] for facets in outside)
        facets = next((candidate for candidate in candidates if len(candidate)), None)
        if facets is not None:
            surfaces[name] = facets
    return replace(solids, surfaces=surfaces)


def _corners_in(facets: IntArray, nodes: IntArray) -> NDArray[np.bool_]:
    corners = facets[:, : FACET_CORNERS[facets.shape[1]]]
    return np.asarray(np.isin(corners, nodes).all(axis=1))


def _boundary(blocks: list[tuple[str, IntArray]]) -> IntArray:
    """Facets of elements (kind, nodes) that belong to one of them only."""
    faces = np.concatenate([nodes[:, face] for kind, nodes in blocks for face in _face_nodes(kind)])
    corners = np.sort(faces[:, : FACET_CORNERS[faces.shape[1]]], axis=1)
    if faces.shape[1] == 4:
        # The corner that a triangle repeats is not the same one in both of its elements.
        repeated = (corners[:, 1:] == corners[:, :-1]).argmax(axis=1)
        triangles = np.flatnonzero(faces[:, 3] == faces[:, 0])
        corners[triangles, repeated[triangles]] = -1
        corners = np.sort(corners, axis=1)
    _, first, count = np.unique(corners, axis=0, return_index=True, return_counts=True)
    return np.asarray(faces[np.sort(first[count == 1])])


@cache
def _face_nodes(kind: str) -> list[list[int]]:
    """Local nodes of the faces: corners, mid-sides, middle; linear triangles end as they begin."""
    reference = REFERENCE_NODES[kind]
    faces = []
    for corners in _FACES[kind]:
        around = reference[list(corners)]
        wanted = [around]
        if kind not in _LINEAR:
            wanted.append((around + np.roll(around, -1, axis=0)) / 2.0)
        if kind == "hexahedron27":
            wanted.append(around.mean(axis=0)[None])
        face = matching_nodes(reference, np.concatenate(wanted)).tolist()
        faces.append([*face, face[0]] if len(face) == 3 else face)
    return faces
