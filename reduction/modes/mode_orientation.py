"""Signs of modes and directions of degenerate pairs, fixed by a rule instead of by rounding."""

import numpy as np
from numpy.typing import NDArray

#: Frequencies that differ by less than this share are equal but for rounding: their modes may be
#: turned among one another.
_EQUAL = 1e-8
#: Entries that differ by less than this share are equal but for rounding: the first of them counts.
_TIE = 1e-6


def oriented(Phi: NDArray[np.float64], omega: NDArray[np.float64]) -> NDArray[np.float64]:
    """Modes that depend on the body alone, not on the path of the iteration that found them.

    Within a group of equal frequencies the degree of freedom that moves most is given to the first
    mode alone, and positive; of what is left, the one that moves most to the second, and so on. A
    single mode has its largest entry positive.

    Parameters
    ----------
    Phi : ndarray, shape (n, k)
        Modes, of one normalisation.
    omega : ndarray, shape (k,)
        Their angular frequencies [rad/s], ascending.

    Returns
    -------
    ndarray, shape (n, k)
        Modes of the same spaces.
    """
    turned = np.empty_like(Phi)
    starts = np.flatnonzero(np.diff(omega, prepend=-np.inf) > _EQUAL * omega)
    for first, last in zip(starts, [*starts[1:], len(omega)], strict=True):
        turned[:, first:last] = Phi[:, first:last] @ _directions(Phi[:, first:last])
    return turned


def _directions(Phi: NDArray[np.float64]) -> NDArray[np.float64]:
    """Orthogonal matrix that turns the modes of one group as the rule says, shape (d, d)."""
    directions = np.zeros((Phi.shape[1], Phi.shape[1]))
    remaining = Phi.copy()
    for column in range(Phi.shape[1]):
        motion = np.einsum("nd,nd->n", remaining, remaining)
        most = int(np.argmax(motion >= (1.0 - _TIE) * motion.max()))
        direction = remaining[most] / np.sqrt(motion[most])
        directions[:, column] = direction
        remaining -= np.outer(remaining @ direction, direction)
    return directions
