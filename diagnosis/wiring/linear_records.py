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

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.identification.campaign.records import Run
from carrierflex.identification.estimation.scaled_least_squares import (
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
#: The same of a delay and of a gain: sensors that stand half a degree from where they are declared
#: leave four.
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


def along(time: FloatArray, run: FloatArray) -> FloatArray:
    """Times over the length of a run, of some times, from -0.5 to 0.5."""
    return np.asarray((time - run[0]) / (run[-1] - run[0]) - 0.5)


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


def _last_factor(sums: FloatArray, variance: float) -> tuple[float, float]:
    """Factor of the last column before the residual in a least-squares fit, and its deviation."""
    remaining = shared_products(sums, len(sums) - 2)
    if remaining[0, 0] <= _LEAST_REMAINING * sums[-2, -2]:
        return 0.0, np.inf
    return float(remaining[0, 1] / remaining[0, 0]), float(np.sqrt(variance / remaining[0, 0]))


def _residual_variance(total: FloatArray, sums: "BaselineSums", factors: Sequence[float]) -> float:
    """Variance of the residual of all runs, the correlation of its samples included."""
    counts = sums.counts.sum(axis=1)
    return float(np.average(factors, weights=counts) * total[-1, -1] / counts.sum())


def correlation(residual: FloatArray) -> float:
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
    factors: dict[str, float] = {}

    def with_lateness() -> Iterator[LinearRecord]:
        """Runs with a delay and a drift behind the columns of the baseline."""
        for record in records:
            factors[record.run] = correlation(record.residual)
            late = -record.slope
            drifting = late * along(record.time, record.time)[:, None]
            yield replace(record, columns=np.array([*record.columns, late, drifting]))

    sums = baseline_sums(with_lateness())
    if not factors:
        return [], []
    total = np.asarray(sums.of_runs.sum(axis=0))
    variance, n = _residual_variance(total, sums, list(factors.values())), len(total) - 3

    def sure(run: str, products: FloatArray, least: float) -> list[Lateness]:
        """Lateness by so many standard deviations; its own slope is no scatter about it."""
        left = [float(shared_products(products, k)[-1, -1]) for k in (n, len(products) - 1)]
        explained = (left[0] - left[1]) / float(total[-1, -1])
        seconds, std = _last_factor(products, variance * max(1.0 - explained, 0.0))
        return [Lateness(run, seconds, std, explained)] if abs(seconds) > least * std else []

    drifts = []
    for name, products in zip(factors, sums.of_runs, strict=True):
        # The baseline is common to all runs, delay and drift are this run's.
        products[:n, :n] = total[:n, :n]
        products[:n, -1] = products[-1, :n] = total[:n, -1]
        drifts += sure(name, products, _DRIFT)
    return drifts, sure("", np.delete(np.delete(total, -2, 0), -2, 1), _SURE)


def _channel_gains(records: Iterable[LinearRecord]) -> tuple[ChannelGain, ...]:
    """Gain error of every channel, each fitted alone beside the baseline."""
    factors, scales = [], []

    def with_predicted() -> Iterator[LinearRecord]:
        """Runs with the prediction behind the columns of the baseline."""
        for record in records:
            scales.append(_residual_rms(record))
            factors.append(correlation(record.residual / scales[-1]))
            yield replace(record, columns=np.array([*record.columns, record.predicted]))

    sums = baseline_sums(with_predicted())
    if not scales or len(scales[0]) < 2:
        return ()
    gains = []
    for k in range(len(scales[0])):
        grams = sums.grams / np.square(scales)[:, :, None, None]
        others = np.arange(len(scales[0])) != k
        grams[:, others, -2] = grams[:, others, :, -2] = 0.0
        total = np.asarray(replace(sums, grams=grams).of_runs.sum(axis=0))
        variance = _residual_variance(total, sums, factors)
        gains.append(ChannelGain(k, *_last_factor(total, variance)))
    return tuple(gains)


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
        total = self.of_runs.sum(axis=0)
        ((remaining,),) = shared_products(total, len(total) - 1)
        return max(float(remaining), 0.0) / max(float(self.counts.sum()), 1.0)

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
        total = self.of_runs.sum(axis=0)
        shared = normal_solution(total[:-1, :-1], total[:-1, -1])
        steps = []
        for gram in self.grams.sum(axis=1):
            right = gram[:q, -1] - gram[:q, q:-1] @ shared
            steps.append(np.concatenate([normal_solution(gram[:q, :q], right), shared]))
        return np.array(steps)

    @property
    def of_runs(self) -> FloatArray:
        """Products once every run's own parameters are fitted out, (n_runs, p + 1, p + 1)."""
        return np.array([shared_products(gram, self.n_of_run) for gram in self.grams.sum(axis=1)])


def baseline_sums(records: Iterable[LinearRecord]) -> BaselineSums:
    """Products of all runs."""
    grams, counts, n_of_run, n_channels = [], [], 0, 0
    for record in records:
        known = np.isfinite(record.residual) & np.isfinite(record.columns).all(axis=0)
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
