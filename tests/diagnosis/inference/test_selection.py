"""Which set the held-out records support, which others do as well, and the weight of each."""

from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.diagnosis.inference.folds import held_out_folds
from carrierflex.diagnosis.inference.forward_selection import ForwardSelection
from carrierflex.diagnosis.inference.results import RankedSet, Rejection
from carrierflex.diagnosis.inference.selection import Selection, selected
from carrierflex.diagnosis.inference.thresholds import Thresholds
from tests.diagnosis.inference.toy_problem import CONTROL, linear_problem, write_score

LIMITS = Thresholds(equal_rms=1.5, never_equal_rms=2.0)
#: Differences of log density over four blocks: their sum is within its standard error, or beyond.
WITHIN, BEYOND = (3.0, -0.1, 0.0, 0.0), (3.0, 0.1, 0.0, 0.0)


@dataclass(eq=False)
class JudgedSelection(ForwardSelection):
    """ForwardSelection whose rejections are written down."""

    rejected: dict = field(default_factory=dict)

    def rejection(self, effects):
        text = self.rejected.get(effects)
        return None if text is None else Rejection("explained", "", text)


@pytest.fixture
def judged():
    """ForwardSelection of scores by set: mean square, and log density that each block loses."""

    def make(scores, rejected=None):
        problem = linear_problem({"a": 1.0}, gains={"A": 1.0, "B": 1.0})
        folds = held_out_folds(problem.segments, runs_have_own=False)
        search = JudgedSelection(problem, folds, LIMITS, lambda text: None)
        search.rejected = rejected or {}
        for effects, (mean_square, loss) in scores.items():
            write_score(search, effects, mean_square, log_density=-np.array(loss))
        return search

    return make


EQUAL, LITTLE_WORSE = (0.0, 0.0, 0.0, 0.0), (0.1, 0.1, 0.1, 0.1)
BASE = {(): (16.0, (9.0, 9.0, 9.0, 9.0))}


def test_where_every_set_is_rejected_nothing_is_accepted(judged):
    selection = selected(judged({**BASE, ("a",): (1.0, EQUAL)}, {("a",): "too small"}))
    assert selection.accepted == ()
    assert selection.rivals == ()
    assert {ranked.effects: ranked.refused for ranked in selection.ranking} == {
        (): "the baseline",
        ("a",): "too small",
    }


def test_the_baseline_is_no_explanation_however_well_it_predicts(judged):
    selection = selected(judged({(): (1.0, EQUAL), ("a",): (1.5, LITTLE_WORSE)}))
    assert selection.accepted == ("a",)
    assert selection.rivals == ()


def test_the_smaller_of_two_sets_that_predict_alike_is_accepted(judged):
    selection = selected(judged({**BASE, ("a",): (1.1, LITTLE_WORSE), ("a", "b"): (1.0, EQUAL)}))
    assert selection.accepted == ("a",)
    # A larger set is no rival of a smaller one.
    assert selection.rivals == ()


def test_the_larger_set_is_accepted_where_it_predicts_better(judged):
    worse = (1.6**2, LITTLE_WORSE)
    assert selected(judged({**BASE, ("a",): worse, ("a", "b"): (1.0, EQUAL)})).accepted == (
        "a",
        "b",
    )


def test_sets_are_alike_within_one_standard_error_of_the_score(judged):
    def accepted(loss):
        return selected(judged({**BASE, ("a",): (1.6**2, loss), ("a", "b"): (1.0, EQUAL)})).accepted

    assert accepted(WITHIN) == ("a",)
    assert accepted(BEYOND) == ("a", "b")
    # No difference at all is within an error of nothing.
    assert accepted(EQUAL) == ("a",)


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
    scores = {**BASE, ("a",): (rms_ratio**2, LITTLE_WORSE), ("a", "b"): (1.0, EQUAL)}
    assert selected(judged(scores)).accepted == tuple(accepted)


@pytest.mark.parametrize(("rms_ratio", "accepted"), [(2.0, "a"), (2.01, "ab")])
def test_sets_of_very_different_rms_are_never_alike(judged, rms_ratio, accepted):
    scores = {**BASE, ("a",): (rms_ratio**2, WITHIN), ("a", "b"): (1.0, EQUAL)}
    assert selected(judged(scores)).accepted == tuple(accepted)


