"""Laws of a carrier as tables: amplitudes of a pattern's waves over the loads, linear between.

``A(T)`` over the torque; ``A(r)`` over the size r of the radial load F, times the direction
``e = F / r``: its components e_y and e_z where the amplitude turns round with the load, their
products where it is the same in either sense; times the torque where both make it; over the time
of a run; or a constant. Beyond its table an amplitude goes on with the slope of its end. Amplitudes
are those of displacements at the sensors' radius.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.simulation.carrier.rim import CarrierInputs, RimSensor
from carrierflex.simulation.carrier.run_cases import AXIAL, RADIAL
from carrierflex.simulation.element.tabulated_laws import end_slopes

FloatArray = NDArray[np.float64]

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
#: Products of the components of the radial load's direction, by name.
DIRECTIONS: Mapping[str, Callable[[FloatArray, FloatArray], FloatArray]] = {
    "y": lambda e_y, e_z: e_y,
    "z": lambda e_y, e_z: e_z,
    "yy": lambda e_y, e_z: e_y * e_y,
    "yz": lambda e_y, e_z: e_y * e_z,
    "zz": lambda e_y, e_z: e_z * e_z,
}
#: Radius of another circle: amplitudes are known at that of the records.
_SAME_RADIUS = 0.01


@dataclass(frozen=True, eq=False)
class WaveTable:
    """Amplitudes of one wave.

    Parameters
    ----------
    quantity : str
        ``axial_displacement`` or ``radial_displacement``.
    order, lobes : int
        Order n of the carrier angle and lobes m around the housing.
    cosine, sine : ndarray, shape (n,)
        Amplitudes of ``cos(m v - n theta)`` and ``sin(m v - n theta)`` [m]; of a part that follows
        torque and radial load [m/(N m)].
    """

    quantity: str
    order: int
    lobes: int
    cosine: FloatArray
    sine: FloatArray


@dataclass(frozen=True, eq=False)
class LawPart:
    """Waves that follow the loads in one way.

    Parameters
    ----------
    follows : str
        One of :data:`LOADS_OF`.
    x : ndarray, shape (n,)
        Torque [N m], size of the radial load [N] from zero, or time as a share of the run, 0 to 1;
        increasing. Empty where nothing is followed, of one amplitude a wave.
    waves : tuple of WaveTable
        Amplitudes.
    along : str
        One of :data:`DIRECTIONS` where the radial load is followed; empty otherwise.
    """

    follows: str
    x: FloatArray
    waves: tuple[WaveTable, ...]
    along: str = ""


@dataclass(frozen=True, eq=False)
class CarrierLaw:
    """Measured shape of one class of a carrier.

    Parameters
    ----------
    name : str
        Id of the effect.
    pattern : str
        Frame and pattern, one of
        :data:`carrierflex.simulation.carrier.measured_laws.rim_patterns.RIM_PATTERNS`.
    n_planets : int
        Planets.
    sensor_radius : float
        Radius of the sensors [m].
    parts : tuple of LawPart
        Parts that add up.
    visited : mapping of str to (float, float)
        Least and largest ``torque`` [N m], ``ntl_y`` and ``ntl_z`` [N] of the records.
    measured_on : str
        Campaign whose records gave it; empty where unknown.
    """

    name: str
    pattern: str
    n_planets: int
    sensor_radius: float
    parts: tuple[LawPart, ...]
    visited: Mapping[str, tuple[float, float]]
    measured_on: str = ""

    @property
    def follows(self) -> tuple[str, ...]:
        """What its parts follow, each once."""
        return tuple(dict.fromkeys(part.follows for part in self.parts))


def refuse_other_rig(law: CarrierLaw, n_planets: int, sensor_radius: float) -> None:
    """Refuse a law that was measured on another rig.

    Parameters
    ----------
    law : CarrierLaw
        Law.
    n_planets : int
        Planets.
    sensor_radius : float
        Radius of the sensors [m].

    Raises
    ------
    ValueError
        Where the planets or the radius are others: orders and amplitudes would be too.
    """
    if law.n_planets != n_planets:
        raise ValueError(
            f"law '{law.name}' is of a carrier with {law.n_planets} planets, the rig has "
            f"{n_planets}; expected a law of as many"
        )
    if abs(law.sensor_radius - sensor_radius) > _SAME_RADIUS * law.sensor_radius:
        raise ValueError(
            f"law '{law.name}' was measured at the radius {law.sensor_radius:g} m, the sensors "
            f"stand at {sensor_radius:g} m; expected the same circle within {_SAME_RADIUS:.0%}"
        )


def law_signal(law: CarrierLaw, sensor: RimSensor, inputs: CarrierInputs) -> FloatArray:
    """Signal of a law [m].

    ``sum f(loads) (A_c cos(m v - n theta) + A_s sin(m v - n theta))`` over its parts and waves.

    Parameters
    ----------
    law : CarrierLaw
        Law.
    sensor : RimSensor
        Where and what is read.
    inputs : CarrierInputs
        Inputs of n samples.

    Returns
    -------
    ndarray, shape (n,)
        Displacement.
    """
    quantity = AXIAL if sensor.is_axial else RADIAL
    total = np.zeros(inputs.carrier_angle.shape)
    for part in law.parts:
        own = [wave for wave in part.waves if wave.quantity == quantity]
        if not own:
            continue
        x, factor = _followed(part, inputs)
        for wave in own:
            phase = wave.lobes * sensor.angle - wave.order * inputs.carrier_angle
            cosine, sine = (_continued(part.x, own, x) for own in (wave.cosine, wave.sine))
            total += factor * (cosine * np.cos(phase) + sine * np.sin(phase))
    return total


def _followed(part: LawPart, inputs: CarrierInputs) -> tuple[FloatArray, FloatArray | float]:
    """Abscissa of a part along a run, and the factor of its amplitudes."""
    if part.follows == BY_TORQUE:
        return inputs.torque, 1.0
    if part.follows == TIME:
        lasts = max(inputs.end - inputs.start, np.finfo(float).tiny)
        return (inputs.time - inputs.start) / lasts, 1.0
    if part.follows not in ALONG_LOAD:
        return np.zeros(inputs.carrier_angle.shape), 1.0
    size = np.hypot(inputs.ntl_y, inputs.ntl_z)
    # Without radial load there is no direction, and no amplitude either.
    divisor = np.where(size > 0.0, size, 1.0)
    factor = DIRECTIONS[part.along](inputs.ntl_y / divisor, inputs.ntl_z / divisor)
    return size, factor * inputs.torque if part.follows == BY_BOTH else factor


def _continued(x: FloatArray, y: FloatArray, at: FloatArray) -> FloatArray:
    """Values of a table, beyond it with the slopes of its ends; a constant without abscissa."""
    if x.size == 0:
        return np.broadcast_to(y[0], at.shape)
    low, high = end_slopes(x, y)
    below, above = np.minimum(at - x[0], 0.0), np.maximum(at - x[-1], 0.0)
    return np.asarray(np.interp(at, x, y) + low * below + high * above)
