"""Contact laws of teeth, of round parts with play, and of a sun held by its spline.

Force, tangent, energy, and their discrete gradients (compiled).

A discrete gradient is a force whose work over a step is the change of the energy. Numba's cache of
a compiled caller (:mod:`carrierflex.simulation.stage.response`) does not see changes here: touch
that file after one.
"""

import numba
import numpy as np
from numpy.typing import NDArray

#: Motions over a step smaller than this [m] count as none: the difference quotient would be
#: rounding.
_STILL = 1e-13


@numba.njit(cache=True)
def fill_mesh_stiffness(
    real: NDArray[np.float64], imag: NDArray[np.float64], angle: float, k: NDArray[np.float64]
) -> None:
    """As :func:`mesh_stiffness_at`, into `k`."""
    turn_c, turn_s = np.cos(angle), np.sin(angle)
    c, s = 1.0, 0.0
    k[:] = real[:, 0]
    for h in range(1, real.shape[1]):
        c, s = c * turn_c - s * turn_s, s * turn_c + c * turn_s
        for j in range(len(k)):
            k[j] += real[j, h] * c - imag[j, h] * s


@numba.njit(cache=True)
def mesh_stiffness_at(
    real: NDArray[np.float64], imag: NDArray[np.float64], angle: float
) -> NDArray[np.float64]:
    """Stiffness [N/m] of every mesh at the mesh angle [rad].

    ``Σ_h real cos(h angle) - imag sin(h angle)``.

    Parameters
    ----------
    real, imag : ndarray, shape (n_meshes, n_harmonics + 1)
        Amplitudes of :class:`carrierflex.simulation.stage.gear_meshes.MeshStiffness`.
    angle : float
        Mesh angle [rad].
    """
    k = np.empty(len(real))
    fill_mesh_stiffness(real, imag, angle, k)
    return k


def mesh_stiffness_over(
    real: NDArray[np.float64], imag: NDArray[np.float64], angles: NDArray[np.float64]
) -> NDArray[np.float64]:
    """As :func:`mesh_stiffness_at` at N mesh angles, shape (N, n_meshes)."""
    phase = np.outer(angles, np.arange(real.shape[1]))
    return np.asarray(np.cos(phase) @ real.T - np.sin(phase) @ imag.T)


@numba.njit(cache=True)
def penetration_gradient(old: float, new: float) -> tuple[float, float]:
    """Mean of ``max(d, 0)`` from `old` to `new` and its derivative by `new`.

    Discrete gradient of ``max(d, 0)^2 / 2``.
    """
    if old >= 0.0 and new >= 0.0:
        return 0.5 * (old + new), 0.5
    if old <= 0.0 and new <= 0.0:
        return 0.0, 0.0
    a, b = max(old, 0.0), max(new, 0.0)
    mean = 0.5 * (b * b - a * a) / (new - old)
    return mean, (b - mean) / (new - old)


@numba.njit(cache=True)
def play_force(y: float, z: float, clearance: float) -> tuple[float, float, float]:
    """Radial contact per stiffness.

    Force y and z [m], and the energy per stiffness [m^2] of ``max(|r| - c, 0)^2 / 2``.
    """
    r = np.sqrt(y * y + z * z)
    if r <= clearance:
        return 0.0, 0.0, 0.0
    share = 1.0 - clearance / r
    return share * y, share * z, 0.5 * (r - clearance) ** 2


@numba.njit(cache=True)
def play_stiffness(y: float, z: float, clearance: float) -> tuple[float, float, float]:
    """Tangent of the radial contact, per stiffness: yy, yz, zz."""
    r = np.sqrt(y * y + z * z)
    if r <= clearance:
        return 0.0, 0.0, 0.0
    share = clearance / r
    return 1.0 - share * z * z / (r * r), share * y * z / (r * r), 1.0 - share * y * y / (r * r)