def test_of_sets_of_one_size_the_likelier_is_accepted_and_the_others_are_its_rivals(judged):
    scores = {
        **BASE,
        ("a",): (1.0, LITTLE_WORSE),
        ("b",): (1.1, EQUAL),
        ("c",): (1.2, (0.2, 0.2, 0.2, 0.2)),
        ("d",): (3.0, (9.0, 9.0, 9.0, 9.0)),
    }
    selection = selected(judged(scores))
    assert selection.accepted == ("b",)
    assert selection.rivals == (("a",), ("c",))


def test_of_sets_of_one_size_the_one_with_fewer_parameters_is_accepted(judged):
    search = judged({**BASE, ("a",): (1.0, EQUAL), ("b",): (1.1, LITTLE_WORSE)})
    score = search.scores[("a",)]
    more = replace(score.fit, parameters=(*score.fit.parameters, score.fit.parameters[-1]))
    search.scores[("a",)] = replace(score, fit=more)
    selection = selected(search)
    assert selection.accepted == ("b",)
    # The other needs more parameters, so that it is no rival either.
    assert selection.rivals == ()


def test_a_rejected_set_is_neither_best_nor_rival(judged):
    scores = {**BASE, ("a",): (4.0, EQUAL), ("b",): (1.0, EQUAL), ("c",): (4.1, EQUAL)}
    selection = selected(judged(scores, {("b",): "at its bound"}))
    assert selection.accepted == ("a",)
    assert selection.rivals == (("c",),)


def test_a_negative_control_is_no_explanation(judged):
    scores = {**BASE, ("a",): (2.0, LITTLE_WORSE), (CONTROL,): (1.0, EQUAL)}
    selection = selected(judged({**scores, ("a", CONTROL): (1.0, EQUAL)}))
    assert selection.accepted == ("a",)
    assert {ranked.effects for ranked in selection.ranking} == {(), ("a",)}


def test_the_ranking_goes_by_weight_then_by_held_out_rms(judged):
    # Two sets share the weight but for a part in a thousand, two without any come after them.
    scores = {
        ("c",): (9.0, (40.0, 40.0, 40.0, 40.0)),
        (): (16.0, (40.0, 40.0, 40.0, 40.0)),
        ("a",): (4.0, EQUAL),
        ("b",): (1.0, (1.6e-6, 1.6e-6, 1.6e-6, 1.6e-6)),
    }
    ranking = selected(judged(scores)).ranking
    assert [ranked.effects for ranked in ranking] == [("b",), ("a",), ("c",), ()]
    assert ranking[0].weight < ranking[1].weight
    assert_allclose([ranked.weight for ranked in ranking], [0.5, 0.5, 0.0, 0.0], atol=5e-4)
    assert_allclose([ranked.held_out_rms for ranked in ranking], [1.0, 2.0, 3.0, 4.0])
    assert_allclose([ranked.elpd for ranked in ranking], [0.0, 0.0, -160.0, -160.0], atol=1e-5)


def test_weight_comes_before_rms_in_the_ranking(judged):
    scores = {**BASE, ("a",): (2.0, EQUAL), ("b",): (1.0, (5.0, 5.0, 5.0, 5.0))}
    assert [ranked.effects for ranked in selected(judged(scores)).ranking][:2] == [("a",), ("b",)]


def test_the_weight_of_classes_is_that_of_the_sets_with_a_member_of_each():
    weights = {("a", "c"): 0.4, ("b", "c", "d"): 0.3, ("a",): 0.2, ("c",): 0.06, (): 0.04}
    ranking = tuple(RankedSet(effects, weight, 1.0, 0.0) for effects, weight in weights.items())
    selection = Selection(("a", "c"), (), ranking)
    assert selection.class_weight((("a", "b"), ("c",))) == pytest.approx(0.7)
    assert selection.class_weight((("a", "b"),)) == pytest.approx(0.9)
    assert selection.class_weight(()) == 0.0


@pytest.mark.parametrize(("mean_square", "accepted"), [(0.0, ("a",)), (np.nan, ())])
def test_a_set_that_leaves_nothing_or_no_number_ends_no_diagnosis(judged, mean_square, accepted):
    # No ratio to zero or NaN is one: before, not even the best set was as good as itself.
    selection = selected(judged({**BASE, ("a",): (mean_square, EQUAL)}))
    assert selection.accepted == accepted
