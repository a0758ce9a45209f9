"""Stiffness and mass of linear elasticity on quadratic tetrahedra, by scikit-fem's scalar forms.

With the matrices of gradient products ``G_ab = ∫ ∂_a N_i ∂_b N_j dV``, the blocks of the isotropic stiffness are
``K_ab = λ G_ab + μ G_abᵀ + δ_ab μ Σ_c G_cc``; the mass is ``ρ ∫ N_i N_j dV`` times the identity.
"""

from collections.abc import Mapping

import numpy as np
import scipy.sparse as sp
import skfem
from numpy.typing import NDArray

from fe.materials import Material
from fe.tet_space import node_of_dof, scalar_basis
from geometry.tet_mesh import TetMesh

#: Exact for straight elements: products of linear gradients.
_STIFFNESS_ORDER = 2
#: Exact for straight elements: products of quadratic shape functions.
_MASS_ORDER = 4


def assemble_stiffness(mesh: TetMesh, materials: Mapping[str, Material]) -> sp.csr_array:
    """Stiffness matrix K of the free structure.

    Parameters
    ----------
    mesh : TetMesh
        Quadratic tetrahedra, n nodes.
    materials : mapping of str to Material
        Material of every body of the mesh.

    Returns
    -------
    csr_array, shape (3 n, 3 n)
        Symmetric, six zero-energy modes [N/m]; degrees of freedom node by node, x y z within a node.

    Raises
    ------
    ValueError
        Where a body has no material.
    """
    n = len(mesh.points)
    K = sp.csr_array((3 * n, 3 * n))
    for body, elements in mesh.bodies.items():
        lame_lambda, mu = _material(materials, body).lame
        basis = scalar_basis(mesh, _STIFFNESS_ORDER, elements)
        nodes = node_of_dof(mesh, basis, elements)
        G = {(a, b): _gradient_products(a, b).assemble(basis) for a in range(3) for b in range(a, 3)}
        G |= {(b, a): G[a, b].T for a in range(3) for b in range(a + 1, 3)}
        shear = mu * (G[0, 0] + G[1, 1] + G[2, 2])
        for a in range(3):
            for b in range(3):
                block = lame_lambda * G[a, b] + mu * G[b, a] + (shear if a == b else 0.0 * shear)
                K += _placed(block, 3 * nodes + a, 3 * nodes + b, 3 * n)
    # Assembly sums each pair of entries in a different order; halving the sum with the transpose removes the rounding.
    return ((K + K.T) * 0.5).tocsr()


def assemble_mass(mesh: TetMesh, materials: Mapping[str, Material]) -> sp.csr_array:
    """Consistent mass matrix M, shape (3 n, 3 n) [kg]; degrees of freedom as in :func:`assemble_stiffness`.

    Raises
    ------
    ValueError
        Where a body has no material.
    """
    n = len(mesh.points)
    scalar = sp.csr_array((n, n))
    for body, elements in mesh.bodies.items():
        basis = scalar_basis(mesh, _MASS_ORDER, elements)
        nodes = node_of_dof(mesh, basis, elements)
        scalar += _placed(_material(materials, body).rho * _products.assemble(basis), nodes, nodes, n)
    return sp.csr_array(sp.kron((scalar + scalar.T) * 0.5, sp.eye_array(3), format="csr"))


def _material(materials: Mapping[str, Material], body: str) -> Material:
    if body not in materials:
        raise ValueError(f"body {body!r} has no material; materials are given for {', '.join(sorted(materials))}")
    return materials[body]


def _gradient_products(a: int, b: int) -> skfem.BilinearForm:
    return skfem.BilinearForm(lambda u, v, w: v.grad[a] * u.grad[b])


@skfem.BilinearForm
def _products(u: skfem.DiscreteField, v: skfem.DiscreteField, w: object) -> NDArray[np.float64]:
    return u * v


def _placed(matrix: sp.spmatrix, rows: NDArray[np.int64], columns: NDArray[np.int64], n: int) -> sp.csr_array:
    """Scatter `matrix` into an (n, n) matrix at `rows` and `columns`."""
    coo = matrix.tocoo()
    return sp.csr_array((coo.data, (rows[coo.row], columns[coo.col])), shape=(n, n))
