"""Compiled laws of one element and its motion under a force; parameters in one flat array.

Restoring force ``R(q, v) = f0 + K1 q + C1 v + effects``, positive against positive deflection;
under a force drive ``m q'' = force - R`` (classical Runge-Kutta, steps end where dry friction stops
the motion, which then sticks without creep), under a displacement drive ``force = m q'' + R``.
"""

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

#: Places of the parameters in the flat array.
SLOTS = (
    *(
        "m",
        "K1",
        "C1",
        "f0",
        "K2",
        "K3",
        "K5",
        "C_v|v|",
        "C_v3",
        "C_q2v",
        "F_plus",
        "F_minus",
        "F_stribeck",
        "v_s",
    ),
    *("Kp", "Fy", "gap", "k", "tau", "delay", "placebo_1", "placebo_2"),
)
SLOT = {name: place for place, name in enumerate(SLOTS)}
(
    _M,
    _K1,
    _C1,
    _F0,
    _K2,
    _K3,
    _K5,
    _CVV,
    _CV3,
    _CQV,
    _FP,
    _FM,
    _FS,
    _VS,
    _KP,
    _FY,
    _GAP,
    _K,
    _TAU,
    _,
    _,
    _,
) = range(len(SLOTS))

_array = types.Array(types.float64, 1, "C")
#: What a user's law is compiled to: force of deflection, speed and its own parameters.
LAW_SIGNATURE = types.float64(types.float64, types.float64, _array)
_law = types.FunctionType(LAW_SIGNATURE)
#: Motion beyond this many times the measured one is a model that runs away.
_RUNAWAY = 1e3


@njit(LAW_SIGNATURE, cache=True)
def no_law(q: float, v: float, p: NDArray[np.float64]) -> float:
    """No force: stands where the user gave no law."""
    return 0.0


@njit(cache=True, inline="always")
def _smooth_force(q, v, p):  # type: ignore[no-untyped-def]
    """Force of springs and dampers without memory, save linear damping.

    Polynomials by Horner's rule.
    """
    q2 = q * q
    force = p[_F0] + q * (p[_K1] + q * p[_K2] + q2 * (p[_K3] + q2 * p[_K5]))
    force += v * (p[_CVV] * abs(v) + p[_CV3] * v * v + p[_CQV] * q2)
    if p[_GAP] > 0.0:
        force -= p[_K1] * min(max(q, -p[_GAP]), p[_GAP])
    return force


@njit(cache=True, inline="always")
def _friction_level(v, p):  # type: ignore[no-untyped-def]
    """Rise of the dry friction towards rest (Stribeck)."""
    return p[_FS] * np.exp(-((v / p[_VS]) ** 2)) if p[_FS] > 0.0 else 0.0


@njit(cache=True, inline="always")
def _stage_forces(q, v, moved, slider, p, law_1, law_2, p_1, p_2):  # type: ignore[no-untyped-def]
    """Restoring force of everything but the Maxwell branch and dry friction."""
    force = _smooth_force(q, v, p) + p[_C1] * v
    if p_1.size:
        force += law_1(q, v, p_1)
    if p_2.size:
        force += law_2(q, v, p_2)
    if p[_KP] > 0.0:
        force += min(max(slider + p[_KP] * moved, -p[_FY]), p[_FY])
    return force


@njit(cache=True)
def _runge_kutta(q, v, branch, slider, drive, h, sign, p, law_1, law_2, p_1, p_2):  # type: ignore[no-untyped-def]
    """One step of the classical method.

    The direction of dry friction is held. Returns q, v and the branch's force.
    """
    level = p[_FP] if sign > 0.0 else p[_FM]
    rate = 1.0 / p[_TAU] if p[_K] > 0.0 else 0.0
    dq, dv, db = 0.0, 0.0, 0.0
    sum_q, sum_v, sum_b = 0.0, 0.0, 0.0
    for stage in range(4):
        c = 0.0 if stage == 0 else (1.0 if stage == 3 else 0.5)
        w = 1.0 if stage == 0 or stage == 3 else 2.0
        u = drive[0] if stage == 0 else (drive[2] if stage == 3 else drive[1])
        own_q, own_v, own_b = q + c * h * dq, v + c * h * dv, branch + c * h * db
        force = _stage_forces(own_q, own_v, own_q - q, slider, p, law_1, law_2, p_1, p_2) + own_b
        if sign != 0.0:
            force += sign * (level + _friction_level(own_v, p))
        dq, dv, db = own_v, (u - force) / p[_M], p[_K] * own_v - rate * own_b
        sum_q, sum_v, sum_b = sum_q + w * dq, sum_v + w * dv, sum_b + w * db
    return q + h / 6.0 * sum_q, v + h / 6.0 * sum_v, branch + h / 6.0 * sum_b


