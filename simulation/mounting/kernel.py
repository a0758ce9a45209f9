"""The inner loops: one block marched over the samples of a record, compiled."""

import numba
import numpy as np
from numpy.typing import NDArray

from simulation.bushings import elasto_plastic_force, hardening_force, hardening_stiffness

Array = NDArray[np.float64]

_jit = numba.njit(cache=True, nogil=True, error_model="numpy")
#: Handing over ten arrays costs more than the arithmetic on them.
_inline = numba.njit(cache=True, nogil=True, error_model="numpy", inline="always")


#: Iterations for the element forces within one time step (two or three serve nearly always), and the gain in each below
#: which Newton's method takes over.
_ITERATIONS, _GAIN = 40, 0.1

#: A small rotation or displacement [rad, m] above this has left the model, which is linear in its kinematics.
LARGEST_MOTION = 0.3

#: What ended the march.
DONE, DIVERGED, NOT_CONVERGED = 0, 1, 2


@_jit
def march_linear(end: Array, output: Array, state: Array, loads: Array, signals: Array) -> tuple[int, int]:
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
    matrices: tuple[Array, Array, Array],
    law: Array,
    preload: Array,
    output: Array,
    substeps: int,
    tolerance: float,
    state: Array,
    memory: Array,
    loads: Array,
    signals: Array,
) -> tuple[int, int, int]:
    """March a block with nonlinear bushing elements; arrays `state`, `memory` and `signals` are updated.

    Parameters
    ----------
    matrices : tuple of ndarray
        ``end``, ``probes`` and ``feedback`` of the propagator over one substep.
    law, preload, output : ndarray
        Of the block.
    substeps : int
        Steps in a sampling interval.
    tolerance : float
        Of Newton's method, relative to the forces of the elements.
    state : ndarray, shape (n,)
        Linear states.
    memory : ndarray, shape (5, n_elements)
        Elasto-plastic force and deflection where the step begins; nonlinear force there, at the middle of the last
        step and where that began.
    loads, signals : ndarray, shape (n_samples, 3), (n_samples, 6)
        Inputs; outputs from the second sample on.

    Returns
    -------
    samples, coordinate, outcome : int
        Samples marched, the coordinate that diverged, and what ended the march.
    """
    end, probes, feedback = matrices
    n, n_q, n_e, n_p = end.shape[0], output.shape[1], memory.shape[1], probes.shape[0]
    known, parts = np.empty(n + 6 + n_e), np.empty(n_p)
    force, friction, new = np.empty(2 * n_e), np.empty(2 * n_e), np.empty(n)
    probe, work = np.empty(n_p), np.empty((2 * n_e, 2 * n_e + 1))
    for sample in range(1, loads.shape[0]):
        for part in range(substeps):
            _known_values(state, loads, sample, part, substeps, memory, known)
            _multiply(probes, known, parts)
            for e in range(n_e):
                # The parabola of the last step, drawn on.
                f0, fm, f1 = memory[4, e], memory[3, e], memory[2, e]
                force[e] = f0 - 3.0 * fm + 3.0 * f1
                force[n_e + e] = 3.0 * f0 - 8.0 * fm + 6.0 * f1
            if not _solve_forces(feedback, parts, law, preload, memory, tolerance, force, friction, probe, work):
                return sample - 1, -1, NOT_CONVERGED
            for row in range(n):
                total = 0.0
                for column in range(n + 6 + n_e):
                    total += end[row, column] * known[column]
                for column in range(2 * n_e):
                    total += end[row, n + 6 + n_e + column] * force[column]
                new[row] = total
            for row in range(n):
                state[row] = new[row]
            for e in range(n_e):
                memory[0, e], memory[1, e] = friction[n_e + e], preload[e] + probe[n_e + e]
                memory[4, e], memory[3, e], memory[2, e] = memory[2, e], force[e], force[n_e + e]
        for row in range(n_q):
            if not abs(state[row]) < LARGEST_MOTION:
                return sample - 1, row, DIVERGED
        _add_signals(output, state, signals, sample)
    return loads.shape[0] - 1, -1, DONE


@_inline
def _add_signals(output: Array, state: Array, signals: Array, sample: int) -> None:
    for sensor in range(6):
        total = signals[sample, sensor]
        for column in range(output.shape[1]):
            total += output[sensor, column] * state[column]
        signals[sample, sensor] = total


@_inline
def _known_values(
    state: Array, loads: Array, sample: int, part: int, substeps: int, memory: Array, known: Array
) -> None:
    """Gather ``[x, loads_0, loads_1, phi_0]`` of one substep; loads are linear between samples."""
    n = state.shape[0]
    for i in range(n):
        known[i] = state[i]
    for column in range(3):
        before, rise = loads[sample - 1, column], loads[sample, column] - loads[sample - 1, column]
        known[n + column] = before + rise * part / substeps
        known[n + 3 + column] = before + rise * (part + 1) / substeps
    for e in range(memory.shape[1]):
        known[n + 6 + e] = memory[2, e]


@_inline
def _multiply(matrix: Array, vector: Array, product: Array) -> None:
    for row in range(matrix.shape[0]):
        total = 0.0
        for column in range(matrix.shape[1]):
            total += matrix[row, column] * vector[column]
        product[row] = total


@_inline
def _solve_forces(
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
