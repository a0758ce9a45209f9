"""Which effects the records cannot tell apart, and which measurement could."""

from dataclasses import replace
from typing import ClassVar

import numpy as np
import pytest

from carrierflex.diagnosis.comparison.problem import BASELINE, CandidateExperiment
from carrierflex.diagnosis.inference.alias_classes import (
    alias_class,
    discriminating_experiment_between,
    is_named_consistently,
)
from carrierflex.diagnosis.inference.effect_fit import EffectFit, fit_effects
from carrierflex.diagnosis.inference.forward_selection import forward_selection
from carrierflex.diagnosis.inference.screening import screen
from carrierflex.diagnosis.inference.thresholds import Thresholds
from tests.diagnosis.inference.toy_problem import LinearProblem, linear_problem

LIMITS = Thresholds(bootstrap_samples=20)
#: A column that shares 0.8 of its length with another, and has 0.6 of its own.
NEAR = {"a": 0.8, "own": 0.6}


def classed(truth, effects, accepted=("a",), effect="a", *, scored=(), noise_std=1.0, **limits):
    """Class of an effect of an accepted set, and what was exchanged for it."""
    problem = linear_problem(truth, effects, noise_std=noise_std)
    notes = []
    search = forward_selection(problem, replace(LIMITS, **limits), notes.append)
    for single in scored:
        search.score((single,))
    members = alias_class(search, screen(problem.signatures()), accepted, effect)
    return members, [text for text in notes if text.startswith("exchange")]


def test_equal_columns_are_one_class_and_others_are_none():
    effects = {"a": {"a": 1.0}, "twin": {"a": -3.0}, "c": {"c": 1.0}}
    members, exchanged = classed({"a": 5.0}, effects)
    assert members == ("a", "twin")
    assert exchanged == ["exchange test: twin for a"]


def test_a_correlated_column_is_parted_where_the_effect_is_large_enough():
    # The other column leaves 0.6 of the signal; two floors are the limit.
    effects = {"a": {"a": 1.0}, "near": NEAR}
    assert classed({"a": 3.30}, effects)[0] == ("a", "near")
    assert classed({"a": 3.36}, effects)[0] == ("a",)
    assert classed({"a": 3.36}, effects, exchange_ratio=2.1)[0] == ("a", "near")
    # The limit goes with the noise.
    assert classed({"a": 6.60}, effects, noise_std=2.0)[0] == ("a", "near")
    assert classed({"a": 6.72}, effects, noise_std=2.0)[0] == ("a",)


def test_only_correlated_or_scored_effects_are_exchanged():
    effects = {"a": {"a": 1.0}, "near": NEAR}
    screened = screen(linear_problem({"a": 1.0}, effects).signatures())
    correlation = screened.correlated("a", "near")
    assert correlation == pytest.approx(0.8)
    assert classed({"a": 1.0}, effects, alias_correlation=correlation)[0] == ("a", "near")
    assert classed({"a": 1.0}, effects, alias_correlation=0.81)[0] == ("a",)
    assert classed({"a": 1.0}, effects, alias_correlation=0.81, scored=("near",))[0] == (
        "a",
        "near",
    )


def test_an_effect_is_exchanged_beside_the_others_of_its_set():
    # Beside c a column of both reproduces a, which it could not alone.
    effects = {"a": {"a": 1.0}, "c": {"c": 1.0}, "sum": {"a": 0.8, "c": 0.6}, "e": {"c": 0.9}}
    truth = {"a": 9.0, "c": 9.0}
    members, exchanged = classed(truth, effects, accepted=("a", "c"))
    assert members == ("a", "sum")
    assert exchanged == ["exchange test: sum for a"]
    members, _ = classed(truth, effects, accepted=("a", "c"), effect="c", alias_correlation=0.5)
    assert members == ("c", "e", "sum")


def test_the_four_most_correlated_are_exchanged_most_correlated_first():
    shares = {"n1": 0.75, "n2": 0.95, "n3": 0.85, "n4": 0.9, "n5": 0.8}
    effects = {"a": {"a": 1.0}}
    for name, share in shares.items():
        effects[name] = {"a": share, name: np.sqrt(1.0 - share**2)}
    members, exchanged = classed({"a": 1.0}, effects)
    assert exchanged == [f"exchange test: {name} for a" for name in ("n2", "n4", "n3", "n5")]
    assert members == ("a", "n2", "n4", "n3", "n5")


