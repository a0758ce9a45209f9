"""The inner loops: one block marched over the samples of a record, compiled.

The compiled code is kept by the date of this file: after a change in a module that it inlines,
touch it.
"""

from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from carrierflex.simulation.force_laws import force_slopes
from carrierflex.simulation.mounting.block_records import BlockRecord
from carrierflex.simulation.mounting.bushings import (
    elasto_plastic_force,
    hardening_force,
    hardening_stiffness,
)
from carrierflex.simulation.mounting.measured_laws.bushing_laws import bushing_force, bushing_slopes
from carrierflex.simulation.mounting.measured_laws.bushing_memory_kernels import (
    FIRST_PART,
    keep_step,
    tried_forces,
    try_step,
)

Array = NDArray[np.float64]

_jit = numba.njit(cache=True, nogil=True, error_model="numpy")
#: Handing over arrays costs more than the arithmetic on them.
_inline = numba.njit(cache=True, nogil=True, error_model="numpy", inline="always")


#: A small rotation or displacement [rad, m] above this has left the model, which is linear in its
#: kinematics.
LARGEST_MOTION = 0.3

#: What ended the march.
DONE = 0
DIVERGED = 1
NOT_CONVERGED = 2


#: Iterations for the element forces within one time step (two or three serve nearly always), and
#: the gain in each below which Newton's method takes over.
_ITERATIONS, _GAIN = 40, 0.1


@_jit
def march_linear(
    end: Array, output: Array, state: Array, loads: Array, signals: Array
) -> tuple[int, int]:
    """March a linear block; add its share to ``signals[1:]`` and leave its last state in `state`.

    Returns
    -------
    samples, coordinate : int
        Samples marched, and the coordinate that diverged (-1: none).
    """
    n, n_q = end.shape[0], output.shape[1]
    new = np.empty(n)
    for sample in range(1, loads.shape[0]):
        for row in range(n):
            total = 0.0
            for column in range(n):
                total += end[row, column] * state[column]
            for column in range(3):
                total += end[row, n + column] * loads[sample - 1, column]
                total += end[row, n + 3 + column] * loads[sample, column]
            new[row] = total
        for row in range(n):
            state[row] = new[row]
        for row in range(n_q):
            if not abs(state[row]) < LARGEST_MOTION:
                return sample - 1, row
        _add_signals(output, state, signals, sample)
    return loads.shape[0] - 1, -1


@_jit
def march_nonlinear(
    block: BlockRecord,
    output: Array,
    substeps: int,
    tolerance: float,
    loads: Array,
    signals: Array,
    user_force: Any,
    user_parameters: Any,
    tables: Any,
) -> tuple[int, int, int]:
    """March a block with nonlinear bushing elements; `block` and `signals` are updated.

    Parameters
    ----------
    block : BlockRecord
        Propagator, law and state.
    output : ndarray, shape (6, n_q)
        Sensors over the coordinates.
    substeps : int
        Steps in a sampling interval.
    tolerance : float
        Of the iteration, relative to the forces of the elements.
    loads, signals : ndarray, shape (n_samples, 3), (n_samples, 6)
        Inputs; outputs from the second sample on.
    user_force : function value or None
        See :func:`carrierflex.simulation.force_laws.first_class`; None is compiled to code without
        it.
    user_parameters : ndarray, shape (n_parameters,), or None
        Its parameters; an array that is handed over is counted in and out in every step.
    tables : ndarray or None
        Packed measured laws in the planes of the bushings; their elements are starboard and port in
        z, starboard and port in y. States of parts with a memory are updated.

    Returns
    -------
    samples, coordinate, outcome : int
        Samples marched, the coordinate that diverged, and what ended the march.
    """
    n_state, share = block.state.shape[0], 1.0 / substeps
    for sample in range(1, loads.shape[0]):
        for substep in range(substeps):
            for column in range(3):
                rise = (loads[sample, column] - loads[sample - 1, column]) * share
                block.loads[column] = loads[sample - 1, column] + substep * rise
                block.loads[3 + column] = block.loads[column] + rise
            _follow_state(block)
            if not _solve_forces(block, tolerance, user_force, user_parameters, tables):
                return sample - 1, -1, NOT_CONVERGED
            for i in range(n_state):
                total = block.known[block.probe.shape[0] + i]
                for row in range(block.force.shape[0]):
                    total += block.by_force[row, block.probe.shape[0] + i] * block.force[row]
                block.state[i] = total
            _remember(block)
            if tables is not None:
                if tables[FIRST_PART] > 0.0:
                    keep_step(tables)
        for row in range(output.shape[1]):
            if not abs(block.state[row]) < LARGEST_MOTION:
                return sample - 1, row, DIVERGED
        _add_signals(output, block.state, signals, sample)
    return loads.shape[0] - 1, -1, DONE


