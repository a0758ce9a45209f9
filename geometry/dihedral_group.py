"""The dihedral group D_N as matrices.

The 2 N motions that carry the carrier of N planets onto itself, and how fields follow them.

Conventions ----------- Elements are ordered as the half sector's images in
:func:`carrierflex.geometry.dihedral.completed`: number 2 k is the rotation by k pitches of the pins
(360 / N degrees each) about x, number 2 k + 1 the reflection about the pin's plane y = 0 followed
by that rotation. A field u moves as ``(g u)(x) = ρ(g) u(g⁻¹ x)``. Fields u_1 ... u_d are partners
of an irreducible representation D where ``g u_j = Σ_k D_kj(g) u_k``.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from carrierflex.geometry.dihedral import rotation_about_x

_MIRROR = np.diag([1.0, -1.0, 1.0])


@dataclass(frozen=True, eq=False)
class IrreducibleRepresentation:
    """One of the ways in which fields follow D_N.

    Parameters
    ----------
    name : str
        A1 (unchanged), A2 (reversed by reflections about the pins' planes), of an even number of
        planets B1 and B2 (reversed from pin to pin; even and odd about the pins' planes), E1, E2
        ... (pairs that turn once, twice ... as often as the carrier); the only pair of three or
        four planets is E.
    matrices : ndarray, shape (2 N, d, d)
        Orthogonal matrices D(g); d is 1, or 2 for the pairs.
    """

    name: str
    matrices: NDArray[np.float64]

    @property
    def dimension(self) -> int:
        """Number of partners d."""
        return int(self.matrices.shape[1])

    @property
    def share(self) -> float:
        """Unknowns of one partner's problem over those of the whole body, ``d / 2 N``."""
        return self.dimension / len(self.matrices)

    def projections(self, Q: NDArray[np.float64]) -> NDArray[np.float64]:
        """``P_j1 = d / 2 N Σ_g D_j1(g) Q(g)``.

        From any coordinates to those of partner j, shape (d, m, m).

        `Q`, shape (2 N, m, m), is how the coordinates follow the group.
        """
        return np.asarray(self.share * np.einsum("gj,gab->jab", self.matrices[:, :, 0], Q))

    def adapted_coordinates(self, Q: NDArray[np.float64]) -> NDArray[np.float64]:
        """Orthonormal coordinates of this kind, shape (d, m, k).

        Column c of row j is partner j of the c-th set.
        """
        P = self.projections(Q)
        eigenvalues, vectors = np.linalg.eigh((P[0] + P[0].T) / 2.0)
        first = vectors[:, eigenvalues > 0.5]
        return np.stack([first, *(P_j @ first for P_j in P[1:])])


@dataclass(frozen=True, eq=False)
class DihedralGroup:
    """Motions of a carrier onto itself and the ways in which fields follow them.

    Parameters
    ----------
    n_planets : int
        Pins N.
    motions : ndarray, shape (2 N, 3, 3)
        Rotations and reflections ρ(g) of space.
    representations : tuple of IrreducibleRepresentation
        All of them: their ``d²`` add up to 2 N.
    """

    n_planets: int
    motions: NDArray[np.float64]
    representations: tuple[IrreducibleRepresentation, ...]


@lru_cache
def dihedral_group(n_planets: int) -> DihedralGroup:
    """The group D_N of a carrier of `n_planets` equal pins."""
    motions = np.array(
        [
            rotation_about_x(2.0 * np.pi * k / n_planets) @ factor
            for k in range(n_planets)
            for factor in (np.eye(3), _MIRROR)
        ]
    )
    reversed_by_mirrors = np.linalg.det(motions).round()
    characters = {"A1": np.ones(2 * n_planets), "A2": reversed_by_mirrors}
    if n_planets % 2 == 0:
        from_pin_to_pin = np.repeat((-1.0) ** np.arange(n_planets), 2)
        characters |= {"B1": from_pin_to_pin, "B2": from_pin_to_pin * reversed_by_mirrors}
    # The pair's matrices are motions of the plane across the axis, partner 1 even about the pin's
    # plane; the pair `turns` goes round so many times while the carrier does once.
    plane = motions[:, [2, 1]][:, :, [2, 1]]
    rotation, mirrored = np.divmod(np.arange(2 * n_planets), 2)
    pairs = [
        plane[2 * (turns * rotation % n_planets) + mirrored]
        for turns in range(1, (n_planets + 1) // 2)
    ]
    names = ["E"] if len(pairs) == 1 else [f"E{turns + 1}" for turns in range(len(pairs))]
    return DihedralGroup(
        n_planets,
        motions,
        tuple(
            IrreducibleRepresentation(name, values[:, None, None])
            for name, values in characters.items()
        )
        + tuple(map(IrreducibleRepresentation, names, pairs)),
    )


@lru_cache
def no_symmetry() -> DihedralGroup:
    """The group of one motion, rest: a body without symmetry is the one image of itself."""
    unchanged = IrreducibleRepresentation("A1", np.ones((1, 1, 1)))
    return DihedralGroup(1, np.eye(3)[None], (unchanged,))


def pilot_motions(group: DihedralGroup, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """How the six coordinates of pilots at `points` follow the group.

    Parameters
    ----------
    group : DihedralGroup
        Motions of the body onto itself.
    points : ndarray, shape (p, 3)
        Positions [m].

    Returns
    -------
    ndarray, shape (2 N, 6 p, 6 p)
        Orthogonal matrices Q(g): a pilot's translation turns as ρ, its rotation as ``det(ρ) ρ``,
        and both go to its image.

    Raises
    ------
    ValueError
        Where an image of a pilot is not a pilot.
    """
    n, motions = len(points), group.motions
    Q = np.zeros((len(motions), n, 6, n, 6))
    scale = np.abs(points).max(initial=1.0)
    for number, rho in enumerate(motions):
        for i, point in enumerate(points):
            distance = np.linalg.norm(points - rho @ point, axis=1)
            j = int(distance.argmin())
            if distance[j] > 1e-9 * scale:
                raise ValueError(
                    f"pilot {i + 1} at {point.round(6).tolist()} m has no image at "
                    f"{(rho @ point).round(6).tolist()} m; expected pilots that the carrier's "
                    "symmetry maps onto one another"
                )
            Q[number, j, :3, i, :3] = rho
            Q[number, j, 3:, i, 3:] = np.linalg.det(rho) * rho
    return Q.reshape(len(motions), 6 * n, 6 * n)
