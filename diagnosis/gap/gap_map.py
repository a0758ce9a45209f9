"""Gap map: cells of all runs, each with its share of the gap, the share's interval and its p-value.

A kind computes tables of cells from its records; from there on every map is made alike. The share
of a cell is ``coherent / sum of coherent``; its interval comes from bootstrap draws of the
repetitions (revolutions, periods or blocks), p-values are adjusted for the number of cells.

By Parseval's theorem the powers of a block's bands add up to its sum of squares, and their real
amplitudes to its samples: white noise of variance s² leaves ``s² times amplitudes`` in a band.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import accumulate, pairwise
from typing import overload

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.stats import false_discovery_control

from carrierflex.diagnosis.comparison.problem import BoolArray, FloatArray, GapCell
from carrierflex.identification.estimation.resampling import multinomial_counts

IntArray = NDArray[np.int64]

#: A cell counts as beyond chance where its adjusted p-value is below this: one false cell in a
#: hundred at most among those that are shown.
SIGNIFICANCE = 0.01
#: The position of the gap is that of the cells that hold this share of what is significant.
_MOST_OF_THE_GAP = 0.8


def _adjusted(p_values: ArrayLike) -> FloatArray:
    """P-values adjusted for their number under any dependence, same shape."""
    # Y. Benjamini, D. Yekutieli, Ann. Statist. 29 (2001) 1165-1188.
    values = np.clip(np.asarray(p_values, dtype=np.float64), 0.0, 1.0)
    if not values.size:
        return values
    return np.asarray(false_discovery_control(values, axis=None, method="by"), dtype=np.float64)


def adjusted_together(tables: Sequence[FloatArray]) -> list[FloatArray]:
    """P-values of several tables adjusted for the number of all that are known; NaN stays."""
    p_values = np.concatenate(tables)
    known = np.isfinite(p_values)
    p_values[known] = _adjusted(p_values[known])
    return np.split(p_values, np.cumsum([table.size for table in tables])[:-1])


def significant(cells: Iterable[GapCell]) -> list[GapCell]:
    """Cells that hold more than noise, beyond chance, in their order.

    None where all cells together hold no more than noise: no cell has a share of that.
    """
    return [cell for cell in cells if cell.p_value < SIGNIFICANCE and cell.share > 0.0]


def largest_cells(cells: Sequence[GapCell]) -> list[GapCell]:
    """First cells of a list that together hold 80 % of its gap; at least one where there is any."""
    required = _MOST_OF_THE_GAP * sum(cell.coherent for cell in cells)
    covered = accumulate(cell.coherent for cell in cells)
    enough = next((n for n, share in enumerate(covered, start=1) if share >= required), len(cells))
    return list(cells[:enough])


def band_edges_hz(duration: float, highest_hz: float, n_bands: int) -> FloatArray:
    """Ends of bands of frequency [Hz], evenly wide on a logarithmic axis, shape (n_bands + 1,).

    The first band holds the mean and the first line of the longest block, whose `duration` is in
    seconds; the last ends above half the sampling frequency.
    """
    return np.concatenate([[0.0], np.geomspace(1.5 / duration, highest_hz, n_bands)])


def band_amplitudes(n: int, step: float, edges_hz: FloatArray) -> FloatArray:
    """How many real amplitudes of every line of n samples lie in a band, (n_bands, n // 2 + 1)."""
    amplitudes, ends = _lines_by_band(n, step, edges_hz)
    line = np.arange(amplitudes.size)
    return amplitudes * ((line >= ends[:-1, None]) & (line < ends[1:, None]))


def _lines_by_band(n: int, step: float, edges_hz: FloatArray) -> tuple[FloatArray, IntArray]:
    """Real amplitudes of every line, and the first line of every band and one beyond the last."""
    frequency = np.fft.rfftfreq(n, step)
    amplitudes = np.full(frequency.size, 2.0)
    amplitudes[0] = 1.0
    if n % 2 == 0:
        amplitudes[-1] = 1.0
    inner = np.searchsorted(frequency, edges_hz[1:-1])
    return amplitudes, np.concatenate([[0], inner, [frequency.size]])


def block_powers(
    signals: FloatArray, block: NDArray[np.int64], step: float, edges_hz: FloatArray
) -> FloatArray:
    """Sum of squares by block, column and band, shape (n_blocks, n_columns, n_bands).

    Parameters
    ----------
    signals : ndarray, shape (n, n_columns)
        Signals; a block in which one is infinite has infinite sums.
    block : ndarray of int, shape (n,)
        Block of every sample, from 0; -1 outside, where none counts.
    step : float
        Distance of the samples [s].
    edges_hz : ndarray, shape (n_bands + 1,)
        Ends of the bands [Hz].
    """
    powers = []
    for number in range(int(block.max()) + 1):
        span = _span(block == number)
        is_inside = block[span] == number
        values = np.where(is_inside[:, None], signals[span], 0.0)
        if not np.isfinite(values).all():
            powers.append(np.full((values.shape[1], edges_hz.size - 1), np.inf))
            continue
        amplitudes, ends = _lines_by_band(len(values), step, edges_hz)
        spectrum = np.fft.rfft(values, axis=0)
        square = amplitudes[:, None] * (spectrum.real**2 + spectrum.imag**2) / len(values)
        by_band = [square[first:end].sum(axis=0) for first, end in pairwise(ends)]
        powers.append(np.array(by_band).T)
    return np.array(powers)


def block_counts(
    is_measured: BoolArray, block: NDArray[np.int64], step: float, edges_hz: FloatArray
) -> FloatArray:
    """Degrees of freedom by block, column and band, shape (n_blocks, n_columns, n_bands).

    The amplitudes of a band times the share of the block's samples that were measured; arguments as
    of :func:`block_powers`.
    """
    counts = []
    for number in range(int(block.max()) + 1):
        span = _span(block == number)
        is_counted = is_measured[span] & (block[span] == number)[:, None]
        lines, ends = _lines_by_band(len(is_counted), step, edges_hz)
        amplitudes = np.array([lines[first:end].sum() for first, end in pairwise(ends)])
        counts.append(np.multiply.outer(is_counted.mean(axis=0), amplitudes))
    return np.array(counts)


def _span(is_inside: BoolArray) -> slice:
    """First to last sample of a block."""
    samples = np.flatnonzero(is_inside)
    return slice(int(samples[0]), int(samples[-1]) + 1)


#: Columns of a map's values.
_COHERENT = 2
_SHARE = 3
_P_VALUE = 6
#: Draws of every interval: enough for the 2.5 % quantile of a share to be within a per cent.
N_DRAWS = 200


def drawn_counts(n: int) -> FloatArray:
    """How often each of n repetitions stands in each bootstrap draw, shape (N_DRAWS, n)."""
    return multinomial_counts(n, N_DRAWS, seed=1)


@dataclass(frozen=True, eq=False)
class CellTable:
    """Cells of the runs whose repetitions are drawn together."""

    runs: tuple[str, ...]  # Runs
    patterns: tuple[str, ...]  # Channels or sensor patterns
    orders: FloatArray  # Shaft orders, lines, or middles of bands, shape (n_orders,)
    mean_square: FloatArray  # Mean square of the gap, shape (n_runs, n_patterns, n_orders)
    coherent: FloatArray  # The same less the noise
    p_value: FloatArray  # Probability of each without a gap, not adjusted
    #: ``() -> coherent part`` in N_DRAWS bootstrap draws of the repetitions; not made before the
    #: intervals are, for those of many runs are more than their map
    draws: Callable[[], FloatArray]
    #: Ends of the band behind every order [Hz], shape (n_orders, 2)
    bands_hz: FloatArray | None = None
    used: BoolArray | None = None  # Cells that exist; default: all, shape (n_patterns, n_orders)

    def is_used(self) -> BoolArray:
        """Cells that exist, shape (n_runs, n_patterns, n_orders)."""
        if self.used is None:
            return np.ones(self.coherent.shape, dtype=bool)
        return np.broadcast_to(self.used, self.coherent.shape)


@dataclass(frozen=True, eq=False)
class GapMap(Sequence[GapCell]):
    """Cells of a map, each made when it is looked at: those of many runs are a million."""

    runs: tuple[str, ...]  # Names of runs that the cells point to
    patterns: tuple[str, ...]  # Names of patterns that the cells point to
    indices: IntArray  # Number of the run and of the pattern of every cell, shape (n, 2)
    #: Order, mean square, coherent part, share, both ends of its interval, p-value, both ends of
    #: the band; NaN where there is no band, shape (n, 9)
    values: FloatArray

    @property
    def orders(self) -> FloatArray:
        """Order of every cell, shape (n,)."""
        return self.values[:, 0]

    @property
    def mean_squares(self) -> FloatArray:
        """Mean square of the gap of every cell, shape (n,)."""
        return self.values[:, 1]

    @property
    def coherent(self) -> FloatArray:
        """Coherent part of every cell, shape (n,)."""
        return self.values[:, _COHERENT]

    @property
    def noise(self) -> FloatArray:
        """Rest of every cell's mean square, not below zero, shape (n,)."""
        return np.maximum(self.mean_squares - self.coherent, 0.0)

    @property
    def shares(self) -> FloatArray:
        """Share of every cell, shape (n,)."""
        return self.values[:, _SHARE]

    @property
    def p_values(self) -> FloatArray:
        """Adjusted p-value of every cell, shape (n,)."""
        return self.values[:, _P_VALUE]

    @property
    def bands_hz(self) -> FloatArray:
        """Ends of the band behind every cell [Hz], NaN where there is none, shape (n, 2)."""
        return self.values[:, -2:]

    @property
    def are_significant(self) -> BoolArray:
        """Which cells hold more than noise, beyond chance, shape (n,)."""
        return (self.p_values < SIGNIFICANCE) & (self.shares > 0.0)

    def chosen(self, which: BoolArray | IntArray) -> "GapMap":
        """Some of the cells, in their order or that of given numbers."""
        return replace(self, indices=self.indices[which], values=self.values[which])

    def on_orders(self) -> "GapMap":
        """Cells without a band: those of the shaft's orders."""
        return self.chosen(np.isnan(self.bands_hz[:, 0]))

    def of_gap(self, total: float) -> "GapMap":
        """The same cells as parts of another gap; shares are NaN where there is none."""
        values = self.values.copy()
        values[:, _SHARE] = self.coherent / total if total > 0.0 else np.nan
        return replace(self, values=values)

    def __len__(self) -> int:
        return len(self.values)

    @overload
    def __getitem__(self, number: int) -> GapCell: ...
    @overload
    def __getitem__(self, number: slice) -> "GapMap": ...
    def __getitem__(self, number: int | slice) -> "GapCell | GapMap":
        if isinstance(number, slice):
            return replace(self, indices=self.indices[number], values=self.values[number])
        run, pattern = self.indices[number].tolist()
        order, mean_square, coherent, share, low, high, p_value, *band = self.values[
            number
        ].tolist()
        return GapCell(
            channel_pattern=self.patterns[pattern],
            order=order,
            run=self.runs[run],
            mean_square=mean_square,
            coherent=coherent,
            share=share,
            share_ci95=(low, high),
            p_value=p_value,
            frequency_hz=None if np.isnan(band[0]) else (band[0], band[1]),
        )


def map_of(cells: Sequence[GapCell]) -> GapMap:
    """Cells as a map, whose columns are read at once."""
    if isinstance(cells, GapMap):
        return cells
    runs = list(dict.fromkeys(cell.run for cell in cells))
    patterns = list(dict.fromkeys(cell.channel_pattern for cell in cells))
    indices = [[runs.index(one.run), patterns.index(one.channel_pattern)] for one in cells]
    values = [
        [
            *(one.order, one.mean_square, one.coherent, one.share, *one.share_ci95, one.p_value),
            *(one.frequency_hz or (np.nan, np.nan)),
        ]
        for one in cells
    ]
    return GapMap(
        tuple(runs),
        tuple(patterns),
        np.array(indices, dtype=np.int64).reshape(-1, 2),
        np.array(values, dtype=np.float64).reshape(-1, 9),
    )


def gap_cells(tables: Sequence[CellTable]) -> Sequence[GapCell]:
    """Gap map of several tables of runs, largest cell first.

    Where one table is drawn, the others stay as they are. Shares are NaN where the coherent parts
    add up to nothing, or to less than the noise.
    """
    if not tables:
        return ()
    total = sum(float(table.coherent.sum()) for table in tables)
    p_values = adjusted_together([table.p_value[table.is_used()] for table in tables])
    runs = list(dict.fromkeys(name for table in tables for name in table.runs))
    patterns = list(dict.fromkeys(name for table in tables for name in table.patterns))
    numbers, values = [], []
    for table, of_table in zip(tables, p_values, strict=True):
        used = np.argwhere(table.is_used())
        of_runs = np.array([runs.index(name) for name in table.runs])
        of_patterns = np.array([patterns.index(name) for name in table.patterns])
        numbers.append(np.column_stack([of_runs[used[:, 0]], of_patterns[used[:, 1]]]))
        values.append(_values(table, used, total, of_table))
    every = np.concatenate(values)
    largest = np.argsort(-every[:, _COHERENT], kind="stable")
    return GapMap(tuple(runs), tuple(patterns), np.concatenate(numbers)[largest], every[largest])


def _values(table: CellTable, used: IntArray, total: float, p_values: FloatArray) -> FloatArray:
    """Values of the cells in use of one table, as a map has them."""
    # Each draw has its own total.
    draws, others = table.draws(), total - float(table.coherent.sum())
    drawn_total = draws.sum(axis=(1, 2, 3), keepdims=True) + others
    shares = draws / np.where(drawn_total > 0.0, drawn_total, np.nan)
    low, high = np.quantile(shares, (0.025, 0.975), axis=0)
    share = table.coherent / (total if total > 0.0 else np.nan)
    bands = np.full((table.orders.size, 2), np.nan) if table.bands_hz is None else table.bands_hz
    of_cells = [one[tuple(used.T)] for one in (table.mean_square, table.coherent, share, low, high)]
    return np.column_stack([table.orders[used[:, 2]], *of_cells, p_values, bands[used[:, 2]]])
