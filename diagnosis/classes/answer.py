"""The answer of a comparison of classes: classes, the nearest law in each, what remains.

Sets of laws compete in the same table: the few that are worth a fit in the simulator.
"""

from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from carrierflex.diagnosis.classes.decision import Decision, state_of
from carrierflex.diagnosis.classes.gram_table import GramTable, IntArray, LawColumns
from carrierflex.diagnosis.classes.held_out import Classes, ClassScores, HeldOutSquares
from carrierflex.diagnosis.classes.results import (
    NAMED_CLASS,
    NO_CLASS,
    NOTHING,
    ClassAnswer,
    ClassFinding,
    MeasuredShape,
)
from carrierflex.diagnosis.classes.shares import Shares, at_most_one
from carrierflex.diagnosis.comparison.problem import Effects
from carrierflex.simulation.laws import Law


@dataclass(frozen=True, eq=False)
class NearestLaw:
    """Law of a class that explains most."""

    id: str  # Law; empty where the class holds none
    columns: IntArray  # Places of its columns, at its best shape
    squares: HeldOutSquares | None  # Its result in place of the class
    is_equal: bool  # Whether the records cannot tell it from the class


def nearest_law(scores: ClassScores, shares: Shares, name: str, partners: Classes) -> NearestLaw:
    """Law that takes the place of a class best, by ``share - 0.005 n_parameters``."""
    limits = scores.constants
    laws = scores.table.laws.get(name, ())
    if not laws:
        return NearestLaw("", np.empty(0, dtype=np.int64), None, False)
    results = [(law, *_best_shape(scores, partners, law)) for law in laws]
    law, columns, result = max(results, key=lambda entry: _worth(shares, entry[2], entry[:1]))
    with_class = scores.of((name, *partners))
    behind = shares.gain(with_class, result)
    error = limits.standard_errors * shares.gain_error(with_class, result)
    is_equal = behind <= max(limits.law_named, error) and _explains(shares, result)
    is_equal = is_equal and not _is_coupled(scores, shares, name, law.id, partners)
    return NearestLaw(law.id, columns, result, is_equal)


def _is_coupled(
    scores: ClassScores, shares: Shares, class_id: str, law: str, partners: Classes
) -> bool:
    """Whether a class stands for a part of a coupled cause, whose laws are not its own."""
    # An orifice whose opening changes along the way damps by the square of the speed, and is no law
    # of the speed.
    table = scores.table
    # A surface takes up whatever a law beside it leaves, and is named where its parts leave more:
    # what lies in one of them alone is no law of it.
    if table.surface in partners:
        return True
    if class_id == table.surface:
        members = [name for name in table.classes if name != class_id and table.is_in_surface(name)]
        return sum(law in [known.id for known in table.laws[name]] for name in members) == 1
    answer = (class_id, *partners)
    if class_id in table.coupled_parts and table.coupled_parts <= set(answer):
        return True
    if not table.is_in_surface(class_id):
        return False
    others = [name for name in partners if not table.is_in_surface(name)]
    # In fewer columns than the surface a product of place and speed is seen where it is small.
    products = [scores.products.of((name, *others)) for name in table.products]
    coupled = min([scores.of((table.surface, *others)), *products], key=lambda result: result.total)
    return shares.is_clear_gain(coupled, scores.of(answer), scores.constants.law_parameter)


def _explains(shares: Shares, result: HeldOutSquares) -> bool:
    """Whether a result leaves so little that a law can be the whole of the cause."""
    return shares.is_at_floor(result) or shares.of(result) >= shares.constants.law_explains


#: Measured shape of one class of an answer, and the law that it makes: either may be missing.
ShapeAndLaw = tuple[MeasuredShape | None, Law | None]
#: Gives both from class, result of the answer and nearest law.
ShapeOf = Callable[[str, HeldOutSquares, NearestLaw], ShapeAndLaw]


