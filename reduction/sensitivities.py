"""How reduced matrices and natural frequencies change with a parameter of the finite elements.

On the basis T of the nominal body, kept as it is,

    K_r' = Tᵀ K' T,   M_r' = Tᵀ M' T,   G_r' = G' T,

G_r being the pilots' motion in the reduced coordinates, ``[I 0]`` for the nominal body: where nodes
of a pilot's surface move, its coordinates are no longer exactly its motion, and G_r' says by how
much.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.fe.half_sector_derivatives import HalfSectorDerivative
from carrierflex.reduction.modes.dense_modes import dense_modes
from carrierflex.reduction.symmetric_craig_bampton import SymmetricReduction

#: Frequencies within this share of one another are one group: symmetry makes them equal to about
#: 1e-9.
_REPEATED = 1e-6


@dataclass(frozen=True, eq=False)
class ReducedDerivative:
    """Derivatives of a reduced body by one parameter, on its nominal basis.

    Parameters
    ----------
    K, M : ndarray, shape (n, n)
        Of stiffness and mass [SI per unit].
    G : ndarray, shape (m, n)
        Of the pilots' motion in the coordinates [m, rad per unit].
    """

    K: NDArray[np.float64]
    M: NDArray[np.float64]
    G: NDArray[np.float64]


def reduced_derivative(
    reduction: SymmetricReduction, of: HalfSectorDerivative
) -> ReducedDerivative:
    """Derivative of a reduced body from that of its half sector.

    All images of the half sector contribute, each with the coordinates turned to it: ``Σ_g Q_g Tᵀ
    K' T Q_gᵀ``.
    """
    basis = reduction.basis
    T, Q = basis.T, basis.motions
    K = T.T @ (of.dK @ T)
    M = sum(
        (axis.T @ (of.dS @ axis) for axis in (np.ascontiguousarray(T[a::3]) for a in range(3))),
        start=np.zeros_like(K),
    )
    m = of.dZ.shape[0]
    G = np.einsum("gab,bc,gdc->ad", Q[:, :m, :m], of.dB @ T, Q, optimize=True)
    G[:, :m] -= of.dZ
    return ReducedDerivative(
        _summed_over_images(Q, K), _summed_over_images(Q, M), np.linalg.solve(basis.half.Z, G)
    )


def _summed_over_images(Q: NDArray[np.float64], matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    total = np.einsum("gab,bc,gdc->ad", Q, matrix, Q, optimize=True)
    return (total + total.T) / 2.0


@dataclass(frozen=True, eq=False)
class FrequencyDerivatives:
    """Natural frequencies [Hz], shape (k,), and their derivatives, shape (p, k) [Hz per unit].

    In a group of equal frequencies the derivatives are ascending: the group splits, and which of
    its members has which derivative depends on the parameter.
    """

    frequency: NDArray[np.float64]
    derivative: NDArray[np.float64]


def frequency_derivatives(
    K: NDArray[np.float64],
    M: NDArray[np.float64],
    derivatives: Sequence[tuple[NDArray[np.float64], NDArray[np.float64]]],
    n_modes: int,
    *,
    n_rigid: int = 6,
) -> FrequencyDerivatives:
    """Lowest elastic frequencies of ``K φ = ω² M φ`` and their derivatives.

    ``(ω²)' = φᵀ (K' - ω² M') φ`` of a single frequency; of a repeated one the eigenvalues of the
    group's matrix ``Φᵀ (K' - ω² M') Φ``.

    Parameters
    ----------
    K, M : ndarray, shape (n, n)
        Stiffness and mass.
    derivatives : sequence of tuple
        K' and M' by each of p parameters.
    n_modes : int
        Frequencies wanted at least; the last group is complete.
    n_rigid : int
        Motions of zero frequency that come before them.

    References
    ----------
    .. [1] Ojalvo, AIAA Journal 26 (1988), 361-366: repeated frequencies.
    """
    omega_squared, modes = dense_modes(K, M)
    last = min(n_rigid + n_modes, len(omega_squared))
    while last < len(omega_squared) and _equal(omega_squared[last], omega_squared[last - 1]):
        last += 1
    elastic, Phi = omega_squared[n_rigid:last], modes[:, n_rigid:last]
    omega = np.sqrt(elastic)
    ends = [i for i in range(1, len(elastic)) if not _equal(elastic[i], elastic[i - 1])]
    groups = [group for group in np.split(np.arange(len(elastic)), ends) if group.size]
    of_squares = np.zeros((len(derivatives), len(elastic)))
    for row, (dK, dM) in zip(of_squares, derivatives, strict=True):
        for group in groups:
            Phi_g = Phi[:, group]
            row[group] = np.linalg.eigvalsh(
                Phi_g.T @ (dK @ Phi_g) - elastic[group].mean() * (Phi_g.T @ (dM @ Phi_g))
            )
    return FrequencyDerivatives(omega / (2.0 * np.pi), of_squares / (4.0 * np.pi * omega))


def _equal(a: float, b: float) -> bool:
    return abs(a - b) < 2.0 * _REPEATED * b
