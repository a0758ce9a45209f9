"""Block Lanczos iteration with full reorthogonalisation for the lowest modes of a symmetric problem.

The operator is the body's answer to inertia forces, ``A x = K⁻¹ M x``, self-adjoint in the inner product of M; its largest
eigenvalues are ``1 / ω²``. A block finds degenerate pairs, of which symmetric carriers are full, and one solve with several
right-hand sides costs little more than one with a single.
"""

from collections.abc import Callable

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from numpy.typing import NDArray

from fe.static import AccuracyError

#: Relative residual of an eigenvalue 1 / ω² at which it counts as found.
_TOLERANCE = 1e-10
#: A direction is new when at least this share of it is left after orthogonalisation.
_NEW_SHARE = 1e-10
#: More steps than this per wanted mode mean that the operator is not what it should be.
_STEPS_PER_MODE = 6


def lowest_modes(
    answer: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    M: sp.csr_array,
    start: NDArray[np.float64],
    n_modes: int,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lowest modes of ``A = K⁻¹ M``.

    Parameters
    ----------
    answer : callable
        Displacement (n, b) of the held body under nodal forces (n, b).
    M : csr_array, shape (n, n)
        Mass matrix [kg].
    start : ndarray, shape (n, b)
        Starting block within the range of `answer`; b is the block size.
    n_modes : int
        Number of modes wanted.

    Returns
    -------
    omega_squared : ndarray, shape (n_modes,)
        Squared angular frequencies [1/s^2], ascending.
    Phi : ndarray, shape (n, n_modes)
        Modes with ``Φᵀ M Φ = I``.

    Raises
    ------
    AccuracyError
        Where the iteration does not find the modes.

    References
    ----------
    Grimes, Lewis and Simon (1994), SIAM J. Matrix Anal. Appl. 15(1), 228-272.
    """
    block_size = start.shape[1]
    n_steps = _STEPS_PER_MODE * (n_modes // block_size + 4)
    Q, MQ, _ = _orthonormal(start, M, 0.0)
    basis, M_basis = _Columns(Q), _Columns(MQ)
    T = np.zeros((0, 0))
    for _ in range(n_steps):
        W = answer(MQ)
        projection = M_basis.all.T @ W
        T = _bordered(T, projection)
        W -= basis.all @ projection
        W -= basis.all @ (M_basis.all.T @ W)
        Q, MQ, B = _orthonormal(W, M, float(np.linalg.norm(projection, axis=0).max()))
        theta, S = np.linalg.eigh(T)
        wanted = np.argsort(theta)[::-1][:n_modes]
        residual = np.linalg.norm(B @ S[-projection.shape[1] :, wanted], axis=0) / np.abs(theta[wanted])
        if len(wanted) == n_modes and (Q.shape[1] == 0 or residual.max() < _TOLERANCE):
            return 1.0 / theta[wanted], basis.all @ S[:, wanted]
        if Q.shape[1] == 0:
            break
        basis.append(Q)
        M_basis.append(MQ)
    raise AccuracyError(f"block Lanczos found fewer than {n_modes} modes in {len(T)} vectors of blocks of {block_size}")


class _Columns:
    """Columns that grow block by block in one array, so that orthogonalisation is one matrix product."""

    def __init__(self, first: NDArray[np.float64]) -> None:
        self._store = np.empty((first.shape[0], 8 * first.shape[1]), order="F")
        self._n = 0
        self.append(first)

    @property
    def all(self) -> NDArray[np.float64]:
        """All columns so far, shape (n, k)."""
        return self._store[:, : self._n]

    def append(self, block: NDArray[np.float64]) -> None:
        """Add the columns of `block`."""
        needed = self._n + block.shape[1]
        if needed > self._store.shape[1]:
            grown = np.empty((self._store.shape[0], 2 * needed), order="F")
            grown[:, : self._n] = self.all
            self._store = grown
        self._store[:, self._n : needed] = block
        self._n = needed


def _bordered(T: NDArray[np.float64], projection: NDArray[np.float64]) -> NDArray[np.float64]:
    """Matrix T with the new block's projection as its last columns and, mirrored, rows."""
    old, size = len(T), len(projection)
    bordered = np.zeros((size, size))
    bordered[:old, :old] = T
    bordered[:, old:] = projection
    bordered[old:, :old] = projection[:old].T
    bordered[old:, old:] = (projection[old:] + projection[old:].T) / 2.0
    return bordered


def _orthonormal(
    W: NDArray[np.float64], M: sp.csr_array, size_before: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """M-orthonormal basis Q of the columns of W, ``M Q``, and B with ``W = Q B``; dependent columns are left out.

    `size_before` is the length of the columns before they were orthogonalised: what is small beside it is rounding.
    """
    Q, B = W, np.eye(W.shape[1])
    for floor in (size_before, 0.0):
        MQ = M @ Q
        gram = Q.T @ MQ
        weights, V = scipy.linalg.eigh((gram + gram.T) / 2.0)
        kept = weights > _NEW_SHARE**2 * max(weights.max(initial=0.0), floor**2, np.finfo(float).tiny)
        root = np.sqrt(weights[kept])
        Q, MQ = Q @ (V[:, kept] / root), MQ @ (V[:, kept] / root)
        B = (root[:, None] * V[:, kept].T) @ B
    return Q, MQ, B
