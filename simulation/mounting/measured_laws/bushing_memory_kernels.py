"""Compiled motion of the parts with a memory in the planes of both bushings.

A stop is a spring in series with dry friction (Jenkins element; Iwan, J. Appl. Mech. 33 (1966)
893). It acts in y and in z apart, ``force clip(z, -1, 1)`` of each direction alone, or radially: z
is a vector in the plane, which returns along its own direction where it is longer than 1. Or it
gives way smoothly along its path, ``dz = (du - |du| z) / yield deflection`` (Dahl, 1968), so that
it forgets in small loops what it held. A branch is a spring in series with a damper (Maxwell),
``dq/dt = du/dt - q / tau``, the same in y and in z. Parts are relaxed where a record begins.

Parts stand behind the tables in one flat array, with their states and the room in which a step is
tried. A straight motion from one state to the next is exact for branches and for stops that act in
y and in z apart or give way smoothly; of stops in the plane that do not it is where they slip or
stick throughout.
"""

from collections.abc import Sequence

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Place, in the array of all laws, of the index at which the parts begin; 0 where there are none.
FIRST_PART = 1
#: Elements: starboard and port in z, starboard and port in y.
_N = 4
#: Numbers of stops and of branches, and time of one move [s], before the rows.
_HEAD, _STRIDE = 3, 2
#: Values of a stop (acts, bushing, yield deflection, force) and of a branch (bushing, relaxation
#: time, stiffness, what is left of the spring after a move, and what is added per deflection).
_STOP, _BRANCH = 4, 5
#: Room behind the rows: moves of the elements, forces at the middle and at the end of a step.
_MOVES, _FORCES = 0, _N
_ROOM = 3 * _N
#: States of a part by element: at the beginning of a step, at its middle, at its end.
BEGIN = 0
MIDDLE = _N
END = 2 * _N
_STATES = 3 * _N


def flat_parts(
    stops: Sequence[tuple[float, float, float, float]],
    branches: Sequence[tuple[float, float, float]],
) -> list[float]:
    """Parts, relaxed, with the room for a step.

    Parameters
    ----------
    stops : sequence of (float, float, float, float)
        Numbers of way and bushing, yield deflection, force at slip.
    branches : sequence of (float, float, float)
        Number of the bushing, relaxation time, stiffness.
    """
    values = [float(len(stops)), float(len(branches)), 0.0]
    for stop in stops:
        values += stop
    for branch in branches:
        values += [*branch, 1.0, 1.0]
    n_parts = len(stops) + len(branches)
    return [*values, *[0.0] * (_ROOM + n_parts * _STATES)]


def moved_every(laws: Array, seconds: float) -> Array:
    """Copy of packed laws whose parts move once in so many seconds.

    Parameters
    ----------
    laws : ndarray
        Packed laws.
    seconds : float
        Time of one move: half a step of the march, a step of a record.
    """
    moved = laws.copy()
    first = int(moved[FIRST_PART])
    if not first:
        return moved
    moved[first + _STRIDE] = seconds
    at = first + _HEAD + _STOP * int(moved[first])
    for row in range(at, at + _BRANCH * int(moved[first + 1]), _BRANCH):
        tau = moved[row + 1]
        decay = np.exp(-seconds / tau)
        moved[row + 3] = decay
        moved[row + 4] = tau / seconds * (1.0 - decay)
    return moved


def states_of(laws: Array) -> Array:
    """States of the parts of packed laws, which may be written to; empty where there are none."""
    first = int(laws[FIRST_PART])
    if not first:
        return laws[:0]
    return laws[laws.size - _STATES * int(laws[first] + laws[first + 1]) :]


def springs_of(laws: Array) -> Array:
    """Stiffness of the parts that stick, by bushing, shape (2,) [N/m]."""
    springs = np.zeros(2)
    first = int(laws[FIRST_PART])
    if not first:
        return springs
    at = first + _HEAD
    for _ in range(int(laws[first])):
        springs[_bushings(laws[at + 1])] += laws[at + 3] / laws[at + 2]
        at += _STOP
    for _ in range(int(laws[first + 1])):
        springs[_bushings(laws[at])] += laws[at + 2]
        at += _BRANCH
    return springs


def _bushings(number: float) -> slice:
    return slice(0, 2) if number < 0.0 else slice(int(number), int(number) + 1)


