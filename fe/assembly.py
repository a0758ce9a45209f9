"""Stiffness and mass of linear elasticity on curved quadratic tetrahedra.

The forms are those of :mod:`carrierflex.fe.scikit_fem_path`, shape functions and quadrature rules
scikit-fem's; the loops over elements are compiled and write straight into the node graph's blocks.
With the physical gradients ``g_i`` of the shape functions, a pair of nodes (i, j) of an element
adds the 3 × 3 block ``∫ λ g_i g_jᵀ + μ g_j g_iᵀ + μ (g_i · g_j) I dV`` to the stiffness, and ``∫ ρ
N_i N_j dV`` to the scalar mass, which is a scalar matrix times the identity.
:mod:`carrierflex.fe.scikit_fem_path` assembles the same matrices with scikit-fem alone.
"""

import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numba
import numpy as np
import scipy.sparse as sp
import skfem
from numpy.typing import NDArray
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTet

from carrierflex.fe.materials import Material, material_of
from carrierflex.geometry.tet_mesh import TetMesh

#: Exact for straight elements: products of linear gradients.
STIFFNESS_ORDER = 2
#: Exact for straight elements: products of quadratic shape functions.
MASS_ORDER = 4


#: What makes stiffness and mass of a mesh and the materials of its bodies.
Assembly = Callable[[TetMesh, Mapping[str, Material]], tuple[sp.csr_array, sp.csr_array]]


_jit = numba.njit(cache=True, fastmath=False)


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
    rule = _stiffness_rule()
    for body, elements in mesh.bodies.items():
        lame, block_indices = material_of(materials, body).lame, graph.block_indices[elements]
        _add_stiffness(mesh.points, mesh.tets[elements], lame, rule, block_indices, blocks)
    return sp.csr_array(sp.bsr_array((blocks, graph.indices, graph.indptr), shape=(3 * n, 3 * n)))


def _mass(mesh: TetMesh, materials: Mapping[str, Material], graph: _NodeGraph) -> sp.csr_array:
    values = np.zeros(len(graph.indices))
    rule = _mass_rule()
    for body, elements in mesh.bodies.items():
        rho, block_indices = material_of(materials, body).rho, graph.block_indices[elements]
        _add_scalar_mass(mesh.points, mesh.tets[elements], rho, rule, block_indices, values)
    return _repeated_for_three_axes(values, graph)


def _repeated_for_three_axes(values: NDArray[np.float64], graph: _NodeGraph) -> sp.csr_array:
    """Scalar matrix times the 3 × 3 identity, rows x y z of a node after one another."""
    n = len(graph.indptr) - 1
    data, columns, indptr = _threefold_rows(values, graph.indices, graph.indptr)
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
    return _NodeGraph(indptr, indices, _node_pair_blocks(mesh.tets, indptr, indices))


