"""Models of the rim signals, axial and radial.

Sets of physical effects, each linear in its coefficients.

An effect is a few signal patterns of :mod:`carrierflex.simulation.carrier.kinematics`; a model is a
list of effects. M1 and M2 of the 2012 paper and every candidate of the diagnosis are such lists.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.identification.campaign.campaign import Channel
from carrierflex.simulation.carrier.kinematics import (
    axial_deflection_pattern,
    carrier_offset_pattern,
    carrier_tilt_pattern,
    housing_offset_pattern,
    housing_tilt_pattern,
    offset_pattern,
    radial_deflection_pattern,
    saddle_pattern,
)
from carrierflex.simulation.carrier.run_cases import AXIAL

Inputs = Mapping[str, NDArray[np.float64]]
Pattern = Callable[[Inputs, Channel], NDArray[np.float64]]


@dataclass(frozen=True, eq=False)
class Effect:
    """One physical effect.

    Parameters
    ----------
    name : str
        Effect id of the campaign contract.
    patterns : tuple of callable
        Signal per unit of each coefficient, ``(inputs, channel) -> ndarray, shape (n,)`` [m per
        unit].
    parameters, units : tuple of str
        Published parameters and their units.
    polar : bool
        The two coefficients are ``(phi cos theta, phi sin theta)`` of the parameters ``(phi,
        theta)``; otherwise the coefficients are the parameters.
    shared : bool
        One value for all runs; otherwise one for each run.
    """

    name: str
    patterns: tuple[Pattern, ...]
    parameters: tuple[str, ...]
    units: tuple[str, ...]
    polar: bool = False
    shared: bool = True

    def each_run(self) -> "Effect":
        """Copy with one value for each run."""
        return replace(self, shared=False)

    @property
    def coefficients(self) -> tuple[str, ...]:
        """Names of the linear coefficients."""
        if self.polar:
            size, angle = self.parameters
            return (f"{size} cos {angle}", f"{size} sin {angle}")
        return self.parameters


@dataclass(frozen=True, eq=False)
class CarrierModel:
    """A sum of effects.

    Parameters
    ----------
    name : str
        ``m1``, ``m2`` or another name.
    effects : tuple of Effect
        Terms of the sum.
    """

    name: str
    effects: tuple[Effect, ...]

    @property
    def coefficients(self) -> tuple[str, ...]:
        """Names of the linear coefficients, effect by effect."""
        return tuple(name for effect in self.effects for name in effect.coefficients)

    @property
    def shared(self) -> tuple[bool, ...]:
        """Whether each coefficient has one value for all runs."""
        return tuple(effect.shared for effect in self.effects for _ in effect.patterns)

    def design(self, inputs: Inputs, channel: Channel) -> NDArray[np.float64]:
        """Design matrix of one channel, shape (n, n_coefficients): signal = design @ coefficients.

        Parameters
        ----------
        inputs : mapping of str to ndarray, shape (n,)
            ``carrier_angle`` [rad] and ``torque`` [N m].
        channel : Channel
            Axial sensor.

        Returns
        -------
        ndarray
            Signal per unit of each coefficient [m per unit].
        """
        return np.column_stack(
            [pattern(inputs, channel) for effect in self.effects for pattern in effect.patterns]
        )


def sensor_position(channel: Channel) -> tuple[float, float]:
    """Housing angle [rad] and radius [m] of a rim sensor.

    Raises
    ------
    ValueError
        Where the channel has none.
    """
    if channel.angle is None or channel.radius is None:
        raise ValueError(
            f"channel {channel.name}: angle and radius are not given; expected those of a rim sensor"
        )
    return channel.angle, channel.radius


def _axial(pattern: Pattern) -> Pattern:
    """Pattern that a radial sensor does not see."""
    return lambda inputs, channel: pattern(inputs, channel) * (channel.quantity == AXIAL)


def _radial(pattern: Pattern) -> Pattern:
    """Pattern that an axial sensor does not see."""
    return lambda inputs, channel: pattern(inputs, channel) * (channel.quantity != AXIAL)


def _offset(inputs: Inputs, channel: Channel) -> NDArray[np.float64]:
    return offset_pattern(inputs["carrier_angle"])


def _saddle(inputs: Inputs, channel: Channel) -> NDArray[np.float64]:
    return saddle_pattern(inputs["carrier_angle"], sensor_position(channel)[0])


def _tilt(
    pattern: Callable[[NDArray[np.float64], float, float, float], NDArray[np.float64]],
    tilt_axis: float,
) -> Pattern:
    return _axial(
        lambda inputs, channel: pattern(
            inputs["carrier_angle"], *sensor_position(channel), tilt_axis
        )
    )


def _shift(
    pattern: Callable[[NDArray[np.float64], float, float], NDArray[np.float64]], direction: float
) -> Pattern:
    return _radial(
        lambda inputs, channel: pattern(
            inputs["carrier_angle"], sensor_position(channel)[0], direction
        )
    )


def _deflection(curve: DeflectionCurve, pin_angle: float) -> Pattern:
    def pattern(inputs: Inputs, channel: Channel) -> NDArray[np.float64]:
        deflection = (
            axial_deflection_pattern if channel.quantity == AXIAL else radial_deflection_pattern
        )
        angle, _ = sensor_position(channel)
        return deflection(
            inputs["carrier_angle"], angle, inputs["torque"], curve, pin_angle=pin_angle
        )

    return pattern


def _both_axes(
    pattern: Callable[[NDArray[np.float64], float, float, float], NDArray[np.float64]],
) -> tuple[Pattern, Pattern]:
    """Patterns of (phi cos theta, phi sin theta): tilt axes at 0 and at a quarter turn."""
    return _tilt(pattern, 0.0), _tilt(pattern, np.pi / 2.0)


#: Effects that need no deflection curve. Whether a value is shared follows the campaign contract.
AXIAL_OFFSET = Effect("axial_offset", (_axial(_offset),), ("d_x",), ("m",), shared=False)
HOUSING_TILT = Effect(
    "housing_tilt",
    _both_axes(housing_tilt_pattern),
    ("phi_H", "theta_H"),
    ("rad", "rad"),
    polar=True,
)
CARRIER_TILT = Effect(
    "carrier_tilt",
    _both_axes(carrier_tilt_pattern),
    ("phi_PLC", "theta_PLC"),
    ("rad", "rad"),
    polar=True,
)
STATIC_SADDLE = Effect("flange_warp", (_axial(_saddle),), ("saddle",), ("m",), shared=False)


#: Rigid radial motion: displacement along z and along y of the housing, and along two axes of the
#: carrier.
RADIAL_OFFSET = Effect(
    "radial_offset",
    (_shift(housing_offset_pattern, -np.pi / 2.0), _shift(housing_offset_pattern, 0.0)),
    ("d_y", "d_z"),
    ("m", "m"),
    shared=False,
)
ECCENTRICITY = Effect(
    "eccentricity",
    (_shift(carrier_offset_pattern, 0.0), _shift(carrier_offset_pattern, np.pi / 2.0)),
    ("e_PLC", "theta_e"),
    ("m", "rad"),
    polar=True,
)


def flexible_pins(delta_f: DeflectionCurve, pin_angle: float = 0.0) -> Effect:
    """Deflection with free pin ends, ``rho_f delta_f`` (three peaks).

    `pin_angle` theta_rho [rad].
    """
    return Effect("flexible_pins", (_deflection(delta_f, pin_angle),), ("rho_f",), ("1",))


def stiff_pins(delta_s: DeflectionCurve, pin_angle: float = 0.0) -> Effect:
    """Deflection with bonded pins, ``rho_s delta_s`` (six peaks); `pin_angle` theta_rho [rad]."""
    return Effect("stiff_pins", (_deflection(delta_s, pin_angle),), ("rho_s",), ("1",))


def rigid_model() -> CarrierModel:
    """Build model M1: offset, tilt against the housing (each run its own), tilt against the shaft (shared).

    Returns
    -------
    CarrierModel
        Five parameters a run: d_x, phi_H, theta_H, phi_PLC, theta_PLC.

    References
    ----------
    .. [1] 2012 paper, equation (1).
    """
    return CarrierModel("m1", (AXIAL_OFFSET, HOUSING_TILT.each_run(), CARRIER_TILT))


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
    return CarrierModel(
        "m2",
        (*rigid_model().effects, stiff_pins(delta_s, pin_angle), flexible_pins(delta_f, pin_angle)),
    )


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
    return CarrierModel(model.name, (*model.effects, RADIAL_OFFSET, ECCENTRICITY))
