"""The gap map: how the residual of a model splits over orders, sensor patterns and runs."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import f as fisher_f
from scipy.stats import false_discovery_control

from diagnosis.order_map import MAX_ORDER, PATTERNS, order_coefficients, sensor_patterns
from identification.campaign import Campaign, Channel
from identification.carrier_identification import axial_channels, identify_jointly, residual_signal
from identification.carrier_models import CarrierModel
from identification.parameter_estimate import ParameterEstimate
from identification.records import Run
from identification.revolutions import whole_revolutions


@dataclass(frozen=True, eq=False)
class GapMap:
    """Split of the gap over runs, orders and patterns.

    Parameters
    ----------
    model : str
        Name of the model whose residual this is.
    runs : tuple of str
        Runs, first axis.
    orders : ndarray of int, shape (n_orders,)
        Orders of carrier rotation, second axis; the third axis is the patterns m = 0, +1, -1, 2.
    mean_square : ndarray, shape (n_runs, n_orders, 4)
        Mean square of the mean revolution [m²].
    coherent : ndarray, shape (n_runs, n_orders, 4)
        The same less what noise adds to it [m²]; may be negative where there is no gap.
    share : ndarray, shape (n_runs, n_orders, 4)
        `coherent` over its sum in the run.
    overall_share : ndarray, shape (n_orders, 4)
        Sum of `coherent` over the runs over the sum of all.
    p_value, adjusted_p_value : ndarray, shape (n_runs, n_orders, 4)
        Probability of such a cell without a gap; adjusted for the number of cells (Benjamini-Yekutieli).
    rms : ndarray, shape (n_runs,)
        RMS of the residual over all samples [m].
    n_revolutions : tuple of int
        Complete revolutions used, by run.
    """

    model: str
    runs: tuple[str, ...]
    orders: NDArray[np.int64]
    mean_square: NDArray[np.float64]
    coherent: NDArray[np.float64]
    share: NDArray[np.float64]
    overall_share: NDArray[np.float64]
    p_value: NDArray[np.float64]
    adjusted_p_value: NDArray[np.float64]
    rms: NDArray[np.float64]
    n_revolutions: tuple[int, ...]


def gap_map(campaign: Campaign, model: CarrierModel) -> GapMap:
    """Fit a model to all runs and map what it leaves.

    With ``e_r`` the amplitude of a cell in revolution r of R, ``s² = sum |e_r - mean|² / (R - 1)`` and the weight w
    (1 at order 0, else 1/2): coherent gap ``w (|mean|² - s² / R)``, test ``R |mean|² / s² ~ F(d, d (R - 1))`` with
    d = 2 for complex cells and d = 1 for the real ones (order 0, m = 0 and m = 2).

    Parameters
    ----------
    campaign : Campaign
        Campaign of kind ``carrier`` with four axial sensors 90 deg apart.
    model : CarrierModel
        The baseline: for the first map the axial offset alone.

    Returns
    -------
    GapMap
        Split of measurement minus model.

    Raises
    ------
    ValueError
        Where the sensors are not four, 90 deg apart, or a run has fewer than two complete revolutions.
    """
    channels = axial_channels(campaign)
    estimate = identify_jointly(campaign, model)
    cells = [_run_cells(run, channels, model, estimate) for run in campaign.runs]
    orders = np.arange(MAX_ORDER + 1)
    weight = np.where(orders == 0, 1.0, 0.5)[:, None]
    mean_square = np.array([weight * np.abs(own.mean(axis=0)) ** 2 for own in cells])
    noise = np.array([weight * own.var(axis=0, ddof=1) / len(own) for own in cells])
    coherent = mean_square - noise
    p_value = np.array([_p_value(own) for own in cells])
    return GapMap(
        model=model.name,
        runs=tuple(run.name for run in campaign.runs),
        orders=orders,
        mean_square=mean_square,
        coherent=coherent,
        share=coherent / _not_zero(coherent.sum(axis=(1, 2), keepdims=True)),
        overall_share=coherent.sum(axis=0) / _not_zero(coherent.sum()),
        p_value=p_value,
        adjusted_p_value=false_discovery_control(p_value, axis=None, method="by").reshape(p_value.shape),
        rms=np.array([estimate.rms_by_run[run.name] for run in campaign.runs]),
        n_revolutions=tuple(len(own) for own in cells),
    )


def _run_cells(
    run: Run, channels: tuple[Channel, ...], model: CarrierModel, estimate: ParameterEstimate
) -> NDArray[np.complex128]:
    """Pattern amplitudes of the residual of one run, shape (n_complete_revolutions, n_orders, 4)."""
    revolutions = whole_revolutions(run).samples
    by_channel = [
        order_coefficients(run.inputs["carrier_angle"], residual_signal(run, channel, model, estimate), revolutions)
        for channel in channels
    ]
    angles = np.array([channel.angle for channel in channels], dtype=np.float64)
    cells = sensor_patterns(np.stack(by_channel, axis=-1), angles)
    complete = cells[np.isfinite(cells).all(axis=(1, 2))]
    if len(complete) < 2:
        raise ValueError(
            f"run {run.name}: {len(complete)} complete revolutions with samples dense enough for order {MAX_ORDER} on "
            "all four axial sensors; expected at least two"
        )
    return complete


def _p_value(cells: NDArray[np.complex128]) -> NDArray[np.float64]:
    """F test of every cell's mean against its scatter over revolutions, shape (n_orders, 4)."""
    n = len(cells)
    scatter = cells.var(axis=0, ddof=1)
    ratio = n * np.abs(cells.mean(axis=0)) ** 2 / np.maximum(scatter, np.finfo(float).tiny)
    degrees = np.full(scatter.shape, 2.0)
    degrees[0, [PATTERNS.index(0), PATTERNS.index(2)]] = 1.0
    return fisher_f.sf(ratio, degrees, degrees * (n - 1))


def _not_zero(total: NDArray[np.float64]) -> NDArray[np.float64]:
    """Total to divide by; NaN, not a division by zero, where there is no gap."""
    return np.where(total == 0.0, np.nan, total)
