"""Huber's loss: residuals beyond a limit count linearly instead of squared, and are flagged."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.identification.campaign.declarations import Channel
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.carrier.models import CarrierModel
from carrierflex.identification.estimation.least_squares import joint_fit
from carrierflex.identification.estimation.normal_equations import NormalEquations, normal_equations

#: Limit in standard deviations: 95 % of the efficiency of least squares for normal residuals.
HUBER_LIMIT = 1.345
#: A residual beyond so many standard deviations is an outlier: once in 500 million normal ones.
OUTLIER_LIMIT = 6.0
#: Median of the absolute value of a standard normal variable.
_NORMAL_MEDIAN = 0.6745
_LARGEST_ITERATION = 30
#: Change of the residuals, in their standard deviation, at which the iteration has converged.
_CONVERGED = 1e-4

Residuals = Mapping[str, NDArray[np.float64]]


@dataclass(frozen=True)
class Outliers:
    """Outliers of one channel in one run; they are flagged, never dropped.

    Parameters
    ----------
    run, channel : str
        Where.
    count : int
        Samples beyond the limit.
    largest : float
        Largest residual, in robust standard deviations.
    time : float
        Time of the largest [s].
    """

    run: str
    channel: str
    count: int
    largest: float
    time: float


def huber_equations(
    runs: Sequence[Run], channels: Sequence[Channel], model: CarrierModel
) -> list[NormalEquations]:
    """Weighted sums whose least-squares solution minimises Huber's loss over all runs.

    Iteratively reweighted: ``w = min(1, 1.345 s / |r|)`` with the robust standard deviation s of
    each run and channel.

    Parameters
    ----------
    runs : sequence of Run
        Records.
    channels : sequence of Channel
        Channels to fit.
    model : CarrierModel
        Model.

    Returns
    -------
    list of NormalEquations
        Weighted sums, one for each run.

    References
    ----------
    .. [1] P. J. Huber, E. M. Ronchetti, "Robust Statistics", 2nd ed. (2009), section 7.8.
    """
    equations = [normal_equations(run, channels, model) for run in runs]
    designs = [
        {channel.name: model.design(run.inputs, channel) for channel in channels} for run in runs
    ]
    previous: list[Residuals] | None = None
    for _ in range(_LARGEST_ITERATION):
        fit = joint_fit(equations, model.shared)
        residuals: list[Residuals] = [
            {
                name: run.signals[name] - design @ fit.run_coefficients(k)
                for name, design in designs[k].items()
            }
            for k, run in enumerate(runs)
        ]
        if previous is not None and _largest_change(previous, residuals) < _CONVERGED:
            break
        previous = residuals
        equations = [
            normal_equations(
                run, channels, model, {name: _weights(r) for name, r in signals.items()}
            )
            for run, signals in zip(runs, residuals, strict=True)
        ]
    return equations


def flagged_outliers(run: Run, residuals: Residuals) -> tuple[Outliers, ...]:
    """Channels of a run with residuals far outside the others.

    Parameters
    ----------
    run : Run
        Record.
    residuals : mapping of str to ndarray, shape (n,)
        Measurement minus model by channel [m]; NaN where a sample is missing.

    Returns
    -------
    tuple of Outliers
        One for each channel that has any; distances are from the channel's median.
    """
    flagged = []
    for channel, residual in residuals.items():
        if not np.isfinite(residual).any():
            continue
        distance = residual - np.nanmedian(residual)
        scale = _robust_deviation(distance)
        beyond = np.abs(distance) > OUTLIER_LIMIT * scale
        if scale > 0.0 and beyond.any():
            worst = int(np.nanargmax(np.abs(distance)))
            size = float(abs(distance[worst]) / scale)
            flagged.append(
                Outliers(run.name, channel, int(beyond.sum()), size, float(run.time[worst]))
            )
    return tuple(flagged)


def _robust_deviation(residual: NDArray[np.float64]) -> float:
    return (
        float(np.nanmedian(np.abs(residual)) / _NORMAL_MEDIAN)
        if np.isfinite(residual).any()
        else 0.0
    )


def _weights(residual: NDArray[np.float64]) -> NDArray[np.float64]:
    limit = HUBER_LIMIT * _robust_deviation(residual)
    size = np.abs(residual)
    return np.divide(limit, size, out=np.ones_like(size), where=(size > limit) & (limit > 0.0))


def _largest_change(before: Sequence[Residuals], after: Sequence[Residuals]) -> float:
    changes = [
        float(
            np.nanmax(np.abs(old[name] - new[name]))
            / max(_robust_deviation(new[name]), np.finfo(float).tiny)
        )
        for old, new in zip(before, after, strict=True)
        for name in new
        if np.isfinite(new[name]).any()
    ]
    return max(changes, default=0.0)
