"""Gap map as a figure. Matplotlib late.

Rows of a map are sensor patterns, or runs where there is one channel; columns orders or bands.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.comparison.problem import BoolArray, FloatArray, GapCell
from carrierflex.diagnosis.gap.gap_map import GapMap, map_of
from carrierflex.diagnosis.report.figures import BLACK, WIDTH
from carrierflex.diagnosis.report.words import scaled_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure


IntArray = NDArray[np.int64]

#: Lines of a periodic drive beyond this number are joined to bands, about this many.
_MOST_COLUMNS = 30


@dataclass(frozen=True, eq=False)
class GapGrid:
    """RMS of the gap by row and column."""

    row_name: Annotated[
        str, "What the rows are: ``sensor pattern``, ``motion or sensor`` or ``run``"
    ]
    rows: Annotated[tuple[str, ...], "Their names"]
    edges: Annotated[
        FloatArray,
        "Ends of the columns: frequency [Hz], or shaft order less and plus a half, shape "
        "(n_columns + 1,)",
    ]
    is_frequency: Annotated[bool, "Which of the two"]
    rms: Annotated[
        FloatArray,
        "RMS of the gap above the noise, over the runs, in the unit of the channels; NaN where "
        "the map has no cell, shape (n_rows, n_columns)",
    ]
    is_significant: Annotated[
        BoolArray, "Whether a cell of it is beyond chance in any run, shape (n_rows, n_columns)"
    ]


def gap_grids(*maps: Sequence[GapCell]) -> tuple[GapGrid, ...]:
    """Grids of gap maps of the same records; the first sets rows and columns."""
    gap_maps = [map_of(cells) for cells in maps]
    is_frequency = not np.isnan(gap_maps[0].bands_hz[:, 0]).any()
    if not is_frequency:
        # Lines beside the orders have no column of their own; tables and words tell them.
        gap_maps = [cells.on_orders() for cells in gap_maps]
    first = gap_maps[0]
    if not first:
        return ()
    runs = sorted(first.runs[k] for k in np.unique(first.indices[:, 0]))
    patterns = sorted(
        (first.patterns[k] for k in np.unique(first.indices[:, 1])), key=_pattern_position
    )
    edges = _frequency_edges(first) if is_frequency else _order_edges(first)
    if len(patterns) == 1:
        blank = _blank_grid("run", runs, edges, is_frequency)
        return tuple(
            _filled(blank, cells, cells.runs, cells.indices[:, 0], n_runs=1) for cells in gap_maps
        )
    of_patterns = any(name.startswith("m=") for name in patterns)
    blank = _blank_grid(
        "sensor pattern" if of_patterns else "motion or sensor", patterns, edges, is_frequency
    )
    return tuple(
        _filled(blank, cells, cells.patterns, cells.indices[:, 1], n_runs=len(runs))
        for cells in gap_maps
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
    """Grid with the coherent gap of the cells, a mean over `n_runs` runs in every row."""
    row_of_name = np.array([_row_number(blank.rows, name) for name in names], dtype=np.int64)
    number = np.ravel_multi_index(
        (row_of_name[name_of], _columns(cells, blank.edges, blank.is_frequency)), blank.rms.shape
    )

    def sums(values: FloatArray) -> FloatArray:
        """Sums of the cells' values by row and column."""
        flat = np.bincount(number, values, minlength=blank.rms.size)
        return np.asarray(flat.reshape(blank.rms.shape), dtype=np.float64)

    square = np.maximum(sums(cells.coherent / n_runs), 0.0)
    is_filled = sums(np.ones(len(cells))) > 0.0
    return replace(
        blank,
        rms=np.sqrt(np.where(is_filled, square, np.nan)),
        is_significant=sums(cells.are_significant.astype(np.float64)) > 0.0,
    )


def _row_number(rows: Sequence[str], name: str) -> int:
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
    """Edges of the coarsest bands in use."""
    run_of = cells.indices[:, 0]
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


_MAGNITUDE_MAP = "cividis"
#: Cells within chance.
_CHANCE = "#e6e9ed"
#: Dynamic range of the colours of a gap map: at least one decade, at most three.
_FEWEST = 10.0
_MOST = 1e3
#: Cells of a gap map above this share of the largest carry their number.
_NUMBERED = 0.1


