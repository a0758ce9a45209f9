"""Columns of every class and law along a run, and the classes that each law lies in."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from carrierflex.diagnosis.classes.columns import (
    N_PRONY,
    GroupColumns,
    SplineBasis,
    basis_over,
    curved_speed,
    dahl_friction,
    difference_penalty,
    relaxation_times,
    relaxing_branches,
    step_at_rest,
    stops,
    straight_speed,
    time_splines,
)
from carrierflex.diagnosis.classes.gram_table import GramTable, IntArray
from carrierflex.diagnosis.comparison.problem import BASELINE, FloatArray, Parameter
from carrierflex.diagnosis.element.force_records import ForceRecord
from carrierflex.diagnosis.element.model import ElementModel, values_by_effect
from carrierflex.diagnosis.element.signatures import contained_columns
from carrierflex.identification.campaign.signals import band_end, change_over
from carrierflex.simulation.element.kernels import element_values, no_law, restoring_force
from carrierflex.simulation.element.law_forces import ElementLaw
from carrierflex.simulation.element.memory_kernels import forces_along
from carrierflex.simulation.element.memory_laws import (
    AT,
    FIRST_FORCE,
    NO_PARTS,
    OUTSIDE,
    MemoryParts,
    StopPlaces,
    flat_parts,
)
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
    def yields(self) -> FloatArray:
        """Yield deflections of the sliders."""
        least = max(_YIELDS[0] * self.half_range, self.least_yield)
        return np.geomspace(least, max(_YIELDS[-1] * self.half_range, 2.0 * least), _YIELDS.size)

    @property
    def half_range(self) -> float:
        """Half of the range of the deflection."""
        return 0.5 * (self.high - self.low)


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
        return stops(run.x, size.yields, from_rest=run.from_rest)[:, None]
    if law == PRESLIDING:
        return dahl_friction(run.x, size.yields[:10], from_rest=run.from_rest)[:, None]
    static = static_law(law, run.x, run.v, size)
    if static is not None:
        return static
    # A user's law, at the scale of its shapes.
    parameters = [p for p in model.parameters((law,)) if p.effect == law]
    values = {p.name: p.scale if p.shape else 0.0 for p in parameters}
    rows = [
        model.signature(run.record, law, values | {p.name: 1.0}) for p in parameters if not p.shape
    ]
    return np.array([rows])


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
        "elasto_plastic_friction": size.yields,
        "maxwell_branch": _TAUS * (size.half_range / size.speed),
    }
    return shapes[law]


def change_by_delay(run: ForceRecord) -> FloatArray:
    """What the measured force changes by in a delay, by that delay, shape (n,).

    ``F(t) - F(t - tau)`` beside a deflection that is measured late, and less ``F(t + tau)`` of a
    force that is. Exact up to the band's end: differences of neighbours are 6 % too small at a
    tenth of the sampling frequency.
    """
    return change_over(run.force, run.step, band_end(np.inf, run.step), run.lag)


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


def holds_shapes(size: MotionSize, parameters: Sequence[Parameter], theta: FloatArray) -> bool:
    """Whether the shapes of all laws of a fit lie among those of the table; no user's law does."""
    for effect, values in values_by_effect(parameters, theta).items():
        if effect in _SHAPED:
            shapes = _shapes_of(effect, size)
            if not shapes[0] <= _SHAPED[effect](values, 0.0)[1] <= shapes[-1]:
                return False
        elif any(p.shape for p in parameters if p.effect == effect):
            return False
    return True


def force_derivatives(
    model: ElementModel,
    table: GramTable,
    size: MotionSize,
    parameters: Sequence[Parameter],
    theta: FloatArray,
) -> FloatArray:
    """Derivatives of the force by the parameters, as coefficients of the table's columns."""
    names = ["K1", "C1", "f0"] if model.mass is not None else ["m", "K1", "C1", "f0"]
    keys = [(BASELINE, name) for name in names]
    keys += [(column.effect, column.amplitude) for column in contained_columns(model)]
    library = table.library
    shapes_of = {
        effect: {p.name for p in parameters if p.effect == effect and p.shape} for effect in library
    }

    def force(theta: FloatArray) -> FloatArray:
        """Coefficients of the raw columns, shape (n_columns,)."""
        values = values_by_effect(parameters, theta)
        c = np.zeros(len(table.scale))
        for column, (effect, name) in zip(table.base, keys, strict=True):
            c[column] += values[effect][name]
        for effect, of_law in values.items():
            if effect not in library:
                continue
            law = library[effect]
            if effect in _SHAPED:
                amplitudes, shape = _SHAPED[effect](of_law, values[BASELINE]["K1"])
                for k, weight in zip(*_between(_shapes_of(effect, size), shape), strict=True):
                    c[law.variants[k]] += weight * np.array(amplitudes)
            else:
                c[law.variants[0]] += [
                    value for name, value in of_law.items() if name not in shapes_of[effect]
                ]
        return c

    derivatives = np.zeros((len(table.scale), len(parameters)))
    for k, parameter in enumerate(parameters):
        if parameter.run is None and parameter.is_free:
            step = _DIFFERENCE * max(abs(theta[k]), 0.01 * parameter.scale)
            moved = step * (np.arange(theta.size) == k)
            derivatives[:, k] = (force(theta + moved) - force(theta - moved)) / (2.0 * step)
    # Coefficients of the scaled columns for a target that is scaled too.
    return derivatives * (table.scale[0] / table.scale)[:, None]


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


