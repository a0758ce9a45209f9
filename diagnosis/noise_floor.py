"""The RMS that no model of the rim signals can go below."""

from collections.abc import Sequence

import numpy as np

from diagnosis.order_map import MAX_ORDER, order_coefficients
from identification.campaign import Channel
from identification.records import Run
from identification.revolutions import whole_revolutions


def noise_floor(run: Run, channels: Sequence[Channel]) -> float:
    """RMS of the noise of one run over its channels [m].

    Parameters
    ----------
    run : Run
        Record.
    channels : sequence of Channel
        Axial channels; where every one declares its noise, that is used.

    Returns
    -------
    float
        Root of the mean of the channels' noise variances; without declared noise, the RMS about the mean revolution,
        which holds what does not repeat from revolution to revolution up to order 12.

    Raises
    ------
    ValueError
        Where no noise is declared and no revolution is dense enough to average.
    """
    declared = [channel.noise_std for channel in channels if channel.noise_std is not None]
    if len(declared) == len(channels):
        return float(np.sqrt(np.mean(np.square(declared))))
    return float(np.sqrt(np.mean([_variance_about_mean_revolution(run, channel) for channel in channels])))


def _variance_about_mean_revolution(run: Run, channel: Channel) -> float:
    """Variance of a signal about its mean revolution [m²], corrected for the fitted amplitudes."""
    revolutions = whole_revolutions(run)
    angle, signal = run.inputs["carrier_angle"], run.signals[channel.name]
    amplitudes = order_coefficients(angle, signal, revolutions.samples)
    amplitudes = amplitudes[np.isfinite(amplitudes).all(axis=1)]
    if len(amplitudes) == 0:
        raise ValueError(
            f"run {run.name}, channel {channel.name}: no revolution is dense enough for order {MAX_ORDER}; "
            "give 'noise_std' of the channel"
        )
    kept = revolutions.kept[np.isfinite(signal[revolutions.kept])]
    phase = np.exp(1j * np.outer(angle[kept], np.arange(MAX_ORDER + 1)))
    scatter = signal[kept] - (phase @ amplitudes.mean(axis=0)).real
    n_fitted = 2 * MAX_ORDER + 1
    return float(scatter @ scatter) / max(kept.size - n_fitted, 1)
