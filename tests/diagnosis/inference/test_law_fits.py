"""Sets of laws fitted once: what a set explains, and why it is not supported."""

from concurrent.futures import Future
from dataclasses import replace

import numpy as np
from numpy.testing import assert_allclose

from carrierflex.diagnosis.comparison.problem import BASELINE
from carrierflex.diagnosis.inference.law_fits import explained_share, law_fits
from carrierflex.diagnosis.inference.thresholds import Thresholds
from tests.diagnosis.inference.toy_problem import LinearProblem, linear_problem, write_score

#: Binary fractions, so that a limit can be met exactly.
LIMITS = Thresholds(
    bootstrap_samples=40,
    explained=0.5,
    material=2.0**-6,
    stands_out=2.0,
    clears=0.875,
)


def fits_of(truth, effects=("a", "b", "c", "d"), *, limits=LIMITS, **options):
    return law_fits(linear_problem(truth, effects, **options), limits)


def rejected(truth, effects, **options):
    return fits_of(truth, **options).rejection(effects)


def written(scores, limits=LIMITS):
    """Fits with the given held-out mean squares over that of the noise."""
    fits = fits_of({}, limits=limits, noise_std=2.0)
    for effects, ratio in scores.items():
        write_score(fits, effects, 4.0 * np.array(ratio))
    return fits


# What a set explains


def test_mean_squares_are_the_known_ones_and_the_floor_is_the_noise():
    fits = fits_of({"a": 3.0, "b": 2.0}, noise_std=0.5)
    assert_allclose(fits.mean_square(()), 13.25)
    assert_allclose(fits.mean_square(("a",)), 4.25)
    assert_allclose(fits.floor, 0.25)


def test_the_explained_share_is_counted_above_the_floor():
    assert explained_share(9.0, 3.0, 1.0) == 0.75
    assert explained_share(9.0, 11.0, 1.0) == -0.25
    assert explained_share(1.5, 1.25, 1.0) == 0.5
    assert explained_share(1.0, 0.5, 1.0) == 0.0
    assert explained_share(0.5, 0.2, 1.0) == 0.0


def test_a_set_is_the_same_in_any_order_and_fitted_once():
    notes = []
    fits = law_fits(linear_problem({"a": 3.0}), LIMITS, notes.append)
    assert fits.score(("b", "a")) is fits.score(("a", "b"))
    assert fits.fit(("b", "a")) is fits.fit(("a", "b"))
    assert notes == ["baseline + a + b"]


def test_a_set_may_be_fitted_after_one_that_contains_it():
    fits = fits_of({"a": 3.0, "b": 3.0})
    fits.score(("a", "b"))
    fits.score(("a",))
    assert fits.failed_searches == {}


def test_held_out_runs_fit_their_own_parameters_where_they_have_any():
    problem = linear_problem({"a": 3.0})
    assert all(len(fold.scored) == 1 for fold in law_fits(problem, LIMITS).folds)
    problem = replace(problem, runs_own=(BASELINE,))
    assert all(len(fold.scored) == 2 for fold in law_fits(problem, LIMITS).folds)


class MixedBaseline(LinearProblem):
    """Problem whose baseline has a parameter of every run beside the one for all."""

    def parameters(self, effects):
        shared = super().parameters(effects)
        return (*shared, replace(shared[0], name="y", run=self.segments[0].run))


def test_one_parameter_of_a_run_is_enough_for_runs_to_have_their_own():
    problem = MixedBaseline(**vars(linear_problem({"a": 3.0})))
    assert all(len(fold.scored) == 2 for fold in law_fits(problem, LIMITS).folds)


# Why a set is not supported


def test_a_cause_alone_is_supported():
    assert rejected({"a": 4.0}, ("a",)) == ""
    assert rejected({"a": 4.0, "b": 4.0}, ("a", "b")) == ""


def test_an_effect_at_its_physical_bound_is_rejected():
    problem = replace(linear_problem({"a": -4.0, "b": 5.0}), bounds={"a": (0.0, np.inf)})
    fits = law_fits(problem, LIMITS)
    assert fits.rejection(("a",)) == "x of a is at its physical bound within the noise"
    assert fits.rejection(("a", "b")) == "x of a is at its physical bound within the noise"
    assert fits.rejection(("b",)) == ""


def test_the_baseline_may_be_at_its_bound():
    problem = linear_problem({BASELINE: -1.0, "a": 4.0})
    problem = replace(problem, bounds={BASELINE: (0.0, np.inf)})
    assert law_fits(problem, LIMITS).rejection(("a",)) == ""


class ShortSearch(LinearProblem):
    """Problem whose search for the pair of a and b ends where it begins."""

    def starts(self, effects, known):
        return super().starts(effects, {} if effects == ("a", "b") else known)

    def sums(self, effects, theta, chosen, free=None):
        sums = super().sums(effects, theta, chosen)
        if effects != ("a", "b"):
            return sums
        return replace(sums, matrix=0.0 * sums.matrix, right_side=0.0 * sums.right_side)


