"""Sets of laws that compete in the table, the few that are worth a fit in the simulator."""

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from carrierflex.diagnosis.classes.decision import state_of
from carrierflex.diagnosis.classes.gram_table import GramTable, IntArray, LawColumns
from carrierflex.diagnosis.classes.held_out import Classes, ClassScores, HeldOutSquares
from carrierflex.diagnosis.classes.results import NAMED_CLASS
from carrierflex.diagnosis.classes.shares import Shares
from carrierflex.diagnosis.comparison.problem import Effects

#: Laws of a set at most.
_MOST_LAWS = 6
#: Sets of one size that a further law is added to, and sets of one size that are returned.
_EXTENDED, _RETURNED = 2, 3
#: Ratios of what a set leaves of the gap up to which it is worth a fit: to what the best set of its
#: size leaves, and to what the classes leave that explain the gap.
_NEAR, _FAR = 2.5, 10.0
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
    best set of a size takes half of what the best of the size before leaves. Beside them stand the
    nearest laws of every class of the answer and of its ties. Of both only those are proposed that
    leave little more than the best of them, and than the classes where these explain the gap.
    Before them come the sets of the answer with the laws that they lack, after them every law that
    acts in one fold alone: left out, that fold says nothing of it.

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
        name: _acting(scores.table, laws, simulated) for name, laws in scores.table.laws.items()
    }
    library = {law.id: law for laws in of_each_class.values() for law in laws}
    nearest = [_nearest(scores, shares, of_each_class, classes) for classes in sets_of_classes]
    sets = [entry for entries in nearest for entry in entries]
    sets += _grown(scores, shares, library)
    # A law of many shapes bends to what other laws leave and ends at a bound: others do without it.
    rigid = {name: law for name, law in library.items() if len(law.variants) == 1}
    of_answer = nearest[0] if nearest else []
    completed = [_completed(scores, shares, library, entry) for entry in of_answer[:1]]
    completed += [_completed(scores, shares, rigid, entry) for entry in of_answer]
    of_classes = [scores.of(classes) for classes in sets_of_classes if classes]
    explaining = [result for result in of_classes if state_of(shares, result) == NAMED_CLASS]
    near = _near_best(shares, sets, explaining)
    # In force space a law is known less well than by simulation, friction at rest least: the
    # nearest laws of the answer are fitted, and a simpler set beside them.
    proposed = [*completed, *_with_simpler(of_answer), *near]
    laws = [tuple(sorted(entry.laws)) for entry in proposed if entry.laws]
    return tuple(dict.fromkeys([*laws, *_of_one_fold(scores.table, simulated)]))


def _of_one_fold(table: GramTable, simulated: Container[str]) -> list[Effects]:
    """Laws that the simulator has, at no shape acting outside every fold, each by itself."""
    squares = np.diag(table.total)
    return [
        (law.id,)
        for laws in table.laws.values()
        for law in laws
        if law.id in simulated
        and any(squares[shape].any() for shape in law.variants)
        and not _acting(table, [law], simulated)
    ]


def _acting(
    table: GramTable, laws: Sequence[LawColumns], simulated: Container[str]
) -> tuple[LawColumns, ...]:
    """Laws that the simulator has, at the shapes that act outside every fold."""
    # A gain or a delay of a baseline without signals acts on nothing; a law of both directions of a
    # load acts where one of them is loaded.
    squares = np.diagonal(table.training, axis1=1, axis2=2)
    shapes = {
        law.id: tuple(shape for shape in law.variants if squares[:, shape].any(axis=1).all())
        for law in laws
        if law.id in simulated
    }
    return tuple(replace(law, variants=shapes[law.id]) for law in laws if shapes.get(law.id))


def _grown(scores: ClassScores, shares: Shares, library: Mapping[str, LawColumns]) -> list[_LawSet]:
    """Best sets of every size that clearly gains over the size before."""
    best = _no_law(scores)
    extended = [best]
    returned: list[_LawSet] = []
    least = scores.constants.least_gain
    for _ in range(_MOST_LAWS):
        ordered = _larger(scores, extended, library)
        if not ordered:
            break
        if best.laws and not shares.is_clear_gain(ordered[0].result, best.result, least):
            break
        best, extended = ordered[0], ordered[:_EXTENDED]
        returned += ordered[:_RETURNED]
    return returned


def _completed(
    scores: ClassScores, shares: Shares, library: Mapping[str, LawColumns], entry: _LawSet
) -> _LawSet:
    """Set of laws of a library with those that it lacks, and without those that explain nothing."""
    least = scores.constants.least_gain
    entry = _fitted_set(scores, [library[name] for name in entry.laws if name in library])
    while larger := _larger(scores, [entry], library):
        if not shares.is_gain(larger[0].result, entry.result, least):
            break
        entry = larger[0]
    while smaller := _smaller(scores, entry, library):
        if shares.is_clear_gain(entry.result, smaller[0].result, least):
            break
        entry = smaller[0]
    return entry


