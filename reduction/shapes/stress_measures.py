"""What a stress over time comes to: von Mises stress, normal stress on the critical plane.

Components stand in the order of :data:`carrierflex.fe.stress_recovery.COMPONENTS`.
"""

import numpy as np
from numpy.typing import NDArray

from carrierflex.fe.stress_recovery import AXES

#: Planes among which the critical one is looked for.
_DIRECTIONS = 1000


def von_mises(stress: NDArray[np.float64]) -> NDArray[np.float64]:
    """Equivalent stress of von Mises [Pa].

    Parameters
    ----------
    stress : ndarray, shape (..., 6, m)
        Components.

    Returns
    -------
    ndarray, shape (..., m)
        Not negative.
    """
    x, y, z, yz, xz, xy = np.moveaxis(stress, -2, 0)
    squares = (x - y) ** 2 + (y - z) ** 2 + (z - x) ** 2 + 6.0 * (yz**2 + xz**2 + xy**2)
    return np.asarray(np.sqrt(squares / 2.0))


def critical_plane(stress: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Plane on which the normal stress ``nᵀ σ n`` changes most.

    An equivalent stress has no sign of its own, and one that is given to it jumps where two
    principal stresses are opposite and equal; a normal stress does not.

    Parameters
    ----------
    stress : ndarray, shape (6, m)
        Components over m instants.

    Returns
    -------
    n : ndarray, shape (3,)
        Normal of the plane, of 1000 over the half sphere: the range is at most 1 % too small.
    normal : ndarray, shape (m,)
        Normal stress on it [Pa].
    """
    n = _half_sphere()
    twice = np.where([i == j for i, j in AXES], 1.0, 2.0)
    weights = np.stack([n[:, i] * n[:, j] for i, j in AXES], axis=1) * twice
    normal = weights @ stress
    best = int(np.ptp(normal, axis=1).argmax())
    return n[best], normal[best]


def _half_sphere() -> NDArray[np.float64]:
    """Directions spread evenly over a half sphere, shape (1000, 3).

    References
    ----------
    Gonzalez (2010), Mathematical Geosciences 42, 49-64: the Fibonacci lattice.
    """
    i = np.arange(_DIRECTIONS)
    z = (i + 0.5) / _DIRECTIONS
    phi = np.pi * (3.0 - np.sqrt(5.0)) * i
    r = np.sqrt(1.0 - z**2)
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=1)
