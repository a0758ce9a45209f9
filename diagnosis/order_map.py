"""Shaft orders and sensor patterns of axial signals, revolution by revolution."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

#: Sensor patterns m, in the order of every array that has a pattern axis.
PATTERNS = (0, 1, -1, 2)
#: Highest order kept.
MAX_ORDER = 12
#: Four sensors count as 90 deg apart within this error [rad] (half a degree); more would smear the patterns.
_ANGLE_TOLERANCE = np.deg2rad(0.5)


def order_coefficients(
    carrier_angle: NDArray[np.float64],
    signal: NDArray[np.float64],
    revolutions: Sequence[NDArray[np.int64]],
    max_order: int = MAX_ORDER,
) -> NDArray[np.complex128]:
    """Complex amplitude of every order in every revolution: ``signal = Re(sum_n Y(n) exp(j n theta))``.

    Parameters
    ----------
    carrier_angle, signal : ndarray, shape (n,)
        Carrier angle [rad]; signal [m], missing samples NaN.
    revolutions : sequence of ndarray of int
        Sample numbers of each whole revolution.
    max_order : int
        Highest order.

    Returns
    -------
    ndarray of complex, shape (n_revolutions, max_order + 1)
        Amplitudes [m]; NaN in a revolution that is too sparse for `max_order`.

    Notes
    -----
    Least squares against the measured angle, revolution by revolution. It does the work of resampling to equal angle
    and a Fourier transform without interpolation between samples, and a missing sample is simply absent. A revolution
    is too sparse where a gap between samples exceeds half a period of the highest order.
    """
    coefficients = np.full((len(revolutions), max_order + 1), np.nan, dtype=np.complex128)
    orders = np.arange(1, max_order + 1)
    for r, samples in enumerate(revolutions):
        present = samples[np.isfinite(signal[samples])]
        angle = carrier_angle[present]
        if too_sparse(angle, max_order):
            continue
        phase = np.outer(angle, orders)
        design = np.hstack([np.ones((angle.size, 1)), np.cos(phase), np.sin(phase)])
        solution = np.linalg.lstsq(design, signal[present], rcond=None)[0]
        coefficients[r, 0] = solution[0]
        coefficients[r, 1:] = solution[1 : max_order + 1] - 1j * solution[max_order + 1 :]
    return coefficients


def sensor_patterns(coefficients: NDArray[np.complex128], sensor_angles: NDArray[np.float64]) -> NDArray[np.complex128]:
    """Sensor patterns of order amplitudes: ``A_m(n) = 1/4 sum_i Y_i(n) exp(+j m alpha_i)``.

    Parameters
    ----------
    coefficients : ndarray of complex, shape (..., 4)
        Order amplitudes, sensors along the last axis.
    sensor_angles : ndarray, shape (4,)
        Housing angles alpha_i of the sensors [rad], 90 deg apart in any sequence.

    Returns
    -------
    ndarray of complex, shape (..., 4)
        Amplitudes of the patterns m = 0, +1, -1, 2.

    Raises
    ------
    ValueError
        Where the sensors are not four, 90 deg apart.
    """
    _check_quarter_turns(sensor_angles)
    weights = np.exp(1j * np.outer(sensor_angles, PATTERNS)) / 4.0
    return coefficients @ weights


def too_sparse(angle: NDArray[np.float64], max_order: int) -> bool:
    """Whether the samples of a revolution leave a gap of more than half a period of the highest order."""
    if angle.size < 2 * max_order + 2:
        return True
    place = np.sort(np.mod(angle, 2.0 * np.pi))
    gaps = np.diff(place, append=place[0] + 2.0 * np.pi)
    return bool(gaps.max() > np.pi / max_order)


def are_quarter_turns(sensor_angles: NDArray[np.float64]) -> bool:
    """Whether sensors are four, 90 deg apart."""
    place = np.sort(np.mod(sensor_angles, 2.0 * np.pi))
    gaps = np.diff(place, append=place[:1] + 2.0 * np.pi)
    return bool(place.size == 4 and np.abs(gaps - np.pi / 2.0).max() <= _ANGLE_TOLERANCE)


def _check_quarter_turns(sensor_angles: NDArray[np.float64]) -> None:
    if not are_quarter_turns(sensor_angles):
        found = ", ".join(f"{np.rad2deg(angle):.1f}" for angle in sensor_angles)
        raise ValueError(f"axial sensors stand at {found} deg; expected four sensors 90 deg apart")
