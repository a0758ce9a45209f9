"""Forces of a bushing by other equations than the library's.

================ ============================================================================
damping          of the deflection: a hyperbolic function whose first term is its square
elasto-plastic   Bouc-Wen with a sharp knee (exponent 10)
Maxwell branch   two branches whose time constants lie 10 % about the named one
warming spring   loses stiffness with time
================ ============================================================================
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

#: Laws by number; the parameters are p0, p1 and the deflection, speed that shape the other form.
LAWS = {
    "deflection_dependent_damping": 6,
    "elasto_plastic_friction": 11,
    "maxwell_branch": 12,
    "softening_in_time": 13,
}
_HYPERBOLIC = 0.6  # argument of the hyperbolic functions at the deflection's size


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
        Its parameters.
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
    if law == 11:
        share = (abs(memory[0]) * p[0] / p[1]) ** 10
        rate[0] = v - (share * v if v * memory[0] > 0.0 else 0.0)
        return p[0] * memory[0]
    if law == 12:
        rate[0], rate[1] = v - memory[0] / (0.9 * p[1]), v - memory[1] / (1.1 * p[1])
        return 0.5 * p[0] * (memory[0] + memory[1])
    if law == 13:  # the spring loses stiffness as it warms
        return -p[0] * (1.0 - np.exp(-t / p[1])) * q
    b = _HYPERBOLIC / size[0]
    return 2.0 * p[0] * (np.cosh(b * q) - 1.0) / b**2 * v
