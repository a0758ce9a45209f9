"""The torsional drive train of figure 12 of the 2011 paper.

Rotor, main shaft, gearbox on its bushings, generator.

Coordinates: angles of rotor, main shaft with carrier, gear train at the carrier, and housing. The
gearbox's stiffness lies between carrier and gear train; the housing turns on the bushings.

Two topologies
    ``in_one_housing``: planetary and parallel stages hang on the bushings, ``omega_HS = i omega -
    (i - 1) omega_H``; the bushings carry 0.988 of the torque. Physically right; 1.31 Hz.
    ``ring_on_bushings``: only the ring gear does, the parallel stages stand on the ground, as
    figure 12 draws it; the bushings carry 0.825 of the torque. 1.449 Hz, and with a rotor of 1.9e5
    kg m² the paper's 1.47 and 2.11, whose unit is Hz, not rad/s.

The figure prints ``omega_LS / omega_PLC = -5.71``. With the ring fixed the sun turns with the
carrier: the sign is wrong. ``planetary_ratio=-120/21`` shows what it would do: the ring's factor
becomes 6.714.

References
----------
.. [1] "Modeling of Wind Turbine Gearbox Mounting", Modeling, Identification and Control 32(4),
   2011, sections 5.2 and 5.3, figures 11 and 12.
"""

from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class TorsionalTrain:
    """Inertias, stiffnesses and ratios of figure 12.

    Parameters
    ----------
    rotor, shaft_and_carrier, low_speed, generator : float
        Inertias about their own axes [kg m²].
    shaft_stiffness, gearbox_stiffness, bushing_stiffness : float
        Torsional stiffness at the main shaft [N m/rad]; infinite where rigid.
    planetary_ratio, parallel_ratio : float
        Speed ratios 120/21 and 82/23 · 88/22 (table 4).
    housing_inertia : float
        Of the housing about x [kg m²]; the paper leaves it out.

    Raises
    ------
    ValueError
        Where an inertia or a stiffness is negative or not a number.
    """

    rotor: float = 2.0e5
    shaft_and_carrier: float = 108.0
    low_speed: float = 30.0
    generator: float = 32.0
    shaft_stiffness: float = 50e6
    gearbox_stiffness: float = 27e6
    bushing_stiffness: float = 11.4e6
    planetary_ratio: float = 120.0 / 21.0
    parallel_ratio: float = 82.0 / 23.0 * 88.0 / 22.0
    housing_inertia: float = 0.0

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            wrong = np.isnan(value) or (
                value <= 0.0 and field.name not in ("housing_inertia", "planetary_ratio")
            )
            if wrong or (field.name == "housing_inertia" and value < 0.0):
                raise ValueError(
                    f"torsional train: {field.name} is {value}; expected a positive number"
                )

    def in_one_housing(self) -> tuple[Array, Array]:
        """Mass and stiffness matrix where all stages turn with the housing on the bushings."""
        ratio = self.planetary_ratio * self.parallel_ratio
        low = np.array([0.0, 0.0, self.planetary_ratio, 1.0 - self.planetary_ratio])
        return self._matrices(low, np.array([0.0, 0.0, ratio, 1.0 - ratio]))

    def ring_on_bushings(self) -> tuple[Array, Array]:
        """Mass and stiffness matrix; only the ring gear turns with the housing, as in figure 12."""
        low = np.array([0.0, 0.0, self.planetary_ratio, 1.0 - self.planetary_ratio])
        return self._matrices(low, self.parallel_ratio * low)

    def _matrices(self, low: Array, high: Array) -> tuple[Array, Array]:
        M = np.diag([self.rotor, self.shaft_and_carrier, 0.0, self.housing_inertia])
        M += self.low_speed * np.outer(low, low) + self.generator * np.outer(high, high)
        K = np.zeros((4, 4))
        springs = (
            (self.shaft_stiffness, [1.0, -1.0, 0.0, 0.0]),
            (self.gearbox_stiffness, [0.0, 1.0, -1.0, 0.0]),
            (self.bushing_stiffness, [0.0, 0.0, 0.0, 1.0]),
        )
        for stiffness, row in springs:
            # A rigid member is one far stiffer than all others; 1e6 times keeps twelve digits of
            # the rest.
            value = min(stiffness, 1e6 * max(s for s, _ in springs if np.isfinite(s)))
            K += value * np.outer(row, row)
        return M, K


def natural_frequencies_hz(M: Array, K: Array) -> Array:
    """Natural frequencies [Hz] but the free rotation, ascending.

    Coordinates without mass give none.

    Parameters
    ----------
    M, K : ndarray, shape (n, n)
        Mass matrix, which may be singular, and stiffness matrix with one free rotation.

    Returns
    -------
    ndarray
        Finite frequencies.
    """
    # Late: help of options needs the dataclass alone.
    from scipy.linalg import eigh

    # The pencil is turned round and shifted: M may be singular, K is; K + shift M is not.
    shift = np.trace(K) / np.trace(M) * 1e-3
    inverse = eigh(M, K + shift * M, eigvals_only=True)
    finite = inverse[inverse > inverse.max() * 1e-12]
    squares = np.sort(1.0 / finite - shift)[1:]
    return np.sqrt(np.maximum(squares, 0.0)) / (2.0 * np.pi)


def mounted_and_held_hz(train: TorsionalTrain) -> dict[tuple[str, str], Array]:
    """Natural frequencies [Hz], ascending, by topology in words and by mounting.

    ``held`` (rigid) or ``on bushings``.
    """
    frequencies = {}
    for mounting, one in (
        ("held", replace(train, bushing_stiffness=np.inf)),
        ("on bushings", train),
    ):
        frequencies["all stages in one housing", mounting] = natural_frequencies_hz(
            *one.in_one_housing()
        )
        frequencies["ring gear alone on the mounting", mounting] = natural_frequencies_hz(
            *one.ring_on_bushings()
        )
    return frequencies


@dataclass(frozen=True, eq=False)
class TorqueSweep:
    """A torque that grows slowly and the rotation that it causes (figure 11).

    Parameters
    ----------
    torque, rotation : ndarray, shape (n,)
        Torque [N m] and rotation [rad].
    """

    torque: Array
    rotation: Array

    @property
    def stiffness(self) -> float:
        """Slope of torque over rotation by linear regression [N m/rad]."""
        return float(np.polynomial.Polynomial.fit(self.rotation, self.torque, 1).convert().coef[1])
