"""The material circle of the rim that the proximity sensors face.

Displacement at any carrier-frame angle.
"""

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from carrierflex.fe.node_dofs import dofs_of
from carrierflex.geometry.tet_mesh import NamedSurfaces

#: Distance [m] at which a node counts as lying on the circle.
_ON = 1e-7
#: Corners and, of quadratic facets, mid-side node of the edges of a facet, by its number of nodes.
_EDGES = {
    4: ((0, 1), (1, 2), (2, 3), (3, 0)),
    6: ((0, 1, 3), (1, 2, 4), (2, 0, 5)),
    8: ((0, 1, 4), (1, 2, 5), (2, 3, 6), (3, 0, 7)),
}
_EDGES[9] = _EDGES[8]


def rim_recovery(
    mesh: NamedSurfaces, radius: float, angles: NDArray[np.float64]
) -> tuple[sp.csr_array, sp.csr_array]:
    """Recovery rows of the displacement on the rim face's circle of the given radius.

    Axial and radial displacement.

    The mesh has element edges on that circle (its CAD face is cut along it), so the displacement at
    an angle is the interpolation along one edge: quadratic, or linear of linear elements.

    Parameters
    ----------
    mesh : NamedSurfaces
        Carrier mesh, whole or half sector, with the surface ``rim_face``.
    radius : float
        Radius of the circle [m].
    angles : ndarray, shape (n,)
        Carrier-frame angles [rad] within the part of the circle that the mesh holds.

    Returns
    -------
    axial, radial : csr_array, shape (n, n_dofs)
        Displacement along +x and along e(angle) per nodal displacement.

    Raises
    ------
    ValueError
        Where the mesh has no edges on the circle, or an angle is not covered by them.
    """
    edges = _edges_on_circle(mesh, radius)
    start, width = _edge_angles(mesh, edges)
    turned = np.mod(angles[:, None] - start[None, :] + 1e-9, 2.0 * np.pi) - 1e-9
    inside = turned <= width[None, :] + 1e-9
    if not inside.any(axis=1).all():
        missing = np.rad2deg(angles[~inside.any(axis=1)][0])
        raise ValueError(f"no element edge of the rim circle covers the angle {missing:.4g} deg")
    edge = inside.argmax(axis=1)
    interpolation = _quadratic_shapes if edges.shape[1] == 3 else _linear_shapes
    shapes = interpolation(mesh, edges[edge], turned[np.arange(len(angles)), edge])
    direction = np.stack([np.zeros_like(angles), -np.sin(angles), np.cos(angles)], axis=1)
    rows = np.repeat(np.arange(len(angles)), edges.shape[1])
    dofs = dofs_of(edges[edge].ravel())
    shape = (len(angles), 3 * len(mesh.points))
    axial = sp.csr_array((shapes.ravel(), (rows, dofs[:, 0])), shape=shape)
    radial = sp.csr_array(shape)
    for axis in (1, 2):
        values = (shapes * direction[:, axis, None]).ravel()
        radial = radial + sp.csr_array((values, (rows, dofs[:, axis])), shape=shape)
    return axial, radial


def circle_nodes(mesh: NamedSurfaces, radius: float) -> NDArray[np.int64]:
    """Nodes of the rim face's circle of the given radius [m], ascending.

    Raises
    ------
    ValueError
        Where the mesh has no edges on the circle.
    """
    return np.unique(_edges_on_circle(mesh, radius))


def _edges_on_circle(mesh: NamedSurfaces, radius: float) -> NDArray[np.int64]:
    facets = mesh.surface("rim_face")
    edges = np.concatenate([facets[:, list(edge)] for edge in _EDGES[facets.shape[1]]])
    # A triangle among quadrilaterals has its first corner twice.
    edges = edges[edges[:, 0] != edges[:, 1]]
    on_circle = np.abs(np.hypot(mesh.points[:, 1], mesh.points[:, 2]) - radius) < _ON
    on_rim = np.unique(edges[on_circle[edges].all(axis=1)], axis=0)
    if not len(on_rim):
        raise ValueError(f"the rim face has no element edges on the circle of radius {radius} m")
    return on_rim


def _angle(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Carrier-frame angle of points, from e(v) = (0, -sin v, cos v)."""
    return np.arctan2(-points[..., 1], points[..., 2])


def _edge_angles(
    mesh: NamedSurfaces, edges: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Angle of each edge's first node and its width.

    Edges are reversed in place to run towards increasing angle.
    """
    first, last = _angle(mesh.points[edges[:, 0]]), _angle(mesh.points[edges[:, 1]])
    width = np.mod(last - first + np.pi, 2.0 * np.pi) - np.pi
    backward = width < 0.0
    edges[backward, :2] = edges[backward, 1::-1]
    return np.where(backward, last, first), np.abs(width)


def _quadratic_shapes(
    mesh: NamedSurfaces, edges: NDArray[np.int64], turned: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Shape functions of the edge's nodes (first, last, middle).

    Evaluated where the angle from the first node is `turned`.
    """
    first, last, middle = (_angle(mesh.points[edges[:, i]]) for i in range(3))
    width = np.mod(last - first, 2.0 * np.pi)
    half = np.mod(middle - first, 2.0 * np.pi)
    # angle(s) = 4 half s (1 - s) + width s (2 s - 1); its curvature is tiny, so the quadratic root
    # is taken in stable form.
    b, c = 4.0 * half - width, 2.0 * width - 4.0 * half
    s = 2.0 * turned / (b + np.sqrt(np.maximum(b**2 + 4.0 * c * turned, 0.0)))
    return np.stack([(1.0 - s) * (1.0 - 2.0 * s), s * (2.0 * s - 1.0), 4.0 * s * (1.0 - s)], axis=1)


def _linear_shapes(
    mesh: NamedSurfaces, edges: NDArray[np.int64], turned: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Shape functions of a straight edge's nodes, where the angle from the first is `turned`.

    The ray at that angle meets the chord of the angle w at the share
    sin(turned) / (sin(turned) + sin(w - turned)).
    """
    first, last = (_angle(mesh.points[edges[:, i]]) for i in range(2))
    width = np.mod(last - first, 2.0 * np.pi)
    before, behind = np.sin(turned), np.sin(width - turned)
    s = before / (before + behind)
    return np.stack([1.0 - s, s], axis=1)
