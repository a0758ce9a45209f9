"""The consistent mass matrix of one axis.

With the positions and displacements that belong to its rows.

On a body of solid elements the mass is one scalar matrix repeated for x, y and z. Where surfaces
follow rigid pilots, the degrees of freedom are the pilots' own; their surfaces then enter by four
shape functions a pilot, 1 and the three components of ``r = x - x_0``, of which every rigid motion
is a combination.
"""

from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

if TYPE_CHECKING:
    from carrierflex.fe.structural_model import StructuralModel

#: Largest difference between the masses of two axes, over the largest entry: rounding of the
#: assembly.
_SCALAR_TOLERANCE = 1e-9
#: Nodes with rotations are looked at in dense blocks; more of them are a shell or a frame, whose
#: mass is no scalar one.
_MOST_RIGID = 300
#: Cross products, ``(a × b)_i = ε_ijk a_j b_k``.
_EPSILON = np.zeros((3, 3, 3))
_EPSILON[[0, 1, 2], [1, 2, 0], [2, 0, 1]] = 1.0
_EPSILON[[0, 2, 1], [2, 1, 0], [1, 0, 2]] = -1.0


class UnequalMassError(ValueError):
    """The mass matrix is not one scalar matrix for the three axes."""


def uniform(structure: "StructuralModel") -> NDArray[np.float64]:
    """Coefficients of a displacement of one everywhere, rows as in :func:`positions`.

    Shape (n,).
    """
    return np.concatenate(
        [np.ones(len(structure.points)), np.tile([1.0, 0.0, 0.0, 0.0], len(structure.rigid_points))]
    )


def positions(structure: "StructuralModel") -> NDArray[np.float64]:
    """Nodes, then for every rigid pilot its point and the three unit vectors.

    Shape (n, 3); node coordinates and points [m].

    ``x = x_0 + Σ r_k e_k`` on its surface.
    """
    rigid = [np.concatenate([point[None], np.eye(3)]) for point in structure.rigid_points]
    return np.concatenate([structure.points, *rigid])


def displacements(
    structure: "StructuralModel", T: NDArray[np.float64]
) -> list[NDArray[np.float64]]:
    """Displacement along x, y and z of the rows of :func:`positions`.

    Three arrays of shape (n, k) for a basis T of shape (n_dofs, k).

    ``u = t + Σ r_k (ω × e_k)`` on rigid surfaces.
    """
    n = 3 * len(structure.points)
    blocks = [T[:n].reshape(-1, 3, T.shape[1])]
    for motion in T[n:].reshape(-1, 6, T.shape[1]):
        turning = np.einsum("abk,bj->kaj", _EPSILON, motion[3:])
        blocks.append(np.concatenate([motion[None, :3], turning]))
    u = np.concatenate(blocks)
    return [np.ascontiguousarray(u[:, axis]) for axis in range(3)]


def scalar_mass(structure: "StructuralModel") -> sp.csr_array:
    """Mass matrix [kg] of one axis, rows as in :func:`positions`.

    A rigid surface's share of the reduced mass, ``Σ m Rᵀ R'`` with ``R = [1, -r~]``, holds the sums
    ``Σ m``, ``Σ m r`` and ``Σ m r r'ᵀ``, which are the masses of the shape functions 1 and r_k.

    Raises
    ------
    UnequalMassError
        Where the mass matrix differs between axes, or that of rigid points is not that of surfaces
        which follow them.
    """
    n, n_rigid = 3 * len(structure.points), len(structure.rigid_points)
    if n_rigid > _MOST_RIGID:
        raise UnequalMassError(
            f"{structure.name}: {n_rigid} nodes with rotations; expected at most {_MOST_RIGID}, in "
            "a body of solid elements"
        )
    M = sp.csr_array(structure.M)
    nodal = M[:n, :n]
    S = nodal[0::3, 0::3]
    scale = abs(S).max() if S.nnz else 1.0
    for a, b in ((1, 1), (2, 2), (0, 1), (1, 2), (0, 2)):
        difference = nodal[a::3, b::3] - S if a == b else nodal[a::3, b::3]
        if difference.nnz and abs(difference).max() > _SCALAR_TOLERANCE * scale:
            raise UnequalMassError(
                f"{structure.name}: the mass matrix differs between axes ({'xyz'[a]}{'xyz'[b]} "
                "against xx); expected the consistent mass of solid elements, alike for the three "
                "axes"
            )
    if not n_rigid:
        return sp.csr_array(S)
    mixed = M[:n, n:].toarray().reshape(-1, 3, n_rigid, 6)
    zeroth_first = np.stack(
        [mixed[:, 0, :, 0], mixed[:, 1, :, 5], mixed[:, 2, :, 3], mixed[:, 0, :, 4]], axis=-1
    )
    S_fp = sp.csr_array(zeroth_first.reshape(-1, 4 * n_rigid))
    pairs = M[n:, n:].toarray().reshape(n_rigid, 6, n_rigid, 6).transpose(0, 2, 1, 3)
    S_pp = np.block([[_rigid_pair(pairs[i, j]) for j in range(n_rigid)] for i in range(n_rigid)])
    _refuse_other_rotations(structure.name, mixed, zeroth_first, pairs, S_pp)
    return sp.csr_array(sp.block_array([[S, S_fp], [S_fp.T, sp.csr_array(S_pp)]]))


def _rigid_pair(block: NDArray[np.float64]) -> NDArray[np.float64]:
    """Masses of the functions 1, r_x, r_y, r_z of two rigid surfaces from ``Σ m Rᵀ R'``.

    One surface's functions by the other's.
    """
    pair = np.empty((4, 4))
    pair[0, 0] = block[0, 0]
    pair[0, 1:] = block[1, 5], block[2, 3], block[0, 4]
    pair[1:, 0] = block[5, 1], block[3, 2], block[4, 0]
    turning = block[3:, 3:]
    pair[1:, 1:] = (np.eye(3) * np.trace(turning) / 2.0 - turning).T
    return pair


def _refuse_other_rotations(
    name: str,
    mixed: NDArray[np.float64],
    zeroth_first: NDArray[np.float64],
    pairs: NDArray[np.float64],
    S_pp: NDArray[np.float64],
) -> None:
    """Refuse rotary masses that no surface which follows its pilot has.

    The masses of the functions 1 and r_k give those of the six coordinates back, ``Σ_a B_aᵀ S B_a``
    with the displacements B_a of the functions along the axis a.
    """
    B = np.zeros((4, 3, 6))
    B[0, [0, 1, 2], [0, 1, 2]] = 1.0
    B[1:, :, 3:] = np.einsum("abk,jb->kaj", _EPSILON, np.eye(3))
    n_rigid = len(pairs)
    blocks = S_pp.reshape(n_rigid, 4, n_rigid, 4).transpose(0, 2, 1, 3)
    again = np.einsum("kai,pqkl,laj->pqij", B, blocks, B, optimize=True)
    differences = [
        np.abs(again - pairs).max() / np.abs(pairs).max(),
        np.abs(np.einsum("npk,kai->napi", zeroth_first, B) - mixed).max(initial=0.0)
        / max(np.abs(mixed).max(initial=0.0), np.finfo(float).tiny),
    ]
    if max(differences) > _SCALAR_TOLERANCE:
        raise UnequalMassError(
            f"{name}: the rotary mass of nodes differs by {max(differences):.1e} from that of "
            "surfaces which follow them; expected lumped or solid masses"
        )
