"""Bounded nonlinear least squares on sums: damped Gauss-Newton steps that never leave the bounds.

A model answers with its normal equations ``J.T J`` and ``J.T r`` in place of residuals and
derivatives, so that a long record costs as much as a short one.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from carrierflex.identification.estimation.scaled_least_squares import (
    bounded_solution,
    normal_solution,
)

Array = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
#: What a model keeps beside its totals, for instance the sums of each block of its record.
Detail = TypeVar("Detail")

#: Damping of the first step, as a share of every column's square, and the least one after a step
#: that gained nothing; it falls and grows by a factor of ten.
_FIRST_DAMPING = 1e-6
_LEAST_RAISED_DAMPING = 1e-4
_DAMPING_FACTOR = 10.0


@dataclass(frozen=True)
class StopRule:
    """When a search ends.

    Parameters
    ----------
    most_steps : int
        Steps at most.
    most_dampings : int
        Damping factors tried for one step before the search gives up.
    promise : float
        The search ends where the linearised model promises less than this share of the cost.
    slow_steps, slow_gain : int, float
        It ends too after so many steps in a row that each gain less than this share of the cost:
        near the noise a third of a unit of chi² in ten thousand samples.
    slow_gain_far, far : float
        The same share where the cost is more than `far` times `noise_square`: a fit far above the
        noise is no better for its last per mille.
    noise_square : float
        Sum of squares that noise alone leaves; zero takes every cost as far above it.
    kept_promise : float
        Where no sums are asked for (:meth:`CostSearch.least`), an undamped step ends the search
        whose gain is that promised by the linearised model to this share of the cost.
    """

    most_steps: int = 30
    most_dampings: int = 10
    promise: float = 1e-5
    slow_steps: int = 4
    slow_gain: float = 3e-5
    slow_gain_far: float = 1e-3
    far: float = 1.5
    noise_square: float = 0.0
    kept_promise: float = 3e-4

    def is_slow(self, before: float, after: float) -> bool:
        """Whether a step from one cost to a lower one gained too little."""
        is_far = after > self.far * self.noise_square
        least_gain = self.slow_gain_far if is_far else self.slow_gain
        return before - after < least_gain * before


@dataclass(frozen=True, eq=False)
class CostSums(Generic[Detail]):
    """Cost of one parameter set with its normal equations.

    Parameters
    ----------
    cost : float
        Sum of squared residuals and prior terms.
    matrix : ndarray, shape (p, p)
        ``J.T J`` with J the derivatives of the prediction.
    slope : ndarray, shape (p,)
        ``J.T r``: half the descent of the cost.
    detail
        What the model keeps beside its totals.
    """

    cost: float
    matrix: Array
    slope: Array
    detail: Detail


@dataclass(frozen=True, eq=False)
class Bounds:
    """Box of a search.

    Parameters
    ----------
    lower, upper : ndarray, shape (p,)
        Bounds; equal where a parameter is fixed.
    """

    lower: Array
    upper: Array

    def clipped(self, theta: Array) -> Array:
        """Nearest point inside, shape (p,)."""
        return np.clip(theta, self.lower, self.upper)

    def outside(self, theta: Array) -> BoolArray:
        """Which values are beyond their bounds, shape (p,)."""
        return (theta < self.lower) | (theta > self.upper)

    def hits(self, theta: Array, margin: Array) -> BoolArray:
        """Which values are within `margin` of a bound, shape (p,)."""
        return (theta <= self.lower + margin) | (theta >= self.upper - margin)


@dataclass(frozen=True, eq=False)
class CostSearch(Generic[Detail]):
    """Search for the parameters under which a sum of squares is least.

    Each step solves ``(J.T J + d diag(J.T J)) s = J.T r`` with the damping d raised until the cost
    falls (Levenberg-Marquardt), parameters that would leave their bounds held on them. A search
    begins at parameters, shape (p,), and the sums there.

    Parameters
    ----------
    sums : callable
        ``sums(theta) -> CostSums``.
    cost : callable
        ``cost(theta) -> float``: the cost alone, which is cheaper; not finite where the model
        fails.
    bounds : Bounds
        Physical bounds.
    free : ndarray of bool, shape (p,)
        Parameters that move.
    stop : StopRule
        When the search ends.

    References
    ----------
    .. [1] D. W. Marquardt, "An algorithm for least-squares estimation of nonlinear parameters",
       SIAM J. Appl. Math. 11 (1963).
    """

    sums: Callable[[Array], CostSums[Detail]]
    cost: Callable[[Array], float]
    bounds: Bounds
    free: BoolArray
    stop: StopRule

    def minimised(self, start: tuple[Array, CostSums[Detail]]) -> tuple[Array, CostSums[Detail]]:
        """Parameters, shape (p,), and the sums there; the cost is that of the start at most."""
        theta, _, here = self._ended(start, needs_sums=True)
        return theta, here

    def least(self, start: tuple[Array, CostSums[Detail]]) -> tuple[Array, float]:
        """Parameters, shape (p,), and cost, without the sums there.

        A search that starts next to its minimum makes no sums at all: its first step gains what
        the linearised model promised, and a further one would gain about as much as the two differ.
        """
        theta, reached, _ = self._ended(start, needs_sums=False)
        return theta, reached

    def _ended(
        self, start: tuple[Array, CostSums[Detail]], *, needs_sums: bool
    ) -> tuple[Array, float, CostSums[Detail]]:
        """Parameters, cost and sums; those of the step before where none are needed."""
        theta, here = start
        damping = _FIRST_DAMPING
        slow_steps = 0
        for _ in range(self.stop.most_steps):
            better = None
            is_undamped = damping <= _FIRST_DAMPING
            for _ in range(self.stop.most_dampings):
                candidate = bounded_step(
                    here, theta, bounds=self.bounds, free=self.free, damping=damping
                )
                step = candidate - theta
                promise = float(2.0 * here.slope @ step - step @ here.matrix @ step)
                if promise <= self.stop.promise * here.cost:
                    break
                trial = self.cost(candidate)
                if np.isfinite(trial) and trial < here.cost:
                    better = candidate
                    damping = damping / _DAMPING_FACTOR
                    break
                damping = max(_DAMPING_FACTOR * damping, _LEAST_RAISED_DAMPING)
                is_undamped = False
            if better is None:
                break
            before = here.cost
            theta = better
            is_kept = abs(before - trial - promise) <= self.stop.kept_promise * trial
            if is_kept and is_undamped and not needs_sums:
                return theta, trial, here
            here = self.sums(theta)
            slow_steps = slow_steps + 1 if self.stop.is_slow(before, here.cost) else 0
            if slow_steps == self.stop.slow_steps:
                break
        return theta, here.cost, here


def bounded_step(
    sums: CostSums[Detail], theta: Array, *, bounds: Bounds, free: BoolArray, damping: float
) -> Array:
    """Parameters after a damped Gauss-Newton step, shape (p,).

    A parameter that the step would push out of its bounds stays on the bound, and the others are
    solved again beside it.

    Parameters
    ----------
    sums : CostSums
        Normal equations at `theta`.
    theta : ndarray, shape (p,)
        Parameters.
    bounds : Bounds
        Physical bounds.
    free : ndarray of bool, shape (p,)
        Parameters that move; one without influence stays.
    damping : float
        Share of every column's square that is added to the diagonal.
    """
    moving = free & (np.diag(sums.matrix) > 0.0)
    candidate = theta.copy()
    for _ in range(theta.size):
        index = np.flatnonzero(moving)
        if index.size == 0:
            break
        fixed_step = candidate - theta
        fixed_step[index] = 0.0
        right = sums.slope[index] - sums.matrix[index] @ fixed_step
        step = normal_solution(sums.matrix[np.ix_(index, index)], right, ridge=damping)
        candidate[index] = theta[index] + step
        outside = moving & bounds.outside(candidate)
        if not outside.any():
            break
        candidate = bounds.clipped(candidate)
        moving &= ~outside
    candidate = bounds.clipped(candidate)
    movable = free & (np.diag(sums.matrix) > 0.0) & (bounds.lower < bounds.upper)
    matrix = sums.matrix + damping * np.diag(np.diag(sums.matrix))
    if _is_held_wrongly(
        sums.slope - matrix @ (candidate - theta), movable & ~moving, candidate, bounds
    ):
        lower, upper = (bound[movable] - theta[movable] for bound in (bounds.lower, bounds.upper))
        step = bounded_solution(matrix[np.ix_(movable, movable)], sums.slope[movable], lower, upper)
        candidate[movable] = bounds.clipped(theta)[movable] + step
    return candidate


def _is_held_wrongly(slope: Array, fixed: BoolArray, theta: Array, bounds: Bounds) -> bool:
    """Whether the cost falls from a bound inwards: several parameters met theirs in one step."""
    # Some of them only because others were not held yet.
    at_lower, at_upper = theta <= bounds.lower, theta >= bounds.upper
    inwards = (at_lower & (slope > 0.0)) | (at_upper & (slope < 0.0))
    return bool((fixed & inwards).any())
