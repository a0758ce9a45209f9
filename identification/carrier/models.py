"""Models of the rim signals, axial and radial: lists of effects, linear in their coefficients.

The effects are those of :mod:`carrierflex.simulation.carrier.effects`, which the simulator adds up
and among which the diagnosis chooses; M1 and M2 of the 2012 paper are such lists.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.geometry.parameters import CarrierParameters
from carrierflex.identification.campaign.declarations import Channel
from carrierflex.simulation.carrier.effect import Effect
from carrierflex.simulation.carrier.effects.deflection import FLEXIBLE_PINS, STIFF_PINS
from carrierflex.simulation.carrier.effects.misalignment import (
    AXIAL_OFFSET,
    CARRIER_TILT,
    ECCENTRICITY,
    HOUSING_TILT,
    RADIAL_OFFSET,
)
from carrierflex.simulation.carrier.rim import CarrierRig, RimSensor, inputs_of_columns
from carrierflex.simulation.carrier.run_cases import AXIAL

Inputs = Mapping[str, NDArray[np.float64]]


@dataclass(frozen=True, eq=False)
class CarrierModel:
    """A sum of effects.

    Parameters
    ----------
    name : str
        ``m1``, ``m2`` or another name.
    effects : tuple of Effect
        Terms of the sum.
    rig : CarrierRig
        Curves and pin angle from which the effects are computed.
    """

    name: str
    effects: tuple[Effect, ...]
    rig: CarrierRig

    @property
    def coefficients(self) -> tuple[str, ...]:
        """Names of the linear coefficients, effect by effect."""
        return tuple(parameter.name for effect in self.effects for parameter in effect.parameters)

    @property
    def shared(self) -> tuple[bool, ...]:
        """Whether each coefficient has one value for all runs."""
        return tuple(not effect.per_run for effect in self.effects for _ in effect.parameters)

    def each_run(self) -> "CarrierModel":
        """Copy whose effects all have values of their own in every run."""
        return replace(self, effects=tuple(effect.each_run() for effect in self.effects))

    def design(self, inputs: Inputs, channel: Channel) -> NDArray[np.float64]:
        """Design matrix of one channel: signal = design @ coefficients.

        Parameters
        ----------
        inputs : mapping of str to ndarray, shape (n,)
            ``carrier_angle`` [rad] and ``torque`` [N m].
        channel : Channel
            Rim sensor.

        Returns
        -------
        ndarray, shape (n, n_coefficients)
            Signal per unit of each coefficient [m per unit].
        """
        sensor = rim_sensor(channel)
        columns = inputs_of_columns(inputs)
        rows = [effect.signals(sensor, columns, self.rig) for effect in self.effects]
        return np.ascontiguousarray(np.concatenate(rows).T)


def rim_sensor(channel: Channel) -> RimSensor:
    """Angle, radius and direction of a rim sensor.

    Raises
    ------
    ValueError
        Where the channel has no angle or radius.
    """
    if channel.angle is None or channel.radius is None:
        raise ValueError(
            f"channel {channel.name}: angle and radius are not given; expected those of a rim "
            "sensor"
        )
    return RimSensor(channel.angle, channel.radius, channel.quantity == AXIAL)


def _rig(curves: Mapping[str, DeflectionCurve], pin_angle: float = 0.0) -> CarrierRig:
    """Rig of effects that use neither the nominal torque nor number and radius of the pins."""
    return CarrierRig(
        nominal_torque=np.nan,
        n_planets=CarrierParameters.n_planets,
        pin_radius=np.nan,
        curves=curves,
        pin_angle=pin_angle,
    )


def rigid_model() -> CarrierModel:
    """Build model M1: offset and tilt against the housing by run, tilt against the shaft shared.

    Returns
    -------
    CarrierModel
        Five parameters a run: d_x, phi_H, theta_H, phi_PLC, theta_PLC.

    References
    ----------
    .. [1] 2012 paper, equation (1).
    """
    return CarrierModel("m1", (AXIAL_OFFSET, HOUSING_TILT.each_run(), CARRIER_TILT), _rig({}))


def flexible_model(
    delta_s: DeflectionCurve, delta_f: DeflectionCurve, pin_angle: float = 0.0
) -> CarrierModel:
    """Build model M2: M1 and the two deflection curves, their scales shared by all runs.

    Parameters
    ----------
    delta_s, delta_f : DeflectionCurve
        Stiff and flexible curve.
    pin_angle : float
        Carrier-frame angle theta_rho of pin 1 [rad]; zero by the contract's definition of the
        carrier angle.

    Returns
    -------
    CarrierModel
        Seven parameters a run: those of M1, rho_s, rho_f.

    References
    ----------
    .. [1] 2012 paper, equation (7) (its section 2.2 says "eq. (5)"; a misprint).
    """
    rig = _rig({"delta_s": delta_s, "delta_f": delta_f}, pin_angle)
    return CarrierModel("m2", (*rigid_model().effects, STIFF_PINS, FLEXIBLE_PINS), rig)


def with_radial_motion(model: CarrierModel) -> CarrierModel:
    """Add the rigid radial motion that radial sensors need.

    An offset a run, and an eccentricity of the target face.

    Parameters
    ----------
    model : CarrierModel
        M1 or M2.

    Returns
    -------
    CarrierModel
        Four parameters more: d_y and d_z [m] by run, e_PLC [m] and theta_e [rad] shared; the
        deflection scales of M2 serve axial and radial signals alike.
    """
    return replace(model, effects=(*model.effects, RADIAL_OFFSET, ECCENTRICITY))
