"""Figures of the report as inline SVG: shapes, signals, loops, polar plots and gap maps.

Text stays text, identifiers are unique on the page, a title for screen readers. Matplotlib late.
"""

import io
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from markupsafe import Markup

from carrierflex.diagnosis.classes.results import BesideCurve, MeasuredShape
from carrierflex.diagnosis.comparison.overlay import (
    GAP,
    LAW,
    REMAINDER,
    Overlay,
    Panel,
    Picture,
    is_function,
)
from carrierflex.diagnosis.comparison.problem import BoolArray, FloatArray, GapCell
from carrierflex.diagnosis.gap.gap_map import GapMap, map_of
from carrierflex.files.quantities import scaled_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure


#: Width of every figure [in]: on a phone it is shown at about its own size, so that its text stays
#: readable.
WIDTH = 4.4
#: Colours that differ in lightness and for every kind of colour vision (Okabe and Ito 2008).
BLUE = "#0072b2"
ORANGE = "#d55e00"
BLACK = "#000000"
GREY = "#6b6b6b"

_STYLE: dict[Any, Any] = {
    "svg.fonttype": "none",  # selectable, and a tenth of the size of outlines
    "svg.hashsalt": "carrierflex",  # the same figure gives the same file
    "text.parse_math": False,  # a $ in the name of a channel begins no formula
    "font.size": 9.0,
    "axes.linewidth": 0.7,
    "axes.titlesize": 9.5,
}


def inline_svg(draw: "Callable[[], Figure]", key: str, title: str) -> Markup:
    """SVG element of a figure without fixed size; its identifiers start with `key`."""
    from matplotlib import rc_context
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    file = io.StringIO()
    with rc_context(_STYLE):
        figure = draw()
        engine = figure.get_layout_engine()
        if engine is not None:
            # Saving would draw the figure twice, once for the places of its axes alone.
            FigureCanvasSVG(figure)
            engine.execute(figure)
            figure.set_layout_engine(None)
        metadata = {"Date": None, "Creator": None}
        figure.savefig(file, format="svg", transparent=True, metadata=metadata)
    text = file.getvalue()
    text = text[text.index("<svg") :].strip()
    text = re.sub(r"<metadata>.*?</metadata>", "", text, count=1, flags=re.DOTALL)
    text = re.sub(r'(\bid="|href="#|url\(#)', rf"\g<1>{key}-", text)
    head, body = text.split(">", 1)
    head = re.sub(r'\s(?:width|height)="[^"]*"', "", head)
    labelled = f'{head} role="img" aria-labelledby="{key}-title">'
    return Markup(f'{labelled}<title id="{key}-title">{escape(title)}</title>{body}')


def shape_figure(shape: MeasuredShape, law: str) -> "Figure":
    """Curve of a class over the visited range."""
    from matplotlib.figure import Figure

    x_factor, x_unit = scaled_unit(float(abs(shape.x).max()), shape.units[0])
    y_factor, y_unit = scaled_unit(float(abs(shape.y).max()), shape.units[1])
    figure = Figure(figsize=(WIDTH, 2.9), layout="constrained")
    panel = figure.subplots()
    x = x_factor * shape.x
    is_curve = bool((x[1:] >= x[:-1]).all())
    curves: tuple[MeasuredShape | BesideCurve, ...] = (shape, *shape.beside)
    for one in curves:
        colour, band = (BLUE, "95 % band") if one is shape else (ORANGE, None)
        low, high = y_factor * one.band.T
        at = x_factor * one.x
        if is_curve:
            panel.fill_between(at, low, high, color=colour, alpha=0.25, linewidth=0.0, label=band)
        panel.plot(at, y_factor * one.y, color=colour, linewidth=1.6, label=one.name)
    if shape.law.size:
        panel.plot(x, y_factor * shape.law, color=BLACK, linestyle="--", linewidth=1.2, label=law)
    panel.set_xlabel(f"{shape.labels[0]} [{x_unit}]")
    panel.set_ylabel(f"{shape.labels[1]} [{y_unit}]")
    panel.legend(fontsize=8, frameon=False)
    return figure


#: Samples of a stretch of time at most, and mean crossings of the signal in it at least.
_MOST_SAMPLES, _CROSSINGS = 400, 12


