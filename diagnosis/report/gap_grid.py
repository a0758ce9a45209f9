"""Gap cells as a grid for the report.

Rows are sensor patterns, or runs where there is one channel; columns orders or bands.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from carrierflex.diagnosis.comparison.problem import BoolArray, FloatArray, GapCell

#: Lines of a periodic drive beyond this number are joined to bands, about this many.
_MOST_COLUMNS = 30
SIGNIFICANCE = 0.01


@dataclass(frozen=True, eq=False)
class GapGrid:
    """RMS of the gap by row and column.

    Parameters
    ----------
    row_name : str
        What the rows are: ``sensor pattern``, ``channel`` or ``run``.
    rows : tuple of str
        Their names.
    edges : ndarray, shape (n_columns + 1,)
        Ends of the columns: frequency [Hz], or shaft order less and plus a half.
    is_frequency : bool
        Which of the two.
    rms : ndarray, shape (n_rows, n_columns)
        RMS of the gap above the noise, over the runs, in the unit of the channels; NaN where the
        map has no cell.
    stands_out : ndarray of bool, shape (n_rows, n_columns)
        Whether a cell of it is beyond chance (adjusted p below 0.01) in any run.
    """

    row_name: str
    rows: tuple[str, ...]
    edges: FloatArray
    is_frequency: bool
    rms: FloatArray
    stands_out: BoolArray


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
    first = maps[0]
    if not first:
        return ()
    runs = sorted({cell.run for cell in first})
    patterns = sorted({cell.channel_pattern for cell in first}, key=_pattern_place)
    by_run = len(patterns) == 1
    rows = tuple(runs if by_run else patterns)
    is_frequency = all(cell.frequency_hz is not None for cell in first)
    edges = _frequency_edges(first) if is_frequency else _order_edges(first)
    of_patterns = any(name.startswith("m=") for name in patterns)
    row_name = "run" if by_run else "sensor pattern" if of_patterns else "channel"
    grids = []
    for cells in maps:
        square = np.full((len(rows), edges.size - 1), np.nan)
        stands_out = np.zeros(square.shape, dtype=bool)
        for cell in cells:
            place = (
                rows.index(cell.run if by_run else cell.channel_pattern),
                _column(cell, edges, is_frequency),
            )
            square[place] = np.nan_to_num(square[place]) + cell.coherent / (
                1 if by_run else len(runs)
            )
            stands_out[place] |= cell.p_value < SIGNIFICANCE and cell.coherent > 0.0
        rms = np.sqrt(np.maximum(square, 0.0))
        grids.append(GapGrid(row_name, rows, edges, is_frequency, rms, stands_out))
    return tuple(grids)


def _pattern_place(name: str) -> tuple[int, str]:
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
    bands = {
        run: sorted({_band(cell) for cell in cells if cell.run == run})
        for run in {cell.run for cell in cells}
    }
    wide = [own for own in bands.values() if any(low < high for low, high in own)]
    if wide:
        coarsest = max(wide, key=lambda own: own[-1][1] / own[-1][0])
        edges = [low for low, _ in coarsest if low > 0.0] + [coarsest[-1][1]]
        return np.array([edges[0] / (edges[1] / edges[0]), *edges])
    lines = np.unique([_middle(cell) for cell in cells if _middle(cell) > 0.0])
    places = np.arange(lines.size)
    if lines.size > _MOST_COLUMNS:
        places = np.unique(np.geomspace(1.0, lines.size, _MOST_COLUMNS).round().astype(int)) - 1
    starts = lines[places]
    step = starts[0] if lines.size == 1 else lines[1] - lines[0]
    return np.append(starts - 0.5 * step, lines[-1] + 0.5 * step)
