"""Errors of the measurement fitted together with a baseline that is linear in its parameters.

They are delays, drifting clocks and gains too small to leave a gap, which yet move the parameters
of the baseline. The residual is fitted by the baseline's columns and one more, ``r = J d + g c``:
what the baseline cannot absorb of ``c`` determines ``g``. Columns of parameters of one run alone
are fitted out of its products first, so that no product grows with the number of runs. The variance
of ``g`` is that of least squares times the correlation of the residual from sample to sample,
``1 + 2 (rho_1 + rho_2 + ...)``.

- A delay tau of all signals has ``c = -dy/dt``; a clock that drifts
  ``c = -dy/dt (t - t_middle) / T`` in one run.
- A gain error of channel k has ``c = y_k``, the prediction in that channel and zero in all others.
  Channels count by their residual's RMS: a noisy one determines less.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.identification.campaign.records import Run
from carrierflex.identification.estimation.scaled_least_squares import (
    column_lengths,
    normal_inverse,
    normal_solution,
)

FloatArray = NDArray[np.float64]
#: Share of a column that the others must leave for its factor to be told from theirs.
_LEAST_REMAINING = 1e-6
#: Lags of the residual's correlation.
_LAGS = 20
#: Drift over its standard deviation that is told, one run of many.
_DRIFT = 5.0
#: The same of a delay: sensors that stand half a degree from where they are declared leave four.
_DELAY = 8.0
#: Gain error over its standard deviation from which it is told.
_SURE = 8.0
#: Standard deviations within which another channel is as likely to be the one.
_AS_SURE = 1.0


@dataclass(frozen=True, eq=False)
class LoadAnswer:
    """What one load does in one run."""

    load: str  # Its name
    values: FloatArray  # Shape (n,)
    #: Change of the prediction where the load is larger, over the share by which it is, shape (n,
    #: n_channels)
    response: FloatArray


@dataclass(frozen=True, eq=False)
class LinearRecord:
    """One run beside a baseline that is linear in its parameters."""

    run: str  # Its name
    time: FloatArray  # Time [s], shape (n,)
    residual: FloatArray  # Measured less predicted, NaN where missing, shape (n, n_channels)
    predicted: FloatArray  # What the baseline predicts
    #: Derivatives of the prediction by the baseline's parameters: q of this run alone, p of all,
    #: shape (q + p, n, n_channels)
    columns: FloatArray
    n_of_run: int = 0  # q
    #: ``() -> answers`` to each load of several; none where they are not known
    answers: Callable[[], Sequence[LoadAnswer]] = tuple

    @property
    def slope(self) -> FloatArray:
        """Derivative of the prediction by time, shape (n, n_channels)."""
        return np.asarray(np.gradient(self.predicted, self.time, axis=0), dtype=np.float64)


@dataclass(frozen=True)
class Lateness:
    """Delay of the signals [s] and its standard deviation."""

    run: str  # Run over which the delay grows by `seconds`; empty for a delay that all runs share
    seconds: float  # Its size
    std: float  # Standard deviation
    #: Share of the residual's square over all records that it explains in addition to the baseline
    explained: float


@dataclass(frozen=True)
class ChannelGain:
    """Gain error of a channel."""

    channel: int  # Number of the channel
    gain: float  # Gain less one
    std: float  # Standard deviation

    @property
    def sureness(self) -> float:
        """Gain error over its standard deviation."""
        return abs(self.gain) / max(self.std, float(np.finfo(float).tiny))


def load_answers(record: LinearRecord, run: Run) -> Sequence[LoadAnswer]:
    """Answers to every load of a run; what is predicted is the answer to the only one."""
    if len(run.inputs) != 1:
        return record.answers()
    [(name, values)] = run.inputs.items()
    return (LoadAnswer(name, np.interp(record.time, run.time, values), record.predicted),)


def late_signals(records: Iterable[LinearRecord]) -> tuple[Lateness, ...]:
    """Clocks that drift, or, where none does, the delay of all signals; empty where neither."""
    drifts, delays = _lateness(records)
    return tuple(drifts or delays)


def drifting_runs(records: Iterable[LinearRecord]) -> tuple[Lateness, ...]:
    """Clocks that drift, fitted together with the baseline."""
    return tuple(_lateness(records)[0])


def off_gains(
    records: Iterable[LinearRecord], smallest: Sequence[float]
) -> tuple[ChannelGain, ...]:
    """Channel whose gain is off beyond doubt, the surest first, with those as likely to be the one.

    One gain that is off shows in the other channels too, since the baseline gives way to it: the
    surest is reported. Two channels whose size the baseline fits cannot be distinguished.
    `smallest` is the gain error of each channel below which none is reported: its calibration's.
    """
    gains = sorted(_channel_gains(records), key=lambda gain: -gain.sureness)
    if not gains or gains[0].sureness <= _SURE:
        return ()
    beyond = [gain for gain in gains if abs(gain.gain) > smallest[gain.channel]]
    # What shows in other channels beside one within its calibration is that one's.
    if gains[0] not in beyond:
        return ()
    return tuple(gain for gain in beyond if gain.sureness >= gains[0].sureness - _AS_SURE)


def shared_products(gram: FloatArray, n_of_run: int) -> FloatArray:
    """Products of what is left of columns once the parameters of the run alone are fitted out.

    The `n_of_run` columns of the run come first.
    """
    of_run, crossed = gram[:n_of_run, :n_of_run], gram[:n_of_run, n_of_run:]
    return np.asarray(
        gram[n_of_run:, n_of_run:] - crossed.T @ normal_inverse(of_run) @ crossed, dtype=np.float64
    )


def _unit_columns(sums: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Products of columns of unit length, shape (n, n), and the lengths, shape (n,)."""
    # Columns of very different units: the pseudo-inverse judges them by their own size.
    scale = column_lengths(sums)
    return sums / np.outer(scale, scale), scale