def _larger(
    scores: ClassScores, bases: Sequence[_LawSet], library: Mapping[str, LawColumns]
) -> list[_LawSet]:
    """Sets with one law more than any of some sets, the one that leaves least first."""
    further = [
        (base, law) for base in bases for name, law in library.items() if name not in base.laws
    ]
    larger = {tuple(sorted(entry.laws)): entry for entry in _with_each_law(scores, further)}
    return sorted(larger.values(), key=lambda entry: entry.result.total)


def _smaller(
    scores: ClassScores, entry: _LawSet, library: Mapping[str, LawColumns]
) -> list[_LawSet]:
    """Sets with one law less, the one that leaves least first."""
    sets = [
        _fitted_set(scores, [library[other] for other in entry.laws if other != name])
        for name in entry.laws
    ]
    return sorted(sets, key=lambda smaller: smaller.result.total)


def _near_best(
    shares: Shares, sets: Sequence[_LawSet], classes: Sequence[HeldOutSquares]
) -> list[_LawSet]:
    """Sets near the best of their size, and not far from the classes."""
    most = _FAR * min(map(shares.remaining, classes), default=np.inf)
    best: dict[int, float] = {}
    for entry in sets:
        size = len(entry.laws)
        best[size] = min(shares.remaining(entry.result), best.get(size, np.inf))
    return [
        entry
        for entry in sets
        if shares.remaining(entry.result) <= min(_NEAR * best[len(entry.laws)], most)
    ]


def _no_law(scores: ClassScores) -> _LawSet:
    """The baseline alone."""
    return _LawSet((), np.empty(0, dtype=np.int64), scores.of(()))


def _with_each_law(
    scores: ClassScores, further: Sequence[tuple[_LawSet, LawColumns]]
) -> list[_LawSet]:
    """Each set with one law more, at the shape of it that leaves least."""
    columns = [
        [np.concatenate([base.columns, shape]) for shape in law.variants] for base, law in further
    ]
    results = iter(scores.with_laws((), [shape for of_law in columns for shape in of_law]))
    sets = []
    for (base, law), of_law in zip(further, columns, strict=True):
        options = [(shape, next(results)) for shape in of_law]
        shape, result = min(options, key=lambda option: option[1].total)
        sets.append(_LawSet((*base.laws, law.id), shape, result))
    return sets


def _nearest(
    scores: ClassScores,
    shares: Shares,
    laws: Mapping[str, Sequence[LawColumns]],
    classes: Classes,
) -> list[_LawSet]:
    """Sets of the nearest laws of some classes, one law a class; the first is worth most."""
    of_each = [_nearest_laws(scores, shares, laws.get(name, ()), name, classes) for name in classes]
    sets = [(_fitted_set(scores, chosen), chosen) for chosen in product(*of_each) if chosen]
    ordered = sorted(sets, key=lambda entry: -_worth(scores, shares, entry[0].result, entry[1]))
    return [entry for entry, _ in ordered[:_COMBINATIONS]]


def _with_simpler(entries: Sequence[_LawSet]) -> list[_LawSet]:
    """The first set, and the first of fewer amplitudes."""
    simpler = [entry for entry in entries if entry.columns.size < entries[0].columns.size]
    return [*entries[:1], *simpler[:1]]


def _worth(
    scores: ClassScores, shares: Shares, result: HeldOutSquares, laws: Sequence[LawColumns]
) -> float:
    """Share that laws explain, less what their parameters must gain: a law holds simpler ones."""
    return shares.of(result) - scores.constants.law_parameter * sum(
        law.n_parameters for law in laws
    )


def _nearest_laws(
    scores: ClassScores, shares: Shares, laws: Sequence[LawColumns], name: str, classes: Classes
) -> list[LawColumns]:
    """Laws of a class that are worth most beside the other classes, a simpler one among them."""
    others = tuple(other for other in classes if other != name)

    def worth(law: LawColumns) -> float:
        results = scores.with_laws(others, law.variants)
        best = min(results, key=lambda result: result.total)
        return _worth(scores, shares, best, (law,))

    ordered = sorted(laws, key=worth, reverse=True)
    simpler = [law for law in ordered if law.n_parameters < ordered[0].n_parameters]
    return list({law.id: law for law in (*ordered[:_NEAREST], *simpler[:1])}.values())


def _fitted_set(scores: ClassScores, laws: Sequence[LawColumns]) -> _LawSet:
    """Set of given laws, each at the shape that leaves least beside those before it."""
    fitted = _no_law(scores)
    for law in {law.id: law for law in laws}.values():
        (fitted,) = _with_each_law(scores, [(fitted, law)])
    return fitted
