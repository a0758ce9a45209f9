"""Fits from several starts, and nested models of which the richer one may never fit worse."""

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import replace

import numpy as np

from carrierflex.identification.estimation.nonlinear_fit import (
    Array,
    FreeParameter,
    NonlinearFit,
    Residuals,
    bounded_fit,
)

#: Relative change of cost and parameters at which the search ends while starts are compared.
_ROUGH = 1e-4
#: A richer model may fit worse by this share, which is rounding; more is a failed search.
NESTED_MARGIN = 1e-6


def best_of_starts(
    residuals: Residuals,
    free: Sequence[FreeParameter],
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
    free : sequence of FreeParameter
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
    order = sorted(range(1, len(starts)), key=lambda k: costs[k])
    chosen = [starts[k] for k in [0, *order][:most]]
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


def _start_cost(residuals: Residuals, start: Array) -> float:
    """Cost of a start; infinite where the model fails."""
    try:
        cost = float(np.square(residuals(start)).sum())
    except (ValueError, ArithmeticError):
        return np.inf
    return cost if np.isfinite(cost) else np.inf


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
    ArithmeticError
        Where the richer model's cost is higher by more than rounding.
    """
    if richer > simpler * (1.0 + NESTED_MARGIN):
        raise ArithmeticError(
            f"model {names[0]} contains {names[1]} and yet fits worse, {richer:.9g} against {simpler:.9g}: the search failed"
        )


def merged_values(
    free: Sequence[FreeParameter], given: Mapping[str, float], neutral: Mapping[str, float]
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
