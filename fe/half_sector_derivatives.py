"""Derivatives of a half sector's matrices and couplings by shape and material.

A body without symmetry is a half sector of the group of one motion
(:func:`carrierflex.geometry.dihedral_group.no_symmetry`).
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from carrierflex.fe.assembly import MatrixDerivatives
from carrierflex.fe.surface_integrals import surface_moment_derivatives
from carrierflex.fe.symmetry_blocks import HalfSector


@dataclass(frozen=True, eq=False)
class HalfSectorDerivative:
    """Derivatives of a :class:`carrierflex.fe.symmetry_blocks.HalfSector` by one parameter.

    Parameters
    ----------
    dK : bsr_array, shape (n_dofs, n_dofs)
        Of the half sector's stiffness.
    dS : csr_array, shape (n, n)
        Of its scalar mass: the mass matrix is it, repeated for x, y and z.
    dB, dZ : csr_array, shape (6 p, n_dofs), and ndarray, shape (6 p, 6 p)
        Of the p pilots' couplings; zero where no node of their surfaces moves.
    """

    dK: sp.bsr_array
    dS: sp.csr_array
    dB: sp.csr_array
    dZ: NDArray[np.float64]

    def of_couplings(self, half: HalfSector) -> sp.csr_array:
        """Derivative of the half sector's share of the couplings ``Z⁻¹ B``, shape (6 p, n_dofs)."""
        mean = np.linalg.inv(half.Z)
        share = sp.csr_array(mean) @ half.B
        return sp.csr_array(sp.csr_array(mean) @ (self.dB - sp.csr_array(self.dZ) @ share))


def shape_derivative(
    half: HalfSector,
    matrices: MatrixDerivatives,
    V: NDArray[np.float64],
    pilot_velocities: Mapping[str, NDArray[np.float64]],
) -> HalfSectorDerivative:
    """Derivative where the half sector's nodes move with the velocity V, shape (n, 3).

    Parameters
    ----------
    half : HalfSector
        The half sector.
    matrices : MatrixDerivatives
        Of its mesh.
    V : ndarray, shape (n, 3)
        Velocity of the nodes [m per unit]; with its images it keeps the body's symmetry.
    pilot_velocities : mapping of str to ndarray, shape (3,)
        Velocity of every pilot [m per unit].
    """
    dK, dS = matrices.by_shape(V)
    mesh, size = matrices.mesh, 6 * len(half.pilots)
    shares, dZ_half = [], np.zeros((size, size))
    for i, (pilot, point) in enumerate(half.pilots.items()):
        facets = mesh.surfaces.get(pilot, np.zeros((0, 6), dtype=np.int64))
        velocities = (V, pilot_velocities[pilot])
        dB, dZ = surface_moment_derivatives(mesh, facets, point, velocities)
        shares.append(sp.csr_array(dB.reshape(6, -1)))
        dZ_half[6 * i : 6 * i + 6, 6 * i : 6 * i + 6] = dZ
    Q = half.pilot_motions
    dZ = np.einsum("gab,bc,gdc->ad", Q, dZ_half, Q, optimize=True)
    return HalfSectorDerivative(dK, dS, sp.csr_array(sp.vstack(shares)), dZ)


def material_derivative(
    half: HalfSector, matrices: MatrixDerivatives, body: str, constant: str
) -> HalfSectorDerivative:
    """Derivative by ``E`` [Pa], ``nu`` or ``rho`` [kg/m^3] of a body of the mesh."""
    dK, dS = matrices.by_material(body, constant)
    return HalfSectorDerivative(dK, dS, sp.csr_array(half.B.shape), np.zeros(half.Z.shape))
