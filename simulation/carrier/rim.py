"""What the signal of an effect at the carrier's rim depends on: sensor, inputs of a run, rig."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.fe.deflection_curves import DeflectionCurve

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class RimSensor:
    """Housing angle [rad], radius [m] and direction of a rim sensor."""

    angle: float
    radius: float
    is_axial: bool


@dataclass(frozen=True, eq=False)
class CarrierInputs:
    """Inputs of one run, or of part of it.

    Parameters
    ----------
    time, carrier_angle, torque, ntl_y, ntl_z : ndarray, shape (n,)
        [s], [rad], [N m], [N], [N].
    start, end : float or ndarray, shape (n,)
        First and last time of the whole run [s]; of samples of several runs those of each sample.
    """

    time: FloatArray
    carrier_angle: FloatArray
    torque: FloatArray
    ntl_y: FloatArray
    ntl_z: FloatArray
    start: float | FloatArray
    end: float | FloatArray


def inputs_of_columns(columns: Mapping[str, FloatArray]) -> CarrierInputs:
    """Inputs from columns by name; one that is missing is not a number, so that no effect uses it.

    Parameters
    ----------
    columns : mapping of str to ndarray, shape (n,)
        ``carrier_angle`` [rad], and any of ``torque`` [N m], ``ntl_y``, ``ntl_z`` [N] and
        ``time`` [s].
    """
    angle = columns["carrier_angle"]
    unknown = np.broadcast_to(np.nan, angle.shape)
    time = columns.get("time", unknown)
    return CarrierInputs(
        time=time,
        carrier_angle=angle,
        torque=columns.get("torque", unknown),
        ntl_y=columns.get("ntl_y", unknown),
        ntl_z=columns.get("ntl_z", unknown),
        start=float(time[0]) if time.size else np.nan,
        end=float(time[-1]) if time.size else np.nan,
    )


@dataclass(frozen=True, eq=False)
class CarrierRig:
    """Constants of a rig.

    Parameters
    ----------
    nominal_torque : float
        Nominal torque [N m].
    n_planets : int
        Planets, and pins.
    pin_radius : float
        Radius of the pin circle [m].
    curves : mapping of str to DeflectionCurve
        ``delta_s``, ``delta_f`` and, where uneven pin loads are computed, ``g_f``.
    pin_angle : float
        Carrier-frame angle theta_rho of pin 1 [rad]; zero by the definition of the carrier angle.
    """

    nominal_torque: float
    n_planets: int
    pin_radius: float
    curves: Mapping[str, DeflectionCurve]
    pin_angle: float = 0.0

    def pins_at(self, carrier_angle: FloatArray) -> FloatArray:
        """Housing angle of pin 1 [rad]."""
        return carrier_angle + self.pin_angle
