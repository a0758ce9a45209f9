"""Laws of the library as columns along a motion, and the classes that each lies in."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from carrierflex.diagnosis.classes.columns import dahl_friction, relaxing_branches, stops
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.element.classes.memory_parts import memory_force
from carrierflex.diagnosis.element.classes.motion.force_records import ForceRecord
from carrierflex.diagnosis.element.model import ElementModel
from carrierflex.identification.campaign.signals import band_end, change_over
from carrierflex.simulation.element.kernels import element_values, no_law, restoring_force
from carrierflex.simulation.element.law_forces import ElementLaw
from carrierflex.simulation.element.memory_laws import MemoryParts
from carrierflex.simulation.force_laws import Force
from carrierflex.simulation.laws import (
    COUPLED_DAMPING,
    DISSIPATION,
    FORCE_SURFACE,
    HYSTERESIS,
    MEMORY,
    RESTORING_FORCE,
    TABULATED,
)

DELAY = "delay"
TIME_VARIATION = "time_variation"
DRIVE_SIDE = "drive_side"

_STATIC = (RESTORING_FORCE, FORCE_SURFACE)
_FRICTION = (DISSIPATION, FORCE_SURFACE)
#: Classes that hold each law, the narrowest first.
CLASSES_OF_LAW: dict[str, tuple[str, ...]] = {
    "quadratic_stiffness": _STATIC,
    "cubic_stiffness": _STATIC,
    "quintic_stiffness": _STATIC,
    "backlash": _STATIC,
    "coulomb_friction": (DISSIPATION, HYSTERESIS, FORCE_SURFACE),
    "friction_asymmetry": _FRICTION,
    "stribeck_friction": _FRICTION,
    "quadratic_damping": _FRICTION,
    "cubic_damping": _FRICTION,
    "elasto_plastic_friction": (HYSTERESIS,),
    "maxwell_branch": (MEMORY,),
    "sensor_delay": (DELAY,),
    "deflection_dependent_damping": (COUPLED_DAMPING, FORCE_SURFACE),
}
#: Yield deflections, gaps and turning lengths over the half range; rise speeds over the RMS speed;
#: relaxation times over the time scale of the motion.
_YIELDS = np.geomspace(0.004, 1.2, 14)
#: Longest pre-sliding of dry friction over the half range, a length of Dahl's law: friction that
#: turns over more is hysteresis.
_PRESLIDING, _N_PRESLIDING = 0.04, 4
_GAPS = np.linspace(0.08, 0.95, 12)
_RISE_SPEEDS = np.geomspace(0.03, 2.0, 7)
_TAUS = np.geomspace(0.05, 50.0, 12)


@dataclass(frozen=True, eq=False)
class MotionSize:
    """Sizes of the motion over all runs.

    Parameters
    ----------
    low, high : float
        Range of the deflection.
    speed, acceleration : float
        RMS.
    rest_speed : float
        Speed below which the sign of the speed is uncertain.
    least_yield : float
        Least deflection that a slider's yield can be told from noise.
    """

    low: float
    high: float
    speed: float
    acceleration: float
    rest_speed: float
    least_yield: float

    @property
    def presliding(self) -> FloatArray:
        """Deflections over which dry friction turns before it slides."""
        longest = _PRESLIDING * self.half_range
        least = min(max(_YIELDS[0] * self.half_range, self.least_yield), longest)
        return np.geomspace(least, longest, _N_PRESLIDING)

    @property
    def half_range(self) -> float:
        """Half of the range of the deflection."""
        return 0.5 * (self.high - self.low)

    @property
    def time(self) -> float:
        """Time scale of the motion [s]."""
        return self.half_range / self.speed


def classes_of(law: str, measured: Mapping[str, ElementLaw]) -> tuple[str, ...]:
    """Classes that hold a law; of a user's law f(q, v) and of a table those of any surface.

    Parameters
    ----------
    law : str
        Effect.
    measured : mapping of str to ElementLaw
        Measured laws.
    """
    if _has_parts(law, measured):
        return (measured[law].effect_class,)
    return CLASSES_OF_LAW.get(law, (RESTORING_FORCE, DISSIPATION, COUPLED_DAMPING, FORCE_SURFACE))


def _has_parts(law: str, measured: Mapping[str, ElementLaw]) -> bool:
    """Whether a law is a measured one with parts beside its table."""
    return law in measured and measured[law].effect_class not in TABULATED


def law_columns(model: ElementModel, own: ForceRecord, law: str, size: MotionSize) -> FloatArray:
    """Columns of one law along a run, by shape, shape (n_shapes, n_columns, n).

    Parameters
    ----------
    model : ElementModel
        Its scale, and users' laws.
    own : ForceRecord
        Run.
    law : str
        Effect.
    size : MotionSize
        Sizes over all runs, so that shapes are the same in each.

    Returns
    -------
    ndarray, shape (n_shapes, n_columns, n)
        Force for unit amplitude.
    """
    if _has_parts(law, model.measured):
        parts = model.measured[law].parts
        force = memory_force(parts, own)
        if law in model.laws:
            force = force + _force_along(model.laws[law], own)
            force = force + _friction(parts, own, size)
        return force[None, None]
    if law == "sensor_delay":
        sign = 1.0 if model.by_force else -1.0
        return sign * change_by_delay(own)[None, None]
    if law == "maxwell_branch":
        taus = shapes_of(law, size)
        return relaxing_branches(own.x, taus, own.step, from_rest=own.from_rest)[:, None]
    if law == "elasto_plastic_friction":
        return stops(own.x, yields(size), from_rest=own.from_rest)[:, None]
    static = static_law(law, own.x, own.v, size)
    if static is not None:
        return static
    return _user_law(model, own, law)


def shapes_of(law: str, size: MotionSize) -> FloatArray:
    """Shapes at which a law with one stands in the table, ascending, shape (n_shapes,).

    Gap [m], speed of the rise [m/s], yield deflection [m], relaxation time [s].
    """
    shapes: Mapping[str, FloatArray] = {
        "backlash": _GAPS * max(abs(size.low), abs(size.high)),
        "stribeck_friction": _RISE_SPEEDS * size.speed,
        "elasto_plastic_friction": yields(size),
        "maxwell_branch": _TAUS * size.time,
    }
    return shapes[law]


def change_by_delay(own: ForceRecord) -> FloatArray:
    """What the measured force changes by in a delay, by that delay, shape (n,).

    ``F(t) - F(t - tau)`` beside a deflection that is measured late, and less ``F(t + tau)`` of a
    force that is. Exact up to the band's end: differences of neighbours are 6 % too small at a
    tenth of the sampling frequency.
    """
    return change_over(own.force, own.step, band_end(np.inf, own.step), own.lag)


def yields(size: MotionSize) -> FloatArray:
    """Yield deflections of the sliders, shape (n,)."""
    least = max(_YIELDS[0] * size.half_range, size.least_yield)
    return np.geomspace(least, max(_YIELDS[-1] * size.half_range, 2.0 * least), _YIELDS.size)


def _sign(v: FloatArray, size: MotionSize) -> FloatArray:
    """Sign of the speed, smooth where it is uncertain."""
    return np.asarray(np.tanh(v / size.rest_speed))


#: Columns of laws of one shape from deflection, speed and the sign of the speed.
_SIMPLE_LAWS: Mapping[
    str, Callable[[FloatArray, FloatArray, FloatArray], tuple[FloatArray, ...]]
] = {
    "quadratic_stiffness": lambda x, v, sign: (x**2,),
    "cubic_stiffness": lambda x, v, sign: (x**3,),
    "quintic_stiffness": lambda x, v, sign: (x**5,),
    "coulomb_friction": lambda x, v, sign: (sign,),
    "friction_asymmetry": lambda x, v, sign: (np.maximum(sign, 0.0), np.minimum(sign, 0.0)),
    "quadratic_damping": lambda x, v, sign: (v * np.abs(v),),
    "cubic_damping": lambda x, v, sign: (v**3,),
    "deflection_dependent_damping": lambda x, v, sign: (x**2 * v,),
}


def static_law(law: str, x: FloatArray, v: FloatArray, size: MotionSize) -> FloatArray | None:
    """Columns of a law without memory by shape, shape (n_shapes, n_columns, n).

    None for any other.
    """
    simple = _SIMPLE_LAWS.get(law)
    if simple is not None:
        return np.array(simple(x, v, _sign(v, size)))[None]
    if law == "backlash":
        return np.array([[-np.clip(x, -gap, gap)] for gap in shapes_of(law, size)])
    if law == "stribeck_friction":
        sign = _sign(v, size)
        speeds = shapes_of(law, size)
        return np.array([[sign, sign * np.exp(-((v / own) ** 2))] for own in speeds])
    return None


def _friction(parts: MemoryParts, own: ForceRecord, size: MotionSize) -> FloatArray:
    """Dry friction of a surface along the motion of a run, shape (n,)."""
    if not parts.levels.size:
        return np.zeros(own.x.size)
    nodes, levels = parts.levels.T
    return np.asarray(np.interp(own.x, nodes, levels) * _sign(own.v, size))


def _force_along(force: Force, own: ForceRecord) -> FloatArray:
    """Force of a law of size one along the motion of a run, shape (n,)."""
    none = np.empty(0)
    # The kernel of the displacement drive, with no element but this law.
    return np.asarray(
        restoring_force(
            np.ascontiguousarray(own.x),
            np.ascontiguousarray(own.v),
            np.zeros(own.x.size),
            element_values({}),
            np.ones(2),
            force,
            no_law,
            np.ones(1),
            none,
        )
    )


def _user_law(model: ElementModel, own: ForceRecord, law: str) -> FloatArray:
    """Columns of a user's law at the scale of its shapes."""
    parameters = [p for p in model.parameters((law,)) if p.effect == law]
    shapes = {p.name: p.scale for p in parameters if p.shape}
    rows = []
    for parameter in parameters:
        if not parameter.shape:
            values = dict.fromkeys([p.name for p in parameters], 0.0) | shapes
            rows.append(model.signature(own.record, law, values | {parameter.name: 1.0}))
    return np.array([rows])


def presliding_columns(own: ForceRecord, size: MotionSize) -> FloatArray:
    """Dry friction that turns over a length (Dahl) by length, shape (n_lengths, n)."""
    return dahl_friction(own.x, yields(size)[:10], from_rest=own.from_rest)
