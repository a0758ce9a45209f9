"""The Gram table of runs that stand, where constants have changed some of their columns.

Columns that are equal to the last bit to the usual ones keep their products and their scale.
Others go through the filter, and their products with all columns are made again.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, product

import numpy as np
from numpy.typing import NDArray

from carrierflex.blind_check.sensitivity.sameness import is_same
from carrierflex.diagnosis.classes.constants import ClassConstants
from carrierflex.diagnosis.classes.fits import stretches
from carrierflex.diagnosis.classes.gram_table import GramTable, IntArray
from carrierflex.diagnosis.classes.held_out import ClassScores
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.element.classes.columns import group_columns
from carrierflex.diagnosis.element.classes.laws import yields
from carrierflex.diagnosis.element.classes.motion.force_records import ForceRecord
from carrierflex.diagnosis.element.classes.table import (
    ElementRuns,
    ElementTable,
    laws_by_class,
    side_line,
    with_plain_stops,
)
from carrierflex.diagnosis.element.classes.table_columns import (
    Layout,
    columns_along,
    filtered_columns,
)
from carrierflex.diagnosis.element.classes.weighting import NoiseWeight
from carrierflex.diagnosis.element.model import ElementModel

#: Columns by name of their part of the table: "base" is the target and the baseline.
Parts = dict[str, FloatArray]


@dataclass(frozen=True, eq=False)
class KnownColumns:
    """Columns of a table along each of its runs.

    Parameters
    ----------
    raw, filtered : tuple of dict
        Columns of each part by run, before the filter and, where they count, after it.
    responses : tuple of ndarray
        Target and baseline of each run through its filter: what a filter is known by.
    """

    raw: tuple[Parts, ...]
    filtered: tuple[Parts, ...]
    responses: tuple[FloatArray, ...]


def known_columns(model: ElementModel, runs: ElementRuns) -> KnownColumns:
    """All columns of the table of some runs."""
    raw, _ = _raw_parts(model, runs)
    filtered = tuple(
        _filtered_parts(parts, runs, number, tuple(parts)) for number, parts in enumerate(raw)
    )
    return KnownColumns(raw, filtered, _responses(raw, runs.weights))


def has_same_filters(known: KnownColumns, weights: Sequence[NoiseWeight]) -> bool:
    """Whether filters still do to target and baseline of each run what they did."""
    return is_same(known.responses, _responses(known.raw, weights))


def _responses(raw: Sequence[Parts], weights: Sequence[NoiseWeight]) -> tuple[FloatArray, ...]:
    return tuple(weight.filtered(parts["base"]) for parts, weight in zip(raw, weights, strict=True))


def table_beside(
    usual: ElementTable,
    known: KnownColumns,
    model: ElementModel,
    runs: ElementRuns,
    constants: ClassConstants,
) -> tuple[ElementTable, frozenset[str]] | None:
    """Table of the usual runs and filters with the columns as they are now.

    Parameters
    ----------
    usual : ElementTable
        Usual table.
    known : KnownColumns
        Its columns.
    model : ElementModel
        Library.
    runs : ElementRuns
        Usual runs and filters; bases, and where memories start, may be others.
    constants : ClassConstants
        Limits.

    Returns
    -------
    tuple of (ElementTable, frozenset of str) or None
        The usual one where no column has changed, and the groups whose columns have not; None where
        target or baseline have.
    """
    raw, layout = _raw_parts(model, runs)
    changed = [name for name in raw[0] if not is_same([p[name] for p in raw], _of(known.raw, name))]
    if "base" in changed or len(raw[0]) != len(known.raw[0]):
        return None
    if not changed:
        return usual, frozenset(usual.table.groups)
    table = _with_changed(usual.table, known, (raw, layout), runs, changed)
    n_plain = yields(runs.size).size
    table = with_plain_stops(replace(table, laws=laws_by_class(layout, model)), n_plain)
    groups = tuple(group for group, _ in layout.groups)
    scores = ClassScores(table, constants)
    kept = frozenset(
        group.id
        for group in groups
        if group.id not in changed and is_same(group.penalty, usual.table.groups[group.id].penalty)
    )
    made = ElementTable(table, runs.bases, groups, runs.records, runs.weights, scores)
    return made, kept


def _of(runs: Sequence[Parts], name: str) -> list[FloatArray]:
    return [parts[name] for parts in runs]


def _raw_parts(model: ElementModel, runs: ElementRuns) -> tuple[tuple[Parts, ...], Layout]:
    """Columns of every run by part, and where they stand."""
    groups = group_columns(runs.bases, side_line(runs.bases, runs.records))
    found = [columns_along(model, record, groups, runs.size) for record in runs.records]
    layout = found[0][1]
    names = ("base", *(group.id for group in groups), *(law.id for law in layout.laws))
    return tuple(
        dict(zip(names, (np.concatenate(rows[:2]), *rows[2:]), strict=True)) for rows, _ in found
    ), layout


def _filtered_parts(parts: Parts, runs: ElementRuns, number: int, names: Sequence[str]) -> Parts:
    """Some parts of a run's columns through its filter, at the samples that count."""
    rows = np.concatenate([parts[name] for name in names])
    rows = filtered_columns(rows, runs.weights[number])[:, runs.records[number].counts]
    ends = np.cumsum([len(parts[name]) for name in names])
    return dict(zip(names, np.split(rows, ends[:-1]), strict=True))