@_inline
def _follow_state(block: BlockRecord) -> None:
    """Probes and end of a step as known before it, and forces from the last step's parabola."""
    n_state, n_e = block.state.shape[0], block.preload.shape[0]
    for row in range(block.known.shape[0]):
        total = 0.0
        for i in range(n_state):
            total += block.by_state[i, row] * block.state[i]
        for i in range(6):
            total += block.by_load[i, row] * block.loads[i]
        for e in range(n_e):
            total += block.by_first_force[e, row] * block.last[2, e]
        block.known[row] = total
    for e in range(n_e):
        f0 = block.last[0, e]
        fm = block.last[1, e]
        f1 = block.last[2, e]
        block.force[e] = f0 - 3.0 * fm + 3.0 * f1
        block.force[n_e + e] = 3.0 * f0 - 8.0 * fm + 6.0 * f1


@_inline
def _remember(block: BlockRecord) -> None:
    n_e = block.preload.shape[0]
    for e in range(n_e):
        end = n_e + e
        block.friction_before[e], block.u_before[e] = (
            block.friction[end],
            block.preload[e] + block.probe[end],
        )
        block.last[0, e] = block.last[2, e]
        block.last[1, e] = block.force[e]
        block.last[2, e] = block.force[end]


@_inline
def _add_signals(output: Array, state: Array, signals: Array, sample: int) -> None:
    for sensor in range(6):
        total = signals[sample, sensor]
        for column in range(output.shape[1]):
            total += output[sensor, column] * state[column]
        signals[sample, sensor] = total


@_inline
def _solve_forces(
    block: BlockRecord,
    tolerance: float,
    user_force: Any,
    user_parameters: Any,
    tables: Any,
) -> bool:
    """Solve ``y = phi(known + y by_force)`` for the element forces at a step's middle and end."""
    size = block.force.shape[0]
    last = np.inf
    newton = False
    for _ in range(_ITERATIONS):
        for row in range(block.probe.shape[0]):
            total = block.known[row]
            for column in range(size):
                total += block.by_force[column, row] * block.force[column]
            block.probe[row] = total
        error, scale = _laws(block, user_force, user_parameters, tables)
        converged = error <= tolerance * scale
        newton = newton or error > _GAIN * last
        if newton and not converged:
            if not _newton_step(block, user_force, user_parameters, tables):
                return False
        # Converged or put back: the law's own value, one order better than the iterate it was made
        # from.
        for row in range(size):
            block.force[row] -= block.work[row, size]
        if converged:
            return True
        last = error
    return False


