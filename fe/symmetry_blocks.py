"""The carrier's finite elements as independent blocks, assembled from its half sector alone.

A displacement that follows an irreducible representation of D_N
(:mod:`carrierflex.geometry.dihedral_group`) is known everywhere from its d partners u_1 ... u_d on
the half sector: ``u_j(g x) = ρ(g) Σ_k D_jk(g) u_k(x)``. Energies of different representations, and
of different partners, do not mix, and with ``U_j = √(d/2N) T_j z`` one partner's is

    zᵀ K_b z,   K_b = Σ_j T_jᵀ K_half T_j,

K_half the half sector's own matrix. T picks the displacements that the symmetry admits on the cut
planes: a node that stays where it is under g has ``ρ(g) u_j = Σ_k D_kj(g) u_k``. There it ties the
two partners of a pair to one another; elsewhere it is the identity. Of a body of n unknowns and
three planets the blocks have n/6, n/6 and n/3; of four planets four have n/8 and one n/4. A pair's
serves both partners, which have equal matrices.
"""

import functools
import operator
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from carrierflex.fe.assembly import assemble_stiffness_and_mass
from carrierflex.fe.materials import BODY_MATERIALS, Material
from carrierflex.fe.node_dofs import dofs_of
from carrierflex.fe.structural_model import StructuralModel
from carrierflex.fe.surface_integrals import rigid_motion, surface_moments
from carrierflex.geometry.dihedral_group import (
    DihedralGroup,
    IrreducibleRepresentation,
    pilot_motions,
)
from carrierflex.geometry.tet_mesh import TetMesh

#: Distance [m] within which a node counts as staying where it is under a motion of the group.
_SAME_POINT = 1e-9


@dataclass(frozen=True, eq=False)
class HalfSector:
    """The half sector of a body with dihedral symmetry, and its share of the couplings.

    Parameters
    ----------
    structure : StructuralModel
        The half sector alone: its K, M and nodes, no pilots.
    pilots : mapping of str to ndarray, shape (3,)
        All p pilots of the whole body [m], in the order of the reduced coordinates.
    B : csr_array, shape (6 p, n_dofs)
        The half sector's share of ``∫ Rᵀ N dA`` over every pilot's surface.
    Z : ndarray, shape (6 p, 6 p)
        ``∫ Rᵀ R dA`` over the whole surfaces.
    group : DihedralGroup
        Motions that carry the half sector to its images.
    """

    structure: StructuralModel
    pilots: Mapping[str, NDArray[np.float64]]
    B: sp.csr_array
    Z: NDArray[np.float64]
    group: DihedralGroup

    @property
    def pilot_points(self) -> NDArray[np.float64]:
        """Positions of all pilots [m], shape (p, 3)."""
        return np.array(list(self.pilots.values()), dtype=np.float64)

    @property
    def pilot_motions(self) -> NDArray[np.float64]:
        """How the pilots' coordinates follow the group, shape (2 N, 6 p, 6 p)."""
        return pilot_motions(self.group, self.pilot_points)


@dataclass(frozen=True, eq=False)
class SymmetryBlock:
    """The body's problem for displacements of one irreducible representation, n unknowns.

    Parameters
    ----------
    representation : IrreducibleRepresentation
        How the displacement follows the group, d partners.
    K, M : csr_array, shape (n, n)
        Stiffness [N/m] and mass [kg] of either partner over the whole body.
    G : csr_array, shape (m, n)
        Motion of the pilots in this block's coordinates.
    pilot_coordinates : ndarray, shape (d, 6 p, m)
        These coordinates in terms of the pilots' own, orthonormal; one set for each partner.
    rigid_modes : ndarray, shape (n, k)
        Rigid motions of the body that follow this representation, k at most 2.
    T : csr_array, shape (d n_half, n)
        ``T_j``, one below the other.
    """

    representation: IrreducibleRepresentation
    K: sp.csr_array
    M: sp.csr_array
    G: sp.csr_array
    pilot_coordinates: NDArray[np.float64]
    rigid_modes: NDArray[np.float64]
    T: sp.csr_array

    def partners(self, z: NDArray[np.float64]) -> NDArray[np.float64]:
        """Displacement of each partner on the half sector from unknowns z (n, c).

        The result has the shape (d, n_half, c).
        """
        d = self.representation.dimension
        return np.asarray(np.sqrt(self.representation.share) * (self.T @ z)).reshape(
            d, self.T.shape[0] // d, z.shape[1]
        )

    def unknowns(self, partners: NDArray[np.float64]) -> NDArray[np.float64]:
        """Unknowns z (n, c) whose :meth:`partners` are `partners`, shape (d, n_half, c)."""
        stacked = partners.reshape(self.T.shape[0], partners.shape[2])
        return np.asarray(self.T.T @ stacked) / np.sqrt(self.representation.share)


