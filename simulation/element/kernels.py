"""Compiled laws of one element and its motion under a force; parameters in one flat array.

Restoring force ``R(q, v) = f0 + K1 q + C1 v + effects``, positive against positive deflection;
under a force drive ``m q'' = force - R`` (classical Runge-Kutta, steps end where dry friction stops
the motion, which then sticks without creep), under a displacement drive ``force = m q'' + R``.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numba import cfunc, njit, types
from numpy.typing import NDArray

from carrierflex.simulation.element.memory_kernels import (
    friction_by_place,
    memory_force,
    remember,
    rubs_by_place,
)
from carrierflex.simulation.force_laws import LAW_SIGNATURE, Force

Array = NDArray[np.float64]


class ElementSlots(NamedTuple):
    """Index of every value in the flat array; an effect's own names are in `effects`.

    In the file of the compiled laws: numba's cache follows changes of this file alone.
    """

    m: int
    K1: int
    C1: int
    f0: int
    K2: int
    K3: int
    K5: int
    C_vv: int
    C_v3: int
    C_q2v: int
    F_plus: int
    F_minus: int
    F_stribeck: int
    v_s: int
    Kp: int
    Fy: int
    gap: int
    k: int
    tau: int


N_SLOTS = len(ElementSlots._fields)
SLOT = ElementSlots(*range(N_SLOTS))
#: Values that divide: one where their effect is absent.
_DIVISORS = (SLOT.v_s, SLOT.tau)


def element_values(values: Mapping[str, float]) -> Array:
    """Flat array of some values by name, all others absent; shape (N_SLOTS,)."""
    flat = np.zeros(N_SLOTS)
    flat[list(_DIVISORS)] = 1.0
    for name, value in values.items():
        flat[getattr(SLOT, name)] = value
    return flat


_Smooth = tuple[float, float, float, float, float, float, float, float, float]
_Hard = tuple[float, float, float, float, float]
#: Drive at the beginning, in the middle and at the end of a step.
_Drive = tuple[float, float, float]
_array = types.Array(types.float64, 1, "C")
_matrix = types.Array(types.float64, 2, "C")
_law = types.FunctionType(LAW_SIGNATURE)
#: Motion beyond this many times the measured one is a model that runs away.
RUNAWAY = 1e3


@cfunc(LAW_SIGNATURE, cache=True)
def no_law(q: float, v: float, p: Array) -> float:
    """No force: stands where the user gave no law."""
    return 0.0


@njit(cache=True, inline="always")
def _smooth_force(q: float, v: float, values: _Smooth) -> float:
    """Force of springs and dampers without memory, save linear damping.

    Polynomials by Horner's rule.
    """
    f0, K1, K2, K3, K5, C_vv, C_v3, C_q2v, slack = values
    q2 = q * q
    gap = max(slack, 0.0)
    force = f0 + q * (K1 + q * K2 + q2 * (K3 + q2 * K5))
    force += v * (C_vv * abs(v) + C_v3 * v * v + C_q2v * q2)
    return force - K1 * min(max(q, -gap), gap)


@njit(cache=True, inline="always")
def _smooth_values(p: Array) -> _Smooth:
    """Values of :func:`_smooth_force`."""
    return (
        p[SLOT.f0], p[SLOT.K1], p[SLOT.K2], p[SLOT.K3], p[SLOT.K5],
        p[SLOT.C_vv], p[SLOT.C_v3], p[SLOT.C_q2v], p[SLOT.gap],
    )  # fmt: skip


@njit(cache=True, inline="always")
def _smooth_values_of(p: Array, s: int) -> _Smooth:
    """Values of :func:`_smooth_force` of one of several parameter sets."""
    return (
        p[SLOT.f0, s], p[SLOT.K1, s], p[SLOT.K2, s], p[SLOT.K3, s], p[SLOT.K5, s],
        p[SLOT.C_vv, s], p[SLOT.C_v3, s], p[SLOT.C_q2v, s], p[SLOT.gap, s],
    )  # fmt: skip


@njit(cache=True, inline="always")
def _friction_level(q: float, v: float, sign: float, p: Array) -> float:
    """Dry friction in one direction at some deflection and speed, with its rise towards rest."""
    level = p[SLOT.F_plus] if sign > 0.0 else p[SLOT.F_minus]
    if p[SLOT.F_stribeck] > 0.0:
        level += p[SLOT.F_stribeck] * np.exp(-((v / p[SLOT.v_s]) ** 2))
    if p.size > N_SLOTS:
        level += friction_by_place(q, p, N_SLOTS)
    return level


@njit(cache=True, inline="always")
def _stage_forces(
    q: float, v: float, moved: float, elapsed: float, slider: float, sign: float,
    p: Array, law_1: Force, law_2: Force, p_1: Array, p_2: Array,
) -> float:  # fmt: skip
    """Restoring force of everything but the Maxwell branch; of dry friction in its direction."""
    force = _smooth_force(q, v, _smooth_values(p)) + p[SLOT.C1] * v
    if p_1.size:
        force += law_1(q, v, p_1)
    if p_2.size:
        force += law_2(q, v, p_2)
    if p[SLOT.Kp] > 0.0:
        force += min(max(slider + p[SLOT.Kp] * moved, -p[SLOT.Fy]), p[SLOT.Fy])
    if p.size > N_SLOTS:
        force += memory_force(q, moved, elapsed, p, N_SLOTS)
    if sign != 0.0:
        force += sign * _friction_level(q, v, sign, p)
    return force


@njit(cache=True)
def _runge_kutta(
    q: float, v: float, branch: float, slider: float, drive: _Drive, h: float, sign: float,
    p: Array, law_1: Force, law_2: Force, p_1: Array, p_2: Array,
) -> tuple[float, float, float]:  # fmt: skip
    """One step of the classical method.

    The direction of dry friction is held. Returns q, v and the branch's force.
    """
    mass, k, half = p[SLOT.m], p[SLOT.k], 0.5 * h
    rate = 1.0 / p[SLOT.tau] if k > 0.0 else 0.0
    u1, u2, u3 = drive
    f1 = branch + _stage_forces(q, v, 0.0, 0.0, slider, sign, p, law_1, law_2, p_1, p_2)
    a1, d1 = (u1 - f1) / mass, k * v - rate * branch
    q2, v2, b2 = q + half * v, v + half * a1, branch + half * d1
    f2 = b2 + _stage_forces(q2, v2, q2 - q, half, slider, sign, p, law_1, law_2, p_1, p_2)
    a2, d2 = (u2 - f2) / mass, k * v2 - rate * b2
    q3, v3, b3 = q + half * v2, v + half * a2, branch + half * d2
    f3 = b3 + _stage_forces(q3, v3, q3 - q, half, slider, sign, p, law_1, law_2, p_1, p_2)
    a3, d3 = (u2 - f3) / mass, k * v3 - rate * b3
    q4, v4, b4 = q + h * v3, v + h * a3, branch + h * d3
    f4 = b4 + _stage_forces(q4, v4, q4 - q, h, slider, sign, p, law_1, law_2, p_1, p_2)
    a4, d4 = (u3 - f4) / mass, k * v4 - rate * b4
    sixth = h / 6.0
    return (
        q + sixth * (v + 2.0 * (v2 + v3) + v4),
        v + sixth * (a1 + 2.0 * (a2 + a3) + a4),
        branch + sixth * (d1 + 2.0 * (d2 + d3) + d4),
    )


@njit(cache=True, nogil=True)
def goes_together(p: Array, n_further: int) -> bool:
    """Whether :func:`motions_together` takes a parameter set, beside so many further values.

    Not with dry friction that rises towards rest, and not with parts with a memory.
    """
    return p[SLOT.F_stribeck] == 0.0 and n_further + p.size == N_SLOTS


@njit(cache=True, nogil=True, inline="always")
def _drive_of_step(force: Array, column: int, j: int, start: float, length: float) -> _Drive:
    """Drive at the three stages of a part of step `j`.

    A parabola through its beginning, middle and end.
    """
    u0, u1, u2 = force[2 * j, column], force[2 * j + 1, column], force[2 * j + 2, column]
    slope, bend = 4.0 * u1 - 3.0 * u0 - u2, 2.0 * (u0 - 2.0 * u1 + u2)
    middle, end = start + 0.5 * length, start + length
    return (
        u0 + start * (slope + start * bend),
        u0 + middle * (slope + middle * bend),
        u0 + end * (slope + end * bend),
    )


@njit(cache=True, nogil=True, inline="always")
def _breaks_loose(net: float, q: float, p: Array) -> float:
    """Direction in which a net force moves a body at rest at q against dry friction.

    0 where it sticks.
    """
    if net > _friction_level(q, 0.0, 1.0, p):
        return 1.0
    return -1.0 if net < -_friction_level(q, 0.0, -1.0, p) else 0.0


@njit(cache=True, nogil=True)
def _one_step(
    q: float, v: float, branch: float, slider: float, h: float, rubs: bool,
    force: Array, column: int, j: int,
    p: Array, law_1: Force, law_2: Force, p_1: Array, p_2: Array,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Deflection, speed, force of the branch and of the slider after step `j` of one motion.

    With dry friction a part of the step ends where the speed passes zero; there it sticks or goes
    on.
    """
    remaining, time = h, 0.0
    for _ in range(3):
        drive = _drive_of_step(force, column, j, time, remaining / h)
        sign = np.sign(v) if rubs else 0.0
        if rubs and v == 0.0:
            net = drive[0] - branch - _stage_forces(
                q, v, 0.0, 0.0, slider, 0.0, p, law_1, law_2, p_1, p_2
            )  # fmt: skip
            sign = _breaks_loose(net, q, p)
            if sign == 0.0:
                branch *= np.exp(-remaining / p[SLOT.tau])
                if p.size > N_SLOTS:
                    remember(0.0, remaining, p, N_SLOTS)
                break
        q1, v1, b1 = _runge_kutta(
            q, v, branch, slider, drive, remaining, sign, p, law_1, law_2, p_1, p_2
        )
        reverses = sign != 0.0 and v1 * sign < 0.0
        share = v / (v - v1) if reverses and v != 0.0 else 1.0
        if share < 1.0:
            drive = _drive_of_step(force, column, j, time, share * remaining / h)
            q1, v1, b1 = _runge_kutta(
                q, v, branch, slider, drive, share * remaining, sign, p, law_1, law_2, p_1, p_2
            )
        v1 = 0.0 if reverses else v1
        slider = min(max(slider + p[SLOT.Kp] * (q1 - q), -p[SLOT.Fy]), p[SLOT.Fy])
        if p.size > N_SLOTS:
            remember(q1 - q, share * remaining, p, N_SLOTS)
        q, v, branch = q1, v1, b1
        time += share * remaining / h
        remaining *= 1.0 - share
        if remaining <= 1e-9 * h:
            break
    return q, v, branch, slider


