"""One step of the stage.

Implicit midpoint rule in modal coordinates, contact by discrete gradients (compiled).

With the mid-step velocity ``w = (v_0 + v_1)/2``: ``q_1 = q_0 + h w``, ``v_1 = 2 w - v_0`` and

``(2/h + D + h/2 omega^2) w = (2/h) v_0 - omega^2 q_0 + P a + Bᵀ lambda``.

The matrix is constant; the channels' forces ``lambda`` depend on their mid-step velocities ``s = B
w`` alone, a small system ``s = s_free + W lambda(s)`` for Newton's method. Discrete gradients make
work and stored energy balance to rounding.

Numba's cache of a compiled caller does not see changes in another file: touch this one after a
change of :mod:`carrierflex.simulation.stage.contact_laws` or
:mod:`carrierflex.simulation.stage.roller_contact`.
"""

import numba
import numpy as np
from numpy.typing import NDArray

from carrierflex.simulation.stage.contact_laws import (
    mesh_stiffness_at,
    penetration_gradient,
    play_gradient,
)
from carrierflex.simulation.stage.modal_form import StepMatrices
from carrierflex.simulation.stage.roller_contact import roller_energy, roller_gradient

#: Change of the channels' motion over a step that ends Newton's method [m]: 1e-9 of a loaded mesh's
#: approach.
_CONVERGED = 1e-13
#: The same for a step of Newton's method, which leaves less than a thousandth of it.
_CONVERGED_NEWTON = 1e-9
#: Share of the largest motion over a step that rounding may leave; matters where a run is about to
#: run away.
_ROUNDING = 1e-11
_MOST_ITERATIONS = 60
#: Newton's steps are halved from here on: whoever has not arrived by now goes to and fro between
#: pieces of a contact law.
_HALVED_FROM = 16
#: Plain iterations before Newton's: in steady contact the forces beyond the linear part are a few
#: per cent of it.
_PLAIN = 8
#: Rollers coming into contact change the tangent at once; plain iterations would cost more than
#: they save.
_PLAIN_ROLLERS = 2
#: First channels: the carrier angle, then the flanks.
_FLANKS = 1
#: Channels of the housing's motion; unequal bearings follow with two each.
_HOUSING = 6


