"""The march of the stage: steps of the midpoint rule, compiled.

Every step solves the contact forces of its channels by Newton's method, with the modes of
:mod:`carrierflex.simulation.stage.modal_form` eliminated.
"""

import numba
import numpy as np
from numpy.typing import NDArray

from carrierflex.simulation.stage.contact_laws import (
    fill_mesh_stiffness,
    penetration_gradient,
    play_gradient,
    spline_energy,
    spline_force,
)
from carrierflex.simulation.stage.modal_form import StepMatrices
from carrierflex.simulation.stage.roller_contact import RollerSet, roller_load

#: Change of the channels' motion over a step with which Newton's method ends [m]: what it leaves is
#: of second order, 1e-10 m of a loaded mesh's 6e-5 m.
_CONVERGED = 1e-7
#: Share of the largest motion over a step that rounding may leave; matters where a run is about to
#: run away.
_ROUNDING = 1e-11
_MOST_ITERATIONS = 60
#: Newton's steps are halved from here on: whoever has not arrived by now goes to and fro between
#: pieces of a contact law.
_HALVED_FROM = 16
#: Newton's equations are solved by the inverse of an earlier step's matrix, refined until the last
#: refinement is this share of the change or this motion [m], and by a new inverse where one takes
#: less of the error than a refinement must.
_REFINED, _EXACT, _SLOW, _MOST_REFINEMENTS = 1e-4, 1e-11, 0.2, 8
#: Turns over a step [rad]: below the first no work is shared out by them, below the second the
#: meshes' stiffness is the same.
_NO_TURN, _SAME_TURN = 1e-12, 1e-9
#: Work on the rollers over their energy below which forces at the middle of a step do it to
#: rounding; beyond, the next step takes from the drive what they store more than they were given.
_GENTLE = 1e-3
#: Turn over a step [rad] below which the drive gives rollers less than the energy that they miss.
_SLOW_TURN = 1e-5
_Arrays = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]
#: First channels: the carrier angle, then the flanks.
_FLANKS = 1


@numba.njit(cache=True, fastmath={"contract"})
def _add_product(
    factor: float,
    columns: NDArray[np.float64],
    x: NDArray[np.float64],
    out: NDArray[np.float64],
) -> None:
    """``out += factor * matrix @ x`` of a matrix given by columns, four at once: vectorised."""
    n = len(x)
    fours = n - n % 4
    for j in range(0, fours, 4):
        a, b, c, d = factor * x[j], factor * x[j + 1], factor * x[j + 2], factor * x[j + 3]
        for i in range(len(out)):
            out[i] += (
                a * columns[j, i]
                + b * columns[j + 1, i]
                + c * columns[j + 2, i]
                + d * columns[j + 3, i]
            )
    for j in range(fours, n):
        a = factor * x[j]
        for i in range(len(out)):
            out[i] += a * columns[j, i]


@numba.njit(cache=True, fastmath={"contract"})
def _turned(
    K_series: NDArray[np.float64],
    C_series: NDArray[np.float64],
    angle: float,
    K: NDArray[np.float64],
    C: NDArray[np.float64],
) -> None:
    """Sums of two matrices' series at a carrier angle."""
    c, s = np.cos(angle), np.sin(angle)
    c_2, s_2 = c * c - s * s, 2.0 * c * s
    for series, out in ((K_series, K), (C_series, C)):
        for i in range(len(out)):
            for j in range(len(out)):
                out[i, j] = (
                    series[0, i, j]
                    + c * series[1, i, j]
                    + s * series[2, i, j]
                    + c_2 * series[3, i, j]
                    + s_2 * series[4, i, j]
                )


@numba.njit(cache=True, inline="always")
def _expect_teeth(
    flanks: _Arrays,
    delta: NDArray[np.float64],
    turn: float,
    stiffness: _Arrays,
    pushes: NDArray[np.float64],
    force: NDArray[np.float64],
) -> None:
    """Forces of closed flanks where the tooth forces go on as over the last two steps.

    The motions follow the teeth's stiffness; the forces hardly change.
    """
    gaps, shares, reference = flanks
    old_k, mid_k, new_k = stiffness
    torque = 0.0
    for j in range(len(gaps)):
        push = 2.0 * pushes[0, j] - pushes[1, j]
        if push > 0.0 and pushes[1, j] > 0.0:
            i, channel = j % len(mid_k), _FLANKS + j
            middle = push / (shares[j] * mid_k[i])
            old = max(delta[channel] - gaps[j], 0.0)
            new = max(2.0 * middle - old, 0.0)
            force[channel] = reference[channel] * (gaps[j] + middle) - push
            rise, risen = shares[j] * (new_k[i] - mid_k[i]), shares[j] * (mid_k[i] - old_k[i])
            torque += rise * new * new + risen * old * old
    if abs(turn) > _NO_TURN:
        force[0] = -0.5 * torque / turn


