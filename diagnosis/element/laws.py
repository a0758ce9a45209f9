"""Laws of the library as columns along a motion, and the classes that each lies in."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from carrierflex.diagnosis.classes.columns import dahl_friction, relaxing_branches, stops
from carrierflex.diagnosis.classes.gram_table import GramTable, IntArray, discrepancy_shift
from carrierflex.diagnosis.comparison.problem import BASELINE, FloatArray, Parameter
from carrierflex.diagnosis.element.force_records import ForceRecord
from carrierflex.diagnosis.element.model import ElementModel, values_by_effect
from carrierflex.diagnosis.element.signatures import contained_columns
from carrierflex.identification.campaign.signals import band_end, change_over
from carrierflex.simulation.element.kernels import element_values, no_law, restoring_force
from carrierflex.simulation.element.law_forces import ElementLaw
from carrierflex.simulation.element.memory_kernels import forces_along
from carrierflex.simulation.element.memory_laws import NO_PARTS, flat_parts
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
#: Dry friction that turns over a length, which no effect of the library is.
PRESLIDING = "dahl_friction"

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
    PRESLIDING: (DISSIPATION, HYSTERESIS),
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
#: Step of the derivatives by differences, relative to a parameter or a hundredth of its scale.
_DIFFERENCE = 1e-4
#: Nearest shapes, of which a law's column between them is the cubic in the logarithm of the shape.
_NEAREST = 4


@dataclass(frozen=True, eq=False)
class MotionSize:
    """Sizes of the motion over all runs."""

    #: low, high: range of the deflection
    low: float
    high: float
    speed: float  # RMS
    rest_speed: float  # Speed below which the sign of the speed is uncertain
    least_yield: float  # Least deflection that a slider's yield can be told from noise

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
    """Classes that hold a law; of a user's law f(q, v) and of a table those of any surface."""
    if law in measured and measured[law].effect_class not in TABULATED:
        return (measured[law].effect_class,)
    return CLASSES_OF_LAW.get(law, (RESTORING_FORCE, DISSIPATION, COUPLED_DAMPING, FORCE_SURFACE))


def law_columns(model: ElementModel, run: ForceRecord, law: str, size: MotionSize) -> FloatArray:
    """Columns of one law along a run, by shape, shape (n_shapes, n_columns, n).

    Force for unit amplitude; by the sizes over all runs, shapes are the same in each.
    """
    if law in model.measured and model.measured[law].effect_class not in TABULATED:
        return _measured_force(model.measured[law], run, size)[None, None]
    if law == "sensor_delay":
        sign = 1.0 if model.by_force else -1.0
        return sign * change_by_delay(run)[None, None]
    if law == "maxwell_branch":
        taus = _shapes_of(law, size)
        return relaxing_branches(run.x, taus, run.step, from_rest=run.from_rest)[:, None]
    if law == "elasto_plastic_friction":
        return stops(run.x, yields(size), from_rest=run.from_rest)[:, None]
    static = static_law(law, run.x, run.v, size)
    if static is not None:
        return static
    return _user_law(model, run, law)


def _measured_force(law: ElementLaw, run: ForceRecord, size: MotionSize) -> FloatArray:
    """Force of a measured law with a memory along a run, begun as the class's columns are."""
    x, force = np.ascontiguousarray(run.x), np.zeros(run.x.size)
    flat = flat_parts(replace(law.memory, levels=NO_PARTS.levels))
    if flat.size:
        if not run.from_rest:
            forces_along(np.ascontiguousarray(x[::-1]), run.step, flat)
        force += forces_along(x, run.step, flat)
    if law.force is not None:
        # The kernel of the displacement drive, with no element but this law.
        still, v = np.zeros(x.size), np.ascontiguousarray(run.v)
        table, none = law.force, np.empty(0)
        force += restoring_force(
            x, v, still, element_values({}), np.ones(2), table.force, no_law, table.parameters, none
        )
        if law.memory.levels.size:
            nodes, levels = law.memory.levels.T
            force += np.interp(x, nodes, levels) * _sign(run.v, size)
    return force


def _shapes_of(law: str, size: MotionSize) -> FloatArray:
    """Shapes at which a law with one stands in the table, ascending, shape (n_shapes,)."""
    shapes: Mapping[str, FloatArray] = {
        "backlash": _GAPS * max(abs(size.low), abs(size.high)),
        "stribeck_friction": _RISE_SPEEDS * size.speed,
        "elasto_plastic_friction": yields(size),
        "maxwell_branch": _TAUS * size.time,
    }
    return shapes[law]


def change_by_delay(run: ForceRecord) -> FloatArray:
    """What the measured force changes by in a delay, by that delay, shape (n,).

    ``F(t) - F(t - tau)`` beside a deflection that is measured late, and less ``F(t + tau)`` of a
    force that is. Exact up to the band's end: differences of neighbours are 6 % too small at a
    tenth of the sampling frequency.
    """
    return change_over(run.force, run.step, band_end(np.inf, run.step), run.lag)


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
    """Columns of a law without memory, shape (n_shapes, n_columns, n); None for any other."""
    simple = _SIMPLE_LAWS.get(law)
    if simple is not None:
        return np.array(simple(x, v, _sign(v, size)))[None]
    if law == "backlash":
        return np.array([[-np.clip(x, -gap, gap)] for gap in _shapes_of(law, size)])
    if law == "stribeck_friction":
        sign = _sign(v, size)
        speeds = _shapes_of(law, size)
        return np.array([[sign, sign * np.exp(-((v / speed) ** 2))] for speed in speeds])
    return None


