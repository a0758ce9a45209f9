"""Laws of a carrier as tables: amplitudes of a pattern's waves over the loads, linear between.

``A(T)`` over the torque; ``A(r)`` over the size r of the radial load F, times the direction
``e = F / r``: its components e_y and e_z where the amplitude turns round with the load, their
products where it is the same in either sense; times the torque where both make it; over the time
of a run; or a constant. Beyond its table an amplitude goes on with the slope of its end. Amplitudes
are those of displacements at the sensors' radius.
"""

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from carrierflex.simulation.carrier.measured_laws.rim_patterns import (
    ALONG_LOAD,
    BY_BOTH,
    BY_TORQUE,
    TIME,
)
from carrierflex.simulation.carrier.rim import CarrierInputs, RimSensor
from carrierflex.simulation.carrier.run_cases import AXIAL, RADIAL
from carrierflex.simulation.laws import Law, Wave, end_slopes

FloatArray = NDArray[np.float64]

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


def refuse_other_rig(law: Law, n_planets: int, sensor_radius: float) -> None:
    """Refuse a law that was measured on another rig.

    Parameters
    ----------
    law : Law
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
    if law.rig["n_planets"] != n_planets:
        raise ValueError(
            f"law '{law.name}' is of a carrier with {law.rig['n_planets']} planets, the rig has "
            f"{n_planets}; expected a law of as many"
        )
    radius = law.rig["sensor_radius"]
    if abs(radius - sensor_radius) > _SAME_RADIUS * radius:
        raise ValueError(
            f"law '{law.name}' was measured at the radius {radius:g} m, the sensors "
            f"are at {sensor_radius:g} m; expected the same circle within {_SAME_RADIUS:.0%}"
        )


def law_signal(law: Law, sensor: RimSensor, inputs: CarrierInputs) -> FloatArray:
    """Signal of a law [m].

    ``sum f(loads) (A_c cos(m v - n theta) + A_s sin(m v - n theta))`` over its waves.

    Parameters
    ----------
    law : Law
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
    followed: dict[tuple[str, str], tuple[FloatArray, FloatArray | float]] = {}
    for wave in law.of(Wave):
        if wave.acts_on != quantity:
            continue
        way = wave.follows, wave.along
        if way not in followed:
            followed[way] = _followed(*way, inputs)
        x, factor = followed[way]
        phase = wave.lobes * sensor.angle - wave.order * inputs.carrier_angle
        cosine, sine = (_continued(wave.x, amplitude, x) for amplitude in (wave.cosine, wave.sine))
        total += factor * (cosine * np.cos(phase) + sine * np.sin(phase))
    return total


def _followed(
    follows: str, along: str, inputs: CarrierInputs
) -> tuple[FloatArray, FloatArray | float]:
    """Abscissa of a wave along a run, and the factor of its amplitudes."""
    if follows == BY_TORQUE:
        return inputs.torque, 1.0
    if follows == TIME:
        lasts = np.maximum(inputs.end - inputs.start, np.finfo(float).tiny)
        return (inputs.time - inputs.start) / lasts, 1.0
    if follows not in ALONG_LOAD:
        return np.zeros(inputs.carrier_angle.shape), 1.0
    size = np.hypot(inputs.ntl_y, inputs.ntl_z)
    # Without radial load there is no direction, and no amplitude either.
    divisor = np.where(size > 0.0, size, 1.0)
    factor = DIRECTIONS[along](inputs.ntl_y / divisor, inputs.ntl_z / divisor)
    return size, factor * inputs.torque if follows == BY_BOTH else factor


def _continued(x: FloatArray, y: FloatArray, at: FloatArray) -> FloatArray:
    """Values of a table, beyond it with the slopes of its ends; a constant without abscissa."""
    if x.size == 0:
        return np.broadcast_to(y[0], at.shape)
    low, high = end_slopes(x, y)
    below, above = np.minimum(at - x[0], 0.0), np.maximum(at - x[-1], 0.0)
    return np.asarray(np.interp(at, x, y) + low * below + high * above)
