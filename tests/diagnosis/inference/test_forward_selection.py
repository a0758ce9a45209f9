"""Forward search: why a set is not supported, which sets are tried, when the search ends."""

from concurrent.futures import Future
from dataclasses import replace

import numpy as np
from numpy.testing import assert_allclose

from carrierflex.diagnosis.comparison.problem import BASELINE
from carrierflex.diagnosis.inference.forward_selection import (
    best_beside,
    explained_share,
    forward_selection,
    negative_control_scores,
    select_forward,
)
from carrierflex.diagnosis.inference.screening import screen
from carrierflex.diagnosis.inference.selection import selected
from carrierflex.diagnosis.inference.thresholds import Thresholds
from tests.diagnosis.inference.toy_problem import (
    CONTROL,
    LinearProblem,
    linear_problem,
    with_random_noise,
    write_fit,
    write_score,
)

#: Binary fractions, so that a limit can be met exactly.
LIMITS = Thresholds(
    bootstrap_samples=40,
    explained=0.5,
    material=2.0**-6,
    stands_out=2.0,
    clears=0.875,
)
MUTUAL = {"a": ("b", "c"), "b": ("a", "c"), "c": ("a", "b")}


def search_on(truth, effects=("a", "b", "c", "d"), *, limits=LIMITS, **options):
    return forward_selection(linear_problem(truth, effects, **options), limits)


def reason_of(search, effects):
    """Text of a set's rejection, empty for a supported one."""
    rejection = search.rejection(effects)
    return "" if rejection is None else rejection.text


def rejected(truth, effects, **options):
    return reason_of(search_on(truth, **options), effects)


def written(scores, limits=LIMITS):
    """ForwardSelection with the given held-out mean squares over that of the noise."""
    search = search_on({}, limits=limits, noise_std=2.0)
    for effects, ratio in scores.items():
        write_score(search, effects, 4.0 * np.array(ratio))
    return search


# What a set explains


def test_mean_squares_are_the_known_ones_and_the_floor_is_the_noise():
    search = search_on({"a": 3.0, "b": 2.0}, noise_std=0.5)
    assert_allclose(search.mean_square(()), 13.25)
    assert_allclose(search.mean_square(("a",)), 4.25)
    assert_allclose(search.floor, 0.25)


def test_the_explained_share_is_counted_above_the_floor():
    assert explained_share(9.0, 3.0, 1.0) == 0.75
    assert explained_share(9.0, 11.0, 1.0) == -0.25
    assert explained_share(1.5, 1.25, 1.0) == 0.5
    assert explained_share(1.0, 0.5, 1.0) == 0.0
    assert explained_share(0.5, 0.2, 1.0) == 0.0


def test_a_set_is_the_same_in_any_order_and_fitted_once():
    notes = []
    search = forward_selection(linear_problem({"a": 3.0}), LIMITS, notes.append)
    assert search.score(("b", "a")) is search.score(("a", "b"))
    assert search.fit(("b", "a")) is search.fit(("a", "b"))
    assert notes == ["baseline + a + b"]


def test_a_set_may_be_fitted_after_one_that_contains_it():
    search = search_on({"a": 3.0, "b": 3.0})
    search.score(("a", "b"))
    search.score(("a",))
    assert search.failed_searches == {}


def test_held_out_runs_fit_their_own_parameters_where_they_have_any():
    problem = linear_problem({"a": 3.0})
    assert not any(fold.run_specific.any() for fold in forward_selection(problem, LIMITS).folds)
    problem = replace(problem, runs_own=(BASELINE,))
    assert all(fold.run_specific.any() for fold in forward_selection(problem, LIMITS).folds)


class MixedBaseline(LinearProblem):
    """Problem whose baseline has a parameter of every run beside the one for all."""

    def parameters(self, effects):
        shared = super().parameters(effects)
        return (*shared, replace(shared[0], name="y", run=self.segments[0].run))


def test_one_parameter_of_a_run_is_enough_for_runs_to_have_their_own():
    problem = MixedBaseline(**vars(linear_problem({"a": 3.0})))
    assert all(fold.run_specific.any() for fold in forward_selection(problem, LIMITS).folds)