def signal_figure(before: Overlay, after: Overlay | None, unit: str) -> "Figure":
    """Signals above, what is left of the gap below."""
    from matplotlib.figure import Figure

    x, measured = before.x, before.measured
    factor, shown = scaled_unit(float(np.nanmax(np.abs(measured))), unit)
    gap = measured - before.simulated
    gap_factor, gap_unit = scaled_unit(float(np.nanmax(np.abs(gap))), unit)
    figure = Figure(figsize=(WIDTH, 2.55), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    upper.plot(x, factor * measured, color=BLACK, linewidth=2.6, alpha=0.35, label="measured")
    lower.axhline(0.0, color=GREY, linewidth=0.6)
    for overlay, name, colour, dashes in (
        (before, "simulated, before", ORANGE, "--"),
        (after, "simulated, after", BLUE, "-"),
    ):
        if overlay is None:
            continue
        upper.plot(x, factor * overlay.simulated, dashes, color=colour, linewidth=1.3, label=name)
        rest = gap_factor * (overlay.measured - overlay.simulated)
        lower.plot(x, rest, dashes, color=colour, linewidth=1.1)
    upper.set_ylabel(f"{shortened(before.channel, 10)} [{shown}]")
    lower.set_ylabel(f"gap [{gap_unit}]")
    lower.set_xlabel(f"{before.x_name} [{before.x_unit}]")
    if before.x_unit == "deg":
        lower.set_xticks(range(0, 361, 60))
        lower.set_xlim(0.0, 360.0)
    for panel in (upper, lower):
        panel.grid(alpha=0.25)
        panel.margins(x=0.0)
    figure.align_ylabels()
    figure.legend(loc="outside upper center", ncols=3, fontsize=8, frameon=False, handlelength=1.6)
    return figure


def shortened(name: str, most: int) -> str:
    """Name that an axis has room for; a longer one ends with an ellipsis."""
    return name if len(name) <= most else f"{name[: most - 1]}…"


def stretch_of(overlay: Overlay) -> slice:
    """What is drawn of a signal: the whole turn, or a stretch of time about the largest gap."""
    if overlay.x_unit == "deg":
        return slice(None)
    n = overlay.x.size
    length = min(_MOST_SAMPLES, n)
    level = np.nan_to_num(overlay.measured - np.nanmean(overlay.measured))
    crossings = np.count_nonzero(np.diff(np.signbit(level)))
    if crossings > _CROSSINGS:
        length = int(np.clip(n * _CROSSINGS / crossings, 60, n))
    length = min(length, n)
    square = np.nan_to_num(overlay.measured - overlay.simulated) ** 2
    total = np.concatenate([[0.0], np.cumsum(square)])
    first = int(np.argmax(total[length:] - total[:-length]))
    return slice(first, first + length)


#: Colour and stroke of every role.
_ROLE_STROKES = {
    GAP: {"color": BLUE, "linewidth": 1.8, "linestyle": "-"},
    LAW: {"color": BLACK, "linewidth": 1.4, "linestyle": "--"},
    REMAINDER: {"color": ORANGE, "linewidth": 1.6, "linestyle": "-"},
}
_SHADE_MAP = "cividis"
_MARK = {
    "ha": "center",
    "va": "center",
    "fontsize": 6.5,
    "color": GREY,
    "bbox": {"boxstyle": "circle,pad=0.25", "facecolor": "white", "edgecolor": GREY, "lw": 0.7},
}


def panel_figure(picture: Picture, panel: Panel) -> "Figure":
    """One panel of a picture."""
    return _polar_figure(picture, panel) if picture.is_polar else _cloud_figure(picture, panel)


def remainder_factor(picture: Picture) -> float:
    """By how much the remaining gap is drawn larger in polar plots: 1, 2, 5, 10 ... 1000."""
    remainder, gap = (
        _largest([t.y for panel in picture.panels for t in panel.traces if t.role == role])
        for role in (REMAINDER, GAP)
    )
    if remainder <= 0.0 or gap <= 0.0:
        return 1.0
    return float(np.clip(_round_step(0.4 * gap / remainder), 1.0, 1000.0))


def _largest(values: list[FloatArray]) -> float:
    return max((float(np.nanmax(np.abs(array))) for array in values if array.size), default=0.0)


def _cloud_figure(picture: Picture, panel: Panel) -> "Figure":
    from matplotlib.figure import Figure

    traces = [trace for panel in picture.panels for trace in panel.traces]
    x_factor, x_unit = scaled_unit(_largest([trace.x for trace in traces]), picture.x_unit)
    y_factor, y_unit = scaled_unit(_largest([trace.y for trace in traces]), picture.y_unit)
    shades = [trace.shade for trace in traces if trace.shade is not None]
    s_factor, s_unit = scaled_unit(_largest(shades), picture.shade_unit)
    limit = s_factor * _largest(shades)
    colours: dict[str, Any] = {"cmap": _SHADE_MAP, "vmin": -limit, "vmax": limit}
    # Clouds are pixels inside the drawing: thousands of separate marks would swell the file.
    figure = Figure(figsize=(WIDTH, 3.4), layout="constrained", dpi=220)
    axes = figure.subplots()
    for trace in panel.traces:
        x, y = x_factor * trace.x, y_factor * trace.y
        if trace.shade is None:
            # A line through a law that is a function of x, points for a loop.
            if is_function(x, y):
                order = np.argsort(x, kind="stable")
                axes.plot(x[order], y[order], color=ORANGE, linewidth=1.8, zorder=3)
            else:
                axes.plot(x, y, ".", color=ORANGE, markersize=1.8, rasterized=True, zorder=3)
            continue
        shade = s_factor * trace.shade
        cloud = axes.scatter(x, y, 7.0, shade, linewidths=0.0, rasterized=True, **colours)
        figure.colorbar(cloud, ax=axes, label=f"{picture.shade_name} [{s_unit}]", aspect=30)
    axes.axhline(0.0, color=GREY, linewidth=0.6)
    axes.set_xlabel(f"{picture.x_name} [{x_unit}]")
    axes.set_ylabel(f"{picture.y_name} [{y_unit}]")
    axes.grid(alpha=0.25)
    return figure


def _polar_figure(picture: Picture, panel: Panel) -> "Figure":
    from matplotlib.figure import Figure

    every = _largest([trace.y for each in picture.panels for trace in each.traces])
    factor, unit = scaled_unit(every, picture.y_unit)
    reach = factor * every or 1.0
    magnified = remainder_factor(picture)
    figure = Figure(figsize=(0.8 * WIDTH, 0.8 * WIDTH))
    # Every polar plot has the same labels, whose room need not be looked for.
    axes = figure.add_axes((0.13, 0.07, 0.74, 0.74), projection="polar")
    for trace in panel.traces:
        stroke = _ROLE_STROKES[trace.role]
        drawn = (magnified if trace.role == REMAINDER else 1.0) * factor * trace.y
        axes.plot(trace.x, drawn, **stroke, label=trace.role)  # type: ignore[arg-type]
    circle = np.linspace(0.0, 2.0 * np.pi, 181)
    axes.plot(circle, np.zeros(circle.size), ":", color=GREY, linewidth=0.8, zorder=3)
    # Zero circle off the centre, so that negative values have room inside it.
    axes.set_ylim(-1.6 * reach, 1.35 * reach)
    step = _round_step(reach)
    axes.set_yticks([-step, 0.0, step], [f"−{step:g}", "0", f"+{step:g}"])
    axes.set_rlabel_position(88.0)  # type: ignore[attr-defined]
    axes.tick_params(labelsize=7)
    for label in axes.get_yticklabels():
        label.set_bbox({"facecolor": "white", "edgecolor": "none", "pad": 0.4, "alpha": 0.8})
    axes.grid(alpha=0.35)
    # The labels on top of the curves, not under them.
    axes.set_axisbelow(False)
    for text, angle in panel.marks.items():
        axes.text(angle, 1.2 * reach, text, **_MARK)  # type: ignore[arg-type]
    axes.set_title(
        f"{picture.y_name} [{unit}] over {picture.x_name} [{picture.x_unit}]", fontsize=8.5
    )
    return figure


def _round_step(reach: float) -> float:
    """Largest of 1, 2, 5 times a power of ten that is not beyond a reach."""
    power = 10.0 ** np.floor(np.log10(reach))
    steps = [step for step in (1.0, 2.0, 5.0) if step * power <= reach * (1.0 + 1e-9)]
    return float(max(steps) * power)


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
    if is_frequency:
        edges = _frequency_edges(first)
    else:
        orders = np.round(first.orders)
        edges = np.arange(orders.min(), orders.max() + 2.0) - 0.5
    if len(patterns) == 1:
        return tuple(_grid(cells, "run", runs, edges, is_frequency) for cells in gap_maps)
    of_patterns = any(name.startswith("m=") for name in patterns)
    rows = "sensor pattern" if of_patterns else "motion or sensor"
    return tuple(_grid(cells, rows, patterns, edges, is_frequency, len(runs)) for cells in gap_maps)


def _grid(
    cells: GapMap,
    row_name: str,
    rows: Sequence[str],
    edges: FloatArray,
    is_frequency: bool,
    n_runs: int = 1,
) -> GapGrid:
    """Grid with the coherent gap of the cells, a mean over `n_runs` runs in every row."""
    run, pattern = cells.indices.T
    names, name_of = (cells.runs, run) if row_name == "run" else (cells.patterns, pattern)
    # Of names that no cell has any row will do: nothing is counted there.
    row_of_name = np.array([rows.index(one) if one in rows else 0 for one in names], dtype=np.int64)
    values = _middles(cells) if is_frequency else cells.orders
    column = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, edges.size - 2)
    shape = (len(rows), edges.size - 1)
    number = np.ravel_multi_index((row_of_name[name_of], column), shape)

    def sums(values: FloatArray) -> FloatArray:
        """Sums of the cells' values by row and column."""
        flat = np.bincount(number, values, minlength=len(rows) * (edges.size - 1))
        return np.asarray(flat.reshape(shape), dtype=np.float64)

    square = np.maximum(sums(cells.coherent / n_runs), 0.0)
    is_filled = sums(np.ones(len(cells))) > 0.0
    return GapGrid(
        row_name=row_name,
        rows=tuple(rows),
        edges=edges,
        is_frequency=is_frequency,
        rms=np.sqrt(np.where(is_filled, square, np.nan)),
        is_significant=sums(cells.are_significant.astype(np.float64)) > 0.0,
    )


