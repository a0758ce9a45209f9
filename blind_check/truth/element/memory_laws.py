"""Forces with inner states, by the truth's own equations, per unit of their size.

Hysteresis whose loop does not depend on the rate: Bouc-Wen that softens, hardens or is pinched,
Iwan's sliders in parallel, an elasto-plastic slider, play with friction; LuGre's bristles; Maxwell
branches; and what lies outside every class: a tuned mass, friction that its own heat softens, a
nonlinear spring in series with a dashpot. Hysteresis is changed in form as N(z) = z + d(z), which
keeps it free of rate, play in its flanks, LuGre's friction as a function of the speed.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from carrierflex.blind_check.truth.element.static_laws import changed_form

FloatArray = NDArray[np.float64]

#: Laws by number.
MEMORY_LAWS = {
    "bouc_wen": 100, "pinched_bouc_wen": 101, "iwan": 102, "elasto_plastic": 103,
    "play_with_friction": 104,
    "lugre": 110,
    "maxwell_branches": 120,
    "tuned_mass": 130, "heated_friction": 131, "spring_and_dashpot": 132,
}  # fmt: skip
#: Inner states that every law is given; Iwan's sliders need most.
N_MEMORY = 10

_inline = njit(cache=True, inline="always")


@_inline
def _slides(z: float, limit: float, r: float) -> bool:
    return abs(z) >= limit and z * r > 0.0


@_inline
def _bouc_wen(p: FloatArray, r: float, z: float) -> float:
    """Rate of z: p[0] stiffness, p[1] exponent, p[2] beta, p[3] gamma."""
    hardening = p[2] * np.sign(r * z) + p[3]
    return p[0] * r * (1.0 - abs(z) ** p[1] * hardening)


@_inline
def _hysteresis(
    law: int, p: FloatArray, s: float, r: float, memory: FloatArray, rate: FloatArray
) -> float:
    if law <= 101:
        rate[0] = _bouc_wen(p, r, memory[0])
        pinch = 1.0 - p[4] * np.exp(-((s / p[5]) ** 2)) if law == 101 else 1.0
        return memory[0] * pinch
    if law == 102:  # yields spread evenly from p[0] to p[1], weights by the power p[2]
        total = 0.0
        weights = 0.0
        for k in range(memory.size):
            limit = p[0] + (p[1] - p[0]) * k / (memory.size - 1.0)
            weight = limit ** p[2]
            rate[k] = 0.0 if _slides(memory[k], limit, r) else r
            total += weight * memory[k]
            weights += weight * limit
        return total / weights
    if law == 103:  # lopsided by p[1]
        rate[0] = 0.0 if _slides(memory[0], p[0], r) else r
        z = memory[0] / p[0]
        return z + p[1] * z * z
    # Play with friction: beyond the gap p[0] the flanks bear, within it a slider that yields at
    # p[1] drags with the level p[2].
    rate[0] = 0.0 if _slides(memory[0], p[1], r) else r
    flanks = np.sign(s) * max(abs(s) - p[0], 0.0) / (1.0 - p[0])
    return flanks + p[2] * memory[0] / p[1]


@_inline
def _lugre(p: FloatArray, w: float, r: float, memory: FloatArray, rate: FloatArray) -> float:
    """Bristles of length p[0]; Stribeck rise p[1] below the speed p[2]; p[3] damping."""
    level = 1.0 + p[1] * np.exp(-((w / p[2]) ** 2))
    rate[0] = r - abs(r) * memory[0] / (p[0] * level)
    return memory[0] / p[0] + p[3] * rate[0] / p[0]


@_inline
def _relaxation(p: FloatArray, r: float, memory: FloatArray, rate: FloatArray) -> float:
    """Three Maxwell branches: stiffness p[0], p[2], p[4] and time p[1], p[3], p[5]."""
    total = 0.0
    for k in range(3):
        rate[k] = r - memory[k] / p[2 * k + 1]
        total += p[2 * k] * memory[k]
    return total


@_inline
def _outside(
    law: int, p: FloatArray, s: float, w: float, r: float, memory: FloatArray, rate: FloatArray
) -> float:
    if law == 130:  # frequency p[0], damping ratio p[1]
        pull = p[0] ** 2 * (s - memory[0]) + 2.0 * p[1] * p[0] * (r - memory[1])
        rate[0] = memory[1]
        rate[1] = pull
        return pull / p[0] ** 2
    if law == 131:  # heat rises with the work and fades in the time p[1]
        friction = np.tanh(w / 0.002) / (1.0 + memory[0])
        rate[0] = p[0] * friction * r - memory[0] / p[1]
        return friction
    spring = memory[0] + p[0] * memory[0] ** 3
    rate[0] = r - spring / p[1]
    return spring


@njit(cache=True)
def memory_force(
    law: int,
    p: FloatArray,
    form: FloatArray,
    s: float,
    w: float,
    r: float,
    memory: FloatArray,
    rate: FloatArray,
) -> float:
    """Force of a law with inner states, per unit of its size, and the rates of these states.

    Parameters
    ----------
    law : int
        Number of the law.
    p : ndarray, shape (6,)
        Its parameters.
    form : ndarray, shape (3, n)
        Its change of form.
    s, w : float
        Deflection and speed over the largest of the motion.
    r : float
        Rate of s [1/s].
    memory, rate : ndarray, shape (N_MEMORY,)
        Inner states and, filled here, their rates.

    Returns
    -------
    float
        Force.
    """
    rate[:] = 0.0
    if law < 110:
        z = _hysteresis(law, p, s, r, memory, rate)
        return z + changed_form(form, s if law == 104 else z)
    if law < 120:
        z = _lugre(p, w, r, memory, rate)
        return z + changed_form(form, w)
    if law < 130:
        return _relaxation(p, r, memory, rate)
    return _outside(law, p, s, w, r, memory, rate)