@njit(cache=True, inline="always")
def _of_cells(at: float, cells: Array, first: float, per_node: float) -> float:
    """Value of a table with even nodes, see :func:`motions_together`."""
    last = cells.shape[1] - 1
    position = 1.0 + (at - first) * per_node
    # What is no number, of a motion that has run away, is taken as below the first node.
    position = position if position > 0.0 else 0.0
    k = int(position if position < last else last)
    return float(cells[1, k] + cells[2, k] * (at - cells[0, k]))


@njit(cache=True, inline="always")
def _force_together(
    q: float, v: float, moved: float, slider: float, sign: float, smooth: _Smooth, hard: _Hard
) -> float:
    """Restoring force of one of several motions but for its Maxwell branch and its table."""
    C1, Kp, Fy, F_plus, F_minus = hard
    force = _smooth_force(q, v, smooth) + C1 * v + min(max(slider + Kp * moved, -Fy), Fy)
    return force + F_plus * max(sign, 0.0) + F_minus * min(sign, 0.0)


@njit(cache=True, inline="always")
def _hard_values_of(p: Array, s: int) -> _Hard:
    """Values of :func:`_force_together` beside those of :func:`_smooth_values_of`."""
    return (
        p[SLOT.C1, s], p[SLOT.Kp, s], p[SLOT.Fy, s], p[SLOT.F_plus, s], p[SLOT.F_minus, s],
    )  # fmt: skip