@njit(cache=True, nogil=True, error_model="numpy")
def move_parts(laws, source, target, forces):  # type: ignore[no-untyped-def]
    """Move every part by the moves of the elements; set their forces.

    Parameters
    ----------
    laws : ndarray
        Packed laws; states and forces are changed.
    source, target : int
        Which states the move begins with and which it leaves.
    forces : int
        Which forces it sets: those of :data:`MIDDLE` or of :data:`END`.
    """
    first = int(laws[FIRST_PART])
    n_stops, n_branches = int(laws[first]), int(laws[first + 1])
    room = _room(laws)
    moves = room + _MOVES
    out = room + _FORCES + (0 if forces == MIDDLE else _N)
    for e in range(_N):
        laws[out + e] = 0.0
    row = first + _HEAD
    state = room + _ROOM
    for _ in range(n_stops):
        for bushing in range(2):
            if laws[row + 1] < 0.0 or int(laws[row + 1]) == bushing:
                in_z = laws[state + source + bushing] + laws[moves + bushing] / laws[row + 2]
                in_y = laws[state + source + bushing + 2]
                in_y += laws[moves + bushing + 2] / laws[row + 2]
                if laws[row] > 1.5:
                    move_z = laws[moves + bushing] / laws[row + 2]
                    move_y = laws[moves + bushing + 2] / laws[row + 2]
                    way = np.hypot(move_z, move_y)
                    decay = np.exp(-way)
                    # Of what it held a share stays; the rest is now along the move.
                    gone = (1.0 - decay) / way if way > 0.0 else 0.0
                    in_z = decay * (in_z - move_z) + gone * move_z
                    in_y = decay * (in_y - move_y) + gone * move_y
                elif laws[row] > 0.5:
                    size = max(np.hypot(in_z, in_y), 1.0)
                    in_z /= size
                    in_y /= size
                else:
                    in_z = min(max(in_z, -1.0), 1.0)
                    in_y = min(max(in_y, -1.0), 1.0)
                laws[state + target + bushing] = in_z
                laws[state + target + bushing + 2] = in_y
                laws[out + bushing] += laws[row + 3] * in_z
                laws[out + bushing + 2] += laws[row + 3] * in_y
        row += _STOP
        state += _STATES
    for _ in range(n_branches):
        for e in range(_N):
            if laws[row] < 0.0 or int(laws[row]) == e % 2:
                spring = laws[row + 3] * laws[state + source + e] + laws[row + 4] * laws[moves + e]
                laws[state + target + e] = spring
                laws[out + e] += laws[row + 2] * spring
        row += _BRANCH
        state += _STATES


@njit(cache=True, nogil=True, error_model="numpy")
def try_step(laws, before, preload, probe):  # type: ignore[no-untyped-def]
    """Move every part through the middle of a step to its end; the beginning stays as it is.

    Parameters
    ----------
    laws : ndarray
        Packed laws.
    before : ndarray, shape (4,)
        Deflections where the step begins [m].
    preload : ndarray, shape (4,)
        Deflections under gravity [m].
    probe : ndarray
        Deflections beside these at the middle of the step, then at its end, 4 each [m].
    """
    moves = _room(laws) + _MOVES
    for e in range(_N):
        laws[moves + e] = preload[e] + probe[e] - before[e]
    move_parts(laws, BEGIN, MIDDLE, MIDDLE)
    for e in range(_N):
        laws[moves + e] = probe[_N + e] - probe[e]
    move_parts(laws, MIDDLE, END, END)


@njit(cache=True, nogil=True, error_model="numpy")
def tried_forces(laws):  # type: ignore[no-untyped-def]
    """Where the forces of the step that was tried stand: 4 at its middle, 4 at its end."""
    return _room(laws) + _FORCES


@njit(cache=True, nogil=True, error_model="numpy")
def keep_step(laws):  # type: ignore[no-untyped-def]
    """Take the step that was tried: the next one begins where it ends."""
    first = int(laws[FIRST_PART])
    state = _room(laws) + _ROOM
    for _ in range(int(laws[first]) + int(laws[first + 1])):
        for e in range(_N):
            laws[state + BEGIN + e] = laws[state + END + e]
        state += _STATES


@njit(cache=True, nogil=True, error_model="numpy")
def _room(laws):  # type: ignore[no-untyped-def]
    first = int(laws[FIRST_PART])
    return first + _HEAD + _STOP * int(laws[first]) + _BRANCH * int(laws[first + 1])


@njit(cache=True, nogil=True, error_model="numpy")
def part_forces(laws, u):  # type: ignore[no-untyped-def]
    """Forces of the parts along a run that is straight between its samples.

    Parameters
    ----------
    laws : ndarray
        Packed laws that move every step of the run, relaxed at its first sample; states are
        changed.
    u : ndarray, shape (2, 2, n)
        Deflection of starboard and port bushing in y and in z [m].

    Returns
    -------
    ndarray, shape (2, 2, n)
        Forces [N].
    """
    forces = np.zeros(u.shape)
    room = _room(laws)
    for k in range(1, u.shape[2]):
        for e in range(_N):
            b, d = e % 2, 1 - e // 2
            laws[room + _MOVES + e] = u[b, d, k] - u[b, d, k - 1]
        move_parts(laws, BEGIN, BEGIN, END)
        for e in range(_N):
            forces[e % 2, 1 - e // 2, k] = laws[room + _FORCES + _N + e]
    return forces
