"""Compiled loops over quadratic tetrahedra that fill stiffness and mass matrices block by block (numba).

With the physical gradients ``g_i`` of the shape functions, a pair of nodes (i, j) of an element adds the 3 × 3 block
``∫ λ g_i g_jᵀ + μ g_j g_iᵀ + μ (g_i · g_j) I dV`` to the stiffness, and ``∫ ρ N_i N_j dV`` to the scalar mass.
"""

import numba
import numpy as np
from numpy.typing import NDArray

_jit = numba.njit(cache=True, fastmath=False)


@_jit
def _position(indices: NDArray[np.int32], start: int, end: int, column: int) -> int:
    """Place of `column` in the sorted row ``indices[start:end]``."""
    while start < end:
        middle = (start + end) // 2
        if indices[middle] < column:
            start = middle + 1
        else:
            end = middle
    return start


@_jit
def _physical_gradients(x: NDArray[np.float64], reference: NDArray[np.float64], g: NDArray[np.float64]) -> float:
    """Fill `g` (10, 3) with physical gradients from reference ones (10, 3); the Jacobian determinant."""
    J = np.zeros((3, 3))
    for i in range(10):
        for a in range(3):
            for b in range(3):
                J[a, b] += x[i, a] * reference[i, b]
    cofactor = np.empty((3, 3))
    for a in range(3):
        a1, a2 = (a + 1) % 3, (a + 2) % 3
        for b in range(3):
            b1, b2 = (b + 1) % 3, (b + 2) % 3
            cofactor[a, b] = J[a1, b1] * J[a2, b2] - J[a1, b2] * J[a2, b1]
    determinant = J[0, 0] * cofactor[0, 0] + J[0, 1] * cofactor[0, 1] + J[0, 2] * cofactor[0, 2]
    for i in range(10):
        for a in range(3):
            g[i, a] = (
                cofactor[a, 0] * reference[i, 0] + cofactor[a, 1] * reference[i, 1] + cofactor[a, 2] * reference[i, 2]
            ) / determinant
    return determinant


@_jit
def _stiffness_block(G: NDArray[np.float64], lame_lambda: float, mu: float, block: NDArray[np.float64]) -> None:
    """Fill `block` with ``λ G + μ Gᵀ + μ tr(G) I`` from the gradient products ``G = ∫ g_i g_jᵀ dV``."""
    shear = mu * (G[0, 0] + G[1, 1] + G[2, 2])
    for a in range(3):
        for b in range(3):
            block[a, b] = lame_lambda * G[a, b] + mu * G[b, a]
        block[a, a] += shear


@_jit
def _gradient_products(
    x: NDArray[np.float64],
    gradients: NDArray[np.float64],
    weights: NDArray[np.float64],
    products: NDArray[np.float64],
) -> None:
    """Fill `products` (10, 10, 3, 3), j >= i, with ``∫ g_i g_jᵀ dV`` of the element with nodes x (10, 3)."""
    g = np.empty((10, 3))
    products[:] = 0.0
    for q in range(weights.shape[0]):
        volume = weights[q] * abs(_physical_gradients(x, gradients[q], g))
        for i in range(10):
            for a in range(3):
                weighted = volume * g[i, a]
                for j in range(i, 10):
                    for b in range(3):
                        products[i, j, a, b] += weighted * g[j, b]
    for i in range(10):
        # Rounding differs with the order of the factors; a node's own products are symmetric to the last bit.
        for a in range(3):
            for b in range(a):
                products[i, i, a, b] = products[i, i, b, a]


@_jit
def add_stiffness(
    points: NDArray[np.float64],
    tets: NDArray[np.int64],
    material: tuple[float, float],
    rule: tuple[NDArray[np.float64], NDArray[np.float64]],
    pattern: tuple[NDArray[np.int32], NDArray[np.int32]],
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
        Gradients of the shape functions at the q points of a quadrature rule (q, 10, 3), and its weights (q,).
    pattern : tuple of ndarray
        Row pointers and sorted column indices of the node graph.
    blocks : ndarray, shape (n_blocks, 3, 3)
        Filled in place [N/m].
    """
    lame_lambda, mu = material
    gradients, weights = rule
    indptr, indices = pattern
    products = np.empty((10, 10, 3, 3))
    block = np.empty((3, 3))
    x = np.empty((10, 3))
    for element in range(tets.shape[0]):
        for i in range(10):
            for a in range(3):
                x[i, a] = points[tets[element, i], a]
        _gradient_products(x, gradients, weights, products)
        for i in range(10):
            row = tets[element, i]
            for j in range(i, 10):
                column = tets[element, j]
                _stiffness_block(products[i, j], lame_lambda, mu, block)
                here = _position(indices, indptr[row], indptr[row + 1], column)
                for a in range(3):
                    for b in range(3):
                        blocks[here, a, b] += block[a, b]
                if i != j:
                    # The mirror block is the transpose, entry by entry: the matrix is symmetric to the last bit.
                    there = _position(indices, indptr[column], indptr[column + 1], row)
                    for a in range(3):
                        for b in range(3):
                            blocks[there, a, b] += block[b, a]


@_jit
def add_scalar_mass(
    points: NDArray[np.float64],
    tets: NDArray[np.int64],
    density: float,
    rule: tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]],
    pattern: tuple[NDArray[np.int32], NDArray[np.int32]],
    values: NDArray[np.float64],
) -> None:
    """Add the elements' scalar mass to `values` (n_blocks,) in place.

    Parameters are those of :func:`add_stiffness`, with the density [kg/m^3] and, first in `rule`, the shape functions at
    the quadrature points (q, 10).
    """
    shapes, gradients, weights = rule
    indptr, indices = pattern
    g = np.empty((10, 3))
    x = np.empty((10, 3))
    mass = np.empty((10, 10))
    for element in range(tets.shape[0]):
        for i in range(10):
            for a in range(3):
                x[i, a] = points[tets[element, i], a]
        mass[:] = 0.0
        for q in range(weights.shape[0]):
            share = density * weights[q] * abs(_physical_gradients(x, gradients[q], g))
            for i in range(10):
                for j in range(i, 10):
                    mass[i, j] += share * shapes[q, i] * shapes[q, j]
        for i in range(10):
            row = tets[element, i]
            for j in range(i, 10):
                column = tets[element, j]
                values[_position(indices, indptr[row], indptr[row + 1], column)] += mass[i, j]
                if i != j:
                    values[_position(indices, indptr[column], indptr[column + 1], row)] += mass[i, j]
