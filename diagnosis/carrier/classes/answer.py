"""Class of the missing effect of a carrier: table by block, decision, the laws nearest to it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from operator import itemgetter

import numpy as np

from carrierflex.diagnosis.carrier.classes.catalogue import (
    CLASS_OF_LAW,
    OFFSET,
    SENSOR_EFFECTS,
    TIME,
    UNDETERMINED,
    class_id,
    classes_holding,
    classes_of_laws,
    shapes,
)
from carrierflex.diagnosis.carrier.classes.class_rows import (
    NONE,
    ClassRows,
    class_rows,
    torque_levels,
)
from carrierflex.diagnosis.carrier.classes.measured_laws import VisitedLoads, law_of_carrier_class
from carrierflex.diagnosis.carrier.model import CarrierModel
from carrierflex.diagnosis.carrier.records.sums import CarrierSums
from carrierflex.diagnosis.carrier.signature_rows import (
    EffectRows,
    column_products,
    contained_channels,
    effect_rows,
    rows_at,
    segments_of,
)
from carrierflex.diagnosis.classes.answer import answer_of
from carrierflex.diagnosis.classes.constants import ClassConstants
from carrierflex.diagnosis.classes.gram_table import ColumnGroup, GramTable, IntArray, LawColumns
from carrierflex.diagnosis.classes.held_out import ClassScores
from carrierflex.diagnosis.classes.law_sets import law_sets
from carrierflex.diagnosis.classes.results import ClassAnswer
from carrierflex.diagnosis.classes.shape_decision import (
    FURTHER_CAUSE,
    decide_by_shape,
    rivals_of,
    shape_of,
    way_of,
)
from carrierflex.diagnosis.classes.shares import Shares
from carrierflex.diagnosis.comparison.problem import Effects, FloatArray
from carrierflex.identification.campaign.campaign import Campaign

#: Conditions from which whole ones are held out; blocks of a run, and of all runs together, that
#: the table keeps, and folds of blocks where conditions are fewer.
_FEWEST_CONDITIONS = 3
_BLOCKS_A_RUN = 4
_MOST_BLOCKS = 96
#: The products of all blocks take so much memory [bytes], but blocks stay enough to tell how far a
#: score varies from one to the next.
_MOST_MEMORY = 150e6
_FEWEST_BLOCKS = 24
#: Fewer torques leave open what a class follows.
_FEWEST_TORQUES = 3
#: Directions of a run's own parameters below this share of the largest are rounding.
_ROUNDING = 1e-10
_TORQUES_NOTE = "fewer than three torques: what a class follows cannot be determined"
_OFFSET_NOTE = "the offset of every run is fitted to it: whether one is missing is not compared"
#: Penalties that the folds choose from: down to none for gaps of hundreds of floors.
_RIDGES = (1e-12, 1e-10, 1e-8, 1e-6, 1e-4, 1e-2)
_PAIR_RIDGES = (1e-2, 1.0)
_CONSTANTS = ClassConstants(ridges=_RIDGES, pair_ridges=_PAIR_RIDGES, second_cause=FURTHER_CAUSE)


def block_of_each_segment(records: CarrierSums, n_columns: int) -> IntArray:
    """Block of the table of every segment, numbered as they come; as many as are kept.

    Neighbouring segments of a run, or, of more runs than blocks, neighbouring runs of a condition.

    Parameters
    ----------
    records : CarrierSums
        Segments, and the runs they are of.
    n_columns : int
        Columns of the table: every block keeps the product of any two of them.

    Returns
    -------
    ndarray of int, shape (n_segments,)
        Block of each segment.
    """
    n_runs = int(records.run_of_segment.max()) + 1
    n_blocks = _most_blocks(n_columns)
    if n_runs > n_blocks:
        return _numbered(_blocks_of_runs(records, n_runs, n_blocks)[records.run_of_segment])
    most = max(1, min(_BLOCKS_A_RUN, n_blocks // n_runs))
    blocks: list[IntArray] = []
    first = 0
    for run in range(n_runs):
        n_segments = int(np.count_nonzero(records.run_of_segment == run))
        parts = np.array_split(np.arange(n_segments), min(most, n_segments))
        blocks += [np.full(part.size, first + k) for k, part in enumerate(parts)]
        first += len(parts)
    return np.concatenate(blocks)


def _most_blocks(n_columns: int) -> int:
    """Most blocks whose products memory holds."""
    of_a_block = n_columns**2 * np.dtype(float).itemsize
    return int(np.clip(_MOST_MEMORY // of_a_block, _FEWEST_BLOCKS, _MOST_BLOCKS))


def _blocks_of_runs(records: CarrierSums, n_runs: int, most: int) -> IntArray:
    """Block of every run: each condition has its share of them, one at least."""
    first = np.searchsorted(records.run_of_segment, np.arange(n_runs))
    conditions = np.array([records.segments[p].condition for p in first.tolist()])
    blocks = np.empty(n_runs, dtype=np.int64)
    n_blocks = 0
    for condition in dict.fromkeys(conditions.tolist()):
        runs = np.flatnonzero(conditions == condition)
        parts = np.array_split(runs, max(1, most * runs.size // n_runs))
        for number, part in enumerate(parts):
            blocks[part] = n_blocks + number
        n_blocks += len(parts)
    return blocks


def _numbered(labels: IntArray) -> IntArray:
    """Labels as numbers in the order in which they first come."""
    _, first, places = np.unique(labels, return_index=True, return_inverse=True)
    rank = np.empty(first.size, dtype=np.int64)
    rank[np.argsort(first)] = np.arange(first.size)
    return np.asarray(rank[places])


def fold_of_each_block(conditions: Sequence[str], runs: IntArray, *, is_told: bool) -> IntArray:
    """Whole conditions, or every fourth block where conditions or torques are too few.

    Without the condition of one of two torques nothing tells what follows torque from what does
    not: only amplitudes at the torques that were fitted can be predicted.

    Parameters
    ----------
    conditions : sequence of str
        Condition of each block.
    runs : ndarray of int, shape (n_blocks,)
        Run with which each block begins.
    is_told : bool
        Whether the records hold torques enough to tell what a class follows.

    Returns
    -------
    ndarray of int, shape (n_blocks,)
        Fold in which each block is held out.
    """
    if holds_out_conditions(conditions, is_told=is_told):
        names = list(dict.fromkeys(conditions))
        return np.array([names.index(name) for name in conditions])
    first = np.searchsorted(runs, runs)
    return np.asarray((np.arange(runs.size) - first + runs) % _BLOCKS_A_RUN)


def holds_out_conditions(conditions: Sequence[str], *, is_told: bool) -> bool:
    """Whether each fold is a whole condition; the arguments are those of the folds."""
    return len(set(conditions)) >= _FEWEST_CONDITIONS and is_told


@dataclass(frozen=True, eq=False)
class CarrierTable:
    """Table with what its columns are.

    Parameters
    ----------
    table : GramTable
        Products.
    sizes : mapping of str to int
        Columns of each class.
    visited : VisitedLoads
        Loads of the records, over which amplitudes are tabulated.
    """

    table: GramTable
    sizes: Mapping[str, int]
    visited: VisitedLoads


@dataclass(frozen=True, eq=False)
class _Places:
    """Where the rows stand in the table.

    Target, what all runs share of the baseline, laws, classes; behind them the offset of one run
    and its parameters, those of every run at the same places.

    Parameters
    ----------
    of_row : ndarray of int
        Place of each row of target, baseline and laws.
    n_base : int
        Parameters of the baseline that all runs share.
    classes : slice
        Rows of the classes.
    own : slice
        Offset and parameters of one run.
    """

    of_row: IntArray
    n_base: int
    classes: slice
    own: slice


def carrier_table(
    model: CarrierModel,
    campaign: Campaign,
    records: CarrierSums,
    noise: FloatArray,
    candidates: Effects,
    base: FloatArray,
) -> CarrierTable:
    """Table of all classes of a campaign.

    Parameters
    ----------
    model : CarrierModel
        Weights of baseline and laws.
    campaign : Campaign
        Records.
    records : CarrierSums
        Segments and loads.
    noise : ndarray, shape (n_channels,)
        Variance of the noise [m²].
    candidates : tuple of str
        Laws beside the baseline.
    base : ndarray, shape (p,)
        Parameters of the fitted baseline.
    """
    scale = _load_scale(model)
    means = _mean_loads(model, records) / scale
    n_torques = torque_levels(means[:, 0])
    of_effects = effect_rows(model, candidates, base)
    of_classes = class_rows(campaign.channels, model.source.rig, means, n_torques)
    places = _places(model, of_effects, of_classes)
    block_of_segment = block_of_each_segment(records, places.own.start)
    gram = _products(model, campaign, records, of_effects, of_classes, places, block_of_segment)
    n_blocks = len(gram)
    by_segment = records.counts @ noise
    floor = np.array([by_segment[block_of_segment == b].sum() for b in range(n_blocks)])
    first = np.unique(block_of_segment, return_index=True)[1]
    conditions = [records.segments[p].condition for p in first.tolist()]
    is_told = n_torques >= _FEWEST_TORQUES
    folds = fold_of_each_block(conditions, records.run_of_segment[first], is_told=is_told)
    groups = _groups(of_effects, of_classes, places)
    options = _options(model, is_told=is_told)
    laws = _laws(model, of_effects, places)
    visited = VisitedLoads(
        records.loads,
        scale,
        n_torques,
        tuple(dict.fromkeys(channel.quantity for channel in campaign.channels)),
        model.source.rig.n_planets,
        float(campaign.rig["sensor_radius"]),
        {name: own.weights for name, own in of_classes.groups.items()},
    )
    own = _assembled(gram, places.n_base, groups, options, laws, floor, folds, visited)
    has_conditions = holds_out_conditions(conditions, is_told=is_told)
    return replace(own, table=replace(own.table, has_whole_conditions=has_conditions))


def _mean_loads(model: CarrierModel, records: CarrierSums) -> FloatArray:
    """Mean torque [N m] and radial load [N] of every run, shape (n_runs, 3)."""
    runs = range(len(model.runs))
    return np.array([records.loads[records.run_of_revolution == r].mean(axis=0) for r in runs])


def _load_scale(model: CarrierModel) -> FloatArray:
    """Nominal torque [N m], and the largest radial load [N] twice."""
    source = model.source
    return np.array([source.rig.nominal_torque, source.largest_load, source.largest_load])


def _options(model: CarrierModel, *, is_told: bool) -> dict[str, tuple[str, ...]]:
    """Groups of columns of every class, the simplest of a shape first."""
    found: dict[str, tuple[str, ...]] = {}
    for shape in shapes():
        if shape.id == OFFSET:
            # Every run has its own offset: what follows the loads is in it.
            found[f"{OFFSET}/{TIME}"] = (f"{OFFSET}:{TIME}",)
            continue
        sets = shape.sets if is_told else (tuple(shape.columns),)
        for own in sets:
            groups = tuple(f"{shape.id}:{dependence}" for dependence in own)
            found.setdefault(class_id(shape.id, own, is_told=is_told), groups)
    for effect, name in SENSOR_EFFECTS.items():
        if effect not in model.contained:
            found[f"{name}/{NONE}"] = (f"{name}:{NONE}",)
    return found


def _places(model: CarrierModel, effects: EffectRows, classes: ClassRows) -> _Places:
    parameters = model.parameters((), contained_channels(model))
    is_own = np.array([False, *(p.run is not None for p in parameters)])
    is_own = np.append(is_own, np.zeros(len(effects.owners), dtype=bool))
    of_row = np.cumsum(~is_own) - 1
    first = int(np.count_nonzero(~is_own))
    n_own = 0
    for run in model.runs:
        numbers = [1 + k for k, p in enumerate(parameters) if p.run == run]
        of_row[numbers] = first + classes.size + 1 + np.arange(len(numbers))
        n_own = max(n_own, len(numbers))
    end = first + classes.size
    n_base = first - 1 - len(effects.owners)
    return _Places(of_row, n_base, slice(first, end), slice(end, end + 1 + n_own))


def _products(
    model: CarrierModel,
    campaign: Campaign,
    records: CarrierSums,
    effects: EffectRows,
    classes: ClassRows,
    places: _Places,
    block_of_segment: IntArray,
) -> FloatArray:
    """Products of the rows by block, the parameters of each run fitted to the run and taken out."""
    n_blocks, size = int(block_of_segment.max()) + 1, places.own.stop
    waves = slice(places.classes.start, places.own.start + 1)
    result = np.zeros((n_blocks, places.own.start, places.own.start))
    before = np.zeros(places.own.start)
    for run, pieces in groupby(segments_of(model, campaign, records), key=itemgetter(0)):
        of_run = classes.of_run(run)
        blocks = np.unique(block_of_segment[records.run_of_segment == run])
        own_gram = np.zeros((blocks.size, size, size))
        for _, channel, segment, block in pieces:
            numbers, of_columns = rows_at(effects.groups, run, channel, len(block.rows))
            of_features = of_run[:, channel]
            features = model.source.flexible_rows(block.inputs)
            columns, flexible, mixed = column_products(block, features)
            own = places.of_row[numbers]
            cross = of_columns @ mixed @ of_features.T
            part = own_gram[np.searchsorted(blocks, block_of_segment[segment])]
            part[np.ix_(own, own)] += of_columns @ columns @ of_columns.T
            part[own, waves] += cross
            part[waves, own] += cross.T
            part[waves, waves] += of_features @ flexible @ of_features.T
        before += np.diag(own_gram.sum(axis=0))[: places.own.start]
        result[blocks] += _without_own(own_gram, places.own)
    # What the runs' own parameters take whole is rounding of either sign.
    empty = np.diag(result.sum(axis=0)) <= _ROUNDING * before
    result[:, empty] = 0.0
    result[:, :, empty] = 0.0
    return result


def _without_own(gram: FloatArray, own: slice) -> FloatArray:
    """Products of one run by block once its own parameters, the last ones, are fitted to it."""
    whole = gram.sum(axis=0)
    fit = whole[:, own] @ np.linalg.pinv(whole[own, own], rcond=_ROUNDING)
    left = []
    for block in gram:
        taken = fit @ block[own]
        left.append(block + (fit @ block[own, own] @ fit.T - taken - taken.T))
    return np.array(left)[:, : own.start, : own.start]


def _laws(
    model: CarrierModel, effects: EffectRows, places: _Places
) -> dict[str, tuple[LawColumns, ...]]:
    """Columns of every law by frame and pattern; a user's effect under the empty name."""
    variants: dict[str, dict[tuple[float, ...], list[int]]] = {}
    first = 1 + effects.n_base
    for k, (law, variant) in enumerate(zip(effects.owners, effects.variants, strict=True)):
        by_variant = variants.setdefault(law, {})
        by_variant.setdefault(variant, []).append(int(places.of_row[first + k]))
    laws: dict[str, tuple[LawColumns, ...]] = {}
    for law, by_variant in variants.items():
        columns = tuple(np.array(own) for own in by_variant.values())
        shape = model.class_of_measured.get(law, CLASS_OF_LAW.get(law, ""))
        own = LawColumns(law, columns, len(model.effects[law].parameters))
        laws[shape] = (*laws.get(shape, ()), own)
    return laws


