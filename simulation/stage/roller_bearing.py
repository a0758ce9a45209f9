"""Planet bearings roller by roller.

Line contacts with clearance, each roller at its place, cut into slices along its length.

A slice at x of the roller at the angle phi, about the bearing's axis from z, is pressed by

``delta = sin(phi) (y + x rz) - cos(phi) (z - x ry) - c - 2 P(x)``

with the motion (y, z, ry, rz) of the planet against its pin, the radial clearance c (half the
diametral one) and the roller's profile P. It pushes with ``k delta^(10/9)``, its share of ``c_L =
35948 L^(8/9)`` (N and mm). The cage turns with the planet:

``phi = phi_0 - z_r/z_p (1 + D_we/D_pw)/2 theta``, pure rolling on the standing inner race, in the
carrier's frame.

References
----------
Palmgren (1959), Ball and Roller Bearing Engineering; ISO/TS 16281:2008, eqs (33)-(40).
"""

import math
from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np
import scipy.optimize
from numpy.typing import NDArray

from carrierflex.geometry.parameters import GearData, pin_angles
from carrierflex.simulation.stage.roller_contact import RollerSet, roller_load

#: ISO/TS 16281: spring constant of a roller between both races, steel on steel [N/mm^(10/9)] times
#: L^(8/9) in mm.
_LINE_CONTACT = 35948.0
#: Exponent of the line contact's law.
EXPONENT = 10.0 / 9.0
#: Displacement [m] beyond the clearance at which no such bearing would be asked for its stiffness.
_LARGEST_APPROACH = 1e-2
#: CoordinateLayout of the cage over one roller pitch that make the mean stiffness.
_SET_ANGLES = 8


