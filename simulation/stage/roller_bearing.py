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

import numpy as np
from numpy.typing import NDArray

from carrierflex.geometry.parameters import GearData
from carrierflex.geometry.pins import pin_angles
from carrierflex.simulation.stage.roller_contact import RollerSet, roller_load
from carrierflex.simulation.stage.stage_data import RollerBearingData

#: Displacement [m] beyond the clearance at which no such bearing would be asked for its stiffness.
_LARGEST_APPROACH = 1e-2
#: CoordinateLayout of the cage over one roller pitch that make the mean stiffness.
_SET_ANGLES = 8


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
    # Half a second of import, which a run whose bearings are set does without.
    from scipy.optimize import brentq

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
    approach = brentq(lambda x: answer(x)[0] - load, 0.0, _LARGEST_APPROACH, xtol=1e-15)
    _, radial, tilt = answer(float(approach))
    return float(radial), float(tilt)
