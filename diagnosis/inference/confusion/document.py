"""Evidence and confusion as keys of diagnosis.json."""

from typing import Any

from carrierflex.diagnosis.inference.confusion.results import Answer, Confusion
from carrierflex.diagnosis.inference.confusion.words import confusion_sentences, evidence_sentence
from carrierflex.diagnosis.inference.evidence.candidates import Evidence


def evidence_document(evidence: Evidence | None, verdict: str) -> dict[str, Any] | None:
    """Content of the key ``evidence``; None (null) where there is none.

    Parameters
    ----------
    evidence : Evidence, optional
        Of the candidates.
    verdict : str
        Held-out verdict.
    """
    if evidence is None:
        return None
    return {
        "text": evidence_sentence(evidence, verdict),
        "samples": evidence.n_samples,
        "independent_samples": evidence.n_effective,
        "noise_std": evidence.noise_std,
        "noise_is_unknown": evidence.noise_is_unknown,
        "candidates": [
            {
                "effects": candidate.effects,
                "log_evidence": candidate.log_evidence,
                "share": candidate.share,
            }
            for candidate in evidence.candidates
        ],
    }


def confusion_document(confusion: Confusion | None) -> dict[str, Any] | None:
    """Content of the key ``confusion``; None (null) where it was not asked for.

    Parameters
    ----------
    confusion : Confusion, optional
        Counts.
    """
    if confusion is None:
        return None
    return {
        "text": " ".join(confusion_sentences(confusion)),
        "diagnoses": confusion.n_diagnoses,
        "noise_of": confusion.noise_of,
        "answers": [_answer(answer) for answer in confusion.columns],
        "rows": [
            {
                "effects": row.effects,
                "counts": confusion.counts(row),
                "draws": [confusion.columns.index(answer) for answer in row.answers],
                "seeds": row.seeds,
            }
            for row in confusion.rows
        ],
    }


def _answer(answer: Answer) -> dict[str, Any]:
    return {"verdict": answer.verdict, "causes": answer.causes}
