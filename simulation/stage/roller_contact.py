"""Force, tangent and energy of a bearing's line contacts.

Their discrete gradient over a time step (compiled).

Numba's cache of :mod:`carrierflex.simulation.stage.response` does not see changes here: touch that
file after one.
"""

from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

#: A ninth of a number's bits and these are those of its ninth root, within 3.4 %.
_BITS = (8.0 / 9.0 * 1023.0 - 0.038) * 2.0**52
#: Approach [m] below which a slice is as soft as there.
_LEAST = 1e-30
#: Motions over a step smaller than this [m] count as none: the difference quotient would be
#: rounding.
_STILL = 1e-13
#: Lever arms [m] that make lengths of tilts and of the carrier angle in the discrete gradient; the
#: last takes nearly all of the correction, third order in the step, as a torque on the drive.
_TILT_ARM, _ANGLE_ARM = 0.1, 1.0


class RollerSet(NamedTuple):
    """Rollers of b bearings, Z rollers in a row, S slices in all rows."""

    directions: NDArray[np.float64]
    """Cosine and sine of the roller angles at the carrier angle 0, shape (b, Z, 2)."""
    cage: float
    """Turn of the cage over the carrier's."""
    x: NDArray[np.float64]
    """Axial place of the slices [m], shape (S,)."""
    stiffness: NDArray[np.float64]
    """Of the slices [N/m^(10/9)], shape (b, S)."""
    gap: NDArray[np.float64]
    """Radial clearance and profile [m], shape (S,)."""


@numba.njit(cache=True, error_model="numpy")
def _ninth_root(x: float) -> float:
    """``x^(1/9)`` of a positive number to rounding, in operations that the compiler vectorises.

    Halley's step leaves 3e-4 of the start from the number's bits; then the series of the root of
    ``1 + e``.
    """
    root = np.int64(np.float64(x).view(np.int64) / 9.0 + _BITS).view(np.float64)
    cube = root * root * root
    power = cube * cube * cube
    root *= (8.0 * power + 10.0 * x) / (10.0 * power + 8.0 * x)
    cube = root * root * root
    e = x / (cube * cube * cube) - 1.0
    series = -442.0 / 19683.0 + e * 3094.0 / 177147.0
    series = 1.0 / 9.0 + e * (-4.0 / 81.0 + e * (68.0 / 2187.0 + e * series))
    return root + root * (e * series)


