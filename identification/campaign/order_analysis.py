"""Shaft orders of the rim signals of one revolution.

And which orders and sensor patterns are kept.
"""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

#: Sensor patterns m, in the order of every array that has a pattern axis.
PATTERNS = (0, 1, -1, 2)
#: Four sensors count as 90 deg apart within this error [rad] (half a degree); more would smear the
#: patterns.
_ANGLE_TOLERANCE = np.deg2rad(0.5)


def highest_order(n_planets: int) -> int:
    """Highest order that is kept of a carrier's signals: 12 of three planets.

    Pins bend the rim in the orders n and 2 n of n planets; twice the second shows what stands
    beside them.
    """
    return 4 * n_planets


def order_amplitudes(
    rows: FloatArray, theta: FloatArray, highest: int
) -> tuple[NDArray[np.complex128], FloatArray]:
    """Complex amplitude of every order of every row: ``row = Re(sum_n Y(n) exp(j n theta))``.

    Parameters
    ----------
    rows : ndarray, shape (k, n)
        Signals of one revolution, without missing samples.
    theta : ndarray, shape (n,)
        Carrier angle [rad].
    highest : int
        Highest order.

    Returns
    -------
    orders : ndarray of complex, shape (highest + 1, k)
        Amplitudes.
    scatter : ndarray, shape (2,)
        Sum of squares of the first row about its orders, and its degrees of freedom.

    Notes
    -----
    Least squares against the measured angle. It does the work of resampling to equal angle and a
    Fourier transform without interpolation between samples; a missing sample is simply absent.
    """
    phase = np.outer(theta, np.arange(1, highest + 1))
    design = np.hstack([np.ones((theta.size, 1)), np.cos(phase), np.sin(phase)])
    solution = np.linalg.solve(design.T @ design, design.T @ rows.T)
    residual = rows[0] - design @ solution[:, 0]
    sines = np.vstack([np.zeros(len(rows)), solution[highest + 1 :]])
    return solution[: highest + 1] - 1j * sines, np.array(
        [residual @ residual, theta.size - design.shape[1]]
    )


def too_sparse(angle: FloatArray, max_order: int) -> bool:
    """Whether the samples of a revolution leave too large a gap for the highest order.

    Too large is more than half its period.
    """
    if angle.size < 2 * max_order + 2:
        return True
    angle_sorted = np.sort(np.mod(angle, 2.0 * np.pi))
    gaps = np.diff(angle_sorted, append=angle_sorted[0] + 2.0 * np.pi)
    return bool(gaps.max() > np.pi / max_order)


def are_quarter_turns(sensor_angles: FloatArray) -> bool:
    """Whether sensors are four, 90 deg apart."""
    angle_sorted = np.sort(np.mod(sensor_angles, 2.0 * np.pi))
    gaps = np.diff(angle_sorted, append=angle_sorted[:1] + 2.0 * np.pi)
    return bool(angle_sorted.size == 4 and np.abs(gaps - np.pi / 2.0).max() <= _ANGLE_TOLERANCE)
