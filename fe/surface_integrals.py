"""Integrals over curved facets: quadratic triangles, and quadrilaterals of 4, 8 and 9 nodes.

The consistent weights of surfaces and their rigid motions. A triangle of straight edges is a
quadrilateral whose last corner is its first: bilinear shape functions then are linear on it, and
the rule below integrates them exactly.
"""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from carrierflex.geometry.tet_mesh import NamedSurfaces

#: Six-point rule of degree 4 on the triangle (Strang and Fix 1973): barycentric a, a, 1 - 2 a and
#: weight.
_RULE = ((0.445948490915965, 0.223381589678011), (0.091576213509771, 0.109951743655322))
#: Gauss's rule of three points along each side.
_QUADRILATERAL_ORDER = 5


def _quadrature() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    points, weights = [], []
    for a, weight in _RULE:
        for corner in range(3):
            barycentric = np.full(3, a)
            barycentric[corner] = 1.0 - 2.0 * a
            points.append(barycentric)
            weights.append(weight / 2.0)
    return np.array(points), np.array(weights)


def _shapes(L: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Quadratic shape functions (q, 6) and gradients (q, 6, 2) at barycentric points (q, 3)."""
    d = np.array([[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]])
    edges = ((0, 1), (1, 2), (2, 0))
    N = np.stack(
        [
            *(L[:, i] * (2.0 * L[:, i] - 1.0) for i in range(3)),
            *(4.0 * L[:, i] * L[:, j] for i, j in edges),
        ],
        1,
    )
    dN = np.stack(
        [
            *((4.0 * L[:, i, None] - 1.0) * d[i] for i in range(3)),
            *(4.0 * (L[:, i, None] * d[j] + L[:, j, None] * d[i]) for i, j in edges),
        ],
        1,
    )
    return N, dN


@cache
def _facet_rule(
    n_nodes: int,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Shape functions (q, m), gradients (q, m, 2) and weights (q,) of facets of m nodes."""
    if n_nodes == 6:
        points, weights = _quadrature()
        return *_shapes(points), weights
    return _quadrilateral_rule(n_nodes)


def _quadrilateral_rule(
    n_nodes: int,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """The same of quadrilaterals, by scikit-fem: corners round about, mid-sides, middle."""
    import skfem
    from skfem.quadrature import get_quadrature
    from skfem.refdom import RefQuad

    kinds = {4: skfem.ElementQuad1, 8: skfem.ElementQuadS2, 9: skfem.ElementQuad2}
    element = kinds[n_nodes]()
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    middles = (corners + np.roll(corners, -1, axis=0)) / 2.0
    wanted = np.concatenate([corners, middles, [[0.5, 0.5]]])[:n_nodes]
    points, weights = get_quadrature(RefQuad, _QUADRILATERAL_ORDER)
    node_of = [int(np.abs(element.doflocs - point).sum(axis=1).argmin()) for point in wanted]
    values = [element.lbasis(points, i) for i in node_of]
    ones = np.ones(len(weights))
    N = np.stack([value * ones for value, _ in values], axis=1)
    dN = np.stack([(gradient * np.ones((2, 1))).T for _, gradient in values], axis=1)
    return N, dN, weights


def rigid_motion(points: NDArray[np.float64], origin: NDArray[np.float64]) -> NDArray[np.float64]:
    """Displacement of `points` (..., 3) per unit rigid motion at `origin`.

    Translations come first, then rotations.

    Returns
    -------
    ndarray, shape (..., 3, 6)
        ``R`` with ``u = R q``: identity beside the rotation's cross product ``q_r × (x - origin)``.
    """
    r = points - origin
    R = np.zeros((*points.shape[:-1], 3, 6))
    R[..., [0, 1, 2], [0, 1, 2]] = 1.0
    R[..., 0, 4], R[..., 0, 5] = r[..., 2], -r[..., 1]
    R[..., 1, 3], R[..., 1, 5] = -r[..., 2], r[..., 0]
    R[..., 2, 3], R[..., 2, 4] = r[..., 1], -r[..., 0]
    return R


def rigid_body_modes(
    points: NDArray[np.float64], rigid_points: NDArray[np.float64], origin: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Rigid motions about `origin` of nodes and rigid pilots, shape (n_dofs, 6).

    Nodes have three rows each; the pilots follow with six rows each.
    """
    pilots = np.zeros((len(rigid_points), 6, 6))
    pilots[:, :3] = rigid_motion(rigid_points, origin)
    pilots[:, [3, 4, 5], [3, 4, 5]] = 1.0
    return np.concatenate([rigid_motion(points, origin).reshape(-1, 6), pilots.reshape(-1, 6)])


def surface_moments(
    mesh: NamedSurfaces, facets: NDArray[np.int64], origin: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Integrate rigid motions about `origin` over curved facets.

    Parameters
    ----------
    mesh : NamedSurfaces
        Mesh of n nodes.
    facets : ndarray of int, shape (k, 4, 6, 8 or 9)
        Quadrilaterals or quadratic triangles.
    origin : ndarray, shape (3,)
        Point of the rotations [m].

    Returns
    -------
    B : ndarray, shape (6, n, 3)
        ``B = ∫ Rᵀ N dA`` [m^2 and m^3]: its first three rows hold every node's share of the area.
    Z : ndarray, shape (6, 6)
        ``Z = ∫ Rᵀ R dA``; equal to B times the nodes' rigid motion, the elements being
        isoparametric.
    """
    nodes, local = np.unique(facets, return_inverse=True)
    B_surface, Z = facet_moments(mesh.points[nodes], local.reshape(facets.shape), origin)
    B = np.zeros((6, len(mesh.points), 3))
    B[:, nodes] = B_surface
    return B, Z


def facet_moments(
    points: NDArray[np.float64], facets: NDArray[np.int64], origin: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """:func:`surface_moments` of facets that number the nodes of their own surface only.

    `points` has the shape (n, 3) [m].
    """
    N, dN, weights = _facet_rule(facets.shape[1])
    corners = points[facets]
    x = np.einsum("qi,kia->kqa", N, corners)
    tangents = np.einsum("qib,kia->kqba", dN, corners)
    area = np.linalg.norm(np.cross(tangents[..., 0, :], tangents[..., 1, :]), axis=-1) * weights
    R = rigid_motion(x, origin)
    Z = np.einsum("kq,kqai,kqaj->ij", area, R, R, optimize=True)
    B = np.zeros((6, len(points), 3))
    shares = np.einsum("kq,qn,kqai->kina", area, N, R, optimize=True)
    np.add.at(B, (np.arange(6)[None, :, None], facets[:, None, :]), shares)
    return B, Z


def surface_moment_derivatives(
    mesh: NamedSurfaces,
    facets: NDArray[np.int64],
    origin: NDArray[np.float64],
    velocities: tuple[NDArray[np.float64], NDArray[np.float64]],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Derivatives of :func:`surface_moments` where nodes and origin move.

    Parameters
    ----------
    mesh, facets, origin
        As there.
    velocities : tuple of ndarray
        Of the nodes, shape (n, 3), and of the origin, shape (3,) [m per unit].

    Returns
    -------
    dB : ndarray, shape (6, n, 3)
        ``∫ dRᵀ N dA + ∫ Rᵀ N d(dA)``.
    dZ : ndarray, shape (6, 6)
        ``∫ dRᵀ R + Rᵀ dR dA + ∫ Rᵀ R d(dA)``.
    """
    N, dN, weights = _facet_rule(facets.shape[1])
    V, V_origin = velocities
    corners, moving = mesh.points[facets], V[facets]
    x, v = (np.einsum("qi,kia->kqa", N, values) for values in (corners, moving))
    t, t_moving = (np.einsum("qib,kia->kqba", dN, values) for values in (corners, moving))
    normal = np.cross(t[..., 0, :], t[..., 1, :])
    d_normal = np.cross(t_moving[..., 0, :], t[..., 1, :])
    d_normal += np.cross(t[..., 0, :], t_moving[..., 1, :])
    size = np.linalg.norm(normal, axis=-1)
    area, d_area = size * weights, np.einsum("kqa,kqa->kq", normal, d_normal) / size * weights
    R = rigid_motion(x, origin)
    # R is linear in the arm: its rate is the rotations' part at the arm's rate.
    dR = rigid_motion(v, V_origin)
    dR[..., [0, 1, 2], [0, 1, 2]] = 0.0
    half = np.einsum("kq,kqai,kqaj->ij", area, dR, R, optimize=True)
    dZ = half + half.T + np.einsum("kq,kqai,kqaj->ij", d_area, R, R, optimize=True)
    weighted = area[..., None, None] * dR + d_area[..., None, None] * R
    dB = np.zeros((6, len(mesh.points), 3))
    shares = np.einsum("qn,kqai->kina", N, weighted, optimize=True)
    np.add.at(dB, (np.arange(6)[None, :, None], facets[:, None, :]), shares)
    return dB, dZ


def nodal_normals(points: NDArray[np.float64], facets: NDArray[np.int64]) -> NDArray[np.float64]:
    """Unit normals of quadratic triangles at each of their nodes, shape (k, 6, 3).

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Node coordinates [m].
    facets : ndarray of int, shape (k, 6)
        Corners counter-clockwise seen from where the normals point, then mid-side nodes.
    """
    corners = np.eye(3)
    middles = (corners + np.roll(corners, -1, axis=0)) / 2.0
    _, dN = _shapes(np.concatenate([corners, middles]))
    t = np.einsum("qib,kia->kqba", dN, points[facets])
    normal = np.cross(t[..., 0, :], t[..., 1, :])
    return np.asarray(normal / np.linalg.norm(normal, axis=-1, keepdims=True))


def surface_area(mesh: NamedSurfaces, facets: NDArray[np.int64]) -> float:
    """Area of curved facets [m^2].

    `facets` hold the numbers of the mesh's nodes.
    """
    return float(surface_moments(mesh, facets, np.zeros(3))[1][0, 0])
