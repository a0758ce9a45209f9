"""Oscillators as filters that are exact where the force is straight between samples.

First-order hold of ``x'' + 2 d x' + w² x = b f`` [1]_. The numbers are those of
:func:`scipy.signal.cont2discrete` bit by bit, for all oscillators at once: a refit asks for them
some forty times, and what that function checks costs ten times the algebra.

References
----------
.. [1] G. F. Franklin, J. D. Powell, M. L. Workman, "Digital Control of Dynamic Systems", 3rd ed.
   (1998), 204-206.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

FloatArray = NDArray[np.float64]


def oscillator_filters(
    M: FloatArray, C: FloatArray, K: FloatArray, step: float
) -> list[tuple[FloatArray, FloatArray]]:
    """Numerator and denominator of each oscillator ``M x'' + C x' + K x = f``.

    Parameters
    ----------
    M, C, K : ndarray, shape (n,)
        Masses, damping, stiffness.
    step : float
        Sampling interval [s].

    Returns
    -------
    list of tuple of ndarray, shape (3,)
        Coefficients in powers of the delay, the denominator's first is 1.
    """
    n = len(M)
    # States are rate and displacement; behind them the force and its rise over a step.
    exponent = np.zeros((n, 4, 4))
    exponent[:, 0, 0] = -(C / M) * step
    exponent[:, 0, 1] = -(K / M) * step
    exponent[:, 0, 2] = step
    exponent[:, 1, 0] = step
    exponent[:, 2, 3] = 1.0
    over_step = expm(exponent)
    A = over_step[:, :2, :2]
    rise = over_step[:, :2, 3:]
    B = over_step[:, :2, 2:3] - rise + A @ rise
    output = np.zeros((n, 1, 2))
    output[:, 0, 1] = 1.0 / M
    through = (output @ rise)[:, 0, 0]
    poles = np.linalg.eigvals(A)
    zeros = np.linalg.eigvals(A - B @ output)
    found = []
    for i in range(n):
        denominator = np.asarray(np.poly(poles[i]), dtype=np.float64)
        numerator = np.poly(zeros[i]) + (through[i] - 1.0) * denominator
        found.append((np.asarray(numerator), denominator))
    return found