@dataclass(frozen=True)
class RollerBearingData:
    """Rollers of a planet's two bearings NJ 2232; their inner geometry is not published.

    Raises
    ------
    ValueError
        Where a dimension is not positive, rollers overlap, or a count is not positive.
    """

    n_rollers: int = 17
    """Chosen: in a row; with length and diameter this gives the static rating of 1.2 MN usual for
    the size (ISO 76)."""
    n_rows: int = 2
    """GRC: PL-A and PL-B."""
    row_spacing: float = 0.080
    """GRC: width of one bearing [m]; the rows stand side by side."""
    roller_diameter: float = 0.036
    """Chosen: D_we [m], see n_rollers."""
    roller_length: float = 0.053
    """Chosen: effective length L_we [m], see n_rollers."""
    pitch_diameter: float = 0.229
    """Chosen: D_pw [m], inner race of 193 mm and a roller."""
    n_slices: int = 3
    """Chosen: slices of a roller, at the points and with the widths of Gauss-Legendre quadrature; 2
    % off at 1 mrad."""
    profile: float = 0.0
    """Chosen: straight rollers. ISO/TS 16281 proposes ``P = 0.00035 D_we ln(1/(1 - (2x/L_we)^2))``,
    this factor 0.00035."""
    reference_load: float = 390e3
    """Derived: pin load at 360 kN m [N]; the linear part of the equations takes the stiffness that
    the bearing has there."""

    def __post_init__(self) -> None:
        for entry in fields(self):
            value = getattr(self, entry.name)
            if not (
                math.isfinite(value) and (value > 0.0 or (value == 0.0 and entry.name == "profile"))
            ):
                raise ValueError(
                    f"RollerBearingData.{entry.name} is {value!r}; expected a positive number"
                )
        if self.n_rollers * math.asin(self.roller_diameter / self.pitch_diameter) > math.pi:
            raise ValueError(
                f"RollerBearingData: {self.n_rollers} rollers of {self.roller_diameter} m overlap "
                "on a pitch circle of "
                f"{self.pitch_diameter} m; expected fewer or smaller ones"
            )

    @property
    def roller_stiffness(self) -> float:
        """``c_L`` of one roller between both races [N/m^(10/9)]."""
        return _LINE_CONTACT * (1e3 * self.roller_length) ** (8.0 / 9.0) * 1e3**EXPONENT

    @property
    def static_rating(self) -> float:
        """Basic static load rating of one row [N] (ISO 76:2006, eq. 17)."""
        D, L = 1e3 * self.roller_diameter, 1e3 * self.roller_length
        return 44.0 * (1.0 - self.roller_diameter / self.pitch_diameter) * self.n_rollers * L * D

    def cage_ratio(self, gear: GearData) -> float:
        """Turn of the cage in the carrier's frame over the carrier's turn.

        The planet's by -z_r/z_p, half of it rolls off.
        """
        rolling = 0.5 * (1.0 + self.roller_diameter / self.pitch_diameter)
        return -gear.ring_teeth / gear.planet_teeth * rolling

    @cached_property
    def slices(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Axial place [m] from the bearing's middle, share of a roller, profile on both races [m].

        Shapes (rows * slices,).
        """
        point, weight = np.polynomial.legendre.leggauss(self.n_slices)
        middles = self.row_spacing * (np.arange(self.n_rows) - 0.5 * (self.n_rows - 1))
        x = (middles[:, None] + 0.5 * self.roller_length * point).ravel()
        drop = 2.0 * self.profile * self.roller_diameter * np.log(1.0 / (1.0 - point**2))
        return x, np.tile(weight / 2.0, self.n_rows), np.tile(drop, self.n_rows)


def roller_set(
    data: RollerBearingData,
    gear: GearData,
    clearance: float,
    factors: tuple[float, ...],
) -> RollerSet:
    """Rollers of the planets.

    The first roller of every planet stands on the line from the carrier's axis at the carrier angle
    0, both rows in step: the symmetric stage stays symmetric, and the rollers' passing shows at its
    strongest.

    Parameters
    ----------
    data : RollerBearingData
        Rollers.
    gear : GearData
        Teeth, for the cage's speed.
    clearance : float
        Radial clearance [m].
    factors : tuple of float
        Stiffness of each planet's bearing over the nominal one, one a planet.
    """
    x, share, drop = data.slices
    pitch = 2.0 * np.pi * np.arange(data.n_rollers) / data.n_rollers
    angles = np.asarray(pin_angles(len(factors)), np.float64)[:, None] + pitch
    return RollerSet(
        directions=np.stack([np.cos(angles), np.sin(angles)], axis=-1),
        cage=data.cage_ratio(gear),
        x=x,
        stiffness=np.asarray(factors, np.float64)[:, None] * data.roller_stiffness * share,
        gap=clearance + drop,
    )


def no_rollers() -> RollerSet:
    """Set of no bearings, for springs instead."""
    return RollerSet(np.zeros((0, 1, 2)), 0.0, np.zeros(1), np.zeros((0, 1)), np.zeros(1))


def stiffness_at(rollers: RollerSet, load: float) -> tuple[float, float]:
    """Radial [N/m] and tilting stiffness [N m/rad] of planet 1's bearing, mean of a cage's turn.

    Parameters
    ----------
    rollers : RollerSet
        From :func:`roller_set`.
    load : float
        Radial load [N].

    Raises
    ------
    ValueError
        Where the load is not positive, or larger than such a bearing can carry.
    """
    angles = (
        2.0
        * np.pi
        / (rollers.directions.shape[1] * rollers.cage)
        * np.arange(_SET_ANGLES)
        / _SET_ANGLES
    )

    def answer(approach: float) -> NDArray[np.float64]:
        """Load [N], radial and tilting stiffness at an approach [m], mean over the cage's turn."""
        force = np.zeros(4)
        tangent = np.zeros((4, 4))
        motion = np.array([0.0, -approach, 0.0, 0.0])
        total = np.zeros(3)
        for angle in angles:
            roller_load(rollers, 0, motion, float(angle), force, tangent)
            total += np.array([-force[1], tangent[1, 1], tangent[2, 2]]) / _SET_ANGLES
        return total

    if not (load > 0.0 and answer(_LARGEST_APPROACH)[0] > load):
        raise ValueError(
            f"load on the planet bearing is {load} N; expected a positive one that its rollers can "
            "carry"
        )
    approach = scipy.optimize.brentq(
        lambda x: answer(x)[0] - load, 0.0, _LARGEST_APPROACH, xtol=1e-15
    )
    _, radial, tilt = answer(float(approach))
    return float(radial), float(tilt)
