"""The answer by class in words: what kind of cause, which law of it, what remains."""

from collections.abc import Sequence
from typing import NamedTuple

from carrierflex.diagnosis.classes.results import (
    LEADING_CLASS,
    NAMED_CLASS,
    NO_CLASS,
    ClassAnswer,
    ClassFinding,
)
from carrierflex.diagnosis.comparison.effect_names import plain_name
from carrierflex.simulation.laws import FORCE_SURFACE

#: Rivals below this share are not listed.
_LEAST_RIVAL = 0.05
_MOST_RIVALS = 4
#: Shares below the first would be rounded to nothing; what is named is the second at least.
_LEAST_SHOWN = 0.005
_SMALLEST = 1e-300


def share_words(value: float) -> str:
    """Share in per cent, never above 100 and never below 0."""
    if value != value:
        return "–"
    inside = min(max(value, 0.0), 1.0)
    if 0.0 < inside < _LEAST_SHOWN:
        return f"below {100.0 * _LEAST_SHOWN:.1f} %"
    return f"{100.0 * inside:.1f} %" if 0.99 <= inside < 0.9995 else f"{100.0 * inside:.0f} %"


def class_names(answer: ClassAnswer) -> str:
    """Classes of an answer in words."""
    return " and ".join(plain_name(name) for name in answer.ids)


def lacking_words(answer: ClassAnswer, effects: Sequence[str]) -> str:
    """What a simulation lacks: named effects, and the classes that none of them follows."""
    if not effects:
        return f"{class_names(answer)}, by no law of the library"
    by_law = {own.id for own in answer.classes if own.law_named and own.law in effects}
    laws = " and ".join(plain_name(effect) for effect in effects)
    others = [plain_name(name) for name in answer.ids if name not in by_law]
    return f"{laws}, and {' and '.join(others)}" if others else laws


def class_sentence(answer: ClassAnswer | None) -> str:
    """Answer by class as one or two sentences; empty where there is none.

    For example ``Restoring force (99 %; next class 42 %): zero below 0.8 mm, stiffening above, one
    side only; no law of the library, nearest backlash 74 %.``
    """
    if answer is None or answer.state not in (NAMED_CLASS, LEADING_CLASS, NO_CLASS):
        return ""
    if answer.state == NO_CLASS:
        best = " and ".join(plain_name(name) for name in answer.best)
        which = f"the best ({best})" if best else "the best"
        return (
            f"No class of effect is named: {which} explains {share_words(answer.share)} of the "
            f"gap, all together {share_words(max(answer.learnable, answer.share))}."
        )
    first, *others = (_finding_words(finding, answer) for finding in answer.classes)
    text = ". ".join([first, *(text[:1].upper() + text[1:] for text in others)])
    if answer.state == LEADING_CLASS:
        text = f"Leading, incomplete: {text}"
    text = text[:1].upper() + text[1:] + "."
    if answer.ties:
        tied = ", ".join(" and ".join(plain_name(n) for n in names) for names in answer.ties)
        text += f" These records do not tell it from {tied}."
    return text


def _finding_words(finding: ClassFinding, answer: ClassAnswer) -> str:
    rival = max(
        (share for name, share in answer.rivals.items() if name not in answer.ids), default=0.0
    )
    alone = len(answer.classes) == 1
    beside = f"; next class {share_words(rival)}" if alone else ""
    # What is named is not nothing: a second cause may add as little as it harms alone.
    share = max(finding.share, _SMALLEST)
    text = f"{plain_name(finding.id)} ({share_words(share)}{beside})"
    if finding.shape is not None and finding.shape.words:
        text += f": {finding.shape.words}"
    return f"{text}; {_law_words(finding, answer)}"


def _law_words(finding: ClassFinding, answer: ClassAnswer) -> str:
    """Law of a class: named, or the nearest with its part of the class."""
    if not finding.law:
        return "no law of the library lies in this class"
    part = finding.law_share / finding.share if finding.share > 0.0 else float("nan")
    if finding.law_named:
        # A surface of deflection and speed holds the laws of one of them: there is more in it.
        own = answer.classes_of_law.get(finding.law, (finding.id,))[0]
        is_part = finding.id == FORCE_SURFACE and own != finding.id
        name = plain_name(finding.law)
        return f"{name} is the part of it that a law follows" if is_part else f"it follows {name}"
    return f"no law of the library, nearest {plain_name(finding.law)} {share_words(part)} of it"


def remaining_words(answer: ClassAnswer | None) -> str:
    """What the answer leaves: law, class beyond it, learnable beyond the class, the rest."""
    if answer is None or not answer.classes:
        return ""
    share = min(max(answer.share, 0.0), 1.0)
    law = min(max(answer.law_share, 0.0), share) if answer.law_share == answer.law_share else 0.0
    rest = max(1.0 - share - answer.beyond_learnable, 0.0)
    text = (
        f"Of the gap above the floor on held-out records the nearest laws explain "
        f"{share_words(law)}, the class beyond them {share_words(share - law)}; "
        f"{share_words(answer.beyond_learnable)} could still be learnt by another class"
    )
    if answer.learnt_by:
        text += f" ({', '.join(plain_name(name) for name in answer.learnt_by)})"
    return f"{text}; {share_words(rest)} by none."


class RivalRow(NamedTuple):
    """Row of the table of classes."""

    name: str
    share: str


def rival_rows(answer: ClassAnswer | None) -> list[RivalRow]:
    """Other classes alone, largest first."""
    if answer is None:
        return []
    ordered = sorted(answer.rivals.items(), key=lambda item: -item[1])
    return [
        RivalRow(plain_name(name), share_words(share))
        for name, share in ordered[:_MOST_RIVALS]
        if share >= _LEAST_RIVAL
    ]
