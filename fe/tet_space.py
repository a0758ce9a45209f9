"""The one adapter between our meshes and scikit-fem: quadratic tetrahedra, scalar shape functions.

scikit-fem keeps coordinates as (3, n) and numbers its degrees of freedom itself; everything outside this file
sees nodes in the order of :class:`geometry.tet_mesh.TetMesh`.
"""

import numpy as np
import skfem
from numpy.typing import NDArray

from geometry.tet_mesh import TetMesh


def scalar_basis(mesh: TetMesh, integration_order: int, elements: NDArray[np.int64]) -> skfem.CellBasis:
    """Quadratic scalar basis on the curved `elements` of `mesh`."""
    part = mesh.tets[elements]
    # scikit-fem would sort the corners of straight meshes; quadratic ones it keeps, which `node_of_dof` relies on.
    used, numbers = np.unique(part, return_inverse=True)
    skfem_mesh = skfem.MeshTet2(
        np.ascontiguousarray(mesh.points[used].T), np.ascontiguousarray(numbers.reshape(part.shape).T)
    )
    return skfem.CellBasis(skfem_mesh, skfem.ElementTetP2(), intorder=integration_order)


def node_of_dof(mesh: TetMesh, basis: skfem.CellBasis, elements: NDArray[np.int64]) -> NDArray[np.int64]:
    """Node number in `mesh` of every degree of freedom of `basis`, shape (basis.N,).

    Raises
    ------
    AssertionError
        Where scikit-fem placed a degree of freedom elsewhere than its node: its element order has changed.
    """
    nodes = np.empty(basis.N, dtype=np.int64)
    nodes[basis.element_dofs] = mesh.tets[elements].T
    assert np.allclose(basis.doflocs.T, mesh.points[nodes], rtol=0.0, atol=1e-9), "scikit-fem's node order has changed"
    return nodes
