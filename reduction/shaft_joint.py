"""Main shaft and carrier joined with an imposed misalignment: the whole rotating group.

The misalignment is that of the 2012 paper.

The shrink fit holds the carrier rigidly to the shaft, tilted by a small angle ``phi_PLC`` about the
axis at ``theta_PLC`` of the carrier's frame (paper, sections 2.1 and 3.1). The paper counts
negative rotation about ``e(theta_PLC)`` (:mod:`carrierflex.simulation`): the rim's point at the
carrier-frame angle v moves by ``R phi_PLC sin(theta_PLC - v)`` along +x, its equation (1). To first
order the tilt is a given relative motion in the joint: a constant load and a constant offset of the
carrier's pilot and sensors (:mod:`carrierflex.reduction.assembly`); the matrices do not know of it.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.fe.load_cases import radial
from carrierflex.geometry.pins import PAPER_STIFFNESS
from carrierflex.reduction.assembly import ImposedMotion, Joint, assembled, imposed_motion
from carrierflex.reduction.pin_joints import carrier_with_pins
from carrierflex.reduction.reduced_model import ReducedModel
from carrierflex.reduction.reduced_static import constrained_solution

#: Pilot at the hub's end of the main shaft, where torque and rotor loads enter.
COUPLING = "coupling_flange"
#: Pilot at the main bearing.
MAIN_BEARING = "main_bearing_seat"
#: Pilots at the carrier's bearings A (upwind) and B (downwind).
CARRIER_BEARINGS = ("upwind_seat", "downwind_seat")
_PIVOT = {MAIN_BEARING: (0, 1, 2), COUPLING: (3,)}
#: Bearings that hold the group while the misalignment bends it, in words.
SUPPORTS: Mapping[str, Mapping[str, tuple[int, ...]]] = {
    "shaft held, carrier free": {MAIN_BEARING: (0, 1, 2, 3, 4, 5)},
    "main bearing and bearing A": _PIVOT | {CARRIER_BEARINGS[0]: (1, 2)},
    "main bearing, A and B, all rigid": _PIVOT | dict.fromkeys(CARRIER_BEARINGS, (1, 2)),
}

_SHAFT_SIDE, _CARRIER_SIDE = "carrier_joint", "shaft_face"
#: Larger angles [rad] leave the small-motion frame: an error of 0.1 % in the tilt itself.
_LARGEST_TILT = 0.05


@dataclass(frozen=True)
class Misalignment:
    """How the carrier sits on the main shaft, fixed to the carrier; none by default.

    Raises
    ------
    ValueError
        Where a value is not finite or the tilt is no small angle.
    """

    phi: float = 0.0
    """phi_PLC, the tilt [rad], with the paper's sign."""
    theta: float = 0.0
    """theta_PLC, the tilt axis' angle in the carrier's frame [rad]."""
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Translation of the carrier relative to the shaft at the joint [m], carrier's frame."""

    def __post_init__(self) -> None:
        if not all(math.isfinite(value) for value in (self.phi, self.theta, *self.offset)):
            raise ValueError(
                f"misalignment {self} holds a value that is not finite; expected numbers"
            )
        if abs(self.phi) > _LARGEST_TILT:
            raise ValueError(
                f"misalignment phi is {self.phi} rad; expected a small angle, at most "
                f"{_LARGEST_TILT} rad in size (values near 0.6 mrad were measured)"
            )

    @property
    def relative_motion(self) -> NDArray[np.float64]:
        """Translation [m] and right-handed rotation [rad] of carrier to shaft, shape (6,)."""
        return np.concatenate([self.offset, -self.phi * radial(self.theta)])