def class_answer(
    scores: ClassScores,
    shares: Shares,
    decision: Decision,
    candidates: Sequence[str],
    *,
    shape_of: ShapeOf,
    simulated: Container[str] = (),
    shows_laws: bool = True,
) -> ClassAnswer:
    """Class that the gap shows, the nearest law in it, and what remains.

    `shows_laws` states whether the drive distinguishes a law from another curve of its class.
    """
    surface = scores.table.surface
    names = [name for name in candidates if name != surface] + ([surface] if surface else [])
    answer = answer_of(
        scores,
        shares,
        decision,
        names,
        shape_of=shape_of,
        simulated=simulated,
    )
    return replace(
        answer,
        classes=tuple(
            replace(
                finding,
                law_named=finding.law_named and shows_laws and _is_in_ties(answer, finding.law),
            )
            for finding in answer.classes
        ),
    )


def _is_in_ties(answer: ClassAnswer, law: str) -> bool:
    """Whether a law lies in a class of every tied set: else its own class is not certain."""
    classes = set(answer.classes_of_law.get(law, ()))
    return all(classes.intersection(ids) for ids in answer.ties)


def answer_of(
    scores: ClassScores,
    shares: Shares,
    decision: Decision,
    rivals: Sequence[str],
    *,
    shape_of: ShapeOf,
    simulated: Container[str] = (),
) -> ClassAnswer:
    """Answer of a decision: shares, nearest laws, rivals and what remains.

    `rivals` are the classes whose share alone is reported; `simulated` the laws that the simulator
    has, the table holds others too.
    """
    table, constants = scores.table, scores.constants
    sets = law_sets(scores, shares, (decision.classes, *decision.ties), simulated)
    if decision.state == NOTHING:
        return without_classes(decision.state, table, decision.note, sets)
    findings, laws = [], []
    for name in decision.classes:
        finding, law = _finding(scores, shares, decision, name, shape_of)
        findings.append(finding)
        laws.append(law)
    result = decision.squares
    learnable = max(shares.of(scores.ceiling()), shares.of(scores.of(decision.best_pair)))
    pair_gains = shares.gain(scores.of(decision.best_pair), result) > constants.least_gain
    is_class = decision.state != NO_CLASS
    return ClassAnswer(
        state=decision.state,
        classes=tuple(findings) if is_class else (),
        ties=decision.ties if is_class else (),
        rivals={
            name: at_most_one(shares.of(scores.of((name,))))
            for name in rivals
            if not (is_class and _holds(table, name, decision.classes))
        },
        share=at_most_one(shares.of(result)),
        share_ci95=shares.interval(result),
        learnable=at_most_one(learnable),
        learnt_by=tuple(
            name for name in decision.best_pair if pair_gains and name not in decision.classes
        ),
        law_share=_law_share(scores, shares, laws),
        classes_of_law=_classes_of_law(table),
        note=decision.note,
        best=() if is_class else decision.classes,
        unsupported={} if is_class else {one.id: one.measured_law for one in findings},
        law_sets=sets,
    )


def _holds(table: GramTable, name: str, classes: Sequence[str]) -> bool:
    """Whether a class is the answer, or contains it: neither is a rival."""
    inside = {group for member in classes for group in table.classes[member]}
    return inside <= set(table.classes[name])


def _classes_of_law(table: GramTable) -> Mapping[str, tuple[str, ...]]:
    """Classes that hold each law of a table, in the order of its classes."""
    classes: dict[str, tuple[str, ...]] = {}
    for name, laws in table.laws.items():
        for law in laws:
            classes[law.id] = (*classes.get(law.id, ()), name)
    return classes


def without_classes(
    state: str, table: GramTable, note: str, sets: tuple[Effects, ...]
) -> ClassAnswer:
    """Answer of records in which nothing is missing, or nothing is visible."""
    nan = float("nan")
    return ClassAnswer(
        state=state,
        classes=(),
        ties=(),
        rivals={},
        share=nan,
        share_ci95=(nan, nan),
        learnable=nan,
        learnt_by=(),
        law_share=nan,
        classes_of_law=_classes_of_law(table),
        note=note,
        law_sets=sets,
    )