@numba.njit(cache=True, inline="always")
def _flanks(
    flanks: _Arrays,
    h: float,
    s: NDArray[np.float64],
    delta: NDArray[np.float64],
    stiffness: _Arrays,
    force: NDArray[np.float64],
    tangent: NDArray[np.float64],
) -> None:
    """Force and tangent of the flanks."""
    old_k, mid_k, new_k = stiffness
    gaps, shares, reference = flanks
    moved = h * s[0]
    per_turn = 0.5 / moved if abs(moved) > _NO_TURN else 0.0
    torque = 0.0
    for j in range(len(gaps)):
        i = j % len(mid_k)
        channel, share = _FLANKS + j, shares[j]
        closed = reference[channel]
        old = delta[channel] - gaps[j]
        new = old + h * s[channel]
        linear = closed * (delta[channel] + 0.5 * h * s[channel])
        if old <= 0.0 and new <= 0.0:
            force[channel] = linear
            tangent[channel, channel] = 0.5 * h * closed
            tangent[0, channel] = tangent[channel, 0] = 0.0
            continue
        middle = share * mid_k[i]
        mean, slope = penetration_gradient(old, new)
        force[channel] = linear - middle * mean
        tangent[channel, channel] = h * (0.5 * closed - middle * slope)
        old, new = max(old, 0.0), max(new, 0.0)
        rise, risen = share * (new_k[i] - mid_k[i]), share * (mid_k[i] - old_k[i])
        torque += rise * new * new + risen * old * old
        # The drive and the flanks turn each other's stiffness.
        tangent[0, channel] = -2.0 * h * rise * new * per_turn
        tangent[channel, 0] = -h * (rise + risen) * mean * per_turn
    force[0] = -torque * per_turn


@numba.njit(cache=True, inline="always")
def _clearances(
    clearance: NDArray[np.float64],
    reference: NDArray[np.float64],
    first: int,
    h: float,
    s: NDArray[np.float64],
    delta: NDArray[np.float64],
    force: NDArray[np.float64],
    tangent: NDArray[np.float64],
) -> None:
    """Force and tangent of the bearings with clearance."""
    for i in range(len(clearance)):
        y = first + 2 * i
        z = y + 1
        stiffness = reference[y]
        new_y, new_z = delta[y] + h * s[y], delta[z] + h * s[z]
        fy, fz, yy, yz, zy, zz = play_gradient(delta[y], delta[z], new_y, new_z, clearance[i])
        force[y] = stiffness * (0.5 * (delta[y] + new_y) - fy)
        force[z] = stiffness * (0.5 * (delta[z] + new_z) - fz)
        scale = h * stiffness
        tangent[y, y], tangent[y, z] = scale * (0.5 - yy), -scale * yz
        tangent[z, y], tangent[z, z] = -scale * zy, scale * (0.5 - zz)


@numba.njit(cache=True, inline="always")
def _rollers(
    rollers: RollerSet,
    reference: NDArray[np.float64],
    first: int,
    h: float,
    s: NDArray[np.float64],
    delta: NDArray[np.float64],
    force: NDArray[np.float64],
    tangent: NDArray[np.float64],
) -> tuple[float, float]:
    """Force and tangent of the roller bearings in the middle of the step.

    Returned: gradient of their energy by the carrier angle, and the energy [J].
    """
    middle, load, stiffness = np.empty(4), np.empty(4), np.empty((4, 4))
    angle = delta[0] + 0.5 * h * s[0]
    by_angle, energy = 0.0, 0.0
    for b in range(len(rollers.directions)):
        for i in range(4):
            middle[i] = delta[first + i] + 0.5 * h * s[first + i]
        torque, stored = roller_load(rollers, b, middle, angle, load, stiffness)
        by_angle += torque
        energy += stored
        for i in range(4):
            closed = reference[first + i]
            force[first + i] = closed * middle[i] - load[i]
            for j in range(4):
                tangent[first + i, first + j] = -0.5 * h * stiffness[i, j]
            tangent[first + i, first + i] += 0.5 * h * closed
        first += 4
    return by_angle, energy


