"""Forces of the nonlinear bushing elements within one time step, compiled into the march."""

import numba
import numpy as np
from numpy.typing import NDArray

from simulation.bushings import elasto_plastic_force, hardening_force, hardening_stiffness

Array = NDArray[np.float64]

#: Handing over ten arrays costs more than the arithmetic on them.
_inline = numba.njit(cache=True, nogil=True, error_model="numpy", inline="always")

#: Iterations for the element forces within one time step (two or three serve nearly always), and the gain in each below
#: which Newton's method takes over.
_ITERATIONS, _GAIN = 40, 0.1


@_inline
def solve_forces(
    feedback: Array,
    parts: Array,
    law: Array,
    preload: Array,
    memory: Array,
    tolerance: float,
    force: Array,
    friction: Array,
    probe: Array,
    work: Array,
) -> bool:
    """Solve ``y = phi(parts + feedback y)`` for the element forces at the middle and the end of a step.

    The step is short against the stiffness that phi adds, so putting phi back in mostly converges at once; where it does
    not gain a digit a time, Newton's method takes over.
    """
    size, last, newton = force.shape[0], np.inf, False
    for _ in range(_ITERATIONS):
        for row in range(parts.shape[0]):
            total = parts[row]
            for column in range(size):
                total += feedback[row, column] * force[column]
            probe[row] = total
        error, scale = _laws(law, preload, memory, probe, force, friction, work)
        converged = error <= tolerance * scale
        newton = newton or error > _GAIN * last
        if newton and not converged:
            _fill_jacobian(law, preload, memory, probe, feedback, friction, work)
            if not _eliminate(work):
                return False
        # Converged or put back: the law's own value, one order better than the iterate it was made from.
        for row in range(size):
            force[row] -= work[row, size]
        if converged:
            return True
        last = error
    return False


@_inline
def _laws(
    law: Array, preload: Array, memory: Array, probe: Array, force: Array, friction: Array, work: Array
) -> tuple[float, float]:
    """Fill the last column of `work` with ``y - phi`` and `friction`; return the largest entry and the scale."""
    n_e, size = memory.shape[1], force.shape[0]
    K3, K5, C3, Kp, Fy = law[0], law[1], law[2], law[3], law[4]
    error, scale = 0.0, 1.0
    for e in range(n_e):
        before, u_before = memory[0, e], memory[1, e]
        for half in range(2):
            row = half * n_e + e
            u = preload[e] + probe[row]
            before = elasto_plastic_force(before, u - u_before, Kp, Fy)
            friction[row] = before
            phi = hardening_force(u, K3, K5) + before
            if C3 > 0.0:
                phi += C3 * u * u * probe[size + row]
            work[row, size] = force[row] - phi
            error = max(error, abs(work[row, size]))
            scale = max(scale, abs(phi))
            u_before = u
    return error, scale


@_inline
def _fill_jacobian(
    law: Array, preload: Array, memory: Array, probe: Array, feedback: Array, friction: Array, work: Array
) -> None:
    """Fill `work` but its last column with the derivative of ``y - phi``."""
    n_e, size = memory.shape[1], friction.shape[0]
    K3, K5, C3, Kp, Fy = law[0], law[1], law[2], law[3], law[4]
    for e in range(n_e):
        before, u_before, middle_slope = memory[0, e], memory[1, e], 0.0
        for half in range(2):
            row = half * n_e + e
            u = preload[e] + probe[row]
            yields = not abs(before + Kp * (u - u_before)) < Fy
            own = 0.0 if yields else Kp
            slope, rate_slope = hardening_stiffness(u, K3, K5) + own, 0.0
            # An elastic second half remembers the middle, unless the first half was elastic too.
            over_middle = middle_slope - own if half == 1 and not yields else 0.0
            if C3 > 0.0:
                slope += 2.0 * C3 * u * probe[size + row]
                rate_slope = C3 * u * u
            for column in range(size):
                derivative = slope * feedback[row, column] + over_middle * feedback[e, column]
                if C3 > 0.0:
                    derivative += rate_slope * feedback[size + row, column]
                work[row, column] = -derivative
            work[row, row] += 1.0
            before, u_before, middle_slope = friction[row], u, own


@_inline
def _eliminate(work: Array) -> bool:
    """Solve the linear system in `work` by elimination with row exchange; the solution replaces the last column."""
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
