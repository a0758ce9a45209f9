"""A nonlinear block as one record.

What the compiled march reads and changes, with sizes that the compiler knows.

The loops of a step have two to twelve turns. With their lengths in the record's type they are
unrolled into vector operations; and one record is handed over at no cost, where every array would
be counted in and out at each call.
"""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class BlockRecord(Protocol):
    """Fields of the record; P probes and N states, both filled up, and n_e elements.

    Parameters
    ----------
    by_state, by_load, by_first_force, by_force : ndarray, shape (N, P + N), (6, P + N), (n_e, P +
    N), (2 n_e, P + N) Probes, then the state after the step, over the state, loads at both ends,
    ``phi_0`` and ``[phi_mid, phi_1]``. law, preload : ndarray, shape (5,), (n_e,) Of the block.
    state : ndarray, shape (N,) Linear states. friction_before, u_before : ndarray, shape (n_e,)
    Elasto-plastic force [N] and deflection [m] where the step begins. last : ndarray, shape (3,
    n_e) Nonlinear forces at the beginning, the middle and the end of the last step [N]. loads,
    known, probe, force, friction, work : ndarray Of the present step: loads at both ends; what is
    known of probes and end before it; probes; ``[phi_mid, phi_1]`` and the elasto-plastic part;
    residual and Jacobian.
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
