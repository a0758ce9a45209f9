"""Forces of one element by laws of the same class as the library's, but other equations, integrated by an own Runge-Kutta march.

========================= =====================================================================================================
stiffness                 hyperbolic functions of the deflection whose first term is the named power
dry friction              a hyperbolic tangent of the speed instead of sticking, with a Stribeck curve or another level in each
                          direction; elasto-plastic: Bouc-Wen with a sharp knee (exponent 10)
damping                   the named power of the speed, smoothed about rest or with a hyperbolic tail
Maxwell branch            two branches whose time constants lie 10 % about the named one
backlash                  a dead zone with rounded corners
========================= =====================================================================================================
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

#: Laws by number; the parameters are p0, p1, p2 and the deflection, speed that shape the other
#: form.
LAWS = {
    "": 0, "quadratic_stiffness": 1, "cubic_stiffness": 2, "quintic_stiffness": 3, "quadratic_damping": 4, "cubic_damping": 5,
    "deflection_dependent_damping": 6, "backlash": 7, "coulomb_friction": 8, "stribeck_friction": 9, "friction_asymmetry": 10,
    "elasto_plastic_friction": 11, "maxwell_branch": 12, "softening_in_time": 13, "attached_absorber": 14,
    "unmeasured_force": 15, "end_stop": 16,
}  # fmt: skip
N_MEMORY = 2
_CREEP = 0.002  # speed at which dry friction is three quarters of its level, of the speed's size
_HYPERBOLIC = 0.6  # argument of the hyperbolic functions at the deflection's size

_inline = njit(cache=True, inline="always")


@_inline
def _elastic_force(law: int, p: FloatArray, b: float, q: float) -> float:
    """Force of the deflection alone; 1/b is its scale."""
    x = b * q
    if law == 1:
        return 2.0 * p[0] * (np.cosh(x) - 1.0) / b**2
    if law == 2:
        return 6.0 * p[0] * (np.sinh(x) - x) / b**3
    if law == 3:
        return 120.0 * p[0] * (np.sinh(x) - x - x**3 / 6.0) / b**5
    if law == 7:
        corner = 0.03 * p[0]
        over = corner * (
            np.logaddexp(0.0, (q - p[0]) / corner) - np.logaddexp(0.0, (-q - p[0]) / corner)
        )
        return p[3] * (over - q)
    if law == 16:  # a stop on one side
        return p[0] * max(q - p[1], 0.0)
    return 0.0


@_inline
def _viscous_force(law: int, p: FloatArray, size: FloatArray, q: float, v: float) -> float:
    """Force of the speed, without memory."""
    if law == 4:
        return p[0] * v * np.sqrt(v * v + (0.05 * size[1]) ** 2)
    if law == 5:
        w = _HYPERBOLIC / size[1]
        return 6.0 * p[0] * (np.sinh(w * v) - w * v) / w**3
    if law == 6:
        b = _HYPERBOLIC / size[0]
        return 2.0 * p[0] * (np.cosh(b * q) - 1.0) / b**2 * v
    return 0.0


@_inline
def _dry_force(law: int, p: FloatArray, size: FloatArray, v: float) -> float:
    """Dry friction that creeps where the library's sticks."""
    level = p[0]
    if law == 9:
        level = p[0] + p[1] * np.exp(-((v / p[2]) ** 2))
    if law == 10:
        level = p[0] if v > 0.0 else p[1]
    return level * np.tanh(v / (_CREEP * size[1]))


@_inline
def _memory_force(
    law: int, p: FloatArray, q: float, v: float, memory: FloatArray, rate: FloatArray
) -> float:
    """Force of inner states."""
    if law == 11:
        share = (abs(memory[0]) * p[0] / p[1]) ** 10
        rate[0] = v - (share * v if v * memory[0] > 0.0 else 0.0)
        return p[0] * memory[0]
    if law == 12:
        rate[0], rate[1] = v - memory[0] / (0.9 * p[1]), v - memory[1] / (1.1 * p[1])
        return 0.5 * p[0] * (memory[0] + memory[1])
    # A mass on a spring of its own rides on the element: p0 its mass, p1 its frequency.
    pull = p[0] * (p[1] ** 2 * (q - memory[0]) + 0.1 * p[1] * (v - memory[1]))
    rate[0], rate[1] = memory[1], pull / p[0]
    return pull


@njit(cache=True)
def law_force(
    law: int,
    p: FloatArray,
    size: FloatArray,
    q: float,
    v: float,
    memory: FloatArray,
    t: float,
    rate: FloatArray,
) -> float:
    """Force of a law and the rates of its memory.

    Parameters
    ----------
    law : int
        Number of the law.
    p : ndarray, shape (4,)
        Its parameters; the last one is the linear stiffness.
    size : ndarray, shape (2,)
        Deflection and speed of the motion.
    q, v, t : float
        Deflection, speed, time.
    memory, rate : ndarray, shape (2,)
        Inner states and, filled here, their rates.

    Returns
    -------
    float
        Force.
    """
    rate[0] = rate[1] = 0.0
    if law == 8 or law == 9 or law == 10:
        return _dry_force(law, p, size, v)
    if law == 11 or law == 12 or law == 14:
        return _memory_force(law, p, q, v, memory, rate)
    if law == 13:  # the spring loses stiffness as it warms
        return -p[0] * (1.0 - np.exp(-t / p[1])) * q
    if law == 15:  # a machine nearby, not measured
        return p[0] * np.sin(p[1] * t)
    if law == 4 or law == 5 or law == 6:
        return _viscous_force(law, p, size, q, v)
    return _elastic_force(law, p, _HYPERBOLIC / size[0], q)


