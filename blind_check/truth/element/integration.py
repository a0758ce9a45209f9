"""Motion of a mass on an element, and force of an element along a motion."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from carrierflex.blind_check.truth.element.memory_laws import N_MEMORY, memory_force
from carrierflex.blind_check.truth.element.static_laws import static_force

FloatArray = NDArray[np.float64]


@njit(cache=True)
def law_force(
    law: int,
    p: FloatArray,
    form: FloatArray,
    scale: FloatArray,
    q: float,
    v: float,
    t: float,
    memory: FloatArray,
    rate: FloatArray,
) -> float:
    """Force of a law and the rates of its inner states.

    Parameters
    ----------
    law, p, form
        Number, parameters and change of form of the law.
    scale : ndarray, shape (3,)
        Force, deflection and speed that the law's arguments are measured in.
    q, v, t : float
        Deflection, speed, time.
    memory, rate : ndarray, shape (N_MEMORY,)
        Inner states and, filled here, their rates.

    Returns
    -------
    float
        Force.
    """
    s, w = q / scale[1], v / scale[2]
    if law < 100:
        rate[:] = 0.0
        return scale[0] * static_force(law, p, form, s, w, t)
    return scale[0] * memory_force(law, p, form, s, w, v / scale[1], memory, rate)


@njit(cache=True)
def _slope(
    state: FloatArray,
    force: float,
    t: float,
    base: FloatArray,
    laws: FloatArray,
    p: FloatArray,
    form: FloatArray,
    scale: FloatArray,
    slope: FloatArray,
) -> None:
    total = force - base[3] - base[1] * state[0] - base[2] * state[1]
    for i in range(laws.size):
        own = slice(2 + N_MEMORY * i, 2 + N_MEMORY * (i + 1))
        total -= law_force(
            int(laws[i]), p[i], form[i], scale[i], state[0], state[1], t, state[own], slope[own]
        )
    slope[0] = state[1]
    slope[1] = total / base[0]


@njit(cache=True)
def motion_under(
    force: FloatArray,
    step: float,
    start: FloatArray,
    base: FloatArray,
    laws: FloatArray,
    p: FloatArray,
    form: FloatArray,
    scale: FloatArray,
) -> FloatArray:
    """Deflection of a mass on the element under a force.

    Integrated by the three-eighths Runge-Kutta rule.

    Parameters
    ----------
    force : ndarray, shape (3 n + 1,)
        Force at every third of a step.
    step : float
        Step [s].
    start : ndarray, shape (2,)
        Deflection and speed at the first step.
    base : ndarray, shape (4,)
        Mass, stiffness, damping, constant force.
    laws, p, form, scale : ndarray, shape (n,), (n, 6), (n, 3, m), (n, 3)
        As :func:`law_force`, for every law; their forces add.

    Returns
    -------
    ndarray, shape (n + 1,)
        Deflection at the steps.
    """
    n = (force.size - 1) // 3
    n_states = 2 + N_MEMORY * laws.size
    result = np.empty(n + 1)
    state = np.zeros(n_states)
    state[:2] = start
    k1, k2, k3, k4 = np.zeros((4, n_states))
    result[0] = state[0]
    for k in range(n):
        t = step * k
        _slope(state, force[3 * k], t, base, laws, p, form, scale, k1)
        trial = state + step * k1 / 3.0
        _slope(trial, force[3 * k + 1], t + step / 3.0, base, laws, p, form, scale, k2)
        trial = state + step * (k2 - k1 / 3.0)
        _slope(trial, force[3 * k + 2], t + step / 1.5, base, laws, p, form, scale, k3)
        trial = state + step * (k1 - k2 + k3)
        _slope(trial, force[3 * k + 3], t + step, base, laws, p, form, scale, k4)
        state += step / 8.0 * (k1 + 3.0 * k2 + 3.0 * k3 + k4)
        result[k + 1] = state[0]
    return result


@njit(cache=True)
def force_along(
    q: FloatArray,
    v: FloatArray,
    step: float,
    law: int,
    p: FloatArray,
    form: FloatArray,
    scale: FloatArray,
) -> FloatArray:
    """Force of a law along a given motion.

    The inner states are integrated by the midpoint rule on straight lines between the samples.

    Parameters
    ----------
    q, v : ndarray, shape (n,)
        Deflection and speed at steps short against the memory of the law.
    step : float
        Step [s].
    law, p, form, scale
        As :func:`law_force`.

    Returns
    -------
    ndarray, shape (n,)
        Force.
    """
    result = np.empty(q.size)
    memory = np.zeros(N_MEMORY)
    rate = np.zeros(N_MEMORY)
    for k in range(q.size):
        t = k * step
        result[k] = law_force(law, p, form, scale, q[k], v[k], t, memory, rate)
        if k + 1 < q.size:
            middle = memory + 0.5 * step * rate
            q_m, v_m = 0.5 * (q[k] + q[k + 1]), 0.5 * (v[k] + v[k + 1])
            law_force(law, p, form, scale, q_m, v_m, t + 0.5 * step, middle, rate)
            memory += step * rate
    return result
