"""The gap in time: RMS in windows of a run, and the trend of every cell over its repetitions."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import f as fisher_f

from carrierflex.diagnosis.comparison.problem import BoolArray, FloatArray
from carrierflex.diagnosis.gap.findings import Drift, GapMoment
from carrierflex.diagnosis.gap.significance import SIGNIFICANCE, adjusted_together

ComplexArray = NDArray[np.complex128]
#: Repetitions in a window at most, and windows a run has at least where it has as many
#: repetitions.
_WINDOW = 20
_FEWEST_WINDOWS = 8
#: A trend is a quadratic in time.
_TERMS = 2


def sliding_rms(run: str, time: FloatArray, square: FloatArray) -> tuple[GapMoment, ...]:
    """RMS in sliding windows of up to 20 repetitions.

    Parameters
    ----------
    run : str
        Run.
    time : ndarray, shape (R,)
        Middle of every repetition [s].
    square : ndarray, shape (R,)
        Mean square of the gap in every repetition; NaN where unknown.

    Returns
    -------
    tuple of GapMoment
        One for each window.
    """
    n = time.size
    length = max(1, min(_WINDOW, n - _FEWEST_WINDOWS + 1))
    moments = []
    for first in range(n - length + 1):
        window = square[first : first + length]
        if np.isfinite(window).any():
            middle = float(time[first : first + length].mean())
            moments.append(GapMoment(run, middle, float(np.sqrt(np.nanmean(window)))))
    return tuple(moments)


def block_rms(
    run: str,
    time: FloatArray,
    block: NDArray[np.int64],
    residual: FloatArray,
    is_measured: BoolArray,
) -> tuple[GapMoment, ...]:
    """RMS by block of a run.

    A block is long enough to score; loads may change from one to the next.

    Parameters
    ----------
    run : str
        Run.
    time : ndarray, shape (n,)
        Time of the samples [s].
    block : ndarray of int, shape (n,)
        Block of every sample; -1 where it does not count.
    residual : ndarray, shape (n, n_channels)
        Gap, zero where nothing was measured.
    is_measured : ndarray of bool, shape (n, n_channels)
        Samples that were measured.

    Returns
    -------
    tuple of GapMoment
        One for each block with a measured sample.
    """
    moments = []
    for number in range(int(block.max()) + 1):
        is_inside = block == number
        n_measured = int(is_measured[is_inside].sum())
        if n_measured:
            mean_square = float(np.sum(residual[is_inside] ** 2)) / n_measured
            moments.append(
                GapMoment(run, float(time[is_inside].mean()), float(np.sqrt(mean_square)))
            )
    return tuple(moments)


@dataclass(frozen=True, eq=False)
class Trend:
    """Quadratic trend of complex amplitudes, arrays shaped like one repetition.

    Parameters
    ----------
    change : ndarray
        Size of the change from the first to the last repetition.
    mean_square : ndarray
        Mean square of the trend.
    p_value : ndarray
        Without a trend; NaN with fewer than five repetitions.
    """

    change: FloatArray
    mean_square: FloatArray
    p_value: FloatArray


def trend(time: FloatArray, amplitudes: ComplexArray) -> Trend:
    """Quadratic trend of complex amplitudes over a run.

    ``F = (SS_trend / 2) / (SS_rest / (R - 3))``, complex amplitudes with twice the degrees of
    freedom.

    Parameters
    ----------
    time : ndarray, shape (R,)
        Middle of every repetition [s].
    amplitudes : ndarray of complex, shape (R, ...)
        Amplitudes.
    """
    n = time.size
    shape = amplitudes.shape[1:]
    if n < _TERMS + 3 or np.ptp(time) == 0.0:
        return Trend(np.zeros(shape), np.zeros(shape), np.full(shape, np.nan))
    relative = 2.0 * (time - time.min()) / np.ptp(time) - 1.0
    # Orthonormal columns without the constant.
    basis = np.linalg.qr(np.vander(relative, _TERMS + 1, increasing=True))[0][:, 1:]
    flat = amplitudes.reshape(n, -1)
    centred = flat - flat.mean(axis=0)
    fitted = basis @ (basis.T @ centred)
    explained = (np.abs(fitted) ** 2).sum(axis=0)
    total = (np.abs(centred) ** 2).sum(axis=0)
    degrees = np.where(np.abs(flat.imag).max(axis=0) == 0.0, 1.0, 2.0)
    rest = np.maximum(total - explained, np.finfo(float).tiny)
    ratio = explained / _TERMS / (rest / (n - _TERMS - 1))
    p_value = fisher_f.sf(ratio, degrees * _TERMS, degrees * (n - _TERMS - 1))
    change = np.abs(fitted[-1] - fitted[0])
    return Trend(change.reshape(shape), (explained / n).reshape(shape), p_value.reshape(shape))


@dataclass(frozen=True, eq=False)
class DriftTable:
    """Trends of all cells of a run.

    Parameters
    ----------
    run : str
        Run.
    patterns : tuple of str
        Channels or sensor patterns.
    orders : ndarray, shape (n_orders,)
        Orders, or lines.
    change, share, p_value : ndarray, shape (n_patterns, n_orders)
        As of :class:`carrierflex.diagnosis.gap.findings.Drift`; p-values not adjusted, NaN where
        unknown.
    used : ndarray of bool, shape (n_patterns, n_orders)
        Cells that exist.
    """

    run: str
    patterns: tuple[str, ...]
    orders: FloatArray
    change: FloatArray
    share: FloatArray
    p_value: FloatArray
    used: BoolArray

    def beyond(self, p_values: FloatArray) -> list[Drift]:
        """Trends beyond chance, by the adjusted p-values of all that exist."""
        places = np.argwhere(self.used)
        is_beyond = p_values < SIGNIFICANCE
        return [
            Drift(
                run=self.run,
                channel_pattern=self.patterns[p],
                order=float(self.orders[n]),
                change=float(self.change[p, n]),
                share=float(self.share[p, n]),
                p_value=p_value,
            )
            for (p, n), p_value in zip(
                places[is_beyond].tolist(), p_values[is_beyond].tolist(), strict=True
            )
        ]


def significant_drifts(tables: Sequence[DriftTable]) -> tuple[Drift, ...]:
    """Trends beyond chance among those of all cells, largest change first.

    P-values are adjusted here.
    """
    if not tables:
        return ()
    by_table = adjusted_together([table.p_value[table.used] for table in tables])
    kept = [row for table, own in zip(tables, by_table, strict=True) for row in table.beyond(own)]
    return tuple(sorted(kept, key=lambda row: -row.change))
