"""The measurement that would tell apart two sets of laws that these records cannot."""

from collections.abc import Callable

import numpy as np

from carrierflex.diagnosis.comparison.effect_names import set_name
from carrierflex.diagnosis.comparison.problem import Effects
from carrierflex.diagnosis.inference.effect_fit import EffectFit, fit_effects, mean_square_left
from carrierflex.diagnosis.kind.comparison_problem import CandidateExperiment, ComparisonProblem
from carrierflex.identification.estimation.gauss_newton import StopRule

_EXPERIMENT_STOP = StopRule(most_steps=8)
#: A trial separates two sets that differ there by more than this many noise floors.
_SEPARATES = 1.0
#: It is as good as the best where it separates by this share of it; how many such are listed.
_AS_GOOD, _MOST_OTHERS = 0.8, 3


def separating_trial(
    problem: ComparisonProblem,
    first: EffectFit,
    second: EffectFit,
    note: Callable[[str], None] = lambda text: None,
) -> str:
    """Trial in which the second set, refitted, stays farthest from the signals of the first.

    ``argmax_u min_theta2 |y_1(u) - y_2(u; theta2)|²`` over the feasible trials u (A. C. Atkinson,
    V. V. Fedorov, "The design of experiments for discriminating between two rival models", 1975),
    in words with the difference in noise floors; empty where none separates.
    """
    floor = float(np.sqrt(problem.noise_square.sum() / problem.cell_counts.sum()))
    ratios: dict[str, float] = {}
    for experiment in problem.candidate_experiments():
        note(f"trial: {experiment.text}")
        ratio = _separation(experiment, first, second) / floor
        if np.isfinite(ratio) and ratio > _SEPARATES:
            ratios[experiment.text] = ratio
    if not ratios:
        return ""
    best = max(ratios.values())
    # The first of those that are as good in the order of the trials, not the largest by a hair:
    # the noise of the records does not decide what is recommended.
    text, *others = [trial for trial, ratio in ratios.items() if ratio >= _AS_GOOD * best]
    names = " from ".join(set_name(effects) for effects in _difference(first, second))
    equivalent = f". Equivalent: {', '.join(others[:_MOST_OTHERS])}" if others else ""
    return (
        f"to distinguish {names}, run {text}; predicted difference {ratios[text]:.1f} times the "
        f"noise{equivalent}"
    )


def _separation(experiment: CandidateExperiment, first: EffectFit, second: EffectFit) -> float:
    """RMS by which the second set, refitted, misses the signals of the first; NaN: no trial."""
    problem = experiment.problem(first.effects, first.theta)
    if problem is None:
        return float("nan")
    # A trial may hold another number of runs, and with them of parameters.
    of_second = problem.parameters(second.effects)
    starts = [second.theta] if len(of_second) == second.theta.size else []
    fit = fit_effects(problem, second.effects, starts=starts, stop=_EXPERIMENT_STOP)
    return float(np.sqrt(mean_square_left(problem, fit)))


def _difference(first: EffectFit, second: EffectFit) -> tuple[Effects, Effects]:
    """Effects in which two sets differ; the sets themselves where one holds the other."""
    only_first = tuple(effect for effect in first.effects if effect not in second.effects)
    only_second = tuple(effect for effect in second.effects if effect not in first.effects)
    if only_first and only_second:
        return only_first, only_second
    return first.effects, second.effects
