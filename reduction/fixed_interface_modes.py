"""Vibration modes of a body with every pilot held."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from carrierflex.fe.static import AccuracyError
from carrierflex.reduction.held_structure import HeldStructure
from carrierflex.reduction.modes.block_lanczos import lowest_modes
from carrierflex.reduction.modes.mode_orientation import oriented

#: Largest residual of an eigenpair, relative to its elastic force.
_RESIDUAL_TOLERANCE = 1e-6
#: Right-hand sides solved together; 4 to 16 cost about the same.
_BLOCK_SIZE = 8


@dataclass(frozen=True, eq=False)
class FixedInterfaceModes:
    """Modes with ``G φ = 0``.

    Shapes, shape (n, k), mass-normalised, and angular frequencies [rad/s], ascending.
    """

    Phi: NDArray[np.float64]
    omega: NDArray[np.float64]


def fixed_interface_modes(
    fixed_interface: HeldStructure, M: sp.csr_array, n_modes: int, *, rng: np.random.Generator
) -> FixedInterfaceModes:
    """Lowest modes of ``K φ + Gᵀ λ = ω² M φ``, ``G φ = 0``, by block Lanczos iteration.

    The iteration uses the factor of the body with its pilots fixed. Signs, and the directions of
    modes of equal frequency, follow the rule of
    :mod:`carrierflex.reduction.modes.mode_orientation`.

    Parameters
    ----------
    fixed_interface : HeldStructure
        Body and pilots.
    M : csr_array, shape (n, n)
        Mass matrix [kg].
    n_modes : int
        Number of modes wanted, whether or not the last belongs to a group that goes on.
    rng : numpy.random.Generator
        Starting vector.

    Raises
    ------
    AccuracyError
        Where an eigenpair's residual exceeds 1e-6 of its elastic force, or there are fewer modes.
    """
    n = M.shape[0]
    if n_modes == 0:
        return FixedInterfaceModes(np.zeros((n, 0)), np.zeros(0))
    start = fixed_interface.static_response(M @ rng.standard_normal((n, _BLOCK_SIZE)))
    eigenvalues, Phi = lowest_modes(fixed_interface.static_response, M, start, n_modes)
    _check_residuals(fixed_interface, M, eigenvalues, Phi)
    omega = np.sqrt(eigenvalues)
    return FixedInterfaceModes(oriented(Phi, omega), omega)


def _check_residuals(
    fixed_interface: HeldStructure,
    M: sp.csr_array,
    eigenvalues: NDArray[np.float64],
    Phi: NDArray[np.float64],
) -> None:
    """Compare each mode with the static response to its own inertia force.

    ``φ = ω² K⁻¹ M φ`` with the pilots fixed.
    """
    if not Phi.shape[1]:
        return
    again = fixed_interface.static_response(M @ Phi) * eigenvalues
    residual = np.linalg.norm(again - Phi, axis=0) / np.linalg.norm(Phi, axis=0)
    if not residual.max() < _RESIDUAL_TOLERANCE:
        raise AccuracyError(
            f"fixed-interface mode {int(residual.argmax()) + 1} has a residual of "
            f"{residual.max():.1e}; expected less than {_RESIDUAL_TOLERANCE:.0e}"
        )
