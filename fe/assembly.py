"""Stiffness and mass of linear elasticity on curved quadratic tetrahedra.

Shape functions and quadrature rules are scikit-fem's; the loops over elements are compiled
(:mod:`fe.element_kernels`) and write straight into the node graph's blocks. The mass of a vector element is a scalar
matrix times the identity and is assembled as such.
"""

import functools
from collections.abc import Mapping

import numpy as np
import scipy.sparse as sp
import skfem
from numpy.typing import NDArray
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTet

from fe.element_kernels import add_scalar_mass, add_stiffness
from fe.materials import Material
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
        Symmetric to the last bit, six zero-energy modes [N/m]; degrees of freedom node by node, x y z within a node.

    Raises
    ------
    ValueError
        Where a body has no material.
    """
    n = len(mesh.points)
    indptr, indices = _node_graph(mesh)
    blocks = np.zeros((len(indices), 3, 3))
    _, gradients, weights = _reference_element(_STIFFNESS_ORDER)
    for body, elements in mesh.bodies.items():
        tets = mesh.tets[elements]
        add_stiffness(
            mesh.points, tets, _material(materials, body).lame, (gradients, weights), (indptr, indices), blocks
        )
    return sp.csr_array(sp.bsr_array((blocks, indices, indptr), shape=(3 * n, 3 * n)))


def assemble_mass(mesh: TetMesh, materials: Mapping[str, Material]) -> sp.csr_array:
    """Consistent mass matrix M, shape (3 n, 3 n) [kg]; degrees of freedom as in :func:`assemble_stiffness`.

    Raises
    ------
    ValueError
        Where a body has no material.
    """
    n = len(mesh.points)
    indptr, indices = _node_graph(mesh)
    values = np.zeros(len(indices))
    rule = _reference_element(_MASS_ORDER)
    for body, elements in mesh.bodies.items():
        rho = _material(materials, body).rho
        add_scalar_mass(mesh.points, mesh.tets[elements], rho, rule, (indptr, indices), values)
    scalar = sp.csr_array((values, indices, indptr), shape=(n, n))
    return sp.csr_array(sp.kron(scalar, sp.eye_array(3), format="csr"))


def _material(materials: Mapping[str, Material], body: str) -> Material:
    if body not in materials:
        raise ValueError(f"body {body!r} has no material; materials are given for {', '.join(sorted(materials))}")
    return materials[body]


def _node_graph(mesh: TetMesh) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Row pointers and sorted columns of the graph that joins nodes of one element."""
    n_tets = len(mesh.tets)
    incidence = sp.csr_array(
        (
            np.ones(mesh.tets.size, dtype=np.int8),
            mesh.tets.ravel().astype(np.int32),
            np.arange(0, mesh.tets.size + 1, 10),
        ),
        shape=(n_tets, len(mesh.points)),
    )
    graph = sp.csr_array(incidence.T @ incidence)
    graph.sort_indices()
    return graph.indptr.astype(np.int32), graph.indices.astype(np.int32)


@functools.cache
def _reference_element(order: int) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Shape functions (q, 10), their gradients (q, 10, 3) and weights (q,) of the quadrature rule of that order."""
    points, weights = get_quadrature(RefTet, order)
    element = skfem.ElementTetP2()
    values = [element.lbasis(points, i) for i in range(10)]
    shapes = np.stack([value for value, _ in values], axis=-1)
    gradients = np.stack([gradient.T for _, gradient in values], axis=1)
    return np.ascontiguousarray(shapes), np.ascontiguousarray(gradients), np.ascontiguousarray(weights)
