"""From products of rows to a table: groups, classes, laws, and the baseline's contained laws."""

from dataclasses import dataclass

import numpy as np

from carrierflex.diagnosis.classes.gram_table import ColumnGroup, GramTable, IntArray, LawColumns
from carrierflex.diagnosis.classes.shape_decision import shape_of
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.mounting.classes.catalogue import (
    BUSHINGS,
    DELAY,
    FORCE_GROUPS,
    FULL,
    GAIN,
    LOADS,
    SHAPE_OF_LAW,
    SHAPES_OF_USER,
    STIFFNESS,
    ZERO,
    class_groups,
)
from carrierflex.diagnosis.mounting.model import MountingModel


@dataclass(frozen=True, eq=False)
class Layout:
    """Rows of the table: target and baseline, groups, laws.

    Parameters
    ----------
    groups : mapping of str to tuple
        Place, penalty and sign of each group.
    laws : mapping of str to tuple of ndarray
        Places of the columns of each shape of a law.
    """

    groups: dict[str, tuple[slice, FloatArray, bool]]
    laws: dict[str, tuple[IntArray, ...]]


def assembled(
    model: MountingModel, gram: FloatArray, floor: FloatArray, folds: IntArray, layout: Layout
) -> GramTable:
    """Table of unit energies, each group scaled as one; contained laws join the baseline."""
    n_base = 0 if model.held else 2
    gram, layout, n_base = _with_contained(model, gram, layout, n_base)
    energy = np.diag(gram.sum(axis=0)).copy()
    for name, (place, _, _) in layout.groups.items():
        if not name.startswith((STIFFNESS, LOADS)):
            energy[place] = energy[place].mean()
    scale = 1.0 / np.sqrt(np.where(energy > 0.0, energy, 1.0))
    groups = {
        name: ColumnGroup(np.arange(place.start, place.stop), penalty, positive)
        for name, (place, penalty, positive) in layout.groups.items()
    }
    classes = {
        name: own for name, own in class_groups(model.channels, model.contained, groups).items()
    }
    laws = {
        name: tuple(
            LawColumns(law, places, len(model.cards[law].parameters))
            for law, places in layout.laws.items()
            if law not in model.contained and shape_of(name) in _shapes_of_law(model, law)
        )
        for name in classes
    }
    every = [*(group for own in FORCE_GROUPS.values() for group in own)]
    every += [f"{STIFFNESS}:{FULL}", f"{LOADS}:{FULL}", f"{DELAY}:all"]
    every += [name for name in groups if name.startswith((f"{GAIN}:", f"{ZERO}:"))]
    return GramTable(
        gram=gram * np.outer(scale, scale),
        n_base=n_base,
        groups=groups,
        classes=classes,
        surface="",
        ceiling=tuple(every),
        laws=laws,
        floor=floor * scale[0] ** 2,
        folds=folds,
        scale=scale,
    )


def _shapes_of_law(model: MountingModel, law: str) -> tuple[str, ...]:
    """Shapes that hold a law.

    Of a law of a file the class it was measured of, of a user's own law those of any force of
    deflection and speed.
    """
    if law in model.measured:
        return (f"{BUSHINGS}/{model.measured[law].effect_class}",)
    return (SHAPE_OF_LAW[law],) if law in SHAPE_OF_LAW else SHAPES_OF_USER


def _with_contained(
    model: MountingModel, gram: FloatArray, layout: Layout, n_base: int
) -> tuple[FloatArray, Layout, int]:
    """Table whose baseline holds the contained laws, each at the shape that fits best beside it."""
    base = list(range(1, 1 + n_base))
    total = gram.sum(axis=0)
    for law in model.contained:
        variants = layout.laws.get(law, ())
        if not variants:
            continue
        left = [_left(total, [*base, *own.tolist()]) for own in variants]
        base += variants[int(np.argmin(left))].tolist()
    added = base[n_base:]
    if not added:
        return gram, layout, n_base
    rest = np.arange(1 + n_base, len(total))
    order = np.concatenate([[0], base, rest]).astype(int)
    shift = len(added)
    groups = {
        name: (slice(place.start + shift, place.stop + shift), penalty, positive)
        for name, (place, penalty, positive) in layout.groups.items()
    }
    laws = {law: tuple(own + shift for own in places) for law, places in layout.laws.items()}
    return gram[:, order[:, None], order[None]], Layout(groups, laws), n_base + shift


def _left(total: FloatArray, places: list[int]) -> float:
    """Square that some columns leave of the target."""
    A, b = total[np.ix_(places, places)], total[places, 0]
    return float(total[0, 0] - b @ np.linalg.pinv(A, hermitian=True) @ b)


def class_sizes(table: GramTable) -> dict[str, int]:
    """Columns of each class."""
    return {
        name: sum(table.groups[group].columns.size for group in own)
        for name, own in table.classes.items()
    }