def _inverse_of_unit_columns(scaled: FloatArray) -> FloatArray:
    """Inverse of products of unit columns, shape (n, n), without the directions of rounding."""
    return np.asarray(np.linalg.pinv(scaled, rcond=1e-12, hermitian=True), dtype=np.float64)


def _last_factor(sums: FloatArray, variance: float) -> tuple[float, float]:
    """Factor of the last column before the residual in a least-squares fit, and its deviation."""
    scaled, scale = _unit_columns(sums)
    others = slice(0, -2)
    absorbed = _inverse_of_unit_columns(scaled[others, others]) @ scaled[others, -2]
    remaining = 1.0 - float(scaled[-2, others] @ absorbed)
    if remaining < _LEAST_REMAINING:
        return 0.0, np.inf
    along = float(scaled[-2, -1] - absorbed @ scaled[others, -1])
    factor = along / remaining * float(scale[-1] / scale[-2])
    return factor, float(np.sqrt(variance / remaining) / scale[-2])


def _residual_variance(square: float, residuals: Sequence[tuple[float, int]]) -> float:
    """Variance of the residual of all runs, the correlation of its samples included."""
    factors, counts = zip(*residuals, strict=True)
    return float(np.average(factors, weights=counts) * square / sum(counts))


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


def _lateness(records: Iterable[LinearRecord]) -> tuple[list[Lateness], list[Lateness]]:
    """Drifts of runs that are beyond doubt, and the delay of all runs where it is."""
    # Products of the baseline's columns, delay, drift and residual, by run.
    products, residuals = {}, []
    for record in records:
        slope = record.slope
        known = np.isfinite(record.residual) & np.isfinite(slope)
        middle = 0.5 * (record.time[0] + record.time[-1])
        along = (record.time - middle) / (record.time[-1] - record.time[0])
        late = -slope[known]
        drifting = (-slope * along[:, None])[known]
        rows = np.array([*record.columns[:, known], late, drifting, record.residual[known]])
        products[record.run] = shared_products(rows @ rows.T, record.n_of_run)
        residuals.append((_correlation(record.residual), int(known.sum())))
    if not products:
        return [], []
    total = np.sum(list(products.values()), axis=0)
    variance, n = _residual_variance(float(total[-1, -1]), residuals), len(total) - 3

    def sure(run: str, sums: FloatArray, least: float) -> list[Lateness]:
        """Lateness by so many standard deviations; its own slope is no scatter about it."""
        explained = _explained(sums, n) / float(total[-1, -1])
        seconds, std = _last_factor(sums, variance * max(1.0 - explained, 0.0))
        return [Lateness(run, seconds, std, explained)] if abs(seconds) > least * std else []

    drifts = []
    for name, sums in products.items():
        # The baseline is common to all runs, delay and drift are this run's.
        sums[:n, :n] = total[:n, :n]
        sums[:n, -1] = sums[-1, :n] = total[:n, -1]
        drifts += sure(name, sums, _DRIFT)
    return drifts, sure("", np.delete(np.delete(total, -2, 0), -2, 1), _DELAY)


def _explained(sums: FloatArray, n_baseline: int) -> float:
    """Square of the residual that the columns after the baseline's explain beside these."""
    scaled, scale = _unit_columns(sums)
    squares = [
        float(scaled[-1, :n] @ _inverse_of_unit_columns(scaled[:n, :n]) @ scaled[-1, :n])
        for n in (n_baseline, len(sums) - 1)
    ]
    return float((squares[1] - squares[0]) * scale[-1] ** 2)


def _channel_gains(records: Iterable[LinearRecord]) -> tuple[ChannelGain, ...]:
    """Gain error of every channel, each fitted alone beside the baseline."""
    total: FloatArray | None = None
    residuals = []
    for record in records:
        scale = _residual_rms(record)
        products = _products(record, scale)
        total = products if total is None else total + products
        known = int(np.isfinite(record.residual).sum())
        residuals.append((_correlation(record.residual / scale), known))
        n_channels = record.residual.shape[1]
    if total is None or n_channels < 2:
        return ()
    variance = _residual_variance(float(total[-1, -1]), residuals)
    n_shared = len(total) - n_channels - 1
    gains = []
    for k in range(n_channels):
        rows = [*range(n_shared), n_shared + k, len(total) - 1]
        gains.append(ChannelGain(k, *_last_factor(total[np.ix_(rows, rows)], variance)))
    return tuple(gains)