@njit(cache=True)
def _smooth_motion(force, state, substeps, p, h, size, deflection, speed):  # type: ignore[no-untyped-def]
    """Motion without dry friction, sliders and users' laws, five times as fast.

    Fills the two arrays.
    """
    q, v, b = state[0], state[1], 0.0
    rate, half = 1.0 / p[_TAU] if p[_K] > 0.0 else 0.0, 0.5 * h
    inverse = 1.0 / p[_M]
    for i in range(deflection.size):
        if not abs(q) < size:
            break
        deflection[i], speed[i] = q, v
        for j in range(i * substeps, (i + 1) * substeps):
            a1 = (force[2 * j] - _smooth_force(q, v, p) - p[_C1] * v - b) * inverse
            b1 = p[_K] * v - rate * b
            q2, v2, b_2 = q + half * v, v + half * a1, b + half * b1
            a2 = (force[2 * j + 1] - _smooth_force(q2, v2, p) - p[_C1] * v2 - b_2) * inverse
            b2 = p[_K] * v2 - rate * b_2
            q3, v3, b_3 = q + half * v2, v + half * a2, b + half * b2
            a3 = (force[2 * j + 1] - _smooth_force(q3, v3, p) - p[_C1] * v3 - b_3) * inverse
            b3 = p[_K] * v3 - rate * b_3
            q4, v4, b_4 = q + h * v3, v + h * a3, b + h * b3
            a4 = (force[2 * j + 2] - _smooth_force(q4, v4, p) - p[_C1] * v4 - b_4) * inverse
            b4 = p[_K] * v4 - rate * b_4
            q += h / 6.0 * (v + 2.0 * (v2 + v3) + v4)
            v += h / 6.0 * (a1 + 2.0 * (a2 + a3) + a4)
            b += h / 6.0 * (b1 + 2.0 * (b2 + b3) + b4)


@njit(cache=True, nogil=True, inline="always")
def _drive_of_step(force, j, place, length, drive):  # type: ignore[no-untyped-def]
    """Drive at the three stages of a part of step `j`.

    A parabola through its beginning, middle and end.
    """
    u0, u1, u2 = force[2 * j], force[2 * j + 1], force[2 * j + 2]
    for k in range(3):
        t = place + 0.5 * k * length
        drive[k] = u0 + t * (4.0 * u1 - 3.0 * u0 - u2 + t * 2.0 * (u0 - 2.0 * u1 + u2))


@njit(cache=True, nogil=True, inline="always")
def _breaks_loose(net, p):  # type: ignore[no-untyped-def]
    """Direction in which a net force moves a body at rest against dry friction.

    0 where it sticks.
    """
    if net > p[_FP] + p[_FS]:
        return 1.0
    return -1.0 if net < -(p[_FM] + p[_FS]) else 0.0