#: Splines of f(x), g(v), h(x), of each side of f(x, v), of time and of the drive side. h is as
#: curved as f: eight of a damping that rises over a fifth of the range left 3 % of its gap.
_N_FORCE = 24
_N_SPEED = 12
_N_COUPLED = 14
_N_SURFACE = 6
_N_SIDE = 12
#: Yield deflections of the sliders whose strength changes with deflection: every second one.
_COUPLED_YIELDS = slice(0, None, 2)
#: Those whose own spring is curved: they turn within half of the motion, since a slider that hardly
#: slips is a spring, and a curved one any f(x).
_CURVED_YIELDS = slice(6, 12)
#: Forces of a slider whose strength changes with deflection, and of one whose spring is curved, in
#: the order of their columns.
_BY_DEFLECTION = ("slip_middle", "slip_upper", "slip_lower", "slip_outside")
_BY_SPRING = ("inner", "outer_upper", "outer_lower")


@dataclass(frozen=True, eq=False)
class ElementBases:
    """Splines and sizes that all runs share."""

    size: MotionSize  # Sizes of the motion
    #: force, speed, coupled, surface_x, surface_v, time, side: splines over the range of all runs;
    #: speed in asinh(v / scale)
    force: SplineBasis
    speed: SplineBasis
    coupled: SplineBasis
    surface_x: SplineBasis
    surface_v: SplineBasis
    time: SplineBasis
    side: SplineBasis
    taus: FloatArray  # Relaxation times [s], shape (n,)

    def drawn_speeds(self, n: int) -> FloatArray:
        """Speeds over what the runs visit, dense beside rest, shape (n,)."""
        return straight_speed(np.linspace(self.speed.low, self.speed.high, n), self.size.speed)


def element_bases(runs: Sequence[ForceRecord], size: MotionSize) -> ElementBases:
    """Splines over what the runs visit."""
    x = np.concatenate([run.x[run.counts] for run in runs])
    v = np.concatenate([run.v[run.counts] for run in runs])
    side = np.concatenate([run.side[run.counts] for run in runs])
    longest = max(run.x.size * run.step for run in runs)
    step = min(run.step for run in runs)
    return ElementBases(
        size=size,
        force=basis_over(x, _N_FORCE),
        speed=basis_over(curved_speed(v, size.speed), _N_SPEED),
        coupled=basis_over(x, _N_COUPLED),
        surface_x=basis_over(x, _N_SURFACE),
        surface_v=basis_over(v / size.speed, _N_SURFACE),
        time=time_splines(longest),
        side=basis_over(side, _N_SIDE),
        taus=relaxation_times(step, longest),
    )


def group_columns(
    bases: ElementBases, runs: Sequence[ForceRecord]
) -> tuple[GroupColumns[ForceRecord], ...]:
    """Every group of columns."""
    size = bases.size
    # Straight line of every spline of the drive side on the drive, which is projected out.
    drives = np.concatenate([run.side[run.counts] for run in runs])
    design = np.array([np.ones(drives.size), drives])
    side_line = np.linalg.lstsq(design.T, bases.side(drives).T, rcond=None)[0]
    n_stops = len(stops_columns(np.zeros(1), size))

    def branches(run: ForceRecord) -> FloatArray:
        return relaxing_branches(run.x, bases.taus, run.step, from_rest=run.from_rest)

    def in_time(run: ForceRecord) -> FloatArray:
        splines = bases.time(run.step * np.arange(run.x.size, dtype=np.float64))
        rows = (run.x / size.half_range, run.v / size.speed, np.ones(run.x.size))
        return np.concatenate([splines * row for row in rows])

    def side(run: ForceRecord) -> FloatArray:
        return bases.side(run.side) - side_line[0][:, None] - np.outer(side_line[1], run.side)

    #: Dampings of three powers of the speed, each times splines of the place.
    powers: dict[str, Callable[[FloatArray], FloatArray]] = {
        "h": lambda v: v,
        "dry_by_place": lambda v: step_at_rest(v, size.rest_speed).sum(axis=0),
        "quadratic_by_place": lambda v: v * np.abs(v),
    }

    def damping(run: ForceRecord, power: Callable[[FloatArray], FloatArray]) -> FloatArray:
        return bases.coupled(run.x) * power(run.v)

    # The same penalty for deflection, speed and constant.
    three_times: FloatArray = np.kron(np.eye(3), difference_penalty(bases.time.n, 1)).astype(
        np.float64
    )
    return (
        GroupColumns("f", lambda run: bases.force(run.x), difference_penalty(_N_FORCE, 2)),
        GroupColumns(
            "g",
            lambda run: bases.speed(curved_speed(run.v, size.speed)),
            difference_penalty(_N_SPEED, 2),
        ),
        GroupColumns("jump", lambda run: step_at_rest(run.v, size.rest_speed), np.zeros((2, 2))),
        GroupColumns(
            "presliding",
            lambda run: dahl_friction(run.x, size.presliding, from_rest=run.from_rest),
            np.zeros((size.presliding.size,) * 2),
            is_nonnegative=True,
        ),
        GroupColumns(
            "stops",
            lambda run: stops_columns(run.x, size, from_rest=run.from_rest),
            np.zeros((n_stops, n_stops)),
            is_nonnegative=True,
        ),
        GroupColumns("prony", branches, np.zeros((N_PRONY, N_PRONY)), True),
        GroupColumns("delay", lambda run: change_by_delay(run)[None], np.zeros((1, 1))),
        *(
            GroupColumns(name, partial(damping, power=power), difference_penalty(_N_COUPLED, 2))
            for name, power in powers.items()
        ),
        GroupColumns(
            "surface",
            lambda run: surface_products(bases, run.x, run.v),
            np.eye(_N_SURFACE * (_N_SURFACE + 2)),
        ),
        GroupColumns("time", in_time, three_times),
        GroupColumns("side", side, difference_penalty(_N_SIDE, 2)),
    )


