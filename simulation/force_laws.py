"""Force laws written in Python by a user, compiled for the time integrators.

A law is ``force(deflection, speed, parameters)`` [N] of two floats [m, m/s] and one array of
floats. It is the internal force, positive against a positive deflection; the body receives its
negative (see :mod:`carrierflex.simulation.mounting.bushings`).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numba import cfunc, njit, types
from numpy.typing import NDArray

Array = NDArray[np.float64]
#: ``(deflection, speed, parameters) -> force``.
Force = Callable[[float, float, Array], float]

#: What a law is compiled to: force [N] of deflection [m], speed [m/s] and its parameters.
LAW_SIGNATURE = types.float64(types.float64, types.float64, types.Array(types.float64, 1, "C"))

#: Step of a difference: share of the argument, and what stands in for it at rest [m, m/s].
_SHARE = 1e-5
_LEAST = 1e-9


@dataclass(frozen=True, eq=False)
class ForceLaw:
    """A compiled law with the values of its parameters.

    Parameters
    ----------
    force : callable
        Law as :func:`compiled_force` returns it.
    parameters : ndarray, shape (n_parameters,)
        Values in SI units, in the order in which the law counts them.
    """

    force: Force
    parameters: Array

    def at_rest(self, deflection: Array) -> Array:
        """Forces [N] at zero speed, shape of `deflection` [m]."""
        forces = [self.force(float(u), 0.0, self.parameters) for u in deflection]
        return np.array(forces, dtype=np.float64)

    def slopes_at_rest(self, deflection: Array) -> tuple[Array, Array]:
        """Stiffness [N/m] and damping [N s/m] at zero speed, of the shape of `deflection` [m]."""
        slopes = [force_slopes(self.force, float(u), 0.0, self.parameters) for u in deflection]
        stiffness, damping = np.array(slopes, dtype=np.float64).reshape(-1, 2).T
        return stiffness, damping


def compiled_force(function: Force) -> Force:
    """Law compiled to :data:`LAW_SIGNATURE`; division by zero gives infinity.

    Parameters
    ----------
    function : callable
        Plain function, or one that numba has compiled to another signature.

    Returns
    -------
    callable
        Compiled function, to be called from Python and from compiled code.

    Raises
    ------
    Exception
        Whatever numba raises where it cannot compile the function.
    """
    plain = getattr(function, "py_func", function)
    compiled: Force = njit(LAW_SIGNATURE, error_model="numpy")(plain)
    return compiled


@njit(error_model="numpy", inline="always")
def force_slopes(force: Force, u: float, v: float, parameters: Array) -> tuple[float, float]:
    """Derivatives of a law by deflection [N/m] and speed [N s/m], by central differences."""
    du = _SHARE * abs(u) + _LEAST
    dv = _SHARE * abs(v) + _LEAST
    over_u = (force(u + du, v, parameters) - force(u - du, v, parameters)) / (2.0 * du)
    over_v = (force(u, v + dv, parameters) - force(u, v - dv, parameters)) / (2.0 * dv)
    return over_u, over_v


def sum_of_laws(laws: Sequence[ForceLaw]) -> ForceLaw | None:
    """Sum of several laws, its parameters those of each in turn; None for no law."""
    if not laws:
        return None
    total = laws[0]
    for law in laws[1:]:
        force = _sum_of_two(total.force, law.force, total.parameters.size)
        total = ForceLaw(force, np.concatenate([total.parameters, law.parameters]))
    return total


@lru_cache(maxsize=256)
def _sum_of_two(first: Force, second: Force, n_first: int) -> Force:
    """Sum of two laws; the first `n_first` parameters are those of the first."""

    def total(u: float, v: float, parameters: Array) -> float:
        return first(u, v, parameters[:n_first]) + second(u, v, parameters[n_first:])

    return compiled_force(total)


@lru_cache(maxsize=256)
def first_class(force: Force) -> object:
    """The same law as a function value: code that takes one is compiled once for all laws."""

    def call(u: float, v: float, parameters: Array) -> float:
        return force(u, v, parameters)

    return cfunc(LAW_SIGNATURE)(call)