def test_a_search_that_ends_above_a_smaller_set_supports_nothing():
    truth = {"a": 6.0, "b": 4.0, "c": 4.0}
    fits = law_fits(ShortSearch(**vars(linear_problem(truth))), LIMITS)
    fits.score(())
    fits.score(("a",))
    reason = fits.rejection(("b", "a"))
    assert reason.startswith("model a + b contains a and costs")
    assert "more than" in reason
    assert fits.rejection(("a", "b", "c")) == f"no result without c: {reason}"
    assert fits.rejection(("a",)) == ""


def test_an_effect_explains_a_least_share_of_what_is_left_without_it():
    assert rejected({"a": 4.1, "outside": 4.0}, ("a",)) == ""
    text = rejected({"a": 4.0, "outside": 4.1}, ("a",))
    assert text == "a explains 49% of the gap left without it"
    # Exactly half of what is above the floor.
    assert written({(): 9.0, ("a",): 5.0}).rejection(("a",)) == ""
    assert written({(): 9.0, ("a",): 5.01}).rejection(("a",)) != ""
    text = written({(): 9.0, ("a",): 13.0}).rejection(("a",))
    assert text == "a explains 0% of the gap left without it"


def test_the_member_that_smaller_scored_sets_convict_is_told_first():
    fits = fits_of({"outside": 5.0})
    fits.score(("a",))
    assert fits.rejection(("a", "b")) == "b explains 0% of the gap left without it"
    assert ("b",) not in fits.scores


def test_an_effect_beside_others_explains_a_material_part_of_the_whole_gap():
    # A 64th of 128 above the floor; what is left without b does not stand out of it.
    limit = {(): 129.0, ("a",): 3.0, ("b",): 129.0, ("a", "b"): 1.0}
    assert written(limit).rejection(("a", "b")) == ""
    text = written({**limit, (): 130.0}).rejection(("a", "b"))
    assert text == "b explains less than 2% of the total gap"
    # Alone it needs no part of a larger gap.
    assert written({(): 3.0, ("b",): 1.0}).rejection(("b",)) == ""


def test_a_small_effect_beside_a_large_one_is_supported_where_it_clears_what_stands_out():
    # Four floors are left without b; b explains all but an eighth of the three above the floor.
    limit = {(): 1001.0, ("a",): 4.0, ("b",): 1001.0, ("a", "b"): 1.375}
    assert written(limit).rejection(("a", "b")) == ""
    assert written({**limit, ("a", "b"): 1.376}).rejection(("a", "b")) != ""
    assert written({**limit, ("a",): 3.99}).rejection(("a", "b")) != ""


def test_an_effect_that_grows_the_gap_in_some_conditions_is_rejected():
    def growing(ratio_in_c):
        """One draw in 27 holds condition C alone: more than the 2.5 % that may grow."""
        after = [1.0, 1.0, 1.0, 1.0, 9.0 * ratio_in_c**2, 9.0 * ratio_in_c**2]
        # So many that 3.7 % lie six standard deviations above 2.5 %.
        many = replace(LIMITS, bootstrap_samples=10_000)
        return written({(): 9.0, ("a",): after}, many)

    text = "a grows the held-out gap in more than 2.5% of the bootstrap samples"
    assert growing(1.0011).rejection(("a",)) == text
    # Where it does not act, shared parameters may shift a little.
    assert growing(1.0009).rejection(("a",)) == ""


def test_the_draws_are_ratios_of_rms_after_over_before():
    fits = written({(): 9.0, ("a",): 4.0})
    draws = fits.reduction_draws(fits.score(()), fits.score(("a",)))
    assert draws.shape == (LIMITS.bootstrap_samples,)
    assert_allclose(draws, 2.0 / 3.0)


class AtOnce:
    """Executor that does at once what it is given, and counts it."""

    def __init__(self):
        self.names = []

    def submit(self, function, *arguments):
        self.names.append(function.__name__)
        future = Future()
        future.set_result(function(*arguments))
        return future


def test_sets_that_do_not_wait_for_each_other_are_fitted_and_scored_elsewhere():
    executor = AtOnce()
    problem = linear_problem({"a": 5.0, "b": 3.0})
    notes = []
    fits = law_fits(problem, LIMITS, notes.append, executor)
    # One alone is done here, as is one that comes twice or is known.
    fits.score_all([("a",)])
    fits.score_all([("a",), ("c",), ("c",)])
    assert executor.names == []
    fits.score_all([("b", "a"), ("a", "c")])
    assert executor.names == ["_fitted_set", "_fitted_set", "_scored_set", "_scored_set"]
    assert set(fits.scores) == {("a",), ("c",), ("a", "b"), ("a", "c")}
    assert notes == [f"baseline + {pair}" for pair in ("a", "c", "a + b", "a + c")]
    # The noise, and what b leaves where it is not in the set.
    assert_allclose([fits.mean_square(pair) for pair in (("a", "b"), ("a", "c"))], [1.0, 10.0])
