"""Forces of a bushing in forms that no law and no column of a diagnosis has.

Radial forces act along the deflection of a bushing in its plane, others in y and in z apart. Every
form is distorted by a smooth random function of deflection, speed or time.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
#: Values in y and z.
Pair = tuple[float, float]

#: Forms by number.
(
    TWO_STOPS,
    ONE_SIDED,
    SOFTENING,
    HYPERBOLIC,
    LOOP,
    PLANE_LOOP,
    RUBBER,
    POWER_DAMPING,
    FAR_DAMPING,
    ROOT_DAMPING,
    WARMING,
) = range(11)
#: Branches of the rubber, and states of a form in one bushing.
_BRANCHES = 5
N_STATES = 2 * _BRANCHES
#: Waves of a distortion.
N_WAVES = 4
#: Place of the second stop over the deflection's size.
_SECOND_STOP = 0.65
#: Ratio of the times of neighbouring branches of the rubber.
_APART = 4.0
#: Places in the parameters of a form: number, size, two shapes, deflection and speed of the motion,
#: share of either bushing, size of the distortion, its waves.
NUMBER = 0
AMOUNT = 1
FIRST = 2
SECOND = 3
DEFLECTION = 4
SPEED = 5
SHARES = 6
CHANGE = 8
WAVES = 9
N_PARAMETERS = WAVES + 2 * N_WAVES


@njit(cache=True)
def _factor(p, s):  # type: ignore[no-untyped-def]
    """Smooth random factor at a share s of the size, RMS of its change `p[CHANGE]`."""
    total = 0.0
    for k in range(N_WAVES):
        total += p[WAVES + k] * np.cos((k + 1) * np.pi * s + p[WAVES + N_WAVES + k])
    return 1.0 + p[CHANGE] * total


@njit(cache=True)
def form_force(
    p: FloatArray,
    bushing: int,
    u: Pair,
    v: Pair,
    t: float,
    memory: FloatArray,
    rate: FloatArray,
) -> Pair:
    """Force of a form in y and z of one bushing; `rate` of its states is filled.

    Parameters
    ----------
    p : ndarray, shape (N_PARAMETERS,)
        Form.
    bushing : int
        Starboard or port.
    u, v : tuple of float
        Deflection and speed in y and z.
    t : float
        Time.
    memory, rate : ndarray, shape (N_STATES,)
        States and their rates.
    """
    form = int(p[NUMBER])
    size = p[DEFLECTION]
    amount = p[AMOUNT] * p[SHARES + bushing]
    r = np.hypot(u[0], u[1])
    w = np.hypot(v[0], v[1])
    rate[:] = 0.0
    if form == TWO_STOPS:
        first = max(r - p[FIRST] * size, 0.0)
        second = max(r - _SECOND_STOP * size, 0.0)
        if first == 0.0 and second == 0.0:
            return 0.0, 0.0
        f = amount * (first + p[SECOND] * second) * _factor(p, r / size)
        return f * u[0] / r, f * u[1] / r
    if form == ONE_SIDED:
        beyond = max(u[1] - p[FIRST] * size, 0.0)
        if beyond == 0.0:
            return 0.0, 0.0
        return 0.0, amount * beyond * _factor(p, u[1] / size)
    if form == SOFTENING:
        s = (r / size) ** 2
        k = -amount * s / (s + p[FIRST] ** 2) * _factor(p, r / size)
        return k * u[0], k * u[1]
    if form == HYPERBOLIC:
        return _bent(p, amount, u[0]), _bent(p, amount, u[1])
    if form in (LOOP, PLANE_LOOP):
        _loop_rates(p, form, v, memory, rate)
        k = amount * _factor(p, r / size)
        return k * memory[0], k * memory[1]
    if form == RUBBER:
        return _rubber(p, amount, v, memory, rate)
    if form == POWER_DAMPING:
        c = amount * (w / p[SPEED]) ** (p[FIRST] - 1.0) if w > 0.0 else 0.0
        c *= _factor(p, min(w / p[SPEED], 1.0))
        return c * v[0], c * v[1]
    if form == FAR_DAMPING:
        c = amount * (1.0 - np.exp(-((r / (p[FIRST] * size)) ** 2))) * _factor(p, r / size)
        return c * v[0], c * v[1]
    if form == ROOT_DAMPING:
        y = (abs(u[0]) / size) ** p[FIRST] * _factor(p, abs(u[0]) / size)
        z = (abs(u[1]) / size) ** p[FIRST] * _factor(p, abs(u[1]) / size)
        return amount * y * v[0], amount * z * v[1]
    k = -amount * (1.0 - np.exp(-t / p[FIRST])) * _factor(p, t / (4.0 * p[FIRST]))
    return k * u[0], k * u[1]


@njit(cache=True)
def _bent(p, amount, u):  # type: ignore[no-untyped-def]
    """Hyperbolic sine less its straight part."""
    a = p[FIRST] * p[DEFLECTION]
    return amount * a * (np.sinh(u / a) - u / a) * _factor(p, abs(u) / p[DEFLECTION])


@njit(cache=True)
def _loop_rates(p, form, v, memory, rate):  # type: ignore[no-untyped-def]
    """Smooth loops: of each direction with its own sharpness, or of both together."""
    limit = p[FIRST] * p[DEFLECTION]
    if form == PLANE_LOOP:
        along = (memory[0] * v[0] + memory[1] * v[1]) / limit**2
        yielded = 0.5 * (abs(along) + along)
        rate[0] = v[0] - yielded * memory[0]
        rate[1] = v[1] - yielded * memory[1]
        return
    for d in range(2):
        share = (abs(memory[d]) / limit) ** p[SECOND]
        sense = 0.6 if v[d] * memory[d] > 0.0 else -0.2
        rate[d] = v[d] * (1.0 - share * (0.4 + sense))


@njit(cache=True)
def _rubber(p, amount, v, memory, rate):  # type: ignore[no-untyped-def]
    """Branches whose stiffness falls as a power of their time: rubber over three decades."""
    y = 0.0
    z = 0.0
    total = 0.0
    for k in range(_BRANCHES):
        tau = p[FIRST] * _APART**k
        weight = _APART ** (-p[SECOND] * k) * (
            1.0 + p[CHANGE] * np.cos(p[WAVES + N_WAVES] + 2.0 * k)
        )
        total += weight
        rate[2 * k] = v[0] - memory[2 * k] / tau
        rate[2 * k + 1] = v[1] - memory[2 * k + 1] / tau
        y += weight * memory[2 * k]
        z += weight * memory[2 * k + 1]
    return amount * y / total, amount * z / total
