"""Static solution of one load on a large mesh of quadratic tetrahedra, without a factor of it.

Conjugate gradients with a cycle of two levels as preconditioner: a Gauss-Seidel sweep, the direct
solution on linear tetrahedra (an eighth of the unknowns), and the sweep backwards. The number of
steps does not grow with the mesh, so that work and memory are proportional to the unknowns; the
work of a factorisation grows with their square. Many loads are served better by a factor.

References
----------
Brandt and Livne (2011), "Multigrid Techniques", SIAM, sections 1 to 4; Saad (2003), "Iterative
Methods for Sparse Linear Systems", 2nd ed., algorithm 9.1.
"""

import numba
import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg
from numpy.typing import NDArray

from carrierflex.fe.factorisation import factorise
from carrierflex.fe.static import AccuracyError
from carrierflex.geometry.tet_mesh import TET_EDGES, TetMesh

#: Residual over the load at which the iteration ends: displacements then agree with those of a
#: factorisation to rounding.
_TOLERANCE = 1e-12
#: The carrier's meshes take 33 or 34 steps.
_MOST_STEPS = 200


def linear_part(mesh: TetMesh) -> sp.csr_array:
    """Displacement of all nodes from that of the corners alone, shape (3 n, 3 n).

    A node on an edge moves as the mean of the edge's ends.
    """
    n = len(mesh.points)
    corners = np.unique(mesh.tets[:, :4])
    middles, first = np.unique(mesh.tets[:, 4:], return_index=True)
    ends = mesh.tets[:, np.array(TET_EDGES)].reshape(-1, 2)[first]
    values = np.concatenate([np.ones(len(corners)), np.full(ends.size, 0.5)])
    rows = np.concatenate([corners, np.repeat(middles, 2)])
    columns = np.concatenate([corners, ends.ravel()])
    nodes = sp.csr_array((values, (rows, columns)), shape=(n, n))
    return sp.csr_array(sp.kron(nodes, sp.eye_array(3)))


def two_level_solution(
    A: sp.csr_array, P: sp.csr_array, b: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Solve A x = b.

    Parameters
    ----------
    A : csr_array, shape (n, n)
        Symmetric positive definite, both triangles stored.
    P : csr_array, shape (n, n_coarse)
        Unknowns from those of the coarse level; its columns are independent.
    b : ndarray, shape (n,)
        Right-hand side.

    Raises
    ------
    SingularMatrixError
        Where A is not positive definite on the coarse level.
    AccuracyError
        Where the iteration does not end.
    """
    restriction, diagonal = sp.csr_array(P.T), A.diagonal()
    coarse = restriction @ A @ P
    coarse.sort_indices()
    factor = factorise(coarse)

    def cycle(r: NDArray[np.float64]) -> NDArray[np.float64]:
        x = np.zeros(len(r))
        _sweep(A.indptr, A.indices, A.data, diagonal, r, x, False)
        x += P @ factor.solve(restriction @ (r - A @ x))
        _sweep(A.indptr, A.indices, A.data, diagonal, r, x, True)
        return x

    preconditioner = scipy.sparse.linalg.LinearOperator(A.shape, matvec=cycle, dtype=np.float64)
    x, steps = scipy.sparse.linalg.cg(A, b, rtol=_TOLERANCE, maxiter=_MOST_STEPS, M=preconditioner)
    if steps:
        raise AccuracyError(
            f"the static solution of {len(b)} unknowns leaves more than {_TOLERANCE:.0e} of the "
            f"load after {steps} steps; expected fewer: use a mesh of better elements"
        )
    return np.asarray(x)


@numba.njit(cache=True)
def _sweep(
    indptr: NDArray[np.int32],
    indices: NDArray[np.int32],
    values: NDArray[np.float64],
    diagonal: NDArray[np.float64],
    b: NDArray[np.float64],
    x: NDArray[np.float64],
    backwards: bool,
) -> None:
    """One Gauss-Seidel sweep over the unknowns x of A x = b, forwards or backwards, in place."""
    n, step = len(b), -1 if backwards else 1
    for number in range(n):
        row = n - 1 - number if backwards else number
        first, last = indptr[row], indptr[row + 1]
        # In the other order of its entries a sweep backwards takes five times as long.
        if backwards:
            first, last = last - 1, first - 1
        rest = b[row]
        for entry in range(first, last, step):
            rest -= values[entry] * x[indices[entry]]
        x[row] += rest / diagonal[row]
