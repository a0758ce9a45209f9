"""Columns of the Gram table of an element along a run, in their order, and through its filter."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from carrierflex.diagnosis.classes.columns import GroupColumns
from carrierflex.diagnosis.classes.gram_table import ColumnGroup, IntArray, LawColumns
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.element.classes.laws import (
    MotionSize,
    law_columns,
    presliding_columns,
)
from carrierflex.diagnosis.element.classes.motion.force_records import ForceRecord, fold_of
from carrierflex.diagnosis.element.classes.weighting import NoiseWeight
from carrierflex.diagnosis.element.model import ElementModel

PRESLIDING = "dahl_friction"
#: Columns filtered together, to bound the memory.
_CHUNK = 32


@dataclass(frozen=True, eq=False)
class Layout:
    """Which rows of the table are what.

    Parameters
    ----------
    n_base : int
        Regressors of the baseline, after the target.
    groups : tuple of (GroupColumns, slice)
        Groups with their places.
    laws : tuple of LawColumns
        Laws with theirs.
    """

    n_base: int
    groups: tuple[tuple[GroupColumns[ForceRecord], slice], ...]
    laws: tuple[LawColumns, ...]

    def scale(self, energy: FloatArray) -> FloatArray:
        """Factor of each column: target, regressors and laws of unit energy, each group as one.

        Parameters
        ----------
        energy : ndarray, shape (n,)
            Sum of squares of each column.
        """
        shared = energy.copy()
        for _, place in self.groups:
            shared[place] = shared[place].mean()
        return np.asarray(1.0 / np.sqrt(np.maximum(shared, 1e-300)))

    def column_groups(self) -> dict[str, ColumnGroup]:
        """Groups as the table has them."""
        return {
            group.id: ColumnGroup(
                np.arange(place.start, place.stop), group.penalty, group.is_nonnegative
            )
            for group, place in self.groups
        }


def columns_along(
    model: ElementModel,
    own: ForceRecord,
    groups: Sequence[GroupColumns[ForceRecord]],
    size: MotionSize,
) -> tuple[list[FloatArray], Layout]:
    """Target, baseline, groups and laws along a run, and where they stand.

    Parameters
    ----------
    model : ElementModel
        Library.
    own : ForceRecord
        Run.
    groups : sequence of GroupColumns
        Groups.
    size : MotionSize
        Sizes of the motion over all runs.

    Returns
    -------
    tuple of (list of ndarray, Layout)
        Columns of the target, of the baseline, of each group and of each law, shape (n_columns, n)
        each.
    """
    rows, layout = group_columns_along(own, groups)
    first = sum(map(len, rows))
    known = []
    for law in model.cards:
        if law not in model.contained:
            shapes = law_columns(model, own, law, size)
            known.append(_law(rows, first, law, shapes, model))
            first += len(rows[-1])
    shapes = presliding_columns(own, size)[:, None]
    known.append(_law(rows, first, PRESLIDING, shapes, model))
    return rows, replace(layout, laws=tuple(known))


def group_columns_along(
    own: ForceRecord, groups: Sequence[GroupColumns[ForceRecord]]
) -> tuple[list[FloatArray], Layout]:
    """Target, baseline and groups along a run, as :func:`columns_along` without laws."""
    rows = [own.target[None], own.base]
    first = 1 + len(own.base)
    places = []
    for group in groups:
        rows.append(group.columns(own))
        places.append((group, slice(first, first + len(rows[-1]))))
        first += len(rows[-1])
    return rows, Layout(len(own.base), tuple(places), ())


@dataclass(frozen=True, eq=False)
class BlockProducts:
    """Products of the filtered columns of all runs, block by block.

    Parameters
    ----------
    gram : ndarray, shape (n_blocks, n, n)
        Products, scaled: target, regressors and laws of unit energy, each group as one.
    floor : ndarray, shape (n_blocks,)
        Sum of squares that noise alone leaves.
    folds : ndarray of int, shape (n_blocks,)
        Fold in which each block is held out.
    scale : ndarray, shape (n,)
        Factor that each column was multiplied by.
    layout : Layout
        Which column is what.
    """

    gram: FloatArray
    floor: FloatArray
    folds: IntArray
    scale: FloatArray
    layout: Layout


def products_by_block(
    own: Sequence[ForceRecord],
    weights: Sequence[NoiseWeight],
    columns: Callable[[ForceRecord], tuple[list[FloatArray], Layout]],
    n_folds: int,
) -> BlockProducts:
    """Products of columns along some runs.

    Parameters
    ----------
    own, weights : sequence
        Runs and their filters.
    columns : callable
        Gives the columns of a run and where they stand.
    n_folds : int
        Parts that the blocks are held out in.
    """
    n_blocks = sum(np.unique(record.block[record.counts]).size for record in own)
    gram = np.empty(0)
    floors: list[float] = []
    folds: list[int] = []
    layout = None
    for number, (record, weight) in enumerate(zip(own, weights, strict=True)):
        pieces, layout = columns(record)
        raw = np.concatenate(pieces)
        if not gram.size:
            gram = np.empty((n_blocks, len(raw), len(raw)))
        rows = filtered_columns(raw, weight)
        fold = fold_of(record, number, n_folds)
        floor = weight.floor()
        for block in np.unique(record.block[record.counts]):
            chosen = record.block == block
            inside = rows[:, chosen]
            np.matmul(inside, inside.T, out=gram[len(floors)])
            floors.append(floor * inside.shape[1])
            folds.append(int(fold[chosen][0]))
    assert layout is not None
    scale = layout.scale(np.diag(gram.sum(axis=0)))
    # In place: a table takes tens of megabytes, and a copy as long as its products.
    gram *= np.outer(scale, scale)
    return BlockProducts(gram, np.array(floors) * scale[0] ** 2, np.array(folds), scale, layout)


def _law(
    rows: list[FloatArray], first: int, law: str, shapes: FloatArray, model: ElementModel
) -> LawColumns:
    """Place of a law's columns, which are appended to the rows."""
    n_shapes, n_columns, n = shapes.shape
    rows.append(shapes.reshape(-1, n))
    places = first + np.arange(n_shapes * n_columns).reshape(n_shapes, n_columns)
    card = model.cards.get(law)
    return LawColumns(law, tuple(places), len(card.parameters) if card else 2)


def filtered_columns(raw: FloatArray, weight: NoiseWeight) -> FloatArray:
    """Columns through the filter of their run, shape (n_columns, n)."""
    return np.concatenate(
        [weight.filtered(raw[k : k + _CHUNK]) for k in range(0, len(raw), _CHUNK)]
    )
