"""Sets of laws that compete in the table, the few that are worth a fit in the simulator."""

from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from carrierflex.diagnosis.classes.gram_table import IntArray, LawColumns
from carrierflex.diagnosis.classes.held_out import Classes, ClassScores, HeldOutSquares
from carrierflex.diagnosis.classes.shares import Shares
from carrierflex.diagnosis.comparison.problem import Effects

#: Laws of a set at most.
_MOST_LAWS = 6
#: Sets of one size that a further law is added to, and sets of one size that are returned.
_EXTENDED, _RETURNED = 2, 3
#: Ratio of what a set leaves of the gap to what the best leaves up to which it is worth a fit.
_NEAR = 2.5
#: Nearest laws of a class that stand for it, and sets of them for each set of classes.
_NEAREST, _COMBINATIONS = 2, 4


@dataclass(frozen=True, eq=False)
class _LawSet:
    """Laws at the shapes that leave least together."""

    laws: Effects
    columns: IntArray
    result: HeldOutSquares


def law_sets(
    scores: ClassScores,
    shares: Shares,
    sets_of_classes: Sequence[Classes],
    simulated: Container[str],
) -> tuple[Effects, ...]:
    """Sets of laws that leave least of the gap on held-out blocks.

    Laws compete with each other whatever their class: sets grow by one law at a time while the
    best set of a size gains over the best of the size before. Beside them stand the nearest laws of
    every class of the answer and of its ties.

    Parameters
    ----------
    scores : ClassScores
        Held-out squares of the table.
    shares : Shares
        Gap, floor and scatter.
    sets_of_classes : sequence of tuple of str
        Classes of the answer, and of every tie.
    simulated : container of str
        Laws that the simulator has; the table holds others too.

    Returns
    -------
    tuple of tuple of str
        Sets of laws, sorted by name within a set: those of the classes first, then the best of the
        library, small sets first.
    """
    of_each_class = {
        name: tuple(law for law in laws if law.id in simulated)
        for name, laws in scores.table.laws.items()
    }
    library = {name: law for name, law in scores.table.library.items() if name in simulated}
    sets = [
        laws for own in sets_of_classes for laws in _nearest(scores, shares, of_each_class, own)
    ]
    sets += [entry.laws for entry in _grown(scores, shares, library)]
    return tuple(dict.fromkeys(tuple(sorted(laws)) for laws in sets if laws))


def _grown(scores: ClassScores, shares: Shares, library: Mapping[str, LawColumns]) -> list[_LawSet]:
    """Best sets of every size that gains over the size before."""
    empty = _LawSet((), np.empty(0, dtype=np.int64), scores.of(()))
    best, extended, returned = empty, [empty], []
    for _ in range(_MOST_LAWS):
        larger = {
            tuple(sorted((*base.laws, name))): _with_law(scores, base, law)
            for base in extended
            for name, law in library.items()
            if name not in base.laws
        }
        ordered = sorted(larger.values(), key=lambda entry: entry.result.total)
        if not ordered:
            break
        is_gain = shares.is_gain(ordered[0].result, best.result, scores.constants.least_gain)
        if best.laws and not is_gain:
            break
        best, extended = ordered[0], ordered[:_EXTENDED]
        returned += _near_best(shares, ordered)[:_RETURNED]
    return returned


def _near_best(shares: Shares, ordered: Sequence[_LawSet]) -> list[_LawSet]:
    """Sets that leave little more than the best of them, which comes first."""
    most = _NEAR * shares.left(ordered[0].result)
    return [entry for entry in ordered if shares.left(entry.result) <= most]


def _with_law(scores: ClassScores, base: _LawSet, law: LawColumns) -> _LawSet:
    """Set with one law more, at the shape of it that leaves least."""
    columns = [np.concatenate([base.columns, shape]) for shape in law.variants]
    results = [scores.with_law((), chosen) for chosen in columns]
    k = int(np.argmin([result.total for result in results]))
    return _LawSet((*base.laws, law.id), columns[k], results[k])


def _nearest(
    scores: ClassScores,
    shares: Shares,
    laws: Mapping[str, Sequence[LawColumns]],
    classes: Classes,
) -> Iterable[Effects]:
    """Sets of the nearest laws of some classes, one law a class."""
    of_each = [_nearest_laws(scores, laws.get(name, ()), name, classes) for name in classes]
    if not all(of_each):
        return []
    sets = [_fitted_set(scores, chosen) for chosen in product(*of_each)]
    ordered = sorted(sets, key=lambda entry: entry.result.total)
    return [entry.laws for entry in _near_best(shares, ordered)[:_COMBINATIONS]]


def _nearest_laws(
    scores: ClassScores, laws: Sequence[LawColumns], name: str, classes: Classes
) -> list[LawColumns]:
    """Laws of a class that leave least beside the other classes."""
    beside = tuple(other for other in classes if other != name)

    def least(law: LawColumns) -> float:
        return min(scores.with_law(beside, shape).total for shape in law.variants)

    return sorted(laws, key=least)[:_NEAREST]


def _fitted_set(scores: ClassScores, laws: Sequence[LawColumns]) -> _LawSet:
    """Set of given laws, each at the shape that leaves least beside those before it."""
    fitted = _LawSet((), np.empty(0, dtype=np.int64), scores.of(()))
    for law in {law.id: law for law in laws}.values():
        fitted = _with_law(scores, fitted, law)
    return fitted