def _products(record: LinearRecord, scale: FloatArray) -> FloatArray:
    """Products of the p shared columns, the prediction of each channel and the residual."""
    known = np.isfinite(record.residual) & np.isfinite(record.predicted)
    n_columns, n_channels = len(record.columns), known.shape[1]
    gram = np.zeros((n_columns + n_channels + 1,) * 2)
    of_baseline = np.array([*range(n_columns), n_columns + n_channels])
    for k in range(n_channels):
        samples = known[:, k]
        predicted = record.predicted[samples, k] / scale[k]
        rows = np.array([*record.columns[:, samples, k], record.residual[samples, k]]) / scale[k]
        row = n_columns + k
        gram[np.ix_(of_baseline, of_baseline)] += rows @ rows.T
        gram[row, of_baseline] = gram[of_baseline, row] = rows @ predicted
        gram[row, row] = predicted @ predicted
    return shared_products(gram, record.n_of_run)


def _residual_rms(record: LinearRecord) -> FloatArray:
    """RMS of the residual by channel, shape (n_channels,); one where nothing is left."""
    residual = np.where(np.isfinite(record.residual), record.residual, 0.0)
    count = np.maximum(np.isfinite(record.residual).sum(axis=0), 1)
    rms = np.sqrt(np.sum(residual**2, axis=0) / count)
    return np.where(rms > 0.0, rms, 1.0)


@dataclass(frozen=True, eq=False)
class BaselineSums:
    """Products of the baseline's columns and the residual, by run and channel."""

    grams: FloatArray  # Shape (n_runs, n_channels, q + p + 1, q + p + 1)
    counts: FloatArray  # Samples, shape (n_runs, n_channels)
    n_of_run: int  # q

    def without(self, run: int | None = None, channel: int | None = None) -> "BaselineSums":
        """Sums without one run or one channel."""
        grams, counts = self.grams.copy(), self.counts.copy()
        for sums in (grams, counts):
            if run is not None:
                sums[run] = 0.0
            if channel is not None:
                sums[:, channel] = 0.0
        return replace(self, grams=grams, counts=counts)

    def without_columns(self, numbers: Sequence[int]) -> "BaselineSums":
        """Sums without some of the columns."""
        grams = np.delete(np.delete(self.grams, list(numbers), axis=2), list(numbers), axis=3)
        n_of_run = self.n_of_run - sum(number < self.n_of_run for number in numbers)
        return replace(self, grams=grams, n_of_run=n_of_run)

    @property
    def mean_square(self) -> float:
        """Mean square that the baseline leaves once it is fitted to these; infinite without any."""
        if not len(self.grams):
            return np.inf
        total = self._shared
        right = total[:-1, -1]
        explained = float(right @ normal_inverse(total[:-1, :-1]) @ right)
        return max(float(total[-1, -1]) - explained, 0.0) / max(float(self.counts.sum()), 1.0)

    @property
    def of_each_run(self) -> float:
        """Mean square that the baseline leaves once it is fitted to every run by itself."""
        squares = [
            replace(self, grams=gram[None], counts=counts[None]).mean_square * counts.sum()
            for gram, counts in zip(self.grams, self.counts, strict=True)
        ]
        return float(np.sum(squares)) / max(float(self.counts.sum()), 1.0)

    @property
    def steps(self) -> FloatArray:
        """Steps of the parameters of every run, then of all, shape (n_runs, q + p)."""
        q = self.n_of_run
        total = self._shared
        shared = normal_solution(total[:-1, :-1], total[:-1, -1])
        steps = []
        for gram in self.grams.sum(axis=1):
            right = gram[:q, -1] - gram[:q, q:-1] @ shared
            steps.append(np.concatenate([normal_solution(gram[:q, :q], right), shared]))
        return np.array(steps)

    @property
    def _shared(self) -> FloatArray:
        """Products once every run's own parameters are fitted out."""
        of_runs = [shared_products(gram, self.n_of_run) for gram in self.grams.sum(axis=1)]
        return np.asarray(np.sum(of_runs, axis=0))


def baseline_sums(records: Iterable[LinearRecord]) -> BaselineSums:
    """Products of all runs."""
    grams, counts, n_of_run, n_channels = [], [], 0, 0
    for record in records:
        known = np.isfinite(record.residual) & np.isfinite(record.predicted)
        of_run = []
        for k in range(record.residual.shape[1]):
            design = np.concatenate([record.columns[:, :, k], record.residual[None, :, k]])
            design[:, ~known[:, k]] = 0.0
            of_run.append(design @ design.T)
        grams.append(of_run)
        counts.append(known.sum(axis=0))
        n_of_run, n_channels = record.n_of_run, known.shape[1]
    by_run = np.array(counts, dtype=np.float64).reshape(len(counts), n_channels)
    return BaselineSums(np.array(grams), by_run, n_of_run)