def test_every_negative_control_is_scored_beside_a_set():
    problem = replace(linear_problem({"a": 3.0, "d": 2.0}), negative_controls=(CONTROL, "d"))
    search = forward_selection(problem, LIMITS)
    scores = negative_control_scores(search, ("a",))
    assert [score.fit.effects for score in scores] == [("a", CONTROL), ("a", "d")]
    assert_allclose([score.square.mean() / 16.0 for score in scores], [5.0, 1.0])


# Why a set is not supported


def test_a_cause_alone_is_supported():
    assert rejected({"a": 4.0}, ("a",)) == ""
    assert rejected({"a": 4.0, "b": 4.0}, ("a", "b")) == ""


def test_an_effect_at_its_physical_bound_is_rejected():
    problem = replace(linear_problem({"a": -4.0, "b": 5.0}), bounds={"a": (0.0, np.inf)})
    search = forward_selection(problem, LIMITS)
    assert reason_of(search, ("a",)) == "x of a is at its physical bound"
    assert reason_of(search, ("a", "b")) == "x of a is at its physical bound"
    assert reason_of(search, ("b",)) == ""


def test_the_baseline_may_be_at_its_bound():
    problem = linear_problem({BASELINE: -1.0, "a": 4.0})
    problem = replace(problem, bounds={BASELINE: (0.0, np.inf)})
    assert reason_of(forward_selection(problem, LIMITS), ("a",)) == ""


class ShortSearch(LinearProblem):
    """Problem whose search for the pair of a and b ends where it begins."""

    def starts(self, effects, known):
        return super().starts(effects, {} if effects == ("a", "b") else known)

    def sums(self, effects, theta, chosen):
        sums = super().sums(effects, theta, chosen)
        if effects != ("a", "b"):
            return sums
        return replace(sums, matrix=0.0 * sums.matrix, right_side=0.0 * sums.right_side)


def test_a_search_that_ends_above_a_smaller_set_supports_nothing():
    truth = {"a": 6.0, "b": 4.0, "c": 4.0}
    search = forward_selection(ShortSearch(**vars(linear_problem(truth))), LIMITS)
    search.score(())
    search.score(("a",))
    reason = reason_of(search, ("b", "a"))
    assert reason.startswith("model a + b contains a and costs")
    assert "more than" in reason
    assert reason_of(search, ("a", "b", "c")) == f"nothing is known without c: {reason}"
    assert search.supported_sets() == [("a",)]


def test_three_laws_of_one_kind_fit_any_curve():
    truth = {"a": 4.0, "b": 4.0, "c": 4.0}
    text = "a + b + c are laws of one kind along one motion: together they fit any curve"
    assert rejected(truth, ("a", "b", "c"), aliases=MUTUAL) == text
    # Not on several channels, where patterns differ; nor two; nor where two are no aliases.
    assert rejected(truth, ("a", "b", "c"), aliases=MUTUAL, n_channels=2) == ""
    assert rejected({"a": 4.0, "b": 4.0}, ("a", "b"), aliases=MUTUAL) == ""
    assert rejected(truth, ("a", "b", "c"), aliases={**MUTUAL, "c": ("a",)}) == ""


def test_an_effect_explains_a_least_share_of_what_is_left_without_it():
    assert rejected({"a": 4.1, "outside": 4.0}, ("a",)) == ""
    text = rejected({"a": 4.0, "outside": 4.1}, ("a",))
    assert text == "a explains 49% of what is left without it"
    # Exactly half of what is above the floor.
    assert reason_of(written({(): 9.0, ("a",): 5.0}), ("a",)) == ""
    assert reason_of(written({(): 9.0, ("a",): 5.01}), ("a",)) != ""
    text = reason_of(written({(): 9.0, ("a",): 13.0}), ("a",))
    assert text == "a explains 0% of what is left without it"


def test_the_member_that_smaller_scored_sets_convict_is_told_first():
    search = search_on({"outside": 5.0})
    search.score(("a",))
    assert reason_of(search, ("a", "b")) == "b explains 0% of what is left without it"
    assert ("b",) not in search.scores


