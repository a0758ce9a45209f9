"""How one answer is judged by class of the missing cause, and its law apart from that.

The answer is the ids of ``classes``; ``class_ties`` are sets of ids that the records cannot tell
from it.

right
    The ids equal the truth's set. With ties: the truth's set is the answer or one of the ties, and
    every other stands in the truth's own alias table. With nothing missing, or a cause outside
    every class: no class is named.
tie
    The truth's set is among the answer and its ties, beside others that the table does not hold.
wrong
    Any other answer that names a class.
abstained, silent
    No class: the diagnosis says that something is missing that it cannot name, or that nothing is
    to be seen. An error is its own outcome.

Kind carrier compares frame and pattern; what a class follows is judged apart. A class of an error
that the sensors really have may stand beside the truth's.

Several causes at once are judged one by one
(:mod:`carrierflex.blind_check.scoring.several_judging`): right where every cause of two floors is
found and none is false; a tie where one of the answer and its ties alone is that; else wrong.

A named law is false where none of its classes is the truth's or in its alias table.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from carrierflex.blind_check.labels import SEVERAL, Label
from carrierflex.blind_check.scoring.several_judging import JudgedCauses, judge_causes
from carrierflex.blind_check.sealing.verdicts import ERROR, Verdict
from carrierflex.blind_check.truth.carrier.other_forms import CLASSES_OF_LAW as CARRIER_LAWS
from carrierflex.blind_check.truth.element.families import CLASSES_OF_LAW as ELEMENT_LAWS
from carrierflex.blind_check.truth.mounting.other_forms import CLASSES_OF_LAW as MOUNTING_LAWS

#: Gap over the floor from which a class has to be found.
CLEAR_CLASS_GAP = 2.0
#: Classes of each law by kind.
CLASSES_OF_LAW: Mapping[str, Mapping[str, tuple[str, ...]]] = {
    "carrier": CARRIER_LAWS,
    "element": ELEMENT_LAWS,
    "mounting": MOUNTING_LAWS,
}
#: Kinds whose answers are all judged by class.
CLASS_KINDS = ("element",)
#: A class whose records do not tell what it follows.
UNDETERMINED = "undetermined"
#: Parts of a class's id that are frame, pattern and what it follows.
_N_ID_FIELDS = 3

OUTCOMES = ("right", "tie", "wrong", "abstained", "silent", "error")
RIGHT, TIE, WRONG, ABSTAINED, SILENT, FAILED = OUTCOMES
_SEES_NOTHING = ("at_noise_floor", "not_diagnosable")
_NAMES_NO_LAW = ("none_of_these", *_SEES_NOTHING, ERROR)


@dataclass(frozen=True)
class ClassJudged:
    """A case with its label, its answer and what that is worth.

    Parameters
    ----------
    label : Label
        The truth.
    verdict : Verdict
        What the diagnosis said.
    answer : tuple of str
        Class ids of the answer, sorted.
    outcome : str
        One of OUTCOMES.
    laws : tuple of str
        Laws that are named.
    false_laws : tuple of str
        Those whose class is wrong.
    causes : JudgedCauses, optional
        Of several causes at once, each by itself.
    """

    label: Label
    verdict: Verdict
    answer: tuple[str, ...]
    outcome: str
    laws: tuple[str, ...]
    false_laws: tuple[str, ...]
    causes: JudgedCauses | None = None

    @property
    def has_class(self) -> bool:
        """Whether a class holds what is missing."""
        return not self.label.has_no_class

    @property
    def truth(self) -> str:
        """The truth's classes in words."""
        return " + ".join(self.label.classes) if self.has_class else self.label.family

    @property
    def answered(self) -> str:
        """The answer in words: its classes, ties included, or the outcome without any."""
        if not self.answer:
            return self.outcome if self.outcome in (ABSTAINED, SILENT, FAILED) else "no class"
        sets = sorted({self.answer, *_ties(self.verdict.document)})
        return " or ".join(" + ".join(ids) for ids in sets)

    @property
    def follows_right(self) -> bool | None:
        """Whether what every class of a right answer follows is the truth's too.

        None where the answer is not right, or leaves it open.
        """
        is_determined = not any(name.endswith(f"/{UNDETERMINED}") for name in self.answer)
        is_asked = self.has_class and all(
            name.count("/") + 1 == _N_ID_FIELDS for name in self.label.classes
        )
        if self.outcome != RIGHT or not is_asked or not is_determined:
            return None
        return set(self.label.classes) <= set(self.answer)

    @property
    def largest_change(self) -> float:
        """Largest change of form of the causes."""
        return max(self.label.changes, default=0.0)


