"""What a fit may change in the mounting model.

Names, units, bounds, and which effect each belongs to.

A parameter set is a flat array in the order of :data:`PARAMETERS`, so that another effect needs no
other code.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from carrierflex.simulation.fit_parameter import FitParameter
from carrierflex.simulation.mounting.rig import SENSORS, MountingRig

ParameterArray = NDArray[np.float64]


@dataclass(frozen=True)
class MountingParameter(FitParameter):
    """One entry of a parameter set; its typical size is the rig's, not the entry's.

    Parameters
    ----------
    neutral : float
        Value at which the baseline is left as it is; K1, C1 and the axial constants take theirs
        from the rig.
    effect : str
        Effect id of the campaign contract; empty for what the baseline holds itself.
    """

    neutral: float = field(default=0.0, kw_only=True)
    effect: str = field(default="", kw_only=True)


_BUSHING = (
    MountingParameter("K1", "N/m", 1e5, 1e9, neutral=np.nan),
    MountingParameter("C1", "N s/m", 0.0, 1e8, neutral=np.nan),
    MountingParameter("K3", "N/m^3", -1e12, 1e14, effect="cubic_stiffness"),
    MountingParameter("K5", "N/m^5", -1e17, 1e19, effect="quintic_stiffness"),
    MountingParameter("C3", "N s/m^3", 0.0, 1e13, effect="deflection_dependent_damping"),
    MountingParameter("k", "N/m", 0.0, 1e9, effect="fluid_branch"),
    MountingParameter("c", "N s/m", 0.0, 1e9, effect="fluid_branch"),
    MountingParameter("m", "kg", 0.0, 1e3, effect="fluid_branch"),
    MountingParameter("Kp", "N/m", 0.0, 1e9, effect="elasto_plastic_friction"),
    MountingParameter("Fy", "N", 0.0, 1e6, effect="elasto_plastic_friction"),
)
_MOUNTING = (
    MountingParameter("P_T", "m", -2.0, 2.0, effect="parasitic_torque"),
    MountingParameter("k_x", "N/m", 0.0, 1e9, neutral=np.nan, effect="axial_bushing_stiffness"),
    MountingParameter("c_x", "N s/m", 0.0, 1e8, neutral=np.nan),
    MountingParameter(
        "main_bearing_compliance", "m/N", 0.0, 1e-7, effect="main_bearing_compliance"
    ),
    MountingParameter("ntl_angle", "rad", -np.pi, np.pi, effect="ntl_direction"),
    MountingParameter("starboard_excess", "-", -0.9, 0.9, effect="unequal_bushings"),
    MountingParameter("gravity", "m/s^2", 0.0, 20.0),
)
_SENSORS = (
    *(
        MountingParameter(f"gain_{sensor}", "-", 0.1, 10.0, neutral=1.0, effect="sensor_gain")
        for sensor in SENSORS
    ),
    *(
        MountingParameter(f"zero_{sensor}", "m", -0.05, 0.05, effect="sensor_zero")
        for sensor in SENSORS
    ),
    MountingParameter("delay", "s", -5.0, 5.0, effect="sensor_delay"),
)

#: Every parameter in the order of the flat array. ``starboard_excess`` e scales all radial and
#: axial forces of the starboard bushing by 1 + e and of the port bushing by 1 - e. ``gravity`` is 0
#: because weight leaves with the zero; with 9.81 the nonlinear bushings work about their loaded
#: position, as in the paper.
PARAMETERS: tuple[MountingParameter, ...] = (*_BUSHING, *_MOUNTING, *_SENSORS)

#: Place of each parameter in the flat array.
INDEX = {parameter.name: place for place, parameter in enumerate(PARAMETERS)}

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


_LOWER = np.array([parameter.lower for parameter in PARAMETERS])
_UPPER = np.array([parameter.upper for parameter in PARAMETERS])
