"""Matrices of a uniform round shaft.

Tension, torsion and bending with shear, twelve coordinates.
"""

import math

import numpy as np
from numpy.typing import NDArray


def beam_matrices(
    length: float, outer: float, inner: float, *, moduli: tuple[float, float], density: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Stiffness and consistent mass of a Timoshenko beam along x.

    With ``Phi = 12 E I / (kappa G A l^2)`` the bending stiffness is ``E I / (l^3 (1 + Phi)) [[12, 6
    l, ...], ...]``; the bending mass is that of the slender beam's cubic with its rotary inertia.

    Parameters
    ----------
    length, outer, inner : float
        Length, outer and inner radius [m].
    moduli : tuple of float
        Young's and shear modulus [Pa].
    density : float
        [kg/m^3].

    Returns
    -------
    K, M : ndarray, shape (12, 12)
        Six coordinates of the upwind end, then six of the downwind end.

    References
    ----------
    Przemieniecki (1968), Theory of Matrix Structural Analysis, eqs 5.116 and 11.30.
    """
    E, G = moduli
    area = math.pi * (outer**2 - inner**2)
    second = math.pi / 4.0 * (outer**4 - inner**4)
    K, M = np.zeros((12, 12)), np.zeros((12, 12))
    bar = np.array([[1.0, -1.0], [-1.0, 1.0]])
    bar_mass = np.array([[2.0, 1.0], [1.0, 2.0]]) / 6.0
    for row, stiffness, mass in (
        (0, E * area, density * area),
        (3, 2.0 * G * second, 2.0 * density * second),
    ):
        own = np.ix_([row, row + 6], [row, row + 6])
        K[own] += stiffness / length * bar
        M[own] += mass * length * bar_mass
    # Shear coefficient of a round section (Cowper 1966, nu = 0.3).
    Phi = 12.0 * E * second / (0.89 * G * area * length**2)
    bending, bending_mass = _bending(length, E * second, Phi, density * area, density * second)
    # In the plane x-y the slope is +rz, in x-z it is -ry.
    for rows, signs in (
        ([1, 5, 7, 11], [1.0, 1.0, 1.0, 1.0]),
        ([2, 4, 8, 10], [1.0, -1.0, 1.0, -1.0]),
    ):
        S = np.diag(signs)
        K[np.ix_(rows, rows)] += S @ bending @ S
        M[np.ix_(rows, rows)] += S @ bending_mass @ S
    return K, M


def _bending(
    length: float, flexural: float, Phi: float, line_mass: float, line_inertia: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Stiffness and mass for (deflection, slope) at both ends."""
    a = length
    K = np.array([
        [12.0, 6.0 * a, -12.0, 6.0 * a],
        [6.0 * a, (4.0 + Phi) * a * a, -6.0 * a, (2.0 - Phi) * a * a],
        [-12.0, -6.0 * a, 12.0, -6.0 * a],
        [6.0 * a, (2.0 - Phi) * a * a, -6.0 * a, (4.0 + Phi) * a * a],
    ])  # fmt: skip
    M = np.array([
        [156.0, 22.0 * a, 54.0, -13.0 * a],
        [22.0 * a, 4.0 * a * a, 13.0 * a, -3.0 * a * a],
        [54.0, 13.0 * a, 156.0, -22.0 * a],
        [-13.0 * a, -3.0 * a * a, -22.0 * a, 4.0 * a * a],
    ])  # fmt: skip
    rotary = np.array([
        [36.0, 3.0 * a, -36.0, 3.0 * a],
        [3.0 * a, 4.0 * a * a, -3.0 * a, -a * a],
        [-36.0, -3.0 * a, 36.0, -3.0 * a],
        [3.0 * a, -a * a, -3.0 * a, 4.0 * a * a],
    ])  # fmt: skip
    return flexural / (a**3 * (1.0 + Phi)) * K, line_mass * a / 420.0 * M + line_inertia / (
        30.0 * a
    ) * rotary
