"""Gain of one channel, fitted together with the parameters of the baseline.

It finds a gain too small to leave a gap, which yet moves the baseline's parameters: with the gain
error g of channel k the residual is ``r = J d + g y_k``, ``y_k`` the prediction in that channel and
zero in all others.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.wiring.linear_records import LinearRecord, correlation, last_factor

FloatArray = NDArray[np.float64]

#: Gain error over its standard deviation that is told.
_SURE = 8.0


@dataclass(frozen=True)
class ChannelGain:
    """Gain error of a channel, by its number, and its standard deviation."""

    channel: int
    gain: float
    std: float


@dataclass(eq=False)
class _GainSums:
    """Products of the baseline's columns, the prediction of each channel and the residual.

    Parameters
    ----------
    baseline : ndarray, shape (p + 1, p + 1)
        Columns and residual of all channels.
    crossed : ndarray, shape (n_channels, p + 1)
        Prediction of a channel with these.
    square : ndarray, shape (n_channels,)
        Its own square.
    """

    baseline: FloatArray
    crossed: FloatArray
    square: FloatArray

    def add(self, record: LinearRecord) -> None:
        for k in range(len(self.square)):
            known = np.isfinite(record.residual[:, k]) & np.isfinite(record.predicted[:, k])
            rows = np.array([*record.columns[:, known, k], record.residual[known, k]])
            predicted = record.predicted[known, k]
            self.baseline += rows @ rows.T
            self.crossed[k] += rows @ predicted
            self.square[k] += predicted @ predicted

    def of_channel(self, k: int) -> FloatArray:
        """Products with the prediction of channel k before the residual, shape (p + 2, p + 2)."""
        before = len(self.baseline) - 1
        sums = np.insert(self.baseline, before, self.crossed[k], axis=0)
        return np.insert(sums, before, np.insert(self.crossed[k], before, self.square[k]), axis=1)


def channel_gains(records: Iterable[LinearRecord]) -> tuple[ChannelGain, ...]:
    """Gain error of every channel, each fitted alone beside the baseline; none of one channel.

    A gain that is off is itself part of the residual that the deviations follow from: these are a
    little too large then.

    Parameters
    ----------
    records : iterable of LinearRecord
        All runs, met once.
    """
    sums: _GainSums | None = None
    factors, counts = [], []
    for record in records:
        p, _, n_channels = record.columns.shape
        if sums is None:
            crossed = np.zeros((n_channels, p + 1))
            sums = _GainSums(np.zeros((p + 1, p + 1)), crossed, np.zeros(n_channels))
        sums.add(record)
        factors.append(correlation(record.residual))
        counts.append(int(np.isfinite(record.residual).sum()))
    if sums is None or len(sums.square) < 2:
        return ()
    variance = float(np.average(factors, weights=counts) * sums.baseline[-1, -1] / sum(counts))
    return tuple(
        ChannelGain(k, *last_factor(sums.of_channel(k), variance)) for k in range(len(sums.square))
    )


def off_gain(records: Iterable[LinearRecord], smallest: Sequence[float]) -> ChannelGain | None:
    """Channel whose gain is off beyond doubt; None where there is none, or one channel alone.

    One gain that is off shows in the other channels too, since the baseline gives way to it: the
    one that is surest is told.

    Parameters
    ----------
    records : iterable of LinearRecord
        All runs, met once.
    smallest : sequence of float
        Gain error of each channel that none is told below: that of its calibration.
    """
    gains = channel_gains(records)
    if not gains:
        return None
    surest = max(gains, key=lambda gain: abs(gain.gain) / max(gain.std, np.finfo(float).tiny))
    is_off = abs(surest.gain) > max(_SURE * surest.std, smallest[surest.channel])
    return surest if is_off else None