def half_sector(
    name: str,
    half: TetMesh,
    pilots: Mapping[str, NDArray[np.float64]],
    group: DihedralGroup,
    *,
    materials: Mapping[str, Material] = BODY_MATERIALS,
) -> HalfSector:
    """Assemble the half sector and integrate its share of every distributing coupling.

    Parameters
    ----------
    name : str
        Name of the whole body.
    half : TetMesh
        Half sector with the parts of the surfaces that it holds.
    pilots : mapping of str to ndarray, shape (3,)
        All pilots of the whole body [m], named like their surfaces.
    group : DihedralGroup
        Motions that carry the half sector to its images.
    materials : mapping
        Material of every body of the mesh.

    Raises
    ------
    ValueError
        Where the pilots do not map onto one another, or neither a pilot nor an image of it has a
        surface in the half sector.
    """
    points = np.array(list(pilots.values()), dtype=np.float64)
    Q = pilot_motions(group, points)
    shares, Z_half = [], np.zeros((6 * len(pilots), 6 * len(pilots)))
    for i, (pilot, point) in enumerate(pilots.items()):
        B, Z = surface_moments(
            half, half.surfaces.get(pilot, np.zeros((0, 6), dtype=np.int64)), point
        )
        shares.append(sp.csr_array(B.reshape(6, -1)))
        Z_half[6 * i : 6 * i + 6, 6 * i : 6 * i + 6] = Z
    Z_body = np.einsum("gab,bc,gdc->ad", Q, Z_half, Q, optimize=True)
    for i, pilot in enumerate(pilots):
        if not np.diagonal(Z_body)[6 * i : 6 * i + 6].all():
            raise ValueError(
                f"pilot {pilot!r} has no surface in the half sector, nor has an image of it; the "
                f"half sector has {', '.join(sorted(half.surfaces))}"
            )
    K, M = assemble_stiffness_and_mass(half, materials)
    return HalfSector(
        StructuralModel(name, K, M, half.points, ()),
        dict(pilots),
        sp.csr_array(sp.vstack(shares)),
        Z_body,
        group,
    )


def symmetry_block(half: HalfSector, representation: IrreducibleRepresentation) -> SymmetryBlock:
    """The body's problem for displacements that follow `representation`.

    The coupling is the body's own: of the images' shares only ``√(2N/d) Σ_j X_jᵀ Z⁻¹ B T_j`` is
    left, X the pilots' coordinates of this kind.
    """
    structure = half.structure
    T = _admitted_displacements(structure.points, half.group, representation)
    components = [
        T[j * structure.n_dofs : (j + 1) * structure.n_dofs]
        for j in range(representation.dimension)
    ]
    X = representation.adapted_coordinates(half.pilot_motions)
    scale, shape = np.sqrt(1.0 / representation.share), (X.shape[2], T.shape[1])
    mean = np.linalg.inv(half.Z)
    G = sum(
        (sp.csr_array(X_j.T @ mean) @ half.B @ T_j for X_j, T_j in zip(X, components, strict=True)),
        start=sp.csr_array(shape),
    )
    return SymmetryBlock(
        representation=representation,
        K=_energy(structure.K, components),
        M=_energy(structure.M, components),
        G=sp.csr_array(scale * G),
        pilot_coordinates=X,
        rigid_modes=_rigid_modes(half, representation, T),
        T=T,
    )


def _energy(matrix: sp.csr_array, components: list[sp.csr_array]) -> sp.csr_array:
    """``Σ_j T_jᵀ A T_j``, symmetric to rounding."""
    return functools.reduce(
        operator.add, (sp.csr_array(T_j.T) @ matrix @ T_j for T_j in components)
    )


def _rigid_modes(
    half: HalfSector, representation: IrreducibleRepresentation, T: sp.csr_array
) -> NDArray[np.float64]:
    """Rigid motions about a point of the axis, as unknowns of the block."""
    points = half.structure.points
    centre = np.array([[points[:, 0].mean(), 0.0, 0.0]])
    X = representation.adapted_coordinates(pilot_motions(half.group, centre))
    R = rigid_motion(points, centre[0]).reshape(-1, 6)
    return np.asarray(
        np.sqrt(1.0 / representation.share) * (T.T @ np.concatenate([R @ X_j for X_j in X]))
    )


def _admitted_displacements(
    points: NDArray[np.float64], group: DihedralGroup, representation: IrreducibleRepresentation
) -> sp.csr_array:
    """Orthonormal basis of the partners' displacements that the symmetry admits.

    T has the shape (3 d n, n_unknowns).
    """
    n, d = len(points), representation.dimension
    moved = [np.linalg.norm(points @ rho.T - points, axis=1) for rho in group.motions]
    stays = np.stack([distance < _SAME_POINT for distance in moved], axis=1)
    kinds, kind = np.unique(stays, axis=0, return_inverse=True)
    bases = [_fixed_space(group, representation, stabiliser) for stabiliser in kinds]
    first = np.concatenate([[0], np.cumsum(np.array([basis.shape[1] for basis in bases])[kind])])
    rows = []
    columns = []
    values = []
    for number, basis in enumerate(bases):
        nodes = np.flatnonzero(kind == number)
        entry, column = np.nonzero(basis)
        partner, axis = np.divmod(entry, 3)
        dofs = dofs_of(n * partner + nodes[:, None])
        rows.append(dofs[:, np.arange(len(axis)), axis].ravel())
        columns.append((first[nodes][:, None] + column).ravel())
        values.append(np.tile(basis[entry, column], len(nodes)))
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    return sp.csr_array(entries, shape=(3 * n * d, int(first[-1])))


def _fixed_space(
    group: DihedralGroup,
    representation: IrreducibleRepresentation,
    stabiliser: NDArray[np.bool_],
) -> NDArray[np.float64]:
    """Orthonormal basis of the values at a node that the motions of `stabiliser` leave in place.

    Shape (3 d, k), partner by partner.
    """
    stay = np.flatnonzero(stabiliser)
    images = [np.kron(representation.matrices[g], group.motions[g]) for g in stay]
    P = np.mean(images, axis=0)
    eigenvalues, vectors = np.linalg.eigh((P + P.T) / 2.0)
    basis = vectors[:, eigenvalues > 0.5]
    return np.where(np.abs(basis) > 1e-14, basis, 0.0)
