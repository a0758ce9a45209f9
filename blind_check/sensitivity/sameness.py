"""Whether results are equal to the last bit, and which groups of columns of two tables are."""

from collections.abc import Iterable, Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from carrierflex.diagnosis.classes.gram_table import GramTable
from carrierflex.diagnosis.comparison.problem import FloatArray


def is_same(first: Any, second: Any) -> bool:
    """Whether two results are equal to the last bit, arrays and dataclasses member by member."""
    if first is second:
        return True
    if type(first) is not type(second):
        return False
    if isinstance(first, np.ndarray):
        return first.shape == second.shape and first.tobytes() == second.tobytes()
    if is_dataclass(first):
        return all(
            is_same(getattr(first, own.name), getattr(second, own.name)) for own in fields(first)
        )
    if isinstance(first, Mapping):
        return first.keys() == second.keys() and all(
            is_same(value, second[key]) for key, value in first.items()
        )
    if isinstance(first, list | tuple):
        return len(first) == len(second) and all(map(is_same, first, second))
    return bool(first == second)


def equal_groups(first: GramTable, second: GramTable) -> frozenset[str] | None:
    """Groups whose products among each other, with target and baseline, are the same in two tables.

    None where the baseline, the blocks or their floor are others.
    """
    if not (is_same(first.folds, second.folds) and is_same(first.floor, second.floor)):
        return None
    if first.n_base != second.n_base or not _agree(first, second, ()):
        return None
    equal = [
        name
        for name, group in first.groups.items()
        if is_same(first.scale[group.columns], second.scale[second.groups[name].columns])
        and is_same(group.penalty, second.groups[name].penalty)
        and group.is_nonnegative == second.groups[name].is_nonnegative
        and _agree(first, second, (name,))
    ]
    return frozenset(equal if _agree(first, second, equal) else ())


def _agree(first: GramTable, second: GramTable, names: Iterable[str]) -> bool:
    """Whether products of target, baseline and some groups are the same in two tables."""
    return is_same(_products(first, names), _products(second, names))


def _products(table: GramTable, names: Iterable[str]) -> FloatArray:
    """Products by block of target, baseline and some groups."""
    places = [np.arange(1 + table.n_base), *(table.groups[name].columns for name in names)]
    chosen = np.concatenate(places)
    return np.asarray(table.gram[:, chosen[:, None], chosen])
