"""Gap map of an element: by line of a periodic drive, or by band of frequency, and run."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2
from scipy.stats import f as fisher_f

from carrierflex.diagnosis.comparison.problem import FloatArray, GapCell
from carrierflex.diagnosis.element.records import ElementRecord
from carrierflex.diagnosis.element.score_cells import segment_squares
from carrierflex.diagnosis.gap.gap_map import (
    N_DRAWS,
    CellTable,
    band_amplitudes,
    band_edges_hz,
    gap_cells,
)
from carrierflex.identification.estimation.resampling import multinomial_counts

_BANDS = 24
_SEED = 1


def element_gap_cells(
    records: Sequence[ElementRecord],
    residuals: Sequence[FloatArray],
    noise: FloatArray,
    *,
    channel: str,
) -> Sequence[GapCell]:
    """Gap map of a residual, largest cell first.

    Periodic drive with two periods or more: by line k, with the amplitudes ``E_r`` of R periods and
    their scatter s², coherent part ``|mean|²/2 - s²/2R``, test ``R |mean|²/s² ~ F(2, 2R - 2)``.
    Otherwise by band of frequency against the noise floor, ``power / noise ~ chi²``.

    Parameters
    ----------
    records : sequence of ElementRecord
        Runs.
    residuals : sequence of ndarray, shape (n,)
        Gap of every run.
    noise : ndarray, shape (n_runs,)
        Variance of the noise.
    channel : str
        Name of the channel.
    """
    tables = []
    for record, residual, variance in zip(records, residuals, noise, strict=True):
        periods = whole_periods(record, residual)
        if periods is None:
            tables.append(_band_table(record, residual, float(variance), channel))
        else:
            tables.append(_line_table(record, periods, channel))
    return gap_cells(tables)


def whole_periods(record: ElementRecord, signal: FloatArray) -> FloatArray | None:
    """Signal by period, shape (n_periods, period); None where the drive has fewer than two.

    Parameters
    ----------
    record : ElementRecord
        Run.
    signal : ndarray, shape (n,)
        Signal of that run.
    """
    if not record.period:
        return None
    first = int(np.argmax(record.counts))
    n_periods = (signal.size - first) // record.period
    if n_periods < 2:
        return None
    return signal[first : first + n_periods * record.period].reshape(n_periods, record.period)


def line_amplitudes(periods: FloatArray) -> NDArray[np.complex128]:
    """Amplitudes of the lines 0, 1, ... of every period, shape (n_periods, n_lines)."""
    size = periods.shape[1]
    amplitudes = np.fft.rfft(periods, axis=1)[:, : (size + 1) // 2] * (2.0 / size)
    amplitudes[:, 0] *= 0.5
    return amplitudes


def _line_table(record: ElementRecord, periods: FloatArray, channel: str) -> CellTable:
    """Lines of one run; the mean square of line 0 is its square, of the others half of it."""
    n = len(periods)
    amplitudes = line_amplitudes(periods)
    amplitudes[:, 0] *= np.sqrt(2.0)
    lines = np.arange(amplitudes.shape[1])
    mean = amplitudes.mean(axis=0)
    scatter = amplitudes.var(axis=0, ddof=1)
    degrees = np.where(lines == 0, 1.0, 2.0)
    ratio = n * np.abs(mean) ** 2 / np.maximum(scatter, np.finfo(float).tiny)
    weights = multinomial_counts(n, N_DRAWS, seed=_SEED) / n
    noise = scatter / (2.0 * n)
    mean_square = np.abs(mean) ** 2 / 2.0
    line_hz = lines / (record.period * record.step)
    return CellTable(
        runs=(record.name,),
        patterns=(channel,),
        orders=lines.astype(np.float64),
        mean_square=mean_square[None, None],
        coherent=(mean_square - noise)[None, None],
        p_value=fisher_f.sf(ratio, degrees, degrees * (n - 1))[None, None],
        draws=lambda: (np.abs(weights @ amplitudes) ** 2 / 2.0 - noise)[:, None, None],
        bands_hz=np.column_stack([line_hz, line_hz]),
    )


def _band_table(
    record: ElementRecord, residual: FloatArray, variance: float, channel: str
) -> CellTable:
    """Bands of one run; order is the number of the band's middle in steps of the lowest line."""
    length = int((record.block == 0).sum())
    edges_hz = band_edges_hz(length * record.step, 0.5001 / record.step, _BANDS)
    per_block = band_amplitudes(length, record.step, edges_hz)
    is_filled = per_block.any(axis=1)
    # Two amplitudes a line: the mean and half the sampling frequency count like the others.
    lines = 2.0 * (per_block > 0.0).sum(axis=1)[is_filled] * record.n_blocks
    squares = segment_squares(record, residual, edges_hz)[:, is_filled]
    n_samples = max(int((record.block >= 0).sum()), 1)
    power = squares.sum(axis=0)
    noise = variance * lines
    counts = multinomial_counts(record.n_blocks, N_DRAWS, seed=_SEED)
    bands_hz = np.column_stack([edges_hz[:-1], edges_hz[1:]])[is_filled]
    return CellTable(
        runs=(record.name,),
        patterns=(channel,),
        orders=bands_hz.mean(axis=1) * length * record.step,
        mean_square=power[None, None] / n_samples,
        coherent=(power - noise)[None, None] / n_samples,
        p_value=chi2.sf(power / max(variance, np.finfo(float).tiny), lines)[None, None],
        draws=lambda: ((counts @ squares - noise) / n_samples)[:, None, None],
        bands_hz=bands_hz,
    )
