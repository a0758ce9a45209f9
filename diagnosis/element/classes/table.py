"""The Gram table of kind element: all columns through one filter, products by block."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from carrierflex.diagnosis.classes.columns import GroupColumns
from carrierflex.diagnosis.classes.constants import ClassConstants
from carrierflex.diagnosis.classes.gram_table import ColumnGroup, GramTable, LawColumns
from carrierflex.diagnosis.classes.held_out import ClassScores
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.element.channel_noise import carried_noise
from carrierflex.diagnosis.element.classes.columns import (
    ElementBases,
    element_bases,
    group_columns,
)
from carrierflex.diagnosis.element.classes.drive_in_time import is_separable_from_time
from carrierflex.diagnosis.element.classes.laws import (
    COUPLED_DAMPING,
    DELAY,
    DISSIPATION,
    DRIVE_SIDE,
    FORCE_SURFACE,
    HYSTERESIS,
    MEMORY,
    RESTORING_FORCE,
    TIME_VARIATION,
    MotionSize,
    classes_of,
    yields,
)
from carrierflex.diagnosis.element.classes.motion.force_records import (
    IN_TIME,
    ForceRecord,
    force_records,
    where_folds_overlap,
    while_sliding,
    with_noise_of,
)
from carrierflex.diagnosis.element.classes.motion.nearest_motion import with_all_lines
from carrierflex.diagnosis.element.classes.noise_colour import noise_correlation_time
from carrierflex.diagnosis.element.classes.smooth_loops import SmoothLoop
from carrierflex.diagnosis.element.classes.starting_states import with_starting_states
from carrierflex.diagnosis.element.classes.table_columns import (
    PRESLIDING,
    BlockProducts,
    Layout,
    columns_along,
    products_by_block,
)
from carrierflex.diagnosis.element.classes.weighting import (
    MotionNoise,
    NoiseWeight,
    weighted_baseline,
)
from carrierflex.diagnosis.element.model import ElementModel
from carrierflex.diagnosis.element.records import ElementRecord

#: Groups of columns of each class.
CLASS_GROUPS: dict[str, tuple[str, ...]] = {
    RESTORING_FORCE: ("f",),
    DISSIPATION: ("g", "jump", "presliding"),
    HYSTERESIS: ("stops",),
    MEMORY: ("prony",),
    DELAY: ("delay",),
    COUPLED_DAMPING: ("h",),
    FORCE_SURFACE: ("f", "g", "jump", "presliding", "h", "surface"),
    TIME_VARIATION: ("time",),
    DRIVE_SIDE: ("side",),
}
#: Damping ``h(x) g(v)``, dry and quadratic, alone and beside a damping of the speed.
PRODUCT_GROUPS: dict[str, tuple[str, ...]] = {
    "dry": ("dry_by_place",),
    "quadratic": ("quadratic_by_place",),
    "dry and g(v)": (*CLASS_GROUPS[DISSIPATION], "dry_by_place"),
    "quadratic and g(v)": (*CLASS_GROUPS[DISSIPATION], "quadratic_by_place"),
}
#: Hysteresis of one strength and one straight spring: sliders alike in both directions (Masing).
PLAIN_GROUPS: dict[str, tuple[str, ...]] = {HYSTERESIS: ("plain_stops",)}
CEILING = (*CLASS_GROUPS[FORCE_SURFACE], "stops", "prony", "delay", "time", "side")
#: Speed below which the sign is uncertain: this share of the RMS at least, at most.
_REST_SPEED = (0.01, 0.3)
#: The sign of a speed with a normal error rises over this many of its standard deviations: the
#: slope of ``erf(v / (sqrt(2) sigma))`` at rest.
_BLURRED_SIGN = float(np.sqrt(0.5 * np.pi))
#: Standard deviations of noise that a yield deflection stands above.
_CLEAR = 3.0
#: Passes of weight and baseline.
_PASSES = 3


@dataclass(frozen=True, eq=False)
class ElementTable:
    """Gram table with what its columns are.

    Parameters
    ----------
    table : GramTable
        Products.
    bases : ElementBases
        Splines and sizes.
    groups : tuple of GroupColumns
        Groups in the order of the table.
    records : tuple of ForceRecord
        Runs.
    weights : tuple of NoiseWeight
        Filter of each run.
    scores : ClassScores
        Held-out squares of the table, each made once.
    loop : SmoothLoop, optional
        Smooth loop among the columns of hysteresis.
    loops : dict
        Smooth loops once they were fitted, with the products of their columns, by the class beside
        them and whether they are curves; copies under other limits share them.
    """

    table: GramTable
    bases: ElementBases
    groups: tuple[GroupColumns[ForceRecord], ...]
    records: tuple[ForceRecord, ...]
    weights: tuple[NoiseWeight, ...]
    scores: ClassScores
    loop: SmoothLoop | None = None
    loops: dict[tuple[str, bool], tuple[SmoothLoop, BlockProducts]] = field(default_factory=dict)

    @property
    def runs(self) -> "ElementRuns":
        """What its columns are made of."""
        return ElementRuns(self.records, self.bases.size, self.weights, self.bases)


@dataclass(frozen=True, eq=False)
class CountedRuns:
    """Runs in force space.

    Parameters
    ----------
    records : tuple of ForceRecord
        Runs, with the samples that count.
    size : MotionSize
        Sizes of the motion over all runs.
    """

    records: tuple[ForceRecord, ...]
    size: MotionSize


@dataclass(frozen=True, eq=False)
class ElementRuns:
    """What the columns of a table are made of.

    Parameters
    ----------
    records : tuple of ForceRecord
        Runs, with the samples that count.
    size : MotionSize
        Sizes of the motion over all runs.
    weights : tuple of NoiseWeight
        Filter of each run.
    bases : ElementBases
        Splines and sizes.
    """

    records: tuple[ForceRecord, ...]
    size: MotionSize
    weights: tuple[NoiseWeight, ...]
    bases: ElementBases


def element_table(
    model: ElementModel,
    records: Sequence[ElementRecord],
    noise: FloatArray,
    constants: ClassConstants,
) -> ElementTable | None:
    """Gram table of all classes and laws; None where the records are too short.

    Parameters
    ----------
    model : ElementModel
        Baseline, library and scale.
    records : sequence of ElementRecord
        Runs.
    noise : ndarray, shape (n_runs,)
        Variance of the channel's noise by run.
    constants : ClassConstants
        Number of folds.

    Returns
    -------
    ElementTable or None
        Table with its columns.
    """
    runs = element_runs(model, records, noise, constants)
    return None if runs is None else table_of(model, runs, constants)


def element_runs(
    model: ElementModel,
    records: Sequence[ElementRecord],
    noise: FloatArray,
    constants: ClassConstants,
) -> ElementRuns | None:
    """Runs in force space with their filters; arguments as of :func:`element_table`."""
    counted = counted_runs(model, records, noise, constants)
    if counted is None:
        return None
    return runs_with_bases(counted, weights_of(model, counted, records, noise))


def counted_runs(
    model: ElementModel,
    records: Sequence[ElementRecord],
    noise: FloatArray,
    constants: ClassConstants,
) -> CountedRuns | None:
    """Runs in force space with the samples that count; arguments as of :func:`element_table`."""
    records = [with_all_lines(model, record) for record in records]
    own = force_records(model, records, noise)
    if not own:
        return None
    if not is_separable_from_time(own, constants.separable_from_drive):
        own = force_records(model, records, noise, finer=IN_TIME)
    size = motion_size(model, own, _variances(own, records, noise))
    if model.by_force:
        sliding = [while_sliding(record, size.rest_speed) for record in own]
        own = tuple(record for record in sliding if record is not None)
    n_blocks = sum(int(record.block.max()) + 1 for record in own)
    if n_blocks < constants.fewest_blocks:
        return None
    return CountedRuns(where_folds_overlap(own, constants.n_folds), size)


def runs_with_bases(counted: CountedRuns, weights: tuple[NoiseWeight, ...]) -> ElementRuns:
    """Counted runs with their filters, splines over their motion, and where memories start."""
    size = counted.size
    own = tuple(
        with_noise_of(record, weight.element)
        for record, weight in zip(counted.records, weights, strict=True)
    )
    bases = element_bases(own, size)
    return ElementRuns(with_starting_states(own, weights, bases), size, weights, bases)


def table_of(
    model: ElementModel,
    runs: ElementRuns,
    constants: ClassConstants,
    more: Sequence[GroupColumns[ForceRecord]] = (),
) -> ElementTable:
    """Products of all columns along some runs.

    Parameters
    ----------
    model : ElementModel
        Library.
    runs : ElementRuns
        Runs with their filters and bases.
    constants : ClassConstants
        Number of folds.
    more : sequence of GroupColumns
        Groups beside those of all classes.
    """
    own, bases = runs.records, runs.bases
    groups = (*group_columns(bases, side_line(bases, own)), *more)
    products = products_by_block(
        own,
        runs.weights,
        lambda record: columns_along(model, record, groups, runs.size),
        constants.n_folds,
    )
    table = _assembled(products, model)
    table = with_plain_stops(table, yields(bases.size).size)
    if model.states:
        # The rate of the force after a release holds the acceleration, which is the target.
        table = replace(table, ceiling=CLASS_GROUPS[FORCE_SURFACE] + CLASS_GROUPS[HYSTERESIS])
    return ElementTable(table, bases, groups, own, runs.weights, ClassScores(table, constants))


def _variances(
    own: Sequence[ForceRecord], records: Sequence[ElementRecord], noise: FloatArray
) -> list[float]:
    """Variance of the channel's noise in each of some runs."""
    by_name = {record.name: float(value) for record, value in zip(records, noise, strict=True)}
    return [by_name[record.record.name] for record in own]