@numba.njit(cache=True, inline="always")
def _splines(
    k: StepMatrices,
    s: NDArray[np.float64],
    delta: NDArray[np.float64],
    force: NDArray[np.float64],
    tangent: NDArray[np.float64],
) -> None:
    """Force and tangent of the sun's spline at the middle of the step."""
    h, splines = k.h, k.splines
    for i in range(len(splines)):
        twist = len(delta) - 3 * (len(splines) - i)
        stiffness, clearance, friction = splines[i]
        middle = delta[twist : twist + 3] + 0.5 * h * s[twist : twist + 3]
        y, z = middle[1], middle[2]
        limit = friction * abs(middle[0])
        fy, fz, yy, yz, zy, zz, y_L, z_L = spline_force(y, z, stiffness, clearance, limit)
        force[twist + 1] = stiffness * y - fy
        force[twist + 2] = stiffness * z - fz
        scale = 0.5 * h
        by_twist = scale * friction * np.sign(middle[0])
        tangent[twist + 1, twist], tangent[twist + 2, twist] = -y_L * by_twist, -z_L * by_twist
        tangent[twist + 1, twist + 1], tangent[twist + 1, twist + 2] = (
            scale * (stiffness - yy),
            -scale * yz,
        )
        tangent[twist + 2, twist + 1], tangent[twist + 2, twist + 2] = (
            -scale * zy,
            scale * (stiffness - zz),
        )


@numba.njit(cache=True)
def _roller_energy(k: StepMatrices, delta: NDArray[np.float64]) -> float:
    """Energy of the roller bearings [J]."""
    first = len(delta) - 3 * len(k.splines) - 4 * len(k.rollers.directions)
    load, stiffness, energy = np.empty(4), np.empty((4, 4)), 0.0
    for b in range(len(k.rollers.directions)):
        motion = delta[first + 4 * b : first + 4 * b + 4]
        energy += roller_load(k.rollers, b, motion, delta[0], load, stiffness)[1]
    return energy


@numba.njit(cache=True)
def _quill_energies(k: StepMatrices, delta: NDArray[np.float64]) -> float:
    """Energy of the sun's quill beyond the linear part's [J]."""
    energy = 0.0
    for i in range(len(k.splines)):
        twist = len(delta) - 3 * (len(k.splines) - i)
        stiffness, clearance, friction = k.splines[i]
        y, z = delta[twist + 1], delta[twist + 2]
        energy += spline_energy(y, z, stiffness, clearance, friction * abs(delta[twist]))
    return energy


