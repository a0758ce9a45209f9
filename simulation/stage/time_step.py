"""One step of the stage: implicit midpoint rule in modal coordinates, contact by discrete gradients (compiled).

With the mid-step velocity ``w = (v_0 + v_1)/2``: ``q_1 = q_0 + h w``, ``v_1 = 2 w - v_0`` and

``(2/h + D + h/2 omega^2) w = (2/h) v_0 - omega^2 q_0 + P a + Bᵀ lambda``.

The matrix is constant; the channels' forces ``lambda`` depend on their mid-step velocities ``s = B w`` alone, a small system
``s = s_free + W lambda(s)`` for Newton's method. Discrete gradients make work and stored energy balance to rounding.

The contact laws stand here too: numba's cache of a compiled caller does not see changes in another file.
"""

import numba
import numpy as np
from numpy.typing import NDArray

from simulation.stage.modal_form import StepMatrices

#: Change of the channels' motion over a step that ends Newton's method [m]: 1e-9 of a loaded mesh's approach.
_CONVERGED = 1e-13
_MOST_ITERATIONS = 40
#: Plain iterations before Newton's: in steady contact the forces beyond the linear part are a few per cent of it.
_PLAIN = 8
#: First channels: the carrier angle, then the flanks.
_FLANKS = 1
#: Channels of the housing's motion.
_HOUSING = 6
#: Motions over a step smaller than this [m] count as none: the difference quotient would be rounding.
_STILL = 1e-13


@numba.njit(cache=True)
def mesh_stiffness_at(real: NDArray[np.float64], imag: NDArray[np.float64], angle: float) -> NDArray[np.float64]:
    """Stiffness [N/m] of every mesh at the mesh angle [rad]: ``Σ_h real cos(h angle) - imag sin(h angle)``.

    Parameters
    ----------
    real, imag : ndarray, shape (n_meshes, n_harmonics + 1)
        Amplitudes of :class:`simulation.stage.gear_meshes.MeshStiffness`.
    angle : float
        Mesh angle [rad].
    """
    k = real[:, 0].copy()
    for h in range(1, real.shape[1]):
        c, s = np.cos(h * angle), np.sin(h * angle)
        for j in range(len(k)):
            k[j] += real[j, h] * c - imag[j, h] * s
    return k


@numba.njit(cache=True)
def squeeze_gradient(old: float, new: float) -> tuple[float, float]:
    """Mean of ``max(d, 0)`` from `old` to `new` and its derivative by `new`: discrete gradient of ``max(d, 0)^2 / 2``."""
    if old >= 0.0 and new >= 0.0:
        return 0.5 * (old + new), 0.5
    if old <= 0.0 and new <= 0.0:
        return 0.0, 0.0
    a, b = max(old, 0.0), max(new, 0.0)
    mean = 0.5 * (b * b - a * a) / (new - old)
    return mean, (b - mean) / (new - old)


@numba.njit(cache=True)
def play_force(y: float, z: float, clearance: float) -> tuple[float, float, float]:
    """Radial contact per stiffness: force y and z [m], and the energy per stiffness [m^2] of ``max(|r| - c, 0)^2 / 2``."""
    r = np.sqrt(y * y + z * z)
    if r <= clearance:
        return 0.0, 0.0, 0.0
    share = 1.0 - clearance / r
    return share * y, share * z, 0.5 * (r - clearance) ** 2


@numba.njit(cache=True)
def play_gradient(old_y: float, old_z: float, new_y: float, new_z: float, clearance: float) -> tuple[float, float]:
    """Discrete gradient of the radial contact's energy over a step (Gonzalez 1996, eq. 3.8), per stiffness [m]."""
    mid_y, mid_z, _ = play_force(0.5 * (old_y + new_y), 0.5 * (old_z + new_z), clearance)
    _, _, old_energy = play_force(old_y, old_z, clearance)
    _, _, new_energy = play_force(new_y, new_z, clearance)
    dy, dz = new_y - old_y, new_z - old_z
    square = dy * dy + dz * dz
    if square < _STILL * _STILL:
        return mid_y, mid_z
    rest = (new_energy - old_energy - mid_y * dy - mid_z * dz) / square
    return mid_y + rest * dy, mid_z + rest * dz


