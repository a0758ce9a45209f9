"""The Gram table of an element with a fitted smooth loop among the columns of hysteresis."""

from dataclasses import replace

import numpy as np

from carrierflex.diagnosis.classes.columns import GroupColumns
from carrierflex.diagnosis.classes.gram_table import GramTable
from carrierflex.diagnosis.classes.held_out import ClassScores, HeldOutSquares
from carrierflex.diagnosis.element.classes.laws import HYSTERESIS
from carrierflex.diagnosis.element.classes.motion.force_records import ForceRecord
from carrierflex.diagnosis.element.classes.smooth_loops import SmoothLoop, fitted_loop
from carrierflex.diagnosis.element.classes.table import (
    CLASS_GROUPS,
    ElementTable,
    table_of,
)
from carrierflex.diagnosis.element.classes.table_columns import (
    group_columns_along,
    products_by_block,
)
from carrierflex.diagnosis.element.model import ElementModel

#: Group of the column of a smooth loop.
LOOP = "loop"
_WITH_LOOP = (*CLASS_GROUPS[HYSTERESIS], LOOP)


def left_by_loop(
    own: ElementTable, beside: str, *, is_curve: bool = False
) -> tuple[HeldOutSquares, SmoothLoop]:
    """What hysteresis with a smooth loop leaves, alone or beside one class, and that loop.

    The loop is fitted to all blocks, nine values to some thousand samples: what a held-out block
    gains of its own part in them is far below the ratios at which results are equal.

    Parameters
    ----------
    own : ElementTable
        Table without it.
    beside : str
        Class that shares the force with it; empty where it stands alone.
    is_curve : bool
        Whether the state goes back as it came: a rising curve in place of the loop.
    """
    key = (beside, is_curve)
    if key not in own.loops:
        size = own.bases.size
        shared = _groups_of(own, beside)
        loop = fitted_loop(own.records, own.weights, size, shared, is_curve=is_curve)
        groups = (*_groups_of(own, HYSTERESIS), _column(loop), *shared)
        products = products_by_block(
            own.records,
            own.weights,
            lambda record: group_columns_along(record, groups),
            own.scores.constants.n_folds,
        )
        own.loops[key] = loop, products
    loop, products = own.loops[key]
    classes = {HYSTERESIS: _WITH_LOOP, beside: CLASS_GROUPS.get(beside, ())}
    table = GramTable(
        gram=products.gram,
        n_base=products.layout.n_base,
        groups=products.layout.column_groups(),
        classes=classes,
        surface="",
        ceiling=(),
        laws={},
        floor=products.floor,
        folds=products.folds,
        scale=products.scale,
    )
    scores = ClassScores(table, own.scores.constants)
    return scores.of([name for name in (HYSTERESIS, beside) if name]), loop


def with_loop(model: ElementModel, own: ElementTable, loop: SmoothLoop) -> ElementTable:
    """Table of all classes in which that of hysteresis holds a smooth loop too."""
    made = table_of(model, own.runs, own.scores.constants, (_column(loop),))
    table = replace(
        made.table,
        classes={**CLASS_GROUPS, HYSTERESIS: _WITH_LOOP},
        ceiling=(*made.table.ceiling, LOOP),
    )
    return replace(made, table=table, loop=loop, scores=ClassScores(table, own.scores.constants))


def _groups_of(own: ElementTable, name: str) -> list[GroupColumns[ForceRecord]]:
    return [group for group in own.groups if group.id in CLASS_GROUPS.get(name, ())]


def _column(loop: SmoothLoop) -> GroupColumns[ForceRecord]:
    return GroupColumns(
        LOOP,
        lambda record: loop.along(record.x, from_rest=record.from_rest)[None],
        np.zeros((1, 1)),
        is_nonnegative=True,
    )
