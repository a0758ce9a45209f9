"""What drives an element, as the force that its equation of motion takes.

``m q'' + R(q, q') = F`` for a mass on the element under a force F. A free decay has F = 0 and a
state to begin with. On a base that moves by u the element feels the relative motion ``q = x - u``:
``m q'' + R(q, q') = -m u''``. Where the mass is not known both are divided by it: m = 1, and every
force is one per mass.
"""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

FORCE = "force"
DISPLACEMENT = "displacement"
FREE_DECAY = "free_decay"
BASE = "base"
#: Drives under which the deflection is predicted from the force.
BY_FORCE = (FORCE, FREE_DECAY, BASE)
#: Drives under which only forces per mass are known.
PER_MASS = (FREE_DECAY, BASE)


def base_force(acceleration: FloatArray, mass: float) -> FloatArray:
    """Force on the mass that a moving base makes in the base's frame, ``-m u''`` [N].

    Parameters
    ----------
    acceleration : ndarray, shape (n,)
        Acceleration of the base u'' [m/s²].
    mass : float
        Mass m [kg]; 1 gives the force per mass [m/s²].
    """
    return -mass * acceleration


def no_force(n_samples: int) -> FloatArray:
    """Force of a free decay, zero, shape (n_samples,)."""
    return np.zeros(n_samples)
