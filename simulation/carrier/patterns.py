"""Signal patterns at the rim sensors beyond those of the papers' models.

One pure function per equation.

Like :mod:`carrierflex.simulation.carrier.kinematics`, whose conventions they share: v is the
housing angle of a sensor, theta the carrier angle, axial signals are positive in +x. Sizes of these
effects at the dynamometer are small; each function gives the signal per unit of its coefficient.
"""

import numpy as np
from numpy.typing import NDArray

from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.geometry.pins import pin_angles

FloatArray = NDArray[np.float64]


def pin_radius_of(delta: DeflectionCurve, g: DeflectionCurve, n_planets: int) -> float:
    """Radius of the pin circle that a torque curve and a pin curve of one carrier imply [m].

    ``delta(u) / T_unit = 1 / (n a) sum_i g(u - alpha_i)``, solved for a by least squares over the
    turn.

    Parameters
    ----------
    delta, g : DeflectionCurve
        Curve under torque and under the force on pin 1, both stiff or both flexible.
    n_planets : int
        Pins n, evenly spaced.

    Returns
    -------
    float
        Radius a.

    Raises
    ------
    ValueError
        Where the pin curve has no part that repeats from pin to pin.
    """
    at_pins = np.array([g.axial_at(delta.angle - angle) for angle in pin_angles(n_planets)])
    summed = at_pins.sum(axis=0) / (n_planets * g.unit_load)
    product = float((delta.axial / delta.unit_load) @ summed)
    if product == 0.0:
        raise ValueError(
            f"curve {g.name} summed over {n_planets} pins is zero; expected the shape of "
            f"{delta.name}"
        )
    return float(summed @ summed) / product


def uneven_pins_pattern(
    carrier_angle: FloatArray,
    sensor_angle: float,
    torque: FloatArray,
    shares: FloatArray,
    *,
    g: DeflectionCurve,
    pin_radius: float,
    radial: bool = False,
) -> FloatArray:
    """Signal of uneven pin loads: ``sum_i T / (n a) e_i g(v - theta - alpha_i)``.

    Parameters
    ----------
    carrier_angle, torque : ndarray, shape (n,)
        Carrier angle theta [rad] and torque T [N m].
    sensor_angle : float
        Housing angle v [rad].
    shares : ndarray, shape (n_planets,), (n_planets, n) or (n_planets, m, n)
        Excess e_i of each pin's load, constant or over time, of one load or of m; they sum to zero.
    g : DeflectionCurve
        Displacement under the force ``g.unit_load`` on pin 1.
    pin_radius : float
        Radius a of the pin circle [m].
    radial : bool
        Whether the sensor reads radially.

    Returns
    -------
    ndarray, shape (n,) or (m, n)
        Displacement [m].

    References
    ----------
    .. [1] 2012 paper, section 2: three pin forces T / (3 a); superposition of the single-pin
       curves.
    """
    displacement = g.radial_at if radial else g.axial_at
    force = torque / (len(shares) * pin_radius * g.unit_load)
    total = np.zeros((*shares.shape[1:-1], carrier_angle.size))
    for share, angle in zip(shares, pin_angles(len(shares)), strict=True):
        if np.any(share):
            total += share * displacement(sensor_angle - carrier_angle - angle)
    return force * total


def load_turned_shares(
    carrier_angle: FloatArray, ntl_y: FloatArray, ntl_z: FloatArray, n_planets: int
) -> tuple[FloatArray, FloatArray]:
    """Excess loads that turn through the radial load F once a revolution.

    ``F . e(beta_i)`` and ``F . t(beta_i)``.

    ``beta_i = theta + alpha_i`` is the housing angle of pin i, ``e(beta) = (-sin beta, cos beta)``
    and ``t(beta) = (-cos beta, -sin beta)`` its radial and tangential direction in (y, z).

    Parameters
    ----------
    carrier_angle : ndarray, shape (n,)
        Carrier angle [rad].
    ntl_y, ntl_z : ndarray, shape (n,) or (m, 1, n)
        Radial load [N], or m of them.
    n_planets : int
        Pins.

    Returns
    -------
    tuple of ndarray, shape (n_planets, n) or (m, n_planets, n)
        Shares per unit of the coefficients kappa_r and kappa_t [N per 1/N]; each sums to zero over
        the pins.
    """
    beta = carrier_angle + pin_angles(n_planets)[:, None]
    sin, cos = np.sin(beta), np.cos(beta)
    return ntl_z * cos - ntl_y * sin, -ntl_y * cos - ntl_z * sin


