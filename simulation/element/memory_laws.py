"""Laws of one element with a memory, as parallel parts: stops that slip, branches that relax.

A stop is a spring in series with dry friction (Jenkins element; Iwan, J. Appl. Mech. 33 (1966)
893): ``z`` follows the deflection over the yield deflection and stays within -1 and 1. Its force is

``z (slip + slip_middle (1 - |s|) + slip_upper max(s, 0) + slip_lower max(-s, 0))
+ inner min(max(z, -1/2), 1/2) + outer_upper max(z - 1/2, 0) + outer_lower min(z + 1/2, 0)``,

with the place ``s = (q - middle) / half_range`` within -1 and 1: loops may be pinched, differ from
side to side, or turn along a curved line. A branch is a spring in series with a damper (Maxwell):
``dF/dt = stiffness v - F / tau``.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

HYSTERESIS = "hysteresis"
MEMORY = "memory"
#: Classes of these laws.
WITH_MEMORY = (HYSTERESIS, MEMORY)


class StopPlaces(NamedTuple):
    """Index of every value in the row of a stop."""

    yield_deflection: int
    middle: int
    half_range: int
    slip: int
    slip_middle: int
    slip_upper: int
    slip_lower: int
    inner: int
    outer_upper: int
    outer_lower: int


AT = StopPlaces(*range(len(StopPlaces._fields)))
#: First of the values of a stop that are forces.
FIRST_FORCE = AT.slip
#: Places in the row of a branch.
TAU, STIFFNESS = 0, 1
#: Values before the parts in their flat array: how many stops, how many branches.
N_HEAD = 2


@dataclass(frozen=True, eq=False)
class MemoryLaw:
    """A measured law with a memory.

    Parameters
    ----------
    name : str
        Id of the effect.
    effect_class : str
        ``hysteresis`` or ``memory``.
    stops : ndarray, shape (n_stops, 10)
        Rows by :class:`StopPlaces`: deflections and forces.
    branches : ndarray, shape (n_branches, 2)
        Relaxation time [s] and stiffness.
    units : tuple of str
        Units of force and deflection; time is in seconds.
    visited : tuple of float
        Deflections between which it was measured.
    measured_on : str
        Campaign whose records gave it; empty where unknown.
    """

    name: str
    effect_class: str
    stops: Array
    branches: Array
    units: tuple[str, str]
    visited: tuple[float, float]
    measured_on: str = ""

    @property
    def x(self) -> Array:
        """Ends of the visited range, as of a table over the deflection."""
        return np.array(self.visited)

    @property
    def along_speed(self) -> bool:
        """Whether x is a speed."""
        return False

    @property
    def x_unit(self) -> str:
        """Unit of x."""
        return self.units[1]


@dataclass(frozen=True, eq=False)
class MemoryParts:
    """Parts of several laws, as the simulator takes them.

    Parameters
    ----------
    stops : ndarray, shape (n_stops, 10)
        Rows of all stops.
    branches : ndarray, shape (n_branches, 2)
        Rows of all branches.
    """

    stops: Array
    branches: Array


NO_PARTS = MemoryParts(np.empty((0, len(AT))), np.empty((0, 2)))


def joined_parts(laws: Sequence[tuple[MemoryLaw, float]]) -> MemoryParts:
    """Parts of laws, each times a factor.

    Parameters
    ----------
    laws : sequence of (MemoryLaw, float)
        Laws with their sizes.
    """
    if not laws:
        return NO_PARTS
    stops, branches = [], []
    for law, size in laws:
        own = law.stops.copy()
        own[:, FIRST_FORCE:] *= size
        stops.append(own)
        own = law.branches.copy()
        own[:, STIFFNESS] *= size
        branches.append(own)
    return MemoryParts(np.concatenate(stops), np.concatenate(branches))


def flat_parts(parts: MemoryParts) -> Array:
    """Parts as one array for the compiled code, at rest: empty where there is none.

    Numbers of stops and branches, the row of each stop and its state, the row of each branch and
    its force.
    """
    if not parts.stops.size + parts.branches.size:
        return np.empty(0)
    counts = np.array([len(parts.stops), len(parts.branches)], dtype=np.float64)
    rows = [np.append(row, 0.0) for own in (parts.stops, parts.branches) for row in own]
    return np.concatenate([counts, *rows])
