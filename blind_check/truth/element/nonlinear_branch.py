"""A spring that hardens in series with a dashpot, so curved that it is no linear memory."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from carrierflex.blind_check.truth.element.element import Law
from carrierflex.blind_check.truth.element.reference import Reference, force_of

FloatArray = NDArray[np.float64]

#: Relaxation times of the linear memory, over the time in which the phase turns by one radian.
_TIMES = np.geomspace(0.03, 30.0, 14)
#: By how much the spring is curved further, and how often at most: to 10^4 times what it was.
_MORE, _TIMES_MORE = 1.5, 23


def beyond_linear_memory(law: Law, reference: Reference, omega: float, left: float) -> Law:
    """Spring and dashpot with the least curvature of which a linear memory leaves enough.

    Parameters
    ----------
    law : Law
        Cubic spring in series with a dashpot; its curvature is the least that is tried.
    reference : Reference
        Motion along which it is measured.
    omega : float
        Natural frequency [rad/s].
    left : float
        RMS that a linear memory is to leave, of what mass, spring and damper leave.

    Returns
    -------
    Law
        As wanted, or the most curved that is tried where a linear memory leaves less of all.
    """
    v = reference.columns[:, 1]
    branches = [_relaxing(v, reference.step, time / omega) for time in _TIMES]
    memory = replace(reference, columns=np.column_stack([reference.columns, *branches]))
    for _ in range(_TIMES_MORE):
        force = force_of(law, reference)
        if memory.missing(force) >= left * reference.missing(force):
            break
        law = replace(law, p=law.p * np.array([_MORE, *np.ones(law.p.size - 1)]))
    return law


def _relaxing(v: FloatArray, step: float, tau: float) -> FloatArray:
    """Deflection of a linear spring in series with a dashpot, shape (n,)."""
    keep = np.exp(-step / tau)
    return np.asarray(lfilter([tau * (1.0 - keep)], [1.0, -keep], v))
