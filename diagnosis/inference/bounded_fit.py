"""Fit of a set of effects within physical bounds.

Damped Gauss-Newton on sums, from several starts, never worse nested.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from carrierflex.diagnosis.comparison.problem import (
    BoolArray,
    ComparisonProblem,
    Effects,
    FloatArray,
    Parameter,
    SegmentSums,
)

#: A model may cost more than one it contains by rounding only.
NESTED_TOLERANCE = 1e-6
#: The search ends where a full step promises less than this share of the cost.
_PROMISE = 1e-5
_MOST_STEPS = 30
#: It ends too where so many steps in a row gain less than this share of the cost: near the noise a
#: third of a unit of chi² in ten thousand samples; a fit that leaves so many times the noise's sum
#: of squares is no better for its last per mille.
_SLOW_STEPS, _SLOW_GAIN, _FAR_FROM_NOISE = 4, {False: 3e-5, True: 1e-3}, 1.5
#: Damping factors tried for one step before the search gives up.
_MOST_DAMPINGS = 10
#: Distance from a bound, in scales of the parameter, that counts as on it.
_ON_BOUND = 1e-6


@dataclass(frozen=True, eq=False)
class EffectFit:
    """Fitted parameters of baseline + effects.

    Parameters
    ----------
    effects : tuple of str
        Effects beside the baseline.
    parameters : tuple of Parameter
        Unknowns; p.
    theta : ndarray, shape (p,)
        Values.
    cost : float
        Sum of squared residuals and prior terms.
    sums : SegmentSums
        Sums at `theta`, by piece.
    prior : ndarray, shape (p,)
        Weight of each squared parameter in the cost.
    at_bound : ndarray of bool, shape (p,)
        Whether a parameter of an added effect stands on a physical bound.
    """

    effects: Effects
    parameters: tuple[Parameter, ...]
    theta: FloatArray
    cost: float
    sums: SegmentSums
    prior: FloatArray
    at_bound: BoolArray

    @property
    def known(self) -> dict[tuple[str, str], float]:
        """Values by effect and name, runs' own by ``name of run``.

        What a larger set starts from.
        """
        return {
            parameter_key(own): float(value)
            for own, value in zip(self.parameters, self.theta, strict=True)
        }

    @property
    def covariance(self) -> FloatArray:
        """Covariance of the parameters with blocks as independent draws (sandwich), shape (p, p).

        Not a number where neither the records nor a prior see a parameter.
        """
        matrix = self.sums.matrix.sum(axis=0) + np.diag(self.prior)
        inverse = _pseudo_inverse(matrix)
        scores = self.sums.right_side - self.sums.right_side.mean(axis=0)
        segments = max(len(scores), 2)
        covariance = inverse @ (scores.T @ scores) @ inverse * segments / (segments - 1.0)
        unseen = np.diag(matrix) <= 0.0
        covariance[unseen], covariance[:, unseen] = np.nan, np.nan
        return covariance


class NestedCostError(ArithmeticError):
    """A model fitted its data worse than a model it contains; the solution is not a minimum.

    Parameters
    ----------
    fit : EffectFit
        Where the search of the larger set stuck.
    smaller : EffectFit
        Fit of the smaller set.
    """

    def __init__(self, fit: EffectFit, smaller: EffectFit) -> None:
        super().__init__(
            f"effects {', '.join(fit.effects)} cost {fit.cost:.8e}, more than {smaller.cost:.8e} with "
            f"{', '.join(smaller.effects) or 'the baseline'} alone; the search stuck"
        )
        self.fit, self.smaller = fit, smaller


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
    most_steps: int = _MOST_STEPS,
) -> EffectFit:
    """Fit baseline + effects to all pieces.

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
    most_steps : int
        Steps from each start.

    Returns
    -------
    EffectFit
        Best minimum found.

    Raises
    ------
    NestedCostError
        Where a sub-set fits better by more than rounding.
    """
    parameters = problem.parameters(effects)
    everything = np.ones(len(problem.segments), dtype=bool)
    free = np.ones(len(parameters), dtype=bool)
    prior = prior_weights(problem, parameters)
    best = min(contained, key=lambda fit: fit.cost, default=None)
    candidates = [*problem.starts(effects, best.known if best else {}), *starts]
    costs = np.array(
        [trial_cost(problem, effects, theta, everything, prior) for theta in candidates]
    )
    costs = np.where(np.isfinite(costs), costs, np.inf)
    search = partial(
        minimised,
        problem,
        effects,
        chosen=everything,
        free=free,
        prior=prior,
        most_steps=most_steps,
    )
    theta, cost, sums = search(candidates[int(np.argmin(costs))])
    if best is not None and cost > best.cost:
        # The most promising start led astray; the warm start cannot.
        theta, cost, sums = search(candidates[0])
    fit = EffectFit(effects, parameters, theta, cost, sums, prior, _bound_hits(parameters, theta))
    if best is not None and cost > best.cost * (1.0 + NESTED_TOLERANCE):
        raise NestedCostError(fit, best)
    return fit


def minimised(
    problem: ComparisonProblem,
    effects: Effects,
    start: FloatArray,
    *,
    chosen: BoolArray,
    free: BoolArray,
    prior: FloatArray,
    first_sums: SegmentSums | None = None,
    most_steps: int = _MOST_STEPS,
) -> tuple[FloatArray, float, SegmentSums]:
    """Minimise the cost of the chosen pieces over the free parameters by damped Gauss-Newton steps within bounds.

    Parameters
    ----------
    plant, effects, start
        What is fitted, from where, shape (p,).
    chosen, free : ndarray of bool
        Pieces that count, shape (n_pieces,); parameters that move, shape (p,).
    prior : ndarray, shape (p,)
        Weight of each squared parameter.
    first_sums : SegmentSums, optional
        Sums at `start`, where they are known.
    most_steps : int
        Steps at most.

    Returns
    -------
    tuple of (ndarray, float, SegmentSums)
        Parameters, cost and the sums there.
    """
    parameters = problem.parameters(effects)
    theta = np.array(start, dtype=np.float64)
    sums = problem.sums(effects, theta, chosen) if first_sums is None else first_sums
    cost = float(sums.square[chosen].sum() + prior @ theta**2)
    far, slow, damping = _FAR_FROM_NOISE * float(problem.noise_square[chosen].sum()), 0, 1e-6
    for _ in range(most_steps):
        matrix = sums.matrix[chosen].sum(axis=0) + np.diag(prior)
        slope = sums.right_side[chosen].sum(axis=0) - prior * theta
        moved = False
        for _ in range(_MOST_DAMPINGS):
            experiment = _bounded_step(parameters, theta, matrix, slope, free=free, damping=damping)
            step = experiment - theta
            promise = float(2.0 * slope @ step - step @ matrix @ step)
            if promise <= _PROMISE * cost:
                break
            trial_value = trial_cost(problem, effects, experiment, chosen, prior)
            if np.isfinite(trial_value) and trial_value < cost:
                moved, damping = True, damping / 10.0
                break
            damping = max(10.0 * damping, 1e-4)
        if not moved:
            break
        theta, sums, before = experiment, problem.sums(effects, experiment, chosen), cost
        cost = float(sums.square[chosen].sum() + prior @ theta**2)
        slow = slow + 1 if before - cost < _SLOW_GAIN[cost > far] * before else 0
        if slow == _SLOW_STEPS:
            break
    return theta, cost, sums


def prior_weights(problem: ComparisonProblem, parameters: Sequence[Parameter]) -> FloatArray:
    """Weight of each squared parameter.

    The noise variance over the prior's variance, shape (p,).
    """
    variance = float(problem.noise_square.sum() / max(problem.cell_counts.sum(), 1.0))
    return np.array([variance / parameter.prior_std**2 for parameter in parameters])


def trial_cost(
    problem: ComparisonProblem,
    effects: Effects,
    theta: FloatArray,
    chosen: BoolArray,
    prior: FloatArray,
) -> float:
    """Cost of one parameter set over the chosen pieces."""
    return float(problem.squares(effects, theta, chosen)[chosen].sum() + prior @ theta**2)


def _bounded_step(
    parameters: Sequence[Parameter],
    theta: FloatArray,
    matrix: FloatArray,
    slope: FloatArray,
    *,
    free: BoolArray,
    damping: float,
) -> FloatArray:
    """Damped Gauss-Newton step.

    A parameter that the step would push out of its bounds stays on the bound.
    """
    lower = np.array([parameter.lower for parameter in parameters])
    upper = np.array([parameter.upper for parameter in parameters])
    moving = free & (np.diag(matrix) > 0.0)
    experiment = theta.copy()
    for _ in range(len(parameters)):
        where = np.flatnonzero(moving)
        if where.size == 0:
            break
        fixed = experiment - theta
        fixed[where] = 0.0
        own = matrix[np.ix_(where, where)]
        size = np.sqrt(np.diag(own))
        scaled = own / np.outer(size, size) + damping * np.eye(where.size)
        right = (slope[where] - matrix[where] @ fixed) / size
        experiment[where] = theta[where] + np.linalg.lstsq(scaled, right, rcond=1e-12)[0] / size
        outside = moving & ((experiment < lower) | (experiment > upper))
        if not outside.any():
            break
        experiment = np.clip(experiment, lower, upper)
        moving &= ~outside
    return np.clip(experiment, lower, upper)


def _bound_hits(parameters: Sequence[Parameter], theta: FloatArray) -> BoolArray:
    """Which parameters of added effects stand on a physical bound."""
    near = np.array([_ON_BOUND * parameter.scale for parameter in parameters])
    lower = np.array([parameter.lower for parameter in parameters])
    upper = np.array([parameter.upper for parameter in parameters])
    return (theta <= lower + near) | (theta >= upper - near)


def _pseudo_inverse(matrix: FloatArray) -> FloatArray:
    """Inverse of a scaled symmetric matrix over the directions that the data determine."""
    size = np.sqrt(np.maximum(np.diag(matrix), np.finfo(float).tiny))
    return np.linalg.pinv(matrix / np.outer(size, size), rcond=1e-12, hermitian=True) / np.outer(
        size, size
    )
