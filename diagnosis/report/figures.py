"""Figures of the report.

Gap map, forward selection, correlation of the signatures. Matplotlib late.
"""

from typing import TYPE_CHECKING, Any

import numpy as np

from carrierflex.diagnosis.comparison.effect_names import plain_name
from carrierflex.diagnosis.inference.results import GapReduction
from carrierflex.diagnosis.report.gap_grid import GapGrid
from carrierflex.diagnosis.report.svg import (
    BLACK,
    BLUE,
    CHANCE,
    MAGNITUDE_MAP,
    WIDTH,
    scaled_unit,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

#: Dynamic range of the colours of a gap map: at least one decade, at most three.
_FEWEST = 10.0
_MOST = 1e3
#: Cells of a gap map above this share of the largest carry their number.
_NUMBERED = 0.1
#: Effects in the matrix of correlations at most; correlation from which a cell carries its number.
MOST_EFFECTS = 12
_NUMBERED_CORRELATION = 0.5
#: Ratios below this are told apart on a logarithmic axis only.
_SMALL_RATIO = 0.2


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
    """RMS of the gap by row and column, logarithmic colours.

    Cells within chance are grey, those the map lacks white.

    Parameters
    ----------
    grid : GapGrid
        What is drawn.
    limits : tuple of float
        RMS at both ends of the colours; the same for maps that are compared.
    unit : str
        Unit of the channels.

    Returns
    -------
    matplotlib.figure.Figure
        Heat map with its scale below.
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
        grid.edges, lines, known, cmap=ListedColormap([CHANCE]), edgecolors="white", linewidth=0.3
    )
    image = panel.pcolormesh(
        grid.edges,
        lines,
        np.ma.masked_invalid(shown),
        norm=norm,
        cmap=MAGNITUDE_MAP,
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
    """Numbers in full on a logarithmic axis.

    At every decade, at 2 and 5 between where there are few decades.
    """
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


def selection_figure(reduction: GapReduction) -> "Figure":
    """Held-out rho as the accepted effects are added in turn, with intervals.

    Beside it negative control, black-box reference and noise floor as lines.

    Parameters
    ----------
    reduction : GapReduction
        Steps and the levels of the lines.

    Returns
    -------
    matplotlib.figure.Figure
        One row for each step.
    """
    from matplotlib.figure import Figure

    rho = np.array([step.rho for step in reduction.steps])
    ends = np.array([step.rho_ci95 for step in reduction.steps])
    lines = _level_lines(reduction)
    figure = Figure(figsize=(WIDTH, 1.45 + 0.36 * rho.size), layout="constrained")
    panel = figure.subplots()
    for value, name, style, colour in lines:
        panel.axvline(
            value, linestyle=style, color=colour, linewidth=1.4, label=f"{name}: {value:.3f}"
        )
    known = np.isfinite(ends).all(axis=1)
    reach = np.abs(np.where(known[:, None], ends, rho[:, None]) - rho[:, None]).T
    panel.errorbar(
        rho,
        np.arange(rho.size),
        xerr=reach,
        fmt="o",
        color=BLUE,
        capsize=4,
        markersize=6,
        linewidth=1.6,
    )
    above: dict[str, Any] = {
        "xytext": (0, 8),
        "textcoords": "offset points",
        "ha": "center",
        "fontsize": 8,
        "color": BLUE,
    }
    for row, value in enumerate(rho):
        box = {"facecolor": "white", "edgecolor": "none", "pad": 0.6}
        panel.annotate(f"{value:.3f}", (value, row), bbox=box, **above)
    panel.set_yticks(
        range(rho.size), [_step_name(k, step.added) for k, step in enumerate(reduction.steps)]
    )
    panel.set_ylim(rho.size - 0.5, -0.7)
    _ratio_axis(panel, [*rho, *ends[known].ravel(), *(line[0] for line in lines)])
    figure.legend(loc="outside lower center", ncols=2, fontsize=8, frameon=False)
    return figure


def _level_lines(reduction: GapReduction) -> list[tuple[float, str, str, str]]:
    """Value, name, stroke and colour of the known lines that the steps are read against."""
    floor = (
        reduction.noise_floor / reduction.rms_before if reduction.rms_before > 0.0 else float("nan")
    )
    lines = [
        (floor, "noise floor", "--", BLACK),
    ]
    return [line for line in lines if np.isfinite(line[0]) and line[0] > 0.0]


def _ratio_axis(panel: "Axes", shown: list[float]) -> None:
    """Axis of ratios from zero, or logarithmic where small ones are among them."""
    smallest, largest = min(shown), max(shown)
    if smallest < _SMALL_RATIO:
        panel.set_xscale("log")
        panel.set_xlim(smallest / 1.5, 1.6 * largest)
        _plain_numbers(panel.xaxis, smallest / 1.5, 1.6 * largest)
    else:
        panel.set_xlim(0.0, 1.15 * largest)
    panel.set_xlabel("rho = RMS after / before, held-out records [-]")
    panel.grid(axis="x", alpha=0.25)


def _step_name(row: int, added: str) -> str:
    name = plain_name(added)
    return name if row == 0 else "+ " + (name.replace(" ", "\n", 1) if len(name) > 18 else name)
