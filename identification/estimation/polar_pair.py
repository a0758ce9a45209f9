"""Size and direction of a vector that was fitted by its two components."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: A vector of exactly zero has no direction; taken as this share of its error, the angle's error is
#: huge instead of infinite.
_SMALLEST_SHARE = 1e-6
#: Size that stands for nothing, where the components have no error either.
_SMALLEST = 1e-100


def polar_values(components: Array, covariance: Array) -> tuple[Array, Array]:
    """Size and angle of a vector, and their derivatives by its components (delta method).

    ``phi = |(a, b)|``, ``theta = atan2(b, a)``; ``C_polar = J C J.T``.

    Parameters
    ----------
    components : ndarray, shape (2,)
        a and b, in one unit.
    covariance : ndarray, shape (2, 2)
        Their covariance C; NaN where it is not known. It tells how small a vector has no direction.

    Returns
    -------
    values : ndarray, shape (2,)
        phi, in the unit of the components, and theta [rad].
    derivatives : ndarray, shape (2, 2)
        J; for a vector of nothing those at a vector of a millionth of its error, along a.
    """
    a, b = (float(component) for component in components)
    values = np.array([np.hypot(a, b), np.arctan2(b, a)])
    variance = max(float(np.nan_to_num(np.trace(covariance))), 0.0)
    smallest = max(_SMALLEST_SHARE * float(np.sqrt(variance)), _SMALLEST)
    size = float(values[0])
    if size < smallest:
        size = smallest
        a = smallest
        b = 0.0
    return values, np.array([[a / size, b / size], [-b / size / size, a / size / size]])