def test_an_effect_beside_others_explains_a_material_part_of_the_whole_gap():
    # A 64th of 128 above the floor; what is left without b does not stand out of it.
    limit = {(): 129.0, ("a",): 3.0, ("b",): 129.0, ("a", "b"): 1.0}
    assert reason_of(written(limit), ("a", "b")) == ""
    text = reason_of(written({**limit, (): 130.0}), ("a", "b"))
    assert text == "b explains less than 2% of the total gap"
    # Alone it needs no part of a larger gap.
    assert reason_of(written({(): 3.0, ("b",): 1.0}), ("b",)) == ""


def test_a_small_effect_beside_a_large_one_is_supported_where_it_clears_what_stands_out():
    # Four floors are left without b; b explains all but an eighth of the three above the floor.
    limit = {(): 1001.0, ("a",): 4.0, ("b",): 1001.0, ("a", "b"): 1.375}
    assert reason_of(written(limit), ("a", "b")) == ""
    assert reason_of(written({**limit, ("a", "b"): 1.376}), ("a", "b")) != ""
    assert reason_of(written({**limit, ("a",): 3.99}), ("a", "b")) != ""


def test_an_effect_that_grows_the_gap_in_some_conditions_is_rejected():
    def rejection(ratio_in_c):
        """One draw in 27 holds condition C alone: more than the 2.5 % that may grow."""
        after = [1.0, 1.0, 1.0, 1.0, 9.0 * ratio_in_c**2, 9.0 * ratio_in_c**2]
        # So many that 3.7 % lie six standard deviations above 2.5 %.
        many = replace(LIMITS, bootstrap_samples=10_000)
        return reason_of(written({(): 9.0, ("a",): after}, many), ("a",))

    assert (
        rejection(1.0011) == "a grows the held-out gap in more than 2.5% of the bootstrap samples"
    )
    # Where it does not act, shared parameters may shift a little.
    assert rejection(1.0009) == ""


def test_the_draws_are_ratios_of_rms_after_over_before():
    search = written({(): 9.0, ("a",): 4.0})
    draws = search.reduction_draws(search.score(()), search.score(("a",)))
    assert draws.shape == (LIMITS.bootstrap_samples,)
    assert_allclose(draws, 2.0 / 3.0)


def test_supported_sets_hold_an_effect_and_no_rejected_one():
    search = search_on({"a": 4.0})
    for effects in ((), ("a",), ("b",), ("a", "b")):
        search.score(effects)
    assert search.supported_sets() == [("a",)]


# Which sets are worth a held-out score


def fitted(squares):
    """ForwardSelection whose fits leave the given mean squares over that of the noise."""
    search = search_on({}, noise_std=2.0)
    for effects, ratio in squares.items():
        write_fit(search, effects, 4.0 * ratio)
    return search


def test_a_set_is_worth_scoring_where_every_step_to_it_pays_on_its_own_data():
    pays = {(): 17.0, ("a",): 9.0, ("b",): 9.0, ("a", "b"): 5.0}
    assert fitted(pays).is_worth_scoring(("a", "b"))
    assert not fitted({**pays, ("a", "b"): 5.01}).is_worth_scoring(("a", "b"))
    # One step is enough to refuse it, the last or the first.
    assert not fitted({**pays, ("a",): 8.9}).is_worth_scoring(("a", "b"))
    assert not fitted({**pays, ("b",): 8.9}).is_worth_scoring(("b", "a"))
    # A smaller set that was never fitted says nothing.
    assert fitted({(): 17.0, ("a",): 9.0, ("a", "b"): 5.0}).is_worth_scoring(("a", "b"))


def test_a_step_of_too_small_a_part_of_the_whole_gap_is_not_worth_scoring():
    limit = {(): 129.0, ("a",): 3.0, ("a", "b"): 1.0}
    assert fitted(limit).is_worth_scoring(("a", "b"))
    assert not fitted({**limit, (): 130.0}).is_worth_scoring(("a", "b"))


def test_nothing_is_left_within_three_per_cent_of_the_floor():
    gap = {(): 1.05}
    assert written({**gap, ("a",): 1.03}).leaves_nothing(("a",))
    assert not written({**gap, ("a",): 1.031}).leaves_nothing(("a",))