def motion_size(
    model: ElementModel, own: Sequence[ForceRecord], variance: Sequence[float]
) -> MotionSize:
    """Sizes of the motion over all runs."""
    x, v, a = (
        np.concatenate([getattr(record, name)[record.counts] for record in own]) for name in "xva"
    )
    speed, acceleration = float(np.sqrt(np.mean(v**2))), float(np.sqrt(np.mean(a**2)))
    step = max(record.step for record in own)
    sigma = _CLEAR * float(np.sqrt(np.mean(variance))) if model.by_force else 0.0
    sigma_v = max(record.speed_error for record in own)
    rest = max(_REST_SPEED[0] * speed, 0.5 * step * acceleration, _BLURRED_SIGN * sigma_v)
    return MotionSize(
        low=float(x.min()),
        high=float(x.max()),
        speed=speed,
        acceleration=acceleration,
        rest_speed=min(rest, _REST_SPEED[1] * speed),
        least_yield=sigma,
    )


def weights_of(
    model: ElementModel,
    counted: CountedRuns,
    records: Sequence[ElementRecord],
    noise: FloatArray,
) -> tuple[NoiseWeight, ...]:
    """Filter of each run; under a force its element follows from the weighted baseline."""
    own = counted.records
    variance = _variances(own, records, noise)
    scale = model.scale
    known = (scale.m, scale.C1, scale.K1)
    element = known if model.by_force else None
    carried = [carried_noise(model, record.record) for record in own]
    of_channel = [max(value - more, 0.0) for value, more in zip(variance, carried, strict=True)]
    correlation_time = noise_correlation_time([record.record for record in own], of_channel)
    weights: list[NoiseWeight] = []
    for _ in range(_PASSES if model.by_force else 1):
        weights = [
            NoiseWeight(
                record.step,
                record.band_hz,
                element,
                value if model.by_force else channel,
                float(record.target[record.counts].std()),
                None
                if model.by_force
                else MotionNoise(record.record.drive_noise, known, record.record.cutoff_hz),
                correlation_time,
            )
            for record, value, channel in zip(own, variance, of_channel, strict=True)
        ]
        # At one frequency mass and spring are one unknown: regressors without noise leave the two
        # to rounding, and the element's own scale keeps what lies within physical bounds.
        if element is not None and not any(record.noise_motion for record in own):
            element = weighted_baseline(model, own, weights) or element
    return tuple(weights)


