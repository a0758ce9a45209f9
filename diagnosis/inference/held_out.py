"""How well a set of effects predicts segments of the record that it was not fitted to.

Whole conditions are held out where there are enough, blocks otherwise.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from carrierflex.diagnosis.comparison.problem import BoolArray, FloatArray, Segment
from carrierflex.diagnosis.inference.effect_fit import EffectFit, SegmentCost
from carrierflex.diagnosis.inference.thresholds import Thresholds
from carrierflex.diagnosis.kind.comparison_problem import ComparisonProblem
from carrierflex.identification.estimation.gauss_newton import StopRule
from carrierflex.identification.estimation.resampling import two_level_counts
from carrierflex.identification.estimation.scaled_least_squares import column_lengths, full_inverse

#: With fewer conditions, leaving one out takes away the range of amplitude that the others cannot
#: replace.
_FEWEST_CONDITIONS = 3
#: Groups of blocks where there is one condition.
_BLOCK_GROUPS = 4
#: A fold's fit starts at the fit to all segments, next to its own minimum.
_FOLD_STOP = StopRule(most_steps=4)


@dataclass(frozen=True, eq=False)
class Fold:
    """One split of the segments."""

    #: training, run_specific, held_out: segments that fit what runs share; segments of held-out
    #: runs that fit the parameters of those runs only; segments scored, shape (n_segments,)
    training: BoolArray
    run_specific: BoolArray
    held_out: BoolArray


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Held-out score of one set of effects."""

    fit: EffectFit  # Fit to all segments
    square: FloatArray  # Sum of squared held-out residuals, shape (n_segments,)


def held_out_folds(segments: Sequence[Segment], *, runs_have_own: bool) -> tuple[Fold, ...]:
    """Folds in which every segment is scored once.

    Three conditions or more: leave one condition out; where runs have parameters of their own,
    these are fitted on the even blocks of the held-out runs to score the odd ones, and the other
    way round. Two conditions: half of the blocks of one condition at a time. One condition: a
    quarter of the blocks at a time.
    """
    condition = np.array([segment.condition for segment in segments])
    block = np.array([segment.block for segment in segments])
    names = sorted(set(condition))
    if len(names) >= _FEWEST_CONDITIONS:
        folds = []
        for name in names:
            outside = condition == name
            for parity in (0, 1) if runs_have_own else (None,):
                scored = outside if parity is None else outside & (block % 2 == parity)
                if scored.any():
                    folds.append(Fold(~outside, outside & ~scored, scored))
        return tuple(folds)
    groups = _BLOCK_GROUPS if len(names) == 1 else 2
    index = _numbers_in_condition(condition)
    folds = []
    for name in names:
        for k in range(groups):
            scored = (condition == name) & (index % groups == k)
            if scored.any():
                folds.append(Fold(~scored, np.zeros_like(scored), scored))
    return tuple(folds)


def _numbers_in_condition(condition: np.ndarray) -> np.ndarray:
    """Number of each segment within its condition."""
    index = np.zeros(condition.size, dtype=np.int64)
    for name in set(condition):
        members = np.flatnonzero(condition == name)
        index[members] = np.arange(members.size)
    return index


def held_out_score(problem: ComparisonProblem, fit: EffectFit, folds: Sequence[Fold]) -> HeldOut:
    """Score a set on every fold."""
    square = np.full(len(problem.segments), np.nan)
    for fold in folds:
        theta = fold_theta(problem, fit, fold)
        squares = problem.squares(fit.effects, theta, fold.held_out)
        square[fold.held_out] = squares[fold.held_out].sum(axis=1)
    return HeldOut(fit, square)


def fold_theta(problem: ComparisonProblem, fit: EffectFit, fold: Fold) -> FloatArray:
    """Parameters fitted without the held-out segments, shape (p,).

    Those that the training segments do not determine are fitted to the other segments of the
    held-out runs: the values of these runs, and of a law by itself what acts in no other run, as
    the compliance to a radial load that one run alone has.
    """
    in_training = {problem.segments[k].run for k in np.flatnonzero(fold.training)}
    free = np.array(
        [parameter.run is None or parameter.run in in_training for parameter in fit.parameters],
        dtype=bool,
    )
    # A further law must pay in runs that it was not fitted to.
    if fold.run_specific.any() and len(fit.effects) == 1:
        free &= ~_acts_elsewhere(fit, fold.training)
    training = SegmentCost(
        problem, fit.effects, fit.prior, chosen=fold.training, free=free, stop=_FOLD_STOP
    )
    theta, _ = training.least(fit.theta, fit.sums)
    if fold.run_specific.any() and not free.all():
        theta, _ = replace(training, chosen=fold.run_specific, free=~free).least(theta)
    return theta


def _acts_elsewhere(fit: EffectFit, chosen: BoolArray) -> BoolArray:
    """Parameters that all segments determine and the chosen ones do not, shape (p,).

    Of their signature beside the other parameters' less is there than can be seen.
    """
    every, some = fit.sums.total_matrix(), fit.sums.total_matrix(chosen)
    length = column_lengths(every)
    variance, of_chosen = (
        np.diag(full_inverse((matrix + np.diag(fit.prior.weight)) / np.outer(length, length)))
        for matrix in (every, some)
    )
    return np.asarray(variance < Thresholds().surviving_share ** 2 * of_chosen)


def reduction_draws(
    before: FloatArray,
    after: FloatArray,
    groups: Sequence[str],
    *,
    n_samples: int,
    rng: np.random.Generator,
) -> FloatArray:
    """Draws of RMS after / before by the two-level bootstrap, shape (n_samples,).

    Conditions, then segments within them; with fewer than three conditions segments alone.
    """
    counts = two_level_counts(groups, n_samples=n_samples, rng=rng)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.sqrt((counts @ after) / (counts @ before))