def closing_torque(torque: FloatArray, threshold: float) -> FloatArray:
    """Part of the torque that the pins carry after their clearance has closed.

    ``sign(T) max(|T| - T_c, 0)`` [N m].

    Parameters
    ----------
    torque : ndarray
        Torque T [N m].
    threshold : float
        Torque T_c at which the clearance closes [N m].
    """
    return np.sign(torque) * np.maximum(np.abs(torque) - threshold, 0.0)


def saturated_load(
    ntl_y: FloatArray, ntl_z: FloatArray, size: float, weight: float
) -> tuple[FloatArray, FloatArray]:
    """Share of a bearing's clearance that a radial load takes up beside a weight, less at rest.

    ``(F + W) / sqrt(|F + W|^2 + F_s^2) - W / sqrt(|W|^2 + F_s^2)`` with W along z.

    Parameters
    ----------
    ntl_y, ntl_z : ndarray
        Radial load F [N].
    size : float
        Load F_s that takes up 71 % of the clearance [N].
    weight : float
        What presses the bearing along +z without a radial load, as a radial load [N].

    Returns
    -------
    tuple of ndarray
        Components along y and z, between -2 and 2.
    """
    along_z = ntl_z + weight
    length = np.sqrt(ntl_y**2 + along_z**2 + size**2)
    return ntl_y / length, along_z / length - weight / np.hypot(weight, size)


def load_tilt_pattern(
    sensor_angle: float, radius: float, along_y: FloatArray, along_z: FloatArray
) -> FloatArray:
    """Axial signal of a tilt in the plane of a load.

    ``R (e(v) . u)``, u the load's direction times its size.

    The rim moves in +x on the side the load points to; the axis of the tilt is perpendicular to the
    load.
    """
    return radius * (along_z * np.cos(sensor_angle) - along_y * np.sin(sensor_angle))


def load_shift_pattern(sensor_angle: float, along_y: FloatArray, along_z: FloatArray) -> FloatArray:
    """Radial signal of a shift along a load.

    ``e(v) . u``, u the load's direction times its size.
    """
    return along_z * np.cos(sensor_angle) - along_y * np.sin(sensor_angle)


def face_waves_pattern(
    carrier_angle: FloatArray, sensor_angle: float, order: int
) -> tuple[FloatArray, FloatArray]:
    """Axial signal of `order` waves on the measured face.

    ``cos n (v - theta)`` and ``sin n (v - theta)``.

    Parameters
    ----------
    carrier_angle : ndarray
        Carrier angle theta [rad].
    sensor_angle : float
        Housing angle v [rad].
    order : int
        Waves n around the face; n = 1 is a tilt of the carrier.

    Returns
    -------
    tuple of ndarray
        Signal per amplitude [m/m].
    """
    phase = order * (sensor_angle - carrier_angle)
    return np.cos(phase), np.sin(phase)


def planet_pass_pattern(
    carrier_angle: FloatArray, torque_ratio: FloatArray, n_planets: int
) -> tuple[FloatArray, FloatArray]:
    """Motion of the housing as the planets pass.

    ``T / T_nom cos(n theta)`` and ``T / T_nom sin(n theta)``.

    Parameters
    ----------
    carrier_angle, torque_ratio : ndarray
        Carrier angle theta [rad]; torque over the nominal torque.
    n_planets : int
        Planets n.

    Returns
    -------
    tuple of ndarray
        Signal per amplitude; the same phase at every place of the housing, as it stands still.
    """
    phase = n_planets * carrier_angle
    return torque_ratio * np.cos(phase), torque_ratio * np.sin(phase)


def drift_patterns(
    time: FloatArray, start: float | FloatArray, end: float | FloatArray
) -> tuple[FloatArray, ...]:
    """Slow drift over a record.

    Legendre polynomials of degree 1, 2, 3 in time, from -1 at its start to 1 at its end.

    Parameters
    ----------
    time : ndarray
        Time [s].
    start, end : float or ndarray, shape of `time`
        First and last time of the record [s].

    Returns
    -------
    tuple of ndarray
        Signals per coefficient [m/m]; none of them has a mean, which is the axial offset's.
    """
    u = (2.0 * time - start - end) / np.maximum(end - start, np.finfo(float).tiny)
    return u, 1.5 * u**2 - 0.5, 2.5 * u**3 - 1.5 * u
