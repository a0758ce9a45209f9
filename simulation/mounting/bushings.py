"""The three bushing models of the 2011 paper: force of one bushing in one radial direction.

Convention: every function gives the internal force, positive in the direction of a positive
deflection ``u``; the body receives its negative. The paper mixes both: equations (1), (2) are
forces on the body, (3)-(7) internal ones.

What is printed and what is physically right
    Equation (6), ``m ü_m = -k u_m - c (u̇ - u̇_m)``, is unstable (a root at +8.2 1/s with Table 3);
    the fluid mass is driven by the damper, so the sign of ``c`` is plus. Equation (7) clips the
    elasto-plastic force on its positive side only; friction yields in both directions. The right
    forms serve everywhere; the printed ones are here for checks alone, with ``printed`` in their
    names.

References
----------
.. [1] "Modeling of Wind Turbine Gearbox Mounting", Modeling, Identification and Control 32(4),
2011, equations
   (1)-(7) and table 3.
"""

from dataclasses import dataclass, fields
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


def elasto_plastic_force_as_printed(before: float, stretch: float, Kp: float, Fy: float) -> float:
    """Equation (7) as printed: it never yields on the negative side."""
    return min(before + Kp * stretch, Fy)


def fluid_roots(m: float, c: float, k: float) -> NDArray[np.complex128]:
    """Roots [1/s] of the fluid mass with the bushing held.

    ``m s² + c s + k = 0`` (equation 6, sign of c put right).
    """
    return np.roots([m, c, k]).astype(np.complex128)


def fluid_roots_as_printed(m: float, c: float, k: float) -> NDArray[np.complex128]:
    """Roots [1/s] of equation (6) as printed, ``m s² - c s + k = 0``: unstable."""
    return np.roots([m, -c, k]).astype(np.complex128)


@dataclass(frozen=True)
class _Bushing:
    """Checks every constant; not a model of its own."""

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            # Table 3 holds a negative K3: only the hardening constants may be negative.
            if not np.isfinite(value) or (value < 0.0 and field.name not in ("K3", "K5", "P_T")):
                raise ValueError(
                    f"{type(self).__name__}: {field.name} is {value}; expected a finite number >= 0"
                )

    def parameters(self) -> dict[str, float]:
        """Values for :func:`carrierflex.simulation.mounting.parameters.parameter_array`, by name."""
        raise NotImplementedError


@dataclass(frozen=True)
class LinearBushing(_Bushing):
    """``F = K1 u + C1 u̇`` (equation 1); defaults of table 3, column Lin.

    Parameters
    ----------
    K1, C1 : float
        Stiffness [N/m] and damping [N s/m].
    P_T : float
        Parasitic torque per vertical radial load [N m per N], identified with the model.
    """

    K1: float = 20.2e6
    C1: float = 4.83e6
    P_T: float = 0.119

    def parameters(self) -> dict[str, float]:
        """Values by parameter name."""
        return {"K1": self.K1, "C1": self.C1, "P_T": self.P_T}


@dataclass(frozen=True)
class NonlinearBushing(_Bushing):
    """``F = K1 u + K3 u³ + K5 u⁵ + C1 u̇ u²`` (equation 2); defaults of table 3, column NLin.

    Parameters
    ----------
    K1, K3, K5 : float
        Stiffness [N/m, N/m³, N/m⁵].
    C1 : float
        Damping that grows with the square of the deflection [N s/m³]; the paper gives it the symbol
        of the linear damping.
    P_T : float
        Parasitic torque per vertical radial load [N m per N].
    """

    K1: float = 17.6e6
    K3: float = 65.05e9
    K5: float = 1.55e15
    C1: float = 1.15e6
    P_T: float = 0.111

    def parameters(self) -> dict[str, float]:
        """Values by parameter name; there is no linear damping in this model."""
        return {
            "K1": self.K1,
            "C1": 0.0,
            "K3": self.K3,
            "K5": self.K5,
            "C3": self.C1,
            "P_T": self.P_T,
        }


@dataclass(frozen=True)
class HydrodynamicBushing(_Bushing):
    """Elastic, fluid and elasto-plastic force in parallel (equations 3-7).

    Defaults of table 3, column HD-b.

    Parameters
    ----------
    K1, K3, K5 : float
        Elastic stiffness [N/m, N/m³, N/m⁵].
    m, c, k : float
        Mass [kg], damper [N s/m] and spring [N/m] of the fluid branch. ``m = 0`` leaves a Maxwell
        element, of which the printed mass differs by a root at -3.5e5 1/s only.
    Kp, Fy : float
        Stiffness [N/m] and yield force [N] of the elasto-plastic branch; table 3 calls it Fep.
    P_T : float
        Parasitic torque per vertical radial load [N m per N].
    """

    K1: float = 4.3e6
    K3: float = -9.98e9
    K5: float = 1.20e15
    m: float = 16.2
    c: float = 5.72e6
    k: float = 46.82e6
    Kp: float = 8.29e6
    Fy: float = 60.06e3
    P_T: float = 0.099

    def parameters(self) -> dict[str, float]:
        """Values by parameter name; there is no damper beside the fluid branch in this model."""
        return {"C1": 0.0, **{field.name: getattr(self, field.name) for field in fields(self)}}
