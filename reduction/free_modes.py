"""Free vibration modes of the full body and of the reduced one, and how well they agree."""

from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from numpy.typing import NDArray

from carrierflex.reduction.held_structure import Grounded
from carrierflex.reduction.modes.block_lanczos import lowest_modes
from carrierflex.reduction.modes.dense_modes import dense_modes
from carrierflex.reduction.modes.mode_orientation import oriented

_BLOCK_SIZE = 8
#: Frequencies within this share of one another are compared as one group: degenerate pairs mix
#: freely.
_SAME_FREQUENCY = 0.01


@dataclass(frozen=True, eq=False)
class FreeModes:
    """Elastic free modes (n, k), mass-normalised, and their angular frequencies [rad/s].

    Ascending.
    """

    Phi: NDArray[np.float64]
    omega: NDArray[np.float64]


def full_free_modes(
    M: sp.csr_array, body: Grounded, n_modes: int, *, rng: np.random.Generator
) -> FreeModes:
    """Lowest elastic modes of the free body, rigid motion taken out of every solve.

    Parameters
    ----------
    M : csr_array, shape (n, n)
        Mass matrix [kg] of the body, or of a block of it.
    body : Grounded
        Its factor.
    n_modes : int
        Number of elastic modes wanted.
    rng : numpy.random.Generator
        Starting block.
    """
    R = body.rigid_modes
    MR = M @ R
    rigid_mass = scipy.linalg.cho_factor(R.T @ MR) if R.shape[1] else None

    def static_response(force: NDArray[np.float64]) -> NDArray[np.float64]:
        """Elastic displacement under a force balanced by the body's inertia."""
        if rigid_mass is None:
            return body.displacement(force)
        balanced = force - MR @ scipy.linalg.cho_solve(rigid_mass, R.T @ force)
        u = body.displacement(balanced)
        return u - R @ scipy.linalg.cho_solve(rigid_mass, MR.T @ u)

    start = static_response(M @ rng.standard_normal((M.shape[0], _BLOCK_SIZE)))
    omega_squared, Phi = lowest_modes(static_response, M, start, n_modes)
    omega = np.sqrt(omega_squared)
    return FreeModes(oriented(Phi, omega), omega)


def reduced_free_modes(
    K: NDArray[np.float64],
    M: NDArray[np.float64],
    basis: NDArray[np.float64],
    n_modes: int,
    *,
    n_rigid: int = 6,
) -> FreeModes:
    """Lowest elastic free modes of reduced matrices at the full body's degrees of freedom.

    The basis (n_dofs, n) expands them; `n_rigid` motions of zero frequency come before them.
    """
    omega_squared, q = dense_modes(K, M)
    elastic = slice(n_rigid, n_rigid + n_modes)
    return FreeModes(basis @ q[:, elastic], np.sqrt(omega_squared[elastic]))


def frequency_errors(full: FreeModes, reduced: FreeModes) -> NDArray[np.float64]:
    """Relative error of every reduced frequency.

    Not negative but for rounding, since a reduction only stiffens.
    """
    k = min(len(full.omega), len(reduced.omega))
    return reduced.omega[:k] / full.omega[:k] - 1.0


def group_mac(M: sp.csr_array, full: FreeModes, reduced: FreeModes) -> NDArray[np.float64]:
    """Modal assurance of every full mode with the group of reduced modes of about its frequency.

    ``Σ_j (φᵀ M φ_j)²`` over the reduced modes within 1 % of its frequency: 1 where the group
    contains the mode. Masses weight it, so that it is an energy and not a count of nodes.
    """
    products = full.Phi.T @ (M @ reduced.Phi)
    near = np.abs(reduced.omega[None, :] / full.omega[:, None] - 1.0) < _SAME_FREQUENCY
    return np.asarray((products**2 * near).sum(axis=1))
