"""How one answer is judged against its label.

An answer names where its verdict is ``named``, ``named_with_remainder`` or ``aliased``;
``at_noise_floor``, ``none_of_these`` and ``not_diagnosable`` name nothing; an error is an answer
that is always wrong.

single, aliased, one_condition
    Right where it names, and each withheld effect is met by exactly one named effect: one of the
    ids that the label holds acceptable, or one whose listed alias class holds the withheld effect.
    Every other named effect must be ``present`` in the label (a sensor's real error), else the
    answer is wrong.
pair
    The same with two withheld effects: both must be met.
nothing, outside
    Right where it names nothing. Any name is a false one, with a remainder or without.
model
    :mod:`carrierflex.blind_check.scoring.model_judging`.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from carrierflex.blind_check.labels import MODEL, NOTHING, OUTSIDE, Label
from carrierflex.blind_check.scoring.model_judging import is_right, model_classes
from carrierflex.blind_check.sealing.verdicts import ERROR, Verdict
from carrierflex.blind_check.truth.alias_table import class_of
from carrierflex.diagnosis.inference.results import NAMING

NO_NAME = "no effect"


@dataclass(frozen=True)
class Judged:
    """A case with its label, its answer and whether that is right."""

    label: Label
    verdict: Verdict
    named: tuple[str, ...]
    is_right: bool

    @property
    def has_effect(self) -> bool:
        """Whether an effect of the library was withheld."""
        return self.label.family not in (NOTHING, OUTSIDE) and bool(self.label.effects)

    @property
    def true_class(self) -> str:
        """Row of the confusion matrix."""
        if self.label.family == MODEL:
            return " + ".join(self.label.classes) or "as drawn"
        if not self.has_effect:
            return self.label.family
        return " + ".join(
            sorted(class_of(self.label.kind, effect) for effect in self.label.effects)
        )

    @property
    def answered_class(self) -> str:
        """Column of the confusion matrix: the true class where the answer is right."""
        if self.verdict.document["verdict"] == ERROR:
            return ERROR
        if self.label.family == MODEL and (classes := model_classes(self.verdict, self.named)):
            return " + ".join(sorted(classes))
        if not self.named:
            return NO_NAME
        if self.is_right:
            return self.true_class
        return " + ".join(sorted({class_of(self.label.kind, effect) for effect in self.named}))


def judge(label: Label, verdict: Verdict) -> Judged:
    """Judge the answer to one case.

    Parameters
    ----------
    label : Label
        The truth.
    verdict : Verdict
        What the diagnosis said.

    Returns
    -------
    Judged
        Named effects, and whether the answer is right.
    """
    document = verdict.document
    named = tuple(document.get("effects", ())) if document["verdict"] in NAMING else ()
    if label.family == MODEL:
        answers = document["verdict"] != ERROR
        return Judged(label, verdict, named, answers and is_right(label, verdict, named))
    if label.family in (NOTHING, OUTSIDE):
        return Judged(label, verdict, named, not named and document["verdict"] != ERROR)
    aliases = {effect: {effect} for effect in named}
    for members in document.get("aliases", ()) if named else ():
        for effect in set(members) & set(named):
            aliases[effect] |= set(members)
    return Judged(label, verdict, named, _meets(label, aliases))


def judged_cases(
    labels: Mapping[str, Label], verdicts: Mapping[str, Verdict]
) -> tuple[Judged, ...]:
    """Judge every case.

    Raises
    ------
    ValueError
        Where a label has no verdict, or a verdict no label.
    """
    if set(labels) != set(verdicts):
        odd = ", ".join(sorted(set(labels) ^ set(verdicts))[:3])
        raise ValueError(
            f"labels and verdicts are of other cases ({odd}); expected one verdict for each label"
        )
    return tuple(judge(labels[case], verdicts[case]) for case in sorted(labels))


def _meets(label: Label, aliases: Mapping[str, set[str]]) -> bool:
    unused = set(aliases)
    # Exact names first: in a pair, a member of one's class must not take the place of the other's
    # own name.
    for effect, acceptable in sorted(
        zip(label.effects, label.acceptable, strict=True), key=lambda pair: pair[0] not in aliases
    ):
        fitting = [
            claimed
            for claimed in sorted(unused)
            if claimed in acceptable or effect in aliases[claimed]
        ]
        if not fitting:
            return False
        unused.remove(effect if effect in fitting else fitting[0])
    return unused <= set(label.present)
