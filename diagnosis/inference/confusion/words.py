"""Sentences of evidence and confusion."""

import math

from scipy.stats import fisher_exact

from carrierflex.diagnosis.comparison.effect_names import plain_name, set_name
from carrierflex.diagnosis.inference.confusion.results import Answer, Confusion
from carrierflex.diagnosis.inference.evidence.candidates import Evidence
from carrierflex.diagnosis.inference.results import (
    ALIASED,
    AT_NOISE_FLOOR,
    CLASS_NAMED,
    NAMED,
    NAMING,
    NONE_OF_THESE,
    NOT_DIAGNOSABLE,
)

#: Natural logarithm of a factor of evidence that is worth a word: 3 (Kass and Raftery 1995, table
#: in section 3.2: "positive"); below it the candidates are as good.
_POSITIVE = 1.1
#: A rival gives an answer as often where chance would part the counts so far in this share.
_BY_CHANCE = 0.05
#: Power of ten from which a factor is told by its power alone.
_LARGEST_POWER = 3.0

_OTHER = {
    AT_NOISE_FLOOR: "nothing missing",
    NONE_OF_THESE: "no known effect",
    NOT_DIAGNOSABLE: "not diagnosable",
}


def answer_words(answer: Answer) -> str:
    """An answer in a few words: ``cubic stiffness``, ``nothing missing``."""
    if answer.verdict == ALIASED:
        names = " or ".join(plain_name(cause) for cause in answer.causes)
        return f"{names}, not told apart" if names else "classes not told apart"
    if answer.verdict == CLASS_NAMED:
        return f"class: {set_name(answer.causes)}"
    return set_name(answer.causes) if answer.verdict == NAMED else _OTHER[answer.verdict]


def factor_words(log_factor: float) -> str:
    """A factor of evidence, ``12`` or ``10^46``."""
    power = log_factor / math.log(10.0)
    return f"10^{power:.0f}" if power >= _LARGEST_POWER else f"{10.0**power:,.3g}"


def evidence_sentence(evidence: Evidence | None, verdict: str) -> str:
    """Whether evidence and held-out verdict agree; empty where there is no evidence.

    Parameters
    ----------
    evidence : Evidence, optional
        Of the candidates.
    verdict : str
        Held-out verdict.
    """
    if evidence is None:
        return ""
    preferred, accepted = evidence.preferred, evidence.of(evidence.accepted)
    named = set_name(evidence.accepted)
    stands_for = f"names {named}" if verdict in NAMING else f"names no law ({verdict})"
    if accepted is None:
        return ""
    ahead = preferred.log_evidence - accepted.log_evidence
    if ahead > _POSITIVE:
        return (
            f"The held-out verdict {stands_for}, the evidence prefers "
            f"{set_name(preferred.effects)} to {named} by a factor of {factor_words(ahead)}: "
            f"{_why(evidence)}."
        )
    others = [own for own in evidence.candidates if own is not accepted]
    if not others:
        return ""
    next_best = max(others, key=lambda own: own.log_evidence)
    margin = accepted.log_evidence - next_best.log_evidence
    if margin <= _POSITIVE:
        return (
            f"The evidence does not tell {named} from {set_name(next_best.effects)} (a factor of "
            f"{factor_words(abs(margin))})."
        )
    if verdict not in NAMING and evidence.accepted:
        return (
            f"Of the laws the evidence prefers {named}, which the verdict ({verdict}) does not "
            f"name, to {set_name(next_best.effects)} by a factor of {factor_words(margin)}."
        )
    if verdict == ALIASED:
        return (
            f"The held-out verdict does not tell {named} from what is as good, the evidence "
            f"prefers it to {set_name(next_best.effects)} by a factor of {factor_words(margin)}: "
            "it takes the form of every law as exact."
        )
    return (
        f"The evidence prefers {named} too, to {set_name(next_best.effects)} by a factor of "
        f"{factor_words(margin)}."
    )


def _why(evidence: Evidence) -> str:
    """What sets the two measures apart for this pair."""
    preferred, accepted = evidence.preferred.effects, evidence.accepted
    if set(preferred) > set(accepted):
        return (
            "the further effect fits all records better than its prior costs, and does not pass "
            "the rules on records it was not fitted to"
        )
    if set(preferred) < set(accepted):
        return "the smaller set fits nearly as well, and the prior of the further effect costs more"
    return "it fits all records better for the room that its prior leaves"


def confusion_sentences(confusion: Confusion) -> list[str]:
    """How often the answer of the measured campaign comes up where each candidate is true.

    Parameters
    ----------
    confusion : Confusion
        Counts.
    """
    answer = answer_words(confusion.answer)
    first = confusion.rows[0]
    n = len(first.answers)
    counts = ", ".join(
        f"{set_name(row.effects)} {row.count(confusion.answer)} of {n}" for row in confusion.rows
    )
    sentences = [
        f"The answer to the measured campaign ({answer}) comes up in simulated campaigns with this "
        f"as the truth: {counts}."
    ]
    own = confusion.row_of(confusion.named)
    if own is None:
        return sentences
    hits = own.count(confusion.answer)
    for row in confusion.rows:
        if row is own or not row.count(confusion.answer):
            continue
        others = row.count(confusion.answer)
        table = [[hits, n - hits], [others, n - others]]
        if fisher_exact(table, alternative="greater").pvalue > _BY_CHANCE:
            sentences.append(
                f"{_capital(set_name(row.effects))} gives this answer about as often as "
                f"{set_name(own.effects)} ({others} and {hits} of {n}): the answer does not tell "
                "them apart."
            )
    if hits <= n // 2:
        sentences.append(
            f"Where {set_name(own.effects)} is true, these records answer otherwise in {n - hits} "
            f"of {n}."
        )
    return sentences


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