def _pattern_position(name: str) -> tuple[int, str]:
    """Sensor patterns in the order 0, +1, -1, 2, channels after them by name."""
    known = ("m=0", "m=+1", "m=-1", "m=2")
    return (known.index(name) if name in known else len(known), name)


def _middles(cells: GapMap) -> FloatArray:
    """Geometric middle of every cell's band; arithmetic where it begins at zero."""
    low, high = cells.bands_hz.T
    return np.where(low > 0.0, np.sqrt(low * high), 0.5 * high)


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
    if lines.size > 30:  # joined to about as many bands
        spaced = np.geomspace(1.0, lines.size, 30)
        first_lines = np.unique(spaced.round().astype(int)) - 1
    starts = lines[first_lines]
    step = starts[0] if lines.size == 1 else lines[1] - lines[0]
    return np.append(starts - 0.5 * step, lines[-1] + 0.5 * step)


def colour_limits(*grids: GapGrid) -> tuple[float, float]:
    """RMS at both ends of the colours that maps share, of significant cells where there are any."""
    sizes = np.concatenate([grid.rms[grid.is_significant] for grid in grids])
    if not sizes.size:
        sizes = np.concatenate([grid.rms[np.isfinite(grid.rms)] for grid in grids])
    high = float(sizes.max()) or 1.0
    # At least one decade of colours, at most three.
    return float(np.clip(sizes.min(), high / 1e3, high / 10.0)), high


