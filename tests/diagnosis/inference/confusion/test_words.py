"""Sentences say how often an answer comes up, and where evidence and verdict disagree."""

from types import SimpleNamespace

from carrierflex.diagnosis.inference.confusion.document import confusion_document, evidence_document
from carrierflex.diagnosis.inference.confusion.results import Answer, Confusion, ConfusionRow
from carrierflex.diagnosis.inference.confusion.words import (
    answer_words,
    confusion_sentences,
    evidence_sentence,
)
from carrierflex.diagnosis.inference.evidence.candidates import CandidateEvidence, Evidence

CUBIC = Answer("named", ("cubic_stiffness",))
QUINTIC = Answer("named", ("quintic_stiffness",))
NOTHING = Answer("at_noise_floor")


def row(effects, *answers):
    return ConfusionRow(effects, answers, tuple((13, 0, 0, k) for k in range(len(answers))))


def counted(cubic, quintic):
    rows = (
        row((), *[NOTHING] * 4),
        row(("cubic_stiffness",), *cubic),
        row(("quintic_stiffness",), *quintic),
    )
    return Confusion(CUBIC, ("cubic_stiffness",), rows, ("cubic_stiffness",))


def weighed(*logs, accepted=("cubic_stiffness",)):
    sets = ((), ("cubic_stiffness",), ("quintic_stiffness",), ("backlash", "cubic_stiffness"))
    candidates = tuple(
        CandidateEvidence(effects, value, 0.25, SimpleNamespace())
        for effects, value in zip(sets, logs, strict=False)
    )
    return Evidence(candidates, accepted, accepted, 1000.0, 500.0, 1e-6, False)


def test_a_rival_that_never_gives_the_answer_is_not_said_to():
    sentences = confusion_sentences(counted([CUBIC] * 4, [QUINTIC] * 4))
    assert len(sentences) == 1
    assert "baseline alone 0 of 4, cubic stiffness 4 of 4, quintic stiffness 0 of 4" in sentences[0]


def test_a_rival_that_gives_the_answer_as_often_is_said_to():
    sentences = confusion_sentences(
        counted([CUBIC] * 3 + [QUINTIC], [CUBIC, CUBIC, QUINTIC, QUINTIC])
    )
    assert "Quintic stiffness gives this answer about as often as cubic stiffness" in sentences[1]
    assert "(2 and 3 of 4)" in sentences[1]


def test_an_answer_that_its_own_truth_rarely_gives_is_said_to():
    sentences = confusion_sentences(counted([CUBIC] + [NOTHING] * 3, [QUINTIC] * 4))
    assert (
        "Where cubic stiffness is true, these records answer otherwise in 3 of 4" in sentences[-1]
    )


def test_columns_begin_with_the_measured_campaigns_answer():
    found = counted([CUBIC] * 3 + [QUINTIC], [QUINTIC] * 4)
    assert found.columns == (CUBIC, QUINTIC, NOTHING)
    assert found.counts(found.rows[1]) == (3, 1, 0)
    document = confusion_document(found)
    assert document["diagnoses"] == 12
    assert document["rows"][1]["draws"] == [0, 0, 0, 1]
    assert document["answers"][0] == {"verdict": "named", "causes": ("cubic_stiffness",)}
    assert confusion_document(None) is None


def test_evidence_that_agrees_says_by_how_much():
    text = evidence_sentence(weighed(0.0, 30.0, 25.4), "named")
    assert text == (
        "The evidence prefers cubic stiffness too, to quintic stiffness by a factor of 99.5."
    )
    law = evidence_sentence(weighed(0.0, 30.0, 25.4), "class_named")
    assert law.startswith(
        "Of the laws the evidence prefers cubic stiffness, which the verdict (class"
    )
    tied = evidence_sentence(weighed(0.0, 30.0, 25.4), "aliased")
    assert "does not tell cubic stiffness from what is as good, the evidence prefers it to" in tied
    assert "10^13" in evidence_sentence(weighed(0.0, 30.0, -30.0), "named")


def test_evidence_that_disagrees_names_both_and_why():
    text = evidence_sentence(weighed(0.0, 20.0, 25.0), "named")
    assert "The held-out verdict names cubic stiffness, the evidence prefers quintic" in text
    assert "by a factor of 148" in text
    larger = evidence_sentence(weighed(0.0, 20.0, 3.0, 26.0), "named")
    assert "the further effect fits all records better than its prior costs" in larger
    unnamed = evidence_sentence(weighed(0.0, 20.0, accepted=()), "none_of_these")
    assert "names no law (none_of_these), the evidence prefers cubic stiffness" in unnamed


def test_evidence_of_equals_is_said_to_tell_nothing():
    text = evidence_sentence(weighed(0.0, 20.0, 20.5), "aliased")
    assert "does not tell cubic stiffness from quintic stiffness" in text
    assert evidence_document(None, "not_diagnosable") is None


def test_answers_in_words():
    assert answer_words(NOTHING) == "nothing missing"
    tied = Answer("aliased", ("cubic_stiffness", "quintic_stiffness"))
    assert answer_words(tied) == "cubic stiffness or quintic stiffness, not told apart"
    assert answer_words(Answer("class_named", ("hysteresis",))) == "class: hysteresis"
