"""How well a set of effects predicts segments of the record that it was not fitted to.

Whole conditions are held out where there are enough, blocks otherwise.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from carrierflex.diagnosis.comparison.problem import BoolArray, FloatArray, Segment
from carrierflex.diagnosis.inference.effect_fit import EffectFit, minimised
from carrierflex.diagnosis.kind.comparison_problem import ComparisonProblem
from carrierflex.identification.estimation.gauss_newton import StopRule
from carrierflex.identification.estimation.resampling import two_level_counts

#: With fewer conditions, leaving one out takes away the range of amplitude that the others cannot
#: replace.
_FEWEST_CONDITIONS = 3
#: Groups of blocks where there is one condition.
_BLOCK_GROUPS = 4
#: A fold's fit starts at the fit to all segments, next to its own minimum.
_FOLD_STOP = StopRule(most_steps=4)
#: Largest squared miss of one cell that still counts, in variances.
_WORST = 1e12


@dataclass(frozen=True, eq=False)
class Fold:
    """One split of the segments."""

    name: str  # What is left out, in words
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
    #: Log predictive density, leftover of training as discrepancy, shape (n_segments,)
    log_density: FloatArray
    theta_by_fold: FloatArray  # Parameters of every fold, shape (n_folds, p)

    @property
    def elpd(self) -> float:
        """Expected log predictive density, summed over the segments."""
        return float(self.log_density.sum())


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
                    folds.append(Fold(f"condition {name}", ~outside, outside & ~scored, scored))
        return tuple(folds)
    groups = _BLOCK_GROUPS if len(names) == 1 else 2
    index = _numbers_in_condition(condition)
    folds = []
    for name in names:
        for k in range(groups):
            scored = (condition == name) & (index % groups == k)
            if scored.any():
                folds.append(
                    Fold(
                        f"blocks {k + 1} of {groups} of {name}",
                        ~scored,
                        np.zeros_like(scored),
                        scored,
                    )
                )
    return tuple(folds)


def _numbers_in_condition(condition: np.ndarray) -> np.ndarray:
    """Number of each segment within its condition."""
    index = np.zeros(condition.size, dtype=np.int64)
    for name in set(condition):
        members = np.flatnonzero(condition == name)
        index[members] = np.arange(members.size)
    return index


def held_out_score(problem: ComparisonProblem, fit: EffectFit, folds: Sequence[Fold]) -> HeldOut:
    """Score a set on every fold.

    ``elpd = sum log N(r; 0, s²)`` over the segments and cells, with s² the mean square that the
    fold's fit leaves in that cell of its training segments, never below the noise.
    """
    n_segments = len(problem.segments)
    square = np.full(n_segments, np.nan)
    log_density = np.full(n_segments, np.nan)
    thetas = []
    # The discrepancy of the training segments: their residual at the fit to all segments is as
    # good, and one run cheaper.
    trained = problem.squares(fit.effects, fit.theta, np.ones(n_segments, dtype=bool))
    for fold in folds:
        theta = fold_theta(problem, fit, fold)
        squares = problem.squares(fit.effects, theta, fold.held_out)
        square[fold.held_out] = squares[fold.held_out].sum(axis=1)
        log_density[fold.held_out] = _log_density(problem, trained, fold, squares)
        thetas.append(theta)
    return HeldOut(fit, square, log_density, np.array(thetas))


def fold_theta(problem: ComparisonProblem, fit: EffectFit, fold: Fold) -> FloatArray:
    """Parameters fitted without the held-out segments, shape (p,)."""
    shared = np.array([parameter.run is None for parameter in fit.parameters], dtype=bool)
    in_training = {problem.segments[k].run for k in np.flatnonzero(fold.training)}
    free = shared | np.array(
        [parameter.run in in_training for parameter in fit.parameters], dtype=bool
    )
    theta, _, _ = minimised(
        problem,
        fit.effects,
        fit.theta,
        chosen=fold.training,
        free=free,
        prior=fit.prior,
        first_sums=fit.sums,
        stop=_FOLD_STOP,
    )
    if fold.run_specific.any() and not free.all():
        theta, _, _ = minimised(
            problem,
            fit.effects,
            theta,
            chosen=fold.run_specific,
            free=~free,
            prior=fit.prior,
            stop=_FOLD_STOP,
        )
    return theta


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


def _log_density(
    problem: ComparisonProblem, trained: FloatArray, fold: Fold, squares: FloatArray
) -> FloatArray:
    trained_counts = problem.cell_counts[fold.training].sum(axis=0)
    counts = np.maximum(trained_counts, 1.0)
    noise = problem.noise_square[fold.training].sum(axis=0) / counts
    variance = np.maximum(
        trained[fold.training].sum(axis=0) / counts, np.maximum(noise, np.finfo(float).tiny)
    )
    counts_outside = problem.cell_counts[fold.held_out]
    # A model that runs away predicts as badly as any model can.
    variance = np.minimum(variance, np.sqrt(np.finfo(float).max))
    with np.errstate(over="ignore"):
        misses = np.minimum(squares[fold.held_out] / variance, _WORST)
    terms = counts_outside * np.log(2.0 * np.pi * variance) + misses
    # A cell that no training segment holds says nothing of its variance.
    counted = (counts_outside > 0.0) & (trained_counts > 0.0)
    return -0.5 * np.where(counted, terms, 0.0).sum(axis=1)
