"""The answer of a comparison of classes, from its table."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from carrierflex.diagnosis.classes.decision import Decision, decide
from carrierflex.diagnosis.classes.gram_table import GramTable
from carrierflex.diagnosis.classes.held_out import ClassScores, HeldOutSquares
from carrierflex.diagnosis.classes.laws import NearestLaw, nearest_law
from carrierflex.diagnosis.classes.results import (
    NO_CLASS,
    NOTHING,
    ClassAnswer,
    ClassFinding,
    MeasuredShape,
)
from carrierflex.diagnosis.classes.shares import PairedShares, Shares, at_most_one

#: Measured shape of one class of an answer: class, result of the answer, nearest law.
ShapeOf = Callable[[ClassScores, str, HeldOutSquares, NearestLaw], MeasuredShape | None]


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

    Parameters
    ----------
    scores : ClassScores
        Held-out squares of the table.
    candidates : sequence of str
        Classes that these records can show.
    inseparable : sequence of str
        Classes that this drive shows only mixed with others.
    shows_two_causes : bool
        Whether the drive tells two causes from another two.
    shows_small_causes : bool
        Whether the drive moves at so many frequencies that a small second cause is seen.
    floor_is_known : bool
        Whether shares are of the gap above the floor, or of all that the baseline leaves: a floor
        that was taken from what no class learns would make the best class right by definition.
    drive_note : str
        What the drive does not separate.
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

    Parameters
    ----------
    scores : ClassScores
        Held-out squares of the table that holds the classes of the decision.
    shares, decision
        As of :func:`class_decision`.
    candidates : sequence of str
        Classes that these records can show.
    shape_of : callable
        Gives the measured shape of a class.
    shows_laws : bool
        Whether the drive tells a law from another curve of its class.

    Returns
    -------
    ClassAnswer
        Answer with shares, ties and rivals.
    """
    surface = scores.table.surface
    names = [name for name in candidates if name != surface] + ([surface] if surface else [])
    found = answer_of(scores, shares, decision, names, shape_of=shape_of, note=decision.note)
    return replace(
        found,
        classes=tuple(
            replace(own, law_named=own.law_named and shows_laws and _is_in_ties(found, own.law))
            for own in found.classes
        ),
    )


def _is_in_ties(found: ClassAnswer, law: str) -> bool:
    """Whether a law lies in a class of every tied set: else its own class is not certain."""
    own = set(found.classes_of_law.get(law, ()))
    return all(own.intersection(ids) for ids in found.ties)


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

    Parameters
    ----------
    scores : ClassScores
        Held-out squares of the table.
    shares : Shares
        Gap and floor.
    decision : Decision
        Which classes are named.
    rivals : sequence of str
        Classes whose share alone is told beside the answer.
    shape_of : callable
        Gives the measured shape of a class.
    note : str
        What the records cannot say.
    """
    table, constants = scores.table, scores.constants
    if decision.state == NOTHING:
        return without_classes(decision.state, table, decision.note)
    findings, laws = [], []
    for own in decision.classes:
        finding, law = _finding(scores, shares, decision, own, shape_of)
        findings.append(finding)
        laws.append(law)
    held = decision.held
    learnable = max(shares.of(scores.ceiling()), shares.of(scores.of(decision.best_pair)))
    pair_gains = shares.gain(scores.of(decision.best_pair), held) > constants.least_gain
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
        share=at_most_one(shares.of(held)),
        share_ci95=shares.interval(held),
        learnable=at_most_one(learnable),
        learnt_by=tuple(set(decision.best_pair) - set(decision.classes)) if pair_gains else (),
        law_share=_law_share(scores, shares, laws),
        classes_of_law=classes_of_law(table),
        note=note,
        best=() if is_class else decision.classes,
    )


def _holds(table: GramTable, name: str, classes: Sequence[str]) -> bool:
    """Whether a class is the answer, or contains it: neither is a rival."""
    inside = {group for own in classes for group in table.classes[own]}
    return inside <= set(table.classes[name])


def classes_of_law(table: GramTable) -> Mapping[str, tuple[str, ...]]:
    """Classes that hold each law of a table, in the order of its classes."""
    found: dict[str, tuple[str, ...]] = {}
    for name, laws in table.laws.items():
        for law in laws:
            found[law.id] = (*found.get(law.id, ()), name)
    return found


def without_classes(state: str, table: GramTable, note: str) -> ClassAnswer:
    """Answer of records in which nothing is missing, or nothing is visible.

    Parameters
    ----------
    state : str
        Which of both.
    table : GramTable
        Classes and their laws.
    note : str
        What the records cannot say.
    """
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
        classes_of_law=classes_of_law(table),
        note=note,
    )


def _finding(
    scores: ClassScores, shares: Shares, decision: Decision, own: str, shape_of: ShapeOf
) -> tuple[ClassFinding, NearestLaw]:
    """One class of the answer; in a pair its share is the mean of what it adds alone and second."""
    beside = tuple(name for name in decision.classes if name != own)
    law = nearest_law(scores, shares, own, beside)
    before, other = scores.of(()), scores.of(beside)
    whole = shares.of(decision.held)
    # Each part lies within the whole, and both add up to it, also where one class harms alone.
    share, interval = shares.part(before, other, scores.of((own,)), decision.held)
    if beside:
        share = min(max(share, 0.0), max(whole, 0.0)) / max(whole, 1.0)
    law_share = float("nan")
    if law.held is not None:
        alone = scores.with_law((), law.columns)
        law_share = at_most_one(shares.part(before, other, alone, law.held)[0])
    finding = ClassFinding(
        id=own,
        share=at_most_one(share),
        share_ci95=interval,
        law=law.id,
        law_share=law_share,
        law_named=law.is_equal,
        shape=shape_of(scores, own, decision.held, law),
    )
    return finding, law


def _law_share(scores: ClassScores, shares: Shares, laws: Sequence[NearestLaw]) -> float:
    """Share of the nearest laws together, without any class."""
    known = [law.columns for law in laws if law.id]
    if not known:
        return float("nan")
    return at_most_one(shares.of(scores.with_law((), np.concatenate(known))))
