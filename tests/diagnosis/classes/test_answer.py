"""What an answer tells beside its classes: their parts, laws, rivals, and what could be learnt."""

from dataclasses import replace

import numpy as np
import pytest

from carrierflex.diagnosis.classes.answer import _classes_of_law
from carrierflex.diagnosis.classes.constants import ClassConstants
from carrierflex.diagnosis.classes.decision import Drive, decide
from carrierflex.diagnosis.classes.held_out import ClassScores
from carrierflex.diagnosis.classes.results import NAMED_CLASS, NO_CLASS, NOTHING
from carrierflex.diagnosis.classes.shares import PairedShares, Shares
from tests.diagnosis.classes.toy_table import answer_of_scores, toy_columns, toy_table

COLUMNS = toy_columns()
A, B, MORE = (COLUMNS[name].sum(axis=0) for name in ("a", "b", "more"))
#: What no class holds, as large as a cause.
UNKNOWN = A.std() * np.random.default_rng(9).standard_normal(A.size)


def answered(
    signal, *, candidates=("a", "b", "c", "surface"), columns=COLUMNS, laws=None, **options
):
    """Answer to a signal, noise a fiftieth of a cause in amplitude."""
    table = toy_table(signal, columns, noise=0.03, laws=laws)
    return answer_of_scores(ClassScores(table, ClassConstants()), candidates, **options)


def test_where_nothing_is_missing_no_share_is_told():
    result = answered(np.zeros(A.size), laws={"a": A})
    assert (result.state, result.classes, result.ties, result.rivals) == (NOTHING, (), (), {})
    assert np.isnan([result.share, *result.share_ci95, result.learnable, result.law_share]).all()
    assert result.classes_of_law == {"law_a": ("a",)}


def test_neither_the_answer_nor_a_class_that_holds_it_is_a_rival():
    assert list(answered(A).rivals) == ["b", "c"]
    # Of a pair each one alone is a rival, and the class that holds both is none.
    assert list(answered(A + 0.5 * B).rivals) == ["a", "b", "c"]
    # What the answer holds is less than it.
    result = answered(A + B + MORE)
    assert result.ids == ("surface",)
    assert list(result.rivals) == ["a", "b", "c"]


def test_where_no_class_is_named_all_are_rivals_and_the_best_is_told_with_its_share():
    result = answered(A + 2.0 * UNKNOWN)
    assert (result.state, result.classes, result.ties, result.best) == (NO_CLASS, (), (), ("a",))
    assert list(result.rivals) == ["a", "b", "c", "surface"]
    assert result.rivals["a"] == result.share == pytest.approx(0.2, abs=0.03)
    assert answered(A).best == ()
    # Nor is a tie of it told.
    twice = COLUMNS | {"b": COLUMNS["a"] + 1e-6 * COLUMNS["b"]}
    result = answered(A + 2.0 * UNKNOWN, columns=twice)
    assert (result.state, result.ties) == (NO_CLASS, ())


def test_a_class_that_the_drive_does_not_separate_silences_the_one_that_it_explains_more_than():
    # Alone b explains nine tenths of a.
    near = COLUMNS | {"b": COLUMNS["a"] + 0.35 * COLUMNS["b"]}
    scores = ClassScores(replace(toy_table(A, near), surface=""), ClassConstants())
    result = answer_of_scores(scores, ("b", "c"))
    assert (result.state, result.ids) == (NAMED_CLASS, ("b",))
    result = answer_of_scores(scores, ("b", "c"), inseparable=("a",))
    assert (result.state, result.best) == (NO_CLASS, ("b",))


def test_gains_are_judged_by_the_ratio_of_each_block_where_blocks_are_findings_of_their_own():
    scores = ClassScores(toy_table(A, COLUMNS), ClassConstants())
    for shows_two, kind in ((True, PairedShares), (False, Shares)):
        shares, _ = decide(scores, Drive(tuple("abc"), is_one_line=not shows_two))
        assert type(shares) is kind


def test_the_coupled_class_is_a_rival_only_where_there_is_one():
    table = replace(toy_table(A + 2.0 * UNKNOWN, COLUMNS), surface="")
    result = answer_of_scores(ClassScores(table, ClassConstants()), ("a", "b", "c"))
    assert list(result.rivals) == ["a", "b", "c"]


