"""Bending moment of the main shaft upwind of the main bearing, as strain gauges on it read it.

Upwind of a section stand the equivalent mass of the dynamometer's coupling and the radial load, at
one distance from the main bearing (2011 paper, section 3 and figure 2).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.simulation.stage.stage_data import GRAVITY


@dataclass(frozen=True)
class EquivalentMass:
    """A point mass on the shaft, where the radial load acts.

    Parameters
    ----------
    mass : float
        [kg].
    arm : float
        Its distance upwind of the main bearing [m].
    """

    mass: float
    arm: float


@dataclass(frozen=True)
class BendingGauges:
    """Strain gauges of one section of the main shaft.

    Parameters
    ----------
    section : float
        Distance upwind of the main bearing [m].
    noise_std : float
        Standard deviation of the noise of M_y and of M_z [N m].
    """

    section: float
    noise_std: float


def shaft_bending(
    of: EquivalentMass,
    section: float,
    angle: NDArray[np.float64],
    ntl_y: NDArray[np.float64],
    ntl_z: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Moment at a section in the shaft's axes: ``(M_y, M_z) = l R(theta)^T (F_z, -F_y)``.

    With ``l = arm - section``, ``F_y = ntl_y`` and ``F_z = ntl_z - m g``: the moment
    ``(-l, 0, 0) x F`` of the forces upwind of it, which the shaft's axes turn through.

    Parameters
    ----------
    of : EquivalentMass
        The mass.
    section : float
        Distance of the gauges upwind of the main bearing [m].
    angle : ndarray, shape (n,)
        Angle of the shaft [rad].
    ntl_y, ntl_z : ndarray, shape (n,)
        Radial load [N].

    Returns
    -------
    ndarray, shape (n, 2)
        Moments about the shaft's y and z [N m]; quasi-static.
    """
    lever = of.arm - section
    M_y, M_z = lever * (ntl_z - of.mass * GRAVITY), -lever * ntl_y
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([c * M_y + s * M_z, c * M_z - s * M_y], axis=1)
