"""Order amplitudes of what models of a carrier leave, and their mean turns; the last are cached."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import count

import numpy as np

from carrierflex.diagnosis.carrier.records.columns import ColumnSource, RunColumns
from carrierflex.diagnosis.carrier.records.sums import (
    MOST_BLOCKS,
    CarrierSums,
    ComplexArray,
    IntArray,
)
from carrierflex.diagnosis.comparison.problem import Effects, FloatArray
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.order_analysis import order_amplitudes, too_sparse

#: Residuals that are cached: map, findings, scalars and overlays are of two models.
_CACHED = 2
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
        """Order amplitudes of what a model leaves, shape (R, C, n + 1); the last two are cached."""
        return self._cached(effects, tuple(theta.tolist()))

    def made(self, effects: Effects, theta: FloatArray) -> ComplexArray:
        """The same, not cached: of 500 runs 66 MB. NaN where a revolution is too sparse."""
        columns, values = self.values(effects, theta)
        weights = -values
        weights[..., 0] += 1.0
        if self.records.amplitudes.shape[2] == 1:
            return self._from_records(columns, weights)
        result = np.empty(self.records.orders.shape, dtype=np.complex128)
        row = np.zeros((1, self.records.index.size))
        for r in range(len(weights)):
            turns = self.records.run_of_revolution == r
            for c, of_channel in enumerate(weights[r]):
                row[0, columns] = of_channel
                by_basis = self.records.by_basis(c, row)[0]
                result[turns, c] = by_basis @ self.records.amplitudes[turns, c]
        return result

    def _from_records(self, columns: IntArray, weights: FloatArray) -> ComplexArray:
        """Order amplitudes of weighted columns, from a pass over the records."""
        keys = list(self.records.index.numbers)
        used = [keys[column] for column in columns.tolist()]
        result = np.full(self.records.orders.shape, np.nan, dtype=np.complex128)
        highest = self.records.orders.shape[-1] - 1
        owners = {key[0] for key in used}
        for r, run in enumerate(self.campaign.within_use().runs):
            run_columns = RunColumns(run, self.source)
            first = int(np.argmax(self.records.run_of_revolution == r))
            for c, channel in enumerate(self.campaign.channels):
                turns = count(first)
                for block in run_columns.of(channel, run_columns.blocks(MOST_BLOCKS), owners):
                    rows = block.rows[[block.index.numbers[key] for key in used]]
                    signal = weights[r, c] @ rows
                    for turn, revolution in zip(turns, block.revolutions, strict=False):
                        present = block.present(revolution)
                        angle = block.inputs.carrier_angle[present]
                        if not too_sparse(angle, highest):
                            of_turn = order_amplitudes(signal[None, present], angle, highest)
                            result[turn, c] = of_turn[0][:, 0]
        return result

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
    def _cached(self) -> Callable[[Effects, tuple[float, ...]], ComplexArray]:
        def residual(effects: Effects, theta: tuple[float, ...]) -> ComplexArray:
            """Order amplitudes of one residual."""
            return self.made(effects, np.array(theta))

        return lru_cache(maxsize=_CACHED)(residual)


def mean_turns(orders: ComplexArray, run_of_revolution: IntArray, n_runs: int) -> FloatArray:
    """Signals over one turn, ``Re(sum_n Y(n) exp(j n theta))``, averaged over revolutions, by run.

    Shape (n_runs, C, 181) [m], of orders of shape (R, C, n + 1); NaN for a run without a complete
    revolution.
    """
    waves = np.exp(1j * np.outer(np.arange(orders.shape[-1]), TURN_ANGLES))
    turns = np.full((n_runs, orders.shape[1], TURN_ANGLES.size), np.nan)
    for r in range(n_runs):
        revolutions = orders[run_of_revolution == r]
        revolutions = revolutions[np.isfinite(revolutions).all(axis=(1, 2))]
        if len(revolutions):
            turns[r] = (revolutions.mean(axis=0) @ waves).real
    return turns