def colour_limits(*grids: GapGrid) -> tuple[float, float]:
    """RMS at both ends of the colours that maps share.

    Of the significant cells of any of them; of all cells where none is.
    """
    sizes = np.concatenate([grid.rms[grid.is_significant] for grid in grids])
    if not sizes.size:
        sizes = np.concatenate([grid.rms[np.isfinite(grid.rms)] for grid in grids])
    high = float(sizes.max()) or 1.0
    return float(np.clip(sizes.min(), high / _MOST, high / _FEWEST)), high


def gap_map_figure(grid: GapGrid, limits: tuple[float, float], unit: str) -> "Figure":
    """RMS of the gap by row and column, logarithmic colours between the limits.

    Cells within chance are grey, those the map lacks white. Compared maps share the limits.
    """
    from matplotlib.colors import ListedColormap, LogNorm
    from matplotlib.figure import Figure

    factor, shown_unit = scaled_unit(limits[1], unit)
    low, high = factor * limits[0], factor * limits[1]
    figure = Figure(figsize=(WIDTH, 1.35 + 0.34 * len(grid.rows)), layout="constrained")
    panel = figure.subplots()
    is_shown = grid.is_significant & (factor * grid.rms >= low)
    shown = np.where(is_shown, factor * grid.rms, np.nan)
    norm = LogNorm(vmin=low, vmax=high)
    lines = np.arange(len(grid.rows) + 1) - 0.5
    known = np.ma.masked_invalid(np.where(np.isfinite(grid.rms), 0.0, np.nan))
    panel.pcolormesh(
        grid.edges, lines, known, cmap=ListedColormap([_CHANCE]), edgecolors="white", linewidth=0.3
    )
    image = panel.pcolormesh(
        grid.edges,
        lines,
        np.ma.masked_invalid(shown),
        norm=norm,
        cmap=_MAGNITUDE_MAP,
        edgecolors="white",
        linewidth=0.3,
    )
    panel.set_yticks(range(len(grid.rows)), grid.rows)
    panel.set_ylabel(grid.row_name)
    panel.invert_yaxis()
    panel.tick_params(axis="y", length=0)
    if grid.is_frequency:
        panel.set_xscale("log")
        _plain_numbers(panel.xaxis, grid.edges[0], grid.edges[-1])
        panel.set_xlabel("frequency [Hz]")
    else:
        panel.set_xlabel("order of carrier rotation [per turn]")
        # The highest order is four times the number of planets: their orders are numbered.
        step = 1 if grid.edges.size < 16 else max(1, int(grid.edges[-1]) // 4)
        panel.set_xticks(np.arange(np.ceil(grid.edges[0]), grid.edges[-1], step))
        _number_cells(panel, grid, shown, high)
    bar = figure.colorbar(
        image, ax=panel, orientation="horizontal", aspect=40, label=f"RMS of the gap [{shown_unit}]"
    )
    _plain_numbers(bar.ax.xaxis, low, high)
    return figure


def _plain_numbers(axis: "Axis", low: float, high: float) -> None:
    """Numbers in full on a logarithmic axis."""
    from matplotlib.ticker import LogLocator, NullFormatter

    axis.set_major_locator(LogLocator(subs=(1.0,) if high > 100.0 * low else (1.0, 2.0, 5.0)))
    axis.set_major_formatter("{x:g}")
    axis.set_minor_formatter(NullFormatter())


def _number_cells(panel: "Axes", grid: GapGrid, shown: np.ndarray, high: float) -> None:
    middles = 0.5 * (grid.edges[1:] + grid.edges[:-1])
    # Three digits in a narrow column.
    size = 7.0 if middles.size <= 12 else 5.2
    for (row, column), value in np.ndenumerate(shown):
        if np.isfinite(value) and value >= _NUMBERED * high:
            text = f"{value:.0f}" if high >= 10.0 else f"{value:.1f}"
            panel.text(
                float(middles[column]),
                row,
                text,
                ha="center",
                va="center",
                fontsize=size,
                color=BLACK,
            )