@dataclass(frozen=True, eq=False)
class MatrixDerivatives:
    """Derivatives of stiffness and mass of one mesh by its shape and by its materials.

    Nodes that move with the velocity V carry the shape functions along, so that with ``A = ∇V``
    their gradients change by ``-Aᵀ g_i`` and volumes by ``div V dV``. The stiffness changes as the
    products ``∫ g_i g_jᵀ dV`` that it is made of,

        ∫ h_i g_jᵀ + g_i h_jᵀ dV,   h_i = div V / 2 g_i - Aᵀ g_i,

    which is the volume form ``∫ σ(u):ε(v) div V - σ(u):∇v A - σ(v):∇u A dV``, and the mass by
    ``∫ ρ N_i N_j div V dV``. Both are the exact derivatives of the matrices that
    :func:`assemble_stiffness_and_mass` makes.

    Parameters
    ----------
    mesh : TetMesh
        Quadratic tetrahedra, n nodes.
    materials : mapping of str to Material
        Material of every body of the mesh.

    References
    ----------
    .. [1] Haug, Choi, Komkov, "Design Sensitivity Analysis of Structural Systems" (1986),
       section 3.3.
    """

    mesh: TetMesh
    materials: Mapping[str, Material]

    @functools.cached_property
    def _graph(self) -> _NodeGraph:
        return _node_graph(self.mesh)

    def by_shape(self, V: NDArray[np.float64]) -> tuple[sp.bsr_array, sp.csr_array]:
        """Derivatives where the nodes move with the velocity V, shape (n, 3).

        Returns
        -------
        dK : bsr_array, shape (3 n, 3 n)
            Of the stiffness.
        dS : csr_array, shape (n, n)
            Of the scalar mass: the mass matrix is it, repeated for x, y and z.
        """
        graph, V = self._graph, np.ascontiguousarray(V)
        blocks, values = np.zeros((len(graph.indices), 3, 3)), np.zeros(len(graph.indices))
        moving_nodes, rule, mass_rule = (self.mesh.points, V), _stiffness_rule(), _mass_rule()
        for body, elements in self.mesh.bodies.items():
            material, tets = material_of(self.materials, body), self.mesh.tets[elements]
            indices = graph.block_indices[elements]
            _add_stiffness_derivative(moving_nodes, tets, material.lame, rule, indices, blocks)
            _add_mass_derivative(moving_nodes, tets, material.rho, mass_rule, indices, values)
        return self._matrices(blocks, values)

    def by_material(self, body: str, constant: str) -> tuple[sp.bsr_array, sp.csr_array]:
        """Derivatives by ``E`` [Pa], ``nu`` or ``rho`` [kg/m^3] of a body; as :meth:`by_shape`."""
        graph, elements = self._graph, self.mesh.bodies[body]
        blocks, values = np.zeros((len(graph.indices), 3, 3)), np.zeros(len(graph.indices))
        tets, indices = self.mesh.tets[elements], graph.block_indices[elements]
        if constant == "rho":
            _add_scalar_mass(self.mesh.points, tets, 1.0, _mass_rule(), indices, values)
        else:
            lame = material_of(self.materials, body).lame_derivative(constant)
            _add_stiffness(self.mesh.points, tets, lame, _stiffness_rule(), indices, blocks)
        return self._matrices(blocks, values)

    def _matrices(
        self, blocks: NDArray[np.float64], values: NDArray[np.float64]
    ) -> tuple[sp.bsr_array, sp.csr_array]:
        n, graph = len(self.mesh.points), self._graph
        structure = (graph.indices, graph.indptr)
        return (
            sp.bsr_array((blocks, *structure), shape=(3 * n, 3 * n)),
            sp.csr_array((values, *structure), shape=(n, n)),
        )


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


def _stiffness_rule() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Gradients and weights of the rule of the stiffness."""
    _, gradients, weights = _reference_element(STIFFNESS_ORDER)
    return gradients, weights


@functools.cache
def _mass_rule() -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Products of shape functions (q, 100), gradients and weights of the rule of the mass."""
    shapes, gradients, weights = _reference_element(MASS_ORDER)
    return np.einsum("qi,qj->qij", shapes, shapes).reshape(-1, 100), gradients, weights


@_jit
def _node_pair_blocks(
    tets: NDArray[np.int64], indptr: NDArray[np.int32], indices: NDArray[np.int32]
) -> NDArray[np.int32]:
    """Blocks of the node graph that the pairs of nodes of every element belong to."""
    block_indices = np.empty((tets.shape[0], 100), dtype=np.int32)
    for element in range(tets.shape[0]):
        for i in range(10):
            row = tets[element, i]
            for j in range(10):
                column = tets[element, j]
                start, end = indptr[row], indptr[row + 1]
                while start < end:
                    middle = (start + end) // 2
                    if indices[middle] < column:
                        start = middle + 1
                    else:
                        end = middle
                block_indices[element, 10 * i + j] = start
    return block_indices


@_jit
def _jacobian(
    x: NDArray[np.float64], reference: NDArray[np.float64], J: NDArray[np.float64]
) -> float:
    """Fill `J` (3, 3) with ``∂x/∂ξ`` of nodal values from gradients (10, 3); its determinant."""
    for a in range(3):
        for b in range(3):
            total = 0.0
            for i in range(10):
                total += x[i, a] * reference[i, b]
            J[a, b] = total
    return (
        J[0, 0] * (J[1, 1] * J[2, 2] - J[1, 2] * J[2, 1])
        + J[0, 1] * (J[1, 2] * J[2, 0] - J[1, 0] * J[2, 2])
        + J[0, 2] * (J[1, 0] * J[2, 1] - J[1, 1] * J[2, 0])
    )


@_jit
def _physical_gradients(
    J: NDArray[np.float64],
    determinant: float,
    reference: NDArray[np.float64],
    g: NDArray[np.float64],
) -> None:
    """Fill `g` (30,), x y z of every node, with physical gradients from reference ones (10, 3)."""
    for a in range(3):
        a1, a2 = (a + 1) % 3, (a + 2) % 3
        c0 = (J[a1, 1] * J[a2, 2] - J[a1, 2] * J[a2, 1]) / determinant
        c1 = (J[a1, 2] * J[a2, 0] - J[a1, 0] * J[a2, 2]) / determinant
        c2 = (J[a1, 0] * J[a2, 1] - J[a1, 1] * J[a2, 0]) / determinant
        for i in range(10):
            g[3 * i + a] = c0 * reference[i, 0] + c1 * reference[i, 1] + c2 * reference[i, 2]


