"""Forces of the nonlinear bushing elements within one time step, compiled into the march."""

from typing import Any

import numba
import numpy as np

from carrierflex.simulation.force_laws import force_slopes
from carrierflex.simulation.mounting.block_records import BlockRecord
from carrierflex.simulation.mounting.bushings import (
    elasto_plastic_force,
    hardening_force,
    hardening_stiffness,
)
from carrierflex.simulation.mounting.measured_laws.bushing_laws import (
    bushing_force,
    bushing_slopes,
)
from carrierflex.simulation.mounting.measured_laws.bushing_memory_kernels import (
    FIRST_PART,
    tried_forces,
    try_step,
)

_jit = numba.njit(cache=True, nogil=True, error_model="numpy")
_inline = numba.njit(cache=True, nogil=True, error_model="numpy", inline="always")

#: Iterations for the element forces within one time step (two or three serve nearly always), and
#: the gain in each below which Newton's method takes over.
_ITERATIONS, _GAIN = 40, 0.1


@_inline
def solve_forces(
    block: BlockRecord,
    tolerance: float,
    user_force: Any,
    user_parameters: Any,
    tables: Any,
) -> bool:
    """Solve ``y = phi(known + y by_force)`` for the element forces at a step's middle and end.

    The step is short against the stiffness that phi adds, so putting phi back in mostly converges
    at once; where it does not gain a digit a time, Newton's method takes over.
    """
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
    """Fill the last column of `work` with ``y - phi`` and `friction`.

    Return the largest entry and the scale.
    """
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
    """Replace the residual in the last column of `work` by Newton's correction.

    Rarely called, so not woven into the march.
    """
    _fill_jacobian(block, user_force, user_parameters, tables)
    return _eliminate(block)


@_inline
def _fill_jacobian(block: BlockRecord, user_force: Any, user_parameters: Any, tables: Any) -> None:
    """Fill `work` but its last column with the derivative of ``y - phi``.

    That of parts with a memory is left out: steps that their springs allow converge without.
    """
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
            own = 0.0 if yields else Kp
            slope, rate_slope = hardening_stiffness(u, K3, K5) + own, 0.0
            # An elastic second half remembers the middle, unless the first half was elastic too.
            over_middle = middle_slope - own if half == 1 and not yields else 0.0
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
            middle_slope = own


@_inline
def _eliminate(block: BlockRecord) -> bool:
    """Solve the linear system in `work` by elimination with row exchange.

    The solution replaces the last column.
    """
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
