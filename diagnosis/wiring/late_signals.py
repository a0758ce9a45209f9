"""Delays and drifting clocks, fitted together with the parameters of the baseline.

They find those too small to leave a gap, which yet move the baseline's parameters.

About a delay tau the signal is ``y(t) - tau dy/dt``. The baseline and a delay are fitted together,
``r = J d + tau s`` with ``s = -dy/dt``; what the baseline cannot absorb of the slope tells the
delay. Its variance is that of least squares times the correlation of the residual from sample to
sample, ``1 + 2 (rho_1 + rho_2 + ...)``. A clock that drifts adds ``s (t - t_middle) / T`` in one
run.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.identification.estimation.scaled_least_squares import column_lengths

FloatArray = NDArray[np.float64]

#: Share of a column that the others must leave for its factor to be told from theirs.
_LEFT = 1e-6
#: Lags of the residual's correlation.
_LAGS = 20
#: Drift over its standard deviation that is told, one run of many.
_DRIFT = 5.0
#: The same of a delay: sensors that stand half a degree from where they are declared leave four.
_DELAY = 8.0


@dataclass(frozen=True, eq=False)
class LinearRecord:
    """One run beside a baseline that is linear in its parameters.

    Parameters
    ----------
    run : str
        Its name.
    time : ndarray, shape (n,)
        Time [s].
    residual, slope : ndarray, shape (n, n_channels)
        Measured less predicted, NaN where missing; derivative of the prediction by time.
    columns : ndarray, shape (p, n, n_channels)
        Derivatives of the prediction by the baseline's parameters.
    """

    run: str
    time: FloatArray
    residual: FloatArray
    slope: FloatArray
    columns: FloatArray


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
            seconds, std = _last_factor(sums, self._variance_beside(explained))
            if abs(seconds) > _DRIFT * std:
                told.append(Lateness(name, seconds, std, explained))
        return tuple(told)

    def delays(self) -> tuple[Lateness, ...]:
        """Delay of all runs where it is beyond doubt."""
        sums = np.delete(np.delete(self.total, -2, 0), -2, 1)
        explained = _explained(sums, len(sums) - 2) / float(self.total[-1, -1])
        seconds, std = _last_factor(sums, self._variance_beside(explained))
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
    correlations = []
    counts = []
    for record in records:
        known = np.isfinite(record.residual) & np.isfinite(record.slope)
        middle = 0.5 * (record.time[0] + record.time[-1])
        along = (record.time - middle) / (record.time[-1] - record.time[0])
        late = -record.slope[known]
        drifting = (-record.slope * along[:, None])[known]
        rows = np.array([*record.columns[:, known], late, drifting, record.residual[known]])
        products[record.run] = rows @ rows.T
        correlations.append(_correlation(record.residual))
        counts.append(int(known.sum()))
    if not products:
        return None
    total = np.sum(list(products.values()), axis=0)
    variance = float(np.average(correlations, weights=counts) * total[-1, -1] / sum(counts))
    return _LateSums(products, total, variance)


def _scaled(sums: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Products of columns of unit length, and the lengths."""
    # Columns of very different units: the pseudo-inverse judges them by their own size.
    scale = column_lengths(sums)
    return sums / np.outer(scale, scale), scale


def _inverse(scaled: FloatArray) -> FloatArray:
    """Inverse of products of columns of unit length, without the directions that are rounding."""
    return np.asarray(np.linalg.pinv(scaled, rcond=1e-12, hermitian=True), dtype=np.float64)


def _explained(sums: FloatArray, n_baseline: int) -> float:
    """Square of the residual that the columns after the baseline's explain beside these."""
    scaled, scale = _scaled(sums)
    squares = [
        float(scaled[-1, :n] @ _inverse(scaled[:n, :n]) @ scaled[-1, :n])
        for n in (n_baseline, len(sums) - 1)
    ]
    return float((squares[1] - squares[0]) * scale[-1] ** 2)


def _last_factor(sums: FloatArray, variance: float) -> tuple[float, float]:
    """Factor of the last column before the residual in a least-squares fit, and its deviation.

    Parameters
    ----------
    sums : ndarray, shape (p + 2, p + 2)
        Products of p columns, the column in question and the residual.
    variance : float
        Variance of the residual, correlation included.
    """
    scaled, scale = _scaled(sums)
    others = slice(0, -2)
    absorbed = _inverse(scaled[others, others]) @ scaled[others, -2]
    left = 1.0 - float(scaled[-2, others] @ absorbed)
    if left < _LEFT:
        return 0.0, np.inf
    along = float(scaled[-2, -1] - absorbed @ scaled[others, -1])
    factor = along / left * float(scale[-1] / scale[-2])
    return factor, float(np.sqrt(variance / left) / scale[-2])


def _correlation(residual: FloatArray) -> float:
    """Factor by which correlated samples raise a variance, mean over the channels; one at least."""
    values = np.where(np.isfinite(residual), residual, 0.0)
    values = values - values.mean(axis=0)
    n = len(values)
    square = np.sum(values**2, axis=0)
    if n <= 2 * _LAGS or not (square > 0.0).any():
        return 1.0
    lagged = [np.sum(values[lag:] * values[:-lag], axis=0) for lag in range(1, _LAGS + 1)]
    rho = np.sum(lagged, axis=1) / np.sum(square)
    # Up to the first lag without correlation: beyond it the sum is noise.
    ends = np.flatnonzero(rho < 2.0 / np.sqrt(n * values.shape[1]))
    return max(1.0 + 2.0 * float(rho[: ends[0] if ends.size else _LAGS].sum()), 1.0)
