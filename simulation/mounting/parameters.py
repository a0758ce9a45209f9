"""What a fit may change in the mounting model.

Names, units, bounds, and which effect each belongs to.

A parameter set is a flat array in the order of :data:`PARAMETERS`, so that another effect needs no
other code.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.simulation.mounting.rig import SENSORS, MountingRig

ParameterArray = NDArray[np.float64]


@dataclass(frozen=True)
class Parameter:
    """One entry of a parameter set.

    Parameters
    ----------
    name, unit : str
        Symbol of the paper where it has one; SI unit.
    neutral : float
        Value at which the baseline is left as it is; K1, C1 and the axial constants take theirs
        from the rig.
    lower, upper : float
        Bounds within which a fit may search.
    effect : str
        Effect id of the campaign contract; empty for what the baseline holds itself.
    """

    name: str
    unit: str
    neutral: float
    lower: float
    upper: float
    effect: str = ""


_BUSHING = (
    Parameter("K1", "N/m", np.nan, 1e5, 1e9),
    Parameter("C1", "N s/m", np.nan, 0.0, 1e8),
    Parameter("K3", "N/m^3", 0.0, -1e12, 1e14, "cubic_stiffness"),
    Parameter("K5", "N/m^5", 0.0, -1e17, 1e19, "quintic_stiffness"),
    Parameter("C3", "N s/m^3", 0.0, 0.0, 1e13, "deflection_dependent_damping"),
    Parameter("k", "N/m", 0.0, 0.0, 1e9, "fluid_branch"),
    Parameter("c", "N s/m", 0.0, 0.0, 1e9, "fluid_branch"),
    Parameter("m", "kg", 0.0, 0.0, 1e3, "fluid_branch"),
    Parameter("Kp", "N/m", 0.0, 0.0, 1e9, "elasto_plastic_friction"),
    Parameter("Fy", "N", 0.0, 0.0, 1e6, "elasto_plastic_friction"),
)
_MOUNTING = (
    Parameter("P_T", "m", 0.0, -2.0, 2.0, "parasitic_torque"),
    Parameter("k_x", "N/m", np.nan, 0.0, 1e9, "axial_bushing_stiffness"),
    Parameter("c_x", "N s/m", np.nan, 0.0, 1e8),
    Parameter("main_bearing_compliance", "m/N", 0.0, 0.0, 1e-7, "main_bearing_compliance"),
    Parameter("ntl_angle", "rad", 0.0, -np.pi, np.pi, "ntl_direction"),
    Parameter("starboard_excess", "-", 0.0, -0.9, 0.9, "unequal_bushings"),
    Parameter("gravity", "m/s^2", 0.0, 0.0, 20.0),
)
_SENSORS = (
    *(Parameter(f"gain_{sensor}", "-", 1.0, 0.1, 10.0, "sensor_gain") for sensor in SENSORS),
    *(Parameter(f"zero_{sensor}", "m", 0.0, -0.05, 0.05, "sensor_zero") for sensor in SENSORS),
    Parameter("delay", "s", 0.0, -5.0, 5.0, "sensor_delay"),
)

#: Every parameter in the order of the flat array. ``starboard_excess`` e scales all radial and
#: axial forces of the starboard bushing by 1 + e and of the port bushing by 1 - e. ``gravity`` is 0
#: because weight leaves with the zero; with 9.81 the nonlinear bushings work about their loaded
#: position, as in the paper.
PARAMETERS: tuple[Parameter, ...] = (*_BUSHING, *_MOUNTING, *_SENSORS)

#: Place of each parameter in the flat array.
INDEX = {parameter.name: place for place, parameter in enumerate(PARAMETERS)}

#: Parameters of each effect of the campaign contract.
EFFECT_PARAMETERS: Mapping[str, tuple[str, ...]] = {
    effect: tuple(p.name for p in PARAMETERS if p.effect == effect)
    for effect in dict.fromkeys(p.effect for p in PARAMETERS if p.effect)
}

_RIG_DEFAULTS = {
    "K1": "bushing_radial_stiffness",
    "C1": "bushing_radial_damping",
    "k_x": "bushing_axial_stiffness",
    "c_x": "bushing_axial_damping",
}


def parameter_array(rig: MountingRig, values: Mapping[str, float] | None = None) -> ParameterArray:
    """Flat parameter set: the rig's nominal values and neutral effects, some of them replaced.

    Parameters
    ----------
    rig : MountingRig
        Nominal stiffness and damping.
    values : mapping of str to float, optional
        Values by parameter name.

    Returns
    -------
    ndarray, shape (n_parameters,)
        In the order of :data:`PARAMETERS`, SI units.

    Raises
    ------
    ValueError
        Where a name is unknown or a value is out of its bounds.
    """
    array = np.array([parameter.neutral for parameter in PARAMETERS])
    for name, key in _RIG_DEFAULTS.items():
        array[INDEX[name]] = getattr(rig, key)
    for name, value in (values or {}).items():
        if name not in INDEX:
            raise ValueError(f"unknown parameter '{name}'; expected one of {', '.join(INDEX)}")
        array[INDEX[name]] = value
    check_parameters(array)
    return array


def check_parameters(parameters: ParameterArray) -> None:
    """Refuse a parameter set that is physically impossible.

    Raises
    ------
    ValueError
        Where the array has another length, or a value is not finite or out of bounds.
    """
    if parameters.shape != (len(PARAMETERS),):
        raise ValueError(
            f"parameter set of shape {parameters.shape}; expected ({len(PARAMETERS)},)"
        )
    inside = (parameters >= _LOWER) & (parameters <= _UPPER)
    if not inside.all():
        place = int(np.argmin(inside))
        wrong = PARAMETERS[place]
        raise ValueError(
            f"parameter {wrong.name} is {parameters[place]:g} {wrong.unit}; "
            f"expected a value from {wrong.lower:g} to {wrong.upper:g}"
        )


def parameters_of(effects: Iterable[str]) -> tuple[Parameter, ...]:
    """Parameters that a fit of these effects frees, in the order of the flat array.

    Raises
    ------
    ValueError
        Where an effect id is unknown.
    """
    effects = tuple(effects)
    for effect in effects:
        if effect not in EFFECT_PARAMETERS:
            raise ValueError(
                f"unknown effect '{effect}'; expected one of {', '.join(EFFECT_PARAMETERS)}"
            )
    return tuple(parameter for parameter in PARAMETERS if parameter.effect in effects)


_LOWER = np.array([parameter.lower for parameter in PARAMETERS])
_UPPER = np.array([parameter.upper for parameter in PARAMETERS])
