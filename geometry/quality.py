"""Quality of curved quadratic tetrahedra: the Jacobian determinant over each element."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.geometry.tet_mesh import TET_EDGES, TetMesh


class InvertedElementError(ValueError):
    """An element's Jacobian determinant is not positive everywhere."""


@dataclass(frozen=True)
class MeshQuality:
    """Figures of one mesh: nodes, elements, volume and its worst element.

    Parameters
    ----------
    n_nodes, n_tets : int
        Number of nodes and of elements.
    volume : float
        Volume [m^3] (four-point quadrature of the Jacobian determinant).
    worst_scaled_jacobian : float
        Smallest over largest Jacobian determinant within an element, worst element; 1 for straight
        edges.
    worst_shape : float
        Mean-ratio shape of the worst corner tetrahedron: 1 regular, 0 degenerate.
    """

    n_nodes: int
    n_tets: int
    volume: float
    worst_scaled_jacobian: float
    worst_shape: float


def mesh_quality(mesh: TetMesh) -> MeshQuality:
    """Measure `mesh`: volume, worst scaled Jacobian, worst shape."""
    determinants = _jacobian_determinants(mesh, _SAMPLES)
    scaled = determinants.min(axis=1) / determinants.max(axis=1)
    volume = float(_jacobian_determinants(mesh, _QUADRATURE).mean(axis=1).sum() / 6.0)
    return MeshQuality(
        len(mesh.points),
        len(mesh.tets),
        volume,
        float(scaled.min()),
        float(_mean_ratio(mesh).min()),
    )


def check_quality(mesh: TetMesh) -> MeshQuality:
    """Measure `mesh` and refuse it where an element is inverted.

    Raises
    ------
    InvertedElementError
        Where a Jacobian determinant is zero or negative at a corner, a mid-side node or the centre
        of an element.
    """
    determinants = _jacobian_determinants(mesh, _SAMPLES).min(axis=1)
    n_bad = int(np.count_nonzero(determinants <= 0.0))
    if n_bad:
        worst = int(np.argmin(determinants))
        x, y, z = mesh.points[mesh.tets[worst, :4]].mean(axis=0)
        raise InvertedElementError(
            f"{n_bad} of {len(mesh.tets)} elements are inverted, the worst near ({x:.3f}, {y:.3f}, "
            f"{z:.3f}) m; expected positive Jacobian determinants: choose a smaller mesh size"
        )
    return mesh_quality(mesh)


def _shape_gradients(barycentric: NDArray[np.float64]) -> NDArray[np.float64]:
    """Gradients of the ten quadratic shape functions, shape (q, 10, 3).

    At points given by barycentric coordinates.
    """
    d_barycentric = np.array(
        [[-1.0, -1.0, -1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    )
    corners = [(4.0 * barycentric[:, i, None] - 1.0) * d_barycentric[i] for i in range(4)]
    edges = [
        4.0
        * (barycentric[:, i, None] * d_barycentric[j] + barycentric[:, j, None] * d_barycentric[i])
        for i, j in TET_EDGES
    ]
    return np.stack([*corners, *edges], axis=1)


def _sample_points() -> NDArray[np.float64]:
    corners = np.eye(4)
    middles = [(corners[i] + corners[j]) / 2.0 for i, j in TET_EDGES]
    return np.array([*corners, *middles, np.full(4, 0.25)])


_SAMPLES = _sample_points()
#: Four-point rule of degree 2 (Hammer, Marlowe and Stroud 1956).
_QUADRATURE = np.full((4, 4), 0.1381966011250105) + np.eye(4) * (
    0.5854101966249685 - 0.1381966011250105
)


def _jacobian_determinants(mesh: TetMesh, barycentric: NDArray[np.float64]) -> NDArray[np.float64]:
    """Determinant of d(x)/d(reference) in every element at each of the points, shape (m, q)."""
    gradients = _shape_gradients(barycentric)
    jacobians = np.einsum("mna,qnb->mqab", mesh.points[mesh.tets], gradients, optimize=True)
    return np.linalg.det(jacobians)


def _mean_ratio(mesh: TetMesh) -> NDArray[np.float64]:
    """Mean ratio 12 (3 V)^(2/3) / sum of squared edge lengths of the corner tetrahedra.

    After Liu and Joe (1994).
    """
    corners = mesh.points[mesh.tets[:, :4]]
    volume = np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6.0
    squared = sum(((corners[:, i] - corners[:, j]) ** 2).sum(axis=1) for i, j in TET_EDGES)
    return 12.0 * np.cbrt(3.0 * np.maximum(volume, 0.0)) ** 2 / squared
