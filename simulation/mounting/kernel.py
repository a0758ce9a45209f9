"""The inner loops: one block marched over the samples of a record, compiled.

The compiled code is kept by the date of this file: after a change in a module that it inlines, touch it.
"""

import numba
import numpy as np
from numpy.typing import NDArray

from simulation.mounting.element_forces import solve_forces

Array = NDArray[np.float64]

_jit = numba.njit(cache=True, nogil=True, error_model="numpy")
#: Handing over ten arrays costs more than the arithmetic on them.
_inline = numba.njit(cache=True, nogil=True, error_model="numpy", inline="always")


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
    force, friction = np.empty(2 * n_e), np.empty(2 * n_e)
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
            if not solve_forces(feedback, parts, law, preload, memory, tolerance, force, friction, probe, work):
                return sample - 1, -1, NOT_CONVERGED
            _update_state(end, known, force, state)
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
def _update_state(end: Array, known: Array, force: Array, state: Array) -> None:
    """State after the step; `known` holds its own copy of the state before."""
    for row in range(state.shape[0]):
        total = 0.0
        for column in range(known.shape[0]):
            total += end[row, column] * known[column]
        for column in range(force.shape[0]):
            total += end[row, known.shape[0] + column] * force[column]
        state[row] = total


@_inline
def _multiply(matrix: Array, vector: Array, product: Array) -> None:
    for row in range(matrix.shape[0]):
        total = 0.0
        for column in range(matrix.shape[1]):
            total += matrix[row, column] * vector[column]
        product[row] = total