def surface_products(bases: ElementBases, x: FloatArray, v: FloatArray) -> FloatArray:
    """Splines of x times splines of v and the step at rest, shape (n_columns, n)."""
    along_x = bases.surface_x(x)
    size = bases.size
    along_v = np.concatenate([bases.surface_v(v / size.speed), step_at_rest(v, size.rest_speed)])
    return (along_x[:, None] * along_v[None]).reshape(-1, x.size)


def stops_columns(x: FloatArray, size: MotionSize, *, from_rest: bool = False) -> FloatArray:
    """Sliders, sliders whose strength changes with deflection, and curved ones, shape (n, x.size).

    ``z_i``; ``z_i (1 - |x|/X)``, ``z_i max(x, 0)/X``, ``z_i max(-x, 0)/X``, ``z_i min(4|x|/X, 1)``,
    which is weak in the middle alone as a loop is that is pinched there; and the inner half of
    z_i with both outer quarters apart, which is a spring of three stiffnesses in series with a
    slider. With weights of at least zero no strength and no stiffness is negative, and loops may
    soften, harden, be pinched, or differ from side to side.
    """
    z = stops(x, size.yields, from_rest=from_rest)
    middle = 0.5 * (size.low + size.high)
    at = np.clip((x - middle) / size.half_range, -1.0, 1.0)
    varying = z[_COUPLED_YIELDS]
    curved = z[_CURVED_YIELDS]
    return np.concatenate(
        [
            z,
            varying * (1.0 - np.abs(at)),
            varying * np.maximum(at, 0.0),
            varying * np.maximum(-at, 0.0),
            varying * np.minimum(OUTSIDE * np.abs(at), 1.0),
            np.clip(curved, -0.5, 0.5),
            np.maximum(curved - 0.5, 0.0),
            np.minimum(curved + 0.5, 0.0),
        ]
    )


def stops_of(weights: FloatArray, size: MotionSize) -> MemoryParts:
    """Stops whose forces have these weights of the columns of :func:`stops_columns`."""
    plain = size.yields
    varying, curved = plain[_COUPLED_YIELDS], plain[_CURVED_YIELDS]
    names = {"slip": plain} | dict.fromkeys(_BY_DEFLECTION, varying)
    names |= dict.fromkeys(_BY_SPRING, curved)
    ends = np.cumsum([deflections.size for deflections in names.values()])
    shares = np.split(weights, ends[:-1])
    forces = {
        name: (deflections, share)
        for (name, deflections), share in zip(names.items(), shares, strict=True)
    }
    return memory_of_stops(forces, 0.5 * (size.low + size.high), size.half_range)


def memory_of_stops(
    forces: Mapping[str, tuple[FloatArray, FloatArray]], middle: float, half: float
) -> MemoryParts:
    """Stops by what their columns were fitted to; none where all weights are zero.

    `forces` are yield deflections and weights of the columns of each force of a stop, by its name
    among :class:`carrierflex.simulation.element.memory_laws.StopPlaces`; `middle` and `half` of the
    range of the deflection.
    """
    every = np.unique(np.concatenate([deflections for deflections, _ in forces.values()]))
    rows = np.zeros((every.size, len(AT)))
    rows[:, AT.yield_deflection] = every
    rows[:, AT.middle] = middle
    rows[:, AT.half_range] = half
    for name, (deflections, weights) in forces.items():
        column = StopPlaces._fields.index(name)
        rows[np.searchsorted(every, deflections), column] = np.maximum(weights, 0.0)
    return MemoryParts(rows[rows[:, FIRST_FORCE:].any(axis=1)], NO_PARTS.branches, NO_PARTS.levels)
