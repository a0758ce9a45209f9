"""Several causes of like size, none of which pays before the others are in, by known sums."""

from dataclasses import replace

import numpy as np
import pytest

from carrierflex.diagnosis.inference.forward_selection import forward_selection, select_forward
from carrierflex.diagnosis.inference.joint_selection import select_jointly
from carrierflex.diagnosis.inference.screening import screen
from carrierflex.diagnosis.inference.selection import selected
from carrierflex.diagnosis.inference.thresholds import Thresholds
from tests.diagnosis.inference.toy_problem import linear_problem, with_random_noise, write_score

#: Binary fractions, so that a limit can be met exactly.
LIMITS = Thresholds(bootstrap_samples=40, gap_beyond_floor=1.25, named_share_beyond=0.875)
ALIKE = {"a": 6.0, "b": 6.0, "c": 6.0}
EFFECTS = ("a", "b", "c", "d", "e")


def joint(problem, *, limits=LIMITS, scored=()):
    """ForwardSelection after the joint search alone, and the sets that it fitted or scored."""
    search = forward_selection(problem, limits)
    search.score(())
    for effects in scored:
        search.score(effects)
    signatures = problem.signatures()
    select_jointly(search, screen(signatures), signatures)
    return search


def grown(truth, effects=EFFECTS, *, n_channels=2, limits=LIMITS, scored=(), **options):
    """Joint search where the truth is given in units of the noise."""
    sizes = {name: 2.0 * ratio for name, ratio in truth.items()}
    problem = linear_problem(sizes, effects, n_channels=n_channels, noise_std=2.0, **options)
    return joint(problem, limits=limits, scored=scored)


def largest(search):
    return max(search.scores, key=len)


def test_three_causes_of_like_size_are_found_together_though_none_pays_alone():
    problem = linear_problem(ALIKE, EFFECTS, n_channels=2)
    search = forward_selection(problem, LIMITS)
    signatures = problem.signatures()
    select_forward(search, screen(signatures), signatures)
    assert selected(search).accepted == ()
    select_jointly(search, screen(signatures), signatures)
    assert selected(search).accepted == ("a", "b", "c")


def test_the_search_ends_where_nothing_but_noise_is_left():
    search = grown(ALIKE)
    assert largest(search) == ("a", "b", "c")
    assert max(len(effects) for effects in search.fits) == 3


def test_two_causes_and_one_are_found_as_well():
    assert largest(grown({"a": 6.0, "b": 6.0})) == ("a", "b")
    assert largest(grown({"a": 6.0})) == ("a",)


def test_one_channel_tells_no_sum_of_laws_apart():
    assert set(grown(ALIKE, n_channels=1).fits) == {()}
    assert len(grown(ALIKE, n_channels=2).fits) > 1


def test_a_gap_near_the_floor_is_left_alone():
    # Four floors: noise of one, and three from the causes.
    assert set(grown({"a": 1.0, "b": 1.0, "c": 0.99}).fits) == {()}
    assert len(grown({"a": 1.0, "b": 1.0, "c": 1.01}).fits) > 1
    # Four floors exactly.
    problem = linear_problem({"a": 4.0}, EFFECTS, n_channels=2, noise_std=2.0)
    search = forward_selection(problem, LIMITS)
    write_score(search, (), 16.0)
    select_jointly(search, screen(problem.signatures()), problem.signatures())
    assert len(search.fits) > 1


def test_nothing_is_searched_where_a_supported_set_explains_enough():
    # Seven eighths of the gap above the floor.
    enough = grown({"a": 8.0, "outside": 3.02}, scored=[("a",)])
    assert set(enough.fits) == {(), ("a",)}
    short = grown({"a": 8.0, "outside": 3.03}, scored=[("a",)])
    assert len(short.fits) > 2


def test_nothing_is_searched_where_a_supported_set_leaves_the_noise():
    # 25/16 of the floor: a leaves nine sixteenths above it, more than an eighth of the gap.
    truth = {"a": 1.8, "outside": 0.74}
    enough = grown(truth, scored=[("a",)])
    assert set(enough.fits) == {(), ("a",)}
    short = grown({**truth, "outside": 0.76}, scored=[("a",)])
    assert len(short.fits) > 2


def test_the_best_supported_set_tells_whether_enough_is_explained():
    done = grown({"a": 8.0, "b": 6.0}, scored=[("a",), ("a", "b")])
    assert set(done.fits) == {(), ("a",), ("b",), ("a", "b")}


