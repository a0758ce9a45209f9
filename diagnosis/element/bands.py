"""Residuals of an element by block and band of frequency."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from carrierflex.diagnosis.element.records import N_BANDS, ElementRecord
from carrierflex.identification.campaign.signals import FloatArray


@dataclass(frozen=True, eq=False)
class BandTable:
    """Bands of the score.

    Parameters
    ----------
    edges_hz : ndarray, shape (n_bands + 1,)
        Ends of the bands [Hz].
    counts, noise_square : ndarray, shape (n_segments, n_bands)
        Degrees of freedom, and the sum of squares of the noise.
    """

    edges_hz: FloatArray
    counts: FloatArray
    noise_square: FloatArray


def band_table(records: Sequence[ElementRecord], noise: FloatArray) -> BandTable:
    """Bands common to all records, evenly wide on a logarithmic axis.

    Parameters
    ----------
    records : sequence of ElementRecord
        Runs.
    noise : ndarray, shape (n_runs,)
        Variance of the noise by run.

    Returns
    -------
    BandTable
        Bands with their counts.
    """
    longest = max((record.block == 0).sum() * record.step for record in records)
    highest = max(0.5 / record.step for record in records)
    edges = np.concatenate([[0.0], np.geomspace(1.5 / longest, highest * 1.001, N_BANDS)])
    counts = []
    for record in records:
        for block in range(record.n_blocks):
            own = record.block == block
            span = _span(own)
            frequency, weight = _lines(span.stop - span.start, record.step)
            present = own.sum() / (span.stop - span.start)
            counts.append(np.histogram(frequency, edges, weights=weight * present)[0])
    table = np.array(counts)
    variance = np.repeat(noise, [record.n_blocks for record in records])
    return BandTable(edges, table, table * variance[:, None])


def block_squares(record: ElementRecord, residual: FloatArray, edges_hz: FloatArray) -> FloatArray:
    """Sum of squares of a residual by block and band, shape (n_blocks, n_bands).

    Infinite where it is.
    """
    rows = []
    for block in range(record.n_blocks):
        span = _span(record.block == block)
        values = np.where(record.block[span] == block, residual[span], 0.0)
        if not np.isfinite(values).all():
            rows.append(np.full(edges_hz.size - 1, np.inf))
            continue
        frequency, weight = _lines(values.size, record.step)
        power = weight * np.abs(np.fft.rfft(values)) ** 2 / values.size
        rows.append(np.histogram(frequency, edges_hz, weights=power)[0])
    return np.array(rows)


def _span(own: np.ndarray) -> slice:
    """First to last sample of a block."""
    places = np.flatnonzero(own)
    return slice(int(places[0]), int(places[-1]) + 1)


def _lines(n: int, step: float) -> tuple[FloatArray, FloatArray]:
    """Frequencies of the transform of n samples [Hz] and how many real amplitudes each line holds."""
    frequency = np.asarray(np.fft.rfftfreq(n, step), dtype=np.float64)
    weight = np.full(frequency.size, 2.0)
    weight[0] = 1.0
    if n % 2 == 0:
        weight[-1] = 1.0
    return frequency, weight
