"""Stress at corner nodes of quadratic tetrahedra as linear rows of the displacement.

With the physical gradients ``g_i`` of the shape functions at a corner of an element,

    σ = λ tr(ε) I + 2 μ ε,   ε = Σ_i (u_i g_iᵀ + g_i u_iᵀ) / 2,

averaged over the elements that meet there, by volume. A field of linear stress is exact. At
re-entrant edges elasticity has no finite stress: what is found there grows as the mesh is refined.
"""

from collections.abc import Mapping

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from carrierflex.fe.materials import Material, material_of
from carrierflex.geometry.tet_mesh import TET_EDGES, TetMesh

#: Order of the components of a stress.
COMPONENTS = ("xx", "yy", "zz", "yz", "xz", "xy")
#: Axes of each component.
AXES = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))
#: Turn of the surface's normal across a concave edge [rad] above which the edge is re-entrant:
#: twice the 15 degrees between neighbours around a bore of 24 facets.
_REENTRANT = np.deg2rad(30.0)


def stress_rows(
    mesh: TetMesh, nodes: NDArray[np.int64], materials: Mapping[str, Material]
) -> sp.csr_array:
    """Rows that give the stress at corner nodes of a mesh.

    Parameters
    ----------
    mesh : TetMesh
        Mesh of n nodes.
    nodes : ndarray of int, shape (k,)
        Corner nodes.
    materials : mapping of str to Material
        Material of every body of the mesh.

    Returns
    -------
    csr_array, shape (6 k, 3 n)
        Stress [Pa] from nodal displacement [m]; six rows a node in the order of `COMPONENTS`.

    Raises
    ------
    ValueError
        Where a node is no corner of an element, or a body has no material.
    """
    number = np.full(len(mesh.points), -1)
    number[nodes] = np.arange(len(nodes))
    lame = np.zeros((len(mesh.tets), 2))
    for body, elements in mesh.bodies.items():
        lame[elements] = material_of(materials, body).lame
    element, corner = np.nonzero(number[mesh.tets[:, :4]] >= 0)
    row = number[mesh.tets[element, corner]]
    gradients, volume = _gradients_at_corners(mesh, element, corner)
    total = np.bincount(row, weights=volume, minlength=len(nodes))
    if not total.all():
        lost = int(nodes[int(np.flatnonzero(total == 0.0)[0])])
        raise ValueError(f"node {lost} is no corner of an element; expected corner nodes")
    share = volume / total[row]
    values = share[:, None, None, None] * _stress_of_gradients(gradients, lame[element])
    columns = 3 * mesh.tets[element][:, None, :, None] + np.arange(3)
    rows = 6 * row[:, None, None, None] + np.arange(6)[:, None, None]
    shape = values.shape
    return sp.csr_array(
        (
            values.ravel(),
            (np.broadcast_to(rows, shape).ravel(), np.broadcast_to(columns, shape).ravel()),
        ),
        shape=(6 * len(nodes), 3 * len(mesh.points)),
    )


def reentrant_nodes(points: NDArray[np.float64], triangles: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Nodes on concave edges of a closed surface, where the stress is singular.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Nodes [m].
    triangles : ndarray of int, shape (k, 3)
        Corners, normals pointing out of the body.

    Returns
    -------
    ndarray of bool, shape (n,)
        True where two triangles meet under a concave angle of more than 30 degrees.
    """
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    centre = (a + b + c) / 3.0
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    owner = np.repeat(np.arange(len(triangles)), 3)
    order = np.lexsort(edges.T)
    edges, owner = edges[order], owner[order]
    pair = np.flatnonzero((edges[1:] == edges[:-1]).all(axis=1))
    first, second = owner[pair], owner[pair + 1]
    turn = np.arccos(np.clip(np.einsum("ij,ij->i", normal[first], normal[second]), -1.0, 1.0))
    opens = np.einsum("ij,ij->i", normal[first], centre[second] - centre[first]) > 0.0
    result = np.zeros(len(points), dtype=bool)
    result[edges[pair[(turn > _REENTRANT) & opens]].ravel()] = True
    return result


def _gradients_at_corners(
    mesh: TetMesh, element: NDArray[np.int64], corner: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Physical gradients (p, 10, 3) of the shape functions at corners, and volumes there."""
    reference = np.array([_reference_gradients(c) for c in range(4)])[corner]
    x = mesh.points[mesh.tets[element]]
    J = np.einsum("pia,pib->pab", x, reference)  # dx_a / dxi_b
    gradients = np.einsum("pib,pba->pia", reference, np.linalg.inv(J))
    return gradients, np.abs(np.linalg.det(J))


def _reference_gradients(corner: int) -> NDArray[np.float64]:
    """``dN_i / dξ`` at a corner: ``N_i = L_i (2 L_i - 1)``, ``N_ij = 4 L_i L_j``."""
    L = np.eye(4)[corner]
    by_L = np.zeros((10, 4))
    by_L[range(4), range(4)] = 4.0 * L - 1.0
    for edge, (i, j) in enumerate(TET_EDGES, start=4):
        by_L[edge, [i, j]] = 4.0 * L[j], 4.0 * L[i]
    return by_L @ np.vstack([-np.ones(3), np.eye(3)])


def _stress_of_gradients(g: NDArray[np.float64], lame: NDArray[np.float64]) -> NDArray[np.float64]:
    """Coefficients (p, 6, 10, 3) of the stress from gradients (p, 10, 3)."""
    lam, mu = lame.T[:, :, None]
    values = np.zeros((len(g), 6, 10, 3))
    for component, (i, j) in enumerate(AXES):
        if i == j:
            values[:, component] += lam[:, :, None] * g
        values[:, component, :, i] += mu * g[:, :, j]
        values[:, component, :, j] += mu * g[:, :, i]
    return values
