"""Signal patterns of the carrier at the rim sensors, one pure function per term of the equations.

The simulator multiplies them by the true parameters; identification and diagnosis use the same
functions as regressors, so every equation stands once. Signs and angles:
:mod:`carrierflex.simulation`.
"""

import numpy as np
from numpy.typing import NDArray

from carrierflex.fe.deflection_curves import DeflectionCurve

#: Sensor angle at which the saddle of the housing's main flange is largest [rad]: the first axial
#: sensor of the 2012 paper, so that the four axial sensors read +, -, +, -.
SADDLE_ANGLE = np.deg2rad(47.0)


def offset_pattern(carrier_angle: NDArray[np.float64]) -> NDArray[np.float64]:
    """Axial signal of a unit axial offset: ``1`` at every sensor and carrier angle.

    Parameters
    ----------
    carrier_angle : ndarray
        Carrier angle theta [rad].

    Returns
    -------
    ndarray, shape of `carrier_angle`
        Signal per offset d_x [m/m].

    References
    ----------
    .. [1] 2012 paper, equation (1), first term.
    """
    return np.ones_like(carrier_angle)


def housing_tilt_pattern(
    carrier_angle: NDArray[np.float64], sensor_angle: float, radius: float, tilt_axis: float
) -> NDArray[np.float64]:
    """Axial signal of a unit tilt whose axis is fixed to the housing: ``R sin(theta_H - v)``.

    Parameters
    ----------
    carrier_angle : ndarray
        Carrier angle theta [rad]; the pattern does not depend on it.
    sensor_angle : float
        Housing angle v of the sensor [rad].
    radius : float
        Radius R of the sensor [m].
    tilt_axis : float
        Angle theta_H of the tilt axis in the housing [rad].

    Returns
    -------
    ndarray, shape of `carrier_angle`
        Signal per tilt phi_H [m/rad].

    Notes
    -----
    Small angles. ``phi sin(theta_H - v)`` is linear in ``(phi cos theta_H, phi sin theta_H)``: the
    patterns with `tilt_axis` 0 and pi/2 are the two regressors.

    References
    ----------
    .. [1] 2012 paper, equations (1) and (2).
    """
    return np.full_like(carrier_angle, radius * np.sin(tilt_axis - sensor_angle))


def carrier_tilt_pattern(
    carrier_angle: NDArray[np.float64], sensor_angle: float, radius: float, tilt_axis: float
) -> NDArray[np.float64]:
    """Axial signal of a unit tilt whose axis turns with the carrier.

    ``R sin(theta_PLC + theta - v)``.

    Parameters
    ----------
    carrier_angle : ndarray
        Carrier angle theta [rad].
    sensor_angle : float
        Housing angle v of the sensor [rad].
    radius : float
        Radius R of the sensor [m].
    tilt_axis : float
        Angle theta_PLC of the tilt axis in the carrier frame [rad].

    Returns
    -------
    ndarray, shape of `carrier_angle`
        Signal per tilt phi_PLC [m/rad].

    References
    ----------
    .. [1] 2012 paper, equations (1) and (3).
    """
    return radius * np.sin(tilt_axis + carrier_angle - sensor_angle)


def axial_deflection_pattern(
    carrier_angle: NDArray[np.float64],
    sensor_angle: float,
    torque: NDArray[np.float64],
    curve: DeflectionCurve,
    *,
    pin_angle: float = 0.0,
) -> NDArray[np.float64]:
    """Axial signal of the carrier's deflection under torque.

    ``(T / T_unit) delta(v - theta - theta_rho)``.

    Parameters
    ----------
    carrier_angle, torque : ndarray
        Carrier angle theta [rad] and torque T about +x [N m], of one shape.
    sensor_angle : float
        Housing angle v of the sensor [rad].
    curve : DeflectionCurve
        Stiff or flexible curve under the torque ``curve.unit_load``.
    pin_angle : float
        Carrier-frame angle theta_rho of pin 1 [rad].

    Returns
    -------
    ndarray, shape of `carrier_angle`
        Signal per scale rho_s or rho_f [m].

    Notes
    -----
    Quasi-static: the deflection follows the instantaneous torque.

    References
    ----------
    .. [1] 2012 paper, equations (7) and (8), with the argument converted as
    :mod:`carrierflex.simulation` states.
    """
    return curve.axial_at(sensor_angle - carrier_angle - pin_angle) * torque / curve.unit_load


def radial_deflection_pattern(
    carrier_angle: NDArray[np.float64],
    sensor_angle: float,
    torque: NDArray[np.float64],
    curve: DeflectionCurve,
    *,
    pin_angle: float = 0.0,
) -> NDArray[np.float64]:
    """Radial signal of the carrier's deflection under torque.

    Arguments as :func:`axial_deflection_pattern`.

    Returns
    -------
    ndarray, shape of `carrier_angle`
        Displacement of the rim along e(v) per scale rho_s or rho_f [m].
    """
    return curve.radial_at(sensor_angle - carrier_angle - pin_angle) * torque / curve.unit_load


def saddle_pattern(carrier_angle: NDArray[np.float64], sensor_angle: float) -> NDArray[np.float64]:
    """Axial signal of a unit static saddle of the housing's flange: ``cos(2 (v - 47 deg))``.

    Parameters
    ----------
    carrier_angle : ndarray
        Carrier angle theta [rad]; the pattern does not depend on it.
    sensor_angle : float
        Housing angle v of the sensor [rad].

    Returns
    -------
    ndarray, shape of `carrier_angle`
        Signal per saddle amplitude [m/m]: +1, -1, +1, -1 at 47, 137, 227, 317 deg.

    Notes
    -----
    The only static pattern over four sensors 90 deg apart that offset and tilt cannot take up; it
    explains the residuals of the 2012 paper's table 4.
    """
    return np.full_like(carrier_angle, np.cos(2.0 * (sensor_angle - SADDLE_ANGLE)))


def housing_offset_pattern(
    carrier_angle: NDArray[np.float64], sensor_angle: float, direction: float
) -> NDArray[np.float64]:
    """Radial signal of a unit displacement of the carrier fixed to the housing.

    ``cos(direction - v)``.

    Parameters
    ----------
    carrier_angle : ndarray
        Carrier angle theta [rad]; the pattern does not depend on it.
    sensor_angle : float
        Housing angle v of the sensor [rad].
    direction : float
        Housing angle of the displacement [rad]: 0 is +z, -pi/2 is +y.

    Returns
    -------
    ndarray, shape of `carrier_angle`
        Displacement along e(v) per displacement [m/m].
    """
    return np.full_like(carrier_angle, np.cos(direction - sensor_angle))


def carrier_offset_pattern(
    carrier_angle: NDArray[np.float64], sensor_angle: float, direction: float
) -> NDArray[np.float64]:
    """Radial signal of a unit eccentricity that turns with the carrier.

    ``cos(direction + theta - v)``.

    Parameters
    ----------
    carrier_angle : ndarray
        Carrier angle theta [rad].
    sensor_angle : float
        Housing angle v of the sensor [rad].
    direction : float
        Carrier-frame angle of the eccentricity [rad].

    Returns
    -------
    ndarray, shape of `carrier_angle`
        Displacement along e(v) per eccentricity [m/m].
    """
    return np.cos(direction + carrier_angle - sensor_angle)
