"""Fit of a set of effects within physical bounds.

Several starts, and never worse than a set it contains.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from carrierflex.diagnosis.comparison.problem import (
    BoolArray,
    Effects,
    FloatArray,
    Parameter,
    SegmentSums,
    bounds_of,
)
from carrierflex.diagnosis.kind.comparison_problem import ComparisonProblem
from carrierflex.identification.estimation.gauss_newton import (
    Bounds,
    CostSearch,
    CostSums,
    StopRule,
)
from carrierflex.identification.estimation.resampling import NORMAL_95
from carrierflex.identification.estimation.scaled_least_squares import normal_inverse
from carrierflex.identification.estimation.several_starts import (
    NestedCostError,
    costs_more,
    ranked_starts,
)

#: Distance from a bound, in scales of the parameter, that counts as on it.
ON_BOUND = 1e-6
_STOP_RULE = StopRule()


@dataclass(frozen=True, eq=False)
class Prior:
    """Gaussian prior of the unknowns of a set, in the units of the residuals' squares.

    ``cost = sum_k w_k ((theta_k - mu_k)² - mu_k² [k may be absent])``: a set that leaves an effect
    out has paid for its absence, so that a larger set is never the dearer one.
    """

    #: weight, mean: w and mu; a weight of zero is no prior, shape (p,)
    weight: FloatArray
    mean: FloatArray
    #: Whether the parameter belongs to an effect beside the baseline, shape (p,)
    may_be_absent: BoolArray

    @classmethod
    def none(cls, n_parameters: int) -> "Prior":
        """No prior."""
        zero = np.zeros(n_parameters)
        return cls(zero, zero, np.zeros(n_parameters, dtype=bool))

    def cost(self, theta: FloatArray) -> float:
        """What is added to the sum of squares."""
        absent = np.where(self.may_be_absent, self.mean**2, 0.0)
        return float(self.weight @ ((theta - self.mean) ** 2 - absent))

    def slope(self, theta: FloatArray) -> FloatArray:
        """Half the descent of the cost, shape (p,)."""
        return np.asarray(self.weight * (self.mean - theta))


@dataclass(frozen=True, eq=False)
class EffectFit:
    """Fitted parameters of baseline + effects."""

    effects: Effects  # Effects beside the baseline
    parameters: tuple[Parameter, ...]  # Unknowns; p
    theta: FloatArray  # Values, shape (p,)
    cost: float  # Sum of squared residuals and prior terms
    sums: SegmentSums  # Sums at `theta`, by segment
    prior: Prior  # What the cost adds for the parameters themselves
    #: Whether a parameter of an added effect stands on a physical bound, shape (p,)
    at_bound: BoolArray

    @property
    def moves_records(self) -> BoolArray:
        """Whether a parameter changes any sample of the records, shape (p,)."""
        return np.asarray(np.diag(self.sums.total_matrix()) > 0.0)

    @property
    def known(self) -> dict[tuple[str, str], float]:
        """Values by effect and name, from which a larger set starts."""
        return dict(zip(map(parameter_key, self.parameters), self.theta.tolist(), strict=True))

    @property
    def is_free(self) -> BoolArray:
        """Whether a parameter is fitted, shape (p,); else its value is held."""
        return np.array([parameter.is_free for parameter in self.parameters], dtype=bool)

    @property
    def matrix(self) -> FloatArray:
        """Normal matrix ``J.T J + W`` of records and prior, shape (p, p)."""
        return np.asarray(self.sums.total_matrix() + np.diag(self.prior.weight))

    @property
    def inverse(self) -> FloatArray:
        """Inverse of the normal matrix of what is fitted; zero of values that are held, (p, p)."""
        free = np.ix_(self.is_free, self.is_free)
        matrix = self.matrix
        inverse = np.zeros_like(matrix)
        inverse[free] = normal_inverse(matrix[free])
        return inverse

    @property
    def covariance(self) -> FloatArray:
        """Covariance of the parameters with blocks as independent draws (sandwich), shape (p, p).

        Zero of values that are held; not a number where neither the records nor a prior see a
        parameter.
        """
        inverse = self.inverse
        scores = self.sums.full_right_side()
        scores = scores - scores.mean(axis=0)
        segments = max(len(scores), 2)
        covariance = inverse @ (scores.T @ scores) @ inverse * segments / (segments - 1.0)
        unseen = self.is_free & (np.diag(self.matrix) <= 0.0)
        covariance[unseen], covariance[:, unseen] = np.nan, np.nan
        return covariance


class NestedFitError(NestedCostError):
    """A set of effects fits worse than a set it contains: its solution is not a minimum."""

    def __init__(self, fit: EffectFit, smaller: EffectFit) -> None:
        names = " + ".join(fit.effects), " + ".join(smaller.effects) or "the baseline"
        super().__init__(fit.cost, smaller.cost, names)
        self.fit = fit
        self.smaller = smaller


def parameter_key(parameter: Parameter) -> tuple[str, str]:
    """Owner and name of a parameter, the name with its run where it has one."""
    name = parameter.name if parameter.run is None else f"{parameter.name} of {parameter.run}"
    return parameter.effect, name


def fit_effects(
    problem: ComparisonProblem,
    effects: Effects,
    *,
    contained: Sequence[EffectFit] = (),
    starts: Sequence[FloatArray] = (),
    stop: StopRule = _STOP_RULE,
) -> EffectFit:
    """Fit baseline + effects to all segments.

    Parameters
    ----------
    problem : ComparisonProblem
        Records and simulator.
    effects : tuple of str
        Effects beside the baseline.
    contained : sequence of EffectFit
        Fits of sub-sets; the best is the warm start, and none of them may fit better.
    starts : sequence of ndarray
        Further starts.
    stop : StopRule
        When the search from a start ends.

    Returns
    -------
    EffectFit
        Best minimum found.

    Raises
    ------
    NestedFitError
        Where a sub-set fits better by more than rounding.
    """
    cost_of = _whole_cost(problem, effects, stop)
    best = min(contained, key=lambda fit: fit.cost, default=None)
    candidates = [*problem.starts(effects, best.known if best else {}), *starts]
    theta, cost, sums = cost_of.minimised(_best_start(cost_of, candidates))
    if best is not None and cost > best.cost:
        # The most promising start led astray; the warm start cannot.
        theta, cost, sums = cost_of.minimised(candidates[0])
    parameters = problem.parameters(effects)
    margin = np.array([ON_BOUND * parameter.scale for parameter in parameters])
    bounds = Bounds(*bounds_of(parameters))
    is_limit = np.array([parameter.may_reach_lower for parameter in parameters], dtype=bool)
    is_limit &= theta <= bounds.lower + margin
    # A value that is held stands on no bound.
    at_bound = bounds.hits(theta, margin) & (bounds.lower < bounds.upper) & ~is_limit
    fit = EffectFit(effects, parameters, theta, cost, sums, cost_of.prior, at_bound)
    fit = replace(fit, at_bound=at_bound | _are_absent(fit, problem.noise_floor_square))
    if best is not None and costs_more(cost, best.cost):
        raise NestedFitError(fit, best)
    return fit


def _whole_cost(
    problem: ComparisonProblem, effects: Effects, stop: StopRule = _STOP_RULE
) -> "SegmentCost":
    """Cost of all segments with every parameter free."""
    parameters = problem.parameters(effects)
    # The noise variance over the prior's variance.
    variance = problem.noise_floor_square
    weight = np.array([variance / parameter.prior_std**2 for parameter in parameters])
    mean = np.array([parameter.prior_mean for parameter in parameters])
    may_be_absent = np.array([parameter.effect in effects for parameter in parameters], dtype=bool)
    everywhere, free = np.ones(len(problem.segments), dtype=bool), np.ones(mean.size, dtype=bool)
    prior = Prior(weight, mean, may_be_absent)
    return SegmentCost(problem, effects, prior, everywhere, free, stop)


def _best_start(cost_of: "SegmentCost", candidates: Sequence[FloatArray]) -> FloatArray:
    distinct = list({theta.tobytes(): theta for theta in candidates}.values())
    return distinct[ranked_starts([cost_of.at(theta) for theta in distinct])[0]]


@dataclass(frozen=True, eq=False)
class SegmentCost:
    """Cost of some segments as a function of the parameters of a set of effects."""

    problem: ComparisonProblem  # Records and simulator
    effects: Effects  # Effects beside the baseline
    prior: Prior  # What the cost adds for the parameters themselves
    chosen: BoolArray  # Segments that count, shape (n_segments,)
    free: BoolArray  # Parameters that move, shape (p,)
    stop: StopRule = _STOP_RULE  # When a search ends; the noise of the segments is put in

    def at(self, theta: FloatArray) -> float:
        """Cost of one parameter set; not finite where the model fails."""
        square = self.problem.total_square(self.effects, theta, self.chosen)
        return square + self.prior.cost(theta)

    def minimised(self, start: FloatArray) -> tuple[FloatArray, float, SegmentSums]:
        """Parameters within their bounds under which the cost is least, it, and the sums there."""
        theta, here = self._search.minimised((start, self._sums(start)))
        return theta, here.cost, here.detail

    def least(
        self, start: FloatArray, first_sums: SegmentSums | None = None
    ) -> tuple[FloatArray, float]:
        """Parameters and cost of :meth:`minimised`; `first_sums` are those at the start."""
        first = self._sums(start) if first_sums is None else self._totals(start, first_sums)
        return self._search.least((start, first))

    @property
    def _search(self) -> CostSearch[SegmentSums]:
        bounds = Bounds(*bounds_of(self.problem.parameters(self.effects)))
        noise_square = float(self.problem.noise_square[self.chosen].sum())
        stop = replace(self.stop, noise_square=noise_square)
        return CostSearch(self._sums, self.at, bounds, self.free, stop)

    def _sums(self, theta: FloatArray) -> CostSums[SegmentSums]:
        return self._totals(theta, self.problem.sums(self.effects, theta, self.chosen, self.free))

    def _totals(self, theta: FloatArray, sums: SegmentSums) -> CostSums[SegmentSums]:
        """Cost, matrix and slope: chosen segments and prior together."""
        return CostSums(
            cost=float(sums.square[self.chosen].sum()) + self.prior.cost(theta),
            matrix=sums.total_matrix(self.chosen) + np.diag(self.prior.weight),
            slope=sums.full_right_side()[self.chosen].sum(axis=0) + self.prior.slope(theta),
            detail=sums,
        )


def mean_square_left(problem: ComparisonProblem, fit: EffectFit) -> float:
    """Mean square that a fit leaves, all segments and channels alike."""
    return float(fit.sums.square.sum() / problem.cell_counts.sum())


def mean_square_of(problem: ComparisonProblem, effects: Effects = ()) -> float:
    """Mean square that the baseline with some effects leaves once it is fitted."""
    cost_of = _whole_cost(problem, effects)
    theta, cost = cost_of.least(_best_start(cost_of, problem.starts(effects, {})))
    return float((cost - cost_of.prior.cost(theta)) / problem.cell_counts.sum())


def _are_absent(fit: EffectFit, noise_square: float) -> BoolArray:
    """Which sizes of added effects noise does not distinguish from their bound of zero."""
    # An effect of several sizes may bend to another cause by one of them, its first one absent.
    # Along directions that nothing determines the inverse is rounding of either sign.
    std = np.sqrt(noise_square * np.maximum(np.diag(fit.inverse), 0.0))
    are_sizes = [
        parameter.effect in fit.effects
        and parameter.lower == 0.0
        and not (parameter.shape or parameter.may_reach_lower)
        for parameter in fit.parameters
    ]
    return np.array(are_sizes, dtype=bool) & (fit.theta < NORMAL_95 * std)
