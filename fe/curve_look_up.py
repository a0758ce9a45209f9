"""Compiled look-up of a periodic curve in a table of cubics."""

import numba
import numpy as np
from numpy.typing import NDArray


@numba.njit(cache=True)
def values_at(cubics: NDArray[np.float64], angle: NDArray[np.float64]) -> NDArray[np.float64]:
    """Values at angles of the cubics of even cells of a turn.

    Parameters
    ----------
    cubics : ndarray, shape (n_cells, 4)
        Coefficients c3, c2, c1, c0 of every cell; their number is a power of two.
    angle : ndarray, shape (n,)
        Angles [rad].

    Returns
    -------
    ndarray, shape (n,)
        Values, in the unit of the cubics.
    """
    width = 2.0 * np.pi / len(cubics)
    values = np.empty_like(angle)
    for i, one in enumerate(angle):
        turned = one / width
        # Rounding may put an angle on an edge into the cell beside it, whose cubic goes on as
        # smoothly.
        first = np.floor(turned)
        along = (turned - first) * width
        c3, c2, c1, c0 = cubics[np.int64(first) & (len(cubics) - 1)]
        values[i] = c0 + along * (c1 + along * (c2 + along * c3))
    return values
