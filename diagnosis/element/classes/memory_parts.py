"""Classes with a memory as parts: weights of a class's columns, force of a law along a motion."""

from collections.abc import Mapping

import numpy as np

from carrierflex.diagnosis.classes.memory_columns import relaxing_branches, stops
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.element.classes.motion import ForceRecord
from carrierflex.simulation.element.memory_laws import (
    AT,
    FIRST_FORCE,
    NO_PARTS,
    STIFFNESS,
    TAU,
    MemoryLaw,
    MemoryParts,
    StopPlaces,
)


def parts_of_stops(
    forces: Mapping[str, tuple[FloatArray, FloatArray]], middle: float, half: float
) -> MemoryParts:
    """Stops by what their columns were fitted to.

    Parameters
    ----------
    forces : mapping of str to (ndarray, ndarray)
        Yield deflections and weights of the columns of each force of a stop, by its name among
        :class:`carrierflex.simulation.element.memory_laws.StopPlaces`.
    middle, half : float
        Middle and half of the range of the deflection.

    Returns
    -------
    MemoryParts
        One stop for every yield deflection at which a weight is not zero.
    """
    yields = np.unique(np.concatenate([own for own, _ in forces.values()]))
    rows = np.zeros((yields.size, len(AT)))
    rows[:, AT.yield_deflection] = yields
    rows[:, AT.middle] = middle
    rows[:, AT.half_range] = half
    for name, (own, weights) in forces.items():
        place = StopPlaces._fields.index(name)
        rows[np.searchsorted(yields, own), place] = np.maximum(weights, 0.0)
    return MemoryParts(rows[rows[:, FIRST_FORCE:].any(axis=1)], NO_PARTS.branches)


def parts_of_branches(taus: FloatArray, weights: FloatArray) -> MemoryParts:
    """Branches by relaxation time [s] and stiffness; those without stiffness are left out."""
    rows = np.column_stack([taus, np.maximum(weights, 0.0)])
    return MemoryParts(NO_PARTS.stops, rows[rows[:, STIFFNESS] > 0.0])


def memory_law_force(law: MemoryLaw, own: ForceRecord) -> FloatArray:
    """Force of a law along the motion of a run, begun as the class's columns are, shape (n,)."""
    force = np.zeros(own.x.size)
    if law.stops.size:
        z = stops(own.x, np.ascontiguousarray(law.stops[:, 0]), from_rest=own.from_rest)
        force += sum(_stop_force(own.x, z[k], row) for k, row in enumerate(law.stops))
    if law.branches.size:
        taus = law.branches[:, TAU]
        relaxing = relaxing_branches(own.x, taus, own.step, from_rest=own.from_rest)
        force += law.branches[:, STIFFNESS] @ relaxing
    return force


def _stop_force(x: FloatArray, z: FloatArray, row: FloatArray) -> FloatArray:
    """Force of one stop whose spring stands at z."""
    stop = StopPlaces(*row)
    place = np.clip((x - stop.middle) / stop.half_range, -1.0, 1.0)
    level = stop.slip + stop.slip_middle * (1.0 - np.abs(place))
    level = level + stop.slip_upper * np.maximum(place, 0.0)
    level = level + stop.slip_lower * np.maximum(-place, 0.0)
    curved = stop.inner * np.clip(z, -0.5, 0.5) + stop.outer_upper * np.maximum(z - 0.5, 0.0)
    return np.asarray(level * z + curved + stop.outer_lower * np.minimum(z + 0.5, 0.0))
