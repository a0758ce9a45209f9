"""Block Lanczos iteration for the lowest modes of a symmetric problem.

Every new block is orthogonalised against all before it.

The operator is the body's answer to inertia forces, ``A x = K⁻¹ M x``, self-adjoint in the inner
product of M; its largest eigenvalues are ``1 / ω²``. A block finds degenerate pairs, of which
symmetric carriers are full, and one solve with several right-hand sides costs little more than one
with a single.
"""

from collections.abc import Callable

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from numpy.typing import NDArray

from carrierflex.fe.dense_threads import one_dense_thread
from carrierflex.fe.static import AccuracyError

#: Relative residual of an eigenvalue 1 / ω² at which it counts as found.
_TOLERANCE = 1e-10
#: A direction is new when at least this share of it is left after orthogonalisation.
_NEW_SHARE = 1e-10
#: Columns of the basis kept in one piece of memory.
_PIECE = 64
#: Degrees of freedom up to which all modes are found at once, by a dense eigenvalue problem.
_DENSE = 100
#: Eigenvalue over the largest below which a mode has no mass.
_MASSLESS = 1e-13
#: More steps than this per wanted mode mean that the operator is not what it should be.
_STEPS_PER_MODE = 6


@one_dense_thread()
def lowest_modes(
    static_response: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    M: sp.csr_array,
    start: NDArray[np.float64],
    n_modes: int,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lowest modes of ``A = K⁻¹ M``.

    Parameters
    ----------
    static_response : callable
        Displacement (n, b) of the held body under nodal forces (n, b).
    M : csr_array, shape (n, n)
        Mass matrix [kg].
    start : ndarray, shape (n, b)
        Starting block within the range of `static_response`; b is the block size.
    n_modes : int
        Number of modes wanted.

    Returns
    -------
    omega_squared : ndarray, shape (n_modes,)
        Squared angular frequencies [1/s^2], ascending; fewer where a small problem has no more.
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
    if len(start) <= _DENSE:
        return _all_modes(static_response, M, n_modes)
    block_size = start.shape[1]
    n_steps = _STEPS_PER_MODE * (n_modes // block_size + 4)
    Q, MQ, _ = _orthonormal(start, M, 0.0)
    basis, T = _Basis(len(start)), np.zeros((0, 0))
    recent, M_recent = Q, MQ
    for _ in range(n_steps):
        basis.append(Q)
        W = static_response(MQ)
        MW = M @ W
        size = float(np.sqrt(np.einsum("ij,ij->j", W, MW).max()))
        # In exact arithmetic the last two blocks are the only ones met; what rounding brings back
        # of all of them follows.
        met = recent.T @ MW
        W -= recent @ met
        MW -= M_recent @ met
        projection = basis.coefficients(MW)
        W -= basis.combined(projection)
        projection[-len(met) :] += met
        T = _bordered(T, projection)
        Q_before, MQ_before = Q, MQ
        Q, MQ, B = _orthonormal(W, M, size)
        theta, S = np.linalg.eigh(T)
        wanted = np.argsort(theta)[::-1][:n_modes]
        residual = np.linalg.norm(B @ S[-projection.shape[1] :, wanted], axis=0) / np.abs(
            theta[wanted]
        )
        if len(wanted) == n_modes and (Q.shape[1] == 0 or residual.max() < _TOLERANCE):
            return 1.0 / theta[wanted], basis.combined(S[:, wanted])
        if Q.shape[1] == 0:
            break
        recent, M_recent = (
            np.concatenate([Q_before, Q], axis=1),
            np.concatenate([MQ_before, MQ], axis=1),
        )
    raise AccuracyError(
        f"block Lanczos found fewer than {n_modes} modes in {len(T)} vectors of blocks of "
        f"{block_size}"
    )


def _all_modes(
    static_response: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    M: sp.csr_array,
    n_modes: int,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The same of a small problem: ``M = L Lᵀ``, eigenvectors y of ``Lᵀ K⁻¹ L``, ``φ = K⁻¹ L y``.

    Degrees of freedom without mass take no part in L.
    """
    # Rotations and translations have masses of different sizes: each is scaled to one.
    size = np.sqrt(M.diagonal())
    scale = 1.0 / np.where(size > 0.0, size, 1.0)
    masses, V = np.linalg.eigh(M.toarray() * np.outer(scale, scale))
    massive = masses > _MASSLESS * masses[-1]
    L = size[:, None] * V[:, massive] * np.sqrt(masses[massive])
    U = static_response(L)
    flexibility = L.T @ U
    theta, Y = np.linalg.eigh((flexibility + flexibility.T) / 2.0)
    wanted = np.argsort(theta)[::-1][:n_modes]
    wanted = wanted[theta[wanted] > _MASSLESS * theta[-1]]
    return 1.0 / theta[wanted], U @ Y[:, wanted] / theta[wanted]


class _Basis:
    """Orthonormal columns that grow block by block.

    In pieces, so that none is ever copied, large enough for fast products.
    """

    def __init__(self, n: int) -> None:
        self._n = n
        self._pieces: list[NDArray[np.float64]] = []
        self._filled = 0

    def append(self, block: NDArray[np.float64]) -> None:
        """Add the columns of `block`.

        Shape (n, b).
        """
        if not self._pieces or self._filled + block.shape[1] > self._pieces[-1].shape[1]:
            if self._pieces:
                self._pieces[-1] = self._pieces[-1][:, : self._filled]
            self._pieces.append(np.empty((self._n, max(_PIECE, block.shape[1])), order="F"))
            self._filled = 0
        self._pieces[-1][:, self._filled : self._filled + block.shape[1]] = block
        self._filled += block.shape[1]

    def coefficients(self, MW: NDArray[np.float64]) -> NDArray[np.float64]:
        """``Qᵀ M W`` of all columns Q.

        Shape (k, b) for M W of shape (n, b) and k columns so far.
        """
        return np.concatenate([piece.T @ MW for piece in self._used()])

    def combined(self, coefficients: NDArray[np.float64]) -> NDArray[np.float64]:
        """``Q c``, shape (n, k)."""
        total, first = np.zeros((self._n, coefficients.shape[1]), order="F"), 0
        for piece in self._used():
            total += piece @ coefficients[first : first + piece.shape[1]]
            first += piece.shape[1]
        return total

    def _used(self) -> list[NDArray[np.float64]]:
        return [*self._pieces[:-1], self._pieces[-1][:, : self._filled]]


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
    """M-orthonormal basis Q of the columns of W, ``M Q``, and B with ``W = Q B``.

    Dependent columns are left out.

    `size_before` is the length of the columns before they were orthogonalised: what is small beside
    it is rounding.
    """
    Q, B = W, np.eye(W.shape[1])
    for floor in (size_before, 0.0):
        MQ = M @ Q
        gram = Q.T @ MQ
        weights, V = scipy.linalg.eigh((gram + gram.T) / 2.0)
        independent = weights > _NEW_SHARE**2 * max(
            weights.max(initial=0.0), floor**2, np.finfo(float).tiny
        )
        root = np.sqrt(weights[independent])
        Q, MQ = Q @ (V[:, independent] / root), MQ @ (V[:, independent] / root)
        B = (root[:, None] * V[:, independent].T) @ B
    return Q, MQ, B
