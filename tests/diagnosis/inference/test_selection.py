"""Which of the sets that were fitted the held-out records support, and which do as well."""

from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.diagnosis.inference.law_fits import (
    LawFits,
    candidate_sets,
    held_out_folds,
    law_fits,
    selected,
)
from carrierflex.diagnosis.inference.thresholds import Thresholds
from tests.diagnosis.inference.toy_problem import linear_problem, write_score

LIMITS = Thresholds(equal_rms=1.5)


@dataclass(eq=False)
class JudgedFits(LawFits):
    """Fits whose rejections are written down."""

    rejected: dict = field(default_factory=dict)

    def rejection(self, effects):
        return self.rejected.get(effects, "")


@pytest.fixture
def judged():
    """Fits with scores by set: mean square."""

    def make(scores, rejected=None):
        problem = linear_problem({"a": 1.0}, gains={"A": 1.0, "B": 1.0})
        folds = held_out_folds(problem.segments, runs_have_own=False)
        fits = JudgedFits(problem, folds, LIMITS, lambda text: None)
        fits.rejected = rejected or {}
        for effects, mean_square in scores.items():
            write_score(fits, effects, mean_square)
        return fits

    return make


def selection_of(fits):
    """Selection among all sets of laws that have a score."""
    return selected(fits, [laws for laws in fits.scores if laws])


BASE = {(): 16.0}


def test_where_every_set_is_rejected_nothing_is_accepted(judged):
    selection = selection_of(judged({**BASE, ("a",): 1.0}, {("a",): "too small"}))
    assert selection.accepted == ()
    assert selection.rivals == ()
    assert [(ranked.effects, ranked.refused) for ranked in selection.ranking] == [
        (("a",), "too small")
    ]


def test_the_baseline_is_no_explanation_however_well_it_predicts(judged):
    selection = selection_of(judged({(): 1.0, ("a",): 1.5}))
    assert selection.accepted == ("a",)
    assert selection.rivals == ()


def test_the_smaller_of_two_sets_that_predict_alike_is_accepted(judged):
    selection = selection_of(judged({**BASE, ("a",): 1.1, ("a", "b"): 1.0}))
    assert selection.accepted == ("a",)
    # A larger set is no rival of a smaller one.
    assert selection.rivals == ()


def test_the_larger_set_is_accepted_where_it_predicts_better(judged):
    worse = 1.6**2
    assert selection_of(judged({**BASE, ("a",): worse, ("a", "b"): 1.0})).accepted == (
        "a",
        "b",
    )


@pytest.mark.parametrize(
    ("rms_ratio", "accepted"),
    [
        (1.49, "a"),
        (1.5, "a"),
        (1.51, "ab"),
        (2.5, "ab"),
    ],
)
def test_sets_are_alike_where_the_rms_is_within_a_few_per_cent(judged, rms_ratio, accepted):
    scores = {**BASE, ("a",): rms_ratio**2, ("a", "b"): 1.0}
    assert selection_of(judged(scores)).accepted == tuple(accepted)


def test_of_sets_of_one_size_the_best_is_accepted_and_the_others_are_its_rivals(judged):
    scores = {
        **BASE,
        ("a",): 1.1,
        ("b",): 1.0,
        ("c",): 1.2,
        ("d",): 3.0,
    }
    selection = selection_of(judged(scores))
    assert selection.accepted == ("b",)
    assert selection.rivals == (("a",), ("c",))


def test_of_sets_of_one_size_the_one_with_fewer_parameters_is_accepted(judged):
    fits = judged({**BASE, ("a",): 1.0, ("b",): 1.1})
    fit = fits.fits[("a",)]
    fits.fits[("a",)] = replace(fit, parameters=(*fit.parameters, fit.parameters[-1]))
    selection = selection_of(fits)
    assert selection.accepted == ("b",)
    # The other needs more parameters, so that it is no rival either.
    assert selection.rivals == ()


@pytest.mark.parametrize(
    ("alike", "rivals"), [((), ()), ((("a", "b"),), (("a",),)), ((("b", "c"),), ())]
)
def test_laws_that_differ_only_in_what_they_follow_count_as_the_simplest_of_them(
    judged, alike, rivals
):
    """Where the records cannot say what a class follows, more parameters are no argument."""
    fits = judged({**BASE, ("a",): 1.1, ("b",): 1.0})
    fit = fits.fits[("a",)]
    fits.fits[("a",)] = replace(fit, parameters=(*fit.parameters, fit.parameters[-1]))
    library = dict(fits.problem.library)
    card = library["a"]
    second = replace(card.parameters[-1], name="y")
    library["a"] = replace(card, parameters=(*card.parameters, second))
    fits.problem = replace(fits.problem, library=library)
    selection = selected(fits, [("a",), ("b",)], alike=alike)
    assert selection.accepted == ("b",)
    assert selection.rivals == rivals


