"""Linear tetrahedra made quadratic: nodes in the middle of their straight edges."""

import numpy as np
from numpy.typing import NDArray

from carrierflex.geometry.tet_mesh import TET_EDGES


def quadratic_tetrahedra(
    points: NDArray[np.float64], tets: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Nodes and quadratic tetrahedra of linear ones.

    Linear tetrahedra are far too stiff in bending; with nodes in their edges the same body is
    computed as well as its flat faces allow.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Nodes [m].
    tets : ndarray of int, shape (m, 4)
        Corners.

    Returns
    -------
    points : ndarray, shape (n + n_edges, 3)
        The nodes and, after them, the middles of all edges.
    tets : ndarray of int, shape (m, 10)
        In the order of :data:`carrierflex.geometry.tet_mesh.TET_EDGES`.
    """
    ends = np.sort(tets[:, np.array(TET_EDGES)], axis=2)
    edges, number = np.unique(ends.reshape(-1, 2), axis=0, return_inverse=True)
    middles = points[edges].mean(axis=1)
    of_element = len(points) + number.reshape(len(tets), len(TET_EDGES))
    return np.concatenate([points, middles]), np.concatenate([tets, of_element], axis=1)
