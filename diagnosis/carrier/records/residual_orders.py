"""Order amplitudes of what models of a carrier leave, and their mean turns; the last are kept."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from carrierflex.diagnosis.carrier.records.columns import BlockColumns, ColumnSource, RunColumns
from carrierflex.diagnosis.carrier.records.sums import (
    CarrierSums,
    ComplexArray,
    IntArray,
    blocks_of_run,
)
from carrierflex.diagnosis.comparison.problem import Effects, FloatArray
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.order_analysis import order_amplitudes, too_sparse

#: Residuals that are kept: map, findings, scalars and overlays are of two models.
_KEPT = 2


#: Angles of one turn [rad].
TURN_ANGLES = np.linspace(0.0, 2.0 * np.pi, 181)


@dataclass(frozen=True, eq=False)
class ResidualOrders:
    """Residuals of models by shaft order.

    Parameters
    ----------
    campaign : Campaign
        Records.
    records : CarrierSums
        Order amplitudes of the measured signals.
    source : ColumnSource
        Columns.
    values : callable
        Columns of a model's signals and their weights by run and channel, from its effects and
        parameters.
    """

    campaign: Campaign
    records: CarrierSums
    source: ColumnSource
    values: Callable[[Effects, FloatArray], tuple[IntArray, FloatArray]]

    def of(self, effects: Effects, theta: FloatArray) -> ComplexArray:
        """Order amplitudes of what a model leaves, shape (R, C, n + 1); the last two are kept."""
        return self._kept(effects, tuple(theta.tolist()))

    def made(self, effects: Effects, theta: FloatArray) -> ComplexArray:
        """The same from a pass over the records; of 500 runs 66 MB that nobody keeps."""
        columns, values = self.values(effects, theta)
        weights = residual_weights(values)
        return orders_of(self.records, self.campaign, self.source, columns, weights)

    @cached_property
    def measured_turns(self) -> FloatArray:
        """Measured signals over one turn, shape (n_runs, C, 181)."""
        return self._turns(self.records.orders)

    def turns(self, effects: Effects, theta: FloatArray) -> FloatArray:
        """What a model leaves over one turn, shape (n_runs, C, 181)."""
        return self._turns(self.of(effects, theta))

    def _turns(self, orders: ComplexArray) -> FloatArray:
        return mean_turns(orders, self.records.run_of_revolution, len(self.campaign.runs))

    @cached_property
    def _kept(self) -> Callable[[Effects, tuple[float, ...]], ComplexArray]:
        def left(effects: Effects, theta: tuple[float, ...]) -> ComplexArray:
            """Order amplitudes of one residual."""
            return self.made(effects, np.array(theta))

        return lru_cache(maxsize=_KEPT)(left)


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


def mean_turns(orders: ComplexArray, run_of_revolution: IntArray, n_runs: int) -> FloatArray:
    """Signals over one turn of the carrier, averaged over the revolutions of every run.

    Parameters
    ----------
    orders : ndarray of complex, shape (R, C, n + 1)
        Order amplitudes by revolution and channel; NaN where a revolution is too sparse.
    run_of_revolution : ndarray of int, shape (R,)
        Run of every revolution.
    n_runs : int
        Number of runs.

    Returns
    -------
    ndarray, shape (n_runs, C, 181)
        ``Re(sum_n Y(n) exp(j n theta))`` [m]; NaN for a run without a complete revolution.
    """
    waves = np.exp(1j * np.outer(np.arange(orders.shape[-1]), TURN_ANGLES))
    turns = np.full((n_runs, orders.shape[1], TURN_ANGLES.size), np.nan)
    for r in range(n_runs):
        revolutions = orders[run_of_revolution == r]
        revolutions = revolutions[np.isfinite(revolutions).all(axis=(1, 2))]
        if len(revolutions):
            turns[r] = (revolutions.mean(axis=0) @ waves).real
    return turns
