"""Gain of one channel, fitted together with the parameters of the baseline.

It finds a gain too small to leave a gap, which yet moves the baseline's parameters: with the gain
error g of channel k the residual is ``r = J d + g y_k``, ``y_k`` the prediction in that channel and
zero in all others. Channels count by their residual's RMS: a noisy one tells less.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.wiring.linear_records import (
    LinearRecord,
    correlation,
    last_factor,
    residual_variance,
    shared_products,
)

FloatArray = NDArray[np.float64]

#: Gain error over its standard deviation from which it is told.
_SURE = 8.0
#: Standard deviations within which another channel is as likely to be the one.
_AS_SURE = 1.0


@dataclass(frozen=True)
class ChannelGain:
    """Gain error of a channel.

    Parameters
    ----------
    channel : int
        Number of the channel.
    gain, std : float
        Its gain less one, and the standard deviation of that.
    """

    channel: int
    gain: float
    std: float

    @property
    def sureness(self) -> float:
        """Gain error over its standard deviation."""
        return abs(self.gain) / max(self.std, float(np.finfo(float).tiny))


def channel_gains(records: Iterable[LinearRecord]) -> tuple[ChannelGain, ...]:
    """Gain error of every channel, each fitted alone beside the baseline.

    A gain that is off is itself part of the residual that the deviations follow from: these are a
    little too large then.

    Parameters
    ----------
    records : iterable of LinearRecord
        All runs, met once.

    Returns
    -------
    tuple of ChannelGain
        In the order of the channels; empty where there is no record, or one channel alone.
    """
    total: FloatArray | None = None
    residuals = []
    for record in records:
        scale = _residual_rms(record)
        products = _products(record, scale)
        total = products if total is None else total + products
        known = int(np.isfinite(record.residual).sum())
        residuals.append((correlation(record.residual / scale), known))
        n_channels = record.residual.shape[1]
    if total is None or n_channels < 2:
        return ()
    variance = residual_variance(float(total[-1, -1]), residuals)
    n_shared = len(total) - n_channels - 1
    gains = []
    for k in range(n_channels):
        beside = [*range(n_shared), n_shared + k, len(total) - 1]
        gains.append(ChannelGain(k, *last_factor(total[np.ix_(beside, beside)], variance)))
    return tuple(gains)


def off_gains(
    records: Iterable[LinearRecord], smallest: Sequence[float]
) -> tuple[ChannelGain, ...]:
    """Channel whose gain is off beyond doubt, with those that are as likely to be the one.

    One gain that is off shows in the other channels too, since the baseline gives way to it: the
    surest is told. Two channels whose size the baseline fits cannot be told from each other.

    Parameters
    ----------
    records : iterable of LinearRecord
        All runs, met once.
    smallest : sequence of float
        Gain error of each channel that none is told below: that of its calibration.

    Returns
    -------
    tuple of ChannelGain
        The surest first; empty where every gain may be right.
    """
    gains = sorted(channel_gains(records), key=lambda gain: -gain.sureness)
    if not gains or gains[0].sureness <= _SURE:
        return ()
    beyond = [gain for gain in gains if abs(gain.gain) > smallest[gain.channel]]
    # What shows in other channels beside one within its calibration is that one's.
    if gains[0] not in beyond:
        return ()
    return tuple(gain for gain in beyond if gain.sureness >= gains[0].sureness - _AS_SURE)


def _products(record: LinearRecord, scale: FloatArray) -> FloatArray:
    """Products of the p shared columns, the prediction of each channel and the residual.

    Each channel over its `scale`. Shape (p + n_channels + 1, p + n_channels + 1); parameters of the
    run alone are fitted out.
    """
    known = np.isfinite(record.residual) & np.isfinite(record.predicted)
    n_columns, n_channels = len(record.columns), known.shape[1]
    gram = np.zeros((n_columns + n_channels + 1,) * 2)
    of_baseline = np.array([*range(n_columns), n_columns + n_channels])
    for k in range(n_channels):
        samples = known[:, k]
        predicted = record.predicted[samples, k] / scale[k]
        rows = np.array([*record.columns[:, samples, k], record.residual[samples, k]]) / scale[k]
        place = n_columns + k
        gram[np.ix_(of_baseline, of_baseline)] += rows @ rows.T
        gram[place, of_baseline] = gram[of_baseline, place] = rows @ predicted
        gram[place, place] = predicted @ predicted
    return shared_products(gram, record.n_of_run)


def _residual_rms(record: LinearRecord) -> FloatArray:
    """RMS of the residual by channel, shape (n_channels,); one where nothing is left."""
    residual = np.where(np.isfinite(record.residual), record.residual, 0.0)
    count = np.maximum(np.isfinite(record.residual).sum(axis=0), 1)
    rms = np.sqrt(np.sum(residual**2, axis=0) / count)
    return np.where(rms > 0.0, rms, 1.0)
