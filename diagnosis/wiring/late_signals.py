"""Delays and drifting clocks too small to leave a gap, which yet move the baseline's parameters.

About a delay tau the signal is ``y(t) - tau dy/dt``. The baseline and a delay are fitted together,
``r = J d + tau s`` with ``s = -dy/dt``; what the baseline cannot absorb of the slope tells the
delay. Its variance is that of least squares times the correlation of the residual from sample to
sample, ``1 + 2 (rho_1 + rho_2 + ...)``. A clock that drifts adds ``s (t - t_middle) / T`` in one
run.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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
    """

    run: str
    seconds: float
    std: float


def late_signals(records: Iterable[LinearRecord]) -> tuple[Lateness, ...]:
    """Clocks that drift, or, where none does, the delay of all signals; empty where neither.

    Parameters
    ----------
    records : iterable of LinearRecord
        All runs, met once.
    """
    names = []
    products = []
    correlations = []
    counts = []
    for record in records:
        known = np.isfinite(record.residual) & np.isfinite(record.slope)
        middle = 0.5 * (record.time[0] + record.time[-1])
        along = (record.time - middle) / (record.time[-1] - record.time[0])
        late = -record.slope[known]
        drifting = (-record.slope * along[:, None])[known]
        rows = np.array([*record.columns[:, known], late, drifting, record.residual[known]])
        names.append(record.run)
        products.append(rows @ rows.T)
        correlations.append(_correlation(record.residual))
        counts.append(int(known.sum()))
    if not products:
        return ()
    total = np.sum(products, axis=0)
    variance = float(np.average(correlations, weights=counts) * total[-1, -1] / sum(counts))
    n_baseline = len(total) - 3
    drifts = []
    for name, own in zip(names, products, strict=True):
        # The baseline is common to all runs, delay and drift are this run's.
        sums = own.copy()
        sums[:n_baseline, :n_baseline] = total[:n_baseline, :n_baseline]
        sums[:n_baseline, -1] = sums[-1, :n_baseline] = total[:n_baseline, -1]
        drifts.append(Lateness(name, *_last_factor(sums, variance)))
    told = tuple(drift for drift in drifts if abs(drift.seconds) > _DRIFT * drift.std)
    if told:
        return told
    common = Lateness("", *_last_factor(np.delete(np.delete(total, -2, 0), -2, 1), variance))
    return (common,) if abs(common.seconds) > _DELAY * common.std else ()


def _last_factor(sums: FloatArray, variance: float) -> tuple[float, float]:
    """Factor of the last column before the residual in a least-squares fit, and its deviation.

    Parameters
    ----------
    sums : ndarray, shape (p + 2, p + 2)
        Products of p columns, the column in question and the residual.
    variance : float
        Variance of the residual, correlation included.
    """
    # Columns of very different units: the pseudo-inverse judges them by their own size.
    scale = np.sqrt(np.maximum(np.diag(sums), np.finfo(float).tiny))
    scaled = sums / np.outer(scale, scale)
    others = slice(0, -2)
    inverse = np.linalg.pinv(scaled[others, others], rcond=1e-12, hermitian=True)
    absorbed = inverse @ scaled[others, -2]
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
