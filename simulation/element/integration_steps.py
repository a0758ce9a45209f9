"""How finely the motion of an element is integrated between two samples of its force."""

import numpy as np

#: Largest phase of the natural frequency in one step [rad]; the relative error in frequency is its
#: fourth power over 120.
_STEP_PHASE = 0.25
#: Largest decay of the fastest exponential in one step, which an integrator of fourth order carries
#: up to 2.8: a fit may go to half as much damping again.
_STEP_DECAY = 1.8
_MOST_SUBSTEPS = 64


def integration_substeps(m: float, K1: float, C1: float, step: float) -> int:
    """Steps of integration a sample for a small phase of the natural frequency and a stable decay.

    The fastest exponential of an element damped beyond critical, ``d + sqrt(d² - w²)`` with
    ``d = C1 / (2 m)`` and ``w² = K1 / m``, is far faster than its natural frequency w.

    Parameters
    ----------
    m : float
        Mass [kg].
    K1 : float
        Stiffness [N/m].
    C1 : float
        Damping [N s/m].
    step : float
        Time between two samples [s].

    Returns
    -------
    int
        From 1 to 64; 1 without mass.
    """
    if not m > 0.0:
        return 1
    natural_square = max(K1, 0.0) / m
    decay = max(C1, 0.0) / (2.0 * m)
    fastest = decay + np.sqrt(max(decay**2 - natural_square, 0.0))
    wanted = max(np.sqrt(natural_square) / _STEP_PHASE, fastest / _STEP_DECAY) * step
    return int(np.clip(np.ceil(wanted), 1, _MOST_SUBSTEPS))
