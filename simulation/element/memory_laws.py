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

from carrierflex.simulation.laws import (
    ELEMENT,
    N_STIFFNESS,
    Branch,
    Friction,
    Law,
    LawTerm,
    Loop,
    Stop,
)

Array = NDArray[np.float64]


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
#: Places in the row of a smooth loop: values of the stiffness stand at its end.
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
class MemoryParts:
    """Parts of one law or of several, as the simulator takes them.

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


def memory_parts(law: Law) -> MemoryParts:
    """Stops, branches, loops and dry friction over the deflection of a law.

    Parameters
    ----------
    law : Law
        Measured law of kind element.
    """
    stops = [[getattr(stop, name) for name in StopPlaces._fields] for stop in law.of(Stop)]
    branches = [(branch.tau, branch.stiffness) for branch in law.of(Branch)]
    loops = [(loop.half_range, loop.force, *loop.stiffness) for loop in law.of(Loop)]
    levels = [np.column_stack([one.x, one.level]) for one in law.of(Friction) if one.level.any()]
    return MemoryParts(
        np.array(stops, dtype=np.float64).reshape(-1, len(AT)),
        np.array(branches, dtype=np.float64).reshape(-1, 2),
        levels[0] if levels else NO_PARTS.levels,
        np.array(loops, dtype=np.float64).reshape(-1, LOOP_LENGTH),
    )


def law_terms(memory: MemoryParts) -> tuple[LawTerm, ...]:
    """Parts of a law of which :func:`memory_parts` makes these rows."""
    stops = [dict(zip(StopPlaces._fields, row, strict=True)) for row in memory.stops.tolist()]
    return (
        *(Stop(ELEMENT, **values) for values in stops),
        *(Branch(ELEMENT, tau, stiffness) for tau, stiffness in memory.branches.tolist()),
        *(Loop(ELEMENT, row[0], row[1], row[LOOP_STIFFNESS:]) for row in memory.loops),
        *(
            [Friction(ELEMENT, x=memory.levels[:, NODE], level=memory.levels[:, LEVEL])]
            * bool(memory.levels.size)
        ),
    )


def joined_parts(sized_laws: Sequence[tuple[MemoryParts, float]]) -> MemoryParts:
    """Parts of laws, the forces of each times a factor.

    Parameters
    ----------
    sized_laws : sequence of (MemoryParts, float)
        Parts of every law with its size.
    """
    if not sized_laws:
        return NO_PARTS
    levels = [(law.levels, size) for law, size in sized_laws if law.levels.size]
    return MemoryParts(
        np.concatenate(
            [_times(law.stops, size, slice(FIRST_FORCE, None)) for law, size in sized_laws]
        ),
        np.concatenate([_times(law.branches, size, STIFFNESS) for law, size in sized_laws]),
        _joined_levels(levels),
        np.concatenate([_times(law.loops, size, LOOP_FORCE) for law, size in sized_laws]),
    )


def _times(rows: Array, size: float, columns: int | slice) -> Array:
    """Rows with some of their values times a factor."""
    scaled = rows.copy()
    scaled[:, columns] *= size
    return scaled


def _joined_levels(levels: Sequence[tuple[Array, float]]) -> Array:
    """Sum of tables of dry friction, each times a factor, at the nodes of all."""
    if not levels:
        return NO_PARTS.levels
    nodes = np.unique(np.concatenate([table[:, NODE] for table, _ in levels]))
    sums = [size * np.interp(nodes, table[:, NODE], table[:, LEVEL]) for table, size in levels]
    return np.column_stack([nodes, np.sum(sums, axis=0)])


def flat_parts(memory: MemoryParts) -> Array:
    """Parts as one array for the compiled code, at rest: empty where there is none.

    Numbers of stops, branches, nodes of dry friction and smooth loops, the row of each stop and its
    state, the row of each branch and its force, the row of each node, the row of each loop and its
    state.
    """
    kinds = (memory.stops, memory.branches, memory.levels, memory.loops)
    if not sum(rows.size for rows in kinds):
        return np.empty(0)
    counts = np.array([len(rows) for rows in kinds], dtype=np.float64)
    return np.concatenate(
        [
            counts,
            _with_states(memory.stops),
            _with_states(memory.branches),
            memory.levels.ravel(),
            _with_states(memory.loops),
        ]
    )


def _with_states(rows: Array) -> Array:
    """Rows of parts, each with its state at rest behind it, one after the other."""
    return np.column_stack([rows, np.zeros(len(rows))]).ravel()