def _groups(
    effects: EffectRows, classes: ClassRows, places: _Places
) -> dict[str, tuple[IntArray, FloatArray]]:
    """Columns of every group, and their penalty."""
    found = {
        name: (places.classes.start + np.arange(place.start, place.stop), penalty)
        for name, (place, penalty) in classes.places.items()
    }
    owners = np.array(effects.owners)
    for law, name in SENSOR_EFFECTS.items():
        own = places.of_row[1 + effects.n_base + np.flatnonzero(owners == law)]
        if own.size:
            found[f"{name}:{NONE}"] = (own, np.eye(own.size))
    return found


def _assembled(
    gram: FloatArray,
    n_base: int,
    groups: Mapping[str, tuple[IntArray, FloatArray]],
    options: Mapping[str, tuple[str, ...]],
    laws: Mapping[str, tuple[LawColumns, ...]],
    floor: FloatArray,
    folds: IntArray,
    visited: VisitedLoads,
) -> CarrierTable:
    """Table of unit energies, each group scaled as one."""
    energy = np.diag(gram.sum(axis=0)).copy()
    for columns, _ in groups.values():
        energy[columns] = energy[columns].max()
    scale = 1.0 / np.sqrt(np.where(energy > 0.0, energy, 1.0))
    classes = {name: own for name, own in options.items() if set(own) <= set(groups)}
    of_user = laws.get("", ())
    # In place: the products of all blocks are the table's alone.
    gram *= np.outer(scale, scale)
    table = GramTable(
        gram=gram,
        n_base=n_base,
        groups={name: ColumnGroup(*group) for name, group in groups.items()},
        classes=classes,
        surface="",
        ceiling=tuple(dict.fromkeys(group for own in classes.values() for group in own)),
        laws={name: (*laws.get(shape_of(name), ()), *of_user) for name in classes},
        floor=floor * scale[0] ** 2,
        folds=folds,
        scale=scale,
    )
    sizes = {name: sum(groups[group][0].size for group in own) for name, own in classes.items()}
    return CarrierTable(table, sizes, visited)


