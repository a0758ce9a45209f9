"""Gap map: cells of all runs, each with its share of the gap, the share's interval and its p-value.

A kind computes tables of cells from its records; from there on every map is made alike. The share
of a cell is ``coherent / sum of coherent``; its interval comes from bootstrap draws of the
repetitions (revolutions, periods or blocks), p-values are adjusted for the number of cells.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from carrierflex.diagnosis.comparison.problem import BoolArray, FloatArray, GapCell
from carrierflex.diagnosis.gap.significance import adjusted

#: Draws of every interval: enough for the 2.5 % quantile of a share to be within a per cent.
N_DRAWS = 200


@dataclass(frozen=True, eq=False)
class CellTable:
    """Cells of the runs whose repetitions are drawn together.

    Parameters
    ----------
    runs, patterns : tuple of str
        Runs; channels or sensor patterns.
    orders : ndarray, shape (n_orders,)
        Shaft orders, lines, or middles of bands.
    mean_square, coherent, p_value : ndarray, shape (n_runs, n_patterns, n_orders)
        Mean square of the gap; the same less the noise; probability without a gap, not adjusted.
    draws : ndarray, shape (N_DRAWS, n_runs, n_patterns, n_orders)
        Coherent part in bootstrap draws of the repetitions.
    bands_hz : ndarray, shape (n_orders, 2), optional
        Ends of the band behind every order [Hz].
    used : ndarray of bool, shape (n_patterns, n_orders), optional
        Cells that exist; all where it is left out.
    """

    runs: tuple[str, ...]
    patterns: tuple[str, ...]
    orders: FloatArray
    mean_square: FloatArray
    coherent: FloatArray
    p_value: FloatArray
    draws: FloatArray
    bands_hz: FloatArray | None = None
    used: BoolArray | None = None

    def is_used(self) -> BoolArray:
        """Cells that exist, shape (n_runs, n_patterns, n_orders)."""
        if self.used is None:
            return np.ones(self.coherent.shape, dtype=bool)
        return np.broadcast_to(self.used, self.coherent.shape)


def gap_cells(tables: Sequence[CellTable]) -> tuple[GapCell, ...]:
    """Gap map of several tables, largest cell first.

    Parameters
    ----------
    tables : sequence of CellTable
        Every run in one of them. Where one is drawn, the others stay as they are.

    Returns
    -------
    tuple of GapCell
        Every used cell; shares are NaN where the coherent parts add up to nothing.
    """
    if not tables:
        return ()
    total = sum(float(table.coherent.sum()) for table in tables)
    p_values = adjusted(np.concatenate([table.p_value[table.is_used()] for table in tables]))
    cells: list[GapCell] = []
    first = 0
    for table in tables:
        n_cells = int(table.is_used().sum())
        cells += _cells(table, total, p_values[first : first + n_cells])
        first += n_cells
    return tuple(sorted(cells, key=lambda cell: -cell.coherent))


def _cells(table: CellTable, total: float, p_values: FloatArray) -> Iterator[GapCell]:
    """Cells of one table; `total` is the coherent part of all tables, `p_values` are adjusted."""
    share = table.coherent / (total or np.nan)
    low, high = _share_intervals(table, total)
    for p_value, (r, p, n) in zip(p_values, np.argwhere(table.is_used()), strict=True):
        band = None
        if table.bands_hz is not None:
            band = (float(table.bands_hz[n, 0]), float(table.bands_hz[n, 1]))
        yield GapCell(
            channel_pattern=table.patterns[p],
            order=float(table.orders[n]),
            run=table.runs[r],
            mean_square=float(table.mean_square[r, p, n]),
            coherent=float(table.coherent[r, p, n]),
            share=float(share[r, p, n]),
            share_ci95=(float(low[r, p, n]), float(high[r, p, n])),
            p_value=float(p_value),
            frequency_hz=band,
        )


def _share_intervals(table: CellTable, total: float) -> tuple[FloatArray, FloatArray]:
    """Both ends of the 95 % interval of every share; each draw has its own total."""
    others = total - float(table.coherent.sum())
    drawn_total = table.draws.sum(axis=(1, 2, 3), keepdims=True) + others
    shares = table.draws / np.where(drawn_total == 0.0, np.nan, drawn_total)
    low, high = np.quantile(shares, (0.025, 0.975), axis=0)
    return low, high
