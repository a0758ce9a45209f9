"""Combinations of columns at the samples of a carrier's runs, from another pass over them."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.carrier.records.columns import ColumnSource
from carrierflex.diagnosis.carrier.records.run_columns import BlockColumns, RunColumns
from carrierflex.diagnosis.carrier.records.sums import (
    CarrierSums,
    ComplexArray,
    IntArray,
    blocks_of_run,
)
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.order_analysis import order_amplitudes, too_sparse

FloatArray = NDArray[np.float64]


def residual_weights(values: FloatArray) -> FloatArray:
    """Weights of measured less predicted signals; the first column is the measured one.

    Parameters
    ----------
    values : ndarray, shape (n_runs, C, u)
        Weights of the predicted signals by run and channel.
    """
    weights = -values
    weights[..., 0] += 1.0
    return weights


def orders_of(
    records: CarrierSums,
    campaign: Campaign,
    source: ColumnSource,
    columns: IntArray,
    weights: FloatArray,
) -> ComplexArray:
    """Order amplitudes of a combination of columns by revolution, from another pass.

    Parameters
    ----------
    records : CarrierSums
        Segments and numbers of the columns.
    campaign : Campaign
        Records.
    source : ColumnSource
        Columns.
    columns : ndarray of int, shape (u,)
        Numbers of the columns.
    weights : ndarray, shape (n_runs, C, u)
        Weight of each of them by run and channel.

    Returns
    -------
    ndarray of complex, shape (R, C, n + 1)
        Amplitudes of the orders 0 to n; NaN where a revolution is too sparse.
    """
    result = np.full(records.orders.shape, np.nan, dtype=np.complex128)
    highest = records.orders.shape[-1] - 1
    places = np.searchsorted(records.run_of_revolution, np.arange(len(campaign.runs)))
    place = np.repeat(places[:, None], len(campaign.channels), axis=1)
    for r, c, block, signal in _combined(records, campaign, source, columns, weights):
        for revolution in block.revolutions:
            present = block.present(revolution)
            theta = block.inputs.carrier_angle[present]
            if not too_sparse(theta, highest):
                amplitudes, _ = order_amplitudes(signal[None, present], theta, highest)
                result[place[r, c], c] = amplitudes[:, 0]
            place[r, c] += 1
    return result


def signals_of(
    records: CarrierSums,
    campaign: Campaign,
    source: ColumnSource,
    columns: IntArray,
    weights: FloatArray,
) -> tuple[FloatArray, ...]:
    """A combination of columns at the samples of every run, from another pass.

    Parameters
    ----------
    records, campaign, source, columns, weights
        As of :func:`orders_of`.

    Returns
    -------
    tuple of ndarray, shape (n, C)
        One a run; NaN outside whole revolutions and where a column is missing.
    """
    result = tuple(
        np.full((run.time.size, len(campaign.channels)), np.nan) for run in campaign.runs
    )
    for r, c, block, signal in _combined(records, campaign, source, columns, weights):
        samples = np.concatenate(block.revolutions)
        result[r][samples, c] = signal[np.searchsorted(block.samples, samples)]
    return result


def _combined(
    records: CarrierSums,
    campaign: Campaign,
    source: ColumnSource,
    columns: IntArray,
    weights: FloatArray,
) -> Iterator[tuple[int, int, BlockColumns, FloatArray]]:
    """Run, channel, block and the combination of columns at the block's samples."""
    keys = list(records.index.numbers)
    used = [keys[column] for column in columns.tolist()]
    owners = {key[0] for key in used}
    for r, run in enumerate(campaign.within_use().runs):
        of_run = RunColumns(run, source)
        blocks = blocks_of_run(records, r, of_run)
        for c, channel in enumerate(campaign.channels):
            for block in of_run.of(channel, blocks, owners):
                rows = block.rows[[block.index.numbers[key] for key in used]]
                yield r, c, block, weights[r, c] @ rows
