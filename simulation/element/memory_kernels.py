"""Compiled force of the parts with a memory, and how a motion moves them.

A straight motion from one state to the next is exact for every part. Parts and their
states are one flat array: their numbers, rows of stops each with z behind it, rows of branches each
with its force behind it, rows of the nodes of dry friction.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from carrierflex.simulation.element.loop_kernels import moved_loop
from carrierflex.simulation.element.memory_laws import (
    AT,
    LEVEL,
    LOOP_FORCE,
    LOOP_HALF_RANGE,
    LOOP_LENGTH,
    LOOP_STIFFNESS,
    N_HEAD,
    NODE,
    OUTSIDE,
    STIFFNESS,
    TAU,
)

Array = NDArray[np.float64]

#: Values of a stop and of a branch, their states among them, and of a node.
_STOP = len(AT) + 1
_BRANCH = 3
_LEVEL = 2
_LOOP = LOOP_LENGTH + 1


@njit(cache=True, inline="always")
def _stop_force(q: float, z: float, at: int, memory: Array) -> float:
    """Force of the stop whose row begins at `at` and whose spring stands at z."""
    position = (q - memory[at + AT.middle]) / memory[at + AT.half_range]
    position = min(max(position, -1.0), 1.0)
    level = memory[at + AT.slip] + memory[at + AT.slip_middle] * (1.0 - abs(position))
    level += memory[at + AT.slip_upper] * max(position, 0.0)
    level += memory[at + AT.slip_lower] * max(-position, 0.0)
    level += memory[at + AT.slip_outside] * min(OUTSIDE * abs(position), 1.0)
    force = level * z + memory[at + AT.inner] * min(max(z, -0.5), 0.5)
    force += memory[at + AT.outer_upper] * max(z - 0.5, 0.0)
    return float(force + memory[at + AT.outer_lower] * min(z + 0.5, 0.0))


@njit(cache=True, inline="always")
def _moved_stop(moved: float, at: int, memory: Array) -> float:
    """Where the spring of a stop stands after a motion in one direction."""
    z = memory[at + len(AT)] + moved / memory[at + AT.yield_deflection]
    return float(min(max(z, -1.0), 1.0))


@njit(cache=True, inline="always")
def _moved_branch(moved: float, elapsed: float, at: int, memory: Array) -> float:
    """Force of a branch after a straight motion over some time [s]."""
    force = memory[at + 2]
    if elapsed <= 0.0:
        return float(force)
    tau = memory[at + TAU]
    decay = np.exp(-elapsed / tau)
    return float(decay * force + memory[at + STIFFNESS] * moved * tau / elapsed * (1.0 - decay))


@njit(cache=True, inline="always")
def _moved_loop(moved: float, at: int, memory: Array) -> float:
    """State of the smooth loop whose row begins at `at` after a motion in one direction."""
    way = moved / memory[at + LOOP_HALF_RANGE]
    stiffness = memory[at + LOOP_STIFFNESS : at + LOOP_LENGTH]
    return float(moved_loop(memory[at + LOOP_LENGTH], way, stiffness))


@njit(cache=True, inline="always")
def _first_level(memory: Array, first: int) -> int:
    """Where the nodes of dry friction begin."""
    return first + N_HEAD + _STOP * int(memory[first]) + _BRANCH * int(memory[first + 1])


@njit(cache=True, inline="always")
def _first_loop(memory: Array, first: int) -> int:
    """Where the smooth loops begin."""
    return _first_level(memory, first) + _LEVEL * int(memory[first + 2])


@njit(cache=True)
def memory_force(q: float, moved: float, elapsed: float, memory: Array, first: int) -> float:
    """Force of all parts after a straight motion that ends at q; their states stay as they are.

    Parameters
    ----------
    q, moved : float
        Deflection, and its change since the states.
    elapsed : float
        Time since the states [s].
    memory : ndarray, shape (n,)
        Holds :func:`carrierflex.simulation.element.memory_laws.flat_parts`.
    first : int
        Where they begin.
    """
    force = 0.0
    stops = first + N_HEAD
    branches = stops + _STOP * int(memory[first])
    for at in range(stops, branches, _STOP):
        force += _stop_force(q, _moved_stop(moved, at, memory), at, memory)
    for at in range(branches, branches + _BRANCH * int(memory[first + 1]), _BRANCH):
        force += _moved_branch(moved, elapsed, at, memory)
    loops = _first_loop(memory, first)
    for at in range(loops, loops + _LOOP * int(memory[first + 3]), _LOOP):
        force += memory[at + LOOP_FORCE] * _moved_loop(moved, at, memory)
    return force


@njit(cache=True)
def remember(moved: float, elapsed: float, memory: Array, first: int) -> None:
    """Move the states of all parts along a straight motion.

    Parameters
    ----------
    moved, elapsed
        Change of the deflection, and its time [s].
    memory, first
        As of :func:`memory_force`; states are changed.
    """
    stops = first + N_HEAD
    branches = stops + _STOP * int(memory[first])
    for at in range(stops, branches, _STOP):
        memory[at + len(AT)] = _moved_stop(moved, at, memory)
    for at in range(branches, branches + _BRANCH * int(memory[first + 1]), _BRANCH):
        memory[at + 2] = _moved_branch(moved, elapsed, at, memory)
    loops = _first_loop(memory, first)
    for at in range(loops, loops + _LOOP * int(memory[first + 3]), _LOOP):
        memory[at + LOOP_LENGTH] = _moved_loop(moved, at, memory)


@njit(cache=True, inline="always")
def rubs_by_place(memory: Array, first: int) -> bool:
    """Whether dry friction that depends on the deflection is among the parts."""
    return bool(memory.size > first and memory[first + 2] > 0.0)


@njit(cache=True)
def friction_by_place(q: float, memory: Array, first: int) -> float:
    """Dry friction at a deflection, between two nodes or as at the last.

    Parameters
    ----------
    q : float
        Deflection.
    memory, first
        As of :func:`memory_force`.
    """
    if not rubs_by_place(memory, first):
        return 0.0
    low = _first_level(memory, first)
    last = low + _LEVEL * (int(memory[first + 2]) - 1)
    if q <= memory[low + NODE]:
        return float(memory[low + LEVEL])
    if q >= memory[last + NODE]:
        return float(memory[last + LEVEL])
    while last - low > _LEVEL:
        middle = low + _LEVEL * ((last - low) // (2 * _LEVEL))
        if memory[middle + NODE] <= q:
            low = middle
        else:
            last = middle
    share = (q - memory[low + NODE]) / (memory[last + NODE] - memory[low + NODE])
    return float(memory[low + LEVEL] + share * (memory[last + LEVEL] - memory[low + LEVEL]))


@njit(cache=True)
def forces_along(q: Array, step: float, memory: Array) -> Array:
    """Force of all parts along a motion that is straight between its samples, shape (n,).

    Parameters
    ----------
    q : ndarray, shape (n,)
        Deflection.
    step : float
        Sampling interval [s].
    memory : ndarray
        :func:`carrierflex.simulation.element.memory_laws.flat_parts`; states are changed.
    """
    force = np.empty(q.size)
    last = q[0]
    for i in range(q.size):
        remember(q[i] - last, step, memory, 0)
        force[i] = memory_force(q[i], 0.0, 0.0, memory, 0)
        last = q[i]
    return force