def test_a_class_that_gains_a_hundredth_of_the_gap_could_be_learnt_beside_the_answer():
    result = answered(A + 0.125 * B + 0.2 * UNKNOWN)
    assert (result.state, result.ids, result.learnt_by) == (NAMED_CLASS, ("a",), ("b",))
    assert result.beyond_learnable == pytest.approx(0.015, abs=0.005)
    # A fourth of a hundredth is not worth a word.
    assert answered(A + 0.05 * B + 0.2 * UNKNOWN).learnt_by == ()
    # Of two causes neither is beside the answer.
    assert answered(A + 0.5 * B).learnt_by == ()


def test_what_can_be_learnt_is_the_most_that_the_best_pair_or_all_classes_explain():
    def learnable(ceiling):
        table = replace(toy_table(A + 0.5 * B, COLUMNS), ceiling=ceiling)
        scores = ClassScores(table, ClassConstants())
        return answer_of_scores(scores, ("a", "c")).learnable

    # The pair of a and c explains what a does, and all classes what b does too.
    assert learnable(("a",)) == pytest.approx(0.8, abs=0.05)
    assert learnable(("b",)) == pytest.approx(0.8, abs=0.05)
    assert learnable(("a", "b", "c")) == pytest.approx(1.0, abs=0.01)


def test_each_class_of_a_pair_has_its_part_and_its_own_law():
    result = answered(A + 0.5 * B, laws={"a": A, "b": B})
    named_laws = [(entry.id, entry.law, entry.law_named) for entry in result.classes]
    assert named_laws == [("a", "law_a", True), ("b", "law_b", True)]
    # Energies of one and of a fourth; a law takes as much as its class.
    assert [entry.share for entry in result.classes] == pytest.approx([0.8, 0.2], abs=0.03)
    assert [entry.law_share for entry in result.classes] == pytest.approx([0.8, 0.2], abs=0.03)
    assert result.law_share == pytest.approx(1.0, abs=0.01)


def test_without_a_law_there_is_no_share_of_laws():
    result = answered(A + 0.5 * B, laws={"b": B})
    assert [entry.law for entry in result.classes] == ["", "law_b"]
    assert np.isnan(result.classes[0].law_share)
    # The law of the one alone is a law of a fifth of the gap.
    assert result.law_share == pytest.approx(0.2, abs=0.05)
    assert np.isnan(answered(A).law_share)


def test_a_law_is_named_where_the_drive_shows_it_and_the_records_cannot_tell_it_from_its_class():
    def is_named(law, **options):
        (entry,) = answered(A, laws={"a": law}, **options).classes
        assert entry.law == "law_a"
        return entry.law_named

    assert is_named(A)
    assert not is_named(A, shows_laws=False)
    assert not is_named(A + 0.5 * COLUMNS["a"][0])


def test_a_law_that_lies_in_one_of_two_tied_classes_is_not_named():
    twice = COLUMNS | {"b": COLUMNS["a"] + 1e-6 * COLUMNS["b"]}
    result = answered(A, columns=twice, laws={"a": A, "b": A})
    assert len(result.ties) == 1
    assert not result.classes[0].law_named


def test_a_law_that_draws_a_part_of_its_class_has_the_share_that_it_explains_itself():
    law = COLUMNS["a"][0]
    (entry,) = answered(A, laws={"a": law}).classes
    # One of three columns of one size.
    assert entry.law_share == pytest.approx(1.0 / 3.0, abs=0.05)
    assert entry.share == pytest.approx(1.0, abs=0.01)
    pair = answered(A + 0.5 * B, laws={"a": law}).classes
    assert pair[0].law_share == pytest.approx(0.8 / 3.0, abs=0.05)


def test_a_law_is_told_with_every_class_that_holds_it_in_their_order():
    table = toy_table(A, COLUMNS, laws={"a": A, "b": B})
    shared = {**table.laws, "c": table.laws["a"]}
    assert _classes_of_law(replace(table, laws=shared)) == {"law_a": ("a", "c"), "law_b": ("b",)}
