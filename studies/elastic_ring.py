"""A ring gear that bends in its plane and out of it, on two torque arms, under its planets.

Sections stay plane (Timoshenko). Displacements U and rotations Omega along x, outwards r and around
t are Fourier series over the housing's angle, ``Σ_n q_n exp(j n theta)`` with ``|n| <= N``, so that
the energy splits into harmonics (Rayleigh-Ritz):

    ``gamma = (dU/dtheta)/R - Omega x e_t``,   ``kappa = (dOmega/dtheta)/R``
    ``K_n = 2 pi R B_n^H C B_n``

and the springs of the arms join them. Harmonics 0 and 1 hold the six rigid motions.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag, solve

#: Places of displacements and rotations among a section's six motions.
U_X, U_R, U_T, OMEGA_X, OMEGA_R, OMEGA_T = range(6)


@dataclass(frozen=True)
class RingSection:
    """Rectangular section of a ring, its material and the covers bolted to both ends."""

    inner_diameter: float = 1.047
    """GRC: root circle of the ring (NREL/TP-500-47773) [m]; teeth carry nothing around."""
    outer_diameter: float = 1.166
    """GRC: pilot of the ring in the rear housing [m]. 1.18 by the mass of 509 kg."""
    width: float = 0.230
    """GRC: face width of the ring [m]."""
    youngs_modulus: float = 210e9
    """Steel [Pa]."""
    poisson_ratio: float = 0.3
    """Steel."""
    cover_stiffness: float = 0.0
    """Of each cover in its plane against harmonics 2 and above, per length around [N/m^2].

    Chosen: 0, a free ring. A closed plate of cast iron has about E t / R, 4.3e9 at 15 mm."""

    @property
    def radius(self) -> float:
        """Of the section's middle [m]."""
        return 0.25 * (self.inner_diameter + self.outer_diameter)

    @property
    def height(self) -> float:
        """Thickness along r [m]."""
        return 0.5 * (self.outer_diameter - self.inner_diameter)

    @property
    def stiffness(self) -> NDArray[np.float64]:
        """``G A/k, G A/k, E A, E I_x, E I_r, G J`` of the strains along x, r, t, shape (6,).

        Shear factor 5/6; torsion of a rectangle (Roark's Formulas, table 10.7).
        """
        b, h, E = self.width, self.height, self.youngs_modulus
        G, area = E / (2.0 * (1.0 + self.poisson_ratio)), b * h
        short, long = min(b, h), max(b, h)
        ratio = short / long
        J = long * short**3 * (1.0 / 3.0 - 0.21 * ratio * (1.0 - ratio**4 / 12.0))
        shear = 5.0 / 6.0 * G * area
        return np.array([shear, shear, E * area, E * b * h**3 / 12.0, E * h * b**3 / 12.0, G * J])


def harmonic_stiffness(section: RingSection, n: int) -> NDArray[np.complex128]:
    """Stiffness of the harmonic n of a ring without supports, shape (6, 6) [N/m, N, N m].

    Parameters
    ----------
    section : RingSection
        The ring.
    n : int
        Waves around.
    """
    R = section.radius
    B = np.zeros((6, 6), complex)
    B[0, [U_X, OMEGA_R]] = 1j * n / R, -1.0
    B[1, [U_R, U_T, OMEGA_X]] = 1j * n / R, -1.0 / R, 1.0
    B[2, [U_T, U_R]] = 1j * n / R, 1.0 / R
    B[3, OMEGA_X] = 1j * n / R
    B[4, [OMEGA_R, OMEGA_T]] = 1j * n / R, -1.0 / R
    B[5, [OMEGA_T, OMEGA_R]] = 1j * n / R, 1.0 / R
    C = section.stiffness.astype(complex)
    K: NDArray[np.complex128] = 2.0 * np.pi * R * (B.conj().T * C) @ B
    if abs(n) >= 2:
        # Both covers at x = -+b/2 resist what their edges move along r and t.
        lever = (0.5 * section.width) ** 2
        of_covers = 2.0 * section.cover_stiffness * np.array([0.0, 1.0, 1.0, 0.0, lever, lever])
        K += 2.0 * np.pi * R * np.diag(of_covers)
    return K


@dataclass(frozen=True)
class PointForce:
    """Force on a ring.

    Parameters
    ----------
    angle : float
        Housing angle [rad].
    force : tuple of float
        Along x, r and t [N].
    x, r : float
        Its place from the section's middle [m].
    """

    angle: float
    force: tuple[float, float, float]
    x: float = 0.0
    r: float = 0.0


@dataclass(frozen=True)
class PointSpring:
    """Spring to the ground at the end of a rigid lever.

    Parameters
    ----------
    angle : float
        Housing angle of the section that the lever stands on [rad].
    stiffness : tuple of float
        Along x, r and t of that angle [N/m].
    x, r : float
        Its place from the section's middle [m].
    """

    angle: float
    stiffness: tuple[float, float, float]
    x: float = 0.0
    r: float = 0.0


def _motion(angle: float, n: NDArray[np.int64], x: float, r: float) -> NDArray[np.complex128]:
    """Motion along x, r, t of a point on a section by the harmonics, shape (3, 6 n_harmonics)."""
    # u + omega x p with p = (x, r, 0).
    turned = [[0.0, 0.0, -r], [0.0, 0.0, x], [r, -x, 0.0]]
    return np.kron(np.exp(1j * n * angle), np.hstack([np.eye(3), turned]))


@dataclass(frozen=True, eq=False)
class Ring:
    """A ring on its springs.

    Parameters
    ----------
    n : ndarray of int, shape (2 N + 1,)
        Harmonics.
    K : ndarray of complex, shape (6 (2 N + 1), 6 (2 N + 1))
        Stiffness.
    """

    n: NDArray[np.int64]
    K: NDArray[np.complex128]

    def answer(self, loads: Sequence[Sequence[PointForce]]) -> NDArray[np.complex128]:
        """Harmonics of the motion under sets of forces, shape (6 (2 N + 1), n_sets) [m, rad]."""
        f = np.zeros((len(self.K), len(loads)), complex)
        for i, forces in enumerate(loads):
            for at in forces:
                f[:, i] += _motion(at.angle, self.n, at.x, at.r).conj().T @ np.array(at.force)
        return np.asarray(solve(self.K, f, assume_a="her"))

    def motion(
        self, q: NDArray[np.complex128], angle: float, x: float = 0.0, r: float = 0.0
    ) -> NDArray[np.float64]:
        """Motion along x, r and t of a point, shape (3, n_sets) [m], without the rigid motions.

        Parameters
        ----------
        q : ndarray of complex, shape (6 (2 N + 1), n_sets)
            Harmonics of the motion; 0 and 1 are left out.
        angle : float
            Housing angle of the section that carries the point [rad].
        x, r : float
            Its place from the section's middle [m].
        """
        bent = np.repeat(np.abs(self.n) >= 2, 6)
        return np.asarray(((_motion(angle, self.n, x, r) * bent) @ q).real)


def ring_on_springs(section: RingSection, springs: Sequence[PointSpring], highest: int) -> Ring:
    """Ring of harmonics up to the highest on springs.

    Parameters
    ----------
    section : RingSection
        The ring.
    springs : sequence of PointSpring
        What keeps it in place.
    highest : int
        Highest harmonic N.
    """
    n = np.arange(-highest, highest + 1)
    K = block_diag(*(harmonic_stiffness(section, int(of)) for of in n))
    for spring in springs:
        motion = _motion(spring.angle, n, spring.x, spring.r)
        K += (motion.conj().T * np.array(spring.stiffness)) @ motion
    return Ring(n, K)