@njit(cache=True)
def driven_motion(
    force: FloatArray,
    step: float,
    base: FloatArray,
    laws: FloatArray,
    p: FloatArray,
    size: FloatArray,
) -> FloatArray:
    """Deflection of a mass on the element under a force, from rest, by the three-eighths Runge-Kutta rule.

    Parameters
    ----------
    force : ndarray, shape (3 n + 1,)
        Force at every third of a step.
    step : float
        Step [s].
    base : ndarray, shape (4,)
        Mass, stiffness, damping, constant force.
    laws, p, size : ndarray, shape (n_laws,), (n_laws, 4), (n_laws, 2)
        As :func:`law_force`; their forces add.

    Returns
    -------
    ndarray, shape (n + 1,)
        Deflection at the steps.
    """
    n, n_states = (force.size - 1) // 3, 2 + 2 * laws.size
    result = np.empty(n + 1)
    state, slopes, trial, rate = (
        np.zeros(n_states),
        np.zeros((4, n_states)),
        np.zeros(n_states),
        np.zeros(2),
    )
    for k in range(n + 1):
        result[k] = state[0]
        if k == n:
            break
        for stage in range(4):
            for i in range(n_states):
                if stage == 0:
                    trial[i] = state[i]
                elif stage == 1:
                    trial[i] = state[i] + step * slopes[0, i] / 3.0
                elif stage == 2:
                    trial[i] = state[i] + step * (slopes[1, i] - slopes[0, i] / 3.0)
                else:
                    trial[i] = state[i] + step * (slopes[0, i] - slopes[1, i] + slopes[2, i])
            total = force[3 * k + stage] - base[3] - base[1] * trial[0] - base[2] * trial[1]
            for own in range(laws.size):
                t = step * (k + stage / 3.0)
                memory = trial[2 + 2 * own : 4 + 2 * own]
                total -= law_force(
                    laws[own], p[own], size[own], trial[0], trial[1], memory, t, rate
                )
                slopes[stage, 2 + 2 * own], slopes[stage, 3 + 2 * own] = rate[0], rate[1]
            slopes[stage, 0], slopes[stage, 1] = trial[1], total / base[0]
        for i in range(n_states):
            state[i] += (
                step / 8.0 * (slopes[0, i] + 3.0 * slopes[1, i] + 3.0 * slopes[2, i] + slopes[3, i])
            )
    return result


@njit(cache=True)
def force_along(
    q: FloatArray, v: FloatArray, step: float, law: int, p: FloatArray, size: FloatArray
) -> FloatArray:
    """Force of a law along a given motion, its memory by the midpoint rule on straight lines between the samples.

    Parameters
    ----------
    q, v : ndarray, shape (n,)
        Deflection and speed at steps short against the memory of the law.
    step : float
        Step [s].
    law, p, size
        As :func:`law_force`.

    Returns
    -------
    ndarray, shape (n,)
        Force.
    """
    result = np.empty(q.size)
    memory, rate, middle, unused = np.zeros(2), np.zeros(2), np.zeros(2), np.zeros(2)
    for k in range(q.size):
        result[k] = law_force(law, p, size, q[k], v[k], memory, k * step, rate)
        if k + 1 < q.size:
            middle[:] = memory + 0.5 * step * rate
            law_force(
                law,
                p,
                size,
                0.5 * (q[k] + q[k + 1]),
                0.5 * (v[k] + v[k + 1]),
                middle,
                (k + 0.5) * step,
                unused,
            )
            memory += step * unused
    return result


@njit(cache=True)
def phasor_sums(
    turn: NDArray[np.complex128], advance: NDArray[np.complex128], omega: FloatArray, n: int
) -> FloatArray:
    """Sum of turning phasors and its first two derivatives at n steps, shape (3, n).

    Parameters
    ----------
    turn, advance : ndarray, shape (n_lines,)
        Phasors at the first step and their turn in one step.
    omega : ndarray, shape (n_lines,)
        Frequencies [rad/s].
    n : int
        Steps.

    Returns
    -------
    ndarray
        Value, rate, second rate.
    """
    result = np.zeros((3, n))
    for line in range(turn.size):
        z, w = turn[line], omega[line]
        for k in range(n):
            result[0, k] += z.real
            result[1, k] -= w * z.imag
            result[2, k] -= w * w * z.real
            z *= advance[line]
    return result