@_jit
def _gradient_products(
    x: NDArray[np.float64],
    gradients: NDArray[np.float64],
    weights: NDArray[np.float64],
    products: NDArray[np.float64],
) -> None:
    """Fill `products` (30, 30), nodes j >= i, with ``∫ g_i g_jᵀ dV`` of one element."""
    g, J = np.empty(30), np.empty((3, 3))
    products[:] = 0.0
    for q in range(weights.shape[0]):
        determinant = _jacobian(x, gradients[q], J)
        _physical_gradients(J, determinant, gradients[q], g)
        volume = weights[q] * abs(determinant)
        for row in range(30):
            weighted = volume * g[row]
            # From the node's first direction on: one contiguous run, which the compiler turns into
            # vector instructions.
            for column in range(3 * (row // 3), 30):
                products[row, column] += weighted * g[column]
    for i in range(10):
        # Rounding differs with the order of the factors; a node's own products are symmetric to the
        # last bit.
        for a in range(3):
            for b in range(a):
                products[3 * i + a, 3 * i + b] = products[3 * i + b, 3 * i + a]


@_jit
def _add_stiffness(
    points: NDArray[np.float64],
    tets: NDArray[np.int64],
    material: tuple[float, float],
    rule: tuple[NDArray[np.float64], NDArray[np.float64]],
    block_indices: NDArray[np.int32],
    blocks: NDArray[np.float64],
) -> None:
    """Add the elements' stiffness to `blocks` (n_blocks, 3, 3) in place."""
    gradients, weights = rule
    G = np.empty((30, 30))
    x = np.empty((10, 3))
    for element in range(tets.shape[0]):
        for i in range(10):
            for a in range(3):
                x[i, a] = points[tets[element, i], a]
        _gradient_products(x, gradients, weights, G)
        _add_blocks(G, material, block_indices[element], blocks)


@_jit
def _add_blocks(
    G: NDArray[np.float64],
    material: tuple[float, float],
    block_indices: NDArray[np.int32],
    blocks: NDArray[np.float64],
) -> None:
    """Add the stiffness of one element with the gradient products `G` (30, 30) to `blocks`."""
    lame_lambda, mu = material
    for i in range(10):
        for j in range(i, 10):
            # The mirror block is the transpose, entry by entry: the matrix is symmetric to the
            # last bit.
            here, there = block_indices[10 * i + j], block_indices[10 * j + i]
            shear = mu * (G[3 * i, 3 * j] + G[3 * i + 1, 3 * j + 1] + G[3 * i + 2, 3 * j + 2])
            for a in range(3):
                for b in range(3):
                    entry = lame_lambda * G[3 * i + a, 3 * j + b] + mu * G[3 * i + b, 3 * j + a]
                    if a == b:
                        entry += shear
                    blocks[here, a, b] += entry
                    if i != j:
                        blocks[there, b, a] += entry


@_jit
def _add_scalar_mass(
    points: NDArray[np.float64],
    tets: NDArray[np.int64],
    density: float,
    rule: tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]],
    block_indices: NDArray[np.int32],
    values: NDArray[np.float64],
) -> None:
    """Add the elements' scalar mass to `values` (n_blocks,) in place.

    Parameters are those of :func:`_add_stiffness`, with the density [kg/m^3] and, first in `rule`,
    the products of the shape functions at the quadrature points (q, 100), all pairs of nodes in a
    row.
    """
    shape_products, gradients, weights = rule
    J = np.empty((3, 3))
    x = np.empty((10, 3))
    mass = np.empty(100)
    for element in range(tets.shape[0]):
        for i in range(10):
            for a in range(3):
                x[i, a] = points[tets[element, i], a]
        mass[:] = 0.0
        for q in range(weights.shape[0]):
            share = density * weights[q] * abs(_jacobian(x, gradients[q], J))
            for pair in range(100):
                mass[pair] += share * shape_products[q, pair]
        for i in range(10):
            for j in range(i, 10):
                entry = mass[10 * i + j]
                values[block_indices[element, 10 * i + j]] += entry
                if i != j:
                    values[block_indices[element, 10 * j + i]] += entry