def side_line(bases: ElementBases, own: Sequence[ForceRecord]) -> FloatArray:
    """Straight line of every spline of the drive side on the drive, shape (2, n_side)."""
    side = np.concatenate([record.side[record.counts] for record in own])
    design = np.array([np.ones(side.size), side])
    return np.linalg.lstsq(design.T, bases.side(side).T, rcond=None)[0]


def _assembled(products: BlockProducts, model: ElementModel) -> GramTable:
    """Table of all classes."""
    return GramTable(
        gram=products.gram,
        n_base=products.layout.n_base,
        groups=products.layout.column_groups(),
        classes=CLASS_GROUPS,
        surface=FORCE_SURFACE,
        ceiling=CEILING,
        laws=laws_by_class(products.layout, model),
        floor=products.floor,
        folds=products.folds,
        scale=products.scale,
        beyond_laws={MEMORY: "curved_prony"},
        coupled_parts=frozenset({DISSIPATION, COUPLED_DAMPING}),
        uncoupled_part=DISSIPATION,
        products=PRODUCT_GROUPS,
    )


def with_plain_stops(table: GramTable, n_plain: int) -> GramTable:
    """Table whose first sliders, which do not bend, are a group of their own too."""
    columns = table.groups["stops"].columns[:n_plain]
    plain = ColumnGroup(columns, np.zeros((n_plain, n_plain)), is_nonnegative=True)
    return replace(table, groups={**table.groups, "plain_stops": plain}, plain=PLAIN_GROUPS)


def laws_by_class(layout: Layout, model: ElementModel) -> dict[str, tuple[LawColumns, ...]]:
    """Laws that lie in each class."""
    return {
        name: tuple(law for law in layout.laws if name in _classes_of(law.id, model))
        for name in CLASS_GROUPS
    }


def _classes_of(law: str, model: ElementModel) -> tuple[str, ...]:
    return (DISSIPATION, HYSTERESIS) if law == PRESLIDING else classes_of(law, model.measured)
