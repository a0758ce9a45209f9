"""Delays and drifting clocks, fitted together with the parameters of the baseline.

They find those too small to leave a gap, which yet move the baseline's parameters.

About a delay tau the signal is ``y(t) - tau dy/dt``. The baseline and a delay are fitted together,
``r = J d + tau s`` with ``s = -dy/dt``; what the baseline cannot absorb of the slope tells the
delay, :func:`carrierflex.diagnosis.wiring.linear_records.last_factor`. A clock that drifts adds
``s (t - t_middle) / T`` in one run.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.wiring.linear_records import (
    LinearRecord,
    correlation,
    inverse_of_unit_columns,
    last_factor,
    residual_variance,
    shared_products,
    unit_columns,
)

FloatArray = NDArray[np.float64]

#: Drift over its standard deviation that is told, one run of many.
_DRIFT = 5.0
#: The same of a delay: sensors that stand half a degree from where they are declared leave four.
_DELAY = 8.0


@dataclass(frozen=True)
class Lateness:
    """Delay of the signals [s] and its standard deviation.

    Parameters
    ----------
    run : str
        Run over which the delay grows by `seconds`; empty for a delay that all runs share.
    seconds, std : float
        Its size.
    explained : float
        Share of the residual's square over all records that it explains beside the baseline.
    """

    run: str
    seconds: float
    std: float
    explained: float


@dataclass(frozen=True, eq=False)
class _LateSums:
    """Products of baseline's columns, delay, drift and residual, by run and of all runs.

    `variance` is that of the residual, its correlation included.
    """

    runs: Mapping[str, FloatArray]
    total: FloatArray
    variance: float

    def drifts(self) -> tuple[Lateness, ...]:
        """Drift of every run that is beyond doubt."""
        n_baseline = len(self.total) - 3
        told = []
        for name, own in self.runs.items():
            # The baseline is common to all runs, delay and drift are this run's.
            sums = own.copy()
            sums[:n_baseline, :n_baseline] = self.total[:n_baseline, :n_baseline]
            sums[:n_baseline, -1] = sums[-1, :n_baseline] = self.total[:n_baseline, -1]
            explained = _explained(sums, n_baseline) / float(self.total[-1, -1])
            seconds, std = last_factor(sums, self._variance_beside(explained))
            if abs(seconds) > _DRIFT * std:
                told.append(Lateness(name, seconds, std, explained))
        return tuple(told)

    def delays(self) -> tuple[Lateness, ...]:
        """Delay of all runs where it is beyond doubt."""
        sums = np.delete(np.delete(self.total, -2, 0), -2, 1)
        explained = _explained(sums, len(sums) - 2) / float(self.total[-1, -1])
        seconds, std = last_factor(sums, self._variance_beside(explained))
        if abs(seconds) <= _DELAY * std:
            return ()
        return (Lateness("", seconds, std, explained),)

    def _variance_beside(self, explained: float) -> float:
        """Variance of what is left beside a lateness: its own slope is no scatter about it."""
        return self.variance * max(1.0 - explained, 0.0)


def late_signals(records: Iterable[LinearRecord]) -> tuple[Lateness, ...]:
    """Clocks that drift, or, where none does, the delay of all signals; empty where neither.

    Parameters
    ----------
    records : iterable of LinearRecord
        All runs, met once.
    """
    sums = _summed(records)
    return sums.drifts() or sums.delays() if sums else ()


def drifting_runs(records: Iterable[LinearRecord]) -> tuple[Lateness, ...] | None:
    """Clocks that drift, fitted together with the baseline; None where there is no record.

    Parameters
    ----------
    records : iterable of LinearRecord
        All runs, met once.
    """
    sums = _summed(records)
    return sums.drifts() if sums else None


def _summed(records: Iterable[LinearRecord]) -> _LateSums | None:
    """Products of all runs; None where there is no record."""
    products = {}
    residuals = []
    for record in records:
        slope = record.slope
        known = np.isfinite(record.residual) & np.isfinite(slope)
        middle = 0.5 * (record.time[0] + record.time[-1])
        along = (record.time - middle) / (record.time[-1] - record.time[0])
        late = -slope[known]
        drifting = (-slope * along[:, None])[known]
        rows = np.array([*record.columns[:, known], late, drifting, record.residual[known]])
        products[record.run] = shared_products(rows @ rows.T, record.n_of_run)
        residuals.append((correlation(record.residual), int(known.sum())))
    if not products:
        return None
    total = np.sum(list(products.values()), axis=0)
    return _LateSums(products, total, residual_variance(float(total[-1, -1]), residuals))


def _explained(sums: FloatArray, n_baseline: int) -> float:
    """Square of the residual that the columns after the baseline's explain beside these."""
    scaled, scale = unit_columns(sums)
    squares = [
        float(scaled[-1, :n] @ inverse_of_unit_columns(scaled[:n, :n]) @ scaled[-1, :n])
        for n in (n_baseline, len(sums) - 1)
    ]
    return float((squares[1] - squares[0]) * scale[-1] ** 2)
