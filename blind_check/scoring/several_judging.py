"""How an answer to several causes at once is judged: cause by cause, and what is false.

found
    A cause whose id stands in the answer or in one of its ties, and in every other of these sets
    itself or an id that the truth's alias table holds for it.
false
    An id of the answer or of a tie that is no cause's, no alias of one and no error that the
    sensors really have; however small the causes are.
tie
    One of answer and ties holds every cause of two floors and none that is false; together with
    the others they do not.

Ids are compared as for one cause: frame and pattern of a carrier, all of a mounting's.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass

from carrierflex.blind_check.labels import Label
from carrierflex.blind_check.truth.carrier.other_forms import OTHER_FORMS
from carrierflex.blind_check.truth.mounting.other_forms import MOUNTING_FORMS

#: Class of each cause by kind, and what it follows where that is told apart.
_CLASS_OF_CAUSE: Mapping[str, Mapping[str, str]] = {
    "carrier": {name: form.shape for name, form in OTHER_FORMS.items()},
    "mounting": {name: form.class_id for name, form in MOUNTING_FORMS.items()},
}


@dataclass(frozen=True)
class JudgedCause:
    """One of several causes.

    Parameters
    ----------
    class_id : str
        Its class, as it is compared.
    gap : float
        Gap over the floor that it leaves alone.
    is_found : bool
        Whether the answer holds it.
    """

    class_id: str
    gap: float
    is_found: bool


@dataclass(frozen=True)
class JudgedCauses:
    """The answer to several causes at once.

    Parameters
    ----------
    causes : tuple of JudgedCause
        Every cause.
    false : tuple of str
        Ids of the answer and its ties that are no cause's.
    in_every_set : bool
        Whether each of answer and ties holds one of them; a tie of what is there with what is not
        does not.
    sets : tuple of JudgedCauses
        Of several sets, each as if it were the whole answer.
    """

    causes: tuple[JudgedCause, ...]
    false: tuple[str, ...]
    in_every_set: bool
    sets: tuple["JudgedCauses", ...] = ()

    def of_gap(self, least: float) -> tuple[JudgedCause, ...]:
        """Causes that leave at least a gap alone."""
        return tuple(cause for cause in self.causes if cause.gap >= least)

    def finds_all(self, least: float) -> bool:
        """Whether every cause is found that leaves at least a gap alone."""
        return all(cause.is_found for cause in self.of_gap(least))

    def is_right(self, least: float) -> bool:
        """Whether every cause is found that leaves at least a gap alone, and none is false."""
        return self.finds_all(least) and not self.false

    def is_tie(self, least: float) -> bool:
        """Whether one of several sets alone is right, and all of them together are not."""
        return not self.is_right(least) and any(
            alternative.is_right(least) for alternative in self.sets
        )


def judge_causes(label: Label, sets: Collection[tuple[str, ...]]) -> JudgedCauses:
    """Judge the answer to several causes.

    Parameters
    ----------
    label : Label
        The truth.
    sets : collection of tuple of str
        Ids of the answer and of each of its ties, as they are compared.
    """
    classes = [_CLASS_OF_CAUSE[label.kind][name] for name in label.effects]
    aliases = {class_id: _aliases_of(label, class_id, classes) for class_id in classes}
    causes = tuple(
        JudgedCause(class_id, gap, _is_found(class_id, aliases[class_id], sets))
        for class_id, gap in zip(classes, label.own_gaps, strict=True)
    )
    allowed = {*classes, *(other for others in aliases.values() for other in others)}
    named = {name for ids in sets for name in ids}
    in_every_set = bool(sets) and not any(allowed.issuperset(ids) for ids in sets)
    each = tuple(judge_causes(label, [ids]) for ids in sorted(sets)) if len(sets) > 1 else ()
    return JudgedCauses(causes, tuple(sorted(named - allowed)), in_every_set, each)


def _aliases_of(label: Label, class_id: str, classes: Collection[str]) -> frozenset[str]:
    """Ids that stand in the place of one of the classes in the truth's alias table."""
    missing = [set(classes) - set(ids) for ids in label.class_aliases]
    instead = [
        set(ids) - set(classes)
        for ids, without in zip(label.class_aliases, missing, strict=True)
        if without == {class_id}
    ]
    return frozenset(name for ids in instead for name in ids)


def _is_found(class_id: str, aliases: frozenset[str], sets: Collection[tuple[str, ...]]) -> bool:
    """Whether one set holds the class, and every other it or an alias."""
    return any(class_id in ids for ids in sets) and all(
        class_id in ids or not aliases.isdisjoint(ids) for ids in sets
    )