def test_nothing_is_left_where_it_is_immaterial_and_does_not_stand_out():
    # A 64th of 64 above the floor.
    assert written({(): 65.0, ("a",): 2.0}).leaves_nothing(("a",))
    assert not written({(): 65.0, ("a",): 2.01}).leaves_nothing(("a",))
    assert written({(): 1001.0, ("a",): 3.99}).leaves_nothing(("a",))
    assert not written({(): 1001.0, ("a",): 4.0}).leaves_nothing(("a",))


# The search


def searched(truth, effects=("a", "b", "c", "d", "e", "f"), *, limits=LIMITS, **options):
    search = search_on(truth, effects, limits=limits, **options)
    signatures = search.problem.signatures()
    select_forward(search, screen(signatures), signatures)
    return search


def sets_of(search, size, sets):
    return {"".join(effects) for effects in sets if len(effects) == size}


def test_one_cause_is_found_and_ends_the_search():
    search = searched({"a": 5.0})
    assert selected(search).accepted == ("a",)
    assert () in search.scores
    # The screen keeps four effects; nothing is left for a pair.
    assert len(search.fits) == 5


def test_a_pair_is_found_and_ends_the_search():
    search = searched({"a": 3.0, "b": 5.0})
    assert selected(search).accepted == ("a", "b")
    assert sets_of(search, 3, search.fits) == set()
    # Only a pair whose every step pays is scored.
    assert sets_of(search, 2, search.scores) == {"ab"}


def test_a_triple_with_clear_steps_is_found():
    truth = {"a": 16.0, "b": 8.0, "c": 4.0, "d": 0.1}
    search = searched(truth)
    assert selected(search).accepted == ("a", "b", "c")
    assert sets_of(search, 4, search.fits) == set()


def test_no_set_is_larger_than_allowed():
    truth = {"a": 16.0, "b": 8.0, "c": 4.0}
    search = searched(truth, limits=replace(LIMITS, most_effects=2))
    assert sets_of(search, 3, search.fits) == set()
    assert sets_of(search, 2, search.scores) == {"ab"}
    assert sets_of(searched(truth, limits=replace(LIMITS, most_effects=1)), 2, search.fits)


def test_a_column_of_noise_is_not_taken_for_a_cause():
    for seed in range(3):
        problem = linear_problem({"a": 3.0}, noise_std=0.0, n_samples=40, seed=seed)
        problem = with_random_noise(replace(problem, noise_std=1.0), np.random.default_rng(seed))
        search = forward_selection(problem, LIMITS)
        signatures = problem.signatures()
        select_forward(search, screen(signatures), signatures)
        assert selected(search).accepted == ("a",)
        alone = {effects for effects in search.scores if effects and "a" not in effects}
        assert alone
        assert not alone & set(search.supported_sets())


def test_the_two_best_singles_are_extended_each_by_the_four_best_beside_it():
    truth = {"a": 6.0, "b": 5.5, "c": 5.0, "d": 4.5, "e": 4.0, "f": 3.5, "g": 3.0}
    search = searched(truth, tuple("abcdefg"))
    assert sets_of(search, 2, search.fits) == {"ab", "ac", "ad", "ae", "bc", "bd", "be"}


def test_the_two_best_survivors_join_a_set_though_its_screen_ranks_them_low():
    # Beside h, which holds most of a and b, five others explain more than they do.
    effects = {name: {name: 1.0} for name in "abcdef"}
    effects["h"] = {"a": 1.0, "b": 1.0, "own": 0.01}
    truth = {"a": 8.0, "b": 7.9, "c": 2.4, "d": 2.3, "e": 2.2, "f": 2.1}
    search = searched(truth, effects)
    pairs = sets_of(search, 2, search.fits)
    survivors = screen(search.problem.signatures()).survivors(LIMITS)
    assert survivors[:2] == ("h", "a")
    assert {"ch", "dh", "eh", "fh", "ah"} <= pairs
    assert "bh" not in pairs


