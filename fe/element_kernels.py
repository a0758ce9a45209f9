"""Compiled loops over quadratic tetrahedra that fill stiffness and mass matrices block by block (numba).

With the physical gradients ``g_i`` of the shape functions, a pair of nodes (i, j) of an element
adds the 3 × 3 block ``∫ λ g_i g_jᵀ + μ g_j g_iᵀ + μ (g_i · g_j) I dV`` to the stiffness, and ``∫ ρ
N_i N_j dV`` to the scalar mass.
"""

import numba
import numpy as np
from numpy.typing import NDArray

_jit = numba.njit(cache=True, fastmath=False)


@_jit
def block_places(
    tets: NDArray[np.int64], indptr: NDArray[np.int32], indices: NDArray[np.int32]
) -> NDArray[np.int32]:
    """Place, shape (m, 100), of every element's 10 × 10 pairs of nodes among the blocks of the node graph.

    Parameters
    ----------
    tets : ndarray, shape (m, 10)
        Elements.
    indptr, indices : ndarray
        Row pointers and sorted column indices of the node graph.
    """
    places = np.empty((tets.shape[0], 100), dtype=np.int32)
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
                places[element, 10 * i + j] = start
    return places


@_jit
def _jacobian(
    x: NDArray[np.float64], reference: NDArray[np.float64], J: NDArray[np.float64]
) -> float:
    """Fill `J` (3, 3) with ``∂x/∂ξ`` from reference gradients (10, 3); its determinant."""
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
    """Fill `products` (30, 30), nodes j >= i, with ``∫ g_i g_jᵀ dV`` of the element with nodes x (10, 3)."""
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
def add_stiffness(
    points: NDArray[np.float64],
    tets: NDArray[np.int64],
    material: tuple[float, float],
    rule: tuple[NDArray[np.float64], NDArray[np.float64]],
    places: NDArray[np.int32],
    blocks: NDArray[np.float64],
) -> None:
    """Add the elements' stiffness to `blocks` (n_blocks, 3, 3) in place.

    Parameters
    ----------
    points, tets : ndarray
        Nodes (n, 3) [m] and elements (m, 10).
    material : tuple of float
        Lamé's λ and μ [Pa].
    rule : tuple of ndarray
        Gradients of the shape functions at the q points of a quadrature rule (q, 10, 3), and its
        weights (q,).
    places : ndarray, shape (m, 100)
        Where the elements' pairs of nodes stand among the blocks.
    blocks : ndarray, shape (n_blocks, 3, 3)
        Filled in place [N/m].
    """
    lame_lambda, mu = material
    gradients, weights = rule
    G = np.empty((30, 30))
    x = np.empty((10, 3))
    for element in range(tets.shape[0]):
        for i in range(10):
            for a in range(3):
                x[i, a] = points[tets[element, i], a]
        _gradient_products(x, gradients, weights, G)
        for i in range(10):
            for j in range(i, 10):
                # The mirror block is the transpose, entry by entry: the matrix is symmetric to the
                # last bit.
                here, there = places[element, 10 * i + j], places[element, 10 * j + i]
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
def add_scalar_mass(
    points: NDArray[np.float64],
    tets: NDArray[np.int64],
    density: float,
    rule: tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]],
    places: NDArray[np.int32],
    values: NDArray[np.float64],
) -> None:
    """Add the elements' scalar mass to `values` (n_blocks,) in place.

    Parameters are those of :func:`add_stiffness`, with the density [kg/m^3] and, first in `rule`,
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
                values[places[element, 10 * i + j]] += entry
                if i != j:
                    values[places[element, 10 * j + i]] += entry


@_jit
def threefold_rows(
    values: NDArray[np.float64], indices: NDArray[np.int32], indptr: NDArray[np.int32]
) -> tuple[NDArray[np.float64], NDArray[np.int32], NDArray[np.int32]]:
    """Entries, columns and row pointers of a sparse matrix with every entry replaced by itself times the 3 × 3 identity."""
    data, columns = np.empty(3 * len(values)), np.empty(3 * len(values), dtype=np.int32)
    starts = np.empty(3 * (len(indptr) - 1) + 1, dtype=np.int32)
    starts[0] = 0
    here = 0
    for row in range(len(indptr) - 1):
        for axis in range(3):
            for place in range(indptr[row], indptr[row + 1]):
                data[here], columns[here] = values[place], 3 * indices[place] + axis
                here += 1
            starts[3 * row + axis + 1] = here
    return data, columns, starts
