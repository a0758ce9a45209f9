"""The gap in time: windows, trends over a run, and what does not repeat."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

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
    """RMS in windows of up to 20 repetitions, of their mean squares; NaN where unknown."""
    length = max(1, min(_WINDOW, time.size - _FEWEST_WINDOWS + 1))
    windows = [slice(first, first + length) for first in range(time.size - length + 1)]
    return tuple(
        GapMoment(run, float(time[some].mean()), float(np.sqrt(np.nanmean(square[some]))))
        for some in windows
        if np.isfinite(square[some]).any()
    )


def block_rms(records: Sequence[Any], residuals: Sequence[FloatArray]) -> tuple[GapMoment, ...]:
    """RMS by block of every run, of all channels; loads may change from one block to the next.

    `residuals`, shape (n,) or (n, n_channels), are zero where nothing was measured.
    """
    moments = []
    for record, residual in zip(records, residuals, strict=True):
        for number in range(record.n_blocks):
            is_inside = record.block == number
            n_measured = int(record.is_measured[is_inside].sum())
            if n_measured:
                size = np.sqrt(float(np.sum(residual[is_inside] ** 2)) / n_measured)
                time = float(record.time[is_inside].mean())
                moments.append(GapMoment(record.name, time, float(size)))
    return tuple(moments)


@dataclass(frozen=True, eq=False)
class _Trend:
    """Quadratic trend of complex amplitudes, arrays shaped like one repetition."""

    change: FloatArray
    mean_square: FloatArray
    p_value: FloatArray


def trend(time: FloatArray, amplitudes: ComplexArray) -> _Trend:
    """Quadratic trend of complex amplitudes, shape (R, ...), over the times of R repetitions [s].

    ``F = (SS_trend / 2) / (SS_rest / (R - 3))``, complex amplitudes with twice the degrees of
    freedom.
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
    scatter = np.maximum(total - explained, np.finfo(float).tiny)
    ratio = explained / _TERMS / (scatter / (n - _TERMS - 1))
    p_value = fisher_f.sf(ratio, degrees * _TERMS, degrees * (n - _TERMS - 1))
    change = np.abs(fitted[-1] - fitted[0])
    return _Trend(*(one.reshape(shape) for one in (change, explained / n, p_value)))


@dataclass(frozen=True, eq=False, kw_only=True)
class _RunCells:
    """Cells of a run, or of runs of one condition; all values have one shape."""

    run: str  # Name of the run or runs
    patterns: tuple[str, ...]  # Channels or sensor patterns
    orders: FloatArray  # Orders, lines or middles of bands, shape (n_orders,)
    p_value: FloatArray  # By chance, not adjusted, shape (n_patterns, n_orders)
    used: BoolArray | None = None  # Cells that exist; default: all

    def is_used(self) -> BoolArray:
        """Cells that exist, shape (n_patterns, n_orders)."""
        return np.ones(self.p_value.shape, dtype=bool) if self.used is None else self.used

    def beyond(self, p_values: FloatArray, *values: FloatArray) -> Iterator[tuple[Any, ...]]:
        """Run, pattern, order, values and p-value of the cells beyond chance.

        `p_values` are the adjusted ones of all cells that exist.
        """
        for (p, n), p_value in zip(np.argwhere(self.is_used()), p_values.tolist(), strict=True):
            if p_value < SIGNIFICANCE:
                row = [float(value[p, n]) for value in values]
                yield (self.run, self.patterns[p], float(self.orders[n]), *row, p_value)


@dataclass(frozen=True, eq=False, kw_only=True)
class DriftTable(_RunCells):
    """Trends of all cells of a run."""

    change: FloatArray  # Amplitude of the change
    share: FloatArray  # Share of the mean square that the trend makes up


@dataclass(frozen=True, eq=False, kw_only=True)
class ScatterTable(_RunCells):
    """Mean square of all cells that does not repeat."""

    measured: FloatArray  # In the measured signal
    simulated: FloatArray  # In the simulated signal
    gap: FloatArray  # In the gap
    noise: FloatArray  # By the noise alone


def significant_drifts(tables: Sequence[DriftTable]) -> tuple[Drift, ...]:
    """Trends beyond chance, their p-values adjusted, among those of all cells, largest first."""
    if not tables:
        return ()
    by_table = adjusted_together([table.p_value[table.is_used()] for table in tables])
    rows = [
        Drift(*row)
        for table, p_values in zip(tables, by_table, strict=True)
        for row in table.beyond(p_values, table.change, table.share)
    ]
    return tuple(sorted(rows, key=lambda row: -row.change))


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
        NonSynchronousCell(*row)
        for table, p_values in zip(tables, by_table, strict=True)
        for row in table.beyond(p_values, table.measured, table.simulated, table.gap, table.noise)
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