@numba.njit(cache=True)
def play_stiffness(y: float, z: float, clearance: float) -> tuple[float, float, float]:
    """Tangent of the radial contact, per stiffness: yy, yz, zz."""
    r = np.sqrt(y * y + z * z)
    if r <= clearance:
        return 0.0, 0.0, 0.0
    share = clearance / r
    return 1.0 - share * z * z / (r * r), share * y * z / (r * r), 1.0 - share * y * y / (r * r)


@numba.njit(cache=True)
def _mount_tangent(k: StepMatrices, angle: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Stiffness and damping of the mount beyond the linear part, carrier frame, shape (6, 6)."""
    c, s = np.cos(angle), np.sin(angle)
    R = np.zeros((6, 6))
    J = np.zeros((6, 6))
    for i in (0, 3):
        R[i, i] = 1.0
        R[i + 1, i + 1], R[i + 1, i + 2], R[i + 2, i + 1], R[i + 2, i + 2] = c, -s, s, c
        J[i + 1, i + 2], J[i + 2, i + 1] = -1.0, 1.0
    damping = R.T @ k.C_mount @ R
    # The housing's velocity in the fixed frame, seen from the carrier's: x' + Omega J x.
    return R.T @ k.K_mount @ R - k.K_mean + k.speed * (damping @ J), damping - k.C_mean


@numba.njit(cache=True)
def _flanks(
    k: StepMatrices,
    s: NDArray[np.float64],
    delta: NDArray[np.float64],
    teeth: tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]],
    force: NDArray[np.float64],
    tangent: NDArray[np.float64],
) -> None:
    """Force and tangent of the flanks, and the torque that the changing stiffness puts on the carrier angle."""
    old_k, mid_k, new_k = teeth
    work = 0.0
    for j in range(len(k.gaps)):
        own, stiffness = _FLANKS + j, mid_k[j % len(mid_k)]
        old = delta[own] - k.gaps[j]
        new = old + k.h * s[own]
        mean, slope = squeeze_gradient(old, new)
        force[own] = k.reference[own] * (delta[own] + 0.5 * k.h * s[own]) - stiffness * mean
        tangent[own, own] = k.h * (0.5 * k.reference[own] - stiffness * slope)
        i = j % len(mid_k)
        work += 0.5 * ((new_k[i] - mid_k[i]) * max(new, 0.0) ** 2 + (mid_k[i] - old_k[i]) * max(old, 0.0) ** 2)
    turned = k.h * s[0]
    force[0] = -work / turned if abs(turned) > 1e-12 else 0.0


@numba.njit(cache=True)
def _plays(
    k: StepMatrices,
    s: NDArray[np.float64],
    delta: NDArray[np.float64],
    force: NDArray[np.float64],
    tangent: NDArray[np.float64],
) -> None:
    """Force and tangent of the bearings with clearance."""
    for i in range(len(k.clearance)):
        y = _FLANKS + len(k.gaps) + _HOUSING + 2 * i
        z = y + 1
        stiffness = k.reference[y]
        new_y, new_z = delta[y] + k.h * s[y], delta[z] + k.h * s[z]
        fy, fz = play_gradient(delta[y], delta[z], new_y, new_z, k.clearance[i])
        yy, yz, zz = play_stiffness(0.5 * (delta[y] + new_y), 0.5 * (delta[z] + new_z), k.clearance[i])
        force[y] = stiffness * (0.5 * (delta[y] + new_y) - fy)
        force[z] = stiffness * (0.5 * (delta[z] + new_z) - fz)
        half = 0.5 * k.h * stiffness
        tangent[y, y], tangent[z, z] = half * (1.0 - yy), half * (1.0 - zz)
        tangent[y, z] = tangent[z, y] = -half * yz


@numba.njit(cache=True)
def solve_channels(
    k: StepMatrices,
    s_free: NDArray[np.float64],
    delta: NDArray[np.float64],
    old_k: NDArray[np.float64],
    force: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], bool]:
    """Mid-step velocities of the channels, the meshes' new stiffness, and whether Newton's method settled.

    `force` holds the last step's forces, a good guess, and takes the new ones.
    """
    m = len(s_free)
    s, tangent, angle = s_free + k.W @ force, np.zeros((m, m)), delta[0]
    first = _FLANKS + len(k.gaps)
    own = slice(first, first + _HOUSING)
    K_turned, C_turned = _mount_tangent(k, angle + 0.5 * k.h * s_free[0])
    mount = 0.5 * k.h * K_turned + C_turned
    tangent[own, own] = -mount
    new_k = old_k
    for iteration in range(_MOST_ITERATIONS):
        mid_k = mesh_stiffness_at(k.real, k.imag, k.mesh_teeth * (angle + 0.5 * k.h * s[0]))
        new_k = mesh_stiffness_at(k.real, k.imag, k.mesh_teeth * (angle + k.h * s[0]))
        _flanks(k, s, delta, (old_k, mid_k, new_k), force, tangent)
        force[own] = -(mount @ s[own]) - K_turned @ delta[own]
        _plays(k, s, delta, force, tangent)
        change = s - s_free - k.W @ force
        if iteration >= _PLAIN:
            change[:] = np.linalg.solve(np.eye(m) - k.W @ tangent, change)
        s = s - change
        if not np.isfinite(change).all():
            return s, new_k, False
        if np.abs(change).max() * k.h <= _CONVERGED:
            return s, new_k, True
    return s, new_k, False


@numba.njit(cache=True)
def advance(
    k: StepMatrices,
    q: NDArray[np.float64],
    v: NDArray[np.float64],
    free: NDArray[np.float64],
    drive: NDArray[np.float64],
    every: int,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], int]:
    """Advance by ``len(drive)`` steps, keeping every `every`-th state.

    Parameters
    ----------
    k : StepMatrices
        Constants.
    q, v : ndarray, shape (n,)
        Modal coordinates and velocities; both end at the last state reached.
    free : ndarray, shape (m,)
        Offsets of the channels.
    drive : ndarray, shape (n_steps, 4)
        Torque [N m], wanted generator speed [rad/s], radial load y and z [N] in the fixed frame, at mid-step.
    every : int
        Steps between kept states.

    Returns
    -------
    q_kept, v_kept : ndarray, shape (n_kept, n)
        States.
    work : ndarray, shape (n_kept, 5)
        Energy since the first state [J]: from torque, from generator, from weight and radial load and constant forces, from the
        mount beyond its turning mean, and dissipated.
    done : int
        Steps done; fewer than asked for where the state ran away.
    """
    n_kept = len(drive) // every
    q_kept, v_kept, work = np.zeros((n_kept, len(q))), np.zeros((n_kept, len(q))), np.zeros((n_kept, 5))
    delta = k.B @ q - free
    total, a, force = np.zeros(5), np.zeros(len(k.P)), np.zeros(len(delta))
    a[-1] = 1.0
    house = slice(_FLANKS + len(k.gaps), _FLANKS + len(k.gaps) + _HOUSING)
    stiffness = mesh_stiffness_at(k.real, k.imag, k.mesh_teeth * delta[0])
    for step in range(len(drive)):
        middle = delta[0] + 0.5 * k.h * (k.B[0] @ v)
        c, s_ = np.cos(middle), np.sin(middle)
        a[0], a[1] = drive[step, 0], k.generator_constant * drive[step, 1]
        a[2], a[3] = -k.gravity * s_, -k.gravity * c
        a[4] = c * drive[step, 2] + s_ * drive[step, 3]
        a[5] = c * drive[step, 3] - s_ * drive[step, 2]
        free_w = k.A_inverse @ ((2.0 / k.h) * v - k.stiffness * q + a @ k.P)
        s, stiffness, settled = solve_channels(k, k.B @ free_w, delta, stiffness, force)
        w = free_w + force @ k.A_inverse_B
        if not (settled and np.isfinite(w).all()):
            return q_kept[: step // every], v_kept[: step // every], work[: step // every], step
        rates = k.P @ w
        total[0] += k.h * a[0] * rates[0]
        total[1] += k.h * (a[1] - k.generator_constant * rates[1]) * rates[1]
        total[2] += k.h * (a[2:] @ rates[2:])
        total[3] += k.h * (force[house] @ s[house])
        total[4] += k.h * (k.structural @ (w * w) + s[house] @ (k.C_mean @ s[house]))
        q += k.h * w
        v[:] = 2.0 * w - v
        delta += k.h * s
        if (step + 1) % every == 0:
            kept = step // every
            q_kept[kept], v_kept[kept], work[kept] = q, v, total
    return q_kept, v_kept, work, len(drive)
