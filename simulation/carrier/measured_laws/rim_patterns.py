"""Frames and patterns at the rim, as waves over the sensors.

A wave of m lobes around the housing at the order n of the carrier angle is ``cos(m v - n theta)``
and ``sin(m v - n theta)`` at a sensor at the housing angle v. One of as many lobes as its order
turns with the carrier; one of order 0 stands still. Comparison of classes, laws of files and
simulator take the same patterns.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.simulation.carrier.kinematics import SADDLE_ANGLE

FloatArray = NDArray[np.float64]

#: Frame and pattern of a class.
OFFSET = "housing/offset"
TILT = "housing/tilt"
SADDLE = "housing/saddle"
PLANET_PASS = "housing/planet_pass"
MODULATED = "housing/load_sharing"
TURNING_TILT = "carrier/tilt"
WAVES = "carrier/waves"
UNEVEN = "carrier/load_sharing"
#: What an amplitude follows: nothing, the torque, the radial load, both, the time of a run.
NONE = "none"
BY_TORQUE = "torque"
BY_RADIAL_LOAD = "radial_load"
BY_BOTH = "load_sharing"
TIME = "time"
#: Dependences whose abscissa is the size of the radial load, each along a direction.
ALONG_LOAD = (BY_RADIAL_LOAD, BY_BOTH)
#: Loads that a dependence follows.
LOADS_OF: Mapping[str, tuple[str, ...]] = {
    NONE: (),
    BY_TORQUE: ("torque",),
    BY_RADIAL_LOAD: ("ntl_y", "ntl_z"),
    BY_BOTH: ("torque", "ntl_y", "ntl_z"),
    TIME: (),
}


@dataclass(frozen=True)
class Wave:
    """``cosine cos(m v - n theta) + sine sin(m v - n theta)``; the order n is its column's.

    Parameters
    ----------
    lobes : int
        Lobes m around the housing; negative where the wave turns against the carrier.
    cosine, sine : float
        Weights.
    """

    lobes: int
    cosine: float
    sine: float


@dataclass(frozen=True)
class PatternColumn:
    """One column of a pattern: waves of one order on the sensors of one quantity.

    Parameters
    ----------
    quantity : str
        Sensors that it shows at: amplitudes of axial and of radial ones are their own.
    order : int
        Order of the carrier angle; 0 where it stands still.
    waves : tuple of Wave
        Waves that add up.
    """

    quantity: str
    order: int
    waves: tuple[Wave, ...]

    def over(self, angle: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Weights of the cosine and the sine of the order of the carrier angle.

        Parameters
        ----------
        angle : ndarray
            Housing angles v of sensors of the quantity [rad].
        """
        cosine, sine = np.zeros_like(angle), np.zeros_like(angle)
        for wave in self.waves:
            c, s = np.cos(wave.lobes * angle), np.sin(wave.lobes * angle)
            cosine += wave.cosine * c + wave.sine * s
            if self.order:
                sine += wave.cosine * s - wave.sine * c
        return cosine, sine


Columns = tuple[PatternColumn, ...]
_COSINE, _SINE = (1.0, 0.0), (0.0, 1.0)


def offset(quantities: Sequence[str]) -> Columns:
    """Every sensor alike."""
    return _columns(quantities, 0, [(Wave(0, *_COSINE),)])


def tilt(quantities: Sequence[str]) -> Columns:
    """Tilt of the housing at axial sensors, a shift at radial ones."""
    return _both_phases(quantities, [(0, 1)])


def saddle(quantities: Sequence[str]) -> Columns:
    """Two waves around the housing, from the angle where the flange's saddle is largest."""
    c, s = float(np.cos(2.0 * SADDLE_ANGLE)), float(np.sin(2.0 * SADDLE_ANGLE))
    return _columns(quantities, 0, [(Wave(2, c, s),), (Wave(2, -s, c),)])