@numba.njit(cache=True)
def play_gradient(
    old_y: float, old_z: float, new_y: float, new_z: float, clearance: float
) -> tuple[float, float, float, float, float, float]:
    """Discrete gradient of the radial contact's energy over a step (Gonzalez 1996, eq.

    3.8), per stiffness.

    With d the step, g and H gradient and tangent at its middle: ``f = g + r d``, ``r = (E_1 - E_0 -
    g · d) / |d|^2``.

    Returns
    -------
    tuple of float
        f along y and z [m], then its derivative by the new place, yy, yz, zy, zz. Newton's method
        needs all of it: with half of H alone it jumps to and fro over the edge of the clearance.
    """
    mid_y, mid_z, _ = play_force(0.5 * (old_y + new_y), 0.5 * (old_z + new_z), clearance)
    yy, yz, zz = play_stiffness(0.5 * (old_y + new_y), 0.5 * (old_z + new_z), clearance)
    yy = 0.5 * yy
    yz = 0.5 * yz
    zz = 0.5 * zz
    _, _, old_energy = play_force(old_y, old_z, clearance)
    end_y, end_z, new_energy = play_force(new_y, new_z, clearance)
    dy, dz = new_y - old_y, new_z - old_z
    square = dy * dy + dz * dz
    if square < _STILL * _STILL:
        return mid_y, mid_z, yy, yz, yz, zz
    rest = (new_energy - old_energy - mid_y * dy - mid_z * dz) / square
    by_y = (end_y - mid_y - yy * dy - yz * dz - 2.0 * rest * dy) / square
    by_z = (end_z - mid_z - yz * dy - zz * dz - 2.0 * rest * dz) / square
    return (
        mid_y + rest * dy,
        mid_z + rest * dz,
        yy + rest + dy * by_y,
        yz + dy * by_z,
        yz + dz * by_y,
        zz + rest + dz * by_z,
    )


@numba.njit(cache=True)
def spline_force(
    y: float,
    z: float,
    stiffness: float,
    clearance: float,
    limit: float,
) -> tuple[float, float, float, float, float, float, float, float]:
    """Force that resists the offset of a turning sun on its quill, and the force's derivatives.

    The quill bends by ``F / k``, the spline's halves slide by ``m`` against dry friction of at most
    ``L``, up to the radial clearance ``c``. Both halves turn with the sun, so that an offset ``d``
    that stands still (or turns slower) slides once a turn, and the friction stands across the
    sliding. With the bristle law ``z' = v - |v| |z| z / s^2``, ``s = L / k``, ``rho = |d| / s``:

    ``F = k (d - m n)``, ``n = (P d + E x × d) / |d|``, ``E^2 = 2 / (1 + sqrt(1 + 4 rho^4))``,
    ``P = rho^2 E^2``, ``m = min(P |d|, c)``

    which is ``k d`` where friction holds (``rho << 1``) and the play ``k max(|d| - c, 0)`` where
    there is none.

    Parameters
    ----------
    y, z : float
        Offset ``d`` [m]; the sun turns about +x.
    stiffness : float
        ``k`` [N/m].
    clearance : float
        ``c`` [m].
    limit : float
        ``L`` [N].

    Returns
    -------
    tuple of float
        F along y and z [N]; its derivatives by the offset, yy, yz, zy, zz [N/m], and by the limit.
    """
    r = np.sqrt(y * y + z * z)
    if r < _STILL:
        return stiffness * y, stiffness * z, stiffness, 0.0, 0.0, stiffness, 0.0, 0.0
    E, P, E_r, P_r, by_limit = 0.0, 1.0, 0.0, 0.0, 0.0
    if limit > _STILL * stiffness:
        rho = r * stiffness / limit
        w = np.sqrt(1.0 + 4.0 * rho**4)
        E = np.sqrt(2.0 / (1.0 + w))
        P = rho * rho * E * E
        E_r = -4.0 * rho**3 * E / (w * (1.0 + w)) * stiffness / limit
        P_r = 2.0 * P / r + 2.0 * rho * rho * E * E_r
        # Both depend on the limit through rho alone.
        by_limit = -r / limit
    if P * r <= clearance:
        along, across = 1.0 - P * P, -P * E
        along_r, across_r = -2.0 * P * P_r, -P_r * E - P * E_r
        along_L, across_L = along_r * by_limit, across_r * by_limit
    else:
        share = clearance / r
        along, across = 1.0 - share * P, -share * E
        along_L, across_L = -share * P_r * by_limit, -share * E_r * by_limit
        along_r, across_r = share * (P / r - P_r), share * (E / r - E_r)
    k = stiffness
    fy, fz = k * (along * y - across * z), k * (along * z + across * y)
    # Direction in which the force changes with |d|.
    gy, gz = k * (along_r * y - across_r * z) / r, k * (along_r * z + across_r * y) / r
    return (
        fy,
        fz,
        k * along + gy * y,
        -k * across + gy * z,
        k * across + gz * y,
        k * along + gz * z,
        k * (along_L * y - across_L * z),
        k * (along_L * z + across_L * y),
    )


@numba.njit(cache=True)
def spline_energy(y: float, z: float, stiffness: float, clearance: float, limit: float) -> float:
    """Energy ``|F|^2 / 2 k`` of the quill less that of the linear part, ``k |d|^2 / 2`` [J]."""
    force = spline_force(y, z, stiffness, clearance, limit)
    stored = (force[0] * force[0] + force[1] * force[1]) / stiffness
    return float(0.5 * (stored - stiffness * (y * y + z * z)))