def _user_law(model: ElementModel, run: ForceRecord, law: str) -> FloatArray:
    """Columns of a user's law at the scale of its shapes."""
    parameters = [p for p in model.parameters((law,)) if p.effect == law]
    shapes = {p.name: p.scale for p in parameters if p.shape}
    rows = []
    for parameter in parameters:
        if not parameter.shape:
            values = dict.fromkeys([p.name for p in parameters], 0.0) | shapes
            rows.append(model.signature(run.record, law, values | {parameter.name: 1.0}))
    return np.array([rows])


def presliding_columns(run: ForceRecord, size: MotionSize) -> FloatArray:
    """Dry friction that turns over a length (Dahl) by length, shape (n_lengths, n)."""
    return dahl_friction(run.x, yields(size)[:10], from_rest=run.from_rest)


def parameter_shift(
    model: ElementModel,
    table: GramTable,
    size: MotionSize,
    parameters: Sequence[Parameter],
    theta: FloatArray,
    *,
    independent_samples: float,
) -> FloatArray:
    """Shift of the parameters of a fit with a discrepancy of the classes, shape (p,).

    The force is taken as linear at the fit; `independent_samples` of all runs in their bands. Zero
    where the table does not hold the fitted force: a shape beyond those that it has, or that of a
    user's law. What its columns then miss would be taken for a discrepancy.
    """
    for effect, values in values_by_effect(parameters, theta).items():
        is_held = not any(p.shape for p in parameters if p.effect == effect)
        if effect in _SHAPED:
            shapes = _shapes_of(effect, size)
            is_held = bool(shapes[0] <= _SHAPED[effect](values, 0.0)[1] <= shapes[-1])
        if not is_held:
            return np.zeros(len(parameters))
    derivatives = _force_derivatives(model, table, size, parameters, theta)
    return discrepancy_shift(table, derivatives, independent_samples=independent_samples)


def _force_derivatives(
    model: ElementModel,
    table: GramTable,
    size: MotionSize,
    parameters: Sequence[Parameter],
    theta: FloatArray,
) -> FloatArray:
    """Derivatives of the force by the parameters, as coefficients of the table's columns."""
    derivatives = np.zeros((len(table.scale), len(parameters)))
    for k, parameter in enumerate(parameters):
        if parameter.run is not None or not parameter.is_free:
            continue
        step = _DIFFERENCE * max(abs(theta[k]), 0.01 * parameter.scale)
        ends = []
        for sign in (1.0, -1.0):
            moved = theta.copy()
            moved[k] += sign * step
            ends.append(_force(model, table, size, parameters, moved))
        derivatives[:, k] = (ends[0] - ends[1]) / (2.0 * step)
    # Coefficients of the scaled columns for a target that is scaled too.
    return derivatives * (table.scale[0] / table.scale)[:, None]


def _force(
    model: ElementModel,
    table: GramTable,
    size: MotionSize,
    parameters: Sequence[Parameter],
    theta: FloatArray,
) -> FloatArray:
    """Coefficients of the raw columns, shape (n_columns,)."""
    values = values_by_effect(parameters, theta)
    force = np.zeros(len(table.scale))
    names = ["K1", "C1", "f0"] if model.mass is not None else ["m", "K1", "C1", "f0"]
    keys = [(BASELINE, name) for name in names]
    keys += [(column.effect, column.amplitude) for column in contained_columns(model)]
    for column, (effect, name) in zip(table.base, keys, strict=True):
        force[column] += values[effect][name]
    for effect in values:
        law = table.library.get(effect)
        if law is None:
            continue
        if effect in _SHAPED:
            amplitudes, shape = _SHAPED[effect](values[effect], values[BASELINE]["K1"])
            for k, weight in zip(*_between(_shapes_of(effect, size), shape), strict=True):
                force[law.variants[k]] += weight * np.array(amplitudes)
        else:
            shapes = {p.name for p in parameters if p.effect == effect and p.shape}
            force[law.variants[0]] += [
                value for name, value in values[effect].items() if name not in shapes
            ]
    return force


#: Amplitudes of a law's columns, and its shape, from its parameters and K1.
_SHAPED: dict[str, Callable[[Mapping[str, float], float], tuple[list[float], float]]] = {
    "backlash": lambda law, K1: ([K1], law["gap"]),
    "stribeck_friction": lambda law, K1: ([law["Fc"], law["Fs"]], law["v_s"]),
    "elasto_plastic_friction": lambda law, K1: ([law["Fy"]], law["Fy"] / max(law["Kp"], 1e-300)),
    "maxwell_branch": lambda law, K1: ([law["k"]], law["tau"]),
}


def _between(shapes: FloatArray, shape: float) -> tuple[IntArray, FloatArray]:
    """Numbers of the nearest shapes and their weights by Lagrange's polynomial."""
    at = np.log(np.clip(shape, shapes[0], shapes[-1]))
    nodes = np.log(shapes)
    first = int(np.clip(np.searchsorted(nodes, at) - _NEAREST // 2, 0, nodes.size - _NEAREST))
    nearest = nodes[first : first + _NEAREST]
    weights = [
        np.prod([(at - other) / (node - other) for other in nearest if other != node])
        for node in nearest
    ]
    return first + np.arange(_NEAREST), np.array(weights)
