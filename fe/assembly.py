"""Stiffness and mass of linear elasticity on curved quadratic tetrahedra.

The forms are those of :mod:`carrierflex.fe.weak_forms`, shape functions and quadrature rules
scikit-fem's; the loops over elements are compiled (:mod:`carrierflex.fe.element_kernels`) and write
straight into the node graph's blocks. The mass of a vector element is a scalar matrix times the
identity and is assembled as such. :mod:`carrierflex.fe.scikit_fem_path` assembles the same matrices
with scikit-fem alone.
"""

import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
import skfem
from numpy.typing import NDArray
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTet

from carrierflex.fe.element_kernels import (
    add_scalar_mass,
    add_stiffness,
    node_pair_blocks,
    threefold_rows,
)
from carrierflex.fe.materials import Material, material_of
from carrierflex.geometry.tet_mesh import TetMesh

#: Exact for straight elements: products of linear gradients.
STIFFNESS_ORDER = 2
#: Exact for straight elements: products of quadratic shape functions.
MASS_ORDER = 4


#: What makes stiffness and mass of a mesh and the materials of its bodies.
Assembly = Callable[[TetMesh, Mapping[str, Material]], tuple[sp.csr_array, sp.csr_array]]


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
        Symmetric to the last bit, six zero-energy modes [N/m]; degrees of freedom node by node, x y
        z within a node.

    Raises
    ------
    ValueError
        Where a body has no material.
    """
    return _stiffness(mesh, materials, _node_graph(mesh))


def assemble_mass(mesh: TetMesh, materials: Mapping[str, Material]) -> sp.csr_array:
    """Consistent mass matrix M, shape (3 n, 3 n) [kg].

    Degrees of freedom as in :func:`assemble_stiffness`.

    Raises
    ------
    ValueError
        Where a body has no material.
    """
    return _mass(mesh, materials, _node_graph(mesh))


def assemble_stiffness_and_mass(
    mesh: TetMesh, materials: Mapping[str, Material]
) -> tuple[sp.csr_array, sp.csr_array]:
    """K and M as :func:`assemble_stiffness` and :func:`assemble_mass` make them.

    The node graph is built once for both.
    """
    graph = _node_graph(mesh)
    return _stiffness(mesh, materials, graph), _mass(mesh, materials, graph)


@dataclass(frozen=True, eq=False)
class _NodeGraph:
    """Which nodes share an element.

    Row pointers, sorted columns, and where every element's pairs of nodes stand in them.
    """

    indptr: NDArray[np.int32]
    indices: NDArray[np.int32]
    block_indices: NDArray[np.int32]


def _stiffness(mesh: TetMesh, materials: Mapping[str, Material], graph: _NodeGraph) -> sp.csr_array:
    n = len(mesh.points)
    blocks = np.zeros((len(graph.indices), 3, 3))
    _, gradients, weights = _reference_element(STIFFNESS_ORDER)
    for body, elements in mesh.bodies.items():
        lame, block_indices = material_of(materials, body).lame, graph.block_indices[elements]
        add_stiffness(
            mesh.points, mesh.tets[elements], lame, (gradients, weights), block_indices, blocks
        )
    return sp.csr_array(sp.bsr_array((blocks, graph.indices, graph.indptr), shape=(3 * n, 3 * n)))


def _mass(mesh: TetMesh, materials: Mapping[str, Material], graph: _NodeGraph) -> sp.csr_array:
    values = np.zeros(len(graph.indices))
    shapes, gradients, weights = _reference_element(MASS_ORDER)
    rule = (np.einsum("qi,qj->qij", shapes, shapes).reshape(-1, 100), gradients, weights)
    for body, elements in mesh.bodies.items():
        rho, block_indices = material_of(materials, body).rho, graph.block_indices[elements]
        add_scalar_mass(mesh.points, mesh.tets[elements], rho, rule, block_indices, values)
    return _repeated_for_three_axes(values, graph)


def _repeated_for_three_axes(values: NDArray[np.float64], graph: _NodeGraph) -> sp.csr_array:
    """Scalar matrix times the 3 × 3 identity, rows x y z of a node after one another."""
    n = len(graph.indptr) - 1
    data, columns, indptr = threefold_rows(values, graph.indices, graph.indptr)
    repeated = sp.csr_array((data, columns, indptr), shape=(3 * n, 3 * n))
    repeated.has_sorted_indices = True
    return repeated


def _node_graph(mesh: TetMesh) -> _NodeGraph:
    """Graph that joins nodes of one element."""
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
    indptr, indices = graph.indptr.astype(np.int32), graph.indices.astype(np.int32)
    return _NodeGraph(indptr, indices, node_pair_blocks(mesh.tets, indptr, indices))


@functools.cache
def _reference_element(
    order: int,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Shape functions, gradients and weights of the quadrature rule of that order.

    Shapes (q, 10), (q, 10, 3) and (q,).
    """
    points, weights = get_quadrature(RefTet, order)
    element = skfem.ElementTetP2()
    values = [element.lbasis(points, i) for i in range(10)]
    shapes = np.stack([value for value, _ in values], axis=-1)
    gradients = np.stack([gradient.T for _, gradient in values], axis=1)
    return (
        np.ascontiguousarray(shapes),
        np.ascontiguousarray(gradients),
        np.ascontiguousarray(weights),
    )
