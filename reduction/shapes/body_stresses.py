"""Stress on the surface of a reduced body, for one unit of each of its coordinates."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.fe.materials import BODY_MATERIALS, Material
from carrierflex.fe.stress_recovery import AXES, COMPONENTS, reentrant_nodes, stress_rows
from carrierflex.geometry.dihedral import rotation_about_x
from carrierflex.geometry.tet_mesh import TetMesh, boundary_facets
from carrierflex.reduction.shapes.body_shapes import UNNAMED, refuse_unknown_numbers


@dataclass(frozen=True, eq=False)
class BodyStresses:
    """Stress rows at the corner nodes of a body's surface.

    Parameters
    ----------
    points : ndarray, shape (k, 3)
        Nodes [m], in the body's frame.
    triangles : ndarray of int, shape (m, 3)
        Triangles between them, normals pointing out of the body.
    surface_names : tuple of str
        Named surfaces.
    surface_of : ndarray of int, shape (k,)
        Named surface of each node, `UNNAMED` where it has none.
    singular : ndarray of bool, shape (k,)
        Nodes on concave edges and one triangle from them, where the stress grows as the mesh is
        refined.
    S : ndarray, shape (k, 6, n_coordinates)
        Stress [Pa] in the order of `carrierflex.fe.stress_recovery.COMPONENTS`, axes of the body.

    Raises
    ------
    ValueError
        Where shapes or numbers contradict each other.
    """

    points: NDArray[np.float64]
    triangles: NDArray[np.int64]
    surface_names: tuple[str, ...]
    surface_of: NDArray[np.int64]
    singular: NDArray[np.bool_]
    S: NDArray[np.float64]

    def __post_init__(self) -> None:
        k = len(self.points)
        if self.S.shape[:2] != (k, len(COMPONENTS)):
            raise ValueError(f"S has {self.S.shape}; expected ({k}, 6, coordinates)")
        if self.surface_of.shape != (k,) or self.singular.shape != (k,):
            raise ValueError(f"expected one surface and one mark a node, {k}")
        refuse_unknown_numbers(k, self.triangles, self.surface_names, self.surface_of, "node")


def turned_stresses(stresses: BodyStresses, angle: float) -> BodyStresses:
    """Stresses of a body turned about +x by `angle` [rad], in the axes that stay: ``R σ Rᵀ``.

    A unit of each coordinate is still one along the axes that turn.
    """
    R = rotation_about_x(angle)
    turn = np.zeros((len(COMPONENTS), len(COMPONENTS)))
    for column, (k, m) in enumerate(AXES):
        unit = np.zeros((3, 3))
        unit[k, m] = unit[m, k] = 1.0
        turn[:, column] = [(R @ unit @ R.T)[i, j] for i, j in AXES]
    return replace(stresses, points=stresses.points @ R.T, S=turn @ stresses.S)


def body_stresses(
    mesh: TetMesh,
    fields: NDArray[np.float64],
    materials: Mapping[str, Material] = BODY_MATERIALS,
) -> BodyStresses:
    """Stress rows of a basis at the corner nodes of the mesh's surface.

    Parameters
    ----------
    mesh : TetMesh
        Mesh of the body.
    fields : ndarray, shape (3 n_nodes, n_coordinates)
        Displacement of all nodes for one unit of every reduced coordinate.
    materials : mapping of str to Material
        Material of every body of the mesh.
    """
    nodes, triangles = np.unique(boundary_facets(mesh.tets)[:, :3], return_inverse=True)
    triangles = triangles.reshape(-1, 3)
    surface_of = np.full(len(mesh.points), UNNAMED)
    for number, facets in enumerate(mesh.surfaces.values()):
        surface_of[facets[:, :3].ravel()] = number
    on_edge = reentrant_nodes(mesh.points[nodes], triangles)
    singular = on_edge.copy()
    singular[triangles[on_edge[triangles].any(axis=1)]] = True
    S = stress_rows(mesh, nodes, materials) @ fields
    return BodyStresses(
        points=mesh.points[nodes],
        triangles=triangles,
        surface_names=tuple(mesh.surfaces),
        surface_of=surface_of[nodes],
        singular=singular,
        S=S.reshape(len(nodes), len(COMPONENTS), -1),
    )