@dataclass(frozen=True, eq=False)
class RotatingGroup:
    """Main shaft, carrier and, where it has them, pins in one reduced model.

    The misalignment makes constant terms.

    Parameters
    ----------
    model : ReducedModel
        Assembly in the carrier's frame. Its pilot ``shaft_face`` has the coordinates of
        ``carrier_joint``: the carrier's own motion there is larger by
        ``imposed.pilot_offset["shaft_face"]``. All other pilots are where they read.
    imposed : ImposedMotion
        Load on the right-hand side and offset of the sensors.
    misalignment : Misalignment
        What was imposed.
    """

    model: ReducedModel
    imposed: ImposedMotion
    misalignment: Misalignment

    def sensor_readings(self, q: NDArray[np.float64]) -> NDArray[np.float64]:
        """Displacement of every sensor [m], shape (n_sensors,) or (n_sensors, k).

        From coordinates (n,) or (n, k).
        """
        offset = self.imposed.sensor_offset
        return self.model.sensor_rows @ q + offset.reshape(-1, *[1] * (q.ndim - 1))


def carrier_on_shaft(
    carrier: ReducedModel, shaft: ReducedModel, misalignment: Misalignment | None = None
) -> RotatingGroup:
    """Join the main shaft and the carrier rigidly, the carrier misaligned.

    Parameters
    ----------
    carrier : ReducedModel
        Carrier, with or without pins, that has the pilot ``shaft_face``.
    shaft : ReducedModel
        Main shaft with the pilot ``carrier_joint`` at the same point.
    misalignment : Misalignment, optional
        None by default.

    Returns
    -------
    RotatingGroup
        Shaft's coordinates first, then the carrier's without those of the joint.

    Raises
    ------
    KeyError, ValueError
        Where a pilot is missing, or the bodies' pilots do not meet at one point.

    References
    ----------
    2012 paper, sections 2.1 and 3.1, equation (1).
    """
    misalignment = misalignment or Misalignment()
    bodies = [shaft, carrier]
    joints = [Joint(_SHAFT_SIDE, _CARRIER_SIDE, math.inf, math.inf)]
    model = assembled(f"{carrier.name}_on_shaft", bodies, joints)
    imposed = imposed_motion(bodies, joints, {_CARRIER_SIDE: misalignment.relative_motion})
    return RotatingGroup(model, imposed, misalignment)


def rotating_group(
    carrier: ReducedModel,
    pin: ReducedModel,
    shaft: ReducedModel,
    *,
    pin_fit: float = PAPER_STIFFNESS,
    misalignment: Misalignment | None = None,
) -> RotatingGroup:
    """Main shaft, carrier and pins: all that turns with the carrier except the planets.

    Parameters
    ----------
    carrier : ReducedModel
        Carrier without pins.
    pin : ReducedModel
        Pin 1 in the carrier's frame.
    shaft : ReducedModel
        Main shaft.
    pin_fit : float
        Bending and torsional stiffness of each pin interface [N m/rad], as in
        :func:`carrierflex.reduction.pin_joints.carrier_with_pins`.
    misalignment : Misalignment, optional
        Of the carrier on the shaft; none by default.

    Returns
    -------
    RotatingGroup
        With the pilots `COUPLING`, `MAIN_BEARING`, `CARRIER_BEARINGS`, one at every pin's mid-span
        and the carrier's rim sensors.

    Raises
    ------
    KeyError, ValueError
        As :func:`carrier_on_shaft`.
    """
    return carrier_on_shaft(carrier_with_pins(carrier, pin, pin_fit), shaft, misalignment)


def rim_swing(group: RotatingGroup, supports: Mapping[str, Sequence[int]]) -> float:
    """Amplitude of order 1 of the rim's axial displacement [m] from the misalignment.

    At rest.

    Parameters
    ----------
    group : RotatingGroup
        With the carrier's rim sensors.
    supports : mapping of str to sequence of int
        Held coordinates (0 to 5) by pilot; together they hold the group.

    Returns
    -------
    float
        ``R phi`` where nothing but the shaft is held, less where bearings hold the carrier
        straight.

    Raises
    ------
    KeyError
        Where there is no pilot of a name.
    """
    fixed = np.concatenate(
        [
            group.model.coordinates_of(pilot)[list(components)]
            for pilot, components in supports.items()
        ]
    )
    readings = group.sensor_readings(
        constrained_solution(group.model, fixed, group.imposed.load, "supports")
    )
    axial = readings[[name.startswith("rim_axial") for name in group.model.sensor_names]]
    return float(2.0 * np.abs(np.fft.rfft(axial)[1]) / len(axial))
