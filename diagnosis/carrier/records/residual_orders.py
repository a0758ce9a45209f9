"""Order amplitudes of what models of a carrier leave, and their mean turns; the last are kept."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from carrierflex.diagnosis.carrier.pictures import mean_turns
from carrierflex.diagnosis.carrier.records.columns import ColumnSource
from carrierflex.diagnosis.carrier.records.combinations import orders_of, residual_weights
from carrierflex.diagnosis.carrier.records.sums import CarrierSums, ComplexArray, IntArray
from carrierflex.diagnosis.comparison.problem import Effects, FloatArray
from carrierflex.identification.campaign.campaign import Campaign

#: Residuals that are kept: map, findings, scalars and overlays are of two models.
_KEPT = 2


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
