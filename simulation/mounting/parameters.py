"""What a fit may change in the mounting model.

Names, units, bounds, and which effect each belongs to.

A parameter set is a flat array in the order of :data:`PARAMETERS`: the baseline's entries, then
those of the effects. The arrays themselves:
:mod:`carrierflex.simulation.mounting.parameter_arrays`.
"""

from dataclasses import replace
from math import nan

from carrierflex.simulation.mounting.effects import MOUNTING_EFFECTS, MountingParameter

#: What the baseline holds itself.
_BASELINE = (
    MountingParameter("K1", "N/m", 1e5, 1e9, neutral=nan, words="Linear stiffness of each bushing"),
    MountingParameter("C1", "N s/m", 0.0, 1e8, neutral=nan, words="Linear damping of each bushing"),
    MountingParameter("c_x", "N s/m", 0.0, 1e8, neutral=nan, words="Axial damping of each bushing"),
    MountingParameter(
        "gravity",
        "m/s^2",
        0.0,
        20.0,
        words="Gravity that loads the bushings; 0 where the zero of the sensors removes the weight",
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
