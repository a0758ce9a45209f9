"""Exact propagation of a block over one step; loads linear, bushing forces quadratic in time.

Over one step of length h the linear part is solved exactly: ``x(h) = E x(0) + Σ_j ∫ e^{A(h-s)}
c_j(s) ds``. The loads are linear in time between samples (first-order hold); the nonlinear bushing
force is the parabola through its values at 0, h/2 and h (an exponential Lobatto method of order
four). All integrals come from one matrix exponential of the augmented system.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from carrierflex.simulation.mounting.equations import Block

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Propagator:
    """Matrices of one step of one block.

    Parameters
    ----------
    end : ndarray, shape (n, n + 6 + 3 n_elements)
        State after the step over ``[x, loads_0, loads_1, phi_0, phi_mid, phi_1]``.
    probes : ndarray, shape (n_probes, n + 6 + n_elements)
        Deflections of the elements at the middle and at the end of the step, and their rates where
        the damping depends on the deflection, over ``[x, loads_0, loads_1, phi_0]``.
    feedback : ndarray, shape (n_probes, 2 n_elements)
        The same over ``[phi_mid, phi_1]``.
    """

    end: Array
    probes: Array
    feedback: Array


@lru_cache(maxsize=256)
def propagator(block: Block, step: float) -> Propagator:
    """Exact propagator of `block` over `step` seconds.

    Parameters
    ----------
    block : Block
        Equations of motion.
    step : float
        Step h [s].

    Returns
    -------
    Propagator
        Its matrices.

    References
    ----------
    .. [1] C. F. Van Loan, "Computing integrals involving the matrix exponential", IEEE Transactions
       on Automatic Control 23(3), 1978.
    """
    A, B, N = block.state_matrices()
    n, n_e = len(A), len(block.weights)
    half = _augmented(A, np.hstack([B, N]), step)
    middle, end = (_over_values(matrix[:n], n, n_e) for matrix in (half, half @ half))
    n_q = len(block.names)
    deflection = np.zeros((n_e, n))
    deflection[:, :n_q] = block.rows
    readings = [deflection @ middle, deflection @ end]
    if block.needs_rates:
        rate = np.zeros((n_e, n))
        rate[:, n_q : 2 * n_q] = block.rows
        readings += [rate @ middle, rate @ end]
    probes = np.vstack(readings)
    known = n + 6 + n_e
    return Propagator(
        end, np.ascontiguousarray(probes[:, :known]), np.ascontiguousarray(probes[:, known:])
    )


def _augmented(A: Array, channels: Array, step: float) -> Array:
    """Exponential over half a step of the state beside each channel's value and two derivatives.

    Time runs in units of the step, so that the derivatives have the size of the values.
    """
    n, n_c = channels.shape
    size = n + 3 * n_c
    generator = np.zeros((size, size))
    generator[:n, :n] = step * A
    generator[:n, n : n + n_c] = step * channels
    generator[n : n + n_c, n + n_c : n + 2 * n_c] = np.eye(n_c)
    generator[n + n_c : n + 2 * n_c, n + 2 * n_c :] = np.eye(n_c)
    return expm(0.5 * generator)


def _over_values(matrix: Array, n: int, n_e: int) -> Array:
    """From value and derivatives at the start to loads at both ends, forces also at the middle."""
    n_c = 3 + n_e
    x, value, first, second = (
        matrix[:, :n],
        *(matrix[:, n + i * n_c : n + (i + 1) * n_c] for i in range(3)),
    )
    loads, forces = slice(0, 3), slice(3, n_c)
    columns = [
        x,
        (value - first)[:, loads],
        first[:, loads],
        (value - 3.0 * first + 4.0 * second)[:, forces],
        (4.0 * first - 8.0 * second)[:, forces],
        (4.0 * second - first)[:, forces],
    ]
    return np.ascontiguousarray(np.hstack(columns))
