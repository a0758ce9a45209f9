"""Noise of the rim sensors.

Declared, or from what does not repeat from revolution to revolution.
"""

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.carrier.records.sums import CarrierSums
from carrierflex.identification.campaign.campaign import Campaign

FloatArray = NDArray[np.float64]


def refuse_silent_channels(campaign: Campaign) -> None:
    """Refuse channels that say nothing.

    Raises
    ------
    ValueError
        Where a channel is missing or constant in every run.
    """
    for channel in campaign.channels:
        values = [run.signals[channel.name] for run in campaign.runs]
        measured = [signal[np.isfinite(signal)] for signal in values]
        if not any(signal.size for signal in measured):
            raise ValueError(
                f"channel {channel.name}: every sample of every run is missing; expected a "
                "signal, or leave the channel out"
            )
        if all(np.ptp(signal) == 0.0 for signal in measured if signal.size):
            raise ValueError(
                f"channel {channel.name}: the signal is constant in every run; expected one that "
                "moves (a sensor "
                "without power reads a constant)"
            )


def channel_noise(campaign: Campaign, records: CarrierSums) -> FloatArray:
    """Variance of the noise of every channel [m²], shape (n_channels,).

    Declared noise first. Otherwise what is left of a revolution about its own orders, and half the
    squared change of every order from one revolution to the next: drift and slow changes of the
    load hardly enter.

    Parameters
    ----------
    campaign : Campaign
        Channels with their declared noise.
    records : CarrierSums
        Orders and scatter by revolution.

    Returns
    -------
    ndarray
        Variances.

    Raises
    ------
    ValueError
        Where no noise is declared and every revolution is too sparse.
    """
    measured = _scatter(records)
    variances = []
    for c, channel in enumerate(campaign.channels):
        value = channel.noise_std**2 if channel.noise_std is not None else float(measured[c])
        if not np.isfinite(value):
            raise ValueError(
                f"channel {channel.name}: no revolution has samples enough to tell noise from "
                "signal; give 'noise_std'"
            )
        variances.append(value)
    return np.array(variances)


def _scatter(records: CarrierSums) -> FloatArray:
    target = records.orders
    same_run = np.diff(records.run_of_revolution) == 0
    weight = np.where(np.arange(target.shape[2]) == 0, 1.0, 0.5)
    change = 0.5 * (np.abs(np.diff(target, axis=0)[same_run]) ** 2 * weight).sum(axis=2)
    fitted = 2.0 * target.shape[2] - 1.0
    result = np.full(target.shape[1], np.nan)
    for c in range(target.shape[1]):
        square, degrees = records.within[:, c].sum(axis=0)
        if degrees <= 0.0:
            continue
        result[c] = square / degrees
        complete = np.isfinite(change[:, c])
        if complete.any():
            n = degrees / np.count_nonzero(records.within[:, c, 1] > 0.0) + fitted
            result[c] = (square / degrees) * (n - fitted) / n + change[complete, c].mean()
    return result
