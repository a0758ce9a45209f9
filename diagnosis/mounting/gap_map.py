"""Gap map of a mounting: by motion pattern of the six sensors, band of frequency and run."""

from collections.abc import Sequence

import numpy as np
from scipy.stats import chi2

from carrierflex.diagnosis.comparison.problem import FloatArray, GapCell
from carrierflex.diagnosis.gap.gap_map import (
    N_DRAWS,
    CellTable,
    band_edges_hz,
    block_counts,
    block_powers,
    gap_cells,
)
from carrierflex.diagnosis.mounting.records import MountingRecord
from carrierflex.identification.estimation.resampling import multinomial_counts
from carrierflex.simulation.mounting.rig import SENSORS

_BANDS = 6
_SEED = 1
_ROOT = float(np.sqrt(0.5))

#: Orthonormal patterns of the six sensors (so that mean squares add up), in the order of
#: ``SENSORS``.
PATTERNS: dict[str, tuple[float, ...]] = {
    "roll": (0.0, 0.0, _ROOT, -_ROOT, 0.0, 0.0),
    "vertical": (0.0, 0.0, _ROOT, _ROOT, 0.0, 0.0),
    "yaw": (-_ROOT, _ROOT, 0.0, 0.0, 0.0, 0.0),
    "fore-aft at the side": (_ROOT, _ROOT, 0.0, 0.0, 0.0, 0.0),
    "sideways": (0.0, 0.0, 0.0, 0.0, 1.0, 0.0),
    "fore-aft below": (0.0, 0.0, 0.0, 0.0, 0.0, 1.0),
}


def pattern_matrix(
    sensors: Sequence[str], channels: Sequence[str]
) -> tuple[tuple[str, ...], FloatArray]:
    """Names and matrix of the patterns.

    The channels themselves unless each of the six sensors occurs once.

    Parameters
    ----------
    sensors, channels : sequence of str
        Sensor and name of every channel.

    Returns
    -------
    tuple of (tuple of str, ndarray of shape (n_patterns, n_channels))
        Orthonormal rows.
    """
    if sorted(sensors) != sorted(SENSORS):
        return tuple(channels), np.eye(len(channels))
    columns = [SENSORS.index(sensor) for sensor in sensors]
    return tuple(PATTERNS), np.array(list(PATTERNS.values()))[:, columns]


def map_edges_hz(records: Sequence[MountingRecord]) -> FloatArray:
    """Ends of the bands of the map [Hz], shape (n_bands + 1,)."""
    longest = max(float((record.block == 0).sum()) * record.step for record in records)
    highest_hz = max(0.5 / record.step for record in records)
    return band_edges_hz(longest, 1.001 * highest_hz, _BANDS)


def score_cells(
    records: Sequence[MountingRecord], edges_hz: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Degrees of freedom and sum of squares of the noise by block and cell of the score.

    Channels, each in every band.

    Parameters
    ----------
    records : sequence of MountingRecord
        Runs.
    edges_hz : ndarray
        Ends of the bands [Hz].

    Returns
    -------
    tuple of ndarray, each of shape (n_segments, n_channels * n_bands)
        Counts and squares [m²].
    """
    counts = []
    noise = []
    for record in records:
        is_measured = np.isfinite(record.measured)
        by_block = block_counts(is_measured, record.block, record.step, edges_hz)
        square = by_block * record.noise[:, None]
        n_measured = np.array(
            [is_measured[record.block == block].sum(axis=0) for block in range(record.n_blocks)]
        )
        # The zero's error is constant over a run: it lies in the lowest band.
        square[:, :, 0] += record.zero_noise * n_measured
        counts.append(by_block.reshape(record.n_blocks, -1))
        noise.append(square.reshape(record.n_blocks, -1))
    return np.concatenate(counts), np.concatenate(noise)


def mounting_gap_cells(
    records: Sequence[MountingRecord],
    residuals: Sequence[FloatArray],
    sensors: Sequence[str],
    channels: Sequence[str],
) -> Sequence[GapCell]:
    """Gap map of a residual, largest cell first.

    Power of every cell against that of the noise, ``power / noise ~ chi²``.

    Parameters
    ----------
    records : sequence of MountingRecord
        Runs.
    residuals : sequence of ndarray, shape (n, n_channels)
        Gap of every run, zero where nothing was measured.
    sensors, channels : sequence of str
        Sensor and name of every channel.

    Returns
    -------
    tuple of GapCell
        Mean squares are over all channels' samples of all runs, so that they add up.
    """
    names, matrix = pattern_matrix(sensors, channels)
    edges_hz = map_edges_hz(records)
    n_samples = sum(residual.size for residual in residuals)
    powers = []
    expected = []
    counts = []
    draws = []
    for record, residual in zip(records, residuals, strict=True):
        by_block = block_powers(residual @ matrix.T, record.block, record.step, edges_hz)
        n_lines = line_counts(record, edges_hz)
        noise = np.multiply.outer(matrix**2 @ record.noise, n_lines)
        # The zero's error is constant over a run: it lies in the lowest band.
        noise[:, 0] += matrix**2 @ record.zero_noise * len(residual)
        weights = multinomial_counts(record.n_blocks, N_DRAWS, seed=_SEED)
        powers.append(by_block.sum(axis=0))
        expected.append(noise)
        counts.append(np.broadcast_to(np.maximum(n_lines, 1.0), noise.shape))
        draws.append(np.tensordot(weights, by_block, axes=1) - noise)
    power = np.array(powers)
    noise_power = np.array(expected)
    degrees = np.array(counts)
    ratio = power * degrees / np.maximum(noise_power, np.finfo(float).tiny)
    table = CellTable(
        runs=tuple(record.name for record in records),
        patterns=names,
        orders=(edges_hz[:-1] + edges_hz[1:]) / edges_hz[1],
        mean_square=power / n_samples,
        coherent=(power - noise_power) / n_samples,
        p_value=chi2.sf(ratio, degrees),
        draws=lambda: np.stack(draws, axis=1) / n_samples,
        bands_hz=np.column_stack([edges_hz[:-1], edges_hz[1:]]),
    )
    return gap_cells([table])


def line_counts(record: MountingRecord, edges_hz: FloatArray) -> FloatArray:
    """Real amplitudes of one signal in every band, over all blocks of a run, shape (n_bands,)."""
    every_sample = np.ones((len(record.block), 1), dtype=bool)
    by_block = block_counts(every_sample, record.block, record.step, edges_hz)
    return np.asarray(by_block[:, 0].sum(axis=0), dtype=np.float64)
