"""Compiled state of a smooth loop of hysteresis along a motion (Duhem's model).

``dz/dq = c(z sign(dq)) / half_range``: the stiffness of the state depends on the state itself and
on the direction, and on nothing else. Loops may soften or harden, and need not close. With c linear
between evenly spaced values of its argument from -1 to 1 and constant beyond, a straight motion is
solved exactly.

References
----------
.. [1] B. D. Coleman, M. L. Hodgdon, "A constitutive relation for rate-independent hysteresis in
   ferromagnetically soft materials", Int. J. Eng. Sci. 24 (1986) 897: Duhem's differential form.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Relative change of the stiffness over a stretch below which it counts as constant.
_CONSTANT = 1e-9


@njit(cache=True)
def moved_loop(z: float, way: float, stiffness: Array) -> float:
    """State after a motion in one direction.

    Parameters
    ----------
    z : float
        State before it.
    way : float
        Change of the deflection over the half range.
    stiffness : ndarray, shape (n,)
        c > 0 at n evenly spaced values of ``z sign(way)`` from -1 to 1.
    """
    last = stiffness.size - 1
    sign = 1.0 if way >= 0.0 else -1.0
    u, remaining = sign * z, abs(way)
    gap = 2.0 / last
    if u < -1.0:
        needed = (-1.0 - u) / stiffness[0]
        if needed >= remaining:
            return float(sign * (u + stiffness[0] * remaining))
        u, remaining = -1.0, remaining - needed
    k = min(int((u + 1.0) / gap), last)
    while k < last:
        slope = (stiffness[k + 1] - stiffness[k]) / gap
        c = stiffness[k] + slope * (u + 1.0 - k * gap)
        stretch = k * gap + gap - 1.0 - u
        is_constant = abs(slope) * gap <= _CONSTANT * c
        needed = stretch / c if is_constant else np.log(stiffness[k + 1] / c) / slope
        if needed >= remaining:
            grown = remaining if is_constant else np.expm1(slope * remaining) / slope
            return float(sign * (u + c * grown))
        u, remaining = (k + 1) * gap - 1.0, remaining - needed
        k += 1
    return float(sign * (u + stiffness[last] * remaining))


@njit(cache=True)
def loop_states(q: Array, half_range: float, stiffness: Array, state: Array) -> Array:
    """State at every sample of a motion, straight between them, shape (n,).

    Parameters
    ----------
    q : ndarray, shape (n,)
        Deflection.
    half_range : float
        Deflection over which a stiffness of one changes the state by one.
    stiffness : ndarray
        As of :func:`moved_loop`.
    state : ndarray, shape (1,)
        State at the first sample; left as it is at the last one.
    """
    states = np.empty(q.size)
    for i in range(q.size):
        if i:
            state[0] = moved_loop(state[0], (q[i] - q[i - 1]) / half_range, stiffness)
        states[i] = state[0]
    return states
