"""The triangle of a sparse symmetric matrix that a factorisation reads, degrees of freedom that are held left out."""

import numba
import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray


def upper_triangle(A: sp.csr_array, held: NDArray[np.int64]) -> sp.csr_array:
    """Upper triangle of a symmetric matrix, rows and columns `held` replaced by their diagonal entry alone.

    Parameters
    ----------
    A : csr_array, shape (n, n)
        Symmetric, both triangles stored.
    held : ndarray of int
        Degrees of freedom that the others shall not see.

    Returns
    -------
    csr_array, shape (n, n)
        Sorted, with a diagonal entry in every row, be it zero: one pass over A, no other copy of
        it.
    """
    A = A if A.has_sorted_indices else A.sorted_indices()
    is_held = np.zeros(A.shape[0], dtype=np.bool_)
    is_held[held] = True
    indptr = _row_starts(A.indptr, A.indices, is_held)
    indices, data = np.empty(indptr[-1], dtype=np.int32), np.empty(indptr[-1])
    _fill(A.indptr, A.indices, A.data, is_held, indptr, indices, data)
    upper = sp.csr_array((data, indices, indptr), shape=A.shape)
    upper.has_sorted_indices = True
    return upper


@numba.njit(cache=True)
def _row_starts(
    indptr: NDArray[np.int32], indices: NDArray[np.int32], held: NDArray[np.bool_]
) -> NDArray[np.int32]:
    starts = np.zeros(len(indptr), dtype=np.int32)
    for row in range(len(held)):
        count = 1
        for place in range(indptr[row], indptr[row + 1]):
            column = indices[place]
            if column > row and not held[row] and not held[column]:
                count += 1
        starts[row + 1] = starts[row] + count
    return starts


@numba.njit(cache=True)
def _fill(
    indptr: NDArray[np.int32],
    indices: NDArray[np.int32],
    values: NDArray[np.float64],
    held: NDArray[np.bool_],
    starts: NDArray[np.int32],
    columns: NDArray[np.int32],
    data: NDArray[np.float64],
) -> None:
    for row in range(len(held)):
        here = starts[row]
        columns[here], data[here] = row, 0.0
        for place in range(indptr[row], indptr[row + 1]):
            column = indices[place]
            if column == row:
                data[starts[row]] += values[place]
            elif column > row and not held[row] and not held[column]:
                here += 1
                columns[here], data[here] = column, values[place]
