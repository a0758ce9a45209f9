"""Vibration modes of a body with every pilot held."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from carrierflex.fe.static import AccuracyError
from carrierflex.reduction.block_lanczos import lowest_modes
from carrierflex.reduction.held_structure import HeldStructure

#: Largest residual of an eigenpair, relative to its elastic force.
_RESIDUAL_TOLERANCE = 1e-6
#: Right-hand sides solved together; 4 to 16 cost about the same.
_BLOCK_SIZE = 8
#: More modes than half of this are not looked for below a cut-off frequency.
_MOST_MODES = 800


@dataclass(frozen=True, eq=False)
class FixedInterfaceModes:
    """Modes with ``G φ = 0``.

    Shapes, shape (n, k), mass-normalised, and angular frequencies [rad/s], ascending.
    """

    Phi: NDArray[np.float64]
    omega: NDArray[np.float64]


def fixed_interface_modes(
    held: HeldStructure, M: sp.csr_array, n_modes: int, *, rng: np.random.Generator
) -> FixedInterfaceModes:
    """Lowest modes of ``K φ + Gᵀ λ = ω² M φ``, ``G φ = 0``, by block Lanczos iteration with the held body's factor.

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
        raise ValueError(
            f"number of modes is {n_modes}; expected 0 to {n // 10 - 1} for {n} degrees of freedom"
        )
    if n_modes == 0:
        return FixedInterfaceModes(np.zeros((n, 0)), np.zeros(0))
    start = held.answer(M @ rng.standard_normal((n, _BLOCK_SIZE)))
    eigenvalues, Phi = lowest_modes(held.answer, M, start, n_modes)
    _check_residuals(held, M, eigenvalues, Phi)
    return FixedInterfaceModes(Phi, np.sqrt(eigenvalues))


def count_below(
    held: HeldStructure, M: sp.csr_array, frequency_hz: float, *, rng: np.random.Generator
) -> int:
    """Number of fixed-interface modes below `frequency_hz` [Hz], found by asking for more until one lies above.

    Raises
    ------
    ValueError
        Where the frequency is not positive, or so high that the body would need more than 400
        modes.
    """
    if not frequency_hz > 0.0:
        raise ValueError(f"cut-off frequency is {frequency_hz} Hz; expected a positive frequency")
    n_modes = 10
    while n_modes <= _MOST_MODES:
        omega = fixed_interface_modes(held, M, n_modes, rng=rng).omega
        below = int(np.count_nonzero(omega < 2.0 * np.pi * frequency_hz))
        if below < n_modes:
            return below
        n_modes *= 2
    raise ValueError(
        f"more than {_MOST_MODES // 2} fixed-interface modes lie below {frequency_hz:g} Hz; expected a lower cut-off"
    )


def _check_residuals(
    held: HeldStructure, M: sp.csr_array, eigenvalues: NDArray[np.float64], Phi: NDArray[np.float64]
) -> None:
    """Compare each mode with the held body's answer to its own inertia force, ``φ = ω² K⁻¹ M φ``."""
    again = held.answer(M @ Phi) * eigenvalues
    residual = np.linalg.norm(again - Phi, axis=0) / np.linalg.norm(Phi, axis=0)
    if not residual.max() < _RESIDUAL_TOLERANCE:
        raise AccuracyError(
            f"fixed-interface mode {int(residual.argmax()) + 1} has a residual of {residual.max():.1e}; expected less than "
            f"{_RESIDUAL_TOLERANCE:.0e}"
        )
