"""The complex method: constrained direct search with a population of points, as the papers used it.

A population of twice as many points as parameters; again and again the worst point is mirrored
through the centroid of the others and, where that does not help, drawn back towards it. No
derivatives, many evaluations.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Objective = Callable[[NDArray[np.float64]], float]

#: Box's over-reflection: the mirrored point lies this many times as far from the centroid as the
#: worst one.
REFLECTION = 1.3
#: A point drawn back this often sits at the best point to a part in a million.
_LARGEST_RETREAT = 20


@dataclass(frozen=True, eq=False)
class ComplexSearch:
    """What the search found.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Best point.
    cost : float
        Objective there.
    evaluations : int
        Calls of the objective.
    converged : bool
        Whether the population shrank below the tolerance before the evaluations ran out.
    history : ndarray, shape (k, 3)
        Calls so far, least and largest cost of the population, before the first reflection and
        after each.
    """

    values: NDArray[np.float64]
    cost: float
    evaluations: int
    converged: bool
    history: NDArray[np.float64]


def complex_search(
    objective: Objective,
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
    *,
    rng: np.random.Generator,
    start: NDArray[np.float64] | None = None,
    tolerance: float = 1e-6,
    max_evaluations: int = 20_000,
) -> ComplexSearch:
    """Minimise an objective within bounds by the complex method.

    Parameters
    ----------
    objective : callable
        ``objective(values, shape (n,)) -> cost``; a cost that is not finite counts as the worst.
    lower, upper : ndarray, shape (n,)
        Bounds of every parameter.
    rng : numpy.random.Generator
        Source of the first population.
    start : ndarray, shape (n,), optional
        A point of the first population; the others are drawn evenly within the bounds.
    tolerance : float
        The search ends when the costs of the population agree to this share of their mean, and the
        points to this share of the bounds' distance.
    max_evaluations : int
        The search ends after so many calls.

    Returns
    -------
    ComplexSearch
        Best point of the population.

    Raises
    ------
    ValueError
        Where a lower bound is not below the upper one, or the start lies outside.

    References
    ----------
    .. [1] M. J. Box, "A new method of constrained optimization and a comparison with other
       methods", Computer Journal 8 (1965) 42-52.
    """
    _refuse_bounds(lower, upper, start)
    n = lower.size
    points = rng.uniform(lower, upper, (2 * n, n))
    if start is not None:
        points[0] = start
    search = _Population(objective, lower, upper, points)
    while search.evaluations < max_evaluations:
        if search.spread() < tolerance:
            return search.result(converged=True)
        search.improve_worst()
    return search.result(converged=False)


class _Population:
    """Points, their costs and the number of calls so far."""

    def __init__(
        self,
        objective: Objective,
        lower: NDArray[np.float64],
        upper: NDArray[np.float64],
        points: NDArray[np.float64],
    ) -> None:
        self._objective = objective
        self._lower = lower
        self._upper = upper
        self.evaluations = 0
        self._points = points
        self._costs = np.array([self._cost(point) for point in points])
        self._history: list[tuple[float, float, float]] = []
        self._note()

    def improve_worst(self) -> None:
        """Mirror the worst point through the centroid of the others.

        Retreat until it is no longer the worst.
        """
        worst, best = int(np.argmax(self._costs)), int(np.argmin(self._costs))
        centroid = np.delete(self._points, worst, axis=0).mean(axis=0)
        second = np.delete(self._costs, worst).max()
        trial = np.clip(
            centroid + REFLECTION * (centroid - self._points[worst]), self._lower, self._upper
        )
        cost = self._cost(trial)
        for retreat in range(_LARGEST_RETREAT):
            if cost < second:
                break
            # A centroid may itself be poor: later retreats lead towards the best point instead
            # (Guin's remedy).
            share = 1.0 / (retreat + 1.0)
            target = share * centroid + (1.0 - share) * self._points[best]
            trial = 0.5 * (trial + target)
            cost = self._cost(trial)
        self._points[worst], self._costs[worst] = trial, cost
        self._note()

    def _note(self) -> None:
        least, largest = float(self._costs.min()), float(self._costs.max())
        self._history.append((self.evaluations, least, largest))

    def spread(self) -> float:
        """Larger of the relative spreads of costs and points."""
        if not np.isfinite(self._costs).all():
            return np.inf
        costs = np.ptp(self._costs) / max(abs(self._costs.mean()), np.finfo(float).tiny)
        points = (np.ptp(self._points, axis=0) / (self._upper - self._lower)).max()
        return float(max(costs, points))

    def result(self, *, converged: bool) -> ComplexSearch:
        """Best point of all."""
        best = int(np.argmin(self._costs))
        return ComplexSearch(
            self._points[best].copy(),
            float(self._costs[best]),
            self.evaluations,
            converged,
            np.array(self._history),
        )

    def _cost(self, point: NDArray[np.float64]) -> float:
        self.evaluations += 1
        cost = float(self._objective(point))
        return cost if np.isfinite(cost) else np.inf


def _refuse_bounds(
    lower: NDArray[np.float64], upper: NDArray[np.float64], start: NDArray[np.float64] | None
) -> None:
    for k, (low, high) in enumerate(zip(lower, upper, strict=True)):
        if not low < high:
            raise ValueError(
                f"parameter {k}: bounds {low} and {high}; expected the lower one below the upper "
                "one"
            )
        if start is not None and not low <= start[k] <= high:
            raise ValueError(
                f"parameter {k}: start {start[k]} lies outside its bounds {low} to {high}"
            )