def _with_changed(
    usual: GramTable,
    known: KnownColumns,
    made: tuple[tuple[Parts, ...], Layout],
    runs: ElementRuns,
    changed: Sequence[str],
) -> GramTable:
    """Usual table with other columns of some parts in the place of its own."""
    raw, layout = made
    places, before = _places(raw[0]), _places(known.raw[0])
    n = sum(map(len, raw[0].values()))
    others = np.concatenate([places[name] for name in changed])
    products = _products_of_changed(known, raw, runs, changed)
    energy = np.ones(n)
    energy[others] = products.sum(axis=0)[np.arange(others.size), others]
    scale = layout.scale(energy)
    kept = [name for name in places if name not in changed]
    new = np.concatenate([places[name] for name in kept])
    old = np.concatenate([before[name] for name in kept])
    scale[new] = usual.scale[old]
    products *= scale[others, None] * scale
    gram = np.empty((len(usual.gram), n, n))
    for (rows, old_rows), (columns, old_columns) in product(stretches(new, old), repeat=2):
        gram[:, rows, columns] = usual.gram[:, old_rows, old_columns]
    gram[:, others] = products
    gram[:, :, others] = products.transpose(0, 2, 1)
    return replace(usual, gram=gram, scale=scale, groups=layout.column_groups())


def _products_of_changed(
    known: KnownColumns, raw: Sequence[Parts], runs: ElementRuns, changed: Sequence[str]
) -> FloatArray:
    """Products of changed columns with all columns by block, shape (n_blocks, n_changed, n)."""
    found = []
    for number, record in enumerate(runs.records):
        parts = {**known.filtered[number], **_filtered_parts(raw[number], runs, number, changed)}
        rows = np.concatenate([parts[name] for name in raw[number]])
        others = np.concatenate([parts[name] for name in changed])
        for inside in _inside_blocks(record):
            found.append(others[:, inside] @ rows[:, inside].T)
    return np.array(found)


def _inside_blocks(record: ForceRecord) -> list[NDArray[np.bool_]]:
    """Which of the samples that count lie in each block."""
    block = record.block[record.counts]
    return [block == number for number in np.unique(block)]


def _places(parts: Parts) -> dict[str, IntArray]:
    """Places of the columns of every part."""
    ends = np.cumsum([0, *map(len, parts.values())])
    return {
        name: np.arange(first, last)
        for name, (first, last) in zip(parts, pairwise(ends.tolist()), strict=True)
    }
