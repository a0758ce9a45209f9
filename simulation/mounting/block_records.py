"""A nonlinear block as one record.

What the compiled march reads and changes, with sizes that the compiler knows.

The loops of a step have two to twelve turns. With their lengths in the record's type they are
unrolled into vector operations; and one record is handed over at no cost, where every array would
be counted in and out at each call.
"""

from typing import Protocol, cast

import numpy as np
from numpy.typing import NDArray

from carrierflex.simulation.mounting.equations import Block
from carrierflex.simulation.mounting.propagators import Propagator

Array = NDArray[np.float64]

#: Numbers in a vector register; states and probes are filled up with zeros to a multiple, so that
#: few sizes have to be compiled.
_TOGETHER = 4


class BlockRecord(Protocol):
    """Fields of the record; P probes and N states, both filled up, and n_e elements.

    Parameters
    ----------
    by_state, by_load, by_first_force, by_force : ndarray, shape (N, P + N), (6, P + N), (n_e, P +
    N), (2 n_e, P + N)
        Probes, then the state after the step, over the state, loads at both ends, ``phi_0`` and
        ``[phi_mid, phi_1]``.
    law, preload : ndarray, shape (5,), (n_e,)
        Of the block.
    state : ndarray, shape (N,)
        Linear states.
    friction_before, u_before : ndarray, shape (n_e,)
        Elasto-plastic force [N] and deflection [m] where the step begins.
    last : ndarray, shape (3, n_e)
        Nonlinear forces at the beginning, the middle and the end of the last step [N].
    loads, known, probe, force, friction, work : ndarray
        Of the present step: loads at both ends; what is known of probes and end before it; probes;
        ``[phi_mid, phi_1]`` and the elasto-plastic part; residual and Jacobian.
    """

    by_state: Array
    by_load: Array
    by_first_force: Array
    by_force: Array
    law: Array
    preload: Array
    state: Array
    friction_before: Array
    u_before: Array
    last: Array
    loads: Array
    known: Array
    probe: Array
    force: Array
    friction: Array
    work: Array


def block_record(block: Block, matrices: Propagator, state: Array, memory: Array) -> BlockRecord:
    """Record of a block, its propagator over one substep, and where it stands.

    Parameters
    ----------
    block : Block
        Equations with nonlinear elements.
    matrices : Propagator
        Over one substep.
    state : ndarray, shape (n,)
        Linear states.
    memory : ndarray, shape (5, n_elements)
        Elasto-plastic force and deflection where the step begins; nonlinear force there, at the
        middle of the last step and where that began.

    Returns
    -------
    BlockRecord
        A NumPy record.
    """
    n, n_e = len(state), len(block.weights)
    both = np.vstack([_filled(matrices.probes), _filled(matrices.end[:, : n + 6 + n_e])])
    forces = np.vstack([_filled(matrices.feedback), _filled(matrices.end[:, n + 6 + n_e :])])
    fields = {
        "by_state": _filled(both[:, :n].T),
        "by_load": both[:, n : n + 6].T,
        "by_first_force": both[:, n + 6 :].T,
        "by_force": forces.T,
        "law": block.law,
        "preload": block.preload,
        "loads": np.zeros(6),
        "known": np.zeros(len(both)),
        "probe": np.zeros(len(_filled(matrices.probes))),
        "force": np.zeros(2 * n_e),
        "friction": np.zeros(2 * n_e),
        "work": np.zeros((2 * n_e, 2 * n_e + 1)),
        "state": _filled(state[:, None])[:, 0],
        "friction_before": memory[0],
        "u_before": memory[1],
        "last": memory[[4, 3, 2]],
    }
    record = np.zeros(1, [(name, np.float64, values.shape) for name, values in fields.items()])
    for name, values in fields.items():
        record[name][0] = values
    return cast(BlockRecord, record[0])


def standing(record: BlockRecord, n: int) -> tuple[Array, Array]:
    """State, shape (n,), and memory, shape (5, n_elements), of a block that has marched."""
    fields = cast(np.void, record)
    memory = np.stack([fields["friction_before"], fields["u_before"], *fields["last"][::-1]])
    return fields["state"][:n].copy(), memory


def _filled(matrix: Array) -> Array:
    """Rows of zeros below, up to a multiple of a vector register."""
    return np.vstack([matrix, np.zeros((-len(matrix) % _TOGETHER, matrix.shape[1]))])