@numba.njit(cache=True)
def _inverse(
    W: NDArray[np.float64], blocks: NDArray[np.int64], tangent: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Inverse of ``1 - tangent W`` by columns, shape (m, m), of W by columns."""
    rows = np.eye(len(tangent))
    for first, size in blocks:
        for i in range(first, first + size):
            for j in range(first, first + size):
                if tangent[i, j] != 0.0:
                    rows[i] -= tangent[i, j] * W[:, j]
    return np.ascontiguousarray(np.linalg.inv(rows).T)


@numba.njit(cache=True)
def _add_tangent(
    blocks: NDArray[np.int64],
    tangent: NDArray[np.float64],
    moved: NDArray[np.float64],
    force: NDArray[np.float64],
) -> None:
    """Add what a change of velocities makes of the forces from them."""
    for b in range(len(blocks)):
        first, end = blocks[b, 0], blocks[b, 0] + blocks[b, 1]
        for i in range(first, end):
            for j in range(first, end):
                force[i] += tangent[i, j] * moved[j]


@numba.njit(cache=True, inline="always")
def _newton_step(
    W: NDArray[np.float64],
    blocks: NDArray[np.int64],
    h: float,
    tangent: NDArray[np.float64],
    gap: NDArray[np.float64],
    inverse: NDArray[np.float64],
    change: NDArray[np.float64],
    moved: NDArray[np.float64],
) -> float:
    """Change of the forces, ``(1 - tangent W) change = gap``, and the velocities that it moves.

    By `inverse`, that of an earlier such matrix, refined; made anew where it has become too coarse.
    Returned: the largest change of the channels' motion [m].
    """
    m = len(gap)
    rest, step, moving = gap.copy(), np.empty(m), np.empty(m)
    change[:] = 0.0
    moved[:] = 0.0
    largest, size = 0.0, np.inf
    for _ in range(_MOST_REFINEMENTS):
        step[:] = 0.0
        moving[:] = 0.0
        _add_product(1.0, inverse, rest, step)
        _add_product(1.0, W, step, moving)
        before, size = size, h * _largest_size(moving)
        if size > _SLOW * before:
            inverse[:] = _inverse(W, blocks, tangent)
            change[:] = 0.0
            moved[:] = 0.0
            _add_product(1.0, inverse, gap, change)
            _add_product(1.0, W, change, moved)
            return h * _largest_size(moved)
        for i in range(m):
            change[i] += step[i]
            moved[i] += moving[i]
        largest = max(largest, size)
        if size <= max(_REFINED * largest, _EXACT):
            break
        for i in range(m):
            rest[i] -= step[i]
        _add_tangent(blocks, tangent, moving, rest)
    return largest


@numba.njit(cache=True)
def _largest_size(x: NDArray[np.float64]) -> float:
    """Largest absolute value."""
    largest = 0.0
    for i in range(len(x)):
        largest = max(largest, abs(x[i]))
    return largest


@numba.njit(cache=True, inline="always")
def _solve_channels(
    k: StepMatrices,
    s: NDArray[np.float64],
    delta: NDArray[np.float64],
    turn: float,
    stiffness: _Arrays,
    flanks: _Arrays,
    given_back: float,
    force: NDArray[np.float64],
    inverse: NDArray[np.float64],
    tangent: NDArray[np.float64],
) -> tuple[int, float, float]:
    """Balance of a step: mid-step velocities and forces of the channels, in place.

    `s` begins with the velocities under no such forces, `force` with a guess, `stiffness` with that
    of a step that turns by `turn`; the rollers take `given_back` [N m] from the drive more;
    `inverse` as in :func:`_newton_step`. Returned: the channel that finds no balance, or -1, and as
    :func:`_rollers`.
    """
    # What has arrays is named once: it is counted in and out wherever it is.
    h, m, W, blocks = k.h, len(s), k.W_columns, k.blocks
    real, imag, mesh_teeth = k.real, k.imag, k.mesh_teeth
    clearance, rollers, reference = k.clearance, k.rollers, k.reference
    n_loose, n_rolling, n_splines = len(clearance), len(rollers.directions), len(k.splines)
    rolling = m - 3 * n_splines - 4 * n_rolling
    _, mid_k, new_k = stiffness
    law, change, moved = np.zeros(m), np.empty(m), np.empty(m)
    angle = delta[0]
    first = _FLANKS + len(k.gaps)
    n_turning = k.K_turning.shape[1]
    K, mount = np.empty((n_turning, n_turning)), np.empty((n_turning, n_turning))
    # The mount's angle is predicted without the channels' forces, which are a guess here.
    _turned(k.K_turning, k.C_turning, angle + 0.5 * h * s[0], K, mount)
    _add_product(1.0, W, force, s)
    steady = np.zeros(n_turning)
    for i in range(n_turning):
        for j in range(n_turning):
            mount[i, j] += 0.5 * h * K[i, j]
            tangent[first + i, first + j] = -mount[i, j]
            steady[i] -= K[i, j] * delta[first + j]
    by_angle, energy = 0.0, 0.0
    rounding = _ROUNDING * h * _largest_size(s)
    for iteration in range(_MOST_ITERATIONS):
        if abs(h * s[0] - turn) > _SAME_TURN:
            turn = h * s[0]
            fill_mesh_stiffness(real, imag, mesh_teeth * (angle + 0.5 * turn), mid_k)
            fill_mesh_stiffness(real, imag, mesh_teeth * (angle + turn), new_k)
        _flanks(flanks, h, s, delta, stiffness, law, tangent)
        for i in range(n_turning):
            law[first + i] = steady[i]
            for j in range(n_turning):
                law[first + i] -= mount[i, j] * s[first + j]
        if n_loose:
            _clearances(clearance, reference, first + n_turning, h, s, delta, law, tangent)
        if n_rolling:
            by_angle, energy = _rollers(rollers, reference, rolling, h, s, delta, law, tangent)
            law[0] -= by_angle + given_back
        if n_splines:
            _splines(k, s, delta, law, tangent)
        for i in range(m):
            law[i] -= force[i]
        size = _newton_step(W, blocks, h, tangent, law, inverse, change, moved)
        share = 0.5 if iteration >= _HALVED_FROM and size > _CONVERGED else 1.0
        for i in range(m):
            force[i] += share * change[i]
            s[i] += share * moved[i]
        if not np.isfinite(size):
            break
        if size <= _CONVERGED + rounding:
            return -1, by_angle, energy
    for i in range(m):
        if not np.isfinite(moved[i]):
            return i, by_angle, energy
    return int(np.argmax(np.abs(moved))), by_angle, energy


@numba.njit(cache=True)
def advance(
    k: StepMatrices,
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    channels: NDArray[np.float64],
    free: NDArray[np.float64],
    drive: NDArray[np.float64],
    every: int,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], int, int]:
    """Advance by ``len(drive)`` steps of the midpoint rule, keeping every `every`-th state.

    Parameters
    ----------
    k : StepMatrices
        The stage and its step.
    x, y : ndarray, shape (n + m + 7,)
        Modes, forces on those without inertia and loads, and the rates of all; changed in place.
    channels : ndarray, shape (n + m + 7, m)
        Takes `x` to the channels' motions [m; the first rad].
    free : ndarray, shape (m,)
        Motions at which the channels carry nothing.
    drive : ndarray, shape (N, 4)
        Torque [N m], wanted generator speed [rad/s], radial y and z [N] in the middle of the steps.
    every : int
        Steps between kept states.

    Returns
    -------
    x, y : ndarray, shape (N // every, n + m + 7)
        Kept states and rates.
    work : ndarray, shape (N // every, 5)
        Done since the start [J], as ``StageRecord.energy`` without what is stored.
    done, unsettled : int
        Steps made, and the channel whose force has no balance; -1 where all have.
    """
    # Once: an array of a tuple is counted in and out wherever it is named.
    h, n, m, n_loads = k.h, k.B.shape[1], len(k.B), len(k.P)
    P, S, S_channels, A_inverse_B, A_inverse = k.P, k.S, k.S[:m], k.A_inverse_B, k.A_inverse
    B_columns, P_columns = np.ascontiguousarray(k.B.T), np.ascontiguousarray(P.T)
    omega_2, structural, C_mean, groups = k.stiffness, k.structural, k.C_mean, k.groups
    gaps, reference, real, imag, mesh_teeth = k.gaps, k.reference, k.real, k.imag, k.mesh_teeth
    flanks = (gaps, k.shares, reference)
    n_rolling, n_splines = len(k.rollers.directions), len(k.splines)
    generator, gravity, lag = k.generator_constant, k.gravity, k.lag
    n_kept = len(drive) // every
    x_kept, y_kept = np.zeros((n_kept, len(x))), np.zeros((n_kept, len(x)))
    work = np.zeros((n_kept, 5))
    q, load = x[:n], x[n:]
    v, load_rate = y[:n], y[n:]
    delta = x @ channels - free
    total = np.zeros(5)
    a = np.ones(n_loads)
    known, w = np.empty(n), np.empty(n)
    rates, moved, s = np.empty(n_loads), np.empty(m + n_loads), np.empty(m)
    force, before = np.zeros(m), np.zeros(m)
    inverse, tangent = np.eye(m), np.zeros((m, m))
    first, rubbing = _FLANKS + len(gaps), m - 3 * n_splines
    rolling = rubbing - 4 * n_rolling
    old_k, mid_k, new_k = np.empty(len(real)), np.empty(len(real)), np.empty(len(real))
    stiffness = (old_k, mid_k, new_k)
    fill_mesh_stiffness(real, imag, mesh_teeth * delta[0], new_k)
    pushes = np.zeros((2, len(gaps)))
    speed = k.B[0] @ v
    gain = 0.0
    missing = 0.0
    follow = 1.0 / (lag + 0.5 * h)
    for step in range(len(drive)):
        turn = h * (speed + 0.5 * gain)
        old_k[:] = new_k
        fill_mesh_stiffness(real, imag, mesh_teeth * (delta[0] + 0.5 * turn), mid_k)
        fill_mesh_stiffness(real, imag, mesh_teeth * (delta[0] + turn), new_k)
        # Of the weight as the co-simulation unit takes it, which does not know `gain`.
        c, s_ = np.cos(delta[0] + 0.5 * h * speed), np.sin(delta[0] + 0.5 * h * speed)
        a[0], a[1] = drive[step, 0], generator * drive[step, 1]
        a[2], a[3] = -gravity * s_, -gravity * c
        a[4] = c * drive[step, 2] + s_ * drive[step, 3]
        a[5] = c * drive[step, 3] - s_ * drive[step, 2]
        for i in range(n):
            known[i] = (2.0 / h) * v[i] - omega_2[i] * q[i]
            w[i] = 0.0
        _add_product(1.0, P, a, known)
        packed = 0
        for group in range(len(groups)):
            begin, size = groups[group]
            end = begin + size
            block = A_inverse[packed : packed + size * size].reshape(size, size)
            _add_product(1.0, block, known[begin:end], w[begin:end])
            packed += size * size
        # Modes without inertia: S (load + lag load') = S forces in the middle of the step.
        for i in range(m):
            load_rate[i] = -follow * load[i]
            force[i], before[i] = 2.0 * force[i] - before[i], force[i]
        for i in range(m, m + n_loads):
            load_rate[i] = follow * (a[i - m] - load[i])
        moved[:] = 0.0
        _add_product(1.0, S, load_rate, moved)
        for i in range(m):
            s[i] = moved[i]
        _add_product(1.0, B_columns, w, s)
        _expect_teeth(flanks, delta, turn, stiffness, pushes, force)
        given_back = missing * turn / (turn * turn + _SLOW_TURN * _SLOW_TURN)
        unsettled, by_angle, energy = _solve_channels(
            k, s, delta, turn, stiffness, flanks, given_back, force, inverse, tangent
        )
        _add_product(1.0, A_inverse_B, force, w)
        _add_product(follow, S_channels, force, moved)
        for i in range(m):
            load_rate[i] += follow * force[i]
        if unsettled >= 0 or not np.isfinite(_largest_size(w)):
            n_stored = step // every
            return x_kept[:n_stored], y_kept[:n_stored], work[:n_stored], step, unsettled
        for j in range(len(gaps)):
            i = _FLANKS + j
            pushes[1, j] = pushes[0, j]
            pushes[0, j] = reference[i] * (delta[i] + 0.5 * h * s[i]) - force[i]
        missing -= given_back * h * s[0]
        absorbed = h * by_angle * s[0]
        for i in range(rolling, rubbing):
            absorbed += h * (reference[i] * (delta[i] + 0.5 * h * s[i]) - force[i]) * s[i]
        if abs(absorbed) > _GENTLE * energy:
            missing += _roller_energy(k, delta + h * s) - _roller_energy(k, delta) - absorbed
        rates[:] = 0.0
        _add_product(1.0, P_columns, w, rates)
        # Generator and mount damp the modes with inertia alone.
        total[1] -= h * generator * rates[1] ** 2
        for i in range(n_loads):
            rates[i] += moved[m + i]
        total[0] += h * a[0] * rates[0]
        total[1] += h * a[1] * rates[1]
        for i in range(2, n_loads):
            total[2] += h * a[i] * rates[i]
        for i in range(len(C_mean)):
            total[3] += h * force[first + i] * s[first + i]
            damped = s[first + i] - moved[first + i]
            for j in range(len(C_mean)):
                total[4] += h * damped * C_mean[i, j] * (s[first + j] - moved[first + j])
        if n_splines:
            # What a spline takes and its quill does not store, friction dissipates.
            total[4] -= h * (force[rubbing:] @ s[rubbing:])
            total[4] -= _quill_energies(k, delta + h * s) - _quill_energies(k, delta)
        lost = 0.0
        for i in range(n):
            lost += structural[i] * w[i] * w[i]
            q[i] += h * w[i]
            v[i] = 2.0 * w[i] - v[i]
        for i in range(m + n_loads):
            lost += lag * load_rate[i] * moved[i]
            load[i] += h * load_rate[i]
        total[4] += h * lost
        gain = 2.0 * (s[0] - speed)
        speed += gain
        for i in range(m):
            delta[i] += h * s[i]
        if (step + 1) % every == 0:
            row = step // every
            x_kept[row] = x
            y_kept[row] = y
            work[row] = total
    return x_kept, y_kept, work, len(drive), -1