def test_a_single_far_behind_the_best_is_not_extended():
    search = searched({"a": 40.0, "b": 3.0, "c": 2.0, "d": 1.0, "e": 1.0})
    assert sets_of(search, 2, search.fits) == {"ab", "ac", "ad", "ae"}
    # Beside a, 10 floors are left; beside b, nearly ten times as much, and a little more than that.
    near, behind = (searched({"a": square**0.5, "b": 3.0}) for square in (98.0, 100.0))
    assert not all("a" in pair for pair in sets_of(near, 2, near.fits))
    assert all("a" in pair for pair in sets_of(behind, 2, behind.fits))


def test_every_survivor_is_tried_with_effects_that_act_on_others():
    truth = {"a": 6.0, "b": 5.0, "c": 4.0, "d": 3.0, "e": 2.0, "f": 1.0}
    search = searched(truth, tuple("abcdefz"), acting=("z",))
    pairs = sets_of(search, 2, search.fits)
    assert {"az", "bz", "cz", "dz"} <= pairs
    assert "zz" not in pairs
    plain = searched(truth, tuple("abcdefz"))
    assert {"cz", "dz"} & sets_of(plain, 2, plain.fits) == set()


def test_larger_sets_extend_the_best_pair_alone_on_one_channel_and_two_on_several():
    effects = {name: {name: 1.0} for name in "abcde"}
    effects["t"] = {"b": 1.0, "e": 0.2}
    truth = {"a": 16.0, "b": 9.0, "c": 4.0}
    single, several = (searched(truth, effects, n_channels=n) for n in (1, 2))
    assert "ab" in sets_of(single, 2, single.scores)
    assert "at" in sets_of(single, 2, single.scores)
    assert "act" not in sets_of(single, 3, single.fits)
    assert "act" in sets_of(several, 3, several.fits)
    for search in (single, several):
        assert "abc" in sets_of(search, 3, search.scores)
        assert selected(search).accepted == ("a", "b", "c")


def test_pairs_that_do_not_pay_end_the_search():
    # What is outside is more than each of them: nothing is supported, and no triple is tried.
    search = searched({"a": 4.0, "b": 3.0, "c": 2.0, "outside": 6.0})
    assert sets_of(search, 2, search.fits)
    assert sets_of(search, 3, search.fits) == set()
    assert selected(search).accepted == ()


def test_the_search_ends_where_the_best_supported_set_is_smaller_than_the_largest_tried():
    # The pair with b predicts better than a alone, but b is at its bound.
    problem = linear_problem({"a": 8.0, "b": 4.0, "c": 3.0})
    problem = replace(problem, bounds={"b": (-np.inf, 3.9)})
    search = forward_selection(problem, LIMITS)
    signatures = problem.signatures()
    select_forward(search, screen(signatures), signatures)
    assert search.mean_square(("a", "b")) < search.mean_square(("a",))
    assert search.supported_sets() == [("a",)]
    assert sets_of(search, 3, search.fits) == set()


def test_effects_beside_a_set_come_by_what_they_explain_of_the_rest():
    effects = {name: {name: 1.0} for name in "abcdefg"}
    effects["none"] = {"none": 0.0}
    truth = {"a": 9.0, "b": 3.0, "c": 5.0, "d": 4.0, "e": 2.0, "f": 1.0}
    signatures = linear_problem(truth, effects).signatures()
    screened = screen(signatures)
    assert best_beside(("a",), screened, signatures) == ["c", "d", "b", "e"]
    assert best_beside(("c", "d"), screened, signatures) == ["a", "b", "e", "f"]
    assert best_beside(("a", "b", "c", "d", "e", "f"), screened, signatures) == ["g"]


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
    search = forward_selection(problem, LIMITS, notes.append, executor)
    # One alone is done here, as is one that comes twice or is known.
    search.score_all([("a",)])
    search.score_all([("a",), ("c",), ("c",)])
    assert executor.names == []
    search.score_all([("b", "a"), ("a", "c")])
    assert executor.names == ["_fitted_set", "_fitted_set", "_scored_set", "_scored_set"]
    assert set(search.scores) == {("a",), ("c",), ("a", "b"), ("a", "c")}
    assert notes == [f"baseline + {pair}" for pair in ("a", "c", "a + b", "a + c")]
    # The noise, and what b leaves where it is not in the set.
    assert_allclose([search.mean_square(pair) for pair in (("a", "b"), ("a", "c"))], [1.0, 10.0])