def gap_map_figure(grid: GapGrid, limits: tuple[float, float], unit: str) -> "Figure":
    """RMS of the gap by row and column; cells within chance are grey, those it lacks white."""
    from matplotlib.colors import ListedColormap, LogNorm
    from matplotlib.figure import Figure

    factor, shown_unit = scaled_unit(limits[1], unit)
    low, high = factor * limits[0], factor * limits[1]
    figure = Figure(figsize=(WIDTH, 1.35 + 0.34 * len(grid.rows)), layout="constrained")
    panel = figure.subplots()
    is_shown = grid.is_significant & (factor * grid.rms >= low)
    shown = np.where(is_shown, factor * grid.rms, np.nan)
    lines = np.arange(len(grid.rows) + 1) - 0.5
    known = np.ma.masked_invalid(np.where(np.isfinite(grid.rms), 0.0, np.nan))
    edges: dict[str, Any] = {"edgecolors": "white", "linewidth": 0.3}
    panel.pcolormesh(grid.edges, lines, known, cmap=ListedColormap(["#e6e9ed"]), **edges)
    masked, norm = np.ma.masked_invalid(shown), LogNorm(vmin=low, vmax=high)
    image = panel.pcolormesh(grid.edges, lines, masked, norm=norm, cmap=_SHADE_MAP, **edges)
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
        if np.isfinite(value) and value >= 0.1 * high:
            text = f"{value:.0f}" if high >= 10.0 else f"{value:.1f}"
            at = float(middles[column])
            panel.text(at, row, text, ha="center", va="center", fontsize=size, color=BLACK)
