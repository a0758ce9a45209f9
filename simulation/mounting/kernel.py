"""The inner loops: one block marched over the samples of a record, compiled.

The compiled code is kept by the date of this file: after a change in a module that it inlines,
touch it.
"""

from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from carrierflex.simulation.mounting.block_records import BlockRecord
from carrierflex.simulation.mounting.element_forces import solve_forces
from carrierflex.simulation.mounting.measured_laws.bushing_memory_kernels import (
    FIRST_PART,
    keep_step,
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
        for part in range(substeps):
            for column in range(3):
                rise = (loads[sample, column] - loads[sample - 1, column]) * share
                block.loads[column] = loads[sample - 1, column] + part * rise
                block.loads[3 + column] = block.loads[column] + rise
            _follow_state(block)
            if not solve_forces(block, tolerance, user_force, user_parameters, tables):
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
