"""Vibration modes of a body with every pilot held."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import LinearOperator, eigsh

from fe.static import AccuracyError
from reduction.held_structure import HeldStructure

#: Largest residual of an eigenpair, relative to its elastic force.
_RESIDUAL_TOLERANCE = 1e-6


@dataclass(frozen=True, eq=False)
class FixedInterfaceModes:
    """Modes with ``G φ = 0``: shapes, shape (n, k), mass-normalised, and angular frequencies [rad/s], ascending."""

    Phi: NDArray[np.float64]
    omega: NDArray[np.float64]


def fixed_interface_modes(
    held: HeldStructure, M: sp.csr_array, n_modes: int, *, rng: np.random.Generator
) -> FixedInterfaceModes:
    """Lowest modes of ``K φ + Gᵀ λ = ω² M φ``, ``G φ = 0``, by inverse Lanczos iteration with the held body's factor.

    Parameters
    ----------
    held : HeldStructure
        Body and pilots.
    M : csr_array, shape (n, n)
        Mass matrix [kg].
    n_modes : int
        Number of modes wanted.
    rng : numpy.random.Generator
        Starting vector.

    Raises
    ------
    ValueError
        Where `n_modes` is negative or not far below the number of degrees of freedom.
    AccuracyError
        Where an eigenpair's residual exceeds 1e-6 of its elastic force.
    """
    n = M.shape[0]
    if not 0 <= n_modes < n // 10:
        raise ValueError(f"number of modes is {n_modes}; expected 0 to {n // 10 - 1} for {n} degrees of freedom")
    if n_modes == 0:
        return FixedInterfaceModes(np.zeros((n, 0)), np.zeros(0))
    no_motion = np.zeros((6 * len(held.pilots), 1))

    def answer(force: NDArray[np.float64]) -> NDArray[np.float64]:
        return held.solve(force.reshape(-1, 1), no_motion)[0].ravel()

    inverse = LinearOperator((n, n), matvec=answer, dtype=np.float64)
    start = answer(M @ rng.standard_normal(n))
    eigenvalues, Phi = eigsh(held.body.K, k=n_modes, M=M, sigma=0.0, OPinv=inverse, v0=start, ncv=2 * n_modes + 20)
    ascending = np.argsort(eigenvalues)
    eigenvalues, Phi = eigenvalues[ascending], Phi[:, ascending]
    _check_residuals(held, M, eigenvalues, Phi)
    return FixedInterfaceModes(Phi, np.sqrt(eigenvalues))


def _check_residuals(
    held: HeldStructure, M: sp.csr_array, eigenvalues: NDArray[np.float64], Phi: NDArray[np.float64]
) -> None:
    """Compare each mode with the held body's answer to its own inertia force, ``φ = ω² K⁻¹ M φ``."""
    again = held.solve(M @ Phi, np.zeros((6 * len(held.pilots), Phi.shape[1])))[0] * eigenvalues
    residual = np.linalg.norm(again - Phi, axis=0) / np.linalg.norm(Phi, axis=0)
    if not residual.max() < _RESIDUAL_TOLERANCE:
        raise AccuracyError(
            f"fixed-interface mode {int(residual.argmax()) + 1} has a residual of {residual.max():.1e}; expected less than "
            f"{_RESIDUAL_TOLERANCE:.0e}"
        )