@numba.njit(cache=True)
def _turning_tangent(
    k: StepMatrices, angle: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Stiffness and damping of mount and unequal bearings beyond the linear part, carrier frame.

    Shape (t, t).
    """
    c, s = np.cos(angle), np.sin(angle)
    R = np.eye(len(k.K_fixed))
    J = np.zeros_like(R)
    for pair in range(len(R) // 2 - 1):
        # y and z of the housing's translation and rotation, then of each bearing.
        y = (1, 4)[pair] if pair < 2 else _HOUSING + 2 * (pair - 2)
        z = y + 1
        R[y, y] = c
        R[y, z] = -s
        R[z, y] = s
        R[z, z] = c
        J[y, z], J[z, y] = -1.0, 1.0
    damping = R.T @ k.C_fixed @ R
    # The velocity in the fixed frame, seen from the carrier's: x' + Omega J x.
    return R.T @ k.K_fixed @ R - k.K_mean + k.speed * (damping @ J), damping - k.C_mean


@numba.njit(cache=True)
def _flanks(
    k: StepMatrices,
    s: NDArray[np.float64],
    delta: NDArray[np.float64],
    teeth: tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]],
    force: NDArray[np.float64],
    tangent: NDArray[np.float64],
) -> None:
    """Force and tangent of the flanks.

    The torque that the changing stiffness puts on the carrier angle.
    """
    old_k, mid_k, new_k = teeth
    work = 0.0
    for j in range(len(k.gaps)):
        channel, stiffness = _FLANKS + j, mid_k[j % len(mid_k)]
        old = delta[channel] - k.gaps[j]
        new = old + k.h * s[channel]
        mean, slope = penetration_gradient(old, new)
        force[channel] = (
            k.reference[channel] * (delta[channel] + 0.5 * k.h * s[channel]) - stiffness * mean
        )
        tangent[channel, channel] = k.h * (0.5 * k.reference[channel] - stiffness * slope)
        i = j % len(mid_k)
        work += 0.5 * (
            (new_k[i] - mid_k[i]) * max(new, 0.0) ** 2 + (mid_k[i] - old_k[i]) * max(old, 0.0) ** 2
        )
    turned = k.h * s[0]
    force[0] = -work / turned if abs(turned) > 1e-12 else 0.0


@numba.njit(cache=True)
def _clearances(
    k: StepMatrices,
    s: NDArray[np.float64],
    delta: NDArray[np.float64],
    force: NDArray[np.float64],
    tangent: NDArray[np.float64],
) -> None:
    """Force and tangent of the bearings with clearance."""
    for i in range(len(k.clearance)):
        y = _FLANKS + len(k.gaps) + len(k.K_fixed) + 2 * i
        z = y + 1
        stiffness = k.reference[y]
        new_y, new_z = delta[y] + k.h * s[y], delta[z] + k.h * s[z]
        fy, fz, yy, yz, zy, zz = play_gradient(delta[y], delta[z], new_y, new_z, k.clearance[i])
        force[y] = stiffness * (0.5 * (delta[y] + new_y) - fy)
        force[z] = stiffness * (0.5 * (delta[z] + new_z) - fz)
        scale = k.h * stiffness
        tangent[y, y], tangent[y, z] = scale * (0.5 - yy), -scale * yz
        tangent[z, y], tangent[z, z] = -scale * zy, scale * (0.5 - zz)


@numba.njit(cache=True)
def _rollers(
    k: StepMatrices,
    s: NDArray[np.float64],
    delta: NDArray[np.float64],
    old_energy: NDArray[np.float64],
    force: NDArray[np.float64],
    tangent: NDArray[np.float64],
) -> None:
    """Force and tangent of the roller bearings.

    The torque that their rollers' passing puts on the carrier angle.
    """
    first = _FLANKS + len(k.gaps) + len(k.K_fixed) + 2 * len(k.clearance)
    gradient, stiffness = np.zeros(4), np.zeros((4, 4))
    angles = (delta[0], delta[0] + k.h * s[0])
    for b in range(len(old_energy)):
        channel = slice(first + 4 * b, first + 4 * b + 4)
        ends = (delta[channel], delta[channel] + k.h * s[channel])
        force[0] -= roller_gradient(k.rollers, b, ends, angles, old_energy[b], gradient, stiffness)
        force[channel] = k.reference[channel] * 0.5 * (ends[0] + ends[1]) - gradient
        tangent[channel, channel] = 0.5 * k.h * (np.diag(k.reference[channel]) - stiffness)


@numba.njit(cache=True)
def _roller_energies(k: StepMatrices, delta: NDArray[np.float64]) -> NDArray[np.float64]:
    """Energy of every roller bearing [J]."""
    energy = np.zeros(len(k.rollers.directions))
    for b in range(len(energy)):
        first = _FLANKS + len(k.gaps) + len(k.K_fixed) + 2 * len(k.clearance) + 4 * b
        energy[b] = roller_energy(k.rollers, b, delta[first : first + 4], delta[0])
    return energy


@numba.njit(cache=True)
def _newton_matrix(k: StepMatrices, tangent: NDArray[np.float64]) -> NDArray[np.float64]:
    """``1 - W tangent``, shape (m, m).

    The tangent has blocks of one flank, what turns, a play (2) or a bearing (4).
    """
    matrix, first = np.eye(len(tangent)), _FLANKS
    for size, count in (
        (1, len(k.gaps)),
        (len(k.K_fixed), 1),
        (2, len(k.clearance)),
        (4, len(k.rollers.directions)),
    ):
        for _ in range(count):
            for i in range(first, first + size):
                for j in range(first, first + size):
                    if tangent[i, j] != 0.0:
                        # W is symmetric but for Coriolis forces: its rows are not its columns.
                        matrix[:, j] -= tangent[i, j] * k.W[:, i]
            first += size
    return matrix


@numba.njit(cache=True)
def solve_channels(
    k: StepMatrices,
    s_free: NDArray[np.float64],
    delta: NDArray[np.float64],
    old_k: NDArray[np.float64],
    force: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], int]:
    """Mid-step velocities of the channels, and the meshes' new stiffness.

    Then the channel that did not settle, -1 for none.

    `force` holds a guess and takes the forces.
    """
    m = len(s_free)
    s = s_free + k.W @ force
    change = np.zeros(m)
    tangent = np.zeros((m, m))
    angle = delta[0]
    first = _FLANKS + len(k.gaps)
    channel = slice(first, first + len(k.K_fixed))
    K_turned, C_turned = _turning_tangent(k, angle + 0.5 * k.h * s_free[0])
    mount = 0.5 * k.h * K_turned + C_turned
    tangent[channel, channel] = -mount
    new_k, old_energy = old_k, _roller_energies(k, delta)
    plain = _PLAIN if len(old_energy) == 0 else _PLAIN_ROLLERS
    rounding = _ROUNDING * k.h * np.abs(s).max()
    for iteration in range(_MOST_ITERATIONS):
        mid_k = mesh_stiffness_at(k.real, k.imag, k.mesh_teeth * (angle + 0.5 * k.h * s[0]))
        new_k = mesh_stiffness_at(k.real, k.imag, k.mesh_teeth * (angle + k.h * s[0]))
        _flanks(k, s, delta, (old_k, mid_k, new_k), force, tangent)
        force[channel] = -(mount @ s[channel]) - K_turned @ delta[channel]
        _clearances(k, s, delta, force, tangent)
        _rollers(k, s, delta, old_energy, force, tangent)
        change, enough = s - s_free - k.W @ force, _CONVERGED
        if iteration >= plain:
            change[:] = np.linalg.solve(_newton_matrix(k, tangent), change)
            if iteration >= _HALVED_FROM and np.abs(change).max() * k.h > _CONVERGED_NEWTON:
                change *= 0.5
            # Forces of the new velocities but for a second-order rest, and in balance with them to
            # rounding.
            force -= tangent @ change
            enough = _CONVERGED_NEWTON
        s = s - change
        if not np.isfinite(change).all():
            return s, new_k, int(np.argmin(np.isfinite(change)))
        if np.abs(change).max() * k.h <= enough + rounding:
            return s, new_k, -1
    return s, new_k, int(np.argmax(np.abs(change)))


@numba.njit(cache=True)
def advance(
    k: StepMatrices,
    q: NDArray[np.float64],
    v: NDArray[np.float64],
    free: NDArray[np.float64],
    drive: NDArray[np.float64],
    every: int,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], int, int]:
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
        Torque [N m], wanted generator speed [rad/s], radial load y and z [N] in the fixed frame, at
        mid-step.
    every : int
        Steps between kept states.

    Returns
    -------
    q_kept, v_kept : ndarray, shape (n_kept, n)
        States.
    work : ndarray, shape (n_kept, 5)
        Energy since the first state [J]: from torque, from generator, from weight and radial load
        and constant forces, from the mount beyond its turning mean, and dissipated.
    done : int
        Steps done; fewer than asked for where the state ran away.
    unsettled : int
        Channel whose force found no balance then, -1 where all did.
    """
    n_kept = len(drive) // every
    q_kept = np.zeros((n_kept, len(q)))
    v_kept = np.zeros((n_kept, len(q)))
    work = np.zeros((n_kept, 5))
    delta = k.B @ q - free
    total = np.zeros(5)
    a = np.ones(len(k.P))
    force = np.zeros(len(delta))
    before = np.zeros(len(delta))
    turning = slice(_FLANKS + len(k.gaps), _FLANKS + len(k.gaps) + len(k.K_fixed))
    stiffness = mesh_stiffness_at(k.real, k.imag, k.mesh_teeth * delta[0])
    for step in range(len(drive)):
        middle = delta[0] + 0.5 * k.h * (k.B[0] @ v)
        c, s_ = np.cos(middle), np.sin(middle)
        a[0], a[1] = drive[step, 0], k.generator_constant * drive[step, 1]
        a[2], a[3] = -k.gravity * s_, -k.gravity * c
        a[4] = c * drive[step, 2] + s_ * drive[step, 3]
        a[5] = c * drive[step, 3] - s_ * drive[step, 2]
        free_w = k.A_inverse @ ((2.0 / k.h) * v - k.stiffness * q + a @ k.P)
        force, before = 2.0 * force - before, force
        s, stiffness, unsettled = solve_channels(k, k.B @ free_w, delta, stiffness, force)
        w = free_w + force @ k.A_inverse_B
        if unsettled >= 0 or not np.isfinite(w).all():
            return (
                q_kept[: step // every],
                v_kept[: step // every],
                work[: step // every],
                step,
                unsettled,
            )
        rates = k.P @ w
        total[0] += k.h * a[0] * rates[0]
        total[1] += k.h * (a[1] - k.generator_constant * rates[1]) * rates[1]
        total[2] += k.h * (a[2:] @ rates[2:])
        total[3] += k.h * (force[turning] @ s[turning])
        total[4] += k.h * (k.structural @ (w * w) + s[turning] @ (k.C_mean @ s[turning]))
        q += k.h * w
        v[:] = 2.0 * w - v
        delta += k.h * s
        if (step + 1) % every == 0:
            kept = step // every
            q_kept[kept] = q
            v_kept[kept] = v
            work[kept] = total
    return q_kept, v_kept, work, len(drive), -1
