"""Gap cells as a grid for the report.

Rows are sensor patterns, or runs where there is one channel; columns orders or bands.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.comparison.problem import BoolArray, FloatArray, GapCell
from carrierflex.diagnosis.gap.gap_map import GapMap, map_of

IntArray = NDArray[np.int64]

#: Lines of a periodic drive beyond this number are joined to bands, about this many.
_MOST_COLUMNS = 30


@dataclass(frozen=True, eq=False)
class GapGrid:
    """RMS of the gap by row and column.

    Parameters
    ----------
    row_name : str
        What the rows are: ``sensor pattern``, ``motion or sensor`` or ``run``.
    rows : tuple of str
        Their names.
    edges : ndarray, shape (n_columns + 1,)
        Ends of the columns: frequency [Hz], or shaft order less and plus a half.
    is_frequency : bool
        Which of the two.
    rms : ndarray, shape (n_rows, n_columns)
        RMS of the gap above the noise, over the runs, in the unit of the channels; NaN where the
        map has no cell.
    is_significant : ndarray of bool, shape (n_rows, n_columns)
        Whether a cell of it is beyond chance in any run.
    """

    row_name: str
    rows: tuple[str, ...]
    edges: FloatArray
    is_frequency: bool
    rms: FloatArray
    is_significant: BoolArray


def gap_grids(*maps: Sequence[GapCell]) -> tuple[GapGrid, ...]:
    """Grids of several gap maps of the same records, with the same rows and columns.

    Parameters
    ----------
    *maps : sequence of GapCell
        Gap maps; the first sets rows and columns.

    Returns
    -------
    tuple of GapGrid
        One for each map; none where the first is empty.
    """
    own = [map_of(cells) for cells in maps]
    is_frequency = not np.isnan(own[0].bands_hz[:, 0]).any()
    if not is_frequency:
        # Lines beside the orders have no column of their own; tables and words tell them.
        own = [cells.on_orders() for cells in own]
    first = own[0]
    if not first:
        return ()
    runs = sorted(first.runs[k] for k in np.unique(first.places[:, 0]))
    patterns = sorted(
        (first.patterns[k] for k in np.unique(first.places[:, 1])), key=_pattern_position
    )
    edges = _frequency_edges(first) if is_frequency else _order_edges(first)
    if len(patterns) == 1:
        blank = _blank_grid("run", runs, edges, is_frequency)
        return tuple(
            _filled(blank, cells, cells.runs, cells.places[:, 0], n_runs=1) for cells in own
        )
    of_patterns = any(name.startswith("m=") for name in patterns)
    blank = _blank_grid(
        "sensor pattern" if of_patterns else "motion or sensor", patterns, edges, is_frequency
    )
    return tuple(
        _filled(blank, cells, cells.patterns, cells.places[:, 1], n_runs=len(runs)) for cells in own
    )


def _blank_grid(
    row_name: str, rows: Sequence[str], edges: FloatArray, is_frequency: bool
) -> GapGrid:
    """Grid without cells."""
    shape = (len(rows), edges.size - 1)
    return GapGrid(
        row_name=row_name,
        rows=tuple(rows),
        edges=edges,
        is_frequency=is_frequency,
        rms=np.full(shape, np.nan),
        is_significant=np.zeros(shape, dtype=bool),
    )


def _filled(
    blank: GapGrid, cells: GapMap, names: Sequence[str], name_of: IntArray, *, n_runs: int
) -> GapGrid:
    """Grid with the coherent gap of the cells, a mean over `n_runs` runs in every row.

    `names` hold those of the rows, `name_of` the number of every cell's among them.
    """
    row_of_name = np.array([_place(blank.rows, name) for name in names], dtype=np.int64)
    place = np.ravel_multi_index(
        (row_of_name[name_of], _columns(cells, blank.edges, blank.is_frequency)), blank.rms.shape
    )

    def sums(values: FloatArray) -> FloatArray:
        """Sums of the cells' values by row and column."""
        flat = np.bincount(place, values, minlength=blank.rms.size)
        return np.asarray(flat.reshape(blank.rms.shape), dtype=np.float64)

    square = np.maximum(sums(cells.coherent / n_runs), 0.0)
    is_filled = sums(np.ones(len(cells))) > 0.0
    return replace(
        blank,
        rms=np.sqrt(np.where(is_filled, square, np.nan)),
        is_significant=sums(cells.are_significant.astype(np.float64)) > 0.0,
    )


def _place(rows: Sequence[str], name: str) -> int:
    """Place of a row; of names that no cell has any other, since nothing is counted there."""
    return rows.index(name) if name in rows else 0


def _pattern_position(name: str) -> tuple[int, str]:
    """Sensor patterns in the order 0, +1, -1, 2, channels after them by name."""
    known = ("m=0", "m=+1", "m=-1", "m=2")
    return (known.index(name) if name in known else len(known), name)


def _middles(cells: GapMap) -> FloatArray:
    """Geometric middle of every cell's band; arithmetic where it begins at zero."""
    low, high = cells.bands_hz.T
    return np.where(low > 0.0, np.sqrt(low * high), 0.5 * high)


def _columns(cells: GapMap, edges: FloatArray, is_frequency: bool) -> IntArray:
    """Column of every cell."""
    values = _middles(cells) if is_frequency else cells.orders
    return np.clip(np.searchsorted(edges, values, side="right") - 1, 0, edges.size - 2)


def _order_edges(cells: GapMap) -> FloatArray:
    orders = np.round(cells.orders)
    return np.arange(orders.min(), orders.max() + 2.0) - 0.5


def _frequency_edges(cells: GapMap) -> FloatArray:
    """Edges of the coarsest bands in use.

    Lines, which have no width, are joined until few enough are left.
    """
    run_of = cells.places[:, 0]
    bands_of_runs = [
        np.unique(cells.bands_hz[run_of == run], axis=0).tolist() for run in np.unique(run_of)
    ]
    wide = [bands for bands in bands_of_runs if any(low < high for low, high in bands)]
    if wide:
        coarsest = max(wide, key=lambda bands: bands[-1][1] / bands[-1][0])
        edges = [low for low, _ in coarsest if low > 0.0] + [coarsest[-1][1]]
        return np.array([edges[0] / (edges[1] / edges[0]), *edges])
    middles = _middles(cells)
    lines = np.unique(middles[middles > 0.0])
    first_lines = np.arange(lines.size)
    if lines.size > _MOST_COLUMNS:
        spaced = np.geomspace(1.0, lines.size, _MOST_COLUMNS)
        first_lines = np.unique(spaced.round().astype(int)) - 1
    starts = lines[first_lines]
    step = starts[0] if lines.size == 1 else lines[1] - lines[0]
    return np.append(starts - 0.5 * step, lines[-1] + 0.5 * step)