def experiment(text, effects, *, gain=1.0, gains=None):
    """Measurement in which the columns are others, with the signals of the model given."""

    def problem(names, theta):
        problem = linear_problem({}, effects, gains=gains)
        return problem.with_signals_of(names, gain * theta)

    return CandidateExperiment(text, problem)


def separated(candidate_experiments, truth=4.0, noise_std=1.0, sets=(("a",), ("b",))):
    effects = {"a": {"a": 1.0}, "b": {"a": 2.0}, "c": {"c": 1.0}}
    problem = linear_problem({"a": truth, "c": 3.0}, effects, noise_std=noise_std)
    problem = replace(problem, candidates=tuple(candidate_experiments))
    notes = []
    search = forward_selection(problem, LIMITS, notes.append)
    fits = [fit_effects(problem, effects) for effects in sets]
    return discriminating_experiment_between(search, *fits), notes


ALIKE = {"a": {"a": 1.0}, "b": {"a": 2.0}}
APART = {"a": {"a": 1.0}, "b": {"b": 1.0}}
HALF_APART = {"a": {"a": 1.0}, "b": {"a": 0.8, "b": 0.6}}


def test_the_measurement_with_the_largest_difference_is_proposed():
    candidate_experiments = [
        experiment("half", HALF_APART),
        experiment("whole", APART),
        experiment("same", ALIKE),
    ]
    text, notes = separated(candidate_experiments)
    # With columns apart all of a signal of 4 is left, in noise of 1.
    assert text == "whole separates a and b: they would differ by 4.0 noise floors there"
    assert notes == ["trial: half", "trial: whole", "trial: same"]
    assert separated(candidate_experiments[::-1])[0] == text
    assert (
        "half separates a and b: they would differ by 2.4 noise"
        in separated(candidate_experiments[:1])[0]
    )
    assert "differ by 8.0 noise floors" in separated(candidate_experiments, noise_std=0.5)[0]
    # Of two alike the first.
    assert separated([experiment("one", APART), experiment("two", APART)])[0].startswith("one")


def test_trials_that_are_as_good_are_told_beside_the_first_of_them_three_at_most():
    # 0.81 and 0.79 of the signal are left where the columns share the rest.
    def sharing(left):
        return {"a": {"a": 1.0}, "b": {"a": np.sqrt(1.0 - left**2), "b": left}}

    good, worse = (experiment(str(left), sharing(left)) for left in (0.81, 0.79))
    whole = [experiment(name, APART) for name in ("one", "two", "three", "four")]
    assert separated([good, worse, whole[0]])[0] == (
        "0.81 separates a and b: they would differ by 3.2 noise floors there; as good: one"
    )
    assert separated([worse, *whole])[0].endswith("there; as good: two, three, four")
    assert separated([*whole, good])[0].endswith("there; as good: two, three, four")


def test_a_measurement_separates_what_two_sets_do_not_share():
    beside = {**APART, "c": {"c": 1.0}}
    text, _ = separated([experiment("trial", beside)], sets=(("a", "c"), ("b", "c")))
    assert text == "trial separates a and b: they would differ by 4.0 noise floors there"
    # Where one set holds the other it is that set and what it lacks.
    text, _ = separated([experiment("trial", beside)], sets=(("a", "c"), ("a",)))
    assert text == "trial separates a + c and a: they would differ by 3.0 noise floors there"


def test_no_measurement_is_proposed_where_the_difference_is_within_the_noise():
    assert separated([experiment("same", ALIKE)])[0] == ""
    assert separated([experiment("whole", APART)], truth=0.99)[0] == ""
    assert separated([experiment("whole", APART)], truth=1.01)[0] != ""
    assert separated([])[0] == ""


def test_a_trial_in_which_the_model_diverges_is_passed_over():
    candidate_experiments = [
        CandidateExperiment("diverges", lambda names, theta: None),
        experiment("infinite", APART, gain=np.nan),
        experiment("half", HALF_APART),
    ]
    assert separated(candidate_experiments)[0].startswith("half separates")


