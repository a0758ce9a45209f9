"""Gap cells as a grid for the report.

Rows are sensor patterns, or runs where there is one channel; columns orders or bands.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from carrierflex.diagnosis.comparison.problem import BoolArray, FloatArray, GapCell
from carrierflex.diagnosis.gap.significance import is_significant

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
    is_frequency = all(cell.frequency_hz is not None for cell in maps[0])
    if not is_frequency:
        # Lines beside the orders have no column of their own; tables and words tell them.
        maps = tuple([cell for cell in cells if cell.frequency_hz is None] for cells in maps)
    first = maps[0]
    if not first:
        return ()
    runs = sorted({cell.run for cell in first})
    patterns = sorted({cell.channel_pattern for cell in first}, key=_pattern_position)
    edges = _frequency_edges(first) if is_frequency else _order_edges(first)
    if len(patterns) == 1:
        blank = _blank_grid("run", runs, edges, is_frequency)
        return tuple(_filled(blank, cells, lambda cell: cell.run, n_runs=1) for cells in maps)
    of_patterns = any(name.startswith("m=") for name in patterns)
    blank = _blank_grid(
        "sensor pattern" if of_patterns else "motion or sensor", patterns, edges, is_frequency
    )
    return tuple(
        _filled(blank, cells, lambda cell: cell.channel_pattern, n_runs=len(runs)) for cells in maps
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
    blank: GapGrid, cells: Sequence[GapCell], row_of: Callable[[GapCell], str], *, n_runs: int
) -> GapGrid:
    """Grid with the coherent gap of the cells, a mean over `n_runs` runs in every row."""
    square = blank.rms.copy()
    beyond = blank.is_significant.copy()
    for cell in cells:
        row = blank.rows.index(row_of(cell))
        column = _column(cell, blank.edges, blank.is_frequency)
        square[row, column] = np.nan_to_num(square[row, column]) + cell.coherent / n_runs
        beyond[row, column] |= is_significant(cell)
    return replace(blank, rms=np.sqrt(np.maximum(square, 0.0)), is_significant=beyond)


def _pattern_position(name: str) -> tuple[int, str]:
    """Sensor patterns in the order 0, +1, -1, 2, channels after them by name."""
    known = ("m=0", "m=+1", "m=-1", "m=2")
    return (known.index(name) if name in known else len(known), name)


def _band(cell: GapCell) -> tuple[float, float]:
    assert cell.frequency_hz is not None
    return cell.frequency_hz


def _middle(cell: GapCell) -> float:
    """Geometric middle of a cell's band; arithmetic where it begins at zero."""
    low, high = _band(cell)
    return float(np.sqrt(low * high)) if low > 0.0 else 0.5 * high


def _column(cell: GapCell, edges: FloatArray, is_frequency: bool) -> int:
    value = _middle(cell) if is_frequency else cell.order
    return int(np.clip(np.searchsorted(edges, value, side="right") - 1, 0, edges.size - 2))


def _order_edges(cells: Sequence[GapCell]) -> FloatArray:
    orders = [round(cell.order) for cell in cells]
    return np.arange(min(orders), max(orders) + 2, dtype=np.float64) - 0.5


def _frequency_edges(cells: Sequence[GapCell]) -> FloatArray:
    """Edges of the coarsest bands in use.

    Lines, which have no width, are joined until few enough are left.
    """
    bands_of_runs = [
        sorted({_band(cell) for cell in cells if cell.run == run})
        for run in {cell.run for cell in cells}
    ]
    wide = [bands for bands in bands_of_runs if any(low < high for low, high in bands)]
    if wide:
        coarsest = max(wide, key=lambda bands: bands[-1][1] / bands[-1][0])
        edges = [low for low, _ in coarsest if low > 0.0] + [coarsest[-1][1]]
        return np.array([edges[0] / (edges[1] / edges[0]), *edges])
    lines = np.unique([_middle(cell) for cell in cells if _middle(cell) > 0.0])
    first_lines = np.arange(lines.size)
    if lines.size > _MOST_COLUMNS:
        spaced = np.geomspace(1.0, lines.size, _MOST_COLUMNS)
        first_lines = np.unique(spaced.round().astype(int)) - 1
    starts = lines[first_lines]
    step = starts[0] if lines.size == 1 else lines[1] - lines[0]
    return np.append(starts - 0.5 * step, lines[-1] + 0.5 * step)
