"""Order amplitudes of what models of a carrier leave, and their mean turns; the last are cached."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from carrierflex.diagnosis.carrier.records.columns import ColumnSource
from carrierflex.diagnosis.carrier.records.sums import (
    CarrierSums,
    ComplexArray,
    IntArray,
    segments_of,
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
        """The same from a pass over the records, not cached: of 500 runs 66 MB.

        NaN where a revolution is too sparse.
        """
        columns, values = self.values(effects, theta)
        weights = -values
        weights[..., 0] += 1.0
        keys = list(self.records.index.numbers)
        used = [keys[column] for column in columns.tolist()]
        result = np.full(self.records.orders.shape, np.nan, dtype=np.complex128)
        highest = self.records.orders.shape[-1] - 1
        first = np.searchsorted(self.records.run_of_revolution, np.arange(len(self.campaign.runs)))
        turn = np.repeat(first[:, None], len(self.campaign.channels), axis=1)
        owners = {key[0] for key in used}
        for r, c, _, block in segments_of(self.campaign, self.source, self.records, owners):
            rows = block.rows[[block.index.numbers[key] for key in used]]
            signal = weights[r, c] @ rows
            for revolution in block.revolutions:
                present = block.present(revolution)
                theta_of_turn = block.inputs.carrier_angle[present]
                if not too_sparse(theta_of_turn, highest):
                    amplitudes, _ = order_amplitudes(signal[None, present], theta_of_turn, highest)
                    result[turn[r, c], c] = amplitudes[:, 0]
                turn[r, c] += 1
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
