"""A forward search whose sets are fitted in another process."""

from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

from numpy.testing import assert_allclose

from carrierflex.diagnosis.inference.forward_selection import (
    forward_selection,
    negative_control_scores,
    select_forward,
)
from carrierflex.diagnosis.inference.screening import screen
from carrierflex.diagnosis.inference.thresholds import Thresholds
from tests.diagnosis.inference.toy_problem import linear_problem

LIMITS = Thresholds(bootstrap_samples=40)


def test_a_search_in_another_process_finds_the_same_numbers():
    truth = {"a": 1.0, "c": 0.6}
    problem = linear_problem(truth, ("a", "b", "c", "d"))
    searches = [forward_selection(problem, LIMITS)]
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as executor:
        searches.append(forward_selection(problem, LIMITS, executor=executor))
        for search in searches:
            signatures = search.problem.signatures()
            select_forward(search, screen(signatures), signatures)
            negative_control_scores(search, ("a",))
    here, there = searches
    assert list(here.scores) == list(there.scores)
    assert list(here.fits) == list(there.fits)
    assert here.failed_searches == there.failed_searches
    for effects, score in here.scores.items():
        assert_allclose(there.scores[effects].square, score.square, rtol=0.0, atol=0.0)
        assert_allclose(there.fits[effects].theta, here.fits[effects].theta, rtol=0.0, atol=0.0)