@_inline
def _laws(
    block: BlockRecord, user_force: Any, user_parameters: Any, tables: Any
) -> tuple[float, float]:
    """Fill the last column of `work` with ``y - phi`` and `friction`."""
    n_e, size = block.preload.shape[0], block.force.shape[0]
    K3 = block.law[0]
    K5 = block.law[1]
    C3 = block.law[2]
    Kp = block.law[3]
    Fy = block.law[4]
    error, scale = 0.0, 1.0
    of_parts = 0
    if tables is not None:
        if tables[FIRST_PART] > 0.0:
            try_step(tables, block.u_before, block.preload, block.probe)
            of_parts = tried_forces(tables)
    for e in range(n_e):
        before, u_before = block.friction_before[e], block.u_before[e]
        for half in range(2):
            row = half * n_e + e
            u = block.preload[e] + block.probe[row]
            before = elasto_plastic_force(before, u - u_before, Kp, Fy)
            block.friction[row] = before
            phi = hardening_force(u, K3, K5) + before
            if C3 > 0.0:
                phi += C3 * u * u * block.probe[size + row]
            if user_force is not None:
                phi += user_force(u, block.probe[size + row], user_parameters)
            if tables is not None:
                other = (e + n_e // 2) % n_e
                across = half * n_e + other
                phi += bushing_force(
                    tables,
                    e % 2,
                    u,
                    block.preload[other] + block.probe[across],
                    block.probe[size + row],
                    block.probe[size + across],
                )
                if of_parts > 0:
                    phi += tables[of_parts + row]
            block.work[row, size] = block.force[row] - phi
            error = max(error, abs(block.work[row, size]))
            scale = max(scale, abs(phi))
            u_before = u
    return error, scale


@_jit
def _newton_step(block: BlockRecord, user_force: Any, user_parameters: Any, tables: Any) -> bool:
    """Replace the residual in the last column of `work` by Newton's correction."""
    _fill_jacobian(block, user_force, user_parameters, tables)
    return _eliminate(block)


@_inline
def _fill_jacobian(block: BlockRecord, user_force: Any, user_parameters: Any, tables: Any) -> None:
    """Fill `work` but its last column with the derivative of ``y - phi``."""
    n_e, size = block.preload.shape[0], block.force.shape[0]
    K3 = block.law[0]
    K5 = block.law[1]
    C3 = block.law[2]
    Kp = block.law[3]
    Fy = block.law[4]
    for e in range(n_e):
        before = block.friction_before[e]
        u_before = block.u_before[e]
        middle_slope = 0.0
        for half in range(2):
            row = half * n_e + e
            u = block.preload[e] + block.probe[row]
            yields = not abs(before + Kp * (u - u_before)) < Fy
            friction_slope = 0.0 if yields else Kp
            slope, rate_slope = hardening_stiffness(u, K3, K5) + friction_slope, 0.0
            # An elastic second half remembers the middle, unless the first half was elastic too.
            over_middle = middle_slope - friction_slope if half == 1 and not yields else 0.0
            if C3 > 0.0:
                slope += 2.0 * C3 * u * block.probe[size + row]
                rate_slope = C3 * u * u
            if user_force is not None:
                rate = block.probe[size + row]
                over_u, over_rate = force_slopes(user_force, u, rate, user_parameters)
                slope += over_u
                rate_slope += over_rate
            across = row
            over_w = 0.0
            over_z = 0.0
            if tables is not None:
                other = (e + n_e // 2) % n_e
                across = half * n_e + other
                over_u, over_w, over_rate, over_z = bushing_slopes(
                    tables,
                    e % 2,
                    u,
                    block.preload[other] + block.probe[across],
                    block.probe[size + row],
                    block.probe[size + across],
                )
                slope += over_u
                rate_slope += over_rate
            for column in range(size):
                derivative = (
                    slope * block.by_force[column, row] + over_middle * block.by_force[column, e]
                )
                # Without a law that depends on the rate the probes hold no rate.
                if rate_slope != 0.0:
                    derivative += rate_slope * block.by_force[column, size + row]
                if tables is not None:
                    derivative += over_w * block.by_force[column, across]
                    derivative += over_z * block.by_force[column, size + across]
                block.work[row, column] = -derivative
            block.work[row, row] += 1.0
            before = block.friction[row]
            u_before = u
            middle_slope = friction_slope


@_inline
def _eliminate(block: BlockRecord) -> bool:
    """Solve the linear system in `work` by elimination with row exchange."""
    work = block.work
    size = work.shape[0]
    for pivot in range(size):
        best = pivot
        for row in range(pivot + 1, size):
            if abs(work[row, pivot]) > abs(work[best, pivot]):
                best = row
        if not abs(work[best, pivot]) > 0.0:
            return False
        if best != pivot:
            for column in range(pivot, size + 1):
                work[pivot, column], work[best, column] = work[best, column], work[pivot, column]
        for row in range(pivot + 1, size):
            factor = work[row, pivot] / work[pivot, pivot]
            if factor != 0.0:
                for column in range(pivot + 1, size + 1):
                    work[row, column] -= factor * work[pivot, column]
    for row in range(size - 1, -1, -1):
        total = work[row, size]
        for column in range(row + 1, size):
            total -= work[row, column] * work[column, size]
        work[row, size] = total / work[row, row]
    return True
