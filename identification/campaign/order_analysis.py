"""Shaft orders of the rim signals of one revolution, and which orders and sensor patterns are kept."""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

#: Sensor patterns m, in the order of every array that has a pattern axis.
PATTERNS = (0, 1, -1, 2)
#: Highest order kept.
MAX_ORDER = 12
#: Four sensors count as 90 deg apart within this error [rad] (half a degree); more would smear the
#: patterns.
_ANGLE_TOLERANCE = np.deg2rad(0.5)


def order_amplitudes(
    rows: FloatArray, theta: FloatArray
) -> tuple[NDArray[np.complex128], FloatArray]:
    """Complex amplitude of every order of every row: ``row = Re(sum_n Y(n) exp(j n theta))``.

    Parameters
    ----------
    rows : ndarray, shape (k, n)
        Signals of one revolution, without missing samples.
    theta : ndarray, shape (n,)
        Carrier angle [rad].

    Returns
    -------
    orders : ndarray of complex, shape (MAX_ORDER + 1, k)
        Amplitudes.
    scatter : ndarray, shape (2,)
        Sum of squares of the first row about its orders, and its degrees of freedom.

    Notes
    -----
    Least squares against the measured angle. It does the work of resampling to equal angle and a
    Fourier transform without interpolation between samples; a missing sample is simply absent.
    """
    phase = np.outer(theta, np.arange(1, MAX_ORDER + 1))
    design = np.hstack([np.ones((theta.size, 1)), np.cos(phase), np.sin(phase)])
    solution = np.linalg.solve(design.T @ design, design.T @ rows.T)
    left = rows[0] - design @ solution[:, 0]
    sines = np.vstack([np.zeros(len(rows)), solution[MAX_ORDER + 1 :]])
    return solution[: MAX_ORDER + 1] - 1j * sines, np.array(
        [left @ left, theta.size - design.shape[1]]
    )


def too_sparse(angle: FloatArray, max_order: int) -> bool:
    """Whether the samples of a revolution leave a gap of more than half a period of the highest order."""
    if angle.size < 2 * max_order + 2:
        return True
    place = np.sort(np.mod(angle, 2.0 * np.pi))
    gaps = np.diff(place, append=place[0] + 2.0 * np.pi)
    return bool(gaps.max() > np.pi / max_order)


def are_quarter_turns(sensor_angles: FloatArray) -> bool:
    """Whether sensors are four, 90 deg apart."""
    place = np.sort(np.mod(sensor_angles, 2.0 * np.pi))
    gaps = np.diff(place, append=place[:1] + 2.0 * np.pi)
    return bool(place.size == 4 and np.abs(gaps - np.pi / 2.0).max() <= _ANGLE_TOLERANCE)
