"""Evidence of the candidates of a search, relative to the baseline alone."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.comparison.problem import Effects, Parameter
from carrierflex.diagnosis.inference.effect_fit import EffectFit, mean_square_left
from carrierflex.diagnosis.inference.evidence.laplace import (
    BoundedPrior,
    QuadraticCost,
    log_evidence,
    log_evidence_any_noise,
    quadratic_cost,
)
from carrierflex.diagnosis.inference.forward_selection import ForwardSelection
from carrierflex.diagnosis.inference.selection import Selection
from carrierflex.identification.estimation.scaled_least_squares import normal_inverse

FloatArray = NDArray[np.float64]

#: Candidates beside the baseline, the named set and its aliases: the next by held-out score.
_NEXT_SETS = 3


@dataclass(frozen=True, eq=False)
class CandidateEvidence:
    """How well a set of effects explains all records, its parameters integrated over their priors.

    Parameters
    ----------
    effects : tuple of str
        The set; empty for the baseline alone.
    log_evidence : float
        Natural logarithm of the evidence less that of the baseline alone.
    share : float
        Posterior probability among the candidates, equal prior odds.
    fit : EffectFit
        The fit it is expanded about.
    """

    effects: Effects
    log_evidence: float
    share: float
    fit: EffectFit


@dataclass(frozen=True, eq=False)
class Evidence:
    """Evidence of the candidates.

    Parameters
    ----------
    candidates : tuple of CandidateEvidence
        Baseline, accepted set, its aliases and rivals, next sets by held-out score, in this order.
    accepted : tuple of str
        Set that the held-out records support; empty where they support none.
    best : tuple of str
        Candidate of the smallest held-out gap.
    n_samples, n_effective : float
        Samples of the records, and how many independent ones they are worth.
    noise_std : float
        Standard deviation of the declared noise; of what `best` leaves where the noise is unknown.
    noise_is_unknown : bool
        Whether the noise's size was integrated over.
    """

    candidates: tuple[CandidateEvidence, ...]
    accepted: Effects
    best: Effects
    n_samples: float
    n_effective: float
    noise_std: float
    noise_is_unknown: bool

    @property
    def preferred(self) -> CandidateEvidence:
        """Candidate of the largest evidence."""
        return max(self.candidates, key=lambda candidate: candidate.log_evidence)

    def of(self, effects: Effects) -> CandidateEvidence | None:
        """A candidate, in any order of its effects; None where it is not among them."""
        wanted = tuple(sorted(effects))
        return next((own for own in self.candidates if own.effects == wanted), None)


def evidence_of(
    search: ForwardSelection,
    selection: Selection,
    classes: Sequence[Effects],
    *,
    floor_is_measured: bool,
) -> Evidence | None:
    """Evidence of the accepted set and of what competes with it.

    Parameters
    ----------
    search : ForwardSelection
        Fits; an alias that was not fitted to the records is fitted now.
    selection : Selection
        Accepted set and its rivals.
    classes : sequence of tuple of str
        Aliases of each accepted effect, the effect itself first.
    floor_is_measured : bool
        Whether the noise was declared or comes from repeats.

    Returns
    -------
    Evidence or None
        None where a candidate leaves no finite gap.
    """
    problem = search.problem
    fits = [search.fit(effects) for effects in _candidates(search, selection, classes)]
    fits = [fit for fit in fits if np.isfinite(fit.sums.square).all()]
    if not fits or fits[0].effects:
        return None
    best = min(fits, key=lambda fit: search.mean_square(fit.effects))
    left = mean_square_left(problem, best)
    if not left > 0.0:
        return None
    floor = search.floor
    limit = search.thresholds.floor_ratio
    is_unknown = not floor_is_measured or left > limit * floor
    n_samples = float(problem.cell_counts.sum())
    per_independent = samples_per_independent(best, left)
    logs = []
    for fit in fits:
        cost, prior = _expanded(fit, n_samples, per_independent)
        if is_unknown:
            logs.append(log_evidence_any_noise(cost, prior, mean_square_left(problem, fit)))
        else:
            logs.append(log_evidence(cost, prior, floor))
    relative = np.array(logs) - logs[0]
    weights = np.exp(relative - relative.max())
    shares = weights / weights.sum()
    return Evidence(
        tuple(
            CandidateEvidence(fit.effects, float(value), float(share), fit)
            for fit, value, share in zip(fits, relative, shares, strict=True)
        ),
        tuple(sorted(selection.accepted)),
        best.effects,
        n_samples,
        n_samples / per_independent,
        float(np.sqrt(left if is_unknown else floor)),
        is_unknown,
    )


def samples_per_independent(fit: EffectFit, variance: float) -> float:
    """Samples of the record that are worth one independent sample, at least one.

    With white residuals of variance s² the slopes ``b_k = J_k.T r_k`` of the segments have the
    variance ``s² (M_k - M_k M^-1 M_k)``, ``M = sum_k M_k``; correlated ones have more:

        f = tr(M^-1 sum_k b_k b_k.T) / (s² (p - sum_k tr((M^-1 M_k)²))).

    The likelihood to the power 1/f has the curvature that the scatter of the segments warrants.

    Parameters
    ----------
    fit : EffectFit
        Best candidate, with its sums by segment.
    variance : float
        s²: mean square that it leaves.

    References
    ----------
    .. [1] F. Pauli, W. Racugno, L. Ventura, "Bayesian composite marginal likelihoods", Stat. Sinica
       21 (2011) 149-164, eq. 7.
    """
    sums = fit.sums
    inverse = normal_inverse(sums.total_matrix())
    right_side = sums.full_right_side()
    scatter = float(np.einsum("kp,pq,kq->", right_side, inverse, right_side))
    n_parameters = inverse.shape[0]
    every = np.arange(n_parameters)
    used = degrees = 0.0
    for k, matrix in enumerate(sums.matrix):
        own = every if sums.unknowns is None else sums.unknowns[k]
        leverage = inverse[np.ix_(own, own)] @ matrix
        degrees += float(np.trace(leverage))
        used += float(np.sum(leverage * leverage.T))
    expected = variance * (degrees - used)
    if not expected > 0.0:
        return 1.0
    return max(scatter / expected, 1.0)


def _candidates(
    search: ForwardSelection, selection: Selection, classes: Sequence[Effects]
) -> list[Effects]:
    """Sets that compete, each once, negative controls not among them."""
    accepted = tuple(sorted(selection.accepted))
    aliases = [
        tuple(sorted((*(own for own in accepted if own != members[0]), alias)))
        for members in classes
        for alias in members[1:]
    ]
    named = [(), accepted, *aliases, *selection.rivals]
    by_score = sorted((ranked.held_out_rms, ranked.effects) for ranked in selection.ranking)
    known = {tuple(sorted(effects)) for effects in named}
    further = [effects for rms, effects in by_score if np.isfinite(rms) and effects not in known]
    return list(dict.fromkeys(tuple(sorted(own)) for own in (*named, *further[:_NEXT_SETS])))


def _expanded(
    fit: EffectFit, n_samples: float, per_independent: float
) -> tuple[QuadraticCost, BoundedPrior]:
    """Sum of squares of independent samples about a fit, and the prior of what is not flat."""
    is_free = np.array([own.lower < own.upper for own in fit.parameters], dtype=bool)
    has_prior = np.array([_has_prior(own, fit.effects) for own in fit.parameters], dtype=bool)
    matrix = fit.sums.total_matrix()[np.ix_(is_free, is_free)]
    slope = fit.sums.full_right_side().sum(axis=0)[is_free]
    kept = [
        (own, value)
        for own, value, wanted in zip(fit.parameters, fit.theta, is_free & has_prior, strict=True)
        if wanted
    ]
    values = np.array([value for _, value in kept])
    prior = BoundedPrior(
        np.array([own.prior_mean if np.isfinite(own.prior_std) else 0.0 for own, _ in kept])
        - values,
        np.array([own.prior_std**-2.0 for own, _ in kept]),
        np.array([own.lower for own, _ in kept]) - values,
        np.array([own.upper for own, _ in kept]) - values,
    )
    cost = quadratic_cost(
        float(fit.sums.square.sum()) / per_independent,
        matrix / per_independent,
        slope / per_independent,
        has_prior=has_prior[is_free],
        n_samples=n_samples / per_independent,
    )
    return cost, prior


def _has_prior(parameter: Parameter, effects: Effects) -> bool:
    """Whether a parameter has a proper prior: a normal one, or bounds and an effect on trial.

    Bounds of the baseline's own parameters are the same in every candidate.
    """
    if np.isfinite(parameter.prior_std):
        return True
    is_bounded = np.isfinite([parameter.lower, parameter.upper]).all()
    return bool(is_bounded and parameter.effect in effects)
