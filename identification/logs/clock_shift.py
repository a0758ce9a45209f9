"""How far the clock of another simulator stands from that of the measurement."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import correlate, correlation_lags

from carrierflex.identification.logs.clocks import even_step, on_clock

FloatArray = NDArray[np.float64]

#: Share of the shorter record that both must have in common.
_COMMON = 0.5
#: A shift is as good as the best where its correlation is this share of it.
_AS_GOOD = 0.99
_REFINEMENTS = 4


@dataclass(frozen=True)
class ClockShift:
    """Seconds to add to a prediction's time, and how well that is known.

    Parameters
    ----------
    seconds, std : float
        Shift and its standard deviation [s].
    correlation : float
        Of prediction and measurement at this shift.
    others : tuple of float
        Other shifts [s] that fit as well: the motion repeats.
    """

    seconds: float
    std: float
    correlation: float
    others: tuple[float, ...] = ()


def clock_shift(
    time: FloatArray,
    measured: Sequence[FloatArray],
    predicted_time: FloatArray,
    predicted: Sequence[FloatArray],
) -> ClockShift:
    """Shift at which predictions and channels go together best.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Time of the measurement [s].
    measured : sequence of ndarray, shape (n,)
        Channels, missing samples NaN.
    predicted_time : ndarray, shape (m,)
        Time of the simulator [s].
    predicted : sequence of ndarray, shape (m,)
        Its prediction of each channel.

    Raises
    ------
    ValueError
        Where nothing moves, or the records are too short.
    """
    step = even_step(time)
    clock = np.arange(predicted_time[0], predicted_time[-1], step)
    even = np.arange(time[0], time[-1] + 0.5 * step, step)
    if min(clock.size, even.size) < 10:
        raise ValueError("prediction and measurement have less than ten samples in common")
    pairs = [
        (
            np.interp(even, time, values, left=np.nan, right=np.nan),
            on_clock(prediction, predicted_time, clock),
        )
        for values, prediction in zip(measured, predicted, strict=True)
    ]
    lags, correlation = _correlation(pairs)
    best = int(np.argmax(correlation))
    if correlation[best] <= 0.0:
        raise ValueError("prediction and measurement do not move together at any shift")
    peaks = np.flatnonzero(
        (correlation[1:-1] > correlation[:-2])
        & (correlation[1:-1] >= correlation[2:])
        & (correlation[1:-1] > _AS_GOOD * correlation[best])
    )
    zero = float(even[0] - clock[0])
    # Of a motion that repeats, the shift nearest to none counts.
    near = 1 + min(peaks.tolist(), key=lambda k: abs(zero + lags[k + 1] * step), default=best - 1)
    others = tuple(zero + float(lags[k + 1]) * step for k in peaks.tolist() if k + 1 != near)
    first = zero + float(lags[near]) * step
    seconds, std = _refined(time, measured, predicted_time, predicted, first)
    return ClockShift(seconds, std, float(correlation[near]), others)


def _correlation(
    pairs: Sequence[tuple[FloatArray, FloatArray]],
) -> tuple[NDArray[np.int64], FloatArray]:
    """Correlation over all channels at every lag that leaves enough in common."""
    lags = correlation_lags(pairs[0][0].size, pairs[0][1].size)
    product = np.zeros(lags.size)
    energies = np.zeros((2, lags.size))
    common = np.zeros(lags.size)
    for one, other in pairs:
        signals = []
        for values in (one, other):
            present = np.isfinite(values)
            level = np.where(present, values, 0.0) - np.where(present, np.nanmean(values), 0.0)
            size = float(np.sqrt(np.mean(level**2))) or 1.0
            signals.append((level / size, present.astype(np.float64)))
        (a, in_a), (b, in_b) = signals
        product += correlate(a, b, method="fft")
        energies[0] += correlate(a**2, in_b, method="fft")
        energies[1] += correlate(in_a, b**2, method="fft")
        common += correlate(in_a, in_b, method="fft")
    shortest = min(pairs[0][0].size, pairs[0][1].size) * len(pairs)
    enough = common > _COMMON * shortest
    scale = np.sqrt(np.maximum(energies[0] * energies[1], 1e-300))
    return lags, np.where(enough & (energies.min(axis=0) > 1e-9), product / scale, -1.0)


def _refined(
    time: FloatArray,
    measured: Sequence[FloatArray],
    predicted_time: FloatArray,
    predicted: Sequence[FloatArray],
    first: float,
) -> tuple[float, float]:
    """Shift between the samples, and its standard deviation, by least squares.

    Each channel has an offset and a gain of its own: ``m ~ a + b p(t - s)`` about s.
    """
    shift = first
    std = float("nan")
    step = even_step(time)
    for _ in range(_REFINEMENTS):
        slopes, rests = [], []
        for values, prediction in zip(measured, predicted, strict=True):
            at = on_clock(prediction, predicted_time + shift, time)
            slope = np.gradient(at, time)
            known = np.isfinite(values) & np.isfinite(at) & np.isfinite(slope)
            columns = np.column_stack([np.ones(int(known.sum())), at[known], slope[known]])
            if len(columns) < 10:
                continue
            offset, gain, _ = np.linalg.lstsq(columns, values[known], rcond=None)[0]
            # What offset and gain explain of the slope tells nothing of the shift.
            base = columns[:, :2]
            free = columns[:, 2] - base @ np.linalg.lstsq(base, columns[:, 2], rcond=None)[0]
            slopes.append(gain * free)
            rests.append(values[known] - offset - gain * columns[:, 1])
        if not slopes:
            break
        g, r = np.concatenate(slopes), np.concatenate(rests)
        energy = float(g @ g)
        if energy == 0.0:
            break
        change = -float(g @ r) / energy
        rest = r + change * g
        memory = float(np.clip(np.corrcoef(rest[:-1], rest[1:])[0, 1], 0.0, 0.999))
        std = float(np.sqrt(rest @ rest / rest.size / energy * (1.0 + memory) / (1.0 - memory)))
        shift += float(np.clip(change, -step, step))
    return shift, std