def _finding(
    scores: ClassScores, shares: Shares, decision: Decision, class_id: str, shape_of: ShapeOf
) -> tuple[ClassFinding, NearestLaw]:
    """One class of the answer; in a pair its share is the mean of what it adds alone and second."""
    others = tuple(name for name in decision.classes if name != class_id)
    law = nearest_law(scores, shares, class_id, others)
    before, other = scores.of(()), scores.of(others)
    total = shares.of(decision.squares)
    # Each part lies within the whole, and both add up to it, also where one class harms alone.
    share, interval = shares.contribution(before, other, scores.of((class_id,)), decision.squares)
    if others:
        share = min(max(share, 0.0), max(total, 0.0)) / max(total, 1.0)
    law_share = float("nan")
    if law.squares is not None:
        alone = scores.with_law((), law.columns)
        law_share = at_most_one(shares.contribution(before, other, alone, law.squares)[0])
    shape, measured_law = shape_of(class_id, decision.squares, law)
    finding = ClassFinding(
        id=class_id,
        share=at_most_one(share),
        share_ci95=interval,
        law=law.id,
        law_share=law_share,
        law_named=law.is_equal,
        shape=shape,
        measured_law=measured_law,
    )
    return finding, law


def _law_share(scores: ClassScores, shares: Shares, laws: Sequence[NearestLaw]) -> float:
    """Share of the nearest laws together, without any class."""
    known = [law.columns for law in laws if law.id]
    if not known:
        return float("nan")
    return at_most_one(shares.of(scores.with_law((), np.concatenate(known))))


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

    `sets_of_classes` are those of the answer, and of every tie; `simulated` the laws that the
    simulator has. Names are sorted within a set; those of the classes come first, then the best of
    the library, small sets first.
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
    simpler = [entry for entry in of_answer if entry.columns.size < of_answer[0].columns.size]
    proposed = [*completed, *of_answer[:1], *simpler[:1], *near]
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
    limits = {size: min(_NEAR * least, most) for size, least in best.items()}
    return [entry for entry in sets if shares.remaining(entry.result) <= limits[len(entry.laws)]]


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
    ordered = sorted(sets, key=lambda entry: -_worth(shares, entry[0].result, entry[1]))
    return [entry for entry, _ in ordered[:_COMBINATIONS]]


def _worth(shares: Shares, result: HeldOutSquares, laws: Sequence[LawColumns]) -> float:
    """Share that laws explain, less what their parameters must gain: a law holds simpler ones."""
    n_parameters = sum(law.n_parameters for law in laws)
    return shares.of(result) - shares.constants.law_parameter * n_parameters


def _nearest_laws(
    scores: ClassScores, shares: Shares, laws: Sequence[LawColumns], name: str, classes: Classes
) -> list[LawColumns]:
    """Laws of a class that are worth most beside the other classes, a simpler one among them."""
    others = tuple(other for other in classes if other != name)

    def worth(law: LawColumns) -> float:
        return _worth(shares, _best_shape(scores, others, law)[1], (law,))

    ordered = sorted(laws, key=worth, reverse=True)
    simpler = [law for law in ordered if law.n_parameters < ordered[0].n_parameters]
    return list({law.id: law for law in (*ordered[:_NEAREST], *simpler[:1])}.values())


def _fitted_set(scores: ClassScores, laws: Sequence[LawColumns]) -> _LawSet:
    """Set of given laws, each at the shape that leaves least beside those before it."""
    fitted = _no_law(scores)
    for law in {law.id: law for law in laws}.values():
        (fitted,) = _with_each_law(scores, [(fitted, law)])
    return fitted


def _best_shape(
    scores: ClassScores, partners: Classes, law: LawColumns
) -> tuple[IntArray, HeldOutSquares]:
    """Columns of the shape of a law that leaves least beside some classes, and its result."""
    results = zip(law.variants, scores.with_laws(partners, law.variants), strict=True)
    return min(results, key=lambda result: result[1].total)
