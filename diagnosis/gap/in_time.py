"""The gap in time: windows, trends over a run, and what does not repeat."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2
from scipy.stats import f as fisher_f

from carrierflex.diagnosis.comparison.problem import BoolArray, FloatArray
from carrierflex.diagnosis.gap.findings import Drift, GapMoment, NonSynchronousCell, Repeatability
from carrierflex.diagnosis.gap.gap_map import SIGNIFICANCE, adjusted_together

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
class _Trend:
    """Quadratic trend of complex amplitudes, arrays shaped like one repetition."""

    change: FloatArray
    mean_square: FloatArray
    p_value: FloatArray


def trend(time: FloatArray, amplitudes: ComplexArray) -> _Trend:
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
        return _Trend(np.zeros(shape), np.zeros(shape), np.full(shape, np.nan))
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
    return _Trend(change.reshape(shape), (explained / n).reshape(shape), p_value.reshape(shape))


@dataclass(frozen=True, eq=False)
class DriftTable:
    """Trends of all cells of a run."""

    run: Annotated[str, "Run"]
    patterns: Annotated[tuple[str, ...], "Channels or sensor patterns"]
    orders: Annotated[FloatArray, "Orders, or lines, shape (n_orders,)"]
    change: Annotated[FloatArray, "Amplitude of the change, shape (n_patterns, n_orders)"]
    share: Annotated[FloatArray, "Share of the mean square that the trend makes up"]
    p_value: Annotated[FloatArray, "Without a trend, not adjusted; NaN where unknown"]
    used: Annotated[BoolArray, "Cells that exist, shape (n_patterns, n_orders)"]

    def beyond(self, p_values: FloatArray) -> list[Drift]:
        """Trends beyond chance, by the adjusted p-values of all that exist."""
        indices = np.argwhere(self.used)
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
                indices[is_beyond].tolist(), p_values[is_beyond].tolist(), strict=True
            )
        ]


def significant_drifts(tables: Sequence[DriftTable]) -> tuple[Drift, ...]:
    """Trends beyond chance among those of all cells, largest change first.

    P-values are adjusted here.
    """
    if not tables:
        return ()
    by_table = adjusted_together([table.p_value[table.used] for table in tables])
    rows = [
        row
        for table, p_values in zip(tables, by_table, strict=True)
        for row in table.beyond(p_values)
    ]
    return tuple(sorted(rows, key=lambda row: -row.change))


@dataclass(frozen=True, eq=False)
class ScatterTable:
    """Scatter of all cells of a run, or of runs of one condition."""

    run: Annotated[str, "Name of the run or runs"]
    patterns: Annotated[tuple[str, ...], "Channels or sensor patterns"]
    orders: Annotated[FloatArray, "Orders, lines or middles of bands, shape (n_orders,)"]
    measured: Annotated[
        FloatArray, "Mean square that does not repeat when measured, shape (n_patterns, n_orders)"
    ]
    simulated: Annotated[FloatArray, "The same of the simulated signal"]
    gap: Annotated[FloatArray, "The same of the gap"]
    noise: Annotated[FloatArray, "What the noise alone leaves there"]
    p_value: Annotated[FloatArray, "Without more than noise, not adjusted; NaN where unknown"]
    used: Annotated[
        BoolArray | None, "Cells that exist; all where it is left out, shape (n_patterns, n_orders)"
    ] = None

    def is_used(self) -> BoolArray:
        """Cells that exist, shape (n_patterns, n_orders)."""
        return np.ones(self.gap.shape, dtype=bool) if self.used is None else self.used

    def beyond(self, p_values: FloatArray) -> list[NonSynchronousCell]:
        """Cells beyond noise, by the adjusted p-values of all that exist."""
        indices = np.argwhere(self.is_used())
        is_beyond = p_values < SIGNIFICANCE
        return [
            NonSynchronousCell(
                run=self.run,
                channel_pattern=self.patterns[p],
                order=float(self.orders[n]),
                measured=float(self.measured[p, n]),
                simulated=float(self.simulated[p, n]),
                gap=float(self.gap[p, n]),
                noise=float(self.noise[p, n]),
                p_value=p_value,
            )
            for (p, n), p_value in zip(
                indices[is_beyond].tolist(), p_values[is_beyond].tolist(), strict=True
            )
        ]


def scatter_p_values(scatter: FloatArray, noise: FloatArray, degrees: FloatArray) -> FloatArray:
    """Probability of a scatter under declared noise: ``dof scatter / noise ~ chi²(dof)``."""
    ratio = scatter / np.maximum(noise, np.finfo(float).tiny)
    return np.asarray(chi2.sf(degrees * ratio, degrees), dtype=np.float64)


def scatter_p_values_estimated(
    scatter: FloatArray, noise: FloatArray, degrees: FloatArray, noise_degrees: float | FloatArray
) -> FloatArray:
    """Probability of a scatter under noise that other samples estimate: ``scatter / noise ~ F``."""
    ratio = scatter / np.maximum(noise, np.finfo(float).tiny)
    return np.asarray(fisher_f.sf(ratio, degrees, noise_degrees), dtype=np.float64)


def significant_non_synchronous(
    tables: Sequence[ScatterTable], off_orders: Sequence[NonSynchronousCell] = ()
) -> tuple[NonSynchronousCell, ...]:
    """Cells whose scatter is beyond noise, and all cells off the orders, largest excess first.

    P-values are adjusted here; NaN where they are unknown.
    """
    raw = [table.p_value[table.is_used()] for table in tables]
    raw.append(np.array([cell.p_value for cell in off_orders]))
    *by_table, of_others = adjusted_together(raw)
    rows = [
        cell
        for table, p_values in zip(tables, by_table, strict=True)
        for cell in table.beyond(p_values)
    ]
    rows += [
        replace(cell, p_value=p_value)
        for cell, p_value in zip(off_orders, of_others.tolist(), strict=True)
    ]
    return tuple(sorted(rows, key=lambda cell: cell.noise - cell.gap))


def repeatability(
    cells: Sequence[NonSynchronousCell], coherent: float, repetition: str
) -> tuple[Repeatability, ...]:
    """What the scatter amounts to, one or none; empty where nothing was tested.

    `coherent` is the mean square of the repeating gap over all runs; `repetition` is
    ``revolution``, ``period`` or ``repeat``.
    """
    beyond = [cell for cell in cells if cell.p_value < SIGNIFICANCE and cell.gap > cell.noise]
    if not beyond:
        is_tested = any(np.isfinite(cell.p_value) for cell in cells)
        return (Repeatability(repetition, 0.0, 0.0, None),) if is_tested else ()
    excess = sum(cell.gap - cell.noise for cell in beyond)
    n_runs = len({cell.run for cell in cells})
    share = excess / coherent if coherent > 0.0 else float("inf")
    return (Repeatability(repetition, float(np.sqrt(excess / n_runs)), share, beyond[0]),)
