"""The answer of a comparison of classes: classes, the nearest law in each, what remains."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from carrierflex.diagnosis.classes.decision import Decision, decide
from carrierflex.diagnosis.classes.gram_table import GramTable, IntArray, LawColumns
from carrierflex.diagnosis.classes.held_out import Classes, ClassScores, HeldOutSquares
from carrierflex.diagnosis.classes.results import (
    NO_CLASS,
    NOTHING,
    ClassAnswer,
    ClassFinding,
    MeasuredShape,
)
from carrierflex.diagnosis.classes.shares import PairedShares, Shares, at_most_one
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
    results: list[tuple[float, str, IntArray, HeldOutSquares]] = []
    for law in scores.table.laws.get(name, ()):
        columns, result = _best_shape(scores, partners, law)
        value = shares.of(result) - limits.law_parameter * law.n_parameters
        results.append((value, law.id, columns, result))
    if not results:
        return NearestLaw("", np.empty(0, dtype=np.int64), None, False)
    _, law_id, columns, result = max(results, key=lambda entry: entry[0])
    with_class = scores.of((name, *partners))
    behind = shares.gain(with_class, result)
    error = limits.standard_errors * shares.gain_error(with_class, result)
    is_equal = behind <= max(limits.law_named, error) and _explains(shares, result)
    is_equal = is_equal and not _is_coupled(scores, shares, name, law_id, partners)
    return NearestLaw(law_id, columns, result, is_equal)


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


def _best_shape(
    scores: ClassScores, partners: Classes, law: LawColumns
) -> tuple[IntArray, HeldOutSquares]:
    """Shape of a law that leaves least."""
    results = zip(law.variants, scores.with_laws(partners, law.variants), strict=True)
    return min(results, key=lambda result: result[1].total)


#: Measured shape of one class of an answer, and the law that it makes: either may be missing.
ShapeAndLaw = tuple[MeasuredShape | None, Law | None]
#: Gives both from class, result of the answer and nearest law.
ShapeOf = Callable[[ClassScores, str, HeldOutSquares, NearestLaw], ShapeAndLaw]


def class_decision(
    scores: ClassScores,
    candidates: Sequence[str],
    *,
    inseparable: Sequence[str] = (),
    shows_two_causes: bool = True,
    shows_small_causes: bool = True,
    floor_is_known: bool = True,
    drive_note: str = "",
) -> tuple[Shares, Decision]:
    """Which class the gap shows, and the shares that it was judged by.

    `floor_is_known`: whether shares are of the gap above the floor, or of all that the baseline
    leaves: a floor that was taken from what no class learns would make the best class right by
    definition. The other options are those of
    :func:`carrierflex.diagnosis.classes.decision.decide`.
    """
    table, constants = scores.table, scores.constants
    floor_of_shares = table.floor if floor_is_known else np.zeros_like(table.floor)
    # Where one line drives all runs, blocks of one level go round one curve: their ratios are one
    # finding many times, and say nothing of how sure it is.
    shares_of = PairedShares if shows_two_causes else Shares
    shares = shares_of(scores.of(()).squares, floor_of_shares, constants)
    decision = decide(
        scores,
        shares,
        [name for name in candidates if name != table.surface],
        inseparable=inseparable,
        shows_two_causes=shows_two_causes,
        shows_small_causes=shows_small_causes,
        drive_note=drive_note,
    )
    return shares, decision


def class_answer(
    scores: ClassScores,
    shares: Shares,
    decision: Decision,
    candidates: Sequence[str],
    *,
    shape_of: ShapeOf,
    shows_laws: bool = True,
) -> ClassAnswer:
    """Class that the gap shows, the nearest law in it, and what remains.

    Shares and decision are those of :func:`class_decision`. `shows_laws` states whether the drive
    distinguishes a law from another curve of its class.
    """
    surface = scores.table.surface
    names = [name for name in candidates if name != surface] + ([surface] if surface else [])
    answer = answer_of(scores, shares, decision, names, shape_of=shape_of, note=decision.note)
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
    note: str = "",
) -> ClassAnswer:
    """Answer of a decision: shares, nearest laws, rivals and what remains.

    `rivals` are the classes whose share alone is reported; `note` is what the records cannot say.
    """
    table, constants = scores.table, scores.constants
    if decision.state == NOTHING:
        return without_classes(decision.state, table, decision.note)
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
        note=note,
        best=() if is_class else decision.classes,
        unsupported={} if is_class else {one.id: one.measured_law for one in findings},
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


def without_classes(state: str, table: GramTable, note: str) -> ClassAnswer:
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
    shape, measured_law = shape_of(scores, class_id, decision.squares, law)
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
