"""Sets of laws that are fitted in another process."""

from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import pytest
from numpy.testing import assert_allclose

from carrierflex.diagnosis.inference.law_fits import law_fits
from carrierflex.diagnosis.inference.thresholds import Thresholds
from tests.diagnosis.inference.toy_problem import linear_problem

LIMITS = Thresholds(bootstrap_samples=40)


@pytest.mark.long
def test_fits_made_in_another_process_are_the_same_numbers():
    problem = linear_problem({"a": 1.0, "c": 0.6})
    singles, pairs = [("a",), ("b",), ("c",)], [("a", "c"), ("a", "b")]
    here = law_fits(problem, LIMITS)
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as executor:
        there = law_fits(problem, LIMITS, executor=executor)
        for fits in (here, there):
            for sets in ([()], singles, pairs):
                fits.score_all(sets)
    assert list(here.scores) == list(there.scores)
    assert list(here.fits) == list(there.fits)
    for effects, score in here.scores.items():
        assert_allclose(there.scores[effects], score, rtol=0.0, atol=0.0)
        assert_allclose(there.fits[effects].theta, here.fits[effects].theta, rtol=0.0, atol=0.0)
