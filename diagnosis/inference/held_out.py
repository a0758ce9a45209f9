"""S3: how well a set of effects predicts pieces of record it was not fitted to."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from carrierflex.diagnosis.comparison.problem import ComparisonProblem, FloatArray
from carrierflex.diagnosis.inference.bounded_fit import EffectFit, minimised
from carrierflex.diagnosis.inference.folds import Fold

#: Steps of a fold's fit: it starts at the fit to all pieces, next to its own minimum.
_FOLD_STEPS = 4
_STACKING_STEPS = 500
#: Largest squared miss of one cell that still counts, in variances.
_WORST = 1e12


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Held-out score of one set of effects.

    Parameters
    ----------
    fit : EffectFit
        Fit to all pieces.
    square : ndarray, shape (n_segments,)
        Sum of squared held-out residuals.
    log_density : ndarray, shape (n_segments,)
        Log predictive density, leftover of training as discrepancy.
    theta_by_fold : ndarray, shape (n_folds, p)
        Parameters of every fold.
    """

    fit: EffectFit
    square: FloatArray
    log_density: FloatArray
    theta_by_fold: FloatArray

    @property
    def elpd(self) -> float:
        """Expected log predictive density, summed over the pieces."""
        return float(self.log_density.sum())


def held_out_score(problem: ComparisonProblem, fit: EffectFit, folds: Sequence[Fold]) -> HeldOut:
    """Score a set on every fold.

    ``elpd = sum log N(r; 0, s²)`` over the pieces and cells, with s² the mean square that the
    fold's fit leaves in that cell of its training pieces, never below the noise.

    Parameters
    ----------
    problem : ComparisonProblem
        Records and simulator.
    fit : EffectFit
        Fit to all pieces; start of every fold's fit.
    folds : sequence of Fold
        Splits.

    Returns
    -------
    HeldOut
        Score by piece.
    """
    n_segments = len(problem.segments)
    square, log_density, thetas = np.full(n_segments, np.nan), np.full(n_segments, np.nan), []
    # The discrepancy of the training pieces: their residual at the fit to all pieces is as good,
    # and one run cheaper.
    trained = problem.squares(fit.effects, fit.theta, np.ones(n_segments, dtype=bool))
    for fold in folds:
        theta = fold_theta(problem, fit, fold)
        held = problem.squares(fit.effects, theta, fold.held_out)
        square[fold.held_out] = held[fold.held_out].sum(axis=1)
        log_density[fold.held_out] = _log_density(problem, trained, fold, held)
        thetas.append(theta)
    return HeldOut(fit, square, log_density, np.array(thetas))


def fold_theta(problem: ComparisonProblem, fit: EffectFit, fold: Fold) -> FloatArray:
    """Parameters fitted without the held-out pieces, shape (p,)."""
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
        most_steps=_FOLD_STEPS,
    )
    if fold.own.any() and not free.all():
        theta, _, _ = minimised(
            problem,
            fit.effects,
            theta,
            chosen=fold.own,
            free=~free,
            prior=fit.prior,
            most_steps=_FOLD_STEPS,
        )
    return theta


def stacking_weights(scores: Sequence[HeldOut]) -> FloatArray:
    """Weights of the sets whose mixture predicts best.

    ``max sum_pieces log sum_S w_S p_S``, shape (n_sets,).

    Parameters
    ----------
    scores : sequence of HeldOut
        Scores of the sets.

    Returns
    -------
    ndarray
        Weights; their sum is one.

    References
    ----------
    .. [1] Y. Yao, A. Vehtari, D. Simpson, A. Gelman, "Using stacking to average Bayesian predictive
    distributions" (2018).
    """
    log_density = np.array([score.log_density for score in scores])
    density = np.exp(log_density - log_density.max(axis=0))
    weights = np.full(len(scores), 1.0 / len(scores))
    for _ in range(_STACKING_STEPS):
        share = weights[:, None] * density
        weights = (share / share.sum(axis=0)).mean(axis=1)
    return weights


def reduction_draws(
    before: FloatArray,
    after: FloatArray,
    groups: Sequence[str],
    *,
    n_samples: int,
    rng: np.random.Generator,
) -> FloatArray:
    """Draws of RMS after / before by the two-level bootstrap.

    Conditions, then pieces within them, shape (n_samples,).

    Parameters
    ----------
    before, after : ndarray, shape (n_segments,)
        Sums of squared residuals.
    groups : sequence of str
        Condition of every piece; with fewer than three, pieces alone are drawn, within their
        condition.
    n_samples : int
        Draws.
    rng : numpy.random.Generator
        Source of the draws.

    Returns
    -------
    ndarray
        One ratio a draw.
    """
    counts = drawn_counts(groups, n_samples=n_samples, rng=rng)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.sqrt((counts @ after) / (counts @ before))


def drawn_counts(groups: Sequence[str], *, n_samples: int, rng: np.random.Generator) -> FloatArray:
    """How often each piece is drawn in each sample of the two-level bootstrap, shape (n_samples, n_pieces)."""
    group = np.asarray(groups)
    members = [np.flatnonzero(group == name) for name in sorted(set(groups))]
    counts = np.zeros((n_samples, group.size))
    for k in range(n_samples):
        drawn = (
            rng.integers(len(members), size=len(members))
            if len(members) >= 3
            else np.arange(len(members))
        )
        for number in drawn:
            own = members[number]
            counts[k] += np.bincount(
                own[rng.integers(own.size, size=own.size)], minlength=group.size
            )
    return counts


def _log_density(
    problem: ComparisonProblem, trained: FloatArray, fold: Fold, held: FloatArray
) -> FloatArray:
    trained_counts = problem.cell_counts[fold.training].sum(axis=0)
    counts = np.maximum(trained_counts, 1.0)
    noise = problem.noise_square[fold.training].sum(axis=0) / counts
    variance = np.maximum(
        trained[fold.training].sum(axis=0) / counts, np.maximum(noise, np.finfo(float).tiny)
    )
    own_counts = problem.cell_counts[fold.held_out]
    # A model that runs away predicts as badly as any model can.
    variance = np.minimum(variance, np.sqrt(np.finfo(float).max))
    with np.errstate(over="ignore"):
        misses = np.minimum(held[fold.held_out] / variance, _WORST)
    terms = own_counts * np.log(2.0 * np.pi * variance) + misses
    # A cell that no training piece holds says nothing of its variance.
    counted = (own_counts > 0.0) & (trained_counts > 0.0)
    return -0.5 * np.where(counted, terms, 0.0).sum(axis=1)
