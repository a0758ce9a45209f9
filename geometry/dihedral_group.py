"""The dihedral group D3 as matrices.

The six motions that carry the planet carrier onto itself, and how fields follow them.

Conventions
-----------
Elements are ordered as the half sector's images in :func:`carrierflex.geometry.dihedral.completed`:
number 2 k is the rotation by 120 k degrees about x, number 2 k + 1 the reflection about the pin's
plane y = 0 followed by that rotation. A field u moves as ``(g u)(x) = ρ(g) u(g⁻¹ x)``. Fields u_1
... u_d are partners of an irreducible representation D where ``g u_j = Σ_k D_kj(g) u_k``.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.geometry.dihedral import rotation_about_x
from carrierflex.geometry.parameters import N_PINS

_MIRROR = np.diag([1.0, -1.0, 1.0])

#: Rotations and reflections ρ(g) of space, shape (6, 3, 3).
MOTIONS: NDArray[np.float64] = np.array(
    [
        rotation_about_x(2.0 * np.pi * k / N_PINS) @ part
        for k in range(N_PINS)
        for part in (np.eye(3), _MIRROR)
    ]
)


@dataclass(frozen=True, eq=False)
class IrreducibleRepresentation:
    """One of the ways in which fields follow D3.

    Parameters
    ----------
    name : str
        A1 (unchanged), A2 (reversed by reflections) or E (pairs).
    matrices : ndarray, shape (6, d, d)
        Orthogonal matrices D(g); d is 1, or 2 for the pairs.
    """

    name: str
    matrices: NDArray[np.float64]

    @property
    def dimension(self) -> int:
        """Number of partners d."""
        return int(self.matrices.shape[1])

    def projections(self, Q: NDArray[np.float64]) -> NDArray[np.float64]:
        """``P_j1 = d / 6 Σ_g D_j1(g) Q(g)``.

        From any coordinates to those of partner j, shape (d, m, m).

        `Q`, shape (6, m, m), is how the coordinates follow the group.
        """
        return np.asarray(
            self.dimension / len(Q) * np.einsum("gj,gab->jab", self.matrices[:, :, 0], Q)
        )

    def adapted_coordinates(self, Q: NDArray[np.float64]) -> NDArray[np.float64]:
        """Orthonormal coordinates of this kind, shape (d, m, k).

        Column c of row j is partner j of the c-th set.
        """
        P = self.projections(Q)
        eigenvalues, vectors = np.linalg.eigh((P[0] + P[0].T) / 2.0)
        first = vectors[:, eigenvalues > 0.5]
        return np.stack([first, *(P_j @ first for P_j in P[1:])])


#: The pair's matrices are the motions of the plane across the axis, partner 1 even about the pin's
#: plane.
IRREDUCIBLE_REPRESENTATIONS = (
    IrreducibleRepresentation("A1", np.ones((6, 1, 1))),
    IrreducibleRepresentation("A2", np.linalg.det(MOTIONS)[:, None, None].round()),
    IrreducibleRepresentation("E", MOTIONS[:, [2, 1]][:, :, [2, 1]]),
)


def pilot_motions(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """How the six coordinates of pilots at `points` follow the group.

    Parameters
    ----------
    points : ndarray, shape (p, 3)
        Positions [m].

    Returns
    -------
    ndarray, shape (6, 6 p, 6 p)
        Orthogonal matrices Q(g): a pilot's translation turns as ρ, its rotation as ``det(ρ) ρ``,
        and both go to its image.

    Raises
    ------
    ValueError
        Where an image of a pilot is not a pilot.
    """
    n = len(points)
    Q = np.zeros((len(MOTIONS), n, 6, n, 6))
    scale = np.abs(points).max(initial=1.0)
    for number, rho in enumerate(MOTIONS):
        for i, point in enumerate(points):
            distance = np.linalg.norm(points - rho @ point, axis=1)
            j = int(distance.argmin())
            if distance[j] > 1e-9 * scale:
                raise ValueError(
                    f"pilot {i + 1} at {point.round(6).tolist()} m has no image at {(rho @ point).round(6).tolist()} m; "
                    "expected pilots that the carrier's symmetry maps onto one another"
                )
            Q[number, j, :3, i, :3] = rho
            Q[number, j, 3:, i, 3:] = np.linalg.det(rho) * rho
    return Q.reshape(len(MOTIONS), 6 * n, 6 * n)
