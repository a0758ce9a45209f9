"""Columns of every class along a run."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from carrierflex.diagnosis.classes.columns import (
    GroupColumns,
    SplineBasis,
    basis_over,
    dahl_friction,
    difference_penalty,
    relaxing_branches,
    stops,
)
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.element.force_records import ForceRecord, time_basis
from carrierflex.diagnosis.element.laws import MotionSize, change_by_delay, yields
from carrierflex.simulation.element.memory_laws import (
    AT,
    FIRST_FORCE,
    NO_PARTS,
    OUTSIDE,
    MemoryParts,
    StopPlaces,
)

#: Splines of f(x), g(v), h(x), of each side of f(x, v), of time and of the drive side. h is as
#: curved as f: eight of a damping that rises over a fifth of the range left 3 % of its gap.
_N_FORCE = 24
_N_SPEED = 12
_N_COUPLED = 14
_N_SURFACE = 6
_N_SIDE = 12
#: Speed of the asinh scale over its RMS: a third of the splines lie below a tenth of the RMS.
_SPEED_SCALE = 0.1
_N_PRONY = 8
#: Relaxation times from so many steps to this share of the longest record.
_TAU_STEPS, _TAU_SHARE = 1.5, 0.2
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

    def curved_speed(self, v: FloatArray) -> FloatArray:
        """asinh(v / (0.1 v_rms)): fine near rest, coarse far from it."""
        return np.asarray(np.arcsinh(v / (_SPEED_SCALE * self.size.speed)), dtype=np.float64)

    def drawn_speeds(self, n: int) -> FloatArray:
        """Speeds over what the runs visit, dense beside rest, shape (n,)."""
        curved = np.linspace(self.speed.low, self.speed.high, n)
        return np.asarray(_SPEED_SCALE * self.size.speed * np.sinh(curved), dtype=np.float64)


def element_bases(runs: Sequence[ForceRecord], size: MotionSize) -> ElementBases:
    """Splines over what the runs visit."""
    x = np.concatenate([run.x[run.counts] for run in runs])
    v = np.concatenate([run.v[run.counts] for run in runs])
    side = np.concatenate([run.side[run.counts] for run in runs])
    curved = np.arcsinh(v / (_SPEED_SCALE * size.speed))
    longest = max(run.x.size * run.step for run in runs)
    step = min(run.step for run in runs)
    return ElementBases(
        size=size,
        force=basis_over(x, _N_FORCE),
        speed=basis_over(curved, _N_SPEED),
        coupled=basis_over(x, _N_COUPLED),
        surface_x=basis_over(x, _N_SURFACE),
        surface_v=basis_over(v / size.speed, _N_SURFACE),
        time=time_basis(runs),
        side=basis_over(side, _N_SIDE),
        taus=np.geomspace(_TAU_STEPS * step, _TAU_SHARE * longest, _N_PRONY),
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
    n_plain = yields(size).size
    n_varying = len(_BY_DEFLECTION) * yields(size)[_COUPLED_YIELDS].size
    n_curved = len(_BY_SPRING) * yields(size)[_CURVED_YIELDS].size

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
        "dry_by_place": lambda v: step_at_rest(v, size).sum(axis=0),
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
            "g", lambda run: bases.speed(bases.curved_speed(run.v)), difference_penalty(_N_SPEED, 2)
        ),
        GroupColumns("jump", lambda run: step_at_rest(run.v, size), np.zeros((2, 2))),
        GroupColumns(
            "presliding",
            lambda run: dahl_friction(run.x, size.presliding, from_rest=run.from_rest),
            np.zeros((size.presliding.size,) * 2),
            is_nonnegative=True,
        ),
        GroupColumns(
            "stops",
            lambda run: stops_columns(run.x, size, from_rest=run.from_rest),
            np.zeros((n_plain + n_varying + n_curved,) * 2),
            is_nonnegative=True,
        ),
        GroupColumns("prony", branches, np.zeros((_N_PRONY,) * 2), True),
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


def step_at_rest(v: FloatArray, size: MotionSize) -> FloatArray:
    """Signs of positive and of negative speed, smooth where they are uncertain, shape (2, n)."""
    sign = np.tanh(v / size.rest_speed)
    return np.array([np.maximum(sign, 0.0), np.minimum(sign, 0.0)])


def surface_products(bases: ElementBases, x: FloatArray, v: FloatArray) -> FloatArray:
    """Splines of x times splines of v and the step at rest, shape (n_columns, n)."""
    along_x = bases.surface_x(x)
    along_v = np.concatenate([bases.surface_v(v / bases.size.speed), step_at_rest(v, bases.size)])
    return (along_x[:, None] * along_v[None]).reshape(-1, x.size)


def stops_columns(x: FloatArray, size: MotionSize, *, from_rest: bool = False) -> FloatArray:
    """Sliders, sliders whose strength changes with deflection, and curved ones, shape (n, x.size).

    ``z_i``; ``z_i (1 - |x|/X)``, ``z_i max(x, 0)/X``, ``z_i max(-x, 0)/X``, ``z_i min(4|x|/X, 1)``,
    which is weak in the middle alone as a loop is that is pinched there; and the inner half of
    z_i with both outer quarters apart, which is a spring of three stiffnesses in series with a
    slider. With weights of at least zero no strength and no stiffness is negative, and loops may
    soften, harden, be pinched, or differ from side to side.
    """
    z = stops(x, yields(size), from_rest=from_rest)
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
    plain = yields(size)
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
