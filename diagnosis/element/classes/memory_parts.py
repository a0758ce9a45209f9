"""Classes with a memory as parts: weights of a class's columns, force of a law along a motion."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from scipy.stats import gamma

from carrierflex.diagnosis.classes.columns import along
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.element.classes.motion.force_records import ForceRecord
from carrierflex.simulation.element.memory_kernels import forces_along
from carrierflex.simulation.element.memory_laws import (
    AT,
    FIRST_FORCE,
    NO_PARTS,
    STIFFNESS,
    MemoryParts,
    StopPlaces,
    flat_parts,
)

#: Stops in place of one bristle: its curve to 2.4 % of the friction.
_STOPS_OF_BRISTLE = 8


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
    return MemoryParts(rows[rows[:, FIRST_FORCE:].any(axis=1)], NO_PARTS.branches, NO_PARTS.levels)


def stops_of_bristles(lengths: FloatArray, weights: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Yield deflections and weights of stops that turn as bristles of some lengths do.

    After a reversal friction of Dahl's law turns as ``2 exp(-d / L) - 1``. So do stops of all yield
    deflections y whose weights have the density ``4 y / L² exp(-2 y / L)`` (a gamma
    distribution); a few of equal weight stand for it, in the middle of equal parts of it.

    Parameters
    ----------
    lengths, weights : ndarray, shape (n,)
        Deflection over which each turns, and its friction.

    Returns
    -------
    tuple of ndarray, shape (n * n_stops,)
        Yield deflections in the order of the lengths, weights.

    References
    ----------
    .. [1] W. D. Iwan, "A distributed-element model for hysteresis", J. Appl. Mech. 33 (1966) 893:
       the density is ``-d f''(d)`` of the curve f of first loading.
    """
    parts = (np.arange(_STOPS_OF_BRISTLE) + 0.5) / _STOPS_OF_BRISTLE
    yields = np.outer(lengths, gamma.ppf(parts, 2.0, scale=0.5))
    shared = np.repeat(weights / _STOPS_OF_BRISTLE, _STOPS_OF_BRISTLE)
    return yields.ravel(), shared


def parts_of_branches(taus: FloatArray, weights: FloatArray) -> MemoryParts:
    """Branches by relaxation time [s] and stiffness; those without stiffness are left out."""
    rows = np.column_stack([taus, np.maximum(weights, 0.0)])
    return MemoryParts(NO_PARTS.stops, rows[rows[:, STIFFNESS] > 0.0], NO_PARTS.levels)


def memory_force(parts: MemoryParts, own: ForceRecord) -> FloatArray:
    """Force of a law's parts along the motion of a run, begun as the class's columns are.

    Shape (n,); dry friction, which has no memory, is not in it.
    """
    flat = flat_parts(replace(parts, levels=NO_PARTS.levels))
    return along(
        lambda x, moved: forces_along(x, own.step, moved), own.x, flat, from_rest=own.from_rest
    )
