"""The three bushing models of the 2011 paper: force of one bushing in one radial direction.

Convention: every function gives the internal force, positive in the direction of a positive
deflection ``u``; the body receives its negative. The paper mixes both: equations (1), (2) are
forces on the body, (3)-(7) internal ones.

What is printed and what is physically right
    Equation (6), ``m ü_m = -k u_m - c (u̇ - u̇_m)``, is unstable (a root at +8.2 1/s with Table 3);
    the fluid mass is driven by the damper, so the sign of ``c`` is plus. Equation (7) clips the
    elasto-plastic force on its positive side only; friction yields in both directions. The right
    forms serve everywhere; the printed ones stand in the tests.

References
----------
.. [1] "Modeling of Wind Turbine Gearbox Mounting", Modeling, Identification and Control 32(4),
   2011, equations (1)-(7) and table 3.
"""

from typing import TypeVar

import numba
import numpy as np
from numpy.typing import NDArray

#: A deflection [m] or an array of them.
Deflection = TypeVar("Deflection", float, NDArray[np.float64])

_jit = numba.njit(cache=True, nogil=True, inline="always")


@_jit
def hardening_force(u: Deflection, K3: float, K5: float) -> Deflection:
    """Elastic force above the linear one, ``K3 u³ + K5 u⁵`` [N] (equations 2 and 4)."""
    square = u * u
    return u * square * (K3 + K5 * square)


@_jit
def hardening_stiffness(u: Deflection, K3: float, K5: float) -> Deflection:
    """Slope of :func:`hardening_force`, ``3 K3 u² + 5 K5 u⁴`` [N/m]."""
    square = u * u
    return square * (3.0 * K3 + 5.0 * K5 * square)


@_jit
def elasto_plastic_force(before: float, stretch: float, Kp: float, Fy: float) -> float:
    """Force [N] after a further `stretch` [m].

    Spring Kp that yields at ±Fy (equation 7, both sides).

    Exact for any monotonic stretch, however it is divided into steps.
    """
    return min(max(before + Kp * stretch, -Fy), Fy)