def carrier_class_table(
    model: CarrierModel,
    campaign: Campaign,
    records: CarrierSums,
    noise: FloatArray,
    candidates: Effects,
    base: FloatArray,
) -> CarrierTable | None:
    """Table of classes and laws, :func:`carrier_table`; None where the blocks are too few."""
    if len(records.segments) < _CONSTANTS.fewest_blocks:
        return None
    of_all_runs = tuple(name for name in candidates if not model.effects[name].per_run)
    return carrier_table(model, campaign, records, noise, of_all_runs, base)


def carrier_class_answer(
    model: CarrierModel, own: CarrierTable, candidates: Effects
) -> ClassAnswer:
    """Class of the missing effect.

    Parameters
    ----------
    model : CarrierModel
        Baseline and library.
    own : CarrierTable
        Table of classes and laws.
    candidates : tuple of str
        Laws on trial.
    """
    by_run = tuple(name for name in candidates if model.effects[name].per_run)
    scores = ClassScores(own.table, _CONSTANTS)
    shares = Shares(scores.of(()).squares, own.table.floor, _CONSTANTS)
    decision = decide_by_shape(scores, shares, own.sizes, chooses_anew=True)
    is_open = any(way_of(name) == UNDETERMINED for name in own.sizes)
    answer = answer_of(
        scores,
        shares,
        decision,
        rivals_of(scores, decision, own.sizes),
        shape_of=lambda scores, name, held, law: (
            None,
            law_of_carrier_class(scores, name, held, own.visited),
        ),
        note="; ".join(_notes(model, is_open=is_open)),
    )
    # Laws with values by run say nothing of a condition that is held out.
    classes_of_law = {**answer.classes_of_law, **classes_holding(by_run)}
    ordered = classes_of_laws(classes_of_law, is_told=not is_open)
    laws = law_sets(scores, shares, (decision.classes, *decision.ties), candidates)
    return replace(
        answer,
        classes_of_law=ordered,
        same_scores=True,
        law_sets=(*laws, *_with_values_by_run(laws, by_run)),
    )


def _with_values_by_run(laws: Sequence[Effects], by_run: Effects) -> list[Effects]:
    """Laws with a value for every run, no columns of the table: alone and beside others."""
    return [tuple(sorted((*others, law))) for law in by_run for others in ((), *laws[:1])]


def _notes(model: CarrierModel, *, is_open: bool) -> list[str]:
    """What the records cannot say."""
    notes = [_TORQUES_NOTE] if is_open else []
    if not any(model.effects[name].per_run for name in model.contained):
        notes.append(_OFFSET_NOTE)
    return notes