def judge_by_class(label: Label, verdict: Verdict) -> ClassJudged:
    """Judge the answer to one case.

    Parameters
    ----------
    label : Label
        The truth.
    verdict : Verdict
        What the diagnosis said.

    Returns
    -------
    ClassJudged
        Outcome and laws.
    """
    document = verdict.document
    names_laws = document["verdict"] not in _NAMES_NO_LAW
    laws = tuple(document.get("effects", ())) if names_laws else ()
    if "classes" in document:
        answer = _sorted([entry["id"] for entry in document["classes"] or ()])
    else:
        answer = _sorted({_class_of_law(law, label) for law in laws})
    false = tuple(law for law in laws if not _is_of_truth(law, label))
    sets = {_compared(ids, label) for ids in (answer, *_ties(document))}
    causes = judge_causes(label, sets) if label.family == SEVERAL else None
    outcome = _outcome(label, document, answer, sets, names_law=bool(laws))
    if causes is not None and outcome in (RIGHT, TIE, WRONG):
        outcome = _of_causes(causes)
    return ClassJudged(label, verdict, answer, outcome, laws, false, causes)


def is_judged_by_class(label: Label) -> bool:
    """Whether the answer to a case is judged by class: of some kinds all, of others some."""
    return label.kind in CLASS_KINDS or bool(label.drive)


def cases_judged_by_class(
    labels: Mapping[str, Label], verdicts: Mapping[str, Verdict]
) -> tuple[ClassJudged, ...]:
    """Judge every case of the kinds that are judged by class."""
    return tuple(
        judge_by_class(label, verdicts[case])
        for case, label in sorted(labels.items())
        if is_judged_by_class(label)
    )


def _outcome(
    label: Label,
    document: Mapping[str, Any],
    answer: tuple[str, ...],
    sets: set[tuple[str, ...]],
    *,
    names_law: bool,
) -> str:
    if document["verdict"] == ERROR:
        return FAILED
    if label.has_no_class:
        return WRONG if answer or names_law else RIGHT
    if not answer:
        return SILENT if document["verdict"] in _SEES_NOTHING else ABSTAINED
    true = _compared(label.classes, label)
    if true not in sets:
        return WRONG
    others = sets - {true}
    return RIGHT if others <= set(label.class_aliases) else TIE


def _of_causes(causes: JudgedCauses) -> str:
    """Outcome of an answer to several causes."""
    if causes.is_right(CLEAR_CLASS_GAP):
        return RIGHT
    return TIE if causes.is_tie(CLEAR_CLASS_GAP) else WRONG


def _compared(ids: Sequence[str], label: Label) -> tuple[str, ...]:
    """What is compared of a set of classes: frame and pattern of a carrier, else all of each."""
    if label.kind in CLASS_KINDS:
        return tuple(ids)
    real = {name for effect in label.present for name in CLASSES_OF_LAW[label.kind][effect]}
    shapes = {
        name.rpartition("/")[0] if name.count("/") + 1 == _N_ID_FIELDS else name for name in ids
    }
    return _sorted(shapes - real)


def _class_of_law(law: str, label: Label) -> str:
    """Class of a law for answers that name laws alone; the law itself where no class holds it."""
    return CLASSES_OF_LAW[label.kind].get(law, (law,))[0]


def _is_of_truth(law: str, label: Label) -> bool:
    """Whether a class of the law is the truth's, or in its alias table."""
    if label.has_no_class:
        return False
    true = {*label.classes, *(member for ids in label.class_aliases for member in ids)}
    # A law of the user, or of a later library, is of no class that this table knows.
    if label.kind in CLASS_KINDS:
        return not true.isdisjoint(ELEMENT_LAWS.get(law, ()))
    of_truth = _compared(tuple(true), label)
    of_law = CLASSES_OF_LAW[label.kind].get(law, ())
    return law in label.present or not set(of_truth).isdisjoint(of_law)


def _ties(document: Mapping[str, Any]) -> list[tuple[str, ...]]:
    return [_sorted(ids) for ids in document.get("class_ties") or ()]


def _sorted(ids: Any) -> tuple[str, ...]:
    return tuple(sorted(str(name) for name in ids))
