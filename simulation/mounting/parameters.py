"""What a fit may change in the mounting model.

Names, units, bounds, and which effect each belongs to.

A parameter set is a flat array in the order of :data:`PARAMETERS`: the baseline's entries, then
those of the effects.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.simulation.mounting.effects import MOUNTING_EFFECTS, MountingParameter
from carrierflex.simulation.mounting.rig import MountingRig

ParameterArray = NDArray[np.float64]


#: What the baseline holds itself.
_BASELINE = (
    MountingParameter(
        "K1", "N/m", 1e5, 1e9, neutral=np.nan, words="Linear stiffness of each bushing"
    ),
    MountingParameter(
        "C1", "N s/m", 0.0, 1e8, neutral=np.nan, words="Linear damping of each bushing"
    ),
    MountingParameter(
        "c_x", "N s/m", 0.0, 1e8, neutral=np.nan, words="Axial damping of each bushing"
    ),
    MountingParameter(
        "gravity",
        "m/s^2",
        0.0,
        20.0,
        words="Gravity that loads the bushings; 0 where the weight leaves with the zero",
    ),
)

#: Every parameter in the order of the flat array. ``starboard_excess`` e scales all radial and
#: axial forces of the starboard bushing by 1 + e and of the port bushing by 1 - e. ``gravity`` is 0
#: because weight leaves with the zero; with 9.81 the nonlinear bushings work about their loaded
#: position, as in the paper.
PARAMETERS: tuple[MountingParameter, ...] = (
    *_BASELINE,
    *(
        replace(entry, effect=effect.id)
        for effect in MOUNTING_EFFECTS.values()
        for entry in effect.entries
    ),
)

#: Index of each parameter in the flat array.
INDEX = {parameter.name: index for index, parameter in enumerate(PARAMETERS)}

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
        index = int(np.argmin(inside))
        wrong = PARAMETERS[index]
        raise ValueError(
            f"parameter {wrong.name} is {parameters[index]:g} {wrong.unit}; "
            f"expected a value from {wrong.lower:g} to {wrong.upper:g}"
        )


_LOWER = np.array([parameter.lower for parameter in PARAMETERS])
_UPPER = np.array([parameter.upper for parameter in PARAMETERS])