def planet_pass(quantities: Sequence[str], n_planets: int) -> Columns:
    """Offset and tilt of the housing at the order at which planets pass, both phases.

    ``cos v cos(n theta)`` is half the sum of a wave that turns with the carrier and one that turns
    against it.
    """
    waves = [
        (Wave(0, *_COSINE),),
        (Wave(0, 0.0, -1.0),),
        (Wave(1, 0.5, 0.0), Wave(-1, 0.5, 0.0)),
        (Wave(1, 0.0, -0.5), Wave(-1, 0.0, -0.5)),
        (Wave(1, 0.0, 0.5), Wave(-1, 0.0, -0.5)),
        (Wave(1, 0.5, 0.0), Wave(-1, -0.5, 0.0)),
    ]
    return _columns(quantities, n_planets, waves)


def turning_tilt(quantities: Sequence[str]) -> Columns:
    """One wave that turns with the carrier."""
    return turning_waves(quantities, [1])


def turning_waves(quantities: Sequence[str], orders: Sequence[int]) -> Columns:
    """Waves of some orders that turn with the carrier."""
    return _both_phases(quantities, [(order, order) for order in orders])


def uneven_waves(quantities: Sequence[str], n_planets: int) -> Columns:
    """Waves that unequal loads of the planets make: all that equal loads do not.

    Up to two beyond the second order of equal loads: higher ones of a pin's are small.
    """
    orders = [n for n in range(1, 2 * n_planets + 3) if n % n_planets]
    return turning_waves(quantities, orders)


def modulated_waves(quantities: Sequence[str], n_planets: int) -> Columns:
    """Waves of planets whose loads change once a turn, at a phase fixed to the housing.

    A wave of h lobes from planets modulated once a turn shows at the orders ``h - 1`` or ``h + 1``
    that are multiples of the number of planets.
    """
    pulsating = [
        (order, lobes) for order in (n_planets, 2 * n_planets) for lobes in (order - 1, order + 1)
    ]
    return _both_phases(quantities, [(0, 1), *pulsating])


def _columns(quantities: Sequence[str], order: int, waves: Sequence[tuple[Wave, ...]]) -> Columns:
    return tuple(
        PatternColumn(quantity, order, wave)
        for quantity in dict.fromkeys(quantities)
        for wave in waves
    )


def _both_phases(quantities: Sequence[str], orders_lobes: Sequence[tuple[int, int]]) -> Columns:
    """Cosine, then sine of every order and its lobes."""
    return tuple(
        PatternColumn(quantity, order, (Wave(lobes, *phase),))
        for quantity in dict.fromkeys(quantities)
        for order, lobes in orders_lobes
        for phase in (_COSINE, _SINE)
    )


#: Whether a pattern has a wave: its order and lobes, of a number of planets.
_HOLDS: Mapping[str, Callable[[int, int, int], bool]] = {
    OFFSET: lambda order, lobes, n_planets: (order, lobes) == (0, 0),
    TILT: lambda order, lobes, n_planets: (order, lobes) == (0, 1),
    SADDLE: lambda order, lobes, n_planets: (order, lobes) == (0, 2),
    PLANET_PASS: lambda order, lobes, n_planets: order == n_planets and abs(lobes) <= 1,
    MODULATED: lambda order, lobes, n_planets: (
        (order, lobes) == (0, 1)
        or (order in (n_planets, 2 * n_planets) and abs(lobes - order) == 1)
    ),
    TURNING_TILT: lambda order, lobes, n_planets: (order, lobes) == (1, 1),
    WAVES: lambda order, lobes, n_planets: order == lobes and order > 1,
    UNEVEN: lambda order, lobes, n_planets: order == lobes and order % n_planets != 0,
}
#: Frames and patterns that a law may have.
RIM_PATTERNS = tuple(_HOLDS)


def has_wave(pattern: str, order: int, lobes: int, n_planets: int) -> bool:
    """Whether a frame and pattern has a wave.

    Parameters
    ----------
    pattern : str
        One of :data:`RIM_PATTERNS`.
    order, lobes : int
        Order of the carrier angle, and lobes around the housing.
    n_planets : int
        Planets.
    """
    return _HOLDS[pattern](order, lobes, n_planets)
