"""Laws of the bushings with a memory, as parallel parts: stops that slip, branches that relax.

A stop is a spring in series with dry friction (Jenkins element; Iwan, J. Appl. Mech. 33 (1966)
893). It acts in y and in z apart, ``force clip(z, -1, 1)`` of each direction alone, or radially: z
is a vector in the plane, which returns along its own direction where it is longer than 1. Or it
gives way smoothly along its path, ``dz = (du - |du| z) / yield deflection`` (Dahl, 1968), so that
it forgets in small loops what it held. A branch
is a spring in series with a damper (Maxwell), ``dq/dt = du/dt - q / tau``, the same in y and in z.
Parts are relaxed where a record begins. Forces are internal ones, positive against a positive
deflection.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class BushingStop:
    """A spring that slips.

    Parameters
    ----------
    acts : str
        In y and in z apart, radially in the plane, or smoothly along its path in the plane.
    bushing : str
        Both, starboard or port.
    yield_deflection : float
        Deflection at which it slips [m].
    force : float
        Force at slip [N].
    """

    acts: str
    bushing: str
    yield_deflection: float
    force: float


@dataclass(frozen=True)
class BushingBranch:
    """A spring in series with a damper.

    Parameters
    ----------
    bushing : str
        Both, starboard or port.
    tau : float
        Relaxation time [s].
    stiffness : float
        Stiffness of the spring [N/m].
    """

    bushing: str
    tau: float
    stiffness: float


@dataclass(frozen=True, eq=False)
class BushingMemoryLaw:
    """Measured law of one class of force of the bushings that has a memory.

    Parameters
    ----------
    name : str
        Id of the effect.
    effect_class : str
        ``hysteresis`` or ``memory``.
    parts : tuple of BushingStop or BushingBranch
        Parts whose forces add up.
    visited : float
        Largest deflection at which it was measured [m].
    measured_on : str
        Campaign whose records gave it; empty where unknown.
    """

    name: str
    effect_class: str
    parts: tuple[BushingStop | BushingBranch, ...]
    visited: float
    measured_on: str = ""

    @property
    def along_speed(self) -> bool:
        """Whether it was measured along a speed: never, parts follow the deflection."""
        return False
