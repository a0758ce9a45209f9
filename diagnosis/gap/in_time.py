"""The gap in time: RMS in sliding windows, and the trend of every cell over the repetitions of a run."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.stats import f as fisher_f
from scipy.stats import false_discovery_control

from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.gap.findings import SIGNIFICANCE, Drift, GapMoment, size_words

ComplexArray = NDArray[np.complex128]
#: Repetitions in a window at most, and windows a run is seen in at least where it has as many
#: repetitions.
_WINDOW = 20
_FEWEST_WINDOWS = 8
#: A trend is a quadratic in time.
_TERMS = 2
#: A trend below this share of a cell's mean square is not named, and no more than so many are.
_NAMED_SHARE = 0.02
_MOST_NAMED = 2


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
        own = square[first : first + length]
        if np.isfinite(own).any():
            middle = float(time[first : first + length].mean())
            moments.append(GapMoment(run, middle, float(np.sqrt(np.nanmean(own)))))
    return tuple(moments)


def trends(time: FloatArray, amplitudes: ComplexArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Quadratic trend of complex amplitudes over a run.

    Change from first to last, mean square, p-value.

    ``F = (SS_trend / 2) / (SS_left / (R - 3))``, complex amplitudes with twice the degrees of
    freedom; NaN p-values with fewer than five repetitions.

    Parameters
    ----------
    time : ndarray, shape (R,)
        Middle of every repetition [s].
    amplitudes : ndarray of complex, shape (R, ...)
        Amplitudes.

    Returns
    -------
    tuple of ndarray
        ``|change|``, mean square of the trend, p-value; each shaped like one repetition.
    """
    n, shape = time.size, amplitudes.shape[1:]
    nothing = np.zeros(shape), np.zeros(shape), np.full(shape, np.nan)
    if n < _TERMS + 3 or np.ptp(time) == 0.0:
        return nothing
    place = 2.0 * (time - time.min()) / np.ptp(time) - 1.0
    # Orthonormal columns without the constant.
    basis = np.linalg.qr(np.vander(place, _TERMS + 1, increasing=True))[0][:, 1:]
    flat = amplitudes.reshape(n, -1)
    centred = flat - flat.mean(axis=0)
    trend = basis @ (basis.T @ centred)
    explained, whole = (np.abs(own) ** 2 for own in (trend, centred))
    degrees = np.where(np.abs(flat.imag).max(axis=0) == 0.0, 1.0, 2.0)
    left = np.maximum(whole.sum(axis=0) - explained.sum(axis=0), np.finfo(float).tiny)
    ratio = explained.sum(axis=0) / _TERMS / (left / (n - _TERMS - 1))
    p_value = fisher_f.sf(ratio, degrees * _TERMS, degrees * (n - _TERMS - 1))
    change = np.abs(trend[-1] - trend[0])
    return change.reshape(shape), explained.mean(axis=0).reshape(shape), p_value.reshape(shape)


def significant_drifts(rows: Sequence[Drift]) -> tuple[Drift, ...]:
    """Trends beyond chance among those of all cells, largest change first.

    P-values are adjusted here.
    """
    known = [row for row in rows if np.isfinite(row.p_value)]
    if not known:
        return ()
    adjusted = false_discovery_control([row.p_value for row in known], method="by")
    found = [
        Drift(row.run, row.channel_pattern, row.order, row.change, row.share, float(p))
        for row, p in zip(known, adjusted, strict=True)
        if p < SIGNIFICANCE
    ]
    return tuple(sorted(found, key=lambda row: -row.change))


def drift_words(drifts: Sequence[Drift], unit: str, *, noun: str = "order") -> str:
    """``the gap drifts: in LC2 order 0, m=0 changes by 12 µm over the run``.

    Empty without a drift worth a word.
    """
    named = [row for row in drifts if row.share >= _NAMED_SHARE]
    if not named:
        return ""
    texts = [
        f"in {row.run} {noun} {row.order:g}, {row.channel_pattern} changes by {size_words(row.change, unit)}"
        for row in named[:_MOST_NAMED]
    ]
    more = f" (and {len(named) - _MOST_NAMED} cells more)" if len(named) > _MOST_NAMED else ""
    return f"the gap drifts in time: {', '.join(texts)}{more}"