@pytest.mark.parametrize(
    ("aliases", "left_by_b", "rivals"),
    [
        ((), 1.1, ()),
        (("a",), 1.1, (("a",),)),
        # A law that holds the accepted one predicts as well, and no better.
        (("a",), 0.9, ()),
    ],
)
def test_a_known_alias_of_more_parameters_that_leaves_less_is_a_rival(
    judged, aliases, left_by_b, rivals
):
    fits = judged({**BASE, ("a",): 1.0, ("b",): left_by_b})
    fit = fits.fits[("a",)]
    fits.fits[("a",)] = replace(fit, parameters=(*fit.parameters, fit.parameters[-1]))
    library = dict(fits.problem.library)
    library["b"] = replace(library["a"], id="b", aliases=aliases)
    fits.problem = replace(fits.problem, library=library)
    selection = selection_of(fits)
    assert (selection.accepted, selection.rivals) == (("b",), rivals)


def test_a_rejected_set_is_neither_best_nor_rival(judged):
    scores = {**BASE, ("a",): 4.0, ("b",): 1.0, ("c",): 4.1}
    selection = selection_of(judged(scores, {("b",): "at its bound"}))
    assert selection.accepted == ("a",)
    assert selection.rivals == (("c",),)


def test_the_ranking_goes_by_held_out_rms_and_holds_every_set_that_was_fitted(judged):
    scores = {
        **BASE,
        ("c",): 9.0,
        ("a",): 4.0,
        ("b",): 1.0,
    }
    ranking = selection_of(judged(scores, {("a",): "too small"})).ranking
    assert [ranked.effects for ranked in ranking] == [("b",), ("a",), ("c",)]
    assert_allclose([ranked.held_out_rms for ranked in ranking], [1.0, 2.0, 3.0])
    assert [ranked.refused for ranked in ranking] == ["", "too small", ""]


@pytest.mark.parametrize(("mean_square", "accepted"), [(0.0, ("a",)), (np.nan, ())])
def test_a_set_that_leaves_nothing_or_no_number_ends_no_diagnosis(judged, mean_square, accepted):
    # No ratio to zero or NaN is one: before, not even the best set was as good as itself.
    selection = selection_of(judged({**BASE, ("a",): mean_square}))
    assert selection.accepted == accepted


def test_one_cause_of_two_is_selected_from_fits_and_equal_columns_are_rivals():
    limits = Thresholds(bootstrap_samples=40)
    effects = {"a": {"a": 1.0}, "twin": {"a": -3.0}, "c": {"c": 1.0}}
    sets = [("a",), ("twin",), ("c",), ("a", "c")]
    selection = selected(law_fits(linear_problem({"a": 5.0}, effects), limits), sets)
    assert selection.accepted in {("a",), ("twin",)}
    assert {selection.accepted, *selection.rivals} == {("a",), ("twin",)}
    both = selected(law_fits(linear_problem({"a": 5.0, "c": 4.0}, effects), limits), sets)
    assert (both.accepted, both.rivals) == (("a", "c"), ())
    outside = selected(law_fits(linear_problem({"outside": 5.0}, effects), limits), sets)
    assert (outside.accepted, outside.rivals) == ((), ())


def test_smaller_sets_are_fitted_before_those_that_hold_them():
    notes = []
    fits = law_fits(linear_problem({"a": 5.0}), LIMITS, notes.append)
    selected(fits, [("a", "b"), ("c",), ("a",)])
    assert notes[:4] == [f"baseline{laws}" for laws in ("", " + c", " + a", " + a + b")]


def test_without_a_table_every_law_is_fitted_by_itself():
    problem = linear_problem({"a": 5.0}, ("a", "b", "c"))
    assert candidate_sets(problem, None) == (("a",), ("b",), ("c",))
    # A table that proposes nothing is one.
    assert candidate_sets(problem, ()) == ()


def test_of_the_sets_of_a_table_the_first_twelve_of_laws_on_trial_are_fitted():
    problem = linear_problem({}, tuple("abcdefghijklmn"))
    sets = [(name,) for name in "abcdefghijklmn"]
    assert candidate_sets(problem, sets) == tuple(sets[:12])
    assert candidate_sets(problem, [("a", "z"), ("b", "c")]) == (("b", "c"),)
