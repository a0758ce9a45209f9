"""Laws of one element with a memory, as parallel parts: stops, smooth loops, relaxing branches.

Dry friction whose level depends on the deflection stands beside them: the motion sticks in it.

A stop is a spring in series with dry friction (Jenkins element; Iwan, J. Appl. Mech. 33 (1966)
893): ``z`` follows the deflection over the yield deflection and stays within -1 and 1. Its force is

``z (slip + slip_middle (1 - |s|) + slip_upper max(s, 0) + slip_lower max(-s, 0)
+ slip_outside min(4 |s|, 1))
+ inner min(max(z, -1/2), 1/2) + outer_upper max(z - 1/2, 0) + outer_lower min(z + 1/2, 0)``,

with the place ``s = (q - middle) / half_range`` within -1 and 1: loops may be pinched, differ from
side to side, or turn along a curved line. A smooth loop is ``force z``, with a state whose
stiffness depends on itself and on the direction
(:mod:`carrierflex.simulation.element.loop_kernels`):
``dz/dq = c(z sign(v)) / half_range``. A branch is a spring in series with a damper (Maxwell):
``dF/dt = stiffness v - F / tau``.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
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
    slip_outside: int
    inner: int
    outer_upper: int
    outer_lower: int


#: Slope of the force outside the middle over the place: whole beyond a quarter of the half range.
OUTSIDE = 4.0
AT = StopPlaces(*range(len(StopPlaces._fields)))
#: First of the values of a stop that are forces.
FIRST_FORCE = AT.slip
#: Values of the stiffness of a smooth loop, and places in its row: those stand at its end.
N_STIFFNESS = 9
LOOP_HALF_RANGE, LOOP_FORCE, LOOP_STIFFNESS = 0, 1, 2
LOOP_LENGTH = LOOP_STIFFNESS + N_STIFFNESS
#: Places in the row of a branch.
TAU, STIFFNESS = 0, 1
#: Places in the row of a node of dry friction: deflection, level.
NODE, LEVEL = 0, 1
#: Values before the parts in their flat array: how many stops, branches, nodes of dry friction,
#: smooth loops.
N_HEAD = 4


@dataclass(frozen=True, eq=False)
class MemoryLaw:
    """A measured law with a memory.

    Parameters
    ----------
    name : str
        Id of the effect.
    effect_class : str
        ``hysteresis`` or ``memory``.
    stops : ndarray, shape (n_stops, 11)
        Rows by :class:`StopPlaces`: deflections and forces.
    branches : ndarray, shape (n_branches, 2)
        Relaxation time [s] and stiffness.
    units : tuple of str
        Units of force and deflection; time is in seconds.
    visited : tuple of float
        Deflections between which it was measured.
    measured_on : str
        Campaign whose records gave it; empty where unknown.
    levels : ndarray, shape (n_nodes, 2), optional
        Dry friction over the deflection, which increases: its level, linear between the nodes and
        constant beyond; of a surface alone.
    loops : ndarray, shape (n_loops, LOOP_LENGTH), optional
        Smooth loops: half range, force, stiffnesses.
    """

    name: str
    effect_class: str
    stops: Array
    branches: Array
    units: tuple[str, str]
    visited: tuple[float, float]
    measured_on: str = ""
    levels: Array = field(default_factory=lambda: np.empty((0, 2)))
    loops: Array = field(default_factory=lambda: np.empty((0, LOOP_LENGTH)))

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
    stops : ndarray, shape (n_stops, 11)
        Rows of all stops.
    branches : ndarray, shape (n_branches, 2)
        Rows of all branches.
    levels : ndarray, shape (n_nodes, 2)
        Dry friction over the deflection, of all laws together.
    loops : ndarray, shape (n_loops, LOOP_LENGTH), optional
        Rows of all smooth loops.
    """

    stops: Array
    branches: Array
    levels: Array
    loops: Array = field(default_factory=lambda: np.empty((0, LOOP_LENGTH)))


NO_PARTS = MemoryParts(np.empty((0, len(AT))), np.empty((0, 2)), np.empty((0, 2)))


def joined_parts(laws: Sequence[tuple[MemoryLaw, float]]) -> MemoryParts:
    """Parts of laws, each times a factor.

    Parameters
    ----------
    laws : sequence of (MemoryLaw, float)
        Laws with their sizes.
    """
    if not laws:
        return NO_PARTS
    stops, branches, loops = [], [], []
    for law, size in laws:
        own = law.loops.copy()
        own[:, LOOP_FORCE] *= size
        loops.append(own)
        own = law.stops.copy()
        own[:, FIRST_FORCE:] *= size
        stops.append(own)
        own = law.branches.copy()
        own[:, STIFFNESS] *= size
        branches.append(own)
    levels = [(law.levels, size) for law, size in laws if law.levels.size]
    return MemoryParts(
        np.concatenate(stops),
        np.concatenate(branches),
        _joined_levels(levels),
        np.concatenate(loops),
    )


def _joined_levels(levels: Sequence[tuple[Array, float]]) -> Array:
    """Sum of tables of dry friction, each times a factor, at the nodes of all."""
    if not levels:
        return NO_PARTS.levels
    nodes = np.unique(np.concatenate([own[:, NODE] for own, _ in levels]))
    sums = [size * np.interp(nodes, own[:, NODE], own[:, LEVEL]) for own, size in levels]
    return np.column_stack([nodes, np.sum(sums, axis=0)])


def flat_parts(parts: MemoryParts) -> Array:
    """Parts as one array for the compiled code, at rest: empty where there is none.

    Numbers of stops, branches, nodes of dry friction and smooth loops, the row of each stop and its
    state, the row of each branch and its force, the row of each node, the row of each loop and its
    state.
    """
    kinds = (parts.stops, parts.branches, parts.levels, parts.loops)
    if not sum(rows.size for rows in kinds):
        return np.empty(0)
    counts = np.array([len(rows) for rows in kinds], dtype=np.float64)
    return np.concatenate(
        [
            counts,
            _with_states(parts.stops),
            _with_states(parts.branches),
            parts.levels.ravel(),
            _with_states(parts.loops),
        ]
    )


def _with_states(rows: Array) -> Array:
    """Rows of parts, each with its state at rest behind it, one after the other."""
    return np.column_stack([rows, np.zeros(len(rows))]).ravel()
