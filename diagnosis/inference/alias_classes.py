"""S4: which effects these records cannot tell apart, and the measurement that could."""

import numpy as np

from carrierflex.diagnosis.comparison.effect_names import set_name
from carrierflex.diagnosis.comparison.problem import (
    CandidateExperiment,
    ComparisonProblem,
    Effects,
    FloatArray,
)
from carrierflex.diagnosis.inference.effect_fit import EffectFit, fit_effects, mean_square_left
from carrierflex.diagnosis.inference.forward_selection import ForwardSelection
from carrierflex.diagnosis.inference.screening import Screen
from carrierflex.diagnosis.inference.thresholds import Thresholds
from carrierflex.identification.estimation.gauss_newton import StopRule

#: Exchange tests for one effect at most, most correlated first.
_MOST_EXCHANGES = 4
_EXPERIMENT_STOP = StopRule(most_steps=8)
#: A trial is as good as the best where it separates by this share of it; how many are told.
_AS_GOOD, _MOST_OTHERS = 0.8, 3


def alias_class(
    search: ForwardSelection, screened: Screen, accepted: Effects, effect: str
) -> Effects:
    """Effects that reproduce a fitted one within the noise, the effect itself first.

    Effects whose projected signature is correlated with its signature, and the aliases on its card
    that reached forward selection, are put to the exchange test: refit the other effect to the
    simulated signals of the fitted one.

    Parameters
    ----------
    search : ForwardSelection
        Fitted sets.
    screened : Screen
        Correlations of the signatures.
    accepted : tuple of str
        Accepted set.
    effect : str
        Its member that is exchanged.

    Returns
    -------
    tuple of str
        The class.
    """
    problem, thresholds = search.problem, search.thresholds
    fit = search.score(accepted).fit
    others = [
        screened_effect.id
        for screened_effect in screened.effects
        if screened_effect.id not in accepted
    ]
    related = [
        other
        for other in others
        if screened.correlated(effect, other) >= thresholds.alias_correlation
        or (other,) in search.scores
    ]
    related.sort(key=lambda other: -screened.correlated(effect, other))
    simulated = problem.with_signals_of(fit.effects, fit.theta)
    members = [effect]
    for other in related[:_MOST_EXCHANGES]:
        search.note(f"exchange test: {other} for {effect}")
        exchanged = tuple(sorted((*(name for name in accepted if name != effect), other)))
        remainder = _left_over(simulated, exchanged, search)
        if remainder < thresholds.exchange_ratio * np.sqrt(search.floor):
            members.append(other)
    return tuple(members)


def discriminating_experiment_between(
    search: ForwardSelection, first: EffectFit, second: EffectFit
) -> str:
    """T-optimal measurement.

    Where the second set, refitted, stays farthest from the signals of the first.

    ``argmax_u min_theta2 |y_1(u) - y_2(u; theta2)|²`` over the problem's feasible trials.

    Parameters
    ----------
    search : ForwardSelection
        ComparisonProblem and progress.
    first, second : EffectFit
        Sets that these records cannot tell apart.

    Returns
    -------
    str
        The trial in words with the difference in noise floors; empty where none separates.

    References
    ----------
    .. [1] A. C. Atkinson, V. V. Fedorov, "The design of experiments for discriminating between two
       rival models" (1975).
    """
    ratios: dict[str, float] = {}
    for experiment in search.problem.candidate_experiments():
        search.note(f"trial: {experiment.text}")
        ratio = _separation(experiment, first, second) / np.sqrt(search.floor)
        if np.isfinite(ratio) and ratio > search.thresholds.separates:
            ratios[experiment.text] = float(ratio)
    if not ratios:
        return ""
    best = max(ratios.values())
    # The first of those that are as good in the order of the trials, not the largest by a hair:
    # the noise of the records does not decide what is recommended.
    text, *others = [own for own, ratio in ratios.items() if ratio >= _AS_GOOD * best]
    names = " and ".join(set_name(effects) for effects in _difference(first, second))
    also = f"; as good: {', '.join(others[:_MOST_OTHERS])}" if others else ""
    return (
        f"{text} separates {names}: they would differ by {ratios[text]:.1f} noise floors "
        f"there{also}"
    )


def _separation(experiment: CandidateExperiment, first: EffectFit, second: EffectFit) -> float:
    """RMS by which the second set, refitted, misses the first one's signals; NaN without a trial.

    The trial's products are let go before those of the next one are made.
    """
    problem = experiment.problem(first.effects, first.theta)
    if problem is None:
        return float("nan")
    # A trial may hold another number of runs, and with them of parameters.
    of_second = problem.parameters(second.effects)
    starts = [second.theta] if len(of_second) == second.theta.size else []
    fit = fit_effects(problem, second.effects, starts=starts, stop=_EXPERIMENT_STOP)
    return _rms(problem, fit)


def _difference(first: EffectFit, second: EffectFit) -> tuple[Effects, Effects]:
    """Effects in which two sets differ; the sets themselves where one holds the other."""
    only_first = tuple(effect for effect in first.effects if effect not in second.effects)
    only_second = tuple(effect for effect in second.effects if effect not in first.effects)
    if only_first and only_second:
        return only_first, only_second
    return first.effects, second.effects


def is_named_consistently(
    thresholds: Thresholds, fit: EffectFit, theta_by_fold: FloatArray
) -> bool:
    """Whether no added effect moves, between folds, by more than its error and half its signal.

    The change of an effect's signal is ``(d' M d)^1/2`` with M the Gauss-Newton matrix of its
    parameters: several of them may trade against one another in a fold that cannot tell them apart.
    """
    std = np.sqrt(np.maximum(np.diag(fit.covariance), 0.0))
    limit = thresholds.fold_signal**2
    matrix = fit.sums.total_matrix()
    for effect in fit.effects:
        named = [
            k
            for k, parameter in enumerate(fit.parameters)
            if parameter.effect == effect and not parameter.shape and parameter.run is None
        ]
        block, theta = matrix[np.ix_(named, named)], fit.theta[named]
        for moved in theta_by_fold[:, named] - theta:
            beyond_error = (np.abs(moved) > thresholds.fold_consistency * std[named]).any()
            if beyond_error and moved @ block @ moved > limit * (theta @ block @ theta):
                return False
    return True


def _left_over(simulated: ComparisonProblem, exchanged: Effects, search: ForwardSelection) -> float:
    starts = [search.scores[exchanged].fit.theta] if exchanged in search.scores else []
    return _rms(simulated, fit_effects(simulated, exchanged, starts=starts))


def _rms(problem: ComparisonProblem, fit: EffectFit) -> float:
    return float(np.sqrt(mean_square_left(problem, fit)))