@_jit
def _gradient_product_derivatives(
    x: NDArray[np.float64],
    v: NDArray[np.float64],
    gradients: NDArray[np.float64],
    weights: NDArray[np.float64],
    products: NDArray[np.float64],
) -> None:
    """Fill `products` (30, 30), nodes j >= i, with ``∫ h_i g_jᵀ + g_i h_jᵀ dV`` of one element.

    Its nodes `x` (10, 3) move with the velocity `v` (10, 3).
    """
    g, h, J, A = np.empty(30), np.empty(30), np.empty((3, 3)), np.empty((3, 3))
    products[:] = 0.0
    for q in range(weights.shape[0]):
        determinant = _jacobian(x, gradients[q], J)
        _physical_gradients(J, determinant, gradients[q], g)
        half_divergence = _velocity_gradient(v, g, A) / 2.0
        for i in range(10):
            for b in range(3):
                turned = 0.0
                for a in range(3):
                    turned += A[a, b] * g[3 * i + a]
                h[3 * i + b] = half_divergence * g[3 * i + b] - turned
        volume = weights[q] * abs(determinant)
        for row in range(30):
            g_row, h_row = volume * g[row], volume * h[row]
            for column in range(3 * (row // 3), 30):
                products[row, column] += h_row * g[column] + g_row * h[column]
    for i in range(10):
        for a in range(3):
            for b in range(a):
                products[3 * i + a, 3 * i + b] = products[3 * i + b, 3 * i + a]


@_jit
def _velocity_gradient(
    v: NDArray[np.float64], g: NDArray[np.float64], A: NDArray[np.float64]
) -> float:
    """Fill `A` (3, 3) with ``∂V_a/∂x_b`` of nodal velocities (10, 3); its trace."""
    _jacobian(v, g.reshape(10, 3), A)
    return A[0, 0] + A[1, 1] + A[2, 2]


@_jit
def _add_stiffness_derivative(
    moving_nodes: tuple[NDArray[np.float64], NDArray[np.float64]],
    tets: NDArray[np.int64],
    material: tuple[float, float],
    rule: tuple[NDArray[np.float64], NDArray[np.float64]],
    block_indices: NDArray[np.int32],
    blocks: NDArray[np.float64],
) -> None:
    """:func:`_add_stiffness` of the derivative; `moving_nodes`: nodes and velocities (n, 3)."""
    points, velocities = moving_nodes
    gradients, weights = rule
    G = np.empty((30, 30))
    x, v = np.empty((10, 3)), np.empty((10, 3))
    for element in range(tets.shape[0]):
        for i in range(10):
            for a in range(3):
                x[i, a] = points[tets[element, i], a]
                v[i, a] = velocities[tets[element, i], a]
        _gradient_product_derivatives(x, v, gradients, weights, G)
        _add_blocks(G, material, block_indices[element], blocks)


@_jit
def _add_mass_derivative(
    moving_nodes: tuple[NDArray[np.float64], NDArray[np.float64]],
    tets: NDArray[np.int64],
    density: float,
    rule: tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]],
    block_indices: NDArray[np.int32],
    values: NDArray[np.float64],
) -> None:
    """:func:`_add_scalar_mass` of the derivative; `moving_nodes` are nodes and their velocities."""
    points, velocities = moving_nodes
    shape_products, gradients, weights = rule
    g, J, A = np.empty(30), np.empty((3, 3)), np.empty((3, 3))
    x, v = np.empty((10, 3)), np.empty((10, 3))
    for element in range(tets.shape[0]):
        for i in range(10):
            for a in range(3):
                x[i, a] = points[tets[element, i], a]
                v[i, a] = velocities[tets[element, i], a]
        for q in range(weights.shape[0]):
            determinant = _jacobian(x, gradients[q], J)
            _physical_gradients(J, determinant, gradients[q], g)
            share = density * weights[q] * abs(determinant) * _velocity_gradient(v, g, A)
            for pair in range(100):
                values[block_indices[element, pair]] += share * shape_products[q, pair]


@_jit
def _threefold_rows(
    values: NDArray[np.float64], indices: NDArray[np.int32], indptr: NDArray[np.int32]
) -> tuple[NDArray[np.float64], NDArray[np.int32], NDArray[np.int32]]:
    """A sparse matrix with every entry replaced by itself times the 3 × 3 identity."""
    data, columns = np.empty(3 * len(values)), np.empty(3 * len(values), dtype=np.int32)
    starts = np.empty(3 * (len(indptr) - 1) + 1, dtype=np.int32)
    starts[0] = 0
    here = 0
    for row in range(len(indptr) - 1):
        for axis in range(3):
            for entry in range(indptr[row], indptr[row + 1]):
                data[here], columns[here] = values[entry], 3 * indices[entry] + axis
                here += 1
            starts[3 * row + axis + 1] = here
    return data, columns, starts
