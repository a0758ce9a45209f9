"""Runs beside a baseline that is linear in its parameters, and one more column fitted with it.

The residual is fitted by the baseline's columns and one more, ``r = J d + g c``: what the baseline
cannot absorb of ``c`` tells ``g``. Columns of parameters that one run has for itself are fitted out
of its products first, so that no product grows with the number of runs. The variance of ``g`` is
that of least squares times the correlation of the residual from sample to sample,
``1 + 2 (rho_1 + rho_2 + ...)``.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.identification.estimation.scaled_least_squares import (
    column_lengths,
    normal_inverse,
)

FloatArray = NDArray[np.float64]

#: Share of a column that the others must leave for its factor to be told from theirs.
_LEFT = 1e-6
#: Lags of the residual's correlation.
_LAGS = 20


@dataclass(frozen=True, eq=False)
class LinearRecord:
    """One run beside a baseline that is linear in its parameters.

    Parameters
    ----------
    run : str
        Its name.
    time : ndarray, shape (n,)
        Time [s].
    residual, predicted : ndarray, shape (n, n_channels)
        Measured less predicted, NaN where missing; what the baseline predicts.
    columns : ndarray, shape (q + p, n, n_channels)
        Derivatives of the prediction by the baseline's parameters: q of this run alone, p of all.
    n_of_run : int
        q.
    """

    run: str
    time: FloatArray
    residual: FloatArray
    predicted: FloatArray
    columns: FloatArray
    n_of_run: int = 0

    @property
    def slope(self) -> FloatArray:
        """Derivative of the prediction by time, shape (n, n_channels)."""
        return np.asarray(np.gradient(self.predicted, self.time, axis=0), dtype=np.float64)


def shared_products(gram: FloatArray, n_of_run: int) -> FloatArray:
    """Products of what is left of columns once the parameters of the run alone are fitted out.

    Parameters
    ----------
    gram : ndarray, shape (q + n, q + n)
        Products of all columns of a run.
    n_of_run : int
        q, columns of parameters of the run alone, the first.

    Returns
    -------
    ndarray, shape (n, n)
        Schur complement.
    """
    of_run, crossed = gram[:n_of_run, :n_of_run], gram[:n_of_run, n_of_run:]
    return np.asarray(
        gram[n_of_run:, n_of_run:] - crossed.T @ normal_inverse(of_run) @ crossed,
        dtype=np.float64,
    )


def unit_columns(sums: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Products of columns of unit length, shape (n, n), and the lengths, shape (n,)."""
    # Columns of very different units: the pseudo-inverse judges them by their own size.
    scale = column_lengths(sums)
    return sums / np.outer(scale, scale), scale


def inverse_of_unit_columns(scaled: FloatArray) -> FloatArray:
    """Inverse of products of unit columns, shape (n, n), without the directions of rounding."""
    return np.asarray(np.linalg.pinv(scaled, rcond=1e-12, hermitian=True), dtype=np.float64)


def last_factor(sums: FloatArray, variance: float) -> tuple[float, float]:
    """Factor of the last column before the residual in a least-squares fit, and its deviation.

    Parameters
    ----------
    sums : ndarray, shape (p + 2, p + 2)
        Products of p columns, the column in question and the residual.
    variance : float
        Variance of the residual, correlation included.

    Returns
    -------
    tuple of float
        Zero and infinity where the other columns leave nothing of the one in question.
    """
    scaled, scale = unit_columns(sums)
    others = slice(0, -2)
    absorbed = inverse_of_unit_columns(scaled[others, others]) @ scaled[others, -2]
    left = 1.0 - float(scaled[-2, others] @ absorbed)
    if left < _LEFT:
        return 0.0, np.inf
    along = float(scaled[-2, -1] - absorbed @ scaled[others, -1])
    factor = along / left * float(scale[-1] / scale[-2])
    return factor, float(np.sqrt(variance / left) / scale[-2])


def residual_variance(square: float, residuals: Sequence[tuple[float, int]]) -> float:
    """Variance of the residual of all runs, the correlation of its samples included.

    Parameters
    ----------
    square : float
        Sum of the residual's squares.
    residuals : sequence of (float, int)
        :func:`correlation` and samples of each run.
    """
    factors, counts = zip(*residuals, strict=True)
    return float(np.average(factors, weights=counts) * square / sum(counts))


def correlation(residual: FloatArray) -> float:
    """Factor by which correlated samples raise a variance, mean over the channels; one at least.

    Parameters
    ----------
    residual : ndarray, shape (n, n_channels)
        Residual; NaN where missing.
    """
    values = np.where(np.isfinite(residual), residual, 0.0)
    values = values - values.mean(axis=0)
    n = len(values)
    square = np.sum(values**2, axis=0)
    if n <= 2 * _LAGS or not (square > 0.0).any():
        return 1.0
    lagged = [np.sum(values[lag:] * values[:-lag], axis=0) for lag in range(1, _LAGS + 1)]
    rho = np.sum(lagged, axis=1) / np.sum(square)
    # Up to the first lag without correlation: beyond it the sum is noise.
    ends = np.flatnonzero(rho < 2.0 / np.sqrt(n * values.shape[1]))
    return max(1.0 + 2.0 * float(rho[: ends[0] if ends.size else _LAGS].sum()), 1.0)
