"""The Gram table of kind element: all columns through one filter, products by block."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from carrierflex.diagnosis.classes.columns import TIME_VARIATION, GroupColumns, relaxing_branches
from carrierflex.diagnosis.classes.constants import ClassConstants
from carrierflex.diagnosis.classes.gram_table import (
    GramTable,
    IntArray,
    LawColumns,
    TableRows,
)
from carrierflex.diagnosis.classes.held_out import (
    ClassModel,
    ClassScores,
    coefficients,
    squares_left,
)
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.element.columns import (
    DELAY,
    DRIVE_SIDE,
    PRESLIDING,
    ElementBases,
    MotionSize,
    classes_of,
    element_bases,
    group_columns,
    law_columns,
    stops_columns,
)
from carrierflex.diagnosis.element.force_records import (
    IN_TIME,
    ForceRecord,
    fold_of,
    force_records,
    has_one_frequency,
    is_separable_from_time,
    where_folds_overlap,
    while_sliding,
    with_noise_of_motion,
)
from carrierflex.diagnosis.element.model import ElementModel
from carrierflex.diagnosis.element.motion import with_all_lines
from carrierflex.diagnosis.element.noise import (
    MotionNoise,
    NoiseWeight,
    carried_noise,
    noise_correlation_time,
)
from carrierflex.diagnosis.element.records import ElementRecord
from carrierflex.diagnosis.element.smooth_loops import SmoothLoop
from carrierflex.identification.estimation.scaled_least_squares import normal_solution
from carrierflex.simulation.laws import (
    COUPLED_DAMPING,
    DISSIPATION,
    FORCE_SURFACE,
    HYSTERESIS,
    MEMORY,
    RESTORING_FORCE,
)

_SURFACE = ("f", "g", "jump", "presliding", "h", "surface")
#: Groups of columns of each class.
CLASS_GROUPS: dict[str, tuple[str, ...]] = {
    RESTORING_FORCE: ("f",),
    DISSIPATION: ("g", "jump", "presliding"),
    HYSTERESIS: ("stops",),
    MEMORY: ("prony",),
    DELAY: ("delay",),
    COUPLED_DAMPING: ("h",),
    FORCE_SURFACE: _SURFACE,
    TIME_VARIATION: ("time",),
    DRIVE_SIDE: ("side",),
}
#: Damping ``h(x) g(v)``, dry and quadratic, alone and beside a damping of the speed.
_PRODUCT_GROUPS: dict[str, tuple[str, ...]] = {
    "dry": ("dry_by_place",),
    "quadratic": ("quadratic_by_place",),
    "dry and g(v)": (*CLASS_GROUPS[DISSIPATION], "dry_by_place"),
    "quadratic and g(v)": (*CLASS_GROUPS[DISSIPATION], "quadratic_by_place"),
}
#: Speed below which the sign is uncertain: this share of the RMS at least, at most.
_REST_SPEED = (0.01, 0.3)
#: The sign of a speed with a normal error rises over this many of its standard deviations: the
#: slope of ``erf(v / (sqrt(2) sigma))`` at rest.
_BLURRED_SIGN = float(np.sqrt(0.5 * np.pi))
#: Standard deviations of noise that a yield deflection stands above.
_CLEAR = 3.0
#: Passes of baseline and weight.
_PASSES = 2
#: Columns, and samples of all of them, that are filtered together; samples of a long run.
_CHUNK, _CHUNK_SAMPLES, _LONG = 32, 2**20, 2**16
#: RMS of the first quarter of a period of a drive that is switched on, over that of all of it: of a
#: record cut from a longer one it is 0.6 at least where one sine drives it.
_STILL = 0.1
#: Ridge on columns of unit energy: keeps those singular that a run does not move.
_ROUNDING = 1e-10


#: Group of the column of a smooth loop.
LOOP = "loop"
#: Ratio of two levels that are one; levels that are meant to differ do so by a quarter and more.
_SAME_LEVEL = 1.1


@dataclass(frozen=True, eq=False)
class ElementRuns:
    """What the columns of a table are made of."""

    model: ElementModel  # Baseline and library
    records: tuple[ForceRecord, ...]  # Runs
    bases: ElementBases  # Splines and sizes


@dataclass(frozen=True, eq=False)
class ElementTable(ElementRuns):
    """Gram table with what its columns are."""

    table: GramTable  # Products
    groups: tuple[GroupColumns[ForceRecord], ...]  # Groups in the order of the table
    scores: ClassScores  # Held-out squares of the table, each made once
    loop: SmoothLoop | None = None  # Smooth loop among the columns of hysteresis
    #: Smooth loops once they were fitted, with the products of their columns, by the class beside
    #: them and whether they are curves; copies under other limits share them
    loops: dict[tuple[str, bool], tuple[SmoothLoop, GramTable]] = field(default_factory=dict)


def element_table(
    model: ElementModel,
    records: Sequence[ElementRecord],
    constants: ClassConstants,
) -> ElementTable | None:
    """Gram table of all classes and laws; None where the records are too short."""
    records = [with_all_lines(model, record) for record in records]
    runs = force_records(model, records)
    if not runs:
        return None
    if not is_separable_from_time(runs, constants.separable_from_drive):
        runs = force_records(model, records, finer=IN_TIME)
    size = _motion_size(model, runs)
    if model.by_force:
        sliding = [while_sliding(run, size.rest_speed) for run in runs]
        runs = tuple(run for run in sliding if run is not None)
    n_blocks = sum(int(run.block.max()) + 1 for run in runs)
    if n_blocks < constants.fewest_blocks:
        return None
    runs = _weighted(model, where_folds_overlap(runs, constants.n_folds))
    bases = element_bases(runs, size)
    return table_of(ElementRuns(model, _with_starting_states(runs, bases), bases), constants)


def table_of(
    runs: ElementRuns, constants: ClassConstants, more: Sequence[GroupColumns[ForceRecord]] = ()
) -> ElementTable:
    """Products of all columns along some runs, `more` groups beside those of all classes."""
    model, bases = runs.model, runs.bases
    groups = (*group_columns(bases, runs.records), *more)
    of_laws = [law for law in model.cards if law not in model.contained]

    def columns(run: ForceRecord, filtered: Callable[[FloatArray], FloatArray]) -> TableRows:
        table = group_columns_along(run, filtered, groups)
        for law in (*of_laws, PRESLIDING):
            table.add_law(law, law_columns(model, run, law, bases.size))
        return table

    products, laws = products_by_block(runs, columns, constants.n_folds)
    ceiling: tuple[str, ...] = (*_SURFACE, "stops", "prony", "delay", "time", "side")
    if model.states:
        # The rate of the force after a release holds the acceleration, which is the target.
        ceiling = (*_SURFACE, "stops")
    cards = model.cards
    columns_of_laws = [
        LawColumns(law, indices, len(cards[law].parameters) if law in cards else 2)
        for law, indices in laws.items()
    ]
    table = replace(
        products,
        classes=CLASS_GROUPS,
        surface=FORCE_SURFACE,
        ceiling=ceiling,
        laws={
            name: tuple(
                law for law in columns_of_laws if name in classes_of(law.id, model.measured)
            )
            for name in CLASS_GROUPS
        },
        coupled_parts=frozenset({DISSIPATION, COUPLED_DAMPING}),
        uncoupled_part=DISSIPATION,
        products=_PRODUCT_GROUPS,
        one_way=np.concatenate([np.empty(0, dtype=np.int64), *laws.get("backlash", ())]),
    )
    scores = ClassScores(table, constants)
    return ElementTable(model, runs.records, bases, table, groups, scores)


def is_one_curve(runs: ElementRuns) -> bool:
    """Whether all runs go round one curve of deflection and speed: one frequency at one level."""
    return has_one_frequency(runs.records) and has_one_level(runs)


def has_one_level(runs: ElementRuns) -> bool:
    """Whether every run is driven as hard: a law is then a curve through one point."""
    sizes = [float(run.drive[run.counts].std()) for run in runs.records]
    return max(sizes) <= _SAME_LEVEL * min(sizes)


def _motion_size(model: ElementModel, runs: Sequence[ForceRecord]) -> MotionSize:
    """Sizes of the motion over all runs."""
    x, v, a = (np.concatenate([getattr(run, name)[run.counts] for run in runs]) for name in "xva")
    speed, acceleration = float(np.sqrt(np.mean(v**2))), float(np.sqrt(np.mean(a**2)))
    step = max(run.step for run in runs)
    noise = float(np.sqrt(np.mean([run.record.noise for run in runs])))
    sigma_v = max(run.speed_error for run in runs)
    rest = max(_REST_SPEED[0] * speed, 0.5 * step * acceleration, _BLURRED_SIGN * sigma_v)
    return MotionSize(
        low=float(x.min()),
        high=float(x.max()),
        speed=speed,
        rest_speed=min(rest, _REST_SPEED[1] * speed),
        least_yield=_CLEAR * noise if model.by_force else 0.0,
    )


def _weighted(model: ElementModel, runs: Sequence[ForceRecord]) -> tuple[ForceRecord, ...]:
    """Runs with their filter; under a force its element follows from the weighted baseline."""
    scale = model.scale
    known = (scale.m, scale.C1, scale.K1)
    records = [run.record for run in runs]
    of_channel = [max(record.noise - carried_noise(model, record), 0.0) for record in records]
    correlation_time = noise_correlation_time(records, of_channel)
    weighted = []
    for run, channel in zip(runs, of_channel, strict=True):
        record = run.record
        carried = MotionNoise(record.drive_noise, known, record.cutoff_hz)
        weight = replace(
            run.weight,
            element=known if model.by_force else None,
            variance=record.noise if model.by_force else channel,
            force=float(run.target[run.counts].std()),
            carried=None if model.by_force else carried,
            correlation_time=correlation_time,
        )
        weighted.append(replace(run, weight=weight))
    # At one frequency mass and spring are one unknown: regressors without noise leave the two to
    # rounding, and the element's scale keeps what lies within physical bounds.
    if model.by_force and not any(run.noise_motion for run in runs):
        for _ in range(_PASSES):
            element = _weighted_baseline(model, weighted)
            if element is not None:
                weighted = [
                    replace(run, weight=replace(run.weight, element=element)) for run in weighted
                ]
    return tuple(map(with_noise_of_motion, weighted))


def _weighted_baseline(
    model: ElementModel, runs: Sequence[ForceRecord]
) -> tuple[float, float, float] | None:
    """m, C1, K1 by least squares through the filter; None where they are no element."""
    n = len(runs[0].base) + 1
    gram = np.zeros((n, n))
    for run in runs:
        rows = run.filtered(np.vstack([run.target, run.base]))
        gram += rows @ rows.T
    c = normal_solution(gram[1:, 1:], gram[1:, 0])
    m, first = (model.mass, 0) if model.mass is not None else (float(c[0]), 1)
    K1, C1 = float(c[first]), float(c[first + 1])
    # A drive that acts backwards turns the sign of all of them, and not the size of the stiffness.
    return (abs(m), max(float(C1 * np.sign(m)), 0.0), abs(K1)) if m * K1 > 0.0 else None


def group_columns_along(
    run: ForceRecord,
    filtered: Callable[[FloatArray], FloatArray],
    groups: Sequence[GroupColumns[ForceRecord]],
) -> TableRows:
    """Target, baseline and groups along a run, filtered, without laws."""
    table = TableRows(run.target[None], run.base, filtered)
    for group in groups:
        columns = group.columns(run)
        table.add_group(group.id, columns, group.penalty, is_nonnegative=group.is_nonnegative)
    return table


def products_by_block(
    runs: ElementRuns,
    columns: Callable[[ForceRecord, Callable[[FloatArray], FloatArray]], TableRows],
    n_folds: int,
) -> tuple[GramTable, Mapping[str, tuple[IntArray, ...]]]:
    """Table without classes of the columns of each run, and the places of the laws in it.

    `columns` gives those of a run through the filter that it is called with. Target, regressors
    and laws are of unit energy, each group as one.
    """
    n_blocks = sum(np.unique(run.block[run.counts]).size for run in runs.records)
    gram = np.empty(0)
    floors: list[float] = []
    folds: list[int] = []
    for number, run in enumerate(runs.records):
        table = columns(run, partial(_filtered_columns, run.weight))
        n_rows = sum(map(len, table.rows))
        if not gram.size:
            gram = np.empty((n_blocks, n_rows, n_rows))
        fold = fold_of(run, number, n_folds)
        floor = run.weight.floor()
        for block in np.unique(run.block[run.counts]):
            chosen = np.flatnonzero(run.block == block)
            span = slice(chosen[0], chosen[-1] + 1)
            inside = np.concatenate([rows[:, span] for rows in table.rows], dtype=np.float64)
            inside[:, run.block[span] != block] = 0.0
            np.matmul(inside, inside.T, out=gram[len(floors)])
            floors.append(floor * chosen.size)
            folds.append(int(fold[chosen[0]]))
        table.rows.clear()  # before those of the next run are made
    energy = gram.diagonal(axis1=1, axis2=2).sum(axis=0)
    for group in table.groups.values():
        energy[group.columns] = energy[group.columns].mean()
    scale = np.asarray(1.0 / np.sqrt(np.maximum(energy, 1e-300)))
    # In place: a table takes tens of megabytes, and a copy as long as its products.
    gram *= np.outer(scale, scale)
    products = GramTable(
        gram=gram,
        n_base=table.n_base,
        groups=table.groups,
        classes={},
        surface="",
        ceiling=(),
        laws={},
        floor=np.array(floors) * scale[0] ** 2,
        folds=np.array(folds),
        scale=scale,
    )
    return products, table.laws


def _filtered_columns(weight: NoiseWeight, raw: FloatArray) -> FloatArray:
    """Columns through the filter of their run, shape (n_columns, n)."""
    # A long run's in single precision: its rounding is white, and 1e-14 of a column's energy.
    n = raw.shape[-1]
    rows = np.empty(raw.shape, np.float32 if n > _LONG else np.float64)
    chunk = max(1, min(_CHUNK, _CHUNK_SAMPLES // n))
    for first in range(0, len(raw), chunk):
        some = raw[first : first + chunk].astype(rows.dtype, copy=False)
        rows[first : first + chunk] = weight.filtered(some)
    return rows


def _with_starting_states(
    runs: Sequence[ForceRecord], bases: ElementBases
) -> tuple[ForceRecord, ...]:
    """Runs, each with the start of its sliders and branches that leaves less of the force."""
    # Sliders and branches are those of all runs together: a run by itself, in which few of them
    # slip, shares its force out among the others whichever way it began.
    may_be_relaxed = [_is_switched_on(run) for run in runs]
    if not any(may_be_relaxed):
        return tuple(runs)
    starts = [
        [_products(run, bases, from_rest=start) for start in (False, True)[: 1 + may_be]]
        for run, may_be in zip(runs, may_be_relaxed, strict=True)
    ]
    relaxed = _best_starts(starts, len(runs[0].base))
    return tuple(replace(run, from_rest=start) for run, start in zip(runs, relaxed, strict=True))


def _best_starts(starts: Sequence[Sequence[FloatArray]], n_base: int) -> list[bool]:
    """Whether each run begins relaxed: all that may or none, then one by one while it gains."""

    def remaining(relaxed: Sequence[bool]) -> float:
        """Square left of all runs together: a difference of sums would leave rounding alone."""
        chosen = [products[start] for products, start in zip(starts, relaxed, strict=True)]
        return _remaining_square(np.asarray(np.sum(chosen, axis=0)), n_base)

    may_be = [len(products) > 1 for products in starts]
    best = min((may_be, [False] * len(starts)), key=remaining)
    for number in np.flatnonzero(may_be).tolist():
        other = [*best[:number], not best[number], *best[number + 1 :]]
        best = min((best, other), key=remaining)
    return best


def _is_switched_on(run: ForceRecord) -> bool:
    """Whether the drive of a run begins in it: a quarter of its first period is all but still."""
    x, v = run.x[run.counts], run.v[run.counts]
    # One sample may be all that is left of a run where the folds overlap.
    if x.size < 2:
        return False
    drive = run.record.drive - run.record.drive.mean()
    omega = float(v.std() / x.std())
    first = drive[: max(int(0.5 * np.pi / (omega * run.step)), 2)]
    return bool(np.sqrt(np.mean(first**2)) < _STILL * drive.std())


def _products(run: ForceRecord, bases: ElementBases, *, from_rest: bool) -> FloatArray:
    """Products of target, baseline and memory of a run, shape (n, n)."""
    memory = np.concatenate(
        [
            stops_columns(run.x, bases.size, from_rest=from_rest),
            relaxing_branches(run.x, bases.taus, run.step, from_rest=from_rest),
        ]
    )
    rows = run.filtered(np.concatenate([run.target[None], run.base, memory]))
    return np.asarray(rows @ rows.T)


def _remaining_square(products: FloatArray, n_base: int) -> float:
    """Square that baseline and memory, of weights of at least zero, leave of the force."""
    square = float(products[0, 0])
    size = np.sqrt(np.maximum(np.diag(products), np.finfo(float).tiny))
    scaled = products / np.outer(size, size)
    n = len(products) - 1
    model = ClassModel(np.arange(1, n + 1), _ROUNDING * np.eye(n), np.arange(n) >= n_base)
    return square * float(squares_left(scaled, coefficients(scaled, model)))
