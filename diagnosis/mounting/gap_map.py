"""Where the gap of a mounting lies.

By motion pattern of the six sensors, band of frequency and run.
"""

from collections.abc import Sequence

import numpy as np
from scipy.stats import chi2, false_discovery_control

from carrierflex.diagnosis.comparison.problem import FloatArray, GapCell
from carrierflex.diagnosis.mounting.records import MountingRecord
from carrierflex.simulation.mounting.rig import SENSORS

_BANDS = 6
_DRAWS = 200
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

    The channels themselves unless each of the six sensors stands once.

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
    places = [SENSORS.index(sensor) for sensor in sensors]
    return tuple(PATTERNS), np.array(list(PATTERNS.values()))[:, places]


def band_edges_hz(records: Sequence[MountingRecord]) -> FloatArray:
    """Ends of the bands of the map [Hz], evenly wide on a logarithmic axis, shape (n_bands + 1,)."""
    longest = max(float((record.block == 0).sum()) * record.step for record in records)
    highest = max(0.5 / record.step for record in records)
    return np.concatenate([[0.0], np.geomspace(1.5 / longest, 1.001 * highest, _BANDS)])


def block_powers(
    record: MountingRecord, signals: FloatArray, edges_hz: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Sum of squares by block, column and band, and the real amplitudes behind it.

    Parameters
    ----------
    record : MountingRecord
        Its blocks and step.
    signals : ndarray, shape (n, m)
        Zero where nothing was measured.
    edges_hz : ndarray
        Ends of the bands [Hz].

    Returns
    -------
    powers, lines : ndarray, shape (n_blocks, m, n_bands), (n_blocks, n_bands)
        Powers add up to the sum of squares, lines to the samples; powers infinite where the signals
        are.
    """
    powers, lines = [], []
    for block in range(record.n_blocks):
        own = signals[record.block == block]
        frequency = np.fft.rfftfreq(len(own), record.step)
        weight = np.full(frequency.size, 2.0)
        weight[0] = 1.0
        if len(own) % 2 == 0:
            weight[-1] = 1.0
        band = np.clip(np.searchsorted(edges_hz, frequency, side="right") - 1, 0, edges_hz.size - 2)
        to_band = (band == np.arange(edges_hz.size - 1)[:, None]).astype(np.float64) * weight
        lines.append(to_band.sum(axis=1))
        if np.isfinite(own).all():
            powers.append((to_band @ np.abs(np.fft.rfft(own, axis=0)) ** 2 / len(own)).T)
        else:
            powers.append(np.full((own.shape[1], edges_hz.size - 1), np.inf))
    return np.array(powers), np.array(lines)


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
    tuple of ndarray, each of shape (n_pieces, n_channels * n_bands)
        Counts and squares [m²].
    """
    counts, noise = [], []
    for record in records:
        _, lines = block_powers(record, np.zeros(record.measured.shape), edges_hz)
        for block in range(record.n_blocks):
            present = np.isfinite(record.measured[record.block == block]).mean(axis=0)
            own = np.multiply.outer(present, lines[block])
            square = own * record.noise[:, None]
            square[:, 0] += record.zero_noise * present * (record.block == block).sum()
            counts.append(own.ravel())
            noise.append(square.ravel())
    return np.array(counts), np.array(noise)


def mounting_gap_cells(
    records: Sequence[MountingRecord],
    residuals: Sequence[FloatArray],
    sensors: Sequence[str],
    channels: Sequence[str],
) -> tuple[GapCell, ...]:
    """Gap map of a residual.

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
        Largest share first; mean squares are over all channels' samples of all runs, so that they
        add up.
    """
    names, matrix = pattern_matrix(sensors, channels)
    edges, size = band_edges_hz(records), sum(residual.size for residual in residuals)
    squares, coherents, p_values, draws = [], [], [], []
    for record, residual in zip(records, residuals, strict=True):
        powers, lines = block_powers(record, residual @ matrix.T, edges)
        expected = np.multiply.outer(matrix**2 @ record.noise, lines.sum(axis=0))
        # The zero's error stays for the whole run: it lies in the lowest band.
        expected[:, 0] += matrix**2 @ record.zero_noise * len(residual)
        degrees = np.maximum(lines.sum(axis=0), 1.0)
        power = powers.sum(axis=0)
        squares.append(power / size)
        coherents.append((power - expected) / size)
        p_values.append(
            chi2.sf(power * degrees / np.maximum(expected, np.finfo(float).tiny), degrees)
        )
        draws.append(_draws(powers, expected) / size)
    adjusted = false_discovery_control(np.clip(p_values, 0.0, 1.0), axis=None, method="by")
    coherent, drawn = np.array(coherents), np.array(draws)
    total = float(coherent.sum()) or np.nan
    # Each draw takes its own total: runs are drawn together, blocks within them.
    low, high = np.quantile(
        drawn / drawn.sum(axis=(0, 2, 3))[:, None, None], (0.025, 0.975), axis=1
    )
    cells = [
        GapCell(
            name, float((edges[b] + edges[b + 1]) / edges[1]), record.name, float(squares[r][p, b]),
            float(coherent[r, p, b]), float(coherent[r, p, b] / total), (float(low[r, p, b]), float(high[r, p, b])),
            float(adjusted.reshape(coherent.shape)[r, p, b]), (float(edges[b]), float(edges[b + 1])),
        )
        for r, record in enumerate(records)
        for p, name in enumerate(names)
        for b in range(edges.size - 1)
    ]  # fmt: skip
    return tuple(sorted(cells, key=lambda cell: -cell.share))


def _draws(powers: FloatArray, expected: FloatArray) -> FloatArray:
    """Coherent power of bootstrap draws of the blocks, shape (_DRAWS, n_patterns, n_bands)."""
    n = len(powers)
    weights = np.random.default_rng(_SEED).multinomial(n, np.full(n, 1.0 / n), _DRAWS)
    return np.asarray(np.tensordot(weights, powers, axes=1) - expected, dtype=np.float64)