@njit(
    types.UniTuple(_matrix, 2)(
        _matrix, types.Array(types.int64, 1, "C"), _matrix, types.int64,
        _matrix, _matrix, _matrix, _law, _matrix,
    ),
    cache=True,
    nogil=True,
)  # fmt: skip
def motions_together(
    force: Array, drive: NDArray[np.int64], state: Array, substeps: int,
    p: Array, limits: Array, cells: Array, law: Force, p_law: Array,
) -> tuple[Array, Array]:  # fmt: skip
    """Motions of several records and parameter sets of which :func:`goes_together` is true.

    They go step by step together, so that one instruction of the processor serves several; those
    that turn or rest in dry friction go through that step alone.

    Parameters
    ----------
    force : ndarray, shape (2 * n * substeps + 1, n_drives)
        Drives at the beginning and in the middle of every step.
    drive : ndarray of int, shape (m,)
        Number of the drive of each motion.
    state : ndarray, shape (4, m)
        Deflections, speeds, forces of Maxwell branches and of sliders at the first sample; after
        the call those after the last step, infinite where a motion has run away.
    substeps : int
        Steps a sample.
    p : ndarray, shape (N_SLOTS + 2, m)
        Parameters, see ElementSlots, and two factors of the table: as a force, and times the speed.
    limits : ndarray, shape (2, m)
        Time step; deflection beyond which a motion runs away.
    cells : ndarray, shape (3, n_nodes + 1)
        Table over the deflection, its nodes evenly spaced: node, value there and slope of the cell
        below the first node, of those between, and of that above the last; or shape (3, 0).
    law : callable
        Law that the table is.
    p_law : ndarray, shape (m, n_parameters)
        Its parameters; shape (m, 0) where there is none.

    Returns
    -------
    tuple of ndarray, shape (n, m)
        Deflections and speeds; infinite from where a motion runs away.
    """
    m = p.shape[1]
    n = (len(force) - 1) // (2 * substeps)
    deflection, speed = np.full((n, m), np.inf), np.full((n, m), np.inf)
    q, v, b, f = state[0].copy(), state[1].copy(), state[2].copy(), state[3].copy()
    next_q, next_v, next_b = np.empty(m), np.empty(m), np.empty(m)
    h, size = limits[0].copy(), limits[1].copy()
    u1, u2, u3 = np.empty(m), np.empty(m), np.empty(m)
    t1, t2, t3, t4 = np.zeros(m), np.zeros(m), np.zeros(m), np.zeros(m)
    at3, at4 = np.empty(m), np.empty(m)
    first, per_node = 0.0, 0.0
    if cells.shape[1]:
        first = cells[0, 0]
        per_node = (cells.shape[1] - 2) / (cells[0, -1] - first)
    rate, inverse, bounded = np.zeros(m), np.empty(m), np.full(m, True)
    sign, rubs = np.zeros(m), np.full(m, False)
    for s in range(m):
        if p[SLOT.k, s] > 0.0:
            rate[s] = 1.0 / p[SLOT.tau, s]
        inverse[s] = 1.0 / p[SLOT.m, s]
        rubs[s] = p[SLOT.F_plus, s] + p[SLOT.F_minus, s] > 0.0
    any_rubs = rubs.any()
    sets, none = np.ascontiguousarray(p[:N_SLOTS].T), np.empty(0)
    for i in range(n):
        for s in range(m):
            bounded[s] = bounded[s] and abs(q[s]) < size[s]
            if bounded[s]:
                deflection[i, s], speed[i, s] = q[s], v[s]
        if not bounded.any():
            break
        for j in range(i * substeps, (i + 1) * substeps):
            for s in range(m):
                column = drive[s]
                u1[s], u2[s] = force[2 * j, column], force[2 * j + 1, column]
                u3[s] = force[2 * j + 2, column]
            if any_rubs:
                for s in range(m):
                    sign[s] = np.sign(v[s]) if rubs[s] else 0.0
            if cells.shape[1]:
                # Look-ups are no vector instructions: two of them at a time, beside the loops.
                for s in range(m):
                    t1[s] = _of_cells(q[s], cells, first, per_node)
                    t2[s] = _of_cells(q[s] + 0.5 * h[s] * v[s], cells, first, per_node)
                for s in range(m):
                    half, k, q1, v1, b1 = 0.5 * h[s], p[SLOT.k, s], q[s], v[s], b[s]
                    smooth, hard = _smooth_values_of(p, s), _hard_values_of(p, s)
                    factor, damped = p[N_SLOTS, s], p[N_SLOTS + 1, s]
                    f1 = _force_together(q1, v1, 0.0, f[s], sign[s], smooth, hard) + b1
                    a1 = (u1[s] - f1 - t1[s] * (factor + damped * v1)) * inverse[s]
                    q2, v2 = q1 + half * v1, v1 + half * a1
                    b2 = b1 + half * (k * v1 - rate[s] * b1)
                    f2 = _force_together(q2, v2, q2 - q1, f[s], sign[s], smooth, hard) + b2
                    a2 = (u2[s] - f2 - t2[s] * (factor + damped * v2)) * inverse[s]
                    at3[s], at4[s] = q1 + half * v2, q1 + h[s] * (v1 + half * a2)
                for s in range(m):
                    t3[s] = _of_cells(at3[s], cells, first, per_node)
                    t4[s] = _of_cells(at4[s], cells, first, per_node)
            for s in range(m):
                k, w, half = p[SLOT.k, s], inverse[s], 0.5 * h[s]
                smooth, hard = _smooth_values_of(p, s), _hard_values_of(p, s)
                factor, damped = p[N_SLOTS, s], p[N_SLOTS + 1, s]
                q1, v1, b1 = q[s], v[s], b[s]
                f1 = _force_together(q1, v1, 0.0, f[s], sign[s], smooth, hard)
                a1 = (u1[s] - f1 - b1 - t1[s] * (factor + damped * v1)) * w
                d1 = k * v1 - rate[s] * b1
                q2, v2, b2 = q1 + half * v1, v1 + half * a1, b1 + half * d1
                f2 = _force_together(q2, v2, q2 - q1, f[s], sign[s], smooth, hard)
                a2 = (u2[s] - f2 - b2 - t2[s] * (factor + damped * v2)) * w
                d2 = k * v2 - rate[s] * b2
                q3, v3, b3 = q1 + half * v2, v1 + half * a2, b1 + half * d2
                f3 = _force_together(q3, v3, q3 - q1, f[s], sign[s], smooth, hard)
                a3 = (u2[s] - f3 - b3 - t3[s] * (factor + damped * v3)) * w
                d3 = k * v3 - rate[s] * b3
                q4, v4, b4 = q1 + h[s] * v3, v1 + h[s] * a3, b1 + h[s] * d3
                f4 = _force_together(q4, v4, q4 - q1, f[s], sign[s], smooth, hard)
                a4 = (u3[s] - f4 - b4 - t4[s] * (factor + damped * v4)) * w
                d4 = k * v4 - rate[s] * b4
                sixth = h[s] / 6.0
                next_q[s] = q1 + sixth * (v1 + 2.0 * (v2 + v3) + v4)
                next_v[s] = v1 + sixth * (a1 + 2.0 * (a2 + a3) + a4)
                next_b[s] = b1 + sixth * (d1 + 2.0 * (d2 + d3) + d4)
            if any_rubs:
                for s in range(m):
                    if rubs[s] and (sign[s] == 0.0 or next_v[s] * sign[s] < 0.0):
                        next_q[s], next_v[s], next_b[s], f[s] = _one_step(
                            q[s], v[s], b[s], f[s], h[s], True, force, drive[s], j,
                            sets[s], law, law, p_law[s], none,
                        )  # fmt: skip
                        # Its slider has gone on.
                        q[s] = next_q[s]
            for s in range(m):
                Fy = p[SLOT.Fy, s]
                f[s] = min(max(f[s] + p[SLOT.Kp, s] * (next_q[s] - q[s]), -Fy), Fy)
                q[s], v[s], b[s] = next_q[s], next_v[s], next_b[s]
    for s in range(m):
        state[0, s], state[1, s], state[2, s], state[3, s] = q[s], v[s], b[s], f[s]
        if not bounded[s]:
            state[0, s] = np.inf
    return deflection, speed


