"""Sums of squares and degrees of freedom of signals by block of a run and band of frequency.

By Parseval's theorem the powers of a block's bands add up to its sum of squares, and their real
amplitudes to its samples: white noise of variance s² leaves ``s² times amplitudes`` in a band.
"""

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.comparison.problem import BoolArray, FloatArray


def band_edges_hz(duration: float, highest_hz: float, n_bands: int) -> FloatArray:
    """Ends of bands of frequency [Hz], evenly wide on a logarithmic axis, shape (n_bands + 1,).

    Parameters
    ----------
    duration : float
        Longest block [s]: the first band holds its mean and its first line.
    highest_hz : float
        End of the last band [Hz], above half the sampling frequency.
    n_bands : int
        Bands.
    """
    return np.concatenate([[0.0], np.geomspace(1.5 / duration, highest_hz, n_bands)])


def band_amplitudes(n: int, step: float, edges_hz: FloatArray) -> FloatArray:
    """Real amplitudes of the transform of n samples in every band, shape (n_bands, n // 2 + 1).

    Row b holds, for each line, how many of its amplitudes lie in band b: two, or one at the mean
    and at half the sampling frequency.

    Parameters
    ----------
    n : int
        Samples.
    step : float
        Their distance [s].
    edges_hz : ndarray, shape (n_bands + 1,)
        Ends of the bands [Hz].
    """
    frequency = np.fft.rfftfreq(n, step)
    amplitudes = np.full(frequency.size, 2.0)
    amplitudes[0] = 1.0
    if n % 2 == 0:
        amplitudes[-1] = 1.0
    band = np.searchsorted(edges_hz, frequency, side="right") - 1
    band = np.clip(band, 0, edges_hz.size - 2)
    is_in_band = band == np.arange(edges_hz.size - 1)[:, None]
    return is_in_band * amplitudes


def block_powers(
    signals: FloatArray, block: NDArray[np.int64], step: float, edges_hz: FloatArray
) -> FloatArray:
    """Sum of squares by block, column and band, shape (n_blocks, n_columns, n_bands).

    Parameters
    ----------
    signals : ndarray, shape (n, n_columns)
        Signals; samples outside all blocks do not count.
    block : ndarray of int, shape (n,)
        Block of every sample, from 0; -1 outside.
    step : float
        Distance of the samples [s].
    edges_hz : ndarray, shape (n_bands + 1,)
        Ends of the bands [Hz].

    Returns
    -------
    ndarray
        In the square of the signals' unit; infinite for blocks in which a signal is.
    """
    powers = []
    for number in range(int(block.max()) + 1):
        span = _span(block == number)
        is_inside = block[span] == number
        values = np.where(is_inside[:, None], signals[span], 0.0)
        if not np.isfinite(values).all():
            powers.append(np.full((values.shape[1], edges_hz.size - 1), np.inf))
            continue
        amplitudes = band_amplitudes(len(values), step, edges_hz)
        square = np.abs(np.fft.rfft(values, axis=0)) ** 2 / len(values)
        powers.append((amplitudes @ square).T)
    return np.array(powers)


def block_counts(
    is_measured: BoolArray, block: NDArray[np.int64], step: float, edges_hz: FloatArray
) -> FloatArray:
    """Degrees of freedom by block, column and band, shape (n_blocks, n_columns, n_bands).

    The amplitudes of a band times the share of the block's samples that were measured.

    Parameters
    ----------
    is_measured : ndarray of bool, shape (n, n_columns)
        Samples that count.
    block, step, edges_hz
        As in :func:`block_powers`.
    """
    counts = []
    for number in range(int(block.max()) + 1):
        span = _span(block == number)
        is_counted = is_measured[span] & (block[span] == number)[:, None]
        amplitudes = band_amplitudes(len(is_counted), step, edges_hz).sum(axis=1)
        counts.append(np.multiply.outer(is_counted.mean(axis=0), amplitudes))
    return np.array(counts)


def _span(is_inside: BoolArray) -> slice:
    """First to last sample of a block."""
    samples = np.flatnonzero(is_inside)
    return slice(int(samples[0]), int(samples[-1]) + 1)
