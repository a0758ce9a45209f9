"""Measured laws of the bushings: f, g with its rise at rest, h, linear between points.

Laws with a memory stand behind them in the same array
(:mod:`carrierflex.simulation.mounting.measured_laws.bushing_memory_kernels`).

A table acts in y and in z apart, ``f(u)``, ``g(v)``, ``h(u) v`` of each direction alone, or
radially: ``f(r) u / r`` along the deflection, ``g(w) v / w`` along the speed, ``h(r) v`` with the
sizes r and w of deflection and speed in the plane. Beyond its table a force goes on with the slope
of its end, damping with its end value. Forces are internal ones, positive against a positive
deflection.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from numba import njit
from numpy.typing import NDArray

from carrierflex.simulation.laws import (
    APART,
    BOTH,
    COUPLED_DAMPING,
    PORT,
    RADIAL,
    SMOOTH,
    STARBOARD,
    TABULATED,
    Branch,
    Law,
    Stop,
    Table,
    end_slopes,
)
from carrierflex.simulation.mounting.measured_laws.bushing_memory_kernels import (
    FIRST_PART,
    flat_parts,
    moved_every,
    part_forces,
)

Array = NDArray[np.float64]

#: Numbers that stand for these words in the packed tables.
_PLANES: Mapping[str, int] = {APART: 0, RADIAL: 1, SMOOTH: 2}
_BUSHINGS: Mapping[str, int] = {BOTH: -1, STARBOARD: 0, PORT: 1}
#: Numbers of a packed part before its points.
_HEAD = 7
#: Number of tables, and where the parts with a memory begin, before the tables.
_FIRST = 2
#: Step of a difference: share of the argument, and what stands in for it at rest [m, m/s].
_SHARE, _LEAST = 1e-5, 1e-9


def packed_laws(laws: Sequence[tuple[Law, float]]) -> Array:
    """Laws and their sizes as one array, which compiled code reads.

    Parameters
    ----------
    laws : sequence of (Law, float)
        Laws of kind mounting, each with the factor on its forces.

    Returns
    -------
    ndarray
        Number of tables, index of the parts with a memory (0 without); of each table its way,
        bushing, class, factor, slopes beyond it, number of points, x, y; parts as of
        :func:`carrierflex.simulation.mounting.measured_laws.bushing_memory_kernels.flat_parts`.
    """
    values = [0.0, 0.0]
    for law, size in laws:
        values[0] += len(law.of(Table))
        is_damping = law.effect_class == COUPLED_DAMPING
        for table in law.of(Table):
            low, high = (0.0, 0.0) if is_damping else end_slopes(table.x, table.y)
            values += [_PLANES[table.plane], _BUSHINGS[table.acts_on]]
            values += [TABULATED.index(law.effect_class), size, low, high, table.x.size]
            values += [*table.x.tolist(), *table.y.tolist()]
    stops = [
        (_PLANES[stop.plane], _BUSHINGS[stop.acts_on], stop.yield_deflection, size * stop.slip)
        for law, size in laws
        for stop in law.of(Stop)
    ]
    branches = [
        (_BUSHINGS[branch.acts_on], branch.tau, size * branch.stiffness)
        for law, size in laws
        for branch in law.of(Branch)
    ]
    if stops or branches:
        values[FIRST_PART] = float(len(values))
        values += flat_parts(stops, branches)
    return np.array(values, dtype=np.float64)


@njit(cache=True, nogil=True, error_model="numpy")
def bushing_force(tables, bushing, u, across, v, v_across):  # type: ignore[no-untyped-def]
    """Force of packed tables in one direction of one bushing.

    Parameters
    ----------
    tables : ndarray
        As of :func:`packed_laws`; parts with a memory are passed over.
    bushing : int
        0 starboard, 1 port.
    u, across : float
        Deflection in the direction and across it [m].
    v, v_across : float
        Speeds [m/s].

    Returns
    -------
    float
        Force [N].
    """
    total = 0.0
    at = _FIRST
    for _ in range(int(tables[0])):
        n = int(tables[at + 6])
        where = int(tables[at + 1])
        if where < 0 or where == bushing:
            kind = int(tables[at + 2])
            along, crosswise = (v, v_across) if kind == 1 else (u, across)
            is_radial = tables[at] > 0.5
            x = np.hypot(along, crosswise) if is_radial else along
            value = _interpolated(tables, at + _HEAD, n, x, tables[at + 4], tables[at + 5])
            if kind == 2:
                value *= v
            elif is_radial:
                value = value * along / x if x > 0.0 else 0.0
            total += tables[at + 3] * value
        at += _HEAD + 2 * n
    return total


@njit(cache=True, nogil=True, error_model="numpy")
def _interpolated(tables, first, n, x, low, high):  # type: ignore[no-untyped-def]
    """Value of one table at x, its points beginning at `first`."""
    last = first + n - 1
    if x <= tables[first]:
        return tables[first + n] + low * (x - tables[first])
    if x >= tables[last]:
        return tables[last + n] + high * (x - tables[last])
    left, right = first, last
    while right - left > 1:
        middle = (left + right) // 2
        if tables[middle] <= x:
            left = middle
        else:
            right = middle
    share = (x - tables[left]) / (tables[right] - tables[left])
    return tables[left + n] + share * (tables[right + n] - tables[left + n])


@njit(cache=True, nogil=True, error_model="numpy")
def bushing_slopes(tables, bushing, u, across, v, v_across):  # type: ignore[no-untyped-def]
    """Derivatives of :func:`bushing_force` by u, across, v, v_across, by central differences."""
    du = _SHARE * abs(u) + _LEAST
    dw = _SHARE * abs(across) + _LEAST
    dv = _SHARE * abs(v) + _LEAST
    dz = _SHARE * abs(v_across) + _LEAST
    return (
        (
            bushing_force(tables, bushing, u + du, across, v, v_across)
            - bushing_force(tables, bushing, u - du, across, v, v_across)
        )
        / (2.0 * du),
        (
            bushing_force(tables, bushing, u, across + dw, v, v_across)
            - bushing_force(tables, bushing, u, across - dw, v, v_across)
        )
        / (2.0 * dw),
        (
            bushing_force(tables, bushing, u, across, v + dv, v_across)
            - bushing_force(tables, bushing, u, across, v - dv, v_across)
        )
        / (2.0 * dv),
        (
            bushing_force(tables, bushing, u, across, v, v_across + dz)
            - bushing_force(tables, bushing, u, across, v, v_across - dz)
        )
        / (2.0 * dz),
    )


def bushing_forces(laws: Array, u: Array, v: Array, step: float) -> Array:
    """Forces along a run.

    Parameters
    ----------
    laws : ndarray
        As of :func:`packed_laws`.
    u, v : ndarray, shape (2, 2, n)
        Deflection [m] and speed [m/s] of starboard and port bushing in y and in z.
    step : float
        Sampling interval [s].

    Returns
    -------
    ndarray, shape (2, 2, n)
        Forces [N]; parts with a memory are relaxed at the first sample.
    """
    forces = _table_forces(laws, u, v)
    if laws[FIRST_PART]:
        forces += part_forces(moved_every(laws, step), np.ascontiguousarray(u))
    return np.asarray(forces)


@njit(cache=True, nogil=True, error_model="numpy")
def _table_forces(tables, u, v):  # type: ignore[no-untyped-def]
    """Forces of the tables along a run, shape (2, 2, n)."""
    forces = np.empty(u.shape)
    for b in range(2):
        for d in range(2):
            for k in range(u.shape[2]):
                forces[b, d, k] = bushing_force(
                    tables, b, u[b, d, k], u[b, 1 - d, k], v[b, d, k], v[b, 1 - d, k]
                )
    return forces
