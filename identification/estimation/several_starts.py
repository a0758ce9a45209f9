"""Fits from several starts, and nested models of which the richer one may never fit worse."""

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import replace

import numpy as np

from carrierflex.identification.estimation.nonlinear_fit import (
    Array,
    NonlinearFit,
    Residuals,
    bounded_fit,
)
from carrierflex.simulation.fit_parameter import FitParameter

#: Relative change of cost and parameters at which the search ends while starts are compared.
_ROUGH = 1e-4
#: A richer model may cost more than one it contains by this share, which is rounding; more is a
#: failed search.
NESTED_TOLERANCE = 1e-6


class NestedCostError(ArithmeticError):
    """A model costs more than a model it contains: its solution is not a minimum.

    Parameters
    ----------
    richer, simpler : float
        Costs of both models on the same data.
    names : tuple of str
        Their names.
    """

    def __init__(self, richer: float, simpler: float, names: tuple[str, str]) -> None:
        super().__init__(
            f"model {names[0]} contains {names[1]} and costs {richer:.9g}, more than "
            f"{simpler:.9g}; the search did not converge"
        )


def best_of_starts(
    residuals: Residuals,
    free: Sequence[FitParameter],
    starts: Sequence[Array],
    executor: Executor,
    *,
    most: int,
) -> NonlinearFit:
    """Fit roughly from the most promising starts and keep the best.

    Starts at which the model fails are passed over.

    Parameters
    ----------
    residuals : callable
        Plain object that other processes can load.
    free : sequence of FitParameter
        Unknowns.
    starts : sequence of ndarray, shape (p,)
        Starts; the first is always searched from.
    executor : Executor
        Where the fits run; the result does not depend on it.
    most : int
        Starts to search from, those of least cost.

    Returns
    -------
    NonlinearFit
        Best fit, with the model runs of all.

    Raises
    ------
    ValueError
        Where every start fails; the message is that of the first.
    """
    costs = list(executor.map(_start_cost, [residuals] * len(starts), starts))
    order = [0, *(k for k in ranked_starts(costs) if k != 0)]
    chosen = [starts[k] for k in order[:most]]
    futures = [
        executor.submit(bounded_fit, residuals, tuple(free), start, tolerance=_ROUGH)
        for start in chosen
    ]
    fits, errors = [], []
    for future in futures:
        try:
            fits.append(future.result())
        except (ValueError, ArithmeticError) as error:
            errors.append(error)
    if not fits:
        raise ValueError(f"no start of {len(chosen)} gave a fit: {errors[0]}") from errors[0]
    best = min(fits, key=lambda fit: fit.cost)
    return replace(best, model_runs=len(starts) + sum(fit.model_runs for fit in fits))


def ranked_starts(costs: Sequence[float]) -> list[int]:
    """Indices of starts from the least cost to the largest; those at which the model fails last.

    Parameters
    ----------
    costs : sequence of float
        Cost at every start, not finite where the model fails there.
    """
    finite = np.where(np.isfinite(costs), costs, np.inf)
    return [int(k) for k in np.argsort(finite, kind="stable")]


def _start_cost(residuals: Residuals, start: Array) -> float:
    """Cost of a start; infinite where the model fails."""
    try:
        cost = float(np.square(residuals(start)).sum())
    except (ValueError, ArithmeticError):
        return np.inf
    return cost if np.isfinite(cost) else np.inf


def costs_more(richer: float, simpler: float) -> bool:
    """Whether a model costs more than one it contains by more than rounding."""
    return richer > simpler * (1.0 + NESTED_TOLERANCE)


def check_nested(richer: float, simpler: float, names: tuple[str, str]) -> None:
    """Refuse a search that failed: a model that contains another cannot fit worse.

    Parameters
    ----------
    richer, simpler : float
        Costs of both models on the same data.
    names : tuple of str
        Their names.

    Raises
    ------
    NestedCostError
        Where the richer model's cost is higher by more than rounding.
    """
    if costs_more(richer, simpler):
        raise NestedCostError(richer, simpler, names)


def merged_values(
    free: Sequence[FitParameter], given: Mapping[str, float], neutral: Mapping[str, float]
) -> Array:
    """Start of a richer model.

    The simpler one's values, and for what it adds the value that changes nothing.

    Raises
    ------
    ValueError
        Where neither holds a parameter.
    """
    known = {**neutral, **given}
    missing = [parameter.name for parameter in free if parameter.name not in known]
    if missing:
        raise ValueError(f"no start for parameter {missing[0]}; expected one of {', '.join(known)}")
    return np.array([known[parameter.name] for parameter in free])