@njit(
    types.UniTuple(_array, 2)(
        _array, _array, types.int64, _array, _array, _law, _law, _array, _array
    ),
    cache=True,
    nogil=True,
)
def driven_motion(force, state, substeps, p, limits, law_1, law_2, p_1, p_2):  # type: ignore[no-untyped-def]
    """Deflection and speed under a force, at every sample.

    Parameters
    ----------
    force : ndarray, shape (2 * n * substeps + 1,)
        Drive at the beginning and in the middle of every step.
    state : ndarray, shape (2,)
        Deflection and speed at the first sample.
    substeps : int
        Steps a sample.
    p : ndarray, shape (22,)
        Parameters, see SLOTS.
    limits : ndarray, shape (2,)
        Time step, size of the measured deflection.
    law_1, law_2, p_1, p_2
        Users' laws and their parameters; no parameters where there is no law.

    Returns
    -------
    tuple of ndarray, shape (n,)
        Deflection and speed; infinite from where the motion runs away.
    """
    h, size = limits[0], _RUNAWAY * limits[1]
    n = (force.size - 1) // (2 * substeps)
    deflection, speed = np.full(n, np.inf), np.full(n, np.inf)
    if p[_FP] + p[_FM] + p[_FS] + p[_KP] == 0.0 and p_1.size + p_2.size == 0:
        _smooth_motion(force, state, substeps, p, h, size, deflection, speed)
        return deflection, speed
    q, v, slider, branch = state[0], state[1], 0.0, 0.0
    rubs = p[_FP] + p[_FM] + p[_FS] > 0.0
    drive = np.empty(3)
    for i in range(n):
        if not abs(q) < size:
            break
        deflection[i], speed[i] = q, v
        for j in range(i * substeps, (i + 1) * substeps):
            left, place = h, 0.0
            # With dry friction a step ends where the speed passes zero; there it sticks or goes on.
            for _ in range(3):
                _drive_of_step(force, j, place, left / h, drive)
                sign = np.sign(v) if rubs else 0.0
                if rubs and v == 0.0:
                    net = (
                        drive[0]
                        - _stage_forces(q, v, 0.0, slider, p, law_1, law_2, p_1, p_2)
                        - branch
                    )
                    sign = _breaks_loose(net, p)
                    if sign == 0.0:
                        branch *= np.exp(-left / p[_TAU])
                        break
                q1, v1, b1 = _runge_kutta(
                    q, v, branch, slider, drive, left, sign, p, law_1, law_2, p_1, p_2
                )
                reverses = sign != 0.0 and v1 * sign < 0.0
                part = v / (v - v1) if reverses and v != 0.0 else 1.0
                if part < 1.0:
                    _drive_of_step(force, j, place, part * left / h, drive)
                    q1, v1, b1 = _runge_kutta(
                        q, v, branch, slider, drive, part * left, sign, p, law_1, law_2, p_1, p_2
                    )
                v1 = 0.0 if reverses else v1
                slider = min(max(slider + p[_KP] * (q1 - q), -p[_FY]), p[_FY])
                q, v, branch = q1, v1, b1
                place += part * left / h
                left *= 1.0 - part
                if left <= 1e-9 * h:
                    break
    return deflection, speed


@njit(
    _array(_array, _array, _array, _array, _array, _law, _law, _array, _array),
    cache=True,
    nogil=True,
)
def restoring_force(  # type: ignore[no-untyped-def]
    q, v, acceleration, p, limits, law_1, law_2, p_1, p_2
):
    """Force that a given motion needs, at every sample.

    Parameters
    ----------
    q, v, acceleration : ndarray, shape (n,)
        Motion.
    p : ndarray, shape (22,)
        Parameters, see SLOTS.
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
    decay = np.exp(-h / p[_TAU]) if p[_K] > 0.0 else 0.0
    gain = p[_K] * p[_TAU] / h * (1.0 - decay)
    for i in range(q.size):
        total = p[_M] * acceleration[i] + p[_C1] * v[i] + _smooth_force(q[i], v[i], p)
        if p_1.size:
            total += law_1(q[i], v[i], p_1)
        if p_2.size:
            total += law_2(q[i], v[i], p_2)
        sign = np.tanh(v[i] / v_rest)
        level = p[_FP] if v[i] > 0.0 else p[_FM]
        total += sign * (level + _friction_level(v[i], p))
        moved = q[i] - q[i - 1] if i else 0.0
        slider = min(max(slider + p[_KP] * moved, -p[_FY]), p[_FY])
        branch = decay * branch + gain * moved
        force[i] = total + slider + branch
    return force
