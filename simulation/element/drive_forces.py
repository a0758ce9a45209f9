"""Forces that drives put into the equation of motion of an element."""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def base_force(acceleration: FloatArray, mass: float) -> FloatArray:
    """Force on the mass that a moving base makes in the base's frame, ``-m u''`` [N].

    Parameters
    ----------
    acceleration : ndarray, shape (n,)
        Acceleration of the base u'' [m/s²].
    mass : float
        Mass m [kg]; 1 gives the force per mass [m/s²].
    """
    return -mass * acceleration


def no_force(n_samples: int) -> FloatArray:
    """Force of a free decay, zero, shape (n_samples,)."""
    return np.zeros(n_samples)
