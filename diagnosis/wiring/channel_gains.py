"""Gain of one channel, fitted together with the parameters of the baseline.

It finds a gain too small to leave a gap, which yet moves the baseline's parameters: with the gain
error g of channel k the residual is ``r = J d + g y_k``, ``y_k`` the prediction in that channel and
zero in all others.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.wiring.linear_records import (
    LinearRecord,
    beside_own,
    correlation,
    last_factor,
)

FloatArray = NDArray[np.float64]

#: Gain error over its standard deviation that is told.
_SURE = 8.0


@dataclass(frozen=True)
class ChannelGain:
    """Gain error of a channel, by its number, and its standard deviation."""

    channel: int
    gain: float
    std: float


def _products(record: LinearRecord) -> FloatArray:
    """Products of the p shared columns, the prediction of each channel and the residual.

    Shape (p + n_channels + 1, p + n_channels + 1); parameters of the run alone are fitted out.
    """
    known = np.isfinite(record.residual) & np.isfinite(record.predicted)
    n_columns, n_channels = len(record.columns), known.shape[1]
    gram = np.zeros((n_columns + n_channels + 1,) * 2)
    of_baseline = np.array([*range(n_columns), n_columns + n_channels])
    for k in range(n_channels):
        samples = known[:, k]
        predicted = record.predicted[samples, k]
        rows = np.array([*record.columns[:, samples, k], record.residual[samples, k]])
        place = n_columns + k
        gram[np.ix_(of_baseline, of_baseline)] += rows @ rows.T
        gram[place, of_baseline] = gram[of_baseline, place] = rows @ predicted
        gram[place, place] = predicted @ predicted
    return beside_own(gram, record.n_own)


def channel_gains(records: Iterable[LinearRecord]) -> tuple[ChannelGain, ...]:
    """Gain error of every channel, each fitted alone beside the baseline; none of one channel.

    A gain that is off is itself part of the residual that the deviations follow from: these are a
    little too large then.

    Parameters
    ----------
    records : iterable of LinearRecord
        All runs, met once.
    """
    total: FloatArray | None = None
    factors, counts = [], []
    for record in records:
        own = _products(record)
        total = own if total is None else total + own
        factors.append(correlation(record.residual))
        counts.append(int(np.isfinite(record.residual).sum()))
        n_channels = record.residual.shape[1]
    if total is None or n_channels < 2:
        return ()
    variance = float(np.average(factors, weights=counts) * total[-1, -1] / sum(counts))
    n_shared = len(total) - n_channels - 1
    gains = []
    for k in range(n_channels):
        beside = [*range(n_shared), n_shared + k, len(total) - 1]
        gains.append(ChannelGain(k, *last_factor(total[np.ix_(beside, beside)], variance)))
    return tuple(gains)


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