def test_only_a_supported_set_makes_the_search_needless():
    problem = replace(
        linear_problem({"a": -6.0}, {"a": {"a": 1.0}, "b": {"a": 0.9, "own": 0.1}}, n_channels=2),
        bounds={"a": (-5.99, np.inf)},
    )
    search = joint(problem, scored=[("a",)])
    assert search.mean_square(("a",)) < 1.01
    assert ("b",) in search.fits


def test_an_effect_that_explains_a_fifth_of_the_rest_is_added_and_dropped_where_half_is_asked():
    # Outside the library 3.5; d explains 0.22 of what a, b and c leave, or 0.18 of it.
    truth = {**ALIKE, "outside": 3.5}
    tried = grown({**truth, "d": 1.88})
    assert ("a", "b", "c", "d") in tried.scores
    assert selected(tried).accepted == ("a", "b", "c")
    search = grown({**truth, "d": 1.64})
    assert ("a", "b", "c", "d") in search.fits
    assert ("a", "b", "c", "d") not in search.scores
    assert selected(search).accepted == ("a", "b", "c")


def test_no_more_than_the_allowed_effects_are_added():
    search = grown(ALIKE, limits=replace(LIMITS, most_effects=2))
    assert max(len(effects) for effects in search.fits) == 2
    assert len(largest(search)) == 2


def test_the_weakest_is_dropped_first_and_a_pair_is_left_as_it_is():
    # Each of the three explains less than half of what is left without it; c least.
    truth = {"a": 6.0, "b": 5.9, "c": 5.8, "outside": 6.5}
    search = grown(truth)
    assert ("a", "b", "c") in search.scores
    assert ("a", "b") in search.scores
    # The pair stays though neither of it explains half: its members were never scored alone.
    assert not {("a",), ("b",)} & set(search.scores)


def test_members_are_dropped_until_every_one_explains_half():
    truth = {**ALIKE, "outside": 4.0, "d": 2.6, "e": 2.5}
    search = grown(truth)
    assert largest(search) == ("a", "b", "c", "d", "e")
    assert ("a", "b", "c", "d") in search.scores
    assert selected(search).accepted == ("a", "b", "c")
    # Nothing is dropped from a set of which every member pays.
    assert ("a", "b") in search.scores
    assert ("a",) not in search.scores


def test_a_mixture_that_was_taken_first_is_exchanged_for_the_causes_themselves():
    effects = {name: {name: 1.0} for name in ("a", "b", "c")}
    effects["mixture"] = {"a": 0.7, "b": 0.7, "own": 0.14}
    truth = {"a": 8.0, "b": 6.0, "c": 5.0}
    search = grown(truth, effects)
    assert ("mixture",) in search.fits
    assert min(search.fits, key=lambda names: (len(names) != 1, search.fits[names].cost)) == (
        "mixture",
    )
    assert largest(search) == ("a", "b", "c")
    assert selected(search).accepted == ("a", "b", "c")


def test_a_column_of_noise_joins_no_cause():
    for seed in range(3):
        problem = linear_problem(ALIKE, EFFECTS, noise_std=0.0, n_samples=40, seed=seed)
        problem = replace(problem, n_channels=2)
        problem = with_random_noise(replace(problem, noise_std=1.0), np.random.default_rng(seed))
        assert selected(joint(problem)).accepted == ("a", "b", "c")


def test_three_sets_of_a_size_are_extended():
    truth = {"a": 8.0, "b": 6.0, "c": 5.0, "d": 4.0, "e": 3.5, "f": 1.0}
    search = grown(truth, tuple("abcdef"), limits=replace(LIMITS, most_effects=2))
    pairs = {"".join(effects) for effects in search.fits if len(effects) == 2}
    # The four best beside each of a, b and c; members of ab are exchanged for the same ones.
    assert pairs == {"ab", "ac", "ad", "ae", "bc", "bd", "be", "cd", "ce"}


def test_effects_that_explain_nothing_end_the_search_with_the_baseline():
    search = grown({"outside": 6.0})
    assert set(search.scores) == {()}


@pytest.mark.parametrize("effects", [{"a": {"none": 0.0}}])
def test_where_no_column_is_left_the_search_ends(effects):
    assert set(grown({"outside": 6.0}, effects).scores) == {()}


def test_a_set_grows_until_it_leaves_little_more_than_the_noise():
    assert ("a", "b") in grown({"a": 6.0, "b": 0.76, "c": 0.0}).fits
    assert ("a", "b") not in grown({"a": 6.0, "b": 0.74, "c": 0.0}).fits