@njit(
    types.UniTuple(_array, 2)(
        _array, _array, types.int64, _array, _array, _law, _law, _array, _array
    ),
    cache=True,
    nogil=True,
)
def driven_motion(
    force: Array, state: Array, substeps: int,
    p: Array, limits: Array, law_1: Force, law_2: Force, p_1: Array, p_2: Array,
) -> tuple[Array, Array]:  # fmt: skip
    """Deflection and speed under a force, at every sample.

    Parameters
    ----------
    force : ndarray, shape (2 * n * substeps + 1,)
        Drive at the beginning and in the middle of every step.
    state : ndarray, shape (2,)
        Deflection and speed at the first sample.
    substeps : int
        Steps a sample.
    p : ndarray, shape (N_SLOTS + n,)
        Parameters, see ElementSlots, and parts with a memory behind them, see
        :func:`carrierflex.simulation.element.memory_laws.flat_parts`.
    limits : ndarray, shape (2,)
        Time step, size of the measured deflection.
    law_1, law_2, p_1, p_2
        Users' laws and their parameters; no parameters where there is no law.

    Returns
    -------
    tuple of ndarray, shape (n,)
        Deflection and speed; infinite from where the motion runs away.
    """
    h, size = limits[0], RUNAWAY * limits[1]
    n = (force.size - 1) // (2 * substeps)
    deflection, speed = np.full(n, np.inf), np.full(n, np.inf)
    rubs = p[SLOT.F_plus] + p[SLOT.F_minus] + p[SLOT.F_stribeck] > 0.0
    rubs = rubs or rubs_by_place(p, N_SLOTS)
    q, v = state[0], state[1]
    branch, slider = 0.0, 0.0
    # States of the parts with a memory stand in it.
    p = p.copy()
    drive = force.reshape(force.size, 1)
    for i in range(n):
        if not abs(q) < size:
            break
        deflection[i], speed[i] = q, v
        for j in range(i * substeps, (i + 1) * substeps):
            q, v, branch, slider = _one_step(
                q, v, branch, slider, h, rubs, drive, 0, j, p, law_1, law_2, p_1, p_2
            )
    return deflection, speed