@numba.njit(cache=True, error_model="numpy")
def _pressed(
    rollers: RollerSet, b: int, motion: NDArray[np.float64], angle: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Cosine and sine of every roller's angle, approach and secant stiffness of its slices."""
    n_rollers, n_slices = rollers.directions.shape[1], len(rollers.x)
    cosine, sine = np.empty(n_rollers), np.empty(n_rollers)
    approach, secant = np.empty(n_rollers * n_slices), np.empty(n_rollers * n_slices)
    turn_c, turn_s = np.cos(rollers.cage * angle), np.sin(rollers.cage * angle)
    i = 0
    for roller in range(n_rollers):
        c0, s0 = rollers.directions[b, roller, 0], rollers.directions[b, roller, 1]
        s, c = s0 * turn_c + c0 * turn_s, c0 * turn_c - s0 * turn_s
        middle, slope = s * motion[0] - c * motion[1], s * motion[3] + c * motion[2]
        cosine[roller], sine[roller] = c, s
        for j in range(n_slices):
            approach[i] = middle + slope * rollers.x[j] - rollers.gap[j]
            i += 1
    for i in range(len(approach)):
        delta = approach[i]
        secant[i] = _ninth_root(delta if delta > _LEAST else _LEAST) if delta > 0.0 else 0.0
    i = 0
    for _ in range(n_rollers):
        for j in range(n_slices):
            secant[i] *= rollers.stiffness[b, j]
            i += 1
    return cosine, sine, approach, secant


@numba.njit(cache=True)
def roller_energy(rollers: RollerSet, b: int, motion: NDArray[np.float64], angle: float) -> float:
    """Energy ``Σ 9/19 k delta^(19/9)`` [J] of bearing b, planet at (y, z, ry, rz) to the pin."""
    _, _, approach, secant = _pressed(rollers, b, motion, angle)
    energy = 0.0
    for i in range(len(secant)):
        energy += secant[i] * approach[i] * approach[i]
    return 9.0 / 19.0 * energy


@numba.njit(cache=True)
def roller_load(
    rollers: RollerSet,
    b: int,
    motion: NDArray[np.float64],
    angle: float,
    force: NDArray[np.float64],
    tangent: NDArray[np.float64],
) -> float:
    """Gradient of the energy by the motion (`force`, shape (4,)) and its tangent (shape (4, 4)).

    Returned: by the carrier angle.

    Parameters
    ----------
    rollers : RollerSet
        Rollers.
    b : int
        Which bearing.
    motion : ndarray, shape (4,)
        y, z [m], ry, rz [rad] of the planet against the pin.
    angle : float
        Carrier angle [rad].
    force, tangent : ndarray
        Take the answer.
    """
    y, z, ry, rz = motion
    force[:] = 0.0
    tangent[:] = 0.0
    by_angle = 0.0
    cosine, sine, approach, secant = _pressed(rollers, b, motion, angle)
    n_slices = len(rollers.x)
    for roller in range(len(cosine)):
        c, s = cosine[roller], sine[roller]
        Q, M, k, kx, kxx = 0.0, 0.0, 0.0, 0.0, 0.0
        for j in range(n_slices):
            i, x = roller * n_slices + j, rollers.x[j]
            push = secant[i] * approach[i]
            Q += push
            M += push * x
            k += secant[i]
            kx += secant[i] * x
            kxx += secant[i] * x * x
        if Q == 0.0:
            continue
        # d delta / d motion = (s, -c, x c, x s).
        force[0] += Q * s
        force[1] -= Q * c
        force[2] += M * c
        force[3] += M * s
        by_angle += Q * (c * y + s * z) + M * (c * rz - s * ry)
        tangent[0, 0] += k * s * s
        tangent[0, 1] -= k * s * c
        tangent[1, 1] += k * c * c
        tangent[0, 2] += kx * s * c
        tangent[0, 3] += kx * s * s
        tangent[1, 2] -= kx * c * c
        tangent[1, 3] -= kx * s * c
        tangent[2, 2] += kxx * c * c
        tangent[2, 3] += kxx * s * c
        tangent[3, 3] += kxx * s * s
    for i in range(4):
        for j in range(i, 4):
            # The tangent of k delta^(10/9) is 10/9 of its secant.
            tangent[i, j] *= 10.0 / 9.0
            tangent[j, i] = tangent[i, j]
    return by_angle * rollers.cage


@numba.njit(cache=True)
def roller_gradient(
    rollers: RollerSet,
    b: int,
    ends: tuple[NDArray[np.float64], NDArray[np.float64]],
    angles: tuple[float, float],
    old_energy: float,
    force: NDArray[np.float64],
    tangent: NDArray[np.float64],
) -> float:
    """Discrete gradient of the energy over a step in motion and carrier angle.

    Returned: by the carrier angle.

    Gradient at the middle plus ``(V_1 - V_0 - grad V · d) d / |d|^2`` (Gonzalez 1996, eq. 3.8): the
    forces' work over the step is the change of the energy.

    Parameters
    ----------
    rollers, b
        Bearing.
    ends : tuple of ndarray, shape (4,)
        Motion before and after.
    angles : tuple of float
        Carrier angle before and after [rad].
    old_energy : float
        Energy before [J].
    force, tangent : ndarray, shapes (4,) and (4, 4)
        Take gradient and tangent at the middle.
    """
    old, new = ends
    turned = angles[1] - angles[0]
    tilt, arm = _TILT_ARM * _TILT_ARM, _ANGLE_ARM * _ANGLE_ARM
    middle, d = np.empty(4), np.empty(4)
    for i in range(4):
        middle[i], d[i] = 0.5 * (old[i] + new[i]), new[i] - old[i]
    by_angle = roller_load(rollers, b, middle, 0.5 * (angles[0] + angles[1]), force, tangent)
    square = d[0] * d[0] + d[1] * d[1] + tilt * (d[2] * d[2] + d[3] * d[3]) + arm * turned * turned
    if square < _STILL * _STILL:
        return by_angle
    work = by_angle * turned
    for i in range(4):
        work += force[i] * d[i]
    rest = (roller_energy(rollers, b, new, angles[1]) - old_energy - work) / square
    force[0] += rest * d[0]
    force[1] += rest * d[1]
    force[2] += rest * tilt * d[2]
    force[3] += rest * tilt * d[3]
    return by_angle + rest * arm * turned