def test_a_trial_may_hold_other_runs_than_the_records():
    def under(names, theta):
        short = linear_problem({"a": 4.0}, APART, gains={"X": 1.0}, noise_std=0.0)
        return replace(short, runs_own=("b",), noise_std=1.0)

    problem = linear_problem({"a": 4.0}, ALIKE)
    problem = replace(problem, runs_own=("b",), candidates=(CandidateExperiment("one run", under),))
    search = forward_selection(problem, LIMITS)
    assert len(problem.parameters(("b",))) == 4
    text = discriminating_experiment_between(
        search, *(fit_effects(problem, (name,)) for name in ("a", "b"))
    )
    assert text == "one run separates a and b: they would differ by 4.0 noise floors there"


class WatchedProblem(LinearProblem):
    """Problem that writes down the last parameter of every set it is evaluated for."""

    evaluated: ClassVar[list[float]] = []

    def squares(self, effects, theta, chosen):
        self.evaluated.append(theta[-1])
        return super().squares(effects, theta, chosen)


def test_a_trial_starts_at_the_fitted_values_too():
    def problem(names, theta):
        problem = linear_problem({}, HALF_APART).with_signals_of(names, theta)
        return WatchedProblem(**vars(problem))

    WatchedProblem.evaluated.clear()
    separated([CandidateExperiment("watched", problem)])
    # The records say 2, the trial's own best is 3.2.
    assert 2.0 in np.round(WatchedProblem.evaluated, 4)
    assert 3.2 in np.round(WatchedProblem.evaluated, 4)


class FitWithError(EffectFit):
    """Fit with an error of a quarter in the parameter of the effect."""

    covariance = np.diag([0.01, 0.0625])


@pytest.fixture
def fitted():
    """Fit of a = 2."""
    fit = fit_effects(linear_problem({"a": 2.0}), ("a",))
    return FitWithError(**vars(replace(fit, theta=np.array([0.0, 2.0]))))


def moved(fit, change, effect="a"):
    """Values of three folds, of which the last is moved."""
    theta = np.array([fit.theta, fit.theta, fit.theta])
    theta[2, [parameter.effect for parameter in fit.parameters].index(effect)] += change
    return theta


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_an_effect_is_named_where_it_moves_within_its_error_or_half_its_signal(fitted, sign):
    limits = replace(LIMITS, fold_consistency=2.0)
    # Half of its signal is one, two errors are a half: the larger counts.
    assert is_named_consistently(limits, fitted, moved(fitted, sign))
    assert not is_named_consistently(limits, fitted, moved(fitted, 1.01 * sign))
    # Six errors are one and a half.
    limits = replace(LIMITS, fold_consistency=6.0)
    assert is_named_consistently(limits, fitted, moved(fitted, 1.5 * sign))
    assert not is_named_consistently(limits, fitted, moved(fitted, 1.51 * sign))


def test_an_effect_is_judged_by_its_signal_in_all_conditions():
    problem = linear_problem({"a": 2.0}, gains={"A": 0.0, "B": 0.0, "C": 1.0})
    fit = fit_effects(problem, ("a",))
    assert not is_named_consistently(LIMITS, fit, moved(fit, 1.5))


def test_the_baseline_shapes_and_runs_own_parameters_may_move(fitted):
    distant = moved(fitted, 9.0)
    assert is_named_consistently(LIMITS, fitted, moved(fitted, 9.0, effect=BASELINE))
    for change in ({"shape": True}, {"run": "RA"}):
        parameters = (fitted.parameters[0], replace(fitted.parameters[1], **change))
        assert is_named_consistently(LIMITS, replace(fitted, parameters=parameters), distant)
    assert not is_named_consistently(LIMITS, fitted, distant)


def test_every_added_effect_must_stay_where_it_is():
    fit = fit_effects(linear_problem({"a": 2.0, "b": 2.0}), ("a", "b"))
    for effect in ("a", "b"):
        assert not is_named_consistently(LIMITS, fit, moved(fit, 1.5, effect=effect))
