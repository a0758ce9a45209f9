"""Parameter sets of the mounting model as flat arrays."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from carrierflex.simulation.mounting.parameters import INDEX, PARAMETERS
from carrierflex.simulation.mounting.rig import MountingRig

ParameterArray = NDArray[np.float64]

_RIG_DEFAULTS = {
    "K1": "bushing_radial_stiffness",
    "C1": "bushing_radial_damping",
    "k_x": "bushing_axial_stiffness",
    "c_x": "bushing_axial_damping",
}
_LOWER = np.array([parameter.lower for parameter in PARAMETERS])
_UPPER = np.array([parameter.upper for parameter in PARAMETERS])


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