@njit(
    _array(_array, _array, _array, _array, _array, _law, _law, _array, _array),
    cache=True,
    nogil=True,
)
def restoring_force(
    q: Array, v: Array, acceleration: Array,
    p: Array, limits: Array, law_1: Force, law_2: Force, p_1: Array, p_2: Array,
) -> Array:  # fmt: skip
    """Force that a given motion needs, at every sample.

    Parameters
    ----------
    q, v, acceleration : ndarray, shape (n,)
        Motion.
    p : ndarray, shape (N_SLOTS + n,)
        Parameters, see ElementSlots, and parts with a memory behind them, see
        :func:`carrierflex.simulation.element.memory_laws.flat_parts`.
    limits : ndarray, shape (2,)
        Time step; speed below which the sign of the motion is uncertain.
    law_1, law_2, p_1, p_2
        Users' laws and their parameters.

    Returns
    -------
    ndarray, shape (n,)
        ``m q'' + R``.
    """
    h, v_rest = limits[0], limits[1]
    force = np.empty(q.size)
    slider, branch = 0.0, 0.0
    decay = np.exp(-h / p[SLOT.tau]) if p[SLOT.k] > 0.0 else 0.0
    gain = p[SLOT.k] * p[SLOT.tau] / h * (1.0 - decay)
    p = p.copy()
    for i in range(q.size):
        total = (
            p[SLOT.m] * acceleration[i]
            + p[SLOT.C1] * v[i]
            + _smooth_force(q[i], v[i], _smooth_values(p))
        )
        if p_1.size:
            total += law_1(q[i], v[i], p_1)
        if p_2.size:
            total += law_2(q[i], v[i], p_2)
        sign = np.tanh(v[i] / v_rest)
        total += sign * _friction_level(q[i], v[i], sign, p)
        moved = q[i] - q[i - 1] if i else 0.0
        slider = min(max(slider + p[SLOT.Kp] * moved, -p[SLOT.Fy]), p[SLOT.Fy])
        branch = decay * branch + gain * moved
        if p.size > N_SLOTS:
            remember(moved, h, p, N_SLOTS)
            total += memory_force(q[i], 0.0, 0.0, p, N_SLOTS)
        force[i] = total + slider + branch
    return force
